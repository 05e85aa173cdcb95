"""The lowest modes are the lowest, and as many as were wanted: clustered spectra."""

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import block_diag, csc_array, diags_array, eye_array, kron, random_array

import squeal
from squeal.sparse import krylov, lowest_roots
from squeal.sparse.argument_principle import Disc, count_roots
from squeal.sparse.lowest_roots import lowest_modes
from squeal.sparse.quadratic import scaled_problem


def laminations(count, rows, joined):
    """Equal chains that stand beside each other, weakly joined: frequencies in closed form."""
    chain = 2 * eye_array(rows) - eye_array(rows, k=1) - eye_array(rows, k=-1)
    ends = np.r_[1.0, 2 * np.ones(count - 2), 1.0]
    stack = diags_array([-np.ones(count - 1), ends, -np.ones(count - 1)], offsets=[-1, 0, 1])
    K = kron(eye_array(count), chain) + joined * kron(stack, eye_array(rows))
    each = 2 - 2 * np.cos(np.pi * np.arange(1, rows + 1) / (rows + 1))
    along = 2 - 2 * np.cos(np.pi * np.arange(count) / count)
    squares = np.sort(np.add.outer(each, joined * along).ravel())
    return csc_array(K), np.sqrt(squares)


def upper(found):
    return np.sort(found.values[found.values.imag > 0.0].imag)


@pytest.mark.parametrize(
    ("count", "rows", "joined"), [(100, 5, 0.3), (60, 9, 1e-3), (450, 1, 0.01)]
)
def test_the_lowest_of_many_close_modes_are_all_listed(count, rows, joined):
    K, exact = laminations(count, rows, joined)
    found = squeal.eigenvalues(squeal.System(eye_array(count * rows), K=1e6 * K))
    assert upper(found)[:20] == pytest.approx(1e3 * exact[:20], rel=1e-9)
    assert len(upper(found)) == 20
    assert found.certified


@pytest.mark.parametrize("hidden", [8, 16, 24, 32])
def test_a_count_shows_zeros_of_free_motions_that_half_turns_hide(hidden):
    """z^8 makes a half turn from one of 16 nodes to the next, and half turns are not known."""
    free = 18  # masses, of two zeros each
    frequencies = np.r_[np.zeros(free), np.linspace(1.0, 9.0, 60)]
    K = csc_array(diags_array(frequencies**2))
    problem = scaled_problem(eye_array(len(frequencies)), None, K)
    known = np.zeros(2 * free - hidden, dtype=complex)
    assert count_roots(problem, Disc(0.3), known) == 2 * free
    every = np.zeros(2 * free, dtype=complex)
    assert count_roots(problem, Disc(0.3), every) == 2 * free


@pytest.mark.parametrize(("free", "modes"), [(7, 3), (12, 6), (18, 10)])
def test_the_count_of_the_lowest_modes_holds_all_zeros_of_free_motions(free, modes):
    """The subspace holds a few copies of the zero; the count has to show the others."""
    held = 450 - free
    chain = 2 * eye_array(held) - eye_array(held, k=1) - eye_array(held, k=-1)
    K = csc_array(block_diag([chain, csc_array((free, free))]))
    found = lowest_modes(scaled_problem(eye_array(450), None, K), modes)
    assert found.region.radius < np.pi / 450  # about the lowest frequency of the chain
    assert (found.count, found.certified) == (2 * free, True)


@pytest.mark.parametrize(("damping", "zeros"), [(None, 6), (0.7, 3)])
def test_a_system_without_stiffness_has_zeros_as_its_lowest_roots(damping, zeros):
    """Its frequency scale is zero, too; dashpots to the ground leave one zero for each mass."""
    C = None if damping is None else damping * eye_array(3)
    found = lowest_modes(scaled_problem(eye_array(3), C, csc_array((3, 3))), 1)
    assert found.values.tolist() == zeros * [0.0]
    assert (found.count, found.certified) == (zeros, True)


def test_a_mode_that_grows_among_close_ones_is_found():
    K, exact = laminations(100, 5, 0.3)
    _, modes = eigh(K.toarray(), subset_by_index=[0, 24])
    C = csc_array(-2e-3 * np.outer(modes[:, 16], modes[:, 16]))
    found = squeal.eigenvalues(squeal.System(eye_array(500), C, K), modes=20)
    assert found.verdict == "flutter"
    assert found.unstable[0].growth_rate == pytest.approx(1e-3, rel=1e-6)
    assert found.unstable[0].root.imag == pytest.approx(exact[16], rel=1e-5)


def test_lagrange_multipliers_do_not_hide_the_lowest_modes():
    """A grounded chain whose ends two multipliers hold: that of two rows less."""
    n = 500
    chain = 2 * eye_array(n) - eye_array(n, k=1) - eye_array(n, k=-1)
    K = np.zeros((n + 2, n + 2))
    K[:n, :n] = chain.toarray()
    K[[0, n - 1, n, n + 1], [n, n + 1, 0, n - 1]] = 1.0
    M = diags_array(np.r_[np.ones(n), 0.0, 0.0])
    found = squeal.eigenvalues(squeal.System(csc_array(M), K=csc_array(K)), modes=20)
    exact = 2 * np.sin(np.pi * np.arange(1, 21) / (2 * (n - 1)))
    assert upper(found) == pytest.approx(exact, rel=1e-8)


def test_a_random_matrix_is_solved():
    rng = np.random.default_rng(4)
    n = 420
    X = random_array((n, n), density=0.01, rng=rng)
    K = csc_array(X @ X.T + eye_array(n))
    found = squeal.eigenvalues(squeal.System(eye_array(n), K=K))
    exact = np.sqrt(np.linalg.eigvalsh(K.toarray()))
    assert upper(found)[:20] == pytest.approx(exact[:20], rel=1e-9)
    assert found.certified


@pytest.mark.parametrize("fallback", ["none", "all roots", "squares"])
def test_structural_damping_does_not_change_how_many_modes_are_listed(monkeypatch, fallback):
    """lambda = +-i omega (1 + 0.05 i)^(1/2): as many lie below the axis, on its other side."""
    K, exact = laminations(24, 5, 0.3)
    if fallback != "none":  # a subspace of so few columns does not reach the lowest roots
        monkeypatch.setattr(krylov, "MOST_COLUMNS", 40)
        monkeypatch.setattr(lowest_roots, "DENSE_ROWS", 120 if fallback == "all roots" else 0)
    found = lowest_modes(scaled_problem(eye_array(120), None, (1 + 0.05j) * K), 6)
    listed = found.values[found.values.imag > 0.0]
    assert len(listed) == 6
    listed = listed[np.argsort(listed.imag)]
    assert listed == pytest.approx(1j * np.sqrt(1 + 0.05j) * exact[:6], rel=1e-8)
    assert len(found.values) == 12


def test_a_large_system_grows_its_region_until_it_holds_the_lowest(monkeypatch):
    """As of more rows than all roots are computed of, where a subspace does not reach far."""
    K, exact = laminations(16, 3, 0.01)
    monkeypatch.setattr(lowest_roots, "DENSE_ROWS", 0)
    monkeypatch.setattr(krylov, "MOST_COLUMNS", 80)
    found = lowest_modes(scaled_problem(eye_array(48), None, K), 20)
    assert upper(found)[:20] == pytest.approx(exact[:20], rel=1e-9)
    assert found.certified


@pytest.mark.parametrize("modes", [1, 4, 8, 9])
def test_all_rigid_bodies_are_listed_whatever_number_of_modes_is_wanted(modes):
    """Four free chains have eight roots at zero, then four pairs at 2000 sin(pi / 2 N) rad/s."""
    rows = 60
    ends = np.r_[1.0, 2 * np.ones(rows - 2), 1.0]
    chain = diags_array([-np.ones(rows - 1), ends, -np.ones(rows - 1)], offsets=[-1, 0, 1])
    K = csc_array(1e6 * kron(eye_array(4), chain))
    found = lowest_modes(scaled_problem(eye_array(4 * rows), None, K), modes)
    elastic = 2000 * np.sin(np.pi / (2 * rows)) * np.ones(4)
    assert found.certified
    assert np.count_nonzero(found.values == 0.0) == 8
    assert upper(found) == pytest.approx(elastic[: 4 * (modes > 8)], rel=1e-9)


@pytest.mark.parametrize(
    ("free", "elastic", "modes"),
    [
        (8, [3.0, 5.0], 11),
        (12, [3.0, 5.0], 3),
        (2, [0.1, 100.0], 1),
        (20, np.linspace(1.0, 7.0, 280), 3),
    ],
)
@pytest.mark.parametrize("seed", [None, 0])
def test_no_part_of_the_free_motions_is_listed_for_all(free, elastic, modes, seed):
    """Two zeros of each free motion, and a disc that ends about halfway to the elastic modes."""
    n = free + len(elastic)
    K = np.diag(np.r_[np.zeros(free), np.square(elastic)])
    if seed is not None:
        Q = np.linalg.qr(np.random.default_rng(seed).standard_normal((n, n)))[0]
        K = Q @ K @ Q.T
    found = lowest_modes(scaled_problem(np.eye(n), None, K), modes)
    assert found.certified
    assert found.values.tolist() == 2 * free * [0.0]
    assert 0.3 * elastic[0] < found.region.radius < 0.7 * elastic[0]


@pytest.mark.parametrize(("rows", "loss"), [(9, 0.05), (9, 0.0), (20, 0.0)])
def test_a_subspace_may_hold_all_modes(rows, loss):
    """More modes are wanted than there are: a chain, sqrt(1 + 0.05 i) 2 sin of known angles."""
    chain = diags_array(
        [-np.ones(rows - 1), 2 * np.ones(rows), -np.ones(rows - 1)], offsets=[-1, 0, 1]
    )
    K = csc_array((1 + 1j * loss) * chain if loss else chain)
    found = lowest_modes(scaled_problem(eye_array(rows), None, K), 2 * rows)
    exact = 2 * np.sin(np.pi * np.arange(1, rows + 1) / (2 * rows + 2))
    assert found.certified
    assert upper(found) == pytest.approx((np.sqrt(1 + 1j * loss) * exact).real, rel=1e-9)


@pytest.mark.parametrize("modes", [1, 3, 5])
def test_equal_oscillators_are_all_listed(modes):
    """Of two frequencies a subspace shows each a few times, and nothing else."""
    K = diags_array(np.repeat([4.0, 9.0], 120))
    found = lowest_modes(scaled_problem(eye_array(240), None, csc_array(K)), modes)
    assert found.certified
    assert upper(found) == pytest.approx(2.0 * np.ones(120), rel=1e-12)


def test_no_disc_is_certified_beyond_the_last_square(monkeypatch):
    """Of one square, of half width 2.04, that holds two of five modes; the next root is 2.2."""
    monkeypatch.setattr(lowest_roots, "MOST_ENLARGEMENTS", 1)
    w = np.array([1.0, 2.0, 2.2, 9.0, 9.5, 10.0])
    problem = scaled_problem(np.eye(6), None, np.diag(w**2))
    found = lowest_roots._lowest_of_squares(problem, 5, 2.0, certify=True)
    assert upper(found) == pytest.approx(w[w < found.region.radius])
    assert found.certified


@pytest.mark.parametrize("rows", [12, 410])
def test_the_lowest_modes_are_those_of_least_size_in_any_number_of_rows(rows):
    """Oscillators -d +- i w; the first creeps: roots -300 and -500, |lambda| above those listed."""
    w = np.linspace(10.0, 5000.0, rows - 2)
    d = np.full(rows - 2, 0.1)
    c = np.concatenate([[800.0, -2 * 400.0], 2.0 * d])  # the second grows by 400 1/s at 5 rad/s
    k = np.concatenate([[300.0 * 500.0, 400.0**2 + 25.0], w**2 + d**2])
    system = squeal.System(diags_array(np.ones(rows)), diags_array(c), diags_array(k))
    count = 5 if rows == 410 else 2
    every = np.concatenate([[-300.0, -500.0, 400.0 + 5.0j], 1j * w - d])
    expected = every[np.argsort(abs(every))[:count]]
    found = squeal.eigenvalues(system, modes=count)
    assert sorted(found.values, key=abs) == pytest.approx(expected.tolist(), rel=1e-9)
    assert np.all(np.diff(found.values.imag) > 0.0)
    more = squeal.eigenvalues(system, modes=count + 40 if rows == 410 else 4)
    assert (more.values.imag == 0.0).any()  # the slower one creeps among them
