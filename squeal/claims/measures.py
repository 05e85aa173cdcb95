"""What the claims ask of a simulated case, gathered while it runs."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from squeal.errors import InputError
from squeal.model import PadModel
from squeal.scene import Scene
from squeal.simulation.legs import Leg
from squeal.simulation.observers import Observer, normalised
from squeal.simulation.run import in_natural_units, integrate, make_integrator
from squeal.states import LEADING, TRAILING, State

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

    def __init__(self, model: PadModel) -> None:
        self._model = model
        self._parts: list[np.ndarray] = []  # columns t, first, second, tilt, acceleration
        self._legs: list[tuple[State, float, float]] = []

    def leg(self, leg: Leg) -> None:
        if leg.t1 == leg.t0:
            return
        nodes = leg.nodes
        assert nodes is not None
        assert leg.dense is not None
        inner = np.linspace(0.0, 1.0, PER_STEP, endpoint=False)
        t = np.append((nodes[:-1, None] + np.diff(nodes)[:, None] * inner).ravel(), nodes[-1])
        states = leg.dense(t)
        pad = self._model.pad
        q = np.array([states[:, 0], states[:, 1], states[:, 2] / pad.w])
        loads = self._model.loads(q, leg.contact)
        acceleration = np.sqrt(
            (loads[0] / pad.m) ** 2 + (loads[1] / pad.m) ** 2 + (pad.w * loads[2] / pad.I) ** 2
        )
        first, second = normalised(self._model, states, leg.contact)
        tilt = pad.theta0 + q[2]
        self._parts.append(np.array([t, first, second, tilt, acceleration + 0.0 * t]))
        self._legs.append((leg.contact, leg.t0, leg.t1))

    def case(self) -> Case:
        """The measures, after the run."""
        t, first, second, tilt, acceleration = np.concatenate(self._parts, axis=1)
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
        turns = np.flatnonzero(np.diff(np.sign(np.diff(values))))
        values = values[turns[0] + 1 :] if turns.size else values[-1:]
    if not values.size:
        return Range(np.nan, np.nan)
    return Range(float(values.min()), float(values.max()))


def measure(scene: Scene) -> Case:
    """Simulate a case of model B1 or B2 and measure it. Raises InputError for B3."""
    if scene.model == "B3":
        raise InputError(f"{scene.source}: model: B3 is not allowed; cases are B1 or B2 scenes")
    units, model, start, stop = in_natural_units(scene)
    gatherer = Gatherer(model)
    integrator = make_integrator(model, scene.tolerance, "auto")
    integrate(model, integrator, units, start, stop, [gatherer])
    return gatherer.case()
