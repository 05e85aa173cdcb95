"""All crossings between two values of a parameter, and counts that show whether one is missing.

What grows is counted halfway between neighbouring crossings. Where the count does not follow from
the crossings that were located, the range between is searched more finely, and what is still
missing is bisected by the count. A second count, by the sign function of the matrix and without
eigenvalues, has to agree. Counts say nothing of a window that opens and closes between two values
that were looked at: such are foreseen (`windows`), and that none is overlooked is not proved.
"""

import itertools
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from squeal.errors import ComputationError, InputError
from squeal.linear.cubic import Value
from squeal.linear.following.ends import (
    beginning,
    completed,
    from_start,
    meetings_at_end,
    start_as_one,
)
from squeal.linear.following.line import Line, State
from squeal.linear.following.locate import Located, located
from squeal.linear.following.sign import count_right
from squeal.linear.following.steps import Stepper
from squeal.linear.growth import Growth
from squeal.linear.matrices import norm_of
from squeal.linear.roots import certain
from squeal.linear.system import System
from squeal.numerics.grouping import together

SAME = 1e-9  # of the range: crossings of one frequency closer than this are one
STARTS = {60: 24, 150: 16, 10**9: 10}  # steps at first, by the rows of A
BUDGET = {60: 1500, 150: 400, 10**9: 90}  # states
WIDE = 1e-4  # of the range: an interval in which crossings may hide
SHARES = np.geomspace(1e-6, 1.0, 13)  # of a stretch: how far from its end a pair is looked at
BESIDE = np.array([1e-9, 1e-7, 1e-5])  # of the range: where what grows from its start is seen
SAME_ROOT = 1e-6  # of a root: those of equal subsystems
CLOSE = 1e-6  # of the range: equal subsystems cross within this


@dataclass(frozen=True)
class Stretch:
    """What grows between two neighbouring crossings, and whether the second count agrees."""

    low: float
    high: float
    growth: Growth
    counted: int | None  # growing roots (two for a pair), without eigenvalues

    @property
    def certified(self) -> bool:
        """True if both counts agree."""
        return self.counted == self.growth.roots


@dataclass(frozen=True)
class Searched:
    """Crossings by rising parameter, groups of them at one place, and the stretches between."""

    places: tuple[tuple[Located, ...], ...]
    stretches: tuple[Stretch, ...]
    line: Line = field(repr=False)

    @property
    def certified(self) -> bool:
        """True if every stretch is certified, at all states between its ends grows what grows in
        its middle, the crossings add up to that, and rounding hides no root, in no interval so
        wide either that others have room in it."""
        agrees = all(s.certified for s in self.stretches) and all(
            explained(place, a.growth, b.growth)
            for place, (a, b) in zip(self.places, itertools.pairwise(self.stretches), strict=True)
        )
        room = WIDE * (self.line.high - self.line.low)
        narrow = all(c.interval[1] - c.interval[0] <= room for p in self.places for c in p)
        agrees &= all(_steady(self.line, s.low, s.high, s.growth) for s in self.stretches)
        return agrees and narrow and not any(map(self.line.hides, (self.line.low, self.line.high)))


def _limit(table: dict[int, int], rows: int) -> int:
    return next(value for most, value in table.items() if rows <= most)


def search(system: System, low: float, high: float) -> Searched:
    """All crossings of the line between growth and decay for low <= p <= high.

    Raises InputError for a singular M and whatever `system` raises.
    """
    line = Line(system, low, high)
    rows = line.n * (2 if line.damped else 1)
    stepper = Stepper(line, _limit(BUDGET, rows))
    found: list[Located] = []
    count = _limit(STARTS, rows)
    # values that thresholds do not like to lie at
    inner = [(k + 0.0371 * (1 + k % 3)) / count for k in range(1, count)]
    for a, b in itertools.pairwise([low, *(low + x * (high - low) for x in inner), high]):
        stepper.go(a, b)
    stepper.guesses += meetings_at_end(line)
    _add(line, stepper, found)
    for finer in (4, 16):
        wrong = [
            (a, b)
            for place, a, b in _around(line, found)
            if not explained(place, line.growth(a), line.growth(b))
            or not _steady_beside(line, place, a, b)
        ]
        if not wrong:
            break
        for a, b in wrong:
            points = np.linspace(a, b, finer + 1).tolist()
            for x, y in itertools.pairwise(points):
                stepper.go(x, y)
        _add(line, stepper, found)
    places = start_as_one(line, _cleaned(line, found))
    first = _middles(line, places)[0]
    # nothing was seen to cross below the first place, but what grows there may not at the start
    if not explained([], line.growth(low), line.growth(first)):
        places = start_as_one(line, _bisected(line, low, first, []) + places)
    return Searched(tuple(places), tuple(_stretches(line, places)), line)


def _add(line: Line, stepper: Stepper, found: list[Located]) -> None:
    for guess in stepper.guesses:
        one = located(line, guess)
        one = None if one is None else from_start(line, one)
        if one is not None and not any(_same(line, one, other) for other in found):
            found.append(one)
    stepper.guesses.clear()
    found.sort(key=lambda c: c.value)


def _same(line: Line, one: Located, other: Located) -> bool:
    near = SAME * (line.high - line.low) + (one.interval[1] - one.interval[0])
    scale = 1e-6 * max(one.omega, other.omega)
    alike = one.direction == other.direction and abs(one.omega - other.omega) <= scale
    return alike and abs(one.value - other.value) <= near


def _places(line: Line, found: list[Located]) -> list[list[Located]]:
    """Crossings by place: neighbours within rounding stand together."""
    return together(found, 4 * SAME * (line.high - line.low), lambda one: one.value)


def _middles(line: Line, places: Sequence[Sequence[Located]]) -> list[float]:
    at = [line.low, *(p[0].value for p in places), line.high]
    middles = [(a + b) / 2 for a, b in itertools.pairwise(at)]
    if places and line.high - places[-1][-1].value <= SAME * (line.high - line.low):
        beyond = line.high + 1e-6 * (line.high - line.low)
        with suppress(InputError, ComputationError, ValueError, ArithmeticError):
            line.at(beyond)  # there may be none, beyond a fold
            middles[-1] = beyond
    return middles


def _around(line: Line, found: list[Located]) -> Iterator[tuple[list[Located], float, float]]:
    """Each place with values of the parameter below and above; the whole range if there is none."""
    places = _places(line, found)
    if not places:
        yield [], line.low, line.high
        return
    middles = itertools.pairwise(_middles(line, places))
    for place, (a, b) in zip(places, middles, strict=True):
        yield place, a, b


def explained(place: Sequence[Located], a: Growth, b: Growth) -> bool:
    """True if the crossings of a place add up to the change of what grows."""
    pairs = sum(c.direction for c in place if c.kind == "flutter")
    reals = sum(c.direction for c in place if c.kind == "divergence")
    rise = b.pairs - a.pairs, b.reals - a.reals
    # two divergent roots join to a growing pair, or come from one, and cross nothing
    joined = rise[0] - pairs
    return bool(rise[1] - reals == -2 * joined)


def _steady(line: Line, low: float, high: float, growth: Growth) -> bool:
    """True if at each state between low and high as many roots grow, as far as rounding tells."""
    inside = [s.value for s in line.states if low < s.value < high]
    return all(least <= growth.roots <= most for least, most in map(line.bounds, inside))


def _steady_beside(line: Line, place: list[Located], a: float, b: float) -> bool:
    """The same from a to a place and from there to b."""
    first, last = (place[0].value, place[-1].value) if place else (b, b)
    return _steady(line, a, first, line.growth(a)) and _steady(line, last, b, line.growth(b))


def _cleaned(line: Line, found: list[Located]) -> list[tuple[Located, ...]]:
    """Places whose crossings change what grows; of others nothing, or what bisection tells."""
    kept = [tuple(place) for place in _places(line, found)]
    most = 2 * _limit(BUDGET, line.n * (2 if line.damped else 1))
    result: list[tuple[Located, ...]] = []
    for place, a, b in _around(line, found):
        if explained(place, line.growth(a), line.growth(b)):
            result += [tuple(place)] if place else []
        elif place and (several := _several(line, place, a, b)):
            result.append(several)
        elif len(line.states) < most:
            result += _bisected(line, a, b, place)
        elif place:  # what is located is told, and the search is not certified
            result.append(tuple(place))
    return result if found or result else kept


def _several(line: Line, place: list[Located], a: float, b: float) -> tuple[Located, ...]:
    """The crossings of equal subsystems, which all lie at one place; empty if that is not so."""
    if place[0].value == line.low:
        for p in line.low + BESIDE * (line.high - line.low):
            start = completed(line, place, float(p))
            if explained(start, line.growth(line.low), line.growth(b)):
                return start
    if len({c.omega for c in place}) > 1:
        repeated = tuple(c for c in place for _ in range(_times(line, c)))
        return repeated if explained(repeated, line.growth(a), line.growth(b)) else ()
    first = place[0]
    wide = max(10 * (first.interval[1] - first.interval[0]), CLOSE * (line.high - line.low))
    before = line.growth(max(a, first.value - wide))
    after = line.growth(min(b, place[-1].value + wide))
    if (before.roots, after.roots) != (line.growth(a).roots, line.growth(b).roots):
        return ()
    rise = after.pairs - before.pairs if first.omega else after.reals - before.reals
    if any(c.kind != first.kind for c in place) or rise * first.direction <= 0:
        return ()
    repeated = (first,) * abs(rise)
    return repeated if explained(repeated, before, after) else ()


def _times(line: Line, one: Located) -> int:
    """How many equal roots cross the line there."""
    state = line.at(one.value)
    z, scale = state.roots, np.abs(state.roots)
    at = 1j * one.omega / line.rate if line.damped else one.omega**2
    near = int(np.sum(np.abs(z - at) <= state.noise + SAME_ROOT * scale))
    return max(near // (2 if one.coalesces else 1), 1)


def _bisected(line: Line, a: float, b: float, place: list[Located]) -> list[tuple[Located, ...]]:
    """Changes of the count between a and b, located where they are known and bisected if not."""
    before, after = line.growth(a), line.growth(b)
    if before.roots == after.roots:  # where a growing pair meets on the real axis nothing crosses
        return []
    low, high = a, b
    while high - low > max(1e-10 * (line.high - line.low), 4 * np.spacing(abs(high))):
        middle = (low + high) / 2
        if line.growth(middle).roots == before.roots:
            low = middle
        else:
            high = middle
    near = [c for c in place if abs(c.value - low) <= 1e-6 * (line.high - line.low)]
    if near:
        beyond = max(high, near[0].interval[1]) + 1e-7 * (line.high - line.low)
        rest = [c for c in place if c is not near[0]]
        return [(near[0],), *(_bisected(line, beyond, b, rest) if beyond < b else [])]
    state, seen = line.at(high), line.growth(high)
    rise = seen.roots - before.roots
    if not line.damped and seen.pairs != before.pairs:
        state, k, hidden = _coalescing(line, low, high, a, b, seen.pairs > before.pairs)
    else:
        if rise < 0:
            state = line.at(low)
        # of what grows on one side alone the least above rounding
        z = state.roots
        rates = z.real if line.damped else np.where(np.abs(z.imag) <= state.noise, -z.real, 0.0)
        above = rates / state.noise
        k = int(np.argmin(np.where(above > 1, above, np.inf)))
        hidden = float(2 * state.noise[k] / max(abs(state.slopes[k].real), 1e-300))
    margin = max(1e-7 * (line.high - line.low), hidden)
    omega = line.omega(complex(state.roots[k]))
    # what neither grows nor decays at the start may grow from there on, below rounding at first
    beyond = min(high + margin, b)
    start = tuple(beginning(line, a, beyond)) if rise > 0 else ()
    if start and explained(start, line.growth(a), line.growth(beyond)):
        return [start, *_bisected(line, beyond, b, place)]
    one = Located(
        (low + high) / 2,
        omega,
        1 if rise > 0 else -1,
        _sure(line, (low + high) / 2, margin, (a, b), (before.roots, seen.roots)),
        float("nan"),
        False,
        converged=False,
    )
    if beyond >= b or line.growth(high).roots == after.roots:
        return [(one,)]
    return [(one,), *_bisected(line, beyond, b, place)]


def _sure(
    line: Line, p: float, margin: float, ends: tuple[float, float], roots: tuple[int, int]
) -> tuple[float, float]:
    """What holds a change of the count at p: beside it `roots` grow for sure, or `margin` if other
    roots leave that in doubt up to the ends."""
    way = 1.0 if roots[1] > roots[0] else -1.0

    def count(x: float) -> Value:
        least, most = line.bounds(x)
        if most <= min(roots):
            return Value(-way, 0.0)
        return Value(way if least >= max(roots) else 0.0, 0.0)

    found = certain(count, p, margin, *ends)
    if found is None or found[0] <= ends[0] or found[1] >= ends[1]:
        return max(p - margin, line.low), p + margin
    return found


def _coalescing(
    line: Line, low: float, high: float, a: float, b: float, above: bool
) -> tuple[State, int, float]:
    """The pair that is first seen to grow next to low and high, above or below them, and how far
    before two roots may have coalesced: their distance starts as a square root, under noise."""
    at, end = (high, b) if above else (low, a)

    def first(p: float) -> tuple[State, int]:
        state = line.at(p)
        apart = np.abs(state.roots.imag)
        return state, int(np.argmin(np.where(apart > state.noise, apart, np.inf)))

    state, k = first(at)
    apart, noise = abs(state.roots[k].imag), float(state.noise[k])
    for share in SHARES:
        beyond, j = first(at + share * (end - at))
        rise = beyond.roots[j].imag ** 2 - apart**2
        if rise > 8 * (apart + noise) ** 2:
            hidden = (apart + 2 * noise) ** 2 / rise * share * abs(end - at)
            return state, k, float(hidden)
    return state, k, abs(end - at)


def _stretches(line: Line, places: list[tuple[Located, ...]]) -> Iterator[Stretch]:
    at = [line.low, *(p[0].value for p in places), line.high]
    for (low, high), middle in zip(itertools.pairwise(at), _middles(line, places), strict=True):
        growth = line.growth(middle)
        yield Stretch(low, high, growth, _counted(line, middle, growth))


def _counted(line: Line, p: float, growth: Growth) -> int | None:
    """Growing roots by the sign function, of rates above what separates them from rounding."""
    state = line.at(p)
    if line.damped:
        z, noise = state.roots, state.noise
    else:
        z = np.sqrt(-state.roots + 0j)
        z = np.concatenate([z, -z])
        noise = np.concatenate([state.noise, state.noise])
        unit = float(np.sqrt(norm_of(line.both(p)[0]))) or 1.0
        z, noise = z / unit, noise / unit**2
    quiet = z.real <= noise if line.damped else np.abs(z.real) <= np.sqrt(noise)
    quiet |= z.real <= 0
    least = float(np.min(z.real[~quiet], initial=np.inf))
    most = max(float(np.max(z.real[quiet], initial=-np.inf)), float(np.max(noise, initial=0.0)))
    if not np.isfinite(least):
        least = max(1e3 * most, 1e-6)
    floor = least / 8 if least > 64 * most else np.sqrt(max(most, 1e-16) * least)
    A = line.both(p)[0]
    if not line.damped:
        n = len(A)
        A = np.block([[np.zeros((n, n)), np.eye(n)], [-A / unit**2, np.zeros((n, n))]])
    return count_right(A, float(floor))
