"""Onset and attractors of damped motions: sweeps of friction, exponents, a cycle."""

from typing import Annotated, Literal

from squeal.article.records import Missing, Record, Result, Share

TOLERANCE = 1e-10  # of all motions
ROUNDING = 1e-4  # of a multiplier
Sign = Literal["chaotic", "no growth", "undecided"]


class Settled(Record):
    """What a motion has come to after a long time.

    lost: share of the time in which some contact is lost, 0 where contact does not change any more;
    peak: of the first signal over F_n; hammers: by the model's own rule, edges: by that of B1,
    which is for any model: both edges separate, in turn and repeatedly; turns: changes of side of
    delta (model B2), or of the edge that separates (B1); low, high: range of delta/w, None with B1
    and off the surface; face: greatest speed of the lower face while it touches over the speed V of
    the surface, None without V or contact.
    """

    lost: Share
    peak: float
    hammers: bool
    edges: bool
    turns: int
    low: float | None
    high: float | None
    face: float | None

    @property
    def off(self) -> bool:
        """The pad is off the surface all the time."""
        return self.lost == 1.0 and self.peak == 0.0

    @property
    def goes_on(self) -> bool:
        """Contact goes on changing."""
        return self.lost > 0.0 and not self.off

    @property
    def slides(self) -> bool:
        """What rubs stays slower than the surface, as the equations ask."""
        return self.face is None or self.face < 1.0


class Late(Settled):
    """A scene's own start after a long time with modal damping of one ratio.

    growth: greatest real part of the eigenvalues about the equilibrium at the scene's mu in 1/ms,
    None where contact does not go on changing or without an equilibrium.
    """

    ratio: Share
    growth: float | None


class Others(Record):
    """What becomes of other starts of a scene after a long time, and of its own one early, with
    modal damping of one ratio.

    early: of the own start, in spans that end after so many windows, each by itself, None from
    where the model ends; starts: how many; ends: of these leave the model or rub faster than the
    surface; lasting: go on losing contact; hammer, edges: and hammer, by either rule; liveliest: of
    all that go on, the own one among them, the one that hammers, by both rules rather, and has most
    turns; growth: as in `Late`, of every equilibrium.
    """

    ratio: Share
    early: tuple[Settled | None, ...]
    starts: int
    ends: int
    lasting: int
    hammer: int
    edges: int
    liveliest: Settled | None
    growth: float | None

    @property
    def beside(self) -> bool:
        """Contact goes on changing beside a stable equilibrium, the pad slower than the surface."""
        return (
            self.liveliest is not None
            and self.liveliest.slides
            and self.growth is not None
            and self.growth <= 0.0
        )


class Step(Settled):
    """What a motion has come to at a friction mu."""

    mu: float


class Sweep(Record):
    """Friction raised and lowered at one damping ratio; steps at which the model ends are left out.

    up: from the equilibrium of each mu, kicked; down: lowered step by step from the greatest mu up
    to which contact goes on changing on the way up with a pad slower than the surface; beyond: from
    the greatest mu up to which it goes on at all, empty where the pad is slower there. Both begin
    with their step of `up` and end where contact does not change any more. lively: raised and
    lowered from the liveliest motion beside a stable equilibrium at the scene's mu, by rising mu,
    empty where there is none.
    """

    ratio: Share
    up: tuple[Step, ...]
    down: tuple[Step, ...]
    beyond: tuple[Step, ...]
    lively: tuple[Step, ...]

    @property
    def changing(self) -> tuple[Step, ...]:
        """The steps of the way up at which contact goes on changing."""
        return tuple(step for step in self.up if step.goes_on)


class Exponent(Record):
    """Largest Lyapunov exponents in 1/ms of motions from neighbouring starts.

    rates: one of each start, the first is the scene's own; half_widths: of their intervals, each
    from the start's own scatter in time, infinite where that is too short; least: the rate that
    deviations have which grow as the square of time; windows: times that of the scene; ends: a
    motion leaves the model after these, so that exponents do not exist; ratio: of damping.
    """

    ratio: Share
    rates: tuple[float, ...]
    half_widths: tuple[float, ...]
    least: float
    windows: int
    ends: bool

    @property
    def unseen(self) -> list[float]:
        """Of each start that is not seen to be chaotic, the rate up to which that says nothing."""
        judged = zip(self.half_widths, self.signs, strict=True)
        return [self.least + half for half, sign in judged if sign != "chaotic"]

    @property
    def signs(self) -> list[Sign]:
        """Of each start: chaotic where all of the interval is above `least`, no growth where none
        of it is."""
        return [
            "chaotic"
            if rate - half > self.least
            else "no growth"
            if rate + half <= self.least
            else "undecided"
            for rate, half in zip(self.rates, self.half_widths, strict=True)
        ]


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


class Onset(Result):
    """Names are those of motions, as in `squeal.article.studies.energy`.

    late: own starts under both laws, others: a grid of starts on the plane of the maps of starts,
    `wider` times as wide, and `moving` starts in motion where the equilibrium is not unstable,
    drawn by numpy's generator from `seed`; thresholds: of the scenes under their own law, the
    friction at which their equilibria begin to flutter at the damping `ratio`, None if they do not
    at any of `mu`;
    sweeps: of those that flutter at this ratio, of those whose own start goes on losing contact or
    that have a lively motion beside a stable equilibrium at others too; windows: of `late` and
    `others`, longer: where contact goes on changing until then; early: ends of the spans in which
    own starts are looked at first; seen: over which motions are looked at then; step_windows: of
    each step in friction; confidence: of the interval of each exponent; left_out: why there is
    nothing, empty if there is.
    """

    late: dict[str, tuple[Late | Missing, ...]]
    others: dict[str, tuple[Others, ...]]
    mu: tuple[float, ...]
    sweeps: dict[str, tuple[Sweep, ...]]
    thresholds: dict[str, float | None]
    exponents: dict[str, Exponent | Missing]
    cycles: Cycles | Missing
    ratio: Share
    ratios: tuple[float, ...]
    windows: int
    longer: int
    early: tuple[int, ...]
    wider: float
    moving: int
    seed: int
    seen: int
    step_windows: int
    confidence: Annotated[float, ".0%"]
    left_out: str = ""

    @property
    def step(self) -> float:
        """Of mu in the sweeps."""
        return self.mu[1] - self.mu[0]
