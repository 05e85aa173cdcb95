"""The motion of a pad by a second method, which shares no code with the toolkit's simulation.

The equations are written out once more, as one force and one moment over complex numbers x + i y.
Gragg's midpoint rule with Bulirsch and Stoer's extrapolation integrates within a contact state, and
Newton's method on whole steps locates the end of the state. Only plain Python numbers are used.
"""

import cmath
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from squeal.errors import ComputationError
from squeal.model.pad import Pad

SUBSTEPS = (2, 4, 6, 8, 10, 12, 14)  # of the midpoint rule, one row of the extrapolation each
CONVERGED = 2e-16  # of the size of the state: two extrapolated values this near are one
ACCEPTED = 1e-14  # of the size of the state: worse than this after the last column halves the step
ROUNDED = 1e-15  # of the position, times the stiffness: the rounding of a force
LONGEST = 0.7  # step, over the time sqrt(m/k) of the stiffest spring that acts
NEAR = 0.02  # of the greatest height in a step: a turn this near the surface may cross it
TURNED = 1e-6  # of a step: to which a turn is located
LOCATED = 1e-15  # of a step: two times of a contact change this near are one
SHORTEST = 1e-9  # of the longest step: a point that is wrong after so short a time changes at once
TINY = 1e-300  # a size that is no zero

State = tuple[complex, float, complex, float]
"""Displacement z = x + i y, angle, and their rates."""
Pose = tuple[complex, float]
Load = tuple[complex, float]
"""A force and its moment about the mass centre."""
Acceleration = Callable[[complex, float], tuple[complex, float]]
"""Of z and of the angle, at a pose."""


@dataclass(frozen=True)
class Motion:
    """States (n, 6) in SI units at the requested times; times (e,) and points (e,) of the contact
    changes; evaluations: of the accelerations."""

    states: np.ndarray
    times: np.ndarray
    points: np.ndarray
    evaluations: int


def _rotation_less_one(angle: float) -> complex:
    """exp(i angle) - 1, exact for small angles."""
    half = math.sin(angle / 2.0)
    return complex(-2.0 * half * half, math.sin(angle))


class _Equations:
    """Gaps and accelerations of models B1 and B2 (the energy-consistent law of the line)."""

    def __init__(self, name: str, pad: Pad) -> None:
        """Corners, springs and stiffnesses of a pad; name: of the model."""
        self.pad = pad
        self.line = name == "B2"
        # corners of the undisplaced pad from its mass centre, leading and trailing
        turned = cmath.exp(1j * pad.theta0)
        upper = [turned * complex(side * pad.w, pad.h) for side in (-1.0, 1.0)]
        self.lower = [turned * complex(side * pad.w, -pad.h) for side in (-1.0, 1.0)]
        lengths = [pad.w if L is None else L for L in (pad.L1, pad.L2)]
        # each support spring, from its fixed end to the undisplaced pad, where it is relaxed;
        # alpha1 counts from x, alpha2 from -x the other way round
        relaxed = [
            -lengths[0] * cmath.exp(1j * pad.alpha1),
            lengths[1] * cmath.exp(-1j * pad.alpha2),
        ]
        self.supports = list(zip((pad.k1, pad.k2), lengths, relaxed, upper, strict=True))
        self.open = (0.0, 0.0)  # gaps of the lower edges without displacement
        if self.line:
            # y0 + h (1 - cos(theta0)), exact for small angles
            lift = pad.y0 + 2.0 * pad.h * math.sin(pad.theta0 / 2.0) ** 2
            tilt = pad.w * math.sin(pad.theta0)
            self.open = (lift - tilt, lift + tilt)
        contact = [k for k in (pad.k3, pad.k4, pad.k_c) if k]
        self.stiffest = max([pad.k1, pad.k2, *contact])
        # the least inertia against a force: of the mass, or of the rotation at the edges' lever
        self.inertia = min(pad.m, pad.I / (pad.w**2 + pad.h**2))
        self.count = 0  # evaluations of the accelerations

    def gaps(self, z: complex, angle: float) -> tuple[float, float]:
        """Heights of the leading and of the trailing lower edge over the surface."""
        return self._gaps(z, _rotation_less_one(angle))

    def _gaps(self, z: complex, turn: complex) -> tuple[float, float]:
        first, second = self.lower
        leading = self.open[0] + z.imag + (turn * first).imag
        return leading, self.open[1] + z.imag + (turn * second).imag

    def acceleration(self, touching: tuple[bool, bool]) -> Acceleration:
        """The function of a pose that gives the accelerations of x + i y and of the angle, as long
        as the contact state stays the same.

        touching: whether the leading and the trailing edge touch. All is in SI units.
        """
        pad = self.pad

        def accelerations(z: complex, angle: float) -> tuple[complex, float]:
            """Of x + i y and of the angle, from the loads of both supports and of the contact.

            z: displacement x + i y of the mass centre in m; angle: rotation in rad.
            """
            self.count += 1
            turn = _rotation_less_one(angle)  # times a corner: how far rotation moves it
            force = complex(0.0, -(pad.F_n or 0.0))
            moment = 0.0
            # stiffness, free length, the spring at rest from its fixed end to the corner, and the
            # corner from the mass centre: the last two as x + i y
            for k, length, relaxed, corner in self.supports:
                moved = z + turn * corner  # displacement of the corner
                spring = relaxed + moved  # from its fixed end to the corner
                size = abs(spring)
                # size^2 - length^2 without the difference of two large numbers, |relaxed| = length
                difference = 2.0 * (relaxed * moved.conjugate()).real + abs(moved) ** 2
                # -k (size - length), in the direction of the spring
                support = -k * difference / (size + length) / size * spring
                arm = corner + turn * corner
                force += support
                moment += arm.real * support.imag - arm.imag * support.real
            if any(touching):
                gaps = self._gaps(z, turn)
                arms = [corner + turn * corner for corner in self.lower]
                contact_loads = self._line_load if self.line else self._point_loads
                for contact_force, contact_moment in contact_loads(gaps, arms, touching):
                    force += contact_force
                    moment += contact_moment
            return force / pad.m, moment / pad.I

        return accelerations

    def _line_load(
        self, gaps: tuple[float, float], arms: list[complex], touching: tuple[bool, bool]
    ) -> list[Load]:
        """The load of the pressure k_c / width times penetration on the face; friction acts at the
        distance h from the mass centre.

        gaps, arms: of the leading and the trailing edge; a gap below zero is a penetration, an arm
        is x + i y from the mass centre.
        """
        pad = self.pad
        leading, trailing = gaps
        width = arms[1].real - arms[0].real
        if touching == (True, True):  # a trapezium of pressure
            normal = -pad.k_c * (leading + trailing) / 2.0
            moment = (arms[0].real + arms[1].real) / 2.0 * normal
            # at s from the middle the linear part is k_c/width (leading - trailing)/width s; its
            # moment is the integral of that times s, where that of s^2 is width^3/12
            moment += pad.k_c * width * (leading - trailing) / 12.0
        else:  # a triangle of pressure, whose resultant is a third of its base from that edge
            touching_gap, other_gap = (leading, trailing) if touching[0] else (trailing, leading)
            # share of the face that touches; a level face is in partial contact for no time
            share = 1.0
            if touching_gap != other_gap:
                share = touching_gap / (touching_gap - other_gap)
            normal = -pad.k_c * share * touching_gap / 2.0
            third = width * share / 3.0
            moment = normal * (arms[0].real + third if touching[0] else arms[1].real - third)
        return [(complex(pad.mu * normal, normal), moment + pad.h * pad.mu * normal)]

    def _point_loads(
        self, gaps: tuple[float, float], arms: list[complex], touching: tuple[bool, bool]
    ) -> list[Load]:
        """The load of each edge that touches, with its friction."""
        pad = self.pad
        loads = []
        for on, k, gap, arm in zip(touching, (pad.k3, pad.k4), gaps, arms, strict=True):
            if on:
                normal = -k * gap
                moment = normal * (arm.real - pad.mu * arm.imag)
                loads.append((complex(pad.mu * normal, normal), moment))
        return loads

    def longest(self, touching: tuple[bool, bool]) -> float:
        """The longest step within a contact state, from the stiffest spring that acts."""
        supports = max(self.pad.k1, self.pad.k2, 1e-300)
        acting = self.stiffest if any(touching) else supports
        return LONGEST * math.sqrt(self.inertia / acting)


def _midpoint(
    f: Acceleration, state: State, first: tuple[complex, float], h: float, n: int
) -> tuple[State, list[Pose]]:
    """Change of the state in a time h by n midpoint steps, and the poses passed on the way.

    The midpoint rule: u_(j+1) = u_(j-1) + 2 (h/n) u'(u_j), begun with a step of Euler's. What is
    summed is the change u_j - u_0, a small number, whose rounding is small too.

    first : the accelerations at the state
    h, n : length of the whole step, and number of substeps
    """
    z, a, v, r = state  # position x + i y, angle, and their rates
    step = h / n
    # changes from u_0 to u_(j-1), and with a 1 at the end of the name to u_j
    dz = 0j
    da = 0.0
    dv = 0j
    dr = 0.0
    dz1 = step * v
    da1 = step * r
    dv1 = step * first[0]
    dr1 = step * first[1]
    passed = [(z + dz1, a + da1)]
    twice = 2.0 * step
    for _ in range(n - 1):
        acceleration, turning = f(z + dz1, a + da1)
        dz, dz1 = dz1, dz + twice * (v + dv1)
        da, da1 = da1, da + twice * (r + dr1)
        dv, dv1 = dv1, dv + twice * acceleration
        dr, dr1 = dr1, dr + twice * turning
        passed.append((z + dz1, a + da1))
    return (dz1, da1, dv1, dr1), passed


class _Step(NamedTuple):
    """State at the end of a step, its error, and the poses passed on the way, the last at its end.

    The error is the last difference of the extrapolation over the sizes of position and velocity.
    """

    end: State
    error: float
    passed: list[Pose]


def _extrapolated(
    f: Acceleration, state: State, h: float, lever: float, sizes: tuple[float, float]
) -> _Step:
    """A step of length h by Bulirsch and Stoer's extrapolation in the square of the substep.

    T(j, i+1) = T(j, i) + (T(j, i) - T(j-1, i)) / ((n_j / n_(j-1-i))^2 - 1), where T(j, 0) is the
    change of the state by n_j substeps, n_j of `SUBSTEPS`. The rows end with the first whose last
    two values are the same to rounding.

    state : (displacement, angle, velocity, angular rate), the first and the third complex
    lever : length that makes an angle comparable with a displacement
    sizes : of position and of velocity, over which the error counts
    """
    first = f(state[0], state[1])
    row: list[State] = []  # T(j-1, 0), T(j-1, 1), ...
    error = math.inf
    for j, n in enumerate(SUBSTEPS):
        change, passed = _midpoint(f, state, first, h, n)  # passed: the poses after substeps
        new = [change]  # T(j, 0), ...
        for i in range(j):
            ratio = 1.0 / ((n / SUBSTEPS[j - 1 - i]) ** 2 - 1.0)
            p = new[i]  # T(j, i)
            q = row[i]  # T(j-1, i)
            new.append(
                (
                    p[0] + (p[0] - q[0]) * ratio,
                    p[1] + (p[1] - q[1]) * ratio,
                    p[2] + (p[2] - q[2]) * ratio,
                    p[3] + (p[3] - q[3]) * ratio,
                )
            )
        if j:  # there is a row before
            best = new[-1]
            before = row[-1]
            position = abs(best[0] - before[0]) + lever * abs(best[1] - before[1])
            velocity = abs(best[2] - before[2]) + lever * abs(best[3] - before[3])
            error = max(position / sizes[0], velocity / sizes[1])
            if error <= CONVERGED:
                break
        row = new
    dz, da, dv, dr = new[-1]
    end = (state[0] + dz, state[1] + da, state[2] + dv, state[3] + dr)
    passed[-1] = (end[0], end[1])  # more exact than the midpoint rule
    return _Step(end, error, passed)


def _rate(corner: complex, state: State) -> float:
    """Rate of the height of a lower edge."""
    return state[2].imag + state[3] * (1j * cmath.exp(1j * state[1]) * corner).imag


def _may_have_crossed(beyond: list[float], j: int) -> bool:
    """Whether a point may have crossed the surface by the pose j of a step: it has, or turns near.

    beyond : how far it is beyond the surface at each pose, negative on its own side
    """
    if beyond[j] > 0.0:
        return True
    turns = 0 < j < len(beyond) - 1 and beyond[j - 1] < beyond[j] >= beyond[j + 1]
    return turns and beyond[j] > NEAR * min(beyond)


class _Beyond(NamedTuple):
    """How far a point is beyond the surface, seen from its side, its rate, and the state then."""

    distance: float
    rate: float
    state: State


class _ContactChange(NamedTuple):
    """When a point reaches the surface, a time from the start of the step, and the state then."""

    time: float
    state: State
    point: int


class _Run:
    """A motion at its present time: state, contact state, and the length h of the next step."""

    def __init__(self, name: str, pad: Pad, initial: np.ndarray) -> None:
        self.equations = _Equations(name, pad)
        self.lever = math.hypot(pad.w, pad.h)
        x, y, angle, *rates = map(float, initial)
        self.state: State = (complex(x, y), angle, complex(rates[0], rates[1]), rates[2])
        self.touching = self._first_contact()
        self.t = 0.0
        self.behind = 0.0  # what rounding has left out of the time
        self.h = 0.0
        self.sizes = (TINY, TINY)  # greatest of position and of velocity so far
        self.changes: list[tuple[float, int]] = []

    def _first_contact(self) -> tuple[bool, bool]:
        """What touches first: a point on the surface goes where its rate or acceleration points."""
        z, angle, _, _ = self.state
        upwards, turning = self.equations.acceleration((False, False))(z, angle)
        gaps = self.equations.gaps(z, angle)
        touching = []
        for gap, corner in zip(gaps, self.equations.lower, strict=True):
            rate = _rate(corner, self.state)
            # the rate of the height with accelerations in place of velocities, the pad at rest
            acceleration = _rate(corner, (z, angle, upwards, turning))
            first_not_zero = gap or rate or acceleration
            touching.append(first_not_zero < 0.0)
        return touching[0], touching[1]

    def _accept(self, state: State, h: float) -> None:
        """Take over the state after a time h; the time is summed without loss (Kahan)."""
        self.state = state
        more = h + self.behind
        total = self.t + more
        self.behind = more - (total - self.t)
        self.t = total
        position = abs(state[0]) + self.lever * abs(state[1])
        velocity = abs(state[2]) + self.lever * abs(state[3])
        self.sizes = (max(self.sizes[0], position), max(self.sizes[1], velocity))

    def _switch(self, point: int) -> None:
        """A point begins to touch or separates."""
        self.changes.append((self.t, point))
        leading, trailing = self.touching
        self.touching = (not leading, trailing) if point == 0 else (leading, not trailing)

    def _beyond(self, f: Acceleration, point: int, h: float) -> _Beyond:
        """Where a point is a time h from now."""
        end = _extrapolated(f, self.state, h, self.lever, self.sizes).end
        side = 1.0 if self.touching[point] else -1.0
        distance = side * self.equations.gaps(end[0], end[1])[point]
        return _Beyond(distance, side * _rate(self.equations.lower[point], end), end)

    def _time_beyond(self, f: Acceleration, point: int, low: float, high: float) -> float | None:
        """A time from now between `low` and `high` at which a point is beyond the surface, None if
        there is none.

        If the point is not beyond at `high` but goes back there, it may have been beyond before:
        bisection goes to its turn, where it is farthest and its rate passes zero.
        """
        reached = self._beyond(f, point, high)
        if reached.distance > 0.0:
            return high
        if reached.rate >= 0.0:  # it still comes nearer
            return None
        first = low
        last = high
        while last - first > TURNED * high:
            middle = 0.5 * (first + last)
            reached = self._beyond(f, point, middle)
            if reached.distance > 0.0:
                return middle
            if reached.rate > 0.0:  # the turn comes later
                first = middle
            else:
                last = middle
        return None  # it turned before the surface

    def _locate(
        self, f: Acceleration, point: int, low: float, guess: float, high: float
    ) -> _ContactChange | None:
        """When a point reaches the surface between two times from now, None if it does not.

        Newton's method seeks the time at which the distance beyond the surface is zero; each trial
        is one step from the present state. `before` and `after` bracket that time; the bracket is
        halved where Newton's method would leave it. `guess` is the first trial.
        """
        # `high` itself, or an earlier time at which the point is beyond before it turns back
        beyond_at = self._time_beyond(f, point, low, high)
        if beyond_at is None:
            return None
        time = guess
        if beyond_at < high:  # the guess takes no account of the turn: it may lie after the change
            time = 0.5 * (low + beyond_at)
        before = low
        after = beyond_at
        reached = self._beyond(f, point, time)
        for _ in range(60):  # bisection alone would end after about 50 passes
            if reached.distance > 0.0:
                after = time
            else:
                before = time
            next_time = 0.5 * (before + after)
            if reached.rate:
                newton = time - reached.distance / reached.rate
                if before < newton < after:
                    next_time = newton
            if abs(next_time - time) <= LOCATED * after or after - before <= LOCATED * after:
                break
            time = next_time
            reached = self._beyond(f, point, time)
        return _ContactChange(time, reached.state, point)

    def advance(self, stop: float, most: int) -> None:
        """Go on to the time `stop`, through at most so many contact changes since the time 0.

        Raises ComputationError if there are more.
        """
        while True:
            if len(self.changes) > most:
                raise ComputationError(f"more than {most} contact changes")
            remaining = (stop - self.t) - self.behind
            if remaining <= 1e-15 * stop:  # rounding of the time
                return
            acceleration = self.equations.acceleration(self.touching)
            limit = self.equations.longest(self.touching)
            self.h = min(limit, 1.5 * self.h or limit)  # 0 at the start, which gives the limit
            # a step that is refused has shortened `self.h` for the next try
            while not self._try_step(acceleration, min(self.h, remaining), limit):
                pass

    def _sizes_from_rest(self, f: Acceleration, h: float) -> tuple[float, float]:
        """Sizes of position and velocity at the start: at least what the accelerations make of
        them in a time h."""
        z, a = f(self.state[0], self.state[1])
        acceleration = abs(z) + self.lever * abs(a)
        position = abs(self.state[0]) + self.lever * abs(self.state[1])
        velocity = abs(self.state[2]) + self.lever * abs(self.state[3])
        return max(position, h * h * acceleration, TINY), max(velocity, h * acceleration, TINY)

    def _poses_beyond(self, passed: list[Pose]) -> list[list[float]]:
        """By point how far it is beyond the surface at the poses of a step."""
        gaps = [self.equations.gaps(z, angle) for z, angle in passed]
        sides = [1.0 if on else -1.0 for on in self.touching]
        return [[side * row[point] for row in gaps] for point, side in enumerate(sides)]

    def _try_step(self, f: Acceleration, h: float, limit: float) -> bool:
        """Take a step of length h, or up to the first contact change in it.

        Returns False where the step was too long: its error is too great, or a point crosses the
        surface in its first substep, where the change cannot be located. `self.h` is the length to
        try next, in either case.

        f: the accelerations in the contact state; limit: its longest step.
        """
        if self.sizes[1] <= TINY:
            self.sizes = self._sizes_from_rest(f, h)
        step = _extrapolated(f, self.state, h, self.lever, self.sizes)
        # rounding of the velocity over its size: a force k x is rounded by `ROUNDED` of itself,
        # which over the inertia and in the time h makes a velocity
        position, velocity = self.sizes
        inertia = self.equations.inertia
        rounding = ROUNDED * self.equations.stiffest / inertia * h * position / velocity
        may_be_shorter = h > SHORTEST * limit
        if step.error > ACCEPTED + rounding and may_be_shorter:
            self.h = 0.5 * h
            return False
        beyond = self._poses_beyond(step.passed)
        in_first_substep = [point for point in (0, 1) if _may_have_crossed(beyond[point], 0)]
        if in_first_substep:
            if may_be_shorter:
                self.h = h / 8.0
                return False
            self._switch(in_first_substep[0])  # the point is on the surface already
            return True
        change = self._first_change(f, h, beyond)
        if change is None:
            self._accept(step.end, h)
            self.h = h
        else:
            self._accept(change.state, change.time)
            self._switch(change.point)
            self.h = max(h, 1e-3 * limit)  # h may have been divided to locate this change
        return True

    def _first_change(
        self, f: Acceleration, h: float, beyond: list[list[float]]
    ) -> _ContactChange | None:
        """The first contact change in a step of length h, None if there is none.

        beyond: by point, how far it is beyond the surface at the n poses of the step, negative on
        its own side. Pose j is that at the time (j + 1) h / n. At the first pose no point has
        crossed yet.
        """
        n = len(beyond[0])
        for j in range(1, n):
            points = [point for point in (0, 1) if _may_have_crossed(beyond[point], j)]
            # the change lies between the poses j - 1 and j, that is the times j h / n and
            # (j + 1) h / n; poses of the midpoint rule are exact to second order alone, so it is
            # searched one substep further to both sides
            low = max(j - 1, 0) * h / n
            high = min(j + 2, n) * h / n
            guess = (j + 0.5) * h / n
            located = [self._locate(f, point, low, guess, high) for point in points]
            changes = [change for change in located if change is not None]
            if changes:
                return min(changes, key=lambda change: change.time)
        return None


def motion(
    name: str, pad: Pad, initial: np.ndarray, times: np.ndarray, most: int = 10**7
) -> Motion:
    """The motion of a pad of model B1 or B2 at rising times from 0, in SI units.

    initial (6,): x, y, theta and their rates; most: how many contact changes are allowed; the next
    one raises ComputationError.
    """
    run = _Run(name, pad, np.asarray(initial))
    states = []
    for t in times:
        run.advance(float(t), most)
        position, angle, velocity, angular_rate = run.state  # the first and third are complex
        states.append(
            [position.real, position.imag, angle, velocity.real, velocity.imag, angular_rate]
        )
    change_times = np.array([t for t, _ in run.changes])
    points = np.array([point for _, point in run.changes], dtype=int)
    return Motion(np.array(states), change_times, points, run.equations.count)
