"""Where the energy of the article's motions comes from, in J."""

from typing import Annotated, Literal

from squeal.article.results.records import Missing, Record, Result

LineForce = Literal["integral", "mean"]
ROUNDING = 1e-9  # of the greatest kinetic energy: less than that is no work
LAWS: dict[LineForce, str] = {"mean": "printed law", "integral": "integral law"}
"""The two laws of line contact and what the report calls them."""


def motion_title(name: str) -> str:
    """Model, case and law of a motion from its name: b2-c-mean becomes B2 (c), printed law."""
    model, case, *law = name.split("-")
    words = [f", {title}" for key, title in LAWS.items() if law == [key]]
    return f"{model.upper()} ({case}){''.join(words)}"


class Stay(Record):
    """A stay in partial contact (ms), and what the contact law fed in during it (J)."""

    start: float
    stop: float
    fed: float


class Span(Record):
    """A motion from its start over so many times the time of its scene.

    friction, law: works at the end; most: the greatest of friction so far; kinetic: the greatest;
    peak: of the first signal over F_n (F3 or Rn); apart: share of the time without any contact;
    calm: greatest late acceleration over the greatest; pause: longest time between two changes of
    contact, over that of the scene.
    """

    windows: int
    friction: float
    most: float
    law: float
    kinetic: float
    peak: float
    apart: float
    calm: float
    pause: float


class Motion(Record):
    """A motion under one contact law.

    friction, load, law: works at the end, that of the law beyond what its potential gives back;
    kinetic: the greatest kinetic energy; residue: how far the balance of all works is from closing,
    over it; stays: all in partial contact; curves: t (ms) and kinetic and elastic energy (of
    springs and contact) and works so far, for the motions that are drawn; spans: the motion over
    the time of the scene and longer.
    """

    friction: float
    load: float
    law: float
    kinetic: float
    residue: Annotated[float, ".1g"]
    stays: tuple[Stay, ...]
    curves: dict[str, tuple[float, ...]]
    spans: tuple[Span, ...]

    def fed(self, sign: int) -> list[float]:
        """What was fed in during the stays that gain (sign 1) or lose (-1), without rounding."""
        least = ROUNDING * self.kinetic
        return [s.fed for s in self.stays if sign * s.fed > least]


class Energy(Result):
    """By name of the scene, that of line contact with its law: b1-c, b2-c-mean, b2-c-integral.

    own: the names of those under the scenes' own laws.
    """

    motions: dict[str, Motion | Missing]
    own: tuple[str, ...]

    @property
    def wrong(self) -> str:
        """Energy that comes from nowhere, or from a law that has a potential."""
        for name, motion in self.motions.items():
            if isinstance(motion, Missing):
                continue
            if motion.residue > ROUNDING:
                return f"the energy balance of {name} is open by {motion.residue:.1g}"
            if not name.endswith("mean") and (motion.fed(1) or motion.fed(-1)):
                return f"the law of {name} has a potential but feeds energy in"
        return ""
