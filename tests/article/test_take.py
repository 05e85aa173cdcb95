"""A figure, table or number in a folder: complete, its data those drawn, and never over others."""

import csv
import json
import math
import shutil
from collections import defaultdict

import pytest

from squeal.article.report.contact_states import table_1
from squeal.article.report.plain import table_rows
from squeal.article.report.taking import ORIGIN, take
from squeal.article.results.runs import read_run
from squeal.cli.main import command, main
from squeal.errors import InputError
from tests.article import known
from tests.conftest import ROOT

ALWAYS = {"LICENCE.txt", "command.txt", "origin.json", "references.bib"}


@pytest.fixture(scope="module")
def build(tmp_path_factory):
    """A repository in which results stand, that of case (c) of B2 by a simulation."""
    folder = tmp_path_factory.mktemp("build")
    known.write(folder)
    shutil.copytree(ROOT / "paper", folder / "paper", ignore=shutil.ignore_patterns("generated"))
    shutil.copytree(ROOT / "workflow" / "scenes", folder / "workflow" / "scenes")
    results = folder / "results"
    with (results / "b2-c.json").open("w") as stream, pytest.MonkeyPatch.context() as patch:
        patch.setattr("sys.stdout", stream)
        scene = str(folder / "workflow" / "scenes" / "b2-c.yaml")
        assert command("simulate").main([scene, "--csv", str(results / "b2-c.csv"), "--json"]) == 0
    generated = folder / "paper" / "generated"
    generated.mkdir()
    (generated / "table-1.tex").write_text(table_1())
    for name in ("b1-a", "b1-b", "b1-c", "b1-d", "b2-a", "b2-b", "b2-d"):
        shutil.copy(results / "b2-c.json", results / f"{name}.json")
    (generated / "article-values.tex").write_text(
        "\\setval{b2-c.max.Rn}{$11.8$}\n\\setval{b2-c.scene}{b2-c.yaml}\n"
    )
    return folder


@pytest.fixture(scope="module")
def figure(build, tmp_path_factory):
    folder = tmp_path_factory.mktemp("taken") / "fig11"
    take("fig11", build, folder)
    return folder


def test_a_figure_comes_with_all_that_belongs_to_it(figure):
    files = {str(path.relative_to(figure)) for path in figure.rglob("*") if path.is_file()}
    data = {"data/curves.csv", "data/b2-c.csv", "data/b2-c.json"}
    pictures = {f"fig11.{kind}" for kind in ("pdf", "svg", "png")}
    assert files == ALWAYS | data | pictures | {"caption.txt", "alternative.txt"}
    assert (figure / "fig11.pdf").read_bytes().startswith(b"%PDF")
    assert (figure / "fig11.png").read_bytes().startswith(b"\x89PNG")
    assert "<svg" in (figure / "fig11.svg").read_text()
    assert (figure / "caption.txt").read_text().startswith("Fig. 11. Model B2, case (c):")
    assert "Scene b2-c.yaml;" in (figure / "caption.txt").read_text()
    assert (figure / "alternative.txt").read_text().startswith("Two panels over")
    assert (figure / "command.txt").read_text() == "snakemake figures/fig11.pdf\n"
    assert "CC BY 4.0" in (figure / "LICENCE.txt").read_text()


def test_its_references_are_what_it_was_made_with(figure):
    text = (figure / "references.bib").read_text()
    for key in ("@manual{article,", "@software{squeal,", "@article{matplotlib,"):
        assert text.count(key) == 1
    assert "snakemake" not in text


def test_its_origin_names_scene_and_sources(figure):
    origin = json.loads((figure / ORIGIN).read_text())
    assert origin["place"] == "Fig. 11"
    (made,) = origin["results"]
    assert [file["name"] for file in made["inputs"]] == ["b2-c.yaml"]
    assert origin["sources"]["module"] == "squeal.article.figures.histories"
    assert set(origin["read"]) == {"b2-c.json", "b2-c.csv"}


def test_the_curves_are_the_samples_of_the_result(build, figure):
    run = read_run(build / "results" / "b2-c.json", build / "results" / "b2-c.csv")
    drawn = defaultdict(set)
    with (figure / "data" / "curves.csv").open(newline="") as stream:
        for row in csv.DictReader(stream):
            if row["kind"] == "line" and row["x"] and row["y"]:
                drawn[row["panel"]].add((float(row["x"]), float(row["y"])))
    for panel, signal in (("1", "Rn"), ("2", "delta")):
        for t, value in zip(run.history["t"], run.history[signal], strict=True):
            assert math.isnan(value) or (1e3 * t, value) in drawn[panel]
    assert len(drawn["1"]) >= len(run.history["t"])


def test_equal_bytes_when_it_is_taken_again(build, figure, tmp_path):
    take("fig11", build, tmp_path / "again")
    for path in figure.rglob("*"):
        if path.is_file():
            other = tmp_path / "again" / path.relative_to(figure)
            assert path.read_bytes() == other.read_bytes(), path.name


def test_a_table_as_tex_and_csv(build, tmp_path):
    found = take("Table 2", build, tmp_path / "one")
    assert found.name == "table-1"
    assert ALWAYS | {"table-1.tex", "table-1.csv", "caption.txt"} == set(found.files)
    assert (tmp_path / "one" / "table-1.tex").read_text() == table_1()
    with (tmp_path / "one" / "table-1.csv").open(newline="") as stream:
        head, *rows = csv.reader(stream)
    assert head == ["condition", "expression", "slope", "meaning"]
    assert len(rows) == 12  # ten conditions, two of them with two expressions
    assert rows[0][0] == "1-2"
    assert {row[2] for row in rows} == {"positive", "negative"}


def test_rows_of_tables():
    tex = (
        "\\begin{tabular}{lp{1in}r}\n\\toprule\na & b & $\\mu$ \\\\\n\\midrule\n"
        "\\verdict{flutter} & 1\\,\\% \\& more & $-1.5 \\times 10^{-3}$ \\\\\n\\midrule\n"
        "(a) & \\multicolumn{2}{l}{none} \\\\\n\\bottomrule\n\\end{tabular}\n"
    )
    rows = [["a", "b", "μ"], ["flutter", "1 % & more", "-1.5e-3"], ["(a)", "none", ""]]
    assert table_rows(tex) == rows


def test_a_number(build, tmp_path):
    found = take("b2-c.max.Rn", build, tmp_path / "number")
    assert {"value.txt", "value.tex"} | ALWAYS == set(found.files)
    assert (tmp_path / "number" / "value.txt").read_text() == "11.8\n"
    assert json.loads((tmp_path / "number" / ORIGIN).read_text())["name"] == "b2-c.max.Rn"


def test_other_peoples_folders_are_left_alone(build, tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("kept")
    with pytest.raises(InputError, match="was not written by `squeal take table-1`"):
        take("table-1", build, tmp_path / "mine")
    assert [path.name for path in (tmp_path / "mine").iterdir()] == ["notes.txt"]
    take("table-1", build, tmp_path / "own")
    (tmp_path / "own" / "notes.txt").write_text("kept")
    with pytest.raises(InputError, match=r"was not written by `squeal take b2-c\.max\.Rn`"):
        take("b2-c.max.Rn", build, tmp_path / "own")
    take("table-1", build, tmp_path / "own")
    assert (tmp_path / "own" / "notes.txt").read_text() == "kept"
    (tmp_path / "own" / "caption.txt").write_text("my words")
    with pytest.raises(InputError, match=r"caption\.txt: was changed since `squeal take table-1`"):
        take("table-1", build, tmp_path / "own")
    assert (tmp_path / "own" / "caption.txt").read_text() == "my words"
    (tmp_path / "own" / "caption.txt").unlink()
    take("table-1", build, tmp_path / "own")
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="file: exists and"):
        take("table-1", build, tmp_path / "file")
    assert not list(tmp_path.glob(".take-*"))


def test_what_is_missing_is_told_with_what_builds_it(build, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(build)
    assert main(["take", "fig12", "--to", str(tmp_path / "x")]) == 2
    error = capsys.readouterr().err
    assert "results/b2-d.csv: not built yet" in error
    assert "snakemake results/b2-d.csv" in error
    assert not (tmp_path / "x").exists()
    assert main(["take", "fig99"]) == 2
    assert "is no figure, table or number of the report" in capsys.readouterr().err
    assert main(["take", "fig11", "--build", str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert "holds no paper/report.tex" in error
    assert "`make report`" in error


def test_the_list(build, capsys, monkeypatch):
    monkeypatch.chdir(build)
    assert main(["take"]) == 0
    lines = [line.strip() for line in capsys.readouterr().out.splitlines()]
    assert any(line.startswith("fig01") for line in lines)
    assert any(line.startswith("claims") and "Table" in line for line in lines)
    assert main(["take", "fig11", "--to", "taken", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["folder"] == "taken"
    assert (build / "taken" / ORIGIN).is_file()
