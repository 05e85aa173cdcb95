"""Eigenvalues in the plane, shapes of pads with their exaggeration, and shapes on nodes."""

from typing import Any

import numpy as np
import pytest

from squeal.io.coordinates import Coordinates
from squeal.io.scene import read_scene
from squeal.io.shapes import unit_displacements
from squeal.plots import modes
from squeal.plots.modes import shape_drawing
from squeal.queries.pads.equilibrium import analyse
from squeal.results.eigenvalues import mode_shapes
from squeal.results.sweep import Step
from tests.conftest import SCENES


def test_the_pad_moves_by_the_shape():
    scene = read_scene(SCENES / "b1-a.yaml")
    found = analyse(scene)
    shapes = mode_shapes(found.spectrum, (1.0, 1.0, scene.pad.w))
    figure = modes.pad_figure(scene.pad, found.q, shapes, found.spectrum.eigenvalues)
    plane, *panels = figure.axes
    assert len(panels) == 3
    for one, axes in zip(shapes, panels, strict=True):
        corners = {a.get_gid(): np.array(a.get_xydata())[:4] for a in axes.get_lines()}
        moved = corners["first phase"].mean(axis=0) - corners["rest"].mean(axis=0)
        assert np.allclose(moved, modes.LARGEST * one.shape.real[:2], atol=1e-12)
        grows = one.growth_rate > 0
        assert axes.get_title().startswith(f"mode {one.number}: ")
        assert (axes.title.get_color() != "k") == grows
        assert (f"{one.growth_rate:+.4g}" in axes.get_title()) == bool(one.growth_rate)
    assert plane.get_ylabel() == "frequency [Hz]"
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    # half a length of 0.04 m times 0.35 is 14 mm
    assert any("enlarged 14000 times" in text for text in texts)
    assert "14000" in modes.exaggeration(scene.pad.w)
    assert "7000" in modes.exaggeration(0.02)


def test_only_the_upper_half_plane_is_drawn():
    values = np.array([1 + 20j, 1 - 20j, -1 + 20j, -1 - 20j, 5.0, -5.0])
    roots = Step(0.0, values, np.zeros(6), None).eigenvalues
    axes = modes.modes_drawing("pad", roots).figure.axes[0]
    still, grows = (np.asarray(drawn.get_offsets()) for drawn in axes.collections)
    assert grows == pytest.approx(np.array([[1.0, 10 / np.pi], [5.0, 0.0]]))
    assert still == pytest.approx(np.array([[-1.0, 10 / np.pi], [-5.0, 0.0]]))
    assert axes.get_xlabel() == "growth rate [1/s]"
    assert axes.get_ylabel() == "frequency [Hz]"


T = np.linspace(0.0, 2 * np.pi, 40, endpoint=False)
RING = np.array([0.2 * np.cos(T), 0.2 * np.sin(T), 0.0 * T]).T
WHERE = Coordinates(np.repeat(np.arange(40), 3), np.tile(np.arange(3), 40), RING)


def _shape(values):
    shape = np.zeros(120, dtype=complex)
    shape[2::3] = values
    return shape


def test_displacements_are_scaled_and_turned():
    u = unit_displacements(WHERE, 7j * _shape(np.cos(2 * T)))
    assert np.allclose(u[:, :2], 0)
    assert np.allclose(np.abs(u[:, 2].real), np.abs(np.cos(2 * T)))
    assert np.allclose(u.imag, 0, atol=1e-12)  # a standing wave has one phase
    travelling = unit_displacements(WHERE, _shape(np.exp(2j * T)))
    assert np.allclose(np.abs(travelling[:, 2]), 1)
    assert np.all(unit_displacements(WHERE, _shape(0 * T)) == 0)


def test_a_still_figure_shows_two_phases():
    figure = shape_drawing("a disc", "a mode", WHERE, _shape(np.exp(2j * T))).figure
    for axes, turn in zip(figure.axes, (1.0, 1j), strict=False):
        drawn: Any = axes.collections[0]
        heights = np.asarray(drawn._offsets3d[2])
        u = unit_displacements(WHERE, _shape(np.exp(2j * T)))[:, 2]
        assert np.allclose(heights, modes.LARGEST_OF_NODES * 0.4 * (u * turn).real, rtol=1e-2)
    for axes in figure.axes[:2]:  # both panels show the same box
        assert axes.get_xlim() == pytest.approx((-0.232, 0.232), rel=1e-2)
