"""Studies: one file, one result record and one line of the table each; one program for all."""

import dataclasses
import json
from importlib import import_module
from pathlib import Path
from typing import get_type_hints

import pytest

import squeal.article.results
import squeal.article.studies as studies
from squeal.article.report.chapters import STUDIES
from squeal.article.results import record_of
from squeal.article.results.extreme import Extreme, Outcome
from squeal.article.results.records import Plain, Result
from squeal.article.studies import extreme as extreme_study
from squeal.article.studies.__main__ import main
from squeal.io.provenance import sources
from tests.conftest import ROOT, SCENES

RESULTS = squeal.article.results.__name__


def modules(package):
    (folder,) = package.__path__
    return {file.stem for file in Path(folder).glob("*.py") if not file.stem.startswith("_")}


def test_study_result_and_table_have_the_same_names():
    shared = {"records", "rounding", "runs"}  # what several results are made of
    assert modules(squeal.article.results) - shared <= modules(studies) == set(STUDIES)


@pytest.mark.parametrize("name", STUDIES)
def test_a_study_returns_the_record_of_its_name(name):
    study = import_module(f"squeal.article.studies.{name}").study
    record = record_of(name)
    assert record is get_type_hints(study)["return"]
    assert record is Plain or record.__name__ == name.title().replace("_", "")
    assert issubclass(record, Result)
    assert all((ROOT / file).is_file() for file in STUDIES[name].reads)


def test_a_study_lacking_a_scene_says_which(capsys):
    assert main(["angles", str(SCENES / "b2-a.yaml")]) == 2
    assert capsys.readouterr().err.startswith("angles: b2-b.yaml: missing")


def test_a_file_too_many_is_refused(capsys):
    assert main(["extreme", "b3.yaml"]) == 2
    assert "b3.yaml" in capsys.readouterr().err


@pytest.mark.parametrize(("word", "code"), [("right", 0), ("wrong", 1)])
def test_a_wrong_outcome_is_printed_and_fails(word, code, monkeypatch, capsys):
    outcome = Outcome("group", "name", word, None, 1, 2, 0.1, "said")
    monkeypatch.setattr(
        extreme_study, "study", lambda files: Extreme((outcome,), 1e-9, 1e-30, "exact")
    )
    assert main(["extreme"]) == code
    found = capsys.readouterr()
    assert Extreme.from_dict(json.loads(found.out)).cases == (outcome,)
    assert ("group: name" in found.err) is bool(code)
    stood_in = dataclasses.replace(Extreme.from_dict(json.loads(found.out)), stand_in=True)
    assert not stood_in.wrong


@pytest.mark.parametrize("name", sorted(modules(squeal.article.results)))
def test_results_do_not_depend_on_what_computes_them(name):
    heavy = ("analysis", "article/claims", "article/studies", "equilibrium", "model", "simulation")
    files = [file.removeprefix("squeal/") for file in sources(f"{RESULTS}.{name}")]
    assert not [file for file in files if file.startswith(heavy)]
