"""Bases of invariant subspaces for eigenvalues that (nearly) lack vectors.

At a defective eigenvalue the computed vectors are nearly parallel, so that no enclosure can be
built on them. An orthonormal basis U of the subspace that they span is well conditioned. It is
turned so that the pencil restricted to it is block triangular, N = sigma + (strict part) + (small
numbers): the vectors proper come first, then what the pencil maps onto them, and so on ("levels").
With the columns of level l scaled by t^l the strict part shrinks to t and errors grow to
error/t^(levels - 1), which gives the discs their least radius, about error^(1/levels). Nothing
here has to be exact: what a basis lacks widens the discs that are computed with it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.linalg import LinAlgError
from numpy.typing import NDArray

from squeal.proof.balls import Floats

PARALLEL = 0.05  # 1 - cosine of the angle up to which two vectors count as one
NULL = 1e-2  # of the size of the restricted pencil: singular values below belong to vectors proper
LARGEST_CHAIN = 40  # members
FINEST = 50  # t = 2^-FINEST at the least


@dataclass(frozen=True, eq=False)
class Chain:
    """Columns of the vectors with a basis (n, k) in their place, and the level (k,) of each."""

    members: NDArray[np.intp]
    basis: NDArray
    levels: NDArray[np.intp]

    def put_into(self, X: NDArray) -> NDArray:
        """The vectors (n, n) with the basis in place of those of the members."""
        changed = X.astype(np.result_type(X, self.basis))
        changed[:, self.members] = self.basis
        return changed

    def shifts(self, N: Floats) -> NDArray[np.intp]:
        """By which powers of 2 entries (n, n) grow as columns are scaled by t^level, with the t for
        which the sums of the members' rows of N are least."""
        best = np.zeros(N.shape, dtype=int)
        least = np.inf
        for exponent in range(FINEST):
            powers = np.zeros(len(N), dtype=int)
            powers[self.members] = exponent * self.levels
            shifts = powers[:, None] - powers
            widest = float(np.max(np.sum(np.ldexp(N[self.members], shifts[self.members]), axis=1)))
            if widest < least:
                least = widest
                best = shifts
        return best


def find_chains(A: NDArray, B: NDArray, values: NDArray, X: NDArray) -> list[Chain]:
    """A basis for each group of eigenvalues of A - s B whose vectors are nearly parallel."""
    chains = []
    for members in _groups(values, X):
        try:
            chains.append(_chain(A, B, values, X, members))
        except LinAlgError:
            continue
    return chains


def _groups(values: NDArray, X: NDArray) -> list[NDArray[np.intp]]:
    """Indices of eigenvalues with nearly parallel vectors, groups around one place united."""
    unit = X / np.linalg.norm(X, axis=0)
    linked = np.abs(unit.conj().T @ unit) > 1.0 - PARALLEL
    np.fill_diagonal(linked, False)
    label = np.full(len(values), -1)
    count = 0
    for first in np.flatnonzero(linked.any(axis=0)):
        if label[first] >= 0:
            continue
        waiting = [int(first)]
        while waiting:
            i = waiting.pop()
            if label[i] < 0:
                label[i] = count
                waiting.extend(np.flatnonzero(linked[i]).tolist())
        count += 1
    groups = [np.flatnonzero(label == number) for number in range(count)]
    united: list[NDArray[np.intp]] = []
    for group in sorted(groups, key=lambda g: float(np.abs(values[g].mean()))):
        centre, spread = _place(values, group)
        for number, other in enumerate(united):
            middle, width = _place(values, other)
            if abs(centre - middle) <= 4.0 * (spread + width):
                united[number] = np.concatenate([other, group])
                break
        else:
            united.append(group)
    return [np.sort(group) for group in united if len(group) <= LARGEST_CHAIN]


def _place(values: NDArray, group: NDArray[np.intp]) -> tuple[complex, float]:
    """The middle of a group of eigenvalues and how far its members lie from it."""
    middle = complex(values[group].mean())
    return middle, float(np.max(np.abs(values[group] - middle)))


def _chain(A: NDArray, B: NDArray, values: NDArray, X: NDArray, members: NDArray[np.intp]) -> Chain:
    """The basis of the subspace of some eigenvalues, its columns by levels."""
    middle, spread = _place(values, members)
    is_real = not np.iscomplexobj(X) or abs(middle.imag) <= spread
    sigma = middle.real if is_real else middle
    # a step of inverse iteration from just beside the group: vectors that are nearly parallel
    # leave directions of their span poorly known
    shift = sigma + 10.0 * max(spread, 1e-10 * abs(sigma), 1e-10)
    U = _orthonormal(X[:, members], is_real)
    for _ in range(2):
        U = _orthonormal(np.linalg.solve(A - shift * B, B @ U), is_real)
    restricted = U.conj().T @ np.linalg.solve(B, A @ U) - sigma * np.eye(len(members))
    turn, levels = _staircase(restricted)
    return Chain(members, U @ turn, levels)


def _orthonormal(X: NDArray, is_real: bool) -> NDArray:
    """An orthonormal basis (n, k) of what k columns span, a real one of a set that is its own
    conjugate."""
    k = X.shape[1]
    spanning = np.hstack([X.real, X.imag]) if is_real and np.iscomplexobj(X) else X
    spanning = spanning / np.maximum(np.linalg.norm(spanning, axis=0), 1e-300)
    # of nearly parallel columns the differences count as much as the mean
    left, _, _ = np.linalg.svd(spanning, full_matrices=False)
    return left[:, :k]


def _staircase(N: NDArray) -> tuple[NDArray, NDArray[np.intp]]:
    """Unitary Q (k, k) that makes Q' N Q block triangular with small diagonal blocks, and the
    level of each column."""
    k = len(N)
    turn = np.eye(k, dtype=N.dtype)
    levels = np.zeros(k, dtype=int)
    small = NULL * max(float(np.linalg.norm(N, 2)), NULL)
    start = 0
    level = 0
    while start < k:
        _, sizes, right = np.linalg.svd(N[start:, start:])
        null = sizes <= small
        if not null.any():
            levels[start:] = level
            break
        order = np.concatenate([np.flatnonzero(null), np.flatnonzero(~null)])
        Z = right.conj().T[:, order]
        N = np.hstack([N[:, :start], N[:, start:] @ Z])
        N = np.vstack([N[:start], Z.conj().T @ N[start:]])
        turn[:, start:] = turn[:, start:] @ Z
        levels[start : start + int(null.sum())] = level
        start += int(null.sum())
        level += 1
    return turn, levels
