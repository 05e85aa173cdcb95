"""Windows of flutter that open and close within a step, however the range is divided."""

import itertools

import numpy as np
import pytest
from scipy.sparse import block_diag, csc_array, diags_array, eye_array

from squeal.analysis.systems.roots import Wanted
from squeal.analysis.systems.thresholds import system_thresholds
from squeal.linear import thresholds
from squeal.linear.system import Term, TermSystem
from squeal.numerics.differentiation import Formula

TWO = np.diag([33.07, 54.41]), np.array([[27.41, 0.299], [-0.192, -7.667]])
FOUR = (
    np.diag([16.87, 22.37, 64.07, 75.56]),
    np.array(
        [
            [-12.86, -0.35, -0.31, 0.28],
            [0.04, 4.06, 0.31, -0.3],
            [0.02, -0.16, -5.46, -0.1],
            [0.22, -0.23, 0.03, -17.15],
        ]
    ),
)
DAMPING = 5e-4


def of(K0, K1, damping=0.0):
    return lambda mu: (np.eye(len(K0)), damping * np.eye(len(K0)), K0 + mu * K1)


@pytest.mark.parametrize("most", [0.65, 0.9, 1.0, 2.0])
def test_two_damped_modes_flutter_in_a_window_known_in_closed_form(most):
    """K's eigenvalues are m +- i e; with C = c the motion is kept up where e^2 = c^2 m."""
    (k, K1), c = TWO, DAMPING
    difference = np.polynomial.Polynomial([k[0, 0] - k[1, 1], K1[0, 0] - K1[1, 1]]) / 2
    mean = np.polynomial.Polynomial([k[0, 0] + k[1, 1], K1[0, 0] + K1[1, 1]]) / 2
    coupling = np.polynomial.Polynomial([0.0, 0.0, K1[0, 1] * K1[1, 0]])
    expected = np.sort((difference**2 + coupling + c * c * mean).roots().real)
    found = thresholds(of(*TWO, c), most)
    assert [x.direction for x in found.crossings] == ["up", "down"]
    assert [x.mu for x in found.crossings] == pytest.approx(expected, rel=1e-11)


@pytest.mark.parametrize("eps", [1e-3, 1e-4, 1e-6])
@pytest.mark.parametrize("damped", [True, False])
def test_growth_that_begins_and_soon_turns_back_by_itself(eps, damped, rng):
    """Damping, or without damping the stiffness, (mu - a)^2 - eps^2: growth for |mu - a| < eps."""
    X = np.eye(4) + 0.3 * rng.normal(size=(4, 4))
    for at in rng.uniform(0.05, 0.95, 4):

        def system(mu, at=at):
            passing = np.diag([(mu - at) ** 2 - eps**2, 0.1, 0.2, 0.1])
            stiffness = np.diag([4.0, 9.0, 16.0, 25.0])
            if damped:
                return X.T @ X, X.T @ passing @ X, X.T @ stiffness @ X
            return X.T @ X, None, X.T @ (stiffness * (1 - np.eye(4)[0]) + passing) @ X

        found = thresholds(system, 1.0)
        assert [c.direction for c in found.crossings] == ["up", "down"]
        assert {c.kind for c in found.crossings} == {"flutter" if damped else "divergence"}
        near = [at - eps, at + eps]
        assert [c.mu for c in found.crossings] == pytest.approx(near, abs=1e-3 * eps, rel=0)


@pytest.mark.parametrize("damping", [0.0, 2e-4])
def test_a_window_in_a_band_of_a_large_system_is_found(damping):
    rest = 440
    K0 = csc_array(block_diag([FOUR[0], diags_array(np.linspace(400.0, 4000.0, rest))]))
    K1 = csc_array(block_diag([FOUR[1], csc_array((rest, rest))]))
    eye = csc_array(eye_array(rest + 4))
    C = (Term(damping * eye),) if damping else ()
    system = TermSystem((Term(eye),), C, (Term(K0), Term(K1, Formula("mu"))))
    found = system_thresholds(system, 1.0, wanted=Wanted(band=(0.2, 2.0)))
    assert [c.direction for c in found.crossings] == ["up", "down"]
    assert [c.mu for c in found.crossings] == pytest.approx([0.97475, 0.99198], abs=1e-5)
    assert found.certified


@pytest.mark.parametrize(("seed", "damping"), [(0, 0.0), (1, DAMPING), (2, 0.0), (3, DAMPING)])
def test_no_window_of_random_systems_is_missed_and_none_invented(seed, damping):
    """What grows by NumPy's eigenvalues at 1000 values and between all crossings."""
    rng = np.random.default_rng(seed)
    for n in (5, 12):
        K0 = np.diag(rng.uniform(1, 100, n))
        K1 = 0.3 * rng.normal(size=(n, n)) + np.diag(15 * rng.normal(size=n))
        found = thresholds(of(K0, K1, damping), 1.0)
        places = [0.0, *(c.mu for c in found.crossings), 1.0]
        middles = [(a + b) / 2 for a, b in itertools.pairwise(places)]
        grid = np.concatenate([np.linspace(0, 1, 1000), middles])
        squares = np.linalg.eigvals(K0 + grid[:, None, None] * K1).astype(complex)
        roots = np.sqrt(damping**2 / 4 - squares)
        rates = np.abs(roots.real) - damping / 2
        number = (rates > 1e-6 * np.abs(roots)).sum(axis=1)
        clear = (np.abs(rates - 5e-7 * np.abs(roots)) >= 5e-7 * np.abs(roots)).all(axis=1)
        known = np.full(len(grid), number[0])
        for c in found.crossings:
            size = 2 if c.kind == "flutter" else 1
            known[grid > c.mu] += size if c.direction == "up" else -size
        assert clear.sum() > 900
        assert np.array_equal(known[clear], number[clear])
