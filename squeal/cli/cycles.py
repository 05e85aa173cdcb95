"""`squeal cycles`: the periodic motion to which a scene of B1, B2 or BN settles, its Floquet
multipliers, and the branch of such motions over a parameter, also where sliding is stable.

squeal cycles pad.yaml --set "damping.ratios=[0.02, 0.02, 0.02]"
"""

import argparse

import squeal
from squeal.cli.command import Parser, Reply
from squeal.cli.options import named_range, take_files, whole, write_files
from squeal.queries.cycles import WINDOWS


def options(parser: Parser) -> None:
    """Options of `squeal cycles`."""
    parser.add_argument(
        "--over",
        metavar="NAME:LOW:HIGH",
        read=named_range,
        help="follow the motion over this parameter, such as mu:0.1:0.6",
    )
    parser.add_argument(
        "--windows",
        metavar="N",
        read=whole(1, 100_000),
        default=WINDOWS,
        help="how many times the observation time of the scene its motion may take to settle "
        f"({WINDOWS})",
    )
    take_files(parser, table="the cycles", figure="amplitude over the parameter, beside sliding")


def run(given: argparse.Namespace) -> Reply:
    """Read the scene, find and follow its cycle, write the files that are requested."""
    scene = given.source.scene()
    answer = squeal.cycles(scene, given.over, given.windows)
    write_files(given, answer)
    return Reply.of(answer)
