"""Intervals for shares that were counted, and whether two differ."""

import math
from statistics import NormalDist


def wilson(count: int, total: int, confidence: float = 0.95) -> tuple[float, float]:
    """Wilson's interval for a share of which `count` of `total` were seen.

    By hand, since loading scipy.stats takes longer than what asks for it.
    """
    z = NormalDist().inv_cdf((1.0 + confidence) / 2.0)
    middle, whole = count + z * z / 2.0, total + z * z
    half = z * math.sqrt(count * (total - count) / total + z * z / 4.0)
    low = (middle - half) / whole if count > 0 else 0.0
    high = (middle + half) / whole if count < total else 1.0
    return low, high


def fisher_exact(counts: tuple[int, int], totals: tuple[int, int]) -> float:
    """Probability, by Fisher's exact test, that two shares are as far apart by chance.

    Of all ways to spread the sum of the counts over the totals, those that are no likelier.
    """
    (one, other), whole = totals, sum(counts)

    def likely(k: int) -> float:
        return _choices(one, k) + _choices(other, whole - k) - _choices(one + other, whole)

    every = [likely(k) for k in range(max(0, whole - other), min(one, whole) + 1)]
    seen = likely(counts[0]) + 1e-7
    return min(1.0, math.fsum(math.exp(value) for value in every if value <= seen))


def _choices(n: int, k: int) -> float:
    """Logarithm of the binomial coefficient."""
    return math.lgamma(n + 1) - math.lgamma(k + 1) - math.lgamma(n - k + 1)
