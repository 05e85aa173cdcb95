"""Map of the quasi-static sliding motion of model B3 over the two spring angles (Fig. 13)."""

from __future__ import annotations

import argparse
import csv
import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from squeal.files import to_json, write_csv, write_text
from squeal.linear import bounds
from squeal.pad import Pad
from squeal.provenance import provenance
from squeal.scene import read_scene

COLUMNS = ("alpha1", "alpha2", "as_printed", "sign_aware")


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
        return {
            "as_printed": float(self.as_printed.mean()),
            "sign_aware": float(self.sign_aware.mean()),
        }


def quasi_static_map(pad: Pad, n: int) -> QuasiStaticMap:
    """Both readings of Eqs. (23a, b) at the middles of n x n equal cells of (0, pi)^2."""
    angles = math.pi * (np.arange(n) + 0.5) / n
    found = bounds(pad, tuple(np.meshgrid(angles, angles, indexing="ij")))
    return QuasiStaticMap(angles, np.asarray(found.as_printed), np.asarray(found.sign_aware))


def write(found: QuasiStaticMap, path: Path) -> None:
    """Write the map as CSV, one line a cell, with 0 and 1 for false and true."""
    angles = found.angles.tolist()
    rows = (
        (a, b, int(found.as_printed[i, j]), int(found.sign_aware[i, j]))
        for i, a in enumerate(angles)
        for j, b in enumerate(angles)
    )
    write_csv(path, COLUMNS, rows)


def read(path: Path) -> QuasiStaticMap:
    """Read what `write` has written."""
    with path.open(newline="", encoding="utf-8") as stream:
        _, *rows = csv.reader(stream)
    n = math.isqrt(len(rows))
    table = np.array(rows, dtype=float).reshape(n, n, 4)
    return QuasiStaticMap(table[0, :, 1], table[:, :, 2] > 0.5, table[:, :, 3] > 0.5)


def main() -> int:
    """Compute the map of a scene; write CSV and a JSON summary with the shares."""
    parser = argparse.ArgumentParser(description="Map Eqs. (23a, b) over the two spring angles.")
    parser.add_argument("scene", type=Path, metavar="SCENE.yaml")
    parser.add_argument("--n", type=int, default=240, help="cells a side")
    parser.add_argument("--csv", type=Path, required=True, metavar="FILE")
    parser.add_argument("--summary", type=Path, required=True, metavar="FILE.json")
    given = parser.parse_args()
    scene = read_scene(given.scene)
    found = quasi_static_map(scene.pad, given.n)
    write(found, given.csv)
    summary: dict[str, Any] = {
        "n": given.n,
        "mu": scene.pad.mu,
        "share": found.share,
        "provenance": provenance(given.scene, "squeal.quasi_static", ("numpy",)),
    }
    write_text(given.summary, to_json(summary) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
