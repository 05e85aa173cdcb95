"""The verbs for systems from matrices: what `squeal.analysis.verbs` answers with."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from squeal.analysis.answers import (
    Eigenvalues,
    Map,
    Sensitivity,
    Step,
    Sweep,
    Thresholds,
    basis_text,
    shape_rows,
)
from squeal.analysis.modes import mode_shapes
from squeal.analysis.systems import sweeps
from squeal.analysis.systems.matrices import matrix_list, system_checks
from squeal.analysis.systems.roots import SystemRoots, growing, system_roots
from squeal.analysis.systems.sweeps import NAMES, system_chart
from squeal.analysis.systems.thresholds import system_thresholds
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
from squeal.sparse.factor import Progress, quiet
from squeal.sparse.reduction import Reduction

ONSET_ROWS = 40  # up to so many rows the onset of each unstable mode is sought
SHOWN_ROWS = 100  # matrices and mode shapes of larger systems are not printed
CHECKED = 25  # values of a sweep at which its basis is checked
SERVED = 9  # values at which a reduced system has to be good
SHOWN = 121  # values of the parameter in a figure of thresholds
SAME = 1e-6  # of |lambda|: one root, computed in two ways

Band = tuple[float, float]


def few(values: Sequence[float], most: int) -> list[float]:
    """At most so many of the values, both ends included."""
    if len(values) <= most:
        return list(values)
    return [values[round(k * (len(values) - 1) / (most - 1))] for k in range(most)]


def _read(
    subject: object,
    memory: float | None,
    band: Band | None = None,
    region: Sequence[float] | None = None,
    modes: int | None = None,
) -> tuple[SystemFile, Wanted]:
    """A system with what is known of its files, and which of its roots are wanted.

    Raises InputError, and ComputationError for what does not fit into the memory.
    """
    if isinstance(subject, TermSystem):
        subject = SystemFile(subject)
    if not isinstance(subject, SystemFile):
        raise InputError(
            f"{type(subject).__name__} is not allowed; it must be a Scene, a System or what "
            "read_system gives"
        )
    wanted = Wanted(band, None if region is None else Rectangle(*region), modes)
    if not is_small(subject.system):
        check_memory(subject.system, memory)
    return subject, wanted


def _kept(path: Path | None, system: TermSystem, **asked: Any) -> Checkpoint:
    """What keeps long work beside an output; another question begins anew."""

    def identity() -> dict[str, Any]:
        terms = [t for part in (system.M, system.C, system.K) for t in part]
        parts = [
            [t.factor.text, *(fingerprint(part) for part in (t.matrix.real, t.matrix.imag))]
            for t in terms
        ]
        known = {"parameters": dict(system.parameters), "free": system.parameter, "terms": parts}
        return {"asked": repr(asked), "system": known}

    return Checkpoint(path, identity)


def _basis(reduction: Reduction | None, wanted: Wanted) -> dict[str, Any] | None:
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


def eigenvalues(
    subject: object,
    at: float | None = None,
    band: Band | None = None,
    region: Sequence[float] | None = None,
    modes: int | None = None,
    memory: float | None = None,
    progress: Progress = quiet,
) -> Eigenvalues:
    """The roots that are wanted, with what proves them complete."""
    file, wanted = _read(subject, memory, band, region, modes)
    if at is not None:
        file = replace(file, system=file.system.replace({file.system.parameter: at}))
    system = file.system
    roots = system_roots(system, wanted, None, progress)
    listed, checks = matrix_list(file), system_checks(system)
    printed, shapes = {}, None
    if system.n <= SHOWN_ROWS:
        names = [f"q{i + 1}" for i in range(system.n)]
        found = mode_shapes(Spectrum(roots.eigenvalues))
        shapes = shape_rows(found, names if found else [], "largest entry 1")
        if system.real:
            zero = np.zeros((system.n, system.n))
            matrices = zip("MCK", system.at(), strict=True)
            printed = {k: (zero if X is None else plain_matrix(X)).tolist() for k, X in matrices}
    details: dict[str, Any] = {
        "rows": system.n,
        "parameters": dict(system.parameters),
        "matrices": listed,
        "checks": checks,
        **printed,
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
    own = system.plain
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
    subject: object,
    values: Sequence[float],
    band: Band | None = None,
    region: Sequence[float] | None = None,
    modes: int | None = None,
    method: str | None = None,
    memory: float | None = None,
    progress: Progress = quiet,
    keep: Path | None = None,
) -> Sweep:
    """The roots at values of the parameter, on the system itself or on a reduced one."""
    file, wanted = _read(subject, memory, band, region, modes)
    system = file.system
    method, name, reduction = sweeps.check_method(method, system), system.parameter, None
    checkpoint = _kept(keep, system, values=list(values), wanted=wanted, method=method)
    if method == "full":
        rows = list(_full(system, wanted, values, progress, checkpoint))
    else:
        changes = [{name: value} for value in few(values, CHECKED)]
        reduction, region_served = sweeps.reduced_for(
            system, wanted, changes, method, progress, checkpoint
        )
        rows = list(sweeps.reduced_rows(reduction, region_served, name, values, wanted.modes))
    checkpoint.close()
    return Sweep(system.name, name, tuple(rows), _basis(reduction, wanted), file)


def _full(
    system: TermSystem,
    wanted: Wanted,
    values: Sequence[float],
    progress: Progress,
    checkpoint: Checkpoint,
) -> Iterator[Step]:
    """The sweep on the system itself, after the values that a stopped run has left."""
    rows: list[Step] = []
    kept = {} if is_small(system) else checkpoint.load()
    if kept:
        ends = np.cumsum(kept["counts"])[:-1]
        verdicts = [word or None for word in kept["verdicts"].tolist()]
        roots, errors = (np.split(kept[each], ends) for each in ("roots", "residuals"))
        every = zip(values, roots, errors, verdicts, strict=False)
        rows = [Step(*row) for row in every]
    yield from rows
    for row in sweeps.full_rows(system, wanted, values[len(rows) :], progress):
        rows.append(row)
        if not is_small(system):
            found = [one.roots for one in rows if one.roots is not None]
            checkpoint.save(
                counts=np.array([len(one) for one in found]),
                roots=np.concatenate(found),
                residuals=np.concatenate([one.residuals for one in rows]),
                verdicts=np.array([one.verdict or "" for one in rows]),
            )
        yield row


def thresholds(
    subject: object,
    high: float,
    low: float | None = None,
    band: Band | None = None,
    region: Sequence[float] | None = None,
    memory: float | None = None,
    progress: Progress = quiet,
    keep: Path | None = None,
) -> Thresholds:
    """Every threshold of the wanted roots from low to high."""
    file, wanted = _read(subject, memory, band, region)
    system = file.system
    checkpoint = _kept(keep, system, range=(low, high), wanted=wanted)
    found = system_thresholds(system, high, low, wanted, progress, checkpoint)
    checkpoint.close()
    basis = _basis(found.reduction, wanted)
    notes = [f"not confirmed on the full system: {words}" for words in found.unconfirmed]
    notes += found.left_out
    if found.crossings_outside:
        notes.append(f"crossings outside {wanted.words()}: {found.crossings_outside}")
    if found.certified is not None:
        foreseen = "foreseen, not excluded by proof" if system.real else "not sought"
        notes.append(f"windows between the values looked at are {foreseen}")
    details = {
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
    basis, region = located.reduction, wanted.rectangle
    if basis is None:
        rows = list(sweeps.full_rows(system, wanted, values))
    else:
        rows = list(sweeps.reduced_rows(basis, region, system.parameter, values))
    return Sweep(system.name, system.parameter, tuple(rows))


def map_over(
    subject: object,
    axes: tuple[Any, Any] | None = None,
    band: Band | None = None,
    memory: float | None = None,
    progress: Progress = quiet,
    keep: Path | None = None,
) -> Map:
    """The verdict on the wanted roots over two named parameters."""
    file, wanted = _read(subject, memory, band)
    system = file.system
    if axes is None or len(system.parameters) < 2:
        raise InputError(f"{system.name}: a map needs two named parameters and their ranges")
    names = {axis.name for axis in axes}
    system.values(dict.fromkeys(names, 0.0))  # refuses what it has not
    for name in sorted(names - system.names):
        warnings.warn(f"no matrix depends on {name}", InputWarning, stacklevel=4)
    checkpoint = _kept(keep, system, axes=axes, wanted=wanted)
    found = system_chart(system, axes, wanted, progress, checkpoint)
    checkpoint.close()
    basis = _basis(found.reduction, wanted)
    return Map(
        system.name,
        axes,
        ("", ""),
        NAMES,
        found.codes,
        ("largest_real", "1/s", found.growth),
        details={"verdicts": [[NAMES[k] for k in row] for row in found.codes], "basis": basis},
        notes=(basis_text(basis),) if basis else (),
        source=(file, found),
    )


def reduced(
    subject: object,
    values: Sequence[float] | None = None,
    band: Band | None = None,
    region: Sequence[float] | None = None,
    method: str = "reduced",
    memory: float | None = None,
    progress: Progress = quiet,
) -> tuple[Reduction, dict[str, Any] | None]:
    """The system reduced to the roots that are wanted, for these values of its parameter (its
    own), and what a JSON object says of that."""
    file, wanted = _read(subject, memory, band, region)
    system, free = file.system, file.system.parameter
    own = [system.parameters[free]] if values is None else values
    changes = [{free: value} for value in few(own, SERVED)]
    found = sweeps.reduced_for(system, wanted, changes, method, progress)[0]
    return found, _basis(found, wanted)


def sensitivity(
    subject: object, of: str, high: float = 0.0, known: Eigenvalues | None = None
) -> Sensitivity:
    """What moves the eigenvalues: -y^H (s^2 dM + s dC + dK) x over y^H (2 s M + C) x."""
    if of == "threshold":
        raise InputError("sensitivity: thresholds of a system are not allowed; advise takes them")
    file, _ = _read(subject, None)
    system, found = file.system, known or eigenvalues(file)
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
    values, free, verdict = dict(system.parameters), system.parameter, found.verdict or ""
    units = dict.fromkeys(values, "")
    return Sensitivity("eigenvalues", free, found.values, verdict, slopes, values, units)
