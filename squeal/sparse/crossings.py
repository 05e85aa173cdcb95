"""Crossings of the imaginary axis: searched on a reduced system, located on the full one.

At values of the parameter the reduced system gives roots in a region and their derivatives. Roots
at both ends of a step are matched by their slopes. A doubtful match halves the step; where two
roots are predicted to come close (`near_coalescences`), the step is divided at that value. Newton's
method on the full system then locates each crossing: with right and left vectors x, y of a mode
y^H P(i omega, p) x = 0 is a complex equation for two real unknowns, whose error is of second order
in that of the vectors. The vectors of the reduced system are corrected to those of the full one by
inverse iteration and by residuals, with a factor of P.
"""

import itertools
import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from copy import copy
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.errors import ComputationError, InputError
from squeal.linear.continuation import (
    Continuation,
    SpectrumAtParameter,
    hermite_cubic,
    zeros_between,
)
from squeal.linear.events import Event, locate_event
from squeal.linear.matrices import EPS, MCK, applied, components, inertia, norm_of, reaches
from squeal.linear.search import search
from squeal.linear.steps import meeting_at, near_coalescences
from squeal.linear.system import System
from squeal.linear.verdicts import assumed_rounding
from squeal.numerics.threads import side_by_side
from squeal.sparse.argument_principle import Rectangle
from squeal.sparse.dispersive import NEAR_INTERVALS, DispersiveReduction, frequencies
from squeal.sparse.factor import factorise_at
from squeal.sparse.quadratic import (
    Array,
    Bools,
    ComplexArray,
    Indices,
    Roots,
    ScaledSystem,
    multiply,
)
from squeal.sparse.reduced_basis import COARSE_ERROR, ReducedBasis
from squeal.sparse.reduction import Reduction

# When a match of roots of the reduced system is in doubt, and how many steps it may cost
SHORTEST_STEP = 2.0**-40  # of the range
MOST_SPECTRA = 1200  # values at which roots are computed; with so many no step is halved
# how far from where its slopes lead a root may be for its match to be right
MISSED_SHARE = 0.25  # of its path
MISSED = 1e-4  # of |lambda|, of a root that is at least twice as far off the axis
LEAST_MISSED = 1e-8  # of |lambda|, of any root: rounding
REAL_SHARE = 1e-6  # of the highest imaginary part: below, a root of real matrices is real
SAME_SHARE = 1e-7  # relative: crossings closer than this are one
NEWTON_STEPS = 20  # to a crossing, at most
STEPS_PER_FACTOR = 3  # steps of Newton's method: the later ones correct vectors by residuals
STAGNANT_STEP = 1e-9  # relative to p: after all steps, one so small is rounding
CONVERGED_STEP = 1e-12  # step relative to p and omega; its error is the square
WELL_CONDITIONED = 1e6  # up to here the roots that coincide have as many vectors


class CrossingGuess(NamedTuple):
    """Where a crossing of the imaginary axis is expected nearby."""

    value: float  # of the parameter
    omega: float  # rad/s, 0 of a real root
    right: NDArray  # vector (n,) in the scaled coordinates
    left: NDArray  # as `right`


@dataclass(frozen=True, eq=False, kw_only=True)
class AxisCrossing(Event):
    """A pair or a real root (omega 0) of the full system on the imaginary axis.

    `interval` holds the parameter's value with rounding taken into account, `residual` is the
    backward error there, `slope` is d Re lambda / dp (1/s per unit of p), `right` and
    `left` (n,) are its vectors in the scaled coordinates, of unit length.
    """

    slope: float
    right: ComplexArray = field(repr=False)
    left: ComplexArray = field(repr=False)


class _FrozenPart(NamedTuple):
    """A reduced system frozen at one of several frequencies, in a region around that frequency."""

    path_reduction: ReducedBasis | Reduction
    omega: float  # rad/s
    spacing: float  # between frozen frequencies, rad/s


def _frozen_parts(reduction: Reduction) -> Iterator[_FrozenPart]:
    """The reduced system frozen at evenly spaced frequencies of its band, in regions that overlap;
    one part for the whole band if matrices do not depend on the frequency of each root."""
    if not isinstance(reduction, DispersiveReduction):
        # roots are followed around the region too: they may enter, cross and leave within a step
        followed = copy(reduction.path_reduction)
        followed.region = reduction.region.surroundings
        yield _FrozenPart(followed, 0.0, math.inf)
        return
    region = reduction.region
    grid = frequencies(reduction.system, region)
    spacing = float(np.diff(grid).max())
    # roots start within NEAR_INTERVALS of a frozen frequency, and move by half an interval more
    reach = (NEAR_INTERVALS + 0.5) * spacing
    for omega in grid.tolist():
        around = replace(
            region,
            low_imag=max(region.low_imag, omega - reach),
            high_imag=min(region.high_imag, omega + reach),
        )
        yield _FrozenPart(reduction.frozen(omega, around), omega, spacing)


def spectrum_with_slopes(
    system: System, name: str, value: float, roots: Roots, lifted: bool = False
) -> SpectrumAtParameter:
    """The spectrum at a value of the parameter p (its `name`): the given roots z (m,), and how p
    moves them.

    With P = z^2 M + z C + K and P' = dP/dz = 2 z M + C, first-order perturbation theory gives the
    couplings (m, m) -y_i^H dP/dp(z_j) x_j / y_i^H P'(z_i) x_i: on the diagonal the slope dz/dp of
    each root, off the diagonal how p mixes the modes i and j. The spectrum has the vectors x, y
    (n, m) of the roots. If `lifted` it has those (2n, m) of the first-order form, [x, z x] and
    [(z M + C)^H y, M^H y], for which left^H right of two different roots vanishes.
    """
    changes = {name: value}
    matrices = system.at(changes)
    slopes = system.derivative(name, changes)
    roots = _with_vectors_by_slopes(roots, matrices, slopes)
    z = roots.values
    right = roots.right
    left = roots.left
    M, C, _ = matrices
    derivative = left.conj().T @ applied(slopes, z, right)
    weight = np.sum(left.conj() * inertia(matrices, z, right), axis=0)
    # a free motion without damping has the double root z = 0, where P' = C and y^H C x is zero but
    # for rounding of |C|: such a root has no slope, and gets zeros
    damping = 0.0 if C is None else norm_of(C)
    is_single = (z != 0) | (np.abs(weight) > assumed_rounding(damping))
    coupling = -derivative / np.where(is_single, weight, np.inf)[:, None]
    if lifted:
        of_velocities = M.conj().T @ left
        of_displacements = z.conj() * of_velocities
        if C is not None:
            of_displacements = of_displacements + C.conj().T @ left
        right = np.vstack([right, z * right])
        left = np.vstack([of_displacements, of_velocities])
    return SpectrumAtParameter(value, z, right, left, coupling, assumed_rounding(z))


def _with_vectors_by_slopes(roots: Roots, matrices: MCK, slopes: MCK) -> Roots:
    """The roots with vectors, unit ones, that go on with the parameter where several coincide.

    Of roots that coincide to rounding any mixture of their vectors is computed, and no slope in a
    mixture is that of a root. The parameter separates them: their slopes and mixtures are the
    eigenvalues and vectors of -(Y^H P' X)^-1 Y^H dP/dp X (degenerate perturbation theory). Vectors
    stay where roots are defective, where P' vanishes and where no slope separates them.

    Parameters
    ----------
    roots : Roots
        Values (m,) with vectors (n, m).
    matrices, slopes : tuple
        M, C and K, and their derivatives by the parameter.
    """
    z = roots.values
    is_close = np.abs(z[:, None] - z) <= 2 * assumed_rounding(z)
    if np.count_nonzero(is_close) == len(z):  # each root is close to itself alone
        return roots
    right = roots.right.astype(complex)
    left = roots.left.astype(complex)
    for group in components(reaches(is_close)):
        X = right[:, group]
        Y = left[:, group]
        weight = Y.conj().T @ inertia(matrices, z[group], X)  # Y^H P' X
        if not np.linalg.cond(weight) < WELL_CONDITIONED:
            continue
        change = Y.conj().T @ applied(slopes, z[group], X)  # Y^H dP/dp X
        _, mixtures = np.linalg.eig(np.linalg.solve(weight, change))
        if not np.linalg.cond(mixtures) < WELL_CONDITIONED:
            continue
        X = X @ mixtures
        # the left mixtures for which Y^H P' X is the identity
        Y = Y @ np.linalg.inv(weight @ mixtures).conj().T
        right[:, group] = X / np.linalg.norm(X, axis=0)
        left[:, group] = Y / np.linalg.norm(Y, axis=0)
    return Roots(z, right, left)


class _Match(NamedTuple):
    """Roots of two spectra that are taken for the same, k pairs by their indices."""

    before: Indices
    after: Indices
    misses: Array  # (k,), distance of the later root from where both slopes predict it, rad/s
    growth_misses: Array  # (k,), the part of that distance across the imaginary axis, 1/s


def _match(before: SpectrumAtParameter, after: SpectrumAtParameter) -> _Match:
    """The assignment of roots that minimises the sum of `misses` (Hungarian method)."""
    from scipy.optimize import linear_sum_assignment

    span = after.value - before.value
    predicted = span / 2 * np.add.outer(before.slopes, after.slopes)
    deviations = np.subtract.outer(after.z, before.z).T - predicted
    rows, columns = linear_sum_assignment(np.abs(deviations))
    matched = deviations[rows, columns]
    return _Match(rows, columns, np.abs(matched), np.abs(matched.real))


class CrossingSearch:
    """The search for crossings of the imaginary axis on a reduced system along one parameter.

    It stores the spectra that it has computed, by the value of the parameter `name`. Crossings by
    real roots are searched unless `bordered` is given, the full system without the zeros of free
    motions, on which these crossings are known already. Raises InputError if the region contains no
    part of the upper imaginary axis.
    """

    def __init__(
        self, reduction: ReducedBasis | Reduction, name: str, bordered: ScaledSystem | None
    ) -> None:
        self.reduction = reduction
        self.name = name
        self.bordered = bordered
        self.scaled = ScaledSystem(reduction.system)
        region = reduction.region
        if not region.low_real < 0.0 < region.high_real or region.high_imag <= 0.0:
            raise InputError(f"region {region}: must hold a part of the upper imaginary axis")
        # real matrices have conjugate pairs of roots, of which the search follows the upper ones:
        # the region is cut just below the real axis. A root with |Im| up to `imag_rounding` (rad/s)
        # counts as real
        self.imag_rounding = REAL_SHARE * region.high_imag if reduction.system.real else 0.0
        self.region = replace(region, low_imag=max(region.low_imag, -self.imag_rounding))
        self._spectra: dict[float, SpectrumAtParameter] = {}

    def at(self, value: float) -> SpectrumAtParameter:
        """The spectrum at a value of the parameter: the roots (rad/s) in the region, only the upper
        one of each conjugate pair."""
        if value not in self._spectra:
            roots = self.reduction.roots({self.name: value})
            roots = roots.select(self.region.contains(roots.values))
            if self.bordered is not None:
                zeros = np.flatnonzero(roots.values == 0.0)[: self.bordered.zeros]
                roots = roots.select(np.delete(np.arange(len(roots.values)), zeros))
            self._spectra[value] = spectrum_with_slopes(
                self.reduction.system, self.name, value, roots
            )
        return self._spectra[value]

    def between(self, low: float, high: float, shortest: float) -> Iterator[CrossingGuess]:
        """The crossings between two values of the parameter, low < high, located on the reduced
        system.

        The step from `low` to `high` is divided in two, again and again, as long as `_division`
        requires it or a root's change of sign is not explained by its crossings. A step is no
        longer divided if it is at most `shortest` long or if `MOST_SPECTRA` are computed: for each
        root that changes the sign of its growth rate on it, the end of the step at which the root
        is nearer to the axis is then given as the crossing.
        """
        before = self.at(low)
        after = self.at(high)
        match = _match(before, after)
        division = self._division(before, after, match)
        pairs = []  # without real roots if `bordered` has given their crossings already
        for i, j in zip(match.before, match.after, strict=True):
            is_real = np.abs([before.z[i].imag, after.z[j].imag]).max() <= self.imag_rounding
            if self.bordered is None or not is_real:
                pairs.append((i, j))
        crossings: list[AxisCrossing] = []
        if division is None:
            for i, j in pairs:
                of_root = self._crossings_of_root(before, after, i, j)
                inside = [crossing for crossing in of_root if low <= crossing.value <= high]
                if not _explain(inside, before.z[i], after.z[j]):
                    division = (low + high) / 2
                    break
                # with those just outside, which the next step may give too: `crossings_along` drops
                # copies
                crossings += of_root
        if division is None:
            for crossing in crossings:
                yield CrossingGuess(crossing.value, crossing.omega, crossing.right, crossing.left)
        elif high - low > shortest and len(self._spectra) < MOST_SPECTRA:
            yield from self.between(low, division, shortest)
            yield from self.between(division, high, shortest)
        else:
            for i, j in pairs:
                if not _changes_sign(before.z[i], after.z[j]):
                    continue
                if abs(before.z[i].real) < abs(after.z[j].real):
                    yield self._guess(before, i, before.value, before.z[i])
                else:
                    yield self._guess(after, j, after.value, after.z[j])

    def _division(
        self, before: SpectrumAtParameter, after: SpectrumAtParameter, match: _Match
    ) -> float | None:
        """The value of the parameter at which a step has to be divided, None if it need not be.

        - In the middle if the slopes miss a matched root, or if a root without a partner may not
          simply have left or entered the region.
        - Where a matched root comes so close to the axis between the ends that it may cross it.
        - Where two roots are predicted to meet.
        """
        span = after.value - before.value
        middle = (before.value + after.value) / 2
        start = before.z[match.before]
        path_lengths = np.abs(after.z[match.after] - start)
        # a root that is missed by less than it is off the axis at both ends crosses nothing
        off_axis = np.minimum(np.abs(start.real), np.abs(after.z[match.after].real))
        slack = np.minimum(off_axis / 2, MISSED * np.abs(start)) + LEAST_MISSED * np.abs(start)
        allowed = np.maximum(MISSED_SHARE * path_lengths, slack)
        if np.any(match.misses > allowed):
            return middle
        # paths mostly run along the axis, but what matters is across it: between the ends of a step
        # a growth rate may rise by several times what the slopes miss there, for which 16 is ample
        if np.any(match.growth_misses > off_axis / 16 + LEAST_MISSED * np.abs(start)):
            return middle
        dip = _dip_towards_axis(before, after, match)
        if dip is not None:
            return dip
        unmatched_before = np.delete(np.arange(len(before.z)), match.before)
        unmatched_after = np.delete(np.arange(len(after.z)), match.after)
        if self._exit_is_doubtful(before, unmatched_before, span):
            return middle
        # a root that entered the region on the step leaves it on the way back
        if self._exit_is_doubtful(after, unmatched_after, -span):
            return middle
        for meeting in near_coalescences(before, after):
            if not before.value < meeting.value < after.value:
                continue
            # the two roots turn within `width` of the meeting (at least 1e-9 of it, for rounding).
            # No spectrum is needed there if one lies within half a width of it already
            width = max(meeting.width, 1e-9 * abs(meeting.value))
            distance = min(abs(value - meeting.value) for value in self._spectra)
            if distance > width / 2:
                return meeting.value
        return None

    def _exit_is_doubtful(
        self, spectrum: SpectrumAtParameter, unmatched: Indices, span: float
    ) -> bool:
        """False if all `unmatched` roots, those without a partner at the other end of a step, have
        left the region there as their slopes predict: z + span dz/dp lies outside.

        True if that prediction lies in the region or beyond the real axis (the root may have met
        its conjugate), or if z + 2 span dz/dp lies beyond the imaginary axis: the root may have
        crossed it first, since its slope may double on the way.

        spectrum: of one end of the step; span: from there to the other end, negative from the later
        end back.
        """
        z = spectrum.z[unmatched]
        change = span * spectrum.slopes[unmatched]
        predicted = z + change
        stays = self.region.contains(predicted)
        # only a region with low_imag < 0 reaches the real axis, where a root meets its conjugate
        meets_conjugate = (z.imag > 0.0) & (predicted.imag < 0.0) & (self.region.low_imag < 0.0)
        may_cross = _changes_sign(z, z + 2 * change)
        return bool(np.any(stays | meets_conjugate | may_cross))

    def _crossings_of_root(
        self, before: SpectrumAtParameter, after: SpectrumAtParameter, i: int, j: int
    ) -> list[AxisCrossing]:
        """The crossings on a step of one root, number i at its start and j at its end, each once.

        The Hermite cubic through Re z and its slopes at both ends has zeros, from which Newton's
        method on the reduced system starts. Where the method does not converge, or converges far
        outside of the step, a zero gives no crossing.
        """
        span = after.value - before.value
        middle = (before.value + after.value) / 2
        start = before.z[i]
        end = after.z[j]
        cubic = hermite_cubic(
            start.real, span * before.slopes[i].real, end.real, span * after.slopes[j].real
        )
        crossings: list[AxisCrossing] = []
        for t in zeros_between(cubic):  # t from 0 to 1 on the step
            value = before.value + t * span
            root = complex(start + t * (end - start))
            with suppress(ComputationError):
                if t < 0.5:
                    guess = self._guess(before, i, value, root)
                else:
                    guess = self._guess(after, j, value, root)
                crossing = axis_crossing(self.scaled, self.name, guess)
                # up to a quarter of the span beyond either end: half + quarter from the middle
                if abs(crossing.value - middle) > 3 * span / 4:
                    continue
                if not any(_is_same(crossing, other) for other in crossings):
                    crossings.append(crossing)
        return crossings

    def _guess(
        self, spectrum: SpectrumAtParameter, k: int, value: float, root: complex
    ) -> CrossingGuess:
        """The guess that a root crosses the axis at a value of the parameter, with the vectors of
        number k of a spectrum close by."""
        omega = abs(root.imag)
        return CrossingGuess(
            value=value,
            omega=0.0 if omega <= self.imag_rounding else omega,
            right=spectrum.right[:, k] / self.scaled.scale,
            left=spectrum.left[:, k] / self.scaled.scale,
        )


def _dip_towards_axis(
    before: SpectrumAtParameter, after: SpectrumAtParameter, match: _Match
) -> float | None:
    """The value of the parameter at which a matched root may cross the axis and return in a step.

    The Hermite cubic through Re z and its slopes shows whether a root comes closer to the axis
    between the ends of the step than at both. If it comes closer by more than its least distance
    from the axis, the cubic is too rough to tell that it stays on its side: so it is with Re z = -1
    at both ends and -0.4 between them, but not with -0.6. None if no root comes so close.
    """
    span = after.value - before.value
    start = before.z[match.before]
    cubic = hermite_cubic(
        start.real,
        span * before.slopes[match.before].real,
        after.z[match.after].real,
        span * after.slopes[match.after].real,
    )
    shares = np.linspace(0.0, 1.0, 17)  # of the step: its ends, and points between them
    # from the axis, (17, roots): positive on the side where a root starts
    side = np.sign(start.real)
    distances = side * np.polynomial.polynomial.polyval(shares, cubic).T
    at_ends = np.minimum(distances[0], distances[-1])
    least = distances.min(axis=0)
    closer = at_ends - least
    rounding = LEAST_MISSED * np.abs(start)
    may_cross = (at_ends > 0.0) & (closer > rounding) & (closer > least)
    if not may_cross.any():
        return None
    root = np.flatnonzero(may_cross)[0]
    return float(before.value + shares[distances[:, root].argmin()] * span)


def _explain(crossings: Sequence[AxisCrossing], start: complex, end: complex) -> bool:
    """Whether the crossings of a root on a step explain the signs of its growth rate at both ends.

    start, end: the root at the ends. If it neither grows nor decays by more than rounding at one of
    them, any crossings do.
    """
    signs = np.sign(_growth_beyond_rounding(np.array([start, end])))
    if not signs.all():
        return True
    rise = sum(crossing.direction for crossing in crossings)
    return bool(signs[0] + 2 * rise == signs[1])  # signs are 1 or -1


def _changes_sign(before: NDArray, after: NDArray) -> Bools:
    """True where the growth rates of roots differ in sign by more than rounding."""
    return _growth_beyond_rounding(before) * _growth_beyond_rounding(after) < 0.0


def _growth_beyond_rounding(z: NDArray) -> NDArray:
    """Real parts, 0 where they are rounding."""
    return np.where(np.abs(z.real) > assumed_rounding(z), z.real, 0)


def _may_lie_in(region: Rectangle, omega: float) -> bool:
    """Whether a crossing lies in a region whose frequency is known as well as a basis gives it."""
    error = COARSE_ERROR * omega
    return region.low_imag - error <= omega <= region.high_imag + error


class _ReducedCrossing(NamedTuple):
    """A crossing of the reduced system, frozen at a frequency if it depends on it."""

    guess: CrossingGuess  # vectors in the scaled coordinates of the full system
    is_near_part: bool  # False if its omega is nearer to another of the frozen frequencies


def _crossings_of_reduced(
    reduction: Reduction, name: str, values: Sequence[float], bordered: ScaledSystem | None
) -> Iterator[_ReducedCrossing]:
    """The crossings of each frozen part of the reduced system, as `crossings_along` is called."""
    shortest = SHORTEST_STEP * (values[-1] - values[0])
    for part in _frozen_parts(reduction):
        reduced = part.path_reduction
        search_on_part = CrossingSearch(reduced, name, bordered)
        scale = search_on_part.scaled.scale
        for a, b in itertools.pairwise(values):
            for guess in search_on_part.between(a, b, shortest):
                # vectors of the guess: from the scaled coordinates of the search to those of the
                # part, then to the coordinates of the basis of the reduction, and then to the
                # scaled coordinates of the full system
                vectors = reduced.in_projection(scale * guess.right, scale * guess.left)
                right, left = multiply(reduction.vectors, np.array(vectors, dtype=complex).T).T
                is_near_part = abs(guess.omega - part.omega) <= part.spacing / 2
                yield _ReducedCrossing(guess._replace(right=right, left=left), is_near_part)


def crossings_along(
    reduction: Reduction,
    name: str,
    values: Sequence[float],
    zero_roots: Sequence[CrossingGuess] = (),
    bordered: ScaledSystem | None = None,
) -> tuple[list[AxisCrossing], list[str]]:
    """All crossings of the imaginary axis by roots in the region of a reduction, while the
    parameter goes from its first to its last value.

    Crossings of the reduced system are located on the full one. Where matrices depend on the
    frequency of each root, the crossings of systems frozen at several frequencies start the search
    for those of the full system with matrices at the root's frequency.

    Parameters
    ----------
    reduction : Reduction
        The reduced system, good at all values.
    name : str
        The parameter.
    values : sequence of float
        Its values, rising: the ends of the first steps.
    zero_roots : sequence of CrossingGuess
        All crossings by real roots, with vectors in the scaled coordinates of `bordered`.
    bordered : ScaledSystem, optional
        The full system, bordered so that it lacks the zeros of free motions, see `without_zeros`.
        Left out, crossings by real roots are searched on the reduced system.

    Returns
    -------
    crossings : list of AxisCrossing
        By rising value of the parameter.
    unconfirmed : list of str
        A sentence for each guess at which no crossing of the full system was located. There is none
        for a guess that is nearer to another frozen frequency, whose system gives it again.

    Raises
    ------
    InputError
        If the region contains no part of the upper imaginary axis.
    """
    region = reduction.region
    guesses = [_ReducedCrossing(guess, is_near_part=True) for guess in zero_roots]
    for reduced in _crossings_of_reduced(reduction, name, values, bordered):
        # with `bordered` all real roots that pass zero are among the zero_roots
        if bordered is None or reduced.guess.omega:
            guesses.append(reduced)
    full = reduction.scaled
    full_of_real_roots = bordered or full  # on which crossings by real roots are located

    def locate(reduced: _ReducedCrossing) -> AxisCrossing | ComputationError:
        guess = reduced.guess
        try:
            return axis_crossing(full if guess.omega else full_of_real_roots, name, guess)
        except ComputationError as error:
            return error

    crossings: list[AxisCrossing] = []  # each once
    unconfirmed: list[str] = []
    for reduced, crossing in zip(guesses, side_by_side(locate, guesses), strict=True):
        if isinstance(crossing, ComputationError):
            if reduced.is_near_part and _may_lie_in(region, reduced.guess.omega):
                unconfirmed.append(str(crossing))
            continue
        is_inside = region.low_imag <= crossing.omega <= region.high_imag
        if is_inside and not any(_is_same(crossing, other) for other in crossings):
            crossings.append(crossing)
    inside: list[AxisCrossing] = []
    for crossing in crossings:
        in_range = _in_range(crossing, values[0], values[-1])
        if in_range is not None:
            inside.append(in_range)
    # of crossings at one value the one whose growth rate changes fastest comes first
    inside.sort(key=lambda crossing: (crossing.value, -abs(crossing.slope)))
    return inside, unconfirmed


def coalescences(reduction: DispersiveReduction, values: Sequence[float]) -> list[Event]:
    """Where two roots meet on the imaginary axis, by rising value of the parameter.

    The reduced system is undamped, and its real matrices depend on the frequency of each root. With
    matrices frozen at omega two roots meet at a frequency omega_c(omega). If the matrices are
    those at the frequency of the two roots, these meet where omega_c(omega) = omega; the secant
    method solves that from each frozen frequency. Two roots that meet at 0 Hz are no flutter, and
    are left out. The `residual` is the worst backward error of the reduced system's roots in the
    full system, in which a coalescence is not located.

    values: of the parameter, rising; only the first and the last one count.
    """
    low = values[0]
    high = values[-1]
    meetings: list[Event] = []
    for part in _frozen_parts(reduction):
        clusters = search(part.path_reduction.system, low, high).clusters
        for event in itertools.chain(*clusters):
            # left out: meetings at 0 Hz, and those beyond the neighbouring frozen frequencies
            if not event.omega or abs(event.omega - part.omega) > part.spacing:
                continue
            meeting = _at_own_frequency(reduction.system, event, part.omega, low, high)
            if meeting and not any(_is_same_meeting(meeting, other) for other in meetings):
                meetings.append(replace(meeting, residual=reduction.worst_residual))
    return sorted(meetings, key=lambda meeting: meeting.value)


def _is_same_meeting(meeting: Event, other: Event) -> bool:
    return (
        abs(meeting.value - other.value) <= SAME_SHARE * abs(meeting.value)
        and abs(meeting.omega - other.omega) <= SAME_SHARE * meeting.omega
    )


def _at_own_frequency(
    system: System, start: Event, frozen: float, low: float, high: float
) -> Event | None:
    """The coalescence with matrices at its own frequency: the zero of the excess
    omega_c(omega) - omega, where omega_c is the frequency at which two roots meet if matrices are
    frozen at omega.

    By the secant method. None if it does not converge, or if at one of its steps no two roots meet
    at a frequency above 0. `start` is the coalescence with matrices at `frozen` (rad/s); the
    parameter runs from `low` to `high`.
    """
    event = start
    omega_before = frozen
    excess_before = event.omega - frozen
    omega = event.omega  # where the matrices are frozen next
    for _ in range(NEWTON_STEPS):
        continuation = Continuation(system.frozen(omega), low, high)
        spectrum = continuation.at(event.value)  # its roots are omega^2, of the undamped system
        pair = np.argsort(np.abs(spectrum.z - event.omega**2))[:2]
        guess = meeting_at(spectrum, pair, width=high - low)
        meeting = locate_event(continuation, guess)
        if meeting is None or not meeting.omega:
            return None
        event = meeting
        excess = event.omega - omega
        if abs(excess) <= CONVERGED_STEP * omega:
            return event
        # to the zero of the line through the last two excesses
        step = excess * (omega - omega_before) / (excess_before - excess)
        omega_before = omega
        excess_before = excess
        omega = omega + step
    return None


def _in_range(crossing: AxisCrossing, low: float, high: float) -> AxisCrossing | None:
    """The crossing if it lies in the range of the parameter from `low` to `high`, otherwise None.

    If its interval, which holds rounding, contains an end of the range, the crossing is placed at
    that end, and its interval ends there. But a root whose growth ends at `low` grows nowhere in
    the range: None.
    """
    first, last = crossing.interval
    if first <= low <= last:
        if crossing.direction < 0:
            return None
        return replace(crossing, value=low, interval=(low, last))
    if first <= high <= last:
        return replace(crossing, value=high, interval=(first, high))
    if low <= crossing.value <= high:
        return crossing
    return None


def _is_same(crossing: AxisCrossing, other: AxisCrossing) -> bool:
    """Whether two crossings agree in parameter, direction, frequency and mode."""
    distance = SAME_SHARE * max(abs(crossing.value), abs(other.value))
    distance += crossing.width + other.width
    return bool(
        crossing.direction == other.direction
        and abs(crossing.value - other.value) <= distance
        and abs(crossing.omega - other.omega) <= SAME_SHARE * max(crossing.omega, other.omega)
        and abs(np.vdot(crossing.right, other.right)) > 0.5
    )


def axis_crossing(scaled: ScaledSystem, name: str, guess: CrossingGuess) -> AxisCrossing:
    """The crossing of the imaginary axis next to a guess, along the parameter p called `name`.

    There P = P(i omega, p) is singular, P x = 0 and y^H P = 0. Newton's method for p and omega with
    y^H P x = 0 alternates with inverse iteration for the unit vectors: x = P^-1 y and y = P^-H x
    lead to the singular vectors of the smallest singular value of P, which becomes zero. A factor
    of P serves `STEPS_PER_FACTOR` steps; in the later ones it corrects x by the residual P x and y
    by P^H y (residual inverse iteration, Neumaier 1985).

    Raises ComputationError if it does not converge: no crossing is near, or two coincide.
    """
    value = guess.value
    omega = guess.omega
    x = guess.right / np.linalg.norm(guess.right)
    y = guess.left / np.linalg.norm(guess.left)
    for k in range(NEWTON_STEPS):
        try:
            problem = scaled.at({name: value, **scaled.system.frequency(omega)})
        except InputError:
            break  # a step led beyond a table of the parameter, or to a pole
        # P^-H b is computed as the conjugate of P^-T conj(b)
        if k % STEPS_PER_FACTOR == 0:
            _, factor = factorise_at(problem, complex(0.0, omega))
            right = factor.solve(y)
            left = factor.solve(x.conj(), transposed=True).conj()
        else:  # with the factor of an earlier step
            P = problem.at(complex(0.0, omega))
            right = x - factor.solve(P @ x)
            left = y - factor.solve(P.T @ y.conj(), transposed=True).conj()
        x = _unit(right, x)
        y = _unit(left, y)
        step = _newton_step(scaled, name, CrossingGuess(value, omega, x, y))
        if step is None:
            break
        crossing = step.crossing
        if step.is_converged:
            return crossing
        change = abs(crossing.value - value)
        value = crossing.value
        omega = crossing.omega
    else:  # after the last step: none has converged, and none has failed
        # terms that cancel round more than their sum: such steps do not shrink any further. Their
        # size, with a margin of 16, is added to the interval
        if change <= STAGNANT_STEP * abs(value):
            low, high = crossing.interval
            return replace(crossing, interval=(low - 16 * change, high + 16 * change))
    raise ComputationError(
        f"no crossing of the imaginary axis was found near {name} = {guess.value:.9g} at "
        f"{guess.omega / math.tau:.6g} Hz"
    )


def _unit(corrected: ComplexArray, vector: ComplexArray) -> ComplexArray:
    """A corrected vector (n,) with unit length; the `vector` itself where the correction leaves
    nothing, as of an exact vector that the factor and P share."""
    length = np.linalg.norm(corrected)
    return corrected / length if 0.0 < length < np.inf else vector


class _Linearised(NamedTuple):
    """y^H P(z, omega, p) x at z = i omega, with unit vectors x, y, and its derivatives."""

    product: complex  # y^H P x
    by_root: complex  # by z, the matrices unchanged
    by_frequency: complex  # by the frequency omega that the matrices depend on; 0 if on none
    by_parameter: complex  # by p
    size: float  # a bound of |P|
    residual: float  # |P x| / size

    @property
    def growth_slope(self) -> float:
        """d Re z/dp of a root z.

        by_root dz + by_parameter dp + by_frequency domega = 0 with domega = Im dz: the parameter
        moves the root, and the root's frequency the matrices, which move the root again.
        """
        direct = -self.by_parameter / self.by_root
        by_own_frequency = -self.by_frequency / self.by_root
        frequency_slope = direct.imag / (1.0 - by_own_frequency.imag)  # domega/dp
        return float((direct + by_own_frequency * frequency_slope).real)


def _linearised(scaled: ScaledSystem, name: str, guess: CrossingGuess) -> _Linearised:
    """y^H P x and its derivatives at a guess with unit vectors x, y; `name` is that of p."""
    system = scaled.system
    x = guess.right
    y = guess.left.conj()  # so that y @ is the product with y^H
    root = complex(0.0, guess.omega)
    parameters = {name: guess.value, **system.frequency(guess.omega)}
    problem = scaled.at(parameters)
    # the parameters that hold the frequency are proportional to omega, so that their values at
    # 1 rad/s are their derivatives by omega
    by_frequency = 0j
    for frequency_name, d_by_omega in system.frequency(1.0).items():
        derivative = scaled.slope(frequency_name, parameters, root)
        by_frequency = by_frequency + d_by_omega * (y @ (derivative @ x))
    image = problem.apply(np.array([root]), x[:, None])[:, 0]
    size = float(problem.size(np.array(root)))
    return _Linearised(
        product=complex(y @ image),
        by_root=y @ (problem.slope(root) @ x),
        by_frequency=by_frequency,
        by_parameter=y @ (scaled.slope(name, parameters, root) @ x),
        size=size,
        residual=float(np.linalg.norm(image) / size),
    )


class _NewtonStep(NamedTuple):
    """Where a step of Newton's method ends."""

    crossing: AxisCrossing
    is_converged: bool  # True if the steps of p and of omega are rounding


def _newton_step(scaled: ScaledSystem, name: str, guess: CrossingGuess) -> _NewtonStep | None:
    """One step of Newton's method for p and omega from a guess with unit vectors x, y (n,).

    p is the parameter `name`, omega is in rad/s.

    The complex equation (i by_root + by_frequency) domega + by_parameter dp = -y^H P x, see
    `_Linearised`, has two real unknowns. Its real and imaginary part are the two rows of the
    Jacobian (2, 2). The crossing has the value, omega and interval after the step, but the
    residual, slope and vectors of the guess. None where the Jacobian is singular.
    """
    system = scaled.system
    p = guess.value
    at_guess = _linearised(scaled, name, guess)
    product = at_guess.product
    columns = [1j * at_guess.by_root + at_guess.by_frequency, at_guess.by_parameter]
    if guess.omega == 0.0:
        # a real root stays real, and so does y^H P x: the rows become domega = 0 and
        # Re(by_parameter) dp = -Re(y^H P x)
        columns = [1.0, 1j * at_guess.by_parameter.real]
        product = complex(0.0, product.real)
    jacobian = np.array([np.real(columns), np.imag(columns)])
    sizes = np.abs(jacobian).max(axis=0)  # of the columns, whose units differ
    # above a condition of 1e12 a step has less than four true digits; NaN counts as above
    if not (sizes.all() and np.linalg.cond(jacobian / sizes) <= 1e12):
        return None
    with np.errstate(over="ignore", invalid="ignore"):
        inverse = np.linalg.inv(jacobian / sizes) / sizes[:, None]
        omega_step, step = (-inverse @ [product.real, product.imag]).tolist()
    if not math.isfinite(step) or not math.isfinite(omega_step):
        return None  # the parameter hardly moves the root: the inverse overflows
    # how far rounding of P x, in both equations, may move the two unknowns
    errors = 2 * EPS * at_guess.size * np.abs(inverse).sum(axis=1)
    omega_error, p_error = errors.tolist()
    new_p = p + step
    new_omega = guess.omega + omega_step
    # steps are relative to p (to at least 1 where it was 0), and to omega (to at least 1 rad/s)
    p_limit = max(p_error, CONVERGED_STEP * max(abs(new_p), abs(p) or 1.0))
    omega_limit = max(omega_error, CONVERGED_STEP * max(abs(new_omega), 1.0))
    is_converged = abs(step) <= p_limit and abs(omega_step) <= omega_limit
    if system.follows:  # matrices depend on the frequency by tables, which end
        least, most = system.covered  # Hz
        new_omega = min(max(new_omega, math.tau * least), math.tau * most)
    slope = at_guess.growth_slope
    half_width = p_error + abs(step) + 2 * EPS * abs(new_p)
    crossing = AxisCrossing(
        value=new_p,
        omega=abs(new_omega),  # a step beyond zero ends at the conjugate root
        direction=1 if slope > 0 else -1,
        interval=(new_p - half_width, new_p + half_width),
        residual=at_guess.residual,
        slope=slope,
        right=guess.right,
        left=guess.left,
    )
    return _NewtonStep(crossing, is_converged)
