"""Modes corrected from single precision against those of a double-precision subspace."""

import numpy as np
import pytest

from squeal.linear.system import Term, TermSystem
from squeal.sparse import reduction
from squeal.sparse.argument_principle import Rectangle, band
from squeal.sparse.eigensolver import modes_in
from squeal.sparse.quadratic import ScaledSystem
from squeal.sparse.reduction import corrected_modes, enlarged, reduce_system
from tests import large

BRAKE = large.disc_and_pad(3)
REGION = band(200.0, 2200.0)


def _structural() -> ScaledSystem:
    K = (Term(BRAKE.K[0].matrix * (1 + 0.02j)), *BRAKE.K[1:])
    return ScaledSystem(TermSystem(BRAKE.M, BRAKE.C, K, BRAKE.parameters, BRAKE.parameter))


@pytest.mark.parametrize("scaled", [ScaledSystem(BRAKE), _structural()], ids=["real", "complex"])
def test_right_and_left_modes(scaled):
    problem = scaled.at({"mu": 0.6})
    roots = corrected_modes(problem, REGION)
    full = modes_in(problem, REGION, left=False, certify=False).values
    assert len(roots.values) == len(full) > 3
    distance = np.abs(roots.values[:, None] - full[None, :]).min(axis=0)
    assert np.all(distance < 1e-9 * np.abs(full))
    assert np.all(problem.backward_errors(roots.values, roots.right) < 1e-8)
    rest = problem.transposed().backward_errors(roots.values, roots.left.conj())
    assert np.all(rest < 1e-8)


def test_what_is_not_reached_or_not_corrected(monkeypatch):
    """Then the caller has the exact modes instead, and the reduced system is the same."""
    scaled = ScaledSystem(BRAKE)
    values = [{"mu": 0.0}, {"mu": 0.6}]
    expected = np.sort_complex(reduce_system(scaled, REGION, values).values(REGION, {"mu": 0.3}))
    for name, few in (("STEPS", 12), ("ROUNDS", 1)):
        with monkeypatch.context() as patch:
            patch.setattr(reduction, name, few)
            assert corrected_modes(scaled.at(values[0]), REGION) is None
            found = reduce_system(scaled, REGION, values).values(REGION, {"mu": 0.3})
        assert np.allclose(np.sort_complex(found), expected, rtol=1e-9)


def test_a_root_that_the_corrections_lose(monkeypatch):
    """Fewer roots than the subspace showed inside the region are not taken for all."""
    problem = ScaledSystem(BRAKE).at({"mu": 0.6})
    complete = reduction._corrected

    def losing(*given):
        return complete(*given).picked(np.arange(1, 4))

    monkeypatch.setattr(reduction, "_corrected", losing)
    assert corrected_modes(problem, REGION) is None


def test_a_region_without_roots():
    roots = corrected_modes(ScaledSystem(BRAKE).at(), Rectangle(900.0, 1000.0, 300.0, 400.0))
    assert len(roots.values) == 0


def test_enlarged(rng):
    """Small parts are kept or dropped as told, and the basis is orthonormal to rounding."""
    V = np.linalg.qr(rng.standard_normal((80, 5)))[0]
    new = np.linalg.qr(np.hstack([V, rng.standard_normal((80, 3))]))[0][:, 5:]
    columns = V[:, :3] + new * [1.0, 1e-5, 1e-8] + 0j
    for dropped, count in ((1e-3, 6), (1e-7, 7), (1e-10, 8)):
        basis = enlarged(V, columns, dropped)
        assert basis.shape == (80, count)
        assert np.allclose(basis.T @ basis, np.eye(count), atol=1e-14)
        outside = new - basis @ (basis.T @ new)
        assert np.all(np.linalg.norm(outside, axis=0)[: count - 5] < 1e-6)
    assert enlarged(V, columns[:, :0], 1e-3).shape == (80, 5)
