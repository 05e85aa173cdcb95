"""Intervals hold the threshold of closed forms; no window of growth is missed."""

import itertools
import warnings
from fractions import Fraction

import mpmath as mp
import numpy as np
import pytest
from scipy.sparse import block_diag, csc_array, diags_array, eye_array

import squeal
from squeal.linear import search, thresholds
from squeal.queries.systems.thresholds import system_thresholds
from squeal.results.sources import EigenvalueSelection
from tests.known import affine


def flat_system(kind: str, n: int, power: int, mixed: bool):
    """n degrees of freedom, one of which passes the axis at 0.45 as that power of mu - 0.45."""
    X = np.eye(n) + mixed * np.eye(n, k=1)

    def system(mu):
        C = np.diag([0.0] + [0.1] * (n - 1))
        K = np.diag([4.0, 9.0, 16.0, 25.0][:n])
        f = -((mu - 0.45) ** power)
        if kind == "coalescence":
            K[:2, :2] = [[4.0, f], [1.0, 4.0]]
        else:
            (C if kind == "damping" else K)[0, 0] = f
        return X.T @ X, X.T @ C @ X if kind == "damping" else None, X.T @ K @ X

    return system


@pytest.mark.parametrize(("n", "power", "mixed"), [(2, 3, False), (3, 5, True)])
@pytest.mark.parametrize("kind", ["damping", "stiffness", "coalescence"])
def test_intervals_hold_a_threshold_of_no_slope(kind, n, power, mixed):
    (one,) = thresholds(flat_system(kind, n, power, mixed), 1.0).crossings
    assert (one.direction, one.kind) == ("up", "divergence" if kind == "stiffness" else "flutter")
    low, high = one.interval
    assert low <= 0.45 <= high
    assert low <= one.mu <= high
    assert high - low < 0.02 or power == 5


@pytest.mark.parametrize("tiny", [1e-10, 1e-12, 1e-14])
def test_growth_that_is_not_listed_is_less_than_what_is_proved(tiny):
    """Damping 2 tiny (0.7 - mu) of the first of three mixed modes: up to 1.3 tiny of growth."""
    T = np.eye(3) + 0.3 * np.random.default_rng(1).normal(size=(3, 3))
    diagonals = [1.0, 1, 1], [1.0, 4, 9], [1.4 * tiny, 0.1, 0.2], [-2 * tiny, 0, 0]
    M, K, C0, C1 = (T.T @ np.diag(d) @ T for d in diagonals)
    result = squeal.thresholds(affine(M, K, None, C0, C1), 2.0)
    if tiny < 1e-13:
        assert not result.certified or result.proof["growth_below"] > 1.3 * tiny
        return
    (one,) = result.crossings
    assert one.direction == "up"
    low, high = one.interval
    if result.proof["data"] == "as given":  # rounding of the entries moves the threshold
        matrices = M, K, C0, C1
        assert largest_growth(matrices, low - 1e-15) < 0.0
        assert largest_growth(matrices, high + 1e-15) > 0.0
    else:
        assert low <= 0.7 <= high
    assert result.certified or tiny < 1e-11


def largest_growth(matrices, mu):
    """The largest real part of M, K and C0 + mu C1, three rows, at 50 digits."""
    with mp.workdps(50):
        M, K, C0, C1 = (mp.matrix(X.tolist()) for X in matrices)
        companion = mp.zeros(6)
        for i in range(3):
            companion[i, 3 + i] = 1
        companion[3:, :3] = -mp.inverse(M) * K
        companion[3:, 3:] = -mp.inverse(M) * (C0 + mp.mpf(mu) * C1)
        values, _ = mp.eig(companion)
        return max(mp.re(value) for value in values)


# windows of growth that open and close within a step

TWO = np.diag([33.07, 54.41]), np.array([[27.41, 0.299], [-0.192, -7.667]])
FOUR = np.diag([16.87, 22.37, 64.07, 75.56]), np.array([
    [-12.86, -0.35, -0.31, 0.28], [0.04, 4.06, 0.31, -0.3],
    [0.02, -0.16, -5.46, -0.1], [0.22, -0.23, 0.03, -17.15],
])  # fmt: skip


@pytest.mark.parametrize("most", [0.65, 1.0, 2.0])
def test_two_damped_modes_flutter_in_a_window_known_in_closed_form(most):
    """K's eigenvalues are m +- i e; with C = c the motion is kept up where e^2 = c^2 m."""
    k, K1 = TWO
    c = 5e-4
    difference = np.polynomial.Polynomial([k[0, 0] - k[1, 1], K1[0, 0] - K1[1, 1]]) / 2
    mean = np.polynomial.Polynomial([k[0, 0] + k[1, 1], K1[0, 0] + K1[1, 1]]) / 2
    coupling = np.polynomial.Polynomial([0.0, 0.0, K1[0, 1] * K1[1, 0]])
    expected = np.sort((difference**2 + coupling + c * c * mean).roots().real)
    crossings = thresholds(lambda mu: (np.eye(2), c * np.eye(2), k + mu * K1), most).crossings
    assert [x.direction for x in crossings] == ["up", "down"]
    assert [x.mu for x in crossings] == pytest.approx(expected, rel=1e-11)


@pytest.mark.parametrize("seed", range(2))
def test_windows_of_two_modes_that_only_a_third_one_couples_are_found(seed):
    """They end where the discriminant of the characteristic cubic vanishes, here in fractions."""
    rng = np.random.default_rng([seed, 6])
    at = rng.uniform(0.3, 0.7)
    slope = rng.uniform(1, 3)
    e = 10.0 ** -rng.uniform(1, 3)
    a, b, c, d = e * rng.uniform(0.5, 1.0, 4) * [1, 1, 1, -1]  # a d and b c differ in sign
    K0 = np.array([[4.0 - slope * at, 0, a], [0, 4.0, b], [c, d, 9.0]])
    K1 = np.zeros((3, 3))
    K1[0, 0] = slope
    found = thresholds(affine(np.eye(3), K0, K1), 1.0)
    ac = Fraction(a) * Fraction(c)
    bd = Fraction(b) * Fraction(d)

    def discriminant(p):
        first = Fraction(K0[0, 0]) + Fraction(slope) * p
        T = first + 13
        B = 13 * first + 36 - ac - bd
        D = first * (36 - bd) - 4 * ac
        return T**2 * B**2 - 4 * B**3 - 4 * T**3 * D + 18 * T * B * D - 27 * D**2

    assert [x.direction for x in found.crossings] == ["up", "down"]
    for x in found.crossings:
        ends = [discriminant(Fraction(end)) for end in x.interval]
        assert ends[0] * ends[1] < 0
        assert (ends[1] < 0) == (x.direction == "up")


def where_roots_meet(K0, K1):
    """Real p in (0, 1) at which the discriminant of K0 + p K1 (3, 3) vanishes, to 60 digits."""
    with mp.workdps(60):
        values = []
        for p in range(7):
            X = mp.matrix(K0.tolist()) + p * mp.matrix(K1.tolist())
            a = X[0, 0] + X[1, 1] + X[2, 2]
            c = mp.det(X)
            square = X * X
            b = (a * a - square[0, 0] - square[1, 1] - square[2, 2]) / 2
            terms = a**2 * b**2, -4 * b**3, -4 * a**3 * c, 18 * a * b * c, -27 * c**2
            values.append(sum(terms))
        powers = mp.matrix([[mp.mpf(p) ** k for k in range(7)] for p in range(7)])
        factors = mp.lu_solve(powers, mp.matrix(values))
        companion = mp.zeros(6)
        for k in range(6):
            companion[k, 5] = -factors[k] / factors[6]
            if k:
                companion[k, k - 1] = 1
        roots = mp.eig(companion, left=False, right=False)
        return sorted(float(z.real) for z in roots if abs(z.imag) < 1e-20 and 0 < z.real < 1)


def crossing_modes(rng, n, spread):
    """K0, K1 (n, n) of weakly coupled modes whose stiffnesses cross at nearly one place."""
    slopes = rng.uniform(-4, 4, n)
    at = rng.uniform(0.2, 0.8)
    e = 10.0 ** rng.uniform(-3, -0.5)
    places = at + spread(rng) * rng.normal(size=n)
    F = e * rng.normal(size=(n, n)) * (1 - np.eye(n))
    return np.diag(6.0 - slopes * places), np.diag(slopes), F


def at_one_of_two(rng):
    return rng.choice([1e-3, 3e-2])


def at_any(rng):
    return 10.0 ** rng.uniform(-3.5, -1)


@pytest.mark.parametrize(
    ("seed", "spread"),
    [(seed, at_one_of_two) for seed in (0, 35)]
    # a pair changes its partner within a window; a third root is near where two meet
    + [(seed, at_any) for seed in (159, 261, 804, 2642)],
)
def test_windows_where_three_modes_cross_at_nearly_one_place(seed, spread):
    K0, K1, F = crossing_modes(np.random.default_rng([seed, 79]), 3, spread)
    F[:2, :2] *= seed % 2 == 0
    (K0 if seed % 3 else K1)[...] += F
    found = squeal.thresholds(affine(np.eye(3), K0, K1), 1.0)
    assert found.certified
    assert [x.mu for x in found.crossings] == pytest.approx(where_roots_meet(K0, K1), rel=1e-7)


def test_a_search_that_runs_out_of_values_is_not_certified(monkeypatch):
    """A pair changes its partner within a window: with 50 values that gap is not found."""
    K0 = np.diag([2.98619, 2.486542, 2.503232])
    K1 = (
        np.array([[22.54, -1.776, -0.607], [-0.016, 792.087, 1.245], [1.869, -1.229, 766.303]])
        / 1e3
    )
    known = pytest.approx(where_roots_meet(K0, K1), rel=1e-7)
    for budget in (50, search.BUDGET):
        monkeypatch.setattr(search, "BUDGET", budget)
        found = squeal.thresholds(affine(np.eye(3), K0, K1), 1.0)
        assert found.certified == ([x.mu for x in found.crossings] == known)


@pytest.mark.parametrize("seed", [47, 80])
def test_growth_of_five_modes_at_many_values_follows_from_the_thresholds(seed):
    rng = np.random.default_rng([seed, 1126])
    n = 5
    rng.integers(2)  # the series of draws in which seed 47 was missed
    K0, K1, F = crossing_modes(rng, n, at_any)
    K0 += F + np.diag([2.0, 2.0, 2.0, 2.0, 5.0])
    K0[:2, :2] -= F[:2, :2]
    C = np.diag(10.0 ** rng.uniform(-4, -1, n))
    found = squeal.thresholds(affine(np.eye(n), K0, K1, C0=C), 1.0)
    p = np.linspace(0.0, 1.0, 3001)
    A = np.zeros((len(p), 2 * n, 2 * n))
    A[:, :n, n:] = np.eye(n)
    A[:, n:, :n] = -(K0 + p[:, None, None] * K1)
    A[:, n:, n:] = -C
    grow = (np.linalg.eigvals(A).real > 1e-12).sum(axis=1)
    expected = np.full(len(p), grow[0])
    for x in found.crossings:
        roots = 2 if x.kind == "flutter" else 1
        expected[p > x.mu] += roots if x.direction == "up" else -roots
    beside = np.all([np.abs(p - x.mu) > 1e-4 for x in found.crossings], axis=0)
    assert np.array_equal(grow[beside], expected[beside])


@pytest.mark.parametrize("eps", [1e-3, 1e-4, 1e-6])
@pytest.mark.parametrize("damped", [True, False])
def test_growth_that_begins_and_soon_turns_back_by_itself(eps, damped, rng):
    """Damping, or without damping the stiffness, (mu - a)^2 - eps^2: growth for |mu - a| < eps."""
    X = np.eye(4) + 0.3 * rng.normal(size=(4, 4))
    for at in rng.uniform(0.05, 0.95, 1):

        def system(mu, at=at):
            passing = np.diag([(mu - at) ** 2 - eps**2, 0.1, 0.2, 0.1])
            stiffness = np.diag([4.0, 9.0, 16.0, 25.0])
            if damped:
                return X.T @ X, X.T @ passing @ X, X.T @ stiffness @ X
            return X.T @ X, None, X.T @ (stiffness * (1 - np.eye(4)[0]) + passing) @ X

        crossings = thresholds(system, 1.0).crossings
        assert [c.direction for c in crossings] == ["up", "down"]
        assert {c.kind for c in crossings} == {"flutter" if damped else "divergence"}
        near = [at - eps, at + eps]
        assert [c.mu for c in crossings] == pytest.approx(near, abs=1e-3 * eps, rel=0)


def ends_of_growth(K0, K1, damping):
    """Values p of (0, 1) at which q'' + damping q' + (K0 + p K1) q = 0 begins or ceases to grow.

    A root i omega has the square s = omega^2 - i damping omega of K: |Im s| = damping (Re s)^(1/2).
    """

    def grows(p):
        squares = np.linalg.eigvals(K0 + p * K1)
        return np.any(np.abs(squares.imag) > damping * np.sqrt(squares.real))

    ends = []
    for low, high in itertools.pairwise(np.linspace(0.0, 1.0, 1001)):
        at_low = grows(low)
        if at_low == grows(high):
            continue
        for _ in range(30):
            middle = (low + high) / 2
            if grows(middle) == at_low:
                low = middle
            else:
                high = middle
        ends.append(low)
    return ends


@pytest.mark.parametrize("damping", [0.0, 2e-4])
def test_a_window_in_a_band_of_a_large_system_is_found(damping):
    rest = 440
    K0 = csc_array(block_diag([FOUR[0], diags_array(np.linspace(400.0, 4000.0, rest))]))
    K1 = csc_array(block_diag([FOUR[1], csc_array((rest, rest))]))
    eye = csc_array(eye_array(rest + 4))
    system = affine(eye, K0, K1, damping * eye if damping else None)
    result = system_thresholds(system, 1.0, selection=EigenvalueSelection(band=(0.2, 2.0))).answer
    assert [c.direction for c in result.crossings] == ["up", "down"]
    assert [c.mu for c in result.crossings] == pytest.approx(
        ends_of_growth(*FOUR, damping), rel=1e-9
    )
    assert result.certified


def large_with_crossing_modes(K0, slopes, damping=0.0):
    """Some modes that cross between 300 and 1000 Hz, six others there and hundreds above."""
    K0 = np.array(K0) * 1e3
    K1 = np.diag(slopes) * 1e3
    rest = 398
    own = np.append(np.linspace(4040.0, 4790.0, 6), np.linspace(2.0**14, 2.0**16, rest - 6))
    eye = csc_array(eye_array(rest + len(K0)))
    system = affine(
        eye,
        csc_array(block_diag([K0, diags_array(own**2)])),
        csc_array(block_diag([K1, csc_array((rest, rest))])),
        damping * eye if damping else None,
    )
    return system, K0, K1


@pytest.mark.parametrize(
    ("K0", "slopes"),
    [
        ([[16441, 1, 12], [10, 17038, 7], [-8, 9, 16680]], [6244, -4316, 2534]),
    ],
)
def test_two_windows_of_three_modes_in_a_band_of_a_large_system_are_found(K0, slopes):
    """Within one step a pair flutters, parts, and one of the two flutters with the third."""
    system, K0, K1 = large_with_crossing_modes(K0, slopes)
    found = squeal.thresholds(system, 1.0, band=(300.0, 1000.0))
    assert [c.direction for c in found.crossings] == ["up", "down", "up", "down"]
    assert [c.mu for c in found.crossings] == pytest.approx(where_roots_meet(K0, K1), rel=1e-7)
    assert found.certified


@pytest.mark.parametrize(
    ("K0", "slopes"),
    [
        (
            [[17236.8, 5.9, 2.6], [-3.6, 16798.2, 2.6], [4.6, -1.4, 16473.8]],
            [-2040.9, -44.6, 1348.8],
        ),
        (
            [[16689.9, -4.4, -3.6], [-5.2, 16759.1, 1.2], [1.7, 0.3, 16391.6]],
            [852.5, 90.7, 3928.9],
        ),
        (
            [
                [16951.8, 1.8, -3.6, -5.8],
                [-0.1, 16912.4, 5.9, 3.5],
                [3.2, 6.3, 16831.1, 3.2],
                [0.0, -1.4, -5.2, 16714.4],
            ],
            [-3102.5, -3032.7, -1001.1, 1012.3],
        ),
    ],
)
def test_damped_windows_that_begin_and_end_within_a_step_are_found(K0, slopes):
    """Growth of a ten-thousandth of the frequency, as large as slopes may miss a root elsewhere."""
    system, K0, K1 = large_with_crossing_modes(K0, slopes, damping=0.1)
    found = squeal.thresholds(system, 1.0, band=(300.0, 1000.0))
    assert [c.mu for c in found.crossings] == pytest.approx(ends_of_growth(K0, K1, 0.1), rel=1e-7)
    assert found.certified


def twins(kind, apart):
    """Two equal modes, or pairs of modes, and their thresholds, that far apart, as fractions."""
    k = (1.0, 1.0 + apart)
    c = 0.0 if kind == "flutter" else 0.01
    if kind == "damping":  # c - c k mu
        own = [c * x for x in k]
        system = affine(np.eye(2), 2 * np.eye(2), None, c * np.eye(2), -np.diag(own))
        return system, sorted(Fraction(c) / Fraction(x) for x in own)
    # the stiffnesses 2 +- sqrt(1 - k mu) of a pair grow where k mu = 1 + 2 c^2
    K0 = np.kron(np.eye(2), [[2.0, -1.0], [-1.0, 2.0]])
    K1 = np.zeros((4, 4))
    K1[0, 1], K1[2, 3] = k
    system = affine(np.eye(4), K0, K1, c * np.eye(4))
    return system, sorted((1 + 2 * Fraction(c) ** 2) / Fraction(x) for x in k)


@pytest.mark.parametrize("power", [6, 12, 14])
@pytest.mark.parametrize("kind", ["flutter", "damped flutter", "damping"])
def test_each_of_two_thresholds_that_are_almost_one_lies_in_its_interval(kind, power):
    for apart in (10.0**-power, -(10.0**-power)):
        system, expected = twins(kind, apart)
        found = thresholds(system, 3.0)
        assert found.certified or power > 12
        for x, at in zip(found.crossings, expected, strict=True):
            assert (x.kind, x.direction) == ("flutter", "up")
            assert not found.certified or x.interval[0] <= at <= x.interval[1]
        (point,) = found.points
        assert not found.certified or point.interval[0] <= expected[0] <= point.interval[1]


@pytest.mark.parametrize("power", [6, 11])
def test_a_window_of_stability_that_rounding_resolves_changes_the_verdict(power):
    """One mode's damping passes zero upwards at 1, another one's downwards a little above."""
    C1 = np.diag([0.01, -0.01 / (1 + 10.0**-power)])
    system = affine(np.eye(2), np.diag([2.0, 3.0]), None, np.diag([-0.01, 0.01]), C1)
    for high in (1.5, 3.0, 10.0):
        found = thresholds(system, high)
        assert found.certified
        assert [p.kind for p in found.points] == ["restabilised", "flutter"]
        for p, rate in zip(found.points, np.diag(C1), strict=True):
            assert p.interval[0] <= Fraction(0.01) / abs(Fraction(rate)) <= p.interval[1]


def test_a_threshold_that_the_parameter_does_not_move_to_first_order_needs_no_warning():
    """q'' - 1.1 mu^2 q = 0, where the number 1.1 has seven digits, diverges from mu = 0 on."""
    system = squeal.System([[1.0]], K={"mu**2": np.array([[-1.1]], dtype=np.float32)})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        (point,) = squeal.thresholds(system, high=1.0).points
    assert (point.mu, point.kind) == (0.0, "divergence")
