"""Equilibria of many pads at once, which differ in a few parameters: maps start from here."""

from __future__ import annotations

import dataclasses

import numpy as np

from squeal.equilibrium.statics import Statics
from squeal.model.equations import PadModel


def subset(model: PadModel, names: tuple[str, ...], pick: np.ndarray) -> PadModel:
    """The pads that `pick` names of those whose parameters `names` are arrays."""
    changes = {name: getattr(model.pad, name)[pick] for name in names}
    return model.replace(**changes)


def _balance(
    statics: Statics, names: tuple[str, ...], z: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """One pass of Newton's method with the contact state that the gaps tell; z (4, n) is moved.

    Returns the size of each step relative to z, and the sign of the balance's determinant, which
    changes at a fold. A separated pad is treated as if in full contact, which pulls it back.
    """
    heights = statics.gaps(z)
    size, side = np.full(z.shape[1], np.inf), np.zeros(z.shape[1])
    for state in filter(any, statics.model.states):
        here = np.all((heights < 0.0) == np.array(state)[:, None], axis=0)
        if all(state):
            here |= np.all(heights >= 0.0, axis=0)
        if not here.any():
            continue
        part = dataclasses.replace(statics, model=subset(statics.model, names, here))
        at = z[:, here]
        with np.errstate(all="ignore"):
            f, J = part.linearised(at, state, 3)
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


def solved(statics: Statics, names: tuple[str, ...], z: np.ndarray, passes: int) -> np.ndarray:
    """Newton's method at fixed mu from z (4, n), which is moved.

    Returns the sign of the determinant at the equilibrium, 0 where none was found or where the pad
    has turned past 90 degrees.
    """
    for _ in range(passes):
        size, side = _balance(statics, names, z)
        if np.all(size < 1e-12):
            break
    upright = np.abs(statics.tilt(z)) < np.pi / 2
    return np.where((size < 1e-12) & upright, side, 0.0)


def moved_little(z: np.ndarray, before: np.ndarray) -> np.ndarray:
    """Where the places z (4, n) are still on the branch of those before."""
    jump = np.max(np.abs(z[:3] - before[:3]), axis=0)
    return np.asarray(jump < 0.3 * (1.0 + np.max(np.abs(before[:3]), axis=0)))


def branch_ends(
    statics: Statics, names: tuple[str, ...], mu: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Equilibria (4, n) on the branches from mu = 0; the determinant's sign, 0 short of mu.

    Each point walks in steps of its own, halved where Newton's method fails, passes a fold or
    jumps to another branch; a step below mu/2000 means that the branch turns back.
    """
    z = np.zeros((4, mu.size))
    side = solved(statics, names, z, 40)
    reached = (side != 0.0) & (mu == 0.0)
    active = (side != 0.0) & ~reached
    step = mu / 8
    while active.any():
        index = np.flatnonzero(active)
        part = dataclasses.replace(statics, model=subset(statics.model, names, index))
        trial, before = z[:, index], z[:, index]
        trial[3] = np.minimum(trial[3] + step[index], mu[index])
        good = (solved(part, names, trial, 8) == side[index]) & moved_little(trial, before)
        z[:, index[good]] = trial[:, good]
        step[index] *= np.where(good, 1.5, 0.5)
        reached |= active & (z[3] >= mu)
        active &= ~reached & (step > mu / 2000)
    return z, np.where(reached, side, 0.0)
