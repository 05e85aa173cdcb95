"""Periodic motions by shooting, and growth of deviations: each against a second method."""

import dataclasses

import numpy as np
import pytest
from squeal.article.studies._neighbours import directions, growth, neighbours

from squeal.analysis.thresholds import critical_friction
from squeal.equilibrium import sliding_equilibrium
from squeal.equilibrium.damping import damped_model
from squeal.errors import ComputationError
from squeal.io.scene import Damping, Scene
from squeal.model.equations import linearise
from squeal.simulation.cycles import Cycle, Shooting, variations
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


@needs_heyoka
def test_neighbours_of_an_unstable_equilibrium_part_at_the_rate_of_its_eigenvalue():
    scene = hammering_scene("b1-a")
    rest, _ = sliding_equilibrium(scene.pad_model)
    assert rest is not None
    matrices = linearise(scene.pad_model, rest.q, rest.state)
    squares = np.linalg.eigvals(np.linalg.solve(matrices.M, matrices.K))
    rate = np.abs(np.sqrt(-squares.astype(complex)).real).max()
    stretch = 1.0 / rate
    states = np.tile(np.append(rest.q, np.zeros(3)), (2, 1))
    # few enough stretches that the motion itself does not leave the equilibrium by rounding
    logs = neighbours([scene.pad_model] * 2, states, stretch, 20)
    assert growth(logs, stretch)[0].mean() == pytest.approx(rate, rel=0.02)


@needs_heyoka
def test_neighbours_grow_as_the_variational_equations_say():
    scene = hammering_scene("b1-c")
    assert scene.stop is not None
    logs = neighbours([damped_model(scene)], np.array([scene.initial]), scene.stop / 2, 20)
    found = variations(scene, 10.0)
    total = found.logarithm + np.log(np.linalg.norm(found.matrix @ directions(1)[0]))
    assert logs.sum() == pytest.approx(total, abs=0.05)
    assert total > 10.0


def test_a_rate_is_the_slope_of_the_logarithm_whatever_oscillates():
    t = 0.5 * np.arange(1.0, 41.0)
    logs = np.diff(np.array([2.0 * t, np.log(t)]), prepend=0.0).T
    rates, least = growth(logs, 0.5)
    assert rates[0] == pytest.approx(2.0)
    assert rates[1] == pytest.approx(least)
    size = np.diff(3.0 * np.sin(7.0 * t), prepend=0.0)[:, None]
    (disturbed,), _ = growth(logs[:, :1] + size, 0.5)
    assert disturbed == pytest.approx(2.0, abs=0.1)
