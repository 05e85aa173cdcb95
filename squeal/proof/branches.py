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
from squeal.proof.balls import EPS, Floats, upper
from squeal.proof.jets import Doubles, Functions, Jet

try:
    import flint
except ImportError:  # an extra
    flint = None

Ball = Any
"""A `flint.arb`."""
Polynomial = Any
"""A `flint.arb_poly` in t."""
UNITS = ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))  # slopes of the unknowns
FRICTION = 3  # its number among the unknowns x, y, theta, mu
BITS = 106  # of the arithmetic: thresholds are known to all digits of a double
ORDER = 8  # of the Taylor polynomials
CONTRACTION = 0.3  # of boxes that widths aim at
ROUNDS = 4  # of wider boxes
OVERLAP = 1e-6  # of its half width: how far a cell begins before the end of the last one
NARROWEST = 1e-12  # of the first cell: a cell that is not halved
SHARP = 1e-14  # of friction: how well it is known where roots change
CONTACT = 10.0  # times that: where the contact changes, in the state before
CONTACT_BEYOND = 200.0  # the same in the state beyond
MOST_CELLS = 400
MOST_PARTS = 400  # of a cell in which signs are looked at
NEAR = 1e-13  # of t: what is not told apart
SHRINKING = 8.0  # a cell around a bracket is so many times as wide
LOST = "the equilibrium is not enclosed"
UNRESOLVED = "the contact changes in a way that is not resolved"


@dataclass(frozen=True, eq=False)
class Cell:
    """A part of the curve of equilibria: exactly one in a box at each |t| <= 1.

    state: which contact points touch; pivot: the unknown that is m + h t; middle, half: m and h;
    places (4): polynomials P(t); box (4,): how far from them no other equilibrium lies; loose (4,):
    how far from them the equilibrium may lie; slopes (3, 4): of F by the unknowns, polynomials;
    start, end: the part of t that belongs to the branch; opened: from which t on
    the next cell may hold instead.
    """

    state: State
    pivot: int
    middle: float
    half: float
    places: tuple[Polynomial, ...]
    box: Floats
    loose: Floats
    slopes: tuple[tuple[Polynomial, ...], ...]
    start: float = -1.0
    opened: float = 1.0
    end: float = 1.0

    def at(self, t: Ball) -> list[Ball]:
        """Balls (4) of the unknowns over a ball of t."""
        pairs = zip(self.places, self.loose.tolist(), strict=True)
        return [place(t) + flint.arb(0, loose) for place, loose in pairs]

    def direction(self, t: float) -> Floats:
        """About how the unknowns (4,) change with t."""
        return np.array([float(place.derivative()(t).mid()) for place in self.places])

    def share(self, value: Ball) -> Ball:
        """The t at which the pivot has a value."""
        return (value - self.middle) / self.half

    def holds(self, point: Sequence[Ball]) -> bool:
        """Whether its equilibria are those in a small box (4 balls) of the unknowns."""
        t = self.share(point[self.pivot])
        if not abs(t) <= 1:
            return False
        own = zip(self.places, self.box.tolist(), point, strict=True)
        for i, (place, reach, ball) in enumerate(own):
            if i != self.pivot and not flint.arb(0, reach).contains(ball - place(t)):
                return False
        return True


class PadBranch:
    """The equilibria of a pad along their branch.

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
        with flint.ctx.workprec(BITS):
            pad = _pad_of_balls(model.pad)
            self.fall = pad.fall
            self._c: Coefficients = coefficients(Functions, pad, model.law.absolute_gap)
        self._start = np.array([*np.asarray(start, float), low])
        self.reason = ""  # why the cells end below `high`, or before the branch turns back
        self.turn: tuple[float, float] | None = None  # where a change of contact turns it back

    def cells(self) -> Iterator[Cell]:
        """The cells from the lowest friction on, up to the highest or beyond a fold."""
        if self.model.linear:
            yield self._about_origin()
            return
        point = self._start
        x, y, theta = (flint.arb(v) for v in point[:3].tolist())
        gaps = self.model.law.gaps(self._c, pose(Functions, (x, y, theta)))
        state = State(*(float(gap.mid()) < 0.0 for gap in gaps))
        tangent = self._tangent(point, state)
        if tangent is None:
            self.reason = LOST
            return
        ahead = tangent if tangent[FRICTION] > 0.0 else -tangent
        last: Cell | None = None
        limit = np.inf  # of a half width, along the curve
        for _ in range(MOST_CELLS):
            cell = self._next(point, state, ahead, limit, last)
            if cell is None:
                self.reason = f"{LOST} beyond mu = {point[FRICTION]:.9g}"
                return
            limit = np.inf
            change = self._first_change(cell, last is None or last.state == state)
            if change is None:
                yield cell
                last = cell
                point = self._near(cell, 1.0)
                ahead = cell.direction(1.0)
                if point[FRICTION] > self.high or ahead[FRICTION] <= 0.0:
                    return
                continue
            points, low, high = change
            if cell.direction(low)[FRICTION] <= 0.0:
                yield replace(cell, end=low)
                return
            there = cell.at(_between(low, high))
            friction = float(there[FRICTION].mid())
            if not self.is_sharp(there[FRICTION], CONTACT):
                # a narrow cell around it knows better where it is
                share = min(SHRINKING * (high - low), 0.5)
                limit = share * float(np.linalg.norm(cell.direction(low)))
                if low > cell.start:
                    last = replace(cell, opened=low, end=low)
                    yield last
                    point = self._near(cell, low)
                ahead = cell.direction(low)
                continue
            turned = None
            if len(points) == 1:
                state = state.flip(points[0])
                point = self._near(cell, high)
                turned = self._beyond(point, state, points[0])
            if turned is None:
                self.reason = f"{UNRESOLVED} near mu = {friction:.9g}"
                return
            last = replace(cell, opened=low, end=high)
            yield last
            ahead = turned
            if ahead[FRICTION] <= 0.0:
                self.turn = (float(there[FRICTION].lower()), float(there[FRICTION].upper()))
                return
        self.reason = f"{LOST} beyond mu = {point[FRICTION]:.9g} within {MOST_CELLS} cells"

    def _next(
        self,
        point: Floats,
        state: State,
        ahead: Floats,
        limit: float,
        last: Cell | None,
    ) -> Cell | None:
        """A cell from a point on that is as wide as possible, None if there is none.

        ahead (4,): the direction of the curve; limit: of the half width, along it; last: the cell
        to be continued.
        """
        chosen = self._pivot(point, state, ahead)
        if chosen is None:
            return None
        pivot, widest = chosen
        turn = 1.0 if ahead[pivot] > 0.0 else -1.0
        half = min(widest, limit / float(np.linalg.norm(ahead)))
        half *= abs(ahead[pivot])
        narrowest = NARROWEST * half
        wide = 1e-15 * np.abs(point)  # points are doubles
        if last is not None and last.state != state:
            entry = last.at(_between(last.opened, last.end))
            radii = np.array([float(ball.rad()) for ball in entry])
            wide += 16.0 * (radii + radii[pivot] * np.abs(ahead / ahead[pivot]))
            half = max(half, SHRINKING * float(wide[pivot]))
        while half > max(narrowest, wide[pivot]):
            h = turn * half
            overlap = max(OVERLAP * half, wide[pivot])
            middle = point[pivot] + turn * (half - overlap)
            try:
                cell = self._cell(point, pivot, middle, h, state, wide)
            except (ArithmeticError, ValueError):  # a ball to be divided by holds zero
                cell = None
            joined = None if cell is None else _joined(cell, last)
            if joined is not None:
                return joined
            half /= 2.0
        return None

    def _pivot(self, point: Floats, state: State, ahead: Floats) -> tuple[int, float] | None:
        """The unknown by which the curve is best parametrised, and half of the width of a cell in
        multiples of `ahead`."""
        flint.ctx.cap = 2
        pairs = zip(point.tolist(), ahead.tolist(), strict=True)
        series = [flint.arb_series([value, slope]) for value, slope in pairs]
        jets = self._jets(series, state)
        entries = [[_coefficients(slope, 2) for slope in jet.slopes] for jet in jets]
        J = np.array([[float(c[0].mid()) for c in row] for row in entries])
        change = np.array([[float(c[1].mid()) for c in row] for row in entries])
        best: tuple[int, float] | None = None
        to_end = max(self.high - point[FRICTION], 0.0) * 0.51 + NARROWEST
        most = to_end / ahead[FRICTION] if ahead[FRICTION] > 0.0 else np.inf
        for pivot in (FRICTION, 0, 1, 2):
            others = [i for i in range(4) if i != pivot]
            try:
                turned = np.abs(np.linalg.solve(J[:, others], change[:, others]))
            except np.linalg.LinAlgError:
                continue
            if not np.isfinite(turned).all() or not ahead[pivot]:
                continue
            rate = float(np.max(np.abs(np.linalg.eigvals(turned))))
            half = CONTRACTION / rate if rate > 0.0 else np.inf
            half = min(half, most)
            if np.isfinite(half) and (best is None or half > 1.2 * best[1]):
                best = (pivot, half)
        return best

    def _tangent(self, point: Floats, state: State) -> Floats | None:
        """The direction of the curve, of either sign."""
        jets = self._doubles(point, state)
        if jets is None:
            return None
        J = jets[1]
        columns = [np.delete(J, i, axis=1) for i in range(4)]
        cross = np.array([(-1) ** i * np.linalg.det(X) for i, X in enumerate(columns)])
        largest = float(np.max(np.abs(cross)))
        return cross / largest if largest > 0.0 and np.isfinite(largest) else None

    def _beyond(self, point: Floats, state: State, changed: int) -> Floats | None:
        """The direction of the curve in which the gap of a point gets the sign of the state."""
        tangent = self._tangent(point, state)
        if tangent is None:
            return None
        pairs = zip(point.tolist(), tangent.tolist(), strict=True)
        flint.ctx.cap = 2
        x, y, theta, _ = (flint.arb_series([a, b]) for a, b in pairs)
        gap = self.model.law.gaps(self._c, pose(Functions, (x, y, theta)))[changed]
        rise = float(_coefficients(gap, 2)[1].mid())
        if rise == 0.0:
            return None
        return tangent if (rise < 0.0) == state[changed] else -tangent

    def _first_change(self, cell: Cell, settled: bool) -> tuple[list[int], float, float] | None:
        """The contact points whose gaps do not have the sign of the state from a first t on, that t
        and one from which on they have the other; None if there are none.

        Unless `settled` the signs may be open in the beginning.
        """
        law = self.model.law

        def gaps(u: Sequence[Any]) -> list[Any]:
            return list(law.gaps(self._c, pose(Functions, tuple(u[:FRICTION]))))

        found: tuple[list[int], float, float] | None = None
        for i, gap in enumerate(self._polynomials(cell.places, cell.loose, gaps)):
            right = -1 if cell.state[i] else 1
            pieces = signs(gap, cell.start, 1.0)
            if not settled and pieces[0].sign != right:
                first = next((piece.low for piece in pieces if piece.sign == right), 1.0)
                there = cell.at(_between(cell.start, first))[FRICTION]
                if not self.is_sharp(there, CONTACT_BEYOND):
                    return [i], cell.start, first
                pieces = [piece for piece in pieces if piece.low >= first]
            wrong = next((k for k, piece in enumerate(pieces) if piece.sign != right), None)
            if wrong is None:
                continue
            low = pieces[wrong].low
            beyond = [piece.low for piece in pieces[wrong:] if piece.sign == -right]
            high = beyond[0] if beyond else 1.0
            if found is None or low < found[1]:
                found = ([i], low, high)
            elif low <= found[2]:
                found = ([*found[0], i], found[1], max(high, found[2]))
        return found

    def is_sharp(self, friction: Ball, times: float = 1.0) -> bool:
        """Whether a place is known as well as it has to be, or so many times worse."""
        return float(friction.rad()) <= times * SHARP * self.high

    def _cell(
        self, guess: Floats, pivot: int, middle: float, half: float, state: State, wide: Floats
    ) -> Cell | None:
        """A cell around a value of the pivot, None if no box is mapped into itself.

        wide (4,): how far its box reaches at least.
        """
        others = [i for i in range(4) if i != pivot]
        found = self._newton(guess, pivot, middle, state)
        if found is None:
            return None
        point, Y = found
        places = self._taylor(point, pivot, half, state, Y)
        exact = np.zeros(4)
        loads = self._polynomials(places, exact, lambda u: list(self._loads(u, state)))
        miss = [_largest(_combined(row, loads)) for row in Y.tolist()]
        least = 1e-18 * np.abs(point[others]) + wide[others]
        box = 2.0 * np.array(miss) + least
        for _ in range(ROUNDS):
            if not np.isfinite(box).all():
                return None
            loose = np.zeros(4)
            loose[others] = box
            slopes = self._slopes(places, loose, state)
            turned = np.zeros((3, 3))
            for i, row in enumerate(Y.tolist()):
                for j, unknown in enumerate(others):
                    product = _combined(row, [slopes[k][unknown] for k in range(3)])
                    turned[i, j] = _largest(int(i == j) - product)
            image = upper(np.array(miss) + turned @ box, 8)
            if np.all(image < box):
                reach = loose.copy()
                loose[others] = image
                return Cell(state, pivot, middle, half, places, reach, loose, slopes)
            if not np.all(image < 2.0 * box):
                return None
            box = 2.0 * image
        return None

    def narrow(self, cell: Cell, middle: float, half: float) -> Cell | None:
        """A narrower cell of the same equilibria, None if there is none."""
        t = flint.arb((middle - cell.middle) / cell.half)
        guess = np.array([float(place(t).mid()) for place in cell.places])
        try:
            narrow = self._cell(guess, cell.pivot, middle, half, cell.state, np.zeros(4))
        except (ArithmeticError, ValueError):  # a ball to be divided by holds zero
            return None
        if narrow is None or not cell.holds(narrow.at(flint.arb(0))):
            return None
        return narrow

    def _near(self, cell: Cell, t: float) -> Floats:
        """The unknowns (4,) at a place of a cell, to rounding."""
        guess = np.array([float(ball.mid()) for ball in cell.at(flint.arb(t))])
        found = self._newton(guess, cell.pivot, float(guess[cell.pivot]), cell.state)
        return guess if found is None else found[0]

    def _newton(
        self, guess: Floats, pivot: int, value: float, state: State
    ) -> tuple[Floats, Floats] | None:
        """An approximate equilibrium (4,) and the inverse of the slopes by the other unknowns."""
        others = [i for i in range(4) if i != pivot]
        point = guess.copy()
        point[pivot] = value
        for _ in range(12):
            jets = self._doubles(point, state)
            if jets is None:
                return None
            F, J = jets
            try:
                Y = np.linalg.inv(J[:, others])
            except np.linalg.LinAlgError:
                return None
            step = Y @ F
            point[others] -= step
            if np.all(np.abs(step) <= 1e-9 * np.abs(point[others]) + 1e-300):
                return point, np.asarray(Y, float)  # the next step is rounding
        return None

    def _taylor(
        self, point: Floats, pivot: int, half: float, state: State, Y: Floats
    ) -> tuple[Polynomial, ...]:
        """Approximate polynomials of the unknowns in t."""
        known = [[flint.arb(value)] for value in point.tolist()]
        others = [i for i in range(4) if i != pivot]
        for order in (0, 0, *range(1, ORDER + 1)):  # the place itself is made more precise first
            if order:
                for i, coefficients in enumerate(known):
                    coefficients.append(flint.arb(half if i == pivot and order == 1 else 0))
            flint.ctx.cap = order + 1
            series = [flint.arb_series(coefficients) for coefficients in known]
            loads = self._loads(series, state)
            miss = [_coefficients(load, order + 1)[order].mid() for load in loads]
            for i, row in zip(others, Y.tolist(), strict=True):
                shift = sum((y * one for y, one in zip(row, miss, strict=True)), flint.arb(0))
                known[i][order] = (known[i][order] - shift).mid()
        return tuple(flint.arb_poly(coefficients) for coefficients in known)

    def _about_origin(self) -> Cell:
        """The only cell of a linear model."""
        half = (self.high - self.low) / 2.0
        middle = self.low + half
        half *= 1.0 + OVERLAP
        places = (flint.arb_poly([0]),) * FRICTION + (flint.arb_poly([middle, half]),)
        loose = np.zeros(4)
        state = self.model.full
        slopes = self._slopes(places, loose, state)
        return Cell(state, FRICTION, middle, half, places, loose, loose, slopes)

    def _doubles(self, point: Floats, state: State) -> tuple[Floats, Floats] | None:
        """Loads (3,) and their slopes (3, 4), approximate."""
        jets = [Jet(v, unit) for v, unit in zip(point.tolist(), UNITS, strict=True)]
        on = tuple(int(touches) for touches in state)
        c = self.model.c._replace(mu=jets[FRICTION])
        try:
            loads = net_loads(Doubles, c, self.model.law, tuple(jets[:FRICTION]), on)
        except (ArithmeticError, ValueError):
            return None
        F = np.array([Jet.of(v).value for v in loads], dtype=float)
        J = np.array([Jet.of(v).slopes for v in loads], dtype=float)
        return (F, J) if np.isfinite(F).all() and np.isfinite(J).all() else None

    def _loads(self, unknowns: Sequence[Any], state: State) -> tuple[Any, ...]:
        """Loads (3) of balls, series or jets of the unknowns in one contact state."""
        on = tuple(int(touches) for touches in state)
        c = self._c._replace(mu=unknowns[FRICTION])
        return net_loads(Functions, c, self.model.law, tuple(unknowns[:FRICTION]), on)

    def _jets(self, unknowns: Sequence[Any], state: State) -> list[Jet]:
        """The same with slopes by the unknowns."""
        jets = [Jet(u, unit) for u, unit in zip(unknowns, UNITS, strict=True)]
        return [Jet.of(load) for load in self._loads(jets, state)]

    def _slopes(
        self, places: tuple[Polynomial, ...], loose: Floats, state: State
    ) -> tuple[tuple[Polynomial, ...], ...]:
        """Slopes (3, 4) of the loads by the unknowns over a tube around polynomials."""

        def entries(u: Sequence[Any]) -> list[Any]:
            return [slope for jet in self._jets(u, state) for slope in jet.slopes]

        every = self._polynomials(places, loose, entries)
        return tuple(tuple(every[4 * i : 4 * i + 4]) for i in range(3))

    def _polynomials(
        self,
        places: tuple[Polynomial, ...],
        loose: Floats,
        function: Callable[[list[Any]], list[Any]],
    ) -> list[Polynomial]:
        """Polynomials in t of what a function gives over a tube around polynomials, see above."""
        radii = [flint.arb(0, r) for r in loose.tolist()]
        flint.ctx.cap = ORDER
        series = [flint.arb_series(p.coeffs()) + r for p, r in zip(places, radii, strict=True)]
        near = function(series)
        flint.ctx.cap = ORDER + 1
        everywhere = flint.arb_poly([flint.arb(0, 1), 1])
        shifted = [flint.arb_series(p(everywhere).coeffs()) for p in places]
        over = function([s + r for s, r in zip(shifted, radii, strict=True)])
        polynomials = []
        for a, b in zip(near, over, strict=True):
            known = _coefficients(a, ORDER)
            polynomials.append(flint.arb_poly([*known, _coefficients(b, ORDER + 1)[ORDER]]))
        return polynomials


def _joined(cell: Cell, last: Cell | None) -> Cell | None:
    """A cell from where the branch enters it, None if it need not go on from the last one."""
    if last is None:
        return cell
    entry = last.at(_between(last.opened, last.end))
    if cell.holds(entry):
        start = float(cell.share(entry[cell.pivot]).lower())
        return replace(cell, start=max(start, -1.0))
    if last.state == cell.state and last.holds(cell.at(flint.arb(-1))):
        return cell
    return None


def _pad_of_balls(pad: Pad) -> Pad:
    """The pad with its numbers as exact balls."""
    new = copy(pad)
    for name, value in pad.given().items():
        vars(new)[name] = flint.arb(float(value))
    return new


def _coefficients(x: Any, count: int) -> list[Ball]:
    """So many coefficients of a series, or of a constant."""
    known = x.coeffs() if isinstance(x, flint.arb_series) else [flint.arb(x)]
    return known[:count] + [flint.arb(0)] * (count - len(known))


def _combined(factors: Sequence[float], polynomials: Sequence[Polynomial]) -> Polynomial:
    """The sum of polynomials times factors."""
    total = flint.arb_poly([0])
    for factor, polynomial in zip(factors, polynomials, strict=True):
        total = total + polynomial * factor
    return total


def _largest(polynomial: Polynomial) -> float:
    """A bound of the absolute values over |t| <= 1."""
    total = sum((c.abs_upper() for c in polynomial.coeffs()), flint.arb(0))
    return float(np.nextafter(float(total.abs_upper()), np.inf))


def _between(low: float, high: float) -> Ball:
    """A ball that holds two numbers."""
    return flint.arb(low).union(flint.arb(high))


class Sign(NamedTuple):
    """The sign 1 or -1 of a function from one t to another, 0 where it is not known."""

    low: float
    high: float
    sign: int


def signs(polynomial: Polynomial, low: float, high: float) -> list[Sign]:
    """The signs of a polynomial with balls as coefficients, from one |t| <= 1 to another.

    It differs from D, the polynomial of the midpoints, by at most `miss`, the sum of the radii.
    Where D is monotonic it is settled by its ends.
    """
    known = polynomial.coeffs()
    D = flint.arb_poly([c.mid() for c in known])
    miss = sum((c.rad() for c in known), flint.arb(0))
    pieces: list[Sign] = []
    waiting = [(low, high)]
    for _ in range(MOST_PARTS):
        if not waiting:
            break
        a, b = waiting.pop()
        found = _signs_of_part(D, miss, a, b)
        if found is None:
            middle = (a + b) / 2.0
            waiting += [(middle, b), (a, middle)]
            continue
        pieces += found
    pieces += [Sign(a, b, 0) for a, b in waiting[::-1]]
    joined: list[Sign] = []
    for piece in pieces:
        if joined and joined[-1].sign == piece.sign:
            joined[-1] = Sign(joined[-1].low, piece.high, piece.sign)
        elif piece.high > piece.low:
            joined.append(piece)
    return joined


def _signs_of_part(D: Polynomial, miss: Ball, low: float, high: float) -> list[Sign] | None:
    """The signs of a part; None if it has to be halved."""
    middle = (low + high) / 2.0
    half = (high - low) / 2.0 * (1.0 + 4.0 * EPS) + EPS
    own = D(flint.arb_poly([middle, half])).coeffs()
    sizes = [abs(c) for c in own]
    rest = sum(sizes[1:], flint.arb(0))
    if not own or sizes[0] + rest <= miss:
        return [Sign(low, high, 0)]
    if sizes[0] - rest > miss:
        return [Sign(low, high, 1 if own[0] > 0 else -1)]
    bends = sum((k * size for k, size in enumerate(sizes) if k > 1), flint.arb(0))
    if len(own) > 1 and sizes[1] > bends:
        return _signs_between(D, miss, low, high)
    return [Sign(low, high, 0)] if high - low < NEAR else None


def _signs_between(D: Polynomial, miss: Ball, low: float, high: float) -> list[Sign]:
    """The signs of a part in which D is monotonic."""

    def sign_at(t: float) -> int:
        value = D(flint.arb(t))
        return 1 if value > miss else -1 if value < -miss else 0

    first = sign_at(low)
    last = sign_at(high)
    if first == last:
        return [Sign(low, high, first)]
    pieces = []
    ends = []
    for sign, inside, outside in ((first, low, high), (last, high, low)):
        while sign:
            t = (inside + outside) / 2.0
            if t in (inside, outside):
                break
            if sign_at(t) == sign:
                inside = t
            else:
                outside = t
        ends.append(inside)
    pieces = [Sign(low, ends[0], first), Sign(ends[0], ends[1], 0), Sign(ends[1], high, last)]
    return [piece for piece in pieces if piece.high > piece.low]
