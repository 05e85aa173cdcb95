"""Bases of invariant subspaces for eigenvalues that (nearly) lack vectors.

At a defective eigenvalue the computed vectors are nearly parallel, so that no enclosure can be
built on them. An orthonormal basis U of the subspace that they span is well conditioned. It is
turned so that the pencil restricted to it is block triangular, N = sigma + (strict part) + (small
numbers): the vectors proper come first, then what the pencil maps onto them, and so on ("levels").
With the columns of level l scaled by t^l the strict part shrinks to t and errors grow to
error/t^(levels - 1), which gives the discs their least radius, about error^(1/levels). Nothing
here has to be exact: what a basis lacks widens the discs that are computed with it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.linalg import LinAlgError
from numpy.typing import NDArray

from squeal.proof.balls import Floats
from squeal.proof.pieces import strong_components

PARALLEL = 0.05
"""1 - cosine of the angle up to which two vectors count as parallel."""
COINCIDENT = 1e-12
"""Of the largest eigenvalue: the distance of two that are one, of vectors of a whole subspace."""
NULL = 1e-2
"""Singular values below this share of the restricted pencil's belong to vectors proper."""
LARGEST_CHAIN = 40
"""Members of a group; larger ones get no basis."""
FINEST = 50
"""The smallest t tried is 2^-FINEST."""


@dataclass(frozen=True, eq=False)
class Chain:
    """A basis in place of the vectors of some eigenvalues.

    members: the columns (k,) of these vectors; basis (n, k); levels (k,): how many steps each
    column of the basis lies from the vectors proper, which have level 0.
    """

    members: NDArray[np.intp]
    basis: NDArray
    levels: NDArray[np.intp]

    def put_into(self, X: NDArray) -> NDArray:
        """The vectors (n, n) with the basis in place of those of the members."""
        changed = X.astype(np.result_type(X, self.basis))
        changed[:, self.members] = self.basis
        return changed

    def shifts(self, N: Floats) -> NDArray[np.intp]:
        """Exponents (n, n) of 2 by which the best scaling of the basis multiplies the entries of N.

        Each column of the basis is multiplied by t^(its level), which multiplies entry (i, j) by
        t^(level of j - level of i). The sum of row i is the radius of disc i. Of the powers of 2
        tried as t, the best makes the largest radius of a member smallest.

        N (n, n): bounds of the entries of the pencil in this basis, zero on the diagonal.
        """
        best = np.zeros(N.shape, dtype=int)
        smallest_radius = np.inf
        for exponent in range(FINEST + 1):
            falls = np.zeros(len(N), dtype=int)  # column j is scaled by 2^-falls[j]
            falls[self.members] = exponent * self.levels
            shifts = falls[:, None] - falls  # entry (i, j) times t^(level of j - level of i)
            scaled_rows = np.ldexp(N[self.members], shifts[self.members])
            radius = float(np.max(np.sum(scaled_rows, axis=1)))
            if radius < smallest_radius:
                smallest_radius = radius
                best = shifts
        return best


def find_chains(A: NDArray, B: NDArray, values: NDArray, X: NDArray) -> list[Chain]:
    """A basis for each group of eigenvalues of A - s B whose vectors are nearly parallel.

    values (n,), X (n, n): computed eigenvalues and vectors.
    """
    chains = []
    for members in _groups(values, X):
        try:
            chains.append(_chain(A, B, values, X, members))
        except LinAlgError:
            continue
    return chains


def _groups(values: NDArray, X: NDArray) -> list[NDArray[np.intp]]:
    """Indices of the eigenvalues of each group; values (n,), vectors X (n, n) as columns.

    Eigenvalues that coincide or have nearly parallel vectors are one group. The spread of a group
    is how far its members lie from its mean at most. Groups whose means lie within 4 times the sum
    of their spreads scatter around one eigenvalue, and are united. A group of more than
    `LARGEST_CHAIN` eigenvalues is left out.
    """
    united: list[NDArray[np.intp]] = []
    groups = _dependent_groups(values, X)
    # from zero outwards: which groups are united depends on the order
    groups.sort(key=lambda group: float(np.abs(values[group].mean())))
    for group in groups:
        centre, spread = _centre_and_spread(values, group)
        for number, earlier in enumerate(united):
            earlier_centre, earlier_spread = _centre_and_spread(values, earlier)
            if abs(centre - earlier_centre) <= 4.0 * (spread + earlier_spread):
                united[number] = np.concatenate([earlier, group])
                break
        else:  # no earlier group lies near
            united.append(group)
    return [np.sort(group) for group in united if len(group) <= LARGEST_CHAIN]


def _dependent_groups(values: NDArray, X: NDArray) -> list[NDArray[np.intp]]:
    """Indices of columns of X that are nearly parallel or whose eigenvalues coincide, directly or
    by way of others."""
    unit = X / np.linalg.norm(X, axis=0)
    is_dependent = np.abs(unit.conj().T @ unit) > 1.0 - PARALLEL
    is_dependent |= np.abs(values[:, None] - values) <= COINCIDENT * np.abs(values).max()
    return [group for group in strong_components(is_dependent) if len(group) > 1]


def _centre_and_spread(values: NDArray, group: NDArray[np.intp]) -> tuple[complex, float]:
    """The mean of a group of eigenvalues and how far its members lie from it at most."""
    centre = complex(values[group].mean())
    return centre, float(np.max(np.abs(values[group] - centre)))


def _chain(A: NDArray, B: NDArray, values: NDArray, X: NDArray, members: NDArray[np.intp]) -> Chain:
    """The basis of the invariant subspace of the eigenvalues `members`, its columns by levels.

    Inverse iteration finds the subspace, the staircase form its levels. values (n,) and X (n, n):
    all eigenvalues s and vectors of A x = s B x; members: indices of some.
    """
    centre, spread = _centre_and_spread(values, members)
    is_complex = np.iscomplexobj(A) or np.iscomplexobj(B)
    is_real = not is_complex and abs(centre.imag) <= spread
    sigma = centre.real if is_real else centre
    # nearly parallel vectors leave directions of their span poorly known: three steps of inverse
    # iteration, from a shift just beside the group, improve it. Of a double root without spread
    # A - shift B is singular to rounding from a shift nearer than the square root of rounding;
    # 1e-10 serves where sigma is zero
    shift = sigma + 10.0 * max(spread, 1e-8 * abs(sigma), 1e-10)
    U = _orthonormal(X[:, members], is_real)
    for _ in range(3):
        U = _orthonormal(np.linalg.solve(A - shift * B, B @ U), is_real)
    restricted = U.conj().T @ np.linalg.solve(B, A @ U) - sigma * np.eye(len(members))
    rotation, levels = _staircase(restricted)
    return Chain(members, U @ rotation, levels)


def _orthonormal(X: NDArray, is_real: bool) -> NDArray:
    """An orthonormal basis (n, k) of what the k columns of X span.

    If `is_real`, the columns are a set that is its own conjugate, and the basis is real.
    """
    k = X.shape[1]
    spanning = X
    if is_real and np.iscomplexobj(X):
        spanning = np.hstack([X.real, X.imag])
    spanning = spanning / np.maximum(np.linalg.norm(spanning, axis=0), 1e-300)
    # all k left vectors, however small the singular values: of nearly parallel columns the small
    # differences give directions, too
    left, _, _ = np.linalg.svd(spanning, full_matrices=False)
    return left[:, :k]


def _staircase(N: NDArray) -> tuple[NDArray, NDArray[np.intp]]:
    """Unitary Q (k, k) that makes Q' N Q block triangular, and the level (k,) of each column.

    The null vectors of N come first, as level 0. Without their rows and columns Q' N Q is a smaller
    matrix, whose null vectors come next, as level 1, and so on (the staircase form of a nilpotent
    matrix, by Kublanovskaya). Columns that remain when a matrix has no null vector share a level.
    Their diagonal block is large, those of all other levels are small.
    """
    k = len(N)
    Q = np.eye(k, dtype=N.dtype)
    transformed = N  # Q' N Q
    levels = np.zeros(k, dtype=int)
    # at least NULL^2: an N that is smaller altogether counts as zero
    small = NULL * max(float(np.linalg.norm(N, 2)), NULL)
    start = 0
    level = 0
    while start < k:
        _, singular_values, right = np.linalg.svd(transformed[start:, start:])
        is_null = singular_values <= small
        if not is_null.any():
            levels[start:] = level
            break
        order = np.concatenate([np.flatnonzero(is_null), np.flatnonzero(~is_null)])
        Z = right.conj().T[:, order]
        transformed = np.hstack([transformed[:, :start], transformed[:, start:] @ Z])
        transformed = np.vstack([transformed[:start], Z.conj().T @ transformed[start:]])
        Q[:, start:] = Q[:, start:] @ Z
        end = start + int(is_null.sum())
        levels[start:end] = level
        start = end
        level += 1
    return Q, levels
