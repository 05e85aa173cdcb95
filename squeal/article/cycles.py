"""Periodic motions through contact changes, by shooting, with their Floquet multipliers.

A period is a time T with phi_T(z) = z. Newton's method solves this for z, T and, along a branch of
motions, for mu, with the matrix of the variational equations as derivative.

The loads are continuous where the contact changes, since an edge's force starts from zero. The jump
(saltation) matrix there, I + (f_after - f_before) n' / (n' f_before) with the normal n of the
switching surface, is therefore the identity, and the variational equations run on through it.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from squeal.errors import ComputationError
from squeal.model.equations import PadModel, Units
from squeal.numerics.differentiation import complex_step
from squeal.simulation.hybrid import Course, Observer, Steps, integrate, state_rates
from squeal.simulation.run import make_integrator

PARTS = 8  # Runge-Kutta steps of the variational equations in a step of the motion
TOLERANCE = 1e-12  # of the integration
CLOSED = 1e-9  # how far apart, relative to its size, a motion's ends may be to count as closed
PASSES = 12  # of Newton's method
STEP = 1e-6  # in mu, for the derivative by it


class Variations(Observer):
    """The matrix of small deviations (6, 6) along a motion, in natural units, kept in size."""

    dense = True

    def __init__(self, model: PadModel) -> None:
        self._model = model
        self.matrix = np.eye(6)
        self.logarithm = 0.0  # of the factor taken out of the matrix

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


@dataclass(frozen=True, eq=False)
class Cycle:
    """A periodic motion in natural units.

    state (6,): a state that it passes; period; monodromy (6, 6): the matrix of small deviations
    over a period; mu; gap: how far apart its ends are, relative to its size.
    """

    state: np.ndarray
    period: float
    monodromy: np.ndarray
    mu: float
    gap: float

    @property
    def multipliers(self) -> np.ndarray:
        """The five Floquet multipliers beside the one of a shift in time, the largest first."""
        values = np.linalg.eigvals(self.monodromy)
        others = np.delete(values, np.argmin(np.abs(values - 1.0)))
        return np.asarray(others[np.argsort(-np.abs(others))])

    @property
    def trivial(self) -> complex:
        """The multiplier of a shift in time, 1 but for errors."""
        values = np.linalg.eigvals(self.monodromy)
        return complex(values[np.argmin(np.abs(values - 1.0))])

    @property
    def stable(self) -> bool:
        """Small deviations decay."""
        return bool(np.all(np.abs(self.multipliers) < 1.0))


@dataclass(frozen=True, eq=False)
class Shooting:
    """A scaled pad whose periodic motions are sought, and its units."""

    model: PadModel
    units: Units

    def motion(
        self, state: np.ndarray, time: float, mu: float, observers: list[Observer] | None = None
    ) -> np.ndarray:
        """The state (6,) after some time from a state. Raises ComputationError."""
        model = self.model.replace(mu=mu)
        integrator = make_integrator(model, TOLERANCE, "auto")
        _, end, _, _ = integrate(model, integrator, self.units, state, time, observers or [])
        return np.asarray(end)

    def _over(self, state: np.ndarray, period: float, mu: float) -> tuple[np.ndarray, Cycle]:
        """phi_T(z) - z and, as a cycle, what is known of the motion."""
        watch = Variations(self.model.replace(mu=mu))
        end = self.motion(state, period, mu, [watch])
        apart = end - state
        monodromy = watch.matrix * np.exp(watch.logarithm)
        gap = float(np.abs(apart).max() / np.abs(state).max())
        return apart, Cycle(state, period, monodromy, mu, gap)

    def solve(
        self, guess: np.ndarray, direction: np.ndarray | None = None, most: int = PASSES
    ) -> tuple[Cycle, np.ndarray]:
        """The cycle next to a guess (z, T, mu), and the direction (8,) of its branch.

        The correction is orthogonal to `direction`; without one, mu is held. Raises
        ComputationError where Newton's method does not converge.
        """
        along = np.eye(8)[7] if direction is None else direction
        x = guess.copy()
        phase = state_rates(self.model.replace(mu=x[7]), x[:6])
        phase /= np.linalg.norm(phase)
        for _ in range(most):
            apart, cycle = self._over(x[:6], x[6], x[7])
            end = x[:6] + apart
            J = np.zeros((8, 8))
            J[:6, :6] = cycle.monodromy - np.eye(6)
            J[:6, 6] = state_rates(self.model.replace(mu=x[7]), end)
            J[:6, 7] = (self.motion(x[:6], x[6], x[7] + STEP) - end) / STEP
            J[6, :6] = phase
            J[7] = along
            if cycle.gap < CLOSED:
                tangent = np.linalg.solve(J, np.eye(8)[7])
                return cycle, tangent / np.linalg.norm(tangent)
            residual = np.concatenate([apart, [phase @ (x[:6] - guess[:6]), along @ (x - guess)]])
            x = x - np.linalg.solve(J, residual)
            if not (x[6] > 0.0 and np.all(np.isfinite(x)) and x[7] >= 0.0):
                break
        raise ComputationError("no periodic motion was found next to the guess")

    def branch(self, cycle: Cycle, towards: float, step: float, most: int) -> Iterator[Cycle]:
        """Cycles along the branch from one in the sense in which mu goes `towards` (+1 or -1).

        Steps of at most `step` in (z, T, mu), shortened where Newton's method fails; ends after
        `most` cycles, or where it fails with a thousandth of the step.
        """
        x = np.concatenate([cycle.state, [cycle.period, cycle.mu]])
        cycle, way = self.solve(x)
        way *= np.sign(way[7]) * towards
        size = step
        for _ in range(most):
            while True:
                try:
                    guess = x + size * way
                    cycle, turned = self.solve(guess, way, 6)
                    break
                except ComputationError:
                    size /= 2.0
                    if size < 1e-3 * step:
                        return
            yield cycle
            x = np.concatenate([cycle.state, [cycle.period, cycle.mu]])
            way = turned * np.sign(turned @ way)
            size = min(1.5 * size, step)
