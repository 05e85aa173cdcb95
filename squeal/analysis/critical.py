"""Critical friction: where a pad's stability changes along its equilibrium branch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from squeal.equilibrium import Path
from squeal.equilibrium.damping import damped_model
from squeal.model.linear import about_origin
from squeal.scene import Scene, takes_scene
from squeal.stability import (
    GROWING,
    CriticalPoint,
    Crossing,
    Matrices,
    System,
    thresholds,
    verdict,
)


@dataclass(frozen=True)
class CriticalFriction:
    """Every change of the verdict in 0 < mu <= mu_max, sorted by mu.

    `crossings` are all crossings of the imaginary axis, whatever else grows. `at_zero` is the
    verdict without friction; `mu_end` how far the branch reaches and `end` why it stops there.
    """

    at_zero: str
    points: tuple[CriticalPoint, ...]
    mu_end: float
    end: str
    crossings: tuple[Crossing, ...] = ()

    @property
    def first(self) -> CriticalPoint | None:
        """The first threshold at which stability or the equilibrium is lost, None if none is."""
        return next((p for p in self.points if p.kind != "restabilised"), None)

    def stable_to(self, mu_max: float) -> float | None:
        """The least mu in 0 to mu_max without stable sliding; None if there is none.

        0 if the pad grows without friction; also where the branch ends without a threshold.
        """
        if self.at_zero in GROWING:
            return 0.0
        if self.first is not None:
            return self.first.mu
        return self.mu_end if self.mu_end < mu_max else None


@takes_scene
def critical_friction(scene: Scene, mu_max: float = 2.0) -> CriticalFriction:
    """Thresholds of the scene's pad along the branch from mu = 0 (B3: about the origin).

    The branch is followed up to its first fold, where the equilibrium ceases; the fold is then
    the last entry. Raises ComputationError if there is no equilibrium without friction.
    """
    system, path = branch_system(scene, mu_max)
    if path is None:
        return critical_parameter(system, mu_max)
    found = thresholds(system, path.mu_end, path.breakpoints)
    end_of_path = np.inf if path.fold is None else path.fold * (1 - 1e-9)
    reached = [point for point in found.points if point.mu < end_of_path]
    if path.fold is not None:
        reached.append(CriticalPoint(path.fold, "fold", 0.0, (path.fold, path.fold), True))
    return CriticalFriction(
        verdict(*system(0.0)),
        tuple(reached),
        path.mu_end,
        path.end,
        tuple(crossing for crossing in found.crossings if crossing.mu < end_of_path),
    )


def critical_parameter(system: System, high: float, name: str = "mu") -> CriticalFriction:
    """The same for a system of matrices along its parameter from 0 to `high`."""
    found = thresholds(system, high)
    end = f"{name} = {high:g} is reached"
    at_zero = verdict(*system(0.0))
    return CriticalFriction(at_zero, tuple(found.points), high, end, tuple(found.crossings))


def branch_system(scene: Scene, mu_max: float) -> tuple[System, Path | None]:
    """mu -> (M, C, K) about the equilibrium on the branch from mu = 0, and the branch's path.

    B3 is linearised about the origin at every mu and has no path. Raises ComputationError if
    there is no equilibrium without friction.
    """
    model = damped_model(scene)
    if model.linear:

        def at_origin(mu: float) -> Matrices:
            matrices = about_origin(model.replace(mu=mu))
            return matrices.M, matrices.C, matrices.K

        return at_origin, None
    path = Path.of(model, mu_max)

    def on_branch(mu: float) -> Matrices:
        matrices = path.linearisation(mu)
        return matrices.M, matrices.C, matrices.K

    return on_branch, path
