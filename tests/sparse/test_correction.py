"""Modes corrected from single precision against dense solutions; the basis that they share."""

from dataclasses import replace

import numpy as np
import pytest

from squeal.errors import ComputationError
from squeal.linear.system import Term
from squeal.sparse.argument_principle import band
from squeal.sparse.eigensolver import OPTIONS, modes_in
from squeal.sparse.quadratic import ScaledSystem
from tests import large

BRAKE = large.disc_and_pad(3)
REGION = band(200.0, 2200.0)


def _structural() -> ScaledSystem:
    K = (Term(BRAKE.K[0].matrix * (1 + 0.02j)), *BRAKE.K[1:])
    return ScaledSystem(replace(BRAKE, K=K))


@pytest.mark.parametrize("scaled", [ScaledSystem(BRAKE), _structural()], ids=["real", "complex"])
@pytest.mark.parametrize("exact", [2e-9, 1e-13])
def test_right_and_left_modes(scaled, exact):
    problem = scaled.at({"mu": 0.6})
    roots = modes_in(problem, REGION, certify=False, exact=exact).roots
    full = modes_in(problem, REGION)
    assert full.certified
    assert len(roots.values) == len(full.values) > 3
    distance = np.abs(roots.values[:, None] - full.values[None, :]).min(axis=0)
    assert np.all(distance < 1e-9 * np.abs(full.values))
    assert np.all(problem.backward_errors(roots.values, roots.right) < 2 * exact)
    rest = problem.transposed().backward_errors(roots.values, roots.left.conj())
    assert np.all(rest < 2 * exact)


def test_what_is_not_reached_is_divided_and_what_is_not_corrected_is_refused():
    problem = ScaledSystem(BRAKE).at({"mu": 0.6})
    expected = modes_in(problem, REGION).values
    few = modes_in(problem, REGION, options=replace(OPTIONS, steps=24))
    assert few.shifts > 2
    assert few.certified
    assert np.allclose(np.sort_complex(few.values), np.sort_complex(expected), rtol=1e-9)
    with pytest.raises(ComputationError, match="rounding hides them"):
        modes_in(problem, REGION, options=replace(OPTIONS, rounds=1))
    with pytest.raises(ComputationError, match="too many roots"):
        modes_in(problem, REGION, options=replace(OPTIONS, steps=24, pieces=2))
