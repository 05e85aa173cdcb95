"""Stacks of systems against the same systems one at a time and against more digits."""

import numpy as np
import pytest

from squeal.errors import InputError
from squeal.linear import complex_eigenvalues, stack_eigenvalues, sweep
from squeal.linear.matrices import LightMassError
from tests.linear.conftest import exact_damped

UNITS = 2.0 ** np.arange(-20, 21, 8)[:, None, None]  # of stiffness, from system to system


def _masses(kind, n, rng):
    shape = (len(UNITS), n, n) if kind.endswith("each") else (n, n)
    if kind.startswith("diagonal"):
        return rng.uniform(0.5, 2.0, shape) * np.eye(n)
    G = rng.normal(size=shape)
    size = 10.0 ** rng.uniform(-4.0, 4.0, n)  # translations beside rotations
    return size[:, None] * (G @ G.swapaxes(-2, -1) / n + np.eye(n)) * size


@pytest.mark.parametrize("damping", [None, 0.0, 0.1, 5.0])
@pytest.mark.parametrize("kind", ["diagonal", "full", "diagonal, each", "full, each"])
@pytest.mark.parametrize("n", [1, 2, 3, 5, 20])
def test_stacks_have_the_eigenvalues_of_their_systems(rng, n, kind, damping):
    M = _masses(kind, n, rng)
    size = np.sqrt(np.diagonal(M, axis1=-2, axis2=-1))
    unit = size[..., :, None] * size[..., None, :]
    G, H = rng.normal(size=(2, len(UNITS), n, n))
    K = UNITS**2 * unit * (G + 3 * n * np.eye(n))
    C = None if damping is None else damping * UNITS * unit * (H @ H.swapaxes(1, 2) + np.eye(n))
    table = stack_eigenvalues(M, C, K)
    for i, row in enumerate(table):
        alone = M if M.ndim == 2 else M[i], None if C is None else C[i], K[i]
        values = complex_eigenvalues(*alone).values
        assert row == pytest.approx(values, abs=1e-11 * np.abs(values).max(), rel=0)
        assert np.array_equal(row[::2].conj(), row[1::2]) or damping == 5.0
    if n <= 3 and C is not None:
        exact = exact_damped(*alone)
        for value in row:
            assert min(abs(complex(e) - value) for e in exact) < 1e-12 * np.abs(row).max()
    swept = sweep(lambda i: (M if M.ndim == 2 else M[i], None if C is None else C[i], K[i]), [0, 2])
    assert swept == pytest.approx(table[[0, 2]], rel=1e-9, abs=1e-13)


@pytest.mark.parametrize("mass", [0.0, 0.3])  # that changes along the sweep
@pytest.mark.parametrize("damping", [None, 0.0, 0.05])
def test_sweep_gives_the_same_values(mode_coupling, damping, mass):
    def system(mu):
        M, _, K = mode_coupling(mu)
        C = None if damping is None or mu == 0.0 else damping * np.diag([1.0, 2.0])
        return M + mass * mu * np.eye(2), C, K

    mus = np.linspace(0, 2, 9)
    table = sweep(system, mus)
    assert table.shape == (9, 4)
    for row, mu in zip(table, mus, strict=True):
        assert row == pytest.approx(complex_eigenvalues(*system(mu)).values, abs=1e-12)


def test_repeated_eigenvalues_stand_in_pairs_and_real_ones_fall():
    K = np.array([np.diag([4.0, 4.0, 4.0]), np.diag([4.0, -9.0, 1.0]), np.diag([0.0, 0.0, 1.0])])
    undamped = stack_eigenvalues(np.eye(3), None, K)
    assert undamped[0].tolist() == [2j, -2j] * 3
    assert undamped[1].tolist() == [3, -3, 1j, -1j, 2j, -2j]
    assert undamped[2].tolist() == [0, 0, 0, 0, 1j, -1j]
    damped = stack_eigenvalues(np.eye(3), np.diag([0.0, 0.0, 3.0]), K)
    assert damped[1] == pytest.approx([3, (-3 + 5**0.5) / 2, (-3 - 5**0.5) / 2, -3, 2j, -2j])
    assert not np.signbit(undamped.real[0]).any()


def _pair(coupling, skew=0.0, size=1.0):
    """Two masses of which one motion has 1 - coupling, another 1 + coupling, in any unit."""
    return np.array([[1.0, size * coupling], [size * (coupling + skew), size**2]])


@pytest.mark.parametrize("size", [1.0, 1e5])
def test_a_mass_matrix_of_a_stack_is_taken_or_refused_as_alone(size):
    K, C = np.array([np.diag([4.0, 9.0 * size**2])] * 2), np.diag([0.1, 0.1 * size**2])
    for coupling in (0.0, 0.9, 1 - 1e-6, 1 - 2.1e-7):  # the last beyond what is taken unseen
        exact = exact_damped(_pair(coupling, 0.0, size), C, K[0])
        for skew in (0.0, 1e-13):
            stack = [_pair(0.0, 0.0, size), _pair(coupling, skew, size)]
            for value in stack_eigenvalues(stack, C, K)[1]:
                assert min(abs(complex(e) - value) for e in exact) < 1e-5 * abs(value)
    for bad, error in (
        (_pair(1 - 1e-8, 0.0, size), LightMassError),
        (_pair(1.1, 0.0, size), InputError),
        (_pair(0.5, 1e-11, size), InputError),
        (np.diag([1.0, -1.0]), InputError),
        (np.diag([1.0, 0.0]), LightMassError),
        (np.full((2, 2), np.nan), InputError),
    ):
        for damping in (None, C):
            with np.errstate(all="raise"), pytest.raises(error, match=r"^M: "):
                stack_eigenvalues([np.eye(2), bad], damping, K)
            with pytest.raises(error, match=r"^M: "):
                stack_eigenvalues(bad, damping, K)


@pytest.mark.parametrize(
    ("M", "C", "K", "word"),
    [
        (np.eye(2), None, np.eye(2), "K"),
        (np.eye(2), None, np.ones((4, 2, 3)), "K"),
        (np.eye(2), None, [np.eye(2), np.full((2, 2), np.inf)], "K"),
        (np.eye(3), None, [np.eye(2)] * 4, "M"),
        (np.eye(2), [np.eye(2)] * 3, [np.eye(2)] * 4, "C"),
        (np.eye(2), np.full((2, 2), np.nan), [np.eye(2)] * 4, "C"),
        ([["a"]], None, [[[1.0]]], "M"),
        (np.eye(2), None, [np.eye(2) * (1 + 0.05j)], "K"),
    ],
)
@pytest.mark.filterwarnings("error")
def test_refuses_what_is_no_stack(M, C, K, word):
    with pytest.raises(InputError, match=f"^{word}: "):
        stack_eigenvalues(M, C, K)
