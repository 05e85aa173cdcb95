"""The least change of one parameter with which nothing grows, up and down.

Each parameter is lowered and raised in steps, the first step at which nothing grows is bisected,
and the change is rounded up and computed anew; so is a larger one that leaves a margin of the free
parameter. Where no small change stops all, large ones are searched. A large system is searched on a
reduced one; what is named was computed on the full one. The free parameter itself gets the bound
below which nothing grows.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from operator import itemgetter
from typing import NamedTuple, TypeAlias

import numpy as np

from squeal.errors import ComputationError, InputError
from squeal.io.writing import number
from squeal.linear import GROWING, CriticalPoint
from squeal.queries.remedies.changes import (
    IN_HAND,
    MOST_STEPS,
    NOTHING,
    RETRIES,
    WIDE_STEPS,
    Brake,
    Change,
    Effect,
    Loss,
    growing_within,
    loss_of,
    rounded,
    rounded_up,
)
from squeal.queries.remedies.growing import ChangedBrakes
from squeal.queries.systems.all_roots import is_small
from squeal.results.eigenvalues import Eigenvalues
from squeal.results.sensitivity import Sensitivity
from squeal.results.sources import SystemSource, unit_of
from squeal.results.thresholds import Thresholds

STEPS = (1, 2, 3, 4, 6, 8, 10, 13, 16, 20, MOST_STEPS)
FEW_STEPS = (1, 2, 4, 8, 16, MOST_STEPS)  # where each costs much
LARGER = tuple(1.3**k for k in range(16))  # times the least change: tried for one with a margin
DENSE_ROWS = 100  # up to which many steps are tried
BISECTIONS = 10  # to a thousandth of what lies between two steps
WORTH = 0.9  # of the fastest growth: a change that leaves more is no choice
BETTER = 1.02  # times: how much less grows, or later is lost, with a change worth naming
MOST_REMEDIES = 4  # that are computed on the full system, and of parts of a cure
NO_WAY = 90.0  # %: nobody takes the free parameter back by more
FEW_REMEDIES = 2  # where each costs much

ChangeFilter: TypeAlias = Callable[[Sequence[Change]], Sequence[Change]]
"""Picks those of some changes for which a condition holds."""


@dataclass(frozen=True, eq=False)
class Remedy(Effect):
    """The least change of one parameter, up or down, with which nothing grows, or least grows.

    Its effect is that of `advised`.

    Attributes
    ----------
    computed : Eigenvalues
        With the change `advised`, of the full system.
    change : Change
        The least one, rounded up to two digits.
    with_margin : Change or None
        The least larger one found after which nothing grows up to `IN_HAND` times the present value
        of the free parameter; None where there is none.
    rise : float
        The fastest growth rate with a part of the change, 1/s; 0 where growth falls all the way.
    is_small : bool
        Whether the least change is one that is looked at first, before it is rounded up.
    """

    computed: Eigenvalues
    change: Change
    with_margin: Change | None = None
    rise: float = 0.0
    is_small: bool = True

    @property
    def advised(self) -> Change:
        """The change with a margin, else the least one."""
        return self.with_margin or self.change

    def sentence(self, meaning: str) -> str:
        """What to change, by how much, what that does and what it costs.

        It is true of a remedy that stops all that grows, not of a partial one. meaning: what the
        parameter is, such as " (leading spring)", or empty.
        """
        change = self.advised
        cost_on_the_way = ""
        if self.rise:
            cost_on_the_way = f"on the way growth first rises to {number(self.rise, 3)} 1/s"
        text = f"{change.verb.capitalize()} {change.parameter}{meaning} by {change.size}, "
        text += f"{change.values}: {self.words(cost_on_the_way)}."
        if not self.is_small:
            text += f" No parameter does it with up to {change.of(MOST_STEPS).size}."
        return text


@dataclass(frozen=True, eq=False)
class Bound(Effect):
    """The value of the free parameter below which nothing grows.

    Its effect is that of `with_margin`.

    Attributes
    ----------
    below : str
        The lower end of the interval that holds the loss of stability, rounded down.
    change : Change
        From the present value to `below`.
    with_margin : Change
        From the present value to `below` / `IN_HAND`.
    reservations : sequence of str
        What the bound does not hold for.
    """

    below: str
    change: Change
    with_margin: Change
    reservations: Sequence[str]


class RemedySearch(NamedTuple):
    """What the search of changes of one parameter ended with.

    remedies: that stop all that grows, the best first; without one partial: changes with which
    least grows, the best first; and without_effect: the parameters of which no change up to a
    factor of 4 takes a tenth of the fastest growth.
    """

    remedies: tuple[Remedy, ...]
    partial: tuple[Remedy, ...] = ()
    without_effect: tuple[str, ...] = ()


def find_remedies(
    brake: Brake,
    derivatives: Sensitivity,
) -> RemedySearch:
    """The changes of one parameter that stop every growing mode of the selection.

    First comes the one that leaves a margin with the fewest steps, last those with which something
    grows at a smaller value of the free parameter. A step is 1 % of a parameter, or a degree of an
    angle.

    Parameters
    ----------
    brake : Brake
        As it is.
    derivatives : Sensitivity
        Of its eigenvalues; it says which parameters may change, and what a step is. The free
        parameter is left out.

    Raises
    ------
    ComputationError
        If the changed brake cannot be computed.
    """
    directions = list(_directions(brake.spectrum, derivatives))
    if not brake.spectrum.unstable or not directions:
        return RemedySearch(())
    search = _Search(brake, directions)
    remedies: list[Remedy] = []
    for least, with_margin in search.least_changes():
        if len(remedies) < search.most_remedies:
            remedy = search.remedy(least, with_margin)
            if remedy is not None:
                remedies.append(remedy)
    if remedies:
        remedies.sort(key=lambda remedy: remedy.grows_below)
        return RemedySearch(tuple(remedies))
    return search.partial_remedies()


def keep_below(brake: Brake, outside: Thresholds | None) -> Bound | None:
    """The value of the free parameter below which nothing grows, in the band or outside of it.

    If stability is lost at 0.4 it is 0.4, and 0.3636 with a margin (`IN_HAND`). None if nothing
    grows at the present value, something grows from the lower end of the range on, or stability is
    first lost beyond the present value or more than `NO_WAY` below it.

    Parameters
    ----------
    brake : Brake
        As it is.
    outside : Thresholds, optional
        Of the modes outside of the band, which may begin to grow at a smaller value; left out, only
        the modes of the band were computed.
    """
    spectrum = brake.spectrum
    losses = brake.losses
    present = brake.present
    first = losses.first
    if not spectrum.unstable or losses.verdict in GROWING or first is None:
        return None
    if not 0.0 < first.mu < present:
        return None
    earliest = first
    if outside is not None and outside.verdict not in GROWING and outside.first is not None:
        earliest = min(first, outside.first, key=lambda point: point.mu)
    # stability may be lost from here on. The little that is added keeps 0.75 with an interval of
    # rounding from being rounded down to 0.7499
    lowest = earliest.interval[0] + 1e-9 * earliest.mu
    below = rounded(lowest, 4, math.floor)
    below_with_margin = rounded(lowest / IN_HAND, 4, math.floor)
    unit = unit_of(losses.source)
    one_percent = present / 100.0
    # a change of the free parameter in steps of 1 % of its present value, none so far
    no_change = Change(spectrum.parameter, present, one_percent, "%", 0.0, unit)
    change = no_change.of(100.0 * (float(below) / present - 1.0))
    with_margin = no_change.of(100.0 * (float(below_with_margin) / present - 1.0))
    if abs(with_margin.count) > NO_WAY:
        return None
    return Bound(
        before=spectrum,
        value=with_margin.after,
        roots=brake.selected_roots(losses, brake.changed_by(with_margin), with_margin.after),
        loss=Loss(earliest.mu, earliest.kind, earliest.frequency_hz, losses.high),
        below=below,
        change=change,
        with_margin=with_margin,
        reservations=_reservations(spectrum, first, outside),
    )


def _reservations(
    spectrum: Eigenvalues, first: CriticalPoint, outside: Thresholds | None
) -> list[str]:
    """What a bound does not hold for: what lies outside of the band, in words.

    first: the first loss of stability in the band; outside: as `keep_below` takes it. That another
    mode is lost outside at a larger value goes without saying where all roots are known.
    """
    extent = spectrum.extent
    source = spectrum.source
    is_large = isinstance(source, SystemSource) and not is_small(source.file.system)
    is_of_band_alone = bool(extent) and is_large
    reservations = []
    if outside is not None and outside.verdict in GROWING:
        start = f"{outside.parameter} = {number(outside.low, 4)}"
        reservations.append(f"for {extent} alone: something outside grows at {start} already")
    elif outside is not None and outside.first is not None:
        other = outside.first
        if is_of_band_alone or other.mu < first.mu:
            hertz = number(other.frequency_hz or 0.0, 4)
            of_other = f"{number(other.mu, 4)} for {hertz} Hz outside"
            reservations.append(f"{number(first.mu, 4)} for {extent}, {of_other}")
    if is_of_band_alone:
        reservations.append(f"nothing else than {extent} was searched")
    return reservations


def _directions(spectrum: Eigenvalues, derivatives: Sensitivity) -> Iterator[Change]:
    """For each parameter that moves a root a change by one step up, and one by a step down."""
    for name, slopes in derivatives.slopes.items():
        step, step_text = derivatives.step(name)  # the text is "1 %", "1 degree" or "1"
        # of each root by a step, rad/s. Infinite where the derivative is not known: such a
        # parameter is tried
        movements = np.nan_to_num(abs(step) * np.abs(slopes), nan=np.inf)
        moves = movements > NOTHING * abs(spectrum.values)
        if name == spectrum.parameter or not step or not moves.any():
            continue
        unit = step_text.removeprefix("1").strip().replace("degree", "degrees")
        value_unit = derivatives.units[name].replace("rad", "")
        for count in (1.0, -1.0):
            yield Change(name, derivatives.values[name], step, unit, count, value_unit)


class _Search:
    """The search of `find_remedies`.

    directions: changes by one step, two of each parameter: up and down. factors: times the present
    value of the free parameter, where nothing is to grow with a change that leaves a margin; values
    at which the full system grows, though the search saw nothing, join them.
    """

    def __init__(self, brake: Brake, directions: Sequence[Change]) -> None:
        self.brake = brake
        self.spectrum = brake.spectrum
        self.directions = directions
        self.steps: Sequence[int] = STEPS
        self.most_remedies = MOST_REMEDIES
        source = brake.spectrum.source
        if isinstance(source, SystemSource) and source.file.system.n > DENSE_ROWS:
            self.steps = FEW_STEPS
            self.most_remedies = FEW_REMEDIES
        self.factors = [1.0, IN_HAND]
        self.changed_brakes = ChangedBrakes(brake.spectrum, directions)

    def least_changes(self) -> Sequence[tuple[Change, Change | None]]:
        """For each direction (a parameter raised, or lowered) the least change that stops all that
        grows, and the least larger one that leaves a margin of the free parameter, or None.

        Directions in which no change stops all are left out. First comes the smallest with a
        margin, last those without one. Large changes are tried if no small one stops all.
        """
        stopping = self.changed_brakes.stopping  # of some changes those that stop all that grows
        least = _least_passing(self.directions, self.steps, stopping)
        if not least:
            self.steps = (*self.steps, *WIDE_STEPS)
            least = _least_passing(self.directions, self.steps, stopping)
        changes = list(least.values())
        pairs = zip(changes, self._with_margins(changes), strict=True)

        def rank(pair: tuple[Change, Change | None]) -> tuple[float, float]:
            change, with_margin = pair
            return abs(with_margin.count) if with_margin else math.inf, abs(change.count)

        return sorted(pairs, key=rank)

    def remedy(self, least: Change, with_margin: Change | None) -> Remedy | None:
        """The remedy of a pair of `least_changes`, as the full system confirms it.

        `least` is rounded up until nothing grows with it at the present value; None if something
        grows with each of the rounded changes.
        """
        for change in rounded_up(least):
            with suppress(InputError, ComputationError):  # there may be no such brake
                computed = self._eigenvalues_with(change)
                if computed.unstable:
                    continue
                confirmed, loss = self._confirmed_margin(least, with_margin)
                if confirmed is not None:
                    computed = self._eigenvalues_with(confirmed)
                else:
                    loss = loss_of(self._thresholds_with(change), self.brake.high)
                return Remedy(
                    before=self.spectrum,
                    value=self.brake.present,
                    roots=computed.values,
                    loss=loss,
                    computed=computed,
                    change=change,
                    with_margin=confirmed,
                    rise=self._rise(least),
                    is_small=abs(least.count) <= MOST_STEPS,
                )
        return None

    def partial_remedies(self) -> RemedySearch:
        """The changes with which least grows, and the parameters of which none is worth naming."""
        spectrum = self.spectrum
        partial: list[Remedy] = []
        without_effect: list[str] = []
        for growth, change in self._least_growth():
            if growth > WORTH * spectrum.unstable[0].growth_rate:
                without_effect.append(change.parameter)
            elif len(partial) < self.most_remedies:
                computed = self._eigenvalues_with(change)
                partial.append(
                    Remedy(spectrum, spectrum.value, computed.values, None, computed, change)
                )
        return RemedySearch((), tuple(partial), tuple(sorted(without_effect)))

    def _least_growth(self) -> Sequence[tuple[float, Change]]:
        """For each parameter the least growth rate, 1/s, with a change up or down, and that change.

        The least rate comes first. Of the changes of a parameter a larger one is taken only if
        growth falls by the factor `BETTER` against the smaller one. The change has 0 steps where
        growth does not fall. Changes that only move growing modes out of the band are passed over.
        """
        best: dict[str, tuple[float, Change]] = {}
        for direction in self.directions:
            for step in (0, *self.steps):
                if step > direction.most:  # so large changes of this parameter are not looked at
                    break
                change = direction.times(step)
                (roots,) = self.changed_brakes.roots([change])
                if roots is None or self.changed_brakes.has_more_outside(roots):
                    continue
                growth = self.changed_brakes.growth(change)
                least, _ = best.get(change.parameter, (math.inf, change))
                if growth < least / BETTER:
                    best[change.parameter] = (growth, change)
        return sorted(best.values(), key=itemgetter(0))

    def _leaving_margin(self, changes: Sequence[Change]) -> Sequence[Change]:
        """The changes with which nothing grows at any of `factors`."""
        for factor in self.factors:
            changes = self.changed_brakes.stopping(changes, factor)
        return changes

    def _with_margins(self, least: Sequence[Change]) -> list[Change | None]:
        """For each least change the least larger one that leaves a margin, None if none is seen."""
        # at least a tenth more: else a little less of the change would not be enough
        directions = [change.times(IN_HAND) for change in least]
        with_margin = _least_passing(directions, LARGER, self._leaving_margin, start=1.0)
        return [with_margin.get(direction) for direction in directions]

    def _confirmed_margin(
        self, least: Change, with_margin: Change | None
    ) -> tuple[Change | None, Loss | None]:
        """The change that leaves a margin in the full system, and where stability is lost with it;
        None twice if none is found.

        `with_margin` is rounded up further as long as stability is lost above the present value,
        but before the margin ends. Where something grows below the present value, such values join
        `factors`, and the least change that leaves a margin is searched anew.
        """
        present = self.brake.present
        for _ in range(RETRIES):
            growing_at: list[float] = []  # values up to the present one at which something grows
            for change in rounded_up(with_margin):  # none if `with_margin` is None
                answer = self._thresholds_with(change)
                loss = loss_of(answer, self.brake.high)
                if loss.limit() >= IN_HAND * present:
                    return change, loss
                growing_at = growing_within(answer, present)
                if growing_at:
                    break  # to round up further is of no use: the search goes on below
            if not growing_at:
                break  # none of the changes leaves the margin
            self.factors += [value / present for value in growing_at]
            (with_margin,) = self._with_margins([least])
        return None, None

    def _rise(self, least: Change) -> float:
        """The fastest growth, 1/s, with a quarter, half or three quarters of a change; 0 where that
        is hardly more than without the change."""
        growth = self.changed_brakes.growth
        highest = max(growth(least.times(share)) for share in (0.25, 0.5, 0.75))
        return highest if highest > BETTER * growth(least.of(0.0)) else 0.0

    def _eigenvalues_with(self, change: Change) -> Eigenvalues:
        """The eigenvalues of the changed brake."""
        return self.brake.eigenvalues_of(self.brake.changed_by(change), prove=None)

    def _thresholds_with(self, change: Change) -> Thresholds:
        """The thresholds of the changed brake."""
        return self.brake.thresholds_of(self.brake.changed_by(change), self.brake.high)


def _least_passing(
    directions: Sequence[Change],
    factors: Sequence[float],
    passing: ChangeFilter,
    start: float = 0.0,
) -> dict[Change, Change]:
    """By direction the least change that passes a filter; a direction without one is missing.

    A change is a factor times its direction. Between the first of the rising `factors` whose change
    passes, and the factor before it, the least factor is searched by bisection. All directions are
    searched together, since many changed pads take hardly longer than one. start: the factor before
    the first one.
    """
    # by direction: a factor that does not pass, and a greater one that passes
    lows, highs = _first_intervals(directions, factors, passing, start)
    for _ in range(BISECTIONS):
        middles = {}
        tried = {}
        for direction, high in highs.items():
            middles[direction] = (lows[direction] + high) / 2
            tried[direction] = direction.times(middles[direction])
        passed = passing(list(tried.values()))
        for direction, change in tried.items():
            if change in passed:
                highs[direction] = middles[direction]
            else:
                lows[direction] = middles[direction]
    least = {}
    for direction in directions:
        if direction in highs:
            least[direction] = direction.times(highs[direction])
    return least


def _first_intervals(
    directions: Sequence[Change],
    factors: Sequence[float],
    passing: ChangeFilter,
    start: float,
) -> tuple[dict[Change, float], dict[Change, float]]:
    """By direction the first factor whose change passes a filter, and the factor before that one.

    See `_least_passing`. A change larger than `Change.most` is not tried. directions: changes by
    one step; factors: numbers of steps, rising; start: the number before the first of them.

    Returns
    -------
    lows, highs : dict
        The factors before, and the first ones that pass. A direction of which no change passes is
        missing in both.
    """
    lows: dict[Change, float] = {}
    highs: dict[Change, float] = {}
    before = start
    for factor in factors:
        tried = {}
        for direction in directions:
            change = direction.times(factor)
            if direction not in highs and abs(change.count) <= direction.most:
                tried[change] = direction
        for change in passing(list(tried)):
            lows[tried[change]] = before
            highs[tried[change]] = factor
        before = factor
    return lows, highs
