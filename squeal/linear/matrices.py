"""The matrices of M q'' + C q' + K q = 0: checked, free of units, their ranks."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from squeal.errors import ComputationError, InputError, MatrixError
from squeal.schema import Place, refuse_unit

Array = NDArray[np.float64]
EPS = float(np.finfo(float).eps)
ENTRY_ROUNDING = 4 * EPS  # relative error of an entry of M^-1 K, M diagonal
LARGEST_ASYMMETRY = 1e-12  # of a matrix: an unsymmetric part up to this is rounding
MOST_COUPLED = 1.001  # M_ij^2 over M_ii M_jj: digits of files excuse no more
ILL_CONDITIONED = 1e-7  # reciprocal condition of M, its diagonal 1, below which it is not inverted
BEYOND_DOUBLES = "M, C, K: the eigenvalues are beyond double precision"


class SingularTogetherError(MatrixError):
    """Rounding does not tell M, C and K from matrices for which every number is a root."""


@dataclass(frozen=True)
class NormalisedSystem:
    """A system in mass-normalised coordinates z: z'' + B z' + A z = 0, q = T z and T' M T = 1.

    Attributes
    ----------
    A : array (n, n)
        rad^2/s^2, whatever units M mixes; symmetric if K is.
    B : array (n, n) or None
        rad/s; None without damping.
    T : array (n, n)
        The transformation.
    relative_error : float
        Of A: what rounding of T leaves in it, as a share of its largest entries.
    """

    A: Array
    B: Array | None
    T: Array
    relative_error: float


class StandardProblem(NamedTuple):
    """The standard eigenproblem A v = z v at one value of a parameter.

    A: the matrix (N, N); derivative: dA/dp (N, N); sizes (N, N): the rounding of each entry of A
    is the machine precision times this.
    """

    A: NDArray
    derivative: NDArray
    sizes: Array


Matrix = Any
"""A NumPy array or SciPy sparse array (n, n)."""
MCK = tuple[Matrix, Matrix, Matrix]
"""M, C and K at one value of the parameters, or their derivatives dM, dC and dK by one of them;
None stands for zero."""
Values = Any
"""A number or an array of numbers; several in one formula have one shape."""


def is_sparse(matrix: object) -> bool:
    """True for a SciPy sparse array or matrix."""
    return hasattr(matrix, "tocsc")


def dense(matrix: Matrix) -> np.ndarray:
    """The matrix as a NumPy array."""
    return np.asarray(matrix.toarray() if is_sparse(matrix) else matrix)


def dense_matrices(
    M: Matrix, C: Matrix | None, K: Matrix
) -> tuple[np.ndarray, np.ndarray | None, np.ndarray]:
    """M, C and K as NumPy arrays; C may be None."""
    return dense(M), None if C is None else dense(C), dense(K)


def unwrapped(value: object) -> object:
    """The sparse matrix in a data frame of sparse columns (pandas) or in a data array (xarray);
    anything else as it is."""
    columns: Any = getattr(value, "sparse", None)  # which a frame of dense columns has not
    if hasattr(columns, "to_coo"):
        return columns.to_coo()
    # `data` is asked of data arrays alone: that of a NumPy array of dates raises ValueError
    inside = getattr(value, "data", None) if hasattr(value, "dims") else None
    return inside if is_sparse(inside) else value


def given_matrix(value: object, name: str = "", real: bool = False) -> Matrix:
    """A given matrix (n, m) of finite numbers, or `real` ones; sparse as CSC.

    Raises InputError, also for numbers that no double holds.
    """
    refuse_unit(value, Place(name or "matrix"))
    matrix = unwrapped(value)
    if np.ma.is_masked(matrix):
        raise _refused(name, "has masked entries; a matrix of finite numbers is required")
    try:
        typed, doubles = _as_doubles(matrix, real)
    except (TypeError, ValueError, OverflowError):
        numbers = "real numbers" if real else "numbers"
        raise _refused(name, f"must be a matrix of finite {numbers}") from None
    if _are_rounded(_entries(typed), _entries(doubles)):
        kind = typed.dtype
        raise _refused(
            name, f"an entry of {kind} has more digits than a double; .astype(float) rounds it"
        )
    return doubles


def _refused(name: str, message: str) -> InputError:
    """The error of a matrix, with its name in front if it has one."""
    return InputError(f"{name}: {message}" if name else message)


def _entries(matrix: Matrix) -> np.ndarray:
    """The entries of an array, or the stored ones of a CSC matrix."""
    return matrix.data if is_sparse(matrix) else matrix


def _as_doubles(matrix: object, real: bool) -> tuple[Matrix, Matrix]:
    """A matrix of finite numbers in its own type of numbers, and the same in doubles.

    Complex numbers without imaginary parts become real. Raises ValueError, TypeError or
    OverflowError for anything else, and for complex numbers if `real`.
    """
    typed: Matrix
    if is_sparse(matrix):
        from scipy.sparse import csc_array

        typed = csc_array(matrix)  # an array also from a spmatrix, which has other methods
    else:
        typed = np.asarray(matrix)
    is_complex = np.iscomplexobj(typed)
    if is_complex and not _entries(typed).imag.any():
        typed = typed.real
        is_complex = False
    # kinds: booleans, integers with and without sign, real and complex numbers, Python objects
    if typed.ndim != 2 or typed.dtype.kind not in "biufcO" or (real and is_complex):
        raise ValueError
    doubles = typed.astype(complex if is_complex else float, copy=False)
    if not np.isfinite(_entries(doubles)).all():
        raise ValueError
    return typed, doubles


def _are_rounded(typed: np.ndarray, doubles: np.ndarray) -> bool:
    """True if some entries of their own type differ from the same as doubles, as great integers."""
    if typed.dtype == doubles.dtype or typed.dtype.itemsize <= 4:  # doubles hold all of these
        return False
    # as objects the comparison is of the numbers themselves
    return bool(np.any(typed.astype(object) != doubles.astype(object)))


def _square(name: str, value: ArrayLike, n: int | None = None, real: bool = True) -> NDArray:
    """A given matrix as a square array, of the size n of M if that is known. Raises InputError."""
    matrix = dense(given_matrix(value, name, real))
    if matrix.shape[0] != matrix.shape[1] or not matrix.size:
        raise InputError(f"{name}: shape {matrix.shape}; a square matrix is required")
    if n is not None and len(matrix) != n:
        raise InputError(f"{name}: shape {matrix.shape}; M has shape {(n, n)}")
    return matrix


def checked(
    M: ArrayLike, C: ArrayLike | None, K: ArrayLike, real: bool = True
) -> tuple[Array, Array | None, Array]:
    """The matrices as float arrays of one shape (n, n), complex ones unless `real`; a C of zeros
    becomes None.

    Raises InputError for anything that is not a square, finite matrix of the size of M.
    """
    mass = _square("M", M, real=real)
    damping = None if C is None else _square("C", C, len(mass), real)
    if damping is not None and not damping.any():
        damping = None
    return mass, damping, _square("K", K, len(mass), real)


def normalised_system(M: ArrayLike, C: ArrayLike | None, K: ArrayLike) -> NormalisedSystem:
    """The system in mass-normalised coordinates; masses may differ by many decades.

    Raises InputError unless M is symmetric positive definite, ComputationError beyond double
    precision.
    """
    mass, damping, stiffness = checked(M, C, K)
    T, rounding = _normalising_factor(mass.tobytes(), len(mass))  # T' M T = 1
    with np.errstate(all="ignore"):
        A = _normalised(T, stiffness)
        B = None if damping is None else _normalised(T, damping)
        # of squares of roots, which solvers form: these have to be doubles too
        size = np.linalg.norm(A)
        if B is not None:
            size += np.linalg.norm(B) ** 2
    if not np.isfinite(size):
        raise ComputationError(BEYOND_DOUBLES)
    return NormalisedSystem(A, B, T, rounding)


def _normalised(T: Array, X: Array) -> Array:
    """T' X T (n, n), for a regular T."""
    t = np.diag(T)
    if np.count_nonzero(T) == len(t):  # T is regular, hence diagonal
        # symmetry of X survives to the last bit: one factor for each pair of entries
        return X * (t[:, None] * t)
    return T.T @ X @ T


@lru_cache(maxsize=8)  # along mu the mass matrix stays
def _normalising_factor(mass: bytes, n: int) -> tuple[Array, float]:
    """T with T' M T = 1, and the relative size of the errors that it brings.

    It is made of the Cholesky factor of M, scaled to a unit diagonal. mass: the doubles of
    M (n, n), as the cache takes no arrays. Raises MatrixError.
    """
    M = np.frombuffer(mass).reshape(n, n)
    unit = unit_diagonal(M)
    if np.abs(unit - unit.T).max() > LARGEST_ASYMMETRY:
        raise MatrixError("M: a symmetric matrix is required")
    np.fill_diagonal(unit, np.sign(np.diag(M)))  # without rounding
    eigenvalues = np.linalg.eigvalsh(unit)
    smallest = eigenvalues[0]
    largest = eigenvalues[-1]
    if smallest < -4 * EPS * n * abs(largest):
        raise MatrixError("M: a positive definite matrix is required")
    if smallest <= ILL_CONDITIONED * largest:
        least = max(smallest / (largest or 1.0), 0.0)
        raise MatrixError(
            f"M: some motion has {least:.1g} of the others' mass; a well-conditioned matrix is "
            "required"
        )
    inverse = np.linalg.inv(np.linalg.cholesky((unit + unit.T) / 2))
    T = (1.0 / np.sqrt(np.diag(M)))[:, None] * inverse.T
    T.setflags(write=False)  # the cache holds it
    # T' K T has errors of up to |inverse|^2 times those of the entries of K, scaled as M is
    return T, ENTRY_ROUNDING * float(np.linalg.norm(inverse, 2) ** 2)


def divisor(size: Values) -> Values:
    """Sizes (...), at least 0, to divide by: zeros become 1."""
    return np.where(size > 0, size, 1.0)


def unit_diagonal(M: NDArray) -> NDArray:
    """A matrix (n, n) with a diagonal of ones where it has one; a symmetric one stays symmetric."""
    size = divisor(np.sqrt(np.abs(np.diag(M))))
    return M / size[:, None] / size


def equilibrated(M: NDArray) -> NDArray:
    """A matrix (n, n) with its rows, then its columns, scaled to a largest entry of one: units of
    rows and columns cost no condition then."""
    scaled = M
    for axis in (1, 0):
        scaled = scaled / divisor(np.abs(scaled).max(axis=axis, keepdims=True))
    return scaled


def is_regular(M: NDArray) -> bool:
    """True if the inverse of M (n, n) costs no more digits than `ILL_CONDITIONED` allows."""
    return bool(ILL_CONDITIONED * np.linalg.cond(equilibrated(M)) < 1.0)


def check_regular(M: NDArray, C: NDArray | None, K: NDArray) -> None:
    """Refuse matrices (n, n) for which every number is a root, as far as rounding shows.

    Raises SingularTogetherError.
    """
    mass = float(abs(M).max())
    stiffness = float(abs(K).max())
    frequency = np.sqrt(stiffness / mass) if mass and stiffness else 1.0
    for point in (0.8 + 0.6j, -0.9 + 1.7j):  # no root but by accident, and not both
        z = frequency * point
        if scaled_rank(z * z * M + (0.0 if C is None else z * C) + K) == len(M):
            return
    raise SingularTogetherError(
        "M, C and K: are singular together as far as rounding shows, so that every number is a root"
    )


def rank_of(singular: Array, size: float | None = None) -> int:
    """How many falling singular values are more than rounding of a matrix of that size (2-norm)."""
    largest = size if size is not None else np.max(singular, initial=0.0)
    return int(np.sum(singular > 4 * EPS * len(singular) * largest))


def scaled_rank(K: NDArray) -> int:
    """The rank of an equilibrated K: what is small beside others still counts."""
    return rank_of(np.linalg.svd(equilibrated(K), compute_uv=False))


def first_order(
    A: NDArray, B: NDArray, frequency_scale: ArrayLike | None = None
) -> tuple[NDArray, Array]:
    """The first-order form of z'' + B z' + A z = 0, in units of time in which it is well scaled.

    With states (z, z' / scale) and time in 1/scale it is [[0, 1], [-A / scale^2, -B / scale]].

    Parameters
    ----------
    A, B : array (..., n, n)
        In rad^2/s^2 and rad/s.
    frequency_scale : array_like (...), optional
        The scale, 1/s; if left out, that of each system, near its highest frequencies.

    Returns
    -------
    F : array (..., 2n, 2n)
        Its eigenvalues times the scale are the roots, rad/s.
    scale : array (...)
        1/s.
    """
    scale = _frequency_scale(A, B) if frequency_scale is None else np.asarray(frequency_scale)
    n = A.shape[-1]
    F = np.zeros((*A.shape[:-2], 2 * n, 2 * n), dtype=np.result_type(A, B))
    F[..., :n, n:] = np.eye(n)
    np.multiply(A, -1.0 / scale[..., None, None] ** 2, out=F[..., n:, :n])
    np.multiply(B, -1.0 / scale[..., None, None], out=F[..., n:, n:])
    return F, scale


def _frequency_scale(A: NDArray, B: NDArray) -> Array:
    """A power of two, by which a division rounds nothing, near the highest frequencies (...)."""
    undamped = np.sqrt(np.linalg.norm(A, axis=(-2, -1)))
    highest = np.maximum(undamped, np.linalg.norm(B, axis=(-2, -1)))
    return np.asarray(2.0 ** np.round(np.log2(divisor(highest))))


def state_matrices(M: Array, C: Array, K: Array) -> tuple[Array, Array]:
    """A (2n, 2n) of the states (q, q') of M q'' + C q' + K q = f, and B (2n, n) of the forces f."""
    inverse = np.linalg.inv(M)
    A, _ = first_order(inverse @ K, inverse @ C, frequency_scale=1.0)
    return A, np.vstack([0.0 * inverse, inverse])


def applied(change: MCK, z: Values, x: NDArray) -> NDArray:
    """(z^2 dM + z dC + dK) x of columns x (n, m) at values z (m,), or of one vector."""
    total = np.zeros_like(x)
    for matrix, factor in zip(change, (z**2, z, z**0), strict=True):
        if matrix is not None:
            total = total + matrix @ x * factor
    return total


def inertia(change: MCK, z: Values, x: NDArray) -> NDArray:
    """(2 z dM + dC) x, the derivative of `applied` by z, of columns x (n, m) at values z (m,)."""
    return applied((None, *change[:2]), 2 * z, x)


def reaches(pattern: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which rows depend on which unknowns, by way of other rows too: an array (n, n).

    pattern[i, j] says that row i holds unknown j. The transitive closure, by squaring: each one
    doubles the length of the chains.
    """
    reach = pattern | np.eye(len(pattern), dtype=bool)
    for _ in range(len(pattern).bit_length()):
        further = reach.astype(np.float32) @ reach.astype(np.float32) > 0.0
        if np.array_equal(further, reach):
            break
        reach = further
    return reach


def components(reach: NDArray[np.bool_]) -> list[NDArray[np.intp]]:
    """The rows of each strong component: those that depend on one another, see `reaches`.

    Ordered by components a matrix is block triangular, so that what acts from one on another
    changes no eigenvalue.
    """
    first = (reach & reach.T).argmax(axis=1)  # the first row of the component of each
    return [np.flatnonzero(first == k) for k in np.unique(first)]


def solver_near_singular(P: NDArray, floor: float) -> Callable[[NDArray, bool], NDArray]:
    """x of P x = b, or of P^H x = b, from b (n, m) and whether `adjoint`; P may be singular.

    Pivots smaller than `floor`, the size of rounding, get this size: solutions then point along the
    null space.

    >>> solve = solver_near_singular(np.diag([2.0, 0.0]), floor=1e-3)
    >>> solve(np.ones((2, 1)), False).real.ravel().tolist()
    [0.5, 1000.0]
    """
    from scipy.linalg.lapack import zgetrf, zgetrs  # lu_factor would warn of each singular matrix

    lu, pivots, _ = zgetrf(P)
    small = np.flatnonzero(np.abs(np.diag(lu)) < floor)
    lu[small, small] = floor

    def solve(b: NDArray, adjoint: bool) -> NDArray:
        x, _ = zgetrs(lu, pivots, b, trans=2 * adjoint)  # LAPACK's code of P^H
        return np.asarray(x)

    return solve


def norm_of(A: Matrix) -> float:
    """sqrt(|A|_1 |A|_inf), which bounds the 2-norm, of an array or sparse array; 0 without rows."""
    size = abs(A)
    largest_column = size.sum(axis=0).max(initial=0.0)
    largest_row = size.sum(axis=1).max(initial=0.0)
    return float(np.sqrt(largest_column * largest_row))


def has_symmetry(X: Matrix, sign: int) -> bool:
    """True if X (n, n), an array or sparse array, is symmetric (sign 1) or skew (-1), to rounding.

    >>> has_symmetry(np.array([[1.0, 2.0], [2.0, 3.0]]), 1), has_symmetry(np.eye(2), -1)
    (True, False)
    """
    return bool(abs(X - sign * X.T).max() <= 4 * EPS * X.shape[0] * abs(X).max())


def noise_of(A: NDArray, relative_error: float = ENTRY_ROUNDING) -> float:
    """Singular values of A (n, n) up to this are rounding, by the relative error of its entries."""
    return 2 * len(A) * relative_error * float(np.linalg.norm(A, 2))


def null_spaces(A: NDArray, noise: float) -> tuple[NDArray, NDArray]:
    """Orthonormal right and left null vectors (n, k) of A: of singular values up to `noise`."""
    left, singular, right = np.linalg.svd(A)
    rank = int(np.sum(singular > noise))
    return right[rank:].conj().T, left[:, rank:]


def zero_roots(A: NDArray, noise: float, M: NDArray | None = None) -> int:
    """The multiplicity of 0 as a root of A - s M, or of A - s without M, from ranks.

    The null space is split off, and the smaller problem that remains is examined again, until it
    has full rank: so the chains of a multiple root are counted to their end, such as the double
    one of a free body in first-order form, [[0, 1], [0, 0]]. Singular values up to `noise` are
    rounding.
    """
    count = 0
    stiffness = A
    mass = M
    while len(stiffness):
        _, singular, right = np.linalg.svd(stiffness)
        rank = int(np.sum(singular > noise))
        # the null vectors, and the vectors orthogonal to them
        complement, null = np.split(right.conj().T, [rank], axis=1)
        if not null.shape[1]:
            break
        count += null.shape[1]
        test_vectors = complement
        if mass is not None:
            # (A - s M) (complement, null) has the columns (A - s M) complement and -s M null. Rows
            # orthogonal to M null keep the first alone, and its roots are those that remain
            test_vectors = np.linalg.qr(mass @ null, mode="complete")[0][:, null.shape[1] :]
            mass = test_vectors.conj().T @ mass @ complement
        stiffness = test_vectors.conj().T @ stiffness @ complement
    return count


def rows_coupled_beyond_their_masses(M: Matrix) -> tuple[int, int] | None:
    """Two rows i, j of a matrix (n, n) with M_ij^2 > `MOST_COUPLED` M_ii M_jj, or None.

    Then M is not positive semidefinite; without such rows it need not be so either.
    """
    from scipy.sparse import coo_array

    entries = coo_array(M)
    diagonal = np.real(M.diagonal())
    allowed = diagonal[entries.row] * diagonal[entries.col]
    is_off_diagonal = entries.row != entries.col
    exceeds = np.abs(entries.data) ** 2 > MOST_COUPLED * allowed
    exceeding = np.flatnonzero(is_off_diagonal & exceeds)
    if not exceeding.size:
        return None
    return int(entries.row[exceeding[0]]), int(entries.col[exceeding[0]])


def why_no_mass(M: Matrix, most: int) -> str:
    """Why a matrix (n, n) is no mass matrix, in words: some motion has a negative mass.

    Empty if none is found. Of up to `most` rows all motions are examined, by eigenvalues; of more
    rows those of a single row, or of two rows.
    """
    diagonal = np.real(M.diagonal())
    negative = np.flatnonzero(diagonal < 0.0)
    if negative.size:
        return f"M is no mass: row {negative[0] + 1} has a negative one on the diagonal"
    coupled = rows_coupled_beyond_their_masses(M)
    if coupled is not None:
        return (
            f"M is no mass: rows {coupled[0] + 1} and {coupled[1] + 1} are coupled by more than "
            "their masses allow, so that a motion has a negative one, as where a file is cut"
        )
    if M.shape[0] > most:
        return ""
    unit = np.real(unit_diagonal(dense(M)))
    sizes = np.linalg.eigvalsh((unit + unit.T) / 2)
    if sizes[0] < -(MOST_COUPLED - 1) * max(sizes[-1], 1.0):
        return "M is no mass: a motion of several rows has a negative one"
    return ""
