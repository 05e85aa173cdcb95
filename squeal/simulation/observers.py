"""What is observed along a run, and its response: frequency, amplitude and growth of the motion.

Each observer sees the segments as they come and holds no more than its own result, so memory does
not grow with the length of the run. `Grid` serves single motions and ensembles alike.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from squeal.io.scene import COORDINATES, INITIAL
from squeal.io.writing import number
from squeal.model.contact import ContactLaw
from squeal.model.equations import PadModel, Units
from squeal.model.pad import Coefficients, facing, pose_of
from squeal.numerics.oscillation import exponent, half_range, strongest_line
from squeal.simulation.hybrid import Segment, state_of

UNITS = {"t": "s"} | {name: INITIAL.keys[name].unit for name in COORDINATES}
SAMPLES_PER_STEP = 8  # from 3 to 20; peaks between them are located afterwards
LAST = 0.25  # share of the run that is its last part
PARTS = 20  # equal parts of the run whose kinetic energies are compared
CELLS_OF_PART = 200  # of each part: equal cells, each with one sample of the kinetic energy
MOST_SAMPLES = 32_768  # 1,300 periods of the fastest motion, which tell its frequency well
LINE = 0.25  # least share of the power in the strongest line of a motion that has a frequency
PERIODS = 4  # least number of periods that show a frequency
STEADY = 0.1  # largest change of an amplitude that counts as steady


class Peaks(NamedTuple):
    """Maxima (m,) of a signal within steps."""

    step: np.ndarray  # numbers of the steps
    share: np.ndarray  # where in the step, 0 to 1
    value: np.ndarray


SignalFunction = Callable[[Coefficients, np.ndarray, np.ndarray], np.ndarray]
"""A signal (...) from coefficients, states (6, ...) and contact (points, ...)."""


def lobatto(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Shares (count,) of a step, both ends included, and weights of Lobatto's quadrature there."""
    basis = np.polynomial.Legendre.basis(count - 1)
    nodes = np.concatenate([[-1.0], np.sort(basis.deriv().roots().real), [1.0]])  # in -1..1
    return (nodes + 1.0) / 2.0, 1.0 / (count * (count - 1) * basis(nodes) ** 2)


class Grid:
    """Samples of motions at the same k shares of all their s steps.

    shares (k,) of a step, weights (k,) of quadrature over it; states (6, k, s); t (k, s): times; c:
    coefficients of the pad in each step; coefficients_of: those of motions by their numbers;
    first_steps (n,): number of the first step of each motion.
    """

    def __init__(self, segment: Segment, count: int = SAMPLES_PER_STEP) -> None:
        steps = segment.steps
        self.steps = steps
        self.shares, self.weights = lobatto(count)
        powers = self.shares[:, None] ** np.arange(len(steps.series))  # (k, p)
        self.states = np.tensordot(powers, steps.series, 1).swapaxes(0, 1)
        self.t = steps.t + steps.h * self.shares[:, None]
        self.c = segment.coefficients(steps.motion)
        self.coefficients_of = segment.coefficients
        self.first_steps = np.searchsorted(steps.motion, np.arange(len(segment.t0)))

    def read(self, signal: SignalFunction) -> np.ndarray:
        """A signal (..., k, s) at all samples."""
        return signal(self.c, self.states, self.steps.on[:, None])

    def peaks(self, signal: SignalFunction, values: np.ndarray, threshold: np.ndarray) -> Peaks:
        """Maxima of a signal between its samples `values` (k, s), exact to rounding.

        Those that cannot exceed `threshold` (s,), a number for each step, are left out, which saves
        time. A peak is the top of a parabola through three samples, then corrected by Newton's
        method for f' = 0, the shares moving by -f'/f'' with f' and f'' from differences.
        """
        high = np.fmax.reduce(values)
        low = np.fmin.reduce(values)
        # taken for granted: no peak rises over the samples by more than half of their range
        promising = np.flatnonzero(high + 0.5 * (high - low) > threshold)
        # a parabola through the samples i, i + 1, i + 2 has the number i
        parabola, column, share = self._tops(values[:, promising], threshold[promising])
        step = promising[column]
        if not step.size:  # all three are empty
            return Peaks(step, share, value=share)
        least = self.shares[parabola]
        most = self.shares[parabola + 2]
        steps = self.steps.some(step)
        c = self.coefficients_of(steps.motion)
        distance = 1e-3 * (most - least)  # between the values for the differences

        def value(share: np.ndarray) -> np.ndarray:
            return signal(c, steps.states(share), steps.on)

        for _ in range(2):
            before = value(share - distance)
            here = value(share)
            after = value(share + distance)
            with np.errstate(divide="ignore", invalid="ignore"):
                move = distance * (after - before) / (2.0 * (2.0 * here - before - after))
            move = np.where(np.isfinite(move), move, 0.0)  # where the signal is straight: none
            share = np.clip(share + move, least, most)
        # the greater of the values at the last two shares, which differ by rounding
        return Peaks(step, share, np.fmax(value(share), here))

    def _tops(
        self, values: np.ndarray, threshold: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Tops of the parabolas through each three neighbouring samples (k, j) of j steps.

        Of those that may exceed `threshold` (j,): number (m,) of the parabola's first sample,
        number (m,) of its step, and share (m,) of the step at which the top lies. values (k, j): of
        a signal, at the shares of each step.
        """
        shares = self.shares[:, None]
        slopes = np.diff(values, axis=0) / np.diff(shares, axis=0)
        # the parabolas' coefficients of the square: half of their second derivatives
        curvature = np.diff(slopes, axis=0) / (shares[2:] - shares[:-2])
        # a parabola has the slope of two of its samples in the middle between them
        middles = (shares[1:] + shares[:-1]) / 2.0
        with np.errstate(divide="ignore", invalid="ignore"):
            top = middles[:-1] - slopes[:-1] / (2.0 * curvature)  # its share
            rise = -curvature * (top - shares[1:-1]) ** 2  # its height over the middle sample
        # each parabola serves the part of the step that is nearest to its middle sample, the first
        # and the last one up to the ends of the step
        left = middles[:-1].copy()
        right = middles[1:].copy()
        left[0] = 0.0
        right[-1] = 1.0
        has_top = (curvature < 0.0) & (top >= left) & (top <= right)
        may_exceed = values[1:-1] + 2.0 * rise > threshold  # twice: the signal is no parabola
        parabola, step = np.nonzero(has_top & may_exceed)
        return parabola, step, top[parabola, step]

    def ranges(
        self,
        signal: SignalFunction,
        values: np.ndarray | None = None,
        since: np.ndarray | None = None,
    ) -> np.ndarray:
        """Least and greatest value (n, 2) of a signal in each of n motions.

        values (k, s): the signal at all samples, if it is known; since (n,): times before which
        samples do not count. inf and -inf stand for a signal that is NaN all over a motion.
        """
        read = self.read(signal) if values is None else values
        begin = np.full(len(self.steps.motion), -np.inf)
        counted_samples = read
        counted_steps = read
        if since is not None:
            begin = since[self.steps.motion]
            counts = self.t >= begin - 1e-12 * np.abs(begin)  # a time counts despite its rounding
            counted_samples = np.where(counts, read, np.nan)
            # whole steps: the sample on the other side of a peak may lie before `since`
            counted_steps = np.where(counts.any(axis=0), read, np.nan)

        def negative(c: Coefficients, states: np.ndarray, on: np.ndarray) -> np.ndarray:
            return -signal(c, states, on)

        greatest = self._greatest(signal, counted_samples, counted_steps, begin)
        least = -self._greatest(negative, -counted_samples, -counted_steps, begin)
        return np.array([least, greatest]).T

    def _greatest(
        self,
        signal: SignalFunction,
        counted_samples: np.ndarray,
        counted_steps: np.ndarray,
        begin: np.ndarray,
    ) -> np.ndarray:
        """Greatest value (n,) of a signal in each motion, from a time `begin` of each on.

        A peak between two samples counts too if it lies before `begin` by no more than the widest
        distance of samples: the first sample that counts may stand on its falling side.

        counted_samples (k, s): its values at all samples, NaN at those that do not count;
        counted_steps (k, s): the same, NaN only in steps of which no sample counts; begin (s,): of
        the motion of each step the time before which samples do not count.
        """
        motion = self.steps.motion
        highest = np.fmax.reduce(counted_samples)
        highest = np.where(np.isnan(highest), -np.inf, highest)
        greatest = np.fmax.reduceat(highest, self.first_steps)  # over the steps of each motion
        peaks = self.peaks(signal, counted_steps, greatest[motion])
        step = peaks.step
        widest = np.diff(self.shares).max()  # distance of samples, as a share of a step
        counts = self.steps.t[step] + self.steps.h[step] * (peaks.share + widest) >= begin[step]
        # several peaks may be of one motion, which `at` takes one after the other
        np.fmax.at(greatest, motion[step[counts]], peaks.value[counts])
        return greatest


def plotted(law: ContactLaw) -> SignalFunction:
    """The plotted signals (signals, ...) of a law, each over its scale (F_n or w)."""

    def read(c: Coefficients, states: np.ndarray, on: np.ndarray) -> np.ndarray:
        with np.errstate(divide="ignore", invalid="ignore"):  # delta is NaN where Rn is zero
            values = law.signals(c, pose_of(np, c.xy_theta(states)), on)
        rows = np.empty((len(law.plotted), *states.shape[1:]))
        for row, value, signal in zip(rows, values, law.plotted, strict=True):
            np.divide(value, getattr(c, signal.over), out=row)
            if signal.is_force:  # a located contact change leaves some rounding below zero
                np.maximum(row, 0.0, out=row)
        return rows

    return read


def face_speed(c: Coefficients, states: np.ndarray, on: np.ndarray) -> np.ndarray:
    """Speed of the middle of the lower face, h below the mass centre, NaN where it is off."""
    velocity = states[3] + c.h * facing(c, pose_of(np, c.xy_theta(states))) * states[5] / c.w
    return np.where(on.any(axis=0), velocity, np.nan)


def one_of(signals: SignalFunction, which: int) -> SignalFunction:
    """The signal of index `which` of several."""
    return lambda *where: signals(*where)[which]


@dataclass(frozen=True)
class Event:
    """A change of contact state at time t (s)."""

    t: float
    source: str
    target: str


def _states_in_turn(model: PadModel, segment: Segment) -> list[str]:
    """Names of the contact states that a segment of one motion passes, from its first one on."""
    contact = np.hstack([segment.first_contact, segment.contact_after_changes])
    return [model.state_name(state_of(on)) for on in contact.T]


class Events:
    """The list of contact changes."""

    def __init__(self, model: PadModel, units: Units) -> None:
        self._model = model
        self._units = units
        self._events: list[Event] = []

    def observe(self, segment: Segment) -> None:
        names = _states_in_turn(self._model, segment)
        times = (segment.changes.t * self._units.time).tolist()
        self._events += map(Event, times, names[:-1], names[1:])

    def result(self) -> tuple[Event, ...]:
        return tuple(self._events)


class Shares:
    """Share of time spent in each contact state."""

    def __init__(self, model: PadModel, stop: float) -> None:
        self._model = model
        self._stop = stop
        self._time = dict.fromkeys(model.law.meanings, 0.0)

    def observe(self, segment: Segment) -> None:
        spent = np.diff(np.concatenate([segment.t0, segment.changes.t, segment.t1]))
        names = _states_in_turn(self._model, segment)
        for time, name in zip(spent.tolist(), names, strict=True):
            self._time[name] += time

    def result(self) -> dict[str, float]:
        return {state: spent / self._stop for state, spent in self._time.items()}


class Extrema:
    """Least and greatest values of the plotted signals, forces over F_n and delta over w."""

    def __init__(self, model: PadModel) -> None:
        self._law = model.law
        self._ranges = np.array([[np.inf, -np.inf]] * len(model.law.plotted))

    def observe(self, segment: Segment) -> None:
        grid = Grid(segment)
        signals = plotted(self._law)
        for which, values in enumerate(grid.read(signals)):
            ((low, high),) = grid.ranges(one_of(signals, which), values)
            least, greatest = self._ranges[which]
            self._ranges[which] = min(least, low), max(greatest, high)

    def result(self) -> dict[str, tuple[float, float] | None]:
        extrema: dict[str, tuple[float, float] | None] = {}
        for signal, (low, high) in zip(self._law.plotted, self._ranges.tolist(), strict=True):
            extrema[signal.name] = (low, high) if math.isfinite(high) else None
        return extrema


class Samples:
    """The states (n, 6) and contact (points, n) at given rising times (n,), in natural units."""

    def __init__(self, model: PadModel, times: np.ndarray) -> None:
        self.times = times
        self.states = np.full((len(times), 6), np.nan)
        self.on = np.zeros((model.law.points, len(times)))

    def observe(self, segment: Segment) -> None:
        first = np.searchsorted(self.times, segment.t0[0])
        end = np.searchsorted(self.times, segment.t1[0], side="right")
        states, on = segment.at(self.times[first:end])
        self.states[first:end] = states
        self.on[:, first:end] = on


class History(Samples):
    """Samples of state, contact and signals at equal steps of time."""

    def __init__(self, model: PadModel, units: Units, stop: float, samples: int) -> None:
        self._seconds = np.linspace(0.0, stop, samples)
        super().__init__(model, self._seconds / units.time)
        self._model = model
        self._units = units

    def result(self) -> dict[str, np.ndarray]:
        model = self._model
        contacts, which = np.unique(self.on, axis=1, return_inverse=True)
        names = [model.state_name(state_of(contact)) for contact in contacts.T]
        columns = {"t": self._seconds}
        columns |= dict(zip(COORDINATES, self._units.to_si(self.states).T, strict=True))
        columns["state"] = np.array(names)[which]
        signals = plotted(model.law)(model.c, self.states.T, self.on)
        for signal, values in zip(model.law.plotted, signals, strict=True):
            columns[signal.name] = values
        return columns


class Sliding:
    """When the pad first becomes as fast as the surface, which every equation assumes to be faster
    (finding E16); speed and time in natural units."""

    def __init__(self, speed: float) -> None:
        self._speed = speed
        self.lost_at: float | None = None

    def _excess(self, _c: Coefficients, states: np.ndarray, _on: np.ndarray) -> np.ndarray:
        return np.asarray(states[3] - self._speed)

    def observe(self, segment: Segment) -> None:
        """Locate the first instant of a segment at which the pad is as fast as the surface, at
        samples of each step and at the peaks of the pad's speed between them."""
        if self.lost_at is not None:
            return
        grid = Grid(segment)
        steps = segment.steps
        values = grid.read(self._excess)
        peaks = grid.peaks(self._excess, values, threshold=np.zeros(len(steps.t)))
        times_of_peaks = steps.t[peaks.step] + steps.h[peaks.step] * peaks.share
        too_fast = np.append(grid.t[values >= 0.0], times_of_peaks[peaks.value >= 0.0])
        if not too_fast.size:
            return
        # bisection between the first of these times and the last one before, down to neighbouring
        # numbers
        high = too_fast.min()
        low = max(grid.t[grid.t < high].max(initial=-np.inf), segment.t0[0])
        middle = low + (high - low) / 2
        while low < middle < high:
            states, _ = segment.at(np.array([middle]))
            if states[0, 3] >= self._speed:  # x_dot, along the surface
                high = middle
            else:
                low = middle
            middle = low + (high - low) / 2
        self.lost_at = float(high)


@dataclass(frozen=True)
class Response:
    """What a motion comes to; each is None where the motion does not show it.

    frequency_hz: of the strongest line in the kinetic energy of the last quarter of the run, which
    holds at least four of its periods, and the line a quarter of the power.
    amplitude: half of the ranges of x, y (m) and theta (rad) in that quarter, whose two halves
    differ by at most a tenth.
    growth_rate (1/s), growth_frequency_hz: real part and |imaginary part|/(2 pi) of the exponent
    of the motion up to the first change of contact, see `squeal.numerics.oscillation.exponent`.
    settled: True if the root mean square velocity, weighted by the masses, of the last tenth of the
    run is below a hundredth of that of the twentieth in which it was greatest, False if it is at
    least nine tenths of that of the tenth before.
    """

    frequency_hz: float | None = None
    amplitude: dict[str, float] | None = None
    growth_rate: float | None = None
    growth_frequency_hz: float | None = None
    settled: bool | None = None

    def rows(self) -> list[tuple[str, str]]:
        """Name and value of each, for people; "cannot be told" where it is None."""
        names = ("dominant frequency", "amplitude", "growth at the start", "at rest at the end")
        rows = dict.fromkeys(names, "cannot be told")
        if self.frequency_hz is not None:
            rows["dominant frequency"] = f"{number(self.frequency_hz)} Hz"
        if self.amplitude:
            sizes = []
            for name, size in self.amplitude.items():
                sizes.append(f"{name} {number(size)} {UNITS[name]}")
            rows["amplitude"] = ", ".join(sizes)
        if self.growth_rate is not None:
            hertz = number(self.growth_frequency_hz or 0.0)
            rows["growth at the start"] = f"{number(self.growth_rate)} 1/s at {hertz} Hz"
        if self.settled is not None:
            rows["at rest at the end"] = "yes" if self.settled else "no"
        return list(rows.items())


class ResponseObserver:
    """Samples of the start, of the last part and of the kinetic energy, in natural units."""

    def __init__(self, model: PadModel, units: Units, stop: float) -> None:
        """Choose the times of the samples, up to the end of the run, `stop` in natural units.

        At the start and at the end they are evenly spaced; over the whole run they are random, for
        the mean kinetic energy of its parts.
        """
        pad = model.pad
        self._units = units
        # weights of the squared rates of (x, y, w theta) in the kinetic energy
        self._mass = np.array([pad.m, pad.m, pad.I / pad.w**2])
        # the fastest angular frequency: of translation it is sqrt(k/m) = 1 in natural units; of
        # rotation sqrt(k r^2/I), with a corner's arm r = sqrt(w^2 + h^2) and k = m
        fastest = max(1.0, math.sqrt(pad.m * (pad.w**2 + pad.h**2) / pad.I))
        self._step = 0.25 / fastest  # a quarter of a radian: 25 samples a period
        first = np.arange(min(MOST_SAMPLES, int(stop / self._step) + 1)) * self._step
        # as far before the end as the first times are after the start, in rising order
        last = stop - first[first <= LAST * stop][::-1]
        # random times in equal cells, which no frequency is in step with
        cells = np.arange(CELLS_OF_PART * PARTS)
        spread = stop * (cells + np.random.default_rng(0).random(len(cells))) / len(cells)
        self._first = Samples(model, first)
        self._last = Samples(model, last)
        self._spread = Samples(model, spread)
        self._first_change = np.inf  # time of the first change of contact, if there is any

    def observe(self, segment: Segment) -> None:
        for samples in (self._first, self._last, self._spread):
            samples.observe(segment)
        times = segment.changes.t
        if times.size:
            self._first_change = min(self._first_change, float(times[0]))

    def result(self) -> Response:
        """What the samples show, in SI units."""
        energy = self._energy_of_parts()
        last = self._last.states
        # speeds here are root mean squares, weighted by the masses
        greatest_speed = float(np.sqrt(energy.max()))
        if greatest_speed <= 1e-11:  # in natural units: only rounding
            return Response(amplitude=self._amplitude(last), settled=True)
        response = Response()
        time = self._units.time
        before_any_change = self._first.states[self._first.times < self._first_change]
        growth = exponent(before_any_change, self._step)
        if growth is not None:
            hertz = growth.imag / (math.tau * time)
            response = Response(growth_rate=growth.real / time, growth_frequency_hz=hertz)
        frequency, share = strongest_line(last[:, 3:] * np.sqrt(self._mass), self._step)
        # too few periods show neither a line nor an amplitude, nor whether the motion has settled
        periods = frequency * self._step * len(last)
        if periods < PERIODS:
            return response
        if share >= LINE:
            response = replace(response, frequency_hz=frequency / time)
        if self._is_steady(last):
            response = replace(response, amplitude=self._amplitude(last))
        speeds_of_tenths = np.sqrt(energy.reshape(-1, PARTS // 10).mean(axis=1))
        before, late = speeds_of_tenths[-2:]
        at_rest = late < 0.01 * greatest_speed
        if at_rest or late >= (1.0 - STEADY) * before:
            response = replace(response, settled=bool(at_rest))
        return response

    def _energy_of_parts(self) -> np.ndarray:
        """Twice the mean kinetic energy (PARTS,) in each of equal parts of the run."""
        energy = (self._mass * self._spread.states[:, 3:] ** 2).sum(axis=1)
        return np.asarray(energy.reshape(PARTS, -1).mean(axis=1))

    @staticmethod
    def _is_steady(states: np.ndarray) -> bool:
        """Whether the two halves of states (n, 6) have the same amplitude, in the coordinate that
        moves most."""
        halves = np.split(states, [len(states) // 2])
        amplitudes = np.array([half_range(half[:, :3]) for half in halves])  # (2, 3)
        largest = np.argmax(amplitudes.sum(axis=0))
        a, b = amplitudes[:, largest]
        return bool(abs(a - b) <= STEADY * max(a, b))

    def _amplitude(self, states: np.ndarray) -> dict[str, float]:
        """Half of the range of x, y (m) and theta (rad) of states (n, 6), by name."""
        with_rates = np.append(half_range(states[:, :3]), np.zeros(3))
        return dict(zip(COORDINATES[:3], self._units.to_si(with_rates)[:3].tolist(), strict=True))
