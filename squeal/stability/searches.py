"""Functions of mu that vanish at the thresholds of a family, and that are smooth even there.

Up to three degrees of freedom without damping these are the invariants of `cubic`. Otherwise the
eigenvalues are taken in groups, neighbours in their order that stay apart from all others over a
stretch of mu. A symmetric function of a group is smooth in mu even where its members coalesce, and
a product over the few members of a group neither under- nor overflows. Without damping the roots
s = -lambda^2 have a discriminant (two frequencies coalesce) and a product (one passes through
zero). With damping the product of all sums of two eigenvalues vanishes where a pair crosses the
imaginary axis (the Hurwitz determinant of Orlando's formula). Factors that rounding cannot tell
from zero for any mu belong to rigid bodies, to modes that damping spares, to frequencies that are
double for all mu: they are left out, or the product would say nothing about the others.
"""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from squeal.stability.cubic import Value
from squeal.stability.eigen import ComplexArray
from squeal.stability.family import Family, ordered_roots, place
from squeal.stability.matrices import Array, Reduced, first_order, zero_roots
from squeal.stability.roots import DEGREES, Function, Root, is_smooth, nodes

LARGEST = 4  # modes of a group
PANELS = 64  # of a stretch, in search of smaller groups; the widest are split first
SPLIT = 0.4837  # where: no share of a range that thresholds like to lie at
MEETS = 0.7  # of the distance of two roots: a change that may let them meet
ALIKE = 1e-7  # of the largest: roots which keep together for all mu
PROBES = 4  # of rounding, for the honest interval of a root

Factors = Callable[[ComplexArray], ComplexArray]


@dataclass(frozen=True)
class Search:
    """A function that vanishes at thresholds in [low, high], and the roots that it is about."""

    source: str  # coalescence, zero, axis
    damped: bool
    low: float
    high: float
    function: Function
    members: slice
    measure: Callable[[ComplexArray], float] | None = None  # the function of the ordered roots

    def interval(self, family: Family, root: Root) -> tuple[float, float]:
        """Bracket of a root with rounding taken into account.

        The error of the function is what its own bound says, or what its values close to the root
        scatter by and what errors of a rounding in each entry of the matrices do to it.
        """
        mu, (low, high) = root.mu, root.interval
        step = 1e-6 * (self.high - self.low)
        around = [x for k in range(-3, 4) if self.low <= (x := mu + k * step) <= self.high]
        values = [self.function(x) for x in around]
        at, f = (np.array(around) - mu) / step, np.array([float(v.value) for v in values])
        fit = np.polyfit(at, f, 2)
        scatter = float(np.abs(np.polyval(fit, at) - f).max())
        error = max(4 * scatter, *(float(v.bound) for v in values))
        if self.measure is not None:
            rng, exact = np.random.default_rng(0), self.function(mu).value
            for _ in range(PROBES):
                shaken = ordered_roots(_shaken(family.at(mu), rng), self.damped)
                error = max(error, 4 * abs(self.measure(shaken) - exact))
        half = step * error / abs(float(fit[1])) if fit[1] else self.high - self.low
        return (
            float(max(self.low, min(low, mu - half))),
            float(min(self.high, max(high, mu + half))),
        )

    def frequency(self, family: Family, mu: float) -> float:
        """Angular frequency (rad/s) of the member that is at a threshold."""
        if self.source == "zero":
            return 0.0
        return nearest(family.roots(mu, self.damped)[self.members], self.source, self.damped)


def nearest(roots: ComplexArray, source: str, damped: bool) -> float:
    """Angular frequency (rad/s) of the pair nearest to the axis, or of the two nearest roots."""
    if source == "axis":
        moving = roots[roots.imag > 0]
        return float(moving[np.argmin(np.abs(moving.real))].imag) if len(moving) else 0.0
    gaps = np.abs(roots[:, None] - roots[None, :]) + np.diag(np.full(len(roots), np.inf))
    i, j = np.unravel_index(np.argmin(gaps), gaps.shape)
    mean = (roots[i] + roots[j]) / 2  # of a defective pair it is well conditioned
    return float(abs(mean.imag) if damped else np.sqrt(max(mean.real, 0.0)))


def _shaken(reduced: Reduced, rng: np.random.Generator) -> Reduced:
    A, B = (
        None if X is None else X * (1 + reduced.rounding * rng.standard_normal(X.shape))
        for X in (reduced.A, reduced.B)
    )
    assert A is not None
    return Reduced(A, B, reduced.T, reduced.rounding)


def searches(family: Family, low: float, high: float) -> Iterator[Search]:
    """Functions that together tell all thresholds in [low, high], where the system is smooth."""
    inside = [low + x * (high - low) for x in (0.07, 0.31, 0.53, 0.71, 0.97)]
    damped = any(family.at(mu).B is not None for mu in inside)
    if damped or not family.small(inside[0]):
        zeros = min(_zeros(family.at(mu), damped) for mu in inside)
        yield from _grouped(family, damped, zeros, low, high)
        return
    cubics = [family.cubic(mu) for mu in inside]
    names = ("discriminant", "c")
    if all(abs(q.c.value) <= q.c.bound for q in cubics):
        names = ("discriminant2", "b")
        if all(abs(q.b.value) <= q.b.bound for q in cubics):
            names = ("", "a")
    for source, name in zip(("coalescence", "zero"), names, strict=True):
        if name:

            def f(mu: float, name: str = name) -> Value:
                value: Value = getattr(family.cubic(mu), name)
                return value

            yield Search(source, False, low, high, f, slice(None))


def _zeros(reduced: Reduced, damped: bool) -> int:
    """Multiplicity of the eigenvalue zero, told by rank."""
    if not damped:
        return zero_roots(reduced.A, reduced.rounding)
    if reduced.B is None:
        return 0
    return zero_roots(first_order(reduced.A, reduced.B)[0], reduced.rounding)


@dataclass(frozen=True)
class _Panel:
    """A stretch of mu with the roots at its sampled points (points, roots), in groups."""

    low: float
    high: float
    values: ComplexArray
    groups: list[slice]
    scale: float
    large: bool  # a group is larger than need be

    @staticmethod
    def of(family: Family, damped: bool, low: float, high: float) -> _Panel:
        places = (low, *nodes(low, high, DEGREES[0]), high)
        family.prepare(places)
        values: ComplexArray = np.array([family.roots(mu, damped) for mu in places])
        scale = float(np.abs(values).max()) or 1.0
        groups = _groups(np.array(places), values, 1e-9 * scale)
        distinct = np.any(np.diff(place(values, damped), axis=1) > ALIKE * scale, axis=0)
        large = any(distinct[g.start : g.stop - 1].sum() >= LARGEST for g in groups)
        return _Panel(low, high, values, groups, scale, large)


def _grouped(family: Family, damped: bool, zeros: int, low: float, high: float) -> Iterator[Search]:
    panels = deque([_Panel.of(family, damped, low, high)])
    count = 1
    while panels:
        panel = panels.popleft()
        low, high = panel.low, panel.high
        found = list(_searched(family, damped, zeros, panel))
        # a function that is not smooth tells that its group is none
        wanting = panel.large or not all(
            is_smooth(one.function, low, high, family.prepare) for one in found
        )
        if wanting and count < PANELS and high - low > 1e-9 * max(abs(low), abs(high)):
            middle = low + SPLIT * (high - low)
            panels.append(_Panel.of(family, damped, low, middle))
            panels.append(_Panel.of(family, damped, middle, high))
            count += 1
        else:
            yield from found


def _searched(family: Family, damped: bool, zeros: int, panel: _Panel) -> Iterator[Search]:
    values, scale = panel.values, panel.scale
    for group in panel.groups:
        unit = float(np.abs(values[:, group]).max()) or 1.0
        own: ComplexArray = values[:, group] / unit
        noise = 1e-12 * scale / unit
        wanted: list[tuple[str, Factors, float]] = []
        near_zero = np.any(np.abs(own.imag) <= 0.5 * np.abs(own))
        if near_zero:
            wanted.append(("zero", np.asarray, (1e-6 if damped else 1e-11) * scale / unit))
        if damped:
            wanted.append(("axis", _sums, noise))
        coalescing = ("coalescence", _differences, max(ALIKE, noise) ** 2)
        if not damped or near_zero or np.any(np.abs(_sums(own)).max(axis=0) <= noise):
            wanted.append(coalescing)
        for source, factors, floor in wanted:
            sizes = np.abs(factors(own))
            spared = int(np.sum(sizes <= floor, axis=1).min()) if sizes.size else 0
            if source == "zero":
                spared = min(spared, zeros)
            if spared < sizes.shape[1]:
                measure = _product(group, unit, factors, spared)
                yield Search(
                    source,
                    damped,
                    panel.low,
                    panel.high,
                    _along(family, damped, measure),
                    group,
                    measure,
                )


def _groups(mus: Array, values: ComplexArray, margin: float) -> list[slice]:
    """Runs of neighbours that may meet: roots (points, roots) at the values mus of a stretch.

    Two neighbours stay apart if in each step their distance changes by less than itself, by what
    it does in the step and by what it would do at the rates of the steps before and after it.
    """
    apart = np.diff(values.real + 1j * np.abs(values.imag), axis=1)
    steps, distance = np.diff(mus)[:, None], np.abs(apart)
    change = np.abs(np.diff(apart, axis=0))
    rate = change / steps
    before, after = np.roll(rate, 1, axis=0) * steps, np.roll(rate, -1, axis=0) * steps
    before[0], after[-1] = 0.0, 0.0
    near, far = MEETS * distance[:-1] - margin, MEETS * distance[1:] - margin
    stays = (np.maximum(change, before) < near) & (np.maximum(change, after) < far)
    edges = [0, *(np.flatnonzero(stays.all(axis=0)) + 1).tolist(), values.shape[1]]
    return [slice(a, b) for a, b in itertools.pairwise(edges)]


def _product(
    group: slice, unit: float, factors: Factors, spared: int
) -> Callable[[ComplexArray], float]:
    def measure(roots: ComplexArray) -> float:
        parts = factors(roots[group] / unit)
        if spared:
            parts = parts[np.argsort(np.abs(parts))[spared:]]
        return float(np.prod(parts).real)

    return measure


def _along(family: Family, damped: bool, measure: Callable[[ComplexArray], float]) -> Function:
    return lambda mu: Value(measure(family.roots(mu, damped)), 0.0)


def _differences(roots: ComplexArray) -> ComplexArray:
    i, j = np.triu_indices(roots.shape[-1], 1)
    return np.asarray((roots[..., i] - roots[..., j]) ** 2)


def _sums(roots: ComplexArray) -> ComplexArray:
    i, j = np.triu_indices(roots.shape[-1], 1)
    return np.asarray(roots[..., i] + roots[..., j])
