"""Map of the quasi-static sliding motion of model B3 over the two spring angles (Fig. 13)."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from squeal.article.cases import CASES, SMALL_REGION, stem
from squeal.article.equations import (
    Readings,
    RowPairs,
    bounds,
    mismatch,
    quasi_static_map,
    row_pairs,
    state_sides,
)
from squeal.article.outline import Outline, outline
from squeal.article.records import Record, Result
from squeal.article.studies._scenes import REFERENCE, by_set, read_scenes
from squeal.model.pad import Pad

CELLS = 240  # a side
ENDS = ((0.0, math.pi), (0.0, math.pi))  # of the map over alpha1 and alpha2, rad

Curve = tuple[tuple[float, float], ...]
"""Points (alpha1, alpha2) in rad."""


class CaseRows(Record):
    """The restricted state of one case: what pairs of rows give, and K31/(h K11) - 1.

    exists: both pairs of rows give the same x to rounding, and a positive reaction.
    """

    rows: RowPairs
    mismatch: float
    exists: bool


class QuasiStatic(Result):
    """Map of n x n cells at the scene's mu, of the reference set but for `sets`.

    as_printed, complete: regions (code 1) where (23a, b) hold as printed, and where the complete
    necessary conditions do; state: the curve on which the restricted state itself exists; cases:
    that state in each case; sets: shares of the map of each parameter set, the reference included.
    """

    n: int
    mu: float
    share: Readings
    as_printed: Outline
    complete: Outline
    state: tuple[Curve, ...]
    cases: dict[str, CaseRows]
    sets: dict[str, Readings]


def state_curves(pad: Pad, cells: int = CELLS) -> tuple[Curve, ...]:
    """The curve K31 = h K11 where R_n > 0, for mu > 0, as points (alpha1, alpha2) in rad.

    A map has four codes, by the sign of K31 - h K11 and that of R_n. Its boundaries are traced, and
    those between two regions of R_n > 0 belong to the curve. Their points lie on it at the edges of
    the cells, with chords between; they end within the cell in which R_n changes its sign.
    """
    angles = math.pi * (np.arange(cells) + 0.5) / cells

    def codes(points: np.ndarray) -> np.ndarray:
        """1 above the curve, and 2 more where the reaction is positive."""
        above, pressed = state_sides(pad, (points[0], points[1]))
        return np.asarray(above + 2 * pressed)

    grid = np.array(np.meshgrid(angles, angles, indexing="ij"))
    traced = outline(ENDS, angles, angles, codes(grid), codes)
    pressed_below = 2
    pressed_above = 3
    curves: list[Curve] = []
    for points, sides in traced.curves:
        if sides == (pressed_below, pressed_above):
            curves.append(tuple((round(a1, 7), round(a2, 7)) for a1, a2 in points.tolist()))
    return tuple(curves)


def case_rows(pad: Pad) -> CaseRows:
    """The restricted state of a pad with F_n."""
    rows = row_pairs(pad)
    missed = mismatch(pad)
    exists = rows.R_12 > 0.0 and math.isclose(rows.x_12, rows.x_23, rel_tol=1e-12)
    return CaseRows(rows, missed, exists)


def quasi_static(
    pad: Pad,
    cells: int = CELLS,
    cases: Mapping[str, Pad] | None = None,
    sets: Mapping[str, Pad] | None = None,
) -> QuasiStatic:
    """The map of so many cells a side, with the boundaries of both readings traced.

    cells: fewer than `CELLS` are for tests; cases: pads with F_n by case; sets: a pad of each
    parameter set, by its name.
    """
    maps = quasi_static_map(pad, cells)

    def region(reading: str) -> Outline:
        """Where a reading of the conditions holds, by the name of its field."""

        def codes_at(angles: np.ndarray) -> np.ndarray:
            return np.asarray(getattr(bounds(pad, angles), reading)).astype(int)

        codes = getattr(maps, reading).astype(int)
        return outline(ENDS, maps.angles, maps.angles, codes, codes_at)

    return QuasiStatic(
        n=cells,
        mu=pad.mu,
        share=maps.share,
        as_printed=region("as_printed"),
        complete=region("complete"),
        state=state_curves(pad, cells),
        cases={case: case_rows(of_case) for case, of_case in (cases or {}).items()},
        sets={name: quasi_static_map(of_set, cells).share for name, of_set in (sets or {}).items()},
    )


def study(files: Sequence[Path]) -> QuasiStatic:
    """The map of the reference scene of model B3, and the shares of the other sets."""
    folders = by_set(files)
    linear = {name: read_scenes(of_set, ["b3"])["b3"].pad for name, of_set in folders.items()}
    line = read_scenes(folders[REFERENCE], [stem("B2", case) for case in CASES])
    cases = {case: line[stem("B2", case)].pad for case in CASES}
    return quasi_static(linear[REFERENCE], cases=cases, sets=linear)


def sentences(record: QuasiStatic) -> dict[str, bool]:
    """What the paper says of the map."""
    share = record.share
    cases = record.cases
    others = [of_set for name, of_set in record.sets.items() if name != REFERENCE]
    return {
        "printed-conditions-hold-on-a-small-part": share.as_printed < 0.1,
        "complete-conditions-hold-on-a-small-part": 0.1 < share.complete < SMALL_REGION,
        "complete-conditions-hold-on-more-than-a-quarter-with-other-sets": all(
            SMALL_REGION < of_set.complete < 0.35 for of_set in others
        ),
        "printed-conditions-leave-out-a-part": all(
            of_set.as_printed < of_set.complete for of_set in (share, *others)
        ),
        "rows-contradict-each-other-in-a-and-b": all(
            cases[case].rows.x_12 > 0.0 > cases[case].rows.x_23 for case in "ab"
        ),
        "no-case-is-on-the-curve": not any(case.exists for case in cases.values()),
    }
