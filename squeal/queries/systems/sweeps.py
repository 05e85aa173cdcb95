"""The selected roots of a system over its parameter, and which of them is which mode."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from squeal.errors import InputError
from squeal.io.processes import counted, mapped
from squeal.io.system import SystemFile
from squeal.linear import GROWING
from squeal.linear.continuation import ContinuationOptions, SpectrumAtParameter
from squeal.linear.paths import Loss, continued
from squeal.linear.roots import ordered
from squeal.linear.system import TermSystem
from squeal.queries.mode_numbers import assign_mode_numbers
from squeal.queries.systems.all_roots import NO_BAND, is_small
from squeal.queries.systems.known import data_of, error_bounds
from squeal.queries.systems.roots import system_roots
from squeal.queries.systems.verdicts import rounding_of, verdict_of
from squeal.results.sources import EigenvalueSelection
from squeal.results.sweep import Step
from squeal.sparse.crossings import spectrum_with_slopes
from squeal.sparse.first_look import FirstLook
from squeal.sparse.quadratic import PROGRESS, Roots
from squeal.sparse.reduction import Reduction


class _Common(NamedTuple):
    """What all values of a sweep share."""

    file: SystemFile
    selection: EigenvalueSelection
    reduction: Reduction | None


class _RootsAt(NamedTuple):
    """Roots at one value of the parameter.

    values, residuals, rounding (m,): the roots, their backward errors, and how far rounding may
    move them (1/s); with_vectors: the roots that are followed; verdict, spurious, corrected,
    certified: as `Step` has them.
    """

    values: NDArray[np.complex128]
    residuals: NDArray[np.float64]
    rounding: NDArray[np.float64]
    with_vectors: Roots
    verdict: str | None
    spurious: int = 0
    corrected: NDArray[np.bool_] | None = None
    certified: bool | None = None


def track_modes(
    file: SystemFile,
    selection: EigenvalueSelection,
    values: Sequence[float],
    reduction: Reduction | None,
    workers: int = 1,
) -> tuple[tuple[Step, ...], tuple[Loss, ...], Step]:
    """The roots at values of the parameter, each mode with one number over all of them.

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
    workers : int
        Processes.

    Returns
    -------
    steps : tuple of Step
        The roots at each value, in the order of the values.
    losses : tuple of Loss
        Where it is not known which mode is which. To follow the modes as many values between may
        be computed, but for full solutions.
    reference : Step
        The step by whose frequencies modes are numbered: that at the system's own value where the
        sweep holds it, else that at the lowest value.
    """
    system = file.system
    parameter = system.parameter
    own_value = system.parameters[parameter]
    small = is_small(system)
    if not small and reduction is None and selection == EigenvalueSelection():
        raise InputError(NO_BAND)
    expensive = reduction is None and not small
    computed = set(values)
    if min(values) < own_value < max(values) and not expensive:
        computed.add(own_value)
    rising = sorted(computed)
    common = _Common(file, selection, reduction)
    rows = counted(mapped(_step_and_roots, rising, workers, common), len(rising), PROGRESS.get())
    known = dict(zip(rising, rows, strict=True))
    tracked = system if reduction is None else reduction.system

    @functools.cache
    def spectrum_at(value: float) -> SpectrumAtParameter:
        changes = {parameter: value}
        if value in known:
            _, roots = known[value]
        elif system.follows and reduction is not None:
            roots, _, _ = reduction.modes(changes, left=True)
        elif reduction is not None:
            roots = reduction.roots(changes, left=True)
        else:
            roots = _roots_of_full(file, selection, value, is_judged=False).with_vectors
        return spectrum_with_slopes(tracked.frozen(), parameter, value, roots, lifted=True)

    at = cast(Callable[[float], SpectrumAtParameter], spectrum_at)
    all_roots = reduction is None and selection.rectangle is None
    if all_roots and small and system.real and system.n <= ContinuationOptions.small_rows:
        with suppress(InputError):  # where M is singular
            at = continued(system, rising).at
    steps = [known[value][0] for value in rising]
    spare = 0 if expensive else len(rising)
    numbered, losses, own = assign_mode_numbers(steps, at, own_value, spare)
    step_at = dict(zip(rising, numbered, strict=True))
    return tuple(step_at[value] for value in values), losses, own


def _step_and_roots(common: _Common, value: float) -> tuple[Step, Roots]:
    """The step with the listed roots at a value of the parameter, and the roots with vectors that
    are followed."""
    file, selection, reduction = common
    if reduction is None:
        roots = _roots_of_full(file, selection, value)
    else:
        roots = _roots_of_reduced(file.system, reduction, value)
    order = ordered(roots.values)
    if selection.modes is not None:
        upper = order[roots.values[order].imag >= 0.0]
        order = upper[: selection.modes]
    step = Step(
        value=value,
        roots=roots.values[order],
        residuals=roots.residuals[order],
        verdict=roots.verdict,
        spurious=roots.spurious,
        rounding=roots.rounding[order],
        corrected=None if roots.corrected is None else roots.corrected[order],
        certified=roots.certified,
    )
    return step, roots.with_vectors


def _roots_of_reduced(system: TermSystem, reduction: Reduction, value: float) -> _RootsAt:
    changes = {system.parameter: value}
    corrected = None
    if isinstance(reduction, FirstLook):
        look = reduction.estimate(changes)
        values = look.values
        residuals = look.residuals
        rounding = np.maximum(look.errors, rounding_of(system, values))
        with_vectors = look.projected
        spurious = look.spurious
        corrected = look.corrected
    else:
        with_vectors, residuals, spurious = reduction.modes(changes, left=True)
        values = with_vectors.values
        rounding = rounding_of(system, values)
    verdict = verdict_of(values, rounding)
    return _RootsAt(
        values=values,
        residuals=residuals,
        rounding=rounding,
        with_vectors=with_vectors,
        verdict=verdict if verdict in GROWING else None,  # only some roots are known
        spurious=spurious,
        corrected=corrected,
    )


def _roots_of_full(
    file: SystemFile, selection: EigenvalueSelection, value: float, is_judged: bool = True
) -> _RootsAt:
    """The roots of the system itself, judged as those at a single value are or only computed."""
    system = file.system.replace({file.system.parameter: value})
    PROGRESS.get()(f"{system.parameter} = {value:g}")
    data = data_of(file, system) if is_judged and is_small(system) else None
    answer = system_roots(system, selection, bounded=error_bounds(file, system), data=data)
    followed = [root for root in answer.every if not system.real or root.value.imag >= 0.0]
    rows = (-1, system.n)
    with_vectors = Roots(
        values=np.array([root.value for root in followed], dtype=complex),
        right=np.reshape(np.array([root.right for root in followed]), rows).T,
        left=np.reshape(np.array([root.left for root in followed]), rows).T,
    )
    return _RootsAt(
        values=np.array([root.value for root in answer.every], dtype=complex),
        residuals=np.array([root.residual for root in answer.every]),
        rounding=np.array([root.rounding for root in answer.every]),
        with_vectors=with_vectors,
        verdict=answer.verdict,
        certified=answer.certified,
    )
