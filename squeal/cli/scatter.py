"""`squeal scatter`: what tolerances or ranges of many parameters make of the critical friction, or
of the growth rates in a band (--of growth): quantiles, share of stable samples, Sobol indices.

squeal scatter pad.yaml samples.yaml --of growth --journal samples.jsonl --figure scatter.png
"""

import argparse
from pathlib import Path

import squeal
from squeal.cli.command import Parser, Reply
from squeal.cli.options import take, take_files, write_files
from squeal.cli.streams import counter
from squeal.schema import Place


def options(parser: Parser) -> None:
    """Options of `squeal scatter`."""
    parser.add_argument(
        "scatter",
        type=Path,
        metavar="SPREADS.yaml",
        help="how parameters scatter, how many samples are drawn, and how",
    )
    parser.add_argument(
        "--of",
        choices=("threshold", "growth"),
        default="threshold",
        help="the first loss of stability (threshold), or the largest growth rate in --band "
        "(growth)",
    )
    take(parser, "high", "band", "workers")
    take_files(
        parser,
        table="the samples",
        figure="a picture of their distribution",
        journal="samples, to go on after a stop,",
    )


def run(given: argparse.Namespace) -> Reply:
    """Read the scene or system and the spreads, and answer."""
    sampling = squeal.read_spreads(given.scatter)
    subject = given.source.subject()
    with Place(str(given.scatter)).prefixing_errors():
        answer = squeal.scatter(
            subject,
            **sampling,
            high=given.high,
            of=given.of,
            band=given.band,
            journal=given.journal,
            workers=given.workers or 1,
            progress=counter("samples"),
        )
    write_files(given, answer)
    return Reply.of(answer)
