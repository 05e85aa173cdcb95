"""`squeal conditions`: what grows at each combination of operating conditions (friction, pressure,
temperature, speed, direction), and at which share of them each mode does.

squeal conditions pad.yaml --axis mu=0.2:0.6:5 --axis F_n=2000,4500 --figure matrix.png
squeal conditions brake.yaml --axis mu=0.3,0.5 --axis Omega=10:30:5 --band 500:5000
"""

import argparse

import squeal
from squeal.cli.command import Parser, Reply
from squeal.cli.options import SWEEP, take, take_files, write_files
from squeal.cli.streams import steps
from squeal.errors import InputError
from squeal.schema import Angle, Place, scalar


def options(parser: Parser) -> None:
    """Options of `squeal conditions`."""
    parser.add_argument(
        "--axis",
        metavar="NAME=VALUES",
        action="append",
        default=[],
        required=True,
        help="a parameter and its values: N from A to B, or a list (repeatable)",
    )
    take(parser, "band", "memory")
    take_files(parser, table="the conditions", figure="the matrix of the conditions")


def read_axes(texts: list[str]) -> dict[str, list[float]]:
    """The values of each axis by its name. Raises InputError."""
    axes: dict[str, list[float]] = {}
    for text in texts:
        at = Place(f"--axis {text}")
        name, _, values = text.partition("=")
        if name in axes:
            raise at.refuse(f"{name} is given already; each axis is allowed once")
        with at.prefixing_errors():
            axes[name] = SWEEP(values) if ":" in values else _listed(values)
    return axes


def _listed(values: str) -> list[float]:
    """Numbers between commas. Raises InputError."""
    numbers = []
    for text in values.split(","):
        number = Angle().convert(scalar(text))
        if number is None:
            raise InputError(
                "is not allowed; it must be NAME=A:B:N or NAME=A,B,... with finite numbers"
            )
        numbers.append(number)
    return numbers


def run(given: argparse.Namespace) -> Reply:
    """Read the scene or system and the axes, and answer."""
    axes = read_axes(given.axis)
    subject = given.source.subject()
    answer = squeal.conditions(
        subject, axes, band=given.band, memory=given.memory, progress=steps()
    )
    write_files(given, answer)
    return Reply.of(answer, subject=subject)
