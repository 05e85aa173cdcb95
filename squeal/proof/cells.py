"""Cells of the curve of a pad's equilibria: boxes that hold exactly one at each point.

The sliding equilibria solve F(u) = 0 of u = (x, y, theta, mu), three equations of four unknowns. In
a cell one of these, s = m + h t with |t| <= 1, parametrises the curve, so that a fold is a point as
any other. With polynomials P(t) that approximate the other three and Y, about the inverse of the
slopes J of F by them,

    e -> -Y F(P(t)) + (1 - Y J(P(t) + box)) e

maps a box of deviations e from P(t) into its interior (Krawczyk's operator) at each t: then there
is exactly one equilibrium in the box at each t. F, J and all that follows from them are Taylor
polynomials in t whose last coefficient is a ball: the coefficient of that order is taken over all
base points of the cell, which is Lagrange's remainder. Within a cell F is that of one contact
state. Needs python-flint.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from squeal.model.contact import State
from squeal.proof.balls import Ball, Floats, between, high_end, taylor_coefficients, upper
from squeal.proof.loads import FRICTION, Balance, other_unknowns
from squeal.proof.signs import Polynomial

try:
    import flint
except ImportError:  # an extra
    flint = None

TAYLOR_ORDER = 8
"""Degree of the Taylor polynomials in t; their coefficient of this order is Lagrange's ball."""
MOST_BOXES = 4
"""How many boxes, each wider than the last, are tried for a cell."""
OVERLAP = 1e-6
"""How far a cell begins before the end of the last one, as a share of its half width."""
ULPS = 8.0
"""A narrow cell extends at least so many units in the last place of its middle to both sides."""


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
        for i in other_unknowns(self.pivot):
            deviation = point[i] - self.centre[i](t)
            if not flint.arb(0, float(self.unique_within[i])).contains(deviation):
                return False
        return True


def cell_around(
    balance: Balance,
    guess: Floats,
    pivot: int,
    middle: float,
    half: float,
    state: State,
    least_box: Floats,
) -> Cell | None:
    """A cell around a value `middle` of the pivot by Krawczyk's operator, None if there is none.

    Deviations from the polynomials P within a box (half widths b) are mapped to deviations of at
    most |Y F(P)| + |1 - Y J(P + box)| b, bounds over all |t| <= 1. Where that is below b the box
    holds exactly one equilibrium at each t, within the image. Else a wider box is tried.

    guess (4,): an approximate equilibrium there; least_box (4,): the least half widths of the box.
    """
    with suppress(ArithmeticError, ValueError):  # a ball to be divided by holds zero
        others = other_unknowns(pivot)
        newton = _newton(balance, guess, pivot, middle, state)
        if newton is None:
            return None
        point, Y = newton
        centre = _taylor_polynomials(balance, point, pivot, half, state, Y)
        loads = enclosing_polynomials(centre, np.zeros(4), lambda u: balance.loads(u, state))
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
            slopes = _slope_polynomials(balance, centre, radii, state)
            contraction = np.zeros((3, 3))  # |1 - Y J|
            for i, row in enumerate(Y.tolist()):
                for j, unknown in enumerate(others):
                    product = _linear_combination(row, [slopes[k][unknown] for k in range(3)])
                    contraction[i, j] = _absolute_bound(int(i == j) - product)
            image = upper(residuals + contraction @ box, 8)  # 8 is more than its 4 terms
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


def cell_about_origin(balance: Balance, high: float) -> Cell:
    """The only cell of a linear model, from friction 0 to `high`; the equilibrium is the origin.

    The origin is exact: as boxes around it `radii` and `unique_within` have no width.
    """
    middle = high / 2.0
    half = middle * (1.0 + OVERLAP)
    # polynomials in t: x = y = theta = 0 and mu = middle + half t
    centre = (flint.arb_poly([0]),) * 3 + (flint.arb_poly([middle, half]),)
    radii = np.zeros(4)
    state = balance.model.full
    slopes = _slope_polynomials(balance, centre, radii, state)
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


def narrower_cell(balance: Balance, cell: Cell, middle: float, half: float) -> Cell | None:
    """A narrower cell of the same equilibria, None if none is proved to hold the same ones.

    middle, half: of the narrower cell, in units of the pivot. The middle is rounded to a
    double, so that a cell as narrow as this rounding could miss what it has to cover: half is at
    least `ULPS` units in the last place of the middle.
    """
    half = float(np.copysign(max(abs(half), ULPS * np.spacing(abs(middle))), half))
    t = flint.arb((middle - cell.middle) / cell.half)
    guess = np.array([float(polynomial(t).mid()) for polynomial in cell.centre])
    narrower_cell = cell_around(balance, guess, cell.pivot, middle, half, cell.state, np.zeros(4))
    if narrower_cell is None or not cell.holds(narrower_cell.at(flint.arb(0))):
        return None
    return narrower_cell


def equilibrium_near(balance: Balance, cell: Cell, t: float) -> Floats:
    """The unknowns (4,) at a t of a cell, to rounding."""
    guess = np.array([float(ball.mid()) for ball in cell.at(flint.arb(t))])
    newton = _newton(balance, guess, cell.pivot, float(guess[cell.pivot]), cell.state)
    if newton is None:
        return guess
    return newton[0]


def _newton(
    balance: Balance, guess: Floats, pivot: int, value: float, state: State
) -> tuple[Floats, Floats] | None:
    """Newton's method from a guess (4,) with the pivot held at a value: an approximate equilibrium
    (4,) and Y (3, 3), the inverse of the slopes by the other unknowns. None if it fails."""
    others = other_unknowns(pivot)
    point = guess.copy()
    point[pivot] = value
    for _ in range(12):  # quadratic convergence from a close guess takes fewer steps
        evaluated = balance.loads_and_slopes(point, state)
        if evaluated is None:
            return None
        F, J = evaluated
        try:
            Y = np.linalg.inv(J[:, others])
        except np.linalg.LinAlgError:
            return None
        step = Y @ F
        point[others] -= step
        # the next step, of quadratic convergence, is rounding; 1e-300 is for unknowns that are 0
        if np.all(np.abs(step) <= 1e-9 * np.abs(point[others]) + 1e-300):
            return point, np.asarray(Y, float)
    return None


def _taylor_polynomials(
    balance: Balance, point: Floats, pivot: int, half: float, state: State, Y: Floats
) -> tuple[Polynomial, ...]:
    """Approximate Taylor polynomials (4) of the unknowns in t about a point (4,); Y (3, 3).

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
        loads = balance.loads(series, state)
        residuals = [taylor_coefficients(load, order + 1)[order].mid() for load in loads]
        for i, row in zip(other_unknowns(pivot), Y.tolist(), strict=True):
            shift = flint.arb(0)
            for factor, residual in zip(row, residuals, strict=True):
                shift += factor * residual
            terms[i][order] = (terms[i][order] - shift).mid()
    return tuple(map(flint.arb_poly, terms))


def _slope_polynomials(
    balance: Balance, centre: tuple[Polynomial, ...], radii: Floats, state: State
) -> tuple[tuple[Polynomial, ...], ...]:
    """Slopes (3, 4) of the loads by the unknowns over a tube around polynomials."""

    def entries(u: Sequence[Any]) -> list[Any]:
        slopes: list[Any] = []
        for jet in balance.jets(u, state):
            slopes += jet.slopes
        return slopes

    row_by_row = enclosing_polynomials(centre, radii, entries)
    return tuple(tuple(row_by_row[4 * i : 4 * i + 4]) for i in range(3))


def enclosing_polynomials(
    centre: tuple[Polynomial, ...],
    radii: Floats,
    function: Callable[[list[Any]], Sequence[Any]],
) -> list[Polynomial]:
    """Taylor polynomials in t that enclose a function over the tube P(t) + radii (4,).

    The terms below `TAYLOR_ORDER` are those about t = 0. The term of that order is taken about
    all |t| <= 1 at once, which makes it Lagrange's remainder.

    centre: the four polynomials P(t) of x, y, theta and mu; function: gives its values, such as the
    gaps, as series in t from the series of the four.
    """
    flint.ctx.cap = TAYLOR_ORDER  # series of flint have so many terms
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


def _linear_combination(factors: Sequence[float], polynomials: Sequence[Polynomial]) -> Polynomial:
    """The sum of polynomials times factors."""
    total = flint.arb_poly([0])
    for factor, polynomial in zip(factors, polynomials, strict=True):
        total += polynomial * factor
    return total


def _absolute_bound(polynomial: Polynomial) -> float:
    """A bound of the absolute values of a polynomial over |t| <= 1."""
    return high_end(sum((c.abs_upper() for c in polynomial.coeffs()), flint.arb(0)))
