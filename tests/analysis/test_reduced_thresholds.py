"""Thresholds of large systems on reduced ones, against closed forms."""

import math

import numpy as np
import pytest
from scipy.sparse import block_diag, csc_array, diags_array, eye_array

from squeal.analysis.systems.roots import Wanted
from squeal.analysis.systems.thresholds import system_thresholds
from squeal.linear.system import Term, TermSystem
from squeal.numerics.differentiation import Formula

ROWS = 420
MU = Formula("mu")


def _beside(block, moved, damping):
    """Two modes, stiffness `block` + mu `moved`, among others far above; damping (2,) and alike."""
    others = np.linspace(1e4, 2e4, ROWS - 2) ** 2
    stiffness = block_diag([block, diags_array(others)], format="csc")
    change = block_diag([moved, csc_array((ROWS - 2, ROWS - 2))], format="csc")
    C = diags_array(np.r_[damping, np.full(ROWS - 2, damping[0])], format="csc")
    return TermSystem(
        (Term(eye_array(ROWS, format="csc")),),
        (Term(C),),
        (Term(stiffness), Term(csc_array(change), MU)),
    )


@pytest.mark.parametrize("place", [0.25, 0.5, 0.7])
@pytest.mark.parametrize("c", [1e-4, 0.01, 0.1, 10.0])
def test_equally_damped_modes_flutter_where_they_have_parted_by_their_damping(place, c):
    """-omega^2 + i c omega = -(mean + i d) at d^2 = (g mu)^2 - (difference / 2)^2."""
    s = np.array([1e6, 1.1e6])
    half, mean = (s[1] - s[0]) / 2, s.mean()
    g = half / place
    system = _beside(np.diag(s), np.array([[0.0, g], [-g, 0.0]]), [c, c])
    found = system_thresholds(system, 1.0, wanted=Wanted(band=(100.0, 200.0)))
    exact = math.sqrt(half**2 + c**2 * mean) / g
    assert found.verdict == "stable"
    assert [p.kind for p in found.points] == ["flutter"]
    assert found.points[0].mu == pytest.approx(exact, rel=1e-9)
    assert found.crossings[0].frequency_hz == pytest.approx(math.sqrt(mean) / (2 * math.pi))
    assert not found.unconfirmed
    assert found.certified


@pytest.mark.parametrize("place", [0.25, 0.7])
@pytest.mark.parametrize("c", [0.1, 5.0])
def test_a_damped_root_diverges_where_its_stiffness_ends(place, c):
    system = _beside(np.diag([4.0, 900.0]), np.diag([-4.0 / place, 0.0]), [c, c])
    found = system_thresholds(system, 1.0, wanted=Wanted(band=(0.0, 20.0)))
    assert found.verdict == "stable"
    assert [p.kind for p in found.points] == ["divergence"]
    assert found.points[0].mu == pytest.approx(place)
    assert not found.unconfirmed
    assert found.certified


def test_a_root_that_leaves_the_band_crosses_the_axis_before():
    """Both between two values that a first look takes, 0.253 and 0.340."""
    exact, leaves, rise = 0.3, 0.32, 6e5
    system = _beside(np.diag([1e6, 3e6]), np.diag([rise, 0.0]), [1.0, 1.0])
    less = csc_array(([-1.0 / exact], ([0], [0])), shape=(ROWS, ROWS))
    system = TermSystem(system.M, (*system.C, Term(less, MU)), system.K)
    edge = math.sqrt(1e6 + rise * leaves) / (2 * math.pi)
    found = system_thresholds(system, 1.0, wanted=Wanted(band=(100.0, edge)))
    assert [c.direction for c in found.crossings] == ["up"]
    assert found.crossings[0].mu == pytest.approx(exact)


@pytest.mark.parametrize(("band", "verdict"), [((500.0, 600.0), "no root"), ((100, 200), "stable")])
def test_a_band_without_a_root_has_no_threshold(band, verdict):
    system = _beside(np.diag([1e6, 1.2e6]), np.diag([1e3, 0.0]), [1.0, 1.0])
    found = system_thresholds(system, 1.0, wanted=Wanted(band=band))
    assert (found.verdict, found.crossings, found.certified) == (verdict, (), True)
