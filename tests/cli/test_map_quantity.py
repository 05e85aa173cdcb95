"""`squeal map --quantity`: numbers, files and pictures of contour maps."""

import json
import re

import numpy as np
import pytest

from squeal.analysis.stack import PadStack
from squeal.cli.main import main
from tests.conftest import SCENES

B3 = str(SCENES / "b3.yaml")


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
