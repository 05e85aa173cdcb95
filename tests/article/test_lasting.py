"""Sentences and tables on what lasts and what hammers."""

import dataclasses

import pytest

from squeal.article.report.lasting import hammer_table, lasting_table
from squeal.article.report.onset import generated
from squeal.article.results.records import Missing
from tests.article.onset import QUIET, SILENT, made, others, settled_one


def test_beside_rest_is_a_sliding_motion_at_a_stable_equilibrium():
    one = others(3)
    assert one.beside
    assert not others(3, growth=0.1).beside
    assert not QUIET.beside
    assert not dataclasses.replace(one, growth=None).beside
    assert not dataclasses.replace(one, liveliest=settled_one(0.4, face=2.0)).beside


@pytest.mark.parametrize(
    ("given", "key", "words"),
    [
        ({}, "lasts", "B2 (c), printed law at"),
        ({"law": False}, "lasts", "changing in B2 (c) under both laws at"),
        ({"lasts": False, "law": True}, "lasts", "no contact changes"),
        ({"peak": 0.0, "law": True}, "lasts", "no contact changes"),
        ({}, "hammer", "no case goes on hammering, by either rule"),
        (
            {"hammers": True},
            "hammer",
            r"hammering: (c) with both models at 0.5\,\%, by either rule of B2",
        ),
        (
            {"b1": others(3, 3, 3), "printed": others(3, 2, 1)},
            "hammer",
            r"(* from some of 25 other starts): (c)* with both models at 0.5\,\%, by either rule",
        ),
        (
            {"printed": others(3, 0, 3)},
            "hammer",
            r"(c)* with B2 alone, by the edges at 0.5\,\%",
        ),
        (
            {"b1": others(3, 3, 3), "printed": others(3, 2, 0)},
            "hammer",
            r"with both models, by $\delta$ at 0.5\,\%, with B1 alone, by the edges at 0.5\,\%",
        ),
        ({"printed": others(3, 0, 3)}, "hammer", "B2 under the integral law from none)"),
        (
            {"b1": others(3, 3, 3)},
            "hammer",
            r"(c)* with B1 alone at 0.5\,\%",
        ),
        (
            {"integral": others(3, 3, 3)},
            "hammer",
            r"(c)* with B2 under the integral law at 0.5\,\% alone",
        ),
        ({}, "early", "in windows 0 to 1 and 1 to 3 no case hammers with both models"),
        (
            {"b1": others(early=(True, True)), "printed": others(early=(True, True))},
            "early",
            r"in windows 0 to 1 and 1 to 3 (c) hammers with both models at $\zeta =$ 0.5\,\%",
        ),
        # each span by itself
        (
            {"b1": others(early=(True, False)), "printed": others(early=(True, True))},
            "early",
            r"0 to 1 (c) hammers with both models at $\zeta =$ 0.5\,\%, in windows 1 to 3 no case",
        ),
        (
            {"b1": others(early=(True, False)), "printed": others(early=(False, True))},
            "early",
            "in windows 0 to 1 and 1 to 3 no case hammers with both models",
        ),
        (
            {"hammers": True},
            "turns",
            r"by the one rule of B1 in B1 (c) at $\zeta =$ 0.5\,\%; by both rules of B2 in B2 (c)",
        ),
        ({"printed": others(3, 0, 3), "lasts": False}, "turns", "by the edges alone in B2 (c)"),
        ({"printed": others(3, 3, 0), "lasts": False}, "turns", r"by $\delta$ alone in B2 (c)"),
        ({}, "turns", r"on and on without hammering in B2 (c), printed law"),
        ({"b1": others(3)}, "lasts", r"; from other starts in B1 (c) at"),
        (
            {"printed": others(3)},
            "law",
            r"printed law in B2 (c) at $\zeta =$ 0.5\,\% (3 against 0).",
        ),
        ({"printed": others(3)}, "law", "is the cause is not shown"),
        (
            {"integral": others(3)},
            "law",
            r"integral law in B2 (c) at $\zeta =$ 0.5\,\% (3 against 0).",
        ),
        ({}, "law", "As many starts go on"),
        ({"b1": others(3)}, "beside", r"of B1 (c) at $\zeta =$ 0.5\,\% is stable"),
        ({"b1": others(3, growth=0.1)}, "beside", "No motion goes on beside a stable"),
        ({"growth": -0.1}, "beside", "is stable: contact goes on changing beside it"),
        ({}, "beside", "No motion goes on beside a stable"),
    ],
)
def test_sentences_on_what_lasts_follow_the_numbers(given, key, words):
    values, _ = generated(made(**given), SILENT)
    assert words in values[f"onset.{key}"]


def test_tables_tell_what_lasts_and_what_hammers():
    found = made()
    table = lasting_table(found)
    assert r"own & 0/25 & 40\,\% & $2$ & $-1.00$ to $0.50$ & 0 & no & no" in table
    away = lasting_table(made(b1=others(3, 3, 3)))
    assert r"B1 (c) & 0.5\,\% & other & 3/25 & 40\,\%" in away
    assert "c (3/25)" in hammer_table(made(b1=others(3, 3, 3)))
    hammering = hammer_table(made(hammers=True, printed=others(early=(True, False))))
    assert "& 0 to 1 & 1 to 3 & late" in hammering
    assert "& c & -- & c &" in hammering
    assert "B2 (c), integral law" not in table  # it comes to keep its contact
    assert "off the surface" in lasting_table(made(peak=0.0))
    ended = dataclasses.replace(
        found,
        late=found.late | {"b1-a": (Missing("the model ends"),)},
        others=found.others | {"b1-a": ()},
    )
    assert "the model ends" in lasting_table(ended)
