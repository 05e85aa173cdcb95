"""Matrices written as text: Matrix Market, Harwell-Boeing and Abaqus."""

import io
import mmap
import re
from pathlib import Path
from typing import Any

import numpy as np

from squeal.io.memory import check_rows

_INTEGER = rb"-?\d++"
_NUMBER = rb"-?(?:(?:\d++\.?\d*+|\.\d++)(?:[eE][+-]?\d++)?+|(?i:nan|inf))"
_FORTRAN = re.compile(r"\d\.?[dD][+-]?\d")
_GAP = rb"[ \t]++"
_HEAD = rb"[^\n]*+\n(?:[ \t]*+(?:%[^\n]*+|\r?)\n)*+[^\n]*+\n?"
_VALUES = {  # of a line, by the field that the first line names, and in words
    "real": ([_NUMBER], "a number such as -3.4e+05"),
    "double": ([_NUMBER], "a number such as -3.4e+05"),
    "integer": ([_INTEGER], "a whole number"),
    "unsigned-integer": ([_INTEGER], "a whole number"),
    "complex": ([_NUMBER, _NUMBER], "two numbers"),
    "pattern": ([], ""),
}


def read_matrix_market(path: Path) -> Any:
    """The matrix (COO, or dense) of a Matrix Market file. Raises ValueError.

    SciPy reads a number as far as it understands it and leaves out what follows, so that 2.0D+01
    is 2: the lines are checked before.
    """
    from scipy.io import mminfo, mmread

    size, _, entries, form, field, symmetry = mminfo(path)
    check_rows(float(size))
    with path.open("rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as text:
        _check_lines(text, form == "coordinate", field)
        # SciPy reads beyond a last line that ends in a blank
        ended = text[-1:] not in b" \t\r"
        matrix = mmread(path if ended else io.BytesIO(text[:] + b"\n"), spmatrix=False)
    if form == "coordinate" and symmetry != "general":
        rows, columns = (k[:entries] for k in matrix.coords)  # SciPy puts the mirrored ones behind
        _check_triangle(symmetry, rows, columns)
        if symmetry == "skew-symmetric" and np.any(matrix.diagonal()):
            raise ValueError("a skew-symmetric file has no diagonal, and this has")
    return matrix


def _check_lines(text: mmap.mmap, placed: bool, field: str) -> None:
    values, words = _VALUES[field]
    line = _GAP.join([_INTEGER] * 2 * placed + values)
    good = rb"%b(?:[ \t]*+(?:%b)?+[ \t\r]*+(?:\n|\Z))*+" % (_HEAD, line)
    found = re.match(good, text)
    end = found.end() if found else 0
    if end < len(text):
        number = text[:end].count(b"\n") + 1
        wrong = text[end : end + 60].splitlines()[0].decode(errors="replace").strip()
        allowed = ", ".join(["row", "column"] * placed + [words] * bool(words))
        fortran = "; Fortran's exponent D is not read" if _FORTRAN.search(wrong) else ""
        raise ValueError(f"line {number}, {wrong}: {allowed} is allowed{fortran}")


def _one_sided(rows: Any, columns: Any) -> bool:
    return bool(np.all(rows >= columns) or np.all(rows <= columns))


def _check_triangle(symmetry: str, rows: Any, columns: Any) -> None:
    if not _one_sided(rows, columns):
        raise ValueError(
            f"a {symmetry} file holds one triangle, and this has entries on both sides of the "
            "diagonal"
        )


def read_harwell_boeing(path: Path) -> Any:
    """The matrix (CSC) of a Harwell-Boeing file: real, assembled, RUA or RSA.

    A symmetric file holds the lower triangle; right-hand sides are left out. Raises ValueError.
    """
    from scipy.io import hb_read

    lines = path.read_text(encoding="ascii").splitlines(keepends=True)
    if len(lines) < 5 or len(lines[2]) < 3:
        raise ValueError("the header is missing")
    kind = lines[2][:3].upper()
    if kind[0] not in "RI" or kind[1] not in "US" or kind[2] != "A":
        raise ValueError(f"type {kind}; RUA and RSA (real, assembled) are read")
    lines[2] = f"{kind[0]}UA{lines[2][3:]}"
    if lines[1][56:72].strip() not in ("", "0"):  # right-hand sides come last: leave them out
        lines[1] = f"{lines[1][:56].ljust(56)}{'0':>14}\n"
        del lines[4]
    matrix = hb_read(io.StringIO("".join(lines)), spmatrix=False)
    matrix.check_format(full_check=True)
    if kind[1] == "U":
        return matrix
    _check_triangle("symmetric", *matrix.tocoo().coords)
    return _mirrored(matrix)


def _mirrored(matrix: Any) -> Any:
    from scipy.sparse import diags_array

    return matrix + matrix.T - diags_array(matrix.diagonal())


def read_abaqus(path: Path) -> tuple[Any, tuple[tuple[int, int], ...] | None]:
    """Matrix (CSC) and labels (node, degree of freedom) of its rows, None if it has none.

    Rows `row, column, value` or `node, dof, node, dof, value`, separated by commas or blanks. A
    file whose entries all lie on one side of the diagonal holds a symmetric matrix, unless its
    head says TYPE=UNSYMMETRIC. Raises ValueError.
    """
    from scipy.sparse import coo_array

    text = path.read_text(encoding="utf-8")
    kept = [s for s in text.splitlines() if s.strip() and s.lstrip()[0] not in "*#%"]
    heads = "".join(s for s in text.splitlines() if s.startswith("*")).upper().replace(" ", "")
    if not kept:
        raise ValueError("no entries")
    table = np.loadtxt(io.StringIO("\n".join(kept).replace(",", " ")), ndmin=2)
    if table.shape[1] not in (3, 5):
        raise ValueError(f"{table.shape[1]} columns; 3 or 5 are read")
    places, values = table[:, :-1], table[:, -1]
    if np.any(places != np.round(places)):
        raise ValueError("rows and columns must be whole numbers")
    if places.shape[1] == 2:
        k = int(np.argmax(places.max(axis=1)))
        check_rows(float(places[k].max()), f"entry {' '.join(kept[k].split())}: ")
    whole = places.astype(int)
    labels = None
    if whole.shape[1] == 4:
        pairs = np.vstack([whole[:, :2], whole[:, 2:]])
        unique, index = np.unique(pairs, axis=0, return_inverse=True)
        labels = tuple((int(node), int(dof)) for node, dof in unique)
        rows, columns = index.reshape(2, -1)
    else:
        if whole.min() < 1:
            raise ValueError("rows and columns must count from 1")
        rows, columns = whole[:, 0] - 1, whole[:, 1] - 1
    n = int(max(rows.max(), columns.max())) + 1
    matrix = coo_array((values, (rows, columns)), shape=(n, n)).tocsc()
    if "TYPE=UNSYMMETRIC" not in heads and _one_sided(rows, columns):
        matrix = _mirrored(matrix)
    return matrix, labels
