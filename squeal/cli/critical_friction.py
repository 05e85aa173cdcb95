"""`squeal critical-friction`: every flutter and divergence threshold in 0 < mu <= --mu-max, along
the branch from mu = 0; also of the parameter of a system from matrices."""

import argparse
from typing import Any

import squeal
from squeal.cli.command import Parser, Reply
from squeal.cli.options import refuse, take, take_files, write_files
from squeal.cli.streams import counter, steps
from squeal.io.scene import Scene
from squeal.io.writing import picked
from squeal.schema import Place


def options(parser: Parser) -> None:
    """Options of `squeal critical-friction`."""
    take(parser, "high", high=2.0)
    words = "how the first loss of stability moves with each parameter of a scene"
    parser.add_argument("--sensitivity", action="store_true", help=words)
    take(parser, "scatter workers low band memory")
    take_files(parser, table="the thresholds", figure="a picture of the way to them")


def run(given: argparse.Namespace) -> Reply:
    """Read the scene or system and answer."""
    source = given.source
    if given.scatter is not None:
        refuse(given, "sensitivity low band", "--scatter; one of both is allowed")
        asked = squeal.read_spreads(given.scatter) | {"mu_max": given.high}
        subject, workers = source.subject(), given.workers or 1
        with Place(str(given.scatter)).named():
            answer = squeal.scatter(subject, **asked, workers=workers, progress=counter("samples"))
        write_files(given, answer)
        source.inputs.append(given.scatter)
        return Reply.of(answer)
    refuse(given, "workers", "no --scatter, whose samples they share")
    subject = source.subject(swept=True)
    scene = isinstance(subject, Scene)
    if not scene:
        refuse(given, "sensitivity", f"{source.name}, a system of matrices; `squeal advise` is")
    asked = picked(given, "high low band memory") | {"progress": steps()}
    thresholds = squeal.thresholds(subject, **asked)
    answers: list[Any] = [thresholds]
    if given.sensitivity:
        answers.append(squeal.sensitivity(subject, "threshold", given.high, thresholds))
    write_files(given, thresholds, high=given.high)
    return Reply.of(*answers, judged=scene)
