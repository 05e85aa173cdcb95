"""Time of the B3 map against `numpy.linalg.eigvals` on the same matrices, in one run.

`python benchmarks/map.py [SCENE.yaml] [--n 1000]`; the verdicts of both are compared at all points.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from squeal.analysis.maps import angle_axes, stability_map
from squeal.article.precision.maps import matrices, named
from squeal.io.scene import read_scene

SCENE = Path(__file__).parent.parent / "workflow" / "scenes" / "b3.yaml"
REPEATS = 5


def fastest(task: Callable[[], object], repeats: int) -> float:
    """Seconds of the fastest of some runs."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        task()
        times.append(time.perf_counter() - start)
    return min(times)


def main() -> None:
    """Print times, their ratio and the points with different verdicts."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", type=Path, nargs="?", default=SCENE, metavar="SCENE.yaml")
    parser.add_argument("--n", type=int, default=1000)
    given = parser.parse_args()
    scene, axes = read_scene(given.scene), angle_axes(given.n)
    stack = matrices(scene, given.n)
    ours = fastest(lambda: stability_map(scene, axes), REPEATS)
    theirs = fastest(lambda: np.linalg.eigvals(stack), 2)
    codes, distance = named(np.linalg.eigvals(stack))
    found = stability_map(scene, axes)
    other = codes != found.codes
    print(f"{given.n} x {given.n} points of {given.scene.name}; the map's time includes forming K")
    print(f"map {ours:.4f} s, numpy.linalg.eigvals {theirs:.4f} s, ratio {theirs / ours:.1f}")
    print(", ".join(f"{name} {share:.6f}" for name, share in found.share.items() if share))
    nearest = f", all within {distance[other].max():.1g} of a boundary" if np.any(other) else ""
    print(f"{np.sum(other)} points with another verdict by numpy{nearest}")


if __name__ == "__main__":
    main()
