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
from squeal.article.identify.ensemble import DONE, Arrays, simulate_many, stack
from squeal.article.records import Missing, Moved, Record, Result
from squeal.article.studies._scenes import read_scenes
from squeal.article.studies._spread import disturbed, moved
from squeal.article.studies.energy import under_both_laws
from squeal.article.studies.starts import compression
from squeal.equilibrium import sliding_equilibrium
from squeal.equilibrium.damping import damped_model
from squeal.errors import ComputationError
from squeal.io.provenance import NOT_INSTALLED, WITHOUT_HEYOKA, version
from squeal.io.scene import Damping, Scene
from squeal.linear import complex_eigenvalues
from squeal.model.contact import NONE
from squeal.model.equations import PadModel
from squeal.queries.cycles import Orbit
from squeal.queries.cycles import cycles as periodic_motions
from squeal.queries.pads.equilibrium import analyse
from squeal.queries.thresholds import critical_friction
from squeal.simulation.cycles import CLOSED_CURVE, Cycle, Shooting
from squeal.simulation.observers import Shares

RATIOS = (0.001, 0.005, 0.01, 0.02)
RATIO = 0.005  # of the cycles
# windows until a motion is looked at, again, and for how long
LATE = 40
LONGER = 150
SEEN = 2
BOX = 3.0  # half-width of the box of initial conditions, over the static compression
SEED = 0  # of the draws from it
STARTS = 100  # drawn
STARTS_UNSTABLE = 25  # of these beside an unstable equilibrium, which every start leaves
TOLERANCE = 1e-10
REPEATS = 3  # of motions that forget their start
# least difference of the shares `lost` of motions that do not come to one cycle; on one they differ
# by up to 0.012, since the time in which they are seen begins elsewhere in it
UNLIKE = 0.0125
FEW = 0.25  # share of the initial conditions: where fewer last, the impacts before decide which
CYCLES = ("b2-c-integral", "b1-d", "b2-d-integral")
GREATEST = 0.8  # largest mu on it
NEAR = 1e-6  # of their size: returns this near are the same
ROUNDING = 1e-4  # of a multiplier
CONTACT = (1e-3, 1e-2, 1e-1, 1.0)  # s/m, of Hunt and Crossley's law
Share = Annotated[float, ".1%"]


class Settled(Record):
    """What a motion does after a long time, over `SEEN` windows.

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


class After(Record):
    """A motion at one damping ratio.

    own: from the reference initial conditions, None where the model ends; starts: how many others,
    see `sampled_states`; lasting: of these lose contact on and on, hammering: and hammer; ceased:
    see `Late`; unlike: how far the shares `lost` of those that last lie apart; liveliest: of all
    that go on the one that hammers, or has most turns; growth: greatest real part of the
    eigenvalues about the equilibrium, 1/ms, None without one.
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
    seen: int = SEEN
    box: float = BOX
    seed: int = SEED
    starts: int = STARTS
    starts_unstable: int = STARTS_UNSTABLE
    repeats: int = REPEATS
    left_out: str = ""


class Begun(NamedTuple):
    """A damped pad and the state (6,) that it starts from, in SI units."""

    model: PadModel
    state: np.ndarray


def damped(scene: Scene, ratio: float) -> Scene:
    """The scene with all modal damping ratios alike."""
    return dataclasses.replace(scene, damping=Damping(ratios=(ratio,) * 3) if ratio else None)


def run(begun: Sequence[Begun], stop: float | np.ndarray, measured: bool) -> Arrays:
    """Motions of one model and formulation, all over one time or each over its own (n,)."""
    one = begun[0].model
    C = [np.array(each.model.damping) for each in begun]
    return simulate_many(
        one.name,
        stack([each.model.pad for each in begun]),
        np.array([each.state for each in begun]),
        stop,
        TOLERANCE,
        one.formulation,
        measure=measures if measured else None,
        damping=np.array(C),
    )


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
    off = np.isnan(case.first.high)  # off the surface all the time
    peaks = ForcePeaks(0.0, None, None) if off else force_peaks(case, line)
    return Settled(
        lost=1.0 if off else 1.0 - full if changes else 0.0,
        airborne=1.0 if off else case.shares.get(NONE, 0.0),
        peak=peaks.total,
        leading=peaks.leading,
        trailing=peaks.trailing,
        hammers=changes > 0 and hammers(case).margin > 0.0,
        turns=case.blows[LEVELS.index(LEVEL)] if changes else 0,
        low=case.second.low if line and not off else None,
        high=case.second.high if line and not off else None,
        face=None if np.isnan(case.face) else case.face,
    )


def settle(
    begun: Sequence[Begun], before: float, seen: float
) -> tuple[np.ndarray, list[Settled | None]]:
    """States (n, 6) after a time `before`, and what the motions do for a time `seen` from then on;
    None where the model ends."""
    line = not begun[0].model.law.plotted[1].is_force
    first = run(begun, before, False)
    ends = first["final"]
    there = np.flatnonzero(first["outcome"] == DONE).tolist()
    found: list[Settled | None] = [None] * len(begun)
    if there:
        late = run([Begun(begun[i].model, ends[i]) for i in there], seen, True)
        for k, i in enumerate(there):
            if late["outcome"][k] == DONE:
                case = case_of(late, k, begun[i].model.pad.V)
                full = float(late["shares"][k, 0])
                found[i] = _settled(case, int(late["changes"][k]), full, line)
    return ends, found


class Late(NamedTuple):
    """Motions after a long time: states (n, 6), and what each does then, None where the model ends.

    ceased: how many lost contact on and on after `LATE` observation times and not after `LONGER`.
    """

    states: np.ndarray
    settled: list[Settled | None]
    ceased: int


def settle_late(begun: Sequence[Begun], window: float) -> Late:
    """What motions do after a long time in observation times (`window`).

    A motion that has settled after `LATE` is not simulated on, one that goes on is until `LONGER`.
    """
    ends, found = settle(begun, LATE * window, SEEN * window)
    on = [i for i, one in enumerate(found) if one and one.goes_on]
    ceased = 0
    if on:
        again = [Begun(begun[i].model, ends[i]) for i in on]
        last, later = settle(again, (LONGER - LATE) * window, SEEN * window)
        ceased = sum(not (one and one.goes_on) for one in later)
        for i, end, one in zip(on, last, later, strict=True):
            ends[i] = end
            found[i] = one
    return Late(ends, found, ceased)


def sampled_states(scene: Scene, half_width: float, count: int) -> np.ndarray:
    """Initial states (count, 6) drawn uniformly from a box about the sliding equilibrium.

    The box reaches `half_width` static compressions (`compression`) to both sides in x, in y and,
    as the lift of an edge, in w theta. Velocities reach what a mass on spring 1 has that swings as
    far: the half-width of each displacement times (k1/m)^(1/2). The draws of all boxes are alike
    but for their scale. There is no state (0, 6) where there is no equilibrium.
    """
    rest, _ = sliding_equilibrium(scene.pad_model)
    if rest is None:
        return np.empty((0, 6))
    displacement = half_width * compression(scene) * np.array([1.0, 1.0, 1.0 / scene.pad.w])
    velocity = displacement * np.sqrt(scene.pad.k1 / scene.pad.m)
    drawn = np.random.default_rng(SEED).uniform(-1.0, 1.0, (STARTS, 6))[:count]
    return np.append(rest.q, np.zeros(3)) + np.append(displacement, velocity) * drawn


def growth(scene: Scene, ratio: float) -> float | None:
    """Greatest real part of the eigenvalues about the equilibrium, 1/ms."""
    try:
        return analyse(damped(scene, ratio)).spectrum.dominant.value.real / 1e3
    except ComputationError:
        return None


def after(scene: Scene, ratio: float, repeat: int = 0) -> tuple[After, np.ndarray]:
    """What a scene comes to at one damping ratio, and the state (6,) of its liveliest motion.

    A `repeat` starts from initial conditions that differ by rounding, see `disturbed`.
    """
    assert scene.stop is not None
    model = damped_model(damped(scene, ratio))
    rate = growth(scene, ratio)
    unstable = (rate or 0.0) > 0.0
    sampled = sampled_states(scene, BOX, STARTS_UNSTABLE if unstable else STARTS)
    states = disturbed(np.array([scene.initial, *sampled]), repeat)
    late = settle_late([Begun(model, state) for state in states], scene.stop)
    found = late.settled
    lasting = [i for i, one in enumerate(found) if one and one.goes_on]
    best = max(lasting, key=lambda i: (found[i].hammers, found[i].turns), default=None)  # type: ignore[union-attr]
    others = [one for i in lasting if i and (one := found[i])]
    row = After(
        ratio=ratio,
        own=found[0],
        starts=len(found) - 1,
        lasting=len(others),
        hammering=sum(one.hammers for one in others),
        ceased=late.ceased,
        unlike=float(np.ptp([one.lost for one in others])) if others else 0.0,
        liveliest=None if best is None else found[best],
        growth=rate,
    )
    return row, np.full(6, np.nan) if best is None else late.states[best]


def repeats(scene: Scene, ratio: float, row: After) -> list[After]:
    """The row, and where its motions forget their start, `REPEATS` more from other rounding.

    They do where they last without coming to one cycle, go on long before they cease, or last from
    a few initial conditions alone; what is counted of them then moves.
    """
    few = 0 < row.lasting < FEW * row.starts
    if row.unlike <= UNLIKE and not row.ceased and not few:
        return [row]
    return [row, *(after(scene, ratio, repeat)[0] for repeat in range(1, REPEATS + 1))]


def _points(scene: Scene, orbits: Sequence[Orbit]) -> list[CyclePoint]:
    """The cycles of a damped scene, their forces measured over two periods each."""
    begun = []
    for orbit in orbits:
        model = damped_model(scene.replace(mu=orbit.value))
        begun.append(Begun(model, np.array(orbit.start)))
    periods = np.array([orbit.period for orbit in orbits])
    measured = run(begun, 2.0 * periods, True)
    points = []
    for i, orbit in enumerate(orbits):
        peaks = force_peaks(case_of(measured, i), scene.model == "B2")
        points.append(
            CyclePoint(
                mu=orbit.value,
                period=1e3 * orbit.period,
                changes=len(orbit.contacts),
                peak=peaks.total,
                leading=peaks.leading,
                trailing=peaks.trailing,
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


def decay(pad: Shooting, cycle: Cycle, turns: int = 24) -> float:
    """The greatest multiplier of a stable cycle, from the decay of a small disturbance.

    The linear map from the disturbance of each period to that of the next, by least squares from a
    simulation; without its multiplier 1, of a shift in time.
    """
    random = np.random.default_rng(0).normal(size=6)
    state = cycle.state + 1e-6 * np.abs(cycle.state).max() * random
    off = [state - cycle.state]
    for _ in range(turns):
        state = pad.motion(state, cycle.period, cycle.value).end[:, 0]
        off.append(state - cycle.state)
    values = np.linalg.eigvals(np.linalg.lstsq(off[:-1], off[1:])[0])
    return float(np.abs(np.delete(values, np.argmin(np.abs(values - 1.0)))).max())


def cycles(scene: Scene, state: np.ndarray) -> Cycles | Missing:
    """The periodic motion that a state (SI) has settled to, followed in mu both ways."""
    assert scene.stop is not None
    settled = dataclasses.replace(
        damped(scene, RATIO), initial=tuple(state.tolist()), stop=SEEN * scene.stop, start="origin"
    )
    try:
        found = periodic_motions(settled, ("mu", 0.0, GREATEST), windows=1)
        if found.source is None:
            return Missing(found.reason)
        slower = decay(*found.source)
    except ComputationError as error:
        return Missing(str(error))
    points = critical_friction(damped(scene, RATIO), GREATEST).points
    held, reaches = _held(found.orbits, found.own)
    own, *branch = _points(damped(scene, RATIO), [found.orbits[found.own], *reversed(held)])
    return Cycles(
        own=own,
        airborne=airborne(*found.source),
        decay=slower,
        shift=float(abs(found.source[1].trivial - 1.0)),
        branch=tuple(branch),
        fold=min(one.value for one in held),
        reaches=reaches,
        closed=CLOSED_CURVE in found.ends,
        threshold=next((p.mu for p in points if p.kind == "flutter"), None),
        sliding=(growth(scene, RATIO) or 0.0) <= 0.0,
        unstable=_unstable([(p.mu, p.kind) for p in points]),
    )


def _held(orbits: Sequence[Orbit], own: int) -> tuple[list[Orbit], float | None]:
    """The part of a branch about its own cycle in which the surface is faster than the lower face,
    and the friction at which the face becomes as fast, None where it does not."""
    fast = [i for i, one in enumerate(orbits) if (one.face or 0.0) >= 1.0]
    low = max((i for i in fast if i < own), default=-1)
    high = min((i for i in fast if i > own), default=len(orbits))
    reaches = None
    for i, j in ((low, low + 1), (high, high - 1)):
        if i in fast:
            (slow, mu), (quick, other) = ((orbits[k].face or 0.0, orbits[k].value) for k in (j, i))
            reaches = mu + (1.0 - slow) / (quick - slow) * (other - mu)
    return list(orbits[low + 1 : high]), reaches


def _unstable(points: Sequence[tuple[float, str]]) -> tuple[tuple[float, float], ...]:
    """Intervals in which the equilibrium grows, from where it begins and ceases to."""
    found: list[tuple[float, float]] = []
    since: float | None = None
    for mu, kind in points:
        if kind in ("flutter", "divergence"):
            since = mu if since is None else since
        elif since is not None:
            found.append((since, mu))
            since = None
    return (*found, *([] if since is None else [(since, GREATEST)]))


def other_damping(scene: Scene, state: np.ndarray) -> dict[str, Settled | None]:
    """What a motion comes to where damping grows with the mass or with the stiffness instead.

    The factors give `RATIO` at the frequency of a mass on spring 1.
    """
    assert scene.stop is not None
    rate = np.sqrt(scene.pad.k1 / scene.pad.m)
    kinds = {"mass": (2 * RATIO * rate, 0.0), "stiffness": (0.0, 2 * RATIO / rate)}
    found = {}
    for name, factors in kinds.items():
        model = damped_model(dataclasses.replace(scene, damping=Damping(rayleigh=factors)))
        _, (one,) = settle([Begun(model, state)], LONGER * scene.stop, SEEN * scene.stop)
        found[name] = one
    return found


def contact_growth(scene: Scene, a: float) -> float:
    """Greatest growth rate (1/s) about sliding where each contact point bears k p (1 + a p').

    p is its penetration; the damping matrix about rest is a times the sum over the points of k p,
    the load of a unit force, and the derivative of the gap by the coordinates.
    """
    found = analyse(scene)
    pad = scene.pad
    _, y, theta = found.q
    line = scene.model == "B2"
    points, weights = np.polynomial.legendre.leggauss(8) if line else (np.array([-1.0, 1.0]), 0.0)
    k = (pad.k_c or 0.0) * weights / 2 if line else np.array([pad.k3, pad.k4])
    cosine = np.cos(theta)
    sine = np.sin(theta)
    side = pad.w * cosine * points + pad.h * sine
    drop = pad.h * cosine - pad.w * sine * points
    depth = np.maximum(drop - pad.h - (pad.y0 or 0.0) - y, 0.0)
    arm = pad.h if line else drop  # of friction, as Eqs. (6) and (10) have it
    one = np.ones(len(points))
    loads = np.array([pad.mu * one, one, side + pad.mu * arm])
    C = a * (loads * k * depth) @ np.array([0.0 * one, one, side]).T
    spectrum = complex_eigenvalues(found.matrices.M, C, found.matrices.K)
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
    if version("heyoka") == NOT_INSTALLED:
        why = f"{WITHOUT_HEYOKA} nothing else simulates ensembles."
        return Onset(after={}, cycles={}, other_damping={}, contact_damping={}, left_out=why)
    motions = under_both_laws(scenes)
    rows: dict[str, list[After]] = {}
    states: dict[str, np.ndarray] = {}
    spread: list[Moved] = []
    for name, scene in motions.items():
        for ratio in RATIOS:
            row, state = after(scene, ratio)
            rows.setdefault(name, []).append(row)
            place = len(rows[name]) - 1
            spread += moved(f"after.{name}.{place}", repeats(scene, ratio, row))
            if ratio == RATIO:
                states[name] = state
    lasting = [name for name in CYCLES if np.isfinite(states[name]).all()]
    return Onset(
        after={name: tuple(row) for name, row in rows.items()},
        cycles={
            name: cycles(motions[name], states[name])
            if name in lasting
            else Missing("no motion goes on losing contact")
            for name in CYCLES
        },
        other_damping={name: other_damping(motions[name], states[name]) for name in lasting},
        contact_damping={name: contact_damping(motions[name]) for name in CYCLES[1:]},
        spread=tuple(spread),
    )


def sentences(found: Onset) -> Mapping[str, bool]:
    """What the paper says of what lasts."""
    if found.left_out:
        return {}
    of = {name: one for name, one in found.cycles.items() if isinstance(one, Cycles)}
    d = [of.get("b1-d"), of.get("b2-d-integral")]

    def lasts(name: str) -> list[float]:
        rows = found.after[name]
        return [row.ratio for row in rows if row.lasting or (row.own and row.own.goes_on)]

    def hammering(name: str) -> list[float]:
        return [row.ratio for row in found.after[name] if row.own and row.own.hammers]

    rests = [
        name
        for name, rows in found.after.items()
        if not name.endswith("mean") and not any(row.own and row.own.goes_on for row in rows)
    ]
    beside = [
        row for name in ("b1-d", "b2-d-integral") for row in found.after[name] if row.ratio == RATIO
    ]
    others = [
        one for name in ("b1-d", "b2-d-integral") for one in found.other_damping[name].values()
    ]
    return {
        "d-cycles-beside-stable-sliding": all(
            one is not None and one.sliding and one.own.stable for one in d
        ),
        "b2-c-cycle-is-stable": "b2-c-integral" in of and of["b2-c-integral"].own.stable,
        "b2-d-cycle-begins-below-its-threshold": d[1] is not None
        and d[1].threshold is not None
        and d[1].fold < 0.5 * d[1].threshold,
        "b1-d-never-flutters": d[0] is not None and d[0].threshold is None,
        "multipliers-agree-with-decay": all(
            abs(one.decay - one.own.multiplier) < 1e-4 for one in of.values()
        ),
        "b2-c-cycle-grows-until-its-face-is-as-fast-as-the-surface": "b2-c-integral" in of
        and of["b2-c-integral"].reaches is not None
        and all(point.stable for point in of["b2-c-integral"].branch if point.changes),
        "b2-d-cycles-form-a-closed-curve": d[1] is not None and d[1].closed,
        "d-cycles-stay-slower-than-the-surface": all(
            one is not None and one.reaches is None for one in d
        ),
        "b2-c-goes-on-at-every-damping": lasts("b2-c-integral") == list(RATIOS),
        "all-others-come-to-rest": len(rests) == 7 and "b2-c-integral" not in rests,
        "c-hammers-at-high-damping-alone": hammering("b2-c-integral") == [0.01, 0.02],
        "d-goes-on-beside-stable-sliding": all(
            row.lasting > 0 and row.growth is not None and row.growth < 0.0 for row in beside
        ),
        "d-comes-to-rest-with-the-printed-law": max(lasts("b2-d-mean")) < RATIO,
        "d-hammers-on-points-alone": [
            bool(row.liveliest and row.liveliest.hammers) for row in beside
        ]
        == [True, False],
        "d-flutters-with-damping-of-the-normal-force": all(
            growth > 0.0 for one in found.contact_damping.values() for growth in one.growth.values()
        ),
        "thresholds-hardly-depend-on-damping-of-the-normal-force": all(
            one.spread < 1e-2 * one.threshold for one in found.contact_damping.values()
        ),
        "d-survives-other-damping": all(one is not None and one.goes_on for one in others),
    }
