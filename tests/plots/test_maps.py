"""Pictures of maps: own pad, units of axes, areas and shares, names of users."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.collections import QuadMesh

import squeal
from squeal.errors import InputError
from squeal.io.scene import read_scene
from squeal.model.pad import PARAMETERS
from squeal.plots import maps
from squeal.plots.coupling import sweep_drawing
from squeal.plots.style import save
from squeal.queries.pads.maps import NAMES, angle_axes
from squeal.results.map import Axis, Map
from squeal.results.sweep import Step, Sweep
from tests.conftest import SCENES

B3 = SCENES / "b3.yaml"


def test_own_pad_and_its_level_are_drawn():
    scene = read_scene(B3)
    low = 0.5 * scene.pad.k_c
    high = 2 * scene.pad.k_c
    axes = Axis("alpha1", 0.2, 2.8, 8), Axis("k_c", low, high, 8)
    found = squeal.map(scene, axes, quantity="critical-friction")
    own = (scene.pad.alpha1, scene.pad.k_c)
    level = float(np.nanmedian(found.quantity[2]))
    panel = maps.map_drawing("b3", found, own, level=level).figure.axes[0]
    (mark,) = [line for line in panel.get_lines() if line.get_gid() == "own pad"]
    assert np.asarray(mark.get_xydata())[0] == pytest.approx(own)
    assert "N/m" in panel.get_ylabel()
    assert panel.get_xlabel() == r"$\alpha_1$ [rad]"
    (legend,) = maps.map_drawing("b3", found, own).figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["no critical friction", "the scene"]
    values = np.nan_to_num(found.quantity[2])
    filled = replace(found, quantity=(*found.quantity[:2], values))
    aside = (scene.pad.alpha1, 2.1 * scene.pad.k_c)
    assert not maps.map_drawing("b3", filled, aside).figure.legends
    outside = maps.map_drawing("b3", found, aside).figure.axes[0]
    assert not [line for line in outside.get_lines() if line.get_gid() == "own pad"]


def test_a_map_of_one_value_is_not_the_grey_of_no_value():
    """It was, since one value has no contours."""
    side = Axis("alpha1", 0.2, 2.8, 3), Axis("k_c", 1.0, 2.0, 3)
    values = np.full((3, 3), 0.4)
    values[0, 0] = np.nan
    quantity = "critical-friction", "", values
    found = Map("b3", side, ("rad", "N/m"), NAMES, np.zeros((3, 3), dtype=int), quantity)
    panel = maps.map_drawing("b3", found, (1.0, 1.5)).figure.axes[0]
    (cells,) = panel.collections
    assert np.ma.count(cells.get_array()) == 8  # where there is none grey shows through


def test_a_row_of_values_is_drawn_as_cells_and_a_map_without_curves_says_so():
    axes = Axis("mu", 0.1, 0.9, 1), Axis("k1", 1.9e7, 2.1e7, 3)
    found = squeal.map(read_scene(B3), axes, quantity="growth")
    (cells,) = maps.map_drawing("b3", found, (0.3, 2e7)).figure.axes[0].collections
    assert cells.get_array().size == 3
    with pytest.raises(InputError, match="curves=True"):
        found.curves()


@pytest.mark.parametrize("name", PARAMETERS)
def test_each_parameter_of_a_pad_has_a_symbol(name):
    text = maps.symbol(name).replace("\\", "")
    assert [letter for letter in text if letter.isalnum()] == [*name.replace("_", "")]


def test_areas_are_drawn_and_their_shares_said(tmp_path):
    found = squeal.map(read_scene(B3), angle_axes(16))
    found.save(tmp_path / "map.pdf")
    data = (tmp_path / "map.pdf").read_bytes()
    for verdict, share in found.share.items():
        assert not share or f"{verdict} {100 * share:.1f} %".encode() in data


@pytest.mark.parametrize("name", ["$\\foo$", "cost in $", "\ud800", "\x1b[31m", "µ_Reibung"])
def test_names_of_users_are_shown_as_they_are_written(name, tmp_path):
    side = Axis(name, 0.0, 1.0, 2)
    found = Map("a system", (side, side), ("", ""), NAMES, np.zeros((2, 2), dtype=int))
    rows = [Step(at, np.array([0.01 + 2j * np.pi]), np.zeros(1), "flutter") for at in (0.0, 1.0)]
    sweep = Sweep("a system", name, tuple(rows))
    for drawing in (maps.map_drawing("a system", found), sweep_drawing("a system", sweep)):
        save(drawing, tmp_path / "chart.png", text=False)
        assert (tmp_path / "chart.png").stat().st_size > 0
        (tmp_path / "chart.png").unlink()


def test_cells_of_a_map_end_where_its_axes_say():
    """On a logarithmic axis, and of an axis of one value, which drew nothing."""
    K = {"1": 2 * np.eye(2), "gap": np.diag([1.0, -1.0]), "mu": [[0, 1], [-1, 0]]}
    pair = squeal.System(np.eye(2), K=K, parameters={"gap": 0.5})
    gap = squeal.Axis("gap", 1e-3, 1.0, 3, log=True)
    drawn = squeal.map(pair, (squeal.Axis("mu", 0.0, 1.0, 1), gap)).plot()
    (mesh,) = (one for one in drawn.collections if isinstance(one, QuadMesh))
    corners = np.asarray(mesh.get_coordinates())
    assert corners[:, 0, 1] == pytest.approx([1e-3, 1e-2, 1e-1, 1.0])
    assert corners[0, :, 0] == pytest.approx([0.0, 1.0])
