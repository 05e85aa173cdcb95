"""The brake of solids: rigid motion, mass, friction's direction, and a file that comes back."""

import numpy as np
import pytest
from scipy.linalg import eigvals

import squeal
from squeal.examples.brake import solid_brake, write_brake
from squeal.io.system_files import read_system
from squeal.queries.systems.roots import system_roots
from squeal.results.sources import EigenvalueSelection

PAD_NODES = 3 * 9 * 3  # the last ones: radial, along the pad, through it


@pytest.fixture(scope="module")
def brake():
    return solid_brake(600)


def test_friction_is_the_normal_force_along_the_motion(brake):
    """A pad that is pressed down is pulled along phi by the contact's force, the disc pushed."""
    at = brake.system.at
    K1 = at({"mu": 1.0})[2] - at({"mu": 0.0})[2]
    contact = at({"mu": 0.0, "contact": 1.0})[2] - at({"mu": 0.0, "contact": 0.0})[2]
    x, y, _ = brake.coordinates[brake.nodes].T
    radius = np.hypot(x, y)
    along = np.where(brake.directions == 0, -y / radius, 0.0)
    along += np.where(brake.directions == 1, x / radius, 0.0)
    pad = brake.nodes >= len(brake.coordinates) - PAD_NODES
    up = np.where(pad & (brake.directions == 2), 1.0, 0.0)
    force = contact @ up
    friction = K1 @ up
    assert friction @ (along * pad) == pytest.approx(force @ up, rel=1e-12)
    assert friction @ (along * ~pad) == pytest.approx(-(force @ up), rel=1e-12)


def test_it_squeals_with_friction_and_not_without(small):
    brake, growing = small
    assert any(500.0 < hertz < 8000.0 for hertz, _ in growing)
    wanted = EigenvalueSelection(band=(500.0, 8000.0))
    still = system_roots(brake.system.replace({"mu": 0.0}), wanted)
    loud = system_roots(brake.system.replace({"mu": 0.6}), wanted)
    assert (still.verdict, loud.verdict) == (None, "flutter")
    assert still.certified
    assert loud.certified


@pytest.fixture(scope="module")
def small():
    """A coarser brake, and as SciPy has them the frequencies (Hz) and rates of what grows."""
    brake = solid_brake(500, around=42)
    M, C, K = (matrix.toarray() for matrix in brake.system.at({"mu": 0.6}))
    n = len(M)
    lower = np.hstack([-np.linalg.solve(M, K), -np.linalg.solve(M, C)])
    roots = eigvals(np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), lower]))
    growing = roots[(roots.real > 0.1) & (roots.imag > 0.0)]
    return brake, [(root.imag / (2 * np.pi), root.real) for root in growing.tolist()]


@pytest.mark.parametrize("band", [(500.0, 8000.0), (9000.0, 11000.0)])
def test_growth_beside_the_band_is_known_to_scipy(small, band):
    """As the search passes it, and as a first look sees all up to twice the band's end."""
    brake, growing = small
    beside = [one for one in growing if not band[0] <= one[0] <= band[1]]
    look = squeal.sweep(brake.system, [0.5, 0.6, 0.7], band=band)
    for one in (None, look):
        told = squeal.eigenvalues(brake.system, 0.6, band=band, look=one).details
        fastest = told["fastest_outside"]
        hertz, rate = min(beside, key=lambda mode: abs(mode[0] - fastest["frequency_hz"]))
        assert fastest["frequency_hz"] == pytest.approx(hertz, rel=5e-3)
        assert fastest["growth_rate"] == pytest.approx(rate, rel=0.1)
        assert 0 < told["growing_outside"] <= len(beside)
    near = [(f, r) for f, r in beside if f < 1.95 * band[1] and r > 4e-3 * np.pi * f]
    assert told["growing_outside"] >= len(near)
    assert fastest["growth_rate"] >= 0.9 * max(rate for _, rate in near)


def test_it_is_written_and_read_back(brake, tmp_path):
    write_brake(tmp_path / "brake", brake)
    file = read_system(tmp_path / "brake" / "system.yaml")
    for one, other in zip(file.system.at({"mu": 0.3}), brake.system.at({"mu": 0.3}), strict=True):
        assert abs(one - other).max() <= 1e-12 * abs(other).max()
    assert file.coordinates is not None
    assert np.allclose(
        file.coordinates.places[file.coordinates.nodes], brake.coordinates[brake.nodes]
    )
