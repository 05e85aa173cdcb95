"""Reduced systems against the full one, at values between those that made the basis."""

import numpy as np
import pytest
from scipy.sparse import csc_array

from squeal.errors import InputError
from squeal.linear.matrices import norm_of
from squeal.linear.system import TermSystem
from squeal.linear.terms import Term
from squeal.numerics.differentiation import Formula
from squeal.queries.systems.reduced import reduced_for
from squeal.results.sources import EigenvalueSelection
from squeal.sparse.argument_principle import Rectangle, band
from squeal.sparse.dense import dense_values, roots_at
from squeal.sparse.quadratic import ScaledSystem
from squeal.sparse.reduction import RESIDUAL_TOLERANCE, reduce_system
from squeal.sparse.region_roots import modes_in
from tests import large

BRAKE = large.disc_and_pad(3)
REGION = band(200.0, 2200.0)
VALUES = [{"mu": float(mu)} for mu in np.linspace(0.0, 0.8, 5)]


@pytest.fixture(scope="module")
def scaled():
    return ScaledSystem(BRAKE)


@pytest.fixture(scope="module")
def reduction(scaled):
    return reduce_system(scaled, REGION, VALUES)


@pytest.mark.parametrize("mu", [0.0, 0.13, 0.7])
def test_roots_are_those_of_the_full_system(scaled, reduction, mu):
    full = modes_in(scaled.at({"mu": mu}), REGION, certify=False)
    found = reduction.modes({"mu": mu})[0]
    assert len(found.values) == len(full.eigenvalues) > 3
    distance = np.abs(found.values[:, None] - full.values[None, :])
    assert np.all(distance.min(axis=0) < 1e-8 * np.abs(full.values))
    assert reduction.size < scaled.n / 4


def test_residuals_are_those_of_the_full_problem(scaled, reduction):
    found, residuals, _ = reduction.modes({"mu": 0.3})
    problem = scaled.at({"mu": 0.3})
    vectors = reduction.vectors @ found.right
    rest = np.linalg.norm(problem.apply(found.values, vectors), axis=0)
    K1 = scaled.terms[2][1]
    size = problem.size(found.values) + 2 * 0.3 * norm_of(K1)  # at least that of the terms
    assert np.all(residuals < 2 * rest / size)
    assert np.all(rest / size < 2 * residuals)
    values = reduction.values({"mu": 0.3})
    assert np.allclose(np.sort(values.imag), np.sort(found.values.imag), rtol=1e-12)


def test_the_tolerance_is_met(reduction):
    assert reduction.worst_residual <= RESIDUAL_TOLERANCE


def test_a_region_without_roots_has_the_basis_of_those_around(scaled):
    full = modes_in(scaled.at(VALUES[1]), REGION, certify=False)
    apart = np.diff(np.sort(full.values.imag))
    k = int(np.argmax(apart))
    low = np.sort(full.values.imag)[k] + apart[k] / 4
    empty = Rectangle(-100.0, 100.0, low, low + apart[k] / 2)
    found = reduce_system(scaled, empty, [VALUES[1]])
    assert found.converged
    assert not len(found.values(VALUES[1]))
    around = empty.widened(0.6)
    exact = full.values[around.contains(full.values)]
    assert len(exact)
    found.region = around
    near = found.values(VALUES[1])
    assert np.allclose(np.sort_complex(near), np.sort_complex(exact), rtol=1e-8)


def test_a_mass_that_a_parameter_takes_away_is_refused_where_nothing_damps():
    mass = (Term(BRAKE.M[0].matrix, Formula("share")),)
    scaled = ScaledSystem(TermSystem(mass, (), BRAKE.K, {"mu": 0.3, "share": 1.0}))
    assert scaled.at({"share": 0.5}).n == BRAKE.n
    with pytest.raises(InputError, match="M: is zero"):
        scaled.at({"share": 0.0})


def test_one_reduction_serves_two_parameters():
    system = TermSystem(
        BRAKE.M,
        (Term(BRAKE.C[0].matrix, Formula("damping")),),
        BRAKE.K,
        {"mu": 0.3, "damping": 1.0},
    )
    scaled = ScaledSystem(system)
    values = [{"mu": mu, "damping": d} for mu in (0.1, 0.5) for d in (0.5, 1.5)]
    reduction = reduce_system(scaled, REGION, values)
    for changes in ({"mu": 0.5, "damping": 0.5}, {"mu": 0.25, "damping": 1.2}):
        full = modes_in(scaled.at(changes), REGION, certify=False).values
        found = reduction.modes(changes)[0].values
        distance = np.abs(found[:, None] - full[None, :])
        assert distance.min(axis=0).max() < 1e-6 * np.abs(full).max()


def test_dense_roots_are_those_of_the_construction():
    rng = np.random.default_rng(4)
    a = rng.uniform(0.0, 0.1, 12)
    w = np.linspace(1.0, 4.0, 12)
    w[5] = w[4]
    a[5] = a[4]
    M, C, K = (x.toarray() for x in large.blocks(a, w, rng))
    exact = np.concatenate([-a + 1j * w, -a - 1j * w])
    values = dense_values(M, C, K)
    assert np.abs(values[:, None] - exact[None, :]).min(axis=1).max() < 1e-7
    region = Rectangle(-1.0, 1.0, 0.5, 3.5)
    roots = roots_at(M, C, K, values[region.contains(values)])
    assert len(roots.values) == np.sum((w > 0.5) & (w < 3.5))
    for j, value in enumerate(roots.values):
        P = value**2 * M + value * C + K
        assert np.linalg.norm(P @ roots.right[:, j]) < 1e-6
        assert np.linalg.norm(roots.left[:, j].conj() @ P) < 1e-6
    pair = roots.right[:, [3, 4]] if np.isclose(*roots.values[[3, 4]]) else roots.right[:, [4, 5]]
    assert np.linalg.svd(pair, compute_uv=False)[-1] > 0.1
    singular = np.diag([1.0, 0.0, 1.0])
    found = dense_values(singular, None, np.diag([4.0, 1.0, 9.0]))
    assert np.allclose(np.sort(found.imag), [-3, -2, 2, 3], atol=1e-10)


def coupled(n):
    """Random coupling that sets in late: the basis of mu = 0.5 says little of mu = 1."""
    rng = np.random.default_rng(3)
    w = np.sort(rng.uniform(50.0, 3000.0, n))
    G = 4e6 / 15 * rng.normal(size=(n, n)) * (rng.random((n, n)) < 0.2)
    K = (Term(csc_array(np.diag(w**2))), Term(csc_array(G), Formula("mu**8")))
    return TermSystem((Term(csc_array(np.eye(n))),), (), K, {"mu": 0.0})


LATE = coupled(150)
BAND = Rectangle(-700.0, 700.0, 300.0, 500.0)
RANGE = [{"mu": mu} for mu in (0.0, 0.5, 1.0)]


def dense(system, mu):
    K = system.at({"mu": mu})[2].toarray()
    roots = np.sqrt(np.linalg.eigvals(-K).astype(complex))
    roots = np.concatenate([roots, -roots])
    return roots[BAND.contains(roots)]


def test_values_whose_roots_are_off_are_sampled_and_other_roots_left_out():
    """Roots that the reduced system alone has hide no value that was not solved."""
    late = ScaledSystem(coupled(250))
    reduction = reduce_system(late, BAND, RANGE)
    assert reduction.converged
    assert {"mu": 1.0} in reduction.samples
    assert reduction.size < late.n
    assert reduction.spurious > 0
    for changes in RANGE:
        found = reduction.modes(changes).roots
        expected = dense(late.system, changes["mu"])
        assert len(found.values) == len(expected) == len(reduction.values(changes))
        distance = np.abs(found.values[:, None] - expected[None, :]).min(axis=0)
        assert distance.max() < 1e-6 * np.abs(expected).max()


def test_a_root_exactly_in_the_middle_of_a_band_hides_no_other():
    """Springs of 1, 2 ... 60 Hz without coupling, 2 Hz in the middle of the band."""
    K = np.diag((2 * np.pi * np.arange(1, 61)) ** 2)
    system = TermSystem((Term(np.eye(60)),), (), (Term(K),))
    wanted = EigenvalueSelection(band=(0.5, 3.5))
    found = reduced_for(system, wanted, [{"mu": 0.0}]).values({"mu": 0.0})
    assert np.sort(found.imag) == pytest.approx(2 * np.pi * np.array([1.0, 2.0, 3.0]), rel=1e-9)
