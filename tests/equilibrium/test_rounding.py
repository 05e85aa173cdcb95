"""Loads far smaller and contact far stiffer than of any pad: right to rounding, or a sentence."""

import dataclasses
from typing import Any

import mpmath as mp
import numpy as np
import pytest

import squeal
from squeal.article.commands.sliding import judged_equilibria
from squeal.equilibrium import find_all, sliding_equilibrium
from squeal.equilibrium.find import frictionless_equilibria
from squeal.equilibrium.path import OF_LOADS
from squeal.equilibrium.statics import Statics
from squeal.errors import ComputationError
from squeal.io.scene import Scene
from squeal.model.contact import MODELS, Formulation
from squeal.model.equations import PadModel, net_loads
from squeal.model.pad import Pad
from squeal.queries.advise import advise
from squeal.queries.pads.equilibrium import analyse
from squeal.queries.pads.maps import NAMES, stability_map, verdicts_at
from squeal.queries.thresholds import critical_friction
from squeal.results.map import Axis
from tests.conftest import random_pad
from tests.exact import Exact
from tests.linear.conftest import exact_verdict

PAD = {"m": 0.15, "w": 0.04, "h": 0.02369996, "I": 1.174823e-4, "L1": 0.04, "L2": 0.04}
PAD |= {"k1": 1.5e8, "k2": 1.16736e8, "F_n": 1200.012}
STEEP = {"alpha1": 0.75 * np.pi, "alpha2": 0.75 * np.pi}
ACROSS = {"alpha1": np.pi, "alpha2": np.pi / 2}
LINE = Scene("B2", Pad(**PAD, **ACROSS, k_c=8.961075e7, mu=0.5))
POINTS = Scene("B1", Pad(**PAD, **STEEP, k3=4.042875e7, k4=1.170541e8, mu=0.9))
SPRINGS = Scene("BN", LINE.pad, Formulation(springs=7))
LIGHT = {"B2": (LINE, "PC"), "B1": (POINTS, "1"), "BN": (SPRINGS, "PC")}  # contact at any load


def exact_reaction(scene, found):
    """R_n at the equilibrium next to the one found, to many digits; its gaps tell the state."""
    exact = Exact(scene, found.state)
    with mp.workdps(100):
        q = exact.equilibrium(found.q, scene.pad.mu)
        assert [bool(gap < 0) for gap in exact.gaps(q)] == list(found.state)
        free = Exact(scene, type(found.state)(False, False)).loads(q, scene.pad.mu)
        return -free[1]


@pytest.mark.parametrize("load", [1e-3, 1e-12])
@pytest.mark.parametrize("model", LIGHT)
def test_equilibria_do_not_depend_on_a_small_load(model, load):
    light, contact = LIGHT[model]
    usual = light.replace(F_n=1e-3)
    scene = light.replace(F_n=load)
    found = analyse(scene)
    assert (found.contact, found.judgement.verdict) == (contact, "marginal")
    assert found.admissible, found.warnings
    e = sliding_equilibrium(scene.pad_model)[0]
    limit = sliding_equilibrium(usual.pad_model)[0]
    assert e.R_n / load == pytest.approx(limit.R_n / 1e-3, rel=1e-8)
    mapped = verdicts_at(scene, ("mu",), np.array([[scene.pad.mu]]))
    assert NAMES[mapped.codes[0]] == "marginal"
    assert scene.pad_model.states[mapped.contact[0]] == found.state
    if model == "BN":  # the literal equations have two points
        return
    assert e.R_n == pytest.approx(float(exact_reaction(scene, e)), rel=1e-12)
    for other, _ in judged_equilibria(scene):  # and none is listed that is none
        if any("rounding" in why for why in other.warnings):
            continue
        assert other.R_n == pytest.approx(float(exact_reaction(scene, other)), rel=1e-6)


@pytest.mark.parametrize("k_c", [1e14, 1e19])
def test_thresholds_of_rigid_contact_approach_their_limit(k_c):
    scene = Scene("B2", Pad(**PAD, **STEEP, k_c=k_c, mu=1.95))
    found = analyse(scene)
    e = sliding_equilibrium(scene.pad_model)[0]
    assert (found.contact, found.judgement.verdict) == ("PC", "flutter")
    assert e.R_n == pytest.approx(float(exact_reaction(scene, e)), rel=1e-9)
    exact = Exact(scene, e.state)
    with mp.workdps(100):
        q = exact.equilibrium(e.q, scene.pad.mu)
        grows = max(abs(mp.re(mp.sqrt(-s))) for s in exact.squares(q, scene.pad.mu))
    assert max(r.value.real for r in found.spectrum.eigenvalues) == pytest.approx(
        float(grows), rel=1e-9
    )
    (point,) = critical_friction(scene).points
    # the limit of a stiffness of 1e30 N/m at 50 digits, and what 1/k_c adds
    assert point.mu == pytest.approx(1.8586356651386429, abs=2e7 / k_c + 1e-11)
    alone = verdicts_at(scene, ("mu",), np.array([[1.0, 1.95]])).codes
    assert [NAMES[code] for code in alone] == ["marginal", "flutter"]


@pytest.mark.parametrize("k_c", [1e18, 1e20])
def test_where_rounding_hides_the_contact_a_sentence_says_so(k_c):
    # put at an angle, so that great lengths cancel in its gaps
    scene = Scene("B2", Pad(**PAD, **STEEP, k_c=k_c, mu=0.3, theta0=0.005))
    for ask in (analyse, judged_equilibria, critical_friction):
        with pytest.raises(ComputationError, match="which hides the contact; softer contact"):
            ask(scene)
    codes = verdicts_at(scene, ("alpha1",), np.array([[scene.pad.alpha1]])).codes
    assert NAMES[codes[0]] == "unknown"


# A pad of a small moment of inertia a few roundings beside its threshold.
BESIDE = Scene(
    "B1",
    Pad(
        m=0.13391467627773374, w=1.5090725898409654, h=0.7136379376332619,
        I=2.1535334174660996e-06, k1=1.987901055252449e-07, k2=2.9408383517564884e-07,
        k3=2.0520691913790598e-07, k4=3.726327417456647e-07, L1=10.348602771006481,
        L2=11.69638979623875, alpha1=0.35669799637069255, alpha2=2.7454597966933787,
        mu=1.3197471150971487, F_n=3.3242439129827847e-10, x0=0.10666587693987616,
        y0=-0.0009524579103299487, theta0=0.006344999469603504,
    ),
)  # fmt: skip


def exact_verdict_of(scene, found):
    exact = Exact(scene, found.state)
    with mp.workdps(60):
        return exact_verdict(exact.squares(exact.equilibrium(found.q, scene.pad.mu), scene.pad.mu))


@pytest.mark.parametrize("scene", [BESIDE, LINE.replace(mu=0.3)], ids=["beside", "far"])
def test_maps_and_doubles_alone_give_the_exact_verdict_or_none(scene, monkeypatch):
    exact = exact_verdict_of(scene, analyse(scene))
    proved = squeal.eigenvalues(scene)
    assert proved.certified
    assert proved.verdict == exact
    at = Axis("mu", 0.5 * scene.pad.mu, 1.5 * scene.pad.mu, 1)  # in the middle of its cell
    assert at.values[0] == pytest.approx(scene.pad.mu, rel=1e-15)
    [[code]] = stability_map(scene, (at, Axis("x0", 0.0, 2.0 * scene.pad.x0 or 1e-3, 1))).codes
    monkeypatch.setattr("squeal.proof.loads.flint", None)
    alone = analyse(scene)
    listed = squeal.eigenvalues(scene)
    assert not listed.certified
    if scene is BESIDE:
        assert alone.judgement.verdict != exact  # which is why it is not the answer
        assert NAMES[code] == "unknown"
        assert alone.verdict is listed.verdict is None
        assert "rounding may change the verdict" in listed.criterion
    else:
        assert NAMES[code] == alone.verdict == listed.verdict == exact


@pytest.mark.parametrize("seed", [3, 6, 9, 12])
def test_an_equilibrium_lies_as_close_to_the_exact_one_as_is_said(seed):
    """Pads as they are, of stiff contact, of small loads."""
    scene = Scene("B1" if seed % 2 else "B2", random_pad(seed, "B1" if seed % 2 else "B2"))
    harder: dict[str, Any] = {
        n: 1e7 * getattr(scene.pad, n) for n in ("k3", "k4", "k_c") if n in scene.pad.given()
    }
    lighter: dict[str, Any] = {"F_n": 1e-6 * scene.pad.F_n}
    changes = ({}, harder, lighter)[seed // 3 % 3]
    scene = scene.replace(**changes)
    found, _ = sliding_equilibrium(scene.pad_model)
    statics = Statics.of(scene.pad_model)
    length = statics.units.length
    lever = statics.units.lever
    exact = Exact(scene, found.state)
    with mp.workdps(60):
        q = exact.equilibrium(found.q, scene.pad.mu)
        off = [float(abs(v - g)) for v, g in zip(q, found.q, strict=True)]
        K = np.array(exact.stiffness(q, scene.pad.mu), dtype=float)
    moved = np.array(off) * [1.0, 1.0, lever] / length
    z = np.array([*np.array(found.q) * [1.0, 1.0, lever] / length, scene.pad.mu])[:, None]
    on = 1.0 * np.array(found.state)[:, None]
    assert np.all(moved <= statics.z_error(z, on)[:, 0])
    lengths = np.array([1.0, 1.0, length])
    unit = statics.units.mass / statics.units.time**2 * np.outer(lengths, lengths)
    error = statics.stiffness_error(z, on)[:, :, 0] + 1e-14 * np.abs(K / unit).max()
    assert np.all(np.abs(K / unit - statics.stiffness(z, on)[:, :, 0]) <= error)


# Without a load the springs lift the pad off its preload along the direction that they leave free:
# there it hangs, whatever mu, at the border of contact, where R_n is zero.
FREE = {"m": 0.31, "w": 0.033, "h": 0.011, "k1": 1.7e7, "k2": 2.2e7, "k_c": 1.9e7, "F_n": 0.0}
FREE |= {"L1": 0.4, "L2": 0.55, "alpha1": 0.47 * np.pi, "alpha2": 0.83 * np.pi, "mu": 0.37}
HANGS = Scene("B2", Pad(**FREE, y0=-2e-5))
AT_REST = "without friction the pad has no place of rest nearby"


def test_an_equilibrium_whose_reaction_is_rounding_is_none():
    found = find_all(HANGS.pad_model)
    taken = analyse(HANGS)
    assert min(e.R_n for e in found) > 1.0
    least = min(found, key=lambda e: e.potential)
    assert (taken.R_n, taken.on_branch) == (least.R_n, False)
    assert taken.R_n == pytest.approx(float(exact_reaction(HANGS, least)), rel=1e-9)
    assert np.all(taken.spectrum.values)
    assert AT_REST in taken.warnings[0]
    assert [e.R_n for e, _ in judged_equilibria(HANGS)] == [e.R_n for e in found]
    for ask in (critical_friction, advise):
        with pytest.raises(ComputationError, match=AT_REST):
            ask(HANGS)


def test_many_pads_at_once_leave_the_same_ones_out():
    loads = [0.0, 100.0, 0.0]
    heights = [-2e-5, -2e-5, 1e-5]
    expected = [False, True, False]
    statics = Statics.of(HANGS.pad_model)
    force, length = statics.units.force, statics.units.length
    changes = {"F_n": np.array(loads) / force, "y0": np.array(heights) / length}
    pads = Statics(statics.model.replace(**changes), statics.units)
    assert frictionless_equilibria(pads, 3).exists.tolist() == expected
    for load, height, there in zip(loads, heights, expected, strict=True):
        e, _ = sliding_equilibrium(HANGS.replace(mu=0.0, F_n=load, y0=height).pad_model)
        assert (e is not None and e.on_branch) == there


@pytest.mark.parametrize("name", [name for name, model in MODELS.items() if not model.linear])
def test_loads_are_the_sum_of_one_for_each_coefficient_that_they_are_proportional_to(name):
    """Euler's theorem: twice those of OF_LOADS are twice the loads, and each is linear in one."""
    pad = random_pad(5, name)
    q = (0.01, -0.03, 0.02)

    def loads(**changes):
        model = PadModel(name, dataclasses.replace(pad, **changes))
        return np.array(net_loads(np, model.c, model.law, q, (1.0,) * model.law.points))

    given = pad.given()
    coefficients = {key: given[key] for key in OF_LOADS if key in given}
    doubled = {key: 2 * value for key, value in coefficients.items()}
    assert loads(**doubled) == pytest.approx(2 * loads(), rel=1e-12)
    for key, value in coefficients.items():
        one = loads(**{key: 2 * value}) - loads()
        two = loads(**{key: 3 * value}) - loads()
        assert np.abs(one).max() > 1e-6
        assert two == pytest.approx(2 * one, rel=1e-9, abs=1e-12)
