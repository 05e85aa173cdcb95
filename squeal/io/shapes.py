"""Mode shapes on the nodes of a system as files of other programs: VTK and UNV (universal file)."""

from collections import Counter
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

Shapes = Sequence[tuple[int, Eigenvalue]]
"""Modes by number; their right vectors (n,) are the shapes."""


def displacements(where: Coordinates, shape: NDArray) -> NDArray[np.complex128]:
    """Displacements (nodes, 3) of the nodes that move, turned so that the real parts are largest,
    and scaled to a largest length of one."""
    u = where.displacements(np.asarray(shape, dtype=complex))
    u = u * np.exp(-0.5j * np.angle(np.sum(u * u)))
    largest = float(np.sqrt(np.max(np.sum(np.abs(u) ** 2, axis=1))))
    return np.asarray(u / largest if largest > 0 else u)


def outer_faces(where: Coordinates) -> list[tuple[int, ...]]:
    """Corners of the faces that one element alone has, indices of nodes."""
    faces = [tuple(c[k] for k in face) for name, c in where.cells for face in CELLS[name].faces]
    count = Counter(map(frozenset, faces))
    return [face for face in faces if count[frozenset(face)] == 1]


def write_shapes(path: Path, where: Coordinates, shapes: Shapes) -> None:
    """Shapes as a legacy VTK file (.vtk) or a universal file (.unv). Raises InputError."""
    if path.suffix not in (".vtk", ".unv"):
        raise InputError(f"{path}: the name must end in .vtk or .unv")
    lines = (_vtk if path.suffix == ".vtk" else _unv)(where, shapes)
    write_text(path, "\n".join(lines) + "\n")


def _vtk(where: Coordinates, shapes: Shapes) -> Iterator[str]:
    """Points, cells, and of each mode its real and imaginary parts, and phases in degrees."""
    cells = [(CELLS[name].vtk, corners) for name, corners in where.cells]
    cells = cells or [(1, (k,)) for k in range(len(where.places))]

    def rows(head: str, table: NDArray) -> Iterator[str]:
        yield f"{head} double"
        yield from (" ".join(f"{x:.9g}" for x in row) for row in table.tolist())

    yield "# vtk DataFile Version 3.0\nmode shapes\nASCII\nDATASET UNSTRUCTURED_GRID"
    yield from rows(f"POINTS {len(where.places)}", where.places)
    yield f"CELLS {len(cells)} {sum(1 + len(c) for _, c in cells)}"
    yield from (" ".join(map(str, (len(corners), *corners))) for _, corners in cells)
    yield f"CELL_TYPES {len(cells)}"
    yield from (str(kind) for kind, _ in cells)
    yield f"POINT_DATA {len(where.places)}"
    for number, mode in shapes:
        u = displacements(where, mode.right)
        parts = {"real": u.real, "imag": u.imag, "phase": np.degrees(np.angle(u))}
        for part, values in parts.items():
            yield from rows(f"VECTORS mode_{number}_{mode.frequency_hz:.6g}_Hz_{part}", values)


def _unv(where: Coordinates, shapes: Shapes) -> Iterator[str]:
    """Datasets 2411 (nodes), 2412 (elements) and, of each mode, 55 (real or complex shape)."""
    named = all(n.isdecimal() and int(n) < LABEL for n in where.names) and where.names
    labels = [int(n) for n in where.names] if named else range(1, len(where.places) + 1)
    edge = f"{-1:6d}"

    def line(*numbers: float, form: str = "10d") -> str:
        return "".join(f"{x:{form}}" for x in numbers)

    yield f"{edge}\n{2411:6d}"
    for label, place in zip(labels, where.places.tolist(), strict=True):
        yield f"{line(label, 1, 1, 11)}\n{line(*place, form='25.16E').replace('E', 'D')}"
    if where.cells:
        yield f"{edge}\n{edge}\n{2412:6d}"
    for k, (name, corners) in enumerate(where.cells, 1):
        yield line(k, CELLS[name].unv, 1, 1, 7, len(corners))
        yield line(*(labels[c] for c in corners))
    for number, mode in shapes:
        u = displacements(where, mode.right)
        # analysis 2 normal mode, 3 complex eigenvalue; data 2 real, 5 complex
        analysis, data, values = 3, 5, np.stack([u.real, u.imag], axis=2).reshape(len(u), -1)
        numbers = [mode.value.real, mode.value.imag, 0.0, 0.0, 0.0, 0.0]
        if np.abs(u.imag).max() < REAL:
            analysis, data, values = 2, 2, u.real
            mass = float(np.linalg.norm(u) / np.linalg.norm(where.displacements(mode.right))) ** 2
            numbers = [mode.frequency_hz, mass, mode.damping_ratio, 0.0]
        yield f"{edge}\n{edge}\n{55:6d}\nmode {number}\n{mode.frequency_hz:.6g} Hz"
        yield f"NONE\nNONE\nNONE\n{line(1, analysis, 2, 8, data, 3)}"
        yield f"{line(2, len(numbers), 1, number)}\n{line(*numbers, form='13.5E')}"
        for label, row in zip(labels, values.tolist(), strict=True):
            yield f"{label:10d}\n{line(*row, form='13.5E')}"
    yield edge
