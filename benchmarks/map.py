"""Time of the B3 map against `numpy.linalg.eigvals` on the same matrices, in one run.

`python benchmarks/map.py [SCENE.yaml] [--n 1000]`; the verdicts of both are compared at all points.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from squeal.article.equations import spring_directions
from squeal.io.scene import Scene, read_scene
from squeal.model.equations import about_origin
from squeal.queries.pads.maps import angle_axes, stability_map

SCENE = Path(__file__).parent.parent / "workflow" / "scenes" / "b3.yaml"
REPEATS = 5


def matrices(scene: Scene, n: int) -> np.ndarray:
    """M^-1 K of every point of the map, shape (n, n, 3, 3)."""
    pad = scene.pad
    axes = angle_axes(n)
    a1, a2 = spring_directions(pad, (axes[0].values, axes[1].values))
    K = np.zeros((n, n, 3, 3)) + about_origin(scene.pad_model.replace(k1=0.0, k2=0.0)).K
    K += pad.k1 * np.einsum("ik,jk->kij", a1, a1)[:, None]
    K += pad.k2 * np.einsum("ik,jk->kij", a2, a2)
    return np.asarray(K / np.array([pad.m, pad.m, pad.I])[:, None])


def named(s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Verdict codes from s = -lambda^2 (..., 3), and the distance to the nearest boundary.

    The distance is that of two roots, or of a root from zero, over the largest root.
    """
    size = np.abs(s).max(-1)
    growth = np.abs(np.sqrt(-s.astype(complex)).real)
    pair = np.abs(s.imag) > 1e-9 * size[..., None]
    flutter = np.where(pair, growth, 0.0).max(-1)
    divergence = np.where(~pair & (s.real < 0.0), growth, 0.0).max(-1)
    codes = np.where(flutter > divergence, 2, np.where(divergence > 0.0, 3, 1))
    gaps = [np.abs(s[..., i] - s[..., j]) for i, j in ((0, 1), (0, 2), (1, 2))]
    return codes, np.min([*gaps, *np.moveaxis(np.abs(s), -1, 0)], axis=0) / size


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
    scene = read_scene(given.scene)
    axes = angle_axes(given.n)
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
