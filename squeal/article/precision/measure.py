"""Error and run time of each path over tolerances; changes missed or made up are counted."""

import math
import statistics
import time as clock
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TypeVar

import numpy as np

from squeal.article.precision.paths import SEVERAL, Path, Run, with_scipy
from squeal.article.results.precision import Check, Point
from squeal.errors import ComputationError
from squeal.io.scene import Scene
from squeal.simulation.reference import Reference, error_against, reference

T = TypeVar("T")
TOLERANCES = tuple(10.0**-k for k in range(4, 15, 2))
REPEATS = {True: 3, False: 1}  # at least, of the own paths, which are fast, and of the peers
PATIENCE = 0.15  # s: a path slower than this is not asked for tighter tolerances
NEAR = 1e-2  # natural units: a change this near one of the reference is taken for it
CONFIRMING = "SciPy DOP853"  # the path that confirms a reference
OTHER_ORDER = 1e-25  # a tolerance of quad precision with another order and other steps


def compare_times(found: np.ndarray, exact: np.ndarray) -> tuple[int, int, float | None]:
    """Changes missed, changes made up, and the greatest error of those that pair off in order."""
    missed = extra = 0
    worst: float | None = None
    i = j = 0
    while i < len(found) and j < len(exact):
        apart = float(found[i] - exact[j])
        if abs(apart) <= NEAR:
            worst = max(worst or 0.0, abs(apart))
            i, j = i + 1, j + 1
        elif apart < 0.0:
            extra, i = extra + 1, i + 1
        else:
            missed, j = missed + 1, j + 1
    return missed + len(exact) - j, extra + len(found) - i, worst


def timed(task: Callable[[], T], enough: float = 0.02, least: int = 1) -> tuple[T, float]:
    """What a task returns, and its median processor time in s over repeats of about `enough` s, at
    least so many: a short task that once takes long does not count by that time alone.

    Other programs that run beside it take no part in that time.
    """
    spent: list[float] = []
    while True:
        begun = clock.process_time()
        found = task()
        spent.append(clock.process_time() - begun)
        if len(spent) == 50 or (sum(spent) > enough and len(spent) >= least):
            return found, statistics.median(spent)


def _point(
    case: str, name: str, tolerance: float, run: Run, exact: Reference, seconds: float
) -> Point:
    """A run held against the reference."""
    missed, extra, worst = compare_times(run.times, exact.times)
    error = error_against(run.place, exact.place)
    shown = error if math.isfinite(error) else None
    return Point(case, name, tolerance, shown, worst, seconds, run.steps, missed, extra)


def points_of(
    case: str, scene: Scene, exact: Reference, name: str, path: Path, patience: float
) -> list[Point]:
    """A path over all tolerances, loosest first."""
    share = 1.0 / SEVERAL if "batch" in name else 1.0
    # compilation is left out; ours, one contact state at a time, ends with the motion
    first = scene if name == "squeal" else replace(scene, stop=1e-3 * (scene.stop or 0.0))
    own = "squeal" in name
    found = []
    for tolerance in TOLERANCES:
        try:
            path(first, tolerance)
            run, seconds = timed(partial(path, scene, tolerance), least=REPEATS[own])
        except (ComputationError, ArithmeticError, ValueError, RuntimeError):
            continue  # a path may give up where a peer's step size or tolerance ends
        found.append(_point(case, name, tolerance, run, exact, seconds * share))
        if seconds > patience:
            break
    return found


def confirm(
    case: str, scene: Scene, exact: Reference, order: bool, points: Sequence[Point] = ()
) -> Check:
    """Hold a reference against SciPy's DOP853 at its tightest, which may be among the points.

    Raises ComputationError.
    """
    same = (p for p in points if (p.path, p.tolerance) == (CONFIRMING, TOLERANCES[-1]))
    other = next(same, None)
    if other is None:
        run = with_scipy("DOP853", scene, TOLERANCES[-1])
        other = _point(case, CONFIRMING, TOLERANCES[-1], run, exact, 0.0)
    if other.missed or other.extra or other.error is None:
        raise ComputationError(f"{case}: SciPy and quad precision find other contact changes")
    again = error_against(reference(scene, OTHER_ORDER).place, exact.place) if order else None
    return Check(case, len(exact.times), other.error, other.time_error, again)


def measure(
    cases: Mapping[str, Scene],
    paths: Mapping[str, Path],
    patience: float = PATIENCE,
    order: bool = False,
) -> tuple[list[Point], list[Check]]:
    """All paths on all cases; one that takes longer than `patience` (s) goes no tighter."""
    points, checks = [], []
    for case, scene in cases.items():
        exact = reference(scene)
        own = [
            point
            for name, path in paths.items()
            for point in points_of(case, scene, exact, name, path, patience)
        ]
        checks.append(confirm(case, scene, exact, order, own))
        points += own
    return points, checks
