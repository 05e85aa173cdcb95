"""Roots of a system in which some motion has no mass, or hardly any.

Damped motions without mass are of the first order: y' P(lambda) has no lambda^2, for each y with
y' M = 0. These rows times lambda + a have one, and P no other roots beside its own but -a, a > 0,
which decays at all parameters.

In eigenvectors of M and with s = -lambda^2, K21 q1 + K22 q2 = s D2 q2, where the coordinates q2 are
nearly massless. On the subspace of the slow roots q2 = -X q1, K22 X = K21 + D2 X L and
D1 L = K11 - K12 X: static condensation of what has no mass, and of a nearly massless coordinate a
few iterations more, each of which gains a factor of D2 L / K22.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from squeal.errors import MatrixError
from squeal.linear.matrices import (
    EPS,
    ILL,
    Array,
    dense,
    divisor,
    equilibrated,
    norm_of,
    scaled_rank,
    unit_diagonal,
)
from squeal.linear.system import Matrices, System, SystemFunction, Term, matrices_of

REFUSED = (
    "M: is ill conditioned, as where some motion has (nearly) no mass or coordinates nearly depend "
    "on each other, and that motion is damped or may grow, or M varies; those thresholds can be "
    "given that lie in a `band` (low and high, in Hz)"
)
DECAYS = 4.0  # times the rate at which damped motions without mass decay: added roots decay by it


class Completed(NamedTuple):
    """A system with regular M that has the roots of another one, and some that decay beside them.

    added: how many; all are at one real value below zero.
    """

    system: System
    added: int


def completed_to_second_order(system: SystemFunction, p: float) -> Completed | None:
    """The system with mass for each damped motion that has none.

    None for a plain function, for complex matrices, where M at p is regular, where a motion without
    mass is not damped, and where other motions have none at other values of the parameter.
    """
    if not isinstance(system, System) or not system.real:
        return None
    ((M, C, K),) = matrices_of(system, [p])
    rank = scaled_rank(M)  # whatever units M mixes
    left, _, right = np.linalg.svd(M)
    rows = left[:, rank:]  # y' M = 0
    motions = right[rank:].T  # M x = 0
    added = rows.shape[1]
    if not added or not ILL * np.linalg.cond(rows.T @ C @ motions) < 1.0:
        return None  # M is regular, or a motion without mass is not damped
    for term in system.M:  # none may give these rows or motions mass at another parameter
        matrix = dense(term.matrix)
        noise = 4 * EPS * len(M) * norm_of(matrix)
        if max(norm_of(rows.T @ matrix), norm_of(matrix @ motions)) > noise:
            return None
    rate = DECAYS * float(norm_of(K) / norm_of(C)) or 1.0  # a of the module's head; 1 for K = 0
    first_order = rows @ rows.T  # projects on the rows without mass

    def with_rate(term: Term) -> Term:
        """The term with its rows without mass times a."""
        matrix = dense(term.matrix)
        return replace(term, matrix=matrix + (rate - 1.0) * (first_order @ matrix))

    def raised(term: Term) -> Term:
        """The rows without mass alone, which times lambda stand one power higher."""
        return replace(term, matrix=first_order @ dense(term.matrix))

    completed = System(
        M=(*system.M, *map(raised, system.C)),
        C=(*map(with_rate, system.C), *map(raised, system.K)),
        K=tuple(map(with_rate, system.K)),
        parameters=dict(system.parameters),
        parameter=system.parameter,
        name=system.name,
    )
    return Completed(completed, added)


def _require(fulfilled: bool | np.bool_) -> None:
    """Raise MatrixError unless a condition of static condensation is fulfilled."""
    if not fulfilled:
        raise MatrixError(REFUSED)


class _Blocks(NamedTuple):
    """Blocks of a matrix in eigenvectors of M.

    2 stands for the n2 nearly massless coordinates, 1 for the n1 others: X21 has the shape
    (n2, n1).
    """

    X22: Array
    X21: Array
    X12: Array
    X11: Array


class StaticCondensation:
    """The slow motions of a system, some of whose coordinates are nearly massless, with M = 1.

    A function p -> (M, C, K) with matrices (n1, n1). Raises InputError if M varies, or if nearly
    massless coordinates are damped, may grow or leave the slow roots too few digits.

    Attributes
    ----------
    error_amplification : float
        The factor by which it has increased relative rounding errors, the largest so far.
    cancelled : float
        How much larger the terms are of which entries of K are the difference, rad^2/s^2; the most
        so far.
    """

    def __init__(self, system: SystemFunction, p: float) -> None:
        """Divide the eigenvectors of M at p into nearly massless ones and others."""
        self._system = system
        self.error_amplification = 1.0
        self.cancelled = 0.0
        ((self._M, _, K),) = matrices_of(system, [p])
        scale = np.sqrt(np.abs(np.diag(self._M)))
        _require(scale.any())
        masses, vectors = np.linalg.eigh(unit_diagonal(self._M))  # by rising mass
        self._vectors = vectors / divisor(scale)[:, None]
        masses = np.where(masses > 4 * EPS * len(masses) * masses[-1], masses, 0.0)
        _require(len(masses) > 1)  # else no mass is left
        # the greatest gap between neighbouring masses divides them
        gaps = masses[1:] / np.maximum(masses[:-1], EPS * masses[-1])
        count = int(np.argmax(gaps)) + 1
        self._light_masses = masses[:count]
        self._masses = masses[count:]
        # a gap of four decades divides them clearly; of one light coordinate with a mass at most
        # the sign of det K22 tells that of its stiffness
        _require(gaps.max() >= 1e4 and np.count_nonzero(self._light_masses) <= 1)
        # a light coordinate of negative stiffness would grow
        self._sign_of_det_K22 = float(np.linalg.slogdet(self._blocks(K).X22)[0])
        _require(self._sign_of_det_K22 > 0.0 or not self._light_masses.any())

    def _blocks(self, X: Array) -> _Blocks:
        """The blocks of M, C or K (n, n)."""
        transformed = self._vectors.T @ X @ self._vectors
        k = len(self._light_masses)
        return _Blocks(
            X22=transformed[:k, :k],
            X21=transformed[:k, k:],
            X12=transformed[k:, :k],
            X11=transformed[k:, k:],
        )

    def __call__(self, p: float) -> Matrices:
        """M, C and K of the slow motions at p."""
        ((M, C, K),) = matrices_of(self._system, [p])
        damping = self._blocks(C)
        noise = 4 * EPS * len(M) * np.abs(damping.X11).max()
        for block in (damping.X22, damping.X21, damping.X12):  # of the nearly massless coordinates
            _require(np.abs(block).max() <= noise)
        # M must not vary, and damping is allowed beside coordinates of no mass at all only
        _require(np.array_equal(M, self._M) and not (C.any() and self._light_masses.any()))
        unit = np.sqrt(np.outer(self._masses, self._masses))
        return np.eye(len(unit)), damping.X11 / unit, self._condensed(self._blocks(K)) / unit

    def _condensed(self, K: _Blocks) -> Array:
        """The stiffness D1 L (n1, n1) of the slow motions, by fixed-point iteration for X.

        K: the blocks of the stiffness matrix. `cancelled` is raised to what cancels in K11 - K12 X.
        """
        condition = float(np.linalg.cond(equilibrated(K.X22)))
        # half of the digits are left; where the sign changes a light coordinate begins to grow
        _require(condition < 1e8 and np.linalg.slogdet(K.X22)[0] == self._sign_of_det_K22)
        X = np.linalg.solve(K.X22, K.X21)
        for _ in range(60):
            with np.errstate(over="ignore", invalid="ignore"):
                L = (K.X11 - K.X12 @ X) / self._masses[:, None]
                inertia = self._light_masses[:, None] * (X @ L)
            _require(np.isfinite(inertia).all())  # it diverges
            before = X
            X = np.linalg.solve(K.X22, K.X21 + inertia)
            if np.abs(X - before).max() <= 4 * EPS * np.abs(X).max():
                break
        else:
            _require(False)  # it does not converge
        condensed = K.X11 - K.X12 @ X
        terms = np.abs(K.X11) + np.abs(K.X12) @ np.abs(X)
        # not as a share of what is left, which may vanish
        cancelled = float((terms - np.abs(condensed)).max() / self._masses[-1])
        self.cancelled = max(self.cancelled, cancelled)
        amplification = len(self._M) * condition * float(self._masses[-1] / self._masses[0])
        self.error_amplification = max(self.error_amplification, amplification)
        return condensed
