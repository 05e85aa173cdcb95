"""Findings on the article's equations."""

from squeal.article.report.latex import long_table, typeset
from squeal.article.studies.findings import Findings

CAPTION = r"""Findings on the article's equations and text, each measured by the program. In
italics: whether a finding changes a result of the article. The text at hand was extracted from a
file whose pages we did not see, so that two misprints may be faults of the extraction."""


def table(findings: Findings) -> str:
    """The table in LaTeX, a row per finding."""
    rows = []
    for finding in findings.findings:
        statement = rf"{typeset(finding.statement)} \emph{{({typeset(finding.worth)})}}"
        rows.append([finding.id, typeset(finding.where), statement, typeset(finding.outcome)])
    return long_table(["", "place", "finding", "measured"], rows)
