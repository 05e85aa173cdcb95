"""Newton's method with a status, and derivatives by the complex step."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

STEP = 1e-200  # of the complex step: no difference is taken, so nothing cancels


def complex_step(f: Callable[[Any], Any], x: Any, along: Any = None) -> np.ndarray:
    """Derivative of f at real x (m, ...), exact to rounding.

    f takes and gives arrays and is analytic. The result (p, m, ...) holds df_i/dx_j; with a
    direction `along` (m, ...) it is the derivative (p, ...) in this direction.
    """
    if along is None:
        return with_derivative(f, x)[1]
    return np.asarray(f(np.asarray(x, dtype=complex) + 1j * STEP * np.asarray(along)).imag / STEP)


def with_derivative(
    f: Callable[[Any], Any], x: Any, unknowns: int | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """f (p, ...) at real x (m, ...) and its derivative by the first `unknowns` (all) of x.

    Both come from one evaluation of f at complex x (see `complex_step`).
    """
    at = np.asarray(x, dtype=complex)
    found = np.asarray(f(at[:, None] + _shifts(len(at), unknowns, at.ndim)))
    return found.real[:, 0], found.imag / STEP


@lru_cache
def _shifts(m: int, unknowns: int | None, dimensions: int) -> np.ndarray:
    return 1j * STEP * np.eye(m)[:, :unknowns].reshape((m, -1) + (1,) * (dimensions - 1))


@dataclass(frozen=True, eq=False)
class Newton:
    """Where Newton's method ended: x (m,), and why (converged, singular, diverged, unfinished)."""

    x: np.ndarray
    status: str

    @property
    def converged(self) -> bool:
        """True if the last step was within the tolerance."""
        return self.status == "converged"


def newton(
    f: Callable[[np.ndarray], tuple[Any, Any]],
    x: Any,
    tolerance: float = 1e-13,
    steps: int = 30,
    stalled: float = 0.0,
) -> Newton:
    """A zero of f next to x (m,), where f gives the values (m,) and the derivative (m, m).

    Converged means that no part of a step exceeds `tolerance` times 1 + max |x|, or that steps
    below `stalled` times this shrink no further (next to a singular point rounding keeps them so).
    """
    x, last = np.array(x, dtype=float), np.inf
    for _ in range(steps):
        try:
            value, slope = f(x)
            step = np.linalg.solve(slope, value)
        except np.linalg.LinAlgError:
            return Newton(x, "singular")
        x = x - step
        if not np.all(np.isfinite(x)):
            return Newton(x, "diverged")
        size = float(np.max(np.abs(step)) / (1.0 + np.max(np.abs(x))))
        if size <= tolerance or (size <= stalled and size >= last):
            return Newton(x, "converged")
        last = size
    return Newton(x, "unfinished")
