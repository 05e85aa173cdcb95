"""`squeal report`: one HTML page about a brake: what grows, since when, moved by what, how sure,
and what was not looked at.

squeal report brake.yaml --band 500:5000 --output brake.html
"""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import squeal
from squeal.cli.command import Parser, Reply
from squeal.cli.options import take, take_files
from squeal.cli.streams import steps
from squeal.io.scene import Scene
from squeal.io.tables import read_table, row_in

if TYPE_CHECKING:
    from squeal.io.system import SystemFile


def options(parser: Parser) -> None:
    """Options of `squeal report`."""
    take(parser, "high", "low", "band", "memory", "parts")
    take_files(parser, page="the page")


def run(given: argparse.Namespace) -> Reply:
    """Read the scene or system, answer, and write the page."""
    subject = given.source.subject()
    parts = None
    if given.parts is not None:
        parts = _read_parts(given.parts, subject)
    answer = squeal.report(
        subject,
        given.high,
        given.band,
        given.memory,
        progress=steps(),
        parts=parts,
        low=given.low,
    )
    if given.page is not None:
        answer.save(given.page, given.source.inputs)
    return Reply.of(answer, subject=subject)


def _read_parts(path: Path, subject: "Scene | SystemFile") -> dict[str, list[int]]:
    """The indices of the rows of each part, by its name, from a table at `path`.

    A line of the table names a part and one of its nodes; for a subject without coordinates, one of
    its rows, counted from 1. Rows of a pad are x, y and theta. Raises InputError.
    """
    count = 3  # rows of a pad
    coordinates = None
    if not isinstance(subject, Scene):
        count = subject.system.n
        coordinates = subject.coordinates
    head = "row"
    node_of_name = {}
    if coordinates is not None:
        head = "node"
        node_of_name = {name: node for node, name in enumerate(coordinates.names)}
    parts: dict[str, list[int]] = {}
    _, lines = read_table(path, ("part", head))
    for at, line in lines:
        part = line["part"]
        if not part:
            raise (at / "part").must_be("", "the name of a part")
        rows = parts.setdefault(part, [])
        name = line[head]
        if coordinates is None:
            rows.append(row_in(name, at / head, count))
        elif name in node_of_name:
            rows += np.flatnonzero(coordinates.nodes == node_of_name[name]).tolist()
        else:
            raise (at / head).must_be(name, "a node of the coordinates")
    return parts
