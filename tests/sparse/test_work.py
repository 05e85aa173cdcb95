"""How many factorisations a search takes, most of its time, where nothing is in doubt."""

import numpy as np
import pytest

from squeal.sparse.argument_principle import NODE_COUNTS
from squeal.sparse.eigensolver import lowest_modes, modes_in
from squeal.sparse.factor import Factor
from squeal.sparse.quadratic import ScaledSystem
from squeal.sparse.reduction import reduce_system
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


def test_one_for_a_basis_and_none_for_what_it_answers(factorised, scaled):
    assert len(reduce_system(scaled, REGION, VALUES).samples) > 2
    assert len(factorised) == 1
    look = look_at(BRAKE)
    assert len(factorised) == 2
    for mu in np.linspace(0.0, 0.7, 9):
        assert len(look.estimate_by_basis({"mu": mu}).values) > 3
    assert len(factorised) == 2
