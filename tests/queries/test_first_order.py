"""Systems of the first order, E x' = A x, given as C = E and K = -A without any mass."""

import numpy as np
import pytest
from scipy.linalg import eigvals
from scipy.sparse import block_array, csc_array, diags_array, eye_array

import squeal
from squeal.errors import InputError

COMPANION = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, -2.0, -2.0]])
"""Of s^3 + 2 s^2 + 2 s + 1 = (s + 1)(s^2 + s + 1)."""
PAIR = complex(-0.5, 0.75**0.5)


def _without_mass(E, A):
    none = csc_array(np.shape(A)) if not isinstance(A, np.ndarray) else np.zeros(A.shape)
    return squeal.System(none, C=E, K=-A)


def _nearest(values, wanted):
    return max(float(np.min(np.abs(np.asarray(values) - z))) for z in wanted)


@pytest.mark.parametrize("rate", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_poles_of_a_controller_are_the_roots_of_its_polynomial(rate, scale):
    answer = squeal.eigenvalues(_without_mass(scale * np.eye(3), scale * rate * COMPANION))
    assert len(answer.values) == 3
    assert _nearest(answer.values / rate, [-1.0, PAIR, PAIR.conjugate()]) < 1e-14
    assert answer.verdict == "stable"
    assert answer.certified


def test_states_without_a_derivative_give_no_root():
    E = np.diag([2.0, 1.0, 0.0])
    A = np.array([[-1.0, 2, 1], [0, -3, 1], [1, 1, -4]])
    answer = squeal.eigenvalues(_without_mass(E, A))
    # x3 = (x1 + x2)/4 leaves [[-3/8, 9/8], [1/4, -11/4]]
    assert len(answer.values) == 2
    assert _nearest(answer.values, eigvals([[-0.375, 1.125], [0.25, -2.75]])) < 1e-14


def test_roots_with_E_that_is_not_symmetric():
    random = np.random.default_rng(3)
    E, A = random.normal(size=(2, 6, 6))
    answer = squeal.eigenvalues(_without_mass(E, A))
    assert _nearest(answer.values, eigvals(A, E)) < 1e-11


def test_growth_is_found():
    answer = squeal.eigenvalues(_without_mass(np.eye(2), np.array([[0.1, 1.0], [-1.0, 0.1]])))
    assert answer.verdict == "flutter"
    assert _nearest(answer.values, [0.1 + 1j]) < 1e-15


def test_the_gain_at_which_a_loop_begins_to_grow():
    feedback = np.zeros((3, 3))
    feedback[2, 0] = 1.0  # s^3 + 2 s^2 + 2 s + 1 + g: Routh's criterion gives g = 3, s = i sqrt 2
    loop = squeal.System(np.zeros((3, 3)), C=np.eye(3), K={"1": -COMPANION, "mu": feedback})
    answer = squeal.thresholds(loop, 5.0, band=(0.05, 0.5))
    (threshold,) = answer.crossings
    assert threshold.mu == pytest.approx(3.0, abs=1e-12)
    assert threshold.frequency_hz == pytest.approx(2**0.5 / (2 * np.pi), rel=1e-12)
    (threshold,) = squeal.thresholds(loop, 5.0).crossings
    assert threshold.mu == pytest.approx(3.0, abs=1e-12)


def test_a_loop_of_third_order_is_a_row_without_mass():
    """s^3 + 2 s^2 + 2 s + k = 0 has two roots on the axis at k = 4, +- i sqrt(2)."""
    stiffness = {"1": [[2.0, 0.0], [-1.0, 0.0]], "k": [[0.0, 1.0], [0.0, 0.0]]}
    loop = squeal.System(
        [[1.0, 0.0], [0.0, 0.0]],
        [[2.0, 0.0], [0.0, 1.0]],
        stiffness,
        {"k": 1.0},
        parameter="k",
    )
    (threshold,) = squeal.thresholds(loop, 10.0, band=(0.01, 1.0)).crossings
    assert threshold.mu == pytest.approx(4.0, rel=1e-9)
    assert threshold.frequency_hz == pytest.approx(2**0.5 / (2 * np.pi), rel=1e-9)


def test_an_integrator_needs_no_stiffness_of_its_own():
    """s^3 + s^2 / 10 + 4 s + mu^2 = 0 has two roots on the axis at mu^2 = 0.4, +- 2 i."""
    stiffness = {"1": [[4.0, 0.0], [0.0, 0.0]], "mu": [[0.0, 1.0], [-1.0, 0.0]]}
    loop = squeal.System([[1.0, 0.0], [0.0, 0.0]], [[0.1, 0.0], [0.0, 1.0]], stiffness)
    (threshold,) = squeal.thresholds(loop, 2.0, band=(0.1, 1.0)).crossings
    assert threshold.mu == pytest.approx(0.4**0.5, rel=1e-9)
    assert threshold.frequency_hz == pytest.approx(1 / np.pi, rel=1e-9)
    assert 0.0 in squeal.eigenvalues(loop, at=0.0).values


def test_a_large_sparse_one_has_its_roots_in_a_band(monkeypatch):
    monkeypatch.setattr("squeal.queries.systems.all_roots.ALL_ROWS", 40)
    n = 60
    stiffness = 100.0
    damping = 0.01
    chain = diags_array([np.ones(n - 1), -2 * np.ones(n), np.ones(n - 1)], offsets=[-1, 0, 1])
    damped = -damping * eye_array(n)
    A = block_array([[None, eye_array(n)], [stiffness * chain, damped]], format="csc")
    E = eye_array(2 * n, format="csc")
    answer = squeal.eigenvalues(squeal.System(csc_array(A.shape), C=E, K=-A), band=(0.0, 0.2))
    omega = 2 * np.sqrt(stiffness) * np.sin(np.arange(1, n + 1) * np.pi / (2 * n + 2))
    heights = np.sqrt(omega**2 - damping**2 / 4)
    wanted = heights[heights < 0.4 * np.pi]
    assert len(answer.values) == len(wanted)
    assert answer.certified
    assert _nearest(answer.values, -damping / 2 + 1j * wanted) < 1e-9


def test_neither_mass_nor_damping_is_refused():
    with pytest.raises(InputError, match="M or C must not be"):
        squeal.eigenvalues(squeal.System(np.zeros((2, 2)), K=np.eye(2)))
