"""A pad's equilibria, eigenvalues and thresholds at 50 digits, from the literal equations.

What the package found serves as the first guess of Newton's method and for nothing else. Numbers
are mpmath's unless `mp` is replaced here and in `naive`, as `benchmarks.random_pads` does.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import mpmath as mp

from squeal.io.scene import Scene
from squeal.model.contact import State
from tests import naive

SMALL = 1e-24  # a step of Newton's method after which the next is below 1e-45
Cubic = tuple[Any, Any, Any]
Rows = list[list[Any]]


def solve(A: Rows, b: list[Any]) -> list[Any]:
    """x with A x = b, by elimination with pivots."""
    rows = [[*row, value] for row, value in zip(A, b, strict=True)]
    n = len(rows)
    for k in range(n):
        pivot = max(range(k, n), key=lambda i: abs(rows[i][k]))
        rows[k], rows[pivot] = rows[pivot], rows[k]
        for i in range(k + 1, n):
            share = rows[i][k] / rows[k][k]
            rows[i] = [v - share * above for v, above in zip(rows[i], rows[k], strict=True)]
    x: list[Any] = []
    for k in reversed(range(n)):
        x.insert(0, (rows[k][n] - _dot(rows[k][k + 1 : n], x)) / rows[k][k])
    return x


def _dot(a: list[Any], b: list[Any]) -> Any:
    return sum(v * w for v, w in zip(a, b, strict=True))


def det(A: Rows) -> Any:
    """Determinant of three rows."""
    (a, b, c), (d, e, f), (g, h, i) = A
    return a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)


def discriminant(cubic: Cubic) -> Any:
    """Discriminant of s^3 - a s^2 + b s - c."""
    a, b, c = cubic
    return a * a * b * b - 4 * b**3 - 4 * a**3 * c + 18 * a * b * c - 27 * c * c


def roots(cubic: Cubic) -> list[Any]:
    """The three roots s of s^3 - a s^2 + b s - c, as complex numbers."""
    a, b, c = cubic

    def value(s: Any) -> Any:
        return ((s - a) * s + b) * s - c

    # from beyond all roots on the side of the inflection's real root Newton's steps only go inwards
    inwards = 1 if value(a / 3) > 0 else -1
    low = -inwards * 2 * max(abs(a), mp.sqrt(abs(b)), mp.cbrt(abs(c)))
    while (step := -value(low) / ((3 * low - 2 * a) * low + b)) * inwards > abs(low) * SMALL**2:
        low += step
    rest = a - low
    product = c / low if abs(low) > abs(rest) else b - low * rest
    middle = rest / 2
    square = middle * middle - product
    if square < 0:
        height = mp.sqrt(-square)
        pair = [mp.mpc(middle, height), mp.mpc(middle, -height)]
    else:
        large = middle + mp.sqrt(square) * (1 if middle > 0 else -1)
        pair = [mp.mpc(large), mp.mpc(product / large if large else 0)]
    return [mp.mpc(low), *pair]


@dataclass(frozen=True)
class Exact:
    """The literal equations of a scene's pad in one contact state; mu is free."""

    scene: Scene
    state: State

    def _given(self, q: Any, mu: Any) -> tuple[Any, ...]:
        pad = self.scene.pad.replace(mu=mp.mpf(mu))
        return self.scene.model, pad, self.scene.formulation, list(q), self.state

    def loads(self, q: Any, mu: Any) -> list[Any]:
        """Loads (Fx, Fy, M)."""
        return naive.loads(*self._given(q, mu))

    def stiffness(self, q: Any, mu: Any) -> Rows:
        """K, minus the derivative of the loads."""
        rows = naive.jacobian(*self._given(q, mu))
        return [[-row[0], -row[1], -row[2]] for row in rows]

    def gaps(self, q: Any) -> tuple[Any, Any]:
        """Heights of the leading and the trailing edge over where they touch."""
        pad = self.scene.pad
        *_, leading, trailing, _ = naive.points(pad, q)
        low = -pad.h, -pad.h
        if self.scene.model == "B1":
            *_, rest_l, rest_t, _ = naive.points(pad, (0, 0, 0))
            low = rest_l[1], rest_t[1]
        return leading[1] - low[0], trailing[1] - low[1]

    def equilibrium(self, guess: Any, mu: Any) -> list[Any]:
        """The equilibrium near `guess`."""
        q = [mp.mpf(v) for v in guess]
        for _ in range(8):
            step = solve(self.stiffness(q, mu), self.loads(q, mu))
            q = [v + s for v, s in zip(q, step, strict=True)]
            if max(map(abs, step)) <= SMALL * max(map(abs, q)):
                return q
        raise ArithmeticError(f"no exact equilibrium near {guess} at mu = {mu}")

    def cubic(self, q: Any, mu: Any) -> Cubic:
        """Coefficients a, b, c of the polynomial in s = -lambda^2."""
        pad = self.scene.pad
        masses = (pad.m, pad.m, pad.I)
        A = []
        for row, mass in zip(self.stiffness(q, mu), masses, strict=True):
            A.append([value / mass for value in row])

        def minor(i: int, j: int) -> Any:
            return A[i][i] * A[j][j] - A[i][j] * A[j][i]

        return A[0][0] + A[1][1] + A[2][2], minor(0, 1) + minor(0, 2) + minor(1, 2), det(A)

    def squares(self, q: Any, mu: Any) -> list[Any]:
        """The three roots s."""
        return roots(self.cubic(q, mu))

    def critical(
        self, condition: Callable[[Any, Any], Any], guess: Any, mu: Any
    ) -> tuple[list[Any], Any]:
        """Equilibrium and mu at which condition(q, mu) vanishes."""
        z = [mp.mpf(v) for v in (*guess, mu)]
        unit = mp.mpf(10) ** -22
        for _ in range(12):
            *q, at = z
            here = condition(q, at)
            f = self.loads(q, at)
            slopes = []
            for i in range(4):
                ahead = list(z)
                ahead[i] += unit
                slopes.append((condition(ahead[:3], ahead[3]) - here) / unit)
            ahead_in_mu = self.loads(q, at + 1)  # linear in mu
            J = []
            for row, load, load_ahead in zip(self.stiffness(q, at), f, ahead_in_mu, strict=True):
                J.append([-row[0], -row[1], -row[2], load_ahead - load])
            step = solve([*J, slopes], [*f, here])
            z = [v - s for v, s in zip(z, step, strict=True)]
            if abs(step[3]) <= SMALL and max(map(abs, step[:3])) <= SMALL * max(map(abs, z)):
                return z[:3], z[3]
        raise ArithmeticError(f"no exact threshold near mu = {mu}")
