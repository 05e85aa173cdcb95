"""Error against run time: what is measured, on motions with known answers; nothing is timed."""

import dataclasses
import math

import numpy as np
import pytest

from squeal.article.extreme.cases import scene_of
from squeal.article.extreme.closed_forms import bounce_period, bounce_times, upright
from squeal.article.figures.linear import linear
from squeal.article.figures.precision import precision
from squeal.article.precision.linear import (
    PEERS,
    PROGRAMS,
    by_halving,
    distance,
    exact_coalescence,
    exact_values,
)
from squeal.article.precision.maps import matrices, named
from squeal.article.precision.measure import CONFIRMING, compare_times, confirm, points_of, timed
from squeal.article.precision.paths import DEFAULT, Run
from squeal.article.report.precision import check_values, linear_values, speed_table, values
from squeal.article.results.precision import Check, Point, Timing, time_at
from squeal.errors import ComputationError
from squeal.io.scene import Scene, read_scene
from squeal.io.short_form import PlainSystem
from squeal.model.linear import about_origin
from squeal.simulation.reference import error_against, reference
from squeal.simulation.run import in_natural_units
from tests.conftest import SCENES, needs_heyoka


def test_a_task_that_once_takes_long_does_not_count_by_that_alone(monkeypatch):
    """By a clock on which the first run takes a second and the others a millisecond."""

    def median(least: int) -> float:
        now = iter(np.cumsum([0.0, 1.0, *[0.0, 1e-3] * 9]))
        monkeypatch.setattr(
            "squeal.article.precision.measure.clock.process_time", lambda: next(now)
        )
        return timed(lambda: None, least=least)[1]

    assert median(1) == pytest.approx(1.0)
    assert median(3) == pytest.approx(1e-3)


@pytest.mark.parametrize("name", DEFAULT)
@needs_heyoka
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
@needs_heyoka
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


def test_threshold_against_closed_form():
    # s = 2 +- sqrt(1 - 1.6 mu) meet at mu = 0.625
    K0, K1 = np.array([[2.0, -1.0], [-1.0, 2.0]]), np.array([[0.0, 1.6], [0.0, 0.0]])
    system = PlainSystem("", "", "mu", np.eye(2), (), (K0, K1))
    assert exact_coalescence(system, 0.6250001) == pytest.approx(0.625, abs=1e-15)
    for program in PEERS.values():
        for halvings in (0, 10, 30):
            found = by_halving(system, program, halvings)
            assert found == pytest.approx(0.625, abs=max(0.005 * 0.5**halvings, 1e-11))
    quiet = dataclasses.replace(system, K=(K0, 0.0 * K1))
    assert math.isnan(by_halving(quiet, PEERS["numpy.linalg.eigvals"], 3))


def test_verdicts_named_by_eigenvalues():
    squares = np.array([[1.0, 2.0, 3.0], [-1.0, 2.0, 3.0], [1 + 1j, 1 - 1j, -1e-3]])
    codes, apart = named(squares.astype(complex))
    assert codes.tolist() == [1, 3, 2]
    assert apart == pytest.approx([1 / 3, 1 / 3, 1e-3 / math.sqrt(2)])


def test_matrices_of_the_map_are_those_of_the_single_scenes():
    scene = read_scene(SCENES / "b3.yaml")
    n = 5
    stack, angles = matrices(scene, n), (np.arange(n) + 0.5) * math.pi / n
    for i, j in ((0, 0), (1, 3), (4, 2)):
        one = about_origin(scene.pad_model.replace(alpha1=angles[i], alpha2=angles[j]))
        expected = np.linalg.solve(one.M, one.K)
        assert stack[i, j] == pytest.approx(expected, rel=1e-12, abs=1e-12 * np.abs(expected).max())


@needs_heyoka
def test_the_reference_is_confirmed_or_refused():
    scene = dataclasses.replace(scene_of("B1", 10.0), outputs=())
    exact = reference(scene)
    found = confirm("one", scene, exact, True)
    assert found.changes == len(exact.times)
    assert found.order == pytest.approx(0.0, abs=1e-15)
    assert found.place < 1e-10
    known = points_of("one", scene, exact, CONFIRMING, DEFAULT[CONFIRMING], np.inf)
    assert confirm("one", scene, exact, True, known) == found
    with pytest.raises(ComputationError, match="other contact changes"):
        confirm("one", scene, dataclasses.replace(exact, times=exact.times[1:]), False)
    for wrong in ({"extra": 1}, {"error": None}):
        with pytest.raises(ComputationError, match="other contact changes"):
            confirm("one", scene, exact, False, [dataclasses.replace(known[-1], **wrong)])


def test_table_values_and_figures_from_known_results():
    def point(path: str, seconds: float, **other: float | None) -> Point:
        known = {"error": 1e-11, "time_error": 1e-10, "missed": 0, "extra": 0} | other
        return Point("c", path, 1e-8, seconds=seconds, steps=1, **known)  # type: ignore[arg-type]

    points = [
        point("squeal", 1e-3),
        point("squeal, batch", 2e-4),
        point("SciPy DOP853", 0.25),
        point("SciPy RK45", 0.1, missed=3, extra=2),
        point("SciPy Radau", 0.1, error=None, time_error=None),
    ]
    told = values(points)
    assert told["precision.least-ratio"] == told["precision.greatest-ratio"] == "$250$"
    assert told["precision.least-batch"] == "5000"
    assert (told["precision.missing-runs"], told["precision.runs"]) == ("1", "3")
    assert (told["precision.own-missing-runs"], told["precision.own-tightest"]) == ("0", "--")
    assert told["precision.tightest"] == "$10^{-8}$"
    table = speed_table(points)
    assert r"SciPy DOP853 & 250 (250) & 0 & 0 \\" in table
    assert r"SciPy RK45 & -- & 3 & 2 \\" in table  # a run that misses changes is in no race
    checks = [Check("c", 4, 1e-12, 2e-12, None), Check("d", 0, 3e-12, None, None)]
    assert check_values(checks)["precision.changes"] == "4"
    timings = [
        Timing(task, program, 8, error, seconds)
        for task in ("map", "threshold")
        for program, error, seconds in (
            ("squeal", 1e-15, 1e-3),
            ("numpy.linalg.eigvals", 1e-12, 2e-2),
        )
    ]
    assert linear_values(timings)["precision.map-ratio"] == "$20$"
    assert [a.get_title() for a in precision(points).axes] == ["c", "c"]
    assert len(linear(timings).axes) == 2
