"""The eigenvalues of a system at one value of its parameter, and what is said of them."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from squeal.errors import InputError
from squeal.io.writing import number
from squeal.linear import Spectrum, UnstableMode, unstable_modes
from squeal.linear import thresholds as linear_thresholds
from squeal.linear.digits import has_digits
from squeal.linear.eigen import growing
from squeal.linear.matrices import dense
from squeal.linear.system import System
from squeal.queries.systems.all_roots import is_small
from squeal.queries.systems.band_proof import with_band_proof
from squeal.queries.systems.known import (
    accuracy_by_digits,
    data_of,
    digits_of_files,
    error_bounds,
    open_by_digits,
)
from squeal.queries.systems.matrices import matrix_list, system_checks
from squeal.queries.systems.proofs import Statement
from squeal.queries.systems.roots import SystemRoots, roots_of_first_look, system_roots
from squeal.queries.systems.seat import seat_note
from squeal.queries.systems.system_analysis import SystemAnalysis
from squeal.results.columns import basis_text
from squeal.results.eigenvalues import Eigenvalues, mode_shapes, shape_rows
from squeal.results.sources import SystemSource
from squeal.results.sweep import Sweep
from squeal.sparse.argument_principle import Disc, Rectangle
from squeal.sparse.first_look import FirstLook

ONSET_ROWS = 40
"""Up to so many rows the onset of each unstable mode is computed."""
SHOWN_ROWS = 100
"""Matrices and mode shapes of systems with more rows are not printed."""
SAME = 1e-6
"""Two roots within this share of |lambda| are one, computed in two ways."""


def system_eigenvalues(
    analysis: SystemAnalysis,
    at: float | None = None,
    look: Sweep | None = None,
    prove: bool | None = None,
) -> Eigenvalues:
    """The selected eigenvalues at a value of the parameter, and what shows that none is missing.

    Parameters
    ----------
    analysis : SystemAnalysis
        The system and the selection of its roots.
    at : float, optional
        Value of the free parameter; the system's own if left out.
    look : Sweep, optional
        A sweep that was computed before. If it is a first look at a large system, by estimates
        on a reduced basis, the roots come from that basis too.
    prove : bool, optional
        Whether the referee (`squeal.proof`) judges the roots. Left out, it judges all roots of a
        small system; with True also the modes of a band of a larger one.
    """
    if at is None:
        return _eigenvalues(analysis, look, prove, seat="")
    analysis.warn_of_unused_parameter()
    system = analysis.system.replace({analysis.system.parameter: at})
    file = replace(analysis.file, system=system)
    return _eigenvalues(replace(analysis, file=file), look, prove, seat=seat_note(file))


def _eigenvalues(
    analysis: SystemAnalysis, look: Sweep | None, prove: bool | None, seat: str
) -> Eigenvalues:
    """The eigenvalues at the system's own value; `seat`: a note on its contact, or nothing."""
    file = analysis.file
    system = analysis.system
    roots = _roots(analysis, look, prove)
    doubts = [*roots.doubts, *file.assumptions]
    criterion = roots.criterion
    if roots.verdict is None:  # perhaps because the files print too few digits
        criterion = open_by_digits(file, roots.every) or criterion
    outside = _outside(analysis, roots)
    extent = ""
    if roots.region is not None:
        extent = analysis.selection.words(len(roots.eigenvalues))
    statement = roots.statement
    if doubts and roots.certified:  # nothing is proved of what was guessed
        statement = Statement("open", statement.by, reason="; ".join(doubts))
    proof_line = statement.words
    if analysis.joined or doubts:
        # of joined components the count is that of the reduced system, as its own words say; what
        # was guessed has a line of its own
        proof_line = ""
    notes = [
        _description(analysis, roots),
        *roots.notes,
        seat,
        accuracy_by_digits(file, roots.every),
    ]
    return Eigenvalues(
        name=system.name,
        parameter=system.parameter,
        value=system.parameters[system.parameter],
        eigenvalues=roots.eigenvalues,
        verdict=roots.verdict,
        criterion=criterion,
        unstable=_unstable_modes(system, roots),
        certified=roots.certified and not doubts,
        count=roots.count,
        extent=extent,
        shapes=_shapes(system, roots),
        details=_details(analysis, roots, outside, doubts),
        notes=tuple(note for note in notes if note),
        beside=_growth_outside(analysis, outside),
        source=SystemSource(file, analysis.selection),
        proof=statement.to_dict(),
        proof_line=proof_line,
        depends=analysis.depends_on_parameter,
    )


def _shapes(system: System, roots: SystemRoots) -> dict[str, Any] | None:
    """The mode shapes of a system of few rows."""
    if system.n > SHOWN_ROWS:
        return None
    modes = mode_shapes(Spectrum(roots.eigenvalues))
    return shape_rows(modes, system.row_names if modes else [], "largest entry 1")


def _roots(analysis: SystemAnalysis, look: Sweep | None, prove: bool | None) -> SystemRoots:
    """The selected roots: of a large system with a first look those that the look estimates."""
    file = analysis.file
    system = analysis.system
    if look is not None and isinstance(look.source, SystemSource) and not is_small(system):
        reduction = look.source.reduction
        if isinstance(reduction, FirstLook):
            changes = {system.parameter: system.parameters[system.parameter]}
            return roots_of_first_look(reduction, analysis.selection, changes)
    data = None if prove is False else data_of(file, system)
    bounded = error_bounds(file, system)
    roots = system_roots(system, analysis.selection, bounded=bounded, data=data)
    if prove and not is_small(system):
        return with_band_proof(file, analysis.selection, roots)
    return roots


def _outside(analysis: SystemAnalysis, roots: SystemRoots) -> tuple[complex, ...] | None:
    """Growing roots outside of the region, the fastest first; None if nothing is known of them."""
    if not roots.outside or not analysis.joined:
        return roots.outside
    # roots above the cutoff decide nothing
    cutoff = math.tau * analysis.file.assembly.cutoff
    return tuple(root for root in roots.outside if abs(root) < cutoff)


def _region_entry(region: Rectangle | Disc | None) -> dict[str, float] | None:
    """A region as JSON holds it: a radius, or the four ends of a rectangle."""
    if region is None:
        return None
    if isinstance(region, Disc):
        return {"radius": region.radius}
    return dict(vars(region))


def _details(
    analysis: SystemAnalysis,
    roots: SystemRoots,
    outside: tuple[complex, ...] | None,
    doubts: list[str],
) -> dict[str, Any]:
    """What the JSON object says of the system and of how its roots were found."""
    file = analysis.file
    system = analysis.system
    details: dict[str, Any] = {
        "rows": system.n,
        "parameters": system.given,
        "matrices": matrix_list(file),
        "checks": system_checks(system),
        "region": _region_entry(roots.region),
        "basis": analysis.joined,
        "damped": [damped._asdict() for damped in file.damped],
        "fastest_outside": None,
        "growing_outside": None if outside is None else len(outside),
        "growth_limit": roots.growth_limit,
        "doubts": doubts,
        "known_by": digits_of_files(file) if has_digits(system) else None,
    }
    if outside:
        hertz = abs(outside[0].imag) / math.tau
        details["fastest_outside"] = {"frequency_hz": hertz, "growth_rate": outside[0].real}
    if system.n <= SHOWN_ROWS and system.real:
        for name, matrix in zip("MCK", system.at(), strict=True):
            shown = np.zeros((system.n, system.n)) if matrix is None else dense(matrix)
            details[name] = shown.tolist()
    if file.assembly is not None:
        details["contact"] = [seat.summary() for seat in file.assembly.seats]
    return details


def _description(analysis: SystemAnalysis, roots: SystemRoots) -> str:
    """The system, its matrices and its contact in lines for people."""
    file = analysis.file
    system = analysis.system
    values = []
    for name, value in system.parameters.items():
        if name == system.parameter and not analysis.depends_on_parameter:
            continue
        text = "that of each root" if name in system.follows else f"{value:g}"
        values.append(f"{name} = {text}")
    freedom = "degree" if system.n == 1 else "degrees"
    lines = [", ".join([f"{system.n} {freedom} of freedom", *values])]
    if analysis.joined:
        errors_are_known = any(root.error is not None for root in roots.eigenvalues)
        lines.append(f"  {basis_text(analysis.joined, errors_are_known)}")
    for matrix in matrix_list(file):
        read = matrix["file"] or "rows"
        lines.append(
            f"  {matrix['part']}: {read}, factor {matrix['factor']}, {matrix['nonzeros']} non-zeros"
        )
    if file.damped:
        damped = [f"{term.of} by {term.by} {term.value!s:.60}" for term in file.damped]
        lines.append(f"  damped terms: {', '.join(damped)}")
    for name, text in system_checks(system).items():
        lines.append(f"  {name}: {text}")
    if file.assembly is not None:
        lines += [f"  {seat}" for seat in file.assembly.seats]
    return "\n".join(lines)


def _growth_outside(analysis: SystemAnalysis, outside: tuple[complex, ...] | None) -> str:
    """What grows outside of the region in a line; empty if no such root is known."""
    if not outside:
        return ""
    hertz = number(abs(outside[0].imag) / math.tau, 5)
    mode = f"at {hertz} Hz by {number(outside[0].real, 3)} 1/s"
    region = "band" if analysis.selection.band else "region"
    if analysis.joined or not is_small(analysis.system):  # only those that the search came upon
        return f"Outside of the {region} nothing was searched, but growth was seen, such as {mode}"
    count = "1 mode grows" if len(outside) == 1 else f"{len(outside)} modes grow"
    return f"Outside of the {region} {count}, the fastest {mode}"


def _unstable_modes(system: System, roots: SystemRoots) -> tuple[UnstableMode, ...]:
    """The growing modes among the roots, of a small system each with its onset.

    The onset is the value of the parameter from which on the mode grows. It is None where it cannot
    be computed, or where no followed root is that of the mode.
    """
    value = system.parameters[system.parameter]
    unstable = growing(roots.every)
    if not (unstable and system.real and value > 0.0 and system.n <= ONSET_ROWS):
        return unstable
    try:
        known = unstable_modes(system, value, linear_thresholds(system, value))
    except InputError:  # no way from zero: a factor divides by the parameter, M has no factor
        return unstable
    with_onsets = []
    for mode in unstable:
        nearest = min(known, key=lambda other: abs(other.root - mode.root), default=mode)
        onset = None
        if abs(nearest.root - mode.root) <= SAME * abs(mode.root):
            onset = nearest.onset
        with_onsets.append(replace(mode, onset=onset))
    return tuple(with_onsets)
