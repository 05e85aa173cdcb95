"""A mass that some motion has with the wrong sign is named, and K is not blamed for it."""

import re

import numpy as np
import pytest

import squeal
from squeal.errors import InputWarning

EYE = np.eye(2)
SKEWED = np.array([[1.0, 0.9, -0.9], [0.9, 1.0, 0.9], [-0.9, 0.9, 1.0]])  # 1 - 2 * 0.9 < 0
NEGATIVE = {
    "one row": (np.diag([-1.0, 1.0]), "row 1"),
    "all rows": (-10 * EYE, "row 1"),
    "two rows coupled": (np.array([[1.0, 2.0], [2.0, 1.0]]), "coupled by more"),
    "three rows": (SKEWED, "several rows"),
    "many rows": (np.diag([1.0] * 399 + [-1e-3] + [1.0] * 50), "row 400"),
}


@pytest.mark.parametrize("case", NEGATIVE)
def test_a_negative_mass_is_named(case):
    M, words = NEGATIVE[case]
    assert np.linalg.eigvalsh(M)[0] < 0.0
    system = squeal.System(M, K=np.eye(len(M)))
    band = (0.5, 1.0) if len(M) > 400 else None  # beside the root of 449 rows at 0.159 Hz
    with pytest.warns(InputWarning, match=f"M is no mass: .*{words}"):
        squeal.eigenvalues(system, band=band)
    with pytest.warns(InputWarning, match="M is no mass"):
        found = squeal.check(system)
    assert (found.free, found.negative, found.frequencies_hz) == (None, None, ())
    assert re.search(f"M is no mass: .*{words}", found.hints[-1])


@pytest.mark.parametrize("M", [EYE, np.diag([1.0, 0.0]), np.ones((2, 2)), 0 * EYE])
def test_semidefinite_masses_are_taken(M):
    system = squeal.System(M, EYE, EYE)
    assert squeal.eigenvalues(system).verdict == "stable"
    assert squeal.check(system).negative == 0


def test_rows_of_equations_in_another_order_are_no_negative_masses():
    """[[0, 1], [1, 0]] P with rows exchanged: the same two oscillators."""
    turned = np.array([[0.0, 2.0], [-1.0, 0.0]])
    found = squeal.eigenvalues(squeal.System(turned, K=turned @ np.diag([4.0, 9.0])))
    assert sorted(found.values.imag) == pytest.approx([-3, -2, 2, 3])
