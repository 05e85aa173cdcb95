"""What is advised for a band, of small systems and of large ones, against NumPy."""

import math
import re

import numpy as np
import pytest
from scipy.optimize import bisect

import squeal
from squeal import Term, TermSystem
from squeal.linear.moduli import Modulus, Table
from squeal.queries.remedies.meetings import Cure
from squeal.reports.page import page
from tests.queries.remedies.pairs import (
    DAMPING,
    FRICTION,
    SHIM,
    SKEW,
    STIFFNESS,
    TWO_PI,
    first_loss,
    growth,
    roots_of,
    stiffness,
    two_pairs,
)

pytestmark = pytest.mark.usefixtures("coarse_charts", "without_proof")


def pair_grows(count, mu, of_second):
    """Whether the pair at 4050 Hz, or that at 2020 Hz, grows with the shim raised by so many %."""
    roots = roots_of(np.eye(4), DAMPING, stiffness(1 + count / 100, mu))
    roots = roots[roots.imag > 0.0]
    return roots[(roots.imag > TWO_PI * 3000.0) == of_second].real.max() > 0.0


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
    assert report.remedy.loss.value == pytest.approx(first_loss(report.remedy.with_margin.after)[0])
    (meeting,) = report.meetings.values()
    (of_part,) = alone.meetings.values()
    omega = np.sqrt(np.diag(stiffness(1.0, 0.0)))[:2]
    assert list(meeting.hertz) == pytest.approx(list(omega / TWO_PI))
    assert set(meeting.cures) == set(of_part.cures) == set(Cure)
    for cure, amount in meeting.cures.items():
        assert amount == pytest.approx(of_part.cures[cure], rel=0.06)


@pytest.mark.usefixtures("counts_as_large")
def test_a_band_may_be_all_that_a_table_of_moduli_covers(trap):
    """A table of ones is no modulus at all; a mode that leaves the band cannot be followed."""
    brake = two_pairs(0.4)
    ones = Modulus(table=Table("ones.csv", (1000.0, 5000.0), (1.0, 1.0), (0.0, 0.0)))
    constant, *others = brake.K
    with_table = TermSystem(
        brake.M, brake.C, (Term(constant.matrix, ones), *others), brake.parameters
    )
    report = squeal.report(with_table, high=1.0, band=(1000.0, 5000.0))
    assert report.remedy.change.count == trap.remedy.change.count


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
@pytest.mark.parametrize("band", [(3000.0, 5000.0), None])
def test_a_brake_without_damping_is_not_called_stable(band):
    """Its modes neither grow nor decay: those of a band of many rows, and all of few rows."""
    rows = 30 if band is None else 44
    K = np.diag((TWO_PI * np.linspace(1000.0, 9000.0, rows)) ** 2)
    friction = np.zeros((rows, rows))
    friction[0, 1] = 1e6
    friction[1, 0] = -1e6
    system = squeal.System(np.eye(rows), K={"1": K, "mu": friction}, parameters={"mu": 0.4})
    text = squeal.report(system, high=1.0, band=band).advice
    where = "" if band is None else " from 3000 to 5000 Hz"
    assert text.startswith(f"Nothing grows{where} at mu = 0.4. No loss of stability")
    assert "Damped least" not in text


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


def test_what_grows_outside_of_the_band_at_the_start_is_not_told_of_each_value():
    """A third row with the damping mu / 2 - 0.1 decays from mu = 0.2 on, the pair grows from 0.75
    on: (4 mu / 3) - 1 = 0."""
    friction = [[0.0, 4 / 3, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
    K = {"1": [[2, -1, 0], [-1, 2, 0], [0, 0, 100]], "mu": friction}
    C = {"1": np.diag([0.0, 0.0, -0.1]), "mu": np.diag([0.0, 0.0, 0.5])}
    system = squeal.System(np.eye(3), C, K, parameters={"mu": 1.0})
    report = squeal.report(system, 2.0, (0.05, 0.5))
    words = "for 0.05 to 0.5 Hz alone: something outside grows at mu = 0 already"
    assert report.bound.reservations == [words]
    assert f"eep mu below 0.75 ({words})" in report.advice


@pytest.mark.parametrize(("present", "high"), [(1.0, 0.4), (-1.0, 2.0)])
def test_a_remedy_speaks_of_the_band_though_the_present_value_lies_beyond_the_range(present, high):
    """At the present value the pair at 100 and 110 Hz flutters and a mode at 500 Hz, outside of the
    band, is damped: that grows in all of the range but above 1/2, where the range holds that."""
    squares = np.square(TWO_PI * np.array([100.0, 110.0, 500.0]))
    raised = np.diag([0.0, (TWO_PI * 90.0) ** 2, 0.0])
    friction = np.zeros((3, 3))
    friction[:2, :2] = 6e4 * SKEW
    K = {"1": np.diag(squares) - raised, "k": raised, "mu": friction}
    C = {"1": np.diag([2.0, 2.0, -20.0]), "mu": np.diag([0.0, 0.0, 40.0 * present])}
    system = squeal.System(np.eye(3), C, K, parameters={"mu": present, "k": 1.0})
    report = squeal.report(system, band=(50.0, 200.0), high=high)
    remedy = report.remedy
    assert remedy.loss.extent == "50 to 200 Hz"
    assert remedy.limit > 1.0
    for mu in np.linspace(0.0, 0.999 * min(remedy.limit, remedy.loss.high), 9):
        stiff = K["1"] + remedy.advised.after * raised + mu * friction
        roots = roots_of(np.eye(3), C["1"] + mu * C["mu"], stiff)
        in_band = np.abs(roots.imag) < TWO_PI * 200.0
        assert roots[in_band].real.max() < 0.0
        assert (roots[~in_band].real.max() > 0.0) == (40.0 * present * mu < 20.0)
