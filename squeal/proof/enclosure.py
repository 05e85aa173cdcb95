"""Enclosure of all roots by approximate diagonalisation and Gershgorin's theorem.

Let X hold approximate right vectors of the pencil A - s B and Y be about the inverse of B X. With
G = Y B X, R = Y A X and |G - 1| <= E, of row sums e < 1, no matrix in the balls makes Y, B or X
singular, so that the roots are the eigenvalues of S = G^-1 R. For a diagonal D

    S - D = G^-1 (R - G D),    |G^-1 - 1| <= E + (row sums of E) (column maxima of E) / (1 - e),

which bounds |S - D| <= N entry by entry, for every matrix in the balls. A connected part of the
union of Gershgorin's discs holds as many eigenvalues as discs. A disc that meets no other shrinks:
with its column of X scaled by 1/a its radius is N_ii + a (sum of N_ij), as long as the discs of the
other rows, wider by N_ji/a, do not meet it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.linalg import LinAlgError
from numpy.typing import NDArray

from squeal.proof.balls import EPS, Balls, Floats, Quadratic, largest, row_sums, size, upper
from squeal.proof.chains import Chain, find_chains
from squeal.proof.pieces import (
    INFINITE,
    Failure,
    Piece,
    clusters,
    distances,
    pieces_of,
    strong_parts,
    touching,
)

LARGEST_CLUSTER = 8  # of which signs of determinants are asked
POOR = 1e-6  # of the rate of a system: discs as wide come from a poor guess, or from few digits
LARGEST_E = 0.5  # row sums of |Y B X - 1| up to which the inverse is bounded
SINGULAR = "the mass matrix is singular, or nearly so"
BEYOND = "the entries lie beyond double precision"
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
            values, X = np.linalg.eigh(inverse @ K.mid @ inverse.T)
            X = inverse.T @ X
        except LinAlgError:
            pass  # M is not positive definite
        else:
            discs = _gershgorin(K, M, values, X, X.T)
            if isinstance(discs, Discs):
                # X' M X is close to 1, so that M is positive definite and all s are real
                return discs._replace(real=np.ones(block.n, dtype=bool))
    discs = _of_pencil(K, M)
    if isinstance(discs, Failure) or not block.is_real:
        return discs
    return discs._replace(real=_real_by_signs(K, M, discs))


def _first_order(block: Quadratic, guess: Guess | None) -> Discs | Failure:
    """Discs of lambda of a damped block, in the states (q, q')."""
    n = block.n
    kind = float if block.is_real else complex
    A = Balls(np.zeros((2 * n, 2 * n), dtype=kind), np.zeros((2 * n, 2 * n)))
    B = Balls(np.zeros((2 * n, 2 * n), dtype=kind), np.zeros((2 * n, 2 * n)))
    A.mid[:n, n:] = np.eye(n)
    A.mid[n:, :n], A.rad[n:, :n] = -block.K.mid, block.K.rad
    A.mid[n:, n:], A.rad[n:, n:] = -block.C.mid, block.C.rad
    B.mid[:n, :n] = np.eye(n)
    B.mid[n:, n:], B.rad[n:, n:] = block.M.mid, block.M.rad
    if guess is not None and len(guess.values) == 2 * n:
        discs = _of_guess(A, B, guess)
        if isinstance(discs, Discs) and _are_apart(discs) and np.all(discs.radii < POOR):
            return discs
    return _of_pencil(A, B)


def _of_guess(A: Balls, B: Balls, guess: Guess) -> Discs | Failure:
    """Discs of the eigenvalues of A - s B from guessed ones."""
    X = np.vstack([guess.shapes, guess.shapes * guess.values])
    X = X / np.linalg.norm(X, axis=0)
    try:
        Y = np.linalg.inv(B.mid @ X)
    except LinAlgError:
        return Failure(UNSOLVED)
    return _gershgorin(A, B, guess.values, X, Y)


def _are_apart(discs: Discs) -> bool:
    """True if no two discs meet."""
    return len(clusters(discs.centres, discs.radii)) == len(discs.radii)


def _of_pencil(A: Balls, B: Balls) -> Discs | Failure:
    """Discs of the eigenvalues of A - s B, of those that (nearly) lack vectors by chains."""
    solution = _diagonalised(A, B)
    if isinstance(solution, Failure):
        return solution
    discs = _gershgorin(A, B, *solution)
    if isinstance(discs, Discs) and _are_apart(discs):
        return discs
    values, X, _ = solution
    chains = find_chains(A.mid, B.mid, values, X)
    if not chains:
        return discs
    for chain in chains:
        X = chain.put_into(X)
    try:
        Y = np.linalg.inv(B.mid @ X)
    except LinAlgError:
        return discs
    second = _gershgorin(A, B, values, X, Y, chains)
    if isinstance(second, Failure):
        return discs
    if isinstance(discs, Failure) or np.sum(second.radii) < np.sum(discs.radii):
        return second
    return discs


def _diagonalised(A: Balls, B: Balls) -> tuple[NDArray, NDArray, NDArray] | Failure:
    """Approximate eigenvalues of A - s B, right vectors X, and Y, about the inverse of B X."""
    try:
        values, X = np.linalg.eig(np.linalg.solve(B.mid, A.mid))
        if not values.imag.any() and not np.iscomplexobj(A.mid):
            values, X = values.real, X.real
        Y = np.linalg.inv(B.mid @ X)
    except LinAlgError:
        return Failure(SINGULAR)
    return values, X, Y


def _gershgorin(
    A: Balls,
    B: Balls,
    values: NDArray,
    X: NDArray,
    Y: NDArray,
    chains: Sequence[Chain] = (),
) -> Discs | Failure:
    """Discs with all eigenvalues of A - s B, see the module."""
    left, right = Balls.exact(Y), Balls.exact(X)
    G = left @ (B @ right)
    R = left @ (A @ right)
    D = R.mid.diagonal() / G.mid.diagonal()
    E = Balls(G.mid - np.eye(len(D)), upper(G.rad + EPS * size(G.mid), 2)).bound()
    sums = row_sums(E)
    e = float(np.max(sums))
    if not e <= LARGEST_E:
        return Failure("the eigenvectors are too ill-conditioned")
    inverse = upper(E + np.outer(sums, E.max(axis=0)) / (1.0 - e), 6)
    T = R.plus(G.times(-D)).bound()
    N = upper(T + inverse @ T, len(D) + 2)
    if not np.isfinite(N).all():
        return Failure(BEYOND)
    for chain in chains:
        N = chain.graded(N)
    return Discs(D, _shrunk(D, N), np.zeros(len(D), dtype=bool))


def _shrunk(centres: NDArray, N: Floats) -> Floats:
    """The radii of Gershgorin's discs of diag(centres) + F with |F| <= N."""
    radii = row_sums(N)
    own = N.diagonal()
    others = row_sums(N - np.diag(own))
    room = distances(centres, centres) - radii[:, None] - radii[None, :]
    np.fill_diagonal(room, np.inf)
    isolated = np.all(room > 0.0, axis=1)
    # in row i: what the disc of each other row j needs, N_ji / a, stays below half of the room
    share = np.max(2.0 * N.T / np.where(room > 0.0, room, 1.0), axis=1)
    share = np.clip(upper(share, 4), 1e-12, None)
    smaller = upper(own + share * others, 4)
    return np.where(isolated & (share < 1.0), np.minimum(smaller, radii), radii)


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


def _real_by_signs(K: Balls, M: Balls, discs: Discs) -> NDArray[np.bool_]:
    """Which eigenvalues of K - s M are real, those of clusters by the sign of det(K - m M).

    Left of a real m that lies in no disc the number of real eigenvalues has the parity of the
    number of discs there, since others come in pairs. Where that holds too for the middles between
    all neighbouring centres of a cluster, each of its intervals has at least one.
    """
    centres, radii = discs.centres, discs.radii
    known = np.zeros(len(centres), dtype=bool)
    parts = clusters(centres, radii)
    wide = [part for part in parts if 2 <= len(part) <= LARGEST_CLUSTER]
    if not wide:
        return known
    on_axis = [part for part in parts if np.any(np.abs(centres[part].imag) <= radii[part])]
    images = touching(centres.conj(), radii, centres, radii)
    for part in on_axis:
        others = np.setdiff1d(np.arange(len(centres)), part)
        if images[np.ix_(part, others)].any():
            return known  # a root and its conjugate may lie in different parts
    lows = [np.min(centres[part].real - radii[part]) for part in on_axis]
    highs = [np.max(centres[part].real + radii[part]) for part in on_axis]
    first_sign = _determinant_sign(M)
    for part in wide:
        places = np.sort(centres[part].real)
        odd = []
        for j, m in enumerate((places[1:] + places[:-1]) / 2.0, start=1):
            left = j
            for other, low, high in zip(on_axis, lows, highs, strict=True):
                if other is part:
                    continue
                if low <= m <= high:
                    left = -1  # the number on the left is not known
                    break
                left += len(other) if high < m else 0
            sign = _determinant_sign(K.plus(M.times(-m))) if left >= 0 else 0
            odd.append(sign != 0 and sign == first_sign * (-1) ** left)
        known[part] = all(odd)
    return known


def _determinant_sign(A: Balls) -> int:
    """The sign that the determinant of all matrices in the balls has, 0 if it is not known.

    The product of the computed triangles lies in the balls once these are widened to reach it, and
    none of the widened balls is singular if |1 - B A| < 1 for an approximate inverse B.
    """
    from scipy.linalg import lu  # here, since few systems need it

    permutation, lower, triangle = lu(A.mid)
    product = Balls.exact(permutation @ lower) @ Balls.exact(triangle)
    reach = upper(size(A.mid - product.mid) + product.rad + EPS * size(A.mid), 4)
    widened = Balls(A.mid, np.maximum(A.rad, reach))
    try:
        test = Balls.exact(np.linalg.inv(A.mid)) @ widened
    except LinAlgError:
        return 0
    if not np.max(row_sums(upper(size(test.mid - np.eye(len(A.mid))) + test.rad, 4))) < 1.0:
        return 0
    signs = np.sign(triangle.diagonal())
    return int(np.prod(signs) * np.rint(np.linalg.det(permutation)))
