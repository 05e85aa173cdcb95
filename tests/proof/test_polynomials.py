"""The referee over ranges by exact polynomials, judged by thresholds known in closed form."""

import numpy as np
import pytest

from squeal.proof import HALF_ULP
from squeal.proof.polynomials import MOST_ROWS, ExactRange
from squeal.proof.ranges import Term, Terms

pytest.importorskip("flint")

RATE = 1e-6
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


def around(value, width=1e-9):
    return value - width, value + width


ONE = (0.0, 1.0)
"""Friction mu: omega^2 = 2 +- sqrt(1 - mu)."""
REVERSED = (2.0, -1.0)
"""Friction 2 - mu: flutter up to mu = 1."""


def test_a_threshold_is_proved_and_none_beside_it():
    proof = ExactRange.of(system(ONE), 0.0, 2.0)
    assert proof.prove([around(1.0)], RATE, [2]).status == "proved"
    assert proof.prove([], RATE, []).status == "refuted"
    assert proof.prove([around(1.1)], RATE, [2]).status == "refuted"
    assert proof.prove([around(0.9), around(1.0)], RATE, [2, 2]).status == "refuted"
    assert proof.prove([around(1.0)], RATE, [-2]).status != "proved"
    assert proof.prove([(1.0, 1.0)], RATE, [2]).status == "open"  # a part of its interval
    assert ExactRange.of(system(ONE), 0.0, 0.9).prove([], RATE, []).status == "proved"


@pytest.mark.parametrize("factor", [lambda mu: mu * mu / mu, lambda mu: mu * mu * mu / (mu * mu)])
def test_a_factor_with_a_removable_pole_is_declined(factor):
    """At mu = 0, where a + b mu is read, it has no value."""
    terms = system(ONE)
    moved = [*terms.K[:2], Term(terms.balls["K"][2].mid, factor)]
    assert ExactRange.of(Terms(terms.M, terms.C, moved, HALF_ULP), 0.5, 2.0) is None


@pytest.mark.parametrize("ends", [(1.0, 2.0), (0.0, 1.0)])
def test_a_threshold_at_an_end_of_the_range_is_open(ends):
    exact_range = ExactRange.of(system(ONE), *ends)
    for intervals, rises in (([], []), ([around(1.0)], [2])):
        assert exact_range.prove(intervals, RATE, rises).status == "open"


def test_damping_moves_the_threshold():
    """lambda^2 + d lambda + 2 = i sqrt(mu - 1), with lambda = i sqrt(2): mu = 1 + 2 d^2."""
    d = 0.125
    proof = ExactRange.of(system(ONE, damping=d), 0.0, 2.0)
    assert proof.prove([around(1.0 + 2.0 * d**2)], RATE, [2]).status == "proved"
    assert proof.prove([around(1.0)], RATE, [2]).status == "refuted"


@pytest.mark.parametrize("damping", [0.0, 0.125])
def test_what_begins_and_ends_at_one_value_is_open(damping):
    offset = 2.0 * damping**2
    ends_there = (2.0 + 2.0 * offset, -1.0)
    proof = ExactRange.of(system(ONE, ends_there, damping=damping), 0.0, 2.0)
    assert proof.prove([], RATE, []).status == "open"
    assert proof.prove([around(1.0 + offset)], RATE, [0]).status == "open"


@pytest.mark.parametrize("damping", [0.0, 0.125])
def test_equal_pairs_that_begin_to_grow_together_are_proved(damping):
    proof = ExactRange.of(system(ONE, ONE, damping=damping), 0.0, 2.0)
    interval = around(1.0 + 2.0 * damping**2)
    assert proof.prove([interval], RATE, [4]).status == "proved"
    assert proof.prove([interval], RATE, [2]).status != "proved"


@pytest.mark.parametrize("width", [1e-6, 1e-12, 1e-15])
def test_a_window_between_two_values_is_refuted_if_it_is_left_out(width):
    """One pair begins to grow where the other one has not quite ended to."""
    proof = ExactRange.of(system(ONE, (REVERSED[0] + width, REVERSED[1])), 0.0, 2.0)
    assert proof.prove([], RATE, []).status != "proved"
    high = 1.0 + np.float64(REVERSED[0] + width) - REVERSED[0]
    if width > 1e-12:
        intervals = [around(1.0, width / 8), around(high, width / 8)]
        assert proof.prove(intervals, RATE, [2, -2]).status == "proved"


def test_a_root_through_infinity_is_no_threshold_that_may_be_left_out():
    """A spring mu - 1 holds a damped motion without mass: lambda = (1 - mu) / damping; and what
    damps it vanishes at 1 / 2."""
    spring = [Term([[-1.0]]), Term([[1.0]], lambda mu: mu)]
    holds = ExactRange.of(Terms([Term([[0.0]])], [Term([[2.0]])], spring, HALF_ULP), 0.0, 2.0)
    assert holds.prove([around(1.0)], RATE, [-1]).status == "proved"
    damper = [Term([[-0.5]]), Term([[1.0]], lambda mu: mu)]
    damps = ExactRange.of(Terms([Term([[0.0]])], damper, [Term([[1.0]])], HALF_ULP), 0.0, 2.0)
    assert damps.prove([], RATE, []).status == "refuted"


def test_what_polynomials_do_not_know_is_left_to_the_enclosure():
    zero = np.diag([1.0, 0.0])
    springs = [Term(SPRINGS)]
    regular = Terms([Term(np.eye(2))], [], springs, HALF_ULP)
    inverse = Terms([Term(zero)], [], [*springs, Term(zero, lambda mu: 1 / mu)], HALF_ULP)
    square = Terms([Term(zero)], [], [*springs, Term(zero, lambda mu: mu * mu)], HALF_ULP)
    few_digits = Terms([Term(zero)], [], [Term(SPRINGS, errors=1e-3 * SPRINGS)], HALF_ULP)
    n = MOST_ROWS + 1
    large = Terms([Term(np.diag(np.arange(n)))], [], [Term(np.ones((n, n)))], HALF_ULP)
    for terms in (regular, inverse, square, few_digits, large):
        assert ExactRange.of(terms, 0.0, 2.0) is None
