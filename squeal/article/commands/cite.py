"""`squeal article cite`: BibTeX for the article, this software and what a result was computed with.

squeal article cite result.json
"""

import argparse
import dataclasses
import json
from pathlib import Path

from squeal.article.records import from_dict
from squeal.article.report.bibliography import behind, installed, references
from squeal.cli.command import Parser, Reply
from squeal.io.provenance import Provenance
from squeal.schema import Place, read_content


def options(parser: Parser) -> None:
    """Options of `squeal article cite`."""
    parser.add_argument(
        "results",
        nargs="*",
        type=Path,
        metavar="RESULT.json",
        help="results whose libraries are cited, as --json writes them (left out: all that are "
        "installed here)",
    )


def made_by(path: Path) -> Provenance:
    """The provenance in a result file. Raises InputError if the file holds none."""
    at = Place(str(path))
    content = read_content(path, at)
    try:
        made = from_dict(Provenance, json.loads(content)["provenance"])
        behind([made])
        return made
    except (ValueError, KeyError, TypeError, RecursionError):
        words = "holds no provenance; the JSON output of a squeal command is allowed"
        raise at.refuse(words) from None


def run(given: argparse.Namespace) -> Reply:
    """Collect the references of some results, or of what is installed."""
    made = [made_by(path) for path in given.results]
    cited = references(behind(made) if made else installed())
    return Reply(
        lambda: {"references": [dataclasses.asdict(entry) for entry in cited]},
        lambda: "\n\n".join(entry.bibtex for entry in cited),
    )
