"""Damped motions after a long time: what they have settled to."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from squeal.article.claims.measures import Case, case_of
from squeal.article.claims.motions import measures
from squeal.article.claims.rules import by_turns, hammers
from squeal.article.results.onset import TOLERANCE, Settled
from squeal.article.studies._neighbours import damping_of
from squeal.io.scene import Damping, Scene
from squeal.model.equations import PadModel
from squeal.simulation.ensemble import DONE, simulate_many, stack

RATIO = 0.005


def damped(scene: Scene, ratio: float) -> Scene:
    """The scene with all modal damping ratios alike."""
    return dataclasses.replace(scene, damping=Damping(ratios=(ratio,) * 3) if ratio else None)


class Motion(NamedTuple):
    """A motion of a batch: its pad with damping, and the state (6,) it is in (SI)."""

    model: PadModel
    state: np.ndarray


def many(motions: Sequence[Motion], stop: float | np.ndarray, measured: bool = False) -> Any:
    """Motions of one model and formulation, with the times of their contact changes."""
    models, one = [each.model for each in motions], motions[0].model
    pads, starts = stack([model.pad for model in models]), np.array([m.state for m in motions])
    how: Any = {"measure": measures} if measured else {"events": True}
    how["damping"] = damping_of(models)
    return simulate_many(one.name, pads, starts, stop, TOLERANCE, one.formulation, **how)


def _settled(case: Case, changes: int, lost: float, line: bool) -> Settled:
    edges = changes > 0 and by_turns(case) > 0.0
    turns = sum(a != b for a, b in zip(case.losses, case.losses[1:], strict=False))
    # a pad that is off the surface all the time has no peak and no place of the reaction
    off = np.isnan(case.first.high)
    return Settled(
        lost=1.0 if off else lost if changes else 0.0,
        peak=0.0 if off else case.first.high,
        hammers=changes > 0 and hammers(case).margin > 0.0 if line else edges,
        edges=edges,
        turns=case.swings if line else turns,
        low=case.second.low if line and not off else None,
        high=case.second.high if line and not off else None,
        face=None if np.isnan(case.face) else case.face,
    )


Found = tuple[list[np.ndarray], list[Settled | None]]


def looked_at(motions: Sequence[Motion], seen: float | np.ndarray) -> Found:
    """What motions do for a time `seen` (s), and the states (6,) then; None where the model ends.
    The motions are of one model and formulation."""
    if not motions:
        return [], []
    line = not motions[0].model.law.plotted[1].is_force
    run = many(motions, seen, True)
    found: list[Settled | None] = [None] * len(motions)
    for i in np.flatnonzero(run["outcome"] == DONE).tolist():
        case = case_of(run, i, motions[i].model.pad.V)
        lost = 1.0 - float(run["shares"][i, 0])
        found[i] = _settled(case, int(run["changes"][i]), lost, line)
    return list(run["final"]), found


def settled(motions: Sequence[Motion], before: float, seen: float) -> Found:
    """`looked_at` after a time `before` (s)."""
    first = many(motions, before)
    ends = list(first["final"])
    found: list[Settled | None] = [None] * len(motions)
    there = np.flatnonzero(first["outcome"] == DONE).tolist()
    after = looked_at([Motion(motions[i].model, ends[i]) for i in there], seen)
    for i, end, one in zip(there, *after, strict=True):
        ends[i], found[i] = end, one
    return ends, found


def window(scenes: Mapping[str, Scene]) -> float:
    """The window (s): the time of the scenes."""
    return max(scene.stop or 0.0 for scene in scenes.values())
