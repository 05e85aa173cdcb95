"""Derivatives of eigenvalues, and of where they cross the imaginary axis, by any change of M, C, K.

With right and left vectors, P(lambda) x = 0 and y^H P(lambda) = 0, a change dP of
P = lambda^2 M + lambda C + K moves a root by -y^H dP x / y^H P' x, P' = 2 lambda M + C. Roots that
are one to rounding move by the eigenvalues of the same quotient of matrices. At a coalescence
y^H P' x vanishes: the root moves like a square root of the change, its derivative is infinite.

Matrices are dense or sparse, real or complex; None stands for zero.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.errors import ComputationError
from squeal.linear.eigen import ComplexArray, Eigenvalue
from squeal.linear.matrices import EPS, Array, Change, applied, inertia

ONE_ROOT = math.sqrt(EPS)  # relative: roots that are closer are one to rounding


def _sizes(of: Callable[..., Array], change: Change, z: Any, x: Any, y: Any) -> Array:
    """y_j^H `of`(change, z_j, x_j) of the sizes of all entries."""
    parts = tuple(None if A is None else abs(A) for A in change)
    return np.asarray(np.sum(abs(y) * of(parts, abs(z), abs(x)), axis=0))


def _lengths(M: Any, z: Any, x: Any, y: Any) -> Array:
    """2 |z| (x^H M x y^H M y)^(1/2): y^H P' x of a real mode."""
    mass = (np.abs(np.sum(v.conj() * (M @ v), axis=0)) for v in (x, y))
    return np.asarray(2 * np.abs(z) * np.sqrt(math.prod(mass)))


def sensitivities(
    matrices: Change, changes: Mapping[str, Change], eigenvalues: Sequence[Eigenvalue]
) -> tuple[dict[str, ComplexArray], Array]:
    """Derivatives of eigenvalues (m,) by each change, and how far they can be trusted.

    Parameters
    ----------
    matrices : tuple of arrays (n, n)
        M, C and K.
    changes : mapping of str to tuple of arrays (n, n)
        Their derivatives dM, dC, dK by each parameter.
    eigenvalues : sequence of Eigenvalue
        Roots with right and left vectors.

    Returns
    -------
    slopes : dict of str to array (m,)
        rad/s per unit of each parameter; infinite where roots coalesce and the change parts them,
        0 if it does not.
    condition : array (m,)
        2 |lambda| (x^H M x y^H M y)^(1/2) / |y^H P' x|: 1 of real modes, infinite where roots
        coalesce. Derivatives hold for relative changes far below its inverse square.

    Examples
    --------
    >>> from squeal.linear import complex_eigenvalues
    >>> M, K = np.eye(1), 4 * np.eye(1)
    >>> roots = complex_eigenvalues(M, None, K).eigenvalues
    >>> slopes, condition = sensitivities((M, None, K), {"k": (None, None, M)}, roots)
    >>> slopes["k"].imag.tolist(), condition.tolist()
    ([0.25, -0.25], [1.0, 1.0])
    """
    z = np.array([e.value for e in eigenvalues], dtype=complex)
    n, sides = matrices[0].shape[0], ("right", "left")
    x, y = (np.array([getattr(e, k) for e in eigenvalues], complex).reshape(-1, n).T for k in sides)
    W = y.conj().T @ inertia(matrices, z, x)
    weight, lengths = np.abs(W.diagonal()), _lengths(matrices[0], z, x, y)
    rounding = 100 * EPS * np.maximum(lengths, _sizes(inertia, matrices, z, x, y))
    condition = np.full(len(z), np.inf)
    np.divide(np.where(z, lengths, weight), weight, out=condition, where=weight > rounding)
    groups = []
    for one in np.unique(np.abs(z[:, None] - z) <= ONE_ROOT * np.abs(z), axis=0):
        own = np.ix_(one, one)
        least = np.linalg.svd(W[own], compute_uv=False)[-1]
        groups.append((one, own, least > rounding[one].max()))
    slopes = {}
    for name, change in changes.items():
        F, each = y.conj().T @ applied(change, z, x), np.zeros_like(z)
        for one, own, regular in groups:
            if regular:
                rates = np.linalg.solve(W[own], -F[own])
                each[one] = np.linalg.eigvals(rates) if len(rates) > 1 else rates[0]
            else:
                noise = 100 * EPS * _sizes(applied, change, z[one], x[:, one], y[:, one])
                each[one] = np.inf if np.abs(F[own]).max() > noise.max() else 0.0
        slopes[name] = each
    return slopes, condition


# Where roots cross the axis


class Singular(NamedTuple):
    """P(root) = root^2 M + root C + K where it is singular: P right = 0, left^H P = 0.

    solve(b, adjoint) gives any u with P u = b, or P^H u = b, where there is one.
    """

    root: complex
    right: ComplexArray  # (n,)
    left: ComplexArray
    solve: Callable[[ComplexArray, bool], ComplexArray]

    @staticmethod
    def of(matrices: Change, root: complex) -> Singular:
        """That of dense matrices whose rows are of one size.

        Raises ComputationError where P is regular.
        """
        P = applied(matrices, root, np.eye(len(matrices[0]), dtype=complex))
        U, sizes, Vh = np.linalg.svd(P)
        if sizes[-1] > 1e-6 * sizes[0]:
            raise ComputationError("no root meets the imaginary axis there")
        inverse = (Vh[:-1].conj().T / sizes[:-1]) @ U[:, :-1].conj().T
        both = inverse, inverse.conj().T
        return Singular(root, Vh[-1].conj(), U[:, -1], lambda b, adjoint: both[adjoint] @ b)


def crossing_slopes(
    at: Singular, matrices: Change, by: Change, changes: Mapping[str, Change]
) -> dict[str, tuple[float, float]]:
    """How a crossing of the imaginary axis in a parameter p moves with others, q: dp/dq, and the
    derivative of its frequency, Hz per unit of q.

    A root passes where Re lambda(p, q) = 0, so that dp/dq = -Re lambda_q / Re lambda_p. Where two
    coalesce on the axis, or one meets its mirror image at zero, y^H P' x vanishes and
    dp/dq = -y^H P_q x / y^H P_p x keeps them together; the frequency is that of their mean.

    at: P at the crossing; matrices: M, C and K (n, n) there; by, changes: their derivatives by p
    and by each q.

    Examples
    --------
    Two modes of 2 +- (k^2 - p)^(1/2) rad^2/s^2 coalesce at p = k^2, here k = 1:

    >>> M, K = np.eye(2), np.array([[2.0, 1.0], [0.0, 2.0]])
    >>> dp, dk = np.array([[0.0, 0.0], [-1.0, 0.0]]), np.array([[0.0, 0.0], [2.0, 0.0]])
    >>> at = Singular.of((M, None, K), 1j * 2**0.5)
    >>> crossing_slopes(at, (M, None, K), (None, None, dp), {"k": (None, None, dk)})
    {'k': (2.0, 0.0)}
    """
    z, x, y = at.root, at.right, at.left
    inward = inertia(matrices, z, x)  # P' x
    weight = np.vdot(y, inward)
    sizes = _lengths(matrices[0], z, x, y), _sizes(inertia, matrices, z, x, y)
    single = abs(weight) > ONE_ROOT * max(sizes)
    if not single:  # the vectors beside those of the double root; their part along these is free
        mirrored: Any = tuple(None if A is None else A.conj().T for A in matrices)
        outward = inertia(mirrored, np.conj(z), y)
        x1, y1 = at.solve(-inward, False), at.solve(-outward, True)
        x1, y1 = (u - v * (np.vdot(v, u) / np.vdot(v, v)) for u, v in ((x1, x), (y1, y)))
        weight = 2 * np.vdot(y, matrices[0] @ x) + np.vdot(y1, inward) + np.vdot(outward, x1)

    def moved(change: Change) -> NDArray[np.complex128]:
        """What vanishes on the way of the crossing, and what the root, or the mean of two, does."""
        image = applied(change, z, x)
        form = np.vdot(y, image)
        if single:
            return np.array([(-form / weight).real, -form / weight])
        both = np.vdot(y, inertia(change, z, x) + applied(change, z, x1)) + np.vdot(y1, image)
        return np.array([form, -both / weight])

    own, slopes = moved(by), dict[str, tuple[float, float]]()
    for name, change in changes.items():
        other = moved(change)
        move = float(-(other[0] / own[0]).real) + 0.0
        slopes[name] = move, float((other[1] + move * own[1]).imag) / math.tau + 0.0
    return slopes
