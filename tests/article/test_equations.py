"""Eqs. (21) to (23) and Table 1 of the article against the model and by hand."""

import numpy as np
import pytest

from squeal.article.equations import bounds, rank, stiffness
from squeal.article.transitions import conditions
from squeal.model.contact import LEADING, NONE, TRAILING, contact_law
from squeal.model.equations import PadModel, about_origin, linearise
from tests.conftest import random_pad


def eq_22(p, printed):
    """The nine entries of Eq. (22), copied from the article entry by entry."""
    k1, k2, a1, a2, t0 = p.k1, p.k2, p.alpha1, p.alpha2, p.theta0
    d, b = np.hypot(p.w, p.h), np.arcsin(p.h / np.hypot(p.w, p.h))
    s, c = np.sin, np.cos
    K12 = k1 * s(a1) * c(a1) - k2 * s(a2) * c(a2)
    K13 = -d * k1 * c(a1) * s(a1 + b - t0) - d * k2 * c(a2) * s(a2 + b + t0)
    K23 = -d * k1 * s(a1) * s(a1 + b - t0) + d * k2 * s(a2) * s(a2 + b + t0)
    K33 = d**2 * k1 * s(a1 + b - t0) * (s(b - t0) * c(a1) + c(b - t0) * s(a1))
    if not printed:
        K33 += d**2 * k2 * s(a2 + b + t0) ** 2
    K11, K22 = k1 * c(a1) ** 2 + k2 * c(a2) ** 2, k1 * s(a1) ** 2 + k2 * s(a2) ** 2
    return np.array([[K11, K12, K13], [K12, K22, K23], [K13, K23, K33]])


def test_stiffness_is_eq_22_and_the_derivative_of_the_forces():
    for seed in range(50):
        p = random_pad(seed)
        K = stiffness(p)
        scale = np.abs(K).max()
        assert np.abs(K - eq_22(p, printed=False)).max() < 1e-14 * scale
        assert np.abs(stiffness(p, printed=True) - eq_22(p, printed=True)).max() < 1e-14 * scale
        springs_only = -linearise(PadModel("B1", p), np.zeros(3), NONE).K
        assert np.abs(K + springs_only).max() < 1e-13 * scale


def test_exact_stiffness_is_singular_and_the_printed_one_is_not():
    for seed in range(200):
        p = random_pad(seed)
        assert rank(p, stiffness(p)) <= 2
        # printed determinant: -d^2 k1 k2^2 sin^2(alpha1 + alpha2) sin^2(alpha2 + beta + theta0)
        d2, beta = p.w**2 + p.h**2, np.arctan2(p.h, p.w)
        sines = np.sin(p.alpha1 + p.alpha2) * np.sin(p.alpha2 + beta + p.theta0)
        expected = -d2 * p.k1 * p.k2**2 * sines**2
        printed = stiffness(p, printed=True)
        assert abs(np.linalg.det(printed) - expected) < 1e-12 * np.abs(printed).max() ** 3
        assert rank(p, printed) == 3 or abs(sines) < 1e-6


def test_bounds_follow_from_the_rows_of_eq_21():
    for seed in range(100):
        p = random_pad(seed)
        K, found = stiffness(p), bounds(p)
        # rows 1 and 2, then 3 and 2, for (x, Rn) with y = theta = delta = 0
        reactions = [
            np.linalg.solve([[K[i, 0], -f * p.mu], [K[1, 0], -1.0]], [0.0, -p.F_n])[1]
            for i, f in ((0, 1.0), (2, p.h))
        ]
        assert bool(found.sign_aware) == all(R > 0 for R in reactions)
        assert found.bound_23a == pytest.approx(K[0, 0] / K[1, 0], rel=1e-12)
        assert found.bound_23b == pytest.approx(K[2, 0] / (p.h * K[1, 0]), rel=1e-12)
        assert bool(found.as_printed) == (p.mu < min(found.bound_23a, found.bound_23b))


def test_origin_linearisation_adds_contact_and_friction_to_eq_22():
    p = random_pad(3, theta0=0.0, y0=0.0)
    K = about_origin(PadModel("B3", p)).K
    # by hand: Rn = -k_c y, its moment -k_c w^2 theta / 3 and friction mu Rn at height -h
    contact = p.k_c * np.array([[0, p.mu, 0], [0, 1, 0], [0, p.mu * p.h, p.w**2 / 3]])
    assert np.abs(K - stiffness(p) - contact).max() < 1e-13


# Table 1: condition, edges that reach zero elongation (3 leads, 4 trails), positive slope
TABLE_1 = {
    ("1", "2"): ((3, True), (4, True)),
    ("2", "1"): ((3, False), (4, False)),
    ("1", "3"): ((4, True),),
    ("3", "1"): ((4, False),),
    ("1", "4"): ((3, True),),
    ("4", "1"): ((3, False),),
    ("2", "3"): ((3, False),),
    ("3", "2"): ((3, True),),
    ("2", "4"): ((4, False),),
    ("4", "2"): ((4, True),),
}


def test_conditions_are_table_1():
    spring = {LEADING: 3, TRAILING: 4}
    name = contact_law("B1").state_name
    found = {
        (name(c.source), name(c.target)): tuple((spring[edge], rising) for edge, rising in c.edges)
        for c in conditions()
    }
    assert found == TABLE_1
    assert sorted(c.codimension for c in conditions()) == [1] * 8 + [2] * 2
