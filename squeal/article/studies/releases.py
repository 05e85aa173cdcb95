"""Points and line released alike: how long they lose contact, from the same share of their load.

The reference initial conditions load the points with 0.02 F_n and the line with 2.15 F_n, so that
their losses of contact are those of unlike starts. Here both models are released at rest from the
pose of their sliding equilibrium, moved vertically until full contact would carry a given multiple
of the equilibrium's reaction.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import numpy as np

from squeal.article.cases import CASES, HISTORY_FIGURES, stem
from squeal.article.claims.measures import measure
from squeal.article.identify.space import MODELS, contact_stiffness
from squeal.article.records import Record, Result
from squeal.article.studies._scenes import REFERENCE, by_set, read_scenes
from squeal.article.studies.hammering import (
    Motion,
    admissible_equilibrium,
    equilibrium_contact,
    motion,
)
from squeal.equilibrium import Equilibrium
from squeal.io.scene import Scene
from squeal.model.contact import NONE

LOADS = (0.02, 0.5, 1.2, 2.0)
"""Contact force at the release over the reaction of the sliding equilibrium."""
CASE = "a"  # whose initial position is that of every case
DIFFERENT = 0.01  # least difference of two shares of time that are called unlike
Share = Annotated[float, ".0%"]


def percent(load: float) -> str:
    """The key of a load: its percentage, since keys in the text hold no dots."""
    return f"{100 * load:.0f}"


class Release(Record):
    """Both models from one load, as means over the cases in which both have an equilibrium.

    points, line: share of time in which an edge is separated that touches in the equilibrium;
    points_any, line_any: in which some edge is.
    """

    points: Share
    line: Share
    points_any: Share
    line_any: Share


class ReleasedSet(Record):
    """A parameter set: cases: in which both models have a sliding equilibrium; start: by model the
    contact force of the reference initial conditions over F_n; loads: a release by load in per
    cent."""

    cases: tuple[str, ...]
    start: dict[str, float]
    loads: dict[str, Release]


class Releases(Result):
    """By name of the parameter set; observed over one observation time of each case."""

    sets: dict[str, ReleasedSet]


def released(scene: Scene, equilibrium: Equilibrium, load: float) -> Scene:
    """The scene from rest at (1 - load) R_n/k above its equilibrium, k of full contact."""
    x, y, theta = equilibrium.q
    height = (1.0 - load) * equilibrium.R_n / contact_stiffness(scene.pad)
    return dataclasses.replace(scene, initial=(x, y + height, theta, 0.0, 0.0, 0.0), start="origin")


def start_force(scene: Scene) -> float:
    """Contact force of a scene's initial position over F_n."""
    model = scene.pad_model
    q = np.array(scene.initial[:3])
    # the vertical load that is missing where nothing touches
    force = model.loads(q, model.state_at(q))[1] - model.loads(q, NONE)[1]
    assert scene.pad.F_n is not None
    return float(force) / scene.pad.F_n


def released_set(scenes: Mapping[str, Scene]) -> ReleasedSet:
    """Both models of a parameter set, released from each of `LOADS`; scenes: its eight, by name."""
    equilibria: dict[str, Equilibrium] = {}
    for name, scene in scenes.items():
        equilibrium = admissible_equilibrium(scene)
        if equilibrium is not None:
            equilibria[name] = equilibrium
    cases = [case for case in CASES if all(stem(model, case) in equilibria for model in MODELS)]

    def motions(model: str, load: float) -> list[Motion]:
        """The motions of a model released from a load, one for each of `cases`."""
        motions_of_cases = []
        for name in [stem(model, case) for case in cases]:
            start = released(scenes[name], equilibria[name], load)
            motions_of_cases.append(motion(measure(start), equilibrium_contact(scenes[name])))
        return motions_of_cases

    loads = {}
    for load in LOADS:
        points = motions("B1", load)
        line = motions("B2", load)
        loads[percent(load)] = Release(
            points=float(np.mean([m.lost for m in points])),
            line=float(np.mean([m.lost for m in line])),
            points_any=float(np.mean([m.apart for m in points])),
            line_any=float(np.mean([m.apart for m in line])),
        )
    return ReleasedSet(
        cases=tuple(cases),
        start={model: start_force(scenes[stem(model, CASE)]) for model in MODELS},
        loads=loads,
    )


def study(files: Sequence[Path]) -> Releases:
    """The sets in the folders of the scene files."""
    sets = {}
    for name, files_of_set in by_set(files).items():
        sets[name] = released_set(read_scenes(files_of_set, HISTORY_FIGURES))
    return Releases(sets=sets)


def longer(release: Release) -> str:
    """Which model loses contact longer: points, line, or neither by as much as `DIFFERENT`."""
    if abs(release.points - release.line) < DIFFERENT:
        return "neither"
    return "points" if release.points > release.line else "line"


def sentences(record: Releases) -> Mapping[str, bool]:
    """What the paper says of these releases."""
    order = {}  # by set, which model loses contact longer from each of `LOADS`
    for name, of_set in record.sets.items():
        order[name] = [longer(of_set.loads[percent(load)]) for load in LOADS]
    first = record.sets[REFERENCE]
    line_in_set_3 = [LOADS[i] for i, model in enumerate(order["set-3"]) if model == "line"]
    return {
        "reference-starts-are-unlike": first.start["B1"] < 0.05 and first.start["B2"] > 2.0,
        "released-alike-the-order-depends-on-the-load": order[REFERENCE]
        == ["points", "line", "line", "points"],
        "released-alike-the-line-loses-longer-in-set-2": set(order["set-2"]) == {"line"},
        "released-alike-set-3-turns-at-half-the-load": line_in_set_3 == [0.5],
        "released-alike-points-lose-longer-in-set-4": set(order["set-4"]) == {"points"},
        "points-released-near-their-load-lose-no-contact": first.loads["120"].points == 0.0,
    }
