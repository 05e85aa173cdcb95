"""The real modes behind a growing mode: two that friction couples, or one that grows alone.

Real modes x are those of the structure without friction and damping: K x = w^2 M x with x' M x = 1.
"""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from squeal.errors import ComputationError
from squeal.linear import UnstableMode
from squeal.linear.matrices import Array, Matrix, dense, is_sparse
from squeal.linear.real_modes import real_modes
from squeal.results.eigenvalues import Eigenvalues
from squeal.sparse.factor import factorise, modes_near

NEAR = 12  # real modes around a growing one
PARTNER = 0.02  # of the participation of the leading real mode: what a second one has at least
SAME = 1e-4  # of the frequency: real modes that a page does not tell apart
SAME_START = 1e-3  # of the frequency: so near is a mode of the chart to its real mode
PARALLEL = 1e-7  # below one: the cosine between vectors that rounding alone tells apart


class Cure(Enum):
    """What is done to the real modes behind a growing one."""

    APART = "further apart"
    BOTH = "all damped"
    LOWER = "the lower one damped"
    UPPER = "the upper one damped"


SIDES = (Cure.LOWER, Cure.UPPER)
DAMPED = {Cure.BOTH: (1.0, 1.0), Cure.LOWER: (1.0, 0.0), Cure.UPPER: (0.0, 1.0)}
"""The share of the damping that the lower and the upper mode get."""


@dataclass(frozen=True, eq=False)
class Meeting:
    """Two real modes that feed a growing one, or the one that grows alone, and what stops growth.

    Several real modes may have one frequency, to `SAME`: then k counts all of these.

    Attributes
    ----------
    omega : array (k,)
        Angular frequencies of the real modes, rising, rad/s.
    is_upper : array (k,)
        Which have the upper of two frequencies; none where there is one frequency.
    indices : tuple of k int
        The numbers of these modes among the real modes behind all growing ones.
    cures : mapping
        By kind the amount that just stops all growing modes at the present value of the free
        parameter, if each of them gets the same kind: of `APART` how much further apart the two
        must be, Hz, of the others how much more damping is needed, as a share of critical damping.
        0 where the cures of other modes stop this one too. A kind of which no amount up to `MOST`
        is enough is missing.
    advised : mapping
        By kind the amount that is advised, `IN_HAND` times the above or more. It is confirmed for
        all values up to `IN_HAND` times the present one, else up to that one, else at that value.
    is_of_chart : bool
        Whether the eigenvalue paths of the two modes that meet begin at these frequencies.
    """

    omega: Array
    is_upper: Array
    indices: tuple[int, ...]
    cures: Mapping[Cure, float]
    advised: Mapping[Cure, float]
    is_of_chart: bool

    @property
    def hertz(self) -> tuple[float, ...]:
        """The one frequency, or the lower and the upper one, without friction and damping, Hz."""
        lower_and_upper = [0, -1]
        omega = self.omega[lower_and_upper] if self.is_pair else self.omega[:1]
        return tuple((omega / math.tau).tolist())

    @property
    def is_pair(self) -> bool:
        """Whether the real modes have two frequencies."""
        return bool(self.is_upper.any())

    @property
    def alone(self) -> Cure | None:
        """Which mode, damped alone, is known to stop growth; None if neither is. Of two that do it
        is the one that needs less."""
        upper = int(np.sum(self.is_upper))
        counts = {Cure.LOWER: len(self.omega) - upper, Cure.UPPER: upper}
        # of several modes of one frequency any combination is a mode: no one can be damped
        sides = [side for side in SIDES if counts[side] == 1 and side in self.advised]
        return min(sides, key=self.advised.__getitem__, default=None)

    def unit(self, cure: Cure) -> float:
        """The amount of a cure that counts as 1: the upper frequency, Hz, or critical damping."""
        return self.hertz[-1] if cure is Cure.APART else 1.0

    def added(self, cure: Cure, amount: float) -> Array:
        """The factors (k,) of M x x' M of the modes that a cure adds: to K or, as damping, to C.

        w_2^2 - w^2 raises a mode from w to w_2; 2 zeta w is the damping of the ratio zeta.
        """
        if cure is Cure.APART:
            raised = self.omega + math.tau * amount * self.is_upper
            return raised**2 - self.omega**2
        lower_share, upper_share = DAMPED[cure]
        zeta = amount * np.where(self.is_upper, upper_share, lower_share)
        return 2.0 * zeta * self.omega


@dataclass(eq=False)
class RealModes:
    """Real modes behind growing modes, which `behind` finds and numbers as it is called.

    Attributes
    ----------
    spectrum : Eigenvalues
        Roots with vectors, among them those of the growing modes.
    mass, stiffness : matrix (n, n)
        Of the structure, real.
    forces : list of array (n,)
        By number M x of each real mode behind a growing one: what is behind several is one mode.
    shapes : list of array (n, k)
        Of each growing mode the shapes x of the `NEAR` real modes nearest to it.
    """

    spectrum: Eigenvalues
    mass: Matrix
    stiffness: Matrix
    forces: list[Array] = field(default_factory=list)
    shapes: list[Array] = field(default_factory=list)

    def behind(self, mode: UnstableMode, starts: Sequence[float]) -> list[Meeting]:
        """The real modes that may be behind a growing one, the likeliest first.

        In a chart of the eigenvalues over the free parameter the growing mode meets another one.
        First come the two real modes at which the paths of these two begin; without a chart, the
        two that take part most. Then come the pairs of the three that take part most, or the only
        mode that takes part. Choices that hold a free motion are left out. Empty if the growing
        mode does not vibrate, or if each choice holds a free motion. `forces` and `shapes` of this
        object grow by those of the modes, also of choices that are left out.

        starts: angular frequencies at which the paths begin, rad/s; empty without a chart.
        """
        if not mode.frequency_hz:
            return []
        omega, shapes = _modes_near(self.stiffness, self.mass, mode.root.imag)
        nearest = np.argsort(abs(omega - mode.root.imag))[:NEAR]
        self.shapes.append(shapes[:, nearest])
        forces = self.mass @ shapes  # M x of each computed mode
        leading = self._leading(mode, forces)  # up to three indices of columns, by falling share
        choices = list(itertools.combinations(leading, min(2, len(leading))))
        # the indices of the real modes at which the paths begin; none if a path begins elsewhere
        chart = tuple(int(abs(omega - start).argmin()) for start in starts)
        if not np.allclose(omega[list(chart)], starts, rtol=SAME_START):
            chart = ()
        # without two paths the first choice stands twice: so number 0 is the choice of the chart
        # for all growing modes, and number 1 that of the modes that take part most
        choices.insert(0, chart if len(chart) == 2 else choices[0])
        meetings = []
        for choice in choices:
            is_of_chart = set(choice) == set(chart)
            meeting = self._meeting(omega, forces, sorted(choice), is_of_chart)
            if meeting.omega.all():  # a free motion has no frequency to separate or damp
                meetings.append(meeting)
        return meetings

    def _leading(self, mode: UnstableMode, forces: Array) -> list[int]:
        """The indices of up to three real modes that take part most in a growing mode, falling.

        The share of a real mode x is its participation factor |x' M v| |x' M u|, v and u the right
        and left vector of the growing mode. forces: columns M x.
        """
        nearest = int(abs(self.spectrum.values - mode.root).argmin())
        root = self.spectrum.eigenvalues[nearest]
        left = root.left if len(root.left) else root.right  # estimated roots have no left vector
        shares = abs(forces.T @ root.right) * abs(forces.T @ left)
        largest = np.argsort(-shares)[:3]
        takes_part = shares[largest] >= PARTNER * shares[largest[0]]
        indices: list[int] = largest[takes_part].tolist()
        return indices

    def _meeting(
        self, omega: Array, forces: Array, chosen: Sequence[int], is_of_chart: bool
    ) -> Meeting:
        """The meeting of one or two real modes, and of all others of the same frequencies.

        omega (m,), forces (n, m): of all computed modes, by rising frequency; chosen: the indices
        of the one or two, rising; is_of_chart: see `Meeting`.
        """
        lowest = chosen[0]
        lower = omega[lowest]
        upper = omega[chosen[-1]]
        is_upper = abs(omega - upper) <= SAME * upper
        is_lower = abs(omega - lower) <= SAME * lower
        members = np.flatnonzero(is_lower | is_upper)
        # two modes of one frequency, or a single mode, was chosen: there is no upper one
        if is_upper[lowest]:
            is_upper = np.zeros(len(omega), dtype=bool)
        return Meeting(
            omega=omega[members],
            is_upper=is_upper[members],
            indices=tuple(self._number(forces[:, k]) for k in members.tolist()),
            cures={},
            advised={},
            is_of_chart=is_of_chart,
        )

    def _number(self, force: Array) -> int:
        """The number of the real mode with M x = `force`; a new one joins `forces`."""
        for k, other in enumerate(self.forces):
            cosine = other @ force / (np.linalg.norm(other) * np.linalg.norm(force))
            if abs(cosine) > 1.0 - PARALLEL:
                return k
        self.forces.append(force)
        return len(self.forces) - 1


def _modes_near(K: Matrix, M: Matrix, omega: float) -> tuple[Array, Array]:
    """The real modes nearest to an angular frequency: omega (k,) rising, rad/s, and shapes (n, k).

    k is `NEAR`; of few rows, and of matrices that are not sparse, all modes are returned.
    """
    n = K.shape[0]
    if n <= NEAR or not is_sparse(K):  # all n modes
        return real_modes(dense(K), dense(M), n, ratios=None)
    from scipy.sparse.linalg import ArpackError

    shift = omega**2
    try:
        factor = factorise((K - shift * M).tocsc())
        squares, shapes = modes_near(K, M, shift, NEAR, factor)
    except (ArpackError, ArithmeticError, RuntimeError) as error:
        raise ComputationError(f"real modes near {omega / math.tau:g} Hz: {error}") from None
    order = np.argsort(squares)
    return np.sqrt(np.maximum(squares[order], 0.0)), shapes[:, order]
