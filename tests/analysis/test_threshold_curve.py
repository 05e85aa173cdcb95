"""Threshold curves against closed forms, and by the eigenvalues on both of their sides."""

import csv
import dataclasses
import json
import math

import numpy as np
import pytest

from squeal.analysis.answers import Axis
from squeal.analysis.maps import codes_at, stability_map
from squeal.analysis.pads import analyse, critical_friction
from squeal.analysis.stack import QUIET
from squeal.analysis.threshold_curve import threshold_curves
from squeal.cli.main import main
from squeal.equilibrium import sliding_equilibrium
from squeal.io.scene import Damping, Scene, read_scene
from squeal.model.pad import Pad
from tests.conftest import HAMMERING, SCENES

# springs upright but for SLANT, which holds the pad along x and else changes the rest in some 1e-6:
# y and theta are two coupled modes
SLANT = 1e-6
UPRIGHT = Scene(
    "B3",
    Pad(m=1.3, w=0.05, h=0.04, k1=3e6, k2=1e6, k_c=8e6, alpha1=math.pi / 2 + SLANT,
        alpha2=math.pi / 2 - SLANT, mu=0.3),
)  # fmt: skip


def mode_coupling(pad, k1):
    """The critical friction of UPRIGHT's two modes, from K written out by hand.

    K = [[k1 + k2 + k_c, b], [b + h mu k_c, w^2 (k1 + k2 + k_c/3)]] with b = w (k2 - k1): a double
    root where the frequencies' distance is what friction closes.
    """
    a = (k1 + pad.k2 + pad.k_c) / pad.m
    d = pad.w**2 * (k1 + pad.k2 + pad.k_c / 3) / pad.I
    b = pad.w * (pad.k2 - k1)
    return -(b + pad.m * pad.I * (a - d) ** 2 / (4 * b)) / (pad.h * pad.k_c), (a + d) / 2


@pytest.mark.parametrize("log", [False, True])
def test_mode_coupling_in_closed_form(log):
    axes = Axis("k1", 1.5e6, 6e6, 16, log), Axis("mu", 0.0, 3.0, 16)
    found = stability_map(UPRIGHT, axes)
    curves = [c for c in threshold_curves(UPRIGHT, axes, found.codes) if c.kind == "flutter"]
    assert curves
    for curve in curves:
        assert len(curve.points) > 10
        for (k1, mu), rate in zip(curve.points, curve.frequency_hz, strict=True):
            exact, s = mode_coupling(UPRIGHT.pad, k1)
            assert mu == pytest.approx(exact, rel=1e-5)
            assert rate == pytest.approx(math.sqrt(s) / (2 * math.pi), rel=1e-5)
    # and every value of k1 at which the closed form lies in the map has its place on a curve
    for k1 in axes[0].values:
        mu, _ = mode_coupling(UPRIGHT.pad, float(k1))
        if 0.1 < mu < 2.9:
            met = [np.interp(k1, *c.points[np.argsort(c.points[:, 0])].T) for c in curves]
            assert min(abs(m - mu) for m in met) < 0.02


def assert_divides(scene, axes, curve):
    """Close to a curve there are pads that grow, or have no equilibrium, and pads that do not."""
    names = [axis.name for axis in axes]
    spans = np.array([axis.high - axis.low for axis in axes])
    inside = [
        p
        for p in curve.points[1 : -1 : max(1, len(curve.points) // 4)]
        if all(
            a.low + 1e-3 * s < v < a.high - 1e-3 * s for a, v, s in zip(axes, p, spans, strict=True)
        )
    ]
    assert len(inside)
    for point in inside:
        turns = 2 * np.pi * np.arange(8) / 8
        near = point[:, None] + 1e-4 * spans[:, None] * np.array([np.cos(turns), np.sin(turns)])
        calm = np.isin(codes_at(scene, tuple(names), near).codes, QUIET)
        assert 0 < calm.sum() < 8, point


@pytest.mark.parametrize("damped", [False, True])
def test_points_on_the_curves_of_a_tilted_pad_divide(damped):
    scene = read_scene(SCENES / "b3.yaml")
    if damped:
        scene = dataclasses.replace(scene, damping=Damping(rayleigh=(20.0, 4e-6)))
    axes = Axis("alpha1", 0.1, 1.3, 4), Axis("alpha2", 2.7, 3.0, 3)
    found = stability_map(scene, axes)
    curves = threshold_curves(scene, axes, found.codes)
    assert {c.kind for c in curves} >= {"flutter"}
    for curve in curves:
        assert_divides(scene, axes, curve)
        if curve.kind != "flutter":
            continue
        for a1, a2 in curve.points[:: max(1, len(curve.points) // 4)]:
            values = analyse(scene.replace(alpha1=a1, alpha2=a2)).spectrum.values
            size = np.abs(values).max()
            if damped:  # a pair on the axis, and nothing right of it
                assert abs(values.real.max()) < 1e-7 * size
            else:  # two equal frequencies
                rates = np.sort(np.abs(values.imag))[::2]
                assert np.diff(rates).min() < 1e-4 * size


def test_folds_are_those_of_the_branch():
    scene = read_scene(SCENES / "b2-c.yaml")
    fold = critical_friction(scene).first
    assert fold.kind == "fold"
    h = scene.pad.h
    axes = Axis("mu", 0.9 * fold.mu, 1.1 * fold.mu, 4), Axis("h", 0.98 * h, 1.02 * h, 2)
    curves = threshold_curves(scene, axes, stability_map(scene, axes).codes)
    (curve,) = [c for c in curves if c.kind == "fold"]
    assert not curve.frequency_hz.any()
    for mu, height in curve.points[:: len(curve.points) - 1]:
        own = critical_friction(scene.replace(h=height)).first
        assert own.kind == "fold"
        assert own.mu == pytest.approx(mu, rel=1e-8)
    along = curve.points[np.argsort(curve.points[:, 1])]
    assert np.interp(h, along[:, 1], along[:, 0]) == pytest.approx(fold.mu, rel=1e-3)


def test_a_contact_change_that_costs_stability_ends_where_it_does_no_more():
    scene = read_scene(HAMMERING / "b2-c.yaml")
    axes = Axis("mu", 0.8, 1.0, 16), Axis("alpha1", 1.8, 2.0, 12)
    curves = threshold_curves(scene, axes, stability_map(scene, axes).codes)
    kinds = {c.kind for c in curves}
    assert {"flutter", "contact"} <= kinds
    for curve in curves:
        assert_divides(scene, axes, curve)
        if curve.kind == "contact":
            for mu, alpha1 in curve.points[::5]:
                changed = scene.replace(mu=mu, alpha1=alpha1)
                e, _ = sliding_equilibrium(changed.pad_model)
                gaps = changed.pad_model.gaps(np.array(e.q))
                assert np.abs(gaps).min() < 1e-9 * scene.pad.w


def test_the_command_writes_and_prints_them(capsys, tmp_path):
    table, picture = tmp_path / "curve.csv", tmp_path / "map.svg"
    axes = ("--first", "k1:1e6:1e10:log", "--second", "k_c:1e6:1e10:log", "--n", "16")
    files = ("--threshold-curve", str(table), "--figure", str(picture))
    assert main(["map", str(SCENES / "b3.yaml"), *axes, *files, "--json"]) == 0
    (curve,) = json.loads(capsys.readouterr().out)["threshold_curve"]
    assert (curve["kind"], curve["closed"]) == ("flutter", False)
    with table.open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [[float(r["k1 [N/m]"]), float(r["k_c [N/m]"])] for r in rows] == curve["points"]
    assert [float(r["frequency_hz"]) for r in rows] == curve["frequency_hz"]
    assert picture.read_text().count('id="threshold"') == 1
    # both ends lie at the outermost points
    for end in (curve["points"][0], curve["points"][-1]):
        assert any(abs(abs(math.log10(v) - 8.0) - 2.0) < 0.2 for v in end)
    assert main(["map", str(SCENES / "b3.yaml"), "--n", "4", "--json"]) == 0
    assert "threshold_curve" not in json.loads(capsys.readouterr().out)


def test_a_map_without_a_threshold_has_no_curve():
    axes = Axis("mu", 0.0, 0.01, 6), Axis("h", 0.01, 0.02, 6)
    found = stability_map(UPRIGHT, axes)
    assert len(np.unique(found.codes)) == 1
    assert threshold_curves(UPRIGHT, axes, found.codes) == ()
