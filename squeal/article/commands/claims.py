"""`squeal claims`: the article's statements, each measured and judged on the article's scenes."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from squeal.article.cases import CASES, HISTORY_FIGURES
from squeal.article.claims import Judged, judge_claims, measure
from squeal.article.claims.judging import linear_measures
from squeal.article.identify.stored import read_searches
from squeal.commands.base import Answer, Command, Parser, table
from squeal.errors import InputError
from squeal.files.provenance import provenance
from squeal.files.sources import ROOT
from squeal.scene import read_scene


def options(parser: Parser) -> None:
    """Options of `squeal claims`."""
    parser.add_argument(
        "--scenes",
        type=Path,
        metavar="FOLDER",
        help="folder with b1-a.yaml to b2-d.yaml (workflow/scenes if left out)",
    )


def scene_folder(given: Path | None) -> Path:
    """The folder of the article's scenes. Raises InputError if there is none."""
    places = [given] if given else [Path("workflow/scenes"), ROOT.parent / "workflow" / "scenes"]
    for place in places:
        if (place / "b1-a.yaml").is_file():
            return place
    raise InputError(
        f"--scenes {places[0]}: holds no b1-a.yaml; a folder with the article's scenes is allowed"
    )


def judge_folder(folder: Path) -> list[Judged]:
    """Simulate and judge the eight scenes of a folder."""
    scenes = {
        model: {case: read_scene(folder / f"{model}-{case}.yaml", "simulate") for case in CASES}
        for model in ("b1", "b2")
    }
    measured = {
        model: {case: measure(scene) for case, scene in cases.items()}
        for model, cases in scenes.items()
    }
    return judge_claims(
        measured["b1"],
        measured["b2"],
        linear_measures({case: scene.pad for case, scene in scenes["b2"].items()}),
    )


def stored_searches(folder: Path) -> list[Path]:
    """The file of the stored searches beside the folder of scenes, if there is one."""
    file = folder.parent / "identified.json"
    return [file] if file.is_file() else []


def formulations(folder: Path) -> list[dict[str, Any]]:
    """What the stored searches found for each formulation, next to the article's scenes."""
    return [
        vars(search.formulation) | {"pads": search.pads, "kept": search.kept}
        for file in stored_searches(folder)
        for search in read_searches(file)
    ]


def formulations_text(found: list[dict[str, Any]]) -> str:
    """The same for people, to follow the claims."""
    if not found:
        return ""
    rows = [tuple(key.replace("_", " ") for key in found[0])]
    rows += [tuple(str(value) for value in row.values()) for row in found]
    head = "the most that one pad was found to keep in each formulation, also over twice the time"
    return f"\n\n{head}\n{table(rows)}"


def data(judged: list[Judged]) -> dict[str, Any]:
    """The claims as a JSON object."""
    return {
        "claims": [
            {
                "id": j.claim.id,
                "verdict": j.verdict,
                "measured": j.measured,
                "where": j.claim.where,
                "statement": j.claim.statement,
                "case": j.claim.case,
                "margin": j.margin,
            }
            for j in judged
        ]
    }


def text(judged: list[Judged]) -> str:
    """The same for people."""
    rows = [("claim", "statement", "verdict", "margin", "measured")]
    rows += [
        (j.claim.id, j.claim.statement, j.verdict, f"{j.margin:+.3g}", j.measured) for j in judged
    ]
    held = sum(j.verdict == "reproduced" for j in judged)
    return table(rows, right=False) + f"\n\n{held} of {len(judged)} reproduced"


def run(given: argparse.Namespace) -> Answer:
    """Judge the claims on the article's scenes."""
    folder = scene_folder(given.scenes)
    judged, found = judge_folder(folder), formulations(folder)
    read = [folder / f"{stem}.yaml" for stem in HISTORY_FIGURES]
    made = provenance([*read, *stored_searches(folder)], "squeal.article.commands.claims")
    return Answer(
        lambda: data(judged) | {"formulations": found, "provenance": made.to_dict()},
        lambda: text(judged) + formulations_text(found),
    )


COMMAND = Command(
    "claims", "The article's statements, each with its measured verdict.", run, options, scene=False
)

if __name__ == "__main__":
    sys.exit(COMMAND.main())
