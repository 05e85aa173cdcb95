"""Verdicts on the claims, from the measures of the cases or from their scenes."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from squeal.article.cases import CASES, stem
from squeal.article.claims.catalogue import CLAIMS
from squeal.article.claims.measures import Case, Linear, linear_measures, measure
from squeal.article.claims.rules import LOADS, TRIED, by_turns, hammering_margins
from squeal.article.results.claims import Hammering, JudgedClaim, Loaded, Verdict
from squeal.io.scene import Scene
from squeal.simulation import simulate

SAMPLES = 100_001  # of a motion, where only what happens under load is asked for

Measured = Mapping[str, Case | Linear]
"""Measures by name of the scene: b1-a to b2-d, and b3 for the linear model."""


def judge_claims(measured: Measured) -> list[JudgedClaim]:
    """Judge all claims, in catalogue order.

    A claim that fails while the one it conflicts with holds is contradicted.
    """
    judged = []
    for claim in CLAIMS:
        outcome = claim.rule(*(measured[scene] for scene in claim.scenes))
        verdict: Verdict = "reproduced" if outcome.margin > 0.0 else "not reproduced"
        why = {} if claim.follows else {"kind": "informative", "derivation": ""}
        judged.append(JudgedClaim.of(claim, outcome, claim.follows, verdict=verdict, **why))
    holding = {j.id for j in judged if j.holds}
    lost = {c.id for c in CLAIMS if c.conflicts in holding} - holding
    return [replace(j, verdict="contradicted") if j.id in lost else j for j in judged]


def judge_scenes(b1: Mapping[str, Scene], b2: Mapping[str, Scene]) -> list[JudgedClaim]:
    """Simulate and judge the four cases of each model. Raises ComputationError where one ends."""
    cases = measure_scenes(b1, b2)
    pads = {case: scene.pad for case, scene in b2.items()}
    return judge_claims({**cases, "b3": linear_measures(pads)})


def measure_scenes(b1: Mapping[str, Scene], b2: Mapping[str, Scene]) -> dict[str, Case]:
    """The measures of the four cases of each model by name of the scene, those of B1 first.

    Raises ComputationError where a motion leaves the model.
    """
    return {
        stem(model, case): measure(scene)
        for model, scenes in (("B1", b1), ("B2", b2))
        for case, scene in scenes.items()
    }


def hammering(cases: Mapping[str, Case], b2: Mapping[str, Scene]) -> Hammering:
    """Which cases hammer, `cases` as measured; and under which load, from the scenes of B2."""
    beating = {
        model: tuple(name for name, margin in margins.items() if margin > 0.0)
        for model, margins in hammering_margins(*cases.values()).items()
    }
    edges = tuple(case for case in CASES if by_turns(cases[stem("B2", case)]) > 0.0)
    return Hammering(
        beating, edges, {case: loaded(b2[case]) for case in beating["B2"] if case in b2}
    )


def loaded(scene: Scene) -> tuple[Loaded, ...]:
    """Where the reaction of a scene of B2 acts while it exceeds each of the `LOADS`."""
    dense = replace(scene, samples=SAMPLES, outputs=("history",))
    history = simulate(dense).history
    assert history is not None
    force, place = (np.array(history[name], dtype=float) for name in ("Rn", "delta"))
    return tuple(under_load(force, place, share) for share in LOADS)


def under_load(force: np.ndarray, place: np.ndarray, share: float) -> Loaded:
    """Where a reaction (n,) over F_n acts, its place (n,) over w, while it exceeds a share."""
    there = place[force > share]
    if not there.size:
        return Loaded(share, None, None, dict.fromkeys(map(str, TRIED), 0))
    far = {str(swing): np.sign(there[np.abs(there) > swing]) for swing in TRIED}
    swings = {swing: int(np.count_nonzero(np.diff(sides))) for swing, sides in far.items()}
    return Loaded(share, float(there.min()), float(there.max()), swings)
