"""Where loss of contact coexists with stable sliding: boundaries and least disturbances, to store.

`python -m squeal.article.studies._coexistence b1-d workflow/scenes/b1-d.yaml` prints the file
workflow/stored/coexistence/b1-d.json in some minutes. The study `coexistence` reads these files and
checks what they hold. All random numbers are from fixed seeds.
"""

from __future__ import annotations

import argparse
import dataclasses
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
    Condition,
    Cycle,
    Cycles,
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
MU_RANGE = (0.0, 0.6)
A_OVER_FRICTION = 0.01  # s/m, of the boundaries over friction
MARGIN = 1.15  # by which a boundary may leave the plane
REACH = 3.0  # static compressions, half width of the box of initial conditions
DRAWN = 48
SEEDS = (0, 1, 2)
DIGITS = 11
SETTLED = 1200.0  # units of time after which a cycle is looked for
MOST = 45  # points of a boundary either way

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
    """A cycle that simulations come to: where it was found and its contact changes.

    mu: friction, None for the scene's; last_beyond_torus: where it loses its stability motions go
    on losing contact, as simulations from the box show.
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
    """A cycle that starts where an edge grazes, and whether it touches around that."""

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


def box(pad: DampedContact, seed: int) -> np.ndarray:
    """Disturbances (`DRAWN`, 6) drawn uniformly from the box."""
    return np.random.default_rng(seed).uniform(-REACH, REACH, (DRAWN, 6))


def shortest_repetition(cycles: Cycles, cycle: Cycle) -> Cycle:
    """The cycle itself where a motion runs through it several times in its period."""
    letters = cycle.contacts
    for count in (5, 4, 3, 2):
        part = letters[: len(letters) // count]
        if len(letters) % count == 0 and letters == part * count:
            guess = cycle.x.copy()
            guess[PERIOD] /= count
            try:
                return cycles.solve(guess)[0]
            except ComputationError:
                continue
    return cycle


def cycle_after(cycles: Cycles, pad: DampedContact, state: np.ndarray) -> Cycle | None:
    """The cycle that a motion has settled to, None where two of its separations do not repeat."""
    integrator = flow(pad.law)
    separations = [p for p in integrator.run(pad, state, 45.0).passages if not p.touches][:12]
    states = [integrator.run(pad, state, p.t + 1e-3).end for p in separations]
    pairs = [
        (float(np.abs(states[j] - states[i]).max()), i, j)
        for i in range(len(states))
        for j in range(i + 1, len(states))
        if separations[i].edge == separations[j].edge
    ]
    for distance, i, j in sorted(pairs)[:4]:
        if distance > 0.3:
            break
        period = separations[j].t - separations[i].t
        try:
            cycle, _ = cycles.solve(cycles.start(states[i], period, pad))
        except ComputationError:
            continue
        return shortest_repetition(cycles, cycle)
    return None


def find_cycle(scene: Scene, family: Family) -> Cycle:
    """The cycle of a family, from motions of the box and least disturbances.

    Raises ComputationError where none of them leads to it.
    """
    mu = float(scene.pad.mu) if family.mu is None else family.mu
    pad = DampedContact(scene, family.a, family.zeta, mu)
    cycles = Cycles(pad)
    shortest = [least_disturbance(pad, "displacement", seed) for seed in SEEDS]
    states = [1.02 * one.disturbance for one in shortest if one is not None]
    for disturbances in (box(pad, 0), np.array(states)):
        found = ensemble(pad.law).fate(pad, pad.sliding + disturbances, SETTLED)
        for state in found.ends[found.lasts]:
            cycle = cycle_after(cycles, pad, state)
            if cycle is not None and cycle.contacts in family.contacts:
                return cycle
    raise ComputationError(f"no cycle with the contact changes {family.contacts} was found")


def boundary_along(cycles: Cycles, cycle: Cycle, parameter: int, sign: float) -> Boundary | None:
    """The first boundary of a stable cycle as the modal damping (`LOG_ZETA`) or friction (`MU`)
    rises or falls; None where the cycle leaves the plane before or no boundary is found."""
    direction = np.zeros(10)
    direction[parameter] = sign
    before = cycle
    for following in cycles.branch(cycle.x, [parameter], direction):
        turned = sign * (following.x[parameter] - before.x[parameter]) < 0.0
        if turned or not following.stable:
            return _refined(cycles, parameter, before, following)
        before = following
        inside = ZETA_RANGE[0] / MARGIN < following.pad.zeta < 2.0 * ZETA_RANGE[1]
        if not inside or not MU_RANGE[0] < following.pad.mu < MU_RANGE[1]:
            break
    return None


def _refined(cycles: Cycles, parameter: int, before: Cycle, after: Cycle) -> Boundary | None:
    leading = after.multipliers[0]
    kind: Kind = "fold"
    if abs(leading.imag) > 1e-6:
        kind = "torus"
    elif leading.real < -1.0:
        kind = "period doubling"
    for guess in (before, after):
        try:
            found, _ = cycles.solve(guess.x, [parameter], conditions_of(cycles, kind))
        except ComputationError:
            continue
        return Boundary(kind, found)
    return None


def conditions_of(cycles: Cycles, kind: Kind) -> list[Condition]:
    """What holds on a boundary of a kind."""
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
    """The first grazing of a stable cycle as the modal damping rises or falls."""
    direction = np.zeros(10)
    direction[LOG_ZETA] = sign
    before = cycle
    for following in cycles.branch(cycle.x, [LOG_ZETA], direction):
        if (
            not cycle.stable
            or not following.stable
            or following.x[LOG_ZETA] * sign < before.x[LOG_ZETA] * sign
        ):
            return None
        more = before
        fewer = following
        if len(before.contacts) < len(following.contacts):
            more = following
            fewer = before
        if len(more.contacts) == len(fewer.contacts) + 2:
            return _grazing_between(cycles, more, fewer)
        before = following
        if not ZETA_RANGE[0] / MARGIN < following.pad.zeta < 2.0 * ZETA_RANGE[1]:
            break
    return None


def _grazing_between(cycles: Cycles, more: Cycle, fewer: Cycle) -> Grazing | None:
    """The grazing where the shortest excursion of an edge of a cycle vanishes."""
    period = float(more.x[PERIOD])
    shortest = np.inf
    middle = 0.0
    edge = 0
    touches = True
    for edge_tried in (0, 1):
        passages = [p for p in more.arc.passages if p.edge == edge_tried]
        for first, second in zip(passages, [*passages[1:], *passages[:1]], strict=True):
            length = (second.t - first.t) % period
            if length < shortest:
                shortest = length
                edge = edge_tried
                middle = (first.t + 0.5 * length) % period
                touches = second.touches
    x = more.x.copy()
    x[:6] = flow(more.pad.law).run(more.pad, more.state, middle).end
    try:
        found, _ = cycles.solve(x, [LOG_ZETA], cycles.grazing(edge, touches), anchored=True)
    except ComputationError:
        return None
    return Grazing(found, edge, touches)


def trace(
    cycles: Cycles,
    first: Cycle,
    free: Sequence[int],
    conditions: Callable[[], Sequence[Condition]],
    critical: int,
    anchored: bool = False,
) -> list[Cycle]:
    """A boundary both ways from a point, as far as the plane and the stable cycle reach.

    critical : how many of the leading multipliers lie on the unit circle
    """
    limits = {
        LOG_A: (np.log(A_RANGE[0] / MARGIN), np.log(A_RANGE[1] * MARGIN)),
        LOG_ZETA: (np.log(ZETA_RANGE[0] / MARGIN), np.log(ZETA_RANGE[1] * MARGIN)),
        MU: MU_RANGE,
    }
    sides = []
    for sign in (-1.0, 1.0):
        direction = np.zeros(10)
        direction[free[0]] = sign
        side: list[Cycle] = []
        try:
            for cycle in cycles.branch(first.x, free, direction, conditions, anchored):
                side.append(cycle)
                inside = all(limits[i][0] < cycle.x[i] < limits[i][1] for i in free)
                stable_beside = np.abs(cycle.multipliers[critical]) < 1.0 + 1e-4
                if not inside or not stable_beside or len(side) == MOST:
                    break
        except ComputationError:
            pass  # the boundary ends where it meets another
        sides.append(side)
    return [*reversed(sides[0]), first, *sides[1]]


def _rounded(values: Sequence[float] | np.ndarray) -> tuple[float, ...]:
    return tuple(float(f"{value:.{DIGITS}g}") for value in values)


def boundary_point(cycle: Cycle) -> BoundaryPoint:
    """As it is stored."""
    a, zeta, mu, period = _rounded((cycle.pad.a, cycle.pad.zeta, cycle.pad.mu, cycle.x[PERIOD]))
    return BoundaryPoint(a, zeta, mu, period, _rounded(cycle.state))


CRITICAL: dict[Kind, int] = {"fold": 1, "period doubling": 1, "torus": 2, "grazing": 0}
"""How many leading multipliers lie on the unit circle."""


def both_planes(cycles: Cycles, found: Boundary, mu: float) -> tuple[list[Cycle], list[Cycle]]:
    """A boundary over contact damping at a friction, and over friction at `A_OVER_FRICTION`.

    It is followed in one plane from where it was found, and from there in the other plane; where it
    does not reach that, the list is empty.
    """
    critical = CRITICAL[found.kind]

    def conditions() -> list[Condition]:
        return conditions_of(cycles, found.kind)

    planes: dict[int, list[Cycle]] = {LOG_A: [], MU: []}
    first, second = (LOG_A, MU) if found.cycle.pad.mu == mu else (MU, LOG_A)
    fixed = np.log(A_OVER_FRICTION) if second == MU else mu
    planes[first] = trace(cycles, found.cycle, [first, LOG_ZETA], conditions, critical)
    nearest = min(planes[first], key=lambda cycle: abs(cycle.x[first] - fixed))
    guess = nearest.x.copy()
    guess[first] = fixed
    try:
        there, _ = cycles.solve(guess, [LOG_ZETA], conditions())
        planes[second] = trace(cycles, there, [second, LOG_ZETA], conditions, critical)
    except ComputationError:
        pass  # the boundary does not reach the other plane
    return planes[LOG_A], planes[MU]


def boundaries(scene: Scene, family: Family) -> list[BoundaryCurve]:
    """The boundaries of a family over contact damping and over friction, both with modal damping.

    Upwards the cycle ends in a fold; as modal damping or friction falls it may lose its stability;
    an edge may graze.
    """
    start = find_cycle(scene, family)
    cycles = Cycles(start.pad)
    name = family.contacts[0]
    curves = []

    def keep(kind: Kind, over: Plane, points: Sequence[Cycle]) -> None:
        ends_loss = kind == "fold" or (kind != "grazing" and not family.last_beyond_torus)
        if points:
            stored = tuple(map(boundary_point, points))
            curves.append(BoundaryCurve(name, ends_loss, kind, over, stored))

    above = boundary_along(cycles, start, LOG_ZETA, 1.0)
    below = boundary_along(cycles, start, LOG_ZETA, -1.0)
    if below is None and family.mu is not None:
        below = boundary_along(cycles, start, MU, -1.0)
    for found in (above, below):
        if found is not None:
            over_a, over_mu = both_planes(cycles, found, float(scene.pad.mu))
            keep(found.kind, "a", over_a)
            keep(found.kind, "mu", over_mu)
    for sign in (1.0, -1.0):
        grazing = grazing_along_zeta(cycles, start, sign) if family.mu is None else None
        if grazing is not None:
            both = cycles.grazing(grazing.edge, grazing.touches)

            def graze(both: tuple[Condition, Condition] = both) -> tuple[Condition, Condition]:
                return both

            critical = CRITICAL["grazing"]
            plane = [LOG_A, LOG_ZETA]
            keep("grazing", "a", trace(cycles, grazing.cycle, plane, graze, critical, True))
    return curves


def least_at(scene: Scene, a: float, zeta: float, norm: Norm) -> LeastDisturbance:
    """The least disturbance at a pair of dampings, and the share of the box."""
    pad = DampedContact.of(scene, a, zeta)
    found = [least_disturbance(pad, norm, seed) for seed in SEEDS]
    shortest = min((one for one in found if one), key=lambda one: one.norm, default=None)
    return LeastDisturbance(
        a=a,
        zeta=zeta,
        norm=norm,
        norms=tuple(None if one is None else _rounded([one.norm])[0] for one in found),
        disturbance=() if shortest is None else _rounded(shortest.disturbance),
        drawn=DRAWN,
        lasting=int(np.count_nonzero(lasts(pad, box(pad, 0)))),
    )


def compute(motion: str, scene: Scene) -> Stored:
    """All that is stored of a motion."""
    own = scene_of(motion, scene)
    curves = [curve for family in FAMILIES[motion] for curve in boundaries(own, family)]
    least = []
    contact_dampings, modal_dampings = LEAST_AT[motion]
    for a in contact_dampings:
        for zeta in modal_dampings:
            if DampedContact.of(own, a, zeta).growth < 0.0:
                norms: tuple[Norm, ...] = ("displacement", "energy")
                least += [
                    least_at(own, a, zeta, norm) for norm in (norms if a == ENERGY_A else norms[:1])
                ]
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
