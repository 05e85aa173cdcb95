"""`squeal critical-friction`: every flutter and divergence threshold in 0 < mu <= --mu-max, along
the branch from mu = 0; also of the parameter of a system from matrices."""

import argparse
from typing import Any

import squeal
from squeal.cli.command import Parser, Reply
from squeal.cli.options import refuse, said, take, take_files
from squeal.cli.streams import progress_line, steps
from squeal.errors import InputError
from squeal.io.scene import Scene


def options(parser: Parser) -> None:
    """Options of `squeal critical-friction`."""
    take(parser, "high", high=2.0)
    words = "how the first loss of stability moves with each parameter of a scene"
    parser.add_argument("--sensitivity", action="store_true", help=words)
    take(parser, "scatter workers min band memory")
    take_files(parser, table="the thresholds", figure="a picture of the way to them")


def check_high(given: argparse.Namespace) -> None:
    """Refuse an upper end that no friction of a scene may have. Raises InputError."""
    if not 0.0 < given.high <= 1000.0:
        raise InputError(
            f"{said(given, 'high')}: is not allowed; it must be above 0 and at most 1000"
        )


def run(given: argparse.Namespace) -> Reply:
    """Read the scene or system and answer."""
    if given.scatter is None:
        refuse(given, "workers", "no --scatter, whose samples they share")
    elif given.sensitivity:
        raise InputError("--sensitivity: is not allowed with --scatter; one of both is allowed")
    source = given.source
    subject, inputs = source.subject()
    scene = isinstance(subject, Scene)
    if scene:
        check_high(given)
    if given.scatter is not None:
        return _scattered(given, subject)
    asked: dict[str, Any] = {"low": given.min, "band": given.band, "memory": given.memory}
    if scene:
        refuse(given, "min band", f"{source.name}, a scene; a system from matrices is allowed")
        asked = {}
    else:
        if given.sensitivity:
            raise InputError(
                f"--sensitivity: is not allowed with {source.name}, a system of matrices; "
                "`squeal advise` is"
            )
        source.warn_if_constant(subject)
        asked["progress"] = steps(given.progress)
    found = squeal.thresholds(subject, given.high, **asked)
    answers: list[Any] = [found]
    if given.sensitivity:
        answers.append(squeal.sensitivity(subject, "threshold", given.high, found))
    if given.table is not None:
        found.save(given.table)
    if given.figure is not None:
        found.plot(given.figure, name=source.name, high=given.high)
    return Reply.of(*answers, inputs=inputs, judged=scene)


def _scattered(given: argparse.Namespace, subject: Any) -> Reply:
    """What tolerances make of the first loss of stability. Raises InputError."""
    asked = squeal.read_spreads(given.scatter)
    try:
        with progress_line("samples") as progress:
            found = squeal.scatter(subject, asked, given.high, given.workers or 1, progress)
    except InputError as error:
        raise InputError(f"{given.scatter}: {error}") from None
    if given.table is not None:
        found.save(given.table)
    if given.figure is not None:
        found.plot(given.figure, name=given.source.name)
    return Reply.of(found, inputs=[given.source.file, given.scatter])
