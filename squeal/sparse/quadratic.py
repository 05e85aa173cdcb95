"""The quadratic eigenproblem lambda^2 M + lambda C + K of large sparse matrices, scaled so that
units do not matter, and its roots."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from contextvars import ContextVar
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from squeal.errors import MatrixError
from squeal.linear.eigen import Eigenvalue, normalised
from squeal.linear.matrices import EPS, Matrix, divisor, norm_of
from squeal.linear.roots import ordered, root_rounding
from squeal.linear.system import System
from squeal.linear.terms import Term
from squeal.numerics.differentiation import Parameters
from squeal.numerics.threads import stop_if_over

if TYPE_CHECKING:
    from scipy.sparse import csc_array

ComplexArray = NDArray[np.complex128]
Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Indices = NDArray[np.intp]
LEAST_BACKWARD_ERROR = 8 * EPS  # backward error that a computed root has at least
LOST = 0.1
"""A fast root that rounding moves by more than this share of its size may be one at infinity."""
MIXED = 0.1
"""Roots that rounding moves by more than this share of their distance may be one multiple root."""
ALONE = 1e-3
"""A root without another one within this share of its size is not a multiple one."""

Progress = Callable[[str], None]
PROGRESS: ContextVar[Progress] = ContextVar("progress", default=lambda _: None)
"""What is called with a line about each step of a long computation."""


def report_progress(text: str) -> None:
    """Say what a long computation does next; one that nobody waits for any more ends here."""
    stop_if_over()
    PROGRESS.get()(text)


@dataclass(frozen=True, eq=False, repr=False)
class ScaledProblem:
    """P(lambda) = lambda^2 M + lambda C + K in coordinates x, q = scale x; M may be singular.

    M, C, K are CSC arrays (n, n), C of zeros if undamped; `norms` |M|, |C|, |K| bound their
    2-norms.
    """

    M: csc_array
    C: csc_array
    K: csc_array
    scale: Array  # (n,) powers of two
    norms: tuple[float, float, float]

    @property
    def n(self) -> int:
        """Number of degrees of freedom."""
        return len(self.scale)

    @property
    def is_real(self) -> bool:
        """True if all matrices are real, so that roots come in conjugate pairs."""
        return not any(np.iscomplexobj(A.data) for A in (self.M, self.C, self.K))

    @property
    def frequency_scale(self) -> float:
        """sqrt(|K| / |M|), an upper scale of the frequencies, rad/s; |K| / |C| without mass."""
        mass, damping, stiffness = self.norms
        if mass == 0.0:
            return stiffness / damping
        return math.sqrt(stiffness / mass)

    def arrays(self) -> tuple[NDArray, NDArray, NDArray]:
        """M, C and K as NumPy arrays."""
        return self.M.toarray(), self.C.toarray(), self.K.toarray()

    def at(self, value: complex) -> csc_array:
        """P(value), a CSC array; real where both are."""
        root = value.real if value.imag == 0.0 else value
        return root * (root * self.M + self.C) + self.K

    def slope(self, value: complex) -> csc_array:
        """dP/dlambda = 2 value M + C, a CSC array; real where both are."""
        root = value.real if value.imag == 0.0 else value
        return 2 * root * self.M + self.C

    def apply(self, values: ComplexArray, vectors: ComplexArray) -> ComplexArray:
        """P(values[j]) vectors[:, j] as columns (n, m)."""
        images = multiply(self.M, vectors) * values**2 + multiply(self.C, vectors) * values
        return images + multiply(self.K, vectors)

    def backward_errors(self, values: ComplexArray, vectors: ComplexArray) -> Array:
        """|P x| / ((|v|^2 |M| + |v| |C| + |K|) |x|) for each column x of vectors (n, m)."""
        residuals = np.linalg.norm(self.apply(values, vectors), axis=0)
        sizes = self.size(values) * np.linalg.norm(vectors, axis=0)
        return residuals / divisor(sizes)  # the root 0 of K = 0 has the size 0, and no error

    def size(self, values: NDArray) -> Array:
        """|v|^2 |M| + |v| |C| + |K| for each value, a bound of |P(v)|."""
        return np.polyval(self.norms, np.abs(values))

    def transposed(self) -> ScaledProblem:
        """The problem of the left vectors: P(lambda)' y = 0, y not conjugated."""
        return replace(self, M=self.M.T, C=self.C.T, K=self.K.T)


def multiply(A: Matrix, columns: NDArray) -> ComplexArray:
    """A (n, k) times complex columns (k, m), of a real A without a complex copy of it."""
    product = A @ np.hstack([columns.real, columns.imag])
    real, imaginary = np.split(product, 2, axis=1)
    return real + 1j * imaginary


class ScaledSystem:
    """A system of terms in coordinates x, q = scale x, the same at all parameters.

    Rows and columns are scaled alike, by powers of two, to a unit diagonal of K + w |C| + w^2 M at
    a median frequency w and the system's own parameters: mixtures of units cost no accuracy.
    Another scale (n,) may be given. `terms` are the scaled matrices of M, of C and of K, `zeros`
    counts roots at zero that the system lacks, 0 at first. Raises InputError for an empty row.
    """

    zeros = 0

    def __init__(self, system: System, scale: Array | None = None) -> None:
        from scipy.sparse import csc_array

        self.system = system
        self.n = system.n
        self.terms: list[list[csc_array]] = []
        for terms in system.parts:
            self.terms.append([csc_array(term.matrix, copy=True) for term in terms])
        self._zero = csc_array((self.n, self.n))  # the matrix of a part that has no terms
        if scale is None:
            scale = _diagonal_scale(system, self.terms)
        self.scale = scale
        for A in itertools.chain(*self.terms):  # A_ij becomes scale_i A_ij scale_j
            A.sum_duplicates()
            # of each stored entry its column; A.indices are their rows
            columns = np.repeat(np.arange(self.n), np.diff(A.indptr))
            A.data = A.data * self.scale[A.indices] * self.scale[columns]

    def at(self, changes: Parameters | None = None) -> ScaledProblem:
        """The problem at the system's parameters, some of them changed."""
        p = self.system.values(changes)
        M, C, K = self._sums(lambda term: term.factor.value(p))
        norms = (norm_of(M), norm_of(C), norm_of(K))
        if not norms[0] and not norms[1]:
            raise MatrixError("M: is zero beside K in double precision; M or C must not be")
        if not np.isfinite(norms).all():
            raise MatrixError("M, C and K: all entries must be finite")
        return ScaledProblem(M=M, C=C, K=K, scale=self.scale, norms=norms)

    def slope(self, name: str, changes: Parameters | None, value: complex) -> csc_array:
        """dP(value)/d name as a CSC array."""
        p = self.system.values(changes)
        M, C, K = self._sums(lambda term: term.factor.slope(p, name))
        return value * (value * M + C) + K

    def _sums(self, weight: Callable[[Term], complex]) -> list[csc_array]:
        """The matrices of M, of C and of K, each summed with the weights of its terms."""
        sums = []
        for terms, matrices in zip(self.system.parts, self.terms, strict=True):
            total = self._zero
            for term, A in zip(terms, matrices, strict=True):
                factor = weight(term)
                if factor:
                    total = total + factor * A
            sums.append(total)
        return sums


def scaled_problem(M: Matrix, C: Matrix | None, K: Matrix) -> ScaledProblem:
    """The scaled problem of M q'' + C q' + K q = 0, matrices (n, n), sparse or dense.

    Raises InputError for a row without mass and stiffness, or without any mass.
    """
    damping = () if C is None else (Term(C),)
    return ScaledSystem(System((Term(M),), damping, (Term(K),))).at()


def _diagonal_scale(system: System, matrices: list[list[csc_array]]) -> Array:
    """The scale (n,) of rows and columns, powers of two, with which the diagonal of
    K + w |C| + w^2 M lies between 1/2 and 2.

    w is a median frequency, rad/s. `matrices` are those of the terms of M, of C and of K. Raises
    InputError for an empty row.
    """
    mass, damping, stiffness = _diagonal_sizes(system, matrices)
    # C with zero on its diagonal couples rows that may be in other units, as gyroscopic terms do:
    # such a row is scaled by its mass and stiffness, if it has any
    on_diagonal = sum(abs(A.diagonal()) for A in matrices[1])
    damping = np.where((mass + stiffness > 0) & (on_diagonal == 0), 0.0, damping)
    squares = stiffness / np.where(mass > 0, mass, np.inf)  # frequency^2 of each row by itself
    # their (lower) median, since a mass that is rounding makes some of them huge
    squares = np.sort(squares[squares > 0])
    if len(squares):
        square = float(squares[(len(squares) - 1) // 2])
    else:
        square = _first_order_rate(damping, stiffness) ** 2
    diagonal = square * mass + stiffness + np.sqrt(square) * damping
    if not np.all(diagonal > 0):
        row = int(np.argmin(diagonal > 0)) + 1  # the first one, counted from 1
        raise MatrixError(f"row {row} of M, C and K is empty; every row needs mass or stiffness")
    # rows and columns are multiplied by the scale: the diagonal by its square
    return 2.0 ** -np.round(np.log2(diagonal) / 2)


def _diagonal_sizes(system: System, matrices: list[list[csc_array]]) -> Array:
    """The sizes (3, n) of the diagonals of M, C and K at the system's own parameters.

    They are summed over the terms. Where an entry of a term's diagonal is zero, the largest entry
    of its column takes its place. matrices: of the terms of M, of C and of K, three lists.
    """
    diagonals = np.zeros((3, system.n))
    # `sizes` is a row of `diagonals`, to which the terms of M, C or K are added
    for sizes, terms, matrices_of_part in zip(diagonals, system.parts, matrices, strict=True):
        for term, A in zip(terms, matrices_of_part, strict=True):
            entries = np.abs(A.diagonal())
            if A.nnz and not entries.all():
                largest = abs(A).max(axis=0).toarray().ravel()
                entries = np.where(entries > 0, entries, largest)
            sizes += abs(term.factor.value(system.parameters)) * entries
    return diagonals


def _first_order_rate(damping: Array, stiffness: Array) -> float:
    """The rate (1/s) of C q' + K q = 0, from the sizes (n,) of the diagonals of C and K."""
    rates = stiffness[damping > 0.0] / damping[damping > 0.0]
    if not np.any(rates > 0.0):
        return 1.0
    return float(np.median(rates[rates > 0.0]))


def projected(system: System, left: NDArray, right: NDArray) -> System:
    """The system left^H A right of columns (n, d), every term with its factor."""

    def small(term: Term) -> Term:
        return Term(left.conj().T @ term.matrix @ right, term.factor)

    return system.mapped(small, system.labels)


@dataclass(frozen=True, eq=False)
class Roots:
    """Values (m,) with right and left vectors (n, m)."""

    values: ComplexArray
    right: ComplexArray = field(repr=False)
    left: ComplexArray = field(repr=False)

    @staticmethod
    def none(rows: int) -> Roots:
        """No root of a problem of so many rows."""
        vectors = np.zeros((rows, 0), dtype=complex)
        return Roots(values=np.zeros(0, dtype=complex), right=vectors, left=vectors)

    def select(self, which: NDArray) -> Roots:
        """Some of them, by mask or index."""
        return Roots(self.values[which], self.right[:, which], self.left[:, which])

    def joined(self, other: Roots) -> Roots:
        """These roots, then the others."""
        return Roots(
            values=np.concatenate([self.values, other.values]),
            right=np.hstack([self.right, other.right]),
            left=np.hstack([self.left, other.left]),
        )

    def expanded(self, basis: NDArray) -> Roots:
        """The roots with vectors of all rows, from those in the coordinates of a basis (n, d)."""
        return Roots(self.values, multiply(basis, self.right), multiply(basis, self.left))

    def with_conjugates(self) -> Roots:
        """These roots, then the conjugates of those above the real axis."""
        upper = self.select(self.values.imag > 0.0)
        return self.joined(Roots(upper.values.conj(), upper.right.conj(), upper.left.conj()))


def eigenvalues_of(problem: ScaledProblem, roots: Roots) -> tuple[Eigenvalue, ...]:
    """Roots with backward errors, condition numbers and rounding, by rising frequency.

    Their vectors are in the coordinates of the system before scaling, with x^H M x = 1 if there is
    mass, and the largest entry positive.
    """
    residuals = problem.backward_errors(roots.values, roots.right)
    conditions = _conditions(problem, roots)
    rounding = _rounding(problem, roots, residuals, conditions)
    # a rounding as large as the root says that it is open whether an infinite root grows
    rounding = np.where(_may_be_infinite(problem, roots), np.abs(roots.values), rounding)
    right = _in_unscaled_coordinates(problem, roots.right)
    left = _in_unscaled_coordinates(problem, roots.left)
    eigenvalues = []
    for j in ordered(roots.values):
        eigenvalues.append(
            Eigenvalue(
                value=complex(roots.values[j]),
                right=right[:, j],
                left=left[:, j],
                residual=float(residuals[j]),
                condition=float(conditions[j]),
                rounding=float(rounding[j]),
            )
        )
    return tuple(eigenvalues)


def _conditions(problem: ScaledProblem, roots: Roots) -> Array:
    """Condition numbers (m,): the relative change of each root by relative changes of M, C, K.

    (|z|^2 |M| + |z| |C| + |K|) |x| |y| / (|z| |y^H P'(z) x|), infinite where the divisor vanishes.
    """
    slopes = _slopes(problem, roots)
    lengths = np.linalg.norm(roots.right, axis=0) * np.linalg.norm(roots.left, axis=0)
    sizes = problem.size(roots.values) * lengths
    return np.divide(sizes, slopes, out=np.full(len(sizes), np.inf), where=slopes != 0)


def _slopes(problem: ScaledProblem, roots: Roots) -> Array:
    """|z| |y^H P'(z) x| (m,) of each root: what a relative change of z does to y^H P(z) x."""
    image = multiply(problem.M, roots.right * (2 * roots.values))
    image += multiply(problem.C, roots.right)
    return np.abs(roots.values) * np.abs(np.sum(roots.left.conj() * image, axis=0))


def _may_be_infinite(problem: ScaledProblem, roots: Roots) -> Bools:
    """True for roots (m,) that may be infinite ones.

    Where rounding of entries makes a singular M regular, infinite roots become huge ones: beyond
    the frequency scale, and rounding of each entry moves them by more than a share `LOST` of their
    size. A light mass makes roots as huge, but rounding of its own small entry hardly moves them.
    So the entries are compared here, not norms as in `_rounding`. Roots that are not alone are left
    out: of a multiple root y^H P'(z) x may vanish at any size.
    """
    values = roots.values
    sizes = np.abs(values)
    distances = np.abs(values[:, None] - values)
    np.fill_diagonal(distances, np.inf)
    is_alone = distances.min(axis=1, initial=np.inf) > ALONE * sizes
    is_fast = sizes > problem.frequency_scale
    # a root moves by dz where y^H P'(z) x dz is the error of y^H P x: by the remainder P x, and by
    # rounding of each entry
    remainders = np.abs(problem.apply(values, roots.right))
    shapes = np.abs(roots.right)
    terms = sizes * (sizes * (abs(problem.M) @ shapes) + abs(problem.C) @ shapes)
    terms += abs(problem.K) @ shapes
    changes = np.sum(np.abs(roots.left) * (remainders + LEAST_BACKWARD_ERROR * terms), axis=0)
    return is_fast & is_alone & (changes > LOST * _slopes(problem, roots))


def _rounding(problem: ScaledProblem, roots: Roots, residuals: Array, conditions: Array) -> Array:
    """How far rounding may move each root (rad/s); exact zeros by nothing.

    A simple root of P moves by error * condition * |lambda|. `root_rounding` is made for the
    eigenvalues of a matrix, of which a simple one moves by error * c * norm. Here it gets a scale
    (rad/s) of each root in place of the norm, and c = condition * |lambda| / scale. The scale also
    limits what it does for close roots: distances below error * scale count as error * scale, and
    no root moves further than 2 scale error^(1 / rows).

    residuals (m,): backward errors of the m roots; conditions (m,): those of `_conditions`.
    """
    values = roots.values
    sizes = np.abs(values)
    errors = np.maximum(residuals, LEAST_BACKWARD_ERROR)
    moves_alone = _moves_alone(problem, roots.right)
    # each right vector of a root that moves alone is a left one, too; the computed left one is
    # another mixture of the vectors of close roots, by which y^H P'(z) x may be too small
    of_right = _conditions(problem, Roots(values, roots.right, roots.right))
    conditions = np.where(moves_alone, of_right, conditions)
    scales = _scales(problem, sizes, errors)
    with np.errstate(invalid="ignore"):  # K = 0: the root is 0
        # c of the docstring; conditions beyond 1 / EPS are those of defective roots, all alike
        scaled_conditions = np.minimum(conditions, 1 / EPS) * sizes / scales
    # a root may meet its conjugate, which is added for the call if it is not listed
    is_unpaired = problem.is_real & (values.imag != 0) & ~np.isin(values.conj(), values)
    all_values = np.append(values, values[is_unpaired].conj())
    indices = np.append(np.arange(len(values)), np.flatnonzero(is_unpaired))
    rounding = root_rounding(
        all_values,
        condition=scaled_conditions[indices],
        error=errors[indices],
        size=scales[indices],
        rows=2 * problem.n,  # of the companion form
    )
    # roots of a defective root alone are grouped, see `_rounding_in_groups`
    reach = np.where(moves_alone[indices], 0.0, rounding)
    rounding = _rounding_in_groups(all_values, rounding, reach)
    return np.where(sizes > 0, rounding[: len(values)], 0.0)


def _scales(problem: ScaledProblem, sizes: Array, errors: Array) -> Array:
    """The scale (m,) of each root, rad/s, in place of the norm of a matrix, see `_rounding`.

    sizes: |lambda| (m,); errors: the relative error (m,) of M, C and K that each root stands for.
    Rounding of K moves lambda^2 by error omega_K^2, with the problem's frequency scale omega_K,
    which is much for a root far below omega_K. With z = max(|lambda|, sqrt(error) omega_K) the
    scale is the largest of

    - |lambda|;
    - |P(lambda)| / |P'(z)|: times the error, how far rounding moves even a root of the least
      condition, and so each of a multiple root, whose computed copies lie that far apart. Without
      damping this decides up to |lambda| = omega_K;
    - sqrt(error) omega_K^2 / z, at most omega_K: it decides for slow roots where |C| exceeds
      sqrt(|K| |M|) by far.
    """
    least_size = np.sqrt(errors) * problem.frequency_scale
    z = np.maximum(sizes, least_size)
    mass, damping, _ = problem.norms
    with np.errstate(invalid="ignore"):  # K = 0: the root is 0
        of_slow_roots = least_size * (problem.frequency_scale / z)
        of_multiple_roots = problem.size(sizes) / (2 * z * mass + damping)
        # `fmax` leaves out what is not a number: 0 / 0 of a root that is zero
        return np.fmax(np.fmax(sizes, of_slow_roots), of_multiple_roots)


def _moves_alone(problem: ScaledProblem, right: ComplexArray) -> Bools:
    """True for roots (m,) of Hermitian M and K that belong to no defective root, by the right
    vectors x (n, m).

    Without damping x is a left vector too, and a defective root has x^H M x = 0. Roots of vectors
    with mass move as those of a Hermitian matrix, however close others lie (Weyl).
    """
    asymmetry = norm_of(problem.M - problem.M.conj().T) / divisor(problem.norms[0])
    asymmetry += norm_of(problem.K - problem.K.conj().T) / divisor(problem.norms[2])
    is_hermitian = problem.norms[1] == 0.0 and asymmetry <= LEAST_BACKWARD_ERROR
    masses = np.sum(right.conj() * multiply(problem.M, right), axis=0).real
    return is_hermitian & (masses > MIXED * problem.norms[0] * np.linalg.norm(right, axis=0) ** 2)


def _rounding_in_groups(values: ComplexArray, rounding: Array, reach: Array) -> Array:
    """The rounding (m,) of roots (m,), raised to the distance of each from the mean of its group.

    Rounding splits a defective root into m roots at a distance r around it, but moves their mean by
    little. By its condition, r^(1 - m), each of the m roots seems to be known to r / m or better:
    so well that its real part, up to r, would pass for growth. Roots are in one group if rounding
    moves each by more than a share `MIXED` of their distance: six roots around a defective one are
    r apart, and each seems to be known to r / 9. `reach` (m,): how far rounding moves each, 0 for
    one that belongs to no defective root.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    distances = np.abs(values[:, None] - values)
    is_mixed = np.minimum(reach[:, None], reach) > MIXED * distances
    _, group = connected_components(csr_array(is_mixed), directed=False)
    members = np.bincount(group)
    sums = np.bincount(group, values.real) + 1j * np.bincount(group, values.imag)
    means = (sums / members)[group]  # (m,), of the group of each root
    return np.maximum(rounding, np.abs(values - means))


def _in_unscaled_coordinates(problem: ScaledProblem, scaled: ComplexArray) -> ComplexArray:
    """Vectors (n, m) before scaling, the largest entry real and positive, of unit mass x^H M x;
    vectors without mass have unit length in the scaled coordinates."""
    mass = np.abs(np.sum(scaled.conj() * (problem.M @ scaled), axis=0))
    length = np.where(mass == 0, np.linalg.norm(scaled, axis=0), np.sqrt(mass))
    return normalised(problem.scale[:, None] * scaled, length)
