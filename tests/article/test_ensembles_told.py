"""What the chapter on ensembles says follows from its result file."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from squeal.article.ensembles import choosing
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
from squeal.io.provenance import NOT_INSTALLED
from squeal.model.contact import CONSISTENT
from tests.article import known
from tests.conftest import ROOT


def stored(**given: Any) -> Ensembles:
    return replace(known.of(Ensembles), **given)


def with_seeds(**given: Any) -> Ensembles:
    found = stored()
    return stored(
        ensembles=tuple(
            replace(e, seeds=tuple(replace(s, **given) for s in e.seeds)) for e in found.ensembles
        )
    )


def told(found: Ensembles, name: str) -> str:
    return generated(found, known.of(Findings))[0][f"ensembles.{name}"]


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


def test_what_is_kept_with_delta_from_the_centre_is_told_apart():
    def better(e: Ensemble) -> Ensemble:
        most = tuple(replace(s, most=replace(s.most, counted=13)) for s in e.seeds)
        return replace(e, best=replace(e.best, counted=8), seeds=most)

    found = stored()
    made = (better(e) if e.formulation.delta_from == "frame" else e for e in found.ensembles)
    values, _ = generated(replace(found, ensembles=tuple(made)), known.of(Findings))
    assert (values["ensembles.chance"], values["ensembles.chance-centre"]) == ("8", "3")
    assert (values["ensembles.best"], values["ensembles.best-centre"]) == ("13", "12")


def test_islands_and_copies_are_told():
    assert "Each search ends on an island" in told(with_seeds(width=0.1), "islands")
    assert "spread nearly as far" in told(with_seeds(width=0.8), "islands")
    assert "repeated, until 3 are left" in told(with_seeds(distinct=3), "islands")
    assert "repeated" not in told(stored(), "islands")
    assert told(with_seeds(distinct=1), "copies") == "40 of 40"
    assert told(with_seeds(distinct=2), "copies") == told(stored(), "copies") == "none of 40"
    assert told(with_seeds(distinct=1, stored=1), "copies") == "none of 40"
    assert "none of them found it" in told(with_seeds(nearest=3.5), "rival")
    assert "stored of 5 of the 5 searches" in told(with_seeds(nearest=2.5), "rival")


def test_statements_that_nearly_are_one_are_told():
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


def test_what_is_outside_and_beside_the_pad_of_the_report_is_told():
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


def test_what_differs_when_judged_again_is_told():
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


def test_how_the_pad_of_the_report_was_come_by_is_told():
    assert "that (c) alone hammers was sought" in told(stored(chosen_from=ELSEWHERE), "sought")
    assert "It is that of here" in told(stored(chosen_from="here"), "sought")
    tied = {"equal": 3, "first_equal": 1, "least": 12}
    assert "compared: it keeps" in told(stored(equal=1, first_equal=1), "sought")
    assert "(of 3 that tie for the last place, this pad, listed" in told(stored(**tied), "sought")
    others = stored(**{**tied, "least": 11, "first_equal": 2})
    assert "(of 3 that tie for the last 2 places, those listed first)" in told(others, "sought")


def test_what_statements_confine_is_told():
    few, pads = stored(), stored().chosen
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
    words = told(stored(fronts=fronts), "front")
    assert "21 keep all three" in words
    assert "they are 17 of the consistent law (integral, centre, $+$) and 4 of (" in words
    assert "none of the 600 of the other 6" in words
    every = tuple(replace(f, together=(0, 0, 0, 1)) for f in fronts)
    assert "none of" not in told(stored(fronts=every), "front")


def test_a_number_without_effect_has_no_range():
    row = next(line for line in range_table(stored()).splitlines() if line.startswith("$x_0/w$"))
    assert row.count("no effect") == 2


@pytest.mark.parametrize(("off", "words"), [(0.04, "carry that"), (0.001, "changes little")])
def test_what_stored_peaks_carry_is_told(off, words):
    check = replace(stored().check, peaks=(1e-4, off))
    assert words in told(stored(check=check), "coarse")


def test_the_probability_of_as_many():
    assert at_least(0, 4, 0.3) == pytest.approx(1.0)
    assert at_least(4, 4, 0.3) == pytest.approx(0.3**4)
    assert at_least(1, 4, 0.3) == pytest.approx(1.0 - 0.7**4)


def test_points_within_half_of_a_range_by_chance():
    points = np.random.default_rng(4).uniform(size=(40_000, 5))
    seen = (np.ptp(points, axis=1) < 0.5).mean()
    assert half_by_chance(5) == pytest.approx(seen, abs=0.01)


@pytest.mark.parametrize(("listed", "words"), [(28, "all that can hold together"), (27, "not all")])
def test_the_sentence_on_the_most_follows_the_count(listed, words):
    pads = {
        law: replace(pad, horizons=pad.horizons | {"1": Kept(30, listed, 18)})
        for law, pad in stored().most.items()
    }
    for plausible, like in ((True, "such as an"), (False, "not one that an")):
        together = told(stored(most=pads, plausible=plausible), "together")
        assert words in together
        assert like in together


def test_how_long_the_pad_with_most_statements_lasts_is_told():
    found = stored()
    pad = found.most["consistent"]
    ends = {**found.most, "consistent": replace(pad, horizons={**pad.horizons, "40": None})}

    words = "over one window (18 over 3, 18 over 10, 18 over 40), with"
    assert words in told(found, "together")
    words = "18 over 10, its motion leaves the model within 40), with"
    assert words in told(stored(most=ends), "together")
