"""The sound of the page is the motion of the Python run, sampled."""

import dataclasses

import numpy as np
import pytest

from page.tests.conftest import as_json
from page.tests.test_motion import random_scene
from squeal.io.scene import read_scene
from squeal.simulation.run import simulate
from tests.conftest import ROOT

RATE = 44100
SECONDS = 0.2
SLOW = 16


@pytest.mark.parametrize(("what", "column"), [("velocity", "x_dot"), ("force", "Rn")])
def test_samples_are_those_of_the_motion(node, what, column):
    scene = read_scene(ROOT / "workflow" / "scenes" / "b2-b.yaml")
    n = round(SECONDS * RATE)
    asked = {"scene": as_json(scene), "what": what, "seconds": SECONDS, "slow": SLOW}
    heard = np.array(node("sounds.js", asked))
    assert len(heard) == n
    stop = (n - 1) / RATE / SLOW
    longer = dataclasses.replace(scene, stop=stop, samples=n, outputs=("history",))
    expected = simulate(longer).history[column]
    expected = expected - expected.mean()
    middle = slice(RATE // 100, n - RATE // 100)  # between the fades
    scaled = 0.5 * expected / np.max(np.abs(expected))
    assert heard[middle] == pytest.approx(scaled[middle], abs=1e-6)
    assert heard[0] == heard[-1] == 0.0


def test_sound_ends_with_the_model(node):
    scene = random_scene(22)  # turns over after 17 s
    asked = {"scene": as_json(scene), "what": "velocity", "seconds": 60.0, "slow": 1}
    assert 0 < len(node("sounds.js", asked)) < 60 * RATE
