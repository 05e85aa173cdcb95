"""Exact first derivatives: dual numbers through generic arithmetic, and the complex step.

The module offers `sin`, `cos`, `exp` and `sqrt` of dual numbers, so that it can be the `ops` of the
model's functions. Values of dual numbers may be complex (with the complex step they give mixed
second derivatives), or dual numbers again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ClassVar

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


@dataclass(eq=False, slots=True)  # many are made: frozen ones would take three times as long
class Dual:
    """A number (or array) and its derivative by one parameter."""

    value: Any
    slope: Any

    __array_ufunc__: ClassVar = None  # numpy leaves mixed operations to the methods below

    def __add__(self, other: Any) -> Dual:
        if not isinstance(other, Dual):
            return Dual(self.value + other, self.slope)
        return Dual(self.value + other.value, self.slope + other.slope)

    def __neg__(self) -> Dual:
        return Dual(-self.value, -self.slope)

    def __sub__(self, other: Any) -> Dual:
        return self + (-other)

    def __rsub__(self, other: Any) -> Dual:
        return -self + other

    def __mul__(self, other: Any) -> Dual:
        if not isinstance(other, Dual):
            return Dual(self.value * other, self.slope * other)
        return Dual(self.value * other.value, self.slope * other.value + self.value * other.slope)

    def __truediv__(self, other: Any) -> Dual:
        if not isinstance(other, Dual):
            return Dual(self.value / other, self.slope / other)
        ratio = self.value / other.value
        return Dual(ratio, (self.slope - ratio * other.slope) / other.value)

    def __rtruediv__(self, other: Any) -> Dual:
        return dual(other) / self

    def __pow__(self, power: float) -> Dual:
        return Dual(self.value**power, power * self.value ** (power - 1) * self.slope)

    __radd__, __rmul__ = __add__, __mul__


def dual(x: Any) -> Dual:
    """x itself, or a constant."""
    return x if isinstance(x, Dual) else Dual(x, 0.0)


def sin(x: Any) -> Dual:
    """Sine of a number or dual number."""
    x = dual(x)
    return Dual(np.sin(x.value), np.cos(x.value) * x.slope)


def cos(x: Any) -> Dual:
    """Cosine of a number or dual number."""
    x = dual(x)
    return Dual(np.cos(x.value), -np.sin(x.value) * x.slope)


def exp(x: Any) -> Dual:
    """Exponential of a number or dual number."""
    x = dual(x)
    value = np.exp(x.value)
    return Dual(value, value * x.slope)


def sqrt(x: Any) -> Dual:
    """Square root of a number or dual number."""
    x = dual(x)
    root = np.sqrt(x.value)
    return Dual(root, x.slope / (2 * root))
