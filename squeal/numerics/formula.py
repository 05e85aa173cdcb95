"""Formulas of named parameters: + - * / ** and parentheses, with exact derivatives.

A formula is parsed by Python's own grammar and then walked node by node; only the nodes listed
here are known, nothing is ever evaluated as code. Walked with numbers it gives the value, with dual
numbers a derivative, with intervals in them a bound of the second derivative.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from squeal.errors import InputError
from squeal.numerics.differentiation import Dual, dual

ALLOWED = "a formula of parameters and numbers with + - * / ** (by a number) and parentheses"


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
        for name in sorted(self.names - parameters.keys()):
            listed = ", ".join(sorted(parameters))
            allowed = f"allowed are {listed}" if listed else "there are none"
            raise InputError(f"{self._about}: {name} is no parameter; {allowed}")
        return self._finite(parameters, parameters, "finite number")

    def slope(self, parameters: Mapping[str, float], name: str) -> float:
        """The derivative by one parameter; 0 if the formula does not depend on it.

        Raises InputError where the value or the derivative is not a finite number.
        """
        self.value(parameters)
        moved = {**parameters, name: Dual(float(parameters.get(name, 0.0)), 1.0)}
        return self._finite(moved, parameters, "function with a finite derivative")

    def curvature(
        self, parameters: Mapping[str, float], name: str, low: float, high: float
    ) -> float:
        """A bound of |second derivative| by one parameter over low to high; inf if none is known.

        By interval arithmetic on the value and both derivatives at once.
        """
        x = Dual(Dual(_Interval(low, high), 1.0), Dual(1.0, 0.0))
        try:
            second = dual(dual(_walked(self._tree, {**parameters, name: x})).slope).slope
        except (ZeroDivisionError, OverflowError, ValueError):
            return math.inf
        most = max(map(abs, _ends(second)))
        return most if math.isfinite(most) else math.inf

    @property
    def _about(self) -> str:
        return f"{self.place}: {self.text}" if self.place else self.text

    def _finite(self, at: Mapping[str, Any], parameters: Mapping[str, float], what: str) -> float:
        try:
            found = _walked(self._tree, at)
        except (ZeroDivisionError, OverflowError):
            found = Dual(math.nan, math.nan)
        found = dual(found)
        found = found.value if at is parameters else found.slope
        if isinstance(found, complex) or not math.isfinite(found):
            where = ", ".join(f"{name} = {parameters[name]:g}" for name in sorted(self.names))
            raise InputError(f"{self._about}: is not a {what} at {where or 'any value'}")
        return float(found)


def _refuse(text: str) -> InputError:
    return InputError(f"{text}: is not allowed; it must be {ALLOWED}")


def _parsed(text: str) -> ast.expr:
    if len(text) > 500:
        raise InputError(f"a formula of {len(text)} characters is not allowed; at most 500 are")
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


def _walked(node: ast.expr, at: Mapping[str, Any]) -> Any:
    """What a checked tree gives in the arithmetic of the numbers in `at`."""
    match node:
        case ast.Constant(value=number):
            return float(number)  # type: ignore[arg-type]
        case ast.Name(id=name):
            found = at[name]
            return found if isinstance(found, Dual) else float(found)
        case ast.UnaryOp(op=op, operand=operand):
            value = _walked(operand, at)
            return -value if isinstance(op, ast.USub) else value
    assert isinstance(node, ast.BinOp)
    a, b = _walked(node.left, at), _walked(node.right, at)
    match node.op:
        case ast.Add():
            return a + b
        case ast.Sub():
            return a - b
        case ast.Mult():
            return a * b
        case ast.Div():
            return a / b
    return 1.0 if b == 0.0 else a if b == 1.0 else a**b


@dataclass(frozen=True)
class _Interval:
    """All numbers from low to high, with the operations that dual numbers need."""

    low: float
    high: float

    def __neg__(self) -> _Interval:
        return _Interval(-self.high, -self.low)

    def __add__(self, other: Any) -> _Interval:
        low, high = _ends(other)
        return _Interval(self.low + low, self.high + high)

    def __sub__(self, other: Any) -> _Interval:
        return self + (-other)

    def __rsub__(self, other: Any) -> _Interval:
        return -self + other

    def __mul__(self, other: Any) -> _Interval:
        ends = [x * y for x in _ends(self) for y in _ends(other)]
        return _Interval(min(ends), max(ends))

    def __truediv__(self, other: Any) -> _Interval:
        return self * other**-1.0

    def __rtruediv__(self, other: float) -> _Interval:
        return self**-1.0 * other

    def __pow__(self, power: float) -> _Interval:
        """Raises ValueError where that is not real and bounded."""
        if (self.low <= 0.0 <= self.high and power < 0) or (self.low < 0.0 and power != int(power)):
            raise ValueError
        ends = [self.low**power, self.high**power]
        even = self.low < 0.0 < self.high and power and power % 2 == 0
        return _Interval(0.0 if even else min(ends), max(ends))

    __radd__, __rmul__ = __add__, __mul__


def _ends(x: Any) -> tuple[float, float]:
    return (x.low, x.high) if isinstance(x, _Interval) else (x, x)


ONE = Formula("1")
