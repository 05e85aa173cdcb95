"""All events between two values of a parameter p, and what shows whether one is missing.

An event is a crossing of the imaginary axis by a pair or a real root, or a coalescence of two roots
on it. The search has three parts:

1. Spectra are computed at some values of p. A step between two of them is divided until the roots
   at both ends are matched by their derivatives by p. Each matched root that may cross the axis,
   and each two roots that may meet there, give a guess.
2. Each guess is located (`events`). Events whose values agree to rounding form a cluster.
3. The growing roots are counted halfway between neighbouring clusters. The events of a cluster have
   to explain how the count changes from one side of the cluster to the other. Where they do not,
   that part of the range is divided and searched again, until they do, or until it is as short as
   rounding allows. What is missing there is listed as an event that only the count shows.

An event may be missed if a step contains two events that cancel in the count: then the counts agree
although both are missing. A search has no `doubts` if the counts agree, if every interval is
narrow, and if the factors of all terms bend so little within each step, by interval bounds of their
second derivatives, that the roots do no more than the ends of the step show. Nothing of the kind is
known of a plain function. An answer is certified by a proof that does not use the roots found here
(`queries.ranges`); a range whose list that proof refutes is searched again.
"""

import itertools
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from squeal.errors import ComputationError, InputError
from squeal.linear.bends import bends_within, factors_of
from squeal.linear.condensation import FastRootGrowsError
from squeal.linear.continuation import DAMPED, UNDAMPED, Continuation, SpectrumAtParameter
from squeal.linear.event_guesses import DIVISION_SHARE, guesses_of, window_guesses
from squeal.linear.events import EVENT_TOLERANCE, Event, beyond_ends, bracket_by_sign, locate_event
from squeal.linear.functions import SystemFunction
from squeal.linear.steps import (
    ROOT_TOLERANCE,
    EventGuess,
    Step,
    is_crowded,
    meeting_at,
    near_coalescences,
)
from squeal.linear.system import System
from squeal.linear.verdicts import UnstableCount

Interval = tuple[float, float]
STEPS = 24
"""Values at which the eigenvalues are computed first, of systems of up to 60 rows; larger ones take
fewer. More of them find thresholds that are missed."""
BUDGET = 1500
"""Values at which eigenvalues may be computed in all, of systems of up to 60 rows."""
DEPTH = 12
"""How often a step may be divided."""
CLEAR_WIDTHS = 16
"""Growing roots beside an event are counted so many widths of its interval away from it."""
WIDEST_INTERVAL = 1e-4
"""Share of the range: an event with a wider interval is reported as a doubt."""


class RequiredCrossing(NamedTuple):
    """What has to cross the line between two values of the parameter.

    omega: angular frequency, rad/s, 0 of a real root; direction: 1 if growth begins, -1 if it ends.
    """

    omega: float
    direction: int


def required_crossings(
    below: SpectrumAtParameter, above: SpectrumAtParameter
) -> list[RequiredCrossing]:
    """What has to cross the imaginary axis between two values, by the counts of growing roots.

    Each pair and each real root that grows at one of the two values alone has to cross the axis
    between them. The frequency of a pair's crossing is that of a pair on the side with more growing
    pairs. A pair on the other side counts as growing on both sides: of the candidates the one
    nearest to it in frequency is left out. If a pair of 100 rad/s grows below and two of 101 and
    250 rad/s above, a pair of 250 rad/s has to begin to grow.
    """
    # how many more grow above than below: crossings then have the direction 1, if fewer grow -1
    pairs = above.unstable_count.pairs - below.unstable_count.pairs
    reals = above.unstable_count.reals - below.unstable_count.reals
    if pairs * reals < 0:
        # two divergent roots that join to a growing pair, or come from one, cross nothing: of one
        # more pair and two real roots less (1, -2) remains (0, 0), of (1, -1) all
        joined = min(abs(pairs), abs(reals) // 2) * int(np.sign(pairs))
        pairs -= joined
        reals += 2 * joined
    with_more, with_fewer = (above, below) if pairs > 0 else (below, above)
    candidates = [float(with_more.omegas[k]) for k in with_more.unstable_pairs]
    persisting = [float(with_fewer.omegas[k]) for k in with_fewer.unstable_pairs]
    count = abs(pairs)
    for omega in persisting[: max(len(candidates) - count, 0)]:
        candidates.remove(min(candidates, key=lambda candidate: abs(candidate - omega)))
    omegas = (candidates + [0.0] * count)[:count]  # one for each pair; 0 where none is left
    pair_crossings = [RequiredCrossing(omega, int(np.sign(pairs))) for omega in omegas]
    real_crossings = [RequiredCrossing(0.0, int(np.sign(reals)))] * abs(reals)
    return pair_crossings + real_crossings


def counts_consistent(events: Sequence[Event], below: int, above: int) -> bool:
    """True if the events between two values explain the change of the number of growing roots.

    below, above: that number at the two values. Divergent roots that join to a growing pair, or
    come from one, cross nothing and change no sum.
    """
    return above - below == sum(event.rise for event in events)


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
        values = [cluster[0].value for cluster in self.clusters]
        return [self.continuation.low, *values, self.continuation.high]


def search(
    system: SystemFunction, low: float, high: float, all_roots: bool = False
) -> SearchResult:
    """All events for low <= p <= high, in clusters of coincident ones.

    The range is divided into steps, and these again, until the roots at both ends of each are
    matched. What may cross is located, and the counts of growing roots between the events decide
    where the search is repeated. all_roots: see `Continuation`; roots that are left out first are
    kept where one of them grows.
    """
    try:
        return _search(Continuation(system, low, high, all_roots))
    except FastRootGrowsError:
        return _search(Continuation(system, low, high, all_roots=True))


def _search(continuation: Continuation) -> SearchResult:
    """All events along a continuation, and what shows whether one is missing, see `search`.

    Spectra are computed at uneven values first. Steps between neighbouring values are refined, and
    the events that these show are located and resolved into clusters. What grows is then counted
    halfway between the clusters.
    """
    low = continuation.low
    high = continuation.high
    # how many steps are taken first, and how many values in all may be computed
    count, budget = _affordable(continuation.size)
    values = [low]
    # uneven, by 4 to 11 per cent of a step, as thresholds often lie at round numbers
    for k in range(1, count):
        values.append(low + (k + 0.0371 * (1 + k % 3)) / count * (high - low))
    values.append(high)
    continuation.prepare(values)
    refinement = _AdaptiveRefinement(continuation, budget)
    for a, b in itertools.pairwise(values):
        refinement.refine(a, b)
    refinement.guesses += _meetings_at_end(continuation)
    refinement.locate_events()
    clusters = refinement.clusters()
    midpoints = _midpoints(continuation, clusters)
    counts = tuple(continuation.at(p).unstable_count for p in midpoints)
    result = SearchResult(tuple(clusters), counts, continuation)
    if not isinstance(continuation.system, System):
        return result
    return replace(result, doubts=tuple(_doubts(result, refinement.unresolved)))


def _affordable(rows: int) -> tuple[int, int]:
    """How many steps a search takes first, and how many values in all it may compute.

    rows: of the matrix A, as each value costs rows^3.
    """
    if rows <= 60:
        return STEPS, BUDGET
    if rows <= 150:
        return STEPS * 2 // 3, BUDGET // 4
    return STEPS * 5 // 12, BUDGET // 16


class _AdaptiveRefinement:
    """Steps along a continuation, divided until roots are matched, and the events found so far.

    Attributes
    ----------
    continuation : Continuation
        The system along its parameter.
    budget : int
        How many values it may compute.
    guesses : list of EventGuess
        Where events may be, not located yet.
    events : list of Event
        Those located so far, each once, by rising value.
    located : list of Event
        All located so far: also those that may be one of `events` again, or its twin.
    unresolved : bool
        Whether the budget ended with roots of a step unmatched, or a factor is too bent in a step.
    """

    def __init__(self, continuation: Continuation, budget: int) -> None:
        self.continuation = continuation
        self.budget = budget
        self.range = continuation.high - continuation.low
        # events closer than this coincide
        self.merge_distance = 4 * EVENT_TOLERANCE * self.range
        self.guesses: list[EventGuess] = []
        self.events: list[Event] = []
        self.located: list[Event] = []
        self.unresolved = False
        self.factors = factors_of(continuation.system)

    def refine(self, low: float, high: float, depth: int = DEPTH) -> None:
        """Match all roots from low to high, in steps as short as that takes, and collect guesses.

        The step from low to high is divided, and both parts are refined, if roots are not matched,
        if a factor bends too much, or if more than two roots interact; `depth` is how often it may
        still be divided.
        """
        continuation = self.continuation
        before = continuation.at(low)
        after = continuation.at(high)
        step = Step(before, after)
        starts_range = low == continuation.low
        ends_range = high == continuation.high
        # division: the share of the step at which to divide it, None if all roots are matched
        guesses, division = guesses_of(step, starts_range, ends_range)
        meetings = list(near_coalescences(before, after))
        is_bent = any(bends_within(continuation, step, factor) for factor in self.factors)
        # one pair gives two meetings at most, one seen from each end: these are of several pairs
        crowded = len(meetings) > 2 or is_crowded(step)
        budget = float(self.budget)
        if crowded and division is None:
            budget /= 2  # the other half is left for steps whose roots are not matched
        is_spent = len(continuation.spectra) >= budget
        if is_bent or crowded:
            division = DIVISION_SHARE
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
                self.guesses += window_guesses(continuation, meeting, length=high - low)
            if len(self.guesses) == count and continuation.problem is not DAMPED:
                # near a third root a wrong pair may have been examined: `_counts_agree_outside`
                # then finds the count at this spectrum
                continuation.at(meeting.value)

    def locate_events(self) -> None:
        """Add the events to which the guesses lead to `located` and `events`; empty the guesses.

        Events of one frequency and direction whose intervals touch may be one: only the first is
        added to `events`.
        """
        for guess in self.guesses:
            event = locate_event(self.continuation, guess)
            # so near to the start of the range rounding may have moved it from there
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
        """The event, moved to the start of the range if its root lies on the line there.

        None if that root decays from the start on: it crosses nothing within the range.
        """
        continuation = self.continuation
        low = continuation.low
        if event.interval[0] > low or not _rests_at_start(continuation, event.omega):
            return event
        return replace(event, value=low) if event.direction > 0 else None

    def clusters(self) -> list[tuple[Event, ...]]:
        """All events in clusters of coincident ones, by rising value.

        Missing events are searched for first, so that the events add up to the counts of growing
        roots between the clusters wherever that is possible. Events at the start of the range,
        whose roots lie on the line there, are a separate cluster.
        """
        continuation = self.continuation
        low = continuation.low
        midpoints = _midpoints(continuation, cluster_events(self.events, self.merge_distance))
        # the range is divided between the clusters, so that each part holds one. The last midpoint
        # may lie beyond the range, so that the last part holds an event at the end
        edges = [low, *midpoints[1:-1], max(midpoints[-1], continuation.high)]
        resolved: list[Event] = []
        for a, b in itertools.pairwise(edges):
            # an event that only the count shows may lie anywhere in its part: (a, b) once more
            resolved += self.resolve_events(a, b, (a, b))
        resolved.sort(key=lambda event: event.value)
        at_start = [event for event in resolved if event.value == low]
        others = [event for event in resolved if event.value != low]
        groups = cluster_events(others, self.merge_distance)
        if at_start:
            groups.insert(0, fastest_first(continuation, at_start))
        clusters: list[tuple[Event, ...]] = []
        intervals = itertools.pairwise(_midpoints(continuation, groups))
        for group, (a, b) in zip(groups, intervals, strict=True):
            clusters += self.split_cluster(group, a, b)
        return clusters

    def split_cluster(self, events: list[Event], a: float, b: float) -> list[tuple[Event, ...]]:
        """A cluster of events, divided between events where the counts of growing roots confirm it.

        Nearly coincident crossings of nearly equal subsystems so become separate clusters. a and b:
        values of the parameter below and above the cluster.
        """
        parts = []
        start = 0
        for k in range(1, len(events)):
            p = (events[k - 1].value + events[k].value) / 2
            # an event that may lie on either side of p is of neither part
            if any(event.interval[0] <= p <= event.interval[1] for event in events):
                continue
            below, between, above = (self.continuation.at(x).growing_roots for x in (a, p, b))
            lower_agree = counts_consistent(events[:k], below, between)
            if lower_agree and counts_consistent(events[k:], between, above):
                parts.append(tuple(events[start:k]))
                start = k
        return [*parts, tuple(events[start:])]

    def resolve_events(self, a: float, b: float, limits: Interval) -> list[Event]:
        """Events from a to b that explain the change of the number of growing roots, if possible.

        - If the events located so far explain it, they are returned. In a wide range the spectra
          below the first event and above the last one have to agree with the counts at a and b,
          too. They are also returned once the budget of spectra is used up.
        - If the range cannot be divided, each required crossing is taken from a located event,
          which may stand for several equal subsystems that cross at one value, or else from the
          count alone.
        - If all located events coincide, more are searched for close to them. If the count changes
          where they lie, and not next to them, equal subsystems are assumed to cross there.
        - Else the range is divided outside of the intervals of the events, and both parts are
          resolved.

        Parameters
        ----------
        a, b : float
            The range.
        limits : (float, float)
            The widest interval of an event that only the count shows.
        """
        continuation = self.continuation
        inside = [event for event in self.events if a <= event.value <= b]
        is_consistent = self._is_consistent(inside, a, b)
        is_coarse = b - a > self.range / 64  # a few of the first steps
        if is_consistent and (not is_coarse or self._counts_agree_outside(inside, a, b)):
            return inside
        division = self._division_point(a, b, inside)
        # `refine` stops at `budget` spectra; as many more are left for counts between events
        is_exhausted = len(continuation.spectra) > 2 * self.budget
        if is_exhausted or (is_consistent and division is None):
            return inside
        required = required_crossings(continuation.at(a), continuation.at(b))
        located = [self._located_event(crossing, a, b) for crossing in required]
        if division is None:
            events = []
            for crossing, located_event in zip(required, located, strict=True):
                event = located_event or self._event_from_count(crossing, a, b, limits)
                if event is not None:
                    events.append(event)
            return events
        coincide = bool(inside) and inside[-1].value - inside[0].value <= self.merge_distance
        if coincide and not is_consistent:
            rescanned = self._rescan_near(a, b, inside, limits)
            if rescanned is not None:
                return rescanned
            twins = [event for event in located if event is not None]
            if required and len(twins) == len(required):  # equal subsystems cross at one value
                return twins
        if is_coarse:  # within a finer range the steps were refined before
            self.refine(a, division)
            self.refine(division, b)
            self.locate_events()
        return [
            *self.resolve_events(a, division, limits),
            *self.resolve_events(division, b, limits),
        ]

    def _counts_agree_outside(self, events: list[Event], a: float, b: float) -> bool:
        """True if all spectra from a to the first event have as many growing roots as that at a,
        and all from the last event to b as many as that at b; without events all as that at a."""
        continuation = self.continuation
        first = last = b
        if events:
            first = events[0].value
            last = events[-1].value
        at_a = continuation.at(a).growing_roots
        at_b = continuation.at(b).growing_roots
        below_is_steady = _is_steady(continuation, a, first, at_a)
        return below_is_steady and _is_steady(continuation, last, b, at_b)

    def _is_consistent(self, events: list[Event], a: float, b: float) -> bool:
        """True if events from a to b explain the change of the number of growing roots."""
        below = self.continuation.at(a).growing_roots
        above = self.continuation.at(b).growing_roots
        if counts_consistent(events, below, above):
            return True
        # the count at the end of the range does not show yet what crosses there
        before_end = [event for event in events if event.interval[1] < b]
        return b == self.continuation.high and counts_consistent(before_end, below, above)

    def _rescan_near(
        self, a: float, b: float, inside: list[Event], limits: Interval
    ) -> list[Event] | None:
        """All events from a to b, after a finer search just below and above coincident ones.

        a, b, limits: as `resolve_events`; inside: the coincident events. None if the count changes
        nowhere but where these lie: then twins of them are missing, not crossings elsewhere.
        """
        continuation = self.continuation
        low, high = hull(inside)
        low = max(low, a)  # an interval may reach beyond the range, where nothing is evaluated
        high = min(high, b)
        persists_below = _count_persists(continuation, (low, high), a, side=-1)
        if persists_below and _count_persists(continuation, (low, high), b, side=1):
            return None
        # the events with a margin, as in `_count_persists`, are cut out of the range
        margin = CLEAR_WIDTHS * max(high - low, _resolution(low, high))
        before = max(low - margin, (a + low) / 2)
        after = min(high + margin, (high + b) / 2)
        cuts = [a, max(a, before), min(b, after), b]
        pieces = [(p, q) for p, q in itertools.pairwise(cuts) if p < q]
        for p, q in pieces:
            if not p <= low <= q:  # the piece of the coincident events was searched before
                self.refine(p, q)
        self.locate_events()
        resolved: list[Event] = []
        for p, q in pieces:
            resolved += self.resolve_events(p, q, limits)
        return resolved

    def _division_point(self, a: float, b: float, inside: list[Event]) -> float | None:
        """Where to divide the range from a to b: near the middle, or next to an event.

        It lies outside of the intervals of the events `inside`; None where there is no room for
        that. A value is passed over if rounding leaves its count uncertain and this count does not
        lie between those at a and b.
        """
        # the least distance of the point from the interval of an event, and from a and b
        clearance = max(1e-10 * self.range, _resolution(a, b))
        fewer, more = self._counts_at_ends(a, b)
        candidates = [a + DIVISION_SHARE * (b - a)]
        for event in inside:
            candidates += [event.interval[0] - clearance, event.interval[1] + clearance]
        for p in candidates:
            is_free = not any(
                event.interval[0] - clearance < p < event.interval[1] + clearance
                for event in inside
            )
            if not (is_free and a + clearance < p < b - clearance):
                continue
            spectrum = self.continuation.at(p)
            if spectrum.count_is_certain or fewer <= spectrum.growing_roots <= more:
                return p
        return None

    def _counts_at_ends(self, a: float, b: float) -> tuple[int, int]:
        """How many roots grow at a and at b, the smaller number first."""
        at_a = self.continuation.at(a).growing_roots
        at_b = self.continuation.at(b).growing_roots
        return min(at_a, at_b), max(at_a, at_b)

    def _located_event(self, crossing: RequiredCrossing, a: float, b: float) -> Event | None:
        """The located event from a to b of the frequency and direction of a required crossing.

        Of several it is the narrowest, with an interval that holds all: equal subsystems may cross
        there. None if there is none.
        """
        low = a - self.merge_distance
        high = b + self.merge_distance
        candidates = []
        for event in self.located:
            is_near = low <= event.value <= high
            if is_near and _has_frequency(
                event, crossing.omega, crossing.direction, ROOT_TOLERANCE
            ):
                candidates.append(event)
        if not candidates:
            return None
        narrowest = min(candidates, key=lambda event: event.width)
        return replace(narrowest, interval=hull(candidates))

    def _event_from_count(
        self, crossing: RequiredCrossing, a: float, b: float, limits: Interval
    ) -> Event | None:
        """An event that only the counts of growing roots at a and b show, for a required crossing.

        Its interval reaches to the nearest values below a and above b at which rounding leaves no
        doubt about the count, or fills the `limits`. None if the root decays from the start of the
        range on.
        """
        continuation = self.continuation
        direction = crossing.direction
        fewer, more = self._counts_at_ends(a, b)

        def sign(p: float) -> int:
            """-1 where p certainly lies below the event, 1 above it, 0 where that is uncertain."""
            least, most = continuation.at(p).count_bounds
            if most <= fewer:
                return -direction
            if least >= more:
                return direction
            return 0

        low, high = limits
        # values 1e-7 of the range away from a and b are tried first
        bracket = bracket_by_sign(sign, at=(a, b), half=1e-7 * self.range, low=low, high=high)
        if bracket is not None:
            low, high, _ = bracket
        interval = beyond_ends(continuation, low, high)
        value = min((a + b) / 2, continuation.high)  # b may lie a little beyond the range
        event = Event(value, crossing.omega, direction, interval, converged=False)
        return self.snap_to_range_start(event)


def _resolution(a: float, b: float) -> float:
    """The least distance, a few roundings, by which values from a to b are taken as different."""
    return 4 * float(np.spacing(max(abs(a), abs(b))))


def _has_frequency(event: Event, omega: float, direction: int, tolerance: float) -> bool:
    """True if an event has this direction and, up to a relative tolerance, this omega (rad/s)."""
    difference = abs(event.omega - omega)
    return event.direction == direction and difference <= tolerance * min(event.omega, omega)


def _is_same_event(event: Event, other: Event) -> bool:
    """True if two events have one frequency and direction, and intervals that touch."""
    return (
        _has_frequency(event, other.omega, other.direction, tolerance=1e-6)
        and event.interval[0] <= other.interval[1]
        and other.interval[0] <= event.interval[1]
    )


def hull(events: Sequence[Event]) -> Interval:
    """The least interval that holds those of all events."""
    lows = [event.interval[0] for event in events]
    highs = [event.interval[1] for event in events]
    return min(lows), max(highs)


def cluster_events(events: Sequence[Event], distance: float) -> list[list[Event]]:
    """Clusters of events by rising value: each lies within a distance of the one before it."""
    clusters: list[list[Event]] = []
    for event in events:
        if clusters and not event.value - clusters[-1][-1].value > distance:
            clusters[-1].append(event)
        else:
            clusters.append([event])
    return clusters


def _count_persists(
    continuation: Continuation, interval: Interval, limit: float, side: int
) -> bool:
    """True if on one side of an interval of events, close to it, as many roots grow as at a limit.

    Then no crossing is missing between the interval and the limit. Where that holds on both sides,
    crossings that the counts require and that are not among the events lie inside the interval, as
    those of nearly equal subsystems (twins). Roots are counted `CLEAR_WIDTHS` widths of the
    interval away from it, or further where rounding hides the count.

    Parameters
    ----------
    continuation : Continuation
        The system along its parameter.
    interval : (float, float)
        That of the events.
    limit : float
        The value on that side whose count is compared; no value beyond it is tried.
    side : int
        1 for the side above the interval, -1 for that below it.
    """
    low, high = interval
    start = high if side > 0 else low
    width = max(high - low, _resolution(low, high))
    # 1e5 widths are enough for the count to become certain, and a millionth of the range is little
    # enough that another event, which changes the count, hardly lies within it
    reach = max(1e5 * width, 1e-6 * (continuation.high - continuation.low))
    furthest = min(max(side * (limit - start), 0.0), reach)
    expected = continuation.at(limit).growing_roots
    distance = min(CLEAR_WIDTHS * width, furthest)
    spectrum = continuation.at(start + side * distance)
    while spectrum.growing_roots != expected:
        if spectrum.count_is_certain or not distance < furthest:
            return False
        distance = min(2 * distance, furthest)
        spectrum = continuation.at(start + side * distance)
    return True


def _midpoints(continuation: Continuation, clusters: Sequence[Sequence[Event]]) -> list[float]:
    """Values between neighbouring clusters, and one below the first and one above the last.

    If the last cluster lies at the end of the range, the value above it lies a little beyond the
    range, where the system may have no matrices: then it is the middle of what is left.
    """
    low = continuation.low
    high = continuation.high
    # where each interval between clusters begins and ends
    begins = [low, *(cluster[-1].value for cluster in clusters)]
    ends = [*(cluster[0].value for cluster in clusters), high]
    midpoints = [(a + b) / 2 for a, b in zip(begins, ends, strict=True)]
    if clusters and high - begins[-1] <= EVENT_TOLERANCE * (high - low):
        beyond = high + 1e-6 * (high - low)
        with suppress(InputError, ComputationError, ValueError, ArithmeticError):
            continuation.at(beyond)  # there may be none, beyond a fold
            midpoints[-1] = beyond
    return midpoints


def _meetings_at_end(continuation: Continuation) -> Iterator[EventGuess]:
    """Pairs of roots on the line that are one at the end of the range, as far as rounding tells."""
    spectrum = continuation.at(continuation.high)
    # real s below zero too: `locate_event` leaves out those that join without a crossing
    on_line = spectrum.z_is_real if spectrum.problem is UNDAMPED else spectrum.on_line
    for pair in np.argwhere(np.triu(on_line & on_line[:, None] & spectrum.close, 1)):
        yield meeting_at(spectrum, pair, width=1e-6 * (continuation.high - continuation.low))


def _rests_at_start(continuation: Continuation, omega: float) -> bool:
    """True if a root of this angular frequency neither grows nor decays at the start of the range.

    Without damping two have to: one that does not meet another cannot leave the line.
    """
    spectrum = continuation.at(continuation.low)
    if omega == 0.0:  # a real root, which passes zero
        return bool(np.any(np.abs(spectrum.z) <= spectrum.rounding))
    near = np.abs(spectrum.omegas - omega) <= ROOT_TOLERANCE * omega
    resting = near & spectrum.on_line
    if continuation.problem is DAMPED:
        return bool(resting.any())
    # each root is close to itself: more entries than roots mean that two are close
    return bool(spectrum.close[np.ix_(resting, resting)].sum() > resting.sum())


def fastest_first(continuation: Continuation, events: Sequence[Event]) -> list[Event]:
    """Coincident events in one direction, that of the fastest growing root first.

    The growth rates are those a little beyond the events, where the roots grow. Where that lies
    outside of the range the decay rates on the other side stand for them.
    """
    if len({event.omega for event in events}) < 2:
        return list(events)
    low = continuation.low
    high = continuation.high
    widest = max(event.width for event in events)
    # well beyond the intervals of the events, within a hundredth of the range
    distance = np.clip(1e3 * widest, 1e-5 * (high - low), 1e-2 * (high - low))
    offset = events[0].direction * float(distance)  # into the side on which the roots grow
    sign = 1.0
    if not low <= events[0].value + offset <= high:
        sign = -1.0  # the root that decays fastest inside grows fastest beyond the end
    spectrum = continuation.at(events[0].value + sign * offset)
    rates = sign * spectrum.exponents.real

    def rate(event: Event) -> float:
        """The largest rate (1/s) of a root of the event's frequency, -inf if none grows."""
        near = ROOT_TOLERANCE * max(event.omega, float(spectrum.omegas.min()))
        has_frequency = np.abs(spectrum.omegas - event.omega) <= near
        return float(np.max(rates[has_frequency & (rates > 0)], initial=-np.inf))

    return sorted(events, key=rate, reverse=True)


def _is_steady(continuation: Continuation, low: float, high: float, growing: int) -> bool:
    """True if as many roots as `growing` grow in each spectrum from low to high, to rounding."""
    for spectrum in continuation.spectra:
        if low < spectrum.value < high:
            least, most = spectrum.count_bounds
            if not least <= growing <= most:
                return False
    return True


def _doubts(result: SearchResult, is_unresolved: bool) -> Iterator[str]:
    """Sentences on what may be wrong with the events of a search, as far as the search can tell.

    is_unresolved: whether the search could not divide a step as often as it required.
    """
    continuation = result.continuation
    counts = result.unstable_counts  # below the first cluster, between them, above the last
    if is_unresolved:
        yield "the search ran out of values, or a factor bends too much between two of them"
    if continuation.hidden:
        yield f"rounding hides {continuation.hidden} of the roots"
    widest = WIDEST_INTERVAL * (continuation.high - continuation.low)
    for k, cluster in enumerate(result.clusters):
        if not counts_consistent(cluster, counts[k].growing_roots, counts[k + 1].growing_roots):
            yield f"what grows changes otherwise than by what crosses at {cluster[0].value:.9g}"
        for event in cluster:
            if event.width > widest:
                yield f"the crossing at {event.value:.9g} has the wide interval {event.interval}"
