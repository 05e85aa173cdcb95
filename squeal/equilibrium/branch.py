"""Equilibrium branches over mu of many pads at once, continued by arc length through contact
changes and folds. A single pad is n = 1, so that queries, maps and curves follow the same branches.

Within a contact state a branch is smooth: a step is predicted by the tangent and its change,
corrected by Newton's method in the plane across the tangent, and halved where it turns too far or
where a gap or mu may have turned twice. Contact changes and folds are located to rounding.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from functools import cached_property

import numpy as np

from squeal.equilibrium.located import contact_change, fold, position_error
from squeal.equilibrium.statics import Statics, solve_stack
from squeal.errors import InputError
from squeal.model.equations import natural_units

NODE, CHANGE, FOLD = range(3)
"""Kinds of a node: a point of the branch, a change of contact, a smooth fold."""
GOING, REACHED, TURNS, LOST, AWAY, HIDDEN, SEPARATED, TILTED, SPENT, NOWHERE = range(10)
"""How a branch ends, see `Branches.end_of`; of NOWHERE there is no place without friction."""
UNKNOWN = (LOST, HIDDEN, SPENT)
"""Ends of the computation, not of the branch."""
TURNED = 1e-3  # of a unit tangent between two steps: less may be rounding
CLOSE = 1e-6  # of a step: what a place that was located may lie outside of it
BETWEEN = np.linspace(0.0, 1.0, 7)[1:-1]  # of a step: where its cubic is looked at
TO_FOLD = (0.1, 1e-2, 1e-3)  # of a step before a fold: more nodes, since q runs as a square root


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

    def __post_init__(self) -> None:
        for one in fields(self):
            value = getattr(self, one.name)
            if not (math.isfinite(value) and value > 0):
                raise InputError(
                    f"BranchOptions: {one.name}: {value!r} is not allowed; it must be a finite "
                    "number above 0"
                )


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
        found = stop.copy()
        for node in np.flatnonzero(self.turns)[::-1]:  # of several the first counts
            found[self.owner[node]] = node
        return found

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
        of the balance's determinant, and where (k,) an equilibrium was found: nowhere beyond
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
        found = guess.copy()
        side[go] = part.settle(found, 1.0 * touching[:, go], 12)
        # across a fold the sign differs; other branches lie farther off
        nodes = self.z[:, j[go]], self.z[:, np.minimum(j[go] + 1, self.z.shape[1] - 1)]
        near = np.abs(found - guess).max(axis=0) <= np.abs(nodes[1] - nodes[0]).max(axis=0)
        good = near & (side[go] == sides[pad[go]])
        # within rounding of a fold the balance is singular, and the cubic as good as it gets
        at_fold = self.turns[np.minimum(j[go] + 1, self.z.shape[1] - 1)]
        close = at_fold & (nodes[1][3] - mu[go] <= 1e-8 * nodes[1][3])
        z[:, go] = np.where(good, found, guess)
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
        """How far rounding may move the mu of a contact change or fold; 0 of other nodes."""
        if self.kind[node] == NODE:
            return 0.0
        part = self.statics.pick(self.owner[node : node + 1])
        before = self.touching[:, node - 1]
        point = -1
        if self.kind[node] == CHANGE:
            point = int(np.argmax(before != self.touching[:, node]))
        return position_error(part, self.z[:, node : node + 1], before, point)

    def end_of(self, pad: int) -> str:
        """Why the branch of a pad stops, in words."""
        start, stop = self.first[pad], self.first[pad + 1]
        if start == stop:
            return NO_START
        z = self.z[:, stop - 1 : stop]
        mu, turns = float(z[3, 0]), np.flatnonzero(self.turns[start:stop])
        why = self.statics.pick(self.owner[start : start + 1]).why_hidden(z)
        highest = f" at mu = {self.z[3, start + turns].max():.9g}" if turns.size else ""
        return {
            REACHED: f"mu = {mu:.9g} is reached" if mu else "mu = 0",
            TURNS: f"the branch from mu = 0 turns back in a fold{highest}",
            LOST: f"the branch from mu = 0 is lost at mu = {mu:.9g}" + (f": {why}" if why else ""),
            AWAY: f"the equilibrium runs away to infinity near mu = {mu:.9g}",
            HIDDEN: f"the branch from mu = 0 is lost at mu = {mu:.9g}: {why}",
            SEPARATED: f"contact is lost at mu = {mu:.9g}",
            TILTED: f"the pad turns past 90 degrees on the branch at mu = {mu:.9g}",
            SPENT: f"the branch was not followed beyond mu = {mu:.9g}",
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
        self.end[(self.end == GOING) & self.statics.hidden(self.z)] = HIDDEN
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

    def _record(
        self,
        who: np.ndarray,
        kind: int,
        z: np.ndarray | None = None,
        tangent: np.ndarray | None = None,
    ) -> None:
        """Append nodes of the pads `who`: their present places, or others (4, k) with the unit
        tangent there."""
        scale = self.scale[:, who]
        arrives = self.arriving[:, who] if tangent is None else tangent
        leaves = self.ahead[:, who] if tangent is None else tangent
        place = self.z[:, who] if z is None else z
        kinds = np.full(who.size, kind)
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
        self.end[self.active] = SPENT
        whole = [np.concatenate(part, axis=-1) for part in zip(*self.nodes, strict=True)]
        order = np.argsort(whole[0], kind="stable")
        who, z, arrives, leaves, touching, kind = (part[..., order] for part in whole)
        return Branches(self.statics, who, z, arrives, leaves, touching, kind, self.end)

    def _advance(self) -> None:
        """One step of every pad that goes on, or half of it where it was too long."""
        who = self.active
        part = self.statics.pick(who)
        taken = self._tried(part, who)
        self._finish(part, who, taken)
        failed = who[~taken.good & (self.end[who] == GOING)]
        self.step[failed] /= 2
        self.end[failed[self.step[failed] < self.options.shortest_step]] = LOST
        i = np.flatnonzero(taken.good)
        if i.size:
            self._accept(part, who, taken, i)

    def _accept(self, part: Statics, who: np.ndarray, taken: _Step, i: np.ndarray) -> None:
        """Go on to the places of the steps i that were taken."""
        o = self.options
        folded = i[taken.folds[i]]
        if folded.size:
            self._to_fold(part, who, taken, folded)
            if self.rising:
                self.end[who[folded]] = TURNS
                i = i[~taken.folds[i]]
        own, new, turn = who[i], taken.z[:, i], taken.turn[:, i]
        before, step = self.z[3, own], self.step[own]
        turned = turn - self.ahead[:, own]
        smooth = (taken.point[i] < 0) & (np.max(np.abs(turned), axis=0) > TURNED)
        self.bend[:, own] = np.where(smooth, turned / step, 0.0)
        self.z[:, own], self.arriving[:, own], self.ahead[:, own] = new, turn, turn
        far = np.max(np.abs(new * self.scale[:, own]), axis=0)
        longest = o.longest_step * (1.0 + 0.1 * far)
        self.step[own] = np.minimum(o.growth * step, longest)
        changed = taken.point[i] >= 0
        if changed.any():
            self._change(part.pick(i[changed]), own[changed], taken.point[i][changed])
        self._record(own[~changed], NODE)
        going = own[self.end[own] == GOING]
        backwards = (self.ahead[3, going] < 0.0) & (self.arriving[3, going] > 0.0)
        falls = (new[3] < before)[self.end[own] == GOING]
        self.end[going[(self.z[3, going] < 0.0) & falls]] = TURNS
        if self.rising:
            self.end[going[backwards]] = TURNS
        pad = part.model.pad
        limit = o.farthest * np.broadcast_to(pad.L1 + pad.L2, who.shape)[i]
        away = np.max(np.abs(new[:2]), axis=0) > limit
        hidden = part.pick(i).hidden(new)
        for which, why in ((away, AWAY), (hidden, HIDDEN)):
            self.end[own[which & (self.end[own] == GOING)]] = why

    def _tried(self, part: Statics, who: np.ndarray) -> _Step:
        """A step of each pad, and whether it may be taken."""
        o, scale, step = self.options, self.scale[:, who], self.step[who]
        z, ahead, state = self.z[:, who], self.ahead[:, who], self.touching[:, who]
        guess = z + step * ahead / scale
        row = ahead * scale
        start = guess + step**2 / 2 * self.bend[:, who] / scale
        new, J, good = _corrected(part, start, state, row, (row * guess).sum(axis=0), 1.0 / scale)
        with np.errstate(all="ignore"):
            off = np.sqrt((((new - guess) * scale) ** 2).sum(axis=0))
            good &= off <= o.correction * step
            turn = _unit(along(J, row) * scale)
            good &= (turn * ahead).sum(axis=0) >= o.cosine
        point = np.full(who.size, -1)
        taken = _Step(good, new, turn, point, np.zeros_like(good), new.copy())
        wrong = part.wrong(new, state) & good
        for i in [np.flatnonzero(wrong.any(axis=0))] if wrong.any() else []:
            self._locate_change(part.pick(i), who[i], taken, i, wrong[:, i])
        folds = taken.good & (np.sign(taken.turn[3]) != np.sign(ahead[3]))
        for i in [np.flatnonzero(folds)] if folds.any() else []:
            self._locate_fold(part.pick(i), who[i], taken, i)
        self._look_between(part, who, taken)
        return taken

    def _locate_change(
        self, part: Statics, who: np.ndarray, taken: _Step, i: np.ndarray, wrong: np.ndarray
    ) -> None:
        """The first contact change within each of the steps i, which then end there."""
        z, state, new = self.z[:, who], self.touching[:, who], taken.z[:, i]
        before, after = part.gaps(z), part.gaps(new)
        with np.errstate(all="ignore"):
            share = np.clip(before / (before - after), 0.0, 1.0)
        first = np.argmin(np.where(wrong, share, np.inf), axis=0)
        share = np.nan_to_num(share[first, np.arange(who.size)])
        start = self._cubic(who, z, new, taken.turn[:, i], share)
        met, good = contact_change(part, start, state, first)
        good &= self._within(who, z, new, met)
        sign = np.where(state, 1.0, -1.0)
        others = part.wrong(met, state)
        others[first, np.arange(who.size)] = False
        good &= ~others.any(axis=0)
        turn = self._tangents(part, who, met, state, self.ahead[:, who])
        # the gap has to pass zero along the branch
        slope = (part.gap_derivatives(met, first) * turn / self.scale[:, who]).sum(axis=0)
        good &= slope * sign[first, np.arange(who.size)] > 0.0
        taken.good[i] = good
        taken.z[:, i], taken.turn[:, i] = met, turn
        taken.point[i] = first

    def _tangents(
        self, part: Statics, who: np.ndarray, z: np.ndarray, state: np.ndarray, like: np.ndarray
    ) -> np.ndarray:
        """Unit tangents (4, k) of `scale` z at places, oriented like unit vectors (4, k)."""
        scale = self.scale[:, who]
        J = part.linearised(z, 1.0 * state)[1] / scale
        t = np.array([np.linalg.det(np.moveaxis(np.delete(J, c, axis=1), -1, 0)) for c in range(4)])
        t = _unit(t * np.array([1.0, -1.0, 1.0, -1.0])[:, None])
        return np.asarray(np.nan_to_num(t * np.sign((t * like).sum(axis=0))))

    def _locate_fold(self, part: Statics, who: np.ndarray, taken: _Step, i: np.ndarray) -> None:
        """The fold within each of the steps i."""
        z, ahead, new, turn = self.z[:, who], self.ahead[:, who], taken.z[:, i], taken.turn[:, i]
        share = np.clip(ahead[3] / (ahead[3] - turn[3]), 0.0, 1.0)
        met, good = fold(part, self._cubic(who, z, new, turn, share), self.touching[:, who])
        taken.good[i] &= good & self._within(who, z, new, met)
        taken.folds[i], taken.fold[:, i] = True, met

    def _cubic(
        self, who: np.ndarray, z: np.ndarray, new: np.ndarray, turn: np.ndarray, s: np.ndarray
    ) -> np.ndarray:
        """Places (4, ..., k) at shares s (..., k) of the way to new ones, by `cubic`."""
        scale = self.scale[:, who]
        length = np.sqrt((((new - z) * scale) ** 2).sum(axis=0))
        start, end = length * self.ahead[:, who] / scale, length * turn / scale
        if np.ndim(s) == 1:
            return cubic(z, new, start, end, s)
        return cubic(z[:, None], new[:, None], start[:, None], end[:, None], s)

    def _within(
        self, who: np.ndarray, z: np.ndarray, new: np.ndarray, met: np.ndarray
    ) -> np.ndarray:
        """Where places (4, k) that were located lie between the present ones and new ones."""
        scale, ahead, step = self.scale[:, who], self.ahead[:, who], self.step[who]
        way, whole = ((ahead * (p - z) * scale).sum(axis=0) / step for p in (met, new))
        far = np.sqrt((((met - z) * scale) ** 2).sum(axis=0)) / step
        close = far <= way / self.options.cosine + CLOSE
        return np.asarray(close & (way >= -CLOSE) & (way <= whole + CLOSE))

    def _look_between(self, part: Statics, who: np.ndarray, taken: _Step) -> None:
        """Refuse steps within which a gap may pass zero twice, or mu turn twice."""
        i = np.flatnonzero(taken.good)
        if not i.size:
            return
        if i.size < who.size:
            part, who = part.pick(i), who[i]
        z, new, turn = self.z[:, who], taken.z[:, i], taken.turn[:, i]
        between = self._cubic(who, z, new, turn, BETWEEN[:, None] + np.zeros(i.size))
        state = self.touching[:, who]
        each = (part.wrong(between[:, s], state).any(axis=0) for s in range(len(BETWEEN)))
        bad = np.any(list(each), axis=0)
        mus = np.concatenate([z[3:], between[3], new[3:]])
        twice = np.any(np.diff(mus, axis=0) * turn[3] < 0.0, axis=0)
        taken.good[i] &= ~(bad | (twice & ~taken.folds[i]))

    def _to_fold(self, part: Statics, who: np.ndarray, taken: _Step, i: np.ndarray) -> None:
        """Record the folds of the steps i, with nodes close before them."""
        own, end, part = who[i], taken.fold[:, i], part.pick(i)
        z, state, scale = self.z[:, own], self.touching[:, own], self.scale[:, own]
        tangent = self._tangents(part, own, end, state, self.ahead[:, own])
        tangent[3] = 0.0
        row = tangent * scale
        for back in TO_FOLD:
            guess = self._cubic(own, z, end, tangent, np.full(own.size, 1.0 - back))
            value = (row * guess).sum(axis=0)
            met, J, good = _corrected(part, guess, state, row, value, 1.0 / scale)
            good &= (met[3] < end[3]) & (met[3] > z[3])
            k = np.flatnonzero(good)
            unit = _unit(along(J, row)[:, k] * scale[:, k])
            self._record(own[k], NODE, met[:, k], unit)
        self._record(own, FOLD, end, tangent)

    def _change(self, part: Statics, who: np.ndarray, point: np.ndarray) -> None:
        """Go over to the new contact states; the branch ends where nothing touches any more."""
        every = np.arange(who.size)
        z, old = self.z[:, who], self.touching[:, who]
        new = old.copy()
        new[point, every] = ~new[point, every]
        left = np.flatnonzero(new.any(axis=0))
        gone = who[~new.any(axis=0)]
        self._record(gone, NODE)
        self.end[gone] = SEPARATED
        who, part, z, new, point = who[left], part.pick(left), z[:, left], new[:, left], point[left]
        if not who.size:
            return
        turn = self._tangents(part, who, z, new, self.ahead[:, who])
        slope = (part.gap_derivatives(z, point) * turn / self.scale[:, who]).sum(axis=0)
        opens = np.where(new[point, np.arange(who.size)], -1.0, 1.0)
        self.touching[:, who] = new
        self.ahead[:, who] = turn * np.sign(opens * slope)
        self.bend[:, who] = 0.0
        self._record(who, CHANGE)

    def _finish(self, part: Statics, who: np.ndarray, taken: _Step) -> None:
        """End branches that reach mu_max, or turn past 90 degrees, within a step that was taken."""
        pad, limit = part.model.pad, self.options.tilt
        mu, tilt = self.mu_max[who], part.tilt(taken.z)
        upright = np.broadcast_to(pad.w * (np.copysign(limit, tilt) - pad.theta0), tilt.shape)
        # a fold may lie beyond
        before = taken.folds & (taken.fold[3] > mu)
        to, turn = np.where(before, taken.fold, taken.z), taken.turn.copy()
        if (b := np.flatnonzero(before)).size:  # there mu is stationary
            own = who[b]
            state, ahead = self.touching[:, own], self.ahead[:, own]
            turn[:, b] = self._tangents(part.pick(b), own, to[:, b], state, ahead)
            turn[3, b] = 0.0
        for component, target, over, end in (
            (2, upright, np.abs(tilt) >= limit, TILTED),
            (3, mu, (taken.z[3] >= mu) | before, REACHED),
        ):
            i = np.flatnonzero(taken.good & over & (self.end[who] == GOING))
            if not i.size:
                continue
            way = to[:, i], turn[:, i]
            self._end_at(part.pick(i), who[i], component, target[i], *way, end)
            # a shorter step where that was not met; what is asked for may lie before 90 degrees
            missed = i[self.end[who[i]] == GOING]
            taken.good[missed] = (component == 2) & (taken.z[3, missed] >= mu[missed])
        taken.good &= self.end[who] == GOING

    def _end_at(
        self,
        part: Statics,
        who: np.ndarray,
        component: int,
        target: np.ndarray,
        to: np.ndarray,
        turn: np.ndarray,
        end: int,
    ) -> None:
        """End branches where a component of z has its target on the way to places (4, k)."""
        z, state, scale = self.z[:, who], self.touching[:, who], self.scale[:, who]
        sign = np.sign(target - z[component])
        low, high = np.zeros(who.size), np.ones(who.size)
        for _ in range(30):  # where the cubic has it first
            s = (low + high) / 2
            guess = self._cubic(who, z, to, turn, s)
            above = sign * (guess[component] - target) > 0.0
            high, low = np.where(above, s, high), np.where(above, low, s)
        guess[component] = target
        row = np.zeros((4, who.size))
        row[component] = 1.0
        found, J, good = _corrected(part, guess, state, row, target, 1.0 / scale, fine=True)
        good &= ~part.wrong(found, state).any(axis=0) & (found[3] <= self.mu_max[who])
        good &= np.abs((found - guess) * scale).max(axis=0) <= self.step[who]
        found[component] = target
        k = np.flatnonzero(good)
        own, ahead = who[k], self.ahead[:, who[k]]
        tangent = _unit(along(J[:, :, k], row[:, k]) * scale[:, k])
        tangent = tangent * np.sign((tangent * ahead).sum(axis=0))
        self.z[:, own], self.arriving[:, own], self.ahead[:, own] = found[:, k], tangent, tangent
        self.end[own] = end
        self._record(own, NODE)


def _corrected(
    part: Statics,
    start: np.ndarray,
    state: np.ndarray,
    row: np.ndarray,
    value: np.ndarray,
    size: np.ndarray,
    fine: bool = False,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Newton's method on the balance with row . z = value: places (4, k), the derivative (3, 4, k)
    of the balance there, and where it converged.

    The last step is small beside the unit `size` (4, k) and beside the penetration, beyond which
    its square is left; with `fine` it goes on down to rounding.
    """
    touching, z = 1.0 * state, start.copy()
    last = np.full(z.shape[1], np.inf)
    good = np.zeros(z.shape[1], dtype=bool)
    J = np.zeros((3, *z.shape))
    for _ in range(12):
        f, J = part.linearised(z, touching)
        A = np.concatenate([np.moveaxis(J, -1, 0), row.T[:, None, :]], axis=1)
        b = np.concatenate([f, [(row * z).sum(axis=0) - value]]).T[:, :, None]
        step, regular = solve_stack(A, b)
        move = np.where(good, 0.0, step[:, :, 0].T)
        z = z - move
        with np.errstate(all="ignore"):
            change = np.max(np.abs(move), axis=0)
            far = size[0] + np.max(np.abs(z[:3]), axis=0)
            deep = np.clip(part.deepest(z), 0.0, far)
            rounding = 4e-15 * far
            enough = np.maximum(0.0 if fine else 1e-5 * deep, rounding)
            met = (change <= enough) | ((change >= last) & (change <= 1e-6 * far))
        good |= met & regular
        last = change
        if good.all() or not np.isfinite(change[~good]).any():
            break
    return z, J, good & np.isfinite(z).all(axis=0)
