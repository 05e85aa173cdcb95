"""Enclosure of all roots by approximate diagonalisation and Gershgorin's theorem, see `segments`.

Strong components come first; without damping the eigenvalues are s = -lambda^2.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.linalg import LinAlgError
from numpy.typing import NDArray

from squeal.proof.balls import EPS, Balls, Floats, Quadratic, divisor, upper
from squeal.proof.pieces import (
    INFINITE,
    Failure,
    Piece,
    clusters,
    pieces_of,
    strong_components,
)
from squeal.proof.segments import (
    BEYOND,
    Basis,
    Expansion,
    bases,
    imaginary_bounds,
    moving_discs,
    near_diagonal,
)

SINGULAR = "the mass matrix is singular, or nearly so"
UNSOLVED = "no eigenvectors could be computed"


class Discs(NamedTuple):
    """Centres and radii (n,) of discs; `real` (n,) where the eigenvalues are known to be real."""

    centres: NDArray
    radii: Floats
    real: NDArray[np.bool_]


def components(matrices: Sequence[Balls]) -> list[NDArray[np.intp]]:
    """The rows of each strong component of the joint pattern of matrices (n, n), M, C and K or
    their terms.

    Up to a permutation the matrices are block triangular, so that the roots are those of the
    diagonal blocks.
    """
    return strong_components(np.any([X.pattern for X in matrices], axis=0))


def enclose(block: Quadratic) -> list[Piece] | Failure:
    """Pieces with all roots (rad/s) of one component, for every matrix in its balls.

    A Failure says why no disc is known.
    """
    if not block.is_finite:
        return Failure(INFINITE)
    with np.errstate(all="ignore"):
        try:
            scaled_block, rate = scaled(block)
            if not scaled_block.is_finite or not np.isfinite(rate):
                return Failure(BEYOND)
            if block.is_undamped:
                discs = _roots_of_squares(_squares(scaled_block))
            else:
                A, B = companion(scaled_block.M, scaled_block.C, scaled_block.K)
                discs = _of_pencil(A, B)
        except OverflowError:
            return Failure(BEYOND)
        except (LinAlgError, ValueError):
            return Failure(UNSOLVED)
        if isinstance(discs, Failure):
            return discs
        centres = discs.centres * complex(rate)  # rad/s; exact, unless it underflows
        # allows for two products: the one here, and underflow of it and of the centres
        radii = upper(discs.radii * rate, 2)
        if not (np.isfinite(centres).all() and np.isfinite(radii).all()):
            return Failure(BEYOND)  # beyond the largest double
        return pieces_of(
            centres,
            radii,
            real=block.is_real,
            hamiltonian=block.is_hamiltonian,
            # `discs.real` is of s = -lambda^2 without damping, else of lambda: either way lambda^2
            # is real
            real_squares=discs.real,
        )


def scaled(block: Quadratic) -> tuple[Quadratic, float]:
    """The block in units of time and of its coordinates that make its entries about 1.

    Returns the scaled block and its unit of frequency, the rate (rad/s), by which its roots have to
    be multiplied: about sqrt(|K| / |M|), or |C| / |M| without stiffness. All units are powers of
    two, so that nothing is rounded.
    """
    mass, damping, stiffness = (float(X.bound().max()) for X in block.parts)
    time_exponent = 0
    if mass > 0.0 and stiffness > 0.0:
        time_exponent = round((np.log2(stiffness) - np.log2(mass)) / 2.0)
    elif mass > 0.0 and damping > 0.0:
        time_exponent = round(np.log2(damping) - np.log2(mass))
    # in units of the rate the matrices are M rate^2, C rate and K. All three are divided by the
    # rate, which leaves the roots alone, so that none exceeds the range of doubles
    M_of_time = block.M.scaled(time_exponent)
    K_of_time = block.K.scaled(-time_exponent)
    entries = np.max([X.bound() for X in (M_of_time, block.C, K_of_time)], axis=0)
    # the size of a coordinate is the geometric mean of the largest entries of its column and of its
    # row. A unit multiplies both, hence a diagonal entry twice: it is 1 / sqrt(size)
    sizes = np.sqrt(entries.max(axis=0)) * np.sqrt(entries.max(axis=1))
    unit_exponents = -np.rint(np.log2(divisor(sizes)) / 2.0).astype(int)
    exponents = unit_exponents[:, None] + unit_exponents
    scaled_block = replace(
        block,
        M=M_of_time.scaled(exponents),
        C=block.C.scaled(exponents),
        K=K_of_time.scaled(exponents),
    )
    return scaled_block, float(np.ldexp(1.0, time_exponent))


def _squares(block: Quadratic) -> Discs | Failure:
    """Discs of s = -lambda^2, the eigenvalues of K - s M, of an undamped block.

    With a symmetric positive definite M = L L' they are built on the vectors X = L^-T V, with the
    orthonormal vectors V of L^-1 K L^-T.
    """
    M = block.M
    K = block.K
    if block.symmetric:
        try:
            inverse = np.linalg.inv(np.linalg.cholesky(M.mid))
            X = inverse.T @ np.linalg.eigh(inverse @ K.mid @ inverse.T)[1]
        except LinAlgError:
            pass  # M is not positive definite
        else:
            discs = _gershgorin(K, M, Basis(X, Y=X.T))
            if isinstance(discs, Discs):
                # X' M X is close to 1, so that M is positive definite and all s are real
                return discs._replace(real=np.ones(block.n, dtype=bool))
    return _of_pencil(K, M)


def companion(
    M: Balls,
    C: Balls,
    K: Balls,
    rate: float = 1.0,
    unit: float = 1.0,
    massless: NDArray[np.bool_] | None = None,
) -> tuple[Balls, Balls]:
    """A and B (2n, 2n) of B z' = A z in the states z = (q, q' / rate), the rate a power of 2.

    A = [[0, rate], [-K / rate, -C]] and B = [[1, 0], [0, M]]. `unit` stands for the ones: 0 where
    A and B are a derivative or a remainder, which have no such entries.

    massless: which coordinates (n,), with columns of M that are zero, have no velocity among the
    states. Their equations q' = velocity are left out of A and B, and their columns of C stand in
    B, where they multiply q'. None if all have one.
    """
    zero = np.zeros(M.mid.shape)
    identity = unit * np.eye(len(zero))
    of_all = np.ones(len(zero), dtype=bool)
    without_velocity = ~of_all if massless is None else massless
    equations = np.concatenate([~without_velocity, of_all])
    states = np.concatenate([of_all, ~without_velocity])
    used = np.ix_(equations, states)

    def of_blocks(rows: list[list[NDArray]]) -> NDArray:
        """The matrix of two rows of blocks, as `np.block`, which takes four times as long."""
        return np.concatenate([np.concatenate(row, axis=1) for row in rows])[used]

    A = Balls(
        of_blocks([[zero, rate * identity], [-K.mid / rate, -C.mid]]),
        of_blocks([[zero, zero], [K.rad / rate, C.rad]]),
    )
    B = Balls(
        of_blocks([[identity, zero], [C.mid * without_velocity / rate, M.mid]]),
        of_blocks([[zero, zero], [C.rad * without_velocity / rate, M.rad]]),
    )
    return A, B


def _gershgorin(A: Balls, B: Balls, basis: Basis) -> Discs | Failure:
    """Discs with all eigenvalues of A - s B, from approximate vectors."""
    S = near_diagonal(Expansion.constant(A), Expansion.constant(B), half=0.0, basis=basis)
    if isinstance(S, Failure):
        return S
    discs = moving_discs(S, half=0.0)
    real = np.zeros(len(A.mid), dtype=bool)
    if basis.mirror is not None:
        imaginary_parts = imaginary_bounds(S, discs, half=0.0)
        for part, imaginary in zip(discs.parts, imaginary_parts, strict=True):
            real[part] = imaginary.largest == 0.0  # a bound of |Im s|
    return Discs(S.centres, discs.radii, real)


def _of_pencil(A: Balls, B: Balls) -> Discs | Failure:
    """Discs of the eigenvalues of A - s B, the smallest of those that a few bases give.

    The bases are the computed vectors, then chains where these are nearly parallel; the search
    ends once the smallest so far are apart. A Failure only if all fail.
    """
    best: Discs | Failure = Failure(SINGULAR)
    with suppress(LinAlgError):
        for basis in bases(A.mid, B.mid):
            discs = _gershgorin(A, B, basis)
            if isinstance(discs, Failure):
                if isinstance(best, Failure):  # no basis has served yet: the latest reason counts
                    best = discs
                continue
            if isinstance(best, Failure) or np.sum(discs.radii) < np.sum(best.radii):
                best = discs
            if len(clusters(best.centres, best.radii)) == len(best.radii):  # no two discs meet
                break
    return best


def _roots_of_squares(squares: Discs | Failure) -> Discs | Failure:
    """Discs (2n,) of both roots lambda = +-sqrt(-s) of each s in discs (n,), `real` that of s.

    |sqrt(z) - sqrt(c)| <= sqrt|c| - sqrt(|c| - r) = r / (sqrt|c| + sqrt(|c| - r)) for z in a disc
    of radius r <= |c| around c: with z = c (1 - w), |w| <= r / |c|, the left side is
    sqrt|c| |1 - sqrt(1 - w)|. All coefficients of the binomial series of 1 - sqrt(1 - w) are
    positive, so that its size is at most 1 - sqrt(1 - |w|).
    Where r is at least 0.9 |c| the disc nearly reaches zero, and both roots get a disc around zero,
    of radius sqrt(|c| + r).
    """
    if isinstance(squares, Failure):
        return squares
    sizes = np.abs(squares.centres)
    roots = np.sqrt(-squares.centres.astype(complex))
    is_away_from_zero = squares.radii < 0.9 * sizes
    # the sizes are rounded, so that |c| - r is taken a little too small
    least_sizes = np.where(is_away_from_zero, (sizes - squares.radii) * (1.0 - 64.0 * EPS), 1.0)
    radii_away = squares.radii / (np.sqrt(sizes) * (1.0 - 4.0 * EPS) + np.sqrt(least_sizes))
    radii_away += 8.0 * EPS * np.abs(roots)  # rounding of the root itself
    radii_around_zero = np.sqrt(upper(sizes + squares.radii, 8))
    centres = np.where(is_away_from_zero, roots, 0.0)
    radii = upper(np.where(is_away_from_zero, radii_away, radii_around_zero), 8)
    return Discs(
        np.concatenate([centres, -centres]),
        np.concatenate([radii, radii]),
        np.concatenate([squares.real, squares.real]),  # whether lambda^2 = -s is known to be real
    )
