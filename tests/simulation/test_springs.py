"""Motion on many springs along the face."""

import pytest

from squeal.io.scene import Scene
from squeal.model.contact import Formulation
from squeal.simulation.run import simulate
from tests.simulation.closed import bouncing, upright


def test_a_level_pad_touches_with_all_springs_in_the_same_instant():
    pad, height, count = upright(k3=None, k4=None, k_c=1e6), 1e-3, 6
    touch, back, _ = bouncing(pad, height)
    first, stop = (0, height, 0, 0, 0, 0), 2.5 * touch + back
    run = simulate(Scene("BN", pad, Formulation(springs=count), first, stop, 2))
    times = [e.t for e in run.events]
    assert times == pytest.approx([touch] * count + [touch + back] * count, rel=1e-11)
    assert [e.source for e in run.events][:2] == ["SS", "PC"]
    assert run.events[count - 1].target == "FC"
    assert run.shares["FC"] == pytest.approx(back / stop, rel=1e-10)
    assert run.shares["PC"] == pytest.approx(0.0, abs=1e-12)
