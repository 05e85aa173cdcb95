"""Short stretches of growth or rest where two roots pass each other, foreseen from a step's end.

In the words of `coupling` the squared half difference of two roots,
d = (z_k - z_l + x (W_kk - W_ll))^2 / 4 + x^2 a b, tells whether they may meet, or exchange so much
of their real parts that one of them grows. What may be is looked at on the pair itself.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from squeal.linear.following.coupling import ComplexArray
from squeal.linear.following.line import Line, State
from squeal.linear.following.pairs import Pair, pair_at
from squeal.linear.matrices import Array

FINE = 101  # points at which a pair's roots are looked at around its closest approach
WINDOW = 8.0  # half-widths of a pair's closest approach that are looked at
GRID = np.concatenate([[0.0], *([-s, s] for s in np.geomspace(0.1, WINDOW, 12))])
EXCHANGE = 0.3  # of what two roots exchange: error of the foresight that is allowed for
THIRD = 0.5  # of what other roots change in the coupling: the same
SAME = 1e-6  # relative: means of one pair, foreseen from both ends of a step
ROUNDS = 4  # moves to the closest approach of a pair


@dataclass(frozen=True, eq=False)
class Guess:
    """A place where the line may be crossed: by one root, or by two that coalesce."""

    value: float
    root: complex
    right: ComplexArray  # (N,) or (N, 2)
    left: ComplexArray
    coalesces: bool
    width: float  # of the parameter within which it must lie


@dataclass(frozen=True)
class Meeting:
    """Two roots that may meet, by index, how far away, and their mean there."""

    first: int
    second: int
    step: float
    half: float  # of the way on which they stay close
    mean: complex
    doubtful: bool  # other roots decide over their coupling

    def joins(self, other: "Meeting") -> bool:
        """True if both happen to one root at once, so that three meet."""
        shared = {self.first, self.second} & {other.first, other.second}
        return len(shared) == 1 and abs(self.step - other.step) <= self.half + other.half


def meetings(state: State, way: int, span: float) -> list[Meeting]:
    """Pairs of roots that may change what grows within 0 <= x <= span, and how far away.

    `way` is 1 for a rising parameter, -1 for a falling one. Undamped: roots that turn complex on
    the positive real axis, or back; damped: real parts that pass zero.
    """
    of, z, noise = state.couplings, state.roots, state.noise
    k, l, conjugate = of.k, of.l, of.conjugate
    own = way * state.slopes
    with np.errstate(all="ignore"):
        u, v = of.apart, way * (of.own[0] - of.own[1])
        x = np.clip(np.nan_to_num((-u / v).real), 0.0, span)
        v = v + x * of.bend
        a, b = way * of.direct + x * of.indirect
        third = THIRD * x * (np.abs(of.alone[0] * b) + np.abs(of.alone[1] * a))
        s = 2 * np.sqrt(-a * b)
        ends = np.stack([-u / (v - s), -u / (v + s)]).real
        ends = np.where(np.isfinite(ends), ends, 1e9 * span)
        centre, half = ends.mean(axis=0), np.abs(ends[0] - ends[1]) / 2
        inside = np.abs(np.stack([*ends, centre]) - span / 2) <= span / 2
        near = inside.any(axis=0)
        if not near.any():
            return []
        ends, inside = ends[:, near], inside[:, near]
        k, l, u, v, w = k[near], l[near], u[near], v[near], (a * b)[near]
        conjugate = conjugate[near]
        third, centre, half = third[near], centre[near], half[near]
        # of a wide window the end that lies in the step
        at = np.where(np.abs(centre - span / 2) <= span / 2, centre, np.where(inside[0], *ends))
        width = np.abs(u * np.sqrt(w) / v**2) + 1e-6 * span  # also where both ends are one
        x = np.clip(centre + GRID[:, None] * np.maximum(half, width), 0.0, span)
        d, error = (u + x * v) ** 2 / 4 + x**2 * w, x**2 * (third + EXCHANGE**2 * np.abs(w))
        mean, mean_slope = (z[k] + z[l]) / 2, (own[k] + own[l]) / 2
        if state.damped:
            slack = np.minimum(np.sqrt(error), error / np.sqrt(np.abs(d))) + noise[k] + noise[l]
            same, exchange = (mean + x * mean_slope).real, np.sqrt(d).real
            passes = _passes(same + exchange, slack) | _passes(same - exchange, slack)
            passes &= ~conjugate | _passes(d.real, error)
        else:
            passes = _passes(d.real, error)
        # what rounding alone couples
        passes &= x.max(axis=0) ** 2 * (np.abs(w) + third) > noise[k] * noise[l]
        mean = mean + at * mean_slope
    return [
        Meeting(
            int(k[n]),
            int(l[n]),
            float(at[n]),
            float(half[n]),
            complex(mean[n]),
            bool(third[n] > np.abs(w[n])),
        )
        for n in np.flatnonzero(passes)
    ]


def _passes(values: Array, slack: Array) -> np.ndarray:
    return np.asarray(((values - slack).min(axis=0) < 0) & ((values + slack).max(axis=0) > 0))


def foreseen(a: State, b: State) -> list[tuple[State, Meeting]]:
    """Meetings within a step, from both ends; steps are seen from there and negative from b."""
    found = []
    for state, way in ((a, 1), (b, -1)):
        met = meetings(state, way, b.value - a.value)
        for one in met:
            doubtful = one.doubtful or any(map(one.joins, met))
            found.append((state, replace(one, step=way * one.step, doubtful=doubtful)))
    return found


def windows(line: Line, met: list[tuple[State, Meeting]], width: float) -> Iterator[Guess]:
    """Where two roots that are foreseen to meet within a step change what grows."""
    seen: list[tuple[float, complex]] = []
    for state, one in met:
        both, p = [one.first, one.second], state.value + one.step
        pair = _nearest(line, p, one.mean, state.right[:, both], state.left[:, both], width)
        if pair is None:
            continue
        x, half = _approach(pair, line.damped)
        place, mean = pair.value + x, pair.mean + x * pair.mean_slope
        if not any(abs(place - q) <= half and abs(mean - z) <= SAME * abs(z) for q, z in seen):
            seen.append((place, mean))
            yield from _window(pair, line.damped, width)


def _nearest(
    line: Line, p: float, near: complex, right: ComplexArray, left: ComplexArray, width: float
) -> Pair | None:
    """The pair at its closest approach."""
    for _ in range(ROUNDS):
        try:
            pair = pair_at(line, p, near, right, left)
        except np.linalg.LinAlgError:
            return None
        right, left = pair.right, pair.left
        centre, half = _approach(pair, line.damped)
        if abs(centre) <= WINDOW / 2 * half or half >= width / WINDOW:
            break
        if not abs(centre) <= width:
            return None
        p = float(np.clip(p + centre, line.low, line.high))
        near = pair.mean + (p - pair.value) * pair.mean_slope
    return pair


def _approach(pair: Pair, damped: bool) -> tuple[float, float]:
    """How far away two roots come closest, and half of how long they stay there."""
    c = (
        [pair.d_bend, pair.d_slope, pair.d]
        if damped
        else [pair.d_bend.real, pair.d_slope.real, pair.d.real]
    )
    ends = np.roots(c)
    if len(ends) < 2:
        return np.inf, 0.0
    centre = float(ends.real.mean())
    return centre, float(np.abs(ends - centre).max())


def _window(pair: Pair, damped: bool, width: float) -> Iterator[Guess]:
    """Crossings of the line around the closest approach of a pair, if there are any."""
    right, left = pair.right, pair.left
    centre, half = _approach(pair, damped)
    if half == 0.0 or not np.isfinite(centre):
        return
    if not damped:
        bend, slope = pair.d_bend.real, pair.d_slope.real
        # beyond rounding d has the other sign there
        if slope**2 - 4 * bend * pair.d.real <= 16 * abs(bend) * pair.noise:
            return
        for x in (centre - half, centre + half):
            if abs(x) <= width:
                z = complex(pair.mean + x * pair.mean_slope)
                yield Guess(pair.value + x, z, right, left, True, min(4 * half, width))
        return
    steps = centre + np.linspace(-WINDOW, WINDOW, 4 * FINE) * half
    steps = steps[np.abs(steps) < width]
    steps = np.unique(np.concatenate([steps, np.linspace(-width, width, FINE)]))
    both = pair.roots(steps)
    number = (both.real > 0.0).sum(axis=1)
    for n in np.flatnonzero(number[1:] != number[:-1]):
        z = complex(both[n, np.argmin(np.abs(both[n].real))])
        yield Guess(pair.value + steps[n], z, right, left, False, min(4 * half, width))
