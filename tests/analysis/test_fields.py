"""Fields over two parameters against single scenes, point by point."""

import dataclasses

import numpy as np
import pytest

import squeal
from squeal.analysis.answers import Axis
from squeal.analysis.maps import field_of
from squeal.analysis.pads import analyse
from squeal.analysis.stack import PadStack
from squeal.errors import ComputationError, InputError
from squeal.io.scene import Damping
from tests.conftest import scene_of


@pytest.mark.parametrize("damping", [None, Damping(ratios=(0.01, 0.02, 0.03))])
@pytest.mark.parametrize("stem", ["b1-c", "b2-c", "b3"])
def test_growth_and_frequency_are_those_of_the_dominant_eigenvalue(stem, damping):
    scene = dataclasses.replace(scene_of(stem), damping=damping)
    k2 = scene.pad.k2
    axes = Axis("alpha1", 0.3, 2.9, 3), Axis("k2", 0.4 * k2, 2.5 * k2, 3)
    growth, frequency = (field_of(scene, axes, name).values for name in ("growth", "frequency"))
    for i, j in np.ndindex(3, 3):
        one = scene.replace(alpha1=float(axes[0].values[i]), k2=float(axes[1].values[j]))
        try:
            analysis = analyse(one)
        except ComputationError:
            assert np.isnan(growth[i, j])
            continue
        if "on the branch" not in analysis.how and stem != "b3":
            continue  # another equilibrium than the map's
        top = analysis.spectrum.dominant
        radius = np.abs(analysis.spectrum.values).max()
        assert growth[i, j] == pytest.approx(top.growth_rate, abs=1e-7 * radius)
        if top.growth_rate > 1e-6 * radius:
            assert frequency[i, j] == pytest.approx(top.frequency_hz, rel=1e-6)
        else:
            assert np.isnan(frequency[i, j])


@pytest.mark.parametrize(("quantity", "words"), [("colour", "one of"), ("critical-friction", "mu")])
def test_refusals(quantity, words):
    with pytest.raises(InputError, match=words):
        field_of(scene_of("b3"), (Axis("mu", 0.0, 1.0, 3), Axis("h", 0.01, 0.02, 3)), quantity)


def test_values_that_could_not_be_decided_are_told_in_the_record(monkeypatch, recwarn):
    """They were told by a warning alone, which speaks of no equilibrium."""
    losses = PadStack.first_losses
    monkeypatch.setattr(
        PadStack,
        "first_losses",
        lambda *arguments: losses(*arguments)._replace(
            unknown=np.array([True, False, False, False])
        ),
    )
    axes = Axis("k1", 1e8, 2e8, 2), Axis("k2", 1e8, 2e8, 2)
    answer = squeal.map(scene_of("b3"), axes, "critical-friction")
    assert answer.warnings == ("critical friction could not be decided at 25 % of the points",)
    assert answer.to_dict()["admissible"] is True
    assert not recwarn
