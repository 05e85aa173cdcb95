"""Few modes in place of a basis, against the full system, at values between those of training."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csc_array, diags_array

import squeal
from squeal.linear.terms import Term
from squeal.numerics.differentiation import Formula
from squeal.results.sources import SystemSource
from squeal.sparse import reduced_basis
from squeal.sparse.first_look import Structure
from squeal.sparse.quadratic import scaled_problem
from squeal.sparse.region_roots import modes_in
from tests.known import known_system
from tests.sparse.test_first_look import BRAKE, look_at

VALUES = [{"mu": mu} for mu in np.linspace(0.0, 0.7, 7).tolist()]
BETWEEN = [{"mu": mu} for mu in (0.03, 0.29, 0.41, 0.66)]


def brake(kind):
    """Lightly damped, with friction that damps few rows heavily, or with a gyroscopic part."""
    rng = np.random.default_rng(7)
    C = BRAKE.C[0].matrix
    rows = BRAKE.n
    if kind == "light":
        return replace(BRAKE, C=(Term(0.2 * C),))
    if kind == "heavy":
        dampers = np.where(rng.random(rows) < 0.05, 200.0, 0.0)
        return replace(BRAKE, C=(*BRAKE.C, Term(csc_array(diags_array(dampers)), Formula("mu"))))
    upper = csc_array(diags_array(rng.uniform(0.0, 0.5, rows - 1), offsets=1))
    return replace(BRAKE, C=(Term(C), Term(csc_array(upper - upper.T))))


@pytest.mark.parametrize("kind", ["light", "heavy", "turning"])
def test_growths_lie_within_the_stated_errors(kind):
    look = look_at(brake(kind), VALUES)
    assert look.reduced_basis is not None
    assert 0 < look.reduced_basis.size < look.size
    estimates = 0
    for changes in [*BETWEEN, *VALUES]:
        full = modes_in(look.scaled.at(changes), look.region, False, exact=1e-12).values
        full = full[look.region.contains(full)]
        found = look.estimate(changes)
        assert len(found.values) == len(full) > 3
        away = np.abs(full[:, None] - found.values)
        partner = np.argmin(away, axis=0)
        assert len(set(partner)) == len(full)
        assert np.all(away.min(axis=0) <= found.errors + 1e-10 * np.abs(found.values))
        assert np.all(np.sign(found.values.real) == np.sign(full[partner].real))
        estimates += not found.corrected.any() and look.estimate_by_few_modes(changes) is not None
    assert estimates > len(VALUES) / 2  # else few modes are of no use


def test_a_mode_that_the_few_lack_leaves_the_answer_to_the_basis():
    """Friction far beyond that of training: what is estimated then says nothing."""
    look = look_at(brake("heavy"), VALUES)
    changes = {"mu": 20.0}
    full = modes_in(look.scaled.at(changes), look.region, False, exact=1e-12).values
    estimate = look.estimate_by_few_modes(changes)
    if estimate is not None:
        away = np.abs(full[:, None] - estimate.values).min(axis=0)
        assert np.all(away <= estimate.errors)


@pytest.mark.parametrize("reached", [0, 5, 12])
def test_probes_average_to_the_inverse_of_an_indefinite_structure(monkeypatch, reached):
    """Of 12 rows, of whose directions a basis reaches none, some or all, against the inverse."""
    monkeypatch.setattr(reduced_basis, "SKETCH", 40_000)
    rng = np.random.default_rng(3)
    Q = np.linalg.qr(rng.standard_normal((12, 12)))[0]
    K = (Q * rng.uniform(1.0, 9.0, 12)) @ Q.T
    structure = Structure(scaled_problem(np.eye(12), None, K), highest=2.2)
    V = np.linalg.qr(rng.standard_normal((12, reached)))[0]
    left, right = structure.probes(V, V.T @ (structure.F @ V))
    inverse = np.linalg.inv(structure.F.toarray())
    assert np.linalg.eigvalsh(inverse).min() < 0.0
    lengths = np.linalg.norm(left, axis=1)[:, None] * np.linalg.norm(right, axis=1)
    assert np.all(np.abs(left @ right.T - inverse) <= 5 / 200 * lengths)


@pytest.mark.parametrize(("seed", "method"), [(25, "reduced"), (27, "modal")])
def test_thresholds_and_their_modes_are_those_of_all_roots(seed, method):
    """Few modes lack a root of the second system; the basis of a first look one of the first, as
    its count shows."""
    rng = np.random.default_rng([seed, 5])
    system, known = known_system(int(rng.integers(41, 71)), rng, True)
    low, high = sorted(rng.uniform(0.05, 1.5, 2).tolist())
    found = squeal.thresholds(system, 2.0, band=(low, high))
    assert found.proof is not None
    assert found.proof["status"] == "counted"
    assert found.details["basis"]["method"] == method
    inside = [row for row in known if math.tau * low < row[3] < math.tau * high]
    assert [c.mu for c in found.crossings] == pytest.approx([row[0] for row in inside], rel=1e-8)
    assert isinstance(found.source, SystemSource)
    assert found.source.reduction is not None
    region = found.source.reduction.region
    for crossing in found.crossings:
        M, C, K = system.arrays({"mu": crossing.mu})
        states = np.linalg.solve(M, np.hstack([-K, -C]))
        every = np.linalg.eigvals(np.vstack([np.eye(2 * len(M))[len(M) :], states]))
        every = every[region.contains(every)]
        below = every.imag < math.tau * crossing.frequency_hz * (1.0 - 1e-6)
        assert crossing.mode == 1 + np.sum(below)


@pytest.mark.parametrize("angle", [0.0, 0.3, 1.2, np.pi / 2])
def test_an_estimated_product_is_no_smaller_than_the_true_one(angle):
    """Of parallel vectors the estimate and both norms are too small by the same share."""
    rows = 60
    left = np.zeros(rows)
    left[0] = 1.0
    right = np.zeros(rows)
    right[0] = np.cos(angle)
    right[1] = np.sin(angle)
    bounds = []
    for seed in range(3000):
        vectors = reduced_basis.random_vectors(rows, seed)
        S = left @ vectors
        R = right @ vectors
        product = float(np.linalg.norm(S) * np.linalg.norm(R))
        bounds.append(abs(float(S @ R)) + reduced_basis.UNCERTAINTY * product)
    assert min(bounds) >= abs(left @ right)
