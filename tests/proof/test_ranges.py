"""The referee over ranges of the parameter, judged by thresholds known in closed form."""

import numpy as np
import pytest

from squeal import System
from squeal.errors import InputError
from squeal.proof import HALF_ULP
from squeal.proof.ranges import (
    INSIDE_SHARE,
    RangeProof,
    bounds_between,
    frequency_on_axis,
)
from squeal.proof.terms import Term, Terms
from tests.known import known_system

pytest.importorskip("flint")

SPRINGS = np.array([[2.0, -1.0], [-1.0, 2.0]])
FRICTION = np.array([[0.0, 1.0], [0.0, 0.0]])


def prove_thresholds(terms, low, high, intervals, growth_below, rises=None, most=1000):
    """The proof of a range, in at most so many intervals."""
    return RangeProof(terms, low, high, most).prove(intervals, growth_below, rises)


def around(value: float, width: float = 1e-12) -> tuple[float, float]:
    return value - width, value + width


def terms_of(part, turn=None):
    """The terms of one matrix, constant or linear in mu, in coordinates turned by a matrix."""
    terms = []
    for term in part:
        matrix = term.matrix if turn is None else turn @ term.matrix @ turn.T
        factor = (lambda mu: mu) if term.factor.names else None
        terms.append(Term(matrix, factor))
    return terms


def coupled() -> Terms:
    """Flutter from 3/4 on: omega^2 = 2 +- sqrt(1 - 4 mu / 3)."""
    friction = Term(FRICTION, lambda mu: 4 * mu / 3)
    return Terms([Term(np.eye(2))], [], [Term(SPRINGS), friction], HALF_ULP)


def test_the_threshold_of_mode_coupling_is_proved():
    right = prove_thresholds(coupled(), 0.0, 2.0, [around(0.75)], 1e-8, rises=[2])
    assert (right.status, right.growth_below, right.data) == ("proved", 1e-8, HALF_ULP)
    assert prove_thresholds(coupled(), 0.0, 0.74, [], 1e-8).status == "proved"


def test_an_open_answer_says_what_is_assumed_of_the_entries():
    """Out of steps, and counted at the threshold itself, where the pair meets on the axis."""
    out_of_steps = prove_thresholds(coupled(), 0.0, 2.0, [around(0.75)], 1e-8, most=0)
    counted_at_threshold = prove_thresholds(coupled(), 0.0, 0.75 / INSIDE_SHARE, [], 1e-8)
    for proof in (out_of_steps, counted_at_threshold):
        assert (proof.status, proof.data) == ("open", HALF_ULP)


@pytest.mark.parametrize(
    ("intervals", "rises"),
    [
        ([], None),  # dropped
        ([around(0.75 + 1e-6, 1e-7)], None),  # moved
        ([around(0.75 - 1e-6, 1e-7)], None),
        ([around(0.5), around(0.75)], None),  # invented
        ([around(0.75)], [-2]),  # the other direction
        ([around(0.75), around(0.75)], None),  # doubled
    ],
)
def test_wrong_thresholds_are_refuted(intervals, rises):
    assert prove_thresholds(coupled(), 0.0, 2.0, intervals, 1e-8, rises).status == "refuted"


def sheared_twins(k: float, h: float, g: float, additions) -> Terms:
    """Two equal pads that flutter from mu = |k - h| / (2 g) on, coupled by a similarity without
    rounding: each (i, j, sign) adds +-row j to row i and takes +-column i from column j."""
    stiffness = np.kron(np.eye(2), np.diag([k, h]))
    friction = np.kron(np.eye(2), np.array([[0.0, g], [-g, 0.0]]))
    for i, j, sign in additions:
        for matrix in (stiffness, friction):
            matrix[i] += sign * matrix[j]
            matrix[:, j] -= sign * matrix[:, i]
    return Terms([Term(np.eye(4))], [], [Term(stiffness), Term(friction, lambda mu: mu)])


@pytest.mark.parametrize(
    ("k", "h", "g", "additions"),
    [
        (1210 / 1024, 1135 / 1024, 747 / 1024, [(2, 1, -1), (1, 0, 1), (1, 3, -1), (2, 1, -1)]),
        (1030 / 1024, 879 / 1024, 492 / 1024, [(3, 2, 1), (0, 2, -1), (1, 0, 1), (3, 1, 1)]),
        (833 / 1024, 1224 / 1024, 1004 / 1024, [(3, 1, -1), (1, 2, 1)]),
        (1042 / 1024, 1291 / 1024, 885 / 1024, [(1, 0, -1), (3, 1, 1), (2, 0, 1), (1, 3, -1)]),
        (1264 / 1024, 1170 / 1024, 395 / 1024, [(1, 3, -1), (0, 3, 1), (3, 0, -1), (3, 0, 1)]),
        (1581 / 1024, 1535 / 1024, 404 / 1024, [(0, 3, 1), (2, 1, -1), (3, 0, 1), (0, 3, -1)]),
    ],
)
def test_growth_of_repeated_roots_that_begins_at_no_printed_threshold_is_not_proved(
    k, h, g, additions
):
    """Rounding leaves open whether repeated roots on the axis grow, by less than any rate, and so
    where they begin to."""
    terms = sheared_twins(k, h, g, additions)
    threshold = abs(k - h) / (2.0 * g)
    assert prove_thresholds(terms, 0.0, 2.0, [], 1e-7).status != "proved"
    moved = around(threshold / 2.0, 1e-9)
    assert prove_thresholds(terms, 0.0, 2.0, [moved], 1e-7, rises=[4]).status != "proved"


def test_damping_destabilises_a_drum_brake():
    """Hulten's form: closed form by Routh and Hurwitz."""
    w = 2 * np.pi * np.array([100.0, 75.0])
    c = np.array([0.02, 0.04]) * w
    a1 = c[0] * w[1] ** 2 + c[1] * w[0] ** 2
    a2 = w[0] ** 2 + w[1] ** 2 + c[0] * c[1]
    a3 = c[0] + c[1]
    onset = np.sqrt(a1 * (a2 * a3 - a1) / (a3 * w[0] * w[1]) ** 2 - 1)
    friction = np.array([[0.0, -(w[1] ** 2)], [w[0] ** 2, 0.0]])
    terms = Terms(
        [Term(np.eye(2))], [Term(np.diag(c))], [Term(np.diag(w**2)), Term(friction, lambda mu: mu)]
    )
    undamped = abs(w[0] ** 2 - w[1] ** 2) / (2 * w[0] * w[1])
    assert prove_thresholds(terms, 0.0, 1.0, [around(onset, 1e-10)], 1e-5).status == "proved"
    assert prove_thresholds(terms, 0.0, 1.0, [around(undamped, 1e-10)], 1e-5).status == "refuted"


def test_near_twins_are_told_apart():
    """Two equal pairs with friction couplings that differ by 1e-6: two thresholds."""
    K = np.kron(np.eye(2), SPRINGS)
    first = np.zeros((4, 4))
    first[0, 1] = 1.0
    second = np.zeros((4, 4))
    second[2, 3] = 1.0
    terms = Terms(
        [Term(np.eye(4))],
        [],
        [Term(K), Term(first, lambda mu: mu), Term(second, lambda mu: mu / (1.0 + 1e-6))],
    )
    both = [around(1.0), around(1.0 + 1e-6)]
    assert prove_thresholds(terms, 0.0, 2.0, both, 1e-7, rises=[2, 2]).status == "proved"
    assert prove_thresholds(terms, 0.0, 2.0, both[:1], 1e-7).status == "refuted"
    assert prove_thresholds(terms, 0.0, 2.0, both[1:], 1e-7).status == "refuted"


def test_a_window_of_a_thousandth_is_not_missed():
    """K = [[2, f], [1, 2]] grows where f < 0: f = (mu - c)^2 - d^2."""
    c = 0.5224
    d = 5e-4
    one = np.array([[2.0, 0.0], [1.0, 2.0]])
    terms = Terms(
        [Term(np.eye(2))], [], [Term(one), Term(FRICTION, lambda mu: (mu - c) ** 2 - d**2)]
    )
    window = [around(c - d), around(c + d)]
    assert prove_thresholds(terms, 0.0, 1.0, window, 1e-6).status == "proved"
    assert prove_thresholds(terms, 0.0, 1.0, [], 1e-6).status == "refuted"


def test_windows_that_bend_are_proved():
    """Growth in two windows of 7e-4 beside a middle where it only nearly begins."""
    c = 0.52246391
    inner = 6.3e-7
    outer = 2.3e-6

    def f(mu):
        square = (mu - c) ** 2
        return (square - inner) * (square - outer) / (square**2 + 3.3e-5)

    one = np.array([[2.0, 0.0], [1.0, 2.0]])
    terms = Terms([Term(np.eye(2))], [], [Term(one), Term(FRICTION, f)])
    near = np.sqrt(inner)
    far = np.sqrt(outer)
    places = [c - far, c - near, c + near, c + far]
    windows = [around(place, 1e-9) for place in places]
    assert prove_thresholds(terms, 0.4, 0.6, windows, 1e-5).status == "proved"
    assert prove_thresholds(terms, 0.4, 0.6, [], 1e-5).status == "refuted"
    assert prove_thresholds(terms, 0.4, 0.6, windows[:2], 1e-5).status == "refuted"


def test_symmetry_is_read_from_terms_not_from_their_sum():
    """At mu = 0, where roots are counted, K is symmetric, elsewhere it is not."""
    twist = np.array([[0.0, 1.0], [-1.0, 0.0]])
    terms = Terms([Term(np.eye(2))], [], [Term(np.eye(2)), Term(twist, lambda mu: mu)])
    assert not terms.is_gyroscopic
    assert prove_thresholds(terms, -INSIDE_SHARE, 1.0 - INSIDE_SHARE, [], 1e-8).status != "proved"


def test_a_pole_of_a_factor_is_open():
    terms = Terms([Term(np.eye(2))], [], [Term(SPRINGS), Term(FRICTION, lambda mu: 1 / mu)])
    proof = prove_thresholds(terms, -1.0, 1.0, [], 1e-6)
    assert proof.status in ("open", "refuted")


@pytest.mark.parametrize("damped", [False, True])
def test_systems_with_thresholds_in_closed_form_are_proved(damped):
    for seed in range(2):
        system, expected = known_system(5, np.random.default_rng(seed), damped)
        M, C, K = [terms_of(part) for part in system.parts]
        values = sorted({event[0] for event in expected})
        intervals = [around(value, 1e-9) for value in values]
        provider = Terms(M, C, K)
        assert prove_thresholds(provider, 0.0, 2.0, intervals, 1e-4).status == "proved"
        for k in range(len(intervals)):
            rest = intervals[:k] + intervals[k + 1 :]
            assert prove_thresholds(provider, 0.0, 2.0, rest, 1e-4).status == "refuted"


@pytest.mark.parametrize("entry", [2**53 + 1, np.longdouble(1) / 3])
def test_entries_that_no_double_holds_are_refused(entry):
    """They would be rounded, and then something proved of other numbers."""
    matrix = np.array([[entry, 0], [0, entry]])
    with pytest.raises(ValueError, match="more digits than a double"):
        Terms([Term(np.eye(2))], [], [Term(matrix)])
    with pytest.raises(InputError, match="more digits than a double"):
        System(np.eye(2), K={"1": np.eye(2), "mu": matrix})
    assert System(np.eye(2), K=matrix.astype(float)).n == 2


@pytest.mark.parametrize("damped", [False, True])
def test_dense_systems_are_proved_in_few_steps(damped):
    """Twelve rows, turned so that each row holds all motions."""
    system, expected = known_system(12, np.random.default_rng(2), damped)
    Q = np.linalg.qr(np.random.default_rng(5).standard_normal((12, 12)))[0]
    M, C, K = [terms_of(part, Q) for part in system.parts]
    values = sorted({event[0] for event in expected})
    assert len(values) > 1
    provider = Terms(M, C, K, HALF_ULP)
    intervals = [around(value, 1e-9) for value in values]
    proof = prove_thresholds(provider, 0.0, 2.0, intervals, 1e-5, most=400)
    assert proof.status == "proved"
    assert prove_thresholds(provider, 0.0, 2.0, intervals[1:], 1e-5).status == "refuted"
    spent = prove_thresholds(provider, 0.0, 2.0, intervals, 1e-5, most=5)
    assert (spent.status, "steps" in spent.reason) == ("open", True)


def lossy(centre: float, width: float, damped: bool) -> Terms:
    """A mode whose loss factor is negative within a window of this width, and one that decays.

    With damping the stiffness is that of the roots i w + g and -1 - i w, g = width^2 / 4 - (mu -
    centre)^2 and w = 20.
    """
    offset = width**2 / 4 - centre**2
    decays = np.diag([0.0, 900.0 + 45.0j])
    only = np.diag([1.0, 0.0])
    C = []
    unit = -400.0j
    constant = 400.0 + 0.0j
    if damped:
        unit = -1.0 - 20.0j  # g enters K by (i w + g) (-1 - i w), and C by -g
        constant = 400.0 - 20.0j
        of_mu = [Term(-offset * only), Term(-2 * centre * only, lambda mu: mu)]
        C = [Term(np.diag([1.0, 2.0])), *of_mu, Term(only, lambda mu: mu**2)]
    K = [
        Term(decays + (constant + offset * unit) * only),
        Term(2 * centre * unit * only, lambda mu: mu),
        Term(-unit * only, lambda mu: mu**2),
    ]
    return Terms([Term(np.eye(2))], C, K, HALF_ULP)


@pytest.mark.parametrize("damped", [False, True])
def test_roots_above_the_real_axis_count_in_complex_systems(damped):
    """Those below grow throughout without damping, as the mirror images of those above."""
    terms = lossy(0.4375, 2.0**-9, damped)
    ends = [around(0.4375 - 2.0**-10, 1e-9), around(0.4375 + 2.0**-10, 1e-9)]
    assert prove_thresholds(terms, 0.0, 1.0, ends, 1e-9, rises=[2, -2]).status == "proved"
    missed = prove_thresholds(terms, 0.0, 1.0, [], 1e-9)
    assert missed.status == "refuted"
    assert abs(missed.where - 0.4375) < 2.0**-10


def test_each_component_takes_steps_of_its_own(monkeypatch):
    """Of eight rows each loses its stability at a place of its own. All of them were enclosed anew
    at each step, as many times eight components as there were steps; now each takes its own."""
    places = np.linspace(0.11, 0.93, 8)
    stiffness = np.linspace(1.0, 8.0, 8) ** 2
    falling = Term(np.diag(-stiffness / places), lambda mu: mu)
    terms = Terms([Term(np.eye(8))], [], [Term(np.diag(stiffness)), falling], HALF_ULP)
    looked_at = []

    def counted(component, low, high, rate):
        looked_at.append((low, high))
        return bounds_between(component, low, high, rate)

    monkeypatch.setattr("squeal.proof.ranges.bounds_between", counted)
    intervals = [around(place) for place in places]
    proof = prove_thresholds(terms, 0.0, 1.0, intervals, 1e-8, rises=[1] * 8)
    assert proof.status == "proved"
    values_and_gaps = 9 * (1 + 2 + 1)  # of each gap: a value, both ends, the whole of it
    of_intervals = 8 * 3  # each as a whole and at both ends, for roots that cross unseen
    assert len(looked_at) == 8 * (values_and_gaps + of_intervals)
    missed = prove_thresholds(terms, 0.0, 1.0, intervals[1:], 1e-8, rises=[1] * 7)
    assert missed.status == "refuted"


def test_a_rate_above_all_roots_hides_no_change_of_what_grows():
    """q'' + (3 - 4 mu) q' + q grows from 3/4 on, by less than the rate."""
    damping = [Term(np.array([[3.0]])), Term(np.array([[-4.0]]), lambda mu: mu)]
    terms = Terms([Term(np.eye(1))], damping, [Term(np.eye(1))], HALF_ULP)
    proof = prove_thresholds(terms, 0.0, 2.0, [], growth_below=1e3)
    assert proof.status == "refuted"


def test_a_factor_with_a_pole_between_two_values_leaves_no_frequency():
    friction = Term(FRICTION, lambda mu: 1 / mu)
    terms = Terms([Term(np.eye(2))], [], [Term(SPRINGS), friction], HALF_ULP)
    assert frequency_on_axis(terms, -0.5, 0.5, np.sqrt(2.0)) is None
