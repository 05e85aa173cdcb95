"""Formulations compared by their ensembles."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import fisher_exact as fisher

from squeal.article.claims import CLAIMS
from squeal.article.ensembles.comparison import (
    by_choice,
    corrected,
    distances,
    exchanged,
    keeping,
    sampled_distances,
)
from squeal.article.ensembles.distance import INDEX, judge
from squeal.article.ensembles.gather import CONCLUSIONS, read_kept
from squeal.article.ensembles.space import DIMENSIONS, FORMULATIONS, decode
from squeal.article.report.chapters import ENSEMBLES
from squeal.article.studies import ensembles as studied
from squeal.model.contact import CONSISTENT, FORMULATION_CHOICES, Formulation
from tests.conftest import ROOT, needs_heyoka


@pytest.fixture(scope="module")
def numbers():
    return decode(np.random.default_rng(5).uniform(size=(48, len(DIMENSIONS))))


@needs_heyoka
def test_distances_from_stored_margins_are_those_of_the_judging(numbers):
    whole = judge(numbers, CONSISTENT)
    margins, loads = whole.margins[whole.whole], numbers["F_n"][whole.whole]
    assert distances(margins, loads) == pytest.approx(whole.partial[whole.whole, -1])
    without = distances(margins, loads, ("B12-sliding",))
    slid = margins[:, INDEX["B12-sliding"]] > 0.0
    assert without[slid] == pytest.approx(distances(margins[slid], loads[slid]))
    assert np.all(distances(margins, loads)[~slid] - without[~slid] >= 1.0)


@pytest.mark.parametrize(("shift", "least", "most"), [(0.0, 0.05, 1.0), (3.0, 0.0, 1e-3)])
def test_searches_are_exchanged_between_formulations_that_differ_in_one_switch(shift, least, most):
    """Other switches shift the values by ten: unstratified, a shift of three would be lost."""
    random = np.random.default_rng(2)
    values = random.normal(size=(8, 5))
    for i, f in enumerate(FORMULATIONS):
        values[i] += 10.0 * (f.delta_moment == "+") + 5.0 * (f.line_force == "mean")
        values[i] += shift * (f.delta_from == "frame")
    means, p, better = exchanged(values, "delta_from")
    assert least <= p <= most
    assert means["frame"] - means["centre"] == pytest.approx(shift, abs=1.0)
    assert better == 0 or not shift


def test_the_chance_of_an_exchange_is_that_of_all_exchanges():
    """One pair of formulations tells: 2 of the C(4, 2) = 6 halvings are as far apart."""
    values = np.zeros((8, 2))
    one, two = (
        next(i for i, f in enumerate(FORMULATIONS) if f == Formulation("integral", d, "+"))
        for d in ("centre", "frame")
    )
    values[one], values[two] = (0.0, 1.0), (2.0, 3.0)
    _, p, better = exchanged(values, "delta_from")
    assert p == pytest.approx(2 / 6, abs=0.02)
    assert better == 0


def test_holms_correction_by_hand():
    assert corrected([0.04, 0.01, 0.03]) == pytest.approx([0.06, 0.03, 0.06])
    assert corrected([0.9, 0.5, 0.4]) == pytest.approx([1.0, 1.0, 1.0])


def test_equal_pads_count_once_and_searches_are_counted(tmp_path):
    kept = read_kept(ROOT / ENSEMBLES)
    sample, sampled = kept.sample.copy(), np.full_like(kept.sampled, -1.0)
    sample[0, 0] = sample[0, 0, 0]  # one pad forty times
    sampled[0, 0] = 1.0
    made = replace(kept, sample=sample, sampled=sampled)
    found = keeping(made, [0], ("B2-only-c", "B2-c-hammer"))
    others = sum(len(np.unique(points, axis=0)) for points in sample[0, 1:])
    assert (found.pads, found.keep) == (1 + others, 1)
    assert (found.searches, found.keeping) == (sample.shape[1], 1)


def test_random_pads_are_split_by_the_choices_of_a_switch():
    kept = read_kept(ROOT / ENSEMBLES)
    for switch, choices in FORMULATION_CHOICES.items():
        found = by_choice(kept, switch)
        for at, name in enumerate(CONCLUSIONS):
            each = dict.fromkeys(choices, 0)
            for f, n in zip(FORMULATIONS, kept.random_together[:, at].tolist(), strict=True):
                each[getattr(f, switch)] += n
            assert found.keep[name] == each
        assert sum(found.random.values()) == kept.random[..., 0].sum()
        assert sum(found.ran.values()) == kept.random[..., 1].sum()
        assert set(found.p) == set(CONCLUSIONS)
        one, other = choices
        for name, p in found.p.items():
            counts = [[n := found.keep[name][c], found.ran[c] - n] for c in (one, other)]
            assert p == pytest.approx(fisher(counts).pvalue, rel=1e-6)


def fake_judge(numbers: Any, *_: Any, **__: Any) -> Any:
    """All statements hold for a pad that is flat."""
    flat = numbers["h"] < np.median(numbers["h"])
    return SimpleNamespace(margins=np.where(flat[:, None], 1.0, -1.0) * np.ones(len(CLAIMS)))


def test_pads_judged_for_longer_are_drawn_from_each_search_that_keeps_a_conclusion(monkeypatch):
    """Search 2 has ten pads that do, search 4 two; equal ones count once."""
    kept = read_kept(ROOT / ENSEMBLES)
    number = FORMULATIONS.index(CONSISTENT)
    sample, sampled = kept.sample.copy(), np.full_like(kept.sampled, -1.0)
    for search, count in ((1, 10), (3, 2)):
        sampled[number, search, :count] = 1.0
        sample[number, search] = 0.5
        sample[number, search, :count, 0] = np.linspace(0.1, 0.8, count)
    made = replace(kept, sample=sample, sampled=sampled)
    monkeypatch.setattr(studied, "TRIED", 8)
    monkeypatch.setattr(studied, "judge", fake_judge)
    long = studied.longer(made)
    assert long is not None
    assert long.searches.tolist() == [1] * 4 + [3] * 2
    found = studied.conclusion(made, "hammering", long)
    assert [(one.search, one.tried) for one in found.lasting] == [(2, 4), (4, 2)]
    assert sum(one.keep for one in found.lasting) == 3
    assert studied.conclusion(made, "hammering", None).lasting == ()
    assert studied.longer(replace(made, sampled=np.full_like(sampled, -1.0))) is None


def test_the_distance_is_the_one_that_the_stored_searches_went_by():
    kept = read_kept(ROOT / ENSEMBLES)
    for number in range(len(FORMULATIONS)):
        # pads fill the level that they stay within
        far = sampled_distances(kept, number).max(axis=1) / kept.levels[number, :, -1]
        assert np.all((far > 0.998) & (far < 1.0 + 1e-5))


def test_stored_pads_keep_what_follows_from_other_statements():
    kept = read_kept(ROOT / ENSEMBLES)
    held = {name: kept.sampled[..., at] > 0.0 for name, at in INDEX.items()}
    seen = 0
    for claim in CLAIMS:
        by = claim.follows.by if claim.follows else ()
        if by:
            implying = np.all([held[name] for name in by], axis=0)
            if claim.id == "B2-b-tilt":  # with delta from the mass centre only
                implying = implying[[f.delta_from == "centre" for f in FORMULATIONS]]
                own = held[claim.id][[f.delta_from == "centre" for f in FORMULATIONS]]
            else:
                own = held[claim.id]
            assert own[implying].all(), claim.id
            seen += int(implying.sum())
    assert seen > 1000
