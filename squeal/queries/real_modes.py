"""Real modes K x = omega^2 M x without friction and damping, and which of them are free motions."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, eigh
from scipy.sparse import coo_array, csc_array

from squeal.errors import ComputationError
from squeal.linear.damping import frictionless
from squeal.linear.digits import data_errors
from squeal.linear.matrices import EPS, Array, Matrix, dense
from squeal.linear.system import TermSystem
from squeal.queries.systems.matrices import ALL_ROWS
from squeal.sparse.factor import factorise, modes_near
from squeal.sparse.quadratic import ScaledSystem

# the square of the frequency scale of a system is the unit of squares omega^2 in these constants
BELOW = -1e-6  # the shift, next to which the lowest modes lie
FAR_BELOW = -10.0  # the shift that is tried where a stiffness is negative
NOISE = 1e3 * EPS  # what rounding in other programs makes of a square of zero: 1,000 roundings
CLEARLY = 1e3  # of that noise: rounding does not mix faster modes with slow ones
CLEAR_MASS = 1e-10  # of the largest |theta|, a mass over a stiffness: less is hardly any mass
MORE = 6  # modes by which each search of the lowest ones asks for more
MOST_MORE = 30  # modes that the last search asks for beyond those that are wanted


class RealModes(NamedTuple):
    """The lowest real modes of a system.

    Attributes
    ----------
    squares : array (m,)
        Squares of the angular frequencies (rad/s)^2, rising; negative of negative stiffness.
    errors : array (m,)
        How far the digits of the entries leave each square open. A motion whose square is not
        larger than this error is free.
    noise : float
        What rounding in a program that assembles or reduces K may make of a square that is zero.
    """

    squares: Array
    errors: Array
    noise: float


def real_modes(system: TermSystem, count: int) -> RealModes:
    """The lowest real modes, of K x = omega^2 M x without friction and damping.

    All modes of a small system are computed, and of a larger one if most of them are wanted. Else
    `_lowest_by_lanczos` computes the lowest ones, until `count` of them have a square omega^2 above
    `noise`, which is what rounding may make of a zero square. Rounding mixes the shapes of modes
    with squares up to `CLEARLY` times `noise`: `_slow_modes` refines these modes.

    Raises
    ------
    ComputationError
        If the modes cannot be computed.
    """
    from scipy.sparse.linalg import ArpackError

    without_friction = frictionless(system)  # the parameters
    scaled = ScaledSystem(system).at(without_friction)
    K = (scaled.K + scaled.K.T).real / 2  # the symmetric part
    M = (scaled.M + scaled.M.T).real / 2
    square_of_scale = scaled.frequency_scale**2
    noise = NOISE * square_of_scale
    try:
        # Lanczos' method computes fewer than n - 1 modes
        if system.n <= max(ALL_ROWS, count + MOST_MORE + 1):
            squares, vectors, largest = _all_real_modes(dense(K), dense(M), square_of_scale)
            noise = max(noise, system.n * EPS * largest)  # or n roundings of the largest square
        else:
            # K - shift M is regular, also where motions are free, if the shift is a little below 0.
            # K = 0 has the frequency scale 0, and any shift serves
            shift = BELOW * (square_of_scale or 1.0)
            squares, vectors = _lowest_by_lanczos(K, M, count, shift, noise)
    except (ArpackError, ArithmeticError, RuntimeError, ValueError) as error:
        raise ComputationError(f"the real modes were not found (is M the mass?): {error}") from None
    order = np.argsort(squares)
    squares = squares[order]
    shapes = (scaled.scale[:, None] * vectors[:, order]).real  # in the system's own coordinates
    slow = np.abs(squares) <= CLEARLY * noise
    if slow.any():
        squares[slow], shapes[:, slow] = _slow_modes(system, without_friction, shapes[:, slow])
    errors = _errors_of_squares(system, without_friction, squares, shapes)
    return RealModes(squares, errors, noise)


def _lowest_by_lanczos(
    K: csc_array, M: csc_array, count: int, shift: float, noise: float
) -> tuple[Array, NDArray]:
    """The lowest modes of K x = square M x (n, n), by inverse (Lanczos) iteration about a shift.

    At first `count` + 6 modes are computed, then 6 more in each further search, until `count`
    modes have a square above `noise`. Five searches are the most: of a system with more than 30
    free motions fewer than `count` such modes are returned. `shift` and `noise` are squares of
    angular frequencies, as the squares of the modes are.

    Returns
    -------
    squares : array (m,)
        The squares next to the shift.
    vectors : array (n, m)
        Their modes.

    Raises
    ------
    ArpackError
        If the iteration does not converge.
    """
    factor = factorise((K - shift * M).tocsc())
    for computed in range(count + MORE, count + MOST_MORE + 1, MORE):
        # maxiter ends a search that never converges, as where all squares are equal (K given as M)
        squares, vectors = modes_near(K, M, shift, computed, factor, maxiter=100)
        if np.sum(squares > noise) >= count:
            break
    return squares, vectors


def _slow_modes(
    system: TermSystem, parameters: Mapping[str, float], shapes: NDArray
) -> tuple[Array, NDArray]:
    """The squares (k,) and shapes (n, k) of slow modes, refined by the Rayleigh-Ritz method.

    K and M, at these parameters, are projected on the computed shapes (n, k), which span the slow
    modes but are mixed by rounding. The product K x is taken in long double: in double its
    rounding, which the fastest mode sets, is larger than the squares of slow ones.
    """
    M, _, K = system.at(parameters)
    # K x as a sum over the stored entries: row r gets K_rc x_c of each entry (r, c)
    entries = coo_array(K)
    products = entries.data.real.astype(np.longdouble)[:, None] * shapes[entries.col]
    forces = np.zeros(shapes.shape, dtype=np.longdouble)
    np.add.at(forces, entries.row, products)
    projected_K = (shapes.T @ forces).astype(float)
    projected_M = shapes.T @ (M.real @ shapes)
    symmetric_K = (projected_K + projected_K.T) / 2
    # solved without use of the symmetry: what this leaves of imaginary parts is rounding
    squares, combinations = np.linalg.eig(np.linalg.solve(projected_M, symmetric_K))
    order = np.argsort(squares.real)
    return squares.real[order], shapes @ combinations.real[:, order]


def _all_real_modes(K: NDArray, M: NDArray, square_of_scale: float) -> tuple[Array, NDArray, float]:
    """All real modes of a small system, from the eigenvalues theta of M x = theta (K - shift M) x.

    K x = square M x then holds with square = shift + 1 / theta. A motion without mass has
    theta = 0, which rounding leaves below n EPS times the largest |theta|.

    `eigh` needs a positive definite K - shift M, as it is with a shift below all squares. It gives
    independent shapes for a repeated square. Where a motion without mass has a negative stiffness
    no shift makes K - shift M positive definite. `eig` then solves the same problem without its
    symmetry; shapes of a repeated square may then depend on one another.

    square_of_scale: of the frequency scale, (rad/s)^2; K and M symmetric, (n, n).

    Returns
    -------
    squares : array (m,)
        Of the motions that have a mass.
    shapes : array (n, m)
        Their shapes.
    largest : float
        The largest square of the motions whose mass is clearly above rounding, 0 without one.
    """
    for below in (BELOW, FAR_BELOW):
        shift = below * (square_of_scale or 1.0)  # K = 0 has the frequency scale 0
        try:
            theta, vectors = eigh(M, K - shift * M)
            break
        except LinAlgError:  # K - shift M is not positive definite
            continue
    else:  # with neither shift: the second one stays
        values, vectors = np.linalg.eig(np.linalg.solve(K - shift * M, M))
        theta = values.real
    size = np.abs(theta)
    has_clear_mass = size > CLEAR_MASS * size.max()
    largest = float(np.max(shift + 1 / theta[has_clear_mass], initial=0.0))
    has_mass = size > len(M) * EPS * size.max()
    return shift + 1 / theta[has_mass], vectors[:, has_mass], largest


def _errors_of_squares(
    system: TermSystem, parameters: Mapping[str, float], squares: Array, shapes: NDArray
) -> Array:
    """Bounds (m,) of the change of each squared frequency, to first order in that of the entries.

    An entry may lie off by what the digits of its file leave open, and by half an ulp of its
    double. The square of a mode x then changes by (x^T dK x - square x^T dM x) / (x^T M x); the
    bounds of dK and dM are taken with the absolute values of x. Infinite for a mode without mass.

    parameters: at which M and K are taken; squares (m,): omega^2 of the modes, rad^2/s^2; shapes
    (n, m): of the modes.
    """
    M, _, K = system.at(parameters)
    dM, _, dK = data_errors(system, parameters)
    dM = dM + _half_ulps(M)
    dK = dK + _half_ulps(K)
    size = np.abs(shapes)
    numerators = np.sum(size * (dK @ size + np.abs(squares) * (dM @ size)), axis=0)
    masses = np.abs(np.sum(shapes.conj() * (M @ shapes), axis=0))
    infinite = np.full(len(squares), np.inf)
    return np.divide(numerators, masses, out=infinite, where=masses > 0.0)


def _half_ulps(X: Matrix) -> csc_array:
    """Half a unit in the last place of each entry (n, n)."""
    size = abs(csc_array(X))
    return csc_array((np.spacing(size.data) / 2, size.indices, size.indptr), shape=size.shape)
