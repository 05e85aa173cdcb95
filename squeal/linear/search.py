"""All events between two values of a parameter, and what shows whether one is missing.

Steps of the continuation give guesses, which are located. What grows is counted halfway between
neighbouring events. Where the count does not follow from what was located the range there is
halved and searched again, until the events add up or what remains is known by the count alone.

A search has no doubts if the events add up to what grows between them, if every interval is
narrow, and if all factors of the terms are resolved: their second derivatives, bounded over each
step by interval arithmetic, leave roots no room for what the step does not see, however close they
come. Of a plain function nothing is known between the values. Whether an answer is certified is for
the referee to say, who counts and proves without the roots that are judged (`queries.ranges`).
"""

import itertools
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from squeal.errors import ComputationError, InputError
from squeal.linear.bends import bends_within, factors_of
from squeal.linear.continuation import (
    DAMPED,
    UNDAMPED,
    Continuation,
    ContinuationOptions,
    SpectrumAtParameter,
)
from squeal.linear.event_guesses import guesses_of, window_guesses
from squeal.linear.events import Event, bracket_by_sign, located
from squeal.linear.steps import Guess, Step, may_exchange_partner, near_coalescences
from squeal.linear.system import SystemFunction, TermSystem
from squeal.linear.verdicts import UnstableCount

Interval = tuple[float, float]


class RequiredCrossing(NamedTuple):
    """What has to cross between two values: rad/s (0 of a real root), and 1 upwards or -1."""

    omega: float
    direction: int


def required_crossings(
    below: SpectrumAtParameter, above: SpectrumAtParameter
) -> list[RequiredCrossing]:
    """What has to cross the line between two values, so that the counts of growing roots agree.

    Of the pairs these are the ones whose frequencies are farthest from any pair that grows on the
    other side.
    """
    pairs = above.unstable_count.pairs - below.unstable_count.pairs
    reals = above.unstable_count.reals - below.unstable_count.reals
    if pairs * reals < 0:
        # of two divergent roots that join to a growing pair, or come from one, nothing crosses
        joined = min(abs(pairs), abs(reals) // 2) * int(np.sign(pairs))
        pairs -= joined
        reals += 2 * joined
    more, less = (above, below) if pairs > 0 else (below, above)
    candidates = [float(more.omegas[k]) for k in more.unstable_pairs]
    persisting = [float(less.omegas[k]) for k in less.unstable_pairs]
    for omega in persisting[: max(len(candidates) - abs(pairs), 0)]:
        candidates.remove(min(candidates, key=lambda candidate: abs(candidate - omega)))
    omegas = (candidates + [0.0] * abs(pairs))[: abs(pairs)]
    crossings = [RequiredCrossing(omega, int(np.sign(pairs))) for omega in omegas]
    return crossings + [RequiredCrossing(0.0, int(np.sign(reals)))] * abs(reals)


def counts_consistent(events: Sequence[Event], below: UnstableCount, above: UnstableCount) -> bool:
    """True if events add up to the change of what grows, but for divergent roots that join to a
    growing pair, or come from one, and cross nothing."""
    change = sum(event.direction * (2 if event.omega else 1) for event in events)
    return above.roots - below.roots == change


@dataclass(frozen=True)
class SearchResult:
    """Clusters of coincident events by rising parameter, and what grows between the clusters."""

    clusters: tuple[tuple[Event, ...], ...]
    unstable_counts: tuple[UnstableCount, ...]
    continuation: Continuation = field(repr=False)
    doubts: tuple[str, ...] | None = None  # what may be wrong; None of a plain function

    @property
    def edges(self) -> list[float]:
        """The values between which `unstable_counts` are: the ends of the range and clusters."""
        places = [cluster[0].value for cluster in self.clusters]
        return [self.continuation.low, *places, self.continuation.high]


def search(
    system: SystemFunction, low: float, high: float, options: ContinuationOptions | None = None
) -> SearchResult:
    """All events for low <= p <= high, in clusters of coincident ones.

    The range is divided into steps, and these again, until the roots at both ends of each are
    matched. What may cross is located, and the counts of growing roots between the events decide
    where the search has to look again.
    """
    options = options or ContinuationOptions()
    continuation = Continuation(system, low, high, options)
    count, budget = _affordable(continuation.size, options)
    values = [low]
    for k in range(1, count):  # uneven, as thresholds often lie at round numbers
        values.append(low + (k + 0.0371 * (1 + k % 3)) / count * (high - low))
    values.append(high)
    continuation.prepare(values)
    refinement = _AdaptiveRefinement(continuation, budget)
    for a, b in itertools.pairwise(values):
        refinement.refine(a, b, options.depth)
    refinement.guesses += _meetings_at_end(continuation.at(high), 1e-6 * (high - low))
    refinement.locate_events()
    clusters = refinement.clusters()
    between = _midpoints(continuation, clusters)
    counts = tuple(continuation.at(p).unstable_count for p in between)
    result = SearchResult(tuple(clusters), counts, continuation)
    if not isinstance(system, TermSystem):
        return result
    return replace(result, doubts=tuple(_doubts(result, refinement.unresolved)))


def _affordable(rows: int, options: ContinuationOptions) -> tuple[int, int]:
    """How many steps are taken first, and how many values in all, of a matrix of that many rows."""
    if rows <= 60:
        return max(options.steps, 2), options.budget
    if rows <= 150:
        return max(int(options.steps * (2 / 3)), 2), options.budget // 4
    return max(int(options.steps * (5 / 12)), 2), options.budget // 16


class _AdaptiveRefinement:
    """Steps along a continuation with a budget of values, the `events` so far, and whether the
    budget left a step `unresolved`: with roots unmatched or a factor too bent."""

    def __init__(self, continuation: Continuation, budget: int) -> None:
        self.continuation = continuation
        self.budget = budget
        self.range = continuation.high - continuation.low
        # of the parameter: events closer than this coincide
        self.merge_distance = 4 * continuation.options.same * self.range
        self.guesses: list[Guess] = []
        self.events: list[Event] = []
        self.located: list[Event] = []  # also what may be one of the events again, or its twin
        self.unresolved = False
        self.factors = factors_of(continuation.system)

    def refine(self, low: float, high: float, depth: int) -> None:
        """Match all roots from low to high, in steps as short as that takes, and collect guesses.

        `depth` is how often the step may still be divided.
        """
        continuation = self.continuation
        options = continuation.options
        before = continuation.at(low)
        after = continuation.at(high)
        step = Step(before, after, options)
        guesses, division = guesses_of(step, (low == continuation.low, high == continuation.high))
        meetings = list(near_coalescences(before, after))
        is_bent = any(bends_within(continuation, step, factor) for factor in self.factors)
        # third roots decide, or two windows are near
        has_several = (
            len(meetings) > 2
            or any(meeting.doubtful for meeting in meetings)
            or may_exchange_partner(before, after)
        )
        # half of the budget is left for matches
        budget = self.budget / 2 if has_several and division is None else self.budget
        is_spent = len(continuation.states) >= budget
        if is_bent or has_several:
            division = options.aside
        if division is not None and depth > 0 and not is_spent:
            middle = low + division * (high - low)
            if low < middle < high:
                self.refine(low, middle, depth - 1)
                self.refine(middle, high, depth - 1)
                return
        self.unresolved |= is_bent or (division is not None and is_spent)
        self.guesses += guesses
        for meeting in meetings:
            count = len(self.guesses)
            with suppress(np.linalg.LinAlgError):
                self.guesses += window_guesses(continuation, meeting, high - low)
            if len(self.guesses) == count and continuation.problem is not DAMPED:
                # near a third root another pair may have been taken
                continuation.at(meeting.value)

    def locate_events(self) -> None:
        """Add the events to which the guesses lead, and forget the guesses.

        Of one frequency and direction events whose intervals touch may be one: the first is added.
        """
        for guess in self.guesses:
            event = located(self.continuation, guess)
            if event is not None and event.value - self.continuation.low <= 1e-6 * self.range:
                event = self.snap_to_range_start(event)
            if event is None:
                continue
            self.located.append(event)
            if not any(_is_same_event(event, other) for other in self.events):
                self.events.append(event)
        self.guesses.clear()
        self.events.sort(key=lambda event: event.value)

    def snap_to_range_start(self, event: Event) -> Event | None:
        """An event, at the start if rounding leaves that; none if decay begins from rest there."""
        continuation = self.continuation
        low = continuation.low
        if event.interval[0] > low or not _rests_at_start(continuation, event.omega):
            return event
        return replace(event, value=low) if event.direction > 0 else None

    def clusters(self) -> list[tuple[Event, ...]]:
        """All events in clusters of coincident ones, which add up to what grows between them as far
        as can be.

        Those at the start of the range, where growth begins from rest, are a cluster of their own.
        """
        continuation = self.continuation
        low = continuation.low
        between = _midpoints(continuation, cluster_events(self.events, self.merge_distance))
        edges = [low, *between[1:-1], max(between[-1], continuation.high)]
        resolved: list[Event] = []
        for a, b in itertools.pairwise(edges):
            resolved += self.resolve_events(a, b, (a, b))
        resolved.sort(key=lambda event: event.value)
        at_start = [event for event in resolved if event.value == low]
        others = [event for event in resolved if event.value != low]
        groups = cluster_events(others, self.merge_distance)
        if at_start:
            groups.insert(0, fastest_first(continuation, at_start))
        clusters: list[tuple[Event, ...]] = []
        ends = itertools.pairwise(_midpoints(continuation, groups))
        for group, (a, b) in zip(groups, ends, strict=True):
            clusters += self.split_cluster(group, a, b)
        return clusters

    def split_cluster(self, events: list[Event], a: float, b: float) -> list[tuple[Event, ...]]:
        """The parts of a cluster of events, divided where the counts between its events agree.

        a and b lie below and above the cluster. Twins that are almost one are told apart so.
        """
        parts = []
        start = 0
        for k in range(1, len(events)):
            p = (events[k - 1].value + events[k].value) / 2
            if any(event.interval[0] <= p <= event.interval[1] for event in events):
                continue
            below, here, above = (self.continuation.at(x).unstable_count for x in (a, p, b))
            lower_agree = counts_consistent(events[:k], below, here)
            if lower_agree and counts_consistent(events[k:], here, above):
                parts.append(tuple(events[start:k]))
                start = k
        return [*parts, tuple(events[start:])]

    def resolve_events(self, a: float, b: float, limits: Interval) -> list[Event]:
        """Events from a to b that add up to the change of what grows, as far as can be.

        Where they do not, the range is halved beside the events and searched again. Of equal
        subsystems that cross at one place one located event stands for all; where there is no room
        to halve, and no such event, the count alone gives one.

        Parameters
        ----------
        a, b : float
            The range.
        limits : (float, float)
            What the interval of an event that only the count gives may fill.
        """
        continuation = self.continuation
        inside = [event for event in self.events if a <= event.value <= b]
        below = continuation.at(a).unstable_count
        above = continuation.at(b).unstable_count
        is_consistent = self._is_consistent(inside, a, b)
        is_coarse = b - a > self.range / 64
        # without events all of the range lies below the first one
        first, last = (inside[0].value, inside[-1].value) if inside else (b, b)
        if is_consistent:
            if not is_coarse:
                return inside
            is_steady_below = _is_steady(continuation, a, first, below)
            if is_steady_below and _is_steady(continuation, last, b, above):
                return inside
        changes = required_crossings(continuation.at(a), continuation.at(b))
        division = self._division_point(a, b, inside)
        coincident = bool(inside) and last - first <= self.merge_distance
        is_exhausted = len(continuation.states) > 2 * self.budget
        if is_exhausted or (is_consistent and division is None):
            return inside
        if division is None:
            known = []
            for change in changes:
                event = self._located_event(change, a, b)
                if event is None:
                    event = self._event_from_count(change, a, b, limits)
                if event is not None:
                    known.append(event)
            return known
        if coincident and not is_consistent:
            around = self._rescan_beside(a, b, inside, limits)
            if around is not None:
                return around
            located = [self._located_event(change, a, b) for change in changes]
            twins = [event for event in located if event is not None]
            if changes and len(twins) == len(changes):  # of equal subsystems, all at one place
                return twins
        if is_coarse:  # a finer range was refined within a coarse one: it is only divided
            self.refine(a, division, continuation.options.depth)
            self.refine(division, b, continuation.options.depth)
            self.locate_events()
        return [
            *self.resolve_events(a, division, limits),
            *self.resolve_events(division, b, limits),
        ]

    def _is_consistent(self, events: list[Event], a: float, b: float) -> bool:
        """True if events from a to b add up to the change of what grows."""
        below = self.continuation.at(a).unstable_count
        above = self.continuation.at(b).unstable_count
        if counts_consistent(events, below, above):
            return True
        # what crosses at the end of the range is not seen beyond it
        seen = [event for event in events if event.interval[1] < b]
        return b == self.continuation.high and counts_consistent(seen, below, above)

    def _rescan_beside(
        self, a: float, b: float, inside: list[Event], limits: Interval
    ) -> list[Event] | None:
        """All events from a to b, after a finer search on both sides of coincident ones.

        a, b, limits: as `resolve_events`; inside: the coincident events. None if the change of what
        grows happens where these lie: what crosses elsewhere is no twin of them.
        """
        continuation = self.continuation
        low, high = hull(inside)
        below = continuation.at(a).unstable_count
        above = continuation.at(b).unstable_count
        if _is_expected_beside(continuation, (low, high), (a, b), below, above):
            return None
        margin = 16 * max(high - low, _resolution(low, high))
        before = max(low - margin, (a + low) / 2)
        after = min(high + margin, (high + b) / 2)
        cuts = [a, max(a, before), min(b, after), b]
        pieces = [(p, q) for p, q in itertools.pairwise(cuts) if p < q]
        for p, q in pieces:
            if not p <= low <= q:
                self.refine(p, q, continuation.options.depth)
        self.locate_events()
        resolved: list[Event] = []
        for p, q in pieces:
            resolved += self.resolve_events(p, q, limits)
        return resolved

    def _division_point(self, a: float, b: float, inside: list[Event]) -> float | None:
        """Where to divide the range from a to b: near the middle, or next to an event.

        It lies beside the intervals of the events `inside`; None where there is no room for that.
        Where rounding hides what grows a count that lies outside of those at a and b is noise.
        """
        least = max(1e-10 * self.range, _resolution(a, b))
        fewer, more = sorted(self.continuation.at(p).unstable_count.roots for p in (a, b))
        candidates = [a + self.continuation.options.aside * (b - a)]
        for event in inside:
            candidates += [event.interval[0] - least, event.interval[1] + least]
        for p in candidates:
            is_free = not any(
                event.interval[0] - least < p < event.interval[1] + least for event in inside
            )
            if not (is_free and a + least < p < b - least):
                continue
            state = self.continuation.at(p)
            if state.sure or fewer <= state.unstable_count.roots <= more:
                return p
        return None

    def _located_event(self, change: RequiredCrossing, a: float, b: float) -> Event | None:
        """The located event of a frequency and direction near a and b; it may stand for twins, and
        its interval holds all that are alike."""
        near = self.continuation.options.near
        low = a - self.merge_distance
        high = b + self.merge_distance
        alike = [
            event
            for event in self.located
            if low <= event.value <= high and _has_frequency(event, *change, near)
        ]
        if not alike:
            return None
        return replace(min(alike, key=lambda event: event.width), interval=hull(alike))

    def _event_from_count(
        self, change: RequiredCrossing, a: float, b: float, limits: Interval
    ) -> Event | None:
        """An event of which the counts of growing roots at a and b alone tell.

        Its interval reaches to the nearest values beside a and b at which rounding leaves no doubt
        about the count, or fills the `limits`.
        """
        continuation = self.continuation
        direction = change.direction
        fewer, more = sorted(continuation.at(p).unstable_count.roots for p in (a, b))

        def sign(p: float) -> int:
            least, most = continuation.at(p).bounds
            if most <= fewer:
                return -direction
            return direction if least >= more else 0

        bracket = bracket_by_sign(sign, (a, b), 1e-7 * self.range, *limits)
        interval = limits if bracket is None else bracket[:2]
        event = Event((a + b) / 2, change.omega, direction, interval, converged=False)
        return self.snap_to_range_start(event)


def _resolution(a: float, b: float) -> float:
    """A distance that values from a to b can have at least."""
    return 4 * float(np.spacing(max(abs(a), abs(b))))


def _has_frequency(event: Event, omega: float, direction: int, near: float) -> bool:
    difference = abs(event.omega - omega)
    return event.direction == direction and difference <= near * min(event.omega, omega)


def _is_same_event(event: Event, other: Event) -> bool:
    """True if two events have one frequency and direction, and intervals that touch."""
    return (
        _has_frequency(event, other.omega, other.direction, 1e-6)
        and event.interval[0] <= other.interval[1]
        and other.interval[0] <= event.interval[1]
    )


def hull(events: Sequence[Event]) -> Interval:
    """The least interval that holds those of all events."""
    lows = [event.interval[0] for event in events]
    highs = [event.interval[1] for event in events]
    return min(lows), max(highs)


def cluster_events(events: Sequence[Event], distance: float) -> list[list[Event]]:
    """Clusters of events by rising value, in which each is no further than a distance from the one
    before."""
    clusters: list[list[Event]] = []
    for event in events:
        if clusters and not event.value - clusters[-1][-1].value > distance:
            clusters[-1].append(event)
        else:
            clusters.append([event])
    return clusters


def _is_expected_beside(
    continuation: Continuation,
    interval: Interval,
    limits: Interval,
    below: UnstableCount,
    above: UnstableCount,
) -> bool:
    """True if just outside of an interval of events as many roots grow as are expected there.

    Counted is 16 widths away, or further where rounding hides what grows, within the limits.
    Nearly equal subsystems need this: their crossings are not one event.

    Parameters
    ----------
    continuation : Continuation
        The system along its parameter.
    interval : (float, float)
        That of the events.
    limits : (float, float)
        How far below and above it is looked.
    below, above : UnstableCount
        What is expected below and above.
    """
    low, high = interval
    width = max(high - low, _resolution(low, high))
    furthest = max(1e5 * width, 1e-6 * (continuation.high - continuation.low))
    for end, direction, limit, expected in (
        (low, -1, limits[0], below),
        (high, 1, limits[1], above),
    ):
        most = min(max(direction * (limit - end), 0.0), furthest)
        step = min(16 * width, most)
        state = continuation.at(end + direction * step)
        while state.unstable_count.roots != expected.roots and not state.sure and step < most:
            step = min(2 * step, most)
            state = continuation.at(end + direction * step)
        if state.unstable_count.roots != expected.roots:
            return False
    return True


def _midpoints(continuation: Continuation, clusters: Sequence[Sequence[Event]]) -> list[float]:
    """A value between neighbouring clusters, and below the first and above the last.

    Where the last one lies at the end of the range it is a value a little beyond, if the system has
    one there.
    """
    low = continuation.low
    high = continuation.high
    lasts = [low, *(cluster[-1].value for cluster in clusters)]
    nexts = [*(cluster[0].value for cluster in clusters), high]
    midpoints = [(a + b) / 2 for a, b in zip(lasts, nexts, strict=True)]
    if clusters and high - lasts[-1] <= continuation.options.same * (high - low):
        beyond = high + 1e-6 * (high - low)
        with suppress(InputError, ComputationError, ValueError, ArithmeticError):
            continuation.at(beyond)  # there may be none, beyond a fold
            midpoints[-1] = beyond
    return midpoints


def _meetings_at_end(state: SpectrumAtParameter, width: float) -> Iterator[Guess]:
    """Pairs of roots on the line that are one at the end of the range, as far as rounding tells."""
    on_line = state.real if state.problem is UNDAMPED else state.on_line
    for pair in np.argwhere(np.triu(on_line & on_line[:, None] & state.close, 1)):
        yield Guess(
            value=state.value,
            root=complex(state.roots[pair].mean()),
            right=state.right[:, pair],
            left=state.left[:, pair],
            coalesces=True,
            width=width,
        )


def _rests_at_start(continuation: Continuation, omega: float) -> bool:
    """True if a root of this angular frequency neither grows nor decays at the start of the range.

    Without damping two have to: one that does not meet another cannot leave the line.
    """
    state = continuation.at(continuation.low)
    if not omega:
        return bool(np.any(np.abs(state.roots) <= state.rounding))
    near = np.abs(state.omegas - omega) <= continuation.options.near * omega
    resting = near & state.on_line
    if continuation.problem is DAMPED:
        return bool(resting.any())
    return bool(state.close[np.ix_(resting, resting)].sum() > resting.sum())


def fastest_first(continuation: Continuation, events: Sequence[Event]) -> list[Event]:
    """Coincident events in one direction, that of the fastest growing root first.

    The growth rates are those a little beyond the events, on the side on which the roots grow, or
    at an end of the range on the other one, on which they decay.
    """
    if len({event.omega for event in events}) < 2:
        return list(events)
    low = continuation.low
    high = continuation.high
    widest = max(event.width for event in events)
    distance = np.clip(1e3 * widest, 1e-5 * (high - low), 1e-2 * (high - low))
    beside = events[0].direction * float(distance)
    inside = low <= events[0].value + beside <= high
    side = 1.0 if inside else -1.0  # at an end what decays fastest inside grows fastest beyond
    state = continuation.at(events[0].value + side * beside)
    rates = side * state.exponents.real

    def rate(event: Event) -> float:
        near = continuation.options.near * max(event.omega, float(state.omegas.min()))
        alike = np.abs(state.omegas - event.omega) <= near
        return float(np.max(rates[alike & (rates > 0)], initial=-np.inf))

    return sorted(events, key=rate, reverse=True)


def _is_steady(continuation: Continuation, low: float, high: float, count: UnstableCount) -> bool:
    """True if at each state between low and high as many roots grow, as far as rounding tells."""
    for state in continuation.states:
        if low < state.value < high:
            least, most = state.bounds
            if not least <= count.roots <= most:
                return False
    return True


def _doubts(result: SearchResult, is_exhausted: bool) -> Iterator[str]:
    """What the search itself knows to be wrong with its events, in words."""
    continuation = result.continuation
    counts = result.unstable_counts
    if is_exhausted:
        yield "the search ran out of values; a narrower range needs fewer"
    widest = continuation.options.wide * (continuation.high - continuation.low)
    for k, cluster in enumerate(result.clusters):
        if not counts_consistent(cluster, counts[k], counts[k + 1]):
            yield f"what grows changes otherwise than by what crosses at {cluster[0].value:.9g}"
        for event in cluster:
            if event.width > widest:
                yield f"the crossing at {event.value:.9g} has the wide interval {event.interval}"
