"""The stored pads judged afresh: at half and double tolerance, and over a doubled horizon."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from squeal.article.claims import Judged
from squeal.article.identify.objective import judge_one
from squeal.article.identify.space import STOP
from squeal.article.identify.stored import Search, read_searches
from squeal.errors import ComputationError
from squeal.files.provenance import provenance
from squeal.files.writing import to_json

TOLERANCE = 1e-12
VARIATIONS = {
    "half tolerance": (0.5 * TOLERANCE, STOP),
    "double tolerance": (2.0 * TOLERANCE, STOP),
    "doubled horizon": (TOLERANCE, 2.0 * STOP),
}


def _verdicts(judged: list[Judged]) -> dict[str, str]:
    return {j.claim.id: j.verdict for j in judged}


def verified(search: Search) -> dict[str, Any]:
    """How many claims a stored pad keeps, which not and why, and what the variations change."""
    judged = judge_one(search.numbers, search.formulation, TOLERANCE)
    verdicts = _verdicts(judged)
    changed = []
    for words, (tolerance, stop) in VARIATIONS.items():
        try:
            other = _verdicts(judge_one(search.numbers, search.formulation, tolerance, stop))
        except ComputationError as error:
            changed.append({"variation": words, "claim": "", "verdict": str(error)})
            continue
        changed += [
            {"variation": words, "claim": name, "verdict": verdict}
            for name, verdict in other.items()
            if verdict != verdicts[name]
        ]
    return {
        "formulation": vars(search.formulation),
        "seed": search.seed,
        "starts": search.starts,
        "pads": search.pads,
        "numbers": search.numbers,
        "reproduced": sum(j.verdict == "reproduced" for j in judged),
        "failing": [
            {"id": j.claim.id, "verdict": j.verdict, "margin": j.margin, "measured": j.measured}
            for j in judged
            if j.verdict != "reproduced"
        ],
        "changed": changed,
    }


def main() -> int:
    """Print the outcome for every stored search as JSON."""
    parser = argparse.ArgumentParser(description="Judge the stored pads of all formulations.")
    parser.add_argument("identified", type=Path, metavar="JSON")
    given = parser.parse_args()
    found = [verified(search) for search in read_searches(given.identified)]
    where = provenance([given.identified], "squeal.article.studies.verify")
    print(to_json({"formulations": found, "provenance": where.to_dict()}), end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
