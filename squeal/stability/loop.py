"""Friction as a feedback gain: the loop from friction force to normal reaction.

With K(mu) = K0 + mu b c' the reaction varies by r = c' q, the friction force by mu r, and the
motion obeys M q'' + C q' + K0 q = -b (mu r). The plant G = c' (s^2 M + s C + K0)^-1 b, closed by
negative feedback of gain mu, has the system's eigenvalues as poles: its root locus is the mu-locus
and its gain margin the critical friction. That needs a friction term of rank one.

Gain margins of python-control are computed from crossings of the negative real axis. For a plant
with damping they are the thresholds of this module. The response of an undamped plant is real at
all frequencies, so that it crosses nowhere and its margins there are rounding noise; thresholds
are then the double roots of the open loop's own polynomials in s^2: places where
mu = -den/num is stationary (breakaway points of the locus), and mu at s = 0.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.polynomial import polynomial as poly
from numpy.typing import ArrayLike

from squeal.stability.matrices import Array, Reduced, System, check_system, first_order, reduce

if TYPE_CHECKING:
    from control import StateSpace

RANK_TOLERANCE = 1e-10  # second over first singular value of the friction term


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

        n = len(self.M)
        lower = np.linalg.solve(self.M, np.hstack([-self.K0, -self.C, self.b[:, None]]))
        A = np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), lower[:, : 2 * n]])
        B = np.concatenate([np.zeros(n), lower[:, 2 * n]])[:, None]
        output = np.concatenate([self.c, np.zeros(n)])[None, :]
        names = {"inputs": ["friction force"], "outputs": ["normal reaction"]}
        return control.ss(A, B, output, 0.0, name="friction loop", **names)

    def closed(self, mu: float) -> StateSpace:
        """The loop closed with gain mu: its poles are the system's eigenvalues."""
        import control

        return control.feedback(self.plant, mu)

    def root_locus(self, mus: Iterable[float]) -> Any:
        """control.root_locus_map of the plant over the gains `mus` (`.loci`, `.gains`)."""
        import control

        return control.root_locus_map(self.plant, gains=np.array(list(mus), dtype=float))

    def thresholds(self, mu_max: float) -> list[float]:
        """All mu in (0, mu_max] at which the closed loop starts or ceases to grow."""
        return _thresholds(self, mu_max)

    def critical_friction(self, mu_max: float = 2.0) -> float | None:
        """The gain margin: least mu in (0, mu_max] at which the loop starts to grow, or None."""
        found = self.thresholds(mu_max)
        return found[0] if found else None


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
    """
    check_system(system, "friction_loop")
    M, C, K0 = _arrays(system, 0.0)
    at = [_arrays(system, x * mu_max) for x in (1.0, 0.37)]
    K1 = (at[0][2] - K0) / mu_max
    if not (_same(M, at[0][0]) and _same(M, at[1][0])):
        return LoopAnswer(None, "the mass matrix depends on mu")
    if not (_same(C, at[0][1]) and _same(C, at[1][1])):
        return LoopAnswer(None, "the damping matrix depends on mu")
    if not _same(K0 + 0.37 * mu_max * K1, at[1][2]):
        return LoopAnswer(None, "the stiffness matrix is not linear in mu")
    unit = 1.0 / np.sqrt(np.diag(M))  # without it the rank would depend on the units
    U, singular, rows = np.linalg.svd(unit[:, None] * K1 * unit)
    if singular[0] <= RANK_TOLERANCE * np.linalg.norm(unit[:, None] * K0 * unit, 2) / mu_max:
        return LoopAnswer(None, "the stiffness matrix does not depend on mu")
    if len(singular) > 1 and singular[1] > RANK_TOLERANCE * singular[0]:
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
    M, C, K = system(mu)
    mass = np.asarray(M, dtype=float)
    return mass, np.zeros_like(mass) if C is None else np.asarray(C, float), np.asarray(K, float)


def _same(one: Array, other: Array) -> bool:
    return bool(np.abs(one - other).max() <= 1e-11 * max(np.abs(one).max(), np.abs(other).max()))


def _resolvent(A: Array, b: Array, c: Array) -> tuple[Array, Array]:
    """det(x - A) and c' adj(x - A) b as rising polynomials in x (Faddeev and LeVerrier)."""
    n = len(A)
    den, num = np.zeros(n + 1), np.zeros(n)
    den[n], adjugate = 1.0, np.eye(n)
    for k in range(1, n + 1):
        num[n - k] = c @ adjugate @ b
        product = A @ adjugate
        den[n - k] = -np.trace(product) / k
        adjugate = product + den[n - k] * np.eye(n)
    return den, num


def _thresholds(loop: FrictionLoop, mu_max: float) -> list[float]:
    reduced = reduce(loop.M, loop.C, loop.K0)
    b, c = reduced.T.T @ loop.b, reduced.T.T @ loop.c
    if reduced.B is None:
        den, num, candidates = _undamped(reduced, b, c)
    else:
        den, num, candidates = _damped(reduced, b, c)
    edges = sorted({float(mu) for mu in candidates if 0 < mu <= mu_max})
    undamped = reduced.B is None
    found: list[float] = []
    growing = _grows(den, num, (edges[0] if edges else mu_max) / 2, undamped)
    for mu, after in itertools.pairwise([*edges, 1.001 * mu_max]):
        if after - mu <= 1e-12 * mu_max:
            continue
        now = _grows(den, num, (mu + after) / 2, undamped)
        if now != growing:
            found.append(mu)
        growing = now
    return found


def _undamped(reduced: Reduced, b: Array, c: Array) -> tuple[Array, Array, Array]:
    """Polynomials in x = -lambda^2 / scale, and mu at x = 0 and at the breakaway points."""
    scale = float(np.linalg.norm(reduced.A, 2)) or 1.0
    den, num = _resolvent(reduced.A / scale, b / scale, c)
    num = -num  # (K0 - x M) is the negative of (x - A): den + mu num = 0
    stationary = poly.polysub(
        poly.polymul(poly.polyder(den), num), poly.polymul(den, poly.polyder(num))
    )
    x = poly.polyroots(poly.polytrim(stationary, 1e-15 * np.abs(stationary).max()))
    # a double root of the loop need not be non-negative: pairs also part on the negative axis
    places = np.concatenate([[0.0], x.real[np.abs(x.imag) <= 1e-7]])
    return den, num, _gains(den, num, places)


def _damped(reduced: Reduced, b: Array, c: Array) -> tuple[Array, Array, Array]:
    """Polynomials in lambda / rate, and mu where a root lies on the imaginary axis."""
    assert reduced.B is not None
    matrix, rate = first_order(reduced.A, reduced.B)
    n = reduced.n
    force = np.concatenate([np.zeros(n), b / rate**2])
    den, num = _resolvent(matrix, force, np.concatenate([c, np.zeros(n)]))
    turn = 1j ** np.arange(2 * n + 1)
    on_axis: Array = poly.polymul(den * turn, np.conj(num * turn[: 2 * n])).imag  # in omega, odd
    omega = poly.polyroots(poly.polytrim(on_axis, 1e-14 * np.abs(on_axis).max()))
    real = omega.real[(np.abs(omega.imag) <= 1e-6) & (omega.real >= 0)]
    return den, num, _gains(den, num, 1j * np.concatenate([[0.0], real]))


def _gains(den: Array, num: Array, places: Array) -> Array:
    below = poly.polyval(places, num)
    usable = np.abs(below) > 1e-13 * np.abs(num).max()
    mu = -poly.polyval(places[usable], den) / below[usable]
    return np.asarray(mu.real)


def _grows(den: Array, num: Array, mu: float, undamped: bool) -> bool:
    roots = poly.polyroots(poly.polyadd(den, mu * num))
    if undamped:
        return bool(np.any(np.abs(roots.imag) > 1e-7) or np.any(roots.real < -1e-10))
    return bool(roots.real.max() > 1e-12)
