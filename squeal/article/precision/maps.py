"""Error against run time of the B3 map: our verdicts and those from `numpy.linalg.eigvals`."""

import numpy as np

from squeal.analysis.maps import angle_axes, stability_map
from squeal.article.precision.measure import timed
from squeal.article.results.precision import Timing
from squeal.io.scene import Scene
from squeal.linear import VERDICTS
from squeal.model.linear import about_origin, spring_directions

SIZES = (20, 40, 80, 160, 320)
FINEST = 2560  # points a side of the map that counts as exact


def matrices(scene: Scene, n: int) -> np.ndarray:
    """M^-1 K of every point of the map, shape (n, n, 3, 3)."""
    pad, axes = scene.pad, angle_axes(n)
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


def map_timings(scene: Scene) -> list[Timing]:
    """Greatest error of a verdict's share of the area and time of a map, by program and size.

    Both programs' times include forming the matrices.
    """

    def ours(n: int) -> np.ndarray:
        return stability_map(scene, angle_axes(n)).codes

    def theirs(n: int) -> np.ndarray:
        return named(np.linalg.eigvals(matrices(scene, n)))[0]

    def shares(codes: np.ndarray) -> np.ndarray:
        return np.bincount(codes.ravel(), minlength=len(VERDICTS)) / codes.size

    exact = shares(ours(FINEST))
    found = []
    for name, program in (("squeal", ours), ("numpy.linalg.eigvals", theirs)):
        for n in SIZES:
            codes, seconds = timed(lambda n=n, program=program: program(n))  # type: ignore[misc]
            error = float(np.abs(shares(codes) - exact).max())
            found.append(Timing("map", name, n, error, seconds))
    return found
