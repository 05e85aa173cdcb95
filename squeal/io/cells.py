"""Kinds of finite elements that have faces: their corners, faces, and names in other programs."""

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple, TypeAlias

from squeal.schema import Word

Corners: TypeAlias = tuple[int, ...]


class Cell(NamedTuple):
    """A kind of element: its corners, its numbers in VTK and UNV files, its types in Abaqus and
    CalculiX up to what follows the number of nodes, corners of its faces in the order of these
    programs, seen from outside, and its edges in the order in which nodes in their middles follow
    the corners."""

    corners: int
    vtk: int
    unv: int
    types: str
    faces: tuple[Corners, ...]
    edges: tuple[tuple[int, int], ...]

    def face_nodes(self, nodes: Sequence[int]) -> Iterator[Corners]:
        """The nodes of each face: its corners and, where the element has them, the middles of its
        edges, the first between the first two corners."""
        has_middles = len(nodes) == self.corners + len(self.edges)
        middles = {frozenset(edge): k for k, edge in enumerate(self.edges, self.corners)}
        for face in self.faces:
            used = list(face)
            if has_middles:
                following = (*face[1:], face[0])
                used += [middles[frozenset(edge)] for edge in zip(face, following, strict=True)]
            yield tuple(nodes[k] for k in used)


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
    "triangle": Cell(3, 5, 91, "(S|M3D|R3D|SFM3D)[36]|STRI65", ((0, 1, 2),), _TRIANGLE_EDGES),
    "quad": Cell(4, 9, 94, "(S|M3D|R3D|SFM3D)[489]", ((0, 1, 2, 3),), _QUAD_EDGES),
    "tetra": Cell(
        4, 10, 111, "C3D(4|10)", ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)), _TETRA_EDGES
    ),
    "wedge": Cell(6, 13, 112, "(C3D|COH3D|GK3D|SC)(6|15|18)", _PRISM, _PRISM_EDGES),
    "hexahedron": Cell(8, 12, 115, "(C3D|COH3D|GK3D|SC)(8|20|27)", _BRICK, _BRICK_EDGES),
}
CELL_NAME = Word(tuple(CELLS))


def cell_name(keyword: Sequence[str]) -> str:
    """The kind of the elements below a line such as *ELEMENT, TYPE=C3D8, in capitals and split at
    its commas; "" for elements without faces, such as springs."""
    element_type = ""
    for option in keyword:
        if option.startswith("TYPE"):
            element_type += option.split("=")[-1].strip()
    for name, cell in CELLS.items():
        if re.fullmatch(f"({cell.types})[A-Z]*5?", element_type):
            return name
    return ""


def outer_faces(elements: Iterable[tuple[str, Corners]]) -> list[Corners]:
    """The nodes of each face that one element alone has, middles of edges after the corners.

    `elements` are the kind and the nodes of each.
    """
    found: dict[frozenset[int], list[Corners]] = defaultdict(list)
    for kind, nodes in elements:
        for face in CELLS[kind].face_nodes(nodes):
            found[frozenset(corners_of(face))].append(face)
    return [faces[0] for faces in found.values() if len(faces) == 1]


def corners_of(face: Corners) -> Corners:
    """The corners of a face of 3, 4, 6 or 8 nodes."""
    return face if len(face) < 6 else face[: len(face) // 2]
