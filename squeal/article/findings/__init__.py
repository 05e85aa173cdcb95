"""What the article's equations and texts turned out to be, each finding with its measurement."""

from squeal.article.findings.catalogue import FINDINGS, Finding, MeasuredFinding, measure_findings
from squeal.article.findings.equations import Measured

__all__ = ["FINDINGS", "Finding", "Measured", "MeasuredFinding", "measure_findings"]
