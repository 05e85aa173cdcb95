"""Pictures of a motion and of sweeps of a pad: at rest, in short contacts, in any order."""

import dataclasses

import numpy as np
import pytest

import squeal
from squeal.errors import InputError
from squeal.io.scene import OUTPUTS, Damping, read_scene
from squeal.plots.answers import drawing
from squeal.plots.motion import Interval, Looks, Run
from tests.conftest import ROOT, SCENES, needs_heyoka


@needs_heyoka
def test_a_pad_at_rest_has_a_picture(tmp_path):
    """Constant forces have no line in the spectrum that could set its range."""
    scene = read_scene(ROOT / "squeal" / "examples" / "pad.yaml").replace(mu=0.1)
    rest = dataclasses.replace(
        scene,
        initial=(0.0,) * 6,
        damping=Damping(ratios=(0.05, 0.05, 0.05)),
        stop=1e-3,
        samples=4001,
        outputs=OUTPUTS,
    )
    squeal.simulate(rest).save(tmp_path / "rest.svg", scene=rest)
    assert "no line stands out" in (tmp_path / "rest.svg").read_text("utf-8")


def test_a_contact_between_two_samples_is_that_of_the_edge_to_which_the_pad_is_turned():
    history = {
        "t": np.array([0.0, 1.0]),
        "theta": np.array([0.1, 0.3]),
        "delta": np.full(2, np.nan),  # without contact at both
    }
    run = Run("bounce", "B2", 1.0, (), {"SS": 0.9, "PC": 0.1, "FC": 0.0}, {}, None, history)
    run.__dict__["timeline"] = [Interval(0.4, 0.5, "PC")]
    assert [interval.state for interval in Looks.of(run).timeline] == ["PC leading"]


def test_a_sweep_of_a_pad_is_drawn_in_any_order():
    scene = read_scene(SCENES / "b3.yaml")
    for values in ([0.1, 0.3], [0.3, 0.1]):
        assert "over mu from 0.1 to 0.3" in drawing(squeal.sweep(scene, values), "b3").alternative
    K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}  # flutter from mu = 3/4 on
    pair = squeal.sweep(squeal.System([[1, 0], [0, 1]], K=K), [1.0, 0.8, 0.2, 0.0])
    words = "marginal from 0 to 0.2, flutter from 0.8 to 1"
    assert words in drawing(pair, "pair").alternative
    drawing(squeal.sweep(scene, [0.3]), "b3")  # one value, without a warning of Matplotlib


def test_a_sweep_of_a_pad_without_an_equilibrium_is_drawn():
    """It was refused, since its branch was to begin at the lowest value."""
    scene = read_scene(SCENES / "b1-a.yaml")
    sweep = squeal.sweep(scene, [50.0, 60.0])  # beyond a fold
    assert "no equilibrium from 50 to 60" in drawing(sweep, "b1-a").alternative


@pytest.mark.parametrize("samples", [2, 3, 4, 7])
def test_a_picture_of_a_motion_may_have_few_samples(samples):
    """The last quarter of 4 to 7 samples is one, whose spectrum was not a number."""
    scene = read_scene(ROOT / "squeal" / "examples" / "pad.yaml")
    scene = dataclasses.replace(scene, stop=1e-3, samples=samples, outputs=OUTPUTS)
    found = squeal.simulate(scene, integrator="scipy")
    spectrum = found.plot(scene=scene).figure.axes[-1]
    assert all(np.isfinite(line.get_ydata()).all() for line in spectrum.get_lines())


@pytest.mark.parametrize("left_out", OUTPUTS)
def test_a_picture_of_a_motion_needs_all_outputs(left_out):
    """Without shares or extrema it ended in a KeyError."""
    scene = read_scene(ROOT / "squeal" / "examples" / "pad.yaml")
    scene = dataclasses.replace(scene, stop=1e-3, samples=4001, outputs=OUTPUTS)
    all_outputs = squeal.simulate(scene, integrator="scipy")
    some = dataclasses.replace(all_outputs, **{left_out: None})
    with pytest.raises(InputError, match="needs all outputs of the scene"):
        some.plot(scene=scene)
