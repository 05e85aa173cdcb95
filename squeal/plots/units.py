"""Units of frequency and growth axes, chosen by the size of what is shown."""

import math
from dataclasses import dataclass

import numpy as np

KILO = 2000.0  # Hz or 1/s: from here on an axis counts thousands


@dataclass(frozen=True)
class Unit:
    """What values in SI units are divided by, and the unit's name."""

    factor: float
    name: str


def frequency_unit(largest_hz: float) -> Unit:
    """Hz or kHz for values in rad/s."""
    kilo = largest_hz >= KILO
    return Unit(2 * math.pi * (1e3 if kilo else 1.0), "kHz" if kilo else "Hz")


def growth_unit(largest: float) -> Unit:
    """1/s or 1/ms for values in 1/s."""
    kilo = largest >= KILO
    return Unit(1e3 if kilo else 1.0, "1/ms" if kilo else "1/s")


def units_of(values: np.ndarray) -> tuple[Unit, Unit]:
    """Units of frequency and growth rate of eigenvalues (rad/s)."""
    return (
        frequency_unit(float(np.abs(values.imag).max(initial=0.0)) / (2 * np.pi)),
        growth_unit(float(np.abs(values.real).max(initial=0.0))),
    )


def in_unit(value: float, unit: Unit) -> str:
    """A frequency or growth rate in SI units (rad/s, 1/s) with its unit, in four digits."""
    return f"{value / unit.factor:.4g} {unit.name}"
