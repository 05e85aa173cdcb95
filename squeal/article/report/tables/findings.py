"""Findings on the article's equations."""

from squeal.article.report.latex import long_table, typeset
from squeal.article.studies.findings import Findings

CAPTION = r"Findings on the article's equations and text, each measured by the program."


def table(findings: Findings) -> str:
    """A row a finding."""
    rows = [
        [f.id, typeset(f.where), typeset(f.statement), typeset(f.outcome)]
        for f in findings.findings
    ]
    return long_table(["", "place", "finding", "measured"], rows)
