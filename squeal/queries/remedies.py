"""Remedies: the least change of one parameter with which nothing grows, both ways.

Each parameter is lowered and raised in steps, the first step at which nothing grows is bisected,
and the change is rounded up and computed anew; so is the one that leaves a margin of the free
parameter. Where no small change helps, large ones are looked at. Of a large system a reduced one is
searched; what is named was computed on the full one.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from squeal.errors import ComputationError, InputError
from squeal.io.scene import Scene
from squeal.io.system import SystemFile
from squeal.io.writing import number
from squeal.linear import GROWING, Spectrum
from squeal.linear.eigen import values_of
from squeal.linear.roots import ComplexArray
from squeal.linear.shaft import name_of_kind
from squeal.linear.system import TermSystem
from squeal.queries.eigenvalues import eigenvalues
from squeal.queries.mode_paths import is_growing
from squeal.queries.options import Band
from squeal.queries.pads.equilibrium import spectra_of_pads
from squeal.queries.parameter_space import first_loss
from squeal.queries.systems.all_roots import in_band, is_small, roots_of_all
from squeal.queries.thresholds import thresholds
from squeal.results.eigenvalues import Eigenvalues
from squeal.results.sensitivity import DEGREE, Sensitivity
from squeal.results.sources import EigenvalueSelection, PadSource, SystemSource, unit_of
from squeal.results.thresholds import Thresholds

MOST_STEPS = 25  # of 1 % or a degree: the largest change that is looked at first
STEPS = (1, 2, 3, 4, 6, 8, 10, 13, 16, 20, MOST_STEPS)
FEW_STEPS = (1, 2, 4, 8, 16, MOST_STEPS)  # where each costs much
MORE = 1.3  # ratio of steps from the least change to one with a margin
WIDE_STEPS = (35, 50, 75, 150, 200, 300)  # where none of these stops all
NO_WAY = 90.0  # %: nobody takes the free parameter back by more
TO_A_QUARTER = 75  # percent: less is left of a part that might as well be taken out
QUARTER_TURN = 90  # degrees: no angle is turned by more
IN_HAND = 1.1  # times the free parameter's value: up to there nothing is to grow
DENSE_ROWS = 100  # up to which many steps are looked at
BISECTIONS = 10  # to a thousandth of what lies between two steps
RETRIES = 4  # of a change that the full system does not confirm, each time a larger one
WIDER = 0.15  # of the ends of a band: a mode that a change moves out of it has not stopped
NOTHING = 1e-9  # of |lambda|: a step that moves no root by more has no effect
WORTH = 0.9  # of the fastest growth: a change that leaves more is no choice
BETTER = 1.02  # times: how much less grows, or later is lost, with a change worth naming
MOST_REMEDIES = 4  # that are computed on the full system, and of parts of a cure
FEW_REMEDIES = 2  # where each costs much


class Loss(NamedTuple):
    """Where stability is lost first with a change: value of the free parameter, None if nowhere up
    to `high`, what happens there, and its frequency in Hz; extent: of which roots that was
    searched, in words, empty for all."""

    value: float | None
    kind: str
    frequency_hz: float | None
    high: float
    extent: str = ""

    def limit(self) -> float:
        """The value up to which nothing grows, infinite where stability is not lost."""
        return math.inf if self.value is None else self.value

    def words(self, parameter: str, unit: str) -> str:
        """Up to where nothing grows, and what follows; unit: of the parameter."""
        if self.value is None:
            return f"up to {parameter} = {number(self.high, 4)}, where the search ends"
        text = f"up to {parameter} = {rounded(self.value, 4, math.floor)}, then "
        text += name_of_kind(self.kind, unit)
        if self.frequency_hz:
            text += f" at {number(self.frequency_hz, 4)} Hz"
        return text


@dataclass(frozen=True)
class Change:
    """A parameter before and after a change of `count` steps, which are percent or degrees.

    measured: the unit of its value, empty for an angle.
    """

    parameter: str
    before: float
    step: float
    unit: str
    count: float
    measured: str = ""

    @property
    def after(self) -> float:
        """The changed value."""
        return self.before + self.count * self.step

    @property
    def verb(self) -> str:
        """Whether the parameter is raised or lowered."""
        return "raise" if self.after > self.before else "lower"

    @property
    def size(self) -> str:
        """How large the change is, in words."""
        unit = self.unit
        if unit == "degrees" and abs(self.count) == 1.0:
            unit = "degree"
        return f"{number(abs(self.count), 3)} {unit}".rstrip()

    @property
    def values(self) -> str:
        """The values before and after, angles in degrees as their change is."""
        if self.unit == "degrees":
            before = number(self.before / DEGREE, 5)
            return f"from {before} to {number(self.after / DEGREE, 5)} degrees"
        unit = f" {self.measured}".rstrip()
        return f"from {number(self.before, 5)} to {number(self.after, 5)}{unit}"

    @property
    def most(self) -> int:
        """The largest change to this side that is looked at, in steps."""
        if self.unit == "degrees":
            return QUARTER_TURN
        is_lowered_share = self.count < 0.0 and self.unit == "%"
        return TO_A_QUARTER if is_lowered_share else WIDE_STEPS[-1]

    def of(self, count: float) -> Change:
        """Another change of the same parameter."""
        return replace(self, count=count)


@dataclass(frozen=True, eq=False)
class Effect:
    """What a change does at a value of the free parameter, and beyond.

    before: the eigenvalues without the change, at the present value; value: that of the effect, the
    present one unless the free parameter is what changes; roots (m,): those of the selection with
    the change, rad/s; loss: where stability is lost first with it, None where modes grow or nothing
    depends on the parameter.
    """

    before: Eigenvalues
    value: float
    roots: ComplexArray
    loss: Loss | None

    @property
    def limit(self) -> float:
        """The value of the free parameter up to which nothing grows; 0 where that is not known."""
        return self.loss.limit() if self.loss else 0.0

    @property
    def leaves_window(self) -> bool:
        """Whether something grows at a smaller value of the free parameter."""
        return self.loss is not None and self.limit <= self.value

    @property
    def in_hand(self) -> str:
        """How much more of the free parameter leaves nothing that grows, in %, rounded down; a dash
        where that is not known, or where something grows at less."""
        if self.loss is None or self.leaves_window or self.value <= 0.0:
            return "-"
        share = min(self.limit, self.loss.high) / self.value - 1.0
        percent = math.floor(100.0 * share + NOTHING)  # 10 of 1.1, whatever rounding makes of it
        return f"{'over ' * math.isinf(self.limit)}{percent}"

    @property
    def damping_left(self) -> float:
        """The least damping ratio of the modes that vibrate with the change; NaN without one."""
        vibrating = self.roots[self.roots.imag > 0.0]
        ratios = -vibrating.real / np.abs(vibrating) + 0.0  # no negative zero
        return float(ratios.min(initial=np.inf)) if len(ratios) else math.nan

    @property
    def shift_hz(self) -> float:
        """How far frequencies move with the change, at least one of them so far; NaN where there
        are fewer or more than before, as in a band that a mode leaves."""
        frequencies = []
        for roots in (self.before.values, self.roots):
            frequencies.append(np.sort(roots.imag[roots.imag > 0.0]) / math.tau)
        if len(frequencies[0]) != len(frequencies[1]):
            return math.nan
        # of all ways to pair them this has the least largest distance
        return float(np.max(np.abs(frequencies[1] - frequencies[0]), initial=0.0))

    def words(self, first_cost: str = "") -> str:
        """Up to where nothing grows with the change, what follows, and what it costs."""
        parameter = self.before.parameter
        text = "nothing grows"
        extent = self.before.extent if self.loss is None else self.loss.extent
        if extent:  # modes that leave it may grow
            text = f"nothing from {extent} grows"
        if self.leaves_window:
            text += f" at {parameter} = {number(self.value, 4)}; below, stability is lost"
            text += f" from {parameter} = {rounded(self.limit, 4, math.floor)} on"
        elif self.loss is not None:
            text += f" {self.loss.words(parameter, unit_of(self.before.source))}"
        costs = [first_cost] if first_cost else []
        is_undamped = np.abs(self.roots.real) <= NOTHING * np.abs(self.roots)
        if len(self.roots) and is_undamped.all():
            costs.append("nothing damps this model")
        elif not math.isnan(self.damping_left):
            costs.append(f"the least damping left is {number(100.0 * self.damping_left, 2)} %")
        if self.shift_hz > 0.0:  # false of NaN
            costs.append(f"frequencies move by up to {number(self.shift_hz, 3)} Hz")
        return f"{text}; {', '.join(costs)}" if costs else text


@dataclass(frozen=True, eq=False)
class Remedy(Effect):
    """The least change of one parameter to one side with which nothing grows, or least grows.

    Its effect is that of `take`, else of `change`.

    computed: the eigenvalues of its effect; change: rounded up to two digits; take: the change
    after which nothing grows up to `IN_HAND` times the free parameter, None where none leaves so
    much; rise: the fastest growth rate with a smaller change, 1/s, 0 where growth does not first
    rise.
    """

    computed: Eigenvalues
    change: Change
    take: Change | None = None
    rise: float = 0.0

    @property
    def is_small(self) -> bool:
        """Whether the change is one that is looked at first."""
        return abs(self.change.count) <= MOST_STEPS

    @property
    def advised(self) -> Change:
        """The change with a margin, else the least one."""
        return self.take or self.change

    def sentence(self, meaning: str) -> str:
        """What to change, by how much, what that does and what it costs, of a remedy that stops all
        that grows; meaning: what the parameter is, in brackets after a space, or empty."""
        change = self.advised
        rises = ""
        if self.rise:
            rises = f"on the way growth first rises to {number(self.rise, 3)} 1/s"
        text = f"{change.verb.capitalize()} {change.parameter}{meaning} by {change.size}, "
        text += f"{change.values}: {self.words(rises)}."
        if not self.is_small:
            text += f" No parameter does it with up to {change.of(MOST_STEPS).size}."
        return text


@dataclass(frozen=True, eq=False)
class Bound(Effect):
    """The value of the free parameter below which nothing grows; its effect is that of `take`.

    below: that value, rounded down; change: to it; take: to a value that leaves 10 % in hand;
    reservations: what it does not hold for, in words.
    """

    below: str
    change: Change
    take: Change
    reservations: Sequence[str]


class RemedySearch(NamedTuple):
    """Remedies, the best first; without one the changes with which least grows, `without_effect`
    the parameters of which no change up to a factor of 4 takes a tenth of the fastest growth."""

    remedies: tuple[Remedy, ...]
    partial: tuple[Remedy, ...] = ()
    without_effect: tuple[str, ...] = ()


Values: TypeAlias = Mapping[str, float]
GrowingRoots: TypeAlias = Callable[[Sequence[Values]], list[ComplexArray | None]]
"""The growing roots with Im >= 0 at each of several changes of parameters; None where there is no
such brake."""


def search_options(
    spectrum: Eigenvalues, losses: Thresholds, options: Mapping[str, object]
) -> Mapping[str, object]:
    """The options of `thresholds` with a change, from those without it.

    The range of a system begins where that without a change begins. Without a band where all roots
    are known and none grows outside of it in the range: what a change moves out of the band, and
    lets grow there, is seen then. Thresholds of complex matrices need a band.
    """
    source = losses.source
    if not isinstance(source, SystemSource):
        return options
    of_range = {**options, "low": losses.low}
    nothing_crosses = losses.details.get("crossings_outside") == 0
    nothing_grows = not spectrum.details.get("growing_outside")
    if source.file.system.real and nothing_crosses and nothing_grows:
        return {**of_range, "band": None}
    return of_range


def find_remedies(
    spectrum: Eigenvalues,
    derivatives: Sensitivity,
    high: float,
    options: Mapping[str, object],
    options_of_losses: Mapping[str, object],
) -> RemedySearch:
    """The changes of one parameter that stop every growing mode of the selection.

    First comes the one that leaves a margin with the fewest steps, last those with which something
    grows at a smaller value of the free parameter. A step is 1 % of a parameter, or a degree of an
    angle.

    Parameters
    ----------
    spectrum : Eigenvalues
        Of the brake as it is.
    derivatives : Sensitivity
        Of these eigenvalues; it says which parameters may change, and what a step is. The one that
        is swept is left out.
    high : float
        Upper end of the range in which the first loss of stability with the change is searched.
    options, options_of_losses : mapping
        Of `eigenvalues`, and of `thresholds` with a change: band, memory, progress.

    Raises
    ------
    ComputationError
        If the changed brake cannot be computed.
    """
    changes = []
    for name, slopes in derivatives.slopes.items():
        step, words = derivatives.step(name)
        movements = np.nan_to_num(abs(step) * np.abs(slopes), nan=np.inf)
        moves = movements > NOTHING * abs(spectrum.values)
        if name == spectrum.parameter or not step or not moves.any():
            continue
        unit = words.removeprefix("1").strip().replace("degree", "degrees")
        measured = derivatives.units[name].replace("rad", "")
        for count in (1.0, -1.0):  # which say the side
            value = derivatives.values[name]
            changes.append(Change(name, value, step, unit, count, measured))
    if not spectrum.unstable or not changes:
        return RemedySearch(())
    search = _Search(spectrum, changes, high, options, options_of_losses)
    remedies: list[Remedy] = []
    for change, take in search.located():
        if len(remedies) < search.most_remedies:
            remedy = search.remedy(change, take)
            if remedy is not None:
                remedies.append(remedy)
    if remedies:
        remedies.sort(key=lambda remedy: remedy.leaves_window)
        return RemedySearch(tuple(remedies))
    partial: list[Remedy] = []
    without_effect: list[str] = []
    for change in search.least_growth():
        if search.growth(change) > WORTH * spectrum.unstable[0].growth_rate:
            without_effect.append(change.parameter)
        elif len(partial) < search.most_remedies:
            computed = search.eigenvalues_with(change)
            partial.append(
                Remedy(spectrum, spectrum.value, computed.values, None, computed, change)
            )
    return RemedySearch((), tuple(partial), tuple(sorted(without_effect)))


class _Search:
    """Growing roots over changes of parameters; see `find_remedies`."""

    def __init__(
        self,
        spectrum: Eigenvalues,
        changes: Sequence[Change],
        high: float,
        options: Mapping[str, object],
        options_of_losses: Mapping[str, object],
    ) -> None:
        self.spectrum = spectrum
        self.sides = changes
        self.high = high
        self.options = options
        self.options_of_losses = options_of_losses
        self.steps: Sequence[int] = STEPS
        self.most_remedies = MOST_REMEDIES
        source = spectrum.source
        self.band: Band | None = None
        if isinstance(source, SystemSource):
            self.band = source.selection.band
            if source.file.system.n > DENSE_ROWS:
                self.steps = FEW_STEPS
                self.most_remedies = FEW_REMEDIES
        self.lower: list[float] = []  # times the free parameter: where else nothing is to grow
        self.known: dict[tuple[str, float, float], ComplexArray | None] = {}
        served: list[Values] = [{}, {spectrum.parameter: IN_HAND * spectrum.value}]
        for side in changes:
            for share in (0.5, 1.0):
                count = math.copysign(share * side.most, side.count)
                served.append({side.parameter: side.of(count).after})
        self.growing = _growing_roots(source, served)
        # outside of a band others may grow, and go on growing
        (at_present,) = self.growing([{}])
        self.others = 0  # how many
        if at_present is not None:
            self.others = len(at_present) - len(in_band(at_present, self.band))

    def compute(self, changes: Iterable[Change], factor: float = 1.0) -> None:
        """Compute the growing roots with each change, and with so many times the free parameter."""
        unknown: dict[tuple[str, float, float], Values] = {}
        for change in changes:
            key = (change.parameter, change.count, factor)
            values = {change.parameter: change.after}
            if factor != 1.0:
                values[self.spectrum.parameter] = factor * self.spectrum.value
            if key not in self.known:
                unknown[key] = values
        if unknown:
            self.known.update(zip(unknown, self.growing(list(unknown.values())), strict=True))

    def roots(self, change: Change, factor: float = 1.0) -> ComplexArray | None:
        """The growing roots with a change, and with so many times the free parameter; None where
        there is no such brake."""
        self.compute([change], factor)
        return self.known[change.parameter, change.count, factor]

    def stopping(self, changes: Sequence[Change], factor: float = 1.0) -> Sequence[Change]:
        """The changes with which nothing of the band grows, and nothing was but moved out of it."""
        self.compute(changes, factor)
        stopping = []
        for change in changes:
            roots = self.roots(change, factor)
            if roots is None or len(in_band(roots, self.band)) or len(roots) > self.others:
                continue
            stopping.append(change)
        return stopping

    def leaving_margin(self, changes: Sequence[Change]) -> Sequence[Change]:
        """The changes with which nothing grows, and neither with more or less of the free
        parameter."""
        for factor in (1.0, IN_HAND, *self.lower):
            changes = self.stopping(changes, factor)
        return changes

    def growth(self, change: Change) -> float:
        """The rate of the mode that grows fastest with a change, 1/s; 0 where there is none."""
        roots = self.roots(change)
        if roots is None:
            return 0.0
        return float(in_band(roots, self.band).real.max(initial=0.0))

    def rise(self, least: Change) -> float:
        """The fastest growth, 1/s, with a part of a change; 0 where it does not first rise."""
        highest = max(self.growth(least.of(share * least.count)) for share in (0.25, 0.5, 0.75))
        return highest if highest > BETTER * self.growth(least.of(0.0)) else 0.0

    def located(self) -> Sequence[tuple[Change, Change | None]]:
        """The least change of each parameter, lowered or raised, that stops all that grows, and a
        larger one that leaves a margin, or None.

        The smallest with a margin first, those that leave none last. Large changes are looked at if
        no small one stops all.
        """
        found = self._located(self.steps)
        if not found:
            self.steps = (*self.steps, *WIDE_STEPS)
            found = self._located(self.steps)

        def rank(pair: tuple[Change, Change | None]) -> tuple[float, float]:
            change, take = pair
            return abs(take.count) if take else math.inf, abs(change.count)

        return sorted(found, key=rank)

    def _located(self, steps: Sequence[float]) -> list[tuple[Change, Change | None]]:
        """The changes of `located`, searched in these steps, in the order of the parameters."""
        least = self._least(self.sides, steps, self.stopping)
        return list(zip(least.values(), self.with_margins(list(least.values())), strict=True))

    def with_margins(self, least: Sequence[Change]) -> list[Change | None]:
        """Of each change with which nothing grows at the present value of the free parameter the
        least larger one with which nothing grows with more or less of it, None if none is seen."""
        # at least a tenth more: else a little less of the change would not be enough
        sides = [change.of(IN_HAND * change.count) for change in least]
        larger = [MORE**k for k in range(16)]
        found = self._least(sides, larger, self.leaving_margin, start=1.0)
        return [found.get(side) for side in sides]

    def takes(self, least: Change, with_margin: Change | None) -> Iterator[Change]:
        """The change that shall leave a margin, and larger ones for as long as they are asked for.

        Where something grows with one at values of the free parameter that have joined `lower`, the
        change is searched anew; else it is rounded up further.
        """
        for _ in range(RETRIES):
            known = len(self.lower)
            for take in _rounded_up(with_margin):
                yield take
                if len(self.lower) > known:
                    break
            else:
                return
            (with_margin,) = self.with_margins([least])

    def _least(
        self,
        sides: Sequence[Change],
        steps: Sequence[float],
        holding: Callable[[Sequence[Change]], Sequence[Change]],
        start: float = 0.0,
    ) -> dict[Change, Change]:
        """The least change to each side for which a condition holds; none if none is seen.

        All sides are searched together, since changed pads take hardly longer together than one of
        them. The rising steps, in multiples of a side and all above `start`, are tried one after
        the other. The first at which the condition holds is bisected from the step before, the
        first step from `start`. holding: picks the changes for which the condition holds.
        """
        intervals: dict[Change, tuple[float, float]] = {}  # where it comes to hold, of each side
        low = start
        for step in steps:
            tried = {}
            for side in sides:
                change = side.of(step * side.count)
                if side not in intervals and abs(change.count) <= side.most:
                    tried[change] = side
            for change in holding(list(tried)):
                intervals[tried[change]] = (low, step)
            low = step
        for _ in range(BISECTIONS):
            middles = {}
            for side, (low, high) in intervals.items():
                middles[side] = side.of((low + high) / 2 * side.count)
            holds = holding(list(middles.values()))
            for side, change in middles.items():
                low, high = intervals[side]
                middle = (low + high) / 2
                intervals[side] = (low, middle) if change in holds else (middle, high)
        least = {}
        for side in sides:
            if side in intervals:
                _, high = intervals[side]
                least[side] = side.of(high * side.count)
        return least

    def remedy(self, least: Change, with_margin: Change | None) -> Remedy | None:
        """A change, rounded up to two digits, with what the full system says of it, None if modes
        go on growing with it.

        with_margin: the change that shall leave a margin, which is taken if the full system
        confirms that stability is lost no earlier than at `IN_HAND` times the free parameter. Where
        it is lost at a value that the search did not look at, that value joins those of the search.
        """
        present = self.spectrum.value
        for change in _rounded_up(least):
            with suppress(InputError, ComputationError):  # there may be no such brake
                computed = self.eigenvalues_with(change)
                if computed.unstable:
                    continue
                take: Change | None
                for take in self.takes(least, with_margin):
                    answer = self.thresholds_with(take)
                    loss = loss_of(answer, self.high)
                    if loss.limit() >= IN_HAND * present:
                        computed = self.eigenvalues_with(take)
                        break
                    self.lower += [value / present for value in growing_within(answer, present)]
                else:  # none leaves a margin
                    take = None
                    loss = loss_of(self.thresholds_with(change), self.high)
                roots = computed.values
                rise = self.rise(least)
                return Remedy(self.spectrum, present, roots, loss, computed, change, take, rise)
        return None

    def eigenvalues_with(self, change: Change) -> Eigenvalues:
        """The eigenvalues of the changed brake."""
        return eigenvalues(replaced(self.spectrum.source, change), **self.options)  # type: ignore[arg-type]

    def thresholds_with(self, change: Change) -> Thresholds:
        """The thresholds of the changed brake."""
        changed = replaced(self.spectrum.source, change)
        return thresholds(changed, self.high, prove=False, **self.options_of_losses)  # type: ignore[arg-type]

    def least_growth(self) -> Sequence[Change]:
        """Of each parameter the step with which least grows, the best first; no step at all where
        none is of use."""
        found: dict[str, tuple[float, Change]] = {}
        for side in self.sides:
            for step in (0, *self.steps):
                if step > side.most:
                    break
                change = side.of(math.copysign(step, side.count))
                roots = self.roots(change)
                if roots is None or len(roots) - len(in_band(roots, self.band)) > self.others:
                    continue
                growth = self.growth(change)
                known, _ = found.get(change.parameter, (math.inf, change))
                if growth < known / BETTER:
                    found[change.parameter] = (growth, change)
        return [change for _, change in sorted(found.values(), key=lambda pair: pair[0])]


def _growing_roots(
    source: PadSource | SystemSource | None, served: Sequence[Values]
) -> GrowingRoots:
    """What computes growing roots: of the scene, of a small system, or of a reduced one that serves
    some values of its parameters."""
    assert source is not None
    if isinstance(source, PadSource):
        scene = source.scene

        def roots_of_pads(changes: Sequence[Values]) -> list[ComplexArray | None]:
            growing: list[ComplexArray | None] = []
            for spectrum in spectra_of_pads(scene, changes):
                roots = None
                if isinstance(spectrum, Spectrum):
                    roots = upper_growing(spectrum.values, spectrum.rounding)
                growing.append(roots)
            return growing

        return roots_of_pads
    from squeal.queries.systems.verdicts import rounding_of

    system = source.file.system
    if is_small(system):

        def roots_of_system(values: Values) -> ComplexArray:
            changed = system.replace(values)  # no parameter that seats contact is among them
            roots = roots_of_all(changed, EigenvalueSelection(), {})
            return upper_growing(roots, rounding_of(changed, roots))

        return _one_by_one(roots_of_system)
    from squeal.queries.systems.reduced import estimated_roots, reduced_for

    selection = source.selection
    if selection.band is not None:
        low, high = selection.band
        selection = EigenvalueSelection(((1.0 - WIDER) * low, (1.0 + WIDER) * high))
    existing = []
    for values in served:
        with suppress(InputError):  # a factor may divide by the parameter
            system.frozen().at(values)
            existing.append(values)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what it finds is computed on the full system
        reduction = reduced_for(system, selection, existing, "modal")

    def roots_of_reduced(values: Values) -> ComplexArray:
        found = estimated_roots(reduction, values)
        roots = values_of(found)
        return upper_growing(roots, np.array([root.rounding for root in found]))

    return _one_by_one(roots_of_reduced)


def _one_by_one(roots_of: Callable[[Values], ComplexArray]) -> GrowingRoots:
    """Growing roots of systems, which are computed one after the other."""

    def roots_of_each(changes: Sequence[Values]) -> list[ComplexArray | None]:
        growing: list[ComplexArray | None] = []
        for values in changes:
            roots = None
            with suppress(InputError, ComputationError, ArithmeticError):
                roots = roots_of(values)
            growing.append(roots)
        return growing

    return roots_of_each


def upper_growing(roots: ComplexArray, rounding: NDArray[np.float64]) -> ComplexArray:
    """The roots with Im >= 0 that grow by more than rounding may move them."""
    return roots[is_growing(roots, rounding) & (roots.imag >= 0.0)]


def _rounded_up(change: Change | None) -> Iterator[Change]:
    """A change in two digits, rounded up, and `RETRIES` - 1 larger ones; nothing of None.

    These are 1, 3, 6 and so on units of the second digit larger.
    """
    if change is None:
        return
    count = abs(change.count)
    unit = 10.0 ** (math.floor(math.log10(count)) - 1)  # of the second digit
    digits = math.ceil(count / unit * (1.0 - 1e-12))
    for retry in range(RETRIES):
        larger = retry * (retry + 1) // 2
        rounded_count = float(number((digits + larger) * unit, 3))
        if rounded_count <= change.most:
            yield change.of(math.copysign(rounded_count, change.count))


def keep_below(
    spectrum: Eigenvalues,
    losses: Thresholds,
    outside: Thresholds | None,
    options: Mapping[str, object],
) -> Bound | None:
    """The value of the free parameter below which nothing grows of all that was looked at; None if
    stability is lost later, or far below the present value.

    Parameters
    ----------
    spectrum, losses : Eigenvalues, Thresholds
        Of the brake as it is.
    outside : Thresholds, optional
        Of what grows outside of a band, which may be lost earlier.
    options : mapping
        Of `eigenvalues`: band, memory, progress.
    """
    value = spectrum.value
    first = losses.first
    source = losses.source
    if not spectrum.unstable or losses.verdict in GROWING or first is None:
        return None
    if not 0.0 < first.mu < value:
        return None
    lost = first
    extent = spectrum.extent
    is_large = isinstance(source, SystemSource) and not is_small(source.file.system)
    is_of_band_alone = bool(extent) and is_large
    reservations = []
    if outside is not None and outside.verdict in GROWING:
        reservations.append(f"for {extent} alone: something outside grows at any")
    elif outside is not None and outside.first is not None:
        other = outside.first
        lost = min(first, other, key=lambda point: point.mu)
        hertz = number(other.frequency_hz or 0.0, 4)
        of_other = f"{number(other.mu, 4)} for {hertz} Hz outside"
        if is_of_band_alone or lost is other:
            reservations.append(f"{number(first.mu, 4)} for {extent}, {of_other}")
    if is_of_band_alone:
        reservations.append(f"nothing else than {extent} was searched")
    present = Change(spectrum.parameter, value, value / 100.0, "%", 0.0, unit_of(source))
    below = rounded(lost.mu, 4, math.floor)
    with_margin = rounded(lost.mu / IN_HAND, 4, math.floor)
    change = present.of(100.0 * (float(below) / value - 1.0))
    take = present.of(100.0 * (float(with_margin) / value - 1.0))
    if abs(take.count) > NO_WAY:
        return None
    roots = selected_roots(losses, replaced(source, take), take.after, options)
    loss = Loss(lost.mu, lost.kind, lost.frequency_hz, losses.high)
    return Bound(spectrum, take.after, roots, loss, below, change, take, reservations)


def selected_roots(
    searched: Thresholds | None,
    subject: Scene | TermSystem | SystemFile,
    value: float,
    options: Mapping[str, object],
) -> ComplexArray:
    """The roots of the selection (m,), rad/s, at a value of the free parameter: of the reduced
    system on which thresholds were searched, where there is one, else of the subject, which has
    that value."""
    reduction = getattr(searched and searched.source, "reduction", None)
    if reduction is None:
        return eigenvalues(subject, prove=False, **options).values  # type: ignore[arg-type]
    from squeal.queries.systems.reduced import roots_of_reduction

    assert searched is not None
    return roots_of_reduction(reduction, {searched.parameter: value}).values


def loss_of(answer: Thresholds, high: float) -> Loss:
    """Where stability is lost first by thresholds up to `high`."""
    outcome = first_loss(answer, high)
    extent = ""
    if isinstance(answer.source, SystemSource) and answer.source.selection.band is not None:
        extent = answer.source.selection.words()
    return Loss(outcome.critical, outcome.kind or "", outcome.frequency_hz, high, extent)


def growing_within(answer: Thresholds, end: float) -> list[float]:
    """A value of each interval of the parameter below `end` in which something grows: the middle
    between a loss of stability and the next threshold, the lower end of the range if something
    grows there."""
    values = []
    if answer.verdict in GROWING:
        values.append(answer.low)
    for point in answer.points:
        if point.kind in GROWING and point.mu < end:
            above = [other.mu for other in answer.points if other.mu > point.mu]
            values.append((point.mu + min([*above, end])) / 2.0)
    return values


def replaced(source: PadSource | SystemSource | None, change: Change) -> Scene | SystemFile:
    """The scene or the file of a system with a changed parameter."""
    if isinstance(source, PadSource):
        return source.scene.replace(**{change.parameter: change.after})
    assert source is not None
    return source.file.replaced({change.parameter: change.after})


def rounded(value: float, digits: int, towards: Callable[[float], int]) -> str:
    """A limit in so many digits, rounded by `towards` (math.floor or math.ceil).

    >>> rounded(0.30322, 4, math.floor), rounded(0.245226, 2, math.ceil), rounded(0.0, 4, math.ceil)
    ('0.3032', '0.25', '0')
    """
    if value == 0.0:
        return "0"
    unit = 10.0 ** (math.floor(math.log10(abs(value))) + 1 - digits)
    return number(towards(value / unit) * unit, digits)
