"""Onset and attractors of damped motions: sweeps of friction, exponents, a cycle."""

from __future__ import annotations

from typing import Literal

from squeal.article.results.map_ranges import Share
from squeal.files.records import Missing, Record, Result

ROUNDING = 1e-4  # of a multiplier
Sign = Literal["chaotic", "no growth", "finite-time", "ends"]


class Late(Record):
    """A scene's own start after a long time with modal damping of one ratio.

    lost: share of the time in which some contact is lost, 0 where contact does not change any more;
    peak: of the first signal over F_n.
    """

    ratio: Share
    lost: Share
    peak: float

    @property
    def off(self) -> bool:
        """The pad is off the surface all the time."""
        return self.lost == 1.0 and self.peak == 0.0


class Way(Record):
    """Friction raised or lowered in steps; lost, peak: as in `Late`, None where the model ends."""

    mu: tuple[float, ...]
    lost: tuple[float | None, ...]
    peak: tuple[float | None, ...]

    @property
    def changing(self) -> tuple[float, ...]:
        """The values of mu at which contact goes on changing."""
        return tuple(mu for mu, lost in zip(self.mu, self.lost, strict=True) if lost)


class Sweep(Record):
    """Friction raised and lowered at one damping ratio; the motion goes on from step to step.

    up: from the equilibrium, with a small kick at each step; down: from what the scene's own start
    has settled to at the scene's mu.
    """

    ratio: Share
    up: Way
    down: Way


class Lasting(Record):
    """Where changes of contact last for many times of the scene more, near the ends of a sweep.

    begins: the least such mu on the way up, ends: on the way down, of the four nearest to the end;
    None where at none of these.
    """

    begins: float | None
    ends: float | None


class Exponent(Record):
    """Largest Lyapunov exponent in 1/ms with the half width of its 95 % interval.

    sign: ends where the motion leaves the model after `windows` times the scene's time, so that
    the rate is one of that time and an exponent does not exist; chaotic where all of the interval
    is above `least`, what deviations that grow in proportion to time would give; finite-time where
    the rate is above it and has not settled, so that it is no exponent; else no growth is shown.
    ratio: of damping; early, variational: logarithms of the growth over the first of the times of
    the scene, by neighbours and by the variational equations, None where not compared.
    """

    ratio: Share
    rate: float
    half_width: float
    least: float
    sign: Sign
    windows: int
    early: float | None = None
    variational: float | None = None


class CyclePoint(Record):
    """A periodic motion: period in ms, contact changes in it, the first signal's peak over F_n, the
    greatest of the absolute values of its Floquet multipliers beside 1."""

    mu: float
    period: float
    changes: int
    peak: float
    multiplier: float

    @property
    def stable(self) -> bool:
        """Small deviations decay, by more than errors of the multipliers."""
        return self.multiplier < 1.0 - ROUNDING


class Cycles(Record):
    """A branch of periodic motions.

    own: the one at the scene's friction; decay: its greatest multiplier, from the decay of a
    disturbance in a simulation; shift: how far the multiplier of a shift in time is from 1;
    branch: along it, from the greatest mu followed to its end, or to where contact does not change
    any more and the motion is the linear one of the onset.
    """

    name: str
    ratio: Share
    own: CyclePoint
    decay: float
    shift: float
    branch: tuple[CyclePoint, ...]


class Section(Record):
    """Height (in static compressions of the contact) and its rate (m/s) whenever the leading edge
    separates."""

    height: tuple[float, ...]
    rate: tuple[float, ...]


class Onset(Result):
    """late: by name of the motion (as in `squeal.article.results.energy`); sweeps and sections: of
    those whose contact still changes at the damping `ratio`, lasting: at that ratio; thresholds: at
    which their equilibria begin to flutter at that ratio, None if they do not; step: of mu;
    windows: of `late`; early: over which growth is compared by two methods; left_out: why there is
    nothing, empty if there is."""

    late: dict[str, tuple[Late | Missing, ...]]
    step: float
    sweeps: dict[str, tuple[Sweep, ...]]
    lasting: dict[str, Lasting]
    thresholds: dict[str, float | None]
    sections: dict[str, Section]
    exponents: dict[str, Exponent | Missing]
    cycles: Cycles | Missing
    ratio: Share
    windows: int
    early: int
    left_out: str = ""
