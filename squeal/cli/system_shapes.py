"""`squeal eigenvalues --shape`: one mode of a system on the places of its nodes."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from squeal.cli.numbers import whole
from squeal.cli.outputs import file_options
from squeal.cli.tables import number
from squeal.errors import InputError

if TYPE_CHECKING:
    from squeal.analysis.systems.roots import SystemRoots
    from squeal.io.coordinates import Coordinates
    from squeal.io.system import SystemFile

OPTIONS = ("shape", "animation")


def shape_options(parser: argparse.ArgumentParser) -> None:
    """The options --shape and --animation."""
    parser.add_argument(
        "--shape",
        metavar="N",
        help="systems with coordinates only: the mode that --png or --gif draw on the nodes (of a "
        "--gif the one that grows most if left out)",
    )
    file_options(parser, animation="a mode of a system with coordinates, moving, into FILE")


def check_shape(given: argparse.Namespace, file: SystemFile) -> Coordinates | None:
    """Where the nodes are if a shape is asked for. Raises InputError before any work."""
    asked = [name for name in OPTIONS if getattr(given, name, None) is not None]
    if not asked:
        return None
    if given.shape is not None and given.figure is None and given.animation is None:
        raise InputError(f"--shape {given.shape}: needs --png FILE or --gif FILE beside it")
    if file.coordinates is None:
        option = "--shape" if given.shape is not None else given.animation_option
        raise InputError(
            f"{option}: is not allowed with {given.source.name}, which says not where its rows "
            "are; a system file with `coordinates: {file: nodes.csv}` is allowed"
        )
    return file.coordinates


def write_shape(given: argparse.Namespace, where: Coordinates, roots: SystemRoots) -> None:
    """Draw the mode that is asked for. Raises InputError for one that is not listed."""
    from squeal.plots.shapes import animate_shape, draw_shape

    listed = roots.eigenvalues
    if not listed:
        raise InputError("--shape: no root is listed; another band or region is required")
    if given.shape is None:
        k = int(np.argmax([e.value.real for e in listed]))
    else:
        k = whole(given.shape, "--shape", 1, len(listed)) - 1
    e = listed[k]
    words = f"mode {k + 1}, {number(e.frequency_hz)} Hz, growth rate {number(e.growth_rate)} 1/s"
    figure: Path | None = given.figure
    if given.shape is not None and figure is not None:
        draw_shape(figure, given.source.name, words, where, e.right)
    if given.animation is not None:
        animate_shape(given.animation, words, where, e.right)
