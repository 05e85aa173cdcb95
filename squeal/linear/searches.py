"""Functions of mu that vanish at the thresholds of a family, and that are smooth even there.

These are invariants of `cubic`: where two frequencies coalesce the discriminant vanishes, where one
passes through zero the determinant. A rigid-body mode makes both vanish for all mu; then those of
the quadratic that remains tell.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from squeal.linear.cubic import Value
from squeal.linear.eigen import ComplexArray
from squeal.linear.family import Family
from squeal.linear.roots import Function, Root, certain

STRAIGHT = 1e-9  # of the range: next to a zero with no slope more is within rounding


@dataclass(frozen=True)
class Search:
    """A function that vanishes at thresholds in [low, high]."""

    source: str  # coalescence, zero
    low: float
    high: float
    function: Function

    def interval(self, root: Root) -> tuple[float, float]:
        """Bracket of a root with rounding taken into account.

        The error of the function is what its own bound says, or what its values close to the root
        scatter by.
        """
        mu, (low, high) = root.mu, root.interval
        step = 1e-6 * (self.high - self.low)
        around = [x for k in range(-3, 4) if self.low <= (x := mu + k * step) <= self.high]
        values = [self.function(x) for x in around]
        at, f = (np.array(around) - mu) / step, np.array([float(v.value) for v in values])
        fit = np.polyfit(at, f, 2)
        scatter = float(np.abs(np.polyval(fit, at) - f).max())
        error = max(4 * scatter, *(float(v.bound) for v in values))
        half = step * error / abs(float(fit[1])) if fit[1] else self.high - self.low
        if half > STRAIGHT * (self.high - self.low):  # the slope may change within

            def known(x: float) -> Value:
                value = self.function(x)
                return Value(value.value, max(float(value.bound), 4 * scatter))

            ends = certain(known, mu, half, self.low, self.high)
            low, high = ends or (low, high)
            half = 0.0 if ends else half
        return (
            float(max(self.low, min(low, mu - half))),
            float(min(self.high, max(high, mu + half))),
        )


def coalescing(s: ComplexArray) -> float:
    """Angular frequency (rad/s) of the two nearest of the roots s = -lambda^2."""
    gaps = np.abs(s[:, None] - s[None, :]) + np.diag(np.full(len(s), np.inf))
    i, j = np.unravel_index(np.argmin(gaps), gaps.shape)
    mean = (s[i] + s[j]) / 2  # of a defective pair it is well conditioned
    return float(np.sqrt(max(mean.real, 0.0)))


def searches(family: Family, low: float, high: float) -> Iterator[Search]:
    """Functions that together tell all thresholds in [low, high], where the system is smooth."""
    cubics = [family.cubic(low + x * (high - low)) for x in (0.07, 0.31, 0.53, 0.71, 0.97)]
    names = ("discriminant", "c")
    if all(abs(q.c.value) <= q.c.bound for q in cubics):
        names = ("discriminant2", "b")
        if all(abs(q.b.value) <= q.b.bound for q in cubics):
            names = ("", "a")
    for source, name in zip(("coalescence", "zero"), names, strict=True):
        if name:

            def f(mu: float, name: str = name) -> Value:
                value: Value = getattr(family.cubic(mu), name)
                return value

            yield Search(source, low, high, f)
