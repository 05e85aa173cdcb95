"""Error and run time of each path over tolerances; changes missed or made up are counted."""

from __future__ import annotations

import math
import statistics
import time as clock
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from squeal.errors import ComputationError
from squeal.precision.paths import SEVERAL, Path, Run
from squeal.scene import Scene
from squeal.simulation.reference import Reference, error_against, reference

TOLERANCES = tuple(10.0**-k for k in range(4, 15, 2))
PATIENCE = 0.4  # s: a path slower than this is not asked for tighter tolerances
NEAR = 1e-2  # natural units: a change this near one of the reference is taken for it


@dataclass(frozen=True)
class Point:
    """One run of a path: relative error of the final place, greatest error of the contact times in
    natural units (None if none were found), seconds (median), steps, changes missed and made up."""

    case: str
    path: str
    tolerance: float
    error: float | None
    time_error: float | None
    seconds: float
    steps: int
    missed: int
    extra: int


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


def timed(path: Path, scene: Scene, tolerance: float) -> tuple[Run, float]:
    """A run and its median time in s; slow runs are not repeated."""
    spent: list[float] = []
    run: Run | None = None
    while len(spent) < 5 and sum(spent) < 0.05:
        begun = clock.perf_counter()
        run = path(scene, tolerance)
        spent.append(clock.perf_counter() - begun)
    assert run is not None
    return run, statistics.median(spent)


def points_of(
    case: str, scene: Scene, exact: Reference, name: str, path: Path, patience: float
) -> list[Point]:
    """A path over all tolerances, loosest first."""
    share = 1.0 / SEVERAL if "batch" in name else 1.0
    # compilation, once per machine, is left out; the peers' equations are compiled each time
    first = scene if "squeal" in name else replace(scene, stop=1e-3 * (scene.stop or 0.0))
    found = []
    for tolerance in TOLERANCES:
        try:
            path(first, tolerance)
            run, seconds = timed(path, scene, tolerance)
        except (ComputationError, ArithmeticError, ValueError, RuntimeError):
            continue  # a path may give up where a peer's step size or tolerance ends
        missed, extra, worst = compare_times(run.times, exact.times)
        error = error_against(run.place, exact.place)
        shown = error if math.isfinite(error) else None
        found.append(
            Point(case, name, tolerance, shown, worst, seconds * share, run.steps, missed, extra)
        )
        if seconds > patience:
            break
    return found


def measure(
    cases: Mapping[str, Scene], paths: Mapping[str, Path], patience: float = PATIENCE
) -> list[Point]:
    """All paths on all cases; one that takes longer than `patience` (s) goes no tighter."""
    points = []
    for case, scene in cases.items():
        exact = reference(scene)
        for name, path in paths.items():
            points += points_of(case, scene, exact, name, path, patience)
    return points


def time_at(points: list[Point], case: str, path: str, error: float) -> float | None:
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
