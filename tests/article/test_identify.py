"""Parameter sets: drawn, judged many at once as one alone, searched, written."""

import json

import numpy as np
import pytest

from squeal.article.cases import CASES
from squeal.article.claims import CLAIMS
from squeal.article.identify import search as searching
from squeal.article.identify.judging import INDEPENDENT, distance, margins
from squeal.article.identify.search import SearchResult, allowed, arrays, judged, search
from squeal.article.identify.space import DIMENSIONS, NAMES, decode, scenes_of, stacked, starts
from squeal.article.identify.write import check_folder, write_scenes
from squeal.article.studies import baseline
from squeal.cli.main import main
from squeal.equilibrium import sliding_equilibrium
from squeal.errors import ComputationError, InputError
from squeal.io.scene import read_scene
from squeal.model.contact import CONSISTENT, Formulation
from squeal.simulation.run import simulate
from tests.conftest import ROOT, needs_heyoka

CHOICE = json.loads((ROOT / "workflow" / "pad.json").read_text())["numbers"]
IDS = [claim.id for claim in CLAIMS]


def test_points_cover_the_ranges():
    numbers = decode(np.array([[0.0] * len(NAMES), [1.0] * len(NAMES)]))
    for d in DIMENSIONS:
        assert numbers[d.name] == pytest.approx([d.low, d.high])
        assert d.reason


def test_the_reference_set_is_that_of_the_scenes():
    for model, cases in scenes_of(arrays(CHOICE), CONSISTENT).items():
        for case, one in cases.items():
            stored = read_scene(ROOT / f"workflow/scenes/{model.lower()}-{case}.yaml")
            assert stored.formulation == one.formulation
            for name in ("alpha1", "alpha2", "mu"):
                assert getattr(stored.pad, name) == pytest.approx(getattr(one.pad, name), rel=1e-6)
            ratio = stored.pad.h / stored.pad.w
            assert ratio == pytest.approx(one.pad.h / one.pad.w, rel=1e-6)
            assert stored.initial[1] / stored.pad.w == pytest.approx(one.initial[1], rel=1e-6)


def test_sets_that_stand_start_in_the_equilibrium_without_friction():
    numbers = arrays(CHOICE | {"start": 1.0, "preload": 1.0})
    scene = scenes_of(numbers, CONSISTENT)["B2"]["c"]
    at, _ = sliding_equilibrium(scene.replace(mu=0.0).pad_model)
    assert scene.initial[:3] == pytest.approx(at.q, rel=1e-9)


@needs_heyoka
def test_many_sets_are_judged_as_one_is():
    points = np.random.default_rng(3).uniform(size=(3, len(NAMES)))
    numbers = {name: np.append(v, CHOICE[name]) for name, v in decode(points).items()}
    table, whole = margins(numbers, CONSISTENT)
    alone = judged(SearchResult(CHOICE, 0.0, 1), CONSISTENT)
    assert whole[-1]
    for many, one in zip(table[-1].tolist(), alone, strict=True):
        # calm is not measured of many, peaks are from coarser samples
        if one.id != "B3-none":
            assert (many > 0.0) == one.holds, one.id
    assert np.isnan(table[~whole]).all()
    far = distance(table, whole, numbers)
    failing = (~(table[-1] > 0.0) & INDEPENDENT).sum()
    assert failing <= far[-1] <= 2 * failing
    assert (far[~whole] == 100.0).all()


@needs_heyoka
def test_a_set_without_any_start_is_not_valid():
    """At rest on the disc no case of B2 touches with both edges: no motion is left to simulate."""
    lifted = {"k_c": 0.04366, "lift": 3.254, "preload": 3.304, "tilt": 2.374, "h": 0.7221}
    numbers = arrays(CHOICE | lifted | {"F_n": 0.0066, "L": 4.909, "x0": -0.4142, "start": 1.0})
    for case in CASES:
        assert np.isnan(starts(numbers, stacked(numbers, "B2", case, CONSISTENT))).any(), case
    table, whole = margins(numbers, CONSISTENT, ("B2",))
    assert not whole.any()
    assert np.isnan(table).all()


@needs_heyoka
def test_with_one_model_its_claims_alone_are_judged():
    table, _ = margins(arrays(CHOICE), CONSISTENT, ("B2",))
    known = {name for name, margin in zip(IDS, table[0], strict=True) if not np.isnan(margin)}
    without_b1 = set()
    for claim in CLAIMS:
        models = {scene[:2] for scene in claim.scenes}
        if "b1" not in models:
            without_b1.add(claim.id)
    assert known == without_b1 - {"B3-none"}


def test_the_balances_allow_few_sets_and_not_those_too_high():
    numbers = decode(np.random.default_rng(1).uniform(size=(300_000, len(NAMES))))
    some = allowed(numbers)
    assert 0 < some.sum() < 300
    assert numbers["h"][some].max() < 0.296


@needs_heyoka
def test_a_search_finds_goes_on_and_repeats(monkeypatch, tmp_path):
    monkeypatch.setattr(searching, "FIRST", 8)
    monkeypatch.setattr(searching, "GENERATIONS", {"B2": 1, "B1": 1})
    state = tmp_path / "state.json"
    lines: list[str] = []
    once = search(CONSISTENT, 3, state=state, starts=1, tell=lines.append)
    assert len(lines) == once.starts == 1
    assert once.sets > 0
    assert search(CONSISTENT, 3, starts=1) == once
    again = search(CONSISTENT, 3, state=state, starts=1)
    assert again.starts == 2
    assert again.distance <= once.distance
    with pytest.raises(InputError, match="holds the search of seed 3, not of 4"):
        search(CONSISTENT, 4, state=state)
    monkeypatch.setattr(
        searching.Start, "result", lambda self: (_ for _ in ()).throw(KeyboardInterrupt)
    )
    assert search(CONSISTENT, 3, state=state) == again
    with pytest.raises(KeyboardInterrupt):
        search(CONSISTENT, 5)


@pytest.mark.parametrize("formulation", [CONSISTENT, Formulation("mean", "frame", "-")])
def test_written_scenes_are_the_set_in_si_units(tmp_path, formulation):
    numbers = CHOICE | {"tilt": 1.3, "x0": 0.1, "first_x": 0.2}
    write_scenes(numbers, formulation, tmp_path)
    assert len(list(tmp_path.glob("*.yaml"))) == 9
    for model, case in (("B1", "b"), ("B2", "d")):
        written = read_scene(tmp_path / f"{model.lower()}-{case}.yaml")
        wanted = scenes_of(arrays(numbers), formulation)[model][case]
        assert written.formulation == wanted.formulation
        short = {"stop": 0.1 * wanted.stop, "outputs": ("extrema",)}
        one = simulate(written.replace(stop=0.1 * written.stop))
        two = simulate(wanted.replace(**short))
        for signal, limits in one.extrema.items():
            assert limits == pytest.approx(two.extrema[signal], rel=1e-3, abs=1e-3)
    with pytest.raises(InputError, match="exists; another folder is allowed, or --overwrite"):
        check_folder(tmp_path, False)
    check_folder(tmp_path, True)
    with pytest.raises(InputError, match="is no folder"):
        check_folder(tmp_path / "none", True)


def test_a_set_whose_standing_pad_has_no_initial_state_is_not_written(tmp_path):
    """Its equilibrium without friction is not in full contact in case (a) of the line."""
    with pytest.raises(ComputationError, match="b2-a: without friction the pad is not in full"):
        write_scenes(CHOICE | {"start": 1.0, "tilt": 2.0}, CONSISTENT, tmp_path)
    assert not list(tmp_path.iterdir())


@needs_heyoka
def test_the_command_writes_what_it_found(monkeypatch, tmp_path, capsys):
    result = SearchResult(CHOICE, 5.0, 1, 1, 100)
    monkeypatch.setattr("squeal.article.commands.identify.search", lambda *_: result)
    assert main(["identify", "--starts", "1", "--scenes", str(tmp_path), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["numbers"] == CHOICE
    assert answer["reproduced"] == sum(c["verdict"] == "reproduced" for c in answer["claims"])
    assert main(["claims", "--scenes", str(tmp_path), "--json"]) == 0
    claims = json.loads(capsys.readouterr().out)["claims"]
    assert [c["verdict"] for c in claims] == [c["verdict"] for c in answer["claims"]]
    assert main(["identify", "--overwrite"]) == 2
    assert main(["identify", "--starts", "1", "--scenes", str(tmp_path)]) == 2


@needs_heyoka
def test_the_baseline_counts_what_random_sets_satisfy():
    record = baseline.judged(CONSISTENT, 60)
    assert 0 < record.valid <= record.sets == 60
    assert sum(record.counts) == record.valid
    assert record.counts[record.best] > 0
    assert record.median <= record.best
    assert record.share["B3-singular"].share == record.valid / 60
    for one in record.share.values():
        assert one.interval[0] <= one.share <= one.interval[1]


def test_first_states_are_where_the_numbers_say():
    numbers = arrays(CHOICE)
    scene = scenes_of(numbers, CONSISTENT)["B2"]["a"]
    pad = scene.pad
    # at the start the contact presses with k_c (-y0 - y)
    reaction = -pad.k_c * (pad.y0 + scene.initial[1])
    assert reaction / pad.F_n == pytest.approx(CHOICE["preload"], rel=1e-12)
    assert starts(numbers, scenes_model(numbers)).shape == (1, 6)


def scenes_model(numbers):
    from squeal.article.identify.space import stacked

    return stacked(numbers, "B1", "a", CONSISTENT)
