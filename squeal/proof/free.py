"""Free motions: roots that are zero within what the data allow.

Where K x = 0 for k vectors x, and y' C x has the rank r for the left null vectors y, zero is a
root 2k - r times (a regular y' M x taken for granted). The entries of y' K x move by at most
|y|' |dK| |x| with the data, and to first order the roots at zero hang on these numbers alone: they
are zero within the data where no entry exceeds its bound. In doubles the rounding of the product
would hide this bound, so that it is taken in long double.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from squeal.proof.balls import TINY, Balls, Quadratic
from squeal.proof.pieces import Piece

Long = np.longdouble


def with_free_motions(block: Quadratic, pieces: list[Piece]) -> list[Piece]:
    """The pieces (rad/s) of a component, the one around zero marked where the data allow it."""
    marked = []
    for piece in pieces:
        around = np.any(np.abs(piece.centres) <= piece.radii)
        if piece.side == "unknown" and around and _allow_zeros(block, piece.count):
            piece = replace(piece, side="free")
        marked.append(piece)
    return marked


def _allow_zeros(block: Quadratic, count: int) -> bool:
    """True if zero is a root so many times within the data, to first order."""
    left, _, right = np.linalg.svd(block.K.mid)
    fewest = (count + 1) // 2
    most = fewest if block.is_undamped else min(count, block.n)
    for motions in range(fewest, most + 1):
        y = left[:, block.n - motions :]
        x = right[block.n - motions :].T
        if not _is_zero(block.K, y, x):
            continue
        # the damping leaves as many of them at zero twice as are missing from the count
        twice = count - motions
        turn, _, other = np.linalg.svd(y.T @ block.C.mid @ x)
        y = y @ turn[:, motions - twice :]
        x = x @ other[motions - twice :].T
        if _is_zero(block.C, y, x):
            return True
    return False


def _is_zero(X: Balls, y: NDArray, x: NDArray) -> bool:
    """True if y' X x, turned to be diagonal, is zero within the radii of X, entry by entry."""
    turn, _, other = np.linalg.svd(y.T.astype(Long).dot(_times(X.mid, x)).astype(float))
    y = y @ turn
    x = x @ other.T
    found = np.abs(y.T.astype(Long).dot(_times(X.mid, x)))
    allowed = np.abs(y).T @ X.rad @ np.abs(x)
    terms = np.abs(y).T @ np.abs(X.mid) @ np.abs(x)
    missed = 2 * (len(X.mid) + 4) * float(np.finfo(Long).eps) * terms
    return bool(np.all(found + missed <= allowed * (1.0 + 1e-12) + TINY * (allowed > 0.0)))


def _times(X: NDArray, x: NDArray) -> Any:
    """The product (n, k) in long double."""
    return X.astype(Long).dot(x.astype(Long))
