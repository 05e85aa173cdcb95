"""Verdicts on both sides of every boundary, one system at a time and in maps."""

import mpmath as mp
import numpy as np
import pytest

import squeal
from squeal.errors import InputError
from squeal.linear import (
    VERDICTS,
    damped_verdicts,
    errors_may_change,
    judge,
    thresholds,
    undamped_verdicts,
    unstable_modes,
    verdict,
)
from squeal.linear.eigen import Eigenvalue, growing
from squeal.linear.invariants import invariants
from squeal.linear.verdicts import decide, is_undamped
from tests.known import affine, coupled
from tests.linear.conftest import exact_squares, exact_verdict, random_pad

I2 = np.eye(2)
I3 = np.eye(3)
CHAIN = np.array([[1.0, -1, 0], [-1, 2, -1], [0, -1, 1]])
FREE = (0.0, 0.3), (0.0, 0.0), (-1e-3, 0.3)  # stiffness and damping


def _padded(K, n):
    """The same system with further oscillators, coupled one way so that nothing else changes."""
    extra = n - len(K)
    top = np.hstack([K, np.zeros((len(K), extra))])
    bottom = np.hstack([0.3 * np.ones((extra, len(K))), np.diag(7.0 + np.arange(extra))])
    return np.vstack([top, bottom])


def test_verdicts_of_random_pads_are_those_of_the_exact_roots(rng):
    pads = [random_pad(rng) for _ in range(200)]
    names = [verdict(*pad) for pad in pads]
    assert names == [exact_verdict(exact_squares(M, K)) for M, _, K in pads]
    assert set(names) == {"marginal", "flutter", "divergence"}


@pytest.mark.parametrize("n", [2, 3, 4, 6])
def test_verdicts_hold_on_both_sides_of_a_coalescence_and_of_divergence(rng, n):
    for share, expected in ((1 - 1e-9, "marginal"), (1.0, "marginal"), (1 + 1e-9, "flutter")):
        K = _padded(coupled(0.75 * share)[2], n)
        assert verdict(np.eye(n), None, K) == expected
        if share != 1.0:  # in any units
            for unit in 2.0 ** rng.integers(-20, 20, (5, n)):
                assert verdict(np.diag(unit**2), None, unit[:, None] * K * unit) == expected
    for k, expected in ((1e-9, "marginal"), (-1e-9, "divergence"), (0.0, "marginal")):
        assert verdict(np.eye(n - 1), None, _padded(np.array([[k]]), n - 1)) == expected


def test_gyroscopic_forces_do_not_damp_and_structural_damping_does():
    skew = np.array([[0.0, 1.0], [-1.0, 0.0]])
    for C, K, undamped in [
        (None, I2, True),
        (None, I2 + skew, True),
        (0.0 * I2, I2 + skew, True),
        (skew, I2, True),
        (skew, I2 + skew, False),  # each root leaves the axis by itself
        (skew + 1e-9 * I2, I2, False),
        (None, (1.0 + 0.01j) * I2, False),
    ]:
        assert is_undamped(I2, C, K) == undamped
        assert squeal.System(I2, C, K).undamped == undamped


def test_a_small_damping_decides():
    M, _, K = coupled(0.75)
    for c, expected in ((1e-9, "stable"), (-1e-9, "flutter"), (0.0, "marginal")):
        assert verdict(I2, np.diag([c, 1.0]), np.diag([2.0, 3.0])) == expected
    for c, expected in ((1e-5, "stable"), (-1e-5, "flutter")):
        assert verdict(M, c * M, K) == expected
    for k, expected in ((-1e-12, "divergence"), (1e-12, "stable"), (0, "marginal")):
        assert verdict([[1]], [[1]], [[k]]) == expected
    assert verdict([[1]], [[2]], [[1]]) == "stable"  # critically damped, defective


def test_singular_systems_are_decided_by_what_remains():
    for C, K in ((None, 1e6 * CHAIN), (CHAIN, 1e6 * CHAIN), (None, 0 * I3)):
        assert verdict(I3, C, K) == "marginal"
    assert verdict(I2, None, [[0, 1], [0, 0]]) == "marginal"
    skew = np.array([[0.0, 1, -1], [-1, 0, 1], [1, -1, 0]])  # rows sum to zero, as the chain's do
    # remaining quadratic: s^2 - 4 s + 3 + 3 k^2, complex roots beyond k = 1/sqrt(3)
    limit = 1 / np.sqrt(3)
    assert verdict(I3, None, CHAIN + limit * (1 - 1e-9) * skew) == "marginal"
    assert verdict(I3, None, CHAIN + limit * (1 + 1e-9) * skew) == "flutter"
    assert verdict(I3, None, -CHAIN) == "divergence"


def test_faster_growth_names_the_verdict():
    # a flutter pair s = 2 +- i has growth Re sqrt(-s); the real mode -g^2 grows at g
    growth = np.sqrt(-(2 + 1j)).real
    for factor, expected in ((1 - 1e-9, "flutter"), (1 + 1e-9, "divergence")):
        K = np.array([[2.0, 1, 0], [-1, 2, 0], [0, 0, -((factor * growth) ** 2)]])
        names = [verdict(np.eye(n), None, _padded(K, n)) for n in (3, 4)]
        assert [*names, VERDICTS[undamped_verdicts(K)]] == [expected] * 3


def test_rounding_bounds_hold(rng):
    for _ in range(200):
        A = rng.normal(size=(3, 3)) * 10.0 ** rng.integers(-3, 4, (3, 3))
        found = invariants([float(x) for x in A.ravel()])
        with mp.workdps(60):
            X = mp.matrix(A.tolist())
            a = X[0, 0] + X[1, 1] + X[2, 2]
            c = mp.det(X)
            square = X * X
            b = (a * a - (square[0, 0] + square[1, 1] + square[2, 2])) / 2
            disc = a**2 * b**2 - 4 * b**3 - 4 * a**3 * c + 18 * a * b * c - 27 * c**2
            for value, exact in zip(found[:4], (a, b, c, disc), strict=True):
                assert abs(mp.mpf(float(value.value)) - exact) <= value.bound


def test_verdicts_at_a_boundary_are_those_of_single_systems():
    edge = [CHAIN, -CHAIN, I3, 0 * I3, -I3]
    for mu in 0.75 * (1 + np.array([-1e-9, -1e-15, 0, 1e-15, 1e-9])):
        edge += [_padded(coupled(mu)[2], 3), -_padded(coupled(mu)[2], 3)]
    names = [VERDICTS[c] for c in undamped_verdicts(np.array(edge))]
    assert names == [verdict(I3, None, X) for X in edge]


@pytest.mark.parametrize(("spread", "n"), [(1.0, 200), (1e3, 40)])
def test_verdicts_of_stacks_are_those_of_single_systems(rng, spread, n):
    Q = rng.normal(size=(3, 3, n)) + 2.0 * np.eye(3)[:, :, None]
    Q *= spread ** rng.uniform(-1.0, 1.0, n)
    u = rng.normal(size=(3, n - 10)) * spread ** rng.uniform(-0.5, 0.5, n - 10)
    A = np.moveaxis(Q[:, :, None, :] + np.einsum("ai,bi->abi", u, u)[..., None], (2, 3), (0, 1))
    codes = undamped_verdicts(A)
    assert codes.dtype == np.int8
    assert len(np.unique(codes)) == 3
    for i, k in rng.integers(0, n - 10, (500, 2)):
        assert VERDICTS[codes[i, k]] == verdict(I3, None, A[i, k])


def test_verdicts_of_stacks_at_the_boundary(rng):
    # symmetric and of rank two or one, or with a double root: on a boundary everywhere
    u = rng.normal(size=(25, 3))
    of_rank_one = np.einsum("na,nb->nab", u, u)
    for Q in (of_rank_one, np.zeros((25, 3, 3)), np.eye(3) + 0 * of_rank_one):
        sums = Q[None] + of_rank_one[:, None]
        assert np.all(undamped_verdicts(sums) == VERDICTS.index("marginal"))
        lower = Q - 1e-6 * np.eye(3)
        falls = np.linalg.eigvalsh(lower).min() < -0.5e-6
        assert np.all(undamped_verdicts(lower) == VERDICTS.index("divergence")) == falls


def test_damped_verdicts_of_stacks_are_those_of_single_systems(rng):
    # among them systems with an undamped mode, a rigid body, a threshold, and a double root at zero
    systems = [(np.diag([1.0, 2.0, k]), np.diag([0.1, 0.2, c])) for k, c in FREE]
    for _ in range(200):
        root, half = rng.normal(size=(2, 3, 3))
        A = root @ root.T + rng.uniform(0, 1.5) * np.outer(rng.normal(size=3), rng.normal(size=3))
        systems.append((A, 10.0 ** rng.uniform(-9, 0.5) * (half @ half.T)))
    for c in (0.1, 1e-3, 1e-6):
        for share in (1.0, 1 - 1e-15, 1 + 1e-15, 1 - 1e-9, 1 + 1e-9, 0.9, 1.1):
            A = np.diag([2.0, 2.0, 7.0])
            A[0, 1] = share * (1 + 2 * c**2) - 1
            A[1, 0] = -1.0
            systems += [(A, c * np.eye(3)), (A, np.diag([c, c, 0.0]))]
    A, B = (np.array(part) for part in zip(*systems, strict=True))
    expected = [verdict(np.eye(3), b, a) for a, b in systems]
    assert [VERDICTS[c] for c in damped_verdicts(A, B)] == expected
    assert set(expected) == set(VERDICTS)


def _beside_a_stiff_mode(stiff, mixed):
    """Flutter from mu = 3/4 on, whatever the third mode: in its coordinates, or in others."""
    turn = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0] if mixed else np.eye(3)
    K0 = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, 0.0], [0.0, 0.0, stiff]])
    K1 = np.zeros((3, 3))
    K1[0, 1] = 4.0 / 3.0
    return lambda mu: (np.eye(3), None, turn @ (K0 + mu * K1) @ turn.T)


@pytest.mark.parametrize("mixed", [False, True])
@pytest.mark.parametrize("stiff", [4.0, 40.0, 1e5, 1e12])
def test_a_stiff_mode_does_not_hide_flutter_of_the_others(stiff, mixed):
    system = _beside_a_stiff_mode(stiff, mixed)
    [point] = thresholds(system, 2.0).points
    low, high = point.interval
    assert point.kind == "flutter"
    assert low <= 0.75 <= high
    assert high - low < (1e-9 if stiff < 1e5 or not mixed else 2e-15 * stiff)
    assert point.converged == (high - low <= 0.75e-9)
    for mu, name in ((0.7, "marginal"), (0.8, "flutter")):
        A = system(mu)[2]
        assert judge(*system(mu)).verdict == name
        assert VERDICTS[undamped_verdicts(A)] == name
        assert len(unstable_modes(system, mu)) == (name == "flutter")


def test_growth_beside_a_strong_damper_and_many_rows_is_counted():
    """The same beside 38 rows more, of which the referee counts what grows and proves no range."""
    K0 = _beside_a_stiff_mode(1.0, False)(0.0)[2]
    K1 = _beside_a_stiff_mode(1.0, False)(1.0)[2]
    many = np.diag(np.linspace(20.0, 40.0, 38))
    C = np.diag([1e-3, 1e-3, 1e9, *[0.1] * 38])
    change = np.pad(K1 - K0, (0, 38))
    stiffness = np.pad(K0, (0, 38)) + np.pad(many, (3, 0))
    found = squeal.thresholds(affine(np.eye(41), stiffness, change, C), 1.0)
    listed = [p.mu for p in found.points]
    assert found.verdict == "stable"
    assert listed == pytest.approx([0.75 * (1 + 2e-6)], rel=1e-9) or not found.certified


@pytest.mark.parametrize("strong", [1e2, 1e9])
def test_growth_beside_a_strong_damper_is_listed(strong):
    """Flutter from 3/4 (1 + 2 c^2) on, by at most 1/s; the damper is on another coordinate."""
    K0 = _beside_a_stiff_mode(1.0, False)(0.0)[2]
    K1 = _beside_a_stiff_mode(1.0, False)(1.0)[2]
    C = np.diag([1e-3, 1e-3, strong])
    found = squeal.thresholds(affine(I3, K0, K1 - K0, C), 1.0)
    assert found.certified
    assert [p.mu for p in found.points] == pytest.approx([0.75 * (1 + 2e-6)], rel=1e-9)


def test_no_roots_have_no_verdict():
    with pytest.raises(InputError, match="roots: there are none; at least one is required"):
        decide([], 1e-9)


def test_a_pair_that_is_proved_to_grow_is_one_mode_however_close_to_the_real_axis():
    vector = np.ones(1, complex)
    pair = [
        Eigenvalue(0.1 + sign * 1e-9j, vector, vector, 0.0, 1.0, rounding=1e-3, proved_sense=1)
        for sign in (1, -1)
    ]
    assert [mode.kind for mode in growing(pair)] == ["flutter"]


def pair_and_real_root(ratio, damping, seed):
    """A and B of a pair that grows by g, 1/s, and a real root that grows by g * ratio."""
    rng = np.random.default_rng(seed)
    root = 0.4 + 2.0j
    square = root * (root + damping)  # lambda^2 + damping lambda + s = 0 of s = -square
    real = root.real * ratio
    A = np.diag([-square.real, -square.real, -real * (real + damping)])
    A[0, 1] = -square.imag
    A[1, 0] = square.imag
    T = rng.integers(-2, 3, (3, 3)) + 4.0 * np.eye(3)
    return T @ A @ np.linalg.inv(T), damping * np.eye(3)


def kind_of_fastest(A, B):
    form = np.block([[np.zeros((3, 3)), np.eye(3)], [-A, -B]])
    roots = np.linalg.eigvals(form)
    return "flutter" if abs(roots[np.argmax(roots.real)].imag) > 1e-3 else "divergence"


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("damping", [0.0, 0.3])
def test_errors_may_change_which_instability_is_the_faster(damping, seed):
    rng = np.random.default_rng(seed)
    A, B = pair_and_real_root(1.0, damping, seed)
    errors = 1e-11 * np.abs(A)
    changed = A + errors * rng.choice([-1.0, 1.0], (100, 3, 3))
    assert {kind_of_fastest(X, B) for X in changed} == {"flutter", "divergence"}
    assert errors_may_change(A[None], B[None], errors[None]).all()
    for ratio in (0.9, 0.99, 1.01, 1.1):
        A, B = pair_and_real_root(ratio, damping, seed)
        changed = A + errors * rng.choice([-1.0, 1.0], (100, 3, 3))
        assert {kind_of_fastest(X, B) for X in changed} == {kind_of_fastest(A, B)}
        assert not errors_may_change(A[None], B[None], errors[None]).any()


@pytest.mark.parametrize(
    ("A", "B", "is_open"),
    [
        # roots 1.5 +- 2i beside 1 and 1.5: the determinant is positive
        (np.diag([1.5, 6.25, 1.0]), np.diag([-2.5, -3.0, 1.0]), True),
        (np.diag([1.5, 5.6, 1.0]), np.diag([-2.5, -2.5, 1.0]), False),
        # a triple root, which moves by the cube root of the error
        (-np.array([[1.0, 1.0, 0.0], [0.0, 1.0, 1.0], [5e-12, 0.0, 1.0]]), 0.3 * np.eye(3), True),
    ],
)
def test_a_tie_is_open_beside_a_second_real_root_and_at_a_triple_one(A, B, is_open):
    errors = 1e-11 * np.abs(A) + 1e-11 * np.eye(3)[[1, 2, 0]].T * (A[0, 1] != 0.0)
    assert errors_may_change(A[None], B[None], errors[None]).tolist() == [is_open]


@pytest.mark.parametrize(("square", "is_open"), [(5e-12, True), (-5e-12, True), (0.01, False)])
def test_a_damped_pair_that_errors_turn_real_is_open(square, is_open):
    """z'' - 2 z' + (1 + square) z = 0 has the roots 1 +- sqrt(-square), beside decaying ones."""
    A = np.diag([1.0 + square, 5.0, 6.0])
    B = np.diag([-2.0, 0.5, 0.5])
    errors = 1e-11 * A
    kinds = {kind_of_square(A[0, 0] + sign * errors[0, 0] - 1.0) for sign in (-1.0, 1.0)}
    assert (len(kinds) == 2) == is_open
    assert errors_may_change(A[None], B[None], errors[None]).tolist() == [is_open]


def kind_of_square(square):
    """The verdict on 1 +- sqrt(-square)."""
    return "flutter" if square > 0.0 else "divergence"
