"""Admissible or not: each limit from both sides, and all queries of one mind."""

import itertools
from typing import Any

import numpy as np
import pytest

import squeal
from squeal.article.commands.sliding import judged_equilibria
from squeal.equilibrium import Path, find_all, sliding_equilibrium
from squeal.equilibrium.statics import LIMITS, Excursion, excursion
from squeal.errors import ComputationError
from squeal.io.scene import Scene
from squeal.model.contact import FORMULATION_CHOICES, Formulation
from squeal.model.equations import PadModel
from squeal.model.pad import Pad
from squeal.queries.pads.equilibrium import analyse
from squeal.queries.pads.maps import NAMES, stability_map, verdicts_at
from squeal.queries.thresholds import critical_friction
from squeal.results.map import Axis
from tests.conftest import random_pad
from tests.literal import frictionless, literal

WORDS: Any = itertools.product(*FORMULATION_CHOICES.values())
FORMULATIONS = [Formulation(*words) for words in WORDS]


def some_scene(seed):
    """A random pad, many beyond a fold or far from where the model holds."""
    r = np.random.default_rng([seed, 99])
    model = "B1" if seed % 2 else "B2"
    pad = random_pad(5000 + seed, model)
    pad = pad.replace(mu=float(r.uniform(0, 1.5)), F_n=float(10 ** r.uniform(-3, -1)))
    return Scene(model, pad, Formulation() if seed % 2 else FORMULATIONS[seed // 2 % 8])


def test_each_limit_is_decided_on_both_sides():
    within = 0.99 * np.array(LIMITS)
    assert not Excursion(*within).warnings()
    for i, value in itertools.product(range(3), (1.01, np.nan)):  # what is not known is not
        beyond = Excursion(*np.where(np.arange(3) == i, value * np.array(LIMITS), within))
        assert np.flatnonzero(beyond.beyond()).tolist() == [i]
        assert len(beyond.warnings()) == 1


@pytest.mark.parametrize(("y0", "load"), [(0.0, 500.0), (-1e-5, 1000.0), (-1e-6, 500.0)])
def test_the_excursion_of_a_pad_at_rest_is_that_of_its_placement(y0, load):
    # horizontal springs carry next to nothing: R_n = F_n, and the load is that of the placement
    sides = {"L1": 0.5, "L2": 0.5, "k1": 1e6, "k2": 1e6, "alpha1": 0.0, "alpha2": np.pi}
    pad = Pad(m=1.0, w=0.04, h=0.01, k_c=1e8, mu=0.0, F_n=500.0, y0=y0, **sides)
    path = Path.of(PadModel("B2", pad), 0.0)
    z, state = path.at(0.0)
    tilt, travel, reaction = excursion(path.statics, z, state)
    assert tilt == pytest.approx(abs(z[2]), abs=1e-12)
    assert travel == pytest.approx(abs(-500.0 / 1e8 - y0) / 0.04, rel=1e-3)
    assert reaction == pytest.approx(500.0 / load, rel=1e-3)
    assert path.equilibrium(0.0).admissible


@pytest.mark.parametrize("seed", [*range(4), 40, 66, 110, 198, 290, 394])
def test_map_eigenvalues_sliding_and_sweep_agree(seed):
    scene = some_scene(seed)
    mu = scene.pad.mu
    at = verdicts_at(scene, ("mu",), np.array([[mu]]))
    mapped = NAMES[at.codes[0]]
    judged = judged_equilibria(scene)
    fold = mapped == "beyond a fold"
    try:
        analysis = analyse(scene)
    except ComputationError:
        assert (fold, judged) == (True, [])
        return
    taken, verdict = next(((e, j) for e, j in judged if e.on_branch), judged[0])
    assert (taken.q, taken.warnings) == (analysis.q, analysis.warnings)
    assert verdict.verdict == analysis.judgement.verdict
    assert bool(taken.beyond) == fold
    assert mapped in ("beyond a fold", verdict.verdict)
    assert fold or analysis.admissible != at.beyond.any()
    try:
        swept = squeal.sweep(scene, [mu]).steps[0]
        critical = critical_friction(scene, mu)
    except ComputationError:  # no equilibrium without friction
        assert fold
        return
    assert (swept.roots is None) == fold
    if not fold:
        assert swept.admissible == analysis.admissible
        assert (critical.details["admissible_to"] < mu) >= (not analysis.admissible)


def test_a_branch_that_leaves_the_model_on_its_way():
    scene = Scene("B2", random_pad(1061, "B2", mu=0.1))
    found = critical_friction(scene)
    assert found.warnings
    assert ["tilted" in words for words in found.warnings] == [True]
    limit = found.details["admissible_to"]
    assert 0.1 < limit < found.high
    low = limit * (1 - 1e-6)
    high = limit * (1 + 1e-6)
    for mu, kept in ((low, True), (high, False)):
        assert analyse(scene.replace(mu=mu)).admissible is kept


@pytest.mark.parametrize("seed", [237, 300])
def test_of_several_places_of_rest_all_take_the_least_of_the_admissible_ones(seed):
    model = PadModel("B2", random_pad(seed, "B2"), Formulation(delta_moment="-"))
    places = find_all(model.replace(mu=0.0))
    assert not places[0].admissible  # of least potential energy, but far off
    best = next(e for e in places if e.admissible)
    # the equations written out once more
    scene = Scene("B2", model.pad, model.formulation)
    (x,), (y,), (theta,) = frictionless(literal(scene, {}, 1), 1)[0]
    assert best.q == pytest.approx((x, y, theta), abs=1e-9)
    taken, how = sliding_equilibrium(model.replace(mu=1e-6))
    assert taken.q == pytest.approx(best.q, abs=1e-3 * model.pad.w)
    assert "continued from mu = 0" in how
    axes = Axis("mu", 0.0, 1e-6, 2), Axis("h", model.pad.h, model.pad.h * (1 + 1e-6), 2)
    assert stability_map(scene, axes).admissible.all()
