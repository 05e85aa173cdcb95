"""Error, effort and growth of small deviations of each simulated scene."""

from typing import Annotated

from squeal.article.results.records import Record, Result


class SceneAccuracy(Record):
    """What a simulated scene is worth.

    error: of the final place against quad precision, relative; growth: of small deviations over
    the scene's time; exponent in 1/s, `measured` over how many times the scene's time; run_time:
    processor time in s, median.
    """

    error: float
    growth: float
    exponent: float
    measured: float
    steps: int
    changes: int
    run_time: float
    tolerance: float
    stop: float


class Accuracy(Result):
    """By name of the scene; lost: the share at which a motion is no longer foretold.

    truth: what the errors are measured against.
    """

    scenes: dict[str, SceneAccuracy]
    lost: Annotated[float, ".0%"]
    truth: str
