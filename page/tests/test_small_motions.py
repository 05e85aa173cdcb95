"""The page's equilibria, matrices, eigenvalues, thresholds and maps against the toolkit's."""

import dataclasses

import numpy as np
import pytest

import squeal
from page.export import bits
from page.tests.conftest import as_json
from page.tests.test_motion import CASES, random_scene
from squeal.analysis.maps import NAMES, angle_axes, stability_map
from squeal.errors import ComputationError
from squeal.scene import read_scene
from tests.conftest import ROOT

SCENES = [ROOT / "workflow" / "scenes" / f"{stem}.yaml" for stem in CASES]


def sorted_roots(values):
    return np.array(sorted(values, key=lambda v: (round(v.imag, 6), round(v.real, 6))))


def test_equilibria_and_eigenvalues(node):
    scenes = [read_scene(path) for path in SCENES] + [random_scene(seed) for seed in range(100)]
    answers = node("small_motions.js", [as_json(scene) for scene in scenes])
    compared = others = 0
    for scene, answer in zip(scenes, answers, strict=True):
        try:
            analysis = squeal.analyse(scene)
        except ComputationError:
            assert answer["q"] is None
            continue
        if answer["q"] is None or "continued from mu = 0" not in analysis.how:
            continue  # the page ends its branch at a fold
        size = np.max(np.abs(analysis.q)) + scene.pad.F_n / scene.pad.k1
        if np.max(np.abs(np.array(answer["q"]) - analysis.q)) > 1e-3 * size:
            others += 1  # without friction there are several, and the page takes the nearest
            continue
        compared += 1
        assert answer["q"] == pytest.approx(analysis.q, abs=1e-10 * size)
        assert answer["contact"] == bits(analysis.state)
        assert answer["verdict"] == analysis.judgement.verdict
        assert answer["reaction"][0] == pytest.approx(analysis.R_n, rel=1e-9)
        for key in "MCK":
            expected = getattr(analysis.matrices, key)
            close = 1e-10 * np.max(np.abs(expected))
            assert np.array(answer[key]).reshape(3, 3) == pytest.approx(expected, abs=close)
        ours = sorted_roots(complex(*value) for value in answer["eigenvalues"])
        theirs = sorted_roots(analysis.spectrum.values)
        # about a coalescence both are exact to the square root of the precision only
        assert ours == pytest.approx(theirs, abs=1e-6 * np.max(np.abs(theirs)))
        for value, *shape in answer["shapes"]:
            v = np.array([complex(*part) for part in shape]) * [1, 1, 1 / scene.pad.w]
            s, M, K = complex(*value), analysis.matrices.M, analysis.matrices.K
            terms = np.abs(s * s * M) @ np.abs(v) + np.abs(K) @ np.abs(v)
            assert np.max(np.abs((s * s * M + K) @ v) / terms) < 1e-7
    assert compared > 80
    assert others < 3


def test_thresholds(node):
    scenes = [read_scene(path) for path in SCENES] + [random_scene(seed) for seed in range(40)]
    answers = node("small_motions.js", [as_json(scene) for scene in scenes])
    compared = 0
    for scene, answer in zip(scenes, answers, strict=True):
        if not answer["thresholds"]:
            continue
        first = answer["thresholds"][0]
        expected = squeal.critical_friction(scene).points[0]
        compared += 1
        assert first["kind"] == expected.kind
        assert first["mu"] == pytest.approx(expected.mu, rel=1e-6)
        assert first["hertz"] == pytest.approx(expected.frequency_hz, rel=1e-4, abs=1e-6)
    assert compared > 10


@pytest.mark.parametrize("path", [SCENES[2], SCENES[6]], ids=["B1", "B2"])
def test_map_about_the_sliding_equilibrium(node, path):
    n, scene = 14, read_scene(path)
    (answer,) = node("small_motions.js", [as_json(scene) | {"map": n}])
    codes = stability_map(scene, angle_axes(n)).codes.ravel()
    differing = np.flatnonzero(codes - 1 != np.array(answer["codes"]))
    assert NAMES[1:] == ("marginal", "flutter", "divergence", "beyond a fold")
    assert len(differing) <= 2  # where the branch all but ends


def test_map_about_the_origin(node):
    n, scene = 24, read_scene(SCENES[6])
    (answer,) = node("small_motions.js", [as_json(scene) | {"map": n}])
    b3 = read_scene(ROOT / "workflow" / "scenes" / "b3.yaml")  # the same pad
    linear = dataclasses.replace(b3, formulation=scene.formulation)
    codes = stability_map(linear, angle_axes(n)).codes.ravel()
    assert list(codes - 1) == answer["origin"]
