"""Matrices at two or three values of a parameter as a constant and a linear part."""

import numpy as np
import pytest

from squeal.analysis.systems.separation import separated
from squeal.errors import InputError

K0, K1 = np.array([[3.0, -1.0], [-1.0, 2.0]]), np.array([[0.0, 0.5], [0.0, 0.0]])


def test_both_parts_come_back():
    found = separated([0.25, 0.75], [K0 + 0.25 * K1, K0 + 0.75 * K1])
    assert np.array_equal(found.constant.toarray(), K0)
    assert np.array_equal(found.linear.toarray(), K1)
    assert found.error is None


def test_refusals():
    with pytest.raises(InputError, match=r"0\.5: is there twice; different values are allowed"):
        separated([0.5, 0.5], [K0, K0])
    with pytest.raises(InputError, match=r"^0\.4: is there twice"):
        separated([0.0, 0.4, 0.4], [K0, K0, K0])
    with pytest.raises(InputError, match="of one size"):
        separated([0.0, 0.5], [K0, np.eye(3)])


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("values", [[0.0, 1e-310], [1e300, 1.1e300], [0.0, 1e-300]])
def test_terms_are_finite_or_refused(values):
    big = values[1] - values[0] < 1.0
    parts = [1e10 * K0, 1e10 * K0 + 1e10 * K1] if big else [1e10 * K0, 1e10 * K0]
    if big:
        with pytest.raises(InputError, match="is not finite; values farther apart are allowed"):
            separated(values, parts)
    else:
        assert separated(values, parts).linear.nnz == 0
