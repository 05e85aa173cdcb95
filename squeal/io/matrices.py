"""Matrices from files and to files: checked, completed, on common rows, with a fingerprint."""

import hashlib
import re
from collections import Counter
from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import IO, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csc_array, issparse

from squeal.errors import InputError, missing
from squeal.io.formats.matrix_file import (
    MatrixFile,
    NamedMatrices,
    UnbuiltMatrix,
    check_indices,
    file_of_array,
)
from squeal.io.halves import complete
from squeal.io.matrix_formats import FORMATS, HEAD, Format
from squeal.io.writing import write_whole
from squeal.linear.matrices import given_matrix
from squeal.linear.precision import (
    Precision,
    precision_of_decimals,
    precision_of_floats,
    short_floats,
)
from squeal.schema import Place

PACKED = (b"\x1f\x8b", b"BZh", b"\xfd7zXZ\0")  # by gzip, bzip2, xz
LONGEST_REASON = 300  # characters of what a library says of a broken file

Matrix: TypeAlias = csc_array | NDArray
OpenedFiles: TypeAlias = dict[Path, MatrixFile | NamedMatrices]
OTHER_ROWS = (
    "matrices whose rows share labels can be combined only with matrices of the same rows; "
    "export them from one job"
)


def read_matrix(
    path: Path | str,
    key: str | None = None,
    symmetric: bool | None = None,
    opened: OpenedFiles | None = None,
) -> MatrixFile:
    """The square matrix in a file, a :class:`scipy.sparse.csc_array` (n, n) without explicit zeros.

    It is complex only if an entry has an imaginary part, as stiffness with structural damping.

    `key` names it in a file that holds several. `symmetric` says whether entries that stand on one
    side of the diagonal alone are meant for the other side too. Where neither `symmetric` nor the
    file says so, a matrix with such entries is completed with an `InputWarning` if it can only be
    one triangle of a symmetric matrix, and refused else. `opened` holds the contents of files that
    were read before, and gains those of this one. Raises InputError for anything that is no finite,
    square matrix.
    """
    path = Path(path)
    at = Place(str(path))
    name = path.suffix
    if opened is None:
        opened = {}
    try:
        file_format = _format_of(path)
        name = file_format.name
        if path not in opened:
            opened[path] = file_format.read(path)
        file = _pick(opened[path], key)
        _check_labels(file)
        matrix, is_guessed = complete(at, _checked(file.matrix), file, symmetric)
    except InputError as error:
        raise at.refuse(str(error)) from None
    except ImportError as error:
        raise at.refuse(
            f"{name} needs the package {missing(error)}, which is not installed"
        ) from None
    except Exception as error:  # each library has its own words for a broken file
        raise at.refuse(_reading_error(path, name, error)) from None
    assumptions = file.assumptions
    if is_guessed:
        assumptions += (f"{path.name}: each entry of one half is taken for both",)
    if file.numbered:
        assumptions += (f"{path.name}: rows that share labels are told apart by their numbers",)
    return replace(
        file,
        matrix=matrix,
        symmetric=False,  # completed: no entry stands for another one any more
        form=name,
        assumptions=assumptions,
        floats=file.floats or short_floats(file.matrix),
    )


def precision_of_file(file: MatrixFile, matrix: Matrix) -> Precision:
    """How far entries may be off by the digits, or the floats, that a file holds.

    matrix: that of the file (n, n), on the rows where it is used.
    """
    if file.decimals is not None:
        return precision_of_decimals(matrix, file.decimals)
    if file.digits is not None:
        return Precision(file.digits)
    return precision_of_floats(matrix, file.floats)


def _format_of(path: Path) -> Format:
    """The format of a file, by its first bytes or else by its suffix. Raises InputError and
    OSError."""
    if path.exists() and not path.is_file():  # a pipe would wait for ever
        raise InputError("is no plain file; the name of a matrix file is allowed")
    with path.open("rb") as stream:
        head = stream.read(HEAD)
    if head.startswith(PACKED):
        raise InputError("is packed; unpack it first")
    for file_format in FORMATS:
        if file_format.head and re.match(file_format.head, head):
            return file_format
    for file_format in FORMATS:
        if path.suffix.lower() in file_format.suffixes:
            return file_format
    known = []
    for file_format in FORMATS:
        known.append(f"{file_format.name} ({', '.join(file_format.suffixes)})")
    raise InputError(f"neither content nor suffix is of a format that is read: {', '.join(known)}")


def _reading_error(path: Path, format_name: str, error: Exception) -> str:
    """What is wrong with a file that no matrix can be read from."""
    reason = getattr(error, "strerror", None)
    if not path.exists():
        reason = reason or "no such name"
    if reason:
        return f"cannot be read ({reason}); the name of a matrix file is allowed"
    lines = str(error).strip().splitlines() or [type(error).__name__]
    first_line = lines[0].rstrip(".:")
    if len(first_line) > LONGEST_REASON:
        first_line = first_line[: LONGEST_REASON - 3] + "..."
    return f"no readable {format_name} matrix: {first_line}"


def _pick(content: MatrixFile | NamedMatrices, key: str | None) -> MatrixFile:
    """The matrix of a file that a key names; capital and small letters differ.

    `content` is what the reader of the format gave. A file of a format that holds one matrix takes
    no key. Of named matrices a key picks one; without it there must be a single one. Raises
    InputError.
    """
    if isinstance(content, MatrixFile):
        if key is None:
            return content
        raise InputError(f"key {key} is not allowed; the file holds one matrix")
    if not content:
        raise InputError("holds no matrix; of Nastran cards DMIG, OP4 and OP2 are read")
    described = []
    for name, matrix in sorted(content.items(), key=lambda item: item[0]):
        if isinstance(matrix, UnbuiltMatrix):
            name += f" ({matrix.description})"
        described.append(name)
    names = ", ".join(described)
    if key is None:
        if len(content) != 1:
            raise InputError(f"holds the matrices {names}; name one of them with key")
        (picked,) = content.values()
    elif key in content:
        picked = content[key]
    else:
        raise InputError(f"holds no matrix {key}; it holds {names}")
    # a matrix file, a bare matrix, or a description of one that is built only now
    if isinstance(picked, UnbuiltMatrix):
        return picked.build()
    if isinstance(picked, MatrixFile):
        return picked
    if issparse(picked):
        return MatrixFile(picked)
    return file_of_array(picked)


def _check_labels(file: MatrixFile) -> None:
    """Refuse labels that name several rows: rows of one label would be added when files are
    combined. Raises InputError."""
    rows_of_labels = Counter(file.labels or ())
    repeated = [label for label, rows in rows_of_labels.items() if rows > 1]
    if repeated:
        node, freedom = repeated[0]
        raise InputError(
            f"{len(repeated)} labels name several rows, the first is degree of freedom {freedom} "
            f"of node {node}; each row must have a label of its own"
        )


def _checked(matrix: csc_array) -> csc_array:
    """The matrix, canonical, if it is square and finite. Raises InputError."""
    if hasattr(matrix, "check_format"):
        check_indices(matrix)
    rows, columns = matrix.shape
    if rows != columns or not rows:
        raise InputError(f"a matrix of {rows} x {columns}; a square one is required")
    return _canonical(matrix)


def _canonical(matrix: Matrix) -> csc_array:
    """A copy as CSC array, sorted, every place once and no zeros; real if all its entries are."""
    copy = csc_array(given_matrix(matrix), copy=True)
    copy.sum_duplicates()
    copy.eliminate_zeros()
    return copy


def aligned(files: Sequence[MatrixFile]) -> list[csc_array]:
    """The matrices on common rows: by their labels where they have them, else as they stand.

    A matrix whose file does not tell its size gets the size of the largest; matrices with labels
    are placed among all (node, degree of freedom) that occur.

    Raises InputError if only some matrices have labels. It also raises InputError if labels differ
    and some rows have a row number in place of a node (`MatrixFile.numbered`): another file may
    mean another row by the same number.
    """
    if not any(file.labels for file in files):
        return _at_common_size(files)
    if not all(file.labels for file in files):
        raise InputError("matrices with (node, dof) labels and without cannot be combined")
    labels_differ = any(file.labels != files[0].labels for file in files)
    if labels_differ and any(file.numbered for file in files):
        raise InputError(OTHER_ROWS)
    labels = all_labels(files)
    return [on_rows(file, labels) for file in files]


def on_rows(file: MatrixFile, labels: Sequence[Hashable]) -> csc_array:
    """The matrix of a file with labels, on the rows of `labels`."""
    row_of_label = {label: row for row, label in enumerate(labels)}
    rows = np.array([row_of_label[label] for label in file.labels or ()])
    entries = file.matrix.tocoo()
    positions = (rows[entries.row], rows[entries.col])
    n = len(labels)
    return coo_array((entries.data, positions), shape=(n, n)).tocsc()


def _at_common_size(files: Sequence[MatrixFile]) -> list[csc_array]:
    """The matrices; where the file does not tell its size, at the size of the largest."""
    n = max(file.matrix.shape[0] for file in files)
    matrices = []
    for file in files:
        matrix = csc_array(file.matrix)
        if file.open_ended:
            matrix.resize((n, n))
        matrices.append(matrix)
    return matrices


def all_labels(files: Sequence[MatrixFile]) -> list[tuple[int, int]]:
    """The (node, degree of freedom) of the common rows, none if they are not named so."""
    labels: set[tuple[int, int]] = set()
    for file in files:
        labels.update(file.labels or ())
    return sorted(labels)


def fingerprint(matrix: Matrix) -> str:
    """16 hexadecimal digits that depend on the entries only, not on the format or the file."""
    entries = _canonical(matrix)
    digest = hashlib.sha256(repr(entries.shape).encode())
    digest.update(entries.indptr.astype("<i8").tobytes())
    digest.update(entries.indices.astype("<i8").tobytes())
    value_type = "<c16" if np.iscomplexobj(entries) else "<f8"
    digest.update(entries.data.astype(value_type).tobytes())
    return digest.hexdigest()[:16]


def write_matrix(path: Path | str, matrix: Matrix, key: str = "A") -> None:
    """Write a matrix in the format of the suffix, with every digit; `key` names it inside.

    Raises InputError for a suffix that is not written.
    """
    from scipy.io import mmwrite, savemat
    from scipy.sparse import save_npz

    path = Path(path)
    sparse = csc_array(matrix)
    writers: dict[str, Callable[[IO[bytes]], None]] = {
        ".mtx": lambda stream: mmwrite(stream, sparse),
        ".mat": lambda stream: savemat(stream, {key: sparse}),
        ".npz": lambda stream: save_npz(stream, sparse),
    }
    suffix = path.suffix.lower()
    if suffix not in writers:
        raise InputError(f"{path.name}: the suffix must be one of {', '.join(writers)} to write")
    write_whole(path, writers[suffix])
