"""Static contact against the enumeration of all sets of closed pairs."""

from dataclasses import replace
from itertools import product
from typing import Any

import mpmath
import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.sparse import csr_array

import squeal
from squeal.errors import InputError
from squeal.sparse.contact_seat import _JoinedPairs, _PairLaws, _seat


def pairs_without_friction(normal, stiffness, gap):
    """Pairs (m,) of constant stiffness along `normal` (m, n)."""
    nothing = np.zeros(len(gap))
    laws = _PairLaws(
        area=nothing + 1.0,
        factor=nothing + 1.0,
        stiffness=stiffness,
        gap=gap,
        exponent=nothing,
        reference=nothing + 1.0,
        bonded=nothing > 0.0,
        tangential=nothing,
    )
    across = csr_array((2 * len(gap), normal.shape[1]))
    return _JoinedPairs(laws, csr_array(normal), across, csr_array(normal.T))


def seat_by_enumeration(K, load, normal, stiffness, gap):
    """The one set of closed pairs (m,) whose own approaches are positive, and displacements."""
    for closed in product([False, True], repeat=len(gap)):
        springs = closed * stiffness
        tangent = K + normal.T @ (springs[:, None] * normal)
        displacements = np.linalg.solve(tangent, load - normal.T @ (springs * gap))
        approach = -gap - normal @ displacements
        if np.array_equal(approach > 0.0, closed):
            return np.array(closed), displacements
    raise AssertionError("a positive definite K has exactly one")


def test_a_seat_whose_first_step_opens_all_pairs_is_found():
    """The pairs pull in the first step, where all are closed; in the next, some are pressed."""
    K = np.array([[14.0, 15.0], [15.0, 19.0]])
    load = np.array([3.0, 3.0])
    springs = np.array([10.0, 10.0])
    found = _seat(K, load, pairs_without_friction(np.eye(2), springs, np.zeros(2)))
    closed, displacements = seat_by_enumeration(K, load, np.eye(2), springs, np.zeros(2))
    assert found.closed.tolist() == closed.tolist()
    np.testing.assert_allclose(found.displacements, displacements, rtol=1e-12)


def test_every_seat_of_a_held_structure_is_found():
    """200 drawn: the enumeration's, or the refusal where its one set is empty."""
    rng = np.random.default_rng(20301130)
    refused = 0
    for _ in range(200):
        rows, pairs = rng.integers(2, 6, size=2)
        root = rng.standard_normal((rows, rows))
        K = root @ root.T
        normal = rng.standard_normal((pairs, rows))
        stiffness = 10.0 ** rng.uniform(-1.0, 2.0, pairs)
        gap = rng.choice([0.0, 1.0]) * rng.uniform(0.0, 0.5, pairs)
        load = 3.0 * rng.standard_normal(rows)
        closed, displacements = seat_by_enumeration(K, load, normal, stiffness, gap)
        joined = pairs_without_friction(normal, stiffness, gap)
        if not closed.any():
            refused += 1
            with pytest.raises(InputError, match="all pairs open under the load"):
                _seat(K, load, joined)
            continue
        found = _seat(K, load, joined)
        assert np.array_equal(found.closed, closed)
        np.testing.assert_allclose(found.displacements, displacements, rtol=1e-8)
    assert 20 < refused < 180


def force_of_seat(stiffness, factor):
    """The normal force (N) between two blocks on springs of 1e6 N/m, one pressed by 100 N."""
    disc = squeal.Component(squeal.System([[1.0]], K=[[1e6]], name="disc"), [1], [2])
    spring = squeal.System([[1.0]], K=[[1e6]], name="pad")
    pad = squeal.Component(spring, [1], [2], load=[-100.0])
    contact = squeal.Contact(
        ("disc", "pad"), [(1, 1)], [0, 0, 1], stiffness, area=1e-4, exponent=0.5, reference=1e6
    )
    assembly = squeal.assemble([disc, pad], [contact], {"mu": 0.0, "contact": factor})
    return assembly.seats[0].summary()["force"]


@pytest.mark.parametrize("factor", [0.2, 2.0])
def test_a_factor_multiplies_the_stiffness_whatever_the_exponent(factor):
    """By the closed form of the law, F = (k u / 2)^2 / R, 2e10 N/m^3 are pressed by 25 N."""
    of_stiffness = force_of_seat(factor * 1e10, 1.0)
    assert force_of_seat(1e10, factor) == pytest.approx(of_stiffness, rel=1e-10)
    if factor == 2.0:
        assert of_stiffness == pytest.approx(25.0, rel=1e-9)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("stiffness", "abc"),
        ("stiffness", None),
        ("stiffness", [[1.0, 2.0], [3.0]]),
        ("gap", 1j),
        ("gap", None),
        ("tangential", None),
        ("normal", "up"),
    ],
)
def test_what_is_no_number_of_a_contact_is_refused_by_its_key(key, value):
    disc = squeal.Component(squeal.System([[1.0]], K=[[1e6]], name="disc"), [1], [2])
    pad = squeal.Component(squeal.System([[1.0]], K=[[1e6]], name="pad"), [1], [2])
    bonded = squeal.Contact(("disc", "pad"), [(1, 1)], [0, 0, 1], 1e6, bonded=True)
    changes: dict[str, Any] = {key: value}
    contact = replace(bonded, **changes)
    with pytest.raises(InputError, match=f": {key}: "):
        squeal.assemble([disc, pad], [contact])


def seat_of_two_blocks(disc_spring, pad_spring, load, **law):
    """A disc and a pad on springs (N/m), and one pair; the load presses the pad on."""
    disc = squeal.Component(squeal.System([[1.0]], K=[[disc_spring]], name="disc"), [1], [2])
    spring = squeal.System([[1.0]], K=[[pad_spring]], name="pad")
    pad = squeal.Component(spring, [1], [2], load=[-load])
    contact = squeal.Contact(("disc", "pad"), [(1, 1)], [0, 0, 1], **law)
    return squeal.assemble([disc, pad], [contact])


@pytest.mark.parametrize("exponent", [0.3, 0.5, 0.7, 0.9, 0.95, 0.99])
@pytest.mark.parametrize("reference", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("stiffness", [5.0, 4e3, 1e9])
def test_a_free_pad_far_from_the_reference_carries_its_load(exponent, reference, stiffness):
    """Its force is the load, and its stiffness k (F / R)^e."""
    law = {"stiffness": stiffness, "exponent": exponent, "reference": reference}
    (seat,) = seat_of_two_blocks(7.0, 0.0, 2.0, **law).seats
    assert seat.forces[0] == pytest.approx(2.0, rel=1e-13)
    expected = stiffness * (2.0 / reference) ** exponent
    assert seat.stiffness[0] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("disc_spring", "pad_spring", "load", "stiffness", "area", "exponent", "reference"),
    [
        (2.0, 5.0, 5e6, 1e6, 0.75, 0.5, 1e5),
        (2.0, 5e-6, 5e6, 1e6, 0.75, 0.9, 1e5),
        (1e6, 1e3, 1e-3, 1e12, 1e-4, 0.8, 1e-9),
        (1e9, 1e9, 1e9, 1.0, 1.0, 0.95, 1e-6),
    ],
)
def test_the_pressure_of_one_pair_is_that_of_bisection(
    disc_spring, pad_spring, load, stiffness, area, exponent, reference
):
    """The approach by the law, h = p (p / R)^-e / ((1 - e) k), is that of the springs."""

    def excess(pressure):
        force = area * pressure
        of_springs = (load - force) / pad_spring - force / disc_spring
        of_law = pressure * (pressure / reference) ** -exponent / ((1 - exponent) * stiffness)
        return of_springs - of_law

    expected = brentq(excess, 1e-300, load / area, xtol=1e-300, rtol=1e-15)
    law = {"stiffness": stiffness, "area": area, "exponent": exponent, "reference": reference}
    (seat,) = seat_of_two_blocks(disc_spring, pad_spring, load, **law).seats
    assert seat.pressures[0] == pytest.approx(expected, rel=1e-12)


def drawn_problem(rng):
    """A held structure, a load and pairs with exponents, some of them under prestress."""
    rows, count = rng.integers(1, 8, size=2)
    root = rng.standard_normal((rows, rows))
    size = 10.0 ** rng.uniform(0.0, 9.0)
    K = size * (root @ root.T + 0.05 * np.eye(rows))
    load = 10.0 ** rng.uniform(-6.0, 9.0) * rng.standard_normal(rows)
    strength = np.abs(load).max()
    stiffness = size * 10.0 ** rng.uniform(-6.0, 6.0) * 10.0 ** rng.uniform(-1.0, 1.0, count)
    gap = rng.choice([0.0, 1.0]) * rng.uniform(-0.2, 0.3, count) * strength / size
    pairs = pairs_without_friction(rng.standard_normal((count, rows)), stiffness, gap)
    laws = pairs.laws._replace(
        exponent=rng.uniform(0.0, 0.95, count),
        reference=strength * 10.0 ** rng.uniform(-6.0, 6.0, count),
    )
    return K, load, pairs._replace(laws=laws)


def test_every_seat_with_exponents_is_found():
    """150 drawn: the energy is strictly convex, so that its one seat is where forces balance."""
    rng = np.random.default_rng(20301201)
    refused = 0
    for _ in range(150):
        K, load, pairs = drawn_problem(rng)
        laws = pairs.laws
        normal = pairs.normal.toarray()
        if np.all(-laws.gap - normal @ np.linalg.solve(K, load) <= 0.0):
            refused += 1
            with pytest.raises(InputError, match="all pairs open under the load"):
                _seat(K, load, pairs)
            continue
        found = _seat(K, load, pairs)
        balance = K @ found.displacements - load
        sizes = np.abs(K) @ np.abs(found.displacements) + np.abs(load)
        sizes += np.abs(normal.T) @ found.unit_forces
        assert np.all(np.abs(balance - normal.T @ found.unit_forces) <= 1e-12 * sizes)
        # the law by its approach: F = (1 - e) k h ((1 - e) k h / R)^(e / (1 - e))
        size = np.abs(laws.gap) + np.abs(normal) @ np.abs(found.displacements)
        share = 1.0 - laws.exponent
        bounds = []
        for rounding in (-1e-13 * size, 1e-13 * size):
            approach = np.maximum(-laws.gap - normal @ found.displacements + rounding, 0.0)
            linear = share * laws.stiffness * approach
            bounds.append(linear * (linear / laws.reference) ** (laws.exponent / share))
        tolerance = 1e-12 * found.unit_forces + 1e-15 * np.abs(load).max()
        assert np.all(bounds[0] - tolerance <= found.unit_forces)
        assert np.all(found.unit_forces <= bounds[1] + tolerance)
    assert 5 < refused < 75


def plate(load, moment):
    """A rigid plate, free to rise and to tilt, over three springs at -1, 0 and 1."""
    K = np.diag([1.0, 1.0, 1.0, 0.0, 0.0])
    normal = np.hstack([-np.eye(3), [[1.0, -1.0], [1.0, 0.0], [1.0, 1.0]]])
    pairs = pairs_without_friction(normal, np.full(3, 10.0), np.array([-0.5, 0.0, -0.5]))
    laws = pairs.laws._replace(exponent=np.full(3, 0.8), reference=np.full(3, 1e-3))
    return _seat(K, np.array([0.0, 0.0, 0.0, -load, -moment]), pairs._replace(laws=laws))


@pytest.mark.parametrize("moment", [0.0, 0.9, -0.999])
def test_a_plate_is_seated_while_its_load_lies_between_its_springs(moment):
    """Though pairs open on the way, which hold it alone."""
    found = plate(1.0, moment)
    assert found.unit_forces.sum() == pytest.approx(1.0, rel=1e-12)
    torque = found.unit_forces[2] - found.unit_forces[0]
    assert torque == pytest.approx(moment, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize(("load", "moment"), [(-1.0, 0.0), (1.0, 1.5), (0.0, 1.0)])
def test_a_load_that_lifts_or_tips_a_plate_is_refused(load, moment):
    """Beside the outer springs it tips the plate: the energy has no least value."""
    with pytest.raises(InputError, match="the load lifts or tips a component off its pairs"):
        plate(load, moment)


def test_a_body_that_nothing_holds_is_refused_though_others_are_seated():
    """It lies between gaps, without load: any place there is an equilibrium."""
    normal = np.array([[1.0, 0.0], [-1.0, 1.0]])
    pairs = pairs_without_friction(normal, np.array([3.0, 5.0]), np.array([0.1, -1.0]))
    touching = pairs_without_friction(normal, np.array([3.0, 5.0]), np.array([0.1, 0.3]))
    load = np.array([0.0, -1.0])
    assert _seat(np.diag([0.0, 1.0]), load, pairs).closed.any()
    three = np.diag([0.0, 0.0, 1.0])
    wider = pairs_without_friction(
        np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 1.0]]),
        np.full(3, 4.0),
        np.array([0.1, -0.2, 5.0]),
    )
    with pytest.raises(InputError, match="nothing holds some motion of the components"):
        _seat(three, np.array([0.0, -1.0, 0.0]), wider)
    assert touching.laws.gap.all()


def test_the_rounding_of_a_seat_stands_in_the_matrices():
    """The stiffness of a pair on soft springs, against that of bisection in 50 digits."""
    law = {"stiffness": 1e9, "exponent": 0.6, "reference": 3.0}
    assembly = seat_of_two_blocks(3.0, 0.7, 1e3, **law)
    with mpmath.workdps(50):
        exponent = mpmath.mpf(0.6)
        springs = 1 / mpmath.mpf(0.7) + mpmath.mpf(1) / 3

        def excess(force):
            of_springs = 1000 / mpmath.mpf(0.7) - force * springs
            return of_springs - force * (force / 3) ** -exponent / ((1 - exponent) * 10**9)

        force = mpmath.findroot(excess, (100, 999), solver="anderson")
        error = abs(10**9 * (force / 3) ** exponent - assembly.seats[0].stiffness[0])
    (term,) = assembly.system.K[1:]
    assert 0.0 < term.rounding < 1e-11 * term.matrix[1, 1]
    assert error <= term.rounding
