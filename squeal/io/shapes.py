"""Mode shapes on the nodes of a system as files of other programs: VTK and UNV (universal file)."""

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from squeal.errors import InputError
from squeal.io.system import CELLS, Coordinates
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


def _rows(table: NDArray) -> list[str]:
    return [" ".join(f"{x:.9g}" for x in row) for row in table.tolist()]


def _vtk(where: Coordinates, shapes: Shapes) -> Iterator[str]:
    """Points, cells, and of each mode its real and imaginary parts, and phases in degrees."""
    count = len(where.places)
    cells = [(CELLS[name].vtk, corners) for name, corners in where.cells]
    cells = cells or [(1, (k,)) for k in range(count)]
    yield "# vtk DataFile Version 3.0\nmode shapes\nASCII\nDATASET UNSTRUCTURED_GRID"
    yield from (f"POINTS {count} double", *_rows(where.places))
    yield f"CELLS {len(cells)} {sum(1 + len(c) for _, c in cells)}"
    yield from (" ".join(map(str, (len(corners), *corners))) for _, corners in cells)
    yield f"CELL_TYPES {len(cells)}"
    yield from (str(kind) for kind, _ in cells)
    yield f"POINT_DATA {count}"
    for number, mode in shapes:
        u = displacements(where, mode.right)
        parts = {"real": u.real, "imag": u.imag, "phase": np.degrees(np.angle(u))}
        for part, values in parts.items():
            yield f"VECTORS mode_{number}_{mode.frequency_hz:.6g}_Hz_{part} double"
            yield from _rows(values)


def _unv(where: Coordinates, shapes: Shapes) -> Iterator[str]:
    """Datasets 2411 (nodes), 2412 (elements) and, of each mode, 55 (real or complex shape)."""
    names = where.names if all(n.isdecimal() and int(n) < LABEL for n in where.names) else ()
    labels = [int(n) for n in names] or list(range(1, len(where.places) + 1))
    yield f"{-1:6d}\n{2411:6d}"
    for label, place in zip(labels, where.places.tolist(), strict=True):
        yield f"{label:10d}{1:10d}{1:10d}{11:10d}"
        yield "".join(f"{x:25.16E}" for x in place).replace("E", "D")
    yield f"{-1:6d}"
    if where.cells:
        yield f"{-1:6d}\n{2412:6d}"
        for k, (name, corners) in enumerate(where.cells, 1):
            yield "".join(f"{x:10d}" for x in (k, CELLS[name].unv, 1, 1, 7, len(corners)))
            yield "".join(f"{labels[c]:10d}" for c in corners)
        yield f"{-1:6d}"
    for number, mode in shapes:
        u = displacements(where, mode.right)
        real = bool(np.abs(u.imag).max() < REAL)
        # analysis 2 normal mode, 3 complex eigenvalue; data 2 real, 5 complex
        heads, growth = ((2, 2) if real else (3, 5)), mode.value
        numbers = [growth.real, growth.imag, 0.0, 0.0, 0.0, 0.0]
        if real:
            numbers = [mode.frequency_hz, 1.0, mode.damping_ratio, 0.0]
        yield f"{-1:6d}\n{55:6d}\nmode {number}\n{mode.frequency_hz:.6g} Hz\nNONE\nNONE\nNONE"
        yield "".join(f"{x:10d}" for x in (1, heads[0], 2, 8, heads[1], 3))
        yield "".join(f"{x:10d}" for x in (2, len(numbers), 1, number))
        yield "".join(f"{x:13.5E}" for x in numbers)
        values = u.real if real else np.stack([u.real, u.imag], axis=2).reshape(len(u), -1)
        for label, row in zip(labels, values.tolist(), strict=True):
            yield f"{label:10d}\n" + "".join(f"{x:13.5E}" for x in row)
        yield f"{-1:6d}"
