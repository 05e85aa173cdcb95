"""Error against run time of each path, over tolerances."""

from collections.abc import Sequence
from typing import Annotated

from squeal.article.results.records import Record, Result


class Point(Record):
    """One run of a path.

    Relative error of the final place, greatest error of the contact times in natural units (None if
    none were found), median processor time in s, steps, changes missed and made up.
    """

    case: str
    path: str
    tolerance: float
    error: float | None
    time_error: float | None
    seconds: float
    steps: int
    missed: int
    extra: int


class Check(Record):
    """A reference against another method, and against itself at another order if `order` is set.

    Relative difference of the final place, greatest one of the contact times in natural units.
    """

    case: str
    changes: int
    place: float
    times: float | None
    order: float | None


class Timing(Record):
    """Error and median processor time (s) of a program at a task of the linear side.

    `size` is what was asked of it: matrices of a sweep, points a side of a map, halvings of the
    interval around a threshold.
    """

    task: str
    program: str
    size: int
    error: float
    seconds: float


class Precision(Result):
    """Work-precision points of simulations, checks of their references, timings of linear tasks.

    stiff: contact over support stiffness of the stiff case; near: units of time within which a
    contact change counts as the reference's; finest: points a side of the map that counts as exact;
    digits: of the exact eigenvalues and threshold; left_out: why there are no simulations, empty if
    there are.
    """

    points: tuple[Point, ...]
    checks: tuple[Check, ...]
    linear: tuple[Timing, ...]
    stiff: Annotated[float, "power"]
    near: float
    finest: int
    digits: int
    left_out: str = ""


def time_at(points: Sequence[Point], case: str, path: str, error: float) -> float | None:
    """The least time of a path for a final error of at most `error` with no change missed."""
    good = [
        p.seconds
        for p in points
        if (p.case, p.path) == (case, path)
        and p.error is not None
        and p.error <= error
        and p.missed == p.extra == 0
    ]
    return min(good, default=None)
