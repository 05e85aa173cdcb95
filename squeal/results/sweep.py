"""Eigenvalues at values of the parameter, and each mode over them."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.io.writing import (
    Answer,
    Column,
    JsonObject,
    Mark,
    Panel,
    Table,
    copied_attributes,
    number,
)
from squeal.linear import GROWING
from squeal.linear.eigen import Eigenvalue
from squeal.linear.paths import Loss
from squeal.results.columns import (
    ROOT,
    UNSURE,
    basis_text,
    onset_column,
    parameter_entry,
    parameter_heading,
    rounded_growth,
    with_unit,
)
from squeal.results.eigenvalues import Eigenvalues, Onsets, eigenvalues_of_arrays
from squeal.results.sources import Source, unit_of

LISTED = 8  # frequencies in a line of a table
LOST = {
    "meet": "meet, as at an onset of flutter; from there on their numbers are a convention",
    "end": "leave the band, or are not recognised further on",
    "begin": "enter the band, or were not recognised before",
}
"""What happens to several modes where it is not known which is which, by `Loss.kind`."""
LOST_ALONE = {
    "end": "leaves the band, or is not recognised further on",
    "begin": "enters the band, or was not recognised before",
}
"""The same of one mode; it takes two to meet."""


@dataclass(frozen=True, eq=False)
class Step:
    """Roots at one value of the parameter, and the verdict on them.

    Attributes
    ----------
    value : float
        Of the parameter.
    roots, residuals, rounding : array (m,) or None
        The roots, their backward errors, and how far rounding, or what a first look leaves out, may
        move them (1/s). Of a pad they are None where its branch of equilibria does not reach.
    verdict : str or None
        On the roots; None where they do not decide.
    contact, admissible
        Of a pad: the contact state, and whether the model means this equilibrium.
    spurious : int
        Number of roots that the reduced system has beside the full one.
    modes : array (m,) or None
        Number of each root's mode, 0 where it is not known.
    corrected : array (m,) of bool, or None
        Of a first look: which roots solve the full problem; the others are estimated.
    certified : bool or None
        Whether a count shows that no root is missing; None where nothing was counted.
    """

    value: float
    roots: NDArray[np.complex128] | None = field(repr=False)
    residuals: NDArray[np.float64] | None = field(repr=False)
    verdict: str | None
    contact: str | None = None
    admissible: bool | None = None
    spurious: int = 0
    rounding: NDArray[np.float64] | None = field(default=None, repr=False)
    modes: NDArray[np.intp] | None = field(default=None, repr=False)
    corrected: NDArray[np.bool_] | None = field(default=None, repr=False)
    certified: bool | None = None

    @property
    def mode_numbers(self) -> list[int | None]:
        """The numbers of the modes as a table has them, None where one is not known."""
        if self.roots is None:
            return []
        if self.modes is None:
            return [None] * len(self.roots)
        return [mode or None for mode in self.modes.tolist()]

    @property
    def eigenvalues(self) -> tuple[Eigenvalue, ...]:
        """The roots without their vectors; none where the branch does not reach."""
        if self.roots is None or self.residuals is None:
            return ()
        rounding = np.zeros_like(self.residuals) if self.rounding is None else self.rounding
        return eigenvalues_of_arrays(self.roots, self.residuals, rounding)

    @property
    def fastest(self) -> Eigenvalue | None:
        """The root that grows fastest, of equal ones the least certain; None without a root."""
        return max(self.eigenvalues, key=attrgetter("growth_rate", "rounding"), default=None)

    def largest_growth(self) -> float | None:
        """The largest growth rate, 1/s; None without a root."""
        return None if self.fastest is None else self.fastest.growth_rate

    def error_text(self) -> str:
        """What rounding leaves of the largest growth rate, for people."""
        if self.fastest is None:
            return "0"
        return number(self.fastest.rounding, 2)

    def verdict_text(self) -> str:
        """The verdict for people, or why there is none."""
        if self.verdict:
            return self.verdict
        if self.roots is None:
            return "no equilibrium on the branch"
        return "open"

    @property
    def unstable_count(self) -> int:
        """The number of roots that grow."""
        return sum(root.kind in GROWING for root in self.eigenvalues)

    def root_of_mode(self) -> dict[int, Eigenvalue]:
        """The root of each mode that is known: of a pair the upper one, of two real ones that which
        grows faster."""
        roots: dict[int, Eigenvalue] = {}
        for root, mode in zip(self.eigenvalues, self.mode_numbers, strict=True):
            if not mode or root.value.imag < 0.0:
                continue
            if mode not in roots or root.growth_rate > roots[mode].growth_rate:
                roots[mode] = root
        return roots

    def frequencies(self, only_growing: bool) -> str:
        """Frequencies (Hz) of the modes that vibrate, or of those that grow, in a line.

        Real roots that grow have the frequency 0. After `LISTED` frequencies a count follows.
        """
        hertz = []
        for root in self.eigenvalues:
            if only_growing:
                is_listed = root.kind in GROWING and root.value.imag >= 0.0
            else:
                is_listed = root.value.imag > 0.0
            if is_listed:
                hertz.append(root.frequency_hz)
        hertz.sort()
        text = ", ".join(map(number, hertz[:LISTED])) or "-"
        if len(hertz) > LISTED:
            text += f", {len(hertz) - LISTED} more"
        return text

    def to_dict(self, parameter: str) -> JsonObject:
        """The step as JSON holds it; what is not known of a root is left out.

        `eigenvalues` is null where the branch does not reach, as `roots` is None there. parameter:
        the name under which the value stands.
        """
        rows = []
        roots = self.eigenvalues
        records = Table(ROOT, roots).records()
        for k, (mode, record) in enumerate(zip(self.mode_numbers, records, strict=True)):
            entry = {"mode": mode} | record
            row: JsonObject = {key: value for key, value in entry.items() if value is not None}
            if self.corrected is not None:
                row["error"] = roots[k].rounding
                row["corrected"] = bool(self.corrected[k])
            rows.append(row)
        document = parameter_entry(parameter, self.value)
        document["eigenvalues"] = None if self.roots is None else rows
        document |= copied_attributes(self, "verdict spurious")
        if self.certified is not None:
            document["certified"] = self.certified
        if self.admissible is not None:
            document |= copied_attributes(self, "contact admissible")
        return document


@dataclass(frozen=True)
class SweptMode:
    """A mode over a sweep.

    Attributes
    ----------
    mode : int
        Its number.
    first_hz, last_hz : float
        Frequencies at the first and the last value that have it.
    growth_rate, at : float
        Its largest growth rate (1/s), and the value of that.
    onset, interval : float and (float, float), or None
        Where its growth begins, interpolated, and the two values between; None if it never grows,
        or grows from the first value on.
    """

    mode: int
    first_hz: float
    last_hz: float
    growth_rate: float
    at: float
    onset: float | None = None
    interval: tuple[float, float] | None = None

    @staticmethod
    def of(mode: int, path: Sequence[tuple[float, Eigenvalue]]) -> SweptMode:
        """The mode of a number from its path: rising values of the parameter, and the root at each.

        Its growth begins between the first two values at which it does not grow, and grows; there
        the growth rate is interpolated linearly to zero: with -1 1/s at mu = 0.4 and 3 1/s at 0.5
        it begins at 0.425.
        """
        at, fastest = max(path, key=lambda pair: pair[1].growth_rate)
        onset = interval = None
        for (low, before), (high, after) in itertools.pairwise(path):
            if after.kind in GROWING and before.kind not in GROWING:
                rate_before = min(before.growth_rate, 0.0)  # above zero by rounding: counts as zero
                share = rate_before / (rate_before - after.growth_rate)
                onset = low + (high - low) * share
                interval = (low, high)
                break
        _, first = path[0]
        _, last = path[-1]
        return SweptMode(
            mode=mode,
            first_hz=first.frequency_hz,
            last_hz=last.frequency_hz,
            growth_rate=fastest.growth_rate,
            at=at,
            onset=onset,
            interval=interval,
        )


class _Row(NamedTuple):
    """A line of the table: a root, or a value at which there is none."""

    step: Step
    root: Eigenvalue | None
    mode: int | None

    def how(self) -> str | None:
        """Whether the root of a first look is corrected or estimated; None without one."""
        if self.root is None:
            return None
        corrected = self.step.corrected
        is_this_root = self.step.roots == self.root.value
        if corrected is not None and corrected[is_this_root].any():
            return "corrected"
        return "estimated"


def _of_root(column: Column) -> Column:
    """The column of an eigenvalue in a table of `_Row`, empty in a line without one."""

    def value(row: _Row) -> object:
        return None if row.root is None else column.of(row.root)

    return Column(column.name, column.unit, value)


@dataclass(frozen=True, eq=False, repr=False)
class Sweep(Answer):
    """Eigenvalues at values of the parameter.

    steps: the roots at each value. A mode keeps its number over all of them: that by rising
    frequency at the step `reference`, of the subject's own value if the sweep has it, else of the
    lowest value; None where no value has roots. losses: where it is not known which mode is which;
    names: of modes by number; basis: the reduced system that served; note: on contact whose seat
    stays.

    Examples
    --------
    >>> import squeal
    >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}  # flutter from mu = 3/4 on
    >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"mu": 1.0}, name="pair")
    >>> [step.verdict for step in squeal.sweep(pair, [0.5, 1.0]).steps]
    ['marginal', 'flutter']
    """

    panel = Panel(0, "frequency_hz", Mark.LINES, "mode")
    grid = (0, "mode")

    name: str
    parameter: str
    steps: tuple[Step, ...]
    losses: tuple[Loss, ...] = ()
    reference: Step | None = None
    names: Mapping[int, str] = field(default_factory=dict)
    basis: Mapping[str, Any] | None = None
    source: Source | None = None
    note: str = ""

    @property
    def warnings(self) -> tuple[str, ...]:  # type: ignore[override]
        """How many of the values have no equilibrium that the model means, or may lack roots."""
        inadmissible = [step.value for step in self.steps if step.admissible is False]
        uncertified = [step.value for step in self.steps if step.certified is False]
        lines = []
        if inadmissible:
            fault = "have no equilibrium that the model means"
            lines.append(self._warning(inadmissible, fault))
        if uncertified:
            lines.append(self._warning(uncertified, f"are {UNSURE}"))
        return tuple(lines)

    def _warning(self, values: Sequence[float], fault: str) -> str:
        """A warning of some values: how many, the first of them, and their fault in words."""
        count = f"{len(values)} of {len(self.steps)} values of {self.parameter}"
        return f"sweep: {count}, the first of them {values[0]:.6g}, {fault}"

    def named(self, names: Mapping[int, str]) -> Sweep:
        """The sweep with names of modes by their numbers.

        Examples
        --------
        >>> import squeal
        >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}  # flutter from mu = 3/4 on
        >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"mu": 1.0}, name="pair")
        >>> dict(squeal.sweep(pair, [0.0, 0.5]).named({1: "in phase"}).names)
        {1: 'in phase'}
        """
        return replace(self, names={**self.names, **names})

    @property
    def modes(self) -> tuple[SweptMode, ...]:
        """Each mode by its number, with its onset and its fastest growth."""
        steps = {step.value: step for step in self.steps}
        if self.reference is not None:
            steps[self.reference.value] = self.reference
        paths: dict[int, list[tuple[float, Eigenvalue]]] = {}
        for value, step in sorted(steps.items()):
            for mode, root in step.root_of_mode().items():
                paths.setdefault(mode, []).append((value, root))
        return tuple(SweptMode.of(mode, path) for mode, path in sorted(paths.items()))

    def onsets(self, eigenvalues: Eigenvalues) -> Onsets:
        """Where unstable modes began to grow, by the modes of the sweep.

        Of each mode `onset` and `interval`, see `SweptMode`. Empty unless the modes are numbered at
        the value of the eigenvalues, so that numbers mean the same in both.

        Examples
        --------
        >>> import squeal
        >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}  # flutter from mu = 3/4 on
        >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"mu": 1.0}, name="pair")
        >>> [onset] = squeal.sweep(pair, [0.5, 1.0]).onsets(squeal.eigenvalues(pair)).values()
        >>> onset["interval"]
        (0.5, 1.0)
        """
        if self.reference is None or eigenvalues.value != self.reference.value:
            return {}
        onset_of_number = {
            mode.mode: copied_attributes(mode, "onset interval") for mode in self.modes
        }
        onsets = {}
        for unstable in eigenvalues.unstable:
            number_of_mode = eigenvalues.mode_of(unstable)
            if number_of_mode in onset_of_number:
                onsets[unstable] = onset_of_number[number_of_mode]
        return onsets

    @property
    def is_first_look(self) -> bool:
        """True of a first look, whose roots are estimated or corrected."""
        return any(step.corrected is not None for step in self.steps)

    def table(self) -> Table:
        """A row for each root at each value; one without numbers where there is none.

        Examples
        --------
        >>> import squeal
        >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}  # flutter from mu = 3/4 on
        >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"mu": 1.0}, name="pair")
        >>> len(squeal.sweep(pair, [0.0, 0.5]).table().rows)  # four roots each
        8
        """
        columns = self._columns()
        name = parameter_heading(self.parameter, [column.name for column in columns])
        rows = []
        for step in self.steps:
            if not step.eigenvalues:
                rows.append(_Row(step, None, None))
            for root, mode in zip(step.eigenvalues, step.mode_numbers, strict=True):
                rows.append(_Row(step, root, mode))
        return Table([Column(name, value=lambda row: row.step.value), *columns], rows)

    def _columns(self) -> list[Column]:
        """The columns of a `_Row` behind that of the parameter.

        The damping ratio and the condition are left out, which `Eigenvalues` lists at one value.
        The error of a first look stands in the field `rounding` of its roots: what the first look
        leaves out is added to rounding there.
        """
        columns = [
            Column("contact", value=lambda row: row.step.contact),
            Column("mode", value=attrgetter("mode")),
        ]
        if self.names:
            columns.append(Column("name", value=lambda row: self.names.get(row.mode)))
        for column in ROOT:
            if column.name not in ("damping_ratio", "condition"):
                columns.append(_of_root(column))
        if self.is_first_look:
            columns.append(_of_root(Column("error", "1/s", attrgetter("rounding"))))
            columns.append(Column("how", value=_Row.how))
        columns.append(Column("verdict", value=lambda row: row.step.verdict))
        return columns

    def _table_of_values(self) -> Table:
        """A row for each value, for people.

        Where it is too long for people, the rows on both sides of a change of the unstable count
        are kept first.
        """
        head = with_unit(self.parameter, unit_of(self.source))
        heads = [Column(self.parameter, value=attrgetter("value"), words=head)]
        if any(step.contact is not None for step in self.steps):
            heads.append(Column("contact"))
        heads += [
            Column("frequencies, Hz", value=lambda step: step.frequencies(only_growing=False)),
            Column("growing, Hz", value=lambda step: step.frequencies(only_growing=True)),
            Column("largest real, 1/s", value=Step.largest_growth),
        ]
        if self.is_first_look:
            heads += [
                Column("error, 1/s", shown=Step.error_text),
                Column("corrected", value=lambda step: int(np.sum(step.corrected))),
            ]
        heads.append(Column("verdict", value=Step.verdict_text))
        beside_change: set[int] = set()  # ids, since a step holds arrays and cannot be hashed
        for before, after in itertools.pairwise(self.steps):
            if before.unstable_count != after.unstable_count:
                beside_change |= {id(before), id(after)}
        return Table(
            heads,
            self.steps,
            f"sweep of {self.parameter}",
            rank=lambda step: id(step) in beside_change,
        )

    def _table_of_modes(self) -> Table:
        """A row for each mode: its frequencies, its largest growth and the onset of that."""
        heads = [Column("mode")]
        if self.names:
            heads.append(Column("name", value=lambda mode: self.names.get(mode.mode)))
        heads += [
            Column("first_hz"),
            Column("last_hz"),
            Column("growth_rate", "1/s", words="largest real, 1/s"),
            Column("at", words=f"at {self.parameter}"),
            onset_column(self.parameter, unit_of(self.source)),
        ]
        title = "modes"
        if self.reference is not None:
            title += f", numbered as at {self.parameter} = {number(self.reference.value)}"
        return Table(heads, self.modes, title, rank=rounded_growth)

    def parts(self) -> Sequence[str | Table]:
        parts: list[str | Table] = [self._table_of_values(), self._table_of_modes()]
        parts.append("\n".join(self.lost()))
        if self.basis is not None:
            parts.append(basis_text(self.basis))
        parts.append(self.note)
        return parts

    def lost(self) -> list[str]:
        """A sentence for each place where it is not known which mode is which.

        Examples
        --------
        >>> import squeal
        >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}  # flutter from mu = 3/4 on
        >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"mu": 1.0}, name="pair")
        >>> squeal.sweep(pair, [0.0, 0.5]).lost()  # both modes are known
        []
        """
        lines = []
        for loss in self.losses:
            between = f"{self.parameter} = {number(loss.low)} and {number(loss.high)}"
            modes = ", ".join(map(str, loss.modes))
            what = f"modes {modes} {LOST[loss.kind]}"
            if len(loss.modes) == 1:
                what = f"mode {modes} {LOST_ALONE[loss.kind]}"
            lines.append(f"between {between} {what}")
        return lines

    def to_dict(self) -> JsonObject:
        modes = [asdict(mode) | {"name": self.names.get(mode.mode)} for mode in self.modes]
        return {
            "parameter": self.parameter,
            "sweep": [step.to_dict(self.parameter) for step in self.steps],
            "modes": modes,
            "lost": [loss._asdict() for loss in self.losses],
            **copied_attributes(self, "basis"),
        }
