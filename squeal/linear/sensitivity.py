"""How each eigenvalue moves with a parameter."""

import numpy as np
from numpy.typing import ArrayLike

from squeal.linear.eigen import ComplexArray, Spectrum, complex_eigenvalues
from squeal.linear.matrices import EPS, checked


def sensitivities(
    M: ArrayLike,
    C: ArrayLike | None,
    K: ArrayLike,
    *,
    dM: ArrayLike | None = None,
    dC: ArrayLike | None = None,
    dK: ArrayLike | None = None,
    spectrum: Spectrum | None = None,
) -> ComplexArray:
    """Derivatives (2n,) of the eigenvalues by a parameter p, in the order of the spectrum.

    d lambda/dp = -y^H (lambda^2 dM + lambda dC + dK) x / y^H (2 lambda M + C) x with the right and
    left vectors x, y and the derivatives dM, dC, dK of the matrices (None: zero); rad/s per unit
    of p. Where the denominator vanishes (a coalescence, or an undamped zero root) the eigenvalue
    moves like a square root of p: the derivative is inf, or 0 if the numerator vanishes too.
    `spectrum` saves the eigenvalues if they are known. Raises InputError.
    """
    mass, damping, _ = checked(M, C, K)
    changes = [
        np.zeros_like(mass) if d is None else np.asarray(d, dtype=float) for d in (dM, dC, dK)
    ]
    known = spectrum or complex_eigenvalues(M, C, K)
    C_matrix = np.zeros_like(mass) if damping is None else damping
    result = np.empty(len(known), dtype=complex)
    for k, e in enumerate(known.eigenvalues):
        powers = (e.value**2, e.value, 1.0)
        terms = [p * (e.left.conj() @ d @ e.right) for p, d in zip(powers, changes, strict=True)]
        weight, size = 2 * e.value * mass + C_matrix, np.abs(2 * e.value * mass) + np.abs(C_matrix)
        below = e.left.conj() @ weight @ e.right
        floor = 100 * EPS * (np.abs(e.left) @ size @ np.abs(e.right))
        if abs(below) > floor:
            result[k] = -sum(terms) / below
        else:
            sizes = [
                abs(p) * float(np.abs(e.left) @ np.abs(d) @ np.abs(e.right))
                for p, d in zip(powers, changes, strict=True)
            ]
            result[k] = 0.0 if abs(np.sum(terms)) <= 100 * EPS * float(sum(sizes)) else np.inf
    return result
