"""Records go to JSON and come back, and what does not fit is refused by its key."""

import json
from importlib import import_module
from pathlib import Path
from typing import Literal, get_type_hints

import pytest

import squeal.article.studies as studies
from squeal.article.contents import FIGURES, RESULTS, STUDIES
from squeal.article.outline import Outline
from squeal.article.records import Missing, Record, Result, call, from_dict, read_json, to_dict
from squeal.article.studies.__main__ import main
from squeal.errors import InputError
from tests.conftest import ROOT, SCENES


class Part(Record):
    name: Literal["a", "b"]
    size: float | None


class Whole(Result):
    parts: dict[str, Part | Missing]
    pairs: tuple[tuple[float, int], ...]
    on: bool = True


WHOLE = Whole({"p": Part("a", 0.1), "q": Missing("none")}, ((1.0, 2), (3.0, 4)))


def test_a_record_comes_back_unchanged(tmp_path):
    file = tmp_path / "whole.json"
    file.write_text(json.dumps(to_dict(WHOLE)))
    assert Whole.read(file) == WHOLE

    def both(one: Whole, word: str) -> tuple[Whole, str]:
        return one, word

    assert call(both, [str(file), "word"]) == (WHOLE, "word")
    with pytest.raises(InputError, match="1 arguments are not allowed; it is made from one, word"):
        call(both, [str(file)])


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("on", 1, "on: 1 is not allowed; it must be bool"),
        ("pairs", [[1.0]], r"pairs\.0: \[1\.0\] is not allowed"),
        ("pairs", [[1.0, 2.5]], r"pairs\.0\.1: 2\.5 is not allowed"),
        ("parts", {"p": {"name": "c", "size": None}}, r"parts\.p\.name: 'c' is not allowed"),
        ("parts", {"p": {"reason": 1}}, r"parts\.p\.reason: 1 is not allowed"),
        ("parts", {"p": {"name": "a", "size": {}}}, r"parts\.p\.size: {} is not allowed"),
        ("parts", {"p": {"name": "a"}}, r"parts\.p\.size: missing; Part has name, size"),
        ("size", 1, "size: unknown key; Whole has"),
    ],
)
def test_what_does_not_fit_is_refused_by_its_key(key, value, message):
    with pytest.raises(InputError, match=message):
        from_dict(Whole, to_dict(WHOLE) | {key: value}, "whole.json")


def test_an_outline_without_its_keys_is_refused():
    with pytest.raises(InputError, match=r"file: \{\} is not allowed; it must be as"):
        from_dict(Outline, {}, "file")


def test_a_file_that_is_no_result_is_refused(tmp_path):
    (tmp_path / "x.json").write_text("{")
    for name in ("x.json", "none.json"):
        with pytest.raises(InputError, match=f"{name}.*a JSON file written by squeal is allowed"):
            read_json(Whole, tmp_path / name)


def test_a_record_takes_what_others_know():
    assert Part.of(Part("b", 1.0), size=2.0) == Part("b", 2.0)


def test_studies_and_table_have_the_same_names():
    (folder,) = studies.__path__
    files = {file.stem for file in Path(folder).glob("*.py") if not file.stem.startswith("_")}
    assert files == set(STUDIES)
    assert len(RESULTS) == len(set(RESULTS)) == 8 + len(STUDIES)


@pytest.mark.parametrize("name", STUDIES)
def test_a_study_returns_the_record_of_its_name(name):
    study = import_module(f"squeal.article.studies.{name}").study
    assert get_type_hints(study)["return"].__name__ == name.title().replace("_", "")
    assert all((ROOT / file).is_file() for file in STUDIES[name])


@pytest.mark.parametrize("name", FIGURES)
def test_a_figure_is_drawn_from_what_the_table_says(name):
    module = import_module(f"squeal.article.figures.{FIGURES[name].module}")
    with pytest.raises(InputError, match="arguments are not allowed; it is made from"):
        call(module.draw, [*FIGURES[name].arguments, "too", "many"])
    made = {f"results/{study}.json" for study in STUDIES}
    assert {file for file in FIGURES[name].reads if file in made} <= set(RESULTS)


def test_a_study_lacking_a_scene_says_which(capsys):
    assert main(["angles", str(SCENES / "b2-a.yaml")]) == 2
    assert capsys.readouterr().err.startswith("angles: b2-c.yaml: missing")
