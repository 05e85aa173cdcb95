"""Rules of the claims: each gives a signed margin and what was measured, in words.

A claim holds where its margin is positive. Margins are shares of time, forces over F_n, lengths
over w, or relative differences, whichever the claim is about. A separation counts if its share of
the time exceeds `TOUCH`, far above the accuracy of the located contact changes.
"""

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from squeal.article.cases import SMALL_REGION
from squeal.article.claims.measures import Case, Linear
from squeal.article.claims.motions import LEVELS
from squeal.model.contact import FULL, LEAD, LEADING, NONE, TRAIL, TRAILING, State

TOUCH = 1e-9
CALM = 0.01  # accelerations below this share of the greatest count as settled
ALTERNATE = 2 / 3  # of successive contact losses that must be at the other edge
LEVEL = 0.05  # of F_n T_1, the least impulse of a blow; one of `LEVELS`
TURNS = 4  # changes of the edge that is struck which make a motion hammer


class Outcome(NamedTuple):
    """Signed margin and what was measured, in words."""

    margin: float
    measured: str


def _band(value: float, low: float, high: float) -> float:
    """The margin of a value that must lie between two."""
    return min(value - low, high - value)


def _share(case: Case, state: State) -> float:
    return case.shares.get(state, 0.0)


def _apart(case: Case, edge: int) -> float:
    """Share of time that an edge is separated; below TOUCH none, then less its least force."""
    share = case.separated[edge] / case.duration
    if share > TOUCH:
        return share
    force = case.first if edge == LEADING else case.second
    return -max(force.low, 0.0)


def _surface_apart(case: Case) -> float:
    """Share of time without contact; below TOUCH none, then less the least reaction."""
    share = _share(case, NONE)
    return share if share > TOUCH else -max(case.first.low, 0.0)


# model B1


def apart(edge: int) -> Callable[[Case], Outcome]:
    """An edge separates."""

    def rule(case: Case) -> Outcome:
        share = case.separated[edge] / case.duration
        return Outcome(_apart(case, edge), f"separated {100 * share:.2f} % of the time")

    return rule


def states(wanted: tuple[State, ...], unwanted: tuple[State, ...]) -> Callable[[Case], Outcome]:
    """All wanted states occur and no unwanted one."""

    def rule(case: Case) -> Outcome:
        present = min(_share(case, state) - TOUCH for state in wanted)
        excess = max((_share(case, state) for state in unwanted), default=0.0)
        numbers = ", ".join(f"{100 * _share(case, s):.2f}" for s in (FULL, NONE, LEAD, TRAIL))
        margin = present if excess <= TOUCH else -excess
        return Outcome(margin, f"shares of states 1 to 4: {numbers} %")

    return rule


def trailing_higher(case: Case) -> Outcome:
    """F4 has the higher peak."""
    ratio = case.second.high / case.first.high
    return Outcome(ratio - 1.0, f"max F4 / max F3 = {ratio:.3f}")


def leading_almost_threefold(case: Case) -> Outcome:
    """The peak of F3 is 2.5 to 3 times that of F4."""
    ratio = case.first.high / case.second.high
    return Outcome(_band(ratio, 2.5, 3.0), f"max F3 / max F4 = {ratio:.3f}")


def mostly_full(case: Case) -> Outcome:
    """State 1 lasts more than half of the time."""
    share = _share(case, FULL)
    return Outcome(share - 0.5, f"state 1 for {100 * share:.1f} % of the time")


def alternate(case: Case) -> Outcome:
    """Contact losses alternate between the edges."""
    pairs = list(itertools.pairwise(case.losses))
    if not pairs:
        return Outcome(-1.0, f"{len(case.losses)} contact losses")
    share = sum(a != b for a, b in pairs) / len(pairs)
    margin = share - ALTERNATE if set(case.losses) == {LEADING, TRAILING} else -1.0
    measured = f"{100 * share:.0f} % of {len(pairs)} successive losses at the other edge"
    return Outcome(margin, measured)


def each_separates(*cases: Case) -> Outcome:
    """At least one edge separates in each of cases a to d."""
    apart = {}
    for name, case in zip("abcd", cases, strict=True):
        apart[name] = max(_apart(case, LEADING), _apart(case, TRAILING))
    least = min(apart, key=lambda name: apart[name])
    measured = f"least in case {least}: {100 * max(apart[least], 0.0):.2f} % of the time"
    return Outcome(apart[least], measured)


# models B1 and B2


def positive(signal: str, unit: str) -> Callable[[Case], Outcome]:
    """A range of the measures (`first`, `second`, `together`) stays above zero."""

    def rule(case: Case) -> Outcome:
        low = getattr(case, signal).low
        return Outcome(low, f"least value {low:.4g} {unit}")

    return rule


def tilted_down(case: Case) -> Outcome:
    """theta0 + theta stays negative."""
    return Outcome(-case.tilt.high, f"greatest tilt {case.tilt.high:.3g} rad")


def tilted_up(case: Case) -> Outcome:
    """theta0 + theta stays positive."""
    measured = (
        f"least tilt {case.tilt.low:.3g} rad, negative for {100 * case.down:.1f} % of the time"
    )
    return Outcome(case.tilt.low, measured)


def trailing_edge_alone(case: Case) -> Outcome:
    """Where contact is lost, it is at the trailing edge; without a loss nothing contradicts it.

    If the leading edge is separated for a share of the time above `TOUCH`, the margin is minus that
    share; else it is the share in which the leading edge touches, at least 1 - `TOUCH`.
    """
    # shares of time in which the edges are separated
    leading = case.separated[LEADING] / case.duration
    trailing = case.separated[TRAILING] / case.duration
    margin = -leading if leading > TOUCH else 1.0 - leading
    measured = (
        f"leading edge off for {100 * leading:.1f} % of the time, trailing edge for "
        f"{100 * trailing:.1f} %"
    )
    if max(leading, trailing) <= TOUCH:
        measured = "no edge separates, so that nothing contradicts it"
    return Outcome(margin, measured)


def both_tilted_up(b1: Case, b2: Case) -> Outcome:
    """theta0 + theta stays positive in both models."""
    measured = f"least tilt B1 {b1.tilt.low:.3g}, B2 {b2.tilt.low:.3g} rad"
    return Outcome(min(b1.tilt.low, b2.tilt.low), measured)


def none_settles(*cases: Case) -> Outcome:
    """No case settles into zero acceleration."""
    calmest = min(case.calm for case in cases)
    return Outcome(calmest - CALM, f"least late acceleration {100 * calmest:.0f} % of the greatest")


def hammers(case: Case, level: float = LEVEL) -> Outcome:
    """The edge that blows strike changes at least `TURNS` times, and at each edge the force
    vanishes for some share of the time.

    A blow, in both models, is a time in which the resultant of the contact force stays on one half
    of the face, if its impulse exceeds `level` F_n T_1, one of `motions.LEVELS`.

    The margin of a case that hammers is the share of time without force, at the edge where that
    share is less. The margin of another case is negative: -(1 - turns / TURNS) if changes of the
    edge are missing, and less by TOUCH - share if that share is too small.
    """
    turns = case.blows[LEVELS.index(level)]  # changes of the edge struck
    without_force = min(case.vanishes)  # share of time, at the edge where it is less
    leading, trailing = case.heaviest
    measured = (
        f"{turns} changes of the edge struck, heaviest blows {leading:.3g} and {trailing:.3g} "
        f"F_n T_1, least share without force at an edge {100 * without_force:.3g} %"
    )
    if turns >= TURNS and without_force > TOUCH:
        return Outcome(without_force, measured)
    missing_turns = max(1.0 - turns / TURNS, 0.0)
    missing_share = max(TOUCH - without_force, 0.0)  # far below 1 / TURNS, that of a missing change
    return Outcome(-missing_turns - missing_share, measured)


def hammering_cases(cases: Mapping[str, Case], level: float = LEVEL) -> dict[str, tuple[str, ...]]:
    """The cases that hammer by model, from the measures by name (`b1-a` to `b2-d`)."""
    b1: list[str] = []
    b2: list[str] = []
    for name, case in cases.items():
        if hammers(case, level).margin > 0.0:
            cases_of_model = b1 if name.startswith("b1") else b2
            cases_of_model.append(name[-1])
    return {"B1": tuple(b1), "B2": tuple(b2)}


def only_c_hammers(*cases: Case) -> Outcome:
    """Case c hammers in both models, no other case does. The cases of B1 come first."""
    both = {}  # the margin by which both models hammer
    for name, b1, b2 in zip("abcd", cases[:4], cases[4:], strict=True):
        both[name] = min(hammers(b1).margin, hammers(b2).margin)
    margin = min(value if name == "c" else -value for name, value in both.items())
    which = ", ".join(name for name, value in both.items() if value > 0.0)
    return Outcome(margin, f"hammers with both models in: {which or 'no case'}")


def more_loss_in_b1(*cases: Case) -> Outcome:
    """In more cases of B1 than of B2 the force at an edge vanishes."""

    def losing(four: Sequence[Case]) -> list[str]:
        return [n for n, case in zip("abcd", four, strict=True) if max(case.vanishes) > TOUCH]

    b1 = losing(cases[:4])
    b2 = losing(cases[4:])
    measured = (
        f"an edge loses its force in {', '.join(b1) or 'no case'} of B1, "
        f"in {', '.join(b2) or 'no case'} of B2"
    )
    return Outcome((len(b1) - len(b2)) / 4, measured)


def sliding_lasts(*cases: Case) -> Outcome:
    """The pad is never as fast as the surface, by x_dot; its lower face, where friction
    acts, is printed beside."""
    slip = max(case.slip for case in cases)
    face = max(case.face for case in cases)
    measured = f"the pad reaches {100 * slip:.2g} % of the surface's speed"
    if not math.isnan(face):
        measured += f", its lower face {100 * face:.2g} % while it touches"
    return Outcome(1.0 - slip, measured)


def friction_raises(case: Case) -> Outcome:
    """The reaction of the sliding equilibrium exceeds that without friction."""
    measured = f"friction raises the reaction at rest by {100 * case.raised:.3g} %"
    return Outcome(case.raised, measured)


# model B2


def on_leading_edge(case: Case) -> Outcome:
    """delta stays negative and the tilt positive."""
    margin = min(-case.second.high, case.tilt.low)
    measured = f"greatest delta/w {case.second.high:.4g}, least tilt {case.tilt.low:.3g} rad"
    return Outcome(margin, measured)


def within_trailing_half(case: Case) -> Outcome:
    """0 < delta < w."""
    margin = min(case.second.low, 1.0 - case.second.high)
    return Outcome(margin, f"delta/w from {case.second.low:.3f} to {case.second.high:.3f}")


def surfaces_separate(case: Case) -> Outcome:
    """The surfaces separate for some time."""
    measured = f"separated {100 * _share(case, NONE):.2f} % of the time"
    return Outcome(_surface_apart(case), measured)


def only_c_separates(*cases: Case) -> Outcome:
    """Of cases a to d the surfaces separate in c only."""
    margins = dict(zip("abcd", map(_surface_apart, cases), strict=True))
    margin = min(value if name == "c" else -value for name, value in margins.items())
    apart = [name for name, value in margins.items() if value > 0.0]
    return Outcome(margin, f"surfaces separate in: {', '.join(apart) or 'no case'}")


def mean_almost_doubles(a: Case, b: Case) -> Outcome:
    """The mean reaction of case b is 1.7 to 2 times that of case a."""
    ratio = b.mean / a.mean
    return Outcome(_band(ratio, 1.7, 2.0), f"mean Rn of b / mean Rn of a = {ratio:.3f}")


# model B3


def singular(linear: Linear) -> Outcome:
    """K of Eq. (22) is singular in all cases."""
    ranks = ", ".join(str(rank) for rank in linear.ranks.values())
    return Outcome(2.5 - max(linear.ranks.values()), f"rank in cases a to d: {ranks}")


def small_region(linear: Linear) -> Outcome:
    """(23a, b) hold on a small part of the map; the share of the complete ones is printed too."""
    printed = linear.share.as_printed
    complete = linear.share.complete
    measured = (
        f"{100 * printed:.1f} % of the map; the complete necessary conditions hold on "
        f"{100 * complete:.1f} %"
    )
    return Outcome(SMALL_REGION - printed, measured)
