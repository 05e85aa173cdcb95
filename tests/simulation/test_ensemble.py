"""Ensembles against single simulations, histories, closed forms and the limits of the model."""

import dataclasses
import math
import sys
from typing import Any

import numpy as np
import pytest

from squeal.article.claims.motions import measure_alone, measures
from squeal.errors import ComputationError
from squeal.io.scene import Damping, Scene
from squeal.model.contact import CONSISTENT, Formulation
from squeal.simulation import simulate
from squeal.simulation.ensemble import DONE, simulate_many, stack
from squeal.simulation.run import in_natural_units
from tests.conftest import needs_heyoka, random_pad
from tests.simulation.closed import bouncing, upright

pytestmark = needs_heyoka

STOP = 60.0
LAWS = [
    ("B1", CONSISTENT),
    ("B2", CONSISTENT),
    ("B2", Formulation("mean")),
    ("B2", Formulation("mean", "frame", "-")),
    ("BN", Formulation(springs=5)),
]
FALLING = {"mu": None, "V": 3.0, "mu_s": 0.8, "mu_k": 0.3, "v_ref": 2.0}


def some(model, count, seed, **fixed):
    """Random pads of a model, and starts off every switching surface."""
    pads = [random_pad(seed + i, model, **fixed) for i in range(count)]
    r = np.random.default_rng(seed)
    initial = np.zeros((count, 6))
    initial[:, :3] = r.uniform(-1.0, 1.0, (count, 3)) * 1e-2
    return pads, initial


def scene(model, formulation, pad, initial, **more):
    plain = Scene(model, pad, formulation, tuple(initial), STOP, samples=2, outputs=("events",))
    return dataclasses.replace(plain, **more)


@pytest.mark.parametrize(("model", "formulation"), LAWS)
@pytest.mark.parametrize("terms", ["plain", "damped", "falling"])
def test_each_motion_is_that_of_a_single_run(model, formulation, terms):
    """Also of those that leave the model, and of pads that damp each with a matrix of its own."""
    pads, initial = some(model, 13, 100, **(FALLING if terms == "falling" else {}))
    rows = np.array([i * np.diag([1e-2, 2e-2, 1e-3]) for i in range(13)])
    damping: Any = {"damping": rows} if terms == "damped" else {}
    r = simulate_many(model, stack(pads), initial, STOP, 1e-12, formulation, events=True, **damping)
    for i, pad in enumerate(pads):
        more: Any = {"tolerance": 1e-12}
        if damping:
            more["damping"] = Damping(matrix=rows[i])
        try:
            one = simulate(scene(model, formulation, pad, initial[i], **more))
        except ComputationError as refused:
            assert r["outcome"][i] in (1, 2, 3, 4)
            ended = float(str(refused).split("t = ")[1].split()[0])
            assert r["ended"][i] == pytest.approx(ended, rel=1e-6)
            assert np.isnan(r["final"][i]).all()
            continue
        assert r["outcome"][i] == DONE
        assert r["changes"][i] == one.contact_changes
        # two paths differ by rounding, which a weakly chaotic motion amplifies
        assert r["events"][i][:, 0] == pytest.approx([e.t for e in one.events], rel=1e-6)
        scale = np.abs(one.final[1:]).max()
        assert r["final"][i] == pytest.approx(one.final[1:], abs=1e-5 * scale)


def naive(one):
    """Measures from the history and the events of a single run, by their definitions."""
    run = simulate(dataclasses.replace(one, samples=100_001, outputs=("history", "events")))
    h, state = run.history, run.history["state"]
    begin = run.events[0].t if state[0] in ("2", "SS") else 0.0
    seen = h["t"] >= begin
    names = ("F3", "F4") if one.model == "B1" else ("Rn", "delta")
    first, second = (h[name][seen] for name in names)
    speed = np.array([np.gradient(h[name], h["t"]) for name in ("x_dot", "y_dot", "theta_dot")])
    size = np.hypot(np.hypot(speed[0], speed[1]), one.pad.w * speed[2])
    late = h["t"] >= one.stop - 0.1 * (one.stop - begin)
    # the middle of the lower face lies at x + h sin(theta0 + theta), a constant aside
    face = np.gradient(h["x"] + one.pad.h * np.sin(one.pad.theta0 + h["theta"]), h["t"])
    return {
        "face": face[~np.isin(state, ("2", "SS"))].max(),
        "duration": one.stop - begin,
        "top": np.nanmax(first),
        "reach": np.nanmax(second),
        "mean": np.trapezoid(first, h["t"][seen]) / (one.stop - begin),
        "calm": size[late].max() / np.maximum(size, 1e-30).max(),
        "shares": [np.mean([name in names for name in state[seen]]) for names in ("1FC", "2SS")],
    }


@pytest.mark.parametrize(("model", "formulation"), LAWS[:3])
def test_measures_are_those_of_a_history(model, formulation):
    """Of the same functions an ensemble has coarse samples, a single run fine ones."""
    pads, initial = some(model, 6, 300)
    r = simulate_many(model, stack(pads), initial, STOP, 1e-10, formulation, measure=measures)
    compared = 0
    for i, pad in enumerate(pads):
        one = scene(model, formulation, pad, initial[i], tolerance=1e-10)
        try:
            exact, fine = naive(one), measure_alone(one)
        except ComputationError:
            continue
        compared += 1
        unit = in_natural_units(one)[0].time
        assert r["losses"][i] == fine["losses"][0]
        assert r["separated"][i] == pytest.approx(fine["separated"][0] * unit, rel=1e-7, abs=1e-9)
        for name in ("first", "second", "together", "tilt"):
            assert r[name][i] == pytest.approx(fine[name][0], rel=1e-4, nan_ok=True)
        for found, j, time in ((r, i, 1.0), (fine, 0, unit)):
            assert found["duration"][j] * time == pytest.approx(exact["duration"], rel=1e-9)
            assert found["shares"][j][:2] == pytest.approx(exact["shares"], abs=1e-4)
            assert found["face"][j] == pytest.approx(exact["face"], rel=2e-3)
            assert found["mean"][j] == pytest.approx(exact["mean"], rel=1e-4)
            assert found["calm"][j] == pytest.approx(exact["calm"], rel=3e-2)
            assert found["first"][j][1] == pytest.approx(exact["top"], rel=1e-5)
            # histories hardly ever sample delta where contact is lost, with its limit
            assert found["second"][j][1] == pytest.approx(exact["reach"], rel=5e-3)
    assert compared >= 4


def test_both_edges_in_the_same_instant_in_closed_form():
    pad, height = upright(), 1e-3
    touch, back, lowest = bouncing(pad, height)
    period = 2 * touch + back
    initial = np.zeros((3, 6))
    initial[:, 1] = height
    r = simulate_many("B1", pad, initial, 4.5 * period, 1e-12, events=True, measure=measures)
    times = [n * period + t for n in range(5) for t in (touch, touch, touch + back, touch + back)]
    for i in range(3):
        assert r["events"][i][:, 0] == pytest.approx(times[:18], rel=1e-10)
        assert sorted(r["losses"][i]) == [0] * 4 + [1] * 4
        # the force starts from zero at first contact and comes back to it
        assert r["first"][i] == pytest.approx((0.0, pad.k3 * lowest / pad.F_n), rel=1e-4)
        assert r["duration"][i] == pytest.approx(4.5 * period - touch, rel=1e-10)


def test_rise_from_zero_at_first_contact_does_not_count():
    """A run that ends before the force is back at zero, in an ensemble and alone."""
    pad, height = upright(), 1e-3
    touch, back, lowest = bouncing(pad, height)
    K = pad.k1 + pad.k2 + pad.k3 + pad.k4
    middle, pressed = pad.F_n / K, math.sqrt(K / pad.m)
    left = middle + (lowest - middle) * math.cos(pressed * 0.2 * back)
    stop, start = touch + 0.7 * back, (0.0, height, 0.0, 0.0, 0.0, 0.0)
    exact = pytest.approx((pad.k3 * left / pad.F_n, pad.k3 * lowest / pad.F_n), rel=1e-6)
    many = simulate_many("B1", pad, np.array([start]), stop, 1e-12, measure=measures)
    assert many["first"][0] == exact
    one = scene("B1", CONSISTENT, pad, start, stop=stop, tolerance=1e-12)
    assert measure_alone(one)["first"][0] == exact


def test_other_units_and_processes_change_nothing():
    pads, initial = some("B2", 11, 60)
    r = simulate_many("B2", stack(pads), initial, 30.0, 1e-10, measure=measures)
    m, length, time = 3.0, 0.04, 2e-4
    scaled = stack(pads).scaled(1 / m, 1 / length, 1 / time)
    rates = np.array([length, length, 1, length / time, length / time, 1 / time])
    s = simulate_many("B2", scaled, initial * rates, 30.0 * time, 1e-10, measure=measures)
    assert np.allclose(s["final"] / rates, r["final"], rtol=0, atol=1e-9, equal_nan=True)
    assert np.array_equal(s["changes"], r["changes"])
    assert np.allclose(s["first"], r["first"], rtol=1e-6, equal_nan=True)
    assert np.allclose(s["separated"], r["separated"] * time, rtol=1e-6, equal_nan=True)
    two = simulate_many("B2", stack(pads), initial, 30.0, 1e-10, measure=measures, workers=2)
    assert np.allclose(two["final"], r["final"], rtol=0, atol=1e-9, equal_nan=True)
    assert two["losses"].tolist() == r["losses"].tolist()


def test_what_cannot_be_simulated_is_refused(monkeypatch):
    pads, initial = some("B1", 3, 40)
    initial[1, 0] = math.nan
    with pytest.raises(ComputationError, match="pad 1 of the ensemble are not finite"):
        simulate_many("B1", stack(pads), initial, 20.0)
    monkeypatch.setitem(sys.modules, "squeal.simulation.taylor", None)
    with pytest.raises(ComputationError, match="heyoka"):
        simulate_many("B1", stack(pads), np.zeros((3, 6)), 1.0)
