"""Folds and changes of contact on a branch, and how far rounding moves them.

They are zeros of extended systems, which are regular where the equilibrium alone is not.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from squeal.equilibrium.statics import Point, Statics
from squeal.model.equations import net_loads
from squeal.model.mechanics import Coefficients, Loads, pose
from squeal.model.states import State
from squeal.numerics import dual
from squeal.numerics.dual import Dual
from squeal.numerics.newton import STEP, newton, with_derivative

UNITS = 4.0 * float(np.finfo(float).eps)  # by which each coefficient and each load may be off
OF_LOADS = ("k1", "k2", "k3", "k4", "k_c", "F_n")  # to each of which one load is proportional


def contact_change(statics: Statics, z: np.ndarray, state: State, point: int) -> Point | None:
    """The place near z (4,) at which the gap of a contact point vanishes along the branch."""

    def conditions(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        f, J = statics.linearised(z, state)
        gap, slope = statics.gaps(z)[point], statics.gap_derivative(z, point)
        return np.append(f, gap), np.vstack([J, slope])

    def moved(c: Coefficients, place: Any, f: Loads) -> tuple[Any, ...]:
        return *_in_lengths(statics, f), statics.model.law.gaps(c, pose(np, place))[point]

    return _located(statics, z, state, conditions, moved)


def fold(statics: Statics, z: np.ndarray, state: State) -> Point | None:
    """The place near z (4,) at which mu is stationary along the branch.

    There the loads F vanish and F_q v = 0, v being normalised; unknowns are z and v.
    """
    start = np.linalg.svd(statics.linearised(z, state, 3)[1])[2][2]

    def along(z: np.ndarray, v: np.ndarray) -> np.ndarray:
        """F_q v."""
        c = statics.model.c._replace(mu=z[3])
        q = tuple(map(Dual, statics.place(z), statics.place(v)))
        f = _in_lengths(statics, net_loads(dual, c, statics.model.law, q, state))  # type: ignore[arg-type]
        return np.array(np.broadcast_arrays(*(part.slope + 0.0 * z[0] for part in f)))

    def conditions(u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        z, v = u[:4], u[4:]
        f, J = statics.linearised(z, state)
        turned, bend = with_derivative(lambda z: along(z, v), z)
        slope = np.block([[J, np.zeros((3, 3))], [bend, J[:, :3]], [np.zeros(4), start]])
        return np.concatenate([f, turned, [start @ v - 1.0]]), slope

    def moved(_: Coefficients, __: Any, f: Loads) -> tuple[Any, ...]:
        return _in_lengths(statics, f)

    return _located(statics, np.append(z, start), state, conditions, moved)


def _in_lengths(statics: Statics, f: Loads) -> tuple[Any, ...]:
    return f.x, f.y, f.moment / statics.model.pad.w


def _located(
    statics: Statics,
    start: np.ndarray,
    state: State,
    conditions: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]],
    moved: Callable[[Coefficients, Any, Loads], tuple[Any, ...]],
) -> Point | None:
    """A zero of the conditions, z first; `moved` are those of them that coefficients move.

    Rounding of each coefficient moves all of them together, that of each load one by one.
    """
    found = newton(conditions, start, tolerance=0.0, steps=15, stalled=1e-6)  # down to rounding
    if not found.converged:
        return None
    z = found.x[:4]
    left, slope = conditions(found.x)
    try:
        by = np.linalg.inv(slope)[3]
    except np.linalg.LinAlgError:
        return None
    size = np.array(statics.model.c._replace(mu=z[3]), dtype=float)
    shifted = Coefficients(*(size[:, None] * (1.0 + 1j * STEP * np.eye(size.size))))
    q = shifted.place(z[:, None].astype(complex))
    rows = moved(shifted, q, net_loads(np, shifted, statics.model.law, q, state))
    rates = np.imag(np.broadcast_arrays(*rows)) / STEP
    loads = rates[:, [Coefficients._fields.index(name) for name in OF_LOADS]]
    by_rates = by[: len(rates)]
    shift = np.abs(by_rates @ rates).sum() + (np.abs(by_rates) @ np.abs(loads)).sum()
    return Point(z, state, float(UNITS * shift + abs(by @ left) + np.spacing(z[3])))
