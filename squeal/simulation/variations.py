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
from squeal.simulation.hybrid import Course, Observer, Steps, integrate
from squeal.simulation.run import in_natural_units, make_integrator

PARTS = 8  # Runge-Kutta steps of the variational equations in a step of the motion


class Variations(Observer):
    """The matrix of small deviations (6, 6) along a motion, in natural units, kept in size."""

    dense = True

    def __init__(self, model: PadModel) -> None:
        self._model = model
        self.matrix = np.eye(6)
        self.logarithm = 0.0  # of the factor taken out of the matrix
        self.t = 0.0

    def _rates(self, steps: Steps, share: float) -> np.ndarray:
        """The matrices A (s, 6, 6) of the linear equations at a share of each step."""
        pad = self._model.pad
        lever = np.array([1.0, 1.0, pad.w])
        states = steps.states(np.full(len(steps.t), share))
        q, rates = (np.array(self._model.c.place(part)) for part in (states[:3], states[3:]))
        loads = partial(self._model.loads, state=steps.on)
        slopes = np.moveaxis(complex_step(partial(loads, rates=rates), q), -1, 0)
        mass = np.array([pad.m, pad.m, pad.I])
        A = np.zeros((len(steps.t), 6, 6))
        A[:, :3, 3:] = np.eye(3)
        A[:, 3:, :3] = slopes * (lever / mass)[:, None] / lever
        if self._model.terms:
            damping = np.moveaxis(complex_step(lambda v: loads(q, rates=v), rates), -1, 0)
            A[:, 3:, 3:] = damping * (lever / mass)[:, None] / lever
        return A

    def see(self, course: Course) -> None:
        steps, one = course.dense, np.eye(6)
        h = steps.h[:, None, None] / PARTS
        matrices = np.broadcast_to(one, (len(h), 6, 6))
        end = self._rates(steps, 0.0)
        for part in range(PARTS):  # of all steps at once
            k1, middle = end, self._rates(steps, (part + 0.5) / PARTS)
            end = self._rates(steps, (part + 1.0) / PARTS)
            k2 = middle @ (one + h / 2 * k1)
            k3 = middle @ (one + h / 2 * k2)
            k4 = end @ (one + h * k3)
            matrices = (one + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)) @ matrices
        for matrix in matrices:
            self.matrix = matrix @ self.matrix
            factor = float(np.abs(self.matrix).max())
            self.matrix /= factor
            self.logarithm += math.log(factor)
        self.t = float(course.t1[0])

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
