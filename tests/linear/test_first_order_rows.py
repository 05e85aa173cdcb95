"""Thresholds of systems of which rows have dampers and no mass, by Routh and Hurwitz."""

import control
import numpy as np
import pytest

import squeal

COMPANION = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, -3.0, -3.0]])  # (s + 1)^3
LOOP = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
NONE = np.zeros((3, 3))


def plant(**parameters):
    """(s + 1)^3 + g, at the limit for g = 8 and s = i sqrt(3)."""
    return squeal.System(NONE, np.eye(3), {"1": -COMPANION, "g": LOOP}, parameters, parameter="g")


def only(answer):
    (point,) = answer.points
    return point


def test_a_loop_around_three_lags_has_the_gain_of_routh():
    answer = squeal.thresholds(plant(), high=100.0)
    point = only(answer)
    assert point.kind == "flutter"
    assert point.mu == pytest.approx(8.0, rel=1e-9)
    assert 2 * np.pi * point.frequency_hz == pytest.approx(np.sqrt(3.0), rel=1e-9)
    assert answer.verdict == "stable"
    assert answer.certified
    (crossing,) = answer.crossings
    found = squeal.eigenvalues(plant(g=8.0001))  # a real root is the first mode, the pair second
    assert crossing.mode == found.mode_of(found.unstable[0]) == 2


def test_a_plant_of_python_control_closed_by_hand_has_its_gain_margin():
    ss = control.ss(COMPANION, [[0.0], [0.0], [1.0]], [[1.0, 0.0, 0.0]], 0.0)
    opened = squeal.System.from_control(ss)
    K = {"1": opened.K[0].matrix, "g": ss.B @ ss.C}
    closed = squeal.System(opened.M[0].matrix, opened.C[0].matrix, K, parameter="g")
    margin = control.margin(ss)[0]
    assert only(squeal.thresholds(closed, high=20.0)).mu == pytest.approx(margin, rel=1e-6)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_one_lag_diverges_where_its_loop_gain_is_one(scale):
    system = squeal.System([[0.0]], [[scale]], {"1": [[scale]], "g": [[-scale]]}, parameter="g")
    point = only(squeal.thresholds(system, high=3.0))
    assert (point.kind, point.frequency_hz) == ("divergence", 0.0)
    assert point.mu == pytest.approx(1.0, rel=1e-9)


@pytest.mark.parametrize("lag", [0.01, 0.1, 1.0])
def test_a_mass_whose_force_lags_has_one_row_with_a_damper_alone(lag):
    """m x'' + c x' + k x + mu y = 0, lag y' + y = x: (1 + c lag) (c + k lag) = lag (k + mu)."""
    c = 0.3
    k = 4.0
    M = np.diag([1.0, 0.0])
    C = np.diag([c, lag])
    K = {"1": [[k, 0.0], [-1.0, 1.0]], "mu": [[0.0, 1.0], [0.0, 0.0]]}
    exact = (1 + c * lag) * (c + k * lag) / lag - k
    point = only(squeal.thresholds(squeal.System(M, C, K), high=2 * exact))
    assert point.kind == "flutter"
    assert point.mu == pytest.approx(exact, rel=1e-9)
    assert (2 * np.pi * point.frequency_hz) ** 2 == pytest.approx(c / lag + k, rel=1e-9)


def test_damping_that_changes_with_the_parameter_is_followed():
    """(1 + g/10) s^3 + 3 s^2 + 3 s + 1 + g: 9 = (1 + g/10) (1 + g)."""
    last = np.diag([0.0, 0.0, 1.0])
    K = {"1": -COMPANION, "g": LOOP}
    system = squeal.System(NONE, {"1": np.eye(3), "g / 10": last}, K, parameter="g")
    exact = max(np.roots([0.1, 1.1, -8.0]))
    assert only(squeal.thresholds(system, high=50.0)).mu == pytest.approx(exact, rel=1e-9)


def test_rows_in_any_combination_have_the_same_thresholds():
    """A mass, its lag and three lags in one system, rows and coordinates mixed at random."""
    rng = np.random.default_rng(5)
    T, S = rng.standard_normal((2, 5, 5))
    M = np.zeros((5, 5))
    M[3, 3] = 1.0
    C = np.diag([1.0, 1.0, 1.0, 0.3, 0.1])
    K0 = np.zeros((5, 5))
    K0[:3, :3] = -COMPANION
    K0[3:, 3:] = [[4.0, 0.0], [-1.0, 1.0]]
    K1 = np.zeros((5, 5))
    K1[:3, :3] = LOOP
    K1[3, 4] = 1.0
    K = {"1": T @ K0 @ S, "g": T @ K1 @ S}
    system = squeal.System(T @ M @ S, T @ C @ S, K, parameter="g")
    late = (1 + 0.03) * (0.3 + 0.4) / 0.1 - 4.0
    values = [crossing.mu for crossing in squeal.thresholds(system, high=20.0).crossings]
    assert values == pytest.approx(sorted([8.0, late]), rel=1e-8)


def test_many_rows_have_the_gain_of_their_loop():
    n = 30
    turn = np.linalg.qr(np.random.default_rng(2).standard_normal((n, n)))[0]
    K0 = np.diag(np.linspace(1.0, 9.0, n))
    K0[:3, :3] = -COMPANION
    K1 = np.zeros((n, n))
    K1[:3, :3] = LOOP
    K = {"1": turn @ K0 @ turn.T, "g": turn @ K1 @ turn.T}
    system = squeal.System(np.zeros((n, n)), np.eye(n), K, parameter="g")
    assert only(squeal.thresholds(system, high=20.0)).mu == pytest.approx(8.0, rel=1e-8)


def test_what_asks_for_thresholds_has_them_too():
    """(s + 1)^2 (s + a) + g: (2 + a) (1 + 2 a) = a + g, whose slope at a = 1 is 8."""
    K = {"1": [[0, -1, 0], [0, 0, -1], [0, 1, 2]], "a": [[0, 0, 0], [0, 0, 0], [1, 2, 1]]}
    system = squeal.System(NONE, np.eye(3), {**K, "g": LOOP}, {"a": 1.0}, parameter="g")
    moved = squeal.sensitivity(system, of="threshold", high=20.0)
    assert moved.at == pytest.approx(8.0, rel=1e-9)
    assert moved.slopes["a"][0] == pytest.approx(8.0, rel=1e-6)
    answer = squeal.scatter(system, {"a": {"within": 0.1}}, samples=8, high=20.0)
    assert len(answer.rows) == 8
    for row in answer.rows:
        a = row.parameters["a"]
        assert row.value == pytest.approx((2 + a) * (1 + 2 * a) - a, rel=1e-6)


def test_a_refusal_names_the_band_as_python_does():
    """The damping 1/2 - mu of a row without mass vanishes: its root passes through infinity."""
    M = np.diag([1.0, 0.0])
    C = {"1": np.diag([0.1, 0.5]), "mu": np.diag([0.0, -1.0])}
    system = squeal.System(M, C, [[2.0, -1.0], [-1.0, 2.0]])
    with pytest.raises(squeal.InputError, match=r"infinity.*`band`") as refused:
        squeal.thresholds(system)
    assert "--" not in str(refused.value)


@pytest.mark.parametrize("K", [[[1.1, 0.3], [0.4, 2.1]], [[1.1, 0.3], [0.0, 1.1]]])
def test_short_floats_bound_the_roots_of_rows_without_mass(K):
    """The numbers that were rounded to single precision have their roots within the errors."""
    M, C, short_K = (np.asarray(X, np.float32) for X in (np.zeros((2, 2)), np.eye(2), K))
    found = squeal.eigenvalues(squeal.System(M, C, short_K))
    roots = np.sort(-np.linalg.eigvals(K))[::-1]
    errors = np.array([root.error for root in found.eigenvalues])
    assert np.all(np.abs(found.values - roots) <= errors)
    assert np.all(errors < 1e-6)


def test_short_floats_leave_a_double_root_at_zero_without_mass_open():
    """Entries of 1e-8 in place of 0 would move both roots by the root of 0.3e-8."""
    K = np.array([[0.0, 0.3], [0.0, 0.0]], dtype=np.float32)
    found = squeal.eigenvalues(squeal.System(np.zeros((2, 2)), np.eye(2), K))
    assert all(1e-5 < root.error < 1e-3 for root in found.eigenvalues)
