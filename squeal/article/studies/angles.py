"""The map over the spring angles on which model B2 has a sliding equilibrium, and a stable one."""

import dataclasses
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from squeal.article.outline import Outline, outline
from squeal.article.records import Record, Result
from squeal.article.studies._scenes import read_scenes
from squeal.io.scene import Damping, Scene
from squeal.model.contact import FULL, STATES
from squeal.queries.pads.maps import (
    BEYOND_FOLD,
    NAMES,
    PointVerdicts,
    angle_axes,
    on_grid,
    verdicts_at,
)

CELLS = 90  # a side of the map
COARSE = 40  # a side of the maps with damping
# damping ratios of one mode and of the others
HIGH = 0.02
LOW = 0.001
NONE, UNSTABLE, PARTIAL, STABLE = range(4)
"""Codes of the map: no equilibrium on the branch, one about which a mode grows, one about which no
mode grows in partial contact, and in full contact."""


class Shares(Record):
    """Shares of the area of the map.

    exists: the equilibrium branch reaches the scene's mu; quiet: no mode grows; quiet_full: so in
    full contact; damped: the least share on which no mode grows where one mode is damped by `HIGH`
    and the others by `LOW`.
    """

    exists: float
    quiet: float
    quiet_full: float
    damped: float


class Angles(Result):
    """Outline of the map over (alpha1, alpha2) at one friction, by code."""

    mu: float
    b2: Outline
    share: Shares


def _encoded(verdicts: PointVerdicts) -> np.ndarray:
    """Verdicts and contact states of points as the codes of this map."""
    without_growth = verdicts.codes <= NAMES.index("marginal")  # stable comes before it
    full = verdicts.contact == STATES.index(FULL)
    codes = np.full(verdicts.codes.shape, UNSTABLE)
    codes[without_growth] = PARTIAL
    codes[without_growth & full] = STABLE
    codes[verdicts.codes == BEYOND_FOLD] = NONE
    return codes


def equilibria(scene: Scene) -> Outline:
    """The map for a scene of model B2."""
    axes = angle_axes(CELLS)
    names = ("alpha1", "alpha2")
    angles = axes[0].values
    codes = _encoded(on_grid(scene, names, angles, angles))

    def encoded_at(points: np.ndarray) -> np.ndarray:
        return _encoded(verdicts_at(scene, names, points))

    return outline(((0.0, math.pi), (0.0, math.pi)), angles, angles, codes, encoded_at)


def damped(scene: Scene, mode: int) -> float:
    """Share of a coarser map on which no mode grows, with one mode damped more than the others."""
    ratios = tuple(HIGH if k == mode else LOW for k in range(3))
    angles = angle_axes(COARSE)[0].values
    with_damping = dataclasses.replace(scene, damping=Damping(ratios=ratios))
    codes = _encoded(on_grid(with_damping, ("alpha1", "alpha2"), angles, angles))
    return float(np.mean(codes >= PARTIAL))


def study(files: Sequence[Path]) -> Angles:
    """The map for the pad of case (c), which the four cases share."""
    scene = read_scenes(files, ["b2-c"])["b2-c"]
    regions = equilibria(scene)
    codes = (NONE, UNSTABLE, PARTIAL, STABLE)
    share = np.array([regions.area.get(code, 0.0) for code in codes]) / np.pi**2
    shares = Shares(
        exists=float(share[UNSTABLE:].sum()),
        quiet=float(share[PARTIAL:].sum()),
        quiet_full=float(share[STABLE]),
        damped=min(damped(scene, mode) for mode in range(3)),
    )
    return Angles(scene.pad.mu, regions, shares)


def sentences(record: Angles) -> dict[str, bool]:
    """What the paper says of sliding equilibria."""
    share = record.share
    return {
        "sliding-on-most-of-the-map": share.quiet > 0.5,
        "unequal-damping-lowers-the-share": 0.5 < share.damped < 0.9 * share.quiet,
    }
