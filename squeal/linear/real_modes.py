"""Real modes of a structure without damping and friction: K x = omega^2 M x."""

import math
from collections.abc import Callable
from contextlib import suppress

import numpy as np

from squeal.errors import InputError
from squeal.linear.matrices import (
    EPS,
    Array,
    Matrix,
    dense,
    is_sparse,
    norm_of,
    rank_of,
    unit_diagonal,
)

FIRST_MODES = 32  # modes that are computed at first where their number is not known


def real_modes(
    K: Matrix, M: Matrix, count: int, ratios: Callable[[Array], Array] | None
) -> tuple[Array, Array]:
    """The lowest real modes of K x = omega^2 M x, of a large sparse system by Lanczos' method.

    Rows without mass follow the others statically and have no modes.

    Parameters
    ----------
    K, M : array or sparse array (n, n)
        Symmetric.
    count : int
        How many modes.
    ratios : function or None
        Damping ratios of frequencies (Hz), NaN outside of the range that it covers. Of a sparse
        system the modes up to the end of that range are computed, whatever `count` is; their number
        is doubled until it exceeds a quarter of all. None: as many as `count`.

    Returns
    -------
    omega : array (k,)
        rad/s, rising.
    modes : array (n, k)
        Vectors with x' M x = 1.

    Raises
    ------
    InputError
        If a dense M is not positive semidefinite, which is not checked of a sparse one, or K does
        not hold the rows without mass.
    """
    from scipy.sparse.linalg import ArpackError

    try:
        if (count == len(M.diagonal()) and ratios is None) or not is_sparse(K):
            squares, modes = _dense_modes(dense(K), dense(M), count)
        else:
            squares, modes = _sparse_modes(K, M, count, ratios)
    except (np.linalg.LinAlgError, ArpackError, RuntimeError, ZeroDivisionError):  # no mass at all
        raise InputError(
            "damping.ratios: M must be symmetric and positive semidefinite, and K hold the rows "
            "without mass"
        ) from None
    order = np.argsort(squares)
    return np.sqrt(np.maximum(squares[order], 0.0)), modes[:, order]


def _square_of_rows(K: Matrix, M: Matrix) -> float:
    """The geometric mean of the squares K_ii / M_ii of rows that move alone, (rad/s)^2.

    The ratio of the norms of K and M only where no row has stiffness and mass: the norm of K may be
    that of a stiff row without mass, beside which the squares of modes are rounding.
    """
    stiffnesses = K.diagonal()
    masses = M.diagonal()
    has_both = (stiffnesses != 0) & (masses > 0)
    if not has_both.any():
        return norm_of(K) / norm_of(M)
    squares = np.abs(stiffnesses[has_both] / masses[has_both])
    return float(np.exp(np.mean(np.log(squares))))


def _sparse_modes(
    K: Matrix, M: Matrix, count: int, ratios: Callable[[Array], Array] | None
) -> tuple[Array, Array]:
    """Squares of frequencies (k,) and vectors (n, k) of a sparse system, see `real_modes`."""
    from scipy.sparse.linalg import eigsh

    shift = -1e-9 * _square_of_rows(K, M)  # below all squares, so that K - shift M is regular
    k = FIRST_MODES if ratios else count
    while True:
        squares, modes = eigsh(K, k=k, M=M, sigma=shift)
        highest = np.sqrt(np.maximum(squares.max(keepdims=True), 0.0)) / math.tau  # (1,), in Hz
        if ratios is None or np.isnan(ratios(highest)[0]) or 4 * k > K.shape[0]:
            return squares, modes
        k *= 2  # until the highest one lies outside of what `ratios` covers


def _dense_modes(K: Array, M: Array, count: int) -> tuple[Array, Array]:
    """The lowest eigenvalues (k,) of K x = s M x, k <= count, and vectors (n, k) with x' M x = 1.

    Where M is singular to rounding, M x = r (K + shift M) x with r = 1/(s + shift) is solved
    instead, and the motions without mass are left out, whose r is rounding beside the largest.
    Raises LinAlgError if that is no definite pair either.
    """
    from scipy.linalg import eigh

    # masses that are small only beside others count, hence the unit diagonal; of what is singular
    # to rounding beyond that the signs of rounding would decide
    masses = np.linalg.eigvalsh(unit_diagonal(M))
    rank = rank_of(np.maximum(masses, 0.0))
    if rank == len(M):
        squares, modes = eigh(K, M, subset_by_index=(0, count - 1))
        return squares, modes
    if rank_of(np.abs(masses)) > rank or rank == 0:
        raise np.linalg.LinAlgError("M is not positive semidefinite, or zero")
    # a K with negative squares may need the larger shift
    for shift in (_square_of_rows(K, M), norm_of(K) / norm_of(M)):
        with suppress(np.linalg.LinAlgError):
            r, modes = eigh(M, K + shift * M)
            break
    else:
        raise np.linalg.LinAlgError("no shift makes K + shift M positive definite")
    r = r[-rank:]
    has_mass = r > 4 * len(M) * EPS * r[-1]
    # the largest r, the lowest s, first. `eigh` gives x' (K + shift M) x = 1, hence x' M x = r
    r = r[has_mass][::-1]
    modes = modes[:, -rank:][:, has_mass][:, ::-1] / np.sqrt(r)
    squares = 1.0 / r - shift
    return squares[:count], modes[:, :count]
