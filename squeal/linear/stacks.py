"""Eigenvalues of many small systems at once; `benchmarks/stacks.py` holds them against NumPy's."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from squeal.errors import ComputationError, InputError
from squeal.linear.eigen import ComplexArray
from squeal.linear.matrices import (
    BEYOND,
    ILL,
    LARGEST,
    SKEW,
    Array,
    factor,
    first_order,
    normalised,
    real_array,
)
from squeal.linear.system import Batched, System


def sweep(system: System, mus: Iterable[float]) -> ComplexArray:
    """Eigenvalues over a sweep, all values of the parameter together, see `stack_eigenvalues`.

    Returns
    -------
    array (n_mu, 2n)
        In rad/s, each row ordered as in a Spectrum.

    Examples
    --------
    >>> sweep(lambda mu: ([[1.0]], None, [[1.0 + mu]]), [0.0, 3.0]).imag.tolist()
    [[1.0, -1.0], [2.0, -2.0]]
    """
    places = list(mus)
    matrices = system.many(places) if isinstance(system, Batched) else [*map(system, places)]
    if not matrices:
        raise ValueError("mus: at least one value is required")
    M, C, K = zip(*matrices, strict=True)
    mass = M[0] if all(m is M[0] for m in M) else np.array(M)
    damping = None
    if any(c is not None for c in C):
        damping = np.array(
            [np.zeros_like(k) if c is None else c for c, k in zip(C, K, strict=True)]
        )
    return stack_eigenvalues(mass, damping, np.array(K))


def stack_eigenvalues(M: ArrayLike, C: ArrayLike | None, K: ArrayLike) -> ComplexArray:
    """Eigenvalues of m systems at once.

    Parameters
    ----------
    M, C : array (n, n) or (m, n, n)
        One for all systems or one for each; C None without damping.
    K : array (m, n, n)

    Returns
    -------
    array (m, 2n)
        In rad/s, each row ordered as in a Spectrum. Real parts are exactly zero where nothing
        grows only if every C is zero; rigid-body roots are left to `complex_eigenvalues`.

    Raises
    ------
    InputError
        As `complex_eigenvalues` does.
    ComputationError
        If roots are beyond double precision.

    Examples
    --------
    >>> stack_eigenvalues([[1.0]], None, [[[4.0]], [[9.0]]]).imag.tolist()
    [[2.0, -2.0], [3.0, -3.0]]
    """
    K = _stack("K", K, ())
    M = _stack("M", M, K.shape)
    C = None if C is None else _stack("C", C, K.shape)
    T = factor(M.tobytes(), len(M))[0] if M.ndim == 2 else _factors(M)
    with np.errstate(all="ignore"):
        A = normalised(T, K)
        if not np.abs(A).max() < LARGEST:
            raise ComputationError(BEYOND)
        if C is None or not np.count_nonzero(C):
            return _undamped(A)
        B = np.broadcast_to(normalised(T, C), A.shape)
        if not np.abs(B).max() ** 2 < LARGEST:
            raise ComputationError(BEYOND)
        return _damped(first_order(A, B, 1.0)[0])  # LAPACK balances it


def _stack(name: str, value: ArrayLike, shape: tuple[int, ...]) -> Array:
    stack = real_array(name, value)
    allowed = (shape, shape[1:])
    if shape and stack.shape not in allowed:
        raise InputError(f"{name}: shape {stack.shape}; K has shape {shape}")
    if not shape and (stack.ndim != 3 or stack.shape[1] != stack.shape[2] or not stack.size):
        raise InputError(f"{name}: shape {stack.shape}; a stack (m, n, n) is required")
    if not np.isfinite(stack).all():
        raise InputError(f"{name}: all entries must be finite")
    return stack


def _factors(M: Array) -> Array:
    """T (m, n, n) with T' M T = 1. Raises InputError as `reduce` does."""
    n, diagonal = M.shape[-1], M.diagonal(axis1=1, axis2=2)
    if diagonal.min() > 0.0:
        scale = 1.0 / np.sqrt(diagonal)
        if np.count_nonzero(M) == diagonal.size:
            return np.asarray(np.eye(n) * scale[:, None])
        unit = M * scale[:, :, None] * scale[:, None, :]
        if np.abs(unit - unit.swapaxes(1, 2)).max() <= SKEW:
            masses = np.linalg.eigvalsh(unit)
            if np.all(masses[:, 0] >= ILL * masses[:, -1]):
                upper = np.linalg.cholesky((unit + unit.swapaxes(1, 2)) / 2, upper=True)
                return scale[:, :, None] * np.linalg.inv(upper)
    return np.array([factor(one.tobytes(), n)[0] for one in M])  # says which is refused, and why


def _undamped(A: Array) -> ComplexArray:
    """Sorted eigenvalues (m, 2n) of z'' + A z = 0."""
    squares = np.linalg.eigvals(A).astype(complex)
    np.abs(squares.imag, out=squares.imag)
    half = np.sqrt(squares)
    return _sorted(np.concatenate([half, half.conj()], axis=1))


def _damped(state: Array) -> ComplexArray:
    """Sorted eigenvalues (m, 2n) of first-order forms (m, 2n, 2n)."""
    if not np.isfinite(state).all():
        raise ComputationError(BEYOND)
    values = np.linalg.eigvals(state)
    keys = np.empty(values.shape, dtype=complex)
    np.abs(values.imag, out=keys.real)
    keys.imag = -values.real
    return _sorted(keys)


def _sorted(keys: ComplexArray) -> ComplexArray:
    """Eigenvalues (m, 2n) from |Im| - i Re: by rising |Im|, then by falling Re.

    Conjugates are exact, so that the signs of Im alternate then.
    """
    if not np.isfinite(keys).all():
        raise ComputationError(BEYOND)
    keys.sort(axis=1)
    keys *= 1j
    second = keys[:, 1::2].imag
    np.subtract(0.0, second, out=second)
    return keys
