"""Work of the normal and friction contact forces along a motion, cycle by cycle.

A reaction that derives from a potential does no work between two instants of separation; what it
does then is fed in, or taken out, by the contact law itself (finding E4).
"""

import itertools
from dataclasses import dataclass

import numpy as np

from squeal.io.scene import Scene
from squeal.model.equations import PadModel
from squeal.model.mechanics import Loads, pose, spring_energy
from squeal.model.units import Units
from squeal.simulation.hybrid import Course, Observer, integrate
from squeal.simulation.observers import Grid
from squeal.simulation.run import in_natural_units, make_integrator

PLACES = 12  # in each step, of the quadrature


@dataclass(frozen=True)
class Energies:
    """Energies and works so far in J at times t (k,) in s, the ends of the integration steps.

    kinetic; springs, contact: elastic energy of the inclined springs and of the contact; load,
    normal, friction, damping: work done so far by the brake force, the normal reaction, friction
    and damping.
    """

    t: np.ndarray
    kinetic: np.ndarray
    springs: np.ndarray
    contact: np.ndarray
    load: np.ndarray
    normal: np.ndarray
    friction: np.ndarray
    damping: np.ndarray

    @property
    def fed(self) -> np.ndarray:
        """What the normal reaction has done beyond what its potential gave back."""
        return np.asarray(self.normal + self.contact - self.contact[0])


@dataclass(frozen=True)
class Excursion:
    """A stay in partial contact from start to stop (s), and what was fed in during it (J)."""

    start: float
    stop: float
    fed: float


@dataclass(frozen=True)
class Works:
    """Works in J over a run.

    normal, friction, damping: of the normal reaction, of friction and of damping; cycles (n,): of
    the normal reaction from each loss of the surfaces to the next; fed: what the normal reaction
    did beyond what its potential (of the integral law in model B2) gave back; kinetic: the greatest
    kinetic energy; gained: the rise of the energy of motion, springs and brake force, the sum of
    the works; course: all that over time; excursions: in order; what they feed in adds up to `fed`.
    """

    normal: float
    friction: float
    damping: float
    cycles: np.ndarray
    fed: float
    kinetic: float
    gained: float
    course: Energies
    excursions: tuple[Excursion, ...]


class _Power(Observer):
    """Integrates the powers of the contact forces over each step (Lobatto's quadrature)."""

    dense = True

    def __init__(self, model: PadModel) -> None:
        self._model = model
        self._without_friction = model.replace(mu=0.0)
        self.at_loss: list[float] = []
        self.kinetic = 0.0
        self._columns: list[np.ndarray] = []  # as in `Energies`, of the ends of steps
        self._partial: list[np.ndarray] = []  # whether each step is in partial contact

    def _contact(
        self, model: PadModel, q: np.ndarray, rates: np.ndarray, on: np.ndarray
    ) -> np.ndarray:
        load: Loads = model.law.loads(model.at_speed(rates[0]), pose(np, tuple(q)), on)
        return np.array(np.broadcast_arrays(*load, q[0])[:3])

    def _energies(self, states: np.ndarray, on: np.ndarray) -> np.ndarray:
        """Kinetic energy, those of springs and contact, and the work of the load, (4, ...)."""
        model, (q, rates) = self._model, self._split(states)
        at = pose(np, tuple(q))
        mass = np.array([model.pad.m, model.pad.m, model.pad.I]).reshape(3, *[1] * q[0].ndim)
        kinetic = (0.5 * mass * rates**2).sum(axis=0)
        contact = model.law.energy(model.c, at, on) + 0.0 * q[1]
        return np.array([kinetic, spring_energy(np, model.c, at), contact, -model.c.F_n * q[1]])

    def _split(self, states: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        turn = np.array([1.0, 1.0, 1.0 / self._model.pad.w]).reshape(3, *[1] * (states.ndim - 1))
        return states[:3] * turn, states[3:] * turn

    def see(self, course: Course) -> None:
        grid, on = Grid(course, PLACES), course.dense.on
        q, rates = self._split(grid.states)
        normal = self._contact(self._without_friction, q, rates, on[:, None])
        both = self._contact(self._model, q, rates, on[:, None])
        C = self._model.damping
        damping = np.zeros_like(rates) if C is None else -np.tensordot(np.array(C), rates, 1)
        power = (np.array([normal, both - normal, damping]) * rates).sum(axis=1)
        work = np.tensordot(grid.weights, power, (0, 1)) * course.dense.h
        energies = self._energies(grid.states, on[:, None])
        if not self._columns:
            first = [grid.t[0, 0], *energies[:, 0, 0], 0.0, 0.0, 0.0]
            self._columns.append(np.array(first)[:, None])
        works = self._columns[-1][5:, -1:] + work.cumsum(axis=1)
        self._columns.append(np.array([grid.t[-1], *energies[:, -1], *works]))
        self._partial.append((on.max(axis=0) > 0.0) & (on.min(axis=0) <= 0.0))
        self.kinetic = max(self.kinetic, float(energies[0].max()))
        lost = course.t[~course.on.any(axis=0)]
        done = np.searchsorted(grid.t[-1], lost * (1.0 - 1e-12))
        self.at_loss += works[0, done].tolist()

    def course(self, units: Units) -> Energies:
        """What was seen, in SI units; the work of the load counts from the start."""
        t, *energies = np.concatenate(self._columns, axis=1)
        kinetic, springs, contact, load, *works = (e * units.energy for e in energies)
        return Energies(t * units.time, kinetic, springs, contact, load - load[0], *works)

    def stays(self) -> np.ndarray:
        """Rows (n, 2) of the course at which stays in partial contact begin and end."""
        there = np.concatenate([[False], *self._partial, [False]])
        return np.flatnonzero(there[1:] != there[:-1]).reshape(-1, 2)


def contact_work(scene: Scene) -> Works:
    """Simulate a scene and integrate the work of its contact forces.

    Raises ComputationError where the motion leaves the model.
    """
    units, model, start, stop = in_natural_units(scene)
    watch = _Power(model)
    integrate(model, make_integrator(model, scene.tolerance, "auto"), units, start, stop, [watch])
    joule, course = units.energy, watch.course(units)
    bare = course.kinetic + course.springs - course.load
    return Works(
        normal=float(course.normal[-1]),
        friction=float(course.friction[-1]),
        damping=float(course.damping[-1]),
        cycles=np.array([b - a for a, b in itertools.pairwise(watch.at_loss)]) * joule,
        fed=float(course.fed[-1]),
        kinetic=watch.kinetic * joule,
        gained=float(bare[-1] - bare[0]),
        course=course,
        excursions=tuple(
            Excursion(float(course.t[i]), float(course.t[j]), float(course.fed[j] - course.fed[i]))
            for i, j in watch.stays().tolist()
        ),
    )
