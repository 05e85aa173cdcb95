"""The suite of stiff and extreme cases: what it covers, and that none ends in a wrong answer."""

import dataclasses
import math
import sys

import pytest

from squeal.article.extreme import CASES, run_case
from squeal.article.extreme.cases import scene_of
from squeal.article.extreme.closed_forms import bounce_error, bounce_period, upright
from squeal.article.extreme.run import RIGHT, in_units, peak_memory
from squeal.article.report.extreme import accuracy_values
from squeal.article.results.accuracy import Accuracy, SceneAccuracy
from squeal.article.results.onset import Exponent, Onset
from squeal.io.scene import Scene
from squeal.simulation import simulate
from squeal.simulation.reference import error_against, reference
from tests.article import known
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


@pytest.mark.parametrize(
    ("rate", "half", "other", "ends", "words", "beyond"),
    [
        # ln(0.01/1e-15) = 29.93, over 0.4/ms and 0.2/ms; a scene is 3 ms long
        (
            0.3,
            0.1,
            0.25,
            False,
            r"B1, case (a) 0.075 to 0.15\,s, 25 to 50 times that of the scene; in 600",
            "12 to 23",
        ),
        # another start is chaotic at 0.5/ms, or at 0.15/ms
        (0.3, 0.1, 0.5, False, r"B1, case (a) 0.06 to 0.15\,s, 20 to 50 times", "9.2 to 23"),
        (0.3, 0.1, 0.15, False, r"B1, case (a) 0.075 to 0.2\,s, 25 to 67 times", "12 to 31"),
        # or not seen to be, at 0.05/ms with an error of 0.1/ms
        (0.3, 0.1, 0.05, False, r"B1, case (a) 0.075 to 0.15\,s, 25 to 50 times", "12 to 23"),
        (0.3, 0.4, 0.25, False, "in 600 times the time of the scenes no other own motion", ""),
        (0.3, 0.1, 0.25, True, "no exponents were measured", ""),
    ],
)
def test_a_horizon_is_given_where_the_own_motion_is_chaotic(rate, half, other, ends, words, beyond):
    one = SceneAccuracy(1e-14, 20.0, 300.0, 5.0, 200, 40, 0.05, 1e-15, 0.003)
    found = Accuracy({"b1-a": one, "b1-b": one}, 0.01, "quad precision")
    exponent = Exponent(0.0, (rate, other), (half, 0.1), 0.001, 600, ends)
    onset = dataclasses.replace(known.of(Onset), exponents={"b1-a, undamped": exponent})
    values = accuracy_values(found, onset)
    assert words in values["accuracy.horizons"]
    assert values["accuracy.tolerances"] == r"$1 \times 10^{-15}$"
    assert values["accuracy.within"] == "all are"
    # exp(0.3/ms 15 ms) = 90
    assert values["accuracy.grown"] == r"$9.1 \times 10^{-14}$"
    # ln(0.01/1e-8) = 13.8, over these rates and 3 ms: below 40 windows
    late = f"in B1, case (a) ({beyond} windows)" if beyond else "in no case"
    assert values["accuracy.beyond"].startswith(late)
    lost = dataclasses.replace(found, lost=1e-14)
    assert accuracy_values(lost, onset)["accuracy.within"] == "not all are"
