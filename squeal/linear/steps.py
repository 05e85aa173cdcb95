"""From one value of the parameter to the next: which roots are the same, and where two may meet.

Roots at both ends of a step are matched by their slopes, which predict the change in between. Two
that coalesce within the step are matched as a pair, by mean and squared half difference. Where a
match is in doubt the step is divided.

Two roots that come close within a step are predicted from their coupling. In the eigenvectors of
A(p) the matrix at p + x is diag(z) + x W, exactly if its factors are affine, so that roots k, l
follow diag(z_k, z_l) + x [[W_kk, a], [b, W_ll]], in which all others shift the coupling to
a = W_kl + x T_kl, b = W_lk + x T_lk with
T_kl = sum_m W_km W_ml (1 / (z_k - z_m) + 1 / (z_l - z_m)) / 2.

The line is where roots z neither grow nor decay: the real axis without damping, else the imaginary
axis, see `squeal.linear.continuation`.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.linear.continuation import DAMPED, Bools, SpectrumAtParameter, hermite_cubic
from squeal.linear.matrices import Array
from squeal.linear.roots import ComplexArray, assigned

DOUBT = 0.25
"""A root is matched if the slopes at both ends of a step predict its change to this share; a
smaller one finds thresholds that are missed."""
ROOT_TOLERANCE = 1e-3
"""Of |z|: how much the slopes may miss in any case. Frequencies that differ by no more than this
share may be of one root."""
MODE_OVERLAP = 0.8
"""The product of vectors in `Step.same_mode` beyond which two roots are one mode."""
MODE_OVERLAP_WITH_SLOPES = 0.5
"""The same if their slopes agree too."""


@dataclass(frozen=True, eq=False)
class EventGuess:
    """Where one root may cross the line between growth and decay, or two may meet on it.

    Attributes
    ----------
    value : float
        The parameter there.
    z : complex
        The eigenvalue z there, of two their mean.
    right, left : array (N, 1) or (N, 2)
        Approximate right and left eigenvectors of the one root, or of the two, as columns.
    coalesces : bool
        True if two roots are expected to meet on the line, False if one crosses it.
    width : float
        How far from `value` the event may lie. Of a meeting of two, before it is examined, half of
        the length within which the two stay close.
    """

    value: float
    z: complex
    right: ComplexArray
    left: ComplexArray
    coalesces: bool
    width: float


def meeting_at(spectrum: SpectrumAtParameter, pair: NDArray[np.intp], width: float) -> EventGuess:
    """The guess that two roots, given by their indices, meet at the value of a spectrum."""
    return EventGuess(
        value=spectrum.value,
        z=complex(spectrum.z[pair].mean()),
        right=spectrum.right[:, pair],
        left=spectrum.left[:, pair],
        coalesces=True,
        width=width,
    )


def near_coalescences(
    before: SpectrumAtParameter, after: SpectrumAtParameter
) -> Iterator[EventGuess]:
    """Pairs that may meet on the line within a step, or cross it as they come close.

    They are predicted from both ends, so that one pair may come twice.
    """
    span = after.value - before.value
    yield from _meetings_seen_from(before, span, side=1)
    yield from _meetings_seen_from(after, span, side=-1)


def is_crowded(step: Step) -> bool:
    """True if a root interacts with two others within a step, as one of its ends predicts.

    A pair that meets may then change its partner, so that neither what two roots do nor the counts
    at both ends tell how often growth begins and ends.
    """
    length = step.after.value - step.before.value
    return _is_crowded(step.before, length) or _is_crowded(step.after, -length)


def _is_crowded(spectrum: SpectrumAtParameter, length: float) -> bool:
    """As `is_crowded`, from the spectrum at one end of a step.

    length: how far the other end is, below 0 from the later end.

    At a distance x into the step two roots differ by u + x v without coupling: u is their
    difference at this end, v that of their slopes. Coupling adds x^2 W_kl W_lk to the square of
    half their difference, see the head of the module. They interact if
    |u + x v| <= 2 x sqrt|W_kl W_lk| somewhere in the step, that is |u y + v| <= 2 sqrt|W_kl W_lk|
    for some y = 1 / x >= 1 / |length|. Roots that rounding does not separate do not count.
    """
    u = spectrum.z[:, None] - spectrum.z
    v = spectrum.slopes[:, None] - spectrum.slopes
    if length < 0.0:
        v = -v
    coupling = np.sqrt(np.abs(spectrum.coupling * spectrum.coupling.T))
    with np.errstate(all="ignore"):  # u = 0: of a root and itself, or of two that are equal
        y = np.nan_to_num(-(v * u.conj()).real / np.abs(u) ** 2)  # where |u y + v| is least
    y = np.maximum(y, 1 / abs(length))
    interact = (np.abs(u * y + v) <= 2 * coupling) & ~spectrum.close
    return bool(np.any(interact.sum(axis=1) > 1))  # some root with two others


class _Approaches(NamedTuple):
    """Pairs of roots that come close within a step, as one end of the step predicts it.

    At a distance x from that end the two are eigenvalues of the 2 x 2 matrix of the module's head,
    so that the square of half their difference is d(x) = (u + x v)^2 / 4 + x^2 a b. They coalesce
    where d vanishes.

    Attributes
    ----------
    k, l : array of int (pairs,)
        Indices of the two roots.
    conjugate : array of bool (pairs,)
        Whether the two are conjugate to each other.
    u, v : array (pairs,)
        Difference of the two roots at the end of the step, and its mean slope up to where they
        would cross without coupling.
    mean, mean_slope : array (pairs,)
        Mean of the two roots at the end of the step, and its slope into the step.
    a, b : array (pairs,)
        Their couplings, those by other roots included.
    zeros : array (2, pairs)
        Distances at which d vanishes, real parts.
    inside : array of bool (3, pairs)
        Whether each of these two, and their middle, lies in the step.
    """

    k: NDArray[np.intp]
    l: NDArray[np.intp]
    conjugate: Bools
    u: ComplexArray
    v: ComplexArray
    mean: ComplexArray
    mean_slope: ComplexArray
    a: ComplexArray
    b: ComplexArray
    zeros: Array
    inside: Bools

    def select(self, chosen: Bools) -> _Approaches:
        """Some of the pairs, by a mask (pairs,)."""
        return _Approaches._make(values[..., chosen] for values in self)

    @property
    def half_width(self) -> Array:
        """Half the distance (pairs,) between the two values at which the roots coalesce."""
        return np.abs(self.zeros[0] - self.zeros[1]) / 2

    def meeting_distance(self, span: float) -> Array:
        """The distance (pairs,) at which each pair is predicted to meet, in a step of length span.

        It is the middle of the two zeros of d or, where that lies outside of the step, the one of
        them inside.
        """
        zero_inside = np.where(self.inside[0], self.zeros[0], self.zeros[1])
        middle = self.zeros.mean(axis=0)
        return np.clip(np.where(self.inside[2], middle, zero_inside), 0.0, span)


def _approaches(spectrum: SpectrumAtParameter, span: float, side: int) -> _Approaches:
    """Where in a step the pairs of `spectrum.couplings` come close, as one of its ends predicts it.

    Parameters
    ----------
    spectrum : SpectrumAtParameter
        The end of the step.
    span : float
        Length of the step.
    side : int
        1 if the step lies above this end, -1 if it lies below.
    """
    pairs = spectrum.couplings
    slopes = side * spectrum.slopes
    u = spectrum.z[pairs.k] - spectrum.z[pairs.l]
    v = slopes[pairs.k] - slopes[pairs.l]
    # the distance from this end at which they would cross without coupling, moved into the step if
    # it lies outside
    crossing_distance = np.clip(np.nan_to_num((-u / v).real), 0.0, span)
    v += crossing_distance * pairs.bend  # the mean slope up to the crossing
    # couplings are derivatives by the parameter, against which the distance from this end may run:
    # W changes its sign with the side, and T and the bend, which are products of two W, do not
    a, b = side * pairs.direct + crossing_distance * pairs.indirect
    # d(x) = (u + x v)^2 / 4 + x^2 a b, the square of half their difference at the distance x,
    # vanishes where u + x v = +- x split
    split = 2 * np.sqrt(-a * b)
    zeros = np.stack([-u / (v - split), -u / (v + split)]).real
    zeros = np.where(np.isfinite(zeros), zeros, 1e9 * span)  # far outside of the step
    zeros_and_middle = np.stack([*zeros, zeros.mean(axis=0)])
    return _Approaches(
        k=pairs.k,
        l=pairs.l,
        conjugate=pairs.conjugate,
        u=u,
        v=v,
        mean=(spectrum.z[pairs.k] + spectrum.z[pairs.l]) / 2,
        mean_slope=(slopes[pairs.k] + slopes[pairs.l]) / 2,
        a=a,
        b=b,
        zeros=zeros,
        inside=np.abs(zeros_and_middle - span / 2) <= span / 2,
    )


def _meetings_seen_from(
    spectrum: SpectrumAtParameter, span: float, side: int
) -> Iterator[EventGuess]:
    """Pairs of roots that may meet on the line, or with damping cross it, within a step.

    Parameters
    ----------
    spectrum : SpectrumAtParameter
        One end of the step.
    span : float
        Length of the step.
    side : int
        1 if the step lies above this end, -1 if it lies below.
    """
    with np.errstate(all="ignore"):
        every_pair = _approaches(spectrum, span, side)
        near = np.asarray(every_pair.inside.any(axis=0))
        if not near.any():
            return
        pairs = every_pair.select(near)
        meets = _may_meet(spectrum, pairs, span)
        distance = pairs.meeting_distance(span)
        half_width = pairs.half_width
    for n in np.flatnonzero(meets).tolist():
        both = [pairs.k[n], pairs.l[n]]
        yield EventGuess(
            value=spectrum.value + side * float(distance[n]),
            z=complex(pairs.mean[n] + distance[n] * pairs.mean_slope[n]),
            right=spectrum.right[:, both],
            left=spectrum.left[:, both],
            coalesces=True,
            width=float(half_width[n]),
        )


def _may_meet(spectrum: SpectrumAtParameter, pairs: _Approaches, span: float) -> Bools:
    """Which pairs (pairs,) may meet on the line, or with damping cross it, within a step.

    The square d of half the difference is sampled at the ends of the step and around the closest
    approach. With damping the real parts of both roots are sampled, too: two modes of unequal
    damping may grow at some distance from the closest approach. A sampled quantity may vanish where
    its sign changes, up to its error.

    spectrum: one end of the step; span: its length. Samples are arrays (samples, pairs).
    """
    k = pairs.k
    l = pairs.l
    product = pairs.a * pairs.b
    size = np.abs(product)
    # how long two that do not coalesce stay close: at this distance from x = -u / v the first part
    # of d is a quarter of what the second one is there. Infinite, and cut to the step, where their
    # difference does not change
    width = np.fmin(np.abs(pairs.u * np.sqrt(product) / pairs.v**2), span)
    width += 1e-6 * span  # not zero where d has a double zero
    offsets = 10.0 ** np.linspace(-1.0, 0.9, 12)  # 0.1 to 8 half widths of a close approach
    offsets = np.concatenate([-offsets, [0.0], offsets])[:, None]
    centre = pairs.zeros.mean(axis=0)
    x = np.clip(centre + offsets * np.maximum(pairs.half_width, width), 0.0, span)
    ends = np.broadcast_to([[0.0], [span]], (2, len(k)))
    x = np.concatenate([x, ends])
    d = (pairs.u + x * pairs.v) ** 2 / 4 + x**2 * product
    error = x**2 * 0.1 * size  # a tenth of the coupling may be wrong
    meets = _passes_zero(d.real, error)
    if spectrum.problem is DAMPED:
        slack = np.minimum(np.sqrt(error), error / np.sqrt(np.abs(d)))  # the error of sqrt(d)
        slack += spectrum.rounding[k] + spectrum.rounding[l]
        mean = (pairs.mean + x * pairs.mean_slope).real
        half_difference = np.sqrt(d).real
        reaches_axis = _passes_zero(mean + half_difference, slack)
        reaches_axis |= _passes_zero(mean - half_difference, slack)
        # conjugates have one real part until they meet; up to there each crosses as a single root
        meets = (meets | ~pairs.conjugate) & reaches_axis
    # d gains x^2 a b by the coupling, and rounding moves d by the product of both roundings: a
    # coupling within that, as of two subsystems that meet by chance, moves no roots apart
    rounding = spectrum.rounding[k] * spectrum.rounding[l]
    couples_beyond_rounding = span**2 * size > rounding
    return meets & couples_beyond_rounding


def _passes_zero(values: Array, slack: Array) -> Bools:
    """Which columns of values (k, m) have values on both sides of zero, each up to its slack."""
    return ((values - slack).min(axis=0) < 0) & ((values + slack).max(axis=0) > 0)


def closest_pairs(
    roots: Sequence[int], before: ComplexArray, after: ComplexArray
) -> list[list[int]]:
    """All pairs of some roots, as lists [k, l], the pair that is closest at an end of a step first.

    roots: indices; before, after: the values (m,) of all roots at both ends, in the same order.
    """

    def distance(pair: tuple[int, int]) -> float:
        k, l = pair
        return min(abs(before[k] - before[l]), abs(after[k] - after[l]))

    return [list(pair) for pair in sorted(itertools.combinations(roots, 2), key=distance)]


def squared_ends(ends: Sequence[ComplexArray] | ComplexArray) -> ComplexArray:
    """The value and slope before a step, and both after it (4, ...), of the square of a quantity.

    ends: the same of the quantity itself.
    """
    value, slope, later_value, later_slope = ends
    return np.array([value**2, 2 * value * slope, later_value**2, 2 * later_value * later_slope])


class StepEnds(NamedTuple):
    """Roots (m,) before a step, their slopes times its length, and the same after it."""

    z: ComplexArray
    dz: ComplexArray
    later_z: ComplexArray
    later_dz: ComplexArray


class RootPair(NamedTuple):
    """Two roots by their indices at the beginning of a step, and cubics (4,) over it of their mean
    and of the squared half difference."""

    indices: list[int]
    mean: ComplexArray
    square: ComplexArray


class Step:
    """From one value of the parameter to the next: which root of the one is which of the other.

    Roots are numbered by their indices k before the step, m in all.

    Attributes
    ----------
    before, after : SpectrumAtParameter
        The two ends.
    mismatch : array (m, m')
        How badly each root after the step continues each one before it.
    order : array of int (m,)
        The index after the step of each root before it; -1 of one that is left over where there are
        fewer after it, which is never matched.
    ends : StepEnds
        The roots and their slopes at both ends, in this order.
    deviation : array (m,)
        How far each root after the step is from where the mean of its slopes at both ends leads.
    rounding : array (m,)
        The greater of how far rounding moves each root at both ends.
    rests_at_zero : array of bool (m,)
        Which roots are zero at both ends, as far as rounding tells.
    matched : array of bool (m,)
        Whether the deviation is small enough for the match to be believed.
    real_cubic : array (4, m)
        Coefficients, by rising powers of the share t of the step, of cubics through the real parts
        and slopes at both ends.
    lowest_real, highest_real : array (m,)
        Extremes of these cubics within the step.
    """

    def __init__(self, before: SpectrumAtParameter, after: SpectrumAtParameter) -> None:
        """Match the roots at both ends, and follow each real part by a cubic in between.

        A root is matched by the mean of its slopes (derivatives by the parameter) at both ends.
        """
        self.before = before
        self.after = after
        length = after.value - before.value
        slope_sums = before.slopes[:, None] + after.slopes
        slope_changes = before.slopes[:, None] - after.slopes
        mismatch = np.abs(after.z - before.z[:, None] - length / 2 * slope_sums)  # (m, m')
        # roots that cross in the middle of the step have the same mismatch as if they turned back
        # there: a hundredth of the change of slope decides for the crossing
        self.mismatch = mismatch + 0.01 * np.abs(length * slope_changes)
        self.order = assigned(self.mismatch)
        # the index -1 of a root that is left over takes the numbers of the last root after the
        # step: they mean nothing, and `matched` excludes the root below
        self.rounding = np.maximum(before.rounding, after.rounding[self.order])
        z = before.z
        later_z = after.z[self.order]
        self.rests_at_zero = np.maximum(np.abs(z), np.abs(later_z)) <= self.rounding
        lengths = np.where(self.rests_at_zero, 0.0, length)  # slopes of zeros are rounding
        # slopes by the share of the step, 0 to 1
        dz = lengths * before.slopes
        later_dz = lengths * after.slopes[self.order]
        self.ends = StepEnds(z, dz, later_z, later_dz)
        self.deviation = later_z - z - (dz + later_dz) / 2
        allowed = np.maximum(DOUBT * np.abs(later_z - z), ROOT_TOLERANCE * np.abs(z))
        self.matched = np.abs(self.deviation) <= allowed + 4 * self.rounding
        self.matched &= self.order >= 0
        self.real_cubic = hermite_cubic(z.real, dz.real, later_z.real, later_dz.real)
        c = self.real_cubic
        t = np.linspace(0.0, 1.0, 17)[:, None]  # extremes are taken from 17 values of each cubic
        values = c[0] + t * (c[1] + t * (c[2] + t * c[3]))
        self.lowest_real = values.min(axis=0)
        self.highest_real = values.max(axis=0)

    @cached_property
    def same_mode(self) -> Bools:
        """Which roots (m, m') before and after the step are one mode, by vectors and slopes.

        With x, y the right and left vectors before the step and x', y' those after it,
        |y^H x'| |y'^H x| / (|y^H x| |y'^H x'|) is near 1 of one mode and near 0 of any other.
        """
        before = self.before
        after = self.after

        def products(left_of: SpectrumAtParameter, right_of: SpectrumAtParameter) -> Array:
            """|y^H x| of the left vectors of one end with the right vectors of another."""
            return np.abs(left_of.left.conj().T @ right_of.right)

        with np.errstate(all="ignore"):
            norms = np.multiply.outer(
                products(before, before).diagonal(), products(after, after).diagonal()
            )
            overlap = products(before, after) * products(after, before).T / norms
        allowed = DOUBT * np.abs(after.z - before.z[:, None])
        allowed = np.maximum(allowed, ROOT_TOLERANCE * np.abs(before.z)[:, None])
        same = overlap > MODE_OVERLAP
        same |= (overlap > MODE_OVERLAP_WITH_SLOPES) & (self.mismatch <= allowed)
        only_one_before = same.sum(axis=0) == 1
        only_one_after = same.sum(axis=1) == 1
        return same & only_one_before & only_one_after[:, None]

    def vectors(self, t: float, roots: Sequence[int]) -> tuple[ComplexArray, ComplexArray]:
        """Right and left vectors (N, number of roots) of some roots at one end of the step.

        It is the end that is nearer to the share t of the step; `roots` are indices before it.
        """
        if t < 0.5:
            indices = list(roots)
            return self.before.right[:, indices], self.before.left[:, indices]
        indices = self.order[list(roots)].tolist()
        return self.after.right[:, indices], self.after.left[:, indices]

    def pairs(self, roots: Sequence[int]) -> Iterator[RootPair]:
        """Disjoint pairs of these roots whose mean and squared half difference follow cubics.

        Where two roots coalesce, their mean and squared half difference stay smooth, and the roots
        themselves do not. The closest roots are paired first; `roots` are indices before the step.
        """
        remaining = set(roots)
        for pair in closest_pairs(roots, self.ends.z, self.ends.later_z):
            if not remaining.issuperset(pair):
                continue
            ends = np.array([values[pair] for values in self.ends])  # (4, 2): see `StepEnds`
            mean = ends.mean(axis=1)
            square = squared_ends((ends[:, 0] - ends[:, 1]) / 2)
            largest = max(abs(square[0]), abs(square[2]))  # before and after the step
            if self._is_cubic(mean, abs(mean[0])) and self._is_cubic(square, largest):
                remaining -= set(pair)
                yield RootPair(pair, hermite_cubic(*mean), hermite_cubic(*square))

    def _is_cubic(self, ends: ComplexArray, size: float) -> bool:
        """True if the slopes at both ends predict how a quantity changes over the step.

        ends: its value before the step, its slope there times the length of the step, and both
        after it; size: of the quantity, of which changes below `ROOT_TOLERANCE` are taken for that.
        """
        before, before_slope, after, after_slope = ends
        allowed = DOUBT * max(abs(after - before), ROOT_TOLERANCE * size)
        deviation = after - before - (before_slope + after_slope) / 2
        return bool(abs(deviation) <= allowed)
