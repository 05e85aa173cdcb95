"""Greatest values of signals between the samples and the contact changes of a motion.

Where a signal turns follows from the cubic with its values and rates at both ends of a part without
a contact change; its value there from the state, interpolated alike, so that it is one of a pad.
"""

from typing import NamedTuple

import numpy as np

from squeal.model.mechanics import Coefficients
from squeal.simulation.batch.seen import Seen, Signal

LAPSE = 1e-7  # natural time within which the rate of a signal is taken
NEAR = 0.1  # of the range of a signal: how near to its greatest value a crest may begin


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

    def extremes(
        self, signal: Signal, row: np.ndarray, low: np.ndarray, high: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """The least and greatest values (n,) of a signal from a row (n,) of the samples on.

        They are `low` and `high` (n,) at samples and changes.
        """
        s, lane, change = self._seen, self._seen.motion.lane, signal.change
        n, counts, room = len(row), s.row > row[lane], NEAR * (high - low)
        begun = signal.change[np.arange(len(lane)) - 1]
        begun = np.where(self._joined, begun, signal.inner[self._low, lane])
        ended = signal.inner[s.row, lane]
        best, chosen, signs = np.concatenate([high, -low]), [], []
        for sign, known in ((1.0, best[:n]), (-1.0, best[n:])):
            enough = known - room
            chosen.append(self._inner(sign * signal.inner, row, enough))
            for parts, a, b, some in (
                (self._before, begun, change, counts & ~self._first),
                (self._after, change, ended, counts & self._last),
            ):
                near = some & (np.fmax(sign * a, sign * b) > enough[lane])
                chosen.append(_Parts(*(part[..., near] for part in parts)))
            signs += [sign] * 3
        parts = _Parts(*(np.concatenate(part, axis=-1) for part in zip(*chosen, strict=True)))
        of = np.repeat(signs, [len(one.lane) for one in chosen])
        np.fmax.at(best, parts.lane + n * (of < 0.0), self._values(signal, of, parts))
        return -best[n:], best[:n]

    def _values(self, signal: Signal, sign: np.ndarray, parts: _Parts) -> np.ndarray:
        """`sign` times the signal where that is greatest within each part, or NaN."""
        lane, begin, end, lapse, on = parts
        c = Coefficients(*(number[lane] for number in self._seen.c))

        def read(place: np.ndarray) -> np.ndarray:
            return sign * signal.read(c, place, on, lane)

        a, b, p, q = read(begin[:3]), read(end[:3]), begin[:3], end[:3]
        rise, fall = (
            lapse * (read(x[:3] + LAPSE * x[3:]) - value) / LAPSE
            for x, value in ((begin, a), (end, b))
        )
        at, _ = crest(a, b, rise, fall)
        return read(p + at * _slope(p, q, lapse * begin[3:], lapse * end[3:], at))

    def _inner(self, values: np.ndarray, row: np.ndarray, enough: np.ndarray) -> _Parts:
        """The parts between samples beside one that is as high as its neighbours and `enough`."""
        s, samples, times = self._seen, self._seen.motion.samples, self._seen.motion.times
        rises = np.diff(values, axis=0) > 0.0
        edge = np.ones((1, values.shape[1]), dtype=bool)
        top = np.concatenate([edge, rises]) & np.concatenate([~rises, edge]) & (values > enough)
        beside = (top[:-1] | top[1:]) & s.same & (np.arange(len(rises))[:, None] >= row)
        k, lane = np.nonzero(beside)
        begin, end = samples[k, :, lane].T, samples[k + 1, :, lane].T
        return _Parts(lane, begin, end, times[k + 1, lane] - times[k, lane], s.on[:, k, lane])
