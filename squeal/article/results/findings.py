"""The findings on the article's equations, each measured."""

from squeal.article.results.records import Record, Result


class MeasuredFinding(Record):
    """A finding: its place in the article, what it says, the numbers measured and their meaning."""

    id: str
    where: str
    statement: str
    outcome: str
    measured: dict[str, float]


class Findings(Result):
    """All findings, in their order."""

    findings: tuple[MeasuredFinding, ...]
