"""The parameters that a critical friction depends on, and how it answers when they change.

Changed pads are computed together as a stack over values of friction, not by the certified search
of a query: an interval of instability narrower than a step may be missed. A pad that the stack
cannot decide is a query of its own, which decides it or says why it cannot.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from squeal.errors import ComputationError, InputError, suggestion
from squeal.io.scene import Scene
from squeal.io.writing import copied_attributes, unit_word
from squeal.linear import GROWING
from squeal.linear.system import TermSystem
from squeal.model.pad import PARAMETERS
from squeal.queries.options import MU_MAX, Band
from squeal.queries.pads.stack import PadStack, parameters
from squeal.queries.thresholds import thresholds
from squeal.results.thresholds import Thresholds
from squeal.schema import Place

ROUNDING = 1e-11  # relative: what a query and a stack may differ by
AT_ONCE = 1e-9  # friction: stability lost below it is lost from the start
NO_PAD = "no pad"
NO_EQUILIBRIUM = "there is no equilibrium in contact without friction"


@dataclass(frozen=True)
class Outcome:
    """The critical friction of a pad or system of which some parameters were changed.

    Attributes
    ----------
    value : float or None
        What the parameter was changed to, where one alone was.
    critical : float or None
        The friction up to which there is a stable equilibrium; None if no threshold lies in the
        range.
    kind : str or None
        What happens there: flutter, divergence, a fold or the end of the branch. `NO_PAD` where
        there is no such pad, or it has no equilibrium in contact without friction.
    frequency_hz : float or None
        Frequency of the mode that loses stability.
    reason : str or None
        Why nothing is known.
    change : float or None
        By how much the critical friction changed; at least so much where it leaves the range.
    """

    value: float | None = None
    critical: float | None = None
    kind: str | None = None
    frequency_hz: float | None = None
    reason: str | None = None
    change: float | None = None


def outcome_at(mu: float, kind: str, hertz: float = math.nan) -> Outcome:
    """The outcome of stability that is lost at mu, NaN if nowhere.

    hertz: frequency of the mode that loses it, NaN if there is none. A mode that grows from the
    start has no critical frequency.
    """
    if math.isnan(mu):
        return Outcome()
    if mu <= AT_ONCE:
        return Outcome(critical=0.0, kind=kind)
    frequency = None if math.isnan(hertz) else float(hertz)
    return Outcome(critical=float(mu), kind=kind, frequency_hz=frequency)


def first_loss(answer: Thresholds, high: float) -> Outcome:
    """Where stability is lost first, or the branch of equilibria ends below `high`."""
    if answer.verdict in GROWING:  # from the start of the range on
        return outcome_at(0.0, answer.verdict)
    if answer.first is not None:
        return outcome_at(answer.first.mu, answer.first.kind, answer.first.frequency_hz)
    if answer.high < high:
        return outcome_at(answer.high, "end of the branch")
    return Outcome()


@dataclass(frozen=True, eq=False)
class ParameterSpace:
    """A scene or system with the parameters that may be varied, in SI units.

    Attributes
    ----------
    subject : Scene or TermSystem
        What has the parameters.
    free : str
        Name of the friction or free parameter over which thresholds are searched.
    at : float
        Value of that parameter in the subject itself.
    values, units : dict
        Value and unit of each parameter that may be varied.
    """

    subject: Scene | TermSystem
    free: str
    at: float
    values: dict[str, float]
    units: dict[str, str]

    @staticmethod
    def of(
        argument: object,
        verb: str,
        high: float,
        quantity: Literal["threshold", "growth"] = "threshold",
    ) -> ParameterSpace:
        """The parameters of an argument that may be varied.

        Parameters
        ----------
        argument : Scene, SystemFile or TermSystem
            What was given to the verb.
        verb : str
            Name of the verb, with which messages begin.
        high : float
            Upper end of the range of the friction of a scene, which is checked; of a system it may
            be any.
        quantity : {"threshold", "growth"}
            What is computed: the free parameter may be varied for growth alone.

        Raises
        ------
        InputError
            For an argument of another type, or one that has no parameter to vary.
        """
        subject = getattr(argument, "system", argument)  # a system file holds its system
        place = Place(verb)
        if isinstance(subject, Scene):
            MU_MAX.read(high, place / "high")
            free = "mu"
            present = subject.pad.mu
            values = copied_attributes(subject.pad, " ".join(parameters(subject.pad_model)))
            units = {name: unit_word(PARAMETERS[name].unit) for name in values}
        elif isinstance(subject, TermSystem):
            free = subject.parameter
            values = subject.given
            present = float(values[free])
            units = dict.fromkeys(values, "")
        else:
            allowed = "it must be a Scene or a system with named parameters"
            raise place.refuse(f"{type(subject).__name__} is not allowed; {allowed}")
        if quantity == "threshold":
            values = {name: value for name, value in values.items() if name != free}
        if isinstance(subject, TermSystem) and not values:
            allowed = "it must have one under its key parameters"
            raise place.refuse(f"{subject.name} has no named parameter but {free}; {allowed}")
        return ParameterSpace(subject, free, present, values, units)

    def require(self, name: str, at: Place) -> None:
        """Raise InputError for a name that is no parameter of this space."""
        if name in self.values:
            return
        why = "is no parameter here"
        if name == self.free:  # the values of a threshold leave it out
            why = "is varied to find its threshold, and scatters where growth is sampled alone"
        raise at.refuse(f"{name} {why}; {suggestion(name, self.values)}")

    def step(self, name: str, size: float, is_share: bool, at: Place) -> float:
        """A change of a parameter in its unit.

        Parameters
        ----------
        name : str
            The parameter.
        size : float
            The change: a share of the parameter's value if `is_share`, else in its unit.
        at : Place
            Where the change was given, for messages.

        Raises
        ------
        InputError
            For what is no parameter, and for a share of an angle or of zero.
        """
        self.require(name, at)
        if not is_share:
            return size
        if self.units[name] == "rad":
            raise at.refuse(f"{name} is an angle and has no share; it must be given in rad")
        if not self.values[name]:
            raise at.refuse(f"{name} is 0 and has no share; it must be given in its unit")
        return size * abs(self.values[name])

    def outcomes(
        self,
        changes: Sequence[Mapping[str, float]],
        high: float,
        band: Band | None = None,
    ) -> list[Outcome]:
        """The outcome of each change of some parameters, with friction up to `high`.

        band: frequencies in Hz of the modes that are judged, of systems.
        """
        if isinstance(self.subject, Scene):
            return self._outcomes_of_pads(self.subject, changes, high)
        outcomes = []
        for values in changes:
            try:
                changed = self.subject.replace(values)
            except InputError as error:
                outcomes.append(Outcome(kind=NO_PAD, reason=str(error)))
            else:
                outcomes.append(_outcome_of_query(changed, high, band))
        return outcomes

    def _outcomes_of_pads(
        self, scene: Scene, changes: Sequence[Mapping[str, float]], high: float
    ) -> list[Outcome]:
        """The outcome of each change of a pad: by the stack, or a query if the stack has none.

        high: upper end of the range of friction in which stability may be lost.
        """
        outcomes: dict[int, Outcome] = {}  # by number of the change
        changed: dict[int, Scene] = {}
        for number, values in enumerate(changes):
            try:
                changed[number] = scene.replace(**values)
            except InputError as error:
                outcomes[number] = Outcome(kind=NO_PAD, reason=str(error))
        if changed:
            outcomes |= self._outcomes_of_stack(scene, changed, high)
        for number in changed.keys() - outcomes:  # which the stack could not decide
            outcomes[number] = _outcome_of_query(changed[number], high)
        return [outcomes[number] for number in range(len(changes))]

    def _outcomes_of_stack(
        self, scene: Scene, changed: Mapping[int, Scene], high: float
    ) -> dict[int, Outcome]:
        """The outcomes of changed scenes, computed together as a stack of pads.

        changed: scenes by the number of the change. The outcomes have the same numbers; those that
        the stack cannot decide are missing.
        """
        try:
            losses = PadStack.of_scenes(scene, [*changed.values()]).first_losses(high)
        except ComputationError:  # one pad failed: a query of each then says which and why
            return {}
        outcomes = {}
        for k, number in enumerate(changed):
            if losses.unknown[k]:
                continue
            if losses.no_start[k]:
                outcomes[number] = Outcome(kind=NO_PAD, reason=NO_EQUILIBRIUM)
            else:
                outcomes[number] = outcome_at(losses.mu[k], losses.kinds[k], losses.frequency_hz[k])
        return outcomes


def _outcome_of_query(
    subject: Scene | TermSystem, high: float, band: Band | None = None
) -> Outcome:
    """The outcome of a subject by the query `thresholds`, with the reason if there is none.

    Nothing is proved: a proof takes longer than the search, and an outcome does not say of it.
    """
    try:
        return first_loss(thresholds(subject, high, band=band, prove=False), high)
    except (InputError, ComputationError) as error:
        return Outcome(reason=str(error))
