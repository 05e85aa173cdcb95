"""The findings on the article's equations, each measured."""

from collections.abc import Sequence
from pathlib import Path

from squeal.article.findings import MeasuredFinding, measure_findings
from squeal.article.findings.motion import Study
from squeal.article.records import Result
from squeal.article.studies._scenes import read_cases, read_scenes


class Findings(Result):
    """All findings, in their order."""

    findings: tuple[MeasuredFinding, ...]


def study(files: Sequence[Path]) -> Findings:
    """Measure the findings on the article's nine scenes."""
    b1, b2 = (read_cases(files, model) for model in ("B1", "B2"))
    return Findings(measure_findings(Study(b1, b2, read_scenes(files, ["b3"])["b3"])))
