"""Greatest values of signals between the samples and the contact changes of a motion.

Where a signal turns follows from the cubic with its values and rates at both ends of a part without
a contact change; its value there from the state, interpolated alike, so that it is one of a pad.
"""

from typing import NamedTuple

import numpy as np

from squeal.model.mechanics import Coefficients
from squeal.simulation.batch.seen import Seen, Signal


class _Parts(NamedTuple):
    """Parts of motions: of which pad (p,), states at their ends (6, p), how long (p,), contact
    (points, p)."""

    lane: np.ndarray
    begin: np.ndarray
    end: np.ndarray
    lapse: np.ndarray
    on: np.ndarray


def _slope(
    a: np.ndarray, b: np.ndarray, rise: np.ndarray, end: np.ndarray, at: np.ndarray
) -> np.ndarray:
    """The slope from 0 to `at` of the cubics with these values and slopes at 0 and 1."""
    third, second = 2.0 * (a - b) + rise + end, 3.0 * (b - a) - 2.0 * rise - end
    return np.asarray(rise + at * (second + at * third))


def crest(
    a: np.ndarray, b: np.ndarray, rise: np.ndarray, end: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Where in [0, 1] the cubics with these values and slopes at 0 and 1 are greatest, and their
    value there; NaN where they are so at an end."""
    third, second = 2.0 * (a - b) + rise + end, 3.0 * (b - a) - 2.0 * rise - end
    root = np.sqrt(second**2 - 3.0 * third * rise)
    # where the slope vanishes and falls, without cancellation
    at = np.where(second < 0.0, rise / (root - second), (root + second) / (-3.0 * third))
    at = np.where((at > 0.0) & (at < 1.0), at, np.nan)
    return at, a + at * _slope(a, b, rise, end, at)


class Crests:
    """The parts of n motions, between which no contact changes, and what is greatest in them.

    met (n,): the change that makes first contact of each, or -1.
    """

    def __init__(self, s: Seen, met: np.ndarray) -> None:
        self._seen = s
        m, lane, e = s.motion, s.motion.lane, np.arange(len(s.motion.lane))
        self._low = low = np.maximum(s.row - 1, 0)
        # whether the change before is nearer than the sample before
        self._joined = joined = (lane == lane[e - 1]) & (s.row == s.row[e - 1]) & (e > 0)
        since = np.where(joined, m.t[e - 1], m.times[low, lane])
        former = m.on.copy()
        former[m.point, e] ^= 1
        begin = np.where(joined, m.state[:, e - 1], m.samples[low, :, lane].T)
        self._before = _Parts(lane, begin, m.state, m.t - since, former)
        end, rest = m.samples[s.row, :, lane].T, m.times[s.row, lane] - m.t
        self._after = _Parts(lane, m.state, end, rest, m.on)
        self._first = met[lane] == e
        self._last = ~np.append(joined[1:], False)[: len(e)]

    def highest(self, signal: Signal, row: np.ndarray, high: np.ndarray, sign: float) -> np.ndarray:
        """The greatest value (n,) of `sign` times a signal from a row (n,) of the samples on, of
        which `high` (n,) is known."""
        high = high.copy()
        s, seen_from = self._seen, self._seen.row > row[self._seen.motion.lane]
        for parts, ends, counts in (
            self._inner(signal, row, sign),
            (self._before, self._ends_before(signal), seen_from & ~self._first),
            (self._after, self._ends_after(signal), seen_from & self._last),
        ):
            a, b, rise, end = ends
            some = np.flatnonzero(counts & (sign * rise > 0.0) & (sign * end <= 0.0))
            lane, begin, after, lapse, on = (part[..., some] for part in parts)
            four = a[some], b[some], lapse * rise[some], lapse * end[some]
            at, value = crest(*(sign * one for one in four))
            above = np.flatnonzero(value > high[lane])
            lane, begin, after, lapse, on = (
                part[..., above] for part in (lane, begin, after, lapse, on)
            )
            p, q, at = begin[:3], after[:3], at[above]
            place = p + at * _slope(p, q, lapse * begin[3:], lapse * after[3:], at)
            c = Coefficients(**{name: number[lane] for name, number in vars(s.c).items()})
            np.fmax.at(high, lane, sign * signal.read(c, place, on, lane))
        return high

    def _inner(
        self, signal: Signal, row: np.ndarray, sign: float
    ) -> tuple[_Parts, tuple[np.ndarray, ...], np.ndarray]:
        """Between samples: parts, values and rates at their ends, all of which count."""
        s, samples, times = self._seen, self._seen.motion.samples, self._seen.motion.times
        rises = sign * signal.slope > 0.0
        turns = (rises[:-1] > rises[1:]) & s.same
        k, lane = np.nonzero(turns & (np.arange(len(turns))[:, None] >= row))
        begin, end = samples[k, :, lane].T, samples[k + 1, :, lane].T
        parts = _Parts(lane, begin, end, times[k + 1, lane] - times[k, lane], s.on[:, k, lane])
        values = signal.inner[k, lane], signal.inner[k + 1, lane]
        ends = *values, signal.slope[k, lane], signal.slope[k + 1, lane]
        return parts, ends, np.ones(len(k), dtype=bool)

    def _ends_before(self, signal: Signal) -> tuple[np.ndarray, ...]:
        """Values and rates at both ends of the parts before changes."""
        at, last = (self._low, self._before.lane), np.arange(len(self._low)) - 1
        first = np.where(self._joined, signal.change[last], signal.inner[at])
        rise = np.where(self._joined, signal.after[last], signal.slope[at])
        return first, signal.change, rise, signal.before

    def _ends_after(self, signal: Signal) -> tuple[np.ndarray, ...]:
        """The same of the parts after changes."""
        at = self._seen.row, self._after.lane
        return signal.change, signal.inner[at], signal.after, signal.slope[at]
