"""`squeal article identify`: search for the parameter set that satisfies most statements.

squeal article identify --starts 1 --state starts.json --scenes best
"""

import argparse
import math
import os
from pathlib import Path
from typing import Any

from squeal.article.claims.judging import JudgedClaim
from squeal.article.identify.search import SearchResult, judged, search
from squeal.article.identify.write import check_folder, write_scenes
from squeal.cli.command import Parser, Reply
from squeal.cli.options import numbers, whole
from squeal.cli.streams import say
from squeal.errors import InputError
from squeal.io.writing import aligned_text as table
from squeal.io.writing import copied_attributes
from squeal.model.contact import FORMULATION_CHOICES, Formulation

MINUTES = numbers("a number of at least 0", lambda minutes: minutes >= 0.0, float)


def options(parser: Parser) -> None:
    """Options of `squeal article identify`."""
    for key, choices in FORMULATION_CHOICES.items():
        parser.add_argument(
            f"--{key.replace('_', '-')}", choices=choices, default=choices[0], help="formulation"
        )
    add = parser.add_argument
    add("--seed", read=whole(0), default=1, metavar="N", help="whole number (1 if left out)")
    add("--minutes", read=MINUTES, default=10.0, metavar="M", help="how long (10 if left out)")
    add("--starts", read=whole(1), metavar="N", help="so many starts, however long they take")
    parser.add_argument(
        "--state",
        type=Path,
        metavar="FILE",
        help="keep the finished starts in FILE and go on after them",
    )
    parser.add_argument(
        "--scenes", type=Path, metavar="FOLDER", help="write the best set's scenes into FOLDER"
    )
    parser.add_argument(
        "--overwrite", action="store_true", help="with --scenes: replace scenes that are there"
    )


def data(result: SearchResult, claims: list[JudgedClaim]) -> dict[str, Any]:
    """The best set as a JSON object; its numbers are dimensionless (w = m = k1 = 1)."""
    answer = copied_attributes(result, "numbers distance starts sets")
    answer |= {"reproduced": sum(one.holds for one in claims)}
    return answer | {"claims": [copied_attributes(one, "id verdict margin") for one in claims]}


def text(result: SearchResult, claims: list[JudgedClaim]) -> str:
    """The best set for people."""
    rows = [(f"  {name}", f"{value:.6g}") for name, value in result.numbers.items()]
    failing = [(f"  {j.id}", f"{j.margin:+.3g}", j.measured) for j in claims if not j.holds]
    held = len(claims) - len(failing)
    return "\n".join(
        [
            f"{result.sets} sets from {result.starts} starts; best set (w = m = k1 = 1)",
            table(rows),
            f"{held} of {len(claims)} claims reproduced; not so",
            table(failing, right=False) if failing else "  none",
        ]
    )


def run(given: argparse.Namespace) -> Reply:
    """Search, and write the scenes if requested."""
    formulation = Formulation(given.line_force, given.delta_from, given.delta_moment)
    starts = math.inf
    seconds = 60.0 * given.minutes
    if given.starts is not None:  # then the number of starts ends the search, not the time
        starts = given.starts
        seconds = math.inf
    if given.scenes is not None:
        check_folder(given.scenes, given.overwrite)
    elif given.overwrite:
        raise InputError("--overwrite: is not allowed without --scenes, which it replaces")
    result = search(formulation, given.seed, seconds, given.state, os.cpu_count() or 1, say, starts)
    claims = judged(result, formulation)
    if given.scenes is not None:
        write_scenes(result.numbers, formulation, given.scenes)
    return Reply(lambda: data(result, claims), lambda: text(result, claims), inputs=[])
