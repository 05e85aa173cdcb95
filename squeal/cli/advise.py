"""`squeal advise`: each parameter lowered and raised by a tolerance, the critical friction computed
anew, the strongest lever first. Variations of a pad are followed in steps of friction: windows of
growth narrower than a step may be missed, which `squeal critical-friction` finds."""

import argparse
import math

import squeal
from squeal.cli.command import Parser, Reply
from squeal.cli.critical_friction import check_high
from squeal.cli.options import not_allowed, take, take_files, write_files
from squeal.cli.streams import progress_line
from squeal.errors import InputError
from squeal.io.scene import Scene


def options(parser: Parser) -> None:
    """Options of `squeal advise`."""
    parser.add_argument(
        "--tolerance",
        metavar="NAME=VALUE",
        action="append",
        default=[],
        help="how far a parameter is lowered and raised, such as k1=5%% or alpha1=0.01 in its own "
        "unit (repeatable; left out: 2%%, an angle 0.02 rad, and nothing that is 0)",
    )
    take(parser, "high", high=2.0)
    take_files(parser, table="the table")


def tolerances(given: list[str]) -> dict[str, squeal.Tolerance]:
    """The tolerances that the options name. Raises InputError."""
    named: dict[str, squeal.Tolerance] = {}
    for one in given:
        name, equals, text = (part.strip() for part in one.partition("="))
        share = text.endswith("%")
        try:
            size = float(text.removesuffix("%")) / (100.0 if share else 1.0)
        except ValueError:
            size = math.nan
        if not equals or not 0.0 < size < math.inf:
            words = "NAME=VALUE with a number above 0 in the parameter's unit, or with a share"
            raise not_allowed(f"--tolerance {one}", f"{words} such as 5%")
        if name in named:
            raise InputError(f"--tolerance {one}: {name} has a tolerance already; one is allowed")
        named[name] = squeal.Tolerance(size, share)
    return named


def run(given: argparse.Namespace) -> Reply:
    """Read the scene or system and answer."""
    subject, inputs = given.source.subject()
    if isinstance(subject, Scene):
        check_high(given)
    with progress_line("parameters") as progress:
        advice = squeal.advise(subject, tolerances(given.tolerance), given.high, progress)
    write_files(given, advice)
    return Reply.of(advice, inputs=inputs, judged=isinstance(subject, Scene))
