"""Settings of equilibria: how a branch over mu is followed, and what counts as admissible."""

import math
from dataclasses import dataclass, fields
from typing import Any

from squeal.errors import InputError


def _check_positive(record: Any) -> None:
    for one in fields(record):
        value = getattr(record, one.name)
        if not (math.isfinite(value) and value > 0):
            raise InputError(
                f"{type(record).__name__}: {one.name}: {value!r} is not allowed; it must be a "
                "finite number above 0"
            )


@dataclass(frozen=True)
class ContinuationSettings:
    """Steps of the continuation by arc length, in the pad's natural units.

    There the load displaces the contact by about one. The defaults follow the branches of random
    pads without loss; smaller ones cost time, larger ones risk a jump to another branch.
    """

    first_step: float = 0.02  # small beside the displacement under the load
    longest_step: float = 0.25  # a quarter of it; it grows with the distance from the origin
    growth: float = 1.5  # of a step after one that was accepted; one that was not is halved
    shortest_step: float = 1e-10  # the branch is lost where even this fails
    cosine: float = 0.95  # least, between the tangents of a step: it turns by 18 degrees at most
    correction: float = 0.2  # largest, as a share of the step: farther off lies another branch
    most_steps: int = 4000
    farthest: float = 100.0  # free lengths of both springs: the equilibrium has run away
    tilt: float = math.pi / 2  # rad: there the lower face no longer faces the surface
    # of many pads at once, which walk over mu itself and not over arc length
    first_share: float = 1 / 8  # of mu: the first step
    shortest_share: float = 1 / 2000  # of mu: the branch turns back where even this fails
    jump: float = 0.3  # largest, over 1 and the place itself: farther off lies another branch

    def __post_init__(self) -> None:
        _check_positive(self)
        for name, allowed, holds in (
            ("growth", "above 1", self.growth > 1),
            ("cosine", "below 1", self.cosine < 1),
            ("tilt", "at most pi/2", self.tilt <= math.pi / 2),
            ("first_step", "at most longest_step", self.first_step <= self.longest_step),
            ("shortest_step", "at most first_step", self.shortest_step <= self.first_step),
            ("first_share", "at most 1", self.first_share <= 1),
            ("shortest_share", "below first_share", self.shortest_share < self.first_share),
        ):
            if not holds:
                raise InputError(
                    f"ContinuationSettings: {name}: {getattr(self, name)!r} is not allowed; it "
                    f"must be {allowed}"
                )


@dataclass(frozen=True)
class AdmissibleLimits:
    """How far an equilibrium may lie from where the pad is put and still be one of the model.

    Pads at rest keep far within: those of the article tilt by 0.03 rad, travel by 0.03 half lengths
    and press with less than the load.
    """

    # rad: the constant friction arm h of Eq. (10) and the face's length are then off by cos: 2 %
    tilt: float = 0.2
    # of the shortest of half length and free lengths: the springs' far ends count as fixed beside
    # it, and a displacement of that size against the surface is a penetration, no compression
    travel: float = 0.5
    # times the load: springs and friction, no more the brake, press the pad; it wedges itself
    reaction: float = 10.0

    def __post_init__(self) -> None:
        _check_positive(self)


DEFAULT = ContinuationSettings()
LIMITS = AdmissibleLimits()
