"""Crossings exactly at an end of a range.

What grows from the very start on neither grows nor decays there; what meets at the end is not seen
to part.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from squeal.linear.following.line import Line
from squeal.linear.following.locate import Located
from squeal.linear.following.windows import Guess

NEAR = 1e-3  # of a frequency: roots that near may be one
BEYOND = 1e3  # of an interval: growth is above rounding
BESIDE, APART = 1e-5, 1e-2  # of the range: where growth is looked at next to a place
AT = 1e-6  # of the range: crossings closer to the start than this may lie at it


def from_start(line: Line, one: Located) -> Located | None:
    """A crossing as it is; at the start of the range exactly if rounding leaves that, and none if
    what does not grow there begins to decay."""
    near = one.value - line.low <= AT * (line.high - line.low)
    if not near or one.interval[0] > line.low or not _quiet(line, line.low, one.omega):
        return one
    return replace(one, value=line.low) if one.direction > 0 else None


def meetings_at_end(line: Line) -> Iterator[Guess]:
    """Pairs of roots on the line that are one at the end of the range, as far as rounding tells."""
    state = line.at(line.high)
    on = state.on_line if line.damped else ~state.oscillates
    met = on & on[:, None] & state.close
    for pair in np.argwhere(np.triu(met, 1)):
        right, left = state.right[:, pair], state.left[:, pair]
        width = AT * (line.high - line.low)
        yield Guess(line.high, complex(state.roots[pair].mean()), right, left, True, width)


def beginning(line: Line, a: float, b: float) -> Iterator[Located]:
    """All that grows at b and may grow from the start on, below rounding up to a."""
    before = [s.value for s in line.states if line.low <= s.value <= a]
    known, found = _growing(line, a), _growing(line, b)
    for omega in known:
        if found:
            found.remove(min(found, key=lambda other: abs(other - omega)))
    for omega in found:
        if all(_quiet(line, p, omega) for p in before):
            yield Located(line.low, omega, 1, (line.low, b), np.nan, False, converged=False)


def completed(line: Line, place: Sequence[Located], p: float) -> tuple[Located, ...]:
    """What grows from the start on and does at p: the crossings located there and all others."""
    rest = list(beginning(line, line.low, p))
    kept = []
    for one in place:
        near = min(rest, key=lambda other: abs(other.omega - one.omega), default=None)
        if near is not None and abs(near.omega - one.omega) <= NEAR * one.omega:
            rest.remove(near)
            kept.append(one)
    return *kept, *rest


def start_as_one(line: Line, places: Iterable[tuple[Located, ...]]) -> list[tuple[Located, ...]]:
    """Places with all that grows from the start on as one, the fastest first."""
    kept = list(places)
    first = [one for place in kept if place[0].value == line.low for one in place]
    rest = [place for place in kept if place[0].value != line.low]
    return [tuple(fastest_first(line, first)), *rest] if first else rest


def fastest_first(line: Line, place: Sequence[Located]) -> list[Located]:
    """Crossings at one place in one direction, by their growth rates close to it."""
    if len({one.omega for one in place}) < 2:
        return list(place)
    wide = line.high - line.low
    hidden = max(one.interval[1] - one.interval[0] for one in place)
    aside = place[0].direction * float(np.clip(BEYOND * hidden, BESIDE * wide, APART * wide))
    inside = line.low <= place[0].value + aside <= line.high
    way = 1.0 if inside else -1.0  # at an end what decays fastest inside grows fastest beyond
    state = line.at(place[0].value + way * aside)
    omegas = np.array([line.omega(complex(z)) for z in state.roots])
    rates = np.where(way * state.rates > 0, way * state.rates, -np.inf)

    def rate(one: Located) -> float:
        own = np.abs(omegas - one.omega) <= NEAR * max(one.omega, float(omegas.min()))
        return float(np.max(rates[own], initial=-np.inf))

    return sorted(place, key=rate, reverse=True)


def _growing(line: Line, p: float) -> list[float]:
    """Angular frequencies (rad/s) of all that grows at p, 0 for a real root."""
    state = line.at(p)
    upper = state.grows & (state.roots.imag > state.noise)
    reals = state.grows & ~state.oscillates
    return [line.omega(complex(one)) for one in state.roots[upper]] + [0.0] * int(reals.sum())


def _quiet(line: Line, p: float, omega: float) -> bool:
    """True if a root of about this frequency may begin to grow at p: it is on the line, without
    damping together with another one."""
    state = line.at(p)
    if not omega:
        return bool(np.any(np.abs(state.roots) <= state.noise))
    near = np.abs([line.omega(complex(one)) - omega for one in state.roots]) <= NEAR * omega
    on = near & state.on_line
    return bool(on.any() if line.damped else state.close[np.ix_(on, on)].sum() > on.sum())
