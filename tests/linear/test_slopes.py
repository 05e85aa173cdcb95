"""Slopes of all roots against differences, where every matrix moves; where roots are expected."""

import numpy as np
import pytest

from squeal.linear.continuation import Continuation, Step
from squeal.linear.eigen import square_roots
from squeal.linear.events import guesses_of

H = 1e-6


@pytest.mark.parametrize("form", ["undamped", "gyroscopic", "damped"])
@pytest.mark.parametrize("n", [3, 6])
def test_slopes_are_those_of_differences(form, n, rng):
    X, Y, Z, W = rng.normal(size=(4, n, n))
    skew, full = W - W.T, 0.1 * W

    def system(p):
        M = np.eye(n) + 0.1 * (X + X.T) / n + p * np.diag(np.arange(n) / n)
        K = np.diag(np.arange(1.0, n + 1) ** 2) + p * (Y + Y.T) / n + 0.1 * (form == "damped") * Z
        C = {"undamped": None, "gyroscopic": (1 + p) * skew, "damped": full + p * Z}[form]
        return M, C, K

    along = Continuation(system, 0.0, 1.0)
    assert along.form == form
    at, up, down = (along.at(p) for p in (0.4, 0.4 + H, 0.4 - H))
    nearest = [s.roots[np.argmin(np.abs(s.roots - at.roots[:, None]), axis=1)] for s in (up, down)]
    slopes = (nearest[0] - nearest[1]) / (2 * H)
    assert at.slopes == pytest.approx(slopes, abs=1e-7 * np.abs(slopes).max())


def _between(matrices, low, high):
    along = Continuation(matrices, -9.0, 9.0)
    step = Step(along.at(low), along.at(high), along.options)
    return along, guesses_of(step, (False, False))[0]


@pytest.mark.parametrize("low", [-0.7, -0.2])
def test_two_roots_that_meet_in_a_step_are_expected_where_they_do(low):
    """1 -+ sqrt(p) of an undamped pair meet at p = 0, and one is zero at p = 1."""
    along, found = _between(
        lambda p: (np.eye(2), np.zeros((2, 2)), np.array([[1.0, p], [1.0, 1.0]])), low, 1.4
    )
    assert along.form == "undamped"
    met = [g for g in found if g.coalesces]
    assert [g.value for g in met] == pytest.approx([0.0], abs=0.011 * (1.4 - low))
    assert [g.root for g in met] == pytest.approx([1.0])
    zero = [g.value for g in found if not g.coalesces]
    assert zero == pytest.approx([1.0] * len(zero), abs=0.011 * (1.4 - low))
    assert zero


@pytest.mark.parametrize("damping", [0.4, -0.4])
def test_one_of_two_roots_that_meet_in_a_step_passes_zero_where_it_does(damping):
    """lambda^2 + c lambda + p: a pair that becomes real and of which one is zero at p = 0."""
    along, found = _between(
        lambda p: (np.eye(1), [[damping]] * np.eye(1), [[p]] * np.eye(1)), -1, 1
    )
    assert along.form == "damped"
    assert [g.value for g in found] == pytest.approx([0.0], abs=0.021)


def test_rounding_of_square_roots_is_how_far_rounding_moves_them():
    s, r = np.array([4.0, -9.0, 3.0 - 4.0j]), np.full(3, 1e-7)
    turned = np.exp(1j * np.linspace(0.0, 2 * np.pi, 181))[:, None] * r
    roots, rounding = square_roots(s, r)
    moved = np.sqrt(-(s + turned) + 0j)
    away = np.minimum(np.abs(moved - roots), np.abs(moved + roots))
    assert roots**2 == pytest.approx(-s)
    assert (roots.real >= 0).all()
    assert rounding == pytest.approx(away.min(axis=0), rel=1e-6)
    assert square_roots(np.zeros(1, dtype=complex), np.full(1, 1e-8))[1] == pytest.approx(1e-4)
