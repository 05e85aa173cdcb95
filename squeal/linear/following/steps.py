"""Roots matched from one value of the parameter to the next, and where they may cross the line.

A match is accepted if the derivatives at both ends foresee it well enough to say whether the line
between growth and decay is crossed; two roots that coalesce in between are matched as a pair, by
mean and squared difference. What is in doubt halves the step.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from squeal.linear.following.coupling import ComplexArray
from squeal.linear.following.line import Line, State
from squeal.linear.following.windows import Guess, foreseen, windows
from squeal.linear.matrices import Array

DEPTH = 12  # halvings of a step
DOUBT = 0.25  # of the change: what a prediction may be off by
NEAR = 1e-3  # of |z|: ... or this, for identity alone
FINE = 101  # points at which a pair's roots are looked at within a step
SHARES = np.linspace(0.0, 1.0, 17)[:, None]  # of a step, at which its cubics are looked at
TOUCH = 0.1  # of the way of a root: what a cubic may be off halfway


def hermite_cubic(a: Any, da: Any, b: Any, db: Any) -> Array:
    """Coefficients (4, ...) by rising powers of t through values and derivatives at 0 and 1."""
    return np.array([a, da, 3 * (b - a) - 2 * da - db, 2 * (a - b) + da + db])


def zeros_between(cubic: Array) -> list[float]:
    """Real zeros in 0 <= t <= 1, or next to it, of a cubic by rising powers."""
    if not np.any(cubic[1:]):
        return []
    roots = np.roots(cubic[::-1])
    real = roots[np.abs(roots.imag) < 1e-9].real
    return sorted(float(t) for t in real if -1e-9 <= t <= 1 + 1e-9)


class Stepper:
    """Steps along a line with a budget of states."""

    def __init__(self, line: Line, budget: int) -> None:
        self.line, self.budget = line, budget
        self.guesses: list[Guess] = []

    def go(self, low: float, high: float, depth: int = DEPTH) -> None:
        """Match all roots from low to high and collect what may cross the line."""
        a, b = self.line.at(low), self.line.at(high)
        found = _Step(self.line, a, b).matched()
        met = foreseen(a, b)
        # half the budget is kept for matches
        several = any(one.doubtful for _, one in met) and len(self.line.states) < self.budget / 2
        share = 0.4837 if found.doubt or several else found.touch
        if share is not None and depth > 0 and len(self.line.states) < self.budget:
            middle = low + share * (high - low)
            self.go(low, middle, depth - 1)
            self.go(middle, high, depth - 1)
            return
        self.guesses += found.guesses
        self.guesses += windows(self.line, met, high - low)


@dataclass
class _Matched:
    guesses: list[Guess]
    doubt: bool
    touch: float | None  # share of the step at which a root may just touch or pass the line


class _Step:
    """One step: the roots at both ends and how they belong together."""

    def __init__(self, line: Line, a: State, b: State) -> None:
        from scipy.optimize import linear_sum_assignment

        self.line, self.a, self.b = line, a, b
        self.h = b.value - a.value
        mean = self.h / 2 * (a.slopes[:, None] + b.slopes[None, :])
        cost = np.abs(b.roots[None, :] - a.roots[:, None] - mean)
        cost = np.where(np.isfinite(cost), cost, 1e300)
        _, order = linear_sum_assignment(cost)
        self.j = order
        za, zb = a.roots, b.roots[order]
        da, db = self.h * a.slopes, self.h * b.slopes[order]
        self.noise = np.maximum(a.noise, b.noise[order])
        self.za, self.zb, self.da, self.db = za, zb, da, db
        self.off = zb - za - (da + db) / 2

    def matched(self) -> _Matched:
        line, za, zb = self.line, self.za, self.zb
        guesses: list[Guess] = []
        way = np.abs(zb - za)
        known = np.abs(self.off) <= np.maximum(DOUBT * way, NEAR * np.abs(za)) + 4 * self.noise
        on_a, on_b = self.a.on_line, self.b.on_line[self.j]
        first, last = self.a.value == line.low, self.b.value == line.high
        # what lies on the line at one end alone has met another one, unless it starts or ends there
        known &= (on_a == on_b) | (first & on_a) | (last & on_b)
        clear = self._clear()
        settled = known & (clear | (on_a & on_b & ~self._real_crossing()))
        single = known & ~settled & self._monotone()
        for k in np.flatnonzero(single):
            guesses += self._singles(int(k), True)
        # off the line for good, whichever of them is which
        far = self._far()
        left = np.flatnonzero(~settled & ~single & ~far)
        taken: set[int] = set()
        for pair in self._partners(left):
            if not taken & set(pair):
                found = self._pair(*pair)
                if found is not None:
                    guesses += found
                    taken |= set(pair)
        doubtful = sorted({int(k) for k in left} - taken)
        for single_one in doubtful:  # the best there is if no step can be halved any more
            guesses += self._singles(single_one, False)
        return _Matched(guesses, bool(doubtful), self._touch(known))

    def _clear(self) -> np.ndarray:
        """Roots that surely stay on their side of the line."""
        if not self.line.damped:
            # flutter pairs stay such; real ones that do not pass zero
            apart = np.minimum(np.abs(self.za.imag), np.abs(self.zb.imag))
            return np.asarray(apart > 2 * np.abs(self.off.imag) + 4 * self.noise) | (
                self._both_real() & ~self._real_crossing()
            )
        low, high = self._extremes
        unsure = 2 * np.abs(self.off.real) + self.noise
        return np.asarray((high + unsure < 0.0) | (low - unsure > 0.0))

    def _both_real(self) -> np.ndarray:
        real = (np.abs(self.za.imag) <= self.noise) & (np.abs(self.zb.imag) <= self.noise)
        return np.asarray(real)

    def _real_crossing(self) -> np.ndarray:
        """Undamped: real roots s that may pass zero."""
        if self.line.damped:
            return np.zeros(len(self.za), dtype=bool)
        low, high = self._extremes
        unsure = 2 * np.abs(self.off.real)
        passes = (low - unsure <= 0.0) & (high + unsure >= 0.0)
        # a root that is zero at both ends belongs to a rigid body
        still = (np.abs(self.za) <= self.noise) & (np.abs(self.zb) <= self.noise)
        return np.asarray(self._both_real() & passes & ~still)

    @cached_property
    def _cubic(self) -> Array:
        """Coefficients (4, m) of the cubics of the real parts."""
        return hermite_cubic(self.za.real, self.da.real, self.zb.real, self.db.real)

    @cached_property
    def _extremes(self) -> tuple[Array, Array]:
        """The least and the greatest real parts by these cubics."""
        c = self._cubic
        values = c[0] + SHARES * (c[1] + SHARES * (c[2] + SHARES * c[3]))
        return values.min(axis=0), values.max(axis=0)

    def _touch(self, known: np.ndarray) -> float | None:
        """Where a root turns back so close to the line that the cubic does not tell if it passes.

        The cubic's error is t^2 (1 - t)^2 times a constant: none is left next to where it turns.
        """
        if not self.line.damped:
            known = known & self._both_real()
        c = self._cubic
        way = np.maximum(self._reach(), np.abs(self.off.real))
        with np.errstate(all="ignore"):  # where c' = 0
            q = -c[2] - np.copysign(np.sqrt(c[2] ** 2 - 3 * c[1] * c[3]), c[2])
            t = np.stack([q / (3 * c[3]), c[1] / q])
            off = TOUCH * 16 * (t * (1 - t)) ** 2 * way
            part = np.abs(c[0] + t * (c[1] + t * (c[2] + t * c[3]))) / off
        near = known & (t > 0) & (t < 1) & (part <= 1) & (off > self.noise)
        return float(t[near][np.argmin(part[near])]) if near.any() else None

    def _monotone(self) -> np.ndarray:
        """Crossings that the prediction tells surely: error small beside the way."""
        return np.asarray(
            np.abs(self.off.real)
            <= DOUBT * np.maximum(np.abs(self.zb.real - self.za.real), self._reach())
        )

    def _reach(self) -> Array:
        low, high = self._extremes
        return high - low

    def _far(self) -> np.ndarray:
        """Roots in doubt that lie so far to one side that no reordering reaches the line."""
        if not self.line.damped:
            return np.zeros(len(self.za), dtype=bool)
        way = np.abs(self.off) + np.abs(self.zb - self.za)
        way = np.maximum(way, np.minimum(np.abs(self.da), np.abs(self.db)))
        return np.asarray(np.sign(self.za.real) == np.sign(self.zb.real)) & np.asarray(
            np.minimum(np.abs(self.za.real), np.abs(self.zb.real)) > 2 * way
        )

    def _singles(self, k: int, sure: bool) -> Iterator[Guess]:
        z = np.array([self.za[k], self.da[k], self.zb[k], self.db[k]])
        if not self.line.damped and not self._both_real()[k]:
            return
        cubic = hermite_cubic(*z.real)
        if sure:  # on the line at an end of the range: what is beside it follows from the slope
            ends = np.where(np.abs(z.real) <= self.noise[k], 0.0, z.real)
            cubic = hermite_cubic(ends[0], z[1].real, ends[2], z[3].real)
        for t in zeros_between(cubic):
            value = complex(np.polyval(hermite_cubic(*z)[::-1], t))
            at = self.a if t < 0.5 else self.b
            index = k if t < 0.5 else self.j[k]
            yield Guess(
                self.a.value + t * self.h,
                value,
                at.right[:, index],
                at.left[:, index],
                False,
                abs(self.h),
            )

    def _partners(self, left: np.ndarray) -> list[tuple[int, int]]:
        """Pairs among roots in doubt, the closest first."""
        pairs = []
        for first, k in enumerate(left):
            for other in left[first + 1 :]:
                gap = min(abs(self.za[k] - self.za[other]), abs(self.zb[k] - self.zb[other]))
                pairs.append((float(gap), (int(k), int(other))))
        return [pair for _, pair in sorted(pairs)]

    def _pair(self, k: int, other: int) -> list[Guess] | None:
        """What two roots do that coalesce or part in the step; None if mean and d do not fit."""
        z = np.array([self.za[[k, other]], self.da[[k, other]], self.zb[[k, other]]])
        db = self.db[[k, other]]
        mean = [z[0].mean(), z[1].mean(), z[2].mean(), db.mean()]
        half = [(x[0] - x[1]) / 2 for x in (z[0], z[1], z[2], db)]
        d = [half[0] ** 2, 2 * half[0] * half[1], half[2] ** 2, 2 * half[2] * half[3]]
        for a, da, b, slope, unit in ((*mean, abs(mean[0])), (*d, max(abs(d[0]), abs(d[2])))):
            off = abs(b - a - (da + slope) / 2)
            if off > DOUBT * max(abs(b - a), 1e-3 * unit):
                return None
        means, ds = hermite_cubic(*np.array(mean)), hermite_cubic(*np.array(d))
        return list(self._along_pair(k, other, means, ds))

    def _along_pair(self, k: int, other: int, means: Array, ds: Array) -> Iterator[Guess]:
        t = np.linspace(0.0, 1.0, FINE)
        m, d = (np.polyval(c[::-1].astype(complex), t) for c in (means, ds))
        vectors = [
            (s.right[:, [p, q]], s.left[:, [p, q]])
            for s, p, q in ((self.a, k, other), (self.b, int(self.j[k]), int(self.j[other])))
        ]
        on = self.a.on_line[[k, other]].all(), self.b.on_line[[k, other]].all()
        if not self.line.damped or any(on):
            yield from self._coalescences(t, m, d, vectors)
        if self.line.damped and not all(on):
            yield from self._passing(t, m, d, vectors)
        elif not self.line.damped:
            product = (m * m - d).real  # of the two roots: one of them passes zero
            real = d.real >= 0
            for n in np.flatnonzero((product[1:] * product[:-1] < 0) & real[1:] & real[:-1]):
                right, left = vectors[int(t[n] > 0.5)]
                for i in (0, 1):  # either may be the one
                    p = self.a.value + t[n] * self.h
                    yield Guess(p, 0j, right[:, i], left[:, i], False, self.h)

    def _coalescences(
        self, t: Array, m: ComplexArray, d: ComplexArray, vectors: list
    ) -> Iterator[Guess]:
        for n in np.flatnonzero(d.real[1:] * d.real[:-1] < 0):
            place = t[n] + (t[n + 1] - t[n]) * abs(d[n]) / (abs(d[n]) + abs(d[n + 1]))
            right, left = vectors[int(place > 0.5)]
            yield Guess(self.a.value + place * self.h, complex(m[n]), right, left, True, self.h)

    def _passing(
        self, t: Array, m: ComplexArray, d: ComplexArray, vectors: list
    ) -> Iterator[Guess]:
        half = np.sqrt(d)
        turned = np.cumprod(np.where((half[1:] * half[:-1].conj()).real < 0, -1, 1))
        half[1:] *= turned  # a branch that does not jump
        for sign in (1, -1):
            z = m + sign * half
            for n in np.flatnonzero(z.real[1:] * z.real[:-1] < 0):
                right, left = vectors[int(t[n] > 0.5)]
                yield Guess(self.a.value + t[n] * self.h, complex(z[n]), right, left, False, self.h)
