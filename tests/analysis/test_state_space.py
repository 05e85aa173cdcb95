"""State spaces of pads: poles are eigenvalues, the static gain is the compliance."""

import numpy as np
import pytest

from squeal.analysis.pads import analyse
from squeal.analysis.state_space import state_space
from squeal.errors import ComputationError, InputError, InputWarning
from squeal.io.scene import Damping
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
