"""The least largest growth rate against a grid, a closed form, and the full system."""

import numpy as np
import pytest

import squeal
from squeal.errors import ComputationError
from squeal.queries.optimise import _Search
from squeal.results.sources import EigenvalueSelection
from tests.known import system_of
from tests.large import disc_and_pad


def friction_and_dampers(n=6, seed=4):
    """n modes, damped by two dampers that share what there is, coupled by friction."""
    rng = np.random.default_rng(seed)
    coupling = rng.normal(size=(n, n))
    damper = rng.random((2, n))
    K = (np.diag(np.arange(4.0, 4.0 + n)), (coupling - coupling.T, "mu"), (np.diag(damper[0]), "k"))
    C = ((np.diag(damper[0]), "share"), (np.diag(damper[1]), "0.3 - share"))
    return system_of(np.eye(n), C, K, {"mu": 0.6, "k": 0.5, "share": 0.15})


def growth(system, changes):
    """The largest growth rate, by the companion matrix."""
    M, C, K = system.arrays(changes)
    state = np.block([[np.zeros_like(M), np.eye(len(M))], [-K, -C]])  # M = 1
    return np.linalg.eigvals(state).real.max()


@pytest.mark.parametrize("seed", range(3))
def test_no_point_of_a_grid_is_better(seed):
    system = friction_and_dampers(seed=seed)
    bounds = {"k": (0.0, 3.0), "share": (0.0, 0.3)}
    best = squeal.optimise(system, bounds)
    least = np.inf
    for k in np.linspace(*bounds["k"], 31):
        for share in np.linspace(*bounds["share"], 31):
            least = min(least, growth(system, {"k": k, "share": share}))
    assert best.growth[1] <= least + 1e-9
    assert best.growth[1] == pytest.approx(least, abs=0.02)  # of the grid's width
    assert best.growth[1] < best.growth[0]


def test_two_modes_share_one_damper_to_the_best_of_both():
    """Damped by c and by a - c: the slower decay is fastest at half of a each."""
    eye = [np.diag(row) for row in np.eye(2)]
    system = system_of(
        np.eye(2), ((eye[0], "c"), (eye[1], "0.4 - c")), np.diag([1.0, 9.0]), {"c": 0.3}
    )
    best = squeal.optimise(system, {"c": (0.0, 0.4)}, starts=2)
    assert best.parameters[0].after == pytest.approx(0.2, abs=1e-6)
    assert best.growth == pytest.approx((-0.05, -0.1), abs=1e-7)
    assert len(best.active) == 2
    assert best.after.certified
    only = squeal.optimise(system, {"c": (0.0, 0.1)}, starts=1)  # own value lies outside
    assert (only.parameters[0].at, only.parameters[0].before) == ("high", 0.3)
    with pytest.raises(ComputationError, match="no root lies in the band"):
        squeal.optimise(system, {"c": (0.0, 0.4)}, band=(5.0, 6.0))


def test_a_search_from_where_one_has_begun_ends_like_it():
    """The parameter is without effect, so that no search leaves the start."""
    damped = system_of(np.eye(2), np.diag([0.2, 0.4]), ((np.zeros((2, 2)), "c"),), {"c": 0.3})
    search = _Search(damped, EigenvalueSelection(), {"c": (0.0, 1.0)})
    ends = [search.minimise_from(np.array([0.3])).largest for _ in range(2)]
    assert ends == pytest.approx([0.0, 0.0], abs=1e-9)


def test_a_large_system_is_searched_on_a_reduced_one_and_judged_itself():
    system = disc_and_pad(3)
    band = (1000.0, 3500.0)
    best = squeal.optimise(system, {"mu": (0.1, 0.5)}, band, starts=2)
    assert best.basis
    residual = best.basis["residual"]
    assert isinstance(residual, float)
    assert residual < 1e-7
    (one,) = best.parameters
    values = (0.1, 0.3, 0.5, one.after)
    rates = [squeal.eigenvalues(system, mu, band=band).values.real.max() for mu in values]
    assert best.growth[1] == pytest.approx(rates[-1], rel=1e-9)
    assert best.growth[1] == pytest.approx(min(best.starts), rel=1e-6)
    assert best.growth[1] <= min(rates) + 1e-9
