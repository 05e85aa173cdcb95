"""Eigenvalues against 34-digit arithmetic and closed forms."""

import itertools

import mpmath as mp
import numpy as np
import pytest

import squeal
from squeal.errors import ComputationError, InputError
from squeal.linear import complex_eigenvalues, judge, sensitivities
from squeal.linear.eigen import growing
from squeal.linear.matrices import check_regular, normalised_system
from squeal.linear.roots import hides_slow_roots, left_vectors, ordered
from squeal.queries.systems.roots import system_roots
from squeal.queries.systems.thresholds import system_thresholds
from tests.known import coupled, system_of
from tests.linear.conftest import exact_damped, exact_squares, random_pad


def nearest(value, exact):
    return min(exact, key=lambda r: abs(r - mp.mpc(complex(value))))


def worst(values, exact):
    radius = float(max(abs(r) for r in exact))
    return max(float(abs(nearest(v, exact) - mp.mpc(complex(v)))) for v in values) / radius


def test_random_undamped_pads_have_the_exact_roots_in_any_unit(rng):
    unit = np.diag([1.0, 1.0, 1e3])  # angle in milliradians, moment to match
    for _ in range(40):
        M, C, K = random_pad(rng)
        squares = exact_squares(M, K)
        plain = complex_eigenvalues(M, C, K)
        scaled = complex_eigenvalues(unit @ M @ unit, None, unit @ K @ unit)
        if max(e.condition for e in plain.eigenvalues) < 1e3:
            exact = [sign * mp.sqrt(-s) for s in squares for sign in (1, -1)]
            assert worst(plain.values, exact) < 1e-10
            assert scaled.values == pytest.approx(plain.values, rel=1e-9)


@pytest.mark.parametrize("n", [1, 2, 3, 5])
def test_damped_systems_with_a_full_mass_matrix_have_the_exact_roots(rng, n):
    for _ in range(5):
        G, H, K = rng.normal(size=(3, n, n))
        M = G @ G.T + np.eye(n)
        C = 0.1 * H
        spectrum = complex_eigenvalues(M, C, K)
        assert worst(spectrum.values, exact_damped(M, C, K)) < 1e-12
        for e in spectrum.eigenvalues:
            polynomial = e.value**2 * M + e.value * C + K
            size = np.abs(e.value) ** 2 * np.linalg.norm(M) + np.linalg.norm(K)
            left = np.linalg.norm(e.left)
            right = np.linalg.norm(e.right)
            assert np.linalg.norm(polynomial @ e.right) < 1e-12 * size * right
            assert np.linalg.norm(e.left.conj() @ polynomial) < 1e-10 * size * left
            assert (e.right.conj() @ M @ e.right).real == pytest.approx(1.0, rel=1e-12)
            assert e.residual < 1e-13


def test_undamped_roots_lie_on_the_axes_and_are_ordered():
    values = complex_eigenvalues(np.eye(3), None, [[2, 0.3, 0], [0.1, 3, 0], [0, 0.2, -4]]).values
    assert np.all((values.real == 0) | (values.imag == 0))
    assert values[0].real == pytest.approx(2.0)
    assert np.all(np.sort_complex(values) == np.sort_complex(-values))
    values = complex_eigenvalues(np.eye(3), None, [[2, 1, 0], [-1, 2, 0], [0, 0, 9]]).values
    one, other = np.sqrt([-2 + 1j, -2 - 1j])
    assert values == pytest.approx(np.array([one, other, -other, -one, 3j, -3j]))
    repeated = complex_eigenvalues(np.eye(3), None, 4 * np.eye(3)).values
    assert repeated == pytest.approx([2j, -2j] * 3)


@pytest.mark.parametrize("values", set(itertools.permutations([2j, 2j, -2j, -2j, 1j, -1j])))
def test_each_of_repeated_pairs_is_followed_by_its_conjugate(values):
    order = ordered(np.array(values))
    assert [values[k] for k in order] == [1j, -1j, 2j, -2j, 2j, -2j]


def test_left_vectors_belong_to_their_roots_next_to_a_coalescence():
    A = np.diag([1.0, 1.0, 3.0, -3.5]) + np.diag([1.0, 0.5, 0.2], 1) + np.diag([1e-16, 0, 0], -1)
    values, right = np.linalg.eig(A)
    left = left_vectors(A, values, right)
    assert np.linalg.norm(left.conj().T @ A - values[:, None] * left.conj().T) < 1e-7
    assert np.linalg.norm(left, axis=0) == pytest.approx(1.0)


def test_strong_damping_of_a_light_motion_leaves_a_stiff_system_no_zero_root():
    coupling = 1 - 2e-7
    M = np.array([[1.0, coupling], [coupling, 1.0]])
    C = 0.1 * np.eye(2)
    K = np.diag([4.0, 9.0])
    values = complex_eigenvalues(M, C, K).values
    for exact in exact_damped(M, C, K):
        assert np.abs(values / complex(exact) - 1.0).min() < 1e-6


@pytest.mark.parametrize("friction", [1e12, 1e15, 1e16, 1e20, 1e100])
def test_friction_far_beyond_all_stiffness_leaves_the_roots_their_size(friction):
    """-lambda^2 = 2 +- i sqrt(friction), a pair far wider than its distance from zero."""
    roots = squeal.eigenvalues(squeal.System(np.eye(2), K=[[2.0, friction], [-1.0, 2.0]])).values
    expected = np.sqrt(-(2.0 + 1j * np.sqrt(friction)))
    assert np.allclose(np.abs(roots.real), abs(expected.real), rtol=1e-5)
    assert np.allclose(np.abs(roots.imag), abs(expected.imag), rtol=1e-5)


def test_condition_grows_towards_a_coalescence():
    # closed form for [[2, -1 + x], [-1, 2]], x = 4 mu/3: 1/|y^H x| = (2 - x)/(2 sqrt(1 - x))
    for x in (0.4, 2.8 / 3, 0.99998 + 2e-5 / 3):
        for e in complex_eigenvalues(*coupled(0.75 * x)).eigenvalues:
            assert e.condition == pytest.approx((2 - x) / (2 * np.sqrt(1 - x)), rel=1e-6)
    assert complex_eigenvalues(*coupled(0.75)).eigenvalues[0].condition > 1e7


NO_SYSTEMS = [
    ("M", [[1, 0]], None, [[1]]),
    ("C", [[1]], [[1, 2], [3, 4]], [[1]]),
    ("M", [[0]], None, [[1]]),
    ("K", [[1]], None, [[np.nan]]),
    ("K", [[1]], None, [["a"]]),
    ("C", [[1]], [[1j]], [[1]]),
    ("M", [[-1]], None, [[1]]),
    ("M", [[1, 2], [2, 1]], None, np.eye(2)),
    ("M", [[1, 0.5], [0, 1]], None, np.eye(2)),
]


@pytest.mark.parametrize(("word", "M", "C", "K"), NO_SYSTEMS)
def test_refuses_what_is_not_a_system(word, M, C, K):
    with pytest.raises(InputError, match=f"^{word}: "):
        complex_eigenvalues(M, C, K)


def test_roots_beyond_double_precision_are_not_given():
    I = np.eye(2)
    for M, C, K in ((I, None, 1e305 * I), (I, 1e200 * I, I), (1e-310 * I, None, I)):
        for ask in (complex_eigenvalues, judge):
            with pytest.raises(ComputationError):
                ask(M, C, K)


def test_a_cached_factor_cannot_be_written_to():
    with pytest.raises(ValueError, match="read-only"):
        normalised_system(np.eye(2), None, np.eye(2)).T[:] = 0.0


ONES = np.ones((2, 2))
FREE = np.zeros((2, 2))
NO_ROW = np.array([[4.0, 0.0, 1.0], [0.0, 5.0, 1.0], [0.0, 0.0, 0.0]])
DEGENERATE = [
    # every number is a root: they were called marginal, with no root missing
    (np.diag([1.0, 0.0]), None, np.diag([4.0, 0.0]), None),
    (ONES, 0.1 * ONES, 4.0 * ONES, None),
    (np.diag([1.0, 1.0, 0.0]), np.diag([0.1, 0.1, 0.0]), NO_ROW, None),
    # a massless coordinate alone is no such system
    (np.diag([1.0, 0.0]), None, np.diag([4.0, 1e12]), [-2j, 2j]),
    (np.diag([1.0, 1e-8]), np.eye(2), FREE, [-1e8, -1.0, 0.0, 0.0]),
]


@pytest.mark.parametrize(("M", "C", "K", "values"), DEGENERATE)
def test_matrices_of_which_every_number_is_a_root_are_refused(M, C, K, values):
    if values is None:
        with pytest.raises(InputError, match="every number is a root"):
            check_regular(M, C, K)
        with pytest.raises(InputError):
            system_roots(system_of(M, C, K))
    else:
        check_regular(M, C, K)
        found = np.sort_complex([e.value for e in system_roots(system_of(M, C, K)).eigenvalues])
        assert found == pytest.approx(np.array(values, dtype=complex), rel=1e-9)


COUPLED = np.array([[1.0, 0.5], [0.5, 1.0]])
HIDING = [
    (np.eye(2), FREE, False),  # the root -1 beside -1e20, which has nothing to do with it
    (np.eye(2), np.diag([0.0, 1e-20]), True),  # of the light one the slow root
    (COUPLED, FREE, True),  # -3/4 beside it
    (COUPLED, np.diag([0.0, 1e-20]), True),
    (np.diag([0.0, 1.0]), FREE, False),  # free but for the light one's damper
    (None, FREE, False),
]


@pytest.mark.parametrize(("C", "K", "expected"), HIDING)
def test_a_damper_of_a_light_mass_hides_the_root_of_a_free_one(C, K, expected):
    M = np.diag([1.0, 1e-20])
    assert hides_slow_roots(normalised_system(M, C, K), C, K) == expected
    if C is not None and C[0, 0] and not K.any():
        found = system_roots(system_of(M, C, K))
        sure = (e for e in found.eigenvalues if e.residual < 1e-6)
        slow = sorted(e.value.real for e in sure if abs(e.value) < 10)
        assert slow == pytest.approx([-1.0 + C[0, 1] ** 2, 0.0, 0.0], abs=1e-9)


def test_a_system_without_mass_and_damping_is_refused_by_every_query():
    massless = system_of(np.zeros((1, 1)), None, ((np.array([[4.0]]), "1 + mu"),))
    with pytest.raises(InputError, match="M or C must not be"):
        system_roots(massless)
    with pytest.raises(InputError, match="no motion but free ones satisfies them"):
        system_thresholds(massless, 1.0)


GROW = [
    (np.diag([-1.0, -4.0, 9.0]), "divergence", 2),
    (np.array([[2.0, -1.0], [0.5, 2.0]]), "flutter", 1),
    (np.diag([-1e-9, 1.0, 2.0, 3.0, 4.0]), "divergence", 1),
]


@pytest.mark.parametrize("damping", [0.0, 0.01])
@pytest.mark.parametrize(("K", "kind", "number"), GROW)
def test_a_growing_verdict_has_its_modes(K, kind, number, damping):
    """'verdict: divergence' came with `unstable: []` where nothing is damped."""
    eye = np.eye(len(K))
    given = eye, damping * eye, K
    roots = system_roots(system_of(*given))
    assert roots.verdict == kind == judge(*given).verdict
    for values in (roots.computed, complex_eigenvalues(*given).eigenvalues):
        assert [mode.kind for mode in growing(values)] == [kind] * number


def test_sensitivities_to_all_three_matrices_are_those_of_exact_differences(rng):
    M = np.diag([1.0, 2.0])
    C = 0.1 * rng.normal(size=(2, 2))
    K = rng.normal(size=(2, 2)) + 5
    dM = np.diag([0.3, -0.2])
    dC = rng.normal(size=(2, 2))
    dK = rng.normal(size=(2, 2))
    step = 1e-7
    values = complex_eigenvalues(M, C, K).values
    roots_above = exact_damped(M + step * dM, C + step * dC, K + step * dK)
    roots_below = exact_damped(M - step * dM, C - step * dC, K - step * dK)
    exact = []
    for value in values:
        change = nearest(value, roots_above) - nearest(value, roots_below)
        exact.append(complex(change / (2 * step)))
    slopes = slopes_of((M, C, K), dM, dC, dK)
    assert slopes == pytest.approx(np.array(exact), rel=1e-6)


def slopes_of(matrices, *change):
    roots = complex_eigenvalues(*matrices).eigenvalues
    return sensitivities(matrices, {"q": change}, roots)[0]["q"]


def test_roots_that_are_one_move_by_the_quotient_of_matrices():
    pair = np.eye(2), None, np.eye(2)  # omega^2 = 1 +- q
    slopes = slopes_of(pair, None, None, np.array([[0.0, 1.0], [1.0, 0.0]]))
    assert np.sort(slopes.imag) == pytest.approx([-0.5, -0.5, 0.5, 0.5], abs=1e-12)


def test_square_root_behaviour_is_infinite():
    one = np.eye(1)
    none = np.zeros((1, 1))
    assert np.all(np.isinf(slopes_of((one, None, none), None, None, one)))
    assert slopes_of((one, None, none), None, None, none).tolist() == [0, 0]
    own = coupled(0.75)
    change = np.array([[0.0, 1.0], [0.0, 0.0]])
    assert np.all(np.isinf(slopes_of(own, None, None, change)))
    assert np.all(np.isinf(sensitivities(own, {}, complex_eigenvalues(*own).eigenvalues)[1]))


@pytest.mark.parametrize(("mass", "stiffness"), [(1e-9, 1e9), (1e9, 1e-9), (1e3, 1e9)])
def test_a_free_body_is_regular_in_any_unit(mass, stiffness):
    K = stiffness * np.array([[1.0, -1.0], [-1.0, 1.0]])
    check_regular(mass * np.eye(2), None, K)
    values = complex_eigenvalues(mass * np.eye(2), None, K).values
    exact = np.sqrt(2 * stiffness / mass)
    assert np.sort(values.imag) / exact == pytest.approx([-1.0, 0.0, 0.0, 1.0], abs=1e-7)


def test_vectors_of_dampers_in_one_direction_without_stiffness_are_finite():
    """At the root zero z^2 + z B + A itself is zero, so that it has no size to compare with."""
    found = squeal.eigenvalues(squeal.System(np.eye(3), np.eye(3, k=1), np.zeros((3, 3))))
    assert np.all(found.values == 0.0)
    assert all(np.isfinite(root.right).all() for root in found.eigenvalues)
