"""Falling friction: modes that grow from the least friction on."""

import numpy as np
import pytest

from squeal.analysis.pads import branch_system, critical_friction
from squeal.io.scene import Scene
from squeal.schema.values import Place

PAD = {
    **{"m": 1.6, "w": 0.025, "h": 0.019, "k1": 3.9e6, "k2": 1.06e6, "k_c": 1.56e6, "L1": 0.23},
    **{"L2": 0.25, "alpha1": 0.5, "alpha2": 2.3, "F_n": 42.0, "V": 0.04},
    **{"mu_s": 0.24, "mu_k": 0.12, "v_ref": 0.4},
}


def falling(**changes):
    document = {"model": "B2", "parameters": PAD | changes, "formulation": {"line_force": "mean"}}
    return Scene.from_dict(document, Place("falling"))


def test_falling_friction_makes_modes_of_an_undamped_pad_grow_from_the_start():
    """Its damping is mu times a matrix; growth rates by numpy's roots at mu = 1e-6."""
    pad, small = falling(), 1e-6
    M, C, K = map(np.asarray, branch_system(pad, 0.5)[0](small))
    below = -np.linalg.solve(M, np.hstack([K, C]))
    roots = np.linalg.eigvals(np.vstack([np.eye(3, 6, 3), below]))
    growing = sorted((z for z in roots if z.real > 1e-12 * abs(z) and z.imag > 0), key=np.real)
    hertz = [z.imag / (2 * np.pi) for z in growing[::-1]]
    found = critical_friction(pad, 0.5)
    assert [(c.mu, c.direction) for c in found.crossings] == [(0.0, "up")] * 2
    assert [c.frequency_hz for c in found.crossings] == pytest.approx(hertz, rel=1e-5)
    assert [c.changes_verdict for c in found.crossings] == [True, False]
    (point,) = found.points
    assert (point.mu, point.kind) == (0.0, "flutter")
    assert point.frequency_hz == pytest.approx(hertz[0], rel=1e-5)
    # whatever was asked before
    for other in (falling(V=2.0), pad):
        critical_friction(other, 0.3)
        again = critical_friction(pad, 0.5)
    assert (again.points, again.crossings) == (found.points, found.crossings)
