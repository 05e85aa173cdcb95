"""Small systems, of which all roots are computed, and these roots without their vectors."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from squeal.linear.roots import ordered
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
    """True if all roots of a system are computed."""
    return system.n <= ALL_ROWS and not system.follows


def roots_of_all(
    system: TermSystem, selection: EigenvalueSelection, changes: Changes
) -> NDArray[np.complex128]:
    """The roots of a small system in the band or region, by rising frequency, values alone."""
    roots = dense_values(*system.arrays(changes))
    if not system.real:  # rounding may put a real one below
        roots = np.where(np.abs(roots.imag) <= assumed_rounding(roots, True), roots.real, roots)
        roots = roots[roots.imag >= 0.0]
    if selection.band is not None:  # of any real part
        low, high = selection.band
        inside = (roots.imag >= math.tau * low) & (roots.imag <= math.tau * high)
        roots = roots[inside]
    elif selection.region is not None:
        roots = roots[selection.region.contains(roots)]
    return roots[ordered(roots)]
