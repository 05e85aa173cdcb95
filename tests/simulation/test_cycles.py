"""Periodic motions by shooting, and growth of deviations: each against a second method."""

import dataclasses
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import squeal
from squeal.errors import ComputationError
from squeal.io.scene import Damping, Scene, read_scene
from squeal.queries.cycles import Cycles, _changes_of_sliding
from squeal.queries.thresholds import critical_friction
from squeal.simulation.cycles import (
    CLOSED_CURVE,
    TEST_FUNCTIONS,
    Cycle,
    Point,
    Shooting,
    _first_return,
)
from squeal.simulation.hybrid import ContactChanges, Segment
from squeal.simulation.run import in_natural_units
from tests.conftest import ROOT, hammering_scene, needs_heyoka
from tests.simulation.closed import bouncing, upright

pytestmark = needs_heyoka


def damped(scene: Scene, ratio: float = 0.005, **more) -> Scene:
    return dataclasses.replace(scene, damping=Damping(ratios=(ratio,) * 3), **more)


HAMMERS = damped(hammering_scene("b1-d"))
LINE = damped(read_scene(ROOT / "workflow/scenes/b2-c.yaml"))


@pytest.fixture(scope="module")
def answer() -> Cycles:
    return squeal.cycles(HAMMERS, ("mu", 0.5, 0.8))


@pytest.fixture(scope="module")
def shooting(answer) -> Shooting:
    return answer.source[0]


@pytest.fixture(scope="module")
def cycle(answer) -> Cycle:
    """The hammering cycle to which the scene settles."""
    return answer.source[1]


def test_the_scene_has_its_own_value_exactly(monkeypatch):
    monkeypatch.setattr("squeal.queries.cycles.MOST", 1)
    k1 = HAMMERS.pad.k1
    ends = [share * k1 for share in np.arange(2.1, 4.0, 1e-3).tolist()]
    high = next(end for end in ends if k1 / end * end != k1)
    found = squeal.cycles(HAMMERS, ("k1", 0.9 * k1, high))
    assert found.orbits[found.own].value == k1
    assert any(str(part).startswith("sliding at k1 = ") for part in found.parts())


def test_sliding_without_an_equilibrium_is_said_in_words():
    rest = Cycles("B1", "mu", reason="none", sliding=((0.5, None),))
    assert rest.parts()[-1] == "sliding at mu = 0.5: no equilibrium"


def test_a_cycle_closes_and_volume_shrinks_as_damping_says(shooting, cycle):
    assert cycle.gap < 1e-9
    assert cycle.trivial == pytest.approx(1.0, abs=1e-5)
    assert cycle.stable
    assert len(cycle.multipliers) == 5
    # Liouville: det of the monodromy is exp(-trace of the damping times the period)
    trace = np.trace(shooting.model(cycle.value).decay)
    assert np.linalg.det(cycle.monodromy) == pytest.approx(np.exp(-trace * cycle.period), rel=1e-5)


def test_the_branch_of_cycles_starts_where_the_equilibrium_begins_to_flutter(answer):
    last = answer.orbits[0]
    assert not last.contacts
    assert last.value == pytest.approx(critical_friction(HAMMERS, 1.0).first.mu, rel=1e-6)
    assert last.multiplier == pytest.approx(1.0, abs=1e-4)
    assert [one.turn for one in answer.orbits if one.turn] == ["grazing", "fold"]


def test_the_peak_is_that_of_both_edges_together(answer):
    """Against the densely sampled motion of one period."""
    orbit = answer.orbits[answer.own]
    scene = dataclasses.replace(HAMMERS, initial=orbit.start, stop=orbit.period, samples=200_001)
    scene = dataclasses.replace(scene, outputs=("history",))
    history = squeal.simulate(scene).history
    together = history["F3"] + history["F4"]
    assert orbit.peak == pytest.approx(together.max(), rel=1e-5)
    assert orbit.peak > 1.01 * max(history["F3"].max(), history["F4"].max())


def test_sliding_changes_where_thresholds_say(answer):
    points = squeal.thresholds(HAMMERS).points
    within = [(point.mu, point.kind) for point in points if 0.5 < point.mu < 0.8]
    assert within
    assert [verdict for _, verdict in answer.critical] == [kind for _, kind in within]
    for (value, _), (mu, _) in zip(answer.critical, within, strict=True):
        assert value == pytest.approx(mu, rel=1e-8)


def test_each_change_of_a_verdict_between_two_values_is_located():
    """Between 0 and 1 sliding flutters from 0.3 on, and from 0.7 on there is no equilibrium."""

    def verdict_at(value):
        if value >= 0.7:
            return None
        return "flutter" if value >= 0.3 else "stable"

    sliding = [(value, verdict_at(value)) for value in (-1.0, 0.0, 1.0)]
    changes = _changes_of_sliding(sliding, verdict_at)
    assert [verdict for _, verdict in changes] == ["flutter", None]
    assert [value for value, _ in changes] == pytest.approx([0.3, 0.7], abs=1e-9)


def test_a_change_of_sliding_is_located_in_the_narrowest_range():
    """Two neighbouring doubles: the interval cannot be halved."""
    next_value = float(np.nextafter(1.0, 2.0))
    sliding = [(1.0, "stable"), (next_value, "flutter")]
    assert _changes_of_sliding(sliding, dict(sliding).get) == [(next_value, "flutter")]


def test_multipliers_are_those_of_differences_of_the_flow(shooting, cycle):
    step = 1e-6 * np.abs(cycle.state).max()

    def end(change):
        return shooting.motion(cycle.state + change, cycle.period, cycle.value).end[:, 0]

    columns = [(end(step * e) - end(-step * e)) / (2 * step) for e in np.eye(6)]
    assert cycle.monodromy == pytest.approx(np.transpose(columns), rel=1e-4, abs=1e-4)


def test_work_of_friction_is_what_damping_takes(answer):
    for one in answer.orbits:
        assert one.friction == pytest.approx(one.damping, rel=1e-8)
        assert one.damping >= 0.0


def test_long_simulations_stay_on_a_stable_cycle_and_leave_an_unstable_one(answer):
    """Just above the fold two cycles: a motion stays on the stable one and leaves the other. Below
    it the motion from the last cycle comes to rest."""
    fold = next(one.value for one in answer.orbits if one.turn == "fold")

    def settled(mu, start):
        found = squeal.cycles(HAMMERS.replace(mu=mu, initial=start, stop=0.02, start="origin"))
        return found.orbits[0].amplitude[1] if found.orbits else 0.0

    near = min(answer.orbits, key=lambda one: abs(one.value - fold))
    beside = squeal.cycles(HAMMERS, ("mu", fold + 0.01, 0.8)).orbits[0]
    assert beside.value == pytest.approx(fold + 0.01)
    assert settled(fold + 0.01, near.start) == pytest.approx(beside.amplitude[1], rel=1e-6)
    assert settled(fold - 0.01, near.start) == 0.0
    unstable = next(one for one in answer.orbits if one.stable is False)
    kicked = tuple(np.array(unstable.start) * 1.02)
    assert settled(unstable.value, kicked) != pytest.approx(unstable.amplitude[1], rel=0.1)


def test_a_bouncing_mass_without_damping_has_the_period_of_its_closed_form():
    """Free fall and half an oscillation on the springs: a family that no multiplier isolates."""
    pad = upright()
    height = 1e-4
    scene = Scene("B1", pad, initial=(0.0, height, 0.0, 0.0, 0.0, 0.0), stop=1.0, samples=2)
    units, model, start, _ = in_natural_units(scene)
    shooting = Shooting(lambda mu: model.replace(mu=mu), units)
    fall, contact, depth = bouncing(pad, height)
    one = shooting.shoot(start, (2 * fall + contact) / units.time, 0.0)
    assert np.abs(one.segment.end[:, 0] - start).max() < 1e-9
    half = shooting.shoot(start, (fall + contact / 2) / units.time, 0.0)
    assert half.gap == pytest.approx((height + depth) / height, rel=1e-9)
    assert len(one.contacts) == 4
    vertical = one.monodromy[np.ix_([1, 4], [1, 4])]  # a double multiplier 1
    assert np.linalg.det(vertical) == pytest.approx(1.0, abs=1e-6)
    assert np.trace(vertical) == pytest.approx(2.0, abs=1e-4)


def test_a_branch_over_a_small_signed_length_goes_both_ways():
    """The gap y0 shifts the line contact alone: its sign and its size of micrometres matter."""
    gap = LINE.pad.y0
    found = squeal.cycles(LINE, ("y0", 1.02 * gap, 0.98 * gap))
    assert found.ends == ("", "")
    values = [one.value for one in found.orbits]
    assert (min(values), max(values)) == pytest.approx((1.02 * gap, 0.98 * gap))


def test_rest_in_an_equilibrium_that_flutters_is_not_called_stable():
    rest = dataclasses.replace(LINE, initial=(0.0,) * 6, start="equilibrium", stop=1e-5)
    found = squeal.cycles(rest, windows=1)
    assert not found.orbits
    assert found.sliding == ((rest.pad.mu, "flutter"),)
    assert "not stable (flutter)" in found.reason


def test_a_guess_far_from_any_cycle_is_refused(shooting, cycle):
    away = np.concatenate([3.0 * cycle.state, [2.7 * cycle.period, cycle.value]])
    with pytest.raises(ComputationError, match="no periodic motion"):
        shooting.solve(away)


def test_a_late_return_gives_the_least_period(shooting, cycle):
    """Five periods of a cycle close too; their multipliers are fifth powers."""
    five = shooting.shoot(cycle.state, 5 * cycle.period, cycle.value)
    assert five.gap < 1e-6
    assert abs(five.multipliers[0]) == pytest.approx(abs(cycle.multipliers[0]) ** 5, rel=1e-3)
    assert shooting._shortest(five).period == pytest.approx(cycle.period, rel=1e-9)


@pytest.mark.parametrize(
    ("kind", "inside", "outside"),
    [
        ("period doubling", (-0.9, 0.3), (-1.1, 0.3)),
        ("period doubling", (-0.9, 1.1), (-1.1, 1.2)),  # what passes +1 is no doubling
        ("torus", (0.6 + 0.7j, 0.6 - 0.7j), (0.8 + 0.7j, 0.8 - 0.7j)),
        ("torus", (-1.2, 0.6 + 0.7j, 0.6 - 0.7j), (-1.2, -0.8 + 0.7j, -0.8 - 0.7j)),
    ],
)
def test_multipliers_that_leave_the_unit_circle_name_the_turn(kind, inside, outside):
    """Through -1, or as a pair; other kinds see nothing."""
    cycle_inside: Any = SimpleNamespace(multipliers=np.array(inside, complex).tolist())
    cycle_outside: Any = SimpleNamespace(multipliers=np.array(outside, complex).tolist())
    for name in ("period doubling", "torus"):
        before = TEST_FUNCTIONS[name](Point(cycle_inside, None))
        after = TEST_FUNCTIONS[name](Point(cycle_outside, None))
        assert (before != after) == (name == kind)


@pytest.mark.parametrize(("largest", "stable"), [(0.9, True), (1.1, False), (1.0, None)])
def test_a_multiplier_on_the_unit_circle_decides_nothing(largest, stable):
    segment: Any = None
    small = np.diag([1.0, largest, 0.5, 0.5, 0.0, 0.0])
    assert Cycle(np.zeros(6), 1.0, small, 0.0, 0.0, segment).stable is stable


class OnACurve(Shooting):
    """Cycles on a known curve: (z1, T, value) = (sin a, 2 + 0.3 sin a + pitch a, cos a), whose
    multipliers cross the unit circle at known a: through -1, and as a pair, whose modulus swings
    about `radius` by `swing`; two others meet outside it."""

    pitch = 0.0
    radius = 1.0
    swing = 0.5

    def solve(self, guess, direction=None, most=0):
        around = self.pitch and (guess[6] - 2.0 - 0.3 * guess[0]) / self.pitch
        a = np.arctan2(guess[0], guess[7])
        a = a if direction is not None else np.copysign(np.arccos(guess[7]), guess[0])
        a += 2 * np.pi * np.round((around - a) / (2 * np.pi))
        ahead = np.zeros(8)
        ahead[[0, 6, 7]] = np.cos(a), 0.3 * np.cos(a) + self.pitch, -np.sin(a)
        ahead /= np.linalg.norm(ahead) * (1 if direction is None else np.sign(ahead @ direction))
        place = np.array([np.sin(a), 0.0, 0.0, 0.0, 0.0, 0.0])
        small = np.diag([1.0, -1.0 - 0.5 * np.sin(a - 2.0), -1.5, -1.5, 0.0, 0.0])
        small[[2, 3], [3, 2]] = 1.0, 0.1 * np.sin(a - 0.3)
        small[4:, 4:] = (self.radius + self.swing * np.sin(a + 1.0)) * np.array(
            [[0.6, 0.8], [-0.8, 0.6]]
        )
        segment: Any = SimpleNamespace(contact_after_changes=np.ones((2, 1)))
        period = 2.0 + 0.3 * np.sin(a) + self.pitch * a
        return Point(Cycle(place, period, small, np.cos(a), 0.0, segment), ahead)

    def _rates(self, state, value):
        return np.ones(6)


class OnAHelix(OnACurve):
    pitch = 0.05


@pytest.mark.parametrize("towards", [1.0, -1.0])
def test_a_branch_is_a_closed_curve_where_its_first_cycle_returns_and_no_other(towards):
    """The value alone returns twice in a turn; on a helix the cycle never does."""
    start = np.array([np.sin(1.0), 0, 0, 0, 0, 0, 2 + 0.3 * np.sin(1.0), np.cos(1.0)])
    nothing: Any = None
    circle = OnACurve(nothing, nothing)
    helix = OnAHelix(nothing, nothing)
    own = circle.solve(start)[0]
    found, why = circle.branch(own, towards, (-2.0, 2.0), 0.2, 200)
    assert why == CLOSED_CURVE
    angles = np.unwrap([np.arctan2(one.unknowns[0], one.value) for one in found])
    assert abs(angles[-1] - angles[0]) == pytest.approx(2 * np.pi, abs=0.2)
    assert np.abs(np.diff(angles)).max() < 0.21
    start[6] += 0.05
    assert helix.branch(helix.solve(start)[0], towards, (-2.0, 2.0), 0.2, 80)[1] != CLOSED_CURVE
    open_end, why = circle.branch(own, -1.0, (0.2, 2.0), 0.2, 200)
    assert why == ""
    assert open_end[-1].value == pytest.approx(0.2)


@pytest.mark.parametrize("towards", [1.0, -1.0])
@pytest.mark.parametrize("start", [-3.1, -0.05, 0.02, 1.0, 2.3, 3.1])
def test_a_closed_curve_passes_each_turn_once(start, towards):
    """From anywhere, also beside a fold; a twelve times halved step locates the turn."""
    nothing: Any = None
    circle = OnACurve(nothing, nothing)
    own = circle.solve(np.array([np.sin(start), 0, 0, 0, 0, 0, 2.0, np.cos(start)]))[0]
    found, why = circle.branch(own, towards, (-2.0, 2.0), 0.2, 200)
    assert why == CLOSED_CURVE
    turns = [(one.turn, np.arctan2(one.unknowns[0], one.value)) for one in found if one.turn]
    angles = {"fold": (0.0, np.pi), "period doubling": (2.0, 2 - np.pi), "torus": (-1, np.pi - 1)}
    for kind, known in angles.items():
        found_angles = np.array([angle for name, angle in turns if name == kind])
        away = np.ravel(np.cos(found_angles[:, None] - np.array(known)))
        assert sorted(away) == pytest.approx([-1.0, -1.0, 1.0, 1.0], abs=1e-8)
    along = [-np.sign(np.sin(start)) * towards * (a - start) % (2 * np.pi) for _, a in turns]
    assert along == sorted(along)


class OnACurveWithAPairAtTheCircle(OnACurve):
    radius = 0.97
    swing = 0.0


def test_a_pair_that_meets_outside_the_circle_crosses_nothing_beside_one_at_the_circle():
    """The pair of modulus 0.97 is near the circle all the time and never crosses it."""
    nothing: Any = None
    circle = OnACurveWithAPairAtTheCircle(nothing, nothing)
    own = circle.solve(np.array([np.sin(1.0), 0, 0, 0, 0, 0, 2.0, np.cos(1.0)]))[0]
    found, why = circle.branch(own, 1.0, (-2.0, 2.0), 0.2, 200)
    assert why == CLOSED_CURVE
    turns = sorted(one.turn for one in found if one.turn)
    assert turns == ["fold", "fold", "period doubling", "period doubling"]


@pytest.mark.parametrize("passages", [1, 3, 9, 10])
def test_a_motion_returns_after_all_the_passages_of_its_period(passages):
    """Two points leave the surface and return, so many times in a period, each time higher."""
    order = np.arange(4 * passages * 3)
    height = 1.0 + order // 4 % passages + 0.1 * (order % 4)
    empty: Any = np.zeros(1)
    segment = Segment(
        law=empty,
        c=empty,
        t0=empty,
        t1=empty,
        first_contact=np.ones((2, 1), dtype=int),
        end=np.zeros((6, 1)),
        changes=ContactChanges(
            motion=0 * order,
            point=np.array([1, 0, 0, 1])[order % 4],
            t=5.0 + order * 0.25,
            state=height * np.ones((6, 1)),
        ),
        step_count=empty,
        limit=empty,
    )
    first_return = _first_return(segment)
    if passages == 10:  # more than are compared
        assert first_return is None
    else:
        assert first_return is not None
        state, period = first_return
        assert state == pytest.approx(height[0])
        assert period == passages
