"""Undamped gyroscopic systems and sharp factors, against closed forms."""

import numpy as np
import pytest

from squeal.linear import thresholds
from squeal.linear.system import Term, TermSystem
from squeal.numerics.differentiation import Formula

TURN = np.array([[0.0, -2.0], [2.0, 0.0]])


def shaft(k1, k2, mixed=None):
    """A shaft of unequal stiffness in the rotating frame: M = 1, C = 2 p J, K = diag(k) - p^2."""
    p = Formula("p")
    T = np.eye(2) if mixed is None else mixed
    M, C, K, K2 = (T.T @ X @ T for X in (np.eye(2), TURN, np.diag([k1, k2]), -np.eye(2)))
    terms = (Term(K), Term(K2, Formula("p**2")))
    return TermSystem((Term(M),), (Term(C, p),), terms, parameter="p")


@pytest.mark.parametrize("seed", range(16))
def test_a_rotating_shaft_diverges_between_its_critical_speeds(seed):
    """det K = (k1 - p^2)(k2 - p^2) is negative from sqrt(k1) to sqrt(k2), and nothing flutters."""
    rng = np.random.default_rng(seed)
    first, second = ((4.0, 4.4), (4.0, 6.0))[seed] if seed < 2 else np.sort(rng.uniform(1, 20, 2))
    mixed = None if seed % 2 else np.eye(2) + 0.3 * rng.normal(size=(2, 2))
    found = thresholds(shaft(first, second, mixed), 6.0)
    assert [(c.kind, c.direction) for c in found.crossings] == [
        ("divergence", "up"),
        ("divergence", "down"),
    ]
    for c, at in zip(found.crossings, np.sqrt([first, second]), strict=True):
        assert c.mu == pytest.approx(at, rel=1e-12)
        assert c.interval[0] - 1e-14 <= at <= c.interval[1] + 1e-14
    assert [p.kind for p in found.points] == ["divergence", "restabilised"]
    assert found.certified


@pytest.mark.parametrize("width", [1e-2, 1e-3, 1e-4, 1e-5])
@pytest.mark.parametrize("seed", range(4))
def test_a_sharp_factor_is_found_or_nothing_is_certified(width, seed):
    """Damping 0.1 - 0.2 / (1 + ((p - at) / width)^2) is negative within `width` of its centre."""
    at = float(np.random.default_rng(seed).uniform(0.1, 0.9))
    sharp = Formula(f"0.1 - 0.2/(1 + ((mu - {at!r})/{width})**2)")
    C = Term(np.diag([1.0, 0.0, 0.0])), Term(np.diag([0.0, 0.1, 0.2]))
    system = TermSystem(
        (Term(np.eye(3)),), (Term(C[0].matrix, sharp), C[1]), (Term(np.diag([4.0, 9.0, 16.0])),)
    )
    found = thresholds(system, 1.0)
    if found.certified:
        assert [c.direction for c in found.crossings] == ["up", "down"]
        assert [c.mu for c in found.crossings] == pytest.approx([at - width, at + width], rel=1e-9)
    assert width < 1e-4 or found.certified


def test_of_a_plain_function_nothing_is_certified():
    found = thresholds(lambda mu: (np.eye(1), np.eye(1), np.array([[1 - mu]])), 2.0)
    assert [c.mu for c in found.crossings] == pytest.approx([1.0])
    assert found.certified is None
