"""The stored pads judged afresh: at half and double tolerance, and over a doubled horizon."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from squeal.article.claims import CLAIMS
from squeal.article.identify.objective import CONFLICTS, judge_one
from squeal.article.identify.space import STOP
from squeal.article.identify.stored import Search, read_searches
from squeal.article.results.claims import JudgedClaim
from squeal.article.results.verify import Changed, Failing, Switches, VerifiedPad, Verify
from squeal.errors import ComputationError
from squeal.model.contact import FORMULATION_CHOICES

TOLERANCE = 1e-12
VARIATIONS = {
    "half tolerance": (0.5 * TOLERANCE, STOP),
    "double tolerance": (2.0 * TOLERANCE, STOP),
    "doubled horizon": (TOLERANCE, 2.0 * STOP),
}


def _verdicts(judged: list[JudgedClaim]) -> dict[str, str]:
    return {j.id: j.verdict for j in judged}


def verified(search: Search) -> VerifiedPad:
    """How many claims a stored pad keeps, which not and why, and what the variations change."""
    judged = judge_one(search.numbers, search.formulation, TOLERANCE)
    verdicts = _verdicts(judged)
    changed = []
    for words, (tolerance, stop) in VARIATIONS.items():
        try:
            other = _verdicts(judge_one(search.numbers, search.formulation, tolerance, stop))
        except ComputationError as error:
            changed.append(Changed(words, "", str(error)))
            continue
        changed += [
            Changed(words, name, verdict)
            for name, verdict in other.items()
            if verdict != verdicts[name]
        ]
    failing = [j for j in judged if not j.holds]
    return VerifiedPad(
        formulation=Switches(
            **{name: getattr(search.formulation, name) for name in FORMULATION_CHOICES}
        ),
        seed=search.seed,
        starts=search.starts,
        pads=search.pads,
        numbers=search.numbers,
        reproduced=len(judged) - len(failing),
        failing=tuple(Failing(j.id, j.verdict, j.margin, j.measured) for j in failing),
        changed=tuple(changed),
    )


def study(files: Sequence[Path]) -> Verify:
    """The outcome for every stored search."""
    found = tuple(verified(search) for search in read_searches(files))
    return Verify(found, len(CLAIMS) - len(CONFLICTS), STOP)
