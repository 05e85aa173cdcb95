"""The modes of a pad along its branch, each a curve: column by column the same mode throughout."""

import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from squeal.io.scene import Scene
from squeal.linear import SystemFunction, thresholds
from squeal.linear.functions import matrices_at
from squeal.linear.matrices import Array
from squeal.linear.paths import continued, links
from squeal.linear.roots import ComplexArray, ordered
from squeal.queries.pads.equilibrium import branch_system

SAMPLES = 201  # values of mu


def track(system: SystemFunction, mus: Iterable[float]) -> ComplexArray:
    """Modes (k, 2n), rad/s, of system(mu) -> (M, C, K) along rising values `mus` (k,).

    Columns 2j and 2j + 1 are a mode and its conjugate, by rising frequency at the first value.
    Modes that cross go on as they are, modes that veer keep their branch. Raises InputError for a
    singular M, and what `system` does.
    """
    values = [float(mu) for mu in mus]
    continuation = continued(system, values)
    undamped = continuation.problem == "undamped"
    rows = [continuation.at(values[0]).exponents]
    # index[j]: where mode j stands among the roots of the continuation at the present value; a link
    # to the next value has in link.order[i] where root i stands there
    index = np.arange(len(rows[0]))
    budget = itertools.count()  # an item for each halving of an interval: as many as are needed
    for a, b in itertools.pairwise(values):
        roots = rows[-1]
        for link in links(continuation.at, a, b, budget):
            index = link.order[index]
            before = roots
            roots = link.after.exponents[index]
            if undamped:
                # the continuation follows s^2 and may return s or -s, both of which are roots:
                # the one nearer to the root before continues it
                roots = np.where(np.abs(roots - before) <= np.abs(roots + before), roots, -roots)
        rows.append(roots)
    modes = np.array(rows)
    if undamped:
        modes = np.hstack([modes, -modes])
    # the continuation leaves out roots that are zero throughout, of free motions
    coordinates = np.shape(matrices_at(system, values[0])[0])[0]
    free = np.zeros((len(modes), 2 * coordinates - modes.shape[1]))
    modes = np.hstack([modes, free])
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

    Values of mu: evenly spaced ones, the scene's, thresholds and crossings of frequencies, and both
    sides of each change of contact. Where the branch ends in a fold, the evenly spaced ones crowd
    there. Raises ComputationError if there is no equilibrium without friction, or the branch ends
    before `low`.
    """
    system, path = branch_system(scene, high)
    share = np.linspace(0.0, 1.0, SAMPLES)
    stop = high
    contacts: tuple[tuple[float, str], ...] = ()
    if path is not None:
        end = path.mu_end
        stop = end
        if end <= low:
            path.at(low)  # raises, with the reason
        for mu in path.breakpoints:
            if low < mu < end:
                _, state = path.at(mu)
                contacts = (*contacts, (mu, path.model.state_name(state)))
        if path.fold is not None:
            # the least eigenvalue of K vanishes as (mu_end - mu)^(1/2), a frequency as its root
            share = 1.0 - (1.0 - share) ** 2
            stop = end * (1.0 - 1e-9)  # at the fold itself K is singular
    contact_changes = [mu for mu, _ in contacts]
    just_before = [math.nextafter(mu, 0.0) for mu in contact_changes]  # with the contact before
    events = thresholds(system, stop, contact_changes, low)
    critical = [point.mu for point in events.points if low < point.mu < stop]
    crossings = [crossing.mu for crossing in events.crossings]
    marked = [scene.pad.mu, low, *critical, stop, *crossings, *contact_changes, *just_before]
    even = low + (stop - low) * share
    mus = np.unique(np.clip(np.concatenate([even, marked]), low, stop))
    return ModeSweep(mus, track(system, mus), contacts)
