"""References without heyoka: extrapolation in mpmath against closed forms and quad precision."""

import dataclasses
import math

import mpmath as mp
import numpy as np
import pytest

from squeal.errors import ComputationError
from squeal.io.scene import Damping, Scene, read_scene
from squeal.simulation import reference as of_reference
from squeal.simulation.integrators.with_mpmath import MpmathIntegrator
from squeal.simulation.reference import ChangeTimes, reference
from squeal.simulation.run import in_natural_units, integrate
from tests.conftest import SCENES, needs_heyoka
from tests.simulation.closed import upright
from tests.simulation.test_simulation import bounce


def run(scene, tolerance=1e-20):
    units, model, first, stop = in_natural_units(scene)
    integrator = MpmathIntegrator(model, tolerance)
    changes = ChangeTimes()
    start = np.array([integrator.number(float(v)) for v in first])
    t, state, *_ = integrate(model, integrator, units, start, stop, [changes])
    return model, t, state, changes.times


def test_a_bouncing_pad_in_closed_form_to_twenty_digits():
    # upright, no inclined springs: y'' = -F_n/m apart, and harmonic about -F_n/K while it touches
    model, t, state, times = run(bounce(upright(k1=0.0, k2=0.0), 1e-3, 0.02))
    pad = model.pad
    with mp.workdps(40):
        c = model.c
        first = mp.mpf(float(in_natural_units(bounce(upright(k1=0.0, k2=0.0), 1e-3, 0.02))[2][1]))
        pull, K = mp.mpf(float(c.F_n)) / mp.mpf(float(c.m)), mp.mpf(float(pad.k3)) + float(pad.k4)
        fall = mp.sqrt(2 * first / pull)
        rate, sag = mp.sqrt(K / mp.mpf(float(c.m))), mp.mpf(float(c.F_n)) / K
        pressed = 2 * (mp.pi - mp.atan2(pull * fall / rate, sag)) / rate
        period, now = 2 * fall + pressed, mp.mpf(float(t))
        phase = now - period * mp.floor((now + fall) / period)
        if phase <= fall:
            expected = first - pull * phase**2 / 2
        else:
            late = phase - fall
            expected = sag * (mp.cos(rate * late) - 1)
            expected -= pull * fall / rate * mp.sin(rate * late)
        assert abs(mp.mpf(str(state[1])) - expected) < 1e-19 * abs(first)
    assert len(times) > 4
    assert times[0] == pytest.approx(float(fall), rel=1e-15)


@needs_heyoka
@pytest.mark.parametrize("name", ["b1-c", "b2-b"])
def test_quad_precision_is_met_to_the_last_digit_of_a_double(name, monkeypatch):
    scene = read_scene(SCENES / f"{name}.yaml", "simulate")
    scene = dataclasses.replace(scene, stop=scene.stop / 20, outputs=())
    quad = reference(scene)
    monkeypatch.setattr(of_reference, "quad", lambda: None)
    other = reference(scene)
    assert other.state == pytest.approx(quad.state, rel=4e-16, abs=1e-17)
    assert other.times == pytest.approx(quad.times, rel=4e-16)
    assert bool(len(quad.times)) == (name == "b1-c")


def test_damping_acts_on_the_rates():
    # a pad in flight without springs but with damping: v = v0 exp(-c t/m)
    pad = upright(k1=0.0, k2=0.0, F_n=0.0)
    c = 3.0 * pad.m
    matrix = ((c, 0.0, 0.0), (0.0, c, 0.0), (0.0, 0.0, c * pad.I / pad.m))
    free = Scene("B1", pad, initial=(0, 1.0, 0, 1.0, 0, 0), stop=0.02, samples=2, outputs=())
    scene = dataclasses.replace(free, damping=Damping(matrix=matrix))
    final = reference(scene).state
    units, *_ = in_natural_units(scene)
    assert final[3] * units.velocity == pytest.approx(math.exp(-0.06), rel=1e-15)
    model = in_natural_units(scene)[1]
    assert "damping" in model.terms
    _, _, state, _ = run(scene)
    assert float(state[3]) * units.velocity == pytest.approx(math.exp(-0.06), rel=1e-15)


def test_the_end_of_the_model_has_its_time():
    pad = upright(k1=0.0, k2=0.0, F_n=1.0)
    scene = Scene("B1", pad, initial=(0, 5.0, 0, 0, 0, 40.0), stop=1.0, samples=2, outputs=())
    with pytest.raises(ComputationError, match="past 90 degrees") as stop:
        run(scene)
    told = float(str(stop.value).split("t = ")[1].split(" ")[0])
    assert told == pytest.approx(math.pi / 2 / 40.0, rel=1e-8)


def test_tolerances_are_those_that_are_told(monkeypatch):
    monkeypatch.setattr(of_reference, "quad", lambda: None)
    model = read_scene(SCENES / "b1-c.yaml", "simulate").pad_model
    assert MpmathIntegrator(model, of_reference.TOLERANCE).tolerance == of_reference.TOLERANCE
    assert "mpmath" in of_reference.precision_in_words()
