"""Thresholds of random damped systems: intervals hold the place that 40 digits give."""

import mpmath as mp
import numpy as np
import pytest

from squeal.linear import Crossing, thresholds
from squeal.linear.system import Term, TermSystem
from squeal.numerics.formula import Formula


def random_system(seed: int, n: int) -> TermSystem:
    """Dense positive definite M, C, K and a K1 without symmetry: close roots by the way."""
    rng = np.random.default_rng(seed)
    M, K0 = (X @ X.T / n for X in rng.standard_normal((2, n, n)))
    M, K0 = M + 0.3 * np.eye(n), 4 * K0 + rng.uniform(0.5, 3) * np.eye(n)
    K1, C = rng.standard_normal((2, n, n))
    K1, C = 0.8 * K1, 0.04 * C @ C.T / n + 0.002 * np.eye(n)
    return TermSystem((Term(M),), (Term(C),), (Term(K0), Term(K1, Formula("mu"))))


def exact(system: TermSystem, crossing: Crossing) -> mp.mpf:
    """mu of det(-w^2 M + i w C + K(mu)) = 0 next to a crossing, by Newton's method."""
    M, C, K0, K1 = (mp.matrix(t.matrix.tolist()) for t in (*system.M, *system.C, *system.K))
    with mp.workdps(40):
        w = mp.mpf(2 * np.pi * crossing.frequency_hz)
        unit = abs(mp.det(-((w + 1) ** 2) * M + 1j * w * C + K0))

        def both(w: mp.mpf, mu: mp.mpf) -> tuple[mp.mpf, mp.mpf]:
            value = mp.det(-w * w * M + 1j * w * C + K0 + mu * K1) / unit
            return (value.real, value.imag) if w else (value.real, w)

        return mp.findroot(both, (w, mp.mpf(crossing.mu)), tol=1e-60, verify=False)[1]


@pytest.mark.parametrize("seed", [100, 103])
def test_intervals_hold_the_threshold(seed):
    system = random_system(seed, 12)
    found = thresholds(system, 1.0)
    assert found.certified
    assert len(found.crossings) > 1
    for c in found.crossings:
        at = exact(system, c)
        assert c.interval[0] <= at <= c.interval[1]
        assert c.mu == pytest.approx(float(at), abs=1e-13)


def flat_system(kind: str, n: int, power: int, mixed: bool):
    """n degrees of freedom, one of which passes the axis at 0.45 as that power of mu - 0.45."""
    X = np.eye(n) + mixed * np.eye(n, k=1)
    C, K = np.diag([0.0] + [0.1] * (n - 1)), np.diag([4.0, 9.0, 16.0, 25.0][:n])

    def system(mu):
        damping, stiffness, f = C.copy(), K.copy(), -((mu - 0.45) ** power)
        if kind == "damping":
            damping[0, 0] = f
        elif kind == "stiffness":
            stiffness[0, 0] = f
        else:
            stiffness[:2, :2] = [[4.0, f], [1.0, 4.0]]
        C_mixed = X.T @ damping @ X if kind == "damping" else None
        return X.T @ X, C_mixed, X.T @ stiffness @ X

    return system


@pytest.mark.parametrize(("power", "mixed"), [(3, False), (3, True), (5, True)])
@pytest.mark.parametrize("n", [2, 3, 4])
@pytest.mark.parametrize("kind", ["damping", "stiffness", "coalescence"])
def test_intervals_hold_a_threshold_of_no_slope(kind, n, power, mixed):
    found = thresholds(flat_system(kind, n, power, mixed), 1.0)
    (one,) = found.crossings
    assert (one.direction, one.kind) == ("up", "divergence" if kind == "stiffness" else "flutter")
    low, high = one.interval
    assert low <= 0.45 <= high
    assert low <= one.mu <= high
    assert high - low < 0.02 or power == 5
