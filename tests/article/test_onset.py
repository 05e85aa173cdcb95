"""Onset and attractors: what settles, and the sentences that follow it."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from squeal.article.claims.measures import measure
from squeal.article.figures import onset as figure
from squeal.article.report.lasting import hammer_table, lasting_table
from squeal.article.report.onset import exponents_table, generated
from squeal.article.results import onset as results
from squeal.article.results.spectra import Heard, Spectra
from squeal.article.studies import _attractors as attractors
from squeal.article.studies import _late, _sweeps, spectra
from squeal.article.studies import onset as study
from squeal.article.studies._damped import RATIO, Motion, damped, settled
from squeal.equilibrium.damping import damped_model
from squeal.errors import ComputationError
from squeal.files.records import Missing
from squeal.numerics.oscillation import line
from squeal.scene import read_scene
from squeal.simulation.batch.neighbours import growth
from tests.conftest import HAMMERING as SCENES
from tests.conftest import needs_heyoka


def scene_of(name: str):
    return read_scene(SCENES / f"{name}.yaml", "simulate")


@needs_heyoka
def test_a_cycle_s_multiplier_is_the_decay_of_a_disturbance():
    scene = scene_of("b1-d")
    rows, states, *_ = _late.late({"b1-d": scene})["b1-d"]
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
    scene = scene_of("b2-b")
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
        scene = scene_of(name)
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
    scene = scene_of("b1-d")
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
        raise ComputationError("without friction no equilibrium in contact was found")

    monkeypatch.setattr(study, "branch_system", none)
    assert study.threshold(scene_of("b1-d")) is None


def test_a_threshold_is_where_an_eigenvalue_crosses():
    scene = scene_of("b1-d")
    at = study.threshold(scene)
    assert at is not None
    for mu, sign in ((at - 1e-4, -1.0), (at + 1e-4, 1.0)):
        near = dataclasses.replace(scene, pad=scene.pad.replace(mu=mu))
        grows = _late.grown(near, RATIO)
        assert grows is not None
        assert sign * grows > 0.0
    assert study.threshold(scene_of("b1-c")) is None


def settled_one(lost: float, face: float = 0.5, hammers: bool = False, edges: bool = False) -> Any:
    return results.Settled(lost, 2.0, hammers, edges, 5 if hammers else 0, -0.5, 0.5, face)


def step(
    mu: float, lost: float = 0.4, face: float = 0.5, hammers: bool = False, edges: bool = False
) -> results.Step:
    return results.Step.of(settled_one(lost, face, hammers, edges), mu=mu)


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
    model = scene_of("b1-d").pad_model
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
def test_a_lively_motion_is_followed_both_ways_and_the_resting_pad_stays_at_rest(monkeypatch):
    """B1 (d), which has its own cycle beside rest, above and below the flutter threshold."""
    scene = scene_of("b1-d")
    state = _late.late({"b1-d": scene})["b1-d"].states[_late.RATIOS.index(RATIO)]
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
    scene = scene_of("b2-c")
    monkeypatch.setattr(_late, "RATIOS", (1e-9, 0.3))
    monkeypatch.setattr(_late, "SIDE", 2)
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
    model = scene_of("b1-d").pad_model
    own = {
        _late._Lane("b1-d", ratio, 0): Motion(model, np.full(6, 10.0 * i))
        for i, ratio in enumerate((0.1, 0.2))
    }
    found = _late._early(own, 2.0)
    assert calls == [([0.0, 10.0], 2.0), ([1.0, 11.0], 4.0), ([2.0], 14.0)]
    assert [one and one.lost for one in found["b1-d", 0.1]] == [0.1, 0.4, 0.1]
    assert [one and one.lost for one in found["b1-d", 0.2]] == [0.1, None, None]


def test_starts_without_an_equilibrium_are_the_own_one(monkeypatch):
    scene = scene_of("b2-c")
    assert len(_late.starts(scene)) == 1 + _late.SIDE**2
    monkeypatch.setattr(_late, "sliding_equilibrium", lambda model: (None, "none"))
    assert _late.starts(scene) == pytest.approx(np.array([scene.initial]))


def late_one(lost=0.4, hammers=False, growth=0.1, peak=2.0, low=-1.0) -> results.Late:
    one = results.Settled(lost, peak, hammers, hammers, 8 if hammers else 0, low, 0.5, 0.5)
    return results.Late.of(one, ratio=0.005, growth=growth)


def others(
    lasting: int = 0,
    hammer: int = 0,
    edges: int = 0,
    growth: float = -0.1,
    early: tuple[bool, ...] = (False, False),
) -> results.Others:
    lively = settled_one(0.4, hammers=hammer > 0, edges=edges > 0) if lasting else None
    first = tuple(settled_one(0.4, hammers=one, edges=one) for one in early)
    return results.Others(0.005, first, 25, 0, lasting, hammer, edges, lively, growth)


QUIET = others()


def test_beside_rest_is_a_sliding_motion_at_a_stable_equilibrium():
    one = others(3)
    assert one.beside
    assert not others(3, growth=0.1).beside
    assert not QUIET.beside
    assert not dataclasses.replace(one, growth=None).beside
    assert not dataclasses.replace(one, liveliest=settled_one(0.4, face=2.0)).beside


def made(
    lasts: bool = True,
    law: bool = True,
    hammers: bool = False,
    growth: float = 0.1,
    threshold: float | None = 0.7,
    up: tuple[results.Step, ...] = (step(0.6, lost=0.0), step(0.7)),
    down: tuple[results.Step, ...] = (step(0.7), step(0.6, lost=0.0)),
    beyond: tuple[results.Step, ...] = (),
    lively: tuple[results.Step, ...] = (),
    least: float = 0.56,
    decay: float = 0.9,
    peak: float = 2.0,
    rate: float = 1.0,
    half: float = 0.1,
    b1: results.Others = QUIET,
    printed: results.Others = QUIET,
    integral: results.Others = QUIET,
) -> results.Onset:
    """A result with one motion under both laws, and one of model B1."""
    off = 0.4 if peak else 1.0
    late: dict[str, Any] = {
        "b1-c": (late_one(0.4 if hammers else 0.0, hammers, low=None),),
        "b2-c-mean": (late_one(off if lasts else 0.0, hammers, growth, peak),),
        "b2-c-integral": (late_one(0.0 if law else 0.4),),
    }
    points = tuple(
        results.CyclePoint(mu, 0.2, changes, 1.0, size)
        for mu, changes, size in ((0.8, 2, 0.9), (least, 2, 1.2), (0.7, 0, 1.0))
    )
    return results.Onset(
        late=late,
        others={"b1-c": (b1,), "b2-c-mean": (printed,), "b2-c-integral": (integral,)},
        mu=(0.6, 0.65, 0.7),
        sweeps={"b2-c-mean": (results.Sweep(0.005, up, down, beyond, lively),)},
        thresholds={"b1-c": None, "b2-c-mean": threshold},
        exponents={"b2-c-mean": results.Exponent(0.005, (rate,) * 3, (half,) * 3, 0.02, 40, False)},
        cycles=results.Cycles("b2-c-mean", 0.005, points[0], decay, 1e-6, points),
        ratio=0.005,
        ratios=(0.005,),
        windows=40,
        longer=150,
        early=(1, 3),
        wider=3.0,
        seen=2,
        step_windows=20,
        confidence=0.95,
    )


FAST = {
    "up": (step(0.6), step(0.65, face=3.0), step(0.7, face=7.0)),
    "down": (step(0.6),),
    "beyond": (step(0.7, face=7.0), step(0.65, face=3.0), step(0.6)),
}


LIVELY = {
    "lively": (step(0.6, edges=True), step(0.65, hammers=True, edges=True), step(0.7)),
}


@pytest.mark.parametrize(
    ("given", "key", "words"),
    [
        ({}, "lasts", "B2 (c), printed law at"),
        ({"law": False}, "lasts", "changing in B2 (c) under both laws at"),
        ({"lasts": False, "law": True}, "lasts", "no contact changes"),
        ({"peak": 0.0, "law": True}, "lasts", "no contact changes"),
        ({}, "hammer", "no case goes on hammering, by either rule"),
        (
            {"hammers": True},
            "hammer",
            r"hammering: (c) with both models at 0.5\,\%, by either rule of B2",
        ),
        (
            {"b1": others(3, 3, 3), "printed": others(3, 2, 1)},
            "hammer",
            r"(c), from some of 25 other starts, with both models at 0.5\,\%, by either rule of B2",
        ),
        (
            {"printed": others(3, 0, 3)},
            "hammer",
            r"(c), from some of 25 other starts, with B2 alone, by the edges at 0.5\,\%",
        ),
        (
            {"b1": others(3, 3, 3), "printed": others(3, 2, 0)},
            "hammer",
            r"with both models, by $\delta$ at 0.5\,\%, with B1 alone, by the edges at 0.5\,\%",
        ),
        ({"printed": others(3, 0, 3)}, "hammer", "integral law from none of 25 other starts"),
        ({}, "early", "in windows 0 to 1 and 1 to 3 no case hammers with both models"),
        (
            {"b1": others(early=(True, True)), "printed": others(early=(True, True))},
            "early",
            r"in windows 0 to 1 and 1 to 3 (c) hammers with both models at $\zeta =$ 0.5\,\%",
        ),
        # each span by itself
        (
            {"b1": others(early=(True, False)), "printed": others(early=(True, True))},
            "early",
            r"0 to 1 (c) hammers with both models at $\zeta =$ 0.5\,\%, in windows 1 to 3 no case",
        ),
        (
            {"b1": others(early=(True, False)), "printed": others(early=(False, True))},
            "early",
            "in windows 0 to 1 and 1 to 3 no case hammers with both models",
        ),
        (
            {"hammers": True},
            "turns",
            r"by the one rule of B1 in B1 (c) at $\zeta =$ 0.5\,\%; by both rules of B2 in B2 (c)",
        ),
        ({"printed": others(3, 0, 3), "lasts": False}, "turns", "by the edges alone in B2 (c)"),
        ({"printed": others(3, 3, 0), "lasts": False}, "turns", r"by $\delta$ alone in B2 (c)"),
        ({}, "turns", r"on and on without hammering in B2 (c), printed law"),
        ({"b1": others(3)}, "lasts", r"; from other starts in B1 (c) at"),
        (
            {"printed": others(3)},
            "law",
            r"printed law in B2 (c) at $\zeta =$ 0.5\,\% (3 against 0).",
        ),
        ({"printed": others(3)}, "law", "is the cause is not shown"),
        (
            {"integral": others(3)},
            "law",
            r"integral law in B2 (c) at $\zeta =$ 0.5\,\% (3 against 0).",
        ),
        ({}, "law", "As many starts go on"),
        ({"b1": others(3)}, "beside", r"of B1 (c) at $\zeta =$ 0.5\,\% is stable"),
        ({"b1": others(3, growth=0.1)}, "beside", "No motion goes on beside a stable"),
        ({"growth": -0.1}, "beside", "is stable: contact goes on changing beside it"),
        ({}, "beside", "No motion goes on beside a stable"),
        ({"down": (step(0.7), step(0.6))}, "hysteresis", "with hysteresis"),
        ({}, "hysteresis", "without hysteresis"),
        (
            LIVELY,
            "hysteresis",
            r"last to 0.7. The liveliest motion of other starts goes on losing contact for "
            r"$\mu =$ 0.6 to 0.7 and hammers for $\mu =$ 0.65 by $\delta$ and $\mu =$ 0.6 to 0.65 "
            r"by the edges; from rest contact comes to be kept for $\mu =$ 0.6: hysteresis.",
        ),
        (
            {"lively": (step(0.7),)},
            "hysteresis",
            "without hysteresis in steps of that width. The liveliest motion of other starts goes "
            r"on losing contact for $\mu =$ 0.7 and hammers nowhere.",
        ),
        (
            LIVELY,
            "both",
            r"; from other starts, tried at the scene's $\mu$, B2 (c), printed law goes on losing",
        ),
        ({"up": (step(0.6, lost=0.0),), "down": ()}, "hysteresis", "no changes of contact last"),
        (FAST, "hysteresis", r"begin at $\mu = 0.6$; lowered from $\mu = 0.6$"),
        (FAST, "beyond", r"for $\mu =$ 0.65 to 0.7, up to 7 times as fast"),
        (FAST, "beyond", r"0.65 ($\zeta = 0.5\,\%$), some of it below the flutter threshold"),
        (FAST | {"threshold": 0.6}, "beyond", r"0.65 ($\zeta = 0.5\,\%$)."),
        (
            FAST | {"up": (*FAST["up"], step(0.72, lost=0.0))},
            "beyond",
            r" (contact comes to be kept for $\mu =$ 0.72)",
        ),
        ({}, "both", "begin with it, to a step, and hammering does not begin while"),
        ({"up": (step(0.7, hammers=True),)}, "both", "hammering begins with them"),
        (
            {"up": (step(0.65), step(0.7, hammers=True))},
            "both",
            r"hammering begins at $\mu = 0.7$ only",
        ),
        ({"up": (step(0.7, face=2.0, hammers=True),)}, "both", "do not begin with it"),
        ({"threshold": 0.6}, "both", r"lasting losses of contact begin at $\mu = 0.7$"),
        ({"threshold": None}, "both", "no equilibrium of the scenes flutters"),
        ({"growth": -0.1}, "both", "goes on losing contact beside a stable equilibrium"),
        ({}, "zero", "beyond its own interval"),
        ({"rate": -0.05}, "zero", r"the method gives $-0.05$ $\pm$ $0.1$\,/ms."),
        ({}, "branch", "goes towards smaller $\\mu$, unstable"),
        ({"least": 0.71}, "branch", "goes towards greater $\\mu$."),
        ({"threshold": None}, "branch", "reaches down"),
        ({}, "cycle", "which agrees"),
        ({"decay": 0.8}, "cycle", "does not agree"),
        ({}, "cycle", "to $0.9$ of itself a period"),
        ({}, "signs", "all starts of B2 (c), printed law are chaotic"),
        ({"rate": -0.09}, "signs", "are without exponential growth"),
        ({"rate": 0.01}, "signs", "are undecided"),  # its interval reaches beyond 0.02
        ({"rate": 0.01}, "unseen", r"rates below $0.12$\,/ms cannot be seen"),
        ({"half": float("inf")}, "unseen", "too short to see any"),
        ({}, "unseen", "every start is seen to be chaotic"),
        ({"rate": 0.1}, "signs", "are undecided"),
        ({}, "caption", "(a): peak force over friction"),
        ({}, "caption", "(b): cycles of B2 (c), printed law"),
        ({"threshold": None}, "caption", "outside of the model. (b)"),
    ],
)
def test_sentences_follow_the_numbers(given, key, words):
    values, _ = generated(made(**given), Spectra(scenes={}, ratio=0.005))
    assert words in values[f"onset.{key}"]


def test_a_pad_that_is_nowhere_faster_is_not_said_to_be():
    values, _ = generated(made(), Spectra(scenes={}, ratio=0.005))
    assert values["onset.beyond"] == ""
    assert "beside" not in values["onset.both"]


def test_tables_tell_what_lasts_and_what_is_undecided():
    found = made()
    table = lasting_table(found)
    assert r"own & 0/25 & 40\,\% & $2$ & $-1.00$ to $0.50$ & 0 & no & no" in table
    away = lasting_table(made(b1=others(3, 3, 3)))
    assert r"B1 (c) & 0.5\,\% & other & 3/25 & 40\,\%" in away
    assert "c (3)" in hammer_table(made(b1=others(3, 3, 3)))
    table_ = hammer_table(made(hammers=True, printed=others(early=(True, False))))
    assert "& 0 to 1 & 1 to 3 & late" in table_
    assert "& c & -- & c &" in table_
    assert "B2 (c), integral law" not in table  # it comes to keep its contact
    assert "off the surface" in lasting_table(made(peak=0.0))
    ended = dataclasses.replace(
        found,
        late=found.late | {"b1-a": (Missing("the model ends"),)},
        others=found.others | {"b1-a": ()},
    )
    assert "the model ends" in lasting_table(ended)
    drifts = results.Exponent(0.0, (0.1, 0.3, 0.9), (0.1, 0.4, 0.4), 0.2, 40, False)
    left = results.Exponent(0.0, (0.1, 0.3), (0.1, 0.4), 0.2, 40, True)
    given: dict[str, Any] = {"b1-b, undamped": drifts, "b1-a, undamped": Missing("the model ends")}
    others_ = dataclasses.replace(found, exponents=given | {"b1-c, undamped": left})
    table = exponents_table(others_)
    assert r"none & 40 & $0.1$ $\pm$ $0.1$ & $0.1$ to $0.9$ & 1 & 1 & 1" in table
    assert table.count("the model ends") == 2
    signs = generated(others_, Spectra(scenes={}, ratio=0.005))[0]["onset.signs"]
    assert "in B1 (b) (undamped) 1 is chaotic, 1 is without exponential growth and 1 is" in signs
    assert "no exponent exists in B1 (c) (undamped), since" in signs


def rows(*rates: float, left: int | None = None) -> np.ndarray:
    """Growth (80, starts) of deviations at a rate per stretch each, NaN after `left` stretches."""
    logs = np.tile(np.array(rates), (80, 1))
    if left is not None:
        logs[left:] = np.nan
    return logs


NOISE = np.random.default_rng(3).normal(size=(80, 2))


@pytest.mark.parametrize(
    ("logs", "signs", "windows"),
    [
        # each start by itself
        (rows(0.5, 0.0, -0.1), ["chaotic", "no growth", "no growth"], 400),
        (rows(0.5, 0.6, left=60), ["chaotic", "chaotic"], 300),
        # a rate of 0.2 in noise that leaves it open, and in a third of that
        (rows(0.2, 0.2) + NOISE * [3.0, 0.3], ["undecided", "chaotic"], 400),
        # oscillations of a deviation's size are no growth
        (np.diff(np.sin(np.arange(81.0)))[:, None], ["no growth"], 400),
        # nor is growth in proportion to time; that with its square is at the limit
        (np.diff(np.log(np.arange(1.0, 82.0)))[:, None], ["no growth"], 400),
        (1.99 * np.diff(np.log(np.arange(1.0, 82.0)))[:, None], ["undecided"], 400),
        # too short for an error of its own
        (rows(0.5, left=12), ["undecided"], 60),
    ],
)
def test_what_rates_of_growth_tell(logs, signs, windows):
    found = attractors.exponent(logs, 1.0, RATIO)
    assert isinstance(found, results.Exponent)
    assert (found.signs, found.windows) == (signs, windows)
    assert found.ends == (windows < 400)


def test_an_own_error_covers_the_true_rate():
    """Of independent growth per stretch the rate is known: 95 % of the intervals hold it."""
    logs = 0.3 + np.random.default_rng(5).normal(size=(600, 400))
    rates, _ = growth(logs, 1.0)
    inside = np.abs(rates - 0.3) < attractors.own_error(logs, 1.0)
    assert 0.92 < inside.mean() < 0.98
    few = attractors.own_error(logs[:12], 1.0)
    assert np.isinf(few).all()


def test_what_ends_at_once_has_no_rate():
    found = attractors.exponent(rows(0.5, 0.5, left=1), 1.0, RATIO)
    assert isinstance(found, Missing)


def test_without_a_cycle_the_reason_is_given():
    found = dataclasses.replace(made(), cycles=Missing("the motion does not return to itself"))
    values, _ = generated(found, Spectra(scenes={}, ratio=0.005))
    assert "does not return" in values["onset.cycle"]


def test_share_of_the_power_at_multiples_of_a_frequency():
    """Two harmonics and a line between them, whose share of the power is by hand."""
    t = 0.01 * np.arange(5000)  # ms
    signal = 2.0 * np.sin(2 * np.pi * 5.0 * t) + 1.0 * np.sin(2 * np.pi * 10.0 * t + 1.0)
    assert spectra.tonal(signal, 0.01, 5.0) == pytest.approx(1.0, abs=1e-6)
    both = signal + np.sqrt(5.0) * np.sin(2 * np.pi * 7.3 * t)
    assert spectra.tonal(both, 0.01, 5.0) == pytest.approx(0.5, abs=1e-3)


@needs_heyoka
def test_hammering_sounds_at_the_frequency_of_its_cycle_and_growth_at_that_of_its_mode():
    """Shooting and the linearisation against the spectrum of a simulation."""
    scene = damped(scene_of("b1-d"), RATIO)
    one = spectra.heard(scene)
    assert one is not None
    assert one.onset is not None
    t, force, _ = spectra.contact_force(scene)
    early = (t > 0.3 * one.onset) & (t < 0.9 * one.onset)
    first, _ = line(force[early, None], float(t[1]))
    assert first == pytest.approx(one.growing, rel=5e-3)
    assert one.tonal > 0.99
    pad = attractors.shooting(scene, RATIO)
    own = pad.units.to_scaled(np.array(scene.initial))
    state = pad.motion(own, _late.LATE * scene.stop / pad.units.time, scene.pad.mu)
    found = attractors.cycles("b1-d", scene, pad.units.to_si(state))
    assert isinstance(found, results.Cycles)
    assert one.strongest * found.own.period == pytest.approx(1.0, rel=1e-4)


def sounds(strongest: float, tonal: float) -> Spectra:
    heard = Heard((5.0,), 5.0, 0.1, 1.0, strongest, tonal, (), (), (), (), ())
    return Spectra(scenes={"b1-d": heard}, ratio=0.005)


@pytest.mark.parametrize(
    ("strongest", "tonal", "period", "words"),
    [
        (5.0, 0.99, 0.2, ("at that of its", "a tone", "has the same frequency")),
        (4.5, 0.5, 0.2, (r"10.0\,\% below", "no tone", "has another frequency")),
        (5.5, 0.5, 0.2, (r"10.0\,\% above", "no tone", "has another frequency")),
    ],
)
def test_the_sentence_on_pitch_follows_the_spectrum(strongest, tonal, period, words):
    found = made()
    assert isinstance(found.cycles, results.Cycles)
    own = dataclasses.replace(found.cycles.own, period=period)
    cycles = dataclasses.replace(found.cycles, name="b1-d", own=own)
    sweeps = {"b1-d": found.sweeps["b2-c-mean"]}
    found = dataclasses.replace(found, cycles=cycles, sweeps=sweeps, thresholds={"b1-d": 0.7})
    found = dataclasses.replace(
        found, late={"b1-d": found.late["b1-c"]}, others={"b1-d": found.others["b1-c"]}
    )
    values, _ = generated(found, sounds(strongest, tonal))
    for part in words:
        assert part in values["onset.pitch"]


def test_without_heyoka_the_reason_is_drawn_and_told():
    why = "No heyoka on this machine simulates no batches of pads."
    none = study.without(why)
    values, tables = generated(none, Spectra(scenes={}, ratio=0.005))
    assert why.rstrip(".") in values["onset.cycle"]
    assert set(tables) == {"lasting", "hammering", "exponents"}
    assert figure.draw(none).alternative == why
