"""A small rotor against ROSS: `tests/data/rotor.py` says how its numbers were made."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import coo_array

from squeal.analysis.systems.roots import system_roots
from squeal.linear.system import Term, TermSystem
from squeal.numerics.differentiation import Formula

DATA = json.loads((Path(__file__).parent.parent / "data" / "rotor.json").read_text("utf-8"))


@pytest.fixture(scope="module")
def rotor():
    n = DATA["rows"]
    parts = {}
    for name, entries in DATA["matrices"].items():
        rows, columns, values = zip(*entries, strict=True)
        parts[name] = coo_array((values, (rows, columns)), shape=(n, n)).toarray()
    assert np.array_equal(parts["G"], -parts["G"].T)
    C = (Term(parts["C"]), Term(parts["G"], Formula("speed")))
    return TermSystem((Term(parts["M"]),), C, (Term(parts["K"]),), {"speed": 0.0}, "speed")


@pytest.mark.parametrize("speed", DATA["eigenvalues"])
def test_eigenvalues_are_those_of_ross(rotor, speed):
    theirs = np.array([complex(*v) for v in DATA["eigenvalues"][speed]])
    found = system_roots(rotor, changes={"speed": float(speed)})
    ours = np.array([e.value for e in found.eigenvalues if abs(e.value) > 1.0])
    assert len(ours) == len(theirs) == 32
    nearest = np.argmin(np.abs(theirs[:, None] - ours), axis=1)
    assert len(set(nearest)) == len(theirs)
    assert np.allclose(ours[nearest], theirs, rtol=1e-9)
    assert found.verdict == "flutter"  # the bearings drive a whirl
    assert np.max(ours.real) == pytest.approx(np.max(theirs.real), rel=1e-7)
