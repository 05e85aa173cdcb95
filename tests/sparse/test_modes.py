"""Roots of sparse systems in a region against dense solutions, closed forms and known blocks."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment
from scipy.sparse import block_diag, csc_array, diags_array

from squeal.errors import ComputationError
from squeal.linear.terms import Term
from squeal.sparse import argument_principle, corrections, krylov, region_roots
from squeal.sparse.argument_principle import Disc, Rectangle, band, count_roots
from squeal.sparse.corrections import ACCEPTED_RESIDUAL, enlarged
from squeal.sparse.dense import dense_values, roots_at
from squeal.sparse.lowest_roots import lowest_modes
from squeal.sparse.quadratic import (
    LEAST_BACKWARD_ERROR,
    ScaledSystem,
    eigenvalues_of,
    scaled_problem,
)
from squeal.sparse.region_roots import modes_in
from tests import large
from tests.known import affine


def assert_same(found, expected, relative=1e-8):
    """Largest distance of two lists of roots, matched one to one, against a tolerance."""
    found = np.asarray(found)
    expected = np.asarray(expected)
    assert len(found) == len(expected)
    distance = np.abs(found[:, None] - expected[None, :])
    i, j = linear_sum_assignment(distance)
    assert distance[i, j].max() <= relative * np.abs(expected).max()


def test_multiple_roots_are_counted_and_listed():
    rng = np.random.default_rng(6)
    a = rng.uniform(0.01, 0.1, 60)
    w = rng.uniform(1.0, 10.0, 60)
    M, C, K = (block_diag([x, x], format="csc") for x in large.blocks(a, w, rng))
    expected = np.tile(np.concatenate([-a + 1j * w, -a - 1j * w]), 2)
    found = modes_in(scaled_problem(M, C, K), Rectangle(-1.0, 1.0, 3.0, 5.0))
    assert found.certified, found.count
    assert_same(found.values, expected[found.region.contains(expected)])
    for e in found.eigenvalues:
        P = e.value**2 * M + e.value * C + K
        size = abs(P).sum(axis=0).max()
        assert e.residual < 1e-12
        for vector, matrix in ((e.right, P), (e.left.conj(), P.T)):
            rest = np.linalg.norm(matrix @ vector) / (size * np.linalg.norm(vector))
            assert rest < 1e-10
        assert abs(e.right.conj() @ (M @ e.right)) == pytest.approx(1.0)


def test_an_acoustic_wave_has_the_roots_of_its_closed_form():
    """Sound in a tube with an end of impedance z: tanh(lambda) = -z, approached as 1/n^2."""
    errors = []
    for n in (100, 200):  # NLEVP `acoustic_wave_1d`, in lambda
        end = np.eye(n)[-1]
        ones = np.ones(n)
        M = csc_array(diags_array((ones - end / 2) / n))
        C = csc_array(diags_array(end / 0.5))
        K = csc_array(diags_array([-ones, 2 * ones - end, -ones], offsets=[-1, 0, 1], shape=(n, n)))
        found = modes_in(scaled_problem(M, C, n * K), Rectangle(-3.0, 1.0, 1.0, 10.0)).values
        exact = -np.arctanh(0.5) + 1j * np.pi * np.arange(1, 4)
        assert len(found) == 3
        errors.append(np.abs(np.sort_complex(found * 1j) - np.sort_complex(exact * 1j)).max())
    assert errors[1] == pytest.approx(errors[0] / 4, rel=0.1)


def test_a_defective_pair_counts_twice():
    jordan = csc_array(np.array([[4.0, 1.0], [0.0, 4.0]]))
    K = csc_array(block_diag([jordan, diags_array(np.arange(9.0, 60.0))]))
    M = csc_array(np.eye(K.shape[0]))
    found = modes_in(scaled_problem(M, None, K), Rectangle(-1.0, 1.0, 1.0, 3.5))
    assert found.certified
    assert_same(found.values, [2j, 2j, 3j, 10**0.5 * 1j, 11**0.5 * 1j, 12**0.5 * 1j], relative=1e-6)


def test_mixed_units_and_a_singular_mass_lose_no_root():
    rng = np.random.default_rng(7)
    a = rng.uniform(0.0, 0.1, 50)
    w = rng.uniform(1.0, 10.0, 50)
    M, C, K = large.blocks(a, w, rng)
    unit = csc_array(diags_array(10.0 ** rng.uniform(-4, 4, 50)))
    scaled = [unit @ x @ unit for x in (M, C, K)]
    parts = zip(scaled, (0, 0, 3), strict=True)
    massless = [block_diag([x, [[s]]], format="csc") for x, s in parts]
    expected = np.concatenate([-a + 1j * w, -a - 1j * w])
    found = modes_in(scaled_problem(*massless), Rectangle(-1.0, 1.0, 2.0, 6.0))
    assert found.certified
    assert_same(found.values, expected[(expected.imag > 2) & (expected.imag < 6)])


def test_rigid_body_roots_are_among_the_lowest():
    n = 60
    ones = np.ones(n)
    K = diags_array([-ones, np.r_[1.0, 2 * ones[2:], 1.0], -ones], offsets=[-1, 0, 1], shape=(n, n))
    found = lowest_modes(scaled_problem(csc_array(np.eye(n)), None, csc_array(K)), 5)
    assert found.certified
    exact = 2 * np.sin(np.pi * np.arange(1, 4) / (2 * n))
    assert_same(found.values, [0, 0, *(1j * exact), *(-1j * exact)], relative=1e-5)
    rounding = np.array([e.rounding for e in found.eigenvalues])
    assert np.all(rounding[2:] < 1e-9)
    assert np.all((found.values[:2] != 0) | (rounding[:2] == 0))  # an exact zero is exact


@pytest.mark.filterwarnings("ignore:.*no matrix depends on mu")
def test_a_missing_root_is_noticed(monkeypatch):
    """The count does not follow the list: with a root hidden from the search it stays right."""
    import squeal
    from squeal.queries.systems import all_roots as analysed

    rng = np.random.default_rng(8)
    a = rng.uniform(0.01, 0.1, 40)
    w = np.linspace(1.0, 10.0, 40)
    M, C, K = large.blocks(a, w, rng)
    problem = scaled_problem(M, C, K)
    turn = 2 * np.pi
    complete = corrections.corrected_roots

    def hiding(*given):
        roots = complete(*given)
        return roots.select(np.abs(roots.values.imag - w[15]) > 1e-3)

    monkeypatch.setattr(region_roots, "corrected_roots", hiding)
    found = modes_in(problem, Rectangle(-1.0, 1.0, 2.9, 6.05))
    assert not found.certified
    assert found.count == len(found.eigenvalues) + 1
    monkeypatch.setattr(analysed, "ALL_ROWS", 8)
    system = affine(M, K, C0=C)
    values = [0.1, 0.2]
    band = (2.9 / turn, 6.05 / turn)
    for search, told in ((hiding, 1), (complete, 0)):
        monkeypatch.setattr(region_roots, "corrected_roots", search)
        swept = squeal.sweep(system, values, band, method="full")
        assert {step.certified for step in swept.steps} == {not told}
        assert len(swept.warnings) == told


def test_a_disc_around_zero_of_real_matrices_is_counted_by_its_upper_half():
    """Known blocks: the count agrees with the list, and tells of a hidden pair."""
    rng = np.random.default_rng(9)
    a = rng.uniform(0.01, 0.1, 60)
    w = np.linspace(1.0, 20.0, 60)
    problem = scaled_problem(*large.blocks(a, w, rng))
    found = lowest_modes(problem, 12)
    assert found.certified
    assert_same(found.values, np.concatenate([-a[:12] + 1j * w[:12], -a[:12] - 1j * w[:12]]))
    every = np.concatenate([-a + 1j * w, -a - 1j * w])
    hidden = every[np.abs(abs(every.imag) - w[5]) > 1e-3]
    assert len(hidden) == len(every) - 2
    assert isinstance(found.region, Disc)
    assert count_roots(problem, found.region, hidden) == 24


@pytest.mark.parametrize("n", [300, 401])
def test_far_from_all_roots_nothing_is_counted(n):
    """Along an outline far from many roots the phase turns hundreds of times, faster midway."""
    w = np.sort(np.random.default_rng(1).uniform(10.0, 5000.0, n))
    M = csc_array(np.eye(n))
    K = csc_array(diags_array(w**2))
    for damping in (None, csc_array(diags_array(0.004 * w))):
        found = modes_in(scaled_problem(M, damping, K), band(1591.5, 3183.1))
        assert (found.count, found.certified) == (0, True)


@pytest.mark.parametrize("loss", [1.0, 1.0 + 0.001j], ids=["real", "complex"])
def test_eight_determinants_count_a_band_among_many_roots_and_show_each_hidden_one(
    loss, monkeypatch
):
    """Ritz values stand for roots that are not known; where each root lies, the blocks say."""
    rng = np.random.default_rng(9)
    a = rng.uniform(0.01, 0.1, 200)
    w = np.linspace(115.0, 515.0, 200)
    M, C, K = large.blocks(a, w, rng)
    problem = scaled_problem(M, C, loss * K)
    region = Rectangle(-15.0, 15.0, 300.0, 330.0)
    counts = []

    def count(problem, disc, known, reusable=None):
        counts.append((disc, known))
        return count_roots(problem, disc, known, reusable)

    monkeypatch.setattr(region_roots, "count_roots", count)
    monkeypatch.setattr(argument_principle, "NODE_COUNTS", (8,))
    found = modes_in(problem, region)
    assert (found.count, found.certified) == (int(np.sum((w > 300.0) & (w < 330.0))), True)
    assert len(counts) == 1
    disc, known = counts[0]
    inside = np.flatnonzero(disc.contains(known))
    assert len(known) > 2 * len(inside)
    for hidden in inside:
        assert count_roots(problem, disc, np.delete(known, hidden)) in (len(inside), None)


def test_a_count_about_the_real_axis_shows_each_hidden_pair(monkeypatch):
    """With nodes on the imaginary axis, where lightly damped roots lie, two pairs were missed."""
    modes = 22
    rng = np.random.default_rng(0)
    a = rng.uniform(0.01, 0.1, 80)
    w = np.linspace(1.0, 160.0, 80)
    counts = []

    def count(problem, disc, known, reusable=None):
        counts.append((disc, known))
        return count_roots(problem, disc, known, reusable)

    monkeypatch.setattr(region_roots, "count_roots", count)
    problem = scaled_problem(*large.blocks(a, w, rng))
    found = lowest_modes(problem, modes)
    assert (found.count, found.certified) == (2 * modes, True)
    disc, known = counts[-1]
    for frequency in np.abs(known[disc.contains(known)].imag):
        hidden = np.abs(np.abs(known.imag) - frequency) < 1e-6
        assert np.sum(hidden) == 2
        assert count_roots(problem, disc, known[~hidden]) in (2 * modes, None)


# Modes corrected from single precision against dense solutions; the basis that they share

BRAKE = large.disc_and_pad(3)
REGION = band(200.0, 2200.0)


def _structural() -> ScaledSystem:
    K = (Term(BRAKE.K[0].matrix * (1 + 0.02j)), *BRAKE.K[1:])
    return ScaledSystem(replace(BRAKE, K=K))


@pytest.mark.parametrize("scaled", [ScaledSystem(BRAKE), _structural()], ids=["real", "complex"])
@pytest.mark.parametrize("exact", [2e-9, 1e-13])
def test_right_and_left_modes_solve_the_equations(scaled, exact):
    problem = scaled.at({"mu": 0.6})
    roots = modes_in(problem, REGION, certify=False, exact=exact).roots
    full = modes_in(problem, REGION)
    assert full.certified
    assert len(roots.values) == len(full.values) > 3
    distance = np.abs(roots.values[:, None] - full.values[None, :]).min(axis=0)
    assert np.all(distance < 1e-9 * np.abs(full.values))
    assert np.all(problem.backward_errors(roots.values, roots.right) < 2 * exact)
    rest = problem.transposed().backward_errors(roots.values, roots.left.conj())
    assert np.all(rest < 2 * ACCEPTED_RESIDUAL)


def test_what_is_not_reached_is_divided_and_what_is_not_corrected_is_refused(monkeypatch):
    problem = ScaledSystem(BRAKE).at({"mu": 0.6})
    expected = modes_in(problem, REGION).values
    monkeypatch.setattr(krylov, "MOST_COLUMNS", 24)
    few = modes_in(problem, REGION)
    assert few.certified
    assert np.allclose(np.sort_complex(few.values), np.sort_complex(expected), rtol=1e-9)
    monkeypatch.setattr(region_roots, "MOST_PARTS", 2)
    with pytest.raises(ComputationError, match="too many roots"):
        modes_in(problem, REGION)
    monkeypatch.undo()
    monkeypatch.setattr(corrections, "MOST_CORRECTIONS", 1)
    monkeypatch.setattr(region_roots, "SMALLEST_PART", 0.5)
    with pytest.raises(ComputationError, match="were not found: one stiffness"):
        modes_in(problem, REGION)


def test_no_root_left_out_near_the_outline_is_overlooked(rng):
    """Eight determinants leave wide gaps; a count is right, or none is given."""
    damping = rng.uniform(0.1, 0.5, 31)
    frequency = rng.uniform(1.0, 6.0, 31)
    problem = scaled_problem(*large.blocks(damping, frequency, rng))
    roots = np.concatenate([-damping + 1j * frequency, -damping - 1j * frequency])
    for angle in np.linspace(0.1, 3.0, 9):
        missing = roots[int(np.argmin(np.abs(roots - 3.5j)))]
        disc = Disc(2.0, missing - 2.0 * 0.97 * np.exp(1j * angle))
        inside = int(np.sum(disc.contains(roots)))
        known = roots[roots != missing]
        assert count_roots(problem, disc, known) in (inside, None)
        assert count_roots(problem, disc, roots) in (inside, None)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("mistuning", [1e-4, 1e-5, 1e-6])
def test_roots_of_nearly_equal_blades_are_known_as_well_as_one_alone(mistuning, seed):
    """Of symmetric M and K a residual r moves lambda^2 by |r| at most (Weyl), however many other
    roots lie close by."""
    n = 60
    blades = np.diag(1e6 * (1.0 + mistuning * np.random.default_rng(seed).random(n)))
    neighbours = np.roll(np.eye(n), 1, axis=0) + np.roll(np.eye(n), -1, axis=0)
    hubs = 1e12 * (3.0 * np.eye(n) - neighbours)
    K = np.block([[blades, -blades], [-blades, hubs + blades]])
    problem = scaled_problem(np.eye(2 * n), None, K)
    values = 1j * np.sqrt(np.linalg.eigvalsh(K)[:n])
    for root in eigenvalues_of(problem, roots_at(*problem.arrays(), values)):
        size = float(problem.size(np.array([root.value]))[0])
        bound = max(root.residual, LEAST_BACKWARD_ERROR) * size / (2 * abs(root.value))
        assert root.rounding <= 1.01 * bound / problem.norms[0]


@pytest.mark.parametrize(
    ("rows", "stiff", "coupling", "seed"),
    [(6, 1e9, 1e-5, 1), (6, 1e9, 1e-5, 2), (6, 1e10, 1e-4, 1), (5, 1e12, 0.01, 5)],
)
def test_defective_roots_beside_a_stiff_part_are_not_known_to_grow(rows, stiff, coupling, seed):
    """All roots are imaginary; rounding of the stiff part moves those of the chain by little more
    than roots of orthogonal vectors."""
    chain = 1e3 * np.eye(rows) + coupling * np.eye(rows, k=1)
    n = rows + 2
    Q = np.linalg.qr(np.random.default_rng(seed).standard_normal((n, n)))[0]
    K = Q @ block_diag((chain, 3 * stiff * np.eye(2))).toarray() @ Q.T
    problem = scaled_problem(np.eye(n), None, K)
    M, C, K = problem.arrays()
    for root in eigenvalues_of(problem, roots_at(M, C, K, dense_values(M, C, K))):
        assert abs(root.value.real) <= root.rounding


@pytest.mark.parametrize("spread", [1.0, 1e-3, 1e-5, 1e-7, 1e-12])
def test_a_basis_holds_nearly_parallel_vectors_without_their_singular_values(spread, monkeypatch):
    """As of a defective root, of which LAPACK may not find the singular values."""

    def fails(*_, **__):
        raise np.linalg.LinAlgError("SVD did not converge")

    rng = np.random.default_rng(1)
    basis = np.linalg.qr(rng.standard_normal((200, 10)))[0]
    columns = rng.standard_normal((200, 1)) + spread * rng.standard_normal((200, 12))
    columns = columns + 1j * basis[:, :1]
    monkeypatch.setattr(np.linalg, "svd", fails)
    larger = enlarged(basis, columns, dropped=1e-6)
    monkeypatch.undo()
    units = columns / np.linalg.norm(columns, axis=0)
    assert np.abs(larger.T @ larger - np.eye(larger.shape[1])).max() < 1e-14
    assert larger.shape[1] == 10 + (12 if spread > 1e-6 else 1)
    assert np.linalg.norm(units - larger @ (larger.T @ units), axis=0).max() < 1e-6
