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
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.errors import ComputationError
from squeal.linear.eigen import Eigenvalue, arrays_of
from squeal.linear.matrices import EPS, MCK, Array, Matrix, Values, applied, inertia
from squeal.linear.roots import ComplexArray

ONE_ROOT = math.sqrt(EPS)
"""Roots that lie closer than this share of their size are one to rounding."""
SINGULAR = 1e-6
"""P is singular if its smallest singular value is at most this share of the largest."""


def _term_sizes(
    product: Callable[[MCK, Values, NDArray], NDArray],
    change: MCK,
    z: Values,
    x: NDArray,
    y: NDArray,
) -> Array:
    """The sum of the sizes of all terms of y_j^H product(change, z_j, x_j), one for each j.

    product: `applied` or `inertia`; z (m,): roots; x, y (n, m): vectors as columns.
    """
    M, C, K = (None if matrix is None else abs(matrix) for matrix in change)
    return np.sum(abs(y) * product((M, C, K), abs(z), abs(x)), axis=0)


def _real_mode_products(M: Matrix, z: Values, x: NDArray, y: NDArray) -> Array:
    """2 |z| (x^H M x y^H M y)^(1/2) of roots z (m,) with vectors x, y (n, m) as columns.

    Of an undamped mode with real vectors it is |y^H P' x|.
    """
    mass_x = np.abs(np.sum(x.conj() * (M @ x), axis=0))
    mass_y = np.abs(np.sum(y.conj() * (M @ y), axis=0))
    return 2 * np.abs(z) * np.sqrt(mass_x * mass_y)


class _Cluster(NamedTuple):
    """k roots that are one to rounding.

    roots: which of all, a mask (m,); block (k, k): y_i^H P' x_j of the k roots; regular: whether
    it is regular, so that the roots have finite derivatives.
    """

    roots: NDArray[np.bool_]
    block: NDArray
    regular: bool


def sensitivities(
    matrices: MCK, changes: Mapping[str, MCK], eigenvalues: Sequence[Eigenvalue]
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
        rad/s per unit of each parameter; where roots coalesce infinite if the change separates
        them, 0 if it does not.
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
    z, x, y = arrays_of(eigenvalues, matrices[0].shape[0])
    W = y.conj().T @ inertia(matrices, z, x)  # y_i^H P'(z_j) x_j
    weight = np.abs(W.diagonal())
    real_modes = _real_mode_products(matrices[0], z, x, y)
    # a weight up to this is zero to rounding, as at a coalescence
    rounding = 100 * EPS * np.maximum(real_modes, _term_sizes(inertia, matrices, z, x, y))
    # a root of zero, where a real mode has no weight either, has the condition 1
    numerator = np.where(z != 0.0, real_modes, weight)
    condition = np.full(len(z), np.inf)
    np.divide(numerator, weight, out=condition, where=weight > rounding)
    clusters = []
    is_one_root = np.abs(z[:, None] - z) <= ONE_ROOT * np.abs(z)
    for roots in np.unique(is_one_root, axis=0):  # rows of equal roots are equal: one mask (m,)
        block = W[np.ix_(roots, roots)]
        smallest = np.linalg.svd(block, compute_uv=False)[-1]
        is_regular = bool(smallest > rounding[roots].max())  # else these roots coalesce
        clusters.append(_Cluster(roots, block, is_regular))
    slopes = {}
    for name, change in changes.items():
        F = y.conj().T @ applied(change, z, x)  # y_i^H dP(z_j) x_j
        slopes_of_roots = np.zeros_like(z)
        for roots, block, is_regular in clusters:
            change_block = F[np.ix_(roots, roots)]
            if not is_regular:
                sizes = _term_sizes(applied, change, z[roots], x[:, roots], y[:, roots])
                separates = np.abs(change_block).max() > 100 * EPS * sizes.max()
                slopes_of_roots[roots] = np.inf if separates else 0.0
                continue
            quotient = np.linalg.solve(block, -change_block)
            if len(quotient) == 1:
                slopes_of_roots[roots] = quotient[0]
            else:
                slopes_of_roots[roots] = np.linalg.eigvals(quotient)
        slopes[name] = slopes_of_roots
    return slopes, condition


# Where roots cross the axis


class Singular(NamedTuple):
    """P(root) = root^2 M + root C + K at a root, with its null vectors (n,) and a solver.

    P right = 0 and left^H P = 0. solve(b, adjoint) gives any u with P u = b, or if `adjoint`
    P^H u = b, for b (n,) for which there is one.
    """

    root: complex
    right: ComplexArray
    left: ComplexArray
    solve: Callable[[ComplexArray, bool], ComplexArray]

    @staticmethod
    def of(matrices: MCK, root: complex) -> Singular:
        """P of dense matrices of at least two rows at a root, from its singular values.

        Its rows must be scaled to one magnitude, as the smallest singular value is compared with
        the largest. Raises ComputationError where P is regular: there is no root.
        """
        P = applied(matrices, root, np.eye(len(matrices[0]), dtype=complex))
        U, sizes, Vh = np.linalg.svd(P)  # P = U @ diag(sizes) @ Vh
        if sizes[-1] > SINGULAR * sizes[0]:
            raise ComputationError(f"no root lies at {root:.6g} rad/s")
        # V S^-1 U^H without the last singular value, which is zero to rounding. The last columns of
        # V and U are the null vectors: P x = 0 and y^H P = 0
        pseudo_inverse = (Vh[:-1].conj().T / sizes[:-1]) @ U[:, :-1].conj().T

        def solve(b: ComplexArray, adjoint: bool) -> ComplexArray:
            if adjoint:
                return pseudo_inverse.conj().T @ b
            return pseudo_inverse @ b

        return Singular(root, right=Vh[-1].conj(), left=U[:, -1], solve=solve)


def crossing_slopes(
    singular: Singular, matrices: MCK, by_p: MCK, changes: Mapping[str, MCK]
) -> dict[str, tuple[float, float]]:
    """How a crossing of the imaginary axis in a parameter p moves with other parameters q.

    A root passes where Re lambda(p, q) = 0, so that dp/dq = -Re lambda_q / Re lambda_p. Where two
    coalesce on the axis, or one meets its mirror image at zero, y^H P' x vanishes and
    dp/dq = -y^H P_q x / y^H P_p x keeps them together; the frequency is that of their mean.

    Parameters
    ----------
    singular : Singular
        P at the crossing.
    matrices : tuple of arrays (n, n)
        M, C and K there.
    by_p : tuple of arrays (n, n)
        Their derivatives by p.
    changes : mapping of str to tuple of arrays (n, n)
        Their derivatives by each q.

    Returns
    -------
    dict of str to (float, float)
        dp/dq, infinite where p does not move the root, and the derivative of the frequency of the
        crossing, Hz per unit of q.

    Examples
    --------
    Two modes of 2 +- (k^2 - p)^(1/2) rad^2/s^2 coalesce at p = k^2, here k = 1:

    >>> M, K = np.eye(2), np.array([[2.0, 1.0], [0.0, 2.0]])
    >>> dp, dk = np.array([[0.0, 0.0], [-1.0, 0.0]]), np.array([[0.0, 0.0], [2.0, 0.0]])
    >>> singular = Singular.of((M, None, K), 1j * 2**0.5)
    >>> crossing_slopes(singular, (M, None, K), (None, None, dp), {"k": (None, None, dk)})
    {'k': (2.0, 0.0)}
    """
    quotient = _quotient_at(singular, matrices)
    # of what vanishes at the crossing, and of the root, see `_Rates`: by p, and below by each q
    rates_p = quotient.rates(by_p)
    slopes = {}
    for name, change in changes.items():
        rates_q = quotient.rates(change)
        with np.errstate(divide="ignore", invalid="ignore"):
            # + 0.0: no negative zeros
            dp_dq = float(-(rates_q.vanishing_slope / rates_p.vanishing_slope).real) + 0.0
            omega_slope = float((rates_q.root_slope + dp_dq * rates_p.root_slope).imag)
        frequency_slope = omega_slope / math.tau + 0.0
        slopes[name] = dp_dq, frequency_slope
    return slopes


class _Rates(NamedTuple):
    """Derivatives by a parameter at a crossing.

    Attributes
    ----------
    vanishing_slope : complex
        Of the quantity that vanishes at the crossing: Re lambda of one root, y^H P x where two
        coalesce.
    root_slope : complex
        Of the root lambda, or of the mean of two, rad/s per unit of the parameter.
    """

    vanishing_slope: complex
    root_slope: complex


class _Quotient(NamedTuple):
    """How a root moves with changes of M, C and K: by -y^H dP x / weight.

    singular: P at the root, with its vectors x and y; x1, y1 (n,): where two roots coalesce, the
    generalised vectors that follow x and y in the chain of the double root, else None.
    """

    singular: Singular
    weight: complex
    x1: ComplexArray | None = None
    y1: ComplexArray | None = None

    def rates(self, change: MCK) -> _Rates:
        """The derivatives by the parameter of a change dM, dC, dK."""
        z = self.singular.root
        x = self.singular.right
        y = self.singular.left
        dP_x = applied(change, z, x)
        y_dP_x = np.vdot(y, dP_x)
        if self.x1 is None or self.y1 is None:  # a single root
            root = -y_dP_x / self.weight
            return _Rates(root.real + 0j, root)
        mean = np.vdot(y, inertia(change, z, x) + applied(change, z, self.x1))
        mean += np.vdot(self.y1, dP_x)
        return _Rates(y_dP_x, -mean / self.weight)


def _quotient_at(singular: Singular, matrices: MCK) -> _Quotient:
    """How a single root, or two that coalesce, move with changes of the matrices M, C and K.

    Of a double root with one vector x the chain is P x1 = -P' x, y1^H P = -y^H P'. The weight of
    the mean is then y^H P'' x + y1^H P' x + y^H P' x1, P'' = 2 M, in place of y^H P' x.
    """
    z = singular.root
    x = singular.right  # P x = 0
    y = singular.left  # y^H P = 0
    Pprime_x = inertia(matrices, z, x)
    weight = np.vdot(y, Pprime_x)
    real_mode = _real_mode_products(matrices[0], z, x, y)
    # is the weight more than rounding? The sizes of its terms alone may vanish with it, as for unit
    # vectors x = e1, y = e2 and M = 1; the product of a real mode does not
    if abs(weight) > ONE_ROOT * max(real_mode, _term_sizes(inertia, matrices, z, x, y)):
        return _Quotient(singular, weight)
    M, C, K = (None if matrix is None else matrix.conj().T for matrix in matrices)
    Pprime_y = inertia((M, C, K), np.conj(z), y)  # P'^H y
    # multiples of x in x1, and of y in y1, are free
    x1 = _without_direction(x, singular.solve(-Pprime_x, False))  # P x1 = -P' x
    y1 = _without_direction(y, singular.solve(-Pprime_y, True))  # P^H y1 = -P'^H y
    weight_of_mean = 2 * np.vdot(y, matrices[0] @ x)
    weight_of_mean += np.vdot(y1, Pprime_x) + np.vdot(Pprime_y, x1)
    return _Quotient(singular, weight_of_mean, x1, y1)


def _without_direction(direction: ComplexArray, vector: ComplexArray) -> ComplexArray:
    """The part of a vector (n,) that is orthogonal to a direction (n,)."""
    share = np.vdot(direction, vector) / np.vdot(direction, direction)
    return vector - direction * share
