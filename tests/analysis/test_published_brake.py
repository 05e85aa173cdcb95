"""The published brake, where a folder with its matrices is named by SQUEAL_BRAKE."""

import os
from pathlib import Path

import numpy as np
import pytest

from benchmarks.published_brake import REGION, errors, projected, read_definitions, real_modes
from squeal.analysis.systems.roots import Wanted, system_roots
from squeal.analysis.systems.thresholds import system_thresholds
from squeal.sparse.quadratic import ScaledSystem

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
def test_the_error_of_real_modes_rises_early_with_the_program_alone(systems):
    rises = {}
    for name, system in systems.items():
        scaled = ScaledSystem(system)
        exact = [e.value for e in system_roots(system, WANTED).eigenvalues]
        vectors = real_modes(scaled, 60)
        few, more = (
            errors(np.array(exact), projected(scaled, np.linalg.qr(vectors[:, :d])[0], 4 * np.pi))
            for d in (20, 60)
        )
        rises[name] = more > few
    assert rises == {"article": False, "program": True, "mixed": True}


@needs_data
def test_thresholds_are_certified_on_the_full_system(systems):
    found = system_thresholds(systems["program"], 25.1, 6.3, WANTED)
    assert found.certified
    assert not found.unconfirmed
    assert [round(c.frequency_hz) for c in found.crossings] == [817, 1607, 561]
