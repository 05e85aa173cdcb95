"""`squeal map`: the verdict over alpha1 and alpha2, or over any two parameters."""

import argparse
from typing import Any

import squeal
from squeal.cli.command import Parser, Reply
from squeal.cli.options import refuse, said, take, take_files, write_files
from squeal.cli.streams import steps
from squeal.errors import InputError
from squeal.io.scene import Scene
from squeal.model.pad import PARAMETERS
from squeal.schema import Angle, Number, Place, scalar, warn_of_degrees

QUANTITIES = "critical-friction, growth, frequency"


def options(parser: Parser) -> None:
    """Options of `squeal map`."""
    take(parser, "n first second")
    words = f"contours of a number beside the verdicts: {QUANTITIES}"
    parser.add_argument("--quantity", metavar="NAME", help=words)
    take(parser, "band memory")
    take_files(
        parser,
        table="the verdicts",
        figure="the map",
        curve="the curves on which stability is lost",
    )


def axes(given: argparse.Namespace, scene: Scene | None) -> tuple[squeal.Axis, squeal.Axis]:
    """The two axes that the options name. Raises InputError."""
    n = given.n or (41 if scene is None else 200)
    for name, usual in (("first", "alpha1:0:pi"), ("second", "alpha2:0:pi")):
        if getattr(given, name) is None:
            if scene is None:
                raise InputError(f"--{name}: is missing; it must be NAME:LOW:HIGH")
            setattr(given, name, usual)
    return _axis(given, "first", scene, n), _axis(given, "second", scene, n)


def _axis(given: argparse.Namespace, option: str, scene: Scene | None, n: int) -> squeal.Axis:
    at = Place(said(given, option))
    name, *ends = getattr(given, option).split(":")
    log = ends[2:] == ["log"]
    if len(ends) != 2 + log or (log and scene is None):
        form = "NAME:LOW:HIGH" + (", or NAME:LOW:HIGH:log" if scene else "")
        raise at.refuse(f"it must be {form}, a parameter and its range")
    angle = scene is not None and name in PARAMETERS and PARAMETERS[name].angle
    kind = Angle() if angle else Number()
    low, high = (kind.read(scalar(end), at) for end in ends[:2])
    if angle:
        warn_of_degrees(scalar(ends[1]), at)
    with at.named():
        return squeal.Axis(name, low, high, n, log)


def run(given: argparse.Namespace) -> Reply:
    """Read the scene or system, compute the map, write the requested files."""
    source = given.source
    subject, inputs = source.subject()
    scene = subject if isinstance(subject, Scene) else None
    if scene is not None:
        refuse(given, "band", f"{source.name}, a scene; a system from matrices is allowed")
        options: dict[str, Any] = {"quantity": given.quantity, "curves": given.curve is not None}
    else:
        refuse(given, "quantity curve", f"{source.name}, a system of matrices")
        options = {"band": given.band, "memory": given.memory}
        options["progress"] = steps()
    answer = squeal.map(subject, axes(given, scene), **options)
    write_files(given, answer)
    if given.curve is not None:
        answer.curves().save(given.curve)
    return Reply.of(answer, inputs=inputs, judged=scene is not None)
