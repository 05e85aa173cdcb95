"""The page's equilibria, matrices, eigenvalues, thresholds and maps against the toolkit's."""

import dataclasses

import numpy as np
import pytest

from page.export import bits
from page.tests.conftest import as_json
from page.tests.test_motion import CASES, random_scene
from squeal.equilibrium import Path
from squeal.errors import ComputationError
from squeal.io.scene import Damping, read_scene
from squeal.queries.pads.equilibrium import analyse
from squeal.queries.pads.maps import NAMES, angle_axes, stability_map
from squeal.queries.thresholds import critical_friction
from tests.conftest import ROOT

SCENES = [ROOT / "workflow" / "scenes" / f"{stem}.yaml" for stem in CASES]


def damped(scene, ratio):
    """The scene with one damping ratio in all modes, or without damping."""
    return dataclasses.replace(scene, damping=Damping(ratios=(ratio,) * 3) if ratio else None)


def sorted_roots(values):
    return np.array(sorted(values, key=lambda v: (round(v.imag, 6), round(v.real, 6))))


def test_equilibria_and_eigenvalues(node):
    scenes = [read_scene(path) for path in SCENES] + [random_scene(seed) for seed in range(100)]
    answers = node("small_motions.js", [as_json(scene) for scene in scenes])
    compared = others = 0
    for scene, answer in zip(scenes, answers, strict=True):
        try:
            analysis = analyse(scene)
        except ComputationError:
            assert answer["q"] is None or answer["refusal"]
            continue
        if answer["refusal"] or answer["q"] is None or "continued from" not in analysis.how:
            continue  # the page ends its branch at a fold
        size = np.max(np.abs(analysis.q)) + scene.pad.F_n / scene.pad.k1
        if np.max(np.abs(np.array(answer["q"]) - analysis.q)) > 1e-3 * size:
            others += 1  # without friction there are several, and the page looks nearby
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
            s = complex(*value)
            parts = analysis.matrices
            P = [s * s * parts.M, s * parts.C, parts.K]
            terms = sum(np.abs(part) @ np.abs(v) for part in P)
            assert np.max(np.abs(sum(P) @ v) / terms) < 1e-7
    assert compared > 80
    assert others < 3


def test_of_several_places_of_rest_the_one_of_least_energy_begins_the_branch(node):
    loads = {1019: 1.0, 642: 0.3, 483: 1.0, 418: 0.3}  # heavy for these pads
    scenes = [
        damped(random_scene(seed), 0.0).replace(F_n=load, mu=0.0) for seed, load in loads.items()
    ]
    for scene, answer in zip(
        scenes, node("small_motions.js", list(map(as_json, scenes))), strict=True
    ):
        path = Path.of(scene.pad_model, 0.0)
        least = path.statics.to_si(path.at(0.0)[0])
        assert answer["q"] == pytest.approx(least, abs=1e-9)


@pytest.mark.parametrize("ratio", [0.0, 0.02])
def test_thresholds(node, ratio):
    scenes = [read_scene(path) for path in SCENES] + [random_scene(seed) for seed in range(40)]
    scenes = [damped(scene, ratio) for scene in scenes]
    answers = node("small_motions.js", [as_json(scene) for scene in scenes])
    compared = 0
    for scene, answer in zip(scenes, answers, strict=True):
        if answer["refusal"] or not answer["thresholds"]:
            continue
        first = answer["thresholds"][0]
        expected = critical_friction(scene).points[0]
        compared += 1
        assert first["kind"] == expected.kind
        assert first["mu"] == pytest.approx(expected.mu, rel=1e-6)
        assert first["hertz"] == pytest.approx(expected.frequency_hz, rel=1e-4, abs=1e-6)
    assert compared > 10


@pytest.mark.parametrize("ratio", [0.0, 0.02])
@pytest.mark.parametrize("path", [SCENES[2], SCENES[6]], ids=["B1", "B2"])
def test_map_about_the_sliding_equilibrium(node, path, ratio):
    n = 14
    scene = damped(read_scene(path), ratio)
    (answer,) = node("small_motions.js", [as_json(scene) | {"map": n}])
    codes = stability_map(scene, angle_axes(n)).codes.ravel()
    differing = [a for a, b in zip(codes, answer["codes"], strict=True) if NAMES[a] != b]
    assert len(differing) <= 2  # where the branch all but ends


@pytest.mark.parametrize("ratio", [0.0, 0.02])
def test_map_about_the_origin(node, ratio):
    n = 24
    scene = damped(read_scene(SCENES[6]), ratio)
    (answer,) = node("small_motions.js", [as_json(scene) | {"map": n}])
    b3 = read_scene(ROOT / "workflow" / "scenes" / "b3.yaml")  # the same pad
    linear = damped(dataclasses.replace(b3, formulation=scene.formulation), ratio)
    codes = stability_map(linear, angle_axes(n)).codes.ravel()
    assert [NAMES[code] for code in codes] == answer["origin"]
