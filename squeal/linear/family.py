"""A family of undamped systems of up to three degrees of freedom along mu, each value once."""

from collections.abc import Iterable

import numpy as np

from squeal.errors import InputError
from squeal.linear.cubic import Cubic, cubic_of
from squeal.linear.eigen import ComplexArray, complex_eigenvalues
from squeal.linear.growth import GROWING, SMALL, Growth, fastest_rates, growth_of
from squeal.linear.judgement import judge_reduced
from squeal.linear.matrices import LightMassError, Reduced, reduce
from squeal.linear.system import Batched, Matrices, System, is_sparse, matrices_at


class UnsuitedError(Exception):
    """The invariants of `cubic` do not tell everything about a system."""


class Family:
    """A system along mu. Its methods raise UnsuitedError for damping, more rows
    than SMALL, or one root so great that rounding hides the others."""

    def __init__(self, system: System) -> None:
        self.system = system
        self._reduced: dict[float, Reduced] = {}
        self._cubic: dict[float, Cubic] = {}
        self._roots: dict[float, ComplexArray] = {}
        self._growth: dict[float, Growth] = {}
        self._verdict: dict[float, str] = {}

    def at(self, mu: float) -> Reduced:
        """The system at mu in mass-normalised coordinates."""
        if mu not in self._reduced:
            self._reduced[mu] = _reduced(matrices_at(self.system, mu))
        return self._reduced[mu]

    def prepare(self, mus: Iterable[float]) -> None:
        """Evaluate the system at all mus that are to be asked for, if it is cheaper together."""
        if isinstance(self.system, Batched):
            wanted = [mu for mu in dict.fromkeys(mus) if mu not in self._reduced]
            for mu, matrices in zip(wanted, self.system.many(wanted), strict=True):
                self._reduced[mu] = _reduced(matrices)

    def cubic(self, mu: float) -> Cubic:
        """The invariants at mu."""
        if mu not in self._cubic:
            found = cubic_of(self.at(mu))
            if found.vague:
                raise UnsuitedError
            self._cubic[mu] = found
        return self._cubic[mu]

    def roots(self, mu: float) -> ComplexArray:
        """s = -lambda^2 (rad^2/s^2) at mu."""
        if mu not in self._roots:
            self._roots[mu] = np.asarray(np.linalg.eigvals(self.at(mu).A), dtype=complex)
        return self._roots[mu]

    def verdict(self, mu: float) -> str:
        """The verdict's kind: flutter, divergence, or quiet for stable and marginal."""
        if mu not in self._verdict:
            name = judge_reduced(self.at(mu)).verdict
            self._verdict[mu] = name if name in GROWING else "quiet"
        return self._verdict[mu]

    def growth(self, mu: float) -> Growth:
        """What grows at mu, by more than rounding."""
        if mu not in self._growth:
            self._growth[mu] = growth_of(self.at(mu))
        return self._growth[mu]

    def rates(self, mu: float) -> tuple[float, float]:
        """Growth rates (1/s) of the fastest growing pair and real mode, 0 where there is none."""
        return fastest_rates(self.roots(mu))

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


def _reduced(matrices: Matrices) -> Reduced:
    M, C, K = matrices
    if is_sparse(M) or np.shape(M)[0] > SMALL:
        raise UnsuitedError
    try:
        reduced = reduce(M, C, K)
    except LightMassError:
        raise
    except InputError:
        if np.linalg.matrix_rank(np.asarray(M, dtype=float)) == len(np.asarray(M)):
            raise UnsuitedError from None  # a regular M that is not symmetric
        raise
    if reduced.B is not None:
        raise UnsuitedError
    return reduced
