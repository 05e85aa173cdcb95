"""The wanted roots of a system over its parameter, and which of them is which mode."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any, cast

import numpy as np

from squeal.analysis.mode_numbers import assign_mode_numbers
from squeal.analysis.systems.roots import (
    NO_BAND,
    is_small,
    roots_of_all,
    rounding_of,
    system_roots,
    verdict_of,
)
from squeal.errors import InputError
from squeal.io.processes import counted, mapped
from squeal.linear import GROWING
from squeal.linear.continuation import ContinuationOptions, SpectrumAtParameter
from squeal.linear.eigen import ordered
from squeal.linear.paths import Loss, continued
from squeal.linear.system import TermSystem
from squeal.results.sources import EigenvalueSelection
from squeal.results.sweep import Step
from squeal.sparse.crossings import spectrum_with_slopes
from squeal.sparse.dense import roots_at
from squeal.sparse.first_look import FirstLook
from squeal.sparse.quadratic import PROGRESS, Roots, ScaledSystem
from squeal.sparse.reduction import Reduction


def followed(
    system: TermSystem,
    wanted: EigenvalueSelection,
    values: Sequence[float],
    reduction: Reduction | None,
    workers: int = 1,
) -> tuple[tuple[Step, ...], tuple[Loss, ...], Step]:
    """A sweep on a reduced system or, without one, on the system itself.

    Its modes are numbered as those at the system's own value where the sweep holds it, else as at
    the lowest one; that row is returned too. Between the values as many more may be looked at, but
    for full solutions.
    """
    small, whole = is_small(system), wanted.rectangle is None and reduction is None
    if whole and not small and wanted.modes is None:
        raise InputError(NO_BAND)
    name, reduced = system.parameter, system if reduction is None else reduction.system
    own, dear = system.parameters[name], reduction is None and not small
    scaled = ScaledSystem(system) if small and reduction is None else None

    every = sorted({*values, *([own] if min(values) < own < max(values) and not dear else [])})
    common = system, wanted, reduction, scaled
    each = counted(mapped(_row, every, workers, common), len(every), PROGRESS.get())
    known = dict(zip(every, each, strict=True))

    @functools.cache
    def at(value: float) -> SpectrumAtParameter:
        if value in known:
            roots = known[value][1]
        elif system.follows and reduction is not None:
            roots = reduction.modes({name: value}, left=True)[0]
        elif reduction is not None:
            roots = reduction.roots({name: value}, left=True)
        else:
            roots = _row(common, value)[1]
        return spectrum_with_slopes(reduced.frozen(), name, value, roots, lifted=True)

    rows, states = (
        [known[value][0] for value in every],
        cast(Callable[[float], SpectrumAtParameter], at),
    )
    if scaled is not None and system.real and whole and system.n <= ContinuationOptions.small:
        with suppress(InputError):  # where M is singular
            states = continued(system, every).at
    rows, losses, first = assign_mode_numbers(rows, states, own, 0 if dear else len(every))
    return tuple(rows[every.index(value)] for value in values), losses, first


Common = tuple[TermSystem, EigenvalueSelection, Reduction | None, ScaledSystem | None]


def _row(common: Common, value: float) -> tuple[Step, Roots]:
    """The roots at a value of the parameter, and those that are followed, with vectors."""
    system, wanted, reduction, scaled = common
    small, whole = is_small(system), wanted.rectangle is None and reduction is None
    at, rounding, corrected, certified = {system.parameter: value}, None, None, None
    spurious = 0
    if isinstance(reduction, FirstLook):
        look = reduction.estimate(at)
        roots = look.values
        residuals = look.residuals
        corrected = look.corrected
        spurious = look.spurious
        found = look.projected
        rounding = np.maximum(look.errors, rounding_of(system, roots))
    elif reduction is not None:
        found, residuals, spurious = reduction.modes(at, left=True)
        roots = found.values
    elif scaled is not None:
        roots = roots_of_all(system, wanted, at)
        residuals, problem = np.full(len(roots), np.nan), scaled.at(at)
        M, C, K = (X.toarray() for X in (problem.M, problem.C, problem.K))
        found = roots_at(M, C, K, roots[roots.imag >= 0.0], left=True)
        size = scaled.scale[:, None]
        found = Roots(found.values, size * found.right, size * found.left)
    else:
        PROGRESS.get()(f"{system.parameter} = {value:g}")
        answer = system_roots(system, wanted, at)
        every, certified = answer.every, answer.certified
        roots = np.array([e.value for e in every], dtype=complex)
        residuals = np.array([e.residual for e in every])
        rounding = np.array([e.rounding for e in every])
        sides = (np.array([getattr(e, side) for e in every]) for side in ("right", "left"))
        found = Roots(roots, *(np.reshape(X, (-1, system.n)).T for X in sides))
    # on all of them, however few are listed; some roots prove none but growth
    rounding = rounding_of(system, roots) if rounding is None else rounding
    verdict: str | None = verdict_of(roots, rounding)
    if not (small and whole) and verdict not in GROWING:
        verdict = None
    order = ordered(roots)
    if wanted.modes is not None:
        order = order[roots[order].imag >= 0.0][: wanted.modes]
    how = None if corrected is None else corrected[order]
    each = roots[order], residuals[order], verdict
    known: dict[str, Any] = {"corrected": how, "certified": certified}
    return Step(value, *each, spurious=spurious, rounding=rounding[order], **known), found
