"""Map of the quasi-static sliding motion of model B3 over the two spring angles (Fig. 13)."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from squeal.article.equations import Readings, bounds, quasi_static_map
from squeal.article.outline import Outline, outline
from squeal.article.records import Result
from squeal.article.studies._scenes import read_scenes
from squeal.model.pad import Pad

CELLS = 240  # a side
ENDS = ((0.0, math.pi), (0.0, math.pi))


class QuasiStatic(Result):
    """Map of n x n cells at the scene's mu: regions (code 1) of both readings of (23a, b)."""

    n: int
    mu: float
    share: Readings
    as_printed: Outline
    sign_aware: Outline


def quasi_static(pad: Pad, cells: int = CELLS) -> QuasiStatic:
    """The map of so many cells a side, with the boundaries of both readings traced."""
    maps = quasi_static_map(pad, cells)

    def region(reading: str) -> Outline:
        def at(angles: np.ndarray) -> np.ndarray:
            return np.asarray(getattr(bounds(pad, angles), reading)).astype(int)

        codes = getattr(maps, reading).astype(int)
        return outline(ENDS, maps.angles, maps.angles, codes, at)

    return QuasiStatic(cells, pad.mu, maps.share, region("as_printed"), region("sign_aware"))


def study(files: Sequence[Path]) -> QuasiStatic:
    """The map of the scene of model B3."""
    return quasi_static(read_scenes(files, ["b3"])["b3"].pad)


def sentences(record: QuasiStatic) -> dict[str, bool]:
    """What the paper says of the map."""
    return {"signs-decide-the-map": record.share.as_printed < 0.1 and record.share.sign_aware > 0.9}
