"""Exact derivatives by the complex step and by dual numbers, and formulas that have them.

The module offers `sin`, `cos`, `exp` and `sqrt` of dual numbers, so that it can be the `ops` of the
model's functions. Values of dual numbers may be complex (with the complex step they give mixed
second derivatives), or dual numbers again.

A formula of named parameters is parsed by Python's grammar and walked node by node; only the nodes
listed here are known, nothing is ever evaluated as code. Walked with numbers it gives the value,
with dual numbers a derivative, with intervals in these a bound of the second one.
"""

from __future__ import annotations

import ast
import math
import operator
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from squeal.errors import InputError, suggestion

Number = Any
"""A number or array of some arithmetic: doubles, complex or dual numbers, intervals, or others."""
Parameters = Mapping[str, float]
"""Values of parameters by name: of all that formulas name, or of those that are changed."""
STEP = 1e-200  # of the complex step: no difference is taken, so nothing cancels


def complex_step(
    f: Callable[[Number], Number], x: ArrayLike, along: ArrayLike | None = None
) -> np.ndarray:
    """Derivative of f at real x (m, ...), exact to rounding.

    f takes and gives arrays and is analytic. The result (p, m, ...) holds df_i/dx_j; with a
    direction `along` (m, ...) it is the derivative (p, ...) in this direction.
    """
    if along is None:
        return with_derivative(f, x)[1]
    return f(np.asarray(x, dtype=complex) + 1j * STEP * np.asarray(along)).imag / STEP


def with_derivative(f: Callable[[Number], Number], x: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """f (p, ...) at real x (m, ...) and its derivative (p, m, ...).

    Both come from one evaluation of f at complex x (see `complex_step`).
    """
    point = np.asarray(x, dtype=complex)[:, None]
    # along the second axis the j-th shift is that of x_j
    shifts = np.eye(len(point)).reshape((len(point), -1) + (1,) * (point.ndim - 2))
    values = np.asarray(f(point + 1j * STEP * shifts))
    return values.real[:, 0], values.imag / STEP


class _Arithmetic:
    """Difference and quotient, from the sum, product, negative and power of a subclass.

    numpy leaves operations of arrays with such numbers to them.
    """

    __slots__ = ()
    __array_ufunc__: ClassVar = None

    def __sub__(self: Number, other: Number) -> Number:
        return self + (-other)

    def __rsub__(self: Number, other: Number) -> Number:
        return -self + other

    def __truediv__(self: Number, other: Number) -> Number:
        return self * other**-1.0

    def __rtruediv__(self: Number, other: Number) -> Number:
        return self**-1.0 * other


@dataclass(eq=False, slots=True)  # many are made: frozen ones would take three times as long
class Dual(_Arithmetic):
    """A number (or array) and its derivative by one parameter."""

    value: Number
    slope: Number

    def __add__(self, other: Number) -> Dual:
        if not isinstance(other, Dual):
            return Dual(self.value + other, self.slope)
        return Dual(self.value + other.value, self.slope + other.slope)

    def __neg__(self) -> Dual:
        return Dual(-self.value, -self.slope)

    def __mul__(self, other: Number) -> Dual:
        if not isinstance(other, Dual):
            return Dual(self.value * other, self.slope * other)
        return Dual(self.value * other.value, self.slope * other.value + self.value * other.slope)

    def __pow__(self, power: float) -> Dual:
        return Dual(self.value**power, power * self.value ** (power - 1) * self.slope)

    __radd__ = __add__
    __rmul__ = __mul__


def dual(x: Number) -> Dual:
    """x as a dual number: itself if it is one, else a constant of derivative 0."""
    return x if isinstance(x, Dual) else Dual(x, 0.0)


def _function(
    f: Callable[[Number], Number], slope: Callable[[Number], Number]
) -> Callable[[Number], Dual]:
    """A function f of dual numbers by the chain rule, from f and its derivative `slope`."""

    def of_dual(x: Number) -> Dual:
        argument = dual(x)
        return Dual(f(argument.value), slope(argument.value) * argument.slope)

    return of_dual


sin = _function(np.sin, np.cos)
cos = _function(np.cos, lambda x: -np.sin(x))
exp = _function(np.exp, np.exp)
sqrt = _function(np.sqrt, lambda x: 0.5 / np.sqrt(x))

_NAME = r"[^\W\d]\w*(?!\w)"
_DECIMAL = r"([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?(?![\w.])"
# Python also reads 0x10, 1_0 and comments, which are no formula
_FORMULA = re.compile(rf"(\s|[-+*/()]|{_NAME}|{_DECIMAL})*")
ALLOWED = "a formula of parameters and numbers with + - * / ** (by a number) and parentheses"


@dataclass(frozen=True)
class Formula:
    """A formula; `names` are the parameters that it depends on.

    `place` (a file and the key in it) stands at the head of later errors. Raises InputError for a
    text that is no formula.
    """

    text: str
    place: str = field(default="", repr=False, compare=False)
    names: frozenset[str] = field(init=False, repr=False)
    _tree: ast.expr = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        try:
            if len(self.text) > 500 or not _FORMULA.fullmatch(self.text):
                raise ValueError
            tree = ast.parse(self.text.strip(), mode="eval").body
            names = _parameter_names(tree)
        except (SyntaxError, ValueError, MemoryError, RecursionError):
            allowed = f"{ALLOWED}, of at most 500 characters"
            raise InputError(f"{self.text:.60}: is not allowed; it must be {allowed}") from None
        object.__setattr__(self, "_tree", tree)
        object.__setattr__(self, "names", frozenset(names))

    def value(self, parameters: Parameters) -> float:
        """The formula's value. Raises InputError where it is not a finite number."""
        return self._value_or_slope(parameters, "", required="finite number")

    def in_arithmetic(
        self, parameters: Mapping[str, Number], number: Callable[[Number], Number]
    ) -> Number:
        """The value in another arithmetic, in which `number` makes a constant of a double."""
        numbers = {name: number(parameters[name]) for name in self.names}
        return _evaluated(self._tree, numbers, number)

    def slope(self, parameters: Parameters, name: str) -> float:
        """The derivative by one parameter; 0 if the formula does not depend on it.

        Raises InputError where the value or the derivative is not a finite number.
        """
        self.value(parameters)
        required = "function with a finite derivative"
        return self._value_or_slope(parameters, name, required)

    def curvature(self, parameters: Parameters, name: str, low: float, high: float) -> float:
        """A bound of |second derivative| by one parameter for values of it from low to high.

        By interval arithmetic; inf if no bound is known.
        """
        # a dual number of dual numbers, (x + e1) + e2 with e1^2 = e2^2 = 0: the result is
        # f + f' e1 + f' e2 + f'' e1 e2, so that f'' is the slope of its slope
        x = Dual(Dual(_Interval(low, high), 1.0), Dual(1.0, 0.0))
        try:
            result = dual(_evaluated(self._tree, {**parameters, name: x}))
            second_derivative = dual(result.slope).slope
        except (ZeroDivisionError, OverflowError, ValueError):
            return math.inf
        bound = max(map(abs, _ends_of(second_derivative)))
        return bound if math.isfinite(bound) else math.inf

    def _value_or_slope(self, parameters: Parameters, by: str, required: str) -> float:
        """The value, or its derivative by the parameter `by` if that is not empty.

        Raises InputError for unknown parameters, and for a result that is not finite. Its message
        says that the formula is not a `required`, such as "finite number".
        """
        about = f"{self.place}: {self.text}" if self.place else self.text
        for name in sorted(self.names - parameters.keys()):
            raise InputError(
                f"{about}: {name} is no parameter; {suggestion(name, sorted(parameters))}"
            )
        numbers: dict[str, Number] = {name: float(parameters[name]) for name in self.names}
        if by in numbers:
            numbers[by] = Dual(numbers[by], 1.0)
        try:
            dual_result = dual(_evaluated(self._tree, numbers))
            result = dual_result.slope if by else dual_result.value
        except (ZeroDivisionError, OverflowError):
            result = math.nan
        # complex: a power of a negative number that is not whole
        if isinstance(result, complex) or not math.isfinite(result):
            where = ", ".join(f"{name} = {parameters[name]:g}" for name in sorted(self.names))
            raise InputError(f"{about}: is not a {required} at {where or 'any value'}")
        return float(result)


def _power(base: Number, exponent: float) -> Number:
    """base^exponent; exponents 0 and 1 apart, whose derivatives would divide by a base of zero."""
    if exponent == 0.0:
        return 1.0
    if exponent == 1.0:
        return base
    return base**exponent


_OPERATIONS: dict[type, Callable[[Number, Number], Number]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: _power,
}


def _parameter_names(node: ast.expr) -> set[str]:
    """The parameters in the tree of a formula. Raises ValueError for what is not allowed in it."""
    match node:
        case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
            return set()
        case ast.Name(id=name):
            return {name}
        case ast.UnaryOp(op=ast.UAdd() | ast.USub(), operand=operand):
            return _parameter_names(operand)
        case ast.BinOp(op=op, left=left, right=right) if type(op) in _OPERATIONS:
            if not isinstance(op, ast.Pow):
                return _parameter_names(left) | _parameter_names(right)
            if not _parameter_names(right):  # an exponent may not depend on parameters
                return _parameter_names(left)
    raise ValueError


def _evaluated(
    node: ast.expr, numbers: Mapping[str, Number], constant: Callable[[Number], Number] = float
) -> Number:
    """The value of a tree that `_parameter_names` has checked.

    numbers: the value of each parameter in some arithmetic, such as that of dual numbers; constant:
    makes a number of that arithmetic from a double.
    """
    match node:
        case ast.Constant(value=number):
            return constant(float(number))  # type: ignore[arg-type]
        case ast.Name(id=name):
            return numbers[name]
        case ast.UnaryOp(op=op, operand=operand):
            value = _evaluated(operand, numbers, constant)
            return -value if isinstance(op, ast.USub) else value
    assert isinstance(node, ast.BinOp)
    left = _evaluated(node.left, numbers, constant)
    right = _evaluated(node.right, numbers, constant)
    return _OPERATIONS[type(node.op)](left, right)


@dataclass(frozen=True)
class _Interval(_Arithmetic):
    """All numbers from low to high, with the operations that dual numbers need."""

    low: float
    high: float

    def __neg__(self) -> _Interval:
        return _Interval(-self.high, -self.low)

    def __add__(self, other: Number) -> _Interval:
        low, high = _ends_of(other)
        return _Interval(self.low + low, self.high + high)

    def __mul__(self, other: Number) -> _Interval:
        ends = [x * y for x in _ends_of(self) for y in _ends_of(other)]
        return _Interval(min(ends), max(ends))

    def __pow__(self, power: float) -> _Interval:
        """All powers of the numbers. Raises ValueError where they are not real and bounded."""
        divides_by_zero = self.low <= 0.0 <= self.high and power < 0
        if divides_by_zero or (self.low < 0.0 and power != int(power)):
            raise ValueError
        low, high = sorted((self.low**power, self.high**power))
        if self.low < 0.0 < self.high and power != 0 and power % 2 == 0:
            low = 0.0  # an even power is least inside
        return _Interval(low, high)

    __radd__ = __add__
    __rmul__ = __mul__


def _ends_of(x: Number) -> tuple[float, float]:
    """The ends of an interval, or a number twice."""
    return (x.low, x.high) if isinstance(x, _Interval) else (x, x)


ONE = Formula("1")
