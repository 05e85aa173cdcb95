"""Thresholds of systems with more than three degrees of freedom, in the words of all others."""

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from squeal.linear.crossing import CriticalPoint, Crossing, Thresholds
from squeal.linear.following.ends import fastest_first
from squeal.linear.following.line import Line, State
from squeal.linear.following.locate import Located
from squeal.linear.following.rates import LineRates
from squeal.linear.following.scale import divided
from squeal.linear.following.search import SAME, Searched, explained, search
from squeal.linear.following.verdicts import (
    Mark,
    Place,
    VerdictChange,
    marks_of,
    verdict_changes,
)
from squeal.linear.growth import GROWING, Growth, rises
from squeal.linear.system import System
from squeal.numerics.threads import one_thread

EXACT = 150  # rows of A up to which modes are numbered by the roots at a crossing itself
LEVEL = 1e-6  # of a growth rate: pairs and real roots that grow alike
TIGHT = 1e-9  # of mu: an interval shorter than this has converged


@one_thread()  # a solution with two columns of a few rows waits a hundred times its time for them
def followed(
    system: System, mu_max: float, breakpoints: Iterable[float] = (), mu_min: float = 0.0
) -> Thresholds:
    """All thresholds for mu_min <= mu <= mu_max, as `thresholds` gives them."""
    inner = sorted({float(b) for b in breakpoints if mu_min < b < mu_max})
    points: list[CriticalPoint] = []
    crossings: list[Crossing] = []
    before: Mark | None = None
    certified = True
    for a, b in itertools.pairwise(_edges(system, mu_min, inner, mu_max)):
        low = float(np.nextafter(a, b)) if a in inner else a
        high = float(np.nextafter(b, a)) if b in inner else b
        found = search(system, low, high)
        marks = _marks(found)
        first = marks[0][0]
        certified &= found.certified
        if before is not None and a not in inner:
            certified &= before.growth.roots == first.growth.roots
        elif before is not None:
            jump = VerdictChange(a, 0.0, before.verdict, first.verdict, None)
            if before.verdict != first.verdict:
                points.append(_point(found.line, jump, ()))
            rise = _rises(before.growth, first.growth)
            crossings += _counted(found.line, a, (a, a), rise, before.verdict != first.verdict)
        changes = list(_changes(found, marks))
        points += [_point(found.line, c, _located(found, c)) for c in changes]
        crossings += _crossings(found, {c.place: c for c in changes})
        before = marks[-1][-1]
    return Thresholds(points, crossings, certified)


def _edges(system: System, low: float, inner: list[float], high: float) -> list[float]:
    """The ends of the range, breakpoints, and what divides a range far beyond its own scale."""
    return [low, *inner, high] if inner else divided(system, low, high)


def _marks(found: Searched) -> list[list[Mark]]:
    line, growths = found.line, [s.growth for s in found.stretches]
    edges = [line.low, *(float(p[0].value) for p in found.places), line.high]
    return marks_of(LineRates(line), edges, growths, [s.value for s in line.states])


def _changes(found: Searched, marks: Sequence[Sequence[Mark]]) -> Iterator[VerdictChange]:
    """Changes of verdict; an exchange at a place of crossings belongs to that."""
    places = [
        Place(
            float(p[0].value),
            frozenset(c.kind for c in p if c.direction > 0),
            frozenset(c.kind for c in p if c.direction < 0),
        )
        for p in found.places
    ]
    near = 4 * SAME * (found.line.high - found.line.low)
    for change in verdict_changes(LineRates(found.line), places, marks):
        at = [
            replace(change, value=p.value, place=k)
            for k, p in enumerate(places)
            if abs(p.value - change.value) <= near
            and (change.below, change.above) in itertools.product(p.ends, p.begins)
        ]
        yield at[0] if at and change.place is None else change


def _located(found: Searched, change: VerdictChange) -> tuple[Located, ...]:
    return () if change.place is None else found.places[change.place]


def _point(line: Line, change: VerdictChange, located: tuple[Located, ...]) -> CriticalPoint:
    grows = change.above in GROWING
    kind = change.above if grows else "restabilised"
    concerned = change.above if grows else change.below
    leads = _leads(line, located, change)[concerned]
    interval = _interval(located) or (change.value - change.half, change.value + change.half)
    if leads:
        omega = leads.omega
    elif change.place is None and change.half:
        omega = _level(line, change.value, concerned)
    else:
        omega = _fastest(line, interval, concerned, grows)
    settled = all(c.converged for c in located)
    tight = interval[1] - interval[0] <= TIGHT * max(abs(change.value), 1e-300)
    return CriticalPoint(
        change.value,
        kind,
        omega / (2 * math.pi),
        interval,
        bool(settled and (tight or not located)),
        _residual(leads) if leads else None,
    )


def _leads(
    line: Line, located: Sequence[Located], change: VerdictChange
) -> dict[str, Located | None]:
    """The fastest of the crossings at a place that begin what grows above or end what grew below,
    if there are such."""
    found = {}
    for kind, way in ((change.below, -1), (change.above, 1)):
        alike = [c for c in located if c.kind == kind and c.direction == way]
        found[kind] = next(iter(fastest_first(line, alike)), None)
    return found


def _interval(located: Sequence[Located]) -> tuple[float, float] | None:
    if not located:
        return None
    low, high = (f(c.interval[i] for c in located) for i, f in ((0, min), (1, max)))
    return float(low), float(high)


def _residual(one: Located) -> float | None:
    return one.residual if math.isfinite(one.residual) else None


def _fastest(line: Line, interval: tuple[float, float], kind: str, above: bool) -> float:
    """Angular frequency (rad/s) of the fastest growing pair beside an interval, on one side."""
    if kind == "divergence":
        return 0.0
    low, high = interval
    beside = [s for s in line.states if (s.value > high if above else s.value < low)]
    return _leading(line, min(beside or line.states, key=lambda s: abs(s.value - (low + high) / 2)))


def _level(line: Line, p: float, kind: str) -> float:
    """The same where growth changes hands; 0 where a pair is about to be two real roots."""
    at = line.growth(p)
    level = abs(at.pair_rate - at.real_rate) <= LEVEL * at.real_rate
    return _leading(line, line.at(p)) if level and kind == "flutter" else 0.0


def _leading(line: Line, state: State) -> float:
    """Angular frequency (rad/s) of the fastest pair."""
    k = np.argmax(np.where(state.oscillates, state.rates, -np.inf))
    return line.omega(complex(state.roots[k]))


def _crossings(found: Searched, changes: Mapping[int | None, VerdictChange]) -> Iterator[Crossing]:
    for k, place in enumerate(found.places):
        below, above = found.stretches[k].growth, found.stretches[k + 1].growth
        change = changes.get(k)
        if explained(place, below, above):
            leads = tuple(_leads(found.line, place, change).values()) if change else ()
            for c in place:
                changing = change is not None and (c in leads or not any(leads))
                yield c.crossing(_mode(found.line, c), changing, _residual(c))
        else:
            interval = _interval(place)
            assert interval is not None
            yield from _counted(
                found.line,
                float(place[0].value),
                interval,
                _rises(below, above),
                change is not None,
            )


def _rises(below: Growth, above: Growth) -> dict[str, int]:
    return rises(above.pairs - below.pairs, above.reals - below.reals)


def _counted(
    line: Line, mu: float, interval: tuple[float, float], rise: dict[str, int], changes: bool
) -> Iterator[Crossing]:
    """Crossings of which only the number is known, as at a jump."""
    for kind, more in rise.items():
        if more:
            hertz = _fastest(line, interval, kind, more > 0) / (2 * math.pi)
            way = "up" if more > 0 else "down"
            yield from [Crossing(mu, kind, way, hertz, interval, 1, changes, None)] * abs(more)


def _mode(line: Line, c: Located) -> int:
    """Number of the mode by rising frequency, from 1; of a coalescing pair the first."""
    A = line.both(c.value)[0]
    if len(A) <= EXACT:
        roots = np.linalg.eigvals(A)
    else:
        near = min(line.states, key=lambda s: abs(s.value - c.value))
        roots = near.roots + (c.value - near.value) * near.slopes
    omega = np.array([line.omega(complex(z)) for z in roots])
    gap = 1e-6
    if c.coalesces:  # its two members lie on both sides: the closest one below belongs to it
        gap = max(gap, float(np.sort(np.abs(omega / (c.omega or 1.0) - 1.0))[1]) * (1 + 1e-9))
    slower = int(np.sum(omega < c.omega * (1 - gap)))
    return 1 + (slower // 2 if line.damped else slower)
