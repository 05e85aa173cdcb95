"""Traced boundaries: closed forms, areas, and both verdicts beside every place that is traced."""

import numpy as np
import pytest

from squeal.article.outline import Outline, outline

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


def test_areas_are_those_of_circles_and_rectangles():
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
