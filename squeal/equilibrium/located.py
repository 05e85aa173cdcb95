"""Folds and changes of contact on branches, and how far rounding moves them.

They are zeros of extended systems, which are regular where the equilibrium alone is not.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from squeal.equilibrium.statics import Statics, solve_stack
from squeal.model.equations import net_loads
from squeal.model.pad import Coefficients, pose
from squeal.numerics import differentiation as dual
from squeal.numerics.differentiation import STEP, Dual, with_derivative

UNITS = 4.0 * float(np.finfo(float).eps)  # by which each coefficient and each load may be off
OF_LOADS = ("k1", "k2", "k3", "k4", "k_c", "F_n")  # to each of which one load is proportional
Conditions = Callable[[Statics, np.ndarray, Any], tuple[np.ndarray, np.ndarray]]


def contact_change(
    statics: Statics, z: np.ndarray, touching: np.ndarray, point: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The places near z (4, k) at which the gap of a contact point (k,) vanishes along each
    branch, and where (k,) one was found."""
    return _zero(_touching(statics, 1.0 * touching, point), z)


def fold(statics: Statics, z: np.ndarray, touching: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The places near z (4, k) at which mu is stationary along each branch, and where (k,) one was
    found."""
    conditions, start = _turning(statics, 1.0 * touching, z)
    found, good = _zero(conditions, np.concatenate([z, start]))
    return found[:4], good


def _touching(statics: Statics, on: np.ndarray, point: np.ndarray) -> Any:
    """Balance and one gap, and their derivative by z (4, k)."""

    def conditions(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        f, J = statics.linearised(z, on)
        gap = statics.gaps(z)[point, np.arange(z.shape[1])]
        slope = statics.gap_derivatives(z, point)
        return np.concatenate([f, gap[None]]), np.concatenate([J, slope[None]])

    return conditions


def _turning(statics: Statics, on: np.ndarray, z: np.ndarray) -> tuple[Any, np.ndarray]:
    """Conditions on z and v (7, k): the loads F vanish and F_q v = 0, v being normalised; and v at
    the start."""
    J = np.nan_to_num(np.moveaxis(statics.linearised(z, on, 3)[1], -1, 0))
    start = np.linalg.svd(J)[2][:, 2].T

    def slopes(z: np.ndarray, v: np.ndarray) -> np.ndarray:
        """F_q v."""
        c = statics.model.c._replace(mu=z[3])
        q = tuple(map(Dual, statics.place(z), statics.place(v)))
        f = net_loads(dual, c, statics.model.law, q, on)  # type: ignore[arg-type]
        each = (f.x, f.y, f.moment / statics.model.pad.w)
        return np.array(np.broadcast_arrays(*(part.slope + 0.0 * z[0] for part in each)))

    def conditions(u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        z, v = u[:4], u[4:]
        f, J = statics.linearised(z, on)
        # shapes (4, 1, k) and (3, 1, k): all directions of the complex step at once
        turned, bend = with_derivative(lambda z: slopes(z, v[:, None]), z)
        slope = np.zeros((7, 7, z.shape[1]))
        slope[:3, :4], slope[3:6, :4], slope[3:6, 4:] = J, bend, J[:, :3]
        slope[6, 4:] = start
        value = np.concatenate([f, turned, [(start * v).sum(axis=0) - 1.0]])
        return value, slope

    return conditions, start


def _zero(conditions: Any, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Zeros (m, k) of the conditions next to `start`, down to rounding; where (k,) one was met."""
    x, last = start.copy(), np.full(start.shape[1], np.inf)
    good = np.zeros(start.shape[1], dtype=bool)
    for _ in range(15):
        with np.errstate(all="ignore"):
            value, slope = conditions(x)
            step, regular = solve_stack(np.moveaxis(slope, -1, 0), value.T[:, :, None])
            move = np.where(good, 0.0, step[:, :, 0].T)
            x = x - move
            size = np.max(np.abs(move), axis=0) / (1.0 + np.max(np.abs(x), axis=0))
        good |= regular & ((size == 0.0) | ((size <= 1e-6) & (size >= last)))
        last = size
        if good.all():
            break
    return x, good & np.isfinite(x).all(axis=0)


def position_error(statics: Statics, z: np.ndarray, touching: np.ndarray, point: int) -> float:
    """How far rounding may move the mu of a contact change of one pad at z (4, 1), or with point
    -1 of a fold.

    Rounding of each coefficient moves all conditions together, that of each load one by one.
    """
    on = 1.0 * touching[:, None]
    if point >= 0:
        conditions, u = _touching(statics, on, np.array([point])), z
    else:
        conditions, v = _turning(statics, on, z)
        u = np.concatenate([z, v])
    left, slope = (part[..., 0] for part in conditions(u))
    try:
        by = np.linalg.inv(slope)[3]
    except np.linalg.LinAlgError:
        return np.inf
    size = np.array([float(np.ravel(v)[0]) for v in statics.model.c._replace(mu=z[3])])
    shifted = Coefficients(*(size[:, None] * (1.0 + 1j * STEP * np.eye(size.size))))
    q = shifted.place(z.astype(complex))
    f = net_loads(np, shifted, statics.model.law, q, 1.0 * touching)
    rows: tuple[Any, ...] = (f.x, f.y, f.moment / np.ravel(statics.model.pad.w)[0])
    if point >= 0:
        rows += (statics.model.law.gaps(shifted, pose(np, q))[point],)
    rates = np.imag(np.broadcast_arrays(*rows)) / STEP
    loads = rates[:, [Coefficients._fields.index(name) for name in OF_LOADS]]
    by_rates = by[: len(rates)]
    shift = np.abs(by_rates @ rates).sum() + (np.abs(by_rates) @ np.abs(loads)).sum()
    return float(UNITS * shift + abs(by @ left) + np.spacing(z[3, 0]))
