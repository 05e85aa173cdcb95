"""Supports: rows that a penalty on the diagonal of the stiffness matrix holds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from squeal.linear.labels import Label, row_name, rows_in_words
from squeal.linear.matrices import Array

if TYPE_CHECKING:
    from scipy.sparse import csc_array

PENALTY = 1e10  # how far a support's diagonal entry stands above all others


def support_rows(masses: Array, diagonal: Array, couplings: csc_array) -> NDArray[np.intp]:
    """The indices (k,) of the rows that are supports, in order; empty if there are none.

    Sorted by stiffness, supports are the rows above a gap of `PENALTY` between neighbours: the
    first such gap that has most rows below it. Their stiffnesses must also be `PENALTY` times the
    couplings to them and their inertias at the fastest frequency of a free row. A row of negative
    stiffness is none, since nothing holds it.

    Parameters
    ----------
    masses, diagonal : array (n,)
        Sizes of the diagonal entries of M, and real parts of those of K, at the system's own
        parameters.
    couplings : csc_array (n, n)
        The sizes that entries of K off the diagonal may have, at any parameters.
    """
    stiffness = np.abs(diagonal)
    by_size = np.argsort(stiffness)
    by_size = by_size[stiffness[by_size] > 0.0]
    is_gap = stiffness[by_size[1:]] >= PENALTY * stiffness[by_size[:-1]]
    first_above = 1 + np.flatnonzero(is_gap)  # for each gap, how many rows lie below it
    # supports are a minority: a gap with fewer rows below it than above divides soft rows from the
    # others
    first_above = first_above[2 * first_above > by_size.size]
    if not first_above.size:
        return by_size[:0]
    rows = np.sort(by_size[first_above[0] :])
    rows = rows[diagonal[rows] > 0.0]
    if not rows.size:
        return rows
    free = np.setdiff1d(np.arange(stiffness.size), rows)
    free_with_mass = free[masses[free] > 0.0]
    # omega^2 of the stiffest free row by itself
    fastest = np.max(stiffness[free_with_mass] / masses[free_with_mass], initial=0.0)
    largest = max(
        couplings[rows].max(),
        couplings[:, rows].max(),
        fastest * masses[rows].max(),
    )
    if stiffness[rows].min() < PENALTY * largest:
        return rows[:0]
    return rows


def supports_warning(rows: NDArray[np.intp], labels: Sequence[Label]) -> str:
    """The warning that `without_supports` left out rows (k,) of a system with these labels."""
    return (
        "supports, whose diagonal stands decades above all others, are left out: "
        f"{rows_in_words(rows.size)}, the first is {_first_row(rows, labels)}"
    )


def empty_rows_warning(rows: NDArray[np.intp], labels: Sequence[Label]) -> str:
    """The warning that `without_empty_rows` left out rows (k,) of a system with these labels."""
    return (
        f"what is empty in M, C and K is left out: {rows_in_words(rows.size)}, the first is "
        f"{_first_row(rows, labels)}"
    )


def _first_row(rows: NDArray[np.intp], labels: Sequence[Label]) -> str:
    """The first of some rows (k,): its number, and its label if it has one."""
    first = f"row {rows[0] + 1}"
    if rows[0] < len(labels):
        first += f", {row_name(labels[rows[0]])}"
    return first
