"""The article's statements with their measured verdicts."""

from typing import Literal

from squeal.article.records import Record, Result

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


class Loaded(Record):
    """Where the reaction of a case of B2 acts while it exceeds a share of F_n: the least and the
    greatest delta/w (None where it never does), and by swing (of w) the changes of side between
    such times at which it acts farther out."""

    share: float
    low: float | None
    high: float | None
    swings: dict[str, int]


class Hammering(Record):
    """The cases that hammer, by model ("B1", "B2"); of those of B2, where delta goes under load.

    by_edges: the cases of B2 whose edges separate in turn and repeatedly, the rule of B1.
    """

    cases: dict[str, tuple[str, ...]]
    by_edges: tuple[str, ...]
    loaded: dict[str, tuple[Loaded, ...]]

    @property
    def both(self) -> tuple[str, ...]:
        """The cases that hammer with both models."""
        return tuple(name for name in self.cases["B1"] if name in self.cases["B2"])


class Settled(Record):
    """A motion of a scene's pad that starts on the decaying mode of its sliding equilibrium.

    real: of that mode (1/s); windows: its length in times of the scene; calm: its greatest late
    acceleration over that of the whole motion.
    """

    scene: str
    real: float
    windows: float
    calm: float


class Claims(Result):
    """All statements in the article's order, which cases hammer, and a motion that was sought
    to settle (None where no mode decays)."""

    claims: tuple[JudgedClaim, ...]
    hammering: Hammering
    settled: Settled | None
