"""Maps over the spring angles with traced boundaries: `python -m studies.angles FOLDER`.

The verdict on model B3 about the origin; where model B2 has a sliding equilibrium, in which
contact, with which verdict; and whether the printed conditions (23a, b) allow or deny it.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np

from squeal.analysis.maps import BEYOND_FOLD, NAMES, Found, angle_axes, on_grid, traced_map
from squeal.article.cases import CASES
from squeal.article.equations import bounds
from squeal.files.provenance import provenance
from squeal.files.writing import to_json
from squeal.model.states import FULL, NONE, STATES
from squeal.numerics.outline import Outline
from squeal.scene import Scene, read_scene

FINE, COARSE = 240, 90  # points a side of the maps of B3 and of B2
# a code of the B2 map is verdict + PER_CONTACT x contact + PER_PRINTED x (23a, b) as printed
PER_CONTACT = len(NAMES)
PER_PRINTED = PER_CONTACT * len(STATES)
ALL = np.arange(2 * PER_PRINTED)
VERDICT_OF, CONTACT_OF = ALL % PER_CONTACT, ALL // PER_CONTACT % len(STATES)
PRINTED_OF = ALL >= PER_PRINTED
KEPT_OF = NAMES.index("marginal") >= VERDICT_OF


def equilibria(scene: Scene) -> Outline:
    """Outline of verdict, contact and (23a, b) as printed over the angles, for a B2 scene."""

    def told(found: Found, angles: np.ndarray) -> np.ndarray:
        printed = np.asarray(bounds(scene.pad, angles).as_printed)
        return found.codes + PER_CONTACT * found.contact + PER_PRINTED * printed

    axes = angle_axes(COARSE)
    angles = axes[0].values
    found = Found(*on_grid(scene, ("alpha1", "alpha2"), angles, angles))
    codes = told(found, np.array(np.meshgrid(angles, angles, indexing="ij")))
    return traced_map(scene, axes, codes, told)


def shares(found: Outline) -> dict[str, float]:
    """Shares of the area of B2's map: of each contact, and where the printed conditions mislead."""
    part = np.zeros(len(ALL))
    for code, area in found.area.items():
        part[code] = area / np.pi**2
    partial = ~np.isin(CONTACT_OF, [STATES.index(FULL), STATES.index(NONE)])
    picked = {
        "exists": VERDICT_OF != BEYOND_FOLD,
        "full": STATES.index(FULL) == CONTACT_OF,
        "partial": partial,
        "quiet": KEPT_OF,
        # where the printed conditions deny a sliding state that model B2 has and keeps
        "denied": KEPT_OF & ~PRINTED_OF,
        "wrongly_allowed": ~KEPT_OF & PRINTED_OF,
    }
    return {name: float(part[which].sum()) for name, which in picked.items()}


def by_verdict(found: Outline) -> dict[str, float]:
    """Share of the area for each verdict."""
    area = {k: v / np.pi**2 for k, v in found.area.items()}
    return {name: area.get(k, 0.0) for k, name in enumerate(NAMES)}


def study(folder: Path) -> dict[str, Any]:
    """The maps for the scenes of a folder, with the cases' angles to mark on them."""
    files = [*(folder / f"b2-{case}.yaml" for case in CASES), folder / "b3.yaml"]
    *b2, b3 = map(read_scene, files)
    scenes, fine = dict(zip(CASES, b2, strict=True)), angle_axes(FINE)
    grid = on_grid(b3, ("alpha1", "alpha2"), fine[0].values, fine[1].values)
    of_b2, of_b3 = equilibria(scenes["c"]), traced_map(b3, fine, grid[0])
    return {
        "mu": scenes["c"].pad.mu,
        "marks": {case: [s.pad.alpha1, s.pad.alpha2] for case, s in scenes.items()},
        "b2": of_b2.told(),
        "b3": of_b3.told(),
        "share": shares(of_b2),
        "share_b2": by_verdict(of_b2.regrouped(VERDICT_OF)),
        "share_b3": by_verdict(of_b3),
        "provenance": provenance(files, "squeal.article.studies.angles").to_dict(),
    }


def main() -> int:
    """Print the maps of the scenes in the folder given on the command line."""
    parser = argparse.ArgumentParser(description="Maps over the spring angles, as JSON.")
    parser.add_argument("scenes", type=Path, metavar="FOLDER")
    print(to_json(study(parser.parse_args().scenes)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
