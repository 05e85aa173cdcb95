"""The paper: every sentence that a study checks stops the build once it is wrong."""

import dataclasses
import json
import re

import pytest

from squeal.article.cases import HISTORY_FIGURES
from squeal.article.report import __main__ as report
from squeal.article.report import values
from squeal.article.studies import angles, hammering, quasi_static, sets
from squeal.errors import ComputationError, InputError
from tests.conftest import ROOT

PAPER = {name: (ROOT / "paper" / name).read_text(encoding="utf-8") for name in report.TEXTS}
NUMBERS = {"h": 0.59, "mu": 0.32}
FLAT = {"h": 0.2, "mu": 0.59}
LINE_C = {"B1": (), "B2": ("c",)}
POINTS_A = {"B1": ("a",), "B2": ()}
LESS = {"B1": 0.3, "B2": 0.1, sets.TWO: 0.08}
SLOW = dict.fromkeys(HISTORY_FIGURES, 0.4)
FAST = dict.fromkeys(HISTORY_FIGURES, 1.2)
RARE = {"b2-c": 0.2, "b2-a": 0.01}
WIDE = {"B1": 0.3, "B2": 0.4, sets.TWO: 0.39}


def one_set(
    numbers=FLAT,
    satisfied=14,
    line=("c",),
    flutters=POINTS_A,
    lasting=None,
    growth=-1.0,
    ends=None,
    face=SLOW,
):
    return sets.ParameterSet(
        numbers=numbers,
        parameters={},
        satisfied=satisfied,
        failing=(),
        hammering={"B1": ("c", "d"), "B2": line},
        flutters=flutters,
        without={"B1": (), "B2": ("c",) if ends else ()},
        critical=0.2,
        ends=ends,
        lost=LESS,
        apart=WIDE,
        lasting=lasting or {},
        lasting_repeats={},
        growth=dict.fromkeys(lasting or {}, growth),
        face=face,
    )


def four_sets(**changes):
    made = {
        "reference": one_set(NUMBERS, flutters=LINE_C, lasting={"b1-d": 0.8, "b2-d": 0.8}),
        "set-2": one_set(ends=0.54, face=FAST),
        "set-3": one_set(line=(), lasting={"b2-a": 0.9}),
        "set-4": one_set(satisfied=15, lasting=RARE, face=SLOW | {"b2-c": 1.7}),
    }
    for name, change in changes.items():
        key = name.replace("_", "-")
        made[key] = dataclasses.replace(made[key], **change)
    return sets.Sets(sets=made, statements=16)


BROKEN = [
    ("four-sets-of-which-three-are-flat", {"set_2": {"numbers": NUMBERS}}),
    ("one-set-satisfies-all-that-can-hold", {"set_4": {"satisfied": 13}}),
    ("flat-sets-need-much-friction", {"set_3": {"numbers": FLAT | {"mu": 0.3}}}),
    (
        "c-alone-with-both-models-in-all-but-set-3",
        {"set_3": {"hammering": {"B1": ("d",), "B2": ("d",)}}},
    ),
    ("cases-differ-in-each-set", {"set_2": {"hammering": {"B1": (), "B2": ("c",)}}}),
    ("points-lose-more-in-every-set", {"set_4": {"lost": LESS | {"B1": 0.05}}}),
    ("edges-part-as-long-on-two-points", {"set_3": {"apart": WIDE | {sets.TWO: 0.3}}}),
    ("edges-part-as-long-on-two-points", {"set_3": {"lost": LESS | {sets.TWO: 0.2}}}),
    (
        "all-motions-of-set-2-and-one-of-set-4-outrun-the-surface",
        {"set_2": {"face": FAST | {"b2-b": 0.9}}},
    ),
    ("loss-from-full-contact-turns-the-order", {"set_4": {"apart": WIDE | {"B2": 0.2}}}),
    ("only-c-of-the-line-flutters", {"reference": {"flutters": POINTS_A}}),
    ("flat-sets-flutter-on-points-alone", {"set_2": {"flutters": LINE_C}}),
    ("c-of-set-2-alone-has-no-equilibrium", {"set_4": {"without": {"B1": (), "B2": ("d",)}}}),
    (
        "contact-goes-on-beside-stable-sliding-in-all-but-set-2",
        {"set_3": {"growth": {"b2-a": 1.0}}},
    ),
]


def test_the_premises_hold_together():
    assert all(sets.sentences(four_sets()).values())


@pytest.mark.parametrize(("name", "change"), BROKEN)
def test_a_broken_premise_stops_the_build_with_its_sentence(name, change, tmp_path):
    file = tmp_path / "sets.json"
    file.write_text(json.dumps(four_sets(**change).to_dict()))
    with pytest.raises(ComputationError, match=name):
        report.checked({"sets": file})
    assert rf"\says{{{name}}}" in PAPER["report.tex"]


def test_every_marked_sentence_is_checked_by_a_study():
    named = set()
    for text in PAPER.values():
        named.update(report.SAYS.findall(text))
    studies = ROOT / "squeal/article/studies"
    code = "".join(f.read_text(encoding="utf-8") for f in studies.glob("*.py"))
    assert named
    assert all(f'"{name}"' in code for name in named)
    for module in (angles, hammering, quasi_static, sets):
        assert callable(module.sentences)


def test_numbers_are_shown_as_asked():
    results = {"a": {"b": [0.12345, 3], "c": {"d": "yes"}, "e": 1.5e-7}}
    lines = values.definitions(
        {"t": r"\val{a.b.0} \val[p1]{a.b.0} \val[f2]{a.b.0} \val{a.b.1} \val{a.c.d} \val[2]{a.e}"},
        results,
    )
    shown = set(re.findall(r"\\setval\{.*?\}\{.*?\}\{(.*)\}\n", lines))
    assert shown == {"$0.123$", r"$12.3$\,\%", "$0.12$", "$3$", "yes", r"$1.5 \times 10^{-7}$"}
    with pytest.raises(InputError, match=r"paper.*a\.x"):
        values.definitions({"paper": r"\val{a.x}"}, results)


def test_no_clause_is_a_number():
    """What a macro holds is a number, a verdict or a name, never a sentence."""
    for text in PAPER.values():
        for _, key in values.VAL_MACRO.findall(text):
            assert not key.endswith(("measured", "statement", "outcome"))


def test_the_page_of_the_article_has_the_verdicts_of_the_paper():
    in_paper = re.findall(r"^(.*?) & \\verdict\{(.*?)\} &", PAPER["report.tex"], re.M)
    page = (ROOT / "docs" / "report.md").read_text(encoding="utf-8")
    table = page.split("| the article concludes | verdict |\n|---|---|\n")[1].split("\n\n")[0]
    on_page = re.findall(r"^\| (.*) \| (.*) \|$", table, re.M)
    assert on_page == in_paper
    assert len(on_page) == 10
