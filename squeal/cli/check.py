"""`squeal check`: what a pad or a system from matrices is, before it is analysed: what its files
were read as, mass, lowest real modes, free motions, and what looks like an error of units.

squeal check brake.yaml
"""

import argparse

import squeal
from squeal.cli.command import Parser, Reply
from squeal.cli.options import take, take_files, write_files


def options(parser: Parser) -> None:
    """Options of `squeal check`."""
    take(parser, "modes", modes=10)
    take_files(parser, table="the real modes")


def run(given: argparse.Namespace) -> Reply:
    """Read the scene or system and describe it."""
    answer = squeal.check(given.source.subject(), given.modes)
    write_files(given, answer)
    return Reply.of(answer)
