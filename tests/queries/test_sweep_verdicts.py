"""Verdicts of sweeps are those of single values: growth far below any share of the frequency."""

import numpy as np
import pytest

import squeal

EYE = np.eye(2)
GROWTH = [1e-4, 1e-8, 1e-12]


def one_row(growth):
    """x'' - 2 g x' + x = 0 grows by g."""
    return squeal.System([[1.0]], [[-2 * growth]], {"1": [[1.0]], "mu": [[0.0]]})


def beside_a_stiff_row(growth):
    C = np.diag([-2 * growth, 0.1])
    return squeal.System(EYE, C, {"1": np.diag([1.0, 1e6]), "mu": np.diag([0.0, 1.0])})


def beside_a_strong_damper(growth):
    C = np.diag([-2 * growth, 1e8])
    return squeal.System(EYE, C, {"1": EYE, "mu": np.diag([0.0, 1.0])})


def circulatory(growth):
    """lambda^2 = -1 -+ 2 i g grows by g, in exact numbers."""
    K = np.array([[1.0, 2 * growth], [-2 * growth, 1.0]])
    return squeal.System(EYE, K={"1": K, "mu": np.zeros((2, 2))})


def by_friction(growth):
    """The same at mu = 1/2."""
    return squeal.System(EYE, K={"1": EYE, "mu": [[0.0, 4 * growth], [-4 * growth, 0.0]]})


def coupled(growth):
    """Two rows turned by 45 degrees, damped by 0.02 and by -2 g: exact in binary numbers."""
    C = np.array([[0.02 - 2 * growth, 0.02 + 2 * growth]] * 2) / 2
    C[1] = C[1, ::-1]
    return squeal.System(EYE, C, {"1": [[2.5, 1.5], [1.5, 2.5]], "mu": np.zeros((2, 2))})


@pytest.mark.filterwarnings("ignore:the referee refutes")
@pytest.mark.parametrize("growth", GROWTH)
@pytest.mark.parametrize(
    "family",
    [one_row, beside_a_stiff_row, beside_a_strong_damper, circulatory, by_friction, coupled],
)
def test_growth_of_any_size_is_growth_in_a_sweep(family, growth):
    for sign in (1.0, -1.0):
        system = family(sign * growth)
        (step, _) = squeal.sweep(system, [0.5, 0.75]).steps
        undamped = not system.C
        expected = "flutter" if sign > 0.0 or undamped else "stable"
        assert step.verdict == expected
        assert squeal.eigenvalues(system, at=0.5).verdict == expected


def test_a_defective_value_is_open_as_it_is_alone():
    """Two equal squares with one vector: the last digits decide on which side of the axis."""
    K = {"1": [[2.0, -1.0], [-1.0, 2.0]], "mu": [[0.0, 1.0], [0.0, 0.0]]}
    system = squeal.System(EYE, K=K)
    at_onset, beyond = squeal.sweep(system, [1.0, 2.0]).steps
    assert at_onset.verdict == squeal.eigenvalues(system, at=1.0).verdict
    assert beyond.verdict == "flutter"
