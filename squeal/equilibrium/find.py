"""Equilibria of one pad: its places of rest without friction, all at its friction, and its branch
over mu."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from squeal.equilibrium import branch as ends
from squeal.equilibrium.branch import CHANGE, NODE, Branches, BranchOptions, follow
from squeal.equilibrium.statics import LIMITS, WHY_HIDDEN, Places, Statics, excursion
from squeal.errors import ComputationError
from squeal.model.contact import State
from squeal.model.equations import Linearisation, PadModel, linearise, natural_units, net_loads
from squeal.model.pad import Coefficients, pose
from squeal.numerics.differentiation import STEP, with_derivative

ALIKE = 1e-9  # of a potential energy: what two places with the same may differ by
MOST = 200  # pads that are searched together; bounds the memory
UNITS = 4.0 * float(np.finfo(float).eps)  # by which each coefficient and each load may be off
OF_LOADS = ("k1", "k2", "k3", "k4", "k_c", "F_n")  # to each of which one load is proportional
NO_START = (
    "without friction the pad has no place of rest nearby where the surfaces press on each other"
)


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

    Raises ComputationError where rounding hides how, which elsewhere is one more warning.
    """
    if not statics.presses(z):
        return None
    excesses = excursion(statics, z, state).warnings()
    if statics.hidden(z):
        if not excesses:
            raise ComputationError(f"no equilibrium can be given: {WHY_HIDDEN}")
        excesses += (WHY_HIDDEN,)
    units, (R_n, delta) = statics.units, map(float, statics.resultant(z, state))
    # in partial contact that of the integral law in every formulation
    potential = float(statics.model.energy(statics.place(z), np.zeros(3), state)) * units.energy
    place = tuple(statics.to_si(z).tolist()), float(z[3]), state
    loads = R_n * units.force, delta * units.length
    return Equilibrium(*place, *loads, potential, on_branch, excesses=excesses)


def _near_seeds(statics: Statics, n: int) -> np.ndarray:
    """Places (4, seeds, n) of the size of the load, and about half as far off as `LIMITS`."""
    own = natural_units(statics.model, (0.0,) * 6).length * np.ones(n)
    half = statics.model.pad.w / 2 * np.ones(n)
    near, tilts = (0.0, -1.0, 1.0), (0.0, -1.0, 1.0, -10.0, 10.0)
    small, wide = (np.array([*itertools.product(near, near, t)]) for t in (tilts, near))
    wide = wide * [LIMITS.travel, LIMITS.travel, LIMITS.tilt]
    seeds = np.concatenate([small.T[:, :, None] * own, wide.T[:, :, None] * half], axis=1)
    return np.concatenate([seeds, 0.0 * seeds[:1]])


def _far_seeds(statics: Statics) -> np.ndarray:
    """Places (4, seeds, 1) as far off as the springs are long, at all tilts."""
    pad, sides = statics.model.pad, (-1.0, 0.0, 1.0)
    lengths, limit = (pad.L1, pad.L2), 0.98 * np.pi / 2
    tilts = pad.w * (np.linspace(-limit, limit, 13) - pad.theta0)
    places = sorted({(s * x, s * y) for s in lengths for x in sides for y in sides})
    return np.array([(*place, tilt, 0.0) for place in places for tilt in tilts]).T[:, :, None]


def _search(
    statics: Statics, seeds: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Newton's method from all seeds (4, seeds, n) in each contact state: places (4, tries, n),
    states (points, tries), which (tries, n) are equilibria that press, energies of equilibria."""
    states = np.array([*filter(any, statics.model.states)], dtype=float).T
    tries, n = states.shape[1] * seeds.shape[1], seeds.shape[2]
    on = np.repeat(states, seeds.shape[1], axis=1)
    each = np.repeat(on, n, axis=1)
    part = statics.pick(np.tile(np.arange(n), tries))
    z, sides = part.settle(np.tile(seeds, (1, states.shape[1], 1)).reshape(4, -1), each, 60)
    with np.errstate(all="ignore"):  # where nothing is met
        met = (sides != 0.0) & part.admits(z, each)
        presses = met & part.presses(z)
        energy = np.where(met, part.model.energy(part.place(z), np.zeros(3), each), np.inf)
    return z.reshape(4, tries, n), on, presses.reshape(tries, n), energy.reshape(tries, n)


def _least(statics: Statics, n: int) -> Places:
    """Where each of n pads rests, of all places that the load reaches."""
    z, on, presses, energy = _search(statics, _near_seeds(statics, n))
    tries = on.shape[1]
    part = statics.pick(np.tile(np.arange(n), tries))
    with np.errstate(all="ignore"):  # where nothing was met
        beyond = excursion(part, z.reshape(4, -1), np.repeat(on, n, axis=1)).beyond().any(axis=0)
        # admissible ones go before others, which do not count where the pad hangs in its springs
        fits = presses & ~beyond.reshape(tries, n)
        hangs = energy.min(axis=0) < np.where(presses, energy, np.inf).min(axis=0)
        choose = np.where(fits.any(axis=0), fits, presses & ~hangs)
        energy = np.where(choose, energy, np.inf)
        least = energy.min(axis=0)
        alike = choose & (energy <= least + ALIKE * np.abs(least))
    # of two with the same energy that further along the surface's motion: there friction pushes
    best = np.argmax(np.where(alike, z[0], -np.inf), axis=0)
    return Places(z[:, best, np.arange(n)], on[:, best] > 0.0, np.any(choose, axis=0))


def rests(statics: Statics, n: int) -> Places:
    """Where n pads rest without friction.

    Newton's method from the initial position finds the only place of a law that turns the pad back.
    Where it fails, and with other laws, it starts from all places that the load reaches.
    """
    statics = dataclasses.replace(statics, model=statics.model.replace(mu=0.0))
    z, sides = statics.settle(np.zeros((4, n)), None, 40)
    touching = statics.gaps(z) < 0.0
    there = (sides == -1.0) & statics.presses(z) & (statics.model.law.sign > 0.0)
    left = np.flatnonzero(~there)
    for start in range(0, left.size, MOST):
        i = left[start : start + MOST]
        found = _least(statics.pick(i), i.size)
        there[i], good = found.there, i[found.there]
        z[:, good], touching[:, good] = found.z[:, found.there], found.touching[:, found.there]
    return Places(z, touching, there)


def find_all(model: PadModel) -> list[Equilibrium]:
    """All sliding equilibria (R_n > 0) at the pad's mu, least potential energy first.

    Newton's method starts from some hundreds of places and tilts in each contact state; one farther
    off than the springs are long may be missed. Raises ComputationError where rounding hides how
    one presses on the surface.
    """
    statics = Statics.of(model)
    roots: list[tuple[np.ndarray, np.ndarray]] = []
    seeds = np.concatenate([_near_seeds(statics, 1), _far_seeds(statics)], axis=1)
    seeds[3] = model.pad.mu
    places, on, presses, _ = _search(statics, seeds)
    for i in np.flatnonzero(presses):
        z = places[:, i, 0]
        apart = [np.abs(z - other).max() for other, _ in roots]  # the same is met from many seeds
        if min(apart, default=np.inf) >= 1e-6 * (1.0 + np.max(np.abs(z))):
            roots.append((z, on[:, i] > 0.0))
    each = (record(statics, z, State(*touching.tolist())) for z, touching in roots)
    return sorted((e for e in each if e is not None), key=lambda e: e.potential)


def sliding_equilibrium(model: PadModel) -> tuple[Equilibrium | None, str]:
    """The equilibrium that a query is about, and how it was reached or why there is none.

    It is the one on the branch continued from mu = 0, if that rises up to the pad's mu, else the
    one of least potential energy there, with a warning.
    """
    path = Path(model, branch_of(model, model.pad.mu))
    if path.branch.end[0] == ends.REACHED:
        taken = path.equilibrium(model.pad.mu)
        if taken is not None:
            return taken, "on the branch continued from mu = 0"
    others = find_all(dataclasses.replace(model, damping=None))
    if others:
        beyond = f"the equilibrium is not on the branch from mu = 0: {path.end}"
        return dataclasses.replace(others[0], beyond=beyond), f"least potential energy; {path.end}"
    return None, f"no steady sliding exists: {path.end}, and no other equilibrium was found"


def branch_of(model: PadModel, mu_max: float, options: BranchOptions | None = None) -> Branches:
    """The branch of one pad from mu = 0 to mu_max, for any friction and damping of its own."""
    statics = Statics.of(dataclasses.replace(model, damping=None).replace(mu=0.0))
    return follow(statics, rests(statics, 1), np.array([mu_max]), options)


@dataclass(frozen=True, eq=False)
class Path:
    """The branch of one pad as a function of mu, from mu = 0 up to its first fold or to its end.

    mu_end is its largest mu.
    """

    model: PadModel
    branch: Branches

    @staticmethod
    def of(model: PadModel, mu_max: float, options: BranchOptions | None = None) -> Path:
        """Follow the branch of a pad (its own mu is ignored) up to mu_max.

        Raises ComputationError if there is no equilibrium in contact at mu = 0.
        """
        path = Path(model, branch_of(model, mu_max, options))
        if not path.branch.z.size:
            raise ComputationError(NO_START)
        return path

    @property
    def statics(self) -> Statics:
        """The pad's statics in its natural units."""
        return self.branch.statics

    @property
    def end(self) -> str:
        """Why the path stops, in words."""
        mu, end = self.mu_end, self.branch.end[0]
        if end == ends.NOWHERE:
            return NO_START
        why = f": {WHY_HIDDEN}" if self.statics.hidden(self.branch.z[:, -1:]).any() else ""
        return {
            ends.REACHED: f"mu = {mu:.9g} is reached" if mu else "mu = 0",
            ends.TURNS: f"the branch from mu = 0 turns back in a fold at mu = {mu:.9g}",
            ends.LOST: f"the branch from mu = 0 is lost at mu = {mu:.9g}{why}",
            ends.AWAY: f"the equilibrium runs away to infinity near mu = {mu:.9g}",
            ends.SEPARATED: f"contact is lost at mu = {mu:.9g}",
            ends.TILTED: f"the pad turns past 90 degrees on the branch at mu = {mu:.9g}",
        }[int(end)]

    @cached_property
    def mu_end(self) -> float:
        """The largest mu on the path."""
        return float(self.branch.mu_end[0])

    @cached_property
    def fold(self) -> float | None:
        """The mu at which the branch turns back, None if it does not."""
        return self.mu_end if self.branch.end[0] == ends.TURNS else None

    @cached_property
    def breakpoints(self) -> list[float]:
        """Values of mu at which the contact state changes."""
        return [float(mu) for mu in self.branch.z[3, self.branch.kind == CHANGE]]

    def places(self, mus: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
        """Equilibria (4, k) in natural units at mus and contact states (points, k), at a change
        the new one.

        Raises ComputationError beyond the path.
        """
        mu = np.asarray(mus, dtype=float)
        z, touching, there = self.branch.at(np.zeros(mu.size, dtype=int), mu)
        if not there.all():
            lost = mu[np.argmin(there)]
            why = "it is lost" if 0.0 <= lost <= self.mu_end else self.end
            raise ComputationError(f"no equilibrium at mu = {lost:.9g}: {why}")
        return z, touching

    def at(self, mu: float) -> tuple[np.ndarray, State]:
        """The equilibrium z (4,) at mu and its contact state. Raises as `places` does."""
        z, touching = self.places([mu])
        return z[:, 0], State(*touching[:, 0].tolist())

    def error(self, mu: float) -> float:
        """How far rounding may move a change of contact or a fold at mu; 0 elsewhere.

        Rounding of each coefficient moves all conditions together, that of each load one by one.
        """
        branch, part = self.branch, self.statics
        law, error = part.model.law, 0.0
        for node in np.flatnonzero((branch.z[3] == mu) & (branch.kind != NODE)):
            z, before = branch.z[:, node, None], 1.0 * branch.touching[:, node - 1, None]
            changed = np.flatnonzero(branch.touching[:, node - 1] != branch.touching[:, node])
            pairs = part.linearised(z, before), with_derivative(part.gaps, z)
            both = zip(*pairs, strict=True)
            left, J = (np.concatenate([a, b[changed]])[..., 0] for a, b in both)
            # at a fold three conditions do: along the branch mu is stationary
            by = np.linalg.lstsq(J.T, np.eye(4)[3])[0]
            size = np.array([float(v) for v in part.model.c._replace(mu=mu)])
            shifted = Coefficients(*(size[:, None] * (1.0 + 1j * STEP * np.eye(size.size))))
            q = shifted.place(z.astype(complex))
            f, gaps = net_loads(np, shifted, law, q, before[:, 0]), law.gaps(shifted, pose(np, q))
            rows = f.x, f.y, f.moment / part.model.pad.w, *(gaps[i] for i in changed)
            rates = np.imag(np.broadcast_arrays(*rows)) / STEP
            loads = rates[:, [Coefficients._fields.index(name) for name in OF_LOADS]]
            shift = np.abs(by @ rates).sum() + (np.abs(by) @ np.abs(loads)).sum()
            below = 0.0 if changed.size else self._below(z, before)
            error = max(error, UNITS * shift + below + abs(by @ left) + np.spacing(mu))
        return float(error)

    def _below(self, z: np.ndarray, state: np.ndarray) -> float:
        """How far mu at z (4, 1), where rounding of the determinant left a fold, is below its top:
        with the slope of mu along the branch there and its rate, half the slope^2 / rate."""
        ahead = 1e-4 * np.abs(z).max()

        def along(z: np.ndarray) -> np.ndarray:
            return np.linalg.svd(self.statics.linearised(z, state)[1][..., 0])[2][3]

        turn = along(z)
        later = along(z + ahead * turn[:, None])
        rate = later[3] * np.sign(later @ turn) - turn[3]
        return float(turn[3] ** 2 / 2 * ahead / abs(rate))

    def equilibrium(self, mu: float) -> Equilibrium | None:
        """The equilibrium at mu in SI units; None beyond the path."""
        if not 0.0 <= mu <= self.mu_end:
            return None
        z, state = self.at(mu)
        return record(self.statics, z, state, on_branch=True)

    def __call__(self, mu: float) -> Linearisation:
        """M, C, K about the equilibrium at mu, SI units."""
        return self.many([mu])[0]

    def many(self, mus: Sequence[float]) -> list[Linearisation]:
        """M, C, K at each mu, which together take hardly longer than one."""
        z, touching = self.places(mus)
        model = self.model.replace(mu=np.array(mus, dtype=float))
        M, C, K = linearise(model, self.statics.to_si(z), 1.0 * touching)
        return [Linearisation(M, C[:, :, i], K[:, :, i]) for i in range(len(mus))]

    def shaken(self, mu: float) -> list[tuple[tuple[np.ndarray, ...], ...]]:
        """M, C, K at mu, and their derivatives by relative changes of x, of y and of theta."""
        (z, touching), h = self.places([mu]), 1e-12
        at = self.statics.to_si(z * (1.0 + h * np.eye(4, 4, 1)))
        M, *rest = linearise(self.model.replace(mu=mu), at, np.repeat(1.0 * touching, 4, 1))
        own, *others = np.moveaxis(np.array(rest), -1, 0)
        return [((M, *own), (0 * M, *(one - own) / h)) for one in others]
