"""`squeal cycles`: the periodic motion to which a B1 or B2 scene settles, its Floquet multipliers,
and the branch of such motions over a parameter, also where sliding is stable."""

import argparse
import math

import squeal
from squeal.analysis.cycles import WINDOWS
from squeal.cli.command import Parser, Reply
from squeal.cli.options import not_allowed, said, take_files, whole, write_files
from squeal.errors import InputError


def parameter_range(given: str, option: str) -> tuple[str, float, float]:
    """The parameter and range that NAME:LOW:HIGH names. Raises InputError."""
    name, *ends = given.split(":")
    try:
        low, high = map(float, ends)
    except ValueError:
        low = high = 0.0
    if not -math.inf < low < high < math.inf:
        words = "NAME:LOW:HIGH with LOW < HIGH, such as mu:0.1:0.6"
        raise not_allowed(f"{option} {given}", words)
    return name, low, high


def options(parser: Parser) -> None:
    """Options of `squeal cycles`."""
    parser.add_argument(
        "--over",
        metavar="NAME:LOW:HIGH",
        read=parameter_range,
        help="follow the motion over this parameter, such as mu:0.1:0.6",
    )
    parser.add_argument(
        "--windows",
        metavar="N",
        read=whole(1, 100_000),
        default=WINDOWS,
        help=f"times of the scene in which its motion may settle ({WINDOWS})",
    )
    take_files(parser, table="the cycles", figure="amplitude over the parameter, beside sliding")


def run(given: argparse.Namespace) -> Reply:
    """Read the scene, find and follow its cycle, write the files that are requested."""
    scene = given.source.scene("simulate")
    try:
        answer = squeal.cycles(scene, given.over, given.windows)
    except InputError as error:
        if given.over is None:
            raise
        words = str(error).removeprefix("cycles: over: ")
        raise InputError(f"{given.source.name}: {said(given, 'over')}: {words}") from None
    write_files(given, answer)
    return Reply.of(answer)
