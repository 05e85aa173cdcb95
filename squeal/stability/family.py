"""A family of systems along mu, each value evaluated once."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from squeal.stability.cubic import Cubic, cubic_of, unstable_roots
from squeal.stability.eigen import (
    ComplexArray,
    axis_noise,
    complex_eigenvalues,
    squared_frequencies,
    standard_eigenvalues,
)
from squeal.stability.judgement import judge_reduced
from squeal.stability.matrices import Batched, Reduced, System, first_order, reduce

GROWING = ("flutter", "divergence")
SMALL = 3  # degrees of freedom up to which `cubic` tells everything about an undamped system


@dataclass(frozen=True)
class Growing:
    """How many pairs and how many real modes grow, with the fastest growth rate of each (1/s)."""

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


class Family:
    """A system along mu; its eigenvalues are those of stretches with or without damping."""

    def __init__(self, system: System) -> None:
        self.system = system
        self._reduced: dict[float, Reduced] = {}
        self._cubic: dict[float, Cubic] = {}
        self._roots: dict[tuple[float, bool], ComplexArray] = {}
        self._growing: dict[float, Growing] = {}
        self._verdict: dict[float, str] = {}

    def at(self, mu: float) -> Reduced:
        """The system at mu in mass-normalised coordinates."""
        if mu not in self._reduced:
            self._reduced[mu] = reduce(*self.system(mu))
        return self._reduced[mu]

    def prepare(self, mus: Iterable[float]) -> None:
        """Evaluate the system at all mus that are to be asked for, if it is cheaper together."""
        if isinstance(self.system, Batched):
            wanted = [mu for mu in dict.fromkeys(mus) if mu not in self._reduced]
            for mu, matrices in zip(wanted, self.system.many(wanted), strict=True):
                self._reduced[mu] = reduce(*matrices)

    def small(self, mu: float) -> bool:
        """True where the invariants of `cubic` tell everything."""
        return self.at(mu).B is None and self.at(mu).n <= SMALL

    def cubic(self, mu: float) -> Cubic:
        """The invariants of a small undamped system."""
        if mu not in self._cubic:
            self._cubic[mu] = cubic_of(self.at(mu))
        return self._cubic[mu]

    def roots(self, mu: float, damped: bool) -> ComplexArray:
        """Eigenvalues lambda or s = -lambda^2 in the order of `ordered_roots`."""
        if (mu, damped) not in self._roots:
            self._roots[mu, damped] = ordered_roots(self.at(mu), damped)
        return self._roots[mu, damped]

    def verdict(self, mu: float) -> str:
        """The verdict's kind: flutter, divergence, or quiet for stable and marginal."""
        if self.at(mu).n > SMALL:
            return self.growing(mu).verdict
        if mu not in self._verdict:
            name = judge_reduced(self.at(mu)).verdict
            self._verdict[mu] = name if name in GROWING else "quiet"
        return self._verdict[mu]

    def growing(self, mu: float) -> Growing:
        """What grows at mu, by more than rounding."""
        if mu not in self._growing:
            reduced = self.at(mu)
            if self.small(mu):
                found = Growing(*unstable_roots(self.cubic(mu)), *self.lead(mu, False))
            elif reduced.B is None:
                s, _, _, condition = squared_frequencies(reduced)
                noise = axis_noise(reduced.A, s, condition, reduced.rounding)
                rates = np.abs(np.sqrt(-s).real)
                found = _counted(s.imag > 0, (s.imag == 0) & (s.real < -noise), rates)
            else:
                matrix, rate = first_order(reduced.A, reduced.B)
                v, _, _, condition = standard_eigenvalues(matrix, reduced.rounding)
                noise = axis_noise(matrix, v, condition, reduced.rounding)
                grows = (v.real > noise) & (v != 0)
                found = _counted(grows & (v.imag > 0), grows & (v.imag == 0), v.real * rate)
            self._growing[mu] = found
        return self._growing[mu]

    def seems(self, mu: float, damped: bool) -> tuple[int, int, str]:
        """How many pairs and real modes seem to grow and which fastest, from eigenvalues alone."""
        roots = self.roots(mu, damped)
        noise = 1e-7 * np.abs(roots).max()
        grows = roots.real > noise if damped else roots.real < -noise
        pairs = (grows if damped else True) & (roots.imag > noise)
        reals = grows & (np.abs(roots.imag) <= noise)
        lead = self.lead(mu, damped)
        return int(np.sum(pairs)), int(np.sum(reals)), "pair" if lead[0] >= lead[1] else "real"

    def lead(self, mu: float, damped: bool) -> tuple[float, float]:
        """Growth rates (1/s) of the fastest growing pair and real mode, 0 where there is none."""
        roots = self.roots(mu, damped)
        rates = roots if damped else np.sqrt(-roots)
        growth = rates.real if damped else np.abs(rates.real)
        pairs = np.abs(roots.imag) > 1e-9 * np.abs(roots).max()
        real = ~pairs if damped else ~pairs & (roots.real < 0)
        return float(np.max(growth[pairs], initial=0.0)), float(np.max(growth[real], initial=0.0))

    def growing_frequency(self, mu: float, kind: str, above: bool) -> float:
        """Frequency (Hz) of the growing mode just beside a jump or an exchange of growth rates."""
        if kind == "divergence":
            return 0.0
        for step in (1e-12, 1e-9, 1e-6):
            beside = mu + step * (abs(mu) or 1.0) * (1 if above else -1)
            dominant = complex_eigenvalues(*self.system(beside)).dominant
            if dominant.value.real > 0 and dominant.value.imag:
                return dominant.frequency_hz
        return dominant.frequency_hz


def ordered_roots(reduced: Reduced, damped: bool) -> ComplexArray:
    """Eigenvalues lambda (rad/s), or s = -lambda^2, so that neighbours may meet.

    s by rising real part; lambda by |Im| - Re, in which a real one passes through zero smoothly
    and conjugates stand together.
    """
    if damped:
        B = np.zeros_like(reduced.A) if reduced.B is None else reduced.B
        matrix, rate = first_order(reduced.A, B)
        values = np.asarray(np.linalg.eigvals(matrix) * rate, dtype=complex)
    else:
        values = np.asarray(np.linalg.eigvals(reduced.A), dtype=complex)
    return values[np.argsort(place(values, damped), kind="stable")]


def place(roots: ComplexArray, damped: bool) -> np.ndarray:
    """What roots are sorted by, see `ordered_roots`."""
    return np.asarray(np.abs(roots.imag) - roots.real if damped else roots.real)


def _counted(pairs: np.ndarray, reals: np.ndarray, rates: np.ndarray) -> Growing:
    fastest = (float(np.max(rates[which], initial=0.0)) for which in (pairs, reals))
    return Growing(int(np.sum(pairs)), int(np.sum(reals)), *fastest)
