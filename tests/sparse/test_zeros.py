"""Roots that are exactly zero: as many in every form in which they are computed."""

import numpy as np
import pytest

from squeal.linear import complex_eigenvalues
from squeal.sparse.dense import dense_values, pencil_values
from tests.sparse.test_modes import assert_same

CHAIN = np.array([[1.0, -1, 0], [-1, 2, -1], [0, -1, 1]])
TURN = np.linalg.qr(np.arange(9.0).reshape(3, 3) ** 2 + np.eye(3))[0]
PUSHED = np.array([[0.0, 1, 0], [0, 0, 0], [0, 0, 4]])  # one free motion pushes the other
ROOT = np.diag([1.0, 1.5, 0.5])  # of M
NONE = np.zeros((3, 3))


@pytest.mark.parametrize(
    ("C", "K", "zeros"),
    [
        (NONE, CHAIN, 2),
        (1e-3 * CHAIN, CHAIN, 2),  # damped within itself
        (np.diag([1e-3, 0, 0]), CHAIN, 1),  # and against the ground
        (np.diag([1e-3, 0, 0]), CHAIN + 1e-9 * np.eye(3), 0),
        (NONE, np.diag([0.0, 0, 2]), 4),
        (np.diag([0.1, 0, 0]), np.diag([0.0, 0, 2]), 3),
        (NONE, PUSHED, 4),
        (NONE, ROOT @ TURN @ PUSHED @ TURN.T @ ROOT, 4),
        (NONE, TURN @ np.diag([1.0, 3, 4]) @ TURN.T, 0),
    ],
)
def test_roots_of_free_motions_are_zero_in_every_form(C, K, zeros):
    M = ROOT @ ROOT
    turned = TURN + 2 * np.eye(3)
    C = 1e2 * C
    K = 1e6 * K
    values = complex_eigenvalues(M, C, K).values
    assert np.sum(values == 0) == zeros
    for T in (np.eye(3), turned, turned * (1 + 1j)):  # rows that are combined have the same roots
        parts = T @ M, T @ C, T @ K
        for size in (None, float(np.linalg.norm(T @ K, 2))):
            found = dense_values(*parts, size)
            assert np.sum(found == 0) == zeros
            assert_same(found, values, 1e-7)
        found, _ = pencil_values(*parts)
        assert np.sum(found == 0) == zeros
        assert_same(found, values, 1e-7)


def test_what_a_greater_stiffness_leaves_of_rounding_holds_nothing():
    M = np.eye(3)
    K = CHAIN + 1e-10 * np.eye(3)
    assert np.sum(dense_values(M, None, K, 1.0) == 0) == 0
    assert np.sum(dense_values(M, None, K, 1e5) == 0) == 2


def test_a_free_motion_without_mass_is_no_root():
    for C, zeros in ((NONE, 2), (np.diag([0.0, 0, 1]), 1)):
        roots, _ = pencil_values(np.diag([1.0, 2, 0]), C, CHAIN)
        assert np.sum(roots == 0) == zeros
