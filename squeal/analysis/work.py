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
from squeal.model.states import State
from squeal.model.units import Units
from squeal.simulation.legs import Leg
from squeal.simulation.observers import Observer
from squeal.simulation.run import in_natural_units, integrate, make_integrator

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(10)


@dataclass(frozen=True)
class Course:
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
    course: Course
    excursions: tuple[Excursion, ...]


class _Power(Observer):
    """Integrates the powers of the contact forces over each leg (Gauss-Legendre in each step)."""

    dense = True

    def __init__(self, model: PadModel) -> None:
        self._model = model
        self._without_friction = model.replace(mu=0.0)
        self.work = np.zeros(3)  # of the normal reaction, of friction, of damping
        self.at_loss: list[float] = []
        self.kinetic = 0.0
        self._columns: list[np.ndarray] = []  # as in `Course`, of a leg each
        self._rows = 0
        self.stays: list[list[int]] = []  # in partial contact: their first and last row
        self._stays_on = False

    def _contact(
        self, model: PadModel, q: np.ndarray, rates: np.ndarray, state: State
    ) -> np.ndarray:
        load: Loads = model.law.loads(model.at_speed(rates[0]), pose(np, tuple(q)), state)
        return np.array(np.broadcast_arrays(*load, q[0])[:3])

    def _energies(self, scaled: np.ndarray, state: State) -> list[np.ndarray]:
        """Kinetic energy, those of springs and contact, and the work of the load, (n,) each."""
        model, (q, rates) = self._model, self._split(scaled)
        at = pose(np, tuple(q))
        mass = np.array([model.pad.m, model.pad.m, model.pad.I])[:, None]
        kinetic = (0.5 * mass * rates**2).sum(axis=0)
        contact = model.law.energy(model.c, at, state) + 0.0 * q[1]
        return [kinetic, spring_energy(np, model.c, at), contact, -model.c.F_n * q[1]]

    def _split(self, scaled: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        turn = np.array([1.0, 1.0, 1.0 / self._model.pad.w])[:, None]
        return scaled[:, :3].T * turn, scaled[:, 3:].T * turn

    def leg(self, leg: Leg) -> None:
        assert leg.dense is not None
        assert leg.nodes is not None
        half = 0.5 * np.diff(leg.nodes)
        t = (leg.nodes[:-1] + half)[:, None] + half[:, None] * _NODES
        q, rates = self._split(leg.dense(t.ravel()))
        normal = self._contact(self._without_friction, q, rates, leg.contact)
        both = self._contact(self._model, q, rates, leg.contact)
        weights = (half[:, None] * _WEIGHTS).ravel()
        C = self._model.damping
        damping = np.zeros_like(rates) if C is None else -np.array(C) @ rates
        power = (np.array([normal, both - normal, damping]) * rates).sum(axis=1)
        done = (power * weights).reshape(len(power), -1, len(_NODES)).sum(axis=2).cumsum(axis=1)
        # the first leg has a row more, for the start
        after = leg.nodes[1:] if self._columns else leg.nodes
        works = np.pad(done, ((0, 0), (len(after) - done.shape[1], 0))) + self.work[:, None]
        self.work = works[:, -1]
        energies = self._energies(leg.dense(after), leg.contact)
        self._columns.append(np.array([after, *energies, *works]))
        if any(leg.contact) and not all(leg.contact):
            if not self._stays_on:
                self.stays.append([max(self._rows - 1, 0), 0])
            self.stays[-1][1] = self._rows + len(after) - 1
            self._stays_on = True
        self._rows += len(after)
        kinetic, *_ = self._energies(leg.dense(t.ravel()), leg.contact)
        self.kinetic = max(self.kinetic, float(kinetic.max()))

    def change(self, t: float, source: State, target: State) -> None:
        if not any(target):
            self.at_loss.append(float(self.work[0]))
        self._stays_on &= any(target) and not all(target)

    def course(self, units: Units) -> Course:
        """What was seen, in SI units; the work of the load counts from the start."""
        t, *energies = np.concatenate(self._columns, axis=1)
        kinetic, springs, contact, load, *works = (e * units.energy for e in energies)
        return Course(t * units.time, kinetic, springs, contact, load - load[0], *works)


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
            for i, j in watch.stays
        ),
    )
