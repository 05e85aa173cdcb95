"""Where the rows of matrices are in space: a table of node, degree of freedom and coordinates."""

import csv
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from squeal.errors import InputError

COLUMNS = ("node", "dof", "x", "y", "z")
DIRECTIONS = {"1": 0, "2": 1, "3": 2, "x": 0, "y": 1, "z": 2}
OTHERS = ("4", "5", "6", "rx", "ry", "rz", "-")  # rotations, and what has no place in space


@dataclass(frozen=True, eq=False)
class Coordinates:
    """Node and direction of each row of a system, and the places (m) of the nodes.

    `nodes` (n,) indices into `places` (nodes, 3); `directions` (n,) 0 to 2 for x, y, z, -1 for
    rotations and other degrees of freedom, which move nothing.
    """

    nodes: NDArray[np.intp] = field(repr=False)
    directions: NDArray[np.intp] = field(repr=False)
    places: NDArray[np.float64] = field(repr=False)

    def without(self, rows: NDArray[np.intp]) -> "Coordinates":
        """The same nodes without some rows of the system."""
        nodes, directions = np.delete(self.nodes, rows), np.delete(self.directions, rows)
        return Coordinates(nodes, directions, self.places)

    def displacements(self, shape: NDArray) -> NDArray:
        """Displacements (nodes, 3) of the nodes from a mode shape (n,)."""
        moved = np.zeros((len(self.places), 3), dtype=np.asarray(shape).dtype)
        kept = self.directions >= 0
        moved[self.nodes[kept], self.directions[kept]] = np.asarray(shape)[kept]
        return moved


def read_coordinates(path: Path, rows: int) -> Coordinates:
    """The table of a .csv file with the columns node, dof, x, y, z, one line a row of the system.

    dof is 1 to 3 or x, y, z for displacements, 4 to 6 or rx, ry, rz for rotations, - for what does
    not move a node in space. Raises InputError.
    """
    try:
        with path.open(encoding="utf-8", newline="") as stream:
            table = list(csv.DictReader(stream, skipinitialspace=True))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or "it is no UTF-8 table"
        raise InputError(
            f"{path}: cannot be read ({reason}); the name of a .csv file is allowed"
        ) from None
    heads = {name.strip().lower(): name for name in (table[0] if table else {}) if name}
    missing = [name for name in COLUMNS if name not in heads]
    if missing:
        raise InputError(f"{path}: no column {missing[0]}; the columns {', '.join(COLUMNS)} are")
    if len(table) != rows:
        raise InputError(f"{path}: {len(table)} lines; the system's {rows} rows need one each")
    nodes: dict[str, int] = {}
    where: list[int] = []
    ways: list[int] = []
    places: list[tuple[float, ...]] = []
    for line, row in enumerate(table, 2):
        node = (row[heads["node"]] or "").strip()
        try:
            place = tuple(float(row[heads[c]]) for c in "xyz")
        except (TypeError, ValueError):
            place = (np.nan,) * 3
        if not node or not all(map(np.isfinite, place)):
            raise InputError(f"{path}: line {line}: a node and three finite coordinates are needed")
        way = (row[heads["dof"]] or "").strip().lower()
        if way not in DIRECTIONS and way not in OTHERS:
            allowed = ", ".join((*DIRECTIONS, *OTHERS))
            raise InputError(f"{path}: line {line}: dof {way} is not allowed; it must be {allowed}")
        if node not in nodes:
            nodes[node] = len(places)
            places.append(place)
        where.append(nodes[node])
        ways.append(DIRECTIONS.get(way, -1))
    return Coordinates(np.array(where), np.array(ways), np.array(places))
