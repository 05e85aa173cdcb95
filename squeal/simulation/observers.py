"""What is watched along a run, and what a motion comes to: its frequency, amplitude and growth.

Each observer sees the courses as they come and holds no more than its own result, so memory does
not grow with the length of the run. `Grid` serves single motions and ensembles alike.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from squeal.io.scene import COORDINATES, INITIAL
from squeal.io.writing import number
from squeal.model.contact import ContactLaw
from squeal.model.equations import PadModel, Units
from squeal.model.pad import Coefficients, facing, pose
from squeal.numerics.oscillation import exponent, line, swing
from squeal.simulation.hybrid import DEFAULT, Course, Options, state_of

UNITS = {"t": "s"} | {name: INITIAL.keys[name].unit for name in COORDINATES}
LAST = 0.25  # share of the run that is its last part
PARTS = 20  # equal parts of the run whose kinetic energies are compared
LINE = 0.25  # least share of the power in the strongest line of a motion that has a frequency
PERIODS = 4  # least number of periods that show a frequency
STEADY = 0.1  # largest change of an amplitude that counts as steady

Read = Callable[[Coefficients, np.ndarray, np.ndarray], np.ndarray]
"""A signal (...) from coefficients, states (6, ...) and contact (points, ...)."""


def lobatto(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Shares (count,) of a step, both ends included, and weights of Lobatto's quadrature there."""
    basis = np.polynomial.Legendre.basis(count - 1)
    places = np.concatenate([[-1.0], np.sort(basis.deriv().roots().real), [1.0]])
    return (places + 1.0) / 2.0, 1.0 / (count * (count - 1) * basis(places) ** 2)


class Grid:
    """Motions read at the same places of all their steps.

    count: places in each; shares (k,) of a step, weights (k,) of quadrature over it; states
    (6, k, s); t (k, s): times.
    """

    def __init__(self, course: Course, count: int) -> None:
        self.steps = steps = course.steps
        self.shares, self.weights = lobatto(count)
        powers = self.shares[:, None] ** np.arange(len(steps.series))
        self.states = np.tensordot(powers, steps.series, 1).swapaxes(0, 1)
        self.t = steps.t + steps.h * self.shares[:, None]
        self._of, self.c = course.coefficients, course.coefficients(steps.lane)
        self.first = np.searchsorted(steps.lane, np.arange(len(course.t0)))  # of each motion

    def read(self, signal: Read) -> np.ndarray:
        """A signal (..., k, s) at all places."""
        return signal(self.c, self.states, self.steps.on[:, None])

    def peaks(
        self, signal: Read, values: np.ndarray, enough: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Maxima between the samples (k, s) of a signal, as far as they may be `enough` (s,).

        Returns their steps (m,), shares (m,) of them, and values (m,), exact to rounding.
        """
        high = np.fmax.reduce(values)
        some = np.flatnonzero(high + 0.5 * (high - np.fmin.reduce(values)) > enough)
        shares, values, enough = self.shares[:, None], values[:, some], enough[some]
        # parabolas through three samples each
        left = np.diff(values, axis=0) / np.diff(shares, axis=0)
        bend = np.diff(left, axis=0) / (shares[2:] - shares[:-2])
        middle = (shares[1:] + shares[:-1]) / 2.0
        with np.errstate(divide="ignore", invalid="ignore"):
            top = middle[:-1] - left[:-1] / (2.0 * bend)
            rise = -bend * (top - shares[1:-1]) ** 2
        low, high = middle[:-1].copy(), middle[1:].copy()
        low[0], high[-1] = 0.0, 1.0
        near = (bend < 0.0) & (top >= low) & (top <= high)
        i, which = np.nonzero(near & (values[1:-1] + 2.0 * rise > enough))
        step, at, low, high = some[which], top[i, which], self.shares[i], self.shares[i + 2]
        if not step.size:
            return step, at, at
        steps, apart = self.steps.some(step), 1e-3 * (high - low)
        c = self._of(steps.lane)

        def value(share: np.ndarray) -> np.ndarray:
            return signal(c, steps.states(share), steps.on)

        for _ in range(2):  # Newton's method on differences
            before, here, after = value(at - apart), value(at), value(at + apart)
            with np.errstate(divide="ignore", invalid="ignore"):
                moved = apart * (after - before) / (2.0 * (2.0 * here - before - after))
            at = np.clip(at + np.where(np.isfinite(moved), moved, 0.0), low, high)
        return step, at, np.fmax(value(at), here)

    def ranges(
        self, signal: Read, values: np.ndarray | None = None, since: np.ndarray | None = None
    ) -> np.ndarray:
        """Least and greatest value (n, 2) of a signal in each of n motions.

        values (k, s): the signal at all places, if it is known; since (n,): times before which
        samples do not count. inf and -inf stand for a signal that a motion nowhere has.
        """
        whole = values = self.read(signal) if values is None else values
        begin = np.full(len(self.first), -np.inf) if since is None else since
        begin = begin[self.steps.lane]
        if since is not None:  # a peak beside the first sample that counts does so too
            counts = self.t >= begin - 1e-12 * np.abs(begin)
            values, whole = (np.where(c, values, np.nan) for c in (counts, counts.any(axis=0)))
        ends = []
        for sign in (-1.0, 1.0):
            each = np.fmax.reduce(sign * values)
            best = np.fmax.reduceat(np.where(np.isnan(each), -np.inf, each), self.first)
            step, share, tops = self.peaks(
                lambda *where, s=sign: s * signal(*where), sign * whole, best[self.steps.lane]
            )
            reach = share + np.diff(self.shares).max()
            late = self.steps.t[step] + self.steps.h[step] * reach >= begin[step]
            np.fmax.at(best, self.steps.lane[step[late]], tops[late])
            ends.append(sign * best)
        return np.array(ends).T


def plotted(law: ContactLaw) -> Read:
    """The plotted signals (signals, ...) of a law, each over its scale (F_n or w)."""

    def read(c: Coefficients, states: np.ndarray, on: np.ndarray) -> np.ndarray:
        with np.errstate(divide="ignore", invalid="ignore"):  # delta is NaN where Rn is zero
            values = law.signals(c, pose(np, c.place(states)), on)
        rows = np.empty((len(law.plotted), *states.shape[1:]))
        for row, value, signal in zip(rows, values, law.plotted, strict=True):
            np.divide(value, getattr(c, signal.over), out=row)
            if signal.is_force:  # a located contact change leaves some rounding below zero
                np.maximum(row, 0.0, out=row)
        return rows

    return read


def face_speed(c: Coefficients, states: np.ndarray, on: np.ndarray) -> np.ndarray:
    """Speed of the middle of the lower face, h below the mass centre, NaN where it is off."""
    velocity = states[3] + c.h * facing(c, pose(np, c.place(states))) * states[5] / c.w
    return np.where(on.any(axis=0), velocity, np.nan)


def one_of(signals: Read, which: int) -> Read:
    """One of several signals."""
    return lambda *where: signals(*where)[which]


@dataclass(frozen=True)
class Event:
    """A change of contact state at time t (s)."""

    t: float
    source: str
    target: str


class Events:
    """The list of contact changes."""

    def __init__(self, model: PadModel, units: Units) -> None:
        self._model, self._units, self._events = model, units, list[Event]()

    def see(self, course: Course) -> None:
        contact = np.concatenate([course.first, course.on], axis=1)
        names = [self._model.state_name(state_of(on)) for on in contact.T]
        times = (course.t * self._units.time).tolist()
        self._events += map(Event, times, names[:-1], names[1:])

    def result(self) -> tuple[Event, ...]:
        return tuple(self._events)


class Shares:
    """Share of time spent in each contact state."""

    def __init__(self, model: PadModel, stop: float) -> None:
        self._model, self._stop = model, stop
        self._time = dict.fromkeys(model.law.meanings, 0.0)

    def see(self, course: Course) -> None:
        contact = np.concatenate([course.first, course.on], axis=1)
        spent = np.diff(np.concatenate([course.t0, course.t, course.t1]))
        for time, on in zip(spent.tolist(), contact.T, strict=True):
            self._time[self._model.state_name(state_of(on))] += time

    def result(self) -> dict[str, float]:
        return {state: spent / self._stop for state, spent in self._time.items()}


class Extrema:
    """Least and greatest values of the plotted signals, forces over F_n and delta over w."""

    def __init__(self, model: PadModel, options: Options = DEFAULT) -> None:
        self._law, self._count = model.law, options.samples
        self._ranges = np.array([[np.inf, -np.inf]] * len(model.law.plotted))

    def see(self, course: Course) -> None:
        grid, signals = Grid(course, self._count), plotted(self._law)
        for which, values in enumerate(grid.read(signals)):
            ((low, high),) = grid.ranges(one_of(signals, which), values)
            known = self._ranges[which]
            known[:] = min(known[0], low), max(known[1], high)

    def result(self) -> dict[str, tuple[float, float] | None]:
        pairs = zip(self._law.plotted, self._ranges.tolist(), strict=True)
        named = {signal.name: (low, high) for signal, (low, high) in pairs}
        return {n: ends if math.isfinite(ends[1]) else None for n, ends in named.items()}


class Samples:
    """The states (n, 6) and contact (points, n) at given rising times (n,), in natural units."""

    def __init__(self, model: PadModel, times: np.ndarray) -> None:
        self.times, self.states = times, np.full((len(times), 6), np.nan)
        self.on = np.zeros((model.law.points, len(times)))

    def see(self, course: Course) -> None:
        i = np.searchsorted(self.times, course.t0[0])
        j = np.searchsorted(self.times, course.t1[0], side="right")
        self.states[i:j], self.on[:, i:j] = course.at(self.times[i:j])


class History(Samples):
    """Samples of state, contact and signals at equal steps of time."""

    def __init__(self, model: PadModel, units: Units, stop: float, samples: int) -> None:
        self._seconds = np.linspace(0.0, stop, samples)
        super().__init__(model, self._seconds / units.time)
        self._model, self._units = model, units

    def result(self) -> dict[str, np.ndarray]:
        model = self._model
        kinds, which_kind = np.unique(self.on, axis=1, return_inverse=True)
        names = [model.state_name(state_of(kind)) for kind in kinds.T]
        columns = {"t": self._seconds}
        columns |= dict(zip(COORDINATES, self._units.to_si(self.states).T, strict=True))
        columns["state"] = np.array(names)[which_kind]
        signals = plotted(model.law)(model.c, self.states.T, self.on)
        columns |= {s.name: v for s, v in zip(model.law.plotted, signals, strict=True)}
        return columns


class Sliding:
    """When the pad first becomes as fast as the surface, which every equation assumes to be faster
    (finding E16); speed and time in natural units."""

    def __init__(self, speed: float, options: Options = DEFAULT) -> None:
        self._speed, self._count = speed, options.samples
        self.lost: float | None = None

    def _excess(self, _c: Coefficients, states: np.ndarray, _on: np.ndarray) -> np.ndarray:
        return np.asarray(states[3] - self._speed)

    def see(self, course: Course) -> None:
        grid, steps = Grid(course, self._count), course.steps
        values = grid.read(self._excess)
        step, at, top = grid.peaks(self._excess, values, np.zeros(len(steps.t)))
        lost = np.append(grid.t[values >= 0.0], (steps.t[step] + steps.h[step] * at)[top >= 0.0])
        if lost.size and self.lost is None:
            high = lost.min()
            low = max(grid.t[grid.t < high].max(initial=-np.inf), course.t0[0])
            while low < (middle := low + (high - low) / 2) < high:
                late = course.at(np.array([middle]))[0][0, 3] >= self._speed
                low, high = (low, middle) if late else (middle, high)
            self.lost = float(high)


@dataclass(frozen=True)
class Response:
    """What a motion comes to; each is None where the motion does not show it.

    frequency_hz: of the strongest line in the kinetic energy of the last quarter of the run, which
    holds at least four of its periods, and the line a quarter of the power.
    amplitude: half of the ranges of x, y (m) and theta (rad) in that quarter, whose two halves
    differ by at most a tenth.
    growth_rate (1/s), growth_frequency_hz: real part and |imaginary part|/(2 pi) of the exponent
    of the motion up to the first change of contact, see `squeal.numerics.oscillation.exponent`.
    settled: True if the root mean square velocity, weighted by the masses, of the last tenth of the
    run is below a hundredth of that of the twentieth in which it was greatest, False if it is at
    least nine tenths of that of the tenth before.
    """

    frequency_hz: float | None = None
    amplitude: dict[str, float] | None = None
    growth_rate: float | None = None
    growth_frequency_hz: float | None = None
    settled: bool | None = None

    def rows(self) -> list[tuple[str, str]]:
        """Name and value of each, for people."""
        unknown, growth = "cannot be told", self.growth_rate
        sizes = (f"{name} {number(v)} {UNITS[name]}" for name, v in (self.amplitude or {}).items())
        frequency = self.frequency_hz
        grows = f"{number(growth or 0.0)} 1/s at {number(self.growth_frequency_hz or 0.0)} Hz"
        return [
            ("dominant frequency", unknown if frequency is None else f"{number(frequency)} Hz"),
            ("amplitude", ", ".join(sizes) or unknown),
            ("growth at the start", unknown if growth is None else grows),
            ("settled", {True: "yes", False: "no", None: unknown}[self.settled]),
        ]


class Watch:
    """Samples of the start, of the last part and of the kinetic energy, in natural units."""

    def __init__(self, model: PadModel, units: Units, stop: float) -> None:
        pad = model.pad
        self._units = units
        # weights of the squared rates of (x, y, w theta) in the kinetic energy
        self._mass = np.array([pad.m, pad.m, pad.I / pad.w**2])
        # a quarter of a radian of the fast rotation
        self._step = 0.25 / max(1.0, math.sqrt(pad.m * (pad.w**2 + pad.h**2) / pad.I))
        # of a long run no more samples than tell its frequency well
        first = np.arange(min(32_768, int(stop / self._step) + 1)) * self._step
        last = stop - first[first <= LAST * stop][::-1]
        # places that no frequency is in step with
        number = np.arange(200 * PARTS)
        spread = stop * (number + np.random.default_rng(0).random(len(number))) / len(number)
        self._samples = [Samples(model, times) for times in (first, last, spread)]
        self._changed = np.inf

    def see(self, course: Course) -> None:
        for samples in self._samples:
            samples.see(course)
        self._changed = min([self._changed, *course.t[:1].tolist()])

    def result(self) -> Response:
        first, last, spread = (samples.states for samples in self._samples)
        energy = (self._mass * spread[:, 3:] ** 2).sum(axis=1).reshape(PARTS, -1).mean(axis=1)
        greatest = float(np.sqrt(energy.max()))
        if greatest <= 1e-11:  # in natural units: only rounding
            return Response(amplitude=self._amplitude(last), settled=True)
        found: dict[str, Any] = {}
        rate, begun = self._units.time, first[self._samples[0].times < self._changed]
        if (growth := exponent(begun, self._step)) is not None:
            found["growth_rate"] = growth.real / rate
            found["growth_frequency_hz"] = growth.imag / (2 * np.pi * rate)
        frequency, share = line(last[:, 3:] * np.sqrt(self._mass), self._step)
        if frequency * self._step * len(last) >= PERIODS:
            if share >= LINE:
                found["frequency_hz"] = frequency / rate
            parts = np.array([swing(part[:, :3]) for part in np.split(last, [len(last) // 2])])
            a, b = parts[:, np.argmax(parts.sum(axis=0))]
            if abs(a - b) <= STEADY * max(a, b):
                found["amplitude"] = self._amplitude(last)
            before, late = np.sqrt(energy.reshape(-1, PARTS // 10).mean(axis=1))[-2:]
            if late < 0.01 * greatest or late >= (1.0 - STEADY) * before:
                found["settled"] = bool(late < 0.01 * greatest)
        return Response(**found)

    def _amplitude(self, states: np.ndarray) -> dict[str, float]:
        whole = np.append(swing(states[:, :3]), np.zeros(3))
        return dict(zip(COORDINATES[:3], self._units.to_si(whole)[:3].tolist(), strict=True))
