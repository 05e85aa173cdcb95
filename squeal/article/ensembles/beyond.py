"""Model B2 alone: `python -m squeal.article.ensembles.beyond FOLDER MORE` searches on for one law.

It sets out from all pads of the searches in FOLDER that keep the three statements that seem to
hinder each other, and asks whether they can keep the others on model B2 as well.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from squeal.article.ensembles.distance import INDEX
from squeal.article.ensembles.draw import SEEDS, files_there, read_stage, stage_file, write_stage
from squeal.article.ensembles.gather import B2, FRONT
from squeal.article.ensembles.population import Stage, advance, first_stage
from squeal.cli.streams import exit_code, say
from squeal.errors import InputError
from squeal.model.contact import Formulation

LAW = Formulation("mean", "centre", "+")
"""The law with most pads that keep all three."""
MOST = 9  # claims on model B2 that a pad must keep to be set out from
FIRST, SEED = 100, 99  # number of the first stage and the seed, apart from those of other searches
STAGES = 40


def beginning(folder: Path) -> Stage:
    """The pads that the search sets out from, judged on model B2 alone.

    Raises InputError where there are none.
    """
    chosen = []
    for seed in SEEDS:
        for drawn in map(read_stage, files_there(folder, LAW, seed)):
            three = drawn.margins[:, [INDEX[name] for name in FRONT]] > 0.0
            most = (drawn.margins[:, B2] > 0.0).sum(axis=1) >= MOST
            chosen.append(drawn.points[three.all(axis=1) & most])
    points = np.concatenate(chosen) if chosen else np.empty((0, len(INDEX)))
    if not len(points):
        raise InputError(f"{folder}: no pad keeps {', '.join(FRONT)}; draw more stages")
    return first_stage(points, LAW, ("B2",))


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw the stages that are not in the folder MORE yet."""
    parser = argparse.ArgumentParser(description="Search on for pads that keep all on model B2.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("more", type=Path)
    parser.add_argument("--stages", type=int, default=STAGES)
    given = parser.parse_args(arguments)
    return exit_code("beyond", lambda: _draw(given))


def _draw(given: argparse.Namespace) -> int:
    last = None
    for stage in range(given.stages):
        file = stage_file(given.more, LAW, SEEDS[0], stage)
        if file.exists():
            last = read_stage(file)
            continue
        before = beginning(given.folder) if last is None else last
        last = advance(LAW, SEED, FIRST + stage, before, ("B2",))
        write_stage(file, last)
        held = (last.margins[last.whole][:, B2] > 0.0).sum(axis=1)
        say(
            f"stage {stage}: level {last.levels[-1]:.3f}, {last.taken.mean():.2f} taken, "
            f"most of {B2.sum()} kept {held.max(initial=0)}"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
