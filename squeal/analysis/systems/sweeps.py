"""Sweeps of a system's parameter: on all roots, on full solutions, or on a reduced system."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from squeal.analysis.systems.roots import NO_ROOT, system_roots
from squeal.analysis.systems.wanted import Wanted, is_small
from squeal.errors import InputError, InputWarning
from squeal.io.writing import Checkpoint
from squeal.linear.eigen import ordered
from squeal.linear.system import TermSystem
from squeal.linear.verdict import decide
from squeal.sparse.argument_principle import Disc, Rectangle
from squeal.sparse.dense import dense_values
from squeal.sparse.eigensolver import lowest_modes
from squeal.sparse.factor import Progress, quiet
from squeal.sparse.quadratic import ScaledSystem
from squeal.sparse.reduction import (
    TOLERANCE,
    Begun,
    Reduction,
    reduce_system,
    reduce_to_real_modes,
)

METHODS = ("full", "reduced", "modal")
REAL_MODES = 200  # of a modal reduction
NOISE = 1e-10  # of |lambda|: growth of a damped root that may be rounding
SPLIT = 1e-7  # of |lambda|: what rounding may part two equal roots of an undamped system by
AROUND = 1.2  # of the largest wanted root: the region of a sweep that asks for the lowest

NO_BAND = (
    "band: is missing; a sweep of a large system, or one by the method reduced or modal, needs "
    "a band, a region or modes"
)
Changes = Mapping[str, float]


@dataclass(frozen=True, eq=False)
class SweepRow:
    """Roots (m,) at one value of the parameter, by rising frequency, and the verdict on them.

    `residuals` are backward errors in the full problem; NaN where they were not computed.
    `spurious` roots of a reduced system are none of the full one and left out.
    """

    value: float
    roots: NDArray[np.complex128] = field(repr=False)
    residuals: NDArray[np.float64] = field(repr=False)
    verdict: str
    spurious: int = 0

    def to_dict(self) -> dict[str, Any]:
        """As journals of interrupted sweeps hold it."""
        residuals = [None if np.isnan(r) else float(r) for r in self.residuals]
        return {
            "value": self.value,
            "real": self.roots.real.tolist(),
            "imag": self.roots.imag.tolist(),
            "residuals": residuals,
            "verdict": self.verdict,
        }

    @staticmethod
    def from_dict(given: dict[str, Any]) -> SweepRow:
        """Read back what `to_dict` gave."""
        roots = np.array(given["real"], dtype=float) + 1j * np.array(given["imag"], dtype=float)
        residuals = np.array([np.nan if r is None else r for r in given["residuals"]], dtype=float)
        return SweepRow(given["value"], roots, residuals, given["verdict"])


def verdict_of(roots: NDArray[np.complex128], noise: float) -> str:
    """Verdict on roots of which a real part below `noise` |lambda| is none."""
    return decide(roots, noise * np.abs(roots)).verdict if len(roots) else NO_ROOT


def noise_of(system: TermSystem) -> float:
    """What of |lambda| may be rounding in a real part."""
    return NOISE if system.C or not system.real else SPLIT


def sweep_region(scaled: ScaledSystem, wanted: Wanted, changes: Changes) -> Rectangle:
    """The region of a sweep: what is wanted, or that of the lowest modes at one value."""
    if wanted.rectangle is not None:
        return wanted.rectangle
    if wanted.modes is None:
        raise InputError(NO_BAND)
    if is_small(scaled.system):
        roots = roots_of_all(scaled.system, Wanted(), changes)
        sizes = np.sort(np.abs(roots[roots.imag >= 0.0]))
        far = AROUND * float(sizes[: wanted.modes][-1]) or 1.0
    else:
        found = lowest_modes(scaled.at(changes), wanted.modes, certify=False)
        assert isinstance(found.region, Disc)
        far = AROUND * found.region.radius
    return Rectangle(-far / 4, far / 4, -1e-6 * far, far)


def reduced_for(
    system: TermSystem,
    wanted: Wanted,
    values: Sequence[Changes],
    method: str = "reduced",
    progress: Progress = quiet,
    checkpoint: Checkpoint | None = None,
) -> tuple[Reduction, Rectangle]:
    """The reduced system that serves some values of the parameters, and the region it serves.

    A `checkpoint` keeps what there is after each full solution, and a second run goes on from it.
    Warns if the full problem is not met to the tolerance.
    """
    scaled = ScaledSystem(system)
    region = sweep_region(scaled, wanted, values[len(values) // 2])
    if method == "modal":
        return reduce_to_real_modes(scaled, region, values, min(REAL_MODES, system.n)), region
    kept, begun = checkpoint.load() if checkpoint else None, None
    if kept:
        begun = Begun(kept["vectors"], tuple(map(int, kept["samples"])))

    def keep(now: Begun) -> None:
        if checkpoint:
            checkpoint.save(vectors=now.vectors, samples=np.array(now.samples))

    found = reduce_system(scaled, region, values, progress=progress, begun=begun, keep=keep)
    if not found.converged:
        warnings.warn(
            f"{len(found.samples)} full solutions do not suffice for the reduced system: a root "
            f"has a residual of {found.worst:.2g} in the full problem, {TOLERANCE:g} is wanted; a "
            "narrower band or range is required",
            InputWarning,
            stacklevel=2,
        )
    return found, region


def reduced_rows(
    reduction: Reduction,
    region: Rectangle,
    name: str,
    values: Sequence[float],
    modes: int | None = None,
) -> Iterator[SweepRow]:
    """The sweep on a reduced system; of the region's roots all, or the lowest `modes`."""
    noise = noise_of(reduction.system)
    for value in values:
        found = reduction.modes(region, {name: value})
        verdict = verdict_of(found.values, noise)  # on all of them, however few are listed
        order = ordered(found.values)[:modes]
        residuals = found.residuals[order]
        yield SweepRow(value, found.values[order], residuals, verdict, found.spurious)


def full_rows(
    system: TermSystem, wanted: Wanted, values: Sequence[float], progress: Progress = quiet
) -> Iterator[SweepRow]:
    """The sweep on the system itself, one value after the other."""
    if is_small(system):
        for value in values:
            roots = roots_of_all(system, wanted, {system.parameter: value})
            verdict = verdict_of(roots, noise_of(system))  # on all of them, however few are listed
            if wanted.modes is not None:
                roots = roots[roots.imag >= 0.0][: wanted.modes]
            yield SweepRow(value, roots, np.full(len(roots), np.nan), verdict)
        return
    if wanted.rectangle is None and wanted.modes is None:
        raise InputError(NO_BAND)
    for value in values:
        progress(f"{system.parameter} = {value:g}")
        found = system_roots(system, wanted, {system.parameter: value}, progress)
        roots = np.array([e.value for e in found.eigenvalues], dtype=complex)
        residuals = np.array([e.residual for e in found.eigenvalues])
        yield SweepRow(value, roots, residuals, verdict_of(roots, noise_of(system)))


def roots_of_all(system: TermSystem, wanted: Wanted, changes: Changes) -> NDArray[np.complex128]:
    """The roots of a small system in the band or region, by rising frequency, values alone."""
    roots = dense_values(*system.arrays(changes))
    if not system.real:
        roots = roots[roots.imag >= 0.0]
    if wanted.band is not None:
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
