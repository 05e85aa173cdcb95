"""What lasts with damping, from the reference and from other initial conditions, and its cycles.

All modes about the frictionless equilibrium get the same damping ratio; the damping matrix that
does so acts at every friction and in every contact state.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
from scipy.optimize import brentq

from squeal.article.cases import HISTORY_FIGURES
from squeal.article.claims.measures import Case, case_of
from squeal.article.claims.motions import LEVELS, measures
from squeal.article.claims.rules import LEVEL, hammers
from squeal.article.identify.ensemble import Arrays, Measure, simulate_damped
from squeal.article.identify.space import states_in_box
from squeal.article.records import Missing, Moved, Record, Result
from squeal.article.studies._heyoka import without_heyoka
from squeal.article.studies._scenes import read_scenes
from squeal.article.studies._spread import disturbed, moved
from squeal.article.studies.energy import under_both_laws
from squeal.equilibrium import sliding_equilibrium
from squeal.equilibrium.damping import damped_model
from squeal.errors import ComputationError
from squeal.io.scene import Damping, Scene
from squeal.linear import CriticalPoint, complex_eigenvalues
from squeal.model.contact import FULL, NONE, STATES
from squeal.model.equations import PadModel
from squeal.queries.cycles import Orbit
from squeal.queries.cycles import cycles as periodic_motions
from squeal.queries.pads.equilibrium import analyse
from squeal.queries.thresholds import critical_friction
from squeal.simulation.cycles import CLOSED_CURVE, Cycle, Shooting
from squeal.simulation.observers import Shares

RATIOS = (0.001, 0.005, 0.01, 0.02)  # damping ratios at which motions are observed
RATIO = 0.005  # the one of them at which cycles are computed
LATE = 40  # observation times after which a motion is observed
LONGER = 150  # after which it is observed again if it goes on
OBSERVED = 2  # observation times over which it is observed then
BOX = 3.0  # half-width of the box of initial conditions, over the static compression
SEED = 0  # of the draws from it
STARTS = 100  # initial conditions drawn from it
STARTS_UNSTABLE = 25  # the first of them, beside an unstable equilibrium, which all motions leave
TOLERANCE = 1e-10
REPEATS = 3  # of motions that forget their start
# least difference of the shares `lost` of motions that do not come to one cycle; on one they differ
# by up to 0.012, since the time in which they are seen begins elsewhere in it
UNLIKE = 0.0125
FEW = 0.25  # share of the initial conditions: where fewer last, the impacts before decide which
CYCLES = ("b2-c-integral", "b1-d", "b2-d-integral")  # motions whose cycles are continued over mu
GREATEST = 0.8  # mu, up to which they are continued
NEAR = 1e-6  # of their size: returns this near are the same
ROUNDING = 1e-4  # of a multiplier
CONTACT = (1e-3, 1e-2, 1e-1, 1.0)  # s/m, of Hunt and Crossley's law
FULL_CONTACT = STATES.index(FULL)  # column of the measured shares of time
Share = Annotated[float, ".1%"]


class Settled(Record):
    """What a motion does after a long time, over `OBSERVED` observation times.

    lost: share of the time in which some edge is separated, 0 where contact does not change;
    airborne: share in which both are; peak: of the contact force over F_n, the sum of both edges;
    leading, trailing: of the force at each edge over F_n, None with B2, whose line has one
    reaction; hammers: by the definition; turns: changes of the edge struck; low, high: range of
    delta/w, None with B1; face: greatest speed of the lower face while it touches over that of the
    surface.
    """

    lost: Share
    airborne: Share
    peak: float
    leading: float | None
    trailing: float | None
    hammers: bool
    turns: int
    low: float | None
    high: float | None
    face: float | None

    @property
    def goes_on(self) -> bool:
        """Contact goes on changing, while what rubs stays slower than the surface."""
        return 0.0 < self.lost < 1.0 and (self.face is None or self.face < 1.0)

    @property
    def liveliness(self) -> tuple[bool, int]:
        """What orders motions: one that hammers before others, then by turns."""
        return self.hammers, self.turns


class After(Record):
    """A motion at one damping ratio.

    own: the motion from the reference initial conditions, None where the model ends; starts: how
    many other initial conditions there are, see `sampled_states`; lasting: how many of them lead to
    a sustained loss of contact; hammering: how many of the lasting motions hammer; ceased: see
    `Late`; unlike: greatest difference of the shares `lost` of the lasting motions; liveliest: of
    all motions that go on the one that hammers, or has most turns; growth: greatest real part of
    the eigenvalues about the equilibrium, 1/ms, None without one.
    """

    ratio: Share
    own: Settled | None
    starts: int
    lasting: int
    hammering: int
    ceased: int
    unlike: float
    liveliest: Settled | None
    growth: float | None


class CyclePoint(Record):
    """A periodic motion: period in ms, contact changes in it, the greatest of the absolute values
    of its Floquet multipliers beside 1.

    peak: of the contact force over F_n, the sum of both edges; leading, trailing: of the force at
    each edge over F_n, None with B2.
    """

    mu: float
    period: float
    changes: int
    peak: float
    leading: float | None
    trailing: float | None
    multiplier: float

    @property
    def stable(self) -> bool:
        """Small deviations decay."""
        return self.multiplier < 1.0 - ROUNDING


class Cycles(Record):
    """A branch of periodic motions, the one that leads to greater mu first, as far as the surface
    stays faster than the lower face.

    own: the one at the case's friction; airborne: share of its period without contact; decay: its
    greatest multiplier, from the decay of a disturbance in a simulation; shift: how far the
    multiplier of a shift in time is from 1; fold: the least friction of the branch; reaches:
    friction at which the lower face becomes as fast as the surface, None if it nowhere does;
    closed: the branch is a closed curve; threshold: friction at which the equilibrium begins to
    flutter at the same damping, None if it does not up to `GREATEST`; sliding: whether it is stable
    at the case's friction; unstable: intervals of mu in which it is not, up to `GREATEST`.
    """

    own: CyclePoint
    airborne: Share
    decay: float
    shift: float
    branch: tuple[CyclePoint, ...]
    fold: float
    reaches: float | None
    closed: bool
    threshold: float | None
    sliding: bool
    unstable: tuple[tuple[float, float], ...]


class ContactDamping(Record):
    """Sliding in case (d) under Hunt and Crossley's law, with no other damping.

    growth: greatest growth rate (1/s) by size of the damping (s/m); threshold: the least friction
    from which sliding flutters, of all sizes; spread: how far the thresholds lie apart.
    """

    growth: dict[str, float]
    threshold: float
    spread: float


class Onset(Result):
    """after: by motion (b1-a, b2-a-mean, b2-a-integral), for each of `ratios`; box, seed: of the
    initial conditions; cycles: by motion; other_damping: by motion and kind of damping, what the
    lively motion comes to; contact_damping: by motion, sliding with damping of the normal force
    alone."""

    after: dict[str, tuple[After, ...]]
    cycles: dict[str, Cycles | Missing]
    other_damping: dict[str, dict[str, Settled | None]]
    contact_damping: dict[str, ContactDamping]
    ratio: Share = RATIO
    ratios: tuple[float, ...] = RATIOS
    windows: int = LATE
    longer: int = LONGER
    seen: int = OBSERVED
    box: float = BOX
    seed: int = SEED
    starts: int = STARTS
    starts_unstable: int = STARTS_UNSTABLE
    repeats: int = REPEATS
    left_out: str = ""


class DampedStart(NamedTuple):
    """A damped pad and the state (6,) that it starts from, in SI units."""

    model: PadModel
    state: np.ndarray


def damped(scene: Scene, ratio: float) -> Scene:
    """The scene with all modal damping ratios alike."""
    return dataclasses.replace(scene, damping=Damping(ratios=(ratio,) * 3) if ratio else None)


def run(
    starts: Sequence[DampedStart], stop: float | np.ndarray, measure: Measure | None = None
) -> Arrays:
    """Motions of one model and formulation, all over one time or each over its own (n,)."""
    states = np.array([motion.state for motion in starts])
    return simulate_damped([motion.model for motion in starts], states, stop, TOLERANCE, measure)


class ForcePeaks(NamedTuple):
    """Greatest contact force over F_n: the sum, and at each edge of B1."""

    total: float
    leading: float | None
    trailing: float | None


def force_peaks(case: Case, line: bool) -> ForcePeaks:
    """Of a measured case of B1, or of B2 (`line`), which has one reaction."""
    if line:
        return ForcePeaks(case.first.high, None, None)
    return ForcePeaks(case.together.high, case.first.high, case.second.high)


def _settled(case: Case, changes: int, full: float, line: bool) -> Settled:
    """A settled motion from its measures.

    changes: how many of contact; full: share of time in full contact; line: the case is one of B2,
    whose contact is a line. Then `case.first` and `case.second` are the ranges of the reaction R_n
    and of its position delta, else those of the forces at the leading and the trailing edge.
    """
    lost = 1.0 - full if changes else 0.0
    airborne = case.shares.get(NONE, 0.0)
    peaks = force_peaks(case, line)
    position = case.second if line else None
    # NaN: there is no contact at all; if one edge alone is separated, its force is 0
    if np.isnan(case.first.high):
        lost = 1.0
        airborne = 1.0
        peaks = ForcePeaks(0.0, None, None)
        position = None
    return Settled(
        lost=lost,
        airborne=airborne,
        peak=peaks.total,
        leading=peaks.leading,
        trailing=peaks.trailing,
        hammers=changes > 0 and hammers(case).margin > 0.0,
        turns=case.blows[LEVELS.index(LEVEL)] if changes else 0,
        low=None if position is None else position.low,
        high=None if position is None else position.high,
        face=None if np.isnan(case.face) else case.face,
    )


class Late(NamedTuple):
    """Motions after some time: states (n, 6), and what each does then, None where it is invalid.

    ceased: how many still changed contact after `LATE` observation times, and after `LONGER` did
    not or were invalid.
    """

    states: np.ndarray
    settled: list[Settled | None]
    ceased: int = 0


def settle(starts: Sequence[DampedStart], before: float, observed: float) -> Late:
    """The motions after a time `before` (s), and what they do in the time `observed` (s) after it.

    The starts have pads of one model and formulation.
    """
    _, second_signal = starts[0].model.law.plotted
    is_line = not second_signal.is_force  # on the line it is delta
    first = run(starts, before)
    ends = first["final"]
    valid = np.flatnonzero(first["valid"]).tolist()  # indices of motions that reach this time
    settled: list[Settled | None] = [None] * len(starts)
    if not valid:
        return Late(ends, settled)
    late = run([DampedStart(starts[i].model, ends[i]) for i in valid], observed, measures)
    for row, i in enumerate(valid):  # a row of `late` for each valid motion
        if late["valid"][row]:
            case = case_of(late, row, starts[i].model.pad.V)
            full = float(late["shares"][row, FULL_CONTACT])
            settled[i] = _settled(case, int(late["changes"][row]), full, is_line)
    return Late(ends, settled)


def settle_late(starts: Sequence[DampedStart], window: float) -> Late:
    """What motions do after `LATE` observation times of `window` s each.

    Those that still change contact then are simulated on, and observed again after `LONGER`.
    """
    states, settled, _ = settle(starts, LATE * window, OBSERVED * window)
    going_on = [i for i, motion in enumerate(settled) if motion and motion.goes_on]
    if not going_on:
        return Late(states, settled)
    again = [DampedStart(starts[i].model, states[i]) for i in going_on]
    later = settle(again, (LONGER - LATE) * window, OBSERVED * window)
    ceased = 0
    for i, state, motion in zip(going_on, later.states, later.settled, strict=True):
        states[i] = state
        settled[i] = motion
        if motion is None or not motion.goes_on:
            ceased += 1
    return Late(states, settled, ceased)


def sampled_states(scene: Scene, half_width: float, count: int) -> np.ndarray:
    """Initial states (count, 6) drawn uniformly from a box about the sliding equilibrium.

    See `states_in_box`. The draws of all boxes are alike but for their scale. There is no state
    (0, 6) where there is no equilibrium.
    """
    equilibrium, _ = sliding_equilibrium(scene.pad_model)
    if equilibrium is None:
        return np.empty((0, 6))
    draws = np.random.default_rng(SEED).uniform(-1.0, 1.0, (STARTS, 6))[:count]
    return states_in_box(scene.pad, np.array(equilibrium.q), half_width, draws)


def growth(scene: Scene, ratio: float) -> float | None:
    """Greatest real part of the eigenvalues about the equilibrium, 1/ms; None without one."""
    try:
        return analyse(damped(scene, ratio)).spectrum.dominant.value.real / 1e3
    except ComputationError:
        return None


def slides_stably(scene: Scene, ratio: float) -> bool:
    """Whether there is a sliding equilibrium about which no mode grows at a damping ratio."""
    growth_rate = growth(scene, ratio)
    return growth_rate is not None and growth_rate <= 0.0


class AfterAndState(NamedTuple):
    """What a scene comes to, and the state (6,) of its liveliest motion, NaN where none goes on."""

    row: After
    state: np.ndarray


def after(scene: Scene, ratio: float, repeat: int = 0) -> AfterAndState:
    """What a scene comes to at one damping ratio.

    A `repeat` starts from initial conditions that differ by rounding, see `disturbed`.
    """
    assert scene.stop is not None
    model = damped_model(damped(scene, ratio))
    growth_rate = growth(scene, ratio)
    unstable = growth_rate is not None and growth_rate > 0.0
    sampled = sampled_states(scene, BOX, STARTS_UNSTABLE if unstable else STARTS)
    # the motion from the reference initial conditions comes first
    states = disturbed(np.array([scene.initial, *sampled]), repeat)
    late = settle_late([DampedStart(model, state) for state in states], scene.stop)
    reference, *others = late.settled
    lasting = [motion for motion in others if motion and motion.goes_on]
    # the liveliest of all motions, the reference one included
    liveliest: Settled | None = None
    state_of_liveliest = np.full(6, np.nan)
    for motion, state in zip(late.settled, late.states, strict=True):
        if motion is None or not motion.goes_on:
            continue
        if liveliest is None or motion.liveliness > liveliest.liveliness:
            liveliest = motion
            state_of_liveliest = state
    row = After(
        ratio=ratio,
        own=reference,
        starts=len(sampled),
        lasting=len(lasting),
        hammering=sum(motion.hammers for motion in lasting),
        ceased=late.ceased,
        unlike=float(np.ptp([motion.lost for motion in lasting])) if lasting else 0.0,
        liveliest=liveliest,
        growth=growth_rate,
    )
    return AfterAndState(row, state_of_liveliest)


def repeats(scene: Scene, ratio: float, row: After) -> list[After]:
    """The row, and where its motions forget their start, `REPEATS` more from other rounding.

    They do where they last without coming to one cycle (`UNLIKE`), go on for long before they cease
    (`After.ceased`), or last from a few initial conditions alone (`FEW`); what is counted of them
    then moves.
    """
    few = 0 < row.lasting < FEW * row.starts
    if row.unlike <= UNLIKE and not row.ceased and not few:
        return [row]
    return [row, *(after(scene, ratio, repeat).row for repeat in range(1, REPEATS + 1))]


def _points(scene: Scene, orbits: Sequence[Orbit]) -> list[CyclePoint]:
    """The cycles of a damped scene, their forces measured over two periods each."""
    starts = []
    for orbit in orbits:
        model = damped_model(scene.replace(mu=orbit.value))
        starts.append(DampedStart(model, np.array(orbit.start)))
    periods = np.array([orbit.period for orbit in orbits])
    measured = run(starts, 2.0 * periods, measures)
    points = []
    for i, orbit in enumerate(orbits):
        peaks = force_peaks(case_of(measured, i), scene.model == "B2")
        points.append(
            CyclePoint.of(
                peaks,  # gives `leading` and `trailing`
                mu=orbit.value,
                period=1e3 * orbit.period,  # ms
                changes=len(orbit.contacts),
                peak=peaks.total,
                multiplier=orbit.multiplier,
            )
        )
    return points


def airborne(pad: Shooting, cycle: Cycle) -> float:
    """Share of a cycle's period in which no edge touches."""
    model = pad.model(cycle.value)
    shares = Shares(model, cycle.period)
    shares.observe(cycle.segment)
    return shares.result()[model.state_name(NONE)]


def decay(pad: Shooting, cycle: Cycle) -> float:
    """The greatest multiplier of a stable cycle, from the decay of a small disturbance.

    A simulation over 24 periods gives the deviation from the cycle after each one. Least squares
    fit the linear map (6, 6) from one deviation to the next. Of its eigenvalues, the Floquet
    multipliers, that of a shift in time (the nearest to 1) is left out.
    """
    random = np.random.default_rng(0).normal(size=6)
    # 1e-6: small enough for a linear map, and far above the rounding of the simulation
    state = cycle.state + 1e-6 * np.abs(cycle.state).max() * random
    deviations = [state - cycle.state]
    for _ in range(24):
        state = pad.motion(state, cycle.period, cycle.value).end[:, 0]
        deviations.append(state - cycle.state)
    to_next, *_ = np.linalg.lstsq(deviations[:-1], deviations[1:])
    multipliers = np.linalg.eigvals(to_next)
    of_shift = np.argmin(np.abs(multipliers - 1.0))
    return float(np.abs(np.delete(multipliers, of_shift)).max())


def cycles(scene: Scene, state: np.ndarray) -> Cycles | Missing:
    """The periodic motion that a motion has settled to, continued to lesser and greater mu.

    state (6,), SI units: of the motion after it has settled. Missing where it is not periodic.
    """
    assert scene.stop is not None
    with_damping = damped(scene, RATIO)
    settled = dataclasses.replace(
        with_damping,
        initial=tuple(state.tolist()),
        stop=OBSERVED * scene.stop,
        start="origin",  # `initial` counts from the origin, as `state` does
    )
    try:
        # since it has settled already, it must repeat itself within one time `stop`
        answer = periodic_motions(settled, ("mu", 0.0, GREATEST), windows=1)
        if answer.source is None:
            return Missing(answer.reason)
        shooting, cycle = answer.source
        multiplier = decay(shooting, cycle)
    except ComputationError as error:
        return Missing(str(error))
    thresholds = critical_friction(with_damping, GREATEST).points
    valid = _valid_part(answer.orbits, answer.own)
    orbit_at_scene = answer.orbits[answer.own]
    # the cycle at the scene's friction, then the whole branch through it, from the end that is
    # reached by first raising mu to the one by first lowering it (past a fold mu rises again)
    own, *branch = _points(with_damping, [orbit_at_scene, *reversed(valid.orbits)])
    return Cycles(
        own=own,
        airborne=airborne(shooting, cycle),
        decay=multiplier,
        shift=float(abs(cycle.trivial - 1.0)),  # `trivial`: the multiplier of a shift in time
        branch=tuple(branch),
        fold=min(orbit.value for orbit in valid.orbits),
        reaches=valid.reaches,
        closed=CLOSED_CURVE in answer.ends,
        threshold=next((point.mu for point in thresholds if point.kind == "flutter"), None),
        sliding=slides_stably(scene, RATIO),
        unstable=_unstable(thresholds),
    )


class ValidPart(NamedTuple):
    """The part of a branch of cycles in which the surface is faster than the lower face, and the
    friction at which the face becomes as fast, None where it does not."""

    orbits: list[Orbit]
    reaches: float | None


def _valid_part(orbits: Sequence[Orbit], own: int) -> ValidPart:
    """The part of a branch of cycles in which the surface is faster than the lower face.

    It extends from the cycle with the index `own` to both sides. It ends before a cycle whose face
    is as fast as the surface, or where the branch ends. `reaches` is the friction at which the face
    becomes as fast, at the end with the greater index if there are two; None if the part is the
    whole branch.
    """
    reaches = None
    begin = own
    while begin > 0 and _face_over_surface_speed(orbits[begin - 1]) < 1.0:
        begin -= 1
    if begin > 0:
        reaches = _friction_at_surface_speed(orbits[begin], orbits[begin - 1])
    end = own
    while end < len(orbits) - 1 and _face_over_surface_speed(orbits[end + 1]) < 1.0:
        end += 1
    if end < len(orbits) - 1:
        reaches = _friction_at_surface_speed(orbits[end], orbits[end + 1])
    return ValidPart(list(orbits[begin : end + 1]), reaches)


def _face_over_surface_speed(orbit: Orbit) -> float:
    """Greatest speed of the lower face while it touches, over that of the surface."""
    return orbit.face or 0.0


def _friction_at_surface_speed(slower: Orbit, faster: Orbit) -> float:
    """Where the face becomes as fast as the surface between two cycles, by linear interpolation."""
    slow = _face_over_surface_speed(slower)
    share = (1.0 - slow) / (_face_over_surface_speed(faster) - slow)
    return slower.value + share * (faster.value - slower.value)


def _unstable(thresholds: Sequence[CriticalPoint]) -> tuple[tuple[float, float], ...]:
    """Intervals of friction in which a mode about the equilibrium grows, up to `GREATEST`."""
    intervals: list[tuple[float, float]] = []
    since: float | None = None
    for point in thresholds:
        if point.kind in ("flutter", "divergence"):
            if since is None:
                since = point.mu
        elif since is not None:
            intervals.append((since, point.mu))
            since = None
    if since is not None:
        intervals.append((since, GREATEST))
    return tuple(intervals)


def other_damping(scene: Scene, state: np.ndarray) -> dict[str, Settled | None]:
    """What a motion comes to where damping grows with the mass or with the stiffness instead.

    A mode of frequency omega has the damping ratio alpha/(2 omega) + beta omega/2 (Rayleigh). Each
    factor alone gives `RATIO` at omega = (k1/m)^(1/2). state (6,): the first state of the motion.
    """
    assert scene.stop is not None
    omega = np.sqrt(scene.pad.k1 / scene.pad.m)
    kinds = {"mass": (2 * RATIO * omega, 0.0), "stiffness": (0.0, 2 * RATIO / omega)}  # alpha, beta
    by_kind = {}
    for name, factors in kinds.items():
        model = damped_model(dataclasses.replace(scene, damping=Damping(rayleigh=factors)))
        later = settle([DampedStart(model, state)], LONGER * scene.stop, OBSERVED * scene.stop)
        by_kind[name] = later.settled[0]  # of the only motion
    return by_kind


def contact_growth(scene: Scene, a: float) -> float:
    """Greatest growth rate (1/s) about sliding where each contact point bears k p (1 + a p').

    p is its penetration, and p' = -g' v for the velocity v of (x, y, theta), where g' is the row of
    derivatives of the gap. The normal force of a point changes by a k p p' = -a k p g' v, so that
    the damping matrix about the equilibrium is the sum over the points of

        a k p (load of a unit normal force) g'

    B1 has two points, the edges; the line of B2 is integrated by Gauss points along the face. A
    point of B1 has p = 0 in the undisplaced pose, a point of B2 where it meets the surface.
    """
    equilibrium = analyse(scene)
    pad = scene.pad
    _, y, theta = equilibrium.q
    cosine = np.cos(pad.theta0 + theta)
    sine = np.sin(pad.theta0 + theta)
    # points: from -1, the leading edge, to 1; k: the stiffness of each; relaxed_drop: the value of
    # its `drop`, see below, at which p = 0 if y = 0
    if scene.model == "B2":
        points, weights = np.polynomial.legendre.leggauss(8)
        k = (pad.k_c or 0.0) * weights / 2
        relaxed_drop = pad.h + (pad.y0 or 0.0)
    else:
        points = np.array([-1.0, 1.0])
        k = np.array([pad.k3, pad.k4])
        relaxed_drop = pad.h * np.cos(pad.theta0) - pad.w * np.sin(pad.theta0) * points
    # of the points from the mass centre: along the surface, and down
    side = pad.w * cosine * points + pad.h * sine
    drop = pad.h * cosine - pad.w * sine * points
    p = np.maximum(drop - relaxed_drop - y, 0.0)
    arm = pad.h if scene.model == "B2" else drop  # of friction, as Eqs. (6) and (10) have it
    ones = np.ones(len(points))
    # F_x, F_y and moment of a unit normal force with its friction
    loads = np.array([pad.mu * ones, ones, side + pad.mu * arm])
    gap_derivatives = np.array([0.0 * ones, ones, side])  # by x, y and theta
    C = a * (loads * k * p) @ gap_derivatives.T
    spectrum = complex_eigenvalues(equilibrium.matrices.M, C, equilibrium.matrices.K)
    return spectrum.dominant.growth_rate


def contact_damping(scene: Scene) -> ContactDamping:
    """Of a scene of case (d)."""

    def threshold(a: float) -> float:
        return float(brentq(lambda mu: contact_growth(scene.replace(mu=mu), a), 0.05, scene.pad.mu))

    growths = {str(a): contact_growth(scene, a) for a in CONTACT}
    thresholds = [threshold(a) for a in CONTACT]
    return ContactDamping(growths, min(thresholds), max(thresholds) - min(thresholds))


def study(files: Sequence[Path]) -> Onset:
    """What lasts of the eight scenes of models B1 and B2, line contact under both laws."""
    scenes = read_scenes(files, HISTORY_FIGURES)
    if why := without_heyoka("nothing else simulates ensembles."):
        return Onset(after={}, cycles={}, other_damping={}, contact_damping={}, left_out=why)
    motions = under_both_laws(scenes)
    rows: dict[str, list[After]] = {}
    states: dict[str, np.ndarray] = {}  # of the liveliest motions at `RATIO`
    spread: list[Moved] = []
    for name, scene in motions.items():
        rows[name] = []
        for i, ratio in enumerate(RATIOS):
            row, state = after(scene, ratio)
            rows[name].append(row)
            spread += moved(f"after.{name}.{i}", repeats(scene, ratio, row))
            if ratio == RATIO:
                states[name] = state
    lasting = [name for name in CYCLES if np.isfinite(states[name]).all()]
    cycles_of: dict[str, Cycles | Missing] = {}
    for name in CYCLES:
        cycles_of[name] = Missing("no motion goes on losing contact")
        if name in lasting:
            cycles_of[name] = cycles(motions[name], states[name])
    return Onset(
        after={name: tuple(of_motion) for name, of_motion in rows.items()},
        cycles=cycles_of,
        other_damping={name: other_damping(motions[name], states[name]) for name in lasting},
        # of the cycles of case (d)
        contact_damping={name: contact_damping(motions[name]) for name in CYCLES[1:]},
        spread=tuple(spread),
    )


def sentences(record: Onset) -> Mapping[str, bool]:
    """What the paper says of what lasts, and whether it holds."""
    if record.left_out:
        return {}
    cycles_of = {name: c for name, c in record.cycles.items() if isinstance(c, Cycles)}
    points_d = cycles_of.get("b1-d")
    line_d = cycles_of.get("b2-d-integral")
    line_c = cycles_of.get("b2-c-integral")
    case_d = ("b1-d", "b2-d-integral")

    def lasts(name: str) -> list[float]:
        """The damping ratios at which some motion goes on losing contact."""
        rows = record.after[name]
        return [row.ratio for row in rows if row.lasting or (row.own and row.own.goes_on)]

    def hammering(name: str) -> list[float]:
        """The damping ratios at which the reference motion hammers."""
        return [row.ratio for row in record.after[name] if row.own and row.own.hammers]

    def comes_to_rest(name: str) -> bool:
        """Whether the reference motion comes to rest at every damping ratio."""
        return not any(row.own and row.own.goes_on for row in record.after[name])

    consistent = [name for name in record.after if not name.endswith("mean")]
    resting = [name for name in consistent if comes_to_rest(name)]
    at_ratio = {}  # the row of each motion of case (d) at `RATIO`
    for name in case_d:
        for row in record.after[name]:
            if row.ratio == RATIO:
                at_ratio[name] = row
    lively_hammering = [
        name for name, row in at_ratio.items() if row.liveliest and row.liveliest.hammers
    ]

    def survives_other_damping(name: str) -> bool:
        """Whether the liveliest motion goes on with each other kind; not so where none lasts."""
        settled = record.other_damping.get(name, {}).values()
        return bool(settled) and all(m is not None and m.goes_on for m in settled)

    return {
        "d-cycles-beside-stable-sliding": all(
            c is not None and c.sliding and c.own.stable for c in (points_d, line_d)
        ),
        "b2-c-cycle-is-stable": line_c is not None and line_c.own.stable,
        "b2-d-cycle-begins-below-its-threshold": line_d is not None
        and line_d.threshold is not None
        and line_d.fold < 0.5 * line_d.threshold,
        "b1-d-never-flutters": points_d is not None and points_d.threshold is None,
        "multipliers-agree-with-decay": all(
            abs(c.decay - c.own.multiplier) < 1e-4 for c in cycles_of.values()
        ),
        "b2-c-cycle-grows-until-its-face-is-as-fast-as-the-surface": line_c is not None
        and line_c.reaches is not None
        and all(point.stable for point in line_c.branch if point.changes),
        "b2-d-cycles-form-a-closed-curve": line_d is not None and line_d.closed,
        "d-cycles-stay-slower-than-the-surface": all(
            c is not None and c.reaches is None for c in (points_d, line_d)
        ),
        "b2-c-goes-on-at-every-damping": lasts("b2-c-integral") == list(RATIOS),
        "all-others-come-to-rest": len(resting) == 7 and "b2-c-integral" not in resting,
        "c-hammers-at-high-damping-alone": hammering("b2-c-integral") == [0.01, 0.02],
        "d-goes-on-beside-stable-sliding": all(
            row.lasting > 0 and row.growth is not None and row.growth < 0.0
            for row in at_ratio.values()
        ),
        "d-comes-to-rest-with-the-printed-law": max(lasts("b2-d-mean"), default=0.0) < RATIO,
        "d-hammers-on-points-alone": lively_hammering == ["b1-d"],
        "d-flutters-with-damping-of-the-normal-force": all(
            min(by_size.growth.values()) > 0.0 for by_size in record.contact_damping.values()
        ),
        "thresholds-hardly-depend-on-damping-of-the-normal-force": all(
            by_size.spread < 1e-2 * by_size.threshold for by_size in record.contact_damping.values()
        ),
        "d-survives-other-damping": all(map(survives_other_damping, case_d)),
    }
