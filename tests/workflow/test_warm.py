"""What forks of loaded processes make is what processes of their own make."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from squeal.article.report.chapters import STUDIES
from squeal.io.provenance import packages
from tests.conftest import ROOT
from workflow.warm import FOR_OTHERS, LIGHT, LOADED, NEED_CONTROL, VARIABLE, ask

BEATS = ROOT / "workflow/scenes/b1-c.yaml"
WITHOUT_MOTION = ("quasi_static", "eigenvalues", "loci", "angles", "map_ranges")
ENV = os.environ | {"PYTHONPATH": str(ROOT)}


@pytest.fixture(scope="module")
def processes(tmp_path_factory):
    """The processes that run programs by their sockets' names, and the folder of these."""
    folder, command = tmp_path_factory.mktemp("warm"), [sys.executable, "-m", "workflow.warm"]
    made = {
        name: subprocess.Popen(
            [*command, FOR_OTHERS, str(folder / name)], stdin=subprocess.PIPE, env=ENV
        )
        for name in LOADED
    }
    for name, process in made.items():
        while not (folder / name).exists() and process.poll() is None:
            time.sleep(0.01)
    yield made, str(folder)
    for process in made.values():
        process.stdin.close()
        assert process.wait(timeout=60) == 0  # they end with their input


@pytest.fixture(scope="module")
def warm(processes):
    return processes[1]


def run(path, folder, *words):
    return subprocess.run(
        [sys.executable, "-m", "workflow.warm", *words],
        env=ENV | {VARIABLE: path},
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )


def draw(path, folder, *words):
    return run(path, folder, "squeal.article.figures", *words)


def test_a_figure_is_that_of_a_process_of_its_own(warm, tmp_path):
    # the second after another, which no process of its own draws
    for path, model in ((warm, "B1"), (warm, "B2"), ("nowhere", "B2")):
        folder = tmp_path / ("alone" if path == "nowhere" else "asked")
        folder.mkdir(exist_ok=True)
        done = draw(path, folder, "charts", model, "--out", f"{model}.pdf")
        assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    for file in ("B2.pdf", "B2.txt"):
        asked, alone = (tmp_path / name / file for name in ("asked", "alone"))
        assert asked.read_bytes() == alone.read_bytes()


def test_a_refusal_is_that_of_a_process_of_its_own(warm, tmp_path):
    (tmp_path / "wrong.json").write_text("[]", encoding="utf-8")
    for words in (
        ["loci", "wrong.json", "--out", "loci.pdf"],
        ["nothing", "--out", "nothing.pdf"],
    ):
        asked, alone = draw(warm, tmp_path, *words), draw("nowhere", tmp_path, *words)
        assert asked.returncode == alone.returncode == 2
        assert asked.stderr == alone.stderr
    assert not list(tmp_path.glob("*.pdf"))


def test_an_error_is_told_and_is_none_of_the_next_figure(warm, tmp_path):
    asked = draw(warm, tmp_path, "charts", "B1", "--out", "B1.doc")
    assert asked.returncode == 1
    assert asked.stderr.startswith("Traceback (most recent call last):\n")
    assert asked.stderr.splitlines()[-1].startswith("ValueError: Format 'doc' is not supported")
    assert draw(warm, tmp_path, "charts", "B1", "--out", "B1.pdf").returncode == 0


def test_it_is_asked_where_it_answers_alone(warm, tmp_path, monkeypatch):
    words = ["squeal.article.figures", "charts", "B1", "--out", str(tmp_path / "B1.pdf")]
    monkeypatch.setenv(VARIABLE, warm)
    assert ask(words) == 0
    monkeypatch.setenv(VARIABLE, str(tmp_path / "nobody"))
    assert ask(words) is None
    monkeypatch.delenv(VARIABLE)
    assert ask(words) is None


def test_a_result_says_the_same_of_what_was_loaded(warm, tmp_path):
    scenes = ROOT / "workflow/scenes"
    for name, scene in (("quasi_static", "b3"), ("eigenvalues", "b2-a")):
        made = [
            run(path, tmp_path, "squeal.article.studies", name, str(scenes / f"{scene}.yaml"))
            for path in (warm, "nowhere")
        ]
        assert [(one.returncode, one.stderr) for one in made] == [(0, "")] * 2
        assert made[0].stdout == made[1].stdout
        loaded = json.loads(made[0].stdout)["provenance"]["loaded"]
        assert ("control" in loaded) == (name in NEED_CONTROL)
    simulated = [
        json.loads(run(path, tmp_path, "squeal", "simulate", str(BEATS), "--json").stdout)
        for path in (warm, "nowhere")
    ]
    assert all(one.pop("run_time") > 0.0 for one in simulated)
    assert simulated[0] == simulated[1]
    # numpy and yaml, the others that a fork has loaded, every study loads itself
    for name in STUDIES:
        imported = packages(f"squeal.article.studies.{name}")
        assert "matplotlib" not in imported
        assert "control" in imported or name not in NEED_CONTROL
        # what does not simulate must not say that it loaded what simulates
        assert ("heyoka" in imported) == (name not in WITHOUT_MOTION)


@pytest.mark.parametrize("code", ["0", "3", "'a reason'", "None"])
def test_exit_codes_and_children_are_those_of_a_process_of_its_own(warm, tmp_path, code):
    statement = "import subprocess, sys; print(subprocess.run('exit 7', shell=True).returncode)"
    words = ["timeit", "-n1", "-r1", f"{statement}; sys.exit({code})"]
    asked, alone = run(warm, tmp_path, *words), run("nowhere", tmp_path, *words)
    assert (asked.returncode, asked.stdout, asked.stderr) == (
        (alone.returncode, alone.stdout, alone.stderr)
    )
    assert asked.stdout == "7\n"


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="children are read in /proc")
def test_a_fork_ends_with_who_asked_for_it(processes, tmp_path):
    made, path = processes
    serving = made[LIGHT]
    children = Path(f"/proc/{serving.pid}/task/{serving.pid}/children")
    command = [sys.executable, "-m", "workflow.warm", "timeit", "import time; time.sleep(600)"]
    asking = subprocess.Popen(command, env=ENV | {VARIABLE: path}, cwd=tmp_path)
    for ended in (False, True):
        deadline = time.monotonic() + 60.0
        while bool(children.read_text()) == ended and time.monotonic() < deadline:
            time.sleep(0.01)
        assert bool(children.read_text()) != ended
        asking.kill()
    assert asking.wait() < 0
