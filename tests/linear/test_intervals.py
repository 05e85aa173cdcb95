"""Intervals hold the threshold of closed forms and 40 digits; nothing is certified away."""

import mpmath as mp
import numpy as np
import pytest

from squeal.linear import Crossing, thresholds
from squeal.linear.matrices import EPS
from squeal.linear.system import Term, TermSystem
from squeal.numerics.differentiation import Formula


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


def unimodular(n, rng):
    """An integer matrix of determinant one."""
    X = np.eye(n)
    for _ in range(3):
        for triangle in (np.tril, np.triu):
            entries = rng.integers(-1, 2, (n, n)) * (rng.random((n, n)) < 0.08)
            X = X @ (np.eye(n) + triangle(entries, -1 if triangle is np.tril else 1))
    return X


@pytest.mark.parametrize("seed", range(12))
def test_intervals_hold_the_thresholds_of_systems_mixed_by_integers(seed):
    """Oscillators that lose their damping or stiffness, of numbers with so few bits that mixing
    rounds nothing: their closed forms are exact."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(20, 26))
    L, R = unimodular(n, rng), unimodular(n, rng)
    k, c, slope = np.round(rng.uniform((16, 0.1, 4), (100, 0.4, 60), (n, 3)).T * 256) / 256
    damped = rng.random(n) < 0.5
    moved = np.where(damped, np.round(slope) / 256, slope)
    diagonals = (np.ones(n), c, -moved * damped, k, -moved * ~damped)
    M, C0, C1, K0, K1 = (L @ np.diag(d) @ R for d in diagonals)
    whole = L.astype(int).astype(object) @ np.diag((256 * k).astype(int)) @ R.astype(int)
    assert np.array_equal(256 * K0, whole.astype(float))
    mu = Formula("mu")
    C, K = (Term(C0), Term(C1, mu)), (Term(K0), Term(K1, mu))
    found = thresholds(TermSystem((Term(M),), C, K), 2.0)
    expected = np.sort(np.where(damped, c, k) / moved)
    expected = expected[expected < 2.0]
    assert len(found.crossings) == len(expected) > 0
    for one, at in zip(found.crossings, expected, strict=True):
        assert one.interval[0] <= at * (1 + EPS)
        assert at * (1 - EPS) <= one.interval[1] <= one.interval[0] + 1e-5


@pytest.mark.parametrize("tiny", [1e-8, 1e-10, 1e-12, 1e-13, 1e-14, 1e-16])
def test_growth_that_rounding_hides_is_not_certified_away(tiny):
    """Damping 2 tiny (0.7 - mu) of the first of three mixed modes."""
    T = np.eye(3) + 0.3 * np.random.default_rng(1).normal(size=(3, 3))
    diagonals = [1.0, 1, 1], [1.4 * tiny, 0.1, 0.2], [-2 * tiny, 0, 0], [1.0, 4, 9]
    M, C0, C1, K = (Term(T.T @ np.diag(d) @ T) for d in diagonals)
    found = thresholds(TermSystem((M,), (C0, Term(C1.matrix, Formula("mu"))), (K,)), 2.0)
    if found.certified or tiny > 1e-13:
        (one,) = found.crossings
        assert one.direction == "up"
        assert one.interval[0] <= 0.7 <= one.interval[1]
    assert found.certified == (tiny > 1e-11)
