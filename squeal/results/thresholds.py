"""Every change of the verdict, and every crossing of the imaginary axis, in a range."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from operator import attrgetter
from typing import Any

import numpy as np

from squeal.io.writing import (
    Answer,
    Column,
    JsonObject,
    Panel,
    Table,
    copied_attributes,
    number,
    with_known_digits,
)
from squeal.linear import CriticalPoint, Crossing
from squeal.linear.roots import assigned
from squeal.linear.shaft import RPM, name_of_kind
from squeal.results.columns import parameter_entry, with_unit
from squeal.results.eigenvalues import Eigenvalues, Onsets
from squeal.results.sources import Source, unit_of

MISSED = "between the computed values may be missed"
"""The end of a note, which a proof takes back."""


@dataclass(frozen=True, eq=False, repr=False)
class Thresholds(Answer):
    """Every change of the verdict, and every crossing of the imaginary axis, in a range.

    parameter: what is varied, from low to high; verdict: at the lower end, None if it is open;
    points: changes of the verdict; end: why the search ends at `high`; certified: whether counts of
    what grows agree with the list, None where nothing is counted. notes: lines for people; seat: of
    joined components, where contact is seated and at which thresholds it would be another; details:
    what else the JSON object says, `admissible_to` among it: how far the equilibria of a pad are
    those that the model means; warnings: why not farther, or why a scene's own mu is not on the
    branch. proof: what the referee says, as JSON holds it, None where it is not asked; proof_line
    in words.

    Examples
    --------
    >>> import squeal
    >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}  # flutter from mu = 3/4 on
    >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"mu": 1.0}, name="pair")
    >>> found = squeal.thresholds(pair)
    >>> found.first.kind, round(found.first.mu, 9), found.certified
    ('flutter', 0.75, True)
    """

    panel = Panel("mu", "frequency_hz")

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
    seat: tuple[str, ...] = ()
    details: Mapping[str, Any] = field(default_factory=dict)
    source: Source | None = None
    proof: Mapping[str, Any] | None = None
    proof_line: str = ""

    @property
    def first(self) -> CriticalPoint | None:
        """The first threshold at which stability or the equilibrium is lost."""
        return next((point for point in self.points if point.kind != "restabilised"), None)

    @property
    def doubts(self) -> list[str]:
        """Why the list is not certified, in sentences; empty too where nothing was counted."""
        return self.details.get("doubts", [])

    @property
    def is_proved(self) -> bool:
        """Whether the referee has proved the list, up to the end of `extent` in `proof`."""
        return self.proof is not None and self.proof["status"] == "proved"

    def onsets(self, eigenvalues: Eigenvalues) -> Onsets:
        """Where unstable modes began to grow: at the crossings that are nearest in frequency.

        Of each mode `onset` and `interval`. Empty where crossings do not tell: where some up to the
        value of the eigenvalues lead back, or there are not as many as modes that grow.

        Examples
        --------
        >>> import squeal
        >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}  # flutter from mu = 3/4 on
        >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"mu": 1.0}, name="pair")
        >>> [onset] = squeal.thresholds(pair).onsets(squeal.eigenvalues(pair)).values()
        >>> round(onset["onset"], 9)
        0.75
        """
        modes = eigenvalues.unstable
        begun = [crossing for crossing in self.crossings if crossing.mu <= eigenvalues.value]
        all_upwards = all(crossing.direction == "up" for crossing in begun)
        if not modes or len(begun) != len(modes) or not all_upwards:
            return {}
        hertz_of_modes = np.array([mode.frequency_hz or 0 for mode in modes])
        hertz_of_crossings = np.array([crossing.frequency_hz or 0 for crossing in begun])
        distances = np.abs(hertz_of_modes[:, None] - hertz_of_crossings)
        onsets = {}
        for mode, k in zip(modes, assigned(distances), strict=True):
            onsets[mode] = {"onset": begun[k].mu, "interval": begun[k].interval}
        return onsets

    def table(self) -> Table:
        # rows are all crossings, and those changes of the verdict that are no crossing, such as a
        # fold. A change of the verdict by a crossing has exactly the value of this crossing
        verdict_from = {point.mu: point.kind for point in self.points}
        crossed = {crossing.mu for crossing in self.crossings if crossing.changes_verdict}
        rows: list[CriticalPoint | Crossing] = list(self.crossings)
        rows += [point for point in self.points if point.mu not in crossed]
        rows.sort(key=attrgetter("mu"))

        def new_verdict(row: CriticalPoint | Crossing) -> str | None:
            """The verdict from this row on; None where it stays."""
            if isinstance(row, Crossing) and not row.changes_verdict:
                return None
            return verdict_from.get(row.mu)

        def error(row: CriticalPoint | Crossing) -> float:
            """The largest distance of the value from the ends of its interval."""
            low, high = row.interval
            return max(high - row.mu, row.mu - low)

        unit = unit_of(self.source)
        columns = [
            Column(
                "mu",
                shown=lambda row: with_known_digits(row.mu, *row.interval),
                words=with_unit(self.parameter, unit),
            ),
            Column("kind", shown=lambda row: name_of_kind(row.kind, unit)),
            Column("direction", value=lambda row: getattr(row, "direction", None)),
            Column("frequency_hz"),
            Column(
                "verdict",
                value=new_verdict,
                shown=lambda row: name_of_kind(new_verdict(row) or "-", unit),
            ),
            Column("low", value=lambda row: row.interval[0], hidden=True),
            Column("high", value=lambda row: row.interval[1], hidden=True),
            Column("error", value=error, shown=lambda row: number(error(row), 2)),
        ]
        if unit:
            columns.insert(1, Column("rpm", value=lambda row: RPM * row.mu))
        nothing = "no change of stability"
        if self.details.get("unconfirmed"):  # growth begins at no listed threshold
            nothing += " was located"
        return Table(columns, rows, nothing=nothing)

    def parts(self) -> Sequence[str | Table]:
        if self.proof_line:
            proof = self.proof_line
        elif self.certified:
            proof = "certified by a count, not proved: what grows between the crossings agrees"
        else:
            proof = f"not certified: {'; '.join(self.doubts) or 'nothing was counted'}"
        # the line of the proof has the doubts of the seat already
        seat = [line for line in self.seat if line not in proof]
        end = f"followed up to {self.parameter} = {self.high:.9g}: {self.end}"
        verdict = name_of_kind(self.verdict or "open", unit_of(self.source))
        head = f"{self.name}: at {self.parameter} = {number(self.low)}: {verdict}"
        return [head, self.table(), "\n".join([*self.notes, *seat, proof, end])]

    def _entries(self, points: Sequence[CriticalPoint | Crossing]) -> list[JsonObject]:
        """Critical points or crossings as JSON holds them."""
        entries = []
        for point in points:
            entries.append(parameter_entry(self.parameter, point.mu) | asdict(point))
        return entries

    def to_dict(self) -> JsonObject:
        document = copied_attributes(self, "name parameter end certified") | {
            "critical": self._entries(self.points),
            "crossings": self._entries(self.crossings),
            "verdict_at_start": self.verdict,
            "verdict_at_zero": self.verdict if self.low == 0.0 else None,
            "mu_start": self.low,
            "mu_end": self.high,
        }
        if self.proof is not None:
            document["proof"] = dict(self.proof)
        return document | copied_attributes(self, "details")["details"]
