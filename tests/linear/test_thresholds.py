"""Thresholds against closed forms, 30-digit solutions and the loop of python-control."""

import numpy as np
import pytest

from squeal.errors import InputError
from squeal.linear import Batched, thresholds, verdict

I2, I3 = np.eye(2), np.eye(3)


def _kinds(points):
    return [p.kind for p in points]


def test_frequencies_that_cross_are_no_threshold():
    assert thresholds(lambda mu: (I2, None, np.diag([1 + mu, 2.0])), 3.0).points == []
    assert verdict(I2, None, 2 * I2) == "marginal"


def test_exchange_of_growth_rates():
    # flutter pair 2 +- i grows at g; the real mode -mu overtakes it at mu = g^2
    growth = abs(np.sqrt(-(2 + 1j)).real)
    K = np.zeros((3, 3))
    K[:2, :2] = [[2, 1], [-1, 2]]

    def system(mu):
        K[2, 2] = -mu
        return I3, None, K.copy()

    (point,) = thresholds(system, 1.0).points
    assert point.kind == "divergence"
    assert point.mu == pytest.approx(growth**2, rel=1e-12)
    (back,) = thresholds(lambda mu: system(1.0 - mu), 1.0).points
    assert back.kind == "flutter"
    assert back.frequency_hz == pytest.approx(abs(np.sqrt(-(2 + 1j)).imag) / (2 * np.pi))


def test_short_exchange_of_growth_rates():
    # the real mode's s = -g^2 + ((mu - 0.5)^2 - width^2) leads for 2 width only
    growth, width = abs(np.sqrt(-(2 + 1j)).real), 2e-3

    def system(mu):
        K = np.zeros((3, 3))
        K[:2, :2] = [[2, 1], [-1, 2]]
        K[2, 2] = (mu - 0.5) ** 2 - width**2 - growth**2
        return I3, None, K

    points = thresholds(system, 0.8).points
    assert _kinds(points) == ["divergence", "flutter"]
    assert [p.mu for p in points] == pytest.approx([0.5 - width, 0.5 + width], rel=1e-10)


def test_jump_at_a_breakpoint(mode_coupling):
    def system(mu):
        return mode_coupling(mu if mu < 0.5 else 2 * mu)

    points = thresholds(system, 2.0, breakpoints=[0.5, 1.2]).points
    assert [(p.mu, p.kind, p.interval) for p in points] == [(0.5, "flutter", (0.5, 0.5))]
    growing = abs(np.sqrt(-(2 + 1j / np.sqrt(3))).imag)  # at mu = 1, just above the jump
    assert points[0].frequency_hz == pytest.approx(growing / (2 * np.pi), rel=1e-9)
    quiet = thresholds(lambda mu: mode_coupling(mu / 4), 2.0, breakpoints=[1.0]).points
    assert quiet == []


def test_zero_roots_for_all_mu():
    chain = np.array([[1.0, -1, 0], [-1, 2, -1], [0, -1, 1]])
    skew = np.array([[0.0, 1, -1], [-1, 0, 1], [1, -1, 0]])
    (point,) = thresholds(lambda mu: (I3, None, chain + mu * skew), 3.0).points
    assert point.kind == "flutter"
    assert point.mu == pytest.approx(1 / np.sqrt(3), rel=1e-12)
    assert point.frequency_hz == pytest.approx(np.sqrt(2) / (2 * np.pi), rel=1e-12)


@pytest.mark.parametrize("n", [2, 4])
def test_damped_thresholds_follow_routh_and_hurwitz(n):
    # drum brake of Hulten's form, see literature.py; further damped modes change nothing
    w1, w2, c1, c2 = 4.0, 3.0, 0.08, 0.12
    a3, a2, a1 = c1 + c2, w1**2 + w2**2 + c1 * c2, c1 * w2**2 + c2 * w1**2
    expected = np.sqrt(a1 * (a2 * a3 - a1) / (a3 * w1 * w2) ** 2 - 1)

    def system(mu):
        K = np.diag([w1**2, w2**2, 31.0, 47.0])[:n, :n]
        K[0, 1], K[1, 0] = -mu * w2**2, mu * w1**2
        return np.eye(n), np.diag([c1, c2, 0.3, 0.4])[:n, :n], K

    (point,) = thresholds(system, 1.0).points
    assert point.kind == "flutter"
    assert point.mu == pytest.approx(expected, rel=1e-11)
    assert point.frequency_hz == pytest.approx(np.sqrt(a1 / a3) / (2 * np.pi), rel=1e-11)


def test_mode_that_damping_spares(mode_coupling):
    # equal damping c shifts the threshold: Re = 0 where |Im s| = c omega; the third mode stays
    c = 0.1

    def system(mu):
        K = np.zeros((3, 3))
        K[:2, :2], K[2, 2] = mode_coupling(mu)[2], 7.0
        return I3, np.diag([c, c, 0.0]), K

    # lambda^2 + c lambda + 2 - i e = 0 with lambda = i omega: omega^2 = 2, e = c omega
    expected = 0.75 * (1 + 2 * c**2)
    (point,) = thresholds(system, 2.0).points
    assert point.mu == pytest.approx(expected, rel=1e-9)
    assert point.frequency_hz == pytest.approx(np.sqrt(2) / (2 * np.pi), rel=1e-9)


@pytest.mark.parametrize("mu_max", [0.0, -1.0, np.inf, np.nan])
def test_empty_ranges_are_refused(mode_coupling, mu_max):
    with pytest.raises(InputError, match="mu_max"):
        thresholds(mode_coupling, mu_max)


def test_a_batched_system_is_asked_together_and_tells_the_same(rng):
    asked = []

    def pad(mu):
        M, K0, K1 = np.eye(3), np.diag([1.0, 2.0, 4.0]), np.zeros((3, 3))
        K1[0, 1], K1[1, 0] = 1.0, -1.0
        return M, None, K0 + mu * K1

    def many(mus):
        asked.append(len(mus))
        return [pad(mu) for mu in mus]

    alone, together = thresholds(pad, 2.0).points, thresholds(Batched(pad, many), 2.0).points
    assert together == alone
    assert alone[0].mu == pytest.approx(0.5, rel=1e-12)  # where (2 - 1)^2 = 4 mu^2
    assert max(asked) > 10
