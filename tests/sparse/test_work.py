"""How many factorisations a search takes, most of its time, where nothing is in doubt."""

import numpy as np
import pytest
from scipy.sparse import block_diag, csc_array, diags_array, eye_array

from squeal.linear.system import System
from squeal.sparse.argument_principle import NODE_COUNTS, Rectangle
from squeal.sparse.factor import Factor
from squeal.sparse.lowest_roots import lowest_modes
from squeal.sparse.quadratic import ScaledSystem
from squeal.sparse.reduction import reduce_system
from squeal.sparse.region_roots import modes_in
from tests.sparse.test_first_look import BRAKE, look_at
from tests.sparse.test_reduction import REGION, VALUES


@pytest.fixture(scope="module")
def scaled():
    return ScaledSystem(BRAKE)


@pytest.fixture
def factorised(monkeypatch):
    """Shapes of what has been factorised."""
    made = []
    begin = Factor.__init__

    def counting(self, matrix):
        made.append(matrix.shape)
        begin(self, matrix)

    monkeypatch.setattr(Factor, "__init__", counting)
    return made


@pytest.mark.parametrize("certify", [False, True])
def test_one_for_a_region_and_few_for_its_count(factorised, scaled, certify):
    problem = scaled.at({"mu": 0.6})
    modes_in(problem, REGION, certify)
    assert len(factorised) == 1 + certify * NODE_COUNTS[0]
    factorised.clear()
    lowest_modes(problem, 6, certify)  # after a first look; of a circle around zero its upper half
    assert len(factorised) == 2 + certify * (NODE_COUNTS[1] // 2)


@pytest.mark.parametrize("damping", [0.0, 1e-3])
@pytest.mark.parametrize("chains", [1, 3])
def test_eight_determinants_beside_free_motions(factorised, chains, damping):
    """Free chains of n masses vibrate at 2 sqrt(k) sin(j pi / 2n) rad/s, with j = 0 twice at zero,
    beside the outline of the band's disc. Rough zeros scatter, and have no conjugates beside."""
    n = 300
    bends = np.r_[1.0, np.full(n - 2, 2.0), 1.0]
    chain = diags_array([bends, -np.ones(n - 1), -np.ones(n - 1)], offsets=[0, 1, -1])
    stiffness = 1.0 + np.arange(chains) / 7
    K = csc_array(block_diag([k * chain for k in stiffness]))
    problem = ScaledSystem(System(eye_array(chains * n), damping * K, K)).at({})
    frequencies = np.outer(np.sqrt(stiffness), 2 * np.sin(np.arange(n) * np.pi / (2 * n))).ravel()
    high = 0.06
    inside = (frequencies > high / 6) & (frequencies < high)
    found = modes_in(problem, Rectangle(-high / 4, high / 4, high / 6, high))
    assert np.allclose(abs(found.values), np.sort(frequencies[inside]), rtol=1e-9)
    assert found.certified
    assert len(factorised) == 1 + NODE_COUNTS[0]


def test_one_for_a_basis_and_none_for_what_it_answers(factorised, scaled):
    assert len(reduce_system(scaled, REGION, VALUES).samples) > 2
    assert len(factorised) == 1
    look = look_at(BRAKE)
    assert len(factorised) == 2
    for mu in np.linspace(0.0, 0.7, 9):
        assert len(look.estimate_by_basis({"mu": mu}).values) > 3
    assert len(factorised) == 2
