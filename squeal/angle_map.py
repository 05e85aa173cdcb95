"""Stability over (alpha1, alpha2), or over any two parameters of a scene.

B3 maps linearise about the origin. B1 and B2 maps find the sliding equilibrium of every point
first, by continuation from mu = 0 of all points together.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from squeal.contact import Formulation
from squeal.equilibrium.statics import Statics
from squeal.linear import about_origin, spring_directions
from squeal.model import PadModel
from squeal.pad import Pad
from squeal.scene import Scene
from squeal.stability import VERDICTS, sum_verdicts, undamped_verdicts
from squeal.states import FULL, LEAD, NONE, STATES, TRAIL

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
    """codes (n1, n2) are indices into `NAMES`; the first axis runs along the rows."""

    axes: tuple[Axis, Axis]
    codes: np.ndarray

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


def _pads(pad: Pad, axes: tuple[Axis, Axis]) -> Iterator[tuple[slice, Pad, int]]:
    """Pads whose two mapped parameters are arrays, some rows of the map at a time."""
    first, second = axes[0].values, axes[1].values
    rows = max(1, 20_000 // axes[1].n)
    for start in range(0, axes[0].n, rows):
        part = slice(start, min(start + rows, axes[0].n))
        grid = np.meshgrid(first[part], second, indexing="ij")
        changes: dict[str, Any] = {
            axis.name: values.ravel() for axis, values in zip(axes, grid, strict=True)
        }
        yield part, pad.replace(**changes), grid[0].size


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


def _balance(statics: Statics, names: tuple[str, str], z: np.ndarray) -> np.ndarray:
    """One pass of Newton's method with the contact state that the gaps tell; z (4, n) is moved.

    Returns the size of each step relative to z. A separated pad is treated as if in full
    contact, which pulls it back.
    """
    heights = statics.gaps(z)
    size = np.full(z.shape[1], np.inf)
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
            singular = np.linalg.det(np.moveaxis(J, -1, 0)) == 0.0
            J[:, :, singular] = np.eye(3)[:, :, None]
        step = np.linalg.solve(np.moveaxis(J, -1, 0), f.T[:, :, None])[:, :, 0].T
        at[:3] -= step
        z[:, here] = at
        relative = np.max(np.abs(step), axis=0) / (1.0 + np.max(np.abs(at[:3]), axis=0))
        size[here] = np.where(good & ~singular, relative, np.inf)
    return size


def _solved(statics: Statics, names: tuple[str, str], z: np.ndarray, passes: int) -> np.ndarray:
    """Newton's method at fixed mu from z (4, n), which is moved; which of them converged."""
    size = np.full(z.shape[1], np.inf)
    for _ in range(passes):
        size = _balance(statics, names, z)
        if np.all(size < 1e-12):
            break
    return np.asarray(size < 1e-12)


def _branch_ends(
    statics: Statics, names: tuple[str, str], mu: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Equilibria (4, n) on the branches from mu = 0, and which of them reach mu (n,).

    Each point walks in steps of its own, halved where Newton's method fails or jumps to another
    branch; a step below mu/2000 means that the branch turns back.
    """
    z = np.zeros((4, mu.size))
    active = _solved(statics, names, z, 40)
    reached = active & (mu == 0.0)
    step = mu / 8
    active &= ~reached
    while active.any():
        index = np.flatnonzero(active)
        part = dataclasses.replace(statics, model=_subset(statics.model, names, index))
        trial = z[:, index]
        trial[3] = np.minimum(trial[3] + step[index], mu[index])
        before = z[:3, index]
        good = _solved(part, names, trial, 8)
        jump = np.max(np.abs(trial[:3] - before), axis=0)
        good &= jump < 0.3 * (1.0 + np.max(np.abs(before), axis=0))
        z[:, index[good]] = trial[:, good]
        step[index] *= np.where(good, 1.5, 0.5)
        reached |= active & (z[3] >= mu)
        active &= ~reached & (step > mu / 2000)
    return z, reached


def _equilibrium_codes(model: PadModel, names: tuple[str, str], n: int) -> np.ndarray:
    """Codes of n pads (two array parameters) about the equilibrium on the branch from mu = 0."""
    base = {name: float(np.mean(getattr(model.pad, name))) for name in names}
    units = Statics.of(PadModel(model.name, model.pad.replace(**base), model.formulation)).units
    scaled = model.pad.scaled(units.mass, units.length, units.time)
    statics = Statics(PadModel(model.name, scaled, model.formulation), units)
    mu = np.broadcast_to(np.asarray(model.pad.mu, dtype=float), (n,))
    codes = np.full(n, BEYOND_FOLD, dtype=np.int8)
    z, reached = _branch_ends(statics, names, mu)
    touching = statics.gaps(z) < 0.0
    for state in STATES:
        here = reached & np.all(touching == np.array(state)[:, None], axis=0)
        if state != NONE and here.any():
            group = _subset(statics.model, names, here)
            q = statics.place(z)[:, here]
            codes[here] = _verdicts_at(group, q, state, int(here.sum()))
    return codes


def stability_map(scene: Scene, axes: tuple[Axis, Axis]) -> StabilityMap:
    """Verdict over two parameters of a scene's pad; the mapped ones replace the scene's."""
    names = (axes[0].name, axes[1].name)
    if scene.model == "B3" and names == ("alpha1", "alpha2"):
        return StabilityMap(axes, _angle_rows(scene.pad, scene.formulation, axes))
    codes = np.empty((axes[0].n, axes[1].n), dtype=np.int8)
    for part, pads, n in _pads(scene.pad, axes):
        model = PadModel(scene.model, pads, scene.formulation)
        if scene.model == "B3":
            found = _verdicts_at(model, np.zeros((3, n)), FULL, n)
        else:
            found = _equilibrium_codes(model, names, n)
        codes[part] = found.reshape(-1, axes[1].n)
    return StabilityMap(axes, codes)
