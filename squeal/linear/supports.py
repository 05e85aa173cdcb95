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
    """The indices (k,) of the rows that are supports, in order; empty if there are none.

    Supports lie above the first gap of `PENALTY` between neighbouring sizes of the diagonal of K
    that has most rows below it. Their entries must also exceed all couplings and inertias by that.

    Parameters
    ----------
    masses : array (n,)
        The diagonal of M.
    stiffness : array or sparse array (n, n)
        K at the system's own parameters.
    largest_couplings : function
        Gives the sizes (n, n) that the entries of K may have at other parameters.
    """
    from scipy.sparse import csc_array

    sizes = np.abs(masses)
    diagonal = np.abs(csc_array(stiffness).diagonal())
    by_size = np.argsort(diagonal)
    by_size = by_size[diagonal[by_size] > 0.0]
    is_gap = diagonal[by_size[1:]] >= PENALTY * diagonal[by_size[:-1]]
    first_above = 1 + np.flatnonzero(is_gap)  # for each gap, how many rows lie below it
    # at most half of the rows are supports: below another gap lie a few soft rows
    first_above = first_above[2 * first_above > by_size.size]
    if not first_above.size:
        return first_above
    rows = np.sort(by_size[first_above[0] :])
    free = np.setdiff1d(np.arange(diagonal.size), rows)
    free_with_mass = free[sizes[free] > 0.0]
    # omega^2 of the stiffest free row by itself
    fastest = np.max(diagonal[free_with_mass] / sizes[free_with_mass], initial=0.0)
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
