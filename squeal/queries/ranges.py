"""What the referee says of thresholds: of a pad up to its first loss, of a small system of all."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from squeal.errors import InputError
from squeal.linear.events import Crossing
from squeal.linear.moduli import Tabulated
from squeal.linear.system import TermSystem
from squeal.model.equations import PadModel
from squeal.queries.systems.proofs import HALF_ULP, Statement
from squeal.results.columns import OPEN

if TYPE_CHECKING:  # scenes start without the referee
    from squeal.proof.referee import Count, Proof

NO_BALLS = "python-flint is not installed (`pip install 'squeal[proof]'` brings it)"
RATE = 1e-6  # growth below which nothing is told apart, of the fastest root
WIDTH = 1e-10  # of a threshold: by how much the interval is wider in which it is proved
VAGUE = 1e-3  # of the range: an interval that is wider may hold more than its threshold
IS_VAGUE = "a threshold is known to an interval only that may hold more"
BEYOND_FOLD = 1.05  # of the friction at a fold: how far a branch would be followed
AS_GIVEN = "as given"  # the entries of pads
DISAGREES = "the referee disagrees: "
PROVED_ROWS = 20  # up to which thresholds of systems are always asked for
INTERVALS = 600  # that are looked at in a system of few rows
LARGE = 40.0  # states, of which an interval costs twice as much
BESIDE = (1e-8, 1e-6)  # of a threshold: how far from it growing roots are counted
ASIDE = 1e-3  # of half the gap: how far from a threshold that is refuted the search looks again
SEARCHES = 4  # in all, where the referee refutes each but the last

Interval = tuple[float, float]


@dataclass(frozen=True)
class RangeStatement(Statement):
    """The same of a list of thresholds.

    parameter: what is varied; low, until: the range that the statement is of; high: the end of what
    is listed; losses: whether a threshold lies in it; where: a value of the parameter.
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
        """In a line below a list."""
        if self.status == "proved":
            given = " (entries as given)" * (self.data != HALF_ULP)
            extent = f"up to {self.parameter} = {self.until:.9g}"
            growth = f" by more than {self.growth_below:.3g} 1/s" if self.growth_below else ""
            return f"proved: no other mode grows{growth} {extent}{given}"
        where = "" if self.where is None else f" (near {self.parameter} = {self.where.real:.9g})"
        return f"{OPEN}{self.reason}{where}"

    def to_dict(self) -> dict[str, Any]:
        """As JSON holds it: `extent` is the range that is spoken of."""
        names = ("status", "by", "growth_below", "data")
        where = None if self.where is None else float(self.where.real)
        block = {name: getattr(self, name) for name in names}
        block |= {"reason": self.reason or None, "where": where}
        return block | {"extent": [self.low, self.until]}


def stated(proof: Proof, parameter: str, extent: Interval, high: float) -> RangeStatement:
    """What a proof says; what is refuted is open to the user, with the reason."""
    status = "proved" if proof.status == "proved" else "open"
    where = None if proof.where is None else complex(proof.where)
    growth = proof.growth_below if status == "proved" else None
    reason = proof.reason
    if proof.status == "refuted":
        reason = f"{DISAGREES}{reason}"
    until = extent[1] if status == "proved" else high
    more = (parameter, extent[0], until, high)
    return RangeStatement(status, proof.by, growth, proof.data, reason, where, *more)


def _places(crossings: Sequence[Crossing], low: float, high: float, half: float) -> list[Interval]:
    """Disjoint intervals around crossings up to `high`, each wider by a share of its value."""
    found: list[Interval] = []
    for crossing in sorted(crossings, key=lambda one: one.mu):
        a, b = crossing.interval
        if a > high:
            continue
        margin = half * max(abs(a), abs(b), 1e-3 * (high - low))
        wide = (max(a - margin, low), min(b + margin, high))
        if found and wide[0] <= found[-1][1]:
            found[-1] = (found[-1][0], max(found[-1][1], wide[1]))
        else:
            found.append(wide)
    return found


def pad_statement(
    model: PadModel,
    start: ArrayLike,
    crossings: Sequence[Crossing],
    high: float,
    first: float | None,
    fastest: float,
    fold: float | None,
) -> tuple[RangeStatement, list[Interval]]:
    """What is proved of a pad along its branch, beyond its first loss of stability at least, and in
    which intervals.

    Parameters
    ----------
    model : PadModel
        The pad.
    start : array_like (3,)
        Its equilibrium without friction.
    crossings : sequence of Crossing
        All that are listed.
    high : float
        The end of the range.
    first : float or None
        The first threshold at which a mode begins to grow.
    fastest : float
        The fastest root without friction, rad/s.
    fold : float or None
        The friction at which the branch of equilibria turns back.
    """
    from squeal.proof.branches import PadBranch
    from squeal.proof.pads import Claim, prove_pad

    listed = sorted(crossings, key=lambda one: one.mu)
    claims = [Claim(one.mu, _rise(one)) for one in listed]
    end = high if fold is None else fold * BEYOND_FOLD
    try:
        branch = PadBranch(model, start, 0.0, end)
    except ImportError:
        return RangeStatement("open", None, reason=NO_BALLS, until=high, high=high), []
    proof = prove_pad(branch, claims, fold, first, RATE * fastest)
    words = proof.reason
    if proof.status == "refuted":
        words = f"{DISAGREES}{words}"
    if proof.status != "proved":
        where = None if proof.where is None else complex(proof.where)
        statement = RangeStatement(
            "open", "enclosure", data=AS_GIVEN, reason=words, where=where, until=high, high=high
        )
        return statement, []
    until = min(proof.until, high)
    statement = RangeStatement(
        "proved", "enclosure", proof.growth_below, AS_GIVEN, until=until, high=high
    )
    return statement, list(proof.places)


def _rise(crossing: Crossing) -> int:
    """By how much the number of growing roots rises at a crossing."""
    roots = 2 if crossing.kind == "flutter" else 1
    return roots if crossing.direction == "up" else -roots


def _risen(crossings: Sequence[Crossing], place: Interval) -> int:
    """The same of all crossings in an interval."""
    low, high = place
    return sum(_rise(one) for one in crossings if low <= one.mu <= high)


def _factor(term: Any, system: TermSystem) -> Callable[[Any], Any] | None:
    """The factor of a term as a function of the parameter; None where it is 1."""
    if not term.factor.names and term.factor.value({}) == 1.0:
        return None
    import flint

    values = dict(system.parameters)

    def number(x: Any) -> Any:
        return x if isinstance(x, flint.arb_series) else flint.arb(x)

    return lambda ball: term.factor.over(values | {system.parameter: ball}, number)


def vague_interval(intervals: Iterable[Interval], extent: float) -> Interval | None:
    """The first interval that says next to nothing in a range of this extent, None if none does.

    What changes twice within it would be seen by no count beside it.
    """
    return next((one for one in intervals if one[1] - one[0] > VAGUE * extent), None)


def system_statement(
    system: TermSystem, crossings: Sequence[Crossing], low: float, high: float, fastest: float
) -> tuple[RangeStatement, list[Interval]]:
    """What is proved of all thresholds of a real system, and in which intervals."""
    from squeal.proof.ranges import Term, Terms, prove_thresholds
    from squeal.proof.referee import Proof

    extent = (low, high)
    if any(isinstance(term.factor, Tabulated) for term in system.terms):
        proof = Proof("open", reason="tables over a parameter have no enclosure")
        return stated(proof, system.parameter, extent, high), []
    try:
        M, C, K = (
            [Term(_dense(term.matrix), _factor(term, system)) for term in part]
            for part in system.parts
        )
        terms = Terms(M, C, K, HALF_ULP)
    except ImportError:
        return stated(Proof("open", reason=NO_BALLS), system.parameter, extent, high), []
    states = system.n * (2 if system.C else 1)
    most = int(INTERVALS / (1.0 + (states / LARGE) ** 2))
    places = _places(crossings, low, high, WIDTH)
    rises = [_risen(crossings, place) for place in places]
    vague = vague_interval(places, high - low)
    if vague is not None:
        proof = Proof("open", "enclosure", reason=IS_VAGUE, where=sum(vague) / 2.0)
        return stated(proof, system.parameter, extent, high), []
    try:
        proof = prove_thresholds(terms, low, high, places, RATE * fastest, rises, most)
    except InputError as error:  # a factor has no value somewhere
        proof = Proof("open", reason=str(error))
    return stated(proof, system.parameter, extent, high), places if proof.status == "proved" else []


def doubt_of_counts(
    system: TermSystem, crossings: Sequence[Crossing], low: float, high: float, is_complete: bool
) -> tuple[str, float | None]:
    """What the referee's counts of growing roots leave in doubt of the thresholds of a small
    system, in words, empty if nothing; and a value near the threshold they refute, None if none.

    Counted is on both sides of each threshold and, if the list is said to be complete, at both ends
    of the range.
    """
    from squeal.proof.balls import Quadratic
    from squeal.proof.referee import unstable_count

    def count(value: float) -> Count:
        M, C, K = system.arrays({system.parameter: value})
        damping = None if C is None else _dense(C)
        return unstable_count(Quadratic.of(_dense(M), damping, _dense(K), HALF_ULP))

    doubt = ""
    places = _places(crossings, low, high, 0.0)
    edges = [low, *(end for place in places for end in place), high]
    for k, (a, b) in enumerate(places):
        room_below = (a - edges[2 * k]) / 2.0
        room_above = (edges[2 * k + 3] - b) / 2.0
        if min(room_below, room_above) <= 0.0:
            is_complete = False  # at an end of the range, beyond which nothing is counted
            continue
        for share in BESIDE:
            margin = share * max(abs(a), abs(b), 1e-3 * (high - low))
            below = count(a - min(margin, room_below))
            above = count(b + min(margin, room_above))
            if below.is_certain and above.is_certain:
                break
        else:
            doubt = f"the referee cannot count what grows on both sides of {(a + b) / 2.0:.9g}"
        if not _may_rise(below, above, _risen(crossings, (a, b))):
            words = f"{below.lower} roots grow below {a:.9g} and {above.lower} above"
            return f"{DISAGREES}{words}", b + ASIDE * room_above
    if is_complete:
        below = count(low)
        above = count(high)
        if not _may_rise(below, above, _risen(crossings, (low, high))):
            words = f"{below.lower} roots grow at {low:.9g} and {above.lower} at {high:.9g}"
            return f"{DISAGREES}{words}", (low + high) / 2.0
    return doubt, None


def _may_rise(below: Count, above: Count, rise: int) -> bool:
    """True if the number of growing roots may rise by so much from one count to the other."""
    return above.lower - below.upper <= rise <= above.upper - below.lower


def _dense(matrix: Any) -> Any:
    return matrix.toarray() if hasattr(matrix, "toarray") else np.asarray(matrix)
