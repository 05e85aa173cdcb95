"""Mode shapes on nodes and elements: what other programs read is what was computed."""

import itertools
import re

import numpy as np
import pytest

import squeal
from squeal.cli.main import main
from squeal.errors import InputError, InputWarning
from squeal.io.cells import CELLS as SOLIDS
from squeal.io.cells import outer_faces
from squeal.io.coordinates import read_coordinates, read_elements
from squeal.io.shapes import unit_displacements
from squeal.io.system_files import read_system

CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]


def at_height(z):
    """The corners of the unit square at a height."""
    return [(x, y, z) for x, y, _ in CORNERS]


def edges_of(faces):
    """The edges of all faces, each as its face runs through it."""
    edges: list[tuple[int, int]] = []
    for face in faces:
        following = (*face[1:], face[0])
        edges += zip(face, following, strict=True)
    return edges


PLACES = at_height(0.0) + at_height(0.5) + at_height(1.0)  # two cubes, one on the other
NODES = ["node,dof,x,y,z"]
for k, (x, y, z) in enumerate(PLACES):
    for dof in ("x", "y", "z") if z else ("fixed",):
        NODES.append(f"{10 * k + 5},{dof},{x},{y},{z}")
CELLS = [
    "element,type,node1,node2,node3,node4,node5,node6,node7,node8",
    "0,hexahedron,5,15,25,35,45,55,65,75",
    "1,hexahedron,45,55,65,75,85,95,105,115",
]


@pytest.fixture
def cubes(tmp_path):
    """A system of 24 rows on two cubes of which one face is held, damped unevenly."""
    rng = np.random.default_rng(3)
    n = 24
    A = rng.normal(size=(n, n))
    np.savez(tmp_path / "K.npz", A @ A.T + n * np.eye(n))
    np.savez(tmp_path / "C.npz", np.diag(rng.uniform(size=n)))
    np.savez(tmp_path / "M.npz", np.eye(n))
    parts = "".join(f"{X}: {{file: {X}.npz}}\n" for X in "MCK")
    tables = "coordinates: {file: nodes.csv}\nelements: {file: cells.csv}\n"
    (tmp_path / "system.yaml").write_text(parts + tables)
    (tmp_path / "nodes.csv").write_text("\n".join(NODES))
    (tmp_path / "cells.csv").write_text("\n".join(CELLS))
    return tmp_path / "system.yaml"


def expected(file, mode):
    u = unit_displacements(file.coordinates, mode.right)
    assert np.linalg.norm(u, axis=1).max() == pytest.approx(1.0)
    return dict(zip(file.coordinates.names, u, strict=True))


def test_vtk_holds_points_cells_and_complex_shapes(cubes, tmp_path, capsys):
    out = tmp_path / "modes.vtk"
    assert main(["eigenvalues", str(cubes), "--modes", "3", "--shapes", str(out)]) == 0
    file = read_system(cubes)
    words = iter(out.read_text().split("ASCII")[1].split())
    fields = {}
    for key in words:
        if key == "POINTS":
            count = int(next(words))
            next(words)
            fields[key] = np.array([float(next(words)) for _ in range(3 * count)]).reshape(-1, 3)
        elif key == "CELLS":
            rows = int(next(words))
            size = int(next(words))
            cells = np.array([int(next(words)) for _ in range(size)]).reshape(rows, -1)
        elif key == "VECTORS":
            name = next(words)
            next(words)
            fields[name] = np.array([float(next(words)) for _ in range(3 * count)]).reshape(-1, 3)
    names = file.coordinates.names
    places = dict(zip(names, fields["POINTS"].tolist(), strict=True))
    assert places == {str(10 * k + 5): list(p) for k, p in enumerate(PLACES)}
    read = [[names[k] for k in row[1:]] for row in cells.tolist()]
    assert read == [line.split(",")[2:] for line in CELLS[1:]]
    modes = squeal.eigenvalues(file, modes=3).eigenvalues
    for k, mode in enumerate(modes, 1):
        name = f"mode_{k}_{mode.frequency_hz:.6g}_Hz_"
        u = np.array(list(expected(file, mode).values()))
        assert fields[f"{name}real"] + 1j * fields[f"{name}imag"] == pytest.approx(u, abs=1e-8)
        assert fields[f"{name}phase"] == pytest.approx(np.degrees(np.angle(u)), abs=1e-6)


@pytest.mark.parametrize("damped", [True, False])
def test_universal_files_hold_nodes_elements_and_shapes(cubes, tmp_path, damped):
    if not damped:
        cubes.write_text(cubes.read_text().replace("C: {file: C.npz}\n", ""))
    file = read_system(cubes)
    out = tmp_path / "modes.unv"
    found = squeal.eigenvalues(file, modes=2)
    found.save_shapes(out)
    lines = out.read_text().splitlines()
    ends = [k for k, line in enumerate(lines) if line == "    -1"]
    pairs = zip(ends[::2], ends[1::2], strict=True)
    sets = [(int(lines[a + 1]), lines[a + 2 : b]) for a, b in pairs]
    assert [kind for kind, _ in sets] == [2411, 2412, 55, 55]
    nodes, elements, *shapes = [body for _, body in sets]
    places = {}
    for first, second in zip(nodes[::2], nodes[1::2], strict=True):
        places[int(first[:10])] = [float(x.replace("D", "e")) for x in second.split()]
    assert places == {10 * k + 5: list(p) for k, p in enumerate(PLACES)}
    assert [line.split() for line in elements[1::2]] == [c.split(",")[2:] for c in CELLS[1:]]
    assert {line.split()[1] for line in elements[::2]} == {"115"}  # solid linear brick
    for mode, body in zip(found.eigenvalues, shapes, strict=True):
        kind = [int(x) for x in body[5].split()]
        numbers = [float(x) for x in body[7].split()]
        assert kind == ([1, 3, 2, 8, 5, 3] if damped else [1, 2, 2, 8, 2, 3])
        value = complex(*numbers[:2]) if damped else 2j * np.pi * numbers[0]
        assert value == pytest.approx(mode.value, rel=1e-4)
        if damped:
            assert numbers[2:] == [0.0] * 4  # modal A and B: not known
        else:
            mass = 0.0  # of the unit matrix M
            for line in body[9::2]:
                mass += sum(float(line[k : k + 13]) ** 2 for k in range(0, len(line), 13))
            assert numbers[1:] == pytest.approx([mass, 0.0, 0.0], rel=1e-4)
        for label, row in zip(body[8::2], body[9::2], strict=True):
            u = np.array([float(row[k : k + 13]) for k in range(0, len(row), 13)])
            u = u[::2] + 1j * u[1::2] if damped else u
            assert u == pytest.approx(expected(file, mode)[label.strip()], abs=1e-5)


def test_two_names_of_one_number_are_two_nodes_of_a_universal_file(cubes, tmp_path):
    for name in ("nodes.csv", "cells.csv"):
        table = tmp_path / name
        table.write_text(re.sub(r"\b15\b", "005", table.read_text()))
    out = tmp_path / "modes.unv"
    squeal.eigenvalues(read_system(cubes), modes=1).save_shapes(out)
    nodes = out.read_text().split("    -1\n")[1].splitlines()[1:]
    assert [int(line[:10]) for line in nodes[::2]] == list(range(1, len(PLACES) + 1))


def test_faces_between_elements_are_no_outer_ones(cubes):
    where = read_system(cubes).coordinates
    assert len(outer_faces(where.cells)) == 10
    found = squeal.eigenvalues(read_system(cubes), modes=1)
    still, moved = found.plot(shape=1).collections
    assert len(still._segments3d) == 16  # edges of a box, upright ones in two parts
    assert len(moved.get_array()) == 10


WRONG = [
    (CELLS, CELLS[:2] + [CELLS[1]], "named once"),
    (CELLS, [CELLS[0], CELLS[1].replace(",5,", ",7,")], "7"),
    (CELLS, [CELLS[0], CELLS[1].replace(",5,", ",15,")], "8 different nodes"),
    (CELLS, [f"{CELLS[0]},{','.join('abcdef')}", "1,triangle,5,15,25,35,35,45"], "6 different"),
    (CELLS, [CELLS[0], CELLS[1].replace("hexahedron", "brick")], "hexahedron"),
    (NODES, NODES[1:], "no column"),
    (NODES, ["node,dof,x,y,z,z", *NODES[1:]], "2 columns z; one is allowed"),
    (NODES, [line.replace("fixed", "x") for line in NODES], "28 lines"),
    (
        NODES,
        [NODES[0]] + [line.replace(",y,", ",x,") for line in NODES[1:]],
        "2 rows for the displacement of the",
    ),
    (NODES, [*NODES[:-1], NODES[-1].replace(",1.0", ",7.0")], "the node 115 lies at two places"),
    (NODES, [*NODES, NODES[-1].replace(",z,", ",fixed,")], "the node 115 is fixed and has rows"),
]


@pytest.mark.parametrize(("table", "wrong", "words"), WRONG)
def test_a_wrong_table_of_nodes_or_elements_is_refused_by_its_name(cubes, table, wrong, words):
    name = "cells.csv" if table is CELLS else "nodes.csv"
    (cubes.parent / name).write_text("\n".join(wrong))
    with pytest.raises(InputError, match=words) as caught:
        read_system(cubes)
    assert name in str(caught.value)


INPUT = """*HEADING
** two kinds of element, a spring, a line that goes on in the next one
*Node, NSET=ALL
5, 0., 0.
15, 1.,,
25, 1., 1., 0.
35,0,1,0
45,0,0,1
55,1,0,1
65,1,1,1
75,0,1,1
*NODE PRINT, NSET=ALL
U,
*ELEMENT, type = C3D20R, ELSET=BLOCK
1, 5,15,25,35,45,55,65,
 75, 81,82,83,84,85,86,87,88,89,90,91,92
*ELEMENT, TYPE=SPRINGA
9, 5, 15
*ELEMENT, TYPE=S4R5
2, 5,15,25,35
"""


def of_input(path):
    labels = [(10 * k + 5, way) for k in range(8) for way in (1, 2, 3)]
    return read_elements(path, read_coordinates(path, 24, labels))


def test_the_input_file_of_abaqus_names_nodes_and_elements(tmp_path):
    (tmp_path / "job.inp").write_text(INPUT)
    where = of_input(tmp_path / "job.inp")
    places = dict(zip(where.names, where.places.tolist(), strict=True))
    assert places == {str(10 * k + 5): [*map(float, PLACES[k][:2]), float(k > 3)] for k in range(8)}
    corners = [(kind, [where.names[k] for k in cell]) for kind, cell in where.cells]
    assert corners == [
        ("hexahedron", [str(10 * k + 5) for k in range(8)]),
        ("quad", ["5", "15", "25", "35"]),
    ]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("*HEADING", "*INSTANCE, NAME=A", "line 1: .INSTANCE"),
        ("15, 1.,,", "15, 1., a", r"5\.y: .a"),
        ("*Node,", "*NODE, SYSTEM=C,", "line 3"),
    ],
)
def test_an_input_file_that_would_mislead_is_refused(tmp_path, old, new, words):
    (tmp_path / "job.inp").write_text(INPUT.replace(old, new, 1))
    with pytest.raises(InputError, match=words) as caught:
        of_input(tmp_path / "job.inp")
    assert "job.inp" in str(caught.value)


def test_an_internal_node_without_a_place_is_warned_of(tmp_path):
    """C3D8I, and shells that CalculiX expands, have rows of nodes that no file lists."""
    (tmp_path / "job.inp").write_text(INPUT)
    with pytest.warns(InputWarning, match="no line for 1 nodes of the matrices, the first is 900"):
        found = read_coordinates(tmp_path / "job.inp", 3, [(5, 1), (900, 1), (15, 2)])
    assert found.directions.tolist() == [0, -1, 1]
    with pytest.raises(InputError, match="no line for 2 nodes"):
        read_coordinates(tmp_path / "job.inp", 2, [(900, 1), (901, 1)])


def test_included_files_are_read_in_their_places(tmp_path):
    mesh = INPUT.splitlines(keepends=True)
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "mesh.inp").write_text("".join(mesh[2:]))
    (tmp_path / "parts" / "job.inp").write_text("".join(mesh[:2]) + "*include, input=mesh.inp\n")
    (tmp_path / "whole.inp").write_text(INPUT)
    one = of_input(tmp_path / "parts" / "job.inp")
    other = of_input(tmp_path / "whole.inp")
    assert (one.names, one.cells) == (other.names, other.cells)
    (tmp_path / "a.inp").write_text("*INCLUDE, INPUT=b.inp\n")
    (tmp_path / "b.inp").write_text("*INCLUDE, INPUT=a.inp\n")
    with pytest.raises(InputError, match="includes itself"):
        of_input(tmp_path / "a.inp")
    (tmp_path / "a.inp").write_text("*INCLUDE, INPUT=nothing.inp\n")
    with pytest.raises(InputError, match=r"nothing\.inp"):
        of_input(tmp_path / "a.inp")


def test_a_line_of_an_included_file_is_named_by_its_own_file_and_number(tmp_path):
    (tmp_path / "a.inp").write_text("*NODE\n1,0,0,0\n*INCLUDE, INPUT=b.inp\n3,x,0,0\n")
    (tmp_path / "b.inp").write_text("** nodes of the pad\n2,1,y,0\n")
    with pytest.raises(InputError, match=r"b\.inp: line 2\.y: 'y' is not allowed"):
        of_input(tmp_path / "a.inp")
    (tmp_path / "b.inp").write_text("** nodes of the pad\n2,1,0,0\n")
    with pytest.raises(InputError, match=r"a\.inp: line 4\.x: 'x' is not allowed"):
        of_input(tmp_path / "a.inp")


def test_files_of_shapes_need_coordinates_and_a_known_suffix(cubes, tmp_path):
    with pytest.raises(InputError, match=r"\.vtk or \.unv"):
        squeal.eigenvalues(read_system(cubes)).save_shapes(tmp_path / "modes.stl")
    with pytest.raises(InputError, match="coordinates"):
        squeal.eigenvalues(squeal.System([[1.0]], K=[[1.0]])).save_shapes(tmp_path / "modes.vtk")


@pytest.mark.parametrize("name", ["tetra", "wedge", "hexahedron"])
def test_faces_of_a_solid_close_it(name):
    """Each edge belongs to two faces, which run through it in opposite ways; all face outwards."""
    faces = SOLIDS[name].faces
    edges = edges_of(faces)
    assert len(set(edges)) == len(edges)
    assert {(b, a) for a, b in edges} == set(edges)
    assert set(itertools.chain(*faces)) == set(range(SOLIDS[name].corners))
    corners = len(edges) // 2 - len(faces) + 2  # Euler
    assert corners == SOLIDS[name].corners


def test_rotations_and_internal_rows_move_no_node(tmp_path):
    (tmp_path / "nodes.csv").write_text("node,x,y,z\n7,0,0,0\n9,1,0,0\n")
    labels = [(7, 1), (7, 4), (9, 2), (-3, 1), (9, 6)]
    found = unit_displacements(
        read_coordinates(tmp_path / "nodes.csv", 5, labels), np.arange(1.0, 6)
    )
    assert (found != 0).sum() == 2
    assert found[0, 0] / found[1, 1] == pytest.approx(1 / 3)


def test_real_parts_of_displacements_are_as_large_as_any_turn_makes_them(cubes):
    file = read_system(cubes)
    rng = np.random.default_rng(4)
    shape = rng.normal(size=24) + 0.3j * rng.normal(size=24)
    found = unit_displacements(file.coordinates, np.exp(1.1j) * shape)
    turned = found * np.exp(1j * np.linspace(0.1, 3.0, 30))[:, None, None]
    assert np.all(np.linalg.norm(turned.real, axis=(1, 2)) < np.linalg.norm(found.real))


# of each kind its places in the order of VTK, numbers of VTK's manual and of UNV's dataset 2412
UNIT = {
    "triangle": ([(0, 0, 0), (1, 0, 0), (0, 1, 0)], 5, 91, 0.0),
    "quad": (CORNERS, 9, 94, 0.0),
    "tetra": ([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], 10, 111, 1 / 6),
    "wedge": (
        [(0, 0, 1), (1, 0, 1), (0, 1, 1), (0, 0, 0), (1, 0, 0), (0, 1, 0)],
        13,
        112,
        1 / 2,
    ),
    "hexahedron": (at_height(0) + at_height(1), 12, 115, 1.0),
}


@pytest.mark.parametrize("kind", UNIT)
def test_faces_close_a_volume(kind):
    """Each edge of a solid belongs to two faces, which pass it in opposite senses."""
    places, vtk, unv, volume = UNIT[kind]
    cell = SOLIDS[kind]
    assert (cell.corners, cell.vtk, cell.unv) == (len(places), vtk, unv)
    assert set(itertools.chain(*cell.faces)) == set(range(cell.corners))
    edges = edges_of(cell.faces)
    assert len({*edges}) == len(edges)
    if volume:
        assert {*edges} == {(b, a) for a, b in edges}
    x = np.array(places, dtype=float)
    found = 0.0
    for face in cell.faces:  # pyramids with the origin
        found += sum(np.linalg.det(x[[face[0], a, b]]) for a, b in itertools.pairwise(face))
    assert abs(found) / 6 == pytest.approx(volume, abs=1e-12)
