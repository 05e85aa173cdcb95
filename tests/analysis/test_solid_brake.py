"""The brake of solids: rigid motion, mass, friction's direction, and a file that comes back."""

import os
from pathlib import Path

import numpy as np
import pytest

from benchmarks.published_brake import REGION, read_definitions
from squeal.analysis.systems.roots import Wanted, system_roots
from squeal.analysis.systems.thresholds import system_thresholds
from squeal.io.system import read_system

pytest.importorskip("skfem")
from benchmarks.solid_brake import solid_brake, write_brake

PAD_NODES = 3 * 9 * 3  # the last ones: radial, along the pad, through it


@pytest.fixture(scope="module")
def brake():
    return solid_brake(600)


def test_friction_is_the_normal_force_along_the_motion(brake):
    """A pad that is pressed down is pulled along phi by the contact's force, the disc pushed."""
    at = brake.system.at
    K1 = at({"mu": 1.0})[2] - at({"mu": 0.0})[2]
    contact = at({"mu": 0.0, "contact": 1.0})[2] - at({"mu": 0.0, "contact": 0.0})[2]
    x, y, _ = brake.places[brake.nodes].T
    radius = np.hypot(x, y)
    along = np.where(brake.directions == 0, -y / radius, 0.0)
    along += np.where(brake.directions == 1, x / radius, 0.0)
    pad = brake.nodes >= len(brake.places) - PAD_NODES
    up = np.where(pad & (brake.directions == 2), 1.0, 0.0)
    force, friction = contact @ up, K1 @ up
    assert friction @ (along * pad) == pytest.approx(force @ up, rel=1e-12)
    assert friction @ (along * ~pad) == pytest.approx(-(force @ up), rel=1e-12)


def test_it_squeals_with_friction_and_not_without(brake):
    wanted = Wanted(band=(500.0, 8000.0))
    still = system_roots(brake.system, wanted, {"mu": 0.0})
    loud = system_roots(brake.system, wanted, {"mu": 0.6})
    assert (still.verdict, loud.verdict) == (None, "flutter")
    assert still.certified
    assert loud.certified


def test_it_is_written_and_read_back(brake, tmp_path):
    write_brake(tmp_path / "brake", brake)
    file = read_system(tmp_path / "brake" / "system.yaml")
    for one, other in zip(file.system.at({"mu": 0.3}), brake.system.at({"mu": 0.3}), strict=True):
        assert abs(one - other).max() <= 1e-12 * abs(other).max()
    assert file.coordinates is not None
    assert np.allclose(file.coordinates.places[file.coordinates.nodes], brake.places[brake.nodes])


# The published brake, where a folder with its matrices is named by SQUEAL_BRAKE

FOLDER = os.environ.get("SQUEAL_BRAKE", "")
needs_data = pytest.mark.skipif(not FOLDER, reason="SQUEAL_BRAKE names no folder")
WANTED = Wanted(region=REGION)


@pytest.fixture(scope="module")
def systems():
    return read_definitions(Path(FOLDER))


@needs_data
@pytest.mark.parametrize(
    ("name", "hertz"), [("article", []), ("program", [785, 2769]), ("mixed", [2775])]
)
def test_which_definition_squeals(name, hertz, systems):
    found = system_roots(systems[name], WANTED)
    assert found.certified
    growing = [e.frequency_hz for e in found.eigenvalues if e.value.real > 1e-3]
    assert [round(f) for f in growing] == hertz


@needs_data
def test_thresholds_are_certified_on_the_full_system(systems):
    found = system_thresholds(systems["program"], 25.1, 6.3, WANTED)
    assert found.certified
    assert not found.details["unconfirmed"]
    assert [round(c.frequency_hz) for c in found.crossings] == [817, 1607, 561]
