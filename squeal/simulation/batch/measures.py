"""Measures of one or several motions at once, from samples and contact changes.

Peaks of signals come from the cubic between samples and contact changes with the rates there,
those of velocities from the parabola through three samples; what a pad has not is NaN.
"""

from typing import NamedTuple

import numpy as np

from squeal.model.law import ContactLaw
from squeal.model.law import Signal as Plotted
from squeal.model.mechanics import Coefficients, Pose, at_speed, facing, pose, springs
from squeal.model.states import STATES
from squeal.simulation.batch.crests import Crests
from squeal.simulation.batch.motion import Motion
from squeal.simulation.batch.seen import Read, Seen, Signal

START = 1e-9  # values below this at the start count as zero: nothing has moved yet
LATE = 0.1  # share of the time after first contact that counts as the end of the run
# where a state stands if its number is leading + 2 trailing
_CODES = [state.leading + 2 * state.trailing for state in STATES]
_APART = np.array([[not state[edge] for state in STATES] for edge in (0, 1)], dtype=float)

Measures = dict[str, np.ndarray]


class _Begin(NamedTuple):
    """First contact of each pad, (n,) each.

    t: its time, inf if there is none; change: the contact change that makes it, -1 if the pad
    starts in contact; row: the last sample until then (beyond all if there is none).
    """

    t: np.ndarray
    change: np.ndarray
    row: np.ndarray


def doubtful(law: ContactLaw, c: Coefficients, motion: Motion, margin: float) -> np.ndarray:
    """True (n,) for pads whose motion may have missed a contact change: the integrator gave up, or
    a gap has the wrong sign at the end by more than `margin`."""
    touching = motion.touching.copy()
    np.add.at(touching, (motion.point, motion.lane), 1)
    heights = np.array(law.gaps(c, pose(np, c.place(motion.end))))
    beyond = np.where(touching & 1, heights, -heights) > margin
    return ~motion.whole | (beyond.any(axis=0) & (motion.limit < 0))


def _begin(s: Seen) -> _Begin:
    m = s.motion
    apart = np.logical_not(m.touching.any(axis=0))
    change = np.full(len(m.stop), -1)
    backwards = np.arange(len(m.lane))[::-1]
    change[m.lane[backwards]] = backwards
    change[~apart] = -1
    met = change >= 0
    t = np.where(apart, np.inf, 0.0)
    t[met] = m.t[change[met]]
    row = np.where(apart, len(m.samples), 0)
    first = s.row[change[met]]
    # a sample at first contact itself is the first one; to double it would look like a turn
    row[met] = first - (m.times[first, met.nonzero()[0]] > t[met])
    return _Begin(t, change, row)


def _since(begin: _Begin, signal: Signal) -> Signal:
    """The signal without what precedes first contact; its first sample moved to first contact."""
    inner = np.where(np.arange(len(signal.inner))[:, None] >= begin.row, signal.inner, np.nan)
    met = np.flatnonzero(begin.change >= 0)
    inner[begin.row[met], met] = signal.change[begin.change[met]]
    return signal._replace(inner=inner)


def _signals(s: Seen) -> tuple[Signal, ...]:
    """The signals of the law, each over its scale (F_n or w)."""
    law = s.law
    inner = law.signals(s.c, s.at, s.on)
    # at a change its point still touches: delta has its limit there, also where contact is lost
    touching = s.motion.on.copy()
    touching[s.motion.point, np.arange(len(s.motion.point))] = 1
    change = law.signals(s.there, s.there_at, touching)

    def scaled(values: np.ndarray, c: Coefficients, signal: Plotted) -> np.ndarray:
        if signal.is_force:  # a located contact change leaves some rounding below zero
            values = np.maximum(values, 0.0)
        return np.asarray(values / getattr(c, signal.over))

    def read(i: int) -> Read:
        def one(c: Coefficients, place: np.ndarray, on: np.ndarray, _: np.ndarray) -> np.ndarray:
            value = law.signals(c, pose(np, c.place(place)), on)[i]
            return np.asarray(value / getattr(c, law.plotted[i].over))

        return one

    return tuple(
        Signal(scaled(a, s.c, signal), scaled(b, s.there, signal), read(i))
        for i, (a, b, signal) in enumerate(zip(inner, change, law.plotted, strict=True))
    )


def _first_turn(values: np.ndarray, row: np.ndarray) -> np.ndarray:
    """The row from which signals count: `row`, or their first turn if they start from zero.

    A signal that starts from zero is on neither side of it yet; its way up (or down) from there
    says nothing of whether it comes back.
    """
    start = values[np.minimum(row, len(values) - 1), np.arange(values.shape[1])]
    zero = np.flatnonzero(np.abs(start) <= START)
    if zero.size:
        way = np.sign(np.diff(values[:, zero], axis=0))
        turns = (way[1:] != way[:-1]) & ~np.isnan(way[:-1])
        turn = np.where(turns.any(axis=0), turns.argmax(axis=0) + 1, len(values) - 1)
        row = row.copy()
        row[zero] = turn
    return row


def _highest(values: np.ndarray, s: Seen) -> np.ndarray:
    """Maximum of each column, with the peak of the parabola where three samples are smooth."""
    pads = np.arange(values.shape[1])
    top = np.where(np.isnan(values), -np.inf, values).argmax(axis=0)
    near = np.clip([top - 1, top, top + 1], 0, len(values) - 1), pads
    (a, b, c), (ta, tb, tc) = values[near], s.motion.times[near]
    left, right = (b - a) / (tb - ta), (c - b) / (tc - tb)
    bend = (right - left) / (tc - ta)
    slope = left + bend * (tb - ta)
    smooth = np.ptp(s.changes[near], axis=0) == 0
    return np.where(smooth & (bend < 0.0), b - slope**2 / (4.0 * bend), b)


def _range(s: Seen, begin: _Begin, crests: Crests, signal: Signal, force: bool) -> np.ndarray:
    """Least and greatest value (n, 2) of a signal since first contact."""
    signal = _since(begin, signal)
    row = _first_turn(signal.inner, begin.row)
    inner = np.where(np.arange(len(signal.inner))[:, None] >= row, signal.inner, np.nan)
    low, high = np.fmin.reduce(inner), np.fmax.reduce(inner)
    counts = s.row > row[s.motion.lane]
    np.fmin.at(low, s.motion.lane[counts], signal.change[counts])
    np.fmax.at(high, s.motion.lane[counts], signal.change[counts])
    # a signal that starts from zero turns just before its first row
    turn = np.where(row > begin.row, row - 1, row)
    low, high = crests.extremes(signal, turn, low, high)
    if force:
        low = np.maximum(low, 0.0)
    return np.array([low, high]).T


def _times(motion: Motion) -> np.ndarray:
    """Time in each of the four states since first contact, (4, n) in the order of `STATES`."""
    pads = motion.stop.shape[0]
    order = np.argsort(motion.lane, kind="stable")
    # each pad's motion falls into parts: the first, and one after each change
    lane = np.concatenate([np.arange(pads), motion.lane[order]])
    code = np.concatenate([[1, 2] @ motion.touching, [1, 2] @ motion.on[:, order]])
    t = np.concatenate([np.zeros(pads), motion.t[order]])
    parts = np.argsort(lane, kind="stable")
    lane, code, t = lane[parts], code[parts], t[parts]
    until = np.append(t[1:], 0.0)
    final = np.append(lane[1:] != lane[:-1], True)
    until[final] = motion.stop[lane[final]]
    seen = (t > 0.0) | (code > 0)
    spent = np.zeros((4, pads))
    np.add.at(spent, (code[seen], lane[seen]), (until - t)[seen])
    return spent[_CODES]


def _losses(motion: Motion) -> np.ndarray:
    lost = motion.on[motion.point, np.arange(len(motion.point))] == 0
    found: list[list[int]] = [[] for _ in motion.stop]
    for lane, edge in zip(motion.lane[lost].tolist(), motion.point[lost].tolist(), strict=True):
        found[lane].append(edge)
    result = np.empty(len(found), dtype=object)
    result[:] = [tuple(edges) for edges in found]
    return result


def _mean(s: Seen, begin: _Begin, signal: Signal, duration: np.ndarray) -> np.ndarray:
    inner = np.nan_to_num(_since(begin, signal).inner)
    times = np.maximum(s.motion.times, begin.t)
    return np.asarray(np.trapezoid(inner, times, axis=0) / duration)


def _swings(delta: np.ndarray) -> np.ndarray:
    """How often the samples of each column change sign, those near zero left aside."""
    signs = np.sign(np.where(np.abs(delta) > START, delta, np.nan))
    return np.array([int(np.sum(np.diff(s[~np.isnan(s)]) != 0.0)) for s in signs.T])


def _calm(s: Seen, duration: np.ndarray) -> np.ndarray:
    """Greatest acceleration of a corner late in the run over that of the whole run."""
    m, c = s.motion, s.c
    fall = (s.terms[9], s.terms[10]) if len(s.terms) > 9 else None
    now = at_speed(np, c, fall, m.samples[:, 3])
    x, y, moment = (springs(np, c, s.at) + s.law.forces(now, s.at, s.on)).loads(s.at)
    rates = np.array([x / c.m, (y - c.F_n) / c.m, c.w * moment / c.I])
    if len(s.terms):
        D = s.terms[:9].reshape(3, 3, -1)
        rates -= np.einsum("ijn,kjn->ikn", D, m.samples[:, 3:])
    size = (rates**2).sum(axis=0)
    late = np.where(m.times >= m.stop - LATE * duration, size, 0.0)
    return np.asarray(np.sqrt(late.max(axis=0) / size.max(axis=0)))


def _face(s: Seen) -> np.ndarray:
    """Greatest velocity (n,) along the surface of the middle of the lower face while some point
    touches: x_dot + h cos(theta0 + theta) theta_dot, since the face lies h below the mass centre.
    """

    def velocity(c: Coefficients, at: Pose, state: np.ndarray) -> np.ndarray:
        return np.asarray(state[3] + c.h * facing(c, at) * state[5] / c.w)

    m = s.motion
    inner = velocity(s.c, s.at, m.samples.swapaxes(0, 1))
    high = _highest(np.where(s.on.any(axis=0), inner, np.nan), s)
    np.fmax.at(high, m.lane, velocity(s.there, s.there_at, m.state))
    return high


def measures(s: Seen, theta0: np.ndarray, calm: bool = True) -> Measures:
    """Measures of n motions, times in natural units; the claims on B1 and B2 rest on them.

    duration (n,): time since first contact; separated (n, 2): time that each edge is apart in it;
    shares (n, 4): of the states in the order of `STATES`; losses (n,): tuples of the edges in the
    order in which they separate; first, second (n, 2): range of F3, F4 over F_n (B1) or of Rn over
    F_n, delta over w (B2); together (n, 2): of F3 + F4 (B1); tilt (n, 2): of theta0 + theta; mean
    (n,): of the first signal; swings (n,): changes of sign of delta (B2); calm (n,): greatest
    acceleration in the last tenth over that of the whole run, NaN if not wanted; fastest (n,): the
    greatest x_dot; face (n,): the greatest speed of the lower face while it touches, NaN if it
    never does. Friction never reverses if the speed V of the surface exceeds the latter.
    """
    with np.errstate(all="ignore"):
        begin, spent = _begin(s), _times(s.motion)
        crests = Crests(s, begin.change)
        duration = np.where(np.isfinite(begin.t), s.motion.stop - begin.t, 0.0)
        first, second = _signals(s)
        tilt = Signal(
            theta0 + s.motion.samples[:, 2] / s.c.w,
            theta0[s.motion.lane] + s.motion.state[2] / s.there.w,
            lambda c, place, _, lane: theta0[lane] + place[2] / c.w,
        )
        line = not s.law.plotted[1].is_force
        both = Signal(
            first.inner + second.inner,
            first.change + second.change,
            lambda *where: first.read(*where) + second.read(*where),
        )
        nothing = np.full((len(duration), 2), np.nan)
        return {
            "duration": duration,
            "separated": (_APART @ spent).T,
            "shares": (spent / duration).T,
            "losses": _losses(s.motion),
            "first": _range(s, begin, crests, first, True),
            "second": _range(s, begin, crests, second, not line),
            "together": nothing if line else _range(s, begin, crests, both, True),
            "tilt": _range(s, begin, crests, tilt, False),
            "mean": _mean(s, begin, first, duration),
            "swings": _swings(_since(begin, second).inner) if line else np.zeros(len(nothing), int),
            "calm": _calm(s, duration) if calm else np.full(len(duration), np.nan),
            "fastest": _highest(s.motion.samples[:, 3], s),
            "face": _face(s),
        }
