"""The modes of a pad along its branch, each a curve: column by column the same mode throughout."""

import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from squeal.io.scene import Scene
from squeal.linear import SystemFunction, thresholds
from squeal.linear.matrices import Array
from squeal.linear.paths import continued, links
from squeal.linear.roots import ComplexArray, ordered
from squeal.linear.system import matrices_at
from squeal.queries.pads.equilibrium import branch_system

SAMPLES = 201  # values of mu


def track(system: SystemFunction, mus: Iterable[float]) -> ComplexArray:
    """Modes (k, 2n), rad/s, of system(mu) -> (M, C, K) along rising values `mus` (k,).

    Columns 2j and 2j + 1 are a mode and its conjugate, by rising frequency at the first value.
    Modes that cross go on as they are, modes that veer keep their branch. Raises InputError for a
    singular M, and what `system` does.
    """
    values = [float(mu) for mu in mus]
    along = continued(system, values)
    rows = [along.at(values[0]).exponents]
    # index of each mode
    here = np.arange(len(rows[0]))
    left = itertools.count()
    for a, b in itertools.pairwise(values):
        now = rows[-1]
        for link in links(along.at, along.options, a, b, left):
            here = link.order[here]
            before = now
            now = link.after.exponents[here]
            if along.problem == "undamped":  # of both square roots that which goes on
                now = np.where(np.abs(now - before) <= np.abs(now + before), now, -now)
        rows.append(now)
    modes = np.array(rows)
    if along.problem == "undamped":
        modes = np.hstack([modes, -modes])
    free = 2 * np.shape(matrices_at(system, values[0])[0])[0] - modes.shape[1]
    modes = np.hstack([modes, np.zeros((len(modes), free))])
    return np.asarray(modes[:, ordered(modes[0])])


@dataclass(frozen=True, eq=False)
class ModeSweep:
    """Modes followed over the friction: mus (k,), values (k, 2n) as `track` has them, and
    contacts: (mu, state) where the contact changes."""

    mus: Array = field(repr=False)
    values: ComplexArray = field(repr=False)
    contacts: tuple[tuple[float, str], ...]


def sweep_modes(scene: Scene, low: float, high: float) -> ModeSweep:
    """Follow the modes of a scene along its branch from mu = low to high.

    Raises ComputationError if there is no equilibrium without friction, or the branch ends before
    `low`.
    """
    system, path = branch_system(scene, high)
    share = np.linspace(0.0, 1.0, SAMPLES)
    end = high
    stop = high
    contacts: tuple[tuple[float, str], ...] = ()
    if path is not None:
        end = stop = path.mu_end
        if end <= low:
            path.at(low)  # raises, with the reason
        changes = [mu for mu in path.breakpoints if low < mu < end]
        contacts = tuple((mu, path.model.state_name(path.at(mu)[1])) for mu in changes)
        if path.fold is not None:  # a frequency falls there as a fourth root: the values crowd
            share = 1.0 - (1.0 - share) ** 2
            stop = end * (1.0 - 1e-9)
    breaks = [mu for mu, _ in contacts]
    events = thresholds(system, stop, breaks, low)
    edges = [low, *(p.mu for p in events.points if low < p.mu < stop), stop]
    marked = [scene.pad.mu, *edges, *(c.mu for c in events.crossings), *breaks]
    marked += [math.nextafter(mu, 0.0) for mu in breaks]  # both sides of a change of contact
    seen = np.unique(np.clip(np.concatenate([low + (stop - low) * share, marked]), low, stop))
    return ModeSweep(seen, track(system, seen), contacts)
