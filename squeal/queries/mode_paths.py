"""The modes of a sweep as paths: which grow, and which other mode each one meets."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from squeal.linear.continuation import Bools
from squeal.linear.matrices import Array, divisor
from squeal.linear.paths import Loss, mode_numbers
from squeal.linear.roots import ComplexArray, assigned
from squeal.results.eigenvalues import Eigenvalues
from squeal.results.sources import PadSource, unit_of
from squeal.results.sweep import Step, Sweep

GROWS = 1e-9  # of |lambda|: a growth rate below is rounding
NEAREST = 0.1  # of the frequency of a mode where it grows: no partner is farther away
NEARER = 0.5  # of their first distance: two frequencies nearer than that come together
TWINS = 0.05  # of the frequency: so near are the two whirls of a shaft on unlike bearings
FED = 0.25  # of the rise of a mode's growth rate: by so much at least that of its partner falls
NEAR = 0.01  # of |lambda|: no root of a sweep is farther from that of the full system


class Paths:
    """The modes of a sweep, by their numbers.

    Attributes
    ----------
    values : array (n,)
        The rising values of the parameter.
    by_value : dict of float to dict of int to complex
        By value and mode the root (rad/s), also of modes that do not vibrate.
    path_of : dict of int to array (n,)
        By mode that vibrates (Im > 0) its root at each value, NaN where that is not known.
    at, roots : dict of int to array (m,)
        By mode that vibrates the values at which its root is known, and its roots there.
    own_value : float or None
        The subject's own value of the parameter, None if the sweep does not reach it.
    growing : list of int
        Modes that grow somewhere, the fastest at the own value first.
    groups : list of tuple of int
        Each growing mode once: alone, or with the mode that it meets, by rising first frequency.
    """

    def __init__(self, sweep: Sweep) -> None:
        self.values = values = np.array([step.value for step in sweep.steps])
        path_of: dict[int, ComplexArray] = {}
        roots_of_steps: list[dict[int, complex]] = []  # of each step by the mode numbers there
        for k, step in enumerate(sweep.steps):
            roots = {mode: root.value for mode, root in step.root_of_mode().items()}
            roots_of_steps.append(roots)
            for mode, root in roots.items():
                if root.imag > 0.0:
                    path = path_of.setdefault(mode, np.full(len(values), np.nan, dtype=complex))
                    path[k] = root
        # a mode that ended and went on under another number has the lower number from here on
        lower = _join(path_of, sweep.losses)
        self.by_value: dict[float, dict[int, complex]] = {}
        for value, roots in zip(values.tolist(), roots_of_steps, strict=True):
            self.by_value[value] = {lower.get(mode, mode): root for mode, root in roots.items()}
        self.path_of = path_of
        self.at = {mode: values[np.isfinite(path)] for mode, path in path_of.items()}
        self.roots = {mode: _known_roots(path) for mode, path in path_of.items()}
        self.own_value = _own_value(sweep)
        growing = [mode for mode, roots in self.roots.items() if is_growing(roots).any()]
        self.growing = sorted(growing, key=self._rank, reverse=True)
        self.groups: list[tuple[int, ...]] = []
        is_speed = bool(unit_of(sweep.source))  # a speed alone has a unit, friction has none
        for mode in self.growing:
            if not any(mode in group for group in self.groups):
                group = [mode, *self._partners(mode, is_speed)[:1]]
                self.groups.append(tuple(sorted(group, key=self.first_hz)))

    def group_of(self, mode: int | None) -> tuple[int, ...]:
        """A growing mode alone, or with the one that it meets; empty of another mode."""
        return next((group for group in self.groups if mode in group), ())

    def first_hz(self, mode: int) -> float:
        """The frequency at the first value that has the mode."""
        return float(self.roots[mode][0].imag / math.tau)

    def starts(self, group: tuple[int, ...]) -> list[float]:
        """|lambda|, rad/s, at the first values of the modes of a group, rising."""
        return sorted(abs(self.roots[mode][0]) for mode in group)

    def root_at(self, mode: int, value: float) -> complex | None:
        """The root of a mode at a value, interpolated; None where its path does not reach."""
        at = self.at[mode]
        if not at[0] <= value <= at[-1]:
            return None
        return complex(np.interp(value, at, self.roots[mode]))

    def mode_at(self, value: float, root: complex) -> int | None:
        """The mode whose root at a value is nearest to this one, rad/s; None if no mode has one."""
        distances = {}
        for mode in self.path_of:
            root_of_mode = self.root_at(mode, value)
            if root_of_mode is not None:
                distances[mode] = abs(root_of_mode - root)
        return min(distances, key=distances.__getitem__, default=None)

    def meeting(self, group: tuple[int, ...]) -> float | None:
        """The value at which the two modes of a group meet; None if they never do, and of one mode.

        There Re (lambda_1 - lambda_2)^2 turns positive: before it the roots differ in frequency, by
        an imaginary number of negative square, and behind it in growth rate, by a real one. Unlike
        frequencies, which damping that differs holds apart, this square is smooth at the meeting.
        """
        if len(group) < 2:
            return None
        first, second = group
        squares = ((self.path_of[first] - self.path_of[second]) ** 2).real
        meetings = np.flatnonzero((squares[:-1] < 0.0) & (squares[1:] >= 0.0))
        if not meetings.size:
            return None
        # the two values before and behind the first meeting
        neighbours = slice(meetings[0], meetings[0] + 2)
        return float(np.interp(0.0, squares[neighbours], self.values[neighbours]))

    def growth(self, mode: int) -> float:
        """The fastest growth rate of a mode, 1/s."""
        return float(self.roots[mode].real.max())

    def numbered(self, spectrum: Eigenvalues) -> Eigenvalues:
        """Eigenvalues whose modes have the numbers of the sweep, by the roots at the same value.

        Each mode is assigned a root of the sweep, the nearest pairs first. A mode that is farther
        than `NEAR` from its root, or has none, gets the next free number.
        """
        # the modes of the spectrum by their numbers of rising frequency, with one root of each
        by_frequency = mode_numbers(spectrum.values)
        no_residuals = np.zeros(len(by_frequency))
        step = Step(spectrum.value, spectrum.values, no_residuals, None, modes=by_frequency)
        root_of_mode = {mode: root.value for mode, root in step.root_of_mode().items()}
        # the modes of the sweep at this value, and their roots
        in_sweep = self.by_value.get(spectrum.value, {})
        modes_in_sweep = list(in_sweep)
        roots = np.array(list(root_of_mode.values()), dtype=complex)
        roots_in_sweep = np.array(list(in_sweep.values()), dtype=complex)
        # (modes, modes in the sweep), as shares of |lambda|
        distances = np.abs(np.subtract.outer(roots, roots_in_sweep))
        distances /= divisor(np.abs(roots))[:, None]
        nearest = np.full(len(roots), -1)  # of each root the index of one in the sweep, -1 for none
        if in_sweep:
            nearest = assigned(distances)
        # from numbers by rising frequency to those of the sweep; 0 is a root without a mode
        number_of = {0: 0}
        following = itertools.count(1 + max(itertools.chain(*self.by_value.values()), default=0))
        for mode, row, k in zip(root_of_mode, distances, nearest.tolist(), strict=True):
            is_in_sweep = k >= 0 and row[k] <= NEAR
            number_of[mode] = modes_in_sweep[k] if is_in_sweep else next(following)
        numbers = np.array([number_of[mode] for mode in by_frequency.tolist()], dtype=int)
        return replace(spectrum, numbers=numbers)

    def _rank(self, mode: int) -> tuple[float, float]:
        """The growth rates, 1/s, by which growing modes are ranked: at the own value, and the
        fastest."""
        k = self._index_of_growth(mode)
        growth = 0.0
        if self.values[k] == self.own_value:
            growth = float(self.path_of[mode][k].real)
        return growth, self.growth(mode)

    def _index_of_growth(self, mode: int) -> int:
        """The index of the own value if a mode grows there, else of that of its fastest growth."""
        path = self.path_of[mode]
        at_own_value = np.flatnonzero(self.values == self.own_value)[:1]  # its index, or none
        if is_growing(path[at_own_value]).any():
            return int(at_own_value[0])
        return int(np.nanargmax(path.real))

    def _partners(self, mode: int, is_speed: bool) -> list[int]:
        """The modes that `mode` has met up to the value of `_index_of_growth`, the nearest first.

        That is the subject's own value if the mode grows there, else that of its fastest growth.
        Modes that meet exchange energy. Both hold of a partner, from the first value that has both
        modes to this value: the frequencies come together, to `NEARER` times their first distance;
        and the growth rate of the partner falls while that of `mode` rises.

        Over friction two modes may be together from the first value on, as those of a disc: a
        distance of the frequencies below that of the growth rates serves too. Over a speed
        (`is_speed`) modes that begin as near as `TWINS` are no partners: they are the forward and
        the backward whirl of one shape, of which one grows alone.
        """
        path = self.path_of[mode]
        k = self._index_of_growth(mode)
        distances: dict[int, float] = {}
        for other, other_path in self.path_of.items():
            # (n,), rad/s: imaginary parts are differences of frequencies, real parts those of
            # growth rates
            gaps = path - other_path
            if other == mode or np.isnan(gaps[k]):
                continue
            first = int(np.argmax(np.isfinite(gaps)))  # index of the first value that has both
            first_distance = abs(gaps.imag[first])
            if is_speed and first_distance < TWINS * path.imag[first]:
                continue
            limit = NEARER * first_distance
            if not is_speed:
                limit = max(limit, gaps.real[k])
            distance = abs(gaps.imag[k])
            is_near = distance <= min(limit, NEAREST * path.imag[k])
            rise = path.real[k] - path.real[first]
            fall = other_path.real[first] - other_path.real[k]
            if is_near and fall >= FED * rise:
                distances[other] = distance
        return sorted(distances, key=distances.__getitem__)


def is_growing(roots: ComplexArray, rounding: Array | None = None) -> Bools:
    """Which roots (m,) grow by more than rounding may move them, 1/s; left out, a share of each."""
    if rounding is None:
        rounding = GROWS * np.abs(roots)
    return roots.real > rounding


def _join(path_of: dict[int, ComplexArray], losses: Sequence[Loss]) -> dict[int, int]:
    """Join a path that ends to one of nearly its frequency that begins in the same interval.

    path_of: by number the path (n,) of each mode that vibrates. It is changed in place: a joined
    path has the lower of both numbers, and the higher one is removed. The lower one belongs to the
    value at which the modes of the sweep are numbered. losses: the intervals of the parameter in
    which paths end or begin. Returns the lower number by the higher one: {7: 2} where path 2 ended,
    and went on as path 7.
    """
    lower: dict[int, int] = {}
    for loss in sorted(losses):
        if loss.kind != "begin":
            continue
        ended = []
        for other in losses:
            if other.kind == "end" and other.low <= loss.low <= other.high:
                ended += [lower.get(mode, mode) for mode in other.modes]
        # the modes that vibrate, of those that end and of those that begin
        ended = [mode for mode in ended if mode in path_of]
        begun = [mode for mode in loss.modes if mode in path_of]
        if not ended or not begun:
            continue
        # frequencies (rad/s) at which paths end, and at which others begin
        last = [_known_roots(path_of[mode])[-1].imag for mode in ended]
        first = [_known_roots(path_of[mode])[0].imag for mode in begun]
        # for each path that begins the index of a path that ended, -1 for none
        nearest = assigned(np.abs(np.subtract.outer(first, last))).tolist()
        for mode, omega, k in zip(begun, first, nearest, strict=True):
            if k >= 0 and abs(omega - last[k]) <= NEAREST * omega:
                low, high = sorted((mode, ended[k]))
                path = path_of.pop(high)
                path_of[low] = np.where(np.isfinite(path_of[low]), path_of[low], path)
                # numbers that were joined to the removed one follow it
                lower = {
                    number: low if target == high else target for number, target in lower.items()
                }
                lower[high] = low
    return lower


def _known_roots(path: ComplexArray) -> ComplexArray:
    """The roots of a path at those values that have them."""
    return path[np.isfinite(path)]


def _own_value(sweep: Sweep) -> float | None:
    """The subject's own value of the parameter, None where it is not known or not in the sweep."""
    source = sweep.source
    if source is None:
        return None
    if isinstance(source, PadSource):
        own_value = float(source.scene.pad.mu)
    else:
        own_value = source.file.system.parameters[sweep.parameter]
    values = [step.value for step in sweep.steps]
    return own_value if min(values) <= own_value <= max(values) else None
