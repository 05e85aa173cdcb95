"""Mode shapes on coordinates: displacements against what was put in, files that hold them."""

from typing import Any

import numpy as np
import pytest
from PIL import Image

from squeal.io.system import Coordinates
from squeal.plots.shapes import FRAMES, LARGEST, animate_shape, displacements, shape_figure

T = np.linspace(0.0, 2 * np.pi, 40, endpoint=False)
RING = np.array([0.2 * np.cos(T), 0.2 * np.sin(T), 0.0 * T]).T
WHERE = Coordinates(np.repeat(np.arange(40), 3), np.tile(np.arange(3), 40), RING)


def _shape(values):
    shape = np.zeros(120, dtype=complex)
    shape[2::3] = values
    return shape


def test_displacements_are_scaled_and_turned():
    u = displacements(WHERE, 7j * _shape(np.cos(2 * T)))
    assert np.allclose(u[:, :2], 0)
    assert np.allclose(np.abs(u[:, 2].real), np.abs(np.cos(2 * T)))
    assert np.allclose(u.imag, 0, atol=1e-12)  # a standing wave has one phase
    travelling = displacements(WHERE, _shape(np.exp(2j * T)))
    assert np.allclose(np.abs(travelling[:, 2]), 1)
    assert np.all(displacements(WHERE, _shape(0 * T)) == 0)


def test_a_still_figure_shows_two_phases():
    figure = shape_figure("a mode", WHERE, _shape(np.exp(2j * T)))
    for axes, turn in zip(figure.axes, (1.0, 1j), strict=False):
        drawn: Any = axes.collections[0]
        heights = np.asarray(drawn._offsets3d[2])
        u = displacements(WHERE, _shape(np.exp(2j * T)))[:, 2]
        assert np.allclose(heights, LARGEST * 0.4 * (u * turn).real, rtol=1e-2)
    for axes in figure.axes[:2]:  # both panels show the same box
        assert axes.get_xlim() == pytest.approx((-0.232, 0.232), rel=1e-2)


def test_a_moving_one_has_a_period(tmp_path):
    path = tmp_path / "mode.gif"
    animate_shape(path, "a mode", WHERE, _shape(np.cos(2 * T)))
    image: Any
    with Image.open(path) as image:
        assert image.n_frames == FRAMES
        frames = []
        for k in (0, FRAMES // 2):
            image.seek(k)
            frames.append(np.asarray(image.convert("L"), dtype=int))
    assert np.any(np.abs(frames[0] - frames[1]) > 50)
    assert path.read_bytes().count(b"NETSCAPE") == 1  # it repeats
