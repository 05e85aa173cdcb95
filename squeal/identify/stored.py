"""The outcome of finished searches, one for each formulation: `workflow/identified.json`.

`python -m squeal.identify.stored STATE... > workflow/identified.json` makes it from the state files
of `squeal identify`; with `--scenes FOLDER` it also writes the scenes of the best pad.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from squeal.contact import Formulation
from squeal.files import to_json
from squeal.identify.write import write_scenes

DIGITS = 6  # a pad that needs more to keep a claim would hold it by a hair


@dataclass(frozen=True)
class Search:
    """A finished search: formulation, seed, starts and pads tried, cost and numbers of its best."""

    formulation: Formulation
    seed: int
    starts: int
    pads: int
    cost: float
    numbers: dict[str, float]


def from_state(file: Path) -> Search:
    """The best pad of a state file, its numbers rounded."""
    kept = json.loads(file.read_text(encoding="utf-8"))
    best = kept["best"][0]
    return Search(
        Formulation(*kept["formulation"]),
        kept["seed"],
        kept["starts"],
        kept["pads"],
        best["cost"],
        {name: float(f"{value:.{DIGITS}g}") for name, value in best["numbers"].items()},
    )


def read_searches(file: Path) -> list[Search]:
    """All stored searches, the best first: the first one's pad is that of the article's scenes."""
    entries = json.loads(file.read_text(encoding="utf-8"))
    return [
        Search(**entry | {"formulation": Formulation(**entry["formulation"])}) for entry in entries
    ]


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the stored form of finished searches."""
    parser = argparse.ArgumentParser(description="Gather the state files of finished searches.")
    parser.add_argument("states", type=Path, nargs="+", metavar="STATE")
    parser.add_argument("--scenes", type=Path, metavar="FOLDER", help="write the best pad's scenes")
    given = parser.parse_args(arguments)
    found = sorted((from_state(file) for file in given.states), key=lambda search: search.cost)
    print(to_json([asdict(search) for search in found]), end="")
    if given.scenes is not None:
        write_scenes(found[0].numbers, found[0].formulation, given.scenes)
    return 0


if __name__ == "__main__":
    sys.exit(main())
