"""The searches: `python -m squeal.article.ensembles.draw FOLDER` draws all, stage by stage.

Stages go round over formulations and seeds, so that whatever is there can be compared at any time.
A stage that stands in the folder is not drawn again.
"""

import argparse
import itertools
import sys
from collections.abc import Iterator, Sequence
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from squeal.article.ensembles.population import Stage, advance, chance
from squeal.article.ensembles.space import FORMULATIONS
from squeal.cli.streams import exit_code, say
from squeal.io.parts import cut
from squeal.io.processes import mapped
from squeal.model.contact import Formulation
from squeal.model.pad import Model

SEEDS = range(1, 6)
STAGES = 79  # and these parts of further random pads: 40,000 pads and more for each search
PARTS = 7
FIRST = 30  # stages of all searches before the further random pads


def name_of(formulation: Formulation) -> str:
    """A formulation as a file's name has it: mean-centre-plus."""
    sign = {"+": "plus", "-": "minus"}[formulation.delta_moment]
    return f"{formulation.line_force}-{formulation.delta_from}-{sign}"


def stage_file(
    folder: Path, formulation: Formulation, seed: int, stage: int, kind: str = "stage"
) -> Path:
    """The file of a stage; of kind "chance" that of a part of the further random pads."""
    return folder / f"{name_of(formulation)}-{seed}" / f"{kind}-{stage:03}.npz"


def files_there(
    folder: Path, formulation: Formulation, seed: int, kind: str = "stage"
) -> Iterator[Path]:
    """The files of a search up to the first that is missing."""
    files = (stage_file(folder, formulation, seed, n, kind) for n in itertools.count())
    return itertools.takewhile(Path.exists, files)


def read_stage(file: Path) -> Stage:
    """A stage from its file."""
    with np.load(file) as kept:
        values = {f.name: kept[f.name] for f in fields(Stage)}
    plain = {name: v.item() for name, v in values.items() if v.ndim == 0}
    wide = {name: values[name].astype(float) for name in ("points", "population")}
    return Stage(**(values | plain | wide))


def write_stage(file: Path, stage: Stage) -> None:
    """Keep a stage; points are exact, margins in single precision."""
    file.parent.mkdir(parents=True, exist_ok=True)
    short = {"points", "population", "margins"}
    values: dict[str, Any] = {
        f.name: np.asarray(v, dtype=np.float32) if f.name in short else v
        for f in fields(Stage)
        for v in (getattr(stage, f.name),)
    }
    part = file.with_suffix(".part.npz")
    np.savez_compressed(part, **values)
    part.rename(file)


def _tell(name: str, seed: int, stage: int, found: Stage) -> None:
    margins = found.margins[found.whole]
    most = int((margins > 0.0).sum(axis=1).max()) if len(margins) else 0
    near = float(found.partial[:, -1].min()) if len(found.partial) else np.inf
    say(
        f"{name} seed {seed} stage {stage}: level {found.levels[-1]:.3f}, least {near:.3f}, "
        f"{found.taken.mean():.2f} taken, most kept {most}, "
        f"{found.motions / len(found.points):.1f} motions a pad, {found.seconds:.0f} s"
    )


class _Searches:
    """Some of the searches, of which each step draws one more stage or part."""

    def __init__(self, folder: Path, models: tuple[Model, ...]) -> None:
        self.folder, self.models = folder, models
        self._last: dict[tuple[Formulation, int], Stage] = {}

    def stage(self, formulation: Formulation, seed: int, stage: int) -> None:
        """Draw a stage, unless it is there."""
        key = formulation, seed
        file = stage_file(self.folder, formulation, seed, stage)
        if file.exists():
            if not stage_file(self.folder, formulation, seed, stage + 1).exists():
                self._last[key] = read_stage(file)
            return
        self._last[key] = advance(formulation, seed, stage, self._last.get(key), self.models)
        write_stage(file, self._last[key])
        _tell(name_of(formulation), seed, stage, self._last[key])

    def chance(self, formulation: Formulation, seed: int, part: int) -> None:
        """Draw a part of further random pads, unless it is there."""
        file = stage_file(self.folder, formulation, seed, part, "chance")
        if not file.exists():
            found = chance(formulation, seed, part)
            write_stage(file, found)
            _tell(f"{name_of(formulation)}, random,", seed, part, found)


def work(
    folder: Path, stages: int, models: tuple[Model, ...], tasks: Sequence[tuple[Formulation, int]]
) -> None:
    """Draw some searches (formulation, seed), a stage of each in turn."""
    searches = _Searches(folder, models)
    for stage, key in itertools.product(range(min(stages, FIRST)), tasks):
        searches.stage(*key, stage)
    for part, key in itertools.product(range(PARTS if len(models) == 2 else 0), tasks):
        searches.chance(*key, part)
    for stage, key in itertools.product(range(FIRST, stages), tasks):
        searches.stage(*key, stage)


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw the ensembles in a few processes."""
    names = {name_of(f): f for f in FORMULATIONS}
    parser = argparse.ArgumentParser(description="Draw the ensembles of pads.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--stages", type=int, default=STAGES)
    parser.add_argument("--seeds", type=int, nargs="+", default=list(SEEDS))
    parser.add_argument("--formulations", nargs="+", default=list(names), choices=list(names))
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--models", nargs="+", default=["B1", "B2"], choices=["B1", "B2"])
    parser.add_argument("--part", default="1-of-1", help="3-of-8: of the searches only these")
    given = parser.parse_args(arguments)
    # turned by one for each seed, so that no process has all the formulations that take longest
    searches = [
        (names[given.formulations[(i + seed) % len(given.formulations)]], seed)
        for seed in given.seeds
        for i in range(len(given.formulations))
    ]
    return exit_code("draw", lambda: _draw(given, searches))


def _draw(given: argparse.Namespace, searches: list[tuple[Formulation, int]]) -> int:
    some = partial(work, given.folder, given.stages, tuple(given.models))
    mine, n = searches[slice(*cut(given.part, len(searches)))], given.workers
    list(mapped(some, [mine[i::n] for i in range(n)], n))
    return 0


if __name__ == "__main__":
    sys.exit(main())
