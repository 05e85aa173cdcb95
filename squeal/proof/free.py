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
    left, sizes, right = np.linalg.svd(block.K.mid)
    fewest = (count + 1) // 2
    most = fewest if block.is_undamped else min(count, block.n)
    for motions in range(fewest, most + 1):
        flexible = block.n - motions
        if flexible and sizes[flexible - 1] == 0.0:
            continue
        inverse = (right[:flexible].T / sizes[:flexible]) @ left[:, :flexible].T
        x = right[flexible:].T
        y = left[:, flexible:]
        x = x - inverse @ _times(block.K.mid, x).astype(float)
        y = y - inverse.T @ _times(block.K.mid.T, y).astype(float)
        stiffness = _allowed(block.K, y, x)
        if not _is_zero(block.K, y, x, stiffness):
            continue
        # the damping leaves as many of them at zero twice as are missing from the count
        twice = count - motions
        if not twice or block.is_undamped:
            return True
        turn, _, other = np.linalg.svd(y.T @ block.C.mid @ x)
        y = y @ turn[:, motions - twice :]
        x = x @ other[motions - twice :].T
        # the data of K move the free motions, too
        x_moves = np.abs(inverse) @ block.K.rad @ np.abs(x)
        y_moves = np.abs(y).T @ block.K.rad @ np.abs(inverse)
        damping = _allowed(block.C, y, x)
        damping += np.abs(y.T @ block.C.mid) @ x_moves
        damping += y_moves @ np.abs(block.C.mid @ x)
        if _is_zero(block.C, y, x, damping):
            return True
    return False


def _allowed(X: Balls, y: NDArray, x: NDArray) -> NDArray:
    """How far the data of X move each entry of y' X x."""
    return np.abs(y).T @ X.rad @ np.abs(x)


def _is_zero(X: Balls, y: NDArray, x: NDArray, allowed: NDArray) -> bool:
    """True if no entry of y' X x is larger than allowed, its rounding included."""
    found = np.abs(y.T.astype(Long).dot(_times(X.mid, x)))
    terms = np.abs(y).T @ np.abs(X.mid) @ np.abs(x)
    missed = 2 * (len(X.mid) + 4) * float(np.finfo(Long).eps) * terms
    return bool(np.all(found + missed <= allowed * (1.0 + 1e-12) + TINY * (allowed > 0.0)))


def _times(X: NDArray, x: NDArray) -> Any:
    """The product (n, k) in long double."""
    return X.astype(Long).dot(x.astype(Long))
