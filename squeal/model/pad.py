"""The pad: its parameters, their meaning, units and allowed ranges, in one table.

The table is the single source for scene validation, defaults, scaling to other units and the
parameter table of the report.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field
from typing import Any, Literal

Model = Literal["B1", "B2", "B3"]
MODELS: tuple[Model, ...] = ("B1", "B2", "B3")
CONTACT_MODELS: tuple[Model, ...] = ("B1", "B2")


@dataclass(frozen=True)
class Parameter:
    """What one scene parameter means and may be.

    `dimension` holds the exponents of (mass, length, time). `required` tells whether the models
    that use the parameter need it; what a missing optional one stands for is said in `default`.
    """

    meaning: str
    unit: str
    dimension: tuple[int, int, int]
    models: tuple[Model, ...] = MODELS
    required: bool = True
    angle: bool = False
    low: float = -math.inf
    high: float = math.inf
    low_allowed: bool = True
    default: str = ""

    def admits(self, value: float) -> bool:
        """True if `value` lies in the range of the parameter (bounds at `high` are open)."""
        above = value >= self.low if self.low_allowed else value > self.low
        return above and value < self.high

    def allowed(self) -> str:
        """The allowed range in words, for an error message."""
        if self.low == -math.inf:
            return "a finite number"
        if self.high < math.inf:
            return f"a number between {self.low:.6g} and {self.high:.6g}, both excluded"
        return f"a finite number {'of at least' if self.low_allowed else 'above'} {self.low:g}"


def _positive(meaning: str, unit: str, dim: tuple[int, int, int], **more: Any) -> Any:
    return field(
        default=None,
        metadata={"p": Parameter(meaning, unit, dim, low=0.0, low_allowed=False, **more)},
    )


def _from_zero(meaning: str, unit: str, dim: tuple[int, int, int], **more: Any) -> Any:
    return field(default=None, metadata={"p": Parameter(meaning, unit, dim, low=0.0, **more)})


def _real(meaning: str, unit: str, dim: tuple[int, int, int], **more: Any) -> Any:
    return field(default=0.0, metadata={"p": Parameter(meaning, unit, dim, **more)})


_MASS, _LENGTH, _NONE = (1, 0, 0), (0, 1, 0), (0, 0, 0)
_STIFFNESS, _FORCE = (1, 0, -2), (1, 1, -2)
_TWO = CONTACT_MODELS


@dataclass(frozen=True)
class Pad:
    """Parameters of the rigid pad of Figs. 1 and 2, in SI units unless `scaled`.

    A parameter that the model at hand does not use is None (or 0 for a placement).
    """

    m: float = _positive("mass", "kg", _MASS)
    w: float = _positive("half length", "m", _LENGTH)
    h: float = _positive("half height", "m", _LENGTH)
    I: float = _positive(
        "moment of inertia about the mass centre",
        "kg m^2",
        (1, 2, 0),
        required=False,
        default="m (w^2 + h^2)/3, a uniform rectangle",
    )
    k1: float = _from_zero(
        "stiffness of the inclined spring at the leading side", "N/m", _STIFFNESS
    )
    k2: float = _from_zero(
        "stiffness of the inclined spring at the trailing side", "N/m", _STIFFNESS
    )
    k3: float = _positive(
        "contact stiffness at the leading edge", "N/m", _STIFFNESS, models=("B1",)
    )
    k4: float = _positive(
        "contact stiffness at the trailing edge", "N/m", _STIFFNESS, models=("B1",)
    )
    k_c: float = _positive("full-contact stiffness", "N/m", _STIFFNESS, models=("B2", "B3"))
    L1: float = _positive("free length of spring 1", "m", _LENGTH, models=_TWO)
    L2: float = _positive("free length of spring 2", "m", _LENGTH, models=_TWO)
    alpha1: float = _real("inclination of spring 1", "rad", _NONE, angle=True)
    alpha2: float = _real("inclination of spring 2", "rad", _NONE, angle=True)
    mu: float = _from_zero("coefficient of friction", "1", _NONE)
    F_n: float = _from_zero("actuation (brake) force", "N", _FORCE, models=_TWO)
    V: float | None = _positive(
        "speed of the sliding surface",
        "m/s",
        (0, 1, -1),
        models=_TWO,
        required=False,
        default="sliding is assumed and not checked",
    )
    x0: float = _real(
        "initial position along the surface",
        "m",
        _LENGTH,
        models=_TWO,
        required=False,
        default="0",
    )
    y0: float = _real(
        "initial height of the mass centre over its place at touch",
        "m",
        _LENGTH,
        models=_TWO,
        required=False,
        default="0",
    )
    theta0: float = _real(
        "initial angle",
        "rad",
        _NONE,
        required=False,
        angle=True,
        low=-math.pi / 2,
        high=math.pi / 2,
        low_allowed=False,
        default="0",
    )

    def __post_init__(self) -> None:
        if self.I is None:
            object.__setattr__(self, "I", self.m * (self.w**2 + self.h**2) / 3)

    def replace(self, **changes: float) -> Pad:
        """A copy with some parameters changed; I stays as it is unless it is named."""
        return dataclasses.replace(self, **changes)

    def scaled(self, mass: float, length: float, time: float) -> Pad:
        """The same pad measured in other units (each given in the present ones)."""
        changes = {}
        for name, parameter in PARAMETERS.items():
            value = getattr(self, name)
            if value is not None and parameter.dimension != _NONE:
                a, b, c = parameter.dimension
                changes[name] = value / (mass**a * length**b * time**c)
        return dataclasses.replace(self, **changes)


PARAMETERS: dict[str, Parameter] = {f.name: f.metadata["p"] for f in dataclasses.fields(Pad)}
