"""What the claims ask of a simulated case, gathered while it runs."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from squeal.article.equations import quasi_static_map, stiffness
from squeal.errors import InputError
from squeal.model.equations import PadModel
from squeal.model.linear import rank
from squeal.model.pad import Pad
from squeal.model.states import LEADING, STATES, TRAILING, State
from squeal.scene import Scene
from squeal.simulation.batch.many import DONE
from squeal.simulation.legs import Leg
from squeal.simulation.observers import Observer, normalised
from squeal.simulation.run import in_natural_units, integrate, make_integrator

PER_STEP = 24  # samples in each integration step; a step is a fraction of an oscillation
START = 1e-9  # values below this at the start count as zero: nothing has moved yet


@dataclass(frozen=True)
class Range:
    """Least and greatest value of a signal; a start at zero does not count."""

    low: float
    high: float


@dataclass(frozen=True)
class Case:
    """Measures of one simulated case; times in units of sqrt(m/k), forces over F_n, delta over w.

    separated: time that the leading and trailing edge spend apart after first contact; losses:
    the edges in the order in which they separate; shares: share of time in each contact state
    after first contact; first, second: range of F3, F4 (B1) or Rn, delta (B2); together: range of
    F3 + F4 (B1); tilt: range of theta0 + theta in rad; mean: time mean of the first signal; swings:
    how often delta changes sign; calm: greatest acceleration in the last tenth of the run over
    that of the whole run.
    """

    duration: float
    separated: tuple[float, float]
    losses: tuple[int, ...]
    shares: dict[State, float]
    first: Range
    second: Range
    together: Range
    tilt: Range
    mean: float
    swings: int
    calm: float


class Gatherer(Observer):
    """Observer that samples each leg densely and keeps what the measures need."""

    dense = True

    def __init__(self, model: PadModel, per_step: int = PER_STEP) -> None:
        self._model = model
        self._inner = np.linspace(0.0, 1.0, per_step, endpoint=False)
        self._samples: list[tuple[np.ndarray, np.ndarray]] = []  # times and states of each leg
        self._legs: list[tuple[State, float, float]] = []

    def leg(self, leg: Leg) -> None:
        if leg.t1 == leg.t0:
            return
        nodes = leg.nodes
        assert nodes is not None
        assert leg.dense is not None
        t = (nodes[:-1, None] + np.diff(nodes)[:, None] * self._inner).ravel()
        t = np.append(t, nodes[-1])
        self._samples.append((t, leg.dense(t)))
        self._legs.append((leg.contact, leg.t0, leg.t1))

    def _signals(self) -> tuple[np.ndarray, ...]:
        """Times, the two signals, tilt and size of the acceleration of all samples, in order."""
        t, states = (np.concatenate(parts) for parts in zip(*self._samples, strict=True))
        sizes = [len(times) for times, _ in self._samples]
        kind = np.repeat([self._model.states.index(leg[0]) for leg in self._legs], sizes)
        pad = self._model.pad
        q = np.array(self._model.c.place(states.T))
        signals, acceleration = np.empty((2, len(t))), np.empty(len(t))
        for i, contact in enumerate(self._model.states):
            here = kind == i
            if here.any():
                signals[:, here] = normalised(self._model, states[here], contact)
                X, Y, M = self._model.loads(q[:, here], contact)
                acceleration[here] = np.sqrt(
                    (X / pad.m) ** 2 + (Y / pad.m) ** 2 + (pad.w * M / pad.I) ** 2
                )
        return t, signals[0], signals[1], pad.theta0 + q[2], acceleration

    def case(self) -> Case:
        """The measures, after the run."""
        t, first, second, tilt, acceleration = self._signals()
        begin = next((t0 for contact, t0, _ in self._legs if any(contact)), np.inf)
        after = [leg for leg in self._legs if leg[1] >= begin]
        duration = self._legs[-1][2] - begin
        seen = t >= begin
        spent: dict[State, float] = {}
        for contact, t0, t1 in after:
            spent[contact] = spent.get(contact, 0.0) + t1 - t0
        losses = [
            edge
            for (old, _, _), (new, _, _) in itertools.pairwise(after)
            for edge in (LEADING, TRAILING)
            if old[edge] and not new[edge]
        ]
        touching = ~np.isnan(second)
        signs = np.sign(second[touching & (np.abs(np.nan_to_num(second)) > START)])
        late = t >= t[-1] - 0.1 * duration
        return Case(
            duration=duration,
            separated=tuple(  # type: ignore[arg-type]
                sum(t1 - t0 for contact, t0, t1 in after if not contact[edge])
                for edge in (LEADING, TRAILING)
            ),
            losses=tuple(losses),
            shares={state: time / duration for state, time in spent.items()},
            first=_range(first[seen]),
            second=_range(second[seen & touching]),
            together=_range((first + np.nan_to_num(second))[seen]),
            tilt=_range(tilt[seen]),
            mean=float(np.trapezoid(first[seen], t[seen]) / duration),
            swings=int(np.sum(signs[1:] != signs[:-1])),
            calm=float(acceleration[late].max() / acceleration.max()),
        )


def _range(values: np.ndarray) -> Range:
    """Range of a sampled signal; a start at zero is left out until the signal first turns.

    A signal that starts from zero is on neither side of it yet; its way up (or down) from there
    says nothing of whether it comes back.
    """
    if values.size and abs(values[0]) <= START:
        values = values[np.append(True, np.diff(values) != 0.0)]  # legs repeat the time they share
        turns = np.flatnonzero(np.diff(np.sign(np.diff(values))))
        values = values[turns[0] + 1 :] if turns.size else values[-1:]
    if not values.size:
        return Range(np.nan, np.nan)
    return Range(float(values.min()), float(values.max()))


def measure(scene: Scene, per_step: int = PER_STEP) -> Case:
    """Simulate a case of model B1 or B2 and measure it, with `per_step` samples in a step.

    Raises InputError for B3, ComputationError where the motion leaves the model.
    """
    if scene.model == "B3":
        raise InputError(f"{scene.source}: model: B3 is not allowed; cases are B1 or B2 scenes")
    units, model, start, stop = in_natural_units(scene)
    gatherer = Gatherer(model, per_step)
    integrator = make_integrator(model, scene.tolerance, "auto")
    integrate(model, integrator, units, start, stop, [gatherer])
    return gatherer.case()


def batch_case(found: Mapping[str, np.ndarray], pad: int) -> Case | None:
    """The measures of one pad of `simulate_many(..., measured=True)`; None if it did not end."""
    if found["outcome"][pad] != DONE:
        return None

    def span(name: str) -> Range:
        return Range(*found[name][pad].tolist())

    shares = zip(STATES, found["shares"][pad].tolist(), strict=True)
    return Case(
        duration=float(found["duration"][pad]),
        separated=tuple(found["separated"][pad].tolist()),
        losses=found["losses"][pad],
        shares={state: share for state, share in shares if share > 0.0},
        first=span("first"),
        second=span("second"),
        together=span("together"),
        tilt=span("tilt"),
        mean=float(found["mean"][pad]),
        swings=int(found["swings"][pad]),
        calm=float(found["calm"][pad]),
    )


@dataclass(frozen=True)
class Linear:
    """What the claims on model B3 need: ranks of K by case, share of the map where (23) holds."""

    ranks: Mapping[str, int]
    share_as_printed: float


def linear_measures(pads: Mapping[str, Pad], points: int = 500) -> Linear:
    """Rank of Eq. (22) for the pad of each case, and what (23a, b) make of the map over the angles.

    The map has `points` cells a side; it leaves the pads' own angles aside, so that one of the
    pads tells it.
    """
    pad = next(iter(pads.values()))
    ranks = {case: rank(pad, stiffness(pad)) for case, pad in pads.items()}
    return Linear(ranks, quasi_static_map(pad, points).share.as_printed)
