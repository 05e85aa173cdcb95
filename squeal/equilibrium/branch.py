"""Equilibrium branches of many pads at once, continued by arc length through contact changes as
long as mu rises. A single pad is n = 1, so that queries, maps and curves follow the same branches.

Within a contact state a branch is smooth: a step goes along the tangent, Newton's method corrects
it in the plane across, and it is halved where it turns too far or where mu may have turned twice.
It ends at the first fold, change of contact or end of the range, which is located to rounding.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval

from squeal.equilibrium.statics import WHY_HIDDEN, Statics, solve_stack
from squeal.model.equations import natural_units, net_loads
from squeal.model.pad import Coefficients, pose
from squeal.numerics import differentiation
from squeal.numerics.differentiation import STEP, Dual, with_derivative

NODE, CHANGE, FOLD = range(3)
"""Kinds of a node: a point of the branch, a change of contact, a smooth fold."""
GOING, REACHED, TURNS, LOST, AWAY, SEPARATED, TILTED, NOWHERE = range(8)
"""How a branch ends, see `Branches.end_of`; of NOWHERE there is no place without friction."""
NO_START = (
    "without friction the pad has no place of rest nearby where the surfaces press on each other"
)
UNITS = 4.0 * float(np.finfo(float).eps)  # by which each coefficient and each load may be off
OF_LOADS = ("k1", "k2", "k3", "k4", "k_c", "F_n")  # to each of which one load is proportional


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
    close: float = 1e-6  # of a step: what a place that was located may lie outside of it
    between: tuple[float, ...] = (1 / 6, 1 / 3, 1 / 2, 2 / 3, 5 / 6)  # where a step is looked at


@dataclass(frozen=True, eq=False)
class Branches:
    """Nodes of the branches of n pads, those of one pad after each other from mu = 0 on.

    statics: of the pads; scale (4, n): what makes lengths and tangents of a pad; owner (m,): the
    pad of each node; z (4, m) = (x, y, w theta, mu) in its units; arrives, leaves (4, m): unit
    tangents of scale z before and behind each node; touching (points, m): the contact state behind
    it; kind (m,): `NODE`, `CHANGE`, `FOLD`; end (n,): how each branch ends, the last node being
    where.
    """

    statics: Statics
    scale: np.ndarray
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
    def last(self) -> np.ndarray:
        """Index of the last node of each pad, (n,); first - 1 of a pad without nodes."""
        return self.first[1:] - 1

    @cached_property
    def mu_end(self) -> np.ndarray:
        """The largest mu (n,) of each pad; NaN without a place of rest."""
        there = self.first[1:] > self.first[:-1]
        mu = np.full(len(self.end), np.nan)
        mu[there] = self.z[3, self.last[there]]
        return mu

    @cached_property
    def _sides(self) -> np.ndarray:
        """The sign (n,) of the balance's determinant, which mu keeps as long as it rises; 0 without
        a place of rest."""
        sides, pads = np.zeros(len(self.end)), np.flatnonzero(self.first[1:] > self.first[:-1])
        start = self.first[:-1][pads]
        on = 1.0 * self.touching[:, start]
        J = self.statics.pick(pads).linearised(self.z[:, start], on, 3)[1]
        sides[pads] = np.sign(np.linalg.det(np.moveaxis(J, -1, 0)))
        return sides

    def at(self, pad: np.ndarray, mu: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The equilibria of pads (k,) at mu (k,).

        Returns places (4, k), contact states (points, k), at a change the new one, and where (k,)
        there is an equilibrium: nowhere beyond `mu_end`.
        """
        # complex numbers are sorted by their real parts, then by their imaginary ones
        keys = self.owner + 1j * self.z[3]
        node = np.maximum(np.searchsorted(keys, pad + 1j * mu, side="right") - 1, 0)
        z, touching = self.z[:, node], self.touching[:, node]
        there = (mu >= 0.0) & (mu <= self.mu_end[pad])
        go = np.flatnonzero(there & (z[3] != mu))
        if not go.size:
            return z, touching, there
        a, b, target = node[go], node[go] + 1, mu[go]
        start, end, part = self.z[:, a], self.z[:, b], self.statics.pick(pad[go])
        curve = _cubic(start, end, self.leaves[:, a], self.arrives[:, b], self.scale[:, pad[go]])
        share = (target - start[3]) / (end[3] - start[3])
        with np.errstate(all="ignore"):
            for _ in range(4):  # Newton's steps: mu rises along the curve
                slope = polyval(share, polyder(curve[:, 3]), tensor=False)
                off = (polyval(share, curve[:, 3], tensor=False) - target) / slope
                share = np.clip(share - np.where(np.isfinite(off), off, 0.0), 0.0, 1.0)
        if (fold := self.kind[b] == FOLD).any():  # where it ceases to
            mus = curve[:, 3, fold]
            share[fold] = _first(
                lambda s: polyval(s, mus, tensor=False) > target[fold], int(fold.sum()), 30
            )
        guess = polyval(share, curve, tensor=False)
        guess[3] = target
        root, on = guess.copy(), 1.0 * touching[:, go]
        side = part.settle(root, on, 12)
        # across a fold the sign differs; other branches lie farther off
        good = (side == self._sides[pad[go]]) & (
            np.abs(root - guess).max(axis=0) <= np.abs(end - start).max(axis=0)
        )
        # within rounding of a fold the balance is singular, and the cubic as good as it gets
        close = (self.end[pad[go]] == TURNS) & (end[3] - target <= 1e-8 * end[3])
        z[:, go], there[go] = np.where(good, root, guess), good | close
        missed = go[~there[go]]
        if missed.size:  # a component runs far ahead of the others
            part = self.statics.pick(pad[missed])
            branch = follow(
                part, z=self.z[:, node[missed]], touching=touching[:, missed], mu_max=mu[missed]
            )
            last = branch.first[1:] - 1
            same = (branch.touching[:, last] == touching[:, missed]).all(axis=0)
            z[:, missed], there[missed] = branch.z[:, last], same & (branch.end == REACHED)
        return z, touching, there

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
        mu, at = float(z[3]), self.statics.pick(self.owner[start : start + 1])
        why = f": {WHY_HIDDEN}" if at.hidden(z[:, None]).any() else ""
        return {
            REACHED: f"mu = {mu:.9g} is reached" if mu else "mu = 0",
            TURNS: f"the branch from mu = 0 turns back in a fold at mu = {mu:.9g}",
            LOST: f"the branch from mu = 0 is lost at mu = {mu:.9g}{why}",
            AWAY: f"the equilibrium runs away to infinity near mu = {mu:.9g}",
            SEPARATED: f"contact is lost at mu = {mu:.9g}",
            TILTED: f"the pad turns past 90 degrees on the branch at mu = {mu:.9g}",
        }[int(self.end[pad])]


def follow(
    statics: Statics,
    z: np.ndarray,
    touching: np.ndarray,
    mu_max: np.ndarray,
    options: BranchOptions | None = None,
    there: np.ndarray | None = None,
) -> Branches:
    """Continue equilibria without friction until mu reaches mu_max, or turns back.

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
    there : (n,)
        Pads that have a place of rest; all if left out.
    """
    o, n = options or BranchOptions(), z.shape[1]
    there = np.ones(n, dtype=bool) if there is None else there
    front = _Front.of(statics, z, np.array(touching, dtype=bool), mu_max, o)
    end = np.where(there, np.where(mu_max > z[3], GOING, REACHED), NOWHERE)
    end[(end == GOING) & statics.hidden(z)] = LOST
    scale, nodes = front.scale, [front.pick(there).nodes(front.ahead[:, there], NODE)]
    front = front.pick(end == GOING)
    for _ in range(o.most_steps):
        if not front.owner.size:
            break
        good, place, turn, kind, event = front.tried(o)
        last, (front, why) = front.owner, front.accepted(good, place, turn, kind, event, o)
        end[last] = why
        nodes.append(front.pick(good).nodes(turn[:, good], kind[good]))
        front = front if (why == GOING).all() else front.pick(why == GOING)
    end[front.owner] = LOST
    whole = [np.concatenate(part, axis=-1) for part in zip(*nodes, strict=True)]
    order = np.argsort(whole[0], kind="stable")
    who, z, arrives, leaves, state, kind = (part[..., order] for part in whole)
    return Branches(statics, scale, who, z, arrives, leaves, state, kind, end)


def _cubic(
    a: np.ndarray, b: np.ndarray, start: np.ndarray, end: np.ndarray, scale: np.ndarray
) -> np.ndarray:
    """Coefficients (4, 4, k), by its share, of a curve from places a to b (4, k) with unit tangents
    start and end of `scale` times it."""
    chord = b - a
    length = np.sqrt(((chord * scale) ** 2).sum(axis=0)) / scale
    start, end = length * start, length * end
    return np.array([a, start, 3 * chord - 2 * start - end, start + end - 2 * chord])


def _first(
    past: Callable[[np.ndarray], np.ndarray],
    k: int,
    halvings: int,
    low: np.ndarray | float = 0.0,
    high: np.ndarray | float = 1.0,
) -> np.ndarray:
    """Shares (k,) of k curves, between low and high, from which on `past` holds."""
    low, high = np.full(k, low), np.full(k, high)
    for _ in range(halvings):
        middle = (low + high) / 2
        beyond = past(middle)
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
    return high


def _along(J: np.ndarray, row: np.ndarray) -> np.ndarray:
    """Null vectors (4, k) of J (3, 4, k) with row . v = 1."""
    A = np.concatenate([np.moveaxis(J, -1, 0), row.T[:, None, :]], axis=1)
    return np.asarray(solve_stack(A, np.tile(np.eye(4)[:, 3:], (len(A), 1, 1)))[0][:, :, 0].T)


def _unit(v: np.ndarray) -> np.ndarray:
    with np.errstate(all="ignore"):
        return np.nan_to_num(v / np.sqrt((v * v).sum(axis=0)))


def _newton(
    conditions: Callable[[np.ndarray], np.ndarray], start: np.ndarray, unit: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Zeros (m, k) of analytic conditions, their derivative before the last step, and where it
    converged to rounding beside the `unit` (k,) of the places."""
    x, last = start.copy(), np.full(start.shape[1], np.inf)
    good = np.zeros(start.shape[1], dtype=bool)
    for _ in range(15):
        with np.errstate(all="ignore"):
            value, slope = with_derivative(conditions, x)
            step, regular = solve_stack(np.moveaxis(slope, -1, 0), value.T[:, :, None])
            move = np.where(good, 0.0, step[:, :, 0].T)
            x = x - move
            change = np.max(np.abs(move), axis=0) / (unit + np.max(np.abs(x[:3]), axis=0))
        good |= regular & ((change <= 1e-11) | ((change >= last) & (change <= 1e-6)))
        last = change
        if good.all() or not np.isfinite(change[~good]).any():
            break
    return x, slope, good & np.isfinite(x).all(axis=0)


class _Front(NamedTuple):
    """Present ends of k branches, arrays over them: pad, place, contact state, unit vector ahead,
    length of the step, scale, end of the range. Vectors and lengths are those of `scale` z, natural
    units of each pad; mu counts as what it displaces at the start."""

    part: Statics
    owner: np.ndarray
    z: np.ndarray
    state: np.ndarray
    ahead: np.ndarray
    step: np.ndarray
    scale: np.ndarray
    mu_max: np.ndarray

    @staticmethod
    def of(
        statics: Statics, z: np.ndarray, state: np.ndarray, mu_max: np.ndarray, o: BranchOptions
    ) -> _Front:
        n = z.shape[1]
        scale = np.ones((4, n))
        scale[:3] /= natural_units(statics.model, (0.0,) * 6).length
        row = np.tile(np.eye(4)[:, 3:], n)
        # dz/dmu: without friction no branch turns back
        ahead = _along(statics.linearised(z, 1.0 * state)[1], row) * scale
        moves = np.sqrt((ahead[:3] ** 2).sum(axis=0))
        ahead[3] = scale[3] = np.where(np.isfinite(moves), np.maximum(moves, 1e-3), 1.0)
        far = np.max(np.abs(z[:3] * scale[:3]), axis=0)
        step = np.maximum(o.first_step, 1e-6 * far)
        return _Front(statics, np.arange(n), z, state, _unit(ahead), step, scale, mu_max)

    def pick(self, i: np.ndarray) -> _Front:
        return _Front(self.part.pick(i), *(a[..., i] for a in self[1:]))

    def nodes(self, arrives: np.ndarray, kind: np.ndarray | int) -> tuple[np.ndarray, ...]:
        kinds = np.full(self.owner.size, kind)
        return self.owner, self.z, arrives, self.ahead, self.state, kinds

    def solve(
        self, start: np.ndarray, condition: Callable[[np.ndarray], np.ndarray]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """`_newton` on the balance and one more condition."""
        on = 1.0 * self.state
        return _newton(
            lambda z: np.concatenate([self.part.residual(z, on[:, None]), condition(z)[None]]),
            start,
            1.0 / self.scale[0],
        )

    def events(self, z: np.ndarray) -> np.ndarray:
        """What changes sign where a step has to end, (points + 2, ..., k) at places (4, ..., k):
        the gap of each contact point, the tilt past 90 degrees, mu past the end of the range."""
        side = np.where(self.state, 1.0, -1.0).reshape(-1, *[1] * (z.ndim - 2), z.shape[-1])
        tilt = self.part.tilt(z)
        ends = np.sign(tilt.real) * tilt - math.pi / 2, z[3] - self.mu_max
        return np.concatenate([side * self.part.gaps(z), ends])

    def over(self, z: np.ndarray) -> np.ndarray:
        """Which events lie behind places (4, ..., k), those of gaps beyond rounding."""
        values = self.events(z)
        over = np.asarray(values > 0.0)
        if over[:-2].any():
            over[:-2] &= values[:-2] > self.part.rounding(z)
        return over

    def within(self, new: np.ndarray, place: np.ndarray, o: BranchOptions) -> np.ndarray:
        """Where places (4, k) that were located lie between the present ones and new ones."""
        ways = [(p - self.z) * self.scale / self.step for p in (place, new)]
        way, whole = ((self.ahead * one).sum(axis=0) for one in ways)
        far = np.sqrt((ways[0] ** 2).sum(axis=0))
        inside = (way >= -o.close) & (way <= whole + o.close)
        return np.asarray(inside & (far <= way / o.cosine + o.close))

    def tried(
        self, o: BranchOptions
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """A step of each pad, up to the first event on it: which (k,) may be taken, new places and
        tangents there in the old contact state (4, k), kinds of node and events (k,)."""
        row, k = self.ahead * self.scale, self.owner.size
        guess = self.z + self.step * self.ahead / self.scale
        plane = (row * guess).sum(axis=0)
        z, J, good = self.solve(guess, lambda z: (row[:, None] * z).sum(axis=0) - plane)
        with np.errstate(all="ignore"):
            turn = _unit(_along(J[:3], row) * self.scale)
            good &= (((z - guess) * self.scale) ** 2).sum(axis=0) <= (o.correction * self.step) ** 2
        good &= (turn * self.ahead).sum(axis=0) >= o.cosine
        kind, event = np.full(k, NODE), np.full(k, -1)
        i = np.flatnonzero(good & (turn[3] < 0.0))
        if i.size:
            z[:, i], turn[:, i], good[i] = self.pick(i).fold(z[:, i], turn[:, i], o)
            kind[i] = FOLD
        z[:, ~good] = self.z[:, ~good]
        curve = _cubic(self.z, z, self.ahead, turn, self.scale)
        shares = np.array([0.0, *o.between, 1.0])
        samples = polyval(shares[:, None], curve[:, :, None], tensor=False)
        samples[:, -1] = z
        # mu may not turn twice
        good &= (np.diff(samples[3], axis=0) >= 0.0).all(axis=0) | (kind == FOLD)
        over = np.asarray(self.over(samples[:, 1:]).any(axis=0))
        i = np.flatnonzero(good & over.any(axis=0))
        if i.size:
            stop = np.argmax(over[:, i], axis=0)
            between = shares[stop], shares[stop + 1]
            located = self.pick(i).located(z[:, i], curve[:, :, i], *between, o)
            good[i], z[:, i], turn[:, i], event[i] = located
            kind[i] = np.where(event[i] < len(self.state), CHANGE, NODE)
        return good, z, turn, kind, event

    def located(
        self,
        new: np.ndarray,
        curve: np.ndarray,
        low: np.ndarray,
        high: np.ndarray,
        o: BranchOptions,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """The first event between two shares of steps: where it was located, places, tangents
        there, and which it is."""
        each = np.arange(self.owner.size)
        share = _first(
            lambda s: np.any(self.over(polyval(s, curve, tensor=False)), axis=0),
            each.size,
            15,
            low,
            high,
        )
        guess = polyval(share, curve, tensor=False)
        event = np.argmax(self.over(guess), axis=0)
        z, J, good = self.solve(guess, lambda z: self.events(z)[event, :, each].T)
        turn = _unit(_along(J[:3], self.ahead * self.scale) * self.scale)
        others = self.over(z)
        others[event, each] = False
        # a gap has to pass zero along the branch
        passes = ((J[3] * turn / self.scale).sum(axis=0) > 0.0) | (event >= len(self.state))
        good &= ~others.any(axis=0) & passes & self.within(new, z, o)
        z[3] = np.where(event == len(self.state) + 1, self.mu_max, z[3])
        return good, z, turn, event

    def fold(
        self, new: np.ndarray, turn: np.ndarray, o: BranchOptions
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Where mu is stationary on the way to new places, the tangents there, and where (k,) that
        was located.

        Newton's method on z and v: the loads F vanish and F_q v = 0, v being normalised.
        """
        part, on = self.part, 1.0 * self.state[:, None]
        curve = _cubic(self.z, new, self.ahead, turn, self.scale)
        guess = polyval(self.ahead[3] / (self.ahead[3] - turn[3]), curve, tensor=False)
        J = np.nan_to_num(np.moveaxis(part.linearised(guess, 1.0 * self.state, 3)[1], -1, 0))
        start = np.linalg.svd(J)[2][:, 2].T

        def conditions(u: np.ndarray) -> np.ndarray:
            z, v = u[:4], u[4:]
            c = part.model.c._replace(mu=z[3])
            q = tuple(map(Dual, part.place(z), part.place(v)))
            f = net_loads(differentiation, c, part.model.law, q, on)  # type: ignore[arg-type]
            loads = f.x, f.y, f.moment / part.model.pad.w
            norm = (start[:, None] * v).sum(axis=0) - 1.0
            rows = (*(f.value for f in loads), *(f.slope for f in loads), norm)
            return np.array(np.broadcast_arrays(*rows))

        u, _, good = _newton(conditions, np.concatenate([guess, start]), 1.0 / self.scale[0])
        z, tangent = u[:4], np.concatenate([u[4:], np.zeros((1, len(good)))])
        tangent = _unit(tangent * self.scale)
        tangent = tangent * np.sign((tangent * self.ahead).sum(axis=0))
        return z, tangent, good & self.within(new, z, o)

    def accepted(
        self,
        good: np.ndarray,
        z: np.ndarray,
        turn: np.ndarray,
        kind: np.ndarray,
        event: np.ndarray,
        o: BranchOptions,
    ) -> tuple[_Front, np.ndarray]:
        """The ends after the steps of `tried`, half as far ahead where these were refused, and how
        (k,) the branches end there if they do."""
        state, ahead, z = (
            self.state.copy(),
            np.where(good, turn, self.ahead),
            np.where(good, z, self.z),
        )
        why, points = np.full(len(good), GOING), len(state)
        i = np.flatnonzero(good & (kind == CHANGE))
        if i.size:
            part, point = self.part.pick(i), event[i]
            state[point, i] ^= True
            separated = ~state[:, i].any(axis=0)
            row = part.gap_derivatives(z[:, i], point) * np.where(state[point, i], -1.0, 1.0)
            new = _along(part.linearised(z[:, i], 1.0 * state[:, i])[1], row) * self.scale[:, i]
            ahead[:, i] = np.where(separated, ahead[:, i], _unit(new))
            why[i[separated]] = SEPARATED
            state[point[separated], i[separated]] = True  # as it came
        pad = self.part.model.pad
        far = np.max(np.abs(z * self.scale), axis=0)
        for which, end in (
            (event == points + 1, REACHED),
            ((kind == FOLD) | (ahead[3] < 0.0), TURNS),
            (event == points, TILTED),
            (np.max(np.abs(z[:2]), axis=0) > o.farthest * (pad.L1 + pad.L2), AWAY),
            (self.part.hidden(z), LOST),
        ):
            why[which & good & (why == GOING)] = end
        longer = np.minimum(o.growth * self.step, o.longest_step * (1.0 + 0.1 * far))
        step = np.where(good, longer, self.step / 2)
        why[step < o.shortest_step] = LOST
        return self._replace(z=z, state=state, ahead=ahead, step=step), why
