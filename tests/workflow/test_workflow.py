"""The workflow: what a target needs, what a change reruns, and the profile. Nothing is built."""

import functools
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import pytest

from squeal.article.cases import CASES, HISTORY_FIGURES
from squeal.article.contents import FIGURES, REPRODUCIBLE, RESULTS, STUDIES, TABLES, figure_files
from squeal.article.report.captions import captions
from squeal.article.report.taking import names, take
from squeal.errors import InputError
from tests.conftest import ROOT
from workflow.release import codecheck

RULES = [ROOT / "Snakefile", *sorted((ROOT / "workflow" / "rules").glob("*.smk"))]


# Snakemake, imported once with its plugins, and the imports of our files, read once: each run is a
# copy of this process, and ends without clearing its memory, which takes as long as the run
RUNS = """
import gc, json, os, sys
from contextlib import suppress
from snakemake.cli import get_argument_parser, main
from squeal.article.contents import STUDIES
from squeal.io.provenance import sources
get_argument_parser()
for study in STUDIES:
    sources(f"squeal.article.studies.{study}")
gc.freeze()
gc.disable()
for line in sys.stdin:
    folder, printed, arguments = json.loads(line)
    child = os.fork()
    if not child:
        os.chdir(folder)
        file = os.open(printed, os.O_CREAT | os.O_WRONLY)
        os.dup2(file, 1)
        os.dup2(file, 2)
        sys.argv[1:] = arguments
        with suppress(SystemExit):
            main()
        sys.stdout.flush()
        os._exit(0)
    os.waitpid(child, 0)
    print(flush=True)
"""


@functools.cache
def runs():
    """The process of `RUNS`."""
    pipe = subprocess.PIPE
    return subprocess.Popen([sys.executable, "-c", RUNS], stdin=pipe, stdout=pipe, text=True)


@pytest.fixture(scope="module", autouse=True)
def _end_runs():
    yield
    if runs.cache_info().currsize:
        runs().communicate()


def snakemake(folder, *arguments):
    """What a run of Snakemake prints; the environment's own profile is not read."""
    with tempfile.NamedTemporaryFile() as printed:
        asked = str(folder), printed.name, ["--nolock", *arguments]
        print(json.dumps(asked), file=runs().stdin, flush=True)
        runs().stdout.readline()
        return Path(printed.name).read_text(encoding="utf-8")


def jobs(folder, *arguments):
    """Rules of the jobs of a dry run with their first output files."""
    return [(rule, outputs[0] if outputs else "") for rule, outputs in planned(folder, *arguments)]


def planned(folder, *arguments):
    """Rules of the jobs of a dry run with all their output files."""
    text = snakemake(folder, "--dry-run", *arguments)
    assert "Building DAG" in text, text
    pairs = re.findall(r"^(?:local)?rule (\w+):\n(.*?)\n\n?(?=\[|Job|\Z)", text, re.M | re.S)
    found = []
    for rule, body in pairs:
        output = re.search(r"^    output: (.*)$", body, re.M)
        found.append((rule, output[1].split(", ") if output else []))
    assert found or "Nothing to be done" in text, text
    return found


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """A copy of the repository in which all results and figures stand, newer than all sources."""
    folder = tmp_path_factory.mktemp("built")
    parts = ("Snakefile", "workflow", "profiles", "squeal", "paper", "requirements", "benchmarks")
    for part in parts:
        if (ROOT / part).is_dir():
            ignored = shutil.ignore_patterns("__pycache__", "generated", "*.pdf")
            shutil.copytree(ROOT / part, folder / part, ignore=ignored)
        else:
            shutil.copy(ROOT / part, folder / part)
    past = time.time() - 1000.0
    for file in folder.rglob("*"):
        os.utime(file, (past, past))
    outputs = [*RESULTS, *(f"results/{stem}.csv" for stem in HISTORY_FIGURES)]
    outputs += [file for name in FIGURES for file in figure_files(name)]
    outputs += [f"paper/generated/{name}.tex" for name in ("values", "captions", *TABLES)]
    for name in outputs:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).touch()
        os.utime(folder / name, (past + 500.0, past + 500.0))
    return folder


@pytest.fixture
def rerun(built):
    """The results and figures that are made anew after a change of a file, then taken back."""

    def after(changed):
        before = (built / changed).stat()
        os.utime(built / changed)
        try:
            return {output for _, output in jobs(built, "everything_but_pdf")}
        finally:
            os.utime(built / changed, (before.st_atime, before.st_mtime))

    return after


def test_the_profile_is_read_and_nothing_is_left_to_do(built):
    text = snakemake(built, "--dry-run", "everything_but_pdf")  # refused without a profile
    assert "Using workflow specific profile profiles/default" in text
    assert "Nothing to be done" in text


def test_everything_runs_once():
    found = Counter(rule for rule, _ in jobs(ROOT, "--forceall", "everything_but_pdf", "shown"))
    assert found["simulate"] == len(HISTORY_FIGURES) == 2 * len(CASES)
    assert found["study"] == len(STUDIES)
    assert found["figure"] == found["picture"] == len(REPRODUCIBLE)


@pytest.fixture(scope="module")
def outputs():
    """All files that a whole build makes."""
    return {file for _, files in planned(ROOT, "--forceall", "all") for file in files}


def test_a_build_makes_what_codecheck_names(outputs):
    named = codecheck.manifest()
    assert len(named) == len(set(named)) == len(captions()) + 2
    assert set(named) <= outputs


def test_whatever_take_lists_is_taken_from_what_a_build_makes(outputs, tmp_path):
    """From an empty build it asks for the files that it reads, by name."""
    for file in (ROOT / "workflow/scenes").glob("*.yaml"):  # of which there is no build
        (tmp_path / "workflow/scenes").mkdir(parents=True, exist_ok=True)
        shutil.copy(file, tmp_path / "workflow/scenes")
    alone = set()
    for name in names():
        try:
            take(name, tmp_path, tmp_path / f"taken-{name}")
            alone.add(name)
        except InputError as error:
            lacking, _, _ = str(error).partition(": not built yet")
            assert set(lacking.split(", ")) <= outputs, name
    assert alone == {"fig01", "fig02", "fig03", "fig08"}  # from scenes and charts


def test_one_figure_runs_one_scene():
    found = jobs(ROOT, "--forceall", "figures/fig06.pdf")
    assert found == [("simulate", "results/b1-c.json"), ("figure", "figures/fig06.pdf")]


def pdf(*names):
    return {f"figures/{name}.pdf" for name in names}


@pytest.mark.parametrize(
    ("changed", "made", "left"),
    [
        (
            "squeal/article/figures/charts.py",
            pdf("fig03", "fig08"),
            {*RESULTS, *pdf(*(set(FIGURES) - {"fig03", "fig08"}))},
        ),
        (
            "squeal/simulation/taylor.py",
            {"results/b1-a.json", "results/claims.json", *pdf("fig04", "energy")},
            {"results/quasi_static.json", "results/angles.json", *pdf("fig01", "fig03", "fig13")},
        ),
        ("workflow/scenes/b3.yaml", {"results/quasi_static.json", *pdf("fig13")}, pdf("fig04")),
        ("requirements/environment.txt", {*RESULTS, *pdf(*FIGURES)}, set()),
        ("benchmarks/precision.py", pdf("run_times"), {*RESULTS, *pdf(*REPRODUCIBLE)}),
    ],
)
def test_a_change_reruns_what_depends_on_it_and_nothing_else(rerun, changed, made, left):
    found = rerun(changed)
    assert made <= found
    assert not left & found


def test_history_figures_are_numbered_as_in_the_article():
    assert HISTORY_FIGURES == {
        "b1-a": 4, "b1-b": 5, "b1-c": 6, "b1-d": 7, "b2-a": 9, "b2-b": 10, "b2-c": 11, "b2-d": 12,
    }  # fmt: skip


def test_jobs_are_shell_commands_with_a_log():
    for file in RULES:
        text = file.read_text(encoding="utf-8")
        assert not re.search(r"^\s+(run|script):", text, re.M)
        assert text.count("shell:") == text.count("log:")


def test_lint_finds_nothing_but_the_environment():
    """Jobs run in the environment that is locked in requirements/: no conda, no container."""
    text = snakemake(ROOT, "--lint")
    assert "Lints for" in text
    found = set(re.findall(r"^ +\* (.*)$", text, re.M))
    assert found == {"Specify a conda environment or container for each rule.:"}
