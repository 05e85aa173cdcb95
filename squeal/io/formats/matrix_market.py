"""Matrix Market: coordinate or array, general, symmetric or skew-symmetric.

Read here and not by SciPy, which takes 2.0D+01 for 2 and may crash on a line that was cut off.
"""

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from squeal.io.digits import written_decimals, written_digits
from squeal.io.formats.matrix_file import (
    ANY_LETTERS,
    MatrixFile,
    read_columns,
    sum_entries,
)
from squeal.io.halves import mirror_half
from squeal.schema import Place

LONGEST_SHOWN = 40  # characters of a first line that is no banner
SYMMETRIES = ("general", "symmetric", "skew-symmetric")
VALUE_COLUMNS = {"pattern": 0, "complex": 2}  # one of any other type of entry


def read_matrix_market(path: Path) -> MatrixFile:
    """The matrix of a file of this format. Raises ValueError.

    Its first line reads `%%MatrixMarket matrix coordinate real symmetric`, for example; entries are
    real, integer, complex (two numbers each) or pattern (no number). Behind comments a line of
    sizes follows, and then the entries: row, column and value, or in an array the values alone,
    column by column.
    """
    with path.open(encoding="utf-8-sig", errors=ANY_LETTERS) as stream:
        first_line = stream.readline()
        # padded: a line that was cut off has fewer than five words
        banner = [*first_line.lower().split(), "", "", "", "", ""]
        kind, layout, entry_type, symmetry = banner[1:5]
        if banner[0] != "%%matrixmarket":
            shown = "empty"
            if first_line.strip():
                shown = repr(first_line.strip()[:LONGEST_SHOWN])
            raise ValueError(
                f"its first line is {shown}; it must be %%MatrixMarket matrix ..., or the file "
                "hold lines of row, column and value"
            )
        if kind != "matrix" or layout not in ("coordinate", "array") or symmetry not in SYMMETRIES:
            allowed = f"matrix, coordinate or array, {', '.join(SYMMETRIES)} are read"
            raise ValueError(f"{kind} {layout} {symmetry}: {allowed}")
        index_columns = 2 if layout == "coordinate" else 0
        value_columns = VALUE_COLUMNS.get(entry_type, 1)
        lines = _without_comments(stream)
        size_line = next((line for line in lines if line.strip()), "")
        # (entries, index_columns) and (entries, value_columns)
        indices, numbers = read_columns(lines, index_columns, value_columns)
    digits = written_digits(_value_words(path, index_columns, value_columns))
    decimals = written_decimals(_value_words(path, index_columns, value_columns))

    general = symmetry == "general"
    skew = symmetry == "skew-symmetric"
    sizes = [int(word) for word in size_line.split()]
    size_count = 3 if index_columns else 2
    if len(sizes) != size_count:
        raise ValueError(f"the line of sizes, {size_line.strip()}, must hold {size_count} numbers")
    rows, columns = sizes[:2]
    if index_columns:
        count = sizes[2]
    elif general:
        count = rows * columns
    elif skew:  # the lower triangle without its diagonal
        count = rows * (rows - 1) // 2
    else:
        count = rows * (rows + 1) // 2
    if len(numbers) != count:
        raise ValueError(f"{len(numbers)} entries; {count} are required")
    if entry_type == "integer" and np.any(numbers != np.round(numbers)):
        raise ValueError("entries must be whole numbers, as the first line says")

    # row and column of each entry, from 0: (2, entries)
    if index_columns:
        if indices.min(initial=1) < 1:
            raise ValueError("rows and columns must count from 1")
        positions = indices.T - 1
    elif general:
        positions = np.array(np.unravel_index(np.arange(count), (rows, columns), order="F"))
    else:
        # The lower triangle column by column is the transposed upper one row by row, so that rows
        # and columns change places. The diagonal is left out of a skew-symmetric one
        positions = np.array(np.triu_indices(rows, int(skew)))[::-1]
    values = _values(entry_type, numbers)
    matrix, assumptions = sum_entries(path, positions, values, (rows, columns))
    if entry_type == "pattern":
        ones = "the file is a pattern without numbers, and each entry is taken as 1"
        Place(str(path)).warn(ones)
        assumptions += (f"{path.name}: {ones}",)
    if skew and np.any(matrix.diagonal()):
        raise ValueError("a skew-symmetric file has no diagonal, and this has")
    if not general:
        matrix = mirror_half(matrix, -1 if skew else 1)
    return MatrixFile(matrix, digits=digits, decimals=decimals, assumptions=assumptions)


def _values(entry_type: str, numbers: NDArray) -> NDArray:
    """The entries (lines,) of a type from their numbers: none, one, or real and imaginary part."""
    if entry_type == "pattern":
        return np.ones(len(numbers))
    if entry_type == "complex":
        return numbers[:, 0] + 1j * numbers[:, 1]
    return numbers[:, 0]


def _without_comments(lines: Iterable[str]) -> Iterator[str]:
    """The lines that are no comments."""
    for line in lines:
        if not line.lstrip().startswith("%"):
            yield line


def _value_words(path: Path, index_columns: int, value_columns: int) -> Iterator[str]:
    """The numbers behind the indices of each line, as they are written."""
    with path.open(encoding="utf-8-sig", errors=ANY_LETTERS) as stream:
        lines = (line for line in _without_comments(stream) if line.strip())
        next(lines, None)  # the sizes
        for line in lines:
            yield from line.split()[index_columns : index_columns + value_columns]
