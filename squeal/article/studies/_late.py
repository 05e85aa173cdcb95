"""Scenes after a long time with damping, from their own starts and from a grid of others."""

from collections.abc import Mapping
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from squeal.analysis.eigenvalues import analyse
from squeal.article.records import Missing
from squeal.article.results.onset import Late, Others, Settled
from squeal.article.studies._damped import Motion, damped, looked_at, many, settled, window
from squeal.article.studies.starts import grid, lever, plane
from squeal.equilibrium import sliding_equilibrium
from squeal.equilibrium.damping import damped_model
from squeal.errors import ComputationError
from squeal.io.scene import Scene
from squeal.simulation.ensemble import DONE

RATIOS = (0.001, 0.005, 0.01, 0.02)
LATE, SEEN = 40, 2  # windows until a motion is looked at, and for how long
LONGER = 150  # until it is looked at again if contact goes on changing
EARLY = (1, 3, 10)  # windows from the start: ends of the spans that are looked at first
SIDE, WIDER = 5, 3.0  # starts a side of the grid, and its reach over that of the maps of starts
MOVING = 75  # starts in motion, beside an equilibrium that is not unstable
SEED = 0  # of numpy's generator that draws them


class Own(NamedTuple):
    """A scene: its own start and other ones at each of `RATIOS`, and the states (6,) of the own one
    and of the liveliest after the long time."""

    rows: tuple[Late | Missing, ...]
    states: list[np.ndarray]
    others: tuple[Others, ...]
    liveliest: list[np.ndarray]


class _Lane(NamedTuple):
    """A motion: its scene, damping ratio and start, 0 for the own one."""

    name: str
    ratio: float
    start: int


def starts(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """The own start and those of the grid, (n, 6), and those in motion, (MOVING, 6)."""
    own = np.array([scene.initial])
    rest, _ = sliding_equilibrium(scene.pad_model)
    if rest is None:
        return own, np.empty((0, 6))
    s, t = grid(SIDE)
    at = np.array(rest.q)
    return np.concatenate([own, plane(scene, at, WIDER * s, WIDER * t)]), moving(scene, at)


def moving(scene: Scene, equilibrium: np.ndarray) -> np.ndarray:
    """Starts (MOVING, 6) drawn about the equilibrium (3,).

    Along each axis, and by the tilt at an edge, they are up to `WIDER` static compressions of the
    contact off, and as fast as a mass on spring 1 that swings so far.
    """
    reach = WIDER * lever(scene) * np.array([1.0, 1.0, 1.0 / scene.pad.w])
    reach = np.append(reach, reach * np.sqrt(scene.pad.k1 / scene.pad.m))
    drawn = np.random.default_rng(SEED).uniform(-1.0, 1.0, (MOVING, 6))
    return np.append(equilibrium, np.zeros(3)) + reach * drawn


def grown(scene: Scene, ratio: float) -> float | None:
    """Greatest real part of the eigenvalues about the equilibrium, 1/ms."""
    try:
        return analyse(damped(scene, ratio)).spectrum.dominant.value.real / 1e3
    except ComputationError:
        return None


def late(scenes: Mapping[str, Scene]) -> dict[str, Own]:
    """What scenes of one model and formulation come to."""
    motions: dict[_Lane, Motion] = {}
    growth: dict[tuple[str, float], float | None] = {}
    made: dict[str, Own] = {}
    for name, scene in scenes.items():
        try:
            models = {ratio: damped_model(damped(scene, ratio)) for ratio in RATIOS}
        except ComputationError as error:
            gone = [np.full(6, np.nan)] * len(RATIOS)
            made[name] = Own((Missing(str(error)),) * len(RATIOS), gone, (), gone)
            continue
        begun, moved = starts(scene)
        for ratio, model in models.items():
            growth[name, ratio] = rate = grown(scene, ratio)
            some = begun if (rate or 0.0) > 0.0 else np.concatenate([begun, moved])
            motions |= {_Lane(name, ratio, i): Motion(model, q) for i, q in enumerate(some)}
    if not motions:
        return made
    stop = window(scenes)
    ends, found = _after(motions, growth, stop)
    early = _early({lane: motions[lane] for lane in motions if not lane.start}, stop)
    for name in [name for name in scenes if name not in made]:
        rows, others, lively = [], [], []
        for ratio in RATIOS:
            mine = {lane: found[lane] for lane in found if lane[:2] == (name, ratio)}
            own, *rest = mine.values()
            on = {
                lane: one
                for lane, one in mine.items()
                if one and one.goes_on and (one.slides or not lane.start)
            }
            best = max(on, key=lambda lane: _liveliness(on[lane]), default=None)
            lively.append(np.full(6, np.nan) if best is None else ends[best])
            going = [one for lane, one in on.items() if lane.start]
            others.append(
                Others(
                    ratio=ratio,
                    early=early[name, ratio],
                    starts=len(rest),
                    ends=sum(one is None or not one.slides for one in rest),
                    lasting=len(going),
                    hammer=sum(one.hammers for one in going),
                    edges=sum(one.edges for one in going),
                    liveliest=None if best is None else on[best],
                    growth=growth[name, ratio],
                )
            )
            rows.append(
                Missing("the model ends")
                if own is None
                else Late.of(own, ratio=ratio, growth=growth[name, ratio] if own.goes_on else None)
            )
        states = [ends[_Lane(name, ratio, 0)] for ratio in RATIOS]
        made[name] = Own(tuple(rows), states, tuple(others), lively)
    return made


def _liveliness(one: Settled) -> tuple[bool, int, int]:
    return one.slides, one.hammers + one.edges, one.turns


_KEPT = Settled(0.0, 0.0, False, False, 0, None, None, None)


def _after(
    motions: dict[_Lane, Motion], growth: dict[tuple[str, float], float | None], stop: float
) -> tuple[dict[_Lane, np.ndarray], dict[_Lane, Settled | None]]:
    """States (6,), and what own starts come to, and other ones whose contact has changed not long
    before `LATE`; all others have come to keep theirs. Beside an unstable equilibrium other starts
    cannot come to rest and are not looked at again."""
    run = many(list(motions.values()), LATE * stop)
    ends = dict(zip(motions, run["final"], strict=True))
    found: dict[_Lane, Settled | None] = {}
    seen = {}
    for lane, outcome, events in zip(motions, run["outcome"], run["events"], strict=True):
        found[lane] = _KEPT if outcome == DONE else None
        recent = len(events) and events[-1, 0] > (LATE - SEEN) * stop
        if outcome == DONE and (recent or not lane.start):
            seen[lane] = motions[lane]._replace(state=ends[lane])
    for before in (0, LONGER - LATE - SEEN):
        after = settled(list(seen.values()), before * stop, SEEN * stop)
        for lane, end, one in zip(seen, *after, strict=True):
            ends[lane], found[lane] = end, one
        on = [lane for lane in seen if (one := found[lane]) and one.goes_on]
        seen = {
            lane: motions[lane]._replace(state=ends[lane])
            for lane in on
            if not lane.start or (growth[lane[:2]] or 0.0) <= 0.0
        }
    return ends, found


def _early(
    own: dict[_Lane, Motion], stop: float
) -> dict[tuple[str, float], tuple[Settled | None, ...]]:
    """What own starts do from one of the times `EARLY` to the next, each span by itself."""
    found: dict[_Lane, list[Settled | None]] = {lane: [] for lane in own}
    for begin, end in pairwise((0, *EARLY)):
        states, seen = looked_at(list(own.values()), (end - begin) * stop)
        for lane, one in zip(own, seen, strict=True):
            found[lane].append(one)
        own = {
            lane: motion._replace(state=state)
            for (lane, motion), state, one in zip(own.items(), states, seen, strict=True)
            if one
        }
    return {lane[:2]: (*row, *[None] * (len(EARLY) - len(row))) for lane, row in found.items()}
