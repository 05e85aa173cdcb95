"""Bounds of growth against dense solutions: nothing lies beyond, and bad matrices have none."""

import numpy as np
import pytest
from scipy.sparse import csc_array, diags_array

from squeal.linear.matrices import state_matrices
from squeal.sparse import argument_principle
from squeal.sparse.argument_principle import Rectangle, growth_bound
from squeal.sparse.quadratic import quadratic


def chain(n=60, **changed):
    """Oscillators of 1, 2, ... rad/s, some entries of K changed."""
    K = diags_array(np.arange(1.0, n + 1) ** 2).tolil()
    for place, value in changed.items():
        i, j = map(int, place[1:].split("_"))
        K[i, j] = value
    return csc_array(np.eye(n)), None, csc_array(K)


REGION = Rectangle(-2.5, 2.5, -1e-6, 45.5)
RANDOM = np.random.default_rng(3)
SKEW = csc_array(np.triu(RANDOM.normal(size=(60, 60)), 1))
CASES = {
    "symmetric": chain(),
    "divergence": chain(k3_3=-400.0),
    "flutter": chain(k5_6=1000.0, k6_5=-1000.0),
    "friction": (chain()[0], None, chain()[2] + 30 * (SKEW - SKEW.T)),
    "gyroscopic": (chain()[0], 2 * (SKEW - SKEW.T), chain(k5_6=300.0, k6_5=-300.0)[2]),
    "negative damping": (chain()[0], csc_array(-5 * np.eye(60)), chain()[2]),
    "loss factor": (chain()[0], None, chain()[2] * (1 + 0.3j)),
    "gain factor": (chain()[0], None, chain()[2] * (1 - 0.3j)),
}


@pytest.mark.parametrize("name", CASES)
def test_nothing_lies_beyond_a_bound(name):
    bound = growth_bound(quadratic(*CASES[name]), REGION)
    assert bound is not None
    M, C, K = (None if A is None else A.toarray() for A in CASES[name])
    values = np.linalg.eigvals(state_matrices(M, np.zeros_like(M) if C is None else C, K)[0])
    inside = values[(values.imag > REGION.low_imag) & (values.imag < REGION.high_imag)]
    assert not np.any(inside.real > bound)
    assert bound > REGION.high_real
    if name not in ("symmetric", "loss factor"):  # roots that the region alone would miss
        assert np.any(inside.real > REGION.high_real)


def test_what_has_no_bound_or_none_within_reach(monkeypatch):
    M, _, K = chain(k3_3=-4e6)
    assert growth_bound(quadratic(M, None, K), REGION) is None  # a root at 2000
    negative = csc_array(diags_array(np.r_[-1.0, np.ones(59)]))
    assert growth_bound(quadratic(negative, None, chain()[2]), REGION) is None
    driven = csc_array(diags_array(np.r_[100.0, np.zeros(59)]))  # a root at 100
    assert growth_bound(quadratic(negative, driven, chain()[2]), REGION) is None
    odd = M + csc_array(([0.5], ([0], [1])), shape=M.shape)
    assert growth_bound(quadratic(odd, None, chain()[2]), REGION) is None
    assert growth_bound(quadratic(*chain()), REGION) == 4 * REGION.high_real
    rounded = M + csc_array(([1e-16], ([0], [1])), shape=M.shape)
    assert growth_bound(quadratic(rounded, None, chain()[2]), REGION) == 4 * REGION.high_real
    monkeypatch.setattr(argument_principle, "BOUND_ROWS", 59)
    assert growth_bound(quadratic(*chain()), REGION) is None
