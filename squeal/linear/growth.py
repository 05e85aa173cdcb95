"""Kept until all import `squeal.linear.verdict`."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from squeal.linear.matrices import Array
from squeal.linear.verdict import GROWING, UnstableCount, growth_of

Growth = UnstableCount
SMALL = 3


def counted(pairs: NDArray[np.bool_], reals: NDArray[np.bool_], rates: Array) -> Growth:
    """The growth of roots: which are growing pairs (one root of each) and growing real ones."""
    fastest = (float(np.max(rates[which], initial=0.0)) for which in (pairs, reals))
    return Growth(int(np.sum(pairs)), int(np.sum(reals)), *fastest)


def rises(pairs: int, reals: int) -> dict[str, int]:
    """How many pairs (flutter) and real roots (divergence) cross where so many more grow above; of
    two divergent ones that join to a growing pair, or come from one, nothing crosses."""
    joined = min(abs(pairs), abs(reals) // 2) * int(np.sign(pairs)) if pairs * reals < 0 else 0
    return {"flutter": pairs - joined, "divergence": reals + 2 * joined}


def fastest_rates(s: NDArray[Any]) -> tuple[float, float]:
    """Growth rates (1/s) of the fastest pair and real root, 0 where there is none, of roots
    s = -lambda^2 (rad^2/s^2) of a small system."""
    growth = np.abs(np.sqrt(-s).real)
    pairs = np.abs(s.imag) > 1e-9 * np.abs(s)
    real = ~pairs & (s.real < 0)
    return float(np.max(growth[pairs], initial=0.0)), float(np.max(growth[real], initial=0.0))


__all__ = ["GROWING", "SMALL", "Growth", "counted", "fastest_rates", "growth_of", "rises"]
