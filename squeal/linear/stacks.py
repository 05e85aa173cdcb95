"""Eigenvalues of many small systems at once; `benchmarks/stacks.py` holds them against NumPy's."""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from squeal.errors import InputError
from squeal.linear.eigen import ComplexArray
from squeal.linear.matrices import (
    FASTEST,
    ILL,
    SKEW,
    Array,
    Batched,
    Matrices,
    System,
    beyond,
    factor,
    normalised,
    real_array,
    reduce,
)


def sweep(system: System, mus: Iterable[float]) -> ComplexArray:
    """Eigenvalues over a sweep, shape (n_mu, 2n), each row ordered as in a Spectrum.

    All values of mu together, see `stack_eigenvalues`. Raises InputError.
    """
    places = list(mus)
    matrices = system.many(places) if isinstance(system, Batched) else [*map(system, places)]
    if not matrices:
        raise ValueError("mus: at least one value is required")
    M, C, K = zip(*matrices, strict=True)
    try:
        mass = M[0] if all(m is M[0] for m in M) else real_array("M", M)
        damping = None if all(c is None for c in C) else real_array("C", C)
        stiffness = real_array("K", K)
    except InputError:  # no numbers, other shapes, damping at some mu only
        return _one_by_one(matrices)
    return stack_eigenvalues(mass, damping, stiffness)


def stack_eigenvalues(M: ArrayLike, C: ArrayLike | None, K: ArrayLike) -> ComplexArray:
    """Eigenvalues (m, 2n) in rad/s of m systems, each row ordered as in a Spectrum.

    K has shape (m, n, n), M and C that or (n, n) for all; C is None without damping. Undamped, with
    real parts of exactly zero where nothing grows, only if every C is zero. Vectors and zero roots
    told by rank are left to `complex_eigenvalues`. Raises InputError, and OverflowError if roots
    are beyond double precision.
    """
    K = _numbers("K", K, ())
    shape = K.shape
    M = _numbers("M", M, shape)
    C = None if C is None else _numbers("C", C, shape)
    try:
        with np.errstate(all="ignore"):
            if C is None or not np.count_nonzero(C):
                T = factor(M.tobytes(), len(M))[0] if M.ndim == 2 else _factors(M)
                return _undamped(normalised(T, K), K)
            return _damped(M, C, K)
    except np.linalg.LinAlgError:  # an M that has to be looked at, entries that are not finite
        each = [np.broadcast_to(X, shape) for X in (M, np.zeros(shape) if C is None else C)]
        return _one_by_one([*zip(*each, K, strict=True)])


def _numbers(name: str, value: ArrayLike, shape: tuple[int, ...]) -> Array:
    stack = real_array(name, value)
    allowed = (shape, shape[1:])
    if shape and stack.shape not in allowed:
        raise InputError(f"{name}: shape {stack.shape}; K has shape {shape}")
    if not shape and (stack.ndim != 3 or stack.shape[1] != stack.shape[2] or not stack.size):
        raise InputError(f"{name}: shape {stack.shape}; a stack (m, n, n) is required")
    return stack


def _known(roots: Array | ComplexArray, A: Array, B: Array | None, K: Array) -> None:
    """Raise LinAlgError if `reduce` would refuse one of the systems with these roots."""
    slow = 1.0 / roots
    # between these sums of squares nothing was lost at either end of double precision
    fine = np.vdot(roots, roots).real < FASTEST and np.vdot(slow, slow).real < FASTEST
    if not fine and beyond(A, B, K):
        raise np.linalg.LinAlgError


def _one_by_one(matrices: Sequence[Matrices]) -> ComplexArray:
    """Eigenvalues (m, 2n). Raises InputError as `reduce` does."""
    each = [reduce(*given) for given in matrices]
    A = np.array([r.A for r in each])
    if all(r.B is None for r in each):
        return _undamped(A, A)
    B = np.array([np.zeros_like(r.A) if r.B is None else r.B for r in each])
    return _damped(np.eye(A.shape[1]), B, A)


def _diagonal(M: Array) -> bool:
    diagonal = M.diagonal(axis1=1, axis2=2)
    return np.count_nonzero(M) == diagonal.size and bool(diagonal.min() > 0.0)


def _factors(M: Array) -> Array:
    """T (m, n, n) with T' M T = 1; raises LinAlgError if `reduce` might refuse one M."""
    if _diagonal(M):
        return np.asarray(np.eye(M.shape[-1]) / np.sqrt(M.diagonal(axis1=1, axis2=2))[:, None])
    # the inverse of an upper triangle is substitution alone, whatever the units
    return np.asarray(np.linalg.inv(_triangles(_symmetric(M))))


def _symmetric(M: Array) -> Array:
    """M (m, n, n) without the skew part that is rounding; raises LinAlgError if it is more."""
    mirror = M.swapaxes(1, 2)
    if (mirror == M).all():
        return M
    size = np.sqrt(np.abs(M.diagonal(axis1=1, axis2=2)))
    if np.any(np.abs(M - mirror) > SKEW * size[:, :, None] * size[:, None, :]):
        raise np.linalg.LinAlgError
    return np.asarray((M + mirror) / 2)


def _triangles(M: Array) -> Array:
    """Upper R (m, n, n) with R' R = M; raises LinAlgError if `reduce` might refuse one M."""
    n, diagonal = M.shape[-1], M.diagonal(axis1=1, axis2=2)
    R = np.linalg.cholesky(M, upper=True)
    # of M with its diagonal scaled to one the determinant is below e times the least eigenvalue
    volume = (R.diagonal(axis1=1, axis2=2) ** 2 / diagonal).prod(axis=1)
    if not volume.min() > n * np.e * ILL:
        T = np.linalg.inv(R)
        # the trace of its inverse bounds the condition more closely
        trace = np.einsum("ki,kij,kij->k", diagonal, T, T)
        if not trace.max() * n < 1.0 / ILL:
            raise np.linalg.LinAlgError
    return np.asarray(R)


def _undamped(A: Array, K: Array) -> ComplexArray:
    """Sorted eigenvalues (m, 2n) of z'' + A z = 0, where A holds the stiffness K."""
    squares = np.linalg.eigvals(A).astype(complex)
    _known(squares, A, None, K)
    np.abs(squares.imag, out=squares.imag)
    half = np.sqrt(squares)
    return _sorted(np.concatenate([half, half.conj()], axis=1))


def _damped(M: Array, C: Array, K: Array) -> ComplexArray:
    """Sorted eigenvalues (m, 2n) of M q'' + C q' + K q = 0."""
    m, n, _ = K.shape
    # LAPACK balances: neither coordinates nor time need a unit, and time may run backwards
    state = np.zeros((m, 2 * n, 2 * n))
    state.reshape(m, -1)[:, n : 2 * n * n : 2 * n + 1] = -1.0  # of q and -q'
    if M.ndim == 3 and not _diagonal(M):
        M = _symmetric(M)
        _triangles(M)
        state[:, n:] = np.linalg.solve(M, np.concatenate([K, np.broadcast_to(C, K.shape)], axis=2))
    else:
        T = factor(M.tobytes(), n)[0] if M.ndim == 2 else _factors(M)
        inverse = T @ T.swapaxes(-2, -1)
        np.matmul(inverse, K, out=state[:, n:, :n])
        np.matmul(inverse, C, out=state[:, n:, n:])
    values = np.linalg.eigvals(state)
    _known(values, state[:, n:, :n], state[:, n:, n:], K)
    keys = np.empty(values.shape, dtype=complex)
    np.abs(values.imag, out=keys.real)
    keys.imag = values.real
    return _sorted(keys)


def _sorted(keys: ComplexArray) -> ComplexArray:
    """Eigenvalues (m, 2n) from |Im| - i Re: by rising |Im|, then by falling Re.

    Conjugates are exact, so that the signs of Im alternate then.
    """
    keys.sort(axis=1)
    keys *= 1j
    second = keys[:, 1::2].imag
    np.subtract(0.0, second, out=second)
    return keys
