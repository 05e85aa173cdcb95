"""Stored boundaries and least disturbances against the equations written out by hand."""

import numpy as np
import pytest

from squeal.article.figures import coexistence as figure
from squeal.article.records import read_json
from squeal.article.studies import coexistence
from squeal.article.studies._coexistence import (
    FAMILIES,
    MOTIONS,
    Stored,
    find_cycle,
    least_at,
    scene_of,
)
from squeal.article.studies._damped_contact import DampedContact, ensemble, flow
from squeal.errors import ComputationError
from squeal.io.scene import read_scene
from tests.article.damped_by_hand import Pad
from tests.conftest import ROOT, needs_heyoka

pytestmark = needs_heyoka
ASIDE = 0.06  # relative distance in modal damping from a fold, at which motions are compared
STEPS = 40  # of Runge and Kutta's method a period
PERIODS = 90  # after which a motion above a fold has come to rest
AFTER_DISTURBANCE = 0.015  # s, after which a motion has come to rest or lasts
FACTORS = np.array([0.8, 0.9, 0.97, 1.0005, 1.001, 1.002, 1.003, 1.005])  # of the least one


def scene(motion):
    return scene_of(motion, read_scene(ROOT / f"workflow/scenes/{MOTIONS[motion]}.yaml"))


def stored(motion):
    return read_json(Stored, ROOT / f"workflow/stored/coexistence/{motion}.json")


def by_hand(motion, a, zeta, mu=None):
    return Pad(MOTIONS[motion], a, zeta, mu, mean=motion.endswith("mean"))


def si(pad):
    """Factors (6,) from the state of a pad to SI units."""
    place = pad.length * np.array([1.0, 1.0, 1.0 / pad.scene.pad.w])
    return np.append(place, place / pad.time)


@pytest.mark.parametrize("motion", MOTIONS)
def test_rates_are_those_of_the_equations_by_hand(motion):
    pad = DampedContact(scene(motion), 0.2, 0.01, 0.4)
    states = np.random.default_rng(2).uniform(-2.0, 2.0, (6, 400))
    states[1] += -1.0 if motion == "b1-d" else 1.0
    scale = si(pad)[:, None]
    exact = by_hand(motion, 0.2, 0.01, 0.4).rates(states * scale) / scale * pad.time
    found = pad.at(states)
    holds = np.min(found.factors, axis=0) > 0.0
    patterns = {tuple(row) for row in (np.array(found.gaps) < 0.0).T.tolist()}
    assert len(patterns) == 4
    assert np.count_nonzero(holds) > 300
    assert pad.rates(states)[:, holds] == pytest.approx(exact[:, holds], abs=1e-8)


@pytest.mark.parametrize("motion", MOTIONS)
def test_variational_equations_have_the_slopes_of_differences(motion):
    pad = DampedContact.of(scene(motion), 0.05, 0.005)
    state = pad.sliding + np.array([0.5, 2.0, -1.5, 0.3, -0.4, 0.6])
    run = flow(pad.law).run
    arc = run(pad, state, 9.0)
    assert len(arc.passages) >= 1
    for i in range(6):
        step = np.zeros(6)
        step[i] = 1e-6
        slope = (run(pad, state + step, 9.0).end - run(pad, state - step, 9.0).end) / 2e-6
        assert arc.matrix[:, i] == pytest.approx(slope, abs=1e-6)
    for i, name in ((7, "zeta"), (8, "mu")):
        high = pad.replace(**{name: getattr(pad, name) + 1e-6})
        low = pad.replace(**{name: getattr(pad, name) - 1e-6})
        slope = (run(high, state, 9.0).end - run(low, state, 9.0).end) / 2e-6
        assert arc.matrix[:, i] == pytest.approx(slope, abs=1e-5)


@pytest.mark.parametrize("motion", MOTIONS)
def test_sliding_is_stable_above_its_boundary_alone(motion):
    for a in (0.004, 0.1, 0.25):
        zeta = coexistence.critical_zeta(scene(motion), a, 0.320313)
        assert by_hand(motion, a, 0.98 * zeta).growth() > 0.0
        assert by_hand(motion, a, 1.02 * zeta).growth() < 0.0


@pytest.mark.parametrize("motion", MOTIONS)
def test_stored_cycle_closes_by_hand(motion):
    curve = stored(motion).boundaries[0]
    point = curve.points[np.random.default_rng(1).integers(len(curve.points))]
    pad = DampedContact(scene(motion), point.a, point.zeta, point.mu)
    start = np.array(point.state) * si(pad)
    own = by_hand(motion, point.a, point.zeta, point.mu)
    end = own.flow(start, point.period * pad.time)
    assert end / si(pad) == pytest.approx(np.array(point.state), abs=1e-7)


def outermost(curve, point):
    """Whether a point is on a fold beyond which no motion of the case loses contact for ever.

    Points have two cycles: at small contact damping that of both edges exists to higher modal
    damping, at large that of the trailing edge. At small damping motions take long to come to rest.
    """
    if curve.kind != "fold" or point.zeta < 0.007 or point.a > 0.1:
        return False
    return {"LltT": point.a < 0.02, "Tt": point.a > 0.06}.get(curve.contacts, True)


@pytest.fixture(scope="module", params=["b1-d", "b2-d-integral"])
def lasting(request):
    """Which motions by hand lose contact for ever: from three stored folds at lower modal damping,
    from these at higher, and from `FACTORS` of a least disturbance.

    All march side by side, those from folds for `PERIODS`, the others until `AFTER_DISTURBANCE`:
    a step takes as long for one as for all.
    """
    motion = request.param
    points = []
    for curve in stored(motion).boundaries:
        points += [point for point in curve.points if outermost(curve, point)]
    chosen = [points[i] for i in np.random.default_rng(2).choice(len(points), 3, replace=False)]
    one = next(o for o in stored(motion).least if (o.a, o.zeta) == (0.01, 0.005))
    folds = 2 * len(chosen)
    a = np.array([p.a for p in chosen])
    zeta = np.array([p.zeta for p in chosen])
    mu = np.array([p.mu for p in chosen])
    pad = DampedContact.of(scene(motion), one.a, one.zeta)
    rest = np.append(by_hand(motion, one.a, one.zeta).rest(), np.zeros(3))
    disturbed = rest[:, None] + (np.array(one.disturbance) * si(pad))[:, None] * FACTORS
    from_folds = np.array([p.state for p in chosen]).T * si(pad)[:, None]
    zetas = np.concatenate([(1.0 - ASIDE) * zeta, (1.0 + ASIDE) * zeta])
    same = np.ones(FACTORS.size)
    together = by_hand(
        motion,
        np.concatenate([np.tile(a, 2), one.a * same]),
        np.concatenate([zetas, one.zeta * same]),
        np.concatenate([np.tile(mu, 2), pad.mu * same]),
    )
    begun = np.concatenate([np.tile(from_folds, 2), disturbed], axis=1)
    period = max(p.period for p in chosen) * pad.time
    step = period / STEPS
    states, after_disturbance = together.march(begun, AFTER_DISTURBANCE, step=step)
    beside_folds = by_hand(motion, np.tile(a, 2), zetas, np.tile(mu, 2))
    rest_of_time = PERIODS * period - AFTER_DISTURBANCE
    _, later = beside_folds.march(states[:, :folds], rest_of_time, step=step)
    below, above = np.split(later, 2)
    return below, above, after_disturbance[folds:]


def test_cycles_exist_on_one_side_of_their_folds(lasting):
    below, above, _ = lasting
    assert below.all()
    assert not above.any()


def test_least_disturbance_is_computed_again():
    motion = "b1-d"  # the rates of each motion are compared above
    rows = [one for one in stored(motion).least if one.disturbance and one.norm == "displacement"]
    one = rows[np.random.default_rng(3).integers(len(rows))]
    again = least_at(scene(motion), one.a, one.zeta, one.norm)
    assert again.norms == pytest.approx(one.norms, rel=1e-2)


def test_least_disturbance_leads_to_loss_of_contact_by_hand(lasting):
    """The basin has layers: slightly longer disturbances may lead back to sliding, but not all."""
    _, _, after_disturbance = lasting
    assert not after_disturbance[FACTORS < 1.0].any()
    assert np.count_nonzero(after_disturbance[FACTORS > 1.0]) >= 2


def test_a_cycle_hardly_damped_in_the_contact_has_a_known_period_and_multiplier():
    """The values are those of modal damping alone by a shooting program without squeal."""
    cycle = find_cycle(scene("b1-d"), FAMILIES["b1-d"][0]._replace(a=1e-8))
    assert 1e3 * cycle.period == pytest.approx(0.216865, abs=1e-6)
    assert abs(cycle.multipliers[0]) == pytest.approx(0.966929, abs=2e-6)


def test_multipliers_of_a_fold_are_those_by_hand():
    curve = stored("b1-d").boundaries[0]
    point = curve.points[len(curve.points) // 2]
    pad = DampedContact(scene("b1-d"), point.a, point.zeta, point.mu)
    start = np.array(point.state) * si(pad)
    own = by_hand("b1-d", point.a, point.zeta, point.mu)
    values = own.multipliers(start, point.period * pad.time)
    near_one = np.sort_complex(values[np.argsort(np.abs(values - 1.0))[:2]])
    assert near_one.sum() == pytest.approx(2.0, abs=1e-3)
    found = coexistence.cycle_of(scene("b1-d"), point).multipliers[1]
    assert np.abs(values - found).min() < 1e-5


@pytest.mark.parametrize(
    ("closes", "words"),
    [(None, "at every contact damping shown"), (0.14, "up to a contact damping of 0.14 s/m")],
)
def test_the_figure_says_up_to_which_contact_damping_both_are_stable(closes, words):
    points = tuple(coexistence.Point(a, 0.4, 0.001) for a in (1e-3, 0.3))
    quoted = coexistence.Margin(0.01, 0.005, 1.0, 0.0, 5.0, 0.9)
    one = coexistence.Motion(2.0, points, points, (), closes, 0.01, quoted, 1.0, 2.0, (quoted,), ())
    motions = dict.fromkeys(("b1-d", "b2-d-integral", "b2-d-mean"), one)
    record = coexistence.Coexistence(motions=motions, checked=None, searches_differ=0.0)
    assert figure.draw(record).alternative.count(words) == 3


@pytest.mark.parametrize(
    ("zetas", "closes"),
    [((0.5, 0.5, 2.0), np.sqrt(10.0)), ((2.0, 4.0, 8.0), None), ((2.0, 0.5, 2.0), np.sqrt(10.0))],
)
def test_boundaries_close_where_the_upper_one_falls_below_the_other(zetas, closes, monkeypatch):
    """It is 1 at all contact dampings. Below the other one from the start on it closes nowhere."""
    monkeypatch.setattr(coexistence, "height_at", lambda curves, over, value: 1.0)
    dampings = (0.1, 1.0, 10.0)
    sliding = [coexistence.Point(a, 0.5, zeta) for a, zeta in zip(dampings, zetas, strict=True)]
    found = coexistence.closing(sliding, [])
    assert found is None if closes is None else found == pytest.approx(closes)


def test_a_motion_that_is_not_finite_is_refused_beside_others_that_are():
    pad = DampedContact.of(scene("b1-d"), 0.2, 0.01)
    states = np.tile(pad.sliding, (3, 1))
    lasts = ensemble(pad.law).fate(pad, states, 120.0).lasts
    assert not lasts.any()
    states[1, 4] = 1e300
    with pytest.raises(ComputationError, match="a motion is not finite"):
        ensemble(pad.law).fate(pad, states, 120.0)
