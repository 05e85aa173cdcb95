"""What is printed of a root, its real part too, holds to the last printed digit or to the error."""

import math

import mpmath as mp
import numpy as np
import pytest

import squeal

pytest.importorskip("flint")

PRINTED = 2e-6
"""Six digits are printed."""


def digits_hold(found, exact):
    """Whether each root, of known list `exact`, is what is printed of it."""
    for root, known in zip(found.eigenvalues, exact, strict=True):
        allowed = max(PRINTED * abs(root.value.real), root.error or 0.0)
        if abs(root.value.real - known.real) > allowed:
            return False
    return True


def roots_in_digits(M, C, K):
    """The roots at 60 digits, of three rows whose determinant has the degree 4."""
    with mp.workdps(60):
        M, C, K = (mp.matrix(np.asarray(X, dtype=float).tolist()) for X in (M, C, K))
        nodes = range(-2, 3)
        values = mp.matrix([mp.det(s * s * M + s * C + K) for s in nodes])
        powers = mp.matrix([[mp.mpf(s) ** k for k in range(5)] for s in nodes])
        coefficients = mp.lu_solve(powers, values)
        companion = mp.zeros(4)
        for k in range(4):
            companion[k, 3] = -coefficients[k] / coefficients[4]
        for k in range(3):
            companion[k + 1, k] = 1
        return mp.eig(companion, left=False, right=False)


def test_each_root_has_the_real_part_and_the_imaginary_part_of_one_exact_root():
    """A mass matrix that is singular to rounding: a root of 2.6e13 1/s beside slow ones."""
    M = [[4, -2, 4], [-2, 2, 0], [4, 0, 8]]
    C = [[0, 0, 0], [0, 0, 0], [1 / 6, 1 / 6, 2 / 3]]
    K = [[13, -5, 95 / 6], [-5, 4, -13 / 6], [16, -2, 82 / 3]]
    found = squeal.eigenvalues(squeal.System(M, C, K))
    assert (found.verdict, found.certified) == ("divergence", True)
    exact = roots_in_digits(M, C, K)
    for root in found.values:
        nearest = exact[int(np.argmin([abs(known - root) for known in exact]))]
        assert abs(nearest - root) <= PRINTED * abs(root)
        assert root.real == pytest.approx(float(nearest.real), rel=PRINTED)


@pytest.mark.parametrize("decay", [2.0**-30, -(2.0**-34), 2.0**-44, -(2.0**-47)])
@pytest.mark.parametrize("n", [2, 5, 20])
def test_tiny_growth_and_decay_are_those_of_the_oscillators(n, decay):
    """Oscillators q'' + 2 d q' + k q = 0 hidden by a congruence of integers: Re lambda = -d."""
    rng = np.random.default_rng(n)
    T = np.eye(n) + np.tril(rng.integers(-1, 2, (n, n)), -1) * (np.arange(n) % 3 == 1)
    k = np.arange(1.0, n + 1.0)
    decays = decay * np.where(np.arange(n) % 2, 1.0, 2.0)
    system = squeal.System(T.T @ T, T.T @ np.diag(2.0 * decays) @ T, T.T @ np.diag(k) @ T)
    found = squeal.eigenvalues(system)
    exact = []
    for stiffness, d in zip(k, decays, strict=True):
        frequency = math.sqrt(stiffness - d * d)
        exact += [complex(-d, frequency), complex(-d, -frequency)]
    assert digits_hold(found, exact)
    assert found.certified


def test_a_mode_that_no_damper_reaches_has_no_growth_rate():
    """Of three equal rows in a chain the middle one rests in the second mode."""
    C = np.diag([0.0, 0.25, 0.0])
    K = [[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 2.0]]
    found = squeal.eigenvalues(squeal.System(np.eye(3), C, K))
    assert (found.verdict, found.certified) == ("marginal", True)
    undamped = [z for z in found.values if abs(abs(z) - math.sqrt(2.0)) < 1e-9]
    assert [z.real for z in undamped] == [0.0, 0.0]


@pytest.mark.parametrize("share", [0.0, 1e-15, -1e-15, 1e-13, -1e-13, -1e-11, -1e-9])
@pytest.mark.parametrize("rate", [1.1, 3.0, 5.0, 12345.0])
def test_frequencies_near_critical_damping_hold_to_the_error(rate, share):
    """lambda^2 + C lambda + K = 0 with C^2 nearly 4 K: lambda = -C/2 +- sqrt(C^2/4 - K)."""
    C = 2.0 * rate * (1.0 + share)
    K = rate * rate
    with mp.workdps(60):
        half_width = mp.sqrt(mp.mpf(C) ** 2 / 4 - mp.mpf(K))
        exact = [-mp.mpf(C) / 2 + half_width, -mp.mpf(C) / 2 - half_width]
    found = squeal.eigenvalues(squeal.System([[1.0]], [[C]], [[K]]))
    assert found.certified
    for root in found.eigenvalues:
        nearest = exact[int(np.argmin([abs(known - root.value) for known in exact]))]
        allowed = max(PRINTED * abs(nearest.imag), root.error or 0.0)
        assert abs(nearest.imag - root.value.imag) <= allowed


@pytest.mark.parametrize("n", [1, 2, 4])
def test_repeated_real_roots_show_that_they_may_be_real(n):
    """q'' + 2 a q' + a^2 q = 0, hidden by a congruence of integers: each root is double."""
    rng = np.random.default_rng(n)
    T = np.eye(n) + np.triu(rng.integers(-2, 3, (n, n)), 1)
    a = np.arange(2.0, n + 2.0)
    system = squeal.System(T.T @ T, T.T @ np.diag(2.0 * a) @ T, T.T @ np.diag(a * a) @ T)
    found = squeal.eigenvalues(system)
    assert found.verdict == "stable"
    for root in found.eigenvalues:
        assert abs(root.value.imag) <= (root.error or 0.0)


@pytest.mark.parametrize("damping", [1e-11, 3e-11, 1e-13, 1e-15, 1e-17, 1e-20])
@pytest.mark.parametrize("K", [[[2.0]], [[1e8]], [[2.0, -1.0], [-1.0, 2.0]]])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_proved_verdict_stands_beside_the_growth_rates_that_it_follows_from(damping, K, sign):
    """q'' + c q' + K q = 0: Re lambda = -c/2 of each root, however small beside |lambda|."""
    damping *= sign
    n = len(K)
    found = squeal.eigenvalues(squeal.System(np.eye(n), damping * np.eye(n), K))
    assert found.certified
    assert found.verdict == ("stable" if damping > 0.0 else "flutter")
    for root in found.eigenvalues:
        allowed = max(PRINTED * abs(damping), root.error or 0.0)
        assert abs(root.growth_rate + damping / 2.0) <= allowed
        assert root.growth_rate * damping < 0.0
        assert root.damping_ratio * abs(root.value) == pytest.approx(-root.growth_rate)
