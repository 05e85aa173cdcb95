"""`squeal map --quantity`: numbers, files and pictures of contour maps."""

import csv
import json
import re

import numpy as np
import pytest
from matplotlib.figure import Figure

from squeal.analysis.maps import Axis, field_of
from squeal.analysis.thresholds import critical_friction
from squeal.cli.main import main
from squeal.io.scene import read_scene
from squeal.plots.maps import contour_figure, settle, symbol, unit_of
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


def test_people_are_given_the_range_and_its_unit(capsys):
    assert main(["map", B3, "--n", "6", "--quantity", "growth"]) == 0
    assert "growth rate of the most unstable mode: 0 to " in capsys.readouterr().out


def test_another_quantity_is_refused_in_one_sentence(capsys):
    assert main(["map", B3, "--quantity", "colour"]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_own_pad_and_its_level_are_drawn():
    scene = read_scene(B3)
    axes = (Axis("alpha1", 0.2, 2.8, 12), Axis("k_c", 0.5 * scene.pad.k_c, 2 * scene.pad.k_c, 12))
    found = field_of(scene, axes, "critical-friction")
    own = (scene.pad.alpha1, scene.pad.k_c)
    figure = contour_figure(found, own, float(np.nanmedian(found.values)))
    panel = figure.axes[0]
    (mark,) = [line for line in panel.get_lines() if line.get_gid() == "own pad"]
    place = np.asarray(mark.get_xydata())[0] * [unit_of(axis) for axis in axes]
    assert place == pytest.approx(own)
    assert "N/m" in panel.get_ylabel()
    assert panel.get_xlabel() == r"$\alpha_1$ [rad]"
    outside = contour_figure(found, (scene.pad.alpha1, 2.1 * scene.pad.k_c)).axes[0]
    assert not [line for line in outside.get_lines() if line.get_gid() == "own pad"]


@pytest.mark.parametrize(
    ("name", "shown"),
    [("alpha1", r"$\alpha_1$"), ("k_c", "$k_c$"), ("mu", r"$\mu$"), ("F_n", "$F_n$"), ("w", "$w$")],
)
def test_symbols(name, shown):
    assert symbol(name) == shown


def test_numbers_of_an_axis_stay_below_a_thousand():
    assert unit_of(Axis("alpha1", 0.0, np.pi, 3)) == np.pi
    assert unit_of(Axis("k1", 2e7, 3e8, 3)) == 1e6
    assert unit_of(Axis("w", 0.01, 0.08, 3)) == 1e-3


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


@pytest.mark.parametrize(
    ("axis", "label"),
    [
        (Axis("mu", 0.0, 0.7, 5), r"$\mu$"),
        (Axis("k1", 1e6, 1e8, 5, log=True), "$k_1$ [N/m]"),
        (Axis("k1", 1e6, 1e8, 5), "$k_1$ [$10^{6}$ N/m]"),
        (Axis("w", 0.01, 0.06, 5), "$w$ [$10^{-3}$ m]"),
        (Axis("mu", 0.0, 1e-4, 5), r"$\mu$ [$10^{-6}$]"),
    ],
)
def test_axes_say_their_unit_and_power(axis, label):
    figure = Figure()
    axes = figure.add_subplot()
    settle(axes, (axis, Axis("h", 0.1, 1.0, 5)), None)
    assert axes.get_xlabel() == label
    figure.canvas.draw()
    assert axes.xaxis.get_offset_text().get_text() == ""
