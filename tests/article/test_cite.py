"""References: keys that the report cites, and BibTeX of what a result was really computed with."""

import json
import re
import subprocess
import sys
import tomllib
from dataclasses import asdict

import pytest

from squeal.article.report.bibliography import behind, entries, installed, reference
from squeal.cli.main import main
from squeal.io.provenance import Provenance, provenance
from tests.conftest import ROOT, SCENES

SIMULATE = [sys.executable, "-m", "squeal", "simulate", str(SCENES / "b2-c.yaml"), "--json"]
SIMULATE += ["--set", "stop=1e-3"]


def keys(capsys, *arguments):
    assert main(["cite", *map(str, arguments), "--json"]) == 0
    return {entry["key"] for entry in json.loads(capsys.readouterr().out)["references"]}


@pytest.mark.parametrize(("integrator", "other"), [("heyoka", "scipy"), ("scipy", "heyoka")])
def test_a_result_cites_the_integrator_that_ran_and_no_other(capsys, tmp_path, integrator, other):
    if integrator == "heyoka":
        pytest.importorskip("heyoka")
    # a process of its own: what is loaded here was loaded by other tests
    run = subprocess.run(
        [*SIMULATE, "--integrator", integrator], capture_output=True, text=True, check=True
    )
    (tmp_path / "run.json").write_text(run.stdout)
    cited = keys(capsys, tmp_path / "run.json")
    assert {"article", "squeal", "numpy", integrator} <= cited
    assert not {other, "control", "matplotlib", "snakemake"} & cited


def test_without_a_result_everything_installed_is_cited(capsys):
    assert {"article", "squeal", "scipy", "control", "matplotlib"} <= keys(capsys)


def test_a_missing_package_is_not_cited(monkeypatch):
    assert "numpy" in installed()
    monkeypatch.setattr("squeal.article.report.bibliography.version", lambda name: "not installed")
    assert not installed()


def test_versions_are_those_of_the_results():
    made = provenance([], "squeal.article.commands.sliding")
    versions = behind(
        [made, Provenance(**vars(made) | {"versions": made.versions | {"numpy": "9"}})]
    )
    assert versions["numpy"] == ", ".join(sorted({made.versions["numpy"], "9"}))
    assert "Version 9}" in reference("numpy", "9").bibtex


def test_braces_balance():
    for key, number in [(key, None) for key in entries()] + [("heyoka", "7")]:
        text = reference(key, number).bibtex
        assert text.count("{") == text.count("}")
        assert text.endswith("}\n}")


def test_files_without_provenance_are_refused(capsys, tmp_path):
    for name, content in (("a.json", "{}"), ("b.json", "[1"), ("c.json", '{"provenance": 1}')):
        (tmp_path / name).write_text(content)
        assert main(["cite", str(tmp_path / name)]) == 2
        assert "holds no provenance; the JSON output" in capsys.readouterr().err
    made = asdict(provenance([], "squeal.article.commands.sliding")) | {"loaded": ["numpy"]}
    for versions in ({}, {"numpy": 2}):
        file = tmp_path / "versions.json"
        file.write_text(json.dumps({"provenance": made | {"versions": versions}}))
        assert main(["cite", str(file)]) == 2
        assert "holds no provenance" in capsys.readouterr().err
    assert main(["cite", str(tmp_path / "none.json")]) == 2
    assert "none.json" in capsys.readouterr().err


def test_what_the_report_cites_is_there():
    cited = set()
    for file in (ROOT / "paper").glob("*.tex"):
        for keys in re.findall(r"\\cite\w*\{([^}]+)\}", file.read_text(encoding="utf-8")):
            cited.update(keys.split(","))
    assert {"article", "control"} <= cited
    assert cited <= entries().keys()


def test_every_library_that_the_package_needs_has_an_entry():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    needed = {re.split(r"[;\s<>=]", wanted)[0] for wanted in project["dependencies"]}
    assert needed - {"pyyaml", "jinja2"} <= entries().keys()  # which nobody has written up
