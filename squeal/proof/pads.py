"""The referee on nonlinear pads: the model's own expressions over balls.

The sliding equilibrium q(mu) of F(q, mu) = 0 is enclosed over intervals of friction. With an
approximate equilibrium c at m, its approximate slope t and Y, about the inverse of J = dF/dq there,

    e -> -Y F(c + t (mu - m) + .., mu) + (1 - Y J) e

maps a box of deviations e from the line c + t (mu - m) into its interior (Krawczyk's operator):
then there is exactly one equilibrium in the box at each mu of the interval. Cells with such boxes
are joined where the box of one holds the equilibrium that the other has at their common friction.
Within a cell F is that of one contact state. Where a gap vanishes both states have the same loads,
so that the branch goes on in the other state: in a cell whose box holds the branch between two
frictions, before and beyond the change. K = -J over the box feeds the enclosure of roots. Needs
python-flint.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from squeal.model.contact import State
from squeal.model.equations import PadModel, net_loads
from squeal.model.pad import Coefficients, Pad, coefficients, pose
from squeal.proof.balls import AS_GIVEN, Balls, Floats, Quadratic
from squeal.proof.pieces import Failure
from squeal.proof.ranges import middle_and_radius

try:
    import flint
except ImportError:  # an extra
    flint = None

Ball = Any
"""A `flint.arb`."""
UNITS = ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0))  # slopes of x, y and theta themselves
UNKNOWNS = 3  # x, y, theta; the fourth slope is that by friction
INFLATED = 2.0  # boxes are so much wider than the first image of a point
ROUNDS = 8  # of inflation
HOPELESS = 1.3  # an image by so much wider than its box: the cell is too wide
CONTRACTION = 0.33  # of boxes that widths aim at
NARROWEST = 1e-12  # of the range: a cell that is not halved
SHORT = 1e-10  # of the range: a cell in which the contact may change
TIGHT = 0.05  # share of the way of the equilibrium that its enclosure may be off
LOST = "the equilibrium is not enclosed"


@dataclass(slots=True, eq=False)  # many are made: frozen ones would take three times as long
class Line:
    """Numbers c + s d + r that depend on one d: a first-order Taylor model.

    centre, slope, rest: balls of c, s and r; reach: ball of d, with its middle at zero.
    """

    centre: Ball
    slope: Ball
    rest: Ball
    reach: Ball

    def ball(self) -> Ball:
        """All its numbers."""
        return self.centre + self.slope * self.reach + self.rest

    def __add__(self, other: Any) -> Line:
        if not isinstance(other, Line):
            return Line(self.centre + other, self.slope, self.rest, self.reach)
        slope = self.slope + other.slope
        return Line(self.centre + other.centre, slope, self.rest + other.rest, self.reach)

    def __neg__(self) -> Line:
        return Line(-self.centre, -self.slope, -self.rest, self.reach)

    def __sub__(self, other: Any) -> Line:
        return self + (-other)

    def __rsub__(self, other: Any) -> Line:
        return -self + other

    def __mul__(self, other: Any) -> Line:
        if not isinstance(other, Line):
            return Line(self.centre * other, self.slope * other, self.rest * other, self.reach)
        slope = self.centre * other.slope + self.slope * other.centre
        steep = self.slope * other.slope * self.reach * self.reach
        straight = other.centre + other.slope * self.reach
        rest = steep + self.rest * (straight + other.rest)
        rest += other.rest * (self.centre + self.slope * self.reach)
        return Line(self.centre * other.centre, slope, rest, self.reach)

    def __truediv__(self, other: Any) -> Line:
        return self * other.inverse() if isinstance(other, Line) else self * (1 / _ball(other))

    def __rtruediv__(self, other: Any) -> Line:
        return self.inverse() * other

    __radd__ = __add__
    __rmul__ = __mul__

    def inverse(self) -> Line:
        """One over it."""
        at = 1 / self.centre
        return self._applied(at, -at * at, 2 / self._hull() ** 3)

    def sin(self) -> Line:
        """The sine."""
        return self._applied(self.centre.sin(), self.centre.cos(), -self._hull().sin())

    def cos(self) -> Line:
        """The cosine."""
        return self._applied(self.centre.cos(), -self.centre.sin(), -self._hull().cos())

    def sqrt(self) -> Line:
        """The square root."""
        root = self.centre.sqrt()
        whole = self._hull()
        return self._applied(root, 0.5 / root, -0.25 / (whole * whole.sqrt()))

    def _hull(self) -> Ball:
        """All its numbers and those between them and its centre, which may be none of them."""
        return self.ball().union(self.centre)

    def _applied(self, value: Ball, slope: Ball, curvature: Ball) -> Line:
        """A function of it: value and slope at its centre, second derivative over its hull."""
        deviation = self.slope * self.reach + self.rest
        rest = slope * self.rest + curvature / 2 * deviation * deviation
        return Line(value, slope * self.slope, rest, self.reach)


@dataclass(slots=True, eq=False)  # many are made: frozen ones would take three times as long
class Jet:
    """A number, a `Line` or a ball, and its slopes by x, y, theta and mu."""

    value: Any
    slopes: tuple[Any, ...]

    @staticmethod
    def of(x: Any) -> Jet:
        """x itself, or a constant."""
        return x if isinstance(x, Jet) else Jet(x, (0, 0, 0, 0))

    def __add__(self, other: Any) -> Jet:
        if not isinstance(other, Jet):
            return Jet(self.value + other, self.slopes)
        pairs = zip(self.slopes, other.slopes, strict=True)
        return Jet(self.value + other.value, tuple([_sum(a, b) for a, b in pairs]))

    def __neg__(self) -> Jet:
        return Jet(-self.value, tuple([-a for a in self.slopes]))

    def __sub__(self, other: Any) -> Jet:
        return self + (-other)

    def __rsub__(self, other: Any) -> Jet:
        return -self + other

    def __mul__(self, other: Any) -> Jet:
        if not isinstance(other, Jet):
            return Jet(self.value * other, tuple([_product(a, other) for a in self.slopes]))
        slopes = []
        for a, b in zip(self.slopes, other.slopes, strict=True):
            slopes.append(_sum(_product(a, other.value), _product(b, self.value)))
        return Jet(self.value * other.value, tuple(slopes))

    def __truediv__(self, other: Any) -> Jet:
        if not isinstance(other, Jet):
            return self * (1 / other)
        return self * other._inverse()

    def __rtruediv__(self, other: Any) -> Jet:
        return self._inverse() * other

    __radd__ = __add__
    __rmul__ = __mul__

    def _inverse(self) -> Jet:
        """One over it."""
        value = 1 / self.value
        return self.applied(value, -(value * value))

    def applied(self, value: Any, slope: Any) -> Jet:
        """A function of it, from its value and its slope there."""
        return Jet(value, tuple([_product(a, slope) for a in self.slopes]))


def _sum(a: Any, b: Any) -> Any:
    """a + b, for free where one is the whole number 0: most slopes are."""
    if type(a) is int and a == 0:
        return b
    if type(b) is int and b == 0:
        return a
    return a + b


def _product(slope: Any, factor: Any) -> Any:
    """slope factor, for free where the slope is the whole number 0 or 1: most are."""
    if type(slope) is int:
        return slope if slope == 0 else factor if slope == 1 else factor * slope
    return slope * factor


class Functions:
    """The functions that the model's expressions need, of balls and jets."""

    @staticmethod
    def sin(x: Any) -> Any:
        """The sine."""
        if isinstance(x, Jet):
            return x.applied(x.value.sin(), x.value.cos())
        return x.sin() if isinstance(x, Line) else _ball(x).sin()

    @staticmethod
    def cos(x: Any) -> Any:
        """The cosine."""
        if isinstance(x, Jet):
            return x.applied(x.value.cos(), -x.value.sin())
        return x.cos() if isinstance(x, Line) else _ball(x).cos()

    @staticmethod
    def sqrt(x: Any) -> Any:
        """The square root."""
        if isinstance(x, Jet):
            root = x.value.sqrt()
            return x.applied(root, 0.5 / root)
        return x.sqrt() if isinstance(x, Line) else _ball(x).sqrt()


class Doubles:
    """The same of jets of doubles: approximate, for Newton's method alone."""

    @staticmethod
    def sin(x: Jet) -> Jet:
        """The sine."""
        return x.applied(math.sin(x.value), math.cos(x.value))

    @staticmethod
    def cos(x: Jet) -> Jet:
        """The cosine."""
        return x.applied(math.cos(x.value), -math.sin(x.value))

    @staticmethod
    def sqrt(x: Jet) -> Jet:
        """The square root."""
        root = math.sqrt(x.value)
        return x.applied(root, 0.5 / root)


def _ball(x: Any) -> Ball:
    return flint.arb(x)


def _pad_of_balls(pad: Pad) -> Pad:
    """The pad with its numbers as exact balls."""
    new = copy(pad)
    for name, value in pad.given().items():
        vars(new)[name] = flint.arb(float(value))
    return new


@dataclass(frozen=True, eq=False)
class Cell:
    """An interval of friction with one equilibrium in a box at each value.

    low, high: of friction; state: which contact points touch; centre (3,): c, at `middle`; slope
    (3,): t; box: deviations from the line, three balls, that hold one equilibrium; image: narrower
    ones that hold it too; share: how much of the box these take, at most.
    """

    low: float
    high: float
    state: State
    middle: float
    centre: Floats
    slope: Floats
    box: tuple[Ball, ...]
    image: tuple[Ball, ...]
    share: float = 0.0

    def within(self, other: Cell) -> bool:
        """Whether it is a part of another one."""
        return self.state == other.state and other.low <= self.low <= self.high <= other.high

    def places(self, low: float, high: float) -> list[Line]:
        """The equilibria over a part of the interval."""
        return self._around(low, high, self.image)

    def widest(self) -> list[Line]:
        """All places of the box."""
        return self._around(self.low, self.high, self.box)

    def _around(self, low: float, high: float, box: Sequence[Ball]) -> list[Line]:
        friction = _friction(low, high)
        shift = friction.centre - self.middle
        places = []
        for c, t, e in zip(self.centre.tolist(), self.slope.tolist(), box, strict=True):
            places.append(Line(c + t * shift, flint.arb(t), e, friction.reach))
        return places

    def holds(self, other: Cell, low: float, high: float) -> bool:
        """Whether the box holds the equilibria of another cell from low to high."""
        own = self._around(low, high, [flint.arb(0)] * UNKNOWNS)
        for box, line, place in zip(self.box, own, other.places(low, high), strict=True):
            if not box.contains((place - line).ball()):
                return False
        return True


class PadBranch:
    """The systems about the sliding equilibrium of a pad, over intervals of friction.

    Parameters
    ----------
    model : PadModel
        The pad and its contact model.
    start : array_like (3,)
        An approximate equilibrium (x, y, theta) at the lowest friction; the branch through it is
        meant.
    low, high : float
        The range of friction.

    Raises
    ------
    ImportError
        Without python-flint.
    """

    def __init__(self, model: PadModel, start: ArrayLike, low: float, high: float) -> None:
        if flint is None:
            raise ImportError("pads need python-flint", name="flint")
        self.model = model
        self.low = low
        self.high = high
        pad = _pad_of_balls(model.pad)
        self._fall = pad.fall
        self._c: Coefficients = coefficients(Functions, pad, model.law.absolute_gap)
        self.cells: list[Cell] = []
        self.reason = ""  # why the cells end below `high`
        self._latest: Cell | None = None  # part of a cell that was asked for last
        if not model.linear:
            self._follow(np.asarray(start, float))

    def __call__(self, low: float, high: float) -> tuple[Quadratic, ...] | Failure:
        if self.model.linear:
            friction = _friction(low, high)
            nowhere = [friction * 0] * UNKNOWNS
            return (self._matrices(nowhere, friction, self.model.full),)
        if low < self.low or high > (self.cells[-1].high if self.cells else self.low):
            return Failure(self.reason)
        systems: list[Quadratic] = []
        for cell in self.cells:
            a, b = max(low, cell.low), min(high, cell.high)
            if a > b or (a == b and low < high):
                continue
            places = self._part_of(cell, a, b).places(a, b)
            systems.append(self._matrices(places, _friction(a, b), cell.state))
        return tuple(systems)

    def _part_of(self, cell: Cell, low: float, high: float) -> Cell:
        """A cell of the same equilibria that is narrow enough for a part of the interval."""
        latest = self._latest
        if latest is not None and latest.within(cell) and latest.low <= low <= high <= latest.high:
            cell = latest
        moves = np.abs(cell.slope) * (high - low)
        loose = [float(ball.abs_upper()) for ball in cell.image] > TIGHT * moves
        if not loose.any():
            return cell
        middle = (low + high) / 2.0
        guess = cell.centre + cell.slope * (middle - cell.middle)
        part = self._cell(low, high, guess, cell.state)
        if part is None or not cell.holds(part, low, low):
            return cell
        if low < high:
            self._latest = part
        return part

    def _follow(self, guess: Floats) -> None:
        """Cells from the lowest friction on, each of the branch of the one before."""
        place = pose(Functions, tuple(map(flint.arb, guess.tolist())))
        state = State(*(float(gap.mid()) < 0.0 for gap in self.model.law.gaps(self._c, place)))
        mu = self.low
        whole = self.high - self.low
        width = whole
        while mu < self.high:
            if width < NARROWEST * whole:
                self.reason = f"{LOST} beyond {mu:.9g}"
                return
            width = min(width, self.high - mu)
            cell = self._cell(mu, mu + width, guess, state)
            joined = cell is not None and self._is_joined(cell)
            open_points = self._unsettled(cell, cell.low, cell.high) if cell and joined else []
            if cell is not None and joined and not open_points:
                self.cells.append(cell)
            elif cell is not None and len(open_points) == 1 and width <= SHORT * whole:
                pair = self._changed(cell, open_points[0]) if self.cells else None
                if pair is None:
                    self.reason = f"the contact changes at {mu:.9g} in a way that is not resolved"
                    return
                self.cells += pair
                cell = pair[1]
                state = cell.state
            elif cell is not None and len(open_points) == 1:
                ahead = self._change_ahead(cell, open_points[0])
                if ahead < 0.5 * SHORT * whole:
                    width = SHORT * whole
                else:
                    width = min(max(ahead - 0.3 * SHORT * whole, SHORT * whole), width / 2.0)
                continue
            else:
                width /= 2.0
                continue
            mu = cell.high
            guess = cell.centre + cell.slope * (mu - cell.middle)
            # the image of a box is half of it and what the slopes change, which goes as the width
            contraction = max(cell.share - 1.0 / INFLATED, 1e-3)
            width *= min(max(CONTRACTION / contraction, 0.6), 4.0)

    def _is_joined(self, cell: Cell) -> bool:
        """Whether the cell holds the equilibrium that the last one has at its end."""
        if not self.cells:
            return True
        last = self.cells[-1]
        if cell.state == last.state and cell.holds(last, cell.low, cell.low):
            return True
        guess = last.centre + last.slope * (cell.low - last.middle)
        point = self._cell(cell.low, cell.low, guess, cell.state)
        if point is None:
            return False
        return all(one.holds(point, cell.low, cell.low) for one in (last, cell))

    def _gaps(self, cell: Cell, low: float, high: float) -> list[Ball]:
        """Gaps of the contact points over a part of a cell."""
        x, y, theta = cell.places(low, high)
        return [gap.ball() for gap in self.model.law.gaps(self._c, pose(Functions, (x, y, theta)))]

    def _unsettled(self, cell: Cell, low: float, high: float) -> list[int]:
        """The contact points whose gaps may have another sign than the state of the cell says."""
        points = []
        for point, gap in enumerate(self._gaps(cell, low, high)):
            settled = gap < 0 if cell.state[point] else gap > 0
            if not settled:
                points.append(point)
        return points

    def _change_ahead(self, cell: Cell, point: int) -> float:
        """About how far beyond the start of a cell the gap of a point vanishes; half of it if not
        within."""
        x, y, theta = cell.places(cell.low, cell.high)
        gap = self.model.law.gaps(self._c, pose(Functions, (x, y, theta)))[point]
        width = cell.high - cell.low
        slope = float(gap.slope.mid())
        ahead = width / 2.0 - float(gap.centre.mid()) / slope if slope else width / 2.0
        return ahead if abs(ahead - width / 2.0) <= 0.6 * width else width / 2.0

    def _changed(self, cell: Cell, point: int) -> list[Cell] | None:
        """Cells before and beyond a change of contact at one point, over the same short interval.

        At its end the first state is wrong and the second one right, each for certain; somewhere
        between the gap vanishes, where both states have the same loads.
        """
        after = cell.state.flip(point)
        width = cell.high - cell.low
        for _ in range(ROUNDS):
            high = cell.low + width
            first = self._cell(cell.low, high, cell.centre, cell.state)
            if first is None or not self._is_joined(first):
                return None
            second = self._cell(cell.low, high, first.centre, after, like=first)
            if second is None or not second.holds(first, cell.low, high):
                return None
            gap = self._gaps(first, high, high)[point]
            left = gap > 0 if cell.state[point] else gap < 0
            others = self._unsettled(first, cell.low, high)
            others += self._unsettled(second, cell.low, high)
            if set(others) - {point}:
                return None
            if left and not self._unsettled(second, high, high):
                return [first, second]
            width *= 2.0
        return None

    def _cell(
        self, low: float, high: float, guess: Floats, state: State, like: Cell | None = None
    ) -> Cell | None:
        """A box with one equilibrium at each friction from low to high, None if none is found.

        It reaches as far as the places of the cell `like` over the same interval.
        """
        middle = (low + high) / 2.0
        found = self._newton(guess, middle, state)
        if found is None:
            return None
        centre, slope, inverse = found
        friction = _friction(low, high)
        nothing = (flint.arb(0),) * UNKNOWNS
        line = Cell(low, high, state, middle, centre, slope, nothing, nothing)
        misses = self._values(line.places(low, high), friction, state)
        constant = []
        for row in inverse.tolist():
            constant.append(-sum((m * y for m, y in zip(misses, row, strict=True)), flint.arb(0)))
        radii = [1e-18 * float(np.max(np.abs(centre))) + 1e-300] * UNKNOWNS
        if like is not None:
            turned = np.abs(like.slope - slope) * (high - low)
            loose = [float(ball.abs_upper()) for ball in like.image]
            radii = (2.0 * (np.abs(like.centre - centre) + turned + loose)).tolist()
        image = constant
        for _ in range(ROUNDS):
            reach = [
                INFLATED * float(ball.abs_upper()) + r for ball, r in zip(image, radii, strict=True)
            ]
            if not np.isfinite(reach).all():
                return None
            box = tuple(flint.arb(0, r) for r in reach)
            _, slopes = self._loads(replace(line, box=box).widest(), friction, state)
            image = []
            for i, row in enumerate(inverse.tolist()):
                ball = constant[i]
                for j, e in enumerate(box):
                    rest = flint.arb(int(i == j))
                    for k, y in enumerate(row):
                        rest -= slopes[k][j] * y
                    ball += rest * e
                image.append(ball)
            shares = [float(ball.abs_upper()) / r for ball, r in zip(image, reach, strict=True)]
            if all(e.contains_interior(ball) for e, ball in zip(box, image, strict=True)):
                return Cell(low, high, state, middle, centre, slope, box, tuple(image), max(shares))
            if not max(shares) < HOPELESS:
                return None
        return None

    def _newton(
        self, guess: Floats, mu: float, state: State
    ) -> tuple[Floats, Floats, Floats] | None:
        """An approximate equilibrium, its slope by friction and the inverse of J there."""
        q = guess
        on = tuple(int(touches) for touches in state)
        friction = Jet(mu, (0, 0, 0, 1))
        c = self.model.c._replace(mu=friction)
        for _ in range(12):
            jets = [Jet(v, unit) for v, unit in zip(q.tolist(), UNITS, strict=True)]
            try:
                loads = net_loads(Doubles, c, self.model.law, tuple(jets), on)
            except (ArithmeticError, ValueError):
                return None
            F = np.array([Jet.of(v).value for v in loads], dtype=float)
            J = np.array([Jet.of(v).slopes for v in loads], dtype=float)
            if not (np.isfinite(F).all() and np.isfinite(J).all()):
                return None
            try:
                inverse = np.linalg.inv(J[:, :UNKNOWNS])
            except np.linalg.LinAlgError:
                return None
            step = inverse @ F
            q = q - step
            if np.all(np.abs(step) <= 1e-9 * np.max(np.abs(q))):  # the next one is rounding
                break
        return q, -inverse @ J[:, UNKNOWNS], inverse

    def _values(self, places: Sequence[Line], friction: Line, state: State) -> list[Ball]:
        """Loads (3) in one contact state."""
        on = tuple(int(touches) for touches in state)
        c = self._c._replace(mu=friction)
        loads = net_loads(Functions, c, self.model.law, tuple(places), on)
        return [_range(v) for v in loads]

    def _loads(
        self, places: Sequence[Any], friction: Any, state: State
    ) -> tuple[list[Ball], list[list[Ball]]]:
        """Loads (3) and their slopes (3, 4) by x, y, theta and mu in one contact state."""
        x, y, theta, mu = map(Jet, (*places, friction), (*UNITS, (0, 0, 0, 1)))
        c = self._c._replace(mu=mu)
        on = tuple(int(touches) for touches in state)
        loads = [Jet.of(v) for v in net_loads(Functions, c, self.model.law, (x, y, theta), on)]
        values = [_range(v.value) for v in loads]
        return values, [[_range(slope) for slope in v.slopes] for v in loads]

    def _matrices(self, places: Sequence[Line], friction: Line, state: State) -> Quadratic:
        """M, C and K over a box of places and an interval of friction, in one contact state."""
        _, slopes = self._loads(places, friction, state)
        K = _balls([[-row[j] for j in range(UNKNOWNS)] for row in slopes])
        damping = np.zeros((3, 3)) if self.model.damping is None else np.array(self.model.damping)
        rows = [[flint.arb(v) for v in row] for row in damping.tolist()]
        if self._fall is not None:
            share, rate = self._fall
            for i in range(3):
                rows[i][0] -= slopes[i][UNKNOWNS] * friction.ball() * share * rate
        pad = self.model.pad
        mass = np.diag([float(v) for v in (pad.m, pad.m, pad.I)])
        return Quadratic(Balls.exact(mass), _balls(rows), K, AS_GIVEN)


def _friction(low: float, high: float) -> Line:
    """Friction from low to high."""
    middle = flint.arb((low + high) / 2.0)
    ends = (flint.arb(low) - middle, flint.arb(high) - middle)
    farthest = np.nextafter(max(float(end.abs_upper()) for end in ends), np.inf)
    reach = flint.arb(0) if low == high else flint.arb(0, float(farthest))
    return Line(middle, flint.arb(1), flint.arb(0), reach)


def _range(x: Any) -> Ball:
    """All numbers of a `Line` or a ball."""
    return x.ball() if isinstance(x, Line) else flint.arb(x)


def _balls(rows: Sequence[Sequence[Ball]]) -> Balls:
    """A matrix of balls of doubles from one of `flint.arb`."""
    pairs = [[middle_and_radius(ball) for ball in row] for row in rows]
    both = np.array(pairs)
    return Balls(both[..., 0].copy(), both[..., 1].copy())
