"""Roots near the ends of a region: by their errors they may lie on either side of an end."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from squeal.linear.eigen import Eigenvalue
from squeal.sparse.argument_principle import Rectangle

LOOSE = 0.1
"""Errors above this share of the end of a region are no estimate of where a root may lie."""
NARROW = 1e-9
"""The share of a frequency by which a region is searched beyond its ends: copies of a multiple root
that rounding moves over an end are met on both sides."""
COPIES = 5.0
"""How many times its own rounding a copy of a multiple root may be off: one of 60 was by 3.4."""
ROUGH = 1e-3
"""The share of |lambda| by which rough values, that a search met but did not refine, may be off."""


def widened_in_frequency(region: Rectangle, share: float) -> Rectangle:
    """The region, a little higher and lower in frequency."""
    low = region.low_imag
    if low > 0.0:
        low = low * (1 - share)
    return replace(region, low_imag=low, high_imag=region.high_imag * (1 + share))


def _distances_to_ends(root: Eigenvalue, region: Rectangle) -> tuple[list[float], list[float]]:
    """How far a root is from the ends of a region.

    Returns
    -------
    of_growth : list of 2 float
        Distances of its real part from both real ends, 1/s.
    of_frequency : list of 1 or 2 float
        Distances of its imaginary part from the ends of frequency, rad/s. A lower edge at the real
        axis or below is an end for conjugates alone.
    """
    real = root.value.real
    imag = root.value.imag
    of_growth = [abs(real - region.low_real), abs(real - region.high_real)]
    of_frequency = [abs(imag - region.high_imag)]
    if region.low_imag > 0.0 or imag < 0.0:
        of_frequency.append(abs(imag - region.low_imag))
    return of_growth, of_frequency


def _lies_at_end(root: Eigenvalue, region: Rectangle) -> bool:
    """True if rounding leaves open on which side of an end of a region a root lies.

    So all copies of a multiple root are treated alike. False where rounding is infinite.
    """
    if not root.rounding < math.inf:
        return False
    reach = COPIES * root.rounding
    # an edge is an end only between its corners, not on the line beyond them
    may_be_inside = region.distance(np.array(root.value)) <= reach
    of_growth, of_frequency = _distances_to_ends(root, region)
    return bool(may_be_inside and min(of_growth + of_frequency) <= reach)


def may_lie_in(root: Eigenvalue, region: Rectangle) -> bool:
    """True if a root lies in a region, or no further from the region than its error.

    A root at an end of the region, to rounding, counts as inside. An error above a tenth of the
    region's highest frequency is ignored, and so is that of a root below the real axis where the
    region does not reach below the axis.
    """
    largest_error = LOOSE * region.high_imag
    if _lies_at_end(root, region) and root.rounding <= largest_error:
        return True
    error = root.error or 0.0
    is_conjugate = region.low_imag >= 0.0 and root.value.imag < 0.0
    if error > largest_error or is_conjugate:
        error = 0.0
    low_imag = region.low_imag
    # a region from the real axis on is not widened downwards: conjugates alone lie there
    if low_imag > 0.0:
        low_imag -= error
    wide = Rectangle(
        region.low_real - error, region.high_real + error, low_imag, region.high_imag + error
    )
    return bool(wide.contains(np.array(root.value)))


def doubts_at_ends(roots: Sequence[Eigenvalue], region: Rectangle) -> list[str]:
    """A sentence for each root whose error or rounding reaches over an end of a region."""
    doubts = []
    for root in roots:
        error = root.error or 0.0  # by the reduction, rad/s; a root of the full system has none
        of_growth, of_frequency = _distances_to_ends(root, region)
        if _lies_at_end(root, region):
            value = f"{root.frequency_hz:.6g} Hz, known to {root.rounding / math.tau:.2g} Hz"
            if min(of_growth) <= COPIES * root.rounding:
                value = f"Re = {root.growth_rate:.6g} 1/s, known to {root.rounding:.2g} 1/s"
            doubts.append(f"a root lies at an end, at {value}, and may lie within or not")
        elif may_lie_in(root, region) and min(of_growth + of_frequency) <= error:
            hertz = f"{root.frequency_hz:.6g} Hz, known to {error / math.tau:.2g} Hz"
            doubts.append(f"the root at {hertz}, may lie within or not")
    return list(dict.fromkeys(doubts))  # copies of a multiple root are alike


def growing_outside(
    rough_values: Sequence[complex], region: Rectangle
) -> tuple[complex, ...] | None:
    """The growing roots outside of a region that a search met, the largest growth rate first.

    None if there is none, which says little: the search was for roots of the region.

    rough_values: roots, rad/s, to a relative accuracy of `ROUGH`, several of which may stand for
    one root. A root that within this accuracy may decay or lie in the region is left out.
    """
    growing_roots: list[complex] = []
    for root in sorted(rough_values, key=lambda root: -root.real):
        tolerance = ROUGH * abs(root)
        grows = root.real > tolerance
        is_conjugate = root.imag < -tolerance
        may_be_inside = region.distance(np.array(root)) < tolerance
        if not grows or is_conjugate or may_be_inside:
            continue
        upper = complex(root.real, abs(root.imag))  # both roots of a pair near the axis are one
        if all(abs(upper - other) > tolerance for other in growing_roots):
            growing_roots.append(upper)
    return tuple(growing_roots) or None
