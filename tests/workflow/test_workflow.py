"""The workflow: what a target needs, and that rules know the sources of what they run."""

import re
import subprocess
import sys

import pytest

from squeal.article.cases import CASES, HISTORY_FIGURES
from squeal.article.report.layout import FIGURES
from squeal.files.sources import sources
from tests.conftest import ROOT

SNAKEFILE = (ROOT / "Snakefile").read_text(encoding="utf-8")
RULES = dict(re.findall(r"^rule (\w+):\n(.*?)(?=^\S|\Z)", SNAKEFILE, re.M | re.S))


def jobs(target):
    """Rule name to number of jobs for a target built from nothing, by a dry run."""
    snakemake = [sys.executable, "-m", "snakemake", "--cores", "2", "--nolock"]
    run = subprocess.run(
        [*snakemake, "--dry-run", "--forceall", target],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    table = re.search(r"^job +count\n[- ]+\n(.*?)\n\n", run.stdout + run.stderr, re.M | re.S)
    assert table is not None
    return {name: int(count) for name, count in re.findall(r"^(\w+) +(\d+)$", table[1], re.M)}


def test_one_figure_runs_one_scene():
    assert jobs("figures/fig06.pdf") == {"simulate": 1, "history": 1, "total": 2}


def test_everything_simulates_each_scene_once_and_draws_each_figure_once():
    found = jobs("everything_but_pdf")
    assert found["simulate"] == len(HISTORY_FIGURES) == 2 * len(CASES)
    drawn = sum(found[rule] for rule in ("sketch", "chart", "history", "quasi_static"))
    assert drawn == len(FIGURES) == 13
    assert "paper" not in found


@pytest.mark.parametrize("rule", [name for name, text in RULES.items() if "-m squeal" in text])
def test_each_rule_lists_the_sources_of_its_program(rule):
    (module,) = re.findall(r"-m (squeal[\w.{}]*)", RULES[rule])
    named = re.findall(r'sources\(f?"([\w.{}]+)"\)', RULES[rule])
    if module == "squeal.article.studies":  # one program, which runs the study named after it
        assert named == [f"{module}.__main__", f"{module}.{{wildcards.name}}"]
        return
    assert named == [module]
    if "{" not in module:
        assert f"{module.replace('.', '/')}.py" in sources(module)


def test_jobs_are_shell_commands():
    assert not re.search(r"^\s+(run|script):", SNAKEFILE, re.M)


@pytest.mark.parametrize(
    ("changed", "rerun", "untouched"),
    [
        (
            "squeal/article/figures/quasi_static.py",
            ["squeal.article.figures.quasi_static"],
            ["squeal.plots.histories"],
        ),
        (
            "squeal/simulation/integrators/taylor.py",
            [
                "squeal.commands.simulate",
                "squeal.article.commands.claims",
                "squeal.article.commands.findings",
            ],
            [
                "squeal.plots.histories",
                "squeal.article.figures.sketch",
                "squeal.article.studies.quasi_static",
            ],
        ),
        (
            "squeal/model/contact.py",
            [
                "squeal.commands.simulate",
                "squeal.article.studies.eigenvalues",
                "squeal.article.figures.sketch",
            ],
            ["squeal.article.figures.charts"],
        ),
        (
            "squeal/plots/style.py",
            [
                "squeal.article.figures.charts",
                "squeal.plots.histories",
                "squeal.article.figures.sketch",
            ],
            [
                "squeal.commands.simulate",
                "squeal.article.commands.claims",
                "squeal.article.report.build",
            ],
        ),
    ],
)
def test_a_change_reruns_what_imports_it_and_nothing_else(changed, rerun, untouched):
    assert all(changed in sources(module) for module in rerun)
    assert not any(changed in sources(module) for module in untouched)
