"""What the verbs answer with, for a pad and for matrices alike: one record and one table a verb."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from operator import itemgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from squeal.io.writing import Answer, Column, Table, columns, located, number, plain
from squeal.linear import GROWING, CriticalPoint, Crossing, UnstableMode
from squeal.linear.eigen import Eigenvalue
from squeal.schema.values import Number, Place, Whole

LISTED = 8  # frequencies in a line of a table
DEGREE = math.pi / 180

ROOT = (
    Column("real", "1/s", lambda root: root.value.real),
    Column("imag", "rad/s", lambda root: root.value.imag),
    *columns("frequency_hz damping_ratio"),
    Column("residual", shown=lambda root: number(root.residual, 2)),
    Column("condition", value=lambda root: plain(root.condition), hidden=True),
)
"""Columns of an eigenvalue, and its keys in JSON."""


def root_row(root: Eigenvalue) -> dict[str, Any]:
    """An eigenvalue as a JSON row."""
    return {column.name: column.of(root) for column in ROOT}


def of_second(column: Column) -> Column:
    """The column in rows whose second entry is its record, or None."""
    return replace(
        column,
        value=lambda row: None if row[1] is None else column.of(row[1]),
        shown=lambda row: "-" if row[1] is None else column.cell(row[1]),
    )


def shape_rows(shapes: Sequence[ModeShape], names: Sequence[str], rule: str) -> dict[str, Any]:
    """Mode shapes as a JSON object."""
    rows = [
        {"mode": one.number, "frequency_hz": one.frequency_hz, "growth_rate": one.growth_rate}
        | {"real": one.shape.real.tolist(), "imag": one.shape.imag.tolist()}
        for one in shapes
    ]
    return {"coordinates": list(names), "normalisation": rule, "shapes": rows}


def valued(parameter: str, value: float | None) -> dict[str, Any]:
    """The value of the parameter as answers hold it; `mu` is its key for scripts."""
    return {"parameter": parameter, "value": value, "mu": value}


def led(
    leads: Iterable[tuple[str, str]], others: Sequence[Column], rows: Sequence[Any], at: Any
) -> Table:
    """A table led by columns of parameters (name, unit), of which at(k, row) is the value; one
    whose name another column has is called parameter.NAME."""
    taken = {column.name for column in others}
    columns = [
        Column(f"parameter.{name}" if name in taken else name, unit, partial(at, k))
        for k, (name, unit) in enumerate(leads)
    ]
    return Table([*columns, *others], rows)


def hertz(roots: Iterable[Eigenvalue]) -> str:
    """Frequencies in a line."""
    every = sorted(root.frequency_hz for root in roots)
    more = f", {len(every) - LISTED} more" if len(every) > LISTED else ""
    return (", ".join(map(number, every[:LISTED])) or "-") + more


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
    verdict: of these, None where they decide nothing; certified: whether a count says that none of
    the extent is missing; unstable: the modes that grow, the fastest first; shapes: mode shapes as
    JSON holds them; details: what else the JSON object says, M, C and K among it; notes: lines for
    people; source: the analysis behind it.
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
    warnings: tuple[str, ...] = ()
    source: Any = None

    @property
    def values(self) -> NDArray[np.complex128]:
        """The eigenvalues (m,) in rad/s."""
        return np.array([root.value for root in self.eigenvalues], dtype=complex)

    def filtered(self, low: float, high: float) -> Eigenvalues:
        """The same with the unstable modes alone that have a frequency (Hz) from low to high."""
        modes = tuple(mode for mode in self.unstable if low <= mode.frequency_hz <= high)
        left = len(self.unstable) - len(modes)
        note = (f"{left} more unstable modes are not asked for",) * bool(left)
        return replace(self, unstable=modes, notes=self.notes + note)

    def table(self) -> Table:
        """A row for each eigenvalue."""
        number_column = Column("mode", value=itemgetter(0))
        rows = list(enumerate(self.eigenvalues, 1))
        return Table((number_column, *map(of_second, ROOT)), rows, nothing="no root")

    def growing(self) -> Table:
        """A row for each unstable mode."""
        table = (
            *columns("kind frequency_hz"),
            Column("growth_rate", "1/s"),
            Column("damping_ratio"),
            Column(f"onset, {self.parameter}", value=lambda mode: mode.onset),
        )
        return Table(table, self.unstable, "unstable modes", "no unstable mode is listed")

    def parts(self) -> Sequence[str | Table]:
        head = f"{self.name}, {self.parameter} = {number(self.value)}"
        where = f" on {self.extent}" if self.extent else ""
        proof = "none is missing (count)" if self.certified else "the list may be incomplete"
        verdict = f"verdict{where}: {self.criterion}\n{len(self.eigenvalues)} roots, {proof}"
        return [head, *self.notes[:1], self.table(), verdict, self.growing(), *self.notes[1:]]

    def to_dict(self) -> dict[str, Any]:
        head = {"name": self.name} | valued(self.parameter, self.value) | dict(self.details)
        return head | {
            "eigenvalues": [root_row(root) for root in self.eigenvalues],
            "verdict": self.verdict,
            "criterion": self.criterion,
            "certified": self.certified,
            "count": self.count,
            "unstable": [asdict(mode) for mode in self.unstable],
            "mode_shapes": self.shapes,
        }


@dataclass(frozen=True, eq=False)
class Step:
    """Roots (m,) at one value of the parameter, the verdict on them and their backward errors.

    Of a pad `contact` names the contact state; roots are None where its branch does not reach.
    """

    value: float
    roots: NDArray[np.complex128] | None = field(repr=False)
    residuals: NDArray[np.float64] | None = field(repr=False)
    verdict: str | None
    contact: str | None = None
    admissible: bool | None = None
    spurious: int = 0

    @property
    def eigenvalues(self) -> tuple[Eigenvalue, ...]:
        """The roots without their vectors; none where the branch does not reach."""
        if self.roots is None or self.residuals is None:
            return ()
        none = np.empty(0, dtype=complex)
        pairs = zip(self.roots.tolist(), self.residuals.tolist(), strict=True)
        return tuple(Eigenvalue(root, none, none, error, math.nan) for root, error in pairs)

    def growing(self) -> tuple[Eigenvalue, ...]:
        """The roots that grow, of pairs the upper one."""
        upper = (root for root in self.eigenvalues if root.value.imag >= 0.0)
        return tuple(root for root in upper if root.growth_rate > 1e-9 * abs(root.value))

    def to_dict(self, parameter: str) -> dict[str, Any]:
        """The step as a JSON row."""
        rows = [
            {name: plain(v) for name, v in root_row(root).items() if plain(v) is not None}
            for root in self.eigenvalues
        ]
        row = valued(parameter, self.value) | {"eigenvalues": None if self.roots is None else rows}
        row |= {"verdict": self.verdict, "spurious": self.spurious}
        if self.admissible is not None:
            row |= {"contact": self.contact, "admissible": self.admissible}
        return row


@dataclass(frozen=True, eq=False, repr=False)
class Sweep(Answer):
    """Eigenvalues at values of the parameter; `basis` tells of a reduced system that served."""

    name: str
    parameter: str
    steps: tuple[Step, ...]
    basis: Mapping[str, Any] | None = None
    source: Any = None

    @property
    def warnings(self) -> tuple[str, ...]:  # type: ignore[override]
        """How many of the values have no equilibrium that the model means."""
        lost = [step.value for step in self.steps if step.admissible is False]
        if not lost:
            return ()
        return (
            f"sweep: {len(lost)} of {len(self.steps)} values of {self.parameter}, the first of "
            f"them {lost[0]:.6g}, have no equilibrium that the model means",
        )

    def table(self) -> Table:
        """A row for each root at each value; one without numbers where there is none."""
        root = {column.name: of_second(column) for column in ROOT}
        table = (
            Column("contact", value=lambda row: row[0].contact),
            *(root[name] for name in ("real", "imag", "frequency_hz", "residual")),
            Column("verdict", value=lambda row: row[0].verdict),
        )
        pairs = [(step, root) for step in self.steps for root in step.eigenvalues or [None]]
        return led([(self.parameter, "")], table, pairs, lambda _, row: row[0].value)

    def parts(self) -> Sequence[str | Table]:
        """A row for each value: frequencies, what grows of them, how fast, and the verdict."""

        def upper(step: Step) -> str:
            return hertz(root for root in step.eigenvalues if root.value.imag > 0.0)

        def verdict(step: Step) -> str:
            return step.verdict or ("no equilibrium on the branch" if step.roots is None else "-")

        def largest(step: Step) -> float | None:
            return max((root.growth_rate for root in step.eigenvalues), default=None)

        contact = (Column("contact"),) * any(step.contact is not None for step in self.steps)
        table = (
            Column(self.parameter, value=lambda step: step.value),
            *contact,
            Column("frequencies, Hz", value=upper),
            Column("growing, Hz", value=lambda step: hertz(step.growing())),
            Column("largest real, 1/s", value=largest),
            Column("verdict", value=verdict),
        )
        basis = [] if self.basis is None else [basis_text(self.basis)]
        return [Table(table, self.steps, f"sweep of {self.parameter}"), *basis]

    def to_dict(self) -> dict[str, Any]:
        rows = [step.to_dict(self.parameter) for step in self.steps]
        return {"parameter": self.parameter, "sweep": rows, "basis": self.basis}


def basis_text(basis: Mapping[str, Any]) -> str:
    """A reduced system for people."""
    text = (
        f"basis of {basis['size']} vectors ({basis['method']}), {len(basis['samples'])} full "
        f"solutions; worst residual in the full problem {basis['residual']:.2g}"
    )
    if basis["spurious"]:
        text += f"; {basis['spurious']} roots that the full problem has not are left out"
    if basis["growth_limit"] is not None:
        text += f"\nroots that grow by more than {basis['growth_limit']:.4g} 1/s are left out"
    return text


@dataclass(frozen=True, eq=False, repr=False)
class Thresholds(Answer):
    """Every change of the verdict, and every crossing of the imaginary axis, in a range.

    parameter: what is varied, from low to high; verdict: at the lower end; points: changes of the
    verdict; end: why the search ends at `high`; certified: whether counts of what grows agree with
    the list, None where nothing is counted. notes: lines for people; details: what else the JSON
    object says, `admissible_to` among it: how far the equilibria of a pad are those that the model
    means; warnings: why not farther, or why a scene's own mu is not on the branch.
    """

    name: str
    parameter: str
    low: float
    high: float
    verdict: str
    points: tuple[CriticalPoint, ...]
    crossings: tuple[Crossing, ...]
    end: str
    certified: bool | None
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    details: Mapping[str, Any] = field(default_factory=dict)
    source: Any = None

    @property
    def first(self) -> CriticalPoint | None:
        """The first threshold at which stability or the equilibrium is lost."""
        return next((point for point in self.points if point.kind != "restabilised"), None)

    def stable_to(self, most: float) -> float | None:
        """The least value from 0 to `most` without a stable equilibrium; None if there is none.

        0 if it grows there; also where the branch of a pad ends without a threshold.
        """
        if self.verdict in GROWING:
            return 0.0
        if self.first is not None:
            return self.first.mu
        return self.high if self.high < most else None

    def table(self) -> Table:
        """A row for each crossing, and for each change of verdict where nothing crosses."""
        changes = {point.mu: point.kind for point in self.points}
        crossed = {c.mu for c in self.crossings if c.changes_verdict}
        every: list[CriticalPoint | Crossing] = [*self.crossings]
        every += [point for point in self.points if point.mu not in crossed]

        def verdict(row: CriticalPoint | Crossing) -> str | None:
            return changes.get(row.mu) if getattr(row, "changes_verdict", True) else None

        def half(row: CriticalPoint | Crossing) -> str:
            return number((row.interval[1] - row.interval[0]) / 2, 2)

        def place(row: CriticalPoint | Crossing) -> str:
            return located(row.mu, *row.interval)

        table = (
            Column("mu", shown=place, words=self.parameter),
            Column("kind"),
            Column("direction", value=lambda row: getattr(row, "direction", None)),
            Column("frequency_hz"),
            Column("mode", value=lambda row: getattr(row, "mode", None)),
            Column("verdict", value=verdict),
            Column("low", value=lambda row: row.interval[0], hidden=True),
            Column("high", value=lambda row: row.interval[1], hidden=True),
            Column("error", value=half),
            Column("changes_verdict", value=lambda row: int(verdict(row) is not None), hidden=True),
        )
        return Table(table, sorted(every, key=lambda row: row.mu), nothing="no change of stability")

    def parts(self) -> Sequence[str | Table]:
        count = {
            True: ["a count of growing roots between the crossings agrees"],
            False: ["a count of growing roots between the crossings does NOT agree"],
            None: [],
        }[self.certified]
        head = f"{self.name}: at {self.parameter} = {number(self.low)}: {self.verdict}"
        tail = f"followed up to {self.parameter} = {self.high:.9g}: {self.end}"
        return [head, self.table(), "\n".join([*self.notes, *count, tail])]

    def to_dict(self) -> dict[str, Any]:
        points, crossings = (
            [valued(self.parameter, one.mu) | asdict(one) for one in each]
            for each in (self.points, self.crossings)
        )
        return {
            "name": self.name,
            "parameter": self.parameter,
            "critical": points,
            "crossings": crossings,
            "verdict_at_start": self.verdict,
            "verdict_at_zero": self.verdict if self.low == 0.0 else None,
            "mu_start": self.low,
            "mu_end": self.high,
            "end": self.end,
            "certified": self.certified,
        } | dict(self.details)


@dataclass(frozen=True)
class Axis:
    """One parameter of a map: n values at the middles of n equal cells between low and high.

    log: the cells are equal in the logarithm. Raises InputError for an empty range.
    """

    name: str
    low: float
    high: float
    n: int
    log: bool = False

    def __post_init__(self) -> None:
        at = Place("Axis", self.name)
        Whole(1, 100_000).read(self.n, at / "n")
        Number().check(self.low, at / "low")
        Number().check(self.high, at / "high")
        if not self.low < self.high or (self.log and not self.low > 0.0):
            allowed = "a range with low < high" + (", above 0 on a logarithmic axis" * self.log)
            raise at.must_be(f"{self.low:g} to {self.high:g}", allowed)

    @property
    def values(self) -> NDArray[np.float64]:
        """The n values."""
        low, high = self.ends
        return np.asarray(self.uneven(low + (high - low) * (np.arange(self.n) + 0.5) / self.n))

    @property
    def ends(self) -> tuple[float, float]:
        """Both ends as the cells are equal in them."""
        return self.even(self.low), self.even(self.high)

    def at(self, share: Any) -> Any:
        """Values at shares of the way from low to high."""
        low, high = self.ends
        return self.uneven(low + (high - low) * share)

    def even(self, value: Any) -> Any:
        """Values as the cells are equal in them: themselves or their logarithms."""
        return np.log10(value) if self.log else value

    def uneven(self, value: Any) -> Any:
        """What `even` was made from."""
        return 10.0**value if self.log else value


@dataclass(frozen=True, eq=False, repr=False)
class Map(Answer):
    """The verdict over two parameters.

    codes (n1, n2): indices into `verdicts`; quantity: name, unit and values (n1, n2) of a number
    beside them; admissible (n1, n2): where a pad has an equilibrium that the model means.
    """

    name: str
    axes: tuple[Axis, Axis]
    units: tuple[str, str]
    verdicts: tuple[str, ...]
    codes: NDArray[np.int8]
    quantity: tuple[str, str, NDArray[np.float64]] | None = None
    admissible: NDArray[np.bool_] | None = None
    warnings: tuple[str, ...] = ()
    details: Mapping[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    source: Any = None

    @property
    def share(self) -> dict[str, float]:
        """Share of the area for each verdict."""
        counts = np.bincount(self.codes.ravel(), minlength=len(self.verdicts))
        pairs = zip(self.verdicts, counts.tolist(), strict=True)
        return {name: count / self.codes.size for name, count in pairs}

    def table(self) -> Table:
        """A row for each point: parameters, verdict, quantity, admissible (1 or 0)."""
        x, y = np.meshgrid(*(axis.values for axis in self.axes), indexing="ij")
        parts: dict[tuple[str, str], Any] = {("verdict", ""): np.array(self.verdicts)[self.codes]}
        if self.quantity is not None:
            parts[self.quantity[:2]] = self.quantity[2]
        if self.admissible is not None:
            parts["admissible", ""] = self.admissible.astype(int)
        others = [Column(*head, itemgetter(k)) for k, head in enumerate(parts, 2)]
        rows = zip(*(part.ravel().tolist() for part in (x, y, *parts.values())), strict=True)
        leads = [(axis.name, unit) for axis, unit in zip(self.axes, self.units, strict=True)]
        return led(leads, others, list(rows), lambda k, row: row[k])

    def parts(self) -> Sequence[str | Table]:
        (a, b), shape = self.axes, self.codes.shape
        title = f"share of the area: {a.name} x {b.name}, {shape[0]} x {shape[1]} points"
        shares = (
            Column("verdict", value=itemgetter(0)),
            Column("share, %", value=lambda pair: f"{100 * pair[1]:.3f}"),
        )
        return [Table(shares, list(self.share.items()), title), *self.notes]

    def curves(self) -> Table:
        """A row for each point of each curve on which stability is lost."""
        names = ["curve", *(axis.name for axis in self.axes), "kind", "frequency_hz"]
        rows = [
            (k, *point, curve["kind"], hertz)
            for k, curve in enumerate(self.details["threshold_curve"], 1)
            for point, hertz in zip(curve["points"], curve["frequency_hz"], strict=True)
        ]
        heads = enumerate(zip(names, ["", *self.units, "", ""], strict=True))
        return Table([Column(name, unit, itemgetter(k)) for k, (name, unit) in heads], rows)

    def to_dict(self) -> dict[str, Any]:
        axes = [
            {"name": axis.name, "low": axis.low, "high": axis.high}
            | {"scale": "log" if axis.log else "linear"}
            for axis in self.axes
        ]
        answer = {"share": self.share, "n": int(self.codes.shape[0]), "axes": axes}
        if self.admissible is not None:
            answer["admissible_share"] = float(self.admissible.mean())
        if self.quantity is not None:
            name, unit, numbers = self.quantity
            rows = [[plain(value) for value in row] for row in numbers.tolist()]
            answer |= {"quantity": name, "unit": unit, "values": rows}
        return answer | dict(self.details)


@dataclass(frozen=True, eq=False, repr=False)
class Sensitivity(Answer):
    """Derivatives by each parameter, per unit of it, all others held.

    what: the eigenvalues `at`, by rising frequency, or the first loss of stability in `parameter`
    at a value of it; slopes: (m,) of the eigenvalues, not finite at a coalescence, or (1,) of the
    loss, empty where stability is not lost; values, units: of the parameters; angles among them.
    """

    what: str
    parameter: str
    at: Any
    kind: str
    slopes: Mapping[str, np.ndarray]
    values: Mapping[str, float]
    units: Mapping[str, str]
    angles: frozenset[str] = frozenset()

    def step(self, name: str) -> float:
        """The change of a parameter that the text shows: 1 per cent, of an angle one degree."""
        return DEGREE if name in self.angles else 0.01 * self.values[name]

    def table(self) -> Table:
        """A row for each parameter: its unit, and the derivative of each eigenvalue or the loss."""

        def part(i: int, name: str, row: str) -> float:
            return float(getattr(self.slopes[row][i], name))

        table = [Column("parameter", value=str), Column("unit", value=self.units.__getitem__)]
        if self.what == "threshold":
            table.append(Column("slope", value=partial(part, 0, "real")))
        else:
            for i in range(len(next(iter(self.slopes.values()), ()))):
                for name in ("real", "imag"):
                    table.append(Column(f"{name}_{i + 1}", value=partial(part, i, name)))
        return Table(table, list(self.slopes))

    def parts(self) -> Sequence[str | Table]:
        """What a small change of each parameter does."""
        if self.what == "threshold" and not self.slopes:
            return ["stability is not lost, so nothing moves its loss"]

        def moved(i: int, factor: complex, row: str) -> str:
            slope = complex(self.slopes[row][i])
            change = (slope * factor).real * self.step(row)
            return f"{change + 0.0:+.3g}" if cmath.isfinite(slope) else "-"

        table = [
            Column("parameter", value=str),
            Column("change", value=lambda row: "1 degree" if row in self.angles else "1 %"),
        ]
        if self.what == "threshold":
            title = f"what moves the first loss ({self.kind} at {self.parameter} = {self.at:.6g})"
            table.append(Column(f"d {self.parameter}", value=partial(moved, 0, 1.0)))
        else:
            title = "what a small change of a parameter does to each mode"
            for i in np.flatnonzero(np.imag(self.at) >= 0.0).tolist():
                for words, factor in (("df, Hz", -1j / math.tau), ("dRe, 1/s", 1.0)):
                    table.append(Column(f"{i + 1}: {words}", value=partial(moved, i, factor)))
        return [Table(table, [name for name in self.slopes if self.step(name)], title)]

    def to_dict(self) -> dict[str, Any]:
        """Null where nothing is lost or two eigenvalues coincide."""
        if self.what == "threshold":
            slopes = {name: float(slope[0]) for name, slope in self.slopes.items()}
            loss = {"mu": self.at, "value": self.at, "kind": self.kind, "parameters": slopes}
            return {"sensitivity": loss if self.slopes else None}
        rows = [
            {"parameter": name, "unit": self.units[name]}
            | {
                "eigenvalues": [
                    {"real": d.real, "imag": d.imag} if cmath.isfinite(d) else None
                    for d in slopes.astype(complex).tolist()
                ]
            }
            for name, slopes in self.slopes.items()
        ]
        return {"sensitivity": rows}
