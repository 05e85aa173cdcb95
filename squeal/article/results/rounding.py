"""Rounding of upper bounds."""

import math
from decimal import ROUND_CEILING, Decimal


def rounded_up(value: float, digits: int = 2) -> float:
    """The least number of so many significant digits that is not below the value."""
    if not math.isfinite(value) or value == 0.0:
        return value
    exact = Decimal(value)
    step = Decimal(1).scaleb(exact.adjusted() - digits + 1)
    return float(exact.quantize(step, ROUND_CEILING))
