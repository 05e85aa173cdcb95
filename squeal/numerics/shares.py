"""Intervals for shares that were counted."""

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
