"""Advised changes of one parameter against NumPy: each is solved again, and so is a smaller one."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg

import squeal
from squeal.errors import ComputationError, InputError
from squeal.linear import Spectrum
from squeal.queries.pads.equilibrium import analyse, spectra_of_pads
from squeal.queries.remedies.changes import MOST_STEPS
from tests.conftest import ROOT
from tests.queries.remedies.pairs import (
    DAMPING,
    SKEW,
    TWO_PI,
    a_digit_less,
    first_loss,
    growth,
    roots_of,
    stiffness,
)

pytestmark = pytest.mark.usefixtures("coarse_charts", "without_proof")
EXAMPLES = ROOT / "squeal" / "examples"


def test_the_remedy_is_the_least_change_in_two_digits_and_that_with_a_margin(trap):
    change = trap.remedy.change
    take = trap.remedy.with_margin
    assert growth(1.0, 0.4) > 0.0
    assert growth(change.after, 0.4) < 0.0
    assert growth(a_digit_less(change).after, 0.4) > 0.0
    assert growth(take.after, 0.44) < 0.0
    assert growth(a_digit_less(take).after, 0.44) > 0.0
    text = f"Raise shim (factor of stiffness) by {take.count:g} %, from 1 to {take.after:g}: "
    assert trap.advice.startswith(f"{text}nothing grows up to mu = 0.44")
    (row,) = (row for row in trap.remedies.rows if row.effect is trap.remedy)
    assert row.least == f"{change.count:g} %"


def test_what_a_remedy_costs_is_that_of_numpy(trap):
    """The least damping ratio with the advised change, and the largest move of a frequency."""
    roots = []
    for shim in (1.0, trap.remedy.with_margin.after):
        found = roots_of(np.eye(4), DAMPING, stiffness(shim, 0.4))
        roots.append(found[found.imag > 0.0])
    damping = 100.0 * (-roots[1].real / abs(roots[1])).min()
    moved = abs(np.sort(roots[1].imag) - np.sort(roots[0].imag)).max() / TWO_PI
    assert f"the least damping left is {damping:.2g} %" in trap.advice
    assert f"frequencies move by up to {moved:.3g} Hz." in trap.advice
    assert f"{moved:.3g}" in trap.remedies.text()
    fewer = replace(trap.eigenvalues, eigenvalues=trap.eigenvalues.eigenvalues[:2])
    assert "frequencies move" not in replace(trap.remedy, before=fewer).words()  # as of a band


def test_the_next_loss_is_that_of_numpy(trap):
    remedy = trap.remedy
    value, hertz = first_loss(remedy.with_margin.after)
    assert remedy.loss.value == pytest.approx(value, abs=1e-9)
    assert remedy.loss.frequency_hz == pytest.approx(hertz, rel=1e-6)
    up_to = float(re.search(r"nothing grows up to mu = ([\d.]+), then", trap.advice)[1])
    assert growth(remedy.with_margin.after, up_to) < 0.0
    assert trap.to_dict()["remedy"]["with_margin"] == remedy.with_margin.after


def rate_of_pad(scene, **values):
    """The largest growth rate over the largest |lambda| of a changed pad."""
    roots = roots_of(*analyse(scene.replace(**values)).matrices)
    return roots.real.max() / abs(roots).max()


def test_pads_computed_together_have_the_eigenvalues_of_each_alone():
    """Two on the branch, one beyond its fold, no steady sliding, and what no pad can have."""
    scene = squeal.read_scene(ROOT / "tests" / "scenes" / "b2-a.yaml")
    existing = [{"m": 2.0}, {"alpha1": 1.2}, {"alpha1": 1.2, "mu": 3.0}]
    missing = [{"alpha1": 0.2, "mu": 6.0}, {"k1": -1.0}]
    *spectra, no_sliding, no_pad = spectra_of_pads(scene, existing + missing)
    for values, spectrum in zip(existing, spectra, strict=True):
        roots = roots_of(*analyse(scene.replace(**values)).matrices)
        assert isinstance(spectrum, Spectrum)
        for root in spectrum.values:
            assert abs(roots - root).min() < 1e-6 * abs(roots).max()
    assert isinstance(no_sliding, ComputationError)
    assert "no steady sliding exists" in str(no_sliding)
    assert isinstance(no_pad, InputError)


def test_the_remedy_of_a_pad_is_the_least_angle_and_the_other_way_is_named(monkeypatch):
    """Nothing damps the pad: what grows parts from the axis like a root. One step reaches both."""
    monkeypatch.setattr("squeal.queries.remedies.parameters.STEPS", (10,))
    monkeypatch.setattr("squeal.queries.remedies.parameters.MOST_REMEDIES", 2)
    scene = squeal.read_scene(EXAMPLES / "pad.yaml")
    report = squeal.report(scene)
    change = report.remedy.change
    take = report.remedy.with_margin
    assert change.unit == "degrees"
    name = change.parameter
    assert rate_of_pad(scene, **{name: change.after}) < 1e-7
    assert rate_of_pad(scene, **{name: a_digit_less(change).after}) > 1e-4
    assert rate_of_pad(scene, **{name: take.after}, mu=0.44) < 1e-7
    assert rate_of_pad(scene, **{name: a_digit_less(take).after}, mu=0.44) > 1e-4
    before = number_in_degrees(change.before)
    after = number_in_degrees(take.after)
    assert f"degrees, from {before} to {after} degrees: nothing grows" in report.advice
    assert "; nothing damps this model, " in report.advice
    other = report.search.remedies[1]
    assert (change.verb, other.change.verb) == ("raise", "lower")
    assert rate_of_pad(scene, **{name: a_digit_less(other.change).after}) > 1e-4
    part = other.change.of(0.25 * other.change.count)
    assert rate_of_pad(scene, **{name: part.after}) > rate_of_pad(scene)
    assert "where the search ends; on the way growth first rises to " in report.advice
    for mu in np.linspace(0.2, 2.0, 10):
        assert rate_of_pad(scene, **{name: other.advised.after}, mu=float(mu)) < 1e-7
    words = f"Or lower {name} (inclination of spring 2) by {other.advised.size}, "
    assert words in report.advice
    left = [remedy.computed.unstable for remedy in report.search.remedies]
    assert left == [()] * len(left)
    assert "alpha2 (inclination of spring 2)" in str(report)


def number_in_degrees(angle):
    return f"{math.degrees(angle):.5g}"


def test_a_large_change_is_offered_where_no_small_one_is_enough(both):
    for count in range(-MOST_STEPS, MOST_STEPS + 1):
        assert growth(1 + count / 100, 0.7) > 0.0
    remedy = both.remedy
    assert remedy.change.verb == "lower"
    assert growth(remedy.change.after, 0.7) < 0.0
    assert growth(a_digit_less(remedy.change).after, 0.7) > 0.0
    assert growth(remedy.with_margin.after, 0.77) < 0.0
    assert "No parameter does it with up to 25 %." in both.advice
    # smaller measures stand before it
    assert both.advice.index("of critical damping") < both.advice.index("lower shim")


def test_a_margin_beyond_the_small_changes_does_not_deny_the_least_one(trap):
    change = trap.remedy.change
    for least, take in ((20.0, 29.0), (30.0, 40.0)):
        changes = {"change": change.of(least), "with_margin": change.of(take)}
        remedy = replace(trap.remedy, **changes, is_small=least <= MOST_STEPS)
        text = remedy.sentence("")
        assert ("No parameter does it with up to 25 %" in text) == (least > 25.0)


def test_a_small_change_that_is_confirmed_as_a_large_one_is_not_denied(trap):
    """The full system is asked for sizes above that of the search, which found 6.03 % here."""
    change = trap.remedy.change
    remedy = replace(trap.remedy, change=change.of(27.0), with_margin=change.of(30.0))
    assert "No parameter does it" not in remedy.sentence("")


def test_a_window_that_no_sample_shows_asks_for_a_larger_change():
    """The second pair grows about mu = 0.52 until s is 1.2, the first at mu = 1.1 until 1.12."""
    K = {"1": np.diag([100.0, 84.0, 400.0, 388.0]), "s": np.diag([0.0, 30.0, 0.0, 30.0])}
    K["mu"] = scipy.linalg.block_diag(8.0 * SKEW, 0.0 * SKEW)
    K["1/(1 + ((mu - 0.52)/0.01)**2)"] = scipy.linalg.block_diag(0.0 * SKEW, 12.0 * SKEW)
    C = 0.02 * np.eye(4)
    report = squeal.report(squeal.System(np.eye(4), C, K, parameters={"mu": 1.0, "s": 1.0}))
    remedy = report.remedy
    assert remedy.change.after == pytest.approx(1.067)
    assert " 6.7 % " in report.remedies.text()  # just enough at mu = 1, not at 0.52
    assert remedy.with_margin.after == pytest.approx(1.2)
    for mu in np.linspace(0.0, 1.1, 221):
        window = 12.0 / (1.0 + ((mu - 0.52) / 0.01) ** 2)
        friction = scipy.linalg.block_diag(8.0 * mu * SKEW, window * SKEW)
        roots = roots_of(np.eye(4), C, K["1"] + remedy.with_margin.after * K["s"] + friction)
        assert roots.real.max() < 0.0


def test_the_value_to_keep_below_is_not_above_the_interval_of_the_loss():
    """Damping (1.037 - mu)^3, multiplied out: rounding leaves its zero open by 8e-4."""
    p = 1.037
    cube = f"{p**3} - {3 * p**2}*mu + {3 * p}*mu**2 - mu**3"
    system = squeal.System([[1.0]], {cube: [[1.0]]}, [[4.0]], parameters={"mu": 1.5})
    report = squeal.report(system)
    lower_end, upper_end = report.thresholds.first.interval
    assert lower_end < p < upper_end
    assert float(report.bound.below) <= lower_end
    assert f"eep mu below {report.bound.below}" in report.advice
