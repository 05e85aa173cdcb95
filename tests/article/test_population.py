"""Random parameter sets: bounds, verdicts by hand, stored rows again; searches and control."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from squeal.article.cases import CASES
from squeal.article.claims import CLAIMS, measure
from squeal.article.contents import STUDIES
from squeal.article.identify import control, lasting, population
from squeal.article.identify.arrangement import LETTERS, PRINTED, Arrangement, mirrored, shuffled
from squeal.article.identify.ensemble import single
from squeal.article.identify.population import BOUNDS, VERDICTS, Row
from squeal.article.identify.space import LENGTH, MODELS, STIFFNESS, STOP, stacked, starts
from squeal.article.records import read_json
from squeal.article.studies import ensemble
from squeal.io.scene import Scene
from squeal.model.contact import CONSISTENT
from squeal.model.pad import Pad
from tests.article import by_hand
from tests.conftest import ROOT, needs_heyoka

TABLE, DAMPED, SEARCHES = (ROOT / file for file in STUDIES["ensemble"])
ROWS = population.read(TABLE)
STORED = read_json(control.Searches, SEARCHES).searches


def some_valid(count, seed):
    valid = [i for i, row in enumerate(ROWS) if row.outcome == "valid"]
    return np.random.default_rng(seed).choice(valid, count, replace=False).tolist()


def test_sets_lie_within_physical_bounds():
    numbers = population.drawn()
    assert len(ROWS) <= population.SETS == len(numbers["mu"])
    assert numbers["mu"].max() <= 0.45
    load = numbers["F_n"] * STIFFNESS * LENGTH
    assert 500.0 <= load.min() < 520.0
    assert 19_000.0 < load.max() <= 20_000.0
    for bound in BOUNDS:
        assert bound.low <= numbers[bound.name].min() <= numbers[bound.name].max() <= bound.high


def test_no_more_sets_are_stored_than_are_drawn(tmp_path, capsys, monkeypatch):
    """The loop over blocks of sets would go on for ever with empty ones."""
    monkeypatch.setattr(population, "rows", lambda numbers: pytest.fail("computes sets"))
    with pytest.raises(SystemExit):
        population.main([str(tmp_path / "sets.csv"), "--sets", str(population.SETS + 1)])
    assert f"there are {population.SETS} sets" in capsys.readouterr().err


def test_what_is_stored_is_small_and_whole():
    assert sum(file.stat().st_size for file in (TABLE, DAMPED, SEARCHES)) < 200_000
    for row in ROWS:
        assert row.outcome in ("valid", "outran", "left", "start")
        if row.outcome in ("valid", "outran"):
            assert len(row.verdicts) == len(VERDICTS)
            rounding = 0.06 if row.outcome == "outran" else -0.06
            assert (float(row.speed) + rounding >= population.SPEED) == (row.outcome == "outran")
    valid = {i for i, row in enumerate(ROWS) if row.outcome == "valid"}
    assert {one.number for one in lasting.read(DAMPED)} <= valid


@pytest.mark.parametrize("number", some_valid(1, 5))
def test_a_set_says_the_same_by_hand(number):
    """Own equations, SciPy with clipped forces, a root finder, sums over samples."""
    one = population.some(population.drawn(), slice(number, number + 1))
    pads = {}
    initial = {}
    for model in MODELS:
        cases = [stacked(one, model, case, CONSISTENT) for case in CASES]
        initial[model] = [starts(one, case)[0] for case in cases]
        pads[model] = [single(case, 0).pad for case in cases]
    found = by_hand.says(pads, initial, STOP)
    row = ROWS[number]
    assert found.pop("hammers") == row.hammers
    for key, value in found.items():
        assert float(getattr(row, key)) == pytest.approx(value, abs=1.0 + float(row.spread))
    longer = "p" if found["lost1"] >= found["lost2"] else "l"  # points or line
    if abs(found["lost1"] - found["lost2"]) > 2.0:
        assert ensemble.verdict(row, "lost") == longer


@needs_heyoka
def test_stored_sets_say_the_same_again():
    sample = ensemble.sampled(ROWS, 4, seed=9)
    assert sample.agree == sample.sets == 4


def test_agreement_allows_what_was_undecided_and_no_more():
    numbers = dict(zip(("lost1", "lost2", "apart1", "apart2"), "1234", strict=True))
    texts = {"satisfied": "c1", "undecided": "0", "hammers": "c/c", "spread": "0"} | numbers
    row = Row("valid", **texts, verdicts="y" * len(VERDICTS))
    assert ensemble.agrees(row, row)
    assert ensemble.agrees(row, row._replace(verdicts="?" + row.verdicts[1:]))
    assert not ensemble.agrees(row, row._replace(verdicts="n" + row.verdicts[1:]))
    assert not ensemble.agrees(row, row._replace(satisfied="c0"))
    assert ensemble.agrees(row._replace(undecided="1"), row._replace(satisfied="c0"))
    assert not ensemble.agrees(row, row._replace(lost1="4"))
    assert ensemble.agrees(row._replace(spread="5"), row._replace(lost1="4"))
    assert not ensemble.agrees(row, Row("left"))


@needs_heyoka
def test_lasting_changes_of_contact_are_found_again():
    entries = lasting.read(DAMPED)
    one = entries[int(np.random.default_rng(4).integers(len(entries)))]
    numbers = population.some(population.drawn(), slice(one.number, one.number + 1))
    assert lasting.lasting(numbers) == one.cases


@pytest.mark.parametrize(
    ("holds", "total", "low", "high"),
    [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611)],
)
def test_shares_have_the_intervals_of_newcombe(holds, total, low, high):
    """Newcombe (1998), Table I, method 3."""
    one = ensemble.share(["y"] * holds + ["n"] * (total - holds) + ["-"] * 7)
    assert one.sets == total
    assert one.interval == pytest.approx((low, high), abs=5e-5)
    wider = ensemble.share(["y"] * holds + ["n"] * (total - holds - 3) + ["?"] * 3)
    assert wider.interval[0] == one.interval[0]
    assert wider.interval[1] > one.interval[1]
    assert ensemble.share(["-"]) is None


def frictionless(mirror: bool, model: str) -> Scene:
    """A pad without friction that starts aside, or the same seen from behind."""
    springs = {"k1": 1.0, "k2": 1.0, "alpha1": 2.1, "alpha2": 2.6, "L1": 1.3, "L2": 0.9}
    contact = {"k3": 0.4, "k4": 0.9} if model == "B1" else {"k_c": 0.8, "y0": -0.01}
    sign = -1.0 if mirror else 1.0
    given = springs | contact
    if mirror:
        names = {"1": "2", "2": "1", "3": "4", "4": "3"}
        given = {key[:-1] + names.get(key[-1], key[-1]): value for key, value in given.items()}
    pad = Pad(m=1.0, w=1.0, h=0.5, I=0.4, mu=0.0, F_n=0.01, **given)
    start = (sign * 0.02, 0.03, sign * 0.015, 0.0, 0.0, 0.0)
    return Scene(model, pad, initial=start, stop=40.0, samples=2, tolerance=1e-12)


@pytest.mark.parametrize("model", MODELS)
def test_a_mirrored_case_is_that_of_the_mirrored_pad(model):
    """Without friction a pad seen from behind is the pad with its springs in each other's place."""
    there = mirrored(measure(frictionless(False, model)), model == "B2")
    behind = measure(frictionless(True, model))
    for field in dataclasses.fields(behind):
        if field.name == "mean" and model == "B1":
            continue  # of F3 alone, which does not know that of F4
        one = getattr(there, field.name)
        two = getattr(behind, field.name)
        if field.name in ("losses", "blows"):
            assert one == two
        elif field.name in ("first", "second", "together", "tilt"):
            assert (one.low, one.high) == pytest.approx(
                (two.low, two.high), rel=1e-5, abs=1e-9, nan_ok=True
            )
        else:
            assert one == pytest.approx(two, rel=1e-6, abs=1e-9, nan_ok=True)


def test_shuffled_statements_are_those_of_other_cases():
    claim = next(one for one in CLAIMS if one.id == "B1-d-mostly-full")
    names: Any = {f"b1-{letter}": i for i, letter in enumerate(LETTERS)}
    seen: list[Any] = []
    spy = dataclasses.replace(claim, rule=lambda one: seen.append(one))
    Arrangement(b1="bcda").outcome(spy, names)
    PRINTED.outcome(spy, names)
    assert seen == [0, 3]
    assert PRINTED.outcome(claim, {}) is None
    for seed in range(1, 21):
        one = shuffled(seed)
        assert one == shuffled(seed)
        assert sorted(one.b1) == sorted(one.b2) == [*LETTERS]
        assert LETTERS not in (one.b1, one.b2)


@needs_heyoka
def test_stored_searches_end_where_they_say():
    chosen = np.random.default_rng(2).choice(len(STORED), 4, replace=False)
    for one in (STORED[i] for i in chosen.tolist()):
        far, ids = control.satisfied(one.numbers, one.arrangement)
        assert ids == one.satisfied
        assert far == pytest.approx(one.distance, abs=2e-3)
        expected = shuffled(one.seed) if one.kind == "shuffled" else PRINTED
        assert one.arrangement == expected


def test_every_planned_search_is_stored_once():
    assert [(one.kind, one.seed) for one in STORED] == [*control.planned()]
