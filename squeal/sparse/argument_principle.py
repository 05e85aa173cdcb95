"""How many roots lie in a region: the argument principle on factorised determinants.

det P winds once around zero for each root inside a circle. Divided by the factors of the known
roots, the quotient is analytic inside, and has no zeros there if no root is missing: its phase is
then the harmonic conjugate of the logarithm of its size. The pivots of a factorisation give both,
the phase up to half turns. The number of turns by which the two differ around the circle is the
number of missing roots.
Only logarithms of pivots are used, so nothing can overflow.
"""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import NDArray

from squeal.errors import InputError
from squeal.numerics.threads import side_by_side
from squeal.sparse.factor import Factor, factorise_at
from squeal.sparse.quadratic import Bools, ComplexArray, Indices, ScaledProblem, report_progress

DAMPED_SHARE = 0.25  # a band holds roots whose real part is at most this share of its upper end
SURROUNDINGS = 0.1  # of a region's size: how far around it roots are followed, at least
DRIFT = 0.1  # of the highest frequency: ... or so far
NODE_COUNTS = (8, 16, 32)  # on a circle, until they resolve the quotient
SINGLE_ROWS = 150_000  # of more, rounding of single precision hides what few determinants show
NEGATIVE_POWERS = (0.035, 0.02)  # of an analytic function: largest coefficients of z^-2 and z^-1
CENTRAL = 0.01  # of a radius: known roots so close to a centre may have copies that are hidden


@dataclass(frozen=True)
class Rectangle:
    """low_real < Re < high_real, low_imag < Im < high_imag (1/s and rad/s)."""

    low_real: float
    high_real: float
    low_imag: float
    high_imag: float

    def __post_init__(self) -> None:
        is_finite = all(map(math.isfinite, astuple(self)))
        is_ordered = self.low_real < self.high_real and self.low_imag < self.high_imag
        if not (is_finite and is_ordered):
            allowed = "it must be RE0:RE1:IM0:IM1 with RE0 < RE1 and IM0 < IM1"
            raise InputError(f"region {self}: is not allowed; {allowed}")

    def __str__(self) -> str:
        return ":".join(f"{side:g}" for side in astuple(self))

    @property
    def size(self) -> complex:
        """Width and height."""
        return complex(self.high_real - self.low_real, self.high_imag - self.low_imag)

    @property
    def centre(self) -> complex:
        """The middle."""
        return complex(self.low_real, self.low_imag) + self.size / 2

    @property
    def off_centre(self) -> complex:
        """A shift for inverse iteration, beside the centre: at a root P is singular, and next to
        one, where symmetry may put it, single precision shows no other root."""
        return self.centre + (0.03 + 0.04j) * self.radius

    @property
    def radius(self) -> float:
        """Distance of a corner from the centre."""
        return abs(self.size) / 2

    def contains(self, values: NDArray) -> Bools:
        """True for each value inside."""
        return self.distance(values) < 0.0

    def distance(self, values: NDArray) -> NDArray[np.float64]:
        """How far values lie beyond the sides, the largest of four excesses: negative inside."""
        real = np.real(values)
        imag = np.imag(values)
        excesses = [
            self.low_real - real,
            real - self.high_real,
            self.low_imag - imag,
            imag - self.high_imag,
        ]
        return np.max(excesses, axis=0)

    @property
    def surroundings(self) -> Rectangle:
        """The region and what lies around it: on each side a tenth of its size more, or a tenth of
        its highest frequency if that is greater.

        A root may come from there, pass the region and leave it between two values of a parameter.
        """
        drift = DRIFT * max(abs(self.low_imag), abs(self.high_imag))
        across = max(SURROUNDINGS * self.size.real, drift)
        along = max(SURROUNDINGS * self.size.imag, drift)
        low_imag = self.low_imag - along
        if self.low_imag > 0.0:  # the lower half of the plane and real roots stay outside
            low_imag = max(low_imag, self.low_imag / 2)
        return Rectangle(
            low_real=self.low_real - across,
            high_real=self.high_real + across,
            low_imag=low_imag,
            high_imag=self.high_imag + along,
        )

    def widened(self, share: float) -> Rectangle:
        """The region with a share of its size more on each side."""
        margin = share * self.size
        return Rectangle(
            low_real=self.low_real - margin.real,
            high_real=self.high_real + margin.real,
            low_imag=self.low_imag - margin.imag,
            high_imag=self.high_imag + margin.imag,
        )


@dataclass(frozen=True)
class Disc:
    """|value - centre| < radius, in rad/s."""

    radius: float
    centre: complex = 0j

    def contains(self, values: NDArray) -> Bools:
        """True for each value inside."""
        return np.abs(values - self.centre) < self.radius


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
    low = math.tau * low_hz
    high = math.tau * high_hz
    return Rectangle(-DAMPED_SHARE * high, DAMPED_SHARE * high, low, high)


def count_roots(
    problem: ScaledProblem, disc: Disc, known: ComplexArray, reusable: Factor | None = None
) -> int | None:
    """The number of roots of P inside a disc, with multiplicity; None if the determinants at all
    nodes of the circle leave it open.

    By the argument principle: while z runs once around the disc det P(z) / prod(z - known) makes
    one turn around zero for each root inside that is not known. The number of turns is added to
    that of known roots inside. The circle is refined until its nodes resolve the quotient, first in
    single precision, then in double. Where a known root lies at the centre, as the zeros of free
    motions do, one more determinant shows copies of it that nodes hide, see `_hidden_roots`.

    Parameters
    ----------
    problem : ScaledProblem
        P.
    disc : Disc
        Where.
    known : ndarray (m,)
        Roots in and around the disc, of real matrices with their conjugates; roots outside may be
        rough. A root inside that is missing here is counted all the same. One that is missing near
        the outline costs determinants; on the outline it makes the number depend on rounding.
    reusable : Factor, optional
        A factor that is no longer needed, whose memory may serve: it solves nothing afterwards.

    Raises
    ------
    ComputationError
        If P is singular everywhere.
    """
    finest = 2 * NODE_COUNTS[-1]  # nodes of the finest circle, and those halfway between two
    directions = np.exp(2j * np.pi * np.arange(finest) / finest)
    # of real matrices det P(conj z) is the conjugate of det P(z): around a real centre the upper
    # half of the nodes serves both halves. The first node then lies half a step above the real
    # axis, so that none lies on the imaginary axis next to lightly damped roots. At least 16 nodes
    # are used: of 3,000 random sets in which a pair of such roots was missing, eight nodes, two of
    # them on the axis, took 107 for complete; 16 nodes, none of them on the axis, took none
    is_mirrored = problem.is_real and disc.centre.imag == 0.0
    node_counts = NODE_COUNTS[1:] if is_mirrored else NODE_COUNTS
    has_central_roots = np.any(np.abs(known - disc.centre) <= CENTRAL * disc.radius)
    inner = directions[1] / 2  # inside the circle, for `_hidden_roots`
    points = disc.centre + disc.radius * np.append(directions, inner)
    # log (det P(z) / prod(z - known)) at the points z; NaN: not computed yet
    logarithms = np.empty(finest + 1, dtype=complex)

    def compute(single: bool, nodes: Indices, factor: Factor | None) -> None:
        """Compute logarithms at `nodes`, some of those that the loop below calls `computed`; each
        factor lends its memory to the next one."""
        for k in nodes:
            report_progress(f"counting the roots: a determinant of {len(computed)}")
            # z is the node, or a value next to it where P is singular at the node
            z, factor = factorise_at(problem, complex(points[k]), single, factor)
            logarithms[k] = factor.logarithm() - np.sum(np.log(z - known))

    for single in (True, False):
        # single precision first: what its rounding spoils gives no whole number of turns
        if single and problem.n > SINGLE_ROWS:
            continue
        logarithms[:] = np.nan
        for count in node_counts:
            step = finest // count
            indices = np.arange(step // 2 if is_mirrored else 0, finest, step)
            computed = indices[: count // 2] if is_mirrored else indices
            # the other nodes come from coarser circles
            new = computed[np.isnan(logarithms[computed])]
            # two chains for two workers, whatever their number
            chains = [new[::2], new[1::2]]
            list(side_by_side(compute, [single, single], chains, [reusable, None]))
            if is_mirrored:  # the mirror image of node k is node finest - k
                logarithms[finest - computed] = logarithms[computed].conj()
            missing = _winding_number(logarithms[indices])
            if missing == 0 and has_central_roots:
                compute(single, np.array([finest]), None)
                with_inner = np.append(indices, finest)
                missing = _hidden_roots(points[with_inner], logarithms[with_inner])
            if missing is not None:
                return missing + len(known[disc.contains(known)])
    return None


def _winding_number(logarithms: ComplexArray) -> int | None:
    """How often exp(logarithms) turns around zero, from N logarithms at equal steps on a circle.

    Their imaginary parts (phases) are known up to half turns. A phase is the harmonic conjugate of
    the logarithm of the size, as of a function that is analytic inside (by the discrete Hilbert
    transform), and a deviation, which grows by the angle of all turns along the circle. This is
    derived in `docs/searching.md`, How often a determinant turns.

    None if N is too small: the deviation must step by little from one node to the next (by less
    than pi / 4 with turns, pi / 8 without), and without turns the function must be analytic inside.
    Of 240,000 random roots inside the circle and near it one was missed with these limits.

    Sixteen nodes on the unit circle, with a root inside and with one outside:

    >>> z = np.exp(2j * np.pi * np.arange(16) / 16)
    >>> _winding_number(np.log(z - 0.2)), _winding_number(np.log(z - 3.0))
    (1, 0)
    """
    nodes = len(logarithms)
    to_conjugate = -1j * np.sign(np.fft.fftfreq(nodes))
    to_conjugate[nodes // 2] = 0.0  # the highest frequency has no sign
    predicted = np.fft.ifft(to_conjugate * np.fft.fft(logarithms.real)).real
    deviation = logarithms.imag - predicted
    steps = np.diff(np.append(deviation, deviation[0]))
    steps -= math.pi * np.round(steps / math.pi)  # without the unknown half turns
    largest_step = float(np.max(np.abs(steps)))
    if not largest_step < math.pi / 4:  # NaN too
        return None
    # before that subtraction the steps around the circle added up to zero; now they add up to the
    # half turns of the deviation
    half_turns = round(float(np.sum(steps)) / math.pi)
    if half_turns % 2:
        return None
    if half_turns:
        return half_turns // 2
    if largest_step >= math.pi / 8:
        return None
    # an analytic function has no negative powers; a root near the outline leaves large ones
    phase = predicted + np.cumsum(np.append(0.0, steps[:-1]))
    coefficients = np.fft.fft(logarithms.real + 1j * phase) / nodes
    negative_powers = coefficients[-2:]  # of z^-2 and z^-1
    if not np.all(np.abs(negative_powers) < NEGATIVE_POWERS):
        return None
    return 0


def _hidden_roots(points: ComplexArray, logarithms: ComplexArray) -> int:
    """How many roots at the centre of a circle its N nodes do not show: a multiple of N / 2.

    z^(N / 2) makes a half turn from one node to the next, and half turns are not known. But it is
    smaller inside the circle. The logarithm of the size of a function without zeros is the mean of
    those on the circle, weighted by the Poisson kernel; a zero at the centre lessens it by log 2 at
    half the radius (Jensen's formula).

    points, logarithms (N + 1,): the nodes and, last, a point at half the radius.
    """
    nodes = len(points) - 1
    poisson_kernel = np.abs(points[:nodes] - points[nodes]) ** -2.0
    without_zeros = np.average(logarithms[:nodes].real, weights=poisson_kernel)
    zeros = (without_zeros - logarithms[nodes].real) / math.log(2.0)
    return nodes // 2 * round(2 * zeros / nodes)


def disc_around(region: Rectangle, known: ComplexArray, reach: float) -> Disc:
    """A disc around the centre of a rectangle that holds it, far from the known roots (m,).

    All roots up to the distance `reach` from the centre are taken to be known. The circle lies in
    the widest gap between their distances, the corners and the largest radius, in its middle: with
    corners at 10, roots at 11 and 14, and the largest radius 15, at 12.5.
    """
    distances = np.abs(known - region.centre)
    corners = region.radius
    # the largest radius: a quarter of the way from the corners to the reach, but from 1.01 to 1.5
    # times as far out as the corners
    margin = min((reach - corners) / 4, corners / 2)
    largest = corners + max(margin, 0.01 * corners)
    between = distances[(distances > corners) & (distances < largest)]
    radii = np.sort([corners, *between, largest])
    widest = int(np.argmax(np.diff(radii)))
    return Disc(float(radii[widest] + radii[widest + 1]) / 2, region.centre)
