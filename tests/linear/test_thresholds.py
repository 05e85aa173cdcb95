"""Thresholds and crossings of the axis: systems put together from closed forms, and their ends."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.linalg import block_diag

import squeal
from squeal.errors import InputError
from squeal.linear import thresholds
from squeal.linear.search import search
from squeal.linear.system import System
from tests.known import affine, coupled, known_system, system_of

I2 = np.eye(2)
I3 = np.eye(3)
CHAIN = np.array([[1.0, -1, 0], [-1, 2, -1], [0, -1, 1]])
SKEW = np.array([[0.0, 1, -1], [-1, 0, 1], [1, -1, 0]])
TURN = np.array([[0.0, 1.0], [-1.0, 0.0]])
GROWTH = abs(np.sqrt(-(2 + 1j)).real)
OMEGA = abs(np.sqrt(-(2 + 1j)).imag)
UP = "flutter up"
DOWN = "flutter down"


@dataclass(frozen=True)
class Known:
    """A system, its range, and what happens there: mu, what, omega (rad/s); None is not known."""

    system: Callable
    high: float
    crossings: list | None
    points: list | None = None
    low: float = 0.0
    rel: float = 1e-9


def pair(w, at, e):
    """Two modes of frequency w (rad/s) with the roots s = w^2 +- e sqrt(1 - mu/at)."""
    return lambda mu: np.array([[w * w, e * (1 - mu / at)], [e, w * w]])


def assembled(blocks, T=None):
    """Undamped blocks K(mu) seen in coordinates T."""

    def system(mu):
        K = block_diag(*(block(mu) for block in blocks))
        X = np.eye(len(K)) if T is None else T
        return X.T @ X, None, X.T @ K @ X

    return system


def beside_growth(square):
    """A pair 2 +- i that grows, and a real root s = square(mu)."""

    return assembled([lambda _: [[2, 1], [-1, 2]], lambda mu: [[square(mu)]]])


SEVERAL = assembled([pair(1.5, 0.25, 0.4), pair(5.0, 0.5, 3.0), lambda mu: np.array([[1 - mu]])])


def clustered(n):
    rng = np.random.default_rng(n)
    at = 0.5 + 1e-4 * np.arange(n // 2)
    w = 3.0 * (1 + 1e-4 * rng.permutation(n // 2))
    blocks = [pair(a, b, 0.2) for a, b in zip(w, at, strict=True)]
    system = assembled(blocks, rng.normal(size=(n, n)) + 3 * np.eye(n))
    return Known(system, 1.0, [(a, UP, b) for a, b in zip(at, w, strict=True)], rel=1e-8)


def gyroscopic():
    """z'' - i mu z' - k z = 0: lambda = i mu/2 +- sqrt(k - mu^2/4), undamped from 2 sqrt(k) on."""
    k = np.array([0.04, 0.09, 0.16])
    T = np.random.default_rng(8).normal(size=(6, 6)) + 3 * np.eye(6)

    def system(mu):
        C = np.kron(np.eye(3), mu * TURN)
        K = np.kron(np.diag(k), I2)
        return T.T @ T, T.T @ C @ T, -T.T @ K @ T

    return Known(system, 1.0, [(2 * x**0.5, DOWN, x**0.5) for x in k], low=0.1, rel=1e-6)


def rotor():
    """Internal damping drives whirl: z'' + (ce + ci) z' + (w^2 - i ci mu) z = 0 grows from
    w (1 + ce/ci) on; thirty rows, frequencies over four decades."""
    w = np.geomspace(1.0, 1e4, 15)
    ci = 0.01 * w
    ce = 0.02 * w
    Q, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(30, 30)))

    def system(mu):
        K = np.kron(np.diag(w**2), I2) + np.kron(np.diag(mu * ci), TURN)
        return np.eye(30), Q.T @ np.kron(np.diag(ce + ci), I2) @ Q, Q.T @ K @ Q

    return Known(system, 200.0, [(3 * x, UP, x) for x in w if 3 * x < 200], rel=1e-4)


def joining(others):
    """s = -2 +- sqrt(1 - mu): two divergent roots that join cross nothing; then a growing pair."""
    system = assembled([lambda mu: [[-2.0, 1 - mu], [1, -2]], lambda _: np.diag(others)])
    return Known(system, 2.0, [], [(1.0, "flutter", None)])


WIDTH = 2e-3
PASSING = [(0.5 - np.hypot(WIDTH, GROWTH), "divergence up", 0.0)]
SHORT = [(0.5 - WIDTH, "divergence", 0.0), (0.5 + WIDTH, "flutter", OMEGA)]
KNOWN = {
    "frequencies that cross": Known(lambda mu: (I2, None, np.diag([1 + mu, 2.0])), 3.0, [], []),
    "a real root leads shortly": Known(
        beside_growth(lambda mu: (mu - 0.5) ** 2 - WIDTH**2 - GROWTH**2), 0.8, PASSING, SHORT
    ),
    "roots at zero for all mu": Known(
        lambda mu: (I3, None, CHAIN + mu * SKEW), 3.0, None, [(3**-0.5, "flutter", 2**0.5)]
    ),
    "others grow": Known(
        SEVERAL, 1.2, [(0.25, UP, 1.5), (0.5, UP, 5.0), (1.0, "divergence up", 0.0)]
    ),
    "others grow, back": Known(
        lambda mu: SEVERAL(1.2 - mu),
        1.2,
        [(0.2, "divergence down", 0.0), (0.7, DOWN, 5.0), (0.95, DOWN, 1.5)],
    ),
    **{f"clustered {n}": clustered(n) for n in (6, 20)},
    "equal subsystems": Known(
        assembled([pair(2.0, 0.4, 0.3)] * 3), 1.0, [(0.4, UP, 2.0)] * 3, rel=1e-6
    ),
    "rotor": rotor(),
    "gyroscopic": gyroscopic(),
    "divergent roots that join": joining([5.0]),
    "divergent roots that join beside others": joining([5.0, 7.0, 9.0]),
}


@pytest.mark.parametrize("name", KNOWN)
def test_thresholds_are_those_of_the_closed_forms(name):
    known = KNOWN[name]
    result = thresholds(known.system, known.high, mu_min=known.low)
    assert result.certified is not False
    if known.crossings is not None:
        ways = [f"{c.kind} {c.direction}" for c in result.crossings]
        assert ways == [what for _, what, _ in known.crossings]
        for c, (mu, _, omega) in zip(result.crossings, known.crossings, strict=True):
            assert c.mu == pytest.approx(mu, rel=known.rel)
            assert c.interval[0] - 1e-12 <= mu <= c.interval[1] + 1e-12  # of rounding in T' K T
            assert c.interval[1] - c.interval[0] < 100 * known.rel * max(mu, 1.0)
            assert 2 * np.pi * c.frequency_hz == pytest.approx(omega, rel=1e-5, abs=1e-8)
    if known.points is not None:
        assert [p.kind for p in result.points] == [kind for _, kind, _ in known.points]
        for p, (mu, _, omega) in zip(result.points, known.points, strict=True):
            assert p.mu == pytest.approx(mu, rel=known.rel)
            if omega is not None:
                assert 2 * np.pi * p.frequency_hz == pytest.approx(omega, rel=1e-9)


def test_crossings_have_their_mode_and_say_whether_they_change_the_verdict():
    found = thresholds(SEVERAL, 1.2).crossings
    assert [c.changes_verdict for c in found] == [True, False, False]
    assert [c.mode for c in found] == [2, 4, 1]  # of five modes by frequency at each place
    found = thresholds(gyroscopic().system, 1.0, mu_min=0.1).crossings
    assert [c.changes_verdict for c in found] == [False, False, True]


@pytest.mark.parametrize("seed", range(4))
def test_every_known_threshold_is_found_and_none_invented(seed):
    """Known blocks under non-orthogonal transformations."""
    rng = np.random.default_rng(seed)
    system, expected = known_system(int(rng.integers(4, 32)), rng, damped=bool(seed % 2))
    result = thresholds(system, 2.0)
    assert result.certified is not False
    crossings = sorted((c.mu, c) for c in result.crossings)
    assert len(crossings) == len(expected)
    assert len(result.searched[0].continuation.spectra) <= 25 + 16 * len(
        expected
    )  # a search is fast
    for (mu, c), (at, kind, direction, omega) in zip(crossings, expected, strict=True):
        assert (c.kind, c.direction) == (kind, direction)
        assert mu == pytest.approx(at, rel=1e-9)
        assert c.interval[0] - 1e-14 <= at <= c.interval[1] + 1e-14
        assert 2 * np.pi * c.frequency_hz == pytest.approx(omega, rel=1e-7, abs=1e-7)


@pytest.mark.parametrize("seed", range(4))
def test_motions_that_nothing_holds_add_no_crossing(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 7))
    free = int(rng.integers(1, 3))
    damped = seed % 2
    k = np.sort(10 ** rng.uniform(0, 3, n))
    K1 = 0.6 * rng.normal(size=(n, n)) * np.sqrt(np.outer(k, k))
    held = [np.eye(n), np.diag(k), K1]
    if damped:
        held.append(np.diag(0.05 * np.sqrt(k)))
    T = np.eye(n + free) + 0.4 * rng.normal(size=(n + free, n + free))
    nothing = np.zeros((free, free))
    mixed = [T.T @ block_diag(held[0], np.eye(free)) @ T]
    mixed += [T.T @ block_diag(X, nothing) @ T for X in held[1:]]
    expected = thresholds(affine(*held), 2.0).crossings
    found = thresholds(affine(*mixed), 2.0).crossings
    assert [c.kind for c in found] == [c.kind for c in expected]
    assert [c.mu for c in found] == pytest.approx([c.mu for c in expected], rel=1e-7)


def test_flutter_that_begins_with_a_jump_is_located_at_the_breakpoint():
    points = thresholds(
        lambda mu: coupled(mu if mu < 0.5 else 2 * mu), 2.0, breakpoints=[0.5, 1.2]
    ).points
    assert [(p.mu, p.kind, p.interval, p.converged) for p in points] == [
        (0.5, "flutter", (0.5, 0.5), True)
    ]
    growing = abs(np.sqrt(-(2 + 1j / np.sqrt(3))).imag)  # at mu = 1, just above the jump
    assert points[0].frequency_hz == pytest.approx(growing / (2 * np.pi), rel=1e-9)
    assert thresholds(lambda mu: coupled(mu / 4), 2.0, breakpoints=[1.0]).points == []


def test_a_mass_matrix_without_symmetry_is_taken_also_a_singular_one():
    K0 = np.diag([4.5, 3.5, 20.0, 30.0])
    K1 = np.zeros((4, 4))
    K1[0, 1] = 1.0
    K1[1, 0] = -1.0
    mixed = np.eye(4) + np.triu(np.full((4, 4), 0.3), 1)
    found = thresholds(affine(mixed, mixed @ K0, mixed @ K1), 2.0)
    assert [c.mu for c in found.crossings] == pytest.approx([0.5], rel=1e-10)
    singular = mixed @ np.diag([1.0, 1.0, 1.0, 0.0])
    found = thresholds(affine(singular, mixed @ K0, mixed @ K1), 2.0)
    assert [c.mu for c in found.crossings] == pytest.approx([0.5], rel=1e-10)


@pytest.mark.parametrize("mu_max", [0.0, -1.0, np.inf, np.nan])
def test_empty_ranges_are_refused(mu_max):
    with pytest.raises(InputError, match="thresholds"):
        thresholds(coupled, mu_max)


def test_a_batched_system_is_evaluated_together_with_the_same_result():
    sizes = []

    class Together:
        def __call__(self, mu):
            return coupled(mu)

        def many(self, mus):
            sizes.append(len(mus))
            return [coupled(mu) for mu in mus]

    assert thresholds(Together(), 2.0).points == thresholds(coupled, 2.0).points
    assert max(sizes) > 10


@pytest.mark.parametrize("seed", range(3))
def test_a_rotating_shaft_diverges_between_its_critical_speeds(seed):
    """In the rotating frame det K = (k1 - p^2)(k2 - p^2), and nothing flutters."""
    rng = np.random.default_rng(seed)
    chosen = [(4.0, 4.4), (4.0, 6.0)]
    k = chosen[seed] if seed < len(chosen) else np.sort(rng.uniform(1, 20, 2))
    T = I2 if seed % 2 else I2 + 0.3 * rng.normal(size=(2, 2))
    M = T.T @ I2 @ T
    C = T.T @ (-2 * TURN) @ T
    K = T.T @ np.diag(k) @ T
    K2 = T.T @ (-I2) @ T
    found = thresholds(system_of(M, ((C, "p"),), (K, (K2, "p**2")), {}, "p"), 6.0)
    ways = [(c.kind, c.direction) for c in found.crossings]
    assert ways == [("divergence", "up"), ("divergence", "down")]
    for c, at in zip(found.crossings, np.sqrt(k), strict=True):
        assert c.mu == pytest.approx(at, rel=1e-12)
        assert c.interval[0] - 1e-14 <= at <= c.interval[1] + 1e-14
    assert [p.kind for p in found.points] == ["divergence", "restabilised"]
    assert found.certified


@pytest.mark.parametrize("width", [1e-2, 1e-3, 1e-4, 1e-5])
def test_a_sharp_factor_is_found_or_nothing_is_certified(width):
    """Damping 0.1 - 0.2 / (1 + ((p - at) / width)^2) is negative within `width` of its centre."""
    at = 0.317 + 31 * width
    sharp = f"0.1 - 0.2/(1 + ((mu - {at!r})/{width})**2)"
    C = (np.diag([1.0, 0.0, 0.0]), sharp), np.diag([0.0, 0.1, 0.2])
    found = thresholds(system_of(I3, C, np.diag([4.0, 9.0, 16.0])), 1.0)
    if found.certified:
        assert [c.direction for c in found.crossings] == ["up", "down"]
        assert [c.mu for c in found.crossings] == pytest.approx([at - width, at + width], rel=1e-9)
    assert width < 1e-4 or found.certified


def test_of_a_plain_function_nothing_is_certified():
    found = thresholds(lambda mu: (np.eye(1), np.eye(1), np.array([[1 - mu]])), 2.0)
    assert [c.mu for c in found.crossings] == pytest.approx([1.0])
    assert found.certified is None


def test_a_free_motion_that_leaves_no_mass_on_a_diagonal_hides_no_threshold():
    """Two equal pads beside a free row, mixed by whole numbers: where the free motion is taken out
    the mass of the others has a zero on its diagonal, to rounding."""
    k, h, g = (round(x * 2.0**30) / 2.0**30 for x in (1.20191404, 0.81038976, 0.69800682))
    K0 = np.diag([2.0 * k, h, k, h, -k])
    K0[0, 3:] = 2.0 * k
    K0[4] = [-k, 0.0, 0.0, -k - h, -k]
    K1 = np.zeros((5, 5))
    K1[0, 1] = 2.0 * g
    K1[1] = [-g, 0.0, 0.0, -g, -g]
    K1[2, 3] = g
    K1[3, 2] = -g
    K1[4, 1:3] = -g, g
    found = squeal.thresholds(squeal.System(np.eye(5), K={"1": K0, "mu": K1}), 2.0)
    assert [c.mu for c in found.crossings] == pytest.approx(2 * [(k - h) / (2.0 * g)], rel=1e-6)


def test_thresholds_beside_a_free_motion_do_not_depend_on_the_order_of_equations():
    """With two equations exchanged x' M x is rounding of the free motion x: a mode was lost."""
    K = np.zeros((4, 4))
    K[1:, 1:] = [[2.0, -1.0, 0.0], [-1.0, 2.2, 0.0], [0.0, 0.0, 5.0]]
    friction = np.zeros((4, 4))
    friction[1, 2] = 4.0 / 3.0
    # squares s with (2 - s) (2.2 - s) = 1 - 4 mu / 3 meet where (0.2 / 2)^2 = 4 mu / 3 - 1
    turn = np.linalg.qr(np.random.default_rng(1).standard_normal((4, 4)))[0]
    exchange = np.eye(4)[[1, 0, 2, 3]]

    def turned(matrix):
        return turn @ exchange @ matrix @ turn.T

    system = System(
        {"1": turned(np.eye(4))}, K={"1": turned(K), "mu": turned(friction)}, parameter="mu"
    )
    assert [point.mu for point in thresholds(system, 1.5).points] == pytest.approx([0.75 * 1.01])


@pytest.mark.parametrize("is_transposed", [False, True])
@pytest.mark.parametrize("falls", [False, True])
@pytest.mark.parametrize("damping", [0.0, 0.3])
@pytest.mark.parametrize("bodies", [1, 2, 3])
def test_a_real_root_leaves_zero_beside_free_motions(bodies, damping, falls, is_transposed):
    """Between two masses acts a spring, and on one mass alone a force -mu (q1 - q2): the difference
    r obeys r'' + 2 c r' + (2 - mu) r = 0. Free bodies beside it, mixed by whole numbers, drift."""
    pair = np.array([[1.0, -1.0], [-1.0, 1.0]])
    one_sided = np.array([[-1.0, 1.0], [0.0, 0.0]])
    if is_transposed:
        one_sided = one_sided.T
    n = bodies + 1
    mix = np.tril(np.ones((n, n)))
    mix[0, -1] = 2.0

    def mixed(block):
        full = np.zeros((n, n))
        full[:2, :2] = block
        return mix.T @ full @ mix

    mass = mix.T @ mix
    for scale in (1.0, 1.0000000236432494, 1.37):
        slope = -scale * mixed(one_sided) if falls else scale * mixed(one_sided)
        constant = mixed(pair) - 4 * slope if falls else mixed(pair)
        system = squeal.System(mass, damping * mixed(pair), {"1": constant, "mu": slope})
        threshold = 4 - 2 / scale if falls else 2 / scale
        result = search(system, 0.1, 3.9)
        events = [event for cluster in result.clusters for event in cluster]
        assert [event.direction for event in events] == [-1 if falls else 1]
        assert events[0].value == pytest.approx(threshold, rel=1e-9)


@pytest.mark.parametrize("is_symmetric", [True, False])
@pytest.mark.parametrize("damping", [0.0, 0.3])
@pytest.mark.parametrize("others", [[], [0], [0, 2], [3], [3, 3], [5, 3], [0, 2, 3]])
def test_real_roots_leave_zero_beside_motions_and_combinations_that_are_free(
    others, damping, is_symmetric
):
    """Two pairs of masses: k (r'' + 2 c r' + (2 - p / k) r) = 0 of each difference r. The
    parameter changes one row of one pair, and one column of the other. Free are a motion of the
    first, a combination of rows of the second, and both of others: of such a pair (0), and of
    bodies of which each pushes the next, a chain of zeros (their number)."""
    pair = np.array([[1.0, -1.0], [-1.0, 1.0]])
    one_row = np.array([[-1.0, 1.0], [0.0, 0.0]])
    beside = [np.eye(bodies, k=-1) if bodies else pair for bodies in others]
    nothing = [0.0 * block for block in beside]
    K0 = block_diag(pair, 1.5 * pair, *beside)
    K1 = 1.1 * block_diag(one_row, one_row.T, *nothing)
    C = damping * block_diag(pair, pair, *nothing)
    n = len(K0)
    right = np.tril(np.ones((n, n)))
    right[0, -1] = 2.0
    left = right.T if is_symmetric else np.triu(np.ones((n, n))) + np.eye(n)
    system = squeal.System(
        left @ right, left @ C @ right, {"1": left @ K0 @ right, "mu": left @ K1 @ right}
    )
    events = [event for cluster in search(system, 0.1, 3.9).clusters for event in cluster]
    assert [event.direction for event in events] == [1, 1]
    assert [event.value for event in events] == pytest.approx([2 / 1.1, 3 / 1.1], rel=1e-9)


def test_a_window_beside_an_end_at_which_no_root_moves_is_found():
    """Flutter where mu^2 - 2000 mu^3 exceeds the square of half the difference, 3e-4 / 2."""

    def system(mu):
        return np.eye(2), None, np.array([[3.0, mu], [2000.0 * mu**2 - mu, 3.0 - 3e-4]])

    ends = np.sort(np.roots([2000.0, -1.0, 0.0, 1.5e-4**2]))[1:]
    found = [one.mu for one in thresholds(system, 1.0).crossings if one.kind == "flutter"]
    assert found == pytest.approx(ends)


@pytest.mark.parametrize("width", [1e-2, 1e-3])
def test_a_narrow_window_of_divergence_beside_gyroscopic_forces_is_found(width):
    """Two opposite roots -i lambda meet at zero where the stiffness passes zero, and part again."""

    def system(mu):
        return I2, TURN, np.diag([(mu - 0.77) ** 2 - width**2, 3.0])

    points = thresholds(system, 2.0).points
    assert [one.kind for one in points] == ["divergence", "restabilised"]
    assert [one.mu for one in points] == pytest.approx([0.77 - width, 0.77 + width])


def test_real_roots_that_meet_beside_gyroscopic_forces_are_located_with_a_true_interval():
    """Of K = -diag(1, 1.5) and C = mu TURN both grow before they meet, and after: nothing crosses
    the axis at sqrt(1.5) - 1, where divergence turns into flutter."""
    result = thresholds(lambda mu: (I2, mu * TURN, -np.diag([1.0, 1.5])), 2.0)
    (exchange,) = result.points
    low, high = exchange.interval
    assert exchange.kind == "flutter"
    assert low <= np.sqrt(1.5) - 1.0 <= high
    assert not result.crossings
