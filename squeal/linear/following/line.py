"""A system along one parameter as a standard eigenvalue problem A(p) v = z v with its derivative.

Without damping z = s = -lambda^2 in mass-normalised coordinates: what oscillates lies on the
positive real axis. With damping z = lambda / rate of the first-order form: what oscillates lies on
the imaginary axis. Off that line something grows.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from squeal.errors import InputError, MatrixError
from squeal.linear.eigen import hidden
from squeal.linear.following.coupling import ComplexArray, Couplings
from squeal.linear.growth import Growth, counted
from squeal.linear.light import Slow
from squeal.linear.matrices import (
    EPS,
    ILL,
    Array,
    LightMassError,
    checked,
    first_order,
    norm_of,
    reduce,
    unit_diagonal,
)
from squeal.linear.system import System, TermSystem, dense, matrices_at
from squeal.numerics.inverse import inverse

Slopes = Callable[[float], tuple[Array | None, Array | None, Array | None]]
DIFFERENCE = 1e-6  # of the range: step of the derivative of a function of one parameter
INDEPENDENT = 1e-7  # least singular value of the vectors whose inverse gives the left ones


@dataclass(frozen=True, eq=False)
class State:
    """Roots z (m,) at one value of the parameter with derivatives, vectors and rounding errors.

    `noise` bounds how far rounding moves a root, `coupling` is dA/dp in the eigenvectors, with
    left^H right = 1.
    """

    value: float
    roots: ComplexArray
    slopes: ComplexArray
    right: ComplexArray = field(repr=False)  # (N, m)
    left: ComplexArray = field(repr=False)
    noise: Array = field(repr=False)
    coupling: ComplexArray = field(repr=False)  # (m, m), the slopes on its diagonal

    damped: bool

    @cached_property
    def oscillates(self) -> NDArray[np.bool_]:
        """Roots of pairs, by more than rounding; all others are real."""
        return np.abs(self.roots.imag) > self.noise

    @cached_property
    def on_line(self) -> NDArray[np.bool_]:
        """Roots that neither grow nor decay, as far as rounding tells."""
        if self.damped:
            return np.abs(self.roots.real) <= self.noise
        return ~self.oscillates & (self.roots.real >= -self.noise)

    @cached_property
    def grows(self) -> NDArray[np.bool_]:
        """Roots that grow by more than rounding, of a pair without damping both."""
        return self.roots.real > self.noise if self.damped else ~self.on_line

    @cached_property
    def rates(self) -> Array:
        """Growth rates, without damping of the root that grows; in units of the line's rate."""
        return self.roots.real if self.damped else np.abs(np.sqrt(-self.roots + 0j).real)

    @cached_property
    def close(self) -> NDArray[np.bool_]:
        """Which roots (m, m) rounding does not tell apart."""
        apart = np.abs(self.roots[:, None] - self.roots)
        return np.asarray(apart <= np.add.outer(self.noise, self.noise))

    @cached_property
    def couplings(self) -> Couplings:
        """Of the pairs of roots that may change what grows."""
        return Couplings.of(self.roots, self.coupling, self.noise, self.damped)


class Line:
    """system(p) -> (M, C, K) between two values of p, M regular."""

    def __init__(self, system: System, low: float, high: float) -> None:
        self.system, self.low, self.high = system, low, high
        inside = [low + x * (high - low) for x in (0.07, 0.31, 0.53, 0.71, 0.97)]
        self._terms = _Terms.of(system)
        self.damped = any(self._matrices(p)[1] is not None for p in inside)
        self.rate, self.n = 1.0, len(self._matrices(inside[0])[0])
        if self.damped:
            (A, B), _, _ = self._parts(inside[2])
            self.rate = float(first_order(A, B)[1])
        self._states: dict[float, State] = {}
        self._last: tuple[float, Array, Array, float] | None = None

    @property
    def states(self) -> list[State]:
        """All states so far, by rising value."""
        return [self._states[p] for p in sorted(self._states)]

    def _matrices(self, p: float) -> tuple[Array, Array | None, Array]:
        M, C, K = (_full(X) for X in matrices_at(self.system, p))
        if any(X is not None and np.iscomplexobj(X) for X in (M, C, K)):
            raise InputError(
                "thresholds: complex matrices (structural damping) are not allowed; damping by "
                "rayleigh or ratios is"
            )
        return checked(np.asarray(M), C, np.asarray(K))

    def _derivatives(self, p: float) -> tuple[Array, Array, Array]:
        zero = np.zeros((self.n, self.n))
        if isinstance(self.system, TermSystem):
            name = self.system.parameter
            slopes = (_full(X) for X in self.system.derivative(name, {name: p}))
            M, C, K = (zero if X is None else X for X in slopes)
            return M, C, K
        step = DIFFERENCE * (self.high - self.low)
        p = min(max(p, self.low), self.high)
        a, b = max(self.low, p - step), min(self.high, p + step)
        pairs = zip(self._matrices(a), self._matrices(b), strict=True)
        M, C, K = (
            ((zero if y is None else y) - (zero if x is None else x)) / (b - a) for x, y in pairs
        )
        return M, C, K

    def _parts(self, p: float) -> tuple[tuple[Array, Array], tuple[Array, Array], float]:
        """A, B of z'' + B z' + A z = 0, their derivatives, relative rounding errors of A."""
        if self._terms is not None:
            return self._terms.at(p)
        M, C, K = self._matrices(p)
        dM, dC, dK = self._derivatives(p)
        left, right, rounding = _normalising(M)
        C = np.zeros_like(K) if C is None else C
        if isinstance(self.system, Slow):
            rounding *= self.system.growth
        A, B, mass, dA, dB = (left @ X @ right for X in (K, C, dM, dK, dC))
        return (A, B), (dA - mass @ A, dB - mass @ B), rounding

    def both(self, p: float) -> tuple[Array, Array, float]:
        """A(p), dA/dp in the same coordinates, and the relative rounding errors of A."""
        if self._last is None or self._last[0] != p:
            (A, B), (dA, dB), rounding = self._parts(p)
            if self.damped:
                eye, zero = np.eye(self.n), np.zeros((self.n, self.n))
                A = np.block([[zero, eye], [-A / self.rate**2, -B / self.rate]])
                dA = np.block([[zero, zero], [-dA / self.rate**2, -dB / self.rate]])
            self._last = (p, A, dA, rounding)
        return self._last[1:]

    def at(self, p: float) -> State:
        """The state at p, computed once."""
        if p not in self._states:
            self._states[p] = self._computed(p)
        return self._states[p]

    def _computed(self, p: float) -> State:
        A, slope, rounding = self.both(p)
        roots, right, left = _vectors(A)
        across = np.sum(left.conj() * right, axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):
            condition = 1.0 / np.abs(across)
            rows = slope.any(axis=1)
            moved = slope[rows] @ np.ascontiguousarray(right).view(float)  # real: half the work
            coupling = left[rows].conj().T @ moved.view(complex)
            coupling = np.nan_to_num(coupling / across[:, None])
        error = 2 * len(A) * min(rounding, 4 * EPS) / 4
        noise = norm_of(A) * np.minimum(error * condition, np.sqrt(error))
        return State(p, roots, coupling.diagonal(), right, left, noise, coupling, self.damped)

    def hides(self, p: float) -> bool:
        """True if rounding leaves the slow roots at p too few digits, see `eigen.hidden`."""
        M, C, K = self._matrices(p)
        with suppress(InputError):  # M is not symmetric
            return hidden(reduce(M, C, K), K)
        return False

    def growth(self, p: float) -> Growth:
        """What grows at p by more than rounding."""
        state = self.at(p)
        upper = state.grows & state.oscillates & (state.roots.imag > 0)
        return counted(upper, state.grows & ~state.oscillates, state.rates * self.rate)

    def bounds(self, p: float) -> tuple[int, int]:
        """At least and at most how many roots (two for a pair) grow at p, rounding considered."""
        state = self.at(p)
        z, noise = state.roots, state.noise
        if self.damped:
            return int(np.sum(z.real > noise)), int(np.sum(z.real > -noise))
        # of s, one of -lambda^2: each complex one and each negative one gives a growing root
        near = state.close.sum(axis=1) > 1
        return int(np.sum(state.grows)), int(np.sum(state.grows | near | (z.real < noise)))

    def omega(self, z: complex) -> float:
        """Angular frequency (rad/s) of a root."""
        if self.damped:
            return abs(z.imag) * self.rate
        return float(abs(np.sqrt(-complex(z)).imag))


@dataclass(frozen=True, eq=False)
class _Terms:
    """A system of terms with constant M in mass-normalised coordinates, each term once."""

    system: TermSystem
    stiffness: list[Array]
    damping: list[Array]
    rounding: float

    @staticmethod
    def of(system: System) -> _Terms | None:
        if not isinstance(system, TermSystem) or not all(t.constant for t in system.M):
            return None
        system = system.simplified()
        terms = [t.matrix for t in (*system.C, *system.K)]
        if any(np.iscomplexobj(X) for X in terms):
            return None
        left, right, rounding = _normalising(dense(system.M[0].matrix))
        C, K = (
            [np.asarray(left @ dense(t.matrix) @ right) for t in part]
            for part in (system.C, system.K)
        )
        return _Terms(system, K, C, rounding)

    def at(self, p: float) -> tuple[tuple[Array, Array], tuple[Array, Array], float]:
        name = self.system.parameter
        values = self.system.values({name: p})
        sums, slopes = [], []
        for matrices, terms in ((self.stiffness, self.system.K), (self.damping, self.system.C)):
            zero = np.zeros_like(self.stiffness[0])
            factors = [t.factor.value_and_slopes(values) for t in terms]
            sums.append(sum((f * X for X, (f, _) in zip(matrices, factors, strict=True)), zero))
            slopes.append(
                sum((d.get(name, 0.0) * X for X, (_, d) in zip(matrices, factors)), zero)  # noqa: B905
            )
        return (sums[0], sums[1]), (slopes[0], slopes[1]), self.rounding


def _normalising(M: Array) -> tuple[Any, Any, float]:
    """L, R with L M R = 1 (L = R' if M is symmetric, positive definite) and rounding errors."""
    try:
        reduced = reduce(M, None, np.zeros_like(M))
    except LightMassError:
        raise
    except InputError:
        condition = float(np.linalg.cond(M))
        if not ILL * np.linalg.cond(unit_diagonal(M)) < 1.0:
            raise MatrixError(
                "M: a regular matrix is required to search for all thresholds; where rows have no "
                "mass a band is (--band)"
            ) from None
        return np.linalg.inv(M), np.eye(len(M)), EPS * condition
    return reduced.T.T, reduced.T, reduced.rounding


def _full(X: Any) -> Array | None:
    return None if X is None else dense(X)


def _vectors(A: Array) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Roots, unit right and unit left vectors."""
    if np.array_equal(A, A.T):
        values, vectors = np.linalg.eigh(A)
        return values.astype(complex), vectors.astype(complex), vectors.astype(complex)
    values, right = (x.astype(complex) for x in np.linalg.eig(A))
    with np.errstate(all="ignore"):
        try:
            left = inverse(right)[0].conj().T
            fine = bool(np.linalg.norm(left, 1) * np.linalg.norm(right, 1) < 1 / INDEPENDENT**2)
        except np.linalg.LinAlgError:
            fine = False
    if not fine:
        from scipy.linalg import eig

        values, left, right = (x.astype(complex) for x in eig(A, left=True))
    return values, right, left / np.linalg.norm(left, axis=0)
