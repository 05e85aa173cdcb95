"""Random pads: `python -m benchmarks.batch` prints speed and memory of batches, changes missed.

Each pad runs for 100 units of time from a random start, in batches and by the default path at a
tolerance of 1e-10. The times of its contact changes are compared with those at 1e-15 by the default
path; pads that differ, and some more, are settled in quad precision. Where quad precision itself
finds other changes from a start that is off by 1e-10, the motion cannot be foretold for so long.
"""

from __future__ import annotations

import argparse
import os
import resource
import time
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context

import numpy as np

from squeal.article.identify.ensemble import DONE, simulate_many, stack
from squeal.article.identify.space import DIMENSIONS, decode, pad_of
from squeal.article.studies._reference import reference
from squeal.article.studies.accuracy import compare_times, ours
from squeal.errors import ComputationError
from squeal.io.scene import Scene
from squeal.model.contact import CONSISTENT
from squeal.model.equations import PadModel, natural_units
from squeal.model.pad import Model, Pad

STOP, TOLERANCE, TIGHT = 100.0, 1e-10, 1e-15
MODELS: tuple[Model, ...] = ("B1", "B2")
SAMPLE = 100  # pads that run in quad precision, besides those that differ
ON_ONE_CORE = 2000
MEMORY_STOP = 10.0

Times = np.ndarray | None  # of the contact changes in natural units; None: the model ends before


def random_pads(model: Model, n: int, seed: int) -> tuple[list[Pad], np.ndarray]:
    """Pads of the identification's ranges with random angles; first states (n, 6)."""
    random = np.random.default_rng(seed)
    pads, starts = [], np.zeros((n, 6))
    for i in range(n):
        point = random.uniform(size=(1, len(DIMENSIONS)))
        numbers = {name: v[0] for name, v in decode(point).items()}
        pads.append(pad_of(numbers, model, tuple(random.uniform(0.1, 3.0, 2))))
        contact = numbers["k_c"] if model == "B2" else numbers["k3"] + numbers["k4"]
        starts[i, 1] = -random.uniform(0.0, 2.0) * numbers["F_n"] / contact
    return pads, starts


def scene_of(model: Model, pad: Pad, start: np.ndarray) -> Scene:
    """One pad on its own."""
    initial = tuple(start.tolist())
    return Scene(model, pad, CONSISTENT, initial=initial, stop=STOP, samples=2, outputs=())


def alone(scene: Scene, tolerance: float) -> Times:
    """Contact changes by the default path, in quad precision for a tolerance of zero."""
    try:
        return (ours(scene, tolerance) if tolerance else reference(scene)).times
    except ComputationError:
        return None


def differs(found: Times, exact: Times) -> bool:
    """Whether a change is missed or made up, or the model ends in one of two runs only."""
    if found is None or exact is None:
        return (found is None) != (exact is None)
    return compare_times(found, exact) != (0, 0)


def compared(model: Model, n: int, pool: ProcessPoolExecutor, workers: int) -> None:
    """Speed of a batch, and the changes that it and the default path miss."""
    pads, starts = random_pads(model, n, 1)
    many = stack(pads)
    batch = partial(simulate_many, model, many, starts, STOP, TOLERANCE, workers=workers)
    for processes in {1, workers}:  # compile
        simulate_many(model, stack(pads[:64]), starts[:64], STOP, TOLERANCE, workers=processes)
    begun = time.perf_counter()
    batch()
    rate = n / (time.perf_counter() - begun)
    few = min(n, ON_ONE_CORE)
    begun = time.process_time()
    simulate_many(model, stack(pads[:few]), starts[:few], STOP, TOLERANCE)
    core = few / (time.process_time() - begun)
    print(
        f"{model}: {rate:.0f} pads/s on {workers} processes; {core:.0f} pads a second of one core"
    )

    found = batch(events=True)
    units = [natural_units(PadModel(model, p), s).time for p, s in zip(pads, starts, strict=True)]
    in_batch: list[Times] = [
        events[:, 0] / unit if outcome == DONE else None
        for events, unit, outcome in zip(found["events"], units, found["outcome"], strict=True)
    ]
    scenes = [scene_of(model, p, s) for p, s in zip(pads, starts, strict=True)]
    one_by_one, tight = (
        list(pool.map(partial(alone, tolerance=tolerance), scenes, chunksize=100))
        for tolerance in (TOLERANCE, TIGHT)
    )
    whole = [times for times in tight if times is not None]
    changes = sum(len(times) for times in whole)
    print(f"    {len(whole)} of {n} pads reach the end, with {changes} contact changes")
    paths = {"batch": in_batch, "default": one_by_one, f"default at {TIGHT:g}": tight}
    odd = [i for i in range(n) if any(differs(p[i], tight[i]) for p in paths.values())]
    some = list(range(min(n, SAMPLE)))
    settled = odd + some
    moved = [scene_of(model, pads[i], starts[i] * (1.0 + TOLERANCE)) for i in odd]
    in_quad = partial(alone, tolerance=0.0)
    exact = dict(zip(settled, pool.map(in_quad, [scenes[i] for i in settled]), strict=True))
    beside = dict(zip(odd, pool.map(in_quad, moved), strict=True))
    lost = {i for i in odd if differs(beside[i], exact[i])}
    print(f"    quad precision settles {len(odd)} pads that differ and {len(some)} others;")
    print(f"    {len(lost)} of them cannot be foretold for so long")
    for name, path in paths.items():
        wrong = {i for i in exact if differs(path[i], exact[i])} - lost
        print(f"    {name}: {len(wrong)} other pads miss or make up a change, or end otherwise")


def peak_memory(count: int) -> float:
    """Peak memory in MB of a new process that simulates so many pads."""
    pads, starts = random_pads("B1", 1_000, 2)
    many = stack(pads * (count // 1_000))
    simulate_many("B1", many, np.tile(starts, (count // 1_000, 1)), MEMORY_STOP, TOLERANCE)
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pads", type=int, default=10_000)
    given = parser.parse_args()
    workers, fresh = os.cpu_count() or 1, get_context("spawn")
    with ProcessPoolExecutor(workers, mp_context=fresh) as pool:
        for model in MODELS:
            compared(model, given.pads, pool, workers)
    with ProcessPoolExecutor(1, mp_context=fresh, max_tasks_per_child=1) as pool:
        for count in (1_000, 10_000, 100_000):
            peak = pool.submit(peak_memory, count).result()
            print(f"peak memory of {count} pads in one process: {peak:.0f} MB")


if __name__ == "__main__":
    main()
