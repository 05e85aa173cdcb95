"""Reference solutions in 34-digit arithmetic, and random systems that look like pads."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

DIGITS = 34


def exact_squares(M: np.ndarray, K: np.ndarray) -> list:
    """Roots s = -lambda^2 of an undamped system with diagonal M."""
    with mp.workdps(DIGITS):
        A = mp.inverse(mp.matrix(M.tolist())) * mp.matrix(K.tolist())
        return list(mp.eig(A, left=False, right=False))


def exact_damped(M: np.ndarray, C: np.ndarray, K: np.ndarray) -> list:
    """All eigenvalues lambda of a damped system."""
    n = len(M)
    with mp.workdps(DIGITS):
        inverse = mp.inverse(mp.matrix(M.tolist()))
        F = mp.zeros(2 * n)
        F[:n, n:] = mp.eye(n)
        F[n:, :n] = -inverse * mp.matrix(K.tolist())
        F[n:, n:] = -inverse * mp.matrix(C.tolist())
        return list(mp.eig(F, left=False, right=False))


def exact_verdict(squares: list) -> str:
    """Verdict on an undamped system from its exact roots."""
    with mp.workdps(DIGITS):
        radius = max(abs(s) for s in squares)
        growth = []
        for s in squares:
            oscillates = abs(s.imag) > radius * 1e-25
            if oscillates or s.real < -radius * 1e-25:
                name = "flutter" if oscillates else "divergence"
                growth.append((float(abs(((-s) ** 0.5).real)), name))
        return max(growth)[1] if growth else "marginal"


def random_pad(rng: np.random.Generator) -> tuple[np.ndarray, None, np.ndarray]:
    """Mass in kg beside an inertia in kg m^2, stiff springs, a non-symmetric friction term."""
    m = rng.uniform(0.3, 3)
    inertia = 10 ** rng.uniform(-5, -2)
    length = np.sqrt(inertia / m)
    springs = rng.normal(size=(3, 4))
    friction = rng.uniform(0, 1.5) * np.outer(rng.normal(size=3), rng.normal(size=3))
    unit = np.diag([1.0, 1.0, length])
    return np.diag([m, m, inertia]), None, 1e6 * unit @ (springs @ springs.T + friction) @ unit


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20240229)
