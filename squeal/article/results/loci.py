"""Eigenvalues over friction, the friction loop and mode shapes of scenes."""

import numpy as np

from squeal.article.results.records import Missing, Record, Result

Row = tuple[float, ...]


ROUNDING = 1e-9  # of the greatest imaginary part: real parts below are none


class ContactChange(Record):
    """A change of contact along the branch: where, and into which state."""

    mu: float
    into: str


class Threshold(Record):
    """A change of verdict on the way up in mu, see `squeal.linear.CriticalPoint`."""

    mu: float
    kind: str
    frequency_hz: float
    interval: tuple[float, float]
    converged: bool


class Branch(Record):
    """Tracked eigenvalues along the equilibrium branch, and what happens on it.

    real, imag (1/s, rad/s): six rows over `mu`; rows 2k and 2k + 1 are a mode and its conjugate,
    by rising frequency at mu = 0. end: why the branch ends; fold: its mu, None if there is none.
    """

    mu: Row
    real: tuple[Row, ...]
    imag: tuple[Row, ...]
    contact_changes: tuple[ContactChange, ...]
    fold: float | None
    end: str
    verdict_at_zero: str
    thresholds: tuple[Threshold, ...]


class HeldThreshold(Record):
    """Where a pair (flutter) or real root (divergence) starts (up) or ceases (down) to grow."""

    mu: float
    kind: str
    direction: str


class Loop(Record):
    """Whether friction closes a single loop about the held equilibrium (rank one), and why not.

    thresholds: crossings of the imaginary axis by the eigenvalues at mu > 0.
    """

    rank_one: bool
    reason: str
    thresholds: tuple[HeldThreshold, ...]


class SingleLoop(Loop):
    """The pad as one control loop, by python-control.

    loop_thresholds: the loop's own; critical_friction: the first at which it starts to grow, its
    gain margin; grows_from_zero: what grows already at mu = 0, so that there is no margin; apart:
    the largest difference from the thresholds (None if they do not match); real, imag (gains x
    poles): the root locus; locus_apart: its largest distance from the eigenvalues, over the
    spectral radius.
    """

    loop_thresholds: tuple[HeldThreshold, ...]
    critical_friction: float | None
    grows_from_zero: str | None
    apart: float | None
    gains: Row
    real: tuple[Row, ...]
    imag: tuple[Row, ...]
    locus_apart: float


class ModeShape(Record):
    """Shape (x, y, w theta), its largest part 1, of one pair of eigenvalues."""

    frequency_hz: float
    growth_rate: float
    real: Row
    imag: Row


class Modes(Record):
    """The scene's equilibrium: its eigenvalues (1/s, rad/s) and mode shapes.

    q: displacement (m, m, rad); pose: mass centre over the surface's origin (m) and rotation; how:
    how the equilibrium was chosen; on_branch: whether it lies on the branch from mu = 0.
    """

    on_branch: bool
    how: str
    contact: str
    verdict: str
    q: Row
    pose: Row
    real: Row
    imag: Row
    modes: tuple[ModeShape, ...]


class SceneLoci(Record):
    """All of one scene; w, h in m. What does not exist without steady sliding has the reason.

    tilt_held: thresholds of the equilibrium with the rotation held as well.
    """

    name: str
    model: str
    mu: float
    w: float
    h: float
    branch: Branch | Missing
    loop: SingleLoop | Loop | Missing
    tilt_held: tuple[HeldThreshold, ...] | Missing
    equilibrium: Modes | Missing

    @property
    def leaves_axis(self) -> bool:
        """Whether some root, on the branch or of the scene, leaves the imaginary axis."""
        return _leaves(self.branch) or _leaves(self.equilibrium)

    @property
    def loop_leaves_axis(self) -> bool:
        """Whether some root of the friction loop does."""
        return _leaves(self.loop)


def _leaves(part: Branch | Loop | Modes | Missing) -> bool:
    if not isinstance(part, Branch | SingleLoop | Modes):
        return False
    real, imag = (np.abs(np.array(values)).max(initial=0.0) for values in (part.real, part.imag))
    return bool(real > ROUNDING * imag)


class Loci(Result):
    """The scenes in the order given.

    mu_max: where branches and loci end; margin_max: up to which thresholds of the held equilibrium
    are sought.
    """

    scenes: tuple[SceneLoci, ...]
    mu_max: float
    margin_max: float

    @property
    def leaving(self) -> tuple[SceneLoci, ...]:
        """Scenes some of whose roots leave the imaginary axis, those of the loop too; or all."""
        return tuple(s for s in self.scenes if s.leaves_axis or s.loop_leaves_axis) or self.scenes
