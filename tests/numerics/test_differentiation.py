"""Derivatives by the complex step, by dual numbers and of formulas against closed forms."""

import math

import numpy as np
import pytest

from squeal.errors import InputError
from squeal.numerics import differentiation
from squeal.numerics.differentiation import Dual, Formula, complex_step


def test_complex_step_is_the_derivative_of_one_and_of_many_points():
    def curve(x):
        return np.array([x[0] ** 2 + x[1] ** 2, np.sin(x[0]) * x[1], 3.0 * x[1]])

    for x in (np.array([0.7, -1.3]), np.random.default_rng(1).normal(size=(2, 5))):
        a, b = x
        zero = 0.0 * a
        slope = np.array([[2 * a, 2 * b], [np.cos(a) * b, np.sin(a)], [zero, 3.0 + zero]])
        assert complex_step(curve, x) == pytest.approx(slope, rel=1e-14)
    along = np.array([2.0, 0.5])
    x = np.array([0.7, -1.3])
    expected = [2.0 * 2 * 0.7 - 1.3, np.nan, 1.5]
    expected[1] = np.cos(0.7) * -1.3 * 2.0 + np.sin(0.7) * 0.5
    assert complex_step(curve, x, along=along) == pytest.approx(np.array(expected), rel=1e-14)


def test_dual_numbers_and_the_complex_step_agree():
    def f(x, ops):
        return ops.exp(2.0 - x) / ops.sqrt(x) - 3.0 * ops.sin(x) ** 3 + (1.0 + ops.cos(x)) / x

    expected = complex_step(lambda x: f(x, np), [0.7])[0, 0]
    assert f(Dual(0.7, 1.0), differentiation).slope == pytest.approx(expected, rel=1e-14)


AT = {"Omega": 4 * math.pi, "mu": 0.3, "a_1": -2.0}


W = AT["Omega"]
VALUES = [
    ("1/Omega - 1", 1 / W - 1, -1 / W**2),
    ("Omega**2 - 1", W**2 - 1, 2 * W),
    ("-Omega * (mu + 2) / 3", -W * 2.3 / 3, -2.3 / 3),
    ("Omega**0", 1.0, 0.0),
    ("Omega**-0.5", W**-0.5, -0.5 * W**-1.5),
    ("1e-3", 1e-3, 0.0),
    ("mu ** 2 ** 3", 0.3**8, 0.0),
]
BOUNDS = [  # least of a bound of the second derivative
    ("3 - 2*x", 0.0, 2.0, 0.0),
    ("(x - 1)**2 / 2", 0.0, 2.0, 1.0),
    ("a_1 / x", 1.0, 2.0, 4.0),
    ("x**3 * mu", -1.0, 2.0, 3.6),
    ("1/(1 + 1e4*(x - 1)**2)", 0.0, 2.0, 2e4),
    ("x**0.5", 0.0, 1.0, math.inf),
    ("1/(x - 1)", 0.0, 2.0, math.inf),
]


@pytest.mark.parametrize(("text", "value", "slope"), VALUES)
def test_a_formula_has_the_value_and_the_slope_of_the_closed_form(text, value, slope):
    formula = Formula(text)
    assert formula.value(AT) == pytest.approx(value, rel=1e-15, abs=1e-15)
    assert formula.slope(AT, "Omega") == pytest.approx(slope, rel=1e-14, abs=1e-15)
    assert formula.names == {name for name in AT if name in text}


@pytest.mark.parametrize(("text", "low", "high", "most"), BOUNDS)
def test_curvature_is_a_bound_of_the_second_derivative(text, low, high, most):
    bound = Formula(text).curvature(AT, "x", low, high)
    assert bound >= most * (1 - 1e-12)
    if math.isfinite(most):
        x = np.linspace(low, high, 5001)
        values = [Formula(text).slope(AT | {"x": v}, "x") for v in x]
        assert np.abs(np.diff(values) / np.diff(x)).max() <= bound + 1e-6


NOT_ALLOWED = ["__import__('os')", "mu.real", "mu[0]", "mu > 1", "True", "1j", "mu +", "", "mu**mu"]
NOT_ALLOWED += ["1_0", "0x10", "mu*0b1", "0o7 + mu", "1 # mu", "1.5.real", "(1 \\\n+ mu)", "lambda"]


@pytest.mark.parametrize("text", [*NOT_ALLOWED, "mu // 2", "+".join(["1"] * 300)])
def test_anything_else_is_refused(text):
    with pytest.raises(InputError):
        Formula(text)


@pytest.mark.parametrize("text", ["1/(mu - 0.3)", "a_1**0.5", "10.0**400", "nu", "9**9**9**9"])
def test_places_without_a_value_are_refused(text):
    with pytest.raises(InputError):
        Formula(text).value(AT)


def test_a_slope_without_bound_is_refused_only_where_it_is_asked_for():
    root = Formula("mu**0.5", "s.yaml: K.factor")
    assert root.value({"mu": 0.0}) == 0.0
    assert root.slope({"mu": 0.25}, "mu") == 1.0
    with pytest.raises(InputError, match=r"s\.yaml: K\.factor: mu.* finite derivative at mu = 0"):
        root.slope({"mu": 0.0}, "mu")
    with pytest.raises(InputError, match=r"s\.yaml: K\.factor: mu.* finite number at mu = -1"):
        root.value({"mu": -1.0})
