"""Simulations against closed forms, SciPy, quad precision and conserved energy."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from squeal.equilibrium import sliding_equilibrium
from squeal.io.scene import Scene, read_scene
from squeal.model.contact import FULL, NONE, Formulation
from squeal.simulation.hybrid import Limit, first_contact, integrate, state_of, whole_motion
from squeal.simulation.run import in_natural_units, make_integrator, simulate
from tests.conftest import BACKENDS, HEYOKA, INSTALLED, SCENES, needs_heyoka
from tests.simulation.closed import bouncing, quad, upright

if HEYOKA:
    from squeal.simulation.taylor import TaylorIntegrator

CASES = [f"{model}-{case}" for model in ("b1", "b2") for case in "abcd"]


def bounce(pad, height, stop, **more):
    return Scene("B1", pad, initial=(0, height, 0, 0, 0, 0), stop=stop, samples=101, **more)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("k", [1e-3, 3e5])  # as good as free flight, and a fall on springs
def test_a_bouncing_pad_moves_as_the_closed_form_says(backend, k):
    pad = upright(k1=k, k2=k)
    height = 1e-3
    touch, back, lowest = bouncing(pad, height)
    period = 2 * touch + back
    wanted = ("events", "shares", "extrema")
    result = simulate(bounce(pad, height, 3 * period, outputs=wanted), backend)
    in_a_period = [touch, touch, touch + back, touch + back]  # both edges each time
    expected = [n * period + t for n in range(3) for t in in_a_period]
    close = 1e-11 if k > 1.0 else 1e-6  # the closed form is a small difference there
    assert [e.t for e in result.events] == pytest.approx(expected, rel=close)
    assert [e.source for e in result.events[::4]] == ["2"] * 3
    assert [e.target for e in result.events[1::4]] == ["1"] * 3
    assert result.final[1:4] == pytest.approx((0.0, height, 0.0), abs=close * height)
    assert result.shares["1"] == pytest.approx(back / period, rel=close)
    assert result.shares["2"] == pytest.approx(2 * touch / period, rel=close)
    assert sum(result.shares.values()) == pytest.approx(1.0, abs=1e-14)
    assert result.extrema["F3"] == pytest.approx((0.0, pad.k3 * lowest / pad.F_n), rel=1e-9)


@pytest.mark.parametrize(
    ("F_n", "rate", "state"),
    [(400.0, 0.0, FULL), (0.0, 0.0, NONE), (400.0, 1e-3, NONE), (400.0, -1e-3, FULL)],
)
def test_first_contact_follows_the_first_motion(F_n, rate, state):
    scene = Scene("B1", upright(F_n=F_n), initial=(0, 0, 0, 0, rate, 0), stop=1.0, samples=2)
    _, model, start, _ = in_natural_units(scene)
    assert state_of(first_contact(model, start)) == state


@pytest.mark.parametrize("stem", ["b1-a", "b1-d", "b2-b", "b2-c"])
@needs_heyoka
def test_scipy_and_quad_precision_agree(stem):
    scene = read_scene(SCENES / f"{stem}.yaml")
    # in b2-c, late, an edge leaves with a gap of exactly zero and touches within the same step
    share = 1.0 if stem in ("b2-a", "b2-c") else 0.4
    scene = dataclasses.replace(scene, outputs=("events",), stop=share * scene.stop)
    ours = simulate(scene)
    theirs = simulate(scene, "scipy")
    units, exact, changes = quad(scene)
    assert [e.target for e in ours.events] == [e.target for e in theirs.events]
    assert changes == len(ours.events)
    one = units.to_scaled(np.array(ours.final[1:]))
    two = units.to_scaled(np.array(theirs.final[1:]))
    amplitude = np.abs(one[:3]).max()
    assert np.abs(one - two).max() < 1e-9 * amplitude
    assert np.abs(one - exact).max() < 1e-11 * amplitude


@pytest.mark.parametrize("stem", ["b1-a", "b1-c", "b2-a", "b2-c"])
@needs_heyoka
def test_energy_is_conserved_without_friction(stem):
    scene = read_scene(SCENES / f"{stem}.yaml")
    pad = scene.pad.replace(mu=0.0)
    scene = dataclasses.replace(scene, pad=pad, formulation=Formulation(), stop=100 * scene.stop)
    units, model, start, stop = in_natural_units(scene)
    assert stop > 1000 * 2 * math.pi
    lever = np.array([1.0, 1.0, 1.0 / model.pad.w])
    energies = []

    def see(segment):
        state = segment.end[:, 0]
        on = segment.last_contact[:, 0]
        energies.append(model.energy(state[:3] * lever, state[3:] * lever, on))

    integrate(model, TaylorIntegrator(model, 1e-15), units, start, stop, [see])
    first = model.energy(start[:3] * lever, start[3:] * lever, first_contact(model, start))
    assert np.abs(np.array(energies) - first).max() < 1e-12 * abs(first)


@pytest.mark.parametrize("stem", ["b1-c", "b2-a"])
def test_other_units_give_the_same_motion(stem):
    scene = read_scene(SCENES / f"{stem}.yaml")
    mass = 1e-3
    length = 1e-6
    time = 7.3
    units = np.array([length, length, 1.0, length / time, length / time, 1 / time])
    pad = scene.pad.scaled(mass, length, time)
    initial = tuple(scene.initial / units)
    other = dataclasses.replace(scene, pad=pad, initial=initial, stop=scene.stop / time)
    one = simulate(scene)
    two = simulate(other)
    scale = np.array([1e-4, 1e-4, 1e-3, 1.0, 1.0, 10.0])
    assert np.all(np.abs(two.final[1:] * units - np.array(one.final[1:])) < 1e-11 * scale)
    assert [e.target for e in one.events] == [e.target for e in two.events]


def test_a_level_pad_touches_with_all_springs_in_the_same_instant():
    pad = upright(k3=None, k4=None, k_c=1e6)
    height = 1e-3
    count = 6
    touch, back, _ = bouncing(pad, height)
    start = (0, height, 0, 0, 0, 0)
    stop = 2.5 * touch + back
    run = simulate(Scene("BN", pad, Formulation(springs=count), start, stop, 2))
    times = [e.t for e in run.events]
    assert times == pytest.approx([touch] * count + [touch + back] * count, rel=1e-11)
    assert [e.source for e in run.events][:2] == ["SS", "PC"]
    assert run.events[count - 1].target == "FC"
    assert run.shares["FC"] == pytest.approx(back / stop, rel=1e-10)
    assert run.shares["PC"] == pytest.approx(0.0, abs=1e-12)


def test_a_start_beside_the_equilibrium_is_so_far_from_it():
    scene = read_scene(SCENES / "b1-c.yaml")
    rest = sliding_equilibrium(scene.pad_model)[0].q
    offset = np.array([1e-6, -2e-6, 1e-5])
    more: dict[str, Any] = {"start": "equilibrium", "outputs": ("history",), "stop": 1e-6}
    history = simulate(dataclasses.replace(scene, initial=(*offset, 0, 0, 0), **more)).history
    first = [history[name][0] for name in ("x", "y", "theta")]
    assert first - np.array(rest) == pytest.approx(offset, rel=1e-9)


@needs_heyoka
def test_a_tolerance_is_no_finer_than_its_numbers():
    _, model, _, _ = in_natural_units(read_scene(SCENES / "b1-c.yaml"))
    given = (
        (float, 1e-20, np.finfo(float).eps),
        (float, 1e-9, 1e-9),
        (np.longdouble, 1e-20, 1e-20),
    )
    for kind, tolerance, expected in given:
        assert TaylorIntegrator(model, tolerance, kind).tolerance == expected


@needs_heyoka
@pytest.mark.parametrize("stem", ["b1-c", "b2-c"])
def test_a_motion_as_one_course_is_that_of_another_integrator(stem):
    """States, contact changes and, by the sign of each gap, contact between them."""
    units, model, start, stop = in_natural_units(read_scene(SCENES / f"{stem}.yaml"))
    times = np.linspace(0.0, 0.2 * stop, 777)
    stop = 0.2 * stop
    ours, theirs = (
        whole_motion(model, make_integrator(model, 1e-12, name), units, start, stop, True)
        for name in INSTALLED
    )
    for segment in (ours, theirs):
        states, on = segment.at(times)
        gaps = model.gaps(model.c.xy_theta(states[:, :3].T))
        clear = np.abs(gaps) > 1e-6
        assert np.array_equal(on[clear] > 0, gaps[clear] < 0)
        assert [segment.t0[0], segment.t1[0], segment.limit[0]] == [0.0, stop, Limit.NONE]
        assert segment.last_contact[:, 0].tolist() == on[:, -1].tolist()
        assert segment.first_contact[:, 0].tolist() == on[:, 0].tolist()
        assert segment.steps.h.sum() == pytest.approx(stop, rel=1e-12)
        assert len(segment.steps.t) == segment.step_count[0]
    assert len(ours.changes.t) > 1
    assert ours.changes.point.tolist() == theirs.changes.point.tolist()
    assert ours.changes.t == pytest.approx(theirs.changes.t, rel=1e-8)
    apart = np.abs(ours.at(times)[0] - theirs.at(times)[0]).max(axis=0)
    assert np.all(apart < 1e-7 * np.abs(states).max(axis=0))
