"""Systems of matrices from files: lists of terms with a factor each, or powers of one parameter.

Their keys stand in `squeal.io.system_keys`. In place of K there may be K0, K1, ..., rows of
numbers: K is then K0 + K1 mu + K2 mu^2 + ...; C likewise.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array

from squeal.io.coordinates import Coordinates, read_coordinates, read_elements
from squeal.io.digits import MOST as MOST_DIGITS
from squeal.io.formats.matrix_file import MatrixFile
from squeal.io.matrices import (
    Matrix,
    OpenedFiles,
    aligned,
    all_labels,
    precision_of_file,
    read_matrix,
)
from squeal.io.system_keys import MOST_ROWS, POWERS, SYSTEM, Document, named_files
from squeal.io.tables import read_rising
from squeal.io.terms import (
    PARTS,
    TermDamping,
    TermKeys,
    factor_of,
    formula_of,
    swept_parameter,
    terms_of,
)
from squeal.linear.damping import Damped, damped
from squeal.linear.labels import rows_in_words
from squeal.linear.matrices import dense, normalised_system
from squeal.linear.precision import Precision, half_units
from squeal.linear.supports import empty_rows_warning, supports_warning
from squeal.linear.system import (
    TermSystem,
    warn_of_unused_parameters,
    without_empty_rows,
    without_supports,
)
from squeal.linear.terms import Term
from squeal.schema import NOT_NEGATIVE, Place

FULL = 0.2  # share of entries above which a matrix from a file becomes dense


class Origin(NamedTuple):
    """Where the matrix of a term came from.

    Attributes
    ----------
    part : str
        The key of its part: M, C, K, K4 or, of an assembly, that behind the component's name.
    file : str
        Its file; empty if it stands in the system file.
    factor : str
        The formula that multiplies it.
    matrix : csc_array (n, n)
        The matrix, on the rows of the system.
    form : str
        The format that was read.
    labelled : bool
        Whether the file names its rows.
    key : str
        Its key in a file of several; empty without.
    digits : int or None
        The significant digits that it was rounded to, None if it is exact or holds doubles.
    """

    part: str
    file: str
    factor: str
    matrix: csc_array
    form: str
    labelled: bool
    key: str
    digits: int | None = None


@dataclass(frozen=True, eq=False)
class SystemFile:
    """A system from a file, with all that the file says of it.

    Attributes
    ----------
    system : TermSystem
        M, C and K as sums of terms.
    reference : str
        Where the system is from.
    origins : tuple of Origin
        Where each matrix came from.
    inputs : tuple of Path
        The other files that were read.
    coordinates : Coordinates or None
        Where the rows are in space.
    damped : tuple of Damped
        What has damping that is not given as a matrix.
    held : frozenset of str
        Parameters of terms of K that are damped as a whole: where they change, the damping matrix
        stays the one of the given values.
    assembly : Assembly or None
        What components were joined to.

    Examples
    --------
    >>> import squeal
    >>> from pathlib import Path
    >>> _ = Path("mass.yaml").write_text("{M: [[1.0]], K: [[4.0]]}")
    >>> file = squeal.read_system("mass.yaml")
    >>> file.system.n, file.assumptions
    (1, ())
    """

    system: TermSystem
    reference: str = ""
    origins: tuple[Origin, ...] = field(default=(), repr=False)
    inputs: tuple[Path, ...] = field(default=(), repr=False)
    coordinates: Coordinates | None = None
    damped: tuple[Damped, ...] = ()
    held: frozenset[str] = frozenset()
    assembly: Any = field(default=None, repr=False)

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What was guessed, left out or approximated: nothing is certified after it."""
        return self.system.assumptions

    def replaced(self, changes: Mapping[str, float]) -> SystemFile:
        """The file with other values of some parameters, and the contact of components solved anew.

        Examples
        --------
        >>> import squeal
        >>> system = squeal.System([[1.0]], K={"k": [[1.0]]}, parameters={"k": 4.0})
        >>> file = squeal.SystemFile(system)
        >>> file.replaced({"k": 9.0}).system.at()[2].tolist()
        [[9.0]]
        """
        if self.assembly is None:
            return replace(self, system=self.system.replace(changes))
        assembly = self.assembly.joined_at(changes)
        return replace(self, system=assembly.seated_system, assembly=assembly)


def matrices_file(document: Document, at: Place, folder: Path) -> SystemFile:
    """The system in a mapping of a file's form; matrix files are named relative to `folder`.

    The steps: read the keys and the matrix files; bring the rows of all matrices into one order;
    make the terms of M, C and K; leave out empty rows and those of supports; add damping. `at` is
    the place of the mapping, for messages. Raises InputError.
    """
    keys = SYSTEM.read(document, at)
    parameter = swept_parameter(keys, at)
    terms = terms_of(keys, at, parameter)
    files = _read_files(terms, folder)
    assumptions = [*keys.get("assumptions", ())]
    for file in files:
        assumptions += file.assumptions
    assumptions += _compare_labels(at, terms, files)
    with at.prefixing_errors():
        sparse_matrices = aligned(files)
    matrices: list[Matrix] = sparse_matrices
    if _is_dense(terms, sparse_matrices):
        matrices = [matrix.toarray() for matrix in sparse_matrices]
    rows = sparse_matrices[0].shape[0]
    made = _make_terms(terms, matrices, files, folder, parameter)
    labels = all_labels(files)
    coordinates = _coordinates(keys, at, folder, rows, labels)
    with at.prefixing_errors():
        system = TermSystem(
            tuple(made.of_part["M"]),
            tuple(made.of_part["C"]),
            tuple(made.of_part["K"]),
            keys.get("parameters", {}),
            parameter,
            keys.get("name") or Path(at.source).stem,
            labels=tuple(labels),
        ).assuming(*assumptions)
        others = system.parameters.keys() - {parameter}
        warn_of_unused_parameters(others, system, at / "parameters")
        if not POWERS.keys().isdisjoint(keys):
            # beside K0, K1, ... M must be positive definite: `normalised_system` refuses others
            mass = dense(system.at()[0])
            normalised_system(mass, None, np.zeros_like(mass))
        # `empty` and `supports` are rows of the files, as their labels and coordinates count
        system, empty = without_empty_rows(system)
        if empty.size:
            at.warn(empty_rows_warning(empty, labels))
        remaining = np.delete(np.arange(rows), empty)
        system, supports = without_supports(system)
        supports = remaining[supports]
        if supports.size:
            (at / "K").warn(supports_warning(supports, labels))
        rows_before_damping = system.n
        system, damping_records = _with_damping(system, keys, at, folder, made.damping)
    if coordinates is not None:
        # damping ratios of a large system add rows, which move no node: see `damped`
        added_rows = system.n - rows_before_damping
        left_out = np.union1d(empty, supports)
        coordinates = coordinates.without(left_out).with_more_rows(added_rows)
    return SystemFile(
        system,
        reference=keys.get("reference", ""),
        origins=tuple(made.origins),
        inputs=tuple(dict.fromkeys(folder / name for name in named_files(keys))),
        coordinates=coordinates,
        damped=(*made.damping.records, *damping_records),
        held=_parameters_of(damping_records, system),
    )


class _MadeTerms(NamedTuple):
    """The terms of M, C and K by their part, where each came from, and the damping they name."""

    of_part: dict[str, list[Term]]
    origins: list[Origin]
    damping: TermDamping


def _make_terms(
    terms: Sequence[TermKeys],
    matrices: Sequence[Matrix],
    files: Sequence[MatrixFile],
    folder: Path,
    parameter: str,
) -> _MadeTerms:
    """The terms of the system from the keys of each term, its matrix and the file of that matrix.

    terms, matrices and files have one entry for each term of the file, those of M first. Terms of C
    that the damping of single terms makes are added. parameter: the free one. Raises InputError,
    also if a matrix has another number of rows than the first one.
    """
    rows = matrices[0].shape[0]
    made = _MadeTerms({part: [] for part in PARTS}, [], TermDamping())
    for term, matrix, file in zip(terms, matrices, files, strict=True):
        if matrix.shape[0] != rows:
            name = f"file {term.keys['file']}" if "file" in term.keys else "the matrix"
            raise term.at.refuse(
                f"{name} of {matrix.shape[0]} rows is not allowed; it must have the {rows} of M"
            )
        formula = formula_of(term)
        factor = factor_of(term, formula, folder, parameter)
        digits, errors = _precision_of(term, matrix, file, folder)
        origin = Origin(
            part=term.part,
            file=term.keys.get("file", ""),
            factor=factor.text,
            matrix=csc_array(matrix),
            form=file.form,
            labelled=bool(file.labels),
            key=term.keys.get("key", ""),
            digits=digits,
        )
        made.origins.append(origin)
        of_part = made.of_part[term.matrix_part]  # K4, structural damping, counts as K
        index = len(of_part)  # of the term in its part
        made_term = Term(matrix, factor, digits, term.keys.get("rounding", 0.0), errors)
        made.damping.add(term, index, made_term, formula)
        of_part.append(made_term)
    made.of_part["C"] += made.damping.terms
    return made


def _precision_of(term: TermKeys, matrix: Matrix, file: MatrixFile, folder: Path) -> Precision:
    """How far the entries of a term may be off, by its keys and by its file.

    Without the key `digits` the file alone counts. With it the result has the smaller number of
    digits of key and file, and at each entry the larger error of these two: that of the key
    `errors`, or else of the key `digits`; and that to which the file was rounded.

    matrix: of the term (n, n), on the rows of the system; file: what was read of its file; folder:
    the one relative to which the key `errors` names a file. Raises InputError for errors of other
    rows, and for negative ones.
    """
    of_file = precision_of_file(file, matrix)
    if "digits" not in term.keys:
        return of_file
    digits = min(term.keys["digits"], of_file.digits or MOST_DIGITS)
    if "errors" not in term.keys:
        if of_file.errors is None:
            return Precision(digits)
        # at each entry the larger error: a number of decimals leaves the same error at all entries,
        # a number of digits a larger one at larger entries
        by_key = half_units(matrix, term.keys["digits"])
        return Precision(digits, by_key.maximum(of_file.errors))
    here = term.at / "errors"
    with here.prefixing_errors():
        errors = read_matrix(folder / term.keys["errors"]).matrix
    if np.iscomplexobj(errors) or errors.shape != matrix.shape or errors.min() < 0.0:
        raise here.refuse(
            f"{term.keys['errors']} is not allowed; it must have {matrix.shape[0]} rows of numbers "
            "of at least 0"
        )
    # at least what the digits of the matrix file itself leave open
    rounded = Term(matrix, digits=of_file.digits, errors=of_file.errors).data_errors
    return Precision(digits, errors if rounded is None else errors.maximum(rounded))


def _read_files(terms: Sequence[TermKeys], folder: Path) -> list[MatrixFile]:
    """The matrix of each term, as it stands in its file or in the system file.

    A file that several terms name is read once. Raises InputError.
    """
    opened: OpenedFiles = {}  # `read_matrix` adds each file, of which terms may take several keys
    file_of_request: dict[tuple[str, str | None, bool | None], MatrixFile] = {}
    files = []
    for term in terms:
        if "matrix" in term.keys:
            files.append(MatrixFile(csc_array(np.array(term.keys["matrix"]))))
            continue
        name = term.keys["file"]
        key = term.keys.get("key")
        symmetric = term.keys.get("symmetric")
        request = (name, key, symmetric)
        here = term.at / "file"
        if request not in file_of_request:
            with here.prefixing_errors():
                file_of_request[request] = read_matrix(folder / name, key, symmetric, opened)
        file = file_of_request[request]
        parameters = formula_of(term).names  # mu, if it is a friction term
        if symmetric and parameters and not file.matrix.diagonal().any():
            here.warn(
                f"{name} has an empty diagonal, as friction has, and symmetric: true takes each of "
                "its entries for both (of friction symmetric: false is right)"
            )
        if term.part in ("M", "K4") and np.iscomplexobj(file.matrix):
            raise here.refuse(
                f"{name} is complex and not allowed; M and K4 must be real, K and C may be complex"
            )
        files.append(file)
    return files


def _is_dense(terms: Sequence[TermKeys], matrices: Sequence[csc_array]) -> bool:
    """Whether matrices become arrays: small ones of which one is written in the system file or has
    many entries."""
    rows = matrices[0].shape[0]
    if rows > MOST_ROWS:
        return False
    is_written_here = any("matrix" in term.keys for term in terms)
    return is_written_here or any(matrix.nnz > FULL * rows * rows for matrix in matrices)


def _coordinates(
    keys: Document, at: Place, folder: Path, rows: int, labels: Sequence[tuple[int, int]]
) -> Coordinates | None:
    """Nodes and elements of the rows, None without the key coordinates. Raises InputError."""
    if "coordinates" not in keys:
        return None
    with (at / "coordinates" / "file").prefixing_errors():
        coordinates = read_coordinates(folder / keys["coordinates"]["file"], rows, labels)
    if "elements" in keys:
        with (at / "elements" / "file").prefixing_errors():
            coordinates = read_elements(folder / keys["elements"]["file"], coordinates)
    return coordinates


def _with_damping(
    system: TermSystem, keys: Document, at: Place, folder: Path, term_damping: TermDamping
) -> tuple[TermSystem, tuple[Damped, ...]]:
    """The system with the damping of its key `damping`, and a list of what is damped by it.

    Parameters
    ----------
    system : TermSystem
        The system, with the damping that terms name themselves.
    keys : Document
        The keys of the system file.
    at : Place
        The system file, for messages.
    folder : Path
        The folder relative to which a table of damping ratios is named.
    term_damping : TermDamping
        Which terms name damping themselves: the damping of the whole system leaves them out.

    Raises
    ------
    InputError
        For damping that does not fit the system.
    """
    damping = keys.get("damping", {})
    ratios = damping.get("ratios", ())
    if isinstance(ratios, dict):
        with (at / "damping" / "ratios" / "file").prefixing_errors():
            ratios = _ratios_over_frequency(folder / ratios["file"])
    return damped(
        system,
        rayleigh=damping.get("rayleigh", (0.0, 0.0)),
        ratios=ratios,
        structural=damping.get("structural", 0.0),
        left_out=term_damping.indices,
    )


def _ratios_over_frequency(path: Path) -> Callable[[NDArray], NDArray]:
    """Damping ratios as a function of the frequency (Hz), NaN beyond the table."""
    frequencies, ratios = read_rising(path, ("frequency", "ratio"), NOT_NEGATIVE)

    def ratio(frequency: NDArray) -> NDArray:
        return np.interp(frequency, frequencies, ratios, left=np.nan, right=np.nan)

    return ratio


def _parameters_of(records: Sequence[Damped], system: TermSystem) -> frozenset[str]:
    """The parameters in the factors of the terms of K that are damped as a whole.

    A record of the second term has K.2 in `of`; others, such as modes, belong to no term.
    """
    names: set[str] = set()
    for record in records:
        part, _, number = record.of.partition(".")
        if part == "K":
            names |= system.K[int(number) - 1].factor.names
    return frozenset(names)


def _compare_labels(at: Place, terms: Sequence[TermKeys], files: Sequence[MatrixFile]) -> list[str]:
    """Warn of rows (node, dof) that M has and K lacks, or K and not M, or C and not K.

    Internal nodes, below zero, have no mass and are left out. Returns what is assumed of such
    rows. Raises InputError if only some matrices have labels, or if a matrix shares no row with
    the others.
    """
    labels: dict[str, set[tuple[int, int]]] = {part: set() for part in PARTS}
    occurrences: Counter[tuple[int, int]] = Counter()
    unlabelled = []
    for term, file in zip(terms, files, strict=True):
        labels[term.matrix_part].update(file.labels or ())
        occurrences.update(file.labels or ())
        if not file.labels:
            unlabelled.append(term.keys.get("file", term.part))
    if unlabelled and any(labels.values()):
        raise at.refuse(
            f"{', '.join(unlabelled)}: the rows have no labels (node, dof) as other matrices have; "
            "HBMAT needs a .mapping beside each matrix, CalculiX a .dof"
        )
    for term, file in zip(terms, files, strict=True):
        if file.labels and not any(occurrences[label] > 1 for label in file.labels):
            node, freedom = file.labels[0]
            raise (term.at / "file").refuse(
                f"no other matrix has the rows of {term.keys['file']}, the first of which is node "
                f"{node}, dof {freedom}; matrices of the same nodes are required"
            )
    assumptions = []
    for part, other in ("MK", "KM", "CK"):
        lacking = sorted(label for label in labels[part] - labels[other] if label[0] >= 0)
        if not lacking or not labels[other]:
            continue
        node, freedom = lacking[0]
        assumption = (
            f"{other} lacks {rows_in_words(len(lacking))} of {part}, taken as zero (a zero written "
            f"on the diagonal of {other} confirms it)"
        )
        at.warn(f"{assumption}; the first is degree of freedom {freedom} of node {node}")
        assumptions.append(assumption)
    return assumptions
