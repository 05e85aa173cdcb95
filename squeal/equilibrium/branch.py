"""Equilibrium branches over mu of many pads at once, continued by arc length through contact
changes and folds. A single pad is n = 1, so that queries, maps and curves follow the same branches.

Within a contact state a branch is smooth: a step is predicted by the tangent and its change,
corrected by Newton's method in the plane across the tangent, and halved where it turns too far or
where a gap or mu may have turned twice. Contact changes and folds are located to rounding.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from squeal.equilibrium.statics import WHY_HIDDEN, Statics, solve_stack
from squeal.model.equations import natural_units, net_loads
from squeal.model.pad import Coefficients, pose
from squeal.numerics import differentiation
from squeal.numerics.differentiation import STEP, Dual, with_derivative

NODE, CHANGE, FOLD = range(3)
"""Kinds of a node: a point of the branch, a change of contact, a smooth fold."""
GOING, REACHED, TURNS, LOST, AWAY, SEPARATED, TILTED, NOWHERE = range(8)
"""How a branch ends, see `Branches.end_of`; of NOWHERE there is no place without friction."""
UNITS = 4.0 * float(np.finfo(float).eps)  # by which each coefficient and each load may be off
OF_LOADS = ("k1", "k2", "k3", "k4", "k_c", "F_n")  # to each of which one load is proportional
Condition = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
"""A number (k,) at places (4, k) that has to vanish, and its derivative (4, k)."""


@dataclass(frozen=True)
class BranchOptions:
    """Tolerances of the continuation, in the pad's natural units.

    There the load displaces the contact by about one. The defaults follow the branches of random
    pads without loss; smaller steps cost time, larger ones risk a jump to another branch.
    """

    first_step: float = 0.25  # a quarter of the displacement under the load
    longest_step: float = 4.0  # four times it; it grows with the distance from the origin
    growth: float = 2.0  # of a step after one that was accepted; one that was not is halved
    shortest_step: float = 1e-10  # the branch is lost where even this fails
    cosine: float = 0.95  # least, between the tangents of a step: it turns by 18 degrees at most
    correction: float = 0.2  # largest, as a share of the step: farther off lies another branch
    most_steps: int = 4000
    farthest: float = 100.0  # free lengths of both springs: the equilibrium has run away
    tilt: float = math.pi / 2  # rad: there the lower face no longer faces the surface

    turned: float = 1e-3  # of a unit tangent between two steps: less may be rounding
    close: float = 1e-6  # of a step: what a place that was located may lie outside of it
    between: tuple[float, ...] = (1 / 6, 1 / 3, 1 / 2, 2 / 3, 5 / 6)  # where its cubic is checked
    # of a step before a fold: more nodes, since the place runs as a square root there
    to_fold: tuple[float, ...] = (0.1, 1e-2, 1e-3)


@dataclass(frozen=True, eq=False)
class Branches:
    """Nodes of the branches of n pads, those of one pad after each other from mu = 0 on.

    statics: of the pads; owner (m,): the pad of each node; z (4, m) = (x, y, w theta, mu) in its
    units; arrives, leaves (4, m): dz over arc length before and behind each node; touching
    (points, m): the contact state behind it; kind (m,): `NODE`, `CHANGE`, `FOLD`; end (n,): how
    each branch ends, the last node being where; first (n + 1,): index of the first node of each.
    """

    statics: Statics
    owner: np.ndarray
    z: np.ndarray
    arrives: np.ndarray
    leaves: np.ndarray
    touching: np.ndarray
    kind: np.ndarray
    end: np.ndarray

    @cached_property
    def first(self) -> np.ndarray:
        """Index of the first node of each pad, (n + 1,)."""
        return np.searchsorted(self.owner, np.arange(len(self.end) + 1))

    @cached_property
    def turns(self) -> np.ndarray:
        """Nodes (m,) at which mu turns back: smooth folds, and contact changes that do as much."""
        back = (self.kind == CHANGE) & (self.arrives[3] * self.leaves[3] < 0.0)
        return np.asarray(back | (self.kind == FOLD))

    @cached_property
    def last(self) -> np.ndarray:
        """Index (n,) of the last node up to which mu rises; first - 1 of a pad without nodes."""
        stop = self.first[1:] - 1
        last = stop.copy()
        for node in np.flatnonzero(self.turns)[::-1]:  # of several the first counts
            last[self.owner[node]] = node
        return last

    @cached_property
    def mu_end(self) -> np.ndarray:
        """The largest mu (n,) of the part that rises from 0; NaN without a place of rest."""
        there = self.first[1:] > self.first[:-1]
        if not self.z.size:
            return np.full(len(self.end), np.nan)
        return np.where(there, self.z[3][np.minimum(self.last, self.z.shape[1] - 1)], np.nan)

    @cached_property
    def _mus(self) -> np.ndarray:
        """mu (n, k) of the nodes up to the first fold, infinite behind them."""
        count = self.last - self.first[:-1] + 1
        mus = np.full((len(count), max(int(count.max(initial=0)), 1)), np.inf)
        inside = np.arange(mus.shape[1]) < count[:, None]
        index = self.first[:-1][:, None] + np.arange(mus.shape[1])
        mus[inside] = self.z[3][index[inside]]
        return mus

    @cached_property
    def sides(self) -> np.ndarray:
        """The signs (n,) of the balance's determinant at mu = 0, which stay up to the first fold;
        0 without a place of rest."""
        sides, at = np.zeros(len(self.end)), np.flatnonzero(self.first[1:] > self.first[:-1])
        start = self.first[:-1][at]
        J = self.statics.pick(at).linearised(self.z[:, start], 1.0 * self.touching[:, start], 3)[1]
        sides[at] = np.sign(np.linalg.det(np.moveaxis(J, -1, 0)))
        return sides

    def at(
        self, pad: np.ndarray, mu: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """The equilibria of pads (k,) at mu (k,) on the part that rises from 0.

        Returns places (4, k), contact states (points, k), at a change the new one, the signs (k,)
        of the balance's determinant, and where (k,) there is an equilibrium: nowhere beyond
        `mu_end`.
        """
        mus, sides = self._mus, self.sides
        j = np.maximum((mus[pad] <= mu[:, None]).sum(axis=1) - 1, 0)
        reached = (mu >= 0.0) & (mu <= np.where(np.isnan(self.mu_end), -1.0, self.mu_end)[pad])
        j = np.minimum(self.first[pad] + j, self.z.shape[1] - 1)
        z = self._between(pad, j, mu)
        touching = self.touching[:, j]
        exact = self.z[3][j] == mu
        z[:, exact] = self.z[:, j[exact]]
        side, go = sides[pad].copy(), np.flatnonzero(reached & ~exact)
        guess, part = z[:, go], self.statics.pick(pad[go])
        root = guess.copy()
        side[go] = part.settle(root, 1.0 * touching[:, go], 12)
        # across a fold the sign differs; other branches lie farther off
        nodes = self.z[:, j[go]], self.z[:, np.minimum(j[go] + 1, self.z.shape[1] - 1)]
        near = np.abs(root - guess).max(axis=0) <= np.abs(nodes[1] - nodes[0]).max(axis=0)
        good = near & (side[go] == sides[pad[go]])
        # within rounding of a fold the balance is singular, and the cubic as good as it gets
        at_fold = self.turns[np.minimum(j[go] + 1, self.z.shape[1] - 1)]
        close = at_fold & (nodes[1][3] - mu[go] <= 1e-8 * nodes[1][3])
        z[:, go] = np.where(good, root, guess)
        there = reached.copy()
        there[go] = good | close
        for i in go[~there[go]]:  # a component runs far ahead of the others
            one = np.array([i])
            branch = follow(
                self.statics.pick(pad[one]), self.z[:, j[one]], touching[:, one], mu[one]
            )
            met = (branch.end[0] == REACHED) & (branch.touching[:, -1] == touching[:, i]).all()
            z[:, i], there[i] = np.where(met, branch.z[:, -1], z[:, i]), met
        return z, touching, np.where(there, sides[pad], 0.0), there

    def _between(self, pad: np.ndarray, j: np.ndarray, mu: np.ndarray) -> np.ndarray:
        """Places (4, k) near the equilibria at mu (k,) between nodes j and j + 1 of the pads, by
        the cubic in mu, or in the root of the distance from a fold at which they end."""
        k = np.minimum(j + 1, self.z.shape[1] - 1)
        stop = self.last[pad]
        fold = np.where(self.kind[stop] == FOLD, self.z[3][stop], np.nan)
        root = np.isfinite(fold)

        def by(at: np.ndarray) -> np.ndarray:
            return np.where(root, -np.sqrt(np.maximum(fold - at, 0.0)), at)

        s, low, high = by(mu), by(self.z[3][j]), by(self.z[3][k])
        width = np.where(high > low, high - low, 1.0)
        t = np.clip((s - low) / width, 0.0, 1.0)
        with np.errstate(all="ignore"):
            rate = [np.where(root, -2.0 * at, 1.0) * width for at in (low, high)]
            start, end = self.leaves[:, j], self.arrives[:, k]
            start, end = start / start[3] * rate[0], end / end[3] * rate[1]
            chord = self.z[:, k] - self.z[:, j]
            end = np.where(np.isfinite(end).all(axis=0) & (high != 0.0), end, 2 * chord - start)
            z = cubic(self.z[:, j], self.z[:, k], start, end, t)
        z[3] = mu
        return z

    def error(self, node: int) -> float:
        """How far rounding may move the mu of a contact change or fold; 0 of other nodes.

        Rounding of each coefficient moves all conditions together, that of each load one by one.
        """
        if self.kind[node] == NODE:
            return 0.0
        part, z = self.statics.pick(self.owner[node : node + 1]), self.z[:, node : node + 1]
        law, before = part.model.law, 1.0 * self.touching[:, node - 1 : node]
        changed = np.flatnonzero(self.touching[:, node - 1] != self.touching[:, node])
        left, J = (a[..., 0] for a in part.linearised(z, before))
        left = np.concatenate([left, part.gaps(z)[changed, 0]])
        J = np.concatenate([J, *(part.gap_derivatives(z, np.array([i])).T for i in changed)])
        # at a fold three conditions do: along the branch mu is stationary
        by = np.linalg.lstsq(J.T, np.eye(4)[3])[0]
        size = np.array([float(np.ravel(v)[0]) for v in part.model.c._replace(mu=z[3])])
        shifted = Coefficients(*(size[:, None] * (1.0 + 1j * STEP * np.eye(size.size))))
        q = shifted.place(z.astype(complex))
        f = net_loads(np, shifted, law, q, before[:, 0])
        gaps = law.gaps(shifted, pose(np, q))
        rows = f.x, f.y, f.moment / np.ravel(part.model.pad.w)[0], *(gaps[i] for i in changed)
        rates = np.imag(np.broadcast_arrays(*rows)) / STEP
        loads = rates[:, [Coefficients._fields.index(name) for name in OF_LOADS]]
        shift = np.abs(by @ rates).sum() + (np.abs(by) @ np.abs(loads)).sum()
        return float(UNITS * shift + abs(by @ left) + np.spacing(z[3, 0]))

    def end_of(self, pad: int) -> str:
        """Why the branch of a pad stops, in words."""
        start, stop = self.first[pad], self.first[pad + 1]
        if start == stop:
            return NO_START
        z = self.z[:, stop - 1]
        mu, turns = float(z[3]), np.flatnonzero(self.turns[start:stop])
        hidden = self.statics.pick(self.owner[start : start + 1]).hidden(z[:, None]).any()
        why = f": {WHY_HIDDEN}" if hidden else ""
        highest = f" at mu = {self.z[3, start + turns].max():.9g}" if turns.size else ""
        return {
            REACHED: f"mu = {mu:.9g} is reached" if mu else "mu = 0",
            TURNS: f"the branch from mu = 0 turns back in a fold{highest}",
            LOST: f"the branch from mu = 0 is lost at mu = {mu:.9g}{why}",
            AWAY: f"the equilibrium runs away to infinity near mu = {mu:.9g}",
            SEPARATED: f"contact is lost at mu = {mu:.9g}",
            TILTED: f"the pad turns past 90 degrees on the branch at mu = {mu:.9g}",
        }[int(self.end[pad])]


NO_START = "without friction the pad has no place of rest where the surfaces press on each other"


def follow(
    statics: Statics,
    z: np.ndarray,
    touching: np.ndarray,
    mu_max: np.ndarray,
    options: BranchOptions | None = None,
    rising: bool = True,
    there: np.ndarray | None = None,
) -> Branches:
    """Continue equilibria without friction until mu first reaches mu_max.

    Parameters
    ----------
    statics
        Of n pads, some parameters of which are arrays (n,).
    z : (4, n)
        (x, y, w theta, 0) of each pad in the units of `statics`.
    touching : (points, n)
        The contact state of each, numbers 0 and 1 or bools.
    mu_max : (n,)
        Where to stop, at least 0.
    rising
        Stop at the first fold; otherwise follow the branch through all folds.
    there : (n,)
        Pads that have a place of rest; all if left out.
    """
    walk = _Walk(statics, z, touching, mu_max, options or BranchOptions(), rising, there)
    return walk.run()


def cubic(
    a: np.ndarray, b: np.ndarray, start: np.ndarray, end: np.ndarray, s: np.ndarray
) -> np.ndarray:
    """The cubic from a to b with these derivatives by its share s at both ends."""
    chord = b - a
    bend = (start - chord) * (1.0 - s) - (end - chord) * s
    return np.asarray(a + chord * s + s * (1.0 - s) * bend)


def along(J: np.ndarray, row: np.ndarray) -> np.ndarray:
    """Null vectors (4, k) of J (3, 4, k) with row . v = 1."""
    A = np.concatenate([np.moveaxis(J, -1, 0), row.T[:, None, :]], axis=1)
    return np.asarray(solve_stack(A, np.tile(np.eye(4)[:, 3:], (len(A), 1, 1)))[0][:, :, 0].T)


def _unit(v: np.ndarray) -> np.ndarray:
    with np.errstate(all="ignore"):
        return np.asarray(v / np.sqrt((v * v).sum(axis=0)))


def _plane(row: np.ndarray, value: np.ndarray) -> Condition:
    return lambda z: ((row * z).sum(axis=0) - value, row)


class _Ends(NamedTuple):
    """Present ends of k branches, arrays over them: statics, place, contact state, unit vector
    ahead, length of the step, scale; vectors and lengths are those of `scale` z."""

    part: Statics
    z: np.ndarray
    state: np.ndarray
    ahead: np.ndarray
    step: np.ndarray
    scale: np.ndarray

    def pick(self, i: np.ndarray) -> _Ends:
        return _Ends(self.part.pick(i), *(a[..., i] for a in self[1:]))

    def cubic(self, new: np.ndarray, turn: np.ndarray, s: np.ndarray) -> np.ndarray:
        """Places (4, k) at shares s of the way to new places with unit tangents `turn`."""
        length = np.sqrt((((new - self.z) * self.scale) ** 2).sum(axis=0))
        start, end = length * self.ahead / self.scale, length * turn / self.scale
        return cubic(self.z, new, start, end, s)

    def within(self, new: np.ndarray, met: np.ndarray, o: BranchOptions) -> np.ndarray:
        """Where places (4, k) that were located lie between the present ones and new ones."""
        way, whole = (
            (self.ahead * (p - self.z) * self.scale).sum(axis=0) / self.step for p in (met, new)
        )
        far = np.sqrt((((met - self.z) * self.scale) ** 2).sum(axis=0)) / self.step
        inside = (way >= -o.close) & (way <= whole + o.close)
        return np.asarray(inside & (far <= way / o.cosine + o.close))

    def tangents(self, z: np.ndarray, state: np.ndarray) -> np.ndarray:
        """Unit tangents (4, k) at places in contact states, oriented ahead."""
        J = self.part.linearised(z, 1.0 * state)[1] / self.scale
        t = np.array([np.linalg.det(np.moveaxis(np.delete(J, c, axis=1), -1, 0)) for c in range(4)])
        t = _unit(t * np.array([1.0, -1.0, 1.0, -1.0])[:, None])
        return np.asarray(np.nan_to_num(t * np.sign((t * self.ahead).sum(axis=0))))

    def opening(self, z: np.ndarray, turn: np.ndarray, point: np.ndarray) -> np.ndarray:
        """Rates (k,) at which the gap of a contact point opens along unit tangents."""
        return np.asarray((self.part.gap_derivatives(z, point) * turn / self.scale).sum(axis=0))

    def corrected(
        self, start: np.ndarray, condition: Condition, fine: bool = False
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Newton's method on the balance and one more condition: places (4, k), the derivative
        (3, 4, k) of the balance there, and where it converged.

        The last step is small beside the penetration, beyond which its square is left; with `fine`
        it goes on down to rounding.
        """
        touching = 1.0 * self.state

        def conditions(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            (f, J), (value, row) = self.part.linearised(z, touching), condition(z)
            return np.concatenate([f, value[None]]), np.concatenate([J, row[None]])

        z, J, good = _newton(
            conditions, start, 1.0 / self.scale[0], None if fine else self.part.deepest
        )
        return z, J[:3], good

    def fold(self, new: np.ndarray, turn: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where mu is stationary on the way to new places, and where (k,) that was located.

        Newton's method on z and v: the loads F vanish and F_q v = 0, v being normalised.
        """
        part, on = self.part, 1.0 * self.state
        mean = np.clip(self.ahead[3] / (self.ahead[3] - turn[3]), 0.0, 1.0)
        guess = self.cubic(new, turn, mean)
        J = np.nan_to_num(np.moveaxis(part.linearised(guess, on, 3)[1], -1, 0))
        start = np.linalg.svd(J)[2][:, 2].T

        def stiffness_along(z: np.ndarray, v: np.ndarray) -> np.ndarray:
            c = part.model.c._replace(mu=z[3])
            q = tuple(map(Dual, part.place(z), part.place(v)))
            f = net_loads(differentiation, c, part.model.law, q, on)  # type: ignore[arg-type]
            each = (f.x, f.y, f.moment / part.model.pad.w)
            return np.array(np.broadcast_arrays(*(load.slope + 0.0 * z[0] for load in each)))

        def conditions(u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            z, v = u[:4], u[4:]
            f, J = part.linearised(z, on)
            # shapes (4, 1, k) and (3, 1, k): all directions of the complex step at once
            along_v, bend = with_derivative(lambda z: stiffness_along(z, v[:, None]), z)
            slope = np.zeros((7, 7, z.shape[1]))
            slope[:3, :4], slope[3:6, :4], slope[3:6, 4:] = J, bend, J[:, :3]
            slope[6, 4:] = start
            return np.concatenate([f, along_v, [(start * v).sum(axis=0) - 1.0]]), slope

        u, _, good = _newton(conditions, np.concatenate([guess, start]), 1.0 / self.scale[0])
        return u[:4], good


def _newton(
    conditions: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]],
    start: np.ndarray,
    unit: np.ndarray,
    deepest: Callable[[np.ndarray], np.ndarray] | None = None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Zeros (m, k) of the conditions, their derivative before the last step, and where it
    converged: to rounding beside the `unit` (k,) of the places, or to a share of a depth."""
    x, last = start.copy(), np.full(start.shape[1], np.inf)
    good = np.zeros(start.shape[1], dtype=bool)
    for _ in range(15):
        with np.errstate(all="ignore"):
            value, slope = conditions(x)
            step, regular = solve_stack(np.moveaxis(slope, -1, 0), value.T[:, :, None])
            move = np.where(good, 0.0, step[:, :, 0].T)
            x = x - move
            change = np.max(np.abs(move), axis=0)
            far = unit + np.max(np.abs(x[:3]), axis=0)
            deep = 0.0 if deepest is None else 1e-5 * np.clip(deepest(x), 0.0, far)
            met = (change <= np.maximum(deep, 4e-15 * far)) | (
                (change >= last) & (change <= 1e-6 * far)
            )
        good |= met & regular
        last = change
        if good.all() or not np.isfinite(change[~good]).any():
            break
    return x, slope, good & np.isfinite(x).all(axis=0)


@dataclass
class _Step:
    """Steps that were tried, arrays over the pads that go: new places, tangents there in the old
    contact state, the contact point that changes there (-1: none), folds on the way."""

    good: np.ndarray
    z: np.ndarray
    turn: np.ndarray
    point: np.ndarray
    folds: np.ndarray
    fold: np.ndarray


@dataclass
class _Walk:
    """The present ends of n branches: place z, contact state, unit vector ahead and its change over
    arc length, length of a step. Lengths and vectors are those of `scale` z, natural units of each
    pad; mu counts as what it displaces at the start."""

    statics: Statics
    z: np.ndarray
    touching: np.ndarray
    mu_max: np.ndarray
    options: BranchOptions
    rising: bool
    there: np.ndarray | None
    nodes: list[tuple[np.ndarray, ...]] = field(default_factory=list)

    def __post_init__(self) -> None:
        n, o = self.z.shape[1], self.options
        self.z, self.touching = self.z.copy(), np.array(self.touching, dtype=bool)
        own = natural_units(self.statics.model, (0.0,) * 6).length
        self.scale = np.ones((4, n))
        self.scale[:3] /= own
        there = np.ones(n, dtype=bool) if self.there is None else self.there
        self.end = np.where(there, np.where(self.mu_max > 0.0, GOING, REACHED), NOWHERE)
        self.end[(self.end == GOING) & self.statics.hidden(self.z)] = LOST
        self.active = np.flatnonzero(self.end == GOING)
        J = self.statics.linearised(self.z, 1.0 * self.touching)[1]
        row = np.zeros((4, n))
        row[3] = 1.0  # dz/dmu: without friction no branch turns back
        ahead = along(J, row) * self.scale
        moves = np.sqrt((ahead[:3] ** 2).sum(axis=0))
        self.scale[3] = np.where(np.isfinite(moves), np.maximum(moves, 1e-3), 1.0)
        ahead[3] = self.scale[3]
        self.ahead = np.nan_to_num(_unit(ahead))
        self.bend = np.zeros((4, n))
        far = np.max(np.abs(self.z[:3] * self.scale[:3]), axis=0)
        self.step = np.maximum(o.first_step, 1e-6 * far)
        self.arriving = self.ahead.copy()
        self._record(np.flatnonzero(there), NODE)

    def _ends(self, who: np.ndarray) -> _Ends:
        arrays = (self.z, self.touching, self.ahead, self.step, self.scale)
        return _Ends(self.statics.pick(who), *(a[..., who] for a in arrays))

    def _record(self, who: np.ndarray, kind: int, *at: np.ndarray) -> None:
        """Append nodes of the pads `who`: their present places, or others (4, k) with the unit
        tangents there."""
        place, arrives = at or (self.z[:, who], self.arriving[:, who])
        leaves = at[1] if at else self.ahead[:, who]
        scale, kinds = self.scale[:, who], np.full(who.size, kind)
        self.nodes.append(
            (who, place, arrives / scale, leaves / scale, self.touching[:, who], kinds)
        )

    def run(self) -> Branches:
        """All steps, and the nodes sorted by pad."""
        for _ in range(self.options.most_steps):
            if not self.active.size:
                break
            self._advance()
            self.active = self.active[self.end[self.active] == GOING]
        self.end[self.active] = LOST
        whole = [np.concatenate(part, axis=-1) for part in zip(*self.nodes, strict=True)]
        order = np.argsort(whole[0], kind="stable")
        who, z, arrives, leaves, touching, kind = (part[..., order] for part in whole)
        return Branches(self.statics, who, z, arrives, leaves, touching, kind, self.end)

    def _advance(self) -> None:
        """One step of every pad that goes on, or half of it where it was too long."""
        who = self.active
        ends = self._ends(who)
        taken = self._tried(ends, self.bend[:, who])
        self._finish(ends, who, taken)
        failed = who[~taken.good & (self.end[who] == GOING)]
        self.step[failed] /= 2
        self.end[failed[self.step[failed] < self.options.shortest_step]] = LOST
        i = np.flatnonzero(taken.good)
        if i.size:
            self._accept(ends, who, taken, i)

    def _accept(self, ends: _Ends, who: np.ndarray, taken: _Step, i: np.ndarray) -> None:
        """Go on to the places of the steps i that were taken."""
        o = self.options
        folded = i[taken.folds[i]]
        if folded.size:
            self._to_fold(ends.pick(folded), who[folded], taken.fold[:, folded])
            if self.rising:
                self.end[who[folded]] = TURNS
                i = i[~taken.folds[i]]
        own, new, turn = who[i], taken.z[:, i], taken.turn[:, i]
        step, turned = ends.step[i], turn - ends.ahead[:, i]
        smooth = (taken.point[i] < 0) & (np.max(np.abs(turned), axis=0) > o.turned)
        self.bend[:, own] = np.where(smooth, turned / step, 0.0)
        self.z[:, own], self.arriving[:, own], self.ahead[:, own] = new, turn, turn
        far = np.max(np.abs(new * ends.scale[:, i]), axis=0)
        self.step[own] = np.minimum(o.growth * step, o.longest_step * (1.0 + 0.1 * far))
        changed = taken.point[i] >= 0
        if changed.any():
            self._change(own[changed], taken.point[i][changed])
        self._record(own[~changed], NODE)
        back = (new[3] < 0.0) & (new[3] < ends.z[3, i])
        if self.rising:
            back |= (self.ahead[3, own] < 0.0) & (self.arriving[3, own] > 0.0)
        pad = ends.part.model.pad
        limit = o.farthest * np.broadcast_to(pad.L1 + pad.L2, who.shape)[i]
        away = np.max(np.abs(new[:2]), axis=0) > limit
        hidden = ends.part.pick(i).hidden(new)
        for which, why in ((back, TURNS), (away, AWAY), (hidden, LOST)):
            self.end[own[which & (self.end[own] == GOING)]] = why

    def _tried(self, ends: _Ends, bend: np.ndarray) -> _Step:
        """A step of each pad, and whether it may be taken."""
        o, (part, z, state, ahead, step, scale) = self.options, ends
        guess = z + step * ahead / scale
        row = ahead * scale
        start = guess + step**2 / 2 * bend / scale
        new, J, good = ends.corrected(start, _plane(row, (row * guess).sum(axis=0)))
        with np.errstate(all="ignore"):
            off = np.sqrt((((new - guess) * scale) ** 2).sum(axis=0))
            good &= off <= o.correction * step
            turn = _unit(along(J, row) * scale)
            good &= (turn * ahead).sum(axis=0) >= o.cosine
        taken = _Step(good, new, turn, np.full(step.size, -1), np.zeros_like(good), new.copy())
        wrong = part.wrong(new, state) & good
        i = np.flatnonzero(wrong.any(axis=0))
        if i.size:
            self._locate_change(ends.pick(i), taken, i, wrong[:, i])
        taken.folds = taken.good & (np.sign(taken.turn[3]) != np.sign(ahead[3]))
        i = np.flatnonzero(taken.folds)
        if i.size:
            at = ends.pick(i)
            taken.fold[:, i], met = at.fold(taken.z[:, i], taken.turn[:, i])
            taken.good[i] = met & at.within(taken.z[:, i], taken.fold[:, i], o)
        self._look_between(ends, taken)
        return taken

    def _locate_change(self, ends: _Ends, taken: _Step, i: np.ndarray, wrong: np.ndarray) -> None:
        """The first contact change within each of the steps i, which then end there."""
        part, each, new = ends.part, np.arange(i.size), taken.z[:, i]
        before, after = part.gaps(ends.z), part.gaps(new)
        with np.errstate(all="ignore"):
            share = np.clip(before / (before - after), 0.0, 1.0)
        first = np.argmin(np.where(wrong, share, np.inf), axis=0)
        sign = np.where(ends.state[first, each], -1.0, 1.0)
        start = ends.cubic(new, taken.turn[:, i], np.nan_to_num(share[first, each]))
        met, _, good = ends.corrected(
            start, lambda z: (part.gaps(z)[first, each], part.gap_derivatives(z, first)), fine=True
        )
        others = part.wrong(met, ends.state)
        others[first, each] = False
        turn = ends.tangents(met, ends.state)
        # the gap has to pass zero along the branch
        passes = sign * ends.opening(met, turn, first) < 0.0
        good &= ends.within(new, met, self.options) & ~others.any(axis=0) & passes
        taken.good[i], taken.z[:, i], taken.turn[:, i], taken.point[i] = good, met, turn, first

    def _look_between(self, ends: _Ends, taken: _Step) -> None:
        """Refuse steps within which a gap may pass zero twice, or mu turn twice."""
        i = np.flatnonzero(taken.good)
        if not i.size:
            return
        if i.size < taken.good.size:
            ends = ends.pick(i)
        new, turn = taken.z[:, i], taken.turn[:, i]
        between = [ends.cubic(new, turn, np.asarray(s)) for s in self.options.between]
        bad = np.any([ends.part.wrong(z, ends.state).any(axis=0) for z in between], axis=0)
        mus = np.array([z[3] for z in (ends.z, *between, new)])
        twice = np.any(np.diff(mus, axis=0) * turn[3] < 0.0, axis=0)
        taken.good[i] &= ~(bad | (twice & ~taken.folds[i]))

    def _to_fold(self, ends: _Ends, who: np.ndarray, end: np.ndarray) -> None:
        """Record the folds at places (4, k), with nodes close before them."""
        tangent = ends.tangents(end, ends.state)
        tangent[3] = 0.0
        row = tangent * ends.scale
        for back in self.options.to_fold:
            guess = ends.cubic(end, tangent, np.asarray(1.0 - back))
            met, J, good = ends.corrected(guess, _plane(row, (row * guess).sum(axis=0)))
            k = np.flatnonzero(good & (met[3] < end[3]) & (met[3] > ends.z[3]))
            self._record(who[k], NODE, met[:, k], _unit(along(J, row) * ends.scale)[:, k])
        self._record(who, FOLD, end, tangent)

    def _change(self, who: np.ndarray, point: np.ndarray) -> None:
        """Go over to the new contact states; the branch ends where nothing touches any more."""
        new = self.touching[:, who]
        new[point, np.arange(who.size)] ^= True
        left = np.flatnonzero(new.any(axis=0))
        gone = who[~new.any(axis=0)]
        self._record(gone, NODE)
        self.end[gone] = SEPARATED
        if not left.size:
            return
        who, new, point = who[left], new[:, left], point[left]
        ends = self._ends(who)
        turn = ends.tangents(ends.z, new)
        opens = np.where(new[point, np.arange(who.size)], -1.0, 1.0)
        self.touching[:, who] = new
        self.ahead[:, who] = turn * np.sign(opens * ends.opening(ends.z, turn, point))
        self.bend[:, who] = 0.0
        self._record(who, CHANGE)

    def _finish(self, ends: _Ends, who: np.ndarray, taken: _Step) -> None:
        """End branches that reach mu_max, or turn past 90 degrees, within a step that was taken."""
        pad, limit = ends.part.model.pad, self.options.tilt
        mu, tilt = self.mu_max[who], ends.part.tilt(taken.z)
        upright = np.broadcast_to(pad.w * (np.copysign(limit, tilt) - pad.theta0), tilt.shape)
        # a fold may lie beyond, at which mu is stationary
        before = taken.folds & (taken.fold[3] > mu)
        to, turn = np.where(before, taken.fold, taken.z), taken.turn.copy()
        if (b := np.flatnonzero(before)).size:
            at = ends.pick(b)
            turn[:, b] = at.tangents(to[:, b], at.state)
            turn[3, b] = 0.0
        for component, target, over, why in (
            (2, upright, np.abs(tilt) >= limit, TILTED),
            (3, mu, (taken.z[3] >= mu) | before, REACHED),
        ):
            i = np.flatnonzero(taken.good & over & (self.end[who] == GOING))
            if not i.size:
                continue
            ended = self._end_at(ends.pick(i), who[i], component, target[i], to[:, i], turn[:, i])
            self.end[who[i[ended]]] = why
            # a shorter step where that was not met; mu_max may lie before 90 degrees
            missed = i[~ended]
            taken.good[missed] = (component == 2) & (taken.z[3, missed] >= mu[missed])
        taken.good &= self.end[who] == GOING

    def _end_at(
        self,
        ends: _Ends,
        who: np.ndarray,
        component: int,
        target: np.ndarray,
        to: np.ndarray,
        turn: np.ndarray,
    ) -> np.ndarray:
        """Move ends to where a component of z has its target on the way to places (4, k), and
        record them; returns where (k,) that was met."""
        row = np.zeros(to.shape)
        row[component] = 1.0
        sign = np.sign(target - ends.z[component])
        low, high = np.zeros(who.size), np.ones(who.size)
        for _ in range(30):  # where the cubic has it first
            s = (low + high) / 2
            guess = ends.cubic(to, turn, s)
            past = sign * (guess[component] - target) > 0.0
            high, low = np.where(past, s, high), np.where(past, low, s)
        met, J, good = ends.corrected(guess, _plane(row, target), fine=True)
        good &= ~ends.part.wrong(met, ends.state).any(axis=0) & (met[3] <= self.mu_max[who])
        good &= ends.within(to, met, self.options)
        met[component] = target
        k = np.flatnonzero(good)
        tangent = _unit(along(J, row)[:, k] * ends.scale[:, k])
        tangent = tangent * np.sign((tangent * ends.ahead[:, k]).sum(axis=0))
        own = who[k]
        self.z[:, own], self.arriving[:, own], self.ahead[:, own] = met[:, k], tangent, tangent
        self._record(own, NODE)
        return good
