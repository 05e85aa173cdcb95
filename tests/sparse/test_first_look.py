"""First looks against the full system: errors that hold, roots that are corrected, workers."""

from dataclasses import replace

import numpy as np
import pytest

import squeal
from squeal.analysis.systems.roots import Wanted, reduced_for
from squeal.errors import InputError, InputWarning
from squeal.linear import GROWING
from squeal.linear.system import Term
from squeal.numerics.differentiation import Formula
from squeal.sparse import first_look
from squeal.sparse.eigensolver import modes_in
from squeal.sparse.first_look import FirstLook
from tests import large
from tests.sparse.test_reduction import BAND as LATE_BAND
from tests.sparse.test_reduction import LATE, RANGE

BRAKE, BAND = large.disc_and_pad(3), (200.0, 2200.0)
VALUES = [{"mu": mu} for mu in (0.0, 0.35, 0.7)]


def random_brake(seed):
    """The brake with random supports, dampers and gyroscopic part, and random friction."""
    rng = np.random.default_rng(seed)
    C, K0, K1 = BRAKE.C[0].matrix, BRAKE.K[0].matrix, BRAKE.K[1].matrix
    dampers, held = rng.uniform(0.0, 5.0, BRAKE.n), rng.uniform(1.0, 1.0005, BRAKE.n)
    dampers[rng.random(BRAKE.n) > 0.03] = 0.0
    C, K0 = C * rng.uniform(0.0, 1.0), K0.copy()
    C.setdiag(C.diagonal() + dampers)
    K0.setdiag(K0.diagonal() * held)
    K1 = Term(K1 * rng.uniform(0.5, 2.0), Formula("mu"))
    return replace(BRAKE, C=(Term(C),), K=(Term(K0), K1))


def look_at(system, values=VALUES, **wanted):
    look = reduced_for(system, Wanted(**wanted or {"band": BAND}), values, "modal")
    assert isinstance(look, FirstLook)
    return look


def held_against_the_full_system(look, changes):
    """What is judged, after its errors have proved to hold."""
    full = modes_in(look.scaled.at(changes), look.region, False, exact=1e-12).values
    full, found = full[look.region.contains(full)], look.judged(changes)
    assert len(found.values) == len(full) > 3
    away = np.abs(full[:, None] - found.values).min(axis=0)
    assert np.all(away <= found.errors + 1e-10 * np.abs(found.values))
    assert np.all(found.errors <= 1e-3 * np.abs(found.values))
    return found


@pytest.mark.parametrize("content", [1e-3, 1.0], ids=["two rounds", "one"])
@pytest.mark.parametrize("seed", range(5))
def test_the_error_of_each_root_holds(monkeypatch, seed, content):
    monkeypatch.setattr(first_look, "OPTIONS", replace(first_look.OPTIONS, content=content))
    look = look_at(random_brake(seed))
    assert look.size < look.scaled.n / 6
    assert 0.0 < look.worst < 1e-2
    for changes in [*VALUES, {"mu": 0.5}]:
        found = held_against_the_full_system(look, changes)
        assert np.all((np.abs(found.values.real) > found.errors) | found.corrected)


def test_roots_that_would_be_lost_are_solved():
    """A real pair of the projected problem is another one of the full problem, in the region."""
    look = look_at(LATE, RANGE, region=LATE_BAND)
    corrected = [held_against_the_full_system(look, p).corrected.all() for p in RANGE]
    assert (corrected[0], corrected[2]) == (False, True)


@pytest.mark.parametrize("growth", [1e-4, -1e-4])
def test_the_sign_of_a_growth_near_zero_is_that_of_the_full_system(monkeypatch, growth):
    """P(lambda + s) has the roots of P moved by -s: the fastest one to a known growth."""
    monkeypatch.setattr(first_look, "OPTIONS", replace(first_look.OPTIONS, content=1.0))
    brake, mu = random_brake(3), 0.5
    look = look_at(brake)
    full = modes_in(look.scaled.at({"mu": mu}), look.region, False, exact=1e-13)
    s = full.values.real.max() - growth
    M, C, K = brake.M[0].matrix, brake.C[0].matrix, brake.K[0].matrix
    C, K = (Term(C + 2 * s * M),), (Term(K + s * C + s * s * M), brake.K[1])
    step = squeal.sweep(replace(brake, C=C, K=K), [0.0, mu, 0.7], BAND).steps[1]
    fastest = int(np.argmax(step.roots.real))
    assert step.corrected[fastest]
    assert step.roots.real[fastest] == pytest.approx(growth, abs=1e-6)
    assert step.verdict == ("flutter" if growth > 0.0 else None)


def test_friction_that_real_modes_cannot_hold_is_told_and_solved():
    with pytest.warns(InputWarning, match="real modes"):
        look = look_at(BRAKE, [{"mu": 0.0}, {"mu": 1e5}])
    assert held_against_the_full_system(look, {"mu": 1e5}).corrected.all()


def test_workers_give_the_same_bits():
    """Of sweeps and of a chart, whose verdicts are those of the full system."""
    brake = random_brake(0)
    K = (brake.K[0], Term(brake.K[1].matrix, Formula("mu * gap")))
    brake = replace(brake, K=K, parameters={"mu": 0.3, "gap": 1.0})
    axes = squeal.Axis("mu", 0.0, 0.8, 3), squeal.Axis("gap", 0.5, 1.5, 2)
    full, modal = (
        [squeal.sweep(brake, [0.1, 0.5], BAND, method=method, workers=n).to_dict() for n in (1, 2)]
        for method in ("full", "modal")
    )
    charts = [squeal.map(brake, axes, band=BAND, workers=n).to_dict() for n in (1, 2)]
    for one, two in (full, modal, charts):
        assert one == two
    for a, row in zip(axes[0].values, charts[0]["verdicts"], strict=True):
        for b, verdict in zip(axes[1].values, row, strict=True):
            step = squeal.sweep(brake, [a * b], BAND, method="full").steps[0]
            assert step.verdict == (verdict if verdict in GROWING else None)


@pytest.mark.parametrize("workers", [0, 1.5, "two"])
def test_a_wrong_number_of_workers_is_refused(workers):
    with pytest.raises(InputError, match="workers"):
        squeal.sweep(BRAKE, [0.1], BAND, workers=workers)
