"""Thresholds of larger systems: known blocks under non-orthogonal transformations, both counts."""

import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from squeal.errors import InputError
from squeal.linear import thresholds
from squeal.linear.following import locate
from squeal.linear.following.line import Line
from squeal.linear.following.locate import located
from squeal.linear.following.pairs import NUDGE, pair_at
from squeal.linear.following.search import _bisected, search
from squeal.linear.following.sign import count_right
from squeal.linear.following.steps import _Step
from squeal.linear.following.windows import Guess
from squeal.linear.system import Term, TermSystem
from squeal.numerics.formula import Formula
from tests.known import known_system


@pytest.mark.parametrize("seed", range(20))
def test_every_known_threshold_is_found_and_none_invented(seed):
    rng = np.random.default_rng(seed)
    system, expected = known_system(int(rng.integers(4, 32)), rng, damped=bool(seed % 2))
    found = thresholds(system, 2.0)
    assert found.certified
    crossings = sorted((c.mu, c) for c in found.crossings)
    assert len(crossings) == len(expected)
    for (mu, c), (at, kind, direction, omega) in zip(crossings, expected, strict=True):
        assert (c.kind, c.direction) == (kind, direction)
        assert mu == pytest.approx(at, rel=1e-9)
        assert c.interval[0] - 1e-14 <= at <= c.interval[1] + 1e-14
        assert 2 * np.pi * c.frequency_hz == pytest.approx(omega, rel=1e-7, abs=1e-7)


def test_eigenvalues_are_followed_by_one_thread():
    def threads():
        return max(one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas")

    seen = set()

    def system(mu):
        seen.add(threads())
        return np.eye(4), 0.01 * np.eye(4), np.diag([1.0, 2.0, 3.0, 4.0]) + mu * coupling

    coupling = np.zeros((4, 4))
    coupling[0, 1], coupling[1, 0] = 1.0, -1.0
    with threadpool_limits(2):
        found = thresholds(system, 2.0)
        assert threads() == 2
    assert found.certified
    assert 1 in seen


def test_a_blas_that_is_loaded_late_has_one_thread_too():
    lines = (
        "from squeal.numerics.threads import one_thread",
        "from threadpoolctl import threadpool_info",
        "with one_thread():",
        "    import scipy.linalg",
        "    print({one['num_threads'] for one in threadpool_info() if one['user_api'] == 'blas'})",
    )
    call = [sys.executable, "-c", "\n".join(lines)]
    surroundings = {**os.environ, "OPENBLAS_NUM_THREADS": "2"}
    done = subprocess.run(call, env=surroundings, capture_output=True, text=True, check=True)
    assert done.stdout == "{1}\n"


def rotor(discs, speed):
    """A flexible shaft with internal damping: it whirls from a known speed on.

    In complex coordinates r = x + i y: m r'' + (c_e + c_i) r' + (k - i speed c_i) r = 0 with the
    chain's modes, so that each is lost at speed = w (1 + c_e / c_i), Jeffcott's formula.
    """
    k = 1e6 * (2 * np.eye(discs) - np.eye(discs, k=1) - np.eye(discs, k=-1))
    internal, external = 1e-4 * k, 3.0 * np.eye(discs)
    zero = np.zeros((discs, discs))
    C = np.block([[internal + external, zero], [zero, internal + external]])
    K = np.block([[k, speed * internal], [-speed * internal, k]])
    return np.eye(2 * discs), C, K


def test_a_rotor_is_lost_at_the_speeds_of_jeffcotts_formula():
    n = 15
    found = thresholds(lambda speed: rotor(n, speed), 1500.0)
    squares = 1e6 * (2 - 2 * np.cos(np.pi * np.arange(1, n + 1) / (n + 1)))
    lost = np.sqrt(squares) * (1 + 3.0 / (1e-4 * squares))
    lost = np.sort(lost[lost < 1500.0])
    assert len(lost) > 5
    assert [c.mu for c in found.crossings] == pytest.approx(lost, rel=1e-11)
    assert all(c.direction == "up" for c in found.crossings)
    assert found.certified
    (first,) = found.points
    assert first.converged
    assert first.mu == pytest.approx(lost[0], rel=1e-11)


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize(("sign", "ends"), [(1.0, None), (1.0, 0.7), (-1.0, 0.7)])
def test_a_mode_that_is_undamped_at_the_start_grows_from_there_or_not(order, sign, ends, rng):
    """Its growth rate is a mu^order (mu - end), of which rounding hides the start."""
    L, R = (np.eye(5) + 0.4 * rng.normal(size=(5, 5)) for _ in range(2))
    w = np.array([1.0, 1.5, 2.1, 3.3, 4.7])

    def system(mu):
        a = sign * mu**order * (1.0 if ends is None else ends - mu)
        C = np.diag([-0.2 * a, 0.02, 0.03, 0.04, 0.05])
        return L @ R, L @ C @ R, L @ np.diag(w * w) @ R

    found = thresholds(system, 2.0)
    expected = [(0.0, "up")] if sign > 0 else []
    if ends is not None:
        expected.append((ends, "down" if sign > 0 else "up"))
    assert [c.direction for c in found.crossings] == [way for _, way in expected]
    for c, (mu, _) in zip(found.crossings, expected, strict=True):
        assert c.mu == pytest.approx(mu, rel=1e-9)
        assert 0.0 <= c.interval[0] <= mu <= c.interval[1] < mu + 1e-3
        assert 2 * np.pi * c.frequency_hz == pytest.approx(1.0, rel=1e-3)


def test_bisection_places_growth_where_it_begins_and_not_at_the_start():
    """Against closed forms: a rate of (mu - 0.5)/10; two modes that couple where mu = 0.3."""

    def decays_at_first(mu):
        return np.eye(4), np.diag([0.1 - 0.2 * mu, 0.1, 0.1, 0.1]), np.diag([1.0, 2.0, 3.0, 4.0])

    def couples(mu):
        K = np.diag([1.0, 1.6, 3.0, 4.0])
        K[0, 1], K[1, 0] = mu, -mu
        return np.eye(4), None, K

    for system, at in ((decays_at_first, 0.5), (couples, 0.3)):
        line = Line(system, 0.0, 1.0)
        ((one,),) = _bisected(line, 0.0, 1.0, [])
        assert one.value == pytest.approx(at, abs=1e-6)
        assert one.interval[0] > 0.49 * at
        assert one.interval[0] <= at <= one.interval[1]


def test_bisection_goes_on_beyond_a_crossing_that_is_known():
    def system(mu):
        return np.eye(4), None, np.diag([1 - mu, 1.001 - mu, 7.0, 9.0])

    line, x = Line(system, 0.0, 2.0), np.eye(4)[0].astype(complex)
    first = located(line, Guess(0.99, 0j, x, x, False, 0.1))
    assert first.value == pytest.approx(1.0, rel=1e-15)
    places = _bisected(line, 0.5, 1.5, [first])
    assert [p.value for (p,) in places] == pytest.approx([1.0, 1.001], rel=1e-9)
    assert {p.kind for (p,) in places} == {"divergence"}
    assert [p.value for (p,) in _bisected(line, 0.5, 1.0005, [first])] == [first.value]


def test_two_real_roots_that_pass_zero_in_one_step_are_both_located():
    def system(mu):
        return np.eye(4), None, np.diag([10 * (0.4 - mu), 3 * (0.6 - mu), 50.0, 70.0])

    line = Line(system, 0.0, 1.0)
    step = _Step(line, line.at(0.0), line.at(1.0))
    small = np.flatnonzero(np.abs(step.za) < 10)
    found = {round(located(line, g).value, 9) for g in step._pair(*small)}
    assert found == {0.4, 0.6}


@pytest.mark.parametrize("times", [1, 2])
def test_a_coalescence_that_is_told_badly_is_sought_again_beside(monkeypatch, mode_coupling, times):
    """As where the vectors a pair begins from turn to those of a third root; or rounding is all."""
    exact, begun = locate._coalescence, []

    def badly(line, guess):
        begun.append(guess.value)
        found = exact(line, guess)
        if len(begun) > times:
            return found
        return replace(found, value=found.value + 1e-6, interval=(0.75 - 1e-3, 0.75 + 1e-3))

    monkeypatch.setattr(locate, "_coalescence", badly)
    line = Line(mode_coupling, 0.0, 2.0)
    state = line.at(0.7)
    found = located(line, Guess(0.74, 2 + 0j, state.right, state.left, True, 0.2))
    assert len(begun) == 2
    assert (abs(found.value - 0.75) < 1e-12) == (times == 1)
    assert found.interval[0] <= 0.75 <= found.interval[1]


def test_two_modes_that_hardly_couple_flutter_in_a_short_window():
    """s = 4 + mu and 5 with K12 K21 = -eps^2: flutter for |1 - mu| < 2 eps, far below a step."""
    eps = 1e-5
    M = np.eye(5)
    K0 = np.diag([4.0, 5.0, 11.0, 12.0, 13.0])
    K0[0, 1], K0[1, 0] = eps, -eps
    K1 = np.diag([1.0, 0, 0, 0, 0])
    found = thresholds(lambda mu: (M, None, K0 + mu * K1), 2.0)
    assert [c.direction for c in found.crossings] == ["up", "down"]
    assert [c.mu for c in found.crossings] == pytest.approx([1 - 2 * eps, 1 + 2 * eps], abs=1e-12)
    K0[1, 0] = eps  # veering instead
    assert thresholds(lambda mu: (M, None, K0 + mu * K1), 2.0).crossings == []


def test_weak_damping_does_not_blur_the_threshold_of_coupled_modes():
    """With equal damping c: flutter from (mu a)^2 = (e / 2)^2 + c^2 s on, s the mean square."""
    for c in (1e-2, 1e-5, 1e-8):
        K0, K1 = np.diag([4.5, 3.5, 20.0, 30.0]), np.zeros((4, 4))
        K1[0, 1], K1[1, 0] = 1.0, -1.0
        terms = (Term(K0), Term(K1, Formula("mu")))
        found = thresholds(TermSystem((Term(np.eye(4)),), (Term(c * np.eye(4)),), terms), 2.0)
        (crossing,) = found.crossings
        assert crossing.mu == pytest.approx(np.sqrt(0.25 + 4 * c * c), rel=1e-10)


def test_a_root_hidden_from_the_search_fails_the_count(monkeypatch):
    from squeal.linear.following import search as module

    system, _ = known_system(12, np.random.default_rng(5), damped=True)
    assert search(system, 0.0, 2.0).certified
    monkeypatch.setattr(module, "count_right", lambda A, x: (count_right(A, x) or 0) + 1)
    assert not search(system, 0.0, 2.0).certified


def test_the_sign_function_counts_eigenvalues(rng):
    for n in (3, 20, 61):
        A = rng.standard_normal((n, n))
        values = np.linalg.eigvals(A)
        for x in (0.0, -0.7):
            assert count_right(A, x) == int(np.sum(values.real > x))
    assert count_right(np.diag([1.0, 0.0])) is None


def test_a_mass_matrix_without_symmetry_is_taken_and_a_singular_one_refused():
    K0, K1 = np.diag([4.5, 3.5, 20.0, 30.0]), np.zeros((4, 4))
    K1[0, 1], K1[1, 0] = 1.0, -1.0
    mixed = np.eye(4) + np.triu(np.full((4, 4), 0.3), 1)
    terms = (Term(mixed @ K0), Term(mixed @ K1, Formula("mu")))
    found = thresholds(TermSystem((Term(mixed),), (), terms), 2.0)
    assert [c.mu for c in found.crossings] == pytest.approx([0.5], rel=1e-10)
    mixed[3] = mixed[2]
    with pytest.raises(InputError, match="regular"):
        thresholds(lambda mu: (mixed, None, K0 + mu * K1), 2.0)


@pytest.mark.parametrize("other", [1.0 + NUDGE, 1.0 + 3 * NUDGE])
def test_a_pair_is_seen_from_a_shift_that_is_one_of_its_roots(other):
    system = TermSystem((Term(np.eye(3)),), (), (Term(np.diag([1.0, other, 5.0])),))
    start = np.eye(3)[:, :2] + 0.1
    pair = pair_at(Line(system, 0.0, 1.0), 0.5, 1.0 + 0j, start, start)
    assert pair.mean == pytest.approx((1.0 + other) / 2, rel=1e-15)
    assert pair.d == pytest.approx(((other - 1.0) / 2) ** 2, rel=1e-6)


@pytest.mark.parametrize("jump", [None, 0.5])
@pytest.mark.parametrize("high", [1.0, 3.0])
def test_a_growing_pair_that_becomes_two_real_roots_is_flutter_before(jump, high):
    # x'' - 2 (p - 0.2) x' + (1 - 0.3 p) x = 0: a pair until (p - 0.2)^2 = 1 - 0.3 p
    def system(p):
        damping = 0.4 if jump is not None and p < jump else -2 * (p - 0.2)
        return np.eye(1), np.array([[damping]]), np.array([[1 - 0.3 * p]])

    found = thresholds(system, high, [] if jump is None else [jump])
    expected = [("flutter", jump or 0.2)]
    if high > 1.1:
        expected.append(("divergence", (0.1 + np.sqrt(3.85)) / 2))
    assert [p.kind for p in found.points] == [kind for kind, _ in expected]
    for point, (_, mu) in zip(found.points, expected, strict=True):
        assert point.mu == pytest.approx(mu, rel=1e-9)
    assert [(c.kind, c.direction) for c in found.crossings] == [("flutter", "up")]
