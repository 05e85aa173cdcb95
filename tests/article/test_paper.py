"""The texts in paper/: every value is defined by a result file, and no number is typed."""

import json
import re

import pytest

from squeal.article.cases import HISTORY_FIGURES
from squeal.article.report.__main__ import main
from squeal.article.report.chapters import CHAPTERS, FIGURES
from squeal.io.provenance import provenance
from squeal.io.scene import read_scene
from squeal.simulation import simulate
from tests.article import known
from tests.conftest import ROOT

PAPER = ROOT / "paper"
TEXTS = {file.stem: file.read_text(encoding="utf-8") for file in sorted(PAPER.glob("*.tex"))}


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Folder of the generated files of all chapters, by their program."""
    folder = tmp_path_factory.mktemp("built")
    known.write(folder)
    for stem in HISTORY_FIGURES:
        file = ROOT / "workflow" / "scenes" / f"{stem}.yaml"
        scene = read_scene(file, "simulate")
        made = {"provenance": provenance([file], "squeal.cli.simulate").to_dict()}
        summary = folder / "results" / f"{stem}.json"
        summary.write_text(json.dumps(simulate(scene).to_dict() | made))
    for chapter in CHAPTERS:
        there = {"results": folder, "workflow": ROOT}
        files = [str(there[file.partition("/")[0]] / file) for file in chapter.reads]
        assert main([chapter.name, *files, "--out", str(folder / chapter.name)]) == 0
    return folder


def values_of(file):
    return re.findall(r"^\\setval\{(.*?)\}\{(.*)\}$", file.read_text(encoding="utf-8"), re.M)


def keys(text):
    """Keys of the values that a text refers to, by macros of the preamble too."""
    text = re.sub(r"(?<!\\)%.*", "", text)
    found = set(re.findall(r"\\val\{([^}#]+)\}", text))
    for stem in re.findall(r"\\history\{\w+\}\{([\w-]+)\}", text):
        found |= {f"{stem}.scene", f"{stem}.changes", f"{stem}.stop", f"agreement.{stem}"}
    return found | {f"{stem}.scene" for stem in re.findall(r"\\scene\{([\w-]+)\}", text)}


def test_each_chapter_has_a_text_and_each_text_is_a_chapter():
    assert set(TEXTS) == {"report", *(chapter.name for chapter in CHAPTERS)}


@pytest.mark.parametrize("chapter", CHAPTERS, ids=lambda chapter: chapter.name)
def test_a_chapter_writes_the_files_of_the_table(built, chapter):
    assert {file.name for file in (built / chapter.name).iterdir()} == set(chapter.generated)


@pytest.mark.parametrize("chapter", CHAPTERS, ids=lambda chapter: chapter.name)
def test_a_text_shows_the_figures_and_tables_of_its_chapter(chapter):
    text = TEXTS[chapter.name]
    shown = re.findall(r"\\(?:figurefile|history)\{(\w+)\}", text)
    assert sorted(shown) == sorted(figure.name for figure in chapter.figures)
    read = re.findall(r"\\(?:input\{generated/|rows\{)([\w-]+)\}", text)
    assert sorted(read) == sorted(set(chapter.tables) - {"chapters"})


def test_every_value_of_the_texts_is_defined_once(built):
    values = [pair for file in built.glob("*/*-values.tex") for pair in values_of(file)]
    defined = [key for key, _ in values]
    assert len(defined) == len(set(defined))
    wanted = set().union(*map(keys, TEXTS.values()))
    assert len(wanted) > 100
    assert wanted <= set(defined)
    for _, text in values:
        assert text.count("{") == text.count("}")
        assert text.count("$") % 2 == 0
        assert not re.search(r"(?<!\\)[%&#]", text)


def test_values_fill_a_line_each(built):
    for file in built.glob("*/*-values.tex"):
        assert len(values_of(file)) == len(file.read_text(encoding="utf-8").splitlines())


def test_the_report_reads_the_chapters_in_the_order_of_the_table(built):
    text = (built / "making" / "chapters.tex").read_text(encoding="utf-8")
    names = [chapter.name for chapter in CHAPTERS]
    assert re.findall(r"\\input\{generated/([\w-]+)-values\}", text) == names
    assert re.findall(r"\\input\{(\w+)\}", text) == names
    assert r"\input{generated/chapters}" in TEXTS["report"]
    assert r"\chapters" in TEXTS["report"].split(r"\begin{document}")[1]


def prose(text):
    """A text without what may hold digits: macros' arguments, lengths, indices, names."""
    text = text.partition(r"\begin{document}")[2] or text
    text = re.sub(r"(?<!\\)%.*", "", text)
    text = re.sub(r"\\begin\{equation\}.*?\\end\{equation\}", "", text, flags=re.S)
    text = re.sub(r"\\begin\{(longtable|tabular)\}.*", "", text)  # widths of columns
    names = r"val|ref|label|cite[pt]?|aeqs?(?:to)?|afig|atab|asec|scene|name|figurefile"
    names += "|rows|input|texttt"
    text = re.sub(rf"\\({names})\{{[^}}]*\}}(\{{\w*\}})?", "", text)
    text = re.sub(r"\\history\{\w+\}\{[\w-]+\}", "", text)
    text = re.sub(r"[_^]\{?\d+\}?", "", text)  # indices of symbols
    text = re.sub(r"\b([BE]\d+|DOP853)\b", "", text)  # models, findings, a method
    return re.sub(r"[=>] [01]\b", "", text)  # conditions such as R_n > 0 and units such as m = 1


@pytest.mark.parametrize("name", TEXTS)
def test_no_number_is_typed_in_the_prose(name):
    assert re.findall(r".{0,30}\d.{0,30}", prose(TEXTS[name])) == []


@pytest.mark.parametrize("typed", ["reach 3.5 mm", r"at $\mu = 0.3$", r"12\,\%", "of 1500 pads"])
def test_a_typed_number_would_be_seen(typed):
    assert re.search(r"\d", prose(typed))


def test_figures_stand_in_the_article_s_order():
    text = TEXTS["article"]
    shown = [f"fig{i:02}" for i in range(1, 14)]
    assert [name for name in FIGURES if name.startswith("fig")] != []
    assert re.findall(r"\\(?:figurefile|history)\{(fig\d\d)\}", text) == shown
    assert text.index("fig02") < text.index("table1") < text.index("fig04")
