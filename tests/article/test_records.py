"""Records to JSON and back: nothing lost, nothing of another kind accepted."""

import json
from typing import Any, Literal

import numpy as np
import pytest

from squeal.article.results.records import Missing, Record, Result, from_dict, to_dict
from squeal.errors import InputError
from squeal.io.provenance import provenance
from squeal.model.contact import Formulation
from squeal.numerics.outline import Outline


class Part(Record):
    length: float
    name: str | None


class Whole(Result):
    count: int
    flag: bool
    kind: Literal["even", "odd"]
    pair: tuple[float, str]
    rows: tuple[tuple[float, ...], ...]
    parts: dict[str, Part | Missing]
    formulation: Formulation


WHOLE = Whole(
    count=3,
    flag=True,
    kind="odd",
    pair=(0.1, "a"),
    rows=((1.0, 1 / 3), ()),
    parts={"b": Part(5e-324, None), "a": Missing("lost"), "c": Part(1.7976931348623157e308, "c")},
    formulation=Formulation("mean"),
    provenance=provenance([], "squeal.errors"),
)


def plain(**changes: Any) -> dict[str, Any]:
    value: dict[str, Any] = json.loads(json.dumps(WHOLE.to_dict()))
    return value | changes


def test_a_record_comes_back_unchanged():
    assert Whole.from_dict(plain()) == WHOLE


def test_a_result_is_read_from_its_file(tmp_path):
    file = tmp_path / "whole.json"
    file.write_text(json.dumps(plain()))
    assert Whole.read(file) == WHOLE
    file.write_text("{")
    with pytest.raises(InputError, match=r"whole.json: .*a JSON file"):
        Whole.read(file)


def test_whole_numbers_become_those_of_the_field():
    (entry,) = from_dict(tuple[Part, ...], [{"length": 2, "name": None}])
    assert type(entry.length) is float


def test_arrays_of_an_outline_keep_their_shape_when_empty():
    none = Outline(
        np.zeros((0, 2, 2)), np.zeros((0, 2), int), np.zeros((0, 4, 2)), np.zeros(0, int)
    )
    back = from_dict(Outline, json.loads(json.dumps(to_dict(none))))
    assert back.segments.shape == (0, 2, 2)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("count", 1.5, "whole.json: count: 1.5 is not allowed; it must be int"),
        ("count", True, "count: True is not allowed"),
        ("flag", 1, "flag: 1 is not allowed; it must be bool"),
        ("kind", "prime", "kind: 'prime' is not allowed; it must be"),
        ("pair", [0.1], "pair: "),
        ("rows", [[1.0], ["x"]], r"rows\.1\.0: 'x' is not allowed; it must be float"),
        ("parts", {"b": {"length": 1.0}}, r"parts\.b\.name: missing; Part has length, name"),
        ("parts", {"b": {"reason": 1}}, r"parts\.b\.reason: 1 is not allowed"),
        ("size", 1, "size: unknown key; Whole has"),
    ],
)
def test_what_does_not_fit_is_refused_by_its_key(key, value, message):
    with pytest.raises(InputError, match=message):
        Whole.from_dict(plain(**{key: value}), "whole.json")


@pytest.mark.parametrize("formulation", [Formulation(), Formulation("mean", springs=3)])
def test_a_field_may_be_missing_if_it_has_a_default(formulation):
    pads = {"pads": to_dict((formulation, formulation))}
    assert from_dict(dict[str, tuple[Formulation, ...]], pads) == {"pads": (formulation,) * 2}
    with pytest.raises(InputError, match=r"pads\.0\.feet: unknown key"):
        from_dict(dict[str, tuple[Formulation, ...]], {"pads": [{"feet": 2}]})
