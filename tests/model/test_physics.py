"""Loads, energies and derivatives against literal equations in mpmath, and in any arithmetic."""

import dataclasses
import itertools
import pickle
from typing import Any

import mpmath as mp
import numpy as np
import pytest

from squeal.errors import InputError
from squeal.model import contact
from squeal.model.contact import CONSISTENT, MODELS, STATES, Formulation, contact_law, states
from squeal.model.equations import PadModel, about_origin, linearise, natural_units
from squeal.model.pad import PARAMETERS, Pose, coefficients, pose_of, stretched
from tests import naive
from tests.conftest import HEYOKA, needs_heyoka, random_pad
from tests.naive import spring_loads

if HEYOKA:
    import heyoka as hy

WORDS: Any = itertools.product(*contact.FORMULATION_CHOICES.values())
FORMULATIONS = [Formulation(*words) for words in WORDS]
COUNTS = (2, 3, 4, 7, 16)
LAWS = []
for name, model in MODELS.items():
    for form in FORMULATIONS if "line_force" in model.choices else (CONSISTENT,):
        LAWS.append(contact_law(name, form))
FULL, NONE, LEAD, TRAIL = STATES
# a place in each contact state of B2: q = (x, y, theta), surface at y = -h
PLACES = {
    FULL: (0.013, -0.05, 0.004), LEAD: (-0.02, 0.01, 0.08),
    TRAIL: (0.03, 0.015, -0.09), NONE: (0.01, 0.2, 0.02),
}  # fmt: skip


def springs(pad, count):
    return PadModel("BN", pad, Formulation(springs=count))


def signals_of(model, q, state):
    return model.law.signals(model.c, pose_of(np, tuple(q)), state)


def literal(p, count, q, state):
    """Fx, Fy and moment of the inclined springs and of each spring below, at 50 digits."""
    _, y, theta = (mp.mpf(v) for v in q)
    tilt = mp.mpf(p.theta0) + theta
    n = mp.mpf(count)
    cos = mp.cos(tilt)
    sin = mp.sin(tilt)
    fx, fy, moment = spring_loads(p, q)
    for i, touches in enumerate(state):
        along = p.w * (2 * i + 1 - n) / n / mp.sqrt(1 - 1 / n**2)
        right = along * cos + p.h * sin
        up = along * sin - p.h * cos
        f = -p.k_c / n * (up + p.y0 + y + p.h) * touches
        fx = fx + p.mu * f
        fy = fy + f
        moment = moment + right * f + p.h * p.mu * f
    return fx, fy - p.F_n, moment


def close(ours, exact, tolerance):
    exact = np.array([float(v) for v in exact])
    return np.max(np.abs(np.array(ours) - exact)) <= tolerance * np.max(np.abs(exact))


@pytest.mark.parametrize("state", STATES)
def test_loads_of_points_and_line_are_those_of_the_literal_equations(state):
    for seed, form in enumerate(FORMULATIONS):
        p = random_pad(seed)
        q = PLACES[state]
        assert close(PadModel("B1", p).loads(q, state), naive.b1_loads(p, q, state), 1e-13)
        model = PadModel("B2", p, form)
        assert model.state_at(q) == state
        assert close(model.loads(q, state), naive.b2_loads(p, form, q, state), 1e-12)
        if state != NONE:
            for name in ("B1", "B2"):
                ours = -linearise(PadModel(name, p, form), q, state).K
                rows = naive.jacobian(name, p, form, q, state)
                assert close(ours.ravel(), itertools.chain(*rows), 1e-11)
            exact = [float(v) for v in naive.line_reaction(p, form, q, state)]
            assert signals_of(model, q, state) == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("count", COUNTS)
def test_loads_of_springs_are_the_sum_over_them(count):
    p = random_pad(count)
    r = np.random.default_rng(count)
    for state in states(count):
        q = r.uniform(-0.1, 0.1, 3)
        assert close(springs(p, count).loads(q, state), literal(p, count, q, state), 1e-12)


@pytest.mark.parametrize("law", LAWS, ids=str)
@needs_heyoka
def test_one_formula_serves_all_states_at_once(law):
    """States as arrays and as symbols against states as constants, in 30 digits."""
    pad = random_pad(5)
    r = np.random.default_rng(3)
    known = states(law.points)
    q = r.uniform(-0.1, 0.1, (3, len(known)))
    on = np.array(known, dtype=float).T
    c = coefficients(np, pad, law.absolute_gap)
    at = pose_of(np, tuple(q))
    symbols = hy.make_vars("x", "y", "theta", *(f"on{i}" for i in range(law.points)))
    symbolic = pose_of(hy, symbols[:3])
    outputs = [*law.loads(c, symbolic, symbols[3:]), law.energy(c, symbolic, symbols[3:])]
    compiled = hy.cfunc(outputs, symbols)(np.concatenate([q, on]))
    with np.errstate(all="ignore"):
        loads = np.array([*law.loads(c, at, on), law.energy(c, at, on)])
        places = np.array([*law.signals(c, at, on), *law.resultant(c, at, on)])
    with mp.workdps(30):
        exact = coefficients(mp, pad, law.absolute_gap)
        for i, state in enumerate(known):
            here = pose_of(mp, tuple(map(mp.mpf, q[:, i])))
            every = [*law.loads(exact, here, state), law.energy(exact, here, state)]
            expected = [float(v) for v in every]
            for found in (loads, compiled):
                assert found[:, i] == pytest.approx(expected, rel=1e-12, abs=1e-16)
            if any(state):
                given = [*law.signals(exact, here, state), *law.resultant(exact, here, state)]
                exactly = [float(v) for v in given]
                assert places[:, i] == pytest.approx(exactly, rel=1e-11, nan_ok=True)
            else:
                assert expected == [0.0] * 4
                is_force = [signal.is_force for signal in law.plotted]
                assert np.isfinite(places[:, i]).tolist() == [*is_force, True, False]


def test_forces_derive_from_the_energy():
    """Without friction, in the laws that have a potential."""
    pad = random_pad(2, mu=0.0)
    for law in (contact_law(n, CONSISTENT) for n in MODELS):
        c = coefficients(np, pad, law.absolute_gap)
        for state in states(law.points):
            q = np.array([0.01, -0.02, 0.03 if state[-1] else -0.03])
            at = pose_of(np, tuple(q[:, None] + 1e-200j * np.eye(3)))
            slope = law.energy(c, at, state).imag * 1e200 * np.ones(3)
            loads = law.loads(c, pose_of(np, tuple(q)), state)
            assert -slope == pytest.approx(loads, rel=1e-10, abs=1e-15)


def test_each_model_uses_the_stiffnesses_of_its_law():
    used = {}
    for name, model in MODELS.items():
        used[name] = {parameter for parameter in PARAMETERS if model.uses(parameter)}
    of_motion = {"L1", "L2", "F_n", "V", "mu_s", "mu_k", "v_ref", "x0", "y0"}
    assert used["B2"] - used["B3"] == of_motion
    assert used["BN"] == used["B2"]
    assert used["B1"] ^ used["B2"] == {"k3", "k4", "k_c"}
    with pytest.raises(InputError, match="'B9' is not allowed"):
        contact_law("B9")


@pytest.mark.parametrize("ratio", [1e-2, 1.0, 1e4, 1e8])
def test_elongation_keeps_its_digits(ratio):
    u = (3.1e-5, -4.7e-5)
    D = (-ratio * np.cos(0.7), -ratio * np.sin(0.7))
    L = float(np.hypot(*D))
    exact_D = [mp.mpf(v) for v in D]
    exact = mp.hypot(exact_D[0] + u[0], exact_D[1] + u[1]) - mp.hypot(*exact_D)
    *_, ours = stretched(np, L, D, u)
    assert abs(ours - float(exact)) <= 4e-16 * abs(float(exact)) + 2e-16 * np.hypot(*u)


@pytest.mark.parametrize("force", ["integral", "mean"])
def test_delta_has_its_limit_where_contact_is_lost(force):
    c = coefficients(np, random_pad(1, theta0=0.0, y0=0.0), True)
    at = Pose(0.0, -0.1 * c.rlx, 0.1, 0.0)  # the leading edge at height zero, the other above
    law = contact_law("B2", Formulation(force))
    assert law.resultant(c, at, LEAD) == (0.0, pytest.approx(at.x_offset(c.rlx, c.rly), rel=1e-15))


# Springs along the lower face, and the line contact as their limit


@pytest.mark.parametrize("count", COUNTS)
def test_full_contact_is_that_of_the_line(count):
    """Same normal stiffness k_c, rotational stiffness k_c w^2/3, loads, signals and energy."""
    p = random_pad(count)
    r = np.random.default_rng(count)
    one = springs(p, count)
    line = PadModel("B2", p, CONSISTENT)
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
    p = random_pad(1)
    r = np.random.default_rng(1)
    line = PadModel("B2", p, CONSISTENT)
    q = np.array([0 * r.random(400), r.uniform(-0.05, 0.05, 400), r.uniform(-0.2, 0.2, 400)])
    places = [at for at in q.T if sum(line.state_at(at)) == 1]
    assert len(places) > 100

    def error(count):
        points = springs(p, count)
        greatest = 0.0
        for at in places:
            of_points = points.loads(at, points.state_at(at))
            of_line = line.loads(at, line.state_at(at))
            greatest = max(greatest, np.abs(of_points - of_line).max())
        return greatest

    errors = np.array([error(count) for count in (8, 16, 32, 64, 128)])
    orders = np.log2(errors[:-1] / errors[1:])
    assert np.all(np.abs(orders - 2.0) < 0.4)
    assert np.mean(orders) == pytest.approx(2.0, abs=0.1)


def test_units_follow_stiffness_mass_and_size():
    pad = random_pad(1, m=2.0, w=0.1, k1=3.0, k2=4.0, k3=5.0, k4=6.0, k_c=11.0, F_n=0.9, y0=-0.3)
    for name, y, rest in (("B1", 0.2, 0.05), ("B2", 0.1, 0.3), ("BN", 0.1, 0.3)):
        model = PadModel(name, pad)
        units = natural_units(model, (0.01, 0.2, 0.5, 0, 0, 0))
        assert dataclasses.astuple(units) == pytest.approx((2.0, y, 1.0 / 3.0, 0.1))
        assert natural_units(model, (0.0,) * 6).length == pytest.approx(rest)
        assert natural_units(model, (0, 0, 0, 3.0, 4.0, 0)).length == pytest.approx(5.0 / 3.0)
    loads = np.array([0.0, 0.9])  # of many pads each has its own
    many = natural_units(PadModel("B1", pad.replace(F_n=loads)), (0.0,) * 6)
    assert many.length == pytest.approx([0.1, 0.05])


def test_states_of_many_points_are_those_of_a_straight_face():
    places = np.linspace(-1, 1, 5)
    lines = np.random.default_rng(0).normal(size=(2000, 2, 1))
    below = (lines[:, 0] + lines[:, 1] * places < 0).tolist()
    met = {contact.State(*touching) for touching in below}
    assert met == set(states(5))
    neighbours = [state.flip(i) for state in states(5) for i in range(5)]
    assert sum(one in states(5) for one in neighbours) == 2 * len(states(5))  # a ring
    assert pickle.loads(pickle.dumps(states(5)[3])) == states(5)[3]


def table_2(p, q):
    """State of model B2 by Eq. (12) and Table 2; the level pad by the height of its face."""
    w = p.w
    h = p.h
    tilt = p.theta0 + q[2]
    X = p.x0 + q[0]
    Y = p.y0 + q[1]
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
    model = PadModel("B2", p)
    random = np.random.default_rng(0)
    seen = set()
    for tilt in [0.0, *random.uniform(-0.3, 0.3, 300)]:
        q = (random.uniform(-1, 1), random.uniform(-0.3, 0.3), tilt - theta0)
        told = model.state_name(model.state_at(q))
        assert told == table_2(p, q)
        seen.add(told)
    assert seen == {"SS", "PC", "FC"}
