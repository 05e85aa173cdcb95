"""Modes keep their numbers over a sweep: closed forms of crossing, veering and coalescing ones."""

import numpy as np
import pytest

import squeal

COUPLED = {"1": [[2.0, -1.0], [-1.0, 2.0]], "mu": [[0.0, 4 / 3], [0.0, 0.0]]}  # flutter from 3/4


def rising(p):
    return 1 + p


def falling(p):
    return 3 - p


def two(coupling, others, at=0.0, damping=0.0):
    """Squares 1 + p and 3 - p beside others, coupled, seen in other coordinates."""
    n = 2 + others
    T = np.linalg.qr(np.random.default_rng(n).normal(size=(n, n)))[0]
    K0 = np.diag([1.0, 3.0, *(50.0 + np.arange(others))])
    K0[0, 1] = K0[1, 0] = coupling
    slopes = np.diag([1.0, -1.0, *np.zeros(others)])
    K = {"1": T @ K0 @ T.T, "p": T @ slopes @ T.T}
    C = damping * T @ np.diag(np.arange(n)) @ T.T if damping else None
    return squeal.System(np.eye(n), C, K, {"p": at}, "p")


def squares(sweep, number):
    """The squares of the frequencies of a mode over a sweep."""
    found = []
    for step in sweep.steps:
        upper = step.roots[(step.modes == number) & (step.roots.imag > 0)]
        found.append(upper.imag**2)
    return np.ravel(found)


@pytest.mark.parametrize("others", [0, 40])
@pytest.mark.parametrize("method", [None, "reduced"])
@pytest.mark.parametrize("count", [4, 12])
def test_modes_that_cross_go_on_and_modes_that_veer_keep_their_branch(others, method, count):
    values = np.linspace(0.0, 2.0, count)
    for gap in (0.0, 0.4):
        found = squeal.sweep(two(gap, others), values.tolist(), band=(0.05, 0.5), method=method)
        split = np.hypot(values - 1, gap)
        expected = (2 - split, 2 + split) if gap else (rising(values), falling(values))
        for number, exact in enumerate(expected, 1):
            assert squares(found, number) == pytest.approx(exact, rel=1e-6)
        assert not found.losses


def test_numbers_are_those_of_the_eigenvalues_at_the_own_value():
    system = two(0.0, 3, at=1.6, damping=1e-3)  # by frequency there the falling mode is the first
    found = squeal.sweep(system, [0.0, 1.0, 2.0])
    here = squeal.eigenvalues(system)
    assert squares(found, 1)[[0, 2]] == pytest.approx([3.0, 1.0], rel=1e-4)
    assert here.modes.tolist() == [k for k in range(1, 6) for _ in range(2)]
    assert here.values[0].imag ** 2 == pytest.approx(1.4, rel=1e-4)
    rows = {(row["p"], row["mode"]) for row in found.to_records()}
    assert rows == {(p, k) for p in (0.0, 1.0, 2.0) for k in range(1, 6)}


def test_a_coalescence_is_told_and_growth_begins_there():
    system = squeal.System(np.eye(2), K=COUPLED, parameters={"mu": 1.2})
    found = squeal.sweep(system, np.linspace(0.1, 1.5, 10).tolist())
    assert {loss.modes for loss in found.losses} == {(1, 2)}
    assert {loss.kind for loss in found.losses} == {"meet"}
    assert all(low < 0.75 < high for low, high, *_ in found.losses)
    (grows,) = (mode for mode in found.modes if mode.onset is not None)
    assert grows.interval[0] < 0.75 < grows.interval[1]
    assert grows.growth_rate == pytest.approx(squeal.eigenvalues(system, 1.5).values.real.max())


@pytest.mark.parametrize("method", [None, "reduced"])
@pytest.mark.parametrize("count", [3, 6, 9, 30])
def test_modes_that_come_near_do_not_meet_before_they_do(method, count):
    """Squares 1 +- (2e-3^2 - mu^2)^(1/2) coalesce at mu = 2e-3, of damping 1e-5 slightly beside."""
    K = {"1": np.diag([0.998, 1.002]), "mu": [[0, 1], [-1, 0]]}
    system = squeal.System(np.eye(2), 1e-5 * np.diag([1.0, 1.2]), K)
    for high, meet in ((1.98e-3, 0), (3e-3, 1)):
        values = np.linspace(0.0, high, count).tolist()
        found = squeal.sweep(system, values, band=(0.1, 0.2), method=method)
        assert len(found.losses) == meet
        assert all(loss.low < 2e-3 < loss.high for loss in found.losses)
        for step in found.steps:  # the first one is the lower as long as they are apart
            if step.value < 1.98e-3:
                lower = step.roots[step.modes == 1].imag
                upper = step.roots[step.modes == 2].imag
                assert lower < upper


@pytest.mark.usefixtures("coarse_charts")
def test_a_large_system_learns_onsets_from_a_sweep_or_from_thresholds(monkeypatch):
    """Six rows count as large."""
    monkeypatch.setattr("squeal.queries.systems.eigenvalues.ONSET_ROWS", 5)
    coupled = {k: np.pad(np.array(X, float), (0, 4)) for k, X in COUPLED.items()}
    coupled["1"] += np.diag([0.0, 0.0, *(50.0 + np.arange(4))])
    system = squeal.System(np.eye(6), K=coupled, parameters={"mu": 0.8})
    here = squeal.eigenvalues(system)
    assert [mode.onset for mode in here.unstable] == [None]
    sweep = squeal.sweep(system, np.linspace(0.1, 1.5, 8).tolist())  # and at the own value
    (mode,) = here.with_onsets(sweep).unstable
    assert mode.interval == pytest.approx((0.7, 0.8))
    assert "0.7 to 0.8" in here.with_onsets(sweep).text()
    (row,) = squeal.report(system).to_records()
    assert row["onset"] == pytest.approx(0.75, rel=1e-9)


@pytest.mark.parametrize("others", [*range(1, 9), 60])
def test_modes_that_coincide_at_a_value_of_the_sweep_keep_their_numbers(others):
    """There any mixture of their vectors is computed; both paths go straight on."""
    values = np.linspace(0.0, 2.0, 5)
    found = squeal.sweep(two(0.0, others), values.tolist(), band=(0.05, 0.5))
    assert not found.losses
    assert squares(found, 1) == pytest.approx(rising(values), rel=1e-6)
    assert squares(found, 2) == pytest.approx(falling(values), rel=1e-6)


@pytest.mark.parametrize("others", [*range(1, 9), 60])
def test_what_leaves_the_band_ends_and_what_enters_begins(others):
    system = two(0.0, others)
    found = squeal.sweep(system, np.linspace(0.0, 2.0, 5).tolist(), band=(0.0, 0.2251))
    kinds = {(loss.kind, loss.modes) for loss in found.losses}  # the band ends above p = 1
    assert kinds == {("end", (1,)), ("begin", (2,))}


def test_a_threshold_has_the_number_of_the_mode_that_grows_beyond():
    """Beside it a mode whose frequency is lower by 4e-7 of it."""
    M = np.eye(3)
    C = np.diag([1e-2, 1e-2, 1e-2])
    K = np.diag([1.0, 4.0, 4.0 * (1 + 4e-7)])
    system = squeal.System(M, {"1": C, "mu": -1e-2 * np.diag([0.0, 0.0, 1.0])}, K)
    (crossing,) = squeal.thresholds(system, 2.0).crossings
    (grows,) = (
        squeal.eigenvalues(system, 1.5).mode_of(m) for m in squeal.eigenvalues(system, 1.5).unstable
    )
    assert crossing.mu == pytest.approx(1.0)
    assert crossing.mode == grows == 3
