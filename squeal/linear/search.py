"""All events between two values of a parameter, and what shows whether one is missing.

Steps of the continuation give guesses, which are located. What grows is counted halfway between
neighbouring events. Where the count does not follow from what was located the range there is
halved and searched again, until the events add up or what remains is known by the count alone.

A search is certified if a second count, by the sign function of the matrix, agrees
between all events, if what grows at every value looked at follows from them, if every interval is
narrow, and if all factors of the terms are resolved: their second derivatives, bounded over each
step by interval arithmetic, leave roots no room for what the step does not see, however close they
come. Of a plain function nothing is known between the values, and nothing certified.
"""

import itertools
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.errors import ComputationError, InputError
from squeal.linear.continuation import (
    Continuation,
    ContinuationOptions,
    Guess,
    State,
    Step,
    may_swap,
    near_coalescences,
)
from squeal.linear.eigen import UnstableCount, hidden
from squeal.linear.events import Event, certain, guesses_of, located, windows
from squeal.linear.matrices import Change, dense, norm_of, reduce
from squeal.linear.system import Slow, SystemFunction, TermSystem, matrices_of


def difference(below: State, above: State) -> Iterator[tuple[float, int]]:
    """Frequency (0 of a real root) and direction of what has to cross between two values: of the
    pairs those that are farthest from any that grows on the other side."""
    # of two divergent roots that join to a growing pair, or come from one, nothing crosses
    a, b = below.growth, above.growth
    pairs, reals = b.pairs - a.pairs, b.reals - a.reals
    joined = min(abs(pairs), abs(reals) // 2) * int(np.sign(pairs)) if pairs * reals < 0 else 0
    pairs, reals = pairs - joined, reals + 2 * joined
    more, less = (above, below) if pairs > 0 else (below, above)
    here, there = ([float(s.omegas[k]) for k in s.growing[0]] for s in (more, less))
    for omega in there[: max(len(here) - abs(pairs), 0)]:
        here.remove(min(here, key=lambda own: abs(own - omega)))
    omegas = (here + [0.0] * abs(pairs))[: abs(pairs)]
    yield from ((omega, int(np.sign(pairs))) for omega in omegas)
    yield from ((0.0, int(np.sign(reals))) for _ in range(abs(reals)))


def explained(place: Sequence[Event], a: UnstableCount, b: UnstableCount) -> bool:
    """True if the events of a place add up to the change of what grows, but for divergent roots
    that join to a growing pair, or come from one, and cross nothing."""
    return b.roots - a.roots == sum(c.direction * (2 if c.omega else 1) for c in place)


@dataclass(frozen=True)
class Searched:
    """Events by rising parameter, in groups at one place, and what grows between these places."""

    places: tuple[tuple[Event, ...], ...]
    growths: tuple[UnstableCount, ...]
    line: Continuation = field(repr=False)
    doubts: tuple[str, ...] | None = None  # why it is not certified; None where that is not asked

    @property
    def edges(self) -> list[float]:
        """The values between which `growths` are: the ends of the range and the places."""
        return [self.line.low, *(place[0].value for place in self.places), self.line.high]


def search(
    system: SystemFunction, low: float, high: float, options: ContinuationOptions | None = None
) -> Searched:
    """All events for low <= p <= high."""
    options = options or ContinuationOptions()
    along = Continuation(system, low, high, options)
    rows = along.size
    fewer, cheaper = (1, 1) if rows <= 60 else (2 / 3, 4) if rows <= 150 else (5 / 12, 16)
    walk = _Walk(along, options.budget // cheaper)
    count = max(int(options.steps * fewer), 2)
    # values that thresholds do not like to lie at
    inner = [(k + 0.0371 * (1 + k % 3)) / count for k in range(1, count)]
    values = [low, *(low + x * (high - low) for x in inner), high]
    along.prepare(values)
    for a, b in itertools.pairwise(values):
        walk.go(a, b, options.depth)
    walk.guesses += _meetings_at_end(along.at(high), 1e-6 * (high - low))
    walk.locate()
    places = walk.places()
    middles = _middles(along, places)
    growths = tuple(along.at(p).growth for p in middles)
    found = Searched(tuple(places), growths, along)
    if not isinstance(system, TermSystem):
        return found
    counts = [sign_count(along, p) for p in middles]
    doubts = ["the search ran out of values; a narrower range needs fewer"] * walk.unresolved
    return replace(found, doubts=(*doubts, *_doubts(found, middles, counts)))


class _Walk:
    """Steps along a continuation with a budget of values, the events `events` so far, and whether
    the budget left a step `unresolved`: with roots unmatched or a factor too bent."""

    def __init__(self, along: Continuation, budget: int) -> None:
        self.along, self.budget = along, budget
        self.wide = along.high - along.low
        self.near = 4 * along.options.same * self.wide
        self.guesses: list[Guess] = []
        self.events: list[Event] = []
        self.located: list[Event] = []  # also what may be one of the events again, or its twin
        self.unresolved = False
        self.factors = _factors(along.system)

    def go(self, low: float, high: float, depth: int) -> None:
        """Match all roots from low to high and collect what may cross the line."""
        along = self.along
        step = Step(along.at(low), along.at(high), along.options)
        guesses, share = guesses_of(step, (low == along.low, high == along.high))
        met = list(near_coalescences(step.a, step.b))
        bent = any(_bent(along, step, factor) for factor in self.factors)
        # other roots decide, or two windows are near; half the budget is left for matches
        several = len(met) > 2 or any(one.doubtful for one in met) or may_swap(step.a, step.b)
        spent = len(along.states) >= self.budget / (2 if several and share is None else 1)
        divide = along.options.aside if bent or several else share
        if divide is not None and depth > 0 and not spent:
            middle = low + divide * (high - low)
            if low < middle < high:
                self.go(low, middle, depth - 1)
                self.go(middle, high, depth - 1)
                return
        self.unresolved |= bent or (divide is not None and spent)
        self.guesses += guesses
        for one in met:
            before = len(self.guesses)
            with suppress(np.linalg.LinAlgError):
                self.guesses += windows(along, one, high - low)
            if len(self.guesses) == before and along.form != "damped":
                along.at(one.value)  # near a third root another pair may have been taken

    def locate(self) -> None:
        """Add what the guesses lead to; intervals that touch may be of one event."""
        for guess in self.guesses:
            one = located(self.along, guess)
            if one is not None and one.value - self.along.low <= 1e-6 * self.wide:
                one = self.from_start(one)
            if one is None:
                continue
            self.located.append(one)
            if not any(
                _alike(one, other.omega, other.direction, 1e-6)
                and one.interval[0] <= other.interval[1]
                and other.interval[0] <= one.interval[1]
                for other in self.events
            ):
                self.events.append(one)
        self.guesses.clear()
        self.events.sort(key=lambda c: c.value)

    def from_start(self, one: Event) -> Event | None:
        """An event, at the start if rounding leaves that; none if decay begins from rest there."""
        along = self.along
        if one.interval[0] > along.low or not _quiet(along, one.omega):
            return one
        return replace(one, value=along.low) if one.direction > 0 else None

    def places(self) -> list[tuple[Event, ...]]:
        """Events that add up to what grows between them, as far as can be, by places."""
        along = self.along
        middles = _middles(along, together(self.events, self.near))
        edges = [along.low, *middles[1:-1], max(middles[-1], along.high)]
        settled = [one for a, b in itertools.pairwise(edges) for one in self._settled(a, b, (a, b))]
        settled.sort(key=lambda c: c.value)
        start = fastest_first(along, [one for one in settled if one.value == along.low])
        rest = together([one for one in settled if one.value != along.low], self.near)
        groups = [group for group in (start, *rest) if group]
        between = zip(groups, itertools.pairwise(_middles(along, groups)), strict=True)
        return [tuple(part) for group, ends in between for part in self._parted(group, *ends)]

    def _parted(self, group: list[Event], a: float, b: float) -> list[list[Event]]:
        """Events of one place between a and b, in groups between which the counts agree."""
        along, cuts = self.along, [0]
        for k in range(1, len(group)):
            p = (group[k - 1].value + group[k].value) / 2
            if not any(c.interval[0] <= p <= c.interval[1] for c in group):
                ends = [along.at(x).growth for x in (a, p, b)]
                agree = map(explained, (group[:k], group[k:]), ends, ends[1:])
                cuts += [k] * (all(agree) and sign_count(along, p) == ends[1].roots)
        return [group[i:j] for i, j in itertools.pairwise([*cuts, len(group)])]

    def _settled(self, a: float, b: float, ends: tuple[float, float]) -> list[Event]:
        """Events from a to b that add up to the change of what grows, intervals within `ends`."""
        along = self.along
        inside = [one for one in self.events if a <= one.value <= b]
        before, after = along.at(a).growth, along.at(b).growth
        done, coarse = explained(inside, before, after), b - a > self.wide / 64
        if b == along.high:  # what crosses there is not seen beyond it
            done |= explained([one for one in inside if one.interval[1] < b], before, after)
        first, last = (inside[0].value, inside[-1].value) if inside else (b, b)
        if done and (
            not coarse or (_steady(along, a, first, before) and _steady(along, last, b, after))
        ):
            return inside
        changes = list(difference(along.at(a), along.at(b)))
        middle, close = self._middle(a, b, inside), bool(inside) and last - first <= self.near
        if len(along.states) > 2 * self.budget or (done and middle is None):
            return inside  # and the search is not certified
        if close and not done and middle is not None:
            # what crosses elsewhere is no twin of what was located
            low, high = hull(inside)
            if not _outside(along, (low, high), (a, b), before, after):
                off = 16 * max(high - low, 4 * float(np.spacing(max(abs(low), abs(high)))))
                below, above = max(low - off, (a + low) / 2), min(high + off, (high + b) / 2)
                cuts = [a, max(a, below), min(b, above), b]
                pieces = [(p, q) for p, q in itertools.pairwise(cuts) if p < q]
                for p, q in pieces:
                    if not p <= low <= q:
                        self.go(p, q, along.options.depth)
                self.locate()
                return [one for p, q in pieces for one in self._settled(p, q, ends)]
        if middle is None or (close and changes and not done):
            known = [
                self._alike(*change, a - self.near, b + self.near)
                or (self._by_count(*change, a, b, ends) if middle is None else None)
                for change in changes
            ]
            if middle is None or all(known):  # of equal subsystems, all at one place
                return [one for one in known if one]
        if coarse:
            self.go(a, middle, along.options.depth)
            self.go(middle, b, along.options.depth)
            self.locate()
        return [*self._settled(a, middle, ends), *self._settled(middle, b, ends)]

    def _middle(self, a: float, b: float, inside: list[Event]) -> float | None:
        """Where to halve, beside the intervals of events; None where there is no room for that."""
        least = max(1e-10 * self.wide, 4 * float(np.spacing(max(abs(a), abs(b)))))
        tried = [a + self.along.options.aside * (b - a)]
        tried += [one.interval[k] + way * least for one in inside for k, way in ((0, -1), (1, 1))]
        for p in tried:
            free = all(not c.interval[0] - least < p < c.interval[1] + least for c in inside)
            if a + least < p < b - least and free:
                return p
        return None

    def _alike(self, omega: float, way: int, low: float, high: float) -> Event | None:
        """The located event of that frequency and direction between low and high; it may stand for
        twins, and its interval holds all that are alike."""
        near, inside = self.along.options.near, (c for c in self.located if low <= c.value <= high)
        alike = [one for one in inside if _alike(one, omega, way, near)]
        ends = [end for one in alike for end in one.interval]
        first = min(alike, key=lambda one: one.width, default=None)
        return first and replace(first, interval=(min(ends), max(ends)))

    def _by_count(
        self, omega: float, way: int, a: float, b: float, ends: tuple[float, float]
    ) -> Event | None:
        """An event between a and b of which only the count tells, and beside which it is sure."""
        along = self.along
        fewer, more = sorted(along.at(p).growth.roots for p in (a, b))

        def sign(p: float) -> int:
            least, most = along.at(p).bounds
            return -way if most <= fewer else way * (least >= more)

        low, high = (certain(sign, (a, b), 1e-7 * self.wide, *ends) or ends)[:2]
        return self.from_start(Event((a + b) / 2, omega, way, (low, high), converged=False))


class _Factor(NamedTuple):
    """A factor of terms: a bound of its second derivative over an interval, its first derivative,
    and what it multiplies."""

    curvature: Callable[[float, float], float]
    slope: Callable[[float], float]
    change: Change


def _factors(system: SystemFunction) -> list[_Factor]:
    if not isinstance(system, TermSystem):
        return []
    name, values = system.parameter, system.values()
    formulas = {term.factor.text: term.factor for term in system.terms}.values()

    def multiplied(text: str) -> Change:
        zero = np.zeros((system.n, system.n))
        M, C, K = (
            sum((dense(t.matrix) for t in terms if t.factor.text == text), zero)
            for terms in system.parts
        )
        return M, C, K

    return [
        _Factor(
            partial(f.curvature, values, name),
            lambda p, f=f: abs(f.slope(values | {name: p}, name)),  # type: ignore[misc]
            multiplied(f.text),
        )
        for f in formulas
        if name in f.names
    ]


def _bent(along: Continuation, step: Step, factor: _Factor) -> bool:
    """True if a factor bends so much within a step that roots may do what its ends do not tell.

    One that is monotone and nearly straight moves the roots as a straight one does. Else it may be
    off by bend step^2 / 8, which is held against what is left of the gaps between roots.
    """
    ends, wide = (step.a, step.b), step.b.value - step.a.value
    bend = factor.curvature(step.a.value, step.b.value)
    if not bend < np.inf:
        return True
    if 4 * bend * wide <= min(factor.slope(state.value) for state in ends):
        return False
    off = bend * wide**2 / 8
    return any(_reaches(state, along.couplings(state, factor.change), off) for state in ends)


def _reaches(state: State, W: NDArray, off: float) -> bool:
    """True if a factor that is off by so much, and couples the roots by W (m, m), could let two
    roots meet on the line, or one cross it. What does so at the state itself is seen there."""
    z, own = state.roots, W.diagonal()
    apart = np.abs(z[:, None] - z)
    pull = off * (np.abs(own[:, None] - own) + 2 * np.sqrt(np.abs(W * W.T)))
    if state.form == "damped":
        swept = np.sqrt(np.where(4 * pull > apart, apart * pull, 0.0)).max(axis=1)
        left = np.abs(z.real)
        return bool(np.any(2 * (off * np.abs(own.real) + swept) > left, where=~state.on_line))
    conjugate = np.abs(z[:, None] - z.conj()) <= np.add.outer(state.rounding, state.rounding)
    pairs = (state.on_line[:, None] & state.on_line) | conjugate
    meet = pairs & ~state.close & (4 * pull > apart)
    zero = state.real & (np.abs(z) > state.rounding) & (state.form == "undamped")
    return bool(meet.any() or np.any(2 * off * np.abs(own) > np.abs(z), where=zero))


def _alike(one: Event, omega: float, way: int, near: float) -> bool:
    return one.direction == way and abs(one.omega - omega) <= near * min(one.omega, omega)


def hull(events: Sequence[Event]) -> tuple[float, float]:
    """The least interval that holds those of all events."""
    return min(one.interval[0] for one in events), max(one.interval[1] for one in events)


def together(items: Sequence[Event], near: float) -> list[list[Event]]:
    """Events by rising value, those that are no further than `near` from the one before with it."""
    starts = [
        k for k, (a, b) in enumerate(itertools.pairwise(items), 1) if b.value - a.value > near
    ]
    cuts = itertools.pairwise([0, *starts, len(items)])
    return [list(items[a:b]) for a, b in cuts if items]


def _outside(
    along: Continuation,
    ends: tuple[float, float],
    room: tuple[float, float],
    *growths: UnstableCount,
) -> bool:
    """True if just outside of an interval what grows is what is expected below and above it: 16
    widths away, or further where rounding hides it, within the room."""
    low, high = ends
    width = max(high - low, 4 * float(np.spacing(max(abs(low), abs(high)))))
    sides = (low, -1, room[0]), (high, 1, room[1])
    for (end, way, last), growth in zip(sides, growths, strict=True):
        most = min(max(way * (last - end), 0.0), max(1e5 * width, 1e-6 * (along.high - along.low)))
        step = min(16 * width, most)
        state = along.at(end + way * step)
        while state.growth.roots != growth.roots and not state.sure and step < most:
            step = min(2 * step, most)
            state = along.at(end + way * step)
        if state.growth.roots != growth.roots:
            return False
    return True


def _middles(along: Continuation, places: Sequence[Sequence[Event]]) -> list[float]:
    """A value between neighbouring places, and beyond the first and the last."""
    low, high = along.low, along.high
    ends = [low, *(p[-1].value for p in places)], [*(p[0].value for p in places), high]
    middles = [(a + b) / 2 for a, b in zip(*ends, strict=True)]
    if places and high - places[-1][-1].value <= along.options.same * (high - low):
        beyond = high + 1e-6 * (high - low)
        with suppress(InputError, ComputationError, ValueError, ArithmeticError):
            along.at(beyond)  # there may be none, beyond a fold
            middles[-1] = beyond
    return middles


def _meetings_at_end(state: State, width: float) -> Iterator[Guess]:
    """Pairs of roots on the line that are one at the end of the range, as far as rounding tells."""
    on = state.real if state.form == "undamped" else state.on_line
    for pair in np.argwhere(np.triu(on & on[:, None] & state.close, 1)):
        right, left = state.right[:, pair], state.left[:, pair]
        yield Guess(state.value, complex(state.roots[pair].mean()), right, left, True, width)


def _quiet(along: Continuation, omega: float) -> bool:
    """True if a root of this frequency is on the line at the start, two of them without damping."""
    state = along.at(along.low)
    if not omega:
        return bool(np.any(np.abs(state.roots) <= state.rounding))
    on = (np.abs(state.omegas - omega) <= along.options.near * omega) & state.on_line
    if along.form == "damped":
        return bool(on.any())
    return bool(state.close[np.ix_(on, on)].sum() > on.sum())


def fastest_first(along: Continuation, place: Sequence[Event]) -> list[Event]:
    """Events at one place in one direction, by their growth rates close to it."""
    if len({one.omega for one in place}) < 2:
        return list(place)
    wide, hidden_by = along.high - along.low, max(one.width for one in place)
    aside = place[0].direction * float(np.clip(1e3 * hidden_by, 1e-5 * wide, 1e-2 * wide))
    inside = along.low <= place[0].value + aside <= along.high
    way = 1.0 if inside else -1.0  # at an end what decays fastest inside grows fastest beyond
    state = along.at(place[0].value + way * aside)
    rates = way * state.exponents.real

    def rate(one: Event) -> float:
        near = along.options.near * max(one.omega, float(state.omegas.min()))
        own = np.abs(state.omegas - one.omega) <= near
        return float(np.max(rates[own & (rates > 0)], initial=-np.inf))

    return sorted(place, key=rate, reverse=True)


# The certificate


def _steady(along: Continuation, low: float, high: float, growth: UnstableCount) -> bool:
    """True if at each state between low and high as many roots grow, as far as rounding tells."""
    inside = (state.bounds for state in along.states if low < state.value < high)
    return all(least <= growth.roots <= most for least, most in inside)


def _doubts(
    found: Searched, middles: Sequence[float], counts: Sequence[int | None]
) -> Iterator[str]:
    """Where counts and states do not agree with the events, and where rounding or a wide interval
    may hide a root, in words."""
    along, places, growths = found.line, found.places, found.growths
    room = along.options.wide * (along.high - along.low)
    sides = itertools.pairwise(middles), itertools.pairwise(growths)
    for place, gap, beside in zip(places, *sides, strict=True):
        if not _outside(along, hull(place), gap, *beside):
            yield f"what grows beside {place[0].value:.9g} is not what the crossings there leave"
    last = [along.low, *(place[-1].value for place in places)]
    between = zip(last, itertools.pairwise(found.edges), growths, counts, strict=True)
    for start, (a, b), growth, n in between:
        if n != growth.roots:
            yield f"a second count of what grows disagrees between {a:.9g} and {b:.9g}"
        if not _steady(along, start, b, growth):
            yield f"what grows varies between {a:.9g} and {b:.9g} without a crossing"
    for place, ends in zip(places, itertools.pairwise(growths), strict=True):
        if not explained(place, *ends):
            yield f"what grows changes otherwise than by what crosses at {place[0].value:.9g}"
        for c in (c for c in place if c.width > room):
            yield f"the crossing at {c.value:.9g} has the wide interval {c.interval}"
    if _undecided(along, places):
        yield "rounding does not tell on which side of the axis some root lies"
    for p in (p for p in (along.low, along.high) if _hides(along, p)):
        yield f"rounding leaves slow roots too few digits at {p:.9g}"


def _undecided(along: Continuation, places: Sequence[Sequence[Event]]) -> bool:
    """True if away from all events rounding does not tell on which side of the axis a root is."""
    if along.form != "damped":  # a spectrum that is symmetric about the axis has roots on it
        return False
    margin = 1e-6 * (along.high - along.low)
    taken = [(c.interval[0] - margin, c.interval[1] + margin) for p in places for c in p]
    return any(
        np.any(state.on_line & (np.abs(state.roots) > state.rounding))
        for state in along.states
        if along.low < state.value < along.high
        and not any(low <= state.value <= high for low, high in taken)
    )


def _hides(along: Continuation, p: float) -> bool:
    """True if rounding leaves the slow roots at p too few digits, see `eigen.hidden`."""
    if isinstance(along.system, Slow):
        return False
    ((M, C, K),) = matrices_of(along.system, [p])
    with suppress(InputError):  # M is not symmetric
        return hidden(reduce(M, C, K), C, K)
    return False


def sign_count(along: Continuation, p: float) -> int | None:
    """How many roots grow at p by more than rounding, by the sign function; None if unsettled.

    The sign function of A - x has the eigenvalue +1 for each root right of x and -1 for each other,
    so that its trace counts them. Newton's iteration S <- (c S + (c S)^-1) / 2 converges
    quadratically; the scaling c = |det S|^(-1/n) speeds its start (Byers 1987).
    """
    state, A = along.at(p), along.both(p)[0]
    rates, noise = state.roots.real, state.rounding
    if along.form == "undamped":  # the roots of the first-order form
        unit = float(np.sqrt(norm_of(A))) or 1.0
        half, noise = state.exponents.real / unit, np.sqrt(noise) / unit
        rates, noise = np.concatenate([half, -half]), np.tile(noise, 2)
        zero, eye = np.zeros_like(A), np.eye(len(A))
        A = np.block([[zero, eye], [-A / unit**2, zero]])
    elif along.form == "gyroscopic":
        rates, A = -state.roots.imag, (1j * A).real
    quiet = rates <= noise
    least = float(np.min(rates[~quiet], initial=np.inf))
    most = max(float(np.max(rates[quiet], initial=0.0)), float(np.max(noise, initial=0.0)))
    if not np.isfinite(least):
        least = max(1e3 * most, 1e-6)
    floor = least / 8 if least > 64 * most else np.sqrt(max(most, 1e-16) * least)
    n = len(A)
    S, factor, change = A - floor * np.eye(n), 1.0, np.inf
    with np.errstate(all="ignore"), suppress(np.linalg.LinAlgError):
        for _ in range(60):
            other = np.linalg.inv(S)
            factor = float(np.exp(-np.linalg.slogdet(S)[1] / n)) if change > 1e-2 else 1.0
            new = (factor * S + other / factor) / 2
            change = float(np.linalg.norm(new - S, 1) / np.linalg.norm(new, 1))
            S = new
            if not change >= 1e-5:  # the next step would leave its square
                break
        number = (float(np.trace(S)) + n) / 2
        settled = change < 1e-5 and abs(number - round(number)) < 1e-3
        return round(number) if settled else None
    return None
