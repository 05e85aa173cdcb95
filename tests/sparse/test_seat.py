"""Static contact against the enumeration of all sets of closed pairs."""

from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest
from scipy.sparse import csr_array

import squeal
from squeal.errors import ComputationError, InputError
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


def test_a_pair_that_stays_closed_while_it_pulls_keeps_its_line():
    """One pair changes at a time once a set occurs again; the others pull along the same line."""
    laws = pairs_without_friction(np.eye(2), np.array([10.0, 20.0]), np.zeros(2)).laws
    forces, slopes = laws.unit_forces(np.array([0.5, -0.25]))
    assert forces.tolist() == [5.0, -5.0]
    assert slopes.tolist() == [10.0, 20.0]


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


@pytest.mark.parametrize(("load", "stiffness", "exponent"), [(1.0, 5.0, 0.99), (2.0, 4000.0, 0.7)])
def test_a_search_that_goes_astray_blames_neither_supports_nor_numpy(load, stiffness, exponent):
    """The pad is held by its contact, far from the reference: Newton's method goes astray."""
    disc = squeal.Component(squeal.System([[4.0]], K=[[7.0]], name="disc"), [1], [2])
    free = squeal.System([[1.0]], K=[[0.0]], name="pad")
    pad = squeal.Component(free, [1], [2], load=[-load])
    law = squeal.Contact(
        ("disc", "pad"), [(1, 1)], [0, 0, 1], stiffness, exponent=exponent, reference=1e5
    )
    with pytest.raises(ComputationError, match="the contact is not settled"):
        squeal.assemble([disc, pad], [law])
