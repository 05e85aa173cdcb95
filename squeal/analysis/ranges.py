"""What the referee says of thresholds: of a pad up to its first loss, of a small system of all."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from squeal.analysis.answers import OPEN
from squeal.analysis.systems.proofs import DATA, Statement
from squeal.errors import InputError
from squeal.linear.events import Crossing
from squeal.linear.moduli import Tabulated
from squeal.linear.system import TermSystem
from squeal.model.equations import PadModel

if TYPE_CHECKING:  # scenes start without the referee
    from squeal.proof.ranges import Provider
    from squeal.proof.referee import Proof

NO_BALLS = "python-flint is not installed (`pip install 'squeal[proof]'` brings it)"
RATE = 1e-6  # growth below which nothing is told apart, of the fastest root
WIDTHS = (1e-10, 1e-8)  # half widths, of a threshold, in which it may be proved
BEFORE_FOLD = 1e-4  # of the friction at a fold: what is left out before it
BEYOND = 1e-3  # of a threshold: how far beyond it what grows is proved, at most
PROVED_ROWS = 20  # up to which thresholds of systems are always asked for
WORK = 4e5  # intervals of one gap times the squared rows and a constant

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
    def words(self) -> str:
        """In a line below a list."""
        if self.status == "proved":
            given = " (entries as given)" * (self.data != DATA)
            extent = f"up to {self.parameter} = {self.until:.9g}"
            growth = f"{self.growth_below or 0.0:.3g} 1/s"
            return f"proved: no other mode grows by more than {growth} {extent}{given}"
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
        reason = f"the referee disagrees: {reason}"
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


def _proved(
    provider: Provider,
    extent: Interval,
    crossings: Sequence[Crossing],
    rate: float,
    cuts: Sequence[float] = (),
    most: int = 4000,
) -> tuple[Proof, list[Interval]]:
    """The proof for the narrowest places that have one."""
    from squeal.proof.ranges import prove_thresholds

    for half in WIDTHS:
        places = _places(crossings, *extent, half)
        proof = prove_thresholds(provider, *extent, places, rate, cuts=cuts, most=most)
        if proof.status == "proved" or not crossings:
            break
    return proof, places


def pad_statement(
    model: PadModel,
    start: ArrayLike,
    crossings: Sequence[Crossing],
    high: float,
    first: float | None,
    fastest: float,
    fold: float | None,
) -> tuple[RangeStatement, list[Interval]]:
    """What is proved of a pad up to its first loss of stability, and in which intervals.

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
    until = high if fold is None else fold * (1.0 - BEFORE_FOLD)
    if first is not None and first < until:
        later = [one.mu for one in crossings if one.mu > first * (1.0 + 1e-9)]
        nearest = min([*later, until])
        until = first + min(BEYOND * first, (nearest - first) / 2.0)
    seen = [one for one in crossings if one.mu <= until]
    extent = (0.0, until)
    from squeal.proof.pads import PadBranch
    from squeal.proof.referee import Proof

    try:
        branch = PadBranch(model, start, *extent)
    except ImportError:
        proof = Proof("open", reason=NO_BALLS)
        return stated(proof, "mu", extent, high), []
    cuts = [cell.high for cell in branch.cells]
    proof, places = _proved(branch, extent, seen, RATE * fastest, cuts)
    return stated(proof, "mu", extent, high), places if proof.status == "proved" else []


def _factor(term: Any, system: TermSystem) -> Callable[[Any], Any] | None:
    """The factor of a term as a function of the parameter; None where it is 1."""
    if not term.factor.names and term.factor.value({}) == 1.0:
        return None
    import flint

    values = dict(system.parameters)
    return lambda ball: term.factor.over(values | {system.parameter: ball}, flint.arb)


def system_statement(
    system: TermSystem, crossings: Sequence[Crossing], low: float, high: float, fastest: float
) -> tuple[RangeStatement, list[Interval]]:
    """What is proved of all thresholds of a real system, and in which intervals."""
    from squeal.proof.ranges import Term, Terms
    from squeal.proof.referee import Proof

    extent = (low, high)
    if any(isinstance(term.factor, Tabulated) for term in system.terms):
        proof = Proof("open", reason="tables over a parameter have no enclosure")
        return stated(proof, system.parameter, extent, high), []
    try:
        M, C, K = (
            [Term(_dense(term.matrix), _factor(term, system)) for term in terms]
            for terms in system.parts
        )
        provider = Terms(M, C, K, DATA)
    except ImportError:
        return stated(Proof("open", reason=NO_BALLS), system.parameter, extent, high), []
    most = int(WORK / (200.0 + 6.0 * system.n**2))
    try:
        proof, places = _proved(provider, extent, crossings, RATE * fastest, most=most)
    except InputError as error:  # a factor has no value somewhere
        proof, places = Proof("open", reason=str(error)), []
    return stated(proof, system.parameter, extent, high), places if proof.status == "proved" else []


def _dense(matrix: Any) -> Any:
    return matrix.toarray() if hasattr(matrix, "toarray") else np.asarray(matrix)
