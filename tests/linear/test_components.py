"""Systems whose rows act one way only: their eigenvalues are those of the parts."""

from fractions import Fraction

import numpy as np
import pytest

import squeal
from squeal.linear import complex_eigenvalues, judge


def triangle(n, seed, couplings=4.0, permuted=True):
    """K with eigenvalues from 1.003 to 1.017, which are its diagonal entries."""
    rng = np.random.default_rng(seed)
    K = np.diag(np.linspace(1.003, 1.017, n)) + np.triu(rng.uniform(-1, 1, (n, n)) * couplings, 1)
    order = rng.permutation(n) if permuted else np.arange(n)
    return K[np.ix_(order, order)]


@pytest.mark.parametrize("n", [3, 5, 12, 30])
@pytest.mark.parametrize("couplings", [4.0, 0.1, 1e3])
@pytest.mark.parametrize("damping", [2.65e-5, 0.01])
def test_rows_in_one_way_order_decay_with_their_damping(n, couplings, damping):
    K = triangle(n, n, couplings)
    C = damping * np.eye(n)
    result = judge(np.eye(n), C, K)
    assert result.verdict == "stable"
    assert result.value == pytest.approx(-damping / 2, rel=1e-8)


@pytest.mark.parametrize("n", [2, 7, 40])
def test_a_shuffled_jordan_block_without_damping_is_marginal(n):
    order = np.random.default_rng(n).permutation(n)
    K = (1.5 * np.eye(n) + np.eye(n, k=1))[np.ix_(order, order)]
    assert judge(np.eye(n), None, K).verdict == "marginal"


@pytest.mark.parametrize(
    "block",
    [[[2.0]], [[5.0]], [[7.0]], [[20.0]], [[6.0, -6.0], [-6.0, 9.0]], [[51.0, 33.0], [33.0, 42.0]]],
)
@pytest.mark.parametrize("coupling", [1.0, 2.0, 4.0, 16.0])
def test_two_equal_parts_of_which_one_drives_the_other_have_their_roots_twice(block, coupling):
    n = len(block)
    zero = np.zeros((n, n))
    lower = np.block([[np.array(block), zero], [coupling * np.eye(n), np.array(block)]])
    frequencies = np.repeat(np.sqrt(np.linalg.eigvalsh(block)), 2)
    for K in (lower, lower.T):
        spectrum = complex_eigenvalues(np.eye(2 * n), None, K)
        upper = spectrum.values[spectrum.values.imag > 0.0]
        assert np.allclose(upper, 1j * frequencies, rtol=1e-12, atol=0.0)
        assert judge(np.eye(2 * n), None, K).verdict == "marginal"


def test_28_friction_contacts_in_a_row_decay():
    """Each acts on the next one alone: 172 rows, of which blocks of six are alike."""
    rng = np.random.default_rng(3)
    count = 28
    block = np.eye(6) + 0.3 * (np.eye(6, k=1) - np.eye(6, k=-1))
    K = np.kron(np.eye(count), block) + np.kron(np.eye(count, k=1), rng.normal(size=(6, 6)))
    K = np.pad(K, (0, 4)) + np.diag([0.0] * 168 + [5.0, 6.0, 7.0, 8.0])
    order = rng.permutation(172)
    # of lambda^2 + C lambda + 1 + i b: stable where C > |b|, b at most 0.6
    result = judge(np.eye(172), 0.62 * np.eye(172), K[np.ix_(order, order)])
    assert result.verdict == "stable"
    b = 0.6 * np.cos(np.pi / 7)
    truth = np.roots([1.0, 0.62, 1.0 + 1j * b]).real.max()
    assert result.value == pytest.approx(truth, rel=1e-9)


def test_a_stiff_part_leaves_a_slow_one_its_digits():
    K = np.diag([1e18, 4.0, 9.0]) + np.diag([0.0, 3.0], 1)
    roots = complex_eigenvalues(np.eye(3), np.diag([0.0, 0.2, 0.6]), K).eigenvalues
    slow = [root for root in roots if abs(root.value) < 10.0]
    exact = [complex(-c / 2, np.sqrt(k - c * c / 4)) for k, c in ((4.0, 0.2), (9.0, 0.6))]
    assert [r.value for r in slow if r.value.imag > 0] == pytest.approx(exact, rel=1e-14)
    assert max(r.rounding for r in slow) < 1e-12


@pytest.mark.parametrize("damped", [False, True])
def test_vectors_hold_what_one_part_drives_in_another(damped):
    K = triangle(6, 1) + np.diag([0.0, 1, 2, 3, 4, 5])
    C = 0.1 * np.eye(6) if damped else None
    for root in complex_eigenvalues(np.eye(6), C, K).eigenvalues:
        P = root.value**2 * np.eye(6) + root.value * (np.zeros_like(K) if C is None else C) + K
        assert np.linalg.norm(P @ root.right) < 1e-11
        assert np.linalg.norm(root.left.conj() @ P) < 1e-11
        assert root.residual < 1e-13


def test_equal_parts_that_act_on_each_other_one_way_have_vectors():
    """The root is defective: one vector, which lives in the part that is driven."""
    K = np.array([[2.0, 1.0], [0.0, 2.0]])
    for root in complex_eigenvalues(np.eye(2), None, K).eigenvalues:
        assert root.value**2 == pytest.approx(-2.0, rel=1e-15)
        assert np.abs(root.right) == pytest.approx([1.0, 0.0], abs=1e-12)
        assert np.abs(root.left) == pytest.approx([0.0, 1.0], abs=1e-12)


def test_a_driven_row_lengthens_the_vector_of_a_damped_root_and_its_condition():
    """Null vectors e1 and e2 of K are orthogonal: at zero y^H P' x is C21, and y^H x says nothing.
    The third row follows the first, at -1/(z^2 + z/10 + 5) of it."""
    K = np.array([[0.0, 1.0], [0.0, 0.0]])
    C = np.array([[0.3, 0.0], [1.0, 0.2]])
    driving = np.pad(K, (0, 1)) + np.diag([0.0, 0.0, 5.0])
    driving[2, 0] = 1.0
    damping = np.pad(C, (0, 1)) + np.diag([0.0, 0.0, 0.1])
    roots = complex_eigenvalues(np.eye(3), damping, driving).eigenvalues
    for alone in complex_eigenvalues(np.eye(2), C, K).eigenvalues:
        root = min(roots, key=lambda other: abs(other.value - alone.value))
        z = alone.value
        x = np.append(alone.right, -alone.right[0] / (z * z + 0.1 * z + 5.0))
        length = np.linalg.norm(x)
        assert np.abs(root.right) == pytest.approx(np.abs(x) / length, rel=1e-12)
        assert np.abs(root.left) == pytest.approx([*np.abs(alone.left), 0.0], abs=1e-12)
        assert root.condition == pytest.approx(alone.condition * length, rel=1e-12)


def test_the_threshold_of_a_driven_pad_is_its_own():
    """Two pads with thresholds at 1/2 and 3/4, the first of which drives the second."""
    pads = np.array([[2.0, 0, 3, 1], [0, 3.0, 2, 5], [0, 0, 2.0, 0], [0, 0, 0, 3.5]])
    friction = np.zeros((4, 4))
    friction[[0, 1, 2, 3], [1, 0, 3, 2]] = 1.0, -1.0, 1.0, -1.0
    system = squeal.System(np.eye(4), K={"1": pads, "mu": friction}, parameters={"mu": 0.0})
    found = squeal.thresholds(system, 2.0)
    assert [c.mu for c in found.crossings] == pytest.approx([Fraction(1, 2), Fraction(3, 4)])
    assert found.certified
