"""Rates of growth of neighbours: their errors, signs, table and sentences."""

import dataclasses
from typing import Any

import numpy as np
import pytest
from scipy.special import stdtrit

from squeal.article.report.onset import exponents_table, generated
from squeal.article.results import onset as results
from squeal.article.results.records import Missing
from squeal.article.studies import _attractors as attractors
from squeal.article.studies._damped import RATIO
from squeal.article.studies._neighbours import growth
from tests.article.onset import SILENT, made


def rows(*rates: float, left: int | None = None) -> np.ndarray:
    """Growth (80, starts) of deviations at a rate per stretch each, NaN after `left` stretches."""
    logs = np.tile(np.array(rates), (80, 1))
    if left is not None:
        logs[left:] = np.nan
    return logs


NOISE = np.random.default_rng(3).normal(size=(80, 2))


@pytest.mark.parametrize(
    ("logs", "signs", "windows"),
    [
        # each start by itself
        (rows(0.5, 0.0, -0.1), ["chaotic", "no growth", "no growth"], 400),
        (rows(0.5, 0.6, left=60), ["chaotic", "chaotic"], 300),
        # a rate of 0.2 in noise that leaves it open, and in a third of that
        (rows(0.2, 0.2) + NOISE * [3.0, 0.3], ["undecided", "chaotic"], 400),
        # oscillations of a deviation's size are no growth
        (np.diff(np.sin(np.arange(81.0)))[:, None], ["no growth"], 400),
        # nor is growth in proportion to time; that with its square is at the limit
        (np.diff(np.log(np.arange(1.0, 82.0)))[:, None], ["no growth"], 400),
        (1.99 * np.diff(np.log(np.arange(1.0, 82.0)))[:, None], ["undecided"], 400),
        # too short for an error of its own
        (rows(0.5, left=12), ["undecided"], 60),
    ],
)
def test_what_rates_of_growth_tell(logs, signs, windows):
    found = attractors.exponent(logs, 1.0, RATIO)
    assert isinstance(found, results.Exponent)
    assert (found.signs, found.windows) == (signs, windows)
    assert found.ends == (windows < 400)


def test_an_own_error_covers_the_true_rate():
    """Of independent growth per stretch the rate is known: 95 % of the intervals hold it."""
    logs = 0.3 + np.random.default_rng(5).normal(size=(600, 400))
    rates, _ = growth(logs, 1.0)
    inside = np.abs(rates - 0.3) < attractors.own_error(logs, 1.0)
    assert 0.92 < inside.mean() < 0.98
    few = attractors.own_error(logs[:12], 1.0)
    assert np.isinf(few).all()
    quantile = stdtrit(attractors.BLOCKS - 2, (1.0 + attractors.CONFIDENCE) / 2.0)
    assert pytest.approx(quantile, rel=1e-10) == attractors.STUDENT


def test_what_ends_at_once_has_no_rate():
    found = attractors.exponent(rows(0.5, 0.5, left=1), 1.0, RATIO)
    assert isinstance(found, Missing)


@pytest.mark.parametrize(
    ("given", "key", "words"),
    [
        ({}, "zero", "beyond its own interval"),
        ({"rate": -0.05}, "zero", r"the method gives $-0.05$ $\pm$ $0.1$\,/ms."),
        ({}, "signs", "all starts of B2 (c), printed law are chaotic"),
        ({"rate": -0.09}, "signs", "are without exponential growth"),
        ({"rate": 0.01}, "signs", "are undecided"),  # its interval reaches beyond 0.02
        ({"rate": 0.01}, "unseen", r"rates below $0.12$\,/ms cannot be seen"),
        ({"half": float("inf")}, "unseen", "too short to see any"),
        ({}, "unseen", "every start is seen to be chaotic"),
        ({"rate": 0.1}, "signs", "are undecided"),
    ],
)
def test_sentences_on_exponents_follow_the_numbers(given, key, words):
    values, _ = generated(made(**given), SILENT)
    assert words in values[f"onset.{key}"]


def test_the_table_and_the_sentence_tell_what_is_undecided():
    drifts = results.Exponent(0.0, (0.1, 0.3, 0.9), (0.1, 0.4, 0.4), 0.2, 40, False)
    left = results.Exponent(0.0, (0.1, 0.3), (0.1, 0.4), 0.2, 40, True)
    given: dict[str, Any] = {"b1-b, undamped": drifts, "b1-a, undamped": Missing("the model ends")}
    others_ = dataclasses.replace(made(), exponents=given | {"b1-c, undamped": left})
    table = exponents_table(others_)
    assert r"none & 40 & $0.1$ $\pm$ $0.1$ & $0.1$ to $0.9$ & 1 & 1 & 1" in table
    assert table.count("the model ends") == 2
    signs = generated(others_, SILENT)[0]["onset.signs"]
    assert "in B1 (b) (undamped) 1 is chaotic, 1 is without exponential growth and 1 is" in signs
    assert "no exponent exists in B1 (c) (undamped), since" in signs
