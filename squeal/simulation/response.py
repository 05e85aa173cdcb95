"""What a motion comes to: its frequency, amplitude, growth at the start, and whether it settles."""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from squeal.model.equations import PadModel, Units
from squeal.numerics.oscillation import exponent, line, swing
from squeal.simulation.hybrid import Course, Observer
from squeal.simulation.observers import Samples

LAST = 0.25  # share of the run that is its last part
PARTS = 20  # equal parts of the run whose kinetic energies are compared
LINE = 0.25  # least share of the power in the strongest line of a motion that has a frequency
PERIODS = 4  # least number of periods in which a frequency is told
STEADY = 0.1  # largest change of an amplitude that counts as steady


@dataclass(frozen=True)
class Response:
    """What a motion comes to; each is None where it cannot be told.

    frequency_hz: of the strongest line in the kinetic energy of the last quarter of the run; None
    if that quarter holds less than four of its periods, or if the line has less than a quarter of
    the power, as in irregular motion.
    amplitude: half of the difference between greatest and least x, y (m) and theta (rad) in that
    quarter; None if it is too short, or if its two halves differ by more than a tenth, as in
    motion that still grows or decays or is irregular.
    growth_rate (1/s), growth_frequency_hz: real part and |imaginary part|/(2 pi) of the exponent
    of the motion from its start up to the first change of contact, see
    `squeal.numerics.oscillation.exponent`; None if that is shorter than two periods or is not a sum
    of exponentials.
    settled: True if the velocity (its root mean square, weighted by the masses) of the last tenth
    of the run is below a hundredth of that of the twentieth in which it was greatest, False if it
    is at least nine tenths of that of the tenth before, None in between, or if the run is too
    short.
    """

    frequency_hz: float | None = None
    amplitude: dict[str, float] | None = None
    growth_rate: float | None = None
    growth_frequency_hz: float | None = None
    settled: bool | None = None


def sampling_step(model: PadModel) -> float:
    """A step of time, in natural units, that resolves the motion of a scaled pad: a quarter of a
    radian of its fast rotation."""
    pad = model.pad
    return 0.25 / max(1.0, math.sqrt(pad.m * (pad.w**2 + pad.h**2) / pad.I))


class Watch(Observer):
    """Samples of the start, of the last part and of the kinetic energy, in natural units."""

    dense = True

    def __init__(self, model: PadModel, units: Units, stop: float) -> None:
        pad = model.pad
        self._units = units
        # weights of the squared rates of (x, y, w theta) in the kinetic energy
        self._mass = np.array([pad.m, pad.m, pad.I / pad.w**2])
        self._step = sampling_step(model)
        # of a long run no more samples than tell its frequency well
        first = np.arange(min(8_192, int(stop / self._step) + 1)) * self._step
        count = min(32_768, int(LAST * stop / self._step) + 1)
        last = stop - self._step * np.arange(count)[::-1]
        # places that no frequency is in step with
        number = np.arange(200 * PARTS)
        spread = stop * (number + number * 0.6180339887498949 % 1.0) / len(number)
        self._samples = tuple(Samples(times) for times in (first, last, spread))
        self._changed = np.inf

    def see(self, course: Course) -> None:
        for samples in self._samples:
            samples.see(course)
        self._changed = min([self._changed, *course.t[:1].tolist()])

    def result(self) -> dict[str, Any]:
        return {"response": self._response()}

    def _response(self) -> Response:
        first, last, spread = (samples.states for samples in self._samples)
        rate = self._units.time
        energy = (self._mass * spread[:, 3:] ** 2).sum(axis=1).reshape(PARTS, -1)
        speed = np.sqrt(energy.mean(axis=1))
        if speed.max() <= 1e-11:  # in natural units: only rounding
            return Response(amplitude=self._amplitude(last), settled=True)
        growth = exponent(first[self._samples[0].times < self._changed], self._step)
        start = Response()
        if growth is not None:
            hertz = growth.imag / (2 * np.pi * rate)
            start = Response(growth_rate=growth.real / rate, growth_frequency_hz=hertz)
        frequency, share = line(last[:, 3:] * np.sqrt(self._mass), self._step)
        if frequency * self._step * len(last) < PERIODS:
            return start
        half = len(last) // 2
        parts = [swing(part[:, :3]) for part in (last[:half], last[half:])]
        greatest = int(np.argmax(parts[0] + parts[1]))
        a, b = (float(part[greatest]) for part in parts)
        return replace(
            start,
            frequency_hz=frequency / rate if share >= LINE else None,
            amplitude=self._amplitude(last) if abs(a - b) <= STEADY * max(a, b) else None,
            settled=_settled(speed),
        )

    def _amplitude(self, states: np.ndarray) -> dict[str, float]:
        whole = np.append(swing(states[:, :3]), np.zeros(3))
        return dict(zip(("x", "y", "theta"), self._units.to_si(whole)[:3].tolist(), strict=True))


def _settled(speed: np.ndarray) -> bool | None:
    tenths = np.sqrt((speed.reshape(-1, PARTS // 10) ** 2).mean(axis=1))
    if tenths[-1] < 0.01 * speed.max():
        return True
    return False if tenths[-1] >= (1.0 - STEADY) * tenths[-2] else None
