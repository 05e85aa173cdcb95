"""The verbs for systems from matrices: what `squeal.analysis.verbs` answers with."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from squeal.analysis.answers import (
    Eigenvalues,
    Map,
    Step,
    Sweep,
    Thresholds,
    basis_text,
    shapes_without_names,
)
from squeal.analysis.sensitivity import Sensitivity
from squeal.analysis.systems import sweeps
from squeal.analysis.systems.chart import NAMES, Side, system_chart
from squeal.analysis.systems.checks import matrix_list, system_checks
from squeal.analysis.systems.critical import system_thresholds
from squeal.analysis.systems.roots import SystemRoots, growing, system_roots
from squeal.analysis.systems.wanted import Wanted, check_memory, extent, is_small
from squeal.errors import InputError, InputWarning
from squeal.io.matrices import fingerprint
from squeal.io.system import SystemFile
from squeal.io.writing import Checkpoint
from squeal.linear import Spectrum, UnstableMode, unstable_modes
from squeal.linear import thresholds as linear_thresholds
from squeal.linear.system import TermSystem
from squeal.linear.system import dense as plain_matrix
from squeal.sparse.argument_principle import Rectangle
from squeal.sparse.factor import Progress
from squeal.sparse.reduction import Reduction

ONSET_ROWS = 40  # up to so many rows the onset of each unstable mode is sought
SHOWN_ROWS = 100  # matrices and mode shapes of larger systems are not printed
CHECKED = 25  # values of a sweep at which its basis is checked
SERVED = 9  # values at which a reduced system has to be good
SHOWN = 121  # values of the parameter in a figure of thresholds
SAME = 1e-6  # of |lambda|: one root, computed in two ways


def few(values: Sequence[float], most: int) -> list[float]:
    """At most so many of the values, both ends included."""
    if len(values) <= most:
        return list(values)
    return [values[round(k * (len(values) - 1) / (most - 1))] for k in range(most)]


def file_of(subject: object) -> SystemFile:
    """A system with what is known of its files. Raises InputError for anything else."""
    if isinstance(subject, TermSystem):
        return SystemFile(subject)
    if not isinstance(subject, SystemFile):
        raise InputError(
            f"{type(subject).__name__} is not allowed; it must be a Scene, a System or what "
            "read_system gives"
        )
    return subject


def moved(file: SystemFile, at: float) -> SystemFile:
    """The same with another value of the free parameter."""
    return replace(file, system=file.system.replace({file.system.parameter: at}))


def wanted(
    band: tuple[float, float] | None, region: Sequence[float] | None, modes: int | None
) -> Wanted:
    """Which roots are wanted. Raises InputError."""
    return Wanted(band, None if region is None else Rectangle(*region), modes)


def identity(system: TermSystem) -> dict[str, Any]:
    """What a system is, short enough for a file: its parameters and fingerprints."""
    terms = [t for part in (system.M, system.C, system.K) for t in part]
    parts = [
        [t.factor.text, *(fingerprint(part) for part in (t.matrix.real, t.matrix.imag))]
        for t in terms
    ]
    return {"parameters": dict(system.parameters), "free": system.parameter, "terms": parts}


def _kept(path: Path | None, system: TermSystem, **asked: Any) -> Checkpoint:
    """What keeps long work beside an output; another question begins anew."""
    return Checkpoint(path, lambda: {"asked": repr(asked), "system": identity(system)})


def _checked(system: TermSystem, memory: float | None) -> None:
    if not is_small(system):
        check_memory(system, memory)


def basis_row(reduction: Reduction | None, wanted: Wanted) -> dict[str, Any] | None:
    """A reduced system as JSON holds it."""
    if reduction is None:
        return None
    rectangle = wanted.rectangle
    limit = None if wanted.band is None or rectangle is None else rectangle.high_real
    return {
        "method": reduction.method,
        "size": reduction.size,
        "samples": [dict(changes) for changes in reduction.samples],
        "residual": reduction.worst,
        "converged": reduction.converged,
        "spurious": reduction.spurious,
        "growth_limit": limit,
    }


def _matrices(system: TermSystem) -> dict[str, Any]:
    M, C, K = system.at()
    if system.n > SHOWN_ROWS or not system.real:
        return {}
    zero = np.zeros((system.n, system.n))
    parts = {"M": plain_matrix(M), "C": zero if C is None else plain_matrix(C)}
    return {name: X.tolist() for name, X in (parts | {"K": plain_matrix(K)}).items()}


def eigenvalues(
    file: SystemFile, wanted: Wanted, memory: float | None, progress: Progress
) -> Eigenvalues:
    """The roots that are wanted, with what proves them complete."""
    system = file.system
    _checked(system, memory)
    roots = system_roots(system, wanted, None, progress)
    listed, checks = matrix_list(file), system_checks(system)
    details: dict[str, Any] = {
        "rows": system.n,
        "parameters": dict(system.parameters),
        "matrices": listed,
        "checks": checks,
        **_matrices(system),
        "region": extent(roots.region),
        "growth_limit": roots.growth_limit,
        "growing_outside": roots.growing_outside,
        "basis": None,
    }
    freedom = "degree" if system.n == 1 else "degrees"
    own = ", ".join(f"{name} = {value:g}" for name, value in system.parameters.items())
    told = [f"{system.n} {freedom} of freedom, {own}"]
    told += [
        f"  {m['part']}: {m['file'] or 'rows'}, factor {m['factor']}, {m['nonzeros']} non-zeros"
        for m in listed
    ]
    told += [f"  {name}: {text}" for name, text in checks.items()]
    notes = ["\n".join(told)]
    if roots.growing_outside:
        notes.append(f"{roots.growing_outside} modes grow outside of what was asked for")
    words = "" if roots.region is None else wanted.words()
    if roots.growth_limit is not None:
        words += f" with growth below {roots.growth_limit:.4g} 1/s"
    shapes = None
    if system.n <= SHOWN_ROWS:
        shapes = shapes_without_names(Spectrum(roots.eigenvalues))
    return Eigenvalues(
        system.name,
        system.parameter,
        system.parameters[system.parameter],
        roots.eigenvalues,
        roots.verdict,
        roots.criterion,
        _growing(system, roots),
        roots.certified,
        roots.count,
        words,
        shapes,
        details,
        tuple(notes),
        source=(file, roots),
    )


def _growing(system: TermSystem, roots: SystemRoots) -> tuple[UnstableMode, ...]:
    """What grows among the roots; of a small system with the onset of each."""
    at = system.parameters[system.parameter]
    grow = growing((*roots.eigenvalues, *roots.others))
    if not (grow and system.real and at > 0.0 and system.n <= ONSET_ROWS):
        return tuple(grow)
    own: Any = system
    if system.sparse:
        own = lambda p: system.arrays({system.parameter: p})  # noqa: E731
    try:
        every = unstable_modes(own, at, linear_thresholds(own, at))
    except InputError:  # no way from zero: a factor divides by the parameter, M has no factor
        return tuple(grow)

    def onset(mode: UnstableMode) -> float | None:
        def apart(other: UnstableMode) -> float:
            hertz = other.frequency_hz - mode.frequency_hz
            return abs(complex(other.growth_rate - mode.growth_rate, 2 * np.pi * hertz))

        same = min(every, key=apart, default=None)
        size = abs(complex(mode.growth_rate, 2 * np.pi * mode.frequency_hz))
        return same.onset if same is not None and apart(same) <= SAME * size else None

    return tuple(replace(mode, onset=onset(mode)) for mode in grow)


def sweep(
    file: SystemFile,
    values: Sequence[float],
    wanted: Wanted,
    method: str | None,
    memory: float | None,
    progress: Progress,
    keep: Path | None,
) -> Sweep:
    """The roots at values of the parameter, on the system itself or on a reduced one."""
    system = file.system
    method = sweeps.check_method(method, system)
    _checked(system, memory)
    name, reduction = system.parameter, None
    checkpoint = _kept(keep, system, values=list(values), wanted=wanted, method=method)
    if method == "full":
        rows = list(_full(system, wanted, values, progress, checkpoint))
    else:
        changes = [{name: value} for value in few(values, CHECKED)]
        reduction, region = sweeps.reduced_for(
            system, wanted, changes, method, progress, checkpoint
        )
        rows = list(sweeps.reduced_rows(reduction, region, name, values, wanted.modes))
    checkpoint.close()
    steps = [Step(r.value, r.roots, r.residuals, r.verdict, spurious=r.spurious) for r in rows]
    return Sweep(system.name, name, tuple(steps), basis_row(reduction, wanted), file)


def _full(
    system: TermSystem,
    wanted: Wanted,
    values: Sequence[float],
    progress: Progress,
    checkpoint: Checkpoint,
) -> Iterator[sweeps.SweepRow]:
    """The sweep on the system itself, after the values that a stopped run has left."""
    rows: list[sweeps.SweepRow] = []
    kept = {} if is_small(system) else checkpoint.load()
    if kept:
        ends = np.cumsum(kept["counts"])[:-1]
        roots, errors = (np.split(kept[each], ends) for each in ("roots", "residuals"))
        every = zip(values, roots, errors, kept["verdicts"].tolist(), strict=False)
        rows = [sweeps.SweepRow(*row) for row in every]
    yield from rows
    for row in sweeps.full_rows(system, wanted, values[len(rows) :], progress):
        rows.append(row)
        if not is_small(system):
            checkpoint.save(
                counts=np.array([len(one.roots) for one in rows]),
                roots=np.concatenate([one.roots for one in rows]),
                residuals=np.concatenate([one.residuals for one in rows]),
                verdicts=np.array([one.verdict for one in rows]),
            )
        yield row


def thresholds(
    file: SystemFile,
    high: float,
    low: float | None,
    wanted: Wanted,
    memory: float | None,
    progress: Progress,
    keep: Path | None,
) -> Thresholds:
    """Every threshold of the wanted roots from low to high."""
    system = file.system
    _checked(system, memory)
    checkpoint = _kept(keep, system, range=(low, high), wanted=wanted)
    found = system_thresholds(system, high, low, wanted, progress, checkpoint)
    checkpoint.close()
    basis = basis_row(found.reduction, wanted)
    notes = [f"not confirmed on the full system: {words}" for words in found.unconfirmed]
    notes += found.left_out
    if found.crossings_outside:
        notes.append(f"crossings outside {wanted.words()}: {found.crossings_outside}")
    if found.certified is not None:
        foreseen = "foreseen, not excluded by proof" if system.real else "not sought"
        notes.append(f"windows between the values looked at are {foreseen}")
    details: Mapping[str, Any] = {
        "parameters": dict(system.parameters),
        "admissible_to": found.high,
        "unconfirmed": list(found.unconfirmed),
        "left_out": list(found.left_out),
        "crossings_outside": found.crossings_outside,
        "basis": basis,
    }
    return Thresholds(
        system.name,
        system.parameter,
        found.low,
        found.high,
        found.verdict,
        found.points,
        found.crossings,
        f"{system.parameter} = {found.high:g} is reached",
        found.certified,
        notes=tuple(notes + ([basis_text(basis)] if basis else [])),
        details=details,
        source=(file, found, wanted),
    )


def along(found: Thresholds) -> Sweep:
    """The way of the roots over the range of thresholds, for a figure."""
    file, located, wanted = found.source
    system, values = file.system, np.linspace(found.low, found.high, SHOWN).tolist()
    if located.reduction is None:
        rows = list(sweeps.full_rows(system, wanted, values))
    else:
        rows = list(
            sweeps.reduced_rows(located.reduction, wanted.rectangle, system.parameter, values)
        )
    steps = [Step(r.value, r.roots, r.residuals, r.verdict) for r in rows]
    return Sweep(system.name, system.parameter, tuple(steps))


def map_over(
    file: SystemFile,
    axes: tuple[Any, Any] | None,
    wanted: Wanted,
    memory: float | None,
    progress: Progress,
    keep: Path | None,
) -> Map:
    """The verdict on the wanted roots over two named parameters."""
    system = file.system
    if axes is None or len(system.parameters) < 2:
        raise InputError(f"{system.name}: a map needs two named parameters and their ranges")
    first, second = (Side(axis.name, axis.low, axis.high, axis.n) for axis in axes)
    system.values({first.name: 0.0, second.name: 0.0})  # refuses what it has not
    for name in sorted({first.name, second.name} - system.names):
        warnings.warn(f"no matrix depends on {name}", InputWarning, stacklevel=2)
    _checked(system, memory)
    sides = (first, second)
    checkpoint = _kept(keep, system, sides=sides, wanted=wanted)
    found = system_chart(system, sides, wanted, progress, checkpoint)
    checkpoint.close()
    basis = basis_row(found.reduction, wanted)
    details = {"verdicts": [[NAMES[k] for k in row] for row in found.codes], "basis": basis}
    growth = ("largest_real", "1/s", found.growth)
    return Map(
        system.name,
        sides,
        ("", ""),
        NAMES,
        found.codes,
        growth,
        details=details,
        notes=(basis_text(basis),) if basis else (),
        source=(file, found),
    )


def reduced(
    system: TermSystem,
    wanted: Wanted,
    values: Sequence[float],
    method: str,
    memory: float | None,
    progress: Progress,
) -> Reduction:
    """The system reduced to the roots that are wanted, for these values of its parameter."""
    _checked(system, memory)
    changes = [{system.parameter: value} for value in few(values, SERVED)]
    return sweeps.reduced_for(system, wanted, changes, method, progress)[0]


def sensitivity(file: SystemFile, found: Eigenvalues) -> Sensitivity:
    """What moves the eigenvalues: -y^H (s^2 dM + s dC + dK) x over y^H (2 s M + C) x."""
    system = file.system
    M, C, _ = system.at()
    slopes = {}
    for name in system.parameters:
        dM, dC, dK = system.derivative(name)
        moved = []
        for root in found.eigenvalues:
            s, x, y = root.value, root.right, root.left.conj()
            change = sum(
                f * (y @ (X @ x)) for f, X in ((s * s, dM), (s, dC), (1.0, dK)) if X is not None
            )
            scale = y @ (2 * s * (M @ x) + (0.0 if C is None else C @ x))
            moved.append(-change / scale if scale else complex(np.nan, np.nan))
        slopes[name] = np.array(moved, dtype=complex)
    values = dict(system.parameters)
    units = dict.fromkeys(values, "")
    free, verdict = system.parameter, found.verdict or ""
    return Sensitivity("eigenvalues", free, found.values, verdict, slopes, values, units)
