"""`squeal map`: the verdict over alpha1 and alpha2, or over any two parameters.

squeal map pad.yaml --first mu:0:1 --second k1:1e7:3e7 --n 40 --figure map.png
squeal map brake.yaml --first mu:0:0.8 --second Omega:5:50 --band 500:5000 --n 7 --table map.csv
"""

import argparse
import math
import warnings

import squeal
from squeal.cli.command import Parser, Reply
from squeal.cli.options import AxisRange, as_typed, take, take_files, write_files
from squeal.cli.streams import steps
from squeal.errors import InputError, InputWarning
from squeal.io.scene import Scene
from squeal.model.pad import PARAMETERS
from squeal.schema import Place, warn_of_degrees

ANGLES = {  # of a scene, where no axis is given
    "first": AxisRange("alpha1", 0.0, math.pi, log=False),
    "second": AxisRange("alpha2", 0.0, math.pi, log=False),
}
POINTS_OF_SCENE = 200  # a side of the map, where no number is given
POINTS_OF_SYSTEM = 41


def options(parser: Parser) -> None:
    """Options of `squeal map`."""
    take(parser, "n", "first", "second")
    parser.add_argument(
        "--quantity",
        metavar="NAME",
        help="contours beside the verdicts: critical-friction, growth, frequency",
    )
    take(parser, "workers", "band", "memory")
    take_files(
        parser,
        table="the verdicts",
        figure="the map",
        curves="the curves on which stability is lost",
    )


def run(given: argparse.Namespace) -> Reply:
    """Read the scene or system, compute the map, write the requested files."""
    subject = given.source.subject()
    is_scene = isinstance(subject, Scene)
    curves = given.curves is not None or (is_scene and given.figure is not None)
    first = _axis(given, "first", is_scene)
    second = _axis(given, "second", is_scene)
    if first.name == second.name:
        raise InputError(f"{as_typed(given, 'second')}: must name another parameter than --first")
    answer = squeal.map(
        subject,
        (first, second),
        curves=curves,
        quantity=given.quantity,
        band=given.band,
        memory=given.memory,
        workers=given.workers,
        progress=steps(),
    )
    write_files(given, answer)
    if given.curves is not None:
        answer.curves().save(given.curves)
        if not answer.details["threshold_curve"]:
            warnings.warn(
                f"{as_typed(given, 'curves')}: without a curve: no two neighbours differ in "
                "whether something grows",
                InputWarning,
                stacklevel=2,
            )
    return Reply.of(answer, subject=subject)


def _axis(given: argparse.Namespace, option: str, is_scene: bool) -> squeal.Axis:
    """The axis that --first or --second names. Raises InputError; warns of degrees."""
    at = Place(as_typed(given, option))
    axis = getattr(given, option)
    if axis is None and not is_scene:
        raise InputError(f"--{option}: missing; a system's map needs it as NAME:LOW:HIGH")
    name, low, high, log = axis or ANGLES[option]
    points = given.n or (POINTS_OF_SCENE if is_scene else POINTS_OF_SYSTEM)
    with at.prefixing_errors():
        axis = squeal.Axis(name, low, high, points, log)
    if is_scene and name in PARAMETERS and PARAMETERS[name].angle:
        warn_of_degrees(high, at)
    return axis
