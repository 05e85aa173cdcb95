"""The branch of a pad's equilibria over friction, followed from cell to cell.

It begins without friction. A cell (see `cells`) continues the last one where its box holds the
equilibrium that the last one has at its end. Where a gap vanishes both contact states have the same
loads, so that the curve goes on in the other state. Needs python-flint.
"""

from collections.abc import Iterator
from dataclasses import replace
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from squeal.model.contact import State
from squeal.model.equations import PadModel
from squeal.proof.balls import Ball, Floats, between, high_end, low_end, taylor_coefficients
from squeal.proof.cells import (
    OVERLAP,
    Cell,
    cell_about_origin,
    cell_around,
    enclosing_polynomials,
    equilibrium_near,
)
from squeal.proof.loads import FRICTION, Balance, other_unknowns
from squeal.proof.signs import first_with_sign, signs

try:
    import flint
except ImportError:  # an extra
    flint = None

CONTRACTION = 0.3
"""The width of a cell is chosen such that Krawczyk's operator contracts by about this factor."""
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
SHRINKING = 8.0
"""A cell around a bracketed change of contact is so many times as wide as the bracket."""
LOST = "the equilibrium is not enclosed"
UNRESOLVED = "the contact changes in a way that is not resolved"


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

        Sets `reason` where the branch is lost before its end, and `fold_at_contact` where it turns
        back at a change of contact.
        """
        if self.model.linear:
            yield cell_about_origin(self.balance, self.high)
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
            half_width = np.inf  # again, unless a change of contact limits it below
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
            # over all t at which the contact may change
            friction = cell.at(between(change.low, change.high))[FRICTION]
            if not self.is_sharp(friction, SHARPNESS_AT_CONTACT):
                # half the width of the narrower cell in t of this one, whose own is 1; times the
                # derivative of the unknowns by t it is a length along the curve
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
        gaps = self.balance.gaps([flint.arb(v) for v in self._start.tolist()])
        # the contact points whose gaps are negative touch
        state = State(*(float(gap.mid()) < 0.0 for gap in gaps))
        tangent = self._tangent(self._start, state)
        if tangent is None:
            return None
        if tangent[FRICTION] <= 0.0:
            tangent = -tangent
        return CurvePoint(self._start, state, tangent)

    def _position_at(self, cell: Cell, t: float) -> CurvePoint:
        """The point of the curve at a t of a cell."""
        return CurvePoint(equilibrium_near(self.balance, cell, t), cell.state, cell.direction(t))

    def _beyond_change(self, cell: Cell, change: ContactChange) -> CurvePoint | None:
        """The point of the curve behind a change of contact on a cell.

        None where several contact points change, or it is not known where the branch goes.
        """
        if len(change.points) != 1:
            return None
        changed = change.points[0]
        unknowns = equilibrium_near(self.balance, cell, change.high)
        state_beyond = cell.state.flip(changed)
        direction = self._direction_into_state(unknowns, state_beyond, changed)
        if direction is None:
            return None
        return CurvePoint(unknowns, state_beyond, direction)

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
        best = self._best_pivot(position)
        if best is None:
            return None
        pivot, widest_half = best
        sense = 1.0 if direction[pivot] > 0.0 else -1.0  # of the pivot along the branch
        # a multiple of `direction`, as `widest_half` is
        half_in_directions = min(widest_half, largest_half / float(np.linalg.norm(direction)))
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
            cell = cell_around(self.balance, point, pivot, middle, sense * half, state, least_box)
            if cell is not None:
                joined = _joined(cell, last)
                if joined is not None:
                    return joined
            half /= 2.0
        return None

    def _best_pivot(self, position: CurvePoint) -> tuple[int, float] | None:
        """The index of the unknown by which the curve is best parametrised, and half the width of
        the widest cell, in multiples of the direction; None if no unknown serves.

        The slopes of the loads are J at the point and J + h J' at the distance of h directions from
        it. There Krawczyk's operator with Y = J^-1 contracts by |1 - Y (J + h J')| = h |Y J'|, and
        its spectral radius is to be `CONTRACTION` at the half width h. Friction is preferred unless
        another unknown allows cells that are 1.2 times as wide.
        """
        point, state, direction = position  # unknowns (4,) and tangent (4,), see `CurvePoint`
        J = np.zeros((3, 4))
        J_change = np.zeros((3, 4))
        for row, jet in enumerate(self.balance.jets(_along(point, direction), state)):
            for column, slope in enumerate(jet.slopes):
                value, change = taylor_coefficients(slope, count=2)
                J[row, column] = float(value.mid())
                J_change[row, column] = float(change.mid())
        # half the width of a cell that ends just beyond the highest friction: 0.51, not 0.5, of the
        # friction that is left. With NARROWEST it is above 0 also at the highest friction
        to_end = np.inf
        if direction[FRICTION] > 0.0:
            friction_left = max(self.high - point[FRICTION], 0.0)
            to_end = (friction_left * 0.51 + NARROWEST) / direction[FRICTION]
        best: tuple[int, float] | None = None
        for pivot in (FRICTION, 0, 1, 2):
            others = other_unknowns(pivot)
            try:
                contraction = np.abs(np.linalg.solve(J[:, others], J_change[:, others]))
            except np.linalg.LinAlgError:
                continue
            if not np.isfinite(contraction).all() or direction[pivot] == 0.0:
                continue
            spectral_radius = float(np.max(np.abs(np.linalg.eigvals(contraction))))
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
        evaluated = self.balance.loads_and_slopes(point, state)
        if evaluated is None:
            return None
        _, J = evaluated
        null_vector = np.zeros(4)
        for i in range(4):
            null_vector[i] = (-1) ** i * np.linalg.det(J[:, other_unknowns(i)])
        largest = float(np.max(np.abs(null_vector)))
        if not (largest > 0.0 and np.isfinite(largest)):
            return None
        return null_vector / largest

    def _direction_into_state(self, point: Floats, state: State, changed: int) -> Floats | None:
        """The direction (4,) of the curve in which a gap gets the sign that the state requires.

        `changed`: the index of the contact point of this gap. None if the gap does not change
        along the curve.
        """
        tangent = self._tangent(point, state)
        if tangent is None:
            return None
        gap = self.balance.gaps(_along(point, tangent))[changed]
        # the coefficient of s in the gap at point + s tangent
        gap_slope = float(taylor_coefficients(gap, 2)[1].mid())
        if gap_slope == 0.0:
            return None
        gap_closes = gap_slope < 0.0
        has_to_close = state[changed]
        if gap_closes == has_to_close:
            return tangent
        return -tangent

    def _first_change(self, cell: Cell, same_state: bool) -> ContactChange | None:
        """Where a gap first loses the sign that the contact state requires, None if none does.

        First the interval of t is found in which each gap may change its sign; then the first of
        these intervals is joined with those that overlap it, as the gaps may change at the same t.

        same_state: whether the cell before has the contact state of this cell. If not, the gap
        whose change separates the two cells has no certain sign yet where this cell starts. Where
        friction is known sharply there, that is the old change and does not count; else it is
        returned, so that a narrower cell is placed around it.
        """
        changes: list[ContactChange] = []
        gaps = enclosing_polynomials(cell.centre, cell.radii, self.balance.gaps)
        for i, gap in enumerate(gaps):
            # the sign that the gap has in this state: negative where the point touches
            sign_of_state = -1 if cell.state[i] else 1
            pieces = signs(gap, cell.start, high=1.0)
            if not same_state and pieces[0].sign != sign_of_state:
                # this gap is the one that changed between the cells
                certain_from = first_with_sign(pieces, sign_of_state)
                friction = cell.at(between(cell.start, certain_from))[FRICTION]
                if not self.is_sharp(friction, SHARPNESS_BEYOND_CONTACT):
                    return ContactChange([i], cell.start, certain_from)
                pieces = [piece for piece in pieces if piece.low >= certain_from]
            lost = [piece for piece in pieces if piece.sign != sign_of_state]
            if lost:
                # where the gap has changed for certain
                high = first_with_sign(lost, -sign_of_state)
                changes.append(ContactChange([i], lost[0].low, high))
        first: ContactChange | None = None
        for change in sorted(changes, key=attrgetter("low")):
            if first is None:
                first = change
            elif change.low <= first.high:
                points = first.points + change.points
                first = ContactChange(points, first.low, max(first.high, change.high))
        return first

    def is_sharp(self, friction: Ball, times: float = 1.0) -> bool:
        """Whether a friction is known to `SHARP` of the range, or to so many times that."""
        return float(friction.rad()) <= times * SHARP * self.high


def _along(point: Floats, direction: Floats) -> list[Any]:
    """Series (4) of the unknowns to first order on the line from a point (4,) in a direction."""
    flint.ctx.cap = 2
    series = []
    for value, slope in zip(point.tolist(), direction.tolist(), strict=True):
        series.append(flint.arb_series([value, slope]))
    return series


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
