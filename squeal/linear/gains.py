"""Gains at which a closed loop 1 + mu G(s) = 0 starts or ceases to grow, without polynomials.

G(s) = c' (s^2 + s B + A)^-1 b. Let mu(s) = -1/G(s) be the gain that puts a pole at s.

Damped: a pole lies at s = i omega for a real mu where G(i omega) is real, that is at the zeros of
G(s) - G(-s) on the imaginary axis. With u + i omega v the response to b, and x = omega^2,

    (A - x) u - x B v = b,   B u + (A - x) v = 0,   c' v = 0,

the Rosenbrock pencil of that difference, of size 2n + 1 and real.

Undamped: G is a function of x = omega^2 alone and poles leave the axis only where two meet, at
stationary values of mu(x): the zeros of G'(x) = c' (A - x)^-2 b, where

    (A - x) u = b,   (A - x) v = u,   c' v = 0.

The generalised eigenvalues x of either pencil are refined by Newton's method on Im mu(i omega) or
on mu'(x). A real pole passes through zero at mu(0).
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from squeal.linear.matrices import Array, Reduced, noise_of, null_spaces
from squeal.numerics.newton import newton

CLOSE = 1e-2  # of x: how far Newton's method may take a real part of the pencil's eigenvalues
SAME = 1e-9  # of x: zeros closer than this are one


@dataclass(frozen=True)
class LoopThreshold:
    """A gain at which a pole of the closed loop crosses the imaginary axis."""

    mu: float
    direction: str  # up: the pole starts to grow as mu rises; down: it ceases
    kind: str  # flutter or divergence: what starts or ceases
    frequency_hz: float


def loop_thresholds(reduced: Reduced, b: Array, c: Array, mu_max: float) -> list[LoopThreshold]:
    """All thresholds in (0, mu_max] of z'' + B z' + (A + mu b c') z = 0, sorted by mu."""
    scale = float(np.linalg.norm(reduced.A, 2) + mu_max * np.linalg.norm(b) * np.linalg.norm(c))
    if reduced.B is not None:
        scale = max(scale, float(np.linalg.norm(reduced.B, 2)) ** 2)
    if not scale:
        return []
    A = _without_free_modes(reduced, b, c) / scale
    rate = math.sqrt(scale)
    B = None if reduced.B is None else reduced.B / rate
    locus = _Locus(A, B, b / scale, c)
    found = [(mu, grows, 0.0) for mu, grows in locus.at_zero()]
    found += list(locus.on_axis())
    return sorted(
        (
            LoopThreshold(
                mu,
                "up" if grows > 0 else "down",
                "flutter" if omega else "divergence",
                omega * rate / (2 * math.pi),
            )
            for mu, grows, omega in found
            if 0.0 < mu <= mu_max
        ),
        key=lambda point: point.mu,
    )


def _without_free_modes(reduced: Reduced, b: Array, c: Array) -> Array:
    """A with those zero roots moved away which the loop neither drives nor feels."""
    A = reduced.A
    right, left = null_spaces(A, noise_of(A, reduced.rounding))
    if not right.shape[1]:
        return A
    apart = max(np.abs(left.T @ b).max() / np.linalg.norm(b), np.abs(c @ right).max())
    if apart > 1e-10 or np.linalg.cond(left.T @ right) > 1e8:
        return A
    return A + np.linalg.norm(A, 2) * right @ np.linalg.inv(left.T @ right) @ left.T


class _Locus:
    """mu(s) of a loop in units in which all frequencies are at most of order one."""

    def __init__(self, A: Array, B: Array | None, b: Array, c: Array) -> None:
        self.A, self.B, self.b, self.c = A, B, b, c

    def in_x(self, x: float) -> tuple[float, float, float]:
        """mu, mu' and mu'' of an undamped loop by x = omega^2."""
        shifted = self.A - x * np.eye(len(self.A))
        u = np.linalg.solve(shifted, self.b)
        v = np.linalg.solve(shifted, u)
        w = np.linalg.solve(shifted, v)
        G, G1, G2 = float(self.c @ u), float(self.c @ v), 2 * float(self.c @ w)
        return -1 / G, G1 / G**2, (G2 - 2 * G1**2 / G) / G**2

    def in_s(self, s: complex) -> tuple[complex, complex]:
        """mu and mu' of a damped loop by s."""
        assert self.B is not None
        n = len(self.A)
        P = self.A + s * self.B + s * s * np.eye(n)
        u = np.linalg.solve(P, self.b)
        v = np.linalg.solve(P, (self.B + 2 * s * np.eye(n)) @ u)
        G, G1 = complex(self.c @ u), -complex(self.c @ v)
        return -1 / G, G1 / G**2

    def at_zero(self) -> Iterator[tuple[float, float]]:
        """mu at which a real pole passes through zero, and the sign of its growth with mu."""
        try:
            if self.B is None:
                mu, slope, _ = self.in_x(0.0)
                yield mu, -slope  # x = -lambda^2
            else:
                value, by_s = self.in_s(0.0)
                yield value.real, by_s.real
        except np.linalg.LinAlgError:  # a free body: the pole at zero stays
            return

    def on_axis(self) -> Iterator[tuple[float, float, float]]:
        """mu, the sign of the pole's growth and omega where a pair leaves or reaches the axis."""
        found: list[float] = []
        for x in self._zeros():
            refined = _refined(self._imaginary, x)
            if refined is None or any(abs(refined - other) <= SAME * refined for other in found):
                continue
            found.append(refined)
            omega = math.sqrt(refined)
            if self.B is None:
                mu, _, curvature = self.in_x(refined)
                yield mu, -curvature, omega  # two real x below a maximum of mu, none above it
            else:
                value, by_s = self.in_s(1j * omega)
                yield value.real, by_s.real, omega

    def _imaginary(self, x: float) -> tuple[float, float]:
        if self.B is None:
            return self.in_x(x)[1:]
        omega = math.sqrt(x)
        value, by_s = self.in_s(1j * omega)
        return value.imag, by_s.real / (2 * omega)

    def _zeros(self) -> Array:
        """Real parts of the pencil's eigenvalues near the positive real axis."""
        from scipy.linalg import eigvals

        n = len(self.A)
        unit, zero = np.eye(n), np.zeros((n, n))
        force, reaction = self.b / np.linalg.norm(self.b), self.c / np.linalg.norm(self.c)
        left, right = np.zeros((2 * n + 1, 2 * n + 1)), np.zeros((2 * n + 1, 2 * n + 1))
        coupling, inertia = (-unit, zero) if self.B is None else (self.B, self.B)
        left[:-1, :-1] = np.block([[self.A, zero], [coupling, self.A]])
        right[:-1, :-1] = np.block([[unit, inertia], [zero, unit]])
        left[:n, -1], left[-1, n:-1] = -force, reaction
        x = eigvals(left, right)
        x = x[np.isfinite(x)]
        near = (x.real > 1e-14) & (x.real < 4.0) & (np.abs(x.imag) <= CLOSE * np.abs(x))
        return np.sort(x.real[near])


def _refined(f: Callable[[float], tuple[float, float]], start: float) -> float | None:
    """A zero of f (with its derivative) next to a start > 0, None if there is none."""

    def over_start(u: Array) -> tuple[list[float], list[list[float]]]:
        near = abs(u[0] - 1.0) <= CLOSE
        value, slope = f(start * float(u[0])) if near else (math.nan, math.nan)
        return [value], [[start * slope]]

    found = newton(over_start, [1.0], 5e-16, 40, stalled=5e-10)
    near = found.converged and abs(found.x[0] - 1.0) <= CLOSE
    return start * float(found.x[0]) if near else None
