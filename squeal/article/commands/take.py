"""`squeal article take`: a figure, table or number of the report in a folder: data, caption,
references, origin.

squeal article take fig11 --to figure
"""

import argparse
from pathlib import Path

from squeal.article.report.taking import names, take
from squeal.cli.command import Parser, Reply
from squeal.cli.options import refuse
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
        "--to", type=Path, metavar="FOLDER", help="folder to fill; left out: a new one, NAME"
    )
    parser.add_argument(
        "--build",
        type=Path,
        metavar="FOLDER",
        help="folder that holds results/ and paper/ of a build; left out: the current one if it "
        "holds paper/report.tex, else the repository",
    )


def build_folder(given: Path | None) -> Path:
    """Where the report was built: the folder given, if any, else the current one or the repository.

    Raises InputError if there is no text of the report.
    """
    candidates = [Path(), ROOT.parent]
    where = "neither the current folder nor the repository holds"
    if given is not None:
        candidates = [given]
        where = f"--build {given}: holds no"
    for folder in candidates:
        if (folder / "paper" / "report.tex").is_file():
            return folder
    raise InputError(
        f"{where} paper/report.tex; a clone of this software's repository is allowed in which the "
        "report was built (`make report`, or `snakemake` in it)"
    )


def run(given: argparse.Namespace) -> Reply:
    """List what can be taken, or take it."""
    if given.name is None:
        refuse(given, "to", "build", beside="no NAME, which lists what can be taken")
        listed = names()
        words = "each is taken from a build: run `make report` in a clone, then this command there"
        rows = table(list(listed.items()), right=False)
        return Reply(lambda: {"names": listed}, lambda: f"{rows}\n\n{words}")
    build = build_folder(given.build)
    try:
        taken = take(given.name, build, given.to)
    except InputError:  # a ValueError that says by itself what is wrong
        raise
    except (ValueError, LookupError, TypeError) as error:  # what a reader of a damaged file raises
        words = f"{given.name} cannot be made of its files ({type(error).__name__}: {error}); one "
        words += "may be damaged: build again by `make report`"
        raise InputError(f"{build.resolve()}: {words}") from error
    return Reply(lambda: vars(taken), lambda: "\n".join(f"{taken.folder}/{f}" for f in taken.files))
