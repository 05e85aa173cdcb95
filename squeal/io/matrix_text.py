"""Matrices written as text: Matrix Market, Abaqus (and CalculiX), Harwell-Boeing.

Matrix Market is read here and not by SciPy, which takes 2.0D+01 for 2 and may crash on a line that
was cut off. Each reader returns a `Found` and raises ValueError.
"""

import io
import math
import re
import warnings
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csc_array, diags_array

from squeal.errors import InputWarning

MOST_ROWS = 5_000_000  # of a file: empty rows cost memory and no byte of the file
SYMMETRIES = ("general", "symmetric", "skew-symmetric")
_ALLOWED = ", ".join(SYMMETRIES)
LABELS = 5  # columns of Abaqus text whose rows are named by node and degree of freedom


@dataclass(frozen=True, eq=False)
class Found:
    """A matrix as it stands in a file.

    `labels` are the (node, degree of freedom) of its rows, if they are named so; `open_ended` is
    true if the file does not say how many rows there are (the last may be empty). `symmetric` says
    whether entries on one side of the diagonal stand for those on the other too, None if the file
    does not say.
    """

    matrix: Any = field(repr=False)
    labels: tuple[tuple[int, int], ...] | None = field(default=None, repr=False)
    open_ended: bool = False
    symmetric: bool | None = False


def one_sided(matrix: Any) -> bool:
    """True if no entry has another one on the other side of the diagonal."""
    rows, columns = matrix.tocoo().coords
    return bool(np.all(rows >= columns) or np.all(rows <= columns))


def mirrored(matrix: Any, sign: float = 1.0) -> Any:
    """A triangle with its mirror image added, the diagonal taken once."""
    return csc_array(matrix + sign * (matrix - diags_array(matrix.diagonal())).T)


def _numbers(lines: Iterable[str], comments: str | None) -> NDArray[np.float64]:
    """The table of numbers in some lines (rows, columns), (0, 0) if there are none."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of no data
        try:
            table = np.loadtxt(lines, comments=comments, ndmin=2)
        except ValueError as error:
            raise ValueError(_about(str(error))) from None
    return table if table.size else np.empty((0, 0))


def _about(message: str) -> str:
    found = re.match(r"could not convert string '(.*)' to float64 at row (\d+)", message)
    if not found:
        return message.partition(";")[0]
    fortran = "; Fortran's exponent D is not read" if re.search(r"\d[dD][+-]?\d", found[1]) else ""
    return f"entry {int(found[2]) + 1}: {found[1]} is no number{fortran}"


def _assembled(path: Path, indices: NDArray, values: NDArray, n: tuple[int, int]) -> Any:
    """The matrix of entries at (row, column) `indices` (2, entries); those that meet are summed."""
    matrix = coo_array((values, tuple(indices)), shape=n).tocsc()
    if matrix.nnz < len(values):
        places, count = np.unique(indices, axis=1, return_counts=True)
        row, column = places[:, np.argmax(count > 1)] + 1
        warnings.warn(
            f"{path}: {len(values) - matrix.nnz} entries stand where another one stands, the first "
            f"at row {row}, column {column}; they are summed",
            InputWarning,
            stacklevel=2,
        )
    return matrix


def _places(columns: NDArray, first: int) -> NDArray[np.intp]:
    if np.any(columns != np.round(columns)):
        raise ValueError("rows and columns must be whole numbers")
    if columns.min(initial=first) < first:
        raise ValueError(f"rows and columns must count from {first}")
    return columns.astype(np.intp)


def read_matrix_market(path: Path) -> Found:
    """The matrix of a Matrix Market file: coordinate or array, general, symmetric or skew."""
    with path.open(encoding="utf-8") as stream:
        words = stream.readline().lower().split()
        if len(words) != 5 or words[:2] != ["%%matrixmarket", "matrix"]:
            raise ValueError("the first line must be %%MatrixMarket matrix and three words")
        form, entry, symmetry = words[2:]
        size = next((line for line in stream if line.strip() and line.lstrip()[0] != "%"), "")
        table = _numbers(stream, "%")
    placed, general, skew = form == "coordinate", symmetry == "general", symmetry[:4] == "skew"
    if form not in ("coordinate", "array") or symmetry not in SYMMETRIES:
        raise ValueError(f"{form} {symmetry}: coordinate or array, {_ALLOWED} are read")
    numbers = [int(word) for word in size.split()]
    if len(numbers) != 2 + placed:
        raise ValueError(f"the line of sizes, {size.strip()}, must hold {2 + placed} numbers")
    n = (numbers[0], numbers[1])
    if max(n) > MOST_ROWS:
        raise ValueError(f"{max(n):.6g} rows; at most {MOST_ROWS} are read")
    count = math.prod(n) if general else n[0] * (n[0] + 1 - 2 * skew) // 2
    width = 2 * placed + {"pattern": 0, "complex": 2}.get(entry, 1)
    shape = (numbers[2] if placed else count, width)
    if len(table) != shape[0] or (shape[0] and table.shape != shape):
        raise ValueError(
            f"{len(table)} lines of {table.shape[1]} numbers; {shape[0]} of {shape[1]} are required"
        )
    table = table.reshape(shape)
    if entry == "integer" and np.any(table != np.round(table)):
        raise ValueError("entries must be whole numbers, as the first line says")
    if placed:
        where = _places(table[:, :2].T, 1) - 1
    elif general:
        where = np.array(np.unravel_index(np.arange(count), n, order="F"))
    else:
        where = np.array(np.triu_indices(n[0], int(skew)))[::-1]
    parts = table[:, 2 * placed :].T
    values = np.ones(shape[0]) if entry == "pattern" else parts[0]
    if entry == "complex":
        values = values + 1j * parts[1]
    matrix = _assembled(path, where, values, n)
    if general:
        return Found(matrix)
    if not one_sided(matrix):
        raise ValueError(_ONE_TRIANGLE.format(symmetry))
    if skew and np.any(matrix.diagonal()):
        raise ValueError("a skew-symmetric file has no diagonal, and this has")
    return Found(mirrored(matrix, -1.0 if skew else 1.0))


_ONE_TRIANGLE = "a {} file holds one triangle, and this has entries on both sides of the diagonal"


def is_abaqus(head: bytes) -> bool:
    """True if the first line that is no comment holds 3 or 5 numbers, the last a value."""
    for line in head.decode("ascii", "replace").splitlines():
        if line.strip() and line.lstrip()[0] not in "*#%":
            words = line.replace(",", " ").split()
            return len(words) in (3, LABELS) and all(word.isdecimal() for word in words[:-1])
    return False


def read_abaqus(path: Path) -> Found:
    """The matrix of rows `row, column, value` or `node, dof, node, dof, value`.

    Commas or blanks separate. A line that begins with * may say TYPE=SYMMETRIC or UNSYMMETRIC.
    """
    text = path.read_text(encoding="utf-8").replace(",", " ")
    lines = text.splitlines()
    heads = "".join(line for line in lines if line.startswith("*")).upper().replace(" ", "")
    table = _numbers((s for s in lines if s.strip() and s.lstrip()[0] not in "*#%"), None)
    if not table.size:
        raise ValueError("no entries")
    if table.shape[1] not in (3, LABELS):
        raise ValueError(f"{table.shape[1]} columns; 3 or {LABELS} are read")
    labels = None
    if table.shape[1] == LABELS:
        given = _places(table[:, :4], 0)
        base = int(given[:, 1::2].max()) + 1
        codes, index = np.unique(given[:, ::2] * base + given[:, 1::2], return_inverse=True)
        labels = tuple(divmod(code, base) for code in codes.tolist())
        where = index.reshape(-1, 2).T
    else:
        where = _places(table[:, :2].T, 1) - 1
    n = int(where.max()) + 1
    if n > MOST_ROWS:
        raise ValueError(f"{n:.6g} rows; at most {MOST_ROWS} are read")
    found = re.search(r"TYPE=(UN)?SYMMETRIC", heads)
    matrix = _assembled(path, where, table[:, -1], (n, n))
    return Found(matrix, labels, labels is None, found[1] is None if found else None)


def is_harwell_boeing(head: bytes) -> bool:
    """True if the third line begins with a type such as RUA and the second counts lines."""
    lines = head.splitlines()[:3]
    counts = len(lines) == 3 and all(word.isdigit() for word in lines[1].split())
    return counts and bool(re.match(rb"[RCPI][SUHZR][AE]\s", lines[2].upper()))


def read_harwell_boeing(path: Path) -> Found:
    """The matrix of a Harwell-Boeing file: real, assembled, RUA or RSA; no right-hand sides."""
    from scipy.io import hb_read

    lines = path.read_text(encoding="ascii").splitlines(keepends=True)
    if len(lines) < 5 or len(lines[2]) < 3:
        raise ValueError("the header is missing")
    kind = lines[2][:3].upper()
    if kind[0] not in "RI" or kind[1] not in "US" or kind[2] != "A":
        raise ValueError(f"type {kind}; RUA and RSA (real, assembled) are read")
    lines[2] = f"{kind[0]}UA{lines[2][3:]}"  # SciPy reads no symmetric ones
    if lines[1][56:72].strip() not in ("", "0"):  # right-hand sides come last: leave them out
        lines[1] = f"{lines[1][:56].ljust(56)}{'0':>14}\n"
        del lines[4]
    matrix = hb_read(io.StringIO("".join(lines)), spmatrix=False)
    matrix.check_format(full_check=True)
    if kind[1] == "S" and not one_sided(matrix):
        raise ValueError(_ONE_TRIANGLE.format("symmetric"))
    return Found(mirrored(matrix) if kind[1] == "S" else matrix)
