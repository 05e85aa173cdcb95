"""Thresholds of systems with a singular mass matrix, by determinants in integers."""

import numpy as np
import pytest

import squeal
from squeal.errors import MatrixError
from squeal.linear import thresholds
from squeal.linear.system import System

TURN = np.array([[0.0, 1.0], [-1.0, 0.0]])


def only(M, C, K, friction, high=1.0):
    """The one crossing, which is proved."""
    answer = squeal.thresholds(squeal.System(M, C, {"1": K, "mu": friction}), high=high)
    (crossing,) = answer.crossings
    assert answer.certified
    assert crossing.kind == "flutter"
    return crossing.mu


@pytest.mark.parametrize("size", [0, 20])
def test_coordinates_mixed_by_integers_hide_no_flutter(size):
    """det P = z^3/2 + 13 z^2 + (7/2 + 6 mu) z + 27 + mu^2, by Hurwitz stable up to
    mu^2 - 156 mu = 64."""
    M = np.diag([1.0, 0.0])
    C = np.array([[0.0, 3.0], [-3.0, 0.5]])
    K = np.array([[7.0, -1.0], [-1.0, 4.0]])
    T = np.array([[1.0, size], [size, size**2 + 1.0]])  # of determinant one
    M, C, K, friction = (T.T @ X @ T for X in (M, C, K, TURN))
    assert only(M, C, K, friction, high=200.0) == pytest.approx(78.0 + np.sqrt(6148.0), rel=1e-9)


def test_weak_damping_hides_no_flutter_beside_a_row_without_mass():
    """Between decimals at which none and two roots of the determinant in integers grow."""
    C = 2.0**-20 * np.diag([1.0, 2.0, 1.0])
    friction = [[0, 5, -5], [-5, 0, -3], [5, 3, 0]]
    found = only(np.diag([1, 2, 0]), C, np.diag([4, 9, 3]), friction)
    assert found == pytest.approx(0.066574482916, abs=1e-11)


def test_a_motion_without_mass_may_be_coupled_by_gyroscopic_terms_alone():
    """det P = 7 z^2 + (3/4 - 4 mu) z + 9 + mu^2."""
    C = np.array([[0.25, -2.0], [2.0, 0.0]])
    found = only(np.diag([1.0, 0.0]), C, 3.0 * np.eye(2), TURN)
    assert found == pytest.approx(0.1875, rel=1e-9)


@pytest.mark.parametrize("damping", [0.0, 0.5])
def test_a_lagrange_multiplier_ties_two_masses(damping):
    """With x3 = x1 it is diag(2, 1) beside [[4, mu], [-mu, 3]], and the damping d M: flutter where
    lambda = i w, w^2 = 5/2, (8 mu^2 - 4) / 16 = (d w)^2."""
    M = np.diag([1.0, 1.0, 1.0, 0.0])
    K = np.diag([1.0, 3.0, 3.0, 0.0])
    K[3, [0, 2]] = K[[0, 2], 3] = [1.0, -1.0]
    friction = np.zeros((4, 4))
    friction[:2, :2] = TURN
    exact = np.sqrt(0.5 + 2.0 * 2.5 * damping**2)
    assert only(M, damping * M, K, friction, high=4.0) == pytest.approx(exact, rel=1e-9)


def test_friction_of_a_constraint_force_diverges_where_stiffness_is_lost():
    """y = 0 needs the force N = -x, whose friction takes mu off the stiffness 3/2."""
    K = np.array([[1.5, 0.0, 0.0], [1.0, 2.0, 1.0], [0.0, 1.0, 0.0]])
    friction = np.zeros((3, 3))
    friction[0, 2] = 1.0
    M = np.diag([1.0, 1.0, 0.0])
    system = squeal.System(M, 0.1 * M, {"1": K, "mu": friction})
    answer = squeal.thresholds(system, prove=False)
    (crossing,) = answer.crossings
    assert crossing.kind == "divergence"
    assert crossing.mu == pytest.approx(1.5, rel=1e-9)


def test_every_number_is_a_root_of_matrices_that_are_singular_together():
    M = np.diag([1.0, 0.0])
    system = squeal.System(M, K={"1": M, "mu": [[0.0, 1.0], [0.0, 0.0]]})
    with pytest.raises(squeal.InputError, match="singular together"):
        squeal.thresholds(system)


def test_a_value_at_which_every_number_is_a_root_is_refused():
    """At mu = 1, the end of the range, the column of the constraint force vanishes."""
    M = np.diag([1.0, 1.0, 0.0])
    K = np.array([[2.0, 0.0, 1.0], [0.0, 3.0, 0.0], [1.0, 0.0, 0.0]])
    friction = np.zeros((3, 3))
    friction[0, 2] = -1.0
    system = squeal.System(M, K={"1": K, "mu": friction})
    with pytest.raises(squeal.InputError, match="singular together at a value"):
        squeal.thresholds(system, high=1.0)
    assert not squeal.thresholds(system, high=0.9).crossings


def test_a_system_without_any_motion_has_no_threshold():
    K = {"1": [[2.0, 1.0], [1.0, 0.0]], "mu": np.diag([1.0, 0.0])}
    system = squeal.System(np.diag([1.0, 0.0]), K=K)
    answer = squeal.thresholds(system)
    assert (answer.certified, answer.crossings, answer.verdict) == (True, (), "no root")
    with pytest.raises(squeal.InputError, match="no motion"):
        squeal.thresholds(system, prove=False)


@pytest.mark.parametrize("drives", [0.0, -1.0])
def test_a_spring_alone_beside_a_system_hides_no_threshold(drives):
    """A motion without mass or damping that no other one moves; s = 2 +- sqrt(1 - 4 mu / 3)."""
    K = {
        "1": [[2, -1, drives], [-1, 2, 0], [0, 0, 1]],
        "mu": [[0, 4 / 3, 0], [0, 0, 0], [0, 0, 0]],
    }
    found = squeal.thresholds(squeal.System(np.diag([1.0, 1.0, 0.0]), K=K))
    assert found.first.mu == pytest.approx(0.75)
    assert found.certified


@pytest.mark.parametrize("power", [0, 12, 20])
def test_units_of_a_massless_coordinate_hide_no_threshold(power):
    """Columns times powers of two change no root; Routh's criterion tells where flutter begins."""
    units = np.diag([2.0**power, 1.0])
    M = np.diag([0.0, 1.0])
    C = np.array([[0.25, -0.0625], [-0.0625, 0.5625]])
    K = np.array([[4.0, -1.0], [-1.0, 9.0]])
    F = np.array([[0.0, 5.0], [-2.0, 0.0]])
    found = squeal.thresholds(squeal.System(M, C @ units, {"1": K @ units, "mu": F @ units}), 3.0)
    mu = found.first.mu
    # det (s^2 M + s C + K + mu F) = a s^3 + b s^2 + c s + d: flutter where b c = a d
    a = 0.25
    b = 4.0 + 0.25 * 0.5625 - 0.0625**2
    c = 0.25 * 9.0 + 4.0 * 0.5625 + 0.0625 * ((-1.0 + 5.0 * mu) + (-1.0 - 2.0 * mu))
    d = 36.0 - (-1.0 + 5.0 * mu) * (-1.0 - 2.0 * mu)
    assert b * c == pytest.approx(a * d, rel=1e-6)
    assert found.certified


def test_growth_has_no_start_where_no_mass_is_left():
    """m s^2 - s / 10 + 1 of m = 2 grows; at m = 0 there is no oscillation to start from."""
    system = squeal.System({"m": [[1.0]]}, [[-0.1]], [[1.0]], parameters={"m": 2.0}, parameter="m")
    (mode,) = squeal.eigenvalues(system).unstable
    assert mode.growth_rate == pytest.approx(0.025)
    assert mode.onset is None


def test_a_window_of_very_fast_motions_is_found_where_it_is_proved_to_be():
    """Two masses of 1e-6 of the others' flutter where |k1 - k2| < 2 c, k1 - k2 = (mu - p) / 5."""
    middle = 0.3717
    width = 1e-3
    coupling = 0.2 * width / 4.0
    K = np.diag([1.0, 1.0, 1.0 + 0.2 * middle, 2.0])
    K[0, 3] = K[3, 0] = -0.5
    K[1, 2] = coupling
    K[2, 1] = -coupling
    system = squeal.System(
        np.diag([1.0, 1e-6, 1e-6, 0.0]), K={"1": K, "mu": np.diag([0.0, 0.2, 0.0, 0.0])}
    )
    found = squeal.thresholds(system, high=1.0)
    assert found.certified
    values = [crossing.mu for crossing in found.crossings]
    assert values == pytest.approx([middle - width / 2, middle + width / 2])


@pytest.mark.parametrize("power", [0, 10, 23])
def test_units_of_columns_beside_a_massless_one_hide_no_threshold(power):
    """The first coordinate without mass, and columns up to 2^46 apart: flutter at 1.0623125."""
    units = np.diag([1.0, 2.0**power, 2.0**-power])
    K = np.array([[2.0, -1.0, -0.5], [-1.0, 2.0, -1.0], [-0.5, -1.0, 4.0]])
    friction = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 2.0], [0.0, 0.0, 0.0]])
    M = np.diag([0.0, 1.0, 1.0])
    system = squeal.System(
        M @ units, np.eye(3) / 16 @ units, {"1": K @ units, "mu": friction @ units}
    )
    found = squeal.thresholds(system)
    assert found.first.mu == pytest.approx(1.06231247725, rel=1e-9)
    assert found.certified


@pytest.mark.parametrize("light", [1e-9, 1e-12])
def test_no_proof_ends_above_the_growth_of_slow_motions(light):
    """Two slow motions flutter by 0.0035 1/s beside one 10^7 times faster or more."""
    K = [[1.4, 0.01, -0.1], [-0.01, 2.0, 0.0], [-0.1, 0.0, 1e6]]
    friction = np.diag([1.0, 0.0, 0.0])
    found = squeal.thresholds(
        squeal.System(np.diag([1.0, 1.0, light]), K={"1": K, "mu": friction}), high=1.0
    )
    values = [crossing.mu for crossing in found.crossings]
    assert not found.certified or values == pytest.approx([0.58, 0.62], abs=1e-3)


@pytest.mark.parametrize("light", [1e-4, 1e-8, 1e-12])
def test_a_constraint_of_velocities_beside_a_light_mass_leaves_motions(light):
    """At mu = 2 the multiplier does no work on row 1, which has the roots +-i sqrt 2; at 32/15
    det K vanishes."""
    K = [[2.0, 0.0, -1.0], [0.0, 3.0, -1.0], [1.0, 0.1, 0.0]]
    C = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, 1.0, 0.0]]
    friction = np.zeros((3, 3))
    friction[0, 2] = 0.5
    M = np.diag([1.0, light, 0.0])
    found = squeal.thresholds(squeal.System(M, C, {"1": K, "mu": friction}), high=3.0)
    assert [crossing.mu for crossing in found.crossings] == pytest.approx([2.0, 32 / 15])
    assert found.crossings[0].frequency_hz == pytest.approx(np.sqrt(2.0) / (2.0 * np.pi))


@pytest.mark.parametrize("high", [0.5, 2.0])
@pytest.mark.parametrize("seed", [None, 1, 2, 6])
def test_a_root_that_is_zero_throughout_takes_no_search(high, seed):
    """det P = -z at every mu, in coordinates as given or mixed."""
    rng = np.random.default_rng(seed)
    S = np.eye(2)
    T = np.eye(2)
    if seed is not None:
        T = rng.standard_normal((2, 2))
        S = rng.standard_normal((2, 2))
    M = S @ np.diag([1.0, 0.0]) @ T
    C = S @ np.array([[0.0, 0.0], [1.0, 0.0]]) @ T
    K = S @ np.array([[1.0, 1.0], [0.0, 0.0]]) @ T
    spring = S @ np.diag([1.0, 0.0]) @ T
    found = thresholds(lambda mu: (M, C, K + mu * spring), high)
    assert not found.crossings
    assert len(found.searched[0].continuation.spectra) < 50


@pytest.mark.parametrize("mass", [1e-6, 1e-8])
@pytest.mark.parametrize("compliance", [1e-11, 1e-12, 1e-13])
def test_a_light_mass_on_a_stiff_tie_takes_no_root_through_infinity(mass, compliance):
    """With x3 = x2 their stiffness 2e4 (1 - mu) is lost at 1; the tie's own root is near 1e18."""
    K = 1.1e4 * np.diag([1.0, 1.0, 1.0, 0.0])
    K[1, 2] = K[2, 1] = -1e3
    K[3, [1, 2]] = K[[1, 2], 3] = [1.0, -1.0]
    K[3, 3] = -compliance
    friction = np.zeros((4, 4))
    friction[1, 2] = 1e4
    friction[2, 1] = -3e4
    M = np.diag([1.0, 1.0, mass, 0.0])
    (crossing,) = thresholds(lambda mu: (M, None, K + mu * friction), 1.7).crossings
    assert crossing.kind == "divergence"
    assert crossing.mu == pytest.approx(1.0, rel=1e-6)


@pytest.mark.parametrize("mass", [1e-4, 1e-6, 1e-8])
def test_a_light_mass_tied_to_another_takes_no_root_through_infinity(mass):
    """With x3 = x2 two masses are left, of whose determinant Hurwitz tells where flutter begins."""
    M = np.diag([1.0, 1.0, mass, 0.0])
    C = np.diag([1.0, 3.0, 1e3 * mass, 0.0])
    K = 9e3 * np.diag([1.0, 1.0, 1.0, 0.0])
    K[0, 2] = K[2, 0] = -1e3
    K[3, [1, 2]] = K[[1, 2], 3] = [1.0, -1.0]
    friction = np.zeros((4, 4))
    friction[0, 2] = -3e4
    friction[2, 0] = 1e4
    (crossing,) = thresholds(lambda mu: (M, C, K + mu * friction), 1.7).crossings
    mu = crossing.mu
    m = 1.0 + mass
    c = 3.0 + 1e3 * mass
    a3 = m + c
    a2 = 9e3 * m + 18e3 + c
    a1 = 18e3 + 9e3 * c
    a0 = 9e3 * 18e3 - (-1e3 - 3e4 * mu) * (-1e3 + 1e4 * mu)
    assert a3 * a2 * a1 == pytest.approx(m * a1**2 + a3**2 * a0, rel=1e-9)
    assert crossing.kind == "flutter"


@pytest.mark.parametrize("is_mixed", [False, True])
@pytest.mark.parametrize("damping", [0.125, 0.5])
def test_thresholds_beside_a_constraint_of_velocities_are_proved(damping, is_mixed):
    """x3' = x1' is the tie of displacements above, and a root that stays zero."""
    M = np.diag([1.0, 1.0, 1.0, 0.0])
    K = np.diag([1.0, 3.0, 3.0, 0.0])
    C = damping * M
    C[3, [0, 2]] = [1.0, -1.0]
    K[[0, 2], 3] = [1.0, -1.0]
    K[:, 0] += K[:, 2]  # x3 is counted from x1, so that its spring holds both
    M[:, 0] += M[:, 2]
    C[:, 0] += C[:, 2]
    friction = np.zeros((4, 4))
    friction[:2, :2] = TURN
    if is_mixed:
        T = np.eye(4) + np.diag([1.0, 2.0, -1.0], 1)
        M, C, K, friction = (T.T @ X @ T for X in (M, C, K, friction))
    exact = np.sqrt(0.5 + 2.0 * 2.5 * damping**2)
    assert only(M, C, K, friction, high=4.0) == pytest.approx(exact, rel=1e-9)


@pytest.mark.parametrize("light", [1e-10, 1e-13])
def test_a_wide_window_of_light_masses_beside_a_massless_row_is_found(light):
    """They flutter where |k1 - k2| < 2 c, k1 - k2 = (mu - 3 / 8) / 5, and c = 1 / 160."""
    K = np.diag([1.0, 1.0, 1.075, 2.0])
    K[0, 3] = K[3, 0] = -0.5
    K[1, 2] = 0.00625
    K[2, 1] = -0.00625
    friction = np.diag([0.0, 0.2, 0.0, 0.0])
    M = np.diag([1.0, light, light, 0.0])
    found = squeal.thresholds(squeal.System(M, K={"1": K, "mu": friction}), high=1.0)
    values = [crossing.mu for crossing in found.crossings]
    assert values == pytest.approx([0.3125, 0.4375], rel=1e-6)


def test_light_masses_decades_apart_leave_digits_of_the_slow_motion():
    """No crossing: omega^2 of the heavy mass is near 1.2e7, of the others 1e13 and 1e17."""
    M = np.diag([1.0, 1e-5, 1e-8, 0.0])
    K = np.diag([1.2e7, 1e4, 1e5, -1e-12])
    K[0, 2] = K[2, 0] = -1e3
    K[3, :2] = K[:2, 3] = [-1.0, 1.0]
    friction = np.zeros((4, 4))
    friction[0, 2] = -2e4
    friction[2, 0] = 1e4
    found = thresholds(lambda mu: (M, None, K + mu * friction), 1.7)
    assert not found.crossings
    assert len(found.searched[0].continuation.spectra) < 100


def test_multipliers_that_hold_all_motions_at_one_value_are_refused_in_words():
    """Two equal multipliers with compliances of 1e-11: at the middle value no root is finite."""
    K = np.array(
        [
            [0, 0, -17, 0, 0],
            [4, 9, -8, 1, 1],
            [-17, 0, 20, 0, 0],
            [1, 1, 0, -1e-11, 0],
            [1, 1, 0, 0, -1e-11],
        ]
    )
    friction = np.zeros((5, 5))
    friction[[0, 2], 3] = -1.0
    system = squeal.System(np.diag([2.0, 3.0, 2.0, 0.0, 0.0]), K={"1": K, "mu": friction})
    with pytest.raises(squeal.InputError, match="passes through infinity"):
        squeal.thresholds(system, high=8.0, prove=False)


def _light_free_body_in_other_coordinates(rows, columns):
    """A pair that flutters at mu = 0.27 beside a mass of 2e-6 without a spring, five rows.

    rows, columns: combinations (5, 5) of the equations and of the unknowns, of whole numbers. The
    mass matrix keeps its rank of 5, with a condition of about 1e10.
    """
    M = np.diag([1.0, 1.0, 1.0, 859.0, 2e-6])
    K = np.zeros((5, 5))
    K[:2, :2] = [[2.0, -1.0], [-1.0, 2.0]]
    K[2, 2] = 16811.0
    friction = np.zeros((5, 5))
    friction[0, 1] = 1.0 / 0.27
    M, K, friction = (rows @ X @ columns for X in (M, K, friction))
    return System({"1": M}, K={"1": K, "mu": friction}, parameter="mu")


def _whole_numbers(seed):
    """Two arrays (5, 5)."""
    rng = np.random.default_rng(seed)
    columns = rng.integers(-9, 10, (5, 5)).astype(float)
    rows = rng.integers(-9, 10, (5, 5)).astype(float)
    return rows, columns


@pytest.mark.parametrize("seed", [3, 6])
def test_roots_that_rounding_makes_infinite_certify_no_list(seed):
    system = _light_free_body_in_other_coordinates(*_whole_numbers(seed))
    result = thresholds(system, 1.5)
    assert not result.certified
    (searched,) = result.searched
    assert "rounding hides 3 of the roots" in searched.doubts


def test_roots_that_rounding_makes_infinite_are_not_denied():
    system = _light_free_body_in_other_coordinates(*_whole_numbers(0))
    with pytest.raises(MatrixError, match="rounding hides all their roots"):
        thresholds(system, 1.5)
