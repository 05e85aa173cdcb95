"""The workflow: what a target needs, what a change reruns, and the profile. Nothing is built."""

import html
import json
import os
import re
import shutil
import subprocess
import sys
import time
from collections import Counter
from importlib import import_module
from inspect import signature

import pytest

from squeal.article.cases import CASES, HISTORY_FIGURES
from squeal.article.report.captions import captions
from squeal.article.report.chapters import CHAPTERS, FIGURES, RESULTS, STUDIES
from squeal.io.provenance import sources
from tests.conftest import ROOT
from workflow.warm import LIGHT, VARIABLE

RULES = [ROOT / "Snakefile", *sorted((ROOT / "workflow" / "rules").glob("*.smk"))]
SHOWN_TABLES = {table for chapter in CHAPTERS for table in chapter.tables} - {"advice", "chapters"}
MAPS = {"results/quasi_static.json", "results/angles.json", "figures/fig13.pdf", "figures/maps.pdf"}


def reading(file):
    """The studies that read a file."""
    return {study.name for study in STUDIES.values() if file in study.reads}


@pytest.fixture(scope="module", autouse=True)
def loaded(tmp_path_factory):
    """A process that has loaded Snakemake, and nothing of this package: its forks are runs."""
    path = tmp_path_factory.mktemp("loaded") / LIGHT
    code = (  # with its plugins and what these load
        "import requests, smart_open, snakemake.cli, snakemake.storage, workflow.warm\n"
        "snakemake.cli.get_argument_parser()\n"
        f"workflow.warm.serve({str(path)!r})"
    )
    command = [sys.executable, "-c", code]
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", str(ROOT))
        process = subprocess.Popen(command, stdin=subprocess.PIPE, cwd=path.parent)
        while not path.exists() and process.poll() is None:
            time.sleep(0.01)
        patch.setenv(VARIABLE, str(path.parent))
        yield
        process.communicate()


def snakemake(folder, *arguments):
    """What a run of Snakemake prints; the environment's own profile is not read."""
    run = subprocess.run(
        [sys.executable, "-m", "workflow.warm", "snakemake", "--nolock", *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    return run.stdout + run.stderr


def jobs(folder, *arguments):
    """Rules of the jobs of a dry run with their first output files."""
    text = snakemake(folder, "--dry-run", *arguments)
    assert "Building DAG" in text, text
    pairs = re.findall(r"^(?:local)?rule (\w+):\n(.*?)\n\n?(?=\[|Job|\Z)", text, re.M | re.S)
    found = []
    for rule, body in pairs:
        output = re.search(r"^    output: (.*)$", body, re.M)
        found.append((rule, output[1].split(", ")[0] if output else ""))
    assert found or "Nothing to be done" in text, text
    return found


def counts(found):
    return Counter(rule for rule, _ in found)


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """A copy of the repository in which all outputs stand, empty and newer than all sources."""
    folder = tmp_path_factory.mktemp("built")
    parts = ("Snakefile", "workflow", "profiles", "squeal", "paper", "requirements")
    for part in parts:
        if (ROOT / part).is_dir():
            ignored = shutil.ignore_patterns("__pycache__", "generated", "report.pdf")
            shutil.copytree(ROOT / part, folder / part, ignore=ignored)
        else:
            shutil.copy(ROOT / part, folder / part)
    past = time.time() - 1000.0
    for file in folder.rglob("*"):
        os.utime(file, (past, past))
    outputs = [*RESULTS, *(f"results/{stem}.csv" for stem in HISTORY_FIGURES), "paper/report.pdf"]
    outputs += [f"figures/{figure}.{kind}" for figure in FIGURES for kind in ("pdf", "txt")]
    outputs += [f"paper/generated/{name}" for one in CHAPTERS for name in one.generated]
    for name in outputs:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).touch()
        os.utime(folder / name, (past + 500.0, past + 500.0))
    return folder


@pytest.fixture
def rerun(built):
    """What is rerun after a change of a file, which is then taken back."""

    def after(changed):
        before = (built / changed).stat()
        os.utime(built / changed)
        try:
            return jobs(built)
        finally:
            os.utime(built / changed, (before.st_atime, before.st_mtime))

    return after


def test_the_profile_is_read_and_nothing_is_left_to_do(built):
    text = snakemake(built, "--dry-run")  # no --cores: it is refused without the profile
    assert "Using workflow specific profile profiles/default" in text
    assert "Nothing to be done" in text
    away = built / "profiles" / "away"
    (built / "profiles" / "default").rename(away)
    try:
        assert "profile" not in snakemake(built, "--dry-run")
    finally:
        away.rename(built / "profiles" / "default")


def test_everything_runs_once():
    found = counts(jobs(ROOT, "--forceall", "everything_but_pdf"))
    assert found["simulate"] == len(HISTORY_FIGURES) == 2 * len(CASES)
    assert found["study"] == len(STUDIES)
    assert found["figure"] == len(FIGURES)
    assert {f"tables_{chapter.name}" for chapter in CHAPTERS} < set(found)
    assert "paper" not in found


def test_what_the_report_of_snakemake_shows_is_drawn_for_it_alone():
    found = counts(jobs(ROOT, "--forceall", "shown"))
    assert found["picture"] == len(FIGURES)
    assert found["screen_table"] == len(SHOWN_TABLES)
    assert not {"picture", "screen_table"} & set(counts(jobs(ROOT, "--forceall", "all")))


@pytest.fixture(scope="module")
def shown(built):
    """What `snakemake --report` lists: file, caption, category and labels of each entry."""
    shutil.copytree(built, folder := built.parent / "shown", symlinks=True)
    found = captions(folder / "paper")
    for name, one in found.items():
        figure = one.kind == "figure"
        file = f"figures/{name}.svg" if figure else f"paper/generated/{name}.html"
        (folder / file).write_text("<svg/>" if figure else "<html></html>")
    key = re.search(r"\\val\{([^}]*)\}", found["fig04"].tex)[1]
    (folder / "paper/generated/article-values.tex").write_text(f"\\setval{{{key}}}{{a result}}\n")
    snakemake(folder, "--touch", "--cores", "1", "shown")
    text = snakemake(folder, "shown", "--report", "report.html")
    assert "Report created" in text, text
    page = (folder / "report.html").read_text(encoding="utf-8")
    entries, _ = json.JSONDecoder().raw_decode(page.rpartition("var results = ")[2])
    return found, entries.values()


def test_the_report_of_snakemake_shows_every_figure_and_table(shown):
    found, entries = shown
    assert len(entries) == len(found) == len(FIGURES) + len(SHOWN_TABLES)
    by_title = {entry["labels"]["title"]: entry for entry in entries}
    for one in found.values():
        entry = by_title[one.title]
        assert entry["labels"]["number"].split() == one.place.split()
        assert entry["labels"]["chapter"] == one.chapter
        assert entry["mime_type"] == ("image/svg+xml" if one.kind == "figure" else "text/html")
        # the caption begins as the title does
        text = re.sub(r"<[^>]*>|\s+", " ", html.unescape(entry["caption"]))
        assert " ".join(one.title[:-1][:40].split()) in text, (one.title, text)
    assert "a result" in by_title[found["fig04"].title]["caption"]


def test_no_category_of_that_report_has_a_column_of_two_values(shown):
    """Snakemake's page makes a switch of such a column, and ends in an empty page."""
    found, _ = shown
    for kind in ("figure", "table"):
        ones = [one for one in found.values() if one.kind == kind]
        for column in ("place", "chapter", "title"):
            assert len({getattr(one, column) for one in ones}) > 2


def test_one_figure_runs_one_scene():
    found = jobs(ROOT, "--forceall", "figures/fig06.pdf")
    assert found == [("simulate", "results/b1-c.json"), ("figure", "figures/fig06.pdf")]


@pytest.mark.parametrize("module", ["growth", "sketch"])
def test_a_change_in_one_figure_s_module_draws_its_figures_and_sets_the_pdf(rerun, module):
    own = [
        ("figure", f"figures/{one.name}.pdf") for one in FIGURES.values() if one.module == module
    ]
    found = rerun(f"squeal/article/figures/{module}.py")
    assert sorted(found) == sorted([*own, ("paper", "paper/report.pdf"), ("all", "")])


def test_a_change_in_the_integrator_redraws_no_map(rerun):
    found = rerun("squeal/simulation/taylor.py")
    outputs = {output for _, output in found}
    assert counts(found)["simulate"] == 8
    assert not outputs & MAPS
    assert not outputs & {f"figures/{name}.pdf" for name in ("loci", "coupling", "modes")}
    assert not outputs & {f"figures/fig{i:02}.pdf" for i in (1, 2, 3, 8)}
    assert {f"results/{name}.json" for name in ("claims", "verify", "precision")} <= outputs


@pytest.mark.parametrize(
    ("changed", "rules", "results"),
    [
        ("squeal/plots/style.py", {"figure": len(FIGURES)}, set()),
        ("workflow/identified.json", {"study": 2}, {"verify", "claims"}),
        ("workflow/pad.json", {}, {"robustness"}),
        ("squeal/article/literature/systems/wing.yaml", {}, {"stability", "precision"}),
        ("workflow/scenes/b3.yaml", {}, reading("workflow/scenes/b3.yaml")),
        ("squeal/article/report/extreme.py", {"tables_extreme": 1, "figure": 0}, set()),
        ("paper/extreme.tex", {"paper": 1, "figure": 0, "tables_extreme": 0}, set()),
        ("requirements/environment.txt", {"simulate": 8, "figure": len(FIGURES)}, set(STUDIES)),
    ],
)
def test_a_change_reruns_what_depends_on_it_and_nothing_else(rerun, changed, rules, results):
    found = rerun(changed)
    assert {rule: counts(found)[rule] for rule in rules} == rules
    assert {output for rule, output in found if rule == "study"} == {
        f"results/{name}.json" for name in results
    }


@pytest.mark.parametrize("figure", FIGURES.values(), ids=lambda figure: figure.name)
def test_figures_import_neither_studies_nor_what_computes(figure):
    rooms = {
        "/".join(path.split("/")[1:3])
        for path in sources(f"squeal.article.figures.{figure.module}")
    }
    assert not rooms & {
        "article/studies",
        "article/claims",
        "article/identify",
        "article/precision",
    }
    if figure.module != "sketch":  # drawn from the vectors of a scene's pad
        used = {room.partition("/")[0] for room in rooms}
        assert "io/scene.py" not in rooms
        assert not used & {"simulation", "equilibrium", "linear", "analysis"}


@pytest.mark.parametrize("figure", FIGURES.values(), ids=lambda figure: figure.name)
def test_a_line_of_the_table_fits_the_function_that_draws(figure):
    draw = import_module(f"squeal.article.figures.{figure.module}").draw
    assert signature(draw).bind(*figure.arguments).args == tuple(figure.arguments)


@pytest.mark.parametrize(
    "chapter",
    [c for c in CHAPTERS if f"squeal.article.report.{c.name}" in c.modules],
    ids=lambda chapter: chapter.name,
)
def test_a_line_of_the_table_fits_the_function_that_writes(chapter):
    generated = import_module(f"squeal.article.report.{chapter.name}").generated
    assert signature(generated).bind(*chapter.reads).args == tuple(chapter.reads)


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
