"""Which mode is which along a parameter, and where each one began to grow.

Both are read off the eigenvalue paths of the continuation, on which slopes tell from one value to
the next which root is which.
"""

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.linear.continuation import Continuation, ContinuationOptions, State, Step, hermite_cubic
from squeal.linear.eigen import (
    FLUTTER,
    ComplexArray,
    UnstableMode,
    assigned,
    complex_eigenvalues,
    growing,
    ordered,
)
from squeal.linear.system import SystemFunction, matrices_at
from squeal.linear.thresholds import Thresholds


def continued(system: SystemFunction, values: Sequence[float]) -> Continuation:
    """The continuation of a system over a range that holds some values. Raises InputError."""
    low, high = min(values), max(values)
    high = high if high > low else low + 1e-6 * max(abs(low), 1.0)
    along = Continuation(system, low, high)
    along.prepare(values)
    return along


class Link(NamedTuple):
    """From one state to the next: the index there of each root (-1 where it has none), which of
    them are certain, and pairs of which both are known and not which is which."""

    before: State
    after: State
    order: NDArray[np.intp]
    known: NDArray[np.bool_]
    meet: list[list[int]]


def links(
    at: Callable[[float], State],
    options: ContinuationOptions,
    a: float,
    b: float,
    left: Iterator[int],
    depth: int = 7,
) -> Iterator[Link]:
    """From a to b, halved until vectors and slopes tell each mode, as often as `left` lets."""
    before, after = at(a), at(b)
    order, meet = np.full(len(before.roots), -1), list[list[int]]()
    if not (len(order) and len(after.roots)):
        yield Link(before, after, order, order >= 0, meet)
        return
    step = Step(before, after, options)
    rows, columns = (np.flatnonzero(~step.links.any(axis=k)) for k in (1, 0))
    ends, middle = (before.roots[rows], after.roots[columns]), (a + b) / 2
    doubtful = len(rows) and len(columns) and not all(_close(z, options) for z in ends)
    if doubtful and depth and middle not in (a, b) and next(left, None) is not None:
        for both in ((a, middle), (middle, b)):
            yield from links(at, options, *both, left, depth - 1)
        return
    known = np.asarray(step.links.any(axis=1))
    order[known] = step.links.argmax(axis=1)[known]
    if len(rows) and len(columns):
        rest = assigned(step.missed[np.ix_(rows, columns)])
        order[rows] = np.where(rest < 0, -1, columns[rest])
        for pair in _near(before.roots, after.roots, order, rows.tolist(), options):
            sides = (before, pair), (after, order[pair].tolist())
            (d, slope), (then, late) = (
                (np.diff(state.roots[k]), np.diff(state.slopes[k]) * (b - a)) for state, k in sides
            )
            c = hermite_cubic(d**2, 2 * d * slope, then**2, 2 * then * late)
            turn = np.unwrap(np.angle(np.polyval(c[::-1], np.linspace(0, 1, 17))))
            if not np.ptp(turn) < np.pi / 2:
                meet.append(pair)
                continue
            known[pair] = True  # their difference goes on, by its square, which is smooth
            if (d.conj() * then).real.item() < 0:
                order[pair] = order[pair[::-1]]
    yield Link(before, after, order, known, meet)


def _near(
    x: ComplexArray, y: ComplexArray, order: NDArray, rows: list[int], options: ContinuationOptions
) -> Iterator[list[int]]:
    """Pairs of the rows, the closest first, whose mean goes on: where two roots coalesce it is
    smooth, and neither of them is."""
    left = {k for k in rows if order[k] >= 0}
    pairs = [list(two) for two in itertools.combinations(sorted(left), 2)]
    pairs.sort(key=lambda two: min(abs(np.ptp(x[two])), abs(np.ptp(y[order[two]]))))
    for both in pairs:
        mean, then = x[both].mean(), y[order[both]].mean()
        if left.issuperset(both) and abs(then - mean) <= options.near * abs(mean):
            left -= set(both)
            yield both


def _close(roots: ComplexArray, options: ContinuationOptions) -> bool:
    """True if each root has another one so near that no shorter step tells them apart."""
    near = np.abs(roots[:, None] - roots) <= options.near * np.abs(roots)
    return bool(np.all(near.sum(axis=1) > 1))


class Loss(NamedTuple):
    """Modes, by number, that meet between two values of the parameter, or end or begin there."""

    low: float
    high: float
    kind: str  # meet, end, begin
    modes: tuple[int, ...]


def follow(
    at: Callable[[float], State], values: Sequence[float], spare: int = 10**6
) -> tuple[list[NDArray[np.intp]], list[Loss]]:
    """Which root is which mode along rising values: their numbers (m,) at each of them.

    Conjugates have one number. A mode keeps it where left and right vectors, or these and the
    slopes, say from one value to the next which it is; up to `spare` values more are looked at.
    What two roots become that coalesce is known of both alone; both keep their numbers, and it is
    told, as is where modes end and begin, at the edge of what is looked at or unrecognised.
    """
    left, options, losses = iter(range(spare)), ContinuationOptions(), list[Loss]()
    state = at(values[0])
    ids = _shared(state, 1 + np.arange(len(state.roots)))
    numbers, most = [ids], len(ids)
    for a, b in itertools.pairwise(values):
        for before, after, order, known, meet in links(at, options, a, b, left):
            own, span = np.zeros(len(after.roots), dtype=np.intp), (before.value, after.value)
            own[order[known]] = ids[known]
            for both in meet:
                own[order[both]] = ids[both]
                losses += [Loss(*span, "meet", tuple(sorted(set(ids[both].tolist()))))]
            new = np.flatnonzero(own == 0)
            own[new] = most + 1 + np.arange(len(new))
            most += len(new)
            gone = sorted({*ids.tolist()} - {*own.tolist()})
            ids, old = _shared(after, own), {*ids.tolist()}
            begun = sorted({*ids.tolist()} - old)
            losses += [Loss(*span, k, tuple(x)) for k, x in (("end", gone), ("begin", begun)) if x]
        numbers.append(ids)
    return numbers, [loss for loss in losses if loss.kind != "meet" or len(loss.modes) > 1]


def _shared(state: State, ids: NDArray[np.intp]) -> NDArray[np.intp]:
    """The numbers of roots, those below the real axis with that of their conjugates."""
    if state.form == "undamped" or not ids.size:  # a root stands for a pair
        return ids
    values = state.exponents
    lower = np.flatnonzero(values.imag < 0.0)
    ids[lower] = ids[np.argmin(np.abs(values - values[lower, None].conj()), axis=1)]
    return ids


def numbers_at(state: State, ids: NDArray[np.intp], values: ComplexArray) -> NDArray[np.intp]:
    """The numbers of eigenvalues (rad/s) of the same matrices, 0 where a state has none of them."""
    upper = np.where(values.imag < 0.0, values.conj(), values)
    z = -(upper**2) if state.form == "undamped" else upper / state.rate
    z = -1j * z if state.form == "gyroscopic" else z
    if not len(state.roots):
        return np.zeros(len(z), dtype=np.intp)
    apart, near = np.abs(state.roots - z[:, None]), ContinuationOptions().near * np.abs(z)
    k = apart.argmin(axis=1)
    for some in np.flatnonzero(values.imag > 0.0), np.flatnonzero(values.imag < 0.0):
        k[some] = assigned(apart[some]) if len(some) else k[some]  # two that cross are two
    least = np.maximum(near, 4 * state.rounding[k])
    return np.where(apart[np.arange(len(z)), k] <= least, ids[k], 0)


def mode_numbers(values: ComplexArray) -> NDArray[np.intp]:
    """The number of the mode of each eigenvalue by rising frequency, from 1; conjugates are one
    mode, and of real ones the fastest and the slowest."""
    order = ordered(values)
    numbers, real = np.zeros(len(values), dtype=np.intp), order[values[order].imag == 0.0]
    rank = np.arange(len(real))
    numbers[real] = 1 + np.minimum(rank, rank[::-1])
    upper, lower = (order[sign * values[order].imag > 0.0] for sign in (1, -1))
    numbers[upper] = (len(real) + 1) // 2 + 1 + np.arange(len(upper))
    if len(upper):
        pair = np.argmin(np.abs(values[upper] - values[lower, None].conj()), axis=1)
        numbers[lower] = numbers[upper[pair]]
    return numbers


def unstable_modes(
    system: SystemFunction, mu: float, found: Thresholds | None = None
) -> tuple[UnstableMode, ...]:
    """All modes of system(mu) -> (M, C, K) that grow at mu, the fastest first.

    `found` are the thresholds of the range from 0 to mu, on whose eigenvalue paths the onsets are
    read; without them, and where rounding hides on the paths what grows, the onsets are None.
    Raises InputError.
    """
    modes = growing(complex_eigenvalues(*matrices_at(system, mu)).eigenvalues)
    ends = list(_onsets(found, mu)) if found is not None and modes else []

    def onset(mode: UnstableMode) -> float | None:
        return min(ends, key=lambda end: abs(end[0] - mode.root), default=(0j, None))[1]

    return tuple(replace(mode, onset=onset(mode)) for mode in modes)


def _onsets(result: Thresholds, mu: float) -> Iterator[tuple[complex, float | None]]:
    """Each eigenvalue that grows at mu, with Im >= 0, and where it began to."""
    low, began = result.searched[0].line.low, [c for c in result.crossings if c.direction == "up"]
    margin = 1e-6 * (mu - low)  # next to a crossing rounding may hide what grows
    taken = [(c.interval[0] - margin, c.interval[1] + margin) for c in result.crossings]
    lines = [part.line for part in result.searched]
    known = [
        (line, state)
        for line in lines
        for state in line.states
        if line.low <= state.value <= line.high
        and (state.value == mu or not any(a <= state.value <= b for a, b in taken))
    ]
    last = lines[-1].at(mu)
    for own in np.flatnonzero(last.kinds >= FLUTTER).tolist():
        k, onset, end = own, None, last.exponents[own]
        for (line, before), (other, after) in reversed(list(itertools.pairwise(known))):
            hertz = after.omegas[k] / (2 * np.pi)
            if line is other:
                k = int(np.argsort(Step(before, after, line.options).order)[k])
            else:  # beyond a jump
                k = int(np.argmin(np.abs(before.exponents - after.exponents[k])))
            if before.kinds[k] < FLUTTER:
                fresh = [c for c in began if before.value < c.mu <= after.value]
                fresh = sorted(fresh, key=lambda c: abs(c.frequency_hz - hertz))[:1]
                onset = next((c.mu for c in fresh if c.mu - low > 1e-9 * (mu - low)), None)
                break
        yield complex(end.real, abs(end.imag)), onset
