"""Equilibria of many pads at once, which differ in a few parameters: maps start from here."""

import dataclasses
import itertools
from collections.abc import Iterator

import numpy as np

from squeal.equilibrium.admissible import excursion
from squeal.equilibrium.find import least_at_zero
from squeal.equilibrium.settings import DEFAULT, LIMITS
from squeal.equilibrium.statics import Statics
from squeal.model.equations import PadModel
from squeal.model.law import Touching
from squeal.model.states import State
from squeal.model.units import natural_units
from squeal.numerics.newton import newton_steps

EPS = float(np.finfo(float).eps)
LOST = 20  # pads for which all places are searched, one by one
MOST = 4096  # trials that are solved at once; bounds the memory
WALK = 8  # passes of a step along a branch; fewer take a steep branch for one that turns back
CONVERGED = 1e-12  # relative step of Newton's method
SHALLOW = 1e-6  # penetration over distance from the origin: below it steps must be finer
SOFT = 0.1  # of what the load displaces the springs alone: the least that counts as far
FINEST = 0.015  # of that step: what rounding allows


def subset(model: PadModel, names: tuple[str, ...], pick: np.ndarray) -> PadModel:
    """The pads that `pick` names of those whose parameters `names` are arrays."""
    changes = {name: getattr(model.pad, name)[pick] for name in names}
    return model.replace(**changes)


def _balance(statics: Statics, z: np.ndarray, kept: State | None) -> tuple[np.ndarray, np.ndarray]:
    """One pass of Newton's method in the state `kept`, or that of the gaps; z (4, n) is moved.

    Returns the size of each step relative to z, and the sign of the balance's determinant, which
    changes at a fold. A separated pad is treated as if in full contact, which pulls it back.
    """
    heights = statics.gaps(z)
    touching: Touching = (heights < 0.0) + 1.0 * np.all(heights >= 0.0, axis=0)
    if kept is not None:
        touching = kept
    with np.errstate(all="ignore"):
        step, side = newton_steps(*statics.linearised(z, touching, 3))
    if kept is not None:  # a search: no leap to a place that the start has nothing to do with
        pad = statics.model.pad
        longest = [0.5 * (pad.w + np.maximum(pad.L1, pad.L2))] * 2 + [0.3 * pad.w]
        with np.errstate(invalid="ignore"):
            ratio = np.abs(step) / np.array(np.broadcast_arrays(*longest, step[0])[:3])
            step = step / np.maximum(1.0, ratio.max(axis=0))
    z[:3] -= step
    far = 1.0 + np.max(np.abs(z[:3]), axis=0)
    fine = np.clip(-np.min(heights, axis=0) / (SHALLOW * far), FINEST, 1.0)
    size = np.max(np.abs(step), axis=0) / far / fine
    return np.where(side == 0.0, np.inf, size), side


def solved(
    statics: Statics, names: tuple[str, ...], z: np.ndarray, passes: int, kept: State | None = None
) -> np.ndarray:
    """Newton's method at fixed mu from z (4, n), which is moved; in one contact state if given.

    Returns the sign of the determinant at the equilibrium, 0 where none was found or where the pad
    has turned past 90 degrees.
    """
    size, side = np.full(z.shape[1], np.inf), np.zeros(z.shape[1])
    part, going = statics, np.arange(z.shape[1])
    for _ in range(passes):
        at = z[:, going]
        size[going], side[going] = _balance(part, at, kept)
        z[:, going] = at
        left = ~(size[going] < CONVERGED)
        if not left.any():
            break
        if not left.all():
            going = going[left]
            part = dataclasses.replace(statics, model=subset(statics.model, names, going))
    upright = np.abs(statics.tilt(z)) < np.pi / 2
    return np.where((size < CONVERGED) & upright, side, 0.0)


def moved_little(statics: Statics, z: np.ndarray, before: np.ndarray) -> np.ndarray:
    """Where the places z (4, n) are still on the branch of those before.

    Beside stiff contact the load displaces the springs by far more than one, the contact's share.
    """
    pad = statics.model.pad
    contact = sum(getattr(pad, name) for name in statics.model.law.parameters)
    far = SOFT * contact / np.maximum(pad.k1 + pad.k2, EPS * contact)
    size = np.maximum(1.0, far) + np.max(np.abs(before[:3]), axis=0)
    return np.asarray(np.max(np.abs(z[:3] - before[:3]), axis=0) < DEFAULT.jump * size)


def _seeds(statics: Statics, n: int) -> Iterator[np.ndarray]:
    """Places (4, n) that the load of each of n pads reaches, as `find.find_all` takes them, and
    places about half as far as `AdmissibleLimits` if the law turns the pad away."""
    own = natural_units(statics.model, (0.0,) * 6).length * np.ones(n)
    near = (0.0, -1.0, 1.0)
    for turn, x, y in itertools.product((*near, -10.0, 10.0), near, near):
        yield own * np.array([x, y, turn, 0.0])[:, None]
    if not statics.model.law.restoring:
        half = statics.model.pad.w * np.ones(n) / 2
        for turn, x, y in itertools.product(near, near, near):
            at = [x * LIMITS.travel, y * LIMITS.travel, turn * LIMITS.tilt, 0.0]
            yield half * np.array(at)[:, None]


def rests(statics: Statics, names: tuple[str, ...], n: int) -> tuple[np.ndarray, np.ndarray]:
    """Where n pads rest without friction: places (4, n), and the sign of the determinant there.

    Newton's method from the initial position finds the only such place of a law that turns the pad
    back. Where it fails, and with other laws, it starts from all places that the load reaches, and
    the least potential energy of the admissible ones, if there are any, decides, as it does for a
    single pad. Of pads that then rest nowhere, with other laws nowhere admissible, `LOST` are
    searched for one by one; more are left as they are. Places where a pad touches without pressing
    are left out, as `least_at_zero` does.
    """
    z = np.zeros((4, n))
    side = solved(statics, names, z, 40)
    idle = (side != 0.0) & ~statics.presses(z)
    side[idle] = 0.0
    doubtful = np.flatnonzero(side != -1.0) if statics.model.law.restoring else np.arange(n)
    if not doubtful.size:
        return z, side
    part = dataclasses.replace(statics, model=subset(statics.model, names, doubtful))
    least, meant = np.full(doubtful.size, np.inf), np.zeros(doubtful.size, dtype=bool)
    seeds = list(_seeds(part, doubtful.size))
    together = max(1, MOST // doubtful.size)  # seeds that are tried at once
    for state, first in itertools.product(
        filter(any, statics.model.states), range(0, len(seeds), together)
    ):
        tried = seeds[first : first + together]
        again = np.tile(np.arange(doubtful.size), len(tried))
        same = dataclasses.replace(part, model=subset(part.model, names, again))
        trial, touching = np.concatenate(tried, axis=1), np.array(state, dtype=float)[:, None]
        met = solved(same, names, trial, 20, state)
        own = np.all((same.gaps(trial) < 0.0) == (touching > 0.0), axis=0) & (met != 0.0)
        with np.errstate(all="ignore"):  # where nothing was met
            energy = same.model.energy(same.place(trial), np.zeros(3), state)
            fits = np.asarray(~excursion(same, trial, touching).beyond().any(axis=0))
            own &= same.presses(trial) & (fits | ~idle[doubtful[again]])
        for at in np.split(np.arange(again.size), len(tried)):
            with np.errstate(invalid="ignore"):
                lower = energy[at] < least - 1e-9 * np.abs(energy[at])
            better = own[at] & ((fits[at] & ~meant) | ((fits[at] == meant) & lower))
            at = at[better]
            least[better], meant[better] = energy[at], fits[at]
            z[:, doubtful[better]], side[doubtful[better]] = trial[:, at], met[at]
    side[doubtful[~np.isfinite(least)]] = 0.0
    # those that rest nowhere so far, then of other laws those that rest too far off
    left = ~np.isfinite(least) if statics.model.law.restoring else ~meant
    lost = doubtful[np.argsort(np.isfinite(least) + 2 * meant, kind="stable")][: np.sum(left)]
    for i in lost[:LOST]:
        place = _far(subset(statics.model, names, i), names)
        if place is not None:
            one = dataclasses.replace(statics, model=subset(statics.model, names, np.array([i])))
            side[i] = solved(one, names, place, 20)[0]
            z[:, i] = place[:, 0]
    return z, side


def _far(model: PadModel, names: tuple[str, ...]) -> np.ndarray | None:
    """Where one pad rests, searched for alone, as a place (4, 1); None if it does not."""
    plain = {name: float(getattr(model.pad, name)) for name in {*names, "I"}}
    found = least_at_zero(model.replace(**plain))
    if found is None:
        return None
    x, y, theta = Statics.of(model.replace(**plain)).to_si(found[0])
    return np.array([[x], [y], [plain.get("w", model.pad.w) * theta], [0.0]])


def branch_ends(
    statics: Statics, names: tuple[str, ...], mu: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Equilibria (4, n) on the branches from mu = 0; the determinant's sign, 0 short of mu.

    Each point walks in steps of its own, the way of the one before, halved where Newton's method
    fails, passes a fold or jumps to another branch; one below the shortest share of mu means that
    the branch turns back.
    """
    z, side = rests(statics, names, mu.size)
    reached = (side != 0.0) & (mu == 0.0)
    active = (side != 0.0) & ~reached
    step = DEFAULT.first_share * mu
    slope = np.zeros((3, mu.size))  # of the last step
    while active.any():
        index = np.flatnonzero(active)
        part = dataclasses.replace(statics, model=subset(statics.model, names, index))
        trial, before = z[:, index], z[:, index]
        trial[3] = np.minimum(trial[3] + step[index], mu[index])
        ahead = slope[:, index].any(axis=0)
        trial[:3] += (trial[3] - before[3]) * slope[:, index]
        good = solved(part, names, trial, WALK) == side[index]
        good &= moved_little(part, trial, before)
        z[:, index[good]] = trial[:, good]
        went = (trial - before)[:, good]
        slope[:, index] = 0.0
        slope[:, index[good]] = went[:3] / went[3]
        misled = ~good & ahead  # the same step is tried again from the place itself
        step[index] *= np.where(good, DEFAULT.growth, np.where(misled, 1.0, 0.5))
        reached |= active & (z[3] >= mu)
        active &= ~reached & (step > DEFAULT.shortest_share * mu)
    return z, np.where(reached, side, 0.0)
