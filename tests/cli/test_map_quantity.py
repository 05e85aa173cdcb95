"""`squeal map --quantity`: numbers, files and pictures of contour maps."""

import csv
import json
import re

import numpy as np
import pytest

from squeal.analysis.stack import PadStack
from squeal.analysis.thresholds import critical_friction
from squeal.cli.main import main
from squeal.io.scene import read_scene
from tests.conftest import SCENES

B3 = str(SCENES / "b3.yaml")


def test_values_are_those_of_single_scenes(capsys, tmp_path):
    table, picture = tmp_path / "map.csv", tmp_path / "map.svg"
    files = ["--csv", str(table), "--pdf", str(picture)]
    assert main(["map", B3, "--n", "4", "--quantity", "critical-friction", "--json", *files]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["quantity"] == "critical-friction"
    assert sum(found["share"].values()) == pytest.approx(1.0)
    scene = read_scene(B3)
    middles = np.pi * (np.arange(4) + 0.5) / 4
    with table.open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert list(rows[0])[2:] == ["verdict", "critical-friction"]
    for i, a in enumerate(middles):
        for j, b in enumerate(middles):
            loss = critical_friction(scene.replace(alpha1=float(a), alpha2=float(b))).first
            value = found["values"][i][j]
            written = rows[4 * i + j]["critical-friction"]
            if loss is None:
                assert value is None
                assert written == ""
            else:
                assert value == pytest.approx(loss.mu, rel=1e-9)
                assert float(written) == value
    assert picture.read_text().startswith("<?xml")


def test_values_that_could_not_be_decided_are_told(capsys, monkeypatch):
    losses = PadStack.first_losses

    def undecided(stack, mu_max):
        found = losses(stack, mu_max)
        return found._replace(unknown=np.ones(stack.n, dtype=bool))

    monkeypatch.setattr(PadStack, "first_losses", undecided)
    query = ["map", B3, "--n", "2", "--quantity", "critical-friction", "--json"]
    assert main(query) == 0
    out, err = capsys.readouterr()
    found = json.loads(out)
    (words,) = found["warnings"]
    assert "100 %" in words
    assert words in err
    assert found["admissible"]  # the warning speaks of the quantity, not of equilibria


def test_people_are_given_the_range_and_its_unit(capsys):
    assert main(["map", B3, "--n", "6", "--quantity", "growth"]) == 0
    assert "growth rate of the most unstable mode: 0 to " in capsys.readouterr().out


def test_logarithmic_axes_in_files_and_figures(capsys, tmp_path):
    cells, drawing = tmp_path / "m.csv", tmp_path / "m.svg"
    files = ("--csv", str(cells), "--pdf", str(drawing), "--n", "10", "--json")
    ranges = ("--first", "k1:1e6:1e10:log", "--second", "mu:0:0.7")
    assert main(["map", B3, *ranges, *files]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [axis["scale"] for axis in found["axes"]] == ["log", "linear"]
    values = sorted({float(row.split(",")[0]) for row in cells.read_text().splitlines()[1:]})
    assert values[5] / values[4] == pytest.approx(10**0.4)
    # the axes tell their units, and no power of ten stands beside their end
    shown = re.sub(r"<metadata>.*</metadata>", "", drawing.read_text(), flags=re.DOTALL)
    assert "1e" not in re.sub(r"<[^>]*>", "", shown)
    for wrong in ("k1:1e6:1e10:lin", "k1:0:1e10:log", "k1:1e6:1e10:log:log"):
        assert main(["map", B3, "--first", wrong]) == 2
        assert "--first" in capsys.readouterr().err
