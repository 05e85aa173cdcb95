"""Kinematics and spring forces of the pad, Eqs. (1)-(3), written once over generic arithmetic.

`ops` is any module that offers `sin`, `cos`, `exp` and `sqrt`: math for plain numbers, numpy for
arrays and complex numbers, mpmath for more digits, heyoka for expressions. The coefficients of a
pad may then be numbers, arrays or symbols, and every use of the model runs through these lines.
"""

from __future__ import annotations

import operator
from typing import Any, NamedTuple

from squeal.model.pad import Pad

Number = Any  # a float, complex, array, mpmath number or heyoka expression
Point = tuple[Number, Number]


class Loads(NamedTuple):
    """A force and its moment about the mass centre."""

    x: Number
    y: Number
    moment: Number


class Forces(NamedTuple):
    """Forces on the pad at points that are fixed to it, put together for any pose.

    across, along: sums of r x f and r . f, r being the point from the mass centre at theta = 0;
    moment: what turns the pad beside them.
    """

    x: Number
    y: Number
    across: Number
    along: Number
    moment: Number = 0.0

    @staticmethod
    def of(r: Point, x: Number, y: Number) -> Forces:
        """One force at the point r."""
        return Forces(x, y, r[0] * y - r[1] * x, r[0] * x + r[1] * y)

    def __add__(self, other: Forces) -> Forces:  # type: ignore[override]
        return Forces(*map(operator.add, self, other))

    def loads(self, at: Pose) -> Loads:
        """The loads in a pose; the moment of (R r) x f turns with the points."""
        turned = self.across + at.C * self.across - at.S * self.along
        return Loads(self.x, self.y, self.moment + turned)


class Coefficients(NamedTuple):
    """The numbers of a pad that enter the equations of motion.

    D1, D2: spring vectors r_i - r_f,i of the undeformed springs; r1, r2: upper corners and
    rl, rt: lower corners (leading, trailing) from the mass centre at theta = 0;
    gap_l, gap_t: height of the lower corners over the surface at x = y = theta = 0.
    """

    m: Number
    I: Number
    w: Number
    h: Number
    mu: Number
    F_n: Number
    x0: Number
    k1: Number
    k2: Number
    L1: Number
    L2: Number
    D1x: Number
    D1y: Number
    D2x: Number
    D2y: Number
    r1x: Number
    r1y: Number
    r2x: Number
    r2y: Number
    rlx: Number
    rly: Number
    rtx: Number
    rty: Number
    gap_l: Number
    gap_t: Number
    k3: Number
    k4: Number
    k_c: Number

    def place(self, state: Any) -> tuple[Number, Number, Number]:
        """q = (x, y, theta) of a state that starts with x, y and w theta."""
        return state[0], state[1], state[2] / self.w


def at_speed(
    ops: Any, c: Coefficients, fall: tuple[Number, Number] | None, speed: Number
) -> Coefficients:
    """Coefficients with the friction of a pad whose x_dot is `speed`; `fall` as in `Pad.fall`."""
    if fall is None:
        return c
    share, rate = fall
    return c._replace(mu=c.mu * (1.0 + share * (ops.exp(rate * speed) - 1.0)))


def coefficients(ops: Any, pad: Pad, absolute_gap: bool) -> Coefficients:
    """Derive the coefficients of `pad` (Eqs. 1-2 at x = y = theta = 0).

    `absolute_gap`: the surface lies at y = -h and y0, theta0 open a gap (B2); otherwise the
    contact springs are relaxed in the initial position (B1). Free lengths that the scene leaves
    out (B3) are set to w: an undeformed spring's stiffness does not depend on them.
    """
    cos0, sin0 = ops.cos(pad.theta0), ops.sin(pad.theta0)

    def turned(px: Number, py: Number) -> Point:
        return px * cos0 - py * sin0, px * sin0 + py * cos0

    w, h = pad.w, pad.h
    r1, r2, rl, rt = turned(-w, h), turned(w, h), turned(-w, -h), turned(w, -h)
    L1 = w if pad.L1 is None else pad.L1
    L2 = w if pad.L2 is None else pad.L2
    # h (1 - cos theta0) without cancellation
    lift = pad.y0 + 2 * h * ops.sin(pad.theta0 / 2) ** 2
    # fmt: off
    return Coefficients(
        m=pad.m, I=pad.I, w=w, h=h, mu=pad.mu, F_n=0.0 if pad.F_n is None else pad.F_n, x0=pad.x0,
        k1=pad.k1, k2=pad.k2, L1=L1, L2=L2,
        D1x=-L1 * ops.cos(pad.alpha1), D1y=-L1 * ops.sin(pad.alpha1),
        D2x=L2 * ops.cos(pad.alpha2), D2y=-L2 * ops.sin(pad.alpha2),
        r1x=r1[0], r1y=r1[1], r2x=r2[0], r2y=r2[1], rlx=rl[0], rly=rl[1], rtx=rt[0], rty=rt[1],
        gap_l=lift - w * sin0 if absolute_gap else 0.0,
        gap_t=lift + w * sin0 if absolute_gap else 0.0,
        k3=0.0 if pad.k3 is None else pad.k3,
        k4=0.0 if pad.k4 is None else pad.k4,
        k_c=0.0 if pad.k_c is None else pad.k_c,
    )
    # fmt: on


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

    def arm(self, rx: Number, ry: Number) -> Point:
        """Where that point now lies from the mass centre."""
        return self.aside(rx, ry), ry + self.S * rx + self.C * ry

    def aside(self, rx: Number, ry: Number) -> Number:
        """Where it lies along x alone."""
        return rx + self.C * rx - self.S * ry


def pose(ops: Any, q: tuple[Number, Number, Number]) -> Pose:
    """Pose of q = (x, y, theta); half angles keep cos(theta) - 1 exact for small rotations."""
    s, c = ops.sin(q[2] * 0.5), ops.cos(q[2] * 0.5)
    return Pose(q[0], q[1], 2.0 * s * c, -2.0 * s * s)


class Stretched(NamedTuple):
    """A spring whose end has moved.

    v: the present vector; length: |v|; more: |v|^2 - L^2, written so that it keeps its digits when
    L is much larger than the displacement.
    """

    v: Point
    length: Number
    more: Number


def stretched(ops: Any, D: Point, u: Point) -> Stretched:
    """A spring of vector D whose end has moved by u."""
    v = D[0] + u[0], D[1] + u[1]
    # not by L^2 + more, which rounding makes negative where the spring passes through no length
    length = ops.sqrt(v[0] * v[0] + v[1] * v[1])
    more = 2.0 * (D[0] * u[0] + D[1] * u[1]) + u[0] * u[0] + u[1] * u[1]
    return Stretched(v, length, more)


def elongation(ops: Any, L: Number, D: Point, u: Point) -> Number:
    """Elongation |D + u| - L of a spring with |D| = L."""
    s = stretched(ops, D, u)
    return s.more / (s.length + L)


def spring(ops: Any, k: Number, L: Number, D: Point, r: Point, at: Pose) -> Forces:
    """Force of one inclined spring on the pad, Eq. (3), where it acts in Eqs. (6) and (10)."""
    s = stretched(ops, D, at.displacement(*r))
    f = -k * s.more / (s.length * (s.length + L))
    return Forces.of(r, f * s.v[0], f * s.v[1])


def springs(ops: Any, c: Coefficients, at: Pose) -> Forces:
    """Forces of springs 1 and 2 together."""
    return spring(ops, c.k1, c.L1, (c.D1x, c.D1y), (c.r1x, c.r1y), at) + spring(
        ops, c.k2, c.L2, (c.D2x, c.D2y), (c.r2x, c.r2y), at
    )


def spring_energy(ops: Any, c: Coefficients, at: Pose) -> Number:
    """Potential energy of springs 1 and 2."""
    e1 = elongation(ops, c.L1, (c.D1x, c.D1y), at.displacement(c.r1x, c.r1y))
    e2 = elongation(ops, c.L2, (c.D2x, c.D2y), at.displacement(c.r2x, c.r2y))
    return 0.5 * c.k1 * e1 * e1 + 0.5 * c.k2 * e2 * e2


def spring_lengths(ops: Any, c: Coefficients, at: Pose) -> Point:
    """Present lengths of springs 1 and 2."""
    u1, u2 = at.displacement(c.r1x, c.r1y), at.displacement(c.r2x, c.r2y)
    return stretched(ops, (c.D1x, c.D1y), u1).length, stretched(ops, (c.D2x, c.D2y), u2).length


def gaps(c: Coefficients, at: Pose) -> Point:
    """Height of the leading and the trailing lower edge over the surface, Eqs. (7), (11)."""
    return c.gap_l + at.rise(c.rlx, c.rly), c.gap_t + at.rise(c.rtx, c.rty)


def edges(c: Coefficients, at: Pose) -> Point:
    """Where the leading and the trailing lower edge lie along x from the mass centre."""
    return at.aside(c.rlx, c.rly), at.aside(c.rtx, c.rty)


def facing(c: Coefficients, at: Pose) -> Number:
    """cos(theta0 + theta): positive as long as the lower face faces the surface."""
    return at.aside((c.rtx - c.rlx) / (2.0 * c.w), (c.rty - c.rly) / (2.0 * c.w))


def spring_vectors(c: Coefficients, at: Pose) -> tuple[Point, Point]:
    """Present vectors r_i - r_f,i of springs 1 and 2."""
    (u1x, u1y), (u2x, u2y) = at.displacement(c.r1x, c.r1y), at.displacement(c.r2x, c.r2y)
    return (c.D1x + u1x, c.D1y + u1y), (c.D2x + u2x, c.D2y + u2y)
