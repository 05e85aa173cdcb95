"""Systems as functions of one parameter: their matrices at some values, and derivatives by it."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from squeal.errors import InputError
from squeal.linear.matrices import Array, checked, dense
from squeal.linear.system import System

Matrices = tuple[ArrayLike, ArrayLike | None, ArrayLike]
SystemFunction = Callable[[float], Matrices]
"""p -> (M, C, K); C may be None (undamped). A method `many` may give them at several values."""


def matrices_at(system: SystemFunction, p: float) -> Matrices:
    """What a system gives at p, unchecked. Raises InputError if that is not M, C and K."""
    matrices = system(p) if callable(system) else None
    if not isinstance(matrices, tuple | list) or len(matrices) != 3:
        raise InputError(
            f"system: {type(system).__name__} is not allowed; it must be a function of one "
            "parameter that gives M, C (or None) and K"
        )
    return matrices


def matrices_of(system: SystemFunction, ps: Sequence[float]) -> list[tuple[Array, Array, Array]]:
    """M, C (zero without damping) and K, arrays (n, n), at each value of the parameter.

    Raises InputError where the system gives no square, finite matrices of one size. Those of a
    plain function must be real.
    """
    many = getattr(system, "many", None)
    unchecked = many(list(ps)) if many else [matrices_at(system, p) for p in ps]
    real = not isinstance(system, System) or system.real
    matrices = []
    for M, C, K in unchecked:
        mass, damping, stiffness = checked(M, C, K, real)
        if damping is None:
            damping = np.zeros_like(mass)
        matrices.append((mass, damping, stiffness))
    return matrices


def with_slopes(
    system: SystemFunction, ps: Sequence[float], low: float, high: float
) -> list[tuple[Any, Any]]:
    """Pairs ((M, C, K), (dM, dC, dK)) at each value, with derivatives by the parameter.

    Arrays (n, n) as those of `matrices_of`, which raises the same errors. Derivatives of a System
    are exact; of another function they are differences over a millionth of the range from low to
    high, one-sided at its ends.

    >>> system = lambda p: (np.eye(1), None, np.array([[1 + p * p]]))
    >>> [((_, C, K), (_, _, dK))] = with_slopes(system, [1.0], 0.0, 2.0)
    >>> C.item(), K.item(), round(dK.item(), 6)
    (0.0, 2.0, 2.0)
    """
    if isinstance(system, System):
        zero = np.zeros((system.n, system.n))
        slopes = []
        for p in ps:
            derivatives = system.derivative(system.parameter, {system.parameter: p})
            slopes.append([zero if dX is None else dense(dX) for dX in derivatives])
        return list(zip(matrices_of(system, ps), slopes, strict=True))
    inside = np.clip(ps, low, high)
    step = 1e-6 * (high - low)
    before = np.maximum(low, inside - step)
    after = np.minimum(high, inside + step)
    # (3 m, 3, n, n) for m values, in one call: a system with `many` computes all of them together
    stacked = np.array(matrices_of(system, [*ps, *before, *after]))
    matrices, matrices_before, matrices_after = np.split(stacked, 3)
    differences = (matrices_after - matrices_before) / (after - before)[:, None, None, None]
    return list(zip(matrices, differences, strict=True))
