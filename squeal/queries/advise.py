"""The verb `advise`: parameters varied one at a time, and what moves the critical friction.

Variations of a pad are followed together as a stack over values of friction, not by the
certified search of a query: a window of growth narrower than a step may be missed. One that a stack
cannot decide is a query of its own, which decides it or says why it cannot.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from operator import attrgetter, itemgetter
from typing import Any

import numpy as np

from squeal.equilibrium import sliding_equilibrium
from squeal.errors import ComputationError, InputError
from squeal.io.scene import Scene
from squeal.io.writing import Answer, Column, Mark, Panel, Table, columns, number, picked, unit_word
from squeal.linear import GROWING
from squeal.linear.system import TermSystem
from squeal.model.pad import PARAMETERS
from squeal.queries.options import Progress
from squeal.queries.pads.stack import PadStack, parameters
from squeal.queries.thresholds import MU_MAX, thresholds
from squeal.results.columns import parameter_entry
from squeal.results.thresholds import Thresholds
from squeal.schema import Place, Positive, public

ROUNDING = 1e-11  # relative: what a query and a stack may differ by
AT_ONCE = 1e-9  # friction: what grows from here on grows from the start
STEP = 0.02  # of a parameter, in rad of an angle
SIDES = {"lowered": "lowering", "raised": "raising"}
NO_PAD = "no pad"
NO_REST = "there is no equilibrium in contact without friction"


@dataclass(frozen=True)
class Outcome:
    """What becomes of a pad with a parameter changed to `value`.

    critical: the friction up to which it slides steadily and stably, None if no threshold lies in
    the range; kind, frequency_hz: of what happens there; change: of the critical friction, at least
    so much where it leaves the range. reason: why nothing is known; kind is then `NO_PAD` where
    there is no such pad, or it rests nowhere without friction.
    """

    value: float | None = None
    critical: float | None = None
    kind: str | None = None
    frequency_hz: float | None = None
    reason: str | None = None
    change: float | None = None


def _lost(mu: float, kind: str, hertz: float = math.nan) -> Outcome:
    """Stability that is lost at mu, NaN if nowhere; at once it has no frequency of its own."""
    if math.isnan(mu):
        return Outcome()
    if mu <= AT_ONCE:
        return Outcome(critical=0.0, kind=kind)
    return Outcome(None, float(mu), kind, None if math.isnan(hertz) else float(hertz))


def critical(subject: Any, high: float, band: tuple[float, float] | None = None) -> Outcome:
    """What a query says of the critical friction up to `high`. Raises what it raises."""
    return first_loss(thresholds(subject, high, band=band), high)


def first_loss(answer: Thresholds, high: float) -> Outcome:
    """Where stability is lost, or the branch ends below `high`."""
    if answer.verdict in GROWING:
        return _lost(0.0, answer.verdict)
    if answer.first is not None:
        return _lost(answer.first.mu, answer.first.kind, answer.first.frequency_hz)
    return _lost(answer.high if answer.high < high else math.nan, "end of the branch")


@dataclass(frozen=True, eq=False)
class ParameterSpace:
    """A scene or system with the parameters that its critical friction depends on, in SI units.

    free, at: name and own value of the friction or free parameter, which is none of them.
    """

    subject: Scene | TermSystem
    free: str
    at: float
    values: dict[str, float]
    units: dict[str, str]

    @staticmethod
    def of(argument: object, verb: str, high: float, what: str = "threshold") -> ParameterSpace:
        """What may be varied for thresholds or growth. Raises InputError naming the verb."""
        subject: Any = getattr(argument, "system", argument)  # of a system file
        at = Place(verb)
        if isinstance(subject, Scene):
            MU_MAX.read(high, at / "mu_max")
            free = "mu"
            own = subject.pad.mu
            values = picked(subject.pad, " ".join(parameters(subject.pad_model)))
            units = {name: unit_word(PARAMETERS[name].unit) for name in values}
        elif isinstance(subject, TermSystem):
            free = subject.parameter
            values = subject.given
            own = float(values[free])
            units = dict.fromkeys(values, "")
        else:
            allowed = "it must be a Scene or a system with named parameters"
            raise at.refuse(f"{type(subject).__name__} is not allowed; {allowed}")
        if what == "threshold":
            values.pop(free, None)
        if not values:
            words = "it must have one under its key parameters"
            raise at.refuse(f"{subject.name} has no named parameter but {free}; {words}")
        return ParameterSpace(subject, free, own, values, units)

    def step(self, name: str, size: float, share: bool, at: Place) -> float:
        """A share of a parameter's value, or a number in its unit, as a change in its unit.

        Raises InputError for what is no parameter, and for a share of an angle or of zero.
        """
        if name not in self.values:
            why = "is no parameter here"
            if name == self.free:
                why = "is varied to find its threshold, and scatters with --of growth alone"
            raise at.refuse(f"{name} {why}; allowed are {', '.join(self.values)}")
        if share and self.units[name] == "rad":
            raise at.refuse(f"{name} is an angle and has no share; it must be given in rad")
        if share and not self.values[name]:
            raise at.refuse(f"{name} is 0 and has no share; it must be given in its unit")
        return size * abs(self.values[name]) if share else size

    def outcomes(
        self,
        changes: Sequence[dict[str, float]],
        high: float,
        band: tuple[float, float] | None = None,
    ) -> list[Outcome]:
        """What becomes of the subject with each change of some parameters."""
        subject: Any = self.subject
        outcomes: dict[int, Outcome] = {}
        changed: dict[int, Any] = {}
        for i, values in enumerate(changes):
            try:
                if isinstance(subject, Scene):
                    changed[i] = subject.replace(**values)
                else:
                    changed[i] = subject.replace(values)
            except InputError as error:
                outcomes[i] = Outcome(kind=NO_PAD, reason=str(error))
        if isinstance(subject, Scene) and changed:
            outcomes |= self._outcomes_of_pads(subject, changed, high)
        for i in changed.keys() - outcomes:
            try:
                outcomes[i] = critical(changed[i], high, band)
            except (InputError, ComputationError) as error:
                outcomes[i] = Outcome(reason=str(error))
        return [outcomes[i] for i in range(len(changes))]

    def _outcomes_of_pads(
        self, scene: Scene, changed: Mapping[int, Scene], high: float
    ) -> dict[int, Outcome]:
        """What a stack of pads says of changed scenes, by their numbers, as far as it can."""
        names = tuple(self.values)  # all of them: some may follow others
        rows = [[getattr(one.pad, name) for one in changed.values()] for name in names]
        try:
            losses = PadStack.of(scene, names, np.array(rows)).first_losses(high)
        except ComputationError:  # for one of them; each says why
            return {}
        outcomes = {}
        for k, i in enumerate(changed):
            if losses.unknown[k]:
                continue
            if losses.nowhere[k]:
                outcomes[i] = Outcome(kind=NO_PAD, reason=NO_REST)
            else:
                outcomes[i] = _lost(losses.mu[k], losses.kinds[k], losses.hertz[k])
        return outcomes


def _predicted(
    system: TermSystem, changes: Sequence[dict[str, float]], high: float, **asked: Any
) -> tuple[Outcome, list[Outcome]]:
    """The loss of a system, and what becomes of it with each change of a parameter, to first order:
    each crossing of the axis moves by its derivative, and the first one decides."""
    answer = thresholds(system, high, **asked)
    nominal = first_loss(answer, high)
    rising = [crossing for crossing in answer.crossings if crossing.direction == "up"]
    if answer.verdict in GROWING or not rising:
        return nominal, [nominal] * len(changes)
    from squeal.queries.systems.sensitivity import threshold_slopes  # no pad needs it

    slopes = threshold_slopes(system, [(c.mu, c.frequency_hz) for c in rising])
    outcomes = []
    for change in changes:
        ((name, value),) = change.items()
        step = value - system.parameters[name]
        moved = []
        for crossing, slopes_of_crossing in zip(rising, slopes, strict=True):
            by_mu, by_hertz = slopes_of_crossing[name]
            mu = crossing.mu + step * by_mu
            moved.append((mu, crossing.kind, crossing.frequency_hz + step * by_hertz))
        first = min(moved)
        outcomes.append(_lost(*first) if first[0] <= high else Outcome())
    return nominal, outcomes


@dataclass(frozen=True)
class ParameterEffect:
    """A parameter lowered and raised by `step` (its unit), and what the pad gives then."""

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
    """Levers by effect, the strongest first, on the critical friction in 0 to mu_max.

    name: of the free parameter; nominal: the pad as it is. Where that has no threshold in the
    range, levers that bring one into it come first. first_order: whether derivatives moved it.

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

    @property
    def changes(self) -> list[tuple[float, ParameterEffect, str]]:
        """How each change moves the critical friction, by its effect, the most helpful last."""
        changes = []
        for lever in self.levers:
            for word, change in zip(SIDES.values(), lever.changes, strict=True):
                if change:
                    changes.append((change, lever, word))
        return sorted(changes, key=itemgetter(0))

    def table(self) -> Table:
        def shown(outcome: Outcome) -> str:
            known = "no such pad" if outcome.reason else f"> {self.mu_max:g}"
            return known if outcome.critical is None else number(outcome.critical)

        table = list(columns("parameter unit value step"))
        for side in SIDES:
            value, cell = attrgetter(f"{side}.critical"), lambda one, k=side: shown(getattr(one, k))
            words = f"{self.name} if {side}"
            table.append(Column(f"critical_{side}", "", value, cell, words=words))
        table += [Column(f"change_{k}", value=attrgetter(f"{k}.change")) for k in SIDES]
        title = f"what moves the onset in {self.name} (not growth beyond it), each parameter alone"
        return Table(table, self.levers, f"{title}, strongest first")

    def line(self) -> str:
        """Where stability is lost, and the change that moves this most, in a line.

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
            at = f"{self.name} = {self.nominal.critical:.3g} (own {self.mu:.3g})"
            text = f"{self.nominal.kind} from {at}"
        changes = self.changes
        if changes:
            change, lever, word = changes[-1]
            if change > 0.0:
                text += f"; best: {word} {lever.parameter} ({self.name} {change:+.2g})"
            change, lever, word = changes[0]
            if change < 0.0:
                text += f"; worst: {word} {lever.parameter} ({self.name} {change:+.2g})"
        if self.first_order:
            text += "; to first order in the change"
        return text

    def parts(self) -> Sequence[str | Table]:
        return [self.table(), self.line()]

    def to_dict(self) -> dict[str, Any]:
        head = {**parameter_entry(self.name, self.mu), "mu_max": self.mu_max}
        head |= picked(self.nominal, "critical kind frequency_hz")
        return head | {"levers": [asdict(one) for one in self.levers], "advice": self.line()}


@public
def advise(
    subject: object,
    tolerances: Mapping[str, float | str] | None = None,
    mu_max: Positive = 2.0,
    band: tuple[float, float] | None = None,
    memory: Positive | None = None,
    progress: Progress | None = None,
) -> Advice:
    """Lower and raise each parameter by its tolerance: what becomes of the critical friction.

    Of a scene it is computed again. Of a system all crossings of the imaginary axis move by their
    exact derivatives, and the first of them decides: that holds to first order.

    Parameters
    ----------
    subject : Scene or TermSystem
        A scene, or a system with named parameters, of any size.
    band, memory, progress
        As `thresholds` takes them, of systems. One of more than 400 rows needs a band.
    tolerances : mapping of str to float or str, optional
        In the parameter's unit, or a share of its value such as "5%". Left out, a parameter
        changes by 2 per cent, an angle by 0.02 rad, and what is 0 stays.
    mu_max : float
        Upper end of the range that is searched for the critical friction.

    Returns
    -------
    Advice
        The parameters with what became of the pad, the strongest first.

    Raises
    ------
    InputError
        For a name that is no parameter.
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
    varied = ParameterSpace.of(subject, "advise", mu_max)
    subject_varied = varied.subject
    steps = _steps(varied, tolerances or {})
    changes = []
    for name, step in steps.items():
        changes.append({name: varied.values[name] - step})
        changes.append({name: varied.values[name] + step})
    if isinstance(subject_varied, TermSystem):
        nominal, outcomes = _predicted(
            subject_varied, changes, mu_max, band=band, memory=memory, progress=progress
        )
    elif band is not None:
        raise Place("advise").refuse("band: is not allowed with a scene; a system takes it")
    else:
        nominal = critical(subject_varied, mu_max)
        outcomes = varied.outcomes(changes, mu_max)
    sides = []
    for outcome, change in zip(outcomes, changes, strict=True):
        (value,) = change.values()
        moved = _change(nominal, outcome, mu_max)
        sides.append(replace(outcome, value=value, change=moved))
    levers = [
        ParameterEffect(
            parameter=name,
            unit=varied.units[name],
            value=varied.values[name],
            step=step,
            lowered=lowered,
            raised=raised,
        )
        for (name, step), lowered, raised in zip(
            steps.items(), sides[::2], sides[1::2], strict=True
        )
    ]
    levers.sort(key=lambda lever: -max(abs(change or 0.0) for change in lever.changes))
    warnings: tuple[str, ...] = ()
    if isinstance(subject_varied, Scene) and not subject_varied.pad_model.linear:
        equilibrium, _ = sliding_equilibrium(subject_varied.pad_model)
        warnings = () if equilibrium is None else equilibrium.warnings
    return Advice(
        name=varied.free,
        mu=varied.at,
        mu_max=mu_max,
        nominal=nominal,
        levers=tuple(levers),
        first_order=isinstance(subject_varied, TermSystem),
        warnings=warnings,
    )


def _steps(varied: ParameterSpace, tolerances: Mapping[str, float | str]) -> dict[str, float]:
    """By how much each parameter changes, in its unit: by its tolerance, else by `STEP`, which is
    nothing for what is 0. Raises InputError."""
    sizes: dict[str, float | str] = {}
    for name, value in varied.values.items():
        if value:
            sizes[name] = STEP if varied.units[name] == "rad" else f"{100 * STEP}%"
    sizes |= tolerances
    return {name: _tolerance(varied, name, size) for name, size in sizes.items()}


def _tolerance(varied: ParameterSpace, name: str, size: float | str) -> float:
    """A tolerance in the parameter's unit. Raises InputError."""
    at = Place(f"tolerance {name}={size}")
    text = str(size)
    try:
        value = float(text.removesuffix("%"))
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        allowed = "a finite number above 0, in the parameter's unit or as a share such as 5%"
        raise at.refuse(f"it must be {allowed}")
    share = text.endswith("%")
    return varied.step(name, value / 100 if share else value, share, at)


def _change(nominal: Outcome, outcome: Outcome, mu_max: float) -> float | None:
    """How far the critical friction moved from that of the pad as it is."""
    if outcome.reason is not None:
        return None
    before = mu_max if nominal.critical is None else nominal.critical
    after = mu_max if outcome.critical is None else outcome.critical
    return 0.0 if abs(after - before) <= ROUNDING * before else after - before
