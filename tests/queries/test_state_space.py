"""State spaces of pads: poles are eigenvalues, the static gain is the compliance."""

import control
import numpy as np
import pytest

import squeal
from squeal.errors import ComputationError, InputError, InputWarning
from squeal.io.scene import Damping
from squeal.queries.pads.equilibrium import analyse
from squeal.queries.state_space import state_space
from tests.conftest import scene_of


def apart(one, other):
    """The largest distance of two sets of poles, relative to the largest of them."""
    distance = np.abs(np.asarray(one)[:, None] - np.asarray(other)[None, :])
    ends = max(distance.min(axis=0).max(), distance.min(axis=1).max())
    return ends / np.abs(other).max()


@pytest.mark.parametrize("stem", ["b1-a", "b2-c", "b3"])
@pytest.mark.parametrize("mu", [None, 0.1])
def test_poles_and_compliance(stem, mu):
    scene = scene_of(stem, damping=Damping(ratios=(0.01, 0.02, 0.03)))
    plant = state_space(scene, mu)
    analysis = analyse(scene if mu is None else scene.replace(mu=mu))
    assert apart(plant.poles(), analysis.spectrum.values) < 1e-9
    assert np.allclose(plant.dcgain() @ analysis.matrices.K, np.eye(3), atol=1e-9)


def test_refusals_and_warnings(recwarn):
    scene = scene_of("b2-c")
    with pytest.raises(InputError, match=r"mu: -1\.0 is not allowed"):
        state_space(scene, -1.0)
    with pytest.raises(ComputationError, match="no steady sliding"):
        state_space(scene.replace(k1=0.0, k2=0.0))
    assert not recwarn
    beyond = scene.replace(mu=1.69)
    state_space(beyond)
    assert [str(each.message) for each in recwarn] == list(analyse(beyond).warnings)
    assert {each.category for each in recwarn} <= {InputWarning}


def test_a_state_space_becomes_a_system_with_its_poles():
    """Butterworth's third order: poles on the unit circle at 120, 180 and 240 degrees."""
    plant = control.tf2ss([1.0], [1.0, 2.0, 2.0, 1.0])
    exact = np.exp(1j * np.pi * np.array([2, 3, 4]) / 3)
    assert apart(squeal.eigenvalues(squeal.System.from_control(plant)).values, exact) < 1e-12
    discrete = control.ss([[0.5]], [[1.0]], [[1.0]], [[0.0]], 0.1)
    with pytest.raises(InputError, match="discrete in time"):
        squeal.System.from_control(discrete)


def test_a_system_becomes_a_state_space_with_its_roots():
    """One mass of 2 kg, 3 N s/m and mu 5 N/m: s^2 + 1.5 s + 2.5 mu."""
    system = squeal.System([[2.0]], [[3.0]], {"mu": [[5.0]]}, {"mu": 2.0})
    assert apart(state_space(system).poles(), np.roots([1.0, 1.5, 5.0])) < 1e-14
    plant = state_space(system, 4.0)
    assert apart(plant.poles(), np.roots([1.0, 1.5, 10.0])) < 1e-14
    assert plant.dcgain() == pytest.approx(1 / 20)
    with pytest.raises(InputError, match="M is singular"):
        state_space(squeal.System(np.diag([1.0, 0.0]), np.eye(2), np.eye(2)))
    with pytest.raises(InputError, match="complex"):
        state_space(squeal.System([[1.0]], K=[[1.0 + 0.1j]]))
