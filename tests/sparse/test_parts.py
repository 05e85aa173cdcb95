"""What searches for roots are made of, each against its definition on problems that are known."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eig
from scipy.sparse import csc_array, diags_array

from squeal.linear.system import TermSystem
from squeal.linear.terms import Term
from squeal.numerics.differentiation import Formula
from squeal.sparse.argument_principle import Rectangle
from squeal.sparse.axis_crossing import AxisCrossing, is_same_crossing
from squeal.sparse.corrections import enlarged, grown
from squeal.sparse.crossing_search import _changes_sign
from squeal.sparse.crossings import _in_range
from squeal.sparse.factor import factorise
from squeal.sparse.first_look import Structure
from squeal.sparse.krylov import exact_roots_in, orthogonalise, rough_roots_near
from squeal.sparse.quadratic import Roots, ScaledSystem, eigenvalues_of, scaled_problem
from squeal.sparse.reduced_basis import root_error_bounds
from squeal.sparse.reduction import Complement
from tests import large

ONE: Any = np.eye(3)


def test_rows_are_scaled_to_a_unit_diagonal_by_powers_of_two(rng):
    m, c, k = rng.uniform(0.5, 2.0, (3, 41))
    unit = 10.0 ** rng.uniform(-6, 6, 41)
    m[7] = 0.0
    C = Term(np.diag(c * unit**2), Formula("p"))
    system = TermSystem(
        (Term(np.diag(m * unit**2)),), (C,), (Term(np.diag(k * unit**2)),), {"p": 3}
    )
    scaled = ScaledSystem(replace(system, parameter="p"))
    assert np.array_equal(np.log2(scaled.scale) % 1, np.zeros(41))
    problem = scaled.at()
    rate = np.sqrt(np.sort(k / np.where(m > 0, m, 1e-9))[19])
    diagonal = (rate * problem.M + problem.C) * rate + problem.K
    assert np.all(np.abs(np.log2(diagonal.diagonal())) <= 1.0 + 1e-12)
    value = 0.3 + 2.0j
    h = 1e-6
    ahead = scaled.at({"p": 3 + h}).at(value)
    back = scaled.at({"p": 3 - h}).at(value)
    slope = scaled.slope("p", None, value).toarray()
    assert slope == pytest.approx(((ahead - back) / (2 * h)).toarray(), rel=1e-8, abs=1e-12)
    ahead = problem.at(value + h)
    back = problem.at(value - h)
    slope = problem.slope(value).toarray()
    assert slope == pytest.approx(((ahead - back) / (2 * h)).toarray(), rel=1e-8, abs=1e-7)
    assert problem.slope(2.0).dtype == float
    assert problem.frequency_scale == pytest.approx(np.sqrt(problem.norms[2] / problem.norms[0]))


@pytest.mark.parametrize(("m", "c", "k"), [(2.0, 0.3, 5.0), (0.1, 7.0, 3.0)])
def test_conditions_and_vectors_of_one_degree_of_freedom_are_those_of_the_closed_form(m, c, k):
    """kappa = (|z|^2 m + |z| c + k) / (|z| |2 z m + c|), x = 1 / sqrt(m)."""
    z = np.roots([m, c, k]).astype(complex)
    problem = scaled_problem(np.array([[m]]), np.array([[c]]), np.array([[k]]))
    x = np.array([[-1j, 2.0]])
    size = abs(z) ** 2 * m + abs(z) * c + k
    order = np.lexsort((z.real, z.imag))
    each = sorted(
        eigenvalues_of(problem, Roots(z, x, 1j * x)), key=lambda e: (e.value.imag, e.value.real)
    )
    for e, j in zip(each, order, strict=True):
        assert e.value == z[j]
        assert e.condition == pytest.approx(size[j] / abs(z[j] * (2 * z[j] * m + c)))
        assert (e.right[0], e.left[0]) == pytest.approx((m**-0.5, m**-0.5), rel=1e-12)
        assert e.residual < 1e-15
        assert 0.0 < e.rounding < 1e-12 * abs(z[j])
    off = problem.backward_errors((1.5 * z).astype(complex), x)
    rest = abs(2.25 * z**2 * m + 1.5 * z * c + k)
    assert off == pytest.approx(rest / (2.25 * abs(z) ** 2 * m + 1.5 * abs(z) * c + k), rel=1e-12)


@pytest.mark.parametrize("slow", [1e-1, 1e-4, 1e-7])
def test_rounding_of_a_slow_root_is_what_rounding_of_the_stiffness_moves(slow, rng):
    """w^2 = q' K q: eight roundings of |K| move it, and w at most by their root."""
    Q = np.linalg.qr(rng.standard_normal((2, 2)))[0]
    problem = scaled_problem(np.eye(2), None, Q * [1.0, slow**2] @ Q.T)
    x: Any = Q[:, 1:] / problem.scale[:, None] + 0j
    (found,) = eigenvalues_of(problem, Roots(np.array([1j * slow]), x, x))
    moved = np.sqrt(slow**2 + 8 * np.finfo(float).eps) - slow
    assert 0.2 * moved < found.rounding < 20 * moved


@pytest.mark.parametrize("c", [1.0, 1e4, 1e5])
def test_rounding_of_a_free_motion_holds_its_error_however_much_the_others_are_damped(c):
    """A free chain with C = c K: its rigid-body motion has the double root zero."""
    ends = np.eye(4, 3) - np.eye(4, 3, -1)
    K = ends * [1.0, 1.3, 1.6] @ ends.T
    problem = scaled_problem(np.eye(4), c * K, K)
    M, C, K = (matrix.toarray() for matrix in (problem.M, problem.C, problem.K))
    A: Any = np.block([[np.zeros((4, 4)), np.eye(4)], [-np.linalg.solve(M, X) for X in (K, C)]])
    z, left, right = eig(A, left=True)
    found = eigenvalues_of(problem, Roots(z, right[:4], np.linalg.solve(M.T, left[4:])))
    for e in sorted(found, key=lambda e: abs(e.value))[:2]:
        assert abs(e.value) <= e.rounding


@pytest.mark.parametrize("kind", [np.float32, complex])
def test_columns_join_an_orthonormal_basis(kind, rng):
    """Also what is nearly in it; what is in it to rounding adds nothing."""
    eps = np.finfo(kind).eps
    basis = np.linalg.qr(rng.standard_normal((50, 7)))[0].astype(kind)
    x = rng.standard_normal((50, 4)).astype(kind)
    x[:, 1] = basis @ np.ones(7) + 1e-4 * x[:, 1]
    x[:, 3] = x[:, 0] + basis[:, 2]
    new, inside = orthogonalise(basis, x)
    whole = np.hstack([basis, new])
    assert new.shape == (50, 3)
    assert np.abs(whole.conj().T @ whole - np.eye(10)).max() < 40 * eps
    assert np.abs(whole @ inside - x).max() < 40 * eps
    real = whole.real[:, :7].astype(float)
    wide = x.astype(complex) * (1 + 0.5j)
    more = enlarged(np.linalg.qr(real)[0], wide, 1e-8)
    assert np.abs(more.T @ more - np.eye(more.shape[1])).max() < 1e-13
    assert np.abs(wide - more @ (more.T @ wide)).max() < 1e-6
    A = csc_array(rng.standard_normal((50, 50)))
    parts = more[:, :7].T @ (A @ more[:, :7]), A, more[:, :7], more[:, 7:]
    assert grown(*parts) == pytest.approx(more.T @ (A @ more), abs=1e-12)


@pytest.mark.parametrize("single", [True, False])
@pytest.mark.parametrize("shift", [2.0 + 5.0j, 0.1j + 4.0, 3.0])
def test_roots_around_a_shift_are_all_within_its_reach(single, shift, rng):
    a = rng.uniform(-2.0, 2.0, 90)
    w = rng.uniform(1.0, 20.0, 90)
    every = np.concatenate([-a + 1j * w, -a - 1j * w])
    problem = scaled_problem(*large.blocks(a, w, rng))
    asked = []

    def enough(values, reach):
        asked.append(reach)
        return reach > 3.0

    near = rough_roots_near(problem, shift, 3.0, enough, single=single)
    assert near.reach > 3.0 >= max([0.0, *asked[:-1]])
    sure = near.values[abs(near.values - near.shift) < near.reach]
    exact = every[abs(every - near.shift) < near.reach]
    assert len(sure) == len(exact) >= 3
    assert np.abs(sure[:, None] - exact).min(axis=0).max() < 0.02
    rest = problem.backward_errors(near.values, near.vectors.astype(complex))
    assert rest[abs(near.values - near.shift) < 3.0].max() < 1e-3
    assert np.linalg.norm(near.vectors, axis=0) == pytest.approx(1.0, rel=1e-5)


def test_movements_bound_how_far_roots_are(rng):
    """Of z - A - E, as first and second order in E say: never less, never much more."""
    for _ in range(200):
        z = np.array([0.0, 1.0, 3.0j])
        E = 1e-3 * rng.standard_normal((3, 3))
        exact = np.linalg.eigvals(np.diag(z) + E)
        moved = np.abs(exact[:, None] - z).min(axis=0)
        errors, _ = root_error_bounds(z, ONE, E, np.zeros((3, 3)))
        assert np.all(moved <= 1.001 * errors)
        assert np.all(errors <= 1.01 * moved + 20e-6)
        more, steady = root_error_bounds(z, 2 * ONE, E, abs(E))
        assert more == pytest.approx(errors, rel=0.1)
        assert steady.tolist() == [True, False, True]
    near = np.array([1j, 1.0001j])
    off = np.array([[0.0, 1e-3], [1e-3, 0.0]])
    errors, steady = root_error_bounds(near, ONE[:2, :2], off, 0 * off)
    assert errors == pytest.approx([1e-3, 1e-3], rel=1e-9)  # a pair that meets: the square root
    assert not steady.any()
    assert np.isinf(root_error_bounds(near, 0 * off, off, off)[0]).all()


def test_what_a_basis_lacks_contracts_as_the_worst_of_its_directions():
    f = np.linspace(1.0, 2.0, 30)
    p = np.linspace(1.0, 2.0, 30)
    p[3] = 5.0
    p[20] = 1.4
    p[25] = 0.5
    F = csc_array(diags_array(f))
    P = csc_array(diags_array(p))
    for axes in ([3], [3, 25], [3, 25, 20], range(25, 30)):
        V = np.eye(30)[:, list(axes)]
        left = np.delete(abs(1 - p / f), list(axes))
        found = Complement(V, V.T @ (F @ V), F, factorise(F)).contraction(P)
        assert found == pytest.approx(left.max(), rel=0.02, abs=1e-12)


@pytest.mark.parametrize("ratio", [1.0, 2.0, 10.0])
def test_what_a_basis_lacks_contracts_as_an_unsymmetric_pair_does(ratio):
    """T of friction is [[0, r c], [c / r, 0]] on two directions: vectors grow by r c and c / r in
    turn, and the eigenvalues are c and -c."""
    T = np.diag(np.linspace(-0.3, 0.3, 40))
    T[38:, 38:] = [[0.0, 0.97 * ratio], [0.97 / ratio, 0.0]]
    F = csc_array(diags_array(np.linspace(1.0, 2.0, 40)))
    V = np.eye(40)[:, :2]
    found = Complement(V, V.T @ (F @ V), F, factorise(F)).contraction(csc_array(F - F @ T))
    assert found == pytest.approx(0.97, rel=1e-3)


@pytest.mark.parametrize("bulk", [0.5, 0.7, 0.8, 0.89])
@pytest.mark.parametrize("coupling", [0.0, 0.1])
def test_one_eigenvalue_above_many_others_is_seen(bulk, coupling, rng):
    """T is upper triangular."""
    n = 2000
    values = rng.uniform(-bulk, bulk, n)
    values[n // 2] = 1.01
    T = diags_array([values, coupling * np.ones(n - 1)], offsets=[0, 1])
    F = csc_array(diags_array(np.ones(n)))
    V = np.zeros((n, 0))
    found = Complement(V, V.T @ (F @ V), F, factorise(F)).contraction(csc_array(F - T))
    assert found == pytest.approx(1.01, rel=0.01)


def test_values_in_all_directions_are_seen_together():
    """Of a cyclic shift all eigenvalues lie on one circle."""
    n = 2000
    T = csc_array(diags_array([1.02 * np.ones(n - 1), [1.02]], offsets=[-1, n - 1]))
    F = csc_array(diags_array(np.ones(n)))
    V = np.zeros((n, 0))
    found = Complement(V, V.T @ (F @ V), F, factorise(F)).contraction(csc_array(F - T))
    assert 0.9 < found <= 1.02


@pytest.mark.parametrize("n", [5, 80])
def test_real_modes_reach_as_far_as_is_asked(n):
    w = np.linspace(1.0, 40.0, n)
    problem = scaled_problem(
        np.diag(np.linspace(1.0, 3.0, n)), None, np.diag(np.linspace(1, 3, n) * w**2)
    )
    structure = Structure(problem, 9.7)
    assert (
        abs(structure.F - (problem.K - 9.7**2 / 2 * problem.M)).max() < 1e-14 * abs(problem.K).max()
    )
    modes = structure.modes(19.4)
    held = np.abs(modes).max(axis=1) > 0.3
    assert held[w < 19.4].all()
    assert modes.shape[1] >= held.sum() >= 1


def crossing(value=1.0, omega=2.0, way=1, interval=(0.9, 1.1), vector=(1.0, 0.0)):
    right = np.array(vector, complex)
    return AxisCrossing(value, omega, way, interval, 0.0, slope=1.0, right=right, left=right)


def test_crossings_at_the_ends_of_a_range():
    """At the start a root that begins to grow counts there, and none that begins to decay."""
    falls = crossing(way=-1)
    at_start = _in_range(crossing(), 1.05, 2.0)
    assert at_start is not None
    assert (at_start.value, at_start.interval) == (1.05, (1.05, 1.1))
    assert _in_range(falls, 1.05, 2.0) is None
    at_end = _in_range(falls, 0.0, 0.95)
    assert at_end is not None
    assert (at_end.value, at_end.interval) == (0.95, (0.9, 0.95))
    assert _in_range(falls, 0.0, 2.0) == falls
    assert _in_range(falls, 1.2, 2.0) is None
    assert _in_range(falls, 0.0, 0.8) is None
    same = crossing(1 + 5e-8, 2 + 1e-7)
    other = crossing(vector=(0.3, 0.9))
    assert is_same_crossing(crossing(), same)
    assert not any(is_same_crossing(crossing(), x) for x in (other, crossing(omega=2.1)))
    one = replace(crossing(1.0), interval=(1.0, 1.0))
    next_one = replace(crossing(1 + 2e-7), interval=(1 + 2e-7, 1 + 2e-7))
    assert not is_same_crossing(one, next_one)
    assert is_same_crossing(crossing(), crossing(1 + 2e-7))  # whose intervals overlap
    pairs = np.array([[1 + 1j, -1 + 1j], [1 + 1j, 2.0], [1 + 1j, -1e-17 + 1j], [-1.0, 1.0]]).T
    assert _changes_sign(*pairs).tolist() == [True, False, False, True]


def test_the_roots_of_a_part_of_a_dense_problem_are_all_there_to_rounding(rng):
    a = rng.uniform(0.0, 2.0, 200)
    w = np.concatenate([rng.uniform(1.0, 20.0, 20), rng.uniform(30.0, 1000.0, 180)])
    M, C, K = large.blocks(a, w, rng)
    matrices = M.toarray(), C.toarray(), K.toarray()
    for low, high in ((1.5, 4.0), (5.0, 12.0), (21.0, 24.0)):
        region = Rectangle(-5.0, 5.0, low, high)
        inside = np.sort_complex((-a + 1j * w)[region.contains(-a + 1j * w)])
        found = exact_roots_in(*matrices, region)
        assert found is not None
        assert np.sort_complex(found) == pytest.approx(inside, rel=1e-11)


@pytest.mark.parametrize("copies", [2, 4])
def test_copies_of_a_dense_root_are_all_found_or_none_is_given(copies, rng):
    w = np.concatenate([np.full(copies, 3.0), rng.uniform(20.0, 1000.0, 100)])
    M, C, K = large.blocks(np.full(len(w), 0.1), w, rng)
    found = exact_roots_in(M.toarray(), C.toarray(), K.toarray(), Rectangle(-1.0, 1.0, 1.0, 5.0))
    if copies == 2:
        assert found == pytest.approx(np.full(2, -0.1 + 3.0j), rel=1e-6)
    else:
        assert found is None


def test_more_roots_than_a_subspace_holds_are_left_to_the_search_for_all(rng):
    w = rng.uniform(1.0, 20.0, 60)
    M, C, K = large.blocks(np.full(60, 0.1), w, rng)
    region = Rectangle(-1.0, 1.0, 0.5, 21.0)
    assert exact_roots_in(M.toarray(), C.toarray(), K.toarray(), region) is None
