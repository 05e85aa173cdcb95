"""The chart of damping ratios: what grows lies below zero, and the pair that meets is named."""

import matplotlib.figure
import numpy as np
import pytest

import squeal
from squeal.cli.main import main
from squeal.plots.damping import damping_drawing

VALUES = np.linspace(0.0, 1.0, 51).tolist()


def chart(C=None):
    """omega^2 = 2 +- sqrt(1 - 4 mu / 3), and a third mode far away that never grows."""
    K = {"1": np.diag([2.0, 2.0, 90.0]), "mu": np.zeros((3, 3))}
    K["1"][0, 1] = K["1"][1, 0] = -1.0
    K["mu"][0, 1] = 4 / 3
    sweep = squeal.sweep(squeal.System(np.eye(3), C, K, name="pair"), VALUES)
    return sweep, damping_drawing("pair", sweep)


def curves(figure: matplotlib.figure.Figure, kind: str) -> dict[str, np.ndarray]:
    lines = [line for axes in figure.axes for line in axes.get_lines()]
    named = {str(line.get_gid()): np.array(line.get_data()) for line in lines}
    return {gid: data for gid, data in named.items() if gid.startswith(kind)}


def test_ratio_and_frequency_are_those_of_the_closed_form():
    _, drawing = chart()
    root = np.sqrt(-2 + 0j + 1j * np.sqrt(4 / 3 - 1))  # at mu = 1, the one that grows
    root = root if root.real > 0 else -root
    lowest = min(curves(drawing.figure, "mode").values(), key=lambda xy: xy[1].min())
    assert lowest[0][-1] == pytest.approx(abs(root.imag) / (2 * np.pi), rel=1e-9)
    assert lowest[1][-1] == pytest.approx(-100 * root.real / abs(root), rel=1e-9)
    assert len(curves(drawing.figure, "mode")) == 3
    assert len(curves(drawing.figure, "pair")) == 2  # the third mode is no partner
    (span,) = [p for p in drawing.figure.axes[1].patches if p.get_gid() == "onset"]
    assert span.get_x() <= 0.75 <= span.get_x() + span.get_width()
    assert "1 modes grow" not in drawing.alternative
    assert "1 mode grows" in drawing.alternative


def test_the_axis_of_damping_follows_what_grows_and_a_stable_brake_says_so():
    _, drawing = chart(np.diag([0.0, 0.0, 15.0]))  # the third is damped by 79 %
    low, high = drawing.figure.axes[0].get_ylim()
    assert low < 0.0 < high < 40.0
    _, calm = chart(4.0 * np.eye(3))
    assert calm.figure.axes[1].get_title("left") == "no mode grows"


def test_the_command_draws_it_and_needs_a_sweep(tmp_path, capsys):
    (tmp_path / "pair.yaml").write_text(
        "M: [[1, 0], [0, 1]]\nK0: [[2, -1], [-1, 2]]\nK1: [[0, 1.3], [0, 0]]\n"
    )
    file = str(tmp_path / "pair.yaml")
    chart_file = tmp_path / "chart.svg"
    assert main(["eigenvalues", file, "--sweep", "0:1:21", "--chart", str(chart_file)]) == 0
    assert "damping ratio" in chart_file.read_text()
    assert main(["eigenvalues", file, "--chart", str(tmp_path / "other.svg")]) == 2
    assert "--chart" in capsys.readouterr().err
