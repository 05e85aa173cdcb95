"""Rows and columns in units decades apart: D1 P D2 has the roots and the thresholds of P."""

import numpy as np
import pytest

import squeal
from squeal.linear.system import System
from squeal.linear.terms import Term
from squeal.numerics.differentiation import Formula

ROWS = 6
DECADES = 12.0


def matrices(kind, seed):
    """M, C, K without friction and its slope by friction, entries about 1."""
    rng = np.random.default_rng([seed, 77])

    def definite(low, high):
        Q, _ = np.linalg.qr(rng.standard_normal((ROWS, ROWS)))
        X = (Q * rng.uniform(low, high, ROWS)) @ Q.T
        return (X + X.T) / 2

    M = np.diag(rng.uniform(0.7, 1.5, ROWS)) if kind == "lumped" else definite(0.7, 1.5)
    C = definite(0.01, 0.1)
    if kind == "gyroscopic":
        C = np.triu(rng.standard_normal((ROWS, ROWS)), 1) / 4
        C = C - C.T
    return M, C, definite(1.0, 9.0), rng.standard_normal((ROWS, ROWS))


def factors(units, seed):
    """D1 and D2, diagonals of powers of two up to 10^12 and down to 10^-12."""
    rng = np.random.default_rng([seed, 78])
    rows, columns = np.exp2(np.rint(rng.uniform(-DECADES, DECADES, (2, ROWS)) * np.log2(10.0)))
    if units == "opposite":
        columns = 1.0 / rows
    if units == "alike":
        columns = rows
    return rows, columns


def scaled(units, kind, seed, digits=None):
    M, C, K, slope = matrices(kind, seed)
    rows, columns = factors(units, seed)

    def term(X, factor="1"):
        X = rows[:, None] * X * columns
        if digits:
            X = np.vectorize(lambda x: float(f"{x:.{digits - 1}e}"))(X)
        return Term(X, Formula(factor), digits)

    return System((term(M),), (term(C),), (term(K), term(slope, "mu")))


def roots_of_plain(kind, seed, mu):
    M, C, K, slope = matrices(kind, seed)
    inverse = np.linalg.inv(M)
    A = np.block(
        [[np.zeros((ROWS, ROWS)), np.eye(ROWS)], [-inverse @ (K + mu * slope), -inverse @ C]]
    )
    return np.linalg.eigvals(A)


KINDS = pytest.mark.parametrize("kind", ["damped", "lumped", "gyroscopic"])
UNITS = pytest.mark.parametrize("units", ["opposite", "independent", "alike"])


@KINDS
@UNITS
@pytest.mark.parametrize("seed", range(3))
def test_units_of_rows_and_columns_change_no_root(units, kind, seed):
    """No referee has to refute the roots, which would warn."""
    mu = 0.3
    system = scaled(units, kind, seed)
    found = squeal.eigenvalues(system, at=mu)
    expected = roots_of_plain(kind, seed, mu)
    assert found.certified
    values = np.array([root.value for root in found.eigenvalues])
    assert np.abs(values[:, None] - expected).min(axis=0).max() < 1e-9
    assert found.verdict == ("flutter" if expected.real.max() > 0.0 else "stable")
    M, C, K, slope = matrices(kind, seed)
    rows, columns = factors(units, seed)
    for root in found.eigenvalues:
        P = root.value**2 * M + root.value * C + K + mu * slope
        right = columns * root.right
        left = rows * root.left
        assert np.linalg.norm(P @ right) < 1e-9 * np.linalg.norm(right)
        assert np.linalg.norm(left.conj() @ P) < 1e-9 * np.linalg.norm(left)
        mass = np.vdot(root.right, system.at()[0] @ root.right)
        assert abs(mass) == pytest.approx(1.0)


@pytest.mark.parametrize("kind", ["damped", "lumped"])
@UNITS
def test_units_of_rows_and_columns_change_no_threshold(units, kind):
    found = squeal.thresholds(scaled(units, kind, seed=1), 1.0)
    assert found.certified
    assert found.crossings
    for crossing in found.crossings:
        before, after = (
            np.sum(roots_of_plain(kind, 1, crossing.mu + step).real > 0.0) for step in (-1e-6, 1e-6)
        )
        assert after - before == (2 if crossing.direction == "up" else -2)
    at_end = np.sum(roots_of_plain(kind, 1, 1.0).real > 0.0)
    rise = sum(1 if one.direction == "up" else -1 for one in found.crossings)
    assert at_end == 2 * rise


@UNITS
def test_digits_of_scaled_entries_leave_the_same_open(units):
    """An entry of 8 digits has them in any unit."""
    found = squeal.eigenvalues(scaled(units, "damped", 0, digits=8), at=0.3)
    expected = roots_of_plain("damped", 0, 0.3)
    assert found.certified
    for root in found.eigenvalues:
        assert np.abs(expected - root.value).min() <= root.error < 1e-5


def test_a_symmetric_mass_remains_symmetric_where_blocks_have_other_units():
    """Rows of the second block in other units: both blocks of M are symmetric, K is not."""
    M, C, K, slope = matrices("damped", 2)
    rows = np.repeat([1.0, 2.0**40], ROWS // 2)
    coupled = np.kron(np.eye(2), np.ones((ROWS // 2, ROWS // 2)))
    system = System(
        rows[:, None] * (M * coupled), rows[:, None] * C, {"1": rows[:, None] * K, "mu": slope}
    )
    (balanced, *_) = system.balanced.at()
    assert np.array_equal(balanced, balanced.T)
    assert np.ptp(np.log2(system.row_units * rows)) <= 4.0
