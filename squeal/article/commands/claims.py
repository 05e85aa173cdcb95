"""`squeal claims`: the article's statements, each with its verdict as measured on its scenes."""

import argparse
from collections.abc import Iterable
from pathlib import Path

from squeal.article.cases import HISTORY_FIGURES
from squeal.article.results.claims import Claims
from squeal.article.studies.claims import study
from squeal.cli.command import Parser, Reply
from squeal.errors import InputError
from squeal.io.answer import aligned as table
from squeal.io.provenance import ROOT


def options(parser: Parser) -> None:
    """Options of `squeal claims`."""
    parser.add_argument(
        "--scenes",
        type=Path,
        metavar="FOLDER",
        help="folder with b1-a.yaml to b2-d.yaml (workflow/scenes if left out)",
    )


def scene_files(given: Path | None, stems: Iterable[str]) -> list[Path]:
    """The files of the article's scenes. Raises InputError if their folder holds none."""
    places = [given] if given else [Path("workflow/scenes"), ROOT.parent / "workflow" / "scenes"]
    for folder in places:
        if (folder / "b1-a.yaml").is_file():
            return [folder / f"{stem}.yaml" for stem in stems]
    raise InputError(
        f"--scenes {places[0]}: holds no b1-a.yaml; a folder with the article's scenes is allowed, "
        "such as workflow/scenes of this software's repository or one that `squeal identify "
        "--scenes FOLDER` has written"
    )


def formulations_text(found: Claims) -> str:
    """What searches found for each formulation, to follow the claims."""
    if not found.formulations:
        return ""
    rows = [tuple(key.replace("_", " ") for key in vars(found.formulations[0]))]
    rows += [tuple(str(value) for value in vars(row).values()) for row in found.formulations]
    head = "the most that one pad was found to keep in each formulation, also over twice the time"
    return f"\n\n{head}\n{table(rows)}"


def text(found: Claims) -> str:
    """The claims for people."""
    rows = [("claim", "statement", "verdict", "margin", "measured")]
    rows += [(c.id, c.statement, c.verdict, f"{c.margin:+.3g}", c.measured) for c in found.claims]
    held = sum(c.verdict == "reproduced" for c in found.claims)
    count = f"\n\n{held} of {len(found.claims)} reproduced"
    return table(rows, right=False) + count + formulations_text(found)


def run(given: argparse.Namespace) -> Reply:
    """Judge the claims on the article's scenes, beside the stored searches if there are any."""
    files = scene_files(given.scenes, HISTORY_FIGURES)
    stored = files[0].parent.parent / "identified.json"
    files += [stored] * stored.is_file()
    found = study(files)
    return Reply(found.to_dict, lambda: text(found), files)
