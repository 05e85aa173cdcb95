"""Complex factors of terms: loss factors, and moduli that depend on the frequency.

A frequency-dependent factor takes the frequency as a parameter: `omega` (rad/s) or `frequency`
(Hz). Where the file gives it no value, it is that of each root, |Im lambda| (`TermSystem.follows`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from squeal.errors import InputError
from squeal.numerics.differentiation import ONE, Dual, Formula

FREQUENCY = {"omega": 1.0, "frequency": 1.0 / math.tau}
"""Names of the frequency, and what omega in rad/s is multiplied with for each."""


@dataclass(frozen=True)
class Table:
    """Storage and loss factor at rising frequencies (Hz), interpolated in between.

    The interpolation is monotone where the numbers are (PCHIP) and has a derivative everywhere.
    Raises InputError beyond the ends: `source` names the file there.

    >>> lining = Table("lining.csv", (500.0, 1000.0, 4000.0), (0.9, 1.0, 1.2), (0.1, 0.1, 0.08))
    >>> lining(1000.0)[1].value
    0.1
    """

    source: str
    frequencies: Sequence[float]
    storage: Sequence[float]
    loss: Sequence[float]

    @cached_property
    def _curves(self) -> Any:
        from scipy.interpolate import PchipInterpolator

        rows = zip(self.storage, self.loss, strict=True)
        return PchipInterpolator(self.frequencies, list(rows))

    def __call__(self, frequency: float) -> tuple[Dual, Dual]:
        """Storage and loss factor with their derivatives by the frequency."""
        low, high = self.frequencies[0], self.frequencies[-1]
        if not low <= frequency <= high:
            words = f"covers {low:g} to {high:g} Hz; {frequency:.6g} Hz is needed"
            raise InputError(f"{self.source}: {words}")
        pairs = zip(self._curves(frequency).tolist(), self._curves(frequency, 1), strict=True)
        storage, loss = (Dual(value, float(slope)) for value, slope in pairs)
        return storage, loss


@dataclass(frozen=True)
class Modulus:
    """A factor times (1 + i loss), times the storage of a table; or, `imaginary`, times i.

    It has the methods of a `Formula`, with complex values. Raises InputError where a loss factor is
    negative.

    >>> lining = Modulus(Formula("2 * a"), Formula("omega / 1e4"))
    >>> lining.value({"a": 3.0, "omega": 1e3}), lining.slope({"a": 3.0, "omega": 1e3}, "a")
    ((6+0.6000000000000001j), (2+0.2j))
    """

    factor: Formula = ONE
    loss: Formula | None = None
    table: Table | None = None
    imaginary: bool = False
    names: frozenset[str] = field(init=False)

    def __post_init__(self) -> None:
        names = self.factor.names | (self.loss.names if self.loss else frozenset())
        own = {"frequency"} if self.table else frozenset[str]()
        object.__setattr__(self, "names", names | own)

    @property
    def text(self) -> str:
        """The factor for people."""
        parts = [f"({self.factor.text})"]
        if self.table:
            parts.append(f"{self.table.source}")
        if self.loss:
            parts.append(f"(1 + i ({self.loss.text}))")
        return " * ".join(["i"] * self.imaginary + parts)

    def value(self, parameters: Mapping[str, float]) -> complex:
        """The complex value. Raises InputError."""
        return complex(self._dual(parameters, "").value)

    def slope(self, parameters: Mapping[str, float], name: str) -> complex:
        """The derivative by one parameter. Raises InputError."""
        return complex(self._dual(parameters, name).slope)

    def curvature(
        self, parameters: Mapping[str, float], name: str, low: float, high: float
    ) -> float:
        """No bound of the second derivative is known."""
        return math.inf

    def _dual(self, parameters: Mapping[str, float], name: str) -> Dual:
        def of(formula: Formula) -> Dual:
            slope = formula.slope(parameters, name) if name in formula.names else 0.0
            return Dual(formula.value(parameters), slope)

        result = of(self.factor) * (1j if self.imaginary else 1.0)
        loss = of(self.loss) if self.loss else Dual(0.0, 0.0)
        if loss.value < 0.0:
            place = f"{self.loss.place}: " if self.loss and self.loss.place else ""
            at = ", ".join(f"{n} = {parameters[n]:g}" for n in sorted(self.loss.names))  # type: ignore[union-attr]
            raise InputError(f"{place}{loss.value:g} at {at} is not allowed; it must be at least 0")
        if self.table:
            storage, loss = self.table(parameters["frequency"])
            if name != "frequency":
                storage, loss = Dual(storage.value, 0.0), Dual(loss.value, 0.0)
            result = result * storage
        return result * (loss * 1j + 1.0)
