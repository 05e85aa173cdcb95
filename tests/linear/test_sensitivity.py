"""Sensitivities against differences of eigenvalues in 34-digit arithmetic and closed forms."""

import mpmath as mp
import numpy as np
import pytest

from squeal.linear import complex_eigenvalues, sensitivities
from tests.linear.conftest import exact_damped, exact_squares, random_pad


def _nearest(value, candidates):
    return min(candidates, key=lambda c: abs(c - mp.mpc(complex(value))))


def test_undamped_pads(rng):
    step = 1e-8
    for _ in range(30):
        M, C, K = random_pad(rng)
        dK = K * rng.normal(size=(3, 3))
        spectrum = complex_eigenvalues(M, C, K)
        if max(e.condition for e in spectrum.eigenvalues) > 100:
            continue
        found = sensitivities(M, C, K, dK=dK, spectrum=spectrum)
        with mp.workdps(34):
            moved = [
                [sign * mp.sqrt(-s) for s in exact_squares(M, K + e * dK) for sign in (1, -1)]
                for e in (step, -step)
            ]
        scale = np.abs(found).max()
        for value, derivative in zip(spectrum.values, found, strict=True):
            up, down = (_nearest(value, m) for m in moved)
            assert complex((up - down) / (2 * step)) == pytest.approx(derivative, abs=1e-5 * scale)


def test_all_three_matrices_of_a_damped_system(rng):
    M, C, K = np.diag([1.0, 2.0]), 0.1 * rng.normal(size=(2, 2)), rng.normal(size=(2, 2)) + 5
    dM, dC, dK = np.diag([0.3, -0.2]), rng.normal(size=(2, 2)), rng.normal(size=(2, 2))
    found = sensitivities(M, C, K, dM=dM, dC=dC, dK=dK)
    step = 1e-7
    moved = [exact_damped(M + e * dM, C + e * dC, K + e * dK) for e in (step, -step)]
    for value, derivative in zip(complex_eigenvalues(M, C, K).values, found, strict=True):
        up, down = (_nearest(value, m) for m in moved)
        assert complex((up - down) / (2 * step)) == pytest.approx(derivative, rel=1e-6)


def test_oscillator():
    # lambda = i sqrt(k/m): d lambda/dk = lambda/(2k), d lambda/dm = -lambda/(2m); dc gives -1/(2m)
    m, k = 2.0, 50.0
    args = ([[m]], None, [[k]])
    assert sensitivities(*args, dK=[[1]]) == pytest.approx([5j / (2 * k), -5j / (2 * k)])
    assert sensitivities(*args, dM=[[1]]) == pytest.approx([-5j / (2 * m), 5j / (2 * m)])
    assert sensitivities(*args, dC=[[1]]) == pytest.approx([-1 / (2 * m), -1 / (2 * m)])


def test_square_root_behaviour_is_infinite(mode_coupling):
    free = ([[1.0]], None, [[0.0]])
    assert np.all(np.isinf(sensitivities(*free, dK=[[1.0]])))
    assert sensitivities(*free, dK=[[0.0]]).tolist() == [0, 0]
    M, C, K = mode_coupling(0.75)
    assert np.all(np.abs(sensitivities(M, C, K, dK=[[0, 1], [0, 0]])) > 1e6)
