"""Critical friction: where a pad's stability changes along its equilibrium branch."""

from dataclasses import replace
from typing import TypeVar

import numpy as np

from squeal.analysis.answers import Thresholds
from squeal.analysis.eigenvalues import LOST, branch_system, roots_and_verdict
from squeal.analysis.maps import MU_MAX
from squeal.equilibrium import Path
from squeal.equilibrium.statics import excursion
from squeal.errors import ComputationError
from squeal.io.scene import Scene, takes_scene
from squeal.linear import (
    CriticalPoint,
    Crossing,
    System,
    thresholds,
)
from squeal.linear.continuation import ContinuationOptions
from squeal.linear.eigen import HIDDEN, STIFF, hidden_share
from squeal.linear.matrices import checked, reduce
from squeal.schema.values import takes

Located = TypeVar("Located", CriticalPoint, Crossing)


@takes_scene
@takes(mu_max=MU_MAX)
def critical_friction(scene: Scene, mu_max: float = 2.0) -> Thresholds:
    """Thresholds of the scene's pad along the branch from mu = 0 (B3: about the origin).

    The branch is followed up to its first fold, where the equilibrium ceases; the fold is then
    the last entry. Raises InputError for a mu_max that is not `MU_MAX`, ComputationError if there
    is no equilibrium without friction.
    """
    system, path = branch_system(scene, mu_max)
    if path is None:
        found = critical_parameter(system, mu_max)
        return replace(found, name=scene.model, source=(scene,))
    if path.mu_end <= 0.0:
        raise ComputationError(f"no threshold can be given: {path.end}")
    M, C, K = checked(*system(0.0))
    at_zero, share = roots_and_verdict(M, C, K)[1].verdict, hidden_share(reduce(M, C, K), C, K)
    stiff = share > HIDDEN
    if stiff and C is not None:
        raise ComputationError(f"no threshold of a damped pad can be given: {STIFF}")
    if share > LOST:
        raise ComputationError(f"no threshold can be given: {STIFF}")
    located = thresholds(system, path.mu_end, path.breakpoints)
    if stiff and any(p.interval[1] - p.interval[0] > 2 * LOST * p.mu for p in located.points):
        raise ComputationError(f"no threshold can be given: {STIFF}")
    end_of_path = np.inf if path.fold is None else path.fold * (1 - 1e-9) - path.error(path.fold)
    reached = [_widened(point, path) for point in located.points if point.mu < end_of_path]
    if path.fold is not None:
        fold = CriticalPoint(path.fold, "fold", 0.0, (path.fold, path.fold), True)
        reached.append(_widened(fold, path))
    admissible_to, warnings = _admissible(path)
    if path.fold is not None and path.fold < scene.pad.mu <= mu_max:
        warnings += (
            f"the scene's mu = {scene.pad.mu:g} lies beyond a fold: the branch from mu = 0 turns "
            f"back at mu = {path.fold:.9g}",
        )
    crossed = tuple(_widened(one, path) for one in located.crossings if one.mu < end_of_path)
    return Thresholds(
        scene.model,
        "mu",
        0.0,
        path.mu_end,
        at_zero,
        tuple(reached),
        crossed,
        path.end,
        located.certified,
        warnings,
        details={"admissible_to": min(admissible_to, path.mu_end)},
        source=(scene,),
    )


def _widened(at: Located, path: Path) -> Located:
    """A fold or a change of contact with the interval in which rounding leaves it."""
    error = path.error(at.mu)
    if not error:
        return at
    wide = (at.mu - error, at.mu + error)
    if isinstance(at, Crossing):
        return replace(at, interval=wide)
    return replace(at, interval=wide, converged=2 * error <= ContinuationOptions.same * at.mu)


def critical_parameter(system: System, high: float, name: str = "mu") -> Thresholds:
    """The same for a system of matrices along its parameter from 0 to `high`."""
    found, end = thresholds(system, high), f"{name} = {high:g} is reached"
    verdict = roots_and_verdict(*system(0.0))[1].verdict
    located = tuple(found.points), tuple(found.crossings), end, found.certified
    return Thresholds("", name, 0.0, high, verdict, *located, details={"admissible_to": high})


def _admissible(path: Path) -> tuple[float, tuple[str, ...]]:
    """The mu from which on equilibria exceed a limit, to nine digits, and which limit that is."""

    def beyond(z: np.ndarray, touching: np.ndarray) -> np.ndarray:
        at = excursion(path.statics, z, touching)
        return np.asarray(at.beyond().any(axis=0) & (np.asarray(at.reaction) > 0.0))

    stop = path.branch.last[0] + 1
    z, touching = path.branch.z[:, :stop], path.branch.touching[:, :stop]
    known = beyond(z, touching)
    if not known.any():
        return path.mu_end, ()
    first = int(np.argmax(known))
    low, high = float(z[3, max(first - 1, 0)]), float(z[3, first])
    while high - low > 1e-9 * high:
        tried = np.linspace(low, high, 17)
        first = int(np.argmax(np.append(beyond(*path.places(tried[1:-1].tolist())), True)))
        low, high = float(tried[first]), float(tried[first + 1])
    at = path.equilibrium(high)
    assert at is not None
    return low, tuple(f"from mu = {high:.6g} on {words}" for words in at.excesses)
