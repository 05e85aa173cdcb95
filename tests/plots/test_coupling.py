"""The figure of modes over a parameter shows what it is given: thresholds, growing modes, units."""

import itertools

import numpy as np
import pytest
from matplotlib.figure import Figure

import squeal
from squeal.plots.coupling import (
    LABEL,
    _draw_modes,
    _panels,
    _Roots,
    mark_events,
    sweep_drawing,
)


def artists(figure, gid):
    found = []
    for axes in figure.axes:
        found += [artist for artist in axes.get_lines() if artist.get_gid() == gid]
        found += [artist for artist in axes.patches if artist.get_gid() == gid]
    return found


def test_the_background_changes_at_the_threshold_and_the_growing_mode_is_said():
    """omega^2 = 2 +- sqrt(1 - 4 mu / 3): flutter from 3/4 on."""
    K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}
    pair = squeal.System([[1, 0], [0, 1]], K=K)
    sweep = squeal.sweep(pair, np.linspace(0.0, 1.0, 101).tolist())
    found = squeal.thresholds(pair, 1.0)
    figure = sweep_drawing("pair", sweep, found, own_value=0.6).figure
    shaded = artists(figure, "flutter")
    assert len(shaded) == 2  # of frequency and growth
    for span in shaded:
        assert span.get_x() == pytest.approx(0.75, rel=1e-12)
        assert span.get_x() + span.get_width() == pytest.approx(1.0)
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words[0] == "unstable"
    assert r"flutter from $\mu$ = 0.75, 0.2251 Hz" in words
    assert r"present $\mu$ = 0.6" in words
    curves = [artists(figure, f"mode {k}")[0].get_data() for k in (1, 2)]
    lower = np.sqrt(2 + 0j - np.sqrt(1 + 0j - 4 * sweep.steps[40].value / 3)).real
    assert curves[0][1][40] == pytest.approx(lower / (2 * np.pi), rel=1e-9)
    omega = np.sqrt(2 + 1j / np.sqrt(3)).real  # omega^2 = 2 + i sqrt(4 mu / 3 - 1) at mu = 1
    for _, frequency in curves:
        assert frequency[-1] == pytest.approx(omega / (2 * np.pi), rel=1e-9)
    (shaded, *_) = artists(sweep_drawing("pair", sweep).figure, "flutter")
    assert shaded.get_x() == min(s.value for s in sweep.steps if s.value > 0.75 + 1e-12)


def test_a_mode_with_two_real_roots_is_two_lines():
    """s^2 + c s + 1 has the roots -c/2 +- sqrt(c^2/4 - 1), real from c = 2 on."""
    C = {"c": np.diag([1.0, 0.1])}
    damped = squeal.System(np.eye(2), C, np.diag([1.0, 3.0]), {"c": 3.0}, parameter="c")
    figure = sweep_drawing("damped", squeal.sweep(damped, np.linspace(2.5, 4.0, 7).tolist())).figure
    upper, _, lower, _ = figure.axes
    assert [line.get_gid() for line in upper.lines] == ["mode 1", "mode 1", "mode 2"]
    faster, slower = (line for line in lower.lines if line.get_gid() == "mode 1")
    for line, sign in ((faster, 1.0), (slower, -1.0)):
        c = np.asarray(line.get_xdata(), dtype=float)
        rates = np.asarray(line.get_ydata(), dtype=float)
        assert c == pytest.approx(np.linspace(2.5, 4.0, 7))
        assert rates == pytest.approx(-c / 2.0 + sign * np.sqrt(c**2 / 4.0 - 1.0))


def test_roots_without_a_number_are_dark_only_where_they_grow():
    """Roots without a number are no common mode: the one that grows is red, all others are pale."""
    at = np.repeat([0.0, 1.0, 2.0], 2)
    values = np.array([1j, 2j - 0.1, 1j + 0.1, 2j - 0.1, 1j, 2j - 0.1])
    grow = values.real > 0.0
    roots = _Roots(at, values, grow, np.zeros(6, dtype=int))
    panels = _panels("mu", roots, (0.0, 2.0))
    _draw_modes(panels, roots)
    pale, dark, red = (np.size(dots.get_offsets()) // 2 for dots in panels.upper.collections)
    assert (pale, dark, red) == (5, 0, 1)


def test_the_axis_of_growth_follows_what_grows():
    """The third mode decays by 50 1/s, the pair grows by 0.205 1/s at mu = 1."""
    K = {"1": np.diag([2.0, 2.0, 9000.0]), "mu": np.zeros((3, 3))}
    K["1"][0, 1] = K["1"][1, 0] = -1.0
    K["mu"][0, 1] = 4 / 3
    triple = squeal.System(np.eye(3), np.diag([0.0, 0.0, 100.0]), K)
    for values, largest in (([0.0, 0.5, 1.0], 0.205), ([0.0, 0.5], 50.0)):
        _, locus, lower, _ = sweep_drawing("three", squeal.sweep(triple, values)).figure.axes
        assert lower.get_ylim()[1] == pytest.approx(1.1 * largest, rel=0.2)
        assert locus.get_xlim() == lower.get_ylim()


@pytest.mark.parametrize("values", [(0.30, 0.31, 0.33), (0.05, 0.06), (0.2, 0.5), (0.5, 0.5, 0.5)])
def test_labels_of_events_do_not_overlap(values):
    figure = Figure()
    upper, lower = figure.subplots(2, 1)
    mark_events([(mu, "partial", ":") for mu in values], upper, lower)
    intervals = []
    for text in lower.texts:
        at, _ = text.xy
        intervals.append((at - LABEL, at) if text.get_ha() == "right" else (at, at + LABEL))
    assert intervals[0][0] >= 0.0
    for (_, end), (begin, _) in itertools.pairwise(intervals):
        assert begin >= end
