"""Free bodies: zero roots, twice each, are neither growth nor decay; chains have closed forms."""

import math

import numpy as np
import pytest
from scipy.sparse import block_diag, csc_array, diags_array, eye_array

import squeal
from squeal.queries.systems.roots import system_roots
from squeal.queries.systems.thresholds import system_thresholds
from squeal.results.map import Axis
from squeal.results.sources import EigenvalueSelection
from squeal.sparse.argument_principle import Rectangle
from tests.known import affine, system_of

N = 90
SPRING = 1e6
SLOW = EigenvalueSelection(band=(0.0, 60.0))


@pytest.fixture(autouse=True)
def _few_rows_are_many(monkeypatch):
    """Systems of N rows are treated as large ones."""
    monkeypatch.setattr("squeal.queries.systems.all_roots.ALL_ROWS", 60)


def chain(rows):
    """Equal springs between equal masses, free at both ends."""
    diagonal = np.r_[1.0, np.full(rows - 2, 2.0), 1.0]
    side = np.full(rows - 1, -1.0)
    return SPRING * diags_array([side, diagonal, side], offsets=(-1, 0, 1), format="csc")


def entries(values, rows, columns, factor="1"):
    return csc_array((values, (rows, columns)), shape=(N, N)), factor


def chains(lengths=(N,), mass=1.0, damping=(), more=()):
    K = block_diag([chain(rows) for rows in lengths], format="csc")
    return system_of(mass * eye_array(N, format="csc"), damping, (K, *more))


def diagonal(decay, stiffness):
    rows = np.ones(len(decay)), decay, stiffness
    return system_of(*(diags_array(row, format="csc") for row in rows))


@pytest.mark.parametrize(("lengths", "mass"), [((N,), 1.0), ((20, 30, 40), 0.1)])
@pytest.mark.parametrize("wanted", [SLOW, EigenvalueSelection(modes=11)])
def test_a_free_chain_is_marginal_and_its_zero_roots_are_two_each(lengths, mass, wanted):
    roots = system_roots(chains(lengths, mass), wanted)
    values = np.array([e.value for e in roots.eigenvalues])
    zeros = 2 * len(lengths)
    assert np.sum(values == 0) == min(zeros, len(values))
    assert (roots.verdict, roots.certified) == (None, True)  # of some of the roots
    ways = [np.sin(np.pi * np.arange(1, rows) / (2 * rows)) for rows in lengths]
    elastic = 2 * np.sqrt(SPRING / mass) * np.sort(np.concatenate(ways))
    assert values.imag[zeros:] == pytest.approx(elastic[: len(values) - zeros], rel=1e-9)
    assert len(values) == (wanted.modes or len(values))


def test_a_damper_against_the_ground_leaves_one_zero_root_and_one_that_decays():
    c = 0.9
    roots = system_roots(chains(damping=(entries([c], [0], [0]),)), SLOW)
    slow = sorted(e.value.real for e in roots.eigenvalues if e.value.imag == 0.0)
    # the body moves as one: lambda^2 n m + lambda c = 0, but for c^2 of the chain's compliance
    assert slow == [pytest.approx(-c / N, rel=1e-3), 0.0]
    assert (roots.verdict, roots.certified) == (None, True)  # of some of the roots
    # a force on row 0 that acts on row 4 too: the left null vector is zero at row 0
    follower = entries([SPRING, -SPRING], [4, 4], [0, 1])
    roots = system_roots(chains(damping=(entries([c], [0], [0]),), more=(follower,)), SLOW)
    assert sum(e.value == 0 for e in roots.eigenvalues) == 2
    assert roots.certified


@pytest.mark.parametrize("ground", [1e-3, -1e-3])
def test_a_soft_ground_is_no_free_body(ground):
    roots = system_roots(chains(more=(entries([ground], [0], [0]),)), SLOW)
    square = roots.eigenvalues[0].value ** 2
    assert square.real == pytest.approx(-ground / N, rel=1e-3)
    assert (roots.verdict, roots.certified) == (None if ground > 0 else "divergence", True)


def test_follower_forces_on_a_free_chain_begin_no_growth_at_zero():
    """K1 acts on stretched springs alone and gives K another left null vector than right one."""
    pull = np.r_[1e3 * np.array([1.0, -1.0, -1.0, 1.0]), 1e3, -1e3]  # rows sum to zero
    forces = entries(pull, [3, 3, 9, 9, 5, 5], [0, 1, 0, 1, 7, 8], "mu")
    system = chains(more=(forces,))
    located = system_thresholds(system, 1.0, selection=SLOW).answer
    assert (located.verdict, located.crossings) == ("marginal", ())
    assert located.details["unconfirmed"] == []
    full = system_roots(system.replace({"mu": 1.0}), SLOW)
    assert sum(e.value == 0 for e in full.eigenvalues) == 2
    assert (full.verdict, full.certified) == (None, True)


def test_conditions_of_a_band_that_holds_zero_roots_alone_have_no_modes():
    """The first elastic mode of the chain has 5.6 Hz; a first look knows no vectors of zeros."""
    forces = entries([1.0, -1.0], [3, 3], [0, 1], "mu")
    found = squeal.conditions(chains(more=(forces,)), {"mu": [0.1, 0.2]}, band=(0.0, 3.0))
    assert [(one.reason, one.rows) for one in found.conditions] == [(None, ())] * 2


@pytest.mark.parametrize(("drive", "verdict"), [(0.0, "marginal"), (20.0, "flutter")])
def test_a_chart_of_a_small_free_body_is_marginal_unless_it_is_driven(drive, verdict):
    """A negative damper between the ends drives them where the passive one does not suffice."""
    K = 1e4 * np.array([[1.1, -1.1, 0.0], [-1.1, 1.8, -0.7], [0.0, -0.7, 0.7]])
    ends = np.outer([1.0, 0.0, -1.0], [1.0, 0.0, -1.0])
    C = (1e-4 * K, "s"), -drive * ends
    system = system_of(np.diag([1.0, 2.0, 3.3]), C, ((K, "s + mu"),), {"s": 1.0})
    sides = (Axis("mu", 0.0, 1.0, 5), Axis("s", 0.5, 2.0, 5))
    assert squeal.map(system, sides).share[verdict] == 1.0


@pytest.mark.parametrize("modes", [1, 7, 8, 20])
def test_so_many_lowest_modes_are_listed_as_are_requested(modes):
    """Frequencies of 7, 8 and 9 are equal, real roots are single."""
    omega = np.linspace(10.0, 5000.0, N)
    omega[6:9] = omega[7]
    decay = np.where(np.arange(N) < 3, 4.0, 0.02)
    lowest = system_roots(diagonal(decay * omega, omega**2), EigenvalueSelection(modes=modes))
    turn = np.sqrt(decay**2 / 4 - 1 + 0j)
    upper = np.sort(np.abs(np.r_[omega * (turn - decay / 2), (-omega * (turn + decay / 2))[:3]]))
    assert (len(lowest.eigenvalues), lowest.certified) == (modes, True)
    listed = np.sort([abs(e.value) for e in lowest.computed])
    assert listed == pytest.approx(upper[: len(listed)], rel=1e-9)


@pytest.mark.parametrize(("rows", "low"), [(40, 0.0), (40, -1.0), (N, 0.0), (N, -1.0)])
def test_a_region_that_begins_on_the_real_axis_holds_it(rows, low):
    omega = np.linspace(10.0, 500.0, rows)
    decay = omega * np.where(np.arange(rows) % 3 == 0, 3.0, 0.1)
    region = EigenvalueSelection(region=Rectangle(-150.0, 10.0, low, 60.0))
    inside = system_roots(diagonal(decay, omega**2), region)
    real = np.outer([-1.5 + math.sqrt(1.25), -1.5 - math.sqrt(1.25)], omega[::3])
    upper = np.sum(omega[np.arange(rows) % 3 != 0] * math.sqrt(1 - 0.0025) < 60.0)
    assert inside.count == np.sum(real > -150.0) + upper
    assert inside.certified


def two_pairs(rows, c):
    """A pair near 1.6 Hz that flutters from mu = 0.25 on, one near 163 Hz from 0.5 on."""
    K0 = np.r_[100.0, 110.0, 1e6, 1.1e6, np.linspace(1e4, 2e4, rows - 4) ** 2]
    places = [0, 1, 2, 3], [1, 0, 3, 2]
    K1 = csc_array(([20.0, -20.0, 1e5, -1e5], places), shape=(rows, rows))
    M = eye_array(rows, format="csc")
    return affine(M, diags_array(K0, format="csc"), K1, c * M if c else None)


@pytest.mark.parametrize("c", [0.0, 0.1])
def test_a_band_of_a_small_system_is_judged_as_that_of_its_large_twin(c):
    wanted = EigenvalueSelection(band=(100.0, 200.0))
    exact = math.sqrt(5e4**2 + c**2 * 1.05e6) / 1e5
    for rows, outside in ((10, 1), (N, None)):
        located = system_thresholds(two_pairs(rows, c), 1.0, selection=wanted).answer
        assert located.verdict == ("stable" if c else "marginal")
        assert [p.kind for p in located.points] == ["flutter"]
        assert located.points[0].mu == pytest.approx(exact, rel=1e-9)
        assert [c.changes_verdict for c in located.crossings] == [True]
        assert located.certified
        assert located.details["crossings_outside"] == outside
        roots = system_roots(two_pairs(rows, c).replace({"mu": 0.4}), wanted)
        assert roots.verdict is None  # the other pair grows, or is not known
        assert len(roots.outside or ()) in {1, outside or 0}


@pytest.mark.parametrize(("stiff", "seed"), [(1e6, 0), (1e12, 1), (1e12, 2)])
def test_the_zero_roots_of_a_small_body_are_counted_beside_stiff_motions(stiff, seed):
    rng = np.random.default_rng(seed)
    turn = np.linalg.qr(rng.standard_normal((6, 6)))[0]
    K = turn @ np.diag([0.0, 1e4, stiff, 2 * stiff, 3 * stiff, 4 * stiff]) @ turn.T
    roots = system_roots(
        system_of(np.eye(6), None, (K + K.T) / 2), EigenvalueSelection(band=(0.0, 40.0))
    )
    assert [e.value.imag for e in roots.eigenvalues] == pytest.approx([0.0, 0.0, 100.0], rel=1e-6)
    assert roots.certified


@pytest.mark.parametrize("rows", [8, 400])
@pytest.mark.parametrize("seed", range(6))
def test_damped_free_bodies_stay_real_beside_a_structural_loss_factor(rows, seed, monkeypatch):
    """Rounding puts a real root of complex matrices on either side of the real axis."""
    monkeypatch.setattr("squeal.queries.systems.all_roots.ALL_ROWS", rows)
    rng = np.random.default_rng(seed)
    Q = np.eye(20) + 0.1 * rng.standard_normal((20, 20))
    damping = np.full(20, 0.2)
    squares = np.r_[0.0, 0.0, np.linspace(5.0, 50.0, 18) ** 2]
    damping[:2] = 0.1, 0.4
    M = Q.T @ np.eye(20) @ Q
    C = Q.T @ np.diag(damping) @ Q
    K = Q.T @ np.diag(squares * (1 + 0.01j)) @ Q
    found = system_roots(system_of(M, C, K), EigenvalueSelection(modes=6))
    values = np.sort([e.value.real for e in found.eigenvalues if abs(e.value.imag) < 1e-6])
    assert np.allclose(values, [-0.4, -0.1, 0.0, 0.0], atol=1e-9)
    assert len(found.eigenvalues) == 6
    assert found.certified
