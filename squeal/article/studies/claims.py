"""The article's statements, each measured and judged on the article's scenes."""

from collections.abc import Sequence
from pathlib import Path

from squeal.article.cases import stem
from squeal.article.claims import judge_claims, linear_measures, measure_scenes
from squeal.article.claims.judging import JudgedClaim
from squeal.article.claims.settling import Settled, settled
from squeal.article.records import Result
from squeal.article.studies._scenes import read_cases


class Claims(Result):
    """All statements in the article's order, and a motion that was searched to settle (None where
    no mode decays)."""

    claims: tuple[JudgedClaim, ...]
    settled: Settled | None


def study(files: Sequence[Path]) -> Claims:
    """Judge the eight scenes."""
    b1 = read_cases(files, "B1")
    b2 = read_cases(files, "B2")
    cases = measure_scenes(b1, b2)
    linear = linear_measures({case: scene.pad for case, scene in b2.items()})
    return Claims(
        tuple(judge_claims({**cases, "b3": linear})),
        settled({stem("B2", case): scene for case, scene in b2.items()}),
    )
