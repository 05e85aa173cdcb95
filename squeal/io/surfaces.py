"""Surfaces of a component: faces of its elements, all outer ones or those that a deck names."""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from squeal.errors import InputError
from squeal.io.cells import CELLS, Corners, corners_of, outer_faces
from squeal.io.coordinates import Coordinates
from squeal.io.tables import deck_lines
from squeal.schema import Place
from squeal.sparse.contact_faces import Surface

ALL = "all"  # in place of a name: every face that one element alone has
MOST_LABELS = 5_000_000  # of a set that two numbers generate: as many as rows of a matrix
SHELL_SIDES = {"SNEG": "S1", "SPOS": "S2"}  # in Abaqus, and in CalculiX too


def read_surface(coordinates: Coordinates, surface: str) -> Surface:
    """The faces of a surface and the places of their nodes.

    `surface` is `all`, or the name of a *SURFACE of the deck that the elements come from. Raises
    InputError.
    """
    if not coordinates.cells:
        raise InputError(
            "has no solids or shells; the key elements of the system file must name some"
        )
    deck = coordinates.elements_file
    if surface == ALL:
        faces = outer_faces(coordinates.cells)
    elif deck is not None and deck.suffix.lower() == ".inp":
        named = _named_faces(coordinates, deck, surface)
        faces = list(dict.fromkeys(named))  # sets of elements may overlap
    else:
        raise InputError(
            f"{surface} is not allowed; its elements come from a table, which names no surface; it "
            f"must be {ALL}"
        )
    return surface_of(coordinates, faces)


def surface_of(coordinates: Coordinates, faces: Iterable[Corners]) -> Surface:
    """Faces with the labels and the places of their nodes."""
    labels_of_faces = []
    used: set[int] = set()
    for face in faces:
        labels_of_faces.append([coordinates.names[node] for node in face])
        used.update(face)
    places = {coordinates.names[node]: coordinates.places[node] for node in used}
    return Surface(labels_of_faces, places)


def _named_faces(coordinates: Coordinates, path: Path, surface: str) -> Iterator[Corners]:
    """The nodes of the faces of a *SURFACE in the input file at `path`. Raises InputError."""
    members = deck_sets(path, "ELEMENT")
    names: list[str] = []  # of all surfaces, in capitals
    is_unknown = True
    for line in deck_lines(path):
        if line.keyword[0] != "*SURFACE":
            continue
        names.append(line.option("NAME"))
        if line.option("NAME") != surface.upper():
            continue
        is_unknown = False
        if line.option("TYPE") not in ("", "ELEMENT") or len(line.cells) < 2:
            raise line.at.refuse("no faces of elements; a surface of TYPE=ELEMENT is needed")
        element, side = line.cells[:2]
        labels = members.get(element.upper(), [element])
        yield from faces_of(coordinates, labels, side.upper(), line.at)
    if is_unknown:
        known = ", ".join(dict.fromkeys(names)) or "none"
        raise InputError(
            f"{surface} is not allowed; {path.name} names the surfaces: {known}; {ALL} takes every "
            "outer face"
        )


def deck_sets(path: Path, kind: str) -> dict[str, list[str]]:
    """The labels of the members of each set of an input file, by the set's name in capitals.

    kind: NODE or ELEMENT. A set that names an earlier set contains the members of that one. No
    label comes twice in a set. Raises InputError.
    """
    option = "NSET" if kind == "NODE" else "ELSET"
    members: dict[str, list[str]] = defaultdict(list)
    for line in deck_lines(path):
        name = line.option(option)
        if not name:
            if line.keyword[0] == f"*{option}":
                raise line.at.refuse(f"belongs to a set without a name; *{option} needs {option}=")
            continue
        if line.keyword[0] == f"*{kind}":
            members[name].append(line.cells[0])
        elif line.keyword[0] == f"*{option}" and "GENERATE" in line.keyword:
            members[name] += _generated(line.cells, line.at)
        elif line.keyword[0] == f"*{option}":
            for cell in filter(None, line.cells):  # the name of an earlier set, or a label
                members[name] += members.get(cell.upper(), [cell])
    return {name: list(dict.fromkeys(labels)) for name, labels in members.items()}


def _generated(cells: list[str], at: Place) -> list[str]:
    """The labels from the first cell to the second by steps of the third. Raises InputError."""
    numbers = [cell for cell in cells if cell]
    if len(numbers) not in (2, 3) or not all(number.isdecimal() for number in numbers):
        raise at.refuse("no labels to generate; first, last and perhaps a step are needed")
    first, last, step = map(int, [*numbers, "1"][:3])
    if step == 0:
        raise at.refuse("a step of 0 is not allowed; it must be 1 or more")
    count = (last - first) // step + 1
    if count < 1:
        raise at.refuse(
            f"{first} to {last} is not allowed; the last label must not be below the first"
        )
    if count > MOST_LABELS:
        raise at.refuse(f"{count} labels are not allowed; at most {MOST_LABELS} are read")
    return [str(label) for label in range(first, last + 1, step)]


def faces_of(
    coordinates: Coordinates, labels: Sequence[str], side: str, at: Place
) -> Iterator[Corners]:
    """The nodes of the face `side` of each element, by their labels. Raises InputError."""
    for label in labels:
        if label not in coordinates.cell_of_element:
            raise at.refuse(f"{label} is neither an element with faces nor a set of such")
        kind, nodes = coordinates.cell_of_element[label]
        yield _named_face(kind, nodes, side, at)


def _named_face(kind: str, nodes: Corners, side: str, at: Place) -> Corners:
    """The nodes of the face of an element that a deck calls S1, S2, ..., SPOS or SNEG. Raises
    InputError."""
    faces = list(CELLS[kind].face_nodes(nodes))
    if len(faces) == 1:  # a shell, whose normal points out of its second side
        faces.insert(0, _turned_over(faces[0]))
        side = SHELL_SIDES.get(side, side)
    number = side.removeprefix("S")
    is_numbered = side.startswith("S") and number.isdecimal()
    if not is_numbered or not 1 <= int(number) <= len(faces):
        raise at.refuse(f"{side} is no face of a {kind}; it must be S1 to S{len(faces)}")
    return faces[int(number) - 1]


def _turned_over(face: Corners) -> Corners:
    """A face of a shell seen from its other side: corners, and middles of edges, in reverse order.

    The middle of the edge from the last corner to the first stays the last one.
    """
    corners = corners_of(face)
    middles = face[len(corners) :]
    return (*reversed(corners), *reversed(middles[:-1]), *middles[-1:])
