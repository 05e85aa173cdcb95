"""`squeal thresholds`: every flutter and divergence threshold in 0 < mu <= --max, along the branch
from mu = 0; also of the parameter of a system from matrices. `critical-friction` is the same.

squeal thresholds pad.yaml --sensitivity
squeal thresholds brake.yaml --max 1 --band 500:5000 --figure loci.png
"""

import argparse

import squeal
from squeal.cli.command import Parser, Reply
from squeal.cli.options import take, take_changes, take_files, write_files
from squeal.cli.streams import steps
from squeal.io.writing import Answer
from squeal.queries.options import upper_end


def options(parser: Parser) -> None:
    """Options of `squeal thresholds`."""
    take(parser, "high")
    parser.add_argument(
        "--sensitivity",
        action="store_true",
        help="how the first loss of stability moves with each parameter",
    )
    parser.add_argument(
        "--prove",
        action=argparse.BooleanOptionalAction,
        help="have a referee prove them, of a pad or of up to 400 rows: the default for a pad and "
        "for up to 40 rows",
    )
    take(parser, "workers", "low", "band", "region", "memory")
    take_changes(parser)
    take_files(parser, table="the thresholds", figure="a picture of the way to them")


def run(given: argparse.Namespace) -> Reply:
    """Read the scene or system and answer."""
    subject = given.source.subject()
    high = upper_end(subject, given.high)
    thresholds = squeal.thresholds(
        subject,
        high=high,
        low=given.low,
        band=given.band,
        region=given.region,
        memory=given.memory,
        workers=given.workers,
        prove=given.prove,
        progress=steps(),
    )
    answers: list[Answer] = [thresholds]
    if given.sensitivity or given.change:
        sensitivity = squeal.sensitivity(
            subject, of="threshold", known=thresholds, matrices=given.source.matrices
        )
        answers.append(sensitivity)
    write_files(given, thresholds, high=high)
    return Reply.of(*answers, subject=subject)
