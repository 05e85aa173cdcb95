"""Linearisations of many pads that differ in a few parameters: maps and contours rest on them."""

import dataclasses
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from squeal.equilibrium.admissible import excursion
from squeal.equilibrium.damping import UNSTABLE, modal_damping, rayleigh_damping
from squeal.equilibrium.many import branch_ends, moved_little, rests, solved, subset
from squeal.equilibrium.statics import Statics
from squeal.errors import ComputationError
from squeal.io.scene import Scene
from squeal.model.equations import PadModel
from squeal.model.pad import Pad
from squeal.model.units import Units
from squeal.numerics.newton import complex_step

Names = tuple[str, ...]


def _stiffness(model: PadModel, q: np.ndarray, touching: np.ndarray) -> np.ndarray:
    """K (3, 3, n) of n pads about q (3, n); touching (points, n): one at least touches."""
    return -complex_step(partial(model.loads, state=1.0 * touching), q)


def _falling(model: PadModel, q: np.ndarray, touching: np.ndarray) -> np.ndarray:
    """C (3, 3, n) of friction that falls with speed, as `_stiffness` gives K."""
    return -complex_step(partial(model.loads, q, 1.0 * touching), 0.0 * q)


def normalised(pad: Pad, X: np.ndarray) -> np.ndarray:
    """Matrices X (3, 3, n) of pads in coordinates with a mass matrix of one, (n, 3, 3)."""
    unit = 1.0 / np.sqrt(np.broadcast_arrays(pad.m, pad.m, pad.I, X[0, 0])[:3])
    return np.moveaxis(X * (unit[:, None] * unit), -1, 0)


def _damping(scene: Scene, statics: Statics, names: Names, values: np.ndarray) -> np.ndarray | None:
    """Mass-normalised damping matrices (n, 3, 3) of pads with parameters `values`, None if zero."""
    if scene.damping is None:
        return None
    model, units, n = statics.model, statics.units, values.shape[1]
    if scene.damping.matrix is not None:
        turn = np.array([1.0, 1.0, 1.0 / units.length])
        C = np.array(scene.damping.matrix) * np.outer(turn, turn) * units.time / units.mass
        return normalised(model.pad, np.broadcast_to(C[:, :, None], (3, 3, n)))
    smooth = 0.0 * model.pad.mu if "mu" in names else 0.0
    rest = Statics(model.replace(mu=smooth), units)
    z, touching = np.zeros((4, n)), np.ones((model.law.points, n), dtype=bool)
    if not scene.pad_model.linear:
        z, _ = rests(rest, names, n)
        touching = rest.gaps(z) < 0.0
    A = normalised(rest.model.pad, _stiffness(rest.model, rest.place(z), touching))
    if scene.damping.ratios is None:
        assert scene.damping.rayleigh is not None
        alpha, beta = scene.damping.rayleigh
        return rayleigh_damping(A, (alpha * units.time, beta / units.time))
    B, stable = modal_damping(A, scene.damping.ratios)
    if not stable.all():
        at = _in_words(names, values[:, np.argmin(stable)])
        raise ComputationError(f"{UNSTABLE} at {at}")
    return B


def _in_words(names: Names, values: np.ndarray) -> str:
    return ", ".join(f"{name} = {value:.6g}" for name, value in zip(names, values, strict=True))


@dataclass(frozen=True, eq=False)
class Points:
    """n pads about their sliding equilibria, in the units of the equilibria's search.

    there (n,): where an equilibrium was found; touching (points, n): which points touch; places
    (4, n): the equilibrium and the sign of the determinant of its balance, which let others start
    from there; of the m pads with an equilibrium: pads, K (3, 3, m), B (m, 3, 3) the
    mass-normalised damping, None without; rate (1/s) turns their eigenvalues into rad/s; beyond
    (3, m): which limits of `AdmissibleLimits` each equilibrium exceeds (B3 has none).
    """

    there: np.ndarray
    touching: np.ndarray
    places: np.ndarray
    pads: Pad
    K: np.ndarray
    B: np.ndarray | None
    rate: float
    beyond: np.ndarray


def _hidden(
    statics: Statics, names: Names, values: np.ndarray, z: np.ndarray, there: np.ndarray
) -> np.ndarray:
    """Where (n,) of the equilibria that are there rounding leaves no reaction.

    Raises ComputationError where something presses the pad and rounding hides how.
    """
    hidden = there & statics.hidden(z)
    if hidden.any() and (pressed := hidden & statics.presses(z)).any():
        i = int(np.argmax(pressed))
        one = dataclasses.replace(statics, model=subset(statics.model, names, np.array([i])))
        why, at = one.why_hidden(z[:, i : i + 1]), _in_words(names, values[:, i])
        raise ComputationError(f"no equilibrium can be given at {at}: {why}")
    return np.asarray(hidden)


def points_at(
    scene: Scene, names: Names, values: np.ndarray, near: np.ndarray | None = None
) -> Points:
    """The scene's pad with some parameters replaced by the values (len(names), n).

    B1 and B2 are linearised about the equilibrium on the branch from mu = 0, or about the one on
    the same branch as the places `near` (4, n) of other values, which is quicker; B3 about the
    origin. Modal damping ratios refer to the modes without friction of each point's own pad;
    raises ComputationError where such a mode is unstable.
    """
    n = values.shape[1]
    changes: dict[str, Any] = dict(zip(names, values, strict=True))
    model = scene.pad_model.replace(**changes)
    held = model.linear
    units = Units(1.0, 1.0, 1.0, 1.0) if held else Statics.of(scene.pad_model).units
    statics = Statics(units.scaled(model), units)
    mu = np.broadcast_to(np.asarray(model.pad.mu, dtype=float), (n,))
    if held:
        z, side = np.zeros((4, n)), np.ones(n)
    elif near is None:
        z, side = branch_ends(statics, names, mu)
    else:
        z = np.array([*near[:3], mu])
        side = solved(statics, names, z, 20)
        side[(side != near[3]) | ~moved_little(statics, z, near)] = 0.0
    touching = np.ones((model.law.points, n), dtype=bool) if held else statics.gaps(z) < 0.0
    here = (side != 0.0) & touching.any(axis=0)
    if not held:
        here &= ~_hidden(statics, names, values, z, side != 0.0)
    part = dataclasses.replace(statics, model=subset(statics.model, names, here))
    q, touch = statics.place(z)[:, here], touching[:, here]
    K = _stiffness(part.model, q, touch)
    B = _damping(scene, part, names, values[:, here])
    if part.model.terms:
        falling = normalised(part.model.pad, _falling(part.model, q, touch))
        B = falling if B is None else B + falling
    beyond = np.zeros((3, int(here.sum())), dtype=bool)
    if not held:
        beyond = excursion(part, z[:, here], touching[:, here]).beyond()
    at = np.array([*z[:3], side])
    return Points(here, touching, at, part.model.pad, K, B, 1.0 / units.time, beyond)
