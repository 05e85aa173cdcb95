"""A matrix as it stands in a file, and what the readers of several formats share."""

import math
import re
import warnings
import zlib
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csc_array

from squeal.errors import InputError
from squeal.linear.matrices import given_matrix
from squeal.linear.precision import short_floats
from squeal.schema import Place

MOST_ROWS = 5_000_000  # of a file: empty rows cost memory and no byte of the file
MOST_FULL = 10_000_000  # numbers of full arrays, for each 1e6 bytes of a file
# Ansys' names of degrees of freedom, with the numbers of the other programs
FREEDOMS = {"UX": 1, "UY": 2, "UZ": 3, "ROTX": 4, "ROTY": 5, "ROTZ": 6, "PRES": 8, "TEMP": 11}
ANY_LETTERS = "backslashreplace"  # titles and comments may have letters of any encoding
OTHER_FREEDOMS = 100  # numbers above are of other names

Labels: TypeAlias = tuple[tuple[int, int], ...]
"""(node, degree of freedom) of each row."""


@dataclass(frozen=True, eq=False)
class MatrixFile:
    """A matrix as it stands in a file.

    Attributes
    ----------
    matrix : csc_array (n, n)
        The entries that stand in the file.
    labels : tuple of (int, int), optional
        (node, degree of freedom) of each row, if the rows are named so.
    open_ended : bool
        Whether the file does not say how many rows there are (the last ones may be empty).
    symmetric : bool or None
        Whether entries on one side of the diagonal stand for those on the other too, None if the
        file does not say.
    form : str
        The format that the file was read as.
    numbered : bool
        Whether some labels only number rows, so that the file goes with files of the same labels
        alone.
    digits : int or None
        The significant digits that entries were rounded to, None if they are exact or doubles.
    decimals : int or None
        The decimals that all entries were rounded to, None if there is no such number.
    assumptions : tuple of str
        What was guessed of the matrix.
    floats : dtype or None
        The type of floats, shorter than doubles, that entries were rounded to.
    """

    matrix: csc_array = field(repr=False)
    labels: Labels | None = field(default=None, repr=False)
    open_ended: bool = False
    symmetric: bool | None = False
    form: str = ""
    numbered: bool = False
    digits: int | None = None
    decimals: int | None = None
    assumptions: tuple[str, ...] = ()
    floats: np.dtype[np.floating] | None = None


def file_of_array(array: NDArray) -> MatrixFile:
    """The matrix of an array of numbers of any type, such as float16 and of either byte order, as
    no sparse array has it. Raises InputError."""
    return MatrixFile(csc_array(given_matrix(array)), floats=short_floats(array))


@dataclass(frozen=True)
class UnbuiltMatrix:
    """A matrix of a file of several, built only when it is picked."""

    description: str
    build: Callable[[], MatrixFile]


NamedMatrix: TypeAlias = MatrixFile | UnbuiltMatrix | csc_array | NDArray
NamedMatrices: TypeAlias = Mapping[str, NamedMatrix]
"""The matrices of a file that may hold several."""


def matrices_by_name(named: Iterable[tuple[str, NamedMatrix]]) -> dict[str, NamedMatrix]:
    """The matrices of a file by their names, those of one name as K(1), K(2) in their order."""
    pairs = list(named)
    occurrences = Counter(name for name, _ in pairs)
    numbers: Counter[str] = Counter()
    matrices = {}
    for name, matrix in pairs:
        numbers[name] += 1
        key = name
        if occurrences[name] > 1:
            key += f"({numbers[name]})"
        matrices[key] = matrix
    return matrices


def read_columns(
    lines: Iterable[str], index_columns: int, value_columns: int
) -> tuple[NDArray, NDArray]:
    """The whole numbers (lines, index_columns) and the numbers (lines, value_columns) behind them.

    Raises ValueError for a line of another number of columns, or one that holds anything else.
    """
    columns: list[tuple[str, type, tuple[int]]] = []
    if index_columns:
        columns.append(("indices", np.int64, (index_columns,)))
    if value_columns:
        columns.append(("values", np.float64, (value_columns,)))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of no data
        try:
            table = np.atleast_1d(np.loadtxt(lines, columns, comments=None))
        except ValueError as error:
            # NumPy: "the dtype passed requires 3 columns but 2 were found at row 5; use ..." or
            # "could not convert string 'x' to int64 at row 0, column 1."
            reason = str(error).partition(";")[0].replace("the dtype passed requires ", "")
            raise ValueError(reason.replace("int64", "whole numbers")) from None
    empty = np.empty((len(table), 0))
    indices = table["indices"] if index_columns else empty.astype(np.int64)
    values = table["values"] if value_columns else empty
    return indices, values


def sum_entries(
    path: Path, indices: NDArray, values: NDArray, shape: tuple[int, int]
) -> tuple[csc_array, tuple[str, ...]]:
    """The matrix of entries at (row, column) `indices` (2, entries), and what was assumed of it.

    Entries of one place are summed, with a warning. Raises ValueError.
    """
    if max(shape) > MOST_ROWS:
        raise ValueError(f"{max(shape):.6g} rows; at most {MOST_ROWS} are read")
    matrix = coo_array((values, tuple(indices)), shape=shape).tocsc()  # sums entries of one place
    summed = len(values) - matrix.nnz
    if not summed:
        return matrix, ()
    places, counts = np.unique(indices, axis=1, return_counts=True)
    row, column = places[:, np.argmax(counts > 1)] + 1
    Place(str(path)).warn(
        f"{summed} entries stand where another one stands, the first at row {row}, "
        f"column {column}; they are summed"
    )
    return matrix, (f"{path.name}: {summed} entries of one place are summed",)


def labelled_matrix(
    path: Path,
    positions: NDArray,
    values: NDArray,
    symmetric: bool | None,
    digits: int | None,
) -> MatrixFile:
    """The matrix of entries whose rows and columns are named by node and degree of freedom.

    Rows are sorted by their labels.

    Parameters
    ----------
    path : Path
        The file, which warnings name.
    positions : ndarray (entries, 4)
        Node and degree of freedom of the row, then of the column.
    values : ndarray (entries,)
        The entries.
    symmetric, digits
        Of the MatrixFile.

    Raises
    ------
    ValueError
    """
    if not len(positions):
        raise ValueError("no entries")
    nodes = positions[:, ::2]
    freedoms = positions[:, 1::2]
    if freedoms.min() < 0:
        raise ValueError("degrees of freedom must be at least 0")
    base = int(freedoms.max()) + 1
    # (2, entries), one whole number for each label, sorted like the labels; divmod inverts it
    codes = (nodes * base + freedoms).T
    sorted_codes = np.sort(codes, axis=None)  # np.unique hashes, which takes twice as long
    is_first = np.diff(sorted_codes, prepend=sorted_codes[0] - 1) > 0  # of equal codes
    label_codes = sorted_codes[is_first]
    labels = tuple(divmod(code, base) for code in label_codes.tolist())
    indices = np.searchsorted(label_codes, codes)  # (2, entries): rows and columns
    matrix, assumptions = sum_entries(path, indices, values, (len(labels), len(labels)))
    return MatrixFile(matrix, labels, symmetric=symmetric, digits=digits, assumptions=assumptions)


def read_labels(path: Path, rows: int) -> Labels | None:
    """The label of each row, from lines `node.dof` of CalculiX or `row node name` of Ansys.

    CalculiX expands shells and beams to solids and gives several rows the label of one node. Those
    rows become internal: in place of the node stands minus the number of the row, from -1 on. None
    without such a file. `rows`: how many the matrix has at least. Raises ValueError.
    """
    if not path.is_file():
        return None
    text = path.read_text(encoding="ascii").upper()
    labels = []
    for node, name in re.findall(r"(?m)^\s*(?:\d+\s+)?(\d+)(?:\.|\s+)(\w+)\s*$", text):
        labels.append((int(node), _freedom_number(name)))
    if len(labels) < rows:
        raise ValueError(f"{path.name} names {len(labels)} of its {rows} rows")
    rows_of_label = Counter(labels)
    repeated = [row for row, label in enumerate(labels) if rows_of_label[label] > 1]
    if repeated:
        node, freedom = labels[repeated[0]]
        Place(str(path)).warn(
            f"{len(repeated)} of {len(labels)} rows share their label with another row, the first "
            f"is degree of freedom {freedom} of node {node}; they are told apart by their row "
            "numbers and take no part in mode shapes"
        )
    for row in repeated:
        _, freedom = labels[row]
        labels[row] = (-row - 1, freedom)
    return tuple(labels)


def has_internal_nodes(labels: Labels | None) -> bool:
    """True if some rows are numbered below zero in place of a node."""
    return any(node < 0 for node, _ in labels or ())


def _freedom_number(name: str) -> int:
    """The number of a degree of freedom of any name; those that move no node in space, such as
    WARP or VOLT, get one of their own, the same in every file."""
    if name.isdigit():
        return int(name)
    return FREEDOMS.get(name) or OTHER_FREEDOMS + zlib.crc32(name.encode())


def check_indices(matrix: csc_array) -> None:
    """Refuse indices beyond the matrix, and pointers that decrease. Raises ValueError.

    SciPy trusts indices, and checks no pointers whose last one is 0.
    """
    matrix.check_format(full_check=True)
    if np.any(np.diff(matrix.indptr) < 0):
        raise ValueError("index pointers must not decrease")


def check_full_size(path: Path, shapes: Iterable[Sequence[int]]) -> None:
    """Refuse full arrays of far more numbers than a file of this size can hold uncompressed.

    shapes: of all its arrays. Raises InputError.
    """
    count = sum(map(math.prod, shapes))
    most = MOST_FULL * max(1, path.stat().st_size // 1_000_000)
    if count > most:
        raise InputError(f"{count:.6g} numbers in so small a file; at most {most} are read")
