"""A printed list of the modes of a band, held against the proved pieces of a large system."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from squeal.proof.balls import EPS
from squeal.proof.large import BandProof, prove_band
from squeal.proof.pieces import Piece
from squeal.proof.referee import Proof, growth_bound

BEYOND = 1.02  # the disc that is searched, times the upper end of the band
CORES = (60, 100, 200)
"""Rows of the core, tried one after the other: the smallest that serves gives the least discs."""


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
        `proved`: the list is complete, `errors` bounds how far each printed root lies from a root
        of the system, and each mode is known to grow or not. `refuted`: a root is missing, or there
        is one too many.

    Raises
    ------
    ValueError
        Unless the matrices are real, square, finite, of one size and of at least 3 rows, and
        0 <= low < high.

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
    for core in CORES:
        band = prove_band(M, C, K, BEYOND * high, core)
        proof = Proof("open", reason=band.reason)
        if band.is_proved:
            proof = judge_modes(band, values, low, high, rate)
        if proof.status != "open":
            break
    return proof


def judge_modes(
    band: BandProof, values: ArrayLike, low: float, high: float, rate: float = math.inf
) -> Proof:
    """Compare a printed list of modes with the proved pieces of a band.

    Each printed root counts for the piece whose disc is nearest to it. A piece that lies in the
    searched disc |lambda| < `band.radius` holds as many roots as discs. The list is refuted

    - by a piece for which more roots are printed than it holds,
    - by a piece for which fewer are, if the list has to hold all its roots (see `_overlap`).

    It is open where a piece reaches beyond the searched disc, and where it is not known whether a
    mode grows. It is also open where fewer roots are printed than a piece holds, if some of these
    need not be listed.

    Parameters
    ----------
    band : BandProof
        The pieces, with all roots of the disc |lambda| <= `band.radius`.
    values : array_like (m,)
        The printed roots, rad/s.
    low, high : float
        The range of Im lambda that the list covers, rad/s.
    rate : float
        Growth or decay (1/s) above which roots are not listed.

    Returns
    -------
    Proof
        `proved`, `open` or `refuted`; unless refuted with the pieces that overlap the range, and
        with those that match the printed roots.
    """
    roots = np.asarray(values, dtype=complex).reshape(-1)
    pieces = []
    for piece in band.pieces:
        # whether some of its roots may have to be listed; `.all` below: whether all have to be
        if _overlap(piece, low, high, rate).some:
            pieces.append(piece)
    if len(roots) and not pieces:
        where = complex(roots[0])
        return Proof("refuted", by="enclosure", reason="no root is there", where=where)
    piece_numbers = _nearest_pieces(roots, pieces)  # of the piece nearest to each root
    open_reason = ""
    open_at: complex | None = None  # the centre of a disc of the last piece that leaves it open
    for number, piece in enumerate(pieces):
        listed = int(np.count_nonzero(piece_numbers == number))
        centre = complex(piece.centres[0])
        sizes = np.abs(piece.centres) * (1.0 + 8.0 * EPS)  # upper bounds, rounding included
        # the piece lies in the searched disc, so that its count is certain
        is_counted = bool(np.all(sizes + piece.radii < band.radius))
        reason = ""
        if is_counted and listed > piece.count:
            reason = "a root is listed that is none"
        elif is_counted and listed < piece.count and _overlap(piece, low, high, rate).all:
            reason = "a root is missing"
        if reason:
            return Proof("refuted", by="enclosure", reason=reason, where=centre)
        if not is_counted or listed < piece.count:
            open_reason = "a root may lie on either side of the band's end"
            open_at = centre
        elif piece.side == "unknown":
            open_reason = "whether this mode grows is not known"
            open_at = centre
    return Proof(
        status="open" if open_reason else "proved",
        by="enclosure",
        growth_below=growth_bound(pieces),
        reason=open_reason,
        where=open_at,
        pieces=tuple(pieces),
        matches=tuple((pieces[number],) for number in piece_numbers.tolist()),
    )


class _Overlap(NamedTuple):
    """Whether some root of a piece may be one that the list has to hold, and whether all are."""

    some: bool
    all: bool


def _overlap(piece: Piece, low: float, high: float, rate: float) -> _Overlap:
    """Compare a piece with the roots to be listed.

    These have low < Im lambda < high (rad/s), and grow or decay no faster than the rate (1/s).
    """
    margins = piece.radii * (1.0 + 4.0 * EPS)
    bottoms = piece.centres.imag - margins
    tops = piece.centres.imag + margins
    some_slow = piece.low <= rate and piece.high >= -rate
    all_slow = piece.low >= -rate and piece.high <= rate
    return _Overlap(
        some=some_slow and bool(np.any((tops >= low) & (bottoms <= high))),
        all=all_slow and bool(np.all((bottoms > low) & (tops < high))),
    )


def _nearest_pieces(roots: NDArray[np.complex128], pieces: Sequence[Piece]) -> NDArray[np.intp]:
    """Index (m,) of the piece whose disc lies nearest to each root (m,)."""
    if not len(roots):
        return np.zeros(0, dtype=int)
    gaps = []  # (m,) of each piece
    for piece in pieces:
        gaps_of_discs = np.abs(roots[:, None] - piece.centres) - piece.radii
        gaps.append(np.min(gaps_of_discs, axis=1))
    return np.argmin(gaps, axis=0)
