"""Newton's method and the complex step on functions with known zeros and derivatives."""

import numpy as np
import pytest

from squeal.numerics.newton import complex_step, newton


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
    way = np.array([2.0, 0.5])
    assert complex_step(curve, x, along=way) == pytest.approx(slope(x) @ way, rel=1e-15)


def circle_and_line(x):
    value = np.array([x[0] ** 2 + x[1] ** 2 - 2, x[0] - x[1]])
    return value, np.array([[2 * x[0], 2 * x[1]], [1.0, -1.0]])


def test_newton_converges_to_the_zero():
    found = newton(circle_and_line, [2.0, 0.5])
    assert found.converged
    assert found.x == pytest.approx([1.0, 1.0], rel=1e-15)


def test_newton_tells_why_it_ended():
    assert newton(circle_and_line, [0.0, 0.0]).status == "singular"
    assert newton(circle_and_line, [2.0, 0.5], steps=2).status == "unfinished"
    assert newton(lambda x: (np.array([np.nan]), np.eye(1)), [1.0]).status == "diverged"
    # a double zero halves its distance in each step: far from the tolerance after thirty
    double = lambda x: (x**2, np.diag(2 * x))  # noqa: E731
    assert newton(double, [1.0]).status == "unfinished"
    assert newton(double, [1.0], tolerance=1e-6).converged


def test_steps_that_stall_count_only_if_they_may():
    calls = iter(range(100))

    def rounded(x):  # steps of one size for ever, as rounding leaves them
        return np.array([1e-10 * (-1.0) ** next(calls)]), np.eye(1)

    assert newton(rounded, [0.0], stalled=1e-8).converged
    assert newton(rounded, [0.0]).status == "unfinished"
