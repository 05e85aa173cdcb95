"""Numbers of the modes of a sweep, which each mode keeps along the parameter."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from squeal.linear.continuation import SpectrumAtParameter
from squeal.linear.paths import Indices, Loss, mode_numbers, mode_numbers_at, track_modes
from squeal.results.sweep import Step

MANY = 10**6
"""At so many values between those of a sweep roots may be computed."""


def assign_mode_numbers(
    steps: Sequence[Step],
    at: Callable[[float], SpectrumAtParameter] | None,
    own_value: float,
    spare: int = MANY,
) -> tuple[list[Step], tuple[Loss, ...], Step]:
    """Number the modes of a sweep, so that each mode has one number at all values.

    Numbers are those by rising frequency at the reference value: the subject's own value if the
    sweep has it, else the first one. Modes that are not there follow as they appear.

    Parameters
    ----------
    steps : sequence of Step
        The sweep, by rising value.
    at : callable or None
        The roots at a value, which are followed between the steps; None of a single step.
    own_value : float
        The subject's own value of the parameter.
    spare : int
        At how many values between the steps `at` may be evaluated.

    Returns
    -------
    numbered : list of Step
        The steps with the numbers (m,) of their modes, 0 where one is not known.
    losses : tuple of Loss
        Where it is not known which mode is which.
    reference : Step
        The step at the reference value.
    """
    if at is None:
        paths = [mode_numbers(np.asarray(step.roots)) for step in steps]
        losses: list[Loss] = []
    else:
        tracked, losses = track_modes(at, [step.value for step in steps], spare)
        paths = []
        for step, numbers in zip(steps, tracked, strict=True):
            paths.append(mode_numbers_at(at(step.value), numbers, np.asarray(step.roots)))
    reference = 0
    for k, step in enumerate(steps):
        if step.value == own_value:
            reference = k
            break
    number_of = _number_of_paths(paths, reference, steps[reference])
    numbered = []
    for step, paths_of_step in zip(steps, paths, strict=True):
        modes = [number_of.get(path, 0) for path in paths_of_step.tolist()]
        numbered.append(replace(step, modes=np.array(modes, dtype=int)))
    losses_by_number = []
    for loss in losses:
        modes = sorted(number_of[path] for path in loss.modes if path in number_of)
        fewest = 2 if loss.kind == "meet" else 1
        if len(modes) >= fewest:
            losses_by_number.append(loss._replace(modes=tuple(modes)))
    return numbered, tuple(losses_by_number), numbered[reference]


def _number_of_paths(paths: Sequence[Indices], reference: int, step: Step) -> dict[int, int]:
    """The number of the mode of each eigenvalue path.

    Parameters
    ----------
    paths : sequence of array of int (m,)
        Of each step the paths of its roots, 0 where one is not known.
    reference : int
        The index of the step whose modes are numbered by rising frequency; others follow as they
        appear.
    step : Step
        That step.
    """
    number_of: dict[int, int] = {}
    if step.roots is not None:  # else the branch does not reach its value
        by_frequency = mode_numbers(step.roots).tolist()
        for path, number in zip(paths[reference].tolist(), by_frequency, strict=True):
            if path:
                number_of.setdefault(path, number)
    highest = max(number_of.values(), default=0)
    for paths_of_step in paths:
        for path in paths_of_step.tolist():
            if path and path not in number_of:
                highest += 1
                number_of[path] = highest
    return number_of
