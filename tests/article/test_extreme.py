"""The suite of stiff and extreme cases: what it covers, and that none ends in a wrong answer."""

import dataclasses
import math
import sys

import pytest

from squeal.article.extreme import CASES, run_case
from squeal.article.extreme.cases import scene_of
from squeal.article.extreme.closed_forms import bounce_error, bounce_period, upright
from squeal.article.extreme.run import RIGHT, in_units, peak_memory
from squeal.article.report.extreme import accuracy_table, accuracy_values
from squeal.article.results.accuracy import SceneAccuracy
from squeal.scene.schema import Scene
from squeal.simulation import simulate
from squeal.simulation.reference import error_against, reference
from tests.conftest import needs_heyoka

QUICK = [case for case in CASES if case.truth != "energy"]
ASKED = {
    "contact stiffness",
    "free length",
    "level face (pole of Eq. 12)",
    "grazing",
    "both edges at once",
    "separations shorter than a step",
    "start on the switching surface",
    "friction",
    "load",
    "springs",
    "shape",
    "angles",
    "masses and units",
    "limits",
    "speed of the surface",
    "long runs",
}


def test_the_suite_covers_what_was_asked():
    assert {case.group for case in CASES} == ASKED
    assert len(CASES) >= 40
    assert len({(case.group, case.name) for case in CASES}) == len(CASES)


@pytest.mark.parametrize("case", QUICK, ids=lambda case: f"{case.group}: {case.name}")
@needs_heyoka
def test_no_case_is_wrong(case):
    outcome = run_case(case)
    assert outcome.outcome != "wrong", outcome.told
    if case.truth == "refusal":
        assert outcome.outcome == "refused"
    if case.truth == "warning":
        assert outcome.outcome == ("warned" if math.isfinite(case.time) else "right")


@needs_heyoka
def test_energy_is_kept_over_a_hundred_periods():
    for case in CASES:
        if case.truth == "energy":
            scene = dataclasses.replace(case.scene, stop=case.scene.stop / 100)
            outcome = run_case(dataclasses.replace(case, scene=scene))
            assert outcome.error < 1e-12
            assert outcome.changes > 100


def test_growth_of_memory_is_left_out_where_the_system_does_not_tell_it(monkeypatch):
    assert 10.0 < peak_memory() < 1e5
    case = next(c for c in CASES if c.truth == "energy")
    case = dataclasses.replace(case, scene=dataclasses.replace(case.scene, stop=10.0))
    assert "memory grew" in run_case(case).told
    monkeypatch.setitem(sys.modules, "resource", None)
    assert peak_memory() is None
    outcome = run_case(case)
    assert (outcome.outcome, outcome.told) == ("right", "drift of energy")


def test_a_wrong_answer_would_be_seen():
    case = next(c for c in CASES if c.truth == "quad")
    off = dataclasses.replace(case, truth="closed form", error=lambda *_: 2 * RIGHT)
    assert run_case(off).outcome == "wrong"
    tame = dataclasses.replace(case, truth="refusal", words="collapsed")
    assert run_case(tame).outcome == "wrong"
    fast = next(c for c in CASES if c.truth == "warning" and math.isfinite(c.time))
    assert run_case(dataclasses.replace(fast, time=2 * fast.time)).outcome == "wrong"
    pad, height = upright(), 1e-3
    scene = Scene(
        "B1",
        pad,
        initial=(0, height, 0, 0, 0, 0),
        stop=3.2 * bounce_period(pad, height),
        samples=2,
        outputs=("events",),
    )
    result = simulate(scene)
    assert bounce_error(scene, result) < 1e-12
    assert bounce_error(scene, dataclasses.replace(result, events=result.events[1:])) == math.inf


@needs_heyoka
def test_quad_precision_against_tighter_and_looser_tolerances():
    scene = scene_of("B1", 30.0)
    exact, looser = reference(scene), reference(scene, 1e-24)
    assert len(exact.times) == len(looser.times)
    # the difference of two quad runs is far below what doubles can tell
    assert error_against(looser.place, exact.place) < 1e-15


def test_other_units_are_the_same_scene():
    scene = scene_of("B2", 10.0)
    back = in_units(in_units(scene, 7.0, 3.0, 0.1), 1 / 7.0, 1 / 3.0, 10.0)
    assert back.pad.k_c == pytest.approx(scene.pad.k_c, rel=1e-14)
    assert back.initial == pytest.approx(scene.initial, rel=1e-14)
    assert back.stop == pytest.approx(scene.stop, rel=1e-14)


def test_horizons_are_shown_where_there_are_any():
    def one(horizon: float | None) -> SceneAccuracy:
        return SceneAccuracy(1e-14, 20.0, 300.0, 5.0, horizon, 200, 40, 0.05, 1e-15, 0.003)

    none = {name: one(None) for name in ("b1-a", "b1-b")}
    assert "horizon" not in accuracy_table(none)
    assert "no horizon is given: none ends within $5$ times" in horizons(none)
    some = none | {"b1-b": one(0.009)}
    assert "& $9$" in accuracy_table(some)
    assert "but for 1 of 2 motions, whose horizon is at least $3$ times" in horizons(some)
    assert accuracy_values(some | {"b1-a": one(0.003)})["accuracy.within"] == "not all are"


def horizons(scenes: dict[str, SceneAccuracy]) -> str:
    return accuracy_values(scenes)["accuracy.horizons"]
