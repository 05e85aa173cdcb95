"""Regions of the complex plane in which all roots are wanted."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from squeal.errors import InputError

DAMPED = 0.25  # a band holds roots whose real part is at most this share of its upper end


@dataclass(frozen=True)
class Rectangle:
    """low_real < Re < high_real, low_imag < Im < high_imag (1/s and rad/s)."""

    low_real: float
    high_real: float
    low_imag: float
    high_imag: float

    def __post_init__(self) -> None:
        numbers = (self.low_real, self.high_real, self.low_imag, self.high_imag)
        ordered = self.low_real < self.high_real and self.low_imag < self.high_imag
        if not all(map(math.isfinite, numbers)) or not ordered:
            shown = ":".join(f"{x:g}" for x in numbers)
            raise InputError(
                f"region {shown}: is not allowed; it must be RE0:RE1:IM0:IM1 with RE0 < RE1 and "
                "IM0 < IM1"
            )

    @property
    def centre(self) -> complex:
        """The middle."""
        return complex(self.low_real + self.high_real, self.low_imag + self.high_imag) / 2

    @property
    def corners(self) -> tuple[complex, ...]:
        """Corners, anticlockwise."""
        return (
            complex(self.low_real, self.low_imag),
            complex(self.high_real, self.low_imag),
            complex(self.high_real, self.high_imag),
            complex(self.low_real, self.high_imag),
        )

    @property
    def radius(self) -> float:
        """Distance of a corner from the centre."""
        return abs(self.corners[0] - self.centre)

    def contains(self, values: NDArray) -> NDArray[np.bool_]:
        """True for each value inside."""
        real, imag = np.real(values), np.imag(values)
        return np.asarray(
            (real > self.low_real)
            & (real < self.high_real)
            & (imag > self.low_imag)
            & (imag < self.high_imag)
        )

    @property
    def sides(self) -> int:
        """Sides of the outline."""
        return 4

    def point(self, t: float) -> complex:
        """A point of the outline, 0 <= t <= 4."""
        k = min(int(t), 3)
        a, b = self.corners[k], self.corners[(k + 1) % 4]
        return a + (t - k) * (b - a)

    def widened(self, share: float) -> Rectangle:
        """The region with a share of its size more on each side."""
        wide = share * (self.high_real - self.low_real)
        high = share * (self.high_imag - self.low_imag)
        return Rectangle(
            self.low_real - wide, self.high_real + wide, self.low_imag - high, self.high_imag + high
        )

    def without_middle(self, reach: float) -> list[Rectangle]:
        """What is left along the longer side if a disc of radius `reach` about the centre is
        known: nothing, two ends, or two halves if the disc is narrower than the rectangle."""
        width, height = self.high_real - self.low_real, self.high_imag - self.low_imag
        across, along = min(width, height) / 2, max(width, height) / 2
        known = math.sqrt(max(reach**2 - across**2, 0.0))
        if known >= along:
            return []
        c = self.centre
        if width > height:
            return [
                Rectangle(self.low_real, c.real - known, self.low_imag, self.high_imag),
                Rectangle(c.real + known, self.high_real, self.low_imag, self.high_imag),
            ]
        return [
            Rectangle(self.low_real, self.high_real, self.low_imag, c.imag - known),
            Rectangle(self.low_real, self.high_real, c.imag + known, self.high_imag),
        ]


@dataclass(frozen=True)
class Disc:
    """|value| < radius, in rad/s."""

    radius: float

    @property
    def sides(self) -> int:
        """Arcs of the outline."""
        return 8

    def point(self, t: float) -> complex:
        """A point of the outline, 0 <= t <= 8."""
        return self.radius * cmath.exp(0.25j * math.pi * t)

    def contains(self, values: NDArray) -> NDArray[np.bool_]:
        """True for each value inside."""
        return np.asarray(np.abs(values) < self.radius)


def band(low_hz: float, high_hz: float) -> Rectangle:
    """The region of a frequency band, with |Re| up to a quarter of its upper end (rad/s).

    Raises InputError unless 0 <= low < high.
    """
    if not 0.0 <= low_hz < high_hz < math.inf:
        raise InputError(
            f"band {low_hz:g}:{high_hz:g}: is not allowed; it must be LOW:HIGH in Hz with "
            "0 <= LOW < HIGH"
        )
    low, high = 2 * math.pi * low_hz, 2 * math.pi * high_hz
    return Rectangle(-DAMPED * high, DAMPED * high, low, high)


@dataclass(frozen=True)
class Discs:
    """Discs within which all roots are believed to be known."""

    discs: tuple[tuple[complex, float], ...]

    def depth(self, value: complex) -> float:
        """How far the nearest place outside the discs is from a value, at least; 0 outside."""
        return max((radius - abs(value - centre) for centre, radius in self.discs), default=0.0)

    def mirrored(self) -> Discs:
        """These and their mirror images below the real axis."""
        return Discs(self.discs + tuple((c.conjugate(), r) for c, r in self.discs))


class Region(Protocol):
    """A region with a closed outline point(t), 0 <= t <= sides, anticlockwise."""

    @property
    def sides(self) -> int:
        """Number of smooth pieces of the outline, one for each unit of t."""

    def point(self, t: float) -> complex:
        """A point of the outline."""

    def contains(self, values: NDArray) -> NDArray[np.bool_]:
        """True for each value inside."""


def paced(region: Region, sides: int, discs: Discs, most: float) -> list[float]:
    """Values of t along the first `sides` pieces of the outline.

    No step is longer than twice the way from its middle to unknown ground; where no disc reaches,
    none is longer than a tenth of `most`.
    """

    def halved(a: float, b: float) -> list[float]:
        middle = (a + b) / 2
        length = abs(region.point(b) - region.point(a))
        if length <= max(2 * discs.depth(region.point(middle)), 0.1 * most):
            return [a]
        return halved(a, middle) + halved(middle, b)

    starts = [t for k in range(sides) for t in halved(float(k), k + 1.0)]
    return [*starts, float(sides)]
