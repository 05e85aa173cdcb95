"""What a report tells to change, applied as it is told to full matrices, which NumPy solves."""

import math
import re

import numpy as np
import pytest
import scipy.linalg

import squeal
from tests.queries.remedies.pairs import roots_of

pytestmark = pytest.mark.usefixtures("coarse_charts", "without_proof")
NOTHING = 1e-7  # of |lambda|
SKEW = np.array([[0.0, 1.0], [-1.0, 0.0]])
COUPLED = np.array([[-3.0, -4.0, 46.0], [-15.0, 13.0, 0.0], [-28.0, -3.0, -24.0]])
WINDOW = np.array([[0.0, -7.0, 32.0], [7.0, 0.0, 31.0], [-32.0, -31.0, 0.0]])
CHAIN = [[12.0, 0, -13, 30], [-5, -22, -31, -14], [23, 21, 12, 3], [8, 7, -13, -18]]


def is_growing(C, K):
    roots = roots_of(np.eye(len(K)), C, K)
    roots = roots[roots.imag >= -1e-9]  # of complex matrices the others describe no motion
    return bool((roots.real > NOTHING * abs(roots)).any())


def reported(C, squares, friction, **options):
    """The report of modes on the axes, with so much damping, that friction couples at mu = 1."""
    K = {"1": np.diag(squares), "mu": np.asarray(friction)}
    system = squeal.System(np.eye(len(squares)), C, K, parameters={"mu": 1.0})
    return squeal.report(system, **options)


def told(report, squares):
    """Each kind of cure of all growing modes as the squares and the damping that it adds to modes,
    and whether it is told of the present value alone."""
    omega = np.sqrt(np.real(squares))
    meetings = report.to_dict()["meetings"]
    for kinds in (["apart"], ["both"], ["lower", "upper"]):
        stiffness = np.zeros(len(omega))
        damping = np.zeros(len(omega))
        alone = set()
        for meeting in meetings:
            known = {kind: meeting[kind] for kind in kinds if meeting[kind] is not None}
            if not known:
                break
            kind = min(known, key=known.__getitem__)
            alone.add(kind in meeting["at_value_alone"])
            hertz = np.array(meeting["frequencies_hz"])
            named = abs(omega - math.tau * hertz[:, None]) < 1e-6 * omega  # (2, n)
            if kind == "apart":
                raised = (omega + math.tau * known[kind]) ** 2 - omega**2
                stiffness = np.maximum(stiffness, named[1] * raised)
                continue
            if kind != "both":
                named = named[[int(kind == "upper")]]
            damping = np.maximum(damping, named.any(axis=0) * 2.0 * known[kind] * omega)
        else:
            if meetings:
                yield stiffness, damping, alone == {True}


def falsehoods(report, C, squares, friction):
    """What is told that NumPy refutes."""
    false = []
    for stiffness, damping, is_alone in told(report, squares):
        for mu in [1.0] if is_alone else np.linspace(0.0, 1.0, 81)[1:]:
            K = np.diag(squares + stiffness) + mu * np.asarray(friction)
            if is_growing(C + np.diag(damping), K):
                false.append((stiffness, damping, mu))
    return false


@pytest.mark.parametrize("seed", [0, 2, 3, 10, 16, 19])
def test_each_cure_stops_all_modes_at_each_value_that_it_is_told_of(seed):
    draw = np.random.default_rng(seed)
    n = 3 + seed % 4
    squares = 100.0 + draw.choice(25 * n, n, replace=False)
    friction = draw.integers(-50, 51, (n, n)).astype(float)
    if seed % 3 == 0:
        friction -= friction.T
    C = 0.1 * np.eye(n)
    if seed % 5 == 0:
        G = draw.integers(-2, 3, (n, n)).astype(float)
        C = C + G - G.T
    report = reported(C, squares, friction)
    assert falsehoods(report, C, squares, friction) == []


@pytest.mark.parametrize(
    ("damping", "squares", "friction"),
    [
        (0.08, (100.0, 102.0, 144.0), COUPLED),
        (0.12, (100.0, 102.0, 174.0), WINDOW),
        (0.1, (100.0, 114.0, 158.0, 167.0), CHAIN),
    ],
)
def test_cures_of_modes_that_others_disturb_are_true(damping, squares, friction):
    """Another real mode than the chart's, a window below the present value, two pairs at once."""
    C = damping * np.eye(len(squares))
    report = reported(C, np.array(squares), friction)
    assert falsehoods(report, C, np.array(squares), friction) == []
    assert list(told(report, squares)) != []


def test_with_just_enough_no_root_of_a_damped_system_grows_at_all():
    """Cures of a pair of which one mode has no damping, of different masses."""
    M = np.diag([1.0, 2.0, 3.0])
    K = np.array([[272.0, 5.0, 15.0], [5.0, 981.0, 12.0], [15.0, 12.0, 1262.0]])
    F = np.array([[366.0, -43.0, -12.0], [43.0, 120.0, -55.0], [12.0, 55.0, -454.0]])
    squares, modes = scipy.linalg.eigh(K, M)
    C = modes.T @ np.diag([0.0, 0.5, 0.5]) @ modes
    friction = 0.5 * modes.T @ F @ modes
    cures = list(told(reported(C, squares, friction), squares))
    assert len(cures) == 3
    for stiffness, damping, _ in cures:
        K = np.diag(squares + stiffness) + friction
        assert roots_of(np.eye(3), C + np.diag(damping), K).real.max() < 1e-9


def test_real_modes_are_those_that_take_part_from_both_sides():
    """By the right vectors alone two were taken with which no cure exists."""
    squares = [128.0, 144.0, 147.0, 165.0, 220.0, 233.0]
    friction = [
        [0.0, 0.0, -5.1, 9.0, -9.9, 14.1],
        [0.0, 9.0, 0.0, -13.2, 0.0, 8.4],
        [11.1, -7.5, 0.0, 9.9, 0.0, -8.7],
        [-5.4, -1.8, -15.0, -6.0, 15.0, -2.1],
        [7.8, 0.0, -10.5, -12.9, 4.2, 5.4],
        [10.8, 4.5, -9.0, 0.0, 0.0, 14.1],
    ]
    C = 0.14 * np.eye(6)
    report = reported(C, squares, friction)
    assert len(list(told(report, squares))) == 3
    assert not falsehoods(report, C, squares, friction)


def test_cause_and_remedy_name_the_real_modes_that_the_amounts_are_of():
    """The chart's modes that meet begin at sqrt(102) and 12: with these no damping is known, so
    that the amounts are of 10 and 12, and the cause names both pairs."""
    report = reported(0.08 * np.eye(3), (100.0, 102.0, 144.0), COUPLED)
    (meeting,) = report.to_dict()["meetings"]
    assert meeting["frequencies_hz"] == pytest.approx([10.0 / math.tau, 12.0 / math.tau])
    named = "eal modes at 1.592 and 1.91 Hz"
    assert report.opening["Cause"].startswith("Modes 2 and 3 (1.607 and 1.91 Hz at mu = 0) meet")
    assert named in report.opening["Cause"]
    assert named in report.opening["Remedy"]
    assert named in report.remedies.text()
    # either of the two roots may have either number behind the meeting
    near = float(re.search(r" [23] near ([\d.]+)", report.growing.text())[1])
    assert near == pytest.approx(0.474, abs=0.01)  # to a step of the chart


def test_a_cure_that_leaves_a_window_is_told_of_the_present_value_and_not_first():
    report = reported(0.12 * np.eye(3), (100.0, 102.0, 174.0), WINDOW)
    assert report.opening["Remedy"].startswith("Keep mu below 0.2541, ")
    # cause, cure and chart name one pair, though others have larger shares
    assert "Modes 1 and 3 (1.592 and 2.099 Hz at mu = 0) meet" in report.opening["Cause"]
    assert report.paths.groups[0] == (1, 3)
    assert "Or move further apart modes 1 and 3 (1.868 Hz)" in report.advice
    assert "nothing grows at mu = 1; below, stability is lost from mu = 0.23" in report.advice
    assert "(0.14 Hz)" in report.remedies.text()
    assert "in brackets: something grows at a lower mu" in report.remedies.text()
    assert report.hints[0].endswith("up to 25 %: damping them.")


def test_a_mode_with_negative_damping_of_its_own_is_confirmed_with_the_others():
    """Two modes that friction feeds by negative damping, and a third one that grows lower down."""
    squares = np.array([100.0, 116.0, 157.0])
    friction = [[0.0, -39.0, -9.0], [5.0, -2.0, -45.0], [-1.0, 22.0, -5.0]]
    fed = -np.diag([0.3, 0.1, 0.1])
    terms = {"1": np.diag(squares), "mu": np.array(friction)}
    system = squeal.System(np.eye(3), {"mu": fed}, terms, parameters={"mu": 1.0})
    report = squeal.report(system)
    for stiffness, damping, is_alone in told(report, squares):
        for mu in [1.0] if is_alone else np.linspace(0.0, 1.0, 81)[1:]:
            K = np.diag(squares + stiffness) + mu * np.array(friction)
            assert not is_growing(mu * fed + np.diag(damping), K)
    assert "damping" not in report.advice or any(told(report, squares))


def test_complex_stiffness_has_confirmed_cures():
    squares = np.array([100.0, 104.0, 190.0]) * (1.0 + 0.01j)
    friction = np.zeros((3, 3))
    friction[:2, :2] = 9.0 * SKEW
    report = reported(np.zeros((3, 3)), squares, friction, band=(0.5, 5.0))
    assert "Raise the damping of both" in report.advice or "raise the damping" in report.advice
    assert falsehoods(report, np.zeros((3, 3)), squares, friction) == []


def test_a_change_after_which_stability_is_lost_from_zero_on_is_reported():
    """Growth at mu = 0 that friction ends, so that the next loss of some changes lies at 0."""
    K = {"1": np.diag([1e4, 10300.0]), "s": 400.0 * SKEW, "mu": np.diag([-300.0, 0.0])}
    C = 0.5 * np.eye(2)
    report = squeal.report(squeal.System(np.eye(2), C, K, parameters={"mu": 0.7, "s": 1.0}))
    remedy = report.remedy
    assert not remedy.grows_below
    assert "just stops at mu = 0.7" in report.remedies.text()
    for mu in np.linspace(0.0, 2.0, 41):
        stiff = K["1"] + remedy.advised.after * K["s"] + mu * K["mu"]
        assert not is_growing(C, stiff)
    window = remedy.loss._replace(value=0.0, kind="flutter")
    assert window.words("mu", "") == "up to mu = 0, then flutter"


def test_each_kind_of_damping_says_itself_whether_something_grows_lower_down():
    """The third mode has little damping of its own, and meets the second one at lower friction:
    there any damping of the second one lets both grow, while damping of the first does not."""
    omega = math.tau * np.array([100.0, 104.0, 111.0])
    C = np.diag(2.0 * np.array([0.01, 0.01, 0.002]) * omega)
    first, second = np.zeros((3, 3)), np.zeros((3, 3))
    first[:2, :2] = 19451.165 * SKEW
    second[1:, 1:] = 64501.9 * SKEW
    K = {"1": np.diag(omega**2), "mu": first, "mu*(1.2 - mu)": second}
    report = squeal.report(squeal.System(np.eye(3), C, K, parameters={"mu": 1.0}), 1.3)
    (meeting,) = report.to_dict()["meetings"]
    where = np.linspace(0.0, 1.0, 101)[1:]
    for kind, damped in (("both", [1, 1, 0]), ("lower", [1, 0, 0]), ("upper", [0, 1, 0])):
        more = np.diag(2.0 * meeting[kind] * omega * damped)
        growing = []
        for mu in where:
            growing.append(is_growing(C + more, K["1"] + mu * first + mu * (1.2 - mu) * second))
        assert not growing[-1]
        assert any(growing) == (kind in meeting["at_value_alone"])
    assert "lower" not in meeting["at_value_alone"]
    assert "both" in meeting["at_value_alone"]
