"""The stored pads judged afresh."""

from squeal.article.results.records import Record, Result

TOLERANCE = 1e-12  # of all motions but the variations'


class Switches(Record):
    """The formulation of a search, as `squeal.model.contact.Formulation` names it."""

    line_force: str
    delta_from: str
    delta_moment: str


class Failing(Record):
    """A claim that a pad does not keep."""

    id: str
    verdict: str
    margin: float
    measured: str


class Changed(Record):
    """A verdict that changes with tolerance or horizon; `claim` is empty where the motion ends."""

    variation: str
    claim: str
    verdict: str


class VerifiedPad(Record):
    """The best pad of a search: effort of the search, the pad's numbers, the claims it keeps."""

    formulation: Switches
    seed: int
    starts: int
    pads: int
    numbers: dict[str, float]
    reproduced: int
    failing: tuple[Failing, ...]
    changed: tuple[Changed, ...]


class Verify(Result):
    """One pad a formulation, the best first.

    ceiling: how many claims can hold together; horizon: of the searches, in units of time; own:
    what changes for the pad of the scenes.
    """

    formulations: tuple[VerifiedPad, ...]
    ceiling: int
    horizon: float
    own: tuple[Changed, ...]
