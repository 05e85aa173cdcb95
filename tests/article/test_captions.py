"""Captions alone, as a file that was taken or a manifest shows them."""

import re

import pytest

from squeal.article.contents import FIGURES, RESULTS
from squeal.article.report.captions import captions, title
from squeal.article.report.plain import plain
from squeal.article.report.values import VAL_MACRO

CAPTIONS = captions()


@pytest.mark.parametrize("name", CAPTIONS)
def test_a_caption_makes_sense_alone(name):
    text = CAPTIONS[name]
    assert text
    assert not re.search(r"(?<!article's )\b(?:Fig|Figure|Table)s?\.?~?\d|\\ref", text)
    studies = {file.removeprefix("results/").removesuffix(".json") for file in RESULTS}
    assert all(key.partition(".")[0] in studies for _, key in VAL_MACRO.findall(text))


@pytest.mark.parametrize("name", CAPTIONS)
def test_a_title_has_lost_nothing(name):
    words = title(CAPTIONS[name])
    assert re.fullmatch(r"[A-Z$].*[\w)]", words)
    assert not re.search(
        r"\\|\.\.\.|= *(?:[,:;]|$)|\$|\b(?:at|of|with|over|and)$|\b\d+[a-z]\d", words
    )


def test_titles_go_without_numbers_of_results():
    said = r"Periodic motions at $\zeta = {}$\val[p1]{a.b} over friction: peak. Solid: stable."
    assert title(said) == "Periodic motions over friction: peak"
    assert title(r"Where \aeqs{23a}{23b} hold at $\mu = {}$\val{a.c}: (a)~as printed.") == (
        "Where Eqs. (23a) and (23b) hold: (a) as printed"
    )


def test_places_in_the_article_are_words():
    assert plain(r"\aeqsto{1}{3} and \aeq{22i}\says{so}") == "Eqs. (1) to (3) and Eq. (22i)"


def test_panels_of_one_model_are_described_alike():
    each = {name: CAPTIONS[name] for name in FIGURES if FIGURES[name].module == "histories"}
    assert len(each) == 8
    assert len({re.sub(r"case \(.\)", "", text) for text in each.values()}) == 2
