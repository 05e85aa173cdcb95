"""Random motions against quad precision: is a change of contact missed or made up?

`python -m benchmarks.random_motions [--motions 1000] [--workers 2]` starts pads of
`benchmarks.random_pads --wide`, their stiffnesses spread over eight decades, beside their
equilibrium or at rest, and pairs the changes of contact of the default path with those of the same
motion in quad precision. An impact multiplies a difference, so that two motions may part; what
counts is a change that has no partner while the one before it still agrees to `AGREE`.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.random_pads import scene_of
from squeal.article.studies._reference import error_against, reference
from squeal.article.studies.accuracy import NEAR, ours
from squeal.equilibrium import sliding_equilibrium
from squeal.errors import ComputationError
from squeal.io.scene import DEFAULT_TOLERANCE, Scene
from squeal.model.equations import natural_units

AGREE = 1e-6  # natural units of time
PERIODS = 20.0  # of the pad on all its springs


@dataclass
class Motion:
    """seed; changes: of contact, paired; late: largest difference of their times before the motions
    part; error: of the final place, None where they parted; said: why there is no motion or answer.
    """

    seed: int
    changes: int = 0
    late: float = 0.0
    error: float | None = None
    wrong: str = ""
    said: str = ""


def started(seed: int) -> Scene:
    """A scene kicked by 0.001 to 10 times the speed that the load gives in its unit of time."""
    r = np.random.default_rng([seed, 2])
    scene = scene_of(seed, wide=True)
    pad = scene.pad
    at, _ = sliding_equilibrium(scene.pad_model)
    q = np.zeros(3) if at is None else at.q
    time = natural_units(scene.pad_model, (*q, 0.0, 0.0, 0.0)).time
    speed = 10.0 ** r.uniform(-3.0, 1.0) * pad.F_n * time / pad.m
    rates = speed * r.normal(size=3) / [1.0, 1.0, pad.w]
    initial = tuple(float(v) for v in (*q, *rates))
    stop = float(PERIODS * 2.0 * np.pi * time)
    return replace(scene, initial=initial, stop=stop, samples=2, outputs=())


def judged(seed: int) -> Motion:
    """Compare one motion with itself in quad precision."""
    motion = Motion(seed)
    try:
        scene = started(seed)
        exact = reference(scene)
    except (ComputationError, ValueError) as error:
        motion.said = str(error)
        return motion
    try:
        run = ours(scene, DEFAULT_TOLERANCE)
    except ComputationError as error:
        motion.wrong = f"refused: {error}"
        return motion
    n = min(len(run.times), len(exact.times))
    apart = np.abs(run.times[:n] - exact.times[:n])
    parted = np.flatnonzero(apart > NEAR)
    motion.changes = int(parted[0]) if parted.size else n
    motion.late = float(apart[: motion.changes].max(initial=0.0))
    if not parted.size and len(run.times) == len(exact.times):
        motion.error = error_against(run.position, exact.position)
    elif motion.late < AGREE:
        motion.wrong = (
            f"{len(run.times)} changes of {len(exact.times)}, "
            f"{motion.changes} agree to {motion.late:.1e}"
        )
    return motion


def summary(motions: Iterable[Motion]) -> str:
    """Counts, the largest differences, and all that is wrong, in lines."""
    motions = list(motions)
    whole = [m for m in motions if m.error is not None]
    worst = max(whole, key=lambda m: m.error or 0.0, default=Motion(-1))
    lines = [
        f"{len(motions)} motions, {sum(m.changes for m in motions)} changes of contact paired; "
        f"{len(whole)} agree to the end, {sum(bool(m.said) for m in motions)} have none",
        f"final places differ by at most {worst.error or 0.0:.1e} (seed {worst.seed}), half of "
        f"them by less than {np.median([m.error or 0.0 for m in whole]):.1e}",
        f"wrong: {sum(bool(m.wrong) for m in motions)}",
    ]
    lines += [f"seed {m.seed}: {m.wrong}" for m in motions if m.wrong]
    lines += sorted({f"no motion: {m.said[:100]}" for m in motions if m.said})[:5]
    return "\n".join(lines)


def main() -> None:
    """Judge random motions and print a summary."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--motions", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    seeds = range(given.first, given.first + given.motions)
    with ProcessPoolExecutor(given.workers) as pool:
        print(summary(pool.map(judged, seeds, chunksize=5)))


if __name__ == "__main__":
    main()
