"""The branch of one pad over mu: equilibria, matrices about them, rounding of its events."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from squeal.equilibrium.branch import BranchEnd, Branches, NodeKind, follow
from squeal.equilibrium.find import (
    Equilibrium,
    equilibrium_in_si,
    find_all,
    frictionless_equilibria,
)
from squeal.equilibrium.statics import WHY_UNRESOLVED, Equilibria, Statics
from squeal.errors import ComputationError
from squeal.model.contact import State
from squeal.model.equations import Linearisation, PadModel, linearise, net_loads
from squeal.model.pad import Coefficients, pose_of
from squeal.numerics.differentiation import STEP, with_derivative

COEFFICIENT_ERROR = 4.0 * float(np.finfo(float).eps)  # of each coefficient and each load
OF_LOADS = ("k1", "k2", "k3", "k4", "k_c", "F_n")  # to each of which one load is proportional
NO_START = (
    "without friction the pad has no place of rest nearby where the surfaces press on each other"
)


def sliding_equilibrium(model: PadModel) -> tuple[Equilibrium | None, str]:
    """The equilibrium that a query is about, and how it was reached or why there is none.

    It is the one on the branch continued from mu = 0, if that rises up to the pad's mu, else the
    one of least potential energy there, with a warning. Raises ComputationError where rounding
    hides how the surfaces touch.
    """
    path = Path(model, branch_of(model, model.pad.mu))
    if path.end == BranchEnd.REACHED:
        on_branch = path.equilibrium(model.pad.mu)
        if on_branch is not None:
            return on_branch, "on the branch continued from mu = 0"
    why = path.why_it_ends
    others = find_all(dataclasses.replace(model, damping=None))  # damping moves no equilibrium
    if others:
        beyond = f"the equilibrium is not on the branch from mu = 0: {why}"
        # they rise by potential energy; `beyond` is printed as a warning
        least = dataclasses.replace(others[0], beyond=beyond)
        return least, f"least potential energy; {why}"
    return None, f"no steady sliding exists: {why}, and no other equilibrium was found"


def branch_of(model: PadModel, mu_max: float) -> Branches:
    """The branch of one pad from mu = 0 to mu_max, for any friction and damping of its own."""
    statics = Statics.of(dataclasses.replace(model, damping=None).replace(mu=0.0))
    return follow(statics, frictionless_equilibria(statics, 1), np.array([mu_max]))


@dataclass(frozen=True, eq=False)
class Path:
    """The branch of one pad as a function of mu, from mu = 0 up to its first fold or to its end.

    mu_end is its largest mu.
    """

    model: PadModel
    branch: Branches

    @staticmethod
    def of(model: PadModel, mu_max: float) -> Path:
        """Follow the branch of a pad (its own mu is ignored) up to mu_max.

        Raises ComputationError if there is no equilibrium in contact at mu = 0.
        """
        path = Path(model, branch_of(model, mu_max))
        if not path.branch.z.size:
            raise ComputationError(NO_START)
        return path

    @property
    def statics(self) -> Statics:
        """The pad's statics in its natural units."""
        return self.branch.statics

    @property
    def end(self) -> BranchEnd:
        """How the path ends at `mu_end`."""
        return BranchEnd(self.branch.end[0])

    @property
    def why_it_ends(self) -> str:
        """How the path ends, in words."""
        if self.end == BranchEnd.NO_EQUILIBRIUM:
            return NO_START
        mu = self.mu_end
        why = ""
        if self.statics.unresolved(self.branch.z[:, -1:]).any():
            why = f": {WHY_UNRESOLVED}"
        return {
            BranchEnd.REACHED: f"mu = {mu:.9g} is reached" if mu else "mu = 0",
            BranchEnd.FOLD: f"the branch from mu = 0 turns back in a fold at mu = {mu:.9g}",
            BranchEnd.INTERRUPTED: f"the branch from mu = 0 is lost at mu = {mu:.9g}{why}",
            BranchEnd.UNBOUNDED: f"the equilibrium runs away to infinity near mu = {mu:.9g}",
            BranchEnd.SEPARATED: f"contact is lost at mu = {mu:.9g}",
            BranchEnd.TILTED: f"the pad turns past 90 degrees on the branch at mu = {mu:.9g}",
        }[self.end]

    @cached_property
    def mu_end(self) -> float:
        """The largest mu on the path."""
        return float(self.branch.mu_end[0])

    @cached_property
    def fold(self) -> float | None:
        """The mu at which the branch turns back, None if it does not."""
        return self.mu_end if self.end == BranchEnd.FOLD else None

    @cached_property
    def breakpoints(self) -> list[float]:
        """Values of mu at which the contact state changes."""
        is_change = self.branch.kind == NodeKind.CONTACT_CHANGE
        return self.branch.z[3, is_change].tolist()

    def equilibria(self, mus: Sequence[float]) -> Equilibria:
        """The equilibria at k values of mu, at a change of contact in the new state.

        Raises ComputationError where the path has none: beyond its ends, or where it is lost.
        """
        mu = np.asarray(mus, dtype=float)
        equilibria = self.branch.at(np.zeros(mu.size, dtype=int), mu)
        if not equilibria.exists.all():
            missing = mu[np.argmin(equilibria.exists)]
            why = "it is lost" if 0.0 <= missing <= self.mu_end else self.why_it_ends
            raise ComputationError(f"no equilibrium at mu = {missing:.9g}: {why}")
        return equilibria

    def at(self, mu: float) -> tuple[np.ndarray, State]:
        """The equilibrium z (4,) at mu and its contact state. Raises as `equilibria` does."""
        z, touching, _ = self.equilibria([mu])
        return z[:, 0], State(*touching[:, 0].tolist())

    def error(self, mu: float) -> float:
        """How far rounding may move a change of contact or a fold at mu; 0 elsewhere."""
        branch = self.branch
        error = 0.0
        for node in np.flatnonzero((branch.z[3] == mu) & (branch.kind != NodeKind.POINT)):
            before = branch.touching[:, node - 1]
            changed = np.flatnonzero(before != branch.touching[:, node])
            error = max(error, self._rounding_of_mu(branch.z[:, node, None], before, changed))
        return error

    def _rounding_of_mu(self, z: np.ndarray, before: np.ndarray, changed: np.ndarray) -> float:
        """How far rounding may move the mu of a change of contact or a fold, to first order.

        Four conditions determine the node: the balance of x, y and theta, and a gap that vanishes;
        at a fold the three of the balance alone. Rounding of the coefficients and loads moves the
        conditions, and `weights` say how far mu moves with each. A rounded coefficient moves all
        conditions at once; beside that each load is rounded by itself.

        Parameters
        ----------
        z : array (4, 1)
            The node.
        before : bool array (points,)
            The contact state before it.
        changed : array (j,)
            Numbers of the contact points whose gap vanishes there; none at a fold.
        """
        statics = self.statics
        touching = 1.0 * before[:, None]
        # the conditions, balance and gaps that vanish, at z, and their derivative J by z
        balance, balance_slope = statics.linearised(z, touching)
        gaps, gap_slopes = with_derivative(statics.gaps, z)
        residual = np.concatenate([balance, gaps[changed]])[..., 0]
        J = np.concatenate([balance_slope, gap_slopes[changed]])[..., 0]
        # to first order, but for the sign, J dz = d residual, so that d mu = weights . d residual
        # where J' weights = e_mu = (0, 0, 0, 1): four equations for four weights. At a fold three
        # weights solve them, since mu is stationary along the branch
        weights = np.linalg.lstsq(J.T, np.eye(4)[3])[0]
        # (3 + j, coefficients): of the conditions, by the relative change of each coefficient
        rates = self._rates_of_conditions(z, touching, changed)
        by_coefficients = np.abs(weights @ rates).sum()
        # a load k u or F_n is its own derivative by the relative change of k or F_n: the columns
        # of these coefficients are the loads, and each entry has a rounding of its own
        loads = rates[:, [Coefficients._fields.index(name) for name in OF_LOADS]]
        by_loads = (np.abs(weights) @ np.abs(loads)).sum()
        left_by_newton = abs(weights @ residual)
        # rounding puts the node of a fold beside the top of the branch, so that its mu is too small
        below_top = 0.0 if changed.size else self._depth_below_top(z, touching)
        shift = COEFFICIENT_ERROR * (by_coefficients + by_loads)
        return float(shift + below_top + left_by_newton + np.spacing(z[3, 0]))

    def _rates_of_conditions(
        self, z: np.ndarray, touching: np.ndarray, changed: np.ndarray
    ) -> np.ndarray:
        """Derivatives (3 + j, coefficients) of the conditions of `_rounding_of_mu` at z (4, 1) by
        relative changes of each coefficient: of the balance of x, y and theta in the contact state
        `touching` (points, 1), then of the gaps `changed` (j,)."""
        model = self.statics.model
        # by complex steps, f(x + i step) = f(x) + i step f'(x): in column i coefficient i is
        # shifted by this share of itself
        values = np.array(model.c._replace(mu=z[3, 0]), dtype=float)
        shifted = Coefficients(*(values[:, None] * (1.0 + 1j * STEP * np.eye(values.size))))
        q = shifted.xy_theta(z.astype(complex))
        f = net_loads(np, shifted, model.law, q, touching[:, 0])
        gaps = model.law.gaps(shifted, pose_of(np, q))
        # the moment over w, as in the residual of the statics
        rows = [f.x, f.y, f.moment / model.pad.w, *(gaps[i] for i in changed)]
        return np.imag(np.broadcast_arrays(*rows)) / STEP

    def _depth_below_top(self, z: np.ndarray, state: np.ndarray) -> float:
        """How far mu at z (4, 1), where rounding of the determinant put a fold, is below the top of
        the branch.

        Along the branch mu is a parabola, mu = top - curvature s^2 / 2 of slope -curvature s, so
        that top - mu = slope^2 / (2 curvature). Both come from the tangents at two points.

        state (points, 1): the contact state there, 1.0 for a point that touches, else 0.0.
        """
        ahead = 1e-4 * np.abs(z).max()  # distance of the second point, along the tangent

        def tangent_at(z: np.ndarray) -> np.ndarray:
            """The unit null vector (4,) of the balance at z, of either sign."""
            _, J = self.statics.linearised(z, state)
            _, _, rows = np.linalg.svd(J[..., 0])
            return rows[3]

        tangent = tangent_at(z)
        later = tangent_at(z + ahead * tangent[:, None])
        slope = tangent[3]
        change = later[3] * np.sign(later @ tangent) - slope
        return float(slope**2 / 2 * ahead / abs(change))  # the curvature is change / ahead

    def equilibrium(self, mu: float) -> Equilibrium | None:
        """The equilibrium at mu in SI units; None beyond the path."""
        found = self.equilibria_in_si([mu])
        return found[0] if found else None

    def equilibria_in_si(self, mus: Sequence[float]) -> list[Equilibrium | None]:
        """The equilibria at those values of mu that the path reaches, in SI units; None where the
        surfaces do not press on each other."""
        reached = [mu for mu in mus if 0.0 <= mu <= self.mu_end]
        z, touching, _ = self.equilibria(reached)
        found: list[Equilibrium | None] = []
        for unknowns, on in zip(z.T, touching.T, strict=True):
            found.append(
                equilibrium_in_si(self.statics, unknowns, State(*on.tolist()), on_branch=True)
            )
        return found

    def __call__(self, mu: float) -> Linearisation:
        """M, C, K about the equilibrium at mu, SI units."""
        return self.many([mu])[0]

    def many(self, mus: Sequence[float]) -> list[Linearisation]:
        """M, C, K at each mu, which together take hardly longer than one."""
        z, touching, _ = self.equilibria(mus)
        model = self.model.replace(mu=np.array(mus, dtype=float))
        M, C, K = linearise(model, self.statics.to_si(z), 1.0 * touching)
        return [Linearisation(M, C[:, :, i], K[:, :, i]) for i in range(len(mus))]

    def perturbed_by_rounding(self, mu: float) -> list[tuple[tuple[np.ndarray, ...], ...]]:
        """M, C, K at mu, and their derivatives by relative changes of x, of y and of theta.

        For each of the three coordinates a pair: the matrices, and their derivatives.
        """
        z, touching, _ = self.equilibria([mu])
        h = 1e-12
        # four columns (4, 4): the first is z, the others have x, y and w theta moved
        columns = z * (1.0 + h * np.eye(4, 4, 1))
        q = self.statics.to_si(columns)
        M, C, K = linearise(self.model.replace(mu=mu), q, np.repeat(1.0 * touching, 4, 1))
        unmoved, *moved = np.moveaxis(np.array([C, K]), -1, 0)  # pairs (C, K)
        matrices = (M, *unmoved)
        return [(matrices, (0 * M, *(C_and_K - unmoved) / h)) for C_and_K in moved]
