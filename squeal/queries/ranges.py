"""The referee's statements on thresholds: of a pad up to its first loss, of a small system on all.

A proof encloses the parameter in balls (midpoint and radius): on each interval between thresholds
the number of growing roots is shown to stay as it is. Counts prove the number at single values.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from squeal.errors import NO_BALLS, InputError
from squeal.io.writing import with_known_digits
from squeal.linear.events import Crossing
from squeal.linear.matrices import EPS, Array, dense, divisor, norm_of
from squeal.linear.moduli import Modulus, Tabulated
from squeal.linear.system import TermSystem
from squeal.linear.terms import Term as SystemTerm
from squeal.model.equations import PadModel
from squeal.numerics.differentiation import Formula
from squeal.proof import AS_GIVEN, HALF_ULP
from squeal.queries.systems.proofs import Statement, as_complex
from squeal.results.columns import OPEN

if TYPE_CHECKING:  # scenes start without the referee
    from squeal.proof.pads import PadProof
    from squeal.proof.polynomials import ExactRange
    from squeal.proof.referee import Count, Proof
    from squeal.proof.terms import Factor, Term, Terms
    from squeal.queries.systems.all_roots import MotionRates

RATE = 1e-6  # of a root: slower growth is not excluded by a proof
WIDEST_RATE = 1e-3  # of the slowest motion: where no less can be excluded nothing is proved
WIDTH = 1e-10  # of a threshold: by how much the interval is widened in which it is proved
ROUNDINGS = 4  # for each row: of a located root, in its backward error
WIDER = 200.0  # times wider at each further attempt: rounding hides growth beside a threshold
ATTEMPTS = 4
WIDER_BY_DIGITS = 4.0  # the same factor where data have few digits
ATTEMPTS_BY_DIGITS = 8
VAGUE = 1e-3  # of the range: a wider interval may hold more than its threshold
IS_VAGUE = "a threshold is known to an interval only that may hold more"
MIXED = (
    "crossings of several kinds or directions lie in one interval, where counts do not tell them"
)
BEYOND_FOLD = 1.05  # of the friction at a fold: how far a branch would be followed
DISAGREES = "the referee disagrees: "
PROVED_ROWS = 40  # up to which thresholds of systems are proved without being asked for
INTERVALS = 1000  # into which a proof may divide the range, in a system of few rows
INTERVALS_OF_EXACT = 100  # the same of thresholds that are exact for the entries as given
# states from which on an interval costs twice as much as in a system of few rows or more: a proof
# that was not requested may then divide the range into half as many
LARGE = 40.0
COUNT_DISTANCES = (1e-8, 1e-6)  # of a threshold: from it to where growing roots are counted
RESTART_DISTANCE = 1e-3  # of half the gap to the next threshold: from a refuted one to a step's end
SEARCHES = 4  # in all, where the referee refutes each but the last

Interval = tuple[float, float]


@dataclass(frozen=True)
class RangeStatement(Statement):
    """What is known of a list of thresholds, as JSON holds it under `proof`.

    Attributes
    ----------
    status, by, growth_below, data, reason, where
        As of any `Statement`; `where` is a value of the parameter.
    parameter : str
        What is varied.
    low, until : float
        The range that the statement is about.
    high : float
        The end of the range that was searched.
    """

    parameter: str = "mu"
    low: float = 0.0
    until: float = 0.0
    high: float = 0.0

    @property
    def refuted_at(self) -> float | None:
        """The value at which the referee disagrees, None if it does not."""
        if self.where is None or not self.reason.startswith(DISAGREES):
            return None
        return float(self.where.real)

    @property
    def words(self) -> str:
        """The statement in a line below a list."""
        if self.status == "proved":
            return self.words_of_proof(f" up to {self.parameter} = {self.until:.9g}")
        if self.status == "counted":
            return f"counted, not proved: {self.reason}"
        words = f"{OPEN}{self.reason}"
        if self.where is not None:
            words += f" (near {self.parameter} = {self.where.real:.9g})"
        return words

    def to_dict(self) -> dict[str, Any]:
        """The proof as JSON holds it: `extent` is the range that is spoken of."""
        return {
            "status": self.status,
            "by": self.by,
            "growth_below": self.growth_below,
            "data": self.data,
            "reason": self.reason or None,
            "where": None if self.where is None else float(self.where.real),
            "extent": [self.low, self.until],
        }


def _with_reason(statement: RangeStatement, proof: Proof | PadProof) -> RangeStatement:
    """An open statement, with the reason why the proof is open or refuted, and where."""
    reason = proof.reason
    if proof.status == "refuted":
        reason = f"{DISAGREES}{reason}"
    return replace(statement, reason=reason, where=as_complex(proof.where))


def _intervals_of(
    crossings: Sequence[Crossing], low: float, high: float, share: float
) -> list[Interval]:
    """Disjoint intervals within the range from low to high that hold the crossings, ascending.

    The interval of each crossing is widened to either side by a margin, see `_margin` also for
    `share`; those that overlap then are merged.
    """
    widened: list[Interval] = []
    for crossing in crossings:
        start, stop = crossing.interval
        if start > high or stop < low:
            continue
        margin = _margin((start, stop), low, high, share)
        widened.append((max(start - margin, low), min(stop + margin, high)))
    merged: list[Interval] = []
    for start, stop in sorted(widened):
        if merged and start <= merged[-1][1]:
            before_start, before_stop = merged[-1]
            merged[-1] = (before_start, max(before_stop, stop))
        else:
            merged.append((start, stop))
    return merged


def _margin(interval: Interval, low: float, high: float, share: float) -> float:
    """A share of the value of a crossing, or of a thousandth of the range if that is greater."""
    start, stop = interval
    return share * max(abs(start), abs(stop), 1e-3 * (high - low))


def pad_statement(
    model: PadModel,
    q_at_rest: ArrayLike,
    crossings: Sequence[Crossing],
    high: float,
    first_loss: float | None,
    fastest: float,
    fold: float | None,
) -> tuple[RangeStatement, list[Interval]]:
    """Prove the thresholds of a pad along its branch of equilibria, at least up to the first loss.

    Returns the statement, and the intervals of friction in which the thresholds are proved; an
    empty list without a proof.

    Parameters
    ----------
    model : PadModel
        The pad.
    q_at_rest : array_like (3,)
        Its equilibrium without friction.
    crossings : sequence of Crossing
        All listed crossings of the imaginary axis.
    high : float
        The end of the range.
    first_loss : float or None
        The first threshold at which a mode begins to grow; None if no mode does.
    fastest : float
        A bound of |lambda| without friction and damping, rad/s; growth below `RATE` times it is
        not excluded.
    fold : float or None
        The friction at which the branch of equilibria turns back; None if it does not.
    """
    from squeal.proof.branches import PadBranch
    from squeal.proof.pads import Claim, prove_pad

    listed = sorted(crossings, key=attrgetter("mu"))
    # where the number of growing roots changes, and by how much
    claims = [Claim(crossing.mu, _rise(crossing)) for crossing in listed]
    # a branch with a fold is followed beyond it: the proof has to see it turn back
    end = high if fold is None else fold * BEYOND_FOLD
    try:
        branch = PadBranch(model, q_at_rest, high=end)
    except ImportError:
        return RangeStatement("open", by=None, reason=NO_BALLS, until=high, high=high), []
    proof = prove_pad(branch, claims, fold, first_loss=first_loss, growth_below=RATE * fastest)
    statement = RangeStatement("open", "enclosure", data=AS_GIVEN, until=high, high=high)
    if proof.status != "proved":
        return _with_reason(statement, proof), []
    until = min(proof.until, high)
    statement = replace(statement, status="proved", growth_below=proof.growth_below, until=until)
    return statement, list(proof.intervals)


def _rise(crossing: Crossing) -> int:
    """By how much the number of growing roots rises at a crossing: by 2 for a pair that grows."""
    roots = 2 if crossing.kind == "flutter" else 1
    return roots if crossing.direction == "up" else -roots


def _rise_within(crossings: Sequence[Crossing], interval: Interval) -> int:
    """By how much the number of growing roots rises over an interval, after the crossings in it."""
    low, high = interval
    return sum(_rise(crossing) for crossing in crossings if low <= crossing.mu <= high)


def _is_mixed(crossings: Sequence[Crossing], interval: Interval) -> bool:
    """True if an interval holds crossings of several kinds or directions."""
    low, high = interval
    inside = [crossing for crossing in crossings if low <= crossing.mu <= high]
    return len({(crossing.kind, crossing.direction) for crossing in inside}) > 1


def _terms(term: SystemTerm, system: TermSystem) -> Iterator[Term]:
    """Convert a term of a system to terms of the referee: matrix times function of the parameter.

    A modulus E (1 + i eta) with a loss factor eta gives two terms, E and i E eta. A modulus that is
    imaginary as a whole has i in its matrix.
    """
    from squeal.proof.terms import Term

    factor = term.factor
    matrix = dense(term.matrix)
    errors = _errors_of(term)
    if isinstance(factor, Formula):
        yield Term(matrix, _product([factor], system), errors)
        return
    assert isinstance(factor, Modulus)
    if factor.imaginary:
        matrix = 1j * matrix
    yield Term(matrix, _product([factor.factor], system), errors)
    if factor.loss is not None:
        yield Term(1j * matrix, _product([factor.factor, factor.loss], system), errors)


def _errors_of(term: SystemTerm) -> Array | None:
    """How far entries (n, n) of a term may be off by digits of data and by rounding; None of
    doubles that were given."""
    errors = term.data_errors
    if errors is None and not term.rounding:
        return None
    by_digits = 0.0 if errors is None else dense(errors)
    return term.rounding + np.zeros(term.matrix.shape) + by_digits


def _open_share(system: TermSystem) -> float:
    """The largest share of the size of a matrix that digits of data leave open, 0 of doubles."""
    shares = [0.0]
    for term in system.terms:
        errors = term.data_errors
        if errors is not None:
            shares.append(norm_of(errors) / divisor(norm_of(term.matrix)).item())
    return max(shares)


def _product(formulas: Sequence[Formula], system: TermSystem) -> Factor | None:
    """A product of formulas as a function of a ball of the parameter; None where it is 1.

    The other parameters have the system's values. In place of a ball the function takes a power
    series of balls, which gives derivatives too, or the parameter itself as a rational function
    (`squeal.proof.polynomials.Quotient`): the product then is a rational function of the parameter.
    """
    if all(not formula.names and formula.value({}) == 1.0 for formula in formulas):
        return None
    import flint

    values = dict(system.parameters)

    def product(ball: Any) -> Any:
        values_with_ball = values | {system.parameter: ball}
        exact = flint.arb  # a ball of radius 0 of a number
        if not isinstance(ball, flint.arb | flint.arb_series):
            exact = type(ball).of  # a constant rational function

        def operand(x: object) -> object:
            """Numbers of a formula in the arithmetic of the ball, which itself stays as it is."""
            return x if x is ball else exact(x)

        first, *others = [formula.in_arithmetic(values_with_ball, operand) for formula in formulas]
        return math.prod(others, start=first)

    return product


def _has_table(term: SystemTerm) -> bool:
    """True if the factor of a term is tabulated over a parameter or over the frequency."""
    factor = term.factor
    return isinstance(factor, Tabulated) or (isinstance(factor, Modulus) and bool(factor.table))


def vague_interval(intervals: Iterable[Interval], extent: float) -> Interval | None:
    """The first interval that is wide compared with a range of this extent; None if there is none.

    Two crossings within it may cancel, which counts at its ends do not show.
    """
    for low, high in intervals:
        if high - low > VAGUE * extent:
            return low, high
    return None


def exact_range(system: TermSystem, low: float, high: float) -> ExactRange | None:
    """The exact thresholds of a system of few rows that depend on one another; None of any other.

    They are those of the entries as given. None without the library of ball arithmetic, too.
    """
    from squeal.proof.polynomials import ExactRange

    if any(_has_table(term) for term in system.terms):
        return None
    try:
        return ExactRange.of(_terms_in_balls(system), low, high)
    except ImportError:
        return None


def refuse_poles(system: TermSystem, low: float, high: float) -> None:
    """Raise InputError where a factor divides by zero within a range of the parameter.

    Roots that pass through infinity there are not followed. Only rational functions are examined;
    none without the library of ball arithmetic.
    """
    from squeal.proof.polynomials import poles

    for term in system.terms:
        if not isinstance(term.factor, Formula):
            continue
        try:
            factor = _product([term.factor], system)
        except ImportError:
            return
        if factor is None:
            continue
        for pole in poles(factor, low, high):
            raise InputError(
                f"{term.factor.text}: is not a finite number at {system.parameter} = {pole:.9g}, "
                f"within the range from {low:g} to {high:g}; the range must end before or begin "
                "behind it"
            )


def system_statement(
    system: TermSystem,
    crossings: Sequence[Crossing],
    low: float,
    high: float,
    rates: MotionRates,
    at_any_cost: bool,
    is_exact: bool,
) -> tuple[RangeStatement, list[Interval]]:
    """Prove all thresholds of a small system, that is the number of growing roots between them.

    Returns the statement, and the intervals of the parameter in which the thresholds are proved; an
    empty list without a proof.

    Parameters
    ----------
    system : TermSystem
        The system.
    crossings : sequence of Crossing
        All listed crossings of the imaginary axis.
    low, high : float
        The range of the free parameter.
    rates : MotionRates
        How fast the motions at the lower end of the range are. The proof excludes growth by more
        than a millionth of the slowest oscillation. Where the rounding of entries leaves more open,
        as of free motions, it excludes growth by more than a millionth of the fastest motion. Both
        bounds are at most a thousandth of the slowest motion.
    at_any_cost : bool
        Whether the range may be divided into as many intervals as that of a system of few rows.
    is_exact : bool
        Whether the crossings are those of `exact_range`: where the proof is open for entries known
        to half a unit in the last place, they are proved for the entries as given.
    """
    from squeal.proof.referee import Proof

    proof, intervals = _proof_of_system(system, crossings, low, high, rates, at_any_cost, is_exact)
    # counts at the ends of an interval do not tell crossings of several kinds or directions in it.
    # That leaves a proved list open; a refuted one stays refuted, since it is searched again
    is_mixed = any(_is_mixed(crossings, interval) for interval in intervals)
    if proof.status == "proved" and is_mixed:
        proof = replace(proof, status="open", reason=MIXED)
    if proof.status == "open" and is_exact:
        proof = Proof("proved", "exact", growth_below=0.0)
        intervals = []  # each crossing has its exact interval already
    data = proof.data if system.digits is None else f"{system.digits} digits"
    statement = RangeStatement(
        "open", proof.by, data=data, parameter=system.parameter, low=low, until=high, high=high
    )
    if proof.status != "proved":
        return _with_reason(statement, proof), []
    return replace(statement, status="proved", growth_below=proof.growth_below), intervals


def enclosed_frequencies(
    system: TermSystem, crossings: Sequence[Crossing], intervals: Sequence[Interval]
) -> dict[tuple[float, float], float | None]:
    """The frequencies (Hz) of those crossings that are not located to rounding, but shown by counts
    of growing roots, by the value and the listed frequency of each.

    The search takes them from a root at some distance. Here that of a pair is enclosed over the
    interval in which its threshold is proved, and has as many digits as the enclosure leaves; None
    where it leaves none. It is 0 of a single real root, and None of several in one interval: they
    may be a slow pair there that soon turns into two real roots.
    """
    from squeal.proof.ranges import frequency_on_axis

    frequencies: dict[tuple[float, float], float | None] = {}
    terms = _terms_in_balls(system)
    for crossing in crossings:
        if crossing.residual is not None and crossing.residual <= ROUNDINGS * EPS * system.n:
            continue
        frequency: float | None = None
        for low, high in intervals:
            if not low <= crossing.mu <= high:
                continue
            if crossing.kind == "divergence":
                alike = [c for c in crossings if c.kind == "divergence" and low <= c.mu <= high]
                frequency = 0.0 if len(alike) == 1 else None
                continue
            bounds = frequency_on_axis(terms, low, high, math.tau * crossing.frequency_hz)
            if bounds is None:
                continue
            middle = sum(bounds) / (4 * math.pi)
            error = 10 * (bounds[1] / math.tau - middle)  # ten times: all digits are right
            if error < middle:
                frequency = float(with_known_digits(middle, middle - error, middle + error))
        frequencies[crossing.mu, crossing.frequency_hz] = frequency
    return frequencies


def _proof_of_system(
    system: TermSystem,
    crossings: Sequence[Crossing],
    low: float,
    high: float,
    rates: MotionRates,
    at_any_cost: bool,
    is_exact: bool,
) -> tuple[Proof, list[Interval]]:
    """Try proofs for `system_statement`; arguments as there.

    Each proof shows that one number of roots grows between intervals around the crossings. While it
    stays open beside a crossing, the next one is tried with wider intervals around all crossings.
    Returns the first proof that is not open, else the last one, and the intervals that it was tried
    with, an empty list if no proof was tried.
    """
    from squeal.proof.ranges import SPENT, RangeProof
    from squeal.proof.referee import Proof

    most = INTERVALS  # into which the proof may divide the range
    if is_exact:
        most = INTERVALS_OF_EXACT
    if not at_any_cost:  # fewer for a large system, see `LARGE`
        # without damping the proof is about lambda^2, of which there are n
        states = 2 * system.n if system.C else system.n
        most = int(most / (1.0 + (states / LARGE) ** 2))
    if any(_has_table(term) for term in system.terms):
        return Proof("open", reason="tables over a parameter have no enclosure"), []
    try:
        terms = _terms_in_balls(system)
    except ImportError:
        return Proof("open", reason=NO_BALLS), []
    range_proof = RangeProof(terms, low, high, most)
    for share in _shares_of_intervals(system, crossings):
        intervals = _intervals_of(crossings, low, high, share)
        vague = vague_interval(intervals, high - low)
        if vague is not None:
            return Proof("open", "enclosure", reason=IS_VAGUE, where=sum(vague) / 2.0), intervals
        rises = [_rise_within(crossings, interval) for interval in intervals]
        # first the smaller bound of growth; the larger where rounding of entries leaves that open
        for growth_below in _growth_bounds(rates):
            try:
                proof = range_proof.prove(intervals, growth_below, rises)
            except InputError as error:  # a factor has no value somewhere
                proof = Proof("open", reason=str(error))
            # a proof that has spent all divisions of the range would do so again
            if proof.status != "open" or proof.reason == SPENT:
                return proof, intervals
        if not _is_beside(proof.where, intervals, VAGUE * (high - low)):
            break  # what is open lies elsewhere: wider intervals do not help
    return proof, intervals


def _growth_bounds(rates: MotionRates) -> list[float]:
    """Two bounds of the growth, 1/s, that a proof does not exclude, the smaller one first."""
    widest = WIDEST_RATE * rates.slowest
    return [min(RATE * rate, widest) for rate in (rates.slowest_oscillation, rates.fastest)]


def _shares_of_intervals(system: TermSystem, crossings: Sequence[Crossing]) -> list[float]:
    """By which shares of its value the interval of a crossing is widened, in turn.

    Beside a threshold rounding may hide which roots grow, and a threshold of data with few digits
    may lie farther off. The first width at which the proof succeeds is taken.
    """
    if not crossings:
        return [WIDTH]
    open_share = _open_share(system)
    if open_share:
        powers = range(1, ATTEMPTS_BY_DIGITS + 1)
        return [WIDTH + open_share * WIDER_BY_DIGITS**power for power in powers]
    return [WIDTH * WIDER**power for power in range(ATTEMPTS)]


def _is_beside(where: complex | None, intervals: Sequence[Interval], distance: float) -> bool:
    """True if a value of the parameter lies within a distance of one of the intervals.

    where: of an open proof, a value of the parameter, or a complex root, or None.
    """
    if where is None or isinstance(where, complex):
        return False
    return any(start - distance <= where <= stop + distance for start, stop in intervals)


def _terms_in_balls(system: TermSystem) -> Terms:
    """M, C and K as functions of the parameter, entries known to half a unit in the last place, or
    to the digits of their data.

    They are those of `system.balanced`, which has the same roots. Raises ImportError without the
    library of ball arithmetic.
    """
    from squeal.proof.terms import Terms

    parts = []
    for terms in system.balanced.parts:
        part: list[Term] = []
        for term in terms:
            part += _terms(term, system)  # one term, or two if the factor has a loss
        parts.append(part)
    M, C, K = parts
    return Terms(M, C, K, HALF_ULP)


def doubt_of_counts(
    system: TermSystem, crossings: Sequence[Crossing], low: float, high: float, is_complete: bool
) -> tuple[str, float | None]:
    """Compare the thresholds of a small system with the referee's counts of growing roots.

    The referee counts on both sides of each threshold and, if the list is said to be complete, at
    both ends of the range. Each count is a lower and an upper bound, which differ where rounding
    leaves it open.

    Parameters
    ----------
    system : TermSystem
        A small real system.
    crossings : sequence of Crossing
        All listed crossings of the imaginary axis.
    low, high : float
        The range of the free parameter.
    is_complete : bool
        Whether the list is said to hold every crossing of the range.

    Returns
    -------
    doubt : str
        Which counts refute the list. Else beside which threshold, of several the last one, the
        counts are uncertain; empty if all counts agree with the list.
    refuted_at : float or None
        A value near the threshold that the counts refute, at which to search again; None if no
        threshold is refuted.
    """
    doubt = ""
    ends_are_clear = True
    intervals = _intervals_of(crossings, low, high, share=0.0)
    for k, (start, stop) in enumerate(intervals):
        end_before = low if k == 0 else intervals[k - 1][1]
        start_after = high if k == len(intervals) - 1 else intervals[k + 1][0]
        half_gap_below = (start - end_before) / 2.0
        half_gap_above = (start_after - stop) / 2.0
        if min(half_gap_below, half_gap_above) <= 0.0:
            # the interval reaches an end of the range, and nothing is counted beyond: no counts
            # show on which side of this end the threshold lies
            ends_are_clear = False
            continue
        # first close to the threshold, then where rounding hides less
        for share in COUNT_DISTANCES:
            margin = _margin((start, stop), low, high, share)
            below = _count(system, start - min(margin, half_gap_below))
            above = _count(system, stop + min(margin, half_gap_above))
            is_certain = below.is_certain and above.is_certain
            if is_certain:
                break
        if not is_certain:  # not at the larger distance either
            middle = (start + stop) / 2.0
            doubt = f"the referee cannot count what grows on both sides of {middle:.9g}"
        if not _may_rise(below, above, _rise_within(crossings, (start, stop))):
            counts = f"{below.lower} roots grow below {start:.9g} and {above.lower} above"
            return f"{DISAGREES}{counts}", stop + RESTART_DISTANCE * half_gap_above
    if is_complete and ends_are_clear:
        below = _count(system, low)
        above = _count(system, high)
        if not _may_rise(below, above, _rise_within(crossings, (low, high))):
            counts = f"{below.lower} roots grow at {low:.9g} and {above.lower} at {high:.9g}"
            return f"{DISAGREES}{counts}", (low + high) / 2.0
    return doubt, None


def _may_rise(below: Count, above: Count, rise: int) -> bool:
    """True if the bounds of two counts allow that the number of growing roots rises by so much."""
    return above.lower - below.upper <= rise <= above.upper - below.lower


def _count(system: TermSystem, value: float) -> Count:
    """The referee's bounds of the number of growing roots at a value of the free parameter."""
    from squeal.proof.balls import Quadratic
    from squeal.proof.referee import unstable_count

    arrays = system.balanced.arrays({system.parameter: value})
    return unstable_count(Quadratic.of(*arrays, HALF_ULP))
