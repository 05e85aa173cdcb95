"""`squeal article take`: a figure, table or number of the report in a folder: data, caption,
references, origin.

squeal article take fig11 --to figure
"""

import argparse
from pathlib import Path

from squeal.article.report.taking import names, take
from squeal.cli.command import Parser, Reply
from squeal.errors import InputError
from squeal.io.provenance import ROOT
from squeal.io.writing import aligned_text as table


def options(parser: Parser) -> None:
    """Options of `squeal article take`."""
    parser.add_argument(
        "name",
        nargs="?",
        metavar="NAME",
        help="fig11, findings, or the key of a number such as b2-c.extrema.Rn; left out: list them",
    )
    parser.add_argument(
        "--to", type=Path, metavar="FOLDER", help="folder to fill (a new one of that name)"
    )
    parser.add_argument(
        "--build",
        type=Path,
        metavar="FOLDER",
        help="folder that holds results/ and paper/ of a build (this one, or the repository's)",
    )


def build_folder(given: Path | None) -> Path:
    """Where the report was built. Raises InputError if there is no text of the report."""
    candidates = [given] if given else [Path(), ROOT.parent]
    for folder in candidates:
        if (folder / "paper" / "report.tex").is_file():
            return folder
    raise InputError(
        f"--build {candidates[0]}: holds no paper/report.tex; a clone of this software's "
        "repository is allowed in which the report was built (`make report`, or `snakemake` in it)"
    )


def run(given: argparse.Namespace) -> Reply:
    """List what can be taken, or take it."""
    if given.name is None:
        listed = names()
        words = "each is taken from a build: run `make report` in a clone, then this command there"
        rows = table(list(listed.items()), right=False)
        return Reply(lambda: {"names": listed}, lambda: f"{rows}\n\n{words}")
    build = build_folder(given.build)
    try:
        taken = take(given.name, build, given.to)
    except InputError:  # a ValueError that says by itself what is wrong
        raise
    except (ValueError, LookupError, TypeError):
        words = "holds a damaged file; a build by `make report` is allowed"
        raise InputError(f"--build {build}: {words}") from None
    return Reply(lambda: vars(taken), lambda: "\n".join(f"{taken.folder}/{f}" for f in taken.files))
