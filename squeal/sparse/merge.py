"""Roots from several shifts as one list, each as often as it is one."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from squeal.sparse.quadratic import ComplexArray

SAME = 1e-6  # relative distance of values that may be one root
SPANNED = 1e-3  # part of a unit vector outside the space of the others that makes it a new one


@dataclass(frozen=True, eq=False)
class Roots:
    """Values (m,) with right vectors (n, m) and, as far as known, left ones (else NaN)."""

    values: ComplexArray
    right: ComplexArray = field(repr=False)
    left: ComplexArray = field(repr=False)

    def picked(self, which: np.ndarray) -> Roots:
        """Some of them, by mask or index."""
        return Roots(self.values[which], self.right[:, which], self.left[:, which])

    def mirrored(self) -> Roots:
        """The conjugate roots."""
        return Roots(self.values.conj(), self.right.conj(), self.left.conj())

    def joined(self, other: Roots) -> Roots:
        """These roots, then the others."""
        values = np.concatenate([self.values, other.values])
        right, left = np.hstack([self.right, other.right]), np.hstack([self.left, other.left])
        return Roots(values, right, left)


def span(x: ComplexArray) -> ComplexArray:
    """An orthonormal basis (n, k) of what vectors (n, m) span but for small parts."""
    basis, singular, _ = np.linalg.svd(x, full_matrices=False)
    return np.asarray(basis[:, singular > SPANNED * singular[0]])


def _outside(x: ComplexArray, basis: ComplexArray) -> float:
    """The part of a unit vector outside a space."""
    return float(np.linalg.norm(x - basis @ (basis.conj().T @ x)))


def merged(old: Roots, new: Roots, near: np.ndarray) -> Roots:
    """`old` and what `new` adds to it.

    Roots at one place are the same if the vector of one lies in the span of the others there; each
    old one answers for at most one new one, so a defective root keeps its multiplicity and a
    multiple one gains the vectors that another start brings. `near` (m,) in rad/s: how far from
    each new one is its place.
    """
    left = old.left.copy()
    free = np.ones(len(old.values), dtype=bool)
    fresh: list[int] = []
    for j, value in enumerate(new.values):
        distance = np.abs(old.values - value)
        there = np.flatnonzero(distance <= near[j])
        if len(there):
            basis = span(old.right[:, there])
            x = new.right[:, j]
            outside = _outside(x, basis)
            open_ones = there[free[there]]
            # of two new vectors of a double root, one old may be a mixture of both
            beside = [k for k in fresh if abs(new.values[k] - value) <= near[j]]
            wider = span(np.hstack([old.right[:, there], new.right[:, beside]]))
            if _outside(x, wider) <= SPANNED and len(open_ones):
                k = open_ones[np.argmin(distance[open_ones])]
                free[k] = False
                if np.isnan(left[0, k]):
                    left[:, k] = new.left[:, j]
                continue
            if outside <= SPANNED and len(basis.T) == len(there):
                continue  # a multiple root whose space is known already
        fresh.append(j)
    return replace(old, left=left).joined(new.picked(np.array(fresh, dtype=int)))
