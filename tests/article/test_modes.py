"""Modes of pads and systems as curves, each one and the same mode, against closed forms."""

import numpy as np
import pytest
from scipy.linalg import block_diag

import squeal
from squeal.article.studies._modes import sweep_modes, track
from squeal.errors import ComputationError
from squeal.linear import complex_eigenvalues
from squeal.queries.thresholds import critical_friction
from tests.conftest import scene_of
from tests.linear.test_paths import pair


@pytest.mark.parametrize("steps", [4, 11, 40])
def test_crossing_modes_keep_their_shapes(steps):
    R = np.array([[0.8, -0.6], [0.6, 0.8]])

    def system(mu):
        return np.eye(2), None, R @ np.diag([1 + mu, 3 - mu]) @ R.T

    mus = np.linspace(0, 2, steps)
    modes = track(system, mus)
    assert modes.shape == (steps, 4)
    expected = np.sqrt([1 + mus, 3 - mus]).T
    assert modes[:, [0, 2]].imag == pytest.approx(expected, rel=1e-12)
    assert modes[:, [1, 3]].imag == pytest.approx(-expected, rel=1e-12)


@pytest.mark.parametrize("steps", [11, 40])
def test_veering_modes_keep_their_branch(steps):
    gap = 0.05

    def system(mu):
        return np.eye(2), None, np.array([[1 + mu, gap], [gap, 3 - mu]])

    mus = np.linspace(0, 2, steps)
    modes = track(system, mus)
    split = np.hypot(mus - 1, gap)
    expected = np.sqrt([2 - split, 2 + split]).T
    assert modes[:, [0, 2]].imag == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("steps", [4, 11, 40])
def test_the_square_root_that_grows_goes_on_from_the_same_motion(steps):
    """Two modes meet at 1/4 and part again at 3/4, growing between, beside a third."""

    def system(mu):
        drive = 0.25 + (mu - 0.25) * (0.75 - mu)
        return np.eye(3), None, block_diag(pair(5.0, drive), 50.0 + mu)

    mus = np.linspace(0, 1, steps)
    modes = track(system, mus)
    jumps = np.abs(np.diff(modes, axis=0))
    assert jumps.max() < np.abs(modes).max() / 4  # from one root to its opposite is twice
    for mu, row in zip(mus, modes, strict=True):
        exact = complex_eigenvalues(*system(mu)).values
        assert np.sort_complex(row.round(7)) == pytest.approx(np.sort_complex(exact.round(7)))


def test_free_bodies_and_damped_modes_are_all_listed():
    """Two modes of random damping beside a free motion that nothing acts on."""
    rng = np.random.default_rng(1)
    K0 = np.diag([10.0, 30.0])
    K1 = rng.normal(size=(2, 2))
    T = np.eye(3) + 0.3 * rng.normal(size=(3, 3))

    def system(mu):
        return T.T @ T, T.T @ np.diag([0.1, 0.2, 0.0]) @ T, T.T @ block_diag(K0 + mu * K1, 0) @ T

    mus = np.linspace(0, 1, 5)
    modes = track(system, mus)
    for mu, row in zip(mus, modes, strict=True):
        exact = complex_eigenvalues(*system(mu)).values
        assert np.sort_complex(row.round(7)) == pytest.approx(np.sort_complex(exact), abs=1e-6)


def test_modes_over_friction_are_those_of_the_branch():
    scene = scene_of("b2-c")
    modes = sweep_modes(scene, 0.1, 2.0)
    found = critical_friction(scene)
    assert modes.mus[-1] <= found.high < 2.0
    assert modes.mus[0] == 0.1
    pick = squeal.sweep(scene, modes.mus[::40].tolist()).steps
    for step, row in zip(pick, modes.values[::40], strict=True):
        apart = np.abs(row[:, None] - step.roots).min(axis=0)
        assert apart.max() < 1e-6 * np.abs(step.roots).max()
    ((mu, state),) = modes.contacts
    assert state == "PC"
    assert 0.1 < mu < found.high
    with pytest.raises(ComputationError, match=r"no equilibrium at mu = 1\.9"):
        sweep_modes(scene, 1.9, 2.0)
