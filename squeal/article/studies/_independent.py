"""The motion of a pad by a second method, which shares no code with the toolkit's simulation.

The equations are written out once more, as one force and one moment over complex numbers x + i y.
Gragg's midpoint rule with Bulirsch and Stoer's extrapolation integrates within a contact state, and
Newton's method on whole steps locates the end of the state. Only plain Python numbers are used.
"""

import cmath
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from squeal.errors import ComputationError
from squeal.model.pad import Pad

SUBSTEPS = (2, 4, 6, 8, 10, 12, 14)  # of the midpoint rule, one column of the extrapolation each
CONVERGED = 2e-16  # of the size of the state: two extrapolated values this near are one
ACCEPTED = 1e-14  # of the size of the state: worse than this after the last column halves the step
ROUNDED = 1e-15  # of the place, times the stiffness: what rounding leaves of a force
LONGEST = 0.7  # step, over the time sqrt(m/k) of the stiffest spring that acts
NEAR = 0.02  # of the greatest height in a step: a turn this near the surface is looked at
TURNED = 1e-6  # of a step: within which a turn is looked for
LOCATED = 1e-15  # of a step: two places of a contact change this near are one
SHORTEST = 1e-9  # of the longest step: a point that is wrong after so short a time changes at once

Numbers = tuple[complex, float, complex, float]
"""Displacement x + i y, angle, and their rates."""
Acceleration = Callable[[complex, float], tuple[complex, float]]


@dataclass(frozen=True)
class Motion:
    """States (n, 6) in SI units at the times asked for; times (e,) and points (e,) of the contact
    changes; evaluations: of the accelerations."""

    states: np.ndarray
    times: np.ndarray
    points: np.ndarray
    evaluations: int


class _Equations:
    """Gaps and accelerations of models B1 and B2 (the energy-consistent law of the line)."""

    def __init__(self, name: str, pad: Pad) -> None:
        self.pad = pad
        self.line = name == "B2"
        turned = cmath.exp(1j * pad.theta0)
        self.upper = [turned * complex(side * pad.w, pad.h) for side in (-1.0, 1.0)]
        self.lower = [turned * complex(side * pad.w, -pad.h) for side in (-1.0, 1.0)]
        lengths = [pad.w if L is None else L for L in (pad.L1, pad.L2)]
        relaxed = [
            -lengths[0] * cmath.exp(1j * pad.alpha1),
            lengths[1] * cmath.exp(-1j * pad.alpha2),
        ]
        self.supports = list(zip((pad.k1, pad.k2), lengths, relaxed, self.upper, strict=True))
        self.open = (0.0, 0.0)
        if self.line:
            lift = pad.y0 + 2.0 * pad.h * math.sin(pad.theta0 / 2.0) ** 2
            tilt = pad.w * math.sin(pad.theta0)
            self.open = (lift - tilt, lift + tilt)
        self.contact = [k for k in (pad.k3, pad.k4, pad.k_c) if k]
        self.stiffest = max([pad.k1, pad.k2, *self.contact])
        # the lightest that a force meets, at the end of the lever
        self.inertia = min(pad.m, pad.I / (pad.w**2 + pad.h**2))
        self.count = 0

    def gaps(self, z: complex, angle: float) -> tuple[float, float]:
        """Heights of the leading and of the trailing lower edge over the surface."""
        half = math.sin(angle / 2.0)
        bent = complex(-2.0 * half * half, math.sin(angle))  # exp(i angle) - 1
        first, second = self.lower
        leading = self.open[0] + z.imag + (bent * first).imag
        return leading, self.open[1] + z.imag + (bent * second).imag

    def acceleration(self, touching: tuple[bool, bool]) -> Acceleration:
        """The accelerations of x + i y and of the angle within a contact state."""
        pad = self.pad
        both = touching == (True, True)

        def function(z: complex, angle: float) -> tuple[complex, float]:
            self.count += 1
            half = math.sin(angle / 2.0)
            bent = complex(-2.0 * half * half, math.sin(angle))
            force = complex(0.0, -(pad.F_n or 0.0))
            moment = 0.0
            for k, length, rest, corner in self.supports:
                moved = z + bent * corner
                now = rest + moved
                size = abs(now)
                # size^2 - length^2 without the difference of two large numbers
                more = 2.0 * (rest * moved.conjugate()).real + abs(moved) ** 2
                f = -k * more / (size + length) / size * now
                arm = corner + bent * corner
                force += f
                moment += arm.real * f.imag - arm.imag * f.real
            if any(touching):
                leading = self.open[0] + z.imag + (bent * self.lower[0]).imag
                trailing = self.open[1] + z.imag + (bent * self.lower[1]).imag
                arms = [corner + bent * corner for corner in self.lower]
                if self.line:
                    width = arms[1].real - arms[0].real
                    if both:
                        normal = -pad.k_c * (leading + trailing) / 2.0
                        turning = (arms[0].real + arms[1].real) / 2.0 * normal
                        turning += pad.k_c * width * (leading - trailing) / 12.0
                    else:  # a triangle of pressure, a third of its base from the edge that touches
                        low, high = (leading, trailing) if touching[0] else (trailing, leading)
                        # a level face is in partial contact for no time
                        share = low / (low - high) if low != high else 1.0
                        normal = -pad.k_c * share * low / 2.0
                        third = width * share / 3.0
                        middle = arms[0].real + third if touching[0] else arms[1].real - third
                        turning = middle * normal
                    force += complex(pad.mu * normal, normal)
                    moment += turning + pad.h * pad.mu * normal
                else:
                    pairs = zip(touching, (pad.k3, pad.k4), (leading, trailing), arms, strict=True)
                    for on, k, gap, arm in pairs:
                        if on:
                            normal = -k * gap
                            force += complex(pad.mu * normal, normal)
                            moment += normal * (arm.real - pad.mu * arm.imag)
            return force / pad.m, moment / pad.I

        return function

    def longest(self, touching: tuple[bool, bool]) -> float:
        """The longest step within a contact state, from the stiffest spring that acts."""
        supports = max(self.pad.k1, self.pad.k2, 1e-300)
        acting = self.stiffest if any(touching) else supports
        return LONGEST * math.sqrt(self.inertia / acting)


def _midpoint(
    f: Acceleration, state: Numbers, first: tuple[complex, float], h: float, n: int
) -> tuple[Numbers, list[tuple[complex, float]]]:
    """Change of the state in a time h by n midpoint steps, and the places passed on the way.

    Changes are summed, not states, so that rounding is that of what a short step adds.
    """
    z, a, v, r = state
    step = h / n
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
        force, turning = f(z + dz1, a + da1)
        dz, dz1 = dz1, dz + twice * (v + dv1)
        da, da1 = da1, da + twice * (r + dr1)
        dv, dv1 = dv1, dv + twice * force
        dr, dr1 = dr1, dr + twice * turning
        passed.append((z + dz1, a + da1))
    return (dz1, da1, dv1, dr1), passed


def _step(
    f: Acceleration, state: Numbers, h: float, lever: float, sizes: tuple[float, float]
) -> tuple[Numbers, float, list[tuple[complex, float]]]:
    """State after a time h, its error, and the places on the way.

    The error is the last difference of the extrapolation over `sizes`, of place and of velocity.
    """
    first = f(state[0], state[1])
    row: list[Numbers] = []
    error = math.inf
    for j, n in enumerate(SUBSTEPS):
        change, passed = _midpoint(f, state, first, h, n)
        new = [change]
        for i in range(j):
            ratio = 1.0 / ((n / SUBSTEPS[j - 1 - i]) ** 2 - 1.0)
            p = new[i]
            q = row[i]
            new.append(
                (
                    p[0] + (p[0] - q[0]) * ratio,
                    p[1] + (p[1] - q[1]) * ratio,
                    p[2] + (p[2] - q[2]) * ratio,
                    p[3] + (p[3] - q[3]) * ratio,
                )
            )
        if j:
            best = new[-1]
            before = row[-1]
            place = abs(best[0] - before[0]) + lever * abs(best[1] - before[1])
            speed = abs(best[2] - before[2]) + lever * abs(best[3] - before[3])
            error = max(place / sizes[0], speed / sizes[1])
            if error <= CONVERGED:
                break
        row = new
    dz, da, dv, dr = new[-1]
    end = (state[0] + dz, state[1] + da, state[2] + dv, state[3] + dr)
    return end, error, passed


def _rate(corner: complex, state: Numbers) -> float:
    """Rate of the height of a lower edge."""
    return state[2].imag + state[3] * (1j * cmath.exp(1j * state[1]) * corner).imag


def _doubtful(beyond: list[float], j: int) -> bool:
    """Whether a point may have passed the surface at a place on the way: it has, or turns near."""
    if beyond[j] > 0.0:
        return True
    turns = 0 < j < len(beyond) - 1 and beyond[j - 1] < beyond[j] >= beyond[j + 1]
    return turns and beyond[j] > NEAR * min(beyond)


class _Run:
    """A motion on its way."""

    def __init__(self, name: str, pad: Pad, initial: np.ndarray) -> None:
        self.equations = _Equations(name, pad)
        self.lever = math.hypot(pad.w, pad.h)
        x, y, angle, *rates = map(float, initial)
        self.state: Numbers = (complex(x, y), angle, complex(rates[0], rates[1]), rates[2])
        self.touching = self._first_contact()
        self.t = 0.0
        self.behind = 0.0  # time and what rounding has left out of it
        self.h = 0.0
        self.sizes = (1e-300, 1e-300)
        self.changes: list[tuple[float, int]] = []

    def _first_contact(self) -> tuple[bool, bool]:
        """What touches first: a point on the surface goes where its rate or acceleration points."""
        z, angle, _, _ = self.state
        upwards, turning = self.equations.acceleration((False, False))(z, angle)
        found = []
        heights = self.equations.gaps(z, angle)
        for gap, corner in zip(heights, self.equations.lower, strict=True):
            begun = gap or _rate(corner, self.state) or _rate(corner, (z, angle, upwards, turning))
            found.append(begun < 0.0)
        return found[0], found[1]

    def _accept(self, state: Numbers, h: float) -> None:
        self.state = state
        more = h + self.behind
        total = self.t + more
        self.behind = more - (total - self.t)
        self.t = total
        place = abs(state[0]) + self.lever * abs(state[1])
        speed = abs(state[2]) + self.lever * abs(state[3])
        self.sizes = (max(self.sizes[0], place), max(self.sizes[1], speed))

    def _flip(self, point: int) -> None:
        self.changes.append((self.t, point))
        leading, trailing = self.touching
        self.touching = (not leading, trailing) if point == 0 else (leading, not trailing)

    def _gap(self, f: Acceleration, point: int, h: float) -> tuple[float, float, Numbers]:
        """How far a point is beyond the surface, seen from its side, a time from now; the rate of
        that, and the state."""
        end, _, _ = _step(f, self.state, h, self.lever, self.sizes)
        side = 1.0 if self.touching[point] else -1.0
        beyond = side * self.equations.gaps(end[0], end[1])[point]
        return beyond, side * _rate(self.equations.lower[point], end), end

    def _locate(
        self, f: Acceleration, point: int, low: float, at: float, high: float
    ) -> tuple[float, Numbers, int] | None:
        """Time from now, near `at`, and state at which a point reaches the surface, and the point.

        None if it turns back before.
        """
        beyond, rate, _ = self._gap(f, point, high)
        if beyond <= 0.0:  # the turn is where the rate passes zero
            if rate >= 0.0:
                return None
            first = low
            last = high
            while beyond <= 0.0 and last - first > TURNED * high:
                middle = 0.5 * (first + last)
                beyond, rate, _ = self._gap(f, point, middle)
                first, last = (middle, last) if rate > 0.0 else (first, middle)
            if beyond <= 0.0:
                return None
            high = middle
            at = 0.5 * (low + high)
        for _ in range(60):
            beyond, rate, end = self._gap(f, point, at)
            if beyond > 0.0:
                high = at
            else:
                low = at
            newton = at - beyond / rate if rate else low
            following = newton if low < newton < high else 0.5 * (low + high)
            if abs(following - at) <= LOCATED * high or high - low <= LOCATED * high:
                break
            at = following
        return at, end, point

    def advance(self, stop: float) -> None:
        """Go on to a time, through any contact changes."""
        while True:
            left = (stop - self.t) - self.behind
            if left <= 1e-15 * stop:
                return
            f = self.equations.acceleration(self.touching)
            limit = self.equations.longest(self.touching)
            self.h = min(limit, 1.5 * self.h or limit)
            while not self._one(f, min(self.h, left), limit):
                pass

    def _one(self, f: Acceleration, h: float, limit: float) -> bool:
        """Take a step, or shorten the next one."""
        first = self.sizes[1] <= 1e-300
        if first:  # at rest: what the accelerations make of it
            z, a = f(self.state[0], self.state[1])
            size = abs(self.state[0]) + self.lever * abs(self.state[1])
            speed = abs(self.state[2]) + self.lever * abs(self.state[3])
            self.sizes = (
                max(size, h * h * (abs(z) + self.lever * abs(a)), 1e-300),
                max(speed, h * (abs(z) + self.lever * abs(a)), 1e-300),
            )
        end, error, passed = _step(f, self.state, h, self.lever, self.sizes)
        inertia = self.equations.inertia
        rounding = ROUNDED * self.equations.stiffest / inertia * h * self.sizes[0] / self.sizes[1]
        if error > ACCEPTED + rounding and h > SHORTEST * limit:
            self.h = 0.5 * h
            return False
        n = len(passed)
        passed[-1] = (end[0], end[1])
        sides = [1.0 if on else -1.0 for on in self.touching]
        rows = [self.equations.gaps(z, angle) for z, angle in passed]
        beyond = [[side * row[point] for row in rows] for point, side in enumerate(sides)]
        for j in range(n):
            doubtful = [point for point, gaps in enumerate(beyond) if _doubtful(gaps, j)]
            if not doubtful:
                continue
            if j == 0:
                if h <= SHORTEST * limit:
                    self._flip(doubtful[0])
                    return True
                self.h = h / 8.0
                return False
            # the places on the way are those of a rule of second order
            low = max(j - 1, 0) * h / n
            high = min(j + 2, n) * h / n
            each = (self._locate(f, point, low, (j + 0.5) * h / n, high) for point in doubtful)
            found = [one for one in each if one is not None]
            if not found:
                continue
            at, state, point = min(found, key=lambda one: one[0])
            self._accept(state, at)
            self._flip(point)
            self.h = max(h, 1e-3 * limit)
            return True
        self._accept(end, h)
        self.h = h
        return True


def motion(
    name: str, pad: Pad, initial: np.ndarray, times: np.ndarray, most: int = 10**7
) -> Motion:
    """The motion of a pad of model B1 or B2 from (x, y, theta, rates), at rising times from 0.

    Raises ComputationError after `most` contact changes.
    """
    run = _Run(name, pad, np.asarray(initial))
    states = []
    for t in times:
        run.advance(float(t))
        z, angle, v, r = run.state
        states.append([z.real, z.imag, angle, v.real, v.imag, r])
        if len(run.changes) > most:
            raise ComputationError(f"more than {most} contact changes")
    when = np.array([t for t, _ in run.changes])
    points = np.array([point for _, point in run.changes], dtype=int)
    return Motion(np.array(states), when, points, run.equations.count)
