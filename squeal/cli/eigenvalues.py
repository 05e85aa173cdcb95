"""`squeal eigenvalues`: complex eigenvalue analysis of a pad or of a system from matrices.

squeal eigenvalues pad.yaml --sweep 0:0.6:61 --figure roots.png --chart damping.png
squeal eigenvalues brake.yaml --band 500:5000 --sensitivity --energy
"""

import argparse
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import squeal
from squeal.cli.command import Parser, Reply
from squeal.cli.options import as_typed, refuse, take, take_changes, take_files, write_files
from squeal.cli.streams import steps
from squeal.errors import InputError
from squeal.io.scene import Scene
from squeal.io.writing import Answer
from squeal.results.eigenvalues import Eigenvalues
from squeal.results.sweep import Sweep

if TYPE_CHECKING:
    from squeal.io.system import SystemFile


def options(parser: Parser) -> None:
    """Options of `squeal eigenvalues`."""
    take(parser, "values", "workers", "band", "width")
    add = parser.add_argument
    add(
        "--sensitivity",
        action="store_true",
        help="how each eigenvalue moves with each parameter",
    )
    add(
        "--energy",
        action="store_true",
        help="what each term of M, C, K does to growth and frequency of each mode, also over a "
        "--sweep",
    )
    add(
        "--prove",
        action=argparse.BooleanOptionalAction,
        help="have a referee prove the roots: the default for a pad and for up to 400 rows; of "
        "larger systems those of a --band",
    )
    add(
        "--verbose",
        action="store_true",
        help="also print the rounding bound that the verdict was compared with",
    )
    take(parser, "at", "modes", "region", "method", "memory", "shape", "test")
    take_changes(parser)
    take_files(
        parser,
        table="the eigenvalues, or those of the sweep,",
        figure="a picture of them, or of --shape,",
        chart="damping ratios over frequency of a sweep, and the pair that meets,",
        shapes="the mode shapes on the nodes of a system",
    )


def run(given: argparse.Namespace) -> Reply:
    """Read the scene or system and analyse it."""
    source = given.source
    subject = source.subject()
    _check_options(given, subject)
    settings = {  # of the spectrum and of the sweep alike
        "band": given.band,
        "region": given.region,
        "modes": given.modes,
        "memory": given.memory,
        "progress": steps(),
        "workers": given.workers,
    }
    sweep = None
    # a sweep whose estimated roots serve, if no option needs those of the full system
    estimate = None
    if given.values:  # of --sweep
        sweep = _sweep(given, subject, settings)
        if sweep.is_first_look and not _needs_full_roots(given):
            estimate = sweep
    spectrum = squeal.eigenvalues(subject, given.at, look=estimate, prove=given.prove, **settings)
    pairs = squeal.compare(spectrum, given.test) if given.test else None
    if sweep:
        if pairs:
            sweep = sweep.named(pairs.names)
        spectrum = spectrum.with_onsets(sweep)
    answers: list[Answer | None] = [spectrum, pairs, sweep]
    if given.sensitivity or given.change:
        answers.append(squeal.sensitivity(subject, known=spectrum, matrices=source.matrices))
    if given.energy:
        answers.append(squeal.energy(spectrum))
        if sweep:
            answers.append(squeal.energy_sweep(sweep))
    _write(given, spectrum, sweep)
    return Reply.of(
        *filter(None, answers),
        subject=subject,
        more=_notes(given, subject, spectrum),
    )


def _sweep(
    given: argparse.Namespace, subject: "Scene | SystemFile", settings: dict[str, Any]
) -> Sweep:
    """The sweep over the values of --sweep, whose modes are numbered at that of --at, if given.

    settings: arguments of `squeal.sweep`.
    """
    swept = subject
    if given.at is not None and not isinstance(subject, Scene):
        system = subject.system  # modes are numbered at its own value of the parameter
        swept = replace(subject, system=system.replace({system.parameter: given.at}))
    return squeal.sweep(swept, given.values, method=given.method, **settings)


def _needs_full_roots(given: argparse.Namespace) -> bool:
    """Whether an option needs roots and vectors that solve the full system."""
    options = ("sensitivity", "energy", "change", "shape", "shapes", "test", "prove")
    return any(getattr(given, option) for option in options)


def _write(given: argparse.Namespace, spectrum: Eigenvalues, sweep: Sweep | None) -> None:
    """Write the files that are requested, of the sweep where there is one."""
    answer: Answer = sweep or spectrum
    if given.shape:
        write_files(given, answer, drawn=spectrum, shape=given.shape)
    else:
        write_files(given, answer)
    if given.chart is not None and sweep:
        width = given.width or "page"
        sweep.save(given.chart, name=given.source.name, damping=True, width=width)
    if given.shapes is not None:
        spectrum.save_shapes(given.shapes)


def _notes(given: argparse.Namespace, subject: "Scene | SystemFile", spectrum: Eigenvalues) -> str:
    """What else stands below the answer for people."""
    notes = ""
    if given.verbose:
        notes += f"\n\nheld against rounding: {spectrum.criterion}"
    coordinates = None if isinstance(subject, Scene) else subject.coordinates
    if (given.shape or given.shapes) and coordinates and not coordinates.cells:
        from squeal.io.coordinates import POINTS  # which no scene needs

        notes += f"\n\n{POINTS}"
    return notes


def _check_options(given: argparse.Namespace, subject: "Scene | SystemFile") -> None:
    """Refuse options that do not go together, before anything is solved. Raises InputError."""
    source = given.source
    if isinstance(subject, Scene):
        refuse(given, "at", "method", "shape", "shapes", "test", beside=f"{source.name}, a scene")
    elif given.at is not None and f"parameters.{subject.system.parameter}" in source.changes:
        raise InputError(f"{as_typed(given, 'at')}: --set gives it too; one of both is allowed")
    elif (given.shape or given.shapes) and subject.coordinates is None:
        option = as_typed(given, "shape" if given.shape else "shapes")
        raise InputError(f"{option}: needs `coordinates: {{file: nodes.csv}}` in the system file")
    if given.shape and given.figure is None:
        raise InputError(f"{as_typed(given, 'shape')}: needs --figure FILE beside it")
    if given.width and given.chart is None:
        raise InputError(f"{as_typed(given, 'width')}: needs --chart FILE beside it")
    if not given.values:
        refuse(given, "chart", beside="no --sweep, which it draws")
    if given.test and not isinstance(subject, Scene):
        from squeal.queries.compare import read_test

        read_test(given.test, subject.coordinates)  # raises if the file cannot be used
