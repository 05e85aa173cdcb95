"""Mode shapes on the nodes of a system as files of other programs: VTK and UNV (universal file)."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from squeal.errors import InputError
from squeal.io.cells import CELLS
from squeal.io.coordinates import Coordinates
from squeal.io.writing import write_text
from squeal.linear.eigen import Eigenvalue

LABEL = 10**9  # a node's number in a universal file is less than this
REAL = 1e-6  # of the largest: below, imaginary parts of a shape are rounding
VTK_VERTEX = 1  # a cell of one point
UNV_NORMAL_MODE = 2  # kinds of analysis, and of data, in dataset 55
UNV_COMPLEX_MODE = 3
UNV_REAL = 2
UNV_COMPLEX = 5

Shapes = Sequence[tuple[int, Eigenvalue]]
"""Modes by number; their right vectors (n,) are the shapes."""


def unit_displacements(coordinates: Coordinates, shape: NDArray) -> NDArray[np.complex128]:
    """Displacements (nodes, 3) of the nodes in a mode shape (n,), of a largest length of one.

    Their common phase is the one that makes the real parts largest.
    """
    u = coordinates.displacements(np.asarray(shape, dtype=complex))
    # the sum of squared real parts less that of imaginary ones is Re sum u^2, largest if it is real
    in_phase = u * np.exp(-0.5j * np.angle(np.sum(u * u)))
    largest = float(np.sqrt(np.max(np.sum(np.abs(in_phase) ** 2, axis=1))))
    if not largest > 0:
        return np.asarray(in_phase)
    return in_phase / largest


def write_shapes(path: Path, coordinates: Coordinates, shapes: Shapes) -> None:
    """Shapes as a legacy VTK file (.vtk) or a universal file (.unv). Raises InputError."""
    if path.suffix == ".vtk":
        lines = _vtk_lines(coordinates, shapes)
    elif path.suffix == ".unv":
        lines = _unv_lines(coordinates, shapes)
    else:
        raise InputError(f"{path}: the name must end in .vtk or .unv")
    write_text(path, "\n".join(lines) + "\n")


def _vtk_lines(coordinates: Coordinates, shapes: Shapes) -> Iterator[str]:
    """The lines of a legacy VTK file: nodes, elements, and the displacements of each mode.

    Displacements are three fields: real parts, imaginary parts and phases in degrees.
    """
    count = len(coordinates.places)
    cells = []  # of each cell the number of its kind in VTK, and its corners
    for name, nodes in coordinates.cells:
        kind = CELLS[name]
        cells.append((kind.vtk, nodes[: kind.corners]))
    if not cells:
        cells = [(VTK_VERTEX, (node,)) for node in range(count)]

    def vectors(head: str, rows: NDArray) -> Iterator[str]:
        yield f"{head} double"
        for x, y, z in rows.tolist():
            yield f"{x:.9g} {y:.9g} {z:.9g}"

    yield "# vtk DataFile Version 3.0\nmode shapes\nASCII\nDATASET UNSTRUCTURED_GRID"
    yield from vectors(f"POINTS {count}", coordinates.places)
    numbers_of_cells = sum(1 + len(corners) for _, corners in cells)
    yield f"CELLS {len(cells)} {numbers_of_cells}"
    for _, corners in cells:
        yield " ".join(map(str, (len(corners), *corners)))
    yield f"CELL_TYPES {len(cells)}"
    for vtk_number, _ in cells:
        yield str(vtk_number)
    yield f"POINT_DATA {count}"
    for number, mode in shapes:
        u = unit_displacements(coordinates, mode.right)
        name = f"mode_{number}_{mode.frequency_hz:.6g}_Hz"
        yield from vectors(f"VECTORS {name}_real", u.real)
        yield from vectors(f"VECTORS {name}_imag", u.imag)
        yield from vectors(f"VECTORS {name}_phase", np.degrees(np.angle(u)))


def _columns(*numbers: float, form: str = "10d") -> str:
    """Numbers in columns of a universal file."""
    return "".join(f"{x:{form}}" for x in numbers)


def _unv_lines(coordinates: Coordinates, shapes: Shapes) -> Iterator[str]:
    """The lines of a universal file, by datasets.

    Dataset 2411 holds the nodes, 2412 the elements; for each mode a dataset 55 holds its real or
    complex shape. Nodes keep their names if all names are different whole numbers below `LABEL`;
    else they are numbered from 1.
    """
    labels: Sequence[int] = range(1, len(coordinates.places) + 1)
    if coordinates.names and all(
        name.isdecimal() and int(name) < LABEL for name in coordinates.names
    ):
        numbers = [int(name) for name in coordinates.names]
        if len(set(numbers)) == len(numbers):  # unlike "1" and "01"
            labels = numbers
    edge = f"{-1:6d}"  # begins and ends a dataset
    yield f"{edge}\n{2411:6d}"
    for label, place in zip(labels, coordinates.places.tolist(), strict=True):
        # behind the label two coordinate systems and a colour
        yield _columns(label, 1, 1, 11)
        yield _columns(*place, form="25.16E").replace("E", "D")
    if coordinates.cells:
        yield f"{edge}\n{edge}\n{2412:6d}"
    for number, (name, nodes) in enumerate(coordinates.cells, 1):
        corners = nodes[: CELLS[name].corners]  # without nodes in the middle of edges
        # behind the kind of element a physical property, a material and a colour
        yield _columns(number, CELLS[name].unv, 1, 1, 7, len(corners))
        yield _columns(*(labels[corner] for corner in corners))
    for number, mode in shapes:
        yield f"{edge}\n{edge}\n{55:6d}\nmode {number}\n{mode.frequency_hz:.6g} Hz"
        yield from _unv_shape(coordinates, labels, number, mode)
    yield edge


def _unv_shape(
    coordinates: Coordinates, labels: Sequence[int], number: int, mode: Eigenvalue
) -> Iterator[str]:
    """The lines of a dataset 55 behind its first two lines of text.

    A shape whose parts are in phase is a normal mode, with frequency, modal mass and damping ratio;
    any other a complex one, with its eigenvalue. labels: the numbers of the nodes; number: that of
    the mode.
    """
    u = unit_displacements(coordinates, mode.right)
    if np.abs(u.imag).max() < REAL:
        analysis = UNV_NORMAL_MODE
        data = UNV_REAL
        values = u.real
        # modal vectors are normalised by mass, so that the scale of the shape gives its modal mass
        scale = np.linalg.norm(u) / np.linalg.norm(coordinates.displacements(mode.right))
        mass = float(scale) ** 2
        numbers = [mode.frequency_hz, mass, mode.damping_ratio, 0.0]
    else:
        analysis = UNV_COMPLEX_MODE
        data = UNV_COMPLEX
        values = u.view(float)  # real and imaginary part of x, of y, of z
        numbers = [mode.value.real, mode.value.imag, 0.0, 0.0, 0.0, 0.0]
    # of a structure (1), a vector of three translations (2) that are displacements (8), 3 a node
    yield f"NONE\nNONE\nNONE\n{_columns(1, analysis, 2, 8, data, 3)}"
    # two whole numbers follow, the load case and the mode, and so many others
    yield f"{_columns(2, len(numbers), 1, number)}\n{_columns(*numbers, form='13.5E')}"
    for label, row in zip(labels, values.tolist(), strict=True):
        yield _columns(label)
        yield _columns(*row, form="13.5E")
