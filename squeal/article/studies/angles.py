"""Maps over the spring angles with traced boundaries.

The verdict on model B3 about the origin; where model B2 has a sliding equilibrium, in which
contact, with which verdict; and whether the printed conditions (23a, b) allow or deny it.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np

from squeal.analysis.maps import BEYOND_FOLD, NAMES, Found, angle_axes, on_grid, traced_map
from squeal.article.equations import bounds
from squeal.article.records import Record, Result
from squeal.article.studies._scenes import read_cases, read_scenes
from squeal.io.scene import Scene
from squeal.model.states import FULL, NONE, STATES
from squeal.numerics.outline import Outline

FINE, COARSE = 240, 90  # points a side of the maps of B3 and of B2


class Shares(Record):
    """Shares of the area of B2's map.

    exists: the equilibrium branch reaches the scene's mu; full, partial: its contact; quiet:
    nothing grows; quiet_full: so in full contact; denied, denied_full: quiet and quiet_full where
    the printed (23a, b) deny it; wrongly_allowed: allowed by them where nothing quiet is.
    """

    exists: Annotated[float, ".1%"]
    full: Annotated[float, ".1%"]
    partial: Annotated[float, ".1%"]
    quiet: Annotated[float, ".1%"]
    quiet_full: Annotated[float, ".1%"]
    denied: Annotated[float, ".1%"]
    denied_full: Annotated[float, ".1%"]
    wrongly_allowed: Annotated[float, ".1%"]


class Coding(Record):
    """One number for verdict, contact and whether (23a, b) hold as printed.

    verdicts, contacts: how many there are. A code indexes the arrays that say what it stands for.
    """

    verdicts: int
    contacts: int

    def encode(self, verdict: np.ndarray, contact: np.ndarray, printed: np.ndarray) -> np.ndarray:
        """The code; verdict and contact are indices, printed is 0 or 1."""
        return verdict + self.verdicts * (contact + self.contacts * printed)

    @property
    def codes(self) -> np.ndarray:
        """All codes."""
        return np.arange(2 * self.verdicts * self.contacts)

    @property
    def verdict_of(self) -> np.ndarray:
        """Verdict of each code."""
        return self.codes % self.verdicts

    @property
    def contact_of(self) -> np.ndarray:
        """Contact of each code."""
        return self.codes // self.verdicts % self.contacts

    @property
    def printed_of(self) -> np.ndarray:
        """Whether (23a, b) hold as printed, for each code."""
        return self.codes >= self.verdicts * self.contacts


class Angles(Result):
    """Outlines of the maps over (alpha1, alpha2), with the angles of each case to mark on them.

    b2: coded by `coding`, contacts as in `squeal.model.states.STATES`; b3: coded by verdict;
    verdicts: their names; share_b2, share_b3: shares of the area by verdict.
    """

    mu: float
    marks: dict[str, tuple[float, float]]
    verdicts: tuple[str, ...]
    coding: Coding
    b2: Outline
    b3: Outline
    share: Shares
    share_b2: dict[str, Annotated[float, ".1%"]]
    share_b3: dict[str, Annotated[float, ".1%"]]


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


def sentences(found: Angles) -> dict[str, bool]:
    """What the paper says of sliding equilibria."""
    return {"sliding-on-most-of-the-map": found.share.quiet > 0.5}
