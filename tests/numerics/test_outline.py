"""Traced boundaries: closed forms, areas, and both verdicts beside every place that is traced."""

import numpy as np
import pytest

from squeal.analysis.answers import Axis
from squeal.analysis.maps import angle_axes, stability_map
from squeal.io.scene import read_scene
from squeal.linear import verdict
from squeal.model.equations import about_origin
from squeal.numerics.outline import Outline, outline
from tests.conftest import SCENES

X = np.linspace(-1.0, 1.0, 61)


def traced(at):
    codes = at(np.array(np.meshgrid(X, X, indexing="ij")).reshape(2, -1)).reshape(len(X), len(X))
    return outline(((-1.0, 1.0), (-1.0, 1.0)), X, X, codes, at)


def ring(points):
    """0, 1 and 2 within two circles and outside."""
    return np.digitize(np.hypot(*points), [0.3, 0.8])


def test_circles_are_traced_to_a_millionth_and_their_curves_close():
    found = traced(ring)
    radii = np.hypot(*found.segments[:, 0].T)
    assert np.min([np.abs(radii - 0.3), np.abs(radii - 0.8)], axis=0).max() < 1e-6
    curves = sorted(found.curves, key=lambda one: one[1])
    assert [sides for _, sides in curves] == [(0, 1), (1, 2)]
    assert all(np.array_equal(curve[0], curve[-1]) for curve, _ in curves)
    assert sum(len(curve) - 1 for curve, _ in curves) == len(found.segments)
    lengths = [np.hypot(*np.diff(curve, axis=0).T).sum() for curve, _ in curves]
    assert lengths == pytest.approx([2 * np.pi * 0.3, 2 * np.pi * 0.8], rel=2e-3)


def test_areas():
    area = traced(ring).area
    assert area[0] == pytest.approx(np.pi * 0.3**2, rel=2e-3)
    assert area[1] == pytest.approx(np.pi * (0.8**2 - 0.3**2), rel=2e-3)
    assert sum(area.values()) == pytest.approx(4.0, rel=1e-12)
    three = traced(lambda p: np.where(p[0] > 0.1, 0, np.where(p[1] > 0.2, 1, 2))).area
    assert [three[k] for k in range(3)] == pytest.approx([1.8, 0.88, 1.32], abs=1e-3)


def test_an_outline_keeps_through_a_file_and_regroups():
    found = traced(ring)
    back = Outline.from_dict(found.to_dict())
    assert np.abs(back.polygons - found.polygons).max() < 1e-7
    assert np.array_equal(back.sides, found.sides)
    two = found.regrouped(np.array([0, 0, 1]))
    assert two.area[0] == pytest.approx(np.pi * 0.8**2, rel=2e-3)
    assert {sides for _, sides in two.curves} == {(0, 1)}


def test_undamped_flutter_of_b3_starts_where_the_discriminant_vanishes():
    # along mu alone the boundary is the critical friction of the same pad
    scene = read_scene(SCENES / "b3.yaml")
    axes = (Axis("mu", 0.05, 1.0, 40), Axis("alpha1", 0.1, 3.0, 50))
    found = stability_map(scene, axes, traced=True).outline
    on_line = np.abs(found.segments[:, 0, 1:] - axes[1].values).min(axis=1) < 1e-12
    assert on_line.sum() > 10
    for mu, alpha1 in found.segments[on_line, 0]:
        beside = [
            verdict(*about_origin(scene.pad_model.replace(mu=mu + d, alpha1=alpha1)))
            for d in (-1e-6, 1e-6)
        ]
        assert beside[0] != beside[1]
    assert stability_map(scene, angle_axes(5)).outline is None
