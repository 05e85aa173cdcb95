"""Equilibrium branches of many pads at once, continued by arc length through contact changes as
long as mu rises. A single pad is n = 1, so that queries, maps and curves follow the same branches.

Within a contact state a branch is smooth: a step goes along the tangent, Newton's method corrects
it in the plane across the tangent, and the step is halved where the branch turns too far. The step
ends at the first event on it, which is located to rounding: a change of contact, a fold, or the end
of the range.
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

from squeal.equilibrium.statics import Equilibria, Statics, Step, newton, take_columns
from squeal.model.equations import natural_units

# Tolerances of the continuation in natural units, where the load displaces by about one. With these
# no branch of random pads is lost; smaller steps cost time, larger ones risk a jump to another
# branch. A step is halved where mu may turn back twice on it.
FIRST_STEP = 2.0  # twice the displacement under the load
LONGEST_STEP = 4.0  # four times it; it grows with the distance from the origin
SHORTEST_STEP = 1e-10  # the branch is lost where even this fails
COSINE = 0.95  # least, between the tangents of a step: it turns by 18 degrees at most
CORRECTION = 0.10  # largest, as a share of the step: farther off lies another branch
RATIO = 8.0  # largest, of the slopes of mu at both ends of a step
SLOWER = 0.5  # least, of the slope of mu within a step to those at its ends
RISE = 0.25  # least, of mu over a step to the end of the range: near a fold it is less
CLOSEST = 1e-3  # two folds that close to one another may be passed over
MOST_STEPS = 4000  # of a branch: one that goes on after these is interrupted
FARTHEST = 100.0  # free lengths of both springs: the equilibrium has run away
CHECKS = 6  # points of a step at which it is tested which events have been passed
HALVINGS = 15  # of the interval between two of these, to tell which event comes first
AT_END = 1e-12  # of the range of mu: a step that comes so close to its end goes there
MOST_NEWTON_STEPS = 12  # to an equilibrium between two nodes, from the cubic that joins them
ALONG_MU = np.eye(4)[:, 3:]
"""The direction (4, 1) of mu: normal to the planes of one friction."""


class NodeKind(IntEnum):
    """What happens at a node of a branch."""

    POINT = 0
    CONTACT_CHANGE = 1
    FOLD = 2


class BranchEnd(IntEnum):
    """How a branch ends, in words in `squeal.equilibrium.path.Path.why_it_ends`."""

    GOING = 0
    REACHED = 1
    FOLD = 2
    INTERRUPTED = 3  # numerically: no step ahead may be taken, or rounding hides the contact
    UNBOUNDED = 4
    SEPARATED = 5
    TILTED = 6
    NO_EQUILIBRIUM = 7  # without friction, where it would begin


@dataclass(frozen=True, eq=False)
class Branches:
    """Nodes of the branches of n pads, those of one pad after each other from mu = 0 on.

    A node is an equilibrium z = (x, y, w theta, mu) in natural units at which a step ended. Lengths
    and tangents along a branch are those of scale * z.
    """

    statics: Statics  # of the pads
    # of each pad
    scale: np.ndarray  # (4, n)
    determinant_sign: np.ndarray  # (n,), see `Statics`: the same on the whole branch
    end: np.ndarray  # (n,), `BranchEnd`: how the branch ends, at its last node
    # of each node
    owner: np.ndarray  # (m,), number of its pad
    z: np.ndarray  # (4, m)
    arrives: np.ndarray  # (4, m), unit tangent before the node
    leaves: np.ndarray  # (4, m), unit tangent after it, which differs at a change of contact
    touching: np.ndarray  # (points, m), bools: the contact state after it
    kind: np.ndarray  # (m,), `NodeKind`

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
        # the last node of each pad up to mu. NumPy sorts complex numbers by their real parts, then
        # by their imaginary ones, and nodes are in this order
        keys = self.owner + 1j * self.z[3]
        node = np.maximum(np.searchsorted(keys, pad + 1j * mu, side="right") - 1, 0)
        z = take_columns(self.z, node)
        touching = take_columns(self.touching, node)
        exists = (mu >= 0.0) & (mu <= self.mu_end[pad])
        between = np.flatnonzero(exists & (z[3] != mu))  # after the node, before the next one
        if between.size:
            touching_there = touching[:, between]
            corrected, good = self._between(
                node[between], pad[between], mu[between], touching_there
            )
            failed = np.flatnonzero(~good)
            if failed.size:  # the curve between the nodes is no good guess there
                again = between[failed]
                corrected[:, failed], good[failed] = self._continued_to(
                    node[again], pad[again], mu[again], touching_there[:, failed]
                )
            z[:, between] = corrected
            exists[between] = good
        return Equilibria(z, touching, exists)

    def _between(
        self, node: np.ndarray, pad: np.ndarray, mu: np.ndarray, touching: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Equilibria of pads (k,) at mu (k,) between nodes (k,) and the next ones.

        By Newton's method from the cubic that joins both nodes. `touching` (points, k) is the
        contact state. Returns the equilibria z (4, k) = (x, y, w theta, mu) in natural units, and
        true (k,) where Newton's method leads to this branch.
        """
        following = node + 1
        start = self.z[:, node]
        end = self.z[:, following]
        curve = _cubic(
            start, end, self.leaves[:, node], self.arrives[:, following], self.scale[:, pad]
        )
        # the share of the curve at which mu is reached: as if mu rose evenly, or up to a fold as a
        # parabola rises to its top, mu = end - (end - start) (1 - share)^2
        if_even = (mu - start[3]) / (end[3] - start[3])
        if_parabola = 1.0 - np.sqrt(1.0 - if_even)
        share = np.where(self.kind[following] == NodeKind.FOLD, if_parabola, if_even)
        guess = polyval(share, curve, tensor=False)
        guess[3] = mu
        statics = self.statics.pick(pad)
        root, determinant_sign, balanced = statics.solve_balance(
            guess, 1.0 * touching, MOST_NEWTON_STEPS
        )
        # the sign excludes equilibria beyond a fold; those of other branches lie farther from the
        # guess than the nodes from each other
        near = np.abs(root - guess).max(axis=0) <= np.abs(end - start).max(axis=0)
        good = balanced & (determinant_sign == self.determinant_sign[pad]) & near
        # within rounding of a fold the balance is singular, and the cubic as good as it gets
        at_fold = (self.end[pad] == BranchEnd.FOLD) & (end[3] - mu <= 1e-8 * end[3])
        return np.where(good, root, guess), good | at_fold

    def _continued_to(
        self, node: np.ndarray, pad: np.ndarray, mu: np.ndarray, touching: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Equilibria (4, k) of pads at mu (k,), by continuing their branches from nodes anew with
        mu as the end of the range; true (k,) where mu is reached in the contact state `touching`
        (points, k)."""
        start = Equilibria(self.z[:, node], touching, np.ones(node.size, dtype=bool))
        branch = follow(self.statics.pick(pad), start, mu)
        same_contact = (branch.touching[:, branch.last] == touching).all(axis=0)
        return branch.z[:, branch.last], same_contact & (branch.end == BranchEnd.REACHED)


def follow(statics: Statics, start: Equilibria, mu_max: np.ndarray) -> Branches:
    """Continue equilibria without friction until mu reaches mu_max, or turns back.

    The branches take their steps together, each with its own length. A branch that ends leaves the
    front, and its pad's entry of `end` says why. The nodes of all steps are then sorted by pad.

    Parameters
    ----------
    statics
        Of n pads, some parameters of which are arrays (n,).
    start
        Their equilibria without friction, of `squeal.equilibrium.find.frictionless_equilibria`.
    mu_max : (n,)
        Where to stop, at least 0.
    """
    first = _first_front(statics, start, mu_max)
    end = np.where(mu_max > start.z[3], BranchEnd.GOING, BranchEnd.REACHED)
    end = np.where(start.exists, end, BranchEnd.NO_EQUILIBRIUM)
    # rounding hides which contacts touch at the start
    end[(end == BranchEnd.GOING) & statics.unresolved(start.z)] = BranchEnd.INTERRUPTED
    existing = first.pick(start.exists)
    first_nodes = _Nodes(
        owner=existing.owner,
        z=existing.z,
        arrives=existing.ahead,
        leaves=existing.ahead,
        touching=existing.touching,
        kind=np.full(existing.owner.size, NodeKind.POINT),
    )
    nodes_by_step = [first_nodes]
    front = first.pick(end == BranchEnd.GOING)  # from here on only the branches that go on
    for _ in range(MOST_STEPS):
        if not front.owner.size:
            break
        front, nodes, step_end = front.up_to_range_end().advanced()
        end[front.owner] = step_end
        nodes_by_step.append(nodes)
        going = step_end == BranchEnd.GOING
        if not going.all():
            front = front.pick(going)
    end[front.owner] = BranchEnd.INTERRUPTED  # after the most steps
    # each field of `_Nodes`, of all steps one after the other
    arrays = [np.concatenate(parts, axis=-1) for parts in zip(*nodes_by_step, strict=True)]
    nodes = _Nodes(*arrays)
    by_pad = np.argsort(nodes.owner, kind="stable")  # the nodes of a pad stay in their order
    nodes = nodes.some(by_pad)
    return Branches(
        statics=statics,
        scale=first.scale,
        determinant_sign=first.determinant_sign,
        end=end,
        **nodes._asdict(),
    )


def _first_front(statics: Statics, start: Equilibria, mu_max: np.ndarray) -> _Front:
    """The front of n branches at their starts without friction, directed along dz/dmu there.

    Arguments as of `follow`. Lengths are those of scale * z: in units of the displacement under the
    load for x, y and w theta. The scale of mu is chosen so that a change of mu counts as the
    displacement that it causes at the start.
    """
    z = start.z
    n = len(start.exists)
    touching = np.array(start.touching, dtype=bool)
    scale = np.ones((4, n))
    scale[:3] /= natural_units(statics.model).length  # the displacement under the load
    mu_rows = np.tile(ALONG_MU, n)  # rows (4, n) that pick mu: tangents with dmu = 1
    with np.errstate(all="ignore"):  # of pads without an equilibrium, which `follow` leaves out
        slope, determinant_sign = statics.tangents(z, 1.0 * touching, mu_rows)
    # `slope` is dz/dmu (4, n). mu rises along it: without friction no branch turns back
    ahead = slope * scale
    displacement = np.sqrt((ahead[:3] ** 2).sum(axis=0))  # by friction 1, to first order
    # at least 1e-3, for pads that friction hardly displaces: with 0 mu would count for nothing
    scale[3] = np.where(np.isfinite(displacement), np.maximum(displacement, 1e-3), 1.0)
    ahead[3] = scale[3]
    return _Front(
        statics=statics,
        owner=np.arange(n),
        z=z,
        touching=touching,
        ahead=_unit(ahead),
        step=np.full(n, FIRST_STEP),
        scale=scale,
        mu_max=mu_max,
        determinant_sign=determinant_sign,
    )


def _cubic(
    a: np.ndarray, b: np.ndarray, start: np.ndarray, end: np.ndarray, scale: np.ndarray
) -> np.ndarray:
    """Coefficients (4, 4, k), by power of the share 0 to 1, of the Hermite cubics of z from a to b
    (4, k) with unit tangents `start`, `end` (4, k) of scale * z."""
    chord = b - a
    length = np.sqrt(((chord * scale) ** 2).sum(axis=0)) / scale
    at_start = length * start
    at_end = length * end
    return np.array([a, at_start, 3 * chord - 2 * at_start - at_end, at_start + at_end - 2 * chord])


def _unit(v: np.ndarray) -> np.ndarray:
    """Vectors (4, k) divided by their lengths; zero where one has no length or is not a number."""
    with np.errstate(all="ignore"):
        return np.nan_to_num(v / np.sqrt((v * v).sum(axis=0)))


class _Nodes(NamedTuple):
    """Nodes (m,) of branches; see `Branches` for each array."""

    owner: np.ndarray
    z: np.ndarray
    arrives: np.ndarray
    leaves: np.ndarray
    touching: np.ndarray
    kind: np.ndarray

    def some(self, which: np.ndarray) -> _Nodes:
        """Some of the nodes, by numbers or bools."""
        return _Nodes(*(take_columns(array, which) for array in self))


class _Corrected(NamedTuple):
    """Points on k branches to which Newton's method has led, on the balance and on one condition
    more: a plane across the step, or an event function."""

    z: np.ndarray  # (4, k)
    tangent: np.ndarray  # (4, k), unit tangent of scale * z there
    slope: np.ndarray  # (4, k), derivative of the condition by z
    good: np.ndarray  # (k,), bools: whether the point may be used


class Event(IntEnum):
    """What ends a step. A change of contact has the number of its point, from 0 on."""

    RANGE_END = -1  # this and the next one are
    TILTED = -2  # past 90 degrees: the last two rows of `Statics.passed_events`
    FOLD = -3  # mu turns back
    NONE = -4


class _Front(NamedTuple):
    """Present ends of k branches. Vectors and lengths along branches are those of scale * z.

    A step ends at the first `Event` on it, where an event function changes sign.
    """

    statics: Statics  # of the pads of these branches
    owner: np.ndarray  # (k,), numbers of the pads
    z: np.ndarray  # (4, k)
    touching: np.ndarray  # (points, k), bools: the contact state
    ahead: np.ndarray  # (4, k), unit tangents
    step: np.ndarray  # (k,), length of the next step
    scale: np.ndarray  # (4, k)
    mu_max: np.ndarray  # (k,), ends of the range
    determinant_sign: np.ndarray  # (k,), see `Statics`

    def pick(self, i: np.ndarray) -> _Front:
        """Some of the branches, by numbers or bools."""
        arrays = self[1:]  # all fields but the first, `statics`
        return _Front(self.statics.pick(i), *(take_columns(array, i) for array in arrays))

    def corrected(self, start: np.ndarray, surface: np.ndarray | None) -> _Corrected:
        """Equilibria near start (4, k) that satisfy one condition more, by Newton's method.

        Parameters
        ----------
        start : array (4, k)
            Approximate equilibria of all k branches of the front.
        surface : array (points + 5, k) or None
            The condition of each, a surface as `Statics.surface_step` takes it; None for folds,
            where the determinant of the balance vanishes.
        """
        on = 1.0 * self.touching

        def step_from(z: np.ndarray, i: np.ndarray) -> Step:
            """The step from z (4, j) of the branches i (j,) that have not converged yet."""
            statics = self.statics
            touching = on
            conditions = surface
            if i.size < self.owner.size:  # else nothing has to be copied
                statics = statics.for_steps(i)
                touching = take_columns(on, i)
                if surface is not None:
                    conditions = take_columns(surface, i)
            if conditions is None:
                return statics.fold_step(z, touching)
            return statics.surface_step(z, touching, conditions)

        displacement_under_load = 1.0 / self.scale[0]  # to which x, y and w theta are scaled
        z, derivatives, converged = newton(step_from, start, unit=displacement_under_load)
        with np.errstate(all="ignore"):
            # scaled dz . ahead = 1: of the two senses of a tangent the one that goes on ahead
            tangent = self.statics.null_vectors(derivatives, rows=self.ahead * self.scale)
            condition_slope = derivatives[-1]
            return _Corrected(z, _unit(tangent * self.scale), condition_slope, converged)

    def _passed_on(self, curve: np.ndarray, fold: bool) -> Callable[[np.ndarray], np.ndarray]:
        """A function of the share of curves (4, 4, k): which events have been passed there.

        The fold alone, or all other events. Shares and answers as of `Statics.passed_events_on`.
        """
        if not fold:
            return self.statics.passed_events_on(curve, 1.0 * self.touching, self.mu_max)

        def turned_back(share: np.ndarray) -> np.ndarray:
            mu = curve[:, 3] if share.ndim == 1 else curve[:, 3, None]
            return (polyval(share, polyder(mu), tensor=False) < 0.0)[None]

        return turned_back

    def located_event(
        self,
        new: np.ndarray,
        curve: np.ndarray,
        low: np.ndarray,
        high: np.ndarray,
        fold: bool,
    ) -> tuple[_Corrected, np.ndarray]:
        """The fold, or the first of the other events, on each of k steps, and its number (k,).

        Halving of an interval of the share of the curve shows which event is first and about where;
        Newton's method then locates it to rounding. `good` of the result is false where that fails
        or where the event lies outside the step. Of events other than folds it is also false where
        another one comes first; a fold need not be the first event, since its step is searched for
        the others afterwards. Numbers are those of `Event`.

        Parameters
        ----------
        new : array (4, k)
            Ends of the steps.
        curve : array (4, 4, k)
            From the present ends of the branches to those of the steps, see `_cubic`.
        low, high : array (k,)
            Shares of the curves between which an event lies.
        fold : bool
            Whether folds are located, or the other events.
        """
        passed = self._passed_on(curve, fold)  # which events (events, k) at shares (k,)
        before = low
        after = high
        for _ in range(HALVINGS):
            middle = (before + after) / 2
            has_passed = passed(middle).any(axis=0)
            before = np.where(has_passed, before, middle)
            after = np.where(has_passed, middle, after)
        guess = polyval(after, curve, tensor=False)
        if fold:
            event = np.full(after.size, Event.FOLD)
            located = self.corrected(guess, None)
        else:
            passed_events = passed(after)
            row = np.argmax(passed_events, axis=0)  # of the first event that has been passed
            # the last rows are those of RANGE_END = -1 and TILTED = -2, counted from the end
            event = np.where(row < len(self.touching), row, row - len(passed_events))
            located = self._corrected_to_event(event, guess)
        good = located.good & self._lies_on_step(located.z, new)
        return located._replace(good=good), event

    def _corrected_to_event(self, event: np.ndarray, guess: np.ndarray) -> _Corrected:
        """Events other than folds, by their numbers (k,), located from guesses (4, k) by Newton's
        method; `good` is false where that fails or where another event comes first."""
        z, tangent, slope, good = self.corrected(guess, self._event_surface(event, guess))
        # where another event is passed already, this one is not the first. The number of an event
        # is that of its row: points from 0 on, -1 and -2 in the last two rows
        others = self.statics.passed_events(z, 1.0 * self.touching, self.mu_max)
        others[event, np.arange(event.size)] = False
        # a gap has to pass zero in the sense that changes the contact: the event function, whose
        # derivative by z is `slope`, rises along the tangent
        rises = (slope * tangent / self.scale).sum(axis=0) > 0.0
        is_change = event >= 0
        good &= ~others.any(axis=0) & (rises | ~is_change)
        # Newton's method leaves mu next to the end of the range; the end itself is meant
        z[3] = np.where(event == Event.RANGE_END, self.mu_max, z[3])
        return _Corrected(z, tangent, slope, good)

    def _event_surface(self, event: np.ndarray, z: np.ndarray) -> np.ndarray:
        """The conditions (points + 5, k) that hold at events, linear in the gaps and in z.

        Rows as in `Statics.surface_step`: weights of the gaps, weights of z = (x, y, w theta, mu),
        and the value of the sum. event (k,): numbers, none a fold; z (4, k): near the event, for
        the sense of the tilt.
        """
        pad = self.statics.model.pad
        surface = self.no_surface()  # zeros
        # views of its rows: (points, k), (4, k) and (k,)
        weights = surface[:-5]
        normal = surface[-5:-1]
        offset = surface[-1]
        # event functions rise through zero: the gap of a point that touches, or minus the gap of
        # one that does not
        is_gap_of = event == np.arange(len(weights))[:, None]
        weights[:] = is_gap_of * np.where(self.touching, 1.0, -1.0)
        # sense (theta0 + z_2 / w) = pi / 2, where z_2 = w theta
        is_tilt = event == Event.TILTED
        sense = np.sign(self.statics.tilt(z))
        normal[2, is_tilt] = (sense / pad.w)[is_tilt]
        offset[is_tilt] = (math.pi / 2 - sense * pad.theta0)[is_tilt]
        is_end = event == Event.RANGE_END
        normal[3, is_end] = 1.0
        offset[is_end] = self.mu_max[is_end]
        return surface

    def no_surface(self) -> np.ndarray:
        """Zeros (points + 5, k) for conditions, see `Statics.surface_step`."""
        return np.zeros((len(self.touching) + 5, self.owner.size))

    def _lies_on_step(self, z: np.ndarray, new: np.ndarray) -> np.ndarray:
        """Whether (k,) z (4, k) lie between the present ends of the branches and the ends `new`
        (4, k) of steps, to a millionth of the step, not far aside of it and not at a smaller mu."""
        vector = (z - self.z) * self.scale / self.step
        step_vector = (new - self.z) * self.scale / self.step
        forwards = (self.ahead * vector).sum(axis=0)
        step_forwards = (self.ahead * step_vector).sum(axis=0)
        distance = np.sqrt((vector**2).sum(axis=0))
        between = (forwards >= -1e-6) & (forwards <= step_forwards + 1e-6)
        between &= z[3] >= self.z[3] * (1.0 - 1e-12)  # row 3 is mu
        return between & (distance <= forwards / COSINE + 1e-6)

    def turns_at_most_once(self, z: np.ndarray, tangent: np.ndarray) -> np.ndarray:
        """False (k,) for steps to z (4, k), with tangents (4, k) there, on which mu may turn back
        twice: its slope by the share of the cubic changes too much."""
        slope = polyder(_cubic(self.z, z, self.ahead, tangent, self.scale)[:, 3])
        at_start = slope[0]
        at_end = slope.sum(axis=0)
        slow, fast = np.sort([at_start, at_end], axis=0)  # slow <= 0: a fold, which is located
        # the slope of a cubic is a parabola: between the ends it is extreme at its vertex
        with np.errstate(all="ignore"):
            extremum = np.clip(np.nan_to_num(-slope[1] / (2 * slope[2])), 0.0, 1.0)
            within = polyval(extremum, slope, tensor=False)
        even = (fast <= RATIO * slow) & (within >= SLOWER * slow)
        return (slow <= 0.0) | (self.step < CLOSEST) | even

    def _stepped(self) -> _Corrected:
        """Points a step ahead, corrected in the plane across `ahead` (pseudo-arclength), or at the
        end of the range of mu where the tangent reaches it.

        `good` is where the step may be taken: the correction is short, and the branch turns little.
        """
        guess = self.z + self.step * self.ahead / self.scale
        # steps that reach the end of the range: there mu is held, not the place along the tangent
        is_last = np.abs(guess[3] - self.mu_max) <= AT_END * self.mu_max
        is_last &= self.ahead[3] >= RISE
        normal = np.where(is_last, ALONG_MU, self.ahead * self.scale)
        guess[3] = np.where(is_last, self.mu_max, guess[3])
        # the plane normal . z = normal . guess: below the weights of gaps, which are zero, a
        # surface has four rows of its normal and one of its right side
        plane = self.no_surface()
        plane[-5:-1] = normal
        plane[-1] = (normal * guess).sum(axis=0)
        z, tangent, slope, good = self.corrected(guess, plane)
        z[3] = np.where(is_last, self.mu_max, z[3])
        with np.errstate(all="ignore"):
            squared_correction = (((z - guess) * self.scale) ** 2).sum(axis=0)
            good &= squared_correction <= (CORRECTION * self.step) ** 2
        good &= (tangent * self.ahead).sum(axis=0) >= COSINE
        good &= self.turns_at_most_once(z, tangent)
        return _Corrected(z, tangent, slope, good)

    def _up_to_event(self, corrected: _Corrected) -> tuple[_Corrected, np.ndarray]:
        """The steps, each cut off at the first event on it, and the events' numbers (k,).

        A step with an event that cannot be located may not be taken.
        """
        steps = _Corrected(*map(np.copy, corrected))
        # the arrays of `steps` themselves, without the slopes: the loop below writes into them
        z, tangent, _, good = steps
        z[:, ~good] = self.z[:, ~good]  # steps that may not be taken have no length here
        event = np.full(good.size, Event.NONE)
        shares = np.linspace(0.0, 1.0, CHECKS + 1)
        # first cut off at a fold, then at the other events on the way to it
        for fold in (True, False):
            curve = _cubic(self.z, z, self.ahead, tangent, self.scale)
            passed = self._passed_on(curve, fold)(shares[1:, None])  # (events, checks, k)
            any_passed = np.any(passed, axis=0)  # (checks, k)
            i = np.flatnonzero(good & any_passed.any(axis=0))  # the steps with an event
            if not i.size:
                continue
            # an event is first passed at check `first`, which lies at shares[first + 1]
            first = np.argmax(take_columns(any_passed, i), axis=0)
            low = shares[first]
            high = shares[first + 1]
            with_event = self if i.size == good.size else self.pick(i)
            located, event[i] = with_event.located_event(
                take_columns(z, i), take_columns(curve, i), low, high, fold
            )
            for array, at_event in zip(steps, located, strict=True):
                array[..., i] = at_event
        # a step that goes just to the end of the range has not passed it
        event[good & (event == Event.NONE) & (z[3] == self.mu_max)] = Event.RANGE_END
        return steps, event

    def up_to_range_end(self) -> _Front:
        """The front with steps that are cut off where their tangents reach the end of the range."""
        with np.errstate(all="ignore"):
            to_end = (self.mu_max - self.z[3]) * self.scale[3] / self.ahead[3]
        reaches_end = (self.ahead[3] >= RISE) & (to_end < self.step)
        return self._replace(step=np.where(reaches_end, to_end, self.step))

    def advanced(self) -> tuple[_Front, _Nodes, np.ndarray]:
        """One more step of each branch, up to the first event on it.

        A step that may not be taken leaves its branch where it is, with half the step ahead.

        Returns
        -------
        front : _Front
            The ends of all k branches after the step.
        nodes : _Nodes
            Of the steps that were taken, at most k.
        end : array (k,)
            `BranchEnd`: how each branch ends there, or `GOING`.
        """
        corrected, event = self._up_to_event(self._stepped())
        good = corrected.good
        z = np.where(good, corrected.z, self.z)
        is_change = event >= 0
        kind = np.full(event.size, NodeKind.POINT)
        kind[event == Event.FOLD] = NodeKind.FOLD
        kind[is_change] = NodeKind.CONTACT_CHANGE
        ahead, touching, separated = self._after_changes(
            changed=np.flatnonzero(good & is_change),
            event=event,
            z=z,
            tangent=np.where(good, corrected.tangent, self.ahead),
            slope=corrected.slope,
        )
        farthest = np.max(np.abs(z * self.scale), axis=0)
        longer = np.minimum(2.0 * self.step, LONGEST_STEP * (1.0 + 0.1 * farthest))
        next_step = np.where(good, longer, self.step / 2)
        # only a refused step ends its branch so: one that was taken may be short because the end of
        # the range cut it off
        too_short = next_step < SHORTEST_STEP
        end_refused = np.where(too_short, BranchEnd.INTERRUPTED, BranchEnd.GOING)
        end = np.where(good, self._ends(z, ahead, event, separated), end_refused)
        nodes = _Nodes(
            owner=self.owner,
            z=z,
            arrives=corrected.tangent,
            leaves=ahead,
            touching=touching,
            kind=kind,
        )
        front = self._replace(z=z, touching=touching, ahead=ahead, step=next_step)
        return front, nodes.some(good), end

    def _after_changes(
        self,
        changed: np.ndarray,
        event: np.ndarray,
        z: np.ndarray,
        tangent: np.ndarray,
        slope: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """How the branches go on after their steps, some of which ended at a change of contact.

        The tangent of the new contact state is the one along which the event function goes on
        rising. A pad that has separated keeps the tangent and the state before.

        Parameters
        ----------
        changed : array (j,)
            Numbers of the branches with a change of contact.
        event : array (k,)
            Number of the event at the end of each step, if any.
        z, tangent, slope : array (4, k)
            Ends of the steps, unit tangents there, and derivatives of the event functions by z.

        Returns
        -------
        ahead : array (4, k)
            Unit tangents after the changes.
        touching : array (points, k)
            Contact states there.
        separated : array (k,) of bool
            Where no point touches any more.
        """
        touching = self.touching.copy()
        # the event has the number of the contact point that changes: it touches now, or separates
        touching[event[changed], changed] ^= True
        separated = np.asarray(np.all(~touching, axis=0))
        ahead = tangent.copy()
        if changed.size:
            on = 1.0 * take_columns(touching, changed)
            statics = self.statics.pick(changed)
            # along these tangents the event function rises, at the rate slope . tangent = 1
            new_tangent, _ = statics.tangents(
                take_columns(z, changed), on, take_columns(slope, changed)
            )
            new_tangent = _unit(new_tangent * take_columns(self.scale, changed))
            ahead[:, changed] = np.where(separated[changed], ahead[:, changed], new_tangent)
        touching[:, separated] = self.touching[:, separated]
        return ahead, touching, separated

    def _ends(
        self,
        z: np.ndarray,
        ahead: np.ndarray,
        event: np.ndarray,
        separated: np.ndarray,
    ) -> np.ndarray:
        """How (k,) branches end at z (4, k), by the first reason that holds, else `GOING`.

        ahead (4, k): tangents; event (k,): at the ends of the steps; separated (k,): see
        `_after_changes`.
        """
        pad = self.statics.model.pad
        far = np.max(np.abs(z[:2]), axis=0) > FARTHEST * (pad.L1 + pad.L2)
        reasons = {
            BranchEnd.SEPARATED: separated,
            BranchEnd.REACHED: event == Event.RANGE_END,
            # past a change of contact mu may fall along the branch at once
            BranchEnd.FOLD: (event == Event.FOLD) | (ahead[3] < 0.0),
            BranchEnd.TILTED: event == Event.TILTED,
            BranchEnd.UNBOUNDED: far,
            BranchEnd.INTERRUPTED: self.statics.unresolved(z),
        }
        return np.select(list(reasons.values()), list(reasons), BranchEnd.GOING)
