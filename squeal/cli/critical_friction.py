"""`squeal critical-friction`: every flutter and divergence threshold in 0 < mu <= --mu-max, along
the branch from mu = 0; also of the parameter of a system from matrices."""

import argparse
from typing import Any

import squeal
from squeal.cli.command import Parser, Reply
from squeal.cli.options import not_allowed, refuse, said, take, take_files, write_files
from squeal.cli.streams import progress_line, steps
from squeal.io.scene import Scene
from squeal.schema import Place


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
        raise not_allowed(said(given, "high"), "above 0 and at most 1000")


def run(given: argparse.Namespace) -> Reply:
    """Read the scene or system and answer."""
    if given.scatter is None:
        refuse(given, "workers", "no --scatter, whose samples they share")
    else:
        refuse(given, "sensitivity", "--scatter; one of both is allowed")
    source = given.source
    subject, inputs = source.subject()
    scene = isinstance(subject, Scene)
    if scene:
        check_high(given)
    if given.scatter is not None:
        return _scattered(given, subject)
    options: dict[str, Any] = {}
    if scene:
        refuse(given, "min band", f"{source.name}, a scene; a system from matrices is allowed")
    else:
        refuse(given, "sensitivity", f"{source.name}, a system of matrices; `squeal advise` is")
        source.warn_if_constant(subject)
        options = {"low": given.min, "band": given.band, "memory": given.memory}
        options["progress"] = steps()
    thresholds = squeal.thresholds(subject, given.high, **options)
    answers: list[Any] = [thresholds]
    if given.sensitivity:
        answers.append(squeal.sensitivity(subject, "threshold", given.high, thresholds))
    write_files(given, thresholds, high=given.high)
    return Reply.of(*answers, inputs=inputs, judged=scene)


def _scattered(given: argparse.Namespace, subject: Any) -> Reply:
    """What tolerances make of the first loss of stability. Raises InputError."""
    spreads = squeal.read_spreads(given.scatter)
    with Place(str(given.scatter)).named(), progress_line("samples") as progress:
        answer = squeal.scatter(subject, spreads, given.high, given.workers or 1, progress)
    write_files(given, answer)
    return Reply.of(answer, inputs=[given.source.file, given.scatter])
