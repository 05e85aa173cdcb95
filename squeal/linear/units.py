"""Units of rows and columns: P and D1 P D2 have the same roots, D1 and D2 diagonal.

Equations may stand in other units than those that the unknowns ask for, such as balances of flow
beside balances of force. Coordinates that normalise a symmetric M have no units. Where rows and
columns differ by decades M is not symmetric, or diagonal, and rounding of large entries would hide
what small ones do.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from squeal.linear.matrices import Array, components, reaches

MOST_PASSES = 64
CLOSE = 0.5
"""A power of two: by how much the last pass changes units."""
ALIKE = 10
"""A power of two: units of rows and columns that differ by less are left as they are."""


def units_of(masses: Sequence[Array], others: Sequence[Array]) -> NDArray[np.intp]:
    """Powers of two (2, n) for rows and columns that make their largest entries about as large.

    Zeros where rows and columns have the same units already. Where M is symmetric it remains so:
    rows that it couples have the same factor between row and column.

    Parameters
    ----------
    masses : sequence of array (n, n)
        The terms of M.
    others : sequence of array (n, n)
        Those of C and K.
    """
    alike = np.zeros((2, len(masses[0])), dtype=int)
    sizes = np.array([np.abs(X) for X in (*masses, *others) if X.any()])
    is_entry = sizes > 0.0
    in_any_term = np.any(is_entry, axis=0)
    is_complete = np.all(in_any_term.any(axis=0) & in_any_term.any(axis=1))
    if not is_complete or _are_symmetric(sizes):
        return alike
    with np.errstate(divide="ignore"):
        logarithms = np.log2(sizes)
    # terms are compared by their means: the largest entry may stand out by its units alone
    counts = is_entry.sum(axis=(1, 2), keepdims=True)
    rows, columns = 0.0 * alike
    for _ in range(MOST_PASSES):
        scaled = logarithms + rows[:, None] + columns
        means = scaled.sum(axis=(1, 2), where=is_entry, keepdims=True) / counts
        entries = (scaled - means).max(axis=0)
        excess = entries - entries.max(axis=1).mean()
        row_change = excess.max(axis=1) / 2
        column_change = excess.max(axis=0) / 2
        rows -= row_change
        columns -= column_change
        if max(np.ptp(row_change), np.ptp(column_change)) < CLOSE:
            break
    ratios = np.rint(rows - columns)
    if _are_symmetric(masses):
        for coupled in components(reaches(np.any(masses, axis=0))):
            ratios[coupled] = np.rint(ratios[coupled].mean())
    if np.ptp(ratios) < ALIKE:
        return alike
    whole = np.rint(columns)
    return np.array([whole + ratios, whole], dtype=int)


def _are_symmetric(matrices: Iterable[Array]) -> bool:
    """True if all matrices (n, n) are symmetric."""
    return all(np.array_equal(X, X.T) for X in matrices)
