"""Figures of mode shapes: a rigid pad moved by its shape, the exaggeration said."""

from typing import get_type_hints

import numpy as np
import pytest
from matplotlib.figure import Figure

import squeal
import squeal.plots
from squeal.analysis.eigenvalues import analyse
from squeal.analysis.modes import shapes_of_pad, sweep_modes
from squeal.errors import InputError
from squeal.io.scene import read_scene
from squeal.plots.modes import eigenvalue_figure, pad_figure
from squeal.plots.parts import LARGEST, exaggeration
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
        assert (f"{one.growth_rate:+.3g}" in axes.get_title()) == bool(one.growth_rate)
    assert plane.get_ylabel() == "frequency [kHz]"
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    # half a length of 0.04 m times 0.35 is 14 mm
    assert any("enlarged 14000 times" in text for text in texts)
    assert "14000" in exaggeration(scene.pad.w)
    assert "7000" in exaggeration(0.02)


def test_only_the_upper_half_plane_is_drawn():
    values = np.array([1 + 20j, 1 - 20j, -1 + 20j, -1 - 20j, 5.0, -5.0])
    axes = eigenvalue_figure(values).axes[0]
    points = np.asarray(axes.collections[0].get_offsets())
    assert len(points) == 4
    assert points[:, 1] == pytest.approx([20 / (2 * np.pi)] * 2 + [0, 0])
    assert axes.get_xlabel() == "growth rate [1/s]"
    assert axes.get_ylabel() == "frequency [Hz]"


def test_public_figures_take_results_and_return_figures(scene):
    assert dir(squeal.plots) == sorted(squeal.plots.__all__)
    figures = [
        squeal.plots.mode_figure(scene),
        squeal.plots.coupling_figure(sweep_modes(scene, 0.0, 0.5)),
    ]
    assert all(isinstance(figure, Figure) for figure in figures)
    for name in squeal.plots.__all__:
        if name == "draw":
            continue
        assert get_type_hints(getattr(squeal.plots, name))["return"] is Figure
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        squeal.plots.nothing  # noqa: B018
    with pytest.raises(InputError, match=r"mode_figure: .* must be a Scene"):
        squeal.plots.mode_figure("pad.yaml")
