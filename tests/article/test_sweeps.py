"""Sentences on friction raised and lowered, and on the branch of cycles."""

import dataclasses

import pytest

from squeal.article.report.onset import generated
from squeal.article.results.records import Missing
from tests.article.onset import SILENT, made, step

FAST = {
    "up": (step(0.6), step(0.65, face=3.0), step(0.7, face=7.0)),
    "down": (step(0.6),),
    "beyond": (step(0.7, face=7.0), step(0.65, face=3.0), step(0.6)),
}


LIVELY = {
    "lively": (step(0.6, edges=True), step(0.65, hammers=True, edges=True), step(0.7)),
}


@pytest.mark.parametrize(
    ("given", "key", "words"),
    [
        ({"down": (step(0.7), step(0.6))}, "hysteresis", "with hysteresis"),
        ({}, "hysteresis", "without hysteresis"),
        (
            LIVELY,
            "hysteresis",
            r"last to 0.7. The liveliest motion of other starts goes on losing contact for "
            r"$\mu =$ 0.6 to 0.7 and hammers for $\mu =$ 0.65 by $\delta$ and $\mu =$ 0.6 to 0.65 "
            r"by the edges; from rest contact comes to be kept for $\mu =$ 0.6: hysteresis.",
        ),
        (
            {"lively": (step(0.7),)},
            "hysteresis",
            "without hysteresis in steps of that width. The liveliest motion of other starts goes "
            r"on losing contact for $\mu =$ 0.7 and hammers nowhere.",
        ),
        (
            LIVELY,
            "both",
            r"; from other starts, tried at the scene's $\mu$, B2 (c), printed law goes on losing",
        ),
        ({"up": (step(0.6, lost=0.0),), "down": ()}, "hysteresis", "no changes of contact last"),
        (FAST, "hysteresis", r"begin at $\mu = 0.6$; lowered from $\mu = 0.6$"),
        (FAST, "beyond", r"for $\mu =$ 0.65 to 0.7, up to 7 times as fast"),
        (FAST, "beyond", r"0.65 ($\zeta = 0.5\,\%$), some of it below the flutter threshold"),
        (FAST | {"threshold": 0.6}, "beyond", r"0.65 ($\zeta = 0.5\,\%$)."),
        (
            FAST | {"up": (*FAST["up"], step(0.72, lost=0.0))},
            "beyond",
            r" (contact comes to be kept for $\mu =$ 0.72)",
        ),
        ({}, "both", "begin with it, to a step, and hammering does not begin while"),
        ({"up": (step(0.7, hammers=True),)}, "both", "hammering begins with them"),
        (
            {"up": (step(0.65), step(0.7, hammers=True))},
            "both",
            r"hammering begins at $\mu = 0.7$ only",
        ),
        ({"up": (step(0.7, face=2.0, hammers=True),)}, "both", "do not begin with it"),
        ({"threshold": 0.6}, "both", r"lasting losses of contact begin at $\mu = 0.7$"),
        ({"threshold": None}, "both", "no equilibrium of the scenes flutters"),
        ({"growth": -0.1}, "both", "goes on losing contact beside a stable equilibrium"),
        ({}, "branch", "goes towards smaller $\\mu$, unstable"),
        ({"least": 0.71}, "branch", "goes towards greater $\\mu$."),
        ({"threshold": None}, "branch", "reaches down"),
        ({}, "cycle", "which agrees"),
        ({"decay": 0.8}, "cycle", "does not agree"),
        ({}, "cycle", "to $0.9$ of itself a period"),
        ({}, "caption", "(a): peak force over friction"),
        ({}, "caption", "(b): cycles of B2 (c), printed law"),
        ({"threshold": None}, "caption", "outside of the model. (b)"),
    ],
)
def test_sentences_on_friction_follow_the_numbers(given, key, words):
    values, _ = generated(made(**given), SILENT)
    assert words in values[f"onset.{key}"]


def test_a_pad_that_is_nowhere_faster_is_not_said_to_be():
    values, _ = generated(made(), SILENT)
    assert values["onset.beyond"] == ""
    assert "beside" not in values["onset.both"]


def test_without_a_cycle_the_reason_is_given():
    found = dataclasses.replace(made(), cycles=Missing("the motion does not return to itself"))
    values, _ = generated(found, SILENT)
    assert "does not return" in values["onset.cycle"]
