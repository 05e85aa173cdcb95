"""Point against line contact at equal load: springs along the face, from two to many."""

from squeal.article.results.map_ranges import Share
from squeal.article.results.records import Missing, Record, Result

TOLERANCE = 1e-9
"""Of the motions from other starts."""


class Contact(Record):
    """A motion on some springs, or on the line (count 0).

    lost, apart: shares of the time in which some point is apart, and in which all are; losses: how
    often the surfaces separate; peak: the greatest reaction over F_n; off: greatest distance from
    the motion on the line, over the range of that motion.
    """

    count: int
    lost: Share
    apart: Share
    losses: int
    peak: float
    off: float


class Threshold(Record):
    """A change of verdict along the branch from mu = 0."""

    mu: float
    kind: str


class Case(Record):
    """A case of the angles. partial: some equilibrium of its branch is in partial contact.

    thresholds: of the line ("0") and of some numbers of springs, which all are the line's where
    the branch stays in full contact.
    """

    line: Contact | Missing
    springs: tuple[Contact | Missing, ...]
    partial: bool
    thresholds: dict[str, tuple[Threshold, ...]]


class Compared(Record):
    """Two springs against the line from many starts: in how many something takes longer on the
    springs, in how many not as long, and in how many alike (to `ALIKE` of the time).

    windows: how many times the scene's time; lost: of some contact, apart: of all of it.
    """

    windows: int
    lost: tuple[int, int, int]
    apart: tuple[int, int, int]


ALIKE = 0.005
"""Shares of time that differ by less are the same."""


class LineSprings(Result):
    """By case; starts: two springs from other starts, by case, empty without batches; stop: of the
    motions (ms), mu_max: of the branches."""

    cases: dict[str, Case]
    starts: dict[str, tuple[Compared, ...]]
    stop: float
    mu_max: float
