"""Balance of the loads on a pad at rest in its own units, and how far from there models hold."""

from __future__ import annotations

import copy
import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.polynomial.polynomial import polyval

from squeal.model.contact import ContactLaw, Touching
from squeal.model.equations import PadModel, Units, natural_units, net_loads
from squeal.model.pad import Coefficients, Number, Operations, Pose, pose_of, springs
from squeal.numerics import differentiation
from squeal.numerics.differentiation import STEP, Dual, complex_step, with_derivative

ROUNDING = 8.0 * float(np.finfo(float).eps)  # of a sum, over the sizes of what is added
NEWTON_ROUNDING = 0.1  # size of what Newton's method rounds, where the load displaces by about one
CONVERGED = 1e-12  # relative step of Newton's method
STALLED = 1e-7  # relative step that counts as converged where the next one is no shorter
# largest bound of rounding, as a share of the penetration; the bound is some 100 times the error
UNRESOLVED = 1e-4
RANGE_ROUNDING = 1e-15  # of the end of the range of mu, relative
WHY_UNRESOLVED = (
    "rounding of the pad's place is too large beside how deep it presses into the surface, which "
    "hides the contact; softer contact or a greater load is required"
)


class Equilibria(NamedTuple):
    """Equilibria of n pads."""

    z: np.ndarray  # (4, n), unknowns (x, y, w theta, mu) in natural units
    touching: np.ndarray  # (points, n), bools: the contact states
    exists: np.ndarray  # (n,), bools: whether the pad has one

    def some(self, which: np.ndarray) -> Equilibria:
        """The equilibria of some pads, by numbers or bools."""
        return Equilibria(*(take_columns(array, which) for array in self))


def take_columns(array: np.ndarray, which: np.ndarray) -> np.ndarray:
    """Some columns (..., j) of an array (..., k), by their numbers (j,) or by bools (k,).

    Each row of the answer is contiguous in memory, which those of `array[..., which]` are not.
    """
    numbers = np.flatnonzero(which) if which.dtype == bool else which
    return array.take(numbers, axis=-1)


def solve_stack(A: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Solutions (k, m, j) of k systems A x = b, and bools (k,): where A is regular.

    Where A is singular b stands in place of a solution.
    """
    try:
        x = np.linalg.solve(A, b)
        return x, np.asarray(np.isfinite(x).all(axis=(1, 2)))
    except np.linalg.LinAlgError:
        with np.errstate(all="ignore"):
            regular = np.abs(np.linalg.det(A)) > 0.0
        identity = np.eye(A.shape[1])
        return np.linalg.solve(np.where(regular[:, None, None], A, identity), b), regular


class Step(NamedTuple):
    """A step of Newton's method for j pads, to be subtracted."""

    step: np.ndarray  # (m, j)
    exists: np.ndarray  # (j,), bools: False where the derivatives are singular
    derivatives: np.ndarray  # (..., j) that the step rests on


class NewtonResult(NamedTuple):
    """Where Newton's method ended for k pads."""

    x: np.ndarray  # (m, k)
    derivatives: np.ndarray  # (..., k) before the last step
    converged: np.ndarray  # (k,), bools: to rounding


class BalanceSolution(NamedTuple):
    """Where Newton's method at fixed mu ended for k pads."""

    z: np.ndarray  # (4, k), unknowns (x, y, w theta, mu) in natural units
    determinant_sign: np.ndarray  # (k,), see `Statics.determinant_sign`
    balanced: np.ndarray  # (k,), bools: converged, and the pad has not turned past 90 degrees


def linear_step(values: np.ndarray, J: np.ndarray) -> Step:
    """The step J^-1 values to where values (m, j) with derivatives J (m, m, j) vanish."""
    step, regular = solve_stack(np.moveaxis(J, -1, 0), values.T[:, :, None])
    return Step(step[:, :, 0].T, regular, J)


def newton(
    step_from: Callable[[np.ndarray, np.ndarray], Step],
    start: np.ndarray,
    unit: np.ndarray,
    passes: int = 15,
    longest: np.ndarray | None = None,
) -> NewtonResult:
    """Newton's method for k pads at once, each until it converges or runs away.

    Parameters
    ----------
    step_from : callable
        The step from unknowns (m, j) of the j pads with numbers (j,).
    start : array (m, k)
        The unknowns at which it begins: x, y, w theta, and mu if m is 4.
    unit : array (k,)
        Steps are compared with this length plus the largest of |x|, |y| and |w theta|.
    passes : int
        Steps at most.
    longest : array (m, k), optional
        The longest step in each unknown; a longer one is shortened, in its direction.
    """
    k = start.shape[1]
    x = np.empty_like(start)
    derivatives = np.empty(0)  # until the first step shows their shape
    converged = np.zeros(k, dtype=bool)
    going = np.arange(k)  # numbers of the pads that have not ended
    present = start  # unknowns of these pads
    last_change = np.full(k, np.inf)
    for passed in range(1, passes + 1):
        with np.errstate(all="ignore"):
            # the step (m, j), where its matrix is regular (j,), and this matrix, pads last
            step, regular, J = step_from(present, going)
            if longest is not None:
                excess = (np.abs(step) / take_columns(longest, going)).max(axis=0)
                step = step / np.fmax(1.0, excess)
            present = present - step
            size = unit[going] + np.abs(present[:3]).max(axis=0)
            change = np.where(regular, np.abs(step).max(axis=0) / size, np.inf)
        # next to a fold rounding keeps steps from shrinking further
        stalled = (change <= STALLED) & (change >= last_change)
        done = (change <= CONVERGED) | stalled
        ends = done | ~np.isfinite(present).all(axis=0) | (passed == passes)
        if ends.all() and going.size == k:  # mostly all pads take as many steps
            return NewtonResult(present, J, done)
        if derivatives.size == 0:
            derivatives = np.empty((*J.shape[:-1], k))
        ended = going[ends]
        x[:, ended] = take_columns(present, ends)
        derivatives[..., ended] = take_columns(J, ends)
        converged[ended] = done[ends]
        going = going[~ends]
        if not going.size:
            break
        present = take_columns(present, ~ends)
        last_change = change[~ends]
    return NewtonResult(x, derivatives, converged)


@dataclass(frozen=True)
class Statics:
    """Static balance of a pad in natural units; unknowns are z = (x, y, w theta, mu), (4, ...)."""

    model: PadModel
    units: Units

    @staticmethod
    def of(model: PadModel) -> Statics:
        """The statics of a pad given in SI units."""
        units = natural_units(model)
        return Statics(units.scaled(model), units)

    def pick(self, index: np.ndarray) -> Statics:
        """Of the pads those that `index` names, numbers or bools."""
        # copies, so that nothing is checked or computed again
        pad = copy.copy(self.model.pad)
        for name, value in pad.given().items():
            if np.ndim(value):
                vars(pad)[name] = value[index]
        # a coefficient is an array, or one number of all pads
        c = Coefficients(*(value[index] if np.ndim(value) else value for value in self.model.c))
        model = copy.copy(self.model)
        vars(model).update(pad=pad, c=c)
        return dataclasses.replace(self, model=model)

    def for_steps(self, index: np.ndarray) -> Statics:
        """As `pick`, but for steps of Newton's method alone, of which a subclass copies less."""
        return self.pick(index)

    def q(self, z: np.ndarray) -> np.ndarray:
        """(x, y, theta) in natural units, shape (3, ...)."""
        return np.array(self.model.c.xy_theta(z))

    def tilt(self, z: np.ndarray) -> np.ndarray:
        """theta0 + theta, shape (...)."""
        return self.model.pad.theta0 + self.q(z)[2]

    def to_si(self, z: np.ndarray) -> np.ndarray:
        """q = (x, y, theta) in SI units, shape (3, ...)."""
        length = self.units.length
        return np.array([z[0] * length, z[1] * length, z[2] / self.model.pad.w])

    def residual(self, z: Number, state: Touching, ops: Operations = np) -> tuple[Number, ...]:
        """Net loads (Fx, Fy, M/w) of a contact state at z, four numbers of any kind."""
        c = self.model.c._replace(mu=z[3])
        f = net_loads(ops, c, self.model.law, c.xy_theta(z), state)
        return f.x, f.y, f.moment / c.w

    def linearised(self, z: np.ndarray, state: Touching) -> tuple[np.ndarray, np.ndarray]:
        """The residual (3, ...) and its derivative (3, 4, ...) by z."""
        directions = np.eye(4).reshape(4, 4, *[1] * (z.ndim - 1))
        with np.errstate(divide="ignore", invalid="ignore"):  # a search that hits the law's pole
            loads = self.residual([*map(Dual, z, directions)], state, differentiation)
        return np.array([load.value for load in loads]), np.array([load.slope for load in loads])

    def gaps(self, z: np.ndarray) -> np.ndarray:
        """Gaps of the contact points, shape (points, ...)."""
        return self.model.gaps(self.q(z))

    def rounding(self, z: np.ndarray) -> np.ndarray:
        """How far rounding of its summands may move each gap at z (4, ...), shape (points, ...)."""
        sizes = Coefficients(*map(np.abs, self.model.c))
        pose = Pose(*map(np.abs, pose_of(np, tuple(self.q(z)))))
        return np.array(gap_rounding(self.model.law, sizes, self.initial_gap, pose))

    @property
    def initial_gap(self) -> Number:
        """The sum of the sizes of the summands of the gaps in the initial position."""
        c = self.model.c
        size = abs(c.gap_l) + abs(c.gap_t)
        if self.model.law.absolute_gap:
            size = size + abs(self.model.pad.y0)
        return size

    def touches(self, z: np.ndarray) -> np.ndarray:
        """Where a pad at z (4, ...) touches the surface, if only to rounding, shape (...)."""
        gaps, rounding = self.gaps_and_rounding(z)
        return np.any(gaps <= rounding, axis=0)

    def unresolved(self, z: np.ndarray) -> np.ndarray:
        """Where rounding hides whether and how a pad at z (4, ...) touches, shape (...)."""
        gaps, rounding = self.gaps_and_rounding(z)
        touches = np.any(gaps <= rounding, axis=0)
        deepest = np.max(-gaps, axis=0)
        return np.asarray(touches & (np.max(rounding, axis=0) > UNRESOLVED * deepest))

    def gaps_and_rounding(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Both (points, ...) at z (4, ...)."""
        return self.gaps(z), self.rounding(z)

    def presses(self, z: np.ndarray) -> np.ndarray:
        """Where a pad at rest at z (4, ...) presses on the surface, shape (...).

        It does so if a contact point lies below the surface by more than rounding. Where rounding
        hides whether one does, the pad presses if a load F_n acts, or if the springs push it down
        by more than the rounding of their forces.
        """
        c = self.model.c
        pose = pose_of(np, tuple(self.q(z)))
        moved_1 = np.hypot(*pose.displacement(c.r1x, c.r1y))
        moved_2 = np.hypot(*pose.displacement(c.r2x, c.r2y))
        rounding = ROUNDING * (c.k1 * moved_1 + c.k2 * moved_2 + NEWTON_ROUNDING)
        forced = -springs(np, c, pose).y > rounding
        return np.asarray(self.touches(z) & (~self.unresolved(z) | (c.F_n > 0.0) | forced))

    def is_consistent(self, z: np.ndarray, touching: np.ndarray) -> np.ndarray:
        """Where (k,) a solution z (4, k) of the balance in a contact state (points, k) holds: its
        gaps agree with the state, to rounding, and its lower face faces the surface."""
        gaps, rounding = self.gaps_and_rounding(z)
        # the loads have to balance in the state of the gaps as well, which differs from `touching`
        # where one is rounding: the line law has a pole where both gaps vanish
        with np.errstate(all="ignore"):
            imbalance = np.max(np.abs(self.residual(z, 1.0 * (gaps < 0.0))), axis=0)
        balanced = imbalance <= 1e3 * np.max(rounding, axis=0) + 1e-9
        wrong = np.any(np.where(touching, gaps, -gaps) > rounding, axis=0)
        upright = np.abs(self.tilt(z)) < np.pi / 2
        return upright & balanced & ~wrong

    def resultant(self, z: np.ndarray, state: Touching) -> tuple[Number, Number]:
        """R_n and its distance delta, as the formulation counts it."""
        pose = pose_of(np, tuple(self.q(z)))
        with np.errstate(divide="ignore", invalid="ignore"):  # no place where there is no force
            return self.model.law.resultant(self.model.c, pose, state)

    def passed_events(self, z: np.ndarray, on: np.ndarray, mu_max: np.ndarray) -> np.ndarray:
        """Which events have been passed at unknowns z (4, ..., k), beyond rounding; bools
        (points + 2, ..., k).

        An event function is positive once its event has been passed. The events are, in the order
        of the rows: a change at each contact point, whose function is the gap of a point that
        touches and minus the gap of another one; the tilt past 90 degrees; and mu past mu_max (k,).
        on (points, k): the contact state as factors 1 and 0.
        """
        outwards = 2.0 * on - 1.0  # 1 for a point that touches, else -1
        outwards = outwards.reshape(-1, *[1] * (z.ndim - 2), z.shape[-1])
        gaps, rounding = self.gaps_and_rounding(z)
        past_upright = np.abs(self.tilt(z)) > math.pi / 2
        past_end = z[3] - mu_max > RANGE_ROUNDING * mu_max
        return np.concatenate([outwards * gaps > rounding, (past_upright, past_end)])

    def passed_events_on(
        self, curve: np.ndarray, on: np.ndarray, mu_max: np.ndarray
    ) -> Callable[[np.ndarray], np.ndarray]:
        """A function of the share of cubic curves that applies `passed_events` there.

        curve (4, 4, k): coefficients by power of the share, of z. Shares are (k,), or (j, 1) for
        the same j on all curves; the function's values are (events, k) or (events, j, k).
        """

        def passed(share: np.ndarray) -> np.ndarray:
            broadcast = curve if share.ndim == 1 else curve[:, :, None]
            return self.passed_events(polyval(share, broadcast, tensor=False), on, mu_max)

        return passed

    def determinant(self, z: np.ndarray, on: np.ndarray) -> np.ndarray:
        """Determinant (1, ..., k) of the derivative of the balance by (x, y, w theta) at z
        (4, ..., k): zero at folds. As the triple product of its rows."""
        _, slopes = self.linearised(z, on[:, None])
        of_x, of_y, of_moment = slopes[:, :3]
        return (of_x * np.cross(of_y, of_moment, axis=0)).sum(axis=0, keepdims=True)

    def surface_step(self, z: np.ndarray, on: np.ndarray, surface: np.ndarray) -> Step:
        """A step of Newton's method to where the balance and one condition more are satisfied.

        The condition is a surface, sum_i weights_i gap_i + normal . z = offset, given by its
        weights (points, k), normal (4, k) and offset, one below the other as rows (points + 5, k).
        The last of the derivatives (4, 4, k) is that of this condition.
        """
        weights, normal = np.split(surface[:-1], [-4])
        balance, slopes = self.linearised(z, on)
        value = (normal * z).sum(axis=0) - surface[-1]
        if weights.any():
            gaps, gap_slopes = with_derivative(self.gaps, z)
            value = (weights * gaps).sum(axis=0) + value
            normal = (weights[:, None] * gap_slopes).sum(axis=0) + normal
        return linear_step(np.concatenate([balance, [value]]), np.concatenate([slopes, [normal]]))

    def fold_step(self, z: np.ndarray, on: np.ndarray) -> Step:
        """A step of Newton's method to a fold, where the determinant of the balance vanishes."""
        balance, slopes = self.linearised(z, on)
        value, slope = with_derivative(partial(self.determinant, on=on), z)
        return linear_step(np.concatenate([balance, value]), np.concatenate([slopes, slope]))

    def null_vectors(self, derivatives: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Vectors v (4, k) along which the balance does not change, with rows . v = 1.

        derivatives (>= 3, 4, k): the first three are those of the balance, as of a `surface_step`
        or `fold_step`.
        """
        A = np.concatenate([np.moveaxis(derivatives[:3], -1, 0), rows.T[:, None, :]], axis=1)
        right_sides = np.tile(np.eye(4)[:, 3:], (len(A), 1, 1))  # 0 of the balance, 1 of the row
        vectors, _ = solve_stack(A, right_sides)
        return vectors[:, :, 0].T

    def step_at_friction(self, z: np.ndarray, on: np.ndarray) -> Step:
        """A step of Newton's method in (x, y, w theta) to the balance at the friction z[3]."""
        balance, J = self.linearised(z, on)
        return linear_step(balance, J[:, :3])

    def tangents(
        self, z: np.ndarray, on: np.ndarray, rows: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Tangents v (4, k) of branches at z (4, k), along which the balance does not change, with
        rows . v = 1 for rows (4, k); and `determinant_sign` (k,) there."""
        _, J = self.linearised(z, on)
        return self.null_vectors(J, rows), self.determinant_sign(J[:, :3])

    def stiffness(self, z: np.ndarray, on: np.ndarray) -> np.ndarray:
        """Minus the derivative (3, 3, k) of the loads by q at z (4, k)."""
        model = self.model.replace(mu=z[3])
        return -complex_step(partial(model.loads, state=on), self.q(z))

    def z_error(self, z: np.ndarray, on: np.ndarray) -> np.ndarray:
        """How far rounding may move equilibria z (4, k) in (x, y, w theta), shape (3, k).

        To first order dz = J^-1 d, where J is the derivative of the loads and d (3,) what one
        rounding changes of them. There are five, whose sizes |dz| add up: of each of the three
        loads, as the inclined springs and F_n make them, and of each of the two gaps, on which the
        contact loads depend. on (points, k): which contacts touch. Infinite where J is singular.
        """
        c = self.model.c
        sizes = Pose(*map(np.abs, pose_of(np, tuple(self.q(z)))))
        _, J = self.linearised(z, on)
        spring_forces = 0.0  # both springs' stiffness times the sizes of all terms of x and y
        for stiffness, rx, ry in ((c.k1, c.r1x, c.r1y), (c.k2, c.r2x, c.r2y)):
            # the corner moves by x + C rx - S ry and by y + S rx + C ry. With sizes in place of the
            # numbers all terms have to add up: in the first sum those of -|ry| do
            size_x, _ = sizes.displacement(np.abs(rx), -np.abs(ry))
            size_y = sizes.rise(np.abs(rx), np.abs(ry))
            spring_forces = spring_forces + stiffness * (size_x + size_y)
        # upper corners have arms of up to w + h, and the third load is the moment over w
        arm = 1.0 + c.h / c.w
        load_rounding = np.ones(z.shape[1]) * (ROUNDING * (spring_forces + c.F_n) * arm)
        # d (3, k) of each of the five roundings: first each load alone, then both gaps
        load_changes = [*np.eye(3)[:, :, None] * load_rounding]
        largest_gap_rounding = np.max(self.rounding(z), axis=0)
        for name in ("gap_l", "gap_t"):
            # the derivative of the loads by this gap, by a complex step
            shifted = c._replace(mu=z[3], **{name: getattr(c, name) + 1j * STEP})
            f = net_loads(np, shifted, self.model.law, c.xy_theta(z), on)
            slopes = np.imag(np.broadcast_arrays(f.x, f.y, f.moment / c.w)) / STEP
            load_changes.append(slopes * largest_gap_rounding)
        right_sides = np.moveaxis(np.array(load_changes), (2, 1), (0, 1))  # (k, 3, 5)
        with np.errstate(all="ignore"):
            moved, regular = solve_stack(np.moveaxis(J[:, :3], -1, 0), right_sides)
        error = np.abs(moved).sum(axis=2).T + ROUNDING * np.abs(z[:3])
        return np.where(regular, error, np.inf)

    def stiffness_error(self, z: np.ndarray, on: np.ndarray) -> np.ndarray:
        """How far rounding of equilibria z (4, k) may move each entry of `stiffness`, (3, 3, k);
        infinite where it hides the contact state `on` (points, k)."""
        moved_by = self.z_error(z, on)
        K = self.stiffness(z, on)
        error = np.zeros(K.shape)
        with np.errstate(all="ignore"):
            for i in range(3):  # x, y and w theta; mu is given, and has no rounding
                moved = z.copy()
                moved[i] += moved_by[i]
                error += np.abs(self.stiffness(moved, on) - K)
            # how far rounding moves the height of any corner, whose arm is at most w + h:
            # y moves it by moved_by[1], the angle moved_by[2] / w by (w + h) times the angle
            corner_rise = moved_by[1] + moved_by[2] * (1.0 + self.model.c.h / self.model.c.w)
            is_hidden = np.any(np.abs(self.gaps(z)) <= corner_rise, axis=0)
        return np.where(is_hidden | ~np.isfinite(error), np.inf, error)

    def determinant_sign(self, derivatives: np.ndarray) -> np.ndarray:
        """Sign (k,) of the determinant of derivatives (3, 3, k) of the loads by (x, y, w theta).

        They are minus the static stiffness: the sign is -1 where that has a positive determinant,
        and changes at each fold.
        """
        return np.sign(np.linalg.det(np.moveaxis(derivatives, -1, 0)))

    def solve_balance(
        self, z: np.ndarray, touching: np.ndarray | None, passes: int
    ) -> BalanceSolution:
        """Newton's method at fixed mu, to where the loads balance.

        Parameters
        ----------
        z : array (4, k)
            Where it begins: x, y, w theta in natural units, and mu.
        touching : bool array (points, k), optional
            Which points are in contact. Left out they are those without a gap; a pad that touches
            nowhere is then taken as in full contact, which pulls it back to the surface.
        passes : int
            Steps of Newton's method at most.
        """
        n = z.shape[1]
        pad = self.model.pad

        def step_from(q: np.ndarray, i: np.ndarray) -> Step:
            """The step from q (3, j) = (x, y, w theta) of the pads i (j,) that go on."""
            part = self if i.size == n else self.pick(i)
            unknowns = np.array([*q, z[3, i]])
            if touching is None:
                gaps = part.gaps(unknowns)
                is_separated = np.all(gaps >= 0.0, axis=0)
                on = (gaps < 0.0) + 1.0 * is_separated  # all points of a pad that touches nowhere
            else:
                on = take_columns(touching, i)
            return part.step_at_friction(unknowns, on)

        # steps are limited, so that Newton's method does not jump to an equilibrium far from z
        longest = np.empty((3, n))
        longest[:2] = 0.5 * (pad.w + np.maximum(pad.L1, pad.L2))
        longest[2] = 0.3 * pad.w  # 0.3 rad: the third coordinate is w theta
        natural_length = np.ones(n)
        q, derivatives, converged = newton(step_from, z[:3], natural_length, passes, longest)
        end = np.concatenate([q, z[3:]])
        with np.errstate(all="ignore"):
            signs = self.determinant_sign(derivatives)
        upright = np.abs(self.tilt(end)) < np.pi / 2
        return BalanceSolution(end, signs, converged & upright)


def gap_rounding(
    law: ContactLaw, sizes: Coefficients, initial_gap: Number, pose: Pose
) -> list[Number]:
    """How far rounding of its summands may move each gap, by the sizes of all numbers.

    sizes, initial_gap, pose: absolute values of the coefficients, of the summands of the initial
    gap, and of the pose.
    """
    # each gap with every term of its sum positive
    sums = law.gaps(sizes._replace(gap_l=initial_gap, gap_t=initial_gap), pose)
    return [ROUNDING * (total + NEWTON_ROUNDING) for total in sums]


class Excursion(NamedTuple):
    """How far an equilibrium lies from the initial position, each a number or an array (n,).

    tilt: |theta0 + theta| in rad; travel: of the mass centre, over the shortest of half length and
    free lengths; reaction: R_n over the load, which is F_n or what presses in the initial position.
    """

    tilt: Number
    travel: Number
    reaction: Number

    def beyond(self) -> np.ndarray:
        """Which of tilt, travel and reaction exceeds its limit, shape (3, ...)."""
        within = [np.asarray(value) <= limit for value, limit in zip(self, LIMITS, strict=True)]
        return ~np.array(within)  # also what is not a number

    def warnings(self) -> tuple[str, ...]:
        """A sentence for each limit that one equilibrium exceeds."""
        tilted, travelled, pressed = self.beyond().tolist()
        sentences = []
        if tilted:
            sentences.append(
                f"the equilibrium is tilted by {np.degrees(self.tilt):.3g} degrees; the model "
                f"means at most {np.degrees(LIMITS.tilt):.3g}"
            )
        if travelled:
            sentences.append(
                f"the equilibrium lies {self.travel:.3g} times the pad's half length (or a "
                "spring's free length, if shorter) off the initial position; the model means at "
                f"most {LIMITS.travel:.3g}"
            )
        if pressed:
            pressing = "without a"
            if np.isfinite(self.reaction):
                pressing = f"with {self.reaction:.3g} times the"
            sentences.append(
                f"the equilibrium presses {pressing} load; the model means at most "
                f"{LIMITS.reaction:.3g}"
            )
        return tuple(sentences)


# largest of an equilibrium of the model; those of the article's pads have 0.03, 0.03 and below 1
LIMITS = Excursion(
    # the constant friction arm h of Eq. (10) and the face's length are then off by cos: 2 %
    tilt=0.2,
    # the springs' far ends count as fixed beside it, and a displacement of that size against the
    # surface is a penetration, no compression
    travel=0.5,
    # springs and friction, no more the brake, press the pad; it wedges itself
    reaction=10.0,
)


def excursion(statics: Statics, z: np.ndarray, touching: Touching) -> Excursion:
    """The excursion of equilibria z (4,) or (4, n) with a contact state, or factors (points, n)."""
    pad = statics.model.pad
    initial = np.zeros_like(z)  # the initial position, where x, y and theta are 0
    initial[3] = z[3]
    touching_at_first = statics.gaps(initial) < 0.0
    # a resultant without a force has no position, 0/0, and a pad may have no load to compare with
    with np.errstate(all="ignore"):
        initial_reaction, _ = statics.resultant(initial, 1.0 * touching_at_first)
        pressed = np.where(touching_at_first.any(axis=0), initial_reaction, 0.0)
        reaction, _ = statics.resultant(z, np.asarray(touching, dtype=float))
        return Excursion(
            tilt=np.abs(statics.tilt(z)),
            travel=np.hypot(z[0], z[1]) / np.minimum(pad.w, np.minimum(pad.L1, pad.L2)),
            reaction=reaction / np.fmax(pad.F_n, pressed),
        )
