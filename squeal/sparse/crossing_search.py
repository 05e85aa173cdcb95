"""Crossings of the imaginary axis by roots of a reduced system along a parameter.

Spectra at both ends of a step of the parameter give the roots in a region and their slopes. The
roots are matched: the assignment is the one whose roots end nearest to where their slopes lead
(Hungarian method). The Hermite cubic through the growth rates and slopes at both ends of a matched
root then shows where that rate vanishes, and Newton's method locates the crossing there.

A crossing may be missed if roots are matched wrongly, if a root comes and goes within a step, or if
two roots meet and change their slopes at once. Each of these is tested, with wide margins
(`CrossingSearch._division`), and a step with a doubt is divided. It is divided too if the crossings
do not explain the signs of the growth rates at both ends. Where no more steps are allowed the
nearest end of the step is given as a guess, so that the full system decides.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.errors import ComputationError, InputError
from squeal.linear.continuation import SpectrumAtParameter, hermite_cubic, zeros_between
from squeal.linear.steps import near_coalescences
from squeal.linear.verdicts import assumed_rounding
from squeal.sparse.axis_crossing import AxisCrossing, CrossingGuess, axis_crossing, is_same_crossing
from squeal.sparse.quadratic import Array, Bools, Indices, ScaledSystem
from squeal.sparse.reduced_basis import ReducedBasis
from squeal.sparse.reduction import Reduction
from squeal.sparse.root_slopes import spectrum_with_slopes

# When a match of roots of the reduced system is in doubt, and how many steps it may cost
SHORTEST_STEP = 2.0**-40  # of the range
MOST_SPECTRA = 1200  # values at which roots are computed; with so many no step is halved
CHEAP_ROWS = 60  # of the reduced system, up to which so many are computed
FEWEST_SPECTRA = 100  # that are computed of any number of rows: known searches take up to 90
# how far from where its slopes lead a root may be for its match to be right
MISSED_SHARE = 0.25  # of its path
MISSED = 1e-4  # of |lambda|, of a root that is at least twice as far off the axis
LEAST_MISSED = 1e-8  # of |lambda|, of any root: rounding
REAL_SHARE = 1e-6  # of the highest imaginary part: below, a root of real matrices is real


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
        # modes that nothing damps lie on the axis to rounding: where two of them meet a search
        # would divide its steps without end, for minutes if each spectrum takes half a second
        share = (CHEAP_ROWS / reduction.system.n) ** 2
        self._most_spectra = max(FEWEST_SPECTRA, min(1.0, share) * MOST_SPECTRA)

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
        longer divided if it is at most `shortest` long or if many spectra are computed: for each
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
        elif high - low > shortest and len(self._spectra) < self._most_spectra:
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
                if not any(is_same_crossing(crossing, other) for other in crossings):
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
