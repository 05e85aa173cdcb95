"""Equilibrium branches of many pads at once, continued by arc length through contact changes as
long as mu rises. A single pad is n = 1, so that queries, maps and curves follow the same branches.

Within a contact state a branch is smooth: a step goes along the tangent, Newton's method corrects
it in the plane across, and it is halved where it turns too far. It ends at the first event on its
way, which is located to rounding: a change of contact, a fold, or the end of the range.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval

from squeal.equilibrium.statics import Places, Statics, newton, solve_stack
from squeal.model.equations import natural_units, net_loads
from squeal.numerics import differentiation
from squeal.numerics.differentiation import Dual

NODE, CHANGE, FOLD = range(3)
"""Kinds of a node: a point of the branch, a change of contact, a smooth fold."""
GOING, REACHED, TURNS, LOST, AWAY, SEPARATED, TILTED, NOWHERE = range(8)
"""How a branch ends, see `squeal.equilibrium.Path.end`; NOWHERE has no place of rest."""


@dataclass(frozen=True)
class BranchOptions:
    """Tolerances of the continuation in natural units, where the load displaces by about one.

    The defaults follow the branches of random pads without loss; smaller steps cost time, larger
    ones risk a jump to another branch. A step is halved where mu may turn back twice on it.
    """

    first_step: float = 0.25  # a quarter of the displacement under the load
    longest_step: float = 4.0  # four times it; it grows with the distance from the origin
    shortest_step: float = 1e-10  # the branch is lost where even this fails
    cosine: float = 0.95  # least, between the tangents of a step: it turns by 18 degrees at most
    correction: float = 0.2  # largest, as a share of the step: farther off lies another branch
    ratio: float = 8.0  # largest, of the rates of mu at both ends of a step
    slower: float = 0.5  # least, of the rate within a step to those at its ends
    closest: float = 1e-3  # two folds that close to one another may be passed over
    most_steps: int = 4000
    farthest: float = 100.0  # free lengths of both springs: the equilibrium has run away
    looks: int = 6  # places within a step at which events are looked for


@dataclass(frozen=True, eq=False)
class Branches:
    """Nodes of the branches of n pads, those of one pad after each other from mu = 0 on.

    statics: of the pads; scale (4, n): what makes lengths and tangents of a pad; side (n,): sign of
    the balance's determinant, which it keeps as long as mu rises; end (n,): how each branch ends,
    the last node being where. Of each node: owner (m,): its pad; z (4, m) = (x, y, w theta, mu) in
    its units; arrives, leaves (4, m): unit tangents of scale z before and behind it; touching
    (points, m): the contact state behind it; kind (m,): `NODE`, `CHANGE`, `FOLD`.
    """

    statics: Statics
    scale: np.ndarray
    side: np.ndarray
    end: np.ndarray
    owner: np.ndarray
    z: np.ndarray
    arrives: np.ndarray
    leaves: np.ndarray
    touching: np.ndarray
    kind: np.ndarray

    @cached_property
    def last(self) -> np.ndarray:
        """Index of the last node of each pad, (n,); that of another pad if it has none."""
        return np.searchsorted(self.owner, np.arange(len(self.end)), side="right") - 1

    @cached_property
    def mu_end(self) -> np.ndarray:
        """The largest mu (n,) of each pad; NaN without a place of rest."""
        mu, there = np.full(len(self.end), np.nan), self.end != NOWHERE
        mu[there] = self.z[3, self.last[there]]
        return mu

    def at(self, pad: np.ndarray, mu: np.ndarray) -> Places:
        """The equilibria of pads (k,) at mu (k,), at a change of contact in the new state.

        There is none beyond `mu_end`.
        """
        # complex numbers are sorted by their real parts, then by their imaginary ones
        keys = self.owner + 1j * self.z[3]
        node = np.maximum(np.searchsorted(keys, pad + 1j * mu, side="right") - 1, 0)
        z, touching = self.z[:, node], self.touching[:, node]
        there = (mu >= 0.0) & (mu <= self.mu_end[pad])
        go = np.flatnonzero(there & (z[3] != mu))
        if not go.size:
            return Places(z, touching, there)
        a, b, pad, target = node[go], node[go] + 1, pad[go], mu[go]
        start, end, part = self.z[:, a], self.z[:, b], self.statics.pick(pad)
        curve = _cubic(start, end, self.leaves[:, a], self.arrives[:, b], self.scale[:, pad])
        share = (target - start[3]) / (end[3] - start[3])  # as if mu rose evenly,
        share = np.where(self.kind[b] == FOLD, 1.0 - np.sqrt(1.0 - share), share)  # or to its top
        guess = polyval(share, curve, tensor=False)
        guess[3] = target
        root, side = part.settle(guess, 1.0 * touching[:, go], 12)
        # across a fold the sign differs; other branches lie farther off
        near = np.abs(root - guess).max(axis=0) <= np.abs(end - start).max(axis=0)
        good = (side == self.side[pad]) & near
        # within rounding of a fold the balance is singular, and the cubic as good as it gets
        close = (self.end[pad] == TURNS) & (end[3] - target <= 1e-8 * end[3])
        z[:, go], there[go] = np.where(good, root, guess), good | close
        missed = go[~there[go]]
        if missed.size:  # a component runs far ahead of the others
            on = touching[:, missed]
            before = Places(self.z[:, node[missed]], on, np.ones(missed.size, dtype=bool))
            branch = follow(part.pick(~there[go]), before, mu[missed])
            same = (branch.touching[:, branch.last] == on).all(axis=0)
            z[:, missed] = branch.z[:, branch.last]
            there[missed] = same & (branch.end == REACHED)
        return Places(z, touching, there)


def follow(
    statics: Statics, start: Places, mu_max: np.ndarray, options: BranchOptions | None = None
) -> Branches:
    """Continue equilibria without friction until mu reaches mu_max, or turns back.

    Parameters
    ----------
    statics
        Of n pads, some parameters of which are arrays (n,).
    start
        Where they rest, as `squeal.equilibrium.find.rests` gives it.
    mu_max : (n,)
        Where to stop, at least 0.
    """
    o, (z, touching, there) = options or BranchOptions(), start
    n = len(there)
    state, scale = np.array(touching, dtype=bool), np.ones((4, n))
    scale[:3] /= natural_units(statics.model, (0.0,) * 6).length
    J = statics.linearised(z, 1.0 * state)[1]
    with np.errstate(all="ignore"):
        side = np.sign(np.linalg.det(np.moveaxis(J[:, :3], -1, 0)))
    # dz/dmu: without friction no branch turns back
    ahead = _along(J, np.tile(np.eye(4)[:, 3:], n)) * scale
    moves = np.sqrt((ahead[:3] ** 2).sum(axis=0))
    # mu counts as what it displaces at the start
    ahead[3] = scale[3] = np.where(np.isfinite(moves), np.maximum(moves, 1e-3), 1.0)
    step = np.full(n, o.first_step)
    front = _Front(statics, np.arange(n), z, state, _unit(ahead), step, scale, mu_max)
    end = np.where(there, np.where(mu_max > z[3], GOING, REACHED), NOWHERE)
    end[(end == GOING) & statics.hidden(z)] = LOST
    _, owner, z, state, ahead, *_ = front.pick(there)
    nodes: list[tuple[np.ndarray, ...]] = [(owner, z, ahead, ahead, state, 0 * owner)]
    front = front.pick(end == GOING)
    for _ in range(o.most_steps):
        if not front.owner.size:
            break
        front, taken, why = front.moved(o)
        end[front.owner] = why
        nodes.append(taken)
        front = front if (why == GOING).all() else front.pick(why == GOING)
    end[front.owner] = LOST
    whole = [np.concatenate(part, axis=-1) for part in zip(*nodes, strict=True)]
    order = np.argsort(whole[0], kind="stable")
    return Branches(statics, scale, side, end, *(part[..., order] for part in whole))


def _cubic(
    a: np.ndarray, b: np.ndarray, start: np.ndarray, end: np.ndarray, scale: np.ndarray
) -> np.ndarray:
    """Coefficients (4, 4, k) of a curve from places a to b (4, k) with unit tangents start, end."""
    chord = b - a
    length = np.sqrt(((chord * scale) ** 2).sum(axis=0)) / scale
    start, end = length * start, length * end
    return np.array([a, start, 3 * chord - 2 * start - end, start + end - 2 * chord])


def _along(J: np.ndarray, row: np.ndarray) -> np.ndarray:
    """Null vectors (4, k) of J (3, 4, k) with row . v = 1."""
    A = np.concatenate([np.moveaxis(J, -1, 0), row.T[:, None, :]], axis=1)
    return np.asarray(solve_stack(A, np.tile(np.eye(4)[:, 3:], (len(A), 1, 1)))[0][:, :, 0].T)


def _unit(v: np.ndarray) -> np.ndarray:
    with np.errstate(all="ignore"):
        return np.nan_to_num(v / np.sqrt((v * v).sum(axis=0)))


class _Front(NamedTuple):
    """Present ends of k branches: pad, place, contact state, unit vector ahead, length of the step,
    scale, end of the range; vectors and lengths are those of `scale` z.

    Events are what changes sign where a step has to end, by number: the gap of each contact point,
    the tilt past 90 degrees, mu past the end of the range, and last a fold.
    """

    part: Statics
    owner: np.ndarray
    z: np.ndarray
    state: np.ndarray
    ahead: np.ndarray
    step: np.ndarray
    scale: np.ndarray
    mu_max: np.ndarray

    def pick(self, i: np.ndarray) -> _Front:
        return _Front(self.part.pick(i), *(a[..., i] for a in self[1:]))

    def solve(
        self, start: np.ndarray, condition: Callable[[_Front, np.ndarray, np.ndarray], np.ndarray]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Zeros of the balance and one more condition (of some branches, places and numbers), the
        tangents there, derivatives of the condition, and where they were found."""

        def conditions(z: np.ndarray, i: np.ndarray) -> np.ndarray:
            some = self if i.size == self.owner.size else self.pick(i)
            balance = some.part.residual(z, 1.0 * some.state[:, None])
            return np.concatenate([balance, condition(some, z, i)[None]])

        z, J, good = newton(conditions, start, 1.0 / self.scale[0])
        with np.errstate(all="ignore"):
            turn = _unit(_along(J[:3], self.ahead * self.scale) * self.scale)
        return z, turn, J[3], good

    def events(self, z: np.ndarray) -> np.ndarray:
        """The events but the last, positive behind them, at places (4, ..., k)."""
        side = np.where(self.state, 1.0, -1.0).reshape(-1, *[1] * (z.ndim - 2), z.shape[-1])
        tilt = self.part.tilt(z)
        ends = np.sign(tilt.real) * tilt - math.pi / 2, z[3] - self.mu_max
        return np.concatenate([side * self.part.gaps(z), ends])

    def turning(self, z: np.ndarray) -> np.ndarray:
        """The determinant of the balance's derivative by q, zero at folds, at z (4, ..., k)."""
        c, one = self.part.model.c._replace(mu=z[3]), np.eye(3).reshape(3, 3, *[1] * (z.ndim - 1))
        q, law = tuple(map(Dual, self.part.place(z), one)), self.part.model.law
        f = net_loads(differentiation, c, law, q, 1.0 * self.state[:, None])
        x, y, turn = (load.slope for load in f)
        return np.asarray((x * np.cross(y, turn, axis=0)).sum(axis=0))

    def over(self, z: np.ndarray) -> np.ndarray:
        """Which events but the last lie behind places (4, ..., k), beyond rounding."""
        values = self.events(z)
        over = np.asarray(values > 0.0)
        if over.any():
            over[:-2] &= values[:-2] > self.part.rounding(z)
            over[-1] &= values[-1] > 1e-15 * self.mu_max
        return over

    def past(self, curve: np.ndarray, share: np.ndarray, fold: bool) -> np.ndarray:
        """Which events, the last or all others, lie behind shares (..., k) of curves."""
        if fold:
            return np.asarray(polyval(share, polyder(curve[:, 3]), tensor=False) < 0.0)[None]
        return self.over(polyval(share, curve, tensor=False))

    def located(
        self, new: np.ndarray, curve: np.ndarray, between: Any, fold: bool, o: BranchOptions
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """A fold, or the first of the other events, between two shares of steps to new places:
        where it is, tangent and its derivative there, if it was located, and which it is."""
        each, points, (low, high) = np.arange(self.owner.size), len(self.state), between
        for _ in range(15):  # halvings tell which event comes first
            middle = (low + high) / 2
            beyond = self.past(curve, middle, fold).any(axis=0)
            low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
        event = np.argmax(self.past(curve, high, fold), axis=0)

        def condition(some: _Front, z: np.ndarray, i: np.ndarray) -> np.ndarray:
            return some.turning(z) if fold else some.events(z)[event[i], :, np.arange(i.size)].T

        z, turn, slope, good = self.solve(polyval(high, curve, tensor=False), condition)
        if not fold:
            others = self.over(z)
            others[event, each] = False
            # a gap has to pass zero along the branch
            passes = ((slope * turn / self.scale).sum(axis=0) > 0.0) | (event >= points)
            good &= ~others.any(axis=0) & passes
            z[3] = np.where(event == points + 1, self.mu_max, z[3])
        # and to lie between the present place and the new one, to a millionth of the step
        ways = [(p - self.z) * self.scale / self.step for p in (z, new)]
        way, whole = ((self.ahead * one).sum(axis=0) for one in ways)
        far = np.sqrt((ways[0] ** 2).sum(axis=0))
        good &= (way >= -1e-6) & (way <= whole + 1e-6) & (far <= way / o.cosine + 1e-6)
        return z, turn, slope, good, np.where(fold, points + 2, event)

    def rises(self, z: np.ndarray, turn: np.ndarray, o: BranchOptions) -> np.ndarray:
        """False for steps to places z with tangents `turn` on which mu may turn back twice."""
        rate = polyder(_cubic(self.z, z, self.ahead, turn, self.scale)[:, 3])
        slow, fast = np.sort([rate[0], rate.sum(axis=0)], axis=0)
        with np.errstate(all="ignore"):
            share = np.clip(np.nan_to_num(-rate[1] / (2 * rate[2])), 0.0, 1.0)
            within = polyval(share, rate, tensor=False)
        even = (fast <= o.ratio * slow) & (within >= o.slower * slow)
        return np.asarray((slow <= 0.0) | (self.step < o.closest) | even)

    def moved(self, o: BranchOptions) -> tuple[_Front, tuple[np.ndarray, ...], np.ndarray]:
        """The ends after one more step, up to the first event on it, or half as far ahead where it
        is refused; the nodes of steps that were taken; how (k,) branches end there if they do."""
        row, points = self.ahead * self.scale, len(self.state)
        guess = self.z + self.step * self.ahead / self.scale
        plane = (row * guess).sum(axis=0)
        z, turn, slope, good = self.solve(
            guess, lambda _, z, i: (row[:, None, i] * z).sum(axis=0) - plane[i]
        )
        with np.errstate(all="ignore"):
            good &= (((z - guess) * self.scale) ** 2).sum(axis=0) <= (o.correction * self.step) ** 2
        good &= (turn * self.ahead).sum(axis=0) >= o.cosine
        good &= self.rises(z, turn, o)
        z, event = np.where(good, z, self.z), np.full(good.size, -1)
        shares = np.linspace(0.0, 1.0, o.looks + 1)
        for fold in (True, False):  # other events lie on the way to the fold
            curve = _cubic(self.z, z, self.ahead, turn, self.scale)
            past = np.any(self.past(curve[:, :, None], shares[1:, None], fold), axis=0)
            i = np.flatnonzero(good & past.any(axis=0))
            if i.size:
                stop = np.argmax(past[:, i], axis=0)
                between = shares[stop], shares[stop + 1]
                found = self.pick(i).located(z[:, i], curve[:, :, i], between, fold, o)
                z[:, i], turn[:, i], slope[:, i], good[i], event[i] = found
        z, ahead = np.where(good, z, self.z), np.where(good, turn, self.ahead)
        kind = np.select([event == points + 2, (event >= 0) & (event < points)], [FOLD, CHANGE])
        i, state = np.flatnonzero(good & (kind == CHANGE)), self.state.copy()
        state[event[i], i] ^= True
        apart = np.asarray(np.all(~state, axis=0))
        if i.size:
            J = self.part.pick(i).linearised(z[:, i], 1.0 * state[:, i])[1]
            new = _unit(_along(J, slope[:, i]) * self.scale[:, i])
            ahead[:, i] = np.where(apart[i], ahead[:, i], new)
        state[:, apart] = self.state[:, apart]  # as it came
        pad, far = self.part.model.pad, np.max(np.abs(z * self.scale), axis=0)
        ends = {
            SEPARATED: apart,
            REACHED: event == points + 1,
            TURNS: (kind == FOLD) | (ahead[3] < 0.0),
            TILTED: event == points,
            AWAY: np.max(np.abs(z[:2]), axis=0) > o.farthest * (pad.L1 + pad.L2),
            LOST: self.part.hidden(z),
        }
        why = np.where(good, np.select(list(ends.values()), list(ends), GOING), GOING)
        longer = np.minimum(2.0 * self.step, o.longest_step * (1.0 + 0.1 * far))
        step = np.where(good, longer, self.step / 2)
        why[step < o.shortest_step] = LOST
        nodes = self.owner, z, turn, ahead, state, kind
        front = self._replace(z=z, state=state, ahead=ahead, step=step)
        return front, tuple(part[..., good] for part in nodes), why
