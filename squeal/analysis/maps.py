"""Stability over (alpha1, alpha2), or over any two parameters of a scene.

B3 maps linearise about the origin. B1 and B2 maps find the sliding equilibrium of every point
first, by continuation from mu = 0 of all points together.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from squeal.equilibrium.statics import Statics
from squeal.model.contact import Formulation
from squeal.model.equations import PadModel
from squeal.model.linear import about_origin, spring_directions
from squeal.model.pad import Pad
from squeal.model.states import FULL, LEAD, NONE, STATES, TRAIL
from squeal.numerics.outline import Codes, Outline, outline
from squeal.scene import Scene
from squeal.stability import VERDICTS, sum_verdicts, undamped_verdicts

BEYOND_FOLD = len(VERDICTS)  # the branch from mu = 0 turns back before the pad's mu
NAMES = (*VERDICTS, "beyond a fold")


@dataclass(frozen=True)
class Axis:
    """One parameter of a map: n values at the middles of n equal cells between low and high."""

    name: str
    low: float
    high: float
    n: int

    @property
    def values(self) -> np.ndarray:
        """The n values."""
        return self.low + (self.high - self.low) * (np.arange(self.n) + 0.5) / self.n


def angle_axes(n: int) -> tuple[Axis, Axis]:
    """The axes of Fig. 13: alpha1 and alpha2 between 0 and pi."""
    return Axis("alpha1", 0.0, math.pi, n), Axis("alpha2", 0.0, math.pi, n)


@dataclass(frozen=True)
class StabilityMap:
    """codes (n1, n2) are indices into `NAMES`; the first axis runs along the rows.

    `outline` holds the boundaries between them, if the map was asked to trace them.
    """

    axes: tuple[Axis, Axis]
    codes: np.ndarray
    outline: Outline | None = None

    @property
    def share(self) -> dict[str, float]:
        """Share of the area for each verdict that occurs, and for those that could."""
        counts = np.bincount(self.codes.ravel(), minlength=len(NAMES))
        return {name: float(c) / self.codes.size for name, c in zip(NAMES, counts, strict=True)}


def _angle_rows(pad: Pad, formulation: Formulation, axes: tuple[Axis, Axis]) -> np.ndarray:
    """Codes of a B3 map over the angles: K is the contact's plus one rank-one term a spring."""
    a1, a2 = spring_directions(pad, (axes[0].values, axes[1].values))
    unit = 1.0 / np.sqrt([pad.m, pad.m, pad.I])  # makes the mass matrix one
    u1, u2 = (unit[:, None] * np.sqrt(k) * a for k, a in ((pad.k1, a1), (pad.k2, a2)))
    contact = unit[:, None] * about_origin(pad.replace(k1=0.0, k2=0.0), formulation).K * unit
    return sum_verdicts(contact[:, :, None] + np.einsum("in,jn->ijn", u2, u2), u1)


def _subset(model: PadModel, names: tuple[str, str], pick: np.ndarray) -> PadModel:
    changes = {name: getattr(model.pad, name)[pick] for name in names}
    return PadModel(model.name, model.pad.replace(**changes), model.formulation)


def _verdicts_at(model: PadModel, q: np.ndarray, contact: Any, n: int) -> np.ndarray:
    """Codes of n pads about q (3, n) in one contact state."""
    step = 1e-200
    shifted = q[:, None] + 1j * step * np.eye(3)[:, :, None]
    K = np.broadcast_to(-model.loads(shifted, contact).imag / step, (3, 3, n))
    pad = model.pad
    mass = (pad.m, pad.m, pad.I)
    return undamped_verdicts([K[i, j] / mass[i] for i in range(3) for j in range(3)])


def _balance(
    statics: Statics, names: tuple[str, str], z: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """One pass of Newton's method with the contact state that the gaps tell; z (4, n) is moved.

    Returns the size of each step relative to z, and the sign of the balance's determinant, which
    changes at a fold. A separated pad is treated as if in full contact, which pulls it back.
    """
    heights = statics.gaps(z)
    size, side = np.full(z.shape[1], np.inf), np.zeros(z.shape[1])
    for state in (FULL, LEAD, TRAIL):
        here = np.all((heights < 0.0) == np.array(state)[:, None], axis=0)
        if state == FULL:
            here |= np.all(heights >= 0.0, axis=0)
        if not here.any():
            continue
        part = dataclasses.replace(statics, model=_subset(statics.model, names, here))
        at = z[:, here]
        with np.errstate(all="ignore"):
            f, J = part.residual(at, state), part.derivative(at, state)[:, :3]
            good = np.all(np.isfinite(J), axis=(0, 1)) & np.all(np.isfinite(f), axis=0)
            J[:, :, ~good], f[:, ~good] = np.eye(3)[:, :, None], 0.0
            side[here] = np.sign(np.linalg.det(np.moveaxis(J, -1, 0)))
            singular = side[here] == 0.0
            J[:, :, singular] = np.eye(3)[:, :, None]
        step = np.linalg.solve(np.moveaxis(J, -1, 0), f.T[:, :, None])[:, :, 0].T
        at[:3] -= step
        z[:, here] = at
        relative = np.max(np.abs(step), axis=0) / (1.0 + np.max(np.abs(at[:3]), axis=0))
        size[here] = np.where(good & ~singular, relative, np.inf)
    return size, side


def _solved(statics: Statics, names: tuple[str, str], z: np.ndarray, passes: int) -> np.ndarray:
    """Newton's method at fixed mu from z (4, n), which is moved.

    Returns the sign of the determinant at the equilibrium, 0 where none was found or where the pad
    has turned past 90 degrees.
    """
    for _ in range(passes):
        size, side = _balance(statics, names, z)
        if np.all(size < 1e-12):
            break
    upright = np.abs(statics.model.pad.theta0 + z[2] / statics.model.pad.w) < np.pi / 2
    return np.where((size < 1e-12) & upright, side, 0.0)


def _moved_little(z: np.ndarray, before: np.ndarray) -> np.ndarray:
    """Where the places z (4, n) are still on the branch of those before."""
    jump = np.max(np.abs(z[:3] - before[:3]), axis=0)
    return np.asarray(jump < 0.3 * (1.0 + np.max(np.abs(before[:3]), axis=0)))


def _branch_ends(
    statics: Statics, names: tuple[str, str], mu: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Equilibria (4, n) on the branches from mu = 0; the determinant's sign, 0 short of mu.

    Each point walks in steps of its own, halved where Newton's method fails, passes a fold or
    jumps to another branch; a step below mu/2000 means that the branch turns back.
    """
    z = np.zeros((4, mu.size))
    side = _solved(statics, names, z, 40)
    reached = (side != 0.0) & (mu == 0.0)
    active = (side != 0.0) & ~reached
    step = mu / 8
    while active.any():
        index = np.flatnonzero(active)
        part = dataclasses.replace(statics, model=_subset(statics.model, names, index))
        trial, before = z[:, index], z[:, index]
        trial[3] = np.minimum(trial[3] + step[index], mu[index])
        good = (_solved(part, names, trial, 8) == side[index]) & _moved_little(trial, before)
        z[:, index[good]] = trial[:, good]
        step[index] *= np.where(good, 1.5, 0.5)
        reached |= active & (z[3] >= mu)
        active &= ~reached & (step > mu / 2000)
    return z, np.where(reached, side, 0.0)


class Found(NamedTuple):
    """What is found at n points of a map, arrays over them.

    `codes` are indices into `NAMES`, `contact` into `STATES` (no contact beyond a fold). For B1
    and B2 `places` (4, n) hold the equilibrium in the map's own units and the sign of the
    determinant of its balance; they let other points start from there.
    """

    codes: np.ndarray
    contact: np.ndarray
    places: np.ndarray | None = None


def codes_at(
    scene: Scene, names: tuple[str, str], values: np.ndarray, near: np.ndarray | None = None
) -> Found:
    """Verdicts with two parameters of the scene replaced by the values (2, n).

    B1 and B2 are judged about the equilibrium on the branch from mu = 0, or about the one on the
    same branch as the places `near` (4, n) of other values, which is quicker.
    """
    n = values.shape[1]
    changes: dict[str, Any] = dict(zip(names, values, strict=True))
    model = PadModel(scene.model, scene.pad.replace(**changes), scene.formulation)
    if scene.model == "B3":
        codes = _verdicts_at(model, np.zeros((3, n)), FULL, n)
        return Found(codes, np.full(n, STATES.index(FULL), dtype=np.int8))
    units = Statics.of(scene.pad_model).units
    scaled = model.pad.scaled(units.mass, units.length, units.time)
    statics = Statics(PadModel(model.name, scaled, model.formulation), units)
    mu = np.broadcast_to(np.asarray(model.pad.mu, dtype=float), (n,))
    if near is None:
        z, side = _branch_ends(statics, names, mu)
    else:
        z = np.array([*near[:3], mu])
        side = _solved(statics, names, z, 20)
        side[(side != near[3]) | ~_moved_little(z, near)] = 0.0
    codes = np.full(n, BEYOND_FOLD, dtype=np.int8)
    contact = np.full(n, STATES.index(NONE), dtype=np.int8)
    touching = statics.gaps(z) < 0.0
    for state in STATES:
        here = (side != 0.0) & np.all(touching == np.array(state)[:, None], axis=0)
        if state != NONE and here.any():
            group = _subset(statics.model, names, here)
            q = statics.place(z)[:, here]
            codes[here] = _verdicts_at(group, q, state, int(here.sum()))
            contact[here] = STATES.index(state)
    return Found(codes, contact, np.array([*z[:3], side]))


def on_grid(
    scene: Scene, names: tuple[str, str], x: np.ndarray, y: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """`codes_at` on the grid of x (n1,) and y (n2,): two arrays (n1, n2)."""
    codes, contact = (np.empty((len(x), len(y)), dtype=np.int8) for _ in range(2))
    rows = max(1, 20_000 // len(y))
    for start in range(0, len(x), rows):
        grid = np.meshgrid(x[start : start + rows], y, indexing="ij")
        found = codes_at(scene, names, np.array([values.ravel() for values in grid]))
        for whole, part in zip((codes, contact), found[:2], strict=True):
            whole[start : start + rows] = part.reshape(-1, len(y))
    return codes, contact


def stability_map(scene: Scene, axes: tuple[Axis, Axis], traced: bool = False) -> StabilityMap:
    """Verdict over two parameters of a scene's pad; the mapped ones replace the scene's.

    `traced` finds the boundaries between the points by bisection, for drawing.
    """
    names = (axes[0].name, axes[1].name)
    x, y = axes[0].values, axes[1].values
    if scene.model == "B3" and names == ("alpha1", "alpha2"):
        codes = _angle_rows(scene.pad, scene.formulation, axes)
    else:
        codes, _ = on_grid(scene, names, x, y)
    if not traced:
        return StabilityMap(axes, codes)
    return StabilityMap(axes, codes, traced_map(scene, axes, codes))


def traced_map(
    scene: Scene,
    axes: tuple[Axis, Axis],
    codes: np.ndarray,
    told: Callable[[Found, np.ndarray], np.ndarray] = lambda found, _: found.codes,
) -> Outline:
    """The outline of codes (n1, n2) on the points of a map.

    `told` makes codes of what is found at points (2, n), for maps of more than the verdict.
    """
    names = (axes[0].name, axes[1].name)

    def at(points: np.ndarray) -> np.ndarray:
        return told(codes_at(scene, names, points), points)

    def near(low: np.ndarray, high: np.ndarray) -> Codes:
        one, other = (codes_at(scene, names, end) for end in (low, high))
        assert one.places is not None
        assert other.places is not None
        places = np.where(one.codes == BEYOND_FOLD, other.places, one.places)

        def close(points: np.ndarray) -> np.ndarray:
            found = codes_at(scene, names, points, places)
            here = found.codes != BEYOND_FOLD
            assert found.places is not None
            places[:, here] = found.places[:, here]  # ever closer to where the branch ends
            return told(found, points)

        return close

    ends = ((axes[0].low, axes[0].high), (axes[1].low, axes[1].high))
    quick = near if scene.model != "B3" else None
    return outline(ends, axes[0].values, axes[1].values, codes, at, quick)
