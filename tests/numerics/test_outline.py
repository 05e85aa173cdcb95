"""Traced boundaries: closed forms, areas, and both verdicts beside every place that is traced."""

import dataclasses

import numpy as np
import pytest

from squeal.analysis.eigenvalues import at_equilibrium
from squeal.analysis.maps import Axis, angle_axes, codes_at, stability_map
from squeal.article.equations import quasi_static_map
from squeal.article.studies.quasi_static import quasi_static
from squeal.equilibrium import Path
from squeal.io.scene import read_scene
from squeal.linear import verdict
from squeal.model.equations import about_origin
from squeal.numerics.outline import Outline, crossings, outline
from tests.conftest import SCENES

X = np.linspace(-1.0, 1.0, 61)
ENDS = ((-1.0, 1.0), (-1.0, 1.0))


def traced(at, n=X):
    codes = at(np.array(np.meshgrid(n, n, indexing="ij")).reshape(2, -1)).reshape(len(n), len(n))
    return outline(ENDS, n, n, codes, at)


def ring(points):
    """0, 1 and 2 within two circles and outside."""
    return np.digitize(np.hypot(*points), [0.3, 0.8])


def places(found):
    """The ends of segments that lie on edges of the grid X."""
    points = found.segments[:, 0]
    on_edge = np.min(np.abs(points[..., None] - X), axis=-1).min(axis=-1) < 1e-12
    assert on_edge.all()
    return points


def test_circles_are_traced_to_a_millionth():
    found = traced(ring)
    radii = np.hypot(*places(found).T)
    assert np.min([np.abs(radii - 0.3), np.abs(radii - 0.8)], axis=0).max() < 1e-6
    sides = {tuple(sorted(pair)) for pair in found.sides.tolist()}
    assert sides == {(0, 1), (1, 2)}


def test_curves_join_all_segments_and_close():
    found = traced(ring)
    curves = sorted(found.curves, key=lambda one: one[1])
    assert [sides for _, sides in curves] == [(0, 1), (1, 2)]
    assert all(np.array_equal(curve[0], curve[-1]) for curve, _ in curves)
    assert sum(len(curve) - 1 for curve, _ in curves) == len(found.segments)
    lengths = [np.hypot(*np.diff(curve, axis=0).T).sum() for curve, _ in curves]
    assert lengths == pytest.approx([2 * np.pi * 0.3, 2 * np.pi * 0.8], rel=2e-3)


def test_areas_of_circles():
    area = traced(ring).area
    assert area[0] == pytest.approx(np.pi * 0.3**2, rel=2e-3)
    assert area[1] == pytest.approx(np.pi * (0.8**2 - 0.3**2), rel=2e-3)
    assert sum(area.values()) == pytest.approx(4.0, rel=1e-12)


def test_areas_where_three_meet():
    found = traced(lambda p: np.where(p[0] > 0.1, 0, np.where(p[1] > 0.2, 1, 2)))
    assert [found.area[k] for k in range(3)] == pytest.approx([1.8, 0.88, 1.32], abs=1e-3)


def test_an_outline_keeps_through_a_file_and_regroups():
    found = traced(ring)
    back = Outline.from_dict(found.to_dict())
    assert np.abs(back.polygons - found.polygons).max() < 1e-7
    assert np.array_equal(back.sides, found.sides)
    two = found.regrouped(np.array([0, 0, 1]))
    assert two.area[0] == pytest.approx(np.pi * 0.8**2, rel=2e-3)
    assert {sides for _, sides in two.curves} == {(0, 1)}


def test_conditions_23_are_traced():
    pad = read_scene(SCENES / "b3.yaml").pad
    found, dense = quasi_static(pad, 120), quasi_static_map(pad, 1500).share
    assert found.as_printed.area[1] / np.pi**2 == pytest.approx(dense.as_printed, abs=1e-3)
    assert found.sign_aware.area[1] / np.pi**2 == pytest.approx(dense.sign_aware, abs=1e-3)


def test_undamped_flutter_of_b3_starts_where_the_discriminant_vanishes():
    # along mu alone the boundary is the critical friction of the same pad
    scene = read_scene(SCENES / "b3.yaml")
    axes = (Axis("mu", 0.05, 1.0, 40), Axis("alpha1", 0.1, 3.0, 50))
    found = stability_map(scene, axes, traced=True).outline
    grid = axes[0].values, axes[1].values
    checked = 0
    for mu, alpha1 in found.segments[:, 0]:
        if np.min(np.abs(grid[1] - alpha1)) < 1e-12:
            told = []
            for beside in (mu - 1e-6, mu + 1e-6):
                one = about_origin(scene.pad_model.replace(mu=beside, alpha1=alpha1))
                told.append(verdict(*one))
            assert told[0] != told[1]
            checked += 1
    assert checked > 10


def test_b2_boundaries_have_both_verdicts_beside_them():
    scene = read_scene(SCENES / "b2-c.yaml")
    names = ("alpha1", "alpha2")
    x, y = np.linspace(0.2, 3.0, 15), np.array([0.3, 1.3, 2.9])

    def at(points):
        return codes_at(scene, names, points).codes

    codes = at(np.array(np.meshgrid(x, y, indexing="ij")).reshape(2, -1)).reshape(15, 3)
    along_x, _ = crossings(x, y, codes, at)
    i, j = np.nonzero(codes[1:] != codes[:-1])
    place = x[i] + along_x[i, j] * (x[i + 1] - x[i])
    step = x[1] - x[0]
    beside = [at(np.array([place + d * step, y[j]])) for d in (-5e-6, 5e-6)]
    assert np.array_equal(beside[0], codes[i, j])
    assert np.all(beside[1] != codes[i, j])
    assert len(i) > 8
    # where a mode starts to grow the scalar chain says the same a millionth beside
    flutters = np.flatnonzero((codes[i, j] == 2) ^ (codes[i + 1, j] == 2))
    kept = [k for k in flutters if max(codes[i[k], j[k]], codes[i[k] + 1, j[k]]) <= 2][:4]
    assert kept
    for k in kept:
        told = []
        for d in (-1e-6, 1e-6):
            pad = scene.pad.replace(alpha1=place[k] + d, alpha2=y[j[k]])
            model = dataclasses.replace(scene, pad=pad).pad_model
            one = at_equilibrium(model, Path.of(model, pad.mu).equilibrium(pad.mu))
            told.append(verdict(*one))
        assert sorted(told) == ["flutter", "marginal"]


def test_an_untraced_map_has_no_outline():
    assert stability_map(read_scene(SCENES / "b3.yaml"), angle_axes(5)).outline is None
