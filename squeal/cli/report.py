"""`squeal report`: one HTML page about a brake: what grows, since when, moved by what, how sure,
and what was not looked at.

squeal report brake.yaml --band 500:5000 --output brake.html
"""

import argparse

import squeal
from squeal.cli.command import Parser, Reply
from squeal.cli.options import take, take_files
from squeal.cli.streams import steps
from squeal.io.scene import Scene


def options(parser: Parser) -> None:
    """Options of `squeal report`."""
    take(parser, "high", "band", "memory")
    take_files(parser, page="the page")


def run(given: argparse.Namespace) -> Reply:
    """Read the scene or system, answer, and write the page."""
    subject = given.source.subject()
    answer = squeal.report(
        subject, high=given.high, band=given.band, memory=given.memory, progress=steps()
    )
    if given.page is not None:
        answer.save(given.page, given.source.inputs)
    return Reply.of(answer, warnings_in_reply=isinstance(subject, Scene))
