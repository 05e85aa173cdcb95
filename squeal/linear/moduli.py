"""Complex factors of terms: loss factors, and moduli that depend on the frequency.

A frequency-dependent factor takes the frequency as a parameter: `omega` (rad/s) or `frequency`
(Hz). Where the file gives it no value, it is that of each root, |Im lambda| (`System.follows`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from squeal.errors import InputError
from squeal.numerics.differentiation import ONE, Dual, Formula, Parameters

if TYPE_CHECKING:
    from scipy.interpolate import PchipInterpolator

FREQUENCY = {"omega": 1.0, "frequency": 1.0 / math.tau}
"""Names of the frequency, and what omega in rad/s is multiplied with for each."""


def _keep_numbers(table: object, names: str) -> None:
    """Make tuples of doubles of the columns of a table, which may be arrays or lists."""
    for name in names.split():
        object.__setattr__(table, name, tuple(map(float, getattr(table, name))))


@dataclass(frozen=True)
class Table:
    """Storage and loss factor at rising frequencies (Hz), interpolated in between.

    The interpolation is monotone where the numbers are (PCHIP) and has a derivative everywhere.
    Raises InputError beyond the ends: `source` names the file there.

    >>> lining = Table("lining.csv", (500.0, 1000.0, 4000.0), (0.9, 1.0, 1.2), (0.1, 0.1, 0.08))
    >>> lining(1000.0)[1].value
    0.1
    """

    source: str = field(repr=False)
    frequencies: Sequence[float]
    storage: Sequence[float]
    loss: Sequence[float]

    def __post_init__(self) -> None:
        _keep_numbers(self, "frequencies storage loss")

    @cached_property
    def _curves(self) -> PchipInterpolator:
        from scipy.interpolate import PchipInterpolator

        return PchipInterpolator(self.frequencies, np.column_stack([self.storage, self.loss]))

    def __call__(self, frequency: float) -> tuple[Dual, Dual]:
        """Storage and loss factor with their derivatives by the frequency."""
        low = self.frequencies[0]
        high = self.frequencies[-1]
        if not low <= frequency <= high:
            raise InputError(
                f"{self.source}: covers {low:g} to {high:g} Hz; {frequency:.6g} Hz is needed"
            )
        storage, loss = self._curves(frequency).tolist()
        storage_slope, loss_slope = self._curves(frequency, 1).tolist()
        return Dual(storage, storage_slope), Dual(loss, loss_slope)


@dataclass(frozen=True)
class Tabulated:
    """A real factor times a quantity that is tabulated over one parameter.

    Such is the stiffness of a bearing over speed. It has the methods of a `Formula`. The
    interpolation is monotone where the numbers are (PCHIP) and has a derivative everywhere. Raises
    InputError beyond the ends: `source` names the file there.

    Parameters
    ----------
    factor : Formula
        What the tabulated quantity is multiplied with.
    parameter : str
        The name of the parameter.
    source, column : str
        The file, and the name of the quantity in it.
    points, quantities : sequence of float (m,)
        Rising values of the parameter, and the quantity at each.

    >>> bearing = Tabulated(ONE, "speed", "bearing.csv", "kxy", (0.0, 1.0, 3.0), (0.0, 2.0, 4.0))
    >>> bearing.value({"speed": 1.0}), bearing.slope({"speed": 3.0}, "speed") > 0.0
    (2.0, True)
    """

    factor: Formula
    parameter: str
    source: str = field(repr=False)
    column: str
    points: Sequence[float]
    quantities: Sequence[float]

    def __post_init__(self) -> None:
        _keep_numbers(self, "points quantities")

    @cached_property
    def _curve(self) -> PchipInterpolator:
        from scipy.interpolate import PchipInterpolator

        return PchipInterpolator(self.points, self.quantities)

    @property
    def names(self) -> frozenset[str]:
        """The parameters that it depends on."""
        return self.factor.names | {self.parameter}

    @property
    def text(self) -> str:
        """The factor for people."""
        return f"({self.factor.text}) * {self.source}: {self.column}({self.parameter})"

    def value(self, parameters: Parameters) -> float:
        """The value. Raises InputError beyond the table."""
        point = self._point_in_table(parameters)
        return self.factor.value(parameters) * float(self._curve(point))

    def slope(self, parameters: Parameters, name: str) -> float:
        """The derivative by one parameter. Raises InputError beyond the table."""
        point = self._point_in_table(parameters)
        total = self.factor.slope(parameters, name) * float(self._curve(point))
        if name == self.parameter:
            total += self.factor.value(parameters) * float(self._curve(point, 1))
        return total

    def curvature(self, parameters: Parameters, name: str, low: float, high: float) -> float:
        """A bound of |second derivative| by the parameter `name` between `low` and `high`.

        By the table's parameter each piece between two points of the table is a cubic: its second
        derivative is linear, so that it is greatest at an end. inf where the factor, too, depends
        on that parameter.
        """
        if name != self.parameter:
            size = abs(float(self._curve(self._point_in_table(parameters))))
            return size * self.factor.curvature(parameters, name, low, high)
        if name in self.factor.names:
            return math.inf
        begins = np.asarray(self.points[:-1])
        ends = np.asarray(self.points[1:])
        cubic, square = self._curve.c[:2]  # coefficients (m - 1,) of x^3 and x^2 of each piece
        at_begin = np.abs(2.0 * square)
        at_end = np.abs(6.0 * cubic * (ends - begins) + 2.0 * square)
        largest = np.maximum(at_begin, at_end)[(begins <= high) & (ends >= low)]
        return abs(self.factor.value(parameters)) * float(np.max(largest, initial=0.0))

    def _point_in_table(self, parameters: Parameters) -> float:
        """The value of the table's parameter. Raises InputError beyond the table."""
        point = parameters[self.parameter]
        low = self.points[0]
        high = self.points[-1]
        if not low <= point <= high:
            covered = f"{self.parameter} from {low:g} to {high:g}"
            raise InputError(f"{self.source}: covers {covered}; {point:.6g} is needed")
        return point


@dataclass(frozen=True)
class Modulus:
    """A factor times (1 + i loss), times the storage modulus of a table; or, `imaginary`, times i.

    A table brings a loss factor of its own: `loss` is None beside it. It has the methods of a
    `Formula`, with complex values. Raises InputError where a loss factor is negative.

    >>> lining = Modulus(Formula("2 * a"), Formula("omega / 1e4"))
    >>> lining.value({"a": 3.0, "omega": 1e3}), lining.slope({"a": 3.0, "omega": 1e3}, "a")
    ((6+0.6000000000000001j), (2+0.2j))
    """

    factor: Formula = ONE
    loss: Formula | None = None
    table: Table | None = None
    imaginary: bool = False
    names: frozenset[str] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        names = set(self.factor.names)
        if self.loss:
            names |= self.loss.names
        if self.table:
            names.add("frequency")
        object.__setattr__(self, "names", frozenset(names))

    @property
    def text(self) -> str:
        """The factor for people."""
        parts = [f"({self.factor.text})"]
        if self.table:
            parts.append(f"{self.table.source}")
        if self.loss:
            parts.append(f"(1 + i ({self.loss.text}))")
        return " * ".join(["i"] * self.imaginary + parts)

    def value(self, parameters: Parameters) -> complex:
        """The complex value. Raises InputError."""
        return complex(self._dual(parameters, "").value)

    def slope(self, parameters: Parameters, name: str) -> complex:
        """The derivative by one parameter. Raises InputError."""
        return complex(self._dual(parameters, name).slope)

    def curvature(self, parameters: Parameters, name: str, low: float, high: float) -> float:
        """A bound of |second derivative| by the parameter `name` between `low` and `high`.

        inf (no bound known) by the frequency, and where both factor and loss depend on the
        parameter.
        """
        if name in FREQUENCY:
            return math.inf
        if self.loss is not None and name in self.loss.names:  # without a table: see the class
            if name in self.factor.names:
                return math.inf
            loss_curvature = self.loss.curvature(parameters, name, low, high)
            return abs(self.factor.value(parameters)) * loss_curvature
        storage = 1.0
        loss = 0.0
        if self.table:
            storage, loss = (dual.value for dual in self.table(parameters["frequency"]))
        elif self.loss:
            loss = self.loss.value(parameters)
        return abs(storage * (1 + 1j * loss)) * self.factor.curvature(parameters, name, low, high)

    def _dual(self, parameters: Parameters, name: str) -> Dual:
        """The complex value, and its derivative by a parameter; `name` "" gives a derivative of 0.

        A table depends on the frequency. This counts as its derivative by the parameter `frequency`
        alone, that by `omega` being 0: the total derivative (`at_own_frequency`) adds both.

        Raises InputError for a negative loss factor, and beyond the ends of a table.
        """
        # `imaginary`: times i, as the matrices of structural damping are
        result = _with_slope(self.factor, parameters, name) * (1j if self.imaginary else 1.0)
        loss = Dual(0.0, 0.0)
        if self.loss:  # never beside a table, which brings its own
            loss = _with_slope(self.loss, parameters, name)
            if loss.value < 0.0:
                raise _negative(self.loss, loss.value, parameters)
        if self.table:
            # storage modulus and loss factor, with their slopes by the frequency
            storage, loss = self.table(parameters["frequency"])
            if name != "frequency":
                storage = Dual(storage.value, 0.0)
                loss = Dual(loss.value, 0.0)
            result *= storage
        return result * (loss * 1j + 1.0)


def _with_slope(formula: Formula, parameters: Parameters, name: str) -> Dual:
    """The value of a formula and its derivative by one parameter."""
    slope = formula.slope(parameters, name) if name in formula.names else 0.0
    return Dual(formula.value(parameters), slope)


def _negative(loss: Formula, value: float, parameters: Parameters) -> InputError:
    """The error of a negative loss factor."""
    source = f"{loss.place}: " if loss.place else ""
    at = ", ".join(f"{name} = {parameters[name]:g}" for name in sorted(loss.names))
    return InputError(f"{source}{value:g} at {at} is not allowed; it must be at least 0")
