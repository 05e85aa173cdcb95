"""Measures of motions in ensembles and alone against histories and closed forms."""

import dataclasses
import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from squeal.article.claims.motions import _calm, measure_alone, measures
from squeal.article.identify.ensemble import simulate_many, stack
from squeal.errors import ComputationError
from squeal.model.contact import CONSISTENT
from squeal.simulation.run import in_natural_units, simulate
from tests.article.test_ensemble import LAWS, STOP, scene, some
from tests.conftest import needs_heyoka
from tests.simulation.closed import bouncing, upright

pytestmark = needs_heyoka


def naive(one):
    """Measures from the history and the events of a single run, by their definitions."""
    run = simulate(dataclasses.replace(one, samples=100_001, outputs=("history", "events")))
    h = run.history
    state = h["state"]
    begin = run.events[0].t if state[0] in ("2", "SS") else 0.0
    seen = h["t"] >= begin
    names = ("F3", "F4") if one.model == "B1" else ("Rn", "delta")
    first = h[names[0]][seen]
    second = h[names[1]][seen]
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
        "shares": [
            np.isin(state[seen], ("1", "FC")).mean(),
            np.isin(state[seen], ("2", "SS")).mean(),
        ],
    }


@pytest.mark.parametrize(("model", "formulation"), LAWS[:2])
def test_measures_are_those_of_a_history(model, formulation):
    """Of the same functions an ensemble has coarse samples, a single run fine ones."""
    pads, initial = some(model, 6, 300)
    r = simulate_many(model, stack(pads), initial, STOP, 1e-10, formulation, measure=measures)
    compared = 0
    for i, pad in enumerate(pads):
        one = scene(model, formulation, pad, initial[i], tolerance=1e-10)
        try:
            exact = naive(one)
            fine = measure_alone(one)
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


def test_motions_of_no_length_are_where_they_begin():
    pads, initial = some("B1", 3, 40)
    r = simulate_many("B1", stack(pads), initial, 0.0, measure=measures)
    assert r["valid"].all()
    assert r["final"] == pytest.approx(initial)
    assert not r["duration"].any()


def test_rise_from_zero_at_first_contact_does_not_count():
    """A run that ends before the force is back at zero, in an ensemble and alone."""
    pad = upright()
    height = 1e-3
    touch, back, lowest = bouncing(pad, height)
    K = pad.k1 + pad.k2 + pad.k3 + pad.k4
    middle = pad.F_n / K
    pressed = math.sqrt(K / pad.m)
    left = middle + (lowest - middle) * math.cos(pressed * 0.2 * back)
    stop = touch + 0.7 * back
    start = (0.0, height, 0.0, 0.0, 0.0, 0.0)
    exact = pytest.approx((pad.k3 * left / pad.F_n, pad.k3 * lowest / pad.F_n), rel=1e-6)
    many = simulate_many("B1", pad, np.array([start]), stop, 1e-12, measure=measures)
    assert many["first"][0] == exact
    one = scene("B1", CONSISTENT, pad, start, stop=stop, tolerance=1e-12)
    assert measure_alone(one)["first"][0] == exact


def test_a_motion_without_acceleration_is_calm():
    """Of two motions, of one step each, the second has x_dot = t."""
    series = np.zeros((2, 6, 2))  # (power, state, step)
    series[1, 3, 1] = 1.0
    steps = SimpleNamespace(series=series, h=np.ones(2), motion=np.arange(2))
    shares = np.array([0.0, 1.0])
    times = shares[:, None] * np.ones(2)
    grid: Any = SimpleNamespace(steps=steps, shares=shares, t=times, first_steps=np.arange(2))
    assert _calm(grid, np.array([0.5, 0.5])).tolist() == [0.0, 1.0]
