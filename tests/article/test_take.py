"""A figure or number in a folder: complete, its data those drawn, and never over others."""

import csv
import json
import math
from collections import defaultdict

import pytest

from squeal.article.contents import FIGURES
from squeal.article.report.captions import captions, title
from squeal.article.report.plain import plain, table_rows
from squeal.article.report.taking import ORIGIN, take
from squeal.article.runs import read_run
from squeal.cli.main import main
from squeal.errors import InputError
from tests.cli.calls import assert_refused
from tests.conftest import ROOT

ALWAYS = {"LICENCE.txt", "command.txt", "origin.json", "references.bib"}


@pytest.fixture(scope="module")
def build(tmp_path_factory):
    """A build in which case (c) of B2 is simulated."""
    folder = tmp_path_factory.mktemp("build")
    (folder / "results").mkdir()
    (folder / "paper").mkdir()
    (folder / "paper" / "report.tex").write_text("")
    scene = str(ROOT / "workflow/scenes/b2-c.yaml")
    result = folder / "results" / "b2-c.json"
    with result.open("w") as stream, pytest.MonkeyPatch.context() as patch:
        patch.setattr("sys.stdout", stream)
        history = str(folder / "results" / "b2-c.csv")
        assert main(["simulate", scene, "--csv", history, "--json"]) == 0
    return folder


@pytest.fixture(scope="module")
def figure(build, tmp_path_factory):
    folder = tmp_path_factory.mktemp("taken") / "fig11"
    take("Fig. 11", build, folder)
    return folder


def test_a_figure_comes_with_all_that_belongs_to_it(figure):
    files = {str(path.relative_to(figure)) for path in figure.rglob("*") if path.is_file()}
    data = {"data/curves.csv", "data/b2-c.csv", "data/b2-c.json"}
    pictures = {f"fig11.{kind}" for kind in ("pdf", "svg", "png")}
    assert files == ALWAYS | data | pictures | {"caption.txt", "alternative.txt"}
    assert (figure / "fig11.pdf").read_bytes().startswith(b"%PDF")
    assert (figure / "fig11.png").read_bytes().startswith(b"\x89PNG")
    assert "<svg" in (figure / "fig11.svg").read_text()
    assert (figure / "command.txt").read_text() == "snakemake figures/fig11.pdf\n"
    text = (figure / "references.bib").read_text()
    for key in ("@manual{article,", "@software{squeal,", "@article{matplotlib,"):
        assert text.count(key) == 1


def test_its_origin_names_scene_and_sources(figure):
    origin = json.loads((figure / ORIGIN).read_text())
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


def test_equal_bytes_when_it_is_taken_again(build, figure, tmp_path):
    take("fig11", build, tmp_path / "again")
    for path in figure.rglob("*"):
        if path.is_file():
            other = tmp_path / "again" / path.relative_to(figure)
            assert path.read_bytes() == other.read_bytes(), path.name


def test_a_number_is_written_as_its_result_holds_it(build, tmp_path):
    taken = take("b2-c.steps", build, tmp_path / "number")
    assert {"value.txt", "value.tex"} | ALWAYS == set(taken.files)
    steps = json.loads((build / "results" / "b2-c.json").read_text())["steps"]
    assert (tmp_path / "number" / "value.txt").read_text() == f"{steps}\n"
    with pytest.raises(InputError, match="is no key of"):
        take("b2-c.none", build, tmp_path / "other")


def test_other_peoples_folders_are_left_alone(build, tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("kept")
    with pytest.raises(InputError, match=r"was not written by `squeal take b2-c\.steps`"):
        take("b2-c.steps", build, tmp_path / "mine")
    assert [path.name for path in (tmp_path / "mine").iterdir()] == ["notes.txt"]
    take("b2-c.steps", build, tmp_path / "own")
    (tmp_path / "own" / "value.txt").write_text("my words")
    with pytest.raises(InputError, match=r"value\.txt: was changed since `squeal take b2-c"):
        take("b2-c.steps", build, tmp_path / "own")
    (tmp_path / "own" / "value.txt").unlink()
    take("b2-c.steps", build, tmp_path / "own")
    assert not list(tmp_path.glob(".take-*"))


def test_what_is_missing_is_reported_with_what_builds_it(build, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(build)
    assert main(["take", "fig12", "--to", str(tmp_path / "x")]) == 2
    assert "results/b2-d.csv: not built yet" in capsys.readouterr().err
    assert not (tmp_path / "x").exists()
    assert main(["take", "fig99"]) == 2
    assert "is no figure, table or number of the report" in capsys.readouterr().err
    assert main(["take", "fig11", "--build", str(tmp_path)]) == 2
    assert "holds no paper/report.tex" in capsys.readouterr().err


def test_what_was_measured_is_taken_as_the_build_drew_it(tmp_path):
    (tmp_path / "figures").mkdir()
    (tmp_path / "figures" / "run_times.pdf").write_bytes(b"%PDF of this machine")
    (tmp_path / "figures" / "run_times.txt").write_text("Times of this machine.\n")
    taken = take("run_times", tmp_path, tmp_path / "taken")
    assert {*taken.files} == ALWAYS | {"run_times.pdf", "alternative.txt", "caption.txt"}
    assert (tmp_path / "taken" / "run_times.pdf").read_bytes() == b"%PDF of this machine"
    assert (tmp_path / "taken" / "alternative.txt").read_text() == "Times of this machine.\n"
    assert (tmp_path / "taken" / "command.txt").read_text() == "snakemake figures/run_times.pdf\n"


def test_a_damaged_build_is_refused(tmp_path, capsys):
    for name in ("paper/report.tex", "results/b2-c.json", "results/b2-c.csv"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(b"\xff\xfe")
    words = assert_refused(capsys, "take", "fig11", "--build", tmp_path)
    assert "damaged" in words
    assert "UnicodeDecodeError" in words  # what was wrong


@pytest.mark.parametrize("option", ["--to", "--build"])
def test_without_a_name_nothing_is_written_nor_read(tmp_path, capsys, option):
    words = assert_refused(capsys, "take", option, tmp_path / "folder")
    assert words.startswith(f"squeal: {option}")


def test_a_folder_that_was_not_given_is_not_named_as_an_option(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("squeal.article.commands.take.ROOT", tmp_path / "squeal")
    words = assert_refused(capsys, "take", "fig11")
    assert words.startswith("squeal: neither the current folder nor the repository holds paper/")


def test_without_a_name_the_command_lists_the_figures(build, capsys, monkeypatch):
    monkeypatch.chdir(build)
    assert main(["take"]) == 0
    lines = [line.strip() for line in capsys.readouterr().out.splitlines()]
    assert any(line.startswith("fig01") for line in lines)
    assert main(["take", "b2-c.steps", "--to", "taken", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["folder"] == "taken"


def test_every_figure_has_a_caption_of_its_own():
    legends = captions()
    assert set(FIGURES) <= set(legends)
    assert title("Run time of $\\mu$ at \\val{a.b}: more. Then.") == "Run time of μ: more"


def test_a_table_in_latex_is_read_as_rows_of_plain_text():
    tex = (
        "\\begin{tabular}{lp{1in}r}\n\\toprule\na & b & $\\mu$ \\\\\n\\midrule\n"
        "\\verdict{flutter} & 1\\,\\% \\& more & $-1.5 \\times 10^{-3}$ \\\\\n\\midrule\n"
        "(a) & \\multicolumn{2}{l}{none} \\\\\n\\bottomrule\n\\end{tabular}\n"
    )
    rows = [["a", "b", "μ"], ["flutter", "1 % & more", "-1.5e-3"], ["(a)", "none", ""]]
    assert table_rows(tex) == rows
    assert plain(r"at most $10^{-3}$~s \citep{x}") == "at most 1e-3 s"
