"""How many initial conditions lead to sustained loss of contact, by how far they lie from sliding.

Case (d) at the damping of the cycles, where sliding is stable: initial conditions from boxes of
several half-widths about the equilibrium, see `onset.sampled_states`.
"""

import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

from scipy.stats import binomtest

from squeal.article.identify.space import compression
from squeal.article.records import Record, Result
from squeal.article.studies._heyoka import without_heyoka
from squeal.article.studies._scenes import read_scenes
from squeal.article.studies.energy import under_both_laws
from squeal.article.studies.onset import (
    BOX,
    LONGER,
    RATIO,
    SEED,
    STARTS,
    DampedStart,
    damped,
    sampled_states,
    settle_late,
)
from squeal.equilibrium.damping import damped_model
from squeal.io.scene import Scene

MOTIONS = ("b1-d", "b2-d-integral")
HALF_WIDTHS = (0.5, 1.0, 1.5, 2.0, BOX)  # of the boxes, in static compressions
CONFIDENCE = 0.95  # of the intervals of shares
AXES = ("x", "y", "w theta", "x_dot", "y_dot", "w theta_dot")
Share = Annotated[float, ".0%"]


class SampledShare(Record):
    """Initial conditions from a box of one half-width, over the static compression.

    lasting: how many of `starts` lead to sustained loss of contact; share: of them; low, high: the
    exact (Clopper and Pearson's) interval of the share with the confidence `CONFIDENCE`.
    """

    half_width: float
    starts: int
    lasting: int
    share: Share
    low: Share
    high: Share


class Basin(Result):
    """shares: by motion, a row per half-width; compression: by motion, in micrometres; ratio: modal
    damping; axes: of the box, velocities over (k1/m)^(1/2); seed: of the draws; windows:
    observation times after which a motion is observed."""

    shares: dict[str, tuple[SampledShare, ...]]
    compression: dict[str, float]
    ratio: Annotated[float, ".1%"] = RATIO
    axes: tuple[str, ...] = AXES
    seed: int = SEED
    confidence: Annotated[float, ".0%"] = CONFIDENCE
    windows: int = LONGER
    left_out: str = ""


def shares(scene: Scene) -> tuple[SampledShare, ...]:
    """A row per half-width of the box."""
    assert scene.stop is not None
    model = damped_model(damped(scene, RATIO))
    rows = []
    for half_width in HALF_WIDTHS:
        states = sampled_states(scene, half_width, STARTS)
        late = settle_late([DampedStart(model, state) for state in states], scene.stop)
        lasting = sum(settled is not None and settled.goes_on for settled in late.settled)
        rows.append(sampled_share(half_width, lasting, len(states)))
    return tuple(rows)


def sampled_share(half_width: float, lasting: int, starts: int) -> SampledShare:
    """A count with its share and interval."""
    interval = binomtest(lasting, starts).proportion_ci(CONFIDENCE, method="exact")
    return SampledShare(
        half_width=half_width,
        starts=starts,
        lasting=lasting,
        share=lasting / starts,
        low=float(interval.low),
        high=float(interval.high),
    )


def study(files: Sequence[Path]) -> Basin:
    """Case (d) of both models, line contact under the energy-consistent law."""
    scenes = under_both_laws(read_scenes(files, ("b1-d", "b2-d")))
    if why := without_heyoka("nothing else simulates ensembles."):
        return Basin(shares={}, compression={}, left_out=why)
    return Basin(
        shares={name: shares(scenes[name]) for name in MOTIONS},
        compression={name: 1e6 * compression(scenes[name].pad) for name in MOTIONS},
    )


def sentences(record: Basin) -> Mapping[str, bool]:
    """What the paper says of these shares."""
    if record.left_out:
        return {}

    def shares_at(half_width: float) -> list[SampledShare]:
        """The share of that box for each of `MOTIONS`."""
        rows_of_box = []
        for rows in record.shares.values():
            rows_of_box += [row for row in rows if row.half_width == half_width]
        return rows_of_box

    points_at_one, line_at_one = shares_at(1.0)
    return {
        "share-that-lasts-grows-with-the-box": all(map(_grows, record.shares.values())),
        "few-last-within-half-a-compression": all(row.high < 0.1 for row in shares_at(0.5)),
        "less-than-half-last-within-one-compression": points_at_one.share < 0.5
        and line_at_one.share < 0.5,
        "most-last-within-two-compressions": all(row.low > 0.5 for row in shares_at(2.0)),
        "points-last-from-more-within-one-compression": points_at_one.low > line_at_one.high,
    }


def _grows(rows: Sequence[SampledShare]) -> bool:
    """Whether the share never falls with the box, and rises from the least to the greatest by more
    than its intervals."""
    never_falls = all(a.share <= b.share for a, b in itertools.pairwise(rows))
    return never_falls and rows[0].high < rows[-1].low
