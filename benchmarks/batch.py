"""Batches of random pads: `python -m benchmarks.batch` prints speed, memory, changes missed.

Each pad runs for 100 units of time at a tolerance of 1e-10 from a random start. Changes are counted
against the same pads at 1e-13 by the same path and at 1e-15 by the default path, one by one.
"""

from __future__ import annotations

import argparse
import os
import resource
import time

import numpy as np

from squeal.contact import CONSISTENT
from squeal.errors import ComputationError
from squeal.identify.space import BOUNDS, decode, pad_of
from squeal.pad import Model, Pad
from squeal.scene.schema import Scene
from squeal.simulation import simulate
from squeal.simulation.batch import DONE, simulate_many, stack

STOP = 100.0
MODELS: tuple[Model, ...] = ("B1", "B2")
SAMPLE = 2000  # pads that run one by one as well


def random_pads(model: Model, n: int, seed: int) -> tuple[list[Pad], np.ndarray]:
    """Pads of the identification's ranges with random angles; first states (n, 6)."""
    random = np.random.default_rng(seed)
    low, high = np.array(BOUNDS).T
    pads, starts = [], np.zeros((n, 6))
    for i in range(n):
        numbers = decode(low + (high - low) * random.uniform(size=len(BOUNDS)))
        pads.append(pad_of(numbers, model, tuple(random.uniform(0.1, 3.0, 2))))
        contact = numbers["k_c"] if model == "B2" else numbers["k3"] + numbers["k4"]
        starts[i, 1] = -random.uniform(0.0, 2.0) * numbers["F_n"] / contact
    return pads, starts


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pads", type=int, default=10_000)
    given = parser.parse_args()
    workers = os.cpu_count() or 1
    for model in MODELS:
        pads, starts = random_pads(model, given.pads, 1)
        many = stack(pads)
        simulate_many(model, stack(pads[:64]), starts[:64], STOP, 1e-10, workers=workers)
        begun = time.perf_counter()
        found = simulate_many(model, many, starts, STOP, 1e-10, workers=workers)
        spent = time.perf_counter() - begun
        tight = simulate_many(model, many, starts, STOP, 1e-13, workers=workers)
        both = (found["outcome"] == DONE) & (tight["outcome"] == DONE)
        apart = int((found["changes"] != tight["changes"])[both].sum())
        print(
            f"{model}: {given.pads / spent:.0f} pads/s on {workers} processes at 1e-10; "
            f"{int(found['changes'][both].sum())} contact changes of {int(both.sum())} pads that "
            f"reach the end, {apart} pads with another number at 1e-13"
        )
        differ = compared = 0
        for i in range(min(SAMPLE, given.pads)):
            scene = Scene(
                model,
                pads[i],
                CONSISTENT,
                initial=tuple(starts[i].tolist()),
                stop=STOP,
                samples=2,
                outputs=(),
            )
            try:
                alone = simulate(scene).contact_changes
            except ComputationError:
                alone = None
            ended = found["outcome"][i] == DONE
            compared += 1
            differ += (alone is not None) != ended or (ended and alone != found["changes"][i])
        print(f"    one by one at 1e-15: {differ} of {compared} pads differ")
    for count in (1_000, 10_000, 50_000):
        pads, starts = random_pads("B1", 1_000, 2)
        many = stack(pads * (count // 1_000))
        simulate_many("B1", many, np.tile(starts, (count // 1_000, 1)), 10.0, 1e-10)
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(f"peak memory after {count} pads in this process: {peak:.0f} MB")


if __name__ == "__main__":
    main()
