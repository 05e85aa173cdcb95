"""The referee on pads: what grows along the whole branch of equilibria, and where it changes.

The number of growing roots is constant along a part of the branch on which no root can reach the
imaginary axis: where det K, and the discriminant of det(K - s M) in s = -lambda^2 of a pad without
damping, have no zero. With damping, Hurwitz's last determinant but one takes the place of the
discriminant; by Orlando's formula it is the product of the sums of all pairs of roots, up to a
factor. On each part the roots are counted once, by signs of coefficients. det K vanishes where the
branch turns back.

All that are polynomials of balls along the cells of `branches`. Where their signs stay open the
cell is narrowed, down to the digits of doubles.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

import numpy as np

from squeal.proof.balls import AS_GIVEN, Balls, Quadratic, middle_and_radius
from squeal.proof.branches import (
    BITS,
    FRICTION,
    NEAR,
    ORDER,
    Ball,
    Cell,
    PadBranch,
    Polynomial,
    signs,
)

try:
    import flint
except ImportError:  # an extra
    flint = None

DEGREE = 2 * ORDER  # of polynomials along a cell; higher powers become part of a ball
SAME = 1e-8  # of friction: a threshold so close to a change of the count is that change
NARROWINGS = 9  # of a cell
SLOW = 0.25  # of a cell: what is left of it after a narrowing without progress
COST_OF_SLOW = 3  # of `NARROWINGS`, of such a one
WIDE = 0.1  # of t: a part that is halved before it is narrowed
COEFFICIENTS_OPEN = "what grows cannot be counted"
TOUCHES = "roots meet without crossing the axis"
WIDE_FOLD = "the friction at which the branch turns back is not enclosed closely"


@dataclass(frozen=True)
class Claim:
    """A printed threshold: friction, and by how much the number of growing roots rises."""

    mu: float
    rise: int


@dataclass(frozen=True)
class PadProof:
    """What is proved of a pad.

    status: `proved`, `open` or `refuted`; until: the friction up to which the list is proved;
    places: for each claim up to there the interval in which it is proved; growth_below: nothing
    else grows faster up to there, 1/s; reason, where: why it is open or refuted, or is not proved
    beyond `until`, and the friction.
    """

    status: Literal["proved", "open", "refuted"]
    until: float
    places: tuple[tuple[float, float], ...] = ()
    growth_below: float = 0.0
    reason: str = ""
    where: float | None = None


class Problem(NamedTuple):
    """What is open or refuted, and at which friction."""

    status: Literal["open", "refuted"]
    reason: str
    where: float


class Part(NamedTuple):
    """A part low <= t <= high of a cell; growing: how many roots grow, None where a sign is open;
    folds: whether det K is among the open signs."""

    cell: Cell
    low: float
    high: float
    growing: int | None
    folds: bool = False


@dataclass
class Event:
    """A place where the number of growing roots may change.

    low, high: of friction; before, after: numbers of growing roots; parts: those whose signs are
    open; is_fold: whether the branch turns back.
    """

    low: float
    high: float
    before: int
    after: int
    parts: list[Part] = field(default_factory=list)
    is_fold: bool = False


def prove_pad(
    branch: PadBranch,
    claims: Sequence[Claim],
    fold: float | None,
    first_loss: float | None,
    growth_below: float,
) -> PadProof:
    """Whether the number of growing roots changes at the claimed thresholds and nowhere else.

    The list is proved up to `until` of the result: the end of the branch, or a friction beyond the
    first loss of stability. There it counts as proved too, and `reason` says why the rest is open.

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
    walk = _Walk(branch, claims, fold, growth_below)
    terms_of_series = flint.ctx.cap  # which the walk sets
    try:
        with flint.ctx.workprec(BITS):
            problem = walk.first_problem()
    finally:
        flint.ctx.cap = terms_of_series
    growth = growth_below if walk.roots_met else 0.0
    known = (walk.until, tuple(walk.places), growth)
    if problem is None:
        return PadProof("proved", *known)
    reaches = first_loss is not None and walk.until > first_loss
    status = "proved" if problem.status == "open" and reaches else problem.status
    return PadProof(status, *known, problem.reason, problem.where)


class _Walk:
    """The way along the branch, until it ends or something is open or refuted."""

    def __init__(
        self, branch: PadBranch, claims: Sequence[Claim], fold: float | None, growth_below: float
    ) -> None:
        self.branch = branch
        self.fold = fold
        self.growth_below = growth_below
        self.waiting = list(claims)
        self.until = branch.low
        self.places: list[tuple[float, float]] = []
        self.roots_met = False  # whether roots meet somewhere without crossing
        pad = branch.model.pad
        self.mass = (pad.m, pad.m, pad.I)
        self.is_damped = branch.model.damping is not None or branch.fall is not None

    def first_problem(self) -> Problem | None:
        """Walk along the branch and hold each change of the count of growing roots against the
        printed thresholds.

        Returns what is open or refuted first, None if all is proved. Fills `places`, the intervals
        of the thresholds met, `until`, the friction reached, and `roots_met`.
        """
        count: int | None = None
        open_parts: list[Part] = []
        change: Ball | None = None  # friction at which the contact changes
        for cell in self.branch.cells():
            for part in self._parts(cell):
                if part.growing is None:
                    open_parts.append(part)
                    continue
                if count is None and open_parts:
                    return Problem("open", COEFFICIENTS_OPEN, self.branch.low)
                if count is not None and (open_parts or part.growing != count):
                    event = self._event(open_parts, change, part, count)
                    problem = self._judged(event)
                    if problem is not None:
                        return problem
                    if event.is_fold:
                        return self._at_end(event)
                open_parts = []
                change = None
                count = part.growing
                self.until = max(self.until, _low(part.cell.at(flint.arb(part.high))[FRICTION]))
                if self.until >= self.branch.high:
                    self.until = self.branch.high
                    return self._at_end(None)
            change = cell.at(flint.arb(cell.opened).union(flint.arb(cell.end)))[FRICTION]
        if self.branch.turn is not None:
            low, high = self.branch.turn
            return self._at_end(Event(low, high, count or 0, count or 0, [], True))
        if self.branch.reason:
            return Problem("open", self.branch.reason, self.until)
        return Problem("open", COEFFICIENTS_OPEN, self.until)

    def _event(
        self, open_parts: Sequence[Part], change: Ball | None, part: Part, count: int
    ) -> Event:
        """What happens between the last part with a count and the next one."""
        balls = [one.cell.at(_span(one))[FRICTION] for one in open_parts]
        if change is not None:
            balls.append(change)
        if not balls:  # the counts of two parts that meet differ, which cannot be
            balls.append(part.cell.at(flint.arb(part.low))[FRICTION])
        low = min(_low(ball) for ball in balls)
        high = max(_high(ball) for ball in balls)
        event = Event(low, high, count, part.growing or 0, list(open_parts))
        if any(one.folds for one in open_parts) and not self.branch.model.linear:
            event.is_fold = bool(part.cell.direction(part.high)[FRICTION] < 0.0)
        return event

    def _judged(self, event: Event) -> Problem | None:
        """What is wrong with an event, None if it is one that is printed, or none at all."""
        middle = (event.low + event.high) / 2.0
        problem = self._passed(event.low)
        if problem is not None or event.is_fold:
            return problem
        reach = SAME * max(abs(middle), 1e-3 * self.branch.high)
        mine = [claim for claim in self.waiting if claim.mu <= event.high + reach]
        rise = sum(claim.rise for claim in mine)
        if event.after - event.before != rise:
            words = f"{event.before} roots grow before and {event.after} beyond"
            if not mine:
                words += ", which is not listed"
            return Problem("refuted", words, middle)
        for claim in mine:
            self.places.append((min(event.low, claim.mu), max(event.high, claim.mu)))
        self.waiting = self.waiting[len(mine) :]
        if not mine and event.parts:
            self.roots_met = True
            if not all(self._is_slow(part, event.before) for part in event.parts):
                return Problem("open", TOUCHES, middle)
        return None

    def _passed(self, mu: float) -> Problem | None:
        """What is wrong if a printed threshold was passed without any change."""
        reach = SAME * max(abs(mu), 1e-3 * self.branch.high)
        if self.waiting and self.waiting[0].mu < mu - reach:
            words = "the number of growing roots does not change at a threshold"
            return Problem("refuted", words, self.waiting[0].mu)
        return None

    def _at_end(self, turn: Event | None) -> Problem | None:
        """What is wrong where the branch turns back, or reaches the highest friction."""
        end = self.branch.high if turn is None else turn.low
        problem = self._passed(end)
        if problem is not None:
            return problem
        if turn is None:
            if self.fold is not None and self.fold < end * (1.0 - SAME):
                return Problem("refuted", "the branch does not turn back", self.fold)
            return None
        self.until = turn.low
        reach = SAME * end
        if self.fold is None or not turn.low - reach <= self.fold <= turn.high + reach:
            return Problem("refuted", "the branch turns back", end)
        if turn.high - turn.low > 2.0 * reach:
            return Problem("open", WIDE_FOLD, end)
        return None

    def _parts(self, cell: Cell) -> list[Part]:
        """The parts of a cell in which no root reaches the axis, and those between them."""
        return self._parts_between(cell, cell.start, cell.end, NARROWINGS)

    def _parts_between(self, cell: Cell, low: float, high: float, narrowings: int) -> list[Part]:
        """The parts from low to high in which no root reaches the axis, and those between them.

        A part where the signs stay open is divided again, `narrowings` times at most.
        """
        K, C = self._matrices(cell)
        coefficients = _characteristic(self.mass, K, C)
        determinant = coefficients[0]  # of K: a fold where it vanishes
        conditions = [
            determinant,
            _hurwitz(coefficients) if self.is_damped else _discriminant(coefficients),
        ]
        found = [signs(_reduced(condition), low, high) for condition in conditions]
        edges = sorted({edge for pieces in found for piece in pieces for edge in piece[:2]})
        parts: list[Part] = []
        for a, b in itertools.pairwise(edges):
            here = [_sign_within(pieces, a, b) for pieces in found]
            if all(here):
                middle = flint.arb((a + b) / 2.0)
                values = [coefficient(middle) for coefficient in coefficients]
                count = _growing(values, here[1], self.is_damped)
                parts.append(Part(cell, a, b, count, here[0] == 0))
            elif parts and parts[-1].growing is None:
                folds = parts[-1].folds or here[0] == 0
                parts[-1] = Part(cell, parts[-1].low, b, None, folds)
            else:
                parts.append(Part(cell, a, b, None, here[0] == 0))
        refined: list[Part] = []
        for part in parts:
            slow = part.high - part.low > SLOW * (high - low)
            left = narrowings - (COST_OF_SLOW if slow else 1)
            is_sharp = self.branch.is_sharp(part.cell.at(_span(part))[FRICTION])
            if part.growing is None and left >= 0 and not is_sharp:
                refined += self._refined(part, left)
            else:
                refined.append(part)
        return refined

    def _refined(self, part: Part, narrowings: int) -> list[Part]:
        """The parts of a part, by narrower cells around it; itself where there are none."""
        cell = part.cell
        if self.branch.model.linear:
            return [part]
        width = part.high - part.low
        middle = part.low + width / 2.0
        pieces = [(part.low, part.high)]
        if width > WIDE:
            pieces = [(part.low, middle), (middle, part.high)]
        found: list[Part] = []
        for low, high in pieces:
            share = max(0.6 * (high - low), NEAR)
            center = cell.middle + cell.half * (low + high) / 2.0
            narrow = self.branch.narrow(cell, center, cell.half * share)
            if narrow is None:
                found.append(Part(cell, low, high, None, part.folds))
                continue
            start, end = (_end(narrow, cell, t) for t in (low, high))
            found += self._parts_between(narrow, start, end, narrowings)
        return found

    def _matrices(self, cell: Cell) -> tuple[list[list[Polynomial]], list[list[Polynomial]]]:
        """K and C along a cell."""
        K = [[-slope for slope in row[:FRICTION]] for row in cell.slopes]
        damping = self.branch.model.damping or ((0.0,) * 3,) * 3
        C = [[flint.arb_poly([float(v)]) for v in row] for row in damping]
        if self.branch.fall is not None:
            share, rate = self.branch.fall
            friction = cell.places[FRICTION] + flint.arb(0, float(cell.loose[FRICTION]))
            for i in range(3):
                C[i][0] = C[i][0] - cell.slopes[i][FRICTION] * friction * (share * rate)
        return K, C

    def _is_slow(self, part: Part, count: int) -> bool:
        """Whether no more than `count` roots grow faster than the rate in a part."""
        from squeal.proof.pieces import growing_counts
        from squeal.proof.referee import enclosed

        K, C = self._matrices(part.cell)
        span = _span(part)
        damping, stiffness = (_balls([[entry(span) for entry in row] for row in X]) for X in (C, K))
        mass = Balls.exact(np.diag([float(v) for v in self.mass]))
        finding = enclosed(Quadratic(mass, damping, stiffness, AS_GIVEN))
        if finding.failure is not None:
            return False
        return growing_counts(finding.pieces, self.growth_below)[1] <= count


def _span(part: Part) -> Ball:
    """All t of a part."""
    return flint.arb(part.low).union(flint.arb(part.high))


def _low(ball: Ball) -> float:
    """A double that is no larger than the numbers of a ball, nearly the least."""
    return float(np.nextafter(float(ball.lower()), -np.inf))


def _high(ball: Ball) -> float:
    """The same of the largest."""
    return float(np.nextafter(float(ball.upper()), np.inf))


def _end(narrow: Cell, cell: Cell, t: float) -> float:
    """The share of a narrow cell that is t in a wide one, of the same pivot."""
    place = float(narrow.share(cell.middle + flint.arb(cell.half) * t).mid())
    return min(max(place, -1.0), 1.0)


def _sign_within(pieces: Sequence[Any], low: float, high: float) -> int:
    """The sign over an interval that no piece ends within."""
    middle = (low + high) / 2.0
    return next((piece.sign for piece in pieces if piece.low <= middle <= piece.high), 0)


def _reduced(polynomial: Polynomial) -> Polynomial:
    """A polynomial with the powers beyond `DEGREE` as a part of the ball of the first one."""
    known = polynomial.coeffs()
    if len(known) <= DEGREE + 1:
        return polynomial
    rest = sum((abs(c) for c in known[DEGREE + 1 :]), flint.arb(0)).abs_upper()
    return flint.arb_poly([known[0] + flint.arb(0, rest), *known[1 : DEGREE + 1]])


def _product(a: Polynomial, b: Polynomial) -> Polynomial:
    return _reduced(a * b)


def _characteristic(
    mass: Sequence[float], K: Sequence[Sequence[Any]], C: Sequence[Sequence[Any]]
) -> list[Polynomial]:
    """Coefficients, by rising power, of det(K - s M) in s, or of det(K + C r + M r^2) in r.

    The former where C is zero.
    """
    damped = any(entry.length() for row in C for entry in row)
    entries: list[list[list[Any]]] = []
    for i in range(3):
        row = []
        for j in range(3):
            diagonal = flint.arb_poly([float(mass[i]) if i == j else 0.0])
            row.append([K[i][j], C[i][j], diagonal] if damped else [K[i][j], -diagonal])
        entries.append(row)
    total: list[Any] = []
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        minor = _minus(_times(entries[1][j], entries[2][k]), _times(entries[1][k], entries[2][j]))
        total = _minus(_times(entries[0][i], minor), [-c for c in total])
    return total


def _times(a: Sequence[Polynomial], b: Sequence[Polynomial]) -> list[Polynomial]:
    """The product of two polynomials in s whose coefficients are polynomials in t."""
    product = [flint.arb_poly([0]) for _ in range(len(a) + len(b) - 1)]
    for i, x in enumerate(a):
        for j, y in enumerate(b):
            if x.length() and y.length():
                product[i + j] = product[i + j] + _product(x, y)
    return product


def _minus(a: Sequence[Polynomial], b: Sequence[Polynomial]) -> list[Polynomial]:
    """The difference of two of these."""
    zero = flint.arb_poly([0])
    pairs = itertools.zip_longest(a, b, fillvalue=zero)
    return [x - y for x, y in pairs]


def _discriminant(roots: Sequence[Polynomial]) -> Polynomial:
    """Of a cubic."""
    d, c, b, a = roots
    bc = _product(b, c)
    ad = _product(a, d)
    first = _product(bc, bc + 18 * ad)
    cubes = _product(a, _product(c, _product(c, c))) + _product(d, _product(b, _product(b, b)))
    return first - 4 * cubes - 27 * _product(ad, ad)


def _hurwitz(roots: Sequence[Polynomial]) -> Polynomial:
    """Hurwitz's last determinant but one."""
    n = len(roots) - 1
    zero = flint.arb_poly([0])
    rows = []
    for i in range(1, n):
        indices = [n - 2 * j + i for j in range(1, n)]
        rows.append([roots[k] if 0 <= k <= n else zero for k in indices])
    return _determinant(rows)


def _determinant(rows: Sequence[Sequence[Polynomial]]) -> Polynomial:
    """By minors of the first rows, each once."""
    n = len(rows)
    minors: dict[tuple[int, ...], Any] = {(): flint.arb_poly([1])}
    for row in rows:
        larger: dict[tuple[int, ...], Any] = {}
        for columns, minor in minors.items():
            for j in range(n):
                if j in columns or not row[j].length():
                    continue
                key = tuple(sorted((*columns, j)))
                sign = (-1) ** (len(columns) - key.index(j))
                larger[key] = larger.get(key, flint.arb_poly([0])) + sign * _product(row[j], minor)
        minors = larger
    return minors.get(tuple(range(n)), flint.arb_poly([0]))


def _growing(values: Sequence[Ball], second: int, damped: bool) -> int | None:
    """How many roots grow, from the coefficients at one place; None if a sign is open."""
    if damped:
        return _right_half_plane(values)
    if second < 0:  # one real s, and a pair
        last = values[0] * -values[3]
        return None if last.contains(0) else 2 if last > 0 else 3
    # three real s = -lambda^2; Descartes' rule counts the negative ones exactly
    turned = [value if k % 2 == 0 else -value for k, value in enumerate(values)]
    if any(value.contains(0) for value in turned):
        return None
    return _sign_changes(turned)


def _right_half_plane(values: Sequence[Ball]) -> int | None:
    """Routh's count of the roots with a positive real part."""
    upper = list(values[::-1][::2])
    lower = list(values[::-1][1::2])
    column = [upper[0]]
    while lower:
        column.append(lower[0])
        if lower[0].contains(0):
            return None
        padded = [*lower, flint.arb(0)]
        ratio = upper[0] / lower[0]
        following = [upper[k] - ratio * padded[k] for k in range(1, len(upper))]
        upper = lower
        lower = following
    if any(value.contains(0) for value in column):
        return None
    return _sign_changes(column)


def _sign_changes(values: Sequence[Ball]) -> int:
    """How often the sign changes in a row of balls, none of which holds zero.

    Not by products: that of two wide balls may hold zero though neither does.
    """
    signs_of_values = [1 if value > 0 else -1 for value in values]
    return sum(1 for a, b in itertools.pairwise(signs_of_values) if a != b)


def _balls(rows: Sequence[Sequence[Ball]]) -> Balls:
    """A matrix of balls of doubles from one of `flint.arb`."""
    pairs = [[middle_and_radius(ball) for ball in row] for row in rows]
    both = np.array(pairs)
    return Balls(both[..., 0].copy(), both[..., 1].copy())
