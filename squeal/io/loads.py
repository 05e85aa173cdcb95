"""Forces on a component: a table of them, loads of an input deck, or pressure on a surface."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from squeal.io.coordinates import DIRECTIONS, DOF, FIXED, NO_DIRECTION, Coordinates
from squeal.io.surfaces import deck_sets, faces_of, read_surface, surface_of
from squeal.io.tables import DeckLine, deck_lines, number_in, read_table, row_in
from squeal.schema import Place
from squeal.sparse.components import Component
from squeal.sparse.contact_faces import Surface, forces_of_pressure

LOADS = ("*CLOAD", "*DLOAD", "*DSLOAD")
OTHER_LOADS = ("*BASEMOTION", "*TEMPERATURE")  # without blanks


def read_load(path: Path, body: Component, coordinates: Coordinates) -> NDArray[np.float64]:
    """The forces (n,) on the rows of a component, N, from a table or an input deck (.inp).

    The table has the columns row, force, or node, dof, force. Raises InputError.
    """
    if path.suffix.lower() == ".inp":
        return _deck_load(path, body, coordinates)
    load = np.zeros(body.system.n)
    _, lines = read_table(path, ("force",))
    if not lines or "row" not in lines[0].cells:
        # by nodes: read once more, which refuses a table that lacks one of these columns
        _, lines = read_table(path, ("node", "dof", "force"))
    for at, cells in lines:
        rows = _loaded_rows(body, coordinates, at, cells)
        load[rows] += number_in(cells["force"], at / "force")
    return load


def pressure_load(body: Component, coordinates: Coordinates, surface: str) -> NDArray[np.float64]:
    """The forces (n,) of a pressure of 1 on a surface of a component, which its deck names.

    Raises InputError.
    """
    load = np.zeros(body.system.n)
    _add_pressure(load, body, read_surface(coordinates, surface), 1.0)
    return load


def _loaded_rows(
    body: Component, coordinates: Coordinates, at: Place, cells: Mapping[str, str]
) -> NDArray[np.intp]:
    """The index (1,) of the row that a line of a table names; empty where it names a support.

    cells: the line, with the number of the row under row, or with node and dof. Rows are counted
    from 1 on, as in the matrix files, which hold the rows of supports too. Raises InputError.
    """
    if "row" in cells:
        count = body.system.n + len(coordinates.supports)
        index = row_in(cells["row"], at / "row", count)
        return np.flatnonzero(np.delete(np.arange(count), coordinates.supports) == index)
    with at.prefixing_errors():
        rows = body.rows_of([cells["node"]])[0]
    direction = DIRECTIONS[DOF.read(cells["dof"].lower(), at / "dof")]
    if direction in (NO_DIRECTION, FIXED) or rows[direction] < 0:
        raise at.refuse(f"{body.name} has no such row; a displacement of a node is needed")
    return rows[[direction]]


def _deck_load(path: Path, body: Component, coordinates: Coordinates) -> NDArray[np.float64]:
    """The forces (n,) below *CLOAD of an input file, and those of pressures below *DLOAD (on faces
    of elements) and *DSLOAD (on surfaces).

    Loads of one place add. Raises InputError.
    """
    load = np.zeros(body.system.n)
    node_sets = deck_sets(path, "NODE")
    element_sets = deck_sets(path, "ELEMENT")
    lines = []
    for line in deck_lines(path):
        _refuse_other_load(line)
        if line.keyword[0] in LOADS:
            lines.append(line)
    if not lines:
        raise Place(str(path)).refuse(f"no load; {', '.join(LOADS)} are read")
    for line in lines:
        if line.step != lines[0].step:
            raise line.at.refuse("a second step with loads; a deck with those of one is needed")
        # OP=NEW or MOD says what becomes of loads of earlier steps; there are none
        options = [option for option in line.keyword[1:] if not option.startswith("OP")]
        if options:
            raise line.at.refuse(f"{options[0]} is not read; a load without it is needed")
        if len(line.cells) < 3:
            raise line.at.refuse("no load; where, which and how much are needed")
        name, kind, text = line.cells[:3]
        value = number_in(text, line.at)
        if line.keyword[0] == "*CLOAD":
            for node in node_sets.get(name.upper(), [name]):  # of a set, or a single one
                _add_force(load, body, coordinates, line, node, value)
        elif line.keyword[0] == "*DLOAD":
            labels = element_sets.get(name.upper(), [name])
            _add_pressure(load, body, _loaded_faces(coordinates, line, labels), value)
        elif kind.upper() != "P":
            raise line.at.refuse(f"{kind} is not read; it must be P, a pressure")
        else:  # *DSLOAD: name is that of a surface
            with line.at.prefixing_errors():
                _add_pressure(load, body, read_surface(coordinates, name), value)
    return load


def _refuse_other_load(line: DeckLine) -> None:
    """Refuse what loads a structure beside forces and pressures, and local axes of nodes.

    Along those axes forces would act. Raises InputError.
    """
    name = line.keyword[0]
    is_moved = False  # a boundary by a displacement: node, first and last dof, amount
    if name == "*BOUNDARY" and line.step > 0 and len(line.cells) > 3:
        is_moved = number_in(line.cells[3] or "0", line.at) != 0.0
    if is_moved or name in OTHER_LOADS:
        raise line.at.refuse(f"{name} loads it too; only forces and pressures are read")
    if name == "*TRANSFORM":
        raise line.at.refuse("*TRANSFORM is not allowed; a load along x, y and z is needed")


def _add_force(
    load: NDArray[np.float64],
    body: Component,
    coordinates: Coordinates,
    line: DeckLine,
    node: str,
    value: float,
) -> None:
    """Add a force at a node to `load` (n,), in place; a node that no row moves takes none.

    line: below *CLOAD, whose second cell names the direction; value: the force, N. Raises
    InputError.
    """
    direction = DIRECTIONS[DOF.read(line.cells[1], line.at)]
    if direction in (NO_DIRECTION, FIXED):
        raise line.at.refuse(f"{line.cells[1]} is not read; it must be 1 to 3, a force")
    if node not in coordinates.names:
        raise line.at.refuse(f"{node} is neither a node of {body.name} nor a set of such")
    if node not in body.nodes:
        return
    row = body.rows_of([node])[0, direction]
    if row >= 0:  # -1 where no row moves the node that way
        load[row] += value


def _loaded_faces(coordinates: Coordinates, line: DeckLine, labels: list[str]) -> Surface:
    """The faces of the elements with some labels that a line below *DLOAD presses.

    P1 presses the face S1 and so on, P the back of a shell, along its normal. Raises InputError.
    """
    load_label = line.cells[1].upper()
    number = load_label.removeprefix("P")
    if load_label == "P":
        side = "SNEG"
    elif load_label.startswith("P") and number.isdecimal():
        side = f"S{number}"
    else:
        raise line.at.refuse(f"{load_label} is not read; it must be P or P1 to P6, a pressure")
    return surface_of(coordinates, faces_of(coordinates, labels, side, line.at))


def _add_pressure(
    load: NDArray[np.float64], body: Component, surface: Surface, pressure: float
) -> None:
    """Add the forces of a pressure on a surface to `load` (n,).

    Nodes that no row moves take none.
    """
    forces = forces_of_pressure(surface)
    labels = [label for label in forces if label in body.nodes]
    if not labels:
        return
    rows = body.rows_of(labels)
    values = pressure * np.array([forces[label] for label in labels])
    np.add.at(load, rows[rows >= 0], values[rows >= 0])
