"""Maps over the spring angles with traced boundaries.

The verdict on model B3 about the origin; where model B2 has a sliding equilibrium, in which
contact, with which verdict; and whether the printed conditions (23a, b) allow or deny it.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from squeal.analysis.maps import BEYOND_FOLD, NAMES, Found, angle_axes, on_grid, traced_map
from squeal.article.equations import bounds
from squeal.article.results.angles import Angles, Coding, Shares
from squeal.article.studies._scenes import read_cases, read_scenes
from squeal.io.scene import Scene
from squeal.model.states import FULL, NONE, STATES
from squeal.numerics.outline import Outline

FINE, COARSE = 240, 90  # points a side of the maps of B3 and of B2
CODING = Coding(len(NAMES), len(STATES))


def equilibria(scene: Scene) -> Outline:
    """Outline of verdict, contact and (23a, b) as printed over the angles, for a B2 scene."""

    def encoded(found: Found, angles: np.ndarray) -> np.ndarray:
        printed = np.asarray(bounds(scene.pad, angles).as_printed)
        return CODING.encode(found.codes, found.contact, printed)

    axes = angle_axes(COARSE)
    angles = axes[0].values
    found = on_grid(scene, ("alpha1", "alpha2"), angles, angles)
    codes = encoded(found, np.array(np.meshgrid(angles, angles, indexing="ij")))
    return traced_map(scene, axes, codes, encoded)


def shares(found: Outline) -> Shares:
    """Shares of the area of B2's map: of each contact, and where the printed conditions mislead."""
    part = np.zeros(len(CODING.codes))
    for code, area in found.area.items():
        part[code] = area / np.pi**2
    verdict, printed = CODING.verdict_of, CODING.printed_of
    full, none = (CODING.contact_of == STATES.index(state) for state in (FULL, NONE))
    kept = verdict <= NAMES.index("marginal")

    def share(chosen: np.ndarray) -> float:
        return float(part[chosen].sum())

    return Shares(
        exists=share(verdict != BEYOND_FOLD),
        full=share(full),
        partial=share(~full & ~none),
        quiet=share(kept),
        quiet_full=share(kept & full),
        denied=share(kept & ~printed),
        denied_full=share(kept & full & ~printed),
        wrongly_allowed=share(~kept & printed),
    )


def by_verdict(found: Outline) -> dict[str, float]:
    """Share of the area for each verdict."""
    area = {k: v / np.pi**2 for k, v in found.area.items()}
    return {name: area.get(k, 0.0) for k, name in enumerate(NAMES)}


def study(files: Sequence[Path]) -> Angles:
    """The maps for the scenes of B2 and of B3, with the cases' angles to mark on them."""
    cases, b3 = read_cases(files, "B2"), read_scenes(files, ["b3"])["b3"]
    fine = angle_axes(FINE)
    grid = on_grid(b3, ("alpha1", "alpha2"), fine[0].values, fine[1].values)
    of_b2, of_b3 = equilibria(cases["c"]), traced_map(b3, fine, grid.codes)
    return Angles(
        mu=cases["c"].pad.mu,
        marks={case: (s.pad.alpha1, s.pad.alpha2) for case, s in cases.items()},
        verdicts=NAMES,
        coding=CODING,
        b2=of_b2,
        b3=of_b3,
        share=shares(of_b2),
        share_b2=by_verdict(of_b2.regrouped(CODING.verdict_of)),
        share_b3=by_verdict(of_b3),
    )
