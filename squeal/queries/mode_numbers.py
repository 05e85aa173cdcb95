"""Numbers of the modes of a sweep, which each mode keeps along the parameter."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from squeal.linear.continuation import SpectrumAtParameter
from squeal.linear.paths import Indices, Loss, mode_numbers, mode_numbers_at, track_modes
from squeal.results.sweep import Step

MANY = 10**6
"""At so many values between those of a sweep roots may be computed."""


class NumberedSteps(NamedTuple):
    """The steps of a sweep with the numbers of their modes.

    steps: each with the numbers (m,) of the modes of its roots, 0 where one is not known; losses:
    the intervals of the parameter in which it is lost which mode is which; reference: the step by
    whose frequencies modes are numbered.
    """

    steps: list[Step]
    losses: tuple[Loss, ...]
    reference: Step


def assign_mode_numbers(
    steps: Sequence[Step],
    spectrum_at: Callable[[float], SpectrumAtParameter] | None,
    numbered_at: float,
    most_between: int = MANY,
) -> NumberedSteps:
    """Number the modes of a sweep, so that each mode has one number at all values.

    The modes are followed from step to step as eigenvalue paths. A path then has the number that
    its root has by rising frequency in the reference step. Paths without a root in that step get
    the next numbers as they appear.

    Parameters
    ----------
    steps : sequence of Step
        The sweep, by rising value; each has roots.
    spectrum_at : callable or None
        The spectrum at a value, to follow the roots between the steps; None for a sweep of one
        step.
    numbered_at : float
        The value of the reference step. If no step has this value the first step is taken.
    most_between : int
        At how many values between the steps the spectrum may be computed.
    """
    values = [step.value for step in steps]
    # of each step the number (m,) of the path that each of its roots lies on, from 1, 0 if unknown
    paths: list[Indices]
    if spectrum_at is None:
        paths = [_by_frequency(step) for step in steps]
        losses: list[Loss] = []
    else:
        tracked, losses = track_modes(spectrum_at, values, most_between)
        paths = []
        for step, path_of_root in zip(steps, tracked, strict=True):
            # the roots of a step may be fewer, or in another order, than those of the spectrum
            spectrum = spectrum_at(step.value)
            paths.append(mode_numbers_at(spectrum, path_of_root, np.asarray(step.roots)))
    reference = values.index(numbered_at) if numbered_at in values else 0
    # of each path that a root of some step lies on
    number_of = _number_of_paths(paths, reference, _by_frequency(steps[reference]))
    numbered = []
    for step, paths_of_step in zip(steps, paths, strict=True):
        modes = [number_of.get(path, 0) for path in paths_of_step.tolist()]
        numbered.append(replace(step, modes=np.array(modes, dtype=int)))
    losses_by_number = []
    for loss in losses:
        modes = sorted(number_of[path] for path in loss.modes if path in number_of)
        # at a meeting each mode is in doubt as it may be the other one. If no step has the path of
        # one of them, the other mode cannot be taken for it: nothing is lost
        fewest = 2 if loss.kind == "meet" else 1
        if len(modes) >= fewest:
            losses_by_number.append(loss._replace(modes=tuple(modes)))
    return NumberedSteps(numbered, tuple(losses_by_number), numbered[reference])


def _by_frequency(step: Step) -> Indices:
    """The numbers (m,) of the modes of a step by rising frequency: those that it has, else those
    among the listed roots."""
    if step.modes is not None:
        return np.asarray(step.modes)
    return mode_numbers(np.asarray(step.roots))


def _number_of_paths(
    paths: Sequence[Indices], reference: int, by_frequency: Indices
) -> dict[int, int]:
    """The mode number of each eigenvalue path, by the path.

    Parameters
    ----------
    paths : sequence of array of int (m,)
        Of each step the paths of its roots, 0 where a path is not known.
    reference : int
        The index of the step whose modes are numbered by rising frequency. Paths without a root in
        this step get the next numbers as they appear.
    by_frequency : array of int (m,)
        The numbers of the roots of the reference step.
    """
    number_of: dict[int, int] = {}
    for path, number in zip(paths[reference].tolist(), by_frequency.tolist(), strict=True):
        if path:
            number_of.setdefault(path, number)
    highest = max(number_of.values(), default=0)
    for paths_of_step in paths:
        for path in paths_of_step.tolist():
            if path and path not in number_of:
                highest += 1
                number_of[path] = highest
    return number_of
