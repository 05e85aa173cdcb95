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
    b1 = read_cases(files, "B1")
    b2 = read_cases(files, "B2")
    return Findings(measure_findings(Study(b1, b2, read_scenes(files, ["b3"])["b3"])))


def sentences(record: Findings) -> dict[str, bool]:
    """What the paper says of the findings."""
    by_id = {finding.id: finding for finding in record.findings}
    law = by_id["E4"].measured  # of the line's law as printed ("mean") and as integral
    conditions = by_id["E9"].measured  # of Fig. 13: shares of the map as printed, and complete
    # energy over the greatest kinetic energy; missing where the model ends
    printed_law_feeds = law.get("fed_mean", 0.0) > 0.01 > abs(law.get("fed_integral", 0.0))
    map_grows = conditions["complete"] > 2.0 * conditions["as_printed"]

    def of_kind(kind: str) -> set[str]:
        return {finding.id for finding in record.findings if finding.kind == kind}

    figures = {f.id: f.affects for f in record.findings if f.affects.startswith("Fig")}
    in_paper = {"E4": "Figs. 9 to 12 where contact is partial", "E9": "Fig. 13"}
    return {
        "e4-e9-and-e12-change-results": of_kind("changes a result") == {"E4", "E9", "E12"},
        "e4-and-e9-change-figures": figures == in_paper and printed_law_feeds and map_grows,
        "e1-and-e15-may-be-extraction": of_kind("possibly extraction") == {"E1", "E15"},
        "wrong-frame-of-delta-hardly-matters": by_id["E5"].measured["apart"] < 0.05,
    }
