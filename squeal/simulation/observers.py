"""What is watched along a run. Each observer sees the legs and changes as they come and keeps no
more than its own result, so memory does not grow with the length of the run."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from squeal.io.scene import Scene
from squeal.io.scene_keys import COORDINATES
from squeal.model.equations import PadModel
from squeal.model.states import State
from squeal.model.units import Units
from squeal.simulation.legs import Leg

HALVINGS = 60  # of a step: to the last digit of a time in it


class Observer:
    """Sees every leg and contact change; `dense` tells that it needs the motion in between."""

    dense = False

    def leg(self, leg: Leg) -> None:
        """A leg of smooth motion, in natural units."""

    def change(self, t: float, source: State, target: State) -> None:
        """A contact change at natural time t."""

    def result(self) -> dict[str, Any]:
        """Fields of `Simulation` that this observer fills."""
        return {}


class Change(NamedTuple):
    """A contact change at natural time t."""

    t: float
    source: State
    target: State


class Events(Observer):
    """The list of contact changes."""

    def __init__(self) -> None:
        self._changes: list[Change] = []

    def change(self, t: float, source: State, target: State) -> None:
        self._changes.append(Change(t, source, target))

    def result(self) -> dict[str, Any]:
        return {"events": self._changes}


class Shares(Observer):
    """Share of time spent in each contact state."""

    def __init__(self, model: PadModel, stop: float) -> None:
        self._model, self._stop = model, stop
        self._time = dict.fromkeys(model.law.meanings, 0.0)

    def leg(self, leg: Leg) -> None:
        self._time[self._model.state_name(leg.contact)] += leg.t1 - leg.t0

    def result(self) -> dict[str, Any]:
        return {"shares": {state: spent / self._stop for state, spent in self._time.items()}}


Signal = Callable[[np.ndarray], np.ndarray]


def _sampled(nodes: np.ndarray) -> np.ndarray:
    """Times at 12 places of each step, and the last one."""
    grid = np.linspace(0.0, 1.0, 12, endpoint=False)
    return np.append((nodes[:-1, None] + np.diff(nodes)[:, None] * grid).ravel(), nodes[-1])


def _peak(signal: Signal, times: np.ndarray, i: int, best: float) -> tuple[float, float]:
    """Time and value of the maximum next to sample i, whose value is `best`.

    Its bracket is sampled anew four times, which leaves the value exact to rounding.
    """
    at = float(times[i])
    for _ in range(4):
        times = np.linspace(times[max(i - 1, 0)], times[min(i + 1, len(times) - 1)], 41)
        values = signal(times)
        if np.isnan(values).all():
            break
        i = int(np.nanargmax(values))
        if values[i] > best:
            at, best = float(times[i]), float(values[i])
    return at, best


def _beyond(values: np.ndarray, i: int) -> float:
    """A bound on the maximum next to the greatest sample i: a peak between two samples rises above
    the higher one by less than that one rises above the lower."""
    return float(2.0 * values[i] - np.nanmin(values[max(i - 1, 0) : i + 2]))


class Extrema(Observer):
    """Least and greatest values of the plotted signals, forces over F_n and delta over w."""

    dense = True

    def __init__(self, model: PadModel) -> None:
        self._model = model
        self._forces = np.array([signal.is_force for signal in model.law.plotted])
        # greatest values of each signal and of its negative
        self._tops = np.full((2, len(self._forces)), -np.inf)

    def leg(self, leg: Leg) -> None:
        if not any(leg.contact):
            self._tops[:, self._forces] = np.maximum(self._tops[:, self._forces], 0.0)
            return
        t = _sampled(leg.nodes)  # type: ignore[arg-type]
        values = signals(self._model, leg, t)
        for way, sign in enumerate((1.0, -1.0)):
            for which in range(len(values)):
                rising = sign * values[which]
                if np.isnan(rising).all():  # a touch too short and light to tell where it acts
                    continue
                i, top = int(np.nanargmax(rising)), self._tops[way, which]
                if _beyond(rising, i) > top:

                    def one(at: np.ndarray, n: int = which, s: float = sign) -> np.ndarray:
                        return s * signals(self._model, leg, at)[n]

                    _, peak = _peak(one, t, i, float(rising[i]))
                    self._tops[way, which] = max(top, peak)

    def result(self) -> dict[str, Any]:
        ranges = zip(self._model.law.plotted, *self._tops, strict=True)
        found = {
            signal.name: (float(-low), float(high)) if np.isfinite(high) else None
            for signal, high, low in ranges
        }
        return {"extrema": found}


def signals(model: PadModel, leg: Leg, t: np.ndarray) -> np.ndarray:
    """The normalised signals at times t within a leg, shape (signals, len(t))."""
    states = leg.dense(t)  # type: ignore[misc]
    return normalised(model, states, leg.contact)


def normalised(model: PadModel, states: np.ndarray, contact: State) -> np.ndarray:
    """The plotted signals of scaled states (n, 6), each over its scale (F_n or w)."""
    values = model.signals(model.c.place(states.T), contact)
    for value, signal in zip(values, model.law.plotted, strict=True):
        if signal.is_force:  # a located contact change leaves some rounding below zero
            np.maximum(value, 0.0, out=value)
        value /= getattr(model.pad, signal.over)
    return values


class Samples(Observer):
    """The states (n, 6) at given rising times (n,), all in natural units."""

    dense = True

    def __init__(self, times: np.ndarray) -> None:
        self.times, self.states = times, np.full((len(times), 6), np.nan)

    def leg(self, leg: Leg) -> None:
        i = np.searchsorted(self.times, leg.t0)
        j = np.searchsorted(self.times, leg.t1, side="right")
        if j > i:
            self.states[i:j] = leg.dense(self.times[i:j])  # type: ignore[misc]


class History(Observer):
    """Samples of state, contact and signals at equal steps of time."""

    dense = True

    def __init__(self, model: PadModel, units: Units, stop: float, samples: int) -> None:
        self._model, self._units = model, units
        self._seconds = np.linspace(0.0, stop, samples)
        self._t = self._seconds / units.time
        self._next = 0
        self._states = np.empty((samples, 6))
        self._signals = np.empty((len(model.law.plotted), samples))
        self._contact = np.empty(samples, dtype="<U2")

    def leg(self, leg: Leg) -> None:
        last = int(np.searchsorted(self._t, leg.t1, side="right"))
        part = slice(self._next, last)
        if last > self._next:
            states = leg.dense(self._t[part])  # type: ignore[misc]
            self._states[part] = states
            self._signals[:, part] = normalised(self._model, states, leg.contact)
            self._contact[part] = self._model.state_name(leg.contact)
            self._next = last

    def result(self) -> dict[str, Any]:
        columns = {"t": self._seconds}
        si = self._units.to_si(self._states)
        columns |= dict(zip(COORDINATES, si.T, strict=True))
        columns["state"] = self._contact
        for signal, values in zip(self._model.law.plotted, self._signals, strict=True):
            columns[signal.name] = values
        return {"history": columns}


class Sliding(Observer):
    """Whether the surface stays faster than the pad, as every equation assumes (finding E16)."""

    dense = True

    def __init__(self, units: Units, speed: float) -> None:
        self._units, self._speed = units, speed / units.velocity
        self._lost: float | None = None

    def leg(self, leg: Leg) -> None:
        if self._lost is not None:
            return

        def excess(at: np.ndarray) -> np.ndarray:
            return leg.dense(at)[:, 3] - self._speed  # type: ignore[misc]

        t = _sampled(leg.nodes)  # type: ignore[arg-type]
        e = excess(t)
        # a peak between two samples rises above the higher one by less than that over the lower
        inner, aside = e[1:-1], np.minimum(e[:-2], e[2:])
        peaks = (inner >= np.maximum(e[:-2], e[2:])) & (inner < 0.0) & (2.0 * inner >= aside)
        tops = [_peak(excess, t, int(i), float(e[i]))[0] for i in np.flatnonzero(peaks) + 1]
        t = np.sort(np.append(t, tops))
        late = excess(t) >= 0.0
        if late.any():
            self._lost = self._first(excess, t, int(np.argmax(late)))

    @staticmethod
    def _first(excess: Signal, t: np.ndarray, i: int) -> float:
        if i == 0:
            return float(t[0])
        low, high = t[i - 1], t[i]
        for _ in range(HALVINGS):
            middle = low + (high - low) / 2
            low, high = (low, middle) if excess(np.array([middle]))[0] >= 0.0 else (middle, high)
        return float(high)

    def result(self) -> dict[str, Any]:
        return {
            "sliding_holds": self._lost is None,
            "sliding_lost_at": None if self._lost is None else self._lost * self._units.time,
        }


class Progress(Observer):
    """Reports the share of the run that is done, at most a hundred times."""

    def __init__(self, stop: float, tell: Callable[[float], None]) -> None:
        self._stop, self._tell, self._told = stop, tell, 0

    def leg(self, leg: Leg) -> None:
        done = int(100 * leg.t1 / self._stop)
        if done > self._told:
            self._told = done
            self._tell(leg.t1 / self._stop)


def observers_for(
    scene: Scene,
    model: PadModel,
    units: Units,
    stop: float,
    progress: Callable[[float], None] | None,
) -> list[Observer]:
    """Just the observers that the scene's outputs need."""
    observers: list[Observer] = []
    if scene.wants("events"):
        observers.append(Events())
    if scene.wants("shares"):
        observers.append(Shares(model, stop))
    if scene.wants("extrema"):
        observers.append(Extrema(model))
    if scene.wants("history"):
        assert scene.samples is not None
        assert scene.stop is not None
        observers.append(History(model, units, scene.stop, scene.samples))
    if scene.pad.V is not None:
        observers.append(Sliding(units, scene.pad.V))
    if progress is not None:
        observers.append(Progress(stop, progress))
    return observers
