"""Separation and damping that stop a growing mode, against closed forms of two coupled modes."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.sparse import csc_array

import squeal
from squeal.queries.remedies.meetings import Cure

pytestmark = pytest.mark.usefixtures("coarse_charts", "without_proof")
LOWER, UPPER = 400.0, 420.0  # rad/s
FORCE = 12_000.0  # of friction: the pair has met where it is above half of what squares differ by
FRICTION = np.array([[0.0, FORCE], [-FORCE, 0.0]])


def pair(*damping):
    """Two modes with damping in 1/s that friction couples."""
    K = {"1": np.diag([LOWER**2, UPPER**2]), "mu": FRICTION}
    return squeal.System(np.eye(2), np.diag(damping), K, parameters={"mu": 1.0})


def meeting_of(system):
    """The real modes behind the one growing mode."""
    (meeting,) = squeal.report(system).meetings.values()
    return meeting


def cures_of(system):
    meeting = meeting_of(system)
    assert meeting.hertz == pytest.approx((LOWER / math.tau, UPPER / math.tau))
    return meeting.cures


def hurwitz(lower, upper):
    """Positive where (s^2 + lower s + a) (s^2 + upper s + b) + FORCE^2 has no growing root."""
    a, b = LOWER**2, UPPER**2
    a3, a2 = lower + upper, a + b + lower * upper
    a1, a0 = lower * b + upper * a, a * b + FORCE**2
    return a1 * (a3 * a2 - a1) - a3**2 * a0


@pytest.mark.parametrize("n", [12, 13])
def test_a_pair_of_few_sparse_rows_has_its_meeting(n):
    squares = np.arange(1.0, n + 1.0) ** 2
    squares[:2] = LOWER**2, UPPER**2
    friction = np.zeros((n, n))
    friction[:2, :2] = FRICTION
    K = {"1": csc_array(np.diag(squares)), "mu": csc_array(friction)}
    C = csc_array(1e-3 * np.eye(n))
    cures_of(squeal.System(csc_array(np.eye(n)), C, K, parameters={"mu": 1.0}))


def test_the_separation_of_an_undamped_pair_is_that_of_equal_squares():
    """It grows while the squares differ by less than twice the force."""
    cures = cures_of(pair(0.0, 0.0))
    needed = (math.sqrt(LOWER**2 + 2.0 * FORCE) - UPPER) / math.tau
    assert needed <= cures[Cure.APART] <= 1.08 * needed


def test_damping_of_one_undamped_mode_alone_never_helps():
    """Its Hurwitz determinant is -(c FORCE)^2."""
    assert hurwitz(3.0, 0.0) == pytest.approx(-((3.0 * FORCE) ** 2), rel=1e-6)
    cures = cures_of(pair(0.0, 0.0))
    assert Cure.LOWER not in cures
    assert Cure.UPPER not in cures
    needed = brentq(lambda zeta: hurwitz(2 * zeta * LOWER, 2 * zeta * UPPER), 1e-3, 0.2)
    assert needed <= cures[Cure.BOTH] <= 1.08 * needed


def test_damping_of_one_mode_is_that_of_hurwitz():
    damping = 12.0
    cures = cures_of(pair(damping, damping))
    assert hurwitz(damping, damping) < 0.0
    lower = brentq(lambda zeta: hurwitz(damping + 2 * zeta * LOWER, damping), 0.0, 0.25)
    upper = brentq(lambda zeta: hurwitz(damping, damping + 2 * zeta * UPPER), 0.0, 0.25)
    assert lower <= cures[Cure.LOWER] <= 1.08 * lower
    assert upper <= cures[Cure.UPPER] <= 1.08 * upper
    assert cures[Cure.BOTH] < min(lower, upper)


def test_damping_of_a_whirl_is_enough_at_lower_speeds_that_need_more():
    """2 (h - d) of lambda^2 + 2 d lambda + 1 = 2 i h: h is highest at 1, well below the speed."""
    skew = np.array([[0.0, 1.0], [-1.0, 0.0]])
    K = {"1": np.eye(2), "0.2*speed/(1 + speed**2)": skew}
    system = squeal.System(np.eye(2), 0.02 * np.eye(2), K, {"speed": 4.0}, "speed")
    report = squeal.report(system, 5.0)
    (meeting,) = report.meetings.values()

    def damping(speed):
        """Share of critical damping at which z'' + c z' + (1 - i k) z = 0 is at its limit."""
        return 0.5 * 0.2 * speed / (1.0 + speed**2) - 0.01

    assert damping(1.0) > 2.0 * damping(4.0)
    assert damping(4.0) * 0.99 < meeting.cures[Cure.BOTH] < 1.08 * damping(4.0)
    assert damping(1.0) * 0.99 < meeting.advised[Cure.BOTH] < 1.08 * damping(1.0)
    assert "nothing grows up to speed = 5, where the search ends" in report.advice
    assert "stationary" not in report.advice  # nothing is known to turn


@pytest.mark.parametrize("ratios", [(0.001, 0.004), (0.004, 0.001)])
def test_modes_of_unlike_damping_meet_where_undamped_ones_coalesce(ratios):
    """Undamped they coalesce at mu = 0.3; with unlike damping growth begins at 0.24."""
    omega = math.tau * np.array([2000.0, 2100.0])
    force = (omega[1] ** 2 - omega[0] ** 2) / 2.0 / 0.3
    K = {"1": np.diag(omega**2), "mu": force * np.array([[0.0, 1.0], [-1.0, 0.0]])}
    C = np.diag(2.0 * np.array(ratios) * omega)
    report = squeal.report(squeal.System(np.eye(2), C, K, parameters={"mu": 0.5}))
    (group,) = report.paths.groups
    assert report.paths.meeting(group) == pytest.approx(0.3, rel=0.02)


def test_a_mode_without_a_partner_is_damped_alone():
    """x'' - 0.02 x' + x = 0 beside a damped mode: 1 % of critical damping are missing."""
    K = {"1": np.diag([1.0, 1.44]), "mu": np.zeros((2, 2))}
    lonely = squeal.System(np.eye(2), np.diag([-0.02, 0.02]), K, parameters={"mu": 1.0})
    meeting = meeting_of(lonely)
    assert meeting.hertz == pytest.approx([1.0 / math.tau])
    assert set(meeting.cures) == {Cure.BOTH}
    assert 0.01 <= meeting.cures[Cure.BOTH] <= 0.0111


def test_slow_whirl_that_nothing_damps_is_stopped_by_damping():
    """z'' - i g z' + (1 - i k) z = 0: gyroscopic forces beside cross-coupled stiffness of 2e-8 are
    not undamped, and growth of 8e-9 of the frequency is growth."""
    skew = np.array([[0.0, 1.0], [-1.0, 0.0]])
    K = {"1": np.eye(2) + 2e-8 * skew, "mu": np.zeros((2, 2))}
    rotor = squeal.System(np.eye(2), 0.5 * skew, K, parameters={"mu": 1.0})
    (mode,) = squeal.eigenvalues(rotor).unstable
    meeting = meeting_of(rotor)
    growth = np.roots([1.0, -0.5j, 1.0 - 2e-8j]).real.max()
    assert mode.growth_rate == pytest.approx(growth, rel=1e-3)
    share = meeting.cures[Cure.BOTH]
    assert np.roots([1.0, 2.0 * share - 0.5j, 1.0 - 2e-8j]).real.max() < 0.0
    assert share <= 2.0**-17 / 250.0  # no smaller share is told apart


def test_growth_below_the_rounding_of_the_search_has_no_cure_and_a_report():
    """A mode grows by 5e-11 of its frequency, by its own damping: no amount of zero is advised."""
    K = {"1": np.diag([1.0, 4.0]), "mu": np.array([[0.0, 0.1], [-0.1, 0.0]])}
    weak = squeal.System(np.eye(2), np.diag([-1e-10, 0.1]), K, parameters={"mu": 1e-6})
    report = squeal.report(weak)
    assert report.eigenvalues.verdict == "flutter"
    assert all(not meeting.cures for meeting in report.meetings.values())
    assert report.advice == "No way out is known to this page."


def test_damping_of_one_mode_that_stops_growth_up_to_less_is_left_out():
    """With 24 % for the lower mode alone flutter begins at 1.06, with damping of both at 1.11."""
    omega = np.array([1.0292760289563865, 1.102746986890841])
    b = 0.0904357079738508
    C = np.diag([0.015262570650881064, 0.013957871413661628])
    K = {"1": np.diag(omega**2), "mu": [[0.0, b], [-b, 0.0]]}
    meeting = meeting_of(squeal.System(np.eye(2), C, K, parameters={"mu": 1.0}))
    assert Cure.BOTH in meeting.advised
    assert meeting.alone is None
