"""What hammers and what loses contact, by one definition for both models, and how sure that is.

How the verdicts move with the least impulse of a blow and with the observation time; losses of
contact relative to the state of the sliding equilibrium; the same motions without rotation; up to
which height a pad on points is in permanent contact.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from squeal.article.cases import CASES, HISTORY_FIGURES
from squeal.article.claims.measures import Case, lost_share, measure
from squeal.article.claims.motions import LEVELS
from squeal.article.claims.rules import LEVEL, TOUCH, TURNS, hammering_cases, hammers
from squeal.article.identify.space import compression
from squeal.article.records import Record, Result
from squeal.article.studies._heyoka import has_heyoka
from squeal.article.studies._scenes import read_scenes
from squeal.article.studies.starts import measured_cases
from squeal.equilibrium import Equilibrium, sliding_equilibrium
from squeal.io.scene import Scene
from squeal.model.contact import FULL, NONE, State

WINDOWS = (1, 3, 10)  # observation times over that of the case
LOCKED = 1e8  # factor on the moment of inertia that stops rotation
KICKS = np.linspace(0.02, 3.0, 150)  # heights above the equilibrium, over the static compression
FINER = 20  # parts of a step between these, for the least height


class Motion(Record):
    """A case over one observation time.

    hammers: by the definition; turns: changes of the edge that is struck, by least impulse of a
    blow; leading, trailing: the heaviest blow on each edge over F_n T_1; vanishes: the lesser share
    of time without force at an edge; lost: share of time in which an edge is separated that touches
    in the sliding equilibrium; apart: share of time in which some edge is separated; separated:
    share of time in which both are.
    """

    hammers: bool
    turns: dict[str, int]
    leading: float
    trailing: float
    vanishes: float
    lost: float | None
    apart: float
    separated: float


class Hammering(Result):
    """motions: by case (b1-a) and observation time; hammering: the cases that hammer, by model, by
    least impulse and observation time ("0.05, 1"); equilibrium: the contact state of each sliding
    equilibrium; locked: the cases by model in which an edge loses its force without rotation;
    amplitude: by case of B1 the least height above the equilibrium, over the static compression,
    from which an edge separates within the longest time, to 0.001; reference: the same of the
    reference initial conditions; level, turns: of the definition."""

    motions: dict[str, dict[str, Motion]]
    hammering: dict[str, dict[str, tuple[str, ...]]]
    equilibrium: dict[str, str]
    locked: dict[str, tuple[str, ...]]
    amplitude: dict[str, float | None]
    reference: dict[str, float]
    mean_lost: dict[str, float]
    level: float = LEVEL
    turns: int = TURNS


def admissible_equilibrium(scene: Scene) -> Equilibrium | None:
    """The sliding equilibrium that the model means; None where there is none."""
    equilibrium, _ = sliding_equilibrium(scene.pad_model)
    if equilibrium is None or not equilibrium.admissible:
        return None
    return equilibrium


def equilibrium_contact(scene: Scene) -> State | None:
    """Contact state of the admissible equilibrium; None where there is none."""
    equilibrium = admissible_equilibrium(scene)
    return None if equilibrium is None else scene.pad_model.state_at(np.array(equilibrium.q))


def motion(case: Case, in_equilibrium: State | None) -> Motion:
    """The motion of a measured case, and the contact state of its equilibrium, None without one."""
    leading, trailing = case.heaviest
    return Motion(
        hammers=hammers(case).margin > 0.0,
        turns={str(level): n for level, n in zip(LEVELS, case.blows, strict=True)},
        leading=leading,
        trailing=trailing,
        vanishes=min(case.vanishes),
        lost=None if in_equilibrium is None else lost_share(case.shares, in_equilibrium),
        apart=lost_share(case.shares, FULL),
        separated=case.shares.get(NONE, 0.0),
    )


def _lose_contact(scene: Scene, equilibrium: Equilibrium, heights: np.ndarray) -> list[bool]:
    """Whether an edge separates within the longest time, from rest at heights (n,) above the
    equilibrium, over the static compression."""
    starts = np.tile([*equilibrium.q, 0.0, 0.0, 0.0], (len(heights), 1))
    starts[:, 1] += heights * compression(scene.pad)
    cases = measured_cases(scene, starts, WINDOWS[-1])
    return [case is None or bool(case.losses) for case in cases]


def least_height(scene: Scene) -> float | None:
    """The least height above the equilibrium from which contact is lost, see `Hammering.amplitude`.

    The heights of `KICKS` are tried first, then finer ones up to the first of them from which
    contact is lost. None where it is lost from none.
    """
    equilibrium, _ = sliding_equilibrium(scene.pad_model)
    assert equilibrium is not None
    lost = _lose_contact(scene, equilibrium, KICKS)
    if not any(lost):
        return None
    step = KICKS[0]  # `KICKS` begins one step above the equilibrium
    below = float(KICKS[lost.index(True)]) - step  # the last height without a loss
    finer = below + np.arange(1, FINER + 1) * step / FINER
    lost = _lose_contact(scene, equilibrium, finer)
    if not any(lost):  # the last height is that of `KICKS` but for rounding, which may decide
        return None
    return float(finer[lost.index(True)])


def reference_height(scene: Scene) -> float:
    """Height of the reference initial conditions above or below the equilibrium, over the static
    compression."""
    equilibrium, _ = sliding_equilibrium(scene.pad_model)
    assert equilibrium is not None
    return abs(scene.initial[1] - equilibrium.q[1]) / compression(scene.pad)


def mean_lost(motions: Mapping[str, Motion], model: str) -> float:
    """Mean of `lost` over the four cases of a model, 0 of a case without equilibrium."""
    motions_of_model = [m for name, m in motions.items() if name.startswith(model.lower())]
    return sum(m.lost or 0.0 for m in motions_of_model) / len(motions_of_model)


def locked_cases(scenes: Mapping[str, Scene]) -> dict[str, tuple[str, ...]]:
    """By model the cases in which an edge loses its force although rotation is stopped."""
    losing: dict[str, list[str]] = {"B1": [], "B2": []}
    for name, scene in scenes.items():
        case = measure(scene.replace(I=LOCKED * (scene.pad.I or 0.0)))
        if max(case.vanishes) > TOUCH:
            losing[scene.model].append(name[-1])
    return {model: tuple(cases) for model, cases in losing.items()}


def study(files: Sequence[Path]) -> Hammering:
    """The eight cases of models B1 and B2."""
    scenes = read_scenes(files, HISTORY_FIGURES)
    contact_states = {name: equilibrium_contact(scene) for name, scene in scenes.items()}
    motions: dict[str, dict[str, Motion]] = {name: {} for name in scenes}
    hammering = {}
    for windows in WINDOWS:
        cases = {}
        for name, scene in scenes.items():
            longer = dataclasses.replace(scene, stop=windows * (scene.stop or 0.0))
            cases[name] = measure(longer)
            motions[name][str(windows)] = motion(cases[name], contact_states[name])
        for level in LEVELS:
            hammering[f"{level}, {windows}"] = hammering_cases(cases, level)
    equilibrium = {}
    for name, state in contact_states.items():
        equilibrium[name] = "none"
        if state is not None:
            equilibrium[name] = scenes[name].pad_model.state_name(state)
    has_batches = has_heyoka()  # without them hundreds of motions take too long
    b1 = {name: scene for name, scene in scenes.items() if scene.model == "B1"}
    # over one observation time
    first = {name: by_windows["1"] for name, by_windows in motions.items()}
    return Hammering(
        motions=motions,
        hammering=hammering,
        equilibrium=equilibrium,
        locked=locked_cases(scenes),
        amplitude={
            name: least_height(scene) if has_batches else None for name, scene in b1.items()
        },
        reference={name: reference_height(scene) for name, scene in b1.items()},
        mean_lost={model: mean_lost(first, model) for model in ("B1", "B2")},
    )


def heights_between(amplitude: Mapping[str, float | None], low: str, high: str) -> bool:
    """Whether two cases have the least and the greatest height; true where all were left out."""
    heights = {name: value for name, value in amplitude.items() if value is not None}
    if not heights:
        return True
    is_least = min(heights.values()) == heights.get(low)
    return is_least and max(heights.values()) == heights.get(high)


def sentences(record: Hammering) -> Mapping[str, bool]:
    """What the paper says of these motions."""
    # the cases that hammer, by model: by least impulse of a blow and observation time ("0.2, 10"),
    # and by observation time at the reference impulse
    by_level_and_time = record.hammering
    by_time = {windows: by_level_and_time[f"{LEVEL}, {windows}"] for windows in WINDOWS}
    # over one observation time
    first = {name: by_windows["1"] for name, by_windows in record.motions.items()}
    lost = {name: motion.lost or 0.0 for name, motion in first.items()}
    # on points some edge separates; the line separates as a whole
    points_separated = {name for name in first if name[:2] == "b1" and first[name].apart > 0.0}
    line_separated = {name for name in first if name[:2] == "b2" and first[name].separated > 0.0}
    hammering_strongly = [by_level_and_time[f"0.5, {windows}"]["B1"] for windows in WINDOWS]
    return {
        "points-separate-in-all-cases-the-line-in-c": len(points_separated) == len(CASES)
        and line_separated == {"b2-c"},
        "b2-only-c-hammers": all(cases["B2"] == ("c",) for cases in by_time.values()),
        "b1-hammers-in-c-and-d": by_time[1]["B1"] == ("c", "d"),
        "b1-hammers-by-level-and-time": by_level_and_time["0.2, 10"]["B1"] == ("c", "d")
        and not by_level_and_time["0.2, 1"]["B1"]
        and not any(hammering_strongly),
        "b2-c-at-every-level": all("c" in cases["B2"] for cases in by_level_and_time.values()),
        "b1-loses-more": record.mean_lost["B1"] > record.mean_lost["B2"],
        "the-line-loses-more-in-c": (lost["b2-c"] > lost["b1-c"] + 0.05)
        and abs(lost["b2-d"] - lost["b1-d"]) < 0.01
        and all(lost[f"b1-{case}"] > lost[f"b2-{case}"] + 0.2 for case in "ab"),
        "no-separation-without-rotation": record.locked == {"B1": ("c", "d"), "B2": ()},
        "light-blows-in-b1-a": record.motions["b1-a"]["1"].leading < record.level,
        "least-heights-from-b-to-a": heights_between(record.amplitude, "b1-b", "b1-a"),
        "b1-b-leading-edge-never-separates": record.motions["b1-b"]["1"].vanishes == 0.0,
    }
