"""Stiff and extreme cases: each ends in a right answer, a warning or a clear refusal."""

from squeal.article.extreme.cases import CASES, Case
from squeal.article.extreme.run import run_case

__all__ = ["CASES", "Case", "run_case"]
