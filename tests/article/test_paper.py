"""The paper: every sentence that a study checks stops the build once it is wrong."""

import dataclasses
import json
import re

import pytest

from squeal.article.report import __main__ as report
from squeal.article.report import values
from squeal.article.studies import angles, hammering, quasi_static, sets
from squeal.errors import ComputationError, InputError
from tests.conftest import ROOT

PAPER = {name: (ROOT / "paper" / name).read_text(encoding="utf-8") for name in report.TEXTS}
NUMBERS = {"h": 0.59, "mu": 0.32}
FLAT = {"h": 0.2, "mu": 0.59}
C_ONLY = {"a": None, "b": None, "c": 0.2, "d": None}
NONE = dict.fromkeys("abcd")


def one_set(numbers=FLAT, satisfied=14, line=("c",), critical=NONE, lasting=(0.0, 0.0)):
    return sets.ParameterSet(
        numbers=numbers,
        satisfied=satisfied,
        failing=(),
        hammering={"B1": ("c", "d"), "B2": line},
        critical=critical,
        points=NONE,
        lost={"B1": 0.3, "B2": 0.1},
        lasting=dict(zip(("B1", "B2"), lasting, strict=True)),
    )


def four_sets(**changes):
    found = {
        "reference": one_set(NUMBERS, critical=C_ONLY, lasting=(0.8, 0.7)),
        "set-2": one_set(),
        "set-3": one_set(line=(), lasting=(1.0, 0.0)),
        "set-4": one_set(satisfied=15),
    }
    for name, change in changes.items():
        key = name.replace("_", "-")
        found[key] = dataclasses.replace(found[key], **change)
    return sets.Sets(sets=found, statements=16)


D_ALONE = {"B1": ("d",), "B2": ("d",)}
BROKEN = [
    ("three-flat-sets", {"set_2": {"numbers": NUMBERS}}),
    ("one-set-satisfies-all-that-can-hold", {"set_4": {"satisfied": 13}}),
    ("flat-sets-need-much-friction", {"set_3": {"numbers": FLAT | {"mu": 0.3}}}),
    (
        "line-hammers-in-c-alone-in-three-sets",
        {"set_3": {"hammering": {"B1": ("d",), "B2": ("d",)}}},
    ),
    ("points-hammer-in-d-in-every-set", {"set_2": {"hammering": {"B1": (), "B2": ("c",)}}}),
    ("points-lose-more-in-every-set", {"set_4": {"lost": {"B1": 0.1, "B2": 0.2}}}),
    ("only-c-flutters", {"reference": {"critical": NONE}}),
    ("no-point-contact-flutters", {"reference": {"points": C_ONLY}}),
    ("flutter-explains-the-reference-alone", {"set_2": {"critical": C_ONLY}}),
    ("coexistence-depends-on-the-set", {"set_2": {"lasting": {"B1": 1.0, "B2": 1.0}}}),
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
    named = {s for text in PAPER.values() for s in report.SAYS.findall(text)}
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
        for _, key in values.ASKED.findall(text):
            assert not key.endswith(("measured", "statement", "outcome"))
