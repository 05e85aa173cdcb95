"""Equilibria by search: where pads rest without friction, and all of one pad at its friction."""

import dataclasses
import itertools
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from squeal.equilibrium.statics import LIMITS, WHY_UNRESOLVED, Equilibria, Statics, excursion
from squeal.errors import ComputationError
from squeal.model.contact import State
from squeal.model.equations import PadModel, natural_units

ALIKE = 1e-9  # relative difference of potential energies that count as equal
MOST = 200  # pads for which equilibria are searched together; bounds the memory
SAME = 1e-6  # relative distance of two equilibria that count as one


@dataclass(frozen=True)
class Equilibrium:
    """A sliding equilibrium in SI units: q = (x, y, theta), contact state, reaction.

    R_n is the normal reaction and delta its distance from the mass centre (or from the frame's
    origin, in that formulation). `on_branch`: it was reached from mu = 0; beyond: why it does not
    lie on the part of the branch that rises from there; excesses: a sentence for each limit of
    `squeal.equilibrium.statics.LIMITS` that it exceeds.
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
        """Every reason why the model may not hold there."""
        if self.beyond:
            return (self.beyond, *self.excesses)
        return self.excesses

    @property
    def admissible(self) -> bool:
        """True if there is no such reason."""
        return not self.warnings


def equilibrium_in_si(
    statics: Statics, z: np.ndarray, state: State, on_branch: bool = False
) -> Equilibrium | None:
    """The equilibrium z (4,) of one pad in SI units; None where the surfaces do not press on each
    other. on_branch: whether it was reached from mu = 0.

    Where rounding hides how they press, an equilibrium that exceeds a limit of the excursion gets
    one more warning; for one within the limits ComputationError is raised.
    """
    if not statics.presses(z):
        return None
    excesses = excursion(statics, z, state).warnings()
    if statics.unresolved(z):
        if not excesses:
            raise ComputationError(f"no equilibrium can be given: {WHY_UNRESOLVED}")
        excesses += (WHY_UNRESOLVED,)
    units = statics.units
    R_n, delta = statics.resultant(z, state)
    # in partial contact the contact's energy is that of the integral law, whatever the formulation
    at_rest = np.zeros(3)  # the velocities
    potential = statics.model.energy(statics.q(z), at_rest, state)
    x, y, theta = statics.to_si(z).tolist()
    return Equilibrium(
        q=(x, y, theta),
        mu=float(z[3]),
        state=state,
        R_n=float(R_n) * units.force,
        delta=float(delta) * units.length,
        potential=float(potential) * units.energy,
        on_branch=on_branch,
        excesses=excesses,
    )


def _near_seeds(statics: Statics, n: int) -> np.ndarray:
    """Starts (4, seeds, n) of Newton's method for n pads without friction.

    Each is z = (x, y, w theta, mu) in natural units, with mu = 0. The starts fill two grids around
    the initial position. One of 45 reaches to the displacement under the load, and in tilt to 10
    times as much; one of 27 reaches to half of what `LIMITS` allow.
    """
    displacement_under_load = natural_units(statics.model).length * np.ones(n)
    half_length = statics.model.pad.w * np.ones(n)
    senses = (0.0, -1.0, 1.0)
    tilts = (0.0, -1.0, 1.0, -10.0, 10.0)
    # (45, 3): x, y and w theta in displacements under the load
    near = np.array([*itertools.product(senses, senses, tilts)])
    # (27, 3): x, y and w theta in half lengths w. The limit of travel is a share of w, and that of
    # tilt (rad) times w is one of w theta
    half_limits = np.array([LIMITS.travel, LIMITS.travel, LIMITS.tilt]) / 2
    wide = half_limits * [*itertools.product(senses, senses, senses)]
    seeds = np.concatenate(
        [near.T[:, :, None] * displacement_under_load, wide.T[:, :, None] * half_length], axis=1
    )
    without_friction = np.zeros_like(seeds[:1])
    return np.concatenate([seeds, without_friction])


def _far_seeds(statics: Statics) -> np.ndarray:
    """Starts (4, seeds, 1) of Newton's method as far off as the springs are long, at all tilts."""
    pad = statics.model.pad
    steepest = 0.98 * np.pi / 2
    tilts = pad.w * (np.linspace(-steepest, steepest, 13) - pad.theta0)
    directions = (-1.0, 0.0, 1.0)
    positions = set()  # (x, y); the origin of both springs counts once
    for length in (pad.L1, pad.L2):
        for x, y in itertools.product(directions, directions):
            positions.add((length * x, length * y))
    seeds = [(x, y, tilt, 0.0) for (x, y), tilt in itertools.product(sorted(positions), tilts)]
    return np.array(seeds).T[:, :, None]


class _Search(NamedTuple):
    """Where Newton's method led n pads, each from as many tries (seed and contact state)."""

    statics: Statics  # of tries * n pads in one row: all n pads once for each try
    z: np.ndarray  # (4, tries, n)
    touching: np.ndarray  # (points, tries, n), factors 1.0 and 0.0: the contact state of the try
    presses: np.ndarray  # (tries, n), bools: an equilibrium that presses on the surface
    energy: np.ndarray  # (tries, n), potential energy of an equilibrium, else infinite


def _search(statics: Statics, seeds: np.ndarray) -> _Search:
    """Newton's method for n pads from all seeds (4, seeds, n) in each contact state in which some
    point touches."""
    states = np.array([state for state in statics.model.states if any(state)], dtype=float).T
    per_state, n = seeds.shape[1:]
    tries = states.shape[1] * per_state
    # in one row: all seeds in the first state, each seed of all pads, then those in the next state
    touching = np.repeat(states, per_state * n, axis=1)
    starts = np.tile(seeds, (1, states.shape[1], 1)).reshape(4, -1)
    statics_of_tries = statics.pick(np.tile(np.arange(n), tries))
    # without the derivatives
    z, _, balanced = statics_of_tries.solve_balance(starts, touching, passes=60)
    at_rest = np.zeros(3)  # the velocities
    with np.errstate(all="ignore"):  # tries that led to no equilibrium
        is_equilibrium = balanced & statics_of_tries.is_consistent(z, touching)
        presses = is_equilibrium & statics_of_tries.presses(z)
        energy = statics_of_tries.model.energy(statics_of_tries.q(z), at_rest, touching)
        energy = np.where(is_equilibrium, energy, np.inf)
    return _Search(
        statics=statics_of_tries,
        z=z.reshape(4, tries, n),
        touching=touching.reshape(-1, tries, n),
        presses=presses.reshape(tries, n),
        energy=energy.reshape(tries, n),
    )


def _least_energy(statics: Statics, n: int) -> Equilibria:
    """The equilibrium without friction of least potential energy of each of n pads.

    Equilibria within the `LIMITS` of the excursion from the initial position are preferred,
    whatever their energy. Of a pad that has none of them, `exists` is false if it hangs free of the
    surface with less energy than any that presses.
    """
    search = _search(statics, _near_seeds(statics, n))
    # the statics of the search are of tries * n pads in one row
    touching = search.touching.reshape(len(search.touching), -1)
    with np.errstate(all="ignore"):  # tries that led to no equilibrium
        excursions = excursion(search.statics, search.z.reshape(4, -1), touching)
        beyond = excursions.beyond().any(axis=0).reshape(-1, n)  # (tries, n), as all that follow
        admissible = search.presses & ~beyond
        # without an admissible one all that press count, unless the pad hangs free of the surface
        # in its springs with less energy
        least_pressing = np.where(search.presses, search.energy, np.inf).min(axis=0)
        hangs = search.energy.min(axis=0) < least_pressing
        has_admissible = admissible.any(axis=0)
        candidates = np.where(has_admissible, admissible, search.presses & ~hangs)
        energy = np.where(candidates, search.energy, np.inf)
        least = energy.min(axis=0)
        alike = candidates & (energy <= least + ALIKE * np.abs(least))
    # of equal energies the one farthest along the surface's motion, where friction pushes
    best = np.argmax(np.where(alike, search.z[0], -np.inf), axis=0)
    pad = np.arange(n)
    return Equilibria(
        z=search.z[:, best, pad],
        touching=search.touching[:, best, pad] > 0.0,
        exists=np.any(candidates, axis=0),
    )


def frictionless_equilibria(statics: Statics, n: int) -> Equilibria:
    """The equilibria of n pads without friction.

    With a contact law whose moment turns the pad back there is one, which Newton's method finds
    from the initial position. Where that fails, and with other laws, it starts from many seeds, and
    the equilibrium of least potential energy counts.
    """
    without_friction = dataclasses.replace(statics, model=statics.model.replace(mu=0.0))
    z, determinant_sign, balanced = without_friction.solve_balance(
        np.zeros((4, n)), touching=None, passes=40
    )
    touching = without_friction.gaps(z) < 0.0
    turns_back = statics.model.law.sign > 0.0
    # `solve_balance` gives the sign of det(-K), K the 3 x 3 static stiffness: -1 where det K > 0
    is_stiff = determinant_sign == -1.0
    exists = balanced & is_stiff & without_friction.presses(z) & turns_back
    missing = np.flatnonzero(~exists)
    for start in range(0, missing.size, MOST):
        i = missing[start : start + MOST]
        least = _least_energy(without_friction.pick(i), i.size)
        exists[i] = least.exists
        found = i[least.exists]
        z[:, found] = least.z[:, least.exists]
        touching[:, found] = least.touching[:, least.exists]
    return Equilibria(z, touching, exists)


def find_all(model: PadModel) -> list[Equilibrium]:
    """All sliding equilibria (R_n > 0) at the pad's mu, least potential energy first.

    Newton's method starts from some hundreds of positions and tilts in each contact state; an
    equilibrium farther off than the springs are long may be missed. Raises ComputationError where
    rounding hides how one presses on the surface.
    """
    statics = Statics.of(model)
    seeds = np.concatenate([_near_seeds(statics, 1), _far_seeds(statics)], axis=1)
    seeds[3] = model.pad.mu
    search = _search(statics, seeds)
    distinct: list[np.ndarray] = []  # z (4,) of each
    equilibria: list[Equilibrium] = []
    for i in np.flatnonzero(search.presses):
        z = search.z[:, i, 0]  # of try i; the last axis holds the only pad
        # many seeds lead to the same equilibrium
        distances = [np.abs(z - other).max() for other in distinct]
        if min(distances, default=np.inf) < SAME * (1.0 + np.max(np.abs(z))):
            continue
        distinct.append(z)
        equilibrium = equilibrium_in_si(
            statics, z, State(*(search.touching[:, i, 0] > 0.0).tolist())
        )
        if equilibrium is not None:
            equilibria.append(equilibrium)
    return sorted(equilibria, key=lambda equilibrium: equilibrium.potential)
