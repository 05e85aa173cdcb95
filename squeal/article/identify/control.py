"""Searches with the article's statements and with shuffled ones, all stored.

`python -m squeal.article.identify.control workflow/stored/searches.json` runs what the file lacks,
one search after the other, and stores each. A path of some 8,000 sets amplifies rounding, so that
another processor may end at other sets; what is stored of each set can be recomputed anywhere.
"""

import argparse
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Literal

from squeal.article.claims import CLAIMS
from squeal.article.identify.arrangement import PRINTED, Arrangement, shuffled
from squeal.article.identify.judging import distance, margins
from squeal.article.identify.population import BOUNDS, Row, rows
from squeal.article.identify.search import Start, arrays, rounded
from squeal.article.identify.space import DIMENSIONS
from squeal.article.records import Record, read_json
from squeal.io.writing import to_json, write_text
from squeal.model.contact import CONSISTENT

Kind = Literal["shuffled", "printed", "screened", "bounded"]
SHUFFLES = 10  # searches with shuffled statements, each with an arrangement of its own
PRINTS = 5  # with the article's, from random sets as those
SCREENS = 4  # with the article's, from sets that the balances allow, as `squeal identify` has it
BOUNDED = 2  # with the article's, from random sets within `population.BOUNDS`


class StoredSearch(Record):
    """One start of a search and the set at which it ended.

    kind: shuffled statements, the article's (printed), the article's from sets that the balances
    allow (screened) or within physical bounds (bounded); arrangement: of the statements; sets: how
    many were judged; numbers: of the set; distance: from the statements; satisfied: ids of the
    independent statements that it satisfies, in that arrangement; said: what the set says of the
    verdicts, None with shuffled statements.
    """

    kind: Kind
    seed: int
    arrangement: Arrangement
    sets: int
    numbers: dict[str, float]
    distance: float
    satisfied: tuple[str, ...]
    said: tuple[str, ...] | None = None

    @property
    def row(self) -> Row | None:
        """What the set says of the verdicts."""
        return None if self.said is None else Row(*self.said)


class Searches(Record):
    """All searches."""

    searches: tuple[StoredSearch, ...] = ()


def planned() -> Iterator[tuple[Kind, int]]:
    """Kind and seed of all searches; kinds take turns: an early stop leaves some of each."""
    for seed in range(1, SHUFFLES + 1):
        yield "shuffled", seed
        if seed <= PRINTS:
            yield "printed", seed
        if seed <= SCREENS:
            yield "screened", seed
        if seed <= BOUNDED:
            yield "bounded", seed


def satisfied(numbers: dict[str, float], arrangement: Arrangement) -> tuple[float, tuple[str, ...]]:
    """Distance of a set from the statements, and ids of the independent ones that it satisfies."""
    one_set = arrays(numbers)
    table, valid = margins(one_set, CONSISTENT, arrangement=arrangement)
    pairs = zip(CLAIMS, table[0].tolist(), strict=True)
    ids = tuple(claim.id for claim, margin in pairs if claim.informative and margin > 0.0)
    return float(distance(table, valid, one_set)[0]), ids


def run(kind: Kind, seed: int) -> StoredSearch:
    """One start of a search."""
    arrangement = shuffled(seed) if kind == "shuffled" else PRINTED
    dimensions = BOUNDS if kind == "bounded" else DIMENSIONS
    start = Start(CONSISTENT, [seed, 0], 1, kind == "screened", arrangement, dimensions)
    numbers = rounded(start.result(), dimensions)
    far, ids = satisfied(numbers, arrangement)
    said = None if kind == "shuffled" else tuple(rows(arrays(numbers))[0])
    return StoredSearch(kind, seed, arrangement, start.sets, numbers, round(far, 3), ids, said)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the searches that a file lacks."""
    parser = argparse.ArgumentParser(description="Run and store searches.")
    parser.add_argument("file", type=Path, metavar="FILE", help="holds the searches")
    file = parser.parse_args(arguments).file
    stored = read_json(Searches, file) if file.exists() else Searches()
    finished = {(search.kind, search.seed) for search in stored.searches}
    for kind, seed in planned():
        if (kind, seed) in finished:
            continue
        begin = time.process_time()
        search = run(kind, seed)
        stored = Searches((*stored.searches, search))
        write_text(file, to_json(stored.to_dict()))  # so that an interrupt loses one search only
        seconds = time.process_time() - begin
        counts = f"{len(search.satisfied)} statements hold, {search.sets} sets judged"
        print(f"{kind} {seed}: {counts}, {seconds:.0f} s", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
