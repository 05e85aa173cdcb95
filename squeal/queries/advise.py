"""The verb `advise`: parameters varied one at a time, and what moves the critical friction."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from operator import attrgetter, itemgetter
from typing import Any

from squeal.equilibrium import sliding_equilibrium
from squeal.io.scene import Scene
from squeal.io.writing import Answer, Column, Mark, Panel, Table, columns, copied_attributes, number
from squeal.linear import GROWING
from squeal.linear.system import TermSystem
from squeal.queries.options import Band, Progress, refuse_options, upper_end
from squeal.queries.parameter_space import (
    NO_PAD,
    ROUNDING,
    Outcome,
    ParameterSpace,
    first_loss,
    outcome_at,
)
from squeal.queries.thresholds import thresholds
from squeal.results.columns import parameter_entry
from squeal.results.thresholds import Thresholds
from squeal.schema import Place, Positive, public

STEP = 0.02  # of a parameter, in rad of an angle
SIDES = {"lowered": "lowering", "raised": "raising"}  # what is done to a parameter, and the action


@dataclass(frozen=True)
class ParameterEffect:
    """A parameter that is lowered and raised by `step` (in its unit), and both outcomes."""

    parameter: str
    unit: str
    value: float
    step: float
    lowered: Outcome
    raised: Outcome

    @property
    def changes(self) -> tuple[float | None, float | None]:
        """How far the critical friction moves when the parameter is lowered, and raised."""
        return self.lowered.change, self.raised.change


@dataclass(frozen=True, eq=False, repr=False)
class Advice(Answer):
    """How each parameter moves the critical friction within 0 to mu_max.

    Attributes
    ----------
    name : str
        The friction or free parameter.
    mu : float
        Its value in the subject itself.
    nominal : Outcome
        The critical friction with no parameter changed.
    levers : tuple of ParameterEffect
        The parameters, that of the strongest effect first. Where there is no threshold in the
        range, those come first that bring one into it.
    first_order : bool
        Whether the effects are derivatives times the change, as those of systems are.
    notes : tuple of str
        Which parameters are left out since they move the seat of contact, in words.

    Examples
    --------
    >>> import squeal
    >>> K = {"a": [[1, 0], [0, 0]], "b": [[0, 0], [0, 1]], "mu": [[0, 1], [-1, 0]]}
    >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"a": 3.0, "b": 2.0})
    >>> [row["parameter"] for row in squeal.advise(pair).to_records()]
    ['a', 'b']
    """

    panel = Panel("parameter", "change_raised", Mark.BARS)

    name: str
    mu: float
    mu_max: float
    nominal: Outcome
    levers: tuple[ParameterEffect, ...]
    first_order: bool
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def changes(self) -> list[tuple[float, ParameterEffect, str]]:
        """Each change of the critical friction with its parameter and "lowering" or "raising".

        By rising change: the most helpful one comes last.
        """
        changes = []
        for lever in self.levers:
            for action, change in zip(SIDES.values(), lever.changes, strict=True):
                if change:  # neither unknown nor 0
                    changes.append((change, lever, action))
        return sorted(changes, key=itemgetter(0))

    def table(self) -> Table:
        table = list(columns("parameter unit value step"))
        for side in SIDES:
            table.append(self._column_of_critical(side))
        for side in SIDES:
            table.append(Column(f"change_{side}", value=attrgetter(f"{side}.change")))
        title = f"what moves the onset in {self.name} (not growth beyond it), each parameter alone"
        return Table(table, self.levers, f"{title}, strongest first")

    def _column_of_critical(self, side: str) -> Column:
        """The column of critical frictions with the parameter "lowered" or "raised"."""

        def shown(lever: ParameterEffect) -> str:
            outcome: Outcome = getattr(lever, side)
            if outcome.critical is not None:
                return number(outcome.critical)
            if outcome.kind == NO_PAD:
                return "no such pad"
            return "unknown" if outcome.reason else f"> {self.mu_max:g}"

        return Column(
            name=f"critical_{side}",
            value=attrgetter(f"{side}.critical"),
            shown=shown,
            words=f"{self.name} if {side}",
        )

    def line(self) -> str:
        """Where stability is lost, and the changes that move this up and down most, in a line.

        Examples
        --------
        >>> import squeal
        >>> K = {"a": [[1, 0], [0, 0]], "b": [[0, 0], [0, 1]], "mu": [[0, 1], [-1, 0]]}
        >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"a": 3.0, "b": 2.0})
        >>> squeal.advise(pair).line().partition(";")[0]  # flutter from (a - b) / 2 on
        'flutter from mu = 0.5 (own 0)'
        """
        text = f"no threshold up to {self.name} = {self.mu_max:.3g}"
        if self.nominal.critical is not None:
            onset = f"{self.name} = {self.nominal.critical:.3g} (own {self.mu:.3g})"
            text = f"{self.nominal.kind} from {onset}"
        changes = self.changes
        if changes:
            change, lever, action = changes[-1]
            if change > 0.0:
                text += f"; best: {action} {lever.parameter} ({self.name} {change:+.2g})"
            change, lever, action = changes[0]
            if change < 0.0:
                text += f"; worst: {action} {lever.parameter} ({self.name} {change:+.2g})"
        if self.first_order and changes:
            text += "; to first order in the change (`squeal thresholds --set` computes one)"
        return text

    def parts(self) -> Sequence[str | Table]:
        return [self.table(), "\n".join([self.line(), *self.notes])]

    def to_dict(self) -> dict[str, Any]:
        entry = parameter_entry(self.name, self.mu)
        entry["mu_max"] = self.mu_max
        entry |= copied_attributes(self.nominal, "critical kind frequency_hz")
        entry["levers"] = [asdict(lever) for lever in self.levers]
        entry["advice"] = self.line()
        return entry


@public
def advise(
    subject: object,
    tolerances: Mapping[str, float | str] | None = None,
    high: Positive | None = None,
    band: Band | None = None,
    memory: Positive | None = None,
    progress: Progress | None = None,
) -> Advice:
    """Compute how the critical friction changes when each parameter is lowered and raised.

    Of a scene the critical friction is computed again. Of a system all crossings of the imaginary
    axis move by their exact derivatives, and the first of the moved crossings decides, which holds
    to first order in the change.

    Parameters
    ----------
    subject : Scene or TermSystem
        A scene, or a system with named parameters, of any size.
    band, memory, progress
        As `thresholds` takes them, of systems. A system of more than 400 rows needs a band.
    tolerances : mapping of str to float or str, optional
        By how much a parameter changes, in its unit or as a share such as "5%". Left out, it
        changes by 2 per cent, an angle by 0.02 rad, and a parameter that is 0 not at all.
    high : float, optional
        Upper end of the range that is searched for the threshold, as `thresholds` takes it.

    Returns
    -------
    Advice
        Each parameter with the outcomes if it is lowered and raised, the strongest effect first.

    Raises
    ------
    InputError
        For a name that is no parameter, a change that is none of the allowed, or an option that
        scenes do not take.
    ComputationError
        If the pad as it is has no equilibrium without friction, or several modes of a system cross
        the imaginary axis at once.

    Examples
    --------
    >>> import squeal
    >>> K = {"a": [[1, 0], [0, 0]], "b": [[0, 0], [0, 1]], "mu": [[0, 1], [-1, 0]]}
    >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"a": 3.0, "b": 2.0})
    >>> change, lever, word = squeal.advise(pair).changes[-1]  # flutter from (a - b) / 2 on
    >>> lever.parameter, word, round(change, 9)
    ('a', 'raising', 0.03)
    """
    high = upper_end(subject, high)
    space = ParameterSpace.of(subject, "advise", high)
    unchanged = space.subject
    notes: list[str] = []
    if isinstance(unchanged, TermSystem):
        space, notes = _without_seat_parameters(space, subject)
    else:
        refuse_options("a scene", band=band, memory=memory)
    steps = _steps(space, tolerances or {})
    # two for each parameter: its lowered value and then its raised one
    changed_values = []
    for name, step in steps.items():
        value = space.values[name]
        changed_values += [{name: value - step}, {name: value + step}]
    warnings: tuple[str, ...] = ()
    if isinstance(unchanged, TermSystem):
        answer = thresholds(unchanged, high, band=band, memory=memory, progress=progress)
        nominal = first_loss(answer, high)
        outcomes = _first_order_outcomes(unchanged, answer, nominal, changed_values, high)
    else:
        nominal = first_loss(thresholds(unchanged, high), high)
        outcomes = space.outcomes(changed_values, high)
        warnings = _warnings_of_equilibrium(unchanged)
    return Advice(
        name=space.free,
        mu=space.at,
        mu_max=high,
        nominal=nominal,
        levers=tuple(_effects(space, steps, outcomes, nominal, high)),
        first_order=isinstance(unchanged, TermSystem),
        warnings=warnings,
        notes=tuple(notes),
    )


def _without_seat_parameters(
    space: ParameterSpace, subject: object
) -> tuple[ParameterSpace, list[str]]:
    """The parameters of a system that do not move its contact, and notes that name the others.

    The derivatives are taken with the contact held at its seat, the static contact solution. They
    do not hold the effect of a parameter that moves the seat.
    """
    from squeal.queries.systems.seat import notes_of_seat, seat_parameters  # no pad needs it
    from squeal.queries.systems.system_analysis import file_of

    file = file_of(subject)
    values = dict(space.values)
    for name in seat_parameters(file):
        values.pop(name, None)
    return replace(space, values=values), notes_of_seat(file)


def _effects(
    space: ParameterSpace,
    steps: Mapping[str, float],
    outcomes: Sequence[Outcome],
    nominal: Outcome,
    high: float,
) -> list[ParameterEffect]:
    """The effect of each parameter that is changed by its step, the strongest first.

    steps: by how much each parameter is changed, in its unit; outcomes: two for each parameter in
    this order, lowered and raised; nominal: that with no parameter changed; high: upper end of the
    range of the friction.
    """
    effects = []
    for name, lowered, raised in zip(steps, outcomes[::2], outcomes[1::2], strict=True):
        value = space.values[name]
        step = steps[name]
        change_lowered = _change_of_critical(nominal, lowered, high)
        change_raised = _change_of_critical(nominal, raised, high)
        effect = ParameterEffect(
            parameter=name,
            unit=space.units[name],
            value=value,
            step=step,
            lowered=replace(lowered, value=value - step, change=change_lowered),
            raised=replace(raised, value=value + step, change=change_raised),
        )
        effects.append(effect)
    return sorted(effects, key=_largest_change, reverse=True)


def _largest_change(lever: ParameterEffect) -> float:
    """The larger of both changes of the critical friction, by size; 0 where none is known."""
    return max(abs(change or 0.0) for change in lever.changes)


def _warnings_of_equilibrium(scene: Scene) -> tuple[str, ...]:
    """The reasons why the model does not hold at the scene's own sliding equilibrium.

    Model B3 is linear: it is linearised about the origin and has no equilibrium to be judged.
    """
    if scene.pad_model.linear:
        return ()
    equilibrium, _ = sliding_equilibrium(scene.pad_model)
    return () if equilibrium is None else equilibrium.warnings


def _first_order_outcomes(
    system: TermSystem,
    answer: Thresholds,
    nominal: Outcome,
    changed_values: Sequence[Mapping[str, float]],
    high: float,
) -> list[Outcome]:
    """The critical friction of a system after each change of one parameter, to first order.

    Each crossing at which a mode begins to grow moves by its derivative times the change, and the
    first of the moved crossings is the new threshold.

    Parameters
    ----------
    system : TermSystem
        The unchanged system.
    answer, nominal
        Its thresholds, and the first of them.
    changed_values : sequence of mapping
        Each holds one parameter and its new value.
    high : float
        Upper end of the range of the free parameter.

    Returns
    -------
    list of Outcome
        One for each change. All are the nominal one where a mode grows at the lower end of the
        range, since its crossing lies below, or where no mode begins to grow within the range.
    """
    rising = [crossing for crossing in answer.crossings if crossing.direction == "up"]
    if answer.verdict in GROWING or not rising:
        return [nominal] * len(changed_values)
    from squeal.queries.systems.sensitivity import threshold_slopes  # no pad needs it

    # of each crossing a mapping: by parameter the derivatives of its mu and of its frequency in Hz
    slopes = threshold_slopes(system, [(crossing.mu, crossing.frequency_hz) for crossing in rising])
    outcomes = []
    for changed_value in changed_values:
        ((name, value),) = changed_value.items()
        step = value - system.parameters[name]
        moved = []  # the crossings after the change: mu, kind and frequency
        for crossing, slopes_of_crossing in zip(rising, slopes, strict=True):
            slope_of_mu, slope_of_hertz = slopes_of_crossing[name]
            mu = crossing.mu + step * slope_of_mu
            hertz = crossing.frequency_hz + step * slope_of_hertz
            moved.append((mu, crossing.kind, hertz))
        mu, kind, hertz = min(moved)
        outcome = Outcome()  # no threshold in the range
        if mu <= high:
            outcome = outcome_at(mu, kind, hertz)
        outcomes.append(outcome)
    return outcomes


def _steps(space: ParameterSpace, tolerances: Mapping[str, float | str]) -> dict[str, float]:
    """By how much each parameter is lowered and raised, in its unit: its tolerance, else `STEP`.

    A parameter that is 0 and has no tolerance does not change. Raises InputError.
    """
    sizes: dict[str, float | str] = {}
    for name, value in space.values.items():
        if value:
            sizes[name] = STEP if space.units[name] == "rad" else f"{100 * STEP}%"
    sizes |= tolerances
    return {name: _in_unit(space, name, size) for name, size in sizes.items()}


def _in_unit(space: ParameterSpace, name: str, size: float | str) -> float:
    """A tolerance in the parameter's unit, from a number in that unit or a share such as "5%".

    Raises InputError for a size that is no finite number above 0, for a name that is no parameter,
    and for a share of an angle or of a parameter that is 0.
    """
    at = Place(f"tolerance {name}={size}")
    text = str(size)
    try:
        value = float(text.removesuffix("%"))
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        allowed = "a finite number above 0, in the parameter's unit or as a share such as 5%"
        raise at.refuse(f"it must be {allowed}")
    if text.endswith("%"):
        return space.step(name, value / 100, is_share=True, at=at)
    return space.step(name, value, is_share=False, at=at)


def _change_of_critical(nominal: Outcome, outcome: Outcome, high: float) -> float | None:
    """By how much the critical friction moved from its nominal value; None if it is unknown.

    Where no threshold lies in the range the critical friction counts as its upper end `high`, so
    that the change is a lower bound. A difference within rounding is no change.
    """
    if outcome.reason is not None:
        return None
    before = high if nominal.critical is None else nominal.critical
    after = high if outcome.critical is None else outcome.critical
    if abs(after - before) <= ROUNDING * before:
        return 0.0
    return after - before
