"""The equilibrium branch as a function of mu, as far as mu rises along it."""

from __future__ import annotations

import bisect
import itertools
from dataclasses import dataclass

import numpy as np

from squeal.equilibrium.branch import Branch, Point, follow
from squeal.equilibrium.find import Equilibrium, least_at_zero, record
from squeal.equilibrium.settings import DEFAULT, ContinuationSettings
from squeal.errors import ComputationError
from squeal.model.equations import PadModel
from squeal.model.linear import Linearisation, linearise
from squeal.model.states import State


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
            raise ComputationError("without friction there is no equilibrium in contact")
        branch = follow(model, *start, mu_max, settings)
        mus = [float(point.z[3]) for point in branch.points]
        steps = itertools.pairwise(mus)
        rising = 1 + sum(1 for _ in itertools.takewhile(lambda step: step[1] > step[0], steps))
        fold = mus[rising - 1] if rising < len(mus) else None
        return Path(
            model,
            branch,
            branch.points[:rising],
            [mus[i] for i in branch.changes if i < rising],
            fold,
            branch.end,
        )

    def at(self, mu: float) -> tuple[np.ndarray, State]:
        """The equilibrium z (natural units) at mu and its contact state, at a break the new one.

        Raises ComputationError beyond the path.
        """
        mus = [float(point.z[3]) for point in self.points]
        if not mus[0] <= mu <= mus[-1]:
            raise ComputationError(f"no equilibrium at mu = {mu:.9g}: {self.end}")
        i = min(bisect.bisect_right(mus, mu) - 1, len(mus) - 2)
        if i < 0 or mu == mus[i]:
            point = self.points[max(i, 0)]
            return point.z, point.state
        low, high = self.points[i].z, self.points[i + 1].z
        state = self.points[i].state
        guess = low + (high - low) * (mu - mus[i]) / (mus[i + 1] - mus[i])
        guess[3] = mu
        z = self.branch.statics.newton(guess, state)
        if z is None:
            # close to a fold the balance is nearly singular in q; the chord is as good as it gets
            if self.fold is not None and mus[i + 1] == self.fold:
                return guess, state
            raise ComputationError(f"the equilibrium at mu = {mu:.9g} could not be found")
        return z, state

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
