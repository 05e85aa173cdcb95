"""A component that turns, against CalculiX's complex frequencies with Coriolis forces."""

import re
import shutil

import numpy as np
import pytest
import scipy.linalg

import squeal
from squeal.io.system_files import read_system
from tests.io.test_faces import STORE, Block, calculix

pytestmark = pytest.mark.skipif(not shutil.which("ccx"), reason="needs CalculiX (ccx)")
SPEED = 1000.0  # rad/s
AXIS = (1.0, 0.0, 0.0)
THROUGH = (0.0, 0.01, 0.0075)
MODES = 10


def turning_deck():
    """A shaft of square section, clamped at one end, and its centrifugal load."""
    shaft = Block("SHAFT", "C3D20", np.zeros(3), (0.1, 0.02, 0.015), (5, 2, 2), 1)
    clamped = [n for n, place in shaft.nodes.items() if abs(place[0]) < 1e-9]
    deck = [*shaft.cards(), "*NSET,NSET=CLAMPED", *(f"{n}," for n in clamped)]
    deck += ["*BOUNDARY", "CLAMPED,1,3"]
    about = ",".join(map(str, (*THROUGH, *AXIS)))
    return deck, ["*DLOAD", f"SHAFT,CENTRIF,{SPEED**2},{about}"]


def turned(path, preloaded):
    """A deck's matrices as a system that turns about its axis with the speed."""
    path.with_suffix(".yaml").write_text(
        f"M: {{file: {path.name}.mas, symmetric: true}}\n"
        f"K: {{file: {path.name}.sti, symmetric: true}}\ncoordinates: {{file: {path.name}.inp}}\n"
    )
    file = read_system(path.with_suffix(".yaml"))
    where = file.coordinates
    body = squeal.Component(file.system, np.array(where.names)[where.nodes], where.directions)
    return body.rotating(AXIS, "speed", {"speed": SPEED}, preloaded).system


def lowest(system):
    """The four lowest frequencies in Hz."""
    found = squeal.eigenvalues(system, band=(10.0, 10e3)).values.imag
    return np.sort(found[found > 0.0])[:4] / (2.0 * np.pi)


def projected(system, count):
    """Frequencies in Hz of the system on its lowest real modes, as CalculiX computes them."""
    M, C, K = system.arrays()
    _, modes = scipy.linalg.eigh(K, M, subset_by_index=(0, count - 1))
    stiffness = modes.T @ K @ modes
    coriolis = modes.T @ C @ modes
    states = np.block([[np.zeros((count, count)), np.eye(count)], [-stiffness, -coriolis]])
    rates = np.linalg.eigvals(states).imag
    return np.sort(rates[rates > 0.0]) / (2.0 * np.pi)


def test_frequencies_with_coriolis_forces_are_those_of_calculix(tmp_path):
    """CalculiX solves on its real modes: on as many of ours each printed digit is the same. All
    rows together, and the stress of the centrifugal load left out, move the frequencies little."""
    deck, load = turning_deck()
    turn = ["*STEP,NLGEOM", "*STATIC", *load, "*END STEP"]
    modes = ["*STEP,PERTURBATION", "*FREQUENCY,STORAGE=YES", f"{MODES}", "*END STEP"]
    coriolis = ["*STEP,PERTURBATION", "*COMPLEX FREQUENCY,CORIOLIS", f"{MODES}", *load]
    calculix(tmp_path, "turning", [*deck, *turn, *modes, *coriolis, "*END STEP"])
    calculix(tmp_path, "about", [*deck, *turn, "*STEP,PERTURBATION", *STORE[1:]])
    calculix(tmp_path, "rest", [*deck, *STORE])
    tables = (tmp_path / "turning.dat").read_text().split("E I G E N V A L U E   O U T P U T")
    rows = re.findall(r"^ +\d+ +\S+ +(\S+) +\S+ *$", tables[-1].split("P A R T")[0], re.MULTILINE)
    printed = np.array([float(row) for row in rows])
    about = turned(tmp_path / "about", preloaded=True)
    assert projected(about, MODES) == pytest.approx(printed, rel=2e-6)
    assert lowest(about) == pytest.approx(printed[:4], rel=5e-4)
    rest = turned(tmp_path / "rest", preloaded=False)
    assert lowest(rest) == pytest.approx(printed[:4], rel=5e-3)
