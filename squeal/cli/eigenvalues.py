"""`squeal eigenvalues`: complex eigenvalue analysis of a pad or of a system from matrices.

squeal eigenvalues pad.yaml --sweep 0:0.6:61 --figure roots.png --chart damping.png
squeal eigenvalues brake.yaml --band 500:5000 --sensitivity --energy
"""

import argparse
from dataclasses import replace
from typing import Any

import squeal
from squeal.cli.command import Parser, Reply
from squeal.cli.options import refuse, said, take, take_changes, take_files, write_files
from squeal.cli.streams import steps
from squeal.errors import InputError
from squeal.io.scene import Scene
from squeal.io.writing import picked


def options(parser: Parser) -> None:
    """Options of `squeal eigenvalues`."""
    take(parser, "values workers band")
    words = "how each eigenvalue moves with each parameter"
    parser.add_argument("--sensitivity", action="store_true", help=words)
    words = "what each term of M, C and K does to the growth and frequency of each mode"
    parser.add_argument("--energy", action="store_true", help=words)
    words = "let a referee judge all roots of a pad or of up to 400 rows, which is the rule"
    both = argparse.BooleanOptionalAction
    parser.add_argument("--prove", action=both, default=True, help=words)
    words = "what the verdict was held against too"
    parser.add_argument("--verbose", action="store_true", help=words)
    take(parser, "at modes region method memory shape test")
    take_changes(parser)
    table = "the eigenvalues, or those of the sweep,"
    shapes = "the mode shapes on the nodes of a system"
    chart = "damping ratios over frequency of a sweep, and the pair that meets,"
    drawn = "a picture of them, or of --shape,"
    take_files(parser, table=table, figure=drawn, chart=chart, shapes=shapes)


def run(given: argparse.Namespace) -> Reply:
    """Read the scene or system and analyse it."""
    source = given.source
    subject = source.subject()
    scene = isinstance(subject, Scene)
    if scene:
        refuse(given, "at method shape shapes test", f"{source.name}, a scene")
    elif given.at is not None and f"parameters.{subject.system.parameter}" in source.changes:
        raise InputError(f"{said(given, 'at')}: --set gives it too; one of both is allowed")
    elif (given.shape or given.shapes) and subject.coordinates is None:
        option = said(given, "shape" if given.shape else "shapes")
        raise InputError(f"{option}: needs `coordinates: {{file: nodes.csv}}` in the system file")
    if given.shape and given.figure is None:
        raise InputError(f"{said(given, 'shape')}: needs --figure FILE beside it")
    if not given.values:
        refuse(given, "workers chart", "no --sweep, whose values they share")
    if given.test:  # refused before anything is solved
        from squeal.analysis.pairing import read_test

        read_test(given.test, subject.coordinates)
    asked: dict[str, Any] = picked(given, "band region modes memory") | {"progress": steps()}
    sweep = None
    if given.values:
        swept = subject
        if given.at is not None:
            changed = subject.system.replace({subject.system.parameter: given.at})
            swept = replace(subject, system=changed)
        how = picked(given, "method workers")
        sweep = squeal.sweep(swept, given.values, **how, **asked)
    needed = (given.sensitivity, given.energy, given.change, given.shape, given.shapes, given.test)
    look = sweep if sweep and sweep.is_first_look and not any(needed) else None  # it has no vectors
    spectrum = squeal.eigenvalues(subject, given.at, look=look, prove=given.prove, **asked)
    pairs = [squeal.compare(spectrum, given.test)] if given.test else []
    answers: list[Any] = [spectrum]
    if sweep:
        answers.append(sweep.named(pairs[0].names if pairs else {}))
        answers[0] = spectrum = spectrum.with_onsets(answers[-1])
    shown = answers[-1]
    if given.sensitivity or given.change:
        answers.append(squeal.sensitivity(subject, known=spectrum, matrices=source.matrices))
    drawn = {"other": spectrum, "shape": given.shape} if given.shape else {}
    if given.energy:
        answers.append(squeal.energy(spectrum))
    write_files(given, shown, **drawn)
    if given.chart is not None and sweep:
        answers[1].plot(given.chart, name=source.name, damping=True)
    if given.shapes is not None:
        spectrum.save_shapes(given.shapes)
    answers[1:1] = pairs
    more = f"\n\nheld against rounding: {spectrum.criterion}" * given.verbose
    if (given.shape or given.shapes) and not subject.coordinates.cells:
        from squeal.io.system import POINTS  # which no scene needs

        more += f"\n\n{POINTS}"
    return Reply.of(*answers, judged=scene, more=more)
