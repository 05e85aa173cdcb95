"""Where eigenvalues may cross the line between growth and decay within a step: guesses.

One root is predicted by the cubic of its real part. Of two that come close the mean and the squared
half difference follow cubics. `events` makes the guesses exact.
"""

from collections.abc import Iterator

import numpy as np

from squeal.linear.continuation import (
    DAMPED,
    GYROSCOPIC,
    UNDAMPED,
    Bools,
    Continuation,
    hermite_cubic,
    zeros_between,
)
from squeal.linear.local_roots import LocalRoots, roots_near
from squeal.linear.matrices import Array
from squeal.linear.roots import ComplexArray
from squeal.linear.steps import DOUBT, EventGuess, RootPair, Step

DIVISION_SHARE = 0.4837
"""Of a step: where it is divided; not in the middle, as thresholds often lie at round numbers."""


def guesses_of(
    step: Step, starts_range: bool, ends_range: bool
) -> tuple[list[EventGuess], float | None]:
    """Where roots may cross the line within a step, and where to divide it if that is in doubt.

    A root that stays away from the line, or on it, needs no guess. One whose path is a cubic is
    examined alone, one that is left with its partner in a pair.

    Parameters
    ----------
    step : Step
        The step, with its roots matched.
    starts_range, ends_range : bool
        Whether the step begins, or ends, where the whole range does.

    Returns
    -------
    guesses : list of EventGuess
        All that are found; if a division is returned too, they are for steps too short for it.
    division : float or None
        The share of the step at which it should be divided before guesses are used; None if the
        matches are good enough, and no root turns back so near the line that it may cross it twice.
    """
    problem = step.before.problem
    on_before = step.before.on_line
    on_after = step.after.on_line[step.order]
    passes_zero = _may_pass_zero(step)
    # without damping a root leaves the line only where it meets another one; with damping one that
    # is on the line at one end alone may just be crossing there. Neither is certain, unless the
    # range ends there, or it is a real root that passes zero, perhaps with a twin
    rests_at_range_end = (starts_range & on_before) | (ends_range & on_after)
    meets_none = (on_before == on_after) | passes_zero | rests_at_range_end
    # roots whose continuation over the step is certain, and that meet no other root
    is_certain = step.matched & meets_none
    stays_on_line = on_before & on_after & ~passes_zero
    crosses_nothing = is_certain & (_is_clear_of_line(step, passes_zero) | stays_on_line)
    # another root crosses alone if its path is a cubic, else together with a second one
    change = np.abs((step.ends.later_z - step.ends.z).real)
    change = np.maximum(change, step.highest_real - step.lowest_real)
    is_cubic = np.abs(step.deviation.real) <= DOUBT * change
    single = is_certain & ~crosses_nothing & is_cubic
    guesses: list[EventGuess] = []
    for k in np.flatnonzero(single).tolist():
        guesses += _crossings_of_one(step, k, sides_known=True)
    doubtful = set(np.flatnonzero(~crosses_nothing & ~single).tolist())
    for pair in step.pairs(sorted(doubtful)):
        guesses += _events_of_pair(step, pair)
        doubtful.difference_update(pair.indices)
    for k in doubtful:  # without a partner: good enough where no step can be divided any more
        guesses += _crossings_of_one(step, k, sides_known=False)
    if doubtful:
        return guesses, DIVISION_SHARE
    may_turn = is_certain
    # the cubics are of Re z, which without damping is zero at a threshold of a real root only
    if problem is not DAMPED:
        may_turn = is_certain & _stays_real(step)
    return guesses, _doubtful_turn(step, may_turn)


def _stays_real(step: Step) -> Bools:
    """Which roots (m,) are real at both ends of a step."""
    return step.before.z_is_real & step.after.z_is_real[step.order]


def _path_uncertainty(step: Step) -> Array:
    """How far the path of each root (m,) may be from its cubic, towards the line."""
    uncertainty = 2 * np.abs(step.deviation.real)
    if step.before.problem is DAMPED:
        uncertainty += step.rounding
    return uncertainty


def _may_pass_zero(step: Step) -> Bools:
    """Which roots (m,) may pass zero, where a mode begins or ceases to diverge.

    These are real roots s = -lambda^2 of a system without damping; none of any other.
    """
    if step.before.problem is not UNDAMPED:
        return np.zeros_like(step.matched)
    uncertainty = _path_uncertainty(step)
    around_zero = (step.lowest_real - uncertainty <= 0.0) & (step.highest_real + uncertainty >= 0.0)
    return _stays_real(step) & around_zero & ~step.rests_at_zero


def _is_clear_of_line(step: Step, passes_zero: Bools) -> Bools:
    """Which roots (m,) stay away from the line throughout a step, as far as their paths are known.

    With damping it is the imaginary axis. Without, where z is s or -i lambda, it is the real axis,
    and a root that stays on it crosses nothing unless it passes zero.
    """
    if step.before.problem is DAMPED:
        uncertainty = _path_uncertainty(step)
        return (step.highest_real + uncertainty < 0.0) | (step.lowest_real - uncertainty > 0.0)
    distance = np.minimum(np.abs(step.ends.z.imag), np.abs(step.ends.later_z.imag))
    is_far = distance > 2 * np.abs(step.deviation.imag)
    return is_far | (_stays_real(step) & ~passes_zero)


def _doubtful_turn(step: Step, roots: Bools) -> float | None:
    """Where a root turns back so near the line that its cubic does not tell whether it crosses.

    Re z is near the cubic c0 + c1 t + c2 t^2 + c3 t^3 through values and slopes at both ends, with
    t from 0 to 1. Its error is t^2 (1 - t)^2 times a constant. We assume that the greatest error,
    in the middle of the step, is a tenth of the range of the cubic, or of `step.deviation` (how far
    the root is from where its slopes lead) if that is more. Without this guard damping that is
    negative for a ten-thousandth of the range would be missed.

    Parameters
    ----------
    step : Step
        The step.
    roots : array of bool (m,)
        Which roots are examined.

    Returns
    -------
    float or None
        The share of the step at one such turn; None if there is none.
    """
    c = step.real_cubic  # (4, m)
    with np.errstate(all="ignore"):
        # both zeros of the derivative c1 + 2 c2 t + 3 c3 t^2: q is -c2 -+ the root of the
        # discriminant, with the sign that does not cancel, and the zeros have the product c1 / 3 c3
        q = -c[2] - np.copysign(np.sqrt(c[2] ** 2 - 3 * c[1] * c[3]), c[2])
        t = np.stack([q / (3 * c[3]), c[1] / q])  # (2, m): both turns of each root
        extent = np.maximum(step.highest_real - step.lowest_real, np.abs(step.deviation.real))
        error = 1.6 * (t * (1 - t)) ** 2 * extent  # 1.6 / 16: a tenth at t = 1/2
        is_near = np.abs(c[0] + t * (c[1] + t * (c[2] + t * c[3]))) <= error
    is_near &= roots & (t > 0) & (t < 1) & (error > step.rounding)
    if not is_near.any():
        return None
    return float(t[is_near][0])


def _crossings_of_one(step: Step, k: int, sides_known: bool) -> Iterator[EventGuess]:
    """Where one root passes from decay to growth or back: zeros of the cubic of its real part.

    A damped z = lambda crosses the imaginary axis; an undamped real z = -lambda^2 changes its sign.

    k: the index of the root before the step; sides_known: whether it is certain, at both ends of
    the step, whether the real part is positive, negative or zero.
    """
    before = step.before
    after = step.after
    is_real = before.z_is_real[k] and after.z_is_real[step.order[k]]
    # a gyroscopic z = -i lambda and a complex z = -lambda^2 do not begin or cease to grow alone:
    # two of them have to meet on the real axis
    if before.problem is GYROSCOPIC or (before.problem is UNDAMPED and not is_real):
        return
    ends = np.array([values[k] for values in step.ends])  # (4,): see `StepEnds`
    path = ends.real.copy()
    if sides_known:  # zero to rounding at an end: set to zero, so that its slope tells its side
        at_ends = path[[0, 2]]  # the values; 1 and 3 are slopes
        path[[0, 2]] = np.where(np.abs(at_ends) <= step.rounding[k], 0.0, at_ends)
    length = after.value - before.value
    for t in zeros_between(hermite_cubic(*path)):
        root = complex(np.polyval(hermite_cubic(*ends)[::-1], t))
        right, left = step.vectors(t, [k])
        yield EventGuess(
            value=before.value + t * length,
            z=root,
            right=right,
            left=left,
            coalesces=False,
            width=length,
        )


def _events_of_pair(step: Step, pair: RootPair) -> Iterator[EventGuess]:
    """Where two roots that coalesce or separate in a step cross the line or meet on it.

    The roots are mean +- sqrt(square); both are cubics over the step and are sampled at 101 values.

    - With damping one of them may cross the line, unless both lie on it at both ends of the step.
    - Without damping they may meet on it; with damping, too, if both lie on it at one end.
    - One root s = -lambda^2 of two real ones may pass zero.
    """
    before = step.before
    after = step.after
    problem = before.problem
    length = after.value - before.value
    t = np.linspace(0.0, 1.0, 101)  # shares of the step
    mean = np.polyval(pair.mean[::-1].astype(complex), t)
    square = np.polyval(pair.square[::-1].astype(complex), t)

    def guess(i: int, root: complex, columns: list[int], coalesces: bool) -> EventGuess:
        """An event at the i-th share, of both roots (columns 0 and 1) or of one of them."""
        right, left = step.vectors(t[i], pair.indices)
        return EventGuess(
            value=before.value + t[i] * length,
            z=root,
            right=right[:, columns],
            left=left[:, columns],
            coalesces=coalesces,
            width=length,
        )

    both_on_before = before.on_line[pair.indices].all()
    both_on_after = after.on_line[step.order[pair.indices]].all()
    if problem is DAMPED and not (both_on_before and both_on_after):
        for i, root in _crossings(mean, square):
            yield guess(i, root, [0, 1], coalesces=False)
    if problem is not DAMPED or both_on_before or both_on_after:
        for i, root in _meetings(mean, square):
            yield guess(i, root, [0, 1], coalesces=True)
    if problem is UNDAMPED:
        product = (mean * mean - square).real  # of the two roots: 0 where one of them passes zero
        changes_sign = (product[1:] > 0) != (product[:-1] > 0)
        passes_zero = changes_sign & (square.real[1:] >= 0)
        for i in np.flatnonzero(passes_zero).tolist():
            for column in (0, 1):  # which of the two is not known
                yield guess(i, 0j, [column], coalesces=False)


def _crossings(mean: ComplexArray, square: ComplexArray) -> Iterator[tuple[int, complex]]:
    """Where one root of a pair crosses the imaginary axis: the last index before the crossing, and
    the mean of the pair there.

    mean, square: mean and squared half difference of the two roots at successive values (k,).
    """
    half = np.sqrt(square)
    growing = np.sum(np.stack([mean - half, mean + half]).real > 0.0, axis=0)  # how many: 0 to 2
    for n in np.flatnonzero(growing[1:] != growing[:-1]).tolist():
        yield n, complex(mean[n])


def _meetings(mean: ComplexArray, square: ComplexArray) -> Iterator[tuple[int, complex]]:
    """Where both roots of a pair meet, as the square changes sign: the nearest index, and the mean
    there.

    mean, square: mean and squared half difference of the two roots at successive values (k,).
    """
    positive = square.real > 0.0
    for n in np.flatnonzero(positive[1:] != positive[:-1]).tolist():
        nearer = n + int(abs(square[n + 1]) < abs(square[n]))
        yield nearer, complex(mean[nearer])


def window_guesses(
    continuation: Continuation, meeting: EventGuess, length: float
) -> Iterator[EventGuess]:
    """Where two roots that may meet within a step cross the line, around their closest approach.

    A window of growth that opens and closes within a step has two such events.

    Parameters
    ----------
    continuation : Continuation
        The system along its parameter.
    meeting : EventGuess
        Where the two are predicted to meet.
    length : float
        Length of the step.
    """
    problem = continuation.problem
    pair = roots_near(continuation, meeting.value, meeting.z, meeting.right, meeting.left)
    approach = pair.closest_approach(problem)
    for _ in range(3):  # move `pair` to the closest approach itself
        if approach is None:
            return
        centre, half_width = approach  # the centre counts from `pair.value`
        # from within a few widths of the window the extrapolation is good; a window as wide as an
        # eighth of the step needs none, as it is not missed
        if abs(centre) <= 4 * half_width or half_width >= length / 8:
            break
        if abs(centre) > length:  # in another step
            return
        p = float(np.clip(pair.value + centre, continuation.low, continuation.high))
        pair = pair.at(continuation, p)
        approach = pair.closest_approach(problem)
    if approach is None or approach.half_width == 0.0:  # they touch without a window
        return
    centre, half_width = approach
    if problem is DAMPED:
        events = _crossings_around(pair, centre, half_width, length)
    else:
        events = _meetings_around(pair, centre, half_width, length)
    for offset, root in events:
        yield EventGuess(
            value=pair.value + offset,
            z=root,
            right=pair.right,
            left=pair.left,
            coalesces=problem is not DAMPED,
            width=min(4 * half_width, length),
        )


def _crossings_around(
    pair: LocalRoots, centre: float, half_width: float, length: float
) -> Iterator[tuple[float, complex]]:
    """Where one root of a damped pair crosses the axis: the offset from `pair.value`, the mean.

    The extrapolated pair is sampled densely around the `centre`, to eight times `half_width`, where
    the two stay close, and evenly over the `length` to both sides; all are offsets, too.
    """
    offsets = centre + np.linspace(-8.0, 8.0, 404) * half_width
    offsets = offsets[np.abs(offsets) < length]
    offsets = np.unique(np.concatenate([offsets, np.linspace(-length, length, 101)]))
    for n, root in _crossings(*pair.extrapolate(offsets)):
        yield offsets[n], root


def _meetings_around(
    pair: LocalRoots, centre: float, half_width: float, length: float
) -> Iterator[tuple[float, complex]]:
    """Where an undamped pair meets on the line: the offset from `pair.value`, and the mean there.

    It meets at both zeros of the parabola d(x) = d + slope x + bend x^2, which lie at `half_width`
    from the `centre`; nowhere if rounding hides that d has the other sign between them. length: how
    far an offset may be from 0.
    """
    bend = pair.d_bend.real
    slope = pair.d_slope.real
    # the discriminant, and how far four times the noise of d moves it
    if slope**2 - 4 * bend * pair.d.real <= 16 * abs(bend) * pair.d_noise:
        return
    for offset in np.array([centre - half_width, centre + half_width]):
        if abs(offset) <= length:
            mean, _ = pair.extrapolate(offset)
            yield offset, complex(mean)
