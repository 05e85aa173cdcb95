"""Searches that begin or pass where roots are critically damped: defective, without slopes.

All rows have the damping c f(mu) and a stiffness k, so that each is x'' + c f x' + k x = 0: a pair
crosses the axis exactly where f changes its sign, whatever it does elsewhere.
"""

import numpy as np
import pytest

import squeal

FACTORS = {
    "(2 - mu)**2": {},
    "(1 - mu)**2": {},
    "(1 - mu)**4": {},
    "mu**2": {},
    "1/(1 + mu)": {},
    "1 - mu + mu**2": {},
    "2 - mu": {2.0: "up"},
    "1 - mu**2": {1.0: "up"},
    "(1 - mu)**3": {1.0: "up"},
    "(2 - mu)**2*(1 - mu)": {1.0: "up"},
    "(1 - mu)*(2 - mu)": {1.0: "up", 2.0: "down"},
}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(  # critical_at: where c^2 f^2 = 4 k
    ("rows", "critical_at"), [(1, 0.0), (2, 0.25), (1, 1.5)]
)
@pytest.mark.parametrize("factor", FACTORS)
def test_damping_that_touches_zero_or_begins_critical(factor, rows, critical_at):
    c = 2.0
    level = c * eval(factor, {"mu": critical_at})
    if level == 0.0:
        pytest.skip("nothing is damped there")
    turn = np.array([[0.8, 0.6], [-0.6, 0.8]])[:rows, :rows] if rows > 1 else np.eye(1)
    stiffness = level**2 / 4 * np.diag([1.0, 1.0, 3.0][3 - rows :] if rows > 1 else [1.0])
    K = turn.T @ stiffness @ turn
    system = squeal.System(np.eye(rows), {factor: c * np.eye(rows)}, (K + K.T) / 2)
    answer = squeal.thresholds(system, 3.0, low=min(critical_at, 0.25), prove=False)
    found = set()
    for crossing in answer.crossings:
        low, high = crossing.interval
        margin = 1e-9 * crossing.mu
        places = [mu for mu in FACTORS[factor] if low - margin <= mu <= high + margin]
        assert len(places) == 1, crossing
        found.add((places[0], crossing.direction))
    assert found == set(FACTORS[factor].items())


@pytest.mark.parametrize(
    ("stiffness", "factor", "directions"),
    [
        ([1.0, 1.0, 3.0], "(mu - 1)**3*(2 - mu)", {1.0: "down", 2.0: "up"}),
        ([1.0, 1.0, 1.0, 2.0], "(1 - mu)*(2 - mu)**2", {1.0: "up"}),
        ([1.0, 1.0, 1.0, 2.0], "(2 - mu)**4", {}),
    ],
)
def test_rotated_modes_cross_once_each_where_rounding_hides_what_grows(
    stiffness, factor, directions
):
    rows = len(stiffness)
    turn = np.linalg.qr(np.random.default_rng(rows).normal(size=(rows, rows)))[0]
    K = turn @ np.diag(stiffness) @ turn.T
    system = squeal.System(np.eye(rows), {factor: 2.0 * np.eye(rows)}, (K + K.T) / 2)
    answer = squeal.thresholds(system, 3.0)
    found = sorted((round(c.mu, 2), c.direction) for c in answer.crossings)
    assert found == sorted(rows * list(directions.items()))
    assert "disagrees" not in answer.proof_line
