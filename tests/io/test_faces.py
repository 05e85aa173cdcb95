"""Contact between faces of meshes that do not match, against CalculiX's own contact."""

import math
import shutil
import subprocess

import numpy as np
import pytest

import squeal
from squeal.cli.main import main
from squeal.errors import InputError
from squeal.io.components import _table_of_pairs, write_points
from squeal.io.coordinates import read_coordinates, read_elements
from squeal.io.surfaces import read_surface
from squeal.sparse.contact_faces import (
    SHAPES,
    ContactPoints,
    Surface,
    _quad_rule,
    _triangle_rule,
    contact_between_faces,
)
from squeal.sparse.contact_seat import pair_directions
from tests.io.test_brake_from_mesh import lowest, script  # noqa: F401  of the documentation

needs_calculix = pytest.mark.skipif(not shutil.which("ccx"), reason="needs CalculiX (ccx)")
pytestmark = pytest.mark.filterwarnings("ignore::squeal.errors.InputWarning")
STIFFNESS = 1.0e11  # N/m^3
PRESS = 1.0e6  # Pa
STORE = ["*STEP", "*FREQUENCY,SOLVER=MATRIXSTORAGE", "1", "*END STEP"]


class Block:
    """A block of bricks of 8 or 20 nodes in the order of CalculiX; `first` numbers its nodes."""

    def __init__(self, name, element, low, high, divisions, first):
        self.name = name
        self.element = element
        self.first = first
        step = 2 if element.startswith("C3D20") else 1
        counts = step * np.array(divisions)
        numbers = {}
        self.nodes: dict[int, np.ndarray] = {}
        for where in np.ndindex(*(counts + 1)):
            if step == 2 and sum(index % 2 for index in where) > 1:
                continue  # centres of faces and bricks have no node
            numbers[where] = first + len(self.nodes)
            self.nodes[numbers[where]] = low + (np.array(high) - low) * where / counts
        corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
        corners += [(0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
        edges = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4)]
        edges += [(0, 4), (1, 5), (2, 6), (3, 7)]
        places = [2 * np.array(corner) for corner in corners]
        if step == 2:
            places += [(places[i] + places[j]) // 2 for i, j in edges]
        else:
            places = [place // 2 for place in places]
        self.elements: dict[int, list[int]] = {}
        for cell in np.ndindex(*divisions):
            number = first + len(self.elements)
            origin = step * np.array(cell)
            self.elements[number] = [numbers[tuple(origin + place)] for place in places]

    def layer(self, height):
        return [n for n, place in self.nodes.items() if abs(place[2] - height) < 1e-9]

    def cards(self):
        lines = ["*NODE,NSET=ALL"]
        lines += [f"{n},{x:.12g},{y:.12g},{z:.12g}" for n, (x, y, z) in self.nodes.items()]
        lines.append(f"*ELEMENT,TYPE={self.element},ELSET={self.name}")
        for number, nodes in self.elements.items():
            cells = [str(number), *map(str, nodes)]
            if len(cells) > 11:  # goes on in the next line
                lines.append(",".join(cells[:11]) + ",")
                cells = cells[11:]
            lines.append(",".join(cells))
        lines += [f"*MATERIAL,NAME=M{self.name}", "*ELASTIC", "2.0e10,0.3", "*DENSITY", "4000."]
        return [*lines, f"*SOLID SECTION,ELSET={self.name},MATERIAL=M{self.name}"]

    def face_areas(self, height):
        """The nodal forces of a pressure of 1 on the face at a height, by squeal-free formulas:
        a quarter to each corner of C3D8, -1/12 to corners and 1/3 to middles of C3D20."""
        forces = dict.fromkeys(self.layer(height), 0.0)
        for nodes in self.elements.values():
            on_face = [n for n in nodes if n in forces]
            if len(on_face) not in (4, 8):
                continue
            corners = [n for n in nodes[:8] if n in forces]
            spread = np.ptp([self.nodes[n] for n in corners], axis=0)
            area = spread[0] * spread[1]
            of_corner = 0.25 if len(on_face) == 4 else -1 / 12
            for node in on_face:
                share = of_corner if node in corners else 1 / 3
                forces[node] += share * area
        return forces


def springs(block, height):
    """Springs of 1e6 N/m that hold a layer along x and y, and one of 1e5 N/m along z."""
    lines = []
    number = 50_000
    for way, stiffness in ((1, 1e6), (2, 1e6), (3, 1e5)):
        lines.append(f"*ELEMENT,TYPE=SPRING1,ELSET=HOLD{way}")
        for node in block.layer(height):
            number += 1
            lines.append(f"{number},{node}")
        lines += [f"*SPRING,ELSET=HOLD{way}", f"{way}", f"{stiffness:.6e}"]
    return lines


def calculix(folder, name, lines):
    (folder / f"{name}.inp").write_text("\n".join(lines) + "\n")
    subprocess.run(["ccx", name], cwd=folder, check=True, stdout=subprocess.DEVNULL)


def frequencies(folder, name):
    text = (folder / f"{name}.dat").read_text()
    table = text.split("E I G E N V A L U E   O U T P U T")[-1].split("P A R T I C I P A T I O N")
    rows = [line.split() for line in table[0].splitlines()]
    return np.array([float(row[3]) for row in rows if len(row) == 5 and row[0].isdecimal()])


def blocks_from_decks(folder, below, above, cutoff=""):
    """Three by three bricks below two by two, joined by squeal; the deck of CalculiX beside it."""
    base = Block("BASE", below, np.zeros(3), (0.06, 0.06, 0.02), (3, 3, 1), 1)
    top = Block("TOP", above, np.array([0.01, 0.01, 0.02]), (0.05, 0.05, 0.04), (2, 2, 1), 10_001)
    clamped = ["*NSET,NSET=CLAMPED", *(f"{n}," for n in base.layer(0.0))]
    held = ["*BOUNDARY", "CLAMPED,1,3"]
    surfaces = ["*SURFACE,NAME=UPPER,TYPE=ELEMENT"]
    surfaces += [f"{number},S2" for number in base.elements]
    under = ["*ELSET,ELSET=UNDER", *(f"{number}," for number in top.elements)]
    under += ["*SURFACE,NAME=LOWER,TYPE=ELEMENT", "UNDER,S1"]
    loads = {n: -PRESS * area for n, area in top.face_areas(0.04).items()}
    whole = [*base.cards(), *clamped, *surfaces, *top.cards(), *under, *springs(top, 0.04), *held]
    whole += ["*SURFACE INTERACTION,NAME=TOUCH", "*SURFACE BEHAVIOR,PRESSURE-OVERCLOSURE=LINEAR"]
    whole += [f"{STIFFNESS:e},1.e-3"]
    whole += ["*CONTACT PAIR,INTERACTION=TOUCH,TYPE=SURFACE TO SURFACE", "LOWER,UPPER"]
    whole += ["*STEP,NLGEOM", "*STATIC", "*CLOAD", *(f"{n},3,{x:.9e}" for n, x in loads.items())]
    whole += ["*END STEP", "*STEP,PERTURBATION", "*FREQUENCY", "6", "*END STEP"]
    calculix(folder, "base", [*base.cards(), *clamped, *surfaces, *held, *STORE])
    calculix(folder, "top", [*top.cards(), *under, *springs(top, 0.04), *STORE])
    for name in ("base", "top"):
        (folder / f"{name}.yaml").write_text(
            f"M: {{file: {name}.mas, symmetric: true}}\nK: {{file: {name}.sti, symmetric: true}}\n"
            f"coordinates: {{file: {name}.inp}}\nelements: {{file: {name}.inp}}\n"
        )
    lines = ["node,dof,force", *(f"{n},z,{x:.9e}" for n, x in loads.items())]
    (folder / "load.csv").write_text("\n".join(lines))
    path = folder / "joined.yaml"
    path.write_text(
        "components:\n  base: {file: base.yaml}\n"
        "  top: {file: top.yaml, load: {file: load.csv}}\n"
        "contact:\n  - between: [base, top]\n    faces: [upper, LOWER]\n    distance: 1e-4\n"
        f"    stiffness: {STIFFNESS:g}\n{cutoff}"
    )
    return path, whole


def six_lowest(joined):
    """Frequencies of six roots."""
    found = np.sort(squeal.eigenvalues(joined.system, band=(0.0, 30e3)).values.imag)
    return found[found > 0.0][:6] / (2.0 * np.pi)


@needs_calculix
@pytest.mark.parametrize(
    ("below", "above"), [("C3D8", "C3D8"), ("C3D20", "C3D8"), ("C3D20", "C3D20")]
)
def test_blocks_of_other_meshes_have_the_frequencies_of_calculix(tmp_path, below, above):
    """Of linear and quadratic shape functions."""
    path, whole = blocks_from_decks(tmp_path, below, above)
    calculix(tmp_path, "whole", whole)
    joined = squeal.read_system(path).assembly
    assert joined.contacts[0].area.sum() == pytest.approx(0.04**2, rel=1e-12)
    assert six_lowest(joined) == pytest.approx(frequencies(tmp_path, "whole"), rel=1.5e-3)


@needs_calculix
def test_an_export_of_reduced_blocks_joins_the_same_points_again(tmp_path):
    path, _ = blocks_from_decks(tmp_path, "C3D8", "C3D8", "cutoff: 20000\n")
    joined = squeal.read_system(path).assembly
    assert main(["export", str(path), "--output", str(tmp_path / "small")]) == 0
    again = squeal.read_system(tmp_path / "small" / "assembly.yaml").assembly
    assert again.system.n == joined.system.n < 102  # without a cutoff
    assert six_lowest(again) == pytest.approx(six_lowest(joined), rel=1e-9)
    assert again.seats[0].forces == pytest.approx(joined.seats[0].forces, rel=1e-6)


def turned(brake, angle):
    """The brake with its pad moved round the axis, so that no node meets another."""
    cosine = np.cos(angle)
    sine = np.sin(angle)
    for node, (x, y, z) in brake.pad.items():
        brake.pad[node] = (cosine * x - sine * y, sine * x + cosine * y, z)
    return brake


def joined_by_faces(folder, faces="[all, all]"):
    text = (folder / "brake.yaml").read_text()
    nodes = "    pairs: {file: pairs.csv}\n    normal: [0, 0, 1]\n"
    assert nodes in text
    path = folder / "faces.yaml"
    path.write_text(text.replace(nodes, f"    distance: 1.0e-4\n    faces: {faces}\n"))
    return path


@needs_calculix
def test_a_pad_between_the_nodes_of_the_disc_has_the_frequencies_of_calculix(script, tmp_path):  # noqa: F811
    brake = turned(script.Brake(), 0.31 * 2.0 * np.pi / 40)
    script.write_files(tmp_path, brake, mu=0.0)
    script.run_calculix(tmp_path, "normal", script.contact_deck(brake))
    wanted = script.printed(tmp_path, "normal")[:12, 0]
    path = joined_by_faces(tmp_path)
    path.write_text(path.read_text() + "cutoff: 9000\n")
    joined = squeal.read_system(path).assembly
    assert lowest(joined.system) == pytest.approx(wanted, rel=6e-4)


@pytest.fixture
def plates(tmp_path):
    """Two plates of one brick each, of unit matrices, the upper one on a quarter of the lower."""
    for name, low, size in (("one", 0.0, 2.0), ("other", 1.0, 1.0)):
        places = [(0, 0), (size, 0), (size, size), (0, size)]
        nodes = [(x, y, low) for x, y in places] + [(x, y, low + 1) for x, y in places]
        deck = ["*NODE", *(f"{i},{x},{y},{z}" for i, (x, y, z) in enumerate(nodes, 1))]
        deck += ["*ELEMENT,TYPE=C3D8,ELSET=E", "7,1,2,3,4,5,6,7,8"]
        deck += ["*SURFACE,NAME=LOW", "E,S1", "*SURFACE,NAME=HIGH", "7,S2", "E,S2"]
        (tmp_path / f"{name}.inp").write_text("\n".join(deck))
        table = ["node,dof,x,y,z"]
        for i, (x, y, z) in enumerate(nodes, 1):
            table += [f"{i},{way},{x},{y},{z}" for way in "xyz"]
        (tmp_path / f"{name}.csv").write_text("\n".join(table))
        np.savez(tmp_path / f"{name}.npz", np.eye(24))
        (tmp_path / f"{name}.yaml").write_text(
            f"M: {{file: {name}.npz}}\nK: {{file: {name}.npz}}\n"
            f"coordinates: {{file: {name}.csv}}\nelements: {{file: {name}.inp}}\n"
        )
    (tmp_path / "load.csv").write_text("node,dof,force\n5,z,-3.0\n")
    return tmp_path


def plates_file(folder, faces, more="    distance: 1e-6\n"):
    path = folder / "plates.yaml"
    path.write_text(
        "components:\n  one: {file: one.yaml}\n"
        "  other: {file: other.yaml, load: {file: load.csv}}\n"
        f"contact:\n  - between: [one, other]\n    faces: {faces}\n{more}"
        "    bonded: true\n    stiffness: 5.0\n"
    )
    return path


@pytest.mark.parametrize("faces", ["[all, all]", "[HIGH, low]"])
def test_points_carry_areas_and_weights_of_both_plates(plates, faces):
    contact = squeal.read_system(plates_file(plates, faces)).assembly.contacts[0]
    assert contact.area.sum() == pytest.approx(1.0)
    assert contact.normal == pytest.approx(np.tile([0.0, 0.0, 1.0], (len(contact.area), 1)))
    for weights in (contact.pairs.first_weights, contact.pairs.second_weights):
        assert weights.sum(axis=1) == pytest.approx(np.ones(len(weights)))
    # bilinear shape functions over the quarter nearest to node 5 of the lower plate
    shares: dict[str, float] = {}
    for labels, weights, area in zip(
        contact.pairs.first, contact.pairs.first_weights, contact.area, strict=True
    ):
        for label, weight in zip(labels, weights, strict=True):
            shares[label] = shares.get(label, 0.0) + weight * area
    assert shares == pytest.approx({"5": 9 / 16, "6": 3 / 16, "7": 1 / 16, "8": 3 / 16})


@pytest.mark.parametrize(
    ("faces", "more", "words"),
    [
        ("[SIDE, all]", "    distance: 1e-6\n", "one.inp names the surfaces: LOW, HIGH; all takes"),
        ("[LOW, HIGH]", "    distance: 1e-6\n", "none of other lies within 1e-06 m of one"),
        ("[all, all]", "", "distance: missing"),
        ("[all]", "    distance: 1e-6\n", "a list of two names of surfaces or all"),
        ("[all, all]", "    distance: 1e-6\n    area: 1.0\n", "beside faces, which give it"),
    ],
)
def test_a_contact_between_what_are_no_faces_is_refused_in_a_sentence(plates, faces, more, words):
    with pytest.raises(InputError, match=words):
        squeal.read_system(plates_file(plates, faces, more))


def test_a_deck_that_names_no_such_face_is_refused(plates):
    deck = (plates / "one.inp").read_text()
    path = plates_file(plates, "[HIGH, LOW]")
    for old, new, words in (
        ("7,S2", "7,S9", "S9 is no face of a hexahedron; it must be S1 to S6"),
        ("7,S2", "7,2", "2 is no face of a hexahedron; it must be S1 to S6"),
        ("7,S2", "8,S2", "8 is neither an element with faces nor a set of such"),
        ("*SURFACE,NAME=HIGH", "*SURFACE,NAME=HIGH,TYPE=NODE", "TYPE=ELEMENT is needed"),
    ):
        (plates / "one.inp").write_text(deck.replace(old, new))
        with pytest.raises(InputError, match=words):
            squeal.read_system(path)


@pytest.mark.parametrize(("places", "is_unused"), [("x", True), ("x,y", True), ("x,y,z", False)])
def test_places_of_points_are_used_only_together(plates, places, is_unused, recwarn):
    head = f"point,first,first_weight,second,second_weight,{places}\n"
    numbers = ",".join(["0.5"] * len(places.split(",")))
    (plates / "pairs.csv").write_text(head + f"1,5,1,1,1,{numbers}\n")
    path = plates_file(plates, "[all, all]", "    normal: [0, 0, 1]\n")
    text = path.read_text().replace("faces: [all, all]", "pairs: {file: pairs.csv}")
    path.write_text(text)
    squeal.read_system(path)
    columns = places.replace(",", ", ")
    words = f"columns {columns}: no use is made of them"
    assert any(words in str(warning.message) for warning in recwarn) == is_unused


def read_points(folder, *lines, more=""):
    """The points and areas that a table of lines gives."""
    head = f"point,first,first_weight,second,second_weight{more}"
    path = folder / "points.csv"
    path.write_text("\n".join([head, *lines]))
    return _table_of_pairs(path)


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        # a blank point counted as a point of that name: three points, of which this is the second
        (("1,a,.5,c,.5,1", ",b,.5,d,.5,1"), "line 3.point: '' is not allowed; .* name of a point"),
        (("1,a,7,c,1,1",), "line 2: first_weight of its point adds up to 7; -1 to 1 is allowed"),
        (("1,a,1,c,.6,1", "1,,,d,.6,"), "second_weight of its point adds up to 1.2"),
        (("1,a,1,c,-7,1",), "adds up to -7"),
        (("1,a,.6,c,1,1", "1,b,.5,,,"), "first_weight of its point adds up to 1.1"),
        (("1,a,.5,c,1,1", "1,b,.5,,,9"), "line 3.area: 9 is not allowed; the first line has 1"),
        (("1,a,.5,c,1,1", "1,b,.5,,,x"), "line 3.area: 'x' is not allowed"),
    ],
)
def test_a_table_of_points_that_says_two_things_is_refused(tmp_path, lines, words):
    with pytest.raises(InputError, match=words):
        read_points(tmp_path, *lines, more=",area")


@pytest.mark.parametrize("weights", [(".34", ".34", ".34"), ("-.34", "-.34", "-.34"), (".26",) * 4])
def test_weights_printed_to_two_digits_may_exceed_one(tmp_path, weights):
    others = [f"1,{label},{weight},,," for label, weight in zip("bde", weights[1:], strict=False)]
    arguments = read_points(tmp_path, f"1,a,{weights[0]},c,1,1", *others, more=",area")
    assert arguments["pairs"].first_weights.tolist() == [[float(weight) for weight in weights]]


def test_lines_of_a_point_repeat_its_area_or_leave_it_out(tmp_path):
    lines = ("1,a,.5,c,1,1e-4", "1,b,.5,,,", "2,a,.333,c,1,2", "2,b,.667,,,2.0")
    arguments = read_points(tmp_path, *lines, more=",area")
    assert arguments["area"].tolist() == [1e-4, 2.0]
    assert arguments["pairs"].first_weights.tolist() == [[0.5, 0.5], [0.333, 0.667]]


def test_points_beside_held_nodes_are_read_as_they_were_written(tmp_path):
    """In the middle of a face of 8 nodes the corners weigh -1/4, the middles 1/2 each."""
    points = ContactPoints(
        first=np.array([["a", "b"], ["a", "b"]]),
        second=np.array([["5", "6", "7", "8"]] * 2),
        first_weights=np.array([[0.4, 0.35], [0.0, 0.0]]),
        second_weights=np.array([[0.5] * 4, [0.25] * 4]),
        places=np.zeros((2, 3)),
    )
    contact = squeal.Contact(("one", "two"), points, [(0, 0, 1)] * 2, 5.0, [1.0, 2.0], bonded=True)
    write_points(tmp_path / "points.csv", contact)
    read = _table_of_pairs(tmp_path / "points.csv")["pairs"]
    assert read.first_weights[:, :2] == pytest.approx(points.first_weights)
    assert read.nodes(0).tolist() == ["a", "b"]
    assert read.name_of(1) == "5, 6, 7, 8"
    assert read.second_weights[:, :4] == pytest.approx(points.second_weights)


@pytest.mark.parametrize("weight", [1.0, 0.5])
def test_points_beside_held_nodes_lie_at_the_mean_of_the_moving_ones(weight):
    """At half the weight the distance from the axis was halved, too."""
    bodies = {}
    for name in ("one", "two"):
        system = squeal.System(np.eye(3), K=np.eye(3), name=name)
        bodies[name] = squeal.Component(system, ["a"] * 3, [0, 1, 2], [[3.0, 0.0, 0.0]] * 3)
    labels = np.array([["a"]])
    points = ContactPoints(labels, labels, np.array([[weight]]), np.array([[1.0]]))
    contact = squeal.Contact(("one", "two"), points, (0, 0, 1), 2.0, axis=(0, 0, 1))
    assert pair_directions(contact, bodies).radius == pytest.approx([3.0])


@pytest.mark.parametrize("size", [3, 4, 6, 8])
def test_shape_functions_carry_constants_and_the_places_of_their_nodes(size):
    """They add up to 1, are 1 at their own node alone, and have the slopes of their differences."""
    nodes = {
        3: [(0, 0), (1, 0), (0, 1)],
        4: [(-1, -1), (1, -1), (1, 1), (-1, 1)],
        6: [(0, 0), (1, 0), (0, 1), (0.5, 0), (0.5, 0.5), (0, 0.5)],
        8: [(-1, -1), (1, -1), (1, 1), (-1, 1), (0, -1), (1, 0), (0, 1), (-1, 0)],
    }
    assert SHAPES[size](np.array(nodes[size], dtype=float)).values == pytest.approx(np.eye(size))
    at = np.array([[0.21, 0.13], [0.4, 0.37]])
    values, slopes = SHAPES[size](at)
    assert values.sum(axis=1) == pytest.approx([1.0, 1.0])
    step = 1e-6
    for way in (0, 1):
        aside = step * np.eye(2)[way]
        difference = SHAPES[size](at + aside).values - SHAPES[size](at - aside).values
        assert slopes[:, :, way] == pytest.approx(difference / (2.0 * step), abs=1e-8)


@pytest.mark.parametrize("rule", [_triangle_rule, _quad_rule])
def test_rules_integrate_polynomials_of_degree_four(rule):
    points, weights = rule()
    r, s = points.T
    for power_r, power_s in [(0, 0), (2, 0), (1, 3), (2, 2), (4, 0)]:
        found = np.sum(weights * r**power_r * s**power_s)
        if rule is _triangle_rule:  # a! b! / (a + b + 2)!
            whole = math.factorial(power_r) * math.factorial(power_s)
            exact = whole / math.factorial(power_r + power_s + 2)
        else:
            exact = (1 + (-1) ** power_r) / (power_r + 1) * (1 + (-1) ** power_s) / (power_s + 1)
        assert found == pytest.approx(exact, abs=1e-13)


def plate(name, places):
    """A component whose nodes move along z alone."""
    n = len(places)
    return squeal.Component(squeal.System(np.eye(n), K=np.eye(n), name=name), list(places), [2] * n)


def test_a_curved_face_is_met_along_its_normals():
    """Points of a curved face of eight nodes fall on the plane below them, at their own height."""
    around = [(-1, -1), (1, -1), (1, 1), (-1, 1), (0, -1), (1, 0), (0, 1), (-1, 0)]
    places = {str(i): (x, y, 0.1 * (x * x + y * y)) for i, (x, y) in enumerate(around)}
    plane = {"a": (-4, -4, -0.05), "b": (4, -4, -0.05), "c": (4, 4, -0.05), "d": (-4, 4, -0.05)}
    underside = ["0", "3", "2", "1", "7", "6", "5", "4"]
    points, area, normal = contact_between_faces(
        plate("lower", plane),
        plate("upper", places),
        Surface([list(plane)], plane),
        Surface([underside], places),
        distance=1.0,
    )
    x, y, z = points.places.T
    slope = np.column_stack([-0.2 * x, -0.2 * y, np.ones(len(x))])
    length = np.linalg.norm(slope, axis=1)
    assert z == pytest.approx(0.1 * (x**2 + y**2), abs=1e-12)
    assert normal == pytest.approx(slope / length[:, None], abs=1e-9)
    corners = np.array([[plane[node] for node in nodes] for nodes in points.first])
    foot = np.einsum("mk,mkx->mx", points.first_weights, corners)
    height = (z + 0.05) * length  # along the normal down to the plane
    assert foot == pytest.approx(points.places - height[:, None] * normal, abs=1e-9)
    along = np.linspace(-1.0, 1.0, 2001)
    grid_x, grid_y = np.meshgrid(along, along)
    exact = np.trapezoid(np.trapezoid(np.sqrt(1 + 0.04 * (grid_x**2 + grid_y**2)), along), along)
    assert area.sum() == pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize(
    ("element_type", "side", "is_above"),
    [
        ("S4", "SPOS", True),
        ("S4", "SNEG", False),
        ("S4R", "S2", True),  # CalculiX: 1 is the side of the negative normal, 2 of the positive
        ("S4", "S1", False),
        ("S3", "S2", True),
        ("S3", "S1", False),
        ("S8R", "S1", False),
        ("S6", "s2", True),
    ],
)
def test_sides_of_a_shell_are_those_of_calculix_and_abaqus(tmp_path, element_type, side, is_above):
    """S1 was the side of the positive normal, and S2 was refused."""
    count = int(element_type[1])
    corners = [(0, 0), (2, 0), (2, 2), (0, 2)] if count in (4, 8) else [(0, 0), (2, 0), (0, 2)]
    places = [np.array([x, y, 0.0]) for x, y in corners]
    if count in (6, 8):
        followers = places[1:] + places[:1]
        places += [(place + after) / 2 for place, after in zip(places, followers, strict=True)]
    deck = ["*NODE", *(f"{i},{x},{y},{z}" for i, (x, y, z) in enumerate(places, 1))]
    nodes = ",".join(str(i) for i in range(1, count + 1))
    deck += [f"*ELEMENT,TYPE={element_type},ELSET=E", f"5,{nodes}", "*SURFACE,NAME=A", f"E,{side}"]
    (tmp_path / "shell.inp").write_text("\n".join(deck))
    labels = [(i, d) for i in range(1, count + 1) for d in (1, 2, 3)]
    where = read_coordinates(tmp_path / "shell.inp", len(labels), labels)
    where = read_elements(tmp_path / "shell.inp", where)
    surface = read_surface(where, "A")
    at = {label: np.asarray(surface.places[label], dtype=float) for label in surface.faces[0]}
    first, second, third = (at[label] for label in surface.faces[0][:3])
    assert (np.cross(second - first, third - first)[2] > 0) == is_above
    middles = surface.faces[0][len(corners) :]
    for i, middle in enumerate(middles):
        ends = [surface.faces[0][i], surface.faces[0][(i + 1) % len(corners)]]
        assert at[middle] == pytest.approx((at[ends[0]] + at[ends[1]]) / 2)


def test_an_edge_of_a_shell_is_no_face(tmp_path):
    deck = "*NODE\n1,0,0\n2,1,0\n3,0,1\n*ELEMENT,TYPE=S3\n5,1,2,3\n*SURFACE,NAME=A\n5,S3\n"
    (tmp_path / "shell.inp").write_text(deck)
    labels = [(i, d) for i in (1, 2, 3) for d in (1, 2, 3)]
    where = read_coordinates(tmp_path / "shell.inp", 9, labels)
    where = read_elements(tmp_path / "shell.inp", where)
    with pytest.raises(InputError, match="S3 is no face of a triangle; it must be S1 to S2"):
        read_surface(where, "A")


@pytest.mark.parametrize("element_type", ["CPS3", "CAX3", "DC2D3"])
def test_a_surface_of_a_deck_without_solids_and_shells_is_refused(tmp_path, element_type):
    """The sentence asked for the key elements, which was there."""
    deck = f"*NODE\n1,0,0\n2,1,0\n3,0,1\n*ELEMENT,TYPE={element_type}\n5,1,2,3\n"
    (tmp_path / "plane.inp").write_text(f"{deck}*SURFACE,NAME=A\n5,S1\n")
    labels = [(i, d) for i in (1, 2, 3) for d in (1, 2)]
    where = read_coordinates(tmp_path / "plane.inp", 6, labels)
    where = read_elements(tmp_path / "plane.inp", where)
    with pytest.raises(InputError, match="has no solids or shells; the key elements"):
        read_surface(where, "A")
