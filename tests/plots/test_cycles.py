"""Branches of periodic motions: which part is drawn as stable, where what happens."""

import numpy as np
import pytest

from squeal.plots.cycles import MARKS, cycles_drawing
from squeal.queries.cycles import Cycles, Orbit


def orbit(mu: float, y: float, stable: bool | None, face: float = 0.5, turn: str = "") -> Orbit:
    """A cycle of amplitude y (micrometres)."""
    return Orbit(
        value=mu,
        period=1e-3,
        amplitude=(0.0, 1e-6 * y, 0.0),
        velocity=0.1,
        extrema={},
        peak=1.0,
        contacts=("FC",),
        multipliers=(0.5 + 0j,) * 5,
        stable=stable,
        friction=0.0,
        damping=0.0,
        face=face,
        start=(0.0,) * 6,
        turn=turn,
    )


BRANCH = (
    orbit(0.3, 1.0, False),
    orbit(0.1, 2.0, None, turn="fold"),
    orbit(0.2, 3.0, True),
    orbit(0.3, 4.0, True),
    orbit(0.4, 5.0, True, face=1.2),
)


def test_each_step_of_a_branch_is_drawn_by_its_ends():
    sliding = ((0.1, "stable"), (0.2, "stable"), (0.3, "flutter"), (0.4, None))
    changes = ((0.25, "flutter"), (0.35, None))
    found = Cycles("B2", "mu", BRANCH, own=3, sliding=sliding, critical=changes)
    drawing = cycles_drawing(found, "a pad")
    axes = drawing.figure.axes[0]
    lines = [(np.array(line.get_xydata()), line) for line in axes.get_lines()]
    steps = [(ends[:, 1].tolist(), line.get_linestyle()) for ends, line in lines[:4]]
    assert [ends for ends, _ in steps] == [[1, 2], [2, 3], [3, 4], [4, 5]]
    assert [look for _, look in steps] == ["--", "-", "-", ":"]
    (own,) = (ends for ends, line in lines if line.get_label() == "the scene")
    (fold,) = (ends for ends, line in lines if line.get_marker() == MARKS["fold"])
    still = [(ends[:, 0].tolist(), line) for ends, line in lines if not ends[:, 1].any()]
    assert [ends for ends, _ in still] == [[0.1, 0.25], [0.25, 0.35]]  # beyond there is none
    assert [line.get_linestyle() for _, line in still] == ["-", "--"]
    critical = [ends[0, 0] for ends, line in lines if line.get_gid() == "critical"]
    assert critical == [0.25, 0.35]
    assert [text.get_text() for text in axes.texts] == [
        "flutter from 0.25",
        "no equilibrium from 0.35",
    ]
    assert own.tolist() == [[0.3, 4.0]]
    assert fold.tolist() == [[0.1, 2.0]]
    assert {text.get_text() for text in drawing.figure.legends[0].get_texts()} == {
        *("cycle, unstable or undecided", "cycle, stable", "cycle, faster than the surface"),
        *("the scene", "fold", "sliding, stable", "sliding, flutter"),
    }
    assert "from 0.1 to 0.4; 4 micrometres at 0.3" in drawing.alternative


@pytest.mark.parametrize("parameter", ["mu", "k1"])
def test_the_axis_names_the_parameter_with_its_unit(parameter):
    axes = cycles_drawing(
        Cycles("B2", parameter, BRANCH, sliding=((0.3, "flutter"),)), "a pad"
    ).figure.axes[0]
    assert axes.get_xlabel().endswith("[N/m]") == (parameter == "k1")


def test_without_a_cycle_the_reason_is_said():
    drawing = cycles_drawing(Cycles("B2", "mu", reason="the motion comes to rest"), "a pad")
    assert "the motion comes to rest" in drawing.alternative
