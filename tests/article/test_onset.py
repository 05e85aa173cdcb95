"""Onset and attractors: what settles, against simulations and eigenvalues."""

import dataclasses
import math

import numpy as np
import pytest

from squeal.article.claims.measures import measure
from squeal.article.figures import onset as figure
from squeal.article.report.onset import generated
from squeal.article.results import onset as results
from squeal.article.studies import _attractors as attractors
from squeal.article.studies import _late, _sweeps
from squeal.article.studies import onset as study
from squeal.article.studies._damped import RATIO, Motion, damped, settled
from squeal.equilibrium.damping import damped_model
from squeal.errors import ComputationError
from tests.article.onset import SILENT, settled_one, step
from tests.conftest import hammering_scene, needs_heyoka


@pytest.fixture(scope="module")
def hammering():
    """B1 (d) and what its motion comes to under growing damping."""
    scene = hammering_scene("b1-d")
    return scene, _late.late({"b1-d": scene})["b1-d"]


@needs_heyoka
def test_a_cycle_s_multiplier_is_the_decay_of_a_disturbance(hammering):
    scene, (rows, states, *_) = hammering
    at = _late.RATIOS.index(RATIO)
    row = rows[at]
    assert isinstance(row, results.Late)
    assert row.goes_on
    assert row.growth is not None
    assert row.growth > 0.0
    found = attractors.cycles("b1-d", scene, states[at])
    assert isinstance(found, results.Cycles)
    assert found.decay == pytest.approx(found.own.multiplier, abs=1e-5)
    assert found.own.peak == pytest.approx(row.peak, rel=1e-3)
    assert all(point.changes % 2 == 0 for point in found.branch)  # contact comes back
    assert not found.branch[-1].changes
    assert all(point.changes for point in found.branch[:-1])


@needs_heyoka
def test_strong_damping_brings_the_pad_to_rest():
    scene = hammering_scene("b2-b")
    motion = Motion(damped_model(damped(scene, 0.2)), np.array(scene.initial))
    (end,), (found,) = settled([motion], 0.02, 0.003)
    assert found is not None
    assert (found.lost, found.goes_on, found.hammers, found.turns) == (0.0, False, False, 0)
    assert found.low == pytest.approx(found.high, abs=1e-9)
    assert found.face == pytest.approx(0.0, abs=1e-6)
    assert np.abs(end[3:]).max() < 1e-9


@needs_heyoka
def test_what_is_measured_is_what_a_simulation_of_the_scene_measures():
    """Undamped, against the measures of the statements on hammering; a pad off the surface."""
    for name, hammering in (("b1-c", True), ("b2-b", False), ("b2-c", True)):
        scene = hammering_scene(name)
        assert scene.stop is not None
        case = measure(scene)
        motion = Motion(scene.pad_model, np.array(scene.initial))
        _, (found,) = settled([motion], 1e-9, scene.stop)
        assert found is not None
        assert found.hammers == hammering
        assert found.peak == pytest.approx(case.first.high, rel=1e-3)
        assert found.face == pytest.approx(case.face, rel=1e-2)  # of samples
        if scene.model == "B2":
            assert (found.low, found.high) == pytest.approx(
                (case.second.low, case.second.high), abs=1e-2
            )
        else:
            assert found.low is None
    away = motion.state + [0.0, 1.0, 0.0, 0.0, 100.0, 0.0]
    _, (off,) = settled([motion._replace(state=away)], 1e-6, 1e-6)
    assert off is not None
    assert off.off
    assert not off.goes_on
    assert off.low is None


@needs_heyoka
def test_a_motion_that_ends_is_missing():
    scene = hammering_scene("b1-d")
    models = [damped_model(damped(scene, ratio)) for ratio in _late.RATIOS]
    fast = np.tile(scene.initial, (4, 1))
    fast[0, 5] = 1e5  # rad/s: it turns over
    ends, found = settled([Motion(*one) for one in zip(models, fast, strict=True)], 0.003, 0.001)
    assert np.isnan(ends[0]).all()
    assert found[0] is None
    assert all(found[1:])
    assert np.isfinite(ends[1:]).all()


def test_no_equilibrium_means_no_threshold(monkeypatch):
    def none(*_):
        raise ComputationError("without friction the pad has no place of rest")

    monkeypatch.setattr(study, "branch_system", none)
    assert study.threshold(hammering_scene("b1-d")) is None


def test_a_threshold_is_where_an_eigenvalue_crosses():
    scene = hammering_scene("b1-d")
    at = study.threshold(scene)
    assert at is not None
    for mu, sign in ((at - 1e-4, -1.0), (at + 1e-4, 1.0)):
        near = dataclasses.replace(scene, pad=scene.pad.replace(mu=mu))
        grows = _late.grown(near, RATIO)
        assert grows is not None
        assert sign * grows > 0.0
    assert study.threshold(hammering_scene("b1-c")) is None


@pytest.mark.parametrize(
    ("up", "tops"),
    [
        ((step(0.1, lost=0.0), step(0.15)), [1]),
        ((step(0.1), step(0.15), step(0.2, lost=0.0)), [1]),
        ((step(0.1), step(0.15, face=2.0), step(0.2), step(0.25, face=2.0)), [0, 3]),
        ((step(0.1, face=2.0),), [0]),
        ((step(0.1), step(0.15, face=2.0), step(0.2, lost=0.0), step(0.25)), [0, 1]),
        ((step(0.1), step(0.2)), [0]),
        ((step(0.1, lost=0.0),), []),
    ],
)
def test_friction_is_lowered_from_the_top_with_and_without_sliding(up, tops):
    assert _sweeps._tops([_sweeps.Begun(one.mu, np.zeros(6), one) for one in up]) == tops


def test_friction_is_followed_until_contact_does_not_change(monkeypatch):
    model = hammering_scene("b1-d").pad_model
    calls = []

    def looked_at(motions, before, seen):
        calls.append([round(m.model.pad.mu, 6) for m in motions])
        # the first motion dies out at the third step, the second one ends at once
        found = [settled_one(0.0 if len(calls) == 3 else 0.4)]
        return [m.state + 1.0 for m in motions], (found + [None])[: len(motions)]

    monkeypatch.setattr(_sweeps, "settled", looked_at)
    begun = _sweeps.Begun(0.25, np.zeros(6), settled_one(0.4))
    one, other = (("b1-d", RATIO), "down"), (("b1-d", 0.01), "risen")
    mus = (0.2, 0.15, 0.1, 0.05)
    ways = _sweeps.followed(
        {one: _sweeps.Way(model, begun, mus), other: _sweeps.Way(model, begun, (0.3, 0.35))}, 1.0
    )
    assert [step.mu for step in ways[one]] == [0.25, 0.2, 0.15, 0.1]
    assert [step.goes_on for step in ways[one]] == [True, True, True, False]
    assert [step.mu for step in ways[other]] == [0.25]
    assert calls == [[0.2, 0.3], [0.15], [0.1]]


@needs_heyoka
def test_a_lively_motion_is_followed_both_ways_and_the_resting_pad_stays_at_rest(
    monkeypatch, hammering
):
    """B1 (d), which has its own cycle beside rest, above and below the flutter threshold."""
    scene, found = hammering
    state = found.states[_late.RATIOS.index(RATIO)]
    begun = _sweeps.Begun(scene.pad.mu, state, settled_one(0.4))
    monkeypatch.setattr(_sweeps, "MU", (0.5, 0.75, 0.85))
    (sweep,) = _sweeps.sweeps({"b1-d": scene}, {"b1-d": (RATIO,)}, {("b1-d", RATIO): begun})["b1-d"]
    mus = [one.mu for one in sweep.lively]
    assert mus == sorted(mus)
    assert scene.pad.mu in mus
    assert sweep.lively[-1].goes_on
    (alone,) = _sweeps.sweeps({"b1-d": scene}, {"b1-d": (RATIO,)}, {})["b1-d"]
    assert alone.lively == ()
    assert alone.up == sweep.up


@needs_heyoka
def test_other_starts_are_those_of_a_simulation(monkeypatch):
    """Strongly damped all starts come to rest; undamped the own one hammers early, as measured."""
    scene = hammering_scene("b2-c")
    monkeypatch.setattr(_late, "RATIOS", (1e-9, 0.3))
    monkeypatch.setattr(_late, "SIDE", 2)
    monkeypatch.setattr(_late, "MOVING", 0)
    free, damped_ = _late.late({"b2-c": scene})["b2-c"].others
    assert free.starts == damped_.starts == 4
    assert (damped_.lasting, damped_.hammer, damped_.edges, damped_.ends) == (0, 0, 0, 0)
    assert damped_.liveliest is None
    assert not damped_.beside
    assert free.lasting > 0
    case = measure(scene)
    (early, *_) = free.early
    assert early is not None
    assert early.hammers
    assert early.face == pytest.approx(case.face, rel=1e-2)


def test_first_spans_are_looked_at_one_after_the_other(monkeypatch):
    """Each begins where the last one ended; nothing follows where the model ends."""
    calls = []

    def looked_at(motions, seen):
        calls.append(([m.state[0] for m in motions], seen))
        found = [settled_one(0.4), None] if len(calls) == 2 else [settled_one(0.1)] * len(motions)
        return [m.state + 1.0 for m in motions], found

    monkeypatch.setattr(_late, "looked_at", looked_at)
    monkeypatch.setattr(_late, "EARLY", (1, 3, 10))
    model = hammering_scene("b1-d").pad_model
    own = {
        _late._Lane("b1-d", ratio, 0): Motion(model, np.full(6, 10.0 * i))
        for i, ratio in enumerate((0.1, 0.2))
    }
    found = _late._early(own, 2.0)
    assert calls == [([0.0, 10.0], 2.0), ([1.0, 11.0], 4.0), ([2.0], 14.0)]
    assert [one and one.lost for one in found["b1-d", 0.1]] == [0.1, 0.4, 0.1]
    assert [one and one.lost for one in found["b1-d", 0.2]] == [0.1, None, None]


def test_starts_without_an_equilibrium_are_the_own_one(monkeypatch):
    scene = hammering_scene("b2-c")
    assert [len(some) for some in _late.starts(scene)] == [1 + _late.SIDE**2, _late.MOVING]
    monkeypatch.setattr(_late, "sliding_equilibrium", lambda model: (None, "none"))
    own, moved = _late.starts(scene)
    assert own == pytest.approx(np.array([scene.initial]))
    assert moved.shape == (0, 6)


def test_starts_in_motion_have_places_and_speeds_of_one_size():
    """k_c y = F_n at rest; a mass m that swings by A on a spring k1 is as fast as A sqrt(k1/m)."""
    scene = hammering_scene("b2-c")
    pad, at = scene.pad, np.array([1e-6, 2e-6, 3e-6])
    off = _late.moving(scene, at) - np.append(at, np.zeros(3))
    reach = _late.WIDER * pad.F_n / pad.k_c * np.array([1.0, 1.0, 1.0 / pad.w])
    size = np.concatenate([reach, reach * math.sqrt(pad.k1 / pad.m)])
    assert off / size == pytest.approx(np.random.default_rng(_late.SEED).uniform(-1, 1, off.shape))
    most = np.abs(off / size).max(axis=0)
    assert np.all((most > 0.9) & (most <= 1.0))
    assert np.all(np.abs((off / size).mean(axis=0)) < 0.3)


@needs_heyoka
def test_only_beside_an_equilibrium_that_is_not_unstable_starts_are_in_motion(monkeypatch):
    """B1 (d) flutters at its friction with little damping, not with much."""
    scene = hammering_scene("b1-d")
    monkeypatch.setattr(_late, "RATIOS", (0.005, 0.3))
    monkeypatch.setattr(_late, "SIDE", 1)
    unstable, stable = _late.late({"b1-d": scene})["b1-d"].others
    assert unstable.growth > 0.0 > stable.growth
    assert (unstable.starts, stable.starts) == (1, 1 + _late.MOVING)


def test_other_starts_that_rub_faster_than_the_surface_end(monkeypatch):
    scene = hammering_scene("b2-c")
    fates = {0: settled_one(0.4, face=2.0), 1: settled_one(0.4, face=2.0), 2: settled_one(0.4)}
    monkeypatch.setattr(_late, "RATIOS", (0.005,))
    monkeypatch.setattr(_late, "SIDE", 2)
    monkeypatch.setattr(_late, "MOVING", 0)
    monkeypatch.setattr(_late, "_early", lambda own, stop: {lane[:2]: (None,) for lane in own})

    def after(motions, growth, stop):
        ends = {lane: np.full(6, lane.start) for lane in motions}
        return ends, {lane: fates.get(lane.start, _late._KEPT) for lane in motions}

    monkeypatch.setattr(_late, "_after", after)
    (found,) = _late.late({"b2-c": scene})["b2-c"].others
    assert (found.starts, found.ends, found.lasting) == (4, 1, 1)
    assert found.liveliest is not None
    assert found.liveliest.slides


def test_without_heyoka_the_reason_is_drawn_and_told():
    why = "No heyoka on this machine simulates no batches of pads."
    none = study.without(why)
    values, tables = generated(none, SILENT)
    assert why.rstrip(".") in values["onset.cycle"]
    assert set(tables) == {"lasting", "hammering", "exponents"}
    assert figure.draw(none).alternative == why
