"""Crossings exactly at an end of the range, several of them at once, against closed forms."""

import numpy as np
import pytest

import squeal
from squeal.linear import thresholds
from tests.known import system_of

W = np.array([1.0, 1.7, 2.9, 4.1, 5.3])
STARTS = [
    ((0.5, 1.0, -0.5), 0.0),
    ((0.1, 0.7, 0.3, -0.004, -1.0), 0.3),
    ((0.9, 0.02, 0.4, 0.0, 0.2), 0.3),
    ((-0.5, -1.0, -0.1), 0.3),
]


def oscillators(rates, at=0.0, power=1, mix=0.3, omegas=W, others=0.3):
    """Oscillators that grow by rate (mu - at)^power, damped by `others`, mixed; the system once as
    a function and once in terms."""
    rng = np.random.default_rng(5)
    n = len(rates)
    L = np.eye(n) + mix * rng.normal(size=(n, n)) / np.sqrt(n)
    R = np.eye(n) + mix * rng.normal(size=(n, n)) / np.sqrt(n)
    moving = np.array(rates) != 0.0
    fixed = L @ np.diag(np.where(moving, 0.0, others)) @ R
    D = L @ np.diag(-2.0 * np.array(rates)) @ R
    K = L @ np.diag(np.array(omegas)[:n] ** 2) @ R

    def system(mu):
        return L @ R, fixed + D * (mu - at) ** power, K

    return system, system_of(L @ R, (fixed, (D, f"(mu - {at})**{power}")), K)


def omegas_of(result):
    return [2 * np.pi * c.frequency_hz for c in result.crossings]


@pytest.mark.parametrize(("power", "which"), [(1, 0), (2, 1)])
@pytest.mark.parametrize(("rates", "mix"), STARTS)
def test_each_pair_that_grows_from_the_start_is_listed_once_the_fastest_first(
    rates, mix, power, which
):
    result = thresholds(oscillators(rates, power=power, mix=mix)[which], 1.0)
    order = [k for k in np.argsort(rates)[::-1] if rates[k] > 0.0]
    expected = [(0.0, "flutter", "up")] * len(order)
    assert [(c.mu, c.kind, c.direction) for c in result.crossings] == expected
    assert omegas_of(result) == pytest.approx(W[order], rel=1e-9)
    assert [c.mode for c in result.crossings] == [1 + k for k in order]
    assert [c.changes_verdict for c in result.crossings] == [k == 0 for k in range(len(order))]
    assert [(p.mu, p.kind) for p in result.points] == ([(0.0, "flutter")] if order else [])
    for point in result.points:
        assert 2 * np.pi * point.frequency_hz == pytest.approx(W[order[0]], rel=1e-9)
    assert result.certified is not False


@pytest.mark.parametrize("seed", [9, 18])
def test_pairs_of_one_frequency_that_grow_from_the_start_are_all_listed(seed):
    """Of a double root no eigenvector is known, and Newton's method not sure."""
    rng = np.random.default_rng(seed)
    rates = (*rng.uniform(-1.0, 1.0, 2), *rng.uniform(0.2, 1.0, 3))
    assert rates[0] * rates[1] < 0.0
    result = thresholds(oscillators(rates, omegas=(3.0, 3.0, 1.7, 2.3, 1.0), mix=0.8)[1], 1.0)
    assert [c.mu for c in result.crossings] == [0.0] * 4
    assert sorted(omegas_of(result)) == pytest.approx([1.0, 1.7, 2.3, 3.0], rel=1e-4)
    assert result.certified is not False


@pytest.mark.parametrize("rates", [(0.5, 1.0, -0.5), (0.3, -0.01, -0.6, 0.0, 0.9)])
@pytest.mark.parametrize(("end", "which"), [(1.0, 0), (0.3, 1)])
def test_damped_thresholds_exactly_at_the_end_are_listed(end, rates, which):
    """As coalescences without damping are; where the range ends a little before, none is there."""
    system = oscillators(rates, at=end)[which]
    moving = np.flatnonzero(rates)
    for high in (end, end * (1 + 1e-10)):
        result = thresholds(system, high)
        assert [c.mu for c in result.crossings] == pytest.approx([end] * len(moving), rel=1e-12)
        ways = dict(zip(np.round(omegas_of(result), 6), result.crossings, strict=True))
        expected = {W[k]: "up" if rates[k] > 0 else "down" for k in moving}
        assert {w: c.direction for w, c in ways.items()} == expected
        assert result.certified is not False
    assert thresholds(system, end * (1 - 1e-8)).crossings == []


@pytest.mark.parametrize("rows", [2, 3, 4])
def test_undamped_modes_that_coalesce_where_the_range_ends_at_zero(rows):
    """omega^2 = 4 +- sqrt(1 - (1 + mu)^2): two beneath zero, a growing pair beyond."""

    def system(mu):
        K = np.diag([5.0, 3.0, 11.0, 13.0])[:rows, :rows]
        K[0, 1] = 1 + mu
        K[1, 0] = -1 - mu
        return np.eye(rows), None, K

    for end in (0.0, 1e-11):
        result = thresholds(system, end, mu_min=-1.0)
        assert [c.mu for c in result.crossings] == pytest.approx([0.0], abs=1e-12)
        assert [c.direction for c in result.crossings] == ["up"]
        assert [p.kind for p in result.points] == ["flutter"]


@pytest.mark.parametrize(
    ("rates", "mix", "omegas"),
    [
        ((0.4, 0.4, 0.9), 0.0, [1.0, 1.0, 1.7]),
        ((0.4, 0.4, 0.9), 0.3, [1.0, 1.0, 1.7]),
        ((0.4, -0.6, 0.0), 0.0, [1.0, 1.0]),  # one begins where the other ceases
    ],
)
def test_equal_oscillators_pass_the_axis_together(rates, mix, omegas):
    result = thresholds(oscillators(rates, at=0.5, mix=mix, omegas=(1.0, 1.0, 1.7))[1], 1.0)
    assert [c.mu for c in result.crossings] == pytest.approx([0.5] * len(omegas), rel=1e-12)
    ways = sorted("up" if rate > 0 else "down" for rate in rates if rate)
    assert sorted(c.direction for c in result.crossings) == ways
    assert sorted(omegas_of(result)) == pytest.approx(omegas, rel=1e-7)
    assert result.certified is not False


@pytest.mark.parametrize("twice", [False, True])
def test_undamped_modes_that_coalesce_at_the_start(twice):
    """omega^2 = 4 +- i a mu and, if twice, 9 +- i b mu: rates of a mu / 4 and b mu / 6."""
    K0 = np.diag([4.0, 4.0, 9.0, 9.0 if twice else 11.0])
    K1 = np.zeros((4, 4))
    K1[0, 1] = 1.0
    K1[1, 0] = -1.0
    K1[2, 3] = 2.0 * twice
    K1[3, 2] = -2.0 * twice
    result = thresholds(lambda mu: (np.eye(4), None, K0 + mu * K1), 1.0)
    omegas = [3.0, 2.0] if twice else [2.0]
    assert [c.mu for c in result.crossings] == [0.0] * len(omegas)
    assert omegas_of(result) == pytest.approx(omegas, rel=1e-6)
    assert [2 * np.pi * p.frequency_hz for p in result.points] == pytest.approx(omegas[:1])


@pytest.mark.parametrize("damping", [0.0, 0.3])
@pytest.mark.parametrize("stiffness", ["-mu", "mu", "-mu**2"])
def test_what_is_at_rest_at_the_start_diverges_there_or_not_at_all(damping, stiffness):
    """A coordinate whose stiffness leaves zero, beside an oscillator."""
    rng = np.random.default_rng(2)
    L = np.eye(2) + 0.3 * rng.normal(size=(2, 2))
    R = np.eye(2) + 0.3 * rng.normal(size=(2, 2))
    still = L @ np.diag([0.0, 4.0]) @ R
    moving = L @ np.diag([1.0, 0.0]) @ R
    C = damping * (L @ R) if damping else None
    found = thresholds(system_of(L @ R, C, (still, (moving, stiffness))), 1.0)
    expected = [] if stiffness == "mu" else [(0.0, "divergence", "up", True)]
    shown = [(c.mu, c.kind, c.direction, c.changes_verdict) for c in found.crossings]
    assert shown == expected
    assert [(p.mu, p.kind) for p in found.points] == [each[:2] for each in expected]


@pytest.mark.parametrize("beyond", [1e-8, 1e-15])
@pytest.mark.parametrize("end", ["low", "high"])
@pytest.mark.parametrize(("stiffness", "damping"), [(1e-7, 1e4), (1e-7, 1.0), (1e-1, 100.0)])
def test_the_interval_of_a_threshold_holds_one_just_beyond_the_end(stiffness, damping, end, beyond):
    """One row, k (value - mu) with heavy damping: rounding hides on which side of the end it is."""
    value = 0.3 * (1.0 - beyond) if end == "low" else 1.7 * (1.0 + beyond)
    K = {f"{value!r} - mu": [[stiffness]]}
    answer = squeal.thresholds(squeal.System([[1.0]], [[damping]], K), 1.7, 0.3, prove=False)
    for crossing in answer.crossings:
        assert crossing.interval[0] <= value <= crossing.interval[1]


@pytest.mark.parametrize("high", [1.0, 1e3])
@pytest.mark.parametrize("beyond", [1e-10, 1e-9, 3e-9])
def test_of_two_coalescences_the_one_beyond_the_end_is_listed_at_the_end(high, beyond):
    """Squares of frequencies a and a + 1 coalesce at `high`, others a little beyond."""
    couplings = [0.5 / high, 0.5 / (high * (1.0 + beyond))]
    K1 = np.zeros((4, 4))
    for k, coupling in zip((0, 2), couplings, strict=True):
        K1[k, k + 1] = coupling
        K1[k + 1, k] = -coupling
    K0 = np.diag([10.0, 11.0, 40.0, 41.0])
    crossings = thresholds(squeal.System(np.eye(4), K={"1": K0, "mu": K1}), high).crossings
    assert len(crossings) == 2
    for crossing, coupling in zip(crossings, couplings, strict=True):
        first, last = crossing.interval
        assert first <= crossing.mu <= last
        assert first <= 0.5 / coupling <= last
        assert crossing.mu <= high
