"""The selected roots of a system at values of its parameter, each mode with one number over all."""

import functools
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from squeal.errors import InputError
from squeal.io.processes import mapped, with_progress
from squeal.io.system import SystemFile
from squeal.linear.continuation import SMALL_ROWS, SpectrumAtParameter
from squeal.linear.eigen import arrays_of, values_of
from squeal.linear.paths import Loss, continued, mode_numbers
from squeal.linear.roots import lowest, ordered
from squeal.queries.mode_numbers import assign_mode_numbers
from squeal.queries.systems.all_roots import NO_BAND, is_small
from squeal.queries.systems.data_precision import roots_of_file
from squeal.queries.systems.reduced import ComputedRoots, roots_of_reduction
from squeal.queries.systems.seat import doubt_of_seat
from squeal.results.sources import EigenvalueSelection
from squeal.results.sweep import Step
from squeal.sparse.quadratic import PROGRESS, Roots
from squeal.sparse.reduction import Reduction
from squeal.sparse.root_slopes import spectrum_with_slopes


class TrackedModes(NamedTuple):
    """A sweep in which each mode has one number at all values.

    Attributes
    ----------
    steps : tuple of Step
        The roots at each value with the numbers of their modes, in the order of the values.
    losses : tuple of Loss
        The intervals of the parameter in which it is lost which mode is which.
    reference : Step
        The step at which modes are numbered by rising frequency: that at the requested value, or at
        the system's present one, where the sweep holds it, else that at the lowest value.
    """

    steps: tuple[Step, ...]
    losses: tuple[Loss, ...]
    reference: Step


def track_modes(
    file: SystemFile,
    selection: EigenvalueSelection,
    values: Sequence[float],
    reduction: Reduction | None,
    numbered_at: float | None = None,
    is_judged: bool = True,
) -> TrackedModes:
    """Compute the roots at values of the parameter; a mode has the same number at all of them.

    Parameters
    ----------
    file : SystemFile
        The system and what is known of its entries.
    selection : EigenvalueSelection
        Which of its roots.
    values : sequence of float
        Of the free parameter, in any order.
    reduction : Reduction or None
        A reduced system that is good at the values; without one the system itself is solved.
    numbered_at : float, optional
        One of the values, at which modes are numbered; left out, the system's present value.
    is_judged : bool
        Whether the referee judges the roots of a small system, which may take half of the time.

    Returns
    -------
    TrackedModes
        A step for each value, in the order of `values`.

    Raises
    ------
    InputError
        For a large system without a band, a region or a number of modes.
    """
    system = file.system
    parameter = system.parameter
    present_value = system.parameters[parameter]
    small = is_small(system)
    if not small and reduction is None and selection == EigenvalueSelection():
        raise InputError(NO_BAND)
    expensive = reduction is None and not small  # each value is a search in the full system
    # modes are numbered at the present value: a cheap sweep that passes it computes it too
    computed = set(values)
    if min(values) < present_value < max(values) and not expensive:
        computed.add(present_value)
    rising = sorted(computed)
    compute = functools.partial(_step_and_roots, file, selection, reduction, is_judged)
    tasks = mapped(compute, rising, in_threads=not small or reduction is not None)
    computed_roots = dict(
        zip(rising, with_progress(tasks, len(rising), PROGRESS.get()), strict=True)
    )
    # vectors are those of the system itself, or of the reduced one
    system_of_vectors = system if reduction is None else reduction.system

    @functools.cache
    def spectrum_at(value: float) -> SpectrumAtParameter:
        """The spectrum at a value of the sweep, or between two, to track modes in small steps."""
        if value in computed_roots:
            _, roots = computed_roots[value]
        elif reduction is not None:
            roots = roots_of_reduction(reduction, {parameter: value}).with_vectors
        else:
            roots = _roots_of_full(file, selection, value, is_judged=False).with_vectors
        # lifted: vectors of the first-order form, where left and right ones of two roots are
        # orthogonal
        frozen = system_of_vectors.frozen()
        return spectrum_with_slopes(frozen, parameter, value, roots, lifted=True)

    # the spectra along which modes are tracked
    tracked_at: Callable[[float], SpectrumAtParameter] = spectrum_at
    all_roots = reduction is None and selection.rectangle is None
    has_continuation = small and system.real and system.n <= SMALL_ROWS
    if all_roots and has_continuation:
        # modes are tracked by the continuation of all roots, which knows where they cross and
        # coalesce; it refuses M, C and K that are singular together
        with suppress(InputError):
            continuation = continued(system.balanced, rising)
            if continuation.has_all_roots:
                tracked_at = continuation.at
    steps = [step for step, _ in computed_roots.values()]  # by rising value
    values_between = len(rising)  # so many more may be computed to tell modes apart
    if expensive:
        values_between = 0
    if numbered_at is None:
        numbered_at = present_value
    numbered, losses, reference = assign_mode_numbers(
        steps, tracked_at, numbered_at, values_between
    )
    step_at = dict(zip(rising, numbered, strict=True))
    return TrackedModes(tuple(step_at[value] for value in values), losses, reference)


def _step_and_roots(
    file: SystemFile,
    selection: EigenvalueSelection,
    reduction: Reduction | None,
    is_judged: bool,
    value: float,
) -> tuple[Step, Roots]:
    """Compute the roots at a value of the parameter: a task of a process.

    Without a reduction the system itself is solved, and the referee judges the roots of a small one
    if `is_judged` says so. Returns the step with the listed roots, and the roots with vectors, by
    which modes are tracked.
    """
    if reduction is None:
        roots = _roots_of_full(file, selection, value, is_judged)
    else:
        roots = roots_of_reduction(reduction, {file.system.parameter: value})
    listed = ordered(roots.values)  # indices of the roots by rising frequency
    if selection.modes is not None:  # of pairs the upper root alone
        upper = listed[roots.values[listed].imag >= 0.0]
        listed = upper[lowest(roots.values[upper], selection.modes)]
    step = Step(
        value=value,
        roots=roots.values[listed],
        residuals=roots.residuals[listed],
        verdict=roots.verdict,
        spurious=roots.spurious,
        rounding=roots.rounding[listed],
        corrected=None if roots.corrected is None else roots.corrected[listed],
        certified=roots.certified,
        modes=mode_numbers(roots.values)[listed],  # roots that are not listed count too
    )
    return step, roots.with_vectors


def qualified_by_data(file: SystemFile, selection: EigenvalueSelection, step: Step) -> Step:
    """A step of a sweep, whose verdict or certificate is withdrawn if the data do not support it.

    - The verdict of a reduced system, which knows nothing of digits, is withdrawn where the digits
      of files leave the sign of a growth rate of the system itself open.
    - The certificate is withdrawn where something was assumed of the system, or where the static
      solution of contact at this value differs from the one that the matrices hold.
    """
    if step.certified is None:  # of a reduced system, whose roots nothing counts
        system = file.system.replace({file.system.parameter: step.value})
        if system.digits and is_small(system):
            roots = roots_of_file(file, selection, system, is_judged=False)
            if roots.verdict is None and any(root.sign_is_open for root in roots.computed):
                return replace(step, verdict=None)
    elif step.certified and (file.assumptions or doubt_of_seat(file, step.value)):
        return replace(step, certified=False)
    return step


def _roots_of_full(
    file: SystemFile, selection: EigenvalueSelection, value: float, is_judged: bool
) -> ComputedRoots:
    """The roots of the system itself at a value of the parameter.

    is_judged: whether the referee judges the roots of a small system. The roots with vectors, by
    which modes are tracked, have Im >= 0: conjugates of a real system need no tracking, and the
    roots of a complex system have no conjugates.
    """
    system = file.system.replace({file.system.parameter: value})
    PROGRESS.get()(f"{system.parameter} = {value:g}")
    solved = roots_of_file(file, selection, system, is_judged)
    tracked = []
    for root in solved.computed:
        if not system.real or root.value.imag >= 0.0:
            tracked.append(root)
    values, right, left = arrays_of(tracked, system.n)
    return ComputedRoots(
        values=values_of(solved.computed),
        residuals=np.array([root.residual for root in solved.computed]),
        rounding=np.array([root.rounding for root in solved.computed]),
        with_vectors=Roots(values, right, left),
        verdict=solved.verdict,
        certified=solved.statement.certifies(is_small(system)),
    )
