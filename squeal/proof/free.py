"""Free motions, those of rigid bodies and mechanisms: roots that are zero within the data.

Where K x = 0 for k vectors x, and y' C x has the rank r for the left null vectors y, zero is a
root 2k - r times (a regular y' M x taken for granted). The entries of y' K x move by at most
|y|' |dK| |x| with the data, and to first order the roots at zero depend on these entries alone:
they are zero within the data where no entry exceeds its bound. In doubles the rounding of the
product would hide this bound, so that it is taken in long double.
"""

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
        is_around_zero = np.any(np.abs(piece.centres) <= piece.radii)
        if piece.side == "unknown" and is_around_zero and _allow_zeros(block, piece.count):
            piece = replace(piece, side="free")
        marked.append(piece)
    return marked


def _allow_zeros(block: Quadratic, count: int) -> bool:
    """True if some matrices within the data have `count` roots at zero, to first order.

    Damping of rank r on k free motions leaves 2k - r roots at zero, 0 <= r <= k; without damping
    r = 0. Each k, `motions`, is tried for which an r with 2k - r = count exists. Two conditions
    have to hold: y' K x is zero within the data, and so is y' C x on the k - r undamped motions, of
    which both roots are zero. The null vectors x and y (n, k) of K are its last right and left
    singular vectors, refined in long double.
    """
    U, singular_values, Vt = np.linalg.svd(block.K.mid)
    fewest = (count + 1) // 2
    most = fewest if block.is_undamped else min(count, block.n)
    for motions in range(fewest, most + 1):
        flexible = block.n - motions
        if flexible and singular_values[flexible - 1] == 0.0:
            continue  # more than `motions` singular values are zero: a larger k is right
        # of K on the motions that are not free: x - inverse K x is a step of refinement, which
        # removes what rounding leaves of K x
        inverse = (Vt[:flexible].T / singular_values[:flexible]) @ U[:, :flexible].T
        x = Vt[flexible:].T
        y = U[:, flexible:]
        x = x - inverse @ _long_product(block.K.mid, x).astype(float)
        y = y - inverse.T @ _long_product(block.K.mid.T, y).astype(float)
        if not _is_zero(block.K, y, x, _moved_by_data(block.K, y, x)):
            continue
        undamped_motions = count - motions  # k - r
        if not undamped_motions or block.is_undamped:
            return True
        # the k - r smallest singular values of y' C x have to be zero: turn x and y to these
        left, _, right = np.linalg.svd(y.T @ block.C.mid @ x)
        y = y @ left[:, motions - undamped_motions :]
        x = x @ right[motions - undamped_motions :].T
        # the data of K move the free motions x and y, hence y' C x
        x_moves = np.abs(inverse) @ block.K.rad @ np.abs(x)
        y_moves = np.abs(y).T @ block.K.rad @ np.abs(inverse)
        allowed = _moved_by_data(block.C, y, x)
        allowed += np.abs(y.T @ block.C.mid) @ x_moves
        allowed += y_moves @ np.abs(block.C.mid @ x)
        if _is_zero(block.C, y, x, allowed):
            return True
    return False


def _moved_by_data(X: Balls, y: NDArray, x: NDArray) -> NDArray:
    """How far the data of X move each entry (k, k) of y' X x, of vectors y and x (n, k)."""
    return np.abs(y).T @ X.rad @ np.abs(x)


def _is_zero(X: Balls, y: NDArray, x: NDArray, allowed: NDArray) -> bool:
    """True if no entry of y' X x is larger than `allowed` (k, k), its rounding included.

    Where nothing is allowed, as of exact data, each product of its sum has to be zero.
    """
    product = np.abs(y.T.astype(Long).dot(_long_product(X.mid, x)))
    sizes = np.abs(y).T @ np.abs(X.mid) @ np.abs(x)
    rounding = 2 * (len(X.mid) + 4) * float(np.finfo(Long).eps) * sizes
    return bool(np.all(product + rounding <= allowed * (1.0 + 1e-12) + TINY * (allowed > 0.0)))


def _long_product(X: NDArray, x: NDArray) -> Any:
    """X x (n, k) in long double."""
    return X.astype(Long).dot(x.astype(Long))
