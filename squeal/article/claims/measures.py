"""Measures of a simulated case for the claims."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from squeal.article.claims.motions import measure_alone
from squeal.article.equations import Readings, quasi_static_map, rank, stiffness
from squeal.equilibrium.statics import Statics
from squeal.errors import InputError
from squeal.io.scene import Scene
from squeal.model.contact import STATES, State
from squeal.model.equations import PadModel
from squeal.model.pad import Pad, pose_of


@dataclass(frozen=True)
class Range:
    """Least and greatest value of a signal; a start at zero does not count."""

    low: float
    high: float


@dataclass(frozen=True)
class Case:
    """Measures of one simulated case; times in units of sqrt(m/k), forces over F_n, delta over w.

    separated: time that the leading and trailing edge spend apart after first contact; losses: the
    edges in the order in which they separate; shares: share of time in each contact state after
    first contact; first, second: range of F3, F4 (B1) or Rn, delta (B2); together: range of F3 + F4
    (B1); tilt: range of theta0 + theta in rad; down: share of time in which the tilt is negative;
    mean: time mean of the first signal; blows: how often successive blows fall on different edges,
    for each of `LEVELS`; heaviest: impulse of the heaviest blow on each edge, over F_n T_1;
    vanishes: share of time in which the force at each edge is zero (of B2 that of the two edge
    forces that have the reaction's resultant and moment, which vanish with the reaction alone);
    calm: greatest acceleration in the last tenth of the run over that of the whole run; slip, face:
    greatest x_dot, and greatest speed of the lower face while it touches, over the speed V of the
    surface (NaN without V); raised: reaction of the sliding equilibrium over that without friction,
    less one (NaN if one of them is not computed or does not exist).
    """

    duration: float
    separated: tuple[float, float]
    losses: tuple[int, ...]
    shares: dict[State, float]
    first: Range
    second: Range
    together: Range
    tilt: Range
    down: float
    mean: float
    blows: tuple[int, ...]
    heaviest: tuple[float, float]
    vanishes: tuple[float, float]
    calm: float
    slip: float = math.nan
    face: float = math.nan
    raised: float = math.nan


def lost_share(shares: Mapping[State, float], watched: Sequence[bool]) -> float:
    """Share of time in which at least one of the watched edges is separated.

    shares: of time by contact state; watched: whether the leading and the trailing edge count, such
    as those that touch in the equilibrium.
    """
    lost: float = 0
    for state, share in shares.items():
        if any(edge and not touches for edge, touches in zip(watched, state, strict=True)):
            lost += share
    return lost


def measure(scene: Scene) -> Case:
    """Simulate a case of model B1 or B2 and measure it.

    Raises InputError for B3, ComputationError where the motion leaves the model.
    """
    if scene.pad_model.linear or scene.pad_model.law.points != 2:
        raise InputError(
            f"{scene.source}: model: {scene.model} is not allowed; cases are B1 or B2 scenes"
        )
    return case_of(measure_alone(scene), 0, scene.pad.V, _friction_raises_one(scene.pad_model))


@lru_cache(maxsize=64)  # the same at every tolerance and over every time
def _friction_raises_one(model: PadModel) -> float:
    stacked: dict[str, Any] = {name: np.array([v]) for name, v in model.pad.given().items()}
    return float(friction_raises(dataclasses.replace(model, pad=Pad(**stacked)))[0])


def friction_raises(model: PadModel) -> np.ndarray:
    """How much friction raises the reaction of n pads at rest, (n,), as a share of it at mu = 0.

    The parameters are arrays (n,). NaN where an equilibrium is not reached from full contact.
    """
    mu = np.asarray(model.pad.mu)
    frictionless = equilibria(model, np.zeros(mu.size))
    sliding = equilibria(model, mu, frictionless.q)
    return sliding.reaction / frictionless.reaction - 1.0


class Equilibria(NamedTuple):
    """Equilibria of n pads: q (3, n) = (x, y, theta), normal reaction (n,) and gaps (points, n) of
    the contact points; NaN where there is none."""

    q: np.ndarray
    reaction: np.ndarray
    gaps: np.ndarray


def equilibria(model: PadModel, mu: np.ndarray, start: np.ndarray | None = None) -> Equilibria:
    """The equilibria with friction mu (n,) that Newton's method reaches from `start`, in SI units.

    start: (x, y, theta), (3, n); zero if left out, or where it is NaN since an earlier search
    failed. All parameters of the pads are arrays (n,). Where Newton's method fails all is NaN;
    where it ends without contact the reaction is NaN.
    """
    statics = Statics.of(model)
    length = statics.units.length
    w = statics.model.pad.w  # in natural units, as all of `statics`
    z = np.zeros((4, len(mu)))  # x, y, w theta in natural units, and mu
    if start is not None:
        z[:3] = np.nan_to_num([start[0] / length, start[1] / length, start[2] * w])
    z[3] = mu
    # touching=None: each step takes the contact state of the gaps; a pad that touches nowhere is
    # taken as in full contact, which pulls it back to the surface
    z, _, reached = statics.solve_balance(z, touching=None, passes=10)
    q = statics.q(z)
    gaps = np.where(reached, statics.gaps(z), math.nan)
    touching = (gaps < 0.0).astype(float)
    load = statics.model.law.loads(statics.model.c, pose_of(np, tuple(q)), touching)
    reaction = np.where(reached & touching.any(axis=0), load.y, math.nan)
    q_in_SI = np.where(reached, [q[0] * length, q[1] * length, q[2]], math.nan)
    return Equilibria(q_in_SI, reaction * statics.units.force, gaps * length)


def case_of(
    arrays: Mapping[str, np.ndarray], pad: int, V: float | None = None, raised: float = math.nan
) -> Case:
    """The measures of one of several pads, from the arrays of `motions.measures`.

    pad: its index in the arrays; V: speed of the surface; raised: see `Case`.
    """

    def span(name: str) -> Range:
        low, high = arrays[name][pad].tolist()
        return Range(low, high)

    def value(name: str) -> float:
        return float(arrays[name][pad])

    shares = zip(STATES, arrays["shares"][pad].tolist(), strict=True)
    return Case(
        duration=value("duration"),
        separated=tuple(arrays["separated"][pad].tolist()),
        losses=arrays["losses"][pad],
        shares={state: share for state, share in shares if share > 0.0},
        first=span("first"),
        second=span("second"),
        together=span("together"),
        tilt=span("tilt"),
        down=value("down"),
        mean=value("mean"),
        blows=tuple(arrays["blows"][pad].tolist()),
        heaviest=tuple(arrays["heaviest"][pad].tolist()),
        vanishes=tuple(arrays["vanishes"][pad].tolist()),
        calm=value("calm"),
        slip=math.nan if V is None else value("fastest") / V,
        face=math.nan if V is None else value("face") / V,
        raised=raised,
    )


@dataclass(frozen=True)
class Linear:
    """What the claims on model B3 need: ranks of K by case, shares of the map where (23) holds."""

    ranks: Mapping[str, int]
    share: Readings


def linear_measures(pads: Mapping[str, Pad], points: int = 500) -> Linear:
    """Rank of Eq. (22) for the pad of each case, and what (23a, b) make of the map over the angles.

    The map has `points` cells a side; it does not depend on the pads' own angles, so that it is
    computed for the first pad alone.
    """
    ranks = {case: rank(pad, stiffness(pad)) for case, pad in pads.items()}
    return Linear(ranks, _share(next(iter(pads.values())), points))


@lru_cache(maxsize=8)
def _share(pad: Pad, points: int) -> Readings:
    return quasi_static_map(pad, points).share
