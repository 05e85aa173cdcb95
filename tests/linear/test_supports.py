"""Rows that a penalty on the diagonal holds are supports, and no others."""

import numpy as np
import pytest

import squeal
from squeal.linear.matrices import dense
from squeal.linear.system import TermSystem, without_supports
from squeal.linear.terms import Term
from squeal.numerics.differentiation import Formula
from tests.linear.test_terms import KINDS


@KINDS
@pytest.mark.parametrize("penalty", [1e22, 1e36])
def test_penalties_on_the_diagonal_are_supports(kind, penalty):
    held = np.diag([0.0, penalty, 0.0, 3.0 * penalty, 0.0])
    K = 1e6 * (np.eye(5) + 0.1 * np.arange(25).reshape(5, 5)) + held
    system = TermSystem((Term(kind(np.eye(5))),), (), (Term(kind(K)),))
    rest, rows = without_supports(system)
    assert rows.tolist() == [1, 3]
    assert dense(rest.at()[2]) == pytest.approx(K[::2, ::2], rel=1e-15)


@pytest.mark.parametrize(
    ("K", "mass"),
    [
        (np.eye(3) + 1e20 * np.array([[1.0, -1, 0], [-1, 1, 0], [0, 0, 0]]), [1.0, 1.0, 1.0]),
        ([[1e12, 0.0], [0.0, 1.0]], [1.0, 1e-12]),  # N/m beside N m/rad
        ([[1.0, 0.2], [0.2, 1e6]], [1.0, 1.0]),
        ([[1.0]], [1.0]),
        ([[0.0, 0.0], [0.0, 4.0]], [1.0, 1.0]),
        (np.diag([1e-6, 1e7, 1.1e7]), [1.0, 1.0, 1.0]),  # a free body's soft mode
        (np.diag([1e-12, 1.0]), [1.0, 1.0]),
    ],
)
def test_stiff_springs_between_coordinates_and_mixed_units_are_no_supports(K, mass):
    system = TermSystem((Term(np.diag(mass)),), (), (Term(np.array(K)),))
    assert not without_supports(system)[1].size


@pytest.mark.parametrize(
    "diagonal",
    [
        (1e-17, -7.0, 2e-17),
        (1e-17, 3e-17, 2e-17, -7.0),
        (1.0, 2.0, -1e22),
        (1.0, 2.0, 3.0, 1e22, -1e22),  # which nothing holds: no penalty stands above it
        (-1e-17, -2e-17, -7.0),
    ],
)
@pytest.mark.filterwarnings("ignore:.*are M and K swapped")
def test_a_row_of_negative_stiffness_is_no_support_and_grows(diagonal):
    system = TermSystem((Term(np.eye(len(diagonal))),), (), (Term(np.diag(diagonal)),))
    rest, rows = without_supports(system)
    assert not rows.size
    answer = squeal.eigenvalues(rest)
    assert answer.verdict == "divergence"
    fastest = max(root.value.real for root in answer.eigenvalues)
    assert fastest == pytest.approx(np.sqrt(-min(diagonal)), rel=1e-12)


COUPLED = np.zeros((3, 3))
COUPLED[0, 1] = 5e6
COUPLED[1, 0] = -5e6


@KINDS
@pytest.mark.parametrize(
    ("diagonal", "coupling"),
    [
        ((1e-6, 1e7, 1.1e7), COUPLED),  # a modal model of a nearly free body
        ((1e-6, 1e-6, 1e7, 1e7, 1.1e7), None),
        ((0.0, 1e-4, 1e7, 2e7), None),
        ((1.0, 1.0, 1e11), 2.0 * COUPLED.T[::-1]),  # coupled at another value of mu
        ((1e-6, 1e7), None),
    ],
)
def test_stiff_rows_that_are_no_minority_or_coupled_somewhere_are_no_supports(
    kind, diagonal, coupling
):
    K = [Term(kind(np.diag(diagonal)))]
    if coupling is not None:
        K.append(Term(kind(coupling), Formula("mu")))
    system = TermSystem((Term(kind(np.eye(len(diagonal)))),), (), tuple(K), {"mu": 0.0})
    assert not without_supports(system)[1].size


def test_supports_of_two_sizes_and_a_soft_row_are_told_apart():
    diagonal = (1e-6, 1e7, 1e7, 2e7, 3e7, 1e22, 1e36)
    system = TermSystem((Term(np.eye(7)),), (), (Term(np.diag(diagonal)),))
    assert without_supports(system)[1].tolist() == [5, 6]


def test_a_support_without_a_label_is_called_by_its_row():
    with pytest.warns(UserWarning, match=r"the first is row 4$"):
        system = squeal.System(np.eye(4), K=np.diag([1.0, 2.0, 3.0, 1e22]), labels=np.array(["x"]))
    assert system.row_names == ["x", "q2", "q3"]
