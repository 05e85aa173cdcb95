"""The article's statements about its results, each as a measurement with a margin and a verdict."""

from squeal.article.claims.catalogue import CLAIMS, Claim
from squeal.article.claims.judging import judge_claims, judge_scenes, measure_scenes
from squeal.article.claims.measures import Case, case_of, linear_measures, measure

# fmt: off
__all__ = [
    "CLAIMS", "Case", "Claim", "case_of", "judge_claims", "judge_scenes",
    "linear_measures", "measure", "measure_scenes",
]
