"""The pad: its parameters, their meaning, units and allowed ranges, in one table.

The table is the single source for scene validation, defaults, scaling to other units and the
parameter table of the report.
"""

from __future__ import annotations

import copy
import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from squeal.numerics import differentiation as dual
from squeal.schema.keys import Key, check_needs, listed
from squeal.schema.place import Place
from squeal.schema.values import Angle, Number

Model = str  # the name of a contact model, see `squeal.model.contact.MODELS`


@dataclass(frozen=True, kw_only=True)
class Parameter(Key):
    """What one parameter means and may be.

    dimension: exponents of (mass, length, time); common: every model uses it, of the others
    `squeal.model.contact.models_with` says which.
    """

    kind: Number
    dimension: tuple[int, int, int]
    required: bool = True
    common: bool = True

    @property
    def angle(self) -> bool:
        """True for an angle, which a file may write as a multiple of pi."""
        return isinstance(self.kind, Angle)


_DIMENSIONS = {
    "kg": (1, 0, 0), "m": (0, 1, 0), "kg m^2": (1, 2, 0), "N/m": (1, 0, -2), "N": (1, 1, -2),
    "m/s": (0, 1, -1), "rad": (0, 0, 0), "1": (0, 0, 0),
}  # fmt: skip
_POSITIVE, _FROM_ZERO = Number(low=0.0), Number(low=0.0, low_allowed=True)
_ANGLE, _TURN = Angle(), Angle(low=-math.pi / 2, high=math.pi / 2)


def _field(meaning: str, unit: str, kind: Number, **more: Any) -> Any:
    needed = "default" not in more or "unless" in more
    parameter = Parameter(
        meaning=meaning, unit=unit, dimension=_DIMENSIONS[unit], kind=kind, required=needed, **more
    )
    # a placement is zero unless it is given; everything else is None where no model needs it
    return field(default=0.0 if parameter.default == "0" else None, metadata={"p": parameter})


def _some(meaning: str, unit: str, kind: Number = _POSITIVE, **more: Any) -> Any:
    """A parameter that not every model uses."""
    return _field(meaning, unit, kind, common=False, **more)


@dataclass(frozen=True)
class Pad:
    """Parameters of the rigid pad of Figs. 1 and 2, in SI units unless `scaled`.

    A parameter that the model at hand does not use is None (or 0 for a placement); each may also be
    an array, a symbol or a dual number. `uniform` tells that I was left out, so that it follows
    m, w and h, `follows` that mu was, so that it is that of mu_s, mu_k, v_ref and V. Raises
    InputError for a number, or an entry of an array, that is out of range.
    """

    m: float = _field("mass", "kg", _POSITIVE)
    w: float = _field("half length", "m", _POSITIVE)
    h: float = _field("half height", "m", _POSITIVE)
    # fmt: off
    I: float = _field("moment of inertia about the mass centre", "kg m^2", _POSITIVE,
                      default="m (w^2 + h^2)/3, a uniform rectangle")
    # fmt: on
    k1: float = _field("stiffness of the inclined spring at the leading side", "N/m", _FROM_ZERO)
    k2: float = _field("stiffness of the inclined spring at the trailing side", "N/m", _FROM_ZERO)
    k3: float = _some("contact stiffness at the leading edge", "N/m")
    k4: float = _some("contact stiffness at the trailing edge", "N/m")
    k_c: float = _some("full-contact stiffness", "N/m")
    L1: float = _some("free length of spring 1", "m")
    L2: float = _some("free length of spring 2", "m")
    alpha1: float = _field("inclination of spring 1", "rad", _ANGLE)
    alpha2: float = _field("inclination of spring 2", "rad", _ANGLE)
    # fmt: off
    mu: float = _field("coefficient of friction", "1", _FROM_ZERO, unless="mu_s",
                       default="refused, unless mu_s, mu_k, v_ref and V give it")
    F_n: float = _some("actuation (brake) force", "N", _FROM_ZERO)
    V: float | None = _some("speed of the sliding surface", "m/s",
                            default="sliding is assumed and not checked")
    mu_s: float | None = _some(
        "coefficient of friction at rest; at the sliding speed v = V - x_dot it is mu_k + (mu_s - "
        "mu_k) exp(-v/v_ref), scaled so that it is mu at v = V if mu is given too; a "
        "simulation ends where x_dot reaches V", "1",
        default="friction does not depend on speed", needs=("mu_k", "v_ref", "V"))
    mu_k: float | None = _some("coefficient of friction of fast sliding", "1",
                               default="refused beside mu_s", needs=("mu_s",))
    v_ref: float | None = _some("speed over which friction falls", "m/s",
                                default="refused beside mu_s", needs=("mu_s",))
    x0: float = _some("initial position along the surface", "m", Number(), default="0")
    y0: float = _some(
        "initial height of the mass centre over its place at touch (without effect in B1, whose "
        "contact springs are relaxed there)", "m", Number(), default="0")
    # fmt: on
    theta0: float = _field("initial angle", "rad", _TURN, default="0")

    uniform: bool = field(init=False, default=False, repr=False, compare=False)
    follows: bool = field(init=False, default=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        _check(vars(self))
        self._set(uniform=self.I is None, follows=self.mu is None)
        self._follow()

    def _follow(self) -> None:
        if self.uniform:
            self._set(I=self.m * (self.w**2 + self.h**2) / 3)
        check_needs(_FALLING, vars(self), Place("Pad"))
        if self.follows:
            if self.mu_s is None or self.mu_k is None:
                raise PARAMETERS["mu"].missing(Place("Pad") / "mu", "every model")
            self._set(mu=self.mu_k + (self.mu_s - self.mu_k) * self._at_speed)

    @property
    def _at_speed(self) -> Any:
        """exp(-V/v_ref)."""
        ratio = self.V / self.v_ref  # type: ignore[operator]
        if isinstance(ratio, dual.Dual):
            return dual.exp(-ratio)
        found = np.exp(-ratio)
        return float(found) if np.ndim(found) == 0 else found

    @property
    def fall(self) -> tuple[Any, Any] | None:
        """Share b and rate r (s/m) of friction mu (1 + b (exp(r x_dot) - 1)); None if it is
        the same at every speed.

        mu being that at the speed V, this is mu_k + (mu_s - mu_k) exp(-(V - x_dot)/v_ref), scaled.
        """
        if self.mu_s is None or self.mu_k is None:
            return None
        more = (self.mu_s - self.mu_k) * self._at_speed
        return more / (self.mu_k + more), 1.0 / self.v_ref  # type: ignore[operator]

    def _set(self, **values: Any) -> None:
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def given(self) -> dict[str, Any]:
        """The parameters that are not None, by name."""
        return {n: v for n in PARAMETERS if (v := getattr(self, n)) is not None}

    def to_dict(self) -> dict[str, Any]:
        """As it stands in a scene file, without what is left out or placed at zero."""
        return {
            name: value
            for name, value in self.given().items()
            if not (self.uniform and name == "I")
            and not (self.follows and name == "mu")
            and not (PARAMETERS[name].default == "0" and isinstance(value, float) and not value)
        }

    def __repr__(self) -> str:
        shown = (
            f"{name}={value:.6g}" if isinstance(value, float) else f"{name}={value!r}"
            for name, value in self.to_dict().items()
        )
        return f"Pad({', '.join(shown)})"

    def replace(self, **changes: Any) -> Pad:
        """A copy with some parameters changed; I follows m, w and h if it was left out, and mu
        the parameters of falling friction.

        Raises InputError for an unknown name or a value out of range.
        """
        for name in changes:
            if name not in PARAMETERS:
                raise (Place("Pad") / name).refuse(f"unknown key; allowed are {listed(PARAMETERS)}")
        _check(changes)
        new = copy.copy(self)
        new._set(**changes)
        if "I" in changes:
            new._set(uniform=new.I is None)
        if "mu" in changes:
            new._set(follows=new.mu is None)
        if not changes.keys().isdisjoint(("m", "w", "h", "I", "mu", "V", *_FALLING)):
            new._follow()
        return new

    def scaled(self, mass: float, length: float, time: float) -> Pad:
        """The same pad measured in other units (each given in the present ones)."""
        changes = {}
        for name, parameter in PARAMETERS.items():
            value = getattr(self, name)
            if value is not None and any(parameter.dimension):
                a, b, c = parameter.dimension
                changes[name] = value / (mass**a * length**b * time**c)
        # neither checked again nor rounded anew: what leaves double precision is found later
        new = copy.copy(self)
        new._set(**changes)
        return new


PARAMETERS: dict[str, Parameter] = {
    f.name: f.metadata["p"] for f in dataclasses.fields(Pad) if f.init
}
_FALLING = {name: PARAMETERS[name] for name in ("mu_s", "mu_k", "v_ref", "V")}
_LIMITS = {
    # both ends excluded; and whether the parameter may be None
    name: (*p.kind.bounds, p.default != "0" and not (p.required and p.common and not p.unless))
    for name, p in PARAMETERS.items()
}


def _check(values: Mapping[str, Any]) -> None:
    """Refuse a parameter that no model could take. Raises InputError."""
    for name, value in values.items():
        if name not in _LIMITS:
            continue
        low, high, optional = _LIMITS[name]
        # the usual case first: pads are made by the thousand
        if (value.__class__ is float and low < value < high) or (value is None and optional):
            continue
        at = Place("Pad") / name
        if value is None:
            raise PARAMETERS[name].missing(at, "every model")
        PARAMETERS[name].kind.check(value, at)
