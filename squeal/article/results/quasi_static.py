"""Where the conditions (23a, b) hold over the two spring angles (Fig. 13)."""

from typing import Annotated

from squeal.article.results.records import Record, Result
from squeal.numerics.outline import Outline


class Readings(Record):
    """Share of the map where (23a, b) hold as printed, and with signs followed."""

    as_printed: Annotated[float, ".1%"]
    sign_aware: Annotated[float, ".1%"]


class QuasiStatic(Result):
    """Map of n x n cells at the scene's mu: regions (code 1) of both readings of (23a, b)."""

    n: int
    mu: float
    share: Readings
    as_printed: Outline
    sign_aware: Outline
