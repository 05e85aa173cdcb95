"""Two pairs of modes that friction couples, one shim between them, and their roots by NumPy."""

import math

import numpy as np

import squeal

SKEW = np.array([[0.0, 1.0], [-1.0, 0.0]])
TWO_PI = 2.0 * np.pi
HERTZ = (2000.0, 1825.0, 3795.0, 4100.0)
STIFFNESS = np.diag([(TWO_PI * f) ** 2 for f in HERTZ])
DAMPING = np.diag([0.002 * TWO_PI * f for f in HERTZ])
FRICTION = np.zeros((4, 4))
FRICTION[:2, :2] = -1.0532841816842562e7 * SKEW
FRICTION[2:, 2:] = -2.5266187266788755e7 * SKEW
SHIM = np.diag([0.0, 3.2858676540458784e7, 6.316546816697189e7, 0.0])


def roots_of(M, C, K):
    """All eigenvalues by NumPy, of the companion matrix."""
    n = len(M)
    lower = np.hstack([-np.linalg.solve(M, K), -np.linalg.solve(M, C)])
    return np.linalg.eigvals(np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), lower]))


def stiffness(shim, mu):
    return STIFFNESS + shim * SHIM + mu * FRICTION


def growth(shim, mu, C=DAMPING):
    """The largest growth rate of the two pairs of modes."""
    return roots_of(np.eye(4), C, stiffness(shim, mu)).real.max()


def first_loss(shim, high=2.0):
    """The friction from which on something grows, bisected, and the frequency that does, Hz."""
    values = np.linspace(0.0, high, 401)
    k = next(k for k, mu in enumerate(values) if growth(shim, mu) > 0.0)
    low, high = values[k - 1], values[k]
    for _ in range(40):
        middle = (low + high) / 2
        if growth(shim, middle) > 0.0:
            high = middle
        else:
            low = middle
    roots = roots_of(np.eye(4), DAMPING, stiffness(shim, high))
    return high, abs(roots[roots.real.argmax()].imag) / TWO_PI


def two_pairs(mu, shim=1.0):
    """Two pairs of modes that friction couples; the shim parts the first and joins the second."""
    K = {"1": STIFFNESS, "shim": SHIM, "mu": FRICTION}
    parameters = {"mu": mu, "shim": shim}
    return squeal.System(np.eye(4), DAMPING, K, parameters, name="two pairs")


def a_digit_less(change):
    """The change without one in its second digit."""
    digit = 10.0 ** (math.floor(math.log10(abs(change.count))) - 1)
    return change.of(change.count - math.copysign(digit, change.count))
