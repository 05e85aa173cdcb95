"""Where a motion that loses contact exists beside stable sliding, in case (d) with two dampings.

Contact damping by the law of Hunt and Crossley, modal damping besides. `_coexistence` computes the
boundaries of cycles and the least disturbances beforehand; they are stored. Here every stored cycle
is integrated again, and some of the least disturbances.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

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
from squeal.article.studies._damped_cycles import Cycle, Cycles
from squeal.article.studies._least_disturbance import lasts
from squeal.article.studies._scenes import read_scenes
from squeal.io.provenance import NOT_INSTALLED, WITHOUT_HEYOKA, version
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
    critical; repeated: least disturbances simulated again; held: of these those that lead to a
    lasting loss of contact while `SHORTER` times them leads back to sliding.
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
    high = np.log(0.5)
    if growth(low) < 0.0:
        return 0.0
    return float(np.exp(brentq(growth, low, high, xtol=1e-9)))


def cycle_of(scene: Scene, point: BoundaryPoint) -> Cycle:
    """The stored cycle, integrated again."""
    pad = DampedContact(scene, point.a, point.zeta, point.mu)
    cycles = Cycles(pad)
    return cycles.over(cycles.start(np.array(point.state), point.period, pad))


def extremes(cycle: Cycle) -> tuple[float, float]:
    """Greatest speed of the lower face while it touches over that of the surface, and the least
    factor 1 + a p' of the contact."""
    pad = cycle.pad
    state = cycle.state
    cycles = Cycles(pad)
    part = float(cycle.x[6]) / PARTS
    states = []
    for _ in range(PARTS):
        states.append(state)
        state = cycles.flow.run(pad, state, part).end
    along = np.array(states).T
    found = pad.at(along)
    touching = (np.array(found.gaps) < 0.0).any(axis=0)
    surface = float(pad.scene.pad.V or np.inf) * pad.time / pad.length
    speed = along[3] + pad.c.h / pad.c.w * along[5]
    factor = np.min(found.factors, axis=0)
    return float(speed[touching].max()) / surface, float(factor[touching].min())


def critical_distance(cycle: Cycle, kind: Kind) -> float:
    """How far the critical multiplier is from its place; of a grazing none is."""
    multipliers = cycle.multipliers
    match kind:
        case "fold":
            # that of a shift in time is 1 too: rounding parts the two, but not their sum
            values = np.linalg.eigvals(cycle.monodromy)
            pair = values[np.argsort(np.abs(values - 1.0))[:2]]
            return float(np.abs(pair.sum() - 2.0))
        case "period doubling":
            return float(np.abs(multipliers + 1.0).min())
        case "torus":
            return float(np.abs(np.abs(multipliers) - 1.0).min())
        case "grazing":
            return 0.0


def boundary(scene: Scene, curve: BoundaryCurve) -> tuple[Boundary, float, float]:
    """A stored boundary as it is reported, its greatest closure error and critical distance."""
    cycles = [cycle_of(scene, point) for point in curve.points]
    ends = [extremes(cycle) for cycle in cycles]
    closure = max(float(np.abs(cycle.arc.end - cycle.state).max()) for cycle in cycles)
    critical = max(critical_distance(cycle, curve.kind) for cycle in cycles)
    periods = [1e3 * cycle.period for cycle in cycles]
    found = Boundary(
        contacts=curve.contacts,
        ends_loss=curve.ends_loss,
        kind=curve.kind,
        over=curve.over,
        points=tuple(Point(point.a, point.mu, point.zeta) for point in curve.points),
        period=(min(periods), max(periods)),
        face=max(face for face, _ in ends),
        factor=min(factor for _, factor in ends),
    )
    return found, closure, critical


def height_at(curves: Sequence[Boundary], over: str, value: float) -> float:
    """The greatest modal damping of the folds of stable cycles at a contact damping or a friction,
    0 where there is none.

    Over friction a fold ends the stable cycle only from where the torus that ends the loss of
    contact begins; below that the cycle is unstable on the fold too.
    """
    highest = 0.0
    begins = [
        min(point.mu for point in curve.points)
        for curve in curves
        if curve.over == over == "mu" and curve.kind != "fold" and curve.ends_loss
    ]
    if value < min(begins, default=0.0):
        return 0.0
    for curve in curves:
        if curve.over == over and curve.kind == "fold":
            highest = max([highest, *_heights(curve, value)])
    return highest


def floor_at(curves: Sequence[Boundary], over: str, value: float) -> float:
    """The modal damping below which the loss of contact ends because its cycle loses stability, 0
    where it does not."""
    lowest = 0.0
    for curve in curves:
        if curve.over == over and curve.kind != "fold" and curve.ends_loss:
            lowest = max([lowest, *_heights(curve, value)])
    return lowest


def _heights(curve: Boundary, value: float) -> list[float]:
    """Modal dampings of a boundary at a contact damping or a friction."""
    place = [point.a if curve.over == "a" else point.mu for point in curve.points]
    height = [point.zeta for point in curve.points]
    found = []
    for i in range(len(place) - 1):
        x0, x1 = place[i : i + 2]
        y0, y1 = height[i : i + 2]
        if min(x0, x1) <= value <= max(x0, x1) and x0 != x1:
            share = (value - x0) / (x1 - x0)
            found.append(float(y0 ** (1.0 - share) * y1**share))
    return found


def closing(sliding: Sequence[Point], curves: Sequence[Boundary]) -> float | None:
    """The contact damping at which the upper boundary meets that of stable sliding."""
    before: tuple[float, float] | None = None
    for point in sliding:
        above = height_at(curves, "a", point.a)
        if above == 0.0 or point.zeta == 0.0:
            continue
        over = float(np.log(above / point.zeta))
        if over < 0.0 and before is not None:
            share = before[1] / (before[1] - over)
            return float(before[0] * (point.a / before[0]) ** share)
        before = (point.a, over)
    return None


def margin(stored: LeastDisturbance, compression: float) -> Margin:
    """A stored least disturbance as it is reported; compression in micrometres."""
    norms = [norm for norm in stored.norms if norm is not None]
    best = stored.best
    return Margin(
        a=stored.a,
        zeta=stored.zeta,
        compressions=best,
        spread=0.0 if best is None else (max(norms) - best) / best,
        micrometres=None if best is None else best * compression,
        share=stored.lasting / stored.drawn,
    )


def repeat(scene: Scene, stored: Sequence[LeastDisturbance]) -> tuple[int, int]:
    """How many least disturbances were simulated again, and how many did what they claim."""
    there = [one for one in stored if one.disturbance]
    chosen = np.random.default_rng(SEED).permutation(len(there))[:REPEATED]
    held = 0
    for i in chosen:
        one = there[i]
        pad = DampedContact.of(scene, one.a, one.zeta)
        disturbance = np.array(one.disturbance)
        both = lasts(pad, np.array([disturbance, SHORTER * disturbance]))
        held += int(both[0] and not both[1])
    return len(chosen), held


def motion(scene: Scene, stored: Stored) -> tuple[Motion, list[float], list[float]]:
    """All of one motion, and the errors of its stored cycles."""
    compression = 1e6 * DampedContact.of(scene, A_RANGE[0], QUOTED_ZETA).length
    mu = float(scene.pad.mu)
    sliding = []
    for a in np.geomspace(*A_RANGE, SAMPLES):
        sliding.append(Point(float(a), mu, critical_zeta(scene, float(a), mu)))
    over_friction = []
    for friction in np.linspace(*MU_RANGE, FRICTIONS):
        zeta = critical_zeta(scene, A_OVER_FRICTION, float(friction))
        over_friction.append(Point(A_OVER_FRICTION, float(friction), zeta))
    found = [boundary(scene, curve) for curve in stored.boundaries]
    curves = tuple(curve for curve, _, _ in found)
    margins = [(one.norm, margin(one, compression)) for one in stored.least]
    displacements = tuple(one for norm, one in margins if norm == "displacement")
    sizes = [one.micrometres for one in displacements if one.micrometres is not None]
    at = (A_OVER_FRICTION, QUOTED_ZETA)
    result = Motion(
        compression=compression,
        sliding=tuple(sliding),
        over_friction=tuple(over_friction),
        boundaries=curves,
        closes=closing(sliding, curves),
        highest=height_at(curves, "a", A_RANGE[0]),
        quoted=next(one for one in displacements if (one.a, one.zeta) == at),
        least=min(sizes),
        greatest=max(sizes),
        margins=displacements,
        energies=tuple(one for norm, one in margins if norm == "energy"),
    )
    return result, [closure for _, closure, _ in found], [critical for _, _, critical in found]


def study(files: Sequence[Path]) -> Coexistence:
    """The three motions of case (d), from their scenes and the stored files."""
    if version("heyoka") == NOT_INSTALLED:
        why = f"{WITHOUT_HEYOKA} nothing else follows these cycles."
        return Coexistence(motions={}, checked=None, searches_differ=0.0, left_out=why)
    scenes = read_scenes([f for f in files if f.suffix != ".json"], set(MOTIONS.values()))
    read = [read_json(Stored, file) for file in files if file.suffix == ".json"]
    stored = {one.motion: one for one in read}
    motions = {}
    closures: list[float] = []
    criticals: list[float] = []
    repeated = held = 0
    for name, stem in MOTIONS.items():
        scene = scene_of(name, scenes[stem])
        motions[name], closure, critical = motion(scene, stored[name])
        closures += closure
        criticals += critical
        again, held_again = repeat(scene, stored[name].least)
        repeated += again
        held += held_again
    count = sum(len(curve.points) for one in stored.values() for curve in one.boundaries)
    checked = Checked(count, max(closures), max(criticals), repeated, held)
    shown = [m for one in motions.values() for m in one.margins if inside(one, m)]
    differ = max(margin.spread for margin in shown)
    return Coexistence(motions=motions, checked=checked, searches_differ=differ)


def inside(motion: Motion, margin: Margin) -> bool:
    """Whether a pair of dampings lies between the boundaries of the loss of contact."""
    low = floor_at(motion.boundaries, "a", margin.a)
    return low < margin.zeta < height_at(motion.boundaries, "a", margin.a)


def sentences(found: Coexistence) -> Mapping[str, bool]:
    """What the paper says of the coexistence."""
    if found.left_out or found.checked is None:
        return {}
    points = found.motions["b1-d"]
    line = found.motions["b2-d-integral"]
    printed = found.motions["b2-d-mean"]
    every = (points, line, printed)

    def lasting(one: Motion) -> list[Margin]:
        """The pairs of dampings at which some motion lasts."""
        return [m for m in one.margins if m.compressions is not None]

    return {
        "stored-cycles-close-and-are-critical": found.checked.closure < 1e-6
        and found.checked.critical < 1e-6
        and found.checked.held == found.checked.repeated,
        "points-coexist-at-every-contact-damping": points.closes is None
        and all(
            height_at(points.boundaries, "a", one.a) > max(one.zeta, 0.01) for one in points.sliding
        ),
        "line-ceases-to-coexist-at-high-contact-damping": line.closes is not None
        and 0.13 < line.closes < 0.15,
        "motions-last-below-the-folds-alone": all(
            (margin.compressions is not None) == inside(one, margin)
            for one in (points, line)
            for margin in one.margins
        ),
        "printed-law-coexists-in-a-strip-at-the-reference-friction": all(
            0.9 * height_at(printed.boundaries, "a", a)
            < floor_at(printed.boundaries, "a", a)
            < height_at(printed.boundaries, "a", a)
            < 0.5 * height_at(line.boundaries, "a", a)
            for a in (0.003, 0.01)
        ),
        "printed-law-coexists-at-higher-friction": all(
            height_at(printed.boundaries, "mu", mu) > 0.004
            and floor_at(printed.boundaries, "mu", mu) == 0.0
            for mu in (0.39, 0.42)
        ),
        "no-boundary-asks-for-tension": all(
            curve.factor > 0.0 for one in every for curve in one.boundaries
        ),
        "points-need-the-smaller-disturbance": all(
            a.micrometres is not None
            and (b is None or b.micrometres is None or a.micrometres < 0.5 * b.micrometres)
            for a in lasting(points)
            for b in [line.margin(a.a, a.zeta)]
        ),
        "margin-grows-with-modal-damping": all(
            margins == sorted(margins)
            for one in (points, line)
            for margins in [
                [
                    m.compressions
                    for m in one.margins
                    if m.a == A_OVER_FRICTION and m.compressions is not None
                ]
            ]
        ),
        "a-few-micrometres-suffice": (points.quoted.micrometres or np.inf) < 6.0
        and (line.quoted.micrometres or np.inf) < 20.0,
        "box-shares-hide-the-margin": points.quoted.share > 0.7 and line.quoted.share > 0.7,
    }
