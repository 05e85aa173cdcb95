"""Crossings of the axis on the full system: closed forms, known blocks, dense eigenvalues."""

import numpy as np
import pytest
from scipy.sparse import block_diag, csc_array

from squeal.errors import ComputationError, InputError
from squeal.linear.system import Term, TermSystem
from squeal.numerics.differentiation import Formula
from squeal.sparse.argument_principle import Rectangle
from squeal.sparse.crossings import axis_crossing, crossings_along
from squeal.sparse.quadratic import ScaledSystem
from squeal.sparse.reduction import reduce_system
from tests import large

W1, W2, E1, E2 = 2 * np.pi * 100, 2 * np.pi * 75, 0.02, 0.04


def _drum():
    """Hulten's drum brake, damped: closed-form threshold by Routh and Hurwitz."""
    K1 = np.array([[0.0, -(W2**2)], [W1**2, 0.0]])
    c1, c2 = E1 * W1, E2 * W2
    a3, a2, a1 = c1 + c2, W1**2 + W2**2 + c1 * c2, c1 * W2**2 + c2 * W1**2
    mu = np.sqrt(a1 * (a2 * a3 - a1) / (a3**2 * W1**2 * W2**2) - 1)
    return np.diag([c1, c2]), np.diag([W1**2, W2**2]), K1, mu, np.sqrt(a1 / a3)


def _among(rng, size=60):
    """The drum brake among other, stable, oscillators, mixed by sparse transformations."""
    C, K0, K1, mu, omega = _drum()
    a, w = rng.uniform(2.0, 9.0, size), rng.uniform(300.0, 900.0, size)
    mixed = large.blocks(a, w, rng)
    zero = csc_array((size, size))
    parts = [block_diag([x, y]) for x, y in zip((np.eye(2), C, K0), mixed, strict=True)]
    parts.append(block_diag([K1, zero]))
    n = size + 2
    left, right = (
        csc_array(np.eye(n) + np.where(rng.uniform(size=(n, n)) < 0.05, 0.3, 0.0).cumsum(0) * 0.1)
        for _ in range(2)
    )
    M, C, K0, K1 = (Term(csc_array(left @ x @ right)) for x in parts)
    system = TermSystem((M,), (C,), (K0, Term(K1.matrix, Formula("mu"))), {"mu": 0.1})
    return system, mu, omega


def _the_crossing(known, region, values):
    """The only crossing of a known system, held against its place, and the reduced system."""
    system, mu, omega = known
    reduction = reduce_system(ScaledSystem(system), region, [{"mu": v} for v in values])
    (crossing,), unconfirmed = crossings_along(reduction, "mu", values)
    assert not unconfirmed
    assert crossing.value == pytest.approx(mu, rel=1e-10)
    assert crossing.omega == pytest.approx(omega, rel=1e-10)
    assert crossing.interval[0] <= mu <= crossing.interval[1]
    return crossing, reduction


def test_crossings_are_found_and_located(rng):
    values = [0.0, 0.2, 0.4, 0.6]
    crossing, reduction = _the_crossing(_among(rng), Rectangle(-40.0, 60.0, 350.0, 700.0), values)
    assert crossing.interval[1] - crossing.interval[0] < 1e-8
    assert (crossing.kind, crossing.direction) == ("flutter", 1)
    assert crossing.residual < 1e-14
    reduction.region = Rectangle(-2.0, -1.0, 1.0, 2.0)
    with pytest.raises(InputError, match="must hold a part of the upper imaginary axis"):
        crossings_along(reduction, "mu", values)


def test_a_window_between_two_values():
    """Re lambda = (p - 1/2)^2 - 1/64 in a block: two crossings within one step, down then up."""
    growth = Formula("-2*((p - 0.5)**2 - 0.015625)")
    w = np.linspace(20.0, 40.0, 30)
    M, K = csc_array(np.eye(31)), csc_array(np.diag([100.0, *(w**2)]))
    first = csc_array(np.diag([1.0] + [0.0] * 30))
    rest = csc_array(np.diag([0.0] + [0.4] * 30))
    system = TermSystem((Term(M),), (Term(rest), Term(first, growth)), (Term(K),), {"p": 0.0}, "p")
    region = Rectangle(-5.0, 5.0, 5.0, 15.0)
    values = [0.0, 1.0]
    reduction = reduce_system(ScaledSystem(system), region, [{"p": v} for v in values])
    crossings, _ = crossings_along(reduction, "p", values)
    assert [c.direction for c in crossings] == [-1, 1]
    assert np.allclose([c.value for c in crossings], [0.375, 0.625], rtol=1e-10)
    assert np.allclose([c.omega for c in crossings], 10.0, rtol=1e-10)
    assert np.allclose([c.slope for c in crossings], [-0.25, 0.25], rtol=1e-8)


def test_a_real_root(rng):
    """K loses its rank at p = 0.7 in a mixed block: divergence, omega exactly zero."""
    a, w = rng.uniform(0.5, 1.5, 20), rng.uniform(3.0, 9.0, 20)
    M, C, K = large.blocks(a, w, rng)
    M, C, K = (
        block_diag([[[x]], y], format="csc") for x, y in zip((1, 3, 1.4), (M, C, K), strict=True)
    )
    K1 = csc_array(block_diag([[[-2.0]], csc_array((20, 20))]))
    system = TermSystem((Term(M),), (Term(C),), (Term(K), Term(K1, Formula("p"))), {"p": 0.5}, "p")
    scaled = ScaledSystem(system)
    guess = np.ones(21) * 0.1 + np.eye(21)[0]
    crossing = axis_crossing(scaled, "p", 0.69, 0.0, guess + 0j, guess + 0j)
    assert crossing.value == pytest.approx(0.7, rel=1e-10)
    assert (crossing.kind, crossing.direction) == ("divergence", 1)
    assert crossing.slope == pytest.approx(2.0 / 3.0, rel=1e-9)
    still = TermSystem(system.M, system.C, (system.K[0], Term(K1, Formula("0*p"))), {"p": 0.5}, "p")
    for omega in (0.0, 5.0):
        with pytest.raises(ComputationError, match="no crossing"):
            axis_crossing(ScaledSystem(still), "p", 0.3, omega, guess + 0j, guess + 0j)


def test_a_structural_loss_factor(rng):
    """Complex K: the crossing of the closed form, one root and no mirror image."""
    known = large.with_loss_factor(rng)
    for low in (350.0, -600.0):  # below the axis lie images that grow without meaning
        region = Rectangle(-60.0, 60.0, low, 600.0)
        crossing, _ = _the_crossing(known, region, [0.0, 0.7, 1.4])
        assert crossing.direction == 1
