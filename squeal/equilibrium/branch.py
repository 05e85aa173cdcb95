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
from enum import IntEnum
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval

from squeal.equilibrium.statics import Equilibria, Statics, Step, newton, null_vectors, of_some
from squeal.model.equations import natural_units
from squeal.schema import Place, require_positive


class NodeKind(IntEnum):
    """What happens at a node of a branch."""

    POINT = 0
    CONTACT_CHANGE = 1
    FOLD = 2


class BranchEnd(IntEnum):
    """How a branch ends, in words in `squeal.equilibrium.path.Path.end`."""

    GOING = 0
    REACHED = 1
    FOLD = 2
    LOST = 3
    UNBOUNDED = 4
    SEPARATED = 5
    TILTED = 6
    NO_EQUILIBRIUM = 7  # without friction, where it would begin


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
    checks: int = 6  # places within a step at which events are looked for
    halvings: int = 15  # of the interval between two of these, to tell which event comes first

    def __post_init__(self) -> None:
        require_positive(self)
        if not self.cosine < 1.0:
            raise (Place("BranchOptions") / "cosine").must_be(self.cosine, "a number below 1")


@dataclass(frozen=True, eq=False)
class Branches:
    """Nodes of the branches of n pads, those of one pad after each other from mu = 0 on.

    statics: of the pads; scale (4, n): what makes lengths and tangents of a pad; side (n,): see
    `Statics.side`, which it keeps as long as mu rises; end (n,): how each branch ends,
    the last node being where, see `BranchEnd`. Of each node: owner (m,): its pad; z (4, m) =
    (x, y, w theta, mu) in its units; arrives, leaves (4, m): unit tangents of scale z before and
    behind it; touching (points, m): the contact state behind it; kind (m,): see `NodeKind`.
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
        """The largest mu (n,) of each pad; NaN without an equilibrium."""
        mu = np.full(len(self.end), np.nan)
        exists = self.end != BranchEnd.NO_EQUILIBRIUM
        mu[exists] = self.z[3, self.last[exists]]
        return mu

    def at(self, pad: np.ndarray, mu: np.ndarray) -> Equilibria:
        """The equilibria of pads (k,) at mu (k,), at a change of contact in the new state.

        There is none beyond `mu_end`.
        """
        # complex numbers are sorted by their real parts, then by their imaginary ones
        keys = self.owner + 1j * self.z[3]
        node = np.maximum(np.searchsorted(keys, pad + 1j * mu, side="right") - 1, 0)
        z = of_some(self.z, node)
        touching = of_some(self.touching, node)
        exists = (mu >= 0.0) & (mu <= self.mu_end[pad])
        between = np.flatnonzero(exists & (z[3] != mu))  # behind the node, before the next one
        if between.size:
            touching_there = touching[:, between]
            corrected, good = self._between(
                node[between], pad[between], mu[between], touching_there
            )
            missed = np.flatnonzero(~good)
            if missed.size:  # a component runs far ahead of the others
                far = between[missed]
                corrected[:, missed], good[missed] = self._followed(
                    node[far], pad[far], mu[far], touching_there[:, missed]
                )
            z[:, between] = corrected
            exists[between] = good
        return Equilibria(z, touching, exists)

    def _between(
        self, node: np.ndarray, pad: np.ndarray, mu: np.ndarray, touching: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Equilibria (4, k) of pads at mu (k,) behind nodes, by Newton's method from the curve to
        the next nodes; true (k,) where it leads to this branch."""
        following = node + 1
        start = self.z[:, node]
        end = self.z[:, following]
        curve = _cubic(
            start, end, self.leaves[:, node], self.arrives[:, following], self.scale[:, pad]
        )
        # as if mu rose evenly, to a fold as a parabola does to its top
        even = (mu - start[3]) / (end[3] - start[3])
        to_top = 1.0 - np.sqrt(1.0 - even)
        share = np.where(self.kind[following] == NodeKind.FOLD, to_top, even)
        guess = polyval(share, curve, tensor=False)
        guess[3] = mu
        root, side = self.statics.pick(pad).settle(guess, 1.0 * touching, 12)
        # across a fold the sign differs; other branches lie farther off
        near = np.abs(root - guess).max(axis=0) <= np.abs(end - start).max(axis=0)
        good = (side == self.side[pad]) & near
        # within rounding of a fold the balance is singular, and the cubic as good as it gets
        at_fold = (self.end[pad] == BranchEnd.FOLD) & (end[3] - mu <= 1e-8 * end[3])
        return np.where(good, root, guess), good | at_fold

    def _followed(
        self, node: np.ndarray, pad: np.ndarray, mu: np.ndarray, touching: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Equilibria (4, k) of pads at mu (k,), by following their branches again from nodes;
        true (k,) where the branch reaches mu in the contact state `touching`."""
        start = Equilibria(self.z[:, node], touching, np.ones(node.size, dtype=bool))
        branch = follow(self.statics.pick(pad), start, mu)
        same_contact = (branch.touching[:, branch.last] == touching).all(axis=0)
        return branch.z[:, branch.last], same_contact & (branch.end == BranchEnd.REACHED)


def follow(
    statics: Statics, start: Equilibria, mu_max: np.ndarray, options: BranchOptions | None = None
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
    options = options or BranchOptions()
    front, side = _begin(statics, start, mu_max, options)
    scale = front.scale
    end = np.where(mu_max > start.z[3], BranchEnd.GOING, BranchEnd.REACHED)
    end = np.where(start.exists, end, BranchEnd.NO_EQUILIBRIUM)
    end[(end == BranchEnd.GOING) & statics.unresolved(start.z)] = BranchEnd.LOST
    begin = front.pick(start.exists)
    first_nodes = _Nodes(
        owner=begin.owner,
        z=begin.z,
        arrives=begin.ahead,
        leaves=begin.ahead,
        touching=begin.state,
        kind=np.full(begin.owner.size, NodeKind.POINT),
    )
    nodes = [first_nodes]
    front = front.pick(end == BranchEnd.GOING)
    for _ in range(options.most_steps):
        if not front.owner.size:
            break
        front, taken, step_end = front.moved(options)
        end[front.owner] = step_end
        nodes.append(taken)
        going = step_end == BranchEnd.GOING
        if not going.all():
            front = front.pick(going)
    end[front.owner] = BranchEnd.LOST
    every = _Nodes(*(np.concatenate(arrays, axis=-1) for arrays in zip(*nodes, strict=True)))
    by_pad = np.argsort(every.owner, kind="stable")
    every = every.some(by_pad)
    return Branches(statics=statics, scale=scale, side=side, end=end, **every._asdict())


def _begin(
    statics: Statics, start: Equilibria, mu_max: np.ndarray, options: BranchOptions
) -> tuple[_Front, np.ndarray]:
    """The branches of n pads where they begin, and `Statics.side` (n,) there; see `follow`."""
    z = start.z
    n = len(start.exists)
    state = np.array(start.touching, dtype=bool)
    scale = np.ones((4, n))
    scale[:3] /= natural_units(statics.model, (0.0,) * 6).length
    of_mu = np.tile(np.eye(4)[:, 3:], n)
    with np.errstate(all="ignore"):
        slope, side = statics.tangents(z, 1.0 * state, of_mu)
    # dz/dmu: without friction no branch turns back
    ahead = slope * scale
    moves = np.sqrt((ahead[:3] ** 2).sum(axis=0))
    # mu counts as what it displaces at the start
    scale[3] = np.where(np.isfinite(moves), np.maximum(moves, 1e-3), 1.0)
    ahead[3] = scale[3]
    front = _Front(
        statics=statics,
        owner=np.arange(n),
        z=z,
        state=state,
        ahead=_unit(ahead),
        step=np.full(n, options.first_step),
        scale=scale,
        mu_max=mu_max,
    )
    return front, side


def _cubic(
    a: np.ndarray, b: np.ndarray, start: np.ndarray, end: np.ndarray, scale: np.ndarray
) -> np.ndarray:
    """Coefficients (4, 4, k) of a curve from places a to b (4, k) with unit tangents start, end."""
    chord = b - a
    length = np.sqrt(((chord * scale) ** 2).sum(axis=0)) / scale
    at_start = length * start
    at_end = length * end
    return np.array([a, at_start, 3 * chord - 2 * at_start - at_end, at_start + at_end - 2 * chord])


def _unit(v: np.ndarray) -> np.ndarray:
    """Vectors (4, k) of length 1; where there is none zero."""
    with np.errstate(all="ignore"):
        return np.nan_to_num(v / np.sqrt((v * v).sum(axis=0)))


class _Nodes(NamedTuple):
    """Nodes of branches, see `Branches`."""

    owner: np.ndarray
    z: np.ndarray
    arrives: np.ndarray
    leaves: np.ndarray
    touching: np.ndarray
    kind: np.ndarray

    def some(self, which: np.ndarray) -> _Nodes:
        """Some of the nodes, by numbers or bools."""
        return _Nodes(*(of_some(array, which) for array in self))


class _Located(NamedTuple):
    """Events (k,) located on steps: place z (4, k), unit tangent of scale z there, derivative of
    the event function by z (4, k), whether it was located (k,), and which event it is (k,)."""

    z: np.ndarray
    tangent: np.ndarray
    slope: np.ndarray
    good: np.ndarray
    event: np.ndarray


class _Corrected(NamedTuple):
    """Places z (4, k) on branches, unit tangents of scale z there (4, k), the derivative (4, k) of
    the condition that chose the place, and whether (k,) it was found."""

    z: np.ndarray
    tangent: np.ndarray
    slope: np.ndarray
    good: np.ndarray


NO_EVENT = -1


class _Front(NamedTuple):
    """Present ends of k branches; vectors and lengths are those of `scale` z.

    statics: of their pads; owner (k,): the pads' numbers; z (4, k): places; state (points, k):
    which contact points touch; ahead (4, k): unit vectors along the branches; step (k,): length of
    the next step; scale (4, k): see `Branches`; mu_max (k,): ends of the range.

    Events are what changes sign where a step has to end, by number: the gap of each contact point,
    the tilt past 90 degrees, mu past the end of the range, and last a fold.
    """

    statics: Statics
    owner: np.ndarray
    z: np.ndarray
    state: np.ndarray
    ahead: np.ndarray
    step: np.ndarray
    scale: np.ndarray
    mu_max: np.ndarray

    @property
    def tilted(self) -> int:
        """Number of the event that the pad turns past 90 degrees; contact changes come before."""
        return len(self.state)

    @property
    def range_end(self) -> int:
        """Number of the event that mu reaches the end of the range."""
        return len(self.state) + 1

    @property
    def fold(self) -> int:
        """Number of the event that mu turns back."""
        return len(self.state) + 2

    def pick(self, i: np.ndarray) -> _Front:
        """Some of the branches, by numbers or bools."""
        return _Front(self.statics.pick(i), *(of_some(array, i) for array in self[1:]))

    def corrected(self, start: np.ndarray, surface: np.ndarray | None) -> _Corrected:
        """Places from start (4, k) on the balance and on surfaces, see `Statics.surface_step`, or
        on folds where there are no surfaces."""
        on = 1.0 * self.state
        rows = self.ahead * self.scale

        def step_from(z: np.ndarray, i: np.ndarray) -> Step:
            if surface is None:
                return self.statics.pick(i).fold_step(z, of_some(on, i))
            if i.size == self.owner.size:
                return self.statics.surface_step(z, on, surface)
            return self.statics.for_steps(i).surface_step(z, of_some(on, i), of_some(surface, i))

        z, derivatives, good = newton(step_from, start, 1.0 / self.scale[0])
        with np.errstate(all="ignore"):
            if surface is None:
                along = null_vectors(derivatives[:3], rows)
            else:
                along = self.statics.null_vectors(derivatives, rows)
            return _Corrected(z, _unit(along * self.scale), derivatives[-1], good)

    def past(self, curve: np.ndarray, fold: bool) -> Callable[[np.ndarray], np.ndarray]:
        """Which events, the fold or all others, lie behind a share of curves, as a function of it;
        see `Statics.events_behind_on`."""
        if not fold:
            return self.statics.events_behind_on(curve, 1.0 * self.state, self.mu_max)

        def turned_back(share: np.ndarray) -> np.ndarray:
            mu = curve[:, 3] if share.ndim == 1 else curve[:, 3, None]
            return (polyval(share, polyder(mu), tensor=False) < 0.0)[None]

        return turned_back

    def located(
        self,
        new: np.ndarray,
        curve: np.ndarray,
        low: np.ndarray,
        high: np.ndarray,
        fold: bool,
        options: BranchOptions,
    ) -> _Located:
        """A fold, or the first of the other events, between the shares low and high (k,) of steps
        along curves to new places (4, k)."""
        branches = np.arange(self.owner.size)
        past = self.past(curve, fold)
        before = low
        behind = high
        for _ in range(options.halvings):
            middle = (before + behind) / 2
            is_past = past(middle).any(axis=0)
            before = np.where(is_past, before, middle)
            behind = np.where(is_past, middle, behind)
        event = np.argmax(past(behind), axis=0)
        guess = polyval(behind, curve, tensor=False)
        surface = None if fold else self._event_surface(event, guess)
        z, tangent, slope, good = self.corrected(guess, surface)
        if fold:
            event = np.full(event.size, self.fold)
        else:
            others = self.statics.events_behind(z, 1.0 * self.state, self.mu_max)
            others[event, branches] = False
            rate = (slope * tangent / self.scale).sum(axis=0)  # of the event function
            is_gap = event < self.tilted
            good &= ~others.any(axis=0) & ((rate > 0.0) | ~is_gap)
            z[3] = np.where(event == self.range_end, self.mu_max, z[3])
        return _Located(z, tangent, slope, good & self._on_the_way(z, new, options), event)

    def _event_surface(self, event: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Conditions (points + 5, k) under which the events (k,) lie, linear in the gaps and in z.

        See `Statics.surface_step`: weights of the gaps, those of z = (x, y, w theta, mu), and what
        the sum is to be. event: none a fold; z (4, k): near the event, for the sense of the tilt.
        """
        pad = self.statics.model.pad
        surface = self.no_surface()
        weights = surface[: self.tilted]
        normal = surface[self.tilted : -1]
        offset = surface[-1]
        # as functions of events rise at them: the gap of a point that touches, or minus it
        is_gap_of = event == np.arange(self.tilted)[:, None]
        weights[:] = is_gap_of * np.where(self.state, 1.0, -1.0)
        is_tilt = event == self.tilted
        sense = np.sign(self.statics.tilt(z))  # theta0 + theta is to be 90 degrees of this sense
        normal[2, is_tilt] = (sense / pad.w)[is_tilt]
        offset[is_tilt] = (math.pi / 2 - sense * pad.theta0)[is_tilt]
        is_end = event == self.range_end
        normal[3, is_end] = 1.0
        offset[is_end] = self.mu_max[is_end]
        return surface

    def no_surface(self) -> np.ndarray:
        """Conditions (points + 5, k) that are yet to be written, see `Statics.surface_step`."""
        return np.zeros((self.tilted + 5, self.owner.size))

    def _on_the_way(self, z: np.ndarray, new: np.ndarray, options: BranchOptions) -> np.ndarray:
        """Whether (k,) places z (4, k) lie between the present places and new ones, to a millionth
        of the step, and not far aside."""
        way = (z - self.z) * self.scale / self.step
        whole_way = (new - self.z) * self.scale / self.step
        forwards = (self.ahead * way).sum(axis=0)
        step_forwards = (self.ahead * whole_way).sum(axis=0)
        distance = np.sqrt((way**2).sum(axis=0))
        between = (forwards >= -1e-6) & (forwards <= step_forwards + 1e-6)
        return between & (distance <= forwards / options.cosine + 1e-6)

    def turns_at_most_once(
        self, z: np.ndarray, tangent: np.ndarray, options: BranchOptions
    ) -> np.ndarray:
        """False for steps to places z with given tangents on which mu may turn back twice."""
        rate = polyder(_cubic(self.z, z, self.ahead, tangent, self.scale)[:, 3])
        at_start = rate[0]
        at_end = rate.sum(axis=0)
        slow, fast = np.sort([at_start, at_end], axis=0)
        with np.errstate(all="ignore"):
            extremum = np.clip(np.nan_to_num(-rate[1] / (2 * rate[2])), 0.0, 1.0)
            within = polyval(extremum, rate, tensor=False)
        even = (fast <= options.ratio * slow) & (within >= options.slower * slow)
        return (slow <= 0.0) | (self.step < options.closest) | even

    def _stepped(self, options: BranchOptions) -> _Corrected:
        """Places a step ahead; `good` is where the step may be taken.

        In z * scale, where `ahead` has unit length, a place is corrected in the plane across it.
        """
        normal = self.ahead * self.scale
        guess = self.z + self.step * self.ahead / self.scale
        plane = self.no_surface()
        plane[self.tilted : -1] = normal
        plane[-1] = (normal * guess).sum(axis=0)
        z, tangent, slope, good = self.corrected(guess, plane)
        with np.errstate(all="ignore"):
            correction = (((z - guess) * self.scale) ** 2).sum(axis=0)
            good &= correction <= (options.correction * self.step) ** 2
        good &= (tangent * self.ahead).sum(axis=0) >= options.cosine
        good &= self.turns_at_most_once(z, tangent, options)
        return _Corrected(z, tangent, slope, good)

    def _up_to_event(
        self, step: _Corrected, options: BranchOptions
    ) -> tuple[_Corrected, np.ndarray]:
        """Steps that end at the first event on each, and its number (k,), `NO_EVENT` without one.

        Where there is an event that cannot be located, the step may not be taken.
        """
        z = np.where(step.good, step.z, self.z)
        tangent = step.tangent.copy()
        slope = step.slope.copy()
        good = step.good.copy()
        event = np.full(good.size, NO_EVENT)
        shares = np.linspace(0.0, 1.0, options.checks + 1)
        for fold in (True, False):  # other events lie on the way to the fold
            curve = _cubic(self.z, z, self.ahead, tangent, self.scale)
            past = np.any(self.past(curve, fold)(shares[1:, None]), axis=0)
            i = np.flatnonzero(good & past.any(axis=0))
            if not i.size:
                continue
            first = np.argmax(of_some(past, i), axis=0)  # of the places that lie behind an event
            low = shares[first]
            high = shares[first + 1]
            some = self if i.size == good.size else self.pick(i)
            found = some.located(of_some(z, i), of_some(curve, i), low, high, fold, options)
            z[:, i] = found.z
            tangent[:, i] = found.tangent
            slope[:, i] = found.slope
            good[i] = found.good
            event[i] = found.event
        return _Corrected(z, tangent, slope, good), event

    def moved(self, options: BranchOptions) -> tuple[_Front, _Nodes, np.ndarray]:
        """The ends after one more step, up to the first event on it, or half as far ahead where it
        is refused; the nodes of steps that were taken; how (k,) branches end there if they do."""
        taken, event = self._up_to_event(self._stepped(options), options)
        good = taken.good
        z = np.where(good, taken.z, self.z)
        is_change = (event != NO_EVENT) & (event < self.tilted)
        kind = np.full(event.size, NodeKind.POINT)
        kind[event == self.fold] = NodeKind.FOLD
        kind[is_change] = NodeKind.CONTACT_CHANGE
        ahead, state, separated = self._behind_changes(
            changed=np.flatnonzero(good & is_change),
            event=event,
            z=z,
            tangent=np.where(good, taken.tangent, self.ahead),
            slope=taken.slope,
        )
        step_end = self._ends(z, ahead, event, separated, options)
        step_end = np.where(good, step_end, BranchEnd.GOING)
        farthest = np.max(np.abs(z * self.scale), axis=0)
        longer = np.minimum(2.0 * self.step, options.longest_step * (1.0 + 0.1 * farthest))
        step = np.where(good, longer, self.step / 2)
        step_end[step < options.shortest_step] = BranchEnd.LOST
        nodes = _Nodes(
            owner=self.owner, z=z, arrives=taken.tangent, leaves=ahead, touching=state, kind=kind
        )
        front = self._replace(z=z, state=state, ahead=ahead, step=step)
        return front, nodes.some(good), step_end

    def _behind_changes(
        self,
        changed: np.ndarray,
        event: np.ndarray,
        z: np.ndarray,
        tangent: np.ndarray,
        slope: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Tangents (4, k), contact states (points, k) and where (k,) the pad has separated, behind
        the changes of contact on some branches, numbers `changed` (j,).

        A pad that has separated keeps its tangent and state. event (k,), z, tangent, slope (4, k):
        the event that each step ended at, if any, the place, and there the tangent and the
        derivative of the event function.
        """
        state = self.state.copy()
        state[event[changed], changed] ^= True
        separated = np.asarray(np.all(~state, axis=0))
        ahead = tangent.copy()
        if changed.size:
            on = 1.0 * of_some(state, changed)
            statics = self.statics.pick(changed)
            turned, _ = statics.tangents(of_some(z, changed), on, of_some(slope, changed))
            turned = _unit(turned * of_some(self.scale, changed))
            ahead[:, changed] = np.where(separated[changed], ahead[:, changed], turned)
        state[:, separated] = self.state[:, separated]
        return ahead, state, separated

    def _ends(
        self,
        z: np.ndarray,
        ahead: np.ndarray,
        event: np.ndarray,
        separated: np.ndarray,
        options: BranchOptions,
    ) -> np.ndarray:
        """How (k,) branches end at places z, the first reason that holds, else `GOING`."""
        pad = self.statics.model.pad
        far = np.max(np.abs(z[:2]), axis=0) > options.farthest * (pad.L1 + pad.L2)
        reasons = {
            BranchEnd.SEPARATED: separated,
            BranchEnd.REACHED: event == self.range_end,
            BranchEnd.FOLD: (event == self.fold) | (ahead[3] < 0.0),
            BranchEnd.TILTED: event == self.tilted,
            BranchEnd.UNBOUNDED: far,
            BranchEnd.LOST: self.statics.unresolved(z),
        }
        return np.select(list(reasons.values()), list(reasons), BranchEnd.GOING)
