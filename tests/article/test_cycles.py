"""Periodic motions by shooting, and growth of deviations: each against a second method."""

import dataclasses

import numpy as np
import pytest

from squeal.analysis.thresholds import critical_friction
from squeal.article.cycles import Cycle, Shooting
from squeal.errors import ComputationError
from squeal.io.scene import Damping, Scene
from squeal.simulation.observers import Events
from squeal.simulation.run import in_natural_units
from tests.conftest import hammering_scene, needs_heyoka


def damped(name: str, ratio: float) -> Scene:
    scene = hammering_scene(name)
    return dataclasses.replace(scene, damping=Damping(ratios=(ratio,) * 3))


@pytest.fixture(scope="module")
def shooting() -> Shooting:
    units, model, _, _ = in_natural_units(damped("b1-d", 0.005))
    return Shooting(model, units)


@pytest.fixture(scope="module")
def cycle(shooting) -> Cycle:
    """A hammering cycle, from what a simulation settles to; its period from contact changes."""
    scene = damped("b1-d", 0.005)
    _, _, start, stop = in_natural_units(scene)
    state = shooting.motion(start, 20 * stop, scene.pad.mu)
    watch = Events()
    shooting.motion(state, stop / 4, scene.pad.mu, [watch])
    lost = [e.t for e in watch.result()["events"] if e.source.leading and not e.target.leading]
    found, _ = shooting.solve(np.concatenate([state, [lost[1] - lost[0], scene.pad.mu]]))
    return found


@needs_heyoka
def test_a_cycle_closes_and_a_shift_in_time_neither_grows_nor_decays(cycle):
    assert cycle.gap < 1e-9
    assert cycle.trivial == pytest.approx(1.0, abs=1e-5)
    assert cycle.stable
    assert len(cycle.multipliers) == 5


@needs_heyoka
def test_volume_shrinks_as_damping_says(shooting, cycle):
    """Liouville: det of the monodromy is exp(-trace of the damping times the period)."""
    trace = np.trace(shooting.model.decay)
    assert np.linalg.det(cycle.monodromy) == pytest.approx(np.exp(-trace * cycle.period), rel=1e-5)


@needs_heyoka
def test_the_branch_of_cycles_starts_where_the_equilibrium_begins_to_flutter(shooting, cycle):
    first = critical_friction(damped("b1-d", 0.005), 1.0).first
    assert first is not None
    least = min(one.mu for one in shooting.branch(cycle, -1.0, 0.1, 10))
    assert least < first.mu - 0.1
    for one in shooting.branch(cycle, -1.0, 0.1, 30):
        watch = Events()
        shooting.motion(one.state, one.period, one.mu, [watch])
        if not watch.result()["events"]:
            assert one.mu == pytest.approx(first.mu, rel=1e-6)
            assert abs(one.multipliers[0]) == pytest.approx(1.0, abs=1e-4)
            break
    else:
        pytest.fail("the branch does not reach the linear motion")


@needs_heyoka
def test_a_guess_far_from_any_cycle_is_refused(shooting, cycle):
    away = np.concatenate([3.0 * cycle.state, [2.7 * cycle.period, cycle.mu]])
    with pytest.raises(ComputationError, match="no periodic motion"):
        shooting.solve(away)
