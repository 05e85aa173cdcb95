"""The pad: parameters, kinematics and spring forces, Eqs. (1)-(3).

Kinematics and forces are written once over generic arithmetic. `ops` is any module that offers
`sin`, `cos`, `exp` and `sqrt`: math for plain numbers, numpy for arrays and complex numbers, mpmath
for more digits, heyoka for expressions. The coefficients of a pad are then numbers, arrays or
symbols.
"""

from __future__ import annotations

import copy
import dataclasses
import math
import operator
from collections import namedtuple
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from squeal import schema
from squeal.errors import suggestion
from squeal.numerics import differentiation as dual
from squeal.schema import ANY, NOT_NEGATIVE, POSITIVE, Key, Place, check_needs

Model = str  # the name of a contact model, see `squeal.model.contact.MODELS`
Number = Any  # a float, complex, array, mpmath number or heyoka expression
Operations = Any  # a module with sin, cos, exp and sqrt of such numbers
Point = tuple[Number, Number]


@dataclass(frozen=True, kw_only=True)
class Parameter(Key):
    """What one parameter means and may be.

    dimension: exponents of (mass, length, time); common: every model uses it.
    """

    kind: schema.Number
    dimension: tuple[int, int, int]
    required: bool = True
    common: bool = True

    @property
    def angle(self) -> bool:
        """True for an angle, which a file may write as a multiple of pi."""
        return isinstance(self.kind, schema.Angle)


_DIMENSIONS = {
    "kg": (1, 0, 0), "m": (0, 1, 0), "kg m^2": (1, 2, 0), "N/m": (1, 0, -2), "N": (1, 1, -2),
    "m/s": (0, 1, -1), "rad": (0, 0, 0), "1": (0, 0, 0),
}  # fmt: skip
_TURN = schema.Angle(low=-math.pi / 2, high=math.pi / 2, high_allowed=False)


def _field(
    meaning: str,
    unit: str,
    kind: schema.Number,
    default: str = "",
    unless: str = "",
    needs: tuple[str, ...] = (),
    common: bool = True,
) -> Any:
    """A field of `Pad` with its `Parameter`; the arguments are fields of `Parameter` and of `Key`.

    default: in words what holds if the parameter is left out. The parameter is required if these
    words are empty. If `unless` names a parameter that may stand in its place, one of the two is
    required.
    """
    p = Parameter(
        meaning,
        unit,
        default=default,
        unless=unless,
        needs=needs,
        kind=kind,
        dimension=_DIMENSIONS[unit],
        required=not default or bool(unless),
        common=common,
    )
    # left out, a placement (x0, y0, theta0) is 0 and any other parameter None
    return field(default=0.0 if default == "0" else None, metadata={"p": p})


# a parameter that only some models use; it is above 0 unless another kind is given
_some = partial(_field, kind=POSITIVE, common=False)


@dataclass(frozen=True)
class Pad:
    """Parameters of the rigid pad of Figs. 1 and 2, in SI units unless `scaled`.

    A parameter that the model does not use is None (or 0 for a placement); each may also be an
    array, a symbol or a dual number. `derived`: what was left out and so follows others, I m, w and
    h, and mu mu_s, mu_k, v_ref and V. Raises InputError for what is out of range.

    Examples
    --------
    >>> import squeal
    >>> pad = squeal.Pad(m=0.2, w=0.04, h=0.014, k1=2e7, k2=2.6e7, k_c=1.7e7, alpha1=1.57,
    ...                  alpha2=3.14, mu=0.3)
    >>> pad.I == pad.m * (pad.w**2 + pad.h**2) / 3
    True
    """

    m: float = _field("mass", "kg", POSITIVE)
    w: float = _field("half length", "m", POSITIVE)
    h: float = _field("half height", "m", POSITIVE)
    # fmt: off
    I: float = _field("moment of inertia about the mass centre", "kg m^2", POSITIVE,
                      default="m (w^2 + h^2)/3, a uniform rectangle")
    k1: float = _field("stiffness of the inclined spring at the leading side", "N/m", NOT_NEGATIVE)
    k2: float = _field("stiffness of the inclined spring at the trailing side", "N/m", NOT_NEGATIVE)
    k3: float = _some("contact stiffness at the leading edge", "N/m")
    k4: float = _some("contact stiffness at the trailing edge", "N/m")
    k_c: float = _some("full-contact stiffness", "N/m")
    L1: float = _some("free length of spring 1", "m")
    L2: float = _some("free length of spring 2", "m")
    alpha1: float = _field("inclination of spring 1", "rad", schema.Angle())
    alpha2: float = _field("inclination of spring 2", "rad", schema.Angle())
    mu: float = _field("coefficient of friction", "1", NOT_NEGATIVE, unless="mu_s",
                       default="refused, unless mu_s, mu_k, v_ref and V give it")
    F_n: float = _some("actuation (brake) force", "N", kind=NOT_NEGATIVE)
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
    x0: float = _some(
        "initial position along the surface", "m", kind=ANY, default="0")
    y0: float = _some(
        "initial height of the mass centre over its place at touch (without effect in B1, whose "
        "contact springs are relaxed there)", "m", kind=ANY, default="0")
    # fmt: on
    theta0: float = _field("initial angle", "rad", _TURN, default="0")

    derived: tuple[str, ...] = field(init=False, default=(), repr=False, compare=False)

    def __post_init__(self) -> None:
        """Check the parameters, and derive I and mu where they are left out."""
        at = Place("Pad")
        values = vars(self)  # through which attributes of a frozen dataclass can be set
        for name, key in PARAMETERS.items():
            if values[name] is None:
                # mu has an `unless`: left out it is made of mu_s and mu_k below
                needed_by_every_model = key.required and key.common and not key.unless
                if key.default == "0" or needed_by_every_model:
                    raise key.missing(at / name, "every model")
            else:
                key.kind.check(values[name], at, name)
        check_needs(PARAMETERS, values, at)
        values["derived"] = tuple(name for name in ("I", "mu") if values[name] is None)
        if self.I is None:
            values["I"] = self.m * (self.w**2 + self.h**2) / 3  # of a block of 2 w by 2 h
        if self.mu is None:
            if self.mu_s is None or self.mu_k is None:
                raise PARAMETERS["mu"].missing(at / "mu", "every model")
            values["mu"] = self.mu_k + self._friction_above_mu_k  # at the sliding speed V

    @property
    def _friction_above_mu_k(self) -> Number:
        """By how much friction at the speed V exceeds mu_k."""
        ratio = self.V / self.v_ref  # type: ignore[operator]
        exp = dual.exp if isinstance(ratio, dual.Dual) else np.exp
        return (self.mu_s - self.mu_k) * exp(-ratio)  # type: ignore[operator]

    @property
    def fall(self) -> tuple[Number, Number] | None:
        """Share b and rate r (s/m) of friction mu (1 + b (exp(r x_dot) - 1)), None if it is
        constant.

        It is the law mu_k + (mu_s - mu_k) exp(-(V - x_dot)/v_ref), scaled to be mu at x_dot = 0.
        """
        if self.mu_s is None or self.mu_k is None:
            return None
        above = self._friction_above_mu_k
        rate = 1.0 / self.v_ref  # type: ignore[operator]
        return above / (self.mu_k + above), rate

    def given(self) -> dict[str, Any]:
        """The parameters that are not None, by name.

        Examples
        --------
        >>> import squeal
        >>> pad = squeal.Pad(m=0.2, w=0.04, h=0.014, k1=2e7, k2=2.6e7, k_c=1.7e7, alpha1=1.57,
        ...                  alpha2=3.14, mu=0.3)
        >>> "k3" in pad.given(), "I" in pad.given()
        (False, True)
        """
        return {name: vars(self)[name] for name in PARAMETERS if vars(self)[name] is not None}

    def to_dict(self) -> dict[str, Any]:
        """The pad as it stands in a scene file, without what is left out or placed at zero.

        Examples
        --------
        >>> import squeal
        >>> pad = squeal.Pad(m=0.2, w=0.04, h=0.014, k1=2e7, k2=2.6e7, k_c=1.7e7, alpha1=1.57,
        ...                  alpha2=3.14, mu=0.3)
        >>> list(pad.to_dict())
        ['m', 'w', 'h', 'k1', 'k2', 'k_c', 'alpha1', 'alpha2', 'mu']
        """
        written = {}
        for name, value in self.given().items():
            placed_at_zero = (
                PARAMETERS[name].default == "0" and isinstance(value, float) and not value
            )
            if name not in self.derived and not placed_at_zero:
                written[name] = value
        return written

    def __repr__(self) -> str:
        texts = []
        for name, value in self.to_dict().items():
            text = f"{value:.6g}" if isinstance(value, float) else repr(value)
            texts.append(f"{name}={text}")
        return f"Pad({', '.join(texts)})"

    def replace(self, **changes: Number) -> Pad:
        """A copy with some parameters changed; those that are `derived` follow.

        Raises InputError for an unknown name or a value out of range.

        Examples
        --------
        >>> import squeal
        >>> pad = squeal.Pad(m=0.2, w=0.04, h=0.014, k1=2e7, k2=2.6e7, k_c=1.7e7, alpha1=1.57,
        ...                  alpha2=3.14, mu=0.3)
        >>> heavier = pad.replace(m=0.4)
        >>> heavier.I == 2 * pad.I
        True
        """
        for name in changes.keys() - PARAMETERS.keys():
            raise (Place("Pad") / name).refuse(f"unknown key; {suggestion(name, PARAMETERS)}")
        given = self.given()
        for name in self.derived:  # these follow the changed parameters
            del given[name]
        return Pad(**(given | changes))

    def scaled(self, mass: float, length: float, time: float) -> Pad:
        """This pad in other units: `mass`, `length` and `time` are these units in the present ones.

        Examples
        --------
        >>> import squeal
        >>> pad = squeal.Pad(m=0.2, w=0.04, h=0.014, k1=2e7, k2=2.6e7, k_c=1.7e7, alpha1=1.57,
        ...                  alpha2=3.14, mu=0.3)
        >>> in_millimetres = pad.scaled(1.0, 1e-3, 1.0)
        >>> round(in_millimetres.w, 9), round(in_millimetres.k1, 3)
        (40.0, 20000000.0)
        """
        new = copy.copy(self)  # not checked again: what leaves double precision shows later
        for name, value in self.given().items():
            of_mass, of_length, of_time = PARAMETERS[name].dimension  # exponents
            if of_mass or of_length or of_time:
                unit = mass**of_mass * length**of_length * time**of_time
                vars(new)[name] = value / unit
        return new


PARAMETERS: dict[str, Parameter] = {
    f.name: f.metadata["p"] for f in dataclasses.fields(Pad) if f.init
}

_Coefficients = namedtuple(
    "_Coefficients",
    "m I w h mu F_n x0 k1 k2 L1 L2 D1x D1y D2x D2y r1x r1y r2x r2y rlx rly rtx rty gap_l gap_t "
    "k3 k4 k_c",
)


class Coefficients(_Coefficients):
    """The numbers of a pad that enter the equations of motion.

    D1, D2: spring vectors r_i - r_f,i of the undeformed springs; r1, r2: upper corners and
    rl, rt: lower corners (leading, trailing) from the mass centre at theta = 0;
    gap_l, gap_t: height of the lower corners over the surface at x = y = theta = 0.
    """

    def xy_theta(self, state: Sequence[Number] | np.ndarray) -> tuple[Number, Number, Number]:
        """(x, y, theta) of a state that starts with (x, y, w theta), or of rates theirs."""
        return state[0], state[1], state[2] / self.w


def coefficients(ops: Operations, pad: Pad, absolute_gap: bool) -> Coefficients:
    """Derive the coefficients of `pad` (Eqs. 1-2 at x = y = theta = 0).

    absolute_gap: whether y0 and theta0 open a gap over the surface; otherwise the contact springs
    are relaxed in the initial position, and both gaps are zero. Free lengths that the scene leaves
    out (B3) are set to w: an undeformed spring's stiffness does not depend on them.
    """
    cos0 = ops.cos(pad.theta0)
    sin0 = ops.sin(pad.theta0)

    def turned(px: Number, py: Number) -> Point:
        """A point of the body turned by theta0 about the mass centre."""
        return px * cos0 - py * sin0, px * sin0 + py * cos0

    w = pad.w
    h = pad.h
    r1 = turned(-w, h)  # upper corners, where springs 1 and 2 hold the pad
    r2 = turned(w, h)
    rl = turned(-w, -h)  # lower corners, leading and trailing
    rt = turned(w, -h)
    # from its corner spring 1 leads to its foot at the angle alpha1 from the x axis towards y,
    # spring 2 at alpha2 from the negative x axis towards y; D leads from the foot to the corner
    L1 = _value_or(pad.L1, w)
    L2 = _value_or(pad.L2, w)
    gap_l: Number = 0.0
    gap_t: Number = 0.0
    if absolute_gap:
        # y0 + h (1 - cos theta0) without cancellation
        lift = pad.y0 + 2 * h * ops.sin(pad.theta0 / 2) ** 2
        gap_l = lift - w * sin0
        gap_t = lift + w * sin0
    # fmt: off
    return Coefficients(
        m=pad.m, I=pad.I, w=w, h=h, mu=pad.mu, F_n=_value_or(pad.F_n, 0.0), x0=pad.x0,
        k1=pad.k1, k2=pad.k2, L1=L1, L2=L2,
        k3=_value_or(pad.k3, 0.0), k4=_value_or(pad.k4, 0.0), k_c=_value_or(pad.k_c, 0.0),
        D1x=-L1 * ops.cos(pad.alpha1), D1y=-L1 * ops.sin(pad.alpha1),
        D2x=L2 * ops.cos(pad.alpha2), D2y=-L2 * ops.sin(pad.alpha2),
        r1x=r1[0], r1y=r1[1], r2x=r2[0], r2y=r2[1], rlx=rl[0], rly=rl[1], rtx=rt[0], rty=rt[1],
        gap_l=gap_l, gap_t=gap_t,
    )
    # fmt: on


def _value_or(value: Number | None, otherwise: Number) -> Number:
    """A parameter, or what stands for one that a model does without."""
    return otherwise if value is None else value


def at_speed(
    ops: Operations, c: Coefficients, fall: tuple[Number, Number] | None, speed: Number
) -> Coefficients:
    """Coefficients with the friction of a pad whose x_dot is `speed`; `fall` as in `Pad.fall`."""
    if fall is None:
        return c
    share, rate = fall
    return c._replace(mu=c.mu * (1.0 + share * (ops.exp(rate * speed) - 1.0)))


class Pose(NamedTuple):
    """Displacement of the pad: x, y, S = sin(theta) and C = cos(theta) - 1."""

    x: Number
    y: Number
    S: Number
    C: Number

    def displacement(self, rx: Number, ry: Number) -> Point:
        """Displacement of the body point that lay at (rx, ry) from the mass centre."""
        return self.x + self.C * rx - self.S * ry, self.rise(rx, ry)

    def rise(self, rx: Number, ry: Number) -> Number:
        """Displacement of that point along y alone."""
        return self.y + self.S * rx + self.C * ry

    def x_offset(self, rx: Number, ry: Number) -> Number:
        """How far along x that point now lies from the mass centre."""
        return rx + self.C * rx - self.S * ry


def pose_of(ops: Operations, q: tuple[Number, Number, Number]) -> Pose:
    """Pose of q = (x, y, theta); half angles keep cos(theta) - 1 exact for small rotations."""
    x, y, theta = q
    s = ops.sin(theta * 0.5)
    c = ops.cos(theta * 0.5)
    return Pose(x, y, 2.0 * s * c, -2.0 * s * s)


class Loads(NamedTuple):
    """A force and its moment about the mass centre."""

    x: Number
    y: Number
    moment: Number

    @staticmethod
    def of(pose: Pose, r: Point, x: Number, y: Number) -> Loads:
        """Of one force at the body point that lay at r from the mass centre."""
        height = r[1] + pose.S * r[0] + pose.C * r[1]  # over the mass centre
        return Loads(x, y, pose.x_offset(*r) * y - height * x)

    def __add__(self, other: Loads) -> Loads:  # type: ignore[override]
        return Loads(*map(operator.add, self, other))


class _Spring(NamedTuple):
    """A spring: stiffness, free length, vector D without load and upper corner r."""

    k: Number
    L: Number
    D: Point
    r: Point


def _two_springs(c: Coefficients) -> tuple[_Spring, _Spring]:
    """Springs 1 and 2."""
    return (
        _Spring(c.k1, c.L1, (c.D1x, c.D1y), (c.r1x, c.r1y)),
        _Spring(c.k2, c.L2, (c.D2x, c.D2y), (c.r2x, c.r2y)),
    )


def spring_vectors(c: Coefficients, pose: Pose) -> list[Point]:
    """Present vectors r_i - r_f,i of springs 1 and 2."""
    vectors = []
    for spring in _two_springs(c):
        u = pose.displacement(*spring.r)
        vectors.append((spring.D[0] + u[0], spring.D[1] + u[1]))
    return vectors


def stretched(ops: Operations, L: Number, D: Point, u: Point) -> tuple[Point, Number, Number]:
    """Vector v = D + u, length |v| and elongation |v| - L of a spring.

    D is its vector without load, |D| = L, and u the displacement of its end. The elongation is
    (|v|^2 - L^2) / (|v| + L), which keeps its digits when D is much larger than u.
    """
    v = D[0] + u[0], D[1] + u[1]
    # not by L^2 + excess, which rounding makes negative where the spring passes through no length
    length = ops.sqrt(v[0] * v[0] + v[1] * v[1])
    excess = 2.0 * (D[0] * u[0] + D[1] * u[1]) + u[0] * u[0] + u[1] * u[1]
    return v, length, excess / (length + L)


def springs(ops: Operations, c: Coefficients, pose: Pose) -> Loads:
    """Loads of springs 1 and 2 on the pad together, Eq. (3), as in Eqs. (6) and (10)."""
    first, second = _two_springs(c)
    return _spring_loads(ops, first, pose) + _spring_loads(ops, second, pose)


def _spring_loads(ops: Operations, spring: _Spring, pose: Pose) -> Loads:
    """Of one spring, along its present vector, on the upper corner."""
    v, length, elongation = stretched(ops, spring.L, spring.D, pose.displacement(*spring.r))
    f = -spring.k * elongation / length
    return Loads.of(pose, spring.r, f * v[0], f * v[1])


def spring_energy(ops: Operations, c: Coefficients, pose: Pose) -> Number:
    """Potential energy of springs 1 and 2."""
    first, second = _two_springs(c)
    return _spring_energy(ops, first, pose) + _spring_energy(ops, second, pose)


def _spring_energy(ops: Operations, spring: _Spring, pose: Pose) -> Number:
    """Of one spring."""
    _, _, elongation = stretched(ops, spring.L, spring.D, pose.displacement(*spring.r))
    return 0.5 * spring.k * elongation * elongation


def gaps(c: Coefficients, pose: Pose) -> Point:
    """Height of the leading and the trailing lower edge over the surface, Eqs. (7), (11)."""
    return c.gap_l + pose.rise(c.rlx, c.rly), c.gap_t + pose.rise(c.rtx, c.rty)


def edges(c: Coefficients, pose: Pose) -> Point:
    """Where the leading and the trailing lower edge lie along x from the mass centre."""
    return pose.x_offset(c.rlx, c.rly), pose.x_offset(c.rtx, c.rty)


def facing(c: Coefficients, pose: Pose) -> Number:
    """cos(theta0 + theta): positive as long as the lower face faces the surface."""
    return pose.x_offset((c.rtx - c.rlx) / (2.0 * c.w), (c.rty - c.rly) / (2.0 * c.w))
