"""Error against run time: simulations of the article's cases and a stiff pad, linear tasks."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from squeal.article.cases import title
from squeal.article.extreme.cases import scene_of
from squeal.article.precision.linear import DIGITS, sweep_timings, threshold_timings
from squeal.article.precision.maps import FINEST, map_timings
from squeal.article.precision.measure import NEAR, PATIENCE, measure
from squeal.article.precision.paths import DEFAULT
from squeal.article.precision.paths import Path as Way
from squeal.article.results.precision import Precision
from squeal.article.studies._scenes import read_scenes
from squeal.io.provenance import NOT_INSTALLED, WITHOUT_HEYOKA, version

STEMS = ("b1-c", "b2-c")
STIFF = 1e6  # k3, k4 over k1


def study(files: Sequence[Path]) -> Precision:
    """Measure all paths."""
    return compared(files, STEMS, DEFAULT)


def compared(
    files: Sequence[Path],
    stems: Sequence[str],
    paths: Mapping[str, Way],
    patience: float = PATIENCE,
    order: bool = False,
) -> Precision:
    """Measure some paths on some scenes; for patience (s) and order see `measure`."""
    scenes = read_scenes(files, stems, "simulate")
    cases = {title(name): replace(scene, outputs=()) for name, scene in scenes.items()}
    cases["B1, stiff contact"] = scene_of("B1", 60.0 / STIFF**0.5, k3=STIFF, k4=STIFF)
    fig13 = read_scenes(files, ["b3"])["b3"]
    linear = (*sweep_timings(fig13), *threshold_timings(), *map_timings(fig13))
    given = (STIFF, NEAR, FINEST, DIGITS)
    if version("heyoka") == NOT_INSTALLED:
        why = f"{WITHOUT_HEYOKA} nothing else compiles the equations for all integrators."
        return Precision((), (), linear, *given, why)
    points, checks = measure(cases, paths, patience, order)
    return Precision(tuple(points), tuple(checks), linear, *given)
