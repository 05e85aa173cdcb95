"""Identification: the search space, the cost, and a search that stops and resumes."""

import dataclasses
import json
import math
import sys
from typing import Any

import pytest

from squeal.article.claims import CLAIMS
from squeal.article.identify import search, space
from squeal.article.identify.objective import cost_of, costs, judge_many, judge_one
from squeal.article.identify.stored import read_searches
from squeal.article.identify.write import check_folder, write_scenes
from squeal.article.results.verify import TOLERANCE
from squeal.article.studies.verify import VARIATIONS
from squeal.cli.main import main
from squeal.errors import InputError
from squeal.io.scene import read_scene
from squeal.model.contact import Formulation
from squeal.model.pad import Model
from squeal.simulation import simulate
from tests.conftest import ROOT, needs_heyoka

MEAN = Formulation("mean")
TILTED = ROOT / "tests" / "data" / "tilted-pad.json"


def test_points_and_numbers_are_the_same_thing():
    point = space.encode(space.START)
    assert space.decode(point) == pytest.approx(space.START, rel=1e-14)
    for value, (low, high) in zip(point, space.BOUNDS, strict=True):
        assert low <= value <= high
    assert all(d.reason for d in space.DIMENSIONS)


def test_preload_is_in_units_of_the_brake_force():
    scene = space.scenes_of(space.START, MEAN)["B2"]["a"]
    pad = scene.pad
    # at the start the contact presses with k_c (-y0 - y)
    reaction = -pad.k_c * (pad.y0 + scene.initial[1])
    assert reaction / pad.F_n == pytest.approx(space.START["preload"], rel=1e-12)


@pytest.fixture(scope="module")
def outcome():
    return judge_many([space.START], MEAN)[0]


@needs_heyoka
def test_many_pads_are_judged_as_one_is(outcome):
    alone = judge_one(space.START, MEAN)
    for many, one in zip(outcome.judged, alone, strict=True):
        assert (many.id, many.verdict) == (one.id, one.verdict)
        # peaks from coarser samples, the map from 40 points a side, calm to some per cent
        assert many.margin == pytest.approx(one.margin, rel=0.02, abs=0.02)
    assert all(math.isfinite(one.margin) for one in alone)


@needs_heyoka
@pytest.mark.parametrize("over", [0.9, 1.1])
def test_sliding_is_judged_by_the_speed_that_is_given(outcome, over):
    (again,) = judge_many([space.START], MEAN, speed=over * outcome.fastest)
    changed = {
        a.id for a, b in zip(again.judged, outcome.judged, strict=True) if a.holds != b.holds
    }
    assert changed == ({"B12-sliding"} if over < 1.0 else set())


@needs_heyoka
def test_a_pad_is_as_fast_as_its_history_says(outcome):
    fastest = 0.0
    for cases in space.scenes_of(space.START, MEAN).values():
        for scene in cases.values():
            history = simulate(
                dataclasses.replace(scene, samples=4001, outputs=("history",))
            ).history
            fastest = max(fastest, history["x_dot"].max())
    assert outcome.fastest == pytest.approx(fastest, rel=1e-2)


@needs_heyoka
def test_cost_counts_failing_claims(outcome):
    failing = sum(j.verdict != "reproduced" for j in outcome.judged)
    # of two claims that conflict one counts; each failing claim costs 1 to 2, a thin one up to 1/2
    assert failing - 1 <= cost_of(outcome, space.START) <= 2 * failing + 0.5 * len(CLAIMS)


@needs_heyoka
def test_what_no_pad_could_do_costs(outcome):
    outcome = outcome._replace(fastest=space.SPEED_LIMIT)
    fast = outcome._replace(fastest=3 * space.SPEED_LIMIT)
    assert cost_of(fast, space.START) == pytest.approx(cost_of(outcome, space.START) + 4.0)
    soft = space.START | {"k_c": space.START["preload"] * space.START["F_n"] / space.START["h"]}
    assert cost_of(outcome, soft) == pytest.approx(cost_of(outcome, space.START) + 2.0)
    assert cost_of(None, space.START) > cost_of(outcome, space.START)


@needs_heyoka
def test_a_pad_that_turns_over_is_dear_and_stops_nobody():
    mad = space.START | {"F_n": 30.0}
    both = judge_many([mad, space.START], MEAN)
    assert both[0] is None
    assert both[1] is not None
    found, alone = costs([mad, space.START], MEAN), costs([space.START], MEAN)
    assert found[0] == 100.0
    assert found[1] == pytest.approx(alone[0], rel=1e-6)


def test_written_scenes_are_the_searched_pad_in_si_units(tmp_path):
    write_scenes(space.START, MEAN, tmp_path)
    assert len(list(tmp_path.glob("*.yaml"))) == 9
    chosen: list[tuple[Model, str]] = [("B1", "b"), ("B2", "d")]
    for model, case in chosen:
        written = read_scene(tmp_path / f"{model.lower()}-{case}.yaml", "simulate")
        wanted = space.scenes_of(space.START, MEAN, 1e-15)[model][case]
        one, two = simulate(written), simulate(wanted)
        assert written.formulation == wanted.formulation
        for signal, limits in one.extrema.items():
            assert limits == pytest.approx(two.extrema[signal], rel=1e-4, abs=1e-4)


@pytest.fixture(scope="module")
def first_start():
    """What a start of one generation finds."""
    return search(MEAN, 1, 60.0, None, 1, starts=1, generations=1)


@needs_heyoka
def test_search_stops_resumes_and_refuses_another_search(tmp_path):
    state = tmp_path / "state.json"
    told: list[str] = []
    first = search(MEAN, 1, 60.0, state, 1, told.append, starts=1, generations=1)
    assert (first.starts, first.pads, len(told)) == (1, 32, 1)
    second = search(MEAN, 1, 60.0, state, 1, starts=1, generations=1)
    assert (second.starts, second.pads) == (2, 64)
    assert second.cost <= first.cost
    at_once = search(MEAN, 1, 60.0, None, 1, starts=2, generations=1)
    assert at_once.numbers == second.numbers
    assert len(json.loads(state.read_text())["best"]) == 2
    with pytest.raises(InputError, match="state"):
        search(MEAN, 2, 0.0, state, 1)
    state.write_text("{}")
    with pytest.raises(InputError, match="state"):
        search(MEAN, 1, 0.0, state, 1)


@needs_heyoka
def test_an_interrupted_start_leaves_its_best_pad(tmp_path, monkeypatch, first_start):
    state = tmp_path / "state.json"
    whole = search(MEAN, 1, 60.0, None, 1, starts=1, generations=2)
    calls: list[tuple[Any, ...]] = []
    told: list[str] = []

    def interrupted(*given):
        calls.append(given)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return costs(*given)

    with monkeypatch.context() as patch:
        patch.setattr(sys.modules[search.__module__], "costs", interrupted)
        stopped = search(MEAN, 1, 60.0, state, 1, told.append, starts=1, generations=5)
    # two generations were whole: their best pad is that of a start that ends there
    assert (stopped.numbers, stopped.starts) == (whole.numbers, 0)
    assert "stopped" in told[-1]
    kept = json.loads(state.read_text())
    assert (kept["best"], kept["unfinished"]["cost"]) == ([], whole.cost)
    # the start is made again from its first generation, and knows the pad until it has a better one
    again = search(MEAN, 1, 60.0, state, 1, starts=1, generations=1)
    assert (again.starts, again.cost) == (1, min(whole.cost, first_start.cost))
    assert json.loads(state.read_text())["best"][0]["cost"] == first_start.cost


def test_without_any_generation_an_interrupt_is_one(monkeypatch):
    def interrupted(*given):
        raise KeyboardInterrupt

    monkeypatch.setattr(sys.modules[search.__module__], "costs", interrupted)
    with pytest.raises(KeyboardInterrupt):
        search(MEAN, 1, 60.0, None, 1, starts=1)


def test_scenes_are_not_overwritten_unless_asked(tmp_path, capsys):
    (tmp_path / "b2-a.yaml").write_text("mine")
    assert main(["identify", "--minutes", "0", "--scenes", str(tmp_path)]) == 2
    assert main(["identify", "--minutes", "0", "--overwrite"]) == 2
    assert "b2-a.yaml exists" in capsys.readouterr().err
    assert (tmp_path / "b2-a.yaml").read_text() == "mine"
    with pytest.raises(InputError, match=r"b2-a\.yaml exists.*--overwrite"):
        check_folder(tmp_path, overwrite=False)
    check_folder(tmp_path, overwrite=True)
    (tmp_path / "b2-a.yaml").rename(tmp_path / "b2-x.yaml")
    check_folder(tmp_path, overwrite=False)
    with pytest.raises(InputError, match="no folder"):
        check_folder(tmp_path / "none", overwrite=True)


@pytest.fixture(scope="module")
def stored():
    return read_searches([ROOT / "workflow" / "identified.json"])


def test_without_a_stored_search_the_file_that_holds_some_is_named(tmp_path):
    empty = tmp_path / "empty.json"
    empty.write_text("[]", encoding="utf-8")
    for files in ([], [empty]):
        with pytest.raises(InputError, match=r"workflow/identified\.json"):
            read_searches(files)


def test_stored_pads_are_of_all_formulations(stored):
    assert len({search.formulation for search in stored}) == 8


def test_the_report_says_truly_which_formulations_keep_most(stored):
    kept = {search.formulation: search.kept for search in stored}
    printed = min(kept[Formulation("mean", frame, "+")] for frame in ("centre", "frame"))
    others = [n for f, n in kept.items() if (f.line_force, f.delta_moment) != ("mean", "+")]
    assert printed > max(others)
    told = [{j.id: j.verdict for j in judge_one(s.numbers, s.formulation)} for s in stored]
    for one, verdicts in zip(stored, told, strict=True):
        f = one.formulation
        if f.delta_moment == "-" or f == Formulation("integral", "centre", "+"):
            assert verdicts["B2-c-hammer"] != "reproduced"
        if f == Formulation("integral", "frame", "+"):
            assert verdicts["B2-c-hammer"] == "reproduced"
            assert "reproduced" not in (verdicts["B2-b-trailing"], verdicts["B2-d-trailing"])
    held = {name for name, verdict in told[0].items() if verdict == "reproduced"}
    assert len(held) == stored[0].kept
    assert "B2-d-trailing" not in held


def test_hammering_and_the_statement_on_case_d_do_not_exclude_each_other():
    # as the report says of the statement that the best pad does not keep
    pad = space.START | {"h": 0.13389, "inertia": 1.9912, "k2": 2.4945, "k_c": 2.9869, "L": 1.0146}
    pad |= {"mu": 0.32352, "F_n": 0.001901, "preload": 3.1418, "lift": 2.9909}
    held = {j.id for j in judge_one(pad, MEAN) if j.verdict == "reproduced"}
    assert {"B2-c-hammer", "B2-c-loss", "B2-d-contact", "B2-d-trailing"} <= held


def test_a_tilted_start_keeps_the_statement_on_case_d_and_loses_the_one_on_case_a():
    numbers = json.loads(TILTED.read_text())
    failing = {j.id for j in judge_one(numbers, MEAN) if j.verdict != "reproduced"}
    printed = {c.id for c in CLAIMS if not c.id.startswith("B12")}  # those the pad was sought for
    assert failing & printed == {"B2-a-leading", "B2-b-theta"}


@needs_heyoka
def test_each_tolerance_at_which_verdicts_are_asked_again_is_another_integration():
    scene = read_scene(ROOT / "workflow" / "scenes" / "b2-c.yaml")
    tolerances = {TOLERANCE, *(tolerance for tolerance, _ in VARIATIONS.values())}
    assert len(tolerances) == 3
    ends = {simulate(dataclasses.replace(scene, tolerance=one)).final for one in tolerances}
    assert len(ends) == 3
