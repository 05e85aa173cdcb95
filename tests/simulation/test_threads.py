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


def in_threads(work, tasks):
    with ThreadPoolExecutor(THREADS) as pool:
        return list(pool.map(work, tasks))


@pytest.mark.parametrize("model", ["B1", "B2"])
def test_simulations_in_threads_are_those_one_by_one(model):
    def run(scene):
        result = simulate(scene)
        return result.final, result.events, result.extrema

    tasks = scenes(model) * 3
    alone = [run(scene) for scene in tasks]
    assert in_threads(run, tasks) == alone


@pytest.mark.parametrize("model", ["B1", "B2"])
@needs_heyoka
def test_batches_in_threads_are_those_one_by_one(model):
    def run(seed):
        pads = stack([random_pad(10 * seed + i) for i in range(6)])
        r = simulate_many(model, pads, np.zeros((6, 6)), 20.0, 1e-9, events=True)
        return r["final"], r["changes"], np.concatenate(r["events"])

    alone = [run(seed) for seed in range(COUNT)]
    for here, there in zip(in_threads(run, range(COUNT)), alone, strict=True):
        assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(here, there, strict=True))
