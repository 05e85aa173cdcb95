"""Discs whose centres move with the parameter, against exact roots within the interval."""

import itertools
from fractions import Fraction

import numpy as np
import pytest

from squeal.proof.balls import Balls, Quadratic, half_widths
from squeal.proof.chains import FINEST, Chain
from squeal.proof.exact import exact_roots
from squeal.proof.pieces import Failure, growing_of
from squeal.proof.ranges import bounds_between
from squeal.proof.segments import Expansion, bases, near_diagonal, tallies_of_squares
from squeal.proof.terms import Term, Terms, middle_and_half

pytest.importorskip("flint")

UNIT = 2.0**-12
KINDS = ("dense", "twins", "defective", "near", "symmetric", "gyroscopic", "damped", "overdamped")


def dyadic(X, unit=UNIT):
    return np.round(np.asarray(X) / unit) * unit


def sheared(matrices, rng):
    """Similar matrices: rows are added to others, which rounds nothing."""
    mixed = [X.copy() for X in matrices]
    for _ in range(4):
        i, j = rng.choice(len(mixed[0]), 2, replace=False)
        for X in mixed:
            X[i] += X[j]
            X[:, j] -= X[:, i]
    return mixed


def drawn(kind, rng):
    """C, K0 and K1 (n, n) of short dyadic entries, M = 1."""
    n = int(rng.integers(2, 8))
    C = np.zeros((n, n))
    K0 = np.diag(dyadic(rng.uniform(1, 9, n)))
    K1 = dyadic(rng.standard_normal((n, n)))
    if kind == "twins":
        K0 = np.diag(dyadic(rng.uniform(1, 3, n)).repeat(2)[:n])
    if kind == "defective":
        K0 = 2.0 * np.eye(n) + np.eye(n, k=1)
        K1 = dyadic(0.1 * K1)
    if kind == "near":
        K0 = np.diag(dyadic(2.0 + rng.uniform(-1, 1, n) / 256))
        K1 = dyadic(K1 / 64)
    if kind == "damped":
        C = np.diag(dyadic(rng.uniform(0, 0.2, n))) + dyadic(0.02 * rng.standard_normal((n, n)))
    if kind == "overdamped":
        C = np.diag(dyadic(rng.uniform(1, 8, n)))
    if kind == "symmetric":
        return C, K0, K1 + K1.T
    if kind == "gyroscopic":
        spin = dyadic(rng.standard_normal((n, n)))
        return spin - spin.T, K0, K1 + K1.T
    return sheared([C, K0, K1], rng)


@pytest.mark.parametrize("kind", KINDS)
def test_counts_hold_at_exact_values_within(kind):
    """The roots at dyadic values are known without any rounding."""
    known = 0
    for number in range(12):
        rng = np.random.default_rng([KINDS.index(kind), number])
        C, K0, K1 = drawn(kind, rng)
        half = 2.0 ** -int(rng.integers(1, 20))
        middle = 0.0 if kind == "defective" else dyadic(rng.uniform(0, 2), half / 4)
        damping = [Term(C)] if C.any() else []
        terms = Terms([Term(np.eye(len(C)))], damping, [Term(K0), Term(K1, lambda mu: mu)])
        rate = 10.0 ** rng.uniform(-3, 0)
        low = middle - half
        high = middle + half
        each = [bounds_between(one, low, high, rate) for one in terms.components()]
        least = sum(one.least for one in each)
        most = sum(one.most for one in each)
        doubtful = sum(one.doubtful for one in each)
        known += least == most
        for share in (0.0, 0.5, 1.0, *rng.integers(0, 1025, 3) / 1024):
            value = low + 2.0 * half * share
            pieces = exact_roots(Quadratic.of(np.eye(len(C)), C, K0 + value * K1))
            assert not isinstance(pieces, Failure)
            real_parts = np.array([(piece.low + piece.high) / 2.0 for piece in pieces])
            assert least <= sum(piece.side == "grows" for piece in pieces) <= most
            assert np.sum(real_parts > rate * (1.0 + 1e-9)) <= least + doubtful
    assert known >= (0 if kind == "defective" else 3)


def test_discs_hold_terms_of_second_order():
    """Of half the interval they are a quarter as wide, and their centres move as roots do."""
    rng = np.random.default_rng(3)
    K0 = np.diag(np.arange(1.0, 11.0))
    K1 = rng.standard_normal((10, 10))
    A = Expansion(Balls.exact(K0), Balls.exact(K1), np.zeros((10, 10)))
    B = Expansion.constant(Balls.exact(np.eye(10)))
    basis = next(bases(K0, np.eye(10)))
    widths = []
    for half in (2.0**-10, 2.0**-11):
        found = near_diagonal(A, B, half, basis)
        assert not isinstance(found, Failure)
        widths.append(found.N.sum(axis=1).max())
        order = np.argsort(found.centres)
        assert found.speeds[order] == pytest.approx(K1.diagonal(), abs=1e-12)
    assert widths[0] / widths[1] == pytest.approx(4.0, rel=0.1)


def test_a_pair_that_meets_is_decided_by_its_discriminant():
    """s = 2 +- sqrt(d): real on one side of d = 0, a pair on the other, up to close to it."""
    A0 = np.array([[2.0, 1.0], [0.0, 2.0]])
    lower = np.array([[0.0, 0.0], [1.0, 0.0]])
    for side, (near, far) in itertools.product((1.0, -1.0), ((1e-9, 1e-6), (1e-3, 0.1))):
        middle = side * (near + far) / 2.0
        half = (far - near) / 2.0
        at = Balls.exact(A0 + middle * lower)
        A = Expansion(at, Balls.exact(lower), np.zeros((2, 2)))
        B = Expansion.constant(Balls.exact(np.eye(2)))
        counts = []
        for basis in bases(at.mid, np.eye(2)):
            found = near_diagonal(A, B, half, basis)
            assert not isinstance(found, Failure)
            by_part = tallies_of_squares(found, half)
            counts.append(growing_of(list(itertools.chain(*by_part))))
        assert ((0, 0) if side > 0.0 else (2, 2)) in counts


@pytest.mark.parametrize("digits", [1, 10, 16, 17])
def test_what_digits_allow_holds_every_number_that_prints_so(digits):
    """The double lies up to half an ulp from the decimal number; 17 digits left that out."""
    rng = np.random.default_rng(3)
    for exponent in rng.integers(-300, 300, 50).tolist():
        number = Fraction(int(rng.integers(10 ** (digits - 1), 10**digits)))
        unit = Fraction(10) ** exponent
        entry = np.array([float(number * unit)])
        width = Fraction(float(half_widths(entry, f"{digits} digits")[0]))
        for end in (number - Fraction(1, 2), number + Fraction(1, 2)):
            assert abs(end * unit - Fraction(float(entry[0]))) <= width


def test_underflow_of_a_midpoint_widens_a_large_radius():
    """No double is half of three times the smallest; what is lost vanished beside 1e-200."""
    balls = Balls(np.array([[1.5e-323]]), np.array([[1e-200]])).scaled(-1)
    lost = abs(Fraction(float(balls.mid[0, 0])) - Fraction(1.5e-323) / 2)
    assert Fraction(float(balls.rad[0, 0])) >= Fraction(1e-200) / 2 + lost > Fraction(1e-200) / 2


def test_an_interval_reaches_both_its_ends():
    """Half the width was taken about a middle that is rounded by half an ulp."""
    low = 1.0
    high = 1.0 + 45 * np.finfo(float).eps
    middle, half = middle_and_half(low, high)
    assert Fraction(middle) - Fraction(half) <= Fraction(low)
    assert Fraction(middle) + Fraction(half) >= Fraction(high)


def test_two_equal_roots_without_a_coupling_are_no_obstacle():
    """At mu = 0 two rows do not feel the third: the motion of their vectors was 0/0."""
    coupling = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [1.0, 1.0, 0.0]])
    stiffness = [Term(np.diag([4.0, 4.0, 9.0])), Term(1e-3 * coupling, lambda mu: mu)]
    terms = Terms([Term(np.eye(3))], [], stiffness)
    assert not bounds_between(terms, -1e-6, 1e-6, rate=1e-6).doubtful


def test_the_finest_scaling_of_a_chain_is_tried():
    """Of a matrix with the strict part alone each halving of t halves the radius."""
    chain = Chain(np.arange(2), np.eye(2), levels=np.array([0, 1]))
    shifts = chain.shifts(np.array([[0.0, 1.0], [0.0, 0.0]]))
    assert shifts.tolist() == [[0, -FINEST], [FINEST, 0]]
