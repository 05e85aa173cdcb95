"""Simulations that start at the sliding equilibrium, with or without a kick."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from squeal.analysis.pads import analyse
from squeal.errors import ComputationError
from squeal.io.scene import Scene, read_scene
from squeal.model.contact import Formulation
from squeal.model.pad import Pad
from squeal.simulation import simulate
from squeal.simulation.run import first_place
from tests.conftest import SCENES, random_pad


def scene(name, **more: Any):
    one = read_scene(SCENES / f"{name}.yaml", "simulate")
    return dataclasses.replace(one, **({"start": "equilibrium", "initial": (0.0,) * 6} | more))


@pytest.mark.parametrize("name", ["b1-a", "b1-c", "b2-a", "b2-c"])
def test_nothing_moves_from_the_equilibrium(name):
    one = scene(name, outputs=("history",))
    one = dataclasses.replace(one, stop=0.05 * one.stop)
    found, rest = simulate(one), np.array(analyse(one).q)
    assert found.contact_changes == 0
    assert found.history is not None
    for column, place in zip(("x", "y", "theta"), rest, strict=True):
        assert np.abs(found.history[column] - place).max() < 1e-9 * np.abs(rest).max()


def test_a_kick_counts_from_the_equilibrium():
    kick = (1e-6, -2e-6, 3e-5, 0.01, -0.02, 0.3)
    one = scene("b2-c", initial=kick)
    q = analyse(one).q
    assert first_place(one)[:3] == pytest.approx([a + b for a, b in zip(q, kick, strict=False)])
    assert first_place(one)[3:] == kick[3:]
    assert first_place(dataclasses.replace(one, start="origin")) == kick


def test_where_there_is_no_equilibrium_one_sentence_says_so():
    # without springs nothing balances the friction force
    plain = {"k1": 0.0, "k2": 0.0, "k3": 1.0, "k4": 1.0, "L1": 1.0, "L2": 1.0}
    plain |= {"m": 1.0, "w": 1.0, "h": 0.2, "alpha1": 1.5, "alpha2": 1.5, "mu": 0.5, "F_n": 0.01}
    one = Scene("B1", Pad(**plain), stop=1.0, samples=2, start="equilibrium")
    with pytest.raises(ComputationError, match="initial: no steady sliding exists"):
        simulate(one)
    turned = scene("b2-a", initial=(0.0, 0.0, 2.0, 0.0, 0.0, 0.0))
    with pytest.raises(ComputationError, match="initial: theta: 2 turns the pad past 90 degrees"):
        simulate(turned)


@pytest.mark.parametrize("rate", [5.0, -5.0])
@pytest.mark.parametrize("law", ["integral", "mean"])
def test_a_level_pad_on_the_surface_that_begins_to_turn(rate, law):
    def run(tilt, backend="auto"):
        start = (0.0, 0.0, tilt, 0.0, 0.0, rate)
        pad = dataclasses.replace(random_pad(11, "B2"), theta0=0.0, y0=0.0)
        scene = Scene("B2", pad, Formulation(line_force=law), initial=start, stop=1e-4, samples=2)
        return np.array(simulate(scene, backend=backend).final)

    # the contact length is 0/0 there and half the face at once; the motion depends on the start
    # continuously, so that it lies between those from a little tilt to either side
    level, beside = run(0.0), [run(tilt) for tilt in (1e-9, -1e-9)]
    scale = np.abs(level) + 1e-12
    assert np.abs(level - sum(beside) / 2).max() / scale.max() < 1e-9
    assert np.all(np.abs(level - beside[0]) / scale < 1e-5)
    assert run(0.0, "scipy") == pytest.approx(level, rel=1e-7)
