"""Admissible or not: where an equilibrium leaves what the models mean."""

import math
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np

from squeal.equilibrium.statics import Statics
from squeal.errors import InputError
from squeal.model.pad import pose


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
        for one in fields(self):
            value = getattr(self, one.name)
            if not (math.isfinite(value) and value > 0):
                raise InputError(
                    f"AdmissibleLimits: {one.name}: {value!r} is not allowed; it must be a finite "
                    "number above 0"
                )


LIMITS = AdmissibleLimits()


class Excursion(NamedTuple):
    """How far an equilibrium lies from the initial position, each a number or an array (n,).

    tilt: |theta0 + theta| in rad; travel: of the mass centre, over the shortest of half length and
    free lengths; reaction: R_n over the load, which is F_n or what presses in the initial position.
    """

    tilt: Any
    travel: Any
    reaction: Any

    def beyond(self) -> np.ndarray:
        """Which of the three exceeds its limit, shape (3, ...)."""
        pairs = zip(self, (LIMITS.tilt, LIMITS.travel, LIMITS.reaction), strict=True)
        return np.array([~(np.asarray(value) <= limit) for value, limit in pairs])

    def warnings(self) -> tuple[str, ...]:
        """A sentence for each limit that one equilibrium exceeds."""
        values = (np.degrees(self.tilt), self.travel, self.reaction)
        bounds = (np.degrees(LIMITS.tilt), LIMITS.travel, LIMITS.reaction)
        rows = zip(_SENTENCES, values, bounds, self.beyond(), strict=True)
        return tuple(
            f"the equilibrium {words.format(value=f'{value:.3g}')}; the model means at most "
            f"{bound:.3g}"
            if not np.isinf(value)  # the reaction over a load of zero
            else f"the equilibrium {_UNLOADED}"
            for words, value, bound, beyond in rows
            if beyond
        )


_SENTENCES = (
    "is tilted by {value} degrees",
    "lies {value} times the pad's half length (or a spring's, if shorter) off the initial position",
    "presses with {value} times the load",
)
_UNLOADED = "presses without a load; the model means a pad that its load presses"


LIMITED = Excursion._fields


def _force(statics: Statics, z: np.ndarray, touching: Any) -> Any:
    at, on = pose(np, tuple(statics.place(z))), np.asarray(touching, dtype=float)
    with np.errstate(all="ignore"):  # no place where there is no force
        return statics.model.law.resultant(statics.model.c, at, on)[0]


def excursion(statics: Statics, z: np.ndarray, touching: Any) -> Excursion:
    """The excursion of equilibria z (4,) or (4, n) with a contact state, or factors (points, n).

    Of pads that differ, the parameters of `statics` are arrays (n,).
    """
    pad = statics.model.pad
    shortest = np.minimum(pad.w, np.minimum(pad.L1, pad.L2))
    start = np.zeros_like(z)
    start[3] = z[3]
    put = statics.gaps(start) < 0.0
    load = np.fmax(pad.F_n, np.where(put.any(axis=0), _force(statics, start, put), 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):  # a pad without any load
        return Excursion(
            np.abs(statics.tilt(z)),
            np.hypot(z[0], z[1]) / shortest,
            _force(statics, z, touching) / load,
        )
