"""Map of the quasi-static sliding motion of model B3 over the two spring angles (Fig. 13).

`python -m squeal.article.studies.quasi_static SCENE.yaml > map.json`
"""

from __future__ import annotations

import argparse
import math
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from squeal.article.equations import bounds
from squeal.files.provenance import provenance
from squeal.files.writing import to_json
from squeal.model.pad import Pad
from squeal.numerics.outline import Outline, outline
from squeal.scene import read_scene

READINGS = ("as_printed", "sign_aware")
ENDS = ((0.0, math.pi), (0.0, math.pi))


@dataclass(frozen=True)
class QuasiStaticMap:
    """Where Eqs. (23a, b) hold: angles (n,) in rad, and two truth tables (n, n).

    The first index runs over alpha1. `as_printed` compares mu with the quotients as they stand;
    `sign_aware` asks for Rn > 0 in each pair of rows of Eq. (21) instead (finding E9).
    """

    angles: np.ndarray
    as_printed: np.ndarray
    sign_aware: np.ndarray

    @property
    def share(self) -> dict[str, float]:
        """Share of the map where each reading holds."""
        return {name: float(getattr(self, name).mean()) for name in READINGS}


def quasi_static_map(pad: Pad, n: int) -> QuasiStaticMap:
    """Both readings of Eqs. (23a, b) at the middles of n x n equal cells of (0, pi)^2."""
    angles = math.pi * (np.arange(n) + 0.5) / n
    found = bounds(pad, tuple(np.meshgrid(angles, angles, indexing="ij")))
    return QuasiStaticMap(angles, np.asarray(found.as_printed), np.asarray(found.sign_aware))


def quasi_static_outlines(pad: Pad, found: QuasiStaticMap) -> dict[str, Outline]:
    """Each reading's region (code 1) and its boundary."""

    def traced(name: str) -> Outline:
        def at(angles: np.ndarray) -> np.ndarray:
            return np.asarray(getattr(bounds(pad, angles), name)).astype(int)

        return outline(ENDS, found.angles, found.angles, getattr(found, name).astype(int), at)

    return {name: traced(name) for name in READINGS}


def main() -> int:
    """Print the map of a scene: shares of its area and traced outlines, as JSON."""
    parser = argparse.ArgumentParser(description="Map Eqs. (23a, b) over the two spring angles.")
    parser.add_argument("scene", type=Path, metavar="SCENE.yaml")
    parser.add_argument("--n", type=int, default=240, help="cells a side")
    given = parser.parse_args()
    scene = read_scene(given.scene)
    found = quasi_static_map(scene.pad, given.n)
    outlines = quasi_static_outlines(scene.pad, found)
    summary = {
        "n": given.n,
        "mu": scene.pad.mu,
        "share": found.share,
        **{name: one.told() for name, one in outlines.items()},
        "provenance": provenance([given.scene], "squeal.article.studies.quasi_static").to_dict(),
    }
    print(to_json(summary))
    return 0


if __name__ == "__main__":
    sys.exit(main())
