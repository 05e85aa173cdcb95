"""What the claims ask of a simulated case."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from squeal.article.equations import quasi_static_map, stiffness
from squeal.errors import InputError
from squeal.model.linear import rank
from squeal.model.pad import Pad
from squeal.model.states import STATES, State
from squeal.scene import Scene
from squeal.simulation.batch.alone import measure_alone


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


def measure(scene: Scene) -> Case:
    """Simulate a case of model B1 or B2 and measure it.

    Raises InputError for B3, ComputationError where the motion leaves the model.
    """
    if scene.pad_model.linear or scene.pad_model.law.points != 2:
        raise InputError(
            f"{scene.source}: model: {scene.model} is not allowed; cases are B1 or B2 scenes"
        )
    return case_of(measure_alone(scene), 0)


def case_of(found: Mapping[str, np.ndarray], pad: int) -> Case:
    """The measures of one of several pads."""

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
