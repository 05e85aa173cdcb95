"""How the claims fare around the best pad and over the plausible ranges."""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np

from squeal.article.claims import CLAIMS
from squeal.article.identify.objective import judge_many
from squeal.article.identify.space import BOUNDS, DIMENSIONS, Numbers, decode
from squeal.article.identify.stored import read_searches
from squeal.files.provenance import provenance
from squeal.files.writing import to_json
from squeal.model.contact import Formulation

SPREADS = (0.01, 0.05, 0.2)  # standard deviations of the logarithms of all numbers together
PADS = 256  # in each sample
LEAST, STEPS = 1e-3, 25  # relative changes of one number: from this to one, so many
Z = 1.959963984540054  # of a 95 % interval


def wilson(count: int, n: int) -> tuple[float, float]:
    """Wilson's 95 % interval of a share of which `count` of n trials were seen."""
    p, z2 = count / n, Z * Z
    middle = (p + z2 / (2 * n)) / (1 + z2 / n)
    half = Z / (1 + z2 / n) * math.sqrt(p * (1 - p) / n + z2 / (4 * n * n))
    return max(0.0, middle - half), min(1.0, middle + half)


def holding(many: list[dict[str, float]], formulation: Formulation) -> np.ndarray:
    """Which claims hold on which pad, (pads, claims); none where a motion leaves the model."""
    held = np.zeros((len(many), len(CLAIMS)), dtype=bool)
    for i, outcome in enumerate(judge_many(many, formulation)):
        if outcome is not None:
            held[i] = [j.verdict == "reproduced" for j in outcome.judged]
    return held


def around(numbers: Numbers, spread: float, random: np.random.Generator) -> list[dict[str, float]]:
    """Pads whose numbers all scatter about the given ones (log-normal)."""
    factors = np.exp(spread * random.standard_normal((PADS, len(DIMENSIONS))))
    return [
        {d.name: numbers[d.name] * float(f) for d, f in zip(DIMENSIONS, row, strict=True)}
        for row in factors
    ]


def everywhere(random: np.random.Generator) -> list[dict[str, float]]:
    """Pads from all over the searched ranges."""
    low, high = np.array(BOUNDS).T
    points = random.uniform(size=(PADS, len(BOUNDS)))
    return [decode(low + (high - low) * point) for point in points]


def first_breaks(numbers: Numbers, formulation: Formulation) -> list[dict[str, Any]]:
    """For each number and each way: the least relative change that breaks a claim, and which.

    `change` is None where none breaks up to halving or doubling.
    """
    sizes = np.geomspace(LEAST, 1.0, STEPS)
    factors = np.concatenate([1.0 + sizes, 1.0 / (1.0 + sizes)])
    many = [dict(numbers)]
    many += [{**numbers, d.name: numbers[d.name] * float(f)} for d in DIMENSIONS for f in factors]
    held = holding(many, formulation)
    kept = held[0]
    lost = (kept & ~held[1:]).reshape(len(DIMENSIONS), 2, STEPS, len(CLAIMS))
    found = []
    for d, ways in zip(DIMENSIONS, lost, strict=True):
        for way, table in zip(("more", "less"), ways, strict=True):
            broken = np.flatnonzero(table.any(axis=1))
            at = int(broken[0]) if broken.size else None
            found.append(
                {
                    "number": d.name,
                    "way": way,
                    "change": None if at is None else float(sizes[at]),
                    "claims": []
                    if at is None
                    else [c.id for c, gone in zip(CLAIMS, table[at], strict=True) if gone],
                }
            )
    return found


def study(numbers: Numbers, formulation: Formulation, seed: int = 1) -> dict[str, Any]:
    """Shares of pads that keep each claim, in samples of growing width, and the first breaks."""
    random = np.random.default_rng(seed)
    samples = {f"{100 * s:g} %": around(numbers, s, random) for s in SPREADS}
    samples["ranges"] = everywhere(random)
    shares = []
    for words, many in samples.items():
        held = holding(many, formulation)
        counts = held.sum(axis=0)
        shares.append(
            {
                "sample": words,
                "pads": len(many),
                "median_kept": float(np.median(held.sum(axis=1))),
                "claims": {
                    c.id: {"share": float(n / len(many)), "interval": wilson(int(n), len(many))}
                    for c, n in zip(CLAIMS, counts, strict=True)
                },
            }
        )
    return {"samples": shares, "breaks": first_breaks(numbers, formulation)}


def main() -> int:
    """Print the study of the best stored pad as JSON."""
    parser = argparse.ArgumentParser(description="How robust the claims are around the best pad.")
    parser.add_argument("identified", type=Path, metavar="JSON")
    given = parser.parse_args()
    best = read_searches(given.identified)[0]
    where = provenance([given.identified], "squeal.article.studies.robustness")
    print(to_json(study(best.numbers, best.formulation) | {"provenance": where.to_dict()}), end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
