"""`squeal eigenvalues` of a system from matrices: roots with their proof, and sweeps."""

import argparse
import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from squeal.analysis.subject import dense as plain_arrays
from squeal.analysis.systems import sweeps
from squeal.analysis.systems.checks import matrix_list, system_checks
from squeal.analysis.systems.roots import SystemRoots, growing, system_roots
from squeal.analysis.systems.wanted import Wanted, extent, is_small
from squeal.cli.base import Answer
from squeal.cli.numbers import few, spaced
from squeal.cli.outputs import option_of
from squeal.cli.sweep import plain_shape_rows, root_row, write_eigenvalues
from squeal.cli.system_options import (
    check_work,
    progress_of,
    value_in,
    wanted_of,
    warn_if_constant,
)
from squeal.cli.system_shapes import check_shape, write_shape
from squeal.cli.tables import columns_with, elided, in_words, number, roots_in_words, table
from squeal.cli.unstable import ONSET_SIZE, filter_of, unstable_rows, unstable_text
from squeal.errors import InputError
from squeal.io.journal import Checkpoint, Journal
from squeal.io.matrices import fingerprint
from squeal.io.system import SystemFile
from squeal.io.writing import picked, write_table
from squeal.linear import Spectrum, UnstableMode, crossings, unstable_modes
from squeal.linear.system import TermSystem, dense
from squeal.sparse.reduction import Reduction

SAME = 1e-6  # of |lambda|: one root, computed in two ways
CHECKED = 25  # values of a sweep at which its basis is checked
SHOWN_ROWS = 100  # matrices and mode shapes of larger systems are not printed


@dataclass(frozen=True)
class _Sweep:
    rows: list[sweeps.SweepRow] = field(default_factory=list)
    reduction: Reduction | None = None


def eigenvalues_of(given: argparse.Namespace, file: SystemFile) -> Answer:
    """The answer of `squeal eigenvalues` for a system."""
    if given.sensitivity:
        raise InputError(
            f"--sensitivity: is not allowed with {given.source.name}, a system of matrices; "
            "a scene is allowed"
        )
    wanted, progress = wanted_of(given), progress_of(given)
    values = spaced(given.mu, option_of(given, "mu")) if given.mu else []
    system, at = file.system, value_in(given.at, "--at")
    if at is not None:
        if f"parameters.{system.parameter}" in given.source.changes:
            raise InputError(
                f"--at {given.at}: --set gives {system.parameter} too; one of both is allowed"
            )
        system = system.replace({system.parameter: at})
    method = sweeps.check_method(given.method, system)
    where = check_shape(given, file)
    check_work(given, system)
    roots = system_roots(system, wanted, None, progress)
    swept = _Sweep()
    if values:
        warn_if_constant(system)
        swept = _swept(given, system, values, method)
    _write(given, system, roots, swept)
    if where is not None:
        write_shape(given, where, roots)
    grow, chosen = _growing(system, roots), filter_of(given)
    words = looked_at(roots, wanted)
    part = roots.region is not None and (wanted.band is None or roots.growth_limit is not None)

    def data() -> dict[str, Any]:
        found = _head(file, system)
        found["eigenvalues"] = [root_row(e) for e in roots.eigenvalues]
        found["unstable"] = unstable_rows(chosen(grow))
        found |= picked(roots, "verdict criterion certified count")
        found |= {"region": extent(roots.region), "growth_limit": roots.growth_limit}
        found["growing_outside"] = roots.growing_outside
        found |= {"method": method, "basis": basis_row(swept.reduction, wanted)}
        if system.n <= SHOWN_ROWS:
            found["mode_shapes"] = plain_shape_rows(Spectrum(roots.eigenvalues, False, 0))
        if values:
            found["sweep"] = [sweep_row(row) for row in swept.rows]
        return found

    def shown() -> str:
        where = f" among {words}" if part else ""
        listed = unstable_text(chosen(grow), chosen, len(grow), system.parameter, where)
        return _text(file, system, roots, swept, wanted, listed)

    return Answer(data, shown, [given.source.file, *file.inputs])


def _growing(system: TermSystem, roots: SystemRoots) -> Sequence[UnstableMode]:
    """What grows among the roots; of a small system with the onset of each."""
    at = system.parameters[system.parameter]
    grow = growing((*roots.eigenvalues, *roots.others))
    if not (grow and system.real and at > 0.0 and system.n <= ONSET_SIZE):
        return grow
    own = plain_arrays(system)
    try:
        every = unstable_modes(own, at, crossings(own, at))
    except InputError:  # no way from zero: a factor divides by the parameter, M has no factor
        return grow
    return [dataclasses.replace(mode, onset=_onset(mode, every)) for mode in grow]


def _onset(mode: UnstableMode, every: Sequence[UnstableMode]) -> float | None:
    """The onset of the same mode among all that grow."""

    def apart(other: UnstableMode) -> float:
        hertz, rate = mode.frequency_hz - other.frequency_hz, mode.growth_rate - other.growth_rate
        return abs(complex(rate, 2 * np.pi * hertz))

    found = min(every, key=apart, default=None)
    size = abs(complex(mode.growth_rate, 2 * np.pi * mode.frequency_hz))
    return found.onset if found is not None and apart(found) <= SAME * size else None


def _swept(
    given: argparse.Namespace, system: TermSystem, values: list[float], method: str
) -> _Sweep:
    wanted, progress, name = wanted_of(given), progress_of(given), system.parameter

    def head() -> dict[str, Any]:
        return {"values": values, "wanted": repr(wanted), "system": identity(system)}

    if method == "full":
        journal = Journal(
            None if is_small(system) else given.table, head(), sweeps.SweepRow.from_dict
        )
        rows = [sweeps.SweepRow.from_dict(row) for row in journal.rows]
        for row in sweeps.full_rows(system, wanted, values[len(rows) :], progress):
            rows.append(row)
            journal.add(row.to_dict())
        journal.close()
        return _Sweep(rows)
    changes = [{name: v} for v in few(values, CHECKED)]
    checkpoint = Checkpoint(given.table, head)
    reduction, region = sweeps.reduced_for(system, wanted, changes, method, progress, checkpoint)
    rows = list(sweeps.reduced_rows(reduction, region, name, values, wanted.modes))
    checkpoint.close()
    return _Sweep(rows, reduction)


def identity(system: TermSystem) -> dict[str, Any]:
    """What a system is, short enough for a file: its parameters and fingerprints."""
    terms = [t for part in (system.M, system.C, system.K) for t in part]
    return {
        "parameters": dict(system.parameters),
        "parameter": system.parameter,
        "terms": [
            [t.factor.text, *(fingerprint(part) for part in (t.matrix.real, t.matrix.imag))]
            for t in terms
        ],
    }


def sweep_row(row: sweeps.SweepRow) -> dict[str, Any]:
    """One value of a sweep as a JSON row."""
    size = np.abs(row.roots)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(size > 0, -row.roots.real / size, 0.0)
    parts = (row.roots.real, row.roots.imag, np.abs(row.roots.imag) / (2 * np.pi), ratio)
    names = ("real", "imag", "frequency_hz", "damping_ratio")
    listed: list[dict[str, Any]] = [
        dict(zip(names, one, strict=True)) for one in zip(*(p.tolist() for p in parts), strict=True)
    ]
    for one, residual in zip(listed, row.residuals.tolist(), strict=True):
        if not np.isnan(residual):
            one["residual"] = residual
    found = {"mu": row.value, "eigenvalues": listed, "verdict": row.verdict}
    return found | {"spurious": row.spurious}


def basis_row(reduction: Reduction | None, wanted: Wanted) -> dict[str, Any] | None:
    """A reduced system's size, where it was made, its worst backward error, and how fast the roots
    of its band may grow."""
    if reduction is None:
        return None
    found = picked(reduction, "method size")
    found["samples"] = [dict(changes) for changes in reduction.samples]
    found |= {"residual": reduction.worst} | picked(reduction, "converged spurious")
    return found | {"growth_limit": _growth_limit(wanted)}


def _growth_limit(wanted: Wanted) -> float | None:
    """The growth rate at which the region of a band ends, which a reduced system serves."""
    rectangle = wanted.rectangle
    return None if wanted.band is None or rectangle is None else rectangle.high_real


def _head(file: SystemFile, system: TermSystem) -> dict[str, Any]:
    found: dict[str, Any] = {"name": system.name, "rows": system.n, "parameter": system.parameter}
    found |= {"parameters": dict(system.parameters)}
    found |= {"matrices": matrix_list(file), "checks": system_checks(system)}
    M, C, K = system.at()
    if system.n <= SHOWN_ROWS and system.real:
        found |= {
            "M": dense(M).tolist(),
            "C": (np.zeros((system.n, system.n)) if C is None else dense(C)).tolist(),
            "K": dense(K).tolist(),
        }
    return found


def _text(
    file: SystemFile,
    system: TermSystem,
    roots: SystemRoots,
    swept: _Sweep,
    wanted: Wanted,
    unstable: str,
) -> str:
    words = looked_at(roots, wanted)
    own = ", ".join(f"{name} = {number(v)}" for name, v in system.parameters.items())
    freedom = "degree of freedom" if system.n == 1 else "degrees of freedom"
    parts = [f"{system.name}: {system.n} {freedom}, {own}"]
    if file.origins:
        rows = [("  part", "file", "factor", "non-zeros", "fingerprint")]
        rows += [
            (f"  {m['part']}", m["file"] or "-", m["factor"], str(m["nonzeros"]), m["fingerprint"])
            for m in matrix_list(file)
        ]
        told = "\n".join(f"  {name}: {text}" for name, text in system_checks(system).items())
        parts.append(table(rows, right=False) + "\n" + told)
    parts.append(root_table(roots))
    whole = roots.region is None
    about = "" if whole else f" on {words}"
    parts += [f"verdict{about}: {in_words(roots.criterion)}", unstable]
    if roots.growing_outside:
        parts.append(f"growing outside {words}, of pairs the upper root: {roots.growing_outside}")
    parts.append(certificate(roots, words))
    if swept.rows:
        parts.append(
            f"sweep of {system.parameter}\n" + _sweep_text(swept, system.parameter, wanted)
        )
    return "\n\n".join(parts)


def looked_at(roots: SystemRoots, wanted: Wanted) -> str:
    """Which roots were looked at, in words."""
    words = wanted.words()
    if roots.growth_limit is not None:
        words += f" with growth below {roots.growth_limit:.4g} 1/s"
    return words


def certificate(roots: SystemRoots, words: str) -> str:
    """What the count says, for people."""
    if roots.count is None:
        return f"{words}: the number of roots could not be settled; the list may be incomplete"
    if roots.certified:
        listed = f", {len(roots.eigenvalues)} of them listed" if roots.others else ""
        return f"{words}: {roots_in_words(roots.count)}{listed}, none is missing (count)"
    return f"{words}: listed roots {len(roots.eigenvalues)}, counted {roots.count}"


def root_table(roots: SystemRoots) -> str:
    """The roots for people."""
    rows = [("  mode", "real, 1/s", "imag, rad/s", "frequency, Hz", "damping ratio", "residual")]
    for i, e in enumerate(roots.eigenvalues, 1):
        parts = (e.value.real, e.value.imag, e.frequency_hz, e.damping_ratio)
        rows.append((f"  {i}", *(number(p) for p in parts), number(e.residual, 2)))  # type: ignore
    return elided(rows, "--json")


def _sweep_text(swept: _Sweep, parameter: str, wanted: Wanted) -> str:
    rows = [(f"  {parameter}", "roots", "growing, Hz", "largest real, 1/s", "verdict")]
    for row in swept.rows:
        noise = 1e-9 * np.abs(row.roots)
        growing = row.roots[(row.roots.real > noise) & (row.roots.imag >= 0)]
        named = ", ".join(number(f) for f in np.sort(np.abs(growing.imag)) / (2 * np.pi)) or "-"
        largest = number(float(row.roots.real.max())) if len(row.roots) else "-"
        rows.append((f"  {row.value:.6g}", str(len(row.roots)), named, largest, row.verdict))
    told = elided(rows, "--json or --csv")
    if swept.reduction is None:
        return told
    return f"{told}\n{basis_text(swept.reduction, wanted)}"


def basis_text(r: Reduction, wanted: Wanted) -> str:
    """A reduced system for people."""
    samples = [", ".join(f"{v:.6g}" for v in changes.values()) for changes in r.samples]
    at = " at " + ", ".join(samples) if samples and len(r.samples[0]) == 1 else ""
    found = (
        f"basis of {r.size} vectors ({r.method}), {len(samples)} full solutions{at}; worst "
        f"residual in the full problem {r.worst:.2g}"
    )
    if r.spurious:
        found += f"; {r.spurious} roots that the full problem has not are left out"
    if (limit := _growth_limit(wanted)) is not None:
        found += f"\nroots that grow by more than {limit:.4g} 1/s are left out"
    return found


def _write(
    given: argparse.Namespace, system: TermSystem, roots: SystemRoots, swept: _Sweep
) -> None:
    if given.table is not None:
        if swept.rows:
            write_sweep(given.table, system.parameter, swept.rows)
        else:
            write_eigenvalues(given.table, roots.eigenvalues)
    if given.figure is not None and given.shape is None:
        from squeal.plots.coupling import draw_system_sweep
        from squeal.plots.modes import draw_roots

        if swept.rows:
            draw_system_sweep(given.figure, system.name, system.parameter, swept.rows)
        else:
            values = np.array([e.value for e in roots.eigenvalues])
            draw_roots(given.figure, system.name, values)


def write_sweep(path: Path, parameter: str, rows: list[sweeps.SweepRow]) -> None:
    """A row for each root at each value: the value, the root, its residual and the verdict."""
    others = {"real": "1/s", "imag": "rad/s", "residual": "", "verdict": ""}
    listed = (
        (row.value, float(root.real), float(root.imag), float(residual), row.verdict)
        for row in rows
        for root, residual in zip(*_or_nothing(row), strict=True)
    )
    write_table(path, columns_with([parameter], others), listed)


def _or_nothing(row: sweeps.SweepRow) -> tuple[np.ndarray, np.ndarray]:
    """The roots at a value and their residuals; one of NaN where there is none."""
    nothing = np.array([complex(np.nan, np.nan)]), np.array([np.nan])
    return (row.roots, row.residuals) if len(row.roots) else nothing
