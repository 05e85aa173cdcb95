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
from scipy.sparse import coo_array, csc_array, diags_array, issparse

from squeal.errors import InputError, missing
from squeal.io.formats.matrix_file import (
    Labels,
    MatrixFile,
    NamedMatrices,
    UnbuiltMatrix,
    check_indices,
    file_of_array,
    has_internal_nodes,
    is_half,
    mirror_half,
)
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

FREE_MOTION = 1e-8  # of the diagonal: pivots below are those of a free body
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
        matrix, is_guessed = _complete(at, _checked(file.matrix), file, symmetric)
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
        symmetric=False,
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
    """The matrix of a file that a key names, in either case of its letters.

    `content` is what the reader of the format gave: the only matrix, for which no key is allowed,
    or all by their names, of which a single one needs none. Raises InputError.
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
        in_other_case = [name for name in content if name.lower() == key.lower()]
        if len(in_other_case) != 1:
            raise InputError(f"holds no matrix {key}; it holds {names}")
        picked = content[in_other_case[0]]
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


def _complete(
    at: Place, matrix: csc_array, file: MatrixFile, symmetric: bool | None
) -> tuple[csc_array, bool]:
    """The full matrix of a file that may hold one triangle of it, and whether that is a guess.

    - Declared symmetric, by the user or else by the file: the other triangle is added.
    - Declared not symmetric: the matrix as it is, with a warning if only the file says so and the
      matrix looks like one triangle.
    - Not declared: a matrix with entries on both sides of the diagonal, or on it alone, as it is;
      one triangle is completed as a guess, with a warning, if it can only be that of a symmetric
      matrix.

    Parameters
    ----------
    at : Place
        The file, for messages.
    matrix : csc_array (n, n)
        The matrix of `file`, checked.
    symmetric : bool or None
        Whether the user says that one triangle stands for both, which counts before what the file
        says; None for nothing.

    Raises
    ------
    InputError
        Where nothing declares one triangle, and it may be that of a symmetric matrix or not; where
        a matrix declared symmetric is not.
    """
    declared = symmetric
    if declared is None:
        declared = file.symmetric
    if symmetric is False:
        return matrix, False
    # whether one side of the diagonal has no entries; zeros that the file holds are entries too
    half = is_half(csc_array(file.matrix))
    is_diagonal = matrix.nnz == np.count_nonzero(matrix.diagonal())
    one_sided = "no entry has another one on the other side of the diagonal"
    nodes = np.arange(matrix.shape[0])  # where nothing names them, each row is one
    if file.labels:
        nodes = np.array(file.labels)[:, 0]
    if declared is False:
        if half and not is_diagonal and _is_symmetric_triangle(matrix, nodes):
            at.warn(
                f"{one_sided}, as in half of a symmetric matrix, and the rest is taken as zero "
                "(symmetric: true beside the file completes it, symmetric: false confirms it)"
            )
        return matrix, False
    if declared:
        if half:
            if symmetric and not has_internal_nodes(file.labels) and _lacks_diagonal(matrix):
                at.warn(
                    "entries stand in rows whose diagonal is empty, as of friction or constraints, "
                    "and each is taken for both (of friction symmetric: false is right)"
                )
            return mirror_half(matrix), False
        if abs(matrix - matrix.T).max() > 0.0:
            raise InputError("is not symmetric; symmetric: true is not allowed")
        return matrix, False
    if not half or is_diagonal:
        return matrix, False
    if file.labels is None or not _is_symmetric_triangle(matrix, nodes):
        raise InputError(
            f"{one_sided}, and nothing says whether each stands for both; say it by the key "
            "symmetric: true or symmetric: false beside the file"
        )
    completed = mirror_half(matrix)
    if Path(at.source).suffix.lower() != ".mas":  # a mass, which friction leaves symmetric
        _refuse_one_sided(at, completed, file.labels)
    at.warn(
        f"{one_sided}, they couple different nodes, and none is too great for the diagonal; each "
        "is taken for both (symmetric: false beside the file says otherwise)"
    )
    return completed, True


def _refuse_one_sided(at: Place, completed: csc_array, labels: Labels) -> None:
    """Refuse half a matrix that may be the half of an unsymmetric one, as CalculiX writes it.

    It is refused if the input file beside it has friction, or if the completed matrix has negative
    eigenvalues, which no stiffness or mass of a structure has. Matrices with internal nodes, whose
    numbers are below zero, may have some: in Abaqus these hold Lagrange multipliers. Raises
    InputError.
    """
    advice = (
        "friction makes a stiffness unsymmetric, and CalculiX writes one half of it. Export the "
        "stiffness without friction and the contact as a matrix of its own, or join the bodies as "
        "components"
    )
    deck = Path(at.source).with_suffix(".inp")
    if deck.is_file():
        lines = deck.read_text(encoding="latin-1").upper().splitlines()
        if any(line.startswith("*FRICTION") for line in lines):
            raise InputError(f"holds one half of a matrix, and {deck.name} has *FRICTION; {advice}")
    if has_internal_nodes(labels):
        return
    negative = negative_pivots(completed)
    if negative:
        raise InputError(
            f"holds one half of a matrix whose completion has {negative} negative eigenvalues, "
            f"which no structure has; {advice}, or say symmetric: true beside the file"
        )


def negative_pivots(matrix: csc_array) -> int:
    """The number of negative eigenvalues of a symmetric sparse matrix, by the signs of its pivots.

    They are as many by Sylvester's law of inertia. Those within 1e-8 of the diagonal are taken for
    the zeros of a free body.
    """
    from scipy.sparse.linalg import splu

    shift = diags_array(FREE_MOTION * np.abs(matrix.diagonal()))
    try:
        factors = splu(
            csc_array(matrix + shift),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
    except RuntimeError:  # exactly singular: a row without stiffness says nothing
        return 0
    return int(np.count_nonzero(factors.U.diagonal() < 0.0))


def _lacks_diagonal(matrix: csc_array) -> bool:
    """True if an entry beside the diagonal stands in a row or column without an entry on it.

    No positive semidefinite matrix, thus no stiffness or mass of a structure, has such an entry.
    """
    rows, columns = matrix.tocoo().coords
    is_empty = matrix.diagonal() == 0.0
    return bool(np.any(is_empty[rows] | is_empty[columns]))


def _is_symmetric_triangle(matrix: csc_array, nodes: NDArray) -> bool:
    """True if a triangle (n, n), with rows of some nodes (n,), can only be that of a symmetric
    stiffness or mass.

    Two conditions hold of such a triangle. It couples different nodes, which a full matrix would do
    on both sides of the diagonal. And as in each positive semidefinite matrix k_ij^2 <= k_ii k_jj,
    which the matrix of friction alone does not satisfy. Rows of internal nodes, whose numbers are
    below zero, are exempt: Lagrange multipliers have no diagonal.
    """
    rows, columns = matrix.tocoo().coords
    entries = matrix.data.real
    diagonal = matrix.diagonal().real
    exempt = (nodes[rows] < 0) | (nodes[columns] < 0) | (rows == columns)
    fits = exempt | (entries**2 <= diagonal[rows] * diagonal[columns])
    has_positive_diagonal = np.all(diagonal[nodes >= 0] >= 0.0)
    couples_nodes = np.any(nodes[rows] != nodes[columns])
    return bool(has_positive_diagonal and np.all(fits) and couples_nodes)


def aligned(files: Sequence[MatrixFile]) -> list[csc_array]:
    """The matrices on common rows: by their labels where they have them, else as they stand.

    A matrix whose file does not tell its size gets the size of the largest; matrices with labels
    are placed among all (node, degree of freedom) that occur. Raises InputError if matrices with
    and without labels meet, or if rows of one are told apart by their numbers alone (`numbered`)
    and labels differ.
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
