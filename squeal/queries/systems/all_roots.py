"""Small systems, of which all eigenvalues are computed: which they are, and the values alone."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from squeal.linear.roots import ComplexArray, ordered
from squeal.linear.system import TermSystem
from squeal.linear.verdicts import assumed_rounding
from squeal.queries.systems.matrices import ALL_ROWS
from squeal.results.sources import EigenvalueSelection
from squeal.sparse.dense import dense_values

Changes = Mapping[str, float]
NO_BAND = (
    "band: is missing, such as --band 500:5000 (Hz); systems of more than 400 rows, complex "
    "matrices, matrices that follow the frequency, and the methods reduced and modal need one"
)


def is_small(system: TermSystem) -> bool:
    """True if all roots of a system are computed: few rows, and no matrix follows the frequency."""
    return system.n <= ALL_ROWS and not system.follows


def roots_of_all(
    system: TermSystem, selection: EigenvalueSelection, changes: Changes
) -> ComplexArray:
    """Compute all roots of a small system and select those of a band or region, without vectors.

    Parameters
    ----------
    system : TermSystem
        A small system (see `is_small`).
    selection : EigenvalueSelection
        The band or region; its number of modes is left to the caller.
    changes : mapping
        Parameters that do not have the system's own values.

    Returns
    -------
    array (m,)
        Roots in rad/s by rising frequency. Of complex matrices only those with Im >= 0 describe a
        motion.
    """
    roots = dense_values(*system.arrays(changes))
    if not system.real:
        # a real root that rounding puts below the real axis would be lost
        is_real = np.abs(roots.imag) <= assumed_rounding(roots, True)
        roots = np.where(is_real, roots.real, roots)
        roots = roots[roots.imag >= 0.0]
    if selection.band is not None:  # a band bounds the frequency, not the growth rate
        low, high = selection.band
        inside = (roots.imag >= math.tau * low) & (roots.imag <= math.tau * high)
        roots = roots[inside]
    elif selection.region is not None:
        roots = roots[selection.region.contains(roots)]
    return roots[ordered(roots)]
