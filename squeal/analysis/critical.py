"""Critical friction: where a pad's stability changes along its equilibrium branch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from squeal.analysis.damping import damping_matrix
from squeal.equilibrium import Path
from squeal.model.linear import about_origin
from squeal.scene import Scene, takes_scene
from squeal.stability import CriticalPoint, Crossing, Matrices, thresholds, verdict


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


@takes_scene
def critical_friction(scene: Scene, mu_max: float = 2.0) -> CriticalFriction:
    """Thresholds of the scene's pad along the branch from mu = 0 (B3: about the origin).

    The branch is followed up to its first fold, where the equilibrium ceases; the fold is then
    the last entry. Raises ComputationError if there is no equilibrium without friction.
    """
    C = damping_matrix(scene)
    if scene.pad_model.linear:

        def at_origin(mu: float) -> Matrices:
            matrices = about_origin(scene.pad_model.replace(mu=mu))
            return matrices.M, C, matrices.K

        all_of_them = thresholds(at_origin, mu_max)
        return CriticalFriction(
            verdict(*at_origin(0.0)),
            tuple(all_of_them.points),
            mu_max,
            f"mu = {mu_max:g} is reached",
            tuple(all_of_them.crossings),
        )
    path = Path.of(scene.pad_model, mu_max)

    def on_branch(mu: float) -> Matrices:
        matrices = path.linearisation(mu)
        return matrices.M, C, matrices.K

    found = thresholds(on_branch, path.mu_end, path.breakpoints)
    end = np.inf if path.fold is None else path.fold * (1 - 1e-9)
    points = [point for point in found.points if point.mu < end]
    if path.fold is not None:
        points.append(CriticalPoint(path.fold, "fold", 0.0, (path.fold, path.fold), True))
    return CriticalFriction(
        verdict(*on_branch(0.0)),
        tuple(points),
        path.mu_end,
        path.end,
        tuple(crossing for crossing in found.crossings if crossing.mu < end),
    )
