"""Thresholds of a system in its parameter: all of a small one, those of a band of a large one."""

import math
from dataclasses import dataclass, field

import numpy as np

from squeal.analysis.systems.band import BandRates, Placed, placed
from squeal.analysis.systems.sweeps import noise_of, reduced_for, roots_of_all, verdict_of
from squeal.analysis.systems.wanted import TERMS, Wanted, is_small
from squeal.errors import ComputationError, InputError
from squeal.io.writing import Checkpoint
from squeal.linear import CriticalPoint, Crossing, thresholds
from squeal.linear.eigen import ComplexArray
from squeal.linear.matrices import ILL, unit_diagonal
from squeal.linear.search import search
from squeal.linear.system import TermSystem, dense
from squeal.schema.arguments import takes
from squeal.sparse.argument_principle import Rectangle
from squeal.sparse.crossings import crossings_along
from squeal.sparse.eigensolver import modes_in
from squeal.sparse.factor import Progress, quiet
from squeal.sparse.reduction import Reduction

STEPS = 13  # values at which a reduced system has to be good
START = 1e-3  # of the upper end: where a range begins if the factors are not finite at zero
COUNTED_ROWS = 20_000  # larger systems are not counted again between their thresholds


@dataclass(frozen=True)
class SystemThresholds:
    """Every change of verdict and every crossing of the axis in low <= p <= high.

    `certified`: between neighbouring crossings a count of growing roots that needs no eigenvalue
    agrees, at one value each, and so do the roots at all values that were looked at; None if it
    was not made. It does not prove that no window lies between these values. `unconfirmed` names
    what the full system did not confirm, `left_out` what leaves the band while it grows. With a
    band all is told of its roots;
    `crossings_outside` it, None if they are not known.
    """

    low: float
    high: float
    verdict: str  # at the lower end
    points: tuple[CriticalPoint, ...]
    crossings: tuple[Crossing, ...]
    certified: bool | None
    unconfirmed: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    reduction: Reduction | None = field(default=None, repr=False)
    crossings_outside: int | None = None


def start_of(system: TermSystem, low: float | None, high: float) -> float:
    """The lower end of the range: what is given, or 0, or a little above it where a factor divides
    by the parameter."""
    if low is not None:
        return low
    try:
        system.derivative(system.parameter, {system.parameter: 0.0})
        system(0.0)
    except InputError:
        return START * high
    return 0.0


@takes(system=TERMS)
def system_thresholds(
    system: TermSystem,
    high: float,
    low: float | None = None,
    wanted: Wanted | None = None,
    progress: Progress = quiet,
    checkpoint: Checkpoint | None = None,
) -> SystemThresholds:
    """Every threshold of a system in low <= p <= high, of the band if one is wanted.

    A `checkpoint` keeps the reduced system of a large one as it grows.

    Raises InputError for an empty range, and for a large system or complex matrices without a
    band or region.
    """
    wanted = wanted or Wanted()
    if not system.real and wanted.rectangle is None:
        raise InputError(
            "band: is missing; thresholds with a structural loss factor (complex matrices) need "
            "a band or a region"
        )
    low = start_of(system, low, high)
    if not low < high:
        raise InputError(f"high: {high:g} is not allowed; it must exceed {low:g}")
    # if M may be inverted all roots can be followed
    if (is_small(system) and system.real) and (
        wanted.rectangle is None or ILL * np.linalg.cond(unit_diagonal(dense(system(low)[0]))) < 1.0
    ):
        return _small(system, low, high, wanted)
    return _large(system, low, high, wanted, progress, checkpoint)


def _in_band(frequency: float, wanted: Wanted) -> bool:
    if wanted.band is not None:
        return wanted.band[0] <= frequency <= wanted.band[1]
    if wanted.region is not None:
        return wanted.region.low_imag <= 2 * math.pi * frequency <= wanted.region.high_imag
    return True


def _small(system: TermSystem, low: float, high: float, wanted: Wanted) -> SystemThresholds:
    found = thresholds(system, high, mu_min=low)
    at_low = roots_of_all(system, wanted, {system.parameter: low})
    verdict = verdict_of(at_low, noise_of(system))
    if wanted.rectangle is None:
        points, crossings = tuple(found.points), tuple(found.crossings)
        return SystemThresholds(low, high, verdict, points, crossings, found.certified)
    rows = [c for c in found.crossings if _in_band(c.frequency_hz, wanted)]

    def roots(value: float) -> ComplexArray:
        return roots_of_all(system, wanted, {system.parameter: value})

    band = placed(BandRates(roots, noise_of(system)), rows, (low, high))
    return SystemThresholds(
        low,
        high,
        verdict,
        band.points,
        band.crossings,
        found.certified,
        left_out=_left_out(band, system.parameter, wanted),
        crossings_outside=len(found.crossings) - len(rows),
    )


def _large(
    system: TermSystem,
    low: float,
    high: float,
    wanted: Wanted,
    progress: Progress,
    checkpoint: Checkpoint | None,
) -> SystemThresholds:
    name = system.parameter
    # inner values that thresholds do not like to lie at
    inner = [(k + 0.0371 * (1 + k % 3)) / (STEPS - 1) for k in range(1, STEPS - 1)]
    values = [low, *(low + x * (high - low) for x in inner), high]
    changes = [{name: v} for v in values]
    reduction, region = reduced_for(
        system, wanted, changes, progress=progress, checkpoint=checkpoint
    )
    unconfirmed: tuple[str, ...] = ()
    progress("following the roots of the reduced system")
    if system.C or not system.real:
        found = crossings_along(reduction, region, name, values)
        unconfirmed = found.unconfirmed
        rows = [
            Crossing(c.value, c.kind, c.direction, c.frequency_hz, c.interval, 0, False, c.residual)
            for c in found.crossings
        ]
    else:
        rows = _undamped(reduction, region, low, high)
    noise = noise_of(system)

    def roots(value: float) -> ComplexArray:
        return reduction.values(region, {name: value})

    band = placed(BandRates(roots, noise), rows, values)
    unconfirmed += tuple(
        f"{verdict_of(roots(value), noise)} at {name} = {value:.6g} follows from no threshold that "
        "was located"
        for value in band.unexplained
    )
    certified = None
    if system.n <= COUNTED_ROWS:
        certified = not unconfirmed and all(
            _counted(reduction, region, p, progress) for p in band.between
        )
    start = verdict_of(roots(low), noise)
    return SystemThresholds(
        low,
        high,
        start,
        band.points,
        band.crossings,
        certified,
        unconfirmed,
        _left_out(band, name, wanted),
        reduction,
    )


def _left_out(band: Placed, name: str, wanted: Wanted) -> tuple[str, ...]:
    """Sentences on roots that leave the band or region while they grow."""
    region = wanted.rectangle
    assert region is not None
    return tuple(
        f"what grows at {name} = {first:.6g} leaves {wanted.words()} by {name} = {value:.6g} and "
        f"is left out there, as are roots that grow by more than {region.high_real:.4g} 1/s"
        for first, value in band.left
    )


def _undamped(reduction: Reduction, region: Rectangle, low: float, high: float) -> list[Crossing]:
    """Coalescences of the reduced system inside the region."""
    found = search(reduction.system, low, high)
    return [
        c.crossing(0, False, reduction.worst)
        for place in found.places
        for c in place
        if region.low_imag <= c.omega <= region.high_imag
    ]


def _counted(reduction: Reduction, region: Rectangle, value: float, progress: Progress) -> bool:
    """True if the full system has as many growing roots in the region as the reduced one."""
    name, noise = reduction.system.parameter, noise_of(reduction.system)
    progress(f"counting growing roots at {name} = {value:.6g}")
    problem = reduction.basis.scaled.at({name: value})
    try:
        full = modes_in(problem, region, progress=progress)
    except ComputationError:
        return False
    numbers = [
        int(np.sum(z.real > noise * np.abs(z)))
        for z in (full.values, reduction.values(region, {name: value}))
    ]
    return full.certified and numbers[0] == numbers[1]
