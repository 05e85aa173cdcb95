"""Identification: the search space, the cost, and a search that stops and resumes."""

import json
import math

import numpy as np
import pytest

from squeal.contact import Formulation
from squeal.errors import InputError
from squeal.identify import search
from squeal.identify.objective import cost_of, judge_numbers
from squeal.identify.space import BOUNDS, DIMENSIONS, START, decode, encode, scenes_of
from squeal.identify.write import write_scenes
from squeal.scene import read_scene
from squeal.simulation import simulate

MEAN = Formulation("mean")


def test_points_and_numbers_are_the_same_thing():
    point = encode(START)
    assert decode(point) == pytest.approx(START, rel=1e-14)
    for value, (low, high) in zip(point, BOUNDS, strict=True):
        assert low <= value <= high
    assert all(d.reason for d in DIMENSIONS)


def test_preload_is_in_units_of_the_brake_force():
    scene = scenes_of(START, MEAN, 1e-8)["B2"]["a"]
    pad = scene.pad
    # at the start the contact presses with k_c (-y0 - y)
    reaction = -pad.k_c * (pad.y0 + scene.initial[1])
    assert reaction / pad.F_n == pytest.approx(START["preload"], rel=1e-12)


def test_cost_counts_failing_claims():
    judged = judge_numbers(START, MEAN)
    failing = sum(
        j.verdict != "reproduced"
        for j in judged
        if j.claim.id != "B2-b-theta" and not j.claim.id.startswith("B3")
    )
    # each failing claim costs 1 to 2, each holding one gives back at most 0.1
    assert failing - 2.5 <= cost_of(judged) <= 2 * failing


def test_written_scenes_are_the_searched_pad_in_si_units(tmp_path):
    write_scenes(START, MEAN, tmp_path)
    assert len(list(tmp_path.glob("*.yaml"))) == 9
    for model, case in (("B1", "b"), ("B2", "d")):
        written = read_scene(tmp_path / f"{model.lower()}-{case}.yaml", "simulate")
        wanted = scenes_of(START, MEAN, 1e-15)[model][case]
        one, two = simulate(written), simulate(wanted)
        assert written.formulation == wanted.formulation
        for signal, limits in one.extrema.items():
            assert limits == pytest.approx(two.extrema[signal], rel=1e-4, abs=1e-4)


def test_search_stops_resumes_and_refuses_another_search(tmp_path):
    state = tmp_path / "state.json"
    told: list[str] = []
    first = search(MEAN, 1, 0.0, state, 1, told.append, population=1)
    assert first.generations == 1
    assert len(told) == 1
    second = search(MEAN, 1, 0.0, state, 1, population=1)
    assert second.generations == 2
    assert second.cost <= first.cost + 1e-9
    assert second.pads == 2 * first.pads
    kept = json.loads(state.read_text())
    assert np.array(kept["population"]).shape[1] == len(DIMENSIONS)
    assert math.isfinite(second.cost)
    with pytest.raises(InputError, match="state"):
        search(MEAN, 2, 0.0, state, 1)
