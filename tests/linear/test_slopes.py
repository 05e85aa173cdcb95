"""Slopes of all roots against differences, where every matrix moves; where roots are expected."""

import numpy as np
import pytest

from squeal.linear.continuation import Continuation
from squeal.linear.event_guesses import guesses_of
from squeal.linear.events import bracket_by_sign
from squeal.linear.local_roots import roots_near
from squeal.linear.roots import square_roots
from squeal.linear.steps import Step, near_coalescences

H = 1e-6


@pytest.mark.parametrize("form", ["undamped", "gyroscopic", "damped"])
@pytest.mark.parametrize("n", [3, 6])
def test_slopes_are_those_of_differences(form, n, rng):
    X, Y, Z, W = rng.normal(size=(4, n, n))
    skew = W - W.T
    full = 0.1 * W

    def system(p):
        M = np.eye(n) + 0.1 * (X + X.T) / n + p * np.diag(np.arange(n) / n)
        K = np.diag(np.arange(1.0, n + 1) ** 2) + p * (Y + Y.T) / n
        if form == "undamped":
            return M, None, K
        if form == "gyroscopic":
            return M, (1 + p) * skew, K
        return M, full + p * Z, K + 0.1 * Z

    along = Continuation(system, 0.0, 1.0)
    assert along.problem == form
    at = along.at(0.4)
    up = along.at(0.4 + H)
    down = along.at(0.4 - H)
    nearest = [s.z[np.argmin(np.abs(s.z - at.z[:, None]), axis=1)] for s in (up, down)]
    slopes = (nearest[0] - nearest[1]) / (2 * H)
    assert at.slopes == pytest.approx(slopes, abs=1e-7 * np.abs(slopes).max())


def _between(matrices, low, high):
    along = Continuation(matrices, -9.0, 9.0)
    step = Step(along.at(low), along.at(high))
    return along, guesses_of(step, False, False)[0]


@pytest.mark.parametrize("low", [-0.7, -0.2])
def test_two_roots_that_meet_in_a_step_are_expected_where_they_do(low):
    """1 -+ sqrt(p) of an undamped pair meet at p = 0, and one is zero at p = 1."""
    along, found = _between(
        lambda p: (np.eye(2), np.zeros((2, 2)), np.array([[1.0, p], [1.0, 1.0]])), low, 1.4
    )
    assert along.problem == "undamped"
    met = [g for g in found if g.coalesces]
    assert [g.value for g in met] == pytest.approx([0.0], abs=0.011 * (1.4 - low))
    assert [g.z for g in met] == pytest.approx([1.0])
    zero = [g.value for g in found if not g.coalesces]
    assert zero == pytest.approx([1.0] * len(zero), abs=0.011 * (1.4 - low))
    assert zero


@pytest.mark.parametrize("damping", [0.4, -0.4])
def test_one_of_two_roots_that_meet_in_a_step_passes_zero_where_it_does(damping):
    """lambda^2 + c lambda + p: a pair that becomes real and of which one is zero at p = 0."""
    C = np.array([[damping]])
    along, found = _between(lambda p: (np.eye(1), C, np.array([[p]])), -1, 1)
    assert along.problem == "damped"
    assert [g.value for g in found] == pytest.approx([0.0], abs=0.021)


def test_rounding_of_square_roots_is_how_far_rounding_moves_them():
    s = np.array([4.0, -9.0, 3.0 - 4.0j])
    r = np.full(3, 1e-7)
    turned = np.exp(1j * np.linspace(0.0, 2 * np.pi, 181))[:, None] * r
    roots, rounding = square_roots(s, r)
    moved = np.sqrt(-(s + turned) + 0j)
    away = np.minimum(np.abs(moved - roots), np.abs(moved + roots))
    assert roots**2 == pytest.approx(-s)
    assert (roots.real >= 0).all()
    assert rounding == pytest.approx(away.min(axis=0), rel=1e-6)
    assert square_roots(np.zeros(1, dtype=complex), np.full(1, 1e-8))[1] == pytest.approx(1e-4)


@pytest.mark.parametrize("form", ["undamped", "gyroscopic", "damped"])
@pytest.mark.parametrize(("count", "meets"), [(1, False), (2, False), (2, True)])
def test_what_vanishes_at_an_event_has_the_slope_of_differences(form, count, meets, rng):
    X, Y, W = rng.normal(size=(3, 5, 5))

    def system(p):
        K = np.diag([4.0, 4.3, 9.0, 16.0, 25.0]) + 0.1 * p * (X + X.T)
        if form == "gyroscopic":
            return np.eye(5), W - W.T, K
        C = None if form == "undamped" else 0.3 * W + p * X
        return np.eye(5), C, K + 0.1 * p * Y

    along = Continuation(system, 0.0, 1.0)
    assert along.problem == form
    state = along.at(0.4)
    apart = np.abs(state.z[:, None] - state.z) + np.diag(np.full(along.size, np.inf))
    both = list(np.unravel_index(np.argmin(apart), apart.shape))[:count]
    vectors = state.right[:, both], state.left[:, both]
    at = roots_near(along, 0.4, complex(state.z[both].mean()), *vectors)
    value, slope, *_ = at.event_function(meets)
    up = at.at(along, 0.4 + H).event_function(meets)[0]
    down = at.at(along, 0.4 - H).event_function(meets)[0]
    assert slope == pytest.approx((up - down) / (2 * H), rel=1e-6, abs=1e-9)
    z = state.z[both]
    if not meets:  # the real part, or the product of both times what does not vanish
        rest = 1.0 if count == 1 else -(z.mean().real ** 2 + (z[0] - z[1]).imag ** 2 / 4)
        assert value == pytest.approx(z.real.prod() * rest, rel=1e-9)
    else:
        assert value == pytest.approx((((z[0] - z[1]) / 2) ** 2).real, rel=1e-9)


@pytest.mark.parametrize("half", [1e-12, 1e-6, 1e-2])
@pytest.mark.parametrize("way", [-1, 1])
def test_a_sign_is_certain_next_to_where_rounding_ends(half, way):
    """Its distance is known to a factor of two; what reaches beyond the range ends with it."""

    def sign(x, hidden=1e-4):
        return way * int(np.sign(x - 0.3)) if abs(x - 0.3) > hidden else 0

    low, high, rise = bracket_by_sign(sign, (0.3, 0.3), half, 0.0, 1.0)
    assert rise == way
    assert 1e-4 < 0.3 - low <= 2e-4
    assert 1e-4 < high - 0.3 <= 2e-4
    assert bracket_by_sign(sign, (0.3, 0.3), half, 0.29995, 1.0) == (0.29995, high, way)
    assert bracket_by_sign(lambda x: abs(sign(x)), (0.3, 0.3), half, 0.0, 1.0) is None


@pytest.mark.parametrize("e", [1e-1, 1e-4, 1e-7])
def test_a_window_within_a_step_is_foreseen_from_both_ends(e):
    """4 + s (p - 0.45) and 4, coupled by e and -e, are one pair while |s (p - 0.45)| < 2 e."""
    s = 3.0
    F = np.array([[0.0, e], [-e, 0.0]])
    along = Continuation(
        lambda p: (np.eye(2), None, np.diag([4 + s * (p - 0.45), 4.0]) + F), 0.0, 1.0
    )
    before = along.at(0.2)
    after = along.at(0.8)
    found = list(near_coalescences(before, after))
    assert [g.value for g in found] == pytest.approx([0.45, 0.45], abs=1e-9)
    assert [g.width for g in found] == pytest.approx([2 * e / s] * 2, rel=1e-6)
    assert [g.z for g in found] == pytest.approx([4.0, 4.0], rel=1e-9)
    for one, state in zip(found, (before, after), strict=True):
        assert np.allclose(np.abs(one.right), np.abs(state.right), rtol=0, atol=1e-12)
    assert not list(near_coalescences(along.at(0.6), after))


def test_what_surely_grows_and_what_may_grow_differ_only_where_roots_are_one():
    """Stiffness 2 + mu i and 2 - mu i of two modes, 9 of the third."""
    turn = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    along = Continuation(
        lambda mu: (np.eye(3), None, np.diag([2.0, 2.0, 9.0]) + mu * turn), -1.0, 1.0
    )
    assert along.at(0.5).count_bounds == (2, 2)
    assert along.at(0.0).count_bounds == (0, 2)
    assert np.array_equal(along.at(0.5).close, np.eye(3))
    assert along.at(0.0).close.sum() == 5
