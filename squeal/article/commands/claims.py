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
    """Options of `squeal article claims`."""
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
    """Scene files of the other parameter sets, by the names of the folders that hold them.

    The folders stand beside `files`, the scenes of the reference set.
    """
    first = files[0]
    files_of_set = {}
    for first_of_set in sorted(first.parent.glob(f"*/{first.name}")):
        folder = first_of_set.parent
        files_of_set[folder.name] = [folder / file.name for file in files]
    return files_of_set


def text(record: Claims, others: Mapping[str, Claims]) -> str:
    """The claims for people, each with how many of the parameter sets satisfy it.

    record: the claims on the reference set; others: those on the other sets, by name.
    """
    sets_of_claims = [record.claims, *(other.claims for other in others.values())]
    rows = [("claim", "statement", "verdict", "margin", "sets", "measured")]
    # of each claim the verdicts on all sets, the reference set first
    for claim, *others_on_claim in zip(*sets_of_claims, strict=True):
        count = claim.holds + sum(other.holds for other in others_on_claim)
        satisfied = f"{count} of {len(sets_of_claims)}"
        rows.append(
            (
                claim.id,
                claim.statement,
                claim.verdict,
                f"{claim.margin:+.3g}",
                satisfied,
                claim.measured,
            )
        )
    reproduced = sum(claim.holds for claim in record.claims)
    total = (
        f"{reproduced} of {len(record.claims)} reproduced. Reproduced is not confirmed: these "
        "scenes were fitted to the statements"
    )
    return f"{table(rows, right=False)}\n\n{total}"


def run(given: argparse.Namespace) -> Reply:
    """Judge the claims on the article's scenes, and on those of other sets beside them."""
    files = scene_files(given.scenes, HISTORY_FIGURES)
    record = study(files)
    others = {name: study(of_set) for name, of_set in sets(files).items()}
    satisfied = {name: [c.id for c in other.claims if c.holds] for name, other in others.items()}
    answer = record.to_dict() | {"other_sets": satisfied}
    return Reply(lambda: answer, lambda: text(record, others), files)
