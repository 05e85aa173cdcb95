"""Work of the contact forces along a motion.

A reaction that derives from a potential does no work between two instants of separation; what it
does then is fed in, or taken out, by the contact law itself (finding E4).
"""

from typing import NamedTuple

import numpy as np

from squeal.io.scene import Scene
from squeal.model.equations import PadModel
from squeal.model.pad import Loads, at_speed, pose_of, spring_energy
from squeal.simulation.hybrid import Segment, integrate
from squeal.simulation.observers import Grid
from squeal.simulation.run import in_natural_units, make_integrator

NODES = 12  # in each step, of the quadrature


class Energies(NamedTuple):
    """Energies and works so far in J at times t (k,) in s, the ends of the integration steps.

    kinetic; springs, contact: elastic energy of the inclined springs and of the contact (of the
    integral law in model B2); load, normal, friction, damping: work done so far by the brake force,
    the normal reaction, friction and damping.
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


class Excursion(NamedTuple):
    """An episode of partial contact from start to stop (s), and what was fed in during it (J)."""

    start: float
    stop: float
    fed: float


class Works(NamedTuple):
    """Works in J over a run.

    friction: of friction; fed: what the normal reaction did beyond its potential; kinetic: the
    greatest kinetic energy; energies: over time; excursions: in order, they add up to `fed`.
    """

    friction: float
    fed: float
    kinetic: float
    energies: Energies
    excursions: tuple[Excursion, ...]


class _Power:
    """Integrates the powers of the forces over each step (Lobatto's quadrature).

    All is in natural units. Segments are passed to `observe` in the order of time.
    """

    def __init__(self, model: PadModel) -> None:
        self._model = model
        self.kinetic = 0.0  # the greatest so far
        # rows as in `Energies`, a column for the first begin and for the end of each step; the load
        # row is -F_n y, so that the work of the brake force is its change
        self.columns: list[np.ndarray] = []
        self.partial: list[np.ndarray] = []  # whether each step is in partial contact

    def _contact(
        self, model: PadModel, q: np.ndarray, rates: np.ndarray, on: np.ndarray
    ) -> np.ndarray:
        """Loads (F_x, F_y, M), (3, ...), of the contact at (x, y, theta), whose rates are given."""
        c = at_speed(np, model.c, model.pad.fall, rates[0])
        load: Loads = model.law.loads(c, pose_of(np, tuple(q)), on)
        return np.array(np.broadcast_arrays(*load, q[0])[:3])  # in the shape of q[0]

    def _energies(self, q: np.ndarray, rates: np.ndarray, on: np.ndarray) -> np.ndarray:
        """Kinetic energy, energy of the springs, of the contact, and minus F_n y, whose change is
        the work of the brake force: (4, ...)."""
        model = self._model
        at = pose_of(np, tuple(q))
        mass = np.array([model.pad.m, model.pad.m, model.pad.I]).reshape(3, *[1] * q[0].ndim)
        kinetic = (0.5 * mass * rates**2).sum(axis=0)
        contact = model.law.energy(model.c, at, on) + 0.0 * q[1]  # in the shape of q[1]
        return np.array([kinetic, spring_energy(np, model.c, at), contact, -model.c.F_n * q[1]])

    def observe(self, segment: Segment) -> None:
        """Append to `columns` and `partial` the steps of the next segment.

        The work of a load in a step is the integral of (F_x, F_y, M) . (x_dot, y_dot, theta_dot).
        The load of friction is that of the contact less that of the contact without friction.
        """
        model = self._model
        grid = Grid(segment, NODES)
        on = segment.steps.on  # (contact point, step): 1 where it touches
        # states hold w theta in place of theta
        to_theta = np.array([1.0, 1.0, 1.0 / model.pad.w])[:, None, None]
        q = grid.states[:3] * to_theta  # (3, node, step)
        rates = grid.states[3:] * to_theta
        # loads (F_x, F_y, M) of the contact without friction, of friction and of damping, each
        # (3, node, step)
        normal = self._contact(model.replace(mu=0.0), q, rates, on[:, None])
        friction = self._contact(model, q, rates, on[:, None]) - normal
        C = np.zeros((3, 3)) if model.damping is None else np.array(model.damping)
        damping = -np.tensordot(C, rates, 1)
        power = (np.array([normal, friction, damping]) * rates).sum(axis=1)  # (load, node, step)
        work = np.tensordot(grid.weights, power, (0, 1)) * segment.steps.h  # (load, step)
        energies = self._energies(q, rates, on[:, None])  # (row, node, step)
        if not self.columns:  # the begin of the run: its first node, without works
            start = [grid.t[0, 0], *energies[:, 0, 0], 0.0, 0.0, 0.0]
            self.columns.append(np.array(start)[:, None])
        # rows of a column: time, four energies, and the works of normal forces, friction, damping
        works_before = self.columns[-1][5:, -1:]
        works = works_before + work.cumsum(axis=1)
        # the ends of the steps: their last nodes
        self.columns.append(np.array([grid.t[-1], *energies[:, -1], *works]))
        some_point_touches = on.max(axis=0) > 0.0
        some_point_is_separated = on.min(axis=0) <= 0.0
        self.partial.append(some_point_touches & some_point_is_separated)
        self.kinetic = max(self.kinetic, float(energies[0].max()))


def contact_work(scene: Scene) -> Works:
    """Simulate a scene and integrate the work of its contact forces.

    Raises ComputationError where the motion leaves the model.
    """
    units, model, start, stop = in_natural_units(scene)
    power = _Power(model)
    integrator = make_integrator(model, scene.tolerance, "auto")
    integrate(model, integrator, units, start, stop, [power.observe], dense=True)
    t, *rows = np.concatenate(power.columns, axis=1)
    kinetic, springs, contact, load, normal, friction, damping = (
        row * units.energy for row in rows
    )
    energies = Energies(
        t=t * units.time,
        kinetic=kinetic,
        springs=springs,
        contact=contact,
        load=load - load[0],  # the work of the brake force is the change of this row
        normal=normal,
        friction=friction,
        damping=damping,
    )
    # of each step, with no partial contact before and after the run; step k goes from time t[k] to
    # t[k + 1], so that a change at index k is at time t[k]
    in_partial_contact = np.concatenate([[False], *power.partial, [False]])
    changes = np.flatnonzero(in_partial_contact[1:] != in_partial_contact[:-1])
    fed = energies.fed
    excursions = []
    for begin, end in changes.reshape(-1, 2).tolist():  # each episode has two changes
        excursions.append(
            Excursion(
                start=float(energies.t[begin]),
                stop=float(energies.t[end]),
                fed=float(fed[end] - fed[begin]),
            )
        )
    return Works(
        friction=float(energies.friction[-1]),
        fed=float(fed[-1]),
        kinetic=power.kinetic * units.energy,
        energies=energies,
        excursions=tuple(excursions),
    )
