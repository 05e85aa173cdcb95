"""State spaces of pads: poles are eigenvalues, static gain is compliance, friction is a gain."""

import control
import numpy as np
import pytest

from squeal.analysis.pads import analyse, held_system
from squeal.analysis.state_space import friction_plant, state_space
from squeal.errors import ComputationError, InputError, InputWarning
from squeal.io.scene import Damping
from squeal.linear import complex_eigenvalues
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


@pytest.mark.parametrize("stem", ["b1-a", "b1-b", "b2-a", "b2-c"])
def test_friction_closes_the_plant_with_two_inputs(stem):
    scene = scene_of(stem)
    plant, analysis = friction_plant(scene), analyse(scene)
    closed = control.feedback(plant, scene.pad.mu * np.eye(2))
    assert apart(closed.poles(), analysis.spectrum.values) < 1e-7
    system = held_system(scene, analysis)
    for mu in (0.0, 0.2, 1.5):
        exact = complex_eigenvalues(*system(mu)).values
        # at a coalescence both are known to the square root of rounding
        assert apart(control.feedback(plant, mu * np.eye(2)).poles(), exact) < 1e-6
    if stem == "b1-a":  # on the first edge: a pad that is lifted by y presses (k3 + k4) y less
        assert plant.C[0, 1] == pytest.approx(-scene.pad.k3 - scene.pad.k4, rel=1e-12)


def test_refusals_and_warnings(recwarn):
    scene = scene_of("b2-c")
    for plant in (state_space, friction_plant):
        with pytest.raises(InputError, match=r"mu: -1\.0 is not allowed"):
            plant(scene, -1.0)
        with pytest.raises(ComputationError, match="no steady sliding"):
            plant(scene.replace(k1=0.0, k2=0.0))
    assert not recwarn
    beyond = scene.replace(mu=1.69)
    state_space(beyond)
    assert [str(each.message) for each in recwarn] == list(analyse(beyond).warnings)
    assert {each.category for each in recwarn} <= {InputWarning}
    falling = scene_of("b1-c", mu=None, mu_s=0.5, mu_k=0.3, v_ref=1.0, V=2.0)
    with pytest.raises(ComputationError, match="no plain gain"):
        friction_plant(falling)
