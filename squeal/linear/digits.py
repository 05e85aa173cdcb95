"""What the digits of a file leave open of roots.

An entry written with n significant digits is known to half a unit of the last one. Entries that
differ by so much in all places move a root lambda with vectors x and y by at most

    |y|' (|lambda|^2 |dM| + |lambda| |dC| + |dK|) |x| / |y^H (2 lambda M + C) x|

to first order. A free motion is a double root at zero, and the square of the root moves there.
"""

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array

from squeal.linear.eigen import Eigenvalue, arrays_of
from squeal.linear.matrices import EPS, Array, Matrix, dense, norm_of
from squeal.linear.system import System
from squeal.linear.terms import Term
from squeal.numerics.differentiation import Formula, Parameters

NEAR_ZERO = 0.25  # of |lambda|: a root that may move by more may be a double root at zero


def data_errors(
    system: System, changes: Parameters | None = None
) -> tuple[csc_array, csc_array, csc_array]:
    """How far the digits of files leave entries (n, n) of M, C and K open, at some parameters."""
    parameters = system.values(changes)
    errors = []
    for terms in system.parts:
        total = csc_array((system.n, system.n))
        for term in terms:
            errors_of_term = term.data_errors
            if errors_of_term is not None:
                total += abs(term.factor.value(parameters)) * errors_of_term
        errors.append(total)
    return errors[0], errors[1], errors[2]


def rounding_of_sums(system: System) -> tuple[Array, Array, Array]:
    """How far rounding may have moved entries (n, n) of M, C and K when terms were summed.

    This comes on top of half a unit in the last place of each entry, which the callers allow for
    anyway, and is zero where nothing else was rounded. Terms that cancel leave a rounding of the
    size of the terms. It is the sum of the sizes of the exact errors of all products and sums of
    doubles (Dekker, Numer. Math. 18, 1971); where one of the terms is complex, of bounds of them.
    """
    parameters = system.parameters
    errors = []
    for terms in system.parts:
        active = _terms_not_zero(terms, parameters)
        is_real = all(_is_real(term, parameters) for term in active)
        total = np.zeros((system.n, system.n))
        error = np.zeros((system.n, system.n))
        for term in active:
            factor = term.factor.value(parameters)
            matrix = dense(term.matrix)
            error += abs(factor) * term.rounding
            error += _error_of_factor(term, parameters) * np.abs(matrix)
            if isinstance(factor, complex) or not is_real:  # the first for type checkers alone
                # bounds: of its product, and of its share in each of the sums, for both parts
                size = abs(factor) * np.abs(matrix)
                error += 2.0 * (len(active) + 1) * EPS * size
                continue
            product, product_error = _exact_product(factor, matrix)
            total, sum_error = _exact_sum(total, product)
            error += np.abs(sum_error)
            if len(active) > 1:  # the error of a single product is within its half unit
                error += np.abs(product_error)
        errors.append(error * (1.0 + 8.0 * EPS))  # the errors themselves are rounded
    return errors[0], errors[1], errors[2]


def _terms_not_zero(terms: Sequence[Term], parameters: Parameters) -> list[Term]:
    """The terms that are not zero for certain: their factor is not 0, or rounding made it 0."""
    active = []
    for term in terms:
        if term.factor.value(parameters) or _error_of_factor(term, parameters):
            active.append(term)
    return active


def are_symmetric(system: System, terms: Sequence[Term], sign: int = 1) -> bool:
    """Whether each of some terms of a system is symmetric (sign 1) or skew (sign -1).

    A matrix that is symmetric in its file is taken for a symmetric one in truth, whose entries
    (i, j) and (j, i) were rounded to the same digits. A sum of such terms stays symmetric within
    its errors. Nothing ties the entries of different files to each other: of terms that are
    symmetric in sum alone, such as two halves of K, the true sum need not be symmetric. A term that
    is zero at the system's parameters adds nothing, and is left out.
    """
    for term in _terms_not_zero(terms, system.parameters):
        if abs(term.matrix - sign * term.matrix.T).max() > 0.0:
            return False
    return True


def _is_real(term: Term, parameters: Parameters) -> bool:
    """True if neither the matrix of a term nor its factor is complex."""
    return not (np.iscomplexobj(term.matrix) or isinstance(term.factor.value(parameters), complex))


def _error_of_factor(term: Term, parameters: Parameters) -> float:
    """How far rounding may have moved the factor of a term.

    Of a formula it is the distance to its value in fractions: 0 of a number or of a parameter
    alone, which are exact doubles. Of other factors it is a bound of four roundings.
    """
    factor = term.factor
    value = abs(factor.value(parameters))
    if not isinstance(factor, Formula):
        return 4.0 * EPS * value
    try:
        exact = factor.in_arithmetic(parameters, Fraction)
    except (ArithmeticError, TypeError, ValueError):
        exact = None
    if not isinstance(exact, Fraction):  # a power that is no rational number
        return 4.0 * EPS * value
    return float(abs(exact - Fraction(factor.value(parameters)))) * (1.0 + 2.0 * EPS)


def _exact_product(factor: float, matrix: Array) -> tuple[Array, Array]:
    """Products (n, n) in doubles, and their exact errors (n, n), by Dekker's algorithm.

    Where a part of the computation overflows a bound stands in place of the error.
    """
    product = factor * matrix
    with np.errstate(over="ignore", invalid="ignore"):
        high, low = _halves(np.asarray(factor))
        matrix_high, matrix_low = _halves(matrix)
        error = low * matrix_low - (
            ((product - high * matrix_high) - low * matrix_high) - high * matrix_low
        )
    return product, np.where(np.isfinite(error), error, EPS * np.abs(product))


def _halves(numbers: Array) -> tuple[Array, Array]:
    """Doubles as sums of two with 26 bits each (Veltkamp's splitting): the upper, the lower."""
    scaled = 134217729.0 * numbers  # 2^27 + 1
    high = scaled - (scaled - numbers)
    return high, numbers - high


def _exact_sum(a: Array, b: Array) -> tuple[Array, Array]:
    """Sums a + b in doubles, and their exact errors (Knuth's two-sum)."""
    total = a + b
    b_added = total - a
    return total, (a - (total - b_added)) + (b - b_added)


def _may_leave_axis(
    values: NDArray[np.complex128], bounds: Array, signs: Array | None
) -> NDArray[np.bool_]:
    """Which roots (m,) of a real undamped system may leave the imaginary axis within their bounds.

    A root leaves it through zero or where it meets another one. Where M and K stay symmetric, that
    other root must have the other sign of x^H M x (Krein's condition), as an indefinite M allows.

    Parameters
    ----------
    values : array (m,)
        The roots, rad/s.
    bounds : array (m,)
        How far each may move, rad/s.
    signs : array (m,), optional
        Of x^H M x, where M and K stay symmetric within their errors (`are_symmetric`).
    """
    distances = np.abs(values[:, None] - values)
    np.fill_diagonal(distances, np.inf)
    meets = distances <= bounds[:, None] + bounds
    if signs is not None:  # modes of one sign pass through each other on the axis
        meets &= signs[:, None] * signs <= 0.0
    return (values.real != 0.0) | (bounds >= np.abs(values)) | np.any(meets, axis=1)


def known_to_digits(system: System, roots: Sequence[Eigenvalue]) -> tuple[Eigenvalue, ...]:
    """Roots with their `error`: a bound of how far the digits of the system's files may move each.

    - The bound of a simple root is that of the module's head.
    - Where it exceeds a quarter of |lambda| the root may belong to a double root at zero, whose
      square moves by |y|' |dP| |x| / |y^H M x|. The bound is then sqrt(|lambda|^2 + this movement),
      the size that the root may have, or twice the bound of a simple root if that is less.
    - Where both are infinite, at a coalescence, the bound is the greater of |lambda| and the size
      that |dK| gives to a double root at zero. That size is sqrt(|dK| / |M|), or without any mass
      sqrt(|dK| |K|) / |C|.

    Roots of a real undamped system that stay on the imaginary axis within their bounds keep their
    `rounding`. That of every other root is raised to its bound, and its `sign_is_open` says whether
    the bound exceeds its real part.
    """
    if not roots:
        return ()
    M, C, K = system.at()
    if C is None:
        C = csc_array((system.n, system.n))
    dM, dC, dK = data_errors(system)
    z, x, y = arrays_of(roots, system.n)  # (m,), and right and left vectors (n, m)
    size = np.abs(z)

    def products(left: NDArray, matrix: Matrix, right: NDArray) -> NDArray:
        """left_j^H matrix right_j (m,) of the columns j."""
        return np.sum(left.conj() * (matrix @ right), axis=0)

    abs_x = np.abs(x)
    abs_y = np.abs(y)
    # |y|' |dP| |x|, how far the digits leave y^H P x open
    change = size**2 * products(abs_y, dM, abs_x)
    change += size * products(abs_y, dC, abs_x) + products(abs_y, dK, abs_x)
    mass = products(y, M, x)
    with np.errstate(divide="ignore", invalid="ignore"):
        simple_bounds = change / np.abs(2 * z * mass + products(y, C, x))
        double_bounds = np.sqrt(size**2 + change / np.abs(mass))
        is_near_zero = simple_bounds > NEAR_ZERO * size
        near_zero_bounds = np.fmin(2 * simple_bounds, double_bounds)  # fmin leaves out a NaN
        bounds = np.where(is_near_zero, near_zero_bounds, simple_bounds)
    unknown = ~np.isfinite(bounds)  # at a coalescence, where y^H P' x is zero
    if norm_of(M):
        of_zero = np.sqrt(norm_of(dK) / norm_of(M))
    else:
        of_zero = np.sqrt(norm_of(dK) * norm_of(K)) / norm_of(C)
    bounds[unknown] = np.maximum(size, of_zero)[unknown]
    may_leave_axis = np.ones(len(z), dtype=bool)  # with damping each root may leave the axis
    if system.real and not norm_of(C):
        signs = None  # Krein's signs, which only symmetric matrices have
        if are_symmetric(system, (*system.M, *system.K)):
            signs = np.sign(products(x, M, x).real)
        may_leave_axis = _may_leave_axis(z, bounds, signs)
    bounded_roots = []
    for k, root in enumerate(roots):
        bound = float(bounds[k])
        bounded = replace(root, error=bound, sign_is_open=False)
        if may_leave_axis[k]:
            has_unknown_sign = abs(root.value.real) <= bound
            rounding = max(root.rounding, bound)
            bounded = replace(bounded, rounding=rounding, sign_is_open=has_unknown_sign)
        bounded_roots.append(bounded)
    return tuple(bounded_roots)
