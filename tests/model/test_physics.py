"""Forces, penetrations, energies and derivatives against the literal equations in mpmath."""

import dataclasses
import itertools
import pickle
from typing import Any

import mpmath as mp
import numpy as np
import pytest

from squeal.article.transitions import transitions
from squeal.model.contact import (
    CONSISTENT,
    FORMULATION_CHOICES,
    FULL,
    LEAD,
    NONE,
    STATES,
    TRAIL,
    Formulation,
    LineContact,
    State,
    states,
)
from squeal.model.equations import PadModel, about_origin, linearise, natural_units
from squeal.model.pad import coefficients, pose, stretched
from squeal.simulation.ensemble import stack
from tests import naive
from tests.conftest import random_pad
from tests.naive import spring_loads

WORDS: Any = itertools.product(*FORMULATION_CHOICES.values())
FORMULATIONS = [Formulation(*words) for words in WORDS]
# a place in each contact state of B2: q = (x, y, theta), surface at y = -h
PLACES = {
    FULL: (0.013, -0.05, 0.004),
    LEAD: (-0.02, 0.01, 0.08),
    TRAIL: (0.03, 0.015, -0.09),
    NONE: (0.01, 0.2, 0.02),
}


def signals_of(model, q, state):
    return model.law.signals(model.c, pose(np, tuple(q)), state)


def close(ours, exact, tolerance):
    exact = np.array([float(v) for v in exact])
    return np.max(np.abs(np.array(ours) - exact)) <= tolerance * np.max(np.abs(exact))


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("seed", range(4))
def test_point_contact_loads(seed, state):
    p, q = random_pad(seed), PLACES[state]
    assert close(PadModel("B1", p).loads(q, state), naive.b1_loads(p, q, state), 1e-13)


@pytest.mark.parametrize("form", FORMULATIONS, ids=str)
@pytest.mark.parametrize("state", STATES)
def test_line_contact_loads(form, state):
    for seed in range(3):
        p, q = random_pad(seed), PLACES[state]
        model = PadModel("B2", p, form)
        assert model.state_at(q) == state
        assert close(model.loads(q, state), naive.b2_loads(p, form, q, state), 1e-12)
        if state != NONE:
            signals = naive.line_reaction(p, form, q, state)
            assert np.allclose(
                signals_of(model, q, state), [float(v) for v in signals], rtol=1e-12, atol=0
            )


@pytest.mark.parametrize("name", ["B1", "B2"])
@pytest.mark.parametrize("state", [FULL, LEAD, TRAIL])
def test_jacobian(name, state):
    for seed, form in enumerate(FORMULATIONS[:4]):
        p, q = random_pad(seed), PLACES[state]
        ours = -linearise(PadModel(name, p, form), q, state).K
        assert close(ours.ravel(), naive.jacobian(name, p, form, q, state), 1e-11)


@pytest.mark.parametrize("ratio", [1e-2, 1.0, 1e4, 1e8])
def test_elongation_keeps_its_digits(ratio):
    u = (3.1e-5, -4.7e-5)
    D = (-ratio * np.cos(0.7), -ratio * np.sin(0.7))
    L = float(np.hypot(*D))
    exact_D = [mp.mpf(v) for v in D]
    exact = mp.hypot(exact_D[0] + u[0], exact_D[1] + u[1]) - mp.hypot(*exact_D)
    *_, ours = stretched(np, L, D, u)
    assert abs(ours - float(exact)) <= 4e-16 * abs(float(exact)) + 2e-16 * np.hypot(*u)


@pytest.mark.parametrize("name", ["B1", "B2"])
@pytest.mark.parametrize("form", FORMULATIONS[:6:4], ids=str)
def test_loads_are_continuous_where_an_edge_touches(name, form):
    model = PadModel(name, random_pad(2, theta0=0.0, y0=0.0), form)
    for theta, (inner, outer) in ((0.03, (FULL, LEAD)), (-0.03, (FULL, TRAIL))):
        # heights at which the raised edge, then the lowered one, just touches
        high = model.gaps((0.0, 0.0, theta))
        for gap, pair in ((max(high), (inner, outer)), (min(high), (outer, NONE))):
            q = (0.0, -gap, theta)
            a, b = (model.loads(q, state) for state in pair)
            assert np.max(np.abs(a - b)) < 1e-14


def test_mean_law_gains_energy_round_a_closed_path():
    # k_c / 3 x double integral of p cot(theta) over the enclosed region (Green's theorem)
    w, h = 1.0, 0.35038
    corners = [(-0.05, 0.1), (-0.05, 0.2), (0.05, 0.2), (0.05, 0.1), (-0.05, 0.1)]
    gained = {}
    for law in ("mean", "integral"):
        p = random_pad(1, w=w, h=h, k_c=1.0, mu=0.0, theta0=0.0, y0=0.0, x0=0.0)
        c, line = coefficients(np, p, True), LineContact(law)
        nodes, weights = np.polynomial.legendre.leggauss(40)
        total = 0.0
        for (y0, t0), (y1, t1) in itertools.pairwise(corners):
            s = (nodes + 1) / 2
            q = (0 * s, y0 + s * (y1 - y0), t0 + s * (t1 - t0))
            load = line.loads(c, pose(np, q), LEAD)
            total += np.sum(weights / 2 * (load.y * (y1 - y0) + load.moment * (t1 - t0)))
        gained[law] = total

    def integrand(theta):  # over y from -0.05 to 0.05, of which the integrand is linear
        return 0.1 * (-h + h * mp.cos(theta) + w * mp.sin(theta)) * mp.cot(theta) / 3

    exact = mp.quad(integrand, [0.1, 0.2])
    assert abs(abs(gained["mean"]) - float(exact)) < 1e-14
    assert abs(gained["integral"]) < 1e-15


# Springs along the lower face: each spring by itself, and the line contact as their limit

COUNTS = (2, 3, 4, 7, 16)


def springs(pad, count):
    return PadModel("BN", pad, Formulation(springs=count))


def literal(p, count, q, state):
    """Fx, Fy and moment of the inclined springs and of each spring below, at 50 digits."""
    _, y, theta = (mp.mpf(v) for v in q)
    tilt, n = mp.mpf(p.theta0) + theta, mp.mpf(count)
    fx, fy, moment = spring_loads(p, q)
    for i, touches in enumerate(state):
        along = p.w * (2 * i + 1 - n) / n / mp.sqrt(1 - 1 / n**2)
        foot = (
            along * mp.cos(tilt) + p.h * mp.sin(tilt),
            along * mp.sin(tilt) - p.h * mp.cos(tilt),
        )
        f = -p.k_c / n * (foot[1] + p.y0 + y + p.h) * touches
        fx, fy, moment = fx + p.mu * f, fy + f, moment + foot[0] * f + p.h * p.mu * f
    return [float(fx), float(fy - p.F_n), float(moment)]


@pytest.mark.parametrize("count", COUNTS)
def test_loads_are_the_sum_over_the_springs(count):
    p, r = random_pad(count), np.random.default_rng(count)
    for state in states(count):
        q = r.uniform(-0.1, 0.1, 3)
        ours = springs(p, count).loads(q, state)
        assert ours == pytest.approx(literal(p, count, q, state), rel=1e-12, abs=1e-14)


@pytest.mark.parametrize("count", COUNTS)
def test_full_contact_is_that_of_the_line(count):
    """Same normal stiffness k_c, rotational stiffness k_c w^2/3, loads, signals and energy."""
    p, r = random_pad(count), np.random.default_rng(count)
    one, line = springs(p, count), PadModel("B2", p, CONSISTENT)
    level = springs(p.replace(theta0=0.0, y0=0.0, mu=0.0, k1=0.0, k2=0.0), count)
    by_hand = np.diag([0.0, p.k_c, p.k_c * p.w**2 / 3])
    assert pytest.approx(by_hand, abs=1e-15) == about_origin(level).K
    assert pytest.approx(about_origin(line).K, rel=1e-13, abs=1e-15) == about_origin(one).K
    for _ in range(20):
        q = np.array([r.uniform(-0.1, 0.1), -0.3, r.uniform(-0.1, 0.1)])
        full = one.state_at(q)
        assert all(full)
        assert one.loads(q, full) == pytest.approx(line.loads(q, line.full), rel=1e-13)
        assert signals_of(one, q, full) == pytest.approx(signals_of(line, q, line.full), rel=1e-12)
        energies = [m.energy(q, np.zeros(3), m.full) for m in (one, line)]
        assert energies[0] == pytest.approx(energies[1], rel=1e-13)


def test_partial_contact_converges_to_the_line_with_order_two():
    p, r = random_pad(1), np.random.default_rng(1)
    line = PadModel("B2", p, CONSISTENT)
    q = np.array([0 * r.random(400), r.uniform(-0.05, 0.05, 400), r.uniform(-0.2, 0.2, 400)])
    places = [at for at in q.T if sum(line.state_at(at)) == 1]
    assert len(places) > 100

    def error(count):
        pairs = ([m.loads(at, m.state_at(at)) for m in (springs(p, count), line)] for at in places)
        return max(np.abs(a - b).max() for a, b in pairs)

    errors = np.array([error(count) for count in (8, 16, 32, 64, 128)])
    orders = np.log2(errors[:-1] / errors[1:])
    assert np.all(np.abs(orders - 2.0) < 0.4)
    assert np.mean(orders) == pytest.approx(2.0, abs=0.1)


# Units of order one: by hand, for many pads at once, and refused without a spring


def test_units_follow_stiffness_mass_and_size():
    pad = random_pad(1, m=2.0, w=0.1, k1=3.0, k2=4.0, k3=5.0, k4=6.0, k_c=11.0, F_n=0.9, y0=-0.3)
    for name, y, rest in (("B1", 0.2, 0.05), ("B2", 0.1, 0.3), ("BN", 0.1, 0.3)):
        model = PadModel(name, pad)
        units = natural_units(model, (0.01, 0.2, 0.5, 0, 0, 0))
        assert dataclasses.astuple(units) == pytest.approx((2.0, y, 1.0 / 3.0, 0.1))
        assert natural_units(model, (0.0,) * 6).length == pytest.approx(rest)
        assert natural_units(model, (0, 0, 0, 3.0, 4.0, 0)).length == pytest.approx(5.0 / 3.0)
    assert natural_units(PadModel("B1", pad.replace(F_n=0.0)), (0.0,) * 6).length == 0.1


@pytest.mark.parametrize("name", ["B1", "B2"])
def test_many_pads_have_the_units_of_each(name):
    pads = [random_pad(seed, name) for seed in range(9)]
    pads[1] = pads[1].replace(F_n=0.0)
    initial = np.random.default_rng(0).normal(size=(9, 6)) * 1e-2
    initial[:2] = 0.0
    many = dataclasses.astuple(natural_units(PadModel(name, stack(pads)), initial.T))
    for i, pad in enumerate(pads):
        one = dataclasses.astuple(natural_units(PadModel(name, pad), tuple(initial[i])))
        assert [v[i] for v in many] == pytest.approx(one, rel=1e-15)


# Contact states and transitions against Tables 1 and 2 of the article


def test_states_of_many_points_are_those_of_a_straight_face():
    places = np.linspace(-1, 1, 5)
    lines = np.random.default_rng(0).normal(size=(2000, 2, 1))
    met = {State(*touching) for touching in (lines[:, 0] + lines[:, 1] * places < 0).tolist()}
    assert met == set(states(5))
    assert len(transitions(5)) == 2 * len(states(5))  # a ring
    assert pickle.loads(pickle.dumps(states(5)[3])) == states(5)[3]


def table_2(p, q):
    """State of model B2 by Eq. (12) and Table 2; the level pad by the height of its face."""
    w, h, tilt = p.w, p.h, p.theta0 + q[2]
    X, Y = p.x0 + q[0], p.y0 + q[1]
    left = X - w * np.cos(tilt) + h * np.sin(tilt)
    right = X + w * np.cos(tilt) + h * np.sin(tilt)
    if tilt == 0.0:
        return "FC" if Y < 0.0 else "SS"
    low = Y - w * np.sin(tilt) - h * np.cos(tilt)  # of the leading edge
    lost = left + (-h - low) / np.tan(tilt)
    if left < lost < right:
        return "PC"
    return "FC" if (lost >= right) == (tilt > 0.0) else "SS"


@pytest.mark.parametrize("theta0", [0.0, 0.02, -0.02])
def test_penetrations_tell_the_rows_of_table_2(theta0):
    p = random_pad(4, theta0=theta0)
    model, random, seen = PadModel("B2", p), np.random.default_rng(0), set()
    for tilt in [0.0, *random.uniform(-0.3, 0.3, 300)]:
        q = (random.uniform(-1, 1), random.uniform(-0.3, 0.3), tilt - theta0)
        told = model.state_name(model.state_at(q))
        assert told == table_2(p, q)
        seen.add(told)
    assert seen == {"SS", "PC", "FC"}
