"""What moves eigenvalues and thresholds: differences through the whole chain, scaling laws."""

import dataclasses
import math

import numpy as np
import pytest

from squeal.analysis.pads import analyse, critical_friction
from squeal.analysis.sensitivity import (
    eigenvalue_sensitivities,
    threshold_sensitivities,
)
from squeal.analysis.stack import parameters
from squeal.equilibrium.find import modal_damping, modal_damping_slope
from squeal.errors import ComputationError
from squeal.io.scene import Damping, Scene
from tests.conftest import scene_of
from tests.simulation.closed import upright

COUPLED = {"alpha1": 1.0, "alpha2": 2.6, "mu": 0.1}


def changed(scene: Scene, **changes: float) -> Scene:
    return dataclasses.replace(scene, pad=scene.pad.replace(**changes))


def step_of(scene: Scene, name: str) -> float:
    value = getattr(scene.pad, name)
    return 1e-5 * (abs(value) or (scene.pad.F_n / scene.pad.k1 if name in "x0 y0" else 1.0))


DAMPINGS = {
    "undamped": None,
    "ratios": Damping(ratios=(0.02, 0.01, 0.03)),
    "one ratio": Damping(ratios=(0.0, 0.02, 0.02)),
    "rayleigh": Damping(rayleigh=(50.0, 1e-7)),
    "matrix": Damping(matrix=((30.0, 0.0, 0.0), (0.0, 20.0, 0.0), (0.0, 0.0, 0.01))),
}


@pytest.mark.parametrize(
    ("name", "damping"),
    [
        *(("b3", damping) for damping in DAMPINGS),
        *(("b2-a", damping) for damping in ("undamped", "ratios", "matrix")),
        *(("b1-b", damping) for damping in ("one ratio", "rayleigh")),
    ],
)
def test_eigenvalues_against_differences_through_the_whole_chain(name, damping):
    scene = dataclasses.replace(scene_of(name), damping=DAMPINGS[damping])
    analysis = analyse(scene)
    size = np.abs(analysis.spectrum.values).max()
    found = eigenvalue_sensitivities(scene, analysis)
    assert set(found) == set(parameters(scene.pad_model))
    for parameter, slopes in found.items():
        value, h = getattr(scene.pad, parameter), step_of(scene, parameter)
        up, down = (
            analyse(changed(scene, **{parameter: value + way * h})).spectrum.values
            for way in (1, -1)
        )
        assert np.abs((up - down) / (2 * h) - slopes).max() * h < 3e-9 * size, parameter


def test_a_moment_of_inertia_that_was_left_out_follows():
    scene = changed(scene_of("b1-b"), I=None)
    analysis = analyse(scene)
    given = scene.replace(I=scene.pad.I)
    following, held = (eigenvalue_sensitivities(s, analysis) for s in (scene, given))
    pad, size = scene.pad, np.abs(analysis.spectrum.values).max()
    by_I = {"m": pad.I / pad.m, "w": 2 * pad.m * pad.w / 3, "h": 2 * pad.m * pad.h / 3}
    for name, slopes in following.items():
        chain = held[name] + by_I.get(name, 0.0) * held["I"]
        value = abs(getattr(pad, name)) or 1.0
        assert np.abs(chain - slopes).max() * value < 1e-12 * size, name


@pytest.mark.parametrize("name", ["b1-d", "b2-c"])
def test_scaling_laws(name):
    # in other units of mass and force the frequencies change as sqrt(k/m); lengths do not count
    scene = scene_of(name)
    analysis = analyse(scene)
    values, pad = analysis.spectrum.values, scene.pad
    slopes = eigenvalue_sensitivities(scene, analysis)

    def together(**powers: float) -> np.ndarray:
        return sum(p * getattr(pad, n) * slopes[n] for n, p in powers.items() if n in slopes)

    close = 1e-9 * np.abs(values).max()
    mass = together(m=1, I=1)
    assert np.abs(mass + values / 2).max() < close
    force = together(k1=1, k2=1, k3=1, k4=1, k_c=1, F_n=1)
    assert np.abs(force - values / 2).max() < close
    length = together(w=1, h=1, I=2, L1=1, L2=1, x0=1, y0=1, F_n=1)
    assert np.abs(length).max() < close


def test_upright_pad_in_closed_form():
    # springs upright, no friction: the vertical mode has omega^2 = (k1 + k2 + k3 + k4) / m
    scene = Scene("B1", upright(mu=0.0))
    pad = scene.pad
    analysis = analyse(scene)
    omega = math.sqrt((pad.k1 + pad.k2 + pad.k3 + pad.k4) / pad.m)
    k = int(np.argmin(np.abs(analysis.spectrum.values - 1j * omega)))
    found = eigenvalue_sensitivities(scene, analysis)
    assert found["m"][k] == pytest.approx(-0.5j * omega / pad.m, rel=1e-9)
    for name in ("k1", "k2", "k3", "k4"):
        assert found[name][k] == pytest.approx(0.5j / (pad.m * omega), rel=1e-6)


def test_modes_of_one_frequency_with_two_ratios_have_no_derivative():
    A, dA = np.diag([1.0, 4.0, 4.0]), np.ones((3, 3))
    assert np.isnan(modal_damping_slope(A, dA, (0.1, 0.2, 0.3))).any()
    same = modal_damping_slope(A, dA, (0.1, 0.2, 0.2))
    h = 1e-6
    up, down = (modal_damping(A + way * h * dA, (0.1, 0.2, 0.2))[0] for way in (1, -1))
    assert same == pytest.approx((up - down) / (2 * h), abs=1e-8)


@pytest.mark.parametrize(
    ("name", "damping"),
    [
        *(("b3", damping) for damping in ("undamped", "ratios", "rayleigh")),
        *(("b1-c", damping) for damping in ("undamped", "ratios")),
    ],
)
def test_thresholds_against_differences(name, damping):
    scene = changed(scene_of(name), **COUPLED)
    scene = dataclasses.replace(scene, damping=DAMPINGS[damping])
    loss = critical_friction(scene).first
    assert loss is not None
    found = threshold_sensitivities(scene, loss)
    end = 1.01 * loss.mu
    for parameter in ("m", "h", "k2", "alpha1") if name == "b3" else ("h", "k2"):
        value, h = getattr(scene.pad, parameter), 10 * step_of(scene, parameter)
        up, down = (
            critical_friction(changed(scene, **{parameter: value + way * h}), end).first
            for way in (1, -1)
        )
        assert up is not None
        assert down is not None
        assert abs((up.mu - down.mu) / (2 * h) - found[parameter]) * h < 1e-7, parameter


def test_a_threshold_at_zero_stays_there():
    scene = changed(scene_of("b3"), **COUPLED)
    found = []
    for pad in (scene, changed(scene, w=1.01 * scene.pad.w)):
        pad = dataclasses.replace(pad, damping=Damping(ratios=(0.02, 0.0, 0.01)))
        found.append(critical_friction(pad).first)
    assert [point.mu for point in found] == [0.0, 0.0]
    assert set(threshold_sensitivities(pad, found[1]).values()) == {0.0}
    fixed = dataclasses.replace(pad, damping=Damping(matrix=((0.0,) * 3,) * 3))
    with pytest.raises(ComputationError, match="no derivatives"):
        threshold_sensitivities(fixed, found[1])


def test_a_fold_has_derivatives_and_tells_of_no_rounding(recwarn):
    """Warnings of NumPy reached who asked, where the balance is exactly singular."""
    scene = scene_of("b2-c")
    fold = critical_friction(scene).points[-1]
    assert fold.kind == "fold"
    assert np.isfinite(list(threshold_sensitivities(scene, fold).values())).all()
    assert not recwarn
