"""What the verbs answer with, for a pad and for matrices alike: one record and one table a verb."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from operator import attrgetter, itemgetter
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from squeal.errors import InputError
from squeal.io.writing import Answer, Column, Table, columns, located, number, picked
from squeal.linear import GROWING, CriticalPoint, Crossing, UnstableMode
from squeal.linear.continuation import State
from squeal.linear.eigen import Eigenvalue, assigned
from squeal.linear.paths import Loss, follow, mode_numbers, numbers_at

LISTED = 8  # frequencies in a line of a table
OPEN = "open: "  # how a criterion begins where what is known decides nothing
MISSED = "between the computed values may be missed"
UNSURE = "not certified: others may be missing"

ROOT = (
    Column("real", "1/s", lambda root: root.value.real),
    Column("imag", "rad/s", lambda root: root.value.imag),
    *columns("frequency_hz damping_ratio%"),
    Column("residual", shown=lambda root: number(root.residual, 2)),
    # infinite where roots coalesce, which JSON cannot say
    Column(
        "condition", value=lambda e: e.condition if e.condition < math.inf else None, hidden=True
    ),
)
"""Columns of an eigenvalue, and its keys in JSON."""
ERROR = Column("error", "1/s", shown=lambda e: "-" if e.error is None else number(e.error, 2))


def _growth(row: Any) -> float:
    """The growth rate in three digits, by which long tables show rows."""
    return float(number(row.growth_rate, 3))


def shape_rows(shapes: Sequence[ModeShape], names: Sequence[str], rule: str) -> dict[str, Any]:
    """Mode shapes as a JSON object."""
    rows = [
        {"mode": one.number}
        | picked(one, "frequency_hz growth_rate")
        | {"real": one.shape.real.tolist(), "imag": one.shape.imag.tolist()}
        for one in shapes
    ]
    return {"coordinates": list(names), "normalisation": rule, "shapes": rows}


def valued(parameter: str, value: float | None) -> dict[str, Any]:
    """The value of the parameter as answers hold it; `mu` is its key for scripts."""
    return {"parameter": parameter, "value": value, "mu": value}


def led(name: str, others: Collection[str]) -> str:
    """The head of a parameter's column: parameter.NAME if another column has its name."""
    return f"parameter.{name}" if name in others else name


@dataclass(frozen=True, eq=False)
class ModeShape:
    """The shape (n,) of one mode: complex, its largest entry 1 once each is times its lever.

    number: by rising frequency, from 1; a pair of eigenvalues is one mode.
    """

    number: int
    frequency_hz: float
    growth_rate: float
    shape: np.ndarray = field(repr=False)


@dataclass(frozen=True, eq=False, repr=False)
class Eigenvalues(Answer):
    """Eigenvalues of a pad or a system at one value of its parameter.

    eigenvalues: by rising frequency, of a region that `extent` names in words ("" for all);
    verdict: of these, None where they decide nothing; certified: whether it is proved, or of more
    than 400 rows counted, that none of the extent is missing; proof: what is known of that, as JSON
    holds it, and proof_line in words; unstable: the modes that grow, the fastest first; shapes:
    mode shapes as JSON holds them; details: what else the JSON object says, M, C and K among it;
    notes: lines for people; beside: what grows outside of the extent, in words; source: the
    analysis behind it.
    """

    name: str
    parameter: str
    value: float
    eigenvalues: tuple[Eigenvalue, ...]
    verdict: str | None
    criterion: str
    unstable: tuple[UnstableMode, ...]
    certified: bool
    count: int | None
    extent: str = ""
    shapes: Mapping[str, Any] | None = None
    details: Mapping[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    beside: str = ""
    warnings: tuple[str, ...] = ()
    source: Any = None
    proof: Mapping[str, Any] | None = None
    proof_line: str = ""

    @property
    def values(self) -> NDArray[np.complex128]:
        """The eigenvalues (m,) in rad/s."""
        return np.array([root.value for root in self.eigenvalues], dtype=complex)

    @property
    def modes(self) -> NDArray[np.intp]:
        """The number (m,) of each one's mode by rising frequency; of a pair both have the same."""
        return mode_numbers(self.values)

    @property
    def of_modes(self) -> list[tuple[int, Eigenvalue]]:
        """Each with the number of its mode."""
        return list(zip(self.modes.tolist(), self.eigenvalues, strict=True))

    @property
    def open(self) -> str:
        """Which modes the error of a reduction, or the digits of files, leave open, in words; empty
        if none."""
        each = sorted({k for k, root in self.of_modes if root.open})
        words = f"mode{'s' * (len(each) > 1)} {', '.join(map(str, each))}"
        known_by = self.details.get("known_by")
        within = f"what {known_by} leave open" if known_by else "the error of the reduction"
        return f"growth of {words} is within {within}" * bool(each)

    def mode_of(self, mode: UnstableMode) -> int | None:
        """The number of a mode that grows, None if it is not listed."""
        near = np.abs(self.values - mode.root) <= 1e-9 * abs(mode.root)
        return int(self.modes[near][0]) if near.any() else None

    def save_shapes(self, path: Path | str) -> None:
        """Write the shapes of the modes on the nodes of a system with coordinates, as VTK (.vtk)
        or a universal file (.unv), by the end of the name. Raises InputError."""
        where = getattr(self.source[0], "coordinates", None)
        if where is None:
            words = "save_shapes: needs `coordinates: {file: nodes.csv}` in the system file"
            raise InputError(words)
        modes = sorted(dict(self.of_modes[::-1]).items())
        from squeal.io.shapes import write_shapes  # here, since it reads no system and few ask

        write_shapes(Path(path), where, modes)

    def with_onsets(self, others: Sweep | Thresholds) -> Eigenvalues:
        """The same with the onset of each mode that grows, where it is not known, as a sweep or the
        thresholds tell it."""
        known = others.onsets(self)
        grow = (
            replace(one, **known[one]) if one.onset is None and one in known else one
            for one in self.unstable
        )
        return replace(self, unstable=tuple(grow))

    @property
    def conclusion(self) -> str:
        """The verdict in a line."""
        at = f"{self.parameter} = {number(self.value, 4)}"
        place = f"{self.extent}, {at}" if self.extent else at
        grow = self.unstable
        if grow:
            count = "1 unstable mode" if len(grow) == 1 else f"{len(grow)} unstable modes"
            fastest = "" if len(grow) == 1 else "the fastest "
            hertz, ratio = grow[0].frequency_hz, 100 * grow[0].damping_ratio
            size = f"{hertz:.4g} Hz, damping {ratio:.2g} %"
            if not hertz:
                size = f"{grow[0].kind}, growth {grow[0].growth_rate:.4g} 1/s"
            return f"{count}, {place}: {fastest}{size}"
        if self.verdict == "stable":
            return f"Stable, {place}"
        if self.verdict == "marginal":
            return f"Marginal, {place}: nothing grows, not all decays"
        if self.open or self.criterion.startswith(OPEN):
            reason = self.open or self.criterion.removeprefix(OPEN)
            return f"Open, {place}: {reason}"
        what = "growing mode" if self.eigenvalues else "root"
        return f"No {what} was found, {place}; {self.completeness}"

    @property
    def completeness(self) -> str:
        """How sure it is that no root is missing, in words."""
        if self.proof_line:
            return self.proof_line
        of = " of the reduced system" * bool(self.details.get("basis"))
        doubts = self.details.get("doubts")
        unsure = f"not certified: {'; '.join(doubts)}" if doubts else UNSURE
        return f"certified by a count{of}" if self.certified else unsure

    @property
    def columns(self) -> tuple[Column, ...]:
        """Those of its roots, with the error of a reduction if it is known."""
        return ROOT + (ERROR,) * any(root.error is not None for root in self.eigenvalues)

    def table(self) -> Table:
        numbers = {id(root): k for k, root in self.of_modes}
        mode = Column("mode", value=lambda root: numbers[id(root)])
        table = (mode, *self.columns)
        return Table(table, self.eigenvalues, "", "no root", _growth)

    @property
    def growing(self) -> Table:
        """The modes that grow, with the error of a reduction if it is known."""
        cells: dict[Any, str] = {k: ERROR.cell(root) for k, root in self.of_modes}
        error = replace(ERROR, shown=lambda mode: cells.get(self.mode_of(mode), "-"))
        table = (Column("mode", value=self.mode_of), *columns("kind frequency_hz"))
        table += (Column("growth_rate", "1/s"), *[error] * (ERROR in self.columns))
        table += (*columns("damping_ratio%"), onset_of(self.parameter))
        words = "unstable modes", "no unstable mode is listed"
        return Table(table, self.unstable, *words, _growth)

    def parts(self) -> Sequence[str | Table]:
        count = f"{len(self.eigenvalues)} roots, {self.completeness}"
        if (limit := self.details.get("growth_limit")) is not None:
            count += f"; roots that grow by more than {number(limit, 4)} 1/s are not among them"
        head = f"{self.name}\n{self.conclusion}\n{self.beside}".rstrip()
        notes = [self.open] * bool(self.open and self.unstable) + [*self.notes[1:]]
        if self.unstable and all(one.onset is None for one in self.unstable):
            notes.append(f"from which {self.parameter} on: --sweep and `squeal thresholds` tell")
        return [head, *self.notes[:1], self.table(), count, self.growing, *notes]

    def to_dict(self) -> dict[str, Any]:
        head = {"name": self.name} | valued(self.parameter, self.value)
        return (
            head
            | picked(self, "details")["details"]
            | {
                "eigenvalues": Table(self.columns, self.eigenvalues).records(),
                **picked(self, "verdict criterion certified count"),
                **({} if self.proof is None else {"proof": dict(self.proof)}),
                "unstable": [{"mode": self.mode_of(one)} | asdict(one) for one in self.unstable],
                "mode_shapes": picked(self, "shapes")["shapes"],
            }
        )


@dataclass(frozen=True, eq=False)
class Step:
    """Roots (m,) at one value of the parameter, the verdict on them, their backward errors and how
    far rounding, and what a first look leaves out, may move them (rad/s).

    `modes` (m,) numbers the mode of each root, 0 where it is not known; `corrected` (m,) tells of a
    first look which roots solve the full problem, the others are estimated; `certified` whether a
    count proves that none is missing, None where none was made. Of a pad
    `contact` names the contact state; roots are None where its branch does not reach.
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
    def numbers(self) -> list[int | None]:
        """The numbers of the modes as a table has them, None where one is not known."""
        count = 0 if self.roots is None else len(self.roots)
        return [None] * count if self.modes is None else [k or None for k in self.modes.tolist()]

    @property
    def eigenvalues(self) -> tuple[Eigenvalue, ...]:
        """The roots without their vectors; none where the branch does not reach."""
        if self.roots is None or self.residuals is None:
            return ()
        none = np.empty(0, dtype=complex)
        rounding = np.zeros_like(self.residuals) if self.rounding is None else self.rounding
        each = zip(*(x.tolist() for x in (self.roots, self.residuals, rounding)), strict=True)
        return tuple(Eigenvalue(z, none, none, error, math.nan, own) for z, error, own in each)

    def to_dict(self, parameter: str) -> dict[str, Any]:
        records = Table(ROOT, self.eigenvalues).records()
        pairs = zip(self.numbers, records, strict=True)
        rows = [{k: v for k, v in ({"mode": n} | row).items() if v is not None} for n, row in pairs]
        if self.corrected is not None:
            known = zip(rows, self.eigenvalues, self.corrected.tolist(), strict=True)
            rows = [row | {"error": root.rounding, "corrected": how} for row, root, how in known]
        row = valued(parameter, self.value) | {"eigenvalues": None if self.roots is None else rows}
        row |= picked(self, "verdict spurious")
        row |= {} if self.certified is None else picked(self, "certified")
        return row if self.admissible is None else row | picked(self, "contact admissible")


def numbered(
    steps: Sequence[Step], at: Callable[[float], State] | None, own: float, spare: int = 10**6
) -> tuple[list[Step], tuple[Loss, ...], Step]:
    """Rows of a sweep by rising value, whose modes (m,) have their numbers: those by frequency at
    the value `own`, else at the first, then others as they appear. And the losses, and the row of
    that value. at: the roots that are followed, at up to `spare` values more, None of one row."""
    ids, losses = [mode_numbers(np.asarray(step.roots)) for step in steps], list[Loss]()
    if at is not None:
        ids, losses = follow(at, [step.value for step in steps], spare)
        both = zip(steps, ids, strict=True)
        ids = [numbers_at(at(step.value), i, np.asarray(step.roots)) for step, i in both]
    first = next((k for k, step in enumerate(steps) if step.value == own), 0)
    number: dict[int, int] = {}
    for k in (first, *range(len(steps))):
        roots, rank = steps[k].roots, max(number.values(), default=0)
        at_own = [] if roots is None else mode_numbers(roots).tolist()
        for one, rank_here in zip(ids[k].tolist(), at_own, strict=True):
            if one and one not in number:
                number[one] = rank_here if k == first else (rank := rank + 1)
    rows = [
        replace(step, modes=np.array([number.get(i, 0) for i in each.tolist()], dtype=int))
        for step, each in zip(steps, ids, strict=True)
    ]
    named = (
        one._replace(modes=tuple(sorted(number[i] for i in one.modes if i in number)))
        for one in losses
    )
    kept = tuple(one for one in named if len(one.modes) > (one.kind == "meet"))
    return rows, kept, rows[first]


@dataclass(frozen=True)
class SweptMode:
    """A mode over a sweep: frequencies (Hz) at the first and last value that have it, its fastest
    growth (1/s) and the value of that; where its growth begins, between which values (None where it
    never grows, or from the first value on)."""

    mode: int
    first_hz: float
    last_hz: float
    growth_rate: float
    at: float
    onset: float | None = None
    interval: tuple[float, float] | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Sweep(Answer):
    """Eigenvalues at values of the parameter.

    A mode keeps its number, which it has by frequency at the row `own`, that of the subject's own
    value if this lies between the others, else the first one; losses: where that is in doubt;
    names: of modes by number; basis tells of a reduced system that served.
    """

    name: str
    parameter: str
    steps: tuple[Step, ...]
    losses: tuple[Loss, ...] = ()
    own: Step | None = None
    names: Mapping[int, str] = field(default_factory=dict)
    basis: Mapping[str, Any] | None = None
    source: Any = None

    @property
    def warnings(self) -> tuple[str, ...]:  # type: ignore[override]
        """How many of the values have no equilibrium that the model means, or may lack roots."""
        lines, doubts = [], {"admissible": "have no equilibrium that the model means"}
        doubts |= {"certified": f"are {UNSURE}"}
        for key, words in doubts.items():
            lost = [step.value for step in self.steps if getattr(step, key) is False]
            count = f"{len(lost)} of {len(self.steps)} values of {self.parameter}, the first "
            lines += [f"sweep: {count}of them {value:.6g}, {words}" for value in lost[:1]]
        return tuple(lines)

    def named(self, names: Mapping[int, str]) -> Sweep:
        """The same with names of modes by their numbers."""
        return replace(self, names={**self.names, **names})

    @property
    def modes(self) -> tuple[SweptMode, ...]:
        """Each mode by its number."""
        each: dict[int, list[tuple[float, Eigenvalue]]] = {}
        known = {step.value: step for step in (*self.steps, self.own) if step is not None}
        for _, step in sorted(known.items()):
            at: dict[int, Eigenvalue] = {}  # of two real ones that which grows faster
            for e, k in zip(step.eigenvalues, step.numbers, strict=True):
                if k and e.value.imag >= 0.0 and (k not in at or e.growth_rate > at[k].growth_rate):
                    at[k] = e
            for k, e in at.items():
                each.setdefault(k, []).append((step.value, e))
        return tuple(_swept(k, path) for k, path in sorted(each.items()))

    def onsets(self, found: Eigenvalues) -> dict[UnstableMode, dict[str, Any]]:
        """Where modes that grow at the own value began to."""
        own = self.own is not None and found.value == self.own.value
        known = {mode.mode: picked(mode, "onset interval") for mode in self.modes if own}
        return {one: known[k] for one in found.unstable if (k := found.mode_of(one)) in known}

    @property
    def looked(self) -> bool:
        """True of a first look, whose roots are estimated or corrected."""
        return any(step.corrected is not None for step in self.steps)

    def table(self) -> Table:
        """A row for each root at each value; one without numbers where there is none."""
        others = [Column("contact", value=lambda row: row[0].contact)]
        others.append(Column("mode", value=itemgetter(2)))
        if self.names:
            others.append(Column("name", value=lambda row: self.names.get(row[2])))
        others += [
            Column(c.name, c.unit, lambda row, of=c.of: row[1] and of(row[1]))  # type: ignore[misc]
            for c in ROOT
            if c.name not in ("damping_ratio", "condition")
        ]
        if self.looked:
            others.append(Column("error", "1/s", lambda row: row[1] and row[1].rounding))
            others.append(Column("how", value=lambda row: row[1] and _how(row[0], row[1])))
        others.append(Column("verdict", value=lambda row: row[0].verdict))
        rows: list[Any] = []
        for step in self.steps:
            pairs = zip(step.eigenvalues, step.numbers, strict=True)
            rows += [(step, *pair) for pair in pairs] or [(step, None, None)]
        name = led(self.parameter, [column.name for column in others])
        return Table([Column(name, value=lambda row: row[0].value), *others], rows)

    def parts(self) -> Sequence[str | Table]:

        def verdict(step: Step) -> str:
            return step.verdict or ("no equilibrium on the branch" if step.roots is None else "-")

        def largest(step: Step) -> tuple[Any, Any]:
            each = [(root.growth_rate, root.rounding) for root in step.eigenvalues]
            return max(each, default=(None, None))

        contact = (Column("contact"),) * any(step.contact is not None for step in self.steps)
        look = (
            Column("error, 1/s", shown=lambda step: number(largest(step)[1] or 0.0, 2)),
            Column("corrected", value=lambda step: int(np.sum(step.corrected))),
        ) * self.looked
        table = (
            Column(self.parameter, value=attrgetter("value")),
            *contact,
            Column("frequencies, Hz", value=lambda step: _hertz(step, growing=False)),
            Column("growing, Hz", value=lambda step: _hertz(step, growing=True)),
            Column("largest real, 1/s", value=lambda step: largest(step)[0]),
            *look,
            Column("verdict", value=verdict),
        )

        each = (
            Column("mode"),
            *(Column("name", value=lambda mode: self.names.get(mode.mode)),) * bool(self.names),
            Column("first_hz"),
            Column("last_hz"),
            Column("growth_rate", "1/s", words="largest real, 1/s"),
            Column("at", words=f"at {self.parameter}"),
            onset_of(self.parameter),
        )
        basis = [] if self.basis is None else [basis_text(self.basis)]
        count = [sum(root.kind in GROWING for root in step.eigenvalues) for step in self.steps]
        pairs = zip(itertools.pairwise(self.steps), itertools.pairwise(count), strict=True)
        edges = {id(step) for both, (a, b) in pairs if a != b for step in both}
        title = f"sweep of {self.parameter}"
        first = Table(table, self.steps, title, rank=lambda step: id(step) in edges)
        title = "modes"
        if self.own is not None:
            title += f", numbered as at {self.parameter} = {number(self.own.value)}"
        modes = Table(each, self.modes, title, rank=_growth)
        return [first, modes, "\n".join(self.lost()), *basis]

    def lost(self) -> list[str]:
        """A sentence for each place where it is not known which mode is which."""
        words = {
            "meet": "meet, as at an onset of flutter; from there on their numbers are a convention",
            "end": "leave the band, or are not recognised further on",
            "begin": "enter the band, or were not recognised before",
        }
        return [
            f"between {self.parameter} = {number(loss.low)} and {number(loss.high)} "
            f"modes {', '.join(map(str, loss.modes))} {words[loss.kind]}"
            for loss in self.losses
        ]

    def to_dict(self) -> dict[str, Any]:
        rows = [step.to_dict(self.parameter) for step in self.steps]
        modes = [asdict(mode) | {"name": self.names.get(mode.mode)} for mode in self.modes]
        return {
            "parameter": self.parameter,
            "sweep": rows,
            "modes": modes,
            "lost": [loss._asdict() for loss in self.losses],
            **picked(self, "basis"),
        }


def onset_of(parameter: str) -> Column:
    """The column of where modes begin to grow: at a value, or between two of them."""

    def shown(mode: Any) -> str:
        if mode.onset is None:
            return "-"
        low, high = map(number, mode.interval or [mode.onset] * 2)
        return low if low == high else f"{low} to {high}"

    return Column("onset", shown=shown, words=f"grows from {parameter}")


def _swept(mode: int, path: list[tuple[float, Eigenvalue]]) -> SweptMode:
    """A mode from its roots by rising value; growth begins between two values."""
    at, fastest = max(path, key=lambda pair: pair[1].growth_rate)
    onset, interval = None, None
    for (low, before), (high, after) in itertools.pairwise(path):
        if interval is None and after.kind in GROWING and before.kind not in GROWING:
            rates, interval = (min(before.growth_rate, 0.0), after.growth_rate), (low, high)
            onset = low + (high - low) * rates[0] / (rates[0] - rates[1])
    hertz = path[0][1].frequency_hz, path[-1][1].frequency_hz
    return SweptMode(mode, *hertz, fastest.growth_rate, at, onset, interval)


def _how(step: Step, root: Eigenvalue) -> str:
    """Whether a root of a first look is corrected or estimated."""
    done = step.corrected is not None and step.corrected[step.roots == root.value].any()
    return "corrected" if done else "estimated"


def _hertz(step: Step, growing: bool) -> str:
    """Frequencies of the upper roots, or of those that grow, in a line."""
    roots = [e for e in step.eigenvalues if e.value.imag >= 0.0]
    some = [e.kind in GROWING if growing else e.value.imag > 0.0 for e in roots]
    each = np.sort([e.frequency_hz for e in itertools.compress(roots, some)])
    more = f", {len(each) - LISTED} more" if len(each) > LISTED else ""
    return (", ".join(map(number, each[:LISTED].tolist())) or "-") + more


MOVED = "how far the reduction of components moves this is not known, a higher cutoff tells"


def basis_text(basis: Mapping[str, Any], errors: bool = False) -> str:
    """A reduced system for people; `errors`: whether those of components are given beside it."""
    if basis["method"] == "components":
        text = (
            f"{basis['size']} rows reduced from {basis['rows']}, modes of components up to "
            f"{basis['cutoff_hz']:g} Hz; counts are of the reduced system"
        )
        return text if errors else f"{text}\n{MOVED}"
    if basis["method"] == "modal":
        text = (
            f"first look: real modes up to {basis['real_modes_hz']:.4g} Hz and their corrections, "
            f"{basis['size']} vectors; not certified: nothing was counted"
        )
    else:
        text = (
            f"basis of {basis['size']} vectors ({basis['method']}), {len(basis['samples'])} "
            f"solutions of all {basis['rows']} rows; worst residual there {basis['residual']:.2g}"
        )
    if basis["spurious"]:
        text += f"; {basis['spurious']} roots that the full problem has not are left out"
    if basis["growth_limit"] is not None:
        text += f"\nroots that grow by more than {basis['growth_limit']:.4g} 1/s are left out"
    return text


@dataclass(frozen=True, eq=False, repr=False)
class Thresholds(Answer):
    """Every change of the verdict, and every crossing of the imaginary axis, in a range.

    parameter: what is varied, from low to high; verdict: at the lower end, None if it is open;
    points: changes of the verdict; end: why the search ends at `high`; certified: whether counts of
    what grows agree with the list, None where nothing is counted. notes: lines for people; details:
    what else the JSON object says, `admissible_to` among it: how far the equilibria of a pad are
    those that the model means; warnings: why not farther, or why a scene's own mu is not on the
    branch. proof: what the referee says, as JSON holds it, None where it is not asked; proof_line
    in words.
    """

    name: str
    parameter: str
    low: float
    high: float
    verdict: str | None
    points: tuple[CriticalPoint, ...]
    crossings: tuple[Crossing, ...]
    end: str
    certified: bool | None
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    details: Mapping[str, Any] = field(default_factory=dict)
    source: Any = None
    proof: Mapping[str, Any] | None = None
    proof_line: str = ""

    @property
    def first(self) -> CriticalPoint | None:
        """The first threshold at which stability or the equilibrium is lost."""
        return next((point for point in self.points if point.kind != "restabilised"), None)

    def onsets(self, found: Eigenvalues) -> dict[UnstableMode, dict[str, Any]]:
        """Where modes that grow began to: the crossings nearest in frequency, if as many lead up to
        there as modes grow; none where that is not so."""
        modes, begun = found.unstable, [c for c in self.crossings if c.mu <= found.value]
        if not modes or len(begun) != len(modes) or any(c.direction != "up" for c in begun):
            return {}
        cost = [[abs((m.frequency_hz or 0) - (c.frequency_hz or 0)) for c in begun] for m in modes]
        pairs = zip(modes, assigned(np.array(cost)), strict=True)
        return {m: {"onset": begun[k].mu, "interval": begun[k].interval} for m, k in pairs}

    def table(self) -> Table:
        changes = {point.mu: point.kind for point in self.points}
        crossed = {c.mu for c in self.crossings if c.changes_verdict}
        rows = [*self.crossings, *(point for point in self.points if point.mu not in crossed)]

        def change(row: Any) -> str | None:
            return changes.get(row.mu) if getattr(row, "changes_verdict", True) else None

        table = (
            Column("mu", shown=lambda row: located(row.mu, *row.interval), words=self.parameter),
            Column("kind"),
            Column("direction", value=lambda row: getattr(row, "direction", None)),
            Column("frequency_hz"),
            Column("verdict", value=change),
            Column("low", value=lambda row: row.interval[0], hidden=True),
            Column("high", value=lambda row: row.interval[1], hidden=True),
            Column("error", value=lambda row: number((row.interval[1] - row.interval[0]) / 2, 2)),
        )
        return Table(table, sorted(rows, key=attrgetter("mu")), nothing="no change of stability")

    def parts(self) -> Sequence[str | Table]:
        proof = "certified: a count of growing roots between the crossings agrees"
        if self.proof_line:
            proof = self.proof_line
        elif not self.certified:
            doubts = self.details.get("doubts") or ["nothing was counted"]
            proof = f"not certified: {'; '.join(doubts)}"
        end = f"followed up to {self.parameter} = {self.high:.9g}: {self.end}"
        head = f"{self.name}: at {self.parameter} = {number(self.low)}: {self.verdict or 'open'}"
        return [head, self.table(), "\n".join([*self.notes, proof, end])]

    def to_dict(self) -> dict[str, Any]:
        points, crossings = (
            [valued(self.parameter, one.mu) | asdict(one) for one in each]
            for each in (self.points, self.crossings)
        )
        answer = picked(self, "name parameter end certified") | {
            "critical": points,
            "crossings": crossings,
            "verdict_at_start": self.verdict,
            "verdict_at_zero": self.verdict if self.low == 0.0 else None,
            "mu_start": self.low,
            "mu_end": self.high,
        }
        answer |= {} if self.proof is None else {"proof": dict(self.proof)}
        return answer | picked(self, "details")["details"]
