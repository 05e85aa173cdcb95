"""Enclosure of all roots by approximate diagonalisation and Gershgorin's theorem, see `segments`.

Strong components come first; without damping the eigenvalues are s = -lambda^2.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.linalg import LinAlgError
from numpy.typing import NDArray

from squeal.proof.balls import EPS, Balls, Floats, Quadratic, largest, upper
from squeal.proof.pieces import (
    INFINITE,
    Failure,
    Piece,
    clusters,
    pieces_of,
    strong_parts,
)
from squeal.proof.segments import BEYOND, Basis, Expansion, bases, heights, moving, neighbours

POOR = 1e-6  # of the rate of a system: discs as wide come from a poor guess, or from few digits
SINGULAR = "the mass matrix is singular, or nearly so"
UNSOLVED = "no eigenvectors could be computed"


class Discs(NamedTuple):
    """Centres and radii (n,) of discs; `real` (n,) where the eigenvalues are known to be real."""

    centres: NDArray
    radii: Floats
    real: NDArray[np.bool_]


def components(system: Quadratic) -> list[NDArray[np.intp]]:
    """The rows of each strong component of the pattern of M, C and K.

    Up to a permutation the matrices are block triangular, so that the roots are those of the
    diagonal blocks.
    """
    pattern = np.zeros((system.n, system.n), dtype=bool)
    for X in system.parts:
        pattern |= (X.mid != 0.0) | (X.rad != 0.0)
    return strong_parts(pattern)


@dataclass(frozen=True, eq=False)
class Guess:
    """Roots (m,), rad/s, and mode shapes (n, m) that somebody computed.

    A proof may be built on them, whatever they are: what is wrong with them widens its discs.
    """

    values: NDArray[np.complex128]
    shapes: NDArray[np.complex128]


def enclose(block: Quadratic, guess: Guess | None = None) -> list[Piece] | Failure:
    """Pieces with all roots of one component, for every matrix in its balls.

    Of a damped one they are built on a guess if that proves each root by itself.
    """
    if not block.is_finite:
        return Failure(INFINITE)
    with np.errstate(all="ignore"):
        try:
            own, rate, sizes = scaled(block)
            if not own.is_finite or not np.isfinite(rate):
                return Failure(BEYOND)
            if block.is_undamped:
                discs = _squares(own)
            else:
                if guess is not None:
                    guess = Guess(guess.values / rate, guess.shapes / sizes[:, None])
                discs = _first_order(own, guess)
        except OverflowError:
            return Failure(BEYOND)
        except (LinAlgError, ValueError):
            return Failure(UNSOLVED)
        if isinstance(discs, Failure):
            return discs
        centres, radii, real = discs
        if block.is_undamped:
            centres, radii = _roots_of(centres, radii)
            real = np.concatenate([real, real])
        centres = centres * complex(rate)
        radii = upper(radii * rate, 2)
        if not (np.isfinite(centres).all() and np.isfinite(radii).all()):
            return Failure(BEYOND)
        return pieces_of(centres, radii, block.is_real, block.is_hamiltonian, real)


def scaled(block: Quadratic) -> tuple[Quadratic, float, Floats]:
    """The block in another unit of time and of its coordinates, by powers of two.

    Returns it with the rate (rad/s) that it counts as one, and the units (n,) of its coordinates.
    """
    mass, damping, stiffness = (float(X.bound().max()) for X in block.parts)
    turn = 0
    if mass and stiffness:
        turn = round((np.log2(stiffness) - np.log2(mass)) / 2.0)
    elif mass and damping:
        turn = round(np.log2(damping) - np.log2(mass))
    # powers of the unit of time, shared by M and K so that none leaves the range of numbers
    in_time = replace(block, M=block.M.scaled(turn), K=block.K.scaled(-turn))
    entries = largest(in_time.parts)
    sizes = np.sqrt(entries.max(axis=0)) * np.sqrt(entries.max(axis=1))
    own = -np.rint(np.log2(np.where(sizes > 0.0, sizes, 1.0)) / 2.0).astype(int)
    exponents = own[:, None] + own
    M, C, K = (X.scaled(exponents) for X in in_time.parts)
    return replace(block, M=M, C=C, K=K), float(np.ldexp(1.0, turn)), np.ldexp(1.0, own)


def _squares(block: Quadratic) -> Discs | Failure:
    """Discs of s = -lambda^2 of an undamped block."""
    M, K = block.M, block.K
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


def _first_order(block: Quadratic, guess: Guess | None) -> Discs | Failure:
    """Discs of lambda of a damped block, in the states (q, q')."""
    A, B = companion(block.M, block.C, block.K)
    if guess is not None and len(guess.values) == 2 * block.n:
        X = np.vstack([guess.shapes, guess.shapes * guess.values])
        discs = _gershgorin(A, B, Basis(X / np.linalg.norm(X, axis=0)))
        if isinstance(discs, Discs) and _are_apart(discs) and np.all(discs.radii < POOR):
            return discs
    return _of_pencil(A, B)


def companion(
    M: Balls, C: Balls, K: Balls, rate: float = 1.0, unit: float = 1.0
) -> tuple[Balls, Balls]:
    """A and B (2n, 2n) of the states (q, q' / rate), the rate a power of 2.

    `unit` stands where they hold no entry of M, C or K: 0 in slopes and rests.
    """
    none = np.zeros(M.mid.shape)
    eye = unit * np.eye(len(none))
    A = Balls(
        np.block([[none, rate * eye], [-K.mid / rate, -C.mid]]),
        np.block([[none, none], [K.rad / rate, C.rad]]),
    )
    B = Balls(np.block([[eye, none], [none, M.mid]]), np.block([[none, none], [none, M.rad]]))
    return A, B


def _are_apart(discs: Discs) -> bool:
    """True if no two discs meet."""
    return len(clusters(discs.centres, discs.radii)) == len(discs.radii)


def _gershgorin(A: Balls, B: Balls, basis: Basis) -> Discs | Failure:
    """Discs with all eigenvalues of A - s B."""
    found = moving(Expansion.constant(A), Expansion.constant(B), 0.0, basis)
    if isinstance(found, Failure):
        return found
    discs = neighbours(found, 0.0)
    real = np.zeros(len(A.mid), dtype=bool)
    if basis.mirror is not None:
        for part, (_, tall) in zip(discs.parts, heights(found, discs, 0.0), strict=True):
            real[part] = tall == 0.0
    return Discs(found.centres, discs.radii, real)


def _of_pencil(A: Balls, B: Balls) -> Discs | Failure:
    """Discs of the eigenvalues of A - s B, of those that (nearly) lack vectors by chains."""
    best: Discs | Failure = Failure(SINGULAR)
    with suppress(LinAlgError):
        for basis in bases(A.mid, B.mid):
            discs = _gershgorin(A, B, basis)
            if isinstance(discs, Failure):
                best = discs if isinstance(best, Failure) else best
                continue
            if isinstance(best, Failure) or np.sum(discs.radii) < np.sum(best.radii):
                best = discs
            if _are_apart(best):
                break
    return best


def _roots_of(squares: NDArray, radii: Floats) -> tuple[NDArray[np.complex128], Floats]:
    """Discs (2n,) of both roots lambda of s = -lambda^2 in discs (n,).

    |sqrt(z) - sqrt(c)| <= sqrt|c| - sqrt(|c| - r) for z in a disc of radius r <= |c| around c; a
    disc around zero gets a disc around zero.
    """
    sizes = np.abs(squares)
    roots = np.sqrt(-squares.astype(complex))
    away = radii < 0.9 * sizes
    inner = np.sqrt(np.where(away, (sizes - radii) * (1.0 - 64.0 * EPS), 1.0))
    shift = radii / (np.sqrt(sizes) * (1.0 - 4.0 * EPS) + inner) + 8.0 * EPS * np.abs(roots)
    around_zero = np.sqrt(upper(sizes + radii, 8))
    roots = np.where(away, roots, 0.0)
    found = upper(np.where(away, shift, around_zero), 8)
    return np.concatenate([roots, -roots]), np.concatenate([found, found])
