"""Where verdicts change, against closed forms: growth that changes hands, pairs that meet."""

import itertools

import numpy as np
import pytest

from squeal.linear import thresholds
from tests.known import affine

RANGES = [3.0, 100.0, 1e4]


def mixed(rng, *matrices):
    """The same roots under a transformation that leaves nothing symmetric."""
    n = len(matrices[0])
    L = np.eye(n) + 0.3 * rng.normal(size=(n, n))
    R = np.eye(n) + 0.3 * rng.normal(size=(n, n))
    return [L @ np.asarray(X, dtype=float) @ R for X in matrices]


@pytest.mark.parametrize("high", [2.005, 2.1, 1e4])
def test_a_growing_pair_that_meets_crosses_only_where_a_root_passes_zero(high):
    """s^2 - 40 s + k: two real roots from k = 400 on, one of which passes zero at k = 0."""
    system = affine(np.eye(2), np.diag([4e4, 1e8]), np.diag([-1.97e4, 0]), np.diag([-40, 1]))
    found = thresholds(system, high)
    meets = (4e4 - 400) / 1.97e4
    passes = 4e4 / 1.97e4
    beyond = high > passes
    assert [(c.kind, c.direction) for c in found.crossings] == [("divergence", "down")] * beyond
    assert [c.mu for c in found.crossings] == pytest.approx([passes] * beyond, rel=1e-12)
    assert not any(c.changes_verdict for c in found.crossings)
    assert [p.kind for p in found.points] == ["divergence"] * beyond
    where = [(p.mu, *p.interval, p.frequency_hz) for p in found.points]
    where += [(c.mu, *c.interval, c.frequency_hz) for c in found.crossings]
    for at, (mu, low, high, hertz) in zip((meets, passes), where, strict=False):
        assert mu == pytest.approx(at, rel=1e-11)
        assert low <= at <= high <= low + 1e-10
        assert hertz == 0.0
    assert found.certified is not False


@pytest.mark.parametrize("high", [1e7, 1e9, 1e12])
def test_what_a_range_too_long_hides_is_not_certified(high):
    """x'' + 0.1 x' + (0.2 - mu) x = 0 diverges from mu = 0.2 on."""
    found = thresholds(affine(*np.array([1.0, 0.2, -1.0, 0.1])[:, None, None]), high)
    (crossing,) = found.crossings
    assert crossing.interval[0] <= 0.2 <= crossing.interval[1]
    assert crossing.mu == pytest.approx(0.2, rel=1e-6) or not found.certified


@pytest.mark.parametrize("high", RANGES)
@pytest.mark.parametrize("back", [False, True])
def test_verdicts_change_where_growth_changes_hands_and_not_where_a_root_passes(high, back, rng):
    """A pair that grows at g beside r^2 + c r + k = 0: r passes zero at k = 0 and g at -g^2 - c g;
    close to both a further pair of little damping starts to grow."""
    g = 0.05
    c = 0.3
    w = 6.0
    where = 0.7 if back else 0.2
    sign = -1.0 if back else 1.0
    K0 = np.diag([w * w, sign * where, 2.0, 30.0])
    K1 = np.diag([0.0, -sign, 0.0, 0.0])
    C0 = np.diag([-2 * g, c, 0.4, 0.5])
    found = thresholds(affine(*mixed(rng, np.eye(4), K0, K1, C0)), high)
    hands = where + sign * (g * g + c * g)
    kind = "flutter" if back else "divergence"
    (crossing,) = found.crossings
    (point,) = found.points
    assert (crossing.kind, crossing.direction) == ("divergence", "down" if back else "up")
    assert crossing.mu == pytest.approx(where, rel=1e-11)
    assert not crossing.changes_verdict
    assert (point.kind, point.converged) == (kind, True)
    assert point.mu == pytest.approx(hands, rel=1e-10)
    assert point.interval[0] <= hands <= point.interval[1] <= point.interval[0] + 1e-8
    omega = np.sqrt(w * w - g * g) if kind == "flutter" else 0.0
    assert 2 * np.pi * point.frequency_hz == pytest.approx(omega, rel=1e-8)
    assert found.certified is not False


@pytest.mark.parametrize("k", [1e-4, 1e-8])
def test_a_pair_that_meets_soon_after_it_began_to_grow_is_flutter_first(k):
    """s^2 - 2 (mu - 0.2) s + k: a pair until mu = 0.2 + sqrt(k)."""
    C = np.diag([0.4, 0.3]), np.diag([-2.0, 0.0])
    found = thresholds(affine(np.eye(2), np.diag([k, 4.0]), None, *C), 2.0)
    assert [(c.kind, c.direction) for c in found.crossings] == [("flutter", "up")]
    assert [p.kind for p in found.points] == ["flutter", "divergence"]
    assert [p.mu for p in found.points] == pytest.approx([0.2, 0.2 + np.sqrt(k)], rel=1e-8)


def test_two_real_roots_that_join_are_flutter_of_no_frequency_there(rng):
    """s^2 - 2 g s + k: real until k = g^2, beside a pair that grows less."""
    g = 0.8
    diagonals = [1, 1, 1], [0.2, 50.0, 9.0], [1, 0, 0], [-2 * g, -0.1, 0.5]
    found = thresholds(affine(*mixed(rng, *(np.diag(np.array(d, float)) for d in diagonals))), 2.0)
    assert found.crossings == []
    (point,) = found.points
    assert (point.kind, point.frequency_hz) == ("flutter", 0.0)
    assert point.mu == pytest.approx(g * g - 0.2, rel=1e-9)


@pytest.mark.parametrize("apart", [0.0, 1e-3])
def test_growth_that_begins_where_other_growth_ends(apart, rng):
    """A pair's damping 2 a (mu - 0.7) turns positive where another root passes zero, or before."""
    diagonals = [
        *([1, 1, 1], [9.0, 0.7 + apart, 20.0], [0.0, -1.0, 0.0]),
        *([-0.14, 0.3, 0.2], [0.2, 0.0, 0.0]),
    ]
    system = affine(*mixed(rng, *(np.diag(np.array(d, float)) for d in diagonals)))
    for high in (1.5, 40.0):
        found = thresholds(system, high)
        ways = {(c.kind, c.direction, c.changes_verdict) for c in found.crossings}
        assert ways == {("flutter", "down", True), ("divergence", "up", True)}
        crossed = sorted(c.mu for c in found.crossings)
        assert crossed == pytest.approx([0.7, 0.7 + apart], rel=1e-10)
        kinds = ["restabilised", "divergence"] if apart else ["divergence"]
        assert [p.kind for p in found.points] == kinds
        assert found.points[-1].mu == pytest.approx(0.7 + apart, rel=1e-10)


@pytest.mark.parametrize("seed", [0, 1, 3])
def test_random_systems_with_negative_damping_say_the_same_on_all_ranges(seed):
    """And as NumPy's roots: their number and the verdict on both sides of each place."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 9))
    k = 10 ** rng.uniform(-1, 3, n)
    c = rng.uniform(0.01, 1.5, n) * np.where(rng.random(n) < 0.4, -1, 1)
    K1 = 0.3 * rng.normal(size=(n, n)) - np.diag(rng.uniform(0, 1.5, n))
    size = np.sqrt(np.outer(k, k))
    M, K0, K1, C = mixed(rng, np.eye(n), np.diag(k), K1 * size, np.diag(c * np.sqrt(k)))

    def all_roots(mu):
        A = np.linalg.solve(M, K0 + mu * K1)
        B = np.linalg.solve(M, C)
        return np.linalg.eigvals(np.block([[np.zeros((n, n)), np.eye(n)], [-A, -B]]))

    def seen(mu):
        roots = all_roots(mu)
        first = roots[np.argmax(roots.real)]
        grows = "divergence" if abs(first.imag) < 1e-6 * abs(first) else "flutter"
        return int((roots.real > 0).sum()), grows if first.real > 0 else "restabilised"

    numbers = []
    words = []
    for high in (1.0, 2.7, 100.0):
        found = thresholds(affine(M, K0, K1, C), high)
        assert found.certified is not False
        crossed = [x for x in found.crossings if x.mu < 1.0]
        points = [x for x in found.points if x.mu < 1.0]
        kinds = [(x.kind, x.direction, x.mode, x.changes_verdict) for x in crossed]
        words.append((kinds, [x.kind for x in points]))
        both = [(x.mu, x.frequency_hz) for x in crossed], [(x.mu, x.frequency_hz) for x in points]
        numbers.append(np.concatenate(both))
        assert words[-1] == words[0]
        assert np.allclose(numbers[-1], numbers[0], rtol=1e-7, atol=1e-8)
    beside = 1e-7
    for x in crossed:
        slower = np.abs(all_roots(x.mu).imag) < 2 * np.pi * x.frequency_hz * (1 - 1e-6)
        assert x.mode == 1 + np.sum(slower) // 2
        rise = (1 if x.direction == "up" else -1) * (2 if x.kind == "flutter" else 1)
        assert seen(x.mu * (1 + beside))[0] - seen(x.mu * (1 - beside))[0] == rise
    for point in points:
        before = seen(point.mu * (1 - beside))[1]
        after = seen(point.mu * (1 + beside))[1]
        assert before != after == point.kind
    grid = np.linspace(1e-4, 1.0, 201)
    for a, b in itertools.pairwise(grid):
        if seen(a)[1] != seen(b)[1]:
            assert any(a <= x.mu <= b for x in points)


@pytest.mark.parametrize(("high", "gap"), [(1.0, 1e-2), (3.0, 1e-3), (100.0, 1e-4)])
@pytest.mark.parametrize("leads", [True, False])
def test_a_real_root_overtakes_a_pair_just_after_another_pair_has_met(high, gap, leads, rng):
    """Roots 0.2 +- sqrt(mu - 1/3), met at 1/3, beside a pair that grows by 0.2 + gap: the greater
    one leads gap^2 later; or, by 0.2 - gap, it never leads near there."""
    at = 1 / 3
    g = 0.2
    w = 4.0
    other = g + gap if leads else g - gap
    C0 = np.diag([-2 * g, -2 * other, 0.3])
    K0 = np.diag([g * g + at, w * w, 9.0])
    K1 = np.diag([-1.0, 0.0, 0.0])
    K1[0, 1:] = 50.0, 20.0  # moves no root, but vectors
    found = thresholds(affine(*mixed(rng, np.eye(3), K0, K1, C0)), high)
    (point,) = (p for p in found.points if p.mu < 0.35)
    hands = at + gap**2 * leads
    assert point.kind == "divergence"
    assert point.mu == pytest.approx(hands, rel=1e-11 if leads else 1e-9)
    assert point.interval[0] <= hands * (1 + 1e-15)
    assert point.interval[1] >= hands * (1 - 1e-15)
