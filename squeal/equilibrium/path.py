"""The equilibrium branch as a function of mu, as far as mu rises along it."""

from __future__ import annotations

import bisect
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from squeal.equilibrium.branch import Branch, follow
from squeal.equilibrium.find import NO_START, Equilibrium, least_at_zero, record
from squeal.equilibrium.many import solved
from squeal.equilibrium.settings import DEFAULT, ContinuationSettings
from squeal.equilibrium.statics import Point
from squeal.errors import ComputationError
from squeal.model.equations import PadModel
from squeal.model.linear import Linearisation, linearise, linearised_at
from squeal.model.states import State

PASSES = 8  # of Newton's method for many places at once; what then is open is solved alone


@dataclass(frozen=True)
class Path:
    """The branch from mu = 0 up to its first fold, or to its end.

    `breakpoints` are the values of mu at which the contact state changes; `fold` is the value at
    which the branch turns back, None if it does not; `end` says why it stops.
    """

    model: PadModel
    branch: Branch
    points: list[Point]
    breakpoints: list[float]
    fold: float | None
    end: str

    @property
    def mu_end(self) -> float:
        """The largest mu on the path."""
        return float(self.points[-1].z[3])

    @staticmethod
    def of(model: PadModel, mu_max: float, settings: ContinuationSettings = DEFAULT) -> Path:
        """Follow the branch of a pad (its own mu is ignored) up to mu_max.

        Raises ComputationError if there is no equilibrium in contact at mu = 0.
        """
        start = least_at_zero(model)
        if start is None:
            raise ComputationError(NO_START)
        branch = follow(model, *start, mu_max, settings, rising=True)
        mus = [float(point.z[3]) for point in branch.points]
        fold = float(branch.folds[0].z[3]) if branch.folds else None
        rising = len(mus) if fold is None else mus.index(fold) + 1
        changes = [mus[i] for i in branch.changes if i < rising]
        return Path(model, branch, branch.points[:rising], changes, fold, branch.end)

    def at(self, mu: float) -> tuple[np.ndarray, State]:
        """The equilibrium z (natural units) at mu and its contact state, at a break the new one.

        Raises ComputationError beyond the path.
        """
        return self.all_at([mu])[0]

    def all_at(self, mus: Sequence[float]) -> list[tuple[np.ndarray, State]]:
        """`at` of each mu, which together take hardly longer than one."""
        near = [self._near(mu) for mu in mus]
        places = [(guess, self.points[i].state) for guess, i, _ in near]
        for state in {state for (_, state), (*_, far) in zip(places, near, strict=True) if far}:
            index = [j for j, (*_, far) in enumerate(near) if far and places[j][1] == state]
            z = np.array([near[j][0] for j in index]).T
            sides = solved(self.branch.statics, (), z, PASSES, state)
            for j, place, side in zip(index, z.T, sides, strict=True):
                guess, i, far = near[j]
                # across a fold the sign differs; other branches lie farther off
                own = side == self._side and np.linalg.norm(place - guess) <= far
                places[j] = (place if own else self._alone(guess, i), state)
        return places

    def _alone(self, guess: np.ndarray, i: int) -> np.ndarray:
        """The equilibrium near a guess, in steps from the point before it."""
        mu = float(guess[3])
        z, state = self.points[i].z, self.points[i].state
        branch = follow(self.model, z, state, mu, self.branch.settings, rising=True)
        if branch.reached and branch.points[-1].state == state:
            return branch.points[-1].z
        # close to a fold the balance is nearly singular in q; the chord is as good as it gets
        if self.fold is not None and mu >= float(self.points[-2].z[3]):
            return guess
        raise ComputationError(f"the equilibrium at mu = {mu:.9g} could not be found")

    @cached_property
    def _side(self) -> float:
        """The sign of the balance's determinant, which is one and the same along the path."""
        first = self.points[0]
        slope = self.branch.statics.linearised(first.z, first.state, 3)[1]
        return float(np.sign(np.linalg.det(slope)))

    def _near(self, mu: float) -> tuple[np.ndarray, int, float]:
        """A place on the chord near the equilibrium at mu, which point is before it, and the
        length of the chord: 0 where the place is exact."""
        mus = [float(point.z[3]) for point in self.points]
        if not mus[0] <= mu <= mus[-1]:
            raise ComputationError(f"no equilibrium at mu = {mu:.9g}: {self.end}")
        i = max(min(bisect.bisect_right(mus, mu) - 1, len(mus) - 1), 0)
        if mu == mus[i]:
            return self.points[i].z, i, 0.0
        low, high = self.points[i].z, self.points[i + 1].z
        share = (mu - mus[i]) / (mus[i + 1] - mus[i])
        if mus[i + 1] == self.fold and self.points[i + 1].state == self.points[i].state:
            share = 1.0 - math.sqrt(1.0 - share)  # mu is stationary at a smooth fold
        guess = low + (high - low) * share
        guess[3] = mu
        return guess, i, float(np.linalg.norm(high - low))

    def error(self, mu: float) -> float:
        """How far rounding may move a change of contact or a fold at mu; 0 elsewhere."""
        return max((point.error for point in self.points if point.z[3] == mu), default=0.0)

    def equilibrium(self, mu: float) -> Equilibrium | None:
        """The equilibrium at mu in SI units; None beyond the path."""
        if not 0.0 <= mu <= self.mu_end:
            return None
        z, state = self.at(mu)
        return record(self.branch.statics, z, state, on_branch=True)

    def linearisation(self, mu: float) -> Linearisation:
        """M, C, K about the equilibrium at mu, SI units."""
        z, state = self.at(mu)
        return linearise(self.model.replace(mu=mu), self.branch.statics.to_si(z), state)

    def linearisations(self, mus: Sequence[float]) -> list[Linearisation]:
        """`linearisation` of each mu, which together take hardly longer than one."""
        places = self.all_at(mus)
        found: dict[int, Linearisation] = {}
        for state in {state for _, state in places}:
            index = [i for i, (_, own) in enumerate(places) if own == state]
            q = np.array([self.branch.statics.to_si(places[i][0]) for i in index]).T
            model = self.model.replace(mu=np.array([mus[i] for i in index]))
            found.update(zip(index, linearised_at(model, q, state), strict=True))
        return [found[i] for i in range(len(places))]
