"""The friction loop in python-control against the eigenvalues and thresholds of the toolkit."""

import control
import numpy as np
import pytest

from squeal.errors import ComputationError
from squeal.linear import complex_eigenvalues, crossings, friction_loop
from tests.known import coupled


def _loop(system, reaction=None):
    answer = friction_loop(system, reaction=reaction)
    assert answer.loop is not None, answer.reason
    return answer.loop


def _random(rng, n, damping):
    """Modes at random frequencies in random coordinates, coupled by a friction term of rank one."""
    root = rng.normal(size=(n, n))
    M = np.eye(n) + 0.3 * root @ root.T / n
    L, Q = np.linalg.cholesky(M), np.linalg.qr(rng.normal(size=(n, n)))[0]
    K0 = L @ Q @ np.diag(rng.uniform(1, 10, n) ** 2) @ Q.T @ L.T
    b, c = 8 / np.sqrt(n) * L @ rng.normal(size=n), L @ rng.normal(size=n)
    C = damping * (L @ Q @ np.diag(rng.uniform(0.5, 1.5, n)) @ Q.T @ L.T + 0.05 * root @ root.T / n)
    return lambda mu: (M, C if damping else None, (K0 + K0.T) / 2 + mu * np.outer(b, c))


@pytest.mark.parametrize("damping", [0.0, 1e-3, 0.3])
def test_thresholds_are_those_of_the_system(damping):
    count = 0
    for seed in range(4):
        system = _random(np.random.default_rng(seed), 10, damping)
        found, expected = _loop(system).thresholds(1.0), crossings(system, 1.0)
        assert [(c.kind, c.direction) for c in found] == [(c.kind, c.direction) for c in expected]
        assert [c.mu for c in found] == pytest.approx([c.mu for c in expected], rel=1e-9)
        count += len(found)
    assert count


def _static(K0, b, c, C=None):
    K0, b, c = (np.array(x, dtype=float) for x in (K0, b, c))
    return lambda mu: (np.eye(len(K0)), C, K0 + mu * np.outer(b, c))


@pytest.mark.parametrize("C", [None, np.diag([0.1, 0.2])])
@pytest.mark.parametrize(("k", "way"), [(0.5, "up"), (-0.5, "down")])
def test_divergence_is_a_gain_margin_where_friction_starts_it(C, k, way):
    """s1 = 4 and s2 = k - mu or k + mu: it passes zero at one half."""
    loop = _loop(_static(np.diag([4.0, k]), [0, -1 if k > 0 else 1], [0, 1], C))
    (one,) = loop.thresholds(2.0)
    assert (one.kind, one.direction, one.frequency_hz) == ("divergence", way, 0.0)
    assert one.mu == pytest.approx(0.5, rel=1e-14)
    if way == "up":
        assert loop.critical_friction(2.0) == one
    else:
        with pytest.raises(ComputationError, match="grows from mu = 0 on"):
            loop.critical_friction(2.0)


def test_python_control_finds_the_same_margin_with_damping(mode_coupling):
    for C in (1e-3 * np.diag([1.0, 2.0]), 0.2 * np.diag([1.0, 2.0])):
        system = lambda mu, C=C: (np.eye(2), C, mode_coupling(mu)[2])  # noqa: E731
        loop = _loop(system)
        margin, *_ = control.margin(loop.plant)
        assert loop.critical_friction(2.0).mu == pytest.approx(margin, rel=1e-9)


def test_poles_of_the_closed_loop_are_the_eigenvalues(rng):
    system = _random(rng, 3, 0.3)
    for mu in (0.0, 0.3, 1.1):
        expected, poles = complex_eigenvalues(*system(mu)).values, _loop(system).closed(mu).poles()
        distance = np.abs(np.asarray(poles)[:, None] - expected)
        assert max(distance.min(axis=0).max(), distance.min(axis=1).max()) < 1e-8


def test_static_gain_of_the_plant(mode_coupling):
    # K0 = [[2, -1], [-1, 2]], force on the first mass, reaction at the second: 1/3 per unit force
    loop = _loop(mode_coupling, [0.0, 1.0])
    assert np.real(loop.plant.dcgain()).item() == pytest.approx(4 / 3 / 3, rel=1e-12)
    assert loop.b == pytest.approx([4 / 3, 0.0])


@pytest.mark.parametrize(
    ("system", "reason"),
    [
        (coupled, "reaction"),
        (lambda mu: (np.eye(2), None, 3 * np.eye(2) + mu * np.array([[0, 1], [-1, 0]])), "rank"),
        (lambda mu: (np.eye(2), None, np.array([[2, mu**2], [1, 3]])), "not linear"),
        (lambda mu: (np.eye(2), None, np.eye(2)), "does not depend"),
        (lambda mu: ((1 + mu) * np.eye(2), None, np.eye(2)), "mass"),
        (lambda mu: (np.eye(2), mu * np.eye(2), np.eye(2)), "damping"),
    ],
)
def test_reason_is_given_where_there_is_no_loop(system, reason):
    answer = friction_loop(system, reaction=[1.0, 1.0] if reason == "reaction" else None)
    assert answer.loop is None
    assert reason in answer.reason
