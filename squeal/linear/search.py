"""All events between two values of a parameter, and what shows whether one is missing.

Steps of the continuation give guesses, which are located. What grows is counted halfway between
neighbouring events; where the count does not follow from those that were located, the range is
searched more finely, and what is still missing is bisected by the count.

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
    ComplexArray,
    Continuation,
    ContinuationOptions,
    Guess,
    State,
    Step,
)
from squeal.linear.eigen import hidden
from squeal.linear.events import ASIDE, Event, Smooth, certain, guesses_of, located, windows
from squeal.linear.light import Slow
from squeal.linear.matrices import checked, norm_of, reduce
from squeal.linear.system import System, TermSystem, dense
from squeal.linear.verdict import UnstableCount

Counter = Callable[[Continuation, float], int | None]
"""(continuation, p) -> how many roots grow at p (two for a pair), None if it cannot tell."""

BESIDE = (1e-9, 1e-7, 1e-5, 1e-3)  # of the range: where what grows from its start is seen
ALIKE = 1e-3  # of a frequency: roots that may be one


def growth_at(along: Continuation, p: float) -> UnstableCount:
    """What grows at p by more than rounding."""
    state = along.at(p)
    z, rounding = state.roots, state.rounding
    if along.form == "undamped":
        rates = np.abs(np.sqrt(-z).real)
        return _counted(z.imag > rounding, state.real & (z.real < -rounding), rates)
    across, rates = (z.imag, z.real) if along.form == "damped" else (z.real, -z.imag)
    grows = rates > rounding
    pairs, reals = grows & (across > rounding), grows & (np.abs(across) <= rounding)
    return _counted(pairs, reals, rates * along.rate)


def _counted(pairs: np.ndarray, reals: np.ndarray, rates: np.ndarray) -> UnstableCount:
    fastest = (float(np.max(rates[some], initial=0.0)) for some in (pairs, reals))
    return UnstableCount(int(np.sum(pairs)), int(np.sum(reals)), *fastest)


def grows(state: State) -> np.ndarray:
    """Roots that grow by more than rounding, of a pair without damping both."""
    if state.form == "undamped":
        return ~state.on_line
    return (state.roots.real if state.form == "damped" else -state.roots.imag) > state.rounding


def _bounds(along: Continuation, p: float) -> tuple[int, int]:
    """At least and at most how many roots (two for a pair) grow at p, rounding considered."""
    state = along.at(p)
    z, rounding = state.roots, state.rounding
    if along.form == "undamped":  # each complex s and each negative one gives a growing root
        near = state.close.sum(axis=1) > 1
        sure = ~state.on_line
        return int(np.sum(sure)), int(np.sum(sure | near | (z.real < rounding)))
    if along.form == "damped":
        return int(np.sum(z.real > rounding)), int(np.sum(z.real > -rounding))
    near = state.close.sum(axis=1) > 1
    return int(np.sum(z.imag < -rounding)), int(np.sum((z.imag < -rounding) | near))


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
    """All events for low <= p <= high.

    Parameters
    ----------
    system : System
        M regular.
    low, high : float
        The range.
    options : ContinuationOptions
        Steps, budget and tolerances.
    counter : Counter
        The second count of a certificate; the sign function of A(p) if none is given.

    Raises
    ------
    InputError
        For a singular M, and whatever `system` raises.
    """
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
    found: list[Event] = []
    walk.locate(found)
    for finer in (4, 16):
        wrong = [
            (a, b)
            for place, a, b in _around(along, found)
            if not explained(place, growth_at(along, a), growth_at(along, b))
            or not _steady_beside(along, place, a, b)
        ]
        if not wrong or len(along.states) > budget:
            break
        for a, b in wrong:
            for x, y in itertools.pairwise(np.linspace(a, b, finer + 1).tolist()):
                walk.go(x, y, options.depth)
        walk.locate(found)
    places = _start_as_one(along, _cleaned(along, found, 2 * budget))
    first = _middles(along, places)[0]
    # nothing was seen to cross below the first place, but what grows there may not at the start
    if not explained([], growth_at(along, low), growth_at(along, first)):
        places = _start_as_one(along, [*_bisected(along, low, first, []), *places])
    stretches = tuple(_stretches(along, places, (counter or sign_count) if by_terms else None))
    certified = None
    if by_terms:
        certified = not walk.unresolved and _agrees(along, places, stretches)
    return Searched(tuple(places), stretches, certified, along)


class _Walk:
    """Steps along a continuation with a budget of values; `unresolved` are those at whose end the
    budget left roots unmatched or a factor too bent."""

    def __init__(self, along: Continuation, budget: int) -> None:
        self.along, self.budget = along, budget
        self.guesses: list[Guess] = []
        self.unresolved: list[tuple[float, float]] = []
        self.factors = _factors(along.system, along.low, along.high)

    def go(self, low: float, high: float, depth: int) -> None:
        """Match all roots from low to high and collect what may cross the line."""
        along = self.along
        step = Step.of(along.at(low), along.at(high), along.options)
        found, share = guesses_of(step, along.form, (low == along.low, high == along.high))
        # half the budget is kept for matches
        several = any(one.doubtful for _, one in step.meetings)
        bent = self._bent(low, high)
        divide = share
        if bent or (several and len(along.states) < self.budget / 2):
            divide = ASIDE
        if divide is not None and depth > 0 and len(along.states) < self.budget:
            middle = low + divide * (high - low)
            if low < middle < high:
                self.go(low, middle, depth - 1)
                self.go(middle, high, depth - 1)
                return
        if bent or (share is not None and len(along.states) >= self.budget):
            self.unresolved.append((low, high))
        self.guesses += found
        self.guesses += windows(along, step.meetings, high - low)

    def _bent(self, low: float, high: float) -> bool:
        """True if a factor may bend by more than what a step resolves."""
        most = 8 * self.along.options.resolved / (high - low) ** 2
        return any(not bend(low, high) <= most * size for bend, size in self.factors)

    def locate(self, found: list[Event]) -> None:
        """Add what the guesses lead to."""
        along = self.along
        for guess in self.guesses:
            one = located(along, guess)
            one = None if one is None else _from_start(along, one)
            if one is not None and not any(_same(along, one, other) for other in found):
                found.append(one)
        self.guesses.clear()
        found.sort(key=lambda c: c.value)


def _factors(
    system: System, low: float, high: float
) -> list[tuple[Callable[[float, float], float], float]]:
    """Bounds of the second derivatives of the factors of terms, and their greatest values."""
    if not isinstance(system, TermSystem):
        return []
    name = system.parameter
    found: list[tuple[Callable[[float, float], float], float]] = []
    formulas = {t.factor.text: t.factor for part in (system.M, system.C, system.K) for t in part}
    for formula in formulas.values():
        if name in formula.names:
            values = system.values()
            at = [low + x * (high - low) for x in np.linspace(0, 1, 33)]
            size = max(abs(formula.value(values | {name: p})) for p in at)

            found.append((partial(formula.curvature, values, name), size))
    return found


def _same(along: Continuation, one: Event, other: Event) -> bool:
    near = along.options.same * (along.high - along.low) + one.width
    alike = one.direction == other.direction
    alike &= abs(one.omega - other.omega) <= 1e-6 * max(one.omega, other.omega)
    return alike and abs(one.value - other.value) <= near


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
    low, high, same = along.low, along.high, along.options.same
    at = [low, *(p[0].value for p in places), high]
    middles = [(a + b) / 2 for a, b in itertools.pairwise(at)]
    if places and high - places[-1][-1].value <= same * (high - low):
        beyond = high + 1e-6 * (high - low)
        with suppress(InputError, ComputationError, ValueError, ArithmeticError):
            along.at(beyond)  # there may be none, beyond a fold
            middles[-1] = beyond
    return middles


def _around(along: Continuation, found: list[Event]) -> Iterator[tuple[list[Event], float, float]]:
    """Each place with values of the parameter below and above; the whole range if there is none."""
    places = together(found, 4 * along.options.same * (along.high - along.low))
    if not places:
        yield [], along.low, along.high
        return
    for place, (a, b) in zip(places, itertools.pairwise(_middles(along, places)), strict=True):
        yield place, a, b


def explained(place: Sequence[Event], a: UnstableCount, b: UnstableCount) -> bool:
    """True if the events of a place add up to the change of what grows."""
    pairs = sum(c.direction for c in place if c.kind == "flutter")
    reals = sum(c.direction for c in place if c.kind == "divergence")
    rise = b.pairs - a.pairs, b.reals - a.reals
    # two divergent roots join to a growing pair, or come from one, and cross nothing
    joined = rise[0] - pairs
    return bool(rise[1] - reals == -2 * joined)


def _steady(along: Continuation, low: float, high: float, growth: UnstableCount) -> bool:
    """True if at each state between low and high as many roots grow, as far as rounding tells."""
    inside = [s.value for s in along.states if low < s.value < high]
    return all(least <= growth.roots <= most for least, most in (_bounds(along, p) for p in inside))


def _steady_beside(along: Continuation, place: list[Event], a: float, b: float) -> bool:
    first, last = (place[0].value, place[-1].value) if place else (b, b)
    before, after = growth_at(along, a), growth_at(along, b)
    return _steady(along, a, first, before) and _steady(along, last, b, after)


def _cleaned(along: Continuation, found: list[Event], most: int) -> list[tuple[Event, ...]]:
    """Places whose events change what grows; of others nothing, or what bisection tells."""
    result: list[tuple[Event, ...]] = []
    for place, a, b in _around(along, found):
        if explained(place, growth_at(along, a), growth_at(along, b)):
            result += [tuple(place)] if place else []
        elif place and (several := _several(along, place, a, b)):
            result.append(several)
        elif len(along.states) < most:
            result += _bisected(along, a, b, place)
        elif place:  # what is located is told, and the search is not certified
            result.append(tuple(place))
    return result


def _several(along: Continuation, place: list[Event], a: float, b: float) -> tuple[Event, ...]:
    """The events of equal subsystems, which all lie at one place; empty if that is not so."""
    before, after = growth_at(along, a), growth_at(along, b)
    if place[0].value == along.low:
        for share in BESIDE:
            start = _completed(along, place, along.low + share * (along.high - along.low))
            if explained(start, growth_at(along, along.low), after):
                return start
    repeated = tuple(c for c in place for _ in range(_times(along, c)))
    return repeated if explained(repeated, before, after) else ()


def _times(along: Continuation, one: Event) -> int:
    """How many equal roots cross the line there."""
    state = along.at(one.value)
    at: complex = one.omega**2
    if along.form != "undamped":
        at = (1j if along.form == "damped" else 1) * one.omega / along.rate
    near = np.abs(state.roots - at) <= state.rounding + 1e-6 * np.abs(state.roots)
    return max(int(near.sum()) // (2 if one.coalesces else 1), 1)


def _bisected(
    along: Continuation, a: float, b: float, place: list[Event]
) -> list[tuple[Event, ...]]:
    """Changes of the count between a and b, located where they are known and bisected if not."""
    before, after = growth_at(along, a), growth_at(along, b)
    wide = along.high - along.low
    if before.roots == after.roots:  # where a growing pair meets on the real axis nothing crosses
        return []
    low, high = a, b
    while high - low > max(1e-10 * wide, 4 * np.spacing(abs(high))):
        middle = (low + high) / 2
        if growth_at(along, middle).roots == before.roots:
            low = middle
        else:
            high = middle
    near = [c for c in place if abs(c.value - low) <= 1e-6 * wide]
    if near:
        beyond = max(high, near[0].interval[1]) + 1e-7 * wide
        rest = [c for c in place if c is not near[0]]
        return [(near[0],), *(_bisected(along, beyond, b, rest) if beyond < b else [])]
    seen = growth_at(along, high)
    rise = seen.roots - before.roots
    state = along.at(high if rise > 0 else low)
    # of what grows the least above rounding
    own = np.where(grows(state), np.abs(state.roots - _foot(state)), np.inf) / state.rounding
    k = int(np.argmin(own))
    margin = 1e-7 * wide
    beyond = min(high + margin, b)
    # what neither grows nor decays at the start may grow from there on, below rounding at first
    start = tuple(_beginning(along, a, beyond)) if rise > 0 else ()
    if start and explained(start, growth_at(along, a), growth_at(along, beyond)):
        return [start, *_bisected(along, beyond, b, place)]
    omega = along.omega(complex(state.roots[k])) if _oscillates(state)[k] else 0.0
    interval = _sure(along, (low + high) / 2, margin, (a, b), (before.roots, seen.roots))
    way = 1 if rise > 0 else -1
    one = Event((low + high) / 2, omega, way, interval, np.nan, False, converged=False)
    if beyond >= b or growth_at(along, high).roots == after.roots:
        return [(one,)]
    return [(one,), *_bisected(along, beyond, b, place)]


def _foot(state: State) -> ComplexArray:
    """The point of the line next to each root."""
    z = state.roots
    if state.form == "damped":
        return np.asarray(1j * z.imag)
    return np.asarray(np.where(z.real > 0, z.real, 0.0) if state.form == "undamped" else z.real)


def _oscillates(state: State) -> np.ndarray:
    z = state.roots
    if state.form == "undamped":
        return np.asarray(~state.real | (z.real > 0))
    return np.abs(z.imag if state.form == "damped" else z.real) > state.rounding


def _sure(
    along: Continuation,
    p: float,
    margin: float,
    ends: tuple[float, float],
    roots: tuple[int, int],
) -> tuple[float, float]:
    """What holds a change of the count at p: beside it `roots` grow for sure, or the whole range if
    other roots leave that in doubt."""
    way = 1.0 if roots[1] > roots[0] else -1.0

    def count(x: float) -> Smooth:
        least, most = _bounds(along, x)
        value = -way if most <= min(roots) else way if least >= max(roots) else 0.0
        return Smooth(value, 0.0, 0.0, 0.0)

    return certain(count, p, margin, *ends) or ends


# At the ends of the range


def _from_start(along: Continuation, one: Event) -> Event | None:
    """An event as it is; at the start of the range exactly if rounding leaves that, and none if
    what does not grow there begins to decay."""
    near = one.value - along.low <= 1e-6 * (along.high - along.low)
    if not near or one.interval[0] > along.low or not _quiet(along, along.low, one.omega):
        return one
    return replace(one, value=along.low) if one.direction > 0 else None


def _meetings_at_end(along: Continuation) -> Iterator[Guess]:
    """Pairs of roots on the line that are one at the end of the range, as far as rounding tells."""
    state = along.at(along.high)
    on = state.on_line if along.form != "undamped" else state.real
    met = on & on[:, None] & state.close
    for pair in np.argwhere(np.triu(met, 1)):
        right, left = state.right[:, pair], state.left[:, pair]
        width = 1e-6 * (along.high - along.low)
        yield Guess(along.high, complex(state.roots[pair].mean()), right, left, True, width)


def _growing(along: Continuation, p: float) -> list[float]:
    """Angular frequencies (rad/s) of all that grows at p, 0 for a real root."""
    state = along.at(p)
    z, some = state.roots, grows(state)
    if along.form == "undamped" or along.form == "damped":
        some = some & (z.imag >= -state.rounding)
    else:
        some = some & (z.real >= -state.rounding)
    found = _oscillates(state) & (~state.real if along.form == "undamped" else True)
    return [along.omega(complex(z[k])) if found[k] else 0.0 for k in np.flatnonzero(some)]


def _quiet(along: Continuation, p: float, omega: float) -> bool:
    """True if a root of about this frequency may begin to grow at p: it is on the line, without
    damping together with another one."""
    state = along.at(p)
    if not omega:
        return bool(np.any(np.abs(state.roots) <= state.rounding))
    near = np.abs([along.omega(complex(z)) - omega for z in state.roots]) <= ALIKE * omega
    on = near & state.on_line
    if not along.conservative:
        return bool(on.any())
    return bool(state.close[np.ix_(on, on)].sum() > on.sum())


def _beginning(along: Continuation, a: float, b: float) -> Iterator[Event]:
    """All that grows at b and may grow from the start on, below rounding up to a."""
    before = [s.value for s in along.states if along.low <= s.value <= a]
    found = _growing(along, b)
    for omega in _growing(along, a):
        if found:
            found.remove(min(found, key=lambda other: abs(other - omega)))
    for omega in found:
        if all(_quiet(along, p, omega) for p in before):
            yield Event(along.low, omega, 1, (along.low, b), np.nan, False, converged=False)


def _completed(along: Continuation, place: Sequence[Event], p: float) -> tuple[Event, ...]:
    """What grows from the start on and does at p: the events located there and all others."""
    rest = list(_beginning(along, along.low, p))
    kept = []
    for one in place:
        near = min(rest, key=lambda other: abs(other.omega - one.omega), default=None)
        if near is not None and abs(near.omega - one.omega) <= ALIKE * one.omega:
            rest.remove(near)
            kept.append(one)
    return *kept, *rest


def _start_as_one(
    along: Continuation, places: Sequence[tuple[Event, ...]]
) -> list[tuple[Event, ...]]:
    """Places with all that grows from the start on as one, the fastest first."""
    first = [one for place in places if place[0].value == along.low for one in place]
    rest = [place for place in places if place[0].value != along.low]
    return [tuple(fastest_first(along, first)), *rest] if first else rest


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
    rates = np.where(rates > 0, rates, -np.inf)

    def rate(one: Event) -> float:
        own = np.abs(omegas - one.omega) <= ALIKE * max(one.omega, float(omegas.min()))
        return float(np.max(rates[own], initial=-np.inf))

    return sorted(place, key=rate, reverse=True)


# The certificate


def _stretches(
    along: Continuation, places: Sequence[tuple[Event, ...]], counter: Counter | None
) -> Iterator[Stretch]:
    at = [along.low, *(p[0].value for p in places), along.high]
    for (low, high), middle in zip(itertools.pairwise(at), _middles(along, places), strict=True):
        number = None if counter is None else counter(along, middle)
        yield Stretch(low, high, growth_at(along, middle), number)


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
        and not any(_hides(along, p) for p in (along.low, along.high))
    )


def _hides(along: Continuation, p: float) -> bool:
    """True if rounding leaves the slow roots at p too few digits, see `eigen.hidden`."""
    if isinstance(along.system, Slow):
        return False
    M, C, K = along.system(p)
    with suppress(InputError):  # M is not symmetric
        M, C, K = checked(dense(M), None if C is None else dense(C), dense(K))
        return hidden(reduce(M, C, K), K)
    return False


def sign_count(along: Continuation, p: float) -> int | None:
    """How many roots grow at p, by the sign function: of rates above what separates them from
    rounding, without any eigenvalue. None if it does not settle."""
    state, A = along.at(p), along.both(p)[0]
    rounding, unit = state.rounding, 1.0
    if along.form == "undamped":
        unit = float(np.sqrt(norm_of(A))) or 1.0
        half = np.sqrt(-state.roots + 0j) / unit
        z: ComplexArray = np.concatenate([half, -half])
        rounding = np.concatenate([state.rounding, state.rounding]) / unit**2
        quiet = (np.abs(z.real) <= np.sqrt(rounding)) | (z.real <= 0)
        zero, eye = np.zeros_like(A), np.eye(len(A))
        A = np.block([[zero, eye], [-A / unit**2, zero]])
    else:
        z = state.roots if along.form == "damped" else 1j * state.roots
        A = A if along.form == "damped" else (1j * A).real
        quiet = z.real <= rounding
    least = float(np.min(z.real[~quiet], initial=np.inf))
    most = max(float(np.max(z.real[quiet], initial=-np.inf)), float(np.max(rounding, initial=0.0)))
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
    S = A - x * np.eye(n)
    scaled = True
    with np.errstate(all="ignore"):
        for _ in range(60):
            try:
                other = np.linalg.inv(S)
            except np.linalg.LinAlgError:
                return None
            factor = float(np.exp(-np.linalg.slogdet(S)[1] / n)) if scaled else 1.0
            new = (factor * S + other / factor) / 2
            change = float(np.linalg.norm(new - S, 1) / np.linalg.norm(new, 1))
            S = new
            if not np.isfinite(change):
                return None
            scaled = scaled and change > 1e-2
            if change < 1e-5:  # the next step would leave its square
                break
        else:
            return None
    number = (float(np.trace(S)) + n) / 2
    return round(number) if abs(number - round(number)) < 1e-3 else None
