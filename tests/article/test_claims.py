"""Claims: measures against closed forms, and verdicts on both sides of each rule."""

import dataclasses
import math

import numpy as np
import pytest

from squeal.article.cases import HISTORY_FIGURES
from squeal.article.claims import CLAIMS, Case, judge_claims, measure
from squeal.article.claims.measures import Linear, Range
from squeal.article.claims.motions import LEVELS
from squeal.article.claims.rules import CALM, hammering_cases, more_loss_in_b1, sliding_lasts
from squeal.article.claims.settling import decaying, settled
from squeal.article.equations import Readings
from squeal.article.studies._scenes import read_cases
from squeal.errors import InputError
from squeal.io.scene import read_scene
from squeal.model.contact import FULL, LEAD, LEADING, NONE, TRAIL, TRAILING
from squeal.simulation.run import simulate
from tests.conftest import ROOT, needs_heyoka
from tests.simulation.closed import upright
from tests.simulation.test_simulation import bounce

QUIET = Case(
    duration=100.0,
    separated=(0.0, 0.0),
    losses=(),
    shares={FULL: 1.0},
    first=Range(0.5, 1.5),
    second=Range(0.4, 1.4),
    together=Range(0.9, 2.9),
    tilt=Range(0.001, 0.01),
    down=0.0,
    mean=1.0,
    blows=(0,) * len(LEVELS),
    heaviest=(0.0, 0.0),
    vanishes=(0.0, 0.0),
    calm=1.0,
)
LINEAR = Linear({"a": 2, "b": 2, "c": 2, "d": 2}, Readings(0.14, 0.3))


def verdict(claim, linear=LINEAR, **changed):
    """Verdict on a claim if all cases are quiet but some, given as b1_a and the like."""
    measured = dict.fromkeys(HISTORY_FIGURES, QUIET) | {"b3": linear}
    measured |= {name.replace("_", "-"): measures for name, measures in changed.items()}
    return next(j.verdict for j in judge_claims(measured) if j.id == claim)


def case(**changes):
    return dataclasses.replace(QUIET, **changes)


YES = "reproduced"
NO = "not reproduced"
ALL = {FULL: 0.7, NONE: 0.1, LEAD: 0.1, TRAIL: 0.1}
BEATS = {"blows": (4,) * 6, "vanishes": (0.1, 0.2)}
NO_2 = {FULL: 0.7, LEAD: 0.2, TRAIL: 0.1}
LOST = {"shares": {FULL: 0.9, NONE: 0.1}}


@pytest.mark.parametrize(
    ("claim", "model", "name", "holds", "fails"),
    [
        ("B1-a-lead-loss", 1, "a", {"separated": (1.0, 0.0)}, {"separated": (1e-9, 5.0)}),
        ("B1-a-trail-loss", 1, "a", {"separated": (0.0, 1.0)}, {"separated": (5.0, 1e-9)}),
        ("B1-a-trail-high", 1, "a", {"second": Range(0, 1.51)}, {"second": Range(0, 1.49)}),
        ("B1-a-states", 1, "a", {"shares": ALL}, {"shares": NO_2}),
        ("B1-b-lead-kept", 1, "b", {"first": Range(1e-6, 1)}, {"first": Range(0.0, 1)}),
        (
            "B1-b-states",
            1,
            "b",
            {"shares": {FULL: 0.5, LEAD: 0.5}},
            {"shares": {FULL: 0.5, LEAD: 0.49, TRAIL: 0.01}},
        ),
        ("B1-b-ratio", 1, "b", {"second": Range(0, 0.55)}, {"second": Range(0, 0.49)}),
        ("B1-b-ratio", 1, "b", {"second": Range(0, 0.51)}, {"second": Range(0, 0.61)}),
        ("B1-c-sum", 1, "c", {"together": Range(1e-6, 2)}, {"together": Range(0.0, 2)}),
        ("B1-c-states", 1, "c", {"shares": NO_2}, {"shares": ALL}),
        ("B1-d-mostly-full", 1, "d", {"shares": {FULL: 0.51}}, {"shares": {FULL: 0.49}}),
        (
            "B1-d-alternate",
            1,
            "d",
            {"losses": (LEADING, TRAILING) * 3},
            {"losses": (LEADING, LEADING, TRAILING)},
        ),
        ("B2-a-contact", 2, "a", {"first": Range(1e-6, 1)}, {"first": Range(0.0, 1)}),
        ("B2-a-leading", 2, "a", {"second": Range(-0.9, -1e-6)}, {"second": Range(-0.9, 1e-6)}),
        ("B2-b-trailing", 2, "b", {"second": Range(1e-6, 1)}, {"second": Range(-1e-6, 1)}),
        ("B2-b-tilt", 2, "b", {"tilt": Range(-0.1, -1e-6)}, {"tilt": Range(-0.1, 1e-6)}),
        ("B1-b-theta", 1, "b", {"tilt": Range(1e-6, 0.1)}, {"tilt": Range(-1e-6, 0.1)}),
        ("B2-b-theta-line", 2, "b", {"tilt": Range(1e-6, 0.1)}, {"tilt": Range(-1e-6, 0.1)}),
        ("B1-b-trail-only", 1, "b", {"separated": (0.0, 5.0)}, {"separated": (1.0, 5.0)}),
        ("B2-b-trail-only", 2, "b", {"separated": (0.0, 0.0)}, {"separated": (1.0, 0.0)}),
        ("B2-b-twice", 2, "b", {"mean": 1.71}, {"mean": 1.69}),
        ("B2-b-twice", 2, "b", {"mean": 1.99}, {"mean": 2.01}),
        ("B2-c-loss", 2, "c", LOST, {}),
        (
            "B2-c-hammer",
            2,
            "c",
            {"blows": (4,) * 6, "vanishes": (0.1, 0.1)},
            {"blows": (9, 9, 3, 3, 3, 3), "vanishes": (0.1, 0.1)},
        ),
        ("B2-d-trailing", 2, "d", {"second": Range(0.1, 0.99)}, {"second": Range(0.1, 1.01)}),
        ("B2-only-c", 2, "c", LOST, {}),
    ],
)
def test_each_rule_has_two_sides(claim, model, name, holds, fails):
    scene = f"b{model}_{name}"
    assert verdict(claim, **{scene: case(**holds)}) == YES
    assert verdict(claim, **{scene: case(**fails)}) != YES


def test_separation_elsewhere_contradicts_only_c():
    assert verdict("B2-only-c", b2_c=case(**LOST), b2_a=case(**LOST)) == NO


def test_claims_on_the_linear_model_fall_with_rank_three_a_large_region_or_a_motion_at_rest():
    assert verdict("B3-singular") == YES
    assert verdict("B3-singular", linear=Linear({"a": 3}, Readings(0.1, 0.2))) == NO
    assert verdict("B3-small-region") == YES
    assert verdict("B3-small-region", linear=Linear({"a": 2}, Readings(0.3, 0.2))) == NO
    assert verdict("B3-none") == YES
    assert verdict("B3-none", b1_a=case(calm=0.001)) == NO


def test_of_two_conflicting_claims_one_contradicts_the_other():
    down = case(tilt=Range(-0.01, -0.001))
    assert verdict("B2-b-tilt", b2_b=down) == YES
    assert verdict("B2-b-theta", b2_b=down) == "contradicted"
    assert verdict("B2-b-theta-line", b2_b=down) == "contradicted"
    assert verdict("B2-b-theta") == YES
    assert verdict("B2-b-tilt") == "contradicted"


def test_each_model_is_judged_alone_on_the_tilt_of_case_b():
    """What fails with the points stays in sight where the line contradicts the statement."""
    down = case(tilt=Range(-0.01, 0.001))
    for b1, b2, both in ((QUIET, QUIET, YES), (down, QUIET, NO), (QUIET, down, NO)):
        changed = {"b1_b": b1, "b2_b": b2}
        assert verdict("B1-b-theta", **changed) == (NO if b1 is down else YES)
        assert verdict("B2-b-theta-line", **changed) == (NO if b2 is down else YES)
        assert verdict("B2-b-theta", **changed) == both
    reference = ROOT / "workflow" / "scenes"
    measured = {name: measure(read_scene(reference / f"{name}.yaml")) for name in ("b1-b", "b2-b")}
    given = {name.replace("-", "_"): one for name, one in measured.items()}
    assert verdict("B1-b-theta", **given) == NO
    assert verdict("B2-b-theta-line", **given) == "contradicted"


def test_a_scene_of_another_model_under_the_name_of_a_case_is_refused(tmp_path):
    files = [tmp_path / f"{name}.yaml" for name in HISTORY_FIGURES]
    for file in files:
        source = "b1-a.yaml" if file.stem == "b2-d" else file.name
        file.write_text((ROOT / "workflow" / "scenes" / source).read_text())
    assert set(read_cases(files, "B1")) == set("abcd")
    with pytest.raises(InputError, match=r"b2-d\.yaml: model: 'B1' is not allowed; it must be B2"):
        read_cases(files, "B2")


def test_time_of_negative_tilt_is_that_of_a_fine_history():
    for stem in ("b1-b", "b2-c"):
        scene = read_scene(ROOT / "workflow" / "scenes" / f"{stem}.yaml")
        fine = dataclasses.replace(scene, outputs=("history",), samples=100001)
        history = simulate(fine).history
        touched = np.argmax(history["state"] != scene.pad_model.law.state_name(NONE))
        tilt = scene.pad.theta0 + history["theta"][touched:]
        assert measure(scene).down == pytest.approx(np.mean(tilt < 0.0), abs=2e-4)


def test_catalogue_is_complete_and_conflicts_are_mutual():
    ids = [claim.id for claim in CLAIMS]
    assert len(set(ids)) == 37
    assert sum(claim.informative for claim in CLAIMS) == 17
    for claim in CLAIMS:
        for conflict in claim.conflicts:
            assert claim.id in CLAIMS[ids.index(conflict)].conflicts


def some_case(random):
    """A case whose measures agree with each other, some of the states left out."""
    drawn = random.dirichlet(np.ones(4))
    drawn[random.uniform(size=4) >= 0.6] = 0.0
    if drawn.sum() == 0.0:
        drawn[0] = 1.0
    shares = dict(zip((FULL, NONE, LEAD, TRAIL), (drawn / drawn.sum()).tolist(), strict=True))
    lead = shares[NONE] + shares[TRAIL]
    trail = shares[NONE] + shares[LEAD]

    def force(share_off, greatest):
        """The range of a force that vanishes for some share of the time."""
        return Range(0.5 if share_off == 0.0 else 0.0, greatest)

    return case(
        shares=shares,
        separated=(100.0 * lead, 100.0 * trail),
        first=force(lead, 1.0),
        second=force(trail, 1.0),
        together=force(shares[NONE], 2.0),
        losses=(LEADING, TRAILING) * int(random.integers(4)),
        blows=(int(random.integers(9)),) * len(LEVELS),
        vanishes=(lead, trail),
    )


def leaning(each, random):
    """A case of the line contact, whose reaction acts on the side to which the pad tilts.

    Only the other edge then separates alone.
    """
    low, high = np.sort(random.uniform(-1.0, 1.0, 2)) + random.choice([-1.0, 0.0, 1.0])
    # vanishes only where the surfaces separate
    first = Range(0.5 if each.shares[NONE] == 0.0 else 0.0, 1.0)
    shares = dict(each.shares)
    for upper, lower, always in ((TRAIL, LEAD, high < 0.0), (LEAD, TRAIL, low > 0.0)):
        if always:
            shares[lower] += shares[upper]
            shares[upper] = 0.0
    return dataclasses.replace(
        each,
        shares=shares,
        separated=(100.0 * (shares[NONE] + shares[TRAIL]), 100.0 * (shares[NONE] + shares[LEAD])),
        first=first,
        second=Range(low, high),
        tilt=Range(-0.01 * high, -0.01 * low),
        vanishes=(each.shares[NONE],) * 2,
    )


def test_implied_claims_hold_where_those_that_imply_them_do():
    random = np.random.default_rng(1)
    used = set()
    for _ in range(1500):
        b1 = {f"b1-{name}": some_case(random) for name in "abcd"}
        b2 = {f"b2-{name}": some_case(random) for name in "abcd"}
        b2 = {name: leaning(each, random) for name, each in b2.items()}
        judged = {j.id: j.holds for j in judge_claims({**b1, **b2, "b3": LINEAR})}
        for claim in CLAIMS:
            if claim.follows and claim.follows.by and all(judged[i] for i in claim.follows.by):
                assert judged[claim.id], claim.id
                used.add(claim.id)
    implied = {c.id for c in CLAIMS if c.follows and c.follows.kind == "implied"}
    assert used >= implied - {"B1-all-separate"}


def test_c_is_severe_only_where_it_alone_hammers_with_both_models():
    beats = case(**BEATS)
    once = case(**BEATS | {"blows": (9, 9, 3, 0, 0, 0)})
    assert verdict("B12-c-severe", b1_c=beats, b2_c=beats) == YES
    assert verdict("B12-c-severe", b1_c=beats) == NO
    assert verdict("B12-c-severe", b2_c=beats) == NO
    assert verdict("B12-c-severe", b1_c=once, b2_c=beats) == NO
    pressed = case(**BEATS | {"vanishes": (0.0, 0.2)})  # blows alone are no hammering
    assert verdict("B12-c-severe", b1_c=pressed, b2_c=beats) == NO
    assert verdict("B12-c-severe", b1_a=beats, b1_c=beats, b2_a=beats, b2_c=beats) == NO
    measured = dict.fromkeys(HISTORY_FIGURES, QUIET) | {"b1-d": once, "b2-c": beats}
    assert hammering_cases(measured) == {"B1": (), "B2": ("c",)}
    assert hammering_cases(measured, 0.01) == {"B1": ("d",), "B2": ("c",)}


def test_losses_with_one_model_are_compared_with_those_of_the_other():
    quiet = [QUIET] * 4
    apart = case(vanishes=(0.2, 0.0))
    assert more_loss_in_b1(apart, *quiet[1:], *quiet).margin == 0.25
    assert verdict("B12-more-loss", b1_a=apart) == YES
    assert verdict("B12-more-loss", b1_a=apart, b2_d=case(vanishes=(0.3, 0.3))) == NO


@pytest.mark.parametrize("name", ["b1-c", "b1-d", "b2-c"])
@needs_heyoka
def test_blows_are_those_of_a_dense_history(name):
    """Impulses between changes of side, summed over equal samples of the motion."""
    scene = read_scene(ROOT / f"workflow/scenes/{name}.yaml")
    measures = measure(scene)
    dense = dataclasses.replace(scene, samples=200_001, outputs=("history",))
    history = simulate(dense).history
    if scene.model == "B1":
        lead = np.array(history["F3"], dtype=float)
        trail = np.array(history["F4"], dtype=float)
    else:
        force = np.nan_to_num(np.array(history["Rn"], dtype=float))
        place = np.nan_to_num(np.array(history["delta"], dtype=float))
        lead = force * (1.0 - place) / 2.0
        trail = force * (1.0 + place) / 2.0
    side = np.sign(trail - lead)
    side = side[np.maximum.accumulate(np.where(side != 0.0, np.arange(side.size), 0))]
    begin = np.append(0, np.flatnonzero(np.diff(side)) + 1)
    period = 2.0 * math.pi * math.sqrt(scene.pad.m / scene.pad.k1)
    blow = np.add.reduceat(lead + trail, begin) * scene.stop / 200_000 / period
    side = side[begin]
    heaviest = [blow[side < 0.0].max(), blow[side > 0.0].max()]
    assert measures.heaviest == pytest.approx(heaviest, rel=0.02)
    for level, turns in zip(LEVELS, measures.blows, strict=True):
        if np.abs(blow / level - 1.0).min() > 0.02:  # none too near to the level
            assert turns == np.count_nonzero(np.diff(side[(blow > level) & (side != 0.0)]))


def test_sliding_is_judged_against_the_surface():
    slow = {name.replace("-", "_"): case(slip=0.9) for name in HISTORY_FIGURES}
    assert verdict("B12-sliding", **slow) == YES
    assert verdict("B12-sliding", **slow | {"b1_d": case(slip=1.1)}) == NO
    rubs = {name: dataclasses.replace(one, face=1.2) for name, one in slow.items()}
    assert verdict("B12-sliding", **rubs) == YES  # by the article's condition
    text = sliding_lasts(case(slip=0.25, face=0.41)).measured
    assert text.endswith("25 % of the surface's speed, its lower face 41 % while it touches")
    assert sliding_lasts(case(slip=0.25)).measured.endswith("25 % of the surface's speed")
    assert verdict("B12-sliding") == NO  # without a speed nothing is known


def test_friction_raises_the_reaction_by_the_closed_form():
    # one upright and one level spring: x feels friction only, so that k1 holds the load it tilts
    assert verdict("B2-b-raised", b2_b=case(raised=0.1)) == YES
    assert verdict("B2-b-raised", b2_b=case(raised=-0.1)) == NO
    assert verdict("B2-b-raised") == NO


def test_measures_of_a_harmonic_motion_are_those_of_the_closed_form():
    pad = upright()
    y0 = -4e-4
    K = pad.k1 + pad.k2 + pad.k3 + pad.k4
    scene = bounce(pad, y0, 10 * 2 * math.pi / math.sqrt(K / pad.m))
    measures = measure(scene)
    low, high = sorted(-pad.k3 * np.array([y0, -2 * pad.F_n / K - y0]) / pad.F_n)
    assert measures.first.low == pytest.approx(low, rel=1e-3)
    assert measures.first.high == pytest.approx(high, rel=1e-12)
    assert measures.mean == pytest.approx((low + high) / 2, rel=1e-4)
    assert measures.shares == {FULL: 1.0}
    assert measures.calm == pytest.approx(1.0, rel=1e-3)


def test_measures_of_a_bouncing_pad_are_those_of_the_closed_form():
    measures = measure(bounce(upright(), 1e-3, 0.2))
    # time counts from the first contact; both edges leave together, one counted after the other
    assert measures.separated[LEADING] == pytest.approx(measures.separated[TRAILING], rel=1e-9)
    assert measures.shares[NONE] == pytest.approx(
        measures.separated[LEADING] / measures.duration, rel=1e-9
    )
    assert measures.first.low == 0.0


def test_claims_say_which_cases_they_are_about():
    said = {claim.id: claim.case for claim in CLAIMS}
    assert (said["B2-b-twice"], said["B2-b-theta"], said["B1-a-states"]) == ("a, b", "b", "a")
    assert {said[name] for name in ("B1-all-separate", "B3-singular", "B3-none")} == {"all"}


@needs_heyoka
def test_a_motion_on_a_decaying_mode_settles_without_damping():
    """Its accelerations fall as the mode does, from the whole motion to its last tenth."""
    scenes = {n: read_scene(ROOT / f"workflow/scenes/{n}.yaml") for n in ("b2-b", "b2-c")}
    assert decaying(scenes["b2-b"]) is None  # all its roots are imaginary
    assert settled({"b2-b": scenes["b2-b"]}) is None
    measures = settled(scenes)
    assert measures is not None
    assert measures.scene == "b2-c"
    fall = math.exp(0.9 * measures.real * measures.windows * scenes["b2-c"].stop)
    assert 0.5 * fall < measures.calm < 2.0 * fall
    assert measures.calm < CALM
