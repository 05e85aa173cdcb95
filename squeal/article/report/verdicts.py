"""Does the article hold? A verdict on each of its conclusions, from the results alone.

The text of the chapter gives the evidence; each verdict is a condition on results, so that it turns
where they do.
"""

from __future__ import annotations

from collections.abc import Sequence

from squeal.article.cases import CASES
from squeal.article.report.latex import Generated, in_words, number, percent
from squeal.article.report.pads import consistent
from squeal.article.results.angles import Angles
from squeal.article.results.claims import Claims, Reach
from squeal.article.results.ensembles import Ensembles
from squeal.article.results.loci import Branch, Loci
from squeal.article.results.map_ranges import MapRanges, Upright
from squeal.article.results.quasi_static import QuasiStatic

SMALL = 0.25  # of the map, as in the statement B3-small-region
MOST = 0.5  # of random pads


def of_pads(held: dict[str, bool], found: Ensembles, name: str) -> str:
    """A conclusion about motions: for which pads its statements hold together.

    The pad of the report, and those stored of all searches.
    """
    one = found.conclusions[name]
    own, others = all(held[s] for s in one.statements), one.every.keep
    if own:
        return "holds for this pad and some others" if others else "holds for this pad alone"
    return "holds for some other pads" if others else "not reproduced by any pad"


def by_reach(found: Sequence[Reach]) -> str:
    """Which cases hammer with both models, by how far delta must go to each side."""

    def cases(one: Reach) -> str:
        return in_words([f"({name})" for name in one.cases]) or "no case"

    by: dict[str, list[str]] = {}
    for one in found:
        by.setdefault(cases(one), []).append(number(one.reach, 2))
    told = [f"{names} if $\\delta$ must reach {in_words(r)}\\,$w$" for names, r in by.items()]
    if len(told) == 1:
        return f"{next(iter(by))} for each swing of {in_words(by[next(iter(by))])}\\,$w$"
    return "; ".join(told)


def argued(held: dict[str, bool]) -> str:
    """How much of the exaggeration rests on the reading of it as a share of time."""
    if held["B1-all-separate"] and held["B2-only-c"] and not held["B12-more-loss"]:
        return (
            "The pad of this report keeps what the article argues with, a loss in each case of B1 "
            "and of the whole contact in (c) only of B2, but not our reading of it as a share of "
            "time"
        )
    if held["B1-all-separate"] and held["B2-only-c"]:
        return "The pad of this report reproduces it"
    return "The pad of this report does not reproduce what the article argues with"


def region(full: Upright, printed: QuasiStatic) -> str:
    """Quasi-static sliding, kept and in full contact, is possible in a small region only."""
    if printed.share.as_printed >= SMALL:
        return "not reproduced"
    if full.small == 0:
        return "does not hold"
    return "holds" if full.small == full.pads else "depends on the pad"


def singular(held: dict[str, bool], angles: Angles) -> str:
    """A singular matrix leaves no solution, or many."""
    if not held["B3-singular"]:
        return "not reproduced"
    return "does not follow" if angles.share.exists > 0.0 else "follows"


def directions(loci: Loci, model: str) -> tuple[int, int]:
    """How many cases of a model lose stability up to the greatest friction, and how many do not."""
    branches = [s.branch for s in loci.scenes if s.model == model]
    lost = sum(isinstance(b, Branch) and bool(b.thresholds) for b in branches)
    return lost, len(branches) - lost


def raised(held: dict[str, bool], found: Ensembles) -> tuple[str, float]:
    """Whether friction raises the reaction in case (b), and on which share of random pads.

    Of those of the consistent law whose motions reach the end.
    """
    one = consistent(found)
    share = one.chance["B2-b-raised"].share * one.random / one.ran
    if not held["B2-b-raised"]:
        return "not reproduced", share
    return "holds for most pads" if share > MOST else "holds for some pads", share


def generated(
    claims: Claims,
    angles: Angles,
    printed: QuasiStatic,
    loci: Loci,
    ensembles: Ensembles,
    ranges: MapRanges,
) -> Generated:
    """The verdicts, and what the evidence counts."""
    held = {c.id: c.verdict == "reproduced" for c in claims.claims}
    counts = {model: directions(loci, model) for model in ("B1", "B2")}
    cases = claims.hammering[0].cases
    of_raised, share = raised(held, ensembles)
    values = {
        "verdict.hammering": of_pads(held, ensembles, "hammering"),
        "verdict.reach": by_reach(claims.hammering),
        "verdict.exaggeration": of_pads(held, ensembles, "exaggeration"),
        "verdict.argued": argued(held),
        "verdict.region": region(ranges.full, printed),
        "verdict.singular": singular(held, angles),
        "verdict.raised": of_raised,
        "verdict.raised.share": percent(share, 0),
        "verdict.settles": "cannot fail" if held["B3-none"] else "not reproduced",
        "verdict.directions": "supported" if 0 < len(cases) < len(CASES) else "not supported",
    }
    for model, (lost, kept) in counts.items():
        values |= {f"verdict.{model}.lost": str(lost), f"verdict.{model}.kept": str(kept)}
    return values, {}
