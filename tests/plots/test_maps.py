"""Pictures of stability maps."""

import pytest

from squeal.analysis.maps import angle_axes, stability_map
from squeal.io.scene import read_scene
from squeal.plots.maps import stability_figure
from tests.conftest import SCENES


def test_only_a_traced_map_is_drawn():
    scene = read_scene(SCENES / "b3.yaml")
    with pytest.raises(ValueError, match="only a traced map can be drawn"):
        stability_figure(stability_map(scene, angle_axes(5)))
    assert stability_figure(stability_map(scene, angle_axes(5), traced=True)).axes
