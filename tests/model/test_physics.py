"""Forces, penetrations, energies and derivatives against the literal equations in mpmath."""

import itertools
from typing import Any

import mpmath as mp
import numpy as np
import pytest

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
from squeal.model.equations import PadModel
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
