"""The referee against systems whose roots are known by construction, and against itself.

`python -m benchmarks.refute_proofs [--systems 10000] [--rows 24] [--seed 0]` prints for each family
how many right answers were proved, by which means, and how many stayed open; of wrong answers how
many were refuted. A right answer that is refuted, a wrong one that is proved, and an enclosure that
contradicts the exact roots or what is known are contradictions: each is printed, and the exit code
is 1. Needs python-flint.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter

import numpy as np

from squeal.proof import AS_GIVEN, HALF_ULP, Proof, Quadratic, RootList, prove_roots
from squeal.proof.enclosure import components
from squeal.proof.exact import exact_roots
from squeal.proof.pieces import Piece, growing_counts
from squeal.proof.referee import Finding, enclosed, judge_finding
from tests.proof.families import FAMILIES, Known, sample

VERDICTS = ("stable", "marginal", "flutter", "divergence")


def exact_pieces(given: Quadratic) -> list[Piece] | None:
    """Exact roots of all components; None where one has too many rows."""
    pieces = []
    for rows in components(given):
        part = exact_roots(given.block(rows))
        if not isinstance(part, list):
            return None
        pieces += part
    return pieces


def contradictions(system: Known, given: Quadratic) -> list[str]:
    """How the enclosure and the exact roots contradict each other or what is known."""
    found = []
    finding = enclosed(given)
    least, most = growing_counts(finding.pieces)
    if finding.failure is None and not least <= system.growing <= most:
        found.append("enclosed count")
    pieces = exact_pieces(given)
    if pieces is None:
        return found
    if growing_counts(pieces) != (system.growing, system.growing):
        found.append("exact count")
    centres = np.array([piece.centres[0] for piece in pieces])
    radii = np.array([piece.radii[0] for piece in pieces])
    for data in (AS_GIVEN, HALF_ULP):
        ball = Quadratic.of(given.M.mid, given.C.mid, given.K.mid, data)
        exact = RootList(centres, radii, system.verdict)
        if judge_finding(enclosed(ball), exact).status == "refuted":
            found.append(f"exact roots, {data}")
    if judge_finding(Finding([pieces], AS_GIVEN), answer_of(system)).status == "refuted":
        found.append("known roots")
    return found


def answer_of(system: Known) -> RootList:
    """The right answer, with generous errors."""
    errors = 1e-8 * np.abs(system.roots) + 1e-11
    return RootList(system.roots, errors, system.verdict)


def mutants(system: Known, right: Proof, rng: np.random.Generator) -> dict[str, RootList]:
    """Wrong answers: a root dropped, doubled or moved by ten errors, another verdict."""
    roots = system.roots
    errors = np.maximum(right.errors, 1e-15 * np.abs(roots))
    k = int(rng.integers(len(roots)))
    moved = roots.copy()
    moved[k] += 10.0 * errors[k] * np.exp(2j * np.pi * rng.random())
    wrong = {
        "dropped": RootList(np.delete(roots, k), np.delete(errors, k), system.verdict),
        "moved": RootList(moved, errors, system.verdict),
        "doubled": RootList(np.append(roots, roots[k]), np.append(errors, errors[k])),
    }
    other = [verdict for verdict in VERDICTS if verdict != system.verdict]
    wrong["verdict"] = RootList(roots, errors, str(rng.choice(other)))
    return wrong


def main() -> int:
    """Ask, print, and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--systems", type=int, default=10_000)
    parser.add_argument("--rows", type=int, default=24, help="most rows of a system")
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    rng = np.random.default_rng(asked.seed)
    answers: dict[str, Counter[str]] = {family: Counter() for family in FAMILIES}
    wrong: Counter[str] = Counter()
    bad = 0
    for number in range(asked.systems):
        family = FAMILIES[number % len(FAMILIES)]
        rows = int(asked.rows ** rng.random()) + 1
        try:
            system = sample(family, rows, bool(rng.integers(2)), rng)
        except ValueError:
            continue  # an entry would be rounded
        given = Quadratic.of(system.M, system.C, system.K)
        faults = contradictions(system, given)
        proof = prove_roots(given, answer_of(system))
        answers[family][f"{proof.status} by {proof.by}"] += 1
        if proof.status == "refuted":
            faults.append(f"right answer refuted: {proof.reason}")
        for name, mutant in mutants(system, proof, rng).items():
            judged = prove_roots(given, mutant)
            wrong[f"{name} {judged.status}"] += 1
            if judged.status == "proved":
                faults.append(f"wrong answer proved: {name}")
        for fault in faults:
            bad += 1
            print(f"system {number}, {family}, {rows} rows: {fault}", flush=True)
    for family, counts in answers.items():
        print(f"{family:12}", ", ".join(f"{name} {n}" for name, n in sorted(counts.items())))
    print("wrong answers:", ", ".join(f"{name} {n}" for name, n in sorted(wrong.items())))
    print(f"{bad} contradictions")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
