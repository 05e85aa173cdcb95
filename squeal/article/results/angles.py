"""Maps over the spring angles with traced boundaries, for models B2 and B3."""

from typing import Annotated

import numpy as np

from squeal.article.results.records import Record, Result
from squeal.numerics.outline import Outline


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
