"""The outcome of finished searches, one for each formulation: `workflow/identified.json`.

`python -m squeal.article.identify.stored STATE... > workflow/identified.json` makes it from the
state files of `squeal identify`.
"""

import argparse
import math
import sys
from collections.abc import Sequence
from pathlib import Path

from squeal.article.identify.objective import judge_one
from squeal.article.identify.search import SearchState
from squeal.article.identify.space import STOP, Numbers, tilt_of
from squeal.article.results.records import Record, read_json
from squeal.errors import ComputationError, InputError
from squeal.io.writing import to_json
from squeal.model.contact import CONSISTENT, Formulation

DIGITS = 6  # a pad that needs more to keep a claim would hold it by a hair


class Search(Record):
    """A finished search: formulation, seed, starts and pads tried; of its best pad the number of
    claims kept, the cost and the numbers."""

    formulation: Formulation
    seed: int
    starts: int
    pads: int
    kept: int
    cost: float
    numbers: dict[str, float]


def departure(numbers: Numbers) -> float:
    """How far a pad is from the plain one: level, uniform, k1 = k2, k3 = k4 (logarithms)."""
    ratios = (numbers["inertia"], numbers["k2"], numbers["k4"] / numbers["k3"])
    return sum(abs(math.log(ratio)) for ratio in ratios) + (tilt_of(numbers) != 0.0)


def kept(numbers: Numbers, formulation: Formulation) -> int:
    """How many claims a pad keeps, over the horizon and over twice that time."""
    try:
        runs = [judge_one(numbers, formulation, stop=stop) for stop in (STOP, 2 * STOP)]
    except ComputationError:
        return 0
    return sum(all(j.holds for j in together) for together in zip(*runs, strict=True))


def from_state(file: Path) -> Search:
    """The pad of a state file that keeps the most claims, of several the plainest."""
    state = read_json(SearchState, file)
    formulation = Formulation(*state.formulation)  # type: ignore[arg-type]
    found = []
    for entry in state.best:
        numbers = {n: float(f"{value:.{DIGITS}g}") for n, value in entry.numbers.items()}
        numbers["tilt"] *= tilt_of(numbers) != 0.0
        found.append((-kept(numbers, formulation), departure(numbers), entry.cost, numbers))
    most, _, cost, numbers = min(found, key=lambda row: row[:2])
    return Search(formulation, state.seed, state.starts, state.pads, -most, cost, numbers)


def preference(search: Search) -> tuple[int, int, float]:
    """Most claims first; of equals the more consistent formulation, then the plainer pad."""
    switches = zip(vars(search.formulation).values(), vars(CONSISTENT).values(), strict=True)
    return -search.kept, sum(a != b for a, b in switches), departure(search.numbers)


def read_searches(files: Sequence[Path]) -> list[Search]:
    """All stored searches, the best first.

    Raises InputError where a file holds something else, or none is given.
    """
    found = [search for file in files for search in read_json(tuple[Search, ...], file)]
    if not found:
        raise InputError("no stored search is given; the file workflow/identified.json holds some")
    return found


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the stored form of finished searches."""
    parser = argparse.ArgumentParser(description="Gather the state files of finished searches.")
    parser.add_argument("states", type=Path, nargs="+", metavar="STATE")
    given = parser.parse_args(arguments)
    found = sorted((from_state(file) for file in given.states), key=preference)
    print(to_json([search.to_dict() for search in found]), end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
