"""What becomes of the article's scenes from other starts: maps over height and tilt.

The starts are at rest on a plane through the sliding equilibrium and the scene's own start. Maps of
longer times have fewer points.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from squeal.article.cases import HISTORY_FIGURES
from squeal.article.claims import case_of
from squeal.article.claims.motions import measures
from squeal.article.claims.rules import TOUCH, hammers
from squeal.article.records import Missing
from squeal.article.results.starts import (
    KINDS,
    TOLERANCE,
    TURNS,
    Map,
    SceneStarts,
    Starts,
    Swinging,
)
from squeal.article.studies._scenes import alike, read_scenes
from squeal.equilibrium import sliding_equilibrium
from squeal.io.provenance import NOT_INSTALLED, WITHOUT_HEYOKA, version
from squeal.io.scene import Scene
from squeal.model.states import FULL, NONE, State
from squeal.simulation.ensemble import DONE, simulate_many, simulate_starts, stack

WINDOWS = {1: 11, 10: 11, 100: 5}
"""Times in that of the scene, and points a side of their maps."""
REACH = 1.25
_SEPARATION, _ALTERNATE, _NEVER, _ENDED = range(2, len(KINDS))


def plane(scene: Scene, equilibrium: np.ndarray, s: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Starts (n, 6) at rest: the equilibrium (3,) at s = t = 0, the scene's start at s = 1."""
    own = np.array(scene.initial)
    rest = np.append(equilibrium, np.zeros(3))
    starts = rest + s[:, None] * (own - rest)
    starts[:, 2] += t * lever(scene) / scene.pad.w
    return starts


def lever(scene: Scene) -> float:
    """Static compression (m) of the contact under the brake force."""
    model = scene.pad_model
    assert scene.pad.F_n is not None
    return scene.pad.F_n / sum(getattr(scene.pad, name) for name in model.law.parameters)


def kind(first: State, points: np.ndarray) -> int:
    """The kind of a motion that begins in contact `first`, from the edges of its changes in order.

    What is lost counts from the first full contact on, or from the start if there is none.
    """
    turned = np.cumsum(np.arange(2) == points[:, None], axis=0)
    states = np.vstack([first, (first + turned) % 2 == 1])
    full = states.all(axis=1)
    states = states[np.argmax(full) :]  # from the start on, if none is full contact
    before, after = states[:-1], states[1:]
    _, lost = np.nonzero(before & ~after)
    if np.count_nonzero(np.diff(lost)) >= TURNS:
        return _ALTERNATE
    if not lost.size:
        return 0 if full.any() else _NEVER
    return _SEPARATION if np.any(before.any(axis=1) & ~after.any(axis=1)) else 1


class Asked(NamedTuple):
    """Starts (n, 6) of a scene, and after which times, in its own, their motions are looked at."""

    scene: Scene
    starts: np.ndarray
    windows: Sequence[int]


def kinds(planes: Sequence[Asked]) -> list[np.ndarray]:
    """Kinds (times, n) of the motions of each, of scenes of one model and formulation: all in one
    batch, since wide ones cost less."""
    if not planes:
        return []
    one = planes[0].scene
    pads = stack([plane.scene.pad for plane in planes for _ in plane.starts])
    stops = [max(plane.windows) * (plane.scene.stop or 0.0) for plane in planes]
    each = np.repeat(stops, [len(plane.starts) for plane in planes])
    starts = np.concatenate([plane.starts for plane in planes])
    many = simulate_many(one.model, pads, starts, each, TOLERANCE, one.formulation, events=True)
    motions = zip(many["events"], many["outcome"] == DONE, many["ended"], strict=True)
    return [_kinds(plane, motions) for plane in planes]


def _kinds(plane: Asked, motions: Iterator[tuple[np.ndarray, bool, float]]) -> np.ndarray:
    """Kinds (times, n); motions: contact changes, whether it is whole, and its end, of its own and
    then of others."""
    found = np.zeros((len(plane.windows), len(plane.starts)), dtype=int)
    for i, start in enumerate(plane.starts):
        changes, whole, end = next(motions)
        t, points = changes.T
        first = plane.scene.pad_model.state_at(start[:3])
        for j, window in enumerate(plane.windows):
            until = window * (plane.scene.stop or 0.0)
            ended = not whole and not end > until
            found[j, i] = _ENDED if ended else kind(first, points[t <= until])
    return found


def swinging(scene: Scene, starts: np.ndarray) -> Swinging:
    """How many starts (n, 6) of a scene of B2 hammer by the way of delta, and touch all the time.

    The time is that of the scene. A motion that leaves the model does not count.
    """
    assert scene.stop is not None
    found = simulate_starts(scene, starts, scene.stop, TOLERANCE, measure=measures)
    cases = [case_of(found, int(i)) for i in np.flatnonzero(found["outcome"] == DONE)]
    beating = [case.shares for case in cases if hammers(case).margin > 0.0]
    full = sum(shares.get(FULL, 0.0) >= 1.0 - TOUCH for shares in beating)
    touching = sum(shares.get(NONE, 0.0) <= TOUCH for shares in beating)
    return Swinging(len(starts), len(beating), full, touching)


def grid(side: int) -> tuple[np.ndarray, np.ndarray]:
    """Heights and tilts (side^2,) of a map, the tilts in rows."""
    axis = REACH * (2.0 * np.arange(side) + 1.0 - side) / side
    t, s = np.meshgrid(axis, axis, indexing="ij")
    return s.ravel(), t.ravel()


def maps(scenes: Mapping[str, Scene], sides: dict[int, int]) -> dict[str, SceneStarts | Missing]:
    """The maps of scenes of one model and formulation, with so many points a side for each time."""
    rests = {name: sliding_equilibrium(scene.pad_model) for name, scene in scenes.items()}
    places = {name: np.array(rest.q) for name, (rest, _) in rests.items() if rest is not None}
    asked = {
        (name, side): Asked(
            scenes[name],
            plane(scenes[name], rest, *map(np.append, grid(side), (1.0, 0.0))),  # the own one last
            [window for window, n in sides.items() if n == side],
        )
        for name, rest in places.items()
        for side in dict.fromkeys(sides.values())
    }
    made: dict[str, tuple[Map, ...]] = dict.fromkeys(places, ())
    for (name, side), one, found in zip(
        asked, asked.values(), kinds(list(asked.values())), strict=True
    ):
        made[name] += tuple(
            _map(window, codes, side) for window, codes in zip(one.windows, found, strict=True)
        )
    fine = grid(next(iter(sides.values())))
    return {
        name: SceneStarts(
            float(scene.initial[1] - places[name][1]),
            lever(scene),
            made[name],
            swinging(scene, plane(scene, places[name], *fine)) if scene.model == "B2" else None,
        )
        if name in places
        else Missing(rests[name][1])
        for name, scene in scenes.items()
    }


def _map(window: int, codes: np.ndarray, side: int) -> Map:
    """A map from its kinds (side^2 + 1,), the last one that of the own start."""
    rows = tuple("".join(map(str, row)) for row in codes[:-1].reshape(side, side).tolist())
    s, t = grid(side)
    beside = codes[:-1][(s != 0.0) | (t != 0.0)]
    share = {name: float(np.mean(beside == i)) for i, name in enumerate(KINDS)}
    return Map(window, rows, int(codes[-1]), len(beside), share)


def study(files: Sequence[Path]) -> Starts:
    """The maps of the eight scenes of models B1 and B2."""
    scenes = read_scenes(files, HISTORY_FIGURES, "simulate")
    if version("heyoka") == NOT_INSTALLED:
        why = Missing(f"{WITHOUT_HEYOKA} nothing else simulates batches of pads.")
        return Starts(scenes=dict.fromkeys(scenes, why), reach=REACH)
    made = {name: one for some in alike(scenes) for name, one in maps(some, WINDOWS).items()}
    return Starts(scenes={name: made[name] for name in scenes}, reach=REACH)
