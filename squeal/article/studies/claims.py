"""The article's statements, each measured and judged on the article's scenes."""

from collections.abc import Sequence
from pathlib import Path

from squeal.article.cases import stem
from squeal.article.claims import hammering, judge_claims, linear_measures, measure_scenes
from squeal.article.claims.settling import settled
from squeal.article.results.claims import Claims
from squeal.article.studies._scenes import read_cases


def study(files: Sequence[Path]) -> Claims:
    """Judge the eight scenes."""
    b1, b2 = (read_cases(files, model, "simulate") for model in ("B1", "B2"))
    cases = measure_scenes(b1, b2)
    linear = linear_measures({case: scene.pad for case, scene in b2.items()})
    return Claims(
        tuple(judge_claims({**cases, "b3": linear})),
        hammering(cases, b2),
        settled({stem("B2", case): scene for case, scene in b2.items()}),
    )
