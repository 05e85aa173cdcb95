"""All sliding equilibria of a pad, by Newton's method from many places at once."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from squeal.equilibrium.admissible import excursion
from squeal.equilibrium.branch import Branch, follow
from squeal.equilibrium.settings import LIMITS
from squeal.equilibrium.statics import Statics
from squeal.errors import ComputationError
from squeal.model.equations import PadModel
from squeal.model.states import State
from squeal.numerics.newton import newton_steps

NO_START = "without friction the pad has no place of rest where the surfaces press on each other"
ALIKE = 1e-9  # of a potential energy: what two places with the same may differ by


@dataclass(frozen=True)
class Equilibrium:
    """A sliding equilibrium in SI units: q = (x, y, theta), contact state, reaction.

    R_n is the normal reaction in N and delta its distance in m from the mass centre (or from the
    frame's origin, in that formulation); potential in J. `on_branch`: it was reached from mu = 0.
    beyond: why it does not lie on the part of the branch that rises from mu = 0, if that is so;
    excesses: a sentence for each limit of `AdmissibleLimits` that it exceeds.
    """

    q: tuple[float, float, float]
    mu: float
    state: State
    R_n: float
    delta: float
    potential: float
    on_branch: bool = False
    beyond: str = ""
    excesses: tuple[str, ...] = ()

    @property
    def warnings(self) -> tuple[str, ...]:
        """Every reason why it is none that the model means."""
        return (*([self.beyond] if self.beyond else []), *self.excesses)

    @property
    def admissible(self) -> bool:
        """True if nothing speaks against it."""
        return not self.warnings


def record(
    statics: Statics, z: np.ndarray, state: State, on_branch: bool = False
) -> Equilibrium | None:
    """A point of the statics in SI units; None where the surfaces do not press on each other.

    Raises ComputationError as `_recorded` does.
    """
    return _recorded(statics, z, state, on_branch) if statics.presses(z) else None


def _recorded(
    statics: Statics, z: np.ndarray, state: State, on_branch: bool = False
) -> Equilibrium:
    """As `record`, also where the surfaces touch without pressing.

    Raises ComputationError where they press and rounding hides how; of a place that is none that
    the model means anyway it is one more warning.
    """
    R_n, delta = statics.reaction(z, state)
    excesses, why = excursion(statics, z, state).warnings(), statics.why_hidden(z)
    if why and statics.presses(z):
        if not excesses:
            raise ComputationError(f"no equilibrium can be given: {why}")
        excesses += (why,)
    x, y, theta = (float(v) for v in statics.to_si(z))
    potential = statics.potential(z, state) * statics.units.energy
    place = (x, y, theta), float(z[3]), state
    return Equilibrium(*place, R_n, delta, potential, on_branch, excesses=excesses)


def _seeds(statics: Statics, mu: float, near: bool) -> np.ndarray:
    """Starting places (4, n): of the size of the load, or also of pad and springs.

    If the law turns the pad away also about half as far as `AdmissibleLimits`.
    """
    pad = statics.model.pad
    lengths = [1.0] if near else sorted({1.0, 10.0, pad.w, pad.L1, pad.L2})
    places = [(0.0, 0.0)] + [
        (s * cx, s * cy) for s in lengths for cx in (-1.0, 0.0, 1.0) for cy in (-1.0, 0.0, 1.0)
    ]
    limit = 0.98 * np.pi / 2
    wide = np.array([]) if near else np.linspace(-limit, limit, 13) - pad.theta0
    small = np.array([-10.0, -1.0, 1.0, 10.0]) / pad.w
    if not statics.model.law.restoring:
        lengths.append(LIMITS.travel * pad.w / 2)
        small = np.append(small, [-LIMITS.tilt / 2, LIMITS.tilt / 2])
    # not np.unique, which loads numpy.ma
    tilts = np.array(sorted({*wide.tolist(), *small[np.abs(small) < limit].tolist(), 0.0}))
    xy = np.array(places)
    n = len(xy) * len(tilts)
    z = np.empty((4, n))
    z[:2] = np.repeat(xy, len(tilts), axis=0).T
    z[2] = pad.w * np.tile(tilts, len(xy))
    z[3] = mu
    return z


def _newton_many(statics: Statics, seeds: np.ndarray, states: Sequence[State]) -> list[np.ndarray]:
    """Damped Newton from all seeds (4, n) in all states together; for each state the places (4, m)
    that converged."""
    pad = statics.model.pad
    longest = np.array([0.5 * (pad.w + max(pad.L1, pad.L2))] * 2 + [0.3 * pad.w])[:, None]
    z, own = np.tile(seeds, len(states)), np.repeat(np.arange(len(states)), seeds.shape[1])
    touching = np.array(states, dtype=float).T
    done, met = [z[:, :0]], [own[:0]]
    for _ in range(60):
        with np.errstate(all="ignore"):
            step, side = newton_steps(*statics.linearised(z, touching[:, own], 3))
        z, step, own = z[:, side != 0.0], step[:, side != 0.0], own[side != 0.0]
        if z.shape[1] == 0:
            break
        step /= np.maximum(1.0, np.max(np.abs(step) / longest, axis=0))
        z[:3] -= step
        turn = np.abs(statics.tilt(z)) < np.pi  # lost otherwise
        small = np.max(np.abs(step), axis=0) <= 1e-10 * (1.0 + np.max(np.abs(z[:3]), axis=0))
        done.append(z[:, small & turn])
        met.append(own[small & turn])
        z, own = z[:, ~small & turn], own[~small & turn]
    ends, own = np.concatenate(done, axis=1), np.concatenate(met)
    return [ends[:, own == i] for i in range(len(states))]


def _is_near(z: np.ndarray, others: list[np.ndarray], distance: float) -> bool:
    return bool(others) and bool(np.abs(z - np.array(others)).max(axis=1).min() < distance)


def find_all(model: PadModel, near: bool = False) -> list[Equilibrium]:
    """All sliding equilibria (R_n > 0) at the pad's mu, least potential energy first.

    Newton's method starts from some hundreds of places and tilts in each contact state; equilibria
    with |theta0 + theta| < pi/2 whose gaps agree with the state are kept. An equilibrium farther
    off than the springs are long may be missed. `near` starts only from places that the load
    reaches, which is enough to find where a pad usually rests. Raises ComputationError where
    rounding hides how one presses on the surface.
    """
    return [found for found, presses in _find(model, near) if presses]


@lru_cache(maxsize=16)  # one question asks for the same pad several times
def _find(model: PadModel, near: bool) -> tuple[tuple[Equilibrium, bool], ...]:
    """As `find_all`, also where the surfaces touch without pressing; for each whether they do."""
    statics = Statics.of(model)
    found: list[tuple[np.ndarray, State]] = []
    states = [*filter(any, model.states)]
    each_ends = _newton_many(statics, _seeds(statics, model.pad.mu, near), states)
    for state, ends in zip(states, each_ends, strict=True):
        ends = ends[:, np.lexsort(np.round(ends[:3], 6))] if ends.shape[1] else ends
        refused: list[np.ndarray] = []  # the same places are met from many seeds
        for z in ends.T:
            size = 1.0 + np.max(np.abs(z[:3]))
            known = [other for other, _ in found]
            if _is_near(z, known, 1e-6 * size) or _is_near(z, refused, 1e-9 * size):
                continue
            polished = statics.newton(z, state)
            if polished is None:
                continue
            if not statics.admits(polished, state):
                refused.append(polished)
            elif not _is_near(polished, known, 1e-6 * size):
                found.append((polished, state))
    each = [(_recorded(statics, *at), bool(statics.presses(at[0]))) for at in found]
    return tuple(sorted(each, key=lambda one: one[0].potential))


def least_at_zero(model: PadModel) -> tuple[np.ndarray, State] | None:
    """Where the branch starts: the equilibrium of least potential energy without friction.

    Where the surfaces only touch there without a force (a pad without a load), it is the next one,
    if that is admissible. None where there is none.
    Of a law that turns the pad away admissible ones go before others, and of the latter those that
    the load reaches; of two with the same energy the one further along the surface's motion.
    """
    best = _least(dataclasses.replace(model, damping=None).replace(mu=0.0))
    if best is None:
        return None
    units = Statics.of(model.replace(mu=0.0)).units
    z = np.append(units.to_scaled(np.array([*best.q, 0.0, 0.0, 0.0]))[:3], 0.0)
    return z, best.state


@lru_cache(maxsize=64)  # one question asks for the same pads several times
def _least(smooth: PadModel) -> Equilibrium | None:
    # the usual pad rests near the place where it is put; look there before looking everywhere
    each = _find(smooth, near=True)
    if not any(presses for _, presses in each):
        # with what was met before: a place without a reaction is a double one, which is found or
        # not by rounding
        each = (*each, *_find(smooth, near=False))
        each = tuple(sorted(each, key=lambda one: one[0].potential))
    found = [e for e, presses in each if presses]
    admissible = [e for e in found if e.admissible]
    if each and not each[0][1]:  # the pad hangs in its springs
        found = admissible
    elif not smooth.law.restoring:  # its energy has no least value
        found = admissible or found
    if not found:
        return None
    # of two that mirror each other the one to which friction pushes
    least = min(e.potential for e in found)
    alike = (e for e in found if e.potential <= least + ALIKE * abs(least))
    return max(alike, key=lambda e: e.q[0])


def _beyond(branch: Branch) -> str:
    """Why the pad's mu lies beyond the rising part of its branch; empty if it does not."""
    if branch.reached and not branch.folds:
        return ""
    if not branch.reached:
        return f"the equilibrium is not on the branch from mu = 0: {branch.end}"
    fold = float(branch.folds[0].z[3])
    return (
        f"the equilibrium lies beyond a fold: the branch from mu = 0 turns back at mu = {fold:.9g}"
    )


def sliding_equilibrium(model: PadModel) -> tuple[Equilibrium | None, str]:
    """The equilibrium that a query is about, and how it was found or why there is none.

    It is the one on the branch continued from mu = 0, if that branch reaches the pad's mu, else
    the one of least potential energy at the pad's mu. Its warnings tell if it is not on the part
    of the branch that rises from mu = 0, or leaves what the model means.
    """
    return _sliding(dataclasses.replace(model, damping=None))


@lru_cache(maxsize=64)  # studies ask for the same pads with many dampings
def _sliding(model: PadModel) -> tuple[Equilibrium | None, str]:
    start = least_at_zero(model)
    reason = NO_START
    beyond = f"the equilibrium is on no branch from mu = 0: {reason}"
    if start is not None:
        branch = follow(model, *start, model.pad.mu)
        beyond = _beyond(branch)
        if branch.reached:
            statics = Statics.of(model)
            last = branch.points[-1]
            found = record(statics, last.z, last.state, on_branch=True)
            if found is not None:
                return dataclasses.replace(
                    found, beyond=beyond
                ), "on the branch continued from mu = 0"
        reason = branch.end
    others = find_all(model)
    if others:
        return dataclasses.replace(others[0], beyond=beyond), f"least potential energy; {reason}"
    return None, f"no steady sliding exists: {reason}, and no other equilibrium was found"
