"""Advice against scenes changed by hand, and against a closed form."""

import functools
import math
from dataclasses import replace

import numpy as np
import pytest

import squeal
from squeal.errors import ComputationError, InputError
from squeal.io.scene import Scene, read_scene
from squeal.linear.system import TermSystem
from squeal.linear.terms import Term
from squeal.model.contact import Formulation
from squeal.model.pad import Pad
from squeal.numerics.differentiation import Formula
from squeal.queries.advise import advise
from squeal.queries.parameter_space import NO_PAD, Outcome
from squeal.queries.thresholds import critical_friction
from tests.conftest import SCENES

VALUES = {
    "m": 0.2, "w": 0.04, "h": 0.014, "k1": 2.0e7, "k2": 2.6e7, "k3": 8.7e6, "k4": 8.7e6,
    "L1": 0.8, "L2": 0.8, "alpha1": math.pi / 2, "alpha2": math.pi, "mu": 0.4, "F_n": 4500.0,
}  # fmt: skip
SCENE = Scene("B1", Pad(**VALUES))


@functools.cache
def first(**changes):
    """The threshold of the pad with other values; I of the uniform rectangle is written out."""
    values = {"I": None} | VALUES | changes
    values["I"] = values["I"] or values["m"] * (values["w"] ** 2 + values["h"] ** 2) / 3
    return critical_friction(Scene("B1", Pad(**values))).points[0].mu


def lever(advice, name):
    return next(one for one in advice.levers if one.parameter == name)


def coupled(stiffness):
    """Mode coupling: flutter where (a - b)^2 < 4 k (mu - k), so from mu = k + (a - b)^2 / 4 k."""
    formula = {"a": [[1, 0], [0, 0]], "b": [[0, 0], [0, 1]], "k": [[0, -1], [-1, 0]]}
    terms = tuple(Term(np.array(m, dtype=float), Formula(f)) for f, m in formula.items())
    terms += (Term(np.array([[0.0, 1.0], [0.0, 0.0]]), Formula("mu")),)
    return TermSystem((Term(np.eye(2)),), (), terms, stiffness, "mu", "coupled")


def test_each_change_is_the_threshold_of_the_pad_made_so_by_hand():
    advice = advise(SCENE, {"k4": "5%", "theta0": 1e-3})
    assert advice.nominal.critical == pytest.approx(first(), rel=1e-14)
    steps = {"alpha2": 0.02, "h": 0.02 * 0.014, "w": 0.02 * 0.04, "k4": 0.05 * 8.7e6}
    for name, step in (steps | {"theta0": 1e-3}).items():
        one = lever(advice, name)
        assert one.step == pytest.approx(step, rel=1e-12)
        by_hand = [first(**{name: VALUES.get(name, 0.0) + s * step}) for s in (-1, 1)]
        assert (one.lowered.critical, one.raised.critical) == pytest.approx(by_hand, rel=1e-11)
        assert one.changes == pytest.approx([mu - first() for mu in by_hand], abs=1e-11)
    # an edge lets go on one side of k2 = 2.6e7 only: the slopes differ by a factor
    down, up = lever(advice, "k2").changes
    assert abs(up) > 2 * abs(down)
    assert "x0" not in {one.parameter for one in advice.levers}  # what is 0 stays
    # the larger of both changes ranks a lever; I left out follows m: time is scaled
    sizes = [max(map(abs, one.changes)) for one in advice.levers]
    assert sizes == sorted(sizes, reverse=True)
    assert lever(advice, "m").changes == (0.0, 0.0)
    changes = []
    for one in advice.levers:
        changes += [change for change in one.changes if change]
    assert [change for change, *_ in advice.changes] == sorted(changes)
    _, best, word = advice.changes[-1]
    assert f"best: {word} {best.parameter}" in advice.line()
    assert "first order" not in str(advice)


@pytest.mark.parametrize("model", ["B2", "BN", "B3"])
def test_levers_of_the_other_models_are_thresholds_of_changed_pads(model):
    unused = {"B3": ("k3", "k4", "L1", "L2", "F_n")}.get(model, ("k3", "k4"))
    pad = Pad(**{k: v for k, v in VALUES.items() if k not in unused}, k_c=1.0e7)
    scene = Scene(model, pad, Formulation(springs=4) if model == "BN" else Formulation())
    one = lever(advise(scene), "k_c")
    for k_c, outcome in ((0.98e7, one.lowered), (1.02e7, one.raised)):
        by_hand = critical_friction(scene.replace(k_c=k_c)).first
        assert outcome.critical == (by_hand and pytest.approx(by_hand.mu, rel=1e-11))


def test_advice_on_a_system_is_that_of_its_closed_form():
    values = {"a": 3.0, "b": 2.0, "k": 0.5, "mu": 0.7}
    advice = advise(coupled(values), {"b": 0.3}, high=1.5)
    assert advice.nominal.critical == pytest.approx(1.0, rel=1e-10)
    assert advice.nominal.kind == "flutter"
    assert "to first order" in str(advice)  # derivatives moved it, no other computation
    slopes = {"a": 1.0, "b": -1.0, "k": 0.0}  # (a - b) / 2k, and 1 - (a - b)^2 / 4k^2
    for one in advice.levers:
        change = slopes[one.parameter] * one.step
        assert one.changes == pytest.approx((-change, change), abs=1e-9)
    assert (advice.levers[0].parameter, advice.levers[0].step) == ("b", 0.3)
    # 1.345 is beyond this range, 1 is not
    beyond = lever(advise(coupled(values), {"b": 0.3}, high=1.01), "b")
    assert (beyond.lowered.critical, beyond.changes[0]) == (None, pytest.approx(0.01))


def test_what_grows_at_once_and_what_never_grows_has_no_threshold_to_move():
    # friction that falls with speed drives an undamped pad from the least friction on
    values = {name: value for name, value in VALUES.items() if name != "mu"}
    falling = Scene("B1", Pad(**values, mu_s=0.5, mu_k=0.3, v_ref=1.0, V=2.0))
    advice = advise(falling, high=0.1)
    assert (advice.nominal.critical, advice.nominal.kind) == (0.0, "flutter")
    assert all(one.changes == (0.0, 0.0) for one in advice.levers)
    assert [mode.onset for mode in squeal.eigenvalues(falling).unstable] == [None]
    calm = advise(read_scene(SCENES / "b3.yaml"))
    assert calm.nominal.critical is None
    assert all(one.changes == (0.0, 0.0) for one in calm.levers)


def test_a_change_that_is_no_pad_says_why():
    one = lever(advise(SCENE, {"h": "150%"}), "h")
    assert "above 0" in one.lowered.reason
    assert one.changes[0] is None
    assert one.changes[1] is not None or one.raised.reason
    with pytest.raises(ComputationError, match="no place of rest"):
        advise(SCENE.replace(k1=0.0, k2=0.0, F_n=0.0))


def test_only_a_change_that_is_no_pad_is_called_one():
    """A pad whose threshold could not be computed was called no pad."""
    advice = advise(SCENE, {"h": "150%"})
    one = lever(advice, "h")
    undecided = replace(one, lowered=Outcome(reason="hidden"), raised=Outcome(kind=NO_PAD))
    columns = {column.name: column for column in advice.table().columns}
    assert columns["critical_lowered"].shown(one) == "no such pad"
    assert columns["critical_lowered"].shown(undecided) == "unknown"
    assert columns["critical_raised"].shown(undecided) == "no such pad"


@pytest.mark.parametrize("name", ["w", "h"])
def test_an_inertia_that_is_left_out_follows_in_contours_and_levers(name):
    own = VALUES[name]
    load = squeal.Axis("F_n", 4000.0, 5000.0, 1)
    axes = squeal.Axis(name, 0.9 * own, 1.1 * own, 2), load
    values = squeal.map(SCENE, axes, "critical-friction").quantity[2]
    exact = [first(**{name: float(value)}) for value in axes[0].values]
    assert values[:, 0] == pytest.approx(exact, rel=1e-6)
    one = lever(advise(SCENE, {name: "5%"}), name)
    for outcome, factor in ((one.lowered, 0.95), (one.raised, 1.05)):
        value = factor * own
        assert outcome.critical == pytest.approx(first(**{name: value}), rel=1e-9)
        held = first(**{name: value}, I=SCENE.pad.I)  # must not come out
        assert outcome.critical != pytest.approx(held, rel=1e-4)


BARE = TermSystem((Term(np.eye(2)),), (), (Term(np.eye(2), Formula("mu")),), {}, "mu", "bare")


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (lambda: advise(SCENE, {"k9": "10%"}), "k9 is no parameter here; allowed are m"),
        (lambda: advise(SCENE, {"theta0": "10%"}), "theta0 is an angle and has no share"),
        (lambda: advise(SCENE, {"x0": "10%"}), "x0 is 0 and has no share"),
        (lambda: advise(BARE), "bare has no named parameter but mu"),
        (lambda: advise(SCENE, band=(1.0, 2.0)), "band: is not allowed with a scene"),
        (lambda: advise(SCENE, memory=1e9), "memory: is not allowed with a scene"),
        (lambda: advise(SCENE, {"k1": 0.0}), "a finite number above 0"),
        (lambda: advise(SCENE, {"k1": -1.0}), "a finite number above 0"),
        (lambda: advise(SCENE, {"k1": np.inf}), "a finite number above 0"),
        (lambda: advise(SCENE, {"k1": "-5%"}), "a finite number above 0"),
        (lambda: advise(SCENE, {"k1": "many"}), "a finite number above 0"),
    ],
)
def test_advice_on_what_cannot_be_varied_is_refused(wrong, words):
    with pytest.raises(InputError, match=words):
        wrong()
