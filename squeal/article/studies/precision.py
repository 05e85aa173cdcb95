"""`python -m squeal.article.precision SCENES [--peers] > results/precision.json`."""

from __future__ import annotations

import argparse
import sys
from dataclasses import asdict, replace
from pathlib import Path

from squeal.article.cases import title
from squeal.article.extreme.cases import scene_of
from squeal.article.precision.linear import sweep_timings, threshold_timings
from squeal.article.precision.maps import map_timings
from squeal.article.precision.measure import PATIENCE, measure
from squeal.article.precision.paths import DEFAULT
from squeal.article.precision.peers import peers
from squeal.files.provenance import provenance
from squeal.files.writing import to_json
from squeal.scene import Scene, read_scene

STEMS = ("b1-c", "b2-c")
MORE = ("b1-b", "b2-b")  # in the benchmark
STIFF = 1e6  # k3, k4 over k1
LONG = 5.0  # s: the patience of the benchmark


def main() -> int:
    """Measure and print as JSON."""
    parser = argparse.ArgumentParser(description="Error against run time.")
    parser.add_argument("scenes", type=Path, metavar="FOLDER")
    parser.add_argument("--peers", action="store_true", help="other libraries too")
    given = parser.parse_args()
    files = [given.scenes / f"{stem}.yaml" for stem in (*STEMS, *MORE * given.peers)]
    cases: dict[str, Scene] = {
        title(file.stem): replace(read_scene(file, "simulate"), outputs=()) for file in files
    }
    cases["B1, stiff contact"] = scene_of("B1", 60.0 / STIFF**0.5, k3=STIFF, k4=STIFF)
    paths = DEFAULT | (dict(peers()) if given.peers else {})
    files.append(given.scenes / "b3.yaml")
    fig13 = read_scene(files[-1])
    linear = [*sweep_timings(fig13), *threshold_timings(), *map_timings(fig13)]
    points, checks = measure(cases, paths, LONG if given.peers else PATIENCE, given.peers)
    found = {
        "points": [asdict(p) for p in points],
        "checks": [asdict(c) for c in checks],
        "linear": [asdict(t) for t in linear],
        "provenance": provenance(files, "squeal.article.studies.precision").to_dict(),
    }
    print(to_json(found), end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
