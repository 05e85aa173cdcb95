"""The referee on nonlinear pads: the model's own expressions over balls.

The sliding equilibrium q(mu) of F(q, mu) = 0 is enclosed over intervals of friction. With an
approximate equilibrium c at m, its approximate slope t and Y, about the inverse of J = dF/dq there,

    e -> -Y F(c + t (mu - m) + .., mu) + (1 - Y J) e

maps a box of deviations e from the line c + t (mu - m) into its interior (Krawczyk's operator):
then there is exactly one equilibrium in the box at each mu of the interval. Cells with such boxes
are joined where the box of one holds the equilibrium that the other has at their common friction.
Where a gap may be open or closed, F and J are the hulls of those of both contact states: F is
continuous and smooth in pieces, so that its slopes lie in the hull. K = -J over the box feeds the
enclosure of roots, one matrix for each state that is possible. Needs python-flint.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

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
UNKNOWNS = 3  # x, y, theta; the fourth slope is that by friction
INFLATED = 2.0  # boxes are so much wider than the first image of a point
ROUNDS = 8  # of inflation
NARROWEST = 1e-12  # of the range: a cell that is not halved
LOST = "the equilibrium is not enclosed"


@dataclass(frozen=True, slots=True)
class Jet:
    """A ball and its slopes by x, y, theta and mu."""

    value: Ball
    slopes: tuple[Ball, ...]

    @staticmethod
    def of(x: Any) -> Jet:
        """x itself, or a constant."""
        return x if isinstance(x, Jet) else Jet(x, (0, 0, 0, 0))

    def __add__(self, other: Any) -> Jet:
        other = Jet.of(other)
        slopes = tuple(a + b for a, b in zip(self.slopes, other.slopes, strict=True))
        return Jet(self.value + other.value, slopes)

    def __neg__(self) -> Jet:
        return Jet(-self.value, tuple(-a for a in self.slopes))

    def __sub__(self, other: Any) -> Jet:
        return self + (-Jet.of(other))

    def __rsub__(self, other: Any) -> Jet:
        return -self + other

    def __mul__(self, other: Any) -> Jet:
        other = Jet.of(other)
        pairs = zip(self.slopes, other.slopes, strict=True)
        slopes = tuple(a * other.value + self.value * b for a, b in pairs)
        return Jet(self.value * other.value, slopes)

    def __truediv__(self, other: Any) -> Jet:
        other = Jet.of(other)
        value = self.value / other.value
        pairs = zip(self.slopes, other.slopes, strict=True)
        return Jet(value, tuple((a - value * b) / other.value for a, b in pairs))

    def __rtruediv__(self, other: Any) -> Jet:
        return Jet.of(other) / self

    __radd__ = __add__
    __rmul__ = __mul__

    def applied(self, value: Ball, slope: Ball) -> Jet:
        """A function of it, from its value and its slope there."""
        return Jet(value, tuple(slope * a for a in self.slopes))


class Functions:
    """The functions that the model's expressions need, of balls and jets."""

    @staticmethod
    def sin(x: Any) -> Any:
        """The sine."""
        return x.applied(x.value.sin(), x.value.cos()) if isinstance(x, Jet) else _ball(x).sin()

    @staticmethod
    def cos(x: Any) -> Any:
        """The cosine."""
        return x.applied(x.value.cos(), -x.value.sin()) if isinstance(x, Jet) else _ball(x).cos()

    @staticmethod
    def sqrt(x: Any) -> Any:
        """The square root."""
        if not isinstance(x, Jet):
            return _ball(x).sqrt()
        root = x.value.sqrt()
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

    low, high: of friction; centre (3,): c, at `middle`; slope (3,): t; box: deviations from the
    line, three balls, that hold one equilibrium; image: narrower ones that hold it too.
    """

    low: float
    high: float
    middle: float
    centre: Floats
    slope: Floats
    box: tuple[Ball, ...]
    image: tuple[Ball, ...]

    def line(self, friction: Ball) -> tuple[Ball, ...]:
        """Where its middle line is."""
        shift = friction - self.middle
        return tuple(
            c + t * shift for c, t in zip(self.centre.tolist(), self.slope.tolist(), strict=True)
        )

    def places(self, friction: Ball) -> tuple[Ball, ...]:
        """Balls with the equilibrium."""
        return tuple(a + e for a, e in zip(self.line(friction), self.image, strict=True))

    def holds(self, other: Cell, mu: float) -> bool:
        """Whether the equilibrium of another cell at one friction is that of this one."""
        at = flint.arb(mu)
        for middle, box, place in zip(self.line(at), self.box, other.places(at), strict=True):
            if not (middle + box).contains(place):
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
        if not model.linear:
            self._join(np.asarray(start, float))

    def __call__(self, low: float, high: float) -> tuple[Quadratic, ...] | Failure:
        if self.model.linear:
            nowhere = (flint.arb(0), flint.arb(0), flint.arb(0))
            friction = flint.arb(low).union(flint.arb(high))
            return (self._matrices(nowhere, friction, self.model.full),)
        if low < self.low or high > (self.cells[-1].high if self.cells else self.low):
            return Failure(self.reason)
        systems: list[Quadratic] = []
        for cell in self.cells:
            a, b = max(low, cell.low), min(high, cell.high)
            if a > b or (a == b and low < high) or (systems and low == high):
                continue
            friction = flint.arb(a).union(flint.arb(b))
            place = self._part_of(cell, a, b).places(friction)
            for state in self._states(place):
                systems.append(self._matrices(place, friction, state))
        return tuple(systems)

    def _part_of(self, cell: Cell, low: float, high: float) -> Cell:
        """A cell of the same equilibria over a part of the interval."""
        middle = (low + high) / 2.0
        part = self._cell(low, high, cell.centre + cell.slope * (middle - cell.middle))
        return part if part is not None and cell.holds(part, low) else cell

    def _join(self, guess: Floats) -> None:
        """Cells from the lowest friction on, each of the branch of the one before."""
        mu = self.low
        width = self.high - self.low
        narrowest = NARROWEST * width
        while mu < self.high:
            width = min(width, self.high - mu)
            cell = self._cell(mu, mu + width, guess)
            if cell is not None and self._is_joined(cell):
                self.cells.append(cell)
                mu = cell.high
                guess = cell.centre + cell.slope * (mu - cell.middle)
                width *= 2.0
                continue
            width /= 2.0
            if width < narrowest:
                self.reason = f"{LOST} beyond {mu:.9g}"
                return

    def _is_joined(self, cell: Cell) -> bool:
        """Whether the cell holds the equilibrium that the last one has at its end."""
        if not self.cells:
            return True
        last = self.cells[-1]
        point = self._cell(cell.low, cell.low, last.centre + last.slope * (cell.low - last.middle))
        if point is None:
            return False
        return last.holds(point, cell.low) and cell.holds(point, cell.low)

    def _cell(self, low: float, high: float, guess: Floats) -> Cell | None:
        """A box with one equilibrium at each friction from low to high, None if none is found."""
        middle = (low + high) / 2.0
        found = self._newton(guess, middle)
        if found is None:
            return None
        centre, slope, inverse = found
        friction = flint.arb(low).union(flint.arb(high))
        shift = friction - middle
        line = tuple(c + t * shift for c, t in zip(centre.tolist(), slope.tolist(), strict=True))
        point = tuple(flint.arb(c) for c in centre.tolist())
        at_centre, _ = self._loads(point, flint.arb(middle))
        box = tuple(flint.arb(0) for _ in centre)
        for _ in range(ROUNDS):
            whole = tuple(a + e for a, e in zip(line, box, strict=True))
            _, slopes = self._loads(whole, friction)
            image = []
            for i in range(UNKNOWNS):
                ball = flint.arb(0)
                for k in range(UNKNOWNS):
                    y = inverse[i, k]
                    along = slopes[k][UNKNOWNS]
                    for j in range(UNKNOWNS):
                        along += slopes[k][j] * slope[j]
                    ball -= y * (at_centre[k] + along * shift)
                for j in range(UNKNOWNS):
                    unit = flint.arb(int(i == j))
                    for k in range(UNKNOWNS):
                        unit -= inverse[i, k] * slopes[k][j]
                    ball += unit * box[j]
                image.append(ball)
            if not all(ball.is_finite() for ball in image):
                return None
            if all(e.contains_interior(ball) for e, ball in zip(box, image, strict=True)):
                return Cell(low, high, middle, centre, slope, box, tuple(image))
            tiny = 1e-18 * float(np.max(np.abs(centre)) + 1e-12)
            box = tuple(_around_zero(INFLATED * float(ball.abs_upper()) + tiny) for ball in image)
        return None

    def _newton(self, guess: Floats, mu: float) -> tuple[Floats, Floats, Floats] | None:
        """An approximate equilibrium, its slope by friction and the inverse of J there."""
        q = guess
        friction = flint.arb(mu)
        for _ in range(12):
            values, slopes = self._loads(tuple(flint.arb(v) for v in q.tolist()), friction)
            F = np.array([float(v.mid()) for v in values])
            J = np.array([[float(v.mid()) for v in row] for row in slopes])
            if not (np.isfinite(F).all() and np.isfinite(J).all()):
                return None
            try:
                inverse = np.linalg.inv(J[:, :UNKNOWNS])
            except np.linalg.LinAlgError:
                return None
            step = inverse @ F
            q = q - step
            if np.all(np.abs(step) <= 1e-15 * np.max(np.abs(q))):
                break
        return q, -inverse @ J[:, UNKNOWNS], inverse

    def _loads_in(
        self, state: Sequence[bool], place: Sequence[Ball], friction: Ball
    ) -> tuple[list[Ball], list[list[Ball]]]:
        """Loads (3) and their slopes (3, 4) by x, y, theta and mu in one contact state."""
        unit = [[flint.arb(int(i == j)) for j in range(4)] for i in range(4)]
        q = tuple(Jet(ball, tuple(unit[i])) for i, ball in enumerate(place))
        c = self._c._replace(mu=Jet(friction, tuple(unit[UNKNOWNS])))
        on = tuple(int(touches) for touches in state)
        loads = [Jet.of(v) for v in net_loads(Functions, c, self.model.law, q, on)]
        values = [flint.arb(v.value) for v in loads]
        return values, [[flint.arb(slope) for slope in v.slopes] for v in loads]

    def _loads(self, place: Sequence[Ball], friction: Ball) -> tuple[list[Ball], list[list[Ball]]]:
        """The same, hulls over the contact states that are possible."""
        first, *others = self._states(place)
        values, slopes = self._loads_in(first, place, friction)
        for state in others:
            more, steeper = self._loads_in(state, place, friction)
            for i, value in enumerate(more):
                values[i] = values[i].union(value)
                slopes[i] = [a.union(b) for a, b in zip(slopes[i], steeper[i], strict=True)]
        return values, slopes

    def _states(self, place: Sequence[Ball]) -> list[tuple[bool, ...]]:
        """The contact states that are possible in a box of places."""
        gaps = self.model.law.gaps(self._c, pose(Functions, tuple(place)))
        possible = []
        for state in self.model.states:
            excluded = False
            for gap, touches in zip(gaps, state, strict=True):
                excluded |= bool(gap > 0) if touches else bool(gap < 0)
            if not excluded:
                possible.append(tuple(state))
        return possible

    def _matrices(self, place: Sequence[Ball], friction: Ball, state: Sequence[bool]) -> Quadratic:
        """M, C and K over a box of places and an interval of friction, in one contact state."""
        _, slopes = self._loads_in(state, place, friction)
        K = _balls([[-row[j] for j in range(UNKNOWNS)] for row in slopes])
        damping = np.zeros((3, 3)) if self.model.damping is None else np.array(self.model.damping)
        rows = [[flint.arb(v) for v in row] for row in damping.tolist()]
        if self._fall is not None:
            share, rate = self._fall
            for i in range(3):
                rows[i][0] -= slopes[i][UNKNOWNS] * friction * share * rate
        pad = self.model.pad
        mass = np.diag([float(v) for v in (pad.m, pad.m, pad.I)])
        return Quadratic(Balls.exact(mass), _balls(rows), K, AS_GIVEN)


def _around_zero(radius: float) -> Ball:
    return flint.arb(0, radius)


def _balls(rows: Sequence[Sequence[Ball]]) -> Balls:
    """A matrix of balls of doubles from one of `flint.arb`."""
    pairs = [[middle_and_radius(ball) for ball in row] for row in rows]
    both = np.array(pairs)
    return Balls(both[..., 0].copy(), both[..., 1].copy())
