"""The balance of many pads in machine code, which heyoka compiles of the model's own formulas.

Only what is evaluated at every step is compiled; `squeal.equilibrium.branch` decides by its values
as it does by those of NumPy. All pads of a contact law share the code: their numbers, `parameters`,
are its runtime parameters.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import heyoka as hy
import numpy as np

from squeal.equilibrium.statics import (
    RANGE_ROUNDING,
    Statics,
    Step,
    gap_rounding,
    take_columns,
)
from squeal.model.contact import ContactLaw
from squeal.model.equations import net_loads
from squeal.model.pad import Coefficients, Number, Pose, pose_of

# its warnings, as of a home that cannot be written, would go to standard output
hy.set_logger_level_critical()

COUNT = len(Coefficients._fields)
INITIAL_GAP = hy.par[COUNT]
THETA_0 = hy.par[COUNT + 1]
C = Coefficients(*(hy.par[i] for i in range(COUNT)))
Z = list(hy.make_vars("x", "y", "s", "mu"))


def _symbols(name: str, count: int) -> list[Number]:
    """Variables name0, name1, ..."""
    return [hy.expression(f"{name}{i}") for i in range(count)]


def _size(x: Number) -> Number:
    """|x|."""
    return hy.select(hy.lt(x, 0.0), -x, x)


def _determinant(rows: list[list[Number]]) -> Number:
    """Of a square matrix, by Laplace's expansion, whose common parts heyoka computes once."""
    if not rows:
        return hy.expression(1.0)
    total = hy.expression(0.0)
    for column, entry in enumerate(rows[0]):
        minor = [row[:column] + row[column + 1 :] for row in rows[1:]]
        total += (-1.0) ** column * entry * _determinant(minor)
    return total


def _balance(law: ContactLaw, on: list[Number]) -> list[Number]:
    """Expressions of the residual (3) of `Statics` at Z in a contact state."""
    loads = net_loads(hy, C._replace(mu=Z[3]), law, C.xy_theta(Z), on)
    return [loads.x, loads.y, loads.moment / C.w]


def _slopes(values: list[Number]) -> list[list[Number]]:
    """The derivatives of values by Z, a row for each."""
    return [[hy.diff(value, unknown) for unknown in Z] for value in values]


def _newton_step(balance: list[Number], condition: Number) -> list[Number]:
    """Expressions of a step of Newton's method to where the balance and one condition vanish.

    They are twelve, in this order:

    - the step (4), the inverse derivative times the values, by Cramer's rule; callers subtract it,
    - the signed minors (4) of the derivative J (3, 4) of the balance, each the determinant of J
      with a unit row below: a null vector of J, whose last entry is the determinant of the first
      three columns of J,
    - the derivative (4) of the condition.
    """
    values = [*balance, condition]
    rows = _slopes(values)
    steps = []
    minors = []
    for column in range(4):
        replaced = []
        for row, value in zip(rows, values, strict=True):
            replaced.append(row[:column] + [value] + row[column + 1 :])
        steps.append(_determinant(replaced) / _determinant(rows))
        unit = [hy.expression(float(i == column)) for i in range(4)]
        minors.append(_determinant([*rows[:3], unit]))
    return [*steps, *minors, *rows[3]]


@lru_cache
def _surface_step(law: ContactLaw) -> hy.cfunc_dbl:
    """A `_newton_step` of z, the contact state and a surface, see `Statics.surface_step`."""
    on = _symbols("on", law.points)
    weights = _symbols("weight", law.points)
    normal = _symbols("normal", 4)
    offset = hy.expression("offset")
    gaps = law.gaps(C, pose_of(hy, C.xy_theta(Z)))
    condition = -offset
    for factor, number in zip(weights + normal, [*gaps, *Z], strict=True):
        condition += factor * number
    values = _newton_step(_balance(law, on), condition)
    return hy.cfunc(values, vars=[*Z, *on, *weights, *normal, offset])


@lru_cache
def _fold_step(law: ContactLaw) -> hy.cfunc_dbl:
    """A `_newton_step` of z and the contact state, see `Statics.fold_step`."""
    on = _symbols("on", law.points)
    balance = _balance(law, on)
    determinant = _determinant([row[:3] for row in _slopes(balance)])
    return hy.cfunc(_newton_step(balance, determinant), vars=[*Z, *on])


@lru_cache
def _stiffness(law: ContactLaw) -> hy.cfunc_dbl:
    """A function of z and the contact state: the entries (9) of `Statics.stiffness`."""
    on = _symbols("on", law.points)
    q = hy.make_vars("x", "y", "theta")
    loads = net_loads(hy, C._replace(mu=Z[3]), law, q, on)
    entries = [-hy.diff(load, unknown) for load in loads for unknown in q]
    return hy.cfunc(hy.subs(entries, {q[2]: Z[2] / C.w}), vars=Z + on)


def _gaps_and_rounding(law: ContactLaw, z: list[Number]) -> tuple[list[Number], list[Number]]:
    """Expressions of the gaps, and of the bounds of their rounding."""
    pose = pose_of(hy, C.xy_theta(z))
    sizes = Coefficients(*map(_size, C))
    return list(law.gaps(C, pose)), gap_rounding(law, sizes, INITIAL_GAP, Pose(*map(_size, pose)))


@lru_cache
def _gaps(law: ContactLaw) -> hy.cfunc_dbl:
    """A function of z: the gaps, then the bounds of their rounding."""
    gaps, rounding = _gaps_and_rounding(law, Z)
    return hy.cfunc(gaps + rounding, vars=Z)


@lru_cache
def _excesses(law: ContactLaw) -> hy.cfunc_dbl:
    """A function of a share, the contact state, the end of the range of mu and the coefficients
    (16) of a cubic curve: by how much the event functions of `Statics.passed_events` at that
    share of the curve exceed the bounds of their rounding."""
    share, range_end = hy.make_vars("share", "range_end")
    on = _symbols("on", law.points)
    curve = _symbols("curve", 16)
    # z = (x, y, w theta, mu) at the share by Horner's rule; each power of the share has four
    # coefficients, one of each entry of z, and the cubic ones come last
    z = curve[12:]
    for power in (2, 1, 0):
        of_power = curve[4 * power : 4 * power + 4]
        z = [term + share * higher for term, higher in zip(of_power, z, strict=True)]
    excesses = []
    for touches, gap, bound in zip(on, *_gaps_and_rounding(law, z), strict=True):
        outwards = 2.0 * touches - 1.0  # 1 for a point that touches, else -1
        excesses.append(outwards * gap - bound)
    # tilted past 90 degrees; THETA_0 and C are symbols of the pad's numbers
    excesses.append(_size(THETA_0 + z[2] / C.w) - np.pi / 2)
    excesses.append(z[3] - range_end - RANGE_ROUNDING * range_end)
    return hy.cfunc(excesses, vars=[share, *on, range_end, *curve])


@dataclass(frozen=True)
class CompiledStatics(Statics):
    """The statics of n pads, compiled.

    parameters (k, n): the coefficients, `Statics.initial_gap` and theta0 of each pad.
    """

    parameters: np.ndarray

    @staticmethod
    def of_pads(statics: Statics, n: int) -> CompiledStatics:
        """The compiled statics of n pads."""
        numbers = (*statics.model.c, statics.initial_gap, statics.model.pad.theta0)
        parameters = np.empty((len(numbers), n))
        for row, value in zip(parameters, numbers, strict=True):
            row[:] = value
        return CompiledStatics(statics.model, statics.units, parameters)

    def pick(self, index: np.ndarray) -> CompiledStatics:
        picked = super().pick(index)
        return CompiledStatics(picked.model, picked.units, take_columns(self.parameters, index))

    def _run(self, function: hy.cfunc_dbl, *rows: np.ndarray) -> np.ndarray:
        """Values (p, n) of a function of rows (..., n)."""
        parameters = self.parameters[: function.nparams]
        return function(np.ascontiguousarray(np.concatenate(rows)), pars=parameters)

    def surface_step(self, z: np.ndarray, on: np.ndarray, surface: np.ndarray) -> Step:
        return _as_step(self._run(_surface_step(self.model.law), z, on, surface))

    def fold_step(self, z: np.ndarray, on: np.ndarray) -> Step:
        return _as_step(self._run(_fold_step(self.model.law), z, on))

    def null_vectors(self, derivatives: np.ndarray, rows: np.ndarray) -> np.ndarray:
        minors = derivatives[0]
        return minors / (rows * minors).sum(axis=0)

    def step_at_friction(self, z: np.ndarray, on: np.ndarray) -> Step:
        surface = np.zeros((len(on) + 5, z.shape[1]))  # mu = z[3]: weight of mu, then the offset
        surface[-2] = 1.0
        surface[-1] = z[3]
        step, exists, derivatives = self.surface_step(z, on, surface)
        return Step(step[:3], exists, derivatives)

    def determinant_sign(self, derivatives: np.ndarray) -> np.ndarray:
        return np.sign(derivatives[0, 3])

    def tangents(
        self, z: np.ndarray, on: np.ndarray, rows: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        _, _, derivatives = self.step_at_friction(z, on)
        return self.null_vectors(derivatives, rows), self.determinant_sign(derivatives)

    def stiffness(self, z: np.ndarray, on: np.ndarray) -> np.ndarray:
        return self._run(_stiffness(self.model.law), z, on).reshape(3, 3, -1)

    def for_steps(self, index: np.ndarray) -> CompiledStatics:
        return CompiledStatics(self.model, self.units, take_columns(self.parameters, index))

    def gaps(self, z: np.ndarray) -> np.ndarray:
        return self.gaps_and_rounding(z)[0]

    def rounding(self, z: np.ndarray) -> np.ndarray:
        return self.gaps_and_rounding(z)[1]

    def gaps_and_rounding(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        gaps, rounding = np.split(self._run(_gaps(self.model.law), z), 2)
        return gaps, rounding

    def passed_events_on(
        self, curve: np.ndarray, on: np.ndarray, mu_max: np.ndarray
    ) -> Callable[[np.ndarray], np.ndarray]:
        # the first row is overwritten by the share
        rows = np.concatenate([mu_max[None], on, mu_max[None], curve.reshape(16, -1)])

        def passed(share: np.ndarray) -> np.ndarray:
            if share.ndim == 1:
                rows[0] = share
                return self._run(_excesses(self.model.law), rows) > 0.0
            # shares (j, 1): one after the other, each on all curves
            return np.stack([passed(one.repeat(mu_max.size)) for one in share], axis=1)

        return passed


def _as_step(values: np.ndarray) -> Step:
    """A `_newton_step` from its values (12, n); derivatives (2, 4, n) are minors and condition."""
    step = values[:4]
    return Step(step, np.isfinite(step).all(axis=0), values[4:].reshape(2, 4, -1))
