"""Simulations at the same time, in threads or in turns, know nothing of each other."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from squeal.io.scene import Scene
from squeal.simulation import simulate
from squeal.simulation.ensemble import simulate_many, stack
from tests.conftest import needs_heyoka, random_pad

THREADS, COUNT = 4, 12


def scenes(model):
    return [
        Scene(model, random_pad(seed, model), initial=(0, 1e-3, 0, 0, 0, 0), stop=5.0, samples=2)
        for seed in range(COUNT)
    ]


@pytest.mark.parametrize("model", ["B1", "B2"])
@needs_heyoka
def test_motions_in_threads_are_those_one_by_one(model):
    def run(task):
        seed, scene = task
        one = simulate(scene)
        pads = stack([random_pad(10 * seed + i) for i in range(6)])
        r = simulate_many(model, pads, np.zeros((6, 6)), 20.0, 1e-9, events=True)
        many = [r["final"].tobytes(), r["changes"].tolist(), np.concatenate(r["events"]).tolist()]
        return one.final, one.events, one.extrema, many

    tasks = list(enumerate(scenes(model)))
    alone = [run(task) for task in tasks]
    with ThreadPoolExecutor(THREADS) as pool:
        assert list(pool.map(run, tasks)) == alone
