"""Kinds of finite elements that have faces: their corners, faces, and names in other programs."""

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from typing import NamedTuple, TypeAlias

from squeal.schema import Word

Corners: TypeAlias = tuple[int, ...]


class Cell(NamedTuple):
    """A kind of element.

    Attributes
    ----------
    corners : int
        How many corners it has.
    vtk, unv : int
        Its numbers in VTK and in UNV files.
    types : str
        Regular expression of its types in Abaqus and CalculiX, up to the number of nodes.
    faces : tuple
        The corners of each face in the order of Abaqus and CalculiX, seen from outside.
    edges : tuple
        The two corners of each edge, in the order in which nodes in the middles of edges follow the
        corners.
    """

    corners: int
    vtk: int
    unv: int
    types: str
    faces: tuple[Corners, ...]
    edges: tuple[tuple[int, int], ...]

    def face_nodes(self, nodes: Sequence[int]) -> Iterator[Corners]:
        """The nodes of each face of an element with some nodes.

        They are its corners and, where the element has them, the middles of its edges, the first
        between the first two corners.
        """
        has_middles = len(nodes) == self.corners + len(self.edges)
        # index of the middle's node among those of the element, by the two corners in either order
        middle_of_edge = {frozenset(edge): k for k, edge in enumerate(self.edges, self.corners)}
        for face in self.faces:
            indices = list(face)
            if has_middles:
                next_corners = (*face[1:], face[0])
                for edge in zip(face, next_corners, strict=True):
                    indices.append(middle_of_edge[frozenset(edge)])
            yield tuple(nodes[k] for k in indices)


_PRISM = ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5))
_BRICK = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
_TRIANGLE_EDGES = ((0, 1), (1, 2), (2, 0))
_QUAD_EDGES = ((0, 1), (1, 2), (2, 3), (3, 0))
_TETRA_EDGES = (*_TRIANGLE_EDGES, (0, 3), (1, 3), (2, 3))
_PRISM_EDGES = (*_TRIANGLE_EDGES, (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5))
_BRICK_EDGES = (
    *_QUAD_EDGES,
    *((4, 5), (5, 6), (6, 7), (7, 4)),
    *((0, 4), (1, 5), (2, 6), (3, 7)),
)
CELLS = {
    "triangle": Cell(3, 5, 91, "(S|M3D|R3D|SFM3D)[36]|STRI(3|65)", ((0, 1, 2),), _TRIANGLE_EDGES),
    "quad": Cell(4, 9, 94, "(S|M3D|R3D|SFM3D)[489]", ((0, 1, 2, 3),), _QUAD_EDGES),
    "tetra": Cell(
        4, 10, 111, "C3D(4|10)", ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)), _TETRA_EDGES
    ),
    "wedge": Cell(6, 13, 112, "(C3D|COH3D|GK3D|SC)(6|15|18)", _PRISM, _PRISM_EDGES),
    "hexahedron": Cell(8, 12, 115, "(C3D|COH3D|GK3D|SC)(8|20|27)", _BRICK, _BRICK_EDGES),
}
CELL_NAME = Word(tuple(CELLS))


@cache  # a mesh has many elements of few types
def cell_name(element_type: str) -> str:
    """The kind of the elements of a type of Abaqus and CalculiX, such as C3D8, in capitals.

    "" for elements without faces, such as springs.
    """
    for name, cell in CELLS.items():
        # behind the number of nodes: variants such as R (reduced integration) or S4R5
        if re.fullmatch(f"({cell.types})[A-Z]*5?", element_type):
            return name
    return ""


@cache
def node_count(element_type: str) -> int:
    """How many nodes an element of a type of Abaqus and CalculiX, such as C3D20R, has.

    0 if its name does not tell: that of C3D27 in Abaqus may have 21 to 27, that of C3D15V 15 to 18.
    """
    number = re.match(r"(?:\w*[23]D|CP[ES]G?|CAX|SC?|STRI)(\d+)(?!\d*V)", element_type)
    if not number or number[1] == "27":
        return 0
    return 6 if element_type == "STRI65" else int(number[1])


def outer_faces(elements: Iterable[tuple[str, Corners]]) -> list[Corners]:
    """The nodes of each face on the surface of a body, which one element alone has.

    Middles of edges follow the corners. `elements` are the kind and the nodes of each.
    """
    faces_by_corners: dict[frozenset[int], list[Corners]] = defaultdict(list)
    for kind, nodes in elements:
        for face in CELLS[kind].face_nodes(nodes):
            faces_by_corners[frozenset(corners_of(face))].append(face)
    return [faces[0] for faces in faces_by_corners.values() if len(faces) == 1]


def corners_of(face: Corners) -> Corners:
    """The corners of a face of 3, 4, 6 or 8 nodes; of 6 and 8 the last half are edges' middles."""
    if len(face) < 6:
        return face
    return face[: len(face) // 2]
