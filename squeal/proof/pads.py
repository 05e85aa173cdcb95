"""The referee on pads: what grows along the whole branch of equilibria, and where it changes.

The number of growing roots is constant along a part of the branch on which no root can reach the
imaginary axis: where det K, and the discriminant of det(K - s M) in s = -lambda^2 of a pad without
damping, have no zero. With damping, Hurwitz's last determinant but one takes the place of the
discriminant; by Orlando's formula it is the product of the sums of all pairs of roots, up to a
factor. On each part the roots are counted once, by signs of coefficients. det K vanishes where the
branch turns back.

Along each cell of `branches` all of these are polynomials whose coefficients are balls. Where their
signs stay open the cell is narrowed, down to the digits of doubles.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np

from squeal.proof import AS_GIVEN
from squeal.proof.balls import (
    Ball,
    Balls,
    Quadratic,
    between,
    high_end,
    in_doubles,
    low_end,
)
from squeal.proof.branches import PadBranch
from squeal.proof.cells import TAYLOR_ORDER, Cell, narrower_cell
from squeal.proof.loads import BITS, FRICTION
from squeal.proof.pieces import growing_counts
from squeal.proof.ranges import CANCELS
from squeal.proof.signs import NARROWEST_PART, Polynomial, Sign, signs

try:
    import flint
except ImportError:  # an extra
    flint = None

DEGREE_IN_T = 2 * TAYLOR_ORDER
"""Degree of polynomials along a cell; higher powers become part of a ball."""
SAME_SHARE = 1e-8
"""A printed threshold is a change of the count that lies within this share of the friction, or of
a thousandth of the range where the friction is less."""
NARROWINGS = 9
"""How often a cell is narrowed where signs stay open."""
SLOW = 0.25
"""An open part that is more than this share of what was examined makes its narrowing slow."""
COST_OF_SLOW = 3
"""A slow narrowing uses up so many of the `NARROWINGS`."""
WIDE = 0.1
"""An open interval of t wider than this is halved before its cell is narrowed."""
COEFFICIENTS_OPEN = "what grows cannot be counted"
TOUCHES = "roots meet without crossing the axis"
WIDE_EVENT = 1e-3
"""A share of the range of friction: a threshold is not known to an interval that is wider."""
WIDE_THRESHOLD = "a threshold is not enclosed closely"
WIDE_FOLD = "the friction at which the branch turns back is not enclosed closely"


@dataclass(frozen=True)
class Claim:
    """A printed threshold: friction, and by how much the number of growing roots rises."""

    mu: float
    rise: int


@dataclass(frozen=True)
class PadProof:
    """What is proved of a pad.

    Attributes
    ----------
    status : str
        `proved`, `open` or `refuted`.
    until : float
        The friction up to which the list is proved.
    intervals : tuple of (float, float)
        For each claim up to `until` the interval of friction in which it is proved.
    growth_below : float
        No root beyond those counted grows faster up to `until`, 1/s.
    reason, where : str, float or None
        Why the list is open or refuted, or is not proved beyond `until`, and at which friction.
    """

    status: Literal["proved", "open", "refuted"]
    until: float
    intervals: tuple[tuple[float, float], ...] = ()
    growth_below: float = 0.0
    reason: str = ""
    where: float | None = None


class Problem(NamedTuple):
    """Why a list is not proved: open or refuted, for which reason, at which friction."""

    status: Literal["open", "refuted"]
    reason: str
    where: float


class Part(NamedTuple):
    """A part low <= t <= high of a cell: no root reaches the imaginary axis in it, or it is open.

    growing: how many roots grow, None where a sign is open; det_K_is_open: whether that of det K is
    among the open signs.
    """

    cell: Cell
    low: float
    high: float
    growing: int | None
    det_K_is_open: bool = False

    @property
    def is_open(self) -> bool:
        """True if a sign is open, so that what grows is not known."""
        return self.growing is None

    @property
    def friction(self) -> Ball:
        """The friction over all t of the part."""
        return self.cell.at(between(self.low, self.high))[FRICTION]


@dataclass
class Event:
    """An interval of friction in which the number of growing roots may change.

    low, high: of friction; before, after: numbers of growing roots on both sides of it; open_parts:
    the parts in it, whose signs are open; is_fold: whether the branch turns back in it.
    """

    low: float
    high: float
    before: int
    after: int
    open_parts: Sequence[Part]
    is_fold: bool = False


def prove_pad(
    branch: PadBranch,
    claims: Sequence[Claim],
    fold: float | None,
    first_loss: float | None,
    growth_below: float,
) -> PadProof:
    """Whether the number of growing roots changes at the claimed thresholds and nowhere else.

    The list is proved up to `until` of the result, mostly the end of the branch. A list that is
    open from there on counts as proved if `until` lies beyond the first loss of stability; `reason`
    then says why the rest is open.

    Parameters
    ----------
    branch : PadBranch
        The equilibria, over the whole range.
    claims : sequence of Claim
        The printed thresholds, ascending.
    fold : float or None
        The friction at which the branch is said to turn back.
    first_loss : float or None
        The printed first loss of stability.
    growth_below : float
        A rate, 1/s, above 0. Where roots meet without crossing the axis it is shown only that they
        grow more slowly than this; elsewhere the result says 0.
    """
    comparison = _BranchComparison(branch, claims, fold, growth_below)
    # how many terms a series of flint has: a setting of the process that `branch.cells()` changes
    terms_of_series = flint.ctx.cap
    try:
        with flint.ctx.workprec(BITS):
            problem = comparison.first_problem()
    finally:
        flint.ctx.cap = terms_of_series
    proof = PadProof(
        status="proved",
        until=comparison.until,
        intervals=tuple(comparison.intervals),
        growth_below=growth_below if comparison.roots_met else 0.0,
    )
    if problem is None:
        return proof
    # a list that is open only beyond the first loss stays proved
    if problem.status == "refuted" or first_loss is None or comparison.until <= first_loss:
        proof = replace(proof, status=problem.status)
    return replace(proof, reason=problem.reason, where=problem.where)


class _BranchComparison:
    """The counts of growing roots along the branch against the claims, up to the end of the branch
    or to what is open or refuted.

    Attributes
    ----------
    unmet : list of Claim
        The claims beyond what was compared so far.
    until : float
        The friction reached.
    intervals : list of (float, float)
        The intervals of friction in which claims were met.
    roots_met : bool
        Whether roots meet somewhere without crossing the axis.
    """

    def __init__(
        self, branch: PadBranch, claims: Sequence[Claim], fold: float | None, growth_below: float
    ) -> None:
        self.branch = branch
        self.fold = fold
        self.growth_below = growth_below
        self.unmet = list(claims)
        self.until = 0.0
        self.intervals: list[tuple[float, float]] = []
        self.roots_met = False
        pad = branch.model.pad
        self.mass = (pad.m, pad.m, pad.I)

    def first_problem(self) -> Problem | None:
        """Walk along the branch and hold each change of the count of growing roots against the
        printed thresholds.

        Returns what is open or refuted first, None if all is proved. `intervals`, `until` and
        `roots_met` say how far that came. Claims at a fold or beyond it are not judged.
        """
        count: int | None = None  # of growing roots in the last part in which it is known
        open_parts: list[Part] = []  # since the part of `count`
        # the friction at which the current cell took over, if it did after the part of `count`: a
        # count may change there without an open part
        seam: Ball | None = None
        for cell in self.branch.cells():
            for part in self._parts_between(cell, cell.start, cell.end, NARROWINGS):
                if part.is_open:
                    open_parts.append(part)
                    continue
                if count is None and open_parts:
                    return Problem("open", COEFFICIENTS_OPEN, 0.0)
                if count is not None and (open_parts or part.growing != count):
                    event = self._event_before(part, open_parts, seam, count)
                    problem = self._problem_of_event(event)
                    if problem is not None:
                        return problem
                    if event.is_fold:
                        return self._problem_at_fold(event.low, event.high)
                open_parts = []
                seam = None
                count = part.growing
                # a lower bound of the friction at t = part.high, the end of the part
                self.until = max(self.until, low_end(part.cell.at(flint.arb(part.high))[FRICTION]))
                if self.until >= self.branch.high:
                    self.until = self.branch.high
                    return self._problem_at_highest_friction()
            seam = cell.at_end()[FRICTION]
        if self.branch.fold_at_contact is not None and count is not None:
            low, high = self.branch.fold_at_contact
            for part in open_parts:  # in what is open before the fold the count may change
                low = min(low, low_end(part.friction))
            return self._problem_at_fold(low, high)
        return Problem("open", self.branch.reason or COEFFICIENTS_OPEN, self.until)

    def _event_before(
        self, next_part: Part, open_parts: Sequence[Part], seam: Ball | None, count: int
    ) -> Event:
        """What happens between two parts in which the growing roots are counted.

        Parameters
        ----------
        next_part : Part
            The second of the two parts.
        open_parts : sequence of Part
            The parts between the two.
        seam : ball or None
            The friction at which a new cell took over between the two, None if none did. Without
            open parts there is a seam: within a cell an open part lies between two signs.
        count : int
            The number of growing roots in the first of the two.
        """
        frictions = [part.friction for part in open_parts]
        if seam is not None:
            frictions.append(seam)
        low = min(map(low_end, frictions))
        high = max(map(high_end, frictions))
        after = next_part.growing or 0  # never None, as the part is not open
        event = Event(low, high, count, after, open_parts)
        det_K_may_vanish = any(part.det_K_is_open for part in open_parts)
        if det_K_may_vanish and not self.branch.model.linear:
            # beyond a fold the friction falls along the branch
            event.is_fold = bool(next_part.cell.direction(next_part.high)[FRICTION] < 0.0)
        return event

    def _problem_of_event(self, event: Event) -> Problem | None:
        """Compare an event with the claims that lie in it; None if they agree, or if it is a fold.

        They agree if the count rises by the sum of the rises claimed, if these have one sign (a
        rise and a fall cancel, so that the count shows neither), if an event with claims is narrow,
        and if within the event no more roots grow faster than `growth_below` than on one of its
        sides. Agreement moves the claims from `unmet` to `intervals`.
        """
        middle = (event.low + event.high) / 2.0
        problem = self._problem_of_passed_claim(event.low)
        if problem is not None or event.is_fold:
            return problem
        highest = event.high + self._same_within(middle)
        claims = [claim for claim in self.unmet if claim.mu <= highest]
        rises = [claim.rise for claim in claims]
        if event.after - event.before != sum(rises):
            reason = f"{event.before} roots grow before and {event.after} beyond"
            if not claims:
                reason += ", which is not listed"
            return Problem("refuted", reason, middle)
        have_one_sign = abs(sum(rises)) == sum(map(abs, rises))
        if not have_one_sign:
            return Problem("open", CANCELS, middle)
        if claims and event.high - event.low > WIDE_EVENT * self.branch.high:
            return Problem("open", WIDE_THRESHOLD, middle)
        most = max(event.before, event.after)
        if not all(self._no_more_grow(part, most) for part in event.open_parts):
            return Problem("open", TOUCHES, middle)
        for claim in claims:
            self.intervals.append((min(event.low, claim.mu), max(event.high, claim.mu)))
        self.unmet = self.unmet[len(claims) :]  # they ascend: these are its first
        if event.open_parts and not claims:  # roots may meet in it, and none crosses
            self.roots_met = True
        return None

    def _same_within(self, mu: float) -> float:
        """How far from a friction a printed threshold may lie and be the same, see `SAME_SHARE`."""
        return SAME_SHARE * max(abs(mu), 1e-3 * self.branch.high)

    def _problem_of_passed_claim(self, mu: float) -> Problem | None:
        """Refuted if a claim lies below a friction up to which the count did not change."""
        if self.unmet and self.unmet[0].mu < mu - self._same_within(mu):
            reason = "the number of growing roots does not change at a threshold"
            return Problem("refuted", reason, self.unmet[0].mu)
        return None

    def _problem_at_highest_friction(self) -> Problem | None:
        """Refuted if a claim was passed, or if the branch was said to turn back before."""
        end = self.branch.high
        problem = self._problem_of_passed_claim(end)
        if problem is not None:
            return problem
        if self.fold is not None and self.fold < end * (1.0 - SAME_SHARE):
            return Problem("refuted", "the branch does not turn back", self.fold)
        return None

    def _problem_at_fold(self, low: float, high: float) -> Problem | None:
        """Compare the interval of friction in which the branch turns back with the claimed fold."""
        problem = self._problem_of_passed_claim(low)
        if problem is not None:
            return problem
        self.until = low
        reach = SAME_SHARE * low
        if self.fold is None or not low - reach <= self.fold <= high + reach:
            return Problem("refuted", "the branch turns back", low)
        if high - low > 2.0 * reach:
            return Problem("open", WIDE_FOLD, low)
        return None

    def _parts_between(self, cell: Cell, low: float, high: float, narrowings: int) -> list[Part]:
        """The parts of a cell, for t from low to high, in which no root reaches the imaginary axis,
        and the open ones between them.

        A part where the signs stay open is examined again on narrower cells, `narrowings` times at
        most; a part that is still almost as wide as what was examined counts as several times. One
        whose friction is known to rounding stays open: there a root reaches the axis, as far as
        doubles can tell.
        """
        refined: list[Part] = []
        for part in self._parts_by_signs(cell, low, high):
            if not part.is_open:
                refined.append(part)
                continue
            narrowings_left = narrowings - 1
            if part.high - part.low > SLOW * (high - low):
                narrowings_left = narrowings - COST_OF_SLOW
            if narrowings_left < 0 or self.branch.is_sharp(part.friction):
                refined.append(part)
            else:
                refined += self._refined(part, narrowings_left)
        return refined

    def _parts_by_signs(self, cell: Cell, low: float, high: float) -> list[Part]:
        """The parts of a cell for t from low to high, cut where a sign changes or is open: that of
        det K, or of the condition of pairs.

        Each has its count of growing roots, None where a sign is open. A root reaches the axis only
        where det K vanishes, at zero, or where the second condition does, as a pair; see the top of
        the module. Between their zeros one count holds.
        """
        K, C = self._matrices(cell)
        coefficients = _characteristic(self.mass, K, C)
        is_damped = len(coefficients) > 4  # of degree 6 in lambda, not 3 in s = -lambda^2
        condition_of_pairs = _hurwitz if is_damped else _discriminant
        signs_of_det_K = signs(_truncated(coefficients[0]), low, high)
        signs_of_pairs = signs(_truncated(condition_of_pairs(coefficients)), low, high)
        edges: set[float] = set()
        for piece in signs_of_det_K + signs_of_pairs:
            edges |= {piece.low, piece.high}
        parts: list[Part] = []
        for left, right in itertools.pairwise(sorted(edges)):
            sign_of_det_K = _sign_within(signs_of_det_K, left, right)
            sign_of_pairs = _sign_within(signs_of_pairs, left, right)
            det_K_is_open = sign_of_det_K == 0
            if sign_of_det_K and sign_of_pairs:
                # one count holds for the whole part, so that roots are counted in its middle
                middle = flint.arb((left + right) / 2.0)
                values = [coefficient(middle) for coefficient in coefficients]
                count = _growing_count(values, sign_of_pairs, is_damped)
                parts.append(Part(cell, left, right, count))
            elif parts and parts[-1].is_open:  # neighbouring open parts are one
                is_open = parts[-1].det_K_is_open or det_K_is_open
                parts[-1] = parts[-1]._replace(high=right, det_K_is_open=is_open)
            else:
                parts.append(Part(cell, left, right, None, det_K_is_open))
        return parts

    def _refined(self, part: Part, narrowings: int) -> list[Part]:
        """The parts of an open part, by a narrower cell around it, or by two around its halves.

        An interval that no narrower cell covers stays an open part. The whole part does in a linear
        model: its one cell is exact, so that a narrower cell shows no more. What is open in a
        narrower cell may be narrowed `narrowings` times more.
        """
        cell = part.cell
        if self.branch.model.linear:
            return [part]
        width = part.high - part.low
        middle = part.low + width / 2.0
        intervals = [(part.low, part.high)]
        if width > WIDE:
            intervals = [(part.low, middle), (middle, part.high)]
        refined: list[Part] = []
        for low, high in intervals:
            # of the narrow cell, in the t of this one: somewhat more than half the interval
            half_width = max(0.6 * (high - low), NARROWEST_PART)
            value_of_pivot = cell.middle + cell.half * (low + high) / 2.0
            narrow = narrower_cell(
                self.branch.balance, cell, value_of_pivot, half=cell.half * half_width
            )
            if narrow is not None:
                # the same interval in the t of the narrow cell, rounded outwards
                start = low_end(narrow.t_of(cell.middle + flint.arb(cell.half) * low))
                end = high_end(narrow.t_of(cell.middle + flint.arb(cell.half) * high))
                if start >= -1.0 and end <= 1.0:
                    refined += self._parts_between(narrow, start, end, narrowings)
                    continue
            refined.append(part._replace(low=low, high=high))  # the narrow cell does not cover it
        return refined

    def _matrices(self, cell: Cell) -> tuple[list[list[Polynomial]], list[list[Polynomial]]]:
        """K and C (3, 3) along a cell, of the motion about the equilibrium.

        Friction that falls with the speed of sliding, mu (1 + b (exp(r x') - 1)) as in `Pad.fall`,
        adds -dF/dx' = -(dF/dmu) mu b r at x' = 0 to the first column of C, F the loads.
        """
        K = []  # -dF/d(x, y, theta)
        for slopes in cell.slopes:
            K.append([-slope for slope in slopes[:FRICTION]])
        C = []
        for row in self.branch.model.damping or ((0.0,) * 3,) * 3:
            C.append([flint.arb_poly([float(value)]) for value in row])
        if self.branch.balance.fall is not None:
            share, rate = self.branch.balance.fall
            friction = cell.centre[FRICTION] + flint.arb(0, float(cell.radii[FRICTION]))
            for i in range(3):
                C[i][0] = C[i][0] - cell.slopes[i][FRICTION] * friction * (share * rate)
        return K, C

    def _no_more_grow(self, part: Part, count: int) -> bool:
        """True if it is proved that in a part at most `count` roots grow faster than
        `growth_below`, by an enclosure of the roots of all its matrices at once."""
        from squeal.proof.referee import enclosed

        K, C = self._matrices(part.cell)  # entries are polynomials of the place t in the cell
        t = between(part.low, part.high)  # a ball that holds the whole part
        damping = in_doubles([[entry(t) for entry in row] for row in C])
        stiffness = in_doubles([[entry(t) for entry in row] for row in K])
        mass = Balls.exact(np.diag([float(v) for v in self.mass]))
        enclosures = enclosed(Quadratic(mass, damping, stiffness, AS_GIVEN))
        if enclosures.failure is not None:
            return False
        _, most_growing = growing_counts(enclosures.pieces, self.growth_below)
        return most_growing <= count


def _sign_within(pieces: Sequence[Sign], low: float, high: float) -> int:
    """The sign over an interval of t, of whose inside no piece ends; 0 if it is not known."""
    for piece in pieces:
        if piece.low <= low and high <= piece.high:
            return piece.sign
    return 0


def _truncated(polynomial: Polynomial) -> Polynomial:
    """A polynomial with the powers beyond `DEGREE_IN_T` as a part of the ball of the first one."""
    coefficients = polynomial.coeffs()
    if len(coefficients) <= DEGREE_IN_T + 1:
        return polynomial
    higher = [abs(c) for c in coefficients[DEGREE_IN_T + 1 :]]
    bound = sum(higher, flint.arb(0)).abs_upper()  # of the higher powers, as |t| <= 1
    first = coefficients[0] + flint.arb(0, bound)
    return flint.arb_poly([first, *coefficients[1 : DEGREE_IN_T + 1]])


def _product(a: Polynomial, b: Polynomial) -> Polynomial:
    """The product of two polynomials in t, up to `DEGREE_IN_T`."""
    return _truncated(a * b)


def _characteristic(
    mass: Sequence[float], K: Sequence[Sequence[Polynomial]], C: Sequence[Sequence[Polynomial]]
) -> list[Polynomial]:
    """Coefficients, by rising power, of det(K - s M) in s = -r^2, or of det(K + C r + M r^2) in r.

    The former where C (3, 3) is zero. Each is a polynomial in t. mass: the diagonal (3,) of M.
    """
    is_damped = any(entry.length() for row in C for entry in row)  # zero has the length 0
    entries: list[list[list[Polynomial]]] = []  # (3, 3), each by rising powers of s, or of r
    for i in range(3):
        entries_of_row = []
        for j in range(3):
            mass_entry = flint.arb_poly([float(mass[i]) if i == j else 0.0])
            if is_damped:
                entries_of_row.append([K[i][j], C[i][j], mass_entry])
            else:
                entries_of_row.append([K[i][j], -mass_entry])
        entries.append(entries_of_row)
    # by the first row, whose minors have the sign + where their columns go on cyclically
    zero = flint.arb_poly([0])
    determinant: list[Polynomial] = []
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        minor = _minus(_times(entries[1][j], entries[2][k]), _times(entries[1][k], entries[2][j]))
        term = _times(entries[0][i], minor)
        pairs = itertools.zip_longest(determinant, term, fillvalue=zero)
        determinant = [total + added for total, added in pairs]
    return determinant


def _times(a: Sequence[Polynomial], b: Sequence[Polynomial]) -> list[Polynomial]:
    """The product of two polynomials in s whose coefficients are polynomials in t."""
    product = [flint.arb_poly([0]) for _ in range(len(a) + len(b) - 1)]
    for i, x in enumerate(a):
        for j, y in enumerate(b):
            if x.length() and y.length():
                product[i + j] = product[i + j] + _product(x, y)
    return product


def _minus(a: Sequence[Polynomial], b: Sequence[Polynomial]) -> list[Polynomial]:
    """The difference of two polynomials in s whose coefficients are polynomials in t."""
    zero = flint.arb_poly([0])
    return [x - y for x, y in itertools.zip_longest(a, b, fillvalue=zero)]


def _discriminant(coefficients: Sequence[Polynomial]) -> Polynomial:
    """The discriminant b^2 c^2 + 18 a b c d - 4 (a c^3 + b^3 d) - 27 a^2 d^2 of the cubic
    a s^3 + b s^2 + c s + d, zero where two roots meet."""
    d, c, b, a = coefficients
    bc = _product(b, c)
    ad = _product(a, d)
    b_cubed = _product(b, _product(b, b))
    c_cubed = _product(c, _product(c, c))
    cubes = _product(a, c_cubed) + _product(d, b_cubed)
    return _product(bc, bc + 18 * ad) - 4 * cubes - 27 * _product(ad, ad)


def _hurwitz(coefficients: Sequence[Polynomial]) -> Polynomial:
    """Hurwitz's last determinant but one, zero where the sum of two roots s is zero.

    coefficients: of a polynomial of degree n in s, that of s^k at index k. The entry of the n - 1
    rows and columns in row i and column j, from 1 on, is the coefficient of the power n - 2 j + i.
    """
    n = len(coefficients) - 1
    zero = flint.arb_poly([0])
    rows = []
    for i in range(1, n):
        row = []
        for j in range(1, n):
            power = n - 2 * j + i
            row.append(coefficients[power] if 0 <= power <= n else zero)
        rows.append(row)
    return _determinant(rows)


def _determinant(rows: Sequence[Sequence[Polynomial]]) -> Polynomial:
    """The determinant of a square matrix (n, n), by Laplace's expansion along its last row."""
    if not rows:
        return flint.arb_poly([1])
    determinant = flint.arb_poly([0])
    *others, last = rows
    for j, entry in enumerate(last):
        if entry.length():  # a Hurwitz matrix has many zeros
            minor = _determinant([[*row[:j], *row[j + 1 :]] for row in others])
            sign = (-1) ** (len(others) + j)
            determinant += sign * _product(entry, minor)
    return determinant


def _growing_count(values: Sequence[Ball], sign_of_pairs: int, is_damped: bool) -> int | None:
    """How many roots grow, by the signs of coefficients; None if a sign is open.

    Without damping lambda = +-sqrt(-s): a complex pair of s has two growing roots, a negative s
    one, a positive s none.

    Parameters
    ----------
    values : sequence of balls
        The coefficients of `_characteristic` at one t.
    sign_of_pairs : int
        The sign of the discriminant of an undamped pad.
    is_damped : bool
        Whether the coefficients are those of a polynomial in lambda, not in s.
    """
    if is_damped:
        return _count_in_right_half_plane(values)
    if sign_of_pairs < 0:
        # one s is real, two are conjugate; the sign of the real one is that of the product of all
        # three, -d / a of a s^3 + b s^2 + c s + d
        sign_of_real = values[0] * -values[3]
        if sign_of_real.contains(0):
            return None
        return 2 if sign_of_real > 0 else 3
    # three s are real; by Descartes' rule the signs of p(-s) change once for each negative one
    reflected = [values[0], -values[1], values[2], -values[3]]
    if any(value.contains(0) for value in reflected):
        return None
    return _sign_changes(reflected)


def _count_in_right_half_plane(values: Sequence[Ball]) -> int | None:
    """How many roots of a polynomial have a positive real part, by Routh's array.

    Its first two rows hold every second coefficient, from the highest power and from the next;
    each further row is the one two above less the multiple of the last that cancels its first
    entry. The changes of sign in the first column are the number. None if one sign is open.

    values: the coefficients of the polynomial, by rising power.
    """
    by_falling_power = values[::-1]
    upper_row = list(by_falling_power[::2])
    lower_row = list(by_falling_power[1::2])
    column = [upper_row[0]]
    while lower_row:
        column.append(lower_row[0])
        if lower_row[0].contains(0):
            return None
        padded = [*lower_row, flint.arb(0)]  # to the length of the upper row, or beyond
        ratio = upper_row[0] / lower_row[0]
        next_row = [upper_row[k] - ratio * padded[k] for k in range(1, len(upper_row))]
        upper_row = lower_row
        lower_row = next_row
    if any(value.contains(0) for value in column):
        return None
    return _sign_changes(column)


def _sign_changes(values: Sequence[Ball]) -> int:
    """How often the sign changes in a row of balls, none of which holds zero.

    Not by products: that of two wide balls may hold zero though neither does.
    """
    changes = 0
    for a, b in itertools.pairwise(values):
        if (a > 0) != (b > 0):
            changes += 1
    return changes
