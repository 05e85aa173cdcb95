"""Figures of systems count Hz or kHz by the size of what they show, and names keep inside."""

import numpy as np
import pytest

from squeal.analysis.answers import Step
from squeal.plots.coupling import sweep_drawing, sweep_figure
from squeal.plots.maps import chart_drawing
from squeal.plots.modes import roots_figure
from squeal.plots.style import KILO, save, style

GROWING = 0.01 + 2j * np.pi


@pytest.mark.parametrize(
    ("hertz", "unit"), [(0.27, "Hz"), (0.999 * KILO, "Hz"), (1.001 * KILO, "kHz")]
)
@pytest.mark.parametrize("grown", [0.0, 0.5, 1.0])  # where it grows most
def test_units_follow_the_frequencies(hertz, unit, grown):
    shown = 1e-3 if unit == "kHz" else 1.0
    roots = hertz * np.array([GROWING, np.conj(GROWING), -0.1 + 0.5j])
    rows = [
        Step(at, roots + hertz * 0.01 * (at == grown), np.zeros(3), "flutter")
        for at in (0.0, 0.5, 1.0)
    ]
    with style():
        figure, sweep = roots_figure(roots), sweep_figure("mu", rows)
    counted = [a for a in sweep.axes if a.get_ylabel().startswith("frequency")]
    assert len(counted) == 2
    for axes in (figure.axes[0], *counted):
        assert axes.get_ylabel().endswith(f"[{unit}]")
        heights = np.concatenate([np.asarray(c.get_offsets())[:, 1] for c in axes.collections])
        assert heights.max() == pytest.approx(hertz * shown)
    named = f"{hertz * shown:.4g} {unit}"
    for drawn in (figure, sweep):
        drawn.draw_without_rendering()
        axes = next(a for a in drawn.axes if a.texts)
        text = axes.texts[0]
        assert text.get_text() == named
        frame, box = axes.get_window_extent(), text.get_window_extent()
        assert frame.x0 < box.x0 < box.x1 < frame.x1
        assert frame.y0 < box.y0 < box.y1 < frame.y1


@pytest.mark.parametrize("name", ["$\\foo$", "cost in $", "\ud800", "\x1b[31m", "µ_Reibung"])
def test_names_of_users_are_shown_as_they_are_written(name, tmp_path):
    rows = [Step(at, np.array([GROWING]), np.zeros(1), "flutter") for at in (0.0, 1.0)]
    save(sweep_drawing("a system", name, rows), tmp_path / "sweep.png", text=False)
    codes = np.zeros((2, 2), dtype=int)
    side = np.array([0.0, 1.0])
    chart = chart_drawing("a system", (name, name), (side, side), codes)
    save(chart, tmp_path / "chart.png", text=False)
    assert (tmp_path / "sweep.png").stat().st_size > 0
    assert (tmp_path / "chart.png").stat().st_size > 0
