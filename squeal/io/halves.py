"""Half a matrix in a file: recognised by its entries, and completed.

Programs write one triangle of a symmetric matrix, and do not always say so. A matrix of friction
may look like one: it, too, may have entries on one side of the diagonal alone.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.sparse import csc_array, diags_array

from squeal.errors import InputError
from squeal.io.formats.matrix_file import Labels, MatrixFile, has_internal_nodes
from squeal.linear.matrices import EPS, Matrix
from squeal.schema import Place

FREE_MOTION = 1e-8  # of the diagonal: smaller pivots are those of rigid-body motions
ONE_SIDED = "no entry has another one on the other side of the diagonal"


class Sides(NamedTuple):
    """How the entries on both sides of the diagonal of a matrix (n, n) compare.

    They show whether the matrix is half of a symmetric one. An entry is one-sided if no other
    entry, not even a zero in the file, mirrors it across the diagonal. Stiffness and mass of a
    structure are positive semidefinite, so that none of their entries has k_ij^2 > k_ii k_jj; those
    of a matrix of friction alone do. Rows of internal nodes, whose numbers are below zero, are
    exempt: in Abaqus these hold Lagrange multipliers, which have no diagonal.

    Attributes
    ----------
    paired : int
        How many entries off the diagonal are mirrored by another one.
    one_sided : int
        How many entries, zeros left out, are not.
    fitting : int
        How many one-sided entries half a stiffness or mass may have; 0 where an entry on the
        diagonal is negative.
    couples_nodes : bool
        Whether a one-sided entry couples different nodes, which a whole matrix would do on both
        sides of the diagonal.
    resembles_friction : bool
        Whether one-sided entries in rows with an empty diagonal stand in both triangles, or are the
        only ones although other rows have a diagonal. Neither holds of a coupling without any
        diagonal, nor of a Lagrange multiplier in half a structure.
    """

    paired: int
    one_sided: int
    fitting: int
    couples_nodes: bool
    resembles_friction: bool

    @property
    def is_half_of_structure(self) -> bool:
        """Whether the matrix can only be half of a symmetric stiffness or mass."""
        return not self.paired and self.fitting == self.one_sided and self.couples_nodes


def sides_of(matrix: Matrix, labels: Labels | None = None) -> Sides:
    """Compare the sides of a matrix (n, n); without labels each row counts as a node.

    For what the comparisons mean see `Sides`.
    """
    stored = csc_array(matrix, copy=True)
    stored.sum_duplicates()
    nodes = np.arange(stored.shape[0])
    if labels:
        nodes = np.array(labels)[:, 0]
    is_entry = csc_array((np.ones(stored.nnz, bool), stored.indices, stored.indptr), stored.shape)
    is_one_sided = is_entry > is_entry.T  # an entry here (True), none across the diagonal (False)
    entries = stored.multiply(is_one_sided).tocoo()  # zeros that stand in the file drop out
    rows, columns = entries.coords
    diagonal = stored.diagonal().real
    is_internal = nodes < 0
    is_exempt = is_internal[rows] | is_internal[columns]
    # real k_ij^2 <= k_ii k_jj to rounding; where both sides overflow or underflow they fit
    with np.errstate(over="ignore"):
        fits = is_exempt | (
            entries.data.real**2 <= (1.0 + 8.0 * EPS) * diagonal[rows] * diagonal[columns]
        )
    has_no_negative_diagonal = np.all(diagonal[~is_internal] >= 0.0)
    is_empty = stored.diagonal() == 0.0
    is_unsupported = ~is_exempt & (is_empty[rows] | is_empty[columns])
    is_upper = rows[is_unsupported] < columns[is_unsupported]
    in_both_triangles = is_upper.any() and not is_upper.all()
    lack_diagonals = entries.nnz and is_unsupported.all() and not is_empty.all()
    return Sides(
        paired=stored.nnz - is_entry.diagonal().sum() - is_one_sided.nnz,
        one_sided=entries.nnz,
        fitting=int(np.sum(fits & has_no_negative_diagonal)),
        couples_nodes=bool(np.any(nodes[rows] != nodes[columns])),
        resembles_friction=bool(in_both_triangles or lack_diagonals),
    )


def mirror_half(matrix: csc_array, sign: int = 1) -> csc_array:
    """Add the mirror image of the entries off the diagonal to half a matrix (n, n).

    `sign` is 1 for a symmetric matrix, -1 for a skew-symmetric one. Raises ValueError where an
    entry is mirrored already.
    """
    if sides_of(matrix).paired:
        name = _symmetry_name(sign)
        raise ValueError(f"a {name} file holds one triangle, and this has entries on both sides")
    off_diagonal = matrix - diags_array(matrix.diagonal())
    return csc_array(matrix + sign * off_diagonal.T)


def complete_triangle(matrix: csc_array, sign: int) -> csc_array:
    """A symmetric (1) or skew-symmetric (-1) matrix of which one or both triangles are written.

    Two triangles must agree to the last digit. Raises ValueError.
    """
    if not sides_of(matrix).paired:
        return mirror_half(matrix, sign)
    if abs(matrix - sign * matrix.T).max() > 0.0:
        name = _symmetry_name(sign)
        raise ValueError(f"a {name} file holds both triangles, and they differ")
    return matrix


def _symmetry_name(sign: int) -> str:
    """What files of a sign, 1 or -1, of the mirror image are called."""
    return "symmetric" if sign > 0 else "skew-symmetric"


def complete(
    at: Place, matrix: csc_array, file: MatrixFile, symmetric: bool | None
) -> tuple[csc_array, bool]:
    """The full matrix of a file that may hold one triangle of it, and whether that is a guess.

    - Declared symmetric, by the user or else by the file: the other triangle is added.
    - Declared not symmetric: the matrix as it is, with a warning if only the file says so and the
      matrix looks like one triangle.
    - Not declared: a matrix with entries on both sides of the diagonal, or on it alone, as it is.
      One triangle is completed as a guess, with a warning, if it can only be that of a symmetric
      matrix.

    Parameters
    ----------
    at : Place
        The file, for messages.
    matrix : csc_array (n, n)
        The matrix of `file`, checked.
    file : MatrixFile
        The entries, labels and symmetry as they stand in the file.
    symmetric : bool or None
        Whether the user says that one triangle stands for both: it overrides what the file says.
        None if the user says nothing.

    Raises
    ------
    InputError
        Where nothing declares one triangle, and it may be that of a symmetric matrix or not; where
        a matrix declared symmetric is not.
    """
    if symmetric is False:
        return matrix, False
    declared: bool | None = symmetric
    if symmetric is None:
        declared = file.symmetric
    sides = sides_of(file.matrix, file.labels)  # zeros that stand in the file count as entries
    if declared and sides.paired and abs(matrix - matrix.T).max() > 0.0:
        raise InputError("is not symmetric, although the file or `symmetric: true` says so")
    if sides.paired or not sides.one_sided:
        return matrix, False
    if declared:
        if symmetric and sides.resembles_friction:
            at.warn(
                "entries stand in rows whose diagonal is empty, as of friction, and each is taken "
                "for both (of friction symmetric: false is right)"
            )
        return mirror_half(matrix), False
    if declared is False:
        if sides.is_half_of_structure:
            at.warn(
                f"{ONE_SIDED}, as in half of a symmetric matrix, and the rest is taken as zero "
                "(symmetric: true beside the file completes it, symmetric: false confirms it)"
            )
        return matrix, False
    if not (file.labels and sides.is_half_of_structure):
        raise InputError(
            f"{ONE_SIDED}, and nothing says whether each stands for both; say it by the key "
            "symmetric: true or symmetric: false beside the file"
        )
    completed = mirror_half(matrix)
    if Path(at.source).suffix.lower() != ".mas":  # a mass, which friction leaves symmetric
        _refuse_one_sided(at, completed, file.labels)
    at.warn(
        f"{ONE_SIDED}, they couple different nodes, and none is too great for the diagonal; each "
        "is taken for both (symmetric: false beside the file says otherwise)"
    )
    return completed, True


def _refuse_one_sided(at: Place, completed: csc_array, labels: Labels) -> None:
    """Refuse half a matrix that may be the half of an unsymmetric one, as CalculiX writes it.

    It is refused if the input file beside it has friction, or if the completed matrix has negative
    eigenvalues, which no stiffness or mass of a structure has. The eigenvalues of a matrix with
    internal nodes (labels below zero) are not checked: in Abaqus these nodes hold Lagrange
    multipliers, which make eigenvalues negative. Raises InputError.
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

    With all pivots on the diagonal LU is L D L^T with D, the pivots, on the diagonal of U. By
    Sylvester's law of inertia D has as many negative entries as the matrix negative eigenvalues.
    """
    from scipy.sparse.linalg import splu

    # rigid-body motions of a free body have eigenvalues of 0, with rounding of either sign: the
    # shift makes them positive
    shift = diags_array(FREE_MOTION * np.abs(matrix.diagonal()))
    try:
        # rows and columns are ordered alike, and no pivot is taken off the diagonal for its size
        factors = splu(
            csc_array(matrix + shift),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
    except RuntimeError:  # exactly singular: a row without stiffness says nothing
        return 0
    return int(np.count_nonzero(factors.U.diagonal() < 0.0))
