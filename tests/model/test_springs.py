"""Springs along the lower face: each spring by itself, and the line contact as their limit."""

import mpmath as mp
import numpy as np
import pytest

from squeal.model.contact import CONSISTENT, Formulation, states
from squeal.model.equations import PadModel, about_origin
from tests.conftest import random_pad
from tests.naive import spring_loads

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
        assert one.signals(q, full) == pytest.approx(line.signals(q, line.full), rel=1e-12)
        energies = [m.energy(q, np.zeros(3), m.full) for m in (one, line)]
        assert energies[0] == pytest.approx(energies[1], rel=1e-13)


def test_partial_contact_converges_to_the_line_with_order_two():
    p, r = random_pad(1), np.random.default_rng(1)
    line = PadModel("B2", p, CONSISTENT)
    q = np.array([0 * r.random(400), r.uniform(-0.05, 0.05, 400), r.uniform(-0.2, 0.2, 400)])
    partial = [i for i in range(400) if sum(line.state_at(q[:, i])) == 1]
    assert len(partial) > 100

    def error(count):
        model = springs(p, count)
        pairs = ((model.physical_loads(q[:, i]), line.physical_loads(q[:, i])) for i in partial)
        return max(np.abs(a - b).max() for a, b in pairs)

    errors = np.array([error(count) for count in (8, 16, 32, 64, 128)])
    orders = np.log2(errors[:-1] / errors[1:])
    assert np.all(np.abs(orders - 2.0) < 0.4)
    assert np.mean(orders) == pytest.approx(2.0, abs=0.1)
