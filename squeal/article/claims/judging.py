"""Verdicts on the claims, from the measures of the cases or from their scenes."""

from collections.abc import Mapping
from typing import Literal

from squeal.article.cases import stem
from squeal.article.claims.catalogue import CLAIMS
from squeal.article.claims.measures import Case, Linear, linear_measures, measure
from squeal.article.records import Record
from squeal.io.scene import Scene

Kind = Literal["informative", "implied", "identity", "almost sure", "free"]
Verdict = Literal["reproduced", "not reproduced", "contradicted"]


class JudgedClaim(Record):
    """A statement with what was measured, its verdict and margin (positive where it holds).

    scenes: those it is about, by name; case: their letters in words; kind: "informative", or why
    its verdict says nothing of its own ("implied" by others, "identity", "almost sure", "free"),
    by the derivation.
    """

    id: str
    verdict: Verdict
    measured: str
    where: str
    statement: str
    case: str
    scenes: tuple[str, ...]
    margin: float
    kind: Kind
    derivation: str

    @property
    def holds(self) -> bool:
        """Whether the statement is reproduced."""
        return self.verdict == "reproduced"


Measured = Mapping[str, Case | Linear]
"""Measures by name of the scene: b1-a to b2-d, and b3 for the linear model."""


def judge_claims(measured: Measured) -> list[JudgedClaim]:
    """Judge all claims, in catalogue order.

    A claim that fails while the one it conflicts with holds is contradicted.
    """
    outcomes = {}
    for claim in CLAIMS:
        outcomes[claim.id] = claim.rule(*(measured[scene] for scene in claim.scenes))
    holding = {name for name, outcome in outcomes.items() if outcome.margin > 0.0}
    judged = []
    for claim in CLAIMS:
        verdict: Verdict = "not reproduced"
        if claim.id in holding:
            verdict = "reproduced"
        elif holding & set(claim.conflicts):
            verdict = "contradicted"
        judged.append(
            JudgedClaim.of(
                claim,  # gives id, where, statement, case and scenes
                outcomes[claim.id],  # gives measured and margin
                verdict=verdict,
                kind=claim.follows.kind if claim.follows else "informative",
                derivation=claim.follows.derivation if claim.follows else "",
            )
        )
    return judged


def judge_scenes(b1: Mapping[str, Scene], b2: Mapping[str, Scene]) -> list[JudgedClaim]:
    """Simulate and judge the four cases of each model. Raises ComputationError where one ends."""
    cases = measure_scenes(b1, b2)
    pads = {case: scene.pad for case, scene in b2.items()}
    return judge_claims({**cases, "b3": linear_measures(pads)})


def measure_scenes(b1: Mapping[str, Scene], b2: Mapping[str, Scene]) -> dict[str, Case]:
    """The measures of the four cases of each model by name of the scene, those of B1 first.

    Raises ComputationError where a motion leaves the model.
    """
    measured = {}
    for model, scenes in (("B1", b1), ("B2", b2)):
        for case, scene in scenes.items():
            measured[stem(model, case)] = measure(scene)
    return measured
