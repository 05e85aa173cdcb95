"""Measures of one or several motions at once; the claims on B1 and B2 rest on them.

A signal that starts from zero is on neither side of it yet: its way up (or down) from there says
nothing of whether it comes back, so that it counts from its first turn on.
"""

from typing import NamedTuple

import numpy as np

from squeal.errors import InputError
from squeal.io.scene import Scene
from squeal.model.contact import LEADING, NONE, STATES, TRAILING
from squeal.model.equations import Units
from squeal.model.pad import Coefficients
from squeal.simulation.hybrid import Segment, whole_motion
from squeal.simulation.observers import Grid, SignalFunction, face_speed, one_of, plotted
from squeal.simulation.run import in_natural_units, make_integrator

START = 1e-9  # values below this at the start count as zero: nothing has moved yet
LATE = 0.1  # share of the time after first contact that counts as the end of the run
# samples of the signals in each step, between which extrema are refined: of many motions, of one
PLACES = 4
FINE = 24
LEVELS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5)
"""Least impulses of a blow that are tried, over F_n T_1 with the period T_1 = 2 pi (m/k1)^(1/2)."""
# the code leading + 2 trailing (1 for an edge that touches) of each state, in the order of `STATES`
_CODES = [state[LEADING] + 2 * state[TRAILING] for state in STATES]
# (2, 4): 1 where the leading or the trailing edge is separated in a state
_SEPARATED = 1.0 - np.array(STATES, dtype=float).T


def measure_alone(scene: Scene) -> dict[str, np.ndarray]:
    """The measures (n = 1) of a scene of B1 or B2, times in natural units, velocities in m/s.

    Raises ComputationError where the model ends.
    """
    units, model, state, stop = in_natural_units(scene)
    integrator = make_integrator(model, scene.tolerance, "auto")
    segment = whole_motion(model, integrator, units, state, stop, dense=True)
    # `measures` multiplies times by the unit of time, here 1, and velocities by length over time
    mass, length, time, lever = np.array([[1.0], [units.velocity], [1.0], [1.0]])
    return measures(segment, Units(mass, length, time, lever), FINE)


def measures(
    segment: Segment, units: Units, places: int = PLACES, calm: bool = True
) -> dict[str, np.ndarray]:
    """The arrays of n motions that `measures.case_of` reads, by name.

    All shares, means and ranges are those of the time since the first contact. The range of a
    signal begins later where the signal is zero at the first contact, see `_first_turn`.

    Parameters
    ----------
    segment
        The motions in natural units, with their steps (`dense`).
    units
        Units of pad i in SI: times are multiplied by units.time, velocities by units.velocity.
    places
        At so many places of each step signals are sampled; extrema between them are refined.
    calm
        Whether `calm` is computed, which takes long; NaN otherwise.

    Returns
    -------
    duration : (n,)
        Time since the first contact.
    separated : (n, 2)
        Time that the leading and the trailing edge are separated.
    shares : (n, 4)
        Share of time in each contact state, in the order of `STATES`.
    losses : (n,)
        Tuples of the edges in the order in which they separate.
    first, second : (n, 2)
        Least and greatest F3 and F4 over F_n (B1), or Rn over F_n and delta over w (B2).
    together, tilt : (n, 2)
        Least and greatest F3 + F4 over F_n (B1) and theta0 + theta.
    down : (n,)
        Share of time in which the tilt is negative.
    mean : (n,)
        Mean of `first`.
    blows, heaviest : (n, levels) and (n, 2)
        As in `_blows`.
    vanishes : (n, 2)
        Share of time without force at the leading and the trailing edge.
    calm : (n,)
        Greatest acceleration in the last tenth over that of the whole run, 0 without acceleration.
    fastest, face : (n,)
        Greatest x_dot, and greatest velocity along x of the lower face while the face touches, NaN
        if it never touches. Friction never reverses if the speed V of the surface exceeds `face`.

    Raises
    ------
    InputError
        For a model with other contact points than the two edges.
    """
    law = segment.law
    n = len(segment.t0)
    if law.points != 2:
        raise InputError("measures are those of two edges")
    touched = _first_contact(segment)
    spent = _times(segment)  # (4, n), times in each state
    duration = np.where(np.isfinite(touched), segment.t1 - touched, 0.0)
    grid = Grid(segment, places)
    signals = plotted(law)
    first, second = grid.read(signals)  # (k, s) each: at k samples of each of s steps

    def span(read: SignalFunction, values: np.ndarray) -> np.ndarray:
        """Range (n, 2) of a signal from its first turn on, NaN where it has none."""
        ends = grid.ranges(read, values, _first_turn(grid, values, touched))
        return np.where(np.isfinite(ends), ends, np.nan)

    def edge_force_sum(c: Coefficients, states: np.ndarray, on: np.ndarray) -> np.ndarray:
        """F3 + F4 over F_n, as a signal that `Grid` reads: `on` are the points that touch."""
        return np.asarray(signals(c, states, on).sum(axis=0))

    is_line = not law.plotted[1].is_force
    separated = _SEPARATED @ spent  # (2, n), times
    # load and its moment about the centre, which is above 0 if the load is on the trailing half
    if is_line:  # the signals are Rn and its position delta
        load = first
        moment = first * second
        together = np.full((n, 2), np.nan)
        # the edge forces that replace Rn vanish with it, at both edges at once
        vanishing = np.array(2 * [spent[STATES.index(NONE)]])
    else:  # the signals are F3 at the leading edge, -w, and F4 at the trailing edge, w
        load = first + second
        moment = second - first
        together = span(edge_force_sum, load)
        vanishing = separated
    blows, heaviest = _blows(grid, np.nan_to_num(load), np.nan_to_num(moment), n)
    motion = grid.steps.motion
    tilts = grid.read(_tilt)
    has_touched = grid.steps.t >= touched[motion]
    # of the first signal over each step
    integrals = np.where(has_touched, grid.weights @ np.nan_to_num(first), 0.0) * grid.steps.h
    facing_speed = grid.ranges(face_speed)[:, 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        return {
            "duration": duration * units.time,
            "separated": separated.T * np.reshape(units.time, (-1, 1)),
            "shares": (spent / duration).T,
            "losses": _losses(segment),
            "first": span(one_of(signals, 0), first),
            "second": span(one_of(signals, 1), second),
            "together": together,
            "tilt": span(_tilt, tilts),
            "down": _negative(grid, tilts, touched, n) / duration,
            "mean": np.bincount(motion, integrals, n) / duration,
            "blows": blows,
            "heaviest": heaviest,
            "vanishes": vanishing.T / duration[:, None],
            "calm": _calm(grid, segment.t1 - LATE * duration) if calm else np.full(n, np.nan),
            "fastest": grid.ranges(_x_dot)[:, 1] * units.velocity,
            "face": np.where(np.isfinite(facing_speed), facing_speed, np.nan) * units.velocity,
        }


def _tilt(c: Coefficients, states: np.ndarray, _on: np.ndarray) -> np.ndarray:
    """theta0 + theta in rad: the undisplaced face is inclined by theta0, states[2] is w theta."""
    return np.asarray(np.arctan2(c.rty - c.rly, c.rtx - c.rlx) + states[2] / c.w)


def _x_dot(_c: Coefficients, states: np.ndarray, _on: np.ndarray) -> np.ndarray:
    return np.asarray(states[3])


def _first_contact(segment: Segment) -> np.ndarray:
    """When (n,) each motion first touches, inf for one that never does."""
    times = np.where(segment.first_contact.any(axis=0), segment.t0, np.inf)
    # of a motion that begins without contact the first change is a touch
    motion = segment.changes.motion
    np.fmin.at(times, motion, np.where(np.isinf(times[motion]), segment.changes.t, np.inf))
    return times


def _times(segment: Segment) -> np.ndarray:
    """Time in each of the four states since first contact, (4, n) in the order of `STATES`."""
    n = len(segment.t0)
    # an interval of one contact state begins with each motion, and at each change
    motion = np.concatenate([np.arange(n), segment.changes.motion])
    order = np.argsort(motion, kind="stable")  # by motion, then by time
    motion = motion[order]
    begin = np.concatenate([segment.t0, segment.changes.t])[order]
    is_last_of_motion = np.append(motion[1:] != motion[:-1], True)
    end = np.append(begin[1:], 0.0)
    end[is_last_of_motion] = segment.t1
    contact = np.hstack([segment.first_contact, segment.contact_after_changes])[:, order]
    code = [1, 2] @ contact  # 1 for the leading edge and 2 for the trailing edge, if they touch
    # an interval without contact from the begin on is the time before the first contact
    is_counted = (begin > segment.t0[motion]) | (code > 0)
    spent = np.zeros((4, n))  # a row for each code
    np.add.at(spent, (code[is_counted], motion[is_counted]), (end - begin)[is_counted])
    return spent[_CODES]


def _losses(segment: Segment) -> np.ndarray:
    """Tuples (n,) of the edges in the order in which they separate."""
    motions, points, times, _ = segment.changes
    lost = segment.contact_after_changes[points, np.arange(len(times))] == 0
    losses: list[list[int]] = [[] for _ in segment.t0]
    for motion, edge in zip(motions[lost].tolist(), points[lost].tolist(), strict=True):
        losses[motion].append(edge)
    result = np.empty(len(losses), dtype=object)
    result[:] = [tuple(edges) for edges in losses]
    return result


def _first_turn(grid: Grid, values: np.ndarray, touched: np.ndarray) -> np.ndarray:
    """When (n,) a signal begins to count: at the first contact, or at the first turn of a signal
    that is zero at the first contact.

    values (k, s): the signal at k samples of each step, NaN where it has no value, as delta without
    contact; touched (n,): time of the first contact, inf without one. A turn is a sample at which
    the signal stops rising or falling, or after which it has no value. A signal without a turn
    counts at its last sample alone.
    """
    # number of the first step of each motion, and the number of all steps
    first_steps = np.append(grid.first_steps, values.shape[1])
    since = touched.copy()
    for motion in np.flatnonzero(np.isfinite(touched)).tolist():
        begin, end = first_steps[motion : motion + 2]
        # from the first step that begins with or after the first contact
        begin += int(np.searchsorted(grid.steps.t[begin:end], touched[motion]))
        starts_at_zero = begin < end and abs(values[0, begin]) <= START  # not so where it is NaN
        if not starts_at_zero:
            continue
        # all samples in order of time; the last one of a step is the first one of the next
        times = grid.t[:, begin:end]
        signal = np.append(values[:-1, begin:end].T.ravel(), values[-1, end - 1])
        direction = np.sign(np.diff(signal))
        # NaN differs from every number: where the signal ends is a turn, where it begins is none
        turns = np.flatnonzero((direction[1:] != direction[:-1]) & ~np.isnan(direction[:-1]))
        if turns.size == 0:
            since[motion] = times[-1, -1]
            continue
        turning_sample = int(turns[0]) + 1  # between the two differences whose signs differ
        step, sample_of_step = divmod(turning_sample, len(values) - 1)
        since[motion] = times[sample_of_step, step]
    return since


def _negative(grid: Grid, values: np.ndarray, touched: np.ndarray, n: int) -> np.ndarray:
    """Time (n,) since first contact in which a signal (k, s) is negative.

    The signal counts as straight between samples, so that a crossing is located to second order.
    """
    before = values[:-1]
    after = values[1:]
    rise = np.abs(after - before)
    below = np.maximum(-np.minimum(before, after), 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(rise > 0.0, np.minimum(below / rise, 1.0), before < 0.0)
    has_touched = grid.t[:-1] >= touched[grid.steps.motion]
    spent = np.where(has_touched, share * np.diff(grid.t, axis=0), 0.0).sum(axis=0)
    return np.bincount(grid.steps.motion, spent, n)


def _blows(
    grid: Grid, load: np.ndarray, moment: np.ndarray, n: int
) -> tuple[np.ndarray, np.ndarray]:
    """How often successive blows fall on different edges, by least impulse (n, levels), and the
    impulse of the heaviest blow on the leading and the trailing edge (n, 2).

    A level of `LEVELS` leaves out the blows with a lesser impulse. load, moment (k, s), at k
    samples of each of s steps: contact force over F_n, and its moment about the centre over F_n w.
    n: how many motions.
    """
    motion, side, impulse = _each_blow(grid, load, moment)
    heaviest = np.zeros((n, 2))
    for edge, sign in enumerate((-1.0, 1.0)):  # the side of the leading and of the trailing edge
        on_edge = side == sign
        np.fmax.at(heaviest[:, edge], motion[on_edge], impulse[on_edge])
    turns = np.zeros((n, len(LEVELS)), dtype=int)
    for k, level in enumerate(LEVELS):
        is_blow = (impulse > level) & (side != 0.0)
        struck = side[is_blow]
        of_motion = motion[is_blow]
        # successive blows of one motion on different edges
        is_turn = (struck[1:] != struck[:-1]) & (of_motion[1:] == of_motion[:-1])
        turns[:, k] = np.bincount(of_motion[1:][is_turn], minlength=n)
    return turns, heaviest


class _EachBlow(NamedTuple):
    """All b blows of n motions, in order of motion and time; arrays (b,).

    motion: its number; side: -1 on the leading half, 1 on the trailing half, 0 for the time before
    a first force; impulse: of the contact force, over F_n T_1.
    """

    motion: np.ndarray
    side: np.ndarray
    impulse: np.ndarray


def _each_blow(grid: Grid, load: np.ndarray, moment: np.ndarray) -> _EachBlow:
    """The blows: the times between changes of the moment's sign, each with the whole impulse.

    load, moment (k, s), at k samples of each of s steps: contact force over F_n, and its moment
    about the centre over F_n w, below 0 where the resultant acts on the leading half.
    """
    steps = grid.steps
    period = 2.0 * np.pi * np.sqrt(1.0 / grid.c.k1)  # T_1, since the mass is the unit
    # arrays (k s,): of each sample, in order of motion and time; the impulse of a sample is the
    # force times the time that it stands for, by quadrature over its step
    impulse = (load * grid.weights[:, None] * steps.h / period).T.ravel()
    side = np.sign(moment).T.ravel()
    motion = np.repeat(steps.motion, len(load))
    # a sample without force has the side of the last one with force in the same motion: of the
    # sides -1, 0, 0, 1 this makes -1, -1, -1, 1, two blows
    last_with_force = np.maximum.accumulate(np.where(side != 0.0, np.arange(side.size), 0))
    side = np.where(motion[last_with_force] == motion, side[last_with_force], 0.0)
    # a blow lasts as long as side and motion stay the same
    changes = (side[1:] != side[:-1]) | (motion[1:] != motion[:-1])
    begin = np.flatnonzero(np.append(True, changes))
    return _EachBlow(motion[begin], side[begin], np.add.reduceat(impulse, begin))


def _calm(grid: Grid, late: np.ndarray) -> np.ndarray:
    """Greatest acceleration after the times `late` (n,) over that of the whole run, (n,); 0 of a
    motion without acceleration.

    In a step of length h a state is the sum of series[k] u^k over the share u = (t - t_step) / h,
    so that its time derivative is the sum of k series[k] u^(k - 1) / h; of the velocities
    (x_dot, y_dot, w theta_dot) that is the acceleration, whose Euclidean norm counts.
    """
    steps = grid.steps
    k = np.arange(1, len(steps.series))  # powers from 1 on; series is (power, state, step)
    # k u^(k - 1) at the shares u of the samples, (sample, k), 0 for k = 0
    factors = np.pad(grid.shares[:, None] ** (k - 1) * k, ((0, 0), (1, 0)))
    slopes = np.tensordot(factors, steps.series, 1)[:, 3:]  # (sample, velocity, step), by u
    squares = (slopes**2).sum(axis=1) / np.maximum(steps.h, 1e-300) ** 2  # of the accelerations
    late_squares = np.where(grid.t >= late[steps.motion], squares, 0.0)
    greatest = np.maximum.reduceat(squares.max(axis=0), grid.first_steps)
    late_greatest = np.maximum.reduceat(late_squares.max(axis=0), grid.first_steps)
    # of a motion at rest both are 0
    shares = np.divide(late_greatest, greatest, out=np.zeros(len(late)), where=greatest != 0.0)
    return np.asarray(np.sqrt(shares))
