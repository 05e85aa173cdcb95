"""How a parameter moves the roots at one of its values: first-order perturbation theory.

For a root z with right and left vectors x, y of P(z, p) = z^2 M + z C + K, the derivative of
P(z, p) x = 0 times y^H gives dz/dp = -y^H dP/dp x / y^H P' x, with P' = dP/dz = 2 z M + C. The same
quotient with the vectors of two roots says how p mixes them. Roots that coincide have no vectors of
their own: p itself separates them, which chooses the vectors (Kato, Perturbation Theory for Linear
Operators, 1976). Where y^H P' x vanishes the root is defective, and dz/dp is infinite.
"""

import numpy as np

from squeal.linear.continuation import SpectrumAtParameter
from squeal.linear.matrices import MCK, applied, components, inertia, norm_of, reaches
from squeal.linear.system import System
from squeal.linear.verdicts import assumed_rounding
from squeal.sparse.quadratic import Roots

WELL_CONDITIONED = 1e6  # up to here the roots that coincide have as many vectors


def spectrum_with_slopes(
    system: System, name: str, value: float, roots: Roots, lifted: bool = False
) -> SpectrumAtParameter:
    """The spectrum at a value of the parameter p (its `name`): the given roots z (m,), and how p
    moves them.

    With P = z^2 M + z C + K and P' = dP/dz = 2 z M + C, first-order perturbation theory gives the
    couplings (m, m) -y_i^H dP/dp(z_j) x_j / y_i^H P'(z_i) x_i: on the diagonal the slope dz/dp of
    each root, off the diagonal how p mixes the modes i and j. The spectrum has the vectors x, y
    (n, m) of the roots. If `lifted` it has those (2n, m) of the first-order form, [x, z x] and
    [(z M + C)^H y, M^H y], for which left^H right of two different roots vanishes.
    """
    changes = {name: value}
    matrices = system.at(changes)
    slopes = system.derivative(name, changes)
    roots = _with_vectors_by_slopes(roots, matrices, slopes)
    z = roots.values
    right = roots.right
    left = roots.left
    M, C, _ = matrices
    derivative = left.conj().T @ applied(slopes, z, right)
    weight = np.sum(left.conj() * inertia(matrices, z, right), axis=0)
    # a free motion without damping has the double root z = 0, where P' = C and y^H C x is zero but
    # for rounding of |C|: such a root has no slope, and gets zeros
    damping = 0.0 if C is None else norm_of(C)
    is_single = (z != 0) | (np.abs(weight) > assumed_rounding(damping))
    coupling = -derivative / np.where(is_single, weight, np.inf)[:, None]
    if lifted:
        of_velocities = M.conj().T @ left
        of_displacements = z.conj() * of_velocities
        if C is not None:
            of_displacements = of_displacements + C.conj().T @ left
        right = np.vstack([right, z * right])
        left = np.vstack([of_displacements, of_velocities])
    return SpectrumAtParameter(value, z, right, left, coupling, assumed_rounding(z))


def _with_vectors_by_slopes(roots: Roots, matrices: MCK, slopes: MCK) -> Roots:
    """The roots with vectors, unit ones, that go on with the parameter where several coincide.

    Of roots that coincide to rounding any mixture of their vectors is computed, and no slope in a
    mixture is that of a root. The parameter separates them: their slopes and mixtures are the
    eigenvalues and vectors of -(Y^H P' X)^-1 Y^H dP/dp X (degenerate perturbation theory). Vectors
    stay where roots are defective, where P' vanishes and where no slope separates them.

    Parameters
    ----------
    roots : Roots
        Values (m,) with vectors (n, m).
    matrices, slopes : tuple
        M, C and K, and their derivatives by the parameter.
    """
    z = roots.values
    is_close = np.abs(z[:, None] - z) <= 2 * assumed_rounding(z)
    if np.count_nonzero(is_close) == len(z):  # each root is close to itself alone
        return roots
    right = roots.right.astype(complex)
    left = roots.left.astype(complex)
    for group in components(reaches(is_close)):
        X = right[:, group]
        Y = left[:, group]
        weight = Y.conj().T @ inertia(matrices, z[group], X)  # Y^H P' X
        if not np.linalg.cond(weight) < WELL_CONDITIONED:
            continue
        change = Y.conj().T @ applied(slopes, z[group], X)  # Y^H dP/dp X
        _, mixtures = np.linalg.eig(np.linalg.solve(weight, change))
        if not np.linalg.cond(mixtures) < WELL_CONDITIONED:
            continue
        X = X @ mixtures
        # the left mixtures for which Y^H P' X is the identity
        Y = Y @ np.linalg.inv(weight @ mixtures).conj().T
        right[:, group] = X / np.linalg.norm(X, axis=0)
        left[:, group] = Y / np.linalg.norm(Y, axis=0)
    return Roots(z, right, left)
