"""The equilibria of a pad over friction, enclosed along their curve.

The sliding equilibria solve F(u) = 0 of u = (x, y, theta, mu), three equations of four unknowns. In
a cell one of these, s = m + h t with |t| <= 1, parametrises the curve, so that a fold is a place as
any other. With polynomials P(t) that approximate the other three and Y, about the inverse of the
slopes J of F by them,

    e -> -Y F(P(t)) + (1 - Y J(P(t) + box)) e

maps a box of deviations e from P(t) into its interior (Krawczyk's operator) at each t: then there
is exactly one equilibrium in the box at each t. F, J and all that follows from them are Taylor
polynomials in t whose last coefficient is a ball: the coefficient of that order is taken over all
base points of the cell, which is Lagrange's remainder. Cells are joined where the box of one holds
the equilibrium that the other has at its end.

Within a cell F is that of one contact state. Where a gap vanishes both states have the same loads,
so that the curve goes on in the other state. Needs python-flint.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from squeal.model.contact import State
from squeal.model.equations import PadModel, net_loads
from squeal.model.pad import Coefficients, Pad, coefficients, pose
from squeal.proof.balls import Ball, Floats, between, high_end, low_end, taylor_coefficients, upper
from squeal.proof.jets import Doubles, Functions, Jet
from squeal.proof.signs import Polynomial, first_with_sign, signs

try:
    import flint
except ImportError:  # an extra
    flint = None

UNIT_SLOPES = ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))
"""Slopes of the unknowns x, y, theta and mu by themselves."""
FRICTION = 3
"""The index of mu among the unknowns x, y, theta, mu."""
BITS = 106
"""Precision of the arithmetic: twice that of a double, so that thresholds are known to all its
digits."""
TAYLOR_ORDER = 8
"""Degree of the Taylor polynomials in t; their coefficient of this order is Lagrange's ball."""
CONTRACTION = 0.3
"""The width of a cell is chosen such that Krawczyk's operator contracts by about this factor."""
MOST_BOXES = 4
"""How many boxes, each wider than the last, are tried for a cell."""
OVERLAP = 1e-6
"""How far a cell begins before the end of the last one, as a share of its half width."""
NARROWEST = 1e-12
"""A cell is halved until it is this share of the width first tried."""
SHARP = 1e-14
"""The friction of a change of the roots is known once its radius is this share of the range."""
SHARPNESS_AT_CONTACT = 10.0
"""Where the contact changes: so many times `SHARP`, in a cell of the state before it."""
SHARPNESS_BEYOND_CONTACT = 200.0
"""Where the contact changes, in a cell of the state beyond, whose boxes are wider."""
MOST_CELLS = 400
"""After so many cells the branch counts as lost."""
ULPS = 8.0
"""A narrow cell extends at least so many units in the last place of its middle to both sides."""
SHRINKING = 8.0
"""A cell around a bracketed change of contact is so many times as wide as the bracket."""
LOST = "the equilibrium is not enclosed"
UNRESOLVED = "the contact changes in a way that is not resolved"


@dataclass(frozen=True, eq=False)
class Cell:
    """A part of the curve of equilibria: at each |t| <= 1 exactly one lies in a box around P(t).

    Attributes
    ----------
    state : State
        Which contact points touch.
    pivot : int
        The index of the unknown that parametrises the cell, m + h t.
    middle, half : float
        m and h; h is negative where the unknown falls along the branch.
    centre : tuple of 4 polynomials
        P(t), approximately the equilibrium.
    unique_within : ndarray (4,)
        How far from P(t) no second equilibrium lies.
    radii : ndarray (4,)
        How far from P(t) the equilibrium may lie.
    slopes : (3, 4) polynomials
        Slopes of the loads F by the unknowns, over the whole tube.
    start, end : float
        The interval of t that belongs to the branch.
    overlap_from : float
        From this t on the next cell may hold the equilibrium instead.
    """

    state: State
    pivot: int
    middle: float
    half: float
    centre: tuple[Polynomial, ...]
    unique_within: Floats
    radii: Floats
    slopes: tuple[tuple[Polynomial, ...], ...]
    start: float = -1.0
    overlap_from: float = 1.0
    end: float = 1.0

    def at(self, t: Ball) -> list[Ball]:
        """Balls (4) that hold the unknowns at all t of a ball."""
        pairs = zip(self.centre, self.radii.tolist(), strict=True)
        return [polynomial(t) + flint.arb(0, radius) for polynomial, radius in pairs]

    def at_end(self) -> list[Ball]:
        """Balls (4) of the unknowns where the next cell takes over."""
        return self.at(between(self.overlap_from, self.end))

    def direction(self, t: float) -> Floats:
        """Derivatives (4,) of the unknowns by t, approximate."""
        return np.array([float(p.derivative()(t).mid()) for p in self.centre])

    def t_of(self, value: Ball) -> Ball:
        """The t at which the pivot has a value."""
        return (value - self.middle) / self.half

    def holds(self, point: Sequence[Ball]) -> bool:
        """Whether an equilibrium in a small box (4 balls) of the unknowns is one of this cell.

        It is if the box lies where the cell has no second equilibrium.
        """
        t = self.t_of(point[self.pivot])
        if not abs(t) <= 1:
            return False
        for i in _other_unknowns(self.pivot):
            deviation = point[i] - self.centre[i](t)
            if not flint.arb(0, float(self.unique_within[i])).contains(deviation):
                return False
        return True


class CurvePoint(NamedTuple):
    """A point of the curve of equilibria, approximately, and how the curve goes on from it.

    unknowns (4,): x, y, theta and mu; state: the contact state from there on; direction (4,): the
    tangent of the curve, along the branch, its largest entry about 1.
    """

    unknowns: Floats
    state: State
    direction: Floats


class ContactChange(NamedTuple):
    """Where in a cell the contact changes.

    points: the contact points whose gaps change their sign; low: up to this t the state of the cell
    holds; high: from this t on the gaps have the other sign (1 where they do not reach it).
    """

    points: list[int]
    low: float
    high: float


class Balance:
    """Loads and gaps of a pad, of balls, series or jets of the unknowns x, y, theta and mu.

    Raises ImportError without python-flint.
    """

    def __init__(self, model: PadModel) -> None:
        if flint is None:
            raise ImportError("pads need python-flint", name="flint")
        self.law = model.law
        with flint.ctx.workprec(BITS):
            pad = pad_of_balls(model.pad)
            self.fall = pad.fall
            """The friction that falls with the sliding speed, as `Pad.fall`."""
            # the surface lies at the distance of the absolute gap or not, by the contact law
            self.c: Coefficients = coefficients(Functions, pad, model.law.absolute_gap)

    def gaps(self, unknowns: Sequence[Any]) -> list[Any]:
        """The gaps of the contact points."""
        return list(self.law.gaps(self.c, pose(Functions, tuple(unknowns[:FRICTION]))))

    def loads(self, unknowns: Sequence[Any], state: State) -> tuple[Any, ...]:
        """Loads (3), two forces and a moment, in one contact state."""
        c = self.c._replace(mu=unknowns[FRICTION])
        return net_loads(Functions, c, self.law, tuple(unknowns[:FRICTION]), factors_of(state))

    def jets(self, unknowns: Sequence[Any], state: State) -> list[Jet]:
        """Loads (3) in one contact state with their slopes by the unknowns."""
        jets = [Jet(u, unit) for u, unit in zip(unknowns, UNIT_SLOPES, strict=True)]
        return [Jet.of(load) for load in self.loads(jets, state)]


class PadBranch:
    """The equilibria of a pad along their branch.

    Parameters
    ----------
    model : PadModel
        The pad and its contact model.
    start : array_like (3,)
        An approximate equilibrium (x, y, theta) without friction; the branch through it is meant.
    high : float
        The friction up to which the branch is followed.

    Raises
    ------
    ImportError
        Without python-flint.
    """

    def __init__(self, model: PadModel, start: ArrayLike, high: float) -> None:
        self.model = model
        self.high = high
        self.balance = Balance(model)
        self._start = np.array([*np.asarray(start, float), 0.0])
        self.reason = ""
        """Why the enclosure stopped early: below `high`, before the branch turned back."""
        self.fold_at_contact: tuple[float, float] | None = None
        """The interval of friction in which a change of contact turns the branch back."""

    def cells(self) -> Iterator[Cell]:
        """The cells from no friction on, up to the highest or beyond a fold.

        A cell without a change of contact is yielded whole. Else it ends at the first change:

        - where it encloses the friction of the change too widely, the part before the change is
          yielded, and the next cell is a narrower one around the change;
        - else the part up to the change is, and the branch goes on in the new contact state.
        """
        if self.model.linear:
            yield self._about_origin()
            return
        position = self._first_position()
        if position is None:
            self.reason = LOST
            return
        last: Cell | None = None  # which the next cell continues
        half_width = np.inf  # of the next cell at most, as a length along the curve
        for _ in range(MOST_CELLS):
            cell = self._next_cell(position, half_width, last)
            if cell is None:
                self.reason = f"{LOST} beyond mu = {position.unknowns[FRICTION]:.9g}"
                return
            half_width = np.inf
            same_state = last is None or last.state == position.state
            change = self._first_change(cell, same_state)
            if change is None:
                yield cell
                last = cell
                position = self._position_at(cell, t=1.0)
                is_at_end = position.unknowns[FRICTION] > self.high
                if is_at_end or position.direction[FRICTION] <= 0.0:
                    return
                continue
            if cell.direction(change.low)[FRICTION] <= 0.0:
                # a fold comes before the change of contact
                yield replace(cell, end=change.low)
                return
            friction = cell.at(between(change.low, change.high))[FRICTION]
            if not self.is_sharp(friction, SHARPNESS_AT_CONTACT):
                share = min(SHRINKING * (change.high - change.low), 0.5)
                half_width = share * float(np.linalg.norm(cell.direction(change.low)))
                if change.low > cell.start:
                    last = replace(cell, overlap_from=change.low, end=change.low)
                    yield last
                    position = self._position_at(cell, change.low)
                else:
                    # nothing of the cell lies before the change: the narrower cell starts where
                    # this one did
                    position = position._replace(direction=cell.direction(change.low))
                continue
            beyond = self._beyond_change(cell, change)
            if beyond is None:
                self.reason = f"{UNRESOLVED} near mu = {float(friction.mid()):.9g}"
                return
            position = beyond
            last = replace(cell, overlap_from=change.low, end=change.high)
            yield last
            if position.direction[FRICTION] <= 0.0:
                self.fold_at_contact = low_end(friction), high_end(friction)
                return
        reached = position.unknowns[FRICTION]
        self.reason = f"{LOST} beyond mu = {reached:.9g} within {MOST_CELLS} cells"

    def _first_position(self) -> CurvePoint | None:
        """The start of the branch, from which friction rises; None without a tangent."""
        state = self._contact_state(self._start)
        tangent = self._tangent(self._start, state)
        if tangent is None:
            return None
        if tangent[FRICTION] <= 0.0:
            tangent = -tangent
        return CurvePoint(self._start, state, tangent)

    def _position_at(self, cell: Cell, t: float) -> CurvePoint:
        """The point of the curve at a t of a cell."""
        return CurvePoint(self._equilibrium_near(cell, t), cell.state, cell.direction(t))

    def _beyond_change(self, cell: Cell, change: ContactChange) -> CurvePoint | None:
        """The point of the curve behind a change of contact on a cell.

        None where several contact points change, or it is not known where the branch goes.
        """
        if len(change.points) != 1:
            return None
        changed = change.points[0]
        unknowns = self._equilibrium_near(cell, change.high)
        state_beyond = cell.state.flip(changed)
        direction = self._direction_into_state(unknowns, state_beyond, changed)
        if direction is None:
            return None
        return CurvePoint(unknowns, state_beyond, direction)

    def _contact_state(self, point: Floats) -> State:
        """Which contact points touch at a point (4,): those whose gaps are negative."""
        gaps = self.balance.gaps([flint.arb(v) for v in point.tolist()])
        return State(*(float(gap.mid()) < 0.0 for gap in gaps))

    def _next_cell(
        self, position: CurvePoint, largest_half: float, last: Cell | None
    ) -> Cell | None:
        """The widest cell that starts at a point; None if none continues the last cell.

        It is halved until Krawczyk's operator contracts and the cell joins the last one.

        Parameters
        ----------
        position : CurvePoint
            Where the cell starts.
        largest_half : float
            The largest half width, as a length along the curve.
        last : Cell or None
            The cell to be continued.
        """
        point, state, direction = position
        chosen = self._best_pivot(position)
        if chosen is None:
            return None
        pivot, widest = chosen
        sense = 1.0 if direction[pivot] > 0.0 else -1.0  # of the pivot along the branch
        half_in_directions = min(widest, largest_half / float(np.linalg.norm(direction)))
        half = half_in_directions * abs(direction[pivot])  # in units of the pivot
        narrowest = NARROWEST * half
        least_box = 1e-15 * np.abs(point)  # points are doubles
        if last is not None and last.state != state:
            # the change of contact is known up to balls, and the box has to hold them: their radii,
            # and how far the curve moves while the pivot crosses its ball, radii[pivot] times the
            # slopes of the curve. 16 times as much leaves Krawczyk's operator room
            radii = np.array([float(ball.rad()) for ball in last.at_end()])
            least_box += 16.0 * (radii + radii[pivot] * np.abs(direction / direction[pivot]))
            half = max(half, SHRINKING * float(least_box[pivot]))
        while half > max(narrowest, least_box[pivot]):
            overlap = max(OVERLAP * half, least_box[pivot])
            middle = point[pivot] + sense * (half - overlap)  # the cell begins before the point
            cell = self._cell_around(point, pivot, middle, sense * half, state, least_box)
            if cell is not None:
                joined = _joined(cell, last)
                if joined is not None:
                    return joined
            half /= 2.0
        return None

    def _best_pivot(self, position: CurvePoint) -> tuple[int, float] | None:
        """The index of the unknown by which the curve is best parametrised, and half the width of a
        cell, in multiples of the direction; None if no unknown serves.

        The slopes of the loads are J at the point and J + h J' at the distance of h directions from
        it. There Krawczyk's operator with Y = J^-1 contracts by |1 - Y (J + h J')| = h |Y J'|, and
        its spectral radius is to be `CONTRACTION` at the half width h. Friction is preferred unless
        another unknown allows cells that are 1.2 times as wide.
        """
        point, state, direction = position
        J = np.zeros((3, 4))
        J_change = np.zeros((3, 4))
        for row, jet in enumerate(self.balance.jets(_along(point, direction), state)):
            for column, slope in enumerate(jet.slopes):
                value, change = taylor_coefficients(slope, count=2)
                J[row, column] = float(value.mid())
                J_change[row, column] = float(change.mid())
        # half of a cell that reaches just beyond the highest friction; above 0 also at the end
        to_end = np.inf
        if direction[FRICTION] > 0.0:
            friction_left = max(self.high - point[FRICTION], 0.0)
            to_end = (friction_left * 0.51 + NARROWEST) / direction[FRICTION]
        best: tuple[int, float] | None = None
        for pivot in (FRICTION, 0, 1, 2):
            others = _other_unknowns(pivot)
            try:
                departure = np.abs(np.linalg.solve(J[:, others], J_change[:, others]))
            except np.linalg.LinAlgError:
                continue
            if not np.isfinite(departure).all() or direction[pivot] == 0.0:
                continue
            spectral_radius = float(np.max(np.abs(np.linalg.eigvals(departure))))
            half = to_end
            if spectral_radius > 0.0:
                half = min(CONTRACTION / spectral_radius, to_end)
            if np.isfinite(half) and (best is None or half > 1.2 * best[1]):
                best = (pivot, half)
        return best

    def _tangent(self, point: Floats, state: State) -> Floats | None:
        """The direction (4,) of the curve, of either sign; None if it is not defined.

        It is the null vector of the slopes J (3, 4), by Cramer's rule: entry i is (-1)^i times the
        determinant of J without column i.
        """
        evaluated = self._loads_and_slopes(point, state)
        if evaluated is None:
            return None
        _, J = evaluated
        null_vector = np.zeros(4)
        for i in range(4):
            null_vector[i] = (-1) ** i * np.linalg.det(J[:, _other_unknowns(i)])
        largest = float(np.max(np.abs(null_vector)))
        if not (largest > 0.0 and np.isfinite(largest)):
            return None
        return null_vector / largest

    def _direction_into_state(self, point: Floats, state: State, changed: int) -> Floats | None:
        """The direction (4,) of the curve in which a gap gets the sign that the state asks for.

        `changed`: the index of the contact point of this gap. None if the gap does not change
        along the curve.
        """
        tangent = self._tangent(point, state)
        if tangent is None:
            return None
        gap = self.balance.gaps(_along(point, tangent))[changed]
        gap_slope = float(taylor_coefficients(gap, 2)[1].mid())
        if gap_slope == 0.0:
            return None
        gap_closes = gap_slope < 0.0
        has_to_close = state[changed]
        if gap_closes == has_to_close:
            return tangent
        return -tangent

    def _first_change(self, cell: Cell, same_state: bool) -> ContactChange | None:
        """Where a gap first loses the sign that the contact state asks of it, None if none does.

        Gaps that may do so at the same t are one change. same_state: whether the cell before has
        the contact state of this cell. If not, the gap whose change separates the two cells has no
        certain sign yet where this cell starts. Where friction is known sharply there, that is the
        old change and does not count; else it is returned, so that a narrower cell is laid around
        it.
        """
        first: ContactChange | None = None
        gaps = self._enclosing_polynomials(cell.centre, cell.radii, self.balance.gaps)
        for i, gap in enumerate(gaps):
            sign_of_state = -1 if cell.state[i] else 1  # -1: touching, the gap is negative
            pieces = signs(gap, cell.start, high=1.0)
            if not same_state and pieces[0].sign != sign_of_state:
                # this gap is the one that changed between the cells
                certain_from = first_with_sign(pieces, sign_of_state)
                friction = cell.at(between(cell.start, certain_from))[FRICTION]
                if not self.is_sharp(friction, SHARPNESS_BEYOND_CONTACT):
                    return ContactChange([i], cell.start, certain_from)
                pieces = [piece for piece in pieces if piece.low >= certain_from]
            lost = [piece for piece in pieces if piece.sign != sign_of_state]
            if not lost:
                continue
            low = lost[0].low
            high = first_with_sign(lost, -sign_of_state)  # where the gap has changed for certain
            if first is None or low < first.low:
                first = ContactChange([i], low, high)
            elif low <= first.high:
                first = ContactChange([*first.points, i], first.low, max(high, first.high))
        return first

    def is_sharp(self, friction: Ball, times: float = 1.0) -> bool:
        """Whether a friction is known to `SHARP` of the range, or to so many times that."""
        return float(friction.rad()) <= times * SHARP * self.high

    def _cell_around(
        self, guess: Floats, pivot: int, middle: float, half: float, state: State, least_box: Floats
    ) -> Cell | None:
        """A cell around a value `middle` of the pivot, None if no box is mapped into itself.

        guess (4,): an approximate equilibrium there; least_box (4,): the least half widths of the
        box.
        """
        try:
            return self._cell_by_krawczyk(guess, pivot, middle, half, state, least_box)
        except (ArithmeticError, ValueError):  # a ball to be divided by holds zero
            return None

    def _cell_by_krawczyk(
        self, guess: Floats, pivot: int, middle: float, half: float, state: State, least_box: Floats
    ) -> Cell | None:
        """A cell by Krawczyk's operator: the box is widened until its image lies within.

        Deviations from the polynomials P within a box (half widths b) are mapped to deviations of
        at most |Y F(P)| + |1 - Y J(P + box)| b, bounds over all |t| <= 1. Where that is below b the
        box holds exactly one equilibrium at each t, within the image. Arguments as of
        `_cell_around`. Raises ArithmeticError or ValueError where a ball to be divided by holds
        zero.
        """
        others = _other_unknowns(pivot)
        newton = self._newton(guess, pivot, middle, state)
        if newton is None:
            return None
        point, Y = newton
        centre = self._taylor_polynomials(point, pivot, half, state, Y)
        loads = self._enclosing_polynomials(
            centre, np.zeros(4), lambda u: list(self.balance.loads(u, state))
        )
        residuals = np.array(
            [_absolute_bound(_linear_combination(row, loads)) for row in Y.tolist()]
        )  # |Y F(P)|
        # twice the residuals, so that the image can lie within; never 0
        box = 2.0 * residuals + (1e-18 * np.abs(point[others]) + least_box[others])
        for _ in range(MOST_BOXES):
            if not np.isfinite(box).all():
                return None
            radii = np.zeros(4)
            radii[others] = box
            slopes = self._slope_polynomials(centre, radii, state)
            contraction = np.zeros((3, 3))  # |1 - Y J|
            for i, row in enumerate(Y.tolist()):
                for j, unknown in enumerate(others):
                    product = _linear_combination(row, [slopes[k][unknown] for k in range(3)])
                    contraction[i, j] = _absolute_bound(int(i == j) - product)
            image = upper(residuals + contraction @ box, 8)
            if np.all(image < box):
                radii_of_image = np.zeros(4)
                radii_of_image[others] = image
                return Cell(
                    state=state,
                    pivot=pivot,
                    middle=middle,
                    half=half,
                    centre=centre,
                    unique_within=radii,
                    radii=radii_of_image,
                    slopes=slopes,  # over the box, hence over the image within it
                )
            if not np.all(image < 2.0 * box):  # too far for a wider box to catch it
                return None
            box = 2.0 * image
        return None

    def narrow(self, cell: Cell, middle: float, half: float) -> Cell | None:
        """A narrower cell of the same equilibria, None if none is proved to hold the same ones.

        middle, half: of the narrower cell, in units of the pivot. The middle is rounded to a
        double, so that a cell as narrow as this rounding could miss what it has to cover: half is
        at least `ULPS` units in the last place of the middle.
        """
        half = float(np.copysign(max(abs(half), ULPS * np.spacing(abs(middle))), half))
        t = flint.arb((middle - cell.middle) / cell.half)
        guess = np.array([float(polynomial(t).mid()) for polynomial in cell.centre])
        narrow = self._cell_around(guess, cell.pivot, middle, half, cell.state, np.zeros(4))
        if narrow is None or not cell.holds(narrow.at(flint.arb(0))):
            return None
        return narrow

    def _equilibrium_near(self, cell: Cell, t: float) -> Floats:
        """The unknowns (4,) at a t of a cell, to rounding."""
        guess = np.array([float(ball.mid()) for ball in cell.at(flint.arb(t))])
        newton = self._newton(guess, cell.pivot, float(guess[cell.pivot]), cell.state)
        if newton is None:
            return guess
        return newton[0]

    def _newton(
        self, guess: Floats, pivot: int, value: float, state: State
    ) -> tuple[Floats, Floats] | None:
        """Newton's method with the pivot held at a value: an approximate equilibrium (4,) and Y
        (3, 3), the inverse of the slopes by the other unknowns. None if it fails."""
        others = _other_unknowns(pivot)
        point = guess.copy()
        point[pivot] = value
        for _ in range(12):
            evaluated = self._loads_and_slopes(point, state)
            if evaluated is None:
                return None
            F, J = evaluated
            try:
                Y = np.linalg.inv(J[:, others])
            except np.linalg.LinAlgError:
                return None
            step = Y @ F
            point[others] -= step
            # the next step, of quadratic convergence, is rounding
            if np.all(np.abs(step) <= 1e-9 * np.abs(point[others]) + 1e-300):
                return point, np.asarray(Y, float)
        return None

    def _taylor_polynomials(
        self, point: Floats, pivot: int, half: float, state: State, Y: Floats
    ) -> tuple[Polynomial, ...]:
        """Approximate Taylor polynomials (4) of the unknowns in t.

        Newton's method order by order: once F(P(t)) vanishes below an order, the coefficients of P
        of this order change by -Y times the coefficient of F(P(t)) of this order. Order 0 comes
        twice: the point has the digits of a double, and each step doubles them. The pivot is not
        solved for: it is point[pivot] + half t.
        """
        terms = [[flint.arb(value)] for value in point.tolist()]
        for order in (0, 0, *range(1, TAYLOR_ORDER + 1)):
            if order:
                for unknown_terms in terms:
                    unknown_terms.append(flint.arb(0))
            if order == 1:
                terms[pivot][1] = flint.arb(half)
            flint.ctx.cap = order + 1
            series = [flint.arb_series(unknown_terms) for unknown_terms in terms]
            loads = self.balance.loads(series, state)
            residuals = [taylor_coefficients(load, order + 1)[order].mid() for load in loads]
            for i, row in zip(_other_unknowns(pivot), Y.tolist(), strict=True):
                shift = flint.arb(0)
                for factor, residual in zip(row, residuals, strict=True):
                    shift += factor * residual
                terms[i][order] = (terms[i][order] - shift).mid()
        return tuple(map(flint.arb_poly, terms))

    def _about_origin(self) -> Cell:
        """The only cell of a linear model, whose equilibrium is the origin at all frictions."""
        middle = self.high / 2.0
        half = middle * (1.0 + OVERLAP)
        centre = (flint.arb_poly([0]),) * FRICTION + (flint.arb_poly([middle, half]),)
        radii = np.zeros(4)
        state = self.model.full
        slopes = self._slope_polynomials(centre, radii, state)
        return Cell(
            state=state,
            pivot=FRICTION,
            middle=middle,
            half=half,
            centre=centre,
            unique_within=radii,
            radii=radii,
            slopes=slopes,
        )

    def _loads_and_slopes(self, point: Floats, state: State) -> tuple[Floats, Floats] | None:
        """Loads F (3,), two forces and a moment, and their slopes J (3, 4) by x, y, theta and mu.

        In doubles, for Newton's method and tangents, which prove nothing. The contact state is that
        given, whatever the gaps. None where a load is not finite.
        """
        unknowns = [Jet(v, unit) for v, unit in zip(point.tolist(), UNIT_SLOPES, strict=True)]
        touches = factors_of(state)
        c = self.model.c._replace(mu=unknowns[FRICTION])  # doubles; `balance` has the same as balls
        try:
            loads = net_loads(Doubles, c, self.model.law, tuple(unknowns[:FRICTION]), touches)
        except (ArithmeticError, ValueError):  # a pole, or a root of a negative number
            return None
        jets = [Jet.of(load) for load in loads]  # one that no unknown moves is a number
        F = np.array([jet.value for jet in jets], dtype=float)
        J = np.array([jet.slopes for jet in jets], dtype=float)
        if not (np.isfinite(F).all() and np.isfinite(J).all()):
            return None
        return F, J

    def _slope_polynomials(
        self, centre: tuple[Polynomial, ...], radii: Floats, state: State
    ) -> tuple[tuple[Polynomial, ...], ...]:
        """Slopes (3, 4) of the loads by the unknowns over a tube around polynomials."""

        def entries(u: Sequence[Any]) -> list[Any]:
            slopes: list[Any] = []
            for jet in self.balance.jets(u, state):
                slopes += jet.slopes
            return slopes

        row_by_row = self._enclosing_polynomials(centre, radii, entries)
        return tuple(tuple(row_by_row[4 * i : 4 * i + 4]) for i in range(3))

    def _enclosing_polynomials(
        self,
        centre: tuple[Polynomial, ...],
        radii: Floats,
        function: Callable[[list[Any]], list[Any]],
    ) -> list[Polynomial]:
        """Taylor polynomials in t that enclose a function over the tube P(t) + radii (4,).

        The terms below `TAYLOR_ORDER` are those about t = 0. The term of that order is taken about
        all |t| <= 1 at once, which makes it Lagrange's remainder.

        function: the list of its values from series (4) of the unknowns.
        """
        flint.ctx.cap = TAYLOR_ORDER
        about_zero = function(_tube(centre, radii))
        flint.ctx.cap = TAYLOR_ORDER + 1
        any_base_point = flint.arb_poly([flint.arb(0, 1), 1])  # t0 + t for all |t0| <= 1
        about_all = function(_tube([p(any_base_point) for p in centre], radii))
        polynomials = []
        for low_orders, all_orders in zip(about_zero, about_all, strict=True):
            remainder = taylor_coefficients(all_orders, TAYLOR_ORDER + 1)[TAYLOR_ORDER]
            below = taylor_coefficients(low_orders, TAYLOR_ORDER)
            polynomials.append(flint.arb_poly([*below, remainder]))
        return polynomials


def _tube(polynomials: Sequence[Polynomial], radii: Floats) -> list[Any]:
    """Series (4) of polynomials, each with a ball of its radius (4,) added."""
    series = []
    for polynomial, radius in zip(polynomials, radii.tolist(), strict=True):
        series.append(flint.arb_series(polynomial.coeffs()) + flint.arb(0, radius))
    return series


def _along(point: Floats, direction: Floats) -> list[Any]:
    """Series (4) of the unknowns to first order on the line from a point (4,) in a direction."""
    flint.ctx.cap = 2
    series = []
    for value, slope in zip(point.tolist(), direction.tolist(), strict=True):
        series.append(flint.arb_series([value, slope]))
    return series


def factors_of(state: State) -> tuple[int, ...]:
    """1 of each contact point that touches, 0 of the others: factors of their forces."""
    return tuple(int(touches) for touches in state)


def _other_unknowns(unknown: int) -> list[int]:
    """The indices of the three other unknowns."""
    return [i for i in range(4) if i != unknown]


def _joined(cell: Cell, last: Cell | None) -> Cell | None:
    """A cell from where the branch enters it, None if it need not continue the last one.

    It does if it holds the equilibrium at the end of the last cell, or the last one holds that at
    the start of this cell.
    """
    if last is None:
        return cell
    entry = last.at_end()
    if cell.holds(entry):
        return replace(cell, start=max(low_end(cell.t_of(entry[cell.pivot])), -1.0))
    if last.state == cell.state and last.holds(cell.at(flint.arb(-1))):
        return cell
    return None


def pad_of_balls(pad: Pad) -> Pad:
    """The pad with its numbers as exact balls."""
    new = copy(pad)
    for name, value in pad.given().items():
        vars(new)[name] = flint.arb(float(value))
    return new


def _linear_combination(factors: Sequence[float], polynomials: Sequence[Polynomial]) -> Polynomial:
    """The sum of polynomials times factors."""
    total = flint.arb_poly([0])
    for factor, polynomial in zip(factors, polynomials, strict=True):
        total = total + polynomial * factor
    return total


def _absolute_bound(polynomial: Polynomial) -> float:
    """A bound of the absolute values of a polynomial over |t| <= 1."""
    total = sum((c.abs_upper() for c in polynomial.coeffs()), flint.arb(0))
    return float(np.nextafter(float(total.abs_upper()), np.inf))
