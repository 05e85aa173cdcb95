"""State spaces of pads: poles are eigenvalues, static gain is compliance, friction is a gain."""

import warnings

import control
import numpy as np
import pytest

from squeal.analysis.eigenvalues import analyse, held_system
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
    found = analyse(scene if mu is None else scene.replace(mu=mu))
    assert apart(plant.poles(), found.spectrum.values) < 1e-9
    assert np.allclose(plant.dcgain() @ found.matrices.K, np.eye(3), atol=1e-9)
    assert plant.input_labels == ["force x", "force y", "moment"]
    assert plant.output_labels == ["x", "y", "theta"]


@pytest.mark.parametrize("plant", [state_space, friction_plant])
def test_a_plant_beyond_the_fold_is_warned_of(plant):
    pad = Pad(
        m=0.2, w=0.04, h=0.014, k1=2.0e7, k2=2.6e7, k3=8.7e6, k4=8.7e6, L1=0.8, L2=0.8,
        alpha1=np.pi / 2, alpha2=np.pi, mu=0.4, F_n=4500.0,
    )  # fmt: skip
    scene = Scene("B1", pad)
    with warnings.catch_warnings(record=True) as given:
        warnings.simplefilter("always")
        plant(scene)
        assert not given
        plant(scene, 4.8)
    expected = analyse(scene.replace(mu=4.8)).warnings
    assert expected[0].startswith("the equilibrium lies beyond a fold")
    assert [str(each.message) for each in given] == list(expected)
    assert {each.category for each in given} == {InputWarning}
    assert {each.filename for each in given} == {__file__}


@pytest.mark.parametrize("stem", ["b1-a", "b1-b", "b2-a", "b2-c"])
def test_friction_closes_the_plant_with_two_inputs(stem):
    scene = scene_of(stem)
    plant, found = friction_plant(scene), analyse(scene)
    assert (plant.ninputs, plant.noutputs) == (2, 2)
    assert (
        apart(control.feedback(plant, scene.pad.mu * np.eye(2)).poles(), found.spectrum.values)
        < 1e-7
    )
    system = held_system(scene, found)
    for mu in (0.0, 0.2, 1.5):
        exact = complex_eigenvalues(*system(mu)).values
        # at a coalescence both are known to the square root of rounding
        assert apart(control.feedback(plant, mu * np.eye(2)).poles(), exact) < 1e-6


def test_the_output_is_the_normal_reaction():
    # of the first edge contact: a pad that is lifted by y presses (k3 + k4) y less
    scene = scene_of("b1-a")
    pad = scene.pad
    assert friction_plant(scene).C[0, 1] == pytest.approx(-(pad.k3 + pad.k4), rel=1e-12)


def test_at_two_levels_friction_is_no_single_gain():
    # of a tilted pad the edges are at two heights; of the line contact there is one arm
    for stem, rank in (("b1-a", 2), ("b2-c", 1)):
        rows = friction_plant(scene_of(stem)).C[:, :3]
        size = np.linalg.svd(rows / np.abs(rows).max(axis=0, initial=1e-300), compute_uv=False)
        assert np.sum(size > 1e-6 * size[0]) == rank


def test_refusals():
    scene = scene_of("b1-a")
    with pytest.raises(InputError, match=r"mu: -1\.0 is not allowed"):
        state_space(scene, -1.0)
    with pytest.raises(ComputationError, match="no steady sliding"):
        state_space(scene.replace(k1=0.0, k2=0.0))


def test_friction_that_falls_with_speed_is_no_plain_gain():
    text = {"mu_s": 0.5, "mu_k": 0.3, "v_ref": 1.0, "V": 2.0}
    document = scene_of("b1-a").to_dict()
    document["parameters"] = {k: v for k, v in document["parameters"].items() if k != "mu"} | text
    from squeal.io.scene import Scene
    from squeal.schema.values import Place

    falling = Scene.from_dict(document, Place("falling"))
    with pytest.raises(ComputationError, match="no plain gain"):
        friction_plant(falling)
