"""Numbers of the modes of a sweep, which each mode keeps along the parameter."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from squeal.linear.continuation import SpectrumAtParameter
from squeal.linear.paths import Loss, mode_numbers, mode_numbers_at, track_modes
from squeal.results.sweep import Step

MANY = 10**6  # values at which roots may be looked at between those of a sweep


def assign_mode_numbers(
    steps: Sequence[Step],
    at: Callable[[float], SpectrumAtParameter] | None,
    own_value: float,
    spare: int = MANY,
) -> tuple[list[Step], tuple[Loss, ...], Step]:
    """Rows of a sweep by rising value, whose modes (m,) have their numbers: those by frequency at
    the own value, else at the first, then others as they appear. And the losses, and the row of
    that value. at: the roots that are followed, at up to `spare` values more, None of one row."""
    paths = [mode_numbers(np.asarray(step.roots)) for step in steps]
    losses: list[Loss] = []
    if at is not None:
        followed, losses = track_modes(at, [step.value for step in steps], spare)
        paths = [
            mode_numbers_at(at(step.value), numbers, np.asarray(step.roots))
            for step, numbers in zip(steps, followed, strict=True)
        ]
    reference = 0
    for k, step in enumerate(steps):
        if step.value == own_value:
            reference = k
            break
    number_of: dict[int, int] = {}
    for path, number in zip(
        paths[reference].tolist(), _by_frequency(steps[reference]), strict=True
    ):
        if path:
            number_of.setdefault(path, number)
    highest = max(number_of.values(), default=0)
    for paths_of_step in paths:
        for path in paths_of_step.tolist():
            if path and path not in number_of:
                highest += 1
                number_of[path] = highest
    numbered = []
    for step, paths_of_step in zip(steps, paths, strict=True):
        modes = [number_of.get(path, 0) for path in paths_of_step.tolist()]
        numbered.append(replace(step, modes=np.array(modes, dtype=int)))
    kept = []
    for loss in losses:
        modes = sorted(number_of[path] for path in loss.modes if path in number_of)
        fewest = 2 if loss.kind == "meet" else 1
        if len(modes) >= fewest:
            kept.append(loss._replace(modes=tuple(modes)))
    return numbered, tuple(kept), numbered[reference]


def _by_frequency(step: Step) -> list[int]:
    """The number of each root's mode by rising frequency; none where the branch does not reach."""
    return [] if step.roots is None else mode_numbers(step.roots).tolist()
