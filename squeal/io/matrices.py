"""Matrices from files and to files: checked, completed, on common rows, with a fingerprint."""

import hashlib
import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csc_array, diags_array

from squeal.errors import InputError, missing
from squeal.io.matrix_formats import (
    FORMATS,
    HEAD,
    MatrixFile,
    UnbuiltMatrix,
    is_half,
    mirrored,
    sound,
)
from squeal.io.writing import write_whole
from squeal.linear.matrices import given_matrix
from squeal.schema import Place

FREE_MOTION = 1e-8  # of the diagonal: pivots below are those of a free body


def _picked(found: MatrixFile | dict[str, Any], key: str | None) -> MatrixFile:
    """The matrix that a key names. Raises InputError."""
    if isinstance(found, MatrixFile):
        if key is None:
            return found
        raise InputError(f"key {key} is not allowed; the file holds one matrix")
    names = ", ".join(_described(name, found[name]) for name in sorted(found)) or "none"
    if key is None and len(found) != 1:
        raise InputError(f"holds the matrices {names}; name one of them with key")
    alike = [n for n in found if key is None or n.lower() == key.lower()]  # op4: small letters
    name = key if key in found else alike[0] if len(alike) == 1 else None
    if name is None:
        raise InputError(f"holds no matrix {key}; it holds {names}")
    one = found[name]
    if isinstance(one, UnbuiltMatrix):
        one = one.build()
    return one if isinstance(one, MatrixFile) else MatrixFile(one)


def _described(name: str, matrix: object) -> str:
    """The name of one of several matrices, with its form where the format has one."""
    return f"{name} ({matrix.form})" if isinstance(matrix, UnbuiltMatrix) else name


def read_matrix(
    path: Path | str,
    key: str | None = None,
    symmetric: bool | None = None,
    opened: dict[Path, Any] | None = None,
) -> MatrixFile:
    """The square matrix in a file, a :class:`scipy.sparse.csc_array` (n, n) without explicit zeros.

    It is complex only if an entry has an imaginary part, as stiffness with structural damping.

    `key` names it in a file that holds several. `symmetric` says whether entries on one side of
    the diagonal alone stand for the other side too; where neither it nor the file does, a matrix
    that looks as Abaqus writes a symmetric one is completed with an `InputWarning`, and any other
    is refused. `opened` holds what was read before of files that hold several, and gains what is.
    Raises InputError for anything that is no finite, square matrix.
    """
    path, opened = Path(path), {} if opened is None else opened
    at, name = Place(str(path)), path.suffix
    try:
        if path.exists() and not path.is_file():  # a pipe would wait for ever
            raise InputError("is no plain file; the name of a matrix file is allowed")
        with path.open("rb") as stream:
            head = stream.read(HEAD)
        fitting = [one for one in FORMATS if one.head and re.match(one.head, head)]
        fitting += [one for one in FORMATS if name.lower() in one.suffixes]
        if not fitting:
            known = ", ".join(f"{one.name} ({', '.join(one.suffixes)})" for one in FORMATS)
            raise InputError(f"neither content nor suffix is of a format that is read: {known}")
        name = fitting[0].name
        if path not in opened:
            opened[path] = fitting[0].read(path)
        file = _picked(opened[path], key)
        _unique(file)
        matrix, completed = _complete(at, _checked(file.matrix), file, symmetric)
        assumptions = file.assumptions
        if completed:
            assumptions += (f"{path.name}: each entry of one half is taken for both",)
        if file.numbered:
            assumptions += (f"{path.name}: rows that share labels are told apart by their numbers",)
        return replace(file, matrix=matrix, symmetric=False, form=name, assumptions=assumptions)
    except InputError as error:
        words = str(error)
    except ImportError as error:
        words = f"{name} needs the package {missing(error)}, which is not installed"
    except Exception as error:  # each library has its own words for a broken file
        lines = str(error).strip().splitlines() or [type(error).__name__]
        said = lines[0].rstrip(".:")
        words = f"no readable {name} matrix: {said if len(said) <= 300 else said[:297] + '...'}"
        if reason := getattr(error, "strerror", None) or "no such name" * (not path.exists()):
            words = f"cannot be read ({reason}); the name of a matrix file is allowed"
    raise at.refuse(words)


def _unique(file: MatrixFile) -> None:
    """Refuse labels that name several rows: rows of one label would be added when files are
    combined. Raises InputError."""
    count = Counter(file.labels or ())
    repeated = [label for label, rows in count.items() if rows > 1]
    if repeated:
        node, dof = repeated[0]
        raise InputError(
            f"{len(repeated)} labels name several rows, the first is degree of freedom {dof} of "
            f"node {node}; each row must have a label of its own"
        )


def _checked(given: Any) -> Any:
    """The matrix, canonical, if it is square and finite. Raises InputError."""
    if hasattr(given, "check_format"):
        sound(given)
    matrix = csc_array(given)
    rows, columns = matrix.shape
    if rows != columns or not rows:
        raise InputError(f"a matrix of {rows} x {columns}; a square one is required")
    return _canonical(matrix)


def _canonical(matrix: Any) -> Any:
    """A copy as CSC array, sorted, every place once and no zeros; real if all its entries are."""
    copy = csc_array(given_matrix(matrix), copy=True)
    copy.sum_duplicates()
    copy.eliminate_zeros()
    return copy


def _complete(at: Place, matrix: Any, file: MatrixFile, symmetric: bool | None) -> tuple[Any, bool]:
    """The matrix with its other triangle where it stands for that too, and whether nothing said
    that it does. Raises InputError."""
    said = file.symmetric if symmetric is None else symmetric
    half = said is not False and is_half(csc_array(file.matrix))  # a zero is an entry too
    if said is None and half and matrix.nnz > np.count_nonzero(matrix.diagonal()):
        words = "no entry has another one on the other side of the diagonal"
        if file.labels is None or not _as_abaqus_writes(matrix, np.array(file.labels)[:, 0]):
            raise InputError(
                f"{words}, and nothing says whether each stands for both; the key "
                "symmetric: true or symmetric: false beside the file must"
            )
        if Path(at.source).suffix.lower() != ".mas":  # a mass, whatever friction does
            _refuse_one_sided(at, mirrored(matrix), file.labels)
        at.warn(
            f"{words}; each is taken for both, as Abaqus writes symmetric matrices "
            "(symmetric: false beside the file says otherwise)"
        )
        return mirrored(matrix), True
    if said and half:
        return mirrored(matrix), False
    if said and abs(matrix - matrix.T).max() > 0.0:
        raise InputError("is not symmetric; symmetric: true is not allowed")
    return matrix, False


def _refuse_one_sided(at: Place, completed: Any, labels: Sequence[tuple[int, int]]) -> None:
    """Refuse half a matrix that may be the half of an unsymmetric one, as CalculiX writes it.

    Its input file beside it has friction, or the completed matrix is indefinite, which no stiffness
    or mass of a structure is; multipliers in internal nodes, below zero, make it so in Abaqus.
    Raises InputError.
    """
    way_on = (
        "friction makes a stiffness unsymmetric, and CalculiX writes one half of it. Export the "
        "stiffness without friction and the contact as a matrix of its own, or join the bodies as "
        "components"
    )
    deck = Path(at.source).with_suffix(".inp")
    if deck.is_file():
        lines = deck.read_text(encoding="latin-1").upper().splitlines()
        if any(line.startswith("*FRICTION") for line in lines):
            raise InputError(f"holds one half of a matrix, and {deck.name} has *FRICTION; {way_on}")
    has_multipliers = any(node < 0 for node, _ in labels)
    negative = 0 if has_multipliers else negative_pivots(completed)
    if negative:
        raise InputError(
            f"holds one half of a matrix whose completion has {negative} negative eigenvalues, "
            f"which no structure has; {way_on}, or say symmetric: true beside the file"
        )


def negative_pivots(matrix: Any) -> int:
    """The number of negative eigenvalues of a symmetric sparse matrix, by the signs of its pivots.

    Those within 1e-8 of the diagonal are taken for the zeros of a free body.
    """
    from scipy.sparse.linalg import splu

    shift = diags_array(FREE_MOTION * np.abs(matrix.diagonal()))
    options = {"SymmetricMode": True}
    try:
        factors = splu(
            csc_array(matrix + shift),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options=options,
        )
    except RuntimeError:  # exactly singular: a row without stiffness says nothing
        return 0
    return int(np.count_nonzero(factors.U.diagonal() < 0.0))


def _as_abaqus_writes(matrix: Any, nodes: NDArray[np.intp]) -> bool:
    """True if a triangle can only be that of a symmetric stiffness or mass.

    It couples different nodes, which a one-sided law does not do without its mirror image, and no
    entry is greater than the diagonal of its row and column allows (k_ij^2 <= k_ii k_jj), which a
    part such as friction without its own diagonal does not satisfy. Rows of internal nodes, below
    zero, may have none: Lagrange multipliers.
    """
    (rows, columns), data = matrix.tocoo().coords, matrix.data.real
    diagonal = matrix.diagonal().real
    free = (nodes[rows] < 0) | (nodes[columns] < 0) | (rows == columns)
    fits = free | (data**2 <= diagonal[rows] * diagonal[columns])
    positive = np.all(diagonal[nodes >= 0] >= 0.0) and np.all(fits)
    return bool(positive and np.any(nodes[rows] != nodes[columns]))


def aligned(files: Sequence[MatrixFile]) -> list[Any]:
    """The matrices on common rows: by their labels where they have them, else as they stand.

    A matrix whose file does not tell its size gets the size of the largest; those with labels are
    placed among all (node, degree of freedom) that occur. Raises InputError if both kinds meet.
    """
    if not any(file.labels for file in files):
        n = max(file.matrix.shape[0] for file in files)
        result = [csc_array(file.matrix) for file in files]
        for file, matrix in zip(files, result, strict=True):
            if file.open_ended:
                matrix.resize((n, n))
        return result
    if not all(file.labels for file in files):
        raise InputError("matrices with (node, dof) labels and without cannot be combined")
    if any(file.numbered and file.labels != files[0].labels for file in files):
        raise InputError(
            "matrices whose rows share labels can be combined only with matrices of the same rows; "
            "export them from one job"
        )
    every = all_labels(files)
    place, shape = {label: i for i, label in enumerate(every)}, (len(every), len(every))
    placed = []
    for file in files:
        rows, entries = np.array([place[x] for x in file.labels or ()]), file.matrix.tocoo()
        where = (rows[entries.row], rows[entries.col])
        placed.append(coo_array((entries.data, where), shape=shape).tocsc())
    return placed


def all_labels(files: Sequence[MatrixFile]) -> list[tuple[int, int]]:
    """The (node, degree of freedom) of the common rows, none if they are not named so."""
    return sorted({label for file in files for label in file.labels or ()})


def fingerprint(matrix: Any) -> str:
    """16 hexadecimal digits that depend on the entries only, not on the format or the file."""
    entries = _canonical(matrix)
    digest = hashlib.sha256(repr(entries.shape).encode())
    of_data = "<c16" if np.iscomplexobj(entries) else "<f8"
    parts = (entries.indptr, "<i8"), (entries.indices, "<i8"), (entries.data, of_data)
    for numbers, kind in parts:
        digest.update(numbers.astype(kind).tobytes())
    return digest.hexdigest()[:16]


def write_matrix(path: Path | str, matrix: Any, key: str = "A") -> None:
    """Write a matrix in the format of the suffix, with every digit; `key` names it inside.

    Raises InputError for a suffix that is not written.
    """
    from scipy.io import mmwrite, savemat
    from scipy.sparse import save_npz

    path, sparse = Path(path), csc_array(matrix)
    writers: dict[str, Callable[[Any], None]] = {
        ".mtx": lambda stream: mmwrite(stream, sparse),
        ".mat": lambda stream: savemat(stream, {key: sparse}),
        ".npz": lambda stream: save_npz(stream, sparse),
    }
    if path.suffix.lower() not in writers:
        raise InputError(f"{path.name}: the suffix must be one of {', '.join(writers)} to write")
    write_whole(path, writers[path.suffix.lower()], binary=True)
