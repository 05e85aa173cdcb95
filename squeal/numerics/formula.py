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

    def curvature(
        self, parameters: Mapping[str, float], name: str, low: float, high: float
    ) -> float:
        """A bound of |second derivative| by one parameter over low to high; inf if none is known.

        By interval arithmetic on the value and both derivatives at once.
        """
        point = ((0.0, 0.0), (0.0, 0.0))
        at: dict[str, _Jet] = {key: ((v, v), *point) for key, v in parameters.items()}
        at[name] = ((low, high), (1.0, 1.0), (0.0, 0.0))
        try:
            ends = _enclosed(self._tree, at)[2]
        except (ZeroDivisionError, OverflowError, ValueError):
            return math.inf
        most = max(map(abs, ends))
        return most if math.isfinite(most) else math.inf

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


_Interval = tuple[float, float]
_Jet = tuple[_Interval, _Interval, _Interval]
"""Intervals of a value and its first and second derivatives."""


def _add(*terms: _Interval) -> _Interval:
    return sum(t[0] for t in terms), sum(t[1] for t in terms)


def _times(a: _Interval, b: _Interval) -> _Interval:
    ends = [x * y for x in a for y in b]
    return min(ends), max(ends)


def _scaled(x: float, a: _Interval) -> _Interval:
    return _times((x, x), a)


def _raised(a: _Interval, b: float) -> _Interval:
    """a**b; raises ValueError where that is not real and bounded."""
    if (a[0] <= 0.0 <= a[1] and b < 0) or (a[0] < 0.0 and b != int(b)):
        raise ValueError
    ends = [a[0] ** b, a[1] ** b]
    return (0.0 if a[0] < 0.0 < a[1] and b and b % 2 == 0 else min(ends)), max(ends)


def _enclosed(node: ast.expr, at: Mapping[str, _Jet]) -> _Jet:
    match node:
        case ast.Constant(value=number):
            value = float(number)  # type: ignore[arg-type]
            return (value, value), (0.0, 0.0), (0.0, 0.0)
        case ast.Name(id=name):
            return at[name]
        case ast.UnaryOp(op=op, operand=operand):
            sign = -1.0 if isinstance(op, ast.USub) else 1.0
            f, df, ddf = (_scaled(sign, x) for x in _enclosed(operand, at))
            return f, df, ddf
    assert isinstance(node, ast.BinOp)
    (a, da, dda), (b, db, ddb) = _enclosed(node.left, at), _enclosed(node.right, at)
    match node.op:
        case ast.Add():
            return _add(a, b), _add(da, db), _add(dda, ddb)
        case ast.Sub():
            b, db, ddb = (_scaled(-1.0, x) for x in (b, db, ddb))
            return _add(a, b), _add(da, db), _add(dda, ddb)
        case ast.Div():
            b, db, ddb = _composed(b, db, ddb, -1.0)
        case ast.Pow():
            return _composed(a, da, dda, b[0])
    product = _add(_times(dda, b), _scaled(2.0, _times(da, db)), _times(a, ddb))
    return _times(a, b), _add(_times(da, b), _times(a, db)), product


def _composed(a: _Interval, da: _Interval, dda: _Interval, power: float) -> _Jet:
    """a**power with its derivatives."""
    if power == 0.0:
        return (1.0, 1.0), (0.0, 0.0), (0.0, 0.0)
    if power == 1.0:
        return a, da, dda
    slope = _scaled(power, _raised(a, power - 1))
    bend = _scaled(power * (power - 1), _raised(a, power - 2)) if power != 2.0 else (2.0, 2.0)
    second = _add(_times(bend, _raised(da, 2.0)), _times(slope, dda))
    return _raised(a, power), _times(slope, da), second


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
