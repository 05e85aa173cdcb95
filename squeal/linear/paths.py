"""Which mode is which along a parameter, and where each one began to grow.

Both are read off the eigenvalue paths of the continuation, on which slopes tell from one value to
the next which root is which.
"""

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.linear.continuation import (
    UNDAMPED,
    Continuation,
    SpectrumAtParameter,
    hermite_cubic,
)
from squeal.linear.eigen import UnstableMode, complex_eigenvalues, growing
from squeal.linear.events import Crossing
from squeal.linear.functions import SystemFunction, matrices_at
from squeal.linear.roots import ComplexArray, assigned, ordered
from squeal.linear.steps import ROOT_TOLERANCE, Step, closest_pairs, squared_ends
from squeal.linear.thresholds import Thresholds

Indices = NDArray[np.intp]
SAME_ROOT = 1e-6
"""Two roots within this share of |lambda| are one root, computed in two ways."""


def continued(system: SystemFunction, values: Sequence[float]) -> Continuation:
    """The continuation of a system over the range of some values, its spectra computed at these.

    Raises InputError.
    """
    low = min(values)
    high = max(values)
    if not high > low:  # a continuation needs a range
        high = low + 1e-6 * max(abs(low), 1.0)
    continuation = Continuation(system, low, high)
    continuation.prepare(values)
    return continuation


class Link(NamedTuple):
    """How the roots of one spectrum continue in the next.

    Attributes
    ----------
    before, after : SpectrumAtParameter
        The two spectra, of m and m' roots.
    order : array of int (m,)
        The index after of each root before; -1 where it has none.
    is_certain : array of bool (m,)
        For which roots that index is certain.
    indistinct : list of pairs of int
        Two roots before that certainly become two after, but not which is which: indices before.
    """

    before: SpectrumAtParameter
    after: SpectrumAtParameter
    order: Indices
    is_certain: NDArray[np.bool_]
    indistinct: list[list[int]]


def links(
    at: Callable[[float], SpectrumAtParameter],
    a: float,
    b: float,
    budget: Iterator[int],
    depth: int = 7,
) -> Iterator[Link]:
    """Links from the spectrum at a to that at b: one, or several after the interval was halved.

    The interval is halved while vectors and slopes at its ends do not tell which root continues
    which, and those of a shorter interval may tell.

    Parameters
    ----------
    at : function
        The spectrum at a value of the parameter.
    a, b : float
        The two values.
    budget : iterator
        Each halving takes one of its items; without any left nothing is halved.
    depth : int
        How often the interval may be halved.
    """
    before = at(a)
    after = at(b)
    order = np.full(len(before.z), -1)
    if not (len(order) and len(after.z)):
        yield Link(before, after, order, order >= 0, [])
        return
    step = Step(before, after)
    # `same_mode` (m, m'): which roots before and after are one mode, by vectors and slopes
    is_certain = np.asarray(step.same_mode.any(axis=1))
    open_before = np.flatnonzero(~is_certain)  # roots of unknown mode
    open_after = np.flatnonzero(~step.same_mode.any(axis=0))
    is_doubtful = len(open_before) > 0 and len(open_after) > 0
    if is_doubtful and depth:
        # roots that are nearly equal at both ends differ no more within a shorter interval
        close_before = _all_close(before.z[open_before])
        close_after = _all_close(after.z[open_after])
        middle = (a + b) / 2
        may_halve = not (close_before and close_after) and middle not in (a, b)
        if may_halve and next(budget, None) is not None:
            yield from links(at, a, middle, budget, depth - 1)
            yield from links(at, middle, b, budget, depth - 1)
            return
    order[is_certain] = step.same_mode.argmax(axis=1)[is_certain]
    indistinct: list[list[int]] = []
    if is_doubtful:
        # the other roots are assigned by slopes, which alone is not certain. It becomes certain for
        # two that came close: their mean is smooth, and the angle of their difference tells which
        # is which
        by_slopes = assigned(step.mismatch[np.ix_(open_before, open_after)])
        order[open_before] = np.where(by_slopes < 0, -1, open_after[by_slopes])
        for pair in _pairs_with_smooth_mean(step, order, open_before.tolist()):
            keeps_order = _keeps_order(step, pair, order)
            if keeps_order is None:
                indistinct.append(pair)
                continue
            is_certain[pair] = True
            if not keeps_order:
                order[pair] = order[pair[::-1]]
    yield Link(before, after, order, is_certain, indistinct)


def _keeps_order(step: Step, pair: list[int], order: Indices) -> bool | None:
    """True if two roots that came close go as `order` says within a step, False if they exchange.

    The square of their difference is smooth, a cubic through values and slopes at both ends. If its
    angle in the complex plane turns by less than 90 degrees, that of the difference turns by less
    than 45. A difference after the step that points backwards then has the wrong sign: the two
    exchange. None if the angle turns further, which leaves the sign open.

    Parameters
    ----------
    step : Step
        The step.
    pair : list of two int
        Indices of the roots before it.
    order : array of int (m,)
        The index after the step of each root before it.
    """
    length = step.after.value - step.before.value
    later = order[pair].tolist()
    difference = np.diff(step.before.z[pair])
    slope = np.diff(step.before.slopes[pair]) * length
    later_difference = np.diff(step.after.z[later])
    later_slope = np.diff(step.after.slopes[later]) * length
    square = hermite_cubic(*squared_ends([difference, slope, later_difference, later_slope]))
    # of the cubic at 17 points of the step
    angles = np.unwrap(np.angle(np.polyval(square[::-1], np.linspace(0, 1, 17))))
    if not np.ptp(angles) < np.pi / 2:
        return None
    points_backwards = (difference.conj() * later_difference).real.item() < 0
    return not points_backwards


def _pairs_with_smooth_mean(step: Step, order: Indices, rows: list[int]) -> Iterator[list[int]]:
    """Disjoint pairs of roots whose mean hardly moves within a step, the closest first.

    Where two roots coalesce their mean is smooth, and neither of them is.

    Parameters
    ----------
    step : Step
        The step.
    order : array of int (m,)
        The index after the step of each root before it, or -1.
    rows : list of int
        Indices before the step of the roots that are examined.
    """
    before = step.before.z
    after = step.after.z
    remaining = {k for k in rows if order[k] >= 0}
    for pair in closest_pairs(sorted(remaining), before, after[order]):
        mean = before[pair].mean()
        later_mean = after[order[pair]].mean()
        if remaining.issuperset(pair) and abs(later_mean - mean) <= ROOT_TOLERANCE * abs(mean):
            remaining -= set(pair)
            yield pair


def _all_close(roots: ComplexArray) -> bool:
    """True if each root has another one so near that no shorter step tells them apart."""
    near = np.abs(roots[:, None] - roots) <= ROOT_TOLERANCE * np.abs(roots)
    return bool(np.all(near.sum(axis=1) > 1))


class Loss(NamedTuple):
    """Modes whose identity is lost between two values of the parameter, `low` and `high`.

    kind: "meet" where two coalesce, "end" where a path ends, "begin" where one begins.
    """

    low: float
    high: float
    kind: str
    modes: tuple[int, ...]  # their numbers


def track_modes(
    at: Callable[[float], SpectrumAtParameter], values: Sequence[float], spare: int = 10**6
) -> tuple[list[Indices], list[Loss]]:
    """The number of the eigenvalue path that each root lies on, at rising values of the parameter.

    Each path is one mode. Paths are numbered from 1 as they appear; conjugates have one number. A
    mode keeps its number where vectors and slopes tell from one value to the next which root
    continues it. Two modes that coalesce keep theirs, but either root may have either number
    afterwards: that is reported as a loss. So are modes that end and begin: at the edge of what is
    computed, or where nothing tells which root continues which.

    Parameters
    ----------
    at : function
        The spectrum at a value.
    values : sequence of float
        The values, rising.
    spare : int
        How many values besides these may be computed.

    Returns
    -------
    numbers : list of arrays of int (m,)
        The number of each root's path, at each value.
    losses : list of Loss
        Where modes lose their identity.
    """
    budget = iter(range(spare))  # all intervals draw on it: each halving takes an item
    tracker = _ModeTracker(at(values[0]))
    numbers = [tracker.numbers]
    for a, b in itertools.pairwise(values):
        for link in links(at, a, b, budget):
            tracker.advance(link)
        numbers.append(tracker.numbers)
    return numbers, tracker.losses


class _ModeTracker:
    """Mode numbers (m,) of the roots of one spectrum after another.

    numbers: those of the last spectrum; largest: the largest number so far; losses: those so far.
    """

    def __init__(self, spectrum: SpectrumAtParameter) -> None:
        self.largest = len(spectrum.z)
        self.numbers = _shared_by_conjugates(spectrum, 1 + np.arange(self.largest))
        self.losses: list[Loss] = []

    def advance(self, link: Link) -> None:
        """Number the roots of the next spectrum, and add the losses on the way to it."""
        before = self.numbers
        after = np.zeros(len(link.after.z), dtype=np.intp)  # 0: without a number yet
        after[link.order[link.is_certain]] = before[link.is_certain]
        for pair in link.indistinct:
            after[link.order[pair]] = before[pair]
            modes = set(before[pair].tolist())
            if len(modes) > 1:
                self._add_loss(link, "meet", modes)
        new = np.flatnonzero(after == 0)
        after[new] = self.largest + 1 + np.arange(len(new))
        self.largest += len(new)
        # `ended` is told before conjugates share a number: two real modes that meet and become a
        # pair lose one of their numbers then, but neither of them ends
        ended = set(before.tolist()) - set(after.tolist())
        self.numbers = _shared_by_conjugates(link.after, after)
        begun = set(self.numbers.tolist()) - set(before.tolist())
        if ended:
            self._add_loss(link, "end", ended)
        if begun:
            self._add_loss(link, "begin", begun)

    def _add_loss(self, link: Link, kind: str, modes: set[int]) -> None:
        loss = Loss(link.before.value, link.after.value, kind, tuple(sorted(modes)))
        self.losses.append(loss)


def _shared_by_conjugates(spectrum: SpectrumAtParameter, numbers: Indices) -> Indices:
    """Numbers (m,) of roots, in which those below the real axis have that of their conjugate."""
    if spectrum.problem is UNDAMPED or not numbers.size:  # a root stands for a pair
        return numbers
    values = spectrum.exponents
    lower = np.flatnonzero(values.imag < 0.0)
    upper = np.flatnonzero(values.imag > 0.0)
    shared = numbers.copy()
    if upper.size:
        shared[lower] = numbers[upper[_conjugates(values[lower], values[upper])]]
    return shared


def mode_numbers_at(
    spectrum: SpectrumAtParameter, numbers: Indices, values: ComplexArray
) -> Indices:
    """The mode numbers of eigenvalues, from the numbered roots of a spectrum of the same matrices.

    Each eigenvalue gets the number of the nearest root.

    Parameters
    ----------
    spectrum : SpectrumAtParameter
        The spectrum, of m roots.
    numbers : array of int (m,)
        The mode numbers of its roots.
    values : array (k,)
        Eigenvalues lambda, rad/s.

    Returns
    -------
    array of int (k,)
        0 where no root is near enough.
    """
    if not len(spectrum.z):
        return np.zeros(len(values), dtype=np.intp)
    upper = np.where(values.imag < 0.0, values.conj(), values)
    z = spectrum.problem.z_of(upper, spectrum.frequency_scale)
    distances = np.abs(spectrum.z - z[:, None])
    nearest = distances.argmin(axis=1)
    for half_plane in (values.imag > 0.0, values.imag < 0.0):
        if half_plane.any():  # two close ones above, or below, the real axis get two modes
            nearest[half_plane] = assigned(distances[half_plane])
    allowed = np.maximum(ROOT_TOLERANCE * np.abs(z), 4 * spectrum.rounding[nearest])
    numbers = np.append(numbers, 0)  # the last one, of index -1: `assigned` left the value over
    return np.where(distances[np.arange(len(z)), nearest] <= allowed, numbers[nearest], 0)


def mode_numbers(values: ComplexArray) -> Indices:
    """The number of the mode of each eigenvalue lambda (m,), from 1 by rising frequency.

    Conjugates are one mode. Real eigenvalues come first; they are paired from the outside inwards,
    the largest with the smallest, and so on. A root below the real axis has the number of the root
    above the axis that is nearest to its conjugate, and 0 where no root lies above the axis.
    """
    order = ordered(values)  # by rising |Im|, the real ones by falling real part
    imag = values[order].imag
    real = order[imag == 0.0]
    upper = order[imag > 0.0]
    lower = order[imag < 0.0]
    numbers = np.zeros(len(values), dtype=np.intp)
    rank = np.arange(len(real))
    numbers[real] = 1 + np.minimum(rank, rank[::-1])
    real_modes = (len(real) + 1) // 2
    numbers[upper] = real_modes + 1 + np.arange(len(upper))
    if len(upper):
        numbers[lower] = numbers[upper[_conjugates(values[lower], values[upper])]]
    return numbers


def _conjugates(lower: ComplexArray, upper: ComplexArray) -> Indices:
    """For each root (m,) below the real axis the index of its conjugate among the upper ones (k,).

    Of roots that are equal each gets another conjugate. Where `assigned` leaves a root over, as
    there are more below than above, it gets the nearest one.
    """
    distances = np.abs(upper - lower[:, None].conj())
    partner = assigned(distances)
    return np.where(partner < 0, distances.argmin(axis=1), partner)


def unstable_modes(
    system: SystemFunction, mu: float, result: Thresholds | None = None
) -> tuple[UnstableMode, ...]:
    """All modes of system(mu) -> (M, C, K) that grow at mu, the fastest first.

    `result` are the thresholds of a range up to mu or further, on whose eigenvalue paths the onsets
    are read; without them, and where rounding hides on the paths what grows, the onsets are None.
    Raises InputError.
    """
    modes = growing(complex_eigenvalues(*matrices_at(system, mu)).eigenvalues)
    if result is None or not modes:
        return modes
    return with_onsets(modes, result, mu, tolerance=math.inf)


def with_onsets(
    modes: Sequence[UnstableMode], result: Thresholds, mu: float, tolerance: float
) -> tuple[UnstableMode, ...]:
    """Modes that grow at mu with their onsets, each that of the nearest root on the paths.

    result: as `unstable_modes` takes it. The onset stays None where no root on the paths is within
    the tolerance, a share of |lambda|.
    """
    on_paths = list(onsets(result, mu))
    completed = []
    for mode in modes:
        onset = None
        nearest = min(on_paths, key=lambda other: abs(other.root - mode.root), default=None)
        if nearest is not None and abs(nearest.root - mode.root) <= tolerance * abs(mode.root):
            onset = nearest.mu
        completed.append(replace(mode, onset=onset))
    return tuple(completed)


class Onset(NamedTuple):
    """An eigenvalue (rad/s) with Im >= 0 that grows, and where it began to.

    mu: None if it grows from the start of the range on, or that is not known.
    """

    root: complex
    mu: float | None


def onsets(result: Thresholds, mu: float) -> Iterator[Onset]:
    """The onset of each eigenvalue that grows at mu."""
    path = _spectra_away_from_crossings(result, mu)
    low = result.searched[0].continuation.low
    _, last = path[-1]
    for k in np.flatnonzero(last.grows).tolist():
        exponent = last.exponents[k]
        onset = _onset_before(path, k, result)
        if onset is not None and onset - low <= 1e-9 * (mu - low):
            onset = None  # at the start of the range itself
        yield Onset(complex(exponent.real, abs(exponent.imag)), onset)


_SpectrumOnPath = tuple[Continuation, SpectrumAtParameter]
"""A spectrum, and the continuation that it belongs to: another one beyond each jump."""


def _spectra_away_from_crossings(result: Thresholds, mu: float) -> list[_SpectrumOnPath]:
    """The spectra by rising value, without those at which rounding may hide what grows.

    Those lie in the interval of a crossing or next to it. The spectrum at mu is part of the list in
    any case, as its last one.
    """
    low = result.searched[0].continuation.low
    margin = 1e-6 * (mu - low)

    def is_near_crossing(p: float) -> bool:
        return any(
            crossing.interval[0] - margin <= p <= crossing.interval[1] + margin
            for crossing in result.crossings
        )

    path = []
    for part in result.searched:
        continuation = part.continuation
        if continuation.low <= mu <= continuation.high:
            continuation.at(mu)  # from now on it is among `spectra`
        for spectrum in continuation.spectra:
            inside = continuation.low <= spectrum.value <= min(mu, continuation.high)
            if inside and (spectrum.value == mu or not is_near_crossing(spectrum.value)):
                path.append((continuation, spectrum))
    return path


def _onset_before(path: Sequence[_SpectrumOnPath], k: int, result: Thresholds) -> float | None:
    """Where the root of index k at the last spectrum of a path began to grow.

    The path, by rising parameter, is followed backwards to a spectrum at which the root does not
    grow; the crossing of `result` after it is the onset. None if the root grows at the first
    spectrum already, or if no upward crossing lies there.
    """
    for i in range(len(path) - 1, 0, -1):
        continuation, before = path[i - 1]
        later_continuation, after = path[i]
        hertz = after.omegas[k] / math.tau
        if continuation is later_continuation:
            order = Step(before, after).order
            k = int(np.argsort(order)[k])  # the inverse of `order`: the index before
        else:  # beyond a jump
            k = int(np.argmin(np.abs(before.exponents - after.exponents[k])))
        if not before.grows[k]:
            return _nearest_crossing(result.crossings, before.value, after.value, hertz)
    return None


def _nearest_crossing(
    crossings: Sequence[Crossing], low: float, high: float, hertz: float
) -> float | None:
    """The mu of the upward crossing between two values whose frequency is nearest; None if none."""
    upward = [c for c in crossings if c.direction == "up" and low < c.mu <= high]
    if not upward:
        return None
    return min(upward, key=lambda crossing: abs(crossing.frequency_hz - hertz)).mu
