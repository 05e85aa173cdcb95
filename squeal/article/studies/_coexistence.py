"""Where loss of contact coexists with stable sliding: boundaries and least disturbances, to store.

`python -m squeal.article.studies._coexistence b1-d workflow/scenes/b1-d.yaml` prints the file
workflow/stored/coexistence/b1-d.json in some minutes. The study `coexistence` reads these files and
checks what they hold. All random numbers are from fixed seeds.
"""

from __future__ import annotations

import argparse
import dataclasses
import itertools
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from squeal.article.records import Record
from squeal.article.studies._damped_contact import DampedContact, ensemble, flow
from squeal.article.studies._damped_cycles import (
    LOG_A,
    LOG_ZETA,
    MU,
    PERIOD,
    REAL,
    Condition,
    Cycle,
    Cycles,
    direction_of,
)
from squeal.article.studies._least_disturbance import Norm, lasts, least_disturbance
from squeal.errors import ComputationError
from squeal.io.scene import Scene, read_scene
from squeal.io.writing import to_json
from squeal.model.contact import LineForce

MOTIONS = {"b1-d": "b1-d", "b2-d-integral": "b2-d", "b2-d-mean": "b2-d"}
"""The scene of each motion."""
A_RANGE = (1e-3, 0.3)
ZETA_RANGE = (5e-4, 0.03)
"""Of the plane: contact damping in s/m and modal damping ratio."""
MU_RANGE = (0.0, 0.6)  # of the plane over friction
A_OVER_FRICTION = 0.01  # s/m, contact damping of the boundaries over friction
MARGIN = 1.15  # factor by which a boundary may leave the plane
REACH = 3.0  # static compressions, half width of the box of initial conditions
DRAWN = 48  # initial conditions from the box
SEEDS = (0, 1, 2)  # one search for a least disturbance each
DIGITS = 11  # significant ones that are stored
SETTLED = 1200.0  # units of time after which a cycle is searched
MOST = 45  # points of a boundary either way
LONGER_THAN_LEAST = 1.02  # factor on a least disturbance whose motion is to last

# how a cycle is recognised in a motion, times in units of `_damped_contact`
OBSERVED = 45.0  # time: some four periods
SEPARATIONS = 12  # that are compared
AFTER_SEPARATION = 1e-3  # time from a separation to the state that is compared
RETURNED = 0.3  # greatest distance of two states that are a guess of one period
GUESSES = 4  # that are tried, the nearest returns first

_WIDE = (
    (0.001, 0.01, 0.03, 0.1, 0.2),
    (0.001, 0.002, 0.003, 0.005, 0.007, 0.01, 0.015, 0.02),
)
LEAST_AT = {
    "b1-d": _WIDE,
    "b2-d-integral": _WIDE,
    "b2-d-mean": ((0.001, 0.003, 0.01), (0.0005, 0.001, 0.002, 0.005)),
}
"""Contact and modal dampings at which the least disturbance is searched."""
ENERGY_A = 0.01  # at which the least energy is computed too


class Family(NamedTuple):
    """A cycle that simulations come to: the dampings at which it was found and its contact changes.

    a: s/m; contacts: as `Cycle.contacts`, any of them; mu: friction, None for the scene's;
    last_beyond_torus: where it loses its stability motions go on losing contact, as simulations
    from the box show.
    """

    a: float
    zeta: float
    contacts: tuple[str, ...]
    mu: float | None = None
    last_beyond_torus: bool = True


FAMILIES = {
    "b1-d": (Family(0.01, 0.005, ("LltT", "LtlT")), Family(0.15, 0.01, ("Tt",))),
    "b2-d-integral": (Family(0.01, 0.005, ("LlTt", "LtlT")),),
    "b2-d-mean": (Family(0.01, 0.005, ("LlTtTt", "TtTtTt"), 0.4, False),),
}
"""The cycles of each motion whose boundaries are traced."""


Kind = Literal["fold", "period doubling", "torus", "grazing"]
"""Of a boundary of cycles.

At a fold a stable cycle and an unstable one meet and vanish. At a period doubling or a torus the
cycle loses its stability. At a grazing a contact change appears or vanishes.
"""


class Boundary(NamedTuple):
    """A cycle on a boundary."""

    kind: Kind
    cycle: Cycle


class Grazing(NamedTuple):
    """A cycle that starts where an edge (0 leading, 1 trailing) grazes, and whether the edge
    touches around that moment."""

    cycle: Cycle
    edge: int
    touches: bool


class BoundaryPoint(Record):
    """A cycle on a boundary.

    state: (6,), in the units of `_damped_contact`; period: in these; a: s/m.
    """

    a: float
    zeta: float
    mu: float
    period: float
    state: tuple[float, ...]


Plane = Literal["a", "mu"]
"""What a plane has beside modal damping: contact damping or friction."""


class BoundaryCurve(Record):
    """A boundary of a family of cycles in a plane of modal damping and another parameter.

    contacts: the contact changes of the family's cycle, as `Cycle.contacts`; ends_loss: beyond it
    the loss of contact ends for most motions near the cycle. Beyond the torus of points it goes on.
    """

    contacts: str
    ends_loss: bool
    kind: Kind
    over: Plane
    points: tuple[BoundaryPoint, ...]


class LeastDisturbance(Record):
    """At a pair of dampings: the norm found from each seed (None: no motion lasts), the disturbance
    (6,) with the least, and of motions from a box of initial conditions how many last."""

    a: float
    zeta: float
    norm: Norm
    norms: tuple[float | None, ...]
    disturbance: tuple[float, ...]
    drawn: int
    lasting: int

    @property
    def best(self) -> float | None:
        """The least norm, None where no motion lasts."""
        return min((norm for norm in self.norms if norm is not None), default=None)


class Stored(Record):
    """What a file holds: of one motion the boundaries of its cycles and the least disturbances."""

    motion: str
    boundaries: tuple[BoundaryCurve, ...]
    least: tuple[LeastDisturbance, ...]


def scene_of(motion: str, scene: Scene) -> Scene:
    """The scene of a motion, with its contact law."""
    law: LineForce = "mean" if motion.endswith("mean") else "integral"
    return dataclasses.replace(
        scene, formulation=dataclasses.replace(scene.formulation, line_force=law)
    )


def box(seed: int) -> np.ndarray:
    """Disturbances (`DRAWN`, 6) of steady sliding, drawn uniformly from the box."""
    return np.random.default_rng(seed).uniform(-REACH, REACH, (DRAWN, 6))


def shortest_repetition(cycles: Cycles, cycle: Cycle) -> Cycle:
    """The cycle with its shortest period: `cycle` may run through a shorter one several times.

    If its contact changes are `count` times the same sequence, Newton's method starts from the
    period over `count`. `cycle` itself is returned where no shorter period is found.
    """
    changes = cycle.contacts
    for count in (5, 4, 3, 2):  # the shortest possible period first
        part = changes[: len(changes) // count]
        if changes != part * count:
            continue
        guess = cycle.x.copy()
        guess[PERIOD] /= count
        try:
            shorter, _ = cycles.solve(guess)
            return shorter
        except ComputationError:
            continue
    return cycle


def cycle_after(cycles: Cycles, pad: DampedContact, state: np.ndarray) -> Cycle | None:
    """The cycle that a motion has settled to, None where no two of its separations repeat.

    Two states just after separations of the same edge, near each other, are a guess of a periodic
    motion: the time between them is its period. state (6,): of the motion, in natural units.
    """
    integrator = flow(pad.law)
    passages = integrator.run(pad, state, OBSERVED).passages
    separations = [passage for passage in passages if not passage.touches][:SEPARATIONS]
    states = [integrator.run(pad, state, p.t + AFTER_SEPARATION).end for p in separations]
    returns: list[tuple[float, int, int]] = []  # distance of two states, and their indices
    for i, j in itertools.combinations(range(len(states)), 2):
        if separations[i].edge == separations[j].edge:
            distance = float(np.abs(states[j] - states[i]).max())
            returns.append((distance, i, j))
    for distance, i, j in sorted(returns)[:GUESSES]:
        if distance > RETURNED:
            break
        period = separations[j].t - separations[i].t
        try:
            cycle, _ = cycles.solve(cycles.start(states[i], period, pad))
        except ComputationError:
            continue
        return shortest_repetition(cycles, cycle)
    return None


def find_cycle(scene: Scene, family: Family) -> Cycle:
    """The cycle of a family: one with its contact changes to which some motion settles.

    The motions start from disturbances of the box, then from least disturbances that last. Raises
    ComputationError where none of them leads to such a cycle.
    """
    mu = float(scene.pad.mu) if family.mu is None else family.mu
    pad = DampedContact(scene, family.a, family.zeta, mu)
    cycles = Cycles(pad)
    searches = [least_disturbance(pad, "displacement", seed) for seed in SEEDS]
    lasting = [LONGER_THAN_LEAST * least.disturbance for least in searches if least is not None]
    for disturbances in (box(0), np.reshape(lasting, (-1, 6))):  # (n, 6) each
        fate = ensemble(pad.law).fate(pad, pad.sliding + disturbances, SETTLED)
        for state in fate.ends[fate.lasts]:
            cycle = cycle_after(cycles, pad, state)
            if cycle is not None and cycle.contacts in family.contacts:
                return cycle
    raise ComputationError(f"no cycle with the contact changes {family.contacts} was found")


def boundary_along(cycles: Cycles, cycle: Cycle, parameter: int, sign: float) -> Boundary | None:
    """The first boundary of a stable cycle as a parameter rises (sign 1) or falls (-1): the modal
    damping (`LOG_ZETA`) or friction (`MU`).

    A branch that turns back has passed a fold; a cycle that is unstable lies beyond a boundary too.
    None where the cycle leaves the plane before, or Newton's method does not find the boundary.
    """
    before = cycle
    for following in cycles.branch(cycle.x, [parameter], direction_of(parameter, sign)):
        turned_back = sign * (following.x[parameter] - before.x[parameter]) < 0.0
        if turned_back or not following.stable:
            return _boundary_between(cycles, parameter, before, following)
        before = following
        if not _has_damping_of_plane(following):
            break
        if not MU_RANGE[0] < following.pad.mu < MU_RANGE[1]:
            break
    return None


def _has_damping_of_plane(cycle: Cycle) -> bool:
    """Whether the modal damping lies in the plane, or so far above that a boundary may be near."""
    return ZETA_RANGE[0] / MARGIN < cycle.pad.zeta < 2.0 * ZETA_RANGE[1]


def kind_beyond(cycle: Cycle) -> Kind:
    """The boundary that a cycle just beyond it has passed, by its leading Floquet multiplier.

    A complex one has left the unit circle (torus), or a real one at -1 (period doubling), or at 1.
    """
    leading = cycle.multipliers[0]
    if abs(leading.imag) > REAL:
        return "torus"
    return "period doubling" if leading.real < -1.0 else "fold"


def _boundary_between(
    cycles: Cycles, parameter: int, before: Cycle, after: Cycle
) -> Boundary | None:
    """The boundary between two neighbours of a branch, None where Newton's method finds none."""
    kind = kind_beyond(after)
    for guess in (before, after):
        try:
            on_boundary, _ = cycles.solve(guess.x, [parameter], conditions_of(cycles, kind))
        except ComputationError:
            continue
        return Boundary(kind, on_boundary)
    return None


def conditions_of(cycles: Cycles, kind: Kind) -> list[Condition]:
    """Functions of X that vanish on a boundary of a kind, see `Cycles`."""
    match kind:
        case "fold":
            return [cycles.bordered(1.0)]
        case "period doubling":
            return [cycles.bordered(-1.0)]
        case "torus":
            return [cycles.unit_pair]
        case "grazing":
            raise ValueError("a grazing has conditions of its edge")


def grazing_along_zeta(cycles: Cycles, cycle: Cycle, sign: float) -> Grazing | None:
    """The first grazing of a stable cycle as the modal damping rises (sign 1) or falls (-1).

    Between two neighbours of the branch an excursion of an edge has appeared or vanished: one of
    them has two contact changes more. None where the branch turns back, the cycle loses its
    stability or the modal damping leaves the plane first.
    """
    if not cycle.stable:
        return None
    before = cycle
    for following in cycles.branch(cycle.x, [LOG_ZETA], direction_of(LOG_ZETA, sign)):
        turned_back = following.x[LOG_ZETA] * sign < before.x[LOG_ZETA] * sign
        if turned_back or not following.stable:
            return None
        added = len(following.contacts) - len(before.contacts)
        if added == 2:
            return _grazing_near(cycles, following)
        if added == -2:
            return _grazing_near(cycles, before)
        before = following
        if not _has_damping_of_plane(following):
            break
    return None


def _grazing_near(cycles: Cycles, cycle: Cycle) -> Grazing | None:
    """The grazing next to a cycle, where the shortest excursion of one of its edges vanishes.

    An excursion of an edge lasts from one of its contact changes to the next. The guess is the
    cycle with its start moved to the middle of the shortest excursion; None where Newton's method
    finds no grazing from there.
    """
    period = float(cycle.x[PERIOD])
    shortest = np.inf
    middle = 0.0
    edge = 0
    touches = True
    for edge_tried in (0, 1):
        passages = [p for p in cycle.arc.passages if p.edge == edge_tried]
        next_passages = [*passages[1:], *passages[:1]]  # the last is followed by the first again
        for begin, end in zip(passages, next_passages, strict=True):
            duration = (end.t - begin.t) % period
            if duration < shortest:
                shortest = duration
                edge = edge_tried
                middle = (begin.t + 0.5 * duration) % period
                touches = end.touches  # whether the edge touches once the excursion is over
    guess = cycle.x.copy()
    guess[:6] = flow(cycle.pad.law).run(cycle.pad, cycle.state, middle).end
    conditions = cycles.grazing(edge, touches)
    try:
        grazing, _ = cycles.solve(guess, [LOG_ZETA], conditions, anchored=True)
    except ComputationError:
        return None
    return Grazing(grazing, edge, touches)


def trace(
    cycles: Cycles,
    first: Cycle,
    free: Sequence[int],
    conditions: Callable[[], Sequence[Condition]],
    critical: int,
    anchored: bool = False,
) -> list[Cycle]:
    """A boundary both ways from a point, as far as the plane and the stable cycle reach.

    Returns its cycles in order: those that come with the fall of the first free parameter, the last
    first, then `first`, then those that come with its rise.

    Parameters
    ----------
    first : the cycle on the boundary from which it is traced
    free : indices into X of the two parameters of the plane: from `first` one way begins with a
        fall of the first of them, the other way with its rise
    conditions : makes the functions of X that vanish on the boundary
    critical : how many of the leading multipliers lie on the unit circle
    anchored : whether the conditions say where on the motion the state lies, as at a grazing
    """
    limits = {
        LOG_A: (np.log(A_RANGE[0] / MARGIN), np.log(A_RANGE[1] * MARGIN)),
        LOG_ZETA: (np.log(ZETA_RANGE[0] / MARGIN), np.log(ZETA_RANGE[1] * MARGIN)),
        MU: MU_RANGE,
    }

    def is_in_plane(cycle: Cycle) -> bool:
        return all(limits[i][0] < cycle.x[i] < limits[i][1] for i in free)

    def one_way(sign: float) -> list[Cycle]:
        """The cycles after `first` to one side, without it."""
        side: list[Cycle] = []
        direction = direction_of(free[0], sign)
        try:
            for cycle in cycles.branch(first.x, free, direction, conditions, anchored):
                side.append(cycle)
                # the largest multiplier behind the critical ones; 1e-4 allows for its rounding
                others_stable = np.abs(cycle.multipliers[critical]) < 1.0 + 1e-4
                if not is_in_plane(cycle) or not others_stable or len(side) == MOST:
                    break
        except ComputationError:
            pass  # the boundary ends where it meets another
        return side

    falling = one_way(-1.0)
    rising = one_way(1.0)
    return [*reversed(falling), first, *rising]


def _rounded(value: float) -> float:
    """To the digits that are stored."""
    return float(f"{value:.{DIGITS}g}")


def boundary_point(cycle: Cycle) -> BoundaryPoint:
    """A point of the boundary as it is stored."""
    return BoundaryPoint(
        a=_rounded(cycle.pad.a),
        zeta=_rounded(cycle.pad.zeta),
        mu=_rounded(cycle.pad.mu),
        period=_rounded(cycle.x[PERIOD]),
        state=tuple(map(_rounded, cycle.state)),
    )


CRITICAL: dict[Kind, int] = {"fold": 1, "period doubling": 1, "torus": 2, "grazing": 0}
"""How many leading multipliers lie on the unit circle."""


class BothPlanes(NamedTuple):
    """A boundary over contact damping and over friction, empty where it does not reach a plane."""

    over_a: list[Cycle]
    over_mu: list[Cycle]


def both_planes(cycles: Cycles, boundary: Boundary, mu: float) -> BothPlanes:
    """A boundary over contact damping at a friction, and over friction at `A_OVER_FRICTION`.

    Both planes are over modal damping, too. The boundary is traced first in the plane in which it
    was found. The planes have one line in common; from where the boundary crosses that line it is
    traced in the other plane.

    mu: the friction of the first plane, that of the scene.
    """

    def trace_over(parameter: int, start: Cycle) -> list[Cycle]:
        """The boundary over one parameter and modal damping, to both sides of a cycle on it.

        Parameters are indices of the unknowns of a cycle: `LOG_A`, `LOG_ZETA` or `MU`.
        """
        critical = CRITICAL[boundary.kind]
        return trace(cycles, start, [parameter, LOG_ZETA], conditions, critical)

    def conditions() -> list[Condition]:
        """What holds on a boundary beside the equations of a cycle."""
        return conditions_of(cycles, boundary.kind)

    def trace_other(
        points: Sequence[Cycle], parameter: int, value: float, other: int
    ) -> list[Cycle]:
        """The boundary over `other`, from where `parameter` has a value: that of the other plane.

        points: of the boundary over `parameter`; the nearest to that value is the guess.
        """
        nearest = min(points, key=lambda cycle: abs(cycle.x[parameter] - value))
        guess = nearest.x.copy()
        guess[parameter] = value
        try:
            # on the line that both planes have in common: modal damping alone is free
            common, _ = cycles.solve(guess, [LOG_ZETA], conditions())
            return trace_over(other, common)
        except ComputationError:
            return []

    # friction is still exactly `mu` where the boundary was found as modal damping changed
    if boundary.cycle.pad.mu == mu:
        over_a = trace_over(LOG_A, boundary.cycle)
        return BothPlanes(over_a, trace_other(over_a, LOG_A, np.log(A_OVER_FRICTION), MU))
    over_mu = trace_over(MU, boundary.cycle)
    return BothPlanes(trace_other(over_mu, MU, mu, LOG_A), over_mu)


def grazing_over_a(cycles: Cycles, grazing: Grazing) -> list[Cycle]:
    """A grazing over contact damping and modal damping."""
    gap_and_rate = cycles.grazing(grazing.edge, grazing.touches)

    def conditions() -> Sequence[Condition]:
        return gap_and_rate

    plane = [LOG_A, LOG_ZETA]
    return trace(cycles, grazing.cycle, plane, conditions, CRITICAL["grazing"], anchored=True)


def boundaries(scene: Scene, family: Family) -> list[BoundaryCurve]:
    """The boundaries of a family over contact damping and over friction, both with modal damping.

    As modal damping rises, the cycle ends in a fold; as modal damping or friction falls, it may
    lose its stability. From there the boundary is traced in both planes. Grazings are traced over
    contact damping alone.
    """
    start = find_cycle(scene, family)
    cycles = Cycles(start.pad)
    curves = []

    def store(kind: Kind, over: Plane, points: Sequence[Cycle]) -> None:
        """Append a boundary of a kind, over a plane of two parameters, to `curves`, if it has
        points."""
        if not points:
            return
        # beyond a fold there is no cycle; where a cycle loses its stability, at a period doubling
        # or a torus, motions near it may go on losing contact all the same
        loses_stability = kind in ("period doubling", "torus")
        ends_with_stability = loses_stability and not family.last_beyond_torus
        curves.append(
            BoundaryCurve(
                contacts=family.contacts[0],  # it names the family, of all that its cycle may have
                ends_loss=kind == "fold" or ends_with_stability,
                kind=kind,
                over=over,
                points=tuple(map(boundary_point, points)),
            )
        )

    above = boundary_along(cycles, start, LOG_ZETA, 1.0)
    below = boundary_along(cycles, start, LOG_ZETA, -1.0)
    # a family with a friction of its own may lose its stability as friction falls instead
    if below is None and family.mu is not None:
        below = boundary_along(cycles, start, MU, -1.0)
    for boundary in (above, below):
        if boundary is not None:
            planes = both_planes(cycles, boundary, float(scene.pad.mu))
            store(boundary.kind, "a", planes.over_a)
            store(boundary.kind, "mu", planes.over_mu)
    if family.mu is not None:
        return curves  # the plane of grazings is at the friction of the scene, `start` is not
    for sign in (1.0, -1.0):
        grazing = grazing_along_zeta(cycles, start, sign)
        if grazing is not None:
            store("grazing", "a", grazing_over_a(cycles, grazing))
    return curves


def least_at(scene: Scene, a: float, zeta: float, norm: Norm) -> LeastDisturbance:
    """The least disturbance at a pair of dampings, and how many motions from the box last.

    a: contact damping, s/m; zeta: modal damping ratio.
    """
    pad = DampedContact.of(scene, a, zeta)
    searches = [least_disturbance(pad, norm, seed) for seed in SEEDS]
    successful = [least for least in searches if least is not None]
    shortest: tuple[float, ...] = ()
    if successful:
        best = min(successful, key=lambda least: least.norm)
        shortest = tuple(map(_rounded, best.disturbance))
    return LeastDisturbance(
        a=a,
        zeta=zeta,
        norm=norm,
        norms=tuple(None if least is None else _rounded(least.norm) for least in searches),
        disturbance=shortest,
        drawn=DRAWN,  # disturbances from the box, of seed 0
        lasting=int(np.count_nonzero(lasts(pad, box(0)))),
    )


def compute(motion: str, scene: Scene) -> Stored:
    """All that is stored of a motion; least disturbances only where sliding is stable."""
    with_law = scene_of(motion, scene)
    curves: list[BoundaryCurve] = []
    for family in FAMILIES[motion]:
        curves += boundaries(with_law, family)
    least = []
    contact_dampings, modal_dampings = LEAST_AT[motion]
    for a, zeta in itertools.product(contact_dampings, modal_dampings):
        if DampedContact.of(with_law, a, zeta).growth >= 0.0:  # of sliding: it is not stable
            continue
        least.append(least_at(with_law, a, zeta, "displacement"))
        if a == ENERGY_A:
            least.append(least_at(with_law, a, zeta, "energy"))
    return Stored(motion, tuple(curves), tuple(least))


def main() -> int:
    """Print what is stored of a motion as JSON."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("motion", choices=MOTIONS)
    parser.add_argument("scene", type=Path)
    chosen = parser.parse_args()
    sys.stdout.write(to_json(compute(chosen.motion, read_scene(chosen.scene)).to_dict()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
