"""From one value of the parameter to the next: which roots are the same, and where two may meet.

From one value to the next roots are matched by where their slopes at both ends point; two that
coalesce in between are matched as a pair, by mean and squared half difference. What is in doubt
halves the step. Two roots that come close within a step are predicted from their coupling. In the
eigenvectors of A(p) the matrix at p + x is diag(z) + x W, exactly if its factors are affine, so
that roots k, l follow diag(z_k, z_l) + x [[W_kk, a], [b, W_ll]], in which all others shift the
coupling to a = W_kl + x T_kl, b = W_lk + x T_lk with
T_kl = sum_m W_km W_ml (1 / (z_k - z_m) + 1 / (z_l - z_m)) / 2.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.linear.continuation import (
    DAMPED,
    Bools,
    ComplexArray,
    ContinuationOptions,
    SpectrumAtParameter,
    hermite_cubic,
)
from squeal.linear.eigen import (
    assigned,
)
from squeal.linear.matrices import (
    Array,
)


@dataclass(frozen=True, eq=False)
class Guess:
    """A place where one root may cross the line, or two may meet on it."""

    value: float
    root: complex  # of two the mean
    right: ComplexArray  # (N, 1) or (N, 2)
    left: ComplexArray
    coalesces: bool
    width: float  # of the parameter within which it must lie, or half of where two stay close
    doubtful: bool = False  # other roots decide over the coupling of the two


def near_coalescences(before: SpectrumAtParameter, after: SpectrumAtParameter) -> Iterator[Guess]:
    """Pairs that may meet, or exchange and cross the line, within a step; seen from both ends."""
    span = after.value - before.value
    yield from _meetings_seen_from(before, span, 1)
    yield from _meetings_seen_from(after, span, -1)


class _Approaches(NamedTuple):
    """Pairs of roots k, l whose squared half difference is (u + x v)^2 / 4 + x^2 a b at a distance
    x from an end of a step.

    `ends` (2, pairs) are its zeros, `inside` (3, pairs) says which of them, and their middle, lie
    in the step. The roots cross without their coupling at `crossing`; `crosses`: in the step.
    """

    k: NDArray[np.intp]
    l: NDArray[np.intp]
    conjugate: Bools
    u: ComplexArray
    v: ComplexArray
    a: ComplexArray
    b: ComplexArray
    crossing: Array
    crosses: Bools
    ends: Array
    inside: Bools

    def select(self, chosen: Bools) -> _Approaches:
        """Some of the pairs."""
        return _Approaches._make(each[..., chosen] for each in self)


def _approaches(state: SpectrumAtParameter, span: float, direction: int) -> _Approaches:
    """All pairs, looking forwards (1) or backwards (-1)."""
    pairs = state.couplings
    slopes = direction * state.slopes
    u = state.roots[pairs.k] - state.roots[pairs.l]
    v = slopes[pairs.k] - slopes[pairs.l]
    crossing = np.nan_to_num((-u / v).real)
    crosses = (crossing > 0) & (crossing < span) & (state.problem is not DAMPED)
    crossing = np.clip(crossing, 0.0, span)
    v = v + crossing * pairs.bend
    a, b = direction * pairs.direct + crossing * pairs.indirect
    split = 2 * np.sqrt(-a * b)
    ends = np.stack([-u / (v - split), -u / (v + split)]).real
    ends = np.where(np.isfinite(ends), ends, 1e9 * span)
    middle_and_ends = np.stack([*ends, ends.mean(axis=0)])
    return _Approaches(
        k=pairs.k,
        l=pairs.l,
        conjugate=pairs.conjugate,
        u=u,
        v=v,
        a=a,
        b=b,
        crossing=crossing,
        crosses=crosses,
        ends=ends,
        inside=np.abs(middle_and_ends - span / 2) <= span / 2,
    )


def _meetings_seen_from(state: SpectrumAtParameter, span: float, direction: int) -> Iterator[Guess]:
    """Near coalescences within a step of this length from one of its ends."""
    with np.errstate(all="ignore"):
        every = _approaches(state, span, direction)
        near = every.inside.any(axis=0) | every.crosses
        if not near.any():
            return
        pairs = every.select(near)
        k = pairs.k
        l = pairs.l
        ends = pairs.ends
        inside = pairs.inside
        w = pairs.a * pairs.b
        centre = ends.mean(axis=0)
        half = np.abs(ends[0] - ends[1]) / 2
        # of a wide window the end that lies in the step
        end_inside = np.where(inside[0], ends[0], ends[1])
        place = np.clip(np.where(inside[2], centre, end_inside), 0.0, span)
        width = np.abs(pairs.u * np.sqrt(w) / pairs.v**2)
        width = width + 1e-6 * span  # also where both ends are one
        offsets = 10.0 ** np.linspace(-1.0, 0.9, 12)  # of the half width of a close approach
        offsets = np.concatenate([-offsets, [0.0], offsets])[:, None]
        x = np.clip(centre + offsets * np.maximum(half, width), 0.0, span)
        d = (pairs.u + x * pairs.v) ** 2 / 4 + x**2 * w
        third = _third_root_coupling(state, pairs, direction)
        error = x**2 * (third + 0.1 * np.abs(w))  # a tenth of the pair's own coupling may be wrong
        slopes = direction * state.slopes
        mean = (state.roots[k] + state.roots[l]) / 2
        mean_slope = (slopes[k] + slopes[l]) / 2
        noise_k = state.rounding[k]
        noise_l = state.rounding[l]
        passes = _passes_zero(d.real, error)
        if state.problem is DAMPED:
            slack = np.minimum(np.sqrt(error), error / np.sqrt(np.abs(d))) + noise_k + noise_l
            middle = (mean + x * mean_slope).real
            split = np.sqrt(d).real
            passes |= ~pairs.conjugate
            passes &= _passes_zero(middle + split, slack) | _passes_zero(middle - split, slack)
        # what rounding alone couples
        passes &= x.max(axis=0) ** 2 * (np.abs(w) + third) > noise_k * noise_l
        doubtful = third > np.abs(w)
        passes |= pairs.crosses & doubtful & (pairs.crossing**2 * third > noise_k * noise_l)
    for n in np.flatnonzero(passes).tolist():
        both = [k[n], l[n]]
        yield Guess(
            value=state.value + direction * float(place[n]),
            root=complex(mean[n] + place[n] * mean_slope[n]),
            right=state.right[:, both],
            left=state.left[:, both],
            coalesces=True,
            width=float(half[n]),
            doubtful=bool(doubtful[n]),
        )


def _third_root_coupling(state: SpectrumAtParameter, pairs: _Approaches, direction: int) -> Array:
    """How other roots, near where the two of a pair meet, may change the product a b (pairs,)."""
    k = pairs.k
    l = pairs.l
    W = state.coupling
    crossing = pairs.crossing[:, None]
    row = np.arange(len(k))
    there = state.roots + crossing * (direction * state.slopes)
    distances = there - (there[row, k] + there[row, l])[:, None] / 2
    distances[row, k] = distances[row, l] = np.inf
    forth = np.abs(crossing * W[k] * W[:, l].T / distances).sum(axis=1)
    back = np.abs(crossing * W[l] * W[:, k].T / distances).sum(axis=1)
    return np.asarray(forth * np.abs(pairs.b) + back * np.abs(pairs.a) + forth * back)


def may_exchange_partner(before: SpectrumAtParameter, after: SpectrumAtParameter) -> bool:
    """True if a root on the line may take the partner of a root off it; without damping.

    It passes so closely that coupling moves the root off the line by a quarter of its distance.
    """
    span = after.value - before.value
    return _may_exchange_partner(before, span, 1) or _may_exchange_partner(after, span, -1)


def _may_exchange_partner(state: SpectrumAtParameter, span: float, direction: int) -> bool:
    """The same as seen from one end of the step.

    Between a root i off the line and a root j on it the coupling W, a distance x ahead, moves root
    i by x^2 W_ij W_ji / (z_i - z_j); its partner is its conjugate, at twice its height.
    """
    z = state.roots
    W = state.coupling
    slopes = direction * state.slopes
    above = z.imag > state.rounding
    if state.problem is DAMPED or not above.any():
        return False
    gap = z[:, None] - z
    gap_slope = slopes[:, None] - slopes
    with np.errstate(all="ignore"):
        closest = -(gap * gap_slope.conj()).real / np.abs(gap_slope) ** 2
        moved = closest**2 * np.abs(W * W.T) / np.abs(gap + closest * gap_slope)
        height = np.abs(z.imag[:, None] + closest * slopes.imag[:, None])
        exchanges = (closest > 0) & (closest < span) & (4 * moved > height)
    return bool(exchanges[np.ix_(above, state.on_line)].any())


def _passes_zero(values: Array, slack: Array) -> Bools:
    """Which columns have values on both sides of zero, each up to its slack."""
    return np.asarray(((values - slack).min(axis=0) < 0) & ((values + slack).max(axis=0) > 0))


class StepEnds(NamedTuple):
    """Roots (m,) before a step, their slopes times its length, and the same after it."""

    z: ComplexArray
    dz: ComplexArray
    later_z: ComplexArray
    later_dz: ComplexArray


class RootPair(NamedTuple):
    """Two roots by their indices at the beginning of a step, and cubics (4,) over it of their mean
    and of the squared half difference."""

    indices: list[int]
    mean: ComplexArray
    square: ComplexArray


class Step:
    """Two neighbouring states, and which root of the one is which of the other.

    `order` is the index after the step of each root before it, -1 of one that is left over where
    there are fewer, which nothing matches; `deviation` is how far each root is
    from where the slopes at both ends point, `matched` says where that is little; `cubic` (4, m)
    goes through the real parts, from `lowest` to `highest`.
    """

    def __init__(
        self, before: SpectrumAtParameter, after: SpectrumAtParameter, options: ContinuationOptions
    ) -> None:
        self.before = before
        self.after = after
        self.options = options
        h = after.value - before.value
        slope_sums = before.slopes[:, None] + after.slopes
        slope_changes = before.slopes[:, None] - after.slopes
        mismatch = np.abs(after.roots - before.roots[:, None] - h / 2 * slope_sums)
        # two that cross in the middle fit as well if each turns back: the smaller change of slope
        self.mismatch = mismatch + 0.01 * np.abs(h * slope_changes)
        self.order = assigned(self.mismatch)
        self.ends = StepEnds(
            z=before.roots,
            dz=h * before.slopes,
            later_z=after.roots[self.order],
            later_dz=h * after.slopes[self.order],
        )
        z, dz, later_z, later_dz = self.ends
        self.deviation = later_z - z - (dz + later_dz) / 2
        self.rounding = np.maximum(before.rounding, after.rounding[self.order])
        allowed = np.maximum(options.doubt * np.abs(later_z - z), options.near * np.abs(z))
        self.matched = np.abs(self.deviation) <= allowed + 4 * self.rounding
        self.matched &= self.order >= 0
        self.cubic = hermite_cubic(z.real, dz.real, later_z.real, later_dz.real)
        c = self.cubic
        t = np.linspace(0.0, 1.0, 17)[:, None]
        values = c[0] + t * (c[1] + t * (c[2] + t * c[3]))
        self.lowest = values.min(axis=0)
        self.highest = values.max(axis=0)

    @cached_property
    def same_mode(self) -> Bools:
        """Which roots (m, m') before and after are one mode by their vectors, slopes considered.

        |left^H right| of both ends is near 1 of one mode, near 0 of any other; in a row its
        products with what it is the other way round add up to 1.
        """
        before = self.before
        after = self.after
        options = self.options

        def products(left_of: SpectrumAtParameter, right_of: SpectrumAtParameter) -> Array:
            return np.abs(left_of.left.conj().T @ right_of.right)

        with np.errstate(all="ignore"):
            norms = np.multiply.outer(
                products(before, before).diagonal(), products(after, after).diagonal()
            )
            alike = products(before, after) * products(after, before).T / norms
        allowed = options.doubt * np.abs(after.roots - before.roots[:, None])
        allowed = np.maximum(allowed, options.near * np.abs(before.roots)[:, None])
        same = alike > options.alike
        same |= (alike > options.likely) & (self.mismatch <= allowed)
        only_one = (same.sum(axis=0) == 1) & (same.sum(axis=1) == 1)[:, None]
        return np.asarray(same & only_one)

    def vectors(self, t: float, roots: Sequence[int]) -> tuple[ComplexArray, ComplexArray]:
        """Right and left vectors of roots (indices before the step) at its nearer end."""
        if t < 0.5:
            indices = list(roots)
            return self.before.right[:, indices], self.before.left[:, indices]
        indices = self.order[list(roots)].tolist()
        return self.after.right[:, indices], self.after.left[:, indices]

    def pairs(self, roots: Sequence[int]) -> Iterator[RootPair]:
        """The pairs of roots (indices before the step), the closest first, whose mean and squared
        half difference follow cubics."""

        def closest(two: tuple[int, int]) -> float:
            k, l = two
            z = self.ends.z
            later_z = self.ends.later_z
            return min(abs(z[k] - z[l]), abs(later_z[k] - later_z[l]))

        remaining = set(roots)
        for two in sorted(itertools.combinations(roots, 2), key=closest):
            if not remaining.issuperset(two):
                continue
            ends = np.array([values[list(two)] for values in self.ends])
            mean = ends.mean(axis=1)
            half = (ends[:, 0] - ends[:, 1]) / 2
            square = half[0] ** 2, 2 * half[0] * half[1], half[2] ** 2, 2 * half[2] * half[3]
            largest = max(abs(square[0]), abs(square[2]))
            if self._is_cubic(mean, abs(mean[0])) and self._is_cubic(square, largest):
                remaining -= set(two)
                yield RootPair(list(two), hermite_cubic(*mean), hermite_cubic(*square))

    def _is_cubic(self, ends: Sequence[complex], size: float) -> bool:
        """True if slopes predict the change of something of that size within the step."""
        z, dz, later_z, later_dz = ends
        allowed = self.options.doubt * max(abs(later_z - z), self.options.near * size)
        return bool(abs(later_z - z - (dz + later_dz) / 2) <= allowed)
