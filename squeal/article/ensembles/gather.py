"""What is kept of finished searches: `python -m squeal.article.ensembles.gather OUT B2-OUT > FILE`.

Of millions of judged pads the counts are kept, and as exact points only the best of each search, a
sample of its last population and the front of the three statements that hinder each other.
"""

import argparse
import io
import sys
from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from squeal.article.claims import CLAIMS
from squeal.article.ensembles.distance import INDEX, PARTS
from squeal.article.ensembles.draw import SEEDS, files_there, read_stage
from squeal.article.ensembles.population import RANDOM_STAGES, Stage
from squeal.article.ensembles.space import DIMENSIONS, FORMULATIONS, decode
from squeal.cli.streams import exit_code
from squeal.errors import InputError

SAMPLE = 40  # pads kept of each last population
SLIDING = "B12-sliding"  # was taken for informative when the stored ensembles were counted
COUNTS = np.array([c.informative or c.id == SLIDING for c in CLAIMS])
UNJUDGED = np.array([c.id == "B3-none" for c in CLAIMS])  # in searches; it all but cannot fail
LISTED = np.array([c.listed for c in CLAIMS])
FRONT = ("B2-a-leading", "B2-c-hammer", "B2-d-trailing")
CONCLUSIONS = {
    "hammering": ("B2-c-hammer", "B2-only-c", "B12-c-severe"),
    "exaggeration": ("B1-all-separate", "B2-only-c", "B12-more-loss"),
}
"""Conclusions of the article about its motions, as statements that must hold together."""
WORDED = {"hammering": "B12-c-severe", "exaggeration": "B12-more-loss"}
"""Which of these statements says the conclusion by itself."""
B2 = np.array([all(s.startswith("b2") for s in c.scenes) for c in CLAIMS])
"""Claims on the scenes of model B2 alone."""


@dataclass(frozen=True)
class Kept:
    """The stored form, F formulations and S seeds, in the order of `FORMULATIONS` and `SEEDS`.

    effort (F, S, 4): pads, motions, integration steps, CPU seconds; stages: that all searches have;
    random (F, S, 2): random pads, and those whose eight motions reach the end; random_holds (F, S,
    claims): how many of them keep each claim; random_counts (F, 3, claims + 1): how many keep so
    many of all claims, of the listed ones and of the counted ones; random_together (F,
    conclusions): how many keep each of `CONCLUSIONS`; random_parting (F, 16): in how many the
    surfaces of B2 part in which cases, a to d as bits from the lowest; best (F, S, 3): the most
    kept by one pad, counted in the same three ways; levels, shares (F, S, stages): distance levels
    and logarithms of the share of the ranges within; points (F, S, dimensions), margins (F, S,
    claims): the pad of each search that keeps the most counted claims, of equals the most of
    all; sample (F, S, SAMPLE, dimensions), sampled (..., claims): pads of the last populations;
    seen (F,): pads with all three margins of `FRONT`; together (F, 4): how many keep so many of the
    three; most (F, 4): the most B2 claims that one of them keeps; lacks (F, claims): those on B2
    that the first such pad of all three does not keep; front (n, dimensions), front_margins (n, 3),
    front_of (n,): pads whose three margins no other pad surpasses, and their formulation.
    """

    effort: np.ndarray
    stages: np.ndarray
    random: np.ndarray
    random_holds: np.ndarray
    random_counts: np.ndarray
    random_together: np.ndarray
    random_parting: np.ndarray
    best: np.ndarray
    levels: np.ndarray
    shares: np.ndarray
    points: np.ndarray
    margins: np.ndarray
    sample: np.ndarray
    sampled: np.ndarray
    seen: np.ndarray
    together: np.ndarray
    most: np.ndarray
    lacks: np.ndarray
    front: np.ndarray
    front_margins: np.ndarray
    front_of: np.ndarray


def read_kept(file: Path) -> Kept:
    """What `main` stored. Raises InputError where the file is none of its own."""
    try:
        with np.load(file) as arrays:
            kept = Kept(**{f.name: arrays[f.name] for f in fields(Kept)})
    except (OSError, ValueError, KeyError) as error:
        raise InputError(
            f"{file}: {error}; a file written by `make ensembles` is allowed"
        ) from None
    if (claims := kept.margins.shape[-1]) != len(CLAIMS):
        raise InputError(
            f"{file}: margins of {claims} claims are not allowed; `make ensembles` judges all "
            f"{len(CLAIMS)}"
        )
    return kept


def counts(margins: np.ndarray) -> np.ndarray:
    """How many claims hold (3, n): of all, of the listed ones and of those of `COUNTS`.

    What is not judged in searches holds.
    """
    holds = (margins > 0.0) | UNJUDGED
    return np.array([holds.sum(1), holds[:, LISTED].sum(1), holds[:, COUNTS].sum(1)])


def keep_all(margins: np.ndarray, statements: Sequence[str]) -> np.ndarray:
    """Which pads (...,) keep some claims at once, by their margins (..., claims)."""
    return np.asarray((margins[..., [INDEX[s] for s in statements]] > 0.0).all(axis=-1))


def parting(margins: np.ndarray) -> np.ndarray:
    """In which cases of B2 the surfaces part (n,), a to d as bits from the lowest."""
    keep = margins[:, [INDEX[name] for name in PARTS]] > 0.0
    keep[:, PARTS.index("B2-c-loss")] ^= True  # the one that says that they part
    return np.asarray(~keep @ (1 << np.arange(len(PARTS))))


def undominated(margins: np.ndarray) -> np.ndarray:
    """Indices of the rows (n, 3) that no other row surpasses in one number and meets in all."""
    order = np.argsort(-margins.sum(axis=1), kind="stable")  # no row is surpassed by a later one
    front: list[int] = []
    for i in order.tolist():
        rows = margins[front]
        if not len(front) or not np.any((rows >= margins[i]).all(axis=1)):
            front.append(i)
    return np.array(sorted(front), dtype=int)


class _Front:
    """The three margins over all pads of a formulation that come by."""

    def __init__(self) -> None:
        self.seen = 0
        self.together = np.zeros(4, dtype=int)
        self.most = np.zeros(4, dtype=int)
        self.lacks = np.zeros(len(CLAIMS), dtype=bool)
        self.points = np.empty((0, len(DIMENSIONS)))
        self.margins = np.empty((0, 3))

    def add(self, stage: Stage) -> None:
        three = stage.margins[:, [INDEX[name] for name in FRONT]]
        known = np.isfinite(three).all(axis=1)
        three, points = three[known], stage.points[known]
        held = (three > 0.0).sum(axis=1)
        keeps = stage.margins[known] > 0.0
        b2 = (keeps & B2).sum(axis=1)
        three_of = np.flatnonzero(held == 3)
        if three_of.size and b2[three_of].max() > self.most[3]:
            self.lacks = B2 & ~keeps[three_of[b2[three_of].argmax()]]
        self.seen += len(three)
        self.together += np.bincount(held, minlength=4)
        for n in range(4):
            self.most[n] = max(self.most[n], *b2[held == n], 0)
        # what has ample room gains no more
        room = np.array([CLAIMS[INDEX[name]].ample for name in FRONT])
        load = decode(points)["F_n"]
        scaled = three / room / np.column_stack([load, np.ones((len(load), 2))])
        margins = np.concatenate([self.margins, np.clip(scaled, -5.0, 1.0)])
        points = np.concatenate([self.points, points])
        kept = undominated(margins)
        self.points, self.margins = points[kept], margins[kept]


def gather(folder: Path, more: Path | None = None) -> Kept:
    """Gather the stages of all searches, as many as all of them have; `more`: searches of model B2
    alone, for the front."""
    searches = {key: list(files_there(folder, *key)) for key in product(FORMULATIONS, SEEDS)}
    count = min(map(len, searches.values()))
    if count <= RANDOM_STAGES:
        raise InputError(f"{folder}: searches of {count} stages are not allowed; draw more")
    found: dict[str, list[Any]] = {f.name: [] for f in fields(Kept)}
    for number, formulation in enumerate(FORMULATIONS):
        front = _Front()
        rows: dict[str, list[Any]] = {name: [] for name in found}
        of_random = np.zeros((3, len(CLAIMS) + 1), dtype=int)
        conclusions, parted = np.zeros(len(CONCLUSIONS), dtype=int), np.zeros(16, dtype=int)
        for seed in SEEDS:
            drawn = list(map(read_stage, files_there(folder, formulation, seed, "chance")))
            stages = list(map(read_stage, searches[formulation, seed][:count]))
            everything = stages + drawn
            for stage in everything:
                front.add(stage)
            drawn += stages[:RANDOM_STAGES]
            margins = np.concatenate([s.margins[s.whole] for s in drawn])
            for row, kept in zip(of_random, counts(margins), strict=True):
                row += np.bincount(kept, minlength=len(row))
            parted += np.bincount(parting(margins), minlength=16)
            for at, statements in enumerate(CONCLUSIONS.values()):
                conclusions[at] += int(keep_all(margins, statements).sum())
            rows["random"].append([sum(len(s.points) for s in drawn), len(margins)])
            rows["random_holds"].append((margins > 0.0).sum(axis=0))
            efforts = [(len(s.points), s.motions, s.steps, s.seconds) for s in everything]
            rows["effort"].append([sum(column) for column in zip(*efforts, strict=True)])
            shares = np.cumsum(np.log([s.share for s in stages[RANDOM_STAGES - 1 :]]))
            rows["levels"].append([s.levels[-1] for s in stages])
            rows["shares"].append(np.concatenate([np.zeros(RANDOM_STAGES - 1), shares]))
            _of_search(stages, np.random.default_rng([number, seed]), rows)
            if more is not None:
                for stage in map(read_stage, files_there(more, formulation, seed)):
                    front.add(stage)
        rows["random_counts"] = of_random.tolist()
        rows["random_together"], rows["random_parting"] = conclusions.tolist(), parted.tolist()
        for name in rows:
            if rows[name]:
                found[name].append(rows[name])
        for name in ("seen", "together", "most", "lacks"):
            found[name].append(getattr(front, name))
        found["front"].append(front.points)
        found["front_margins"].append(front.margins)
        found["front_of"].append(np.full(len(front.points), number))
    joined = {name: np.concatenate(found[name]) for name in found if name.startswith("front")}
    found["stages"] = count  # type: ignore[assignment]
    short = {"points", "margins", "sample", "sampled", "front", "front_margins", "levels", "shares"}
    arrays = {name: np.asarray(joined.get(name, value)) for name, value in found.items()}
    return Kept(**{n: v.astype(np.float32) if n in short else v for n, v in arrays.items()})


def _of_search(
    stages: Sequence[Stage], random: np.random.Generator, rows: dict[str, list[Any]]
) -> None:
    """The pad of a search that keeps most, the most kept in each way of counting, and some of the
    different pads of the last population."""
    points = np.concatenate([s.points[s.whole] for s in stages])
    margins = np.concatenate([s.margins[s.whole] for s in stages])
    everything, listed, counted = counts(margins)
    at = np.lexsort([-everything, -counted])[0]
    rows["best"].append([everything.max(), listed.max(), counted.max()])
    rows["points"].append(points[at])
    rows["margins"].append(margins[at])
    where = {point.tobytes(): i for i, point in enumerate(points)}
    own = np.array(sorted({where[point.tobytes()] for point in stages[-1].population}), dtype=int)
    some = own[np.resize(random.permutation(len(own))[:SAMPLE], SAMPLE)]
    rows["sample"].append(points[some])
    rows["sampled"].append(margins[some])


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the stored form of finished searches."""
    parser = argparse.ArgumentParser(description="Gather the stages of finished searches.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("b2", type=Path, nargs="?", help="searches of model B2 alone")
    parser.add_argument(
        "--untimed",
        action="store_true",
        help="zero for the CPU time, so that equal searches give equal bytes",
    )
    given = parser.parse_args(arguments)
    return exit_code("gather", lambda: _gather(given))


def _gather(given: argparse.Namespace) -> int:
    buffer = io.BytesIO()
    kept: dict[str, Any] = vars(gather(given.folder, given.b2))
    if given.untimed:
        kept["effort"][..., -1] = 0.0
    np.savez_compressed(buffer, **kept)
    sys.stdout.buffer.write(buffer.getvalue())
    sys.stdout.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main())
