"""The chart of damping ratios: what grows lies below zero, and the pair that meets is named."""

import matplotlib.figure
import numpy as np
import pytest

import squeal
from squeal.cli.main import main
from squeal.errors import InputError
from squeal.plots.damping import damping_drawing
from squeal.plots.style import SINGLE

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


def test_the_title_names_the_pair_and_a_located_threshold_where_one_is_known():
    """Frequencies sqrt(1) and sqrt(3) / (2 pi) at mu = 0; they meet, and grow, from 3/4 on."""
    sweep, drawing = chart()
    first = "modes 1 + 2 (0.1592, 0.2757 Hz) meet"
    at_steps = "at $\\mu$ = 0.76; growth begins: 0.74 to 0.76"
    assert drawing.figure.axes[1].get_title("left") == f"{first}\n{at_steps}"
    found = squeal.thresholds(sweep.source.file.system, 1.0)
    exact = damping_drawing("pair", sweep, found).figure.axes[1]
    assert exact.get_title("left").endswith("growth begins at 0.75")
    (line,) = [line for line in exact.get_lines() if line.get_gid() == "onset"]
    assert np.asarray(line.get_xdata())[0] == pytest.approx(0.75, rel=1e-9)


def test_rings_mark_the_own_value_and_the_legend_gives_the_scale_of_bubbles():
    K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}
    pair = squeal.System(np.eye(2), K=K, parameters={"mu": 0.5})
    figure = damping_drawing("pair", squeal.sweep(pair, VALUES)).figure
    rings = [line for line in figure.axes[1].get_lines() if line.get_gid() == "own value"]
    expected = np.sqrt(2 + np.array([-1, 1]) * np.sqrt(1 / 3)) / (2 * np.pi)
    drawn = sorted(float(np.asarray(ring.get_ydata())[0]) for ring in rings)
    assert drawn == pytest.approx(expected, rel=1e-9)
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == ["growth rate 0.05 1/s", "growth rate 0.2 1/s", r"present $\mu$ = 0.5"]


def test_a_chart_in_a_column_has_its_panels_one_below_the_other():
    sweep, _ = chart()
    figure = damping_drawing("pair", sweep, width="column").figure
    assert figure.get_figwidth() == SINGLE
    upper, lower = (axes.get_subplotspec().get_geometry()[2] for axes in figure.axes)
    assert (upper, lower) == (0, 1)
    assert figure.axes[0].get_subplotspec().get_gridspec().ncols == 1
    with pytest.raises(InputError, match="width: 'wide' is not allowed"):
        damping_drawing("pair", sweep, width="wide")
