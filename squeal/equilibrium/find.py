"""Places of rest without friction, and all sliding equilibria of a pad: Newton's method from many
places at once."""

import dataclasses
import itertools
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from squeal.equilibrium.admissible import LIMITS, excursion
from squeal.equilibrium.branch import NO_START, REACHED, Branches, BranchOptions, follow
from squeal.equilibrium.statics import Statics
from squeal.errors import ComputationError
from squeal.model.contact import State
from squeal.model.equations import PadModel, natural_units

ALIKE = 1e-9  # of a potential energy: what two places with the same may differ by
FAR = 20  # pads for which places far off are searched, one by one
MOST = 65536  # places that are solved at once; bounds the memory
PASSES = 60  # of Newton's method in a search


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
    """A place z (4,) of one pad in SI units; None where the surfaces do not press on each other.

    Raises ComputationError where they press and rounding hides how; of a place that is none that
    the model means anyway it is one more warning.
    """
    if not statics.presses(z):
        return None
    R_n, delta = statics.reaction(z, state)
    excesses, why = excursion(statics, z, state).warnings(), statics.why_hidden(z)
    if why:
        if not excesses:
            raise ComputationError(f"no equilibrium can be given: {why}")
        excesses += (why,)
    x, y, theta = (float(v) for v in statics.to_si(z))
    potential = statics.potential(z, state) * statics.units.energy
    place = (x, y, theta), float(z[3]), state
    return Equilibrium(*place, R_n, delta, potential, on_branch, excesses=excesses)


class Rests(NamedTuple):
    """Where n pads rest without friction: places z (4, n), contact states touching (points, n);
    there (n,): pads that have such a place; searched (n,): false where only near places were."""

    z: np.ndarray
    touching: np.ndarray
    there: np.ndarray
    searched: np.ndarray


def _near_seeds(statics: Statics, n: int) -> np.ndarray:
    """Places (4, seeds, n) of the size of the load, and if the law turns the pad away also about
    half as far as `AdmissibleLimits`."""
    own = natural_units(statics.model, (0.0,) * 6).length * np.ones(n)
    near = (0.0, -1.0, 1.0)
    places = itertools.product(near, near, (*near, -10.0, 10.0), [0.0])
    seeds = [own * np.array(place)[:, None] for place in places]
    if not statics.model.law.restoring:
        half = statics.model.pad.w * np.ones(n) / 2
        limits = np.array([LIMITS.travel, LIMITS.travel, LIMITS.tilt, 0.0])
        places = itertools.product(near, near, near, [0.0])
        seeds += [half * (limits * place)[:, None] for place in places]
    return np.array(seeds).transpose(1, 0, 2)


def _far_seeds(statics: Statics) -> np.ndarray:
    """Places (4, seeds, 1) of one pad of the size of the load, of the pad and of its springs, at
    all tilts."""
    pad = statics.model.pad
    lengths = [float(np.ravel(v)[0]) for v in (1.0, 10.0, pad.w, pad.L1, pad.L2)]
    if not statics.model.law.restoring:
        lengths.append(LIMITS.travel * lengths[2] / 2)
    sides = (-1.0, 0.0, 1.0)
    places = {(s * x, s * y) for s in lengths for x in sides for y in sides}
    limit = 0.98 * np.pi / 2
    wide = np.linspace(-limit, limit, 13) - float(np.ravel(pad.theta0)[0])
    small = np.array([0.0, -10.0, -1.0, 1.0, 10.0]) / lengths[2]
    small = np.append(small, [-LIMITS.tilt / 2, LIMITS.tilt / 2])
    tilts = sorted({*wide.tolist(), *small[np.abs(small) < limit].tolist()})
    each = [(x, y, lengths[2] * tilt, 0.0) for (x, y) in sorted(places) for tilt in tilts]
    return np.array(each).T[:, :, None]


class _Candidates(NamedTuple):
    """Equilibria that a search met, arrays (tries, n) and touching (points, tries)."""

    z: np.ndarray
    touching: np.ndarray
    met: np.ndarray
    presses: np.ndarray
    energy: np.ndarray


def _search(statics: Statics, seeds: np.ndarray) -> _Candidates:
    """Newton's method from all seeds (4, seeds, n) in each contact state; the energy is infinite
    where nothing was met."""
    states = np.array([*filter(any, statics.model.states)], dtype=float).T
    tries, n = states.shape[1] * seeds.shape[1], seeds.shape[2]
    z = np.tile(seeds, (1, states.shape[1], 1)).reshape(4, -1)
    on = np.repeat(states, seeds.shape[1], axis=1)
    each = np.repeat(on, n, axis=1)
    part = statics.pick(np.tile(np.arange(n), tries))
    met = part.settle(z, each, PASSES) != 0.0
    met[met] = part.pick(met).admits(z[:, met], each[:, met])
    presses, energy = met.copy(), np.full(met.shape, np.inf)
    here = part.pick(met)
    presses[met] = here.presses(z[:, met])
    energy[met] = here.model.energy(here.place(z[:, met]), np.zeros(3), each[:, met])
    arrays = (a.reshape(*a.shape[:-1], tries, n) for a in (z, met, presses, energy))
    z, met, presses, energy = arrays
    return _Candidates(z, on, met, presses, energy)


def _least(statics: Statics, found: _Candidates) -> tuple[np.ndarray, np.ndarray]:
    """Which try (n,) is the place of rest of each pad, and where (n,) there is one.

    It has the least potential energy of those that press, of two with the same that further along
    the surface's motion, to which friction pushes. A place where the pad only touches counts in
    so far as beside one of less energy a pressing one has to be admissible; of a law that turns
    the pad away admissible ones go before others.
    """
    tries, n = found.met.shape
    part = statics.pick(np.tile(np.arange(n), tries))
    touching = np.repeat(found.touching, n, axis=1)
    with np.errstate(all="ignore"):  # where nothing was met
        beyond = excursion(part, found.z.reshape(4, -1), touching).beyond().any(axis=0)
    fits = ~beyond.reshape(tries, n)
    pressing = np.where(found.presses, found.energy, np.inf)
    # the pad hangs in its springs
    idle = found.energy.min(axis=0) < pressing.min(axis=0)
    choose = found.presses & (fits | ~idle)
    if not statics.model.law.restoring:
        choose &= fits | ~(choose & fits).any(axis=0)
    energy = np.where(choose, found.energy, np.inf)
    least = energy.min(axis=0)
    with np.errstate(invalid="ignore"):
        alike = choose & (energy <= least + ALIKE * np.abs(least))
    best = np.argmax(np.where(alike, found.z[0], -np.inf), axis=0)
    return best, np.isfinite(least)


def rests(statics: Statics, n: int) -> Rests:
    """Where n pads rest without friction.

    Newton's method from the initial position finds the only such place of a law that turns the pad
    back. Where it fails, and with other laws, it starts from all places that the load reaches.
    For pads that then rest nowhere, with other laws nowhere admissible, places far off are searched
    too, for the first `FAR` of them.
    """
    statics = dataclasses.replace(statics, model=statics.model.replace(mu=0.0))
    z, every = np.zeros((4, n)), np.arange(n)
    side = statics.settle(z, None, 40)
    touching = statics.gaps(z) < 0.0
    there = (side == -1.0) & statics.presses(z) & statics.model.law.restoring
    searched = np.ones(n, dtype=bool)
    seeds = max(1, MOST // 300)
    left = every[~there]
    for start in range(0, left.size, seeds):
        i = left[start : start + seeds]
        part = statics.pick(i)
        found = _search(part, _near_seeds(part, i.size))
        _take(z, touching, there, i, found, *_least(part, found))
    doubtful = ~there
    if not statics.model.law.restoring:
        with np.errstate(all="ignore"):
            doubtful |= excursion(statics, z, touching).beyond().any(axis=0)
    far = every[doubtful]
    far = np.concatenate([far[~there[far]], far[there[far]]])
    searched[far[FAR:]] = there[far[FAR:]]
    for i in far[:FAR]:
        part = statics.pick(every[i : i + 1])
        near, all_over = _search(part, _near_seeds(part, 1)), _search(part, _far_seeds(part))
        both = (np.concatenate(pair, axis=1) for pair in zip(near[:2], all_over[:2], strict=True))
        rest = (np.concatenate(pair) for pair in zip(near[2:], all_over[2:], strict=True))
        found = _Candidates(*both, *rest)
        _take(z, touching, there, every[i : i + 1], found, *_least(part, found))
    return Rests(z, touching, there, searched)


def _take(
    z: np.ndarray,
    touching: np.ndarray,
    there: np.ndarray,
    i: np.ndarray,
    found: _Candidates,
    best: np.ndarray,
    good: np.ndarray,
) -> None:
    z[:, i[good]] = found.z[:, best, np.arange(i.size)][:, good]
    touching[:, i[good]] = found.touching[:, best[good]] > 0.0
    there[i] = good


def find_all(model: PadModel) -> list[Equilibrium]:
    """All sliding equilibria (R_n > 0) at the pad's mu, least potential energy first.

    Newton's method starts from some hundreds of places and tilts in each contact state; equilibria
    with |theta0 + theta| < pi/2 whose gaps agree with the state are listed. An equilibrium farther
    off than the springs are long may be missed. Raises ComputationError where rounding hides how
    one presses on the surface.
    """
    statics = Statics.of(model)
    found: list[tuple[np.ndarray, np.ndarray]] = []
    seeds = np.concatenate([_near_seeds(statics, 1), _far_seeds(statics)], axis=1)
    seeds[3] = model.pad.mu
    met = _search(statics, seeds)
    for i in np.flatnonzero(met.presses):
        z = met.z[:, i, 0]
        known = [np.abs(z - other).max() for other, _ in found]  # the same is met from many seeds
        if min(known, default=np.inf) >= 1e-6 * (1.0 + np.max(np.abs(z[:3]))):
            found.append((z, met.touching[:, i] > 0.0))
    each = (record(statics, z, State(*on.tolist())) for z, on in found)
    return sorted((e for e in each if e is not None), key=lambda e: e.potential)


@lru_cache(maxsize=64)  # one query asks for the same pads several times
def rest_of(model: PadModel) -> Rests:
    """`rests` of one pad, in its natural units; the arrays are unwritable."""
    found = rests(Statics.of(model), 1)
    for array in found:
        array.flags.writeable = False
    return found


def least_at_zero(model: PadModel) -> tuple[np.ndarray, State] | None:
    """Where the branch of a pad starts, z (4,) in natural units; None without a place of rest."""
    found = rest_of(dataclasses.replace(model, damping=None).replace(mu=0.0))
    if not found.there[0]:
        return None
    return found.z[:, 0].copy(), State(*found.touching[:, 0].tolist())


def branch_of(
    model: PadModel, mu_max: float, rising: bool = True, options: BranchOptions | None = None
) -> Branches:
    """The branch of one pad from mu = 0 to mu_max, whatever its own mu and damping."""
    smooth = dataclasses.replace(model, damping=None).replace(mu=0.0)
    return _branch_of(smooth, mu_max, rising, options)


@lru_cache(maxsize=64)
def _branch_of(
    smooth: PadModel, mu_max: float, rising: bool, options: BranchOptions | None
) -> Branches:
    start = rest_of(smooth)
    statics = Statics.of(smooth)
    return follow(
        statics, start.z, start.touching, np.array([mu_max]), options, rising, start.there
    )


def _beyond(branch: Branches) -> str:
    """Why the pad's mu lies beyond the rising part of its branch; empty if it does not."""
    if branch.end[0] != REACHED:
        return f"the equilibrium is not on the branch from mu = 0: {branch.end_of(0)}"
    if not branch.turns.any():
        return ""
    fold = float(branch.z[3, np.flatnonzero(branch.turns)[0]])
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
    branch = branch_of(model, model.pad.mu, rising=False)
    reason, beyond = branch.end_of(0), _beyond(branch)
    if reason == NO_START:
        beyond = f"the equilibrium is on no branch from mu = 0: {reason}"
    if branch.end[0] == REACHED:
        z, state = branch.z[:, -1], State(*branch.touching[:, -1].tolist())
        found = record(Statics.of(model), z, state, on_branch=True)
        if found is not None:
            how = "on the branch continued from mu = 0"
            return dataclasses.replace(found, beyond=beyond), how
    others = find_all(model)
    if others:
        return dataclasses.replace(others[0], beyond=beyond), f"least potential energy; {reason}"
    return None, f"no steady sliding exists: {reason}, and no other equilibrium was found"
