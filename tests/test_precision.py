"""Error against run time: what is measured, on motions with known answers; nothing is timed."""

import dataclasses
import math

import numpy as np
import pytest

from squeal.extreme.cases import scene_of
from squeal.extreme.closed_forms import bounce_period, bounce_times, upright
from squeal.precision.linear import PROGRAMS, distance, exact_values
from squeal.precision.measure import Point, compare_times, points_of, time_at
from squeal.precision.paths import DEFAULT, Run
from squeal.scene.schema import Scene
from squeal.simulation.reference import error_against, reference
from squeal.simulation.run import in_natural_units


@pytest.mark.parametrize("name", DEFAULT)
def test_every_path_agrees_with_quad_precision(name):
    scene = dataclasses.replace(scene_of("B1", 15.0), outputs=())
    exact = reference(scene)
    found = DEFAULT[name](scene, 1e-8)
    missed, extra, worst = compare_times(found.times, exact.times)
    assert (missed, extra) == (0, 0)
    assert worst is not None
    assert worst < 1e-4
    assert error_against(found.place, exact.place) < 1e-5


@pytest.mark.parametrize("name", ["squeal", "squeal, batch"])
def test_our_paths_on_a_bouncing_pad_in_closed_form(name):
    pad, height = upright(), 1e-3
    period = bounce_period(pad, height)
    scene = Scene("B1", pad, initial=(0, height, 0, 0, 0, 0), stop=3.0 * period, samples=2)
    units, *_ = in_natural_units(scene)
    found = DEFAULT[name](scene, 1e-12)
    assert found.times * units.time == pytest.approx(bounce_times(pad, height, 3), rel=1e-10)
    # back at the height of the drop
    assert found.place * units.length == pytest.approx([0.0, height, 0.0], abs=1e-10 * height)


def test_missed_and_made_up_changes_are_counted():
    exact = np.array([1.0, 2.0, 3.0, 4.0])
    missed, extra, worst = compare_times(exact + 1e-3, exact)
    assert (missed, extra) == (0, 0)
    assert worst == pytest.approx(1e-3)
    assert compare_times(exact[1:], exact)[:2] == (1, 0)
    assert compare_times(np.array([1.0, 1.5, 2.0, 3.0, 4.0]), exact)[:2] == (0, 1)
    assert compare_times(np.array([1.0, 2.0, 3.5]), exact)[:2] == (2, 1)
    assert compare_times(np.array([]), exact) == (4, 0, None)
    assert compare_times(exact, np.array([])) == (0, 4, None)


def test_errors_of_a_known_path():
    scene = scene_of("B1", 10.0)
    exact = reference(scene)

    def off(_: Scene, tolerance: float) -> Run:
        return Run(exact.place * (1.0 + tolerance), exact.times[1:], 7)

    points = points_of("one", scene, exact, "known", off, 1.0)
    for p in points:
        assert p.error == pytest.approx(p.tolerance, rel=1e-2, abs=1e-15)
        assert (p.missed, p.extra, p.steps) == (1, 0, 7)
    # a path that misses a change has no time at any error
    assert time_at(points, "one", "known", 1.0) is None


def test_time_at_an_error():
    def point(error: float, seconds: float) -> Point:
        return Point("c", "p", 1e-8, error, None, seconds, 1, 0, 0)

    points = [point(1e-6, 1.0), point(1e-9, 2.0), point(1e-11, 3.0), point(1e-12, 2.5)]
    assert time_at(points, "c", "p", 1e-8) == 2.0
    assert time_at(points, "c", "p", 1e-10) == 2.5
    assert time_at(points, "c", "p", 1e-13) is None
    assert time_at(points, "c", "other", 1.0) is None


@pytest.mark.parametrize("name", PROGRAMS)
def test_eigenvalue_programs_against_closed_form(name):
    M = np.diag([1.0, 2.0, 4.0])
    K = np.array([np.diag([1.0, 8.0, 36.0 * s]) for s in (1.0, 4.0)])
    expected = np.array([[1j, -1j, 2j, -2j, 3j * s, -3j * s] for s in (1.0, 2.0)])
    assert distance(exact_values(M, K), expected) < 1e-15
    assert distance(PROGRAMS[name](M, K), expected) < 1e-14
    assert distance(expected * (1 + 1e-3), expected) == pytest.approx(1e-3, rel=1e-6)
    assert math.isfinite(distance(expected[:, ::-1], expected))
