"""Eigenvalues against 34-digit arithmetic and closed forms."""

import mpmath as mp
import numpy as np
import pytest

from squeal.analysis.systems.roots import growing, system_roots
from squeal.analysis.systems.thresholds import system_thresholds
from squeal.errors import ComputationError, InputError
from squeal.linear import complex_eigenvalues, judge, sensitivities
from squeal.linear.eigen import hidden
from squeal.linear.matrices import check_regular, reduce
from squeal.linear.system import Term, TermSystem
from squeal.numerics.differentiation import Formula
from tests.linear.conftest import exact_damped, exact_squares, random_pad


def _worst(values, reference):
    radius = float(max(abs(r) for r in reference))
    return max(float(min(abs(mp.mpc(complex(v)) - r) for r in reference)) for v in values) / radius


def test_random_undamped_pads_in_any_unit(rng):
    unit = np.diag([1.0, 1.0, 1e3])  # angle in milliradians, moment to match
    for _ in range(60):
        M, C, K = random_pad(rng)
        squares = exact_squares(M, K)
        gaps = [abs(a - b) for i, a in enumerate(squares) for b in squares[:i]]
        if min(gaps) < 1e-6 * max(abs(s) for s in squares):
            continue
        with mp.workdps(34):
            reference = [sign * mp.sqrt(-s) for s in squares for sign in (1, -1)]
        plain = complex_eigenvalues(M, C, K)
        scaled = complex_eigenvalues(unit @ M @ unit, None, unit @ K @ unit)
        assert _worst(plain.values, reference) < 1e-10
        assert scaled.values == pytest.approx(plain.values, rel=1e-9)


@pytest.mark.parametrize("n", [1, 2, 3, 5])
def test_damped_systems_with_a_full_mass_matrix(rng, n):
    for _ in range(5):
        G, H, K = rng.normal(size=(3, n, n))
        M, C = G @ G.T + np.eye(n), 0.1 * H
        spectrum = complex_eigenvalues(M, C, K)
        assert _worst(spectrum.values, exact_damped(M, C, K)) < 1e-12
        for e in spectrum.eigenvalues:
            polynomial = e.value**2 * M + e.value * C + K
            size = np.abs(e.value) ** 2 * np.linalg.norm(M) + np.linalg.norm(K)
            left, right = (np.linalg.norm(x) for x in (e.left, e.right))
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
    assert values.imag[:4] == pytest.approx(np.array([1, -1, 1, -1]) * values[0].imag)
    assert values.real[:4] == pytest.approx(np.array([1, 1, -1, -1]) * values[0].real)
    assert values[0].real > 0
    assert values[4:] == pytest.approx([3j, -3j])
    repeated = complex_eigenvalues(np.eye(3), None, 4 * np.eye(3)).values
    assert repeated == pytest.approx([2j, -2j] * 3)


def test_masses_over_twelve_decades():
    m = np.array([1e-6, 1e6])
    K = np.sqrt(np.outer(m, m)) * np.array([[2.0, 0.1], [0.1, 2.0]])
    values = complex_eigenvalues(np.diag(m), None, K).values
    assert values[::2].imag == pytest.approx(np.sqrt([1.9, 2.1]), rel=1e-14)


def test_rigid_body_modes_are_exactly_zero():
    chain, ground = np.array([[1.0, -1, 0], [-1, 2, -1], [0, -1, 1]]), np.diag([1.0, 0, 0])
    M = np.diag([0.1, 0.7, 1.3])
    for C, zeros in ((None, 2), (10 * chain, 2), (10 * chain + ground, 1)):
        spectrum = complex_eigenvalues(M, C, 1e6 * chain)
        assert np.sum(spectrum.values == 0) == zeros
        shape = spectrum.eigenvalues[0].right
        assert shape == pytest.approx(np.full(3, shape[0]))


@pytest.mark.parametrize("coupling", [0.9, 1 - 1e-6, 1 - 2e-7])
def test_strong_damping_of_a_light_motion_leaves_a_stiff_system_no_zero_root(coupling):
    M, C, K = np.array([[1.0, coupling], [coupling, 1.0]]), 0.1 * np.eye(2), np.diag([4.0, 9.0])
    spectrum = complex_eigenvalues(M, C, K)
    assert np.all(spectrum.values)
    for exact in exact_damped(M, C, K):
        assert np.abs(spectrum.values / complex(exact) - 1.0).min() < 1e-6


def test_condition_grows_towards_a_coalescence(mode_coupling):
    # closed form for [[2, -1 + x], [-1, 2]], x = 4 mu/3: 1/|y^H x| = (2 - x)/(2 sqrt(1 - x))
    for mu in (0.3, 0.7, 0.74999):
        x = 4 * mu / 3
        expected = (2 - x) / (2 * np.sqrt(1 - x))
        for e in complex_eigenvalues(*mode_coupling(mu)).eigenvalues:
            assert e.condition == pytest.approx(expected, rel=1e-6)
    assert complex_eigenvalues(*mode_coupling(0.75)).eigenvalues[0].condition > 1e7


@pytest.mark.parametrize(
    ("M", "C", "K", "word"),
    [
        ([[1, 0]], None, [[1]], "M"),
        ([[1]], [[1, 2], [3, 4]], [[1]], "C"),
        ([[1]], None, [[np.nan]], "K"),
        ([[1]], None, [["a"]], "K"),
        ([[1]], [[1j]], [[1]], "C"),
        ([[-1]], None, [[1]], "M"),
        ([[1, 2], [2, 1]], None, np.eye(2), "M"),
        ([[1, 0.5], [0, 1]], None, np.eye(2), "M"),
    ],
)
def test_refuses_what_is_not_a_system(M, C, K, word):
    with pytest.raises(InputError, match=f"^{word}: "):
        complex_eigenvalues(M, C, K)


def test_roots_beyond_double_precision_are_not_given():
    I = np.eye(2)
    for M, C, K in ((I, None, 1e305 * I), (I, 1e200 * I, I), (1e-310 * I, None, I)):
        for ask in (complex_eigenvalues, judge):
            with pytest.raises(ComputationError):
                ask(M, C, K)


def test_a_cached_factor_cannot_be_written_to():
    M = np.diag([2.0, 8.0])
    with pytest.raises(ValueError, match="read-only"):
        reduce(M, None, M).T[:] = 0.0


ONES = np.ones((2, 2))
NO_ROW = np.array([[4.0, 0.0, 1.0], [0.0, 5.0, 1.0], [0.0, 0.0, 0.0]])


@pytest.mark.parametrize(
    ("M", "C", "K"),
    [
        (np.diag([1.0, 0.0]), None, np.diag([4.0, 0.0])),
        (ONES, 0.1 * ONES, 4.0 * ONES),
        (np.diag([1.0, 1.0, 0.0]), np.diag([0.1, 0.1, 0.0]), NO_ROW),
    ],
)
def test_matrices_of_which_every_number_is_a_root_are_refused(M, C, K):
    """They were called marginal, with no root missing."""
    with pytest.raises(InputError, match="every number is a root"):
        check_regular(M, C, K)
    with pytest.raises(InputError):
        system_roots(TermSystem((Term(M),), () if C is None else (Term(C),), (Term(K),)))


@pytest.mark.parametrize(
    ("M", "C", "K", "values"),
    [
        (np.diag([1.0, 0.0]), None, np.diag([4.0, 1e12]), [-2j, 2j]),
        (np.diag([1.0, 1e-8]), np.eye(2), np.zeros((2, 2)), [-1e8, -1.0, 0.0, 0.0]),
    ],
)
def test_a_massless_coordinate_alone_is_no_such_system(M, C, K, values):
    check_regular(M, C, K)
    found = system_roots(TermSystem((Term(M),), () if C is None else (Term(C),), (Term(K),)))
    values_found = np.sort_complex([e.value for e in found.eigenvalues])
    assert values_found == pytest.approx(np.array(values, dtype=complex), rel=1e-9)


@pytest.mark.parametrize(
    ("C", "K", "expected"),
    [
        (np.eye(2), np.zeros((2, 2)), True),  # the root -1 beside -1e20
        (np.eye(2), np.diag([0.0, 1e-20]), True),
        (np.diag([0.0, 1.0]), np.zeros((2, 2)), False),  # free but for the light one's damper
        (None, np.zeros((2, 2)), False),
    ],
)
def test_a_damper_of_a_light_mass_hides_the_root_of_a_free_one(C, K, expected):
    M = np.diag([1.0, 1e-20])
    assert hidden(reduce(M, C, K), C, K) == expected
    if expected and not K.any():
        found = system_roots(TermSystem((Term(M),), (Term(C),), (Term(K),)))
        slow = sorted(e.value.real for e in found.eigenvalues if abs(e.value) < 10)
        assert slow == pytest.approx([-1.0, 0.0, 0.0], abs=1e-9)


@pytest.mark.parametrize("C", [(), (Term(np.eye(1)),)])
def test_a_system_without_mass_is_refused_by_every_query(C):
    system = TermSystem((Term(np.zeros((1, 1))),), C, (Term(np.array([[4.0]]), Formula("1 + mu")),))
    for ask in (system_roots, lambda s: system_thresholds(s, 1.0)):
        with pytest.raises(InputError, match="mass"):
            ask(system)


@pytest.mark.parametrize("damping", [None, 0.01])
@pytest.mark.parametrize(
    ("K", "kind", "number"),
    [
        (np.diag([-1.0, 4.0]), "divergence", 1),
        (np.diag([-1.0, -4.0, 9.0]), "divergence", 2),
        (np.array([[2.0, -1.0], [0.5, 2.0]]), "flutter", 1),
        (np.diag([-1e-9, 1.0, 2.0, 3.0, 4.0]), "divergence", 1),
    ],
)
def test_a_growing_verdict_has_its_modes(K, kind, number, damping):
    """'verdict: divergence' came with `unstable: []` where nothing is damped."""
    eye = np.eye(len(K))
    C = None if damping is None else damping * eye
    roots = system_roots(TermSystem((Term(eye),), () if C is None else (Term(C),), (Term(K),)))
    modes = growing((*roots.eigenvalues, *roots.others))
    assert roots.verdict == kind == judge(eye, C, K).verdict
    assert [mode.kind for mode in modes] == [kind] * number
    assert len(complex_eigenvalues(eye, C, K).unstable) == number


# Sensitivities against differences of eigenvalues in 34-digit arithmetic and closed forms


def differences(values, moved, step):
    """Derivatives of values from the exact ones on both sides."""
    up, down = moved

    def nearest(value, candidates):
        return min(candidates, key=lambda c: abs(c - mp.mpc(complex(value))))

    return np.array([complex((nearest(v, up) - nearest(v, down)) / (2 * step)) for v in values])


def test_undamped_pads(rng):
    step = 1e-8
    for _ in range(20):
        M, C, K = random_pad(rng)
        dK = K * rng.normal(size=(3, 3))
        spectrum = complex_eigenvalues(M, C, K)
        if max(e.condition for e in spectrum.eigenvalues) > 100:
            continue
        found = sensitivities(M, C, K, dK=dK, spectrum=spectrum)
        with mp.workdps(34):
            moved = [
                [sign * mp.sqrt(-s) for s in exact_squares(M, K + e * dK) for sign in (1, -1)]
                for e in (step, -step)
            ]
        exact = differences(spectrum.values, moved, step)
        assert found == pytest.approx(exact, abs=1e-5 * np.abs(found).max())


def test_all_three_matrices_of_a_damped_system(rng):
    M, C, K = np.diag([1.0, 2.0]), 0.1 * rng.normal(size=(2, 2)), rng.normal(size=(2, 2)) + 5
    dM, dC, dK = np.diag([0.3, -0.2]), rng.normal(size=(2, 2)), rng.normal(size=(2, 2))
    step = 1e-7
    moved = [exact_damped(M + e * dM, C + e * dC, K + e * dK) for e in (step, -step)]
    exact = differences(complex_eigenvalues(M, C, K).values, moved, step)
    assert sensitivities(M, C, K, dM=dM, dC=dC, dK=dK) == pytest.approx(exact, rel=1e-6)


def test_square_root_behaviour_is_infinite(mode_coupling):
    free = ([[1.0]], None, [[0.0]])
    assert np.all(np.isinf(sensitivities(*free, dK=[[1.0]])))
    assert sensitivities(*free, dK=[[0.0]]).tolist() == [0, 0]
    assert np.all(np.abs(sensitivities(*mode_coupling(0.75), dK=[[0, 1], [0, 0]])) > 1e6)
