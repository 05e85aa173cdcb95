"""Where a motion that loses contact exists beside stable sliding, in case (d) with two dampings.

The two dampings are contact damping, by the law of Hunt and Crossley, and modal damping.
`_coexistence` computes the boundaries of cycles and the least disturbances beforehand and stores
them. Here every stored cycle is integrated again, and some of the least disturbances.
"""

import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from squeal.article.records import Record, Result, read_json
from squeal.article.studies._coexistence import (
    A_OVER_FRICTION,
    A_RANGE,
    ENERGY_A,
    MOTIONS,
    MU_RANGE,
    ZETA_RANGE,
    BoundaryCurve,
    BoundaryPoint,
    Kind,
    LeastDisturbance,
    Stored,
    scene_of,
)
from squeal.article.studies._damped_contact import DampedContact
from squeal.article.studies._damped_cycles import PERIOD, Cycle, Cycles
from squeal.article.studies._heyoka import without_heyoka
from squeal.article.studies._least_disturbance import Norm, lasts
from squeal.article.studies._scenes import read_scenes
from squeal.io.scene import Scene

SAMPLES = 25  # of the stability boundary over contact damping
FRICTIONS = 49  # and over friction
STABLE_AT = 1e-6  # a modal damping ratio as good as none
PARTS = 40  # of a period, for the extremes of a cycle
# least disturbances that are simulated again, of each motion
REPEATED = 6
SEED = 0
SHORTER = 0.9  # of a least disturbance, which leads back to sliding
QUOTED_ZETA = 0.005  # at which margins are quoted


class Point(Record):
    """A point of a boundary: contact damping (s/m), friction, modal damping ratio."""

    a: float
    mu: float
    zeta: float


class Boundary(Record):
    """A boundary of cycles; see `BoundaryCurve`.

    period: from the least to the greatest along it, ms; face: greatest speed of the lower face
    while it touches over that of the surface; factor: least 1 + a p' where the face touches.
    """

    contacts: str
    ends_loss: bool
    kind: Kind
    over: str
    points: tuple[Point, ...]
    period: tuple[float, float]
    face: float
    factor: float


class Margin(Record):
    """The least disturbance found at two dampings.

    compressions: over the static compression, None where no motion lasts; spread: of the searches,
    relative to the least; micrometres: of x, y and w theta together; share: of the motions from the
    box that last.
    """

    a: float
    zeta: float
    compressions: float | None
    spread: float
    micrometres: float | None
    share: float


class Motion(Record):
    """Case (d) of one model and contact law.

    compression: the static one, micrometres; sliding: modal damping from which sliding is stable,
    over contact damping; over_friction: the same over friction, at `a_over_friction`; closes: the
    contact damping at which a fold meets the stability boundary, None where none does in the plane;
    highest: the greatest modal damping at which a stable cycle exists at the least contact damping;
    quoted: the margin at `a_over_friction` and `quoted_zeta`; least, greatest: of all margins,
    micrometres; energies: square roots of least energies of a disturbance over the static one, at
    `energy_a`.
    """

    compression: float
    sliding: tuple[Point, ...]
    over_friction: tuple[Point, ...]
    boundaries: tuple[Boundary, ...]
    closes: float | None
    highest: float
    quoted: Margin
    least: float
    greatest: float
    margins: tuple[Margin, ...]
    energies: tuple[Margin, ...]

    def margin(self, a: float, zeta: float) -> Margin | None:
        """The least displacement at two dampings, None where it was not searched."""
        return next((m for m in self.margins if (m.a, m.zeta) == (a, zeta)), None)


class Checked(Record):
    """How far the stored cycles are from what they claim.

    cycles: how many there are; closure: greatest distance of the ends of a period, static
    compressions; critical: greatest distance from the unit circle of the multiplier that is
    critical; repeated: how many least disturbances were simulated again; held: how many of them
    lead to a lasting loss of contact while `SHORTER` times them leads back to sliding.
    """

    cycles: int
    closure: float
    critical: float
    repeated: int
    held: int


class Coexistence(Result):
    """The motions by name (b1-d, b2-d-integral, b2-d-mean), and the check of what was stored.

    searches_differ: the greatest spread of searches for a least disturbance, relative to the least,
    of the cycles that the figure gives numbers for.
    """

    motions: dict[str, Motion]
    checked: Checked | None
    searches_differ: float
    a_range: tuple[float, float] = A_RANGE
    zeta_range: tuple[float, float] = ZETA_RANGE
    mu_range: tuple[float, float] = MU_RANGE
    a_over_friction: float = A_OVER_FRICTION
    energy_a: float = ENERGY_A
    quoted_zeta: float = QUOTED_ZETA
    left_out: str = ""


def critical_zeta(scene: Scene, a: float, mu: float) -> float:
    """The modal damping ratio at which sliding becomes stable, 0 where it needs none."""

    def growth(log_zeta: float) -> float:
        return DampedContact(scene, a, float(np.exp(log_zeta)), mu).growth

    low = np.log(STABLE_AT)
    if growth(low) < 0.0:
        return 0.0
    return float(np.exp(brentq(growth, low, np.log(0.5), xtol=1e-9)))


def cycle_of(scene: Scene, point: BoundaryPoint) -> Cycle:
    """The stored cycle, integrated again."""
    pad = DampedContact(scene, point.a, point.zeta, point.mu)
    cycles = Cycles(pad)
    return cycles.over(cycles.start(np.array(point.state), point.period, pad))


class Extremes(NamedTuple):
    """Of a cycle while the face touches: its greatest speed over that of the surface, and the least
    factor 1 + a p' of the contact."""

    face: float
    factor: float


def extremes(cycle: Cycle) -> Extremes:
    """The greatest speed of the lower face and the least contact factor, while the face touches, at
    `PARTS` equally spaced times of a period of a cycle."""
    pad = cycle.pad
    state = cycle.state
    cycles = Cycles(pad)
    part = float(cycle.x[PERIOD]) / PARTS
    samples = []
    for _ in range(PARTS):
        samples.append(state)
        state = cycles.flow.run(pad, state, part).end
    states = np.array(samples).T  # (6, PARTS)
    motion_there = pad.at(states)
    touching = (np.array(motion_there.gaps) < 0.0).any(axis=0)
    factor = np.min(motion_there.factors, axis=0)
    return Extremes(
        face=float(motion_there.face[touching].max()) / pad.surface_speed,
        factor=float(factor[touching].min()),
    )


def critical_distance(cycle: Cycle, kind: Kind) -> float:
    """How far the critical multiplier is from where it lies on a boundary of that kind.

    At a fold it is 1, at a period doubling -1, at a torus of magnitude 1; a grazing has none.
    """
    multipliers = cycle.multipliers
    match kind:
        case "fold":
            # the multiplier of a shift in time is 1 as well; a double eigenvalue is split by the
            # square root of rounding, while the sum of both, 2, moves by rounding alone
            values = np.linalg.eigvals(cycle.monodromy)
            pair = values[np.argsort(np.abs(values - 1.0))[:2]]
            return float(np.abs(pair.sum() - 2.0))
        case "period doubling":
            return float(np.abs(multipliers + 1.0).min())
        case "torus":
            return float(np.abs(np.abs(multipliers) - 1.0).min())
        case "grazing":
            return 0.0


class CheckedBoundary(NamedTuple):
    """A stored boundary as it is reported, the greatest closure error of its cycles, and their
    greatest `critical_distance`."""

    boundary: Boundary
    closure: float
    critical: float


def checked_boundary(scene: Scene, curve: BoundaryCurve) -> CheckedBoundary:
    """Integrate the cycles of a stored boundary again.

    The boundary is reported with the ranges of what the new cycles show, periods in ms. Closure is
    the distance of the states at both ends of a period.
    """
    cycles = [cycle_of(scene, point) for point in curve.points]
    extremes_of_cycles = [extremes(cycle) for cycle in cycles]
    closures = [float(np.abs(cycle.arc.end - cycle.state).max()) for cycle in cycles]
    periods = [1e3 * cycle.period for cycle in cycles]
    boundary = Boundary.of(
        curve,  # contacts, ends_loss, kind and over
        points=tuple(Point(point.a, point.mu, point.zeta) for point in curve.points),
        period=(min(periods), max(periods)),
        face=max(extreme.face for extreme in extremes_of_cycles),
        factor=min(extreme.factor for extreme in extremes_of_cycles),
    )
    return CheckedBoundary(
        boundary=boundary,
        closure=max(closures),
        critical=max(critical_distance(cycle, curve.kind) for cycle in cycles),
    )


def height_at(curves: Sequence[Boundary], over: str, value: float) -> float:
    """The greatest modal damping at which a stable cycle exists: there a fold ends it. 0 where no
    stable cycle exists.

    value: a contact damping if `over` is "a", a friction if it is "mu".

    Over friction the stable cycles lie between a fold, above, and a boundary at which the cycle
    loses its stability, below. Both meet at the lowest friction of the boundary; at lower friction
    the fold joins two unstable cycles.
    """
    in_plane = [curve for curve in curves if curve.over == over]
    if over == "mu":
        stability_lost = [curve for curve in in_plane if curve.kind != "fold" and curve.ends_loss]
        lowest_mus = [min(point.mu for point in curve.points) for curve in stability_lost]
        if value < min(lowest_mus, default=0.0):
            return 0.0
    highest = 0.0
    for curve in in_plane:
        if curve.kind == "fold":
            highest = max([highest, *_dampings_at(curve, value)])
    return highest


def floor_at(curves: Sequence[Boundary], over: str, value: float) -> float:
    """The modal damping below which the loss of contact ends because its cycle loses stability, 0
    where it does not."""
    floor = 0.0
    for curve in curves:
        if curve.over == over and curve.kind != "fold" and curve.ends_loss:
            floor = max([floor, *_dampings_at(curve, value)])
    return floor


def _dampings_at(curve: Boundary, value: float) -> list[float]:
    """Modal dampings of a boundary at a contact damping or a friction, which it may pass often.

    Between its points their logarithm is linear.
    """
    dampings = []
    for first, second in itertools.pairwise(curve.points):
        x0 = first.a if curve.over == "a" else first.mu
        x1 = second.a if curve.over == "a" else second.mu
        if min(x0, x1) <= value <= max(x0, x1) and x0 != x1:
            share = (value - x0) / (x1 - x0)
            dampings.append(float(first.zeta ** (1.0 - share) * second.zeta**share))
    return dampings


def closing(sliding: Sequence[Point], curves: Sequence[Boundary]) -> float | None:
    """The contact damping at which the upper boundary falls below that of stable sliding.

    The ratio of the two modal dampings, `height_at` over `zeta` of the points, passes 1 there. It
    is interpolated between points, log(ratio) linearly over log(a). None where it nowhere falls
    through 1.
    """
    # of the last point at which the ratio was at least 1: its contact damping, and log(ratio)
    a_above: float | None = None
    log_above = 0.0
    for point in sliding:  # in order of rising contact damping
        height = height_at(curves, "a", point.a)
        if height == 0.0 or point.zeta == 0.0:  # one of the boundaries does not exist
            continue
        log_ratio = float(np.log(height / point.zeta))
        if log_ratio >= 0.0:
            a_above = point.a
            log_above = log_ratio
        elif a_above is not None:
            # of the way from that point to this one, in log(a)
            share = log_above / (log_above - log_ratio)
            return float(a_above * (point.a / a_above) ** share)
    return None


def margin(stored: LeastDisturbance, compression: float) -> Margin:
    """A stored least disturbance as it is reported; compression in micrometres."""
    share = stored.lasting / stored.drawn
    least = stored.best
    if least is None:
        return Margin(stored.a, stored.zeta, None, spread=0.0, micrometres=None, share=share)
    greatest = max(norm for norm in stored.norms if norm is not None)
    return Margin(
        a=stored.a,
        zeta=stored.zeta,
        compressions=least,
        spread=(greatest - least) / least,
        micrometres=least * compression,
        share=share,
    )


class Repeats(NamedTuple):
    """How many least disturbances were simulated again, and how many did what they claim."""

    repeated: int
    held: int


def repeat(scene: Scene, stored: Sequence[LeastDisturbance]) -> Repeats:
    """Simulate some least disturbances again: they must last, and not do so if `SHORTER`."""
    with_disturbance = [least for least in stored if least.disturbance]
    chosen = np.random.default_rng(SEED).permutation(len(with_disturbance))[:REPEATED]
    held = 0
    for i in chosen:
        least = with_disturbance[i]
        pad = DampedContact.of(scene, least.a, least.zeta)
        disturbance = np.array(least.disturbance)
        least_lasts, shorter_lasts = lasts(pad, np.array([disturbance, SHORTER * disturbance]))
        held += int(least_lasts and not shorter_lasts)
    return Repeats(len(chosen), held)


def motion(scene: Scene, stored: Stored, boundaries: Sequence[Boundary]) -> Motion:
    """A motion as it is reported, from its boundaries and what is stored of it."""
    # the static compression in micrometres, which does not depend on damping
    compression = 1e6 * DampedContact.of(scene, A_RANGE[0], QUOTED_ZETA).length
    mu = float(scene.pad.mu)
    sliding = []
    for a in np.geomspace(*A_RANGE, SAMPLES).tolist():
        sliding.append(Point(a, mu, critical_zeta(scene, a, mu)))
    over_friction = []
    for friction in np.linspace(*MU_RANGE, FRICTIONS).tolist():
        zeta = critical_zeta(scene, A_OVER_FRICTION, friction)
        over_friction.append(Point(A_OVER_FRICTION, friction, zeta))
    by_norm: dict[Norm, list[Margin]] = {"displacement": [], "energy": []}
    for least in stored.least:
        by_norm[least.norm].append(margin(least, compression))
    displacements = by_norm["displacement"]
    sizes = [m.micrometres for m in displacements if m.micrometres is not None]
    quoted_at = (A_OVER_FRICTION, QUOTED_ZETA)
    return Motion(
        compression=compression,
        sliding=tuple(sliding),
        over_friction=tuple(over_friction),
        boundaries=tuple(boundaries),
        closes=closing(sliding, boundaries),
        highest=height_at(boundaries, "a", A_RANGE[0]),
        quoted=next(m for m in displacements if (m.a, m.zeta) == quoted_at),
        least=min(sizes),
        greatest=max(sizes),
        margins=tuple(displacements),
        energies=tuple(by_norm["energy"]),
    )


def study(files: Sequence[Path]) -> Coexistence:
    """The three motions of case (d), from their scenes and the stored files."""
    if why := without_heyoka("nothing else follows these cycles."):
        return Coexistence(motions={}, checked=None, searches_differ=0.0, left_out=why)
    scenes = read_scenes([file for file in files if file.suffix != ".json"], set(MOTIONS.values()))
    read = [read_json(Stored, file) for file in files if file.suffix == ".json"]
    stored = {stored_motion.motion: stored_motion for stored_motion in read}
    motions = {}
    all_checked: list[CheckedBoundary] = []
    repeats = []
    searches_differ = 0.0
    for name, stem in MOTIONS.items():
        scene = scene_of(name, scenes[stem])
        checked = [checked_boundary(scene, curve) for curve in stored[name].boundaries]
        all_checked += checked
        motions[name] = motion(scene, stored[name], [curve.boundary for curve in checked])
        repeats.append(repeat(scene, stored[name].least))
        for disturbance in motions[name].margins:
            if inside(motions[name], disturbance):  # the figure gives the numbers of those inside
                searches_differ = max(searches_differ, disturbance.spread)
    check = Checked(
        cycles=sum(len(curve.boundary.points) for curve in all_checked),
        closure=max(curve.closure for curve in all_checked),
        critical=max(curve.critical for curve in all_checked),
        repeated=sum(outcome.repeated for outcome in repeats),
        held=sum(outcome.held for outcome in repeats),
    )
    return Coexistence(motions=motions, checked=check, searches_differ=searches_differ)


def inside(motion: Motion, margin: Margin) -> bool:
    """Whether a pair of dampings lies between the boundaries of the loss of contact."""
    low = floor_at(motion.boundaries, "a", margin.a)
    return low < margin.zeta < height_at(motion.boundaries, "a", margin.a)


def sentences(record: Coexistence) -> Mapping[str, bool]:
    """What the paper says of the coexistence, and whether it holds."""
    if record.left_out or record.checked is None:
        return {}
    points = record.motions["b1-d"]
    line = record.motions["b2-d-integral"]
    printed = record.motions["b2-d-mean"]
    all_boundaries = [*points.boundaries, *line.boundaries, *printed.boundaries]

    def points_need_less(on_points: Margin) -> bool:
        """Whether a disturbance lasts on the points, and the line at the same dampings needs more
        than twice its size, or comes to rest from all disturbances."""
        if on_points.micrometres is None:
            return False
        on_line = line.margin(on_points.a, on_points.zeta)
        if on_line is None or on_line.micrometres is None:
            return True
        return on_points.micrometres < 0.5 * on_line.micrometres

    def grows_with_modal_damping(motion: Motion) -> bool:
        """Whether the least disturbances that last grow with modal damping at `A_OVER_FRICTION`."""
        # margins come in order of rising modal damping
        at_one_a = [m.compressions for m in motion.margins if m.a == A_OVER_FRICTION]
        lasting = [size for size in at_one_a if size is not None]
        return lasting == sorted(lasting)

    def lasts_below_the_folds_alone(motion: Motion) -> bool:
        """Whether a disturbance that lasts was found where the stable cycle exists, and only
        there."""
        return all((m.compressions is not None) == inside(motion, m) for m in motion.margins)

    def is_strip_below_the_line(a: float) -> bool:
        """Whether cycles of the printed law exist between two close modal dampings, of which the
        greater is less than half that of the consistent law."""
        height = height_at(printed.boundaries, "a", a)
        floor = floor_at(printed.boundaries, "a", a)
        return 0.9 * height < floor < height < 0.5 * height_at(line.boundaries, "a", a)

    return {
        "stored-cycles-close-and-are-critical": record.checked.closure < 1e-6
        and record.checked.critical < 1e-6
        and record.checked.held == record.checked.repeated,
        "points-coexist-at-every-contact-damping": points.closes is None
        and all(height_at(points.boundaries, "a", p.a) > max(p.zeta, 0.01) for p in points.sliding),
        "line-ceases-to-coexist-at-high-contact-damping": line.closes is not None
        and 0.13 < line.closes < 0.15,
        "motions-last-below-the-folds-alone": all(map(lasts_below_the_folds_alone, (points, line))),
        "printed-law-coexists-in-a-strip-at-the-reference-friction": all(
            map(is_strip_below_the_line, (0.003, 0.01))
        ),
        "printed-law-coexists-at-higher-friction": all(
            height_at(printed.boundaries, "mu", mu) > 0.004
            and floor_at(printed.boundaries, "mu", mu) == 0.0
            for mu in (0.39, 0.42)
        ),
        "no-boundary-asks-for-tension": all(curve.factor > 0.0 for curve in all_boundaries),
        "points-need-the-smaller-disturbance": all(
            points_need_less(m) for m in points.margins if m.compressions is not None
        ),
        "margin-grows-with-modal-damping": grows_with_modal_damping(points)
        and grows_with_modal_damping(line),
        # where no motion lasts (None) the sentence does not hold
        "a-few-micrometres-suffice": (points.quoted.micrometres or np.inf) < 6.0
        and (line.quoted.micrometres or np.inf) < 20.0,
        "box-shares-hide-the-margin": points.quoted.share > 0.7 and line.quoted.share > 0.7,
    }
