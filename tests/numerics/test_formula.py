"""Formulas of parameters: values, exact derivatives, and nothing but arithmetic."""

import math

import pytest

from squeal.errors import InputError
from squeal.numerics.formula import Formula

AT = {"Omega": 4 * math.pi, "mu": 0.3, "a_1": -2.0}


@pytest.mark.parametrize(
    ("text", "value", "slope"),
    [
        ("1/Omega - 1", 1 / (4 * math.pi) - 1, -1 / (4 * math.pi) ** 2),
        ("Omega**2 - 1", (4 * math.pi) ** 2 - 1, 8 * math.pi),
        ("-Omega * (mu + 2) / 3", -4 * math.pi * 2.3 / 3, -2.3 / 3),
        ("(Omega - Omega)**1", 0.0, 0.0),
        ("Omega**0", 1.0, 0.0),
        ("Omega**-0.5", (4 * math.pi) ** -0.5, -0.5 * (4 * math.pi) ** -1.5),
        ("1e-3", 1e-3, 0.0),
        ("mu ** 2 ** 3", 0.3**8, 0.0),
    ],
)
def test_value_and_slope(text, value, slope):
    formula = Formula(text)
    assert formula.value(AT) == pytest.approx(value, rel=1e-15, abs=1e-15)
    assert formula.slope(AT, "Omega") == pytest.approx(slope, rel=1e-14, abs=1e-15)


def test_names():
    assert Formula("1/Omega - mu").names == {"Omega", "mu"}
    assert Formula("2*(3)").names == frozenset()


@pytest.mark.parametrize(
    "text",
    ["__import__('os')", "mu.real", "mu[0]", "mu if mu else 1", "mu > 1", "f(mu)", "True", "1j"]
    + ["'a'", "mu +", "", "mu**mu", "mu // 2", "mu % 2", "lambda: 1", "(mu, 1)", "mu; mu", "mu=1"],
)
def test_anything_else_is_refused(text):
    with pytest.raises(InputError, match="it must be a formula"):
        Formula(text)


def test_places_without_a_value_are_refused():
    with pytest.raises(InputError, match="not a finite number at mu = 0"):
        Formula("1/mu").value({"mu": 0.0})
    with pytest.raises(InputError, match="not a finite number"):
        Formula("a_1**0.5").value(AT)
    with pytest.raises(InputError, match="not a finite number"):
        Formula("10.0**400").value(AT)
    with pytest.raises(InputError, match="nu is no parameter; allowed are Omega, a_1, mu"):
        Formula("nu").value(AT)
    with pytest.raises(InputError, match="at most 500"):
        Formula("+".join(["1"] * 300))
    with pytest.raises(InputError):
        Formula("9**" * 100 + "9").value(AT)


def test_a_slope_without_bound_is_refused_only_where_it_is_asked_for():
    root = Formula("mu**0.5", "s.yaml: K.factor")
    assert root.value({"mu": 0.0}) == 0.0
    assert root.slope({"mu": 0.25}, "mu") == 1.0
    with pytest.raises(InputError, match=r"s\.yaml: K\.factor: mu.* finite derivative at mu = 0"):
        root.slope({"mu": 0.0}, "mu")
    with pytest.raises(InputError, match=r"s\.yaml: K\.factor: mu.* finite number at mu = -1"):
        root.value({"mu": -1.0})
