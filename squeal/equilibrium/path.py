"""The equilibrium branch as a function of mu, as far as mu rises along it."""

from __future__ import annotations

import bisect
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from squeal.equilibrium.branch import Branch, Point, follow
from squeal.equilibrium.find import Equilibrium, least_at_zero, record
from squeal.equilibrium.many import solved
from squeal.equilibrium.settings import DEFAULT, ContinuationSettings
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
            raise ComputationError("without friction no equilibrium in contact was found")
        branch = follow(model, *start, mu_max, settings, rising=True)
        mus = [float(point.z[3]) for point in branch.points]
        steps = itertools.pairwise(mus)
        rising = 1 + sum(1 for _ in itertools.takewhile(lambda step: step[1] > step[0], steps))
        fold = mus[rising - 1] if rising < len(mus) else None
        changes = [mus[i] for i in branch.changes if i < rising]
        return Path(model, branch, branch.points[:rising], changes, fold, branch.end)

    def at(self, mu: float) -> tuple[np.ndarray, State]:
        """The equilibrium z (natural units) at mu and its contact state, at a break the new one.

        Raises ComputationError beyond the path.
        """
        z, state, known = self._near(mu)
        if known:
            return z, state
        found = self.branch.statics.newton(z, state)
        if found is None:
            # close to a fold the balance is nearly singular in q; the chord is as good as it gets
            if self.fold is not None and mu >= float(self.points[-2].z[3]):
                return z, state
            raise ComputationError(f"the equilibrium at mu = {mu:.9g} could not be found")
        return found, state

    def all_at(self, mus: Sequence[float]) -> list[tuple[np.ndarray, State]]:
        """`at` of each mu, which together take hardly longer than one."""
        near = [self._near(mu) for mu in mus]
        places = [(z, state) for z, state, _ in near]
        for state in {state for _, state, known in near if not known}:
            index = [i for i, (_, own, known) in enumerate(near) if own == state and not known]
            z = np.array([near[i][0] for i in index]).T
            sides = solved(self.branch.statics, (), z, PASSES, state)
            for i, place, side in zip(index, z.T, sides, strict=True):
                places[i] = (place, state) if side else self.at(mus[i])
        return places

    def _near(self, mu: float) -> tuple[np.ndarray, State, bool]:
        """A place on the chord near the equilibrium at mu, its state, True if it is exact."""
        mus = [float(point.z[3]) for point in self.points]
        if not mus[0] <= mu <= mus[-1]:
            raise ComputationError(f"no equilibrium at mu = {mu:.9g}: {self.end}")
        i = min(bisect.bisect_right(mus, mu) - 1, len(mus) - 2)
        if i < 0 or mu == mus[i]:
            point = self.points[max(i, 0)]
            return point.z, point.state, True
        low, high = self.points[i].z, self.points[i + 1].z
        share = (mu - mus[i]) / (mus[i + 1] - mus[i])
        if mus[i + 1] == self.fold and self.points[i + 1].state == self.points[i].state:
            share = 1.0 - math.sqrt(1.0 - share)  # mu is stationary at a smooth fold
        guess = low + (high - low) * share
        guess[3] = mu
        return guess, self.points[i].state, False

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
