"""Contact changes and limits of the model against closed forms, and hard cases against quad."""

import dataclasses
import math
import re

import mpmath as mp
import numpy as np
import pytest

from squeal.errors import ComputationError
from squeal.io.scene import Scene
from squeal.model.pad import Model, Pad
from squeal.simulation.run import simulate
from squeal.simulation.scipy_solver import SciPyIntegrator
from tests.conftest import BACKENDS, needs_heyoka
from tests.simulation.closed import quad, upright
from tests.simulation.test_simulation import bounce


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(("spin", "target"), [(3.0, "3"), (-3.0, "4")])
def test_a_turning_pad_touches_with_one_edge(backend, spin, target):
    # free flight without load: theta = spin t, y stays; the lowered edge reaches the surface when
    # y = w sin(theta) - h (1 - cos(theta))
    pad = upright(k1=0.0, k2=0.0, F_n=0.0)
    height = 0.01
    near = height / pad.w, 1.1 * height / pad.w
    angle = mp.findroot(lambda t: pad.w * mp.sin(t) - pad.h * (1 - mp.cos(t)) - height, near)
    start = (0.0, height, 0.0, 0.0, 0.0, spin)
    scene = Scene("B1", pad, initial=start, stop=0.1, samples=2, outputs=("events",))
    first = simulate(scene, backend).events[0]
    assert first.t == pytest.approx(float(angle) / abs(spin), rel=1e-12)
    assert (first.source, first.target) == ("2", target)


@pytest.mark.parametrize("place", [0.2, 0.5, 0.7])
@pytest.mark.parametrize("third", [-0.5, 0.0, 2.0])
def test_a_gap_that_turns_back_within_a_step_is_seen(place, third):
    """A cubic with a double zero, at whose place the SciPy integrator has to look."""
    model = Scene("B1", upright()).pad_model
    away = np.polynomial.Polynomial([-place, 1.0])
    gap = away**2 * (3.0 + third * away) + 1e-6
    ends = np.array([0.0, 1.0])
    states = np.zeros((6, 2))
    states[1] = gap(ends)
    states[4] = gap.deriv()(ends) / 2.0
    solver = SciPyIntegrator(model, 1e-10)
    turn = solver._turning_time(np.array([3.0, 5.0]), states, np.zeros(2))
    assert turn == pytest.approx(3.0 + 2.0 * place)


@pytest.mark.parametrize("share", [1e-3, 1e-6, 1e-9, 1e-12])
@needs_heyoka
def test_separations_much_shorter_than_a_step_are_found(share):
    # dropped from a small height the pad leaves the surface for a short while once a cycle
    pad = upright()
    k = pad.k1 + pad.k2
    K = pad.k1 + pad.k2 + pad.k3 + pad.k4
    height = share * pad.F_n / K
    free = math.sqrt(k / pad.m)
    rate = math.sqrt(K / pad.m)
    ratio = k * height / pad.F_n
    fall = 2 * math.asin(math.sqrt(ratio / (1 + ratio) / 2)) / free
    speed = math.sqrt((2 * pad.F_n * height + k * height**2) / pad.m)
    pressed = 2 * (math.pi - math.atan2(speed / rate, pad.F_n / K)) / rate
    period = 2 * fall + pressed
    result = simulate(bounce(pad, height, 4.5 * period, outputs=("events", "shares")))
    assert len(result.events) == 18
    lost = 2 * fall / period
    assert result.shares["1"] == pytest.approx(1 - lost, abs=1e-3 * lost + 1e-12)


@pytest.mark.parametrize("share", [0.0, 1e-12])
@pytest.mark.parametrize("backend", BACKENDS)
def test_grazing_from_below_is_no_separation(backend, share):
    pad = upright()
    K = pad.k1 + pad.k2 + pad.k3 + pad.k4
    sag = pad.F_n / K
    rate = math.sqrt(K / pad.m)
    stop = 30.0 / rate
    wanted = ("events", "history", "extrema")
    result = simulate(bounce(pad, -share * sag, stop, outputs=wanted), backend)
    t = result.history["t"]
    y = -sag + (1 - share) * sag * np.cos(rate * t)
    assert np.array_equal(t, np.linspace(0, stop, 101))
    assert np.abs(result.history["y"] - y).max() < 1e-11 * sag
    assert result.history["F4"] == pytest.approx(-pad.k4 * y / pad.F_n, abs=1e-11)
    ends = pad.k3 * sag * np.array([share, 2.0 - share]) / pad.F_n
    assert result.extrema["F3"] == pytest.approx(ends, abs=1e-11)
    assert share == 0.0 or not result.events


@needs_heyoka
@pytest.mark.parametrize("values", [{"F_n": 1e100}, {"I": 1e-100}, {"mu": 1e100}])
@pytest.mark.parametrize("outputs", [("events",), ("history",)])
def test_a_motion_that_leaves_all_bounds_at_once_ends_with_its_time(values, outputs):
    pad = upright(**{"alpha1": 2.4, "alpha2": 2.4, "mu": 0.4} | values)
    scene = Scene("B1", pad, stop=1e-3, samples=3, outputs=outputs)
    with pytest.raises(ComputationError, match="after t = 0 s: the motion is not finite"):
        simulate(scene, "heyoka")


def limit_of(scene, backend, words):
    times = []
    for outputs in (("events",), ("events", "extrema")):  # without and with dense output
        with pytest.raises(ComputationError, match=words) as caught:
            simulate(dataclasses.replace(scene, outputs=outputs), backend)
        times.append(float(re.search(r"at t = (\S+) s", str(caught.value)).group(1)))
    assert times[0] == times[1]
    return times[0]


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("theta0", [0.0, 0.4])
def test_rotation_past_ninety_degrees_has_its_own_time(backend, theta0):
    pad = upright(k1=0.0, k2=0.0, F_n=1.0, theta0=theta0)
    scene = Scene("B1", pad, initial=(0, 5.0, 0, 0, 0, 40.0), stop=1.0, samples=2)
    t = limit_of(scene, backend, "past 90 degrees")
    assert t == pytest.approx((math.pi / 2 - theta0) / 40.0, rel=1e-8)


@pytest.mark.parametrize(
    ("backend", "close"), [pytest.param("heyoka", 1e-8, marks=needs_heyoka), ("scipy", 2e-2)]
)
@pytest.mark.parametrize(
    ("spring", "lengths"), [(1, (0.4, 0.4)), (1, (0.3, 50.0)), (2, (50.0, 0.3))]
)
def test_a_collapsing_spring_has_its_name_and_time(backend, close, spring, lengths):
    # both springs stand upright and the pad flies through a fixed end: y = L at zero length
    pad = upright(L1=lengths[0], L2=lengths[1])
    y0 = 1e-3
    speed = 400.0
    k = pad.k1 + pad.k2
    rate = math.sqrt(k / pad.m)
    sag = pad.F_n / k
    # y = size cos(rate t - phase) - sag
    size = math.hypot(y0 + sag, speed / rate)
    phase = math.atan2(speed / rate, y0 + sag)
    exact = (phase - math.acos((sag + min(lengths) * (1 - 1e-6)) / size)) / rate
    scene = Scene("B1", pad, initial=(0, y0, 0, 0, speed, 0), stop=0.01, samples=2)
    found = limit_of(scene, backend, f"spring {spring} has collapsed")
    assert found == pytest.approx(exact, rel=close)


@pytest.mark.parametrize("excess", [-1e-4, -1e-6, 1e-6, 1e-4, 1e-2])
def test_sliding_is_lost_however_narrowly(excess):
    # level springs, hardly any load: x_dot = V (1 + excess) sin(rate t)
    pad = upright(h=1e-9, alpha1=math.pi, alpha2=math.pi, F_n=1e-6, V=1.0)
    rate = math.sqrt((pad.k1 + pad.k2) / pad.m)
    start = (-(1 + excess) * pad.V / rate, 0, 0, 0, 0, 0)
    scene = Scene("B1", pad, initial=start, stop=20 / rate, samples=2, outputs=("shares",))
    result = simulate(scene)
    assert result.sliding_holds is (excess < 0)
    if excess > 0:
        lost = math.asin(1 / (1 + excess)) / rate
        assert result.sliding_lost_at == pytest.approx(lost, rel=1e-6)


PLAIN = {
    "m": 1.0, "w": 1.0, "h": 0.35, "k1": 1.0, "k2": 1.3, "L1": 20.0, "L2": 20.0, "mu": 0.6,
    "F_n": 0.0057, "alpha1": 0.75 * math.pi, "alpha2": 0.75 * math.pi,
}  # fmt: skip
HARD: dict[str, tuple[Model, dict[str, float], float]] = {
    "stiff point contact": ("B1", {"k3": 1e6, "k4": 1e6}, 5e-3),
    "stiff line contact": ("B2", {"k_c": 1e6}, 0.1),
    "long springs": ("B2", {"L1": 1e8, "L2": 1e8}, 20.0),
    "nearly level": ("B2", {"theta0": 1e-15}, 20.0),
    "great friction": ("B1", {"mu": 10.0}, 15.0),
    "tiny load": ("B1", {"F_n": 1e-12}, 20.0),
    "flat pad": ("B1", {"h": 1e-6}, 20.0),
    "tower": ("B2", {"h": 1e3}, 20.0),
    "heavy": ("B2", {"m": 1e6}, 2e4),
}


@pytest.mark.parametrize("case", HARD)
@needs_heyoka
def test_hard_cases_agree_with_quad_precision(case):
    model_name, changes, stop = HARD[case]
    values = PLAIN | ({"k3": 0.43, "k4": 0.43} if model_name == "B1" else {"k_c": 0.5}) | changes
    k = values["k3"] + values["k4"] if model_name == "B1" else values["k_c"]
    start = (0, -2 * values["F_n"] / k, 0, 0, 0, 0)
    scene = Scene(model_name, Pad(**values), initial=start, stop=stop, samples=2)
    ours = simulate(scene)
    units, exact, changes_seen = quad(scene)
    apart = np.abs(units.to_scaled(np.array(ours.final[1:])) - exact)[:3].max()
    assert apart < 1e-11 * np.abs(exact[:3]).max()
    assert changes_seen == ours.contact_changes
    assert sum(ours.shares.values()) == pytest.approx(1.0, abs=1e-13)
