"""Fig. 13 over its parameters: how large the black area is, where the four cases lie in it.

Beside the printed conditions stand the true equilibria of model B2, those off the branch too.
"""

import dataclasses
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np

from squeal.analysis.maps import BEYOND_FOLD, angle_axes, codes_at, on_grid
from squeal.analysis.stack import Places
from squeal.article.cases import CASES, SMALL_REGION
from squeal.article.equations import bounds, stiffness
from squeal.article.records import Record, Result
from squeal.article.studies._scenes import read_scenes
from squeal.equilibrium.statics import Statics
from squeal.io.scene import Scene
from squeal.linear import VERDICTS
from squeal.model.pad import Pad
from squeal.model.states import FULL, STATES
from squeal.numerics.outline import outline

VALUES = {
    "h/w": np.linspace(0.1, 1.0, 10),
    "k2/k1": np.geomspace(0.25, 4.0, 9),
    "mu": np.linspace(0.1, 0.9, 9),
}
"""MapRanges: flat to square pads, springs of like size, brake linings."""
SPREAD = {
    "h/w": (0.1, 0.5, 0.9),
    "k2/k1": (0.25, 1.0, 4.0),
    "mu": (0.1, 0.5, 0.9),
    "k_c/k1": (0.05, 0.4, 3.0),
    "preload": (0.0, 4.0, 8.0),
}
"""Upright: the same, soft to stiff contact, and springs that press with -y0 k1 over F_n."""
SHAPES = {"h/w": (0.1, 0.3, 1.0), "k2/k1": (0.25, 1.0, 4.0), "mu": (0.1, 0.4, 0.9)}
CELLS = 60  # a side of the maps of all combinations
FINE = 80  # a side of the maps whose area is outlined
COARSE = 16  # a side of the maps of equilibria
COARSEST = 9  # the same for many pads
MARGIN = 0.06  # of the map: a grid three times as fine moves a share by less
SPARSE = 5  # values of a parameter at which equilibria are sought
GRID = 20  # a side of the map on which equilibria off the branch are sought
NEAR = 0.02  # rad: a case is on the edge if the conditions change within
UPRIGHT = 0.2  # rad
KEPT = [VERDICTS.index("stable"), VERDICTS.index("marginal")]


Curve = tuple[tuple[float, float], ...]
Where = Literal["inside", "on the edge", "outside"]
Share = Annotated[float, ".1%"]


class Span(Record):
    """Least and greatest share of the map over a range of pads."""

    low: Share
    high: Share


class Sweep(Record):
    """The map over one parameter, the others as in the scene.

    own: the scene's value; values: of the parameter; printed, signs: share of the map on which
    (23a, b) hold as printed and with signs followed; low, high: of printed, over all values of the
    other two; sparse: values at which equilibria of B2 are sought; reached, kept: share on which
    the branch from mu = 0 has one, and on which nothing grows about it; shapes: curves around the
    area of the printed conditions, by value.
    """

    own: float
    values: tuple[float, ...]
    printed: tuple[float, ...]
    signs: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    sparse: tuple[float, ...]
    reached: tuple[float, ...]
    kept: tuple[float, ...]
    shapes: dict[str, tuple[Curve, ...]]


class Member(Record):
    """Where a case lies in the map as printed.

    own: with the scene's parameters; inside, edge, outside: shares of all pads of the ranges.
    """

    alpha1: float
    alpha2: float
    own: Where
    inside: Share
    edge: Share
    outside: Share


class OffBranch(Record):
    """Equilibria where the branch from mu = 0 does not reach the scene's mu.

    points: of the grid, beyond: of them without the branch; found: of those with another
    equilibrium; kept: with one about which nothing grows; upright: that is tilted by less than
    `tilt` (rad). A search from many places may miss some.
    """

    points: int
    beyond: int
    found: int
    kept: int
    upright: int
    tilt: float


class Upright(Record):
    """Where an equilibrium is kept in full contact, as the article's sliding state is.

    pads: how many, over five parameters; low, high: least and greatest share of the map;
    small: on how many pads it is below `below`, which counts as small; small_at: of these by
    parameter and its values, each of which equally many pads have; cells: points of the grid of
    angles that a share rests on; near, near_others: how many of the small and of the others are
    within `margin` of the map of `below`, which a finer grid may turn; touching: shares with an
    equilibrium kept in any contact.
    """

    pads: int
    low: Share
    high: Share
    small: int
    below: Share
    small_at: dict[str, dict[str, int]]
    cells: int
    near: int
    near_others: int
    margin: float
    touching: Span


class MapRanges(Result):
    """By parameter (h/w, k2/k1, mu), and over all of them together.

    pads: how many combinations; printed, signs: spans of the shares; members: by case, on the edge
    if the conditions change within `near` (rad); flat: keys of the cases with K21 = 0 for all pads.
    """

    sweeps: dict[str, Sweep]
    pads: int
    printed: Span
    signs: Span
    members: dict[str, Member]
    near: float
    full: Upright
    flat: tuple[str, ...]
    off_branch: OffBranch


def with_values(pad: Pad, ratio: Any, springs: Any, mu: Any) -> Pad:
    """The pad with other h/w, k2/k1 (of the same sum) and mu; I grows as that of a rectangle."""
    h = ratio * pad.w
    inertia = pad.I * (pad.w**2 + h**2) / (pad.w**2 + pad.h**2)
    k1 = (pad.k1 + pad.k2) / (1.0 + springs)
    return pad.replace(h=h, I=inertia, k1=k1, k2=springs * k1, mu=mu)


def _axes(cells: int) -> tuple[np.ndarray, np.ndarray]:
    """Axes of the map with one cell more along the second.

    No point then lies on a diagonal, where K21 = 0 if k1 = k2, so that the bounds are infinite.
    """
    return angle_axes(cells)[0].values, angle_axes(cells + 1)[1].values


def _angles(cells: int) -> tuple[np.ndarray, np.ndarray]:
    a1, a2 = np.meshgrid(*_axes(cells), indexing="ij")
    return a1.ravel(), a2.ravel()


def _shares(pad: Pad) -> tuple[np.ndarray, np.ndarray]:
    """Shares of both readings of (23a, b) over all combinations of `VALUES`."""
    angles = _angles(CELLS)
    shape = [len(v) for v in VALUES.values()]
    printed, signs = np.empty(shape), np.empty(shape)
    for index in np.ndindex(*shape):
        values = (v[i] for v, i in zip(VALUES.values(), index, strict=True))
        found = bounds(with_values(pad, *values), angles)
        printed[index], signs[index] = found.as_printed.mean(), found.sign_aware.mean()
    return printed, signs


def _curves(pad: Pad) -> tuple[Curve, ...]:
    def at(angles: np.ndarray) -> np.ndarray:
        return np.asarray(bounds(pad, (angles[0], angles[1])).as_printed).astype(int)

    x, y = _axes(FINE)
    codes = at(np.array(_angles(FINE)))
    found = outline(((0.0, math.pi), (0.0, math.pi)), x, y, codes.reshape(FINE, -1), at)
    return tuple(
        tuple((round(x, 5), round(y, 5)) for x, y in line.tolist()) for line, _ in found.curves
    )


def where(pad: Pad, angles: tuple[float, float]) -> Where:
    """Whether the printed conditions hold at and about a case's angles."""
    around = 2.0 * math.pi * np.arange(24) / 24
    a1 = angles[0] + NEAR * np.append(np.cos(around), 0.0)
    a2 = angles[1] + NEAR * np.append(np.sin(around), 0.0)
    holds = np.asarray(bounds(pad, (a1, a2)).as_printed)
    return "inside" if holds.all() else "on the edge" if holds.any() else "outside"


def _members(pad: Pad) -> dict[str, Member]:
    grid = [v.ravel() for v in np.meshgrid(*VALUES.values(), indexing="ij")]
    found = {}
    for case, angles in CASES.items():
        places = [where(with_values(pad, *values), angles) for values in zip(*grid, strict=True)]
        share = {word: places.count(word) / len(places) for word in ("inside", "on the edge")}
        inside, edge = share["inside"], share["on the edge"]
        found[case] = Member(*angles, where(pad, angles), inside, edge, 1.0 - inside - edge)
    return found


def _equilibria(
    scene: Scene, pads: Pad, cells: int = COARSE
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Shares of the map on which the branch has an equilibrium, on which it is kept, and on which
    it is kept in full contact.

    `pads` holds parameters as arrays (n,); so do the shares.
    """
    angles = _angles(cells)
    names = ("h", "I", "k1", "k2", "mu", "k_c", "y0")
    given = np.broadcast_arrays(*(getattr(pads, name) for name in names))
    count, each = len(given[0]), len(angles[0])
    values = np.array([*(np.tile(a, count) for a in angles), *(np.repeat(v, each) for v in given)])
    found = codes_at(scene, ("alpha1", "alpha2", *names), values)
    kept = np.isin(found.codes, KEPT)
    chosen = found.codes != BEYOND_FOLD, kept, kept & (found.contact == STATES.index(FULL))
    reached, kept, full = (one.reshape(count, each).mean(axis=1) for one in chosen)
    return reached, kept, full


def _full(scene: Scene) -> Upright:
    """Shares of the map with an equilibrium that is kept in full contact, over many pads."""
    some = list(SPREAD.values())
    *grid, contact, preload = (v.ravel() for v in np.meshgrid(*some, indexing="ij"))
    pads = with_values(scene.pad, *grid)
    assert pads.F_n is not None
    pads = pads.replace(k_c=contact * pads.k1, y0=-preload * pads.F_n / pads.k1)
    _, kept, full = _equilibria(scene, pads, COARSEST)
    small = (full < SMALL_REGION).reshape([len(values) for values in some])
    at = {
        name: dict(zip((f"{v:.3g}" for v in values), counts.tolist(), strict=True))
        for i, (name, values) in enumerate(SPREAD.items())
        for counts in (small.sum(axis=tuple(set(range(small.ndim)) - {i})),)
    }
    cells = COARSEST * (COARSEST + 1)
    close = np.abs(full - SMALL_REGION) <= MARGIN
    near, others = (
        int(np.count_nonzero(close & one)) for one in (full < SMALL_REGION, full >= SMALL_REGION)
    )
    span, touching = ((float(of.min()), float(of.max())) for of in (full, kept))
    few = int(small.sum())
    shares = (full.size, *span, few, SMALL_REGION, at, cells)
    return Upright(*shares, near, others, MARGIN, Span(*touching))


def _flat(pad: Pad) -> tuple[str, ...]:
    """Cases in which K21 is nothing but rounding for the extreme springs: it is so for all pads."""
    ends = [with_values(pad, 1.0, springs, 0.1) for springs in VALUES["k2/k1"][[0, -1]].tolist()]

    def zero(angles: tuple[float, float]) -> bool:
        entries = (stiffness(p.replace(alpha1=angles[0], alpha2=angles[1])) for p in ends)
        return all(abs(K[1, 0]) < 1e-12 * np.abs(K[:2, :2]).max() for K in entries)

    return tuple(case for case, angles in CASES.items() if zero(angles))


def off_branch(scene: Scene, grid: int = GRID) -> OffBranch:
    """Other equilibria at the angles at which the branch does not reach the scene's mu."""
    axis = angle_axes(grid)[0].values
    codes = on_grid(scene, ("alpha1", "alpha2"), axis, axis).codes
    beyond = axis[np.argwhere(codes == BEYOND_FOLD)].T
    statics = Statics.of(scene.pad_model)
    width = scene.pad.w / statics.units.length
    tilts = np.linspace(-0.49 * np.pi, 0.49 * np.pi, 13)
    one = np.array([-1.0, 0.0, 1.0])
    starts = np.meshgrid(one, one, tilts, [scene.pad.mu / width], indexing="ij")
    seeds = width * np.array([v.ravel() for v in starts])
    points, each = beyond.shape[1], seeds.shape[1]
    angles, z = np.repeat(beyond, each, axis=1), np.tile(seeds, (1, points))
    names = ("alpha1", "alpha2")
    model = statics.model.replace(**dict(zip(names, angles, strict=True)))
    pads = dataclasses.replace(statics, model=model)
    side = pads.settle(z, None, 40)
    touching = pads.gaps(z) < 0.0
    there = (side != 0.0) & touching.any(axis=0)
    places = Places(*(part[..., there] for part in (z, touching, side, there)))
    found = codes_at(scene, names, angles[:, there], places)
    who = np.repeat(np.arange(points), each)[there]
    exists, kept = found.codes != BEYOND_FOLD, np.isin(found.codes, KEPT)
    upright = kept & (np.abs(statics.tilt(z[:, there])) < UPRIGHT)
    any_, some, few = (len(set(who[chosen].tolist())) for chosen in (exists, kept, upright))
    return OffBranch(grid**2, points, any_, some, few, UPRIGHT)


def study(files: Sequence[Path]) -> MapRanges:
    """The map about the scene of case (c) of model B2, whose pad the four cases share."""
    scene = read_scenes(files, ["b2-c"])["b2-c"]
    pad = scene.pad
    own = {"h/w": pad.h / pad.w, "k2/k1": pad.k2 / pad.k1, "mu": pad.mu}
    printed, signs = _shares(pad)
    angles = _angles(CELLS)
    sparse = {n: v[np.linspace(0, len(v) - 1, SPARSE).astype(int)] for n, v in VALUES.items()}
    each = [own | {name: v} for name, values in sparse.items() for v in values.tolist()]
    many = with_values(pad, *(np.array([one[name] for one in each]) for name in own))
    reached, kept, _ = (part.reshape(-1, SPARSE) for part in _equilibria(scene, many))
    sweeps = {}
    for axis, (name, values) in enumerate(VALUES.items()):
        pads = {v: with_values(pad, *(own | {name: v}).values()) for v in values.tolist()}
        along = [bounds(one, angles) for one in pads.values()]
        rest = tuple(i for i in range(len(VALUES)) if i != axis)
        shapes = {v: with_values(pad, *(own | {name: v}).values()) for v in SHAPES[name]}
        sweeps[name] = Sweep(
            own[name],
            tuple(pads),
            tuple(float(b.as_printed.mean()) for b in along),
            tuple(float(b.sign_aware.mean()) for b in along),
            tuple(printed.min(axis=rest).tolist()),
            tuple(printed.max(axis=rest).tolist()),
            tuple(sparse[name].tolist()),
            tuple(reached[axis].tolist()),
            tuple(kept[axis].tolist()),
            {f"{v:g}": _curves(one) for v, one in shapes.items()},
        )
    return MapRanges(
        sweeps=sweeps,
        pads=printed.size,
        printed=Span(float(printed.min()), float(printed.max())),
        signs=Span(float(signs.min()), float(signs.max())),
        members=_members(pad),
        near=NEAR,
        full=_full(scene),
        flat=_flat(pad),
        off_branch=off_branch(scene),
    )
