"""Friction as a feedback gain: the loop from friction force to normal reaction.

With K(mu) = K0 + mu b c' the reaction varies by r = c' q, the friction force by mu r, and the
motion obeys M q'' + C q' + K0 q = -b (mu r). The plant G = c' (s^2 M + s C + K0)^-1 b, closed by
negative feedback of gain mu, has the system's eigenvalues as poles: its root locus is the mu-locus
and its gain margin the critical friction. That needs a friction term of rank one.

Its thresholds are those of the system K0 + mu b c', see `thresholds`. With damping they are the
gain margins that python-control computes; the response of an undamped plant is real at all
frequencies, so that such margins are rounding noise there.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from squeal.errors import ComputationError
from squeal.linear.eigen import GROWING, verdict
from squeal.linear.events import Crossing
from squeal.linear.matrices import EPS, Array
from squeal.linear.system import System, Term, TermSystem, check_range, check_system, matrices_at
from squeal.linear.thresholds import crossings
from squeal.numerics.differentiation import Formula

if TYPE_CHECKING:
    from control import StateSpace


def state_matrices(M: Array, C: Array, K: Array) -> tuple[Array, Array]:
    """A (2n, 2n) of the states (q, q') of M q'' + C q' + K q = f, and B (2n, n) of the forces f."""
    n, eye, zero = len(M), np.eye(len(M)), np.zeros(np.shape(M))
    lower = np.linalg.solve(M, np.hstack([-K, -C, eye]))
    return np.block([[zero, eye], [lower[:, : 2 * n]]]), np.vstack([zero, lower[:, 2 * n :]])


@dataclass(frozen=True, eq=False)
class FrictionLoop:
    """M q'' + C q' + K0 q = -b u, r = c q: plant from friction force u to normal reaction r."""

    M: Array = field(repr=False)
    C: Array = field(repr=False)
    K0: Array = field(repr=False)
    b: Array = field(repr=False)  # (n,) where the friction force acts
    c: Array = field(repr=False)  # (n,) reaction per displacement

    @property
    def plant(self) -> StateSpace:
        """The plant as control.StateSpace, states (q, q'), input u (N), output r (N)."""
        import control

        A, B = state_matrices(self.M, self.C, self.K0)
        output = np.concatenate([self.c, np.zeros(len(self.M))])[None, :]
        names = {"inputs": ["friction force"], "outputs": ["normal reaction"]}
        return control.ss(A, B @ self.b[:, None], output, 0.0, name="friction loop", **names)

    def closed(self, mu: float) -> StateSpace:
        """The loop closed with gain mu: its poles are the system's eigenvalues."""
        import control

        return control.feedback(self.plant, mu)

    def thresholds(self, mu_max: float) -> list[Crossing]:
        """All mu in (0, mu_max] at which a pole enters or leaves the right half plane, sorted."""
        terms = (Term(self.K0), Term(np.outer(self.b, self.c), Formula("mu")))
        damping = (Term(self.C),) if self.C.any() else ()
        points = crossings(TermSystem((Term(self.M),), damping, terms), mu_max)
        return [c for c in points if c.mu]

    def critical_friction(self, mu_max: float = 2.0) -> Crossing | None:
        """The gain margin: the first threshold in (0, mu_max] at which a pole starts to grow.

        None if there is none. Raises ComputationError where the loop grows from mu = 0 on, so
        that it has no gain margin.
        """
        points = self.thresholds(mu_max)
        first = points[0].mu if points else mu_max
        start = verdict(self.M, self.C, self.K0 + first / 2 * np.outer(self.b, self.c))
        if start in GROWING:
            raise ComputationError(
                f"the loop has no gain margin: it grows from mu = 0 on ({start})"
            )
        return next((point for point in points if point.direction == "up"), None)


@dataclass(frozen=True)
class LoopAnswer:
    """A friction loop, or None and the reason why there is none."""

    loop: FrictionLoop | None
    reason: str


def friction_loop(
    system: System, mu_max: float = 1.0, reaction: ArrayLike | None = None
) -> LoopAnswer:
    """The friction loop of system(mu) -> (M, C, K), if it has one.

    It has one where M and C do not depend on mu and K = K0 + mu K1 with K1 of rank one, examined
    at a few values up to `mu_max`. `reaction` (n,) is the known gradient of the normal reaction
    by the coordinates; without it c has unit length and the plant's output is the reaction but
    for a factor.

    Examples
    --------
    >>> K = lambda mu: np.array([[2.0, -1.0 + 4 * mu / 3], [-1.0, 2.0]])
    >>> loop = friction_loop(lambda mu: (np.eye(2), None, K(mu))).loop
    >>> print(loop.critical_friction())
    flutter up at mu = 0.75, 0.225079 Hz
    """
    check_system(system, "friction_loop")
    check_range("friction_loop", 0.0, mu_max)
    M, C, K0 = _arrays(system, 0.0)
    at = [_arrays(system, x * mu_max) for x in (1.0, 0.37)]
    K1 = (at[0][2] - K0) / mu_max
    if not all(_same(M, other[0]) for other in at):
        return LoopAnswer(None, "the mass matrix depends on mu")
    if not all(_same(C, other[1]) for other in at):
        return LoopAnswer(None, "the damping matrix depends on mu")
    if not _same(K0 + 0.37 * mu_max * K1, at[1][2]):
        return LoopAnswer(None, "the stiffness matrix is not linear in mu")
    unit = 1.0 / np.sqrt(np.diag(M))  # without it the rank would depend on the units
    U, singular, rows = np.linalg.svd(unit[:, None] * K1 * unit)
    least = EPS ** (2 / 3)  # of what counts for a rank: K1 is a difference
    if singular[0] <= least * np.linalg.norm(unit[:, None] * K0 * unit, 2) / mu_max:
        return LoopAnswer(None, "the stiffness matrix does not depend on mu")
    if len(singular) > 1 and singular[1] > least * singular[0]:
        ratio = singular[1] / singular[0]
        return LoopAnswer(
            None,
            f"the friction term is not of rank one (second singular value {ratio:.2g} of the "
            "first): friction closes more than one loop",
        )
    b, c = singular[0] * U[:, 0] / unit, rows[0] / unit
    size = 1.0 / float(np.linalg.norm(c))
    if reaction is not None:
        given = np.asarray(reaction, dtype=float)
        size = float(given @ c) / float(c @ c)
        if not _same(size * c, given) or size == 0:
            return LoopAnswer(None, "the friction force does not follow the given reaction")
    return LoopAnswer(FrictionLoop(M, C, K0, b / size, c * size), "the friction term has rank one")


def _arrays(system: System, mu: float) -> tuple[Array, Array, Array]:
    M, C, K = matrices_at(system, mu)
    mass = np.asarray(M, dtype=float)
    return mass, np.zeros_like(mass) if C is None else np.asarray(C, float), np.asarray(K, float)


def _same(one: Array, other: Array) -> bool:
    return bool(np.abs(one - other).max() <= 1e-11 * max(np.abs(one).max(), np.abs(other).max()))
