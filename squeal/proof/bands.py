"""A printed list of the modes of a band, held against the proved pieces of a large system."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from squeal.proof.balls import AS_GIVEN, EPS
from squeal.proof.large import BandProof, prove_band
from squeal.proof.pieces import Piece
from squeal.proof.referee import Proof

BEYOND = 1.02  # the disc that is searched, times the upper end of the band
CORES = (60, 100, 200)  # rows of the core, in turn: the smallest that serves is the sharpest


def prove_modes(
    M: Any,
    C: Any | None,
    K: Any,
    values: ArrayLike,
    low: float,
    high: float,
    rate: float = math.inf,
) -> Proof:
    """Whether a list holds all roots with low < Im lambda < high and |lambda| < 1.02 high.

    Parameters
    ----------
    M, C, K : sparse or dense (n, n)
        Real matrices, exact as given; M symmetric and positive definite, C None without damping.
    values : array_like (m,)
        The printed roots, rad/s, with positive imaginary parts.
    low, high : float
        Ends of the band, rad/s, not negative.
    rate : float
        Growth or decay (1/s) above which roots are not listed.

    Returns
    -------
    Proof
        `proved`: the list is complete, each root has a distance from a root of its own, and each
        mode is known to grow or not. `refuted`: a root is missing, or there is one too many.

    Raises
    ------
    ValueError
        Unless the matrices are real, square, finite and of one size, and 0 <= low < high.

    Examples
    --------
    Springs of 1 and 4 N/m on 1 kg, and 60 stiff ones:

    >>> import numpy as np
    >>> K = np.diag([1.0, 4.0, *np.linspace(1e3, 1e4, 60)])
    >>> prove_modes(np.eye(62), None, K, [1j, 2j], 0.5, 3.0).status
    'proved'
    >>> prove_modes(np.eye(62), None, K, [1j], 0.5, 3.0).reason
    'a root is missing'
    """
    if not 0.0 <= low < high:
        raise ValueError(f"band: {low} to {high}; 0 <= low < high is required")
    proof = Proof("open", data=AS_GIVEN)
    for core in CORES:
        found = prove_band(M, C, K, BEYOND * high, core)
        if found.is_proved:
            proof = judge_modes(found, values, low, high, rate)
        else:
            proof = Proof("open", data=AS_GIVEN, reason=found.reason)
        if proof.status != "open":
            break
    return proof


def judge_modes(
    found: BandProof, values: ArrayLike, low: float, high: float, rate: float = math.inf
) -> Proof:
    """A printed list of the band between `low` and `high` (rad/s), without what grows or decays
    faster than a rate (1/s), held against proved pieces."""
    roots = np.asarray(values, dtype=complex).reshape(-1)
    pieces = [piece for piece in found.pieces if _reaches(piece, low, high, rate)]
    if len(roots) and not pieces:
        return Proof("refuted", "enclosure", reason="no root is there", where=complex(roots[0]))
    owners = _nearest(roots, pieces)
    errors = np.array(
        [_distance(root, pieces[owner]) for root, owner in zip(roots, owners, strict=True)]
    )
    growth_below = 0.0
    doubt: tuple[str, complex] | None = None
    for number, piece in enumerate(pieces):
        listed = int(np.count_nonzero(owners == number))
        centre = complex(piece.centres[0])
        sizes = np.abs(piece.centres) * (1.0 + 8.0 * EPS)
        is_counted = bool(np.all(sizes + piece.radii < found.radius))
        if is_counted and listed > piece.count:
            reason = "a root is listed that is none"
            return Proof("refuted", "enclosure", reason=reason, where=centre, errors=errors)
        if is_counted and listed < piece.count and _lies_within(piece, low, high, rate):
            reason = "a root is missing"
            return Proof("refuted", "enclosure", reason=reason, where=centre, errors=errors)
        if not is_counted or listed < piece.count:
            doubt = "a root may lie on either side of the band's end", centre
        elif piece.side == "unknown":
            doubt = "whether this mode grows is not known", centre
        if piece.side not in ("grows", "axis"):
            growth_below = max(growth_below, piece.high)
    if doubt is not None:
        reason, where = doubt
        return Proof("open", "enclosure", growth_below, AS_GIVEN, reason, where, errors)
    return Proof("proved", "enclosure", growth_below, errors=errors, pieces=tuple(pieces))


def _reaches(piece: Piece, low: float, high: float, rate: float) -> bool:
    """True if a root of the piece may lie in the band."""
    heights = piece.centres.imag
    margins = piece.radii * (1.0 + 4.0 * EPS)
    if piece.low > rate or piece.high < -rate:
        return False
    return bool(np.any((heights + margins >= low) & (heights - margins <= high)))


def _lies_within(piece: Piece, low: float, high: float, rate: float) -> bool:
    """True if all roots of the piece lie in the band."""
    heights = piece.centres.imag
    margins = piece.radii * (1.0 + 4.0 * EPS)
    if piece.low < -rate or piece.high > rate:
        return False
    return bool(np.all((heights - margins > low) & (heights + margins < high)))


def _nearest(roots: NDArray[np.complex128], pieces: Sequence[Piece]) -> NDArray[np.intp]:
    """Index of the piece whose disc lies nearest to each root (m,)."""
    if not len(roots):
        return np.zeros(0, dtype=int)
    gaps = [
        np.min(np.abs(roots[:, None] - piece.centres) - piece.radii, axis=1) for piece in pieces
    ]
    return np.argmin(gaps, axis=0)


def _distance(root: complex, piece: Piece) -> float:
    """A bound of the distance of a printed root from each root of a piece, rad/s."""
    farthest = np.max(np.abs(root - piece.centres) + piece.radii)
    return float(np.nextafter(farthest * (1.0 + 8.0 * EPS), math.inf))
