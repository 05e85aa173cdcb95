"""The stability chapter's numbers: `python -m studies.stability FOLDER > stability.json`.

Advice on each of the article's scenes; the friction loop of a pad that flutters; growth rates
fitted to simulations; and the comparison with the literature. Eigenvalues over friction and mode
shapes are those of `squeal.article.studies.loci`, maps those of `squeal.article.studies.angles`.
"""

from __future__ import annotations

import argparse
import dataclasses
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np

from squeal.analysis.advice import advise
from squeal.analysis.critical import critical_friction
from squeal.analysis.growth import fits
from squeal.analysis.maps import NAMES, angle_axes, stability_map
from squeal.article.cases import HISTORY_FIGURES
from squeal.article.literature.comparison import literature_rows
from squeal.article.studies.loci import MU_MAX, branch, loop
from squeal.equilibrium import sliding_equilibrium
from squeal.files.provenance import provenance
from squeal.files.writing import to_json
from squeal.scene import Scene, read_scene

GROWTH_POINTS = 12
POINTS = 90  # a side of the map on which a fluttering pad is sought


def fluttering(scene: Scene) -> Scene | None:
    """The scene with the fluttering angles of a map that lie nearest to its own."""
    axes = angle_axes(POINTS)
    angles = axes[0].values
    places = np.argwhere(stability_map(scene, axes).codes == NAMES.index("flutter"))
    if not len(places):
        return None
    own = np.array([scene.pad.alpha1, scene.pad.alpha2])
    i, j = places[np.argmin(np.sum((angles[places] - own) ** 2, axis=1))]
    pad = scene.pad.replace(alpha1=float(angles[i]), alpha2=float(angles[j]))
    return dataclasses.replace(scene, pad=pad)


def held(scene: Scene) -> dict[str, Any] | None:
    """Thresholds along the branch and with the equilibrium held, None if there is none."""
    at, _ = sliding_equilibrium(scene.pad_model)
    if at is None:
        return None
    return {"model": scene.model, "branch": branch(scene), "loop": loop(scene, at)}


def growth(name: str, scene: Scene) -> dict[str, Any]:
    """Fitted and predicted growth rates and frequencies over mu."""
    found = fits(scene, np.linspace(0.02, MU_MAX, GROWTH_POINTS))
    return {
        "name": name,
        "alpha1": scene.pad.alpha1,
        "alpha2": scene.pad.alpha2,
        "mu": [f.mu for f in found],
        "predicted": [[f.predicted.real, f.predicted.imag] for f in found],
        "fitted": [[f.fitted.real, f.fitted.imag] for f in found],
        "apart": max((f.deviation for f in found), default=0.0),
    }


def literature() -> list[dict[str, Any]]:
    """The comparison with the literature; numbers as text, complex ones included."""

    def told(value: complex | float | None) -> str:
        if value is None:
            return "none"
        value = complex(value)
        if value.imag == 0.0:
            return f"{value.real:.9g}"
        return f"{value.real:.8g}{value.imag:+.8g}i"

    return [
        {
            "name": row.name,
            "quantity": row.quantity,
            "expected": told(row.expected),
            "computed": told(row.computed),
            "error": row.error if math.isfinite(row.error) else None,
            "agrees": row.agrees,
            "provenance": row.provenance,
        }
        for row in literature_rows()
    ]


def study(folder: Path) -> dict[str, Any]:
    """All of the chapter's numbers for the scenes of a folder."""
    files = [folder / f"{stem}.yaml" for stem in HISTORY_FIGURES]
    scenes = {file.stem: read_scene(file) for file in files}
    other = fluttering(scenes["b2-c"])
    tried = [("b1-a", scenes["b1-a"]), ("b2-c", scenes["b2-c"])]
    if other is not None:
        tried.append(("b2, fluttering angles", other))
    advice = {name: advise(scene, critical_friction(scene)) for name, scene in scenes.items()}
    return {
        "advice": advice,
        "fluttering": held(other) if other is not None else None,
        "growth": [growth(name, scene) for name, scene in tried],
        "literature": literature(),
        "provenance": provenance(files, "squeal.article.studies.stability").to_dict(),
    }


def main() -> int:
    """Print the study of the scenes in the folder given on the command line."""
    parser = argparse.ArgumentParser(description="The stability chapter's numbers, as JSON.")
    parser.add_argument("scenes", type=Path, metavar="FOLDER")
    print(to_json(study(parser.parse_args().scenes)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
