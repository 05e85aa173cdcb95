"""Formulas of named parameters: + - * / ** and parentheses, with exact derivatives.

A formula is parsed by Python's own grammar and then walked node by node; only the nodes listed
here are known, nothing is ever evaluated as code.
"""

import ast
import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from squeal.errors import InputError

LENGTH = 500  # characters of a formula
ALLOWED = "a formula of parameters and numbers with + - * / ** (by a number) and parentheses"

Value = tuple[float, dict[str, float]]
"""A number and its derivatives by the parameters that it depends on."""


@dataclass(frozen=True)
class Formula:
    """A formula; `names` are the parameters that it depends on. Raises InputError when made.

    `place` (a file and the key in it) stands before what it refuses later.
    """

    text: str
    place: str = field(default="", repr=False, compare=False)
    names: frozenset[str] = field(init=False)
    _tree: ast.expr = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        tree = _parsed(self.text)
        object.__setattr__(self, "_tree", tree)
        object.__setattr__(self, "names", frozenset(_names(tree, self.text)))

    def value(self, parameters: Mapping[str, float]) -> float:
        """The formula's value. Raises InputError where it is not a finite number."""
        return self._checked(parameters, False)[0]

    def slope(self, parameters: Mapping[str, float], name: str) -> float:
        """The derivative by one parameter; 0 if the formula does not depend on it."""
        return self.value_and_slopes(parameters)[1].get(name, 0.0)

    def value_and_slopes(self, parameters: Mapping[str, float]) -> Value:
        """The value and the derivatives by all names. Raises InputError if one is not finite."""
        return self._checked(parameters, True)

    def _checked(self, parameters: Mapping[str, float], smooth: bool) -> Value:
        about = f"{self.place}: {self.text}" if self.place else self.text
        unknown = sorted(self.names - parameters.keys())
        if unknown:
            raise InputError(f"{about}: {unknown[0]} is no parameter; {_listed(parameters)}")
        try:
            value, slopes = _evaluated(self._tree, parameters)
        except (ZeroDivisionError, OverflowError):
            value, slopes = math.nan, {}
        lacks = "" if math.isfinite(value) else "finite number"
        if smooth and not lacks and not all(map(math.isfinite, slopes.values())):
            lacks = "function with a finite derivative"
        if lacks:
            where = ", ".join(f"{name} = {parameters[name]:g}" for name in sorted(self.names))
            raise InputError(f"{about}: is not a {lacks} at {where or 'any value'}")
        return value, slopes


def _listed(parameters: Mapping[str, float]) -> str:
    return f"allowed are {', '.join(sorted(parameters))}" if parameters else "there are none"


def _refuse(text: str) -> InputError:
    return InputError(f"{text}: is not allowed; it must be {ALLOWED}")


def _parsed(text: str) -> ast.expr:
    if len(text) > LENGTH:
        raise InputError(
            f"a formula of {len(text)} characters is not allowed; at most {LENGTH} are"
        )
    try:
        return ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, MemoryError, RecursionError):
        raise _refuse(text) from None


def _names(node: ast.expr, text: str) -> set[str]:
    match node:
        case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
            return set()
        case ast.Name(id=name):
            return {name}
        case ast.UnaryOp(op=ast.UAdd() | ast.USub(), operand=operand):
            return _names(operand, text)
        case ast.BinOp(op=ast.Pow(), left=left, right=right):
            if _names(right, text):
                raise _refuse(text)
            return _names(left, text)
        case ast.BinOp(op=ast.Add() | ast.Sub() | ast.Mult() | ast.Div(), left=left, right=right):
            return _names(left, text) | _names(right, text)
    raise _refuse(text)


def _evaluated(node: ast.expr, at: Mapping[str, float]) -> Value:
    """Value and derivatives of a checked tree (forward mode)."""
    match node:
        case ast.Constant(value=number):
            return float(number), {}  # type: ignore[arg-type]
        case ast.Name(id=name):
            return float(at[name]), {name: 1.0}
        case ast.UnaryOp(op=op, operand=operand):
            sign = -1.0 if isinstance(op, ast.USub) else 1.0
            value, slopes = _evaluated(operand, at)
            return sign * value, {name: sign * s for name, s in slopes.items()}
    assert isinstance(node, ast.BinOp)
    (a, da), (b, db) = _evaluated(node.left, at), _evaluated(node.right, at)
    match node.op:
        case ast.Add():
            return a + b, _combined(1.0, da, 1.0, db)
        case ast.Sub():
            return a - b, _combined(1.0, da, -1.0, db)
        case ast.Mult():
            return a * b, _combined(b, da, a, db)
        case ast.Div():
            return a / b, _combined(1 / b, da, -a / b / b, db)
    result = a**b
    if isinstance(result, complex):  # a root of a negative number
        raise OverflowError
    return result, _combined(_power_slope(a, b) if da else 0.0, da, 0.0, db)


def _power_slope(a: float, b: float) -> float:
    """The derivative of a**b by a, infinite where that is without bound."""
    try:
        return b * a ** (b - 1) if b else 0.0
    except (ZeroDivisionError, OverflowError):
        return math.inf


def _combined(
    f: float, da: Mapping[str, float], g: float, db: Mapping[str, float]
) -> dict[str, float]:
    return {name: f * da.get(name, 0.0) + g * db.get(name, 0.0) for name in sorted({*da, *db})}


ONE = Formula("1")
