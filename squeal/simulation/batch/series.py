"""Taylor series of a motion as expressions: the arithmetic in which its equations give them.

A series gives its coefficients one after the other, each from those before it. The equations
of motion, written over generic numbers, then are a recurrence for the series of the state.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import heyoka as hy

Number = Any  # a float or an expression


def total(parts: list[Number]) -> Number:
    """A sum, of which nothing is written where there is nothing to add."""
    parts = [part for part in parts if not (isinstance(part, float) and part == 0.0)]
    if len(parts) < 2:
        return parts[0] if parts else 0.0
    return hy.sum([hy.expression(part) for part in parts])


class Series:
    """A power series; `coefficient(k)` is asked once for each k, in rising order."""

    def __init__(self, coefficient: Callable[[int], Number]) -> None:
        self._coefficient = coefficient
        self._known: list[Number] = []

    def __getitem__(self, k: int) -> Number:
        while len(self._known) <= k:
            self._known.append(self._coefficient(len(self._known)))
        return self._known[k]

    def __add__(self, other: Any) -> Series:
        if isinstance(other, Series):
            return Series(lambda k: total([self[k], other[k]]))
        return Series(lambda k: self[k] if k else total([self[0], other]))

    __radd__ = __add__

    def __neg__(self) -> Series:
        return self * -1.0

    def __sub__(self, other: Any) -> Series:
        return self + -other

    def __rsub__(self, other: Any) -> Series:
        return -self + other

    def __mul__(self, other: Any) -> Series:
        if other is self:
            return Series(lambda k: _square(self, 0, k))
        if isinstance(other, Series):
            return Series(lambda k: total([self[j] * other[k - j] for j in range(k + 1)]))
        return Series(lambda k: self[k] * other)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Series:
        if not isinstance(other, Series):
            return self * (1.0 / other)
        found: Series

        def coefficient(k: int) -> Number:
            known = total([found[j] * other[k - j] for j in range(k)])
            return (self[k] - known) * (1.0 / other[0])

        found = Series(coefficient)
        return found


def _square(a: Series, first: int, k: int) -> Number:
    """The sum of a[j] a[k - j] for j from `first` to k - `first`."""
    pairs = total([a[j] * a[k - j] for j in range(first, (k + 1) // 2)])
    middle = a[k // 2] * a[k // 2] if k % 2 == 0 and k // 2 >= first else 0.0
    return total([2.0 * pairs if not isinstance(pairs, float) else 0.0, middle])


def _slope(a: Series) -> Series:
    return Series(lambda k: a[k] * float(k))


class SeriesFunctions:
    """The functions of series that the equations of motion use."""

    def __init__(self) -> None:
        self._turned: dict[int, tuple[Series, Series, Series]] = {}

    def _turn(self, a: Series) -> tuple[Series, Series]:
        if id(a) not in self._turned:
            slope = _slope(a)

            def rule(start: Any, other: Callable[[], Series], sign: float) -> Series:
                def coefficient(k: int) -> Number:
                    if k == 0:
                        return start(a[0])
                    parts = [slope[j] * other()[k - j] for j in range(1, k + 1)]
                    return total(parts) * (sign / k)

                return Series(coefficient)

            sine: Series = rule(hy.sin, lambda: cosine, 1.0)
            cosine: Series = rule(hy.cos, lambda: sine, -1.0)
            self._turned[id(a)] = (sine, cosine, a)  # kept, so that its id stays its own
        return self._turned[id(a)][:2]

    def sin(self, a: Series) -> Series:
        """Sine."""
        return self._turn(a)[0]

    def cos(self, a: Series) -> Series:
        """Cosine."""
        return self._turn(a)[1]

    @staticmethod
    def exp(a: Series) -> Series:
        """Exponential."""
        found: Series
        slope = _slope(a)

        def coefficient(k: int) -> Number:
            if k == 0:
                return hy.exp(a[0])
            return total([slope[j] * found[k - j] for j in range(1, k + 1)]) * (1.0 / k)

        found = Series(coefficient)
        return found

    @staticmethod
    def sqrt(a: Series) -> Series:
        """Square root."""
        found: Series

        def coefficient(k: int) -> Number:
            if k == 0:
                return hy.sqrt(a[0])
            return (a[k] - _square(found, 1, k)) * (0.5 / found[0])

        found = Series(coefficient)
        return found
