"""Modes keep their identity through crossing and veering."""

import numpy as np
import pytest

from squeal.linear import complex_eigenvalues, track


def _rotated(s, angle=0.4):
    c, d = np.cos(angle), np.sin(angle)
    R = np.array([[c, -d], [d, c]])
    return R @ np.diag(s) @ R.T


@pytest.mark.parametrize("steps", [4, 11, 40])
def test_crossing_modes_keep_their_shapes(steps):
    modes = track(
        lambda mu: (np.eye(2), None, _rotated([1 + mu, 3 - mu])), np.linspace(0, 2, steps)
    )
    assert modes.values.shape == (steps, 4)
    expected = np.sqrt([1 + modes.mus, 3 - modes.mus]).T
    assert modes.values[:, [0, 2]].imag == pytest.approx(expected, rel=1e-12)
    assert modes.values[:, [1, 3]].imag == pytest.approx(-expected, rel=1e-12)


@pytest.mark.parametrize("steps", [11, 40])
def test_veering_modes_keep_their_branch(steps):
    gap = 0.05

    def system(mu):
        return np.eye(2), None, np.array([[1 + mu, gap], [gap, 3 - mu]])

    modes = track(system, np.linspace(0, 2, steps))
    split = np.hypot(modes.mus - 1, gap)
    expected = np.sqrt([2 - split, 2 + split]).T
    assert modes.values[:, [0, 2]].imag == pytest.approx(expected, rel=1e-12)


def test_flutter_and_back_gives_all_eigenvalues(mode_coupling):
    modes = track(lambda mu: mode_coupling(1.5 * np.sin(mu)), np.linspace(0, np.pi, 25))
    for mu, row in zip(modes.mus, modes.values, strict=True):
        exact = complex_eigenvalues(*mode_coupling(1.5 * np.sin(mu))).values
        assert np.sort_complex(row) == pytest.approx(np.sort_complex(exact))
    jumps = np.abs(np.diff(modes.values, axis=0))
    assert jumps.max() < 0.6  # no column ever changes from one mode to another
    assert modes.frequencies_hz.shape == (25, 4)


def test_free_bodies_and_damped_modes_are_all_listed(rng):
    """Two modes of random damping beside a free motion that nothing acts on."""
    K0, K1 = np.diag([10.0, 30.0]), rng.normal(size=(2, 2))
    T = np.eye(3) + 0.3 * rng.normal(size=(3, 3))

    def system(mu):
        K, C = np.zeros((3, 3)), np.diag([0.1, 0.2, 0.0])
        K[:2, :2] = K0 + mu * K1
        return T.T @ T, T.T @ C @ T, T.T @ K @ T

    modes = track(system, np.linspace(0, 1, 5))
    for mu, row in zip(modes.mus, modes.values, strict=True):
        exact = complex_eigenvalues(*system(mu)).values
        assert np.sort_complex(row.round(7)) == pytest.approx(np.sort_complex(exact), abs=1e-6)


def test_an_empty_sweep_is_refused(mode_coupling):
    with pytest.raises(ValueError, match="at least one"):
        track(mode_coupling, [])
