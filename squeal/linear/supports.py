"""Supports: rows that a penalty on the diagonal of the stiffness matrix holds."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from squeal.linear.matrices import Array

if TYPE_CHECKING:
    from scipy.sparse import csc_array

PENALTY = 1e10  # how far a support's diagonal entry stands above all others


def support_rows(
    masses: Array, stiffness: NDArray, largest_couplings: Callable[[], csc_array]
) -> NDArray[np.intp]:
    """The rows (k,) of the supports, rising; none if no such gap divides the diagonal.

    Parameters
    ----------
    masses : array (n,)
        The diagonal of M.
    stiffness : array or sparse array (n, n)
        K at the system's own parameters.
    largest_couplings : function
        The sizes (n, n) that the entries of K may have at other parameters.
    """
    from scipy.sparse import csc_array

    sizes = np.abs(masses)
    diagonal = np.abs(csc_array(stiffness).diagonal())
    rising = np.argsort(diagonal)
    rising = rising[diagonal[rising] > 0.0]
    above_gap = 1 + np.flatnonzero(diagonal[rising[1:]] >= PENALTY * diagonal[rising[:-1]])
    above_gap = above_gap[2 * above_gap > rising.size]  # soft rows may lie below a gap too
    if not above_gap.size:
        return above_gap
    rows = np.sort(rising[above_gap[0] :])
    free = np.setdiff1d(np.arange(diagonal.size), rows)
    heavy = free[sizes[free] > 0.0]
    fastest = np.max(diagonal[heavy] / sizes[heavy], initial=0.0)
    couplings = largest_couplings()
    couplings.setdiag(0.0)
    largest = max(
        couplings[rows].max(),
        couplings[:, rows].max(),
        fastest * sizes[rows].max(),
    )
    if diagonal[rows].min() < PENALTY * largest:
        return rows[:0]
    return rows
