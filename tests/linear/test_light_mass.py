"""Systems of which some motion has no mass, or hardly any, in closed form and mixed.

Two modes s = 2 -+ sqrt(1 - 4 mu / 3) that flutter from mu = 3/4 on, beside a third coordinate of
mass m and stiffness k; q = T z with a T that is neither orthogonal nor sparse.
"""

from dataclasses import replace

import numpy as np
import pytest

import squeal
from squeal.errors import InputError
from squeal.linear import thresholds
from squeal.linear.terms import Term
from squeal.numerics.differentiation import Formula
from squeal.queries.systems.roots import system_roots
from squeal.queries.systems.thresholds import system_thresholds
from squeal.results.sources import EigenvalueSelection
from squeal.sparse.dense import dense_values
from tests.known import system_of

MASSES = [1e-4, 1e-6, 1e-7, 1e-8, 1e-10, 1e-12, 1e-16, 0.0]
MU = Formula("mu")


def mixed(X):
    T = np.random.default_rng(3).uniform(-1, 1, (3, 3)) + 2 * np.eye(3)
    return T.T @ X @ T


def system(m, c=0.0, k=1.0, mu=0.9, turn=mixed):
    friction = np.zeros((3, 3))
    friction[0, 1] = 4 / 3
    M = turn(np.diag([1.0, 1, m]))
    C = turn(c * np.eye(3))
    K0 = turn(np.array([[2.0, -1, 0], [-1, 2, 0], [0, 0, k]]))
    K1 = turn(friction)
    return system_of((M + M.T) / 2, (C + C.T) / 2 if c else None, (K0, (K1, "mu")), {"mu": mu})


def growing(c, mu=0.9):
    """The growing root of lambda^2 + c lambda + s, the upper one."""
    roots = np.roots([1, c, 2 + np.sqrt(1 - 4 * mu / 3 + 0j)])
    fastest = roots[np.argmax(roots.real)]
    return complex(fastest.real, abs(fastest.imag))


@pytest.mark.parametrize("c", [0.0, 1e-3, 0.1])
@pytest.mark.parametrize("m", MASSES)
def test_roots_of_the_heavy_modes_keep_their_digits(m, c):
    found = system_roots(system(m, c))
    # else the rounded doubles have two more roots, which may grow faster
    is_known = m > 1e-14
    assert (found.verdict, found.certified) == ("flutter" if is_known else None, is_known)
    values = np.array([e.value for e in found.eigenvalues])
    assert set(values) == set(values.conj())
    of_light_motion = 2
    if m <= 1e-14:  # as good as massless: a damper alone leaves one root
        of_light_motion = 1 if c else 0
    assert len(values) == 4 + of_light_motion
    assert np.abs(values - growing(c)).min() < (1e-9 if m > 1e-7 else 1e-12)
    assert np.abs(dense_values(*system(m, c)(0.9)) - growing(c)).min() < 1e-7
    if m >= 1e-10:  # the light mode itself, as far as M's rounding leaves it
        for v in np.roots([m, c, 1.0]):
            assert abs(v) < 10 or np.abs(values / v - 1).min() < 1e-14 / m


@pytest.mark.parametrize(("m", "rate"), [*((m, 1.0) for m in MASSES), (1e-8, 1e4), (1e-8, 1e-4)])
def test_thresholds_of_the_heavy_modes_keep_their_digits(m, rate):
    slow = system(m)
    fast = tuple(Term(rate**2 * term.matrix, term.factor) for term in slow.K)
    found = thresholds(replace(slow, K=fast), 1.0)
    assert [p.kind for p in found.points] == ["flutter"]
    assert found.points[0].mu == pytest.approx(0.75, abs=1e-13)
    (crossing,) = found.crossings
    assert crossing.interval[0] <= 0.75 <= crossing.interval[1]
    assert crossing.interval[1] - crossing.interval[0] < 1e-8
    assert 2 * np.pi * crossing.frequency_hz == pytest.approx(rate * np.sqrt(2), rel=1e-10)


def test_damping_of_a_light_mass_hides_no_threshold():
    """Flutter begins where (4 mu / 3 - 1) = 2 c^2."""
    (point,) = thresholds(system(1e-9, c=1e-3), 1.0).points
    low, high = point.interval
    assert low <= 0.75 * (1 + 2e-6) <= high
    assert high - low < 1e-4


def test_a_light_mass_that_grows_and_one_that_varies_leave_the_threshold_of_others():
    growing_throughout = thresholds(system(1e-9, k=-1.0), 1.0)
    assert [c.mu for c in growing_throughout.crossings] == pytest.approx([0.75], abs=1e-3)
    assert not growing_throughout.points  # flutter beside a faster divergence
    varying = replace(system(1e-9), M=(Term(system(1e-9).M[0].matrix, Formula("1 + mu")),))
    assert [p.mu for p in thresholds(varying, 1.0).points] == pytest.approx([0.75], abs=1e-9)


def test_rounding_of_an_ill_conditioned_mass_shows_in_the_interval():
    """det (K - s M) has a double root s at mu = 0.832291..., by its discriminant in integers."""
    M = [[3216, -10602], [-10602, 34951]]
    K = {"1": [[17678, -58277], [-58277, 192115]], "mu": [[0, 4], [-4, 0]]}
    (crossing,) = thresholds(squeal.System(M, K=K), 1.0).crossings
    low, high = crossing.interval
    assert low <= 0.8322910148 <= high
    assert not thresholds(squeal.System(M, K=K), 1.0).certified


def test_a_root_that_passes_through_infinity_is_refused_with_what_helps():
    """The stiffness 1 - 2 mu of a motion without mass passes zero."""
    given = replace(system(0.0), K=(*system(0.0).K, Term(mixed(np.diag([0.0, 0, -2])), MU)))
    with pytest.raises(InputError, match=r"infinity.*`band`"):
        thresholds(given, 1.0)
    assert not thresholds(given, 0.45).points


def test_what_is_damped_and_has_no_mass_is_of_the_first_order():
    """Flutter begins where (4 mu / 3 - 1) = 2 c^2."""
    (point,) = thresholds(system(0.0, c=1e-2), 1.0).points
    assert point.kind == "flutter"
    assert point.mu == pytest.approx(0.75 * (1 + 2e-4), abs=1e-10)


def test_a_threshold_of_a_band_with_damping_of_what_is_light():
    """Flutter begins where (4 mu / 3 - 1) = 2 c^2."""
    for m in (1e-8, 1e-11, 0.0):
        found = system_thresholds(
            system(m, c=1e-2), 1.0, selection=EigenvalueSelection(band=(0.05, 1.0))
        ).answer
        (point,) = found.points
        assert found.certified is not False
        assert point.kind == "flutter"
        assert point.mu == pytest.approx(0.75 * (1 + 2e-4), abs=1e-10)
        assert point.interval[0] <= 0.75 * (1 + 2e-4) <= point.interval[1]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("stiffness", [1.25, 1.3])
def test_stiffness_that_cancels_to_nothing_has_a_threshold_with_an_interval(stiffness):
    # beside a node without mass the mass has the stiffness 1 - 1/(stiffness - mu)
    def system(mu):
        return np.diag([1.0, 0.0]), None, np.array([[1.0, -1.0], [-1.0, stiffness - mu]])

    (point,) = thresholds(system, 0.5).points
    low, high = point.interval
    assert point.kind == "divergence"
    assert point.converged
    assert low <= stiffness - 1.0 <= high
    assert high - low < 1e-13


@pytest.mark.parametrize(("decades", "damping"), [(4, 0.0), (4, 0.1), (8, 0.0), (12, 0.0)])
@pytest.mark.parametrize("side", ["rows", "columns"])
def test_units_of_rows_or_columns_make_no_mass_singular(side, decades, damping):
    """q'' + d q' + [[2, -1 + 4 mu / 3], [-1, 2]] q = 0, times a full mass, flutters where the roots
    1 +- sqrt(1 - 4 mu / 3) of -lambda^2 - d lambda part by more than damping allows."""
    units = np.diag([10.0**-decades, 10.0**decades])
    left, right = (units, np.eye(2)) if side == "rows" else (np.eye(2), units)
    M = np.array([[2.0, 1.0], [1.0, 3.0]])
    K0 = M @ np.array([[2.0, -1.0], [-1.0, 2.0]])
    K1 = M @ np.array([[0.0, 4.0 / 3.0], [0.0, 0.0]])
    scaled = [left @ X @ right for X in (M, K0, K1)]
    system = squeal.System(scaled[0], damping * scaled[0], {"1": scaled[1], "mu": scaled[2]})
    (crossing,) = squeal.thresholds(system).crossings
    # lambda = i w: w^2 = 2 and (d w)^2 = 4 mu / 3 - 1
    assert crossing.mu == pytest.approx(0.75 * (1.0 + 2.0 * damping**2), rel=1e-6)
