"""What the article's equations and texts turned out to be, each finding with its measurement."""

from squeal.findings.catalogue import FINDINGS, Finding, measure_findings
from squeal.findings.equations import Measured

__all__ = ["FINDINGS", "Finding", "Measured", "measure_findings"]
