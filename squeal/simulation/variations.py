"""Growth of small deviations along a motion, by the variational equations.

The loads are continuous where the contact changes, since an edge's force starts from zero. The jump
(saltation) matrix there, I + (f_after - f_before) n' / (n' f_before) with the normal n of the
switching surface, is therefore the identity, and the variational equations run on through it.
"""

import math
from functools import partial

import numpy as np

from squeal.errors import ComputationError
from squeal.io.scene import Scene
from squeal.model.equations import PadModel
from squeal.numerics.newton import complex_step
from squeal.simulation.legs import Leg
from squeal.simulation.observers import Observer
from squeal.simulation.run import in_natural_units, integrate, make_integrator

PARTS = 8  # Runge-Kutta steps of the variational equations in a step of the motion


class Variations(Observer):
    """The matrix of small deviations (6, 6) along a motion, in natural units, kept in size."""

    dense = True

    def __init__(self, model: PadModel) -> None:
        self._model = model
        self.matrix = np.eye(6)
        self.logarithm = 0.0  # of the factor taken out of the matrix
        self.t = 0.0

    def _rates(self, leg: Leg, t: np.ndarray) -> np.ndarray:
        """The matrices A (n, 6, 6) of the linear equations at some times."""
        assert leg.dense is not None
        pad = self._model.pad
        lever = np.array([1.0, 1.0, pad.w])
        states = leg.dense(t).T
        q, rates = (np.array(self._model.c.place(part)) for part in (states[:3], states[3:]))
        loads = partial(self._model.loads, state=leg.contact)
        slopes = np.moveaxis(complex_step(partial(loads, rates=rates), q), -1, 0)
        mass = np.array([pad.m, pad.m, pad.I])
        A = np.zeros((len(t), 6, 6))
        A[:, :3, 3:] = np.eye(3)
        A[:, 3:, :3] = slopes * (lever / mass)[:, None] / lever
        if self._model.terms:
            damping = np.moveaxis(complex_step(lambda v: loads(q, rates=v), rates), -1, 0)
            A[:, 3:, 3:] = damping * (lever / mass)[:, None] / lever
        return A

    def leg(self, leg: Leg) -> None:
        assert leg.nodes is not None
        size = np.repeat(np.diff(leg.nodes) / PARTS, PARTS)
        begin = leg.nodes[0] + np.concatenate([[0.0], np.cumsum(size)])
        A = self._rates(leg, np.append(begin, begin[:-1] + size / 2))
        at, between = A[: len(begin)], A[len(begin) :]
        h, one = size[:, None, None], np.eye(6)
        k1 = at[:-1]
        k2 = between @ (one + h / 2 * k1)
        k3 = between @ (one + h / 2 * k2)
        k4 = at[1:] @ (one + h * k3)
        for step in one + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4):
            self.matrix = step @ self.matrix
        factor = float(np.linalg.norm(self.matrix, 2))
        self.matrix /= factor
        self.logarithm += math.log(factor)
        self.t = leg.t1

    @property
    def exponent(self) -> float:
        """Largest Lyapunov exponent over the motion so far, per unit of time."""
        return self.logarithm / self.t


def variations(scene: Scene, longer: float = 1.0) -> Variations:
    """Small deviations along a scene's motion, over `longer` times its time or till its model ends.

    Raises ComputationError if that is at once.
    """
    units, model, start, stop = in_natural_units(scene)
    watch = Variations(model)
    integrator = make_integrator(model, scene.tolerance, "auto")
    try:
        integrate(model, integrator, units, start, longer * stop, [watch])
    except ComputationError:
        if watch.t == 0.0:
            raise
    return watch
