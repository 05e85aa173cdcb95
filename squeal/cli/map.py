"""`squeal map`: the verdict over alpha1 and alpha2, or over any two parameters."""

import argparse
from typing import Any

import squeal
from squeal.cli.command import Parser, Reply
from squeal.cli.options import refuse, said, take, take_files
from squeal.cli.streams import steps
from squeal.errors import InputError
from squeal.io.document import scalar
from squeal.io.scene import Scene
from squeal.model.pad import PARAMETERS
from squeal.schema.values import Angle, Number, Place, warn_of_degrees

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


def _axis(given: argparse.Namespace, name: str, scene: Scene | None, n: int) -> Any:
    """The axis that --first or --second names. Raises InputError."""
    at = Place(said(given, name))
    parts = getattr(given, name).split(":")
    log = parts[3:] == ["log"]
    if len(parts) != 3 + log or (log and scene is None):
        form = "NAME:LOW:HIGH" + (", or NAME:LOW:HIGH:log" if scene else "")
        raise at.refuse(f"it must be {form}, a parameter and its range")
    angle = scene is not None and parts[0] in PARAMETERS and PARAMETERS[parts[0]].angle
    kind = Angle() if angle else Number()
    ends = [scalar(end) for end in parts[1:3]]
    low, high = (kind.read(end, at) for end in ends)
    if angle:
        warn_of_degrees(ends[1], at)
    try:
        return squeal.Axis(parts[0], low, high, n, log)
    except InputError as error:
        raise InputError(f"{said(given, name)}: {error}") from None


def axes(given: argparse.Namespace, scene: Scene | None) -> tuple[Any, Any]:
    """The two axes that the options name. Raises InputError."""
    n = given.n or (41 if scene is None else 200)
    for name, usual in (("first", "alpha1:0:pi"), ("second", "alpha2:0:pi")):
        if getattr(given, name) is None:
            if scene is None:
                raise InputError(f"--{name}: is missing; it must be NAME:LOW:HIGH")
            setattr(given, name, usual)
    return _axis(given, "first", scene, n), _axis(given, "second", scene, n)


def run(given: argparse.Namespace) -> Reply:
    """Read the scene or system, compute the map, write what is asked."""
    source = given.source
    subject, inputs = source.subject()
    asked: dict[str, Any] = {"quantity": given.quantity, "curves": given.curve is not None}
    scene = subject if isinstance(subject, Scene) else None
    if scene is not None:
        refuse(given, "band", f"{source.name}, a scene; a system from matrices is allowed")
    else:
        refuse(given, "quantity curve", f"{source.name}, a system of matrices")
        asked = {"band": given.band, "memory": given.memory, "progress": steps(given.progress)}
    found = squeal.map(subject, axes(given, scene), **asked)
    if given.table is not None:
        found.save(given.table)
    if given.curve is not None:
        found.curves().save(given.curve)
    if given.figure is not None:
        found.plot(given.figure, name=source.name)
    return Reply.of(found, inputs=inputs, judged=scene is not None)
