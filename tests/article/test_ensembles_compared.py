"""Formulations compared by their ensembles, and the sentences that follow from it."""

import dataclasses
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import fisher_exact as fisher

from squeal.article.claims import CLAIMS
from squeal.article.ensembles import choosing
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
from squeal.article.report.contrasts import of_levels, of_random
from squeal.article.report.ensembles import (
    at_least,
    generated,
    half_by_chance,
    pad_table,
    range_table,
)
from squeal.article.report.pads import kept_briefly
from squeal.article.results.ensembles import ELSEWHERE, Contrast, Ensemble, Ensembles, Kept
from squeal.article.results.findings import Findings
from squeal.article.results.robustness import Share
from squeal.article.results.verify import Switches
from squeal.article.studies import ensembles as studied
from squeal.files.provenance import NOT_INSTALLED
from squeal.model.contact import CONSISTENT, FORMULATION_CHOICES, Formulation
from tests.article import known
from tests.conftest import ROOT, needs_heyoka


@pytest.fixture(scope="module")
def numbers():
    return decode(np.random.default_rng(5).uniform(size=(48, len(DIMENSIONS))))


def test_without_heyoka_the_chapter_stands_on_what_is_stored(monkeypatch):
    monkeypatch.setattr(studied, "version", lambda _: NOT_INSTALLED)
    for module in (studied, choosing):
        monkeypatch.setattr(module, "judge", None)  # would simulate
    found = studied.study([ROOT / ENSEMBLES])
    assert "heyoka is not installed" in found.left_out
    assert not found.wrong
    values, tables = generated(found, known.of(Findings))
    assert values["ensembles.left-out"].startswith("Left out here")
    assert "ensembles.rival" not in values
    assert kept_briefly(found, "hammering").startswith("Kept over one window")
    assert "No pad is judged afresh" in values["ensembles.hammering.kept"]
    assert tables["ensemble-searches"].count("--, --, --, --") == 8


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


def contrast(**given: Any) -> Contrast:
    (one,) = (c for c in stored().contrasts if c.switch == "delta_from")
    return replace(one, better=1, pairs=4, **given)


def judged_contrast(p: float, p_unslid: float, other: bool = False) -> str:
    unslid = {"centre": 9.0, "frame": 8.0} if other else {"centre": 8.0, "frame": 9.0}
    levels = {"centre": 8.0, "frame": 9.0}
    return of_levels(contrast(levels=levels, p=p, unslid=unslid, p_unslid=p_unslid))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ((0.01, 0.01), "also without the statement on sliding"),
        ((0.01, 0.01, True), "with the assumed speed of the surface only"),
        ((0.01, 0.4), "with the assumed speed of the surface only"),
        ((0.4, 0.4), "no difference of the levels is shown"),
        ((0.4, 0.01, True), r"without the statement on sliding one is, $\delta$ in the fixed"),
    ],
)
def test_what_a_switch_does_is_told_with_and_without_sliding(given, words):
    assert words in judged_contrast(*given)
    assert "nearer in 3 of the 4 pairs" in judged_contrast(*given)


def test_what_random_pads_keep_with_either_choice_is_told_beside_the_levels():
    conclusions = stored().conclusions
    words = of_random(contrast(), conclusions)
    assert (
        r"90 each, 70 and 60 run; of those that run 13\,\% and 5\,\% keep all statements on "
        r"hammering ($p = 0.01$), whatever the speed; no difference in all statements on "
        r"exaggeration is shown ($p = 0.2$)."
    ) in words
    slid = {n: replace(c, statements=("B12-sliding",)) for n, c in conclusions.items()}
    assert "whatever" not in of_random(contrast(), slid)
    both = of_random(contrast(p_keep={"hammering": 0.01, "exaggeration": 0.02}), conclusions)
    assert "all statements on exaggeration ($p = 0.02$)" in both
    assert "no difference" not in both
    same = contrast(p_keep={"hammering": 0.3, "exaggeration": 0.2388})
    assert (
        "no difference in all statements on hammering or on exaggeration is shown "
        r"($p \ge 0.23$)."
    ) in of_random(same, conclusions)


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


def stored(**given: Any) -> Ensembles:
    return replace(known.of(Ensembles), **given)


def with_seeds(**given: Any) -> Ensembles:
    found = stored()
    return stored(
        ensembles=tuple(
            replace(e, seeds=tuple(replace(s, **given) for s in e.seeds)) for e in found.ensembles
        )
    )


def test_what_is_kept_with_delta_from_the_centre_is_told_apart():
    def better(e: Ensemble) -> Ensemble:
        most = tuple(replace(s, most=replace(s.most, counted=13)) for s in e.seeds)
        return replace(e, best=replace(e.best, counted=8), seeds=most)

    found = stored()
    made = (better(e) if e.formulation.delta_from == "frame" else e for e in found.ensembles)
    values, _ = generated(replace(found, ensembles=tuple(made)), known.of(Findings))
    assert (values["ensembles.chance"], values["ensembles.chance-centre"]) == ("8", "3")
    assert (values["ensembles.best"], values["ensembles.best-centre"]) == ("13", "12")


def test_sentences_on_ensembles_follow_the_file():
    def told(found: Ensembles, name: str) -> str:
        return generated(found, known.of(Findings))[0][f"ensembles.{name}"]

    assert "Each search ends on an island" in told(with_seeds(width=0.1), "islands")
    assert "spread nearly as far" in told(with_seeds(width=0.8), "islands")
    assert "repeated, until 3 are left" in told(with_seeds(distinct=3), "islands")
    assert "repeated" not in told(stored(), "islands")
    assert told(with_seeds(distinct=1), "copies") == "40 of 40"
    assert told(with_seeds(distinct=2), "copies") == told(stored(), "copies") == "none of 40"
    assert told(with_seeds(distinct=1, stored=1), "copies") == "none of 40"
    assert "none of them found it" in told(with_seeds(nearest=3.5), "rival")
    assert "stored of 5 of the 5 searches" in told(with_seeds(nearest=2.5), "rival")
    two = stored().twins
    assert "so that B2-b-tilt is not counted" in told(stored(), "twins")
    assert "random" not in told(stored(), "twins")
    pads_drawn = [
        replace(e, random=10_000, chance=e.chance | {"B2-b-tilt": share})
        for e, share in zip(
            stored().ensembles, [Share(n, (0.0, 1.0)) for n in (0.19, 0.23) * 4], strict=True
        )
    ]  # of 2000 of 10 000
    own = [e for e in pads_drawn if e.formulation.delta_from == "centre"]
    least = sum(100 if e.chance["B2-b-tilt"].share == 0.19 else 300 for e in own)
    apart = rf"; of random ones at least {least} of 40\,000 differ)"
    assert apart in told(stored(ensembles=tuple(pads_drawn)), "twins").replace("1\\,", "1")
    both = stored(counted=("B2-b-trailing", "B2-b-tilt"))
    assert "one of them should not" in told(both, "twins")
    assert "nearly are" in told(stored(twins=replace(two, agree=79)), "twins")
    assert "told apart" in told(stored(twins=replace(two, agree=40)), "twins")
    pads = stored().chosen
    pad = pads["consistent"]

    def taken(**given: Any) -> Ensembles:
        return stored(chosen={**pads, "consistent": replace(pad, **given)})

    assert "lies within them" in told(stored(), "outside")
    far = taken(numbers={**pad.numbers, "mu": 0.9})
    assert r"outside them with $\mu$ ($0.9$, searched" in told(far, "outside")
    slid = taken(failing={**pad.failing, "1": ("B12-sliding",), "40": None})
    assert "its sliding stops" in told(slid, "beside")
    assert "loses B2-d-trailing" in told(slid, "beside")
    assert "over 40 its motion leaves" in told(slid, "beside")
    assert "its sliding goes on" in told(stored(), "beside")
    law, speed = stored().taken, 1.5
    at = {name: replace(one, least_speed=speed) for name, one in pads.items()}
    found = stored(chosen={**at, "other": at[law]})
    assert r"its lower face, which rubs, $3$\,m/s" in told(found, "beside")  # E16 of known: twice
    rows = pad_table(found, known.of(Findings)).splitlines()
    assert r"$1.5$\,m/s & $3$\,m/s &" in next(row for row in rows if row.startswith(law))
    assert r"$1.5$\,m/s & -- &" in next(row for row in rows if row.startswith("other"))
    still = known.of(Findings)
    (sliding,) = still.findings
    still = replace(still, findings=(replace(sliding, measured={"greatest": 0.0, "face": 0.0}),))
    assert "lower face" not in generated(found, still)[0]["ensembles.beside"]
    assert r"$3$\,m/s" not in pad_table(found, still)
    one = stored().check
    for which in ((), ("B2-d-trailing (margin 1 stored, -1 now)",), ("a", "b")):
        count = len(which)
        again = replace(one, different=count, which=which, as_now=count, unjudged=("B3-none",))
        text = told(stored(check=again), "differ")
        assert ("none differs", "one differs", "2 differ")[count] in text
        assert "B3-none is not judged" in text
        assert ("so that the coarser samples" in text) == bool(which)
        again = replace(again, as_now=0, unjudged=())
        text = told(stored(check=again), "differ")
        assert "coarser" not in text
        assert "not judged" not in text
    assert "that (c) alone hammers was sought" in told(stored(chosen_from=ELSEWHERE), "sought")
    assert "It is that of here" in told(stored(chosen_from="here"), "sought")
    tied = {"equal": 3, "first_equal": 1, "least": 12}
    assert "compared: it keeps" in told(stored(equal=1, first_equal=1), "sought")
    assert "(of 3 that tie for the last place, this pad, listed" in told(stored(**tied), "sought")
    others = stored(**{**tied, "least": 11, "first_equal": 2})
    assert "(of 3 that tie for the last 2 places, those listed first)" in told(others, "sought")
    few = stored()
    narrow = {
        law: {
            n: replace(r, width=0.1 if n in ("h", "k2", "mu", "L") else 0.9) for n, r in r.items()
        }
        for law, r in few.ranges.items()
    }
    words = told(stored(ranges=narrow), "confined")
    assert "lie within half of the searched range" in words
    assert "thus confine some numbers; with 9 left free" in words
    assert words.startswith("Of 13 numbers that have an effect")
    assert "is not shown" in told(few, "confined")
    every = {law: {n: replace(v, width=0.1) for n, v in r.items()} for law, r in few.ranges.items()}
    assert "confine all numbers" in told(stored(ranges=every), "confined")
    assert told(stored(ranges=narrow), "corner").endswith("of the confined not $L/w$")
    assert told(few, "corner") == "8 of 16"
    flat = {law: replace(p, numbers=p.numbers | {"tilt": 0.0}) for law, p in pads.items()}
    assert told(stored(chosen=flat), "zero") == r"B2 preload, $\theta_0$ and B1 preload stay zero"


def test_what_keeps_three_statements_is_counted_by_formulation():
    found = stored()
    own = Switches.of(CONSISTENT)
    keeping = {own: 17, found.fronts[-1].formulation: 4}
    fronts = tuple(
        replace(f, pads=100, together=(0, 0, 0, keeping.get(f.formulation, 0)))
        for f in found.fronts
    )
    words = generated(stored(fronts=fronts), known.of(Findings))[0]["ensembles.front"]
    assert "21 keep all three" in words
    assert "they are 17 of the consistent law (integral, centre, $+$) and 4 of (" in words
    assert "none of the 600 of the other 6" in words
    every = tuple(replace(f, together=(0, 0, 0, 1)) for f in fronts)
    assert (
        "none of" not in generated(stored(fronts=every), known.of(Findings))[0]["ensembles.front"]
    )


def test_a_number_without_effect_has_no_range():
    row = next(line for line in range_table(stored()).splitlines() if line.startswith("$x_0/w$"))
    assert row.count("no effect") == 2


@pytest.mark.parametrize(("off", "words"), [(0.04, "carry that"), (0.001, "changes little")])
def test_what_stored_peaks_carry_is_told(off, words):
    check = replace(stored().check, peaks=(1e-4, off))
    assert words in generated(stored(check=check), known.of(Findings))[0]["ensembles.coarse"]


def test_the_probability_of_as_many():
    assert at_least(0, 4, 0.3) == pytest.approx(1.0)
    assert at_least(4, 4, 0.3) == pytest.approx(0.3**4)
    assert at_least(1, 4, 0.3) == pytest.approx(1.0 - 0.7**4)


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


def test_points_within_half_of_a_range_by_chance():
    points = np.random.default_rng(4).uniform(size=(40_000, 5))
    seen = (np.ptp(points, axis=1) < 0.5).mean()
    assert half_by_chance(5) == pytest.approx(seen, abs=0.01)


@pytest.mark.parametrize(("listed", "words"), [(28, "all that can hold together"), (27, "not all")])
def test_the_sentence_on_the_most_follows_the_count(listed, words):
    found = known.of(Ensembles)
    pads = {
        law: dataclasses.replace(pad, horizons=pad.horizons | {"1": Kept(30, listed, 18)})
        for law, pad in found.most.items()
    }
    for plausible, like in ((True, "such as an"), (False, "not one that an")):
        values, _ = generated(
            dataclasses.replace(found, most=pads, plausible=plausible), known.of(Findings)
        )
        assert words in values["ensembles.together"]
        assert like in values["ensembles.together"]


def test_how_long_the_pad_with_most_statements_lasts_is_told():
    found = stored()
    pad = found.most["consistent"]
    ends = {**found.most, "consistent": replace(pad, horizons={**pad.horizons, "40": None})}

    def told(most: dict[str, Any]) -> str:
        return generated(stored(most=most), known.of(Findings))[0]["ensembles.together"]

    assert "over one window (18 over 3, 18 over 10, 18 over 40), with" in told(found.most)
    assert "18 over 10, its motion leaves the model within 40), with" in told(ends)
