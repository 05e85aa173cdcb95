"""Mode shapes against closed forms."""

import math

import numpy as np
import pytest

from squeal.linear import complex_eigenvalues
from squeal.queries.pads.equilibrium import analyse
from squeal.results.eigenvalues import mode_shapes
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


def test_shapes_of_mode_coupling_are_those_of_the_closed_form():
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
    lever = np.array([1.0, 1.0, scene.pad.w])
    m = analysis.matrices
    shapes = mode_shapes(analysis.spectrum, lever)
    assert len(shapes) == 3
    for one in shapes:
        s = one.growth_rate + 2j * math.pi * one.frequency_hz
        rest = (s * s * m.M + s * m.C + m.K) @ one.shape
        assert np.abs(rest).max() < 1e-8 * np.abs(m.K @ np.diag(np.abs(one.shape))).max()
        assert np.abs(one.shape * lever).max() == pytest.approx(1.0)
