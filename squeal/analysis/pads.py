"""Random pads: how often each verdict occurs when parameters take any value of their ranges.

Pads are drawn in blocks, each from a random stream of its own, so that a study counts the same
whatever the parts in which it is computed.
"""

from dataclasses import dataclass

import numpy as np

from squeal.analysis.maps import NAMES, check_axis, check_names, codes_at
from squeal.io.scene import Scene
from squeal.schema.place import Place
from squeal.schema.values import Whole

BLOCK = 10_000
BINS = Whole(1, 1000)
COUNT = Whole(1, 10**12)
SEED = Whole(0, 2**63)


@dataclass(frozen=True)
class Range:
    """The values that one parameter may take: evenly spread, or their logarithms.

    Raises InputError for an unknown parameter or for values that no pad may have.
    """

    name: str
    low: float
    high: float
    logarithmic: bool = False

    def __post_init__(self) -> None:
        check_axis(self.name, self.low, self.high, 2, Place("Range"), self.logarithmic)

    def values(self, shares: np.ndarray) -> np.ndarray:
        """Values at shares between 0 and 1 of the range."""
        if self.logarithmic:
            return self.low * (self.high / self.low) ** shares
        return self.low + (self.high - self.low) * shares


@dataclass(frozen=True)
class RandomPads:
    """`count` pads whose parameters in `ranges` are drawn, all others being the scene's.

    They are counted in `bins` equal parts of the first range (of its logarithm, where that is
    spread). Raises InputError for a parameter that the scene does not use.
    """

    scene: Scene
    ranges: tuple[Range, ...]
    count: int
    bins: int = 20
    seed: int = 1

    def __post_init__(self) -> None:
        at = Place("RandomPads")
        check_names(self.scene, self.names, at / "ranges")
        for kind, name in ((COUNT, "count"), (BINS, "bins"), (SEED, "seed")):
            kind.read(getattr(self, name), at / name)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters that are drawn."""
        return tuple(each.name for each in self.ranges)

    @property
    def blocks(self) -> int:
        """Number of blocks, the last of which may be shorter."""
        return -(-self.count // BLOCK)

    @property
    def edges(self) -> np.ndarray:
        """Edges (bins + 1,) of the bins."""
        return self.ranges[0].values(np.arange(self.bins + 1) / self.bins)

    def draw(self, block: int) -> tuple[np.ndarray, np.ndarray]:
        """Bins (n,) and values (len(ranges), n) of the pads of one block."""
        n = min(BLOCK, self.count - block * BLOCK)
        shares = np.random.default_rng([self.seed, block]).random((len(self.ranges), n))
        values = [each.values(row) for each, row in zip(self.ranges, shares, strict=True)]
        return (shares[0] * self.bins).astype(int), np.array(values)

    def counts(self, start: int, stop: int) -> np.ndarray:
        """Numbers (bins, len(NAMES)) of pads with each verdict, in the blocks from start to stop.

        Raises ComputationError where damping ratios meet a mode that is unstable without friction.
        """
        found = np.zeros((self.bins, len(NAMES)), dtype=np.int64)
        for block in range(start, stop):
            bins, values = self.draw(block)
            np.add.at(found, (bins, codes_at(self.scene, self.names, values).codes), 1)
        return found
