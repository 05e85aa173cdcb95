"""Slopes of the model's own expressions: of Taylor series of balls, and of doubles."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

try:
    import flint
except ImportError:  # an extra
    flint = None


Number = Any
"""A float, a `flint.arb` or a `flint.arb_series`; a `Jet` too where it meets one."""


@dataclass(slots=True, eq=False)  # many are made: frozen ones take three times as long
class Jet:
    """A number, a ball or a series of balls, and its slopes by x, y, theta and mu.

    Arithmetic on jets carries the slopes along: forward differentiation.
    """

    value: Number
    slopes: tuple[Number, ...]

    @staticmethod
    def of(x: Number) -> Jet:
        """x itself, or a constant."""
        return x if isinstance(x, Jet) else Jet(x, (0, 0, 0, 0))

    def __add__(self, other: Number) -> Jet:
        if not isinstance(other, Jet):
            return Jet(self.value + other, self.slopes)
        slopes = tuple(map(_sum, self.slopes, other.slopes))
        return Jet(self.value + other.value, slopes)

    def __neg__(self) -> Jet:
        return Jet(-self.value, tuple([-a for a in self.slopes]))

    def __sub__(self, other: Number) -> Jet:
        return self + (-other)

    def __rsub__(self, other: Number) -> Jet:
        return -self + other

    def __mul__(self, other: Number) -> Jet:
        if not isinstance(other, Jet):
            return Jet(self.value * other, tuple([_product(a, other) for a in self.slopes]))
        slopes = []
        for a, b in zip(self.slopes, other.slopes, strict=True):
            slopes.append(_sum(_product(a, other.value), _product(b, self.value)))
        return Jet(self.value * other.value, tuple(slopes))

    def __truediv__(self, other: Number) -> Jet:
        if not isinstance(other, Jet):
            one = self.value * 0 + 1  # the quotient of two whole numbers would be rounded
            slopes = []
            for slope in self.slopes:
                is_zero = type(slope) is int and slope == 0
                slopes.append(slope if is_zero else one * slope / other)
            return Jet(self.value / other, tuple(slopes))
        return self * other._inverse()

    def __rtruediv__(self, other: Number) -> Jet:
        return self._inverse() * other

    __radd__ = __add__
    __rmul__ = __mul__

    def _inverse(self) -> Jet:
        """1 over the jet."""
        value = 1 / self.value
        return self.applied(value, -(value * value))

    def applied(self, value: Number, slope: Number) -> Jet:
        """The jet f(self), from the value and the derivative of the function f at self.value."""
        return Jet(value, tuple([_product(a, slope) for a in self.slopes]))


def _sum(a: Number, b: Number) -> Number:
    """a + b, for free where one is the whole number 0: most slopes are."""
    if type(a) is int and a == 0:
        return b
    if type(b) is int and b == 0:
        return a
    return a + b


def _product(slope: Number, factor: Number) -> Number:
    """slope factor, for free where the slope is the whole number 0 or 1: most are."""
    if type(slope) is int:
        if slope == 0:
            return slope
        if slope == 1:
            return factor
        return factor * slope
    return slope * factor


def _as_ball(x: Number) -> Number:
    """A plain number as a ball; balls and series as they are."""
    if hasattr(x, "sin"):
        return x
    return flint.arb(x)


class Functions:
    """The functions that the model's expressions need, of balls, of series of balls and of jets."""

    @staticmethod
    def sin(x: Number) -> Number:
        """The sine."""
        if isinstance(x, Jet):
            return x.applied(x.value.sin(), x.value.cos())
        return _as_ball(x).sin()

    @staticmethod
    def cos(x: Number) -> Number:
        """The cosine."""
        if isinstance(x, Jet):
            return x.applied(x.value.cos(), -x.value.sin())
        return _as_ball(x).cos()

    @staticmethod
    def sqrt(x: Number) -> Number:
        """The square root."""
        if isinstance(x, Jet):
            root = x.value.sqrt()
            return x.applied(root, 0.5 / root)
        return _as_ball(x).sqrt()


class Doubles:
    """Functions of jets of doubles: approximate, for Newton's method alone."""

    @staticmethod
    def sin(x: Jet) -> Jet:
        """The sine."""
        return x.applied(math.sin(x.value), math.cos(x.value))

    @staticmethod
    def cos(x: Jet) -> Jet:
        """The cosine."""
        return x.applied(math.cos(x.value), -math.sin(x.value))

    @staticmethod
    def sqrt(x: Jet) -> Jet:
        """The square root."""
        root = math.sqrt(x.value)
        return x.applied(root, 0.5 / root)
