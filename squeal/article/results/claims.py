"""The article's statements with their measured verdicts."""

from __future__ import annotations

from typing import Literal

from squeal.files.records import Record, Result

Kind = Literal["informative", "implied", "identity", "tautology"]
Verdict = Literal["reproduced", "not reproduced", "contradicted"]


class JudgedClaim(Record):
    """A statement with what was measured, its verdict and margin (positive where it holds).

    scenes: those it is about, by name; case: their letters in words; kind: "informative", or why
    its verdict says nothing of its own ("implied" by others, "identity", "tautology"), by the
    derivation.
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


class Reach(Record):
    """Which cases hammer with both models, if delta must go so far (of w) to each side."""

    reach: float
    cases: tuple[str, ...]


class SearchedFormulation(Record):
    """The most claims that one pad was found to keep in a formulation, of so many pads tried."""

    line_force: str
    delta_from: str
    delta_moment: str
    pads: int
    kept: int


class Claims(Result):
    """All statements in the article's order, which cases hammer by the distance asked for (that of
    the statements first), and what searches of other formulations came to."""

    claims: tuple[JudgedClaim, ...]
    hammering: tuple[Reach, ...]
    formulations: tuple[SearchedFormulation, ...]
