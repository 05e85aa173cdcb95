"""Matrices in files: one table of formats, recognised by their content or else by their suffix.

To add a format: a function that returns `Found` and a line of `FORMATS`, which is where refusals,
documentation and `squeal` itself find it; its round trip goes to tests/io/test_matrices.py.
"""

import hashlib
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csc_array, issparse

from squeal.errors import InputError, InputWarning
from squeal.io.matrix_text import (
    Found,
    is_abaqus,
    is_harwell_boeing,
    mirrored,
    one_sided,
    read_abaqus,
    read_harwell_boeing,
    read_matrix_market,
)
from squeal.io.writing import write_whole

HEAD = 4096  # bytes that a format is recognised by


@dataclass(frozen=True)
class Format:
    """One kind of matrix file.

    `recognises` judges by the first bytes; None leaves it to the suffix. `read` takes the path,
    and of a format that is `keyed` the name of the matrix in the file too.
    """

    name: str
    suffixes: tuple[str, ...]
    recognises: Callable[[bytes], bool] | None
    read: Callable[..., Found]
    keyed: bool = False


def _picked(path: Path, found: dict[str, Any], key: str | None) -> Found:
    names = ", ".join(sorted(found)) or "none"
    if key is None and len(found) != 1:
        raise InputError(f"{path}: holds the matrices {names}; name one of them with key")
    alike = [n for n in found if key is None or n == key]
    alike = alike or [n for n in found if key and n.lower() == key.lower()]  # op4 in small letters
    if len(alike) != 1:
        raise InputError(f"{path}: holds no matrix {key}; it holds {names}")
    return Found(found[alike[0]])


def _read_mat(path: Path, key: str | None) -> Found:
    from scipy.io import loadmat
    from scipy.io.matlab import matfile_version

    if matfile_version(path)[0] == 2:
        raise InputError(f"{path}: MATLAB's HDF5 form (-v7.3) is not read; save it with -v7")
    content = loadmat(path, spmatrix=False)
    found = {n: v for n, v in content.items() if not n.startswith("__") and _is_matrix(v)}
    return _picked(path, found, key)


def _is_matrix(value: Any) -> bool:
    kind = getattr(getattr(value, "dtype", None), "kind", "O")
    return getattr(value, "ndim", 0) == 2 and kind in "fciub"


def _read_npz(path: Path, key: str | None) -> Found:
    from scipy.sparse import load_npz

    with np.load(path, allow_pickle=False) as archive:
        if "format" not in archive.files:
            return _picked(path, {n: archive[n] for n in archive.files}, key)
    if key is not None:
        raise InputError(f"{path}: key {key} is not allowed; the file holds one sparse matrix")
    return Found(load_npz(path))


def _read_op4(path: Path, key: str | None) -> Found:
    from pyyeti.nastran import op4

    return _picked(path, dict(op4.read(str(path), into="dct", sparse=True)), key)


# fmt: off
FORMATS = (
    Format("Matrix Market", (".mtx",), lambda head: head[:14].lower() == b"%%matrixmarket",
           read_matrix_market),
    Format("MATLAB", (".mat",), lambda head: head.startswith(b"MATLAB "), _read_mat, keyed=True),
    Format("NumPy", (".npz",), lambda head: head.startswith(b"PK\x03\x04"), _read_npz, keyed=True),
    Format("Harwell-Boeing", (".hb", ".rua", ".rsa"), is_harwell_boeing, read_harwell_boeing),
    Format("Nastran OP4", (".op4",), None, _read_op4, keyed=True),
    Format("Abaqus text", (".inp", ".txt", ".sti", ".mas"), is_abaqus, read_abaqus),
)
# fmt: on


def _format_of(path: Path) -> Format:
    if path.exists() and not path.is_file():  # a pipe would wait for ever
        raise InputError(f"{path}: is no plain file; the name of a matrix file is allowed")
    with path.open("rb") as stream:
        head = stream.read(HEAD)
    for one in FORMATS:
        if one.recognises and one.recognises(head):
            return one
    for one in FORMATS:
        if path.suffix.lower() in one.suffixes:
            return one
    known = ", ".join(f"{one.name} ({', '.join(one.suffixes)})" for one in FORMATS)
    raise InputError(f"{path}: neither content nor suffix is of a format that is read: {known}")


def read_matrix(path: Path | str, key: str | None = None, symmetric: bool | None = None) -> Found:
    """The real square matrix in a file, as a SciPy CSC array (n, n) without explicit zeros.

    Parameters
    ----------
    path
        The file; its format is recognised by its content, else by its suffix.
    key
        The name of the matrix, in a file that holds several.
    symmetric
        Whether entries on one side of the diagonal alone stand for the other side too; None
        leaves that to the file. Where the file does not say either, a matrix that looks as Abaqus
        writes a symmetric one is completed with an `InputWarning`, and any other is refused.

    Raises
    ------
    InputError
        With one sentence for anything that is no real, finite, square matrix.
    """
    path = Path(path)
    name = path.suffix
    try:
        form = _format_of(path)
        name = form.name
        if key is not None and not form.keyed:
            keyed = ", ".join(one.name for one in FORMATS if one.keyed)
            raise InputError(f"{path}: key {key} is not allowed; {keyed} files hold keys")
        found = form.read(path, key) if form.keyed else form.read(path)
        matrix = _checked(path, found.matrix)
        complete = _complete(path, matrix, found, symmetric)
        return Found(complete, found.labels, found.open_ended)
    except InputError:
        raise
    except ImportError as error:
        raise InputError(
            f"{path}: reading {name} needs the package {error.name}, which is not installed"
        ) from None
    except MemoryError:
        raise InputError(f"{path}: the matrix is too large for this machine's memory") from None
    except Exception as error:  # each library has its own words for a broken file
        reason = getattr(error, "strerror", None)
        if reason:
            raise InputError(
                f"{path}: cannot be read ({reason}); the name of a matrix file is allowed"
            ) from None
        lines = str(error).strip().splitlines()
        words = lines[0].rstrip(".:") if lines else type(error).__name__
        raise InputError(f"{path}: no readable {name} matrix: {words}") from None


def _checked(path: Path, given: Any) -> Any:
    if issparse(given):
        given.check_format(full_check=True)  # SciPy trusts the indices of a file
    matrix = csc_array(given)
    rows, columns = matrix.shape
    if rows != columns or not rows:
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
    return matrix


def _complete(path: Path, matrix: Any, found: Found, symmetric: bool | None) -> Any:
    """The matrix with its other triangle where it stands for that too. Raises InputError."""
    said = found.symmetric if symmetric is None else symmetric
    one = one_sided(csc_array(found.matrix))  # a zero that is written is an entry too
    if said is None and one and matrix.nnz > np.count_nonzero(matrix.diagonal()):
        if found.labels is None or not _as_abaqus_writes(matrix, np.array(found.labels)[:, 0]):
            raise InputError(
                f"{path}: all entries stand on one side of the diagonal, and nothing says whether "
                "they stand for the other side too; the key symmetric: true or symmetric: false "
                "beside the file must"
            )
        warnings.warn(
            f"{path}: all entries stand on one side of the diagonal; they are taken for the other "
            "side too, as Abaqus writes symmetric matrices (symmetric: false beside the file says "
            "otherwise)",
            InputWarning,
            stacklevel=3,
        )
        said = True
    if said and one:
        return mirrored(matrix)
    if said and abs(matrix - matrix.T).max() > 0.0:
        raise InputError(f"{path}: is not symmetric; symmetric: true is not allowed")
    return matrix


def _as_abaqus_writes(matrix: Any, nodes: NDArray[np.intp]) -> bool:
    """True if a triangle can only be that of a symmetric stiffness or mass.

    It couples different nodes, which a one-sided law does not do without its mirror image, and no
    entry is greater than the diagonal of its row and column allows (k_ij^2 <= k_ii k_jj), which a
    part such as friction without its own diagonal does not satisfy.
    """
    entries = matrix.tocoo()
    rows, columns = entries.coords
    off = rows != columns
    diagonal = matrix.diagonal()
    bound = diagonal[rows[off]] * diagonal[columns[off]]
    positive = bool(np.all(diagonal >= 0.0) and np.all(entries.data[off] ** 2 <= bound))
    return positive and bool(np.any(nodes[rows[off]] != nodes[columns[off]]))


def aligned(matrices: Sequence[Found]) -> list[Any]:
    """The matrices on common rows: by their labels where they have them, else as they stand.

    A matrix whose file does not tell its size gets the size of the largest; those with labels are
    placed among all (node, degree of freedom) that occur. Raises InputError if both kinds meet.
    """
    if not any(m.labels for m in matrices):
        n = max(m.matrix.shape[0] for m in matrices)
        result = [csc_array(m.matrix) for m in matrices]
        for m, matrix in zip(matrices, result, strict=True):
            if m.open_ended:
                matrix.resize((n, n))
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
    from scipy.io import hb_write, mmwrite, savemat
    from scipy.sparse import save_npz

    path, sparse = Path(path), csc_array(matrix)
    suffix = path.suffix.lower()
    writers: dict[str, Callable[[Any], None]] = {
        ".mtx": lambda stream: mmwrite(stream, sparse),
        ".mat": lambda stream: savemat(stream, {key: sparse}),
        ".npz": lambda stream: save_npz(stream, sparse),
        **dict.fromkeys((".hb", ".rua"), lambda stream: hb_write(stream, sparse)),
        **dict.fromkeys((".inp", ".txt"), lambda stream: _write_entries(stream, sparse)),
    }
    if suffix not in writers:
        raise InputError(f"{path.name}: the suffix must be one of {', '.join(writers)} to write")
    size = np.abs(sparse.data[sparse.data != 0.0])
    narrow = suffix in (".hb", ".rua")
    if narrow and not (len(size) and size.min() >= 1e-99 and size.max() < 1e100):
        raise InputError(
            f"{path.name}: {suffix} holds matrices with entries of 1e-99 to 1e99; .mtx holds all"
        )
    write_whole(path, writers[suffix], binary=suffix in (".mtx", ".mat", ".npz"))


def _write_entries(stream: Any, matrix: Any) -> None:
    entries = matrix.tocoo()
    stream.write("** row, column, value; TYPE=UNSYMMETRIC\n")
    table = np.column_stack([entries.row + 1, entries.col + 1, entries.data])
    np.savetxt(stream, table, fmt="%d %d %.17g")
    n = matrix.shape[0]
    if not matrix[n - 1, n - 1]:  # the last row tells how many there are
        stream.write(f"{n} {n} 0.0\n")
