"""The verb `critical_speeds` of a rotor: where a whirl frequency is the speed, or a multiple of it.

The roots at a speed are ranked by frequency. The frequency of a rank is a continuous function of
the speed, also where two modes cross and exchange their ranks: a change of sign of the frequency
less a multiple of the speed therefore brackets a critical speed, which Brent's method locates.
"""

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.optimize import brentq

from squeal.errors import InputError
from squeal.io.system import SystemFile
from squeal.io.writing import Answer, Column, Panel, Table, columns
from squeal.linear.continuation import Bools
from squeal.linear.eigen import growth_of
from squeal.linear.matrices import Array
from squeal.linear.roots import ComplexArray
from squeal.linear.shaft import RPM
from squeal.linear.system import TermSystem
from squeal.queries.mode_paths import is_growing
from squeal.queries.options import Band
from squeal.queries.systems.all_roots import is_small
from squeal.queries.systems.system_analysis import SystemAnalysis, refuse_without_effect
from squeal.queries.whirl import whirl_direction
from squeal.schema import Place, Positive, public
from squeal.sparse.dense import CLUSTER_DISTANCE, dense_values, roots_at
from squeal.sparse.reduction import SPURIOUS_RESIDUAL, Reduction

STEPS = 400  # into which the range of speeds is divided
FEW_ROWS = 100  # a rotor of more rows is divided into fewer steps
FEW_STEPS = 100  # the same of a rotor of more than `FEW_ROWS`, of which each step costs much
BASIS_SPEEDS = 9  # speeds at which a reduced system is exact
WELL_DAMPED = 0.2  # damping ratio above which a peak needs no margin
TINY = 1e-12  # damping ratio of an undamped mode, so that 1 / (2 zeta) is finite
SAME = 1e-9  # of the largest speed or frequency: smaller differences are rounding


@dataclass(frozen=True)
class CriticalSpeed:
    """A speed at which the frequency of a mode is `order` times the speed.

    Attributes
    ----------
    speed, order, frequency_hz : float
        The speed in rad/s, the multiple of it, and the frequency there in Hz.
    mode : int
        Number of the mode, from 1, by frequency at this speed; modes that do not vibrate do not
        count. Of a system that was reduced to a band, among the modes of that band.
    direction : str or None
        Of the whirl: forward in the sense in which the shaft turns, backward against it, mixed
        where parts of the rotor differ, straight where no orbit is round; None where no term and
        no orbit tells it, see `squeal.queries.whirl`.
    growth_rate, damping_ratio : float
        Of the mode there, 1/s and 1.
    """

    speed: float
    order: float
    frequency_hz: float
    mode: int
    direction: str | None
    growth_rate: float
    damping_ratio: float


class CampbellDiagram:
    """The roots of a rotor of n degrees of freedom over its speed (rad/s), ranked by frequency.

    The rank of a root is its index, from 0, among `ranked_roots`.
    """

    def __init__(self, file: SystemFile, system: TermSystem, reduction: Reduction | None) -> None:
        """Of a rotor that is small, or that was reduced to the modes of a band."""
        self.file = file
        self.reduction = reduction
        self.system = system if reduction is None else reduction.system
        self.basis = None  # (rows of the rotor, n) of the reduction
        if reduction is not None:
            # in the coordinates of the whole system
            self.basis = reduction.scaled.scale[:, None] * reduction.vectors

    @functools.cache  # noqa: B019  lives as long as one question
    def ranked_roots(self, speed: float) -> ComplexArray:
        """n of the 2n roots at a speed, rad/s, by rising frequency.

        They are the upper root of each conjugate pair, and half of the real roots.
        """
        roots = dense_values(*self.system.arrays({self.system.parameter: speed}))
        # real roots stand between the upper and the lower roots of pairs: the first half has the
        # upper ones and half of the real ones
        falling = np.argsort(-roots.imag, kind="stable")
        return roots[falling[: len(roots) // 2]][::-1]

    @functools.cache  # noqa: B019  lives as long as one question
    def are_modes(self, speed: float) -> Bools:
        """Which of the ranked roots (n,) are roots of the rotor.

        A reduced system has others, too: outside of its band, and some within it whose residual in
        the rotor's own matrices is large.
        """
        roots = self.ranked_roots(speed)
        if self.reduction is None:
            return np.ones(len(roots), dtype=bool)
        changes = {self.system.parameter: speed}
        in_band = self.reduction.region.contains(roots)
        with_vectors = self.reduction.roots(changes, roots[in_band])
        is_genuine = self.reduction.residuals(with_vectors, changes) <= SPURIOUS_RESIDUAL
        return np.isin(roots, with_vectors.values[is_genuine])

    def growing(self, speed: float) -> Bools:
        """Which of the ranked roots (n,) are roots of the rotor that grow."""
        return self.are_modes(speed) & is_growing(self.ranked_roots(speed))

    def gap(self, speed: float, rank: int, order: float) -> float:
        """The frequency of a rank less `order` times the speed, rad/s."""
        return float(self.ranked_roots(speed)[rank].imag - order * speed)

    def crossings(self, speeds: Array, frequencies: Array, order: float) -> list[tuple[float, int]]:
        """The pairs of speed and rank at which a frequency is `order` times the speed.

        speeds (m,): rising; between neighbours a change of sign of `gap` is searched. frequencies
        (m, n): of the ranks at each, rad/s. A frequency that stays the multiple of the speed over
        an interval makes no crossing, but a warning.
        """
        gaps = frequencies - order * speeds[:, None]
        is_at_multiple = np.abs(gaps) <= SAME * frequencies.max(axis=0)
        # at the ends of the range rounding may move a change of sign out of the range
        for end in (0, -1):
            gaps[end, is_at_multiple[end]] = 0.0
        # of each interval between neighbouring speeds (m - 1, n)
        stays_at_multiple = is_at_multiple[:-1] & is_at_multiple[1:]
        if stays_at_multiple.any():
            Place(self.system.name).warn(
                f"over a range of speeds a frequency stays {order:g} times the speed: all of them "
                "are critical, none is listed"
            )
        # at both ends of such an interval the sign is rounding: NaN is no crossing below
        gaps[:-1][stays_at_multiple] = gaps[1:][stays_at_multiple] = math.nan
        crossings = []
        for k, rank in np.argwhere(gaps == 0.0).tolist():
            crossings.append((float(speeds[k]), rank))
        for k, rank in np.argwhere(gaps[:-1] * gaps[1:] < 0.0).tolist():
            speed = brentq(
                self.gap,
                speeds[k],
                speeds[k + 1],
                args=(rank, order),
                xtol=1e-13 * speeds[-1],
                rtol=1e-14,
            )
            crossings.append((float(speed), rank))
        return _at_one_speed(crossings, SAME * float(speeds[-1]))

    def critical_speed(self, speed: float, rank: int, order: float) -> CriticalSpeed:
        """The mode of a rank at a critical speed, at which its frequency is `order` times it."""
        roots = self.ranked_roots(speed)
        root = complex(roots[rank])
        vibrates = self.are_modes(speed) & (roots.imag > 0.0)
        return CriticalSpeed(
            speed=speed,
            order=order,
            frequency_hz=root.imag / math.tau,
            mode=int(np.count_nonzero(vibrates[: rank + 1])),
            direction=self.direction(speed, root),
            growth_rate=growth_of(root),
            damping_ratio=-growth_of(root) / abs(root) + 0.0,  # no negative zero
        )

    def direction(self, speed: float, near: complex) -> str | None:
        """The whirl direction, at a speed, of the root nearest to a value (rad/s).

        A repeated root has several shapes: None where their directions differ.
        """
        roots = self.ranked_roots(speed)
        root = complex(roots[np.argmin(np.abs(roots - near))])
        repeated = roots[np.abs(roots - root) <= CLUSTER_DISTANCE * abs(root)]
        matrices = self.system.arrays({self.system.parameter: speed})
        directions = set()
        for shape in roots_at(*matrices, repeated).right.T:
            directions.add(whirl_direction(self.file, self.system, speed, root, shape, self.basis))
        return directions.pop() if len(directions) == 1 else None


@dataclass(frozen=True, eq=False, repr=False)
class CriticalSpeeds(Answer):
    """Critical speeds from `low` to `high`, by rising speed.

    speeds (m,) and frequencies_hz (m, n) are the Campbell diagram behind them, by rising frequency
    at each speed, of a reduced system NaN outside of its band; growing (m, n) says which modes
    grow; diagram: what computes them.

    Examples
    --------
    >>> import squeal
    >>> gyroscopic = {"speed": [[0, 2], [-2, 0]]}
    >>> K = [[12, 0], [0, 12]]
    >>> tilt = squeal.System([[1, 0], [0, 1]], gyroscopic, K, parameter="speed")
    >>> found = squeal.critical_speeds(tilt, 20.0)  # s^2 - 2 speed s = 12 at s = -speed
    >>> [round(row["speed"], 9) for row in found.to_records()]
    [2.0]
    """

    panel = Panel("speed", "frequency_hz")

    name: str
    parameter: str
    low: float
    high: float
    orders: tuple[float, ...]
    critical: tuple[CriticalSpeed, ...]
    speeds: Array = field(repr=False)
    frequencies_hz: Array = field(repr=False)
    growing: Bools = field(repr=False)
    diagram: CampbellDiagram = field(repr=False)

    @property
    def running(self) -> float:
        """The rotor's own speed, rad/s."""
        return self.diagram.system.parameters[self.parameter]

    def margin(self, critical_speed: CriticalSpeed) -> float | None:
        """How far a critical speed lies above the running speed, as a share of it; None at rest.

        Examples
        --------
        >>> import squeal
        >>> gyroscopic = {"speed": [[0, 2], [-2, 0]]}
        >>> parts = [[1, 0], [0, 1]], gyroscopic, [[12, 0], [0, 12]]
        >>> tilt = squeal.System(*parts, {"speed": 1.6}, parameter="speed")
        >>> found = squeal.critical_speeds(tilt, 20.0)
        >>> round(found.margin(found.critical[0]), 9)  # 2 rad/s, of 1.6
        0.25
        """
        return critical_speed.speed / self.running - 1.0 if self.running else None

    def is_near(self, critical_speed: CriticalSpeed) -> bool:
        """Whether a critical speed lies nearer to the running speed than API 617 allows.

        For a critical speed below the running one the 7th edition requires a margin of
        17 % (1 - 1 / (AF - 1.5)), for one above it 10 % more, as shares of the running speed.
        AF = 1 / (2 zeta) is the amplification factor of a peak of damping ratio zeta. Below
        AF = 2.5, which is zeta = 0.2, it requires no margin.

        Examples
        --------
        >>> import squeal
        >>> gyroscopic = {"speed": [[0, 2], [-2, 0]]}
        >>> parts = [[1, 0], [0, 1]], gyroscopic, [[12, 0], [0, 12]]
        >>> tilt = squeal.System(*parts, {"speed": 1.6}, parameter="speed")
        >>> found = squeal.critical_speeds(tilt, 20.0)
        >>> found.is_near(found.critical[0])  # 25 % above; undamped it has to be 27 %
        True
        """
        margin = self.margin(critical_speed)
        damping_ratio = critical_speed.damping_ratio
        if margin is None or damping_ratio > WELL_DAMPED:
            return False
        # a mode that grows counts as undamped
        amplification = 1.0 / (2.0 * max(damping_ratio, TINY))
        required = 0.17 * (1.0 - 1.0 / (amplification - 1.5))
        if margin > 0.0:  # the critical speed is above the running one
            required += 0.1
        return abs(margin) < required

    @property
    def judgement(self) -> str:
        """Which critical speeds are near the running one, in words; empty at rest."""
        if not self.running:
            return ""
        near = [f"{mode.speed:.4g}" for mode in self.critical if self.is_near(mode)]
        allowed = f"nearer to {self.running:.4g} rad/s than API 617 allows"
        return f"; {allowed}: {', '.join(near) or 'none'}"

    def table(self) -> Table:
        table = (
            Column("speed", "rad/s"),
            Column("rpm", value=lambda mode: RPM * mode.speed),
            *columns("order frequency_hz direction"),
            Column("mode", hidden=True),  # counted at this speed, else at one value of a sweep
            Column("growth_rate", "1/s"),
            *columns("damping_ratio%"),
            Column("margin", value=self.margin, percent=True, words="from running speed, %"),
        )
        nothing = f"no single critical speed from {self.low:g} to {self.high:g} rad/s"
        return Table(table, self.critical, f"critical speeds{self.judgement}", nothing)

    def parts(self) -> Sequence[str | Table]:
        orders = ", ".join(f"{order:g}x" for order in self.orders)
        head = f"{self.name}: {len(self.critical)} critical speeds ({orders})"
        step = self.speeds[1] - self.speeds[0]
        doubt = (
            "a multiple that a mode touches, or two crossings of one mode within "
            f"{step:.3g} rad/s of each other, may be missed"
        )
        return [head, self.table(), doubt]

    def to_dict(self) -> dict[str, Any]:
        return {
            "name": self.name,
            "parameter": self.parameter,
            "orders": list(self.orders),
            "critical_speeds": self.table().records(),
        }


@public
def critical_speeds(
    subject: object,
    high: float,
    low: float = 0.0,
    orders: Sequence[float] = (1.0,),
    band: Band | None = None,
    memory: Positive | None = None,
) -> CriticalSpeeds:
    """Locate critical speeds: where a whirl frequency is the speed, or a multiple of it.

    Parameters
    ----------
    subject : SystemFile or TermSystem
        A rotor in the fixed frame whose free parameter is its speed in rad/s.
    high, low : float
        Range of the speed, rad/s.
    orders : sequence of float
        Multiples of the speed: 1 for unbalance, 2 for the pass of two blades, and so on.
    band : (float, float), optional
        Frequencies in Hz; of more than 400 rows it is required, and reduces the system.
    memory : float, optional
        Bytes that may be used.

    Returns
    -------
    CriticalSpeeds
        Each with its frequency, whirl direction and damping; ``plot()`` draws the diagram.

    Raises
    ------
    InputError
        For a pad, matrices that are complex or follow the frequency, an M that is singular at some
        of the speeds, a range that is empty, or where no matrix depends on the free parameter but
        some on others.

    Examples
    --------
    A disc of polar inertia 2 and diametral inertia 1 that tilts on springs: only backward whirl
    meets the speed, at (k / (1 + 2))^(1/2).

    >>> import squeal
    >>> gyroscopic = [[0, 2], [-2, 0]]
    >>> tilt = squeal.System([[1, 0], [0, 1]], {"speed": gyroscopic}, [[12, 0], [0, 12]],
    ...     parameter="speed")
    >>> found = critical_speeds(tilt, 20.0)
    >>> [(round(mode.speed, 9), mode.direction) for mode in found.critical]
    [(2.0, 'backward')]
    """
    analysis = SystemAnalysis.of(subject, band=band, memory=memory)
    system = analysis.system
    if not system.real:
        raise InputError(
            f"{system.name}: critical speeds need real matrices that do not follow the frequency "
            "of a root"
        )
    if system.names:  # matrices depend on parameters: the speed has to be one of these
        refuse_without_effect(analysis.file, [system.parameter], Place("parameter"))
    analysis.warn_of_unused_parameter()
    if not 0.0 <= low < high:
        raise InputError(f"high: {high:g} is not allowed; it must be above low, at least 0")
    if not orders or any(order <= 0.0 for order in orders):
        raise InputError(
            "orders: must be numbers above 0; of order 0 are standing waves, and real roots "
            "at every speed"
        )
    reduction = None
    if not is_small(system):
        reduction = analysis.reduced(np.linspace(low, high, BASIS_SPEEDS).tolist())
    diagram = CampbellDiagram(analysis.file, system, reduction)
    steps = STEPS if diagram.system.n <= FEW_ROWS else FEW_STEPS
    speeds = np.linspace(low, high, steps + 1)
    ranked_roots = [diagram.ranked_roots(speed) for speed in speeds.tolist()]
    if len(set(map(len, ranked_roots))) > 1:
        raise InputError("M: must be singular at all speeds of the range, or at none of them")
    roots = np.array(ranked_roots)  # (speeds, ranks)
    critical = []
    for order in orders:
        for speed, rank in diagram.crossings(speeds, roots.imag, order):
            # at a speed of 0 a frequency of zero is a multiple of the speed, in every rotor
            if speed == 0.0 or not diagram.are_modes(speed)[rank]:
                continue
            crossing = diagram.critical_speed(speed, rank, order)
            if band is None or band[0] <= crossing.frequency_hz <= band[1]:
                critical.append(crossing)
    critical.sort(key=lambda crossing: (crossing.speed, crossing.mode))
    are_modes = np.array([diagram.are_modes(speed) for speed in speeds.tolist()])
    frequencies_hz = np.where(are_modes, roots.imag / math.tau, math.nan)
    return CriticalSpeeds(
        name=system.name,
        parameter=system.parameter,
        low=float(low),
        high=float(high),
        orders=tuple(map(float, orders)),
        critical=tuple(critical),
        speeds=speeds,
        frequencies_hz=frequencies_hz,
        growing=are_modes & is_growing(roots),
        diagram=diagram,
    )


def _at_one_speed(crossings: Sequence[tuple[float, int]], near: float) -> list[tuple[float, int]]:
    """Give crossings that differ by rounding alone, as of two modes of one frequency, one speed.

    Each that follows another one no farther away than `near` (rad/s) gets its speed. Crossings are
    pairs of speed and rank; they are returned by rising speed.
    """
    joined: list[tuple[float, int]] = []
    for speed, rank in sorted(crossings):
        if joined and speed - joined[-1][0] <= near:
            speed = joined[-1][0]
        joined.append((speed, rank))
    return joined
