"""Pads taken from the ensembles: judged by both paths, written as scenes, bound by balances."""

import dataclasses
import math

import numpy as np
import pytest

from squeal.article.cases import CASES
from squeal.article.claims import CLAIMS, judge_scenes
from squeal.article.ensembles import balanced, choosing
from squeal.article.ensembles.balance import flattest
from squeal.article.ensembles.choice import read_choice
from squeal.article.ensembles.choosing import LAWS, MOST, RIVAL
from squeal.article.ensembles.distance import judge
from squeal.article.ensembles.gather import counts
from squeal.article.ensembles.space import DIMENSIONS, decode
from squeal.article.identify.objective import judge_one
from squeal.article.identify.space import LENGTH, STOP, arrays, stacked
from squeal.article.identify.write import write_scenes
from squeal.article.report.chapters import ENSEMBLES, PAD
from squeal.article.report.ensembles import generated
from squeal.article.results.ensembles import Ensembles, Kept
from squeal.article.results.ensembles import Pad as Judged
from squeal.article.results.findings import Findings
from squeal.article.studies._scenes import read_cases
from squeal.equilibrium import sliding_equilibrium
from squeal.io.scene import read_scene
from squeal.model.contact import CONSISTENT
from squeal.model.equations import PadModel
from squeal.model.states import FULL
from squeal.simulation import simulate
from tests.article import known
from tests.conftest import ROOT, needs_heyoka


@needs_heyoka
def test_a_pad_of_the_consistent_law_keeps_27_listed_statements_by_both_paths():
    alone = {j.id: j.holds for j in judge_one(RIVAL, CONSISTENT)}
    margins = judge({name: np.array([value]) for name, value in RIVAL.items()}, CONSISTENT).margins
    for claim, margin in zip(CLAIMS, margins[0], strict=True):
        if np.isfinite(margin):
            assert (margin > 0.0) == alone[claim.id], claim.id
    listed = {c.id for c in CLAIMS if c.listed}
    assert sum(alone[name] for name in listed) == 27
    assert alone["B2-c-hammer"]
    assert counts(margins)[1, 0] == 27


@needs_heyoka
def test_windows_judged_at_once_are_those_judged_one_by_one(monkeypatch):
    """Also for a pad that leaves the model."""
    monkeypatch.setattr(choosing, "WINDOWS", windows := (1, 4))
    pads = arrays([dict(RIVAL), {**MOST, "F_n": 30 * MOST["F_n"]}])
    rows, found = choosing.over_windows(pads, CONSISTENT)
    for window in windows:
        alone = judge(pads, CONSISTENT, stop=window * STOP)
        for name in ("partial", "whole", "margins"):
            one, other = (getattr(j, name) for j in (found[window], alone))
            assert np.array_equal(one, other, equal_nan=True)
        assert [row[str(window)] is not None for row in rows] == [True, False]
    assert not np.array_equal(found[1].margins, found[4].margins, equal_nan=True)


def counted(informative: int) -> Kept:
    return Kept(33, 29, informative)


@pytest.mark.parametrize(
    ("consistent", "printed", "law"),
    [(18, 16, "consistent"), (16, 16, "consistent"), (15, 16, "printed force")],
)
def test_the_report_takes_the_law_under_which_its_pad_keeps_more(consistent, printed, law):
    pads = {
        name: Judged(dict(RIVAL), {"10": counted(n)}, {}, 1.0, 2.0)
        for name, n in zip(LAWS, (consistent, printed), strict=True)
    }
    assert choosing.choice(pads, "here").law == LAWS[law]
    pads[law] = dataclasses.replace(pads[law], horizons={"10": None})
    assert choosing.choice(pads, "here").law != LAWS[law]


@needs_heyoka
def test_the_pad_of_the_report_is_the_chosen_one_and_its_scenes_are_written_by_it(tmp_path, capsys):
    assert choosing.main([str(ROOT / ENSEMBLES), "--scenes", str(tmp_path)]) == 0
    assert capsys.readouterr().out == (ROOT / PAD).read_text(encoding="utf-8")
    for file in (ROOT / "workflow" / "scenes").glob("*.yaml"):
        assert (tmp_path / file.name).read_text() == file.read_text(), file.name
    assert choosing.main([str(tmp_path / "none"), "--scenes", str(tmp_path)]) == 2


def test_scenes_of_a_standing_and_displaced_pad_start_where_it_does(tmp_path):
    own = read_choice(ROOT / PAD)
    found = dataclasses.replace(own, numbers=own.numbers | {"first_x": 0.5, "x0": 0.2, "tilt": 2.0})
    first = choosing.first_states(found)
    write_scenes(found.numbers, found.law, tmp_path, first, 5.0)
    scene = read_scene(tmp_path / "b2-a.yaml", "simulate")
    load = found.numbers["F_n"]
    assert scene.pad.V == 5.0
    assert scene.pad.x0 == pytest.approx(0.2 * LENGTH)
    assert scene.pad.theta0 == pytest.approx(load)
    assert scene.initial[0] == pytest.approx(0.5 * load * LENGTH)
    standing = dataclasses.replace(own, numbers=own.numbers | {"start": 0.9})
    first = choosing.first_states(standing)
    write_scenes(standing.numbers, standing.law, tmp_path, first, 5.0)
    # at rest on a disc that stands still: nothing is pushed along
    for name in ("b1-b", "b2-b"):
        scene = read_scene(tmp_path / f"{name}.yaml", "simulate")
        rest, _ = sliding_equilibrium(scene.pad_model.replace(mu=0.0))
        assert rest is not None
        assert scene.initial[:3] == pytest.approx(rest.q, rel=1e-5, abs=1e-12)


def mean_place(case, mu, slender, load):
    """Mean of delta/w, weighted with R_n, in a case of model B2.

    slender: h/w; load: mean R_n over F_n. In cases (c) and (d) the load does not matter.
    """
    alpha1, alpha2 = CASES[case]
    if alpha1 == alpha2:
        return -mu * (math.tan(alpha1) + 2.0 * slender)
    # the upright spring takes what the reaction has beyond F_n, the level one the friction
    side = -1.0 if alpha1 < alpha2 else 1.0
    return side * (1.0 - 1.0 / load) - 2.0 * mu * slender


@needs_heyoka
@pytest.mark.parametrize("case", "abcd")
def test_the_mean_place_of_the_reaction_follows_from_the_balances(case):
    """By a simulation over 20 windows, with partial contact and, in case (c), separation."""
    scene = read_scene(ROOT / "workflow" / "scenes" / f"b2-{case}.yaml", "simulate")
    assert scene.stop is not None
    longer = dataclasses.replace(scene, stop=20 * scene.stop, samples=100_001, outputs=("history",))
    history = simulate(longer).history
    force, place = (np.nan_to_num(np.array(history[name])) for name in ("Rn", "delta"))
    pad = scene.pad
    wanted = mean_place(case, pad.mu, pad.h / pad.w, force.mean())
    assert (force * place).mean() / force.mean() == pytest.approx(wanted, abs=3e-3)


def test_a_flat_pad_alone_keeps_the_reaction_on_the_trailing_side():
    limit = flattest("d")
    assert limit == pytest.approx(math.tan(0.17 * math.pi) / 2.0, rel=1e-12)
    assert mean_place("d", 0.3, limit - 0.01, 2.0) > 0.0 > mean_place("d", 0.3, limit + 0.01, 2.0)
    found = known.of(Ensembles)
    for own, words in ((limit + 0.1, "must be flatter"), (limit - 0.1, "which the pad")):
        pads = {
            law: dataclasses.replace(pad, numbers=pad.numbers | {"h": own})
            for law, pad in found.chosen.items()
        }
        values, _ = generated(dataclasses.replace(found, chosen=pads), known.of(Findings))
        assert words in values["ensembles.balance"]


@needs_heyoka
def test_one_pad_keeps_all_listed_statements_that_can_hold_together(tmp_path):
    """Each scene simulated by itself, at full accuracy, over one and two windows."""
    own = read_choice(ROOT / PAD)
    most = dataclasses.replace(own, numbers=MOST)
    assert most.law == CONSISTENT
    write_scenes(most.numbers, most.law, tmp_path, choosing.first_states(most))
    files = list(tmp_path.glob("*.yaml"))
    models = [read_cases(files, model, "simulate") for model in ("B1", "B2")]
    listed = {c.id for c in CLAIMS if c.listed}
    for windows in (1, 2):
        longer = (
            {case: dataclasses.replace(one, stop=windows * one.stop) for case, one in four.items()}
            for four in models
        )
        lost = {j.id for j in judge_scenes(*longer) if not j.holds}
        assert lost & listed == {"B2-b-theta"}


def test_pads_that_the_balances_allow_rest_on_the_trailing_side_in_case_b():
    numbers = decode(np.random.default_rng(3).uniform(size=(400_000, len(DIMENSIONS))))
    few = np.flatnonzero(balanced.allowed(numbers))
    assert 0 < len(few) < 200
    some = {name: v[few] for name, v in numbers.items()}
    pads = stacked(some, "B2", "b", CONSISTENT)
    for i, slender in enumerate(some["h"].tolist()):
        pad = known.one_of(pads, i)
        rest, _ = sliding_equilibrium(PadModel("B2", pad, CONSISTENT))
        assert rest is not None
        if pad.F_n > 4e-4:  # the springs turn with the pad
            continue
        assert rest.state == FULL
        assert rest.delta > 0.0
        wanted = mean_place("b", pad.mu, slender, rest.R_n / pad.F_n)
        assert rest.delta == pytest.approx(wanted, abs=0.1)
