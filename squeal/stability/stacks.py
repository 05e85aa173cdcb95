"""Eigenvalues of many small systems at once; `benchmarks/stacks.py` holds them against NumPy's."""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from squeal.errors import InputError
from squeal.stability.eigen import ComplexArray
from squeal.stability.matrices import (
    ILL,
    SKEW,
    Array,
    Batched,
    Matrices,
    System,
    factor,
    first_order,
    normalised,
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
        mass = M[0] if all(m is M[0] for m in M) else np.array(M, dtype=float)
        damping = None if all(c is None for c in C) else np.array(C, dtype=float)
        stiffness = np.array(K, dtype=float)
    except (TypeError, ValueError):  # no numbers, other shapes, damping at some mu only
        return _values(*_one_by_one(matrices))
    return stack_eigenvalues(mass, damping, stiffness)


def stack_eigenvalues(M: ArrayLike, C: ArrayLike | None, K: ArrayLike) -> ComplexArray:
    """Eigenvalues (m, 2n) in rad/s of m systems, each row ordered as in a Spectrum.

    K has shape (m, n, n), M and C that or (n, n) for all; C is None without damping. Undamped, with
    real parts of exactly zero where nothing grows, only if every C is zero. Vectors and zero roots
    told by rank are left to `complex_eigenvalues`. Raises InputError.
    """
    K = _numbers("K", K, ())
    shape = K.shape
    M = _numbers("M", M, shape)
    C = None if C is None else _numbers("C", C, shape)
    try:
        T = factor(M.tobytes(), len(M))[0] if M.ndim == 2 else _factors(M)
        return _values(normalised(T, K), None if C is None else normalised(T, C))
    except np.linalg.LinAlgError:  # an M that has to be looked at, entries that are not finite
        each = [np.broadcast_to(X, shape) for X in (M, np.zeros(shape) if C is None else C)]
        return _values(*_one_by_one([*zip(*each, K, strict=True)]))


def _numbers(name: str, value: ArrayLike, shape: tuple[int, ...]) -> Array:
    try:
        stack = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{name}: square matrices of real numbers are required") from None
    allowed = (shape, shape[1:])
    if shape and stack.shape not in allowed:
        raise InputError(f"{name}: shape {stack.shape}; K has shape {shape}")
    if not shape and (stack.ndim != 3 or stack.shape[1] != stack.shape[2] or not stack.size):
        raise InputError(f"{name}: shape {stack.shape}; a stack (m, n, n) is required")
    return stack


def _one_by_one(matrices: Sequence[Matrices]) -> tuple[Array, Array]:
    """A and B (m, n, n). Raises InputError as `reduce` does."""
    each = [reduce(*given) for given in matrices]
    none = np.zeros_like(each[0].A)
    return np.array([r.A for r in each]), np.array([none if r.B is None else r.B for r in each])


def _factors(M: Array) -> Array:
    """T (m, n, n) with T' M T = 1; raises LinAlgError if `reduce` might refuse one M."""
    n, mirror = M.shape[-1], M.swapaxes(1, 2)
    diagonal = np.diagonal(M, axis1=1, axis2=2)
    if np.count_nonzero(M) == diagonal.size and diagonal.min() > 0.0:
        return np.asarray(np.eye(n) / np.sqrt(diagonal)[:, None])
    if not np.array_equal(M, mirror):
        size = np.sqrt(np.abs(diagonal))
        if np.any(np.abs(M - mirror) > SKEW * size[:, :, None] * size[:, None, :]):
            raise np.linalg.LinAlgError
        M = (M + mirror) / 2
    # the inverse of an upper triangle is substitution alone, whatever the units
    T = np.linalg.inv(np.linalg.cholesky(M, upper=True))
    # the trace of the inverse of M with its diagonal scaled to one bounds its condition
    trace = np.einsum("ki,kij,kij->k", diagonal, T, T)
    if not trace.max() * n < 1.0 / ILL:
        raise np.linalg.LinAlgError
    return T


def _values(A: Array, B: Array | None) -> ComplexArray:
    """Sorted eigenvalues (m, 2n) of z'' + B z' + A z = 0."""
    if B is None or not B.any():
        s = np.linalg.eigvals(A)
        half = np.sqrt(-(s.real + 1j * np.abs(s.imag)))
        keys = np.asarray(np.concatenate([half, -half], axis=1) * -1j, dtype=complex)
    else:  # LAPACK balances: a unit of time is not needed
        keys = np.asarray(np.linalg.eigvals(first_order(A, B, 1.0)[0]) * -1j, dtype=complex)
    # |Im| - i Re sorts by |Im|, then by falling Re; conjugates are exact, so that the signs of Im
    # alternate from there on
    np.abs(keys.real, out=keys.real)
    keys.sort(axis=1)
    keys *= 1j
    second = keys[:, 1::2].imag
    np.subtract(0.0, second, out=second)
    return keys
