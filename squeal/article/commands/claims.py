"""`squeal article claims`: the article's statements, each with its verdict as measured on scenes.

squeal article claims --json
"""

import argparse
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from squeal.article.cases import HISTORY_FIGURES
from squeal.article.studies.claims import Claims, study
from squeal.cli.command import Parser, Reply
from squeal.errors import InputError
from squeal.io.provenance import ROOT
from squeal.io.writing import aligned_text as table

SCENES = ROOT / "article" / "scenes"


def options(parser: Parser) -> None:
    """Options of `squeal claims`."""
    parser.add_argument(
        "--scenes",
        type=Path,
        metavar="FOLDER",
        help="folder with b1-a.yaml to b2-d.yaml (those of the report if left out)",
    )


def scene_files(given: Path | None, stems: Iterable[str]) -> list[Path]:
    """The files of the article's scenes. Raises InputError if their folder holds none."""
    folder = given or SCENES
    if (folder / "b1-a.yaml").is_file():
        return [folder / f"{stem}.yaml" for stem in stems]
    raise InputError(
        f"--scenes {folder}: holds no b1-a.yaml; a folder with the article's scenes is allowed, "
        "such as one that `squeal article identify --scenes FOLDER` has written"
    )


def sets(files: Sequence[Path]) -> dict[str, list[Path]]:
    """Scene files of the other parameter sets, by the folders beside `files` that hold them."""
    first = files[0]
    of_sets = {}
    for beside in sorted(first.parent.glob(f"*/{first.name}")):
        folder = beside.parent
        of_sets[folder.name] = [folder / file.name for file in files]
    return of_sets


def text(record: Claims, others: Mapping[str, Claims]) -> str:
    """The claims for people; of each how many parameter sets satisfy it, if there are several."""
    every = [record, *others.values()]
    satisfied = [sum(one.claims[i].holds for one in every) for i in range(len(record.claims))]
    rows = [("claim", "statement", "verdict", "margin", "sets", "measured")]
    for c, count in zip(record.claims, satisfied, strict=True):
        sets_of_all = f"{count} of {len(every)}"
        rows.append((c.id, c.statement, c.verdict, f"{c.margin:+.3g}", sets_of_all, c.measured))
    held = sum(c.holds for c in record.claims)
    total = (
        f"{held} of {len(record.claims)} reproduced. Reproduced is not confirmed: these scenes "
        "were fitted to the statements"
    )
    return f"{table(rows, right=False)}\n\n{total}"


def run(given: argparse.Namespace) -> Reply:
    """Judge the claims on the article's scenes, and on those of other sets beside them."""
    files = scene_files(given.scenes, HISTORY_FIGURES)
    record = study(files)
    others = {name: study(some) for name, some in sets(files).items()}
    satisfied = {name: [c.id for c in one.claims if c.holds] for name, one in others.items()}
    answer = record.to_dict() | {"other_sets": satisfied}
    return Reply(lambda: answer, lambda: text(record, others), files)
