"""Sensitivities against differences of eigenvalues in 34-digit arithmetic and closed forms."""

import mpmath as mp
import numpy as np
import pytest

from squeal.linear import complex_eigenvalues, sensitivities
from tests.linear.conftest import exact_damped, exact_squares, random_pad


def differences(values, moved, step):
    """Derivatives of values from the exact ones on both sides."""
    up, down = moved

    def nearest(value, candidates):
        return min(candidates, key=lambda c: abs(c - mp.mpc(complex(value))))

    return np.array([complex((nearest(v, up) - nearest(v, down)) / (2 * step)) for v in values])


def test_undamped_pads(rng):
    step = 1e-8
    for _ in range(20):
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
        exact = differences(spectrum.values, moved, step)
        assert found == pytest.approx(exact, abs=1e-5 * np.abs(found).max())


def test_all_three_matrices_of_a_damped_system(rng):
    M, C, K = np.diag([1.0, 2.0]), 0.1 * rng.normal(size=(2, 2)), rng.normal(size=(2, 2)) + 5
    dM, dC, dK = np.diag([0.3, -0.2]), rng.normal(size=(2, 2)), rng.normal(size=(2, 2))
    step = 1e-7
    moved = [exact_damped(M + e * dM, C + e * dC, K + e * dK) for e in (step, -step)]
    exact = differences(complex_eigenvalues(M, C, K).values, moved, step)
    assert sensitivities(M, C, K, dM=dM, dC=dC, dK=dK) == pytest.approx(exact, rel=1e-6)


def test_square_root_behaviour_is_infinite(mode_coupling):
    free = ([[1.0]], None, [[0.0]])
    assert np.all(np.isinf(sensitivities(*free, dK=[[1.0]])))
    assert sensitivities(*free, dK=[[0.0]]).tolist() == [0, 0]
    assert np.all(np.abs(sensitivities(*mode_coupling(0.75), dK=[[0, 1], [0, 0]])) > 1e6)
