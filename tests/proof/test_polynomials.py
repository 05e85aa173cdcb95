"""The referee over ranges by exact polynomials, judged by thresholds known in closed form."""

import numpy as np
import pytest

from squeal.proof import HALF_ULP
from squeal.proof.polynomials import MOST_ROWS, ExactRange
from squeal.proof.ranges import Term, Terms

pytest.importorskip("flint")

SPRINGS = np.array([[2.0, -1.0], [-1.0, 2.0]])


def block(*parts):
    """The block diagonal matrix of some square ones."""
    n = sum(len(part) for part in parts)
    X = np.zeros((n, n))
    start = 0
    for part in parts:
        end = start + len(part)
        X[start:end, start:end] = part
        start = end
    return X


def system(*frictions, damping=0.0, springs=SPRINGS):
    """Pairs of masses and a spring without mass: flutter where 1 < (entry above 1) * friction."""
    count = len(frictions)
    one = np.ones((1, 1))
    M = block(*[np.eye(2)] * count, 0.0 * one)
    K = block(*[springs] * count, one)
    constant = block(*[np.array([[0.0, a], [0.0, 0.0]]) for a, _ in frictions], 0.0 * one)
    slope = block(*[np.array([[0.0, b], [0.0, 0.0]]) for _, b in frictions], 0.0 * one)
    terms = [Term(K), Term(constant), Term(slope, lambda mu: mu)]
    return Terms([Term(M)], [Term(damping * M)], terms, HALF_ULP)


ONE = (0.0, 1.0)
"""Friction mu: omega^2 = 2 +- sqrt(1 - mu)."""
REVERSED = (2.0, -1.0)
"""Friction 2 - mu: flutter up to mu = 1."""


def changes(terms, low=0.0, high=2.0):
    """The value in the middle and the rise of each change."""
    exact = ExactRange.of(terms, low, high)
    return [((change.low + change.high) / 2.0, change.rise) for change in exact.changes]


def test_the_threshold_of_mode_coupling_is_exact():
    exact = ExactRange.of(system(ONE), 0.0, 2.0)
    (flutter,) = exact.changes
    assert flutter.low <= 1.0 <= flutter.high
    assert flutter.high - flutter.low <= 4.0 * np.spacing(1.0)
    assert flutter.rise == 2
    assert flutter.omega == pytest.approx(np.sqrt(2.0), rel=1e-7)
    assert changes(system(ONE), high=0.9) == []


@pytest.mark.parametrize("factor", [lambda mu: mu * mu / mu, lambda mu: mu * mu * mu / (mu * mu)])
def test_a_factor_with_a_removable_pole_is_declined(factor):
    """At mu = 0, where a + b mu is read, it has no value."""
    terms = system(ONE)
    moved = [*terms.K[:2], Term(terms.balls["K"][2].mid, factor)]
    assert ExactRange.of(Terms(terms.M, terms.C, moved, HALF_ULP), 0.5, 2.0) is None


@pytest.mark.parametrize(
    "factor",
    [
        lambda mu: mu * mu * mu,
        lambda mu: mu * (1 + mu * mu),
        lambda mu: (mu - 1) * (mu - 1) * (mu - 1) + 3 * mu,
        lambda mu: mu * mu,
    ],
)
def test_a_factor_that_bends_somewhere_is_declined(factor):
    """The ball of the bends of mu**3 holds 0, from which it does not certainly differ."""
    terms = system(ONE)
    moved = [*terms.K[:2], Term(terms.balls["K"][2].mid, factor)]
    assert ExactRange.of(Terms(terms.M, terms.C, moved, HALF_ULP), 0.0, 1.0) is None


@pytest.mark.parametrize("damping", [0.0, 0.125])
def test_what_begins_at_an_end_of_the_range_is_listed(damping):
    onset = 1.0 + 2.0 * damping**2
    terms = system(ONE, damping=damping)
    for ends in ((onset, 2.0), (0.0, onset)):
        assert changes(terms, *ends) == [(pytest.approx(onset, rel=1e-15), 2)]


def test_what_ends_at_the_low_end_of_the_range_is_not_listed():
    assert changes(system(REVERSED), low=1.0) == []
    assert changes(system(REVERSED), high=1.0) == [(1.0, -2)]


def test_damping_moves_the_threshold():
    """lambda^2 + d lambda + 2 = i sqrt(mu - 1), with lambda = i sqrt(2): mu = 1 + 2 d^2."""
    d = 0.125
    assert changes(system(ONE, damping=d)) == [(1.0 + 2.0 * d**2, 2)]


@pytest.mark.parametrize("damping", [0.0, 0.125])
def test_what_begins_and_ends_at_one_value_is_told_apart(damping):
    """Their two polynomials are factors of the determinant."""
    offset = 2.0 * damping**2
    ends_there = (2.0 + 2.0 * offset, -1.0)
    both = changes(system(ONE, ends_there, damping=damping))
    assert sorted(rise for _, rise in both) == [-2, 2]
    assert [value for value, _ in both] == pytest.approx([1.0 + offset] * 2, rel=1e-15)


def test_a_root_that_touches_the_axis_is_declined():
    """lambda^2 + lambda / 8 + (mu - 1)^2 = 0: as far as counts tell, two roots might cross."""
    only = np.diag([1.0, 0.0])
    swap = np.array([[0.0, 1.0], [1.0, 0.0]])
    K = [Term(-swap - np.diag([0.0, 1.0])), Term(swap, lambda mu: mu)]
    touching = Terms([Term(only)], [Term(only / 8.0)], K, HALF_ULP)
    assert ExactRange.of(touching, 0.0, 2.0) is None
    assert changes(touching, high=0.5) == []


@pytest.mark.parametrize("damping", [0.0, 0.125])
def test_equal_pairs_that_begin_to_grow_together_are_told_apart(damping):
    onset = pytest.approx(1.0 + 2.0 * damping**2, rel=1e-15)
    assert changes(system(ONE, ONE, damping=damping)) == [(onset, 2), (onset, 2)]


@pytest.mark.parametrize("width", [1e-6, 1e-12, 1e-15])
def test_a_window_between_two_values_is_found(width):
    """One pair begins to grow where the other one has not quite ended to."""
    end = REVERSED[0] + width
    found = changes(system(ONE, (end, REVERSED[1])))
    assert found == [(1.0, 2), (pytest.approx(end - 1.0, rel=1e-15), -2)]


def test_a_root_through_infinity_is_declined():
    """A spring mu - 1 holds a damped motion without mass: lambda = (1 - mu) / damping; and what
    damps it vanishes at 1 / 2."""
    spring = [Term([[-1.0]]), Term([[1.0]], lambda mu: mu)]
    holds = Terms([Term([[0.0]])], [Term([[2.0]])], spring, HALF_ULP)
    assert changes(holds) == [(1.0, -1)]
    damper = [Term([[-0.5]]), Term([[1.0]], lambda mu: mu)]
    damps = Terms([Term([[0.0]])], damper, [Term([[1.0]])], HALF_ULP)
    assert ExactRange.of(damps, 0.0, 2.0) is None
    assert changes(damps, high=0.25) == []


def test_roots_have_the_exact_sign_of_their_real_parts():
    """lambda^2 + 2 = +-sqrt(1 - mu) is on the axis up to mu = 1; just above roots grow by 1e-8."""
    exact = ExactRange.of(system(ONE), 0.0, 2.0)
    assert not exact.roots_at(1.0).real.any()
    above = exact.roots_at(float(np.nextafter(1.0, 2.0)))
    assert sorted(np.sign(above.real)) == [-1.0, -1.0, 1.0, 1.0]


def test_what_polynomials_do_not_know_is_left_to_the_enclosure():
    zero = np.diag([1.0, 0.0])
    springs = [Term(SPRINGS)]
    inverse = Terms([Term(zero)], [], [*springs, Term(zero, lambda mu: 1 / mu)], HALF_ULP)
    square = Terms([Term(zero)], [], [*springs, Term(zero, lambda mu: mu * mu)], HALF_ULP)
    few_digits = Terms([Term(zero)], [], [Term(SPRINGS, errors=1e-3 * SPRINGS)], HALF_ULP)
    n = MOST_ROWS + 1
    large = Terms([Term(np.diag(np.arange(n)))], [], [Term(np.ones((n, n)))], HALF_ULP)
    for terms in (inverse, square, few_digits, large):
        assert ExactRange.of(terms, 0.0, 2.0) is None
