"""Systems whose roots are known by construction: integer matrices of determinant one hide blocks.

P(s) = L B(s) R with unimodular integers L and R has the roots of B(s), which is triangular with
quadratics of short dyadic numbers on its diagonal. Products are formed with Python's integers, so
that the doubles are these matrices and no others.
"""

import math
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

UNIT = 2**20  # of the dyadic numbers in blocks


@dataclass
class Known:
    """A system, and (c, k) of the quadratics s^2 + c s + k whose roots are its roots."""

    family: str
    M: np.ndarray
    C: np.ndarray | None
    K: np.ndarray
    quadratics: list[tuple[Fraction, Fraction]]

    @property
    def roots(self) -> np.ndarray:
        """All roots, from the formula, to a few roundings."""
        found = []
        for c, k in self.quadratics:
            found += quadratic_roots(c, k)
        return np.array(found)

    @property
    def growing(self) -> int:
        """How many roots grow, from signs alone."""
        number = 0
        for c, k in self.quadratics:
            if k < 0:
                number += 1  # one of two real roots
            elif c < 0:
                number += 2 if k > 0 else 1
        return number

    @property
    def verdict(self) -> str:
        """The kind of the root of largest real part, or whether one lies on the axis."""
        growth = [(z.real, z.imag != 0.0) for z in self.roots if z.real > 0.0]
        if growth:
            return "flutter" if max(growth)[1] else "divergence"
        on_axis = any(k == 0 or (c == 0 and k > 0) for c, k in self.quadratics)
        return "marginal" if on_axis else "stable"


def quadratic_roots(c: Fraction, k: Fraction) -> list[complex]:
    """Both roots of s^2 + c s + k, each part to a few roundings."""
    square = c * c / 4 - k
    half = float(-c / 2)
    if square < 0:
        height = math.sqrt(-square)
        return [complex(half, height), complex(half, -height)]
    far = half + math.copysign(math.sqrt(square), half)
    if far == 0.0:
        return [0j, 0j]
    return [complex(far), complex(float(k) / far)]


def unimodular(n: int, rng: np.random.Generator, steps: int) -> list[list[int]]:
    """A random integer matrix of determinant one, from row operations."""
    X = [[int(i == j) for j in range(n)] for i in range(n)]
    for _ in range(steps if n > 1 else 0):
        i, j = rng.choice(n, 2, replace=False)
        factor = int(rng.choice([-1, 1]))
        X[i] = [a + factor * b for a, b in zip(X[i], X[j], strict=True)]
    order = rng.permutation(n)
    return [X[i] for i in order]


def product(*factors: list[list[int]]) -> list[list[int]]:
    """The product of integer matrices."""
    result = factors[0]
    for X in factors[1:]:
        columns = list(zip(*X, strict=True))
        result = [
            [sum(a * b for a, b in zip(row, column, strict=True)) for column in columns]
            for row in result
        ]
    return result


def doubles(X: list[list[int]]) -> np.ndarray:
    """Integers over `UNIT` as doubles. Raises ValueError where one does not fit."""
    values = np.array([[v / UNIT for v in row] for row in X])
    if not all(
        Fraction(values[i, j]) * UNIT == v for i, row in enumerate(X) for j, v in enumerate(row)
    ):
        raise ValueError("an entry has too many digits")
    return values


def hidden(
    family: str,
    rng: np.random.Generator,
    stiffness: list[int],
    damping: list[int] | None,
    coupling: list[tuple[int, int, int]],
    steps: int,
) -> Known:
    """The system of quadratics s^2 + c s + k, c and k over `UNIT`, with entries above the
    diagonal of K, mixed by row and column operations."""
    n = len(stiffness)
    L = unimodular(n, rng, steps)
    R = unimodular(n, rng, steps)
    K = [[stiffness[i] if i == j else 0 for j in range(n)] for i in range(n)]
    for i, j, v in coupling:
        K[i][j] += v
    c = damping or [0] * n
    C = [[c[i] if i == j else 0 for j in range(n)] for i in range(n)]
    one = [[UNIT if i == j else 0 for j in range(n)] for i in range(n)]
    quadratics = [(Fraction(a, UNIT), Fraction(b, UNIT)) for a, b in zip(c, stiffness, strict=True)]
    M, damped, K = (doubles(product(L, X, R)) for X in (one, C, K))
    return Known(family, M, damped if damping else None, K, quadratics)


def sample(family: str, n: int, damped: bool, rng: np.random.Generator) -> Known:
    """A random system of a family, n rows."""
    stiffness = [int(v) for v in rng.integers(UNIT // 2, 8 * UNIT, n)]
    coupling = []
    steps = 2 * n
    if family == "twins":
        for i in range(1, n, 2):
            stiffness[i] = stiffness[i - 1] + int(rng.choice([0, 1, 2, 40, 3000]))
    elif family == "jordan":
        for i in range(1, n):
            if rng.random() < 0.7:
                stiffness[i] = stiffness[i - 1]
                coupling.append((i - 1, i, int(rng.choice([1, 300, UNIT]))))
    elif family == "triangle":
        coupling = [(i, j, int(rng.integers(-UNIT, UNIT))) for j in range(n) for i in range(j)]
        stiffness = [UNIT + int(v) for v in rng.integers(0, UNIT // 50, n)]
        steps = 0  # shuffled only
    elif family == "bidiagonal":
        coupling = [(i, i + 1, 4 * UNIT) for i in range(n - 1)]
        steps = 0
    elif family == "decades":
        stiffness = [int(UNIT * 10 ** rng.uniform(-3, 2)) for _ in range(n)]
        steps = n
    elif family == "free":
        for i in range(min(n, int(rng.integers(1, 4)))):
            stiffness[i] = 0
    elif family == "divergent":
        for i in range(min(n, int(rng.integers(1, 3)))):
            stiffness[i] *= -1
    elif family != "plain":
        raise ValueError(family)
    damping = None
    if damped:
        damping = [int(v) for v in rng.integers(1, UNIT // 8, n)]
        for i in range(n):
            if rng.random() < 0.1:
                damping[i] *= -1
            elif rng.random() < 0.1:
                damping[i] = 0
        if family == "jordan":
            damping = [damping[0]] * n
    return hidden(family, rng, stiffness, damping, coupling, steps)


FAMILIES = (
    "plain", "twins", "jordan", "triangle", "bidiagonal", "decades", "free", "divergent"
)  # fmt: skip
