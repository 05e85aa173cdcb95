"""All events between two values of a parameter, and what shows whether one is missing.

Steps of the continuation give guesses, which are located. What grows is counted halfway between
neighbouring events. Where the count does not follow from what was located the range there is
halved and searched again, until the events add up or what remains is known by the count alone.

A search is certified if a second counter, the sign function of the matrix by default, agrees
between all events, if what grows at every value looked at follows from them, if every interval is
narrow, and if all factors of the terms are resolved: their second derivatives, bounded over each
step by interval arithmetic, leave them no room for what the step does not see. Of a plain function
nothing is known between the values, and nothing certified.
"""

import itertools
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from squeal.errors import ComputationError, InputError
from squeal.linear.continuation import (
    Bools,
    ComplexArray,
    Continuation,
    ContinuationOptions,
    Guess,
    State,
    Step,
)
from squeal.linear.eigen import UnstableCount, hidden
from squeal.linear.events import Event, certain, guesses_of, located, windows
from squeal.linear.matrices import checked, norm_of, reduce
from squeal.linear.system import Slow, System, TermSystem, dense

Counter = Callable[[Continuation, float], int | None]
"""(continuation, p) -> how many roots grow at p (two for a pair), None if it cannot tell."""


def grows(state: State) -> Bools:
    """Roots that grow by more than rounding, of a pair both."""
    z, rounding = state.roots, state.rounding
    if state.form == "undamped":
        return np.asarray(~state.real | (z.real < -rounding))
    return np.asarray((z.real if state.form == "damped" else -z.imag) > rounding)


def growing(along: Continuation, p: float) -> tuple[Bools, Bools]:
    """Roots that grow at p, of a pair the upper one, and which of them are one of a pair."""
    state = along.at(p)
    z, rounding = state.roots, state.rounding
    across = z.real if state.form == "gyroscopic" else z.imag
    pairs = across > rounding
    real = state.real if state.form == "undamped" else np.abs(across) <= rounding
    return grows(state) & (pairs | real), pairs


def growth_at(along: Continuation, p: float) -> UnstableCount:
    """What grows at p by more than rounding."""
    some, pairs = growing(along, p)
    rates = np.abs(along.exponents(along.at(p).roots).real)
    return UnstableCount.of(rates, some & pairs, some & ~pairs)


def growing_pairs(along: Continuation, p: float) -> list[float]:
    """Angular frequencies (rad/s) of the pairs that grow at p, the fastest growing first."""
    some, pairs = growing(along, p)
    z = along.at(p).roots[some & pairs]
    order = np.argsort(-np.abs(along.exponents(z).real))
    return [along.omega(complex(one)) for one in z[order]]


def _bounds(along: Continuation, p: float) -> tuple[int, int]:
    """At least and at most how many roots (two for a pair) grow at p, rounding considered."""
    state = along.at(p)
    z, rounding = state.roots, 2 * state.rounding  # those of two that are close, see `State.close`
    if along.form == "damped":
        return int(np.sum(z.real > rounding)), int(np.sum(z.real > -rounding))
    near = state.close.sum(axis=1) > 1
    if along.form == "gyroscopic":
        sure = z.imag < -rounding
        return int(np.sum(sure)), int(np.sum(sure | near))
    # each complex s and each negative one gives a growing root
    sure = (np.abs(z.imag) > rounding) | (z.real < -rounding)
    return int(np.sum(sure)), int(np.sum(sure | near | (z.real < rounding)))


Place = tuple[Continuation, float]


def difference(below: Place, above: Place) -> Iterator[tuple[float, int]]:
    """Frequency (0 of a real root) and direction of what has to cross between two values: of the
    pairs those that are farthest from any that grows on the other side."""
    # of two divergent roots that join to a growing pair, or come from one, nothing crosses
    a, b = growth_at(*below), growth_at(*above)
    pairs, reals = b.pairs - a.pairs, b.reals - a.reals
    joined = min(abs(pairs), abs(reals) // 2) * int(np.sign(pairs)) if pairs * reals < 0 else 0
    pairs, reals = pairs - joined, reals + 2 * joined
    here, there = (growing_pairs(*at) for at in ((above, below) if pairs > 0 else (below, above)))
    for omega in there[: max(len(here) - abs(pairs), 0)]:
        here.remove(min(here, key=lambda own: abs(own - omega)))
    omegas = (here + [0.0] * abs(pairs))[: abs(pairs)]
    yield from ((omega, int(np.sign(pairs))) for omega in omegas)
    yield from ((0.0, int(np.sign(reals))) for _ in range(abs(reals)))


def explained(place: Sequence[Event], a: UnstableCount, b: UnstableCount) -> bool:
    """True if the events of a place add up to the change of what grows."""
    pairs, reals = (
        sum(c.direction for c in place if c.kind == k) for k in ("flutter", "divergence")
    )
    # two divergent roots join to a growing pair, or come from one, and cross nothing
    joined = b.pairs - a.pairs - pairs
    return bool(b.reals - a.reals - reals == -2 * joined)


@dataclass(frozen=True)
class Stretch:
    """What grows between two neighbouring events, and how much a second counter says."""

    low: float
    high: float
    growth: UnstableCount
    counted: int | None  # growing roots, two for a pair


@dataclass(frozen=True)
class Searched:
    """Events by rising parameter, in groups at one place, and the stretches between them."""

    places: tuple[tuple[Event, ...], ...]
    stretches: tuple[Stretch, ...]
    certified: bool | None
    line: Continuation = field(repr=False)


def search(
    system: System,
    low: float,
    high: float,
    options: ContinuationOptions | None = None,
    counter: Counter | None = None,
) -> Searched:
    """All events for low <= p <= high; `counter` counts again, `sign_count` if none is given."""
    options = options or ContinuationOptions()
    along = Continuation(system, low, high, options)
    by_terms = isinstance(system, TermSystem)
    rows = along.size
    fewer = 1 if rows <= 60 else 2 / 3 if rows <= 150 else 5 / 12
    budget = options.budget if rows <= 60 else options.budget // (4 if rows <= 150 else 16)
    walk = _Walk(along, budget)
    count = max(int(options.steps * fewer), 2)
    # values that thresholds do not like to lie at
    inner = [(k + 0.0371 * (1 + k % 3)) / count for k in range(1, count)]
    values = [low, *(low + x * (high - low) for x in inner), high]
    along.prepare(values)
    for a, b in itertools.pairwise(values):
        walk.go(a, b, options.depth)
    walk.guesses += _meetings_at_end(along)
    walk.locate()
    places = walk.places()
    middles = _middles(along, places)
    at = [low, *(p[0].value for p in places), high]
    stretches = tuple(
        Stretch(*ends, growth_at(along, p), (counter or sign_count)(along, p) if by_terms else None)
        for ends, p in zip(itertools.pairwise(at), middles, strict=True)
    )
    certified = None
    if by_terms:
        certified = not walk.unresolved and _agrees(along, places, stretches)
    return Searched(tuple(places), stretches, certified, along)


class _Walk:
    """Steps along a continuation with a budget of values, the events `events` so far, and steps
    that the budget left `unresolved`: with roots unmatched or a factor too bent."""

    def __init__(self, along: Continuation, budget: int) -> None:
        self.along, self.budget = along, budget
        self.wide = along.high - along.low
        self.guesses: list[Guess] = []
        self.events: list[Event] = []
        self.unresolved: list[tuple[float, float]] = []
        self.factors = _factors(along.system, along.low, along.high)

    def go(self, low: float, high: float, depth: int) -> None:
        """Match all roots from low to high and collect what may cross the line."""
        along = self.along
        step = Step.of(along.at(low), along.at(high), along.options)
        guesses, share = guesses_of(step, along.form, (low == along.low, high == along.high))
        most = 8 * along.options.resolved / (high - low) ** 2
        bent = any(not bend(low, high) <= most * size for bend, size in self.factors)
        # half the budget is left for matches
        several = any(one.doubtful for _, one in step.meetings)
        divide = share
        if bent or (several and len(along.states) < self.budget / 2):
            divide = along.options.aside
        if divide is not None and depth > 0 and len(along.states) < self.budget:
            middle = low + divide * (high - low)
            if low < middle < high:
                self.go(low, middle, depth - 1)
                self.go(middle, high, depth - 1)
                return
        if bent or (share is not None and len(along.states) >= self.budget):
            self.unresolved.append((low, high))
        self.guesses += guesses
        self.guesses += windows(along, step.meetings, high - low)

    def locate(self) -> None:
        """Add what the guesses lead to."""
        for guess in self.guesses:
            one = located(self.along, guess)
            if one is not None and one.value - self.along.low <= 1e-6 * self.wide:
                one = self.from_start(one)
            if one is not None and not any(self._same(one, other) for other in self.events):
                self.events.append(one)
        self.guesses.clear()
        self.events.sort(key=lambda c: c.value)

    def _same(self, one: Event, other: Event) -> bool:
        near = self.along.options.same * self.wide + one.width
        alike = one.direction == other.direction
        alike &= abs(one.omega - other.omega) <= 1e-6 * max(one.omega, other.omega)
        return alike and abs(one.value - other.value) <= near

    def from_start(self, one: Event) -> Event | None:
        """An event as it is; at the start of the range exactly if rounding leaves that, and none if
        what does not grow there begins to decay."""
        along = self.along
        if one.interval[0] > along.low or not _quiet(along, along.low, one.omega):
            return one
        return replace(one, value=along.low) if one.direction > 0 else None

    def places(self) -> list[tuple[Event, ...]]:
        """Events that add up to what grows between them, as far as can be, by places."""
        along, near = self.along, 4 * self.along.options.same * self.wide
        middles = _middles(along, together(self.events, near))
        edges = [along.low, *middles[1:-1], max(middles[-1], along.high)]
        settled = [one for a, b in itertools.pairwise(edges) for one in self._settled(a, b, (a, b))]
        settled.sort(key=lambda c: c.value)
        start = fastest_first(along, [one for one in settled if one.value == along.low])
        rest = together([one for one in settled if one.value != along.low], near)
        return [tuple(group) for group in (start, *rest) if group]

    def _settled(self, a: float, b: float, ends: tuple[float, float]) -> list[Event]:
        """Events from a to b that add up to the change of what grows, intervals within `ends`."""
        along, wide = self.along, self.wide
        inside = [one for one in self.events if a <= one.value <= b]
        before, after = growth_at(along, a), growth_at(along, b)
        done, coarse = explained(inside, before, after), b - a > wide / 64
        if b == along.high:  # what crosses there is not seen beyond it
            done |= explained([one for one in inside if one.interval[1] < b], before, after)
        if done and (not coarse or self._steady(a, b, inside)):
            return inside
        near = 4 * along.options.same * wide
        changes = list(difference((along, a), (along, b)))
        if inside and not done and inside[-1].value - inside[0].value <= near:
            several = [self._alike(*change, a, b) for change in changes]
            if changes and all(several):  # of equal subsystems, all at one place
                return [one for one in several if one]
        middle = self._middle(a, b, inside)
        if len(along.states) > 2 * self.budget or (done and middle is None):
            return inside  # and the search is not certified
        if middle is None:
            at = [
                self._alike(*change, a - near, b + near) or self._by_count(*change, a, b, ends)
                for change in changes
            ]
            return [one for one in at if one]
        if coarse:
            self.go(a, middle, along.options.depth)
            self.go(middle, b, along.options.depth)
            self.locate()
        return [*self._settled(a, middle, ends), *self._settled(middle, b, ends)]

    def _steady(self, a: float, b: float, inside: list[Event]) -> bool:
        """True if as many roots grow up to the events inside as at a, and after them as at b."""
        first, last = (inside[0].value, inside[-1].value) if inside else (b, b)
        before, after = growth_at(self.along, a), growth_at(self.along, b)
        return _steady(self.along, a, first, before) and _steady(self.along, last, b, after)

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
        """The located event of that frequency and direction between low and high."""
        for one in self.events:
            apart = abs(one.omega - omega) <= self.along.options.near * min(one.omega, omega)
            if low <= one.value <= high and one.direction == way and apart:
                return one
        return None

    def _by_count(
        self, omega: float, way: int, a: float, b: float, ends: tuple[float, float]
    ) -> Event | None:
        """An event between a and b of which only the count tells, with an interval beside which
        that is sure."""
        along = self.along
        before, after = growth_at(along, a).roots, growth_at(along, b).roots

        def sign(p: float) -> int:
            least, most = _bounds(along, p)
            return -way if most <= min(before, after) else way * (least >= max(before, after))

        sides = certain(sign, (a, b), 1e-7 * self.wide, *ends) or ends
        one = Event((a + b) / 2, omega, way, (sides[0], sides[1]), converged=False)
        event = self.from_start(one)
        if event is not None and event.value == along.low:
            return self._alike(omega, way, along.low, along.low) or event
        return event


def _factors(
    system: System, low: float, high: float
) -> list[tuple[Callable[[float, float], float], float]]:
    """Bounds of the second derivatives of the factors of terms, and their greatest values."""
    if not isinstance(system, TermSystem):
        return []
    name, values = system.parameter, system.values()
    formulas = {t.factor.text: t.factor for part in (system.M, system.C, system.K) for t in part}
    bounds: list[tuple[Callable[[float, float], float], float]] = []
    for formula in formulas.values():
        if name in formula.names:
            at = np.linspace(low, high, 33).tolist()
            size = max(abs(formula.value(values | {name: p})) for p in at)
            bounds.append((partial(formula.curvature, values, name), size))
    return bounds


def together(items: Sequence[Event], near: float) -> list[list[Event]]:
    """Events by rising value, those that are no further than `near` from the one before with it."""
    groups: list[list[Event]] = []
    for one in items:
        if groups and one.value - groups[-1][-1].value <= near:
            groups[-1].append(one)
        else:
            groups.append([one])
    return groups


def _middles(along: Continuation, places: Sequence[Sequence[Event]]) -> list[float]:
    """A value between neighbouring places, and beyond the first and the last."""
    low, high, same = along.low, along.high, along.options.same
    at = [low, *(p[0].value for p in places), high]
    middles = [(a + b) / 2 for a, b in itertools.pairwise(at)]
    if places and high - places[-1][-1].value <= same * (high - low):
        beyond = high + 1e-6 * (high - low)
        with suppress(InputError, ComputationError, ValueError, ArithmeticError):
            along.at(beyond)  # there may be none, beyond a fold
            middles[-1] = beyond
    return middles


def _meetings_at_end(along: Continuation) -> Iterator[Guess]:
    """Pairs of roots on the line that are one at the end of the range, as far as rounding tells."""
    state = along.at(along.high)
    on = state.real if along.form == "undamped" else state.on_line
    for pair in np.argwhere(np.triu(on & on[:, None] & state.close, 1)):
        right, left = state.right[:, pair], state.left[:, pair]
        width = 1e-6 * (along.high - along.low)
        yield Guess(along.high, complex(state.roots[pair].mean()), right, left, True, width)


def _quiet(along: Continuation, p: float, omega: float) -> bool:
    """True if a root of about this frequency may begin to grow at p: it is on the line, without
    damping together with another one."""
    state = along.at(p)
    if not omega:
        return bool(np.any(np.abs(state.roots) <= state.rounding))
    near = (
        np.abs([along.omega(complex(z)) - omega for z in state.roots]) <= along.options.near * omega
    )
    on = near & state.on_line
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
    omegas = np.array([along.omega(complex(z)) for z in state.roots])
    rates = way * along.exponents(state.roots).real

    def rate(one: Event) -> float:
        near = along.options.near * max(one.omega, float(omegas.min()))
        own = np.abs(omegas - one.omega) <= near
        return float(np.max(rates[own & (rates > 0)], initial=-np.inf))

    return sorted(place, key=rate, reverse=True)


# The certificate


def _steady(along: Continuation, low: float, high: float, growth: UnstableCount) -> bool:
    """True if at each state between low and high as many roots grow, as far as rounding tells."""
    inside = [s.value for s in along.states if low < s.value < high]
    return all(least <= growth.roots <= most for least, most in (_bounds(along, p) for p in inside))


def _agrees(
    along: Continuation, places: Sequence[tuple[Event, ...]], stretches: Sequence[Stretch]
) -> bool:
    """True if the counter and all states agree with the events, and rounding hides no root, in no
    interval so wide either that others have room in it."""
    room = along.options.wide * (along.high - along.low)
    return (
        all(s.counted == s.growth.roots for s in stretches)
        and all(
            explained(place, a.growth, b.growth)
            for place, (a, b) in zip(places, itertools.pairwise(stretches), strict=True)
        )
        and all(_steady(along, s.low, s.high, s.growth) for s in stretches)
        and all(c.width <= room for p in places for c in p)
        and not _undecided(along, places)
        and not any(_hides(along, p) for p in (along.low, along.high))
    )


def _undecided(along: Continuation, places: Sequence[tuple[Event, ...]]) -> bool:
    """True if away from all events rounding does not tell on which side of the axis a root is."""
    if along.form != "damped":  # a spectrum that is symmetric about the axis has roots on it
        return False
    margin = 1e-6 * (along.high - along.low)
    taken = [(c.interval[0] - margin, c.interval[1] + margin) for p in places for c in p]
    for state in along.states:
        apart = along.low < state.value < along.high
        apart = apart and not any(low <= state.value <= high for low, high in taken)
        if apart and np.any(state.on_line & (np.abs(state.roots) > state.rounding)):
            return True
    return False


def _hides(along: Continuation, p: float) -> bool:
    """True if rounding leaves the slow roots at p too few digits, see `eigen.hidden`."""
    if isinstance(along.system, Slow):
        return False
    M, C, K = along.system(p)
    with suppress(InputError):  # M is not symmetric
        M, C, K = checked(dense(M), None if C is None else dense(C), dense(K))
        return hidden(reduce(M, C, K), C, K)
    return False


def sign_count(along: Continuation, p: float) -> int | None:
    """How many roots grow at p, by the sign function: of rates above what separates them from
    rounding, without any eigenvalue. None if it does not settle."""
    state, A = along.at(p), along.both(p)[0]
    z: ComplexArray = state.roots if along.form == "damped" else 1j * state.roots
    noise = state.rounding
    if along.form == "undamped":
        unit = float(np.sqrt(norm_of(A))) or 1.0
        half = along.exponents(state.roots) / unit
        z, noise = np.concatenate([half, -half]), np.sqrt(np.tile(state.rounding, 2)) / unit
        zero, eye = np.zeros_like(A), np.eye(len(A))
        A = np.block([[zero, eye], [-A / unit**2, zero]])
    elif along.form == "gyroscopic":
        A = (1j * A).real
    quiet = z.real <= noise
    least = float(np.min(z.real[~quiet], initial=np.inf))
    most = max(float(np.max(z.real[quiet], initial=0.0)), float(np.max(noise, initial=0.0)))
    if not np.isfinite(least):
        least = max(1e3 * most, 1e-6)
    floor = least / 8 if least > 64 * most else np.sqrt(max(most, 1e-16) * least)
    return count_right(A, float(floor))


def count_right(A: np.ndarray, x: float = 0.0) -> int | None:
    """Number of eigenvalues of A (n, n) with real part above x; None if it does not settle.

    The sign function of A - x has the eigenvalue +1 for each of them and -1 for each other, so that
    its trace counts them. Newton's iteration S <- (c S + (c S)^-1) / 2 converges quadratically; the
    scaling c = |det S|^(-1/n) speeds its start (Byers 1987).
    """
    n = len(A)
    S, factor, change = A - x * np.eye(n), 1.0, np.inf
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
