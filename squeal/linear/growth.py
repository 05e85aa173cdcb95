"""What grows in a system: how many pairs and real roots, by more than rounding, and how fast."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from squeal.linear.cubic import cubic_of, unstable_roots
from squeal.linear.eigen import axis_noise, squared_frequencies, standard_eigenvalues
from squeal.linear.matrices import Array, Reduced, first_order

GROWING = ("flutter", "divergence")
SMALL = 3  # degrees of freedom up to which `cubic` tells everything about an undamped system


@dataclass(frozen=True)
class Growth:
    """How many pairs and how many real roots grow, and the fastest rate of each (1/s)."""

    pairs: int
    reals: int
    pair_rate: float
    real_rate: float

    @property
    def verdict(self) -> str:
        """flutter or divergence, whichever grows faster, or quiet."""
        if not self.pairs and not self.reals:
            return "quiet"
        return "flutter" if self.pairs and self.pair_rate >= self.real_rate else "divergence"

    @property
    def numbers(self) -> tuple[int, int]:
        """Growing pairs and growing real roots."""
        return self.pairs, self.reals

    @property
    def roots(self) -> int:
        """Growing roots, two for a pair."""
        return 2 * self.pairs + self.reals


def counted(pairs: NDArray[np.bool_], reals: NDArray[np.bool_], rates: Array) -> Growth:
    """The growth of roots: which are growing pairs (one root of each) and growing real ones."""
    fastest = (float(np.max(rates[which], initial=0.0)) for which in (pairs, reals))
    return Growth(int(np.sum(pairs)), int(np.sum(reals)), *fastest)


def rises(pairs: int, reals: int) -> dict[str, int]:
    """How many pairs (flutter) and real roots (divergence) cross where so many more grow above; of
    two divergent ones that join to a growing pair, or come from one, nothing crosses."""
    joined = min(abs(pairs), abs(reals) // 2) * int(np.sign(pairs)) if pairs * reals < 0 else 0
    return {"flutter": pairs - joined, "divergence": reals + 2 * joined}


def growth_of(reduced: Reduced) -> Growth:
    """What grows in a system in mass-normalised coordinates."""
    if reduced.B is not None:
        matrix, rate = first_order(reduced.A, reduced.B)
        v, _, _, condition = standard_eigenvalues(matrix, reduced.rounding, reduced.A)
        noise = axis_noise(matrix, v, condition, reduced.rounding)
        grows = (v.real > noise) & (v != 0)
        return counted(grows & (v.imag > 0), grows & (v.imag == 0), v.real * rate)
    if reduced.n <= SMALL and not (cubic := cubic_of(reduced)).vague:
        s = np.asarray(np.linalg.eigvals(reduced.A), dtype=complex)
        return Growth(*unstable_roots(cubic), *fastest_rates(s))
    s, _, _, condition = squared_frequencies(reduced)
    noise = axis_noise(reduced.A, s, condition, reduced.rounding)
    rates = np.abs(np.sqrt(-s).real)
    return counted(s.imag > 0, (s.imag == 0) & (s.real < -noise), rates)


def fastest_rates(s: NDArray[Any]) -> tuple[float, float]:
    """Growth rates (1/s) of the fastest pair and real root, 0 where there is none, of roots
    s = -lambda^2 (rad^2/s^2) of a small system."""
    growth = np.abs(np.sqrt(-s).real)
    pairs = np.abs(s.imag) > 1e-9 * np.abs(s)
    real = ~pairs & (s.real < 0)
    return float(np.max(growth[pairs], initial=0.0)), float(np.max(growth[real], initial=0.0))
