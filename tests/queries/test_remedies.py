"""Advised changes against NumPy: each is applied and solved again, and so is a smaller one."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from scipy.optimize import bisect

import squeal
from squeal.errors import ComputationError, InputError
from squeal.linear import Spectrum
from squeal.queries.pads.equilibrium import analyse, spectra_of_pads
from squeal.queries.remedies.changes import MOST_STEPS
from squeal.queries.remedies.meetings import Cure
from squeal.reports.page import page
from tests.conftest import ROOT

pytestmark = pytest.mark.usefixtures("coarse_charts")
EXAMPLES = ROOT / "squeal" / "examples"

SKEW = np.array([[0.0, 1.0], [-1.0, 0.0]])
TWO_PI = 2.0 * np.pi
HERTZ = (2000.0, 1825.0, 3795.0, 4100.0)
STIFFNESS = np.diag([(TWO_PI * f) ** 2 for f in HERTZ])
DAMPING = np.diag([0.002 * TWO_PI * f for f in HERTZ])
FRICTION = np.zeros((4, 4))
FRICTION[:2, :2] = -1.0532841816842562e7 * SKEW
FRICTION[2:, 2:] = -2.5266187266788755e7 * SKEW
SHIM = np.diag([0.0, 3.2858676540458784e7, 6.316546816697189e7, 0.0])


def roots_of(M, C, K):
    """All eigenvalues by NumPy, of the companion matrix."""
    n = len(M)
    lower = np.hstack([-np.linalg.solve(M, K), -np.linalg.solve(M, C)])
    return np.linalg.eigvals(np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), lower]))


def stiffness(shim, mu):
    return STIFFNESS + shim * SHIM + mu * FRICTION


def growth(shim, mu, C=DAMPING):
    """The largest growth rate of the two pairs of modes."""
    return roots_of(np.eye(4), C, stiffness(shim, mu)).real.max()


def first_loss(shim, high=2.0):
    """The friction from which on something grows, bisected, and the frequency that does, Hz."""
    values = np.linspace(0.0, high, 401)
    k = next(k for k, mu in enumerate(values) if growth(shim, mu) > 0.0)
    low, high = values[k - 1], values[k]
    for _ in range(40):
        middle = (low + high) / 2
        if growth(shim, middle) > 0.0:
            high = middle
        else:
            low = middle
    roots = roots_of(np.eye(4), DAMPING, stiffness(shim, high))
    return high, abs(roots[roots.real.argmax()].imag) / TWO_PI


def two_pairs(mu, shim=1.0):
    """Two pairs of modes that friction couples; the shim parts the first and joins the second."""
    K = {"1": STIFFNESS, "shim": SHIM, "mu": FRICTION}
    parameters = {"mu": mu, "shim": shim}
    return squeal.System(np.eye(4), DAMPING, K, parameters, name="two pairs")


@pytest.fixture(scope="module")
def trap():
    return squeal.report(two_pairs(0.4))


@pytest.fixture(scope="module")
def both():
    """Both pairs flutter."""
    return squeal.report(two_pairs(0.7))


def a_digit_less(change):
    """The change without one in its second digit."""
    digit = 10.0 ** (math.floor(math.log10(abs(change.count))) - 1)
    return change.of(change.count - math.copysign(digit, change.count))


def test_the_remedy_is_the_least_change_in_two_digits_and_that_with_a_margin(trap):
    change = trap.remedy.change
    take = trap.remedy.take
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
    for shim in (1.0, trap.remedy.take.after):
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
    value, hertz = first_loss(remedy.take.after)
    assert remedy.loss.value == pytest.approx(value, abs=1e-9)
    assert remedy.loss.frequency_hz == pytest.approx(hertz, rel=1e-6)
    up_to = float(re.search(r"nothing grows up to mu = ([\d.]+), then", trap.advice)[1])
    assert growth(remedy.take.after, up_to) < 0.0
    assert trap.to_dict()["remedy"]["with_margin"] == remedy.take.after


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
    take = report.remedy.take
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


def pair_grows(count, mu, of_second):
    """Whether the pair at 4050 Hz, or that at 2020 Hz, grows with the shim raised by so many %."""
    roots = roots_of(np.eye(4), DAMPING, stiffness(1 + count / 100, mu))
    roots = roots[roots.imag > 0.0]
    return roots[(roots.imag > TWO_PI * 3000.0) == of_second].real.max() > 0.0


def test_a_large_change_is_offered_where_no_small_one_is_enough(both):
    for count in range(-MOST_STEPS, MOST_STEPS + 1):
        assert growth(1 + count / 100, 0.7) > 0.0
    remedy = both.remedy
    assert remedy.change.verb == "lower"
    assert growth(remedy.change.after, 0.7) < 0.0
    assert growth(a_digit_less(remedy.change).after, 0.7) > 0.0
    assert growth(remedy.take.after, 0.77) < 0.0
    assert "No parameter does it with up to 25 %." in both.advice
    # smaller measures stand before it
    assert both.advice.index("of critical damping") < both.advice.index("lower shim")


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


def test_a_mode_that_leaves_the_band_has_not_stopped():
    """The stiffer pair flutters on, above the band: no remedy is named."""
    K = {"k": np.array([[2.0, -1.0], [-1.0, 2.0]]), "k*mu": np.array([[0, 4 / 3], [0, 0]])}
    C = 0.01 * np.eye(2)
    system = squeal.System(np.eye(2), C, K, {"mu": 1.0, "k": 1.0})
    report = squeal.report(system, band=(0.1, 0.23))
    assert report.remedy is None
    stiff = K["k"] + K["k*mu"]
    assert roots_of(np.eye(2), C, 1.25 * stiff).real.max() > 0.0  # and at more than 0.25 Hz


@pytest.fixture
def counts_as_large(monkeypatch):
    """What 44 rows are treated as where fewer than these are few."""
    monkeypatch.setattr("squeal.queries.systems.all_roots.ALL_ROWS", 40)
    monkeypatch.setattr("squeal.queries.remedies.treated.DENSE_ROWS", 40)
    monkeypatch.setattr("squeal.queries.remedies.parameters.DENSE_ROWS", 40)


def large(mu):
    """Ten copies of the two pairs, all but one of them far stiffer: 44 rows."""
    others = np.kron(np.diag(np.linspace(9.0, 25.0, 10)), STIFFNESS + SHIM)

    def beside(own, rest):
        matrix = np.zeros((44, 44))
        matrix[:4, :4] = own
        matrix[4:, 4:] = rest
        return matrix

    K = {"1": beside(STIFFNESS, others), "shim": beside(SHIM, 0.0), "mu": beside(FRICTION, 0.0)}
    C = np.kron(np.eye(11), DAMPING)
    return squeal.System(np.eye(44), C, K, {"mu": mu, "shim": 1.0})


@pytest.mark.usefixtures("counts_as_large")
def test_a_remedy_of_a_large_system_is_that_of_its_part(trap):
    report = squeal.report(large(0.4), high=1.0, band=(1000.0, 5000.0))
    alone = trap
    assert report.remedy.change.count == alone.remedy.change.count
    assert report.remedy.loss.value == pytest.approx(first_loss(report.remedy.take.after)[0])
    (meeting,) = report.meetings.values()
    (of_part,) = alone.meetings.values()
    omega = np.sqrt(np.diag(stiffness(1.0, 0.0)))[:2]
    assert list(meeting.hertz) == pytest.approx(list(omega / TWO_PI))
    assert set(meeting.cures) == set(of_part.cures) == set(Cure)
    for cure, amount in meeting.cures.items():
        assert amount == pytest.approx(of_part.cures[cure], rel=0.06)


def test_a_margin_beyond_the_small_changes_does_not_deny_the_least_one(trap):
    change = trap.remedy.change
    for least, take in ((20.0, 29.0), (30.0, 40.0)):
        remedy = replace(trap.remedy, change=change.of(least), take=change.of(take))
        text = remedy.sentence("")
        assert ("No parameter does it with up to 25 %" in text) == (least > 25.0)


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
    assert remedy.take.after == pytest.approx(1.2)
    for mu in np.linspace(0.0, 1.1, 221):
        window = 12.0 / (1.0 + ((mu - 0.52) / 0.01) ** 2)
        friction = scipy.linalg.block_diag(8.0 * mu * SKEW, window * SKEW)
        roots = roots_of(np.eye(4), C, K["1"] + remedy.take.after * K["s"] + friction)
        assert roots.real.max() < 0.0


@pytest.mark.usefixtures("counts_as_large")
def test_a_large_brake_that_is_quiet_in_its_band_is_not_green():
    """Of the band of the second pair nothing grows; the first does, which nobody looks at."""
    assert growth(1.0, 0.4) > 0.0
    report = squeal.report(large(0.4), high=1.0, band=(3000.0, 5000.0))
    value = bisect(lambda mu: second_pair(mu).real, 0.4, 1.0, xtol=1e-9)
    hertz = second_pair(value).imag / TWO_PI
    text = report.advice
    percent = 100.0 * (1.0 - 0.4 / value)
    assert text.startswith("Stable from 3000 to 5000 Hz at mu = 0.4. Stability is first lost ")
    assert f" at mu = {value:.4g}: flutter at {hertz:.4g} Hz; " in text
    assert f"mu = 0.4 lies {percent:.3g} % below that." in text
    assert 'class="opening open"' in page(report)
    if report.eigenvalues.beside:
        assert " But outside of 3000 to 5000 Hz, not searched, 20" in text
    else:
        assert text.endswith("Nothing outside of the band was looked at.")


@pytest.mark.usefixtures("counts_as_large")
def test_what_is_advised_for_a_band_of_a_large_brake_is_for_it_alone():
    """Where only the second pair is looked at, what stops it leaves the first, which grows too."""
    report = squeal.report(large(0.7), high=1.0, band=(3000.0, 5000.0))
    seen = "Outside of 3000 to 5000 Hz, not searched, 2021 Hz was seen to grow by 249.3 1/s, faster"
    assert report.fault.startswith("Mode ")
    assert f". {seen} than all inside." in report.fault
    assert report.advice.startswith("For 3000 to 5000 Hz alone: lower shim")
    limit = float(re.search(r"Or keep mu below ([\d.]+) \(", report.advice)[1])
    assert limit == pytest.approx(first_loss(1.0)[0], abs=1e-4)  # of the pair outside
    assert growth(1.0, limit) < 0.0
    assert " Hz outside, nothing else than 3000 to 5000 Hz" in report.advice
    change = report.remedy.change
    assert change.verb == "lower"
    assert not pair_grows(change.count, 0.7, of_second=True)
    assert pair_grows(change.count + 0.1, 0.7, of_second=True)
    assert pair_grows(change.count, 0.7, of_second=False)


def second_pair(mu):
    """The root above 3000 Hz that grows fastest."""
    roots = roots_of(np.eye(4), DAMPING, stiffness(1.0, mu))
    roots = roots[roots.imag > TWO_PI * 3000.0]
    return roots[roots.real.argmax()]


def test_what_a_change_moves_out_of_the_band_may_not_grow_there():
    """The shim raises the second mode out of the band, where a third one meets it at lower friction
    unless it is raised beyond; damping of the first pair feeds the second and third one."""
    omega = TWO_PI * np.array([100.0, 104.0, 111.0])
    K = np.diag(omega**2)
    C = np.diag(0.002 * omega)
    shim = np.zeros((3, 3))
    shim[1, 1] = 0.2 * K[1, 1]
    pair = np.zeros((3, 3))
    pair[:2, :2] = 3e4 * SKEW
    other = np.zeros((3, 3))
    other[1:, 1:] = 5.5e4 * SKEW
    terms = {"1": K - shim, "shim": shim, "mu": pair, "mu*(1.2 - mu)": other}
    system = squeal.System(np.eye(3), C, terms, parameters={"mu": 1.0, "shim": 1.0})

    def growing_from(stiffness, damping, high):
        """The least friction, above 0, at which NumPy sees growth of any frequency."""
        for mu in np.linspace(0.0, high, 131)[1:]:
            changed = stiffness + mu * pair + mu * (1.2 - mu) * other
            if roots_of(np.eye(3), damping, changed).real.max() > 1e-6:
                return mu
        return math.inf

    report = squeal.report(system, high=1.3, band=(95.0, 106.0))
    assert growing_from(K, C, 1.3) > 0.62
    for remedy in report.search.remedies:
        stiff = K + (remedy.advised.after - 1.0) * shim
        assert growing_from(stiff, C, 1.3) >= min(remedy.limit, 1.3)
    (meeting,) = report.meetings.values()
    apart = K.copy()
    apart[1, 1] = (omega[1] + TWO_PI * meeting.advised[Cure.APART]) ** 2
    damped = C + np.diag(2.0 * meeting.advised[Cure.BOTH] * omega) * [1.0, 1.0, 0.0]
    treatments = report.cures.treatments
    assert growing_from(apart, C, 1.3) >= min(treatments[Cure.APART].limit, 1.3)
    first = growing_from(K, damped, 1.3)
    assert first == pytest.approx(treatments[Cure.BOTH].limit, abs=0.01)
    assert first < 0.3
    assert "nothing from" not in report.advice  # all roots are known


def test_where_others_grow_outside_of_the_band_the_table_says_that_it_speaks_of_the_band():
    hertz = np.array([100.0, 102.0, 150.0, 152.0])
    friction = np.kron(np.eye(2), 3e4 * SKEW)
    K = {"1": np.diag((TWO_PI * hertz) ** 2), "mu": friction}
    C = np.diag(0.002 * TWO_PI * hertz)
    system = squeal.System(np.eye(4), C, K, parameters={"mu": 1.0})
    report = squeal.report(system, band=(90.0, 110.0))
    assert "in hand and next loss: of 90 to 110 Hz alone" in report.remedies.text()
    assert "nothing from 90 to 110 Hz grows" in report.advice
