"""What a motion comes to, against eigenvalues and closed forms."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from squeal.errors import ComputationError
from squeal.io.scene import Damping, Scene, read_scene
from squeal.model.contact import Formulation
from squeal.queries.pads.equilibrium import analyse
from squeal.simulation.observers import Response
from squeal.simulation.run import simulate
from tests.conftest import SCENES, random_pad
from tests.simulation.closed import upright


def response(scene: Scene) -> Response:
    found = simulate(dataclasses.replace(scene, outputs=("response",), samples=2)).response
    assert found is not None
    return found


def kicked(name, **more: Any) -> Scene:
    one = read_scene(SCENES / f"{name}.yaml")
    kick = (1e-8, 2e-8, 1e-7, 0.0, 1e-4, 0.0)
    return dataclasses.replace(one, start="equilibrium", initial=kick, **more)


FALLING = {"mu": None, "V": 10.0, "mu_s": 0.9, "mu_k": 0.3, "v_ref": 4.0}
RATIOS: Any = (None, (2e-3, 4e-3, 1e-3), (0.05, 0.05, 0.05))
TERMS = [*((ratios, {}) for ratios in RATIOS), ((1e-3, 2e-3, 1e-3), FALLING)]


@pytest.mark.parametrize("name", ["b1-c", "b2-c", "b2-d"])
@pytest.mark.parametrize(("damping", "friction"), TERMS)
def test_growth_is_that_of_an_eigenvalue(name, damping, friction):
    one = kicked(name, damping=damping and Damping(ratios=damping)).replace(**friction)
    found = response(one)
    assert found.growth_rate is not None
    value = complex(found.growth_rate, 2 * math.pi * (found.growth_frequency_hz or 0.0))
    values = analyse(one).spectrum.values
    assert np.abs(values - value).min() < 1e-4 * abs(value)
    fastest = values.real.max()
    if fastest > 0.01 * abs(value):
        assert found.growth_rate == pytest.approx(fastest, rel=1e-3)


SAG = 400.0 / 1.6e6
# from the surface itself rounding may lift the pad once a turn
BELOW = (0.0, -1e-5 * SAG, 0.0, 0.0, 0.0, 0.0)


def bounce(stop, **more: Any) -> Scene:
    """One degree of freedom in full contact: y'' + 2 d y' + w^2 y = 0 about the sag."""
    pad = upright()
    more.setdefault("initial", (0.0,) * 6 if "start" in more else BELOW)
    return Scene("B2", pad.replace(k3=None, k4=None, k_c=1e6), stop=stop, samples=2, **more)


RATE = math.sqrt((3e5 + 3e5 + 1e6) / 2.0)


@pytest.mark.parametrize(
    ("c", "settled"), [(0.0, False), (10.0, False), (40.0, None), (200.0, True), (-40.0, False)]
)
def test_decay_is_that_of_the_closed_form(c, settled):
    rows = ((0.0, 0.0, 0.0), (0.0, c, 0.0), (0.0, 0.0, 0.0))
    kick = (0, 1e-9, 0, 0, 0, 0)  # beside the sag: contact is kept
    one = bounce(0.2, damping=Damping(matrix=rows), start="equilibrium", initial=kick)
    found = response(one)
    d = c / (2 * 2.0)
    turn = math.sqrt(RATE**2 - d**2) / (2 * math.pi)
    assert found.growth_rate == pytest.approx(-d, rel=1e-4, abs=1e-3)
    assert found.growth_frequency_hz == pytest.approx(turn, rel=1e-6)
    assert found.settled is settled
    # over a quarter of the run the amplitude falls by exp(-d stop/8) from one half to the other
    steady = abs(1 - math.exp(-d * 0.2 / 8)) < 0.1
    assert (found.amplitude is not None) == steady
    if steady and c == 0.0:
        assert found.amplitude == pytest.approx({"x": 0.0, "y": 1e-9, "theta": 0.0}, abs=1e-13)
    if settled is not True:
        assert found.frequency_hz == pytest.approx(turn, rel=1e-3)


def test_a_run_that_is_too_short_tells_nothing():
    period = 2 * math.pi / RATE
    assert response(bounce(1.9 * period)) == Response()
    found = response(bounce(2.1 * period))
    assert (found.frequency_hz, found.amplitude, found.settled) == (None, None, None)
    assert found.growth_rate == 0.0
    assert response(bounce(15.0 * period)).frequency_hz is None
    assert response(bounce(17.0 * period)).frequency_hz is not None


def test_a_pad_at_rest_has_settled():
    found = response(bounce(0.1, start="equilibrium"))
    assert (found.settled, found.frequency_hz, found.growth_rate) == (True, None, None)
    assert found.amplitude == pytest.approx({"x": 0.0, "y": 0.0, "theta": 0.0}, abs=1e-12)


def test_where_there_is_no_equilibrium_one_sentence_says_so():
    # without springs nothing balances the friction force
    pad = upright(k1=0.0, k2=0.0, mu=0.5)
    one = Scene("B1", pad, stop=1.0, samples=2, start="equilibrium")
    with pytest.raises(ComputationError, match="initial: no steady sliding exists"):
        simulate(one)
    turned = dataclasses.replace(kicked("b2-a"), initial=(0.0, 0.0, 2.0, 0.0, 0.0, 0.0))
    with pytest.raises(ComputationError, match="initial: theta: 2 turns the pad past 90 degrees"):
        simulate(turned)


@pytest.mark.parametrize("rate", [5.0, -5.0])
@pytest.mark.parametrize("law", ["integral", "mean"])
def test_a_level_pad_on_the_surface_that_begins_to_turn(rate, law):
    def run(tilt, backend="auto"):
        start = (0.0, 0.0, tilt, 0.0, 0.0, rate)
        pad = dataclasses.replace(random_pad(11, "B2"), theta0=0.0, y0=0.0)
        scene = Scene("B2", pad, Formulation(line_force=law), initial=start, stop=1e-4, samples=2)
        return np.array(simulate(scene, integrator=backend).final)

    # the contact length is 0/0 there and half the face at once; the motion depends on the start
    # continuously, so that it lies between those from a little tilt to either side
    level = run(0.0)
    beside = [run(tilt) for tilt in (1e-9, -1e-9)]
    scale = np.abs(level) + 1e-12
    assert np.abs(level - sum(beside) / 2).max() / scale.max() < 1e-9
    assert np.all(np.abs(level - beside[0]) / scale < 1e-5)
    assert run(0.0, "scipy") == pytest.approx(level, rel=1e-7)
