"""Systems of any size with known thresholds, for tests and benchmarks."""

import numpy as np

from squeal.linear.system import TermSystem
from squeal.linear.terms import Term
from squeal.numerics.differentiation import Formula

Threshold = tuple[float, str, str, float]
"""mu, kind, direction, omega."""


def coupled(mu):
    """Mode coupling: omega^2 = 2 +- sqrt(1 - 4 mu / 3), so that it flutters from 3/4 on."""
    return np.eye(2), None, np.array([[2.0, -1.0 + 4 * mu / 3], [-1.0, 2.0]])


def system_of(M, C, K, *numbers) -> TermSystem:
    """M, C and K are each a matrix, or a tuple of matrices and pairs (matrix, factor)."""

    def terms(given):
        given = given if isinstance(given, tuple) else (given,)
        pairs = [part if isinstance(part, tuple) else (part, "1") for part in given]
        return tuple(Term(X, Formula(factor)) for X, factor in pairs if X is not None)

    return TermSystem(terms(M), terms(C), terms(K), *numbers)


def affine(M, K0, K1=None, C0=None, C1=None) -> TermSystem:
    """M, C0 + mu C1 and K0 + mu K1."""
    return system_of(M, (C0, (C1, "mu")), (K0, (K1, "mu")))


def known_system(
    n: int, rng: np.random.Generator, damped: bool
) -> tuple[TermSystem, list[Threshold]]:
    """n degrees of freedom in blocks with closed-form thresholds in 0 < mu < 2, mixed.

    Blocks: an oscillator whose damping changes sign; two modes that coalesce; an oscillator whose
    stiffness passes zero; bystanders. L X R with sparse unit triangular L and R and a permutation
    leaves nothing symmetric or orthogonal. Returns the system and its thresholds (mu, kind,
    direction, omega), sorted.
    """
    C0 = np.zeros((n, n))
    C1 = np.zeros((n, n))
    K0 = np.zeros((n, n))
    K1 = np.zeros((n, n))
    expected: list[Threshold] = []
    i = 0
    while i < n:
        kind = rng.random()
        w = rng.uniform(1, 10)
        at = rng.uniform(0.05, 1.95)
        K0[i, i] = w * w
        if damped and kind < 0.15:
            rate = rng.choice([-1, 1]) * rng.uniform(0.01, 0.5)
            C0[i, i] = rate * at
            C1[i, i] = -rate
            expected.append((at, "flutter", "up" if rate > 0 else "down", w))
        elif kind < 0.25 and i + 1 < n:
            gap = rng.uniform(0.2, 3)
            a = gap / 2 / at
            mean = w * w + gap / 2
            K0[i, i] = w * w + gap
            K0[i + 1, i + 1] = w * w
            K1[i, i + 1] = a
            K1[i + 1, i] = -a
            c = rng.uniform(0.01, 0.2) if damped else 0.0
            C0[i, i] = C0[i + 1, i + 1] = c
            at = np.sqrt(c * c * mean + gap * gap / 4) / a
            if at < 2.0:
                expected.append((at, "flutter", "up", np.sqrt(mean)))
            i += 1
        elif kind < 0.3:
            K1[i, i] = -w * w / at
            C0[i, i] = rng.uniform(0.01, 0.5) * damped
            expected.append((at, "divergence", "up", 0.0))
        else:
            K1[i, i] = rng.uniform(-0.2, 0.2)
            C0[i, i] = rng.uniform(0.005, 0.5) * damped
        i += 1
    sparse = [rng.random((n, n)) < 3 / n for _ in range(2)]
    left = np.eye(n) + np.tril(rng.uniform(-0.5, 0.5, (n, n)) * sparse[0], -1)
    right = np.eye(n) + np.triu(rng.uniform(-0.5, 0.5, (n, n)) * sparse[1], 1)
    order = rng.permutation(n)

    def mixed(X):
        return (left @ X @ right)[order][:, order]

    damping = (mixed(C0), mixed(C1)) if damped else ()
    return affine(mixed(np.eye(n)), mixed(K0), mixed(K1), *damping), sorted(expected)
