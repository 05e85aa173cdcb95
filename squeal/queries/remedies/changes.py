"""A change of a brake, and what it does: up to where nothing grows, what follows, what it costs.

A change of one parameter is counted in steps of 1 % or of one degree.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from squeal.io.writing import number
from squeal.linear import GROWING
from squeal.linear.roots import ComplexArray
from squeal.linear.shaft import name_of_kind
from squeal.queries.eigenvalues import eigenvalues
from squeal.queries.options import Subject
from squeal.queries.parameter_space import first_loss
from squeal.queries.thresholds import thresholds
from squeal.results.eigenvalues import Eigenvalues
from squeal.results.sensitivity import DEGREE
from squeal.results.sources import PadSource, SystemSource, unit_of
from squeal.results.thresholds import Thresholds

MOST_STEPS = 25  # of 1 % or a degree: the largest change that is looked at first
WIDE_STEPS = (35, 50, 75, 150, 200, 300)  # that are looked at where no smaller one stops all
TO_A_QUARTER = 75  # percent: less is left of a part that might as well be taken out
QUARTER_TURN = 90  # degrees: no angle is turned by more
RETRIES = 4  # sizes of a change that the full system is asked to confirm, each larger
IN_HAND = 1.1  # times the free parameter's value: up to there nothing is to grow
NOTHING = 1e-9  # of |lambda|, and of a share: rounding


@dataclass(frozen=True)
class Change:
    """A parameter before and after a change: after = before + count * step.

    Attributes
    ----------
    parameter : str
        Its name.
    before : float
        Its value without the change, of an angle in rad.
    step : float
        What one step adds to the value: 1 % of it, one degree in rad, or 1 where the value is 0.
    unit : str
        What steps are counted in: "%", "degrees", or empty where the value is 0.
    count : float
        How many steps; negative where the value is lowered.
    value_unit : str
        The unit of the value, empty of an angle.
    """

    parameter: str
    before: float
    step: float
    unit: str
    count: float
    value_unit: str = ""

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
        unit = f" {self.value_unit}".rstrip()
        return f"from {number(self.before, 5)} to {number(self.after, 5)}{unit}"

    @property
    def most(self) -> int:
        """The largest number of steps, up or down as this change goes, that is looked at."""
        if self.unit == "degrees":
            return QUARTER_TURN
        is_lowered_share = self.count < 0.0 and self.unit == "%"
        return TO_A_QUARTER if is_lowered_share else WIDE_STEPS[-1]

    def of(self, count: float) -> Change:
        """The change of the same parameter by so many steps."""
        return replace(self, count=count)

    def times(self, factor: float) -> Change:
        """The change by so many times as many steps."""
        return self.of(factor * self.count)


class Loss(NamedTuple):
    """Where stability is first lost with a change, over the free parameter.

    value: of the free parameter, None where nothing grows up to `high`; kind: what is lost there;
    frequency_hz: of the mode that grows from there on, None if it does not vibrate; extent: of
    which roots that was searched, in words, empty of all.
    """

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


@dataclass(frozen=True, eq=False)
class Effect:
    """What a change does at a value of the free parameter, and beyond.

    Attributes
    ----------
    before : Eigenvalues
        Without the change, at the present value of the free parameter.
    value : float
        Of the free parameter, at which `roots` are: the present one, but of a change of the free
        parameter itself the changed one.
    roots : array (m,)
        Those of the selection with the change, rad/s.
    loss : Loss or None
        Where stability is first lost with the change; None where modes grow with it, and where the
        matrices do not depend on the free parameter.
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
    def grows_below(self) -> bool:
        """Whether something grows at a smaller value of the free parameter."""
        return self.loss is not None and self.limit <= self.value

    @property
    def in_hand(self) -> str:
        """By how many % the free parameter may rise until something grows, rounded down; a dash
        where that is not known, or where something grows at less."""
        if self.loss is None or self.grows_below or self.value <= 0.0:
            return "-"
        share = min(self.limit, self.loss.high) / self.value - 1.0
        percent = math.floor(100.0 * share + NOTHING)  # 10 of 1.1, whatever rounding makes of it
        if math.isinf(self.limit):  # nothing grows up to the end of the search
            return f"over {percent}"
        return str(percent)

    @property
    def damping_left(self) -> float:
        """The least damping ratio of the modes that vibrate with the change; NaN without one."""
        vibrating = self.roots[self.roots.imag > 0.0]
        ratios = -vibrating.real / np.abs(vibrating) + 0.0  # no negative zero
        return float(ratios.min(initial=np.inf)) if len(ratios) else math.nan

    @property
    def shift_hz(self) -> float:
        """The farthest that the change moves a frequency, Hz, if all move as little as they can.

        NaN where there are more or fewer than before, as in a band that a mode leaves.
        """
        frequencies = []
        for roots in (self.before.values, self.roots):
            frequencies.append(np.sort(roots.imag[roots.imag > 0.0]) / math.tau)
        before, after = frequencies
        if len(before) != len(after):
            return math.nan
        # of all ways to pair them the one in rising order has the least largest distance
        return float(np.max(np.abs(after - before), initial=0.0))

    def words(self, first_cost: str = "") -> str:
        """Up to where nothing grows with the change, what follows, and what it costs.

        first_cost: a cost that is named before the others, in words.
        """
        costs = [first_cost] if first_cost else []
        costs += self._costs()
        text = self._what_stops()
        return f"{text}; {', '.join(costs)}" if costs else text

    def _what_stops(self) -> str:
        """That nothing grows, of which roots, and at which values of the free parameter."""
        text = "nothing grows"
        extent = self.before.extent if self.loss is None else self.loss.extent
        if extent:  # modes that leave it may grow
            text = f"nothing from {extent} grows"
        if self.loss is None:
            return text
        parameter = self.before.parameter
        if not self.grows_below:
            return f"{text} {self.loss.words(parameter, unit_of(self.before.source))}"
        text += f" at {parameter} = {number(self.value, 4)}; below, stability is lost"
        return f"{text} from {parameter} = {rounded(self.limit, 4, math.floor)} on"

    def _costs(self) -> Iterator[str]:
        """The least damping left, and how far frequencies move."""
        is_undamped = np.abs(self.roots.real) <= NOTHING * np.abs(self.roots)
        if len(self.roots) and is_undamped.all():
            yield "nothing damps this model"
        elif not math.isnan(self.damping_left):
            yield f"the least damping left is {number(100.0 * self.damping_left, 2)} %"
        if self.shift_hz > 0.0:  # false of NaN
            yield f"frequencies move by up to {number(self.shift_hz, 3)} Hz"


@dataclass(frozen=True, eq=False)
class Brake:
    """A brake as it is, and how the answers about it with a change are computed.

    Attributes
    ----------
    spectrum : Eigenvalues
        At the present value of the free parameter.
    losses : Thresholds
        Over the free parameter.
    high : float
        Upper end of the range of the free parameter in which losses of stability are searched.
    options : mapping
        With which `spectrum` and `losses` were computed: band, memory and progress, by name.
    """

    spectrum: Eigenvalues
    losses: Thresholds
    high: float
    options: Mapping[str, object]

    @property
    def present(self) -> float:
        """The present value of the free parameter."""
        return self.spectrum.value

    @cached_property
    def _options_of_losses(self) -> Mapping[str, object]:
        """The options of `thresholds` for the brake with a change.

        Those of a pad are `options`. Of a system the search begins where that without the change
        began. The band is left out if all roots are known and none outside of the band grows
        anywhere in the range, which holds the present value: then a mode that a change moves out of
        the band, and lets grow there, is seen. The thresholds of complex matrices are searched in
        bands alone.
        """
        losses = self.losses
        source = losses.source
        if not isinstance(source, SystemSource):
            return self.options
        of_range = {**self.options, "low": losses.low}
        is_in_range = losses.low <= self.present <= losses.high
        nothing_crosses = losses.details.get("crossings_outside") == 0  # None: some are unknown
        nothing_grows = not self.spectrum.details.get("growing_outside")
        if source.file.system.real and is_in_range and nothing_crosses and nothing_grows:
            return {**of_range, "band": None}
        return of_range

    def changed_by(self, change: Change) -> Subject:
        """The scene, or the file of a system, with a changed parameter."""
        source = self.spectrum.source
        if isinstance(source, PadSource):
            return source.scene.replace(**{change.parameter: change.after})
        assert source is not None
        return source.file.replaced({change.parameter: change.after})

    def eigenvalues_of(self, changed: Subject, prove: bool | None = False) -> Eigenvalues:
        """The eigenvalues of the brake with a change."""
        return eigenvalues(changed, prove=prove, **self.options)  # type: ignore[arg-type]

    def thresholds_of(self, changed: Subject, high: float) -> Thresholds:
        """The thresholds up to `high` of the brake with a change."""
        return thresholds(changed, high, prove=False, **self._options_of_losses)  # type: ignore[arg-type]

    def selected_roots(
        self, searched: Thresholds | None, changed: Subject, value: float
    ) -> ComplexArray:
        """The roots of the selection (m,), rad/s, of the brake with a change.

        Parameters
        ----------
        searched : Thresholds or None
            Of the changed brake. Where they were searched on a reduced system, the roots are those
            of the reduced system, else those of `changed`.
        changed : Scene, SystemFile or TermSystem
            The changed brake, its free parameter at `value`.
        value : float
            Of the free parameter.
        """
        source = None if searched is None else searched.source
        if not isinstance(source, SystemSource) or source.reduction is None:
            return self.eigenvalues_of(changed).values
        from squeal.queries.systems.reduced import roots_of_reduction

        return roots_of_reduction(source.reduction, {self.spectrum.parameter: value}).values


def loss_of(answer: Thresholds, high: float) -> Loss:
    """Where stability is first lost, by thresholds that were searched up to `high`."""
    outcome = first_loss(answer, high)
    extent = ""
    if isinstance(answer.source, SystemSource) and answer.source.selection.band is not None:
        extent = answer.source.selection.words()
    return Loss(outcome.critical, outcome.kind or "", outcome.frequency_hz, high, extent)


def growing_within(answer: Thresholds, end: float) -> list[float]:
    """One value of each interval of the free parameter below `end` in which something grows.

    It is the middle between a loss of stability and the next threshold, or `end` if that comes
    first; and the lower end of the range of the thresholds if something grows there.
    """
    values = []
    if answer.verdict in GROWING:
        values.append(answer.low)
    for point in answer.points:
        if point.kind in GROWING and point.mu < end:
            above = [other.mu for other in answer.points if other.mu > point.mu]
            interval_end = min([*above, end])
            values.append((point.mu + interval_end) / 2.0)
    return values


def rounded_up(change: Change | None) -> Iterator[Change]:
    """The change with its number of steps rounded up to two digits, then three larger ones.

    The larger ones have 1, 3 and 6 units of the second digit more: of 12.3 steps these are 13, 14,
    16 and 19. None has more than `change.most` steps. Nothing is yielded of None.
    """
    if change is None:
        return
    count = abs(change.count)
    unit = 10.0 ** (math.floor(math.log10(count)) - 1)  # of the second digit
    digits = math.ceil(count / unit * (1.0 - 1e-12))  # 25 of 25, whatever rounding makes of it
    for retry in range(RETRIES):
        larger = retry * (retry + 1) // 2  # 0, 1, 3, 6
        # through text, since 12 times 0.1 is 1.2000000000000002 by rounding
        rounded_count = float(number((digits + larger) * unit, 3))
        if rounded_count <= change.most:
            yield change.of(math.copysign(rounded_count, change.count))


def rounded(value: float, digits: int, towards: Callable[[float], int]) -> str:
    """A limit in so many digits, rounded by `towards` (math.floor or math.ceil).

    >>> rounded(0.30322, 4, math.floor), rounded(0.245226, 2, math.ceil), rounded(0.0, 4, math.ceil)
    ('0.3032', '0.25', '0')
    """
    if value == 0.0:
        return "0"
    unit = 10.0 ** (math.floor(math.log10(abs(value))) + 1 - digits)
    return number(towards(value / unit) * unit, digits)
