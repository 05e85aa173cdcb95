"""Simulations at the same time, in threads or in turns, know nothing of each other."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from squeal.io.scene import Scene
from squeal.simulation import simulate
from squeal.simulation.batch.many import simulate_many, stack
from squeal.simulation.run import first_state, in_natural_units
from tests.conftest import HEYOKA, needs_heyoka, random_pad

if HEYOKA:
    from squeal.simulation.integrators.taylor import TaylorIntegrator

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


@needs_heyoka
def test_simulations_in_turns_are_those_one_by_one():
    def legs(scene, count):
        _, model, state, stop = in_natural_units(scene)
        integrator = TaylorIntegrator(model, 1e-12)
        t, contact = 0.0, first_state(model, state)
        for _ in range(count):
            leg = integrator.advance(contact, t, state, min(t + 0.3, stop), dense=False)
            t, state = leg.t1, leg.end
            contact = contact if leg.point is None else contact.flip(leg.point)
            yield state

    both = [list(legs(scene, 12)) for scene in scenes("B1")[:2]]
    turns = zip(*(legs(scene, 12) for scene in scenes("B1")[:2]), strict=True)
    assert np.array_equal(both, list(zip(*turns, strict=True)))


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
