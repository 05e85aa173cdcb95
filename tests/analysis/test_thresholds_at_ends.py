"""Thresholds exactly where a range starts or ends: of pads, of bands, of reduced systems."""

import numpy as np
import pytest

from squeal.analysis.pads import branch_system, critical_friction
from squeal.analysis.systems import roots
from squeal.analysis.systems.roots import Wanted
from squeal.analysis.systems.thresholds import system_thresholds
from squeal.io.scene import Scene
from squeal.linear.system import Term, TermSystem
from squeal.numerics.differentiation import Formula
from squeal.schema.values import Place

PAD = {
    **{"m": 1.6, "w": 0.025, "h": 0.019, "k1": 3.9e6, "k2": 1.06e6, "k_c": 1.56e6, "L1": 0.23},
    **{"L2": 0.25, "alpha1": 0.5, "alpha2": 2.3, "F_n": 42.0, "V": 0.04},
    **{"mu_s": 0.24, "mu_k": 0.12, "v_ref": 0.4},
}
HERTZ = np.array([1.0, 2.0, 3.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0])


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


@pytest.fixture(params=[400, 8], ids=["full", "reduced"])
def rows(request, monkeypatch):
    monkeypatch.setattr(roots, "ALL_ROWS", request.param)


def oscillators(rates, at):
    """Three modes in the band 0.5 to 5 Hz that grow by rate (p - at), others above."""
    D = np.diag(np.r_[-2.0 * np.array(rates), np.zeros(6)])
    others = np.diag(np.r_[np.zeros(3), np.full(6, 0.3)])
    K = np.diag((2 * np.pi * HERTZ) ** 2)
    damping = (Term(others - at * D), Term(D, Formula("mu")))
    return TermSystem((Term(np.eye(9)),), damping, (Term(K),))


@pytest.mark.parametrize(
    ("rates", "at", "hertz", "points"),
    [
        ((0.5, 1.0, -0.5), 0.0, [2.0, 1.0], [("flutter", 2.0)]),
        ((-0.5, -1.0, -0.2), 0.0, [], []),
        ((0.5, 1.0, 0.2), 1.0, [2.0, 1.0, 3.0], [("flutter", 2.0)]),
        ((-0.5, -1.0, -0.2), 1.0, [2.0, 1.0, 3.0], [("restabilised", 2.0)]),
        ((-0.5, 1.0, 0.2), 1.0, [2.0, 1.0, 3.0], []),
    ],
)
@pytest.mark.usefixtures("rows")
def test_of_a_band_what_happens_at_an_end_is_listed_once_and_the_fastest_named(
    rates, at, hertz, points
):
    found = system_thresholds(oscillators(rates, at), 1.0, wanted=Wanted(band=(0.5, 5.0)))
    assert [c.mu for c in found.crossings] == pytest.approx([at] * len(hertz), rel=1e-12)
    assert sorted(c.frequency_hz for c in found.crossings) == pytest.approx(sorted(hertz))
    ways = {round(c.frequency_hz): c.direction for c in found.crossings}
    assert ways == {round(h): "up" if rates[round(h) - 1] > 0 else "down" for h in hertz}
    assert [p.kind for p in found.points] == [kind for kind, _ in points]
    assert [p.frequency_hz for p in found.points] == pytest.approx([f for _, f in points])
    assert sum(c.changes_verdict for c in found.crossings) == len(points)
    assert found.certified
    assert not found.unconfirmed
    assert not found.left_out
