"""Derivatives by the complex step and by dual numbers against closed forms."""

import numpy as np
import pytest

from squeal.numerics import differentiation
from squeal.numerics.differentiation import Dual, complex_step


def curve(x):
    return np.array([x[0] ** 2 + x[1] ** 2, np.sin(x[0]) * x[1], 3.0 * x[1]])


def slope(x):
    a, b = x
    return np.array([[2 * a, 2 * b], [np.cos(a) * b, np.sin(a)], [0.0 * a, 3.0 + 0.0 * a]])


def test_complex_step_is_the_derivative_of_one_and_of_many_points():
    x = np.array([0.7, -1.3])
    assert complex_step(curve, x) == pytest.approx(slope(x), rel=1e-15)
    many = np.random.default_rng(1).normal(size=(2, 5))
    assert complex_step(curve, many) == pytest.approx(slope(many), rel=1e-14)
    along = np.array([2.0, 0.5])
    assert complex_step(curve, x, along=along) == pytest.approx(slope(x) @ along, rel=1e-15)


@pytest.mark.parametrize("ops", [np, differentiation])
def test_dual_numbers_and_the_complex_step_agree(ops):
    def f(x):
        return ops.exp(2.0 - x) / ops.sqrt(x) - 3.0 * ops.sin(x) ** 3 + (1.0 + ops.cos(x)) / x

    at, step = 0.7, 1e-200
    expected = f(at + 1j * step).imag / step if ops is np else f(Dual(at, 1.0)).slope
    assert complex_step(
        lambda x: np.exp(2.0 - x) / np.sqrt(x) - 3.0 * np.sin(x) ** 3 + (1.0 + np.cos(x)) / x, [at]
    )[0, 0] == pytest.approx(expected, rel=1e-14)
