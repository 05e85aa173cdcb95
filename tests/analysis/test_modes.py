"""Mode shapes and modes followed over friction, against closed forms."""

import math

import numpy as np
import pytest

from squeal.analysis.pads import (
    analyse,
    critical_friction,
    mode_shapes,
    modes_along,
    shapes_of_pad,
    sweep_modes,
    sweep_mu,
)
from squeal.errors import ComputationError
from squeal.linear import complex_eigenvalues
from tests.conftest import scene_of
from tests.known import coupled


def several(mu):
    """A pair that flutters from 0.25 on, one from 0.5 on, and divergence from 1 on."""
    K = np.zeros((5, 5))
    for i, (middle, start) in enumerate([(4.0, 0.25), (9.0, 0.5)]):
        K[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = [
            [middle - 0.5, start - mu - 0.25],
            [1, middle + 0.5],
        ]
    K[4, 4] = 1.0 - mu
    return np.eye(5), None, K


def test_shapes_of_mode_coupling():
    # without friction the shapes are (1, 1) and (1, -1), of omega = 1 and sqrt 3
    one, two = mode_shapes(complex_eigenvalues(*coupled(0.0)))
    assert np.allclose(one.shape, [1, 1])
    assert np.allclose(np.abs(two.shape), [1, 1])
    assert np.allclose(two.shape.sum(), 0)
    assert (one.number, two.number) == (1, 2)
    assert [2 * math.pi * m.frequency_hz for m in (one, two)] == pytest.approx([1, math.sqrt(3)])
    # beyond the threshold both have one frequency, and second over first part -1 / (lambda^2 + 2)
    for mode in mode_shapes(complex_eigenvalues(*coupled(1.0))):
        s = mode.growth_rate + 2j * math.pi * mode.frequency_hz
        assert mode.shape[1] / mode.shape[0] == pytest.approx(1 / (s * s + 2.0))
        assert np.abs(mode.shape).max() == pytest.approx(1.0)
    # a real pair is one mode
    shapes = mode_shapes(complex_eigenvalues(*several(2.0)))
    assert len(shapes) == 5
    assert shapes[0].growth_rate == pytest.approx(1.0)
    assert np.allclose(shapes[0].shape, [0, 0, 0, 0, 1])


@pytest.mark.parametrize("stem", ["b1-a", "b2-c", "b3"])
def test_shapes_of_pads_solve_the_equations(stem):
    scene = scene_of(stem)
    analysis = analyse(scene)
    m, shapes = analysis.matrices, shapes_of_pad(analysis, scene.pad.w)
    assert len(shapes) == 3
    for one in shapes:
        s = one.growth_rate + 2j * math.pi * one.frequency_hz
        rest = (s * s * m.M + s * m.C + m.K) @ one.shape
        assert np.abs(rest).max() < 1e-8 * np.abs(m.K @ np.diag(np.abs(one.shape))).max()
        assert np.abs(one.shape * [1, 1, scene.pad.w]).max() == pytest.approx(1.0)


def test_a_sweep_changes_its_verdict_at_the_thresholds_and_nowhere_else():
    modes = modes_along(coupled, None, 0.0, 1.0)
    (low, first, before), (second, high, after) = modes.spans
    assert (low, high, before, after) == (0.0, 1.0, "marginal", "flutter")
    assert first == second == pytest.approx(0.75, rel=1e-12)
    squares = -(modes.values**2)
    root = np.sqrt(1 - 4 / 3 * modes.mus + 0j)
    for sign in (1, -1):
        nearest = np.abs(squares - (2 + sign * root)[:, None]).min(axis=1)
        assert nearest.max() < 1e-7


def test_a_scene_s_sweep_is_that_of_its_branch():
    scene = scene_of("b2-c")
    modes = sweep_modes(scene, 0.1, 2.0)
    assert (modes.low, modes.high) == (0.1, 2.0)
    assert modes.end == critical_friction(scene).high < 2.0
    assert modes.mus[0] == 0.1
    assert modes.mus[-1] <= modes.end
    pick = modes.mus[::40].tolist()
    for (_, analysis), row in zip(sweep_mu(scene, pick), modes.values[::40], strict=True):
        exact = analysis.spectrum.values
        assert np.abs(row[:, None] - exact[None, :]).min(axis=0).max() < 1e-6 * np.abs(exact).max()
    ((mu, state),) = modes.contacts
    assert state == "PC"
    assert 0.1 < mu < modes.end
    with pytest.raises(ComputationError, match=r"no equilibrium at mu = 1\.9"):
        sweep_modes(scene, 1.9, 2.0)
