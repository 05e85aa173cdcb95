"""Advice against the critical friction of scenes changed by hand, and against a closed form."""

import itertools
import math

import numpy as np
import pytest

from squeal.analysis.eigenvalues import analyse, growing_modes
from squeal.analysis.thresholds import critical_friction
from squeal.analysis.variations import Tolerance, advise
from squeal.errors import ComputationError, InputError
from squeal.io.scene import Scene, read_scene
from squeal.linear.system import Term, TermSystem
from squeal.model.contact import Formulation
from squeal.model.pad import Pad
from squeal.numerics.differentiation import Formula
from tests.conftest import SCENES

VALUES = {
    "m": 0.2, "w": 0.04, "h": 0.014, "k1": 2.0e7, "k2": 2.6e7, "k3": 8.7e6, "k4": 8.7e6,
    "L1": 0.8, "L2": 0.8, "alpha1": math.pi / 2, "alpha2": math.pi, "mu": 0.4, "F_n": 4500.0,
}  # fmt: skip


def scene(**changes):
    return Scene("B1", Pad(**(VALUES | changes)))


def first(one):
    return critical_friction(one).points[0].mu


def lever(advice, name):
    return next(found for found in advice.levers if found.parameter == name)


@pytest.fixture(scope="module")
def advice():
    return advise(scene(), {"k4": Tolerance(0.05)})


def test_each_change_is_the_threshold_of_the_pad_made_so_by_hand(advice):
    own = first(scene())
    assert advice.nominal.critical == own
    for name, step in {"alpha2": 0.02, "h": 0.02 * 0.014, "k4": 0.05 * 8.7e6}.items():
        found = lever(advice, name)
        assert found.step == pytest.approx(step, rel=1e-12)
        by_hand = [first(scene(**{name: VALUES[name] + s * step})) for s in (-1, 1)]
        ends = (found.lowered.critical, found.raised.critical)
        assert ends == pytest.approx(by_hand, rel=1e-12)
        assert found.changes == pytest.approx([mu - own for mu in by_hand], abs=1e-12)


def test_both_ways_are_computed_and_not_one_mirrored(advice):
    # an edge lets go on one side of k2 = 2.6e7 only: the slopes differ by a factor
    down, up = lever(advice, "k2").changes
    assert abs(up) > 2 * abs(down)


def test_ranked_by_the_larger_of_both_changes(advice):
    sizes = [max(map(abs, found.changes)) for found in advice.levers]
    assert sizes == sorted(sizes, reverse=True)
    assert lever(advice, "m").changes == (0.0, 0.0)  # I left out follows m: time is scaled
    best, word, change = advice.best
    assert change == max(c for found in advice.levers for c in found.changes)
    assert word in ("lowering", "raising")
    assert f"{word} {best.parameter}" in advice.line()


def test_what_is_zero_moves_only_by_a_tolerance_of_its_own(advice):
    assert "theta0" not in {found.parameter for found in advice.levers}
    found = lever(advise(scene(), {"theta0": Tolerance(1e-3, relative=False)}), "theta0")
    assert found.raised.critical == pytest.approx(first(scene(theta0=1e-3)), rel=1e-12)
    with pytest.raises(InputError, match="theta0 is an angle and has no share"):
        advise(scene(), {"theta0": Tolerance(0.1)})
    with pytest.raises(InputError, match="x0 is 0 and has no share"):
        advise(scene(), {"x0": Tolerance(0.1)})


def test_a_pad_without_threshold_is_ranked_by_its_frequencies():
    calm = read_scene(SCENES / "b3.yaml")
    assert critical_friction(calm).first is None
    advice = advise(calm)
    assert advice.nominal.critical is None
    hertz = sorted(e.frequency_hz for e in analyse(calm).spectrum.eigenvalues[::2])
    gap = min(1 - a / b for a, b in itertools.pairwise(hertz))
    assert advice.nominal.gap == pytest.approx(gap, rel=1e-12)
    assert all(found.changes == (0.0, 0.0) for found in advice.levers)
    sizes = [max(map(abs, found.gap_changes)) for found in advice.levers]
    assert sizes == sorted(sizes, reverse=True)


def test_models_bn_b2_b3():
    rest = {k: v for k, v in VALUES.items() if k not in ("k3", "k4")}
    line = Scene("B2", Pad(**rest, k_c=1.0e7))
    linear = {k: v for k, v in rest.items() if k not in ("L1", "L2", "F_n")}
    row = Scene("BN", Pad(**rest, k_c=1.0e7), Formulation(springs=4))
    for one in (line, row, Scene("B3", Pad(**linear, k_c=1.0e7))):
        step = 0.02 * 1.0e7
        found = lever(advise(one), "k_c")
        for side, outcome in ((-1, found.lowered), (1, found.raised)):
            by_hand = critical_friction(one.replace(k_c=1.0e7 + side * step)).first
            expected = None if by_hand is None else pytest.approx(by_hand.mu, rel=1e-11)
            assert outcome.critical == expected


def coupled(stiffness):
    """Mode coupling: flutter where (a - b)^2 < 4 k (mu - k), so from mu = k + (a - b)^2 / 4 k."""
    formula = {"a": [[1, 0], [0, 0]], "b": [[0, 0], [0, 1]], "k": [[0, -1], [-1, 0]]}
    terms = tuple(Term(np.array(m, dtype=float), Formula(f)) for f, m in formula.items())
    terms += (Term(np.array([[0.0, 1.0], [0.0, 0.0]]), Formula("mu")),)
    return TermSystem((Term(np.eye(2)),), (), terms, stiffness, "mu", "coupled")


def exact(a, b, k):
    return k + (a - b) ** 2 / (4 * k)


def test_a_system_with_named_parameters_against_its_closed_form():
    values = {"a": 3.0, "b": 2.0, "k": 0.5, "mu": 0.7}
    advice = advise(coupled(values), {"b": Tolerance(0.3, relative=False)}, mu_max=1.5)
    assert advice.nominal.critical == pytest.approx(exact(3.0, 2.0, 0.5), rel=1e-10)
    assert advice.nominal.kind == "flutter"
    for found in advice.levers:
        step = 0.3 if found.parameter == "b" else 0.02 * values[found.parameter]
        for side, outcome in ((-1, found.lowered), (1, found.raised)):
            numbers = {n: values[n] for n in "abk"}
            numbers[found.parameter] += side * step
            assert outcome.critical == pytest.approx(exact(**numbers), rel=1e-9)
    assert advice.levers[0].parameter == "b"
    # 1.02 is beyond this range, 0.5 + 1/2 is not
    high = advise(coupled(values), {"b": Tolerance(0.3, relative=False)}, mu_max=1.01)
    out = lever(high, "b").lowered
    assert (out.critical, lever(high, "b").changes[0]) == (None, pytest.approx(0.01))


def test_what_grows_at_once_has_no_threshold_to_move():
    # friction that falls with speed drives an undamped pad from the least friction on
    values = {name: value for name, value in VALUES.items() if name != "mu"}
    falling = Scene("B1", Pad(**values, mu_s=0.5, mu_k=0.3, v_ref=1.0, V=2.0))
    advice = advise(falling, mu_max=0.1)
    assert (advice.nominal.critical, advice.nominal.kind) == (0.0, "flutter")
    assert all(found.changes == (0.0, 0.0) for found in advice.levers)
    (mode,) = growing_modes(falling, analyse(falling))
    assert mode.onset is None


def test_refusals():
    with pytest.raises(InputError, match="tolerance: k9 is no parameter here; allowed are m, w"):
        advise(scene(), {"k9": Tolerance(0.1)})
    with pytest.raises(InputError, match="advise: Pad is not allowed"):
        advise(scene().pad)
    bare = TermSystem((Term(np.eye(2)),), (), (Term(np.eye(2), Formula("mu")),), {}, "mu", "bare")
    with pytest.raises(InputError, match="bare has no named parameter but mu"):
        advise(bare)
    large = {"k": 1.0}
    n = 101
    wide = TermSystem((Term(np.eye(n)),), (), (Term(np.eye(n), Formula("k")),), large, "mu", "wide")
    with pytest.raises(InputError, match="101 degrees of freedom are not allowed; at most 100"):
        advise(wide)
    for size in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(InputError, match="must be a finite number above 0"):
            Tolerance(size)
    free = scene(k1=0.0, k2=0.0, F_n=0.0)
    with pytest.raises(ComputationError, match="no place of rest"):
        advise(free)


def test_a_change_that_is_no_pad_says_why():
    advice = advise(scene(), {"h": Tolerance(1.5)})
    found = lever(advice, "h")
    assert "above 0" in found.lowered.reason
    assert found.changes[0] is None
    assert found.changes[1] is not None or found.raised.reason
