"""Mode numbers of a sweep: each mode has one number at all values of the parameter."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from squeal.linear.continuation import SpectrumAtParameter
from squeal.linear.paths import Indices, Loss, mode_numbers, mode_numbers_at, track_modes
from squeal.results.sweep import Step

MANY = 10**6
"""At so many values between those of a sweep roots may be computed if none is expensive."""


class NumberedModes(NamedTuple):
    """The steps of a sweep, in which each mode has one number at all values.

    Attributes
    ----------
    steps : tuple of Step
        The steps with the numbers (m,) of their modes, 0 where one is not known.
    losses : tuple of Loss
        Where it is not known which mode is which.
    reference : Step
        The step at which modes are numbered by rising frequency: that at the subject's own value of
        the parameter if the sweep has it, else that at the lowest value.
    """

    steps: tuple[Step, ...]
    losses: tuple[Loss, ...]
    reference: Step


def assign_mode_numbers(
    steps: Sequence[Step],
    at: Callable[[float], SpectrumAtParameter] | None,
    own_value: float,
    values_between: int = MANY,
) -> NumberedModes:
    """Number the modes of a sweep, so that each mode has one number at all values.

    Modes are tracked along eigenvalue paths, by the vectors and derivatives of the roots. They are
    numbered by rising frequency at the reference value; modes that do not occur there have the next
    numbers as they appear.

    Parameters
    ----------
    steps : sequence of Step
        The sweep, by rising value.
    at : callable or None
        Gives the roots with their vectors at a value, also between the steps; None of a single
        step.
    own_value : float
        The subject's own value of the parameter.
    values_between : int
        At how many values between the steps `at` may be evaluated.
    """
    # of each step the number of the eigenvalue path of each of its roots (m,)
    paths: list[Indices] = []
    losses: list[Loss] = []
    if at is None:
        for step in steps:
            paths.append(mode_numbers(np.asarray(step.roots)))
    else:
        tracked, losses = track_modes(at, [step.value for step in steps], values_between)
        for step, numbers in zip(steps, tracked, strict=True):
            # the listed roots of a step are some of those that `at` gives, in another order
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
    for loss in losses:  # of paths without a listed root nothing is lost
        modes = sorted(number_of[path] for path in loss.modes if path in number_of)
        fewest = 2 if loss.kind == "meet" else 1
        if len(modes) >= fewest:
            losses_by_number.append(loss._replace(modes=tuple(modes)))
    return NumberedModes(tuple(numbered), tuple(losses_by_number), numbered[reference])


def _number_of_paths(paths: Sequence[Indices], reference: int, step: Step) -> dict[int, int]:
    """The number of the mode of each eigenvalue path, by the number of the path.

    Parameters
    ----------
    paths : sequence of array of int (m,)
        Of each step the number of the path of each root, 0 where one is not known.
    reference : int
        The index of the step whose modes are numbered by rising frequency; others follow as they
        appear.
    step : Step
        That step.
    """
    number_of: dict[int, int] = {}
    if step.roots is not None:  # None where the branch of equilibria does not reach its value
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
