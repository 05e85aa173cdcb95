"""Matrices written as text: Harwell-Boeing and Abaqus."""

import io
from pathlib import Path
from typing import Any

import numpy as np

from squeal.files.memory import check_rows


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
    return _mirrored(matrix) if kind[1] == "S" else matrix


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
    one_sided = bool(np.all(rows >= columns) or np.all(rows <= columns))
    if "TYPE=UNSYMMETRIC" not in heads and one_sided:
        matrix = _mirrored(matrix)
    return matrix, labels
