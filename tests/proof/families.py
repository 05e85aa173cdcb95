"""Systems whose roots are known by construction: integer matrices of determinant one hide blocks.

P(s) = L B(s) R with unimodular integers L and R has the roots of B(s), which is triangular with
quadratics of short dyadic numbers on its diagonal. Products are formed with Python's integers, so
that the doubles are these matrices and no others.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

UNIT = 2**20  # of the dyadic numbers in blocks


@dataclass
class Known:
    """A system with its roots, how many of them grow, and the verdict."""

    family: str
    M: np.ndarray
    C: np.ndarray | None
    K: np.ndarray
    roots: np.ndarray
    growing: int
    on_axis: bool

    @property
    def verdict(self) -> str:
        """The kind of the root of largest real part, or whether one lies on the axis."""
        if self.growing:
            leading = max((z.real, z.imag != 0.0) for z in self.roots.tolist())
            return "flutter" if leading[1] else "divergence"
        return "marginal" if self.on_axis else "stable"


def growing_of(c: Fraction, k: Fraction) -> int:
    """How many roots of s^2 + c s + k grow, from signs alone."""
    if k < 0:
        return 1  # of two real roots
    if c < 0:
        return 2 if k > 0 else 1
    return 0


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


def diagonal(values: list[int]) -> list[list[int]]:
    """The matrix with some values on its diagonal."""
    n = len(values)
    matrix = [[0] * n for _ in range(n)]
    for i, value in enumerate(values):
        matrix[i][i] = value
    return matrix


def random_triangle(n: int, rng: np.random.Generator) -> list[tuple[int, int, int]]:
    """Entries (row, column, value) above the diagonal, column by column."""
    entries = []
    for column in range(n):
        for row in range(column):
            entries.append((row, column, int(rng.integers(-UNIT, UNIT))))
    return entries


def unimodular(n: int, rng: np.random.Generator, steps: int) -> list[list[int]]:
    """A random integer matrix of determinant one, from row operations."""
    X = diagonal([1] * n)
    for _ in range(steps if n > 1 else 0):
        i, j = rng.choice(n, 2, replace=False)
        factor = int(rng.choice([-1, 1]))
        X[i] = [a + factor * b for a, b in zip(X[i], X[j], strict=True)]
    order = rng.permutation(n)
    return [X[i] for i in order]


def scalar_product(a: Sequence[int], b: Sequence[int]) -> int:
    return sum(x * y for x, y in zip(a, b, strict=True))


def product(*factors: list[list[int]]) -> list[list[int]]:
    """The product of integer matrices."""
    result = factors[0]
    for X in factors[1:]:
        columns = list(zip(*X, strict=True))
        result = [[scalar_product(row, column) for column in columns] for row in result]
    return result


def doubles(X: list[list[int]]) -> np.ndarray:
    """Integers over `UNIT` as doubles. Raises ValueError where one does not fit."""
    rows = []
    for row in X:
        for v in row:
            if Fraction(v / UNIT) * UNIT != v:
                raise ValueError("an entry has too many digits")
        rows.append([v / UNIT for v in row])
    return np.array(rows)


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
    stiff = diagonal(stiffness)
    for i, j, v in coupling:
        stiff[i][j] += v
    c = damping or [0] * n
    viscous = diagonal(c)
    one = diagonal([UNIT] * n)
    roots = []
    growing = 0
    on_axis = False
    for i in range(n):
        a = Fraction(c[i], UNIT)
        b = Fraction(stiffness[i], UNIT)
        roots += quadratic_roots(a, b)
        growing += growing_of(a, b)
        on_axis |= b == 0 or (a == 0 and b > 0)
    M = doubles(product(L, one, R))
    damped = doubles(product(L, viscous, R))
    K = doubles(product(L, stiff, R))
    C = damped if damping else None
    return Known(family, M, C, K, np.array(roots), growing, on_axis)


def gyroscopic(n: int, rng: np.random.Generator) -> Known:
    """Shafts with s^2 + k +- i g s in pairs of rows, mixed by a congruence; a shaft is marginal
    for g^2 > -4 k, else both its pairs leave the axis."""
    n += n % 2
    one = diagonal([UNIT] * n)
    spin = diagonal([0] * n)
    stiff = diagonal([0] * n)
    roots: list[complex] = []
    growing = 0
    for i in range(0, n, 2):
        g = int(rng.integers(1, 2 * UNIT))
        k = int(rng.choice([rng.integers(UNIT // 4, 4 * UNIT), -rng.integers(1, UNIT)]))
        stiff[i][i] = k
        stiff[i + 1][i + 1] = k
        spin[i][i + 1] = g
        spin[i + 1][i] = -g
        square = (Fraction(g, UNIT) ** 2 + 4 * Fraction(k, UNIT)) / 4
        half = g / UNIT / 2.0
        if square == 0:
            raise ValueError("two roots meet")
        width = math.sqrt(abs(square))
        for sign in (1.0, -1.0):
            for other in (1.0, -1.0):
                shift = complex(0.0, width) if square > 0 else complex(width)
                roots.append(complex(0.0, sign * half) + other * shift)
        growing += 2 if square < 0 else 0
    L = unimodular(n, rng, n)
    R = [list(column) for column in zip(*L, strict=True)]
    M = doubles(product(L, one, R))
    C = doubles(product(L, spin, R))
    K = doubles(product(L, stiff, R))
    return Known("gyroscopic", M, C, K, np.array(roots), growing, True)


def cascade(n: int, rng: np.random.Generator) -> Known:
    """Friction contacts in pairs of rows, each of which acts on the next ones alone.

    A pair has the squares a +- i b of s^2 + c s and grows for b^2 > c^2 a; b is 0.9 or 1.1 of that
    limit, or less.
    """
    n += n % 2
    c = int(UNIT * 10 ** rng.uniform(-4, -1))
    stiff = [[0] * n for _ in range(n)]
    roots: list[complex] = []
    growing = 0
    for i in range(0, n, 2):
        k, h = rng.integers(UNIT - UNIT // 100, UNIT + UNIT // 100, 2).tolist()
        limit = c / UNIT * math.sqrt((k + h) / UNIT / 2)
        share = 1.1 if rng.random() < 0.6 / n else rng.choice([0.9, rng.uniform(0.0, 0.9)])
        m = max(int(UNIT * math.hypot((k - h) / UNIT / 2, share * limit)), 1)
        stiff[i][i : i + 2] = [k, m]
        stiff[i + 1][i : i + 2] = [-m, h]
        for j in range(i):
            stiff[j][i : i + 2] = [int(v) for v in rng.integers(-UNIT, UNIT, 2)]
        a = Fraction(k + h, 2 * UNIT)
        square = Fraction(m, UNIT) ** 2 - Fraction(k - h, 2 * UNIT) ** 2  # of b
        if square <= 0:
            raise ValueError("two roots meet")
        growing += 2 if square > Fraction(c, UNIT) ** 2 * a else 0
        width = math.sqrt(square)
        for sign in (1.0, -1.0):
            far = np.sqrt(complex(float(Fraction(c, UNIT) ** 2 / 4 - a), sign * width))
            roots += [complex(-c / UNIT / 2.0) + far, complex(-c / UNIT / 2.0) - far]
    one = diagonal([UNIT] * n)
    damping = diagonal([c] * n)
    order = rng.permutation(n)
    M = doubles(one)[np.ix_(order, order)]
    C = doubles(damping)[np.ix_(order, order)]
    K = doubles(stiff)[np.ix_(order, order)]
    return Known("cascade", M, C, K, np.array(roots), growing, False)


def sample(family: str, n: int, damped: bool, rng: np.random.Generator) -> Known:
    """A random system of a family, n rows."""
    if family == "gyroscopic":
        return gyroscopic(n, rng)
    if family == "cascade":
        return cascade(n, rng)
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
        coupling = random_triangle(n, rng)
        stiffness = [UNIT + int(v) for v in rng.integers(0, UNIT // 50, n)]
        steps = 0  # shuffled only
    elif family == "bidiagonal":
        coupling = [(i, i + 1, 4 * UNIT) for i in range(n - 1)]
        steps = 0
    elif family == "decades":
        stiffness = [int(UNIT * 10 ** rng.uniform(-3, 2)) for _ in range(n)]
        steps = n
    elif family == "modal":
        stiffness = [int(UNIT * 10 ** rng.uniform(-5, 7)) for _ in range(n)]
        coupling = random_triangle(n, rng)
        steps = 0
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
    "plain", "twins", "jordan", "triangle", "bidiagonal", "decades", "free", "divergent",
    "modal", "gyroscopic", "cascade",
)  # fmt: skip
