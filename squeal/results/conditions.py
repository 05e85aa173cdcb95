"""The operating matrix: what grows at each combination of operating conditions, and how often."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from operator import attrgetter
from typing import Any

from squeal.io.writing import Answer, Column, JsonObject, Table, columns, copied_attributes, number
from squeal.results.columns import basis_text, parameter_heading, rounded_growth


def at_parameters(parameters: Mapping[str, float]) -> str:
    """Parameters with their values in words."""
    return ", ".join(f"{name} = {number(value)}" for name, value in parameters.items())


@dataclass(frozen=True)
class ModeAtCondition:
    """A mode at one condition, with Im lambda >= 0, and whether it grows there; `mode` is its
    number in `Conditions.modes`, None where it grows nowhere."""

    frequency_hz: float
    growth_rate: float
    damping_ratio: float
    grows: bool
    mode: int | None = None


@dataclass(frozen=True)
class Condition:
    """One combination of parameters and the modes (`rows`) that were found there.

    The verdict is None where what is known decides nothing; reason: why nothing is known.
    """

    parameters: Mapping[str, float]
    verdict: str | None = None
    rows: tuple[ModeAtCondition, ...] = ()
    admissible: bool = True
    reason: str | None = None

    @property
    def modes(self) -> list[ModeAtCondition]:
        """The modes that grow, the fastest first."""
        return sorted((row for row in self.rows if row.grows), key=lambda row: -row.growth_rate)

    @property
    def unstable(self) -> int | None:
        """How many modes grow; None where that is not known."""
        return None if self.reason else len(self.modes)

    @property
    def worst(self) -> ModeAtCondition | None:
        """The fastest growing, or least damped, mode; None where none is damped or known."""
        if self.verdict == "marginal":
            return None
        return max(self.rows, key=lambda row: row.growth_rate, default=None)

    @property
    def rank(self) -> float:
        """The growth rate in three digits: of a long table the rows of the largest are shown."""
        return rounded_growth(self.worst) if self.worst else -math.inf


def _of_worst(name: str, unit: str = "", percent: bool = False) -> Column:
    """A column of the worst mode of a condition, empty without one."""

    def value(condition: Condition) -> float | None:
        return None if condition.worst is None else getattr(condition.worst, name)

    return Column(name, unit, value, percent=percent)


def _value_of(parameter: str) -> Callable[[Condition], float]:
    """A function that gives the value of a parameter at a condition."""
    return lambda condition: condition.parameters[parameter]


GROWTH = (
    *columns("mode frequency_hz"),
    Column("growth_rate", "1/s"),
    *columns("damping_ratio%"),
)
OUTCOME = (
    Column("verdict", shown=lambda condition: condition.verdict or "open"),
    *columns("unstable"),
    _of_worst("mode"),
    _of_worst("frequency_hz"),
    _of_worst("growth_rate", "1/s"),
    _of_worst("damping_ratio", percent=True),
)
"""Columns of a mode, and of a condition beside its parameters: their keys in JSON."""


@dataclass(frozen=True)
class ModePropensity:
    """A mode over all conditions.

    low_hz, high_hz: its frequencies where it grows, at `unstable` conditions; propensity: their
    share of all conditions with known roots; frequency_hz, growth_rate (1/s), damping_ratio: where
    it grows fastest, at `at`.
    """

    mode: int
    low_hz: float
    high_hz: float
    unstable: int
    propensity: float
    frequency_hz: float
    growth_rate: float
    damping_ratio: float
    at: Mapping[str, float]


@dataclass(frozen=True, eq=False, repr=False)
class Conditions(Answer):
    """What grows at each combination of the values of some parameters, the last one fastest.

    axes: values by name; extent: which roots were looked at, in words; tolerance: by how much of
    its frequency a mode may differ from one condition to the next; seated: whether contact was
    seated anew at each condition; basis: the reduced system that served; units: of a pad's
    parameters by name.

    Examples
    --------
    >>> import squeal
    >>> K = {"1": [[2, 0], [0, 2]], "gap": [[1, 0], [0, -1]], "mu": [[0, 1], [-1, 0]]}
    >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"gap": 0.5})
    >>> found = squeal.conditions(pair, {"mu": [0.2, 0.6, 1.0], "gap": [0.3, 0.7]})
    >>> [condition.unstable for condition in found.conditions]
    [0, 0, 1, 0, 1, 1]
    """

    name: str
    axes: Mapping[str, tuple[float, ...]]
    conditions: tuple[Condition, ...] = field(repr=False)
    tolerance: float
    extent: str = ""
    seated: bool = False
    basis: Mapping[str, Any] | None = None
    units: Mapping[str, str] = field(default_factory=dict)

    @property
    def grid(self) -> tuple[int, ...]:  # type: ignore[override]
        """The columns of the axes."""
        return tuple(range(len(self.axes)))

    @property
    def modes(self) -> list[ModePropensity]:
        """The modes that grow at some condition, by their number, each with how often it grows."""
        # by mode: the conditions at which it grows, with the mode there
        grown: dict[int, list[tuple[Condition, ModeAtCondition]]] = {}
        for condition in self.conditions:
            for row in condition.modes:
                assert row.mode is not None
                grown.setdefault(row.mode, []).append((condition, row))
        modes = []
        for mode in sorted(grown):
            at, fastest = max(grown[mode], key=lambda pair: pair[1].growth_rate)
            hertz = [row.frequency_hz for _, row in grown[mode]]
            modes.append(
                ModePropensity(
                    mode=mode,
                    low_hz=min(hertz),
                    high_hz=max(hertz),
                    unstable=len(hertz),
                    propensity=len(hertz) / self.solved,
                    frequency_hz=fastest.frequency_hz,
                    growth_rate=fastest.growth_rate,
                    damping_ratio=fastest.damping_ratio,
                    at=at.parameters,
                )
            )
        return modes

    @property
    def solved(self) -> int:
        """At how many conditions roots are known."""
        return sum(condition.reason is None for condition in self.conditions)

    @property
    def unstable(self) -> int:
        """At how many conditions some mode grows."""
        return sum(bool(condition.modes) for condition in self.conditions)

    @property
    def propensity(self) -> float | None:
        """The share of the conditions that were solved at which some mode grows."""
        return self.unstable / self.solved if self.solved else None

    @property
    def worst(self) -> Condition | None:
        """The condition of the fastest growth; None where nothing grows."""
        growing = [condition for condition in self.conditions if condition.modes]
        return max(growing, key=lambda condition: condition.modes[0].growth_rate, default=None)

    @property
    def warnings(self) -> tuple[str, ...]:  # type: ignore[override]
        """How many conditions have no answer, or an equilibrium that the model does not mean."""
        unsolved = [condition for condition in self.conditions if condition.reason]
        inadmissible = [condition for condition in self.conditions if not condition.admissible]
        lines = []
        if unsolved:
            lines.append(self._warning(unsolved, f"have no answer: {unsolved[0].reason}"))
        if inadmissible:
            lines.append(self._warning(inadmissible, "have no equilibrium that the model means"))
        return tuple(lines)

    def _warning(self, concerned: Sequence[Condition], fault: str) -> str:
        """A warning of some conditions: how many, the first of them, and their fault in words."""
        count = f"{len(concerned)} of {len(self.conditions)} conditions"
        first = at_parameters(concerned[0].parameters)
        return f"conditions: {count}, the first of them {first}, {fault}"

    @property
    def conclusion(self) -> str:
        """At how many conditions something grows, and the worst of them, in a line."""
        extent = f", {self.extent}" if self.extent else ""
        worst = self.worst
        if worst is None:
            # an open verdict: a mode may grow that was not found, or by less than its error
            is_open = any(not condition.verdict for condition in self.conditions)
            reservation = " was found" if is_open else ""
            return f"No unstable mode{reservation} at {self.solved} conditions{extent}"
        fastest = worst.modes[0]
        size = f"{fastest.frequency_hz:.4g} Hz, growth {fastest.growth_rate:.4g} 1/s"
        if fastest.frequency_hz:  # of a divergence the ratio is -100 %, whatever its growth
            size += f", damping {100 * fastest.damping_ratio:.2g} %"
        return (
            f"Unstable at {self.unstable} of {self.solved} conditions{extent}: the worst "
            f"{size}, at {at_parameters(worst.parameters)}"
        )

    def table(self) -> Table:
        """A row for each condition.

        Examples
        --------
        >>> import squeal
        >>> K = {"1": [[2, 0], [0, 2]], "gap": [[1, 0], [0, -1]], "mu": [[0, 1], [-1, 0]]}
        >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"gap": 0.5})
        >>> found = squeal.conditions(pair, {"mu": [0.2, 0.6, 1.0], "gap": [0.3, 0.7]})
        >>> len(found.table().rows) > 0
        True
        """
        others = [column.name for column in OUTCOME]
        axes = []
        for name in self.axes:
            heading = parameter_heading(name, others)
            axes.append(Column(heading, value=_value_of(name)))
        return Table((*axes, *OUTCOME), self.conditions, "conditions", rank=attrgetter("rank"))

    def _table_of_modes(self) -> Table:
        columns_of_mode = (
            *columns("mode low_hz high_hz unstable propensity%"),
            *GROWTH[1:],  # all but `mode`
            Column("at", shown=lambda mode: at_parameters(mode.at)),
        )
        title = (
            "modes that grow, matched from one condition to the next by MAC and frequency, within "
            f"{100 * self.tolerance:g} %"
        )
        return Table(columns_of_mode, self.modes, title, rank=attrgetter("propensity"))

    def parts(self) -> Sequence[str | Table]:
        parts: list[str | Table] = [f"{self.name}\n{self.conclusion}"]
        if self.modes:
            parts.append(self._table_of_modes())
        parts.append(self.table())
        if self.seated:
            parts.append("contact was seated anew at each condition")
        if self.basis is not None:
            parts.append(basis_text(self.basis))
        return parts

    def to_dict(self) -> JsonObject:
        rows = []
        for condition in self.conditions:
            row: JsonObject = {"parameters": dict(condition.parameters)}
            (outcome,) = Table(OUTCOME, [condition]).records()
            row |= outcome
            row["modes"] = Table(GROWTH, condition.modes).records()
            rows.append(row | copied_attributes(condition, "admissible reason"))
        axes = [{"name": name, "values": list(values)} for name, values in self.axes.items()]
        return {
            "name": self.name,
            "axes": axes,
            "conditions": rows,
            "modes": [asdict(mode) for mode in self.modes],
            **copied_attributes(self, "propensity tolerance extent seated basis"),
        }
