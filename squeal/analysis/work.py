"""Work of the normal and friction contact forces along a motion, cycle by cycle.

A reaction that derives from a potential does no work between two instants of separation; what it
does then is fed in, or taken out, by the contact law itself (finding E4).
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from squeal.model.equations import PadModel
from squeal.model.mechanics import Loads, pose
from squeal.model.states import State
from squeal.scene import Scene
from squeal.simulation.legs import Leg
from squeal.simulation.observers import Observer
from squeal.simulation.run import in_natural_units, integrate, make_integrator

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(10)


@dataclass(frozen=True)
class Works:
    """Works in J over a run.

    normal, friction: of the normal reaction and of friction; cycles (n,): of the normal reaction
    from each loss of the surfaces to the next; fed: what the normal reaction did beyond what its
    potential (of the integral law in model B2) gave back; kinetic: the greatest kinetic energy;
    gained: the rise of the energy of motion, springs and brake force.
    """

    normal: float
    friction: float
    cycles: np.ndarray
    fed: float
    kinetic: float
    gained: float


class _Power(Observer):
    """Integrates the powers of the contact forces over each leg (Gauss-Legendre in each step)."""

    dense = True

    def __init__(self, model: PadModel) -> None:
        self._model = model
        self._without_friction = model.replace(mu=0.0)
        self.work = np.zeros(2)  # of the normal reaction, of friction
        self.at_loss: list[float] = []
        self.kinetic = 0.0
        # energy without and with that of the contact, at the start and at the end so far
        self.energies = np.full((2, 2), np.nan)

    def _contact(self, model: PadModel, q: np.ndarray, state: State) -> np.ndarray:
        load: Loads = model.law.loads(model.c, pose(np, tuple(q)), state)
        return np.array(np.broadcast_arrays(*load, q[0])[:3])

    def _energies(self, scaled: np.ndarray, state: State) -> list[float]:
        q, rates = self._split(scaled[None])
        return [
            float(self._model.energy(q, rates, contact)[0])
            for contact in (self._model.apart, state)
        ]

    def _split(self, scaled: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        turn = np.array([1.0, 1.0, 1.0 / self._model.pad.w])[:, None]
        return scaled[:, :3].T * turn, scaled[:, 3:].T * turn

    def leg(self, leg: Leg) -> None:
        assert leg.dense is not None
        assert leg.nodes is not None
        if leg.t0 == 0.0:
            self.energies[0] = self._energies(leg.dense(np.zeros(1))[0], leg.contact)
        self.energies[1] = self._energies(leg.end, leg.contact)
        half = 0.5 * np.diff(leg.nodes)
        t = (leg.nodes[:-1] + half)[:, None] + half[:, None] * _NODES
        q, rates = self._split(leg.dense(t.ravel()))
        normal = self._contact(self._without_friction, q, leg.contact)
        both = self._contact(self._model, q, leg.contact)
        weights = (half[:, None] * _WEIGHTS).ravel()
        power = np.array([(normal * rates).sum(axis=0), ((both - normal) * rates).sum(axis=0)])
        self.work += power @ weights
        pad = self._model.pad
        mass = np.array([pad.m, pad.m, pad.I])[:, None]
        self.kinetic = max(self.kinetic, float((0.5 * mass * rates**2).sum(axis=0).max()))

    def change(self, t: float, source: State, target: State) -> None:
        if not any(target):
            self.at_loss.append(float(self.work[0]))


def contact_work(scene: Scene) -> Works:
    """Simulate a scene and integrate the work of its contact forces.

    Raises ComputationError where the motion leaves the model.
    """
    units, model, start, stop = in_natural_units(scene)
    watch = _Power(model)
    integrate(model, make_integrator(model, scene.tolerance, "auto"), units, start, stop, [watch])
    joule = units.energy
    bare, whole = watch.energies[1] - watch.energies[0]
    return Works(
        normal=float(watch.work[0]) * joule,
        friction=float(watch.work[1]) * joule,
        cycles=np.array([b - a for a, b in itertools.pairwise(watch.at_loss)]) * joule,
        fed=float(watch.work[0] + whole - bare) * joule,
        kinetic=watch.kinetic * joule,
        gained=float(bare) * joule,
    )
