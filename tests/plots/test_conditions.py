"""The matrix of conditions says what blank cells are, how many modes grow, and units."""

import numpy as np

import squeal
from squeal.io.scene import read_scene
from squeal.plots.conditions import conditions_drawing
from tests.conftest import SCENES


def pairs():
    """Two pairs omega^2 = k +- sqrt(1 - mu^2), damped: both flutter from mu = 1 on, but for C."""
    K = {"1": np.diag([3.0, 3.0, 9.0, 9.0]), "mu": np.zeros((4, 4))}
    for first in (0, 2):
        K["1"][first, first + 1] = K["1"][first + 1, first] = -1.0
        K["mu"][first, first + 1] = 1.0
    return squeal.System(np.eye(4), K=K, parameters={"mu": 0.5})


def texts(drawing):
    return [text.get_text() for text in drawing.figure.axes[0].texts]


def test_cells_say_how_many_modes_grow_and_the_legend_what_blank_ones_are():
    found = squeal.conditions(pairs(), {"mu": [0.5, 2.0]})
    drawing = conditions_drawing(found, "pairs")
    assert [len(condition.modes) for condition in found.conditions] == [0, 2]
    (text,) = texts(drawing)
    assert text.endswith("(2)")
    (legend,) = drawing.figure.legends
    assert [entry.get_text() for entry in legend.get_texts()] == ["marginal"]
    assert [patch.get_hatch() for patch in drawing.figure.axes[0].patches] == ["////"]


def test_parameters_of_a_pad_have_units_and_large_numbers_powers_of_a_thousand():
    pad = read_scene(SCENES / "b1-a.yaml")
    found = squeal.conditions(pad, {"mu": [0.2, 0.4], "k1": [1.8e7, 2.0e7]})
    axes = conditions_drawing(found, "b1").figure.axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("$k_1$ [N/m]", r"$\mu$")
    assert [label.get_text() for label in axes.get_xticklabels()] == ["18e6", "20e6"]
