"""Forces, penetrations, energies and derivatives against the literal equations in mpmath."""

import itertools
from typing import Any

import mpmath as mp
import numpy as np
import pytest

from squeal.article.equations import bounds, rank, stiffness
from squeal.model.contact import (
    FORMULATION_CHOICES,
    FULL,
    LEAD,
    NONE,
    STATES,
    TRAIL,
    Formulation,
    LineContact,
)
from squeal.model.equations import PadModel, about_origin
from squeal.model.pad import coefficients, elongation, pose
from tests import naive
from tests.conftest import random_pad

WORDS: Any = itertools.product(*FORMULATION_CHOICES.values())
FORMULATIONS = [Formulation(*words) for words in WORDS]
# a place in each contact state of B2: q = (x, y, theta), surface at y = -h
PLACES = {
    FULL: (0.013, -0.05, 0.004),
    LEAD: (-0.02, 0.01, 0.08),
    TRAIL: (0.03, 0.015, -0.09),
    NONE: (0.01, 0.2, 0.02),
}


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
                model.signals(q, state), [float(v) for v in signals], rtol=1e-12, atol=0
            )


@pytest.mark.parametrize("name", ["B1", "B2"])
@pytest.mark.parametrize("state", [FULL, LEAD, TRAIL])
def test_jacobian(name, state):
    for seed, form in enumerate(FORMULATIONS[:4]):
        p, q = random_pad(seed), PLACES[state]
        ours = PadModel(name, p, form).jacobian(q, state)
        assert close(ours.ravel(), naive.jacobian(name, p, form, q, state), 1e-11)


@pytest.mark.parametrize("ratio", [1e-2, 1.0, 1e4, 1e8])
def test_elongation_keeps_its_digits(ratio):
    u = (3.1e-5, -4.7e-5)
    D = (-ratio * np.cos(0.7), -ratio * np.sin(0.7))
    L = float(np.hypot(*D))
    exact_D = [mp.mpf(v) for v in D]
    exact = mp.hypot(exact_D[0] + u[0], exact_D[1] + u[1]) - mp.hypot(*exact_D)
    ours = elongation(np, L, D, u)
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


def eq_22(p, printed):
    """The nine entries of Eq. (22), copied from the article entry by entry."""
    k1, k2, a1, a2, t0 = p.k1, p.k2, p.alpha1, p.alpha2, p.theta0
    d, b = np.hypot(p.w, p.h), np.arcsin(p.h / np.hypot(p.w, p.h))
    s, c = np.sin, np.cos
    K12 = k1 * s(a1) * c(a1) - k2 * s(a2) * c(a2)
    K13 = -d * k1 * c(a1) * s(a1 + b - t0) - d * k2 * c(a2) * s(a2 + b + t0)
    K23 = -d * k1 * s(a1) * s(a1 + b - t0) + d * k2 * s(a2) * s(a2 + b + t0)
    K33 = d**2 * k1 * s(a1 + b - t0) * (s(b - t0) * c(a1) + c(b - t0) * s(a1))
    if not printed:
        K33 += d**2 * k2 * s(a2 + b + t0) ** 2
    K11, K22 = k1 * c(a1) ** 2 + k2 * c(a2) ** 2, k1 * s(a1) ** 2 + k2 * s(a2) ** 2
    return np.array([[K11, K12, K13], [K12, K22, K23], [K13, K23, K33]])


def test_stiffness_is_eq_22_and_the_derivative_of_the_forces():
    for seed in range(50):
        p = random_pad(seed)
        K = stiffness(p)
        scale = np.abs(K).max()
        assert np.abs(K - eq_22(p, printed=False)).max() < 1e-14 * scale
        assert np.abs(stiffness(p, printed=True) - eq_22(p, printed=True)).max() < 1e-14 * scale
        springs_only = PadModel("B1", p).jacobian(np.zeros(3), NONE)
        assert np.abs(K + springs_only).max() < 1e-13 * scale


def test_exact_stiffness_is_singular_and_the_printed_one_is_not():
    for seed in range(200):
        p = random_pad(seed)
        assert rank(p, stiffness(p)) <= 2
        # printed determinant: -d^2 k1 k2^2 sin^2(alpha1 + alpha2) sin^2(alpha2 + beta + theta0)
        d2, beta = p.w**2 + p.h**2, np.arctan2(p.h, p.w)
        sines = np.sin(p.alpha1 + p.alpha2) * np.sin(p.alpha2 + beta + p.theta0)
        expected = -d2 * p.k1 * p.k2**2 * sines**2
        printed = stiffness(p, printed=True)
        assert abs(np.linalg.det(printed) - expected) < 1e-12 * np.abs(printed).max() ** 3
        assert rank(p, printed) == 3 or abs(sines) < 1e-6


def test_bounds_follow_from_the_rows_of_eq_21():
    for seed in range(100):
        p = random_pad(seed)
        K, found = stiffness(p), bounds(p)
        # rows 1 and 2, then 3 and 2, for (x, Rn) with y = theta = delta = 0
        reactions = [
            np.linalg.solve([[K[i, 0], -f * p.mu], [K[1, 0], -1.0]], [0.0, -p.F_n])[1]
            for i, f in ((0, 1.0), (2, p.h))
        ]
        assert bool(found.sign_aware) == all(R > 0 for R in reactions)
        assert found.bound_23a == pytest.approx(K[0, 0] / K[1, 0], rel=1e-12)
        assert found.bound_23b == pytest.approx(K[2, 0] / (p.h * K[1, 0]), rel=1e-12)
        assert bool(found.as_printed) == (p.mu < min(found.bound_23a, found.bound_23b))


def test_origin_linearisation_adds_contact_and_friction_to_eq_22():
    p = random_pad(3, theta0=0.0, y0=0.0)
    K = about_origin(PadModel("B3", p)).K
    # by hand: Rn = -k_c y, its moment -k_c w^2 theta / 3 and friction mu Rn at height -h
    contact = p.k_c * np.array([[0, p.mu, 0], [0, 1, 0], [0, p.mu * p.h, p.w**2 / 3]])
    assert np.abs(K - stiffness(p) - contact).max() < 1e-13
