"""Figures of mode shapes: a rigid pad moved by its shape, the exaggeration said."""

import numpy as np
import pytest

from squeal.analysis.answers import Step
from squeal.analysis.eigenvalues import analyse
from squeal.analysis.modes import shapes_of_pad
from squeal.io.scene import read_scene
from squeal.plots.coupling import sweep_drawing, sweep_figure
from squeal.plots.modes import LARGEST, exaggeration, modes_drawing, pad_figure
from squeal.plots.style import save
from tests.conftest import SCENES


@pytest.fixture(scope="module")
def scene():
    return read_scene(SCENES / "b1-a.yaml")


def test_the_pad_moves_by_the_shape(scene):
    found = analyse(scene)
    shapes = shapes_of_pad(found, scene.pad.w)
    figure = pad_figure(scene.pad, found.q, shapes, found.spectrum.values)
    plane, *panels = figure.axes
    assert len(panels) == 3
    for one, axes in zip(shapes, panels, strict=True):
        corners = {a.get_gid(): np.array(a.get_xydata())[:4] for a in axes.get_lines()}
        moved = corners["first phase"].mean(axis=0) - corners["rest"].mean(axis=0)
        assert np.allclose(moved, LARGEST * one.shape.real[:2], atol=1e-12)
        grows = one.growth_rate > 0
        assert axes.get_title().startswith(f"mode {one.number}: ")
        assert (axes.title.get_color() != "k") == grows
        assert (f"{one.growth_rate:+.4g}" in axes.get_title()) == bool(one.growth_rate)
    assert plane.get_ylabel() == "frequency [kHz]"
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    # half a length of 0.04 m times 0.35 is 14 mm
    assert any("enlarged 14000 times" in text for text in texts)
    assert "14000" in exaggeration(scene.pad.w)
    assert "7000" in exaggeration(0.02)


def test_only_the_upper_half_plane_is_drawn():
    values = np.array([1 + 20j, 1 - 20j, -1 + 20j, -1 - 20j, 5.0, -5.0])
    axes = modes_drawing("pad", values).figure.axes[0]
    still, grows = (np.asarray(drawn.get_offsets()) for drawn in axes.collections)
    assert grows == pytest.approx(np.array([[1.0, 10 / np.pi], [5.0, 0.0]]))
    assert still == pytest.approx(np.array([[-1.0, 10 / np.pi], [-5.0, 0.0]]))
    assert axes.get_xlabel() == "growth rate [1/s]"
    assert axes.get_ylabel() == "frequency [Hz]"


GROWS = 0.01 + 2j * np.pi


@pytest.mark.parametrize(("hertz", "unit"), [(0.27, "Hz"), (1998.0, "Hz"), (2002.0, "kHz")])
@pytest.mark.parametrize("grown", [0.0, 0.5, 1.0])  # where it grows most
def test_units_follow_the_frequencies_and_names_stay_inside(hertz, unit, grown):
    shown = 1e-3 if unit == "kHz" else 1.0
    roots = hertz * np.array([GROWS, np.conj(GROWS), -0.1 + 0.5j])
    rows = [
        Step(at, roots + hertz * 0.01 * (at == grown), np.zeros(3), "flutter")
        for at in (0.0, 0.5, 1.0)
    ]
    for figure in (modes_drawing("x", roots).figure, sweep_figure("mu", rows)):
        counted = [a for a in figure.axes if a.get_ylabel().startswith("frequency")]
        for axes in counted:
            assert axes.get_ylabel().endswith(f"[{unit}]")
            heights = [np.asarray(c.get_offsets())[:, 1] for c in axes.collections]
            assert np.concatenate(heights).max() == pytest.approx(hertz * shown)
        figure.draw_without_rendering()
        axes = next(a for a in figure.axes if a.texts)
        text = axes.texts[0]
        assert text.get_text() == f"{hertz * shown:.4g} {unit}"
        frame, box = axes.get_window_extent(), text.get_window_extent()
        assert frame.x0 < box.x0 < box.x1 < frame.x1
        assert frame.y0 < box.y0 < box.y1 < frame.y1


def test_a_user_s_parameter_is_shown_as_it_is_written(tmp_path):
    rows = [Step(at, np.array([GROWS]), np.zeros(1), "flutter") for at in (0.0, 1.0)]
    save(sweep_drawing("a system", "cost in $", rows), tmp_path / "sweep.png", text=False)
    assert (tmp_path / "sweep.png").stat().st_size > 0
