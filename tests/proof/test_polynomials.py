"""The referee over ranges by exact polynomials, judged by thresholds known in closed form."""

import numpy as np
import pytest

from squeal.proof import HALF_ULP
from squeal.proof.polynomials import MOST_DEGREE, ExactRange
from squeal.proof.terms import Term, Terms

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


def with_friction(factor):
    """The pair of masses whose friction is a function of mu, from 1 on it flutters."""
    terms = system(ONE)
    return Terms(terms.M, terms.C, [*terms.K[:2], Term(terms.K[2].matrix, factor)], HALF_ULP)


@pytest.mark.parametrize("factor", [lambda mu: mu * mu / mu, lambda mu: mu * mu * mu / (mu * mu)])
def test_a_factor_with_a_pole_in_the_range_is_declined(factor):
    """At mu = 0 it has no value."""
    assert ExactRange.of(with_friction(factor), 0.0, 2.0) is None
    assert changes(with_friction(factor), 0.5) == [(1.0, 2)]


@pytest.mark.parametrize(
    ("factor", "thresholds"),
    [
        (lambda mu: mu * mu * mu, {1.0: 2}),
        (lambda mu: mu * (1 + mu * mu), {0.6823278038280193: 2}),
        (lambda mu: (mu - 1) ** 3 + 3 * mu, {0.4039283620166784: 2}),
        (lambda mu: 4.0 * mu * mu, {0.5: 2}),
        (lambda mu: 1.5 * mu * (2 - mu), {1.0 - 3**-0.5: 2, 1.0 + 3**-0.5: -2}),
        (lambda mu: 2 / (1 + mu), {1.0: -2}),
        (lambda mu: 2 * mu / (1 + mu * mu) + 0.25, {(4.0 - 7**0.5) / 3.0: 2}),
        (lambda mu: (2 - mu) ** -2, {1.0: 2}),
        (lambda mu: 1 - (mu - 0.75) ** 2, {}),
        (lambda mu: 1 + (mu - 0.75) ** 2, {0.75: 0}),
    ],
)
def test_a_rational_function_of_the_parameter_is_exact(factor, thresholds):
    """Flutter where it exceeds 1; where it only reaches 1 nothing grows at that value alone."""
    expected = []
    for value, rise in thresholds.items():
        for each in [rise] if rise else [-2, 2]:
            expected.append((pytest.approx(value, rel=1e-14), each))
    assert changes(with_friction(factor), high=1.75) == expected


@pytest.mark.parametrize("factor", [lambda mu: mu**0.5, lambda mu: mu**9, lambda mu: 1 / (mu - mu)])
def test_other_factors_are_declined(factor):
    assert ExactRange.of(with_friction(factor), 0.5, 2.0) is None


@pytest.mark.parametrize(
    "factor",
    [
        lambda mu: (((((mu + 1) ** 8) ** 8) ** 8) ** 8) ** 4 - 1.01,
        lambda mu: ((1 / (mu + 1)) ** 4) ** 4,
        lambda mu: (mu * mu * mu) ** 3,
        lambda mu: mu * (mu.of(10) ** 10) ** 10**9,
        lambda mu: mu * (((mu.of(3) ** 999) ** 999) ** 999),
    ],
)
def test_a_large_power_is_declined_before_it_is_computed(factor):
    assert ExactRange.of(with_friction(factor), 0.0, 1e-4) is None


@pytest.mark.parametrize(("base", "power"), [(10, 9), (2, 10), (0.5, -20), (10, 12)])
def test_a_large_power_of_a_number_is_a_number(base, power):
    """Flutter up to mu = 1 - base^-power."""
    found = changes(with_friction(lambda mu: (1 - mu) * mu.of(base) ** power), high=1.0)
    assert found == [(pytest.approx(1 - float(base) ** -power, rel=1e-14), -2)]


def rational(rng):
    """A rational function of small integers without a pole from 0 to 2, and its values."""
    a, b, c, d, e = rng.integers(-3, 4, 5).tolist()
    return lambda mu: (a + b * mu + c * mu * mu) / (4 + d * d * mu) + e * mu / (1 + mu)


@pytest.mark.parametrize("seed", range(20))
def test_counts_of_rational_functions_are_those_of_numpy(seed):
    """At a thousand values, of random matrices with several such factors."""
    rng = np.random.default_rng(seed)
    factors = [rational(rng), rational(rng)]
    K0, K1, K2 = rng.integers(-4, 5, (3, 2, 2)) * np.array([1.0, 0.5, 0.5])[:, None, None]
    C0, C1 = rng.integers(-2, 3, (2, 2, 2)) / 8.0
    K = [Term(K0 + 6.0 * np.eye(2)), Term(K1, factors[0]), Term(K2, factors[1])]
    C = [Term(C0), Term(C1, factors[0])] if seed % 2 else []
    exact = ExactRange.of(Terms([Term(np.eye(2))], C, K, HALF_ULP), 0.0, 2.0)
    assert exact is not None
    start = int(np.sum(exact.roots_at(0.0).real > 0.0))
    values = np.linspace(0.0013, 1.9987, 1000)
    first, second = (np.array([factor(mu) for mu in values])[:, None, None] for factor in factors)
    A = np.zeros((len(values), 4, 4))
    A[:, :2, 2:] = np.eye(2)
    A[:, 2:, :2] = -(K0 + 6.0 * np.eye(2) + first * K1 + second * K2)
    A[:, 2:, 2:] = -(C0 + first * C1) * (seed % 2)
    for mu, roots in zip(values, np.linalg.eigvals(A), strict=True):
        if np.min(abs(roots.real)) < 1e-5 and seed % 2:  # beside a threshold
            continue
        expected = start + sum(change.rise for change in exact.changes if change.high < mu)
        assert np.sum(roots.real > 1e-5) == expected


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


def touching(growth, at=1.0):
    """lambda^2 - growth lambda + (mu - at)^2 = 0, of a spring without mass in a row of its own."""
    only = np.diag([1.0, 0.0])
    swap = np.array([[0.0, 1.0], [1.0, 0.0]])
    K = [Term(-at * swap - np.diag([0.0, 1.0])), Term(swap, lambda mu: mu)]
    return Terms([Term(only)], [Term(-growth * only)], K, HALF_ULP)


@pytest.mark.parametrize("at", [1.0, 0.3, 1 / 3])
def test_a_root_that_touches_the_axis_from_decay_is_no_change(at):
    assert changes(touching(-0.125, at)) == []


def test_a_root_that_touches_the_axis_from_growth_ends_and_begins_to_grow():
    """One of two real roots is zero at mu = 1 alone."""
    assert changes(touching(0.125)) == [(1.0, -1), (1.0, 1)]


def test_a_touch_from_growth_at_no_double_is_declined():
    """K = 4 + x J, x = mu^2 - 2: growth on both sides of sqrt(2), at which no count is made."""
    turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
    K = [Term(4.0 * np.eye(2)), Term(turn, lambda mu: mu * mu - 2)]
    assert ExactRange.of(Terms([Term(np.eye(2))], [], K, HALF_ULP), 0.0, 2.0) is None


@pytest.mark.parametrize("width", [1e-16, 2e-16, 3e-16, 4e-16])
@pytest.mark.parametrize("at", [1.5, 0.75, 4 / 3])
def test_flutter_between_two_thresholds_side_by_side_is_listed_or_declined(at, width):
    """omega^2 = 2 +- sqrt(f), f = 1 - 1.5 / (1 + x^2), x = (mu - at) / width: below 0 about at."""
    K = [
        Term(np.array([[2.0, 1.0], [0.0, 2.0]])),
        Term(
            np.array([[0.0, 0.0], [1.0, 0.0]]),
            lambda mu: 1 - 1.5 / (1 + ((mu - at) / width) * ((mu - at) / width)),
        ),
    ]
    exact = ExactRange.of(Terms([Term(np.eye(2))], [], K, HALF_ULP), 0.0, 2.0)
    assert exact is None or [change.rise for change in exact.changes] == [2, -2]


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
    power = Terms([Term(zero)], [], [*springs, Term(zero, lambda mu: mu**5)], HALF_ULP)
    few_digits = Terms([Term(zero)], [], [Term(SPRINGS, errors=1e-3 * SPRINGS)], HALF_ULP)
    n = MOST_DEGREE + 1
    large = Terms([Term(np.diag(np.arange(n)))], [], [Term(np.ones((n, n)))], HALF_ULP)
    for terms in (inverse, power, few_digits, large):
        assert ExactRange.of(terms, 0.0, 2.0) is None


@pytest.mark.parametrize("high", [2.0, 1e6, 1e12, 1e20])
@pytest.mark.parametrize("k", [2.0, 1e-8, 1e-14, 1e-30])
def test_the_frequency_is_that_at_the_threshold(k, high):
    """lambda^2 + (1 - mu) lambda + k = 0: slow motions turn into real roots just above mu = 1."""
    one = [[1.0]]
    damping = [Term(one), Term([[-1.0]], lambda mu: mu)]
    terms = Terms([Term(one)], damping, [Term([[k]])], HALF_ULP)
    (change,) = ExactRange.of(terms, 0.0, high).changes
    assert (change.low + change.high) / 2.0 == 1.0
    assert change.rise == 2
    assert change.omega == pytest.approx(np.sqrt(k), rel=1e-12)


@pytest.mark.parametrize("high", [2.0, 1e12])
def test_a_slow_mode_between_fast_ones_has_its_frequency_at_the_threshold(high):
    """Three oscillators hidden by a congruence of integers, the dampers of which change sign."""
    T = np.array([[1.0, 2.0, 0.0], [0.0, 1.0, -1.0], [0.0, 0.0, 1.0]])
    stiffnesses = [1e-10, 4.0, 1e6]
    thresholds = [0.5, 0.75, 1.0]
    damping = [Term(T.T @ np.diag(thresholds) @ T), Term(-T.T @ T, lambda mu: mu)]
    terms = Terms([Term(T.T @ T)], damping, [Term(T.T @ np.diag(stiffnesses) @ T)], HALF_ULP)
    found = [(change.low, change.omega) for change in ExactRange.of(terms, 0.0, high).changes]
    for (value, omega), at, k in zip(found, thresholds, stiffnesses, strict=True):
        assert value == pytest.approx(at, rel=1e-6)
        assert omega == pytest.approx(np.sqrt(k), rel=1e-6)


@pytest.mark.parametrize("damping", [0.0, 0.01])
@pytest.mark.parametrize("high", [2.0, 1e14])
def test_mode_coupling_has_the_frequency_at_the_threshold(damping, high):
    """lambda^2 + d lambda + 2 = i sqrt(mu - 1) has the root i sqrt(2) at the threshold."""
    (change,) = ExactRange.of(system(ONE, damping=damping), 0.0, high).changes
    assert change.rise == 2
    assert change.omega == pytest.approx(np.sqrt(2.0), rel=1e-12)


CHAIN = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 2.0]])
"""omega^2 = 2 - sqrt(2), 2, 2 + sqrt(2), of which two belong to one irreducible factor."""


@pytest.mark.parametrize(
    "factor", [lambda mu: 1 - mu, lambda mu: 1 - 3 * mu, lambda mu: 2 - mu * mu]
)
def test_pairs_that_begin_to_grow_at_one_value_have_each_its_frequency(factor):
    """At mu = 1, 1/3 and sqrt(2) all damping vanishes."""
    terms = Terms([Term(np.eye(3))], [Term(np.eye(3), factor)], [Term(CHAIN)], HALF_ULP)
    found = ExactRange.of(terms, 0.0, 1e3).changes
    assert [change.rise for change in found] == [2, 2, 2]
    squares = sorted(change.omega**2 for change in found)
    assert squares == pytest.approx([2.0 - np.sqrt(2.0), 2.0, 2.0 + np.sqrt(2.0)], rel=1e-12)


def test_pairs_that_begin_and_end_to_grow_at_one_value_are_told_apart():
    """mu diag(1, -1) damps one of two modes of K = [[5, 2], [2, 2]] more than the other, by shares
    1/5 and 4/5: below mu = 0 the mode of omega = 1 decays, above it that of sqrt(6)."""
    damping = [Term(np.diag([1.0, -1.0]), lambda mu: mu)]
    springs = [Term(np.array([[5.0, 2.0], [2.0, 2.0]]))]
    found = ExactRange.of(Terms([Term(np.eye(2))], damping, springs, HALF_ULP), -0.5, 0.5).changes
    assert [change.rise for change in found] == [-2, 2]
    assert [change.omega for change in found] == pytest.approx([np.sqrt(6.0), 1.0], rel=1e-12)


def test_a_pair_through_zero_has_no_frequency():
    """lambda^2 - mu lambda + mu = 0: (mu +- sqrt(mu^2 - 4 mu)) / 2 is a pair from 0 to 4, below it
    one of two real roots grows."""
    one = [[1.0]]
    damping = [Term([[-1.0]], lambda mu: mu)]
    terms = Terms([Term(one)], damping, [Term(one, lambda mu: mu)], HALF_ULP)
    for low, expected in ((-1.0, [(-1, 0.0), (2, 0.0)]), (0.0, [(2, 0.0)])):
        found = ExactRange.of(terms, low, 1e6).changes
        assert [(change.rise, change.omega) for change in found] == expected


def test_a_full_component_has_its_frequencies_at_the_thresholds():
    """Eight rows: of the roots at each threshold one has no real part, and that frequency."""
    rng = np.random.default_rng(0)
    A, F, C = rng.standard_normal((3, 8, 8))
    springs = [Term(A @ A.T + 8.0 * np.eye(8)), Term(F, lambda mu: mu)]
    terms = Terms([Term(np.eye(8))], [Term(0.01 * C + 0.05 * np.eye(8))], springs, HALF_ULP)
    exact = ExactRange.of(terms, 0.0, 10.0)
    assert exact.changes
    for change in exact.changes:
        roots = exact.roots_at((change.low + change.high) / 2.0)
        assert np.min(np.abs(roots - 1j * change.omega)) < 1e-12
