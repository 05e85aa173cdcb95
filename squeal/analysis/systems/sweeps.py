"""A system at many values of its parameters: sweeps of one and charts of two, on all roots, on full
solutions, or on a reduced system."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from squeal.analysis.answers import Axis, Step
from squeal.analysis.systems.roots import NO_ROOT, system_roots
from squeal.analysis.systems.wanted import TERMS, Wanted, is_small
from squeal.errors import InputError, InputWarning
from squeal.linear import GROWING, VERDICTS
from squeal.linear.eigen import ordered
from squeal.linear.system import TermSystem
from squeal.linear.verdict import decide
from squeal.schema.values import takes
from squeal.sparse.argument_principle import Disc, Rectangle
from squeal.sparse.dense import dense_values
from squeal.sparse.eigensolver import OPTIONS, lowest_modes, modes_in
from squeal.sparse.factor import Progress, quiet
from squeal.sparse.quadratic import ScaledSystem
from squeal.sparse.reduction import (
    TOLERANCE,
    Reduction,
    reduce_system,
    reduce_to_real_modes,
)

METHODS = ("full", "reduced", "modal")
NAMES = (*VERDICTS, NO_ROOT)
REAL_MODES = 200  # of a modal reduction
SAMPLES = 5  # values a side of a chart at which a reduced system has to be good
NO_BAND = (
    "band: is missing; a sweep of a large system, or one by the method reduced or modal, needs "
    "a band, a region or modes"
)
Changes = Mapping[str, float]


def verdict_of(roots: NDArray[np.complex128], noise: float) -> str:
    """Verdict on roots of which a real part below `noise` |lambda| is none."""
    return decide(roots, noise * np.abs(roots)).verdict if len(roots) else NO_ROOT


def _growth_of(roots: NDArray[np.complex128], noise: float) -> str | None:
    """The same of some roots, which prove no verdict but growth."""
    found = verdict_of(roots, noise)
    return found if found in GROWING else None


def noise_of(system: TermSystem) -> float:
    """What of |lambda| may be rounding in a real part."""
    damped, split = 1e-10, 1e-7  # undamped, rounding parts two equal roots
    return damped if system.C or not system.real else split


def sweep_region(scaled: ScaledSystem, wanted: Wanted, changes: Changes) -> Rectangle:
    """The region of a sweep: what is wanted, or that of the lowest modes at one value."""
    if wanted.rectangle is not None:
        return wanted.rectangle
    if wanted.modes is None:
        raise InputError(NO_BAND)
    if is_small(scaled.system):
        roots = roots_of_all(scaled.system, Wanted(), changes)
        sizes = np.sort(np.abs(roots[roots.imag >= 0.0]))
        radius = float(sizes[: wanted.modes][-1])
    else:
        found = lowest_modes(scaled.at(changes), wanted.modes, certify=False)
        assert isinstance(found.region, Disc)
        radius = found.region.radius
    far = 1.2 * radius or 1.0
    return Rectangle(-far / 4, far / 4, -1e-6 * far, far)


def reduced_for(
    system: TermSystem,
    wanted: Wanted,
    values: Sequence[Changes],
    method: str = "reduced",
    progress: Progress = quiet,
) -> tuple[Reduction, Rectangle]:
    """The reduced system that serves some values of the parameters, and the region it serves.

    Warns if the full problem is not met to the tolerance, or if real modes lose roots that the
    system has at its own parameters.
    """
    scaled = ScaledSystem(system)
    region = sweep_region(scaled, wanted, values[len(values) // 2])
    if method == "modal":
        found = reduce_to_real_modes(scaled, region, values, min(REAL_MODES, system.n))
        _warn_of_lost_roots(found, region, progress)
        return found, region
    found = reduce_system(scaled, region, values, progress)
    if not found.converged:
        _warn(
            f"{len(found.samples)} full solutions do not suffice for the reduced system: a root "
            f"has a residual of {found.worst:.2g} in the full problem, {TOLERANCE:g} is wanted; a "
            "narrower band or range is required"
        )
    return found, region


def _warn_of_lost_roots(found: Reduction, region: Rectangle, progress: Progress) -> None:
    """Real modes know nothing of what friction and damping do: their roots beside the system's."""
    if found.size == found.basis.scaled.n:
        return
    problem = found.basis.scaled.at()
    exact = modes_in(problem, region, False, progress, exact=OPTIONS.accepted).values
    lost = len(exact) - len(found.values(region))
    if lost > 0:
        _warn(
            f"the real modes lose {lost} of {len(exact)} roots that the system has in the band at "
            "its own parameters; the method reduced has all of them"
        )


def _warn(words: str) -> None:
    warnings.warn(words, InputWarning, stacklevel=4)


def reduced_rows(
    reduction: Reduction,
    region: Rectangle,
    name: str,
    values: Sequence[float],
    modes: int | None = None,
) -> Iterator[Step]:
    """The sweep on a reduced system; of the region's roots all, or the lowest `modes`."""
    noise = noise_of(reduction.system)
    for value in values:
        found = reduction.modes(region, {name: value})
        verdict = _growth_of(found.values, noise)  # of all of them, however few are listed
        order = ordered(found.values)[:modes]
        residuals = found.residuals[order]
        yield Step(value, found.values[order], residuals, verdict, spurious=found.spurious)


def full_rows(
    system: TermSystem, wanted: Wanted, values: Sequence[float], progress: Progress = quiet
) -> Iterator[Step]:
    """The sweep on the system itself, one value after the other."""
    noise = noise_of(system)
    if not is_small(system) and wanted.rectangle is None and wanted.modes is None:
        raise InputError(NO_BAND)
    for value in values:
        changes = {system.parameter: value}
        if not is_small(system):
            progress(f"{system.parameter} = {value:g}")
            found = system_roots(system, wanted, changes, progress)
            roots = np.array([e.value for e in found.eigenvalues], dtype=complex)
            residuals = np.array([e.residual for e in found.eigenvalues])
            yield Step(value, roots, residuals, found.verdict)
            continue
        roots = roots_of_all(system, wanted, changes)
        # on all of them, however few are listed
        verdict = (verdict_of if wanted.rectangle is None else _growth_of)(roots, noise)
        if wanted.modes is not None:
            roots = roots[roots.imag >= 0.0][: wanted.modes]
        yield Step(value, roots, np.full(len(roots), np.nan), verdict)


def roots_of_all(system: TermSystem, wanted: Wanted, changes: Changes) -> NDArray[np.complex128]:
    """The roots of a small system in the band or region, by rising frequency, values alone."""
    roots = dense_values(*system.arrays(changes))
    if not system.real:
        roots = roots[roots.imag >= 0.0]
    if wanted.band is not None:  # whatever their real parts are
        low, high = (2 * np.pi * f for f in wanted.band)
        roots = roots[(roots.imag >= low) & (roots.imag <= high)]
    elif wanted.region is not None:
        roots = roots[wanted.region.contains(roots)]
    return np.asarray(roots[ordered(roots)])


def check_method(method: str | None, system: TermSystem) -> str:
    """The method of a sweep; left out, full for small systems and reduced for large ones."""
    if method is None:
        return "full" if is_small(system) else "reduced"
    if method not in METHODS:
        raise InputError(f"method: {method} is not allowed; it must be one of {', '.join(METHODS)}")
    return method


@dataclass(frozen=True)
class Chart:
    """Verdict codes (n1, n2), indices into NAMES, and the largest growth rates (1/s; NaN
    without a root)."""

    sides: tuple[Axis, Axis]
    codes: NDArray[np.int8] = field(repr=False)
    growth: NDArray[np.float64] = field(repr=False)  # largest real part
    reduction: Reduction | None = field(default=None, repr=False)


@takes(system=TERMS)
def system_chart(
    system: TermSystem,
    sides: tuple[Axis, Axis],
    wanted: Wanted | None = None,
    progress: Progress = quiet,
) -> Chart:
    """The verdict on the wanted roots over two parameters.

    A large system is reduced once for the whole rectangle. Raises InputError for a parameter
    that no matrix depends on, for one named twice, and for a large system without a band or region.
    """
    wanted = wanted or Wanted()
    first, second = sides
    for side in sides:
        system.values({side.name: 0.0})
        if side.name not in system.names:
            used = ", ".join(sorted(system.names)) or "no parameter"
            raise InputError(
                f"{side.name}: is not allowed in a chart, no matrix depends on it; {used} does"
            )
    if first.name == second.name:
        raise InputError(f"{first.name}: is not allowed twice; a chart has two parameters")
    reduction, region = None, None
    if not is_small(system):
        corners = [
            {first.name: float(a), second.name: float(b)}
            for a in np.linspace(first.low, first.high, SAMPLES)
            for b in np.linspace(second.low, second.high, SAMPLES)
        ]
        reduction, region = reduced_for(system, wanted, corners, progress=progress)
    codes = np.zeros((first.n, second.n), dtype=np.int8)
    growth = np.zeros((first.n, second.n))
    noise = noise_of(system)
    for i, a in enumerate(first.values):
        progress(f"{first.name} = {a:.6g}")
        for j, b in enumerate(second.values):
            changes = {first.name: float(a), second.name: float(b)}
            if reduction is not None and region is not None:
                roots = reduction.values(region, changes)
            else:
                roots = roots_of_all(system, wanted, changes)
            codes[i, j] = NAMES.index(verdict_of(roots, noise))
            growth[i, j] = roots.real.max() if len(roots) else np.nan
    return Chart(sides, codes, growth, reduction)
