"""A component that turns, against CalculiX's complex frequencies with Coriolis forces."""

import re
import shutil

import numpy as np
import pytest

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
    """The lowest frequencies of the matrices of a deck, turned here."""
    path.with_suffix(".yaml").write_text(
        f"M: {{file: {path.name}.mas, symmetric: true}}\n"
        f"K: {{file: {path.name}.sti, symmetric: true}}\ncoordinates: {{file: {path.name}.inp}}\n"
    )
    file = read_system(path.with_suffix(".yaml"))
    where = file.coordinates
    body = squeal.Component(file.system, np.array(where.names)[where.nodes], where.directions)
    system = body.rotating(AXIS, "speed", {"speed": SPEED}, preloaded).system
    found = squeal.eigenvalues(system, band=(100.0, 10e3)).values.imag
    return np.sort(found[found > 0.0])[:4] / (2.0 * np.pi)


def test_frequencies_with_coriolis_forces_are_those_of_calculix(tmp_path):
    """CalculiX projects on its modes, and prints frequencies of its own that depend on how many
    these are. The lowest ones are ours; without the stress of the load, which the matrices at rest
    do not have, they are a little lower."""
    deck, load = turning_deck()
    turn = ["*STEP,NLGEOM", "*STATIC", *load, "*END STEP"]
    modes = ["*STEP,PERTURBATION", "*FREQUENCY,STORAGE=YES", f"{MODES}", "*END STEP"]
    coriolis = ["*STEP,PERTURBATION", "*COMPLEX FREQUENCY,CORIOLIS", "8", *load, "*END STEP"]
    calculix(tmp_path, "turning", [*deck, *turn, *modes, *coriolis])
    calculix(tmp_path, "about", [*deck, *turn, "*STEP,PERTURBATION", *STORE[1:]])
    calculix(tmp_path, "rest", [*deck, *STORE])
    tables = (tmp_path / "turning.dat").read_text().split("E I G E N V A L U E   O U T P U T")
    rows = re.findall(r"^ +\d+ +\S+ +(\S+) +\S+ *$", tables[-1].split("P A R T")[0], re.MULTILINE)
    printed = np.array([float(row) for row in rows])
    about = turned(tmp_path / "about", preloaded=True)
    rest = turned(tmp_path / "rest", preloaded=False)
    nearest = printed[np.abs(about[:, None] - printed).argmin(axis=1)]
    assert about == pytest.approx(nearest, rel=2e-5)
    assert rest == pytest.approx(nearest, rel=2e-3)
