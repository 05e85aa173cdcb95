"""State spaces of pads: poles are eigenvalues, static gain is compliance, friction is a gain."""

import control
import numpy as np
import pytest

from squeal.analysis.pads import analyse, held_system
from squeal.analysis.state_space import friction_plant, state_space
from squeal.errors import ComputationError, InputError, InputWarning
from squeal.io.scene import Damping, Scene
from squeal.linear import complex_eigenvalues
from squeal.model.pad import Pad
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


@pytest.mark.parametrize(("stem", "rank"), [("b1-a", 2), ("b1-b", None), ("b2-a", 1), ("b2-c", 1)])
def test_friction_closes_the_plant_with_two_inputs(stem, rank):
    scene = scene_of(stem)
    plant, analysis = friction_plant(scene), analyse(scene)
    closed = control.feedback(plant, scene.pad.mu * np.eye(2))
    assert apart(closed.poles(), analysis.spectrum.values) < 1e-7
    system = held_system(scene, analysis)
    for mu in (0.0, 0.2, 1.5):
        exact = complex_eigenvalues(*system(mu)).values
        # at a coalescence both are known to the square root of rounding
        assert apart(control.feedback(plant, mu * np.eye(2)).poles(), exact) < 1e-6
    # of a tilted pad the edges are at two heights; of the line contact there is one arm
    rows = plant.C[:, :3]
    size = np.linalg.svd(rows / np.abs(rows).max(axis=0, initial=1e-300), compute_uv=False)
    assert rank in (None, np.sum(size > 1e-6 * size[0]))


def test_the_output_is_the_normal_reaction():
    # of the first edge contact: a pad that is lifted by y presses (k3 + k4) y less
    scene = scene_of("b1-a")
    stiffness = scene.pad.k3 + scene.pad.k4
    assert friction_plant(scene).C[0, 1] == pytest.approx(-stiffness, rel=1e-12)


PAD = {
    "m": 0.2, "w": 0.04, "h": 0.014, "k1": 2.0e7, "k2": 2.6e7, "k3": 8.7e6, "k4": 8.7e6,
    "L1": 0.8, "L2": 0.8, "alpha1": np.pi / 2, "alpha2": np.pi, "F_n": 4500.0,
}  # fmt: skip


@pytest.mark.parametrize("plant", [state_space, friction_plant])
def test_refusals_and_warnings(plant, recwarn):
    scene = Scene("B1", Pad(**PAD, mu=0.4))
    plant(scene)
    assert not recwarn
    plant(scene, 4.8)
    assert [str(each.message) for each in recwarn] == list(analyse(scene.replace(mu=4.8)).warnings)
    assert {(each.category, each.filename) for each in recwarn} == {(InputWarning, __file__)}
    with pytest.raises(InputError, match=r"mu: -1\.0 is not allowed"):
        plant(scene, -1.0)
    with pytest.raises(ComputationError, match="no steady sliding"):
        plant(scene.replace(k1=0.0, k2=0.0))


def test_friction_that_falls_with_speed_is_no_plain_gain():
    falling = Scene("B1", Pad(**PAD, mu_s=0.5, mu_k=0.3, v_ref=1.0, V=2.0))
    with pytest.raises(ComputationError, match="no plain gain"):
        friction_plant(falling)
