"""Eqs. (21) to (23) and Table 1 of the article against the model and by hand."""

import numpy as np
import pytest
import yaml
from scipy.optimize import brentq

from squeal.article.equations import (
    bounds,
    first_column,
    mismatch,
    quasi_static_map,
    rank,
    row_pairs,
    stiffness,
)
from squeal.article.studies.quasi_static import state_curves
from squeal.article.transitions import conditions
from squeal.io.scene import read_scene
from squeal.model.contact import LEADING, NONE, TRAILING, contact_law
from squeal.model.equations import PadModel, about_origin, linearise
from squeal.model.pad import Pad
from tests.conftest import ROOT, random_pad

ARTICLE = ROOT / "workflow" / "scenes"


def eq_22(p, printed):
    """The nine entries of Eq. (22), copied from the article entry by entry."""
    k1, k2, a1, a2, t0 = p.k1, p.k2, p.alpha1, p.alpha2, p.theta0
    d = np.hypot(p.w, p.h)
    b = np.arcsin(p.h / np.hypot(p.w, p.h))
    s, c = np.sin, np.cos
    K12 = k1 * s(a1) * c(a1) - k2 * s(a2) * c(a2)
    K13 = -d * k1 * c(a1) * s(a1 + b - t0) - d * k2 * c(a2) * s(a2 + b + t0)
    K23 = -d * k1 * s(a1) * s(a1 + b - t0) + d * k2 * s(a2) * s(a2 + b + t0)
    K33 = d**2 * k1 * s(a1 + b - t0) * (s(b - t0) * c(a1) + c(b - t0) * s(a1))
    if not printed:
        K33 += d**2 * k2 * s(a2 + b + t0) ** 2
    K11 = k1 * c(a1) ** 2 + k2 * c(a2) ** 2
    K22 = k1 * s(a1) ** 2 + k2 * s(a2) ** 2
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
        d2 = p.w**2 + p.h**2
        beta = np.arctan2(p.h, p.w)
        sines = np.sin(p.alpha1 + p.alpha2) * np.sin(p.alpha2 + beta + p.theta0)
        expected = -d2 * p.k1 * p.k2**2 * sines**2
        printed = stiffness(p, printed=True)
        assert abs(np.linalg.det(printed) - expected) < 1e-12 * np.abs(printed).max() ** 3
        assert rank(p, printed) == 3 or abs(sines) < 1e-6


def rows_solved(K, p):
    """(x, Rn) by rows 1 and 2, and by rows 3 and 2, of Eq. (21) with y = theta = delta = 0."""
    by_2 = [K[1, 0], -1.0]
    load = [0.0, -p.F_n]
    return [
        np.linalg.solve([[K[0, 0], -p.mu], by_2], load),
        np.linalg.solve([[K[2, 0], -p.h * p.mu], by_2], load),
    ]


def test_conditions_follow_from_the_rows_of_eq_21():
    outcomes = set()
    for seed in range(300):
        p = random_pad(seed)
        K = stiffness(p)
        found = bounds(p)
        pairs = row_pairs(p)
        (x_12, R_12), (x_23, R_23) = rows_solved(K, p)
        assert bool(found.complete) == (R_12 > 0 and R_23 > 0 and x_12 * x_23 > 0)
        assert (pairs.x_12, pairs.R_12) == pytest.approx((x_12, R_12), rel=1e-9)
        assert (pairs.x_23, pairs.R_23) == pytest.approx((x_23, R_23), rel=1e-9)
        assert found.bound_23a == pytest.approx(K[0, 0] / K[1, 0], rel=1e-12)
        assert found.bound_23b == pytest.approx(K[2, 0] / (p.h * K[1, 0]), rel=1e-12)
        assert bool(found.as_printed) == (p.mu < min(found.bound_23a, found.bound_23b))
        assert mismatch(p) == pytest.approx(K[2, 0] / (p.h * K[0, 0]) - 1.0, rel=1e-9)
        outcomes.add((bool(found.as_printed), bool(found.complete)))
    assert outcomes == {(False, False), (False, True), (True, True)}


def with_angles(a1, a2, mu=0.4, k2=1.3):
    """A level pad of w = 1, h = 0.5, F_n = 1 and k1 = 1."""
    return Pad(m=1.0, w=1.0, h=0.5, k1=1.0, k2=k2, k_c=1.0, alpha1=a1, alpha2=a2, mu=mu, F_n=1.0)


def test_entries_that_vanish_are_decided_by_substitution():
    """K = (K11, K21, K31) by hand; each row of Eq. (21) with y = theta = delta = 0."""
    pi = np.pi
    upright = with_angles(pi / 2, pi / 2)  # (0, 0, 0): row 1 requires mu Rn = 0
    assert not bounds(upright).complete
    assert np.isnan(mismatch(upright))
    # K31 = 0 at tan(alpha) = -h/w for equal springs: row 3 requires mu h Rn = 0
    no_moment = with_angles(pi - np.arctan(0.5), pi - np.arctan(0.5), k2=1.0)
    assert stiffness(no_moment)[2, 0] == pytest.approx(0.0, abs=1e-15)
    assert not bounds(no_moment).complete
    # K21 = 0 for equal springs and angles: Rn = F_n, and x > 0 in rows 1 and 3
    no_bound = with_angles(0.7 * pi, 0.7 * pi, k2=1.0)
    assert bounds(no_bound).complete
    assert np.isinf(bounds(no_bound).bound_23a)
    assert bounds(no_bound).as_printed
    # case (a): K21 = 0 and K31 = -h K11, so that rows 1 and 3 give x of opposite sign
    case_a = with_angles(pi / 2, pi)
    pairs = row_pairs(case_a)
    assert bounds(case_a).as_printed
    assert not bounds(case_a).complete
    assert (pairs.x_12, pairs.x_23) == pytest.approx((0.4 / 1.3, -0.4 / 1.3), rel=1e-14)
    assert pytest.approx((1.0, 1.0), rel=1e-14) == (pairs.R_12, pairs.R_23)
    # without friction x = 0 and Rn = F_n satisfy all rows for every K
    for one in (upright, no_moment, no_bound, case_a):
        assert bounds(one.replace(mu=0.0)).complete


def test_a_condition_decided_by_a_small_cosine_is_no_rounding():
    """Nearly upright springs: K11 = e^2 (k1 + k2), K21 = e (k2 - k1), both far above rounding."""
    for small in (1e-4, 1e-7):
        leaning = with_angles(np.pi / 2 + small, np.pi / 2 + small, k2=2.0)
        entries = first_column(leaning)
        assert pytest.approx(3.0 * small**2, rel=1e-6) == entries.K11
        assert pytest.approx(small, rel=1e-6) == entries.K21
        assert not bounds(leaning).complete  # mu K21 > K11


def test_restricted_state_of_cases_a_and_b_has_two_places():
    """Closed form: K11 = k2 in (a) and k1 in (b), K31 = -h K11, K21 = 0."""
    for case, name in (("a", "k2"), ("b", "k1")):
        pad = read_scene(ARTICLE / f"b2-{case}.yaml").pad
        pairs = row_pairs(pad)
        x = pad.mu * pad.F_n / getattr(pad, name)
        assert (pairs.x_12, pairs.x_23) == pytest.approx((x, -x), rel=1e-12)
        assert mismatch(pad) == pytest.approx(-2.0, rel=1e-12)


# share of the map as printed and by the complete conditions
SHARES = {
    "": (0.042, 0.172),
    "set-2": (0.234, 0.323),
    "set-3": (0.188, 0.267),
    "set-4": (0.197, 0.303),
}


@pytest.mark.parametrize("folder", SHARES)
def test_shares_of_the_map_are_those_of_all_three_rows(folder):
    """Rows of Eq. (21) solved pair by pair over a grid, from Eq. (22) and the file's numbers."""
    p = yaml.safe_load((ARTICLE / folder / "b3.yaml").read_text())["parameters"]
    k1 = p["k1"]
    k2 = p["k2"]
    w = p["w"]
    h = p["h"]
    mu = p["mu"]
    a1, a2 = np.meshgrid(*[np.pi * (np.arange(301) + 0.5) / 301] * 2, indexing="ij")
    d = np.hypot(w, h)
    beta = np.arcsin(h / np.hypot(w, h))
    K11 = k1 * np.cos(a1) ** 2 + k2 * np.cos(a2) ** 2
    K21 = k1 * np.sin(a1) * np.cos(a1) - k2 * np.sin(a2) * np.cos(a2)
    K31 = -d * k1 * np.cos(a1) * np.sin(a1 + beta) - d * k2 * np.cos(a2) * np.sin(a2 + beta)
    with np.errstate(divide="ignore", invalid="ignore"):
        printed = (mu < K11 / K21) & (mu < K31 / (h * K21))
        x_12 = mu / (K11 - mu * K21)  # over F_n
        R_12 = K11 / (K11 - mu * K21)
        x_23 = mu * h / (K31 - mu * h * K21)
        R_23 = K31 / (K31 - mu * h * K21)
    complete = (R_12 > 0) & (R_23 > 0) & (x_12 * x_23 > 0)
    expected = SHARES[folder]
    assert (printed.mean(), complete.mean()) == pytest.approx(expected, abs=1.5e-3)
    share = quasi_static_map(read_scene(ARTICLE / folder / "b3.yaml").pad, 200).share
    assert (share.as_printed, share.complete) == pytest.approx(expected, abs=1.5e-3)


def test_state_exists_on_the_traced_curve():
    """Its points against a closed form, and the rows at places that satisfy it."""
    pad = read_scene(ARTICLE / "b3.yaml").pad.replace(F_n=1.0)
    (curve,) = state_curves(pad, 80)

    def closed(a1, a2):
        """(h K11 - K31) / (w (k1 + k2)) up to a factor of two."""

        def term(k, a):
            return k * (np.sin(2 * a) + 2 * pad.h / pad.w * (1 + np.cos(2 * a)))

        return (term(pad.k1, a1) + term(pad.k2, a2)) / (pad.k1 + pad.k2)

    exact = 0
    for a1, a2 in curve[1:-1]:
        assert abs(closed(a1, a2)) < 1e-3
        assert bounds(pad.replace(alpha1=a1, alpha2=a2)).complete
        near = (a2 - 1e-3, a2 + 1e-3)
        if closed(a1, near[0]) * closed(a1, near[1]) > 0.0:  # the curve runs along alpha2
            continue
        here = pad.replace(alpha1=a1, alpha2=brentq(lambda a, a1=a1: closed(a1, a), *near))
        (x_12, R_12), (x_23, R_23) = rows_solved(stiffness(here), here)
        assert R_12 > 0.0
        assert x_23 == pytest.approx(x_12, rel=1e-7)
        assert pytest.approx(R_12, rel=1e-7) == R_23
        exact += 1
    assert exact > 100
    longest = np.linalg.norm(np.diff(np.array(curve), axis=0), axis=1).max()
    assert longest < np.pi / 80  # without gaps


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
    found = {}
    for c in conditions():
        edges = tuple((spring[edge], rising) for edge, rising in c.edges)
        found[name(c.source), name(c.target)] = edges
    assert found == TABLE_1
    assert sorted(c.codimension for c in conditions()) == [1] * 8 + [2] * 2
