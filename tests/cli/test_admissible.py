"""A word about equilibria that the model does not mean: the same in every command."""

import csv

import pytest
import yaml

from squeal.io.scene import Scene
from tests.cli.calls import answer
from tests.conftest import random_pad

# beyond a fold that its branch passes twice, and beyond one from which it does not come back
TWICE = Scene("B2", random_pad(1014, "B2"))
NEVER = Scene("B2", random_pad(1018, "B2"))


@pytest.mark.parametrize("F_n", [0.05, None])
def test_a_motion_from_an_equilibrium_says_so_too(capsys, tmp_path, F_n):
    scene = TWICE.replace(F_n=F_n) if F_n else TWICE.replace(mu=0.1)
    path = tmp_path / "pad.yaml"
    document = scene.to_dict() | {"initial": "equilibrium", "time": {"stop": 0.1, "samples": 2}}
    path.write_text(yaml.safe_dump(document))
    expected = answer(capsys, "eigenvalues", path)["warnings"]
    found = answer(capsys, "simulate", path)
    assert (found["admissible"], found["warnings"]) == (not expected, expected)
    assert bool(expected) == bool(F_n)


@pytest.mark.parametrize("scene", [TWICE, NEVER], ids=["twice", "never"])
def test_beyond_a_fold_every_command_says_so(capsys, scene, tmp_path):
    beyond = tmp_path / "pad.yaml"
    beyond.write_text(yaml.safe_dump(scene.to_dict()))
    parameters = yaml.safe_load(beyond.read_text())["parameters"]
    mu = parameters["mu"]
    h = parameters["h"]
    found = answer(capsys, "eigenvalues", beyond, "--mu", f"0:{mu}:3")
    assert found["admissible"] is False
    assert "fold" in found["warnings"][0]
    assert "tilted" in found["warnings"][1]
    assert found["warnings"][-1].startswith("sweep: ")
    assert [step["admissible"] for step in found["sweep"]][::2] == [True, False]
    advised = answer(capsys, "advise", beyond, "--mu-max", "0.1")
    assert (advised["admissible"], advised["warnings"]) == (False, found["warnings"][:-1])
    listed = answer(capsys, "sliding", beyond)
    assert listed["admissible"] is False
    assert not any(e["admissible"] for e in listed["equilibria"])
    assert {e["x"] for e in listed["equilibria"]} >= {found["equilibrium"]["x"]}
    assert found["warnings"][0] in listed["warnings"]
    critical = answer(capsys, "critical-friction", beyond)
    assert critical["admissible"] is False
    assert "fold" in critical["warnings"][-1]
    cells = tmp_path / "cells.csv"
    narrow = ("--first", f"mu:{mu - 1e-6}:{mu + 1e-6}", "--second", f"h:{h - 1e-9}:{h + 1e-9}")
    mapped = answer(capsys, "map", beyond, *narrow, "--n", "2", "--csv", cells)
    assert (mapped["admissible"], mapped["admissible_share"]) == (False, 0.0)
    assert mapped["share"]["beyond a fold"] == 1.0
    with cells.open() as stream:
        assert {row["admissible"] for row in csv.DictReader(stream)} == {"0"}
