"""Does the article hold? A verdict on each of its conclusions, from the results alone.

The text of the chapter gives the evidence; each verdict is a condition on results, so that it turns
where they do.
"""

from __future__ import annotations

from squeal.article.report.latex import Generated
from squeal.article.results.angles import Angles
from squeal.article.results.claims import Claims
from squeal.article.results.loci import Branch, Loci
from squeal.article.results.quasi_static import QuasiStatic

SMALL = 0.25  # of the map, as in the statement B3-small-region


def hammering(held: dict[str, bool]) -> str:
    """Case (c) alone hammers with the line contact, and most severely with both."""
    if held["B2-c-hammer"] and held["B2-only-c"] and held["B12-c-severe"]:
        return "holds for one pad"
    return "not reproduced"


def exaggeration(held: dict[str, bool]) -> str:
    """Point contacts lose contact in each case and for longer, the line contact in one only."""
    if held["B1-all-separate"] and held["B2-only-c"] and held["B12-more-loss"]:
        return "holds for one pad"
    return "not reproduced"


def region(angles: Angles, printed: QuasiStatic) -> str:
    """Quasi-static sliding is possible in a small region only."""
    if printed.share.as_printed >= SMALL:
        return "not reproduced"
    return "does not hold" if angles.share.quiet >= SMALL else "holds"


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


def generated(claims: Claims, angles: Angles, printed: QuasiStatic, loci: Loci) -> Generated:
    """The verdicts, and what the evidence counts."""
    held = {c.id: c.verdict == "reproduced" for c in claims.claims}
    counts = {model: directions(loci, model) for model in ("B1", "B2")}
    differ = any(lost and kept for lost, kept in counts.values())
    values = {
        "verdict.hammering": hammering(held),
        "verdict.exaggeration": exaggeration(held),
        "verdict.region": region(angles, printed),
        "verdict.singular": singular(held, angles),
        "verdict.raised": "holds for one pad" if held["B2-b-raised"] else "not reproduced",
        "verdict.settles": "cannot fail" if held["B3-none"] else "not reproduced",
        "verdict.directions": "supported" if differ else "not supported",
    }
    for model, (lost, kept) in counts.items():
        values |= {f"verdict.{model}.lost": str(lost), f"verdict.{model}.kept": str(kept)}
    return values, {}
