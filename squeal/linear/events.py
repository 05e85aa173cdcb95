"""Where eigenvalues cross the line between growth and decay, exactly: from guesses to events.

What a root z is, and where growth begins, depends on the problem class (see `continuation`):
undamped, z = -lambda^2, where z falls through zero or where two roots meet and leave the positive
real axis; gyroscopic, z = -i lambda, where two meet and leave the real axis; damped, z = lambda,
where the real part rises through zero.

One root passes at a zero of its real part, with the derivative from left and right vectors. Two
that come close are examined by their mean and the squared half difference d = ((z1 - z2) / 2)^2
(`local_roots`). On the line they meet where d vanishes; with m the real part of the mean one of
them passes it where m^2 Re d + (Im d)^2 / 4 - m^4 does: the product of their real parts times what
does not vanish. Newton's method finds the zero; the errors of the function give its interval.
"""

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from squeal.errors import ComputationError
from squeal.linear.continuation import (
    DAMPED,
    GYROSCOPIC,
    UNDAMPED,
    Continuation,
    ProblemClass,
)
from squeal.linear.local_roots import NEWTON_STEPS, EventFunction, LocalRoots, roots_near
from squeal.linear.matrices import EPS, norm_of
from squeal.linear.steps import EventGuess

EVENT_TOLERANCE = 1e-9
"""Of the range: events within four times this coincide, unless the counts between them agree; of
the value of an event: a narrower interval has converged."""


@dataclass(frozen=True)
class Crossing:
    """A pair or a real root that crosses the imaginary axis on the way up in mu."""

    mu: float
    kind: str  # flutter: a pair; divergence: a real root
    direction: str  # up: it starts to grow; down: it ceases
    frequency_hz: float  # at mu; 0 for divergence
    interval: tuple[float, float]  # bracket of mu, rounding included; the point itself at a jump
    mode: int  # by rising frequency at mu, from 1; of a coalescing pair the first
    changes_verdict: bool  # false where other modes grow all the same, and faster
    residual: float | None = None  # backward error of the root there, if it is known

    def __str__(self) -> str:
        return f"{self.kind} {self.direction} at mu = {self.mu:.9g}{hertz_of(self.frequency_hz)}"


def hertz_of(frequency: float) -> str:
    """A frequency in words, nothing for 0."""
    return f", {frequency:.6g} Hz" if frequency else ""


@dataclass(frozen=True)
class Event:
    """A root, or two that meet, crosses the line between growth and decay.

    Attributes
    ----------
    value : float
        The parameter there.
    omega : float
        Angular frequency, rad/s; 0 of a real root.
    direction : int
        1 if growth begins with rising parameter, -1 if it ends.
    interval : (float, float)
        Holds the parameter, rounding included.
    residual : float, optional
        Backward error of the root there, as a share of the norm of the matrix.
    coalesces : bool
        True if two roots meet on the line.
    converged : bool
        False if only a count of growing roots tells of the event.
    is_pair_at_zero : bool
        True if a pair passes through zero, which has no frequency there.
    """

    value: float
    omega: float
    direction: int
    interval: tuple[float, float]
    residual: float | None = None
    coalesces: bool = False
    converged: bool = True
    is_pair_at_zero: bool = False

    @property
    def is_pair(self) -> bool:
        """False of a real root."""
        return self.omega != 0.0 or self.is_pair_at_zero

    @property
    def kind(self) -> str:
        """flutter for a pair, divergence for a real root."""
        return "flutter" if self.is_pair else "divergence"

    @property
    def rise(self) -> int:
        """By how much the number of growing roots rises with the parameter: 2 or -2 for a pair, 1
        or -1 for a real root."""
        return self.direction * (2 if self.is_pair else 1)

    @property
    def width(self) -> float:
        """Width of the interval."""
        return self.interval[1] - self.interval[0]

    def crossing(self, mode: int, changes_verdict: bool) -> Crossing:
        """The event as callers see it, with the number of its mode."""
        low, high = self.interval
        return Crossing(
            mu=float(self.value),
            kind=self.kind,
            direction="up" if self.direction > 0 else "down",
            frequency_hz=self.omega / math.tau,
            interval=(float(low), float(high)),
            mode=mode,
            changes_verdict=changes_verdict,
            residual=self.residual,
        )


def locate_event(
    continuation: Continuation, guess: EventGuess, crosses: bool = True
) -> Event | None:
    """The event next to a guess, None if there is none that is known to within its width.

    crosses: whether it has to cross the line; two divergent roots that join to a pair do not.
    """
    with suppress(np.linalg.LinAlgError, ValueError):
        return _locate_event(continuation, guess, crosses)
    return None


class _Zero(NamedTuple):
    """Where Newton's method ends.

    roots: at the zero; move: the last step to it; function: that of the event before this step.
    """

    roots: LocalRoots
    move: float
    function: EventFunction


def _newton(continuation: Continuation, guess: EventGuess) -> _Zero | None:
    """The zero of the event function next to a guess.

    None if the iteration moves further from the guess than 1.5 of its widths, if the slope is zero
    or not finite, as that of a defective root, or if no step is small enough. A step is small
    enough if it is no greater than rounding of p, or than a quarter of the distance by which
    rounding of the function moves its zero.
    """
    low = continuation.low
    high = continuation.high
    start = min(max(guess.value, low), high)
    try:
        roots = roots_near(continuation, start, guess.z, guess.right, guess.left)
    except ComputationError:  # defective: its slope is infinite
        return None
    for _ in range(NEWTON_STEPS):
        function = roots.event_function(guess.coalesces)
        slope = function.slope
        if slope == 0.0 or not np.isfinite(slope):
            return None
        move = -function.value / slope
        p = float(np.clip(roots.value + move, low, high))
        if abs(p - start) > 1.5 * guess.width:  # half as much again, as a step may overshoot
            return None
        roots = roots.at(continuation, p)
        if abs(move) <= max(4 * EPS * abs(p), function.noise / abs(slope) / 4):
            return _Zero(roots, move, function)
    return None


def _locate_event(continuation: Continuation, guess: EventGuess, crosses: bool) -> Event | None:
    """The event next to a guess, None if there is none; arguments as of `locate_event`.

    An event is a zero of the event function f, which Newton's method finds. As f is known to its
    noise, the zero lies within 2 noise / |f'| of where the method ends: that is the interval of the
    event. If it is not by far narrower than the guess, f' may vary within; then the ends are the
    nearest values on both sides at which |f| exceeds the noise.

    There is no event where the method finds no zero, where the interval is wider than the guess,
    where rounding hides whether two roots meet, where no root crosses the line, and where f has the
    same sign on both sides.

    Raises LinAlgError or ValueError where a matrix is singular.
    """
    zero = _newton(continuation, guess)
    if zero is None:
        return None
    roots = zero.roots
    p = roots.value
    function = zero.function
    coalesces = guess.coalesces
    slope = abs(function.slope)
    # rounding of the function, the last step of Newton's method, rounding of p
    half_width = 2 * function.noise / slope + abs(zero.move) + 2 * EPS * abs(p)
    if half_width > guess.width:
        return None
    # where two roots meet, f is nearly the parabola f + slope x + bend x^2 of the distance x from
    # p. Rounding hides whether it has a zero unless its discriminant slope^2 - 4 bend f is positive
    # for all |f| up to 4 noise
    if coalesces and slope**2 <= 16 * abs(function.bend) * function.noise:
        return None
    root = _root_at_event(continuation, guess, zero, crosses)
    if root is None:
        return None
    direction = root.direction
    first = p - half_width
    last = p + half_width
    if half_width > 1e-9 * guess.width:  # too wide for a slope that is constant within

        def sign(x: float) -> int:
            """The sign of the event function at x, 0 where rounding hides it.

            Moves `roots` to x: the next call starts from the vectors there.
            """
            nonlocal roots
            roots = roots.at(continuation, x)
            local_function = roots.event_function(coalesces)
            if abs(local_function.value) <= local_function.noise:
                return 0
            return int(np.sign(local_function.value))

        bracket = bracket_by_sign(sign, (p, p), half_width, continuation.low, continuation.high)
        if bracket is None:
            return None
        first, last, rise = bracket
        # the sign of f tells the direction, too, unless one of two roots crosses: then f has the
        # product of both real parts as a factor, and may rise where that root ceases to grow
        if rise and (coalesces or roots.is_single):
            direction = rise * continuation.problem.growth_sign
    if last - first > guess.width:
        return None
    # the noise holds roundings of single entries of A. Numbers from which A is computed, such as
    # the equilibrium of a pad, are rounded to EPS, too, and move all entries together
    input_slopes = 0.0  # sum of |df / (relative change of such a number)|
    for perturbed in continuation.perturbed_by_rounding(p):
        # `roots` may be those of the last x above: near enough for their vectors to start from
        local = roots_near(continuation, p, roots.mean, roots.right, roots.left, perturbed)
        input_slopes += abs(local.event_function(coalesces).slope)
    margin = 2 * EPS * input_slopes / slope
    interval = beyond_ends(continuation, first - margin, last + margin)
    return Event(p, root.omega, direction, interval, root.residual, coalesces)


def beyond_ends(continuation: Continuation, first: float, last: float) -> tuple[float, float]:
    """The interval of an event, extended beyond each end of the range that it reaches.

    It is extended by its width, since rounding hides the sign at that end, so that the event itself
    may lie beyond. The interval of an event beyond the upper end begins at that end.
    """
    first = min(first, continuation.high)
    width = last - first
    if first <= continuation.low:
        first = continuation.low - width
    if last >= continuation.high:
        last = continuation.high + width
    return first, last


class _CrossingRoot(NamedTuple):
    """A root that crosses the line at an event, or the mean of two that meet on it.

    slope: of the real part of z, or of d where two meet; lambda_is_real: True if lambda is known to
    be real, False if z itself tells, by `ProblemClass.exponents`.
    """

    z: complex
    slope: float
    lambda_is_real: bool


class _RootAtEvent(NamedTuple):
    """Angular frequency (rad/s), direction and residual of what crosses or meets."""

    omega: float
    direction: int
    residual: float


def _root_at_event(
    continuation: Continuation, guess: EventGuess, zero: _Zero, crosses: bool
) -> _RootAtEvent | None:
    """The root at the zero of an event function; None if it does not cross the line there.

    crosses: whether it has to cross the line; two divergent roots that join to a pair do not.
    """
    roots = zero.roots
    problem = continuation.problem
    A, derivative, _ = continuation.standard_problem(roots.value)
    if guess.coalesces:
        crossing = _coalescing_roots(problem, zero, crosses)
    elif roots.is_single:
        bound = norm_of(A) + norm_of(derivative) * guess.width  # of |A| within the guess
        crossing = _single_root(problem, roots, bound)
    else:
        crossing = _crossing_root_of_two(roots)
    if crossing is None:
        return None
    z, slope, lambda_is_real = crossing
    is_complex = problem is DAMPED and np.iscomplexobj(A)
    if is_complex and not lambda_is_real and z.imag < 0.0:
        return None  # of complex matrices only roots above the real axis mean something
    omega = 0.0  # of a real lambda
    if not lambda_is_real:
        exponent = problem.exponents(np.array(z), continuation.frequency_scale)
        omega = abs(exponent.item().imag)
    # of two roots the residual of that combination of their vectors which satisfies A x = z x best
    residual = np.linalg.svd(A @ roots.right - z * roots.right, compute_uv=False)[-1]
    slope_sign = 1 if slope > 0 else -1
    return _RootAtEvent(
        omega=omega,
        direction=slope_sign * problem.growth_sign,
        residual=float(residual) / (norm_of(A) or 1.0),
    )


def _coalescing_roots(problem: ProblemClass, zero: _Zero, crosses: bool) -> _CrossingRoot | None:
    """The mean of two roots that coalesce at the zero; None if they do not do so on the line.

    Its slope is that of the event function, the square of half the difference. crosses: whether the
    roots have to cross the line; two divergent roots that join to a pair do not.
    """
    roots = zero.roots
    z = roots.mean
    # half the difference of the two is sqrt(d), of which rounding leaves sqrt(noise)
    is_zero = abs(z) <= 2 * math.sqrt(roots.d_noise) + roots.mean_noise
    if crosses and problem is UNDAMPED and z.real < 0:
        return None  # two divergent roots, z < 0, join to a pair
    if problem is GYROSCOPIC and abs(z.imag) > abs(z.real) and not is_zero:
        return None  # off the real axis, where both grow or decay
    # undamped, z = -lambda^2, the sign of z tells whether lambda is real, see `exponents`
    return _CrossingRoot(z, zero.function.slope, is_zero and problem is not UNDAMPED)


def _single_root(problem: ProblemClass, roots: LocalRoots, bound: float) -> _CrossingRoot | None:
    """The single root that crosses; None if its real part is not zero.

    Newton's method may end without a zero next to a coalescence, where the slope is unbounded and
    steps are small. bound: how large roots may be; 1e-8 of it, the square root of the machine
    precision, counts as zero.
    """
    z = roots.mean
    if abs(z.real) > 1e-8 * bound:
        return None
    # without damping only a real root z crosses by itself, where it passes zero
    lambda_is_real = problem is not DAMPED or abs(z.imag) <= 4 * roots.mean_noise
    return _CrossingRoot(z, roots.mean_slope.real, lambda_is_real)


def _crossing_root_of_two(roots: LocalRoots) -> _CrossingRoot | None:
    """Of two close roots mean +- sqrt(d) the one nearer to the axis; None if a third is too near.

    The zero of the event function is hardly known then; another guess, of a single root or of a
    shorter step, leads to the event.
    """
    if not roots.is_resolved:
        return None
    mean = roots.mean
    half_difference = complex(np.sqrt(roots.d)) or 1e-300  # not 0, as it divides
    if not abs((mean + half_difference).real) < abs((mean - half_difference).real):
        half_difference = -half_difference
    z = mean + half_difference
    # a change of d moves its square root by that change over 2 sqrt(d): by noise and by the slope
    noise = roots.mean_noise + abs(roots.d_noise / (2 * half_difference))
    noise = max(noise, 1e-9 * (abs(mean) + abs(half_difference)))  # at least that of their size
    slope = (roots.mean_slope + roots.d_slope / (2 * half_difference)).real
    return _CrossingRoot(z, slope, lambda_is_real=abs(z.imag) <= noise)


class Bracket(NamedTuple):
    """The nearest values below and above a zero at which the sign of a function is certain.

    rise: 1 if the function rises between them, -1 if it falls, 0 if neither sign is certain.
    """

    low: float
    high: float
    rise: int


def bracket_by_sign(
    sign: Callable[[float], int], at: tuple[float, float], half: float, low: float, high: float
) -> Bracket | None:
    """The bracket of a zero: the nearest values on both sides at which the sign is certain.

    Near the zero rounding hides the sign. Of a flat function the zero may lie further away than
    noise / slope says; the bracket holds it all the same.

    Parameters
    ----------
    sign : function
        1 or -1 where the sign is certain at a value, else 0.
    at : (float, float)
        The interval in which the zero is taken to be: values are tried below the first number and
        above the second.
    half : float
        The distance from these two that is tried first; then it is halved or doubled.
    low, high : float
        Limits. A limit is an end of the bracket where no value nearer to `at` is certain.

    Returns
    -------
    Bracket or None
        None if the sign is the same on both sides.
    """
    smallest = 2 * float(np.spacing(max(abs(low), abs(high))))  # distance that is tried
    # -1 and 1: the side; then the largest distance, the first one and the smallest one
    below, sign_below = _certain_sign(sign, at[0], -1, at[0] - low, half, smallest)
    above, sign_above = _certain_sign(sign, at[1], 1, high - at[1], half, smallest)
    if sign_below * sign_above > 0:
        return None
    if not sign_below:
        below = low
    if not sign_above:
        above = high
    # the third field is the sign above: where that is not certain, the opposite of the sign below
    return Bracket(below, above, sign_above or -sign_below)


def _certain_sign(
    sign: Callable[[float], int],
    start: float,
    side: int,
    room: float,
    half: float,
    smallest: float,
) -> tuple[float, int]:
    """A value near `start` at which the sign is certain, and this sign; 0 if it is nowhere certain.

    Values lie above `start` (`side` 1) or below it (-1). The first distance tried is `half`, or
    half the `room` if that is less. If the sign is certain there, the distance is halved
    while the sign stays the same, down to `smallest`; else it is doubled until the sign is certain.
    So it is the least such distance to within a factor of 2. Where no distance below `room` has a
    certain sign, the sign is 0 and the value means nothing.
    """

    def sign_at(distance: float) -> int:
        if distance >= room:
            return 0
        return sign(start + side * distance)

    distance = max(min(half, room / 2), smallest)
    certain = sign_at(distance)
    while certain and distance > smallest and sign_at(distance / 2) == certain:
        distance /= 2
    while not certain and distance < room:
        distance *= 2
        certain = sign_at(distance)
    return float(start + side * distance), certain
