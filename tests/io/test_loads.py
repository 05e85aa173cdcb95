"""Loads from decks: closed forms, and the displacements that CalculiX prints under them."""

import re
import shutil

import numpy as np
import pytest
from scipy.sparse import csc_array
from scipy.sparse.linalg import spsolve

import squeal
from squeal.errors import InputError, InputWarning
from squeal.io.loads import pressure_load, read_load
from squeal.io.system_files import read_system
from squeal.sparse.contact_faces import Surface, forces_of_pressure
from tests.io.test_faces import STORE, Block, calculix

needs_calculix = pytest.mark.skipif(not shutil.which("ccx"), reason="needs CalculiX (ccx)")
PRESSURE = 3.0e6  # Pa
TRIANGLE = [(0, 0), (2, 0), (0, 3), (1, 0), (1, 1.5), (0, 1.5)]
RECTANGLE = [(0, 0), (2, 0), (2, 3), (0, 3), (1, 0), (2, 1.5), (1, 3), (0, 1.5)]


@pytest.mark.parametrize(
    ("places", "shares"),
    [
        (TRIANGLE[:3], 3 * [1 / 3]),
        (RECTANGLE[:4], 4 * [1 / 4]),
        (TRIANGLE, [*(3 * [0.0]), *(3 * [1 / 3])]),
        (RECTANGLE, [*(4 * [-1 / 12]), *(4 * [1 / 3])]),
    ],
)
def test_nodes_of_a_face_carry_their_shares_of_a_pressure(places, shares):
    """Consistent nodal forces (Zienkiewicz, Taylor & Zhu), along the inward normal."""
    area = 3.0 if len(places) in (3, 6) else 6.0
    labels = [f"n{i}" for i in range(len(places))]
    at = {label: (x, y, 0.0) for label, (x, y) in zip(labels, places, strict=True)}
    forces = forces_of_pressure(Surface([labels], at))
    found = np.array([forces[label] for label in labels])
    wanted = np.zeros((len(places), 3))
    wanted[:, 2] = -area * np.array(shares)
    assert found == pytest.approx(wanted, abs=1e-12)


LOADED = {
    "faces of elements": ["*DLOAD", f"TOP,P2,{PRESSURE}"],
    "a surface": ["*DSLOAD", f"ABOVE,P,{PRESSURE}"],
    "a set of nodes and a node": ["*CLOAD", "UPPER,3,-40.", "UPPER,1,5.", "{last},2,70."],
    "all of them": ["*DLOAD,OP=NEW", f"TOP,P2,{PRESSURE}", "*CLOAD", "UPPER,2,11."],
}


@needs_calculix
@pytest.mark.parametrize("element", ["C3D8", "C3D20"])
@pytest.mark.parametrize("loads", LOADED)
def test_displacements_under_a_load_of_a_deck_are_those_of_calculix(tmp_path, loads, element):
    size = (0.06, 0.04, 0.02)
    block = Block("TOP", element, np.zeros(3), size, (3, 2, 1), 1)
    upper = block.layer(size[2])
    deck = [*block.cards(), "*NSET,NSET=CLAMPED", *(f"{n}," for n in block.layer(0.0))]
    deck += ["*NSET,NSET=UPPER", *(f"{n}," for n in upper)]
    deck += ["*SURFACE,NAME=ABOVE,TYPE=ELEMENT", "TOP,S2", "*BOUNDARY", "CLAMPED,1,3"]
    cards = [line.format(last=upper[-1]) for line in LOADED[loads]]
    step = ["*STEP", "*STATIC", *cards, "*NODE PRINT,NSET=ALL", "U", "*END STEP"]
    calculix(tmp_path, "pressed", [*deck, *step])
    calculix(tmp_path, "block", [*deck, *STORE])
    (tmp_path / "block.yaml").write_text(
        "M: {file: block.mas, symmetric: true}\nK: {file: block.sti, symmetric: true}\n"
        "coordinates: {file: block.inp}\nelements: {file: block.inp}\n"
    )
    file = read_system(tmp_path / "block.yaml")
    where = file.coordinates
    body = squeal.Component(
        file.system, np.array(where.names)[where.nodes], where.directions, where.places[where.nodes]
    )
    load = read_load(tmp_path / "pressed.inp", body, where)
    if loads in ("faces of elements", "a surface"):
        total = load[where.directions == 2].sum()
        assert total == pytest.approx(-PRESSURE * size[0] * size[1], rel=1e-12)
        assert load == pytest.approx(PRESSURE * pressure_load(body, where, "above"))
    moved = where.displacements(spsolve(csc_array(file.system.at()[2]), load))
    text = (tmp_path / "pressed.dat").read_text()
    printed = {}
    for node, *values in re.findall(r"^ +(\d+) +(\S+) +(\S+) +(\S+)$", text, re.MULTILINE):
        printed[node] = [float(value) for value in values]
    wanted = np.array([printed[name] for name in where.names])
    assert moved == pytest.approx(wanted, abs=2e-6 * np.abs(wanted).max())


@pytest.fixture
def cube(tmp_path):
    """A component of one brick, its lower nodes held."""
    places = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    places += [(0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    deck = ["*NODE,NSET=N", *(f"{i},{x},{y},{z}" for i, (x, y, z) in enumerate(places, 1))]
    deck += ["*ELEMENT,TYPE=C3D8,ELSET=E", "7,1,2,3,4,5,6,7,8", "*SURFACE,NAME=HIGH", "E,S2"]
    table = ["node,dof,x,y,z"]
    for i, (x, y, z) in enumerate(places, 1):
        words = "xyz" if z else ["fixed"]
        table += [f"{i},{word},{x},{y},{z}" for word in words]
    (tmp_path / "cube.inp").write_text("\n".join(deck))
    (tmp_path / "cube.csv").write_text("\n".join(table))
    np.savez(tmp_path / "one.npz", np.eye(12))
    (tmp_path / "cube.yaml").write_text(
        "M: {file: one.npz}\nK: {file: one.npz}\n"
        "coordinates: {file: cube.csv}\nelements: {file: cube.inp}\n"
    )
    return tmp_path


def assembly(folder, load):
    path = folder / "both.yaml"
    path.write_text(
        "parameters: {pressure: 2.0e6}\n"
        "components:\n  one: {file: cube.yaml}\n"
        f"  other: {{file: cube.yaml, load: {load}}}\n"
        "contact:\n  - {between: [one, other], distance: 0.1, normal: [0, 0, 1], stiffness: 5.0,"
        " bonded: true}\n"
    )
    return path


@pytest.mark.filterwarnings("ignore:.*no matrix depends on pressure")  # in a deck without a factor
@pytest.mark.parametrize(
    ("load", "deck"),
    [
        ("{surface: HIGH, factor: pressure}", []),
        ("{file: load.inp}", ["*DSLOAD", "HIGH,P,2.0e6"]),
        ("{file: load.inp, factor: pressure/2}", ["*DLOAD", "E,P2,1.0", "7,p2,1.0"]),
        ("{file: load.inp, factor: pressure/4}", ["*CLOAD", "N,3,-1."]),
        (  # a node that is twice in a set takes one force
            "{file: load.inp, factor: pressure/4}",
            ["*NSET,NSET=TWICE", "N,N", "*CLOAD", "TWICE,3,-1."],
        ),
    ],
)
def test_an_assembly_takes_a_pressure(cube, load, deck):
    text = (cube / "cube.inp").read_text()
    (cube / "load.inp").write_text("\n".join([text, "*STEP", "*STATIC", *deck, "*END STEP"]))
    other = squeal.read_system(assembly(cube, load)).assembly.components[1]
    of_z = other.load[other.directions == 2]
    assert of_z == pytest.approx(4 * [-0.5e6])
    assert other.load.sum() == pytest.approx(-2.0e6)


@pytest.mark.filterwarnings("ignore:.*TRANSFORM. rows are taken")
@pytest.mark.parametrize(
    ("cards", "words"),
    [
        (["*STATIC"], r"no load; \*CLOAD, \*DLOAD, \*DSLOAD are read"),
        (["*CLOAD", "99,3,1."], "99 is neither a node of other nor a set of such"),
        (["*CLOAD", "E,3,1."], "E is neither a node of other nor a set of such"),
        (["*CLOAD", "7,5,1."], "5 is not read; it must be 1 to 3, a force"),
        (["*CLOAD", "7,3"], "where, which and how much are needed"),
        (["*CLOAD", "7,3,one"], "one"),
        (["*CLOAD,AMPLITUDE=A", "7,3,1."], "AMPLITUDE=A is not read"),
        (["*DLOAD", "E,GRAV,9.81,0.,0.,-1."], "GRAV is not read; it must be P or P1 to P6"),
        (["*DLOAD", "E,23,1."], "23 is not read; it must be P or P1 to P6"),
        (["*DLOAD", "E,P9,1."], "S9 is no face of a hexahedron; it must be S1 to S6"),
        (["*DLOAD", "F,P1,1."], "F is neither an element with faces nor a set of such"),
        (["*DSLOAD", "LOW,P,1."], "names the surfaces: HIGH"),
        (["*DSLOAD", "HIGH,PU,1."], "PU is not read; it must be P, a pressure"),
        (
            ["*CLOAD", "7,3,1.", "*END STEP", "*STEP", "*CLOAD", "7,3,1."],
            "a second step with loads",
        ),
        (["*CLOAD", "7,3,1.", "*BOUNDARY", "8,3,3,-1.e-3"], r"\*BOUNDARY loads it too"),
        (["*CLOAD", "7,3,1.", "*TEMPERATURE", "N,80."], r"\*TEMPERATURE loads it too"),
        (["*TRANSFORM,NSET=N", "0,1,0,-1,0,0", "*CLOAD", "7,3,1."], r"\*TRANSFORM is not allowed"),
    ],
)
def test_a_load_that_is_not_read_is_refused_in_a_sentence(cube, cards, words):
    text = (cube / "cube.inp").read_text()
    (cube / "load.inp").write_text("\n".join([text, "*STEP", *cards, "*END STEP"]))
    with pytest.raises(InputError, match=words):
        squeal.read_system(assembly(cube, "{file: load.inp}"))


@pytest.mark.filterwarnings("ignore:.*no matrix depends on pressure")
def test_a_load_may_hold_nodes_where_they_are(cube):
    cards = ["*STEP", "*BOUNDARY", "1,1,3", "2,1,3,0.", "*CLOAD", "7,3,1.", "*END STEP"]
    (cube / "load.inp").write_text("\n".join(cards))
    other = squeal.read_system(assembly(cube, "{file: load.inp}")).assembly.components[1]
    assert other.load.sum() == 1.0


@pytest.mark.parametrize("load", ["{file: load.inp, surface: HIGH}", "{factor: pressure}"])
def test_a_load_has_either_a_file_or_a_surface(cube, load):
    with pytest.raises(InputError, match=r"is not allowed beside file|missing"):
        squeal.read_system(assembly(cube, load))


def test_rows_of_a_load_are_those_of_the_matrices_beside_supports(tmp_path):
    np.savez(tmp_path / "m.npz", np.eye(3))
    np.savez(tmp_path / "k.npz", np.diag([1.0, 1e20, 2.0]))
    (tmp_path / "n.csv").write_text("node,dof,x,y,z\n1,z,0,0,0\n2,z,1,0,0\n3,z,2,0,0\n")
    (tmp_path / "load.csv").write_text("row,force\n2,-5\n3,-7\n")
    (tmp_path / "s.yaml").write_text(
        "M: {file: m.npz}\nK: {file: k.npz}\ncoordinates: {file: n.csv}\n"
    )
    with pytest.warns(InputWarning, match="the first is row 2"):
        file = read_system(tmp_path / "s.yaml")
    body = squeal.Component(file.system, ["1", "3"], [2, 2])
    load = read_load(tmp_path / "load.csv", body, file.coordinates)
    assert load.tolist() == [0.0, -7.0]
