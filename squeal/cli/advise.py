"""`squeal advise`: each parameter lowered and raised by a tolerance, what becomes of the critical
friction, the strongest lever first. Of a pad it is computed again, in steps of friction: windows of
growth narrower than a step may be missed, which `squeal thresholds` finds. Of a system it
moves by its derivatives.

squeal advise pad.yaml --tolerance k1=5%
"""

import argparse

import squeal
from squeal.cli.command import Parser, Reply
from squeal.cli.options import take, take_files, write_files
from squeal.cli.streams import steps
from squeal.errors import InputError


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
    take(parser, "high", "band", "memory")
    take_files(parser, table="the table")


def run(given: argparse.Namespace) -> Reply:
    """Read the scene or system and answer."""
    subject = given.source.subject()
    tolerances: dict[str, float | str] = {}
    for typed in given.tolerance:
        parameter, _, value = typed.partition("=")
        name = parameter.strip()
        if name in tolerances:
            raise InputError(f"--tolerance {typed}: {name} has a tolerance already; one is allowed")
        tolerances[name] = value.strip()
    advice = squeal.advise(
        subject, tolerances, given.high, band=given.band, memory=given.memory, progress=steps()
    )
    write_files(given, advice)
    return Reply.of(advice, subject=subject)
