"""From measures to verdicts. Each rule gives a signed margin: the claim holds where it is positive.

Margins are shares of time, forces over F_n, lengths over w, or relative differences, whichever the
claim is about. A separation counts if its share of the time exceeds `TOUCH`, far above the
accuracy of the located contact changes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Literal

from squeal.article.claims.catalogue import CLAIMS, Claim
from squeal.article.claims.measures import Case, measure
from squeal.article.equations import quasi_static_map, stiffness
from squeal.model.linear import rank
from squeal.model.pad import Pad
from squeal.model.states import FULL, LEAD, LEADING, NONE, TRAIL, TRAILING, State
from squeal.scene import Scene

TOUCH = 1e-9
CALM = 0.01  # accelerations below this share of the greatest count as settled
SMALL = 0.25  # of the map
ALTERNATE = 2 / 3  # of successive contact losses that must be at the other edge
HAMMER = 0.1  # of w, how far delta must go to each side
SWINGS = 4  # changes of side that make a motion repeated

Verdict = Literal["reproduced", "not reproduced", "contradicted"]
Cases = Mapping[str, Case]


@dataclass(frozen=True)
class Linear:
    """What the claims on model B3 need: ranks of K by case, share of the map where (23) holds."""

    ranks: Mapping[str, int]
    share_as_printed: float


@dataclass(frozen=True)
class Judged:
    """A claim with what was measured, its margin and the verdict."""

    claim: Claim
    measured: str
    margin: float
    verdict: Verdict


def linear_measures(pads: Mapping[str, Pad], points: int = 500) -> Linear:
    """Rank of Eq. (22) for the pad of each case, and what (23a, b) make of the map over the angles.

    The map has `points` middles of cells a side; it leaves the pads' own angles aside, so that one
    of the pads tells it.
    """
    pad = next(iter(pads.values()))
    ranks = {case: rank(pad, stiffness(pad)) for case, pad in pads.items()}
    return Linear(ranks, quasi_static_map(pad, points).share.as_printed)


Result = tuple[float, str]


def _apart(case: Case, edge: int) -> float:
    """Share of time that an edge is apart; below TOUCH none, told by how near to zero it came."""
    share = case.separated[edge] / case.duration
    low = (case.first if edge == LEADING else case.second).low
    return share if share > TOUCH else -max(low, 0.0)


def _loses(edge: int) -> Callable[[Case], Result]:
    def rule(case: Case) -> Result:
        share = case.separated[edge] / case.duration
        return _apart(case, edge), f"apart {100 * share:.2f} % of the time"

    return rule


def _share(case: Case, state: State) -> float:
    return case.shares.get(state, 0.0)


def _states(wanted: tuple[State, ...], unwanted: tuple[State, ...]) -> Callable[[Case], Result]:
    def rule(case: Case) -> Result:
        present = min(_share(case, state) - TOUCH for state in wanted)
        excess = max((_share(case, state) for state in unwanted), default=0.0)
        numbers = ", ".join(f"{100 * _share(case, s):.2f}" for s in (FULL, NONE, LEAD, TRAIL))
        margin = present if excess <= TOUCH else -excess
        return margin, f"shares of states 1 to 4: {numbers} %"

    return rule


def _band(value: float, low: float, high: float) -> float:
    return min(value - low, high - value)


def _positive(signal: str, unit: str) -> Callable[[Case], Result]:
    def rule(case: Case) -> Result:
        low = getattr(case, signal).low
        return low, f"least value {low:.4g} {unit}".strip()

    return rule


def _alternate(case: Case) -> Result:
    pairs = list(zip(case.losses, case.losses[1:], strict=False))
    if not pairs:
        return -1.0, f"{len(case.losses)} contact losses"
    share = sum(a != b for a, b in pairs) / len(pairs)
    margin = share - ALTERNATE if set(case.losses) == {LEADING, TRAILING} else -1.0
    return margin, f"{100 * share:.0f} % of {len(pairs)} successive losses at the other edge"


def _peaks(case: Case) -> Result:
    ratio = case.second.high / case.first.high
    return ratio - 1.0, f"max F4 / max F3 = {ratio:.3f}"


def _ratio(case: Case) -> Result:
    ratio = case.first.high / case.second.high
    return _band(ratio, 2.5, 3.0), f"max F3 / max F4 = {ratio:.3f}"


def _leading(case: Case) -> Result:
    margin = min(-case.second.high, case.tilt.low)
    return margin, f"greatest delta/w {case.second.high:.4g}, least tilt {case.tilt.low:.3g} rad"


def _hammer(case: Case) -> Result:
    reach = min(case.second.high, -case.second.low) - HAMMER
    margin = reach if case.swings >= SWINGS else min(reach, 0.0) - 1.0
    _, sides = _inside(case)
    return margin, f"{sides}, {case.swings} changes of side"


def _inside(case: Case) -> Result:
    margin = min(case.second.low, 1.0 - case.second.high)
    return margin, f"delta/w from {case.second.low:.3f} to {case.second.high:.3f}"


def _surface_loss(case: Case) -> float:
    """Share of time without contact; below TOUCH none, told by the least reaction."""
    share = _share(case, NONE)
    return share if share > TOUCH else -max(case.first.low, 0.0)


def _loss(case: Case) -> Result:
    return _surface_loss(case), f"apart {100 * _share(case, NONE):.2f} % of the time"


_ONE: dict[str, Callable[[Case], Result]] = {
    "B1-a-lead-loss": _loses(LEADING),
    "B1-a-trail-loss": _loses(TRAILING),
    "B1-a-trail-high": _peaks,
    "B1-a-states": _states((FULL, NONE, LEAD, TRAIL), ()),
    "B1-b-trail-loss": _loses(TRAILING),
    "B1-b-lead-kept": _positive("first", "F_n"),
    "B1-b-states": _states((FULL, LEAD), (NONE, TRAIL)),
    "B1-b-ratio": _ratio,
    "B1-c-sum": _positive("together", "F_n"),
    "B1-c-states": _states((FULL, LEAD, TRAIL), (NONE,)),
    "B1-d-states": _states((FULL, LEAD, TRAIL), (NONE,)),
    "B1-d-mostly-full": lambda case: (
        _share(case, FULL) - 0.5,
        f"state 1 for {100 * _share(case, FULL):.1f} % of the time",
    ),
    "B1-d-alternate": _alternate,
    "B2-a-contact": _positive("first", "F_n"),
    "B2-a-leading": _leading,
    "B2-b-contact": _positive("first", "F_n"),
    "B2-b-trailing": _positive("second", "w"),
    "B2-b-tilt": lambda case: (-case.tilt.high, f"greatest tilt {case.tilt.high:.3g} rad"),
    "B2-c-loss": _loss,
    "B2-c-hammer": _hammer,
    "B2-d-contact": _positive("first", "F_n"),
    "B2-d-trailing": _inside,
}


def _all_separate(b1: Cases) -> Result:
    apart = {name: max(_apart(case, edge) for edge in (0, 1)) for name, case in b1.items()}
    least = min(apart, key=lambda name: apart[name])
    return apart[least], f"least in case {least}: {100 * max(apart[least], 0.0):.2f} % of the time"


def _theta(b1: Cases, b2: Cases) -> Result:
    low = min(b1["b"].tilt.low, b2["b"].tilt.low)
    return low, f"least tilt B1 {b1['b'].tilt.low:.3g}, B2 {b2['b'].tilt.low:.3g} rad"


def _twice(b2: Cases) -> Result:
    ratio = b2["b"].mean / b2["a"].mean
    return _band(ratio, 1.7, 2.0), f"mean Rn of b / mean Rn of a = {ratio:.3f}"


def _only_c(b2: Cases) -> Result:
    margins = {name: _surface_loss(case) for name, case in b2.items()}
    margin = min(margins[name] if name == "c" else -margins[name] for name in margins)
    apart = [name for name, value in margins.items() if value > 0.0]
    return margin, f"surfaces separate in: {', '.join(apart) or 'no case'}"


def _none_settles(cases: list[Case]) -> Result:
    calmest = min(case.calm for case in cases)
    return calmest - CALM, f"least late acceleration {100 * calmest:.0f} % of the greatest"


def _linear(linear: Linear) -> dict[str, Result]:
    ranks = ", ".join(str(rank) for rank in linear.ranks.values())
    share = linear.share_as_printed
    return {
        "B3-singular": (2.5 - max(linear.ranks.values()), f"rank in cases a to d: {ranks}"),
        "B3-small-region": (SMALL - share, f"{100 * share:.1f} % of the map"),
    }


def judge_claims(b1: Cases, b2: Cases, linear: Linear) -> list[Judged]:
    """Judge all claims from the measures of the four cases of each model, in catalogue order.

    A claim that fails while the one it conflicts with holds is contradicted.
    """
    results = _linear(linear)
    results["B1-all-separate"] = _all_separate(b1)
    results["B2-b-theta"] = _theta(b1, b2)
    results["B2-b-twice"] = _twice(b2)
    results["B2-only-c"] = _only_c(b2)
    results["B3-none"] = _none_settles([*b1.values(), *b2.values()])
    for claim in CLAIMS:
        if claim.id in _ONE:
            cases = b1 if claim.id.startswith("B1") else b2
            results[claim.id] = _ONE[claim.id](cases[claim.case])
    judged = [
        Judged(claim, measured, margin, "reproduced" if margin > 0.0 else "not reproduced")
        for claim in CLAIMS
        for margin, measured in [results[claim.id]]
    ]
    holding = {j.claim.id for j in judged if j.verdict == "reproduced"}
    return [
        replace(j, verdict="contradicted")
        if j.verdict == "not reproduced" and j.claim.conflicts in holding
        else j
        for j in judged
    ]


def judge_scenes(b1: Mapping[str, Scene], b2: Mapping[str, Scene]) -> list[Judged]:
    """Simulate and judge the four cases of each model. Raises ComputationError where one ends."""
    first, second = ({case: measure(s) for case, s in scenes.items()} for scenes in (b1, b2))
    return judge_claims(first, second, linear_measures({c: s.pad for c, s in b2.items()}))
