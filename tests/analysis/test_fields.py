"""Fields over two parameters against single scenes, point by point."""

import dataclasses

import numpy as np
import pytest

from squeal.analysis.answers import Axis
from squeal.analysis.eigenvalues import analyse
from squeal.analysis.maps import field_of
from squeal.errors import ComputationError, InputError
from squeal.io.scene import Damping, read_scene
from tests.conftest import SCENES

AXES = (Axis("alpha1", 0.3, 2.9, 3), Axis("k2", 0.5e8, 3.0e8, 3))


def scenes(stem, damping=None):
    scene = dataclasses.replace(read_scene(SCENES / f"{stem}.yaml"), damping=damping)
    low, high = 0.4 * scene.pad.k2, 2.5 * scene.pad.k2
    axes = (AXES[0], Axis("k2", low, high, 3))
    points = [
        (i, j, dataclasses.replace(scene, pad=scene.pad.replace(alpha1=float(a), k2=float(b))))
        for i, a in enumerate(axes[0].values)
        for j, b in enumerate(axes[1].values)
    ]
    return scene, axes, points


@pytest.mark.parametrize("damping", [None, Damping(ratios=(0.01, 0.02, 0.03))])
@pytest.mark.parametrize("stem", ["b1-c", "b2-c", "b3"])
def test_growth_and_frequency_are_those_of_the_dominant_eigenvalue(stem, damping):
    scene, axes, points = scenes(stem, damping)
    growth, frequency = (field_of(scene, axes, name).values for name in ("growth", "frequency"))
    for i, j, one in points:
        try:
            found = analyse(one)
        except ComputationError:
            assert np.isnan(growth[i, j])
            continue
        if "on the branch" not in found.how and stem != "b3":
            continue  # another equilibrium than the map's
        top = found.spectrum.dominant
        radius = np.abs(found.spectrum.values).max()
        assert growth[i, j] == pytest.approx(top.growth_rate, abs=1e-7 * radius)
        if top.growth_rate > 1e-6 * radius:
            assert frequency[i, j] == pytest.approx(top.frequency_hz, rel=1e-6)
        else:
            assert np.isnan(frequency[i, j])


def test_refusals():
    scene = read_scene(SCENES / "b3.yaml")
    with pytest.raises(InputError, match="must be one of critical-friction, growth, frequency"):
        field_of(scene, AXES, "colour")
    with pytest.raises(InputError, match="over mu"):
        field_of(scene, (Axis("mu", 0.0, 1.0, 3), AXES[1]), "critical-friction")
