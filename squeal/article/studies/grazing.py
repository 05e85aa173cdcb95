"""Why case (c) of the line hammers at strong damping alone: its trailing blow over the damping.

The settled motion of B2 (c) under the energy-consistent law, from the reference initial conditions.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Annotated

import numpy as np

from squeal.article.claims.measures import case_of
from squeal.article.claims.motions import measures
from squeal.article.claims.rules import LEVEL
from squeal.article.identify.ensemble import Arrays
from squeal.article.records import Record, Result
from squeal.article.studies._heyoka import without_heyoka
from squeal.article.studies._scenes import read_scenes
from squeal.article.studies.onset import LONGER, DampedStart, damped, run
from squeal.equilibrium.damping import damped_model
from squeal.io.scene import Scene
from squeal.model.contact import FULL, TRAIL

RATIOS = (
    *(0.001, 0.002, 0.003, 0.004, 0.005, 0.0055, 0.006, 0.0065, 0.0066, 0.0067, 0.0068, 0.0069),
    *(0.007, 0.0075, 0.008, 0.009, 0.01, 0.012, 0.014, 0.016, 0.018, 0.02),
)
PLACES = 400  # in each step, at which the impulse of a blow is cut and summed
Ratio = Annotated[float, ".2%"]


class Blow(Record):
    """The settled motion at one damping ratio.

    trailing: impulse of the heaviest blow on the trailing half of the face over F_n T_1; alone:
    share of time in which the trailing edge touches and the leading one does not; full: share in
    full contact.
    """

    ratio: Ratio
    trailing: float
    alone: float
    full: float


class Grazing(Result):
    """blows: a row per damping ratio; grazes: the ratio below which the trailing edge never touches
    alone, crosses: the ratio at which its blow passes the least one of hammering (`level`), both
    by linear interpolation; windows: observation times after which the motion is observed."""

    blows: tuple[Blow, ...]
    grazes: Ratio | None
    crosses: Ratio | None
    level: float = LEVEL
    windows: int = LONGER
    left_out: str = ""


def settled(scene: Scene, ratios: Sequence[float]) -> Arrays:
    """Measures of the motions over one observation time after `LONGER`, one a damping ratio."""
    assert scene.stop is not None
    models = [damped_model(damped(scene, ratio)) for ratio in ratios]
    starts = [DampedStart(model, np.array(scene.initial)) for model in models]
    ends = run(starts, LONGER * scene.stop)["final"]
    late = [DampedStart(model, end) for model, end in zip(models, ends, strict=True)]
    return run(late, scene.stop, partial(measures, places=PLACES))


def ratio_of_grazing(blows: Sequence[Blow]) -> float | None:
    """The damping ratio at which the trailing edge begins to touch alone.

    Its share of time, linear in the ratio, is continued to zero from the first two ratios at which
    there is one; at least the last ratio at which there is none. None where the edge begins to do
    so at no ratio between the first and the last.
    """
    for before, first, second in zip(blows, blows[1:], blows[2:], strict=False):
        if before.alone == 0.0 < first.alone:
            slope = (second.alone - first.alone) / (second.ratio - first.ratio)
            return max(first.ratio - first.alone / slope, before.ratio)
    return None


def ratio_of_hammering(blows: Sequence[Blow]) -> float | None:
    """The damping ratio at which the trailing blow first passes `LEVEL`, by interpolation between
    two of the ratios; None where it does not."""
    for lighter, heavier in pairwise(blows):
        if lighter.trailing <= LEVEL < heavier.trailing:
            impulses = [lighter.trailing, heavier.trailing]
            return float(np.interp(LEVEL, impulses, [lighter.ratio, heavier.ratio]))
    return None


def grazing(scene: Scene) -> Grazing:
    """The trailing blows of a scene at all `RATIOS`, the ratio at which they begin, and that at
    which they are heavy enough to count as hammering."""
    settled_measures = settled(scene, RATIOS)
    blows = []
    for i, ratio in enumerate(RATIOS):
        case = case_of(settled_measures, i)
        _leading, trailing = case.heaviest
        blows.append(
            Blow(
                ratio=ratio,
                trailing=trailing,
                alone=case.shares.get(TRAIL, 0.0),
                full=case.shares.get(FULL, 0.0),
            )
        )
    return Grazing(
        blows=tuple(blows),
        grazes=ratio_of_grazing(blows),
        crosses=ratio_of_hammering(blows),
    )


def study(files: Sequence[Path]) -> Grazing:
    """Case (c) of model B2."""
    scene = read_scenes(files, ("b2-c",))["b2-c"]
    if why := without_heyoka("nothing else simulates ensembles."):
        return Grazing(blows=(), grazes=None, crosses=None, left_out=why)
    return grazing(scene)


def sentences(record: Grazing) -> Mapping[str, bool]:
    """What the paper says of these blows."""
    if record.left_out:
        return {}
    grazes = record.grazes or np.nan  # a ratio that does not exist fails all comparisons
    crosses = record.crosses or np.nan
    weak = [blow for blow in record.blows if blow.ratio < grazes]
    strong = [blow.trailing for blow in record.blows if blow.ratio > grazes]
    grows = all(a < b for a, b in pairwise(strong))
    return {
        "trailing-edge-grazes-between-half-and-six-tenths-per-cent": 0.005 < grazes < 0.006
        and all(blow.alone == 0.0 and blow.trailing == 0.0 for blow in weak),
        "trailing-blow-grows-with-damping": bool(strong) and grows,
        "trailing-blow-passes-the-threshold-near-seven-tenths-per-cent": 0.0065 < crosses < 0.0072,
    }
