"""`squeal eigenvalues`: complex eigenvalue analysis of a pad or of a system from matrices."""

import argparse
from typing import Any

import squeal
from squeal.cli.command import Parser, Reply
from squeal.cli.options import not_allowed, refuse, said, take, take_files, write_files
from squeal.cli.streams import steps
from squeal.errors import InputError
from squeal.io.scene import Scene


def options(parser: Parser) -> None:
    """Options of `squeal eigenvalues`."""
    take(parser, "sweep band")
    words = "how each eigenvalue moves with each parameter"
    parser.add_argument("--sensitivity", action="store_true", help=words)
    take(parser, "at modes region method memory shape")
    table = "the eigenvalues, or those of the sweep,"
    take_files(parser, table=table, figure="a picture of them, or of --shape")


def run(given: argparse.Namespace) -> Reply:
    """Read the scene or system and analyse it."""
    source = given.source
    subject, inputs = source.subject()
    options: dict[str, Any] = {}
    if isinstance(subject, Scene):
        refuse(given, "band modes region method shape at", f"{source.name}, a scene")
        if given.sweep is not None and not 0.0 <= given.sweep[0] < given.sweep[-1] <= 1e3:
            raise not_allowed(said(given, "sweep"), "A:B:N with 0 <= A < B <= 1000")
    else:
        options = {"region": given.region, "modes": given.modes, "memory": given.memory}
        options |= {"band": given.band, "progress": steps()}
        if given.at is not None:
            source.check_at(subject, said(given, "at"))
        _check_shape(given, subject)
        if given.sweep:
            source.warn_if_constant(subject)
    spectrum = squeal.eigenvalues(subject, given.at, **options)
    answers: list[Any] = [spectrum]
    if given.sweep:
        if options:
            options["method"] = given.method
        answers.append(squeal.sweep(subject, given.sweep, **options))
    shown = answers[-1]
    if given.sensitivity:
        answers.append(squeal.sensitivity(subject, known=spectrum))
    if given.shape is None:
        write_files(given, shown)
    else:
        spectrum.plot(given.figure, name=source.name, shape=given.shape)
        if given.table is not None:
            shown.save(given.table)
    return Reply.of(*answers, inputs=inputs, judged=isinstance(subject, Scene))


def _check_shape(given: argparse.Namespace, file: Any) -> None:
    """Refuse a shape without a picture, or of a system that says not where its rows are."""
    if given.shape is None:
        return
    if given.figure is None:
        raise InputError(f"{said(given, 'shape')}: needs --png FILE beside it")
    if file.coordinates is None:
        raise InputError(
            f"{said(given, 'shape')}: is not allowed with {given.source.name}, which says not "
            "where its rows are; a system file with `coordinates: {file: nodes.csv}` is allowed"
        )
