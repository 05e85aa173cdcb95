"""Where the rows of a system are in space: nodes, directions and elements, from tables."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from squeal.io.cells import CELL_NAME, CELLS, Corners
from squeal.io.tables import Line, number_in, read_table
from squeal.linear.matrices import Matrix
from squeal.schema import Place, Word

NO_DIRECTION = -1  # of rotations, and of what has no place in space
FIXED = -2  # of a node that no row moves
DIRECTIONS = {"1": 0, "2": 1, "3": 2, "x": 0, "y": 1, "z": 2}
DIRECTIONS |= dict.fromkeys(("4", "5", "6", "rx", "ry", "rz", "-"), NO_DIRECTION)
DIRECTIONS["fixed"] = FIXED
DOF = Word(tuple(DIRECTIONS))
POINTS = (
    "mode shapes are points; `elements: {file: job.inp}` in the system file gives faces, of "
    "components in the file of each"
)


@dataclass(frozen=True, eq=False)
class Coordinates:
    """Node and direction of each row of a system, and the places (m) of the nodes.

    Attributes
    ----------
    nodes : ndarray (n,)
        The node of each row, an index into `places`.
    directions : ndarray (n,)
        0 to 2 for x, y, z, `NO_DIRECTION` for rotations and other degrees of freedom.
    places : ndarray (nodes, 3)
        Where the nodes are, m.
    names : tuple of str (nodes,)
        What the nodes are called.
    cells, elements : tuple
        Kind and nodes (indices, corners first) of each element, and the label of each.
    elements_file : Path or None
        The file of the elements.
    supports : ndarray (s,)
        Rows of the matrix files that were left out, by their indices there, rising.
    bases : tuple of ndarray
        Of components that were reduced: the blocks, one a component, by which the coordinates of
        the reduced system give these rows.
    """

    nodes: NDArray[np.intp] = field(repr=False)
    directions: NDArray[np.intp] = field(repr=False)
    places: NDArray[np.float64] = field(repr=False)
    names: tuple[str, ...] = ()
    cells: tuple[tuple[str, Corners], ...] = field(default=(), repr=False)
    elements: tuple[str, ...] = field(default=(), repr=False)
    elements_file: Path | None = field(default=None, repr=False)
    supports: NDArray[np.intp] = field(default_factory=lambda: np.zeros(0, np.intp), repr=False)
    bases: tuple[NDArray[np.float64], ...] = field(default=(), repr=False)

    @cached_property
    def cell_of_element(self) -> dict[str, tuple[str, Corners]]:
        """Kind and nodes of each element by its label."""
        return dict(zip(self.elements, self.cells, strict=True))

    def without(self, supports: NDArray[np.intp]) -> "Coordinates":
        """The coordinates of the rows that stay where some are left out, by rising index."""
        return replace(
            self,
            nodes=np.delete(self.nodes, supports),
            directions=np.delete(self.directions, supports),
            supports=supports,
        )

    def with_more_rows(self, count: int) -> "Coordinates":
        """The coordinates with `count` rows more at the end, which move nothing."""
        return replace(
            self,
            nodes=np.append(self.nodes, np.zeros(count, self.nodes.dtype)),
            directions=np.append(self.directions, np.full(count, NO_DIRECTION)),
        )

    def displacements(self, shape: NDArray) -> NDArray:
        """Displacements (nodes, 3) of the nodes from a mode shape (n,)."""
        moves = self.directions >= 0
        amplitudes = self._unreduced(np.asarray(shape))
        moved = np.zeros((len(self.places), 3), dtype=amplitudes.dtype)
        moved[self.nodes[moves], self.directions[moves]] = amplitudes[moves]
        return moved

    def mass_and_centre(self, M: Matrix) -> tuple[float, tuple[float, ...]]:
        """The mass that translations move, in the unit of M (n, n), and its centre (3,), m.

        Both are means over the directions that have rows; without a mass the centre is NaN.
        """
        masses = []
        moments = []
        has_rows = [direction for direction in range(3) if direction in self.directions]
        for direction in has_rows:
            translation = (self.directions == direction).astype(float)
            mass_of_rows = translation * (M @ translation)  # lumped: row sums of this direction
            masses.append(float(mass_of_rows.sum()))
            moments.append(mass_of_rows @ self.places[self.nodes])
        total = sum(masses)
        centre = np.full(3, np.nan)
        if total:
            centre = np.sum(moments, axis=0) / total
        return total / max(len(has_rows), 1), tuple(centre.tolist())

    def _unreduced(self, shape: NDArray) -> NDArray:
        """The mode shape on all rows, from that of a reduced system."""
        if not self.bases:
            return shape
        ends = np.cumsum([basis.shape[1] for basis in self.bases])
        shapes_of_components = np.split(shape, ends[:-1])
        unreduced = []
        for V, x in zip(self.bases, shapes_of_components, strict=True):
            unreduced.append(V @ x)
        return np.concatenate(unreduced)


def read_coordinates(path: Path, rows: int, labels: Sequence[tuple[int, int]]) -> Coordinates:
    """Read where the rows of a system are in space, from a table node, dof, x, y, z.

    Without `labels` the table has a line for each row, in their order. dof is 1 to 3 or x, y, z for
    displacements, 4 to 6 or rx, ry, rz for rotations, - for what does not move a node in space. A
    line with fixed stands for no row: it gives the place of a node that nothing moves.

    Parameters
    ----------
    path : Path
        A .csv file, or with labels an input file (.inp).
    rows : int
        How many rows the system has.
    labels : sequence of (int, int)
        (node, degree of freedom) of each row, where the matrices name them: then a line for each
        node suffices, in any order, and without dof. Internal nodes, below zero, need none; a node
        without a line has no part in mode shapes, which is warned of.

    Raises
    ------
    InputError
        For a table that does not fit the rows, or says two things of one node.
    """
    columns = ["node", "x", "y", "z"]
    if not labels:
        columns.insert(1, "dof")
    at, lines = read_table(path, columns)
    line_directions = []
    line_names = []
    line_places = []
    for here, cells in lines:
        if not labels:
            word = DOF.read(cells["dof"].lower(), here / "dof")
            line_directions.append(DIRECTIONS[word])
        name = cells["node"]
        if not name:
            raise (here / "node").must_be("", "the name of a node")
        line_names.append(name)
        line_places.append([number_in(cells[axis], here / axis) for axis in "xyz"])
    # of each node its name and the first line that names it; of each line its node
    names, first_lines, node_of_line = np.unique(line_names, return_index=True, return_inverse=True)
    places = np.array(line_places)[first_lines]
    for line, node in enumerate(node_of_line.tolist()):
        if tuple(line_places[line]) != tuple(places[node]):
            raise at.refuse(f"the node {names[node]} lies at two places; one is allowed")
    if labels:
        nodes, directions = _rows_by_labels(at, names.tolist(), labels)
    else:
        nodes = node_of_line
        directions = np.array(line_directions)
    is_row = directions != FIXED  # all of them, if labels give the rows
    row_count = np.count_nonzero(is_row)
    if row_count != rows:
        counted = "labels" if labels else "lines"
        raise at.refuse(f"{row_count} {counted}; the system's {rows} rows need one each")
    fixed_nodes = nodes[~is_row].tolist()
    nodes = nodes[is_row]
    directions = directions[is_row]
    moved = set(nodes.tolist())
    for node in fixed_nodes:
        if node in moved:
            raise at.refuse(f"the node {names[node]} is fixed and has rows; one of both is allowed")
    displaced = Counter(zip(nodes.tolist(), directions.tolist(), strict=True))
    for (node, direction), count in displaced.items():
        if direction >= 0 and count > 1:
            raise at.refuse(
                f"{count} rows for the displacement of the node {names[node]} along "
                f"{'xyz'[direction]}; one is allowed"
            )
    return Coordinates(
        nodes=nodes,
        directions=directions,
        places=places,
        names=tuple(names.tolist()),
    )


def _rows_by_labels(
    at: Place, names: Sequence[str], labels: Sequence[tuple[int, int]]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Node (an index into `names`) and direction of each row, from its label (node, freedom).

    names: of the nodes in the table at `at`; those of internal nodes, below zero, are in no table.
    Warns of other nodes without a line there. Raises InputError if none has one.
    """
    index_of_name = {name: i for i, name in enumerate(names)}
    needed = {node for node, _ in labels if node > 0}
    missing = sorted(node for node in needed if str(node) not in index_of_name)
    if missing:
        refusal = f"no line for {len(missing)} nodes of the matrices, the first is {missing[0]}"
        if len(missing) == len(needed):
            raise at.refuse(refusal)
        at.warn(f"{refusal}; they have no place in mode shapes")
    nodes = []
    directions = []
    for node, freedom in labels:
        index = index_of_name.get(str(node))
        is_displacement = index is not None and 1 <= freedom <= 3
        # node 0 stands for a node without a line: a row of NO_DIRECTION moves no node
        nodes.append(index or 0)
        directions.append(freedom - 1 if is_displacement else NO_DIRECTION)
    return np.array(nodes), np.array(directions)


def read_elements(path: Path, coordinates: Coordinates) -> Coordinates:
    """Coordinates with the elements of a table: element, type, and its nodes, corners first.

    Raises InputError.
    """
    _, lines = read_table(path, ("element", "type"))
    index_of_name = {name: i for i, name in enumerate(coordinates.names)}
    elements: dict[str, tuple[str, Corners]] = {}  # kind and nodes (indices) by name
    for line in lines:
        name = line.cells["element"]
        kind, nodes = _element(line, index_of_name)
        count = len(nodes)
        node_repeats = len(set(nodes)) < count
        if node_repeats or not name or name in elements:
            raise line.at.refuse(f"an element named once and {count} different nodes are needed")
        elements[name] = (kind, nodes)
    return replace(
        coordinates,
        cells=tuple(elements.values()),
        elements=tuple(elements),
        elements_file=path,
    )


def _element(line: Line, index_of_name: dict[str, int]) -> tuple[str, Corners]:
    """The kind and the nodes (indices) of the element in a line of a table.

    The middles of its edges follow its corners where all of them have a place. Raises InputError
    where a corner has none.
    """
    kind = CELL_NAME.read(line.cells["type"].lower(), line.at / "type")
    corners = CELLS[kind].corners
    names = []  # of its nodes, in the order of their columns
    for head, text in line.cells.items():
        if head not in ("element", "type"):
            names.append(text)
    for name in names[:corners]:
        if name not in index_of_name:
            raise line.at.must_be(name, "a node with a line in the table of coordinates")
    used = names[: corners + len(CELLS[kind].edges)]
    if any(name not in index_of_name for name in used):
        used = names[:corners]
    return kind, tuple(index_of_name[name] for name in used)
