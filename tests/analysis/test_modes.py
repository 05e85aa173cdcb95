"""Mode shapes and modes followed over friction, against closed forms."""

import math

import numpy as np
import pytest

import squeal
from squeal.analysis.pads import analyse, critical_friction, mode_shapes, sweep_modes
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
    analysis, lever = analyse(scene), np.array([1.0, 1.0, scene.pad.w])
    m, shapes = analysis.matrices, mode_shapes(analysis.spectrum, lever)
    assert len(shapes) == 3
    for one in shapes:
        s = one.growth_rate + 2j * math.pi * one.frequency_hz
        rest = (s * s * m.M + s * m.C + m.K) @ one.shape
        assert np.abs(rest).max() < 1e-8 * np.abs(m.K @ np.diag(np.abs(one.shape))).max()
        assert np.abs(one.shape * lever).max() == pytest.approx(1.0)


def test_modes_over_friction_are_those_of_the_branch_and_change_at_thresholds():
    scene = scene_of("b2-c")
    modes, found = sweep_modes(scene, 0.1, 2.0), critical_friction(scene)
    assert (modes.low, modes.high) == (0.1, 2.0)
    assert modes.mus[-1] <= modes.end == found.high < 2.0
    assert modes.mus[0] == 0.1
    inner = [point.mu for point in found.points if point.kind != "fold"]
    assert [high for _, high, _ in modes.spans[:-1]] == pytest.approx(inner, rel=1e-12)
    assert {span[2] for span in modes.spans[1::2]} <= {"flutter", "divergence"}
    pick = squeal.sweep(scene, modes.mus[::40].tolist()).steps
    for step, row in zip(pick, modes.values[::40], strict=True):
        apart = np.abs(row[:, None] - step.roots).min(axis=0)
        assert apart.max() < 1e-6 * np.abs(step.roots).max()
    ((mu, state),) = modes.contacts
    assert state == "PC"
    assert 0.1 < mu < modes.end
    with pytest.raises(ComputationError, match=r"no equilibrium at mu = 1\.9"):
        sweep_modes(scene, 1.9, 2.0)
