"""The stability chapter's numbers beside those of the studies `loci` and `angles`.

Advice on each of the article's scenes; the friction loop of a pad that flutters; growth rates
fitted to simulations; and the comparison with the literature.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from squeal.analysis.maps import NAMES, angle_axes, codes_at
from squeal.article.cases import HISTORY_FIGURES
from squeal.article.literature.comparison import literature_rows
from squeal.article.results.stability import Growth, Stability, Thresholds
from squeal.article.studies._advice_text import scene_in_words
from squeal.article.studies._growth import fits
from squeal.article.studies._scenes import read_scenes
from squeal.article.studies.loci import MU_MAX, branch, loop
from squeal.equilibrium import sliding_equilibrium
from squeal.io.scene import Scene

GROWTH_POINTS = 12
POINTS = 90  # a side of the map on which a fluttering pad is sought
FIRST = 400  # of its points, the nearest, which are looked at before all others
ADVISED = ("b2-c",)  # the text's example: it flutters


def fluttering(scene: Scene) -> Scene | None:
    """The scene with the fluttering angles of a map that lie nearest to its own.

    None if no angles flutter, or its own do: then the nearest lie within a cell of the map.
    """
    names = ("alpha1", "alpha2")
    axis = angle_axes(POINTS)[0].values
    angles = np.array(np.meshgrid(axis, axis, indexing="ij")).reshape(2, -1)
    apart = angles - np.array([[getattr(scene.pad, name)] for name in names])
    order = np.argsort(np.sum(apart**2, axis=0), kind="stable")
    for part in np.split(order, [FIRST]):
        found = part[codes_at(scene, names, angles[:, part]).codes == NAMES.index("flutter")]
        if len(found):
            if np.abs(apart[:, found[0]]).max() < axis[1] - axis[0]:
                return None
            pad = scene.pad.replace(**dict(zip(names, angles[:, found[0]].tolist(), strict=True)))
            return replace(scene, pad=pad)
    return None


def held(scene: Scene) -> Thresholds | None:
    """Thresholds along the branch and with the equilibrium held, None if there is none."""
    at, _ = sliding_equilibrium(scene.pad_model)
    if at is None:
        return None
    return Thresholds(scene.model, branch(scene), loop(scene, at))


def growth(name: str, scene: Scene) -> Growth:
    """Fitted and predicted growth rates and frequencies over mu."""
    found = fits(scene, np.linspace(0.02, MU_MAX, GROWTH_POINTS))
    return Growth.of(
        scene.pad,
        name=name,
        mu=tuple(f.mu for f in found),
        predicted=tuple((f.predicted.real, f.predicted.imag) for f in found),
        fitted=tuple((f.fitted.real, f.fitted.imag) for f in found),
        apart=max((f.deviation for f in found), default=0.0),
    )


def study(files: Sequence[Path]) -> Stability:
    """All of the chapter's numbers for the scenes of models B1 and B2."""
    scenes = read_scenes(files, HISTORY_FIGURES)
    other = fluttering(scenes["b2-c"])
    tried = [("b1-a", scenes["b1-a"]), ("b2-c", scenes["b2-c"])]
    if other is not None:
        tried.append(("b2, fluttering angles", other))
    return Stability(
        advice={name: scene_in_words(scenes[name]) for name in ADVISED},
        fluttering=None if other is None else held(other),
        growth=tuple(growth(name, scene) for name, scene in tried),
        literature=tuple(literature_rows()),
    )
