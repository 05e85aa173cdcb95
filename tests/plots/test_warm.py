"""Figures drawn by forks of a loaded process are those of processes of their own."""

import os
import subprocess
import sys
import time

import pytest

from squeal.plots.warm import FOR_OTHERS, VARIABLE, ask
from tests.conftest import ROOT

ENV = os.environ | {"PYTHONPATH": str(ROOT)}


@pytest.fixture(scope="module")
def drawing(tmp_path_factory):
    """The socket of a process that draws."""
    path = tmp_path_factory.mktemp("warm") / "socket"
    command = [sys.executable, "-m", "squeal.article.figures", FOR_OTHERS, str(path)]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, env=ENV)
    while not path.exists() and process.poll() is None:
        time.sleep(0.01)
    yield str(path)
    process.stdin.close()
    assert process.wait(timeout=60) == 0  # it ends with its input


def draw(path, folder, *words):
    return subprocess.run(
        [sys.executable, "-m", "squeal.article.figures", *words],
        env=ENV | {VARIABLE: path},
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )


def test_a_figure_is_that_of_a_process_of_its_own(drawing, tmp_path):
    for path, model in ((drawing, "B1"), (drawing, "B2"), ("nowhere", "B1"), ("nowhere", "B2")):
        folder = tmp_path / ("alone" if path == "nowhere" else "asked")
        folder.mkdir(exist_ok=True)
        done = draw(path, folder, "charts", model, "--out", f"{model}.pdf")
        assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    for file in ("B1.pdf", "B1.txt", "B2.pdf", "B2.txt"):
        asked, alone = (tmp_path / name / file for name in ("asked", "alone"))
        assert asked.read_bytes() == alone.read_bytes()


def test_a_refusal_is_that_of_a_process_of_its_own(drawing, tmp_path):
    (tmp_path / "wrong.json").write_text("[]", encoding="utf-8")
    for words in (
        ["loci", "wrong.json", "--out", "loci.pdf"],
        ["nothing", "--out", "nothing.pdf"],
        ["growth", "--out", "growth.pdf"],
    ):
        asked, alone = draw(drawing, tmp_path, *words), draw("nowhere", tmp_path, *words)
        assert asked.returncode == alone.returncode == 2
        assert asked.stderr == alone.stderr
    assert not list(tmp_path.glob("*.pdf"))


def test_an_error_is_told_and_is_none_of_the_next_figure(drawing, tmp_path):
    wrong = ["charts", "B1", "--out", "B1.doc"]
    asked, alone = draw(drawing, tmp_path, *wrong), draw("nowhere", tmp_path, *wrong)
    assert asked.returncode == alone.returncode == 1
    assert asked.stderr.splitlines()[-1] == alone.stderr.splitlines()[-1]
    assert draw(drawing, tmp_path, "charts", "B1", "--out", "B1.pdf").returncode == 0


def test_it_is_asked_where_it_answers_alone(drawing, tmp_path, monkeypatch):
    words = ["charts", "B1", "--out", str(tmp_path / "B1.pdf")]
    monkeypatch.setenv(VARIABLE, drawing)
    assert ask(words) == 0
    monkeypatch.setenv(VARIABLE, str(tmp_path / "nobody"))
    assert ask(words) is None
    monkeypatch.delenv(VARIABLE)
    assert ask(words) is None
