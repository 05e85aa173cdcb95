"""Outcomes of the suite of stiff and extreme cases."""

from typing import Annotated, Literal

from squeal.article.results.records import Record, Result

Word = Literal["right", "refused", "warned", "wrong"]


class Outcome(Record):
    """What became of a case: `right`, `refused` or `warned` as it should be, else `wrong`.

    error: relative, None where there is no number to compare; steps and contact changes of the run;
    run_time: processor time in s, of the simulation alone; told: what the error is measured
    against, or what the program said.
    """

    group: str
    name: str
    outcome: Word
    error: float | None
    steps: int
    changes: int
    run_time: float
    told: str


class Extreme(Result):
    """All cases of the suite, in its order.

    limit: greatest relative error of a right answer; reference: relative tolerance of the motions
    that are taken as exact; truth: how these are computed; stand_in: SciPy stood in for heyoka, and
    what it gets wrong is told in the table but stops no build.
    """

    cases: tuple[Outcome, ...]
    limit: Annotated[float, "power"]
    reference: Annotated[float, "power"]
    truth: str
    stand_in: bool = False

    @property
    def wrong(self) -> str:
        """The cases that came out wrong."""
        if self.stand_in:
            return ""
        return ", ".join(f"{c.group}: {c.name}" for c in self.cases if c.outcome == "wrong")
