"""What a report tells of several growing modes: causes, separation and damping, against NumPy."""

import math
import re

import numpy as np
import pytest

import squeal
from squeal.queries.remedies.meetings import Cure
from tests.queries.remedies.pairs import (
    DAMPING,
    SKEW,
    TWO_PI,
    growth,
    roots_of,
    stiffness,
)

pytestmark = pytest.mark.usefixtures("coarse_charts", "without_proof")


def more_damping(pairs, shares):
    """The damping with so much more, of critical damping, of both modes without friction of each
    pair; their shapes are the axes."""
    C = DAMPING.copy()
    for pair, share in zip(pairs, shares, strict=True):
        for mode in pair:
            C[mode, mode] += 2.0 * share * math.sqrt(stiffness(1.0, 0.0)[mode, mode])
    return C


def test_the_advice_stops_all_modes_and_both_of_each_pair(both):
    mu = 0.7
    assert len(both.eigenvalues.unstable) == 2
    advice = both.advice
    assert advice.startswith("To stop both: raise the damping of both modes ")
    named = re.findall(r"both modes (\d) and (\d) \(\d+ Hz\) by ([\d.]+) %", advice)
    pairs = {(int(one), int(other)): float(share) / 100 for one, other, share in named}
    assert set(pairs) == {(1, 2), (3, 4)}
    places = [(0, 1), (2, 3)]
    shares = [pairs[1, 2], pairs[3, 4]]
    bound = float(re.search(r"Or keep mu below ([\d.]+),", advice)[1])
    assert growth(1.0, bound) < 0.0
    # damping moves frequencies by its square, which these shares feel
    assert growth(1.0, mu, more_damping(places, 1.001 * np.array(shares))) < 0.0
    assert growth(1.0, 1.1 * mu, more_damping(places, 1.001 * np.array(shares))) < 0.0
    enough = [both.meetings[both.eigenvalues.mode_of(m)] for m in both.eigenvalues.unstable]
    less = np.array([meeting.cures[Cure.BOTH] for meeting in enough])
    assert growth(1.0, mu, more_damping(places, 0.9 * less)) > 0.0
    for k in range(2):
        assert growth(1.0, mu, more_damping([places[k]], [shares[k]])) > 0.0
    for one in places:  # of each pair one mode alone
        alone = more_damping([[one[0]], places[1 - places.index(one)]], shares)
        assert growth(1.0, mu, alone) > 0.0
    assert "; of one of both alone no amount is known to be enough" in advice


def test_a_mode_that_grows_alone_has_no_partner():
    """x'' - 0.02 x' + x = 0 beside a damped mode of a like frequency."""
    C = np.diag([-0.02, 0.02])
    K = {"1": np.diag([1.0, 1.44]), "mu": 0.1 * SKEW}
    report = squeal.report(squeal.System(np.eye(2), C, K, {"mu": 0.01}))
    assert report.opening["Cause"].startswith("No other mode meets it: ")
    assert report.advice.startswith(
        "Raise the damping of mode 1 (0.1591 Hz) by 1.3 % of critical damping: nothing "
    )


def modal_growth(meeting_of, mu, share):
    """The largest growth rate of the two pairs with so much of each cure of both of them."""
    C = DAMPING.copy()
    K = stiffness(1.0, mu)
    omega = np.sqrt(np.diag(stiffness(1.0, 0.0)))
    for (lower, upper), (cure, amount) in meeting_of.items():
        if cure is Cure.APART:
            K[upper, upper] += (omega[upper] + TWO_PI * share * amount) ** 2 - omega[upper] ** 2
            continue
        if cure is not Cure.UPPER:
            C[lower, lower] += 2.0 * share * amount * omega[lower]
        if cure is not Cure.LOWER:
            C[upper, upper] += 2.0 * share * amount * omega[upper]
    return roots_of(np.eye(4), C, K).real.max()


@pytest.mark.parametrize("cure", Cure)
def test_each_separation_and_damping_is_the_least_that_numpy_confirms(both, cure):
    """Each pair alone is left with less, while the other one has more than it needs."""
    first, second = (both.meetings[both.eigenvalues.mode_of(m)] for m in both.eigenvalues.unstable)
    pairs = [(0, 1), (1, 0)]
    named = [meeting.cures.get(cure) for meeting in (first, second)]
    if None in named:
        assert cure in (Cure.LOWER, Cure.UPPER)
        return
    places = [(0, 1), (2, 3)]
    enough = {place: (cure, amount) for place, amount in zip(places, named, strict=True)}
    assert modal_growth(enough, 0.7, 1.001) < 0.0
    for mine, other in pairs:
        less = dict(enough)
        less[places[mine]] = (cure, 0.89 * named[mine])
        assert modal_growth(less, 0.7, 1.001) > 0.0, other


def test_every_growing_mode_has_its_cause_in_a_line(both):
    causes = []
    for mode in both.eigenvalues.unstable:
        causes.append(both._cause(mode, both.eigenvalues.mode_of(mode)))
    for modes, hertz in (("1 and 2", "2000 and 2040 Hz"), ("3 and 4", "4000 and 4100 Hz")):
        (line,) = (line for line in causes if hertz in line)
        assert f"odes {modes} ({hertz} at mu = 0) meet near mu = " in line
        assert "feed each other: friction puts in" in line
    assert both.opening["Cause"] == f"M{causes[0][1:]}"
    assert "1 more mode grows: mode " in both.fault


def test_the_cause_gives_each_mode_its_own_frequency():
    """Of a band from 110 Hz on mode 1 begins at 130 Hz; mode 2 enters from 100 Hz with friction."""
    K = np.diag(np.square(TWO_PI * np.array([100.0, 130.0])))
    friction = np.array([[225_000.0, 40_000.0], [-40_000.0, 0.0]])
    C = 2.0 * np.eye(2)
    system = squeal.System(np.eye(2), C, {"1": K, "mu": friction}, parameters={"mu": 1.0})
    cause = squeal.report(system, band=(110.0, 200.0)).opening["Cause"]
    named = re.match(r"Modes 1 and 2 \(([\d.]+) and ([\d.]+) Hz at mu = ([\d.]+)\) ", cause)
    first, second, mu = map(float, named.groups())
    roots = roots_of(np.eye(2), C, K + mu * friction)
    lower, upper = np.unique(np.abs(roots.imag)) / TWO_PI
    assert [first, second] == pytest.approx([upper, lower], abs=0.05)


def test_of_many_growing_modes_the_fault_counts_all_and_the_advice_covers_them():
    """Five pairs that flutter from 3/4 on: what is advised for all of them stops all, by numpy."""
    ratios = np.diag([1.0, 4.0, 9.0, 16.0, 25.0])
    stiff = np.kron(ratios, [[2.0, -1.0], [-1.0, 2.0]])
    friction = np.kron(ratios, [[0.0, 1.34], [0.0, 0.0]])
    system = squeal.System(np.eye(10), K={"1": stiff, "mu": friction}, parameters={"mu": 0.75})
    report = squeal.report(system)
    assert "4 more modes grow: mode " in report.fault
    assert report.fault.endswith(", 2 others.")
    assert report.advice.startswith("To stop all 5: ")
    found = re.search(r"aise the damping .*, those of 2 others by up to ([\d.]+) %", report.advice)
    most = max(float(text) for text in re.findall(r"(?:by|up to) ([\d.]+) %", found[0])) / 100
    values, shapes = np.linalg.eigh(stiff)
    enough = max(meeting.cures[Cure.BOTH] for meeting in report.meetings.values())
    for share, mu, grows in ((1.01 * most, 0.825, False), (0.5 * enough, 0.75, True)):
        C = shapes @ np.diag(2.0 * share * np.sqrt(values)) @ shapes.T
        growth_rate = roots_of(np.eye(10), C, stiff + mu * friction).real.max()
        assert (growth_rate > 1e-9) == grows


def test_separation_and_damping_have_the_costs_that_changes_of_parameters_have(trap):
    """As much as is advised, applied to the matrices: the least damping left and the next loss,
    a tenth of friction or more above the present value."""
    assert set(trap.cures.treatments) == {Cure.APART, Cure.BOTH}
    omega = np.sqrt(np.diag(stiffness(1.0, 0.0)))[:2]
    for cure, effect in trap.cures.treatments.items():
        (meeting,) = trap.meetings.values()
        amount = meeting.advised[cure]
        assert amount >= 1.1 * meeting.cures[cure]
        assert 0.44 <= effect.loss.value < 0.46
        assert effect.in_hand == str(math.floor(100.0 * (effect.loss.value / 0.4 - 1.0)))
        C = DAMPING.copy()
        K = np.zeros((4, 4))
        if cure is Cure.APART:
            K[1, 1] = (omega[1] + TWO_PI * amount) ** 2 - omega[1] ** 2
        else:
            C[:2, :2] += np.diag(2.0 * amount * omega)
        for share, grows in ((0.999, False), (1.001, True)):
            roots = roots_of(np.eye(4), C, stiffness(1.0, share * effect.loss.value) + K)
            assert (roots.real.max() > 0.0) == grows
        roots = roots_of(np.eye(4), C, stiffness(1.0, 0.4) + K)
        roots = roots[roots.imag > 0.0]
        assert effect.damping_left == pytest.approx((-roots.real / abs(roots)).min(), rel=1e-6)
    text = trap.remedies.text()
    assert "separation of modes 1 and 2 (2020 Hz)" in text
    assert "damping of modes 1 and 2 (2020 Hz)" in text
