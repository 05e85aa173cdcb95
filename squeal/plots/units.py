"""Units of frequency and growth axes, chosen by the size of what is shown."""

import math
from dataclasses import dataclass

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


def in_unit(value: float, unit: Unit) -> str:
    """A frequency or growth rate in SI units (rad/s, 1/s) with its unit, in four digits."""
    return f"{value / unit.factor:.4g} {unit.name}"
