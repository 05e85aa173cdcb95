"""Units of equations: rows of P that are multiplied by numbers leave its roots as they are.

Equations may stand in other units than those that the unknowns ask for, such as balances of flow
beside balances of force. M is then not symmetric, or it is diagonal, and rounding of large entries
hides what small ones do. Where rows and columns are alike, coordinates that normalise M have no
units any more.
"""

import numpy as np

from squeal.linear.matrices import Array, components, reaches

LEAST = -1e6
"""A power of two for entries that do not count, below that of any double."""
MOST_PASSES = 64
CLOSE = 0.25
"""A power of two: a smaller change of units ends the passes."""
ALIKE = 10
"""A power of two: rows are left as they are where all of them differ by less from columns."""


def row_units(M: Array, C: Array, K: Array) -> Array:
    """Powers of two (n,) that, as factors of rows, make P_ij and P_ji about equally large.

    The largest entry of each row and that of the column of its index become about equal, among
    entries whose mirror image is not zero (Osborne's balancing). A symmetric M remains so: rows
    that it couples get one factor. All factors are one where rows and columns have like
    units already.

    Parameters
    ----------
    M, C, K : array (n, n)
        The sizes of entries.
    """
    n = len(M)
    mirrored = sum(np.where(X.T > 0.0, X, 0.0) for X in (M, C, K))
    is_compared = (mirrored > 0.0) & ~np.eye(n, dtype=bool)
    powers = np.log2(mirrored, out=np.full((n, n), LEAST), where=is_compared)
    exponents = np.zeros(n)  # u of the factors 2^u
    for _ in range(MOST_PASSES):
        # rows times 2^u compare P_ij with P_ji as 2^(u/2) P 2^(-u/2) does, a similarity
        balanced = powers + (exponents[:, None] - exponents) / 2
        change = (balanced.max(axis=1) - balanced.max(axis=0)) / 2
        exponents -= change
        if np.abs(change).max() < CLOSE:
            break
    if np.array_equal(M, M.T):
        for coupled in components(reaches(M > 0.0)):
            exponents[coupled] = exponents[coupled].mean()
    if np.ptp(exponents) < ALIKE:
        exponents[:] = 0.0
    return np.exp2(np.rint(exponents))
