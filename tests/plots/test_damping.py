"""The chart of damping ratios: what grows lies below zero, and the pair that meets is named."""

import functools

import matplotlib.figure
import numpy as np
import pytest
from matplotlib.colors import to_rgb

import squeal
from squeal.cli.main import main
from squeal.errors import InputError
from squeal.plots.damping import COLOURS, damping_drawing
from squeal.plots.style import SINGLE
from squeal.queries.sweep import eigenvalue_paths

VALUES = np.linspace(0.0, 1.0, 26).tolist()


@functools.cache
def sweep_of_pair():
    return sweep_with(None)


def sweep_with(C):
    """omega^2 = 2 +- sqrt(1 - 4 mu / 3), and a third mode far away that never grows."""
    K = {"1": np.diag([2.0, 2.0, 90.0]), "mu": np.zeros((3, 3))}
    K["1"][0, 1] = K["1"][1, 0] = -1.0
    K["mu"][0, 1] = 4 / 3
    return squeal.sweep(squeal.System(np.eye(3), C, K, name="pair"), VALUES)


def chart(C=None):
    sweep = sweep_of_pair() if C is None else sweep_with(C)
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
    title = "modes 1 + 2 meet near $\\mu$ = 0.75; growth from 0.72 to 0.76 on"
    assert drawing.figure.axes[1].get_title("left") == title
    found = squeal.thresholds(sweep.source.file.system, 1.0)
    exact = damping_drawing("pair", sweep, found).figure.axes[1]
    assert exact.get_title("left").endswith("growth from 0.75 on")
    (line,) = [line for line in exact.get_lines() if line.get_gid() == "onset"]
    assert np.asarray(line.get_xdata())[0] == pytest.approx(0.75, rel=1e-9)


def test_rings_mark_the_own_value_and_the_legend_gives_the_scale_of_bubbles():
    K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}
    pair = squeal.System(np.eye(2), K=K, parameters={"mu": 0.52})
    figure = damping_drawing("pair", squeal.sweep(pair, VALUES)).figure
    rings = [line for line in figure.axes[1].get_lines() if line.get_gid() == "own value"]
    expected = np.sqrt(2 + np.array([-1, 1]) * np.sqrt(1 - 4 * 0.52 / 3)) / (2 * np.pi)
    drawn = sorted(float(np.asarray(ring.get_ydata())[0]) for ring in rings)
    assert drawn == pytest.approx(expected, rel=1e-9)
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == ["growth rate 0.05 1/s", "growth rate 0.2 1/s", r"present $\mu$ = 0.52"]


def test_a_chart_in_a_column_has_its_panels_one_below_the_other():
    sweep = sweep_of_pair()
    figure = damping_drawing("pair", sweep, width="column").figure
    assert figure.get_figwidth() == SINGLE
    upper, lower = (axes.get_subplotspec().get_geometry()[2] for axes in figure.axes)
    assert (upper, lower) == (0, 1)
    assert figure.axes[0].get_subplotspec().get_gridspec().ncols == 1
    with pytest.raises(InputError, match="width: 'wide' is not allowed"):
        damping_drawing("pair", sweep, width="wide")


def test_options_of_the_chart_of_damping_are_refused_without_it():
    """Thresholds were ignored in silence, and so were those of another subject."""
    sweep = sweep_of_pair()
    found = squeal.thresholds(squeal.System([[1.0]], K={"1": [[1.0]], "mu": [[1.0]]}))
    with pytest.raises(InputError, match="thresholds: are of the figure with damping=True alone"):
        sweep.plot(thresholds=found)
    with pytest.raises(InputError, match="width: is of the figure with damping=True alone"):
        sweep.plot(width="column")


@pytest.mark.parametrize("damping", [False, True])
def test_a_sweep_of_one_value_is_drawn_about_it(damping):
    """Equal limits of an axis made Matplotlib warn."""
    pair = squeal.System(np.eye(2), K={"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]})
    for value in (0.5, 1.0):  # without and with growth
        axes = squeal.sweep(pair, [value]).plot(damping=damping)
        for panel in axes.figure.axes[:3]:
            low, high = panel.get_xlim()
            assert low < high


SKEW = np.array([[0.0, 1.0], [-1.0, 0.0]])


def alone(system, values):
    """Title and labels of the second panel, and the alternative text."""
    drawing = damping_drawing("alone", squeal.sweep(system, values))
    axes = drawing.figure.axes[1]
    return axes.get_title("left"), axes.get_ylabel(), drawing.alternative


def test_a_mode_that_loses_its_damping_beside_another_one_grows_alone():
    """2 - 10 mu damps the first of two uncoupled modes, whose frequencies are 2 % apart."""
    C = {"1": 2.0 * np.eye(2), "mu": np.diag([-10.0, 0.0])}
    system = squeal.System(np.eye(2), C, np.diag([1e4, 1.04e4]))
    title, label, text = alone(system, VALUES)
    assert title.startswith("mode 1 grows alone, from ")
    assert label == "damping ratio [%]"
    assert "meets" not in text


def test_of_two_whirls_of_one_frequency_the_forward_one_grows_alone():
    """z'' + 3 z' + (1e4 - i W) z = 0 of z = x + i y grows from W = 300 on."""
    system = squeal.System(
        np.eye(2), 3 * np.eye(2), {"1": 1e4 * np.eye(2), "Omega": SKEW}, parameter="Omega"
    )
    title, _, text = alone(system, np.arange(5.0, 400.0, 10.0))
    assert title.endswith("grows alone, from 295 to 305 rad/s on")
    assert "meets" not in text


def test_a_wheel_of_two_equal_modes_that_friction_couples_is_a_pair():
    """The same two motions, fed by friction: neither grows without the other."""
    K = {"1": 1e4 * np.eye(2), "mu": 1e3 * SKEW}
    _, label, text = alone(squeal.System(np.eye(2), 3 * np.eye(2), K), VALUES)
    assert label == "frequency [Hz]"
    assert "come together" in text


def test_modes_numbered_beyond_their_meeting_are_followed_back_to_before_it():
    """Equal damping of both: they coalesce to the last digit, at mu = 3/4."""
    K = {"1": [[2e6, -1e6], [-1e6, 2e6]], "mu": [[0, 4e6 / 3], [0, 0]]}
    system = squeal.System(np.eye(2), 10 * np.eye(2), K, parameters={"mu": 0.9})
    found = squeal.thresholds(system, 1.2)
    drawing = damping_drawing("pair", eigenvalue_paths(found, 0.0, 1.2), found)
    title = drawing.figure.axes[1].get_title("left")
    assert title.startswith("modes 1 + 2 meet near $\\mu$ = 0.75")
    assert title.endswith(f"growth from {found.first.mu:.4g} on")
    starts = curves(drawing.figure, "pair")
    first = np.sqrt(np.array([1e6, 3e6]) - 25.0) / (2 * np.pi)
    assert [starts[f"pair {k}"][1][0] for k in (1, 2)] == pytest.approx(first.tolist(), rel=1e-9)


def test_each_of_three_pairs_that_meet_has_a_panel_and_more_are_counted():
    """Pairs of frequencies in the ratios 1 : 2 : 3 : 4, all of which flutter from 3/4 on."""
    ratios = np.diag([1.0, 4.0, 9.0, 16.0])
    for count in (3, 4):
        K = {"1": np.kron(ratios[:count, :count], np.array([[2.0, -1.0], [-1.0, 2.0]]))}
        K["mu"] = np.kron(ratios[:count, :count], np.array([[0.0, 4 / 3], [0.0, 0.0]]))
        sweep = squeal.sweep(squeal.System(np.eye(2 * count), K=K), VALUES)
        first, *panels = damping_drawing("pairs", sweep).figure.axes
        assert len(panels) == 3
        assert all(
            "meet near $\\mu$ = 0.75; growth from 0.72 to 0.76 on" in axes.get_title("left")
            for axes in panels
        )
        assert ("the first 3 of 4" in first.get_title("left")) == (count == 4)


def test_colours_of_modes_differ_for_every_kind_of_colour_vision():
    """By the matrices of Machado, Oliveira and Fernandes (2009), in CIELAB: no two within 15."""
    sight = {
        "normal": np.eye(3),
        "protan": [[0.1523, 1.0526, -0.2049], [0.1145, 0.7863, 0.0992], [-0.0039, -0.0481, 1.0520]],
        "deutan": [[0.3673, 0.8606, -0.2280], [0.2801, 0.6725, 0.0474], [-0.0118, 0.0429, 0.9689]],
        "tritan": [[1.2555, -0.0767, -0.1788], [-0.0784, 0.9308, 0.1476], [0.0047, 0.6914, 0.3039]],
    }
    to_xyz = [[0.4125, 0.3576, 0.1804], [0.2127, 0.7152, 0.0722], [0.0193, 0.1192, 0.9503]]
    signals = np.array([to_rgb(colour) for colour in COLOURS])
    linear = np.where(signals <= 0.04045, signals / 12.92, ((signals + 0.055) / 1.055) ** 2.4)
    for name, matrix in sight.items():
        seen = np.clip(linear @ np.asarray(matrix, dtype=float).T, 0.0, 1.0)
        x, y, z = np.cbrt(seen @ np.transpose(to_xyz) / [0.9505, 1.0, 1.0888]).T
        lab = np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)]).T
        distances = np.linalg.norm(lab[:, None] - lab, axis=2)
        assert distances[np.triu_indices(len(lab), 1)].min() > 15.0, name
