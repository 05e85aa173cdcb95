"""The equilibrium branch of one pad as a function of mu, as far as mu rises along it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from squeal.equilibrium.branch import CHANGE, NO_START, Branches, BranchOptions
from squeal.equilibrium.find import Equilibrium, branch_of, record
from squeal.equilibrium.statics import Statics
from squeal.errors import ComputationError
from squeal.model.contact import State
from squeal.model.equations import Linearisation, PadModel, linearise, linearised_at


@dataclass(frozen=True, eq=False)
class Path:
    """The branch from mu = 0 up to its first fold, or to its end; mu_end is its largest mu."""

    model: PadModel
    branch: Branches

    @staticmethod
    def of(model: PadModel, mu_max: float, options: BranchOptions | None = None) -> Path:
        """Follow the branch of a pad (its own mu is ignored) up to mu_max.

        Raises ComputationError if there is no equilibrium in contact at mu = 0.
        """
        branch = branch_of(model, mu_max, options=options)
        if not branch.z.size:
            raise ComputationError(NO_START)
        return Path(model, branch)

    @property
    def statics(self) -> Statics:
        """The pad's statics in its natural units."""
        return self.branch.statics

    @property
    def end(self) -> str:
        """Why the path stops, in words."""
        return self.branch.end_of(0)

    @cached_property
    def mu_end(self) -> float:
        """The largest mu on the path."""
        return float(self.branch.mu_end[0])

    @cached_property
    def fold(self) -> float | None:
        """The mu at which the branch turns back, None if it does not."""
        return self.mu_end if self.branch.turns[self.branch.last[0]] else None

    @cached_property
    def breakpoints(self) -> list[float]:
        """Values of mu at which the contact state changes."""
        changes = np.flatnonzero(self.branch.kind == CHANGE)
        return [float(mu) for mu in self.branch.z[3, changes[changes <= self.branch.last[0]]]]

    @property
    def states(self) -> list[State]:
        """The contact states along the path, one for each node."""
        on = self.branch.touching[:, : self.branch.last[0] + 1].T.tolist()
        return [State(*one) for one in on]

    def places(self, mus: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
        """Equilibria (4, k) in natural units at mus and contact states (points, k), at a change
        the new one.

        Raises ComputationError beyond the path.
        """
        mu = np.asarray(mus, dtype=float)
        z, touching, _, there = self.branch.at(np.zeros(mu.size, dtype=int), mu)
        if not there.all():
            lost = mu[np.argmin(there)]
            if not 0.0 <= lost <= self.mu_end:
                raise ComputationError(f"no equilibrium at mu = {lost:.9g}: {self.end}")
            raise ComputationError(f"the equilibrium at mu = {lost:.9g} could not be found")
        return z, touching

    def at(self, mu: float) -> tuple[np.ndarray, State]:
        """The equilibrium z (4,) at mu and its contact state. Raises as `places` does."""
        z, touching = self.places([mu])
        return z[:, 0], State(*touching[:, 0].tolist())

    def error(self, mu: float) -> float:
        """How far rounding may move a change of contact or a fold at mu; 0 elsewhere."""
        nodes = np.flatnonzero(self.branch.z[3] == mu)
        return max((self.branch.error(int(node)) for node in nodes), default=0.0)

    def equilibrium(self, mu: float) -> Equilibrium | None:
        """The equilibrium at mu in SI units; None beyond the path."""
        if not 0.0 <= mu <= self.mu_end:
            return None
        z, state = self.at(mu)
        return record(self.statics, z, state, on_branch=True)

    def linearisation(self, mu: float) -> Linearisation:
        """M, C, K about the equilibrium at mu, SI units."""
        z, state = self.at(mu)
        return linearise(self.model.replace(mu=mu), self.statics.to_si(z), state)

    def linearisations(self, mus: Sequence[float]) -> list[Linearisation]:
        """`linearisation` of each mu, which together take hardly longer than one."""
        z, touching = self.places(mus)
        model = self.model.replace(mu=np.asarray(mus, dtype=float))
        return linearised_at(model, self.statics.to_si(z), 1.0 * touching)
