"""Captions read from the report's text: complete, numbered as LaTeX numbers them, and plain."""

import re

import pytest

from squeal.article.report.captions import captions, sections, values
from squeal.article.report.chapters import CHAPTERS, FIGURES
from squeal.article.report.plain import plain
from tests.conftest import ROOT

PAPER = ROOT / "paper"
FOUND = captions(PAPER)
NO_CAPTION = {"chapters"}  # text, no table


def test_every_figure_and_table_has_a_caption():
    tables = {table for chapter in CHAPTERS for table in chapter.tables}
    assert FOUND.keys() == FIGURES.keys() | tables - NO_CAPTION
    assert not tables & FIGURES.keys()  # each has a name of its own


def test_the_articles_figures_keep_their_numbers():
    for number in range(1, 14):
        assert FOUND[f"fig{number:02}"].place == f"Fig. {number}"


def test_tables_are_counted_as_latex_counts_them():
    """The first table has its rows in the text, and is counted like those that are generated."""
    text = "".join((PAPER / f"{c.name}.tex").read_text(encoding="utf-8") for c in CHAPTERS)
    tables = r"\\begin\{(?:table|longtable)\}|\\captionof\{table\}"
    last = max(c.number for c in FOUND.values() if c.kind == "table")
    assert last == len(re.findall(tables, text))
    assert FOUND["table-1"].place == "Table 2"


def test_titles_are_plain_and_hold_no_result():
    for caption in FOUND.values():
        assert not re.search(r"[\\$]|\.\.\.|Fig\. \.|  ", caption.title), caption.title
        assert 8 < len(caption.title) < 300
        assert not re.search(r"\b(for|at|of|on|both)\.$", caption.title), caption.title


def test_macros_of_the_report_are_filled_in():
    assert "the article's Table 1" in plain(FOUND["table-1"].tex)
    text = plain(FOUND["fig11"].tex, {"b2-c.scene": "b2-c.yaml", "b2-c.changes": "41 changes"})
    assert "as in Fig. 9. Scene b2-c.yaml; 41 changes" in text


@pytest.mark.parametrize(
    ("tex", "text"),
    [
        (r"below $10^{-9}$, \emph{so} 12\,\%", "below 1e-9, so 12 %"),
        (r"$1.2 \times 10^{-5}$ at $\mu = 0$", "1.2e-5 at μ = 0"),
        (r"as in~\citep{control}.", "as in."),
        (r"\val{known}, \val{unknown}", "7, ..."),
        (r"\texttt{a\_b}~-- ``c''", 'a_b - "c"'),
    ],
)
def test_tex_becomes_text(tex, text):
    assert plain(tex, {"known": "7"}) == text


def test_values_are_those_of_the_build(tmp_path):
    (tmp_path / "a-values.tex").write_text("\\setval{x.y}{$1$}\n\\setval{z}{a {b} c}\n")
    assert values(tmp_path) == {"x.y": "$1$", "z": "a {b} c"}


def test_sections_of_a_chapter():
    assert sections(PAPER, "statements") == [
        "Statements of the article",
        "Findings on the equations",
    ]
