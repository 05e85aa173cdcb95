"""A family of systems along mu, and the functions of mu that vanish at its thresholds."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from squeal.stability.cubic import Cubic, Value, cubic_of
from squeal.stability.eigen import axis_noise, complex_eigenvalues, standard_eigenvalues
from squeal.stability.judgement import judge_reduced
from squeal.stability.matrices import Reduced, System, first_order, reduce, zero_roots
from squeal.stability.roots import Function, Root

GROWING = ("flutter", "divergence")


@dataclass(frozen=True)
class Candidate:
    """A place where the verdict may change, and why."""

    root: Root
    source: str


class Family:
    """A system along mu, each value evaluated once."""

    def __init__(self, system: System) -> None:
        self.system = system
        self._reduced: dict[float, Reduced] = {}
        self._cubic: dict[float, Cubic] = {}
        self._verdict: dict[float, str] = {}

    def at(self, mu: float) -> Reduced:
        if mu not in self._reduced:
            self._reduced[mu] = reduce(*self.system(mu))
        return self._reduced[mu]

    def cubic(self, mu: float) -> Cubic:
        if mu not in self._cubic:
            self._cubic[mu] = cubic_of(self.at(mu))
        return self._cubic[mu]

    def verdict(self, mu: float) -> str:
        """The verdict's kind: flutter, divergence, or quiet for stable and marginal."""
        if mu not in self._verdict:
            name = judge_reduced(self.at(mu)).verdict
            self._verdict[mu] = name if name in GROWING else "quiet"
        return self._verdict[mu]

    def roots_at(self, mu: float, damped: bool) -> np.ndarray:
        """Eigenvalues lambda (damped) or s = -lambda^2, smallest first."""
        reduced = self.at(mu)
        if damped:
            B = np.zeros_like(reduced.A) if reduced.B is None else reduced.B
            matrix, rate = first_order(reduced.A, B)
            values: np.ndarray = np.linalg.eigvals(matrix) * rate
        else:
            values = np.linalg.eigvals(reduced.A)
        return values[np.argsort(np.abs(values))]

    def functions(self, low: float, high: float) -> list[tuple[str, Function]]:
        """Functions that vanish at a threshold inside (low, high), with what each one means."""
        inside = [low + x * (high - low) for x in (0.07, 0.31, 0.53, 0.71, 0.97)]
        damped = any(self.at(mu).B is not None for mu in inside)
        if not damped and self.at(inside[0]).n <= 3:
            cubics = [self.cubic(mu) for mu in inside]
            if any(abs(q.c.value) > q.c.bound for q in cubics):
                return [
                    ("coalescence", lambda mu: self.cubic(mu).discriminant),
                    ("zero", lambda mu: self.cubic(mu).c),
                ]
            if any(abs(q.b.value) > q.b.bound for q in cubics):
                return [
                    ("coalescence", lambda mu: self.cubic(mu).discriminant2),
                    ("zero", lambda mu: self.cubic(mu).b),
                ]
            return [("zero", lambda mu: self.cubic(mu).a)]
        zeros = min(self._zeros(mu, damped) for mu in inside)
        scale = float(np.abs(self.roots_at(inside[2], damped)).max()) or 1.0

        def product(combine: Callable[[np.ndarray], np.ndarray]) -> Function:
            def f(mu: float) -> Value:
                factors = combine(self.roots_at(mu, damped)[zeros:] / scale)
                return Value(float(np.prod(factors).real), 0.0)

            return f

        found = [("coalescence", product(_differences)), ("zero", product(np.asarray))]
        if damped and not all(self._undamped_modes(mu) for mu in inside):
            found.append(("axis", product(_sums)))
        return found

    def _undamped_modes(self, mu: float) -> bool:
        """True if the damping spares a mode: the Hurwitz determinant then says nothing."""
        reduced = self.at(mu)
        if reduced.B is None:
            return True
        matrix, _ = first_order(reduced.A, reduced.B)
        values, _, _, condition = standard_eigenvalues(matrix, reduced.rounding)
        noise = axis_noise(matrix, values, condition, reduced.rounding)
        return bool(np.any((values.imag != 0) & (np.abs(values.real) <= noise)))

    def _zeros(self, mu: float, damped: bool) -> int:
        reduced = self.at(mu)
        if not damped:
            return zero_roots(reduced.A, reduced.rounding)
        return (
            zero_roots(first_order(reduced.A, reduced.B)[0], reduced.rounding)
            if reduced.B is not None
            else 0
        )

    def lead(self, mu: float, damped: bool) -> tuple[float, float]:
        """Growth rates (1/s) of the fastest growing pair and real mode, 0 where there is none."""
        roots = self.roots_at(mu, damped)
        rates = roots if damped else np.sqrt(-roots.astype(complex))
        growth = rates.real if damped else np.abs(rates.real)
        pairs = np.abs(roots.imag) > 1e-9 * np.abs(roots).max()
        real = ~pairs if damped else ~pairs & (roots.real < 0)
        return float(np.max(growth[pairs], initial=0.0)), float(np.max(growth[real], initial=0.0))

    def frequency(self, candidate: Candidate, sides: tuple[str, str]) -> float:
        """Frequency (Hz) of the mode that changes at a candidate; sides: verdict below, above."""
        mu, source = candidate.root.mu, candidate.source
        if source == "zero":
            return 0.0
        damped = self.at(mu).B is not None
        roots = self.roots_at(mu, damped)
        if source == "coalescence":
            gaps = np.abs(roots[:, None] - roots[None, :]) + np.diag(np.full(len(roots), np.inf))
            i, j = np.unravel_index(np.argmin(gaps), gaps.shape)
            mean = (roots[i] + roots[j]).real / 2  # a defective pair's mean is well conditioned
            return 0.0 if damped or mean <= 0 else math.sqrt(mean) / (2 * math.pi)
        if source == "axis":
            pairs = roots[roots.imag > 0]
            return float(pairs[np.argmin(np.abs(pairs.real))].imag) / (2 * math.pi)
        kind = sides[1] if sides[1] in GROWING else sides[0]
        return self._growing_frequency(candidate.root, kind, sides[1] in GROWING)

    def _growing_frequency(self, root: Root, kind: str, above: bool) -> float:
        """Frequency of the growing mode just beside a jump or an exchange of growth rates."""
        if kind == "divergence":
            return 0.0
        for step in (1e-12, 1e-9, 1e-6):
            mu = root.mu + step * (abs(root.mu) or 1.0) * (1 if above else -1)
            dominant = complex_eigenvalues(*self.system(mu)).dominant
            if dominant.value.real > 0 and dominant.value.imag:
                return dominant.frequency_hz
        return dominant.frequency_hz


def _pairs(roots: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    i, j = np.triu_indices(len(roots), 1)
    return roots[i], roots[j]


def _differences(roots: np.ndarray) -> np.ndarray:
    one, other = _pairs(roots)
    return (one - other) ** 2


def _sums(roots: np.ndarray) -> np.ndarray:
    one, other = _pairs(roots)
    return one + other
