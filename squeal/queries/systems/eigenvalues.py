"""The verb `eigenvalues` of a system: its roots at one value of the parameter, and the answer."""

import math
from dataclasses import replace

import numpy as np

from squeal.errors import InputError
from squeal.io.writing import JsonObject, number
from squeal.linear import Spectrum, UnstableMode
from squeal.linear import thresholds as linear_thresholds
from squeal.linear.eigen import growing
from squeal.linear.matrices import dense
from squeal.linear.paths import SAME_ROOT, with_onsets
from squeal.linear.system import System
from squeal.queries.systems.all_roots import is_small
from squeal.queries.systems.band_proof import with_band_proof
from squeal.queries.systems.data_precision import (
    accuracy_by_digits,
    digits_of_files,
    open_by_digits,
    roots_of_file,
)
from squeal.queries.systems.matrices import matrix_list, system_checks
from squeal.queries.systems.proofs import Statement
from squeal.queries.systems.roots import SystemRoots, roots_of_first_look
from squeal.queries.systems.seat import doubt_of_seat, seat_note
from squeal.queries.systems.system_analysis import SystemAnalysis
from squeal.results.columns import basis_text
from squeal.results.eigenvalues import Eigenvalues, mode_shapes, shape_rows
from squeal.results.sources import SystemSource, refuse_other_subject
from squeal.results.sweep import Sweep
from squeal.sparse.argument_principle import Disc
from squeal.sparse.first_look import FirstLook

ONSET_ROWS = 40
"""Up to so many rows the onset of each unstable mode is computed."""
SHOWN_ROWS = 100
"""Matrices and mode shapes of systems with more rows are not printed."""


def system_eigenvalues(
    analysis: SystemAnalysis,
    at: float | None = None,
    look: Sweep | None = None,
    prove: bool | None = None,
) -> Eigenvalues:
    """Compute the selected eigenvalues at a value of the parameter, and count or prove them.

    Parameters
    ----------
    analysis : SystemAnalysis
        The system and the selection of its roots.
    at : float, optional
        Value of the free parameter; the system's own if left out.
    look : Sweep, optional
        An earlier sweep of the system. If that was a first look (estimates of a large system on a
        basis of real modes), the roots are estimated on the same basis, and nothing counts them.
    prove : bool, optional
        Whether the referee (`squeal.proof`) judges the roots. Left out, it judges all roots of a
        small system; with True also the modes of a band of a larger one.
    """
    contact_note = ""  # at which value of the parameter contact was closed
    contact_doubt = ""  # how it differs at the present one
    if at is not None:
        analysis.warn_of_unused_parameter()
        at_value = analysis.system.replace({analysis.system.parameter: at})
        # contact keeps the seat of the system's own value of the parameter: the answer says so, and
        # how contact would differ if it were seated at the value `at`
        analysis = replace(analysis, file=replace(analysis.file, system=at_value))
        contact_note = seat_note(analysis.file)
        contact_doubt = doubt_of_seat(analysis.file, at)
    file = analysis.file
    system = analysis.system
    roots = _roots(analysis, look, prove)
    doubts = [*roots.doubts, *file.assumptions]
    if contact_doubt:
        doubts.append(contact_doubt)
    criterion = roots.criterion
    if roots.verdict is None:
        # files that print too few digits for a verdict are named in place of the criterion
        criterion = open_by_digits(file, roots.computed) or criterion
    outside = _outside(analysis, roots)
    extent = ""
    if roots.region is not None:
        extent = analysis.selection.words(len(roots.eigenvalues))
    statement = roots.statement
    # a certified list holds for the matrices, and doubts say that the system may have others
    if doubts and roots.certified:
        statement = Statement("open", statement.by, reason="; ".join(doubts))
    proof_line = statement.words
    if analysis.component_reduction or doubts:
        # the answer has these lines elsewhere: the description says that counts of reduced
        # components are those of the reduced system, and `completeness` lists the doubts
        proof_line = ""
    details = _details(analysis, roots, outside, doubts)
    notes = [
        _description(analysis, roots, details),
        *roots.notes,
        contact_note,
        accuracy_by_digits(file, roots.computed),
    ]
    return Eigenvalues(
        name=system.name,
        parameter=system.parameter,
        value=system.parameters[system.parameter],
        eigenvalues=roots.eigenvalues,
        verdict=roots.verdict,
        criterion=criterion,
        unstable=_unstable_modes(system, roots),
        certified=statement.certifies(is_small(system)),
        count=roots.count,
        extent=extent,
        shapes=_shapes(system, roots),
        details=details,
        notes=tuple(note for note in notes if note),
        beside=_growth_outside(analysis, outside),
        source=SystemSource(file, analysis.selection),
        proof=statement.to_dict(),
        proof_line=proof_line,
        depends=analysis.depends_on_parameter,
        numbers=roots.numbers,
    )


def _shapes(system: System, roots: SystemRoots) -> JsonObject | None:
    """The mode shapes as JSON holds them; None of a system with too many rows to print."""
    if system.n > SHOWN_ROWS:
        return None
    modes = mode_shapes(Spectrum(roots.eigenvalues))
    return shape_rows(modes, system.row_names if modes else [], "largest entry 1")


def _roots(analysis: SystemAnalysis, look: Sweep | None, prove: bool | None) -> SystemRoots:
    """Compute the selected roots by the solver that serves the system, and have them judged.

    Of a large system whose earlier sweep `look` was a first look the roots are estimates on its
    basis, unless a proof is requested. Other systems are solved. The referee judges small systems
    unless `prove` is False, and bands of larger ones if it is True. Raises InputError for a look at
    another system, and for a first look at other roots.
    """
    file = analysis.file
    system = analysis.system
    if look is not None:
        refuse_other_subject("look", look.source, system)
    if look is not None and not prove and not is_small(system):
        source = look.source
        if isinstance(source, SystemSource) and isinstance(source.reduction, FirstLook):
            if source.selection != analysis.selection:
                raise InputError("look: must be a sweep of the same band, region or modes")
            changes = {system.parameter: system.parameters[system.parameter]}
            return roots_of_first_look(source.reduction, analysis.selection, changes)
    roots = roots_of_file(file, analysis.selection, is_judged=prove is not False)
    if prove and not is_small(system):
        return with_band_proof(file, analysis.selection, roots)
    return roots


def _outside(analysis: SystemAnalysis, roots: SystemRoots) -> tuple[complex, ...] | None:
    """Growing roots outside of the region, the fastest first; None if nothing is known of them."""
    if not roots.outside or not analysis.component_reduction:
        return roots.outside
    # components that were reduced are not valid above their cutoff frequency
    cutoff = math.tau * analysis.file.assembly.cutoff
    return tuple(root for root in roots.outside if abs(root) < cutoff)


def _details(
    analysis: SystemAnalysis,
    roots: SystemRoots,
    outside: tuple[complex, ...] | None,
    doubts: list[str],
) -> JsonObject:
    """Describe the system, and how its roots were computed, as the JSON object holds it.

    outside: growing roots outside of the region, the fastest first, None if nothing is known of
    them; doubts: why the list of roots is not certified.
    """
    file = analysis.file
    system = analysis.system
    region = None
    if isinstance(roots.region, Disc):  # around zero
        region = {"radius": roots.region.radius}
    elif roots.region is not None:
        region = dict(vars(roots.region))
    details: JsonObject = {
        "rows": system.n,
        "parameters": system.given,
        "matrices": matrix_list(file),
        "checks": system_checks(system),
        "region": region,
        "basis": analysis.component_reduction,
        "damped": [damped._asdict() for damped in file.damped],
        "fastest_outside": None,
        "growing_outside": None if outside is None else len(outside),
        "growth_limit": roots.growth_limit,
        "doubts": doubts,
        "known_by": digits_of_files(file) if system.digits else None,
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


def _description(analysis: SystemAnalysis, roots: SystemRoots, details: JsonObject) -> str:
    """Describe the system, its matrices and its contact in lines for people.

    details: see `_details`.
    """
    file = analysis.file
    system = analysis.system
    values = []
    for name, value in system.parameters.items():
        if name == system.parameter and not analysis.depends_on_parameter:
            continue
        # a parameter that is the frequency has no value of its own
        text = "that of each root" if name in system.follows else f"{value:g}"
        values.append(f"{name} = {text}")
    degrees = "degree" if system.n == 1 else "degrees"
    lines = [", ".join([f"{system.n} {degrees} of freedom", *values])]
    if analysis.component_reduction:
        errors_are_known = any(root.error is not None for root in roots.eigenvalues)
        lines.append(f"  {basis_text(analysis.component_reduction, errors=errors_are_known)}")
    for matrix in details["matrices"]:
        source = matrix["file"] or "rows"  # rows: entries that stand in the system file
        if matrix["key"]:
            source += f": {matrix['key']}"
        size = f"{matrix['nonzeros']} non-zeros"
        lines.append(f"  {matrix['part']}: {source}, factor {matrix['factor']}, {size}")
    if file.damped:
        damped_terms = [f"{term.of} by {term.by} {term.value!s:.60}" for term in file.damped]
        lines.append(f"  damped terms: {', '.join(damped_terms)}")
    for name, text in details["checks"].items():
        lines.append(f"  {name}: {text}")
    if file.assembly is not None:
        lines += [f"  {seat}" for seat in file.assembly.seats]
    return "\n".join(lines)


def _growth_outside(analysis: SystemAnalysis, outside: tuple[complex, ...] | None) -> str:
    """Report the growing roots outside of the region in a line; empty if no such root is known.

    outside: these roots, the fastest first; None if nothing is known of them.
    """
    if not outside:
        return ""
    hertz = number(abs(outside[0].imag) / math.tau, 5)
    mode = f"at {hertz} Hz by {number(outside[0].real, 3)} 1/s"
    region = "band" if analysis.selection.band else "region"
    if analysis.component_reduction or not is_small(analysis.system):
        # not all roots were computed: `outside` holds those that the search came upon
        return f"Outside of the {region} nothing was searched, but growth was seen, such as {mode}"
    count = "1 mode grows" if len(outside) == 1 else f"{len(outside)} modes grow"
    return f"Outside of the {region} {count}, the fastest {mode}"


def _unstable_modes(system: System, roots: SystemRoots) -> tuple[UnstableMode, ...]:
    """The growing modes among the roots, the fastest first, of a small system with their onsets.

    The onset is the value of the parameter from which on the mode grows, read on its eigenvalue
    path from zero. It is None

    - where no paths are computed: for many rows, complex matrices, a parameter that is not above
      zero, and matrices that have no value on the way;
    - where no path ends at the mode;
    - where the mode grows from the start of its path on.
    """
    value = system.parameters[system.parameter]
    unstable = growing(roots.computed)
    has_paths = system.real and value > 0.0 and system.n <= ONSET_ROWS
    if not (unstable and has_paths):
        return unstable
    try:
        paths = linear_thresholds(system.balanced, value)
        return with_onsets(unstable, paths, value, SAME_ROOT)
    except InputError:  # no paths, as where a factor divides by the parameter
        return unstable
