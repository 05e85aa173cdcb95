"""The page's motion against the Python run: steps, contact changes and end states."""

import dataclasses
import itertools
from functools import cache
from typing import Any

import numpy as np
import pytest

from page.export import SPRINGS, bits
from page.tests.conftest import as_json
from squeal.equilibrium.path import branch_of
from squeal.errors import ComputationError
from squeal.io.scene import Damping, Scene, read_scene
from squeal.model.contact import FORMULATION_CHOICES, Formulation
from squeal.model.equations import natural_units
from squeal.simulation.run import simulate
from tests.conftest import ROOT, random_pad

CASES = [f"{model}-{case}" for model in ("b1", "b2") for case in "abcd"]
CHOICES: Any = itertools.product(*FORMULATION_CHOICES.values())
FORMULATIONS = [Formulation(*words) for words in CHOICES]


def random_scene(seed):
    """A pad of any model, in any formulation, that starts anywhere near the surface."""
    r = np.random.default_rng(seed)
    model: Any = ("B2", "B1", "B2", "BN", "B2", "B1")[seed % 6]
    unused: Any = {"k_c": None} if model == "B1" else {"k3": None, "k4": None}
    initial = tuple(float(v) for v in r.uniform(-1.0, 1.0, 6) * 0.02)
    formulation = {
        "B1": Formulation(),
        "B2": FORMULATIONS[seed // 2 % len(FORMULATIONS)],
        "BN": Formulation(springs=SPRINGS[seed // 6 % len(SPRINGS)]),
    }[model]
    damping = None
    if seed % 10 >= 7:  # some refuse it, see `test_refused_damping`
        damping = Damping(ratios=(float(r.uniform(0.001, 0.1)),) * 3)
    pad = random_pad(seed, **unused)
    return Scene(model, pad, formulation, initial, stop=50.0, samples=2, damping=damping)


def far_without_friction(scene):
    """True if the pad without friction rests where the page, which starts nearby, does not look."""
    least = branch_of(scene.pad_model, 0.0).z
    return not least.size or np.max(np.abs(least)) > 10.0


@cache
def simulated(seed):
    """Python's run of a random scene, once for Node and the browser."""
    return simulate(random_scene(seed))


def compare(scene, answer, result):
    """Error of the end state and of the contact times against a result, in natural units."""
    # damping matrices from two programs differ by rounding, which may cut off one step more
    assert abs(answer["steps"] - result.steps) <= (scene.damping is not None)
    names = {bits(state): scene.pad_model.state_name(state) for state in scene.pad_model.states}
    assert [(names[a], names[b]) for _, a, b in answer["changes"]] == [
        (e.source, e.target) for e in result.events
    ]
    units = natural_units(scene.pad_model, scene.initial)
    assert [answer["units"][key] for key in ("mass", "length", "time", "lever")] == pytest.approx(
        [units.mass, units.length, units.time, units.lever], rel=1e-15
    )
    ends = units.to_scaled(np.array([answer["state"], result.final[1:]]))
    times = [t - e.t for (t, *_), e in zip(answer["changes"], result.events, strict=True)]
    late = max(map(abs, times), default=0.0) / units.time
    return max(late, np.max(np.abs(ends[0] - ends[1])) / np.max(np.abs(ends[1])))


def test_the_eight_cases_of_the_article(node):
    scenes = [read_scene(ROOT / "workflow" / "scenes" / f"{stem}.yaml") for stem in CASES]
    answers = node("runs.js", [as_json(scene) for scene in scenes])
    for scene, answer in zip(scenes, answers, strict=True):
        assert compare(scene, answer, simulate(scene)) < 1e-10, scene.source


@pytest.mark.parametrize("turning", [0.01, -0.01])
@pytest.mark.parametrize("model", ["B1", "B2", "BN"])
def test_a_level_pad_on_the_surface_that_begins_to_turn(node, model, turning):
    pad = random_pad(4, model).replace(y0=0.0, theta0=0.0)
    initial = (0.0, 0.0, 0.0, 0.0, 0.0, turning)
    scene = Scene(model, pad, Formulation(), initial, stop=20.0, samples=2)
    (answer,) = node("runs.js", [as_json(scene)])
    assert answer["end"] is None
    assert compare(scene, answer, simulate(scene)) < 1e-10


def test_random_pads(node):
    scenes = [random_scene(seed) for seed in range(270)]
    answers = node("runs.js", [as_json(scene) for scene in scenes])
    ended = refused = 0
    for seed, (scene, answer) in enumerate(zip(scenes, answers, strict=True)):
        if answer["refusal"]:
            refused += 1
            if not far_without_friction(scene):
                with pytest.raises(ComputationError, match=answer["refusal"]):
                    simulate(scene)
            continue
        if answer["end"] is None:
            assert compare(scene, answer, simulated(seed)) < 1e-10, scene
            continue
        ended += 1  # the pad has left the model
        with pytest.raises(ComputationError, match=f"^{answer['end']} at t = ") as refusal:
            simulate(scene)
        assert float(str(refusal.value).split()[-6]) == pytest.approx(answer["t"], rel=1e-8)
    assert refused > 0
    assert len(scenes) - ended - refused >= 200
    assert sum(len(answer["changes"]) for answer in answers) > 1000  # the switching is at work


def test_extremes_and_shares_are_those_of_the_motion(node):
    scenes = [read_scene(ROOT / "workflow" / "scenes" / f"{stem}.yaml") for stem in CASES]
    answers = node("spectra.js", [as_json(scene) | {"highest": 1e4} for scene in scenes])
    for scene, answer in zip(scenes, answers, strict=True):
        result = simulate(scene)
        ranges = result.extrema
        assert ranges is not None
        units = answer["units"]
        pad = scene.pad
        force = units["mass"] * units["length"] / units["time"] ** 2 / pad.F_n
        sizes = {"B1": (force, force), "B2": (force, units["length"] / pad.w)}[scene.model]
        for ends, size, expected in zip(answer["ends"], sizes, ranges.values(), strict=True):
            assert np.array(ends) * size == pytest.approx(expected, rel=1e-6, abs=1e-6)
        names = {str(bits(s)): scene.pad_model.state_name(s) for s in scene.pad_model.states}
        shares = dict.fromkeys(result.shares, 0.0)
        for state, share in answer["shares"].items():
            shares[names[state]] += share
        assert shares == pytest.approx(result.shares, abs=1e-9)


def test_no_line_folds_into_the_spectrum(node):
    case = read_scene(ROOT / "workflow" / "scenes" / "b2-b.yaml")
    # 6.5 million samples a second
    highest = 12e3
    stop = 0.04
    n = 1 << 18
    long = dataclasses.replace(case, stop=stop)
    (answer,) = node("spectra.js", [as_json(long) | {"highest": highest}])
    fine = dataclasses.replace(long, samples=n + 1, outputs=("history",))
    force = simulate(fine).history["Rn"][:n]
    window = 1.0 - np.cos(2.0 * np.pi * np.arange(n) / n)
    level = np.abs(np.fft.rfft((force - force.mean()) * window))[: len(answer["hertz"])]
    level = 20.0 * np.log10(level / level.max())
    assert answer["hertz"][1] == pytest.approx(1.0 / stop)
    loud = level > -55.0
    assert np.count_nonzero(loud) > 20
    assert np.array(answer["decibels"])[loud] == pytest.approx(level[loud], abs=1.0)
    assert np.all(np.array(answer["decibels"])[~loud] < -50.0)
