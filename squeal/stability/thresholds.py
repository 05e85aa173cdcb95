"""Every value of mu in a range at which the verdict on a family of systems changes.

Candidates are the roots of functions of mu that vanish where an eigenvalue changes its kind and
that are smooth even there, unlike real parts: without damping the discriminant of the polynomial
in s = -lambda^2 (two frequencies coalesce) and the product of its roots (one passes through
zero); with damping the product of all sums of two eigenvalues (the Hurwitz determinant of
Orlando's formula: a pair crosses the imaginary axis), the product of all eigenvalues and the
discriminant (a pair meets on the real axis). The verdict between neighbouring candidates then
tells which of them matter. Zero roots that the system has for all mu are taken out first. Where a
pair and a real mode grow together, the difference of their growth rates is searched as well. What
is left (crossings of the axis where another mode stays undamped for all mu) is seen by the
verdicts at the sampled points, and bisected.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from squeal.errors import ComputationError, InputError
from squeal.stability.cubic import Value
from squeal.stability.family import GROWING, Candidate, Family
from squeal.stability.matrices import System, check_system
from squeal.stability.roots import Root, sign_changes

MERGE = 1e-12  # candidates closer than this, relative to the range, are one


@dataclass(frozen=True)
class CriticalPoint:
    """A change of verdict on the way up in mu."""

    mu: float
    kind: str  # flutter, divergence: what follows; restabilised: neither follows any more
    frequency_hz: float  # of the mode concerned, at mu; 0 where a real root is
    interval: tuple[float, float]  # bracket of mu; the point itself at a breakpoint
    converged: bool


def _candidates(family: Family, low: float, high: float) -> tuple[list[Candidate], set[float]]:
    found: list[Candidate] = []
    points: set[float] = set()
    for source, f in family.functions(low, high):
        roots, sampled = sign_changes(f, low, high)
        found += [Candidate(root, source) for root in roots]
        points.update(sampled)
    # between those places no mode changes its kind, but the faster growth may change hands
    for a, b in itertools.pairwise([low, *sorted(c.root.mu for c in found), high]):
        middle, margin = (a + b) / 2, 1e-9 * (b - a)
        damped = family.at(middle).B is not None
        if margin > 0 and min(family.lead(middle, damped)) > 0:

            def difference(mu: float, damped: bool = damped) -> Value:
                pair, real = family.lead(mu, damped)
                return Value(pair - real, 0.0)

            roots, sampled = sign_changes(difference, a + margin, b - margin)
            found += [Candidate(root, "growth") for root in roots]
            points.update(sampled)
    return found, points


def _bisected(family: Family, low: float, high: float) -> Candidate:
    """A change of verdict that no function announced."""
    before = family.verdict(low)
    while high - low > 4 * np.spacing(max(abs(low), abs(high))):
        middle = (low + high) / 2
        if family.verdict(middle) == before:
            low = middle
        else:
            high = middle
    tight = high - low <= 1e-12 * max(abs(low), abs(high))
    return Candidate(Root((low + high) / 2, (low, high), tight), "growth")


def critical_points(
    system: System, mu_max: float, breakpoints: Iterable[float] = (), mu_min: float = 0.0
) -> list[CriticalPoint]:
    """All changes of verdict of system(mu) -> (M, C, K) for mu_min <= mu <= mu_max, sorted.

    `system` must be smooth between the `breakpoints` (values of mu where it may jump, a change of
    contact for instance); it is asked for values next to them, never at them. A point at mu_min
    means that the system is quiet there and grows at once above it. A window of growth gives two
    points, however narrow: the limit is where rounding fills it, 1e-6 of mu or less. Raises
    InputError for an empty range and whatever `system` raises.
    """
    check_system(system, "critical_points")
    if not (math.isfinite(mu_min) and math.isfinite(mu_max) and mu_min < mu_max):
        raise InputError(f"mu_max: {mu_max:g} is not allowed; it must exceed {mu_min:g}")
    family = Family(system)
    inner = sorted({float(b) for b in breakpoints if mu_min < b < mu_max})
    edges = [mu_min, *inner, mu_max]
    candidates = [Candidate(Root(b, (b, b), True), "jump") for b in inner]
    points: set[float] = set()
    for low, high in itertools.pairwise(edges):
        start = low if low == mu_min else float(np.nextafter(low, high))
        stop = high if high == mu_max else float(np.nextafter(high, low))
        found, sampled = _candidates(family, start, stop)
        candidates += found
        points |= sampled
    return _judged(family, _merged(candidates, MERGE * (mu_max - mu_min)), points, edges)


def _merged(candidates: list[Candidate], width: float) -> list[Candidate]:
    """One candidate for each place; a breakpoint wins over roots next to it."""
    result: list[Candidate] = []
    for candidate in sorted(candidates, key=lambda c: c.root.mu):
        if result and candidate.root.mu - result[-1].root.mu <= width:
            if candidate.source == "jump":
                result[-1] = candidate
        else:
            result.append(candidate)
    return result


def _judged(
    family: Family, candidates: list[Candidate], points: set[float], edges: list[float]
) -> list[CriticalPoint]:
    low, high = edges[0], edges[-1]
    width = high - low
    places = [c.root.mu for c in candidates]
    middles = {(a + b) / 2 for a, b in itertools.pairwise([low, *places, high]) if b > a}
    near = np.array([*places, *edges[1:-1], np.inf])
    middles |= {p for p in points if np.abs(near - p).min() > 1e-9 * width}
    middles |= {mu for mu in (_beyond(family, places, high),) if mu is not None}
    first = family.verdict(low)
    changes: list[CriticalPoint] = []
    below_mu, below = low, first
    for mu in sorted(middles):
        above = family.verdict(mu)
        if above != below:
            between = [c for c in candidates if below_mu <= c.root.mu <= mu]
            candidate = _responsible(family, between, (below_mu, mu), 1e-8 * width)
            kind = above if above in GROWING else "restabilised"
            root = candidate.root
            frequency = family.frequency(candidate, (below, above))
            changes.append(CriticalPoint(root.mu, kind, frequency, root.interval, root.converged))
        below_mu, below = mu, above
    return changes


def _responsible(
    family: Family, between: list[Candidate], span: tuple[float, float], step: float
) -> Candidate:
    """The candidate at which the verdict changes from that at span[0] to that at span[1]."""
    low, high = span
    for candidate in between:
        mu = candidate.root.mu
        left, right = max(mu - step, (mu + low) / 2), min(mu + step, (mu + high) / 2)
        same = family.verdict(left) == family.verdict(low)
        if candidate.source == "jump" or (same and family.verdict(right) == family.verdict(high)):
            return candidate
    found = _bisected(family, low, high)
    near = [c for c in between if abs(c.root.mu - found.root.mu) <= 100 * step]
    return near[0] if near else found


def _beyond(family: Family, places: list[float], high: float) -> float | None:
    """A point just above the range where a candidate lies at its very end."""
    if not places or high - places[-1] > 1e-9 * abs(high):
        return None
    mu = high + 1e-6 * abs(high)
    try:
        family.verdict(mu)
    except (InputError, ComputationError, ValueError, ArithmeticError):
        return None
    return mu
