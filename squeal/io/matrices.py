"""Matrices in files: Matrix Market, MATLAB, NumPy, Harwell-Boeing, Nastran OP4, Abaqus text."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from squeal.errors import InputError
from squeal.io.matrix_text import read_abaqus, read_harwell_boeing, read_matrix_market
from squeal.io.writing import write_whole

HARWELL_BOEING = (".hb", ".rua", ".rsa")
ABAQUS = (".inp", ".txt")
SUFFIXES = (".mtx", ".mat", ".npz", *HARWELL_BOEING, ".op4", *ABAQUS)
KEYED = (".mat", ".npz", ".op4")  # files that may hold several matrices


@dataclass(frozen=True, eq=False)
class FileMatrix:
    """A real square matrix from a file, as a SciPy CSC array (n, n).

    `labels` are the (node, degree of freedom) of its rows in Abaqus matrix-input text, else None;
    `open_ended` is true if the file does not say how many rows there are (the last may be empty).
    """

    matrix: Any = field(repr=False)
    labels: tuple[tuple[int, int], ...] | None = field(default=None, repr=False)
    open_ended: bool = False


def read_matrix(path: Path | str, key: str | None = None) -> FileMatrix:
    """The matrix in a file; its suffix tells the format, `key` the one of several in the file.

    Raises InputError with one sentence for anything that is no real, finite, square matrix.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(f"{path}: the suffix must be one of {', '.join(SUFFIXES)}")
    if key is not None and suffix not in KEYED:
        raise InputError(f"{path}: key {key} is not allowed; {', '.join(KEYED)} files hold keys")
    try:
        with path.open("rb"):  # its absence is told in our words
            pass
        return _checked(path, _read(path, suffix, key))
    except InputError:
        raise
    except OSError as error:
        if error.strerror is None:  # raised by a library about the content
            raise InputError(f"{path}: no readable {suffix} matrix: {_first(error)}") from None
        raise InputError(
            f"{path}: cannot be read ({error.strerror}); the name of a matrix file is allowed"
        ) from None
    except ImportError as error:
        raise InputError(
            f"{path}: reading {suffix} needs the package {error.name}, which is not installed"
        ) from None
    except MemoryError:
        raise InputError(f"{path}: the matrix is too large for this machine's memory") from None
    except Exception as error:  # each library has its own words for a broken file
        raise InputError(f"{path}: no readable {suffix} matrix: {_first(error)}") from None


def _first(error: BaseException) -> str:
    lines = str(error).strip().splitlines()
    return lines[0].rstrip(".:") if lines else type(error).__name__


def _checked(path: Path, found: FileMatrix) -> FileMatrix:
    from scipy.sparse import csc_array

    if hasattr(found.matrix, "check_format"):
        found.matrix.check_format(full_check=True)  # SciPy trusts the indices of a file
    matrix = csc_array(found.matrix)
    if matrix.shape[0] != matrix.shape[1] or not matrix.shape[0]:
        rows, columns = matrix.shape
        raise InputError(f"{path}: a matrix of {rows} x {columns}; a square one is required")
    if np.iscomplexobj(matrix.data):
        if matrix.data.imag.any():
            raise InputError(f"{path}: a complex matrix; a real one is required")
        matrix = matrix.real
    matrix = matrix.astype(float)
    if not np.all(np.isfinite(matrix.data)):
        raise InputError(f"{path}: all entries must be finite")
    matrix.sum_duplicates()
    matrix.eliminate_zeros()
    return FileMatrix(matrix, found.labels, found.open_ended)


def _read(path: Path, suffix: str, key: str | None) -> FileMatrix:
    if suffix == ".mtx":
        return FileMatrix(read_matrix_market(path))
    if suffix == ".mat":
        return FileMatrix(_of_mat(path, key))
    if suffix == ".npz":
        return FileMatrix(_of_npz(path, key))
    if suffix == ".op4":
        return FileMatrix(_of_op4(path, key))
    if suffix in HARWELL_BOEING:
        return FileMatrix(read_harwell_boeing(path))
    matrix, labels = read_abaqus(path)
    return FileMatrix(matrix, labels, open_ended=labels is None)


def _picked(path: Path, found: dict[str, Any], key: str | None) -> Any:
    names = ", ".join(sorted(found)) or "none"
    if key is None and len(found) == 1:
        return next(iter(found.values()))
    if key is None:
        raise InputError(f"{path}: holds the matrices {names}; name one of them with key")
    if key not in found:
        raise InputError(f"{path}: holds no matrix {key}; it holds {names}")
    return found[key]


def _of_mat(path: Path, key: str | None) -> Any:
    from scipy.io import loadmat
    from scipy.io.matlab import matfile_version

    if matfile_version(path)[0] == 2:
        raise InputError(f"{path}: MATLAB's HDF5 form (-v7.3) is not read; save it with -v7")
    content = loadmat(path)
    found = {n: v for n, v in content.items() if not n.startswith("__") and _is_matrix(v)}
    return _picked(path, found, key)


def _is_matrix(value: Any) -> bool:
    return (
        getattr(value, "ndim", 0) == 2
        and getattr(value, "dtype", None) is not None
        and (value.dtype.kind in "fciub")
    )


def _of_npz(path: Path, key: str | None) -> Any:
    from scipy.sparse import load_npz

    with np.load(path, allow_pickle=False) as archive:
        if "format" not in archive.files:
            return _picked(path, {n: archive[n] for n in archive.files}, key)
    if key is not None:
        raise InputError(f"{path}: key {key} is not allowed; the file holds one sparse matrix")
    return load_npz(path)


def _of_op4(path: Path, key: str | None) -> Any:
    from pyyeti.nastran import op4

    return _picked(path, dict(op4.read(str(path), into="dct", sparse=True)), key)


def aligned(matrices: Sequence[FileMatrix]) -> list[Any]:
    """The matrices on common rows: by their labels where they have them, else as they stand.

    A matrix whose file does not tell its size gets the size of the largest; those with labels are
    placed among all (node, degree of freedom) that occur. Raises InputError if both kinds meet.
    """
    from scipy.sparse import coo_array, csc_array

    if not any(m.labels for m in matrices):
        n = max(m.matrix.shape[0] for m in matrices)
        result = []
        for m in matrices:
            matrix = csc_array(m.matrix)
            if m.open_ended:
                matrix.resize((n, n))
            result.append(matrix)
        return result
    if not all(m.labels for m in matrices):
        raise InputError("matrices with (node, dof) labels and without cannot be combined")
    every = sorted({label for m in matrices for label in m.labels or ()})
    place = {label: i for i, label in enumerate(every)}
    placed = []
    for m in matrices:
        rows = np.array([place[label] for label in m.labels or ()])
        entries = m.matrix.tocoo()
        where = (rows[entries.row], rows[entries.col])
        placed.append(coo_array((entries.data, where), shape=(len(every), len(every))).tocsc())
    return placed


def fingerprint(matrix: Any) -> str:
    """16 hexadecimal digits that depend on the entries only, not on the format or the file."""
    from scipy.sparse import csc_array

    canonical = csc_array(matrix).astype(float)
    canonical.sum_duplicates()
    canonical.eliminate_zeros()
    canonical.sort_indices()
    digest = hashlib.sha256(repr(canonical.shape).encode())
    digest.update(canonical.indptr.astype("<i8").tobytes())
    digest.update(canonical.indices.astype("<i8").tobytes())
    digest.update(canonical.data.astype("<f8").tobytes())
    return digest.hexdigest()[:16]


def write_matrix(path: Path | str, matrix: Any, key: str = "A") -> None:
    """Write a real matrix in the format of the suffix, every digit kept; `key` names it inside.

    Raises InputError for a suffix that is not written, and for what its format does not hold.
    """
    from scipy.sparse import csc_array

    path, sparse = Path(path), csc_array(matrix)
    suffix = path.suffix.lower()
    if suffix == ".mtx":
        from scipy.io import mmwrite

        write_whole(path, lambda s: mmwrite(s, sparse), binary=True)
    elif suffix == ".mat":
        from scipy.io import savemat

        write_whole(path, lambda s: savemat(s, {key: sparse}), binary=True)
    elif suffix == ".npz":
        from scipy.sparse import save_npz

        write_whole(path, lambda s: save_npz(s, sparse), binary=True)
    elif suffix in (".hb", ".rua"):
        from scipy.io import hb_write

        size = np.abs(sparse.data[sparse.data != 0.0])
        if not len(size) or size.min() < 1e-99 or size.max() >= 1e100:
            raise InputError(
                f"{path.name}: {suffix} holds matrices with entries of 1e-99 to 1e99; .mtx holds "
                "all"
            )
        write_whole(path, lambda s: hb_write(s, sparse))
    elif suffix in ABAQUS:
        write_whole(path, lambda s: _write_entries(s, sparse))
    else:
        raise InputError(
            f"{path.name}: the suffix must be one of .mtx, .mat, .npz, .hb, .rua, .inp, .txt to "
            "write"
        )


def _write_entries(stream: Any, matrix: Any) -> None:
    entries = matrix.tocoo()
    stream.write("** row, column, value; TYPE=UNSYMMETRIC\n")
    for i, j, value in zip(entries.row + 1, entries.col + 1, entries.data, strict=True):
        stream.write(f"{i} {j} {float(value)!r}\n")
    n = matrix.shape[0]
    if not matrix[n - 1, n - 1]:  # the last row tells how many there are
        stream.write(f"{n} {n} 0.0\n")
