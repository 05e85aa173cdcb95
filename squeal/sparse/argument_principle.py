"""How many roots lie in a region: the argument principle on factorised determinants.

det P winds once around zero for each root inside a circle. Divided by the factors of the roots that
are known, what is left is analytic inside and without zeros if none is missing: its phase is then
the harmonic conjugate of the logarithm of its size. The pivots of a factorisation give both, the
phase but for half turns; where they part by turns around the circle, so many roots are missing.
Only logarithms of pivots are used, so nothing can overflow.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import NDArray

from squeal.errors import InputError
from squeal.sparse.quadratic import PROGRESS, ComplexArray, Factor, Quadratic, factorise_at

DAMPED = 0.25  # a band holds roots whose real part is at most this share of its upper end
NODES = (8, 16, 32)  # on a circle, until they resolve what is left of the determinant
SINGLE_ROWS = 150_000  # of more, rounding of single precision hides what few determinants show
NEGATIVE = 0.035, 0.02  # largest shares of the powers -2 and -1 in a function that is analytic


@dataclass(frozen=True)
class Rectangle:
    """low_real < Re < high_real, low_imag < Im < high_imag (1/s and rad/s)."""

    low_real: float
    high_real: float
    low_imag: float
    high_imag: float

    def __post_init__(self) -> None:
        numbers = astuple(self)
        a, b, c, d = numbers
        if not (all(map(math.isfinite, numbers)) and a < b and c < d):
            allowed = "it must be RE0:RE1:IM0:IM1 with RE0 < RE1 and IM0 < IM1"
            shown = ":".join(f"{x:g}" for x in numbers)
            raise InputError(f"region {shown}: is not allowed; {allowed}")

    @property
    def size(self) -> complex:
        """Width and height."""
        return complex(self.high_real - self.low_real, self.high_imag - self.low_imag)

    @property
    def centre(self) -> complex:
        """The middle."""
        return complex(self.low_real, self.low_imag) + self.size / 2

    @property
    def radius(self) -> float:
        """Distance of a corner from the centre."""
        return abs(self.size) / 2

    def contains(self, values: NDArray) -> NDArray[np.bool_]:
        """True for each value inside."""
        real, imag = np.real(values), np.imag(values)
        across = (real > self.low_real) & (real < self.high_real)
        return np.asarray(across & (imag > self.low_imag) & (imag < self.high_imag))

    def distance(self, values: NDArray) -> NDArray[np.float64]:
        """How far values lie beyond the nearest side, negative inside."""
        a, b, c, d = astuple(self)
        real, imag = np.real(values), np.imag(values)
        return np.asarray(np.max([a - real, real - b, c - imag, imag - d], axis=0))

    def widened(self, share: float) -> Rectangle:
        """The region with a share of its size more on each side."""
        a, b, c, d = astuple(self)
        by = share * self.size
        return Rectangle(a - by.real, b + by.real, c - by.imag, d + by.imag)


@dataclass(frozen=True)
class Disc:
    """|value - centre| < radius, in rad/s."""

    radius: float
    centre: complex = 0j

    def contains(self, values: NDArray) -> NDArray[np.bool_]:
        """True for each value inside."""
        return np.asarray(np.abs(values - self.centre) < self.radius)


Region = Rectangle | Disc


def band(low_hz: float, high_hz: float) -> Rectangle:
    """The region of a frequency band, with |Re| up to a quarter of its upper end (rad/s).

    Raises
    ------
    InputError
        Unless 0 <= low < high.
    """
    if not 0.0 <= low_hz < high_hz < math.inf:
        allowed = "it must be LOW:HIGH in Hz with 0 <= LOW < HIGH"
        raise InputError(f"band {low_hz:g}:{high_hz:g}: is not allowed; {allowed}")
    low, high = 2 * math.pi * low_hz, 2 * math.pi * high_hz
    return Rectangle(-DAMPED * high, DAMPED * high, low, high)


def count_roots(
    problem: Quadratic, disc: Disc, known: ComplexArray, like: Factor | None = None
) -> int | None:
    """The number of roots of P inside a disc, multiple ones counted as often; None if 32
    determinants do not settle it.

    `known` (m,) are roots in and around it, of real matrices with their conjugates; those outside
    may be rough. A root that is left out is counted all the same; one outside the disc and near it
    costs determinants, and one on its outline makes the number depend on rounding. `like` is a
    factor that is no longer needed. Raises ComputationError if P is singular everywhere.
    """
    half = problem.real and disc.centre.imag == 0.0  # the lower half mirrors the upper one
    most, factor = NODES[-1], like
    # what rounding of single precision spoils does not fit
    for single in (True, False) if problem.n <= SINGLE_ROWS else (False,):
        logs = np.full(most, np.nan, dtype=complex)
        for nodes in NODES:
            every = most // nodes
            for k in range(0, most // 2 + 1 if half else most, every):
                if np.isnan(logs[k]):
                    PROGRESS.get()(f"counting the roots: determinant of {nodes}")
                    place = disc.centre + disc.radius * cmath.exp(2j * math.pi * k / most)
                    place, factor = factorise_at(problem, place, single, factor)
                    logs[k] = factor.logarithm() - np.sum(np.log(place - known))
                    if half and 0 < 2 * k < most:
                        logs[most - k] = logs[k].conjugate()
            missing = _winding(logs[::every])
            if missing is not None:
                return missing + int(np.sum(disc.contains(known)))
    return None


def _winding(logs: ComplexArray) -> int | None:
    """How often exp(logs) winds around zero, of values (N,) on a circle whose imaginary parts are
    known up to half turns; None if too few.

    A root close to the outline hides behind a half turn, but not from what is foreseen: of 240,000
    random roots inside one did, among steps below pi / 8 that leave no negative powers.
    """
    nodes = len(logs)
    turn = -1j * np.sign(np.fft.fftfreq(nodes))
    turn[nodes // 2] = 0.0
    foreseen = np.fft.ifft(turn * np.fft.fft(logs.real)).real  # harmonic conjugate of the size
    rest = logs.imag - foreseen
    off = np.diff(np.append(rest, rest[0]))
    off -= math.pi * np.round(off / math.pi)
    turns, most = float(np.sum(off)) / (2 * math.pi), float(np.max(np.abs(off)))
    if round(turns) and abs(turns - round(turns)) < 0.25:
        return round(turns) if most < math.pi / 4 else None
    if not most < math.pi / 8 or round(2 * turns):
        return None
    # an analytic function has no negative powers; those of a root near the outline are slow
    phase = foreseen + np.cumsum(np.append(0.0, off[:-1]))
    powers = np.fft.fft(logs.real + 1j * phase)[-2:] / nodes
    return 0 if np.all(np.abs(powers) < NEGATIVE) else None


def disc_around(region: Rectangle, known: ComplexArray, reach: float) -> Disc:
    """A disc that holds a rectangle and whose outline runs far from the known roots.

    Up to the radius `reach` all roots are believed to be known; it goes a quarter of the way.
    """
    away = np.abs(known - region.centre)
    low = region.radius
    high = max(low + (min(reach, 3 * low) - low) / 4, 1.01 * low)
    ends = np.sort([low, *away[(away > low) & (away < high)], high])
    k = int(np.argmax(np.diff(ends)))
    return Disc(float(ends[k] + ends[k + 1]) / 2, region.centre)
