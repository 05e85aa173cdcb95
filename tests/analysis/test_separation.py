"""Matrices at two or three values of a parameter as a constant and a linear part."""

import numpy as np
import pytest

from squeal.analysis.systems.matrices import separated
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
