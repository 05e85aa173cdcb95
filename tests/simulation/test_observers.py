"""What is observed of a motion against the geometry of the pad."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from squeal.io.scene import read_scene
from squeal.simulation.hybrid import Steps
from squeal.simulation.observers import Grid, face_speed, lobatto
from squeal.simulation.run import in_natural_units
from tests.conftest import SCENES


def test_speed_of_the_face_is_the_change_of_its_place():
    """Of the point h below the mass centre, as the pad turns by theta0 + theta."""
    _, model, _, _ = in_natural_units(read_scene(SCENES / "b1-c.yaml").replace(theta0=0.3))
    c, h = model.c, model.pad.h
    states = np.random.default_rng(2).normal(size=(6, 5))
    step = 1e-6

    def place(time):
        x, _, turned = states[:3] + time * states[3:]
        return x + h * np.sin(0.3 + turned / c.w)

    on = np.array([[1, 0, 1, 0, 1], [0, 1, 1, 0, 1]])
    expected = (place(step) - place(-step)) / (2 * step)
    expected[3] = np.nan  # off the surface
    np.testing.assert_allclose(face_speed(c, states, on), expected, rtol=1e-7)


@pytest.mark.parametrize("count", [3, 4, 7, 12])
def test_quadrature_over_a_step_is_exact_for_polynomials(count):
    places, weights = lobatto(count)
    assert (places[0], places[-1]) == (0.0, 1.0)
    powers = np.arange(2 * count - 2)
    assert weights @ places[:, None] ** powers == pytest.approx(1 / (powers + 1), rel=1e-12)


@pytest.mark.parametrize("count", [4, 7])
def test_each_maximum_of_a_parabola_is_found_wherever_in_its_step_it_lies(count):
    places = np.linspace(0.002, 0.998, 250)
    series = np.zeros((3, 6, len(places)))
    series[:, 0] = -(places**2), 2 * places, -np.ones(len(places))  # -(share - place)^2
    motion = np.zeros(len(places), dtype=int)
    steps = Steps(motion, np.arange(250.0), np.ones(250), series, np.zeros((2, 250)))
    segment: Any = SimpleNamespace(steps=steps, t0=np.zeros(1), coefficients=lambda motion: None)
    grid = Grid(segment, count)
    enough = np.full(250, -np.inf)
    found, share, values = grid.peaks(lambda c, states, on: states[0], grid.states[0], enough)
    assert np.array_equal(np.sort(found), np.arange(250))
    assert share == pytest.approx(places[found], abs=1e-9)
    assert values == pytest.approx(np.zeros(250), abs=1e-12)


def test_ranges_are_those_of_sines_in_closed_form():
    """Two motions side by side, of other lengths; from their begin, and from a later time on."""
    h = 0.5
    orders = np.arange(16)[:, None]
    motion = np.repeat([0, 1], [20, 6])
    t = np.concatenate([np.arange(0.0, 10.0, h), np.arange(0.0, 3.0, h)])
    size = 1.0 + motion
    phase = 0.3 + 0.7 * motion
    series = np.zeros((16, 6, len(t)))
    factorial = np.cumprod(np.maximum(orders, 1.0), axis=0)
    series[:, 0] = size * np.sin(t + phase + orders * np.pi / 2) * h**orders / factorial
    steps = Steps(motion, t, np.full(len(t), h), series, np.ones((2, len(t))))
    segment: Any = SimpleNamespace(steps=steps, t0=np.zeros(2), coefficients=lambda motion: None)

    def signal(_c, states, _on):
        return states[0]

    for count in (4, 8):
        grid = Grid(segment, count)
        ends = [[-1.0, 1.0], [2 * np.sin(4.0), 2.0]]
        assert grid.ranges(signal) == pytest.approx(np.array(ends), rel=1e-10)
        late = [[np.sin(10.3), np.sin(9.3)], [2 * np.sin(4.0), 2 * np.sin(2.0)]]
        found = grid.ranges(signal, since=np.array([9.0, 1.0]))
        assert found == pytest.approx(np.array(late), rel=1e-12)
        spent = np.bincount(motion, (grid.weights @ grid.states[0]) * h)
        whole = [np.cos(0.3) - np.cos(10.3), 2 * np.cos(1.0) - 2 * np.cos(4.0)]
        assert spent == pytest.approx(whole, rel=1e-5)
        none = grid.ranges(lambda *where: np.nan * signal(*where))
        assert none.tolist() == [[np.inf, -np.inf]] * 2
