"""Ensembles against single simulations, histories, closed forms and the limits of the model."""

import math
import sys
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

from squeal.article.claims.motions import measures
from squeal.article.identify.ensemble import simulate_many, stack
from squeal.errors import ComputationError
from squeal.io.scene import Damping, Scene
from squeal.model.contact import CONSISTENT, Formulation
from squeal.simulation.hybrid import LIMITS
from squeal.simulation.run import simulate
from tests.conftest import needs_heyoka, random_pad
from tests.simulation.closed import bouncing, upright

pytestmark = needs_heyoka

STOP = 60.0
LAWS = [
    ("B1", CONSISTENT),
    ("B2", CONSISTENT),
    ("B2", Formulation("mean")),
    ("B2", Formulation("mean", "frame", "-")),
    ("BN", Formulation(springs=5)),
]
FALLING = {"mu": None, "V": 3.0, "mu_s": 0.8, "mu_k": 0.3, "v_ref": 2.0}


def some(model, count, seed, **fixed):
    """Random pads of a model, and starts off every switching surface."""
    pads = [random_pad(seed + i, model, **fixed) for i in range(count)]
    r = np.random.default_rng(seed)
    initial = np.zeros((count, 6))
    initial[:, :3] = r.uniform(-1.0, 1.0, (count, 3)) * 1e-2
    return pads, initial


def scene(model, formulation, pad, initial, **more):
    given: Any = {"stop": STOP, "samples": 2, "outputs": ("events",)} | more
    return Scene(model, pad, formulation, tuple(initial), **given)


@pytest.mark.parametrize(("model", "formulation"), LAWS)
@pytest.mark.parametrize("terms", ["plain", "damped", "falling"])
def test_each_motion_is_that_of_a_single_run(model, formulation, terms):
    """Also of those that leave the model, and of pads that damp each with a matrix of its own."""
    pads, initial = some(model, 13, 100, **(FALLING if terms == "falling" else {}))
    rows = np.array([i * np.diag([1e-2, 2e-2, 1e-3]) for i in range(13)])
    damping: Any = {"damping": rows} if terms == "damped" else {}
    r = simulate_many(model, stack(pads), initial, STOP, 1e-12, formulation, events=True, **damping)
    for i, pad in enumerate(pads):
        more: Any = {"tolerance": 1e-12}
        if damping:
            more["damping"] = Damping(matrix=rows[i])
        try:
            one = simulate(scene(model, formulation, pad, initial[i], **more))
        except ComputationError as refused:
            assert r["limit"][i] in LIMITS
            ended = float(str(refused).split("t = ")[1].split()[0])
            assert r["ended"][i] == pytest.approx(ended, rel=1e-6)
            assert np.isnan(r["final"][i]).all()
            continue
        assert r["valid"][i]
        assert r["changes"][i] == one.contact_changes
        # two paths differ by rounding, which a weakly chaotic motion amplifies
        assert r["events"][i][:, 0] == pytest.approx([e.t for e in one.events], rel=1e-6)
        scale = np.abs(one.final[1:]).max()
        assert r["final"][i] == pytest.approx(one.final[1:], abs=1e-5 * scale)


def test_both_edges_touch_in_the_same_instant_of_the_closed_form():
    pad = upright()
    height = 1e-3
    touch, back, lowest = bouncing(pad, height)
    period = 2 * touch + back
    initial = np.zeros((3, 6))
    initial[:, 1] = height
    r = simulate_many("B1", pad, initial, 4.5 * period, 1e-12, events=True, measure=measures)
    in_a_period = [touch, touch, touch + back, touch + back]  # both edges each time
    times = [n * period + t for n in range(5) for t in in_a_period]
    for i in range(3):
        assert r["events"][i][:, 0] == pytest.approx(times[:18], rel=1e-10)
        assert sorted(r["losses"][i]) == [0] * 4 + [1] * 4
        # the force starts from zero at first contact and comes back to it
        assert r["first"][i] == pytest.approx((0.0, pad.k3 * lowest / pad.F_n), rel=1e-4)
        assert r["duration"][i] == pytest.approx(4.5 * period - touch, rel=1e-10)


def test_several_processes_change_nothing():
    pads, initial = some("B2", 11, 60)
    one = simulate_many("B2", stack(pads), initial, 30.0, 1e-10, measure=measures, workers=1)
    two = simulate_many("B2", stack(pads), initial, 30.0, 1e-10, measure=measures, workers=2)
    assert np.allclose(two["final"], one["final"], rtol=0, atol=1e-9, equal_nan=True)
    assert two["losses"].tolist() == one["losses"].tolist()


def test_what_cannot_be_simulated_is_refused(monkeypatch):
    pads, initial = some("B1", 3, 40)
    initial[1, 0] = math.nan
    with pytest.raises(ComputationError, match="pad 1 of the ensemble are not finite"):
        simulate_many("B1", stack(pads), initial, 20.0)
    with pytest.raises(ComputationError, match="pad 2 of the ensemble end before time 0"):
        simulate_many("B1", stack(pads), np.zeros((3, 6)), np.array([0.0, 20.0, -1.0]))
    monkeypatch.setitem(sys.modules, "squeal.simulation.taylor", None)
    with pytest.raises(ComputationError, match="heyoka"):
        simulate_many("B1", stack(pads), np.zeros((3, 6)), 1.0)


@pytest.mark.parametrize("model", ["B1", "B2"])
def test_motions_in_threads_are_those_one_by_one(model):
    """Simulations at the same time, in threads or in turns, know nothing of each other."""

    def run(seed):
        start = (0, 1e-3, 0, 0, 0, 0)
        one = simulate(Scene(model, random_pad(seed, model), initial=start, stop=5.0, samples=2))
        pads = stack([random_pad(10 * seed + i) for i in range(6)])
        r = simulate_many(model, pads, np.zeros((6, 6)), 20.0, 1e-9, events=True)
        many = [r["final"].tobytes(), r["changes"].tolist(), np.concatenate(r["events"]).tolist()]
        return one.final, one.events, one.extrema, many

    alone = [run(seed) for seed in range(12)]
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(run, range(12))) == alone
