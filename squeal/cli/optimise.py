"""`squeal optimise`: parameters within bounds at which the fastest growing root of a band grows
least, by searches on a reduced system whose result is computed on the full one.

squeal optimise brake.yaml --bounds Omega:5:50 --band 500:5000 --starts 1
"""

import argparse

import squeal
from squeal.cli.command import Parser, Reply
from squeal.cli.options import named_range, take, take_files, whole, write_files
from squeal.cli.streams import steps
from squeal.errors import InputError
from squeal.schema import Place


def options(parser: Parser) -> None:
    """Options of `squeal optimise`."""
    parser.add_argument(
        "--bounds",
        metavar="NAME:LOW:HIGH",
        action="append",
        required=True,
        help="a parameter and the range in which it may lie (repeatable)",
    )
    take(parser, "band")
    parser.add_argument(
        "--starts", metavar="N", read=whole(1, 10_000), default=4, help="number of searches (4)"
    )
    parser.add_argument(
        "--seed",
        metavar="N",
        read=whole(0, 2**32 - 1),
        default=1,
        help="of the random numbers from which they start (1)",
    )
    take(parser, "region", "memory")
    take_files(parser, table="the parameters")


def run(given: argparse.Namespace) -> Reply:
    """Read the system and answer."""
    bounds: dict[str, tuple[float, float]] = {}
    for typed in given.bounds:
        with Place(f"--bounds {typed}").prefixing_errors():
            name, low, high = named_range(typed)
            if name in bounds:
                raise InputError(f"{name} has bounds already; one range is allowed")
        bounds[name] = (low, high)
    optimum = squeal.optimise(
        given.source.system(),
        bounds,
        band=given.band,
        region=given.region,
        starts=given.starts,
        rng=given.seed,
        memory=given.memory,
        progress=steps(),
    )
    write_files(given, optimum)
    return Reply.of(optimum)
