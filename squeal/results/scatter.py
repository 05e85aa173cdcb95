"""The answer of `scatter`: samples by rising value, their quantiles, shares and Sobol indices."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from squeal.io.writing import (
    Answer,
    JsonObject,
    Mark,
    Panel,
    Table,
    copied_attributes,
    in_order,
    number,
)
from squeal.linear.verdicts import ACCEPTED
from squeal.results.columns import parameter_heading
from squeal.schema import instance

LEVELS = (0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99)  # of the quantiles that are reported
CONFIDENCE = 0.95

Spread: TypeAlias = Annotated[
    Mapping[str, float | Sequence[float]],
    instance(Mapping, "a mapping such as {'relative': 0.05}, or of absolute, within or between"),
]
"""One of the keys relative, absolute, within and between, with its size."""
Measure: TypeAlias = Literal["threshold", "growth"]
"""What is computed of each sample."""


@dataclass(frozen=True)
class Sample:
    """One drawn set of parameters and the stability that was computed for it.

    Attributes
    ----------
    parameters : mapping of str to float
        The values that were drawn, by the parameter's name.
    value : float
        Of a threshold the critical friction, NaN if there is none in the range; of growth the
        largest real part of the roots in the band, 1/s.
    kind : str or None
        What happens there: flutter, divergence or the like; of growth the verdict, None where that
        of a reduced system, whose roots nobody counted, is not that something grows.
    frequency_hz : float or None
        Frequency of the mode that loses stability, or that grows fastest.
    unstable : int or None
        Of growth: how many modes of the band grow.
    propensity : float or None
        Of growth: the sum of the negative damping ratios ``Re / |lambda|`` of these modes.
    residual : float or None
        On a reduced system: the largest backward error of a root in the full problem.
    reason : str or None
        Why nothing could be computed; all other results are missing then.
    """

    parameters: Mapping[str, float]
    value: float = math.nan
    kind: str | None = None
    frequency_hz: float | None = None
    unstable: int | None = None
    propensity: float | None = None
    residual: float | None = None
    reason: str | None = None

    @property
    def has_no_threshold(self) -> bool:
        """True if stability is not lost within the range, or nothing could be computed."""
        return math.isnan(self.value)


class Index(NamedTuple):
    """Sobol indices of a parameter, each with its confidence interval (low, high).

    first: share of the variance that the parameter makes alone; total: share that it makes
    together with all its interactions.
    """

    parameter: str
    first: float
    first_interval: tuple[float, float]
    total: float
    total_interval: tuple[float, float]


class Quantile(NamedTuple):
    """The value below which a share `level` of the samples lies, and its confidence interval.

    Attributes
    ----------
    level : float
        The share of the computed samples.
    value : float or None
        A critical friction or growth rate, 1/s; None if it lies beyond the range, as that sample
        has no threshold.
    low, high : float or None
        Ends of the interval of confidence. None where an end is open: it lies beyond the range, or
        beyond all computed samples.
    """

    level: float
    value: float | None
    low: float | None
    high: float | None


@dataclass(frozen=True, eq=False, repr=False)
class Scatter(Answer):
    """The stability of many samples whose parameters scatter.

    Attributes
    ----------
    name : str
        The friction or free parameter.
    of : {"threshold", "growth"}
        What was computed of each sample: its first loss of stability up to `mu_max`, or the largest
        growth rate of its roots in `band`.
    mu : float
        Value of the friction or free parameter of the subject itself.
    spreads, design, seed, samples
        How the samples were drawn, and how many.
    rows : tuple of Sample
        Samples that were computed, by rising value, NaN last.
    no_pad : int
        Samples left out, as they are no possible pad or system, or have no equilibrium in contact
        without friction.
    failed : int
        Samples that could not be computed. Nothing is known of them, which widens all intervals.
    stable : float
        Share of the computed samples that are stable at their own friction; of thresholds, up to
        it: what is stable again above a threshold does not count.
    interval : (float, float)
        Confidence interval of that share.
    indices : tuple of Index
        Sobol indices of the parameters, that of the largest total index first.
    basis : mapping or None
        The reduced system on which the samples were computed.

    Examples
    --------
    >>> import squeal
    >>> K = {"a": [[1, 0], [0, 0]], "b": [[0, 0], [0, 1]], "mu": [[0, 1], [-1, 0]]}
    >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"a": 3.0, "b": 2.0})
    >>> found = squeal.scatter(pair, {"a": {"within": 0.1}}, samples=8)  # mu = (a - b) / 2
    >>> bool(0.45 <= found.values.min() <= found.values.max() <= 0.55)
    True
    """

    panel = Panel(0, "share", Mark.STEPS)

    name: str
    of: Measure
    mu: float
    mu_max: float
    band: tuple[float, float] | None
    spreads: Mapping[str, Spread]
    design: str
    seed: int
    samples: int
    rows: tuple[Sample, ...] = field(repr=False)
    no_pad: int
    failed: int
    stable: float
    interval: tuple[float, float]
    indices: tuple[Index, ...] = ()
    basis: Mapping[str, Any] | None = None

    @property
    def warnings(self) -> tuple[str, ...]:  # type: ignore[override]
        """How many samples could not be computed, and whether a root of a basis is unsolved."""
        lines = []
        if self.failed:
            count = f"{self.failed} of {self.samples} samples could not be computed"
            lines.append(f"{count}; the quantiles are those of the others")
        if self.basis is not None and self.basis["residual"] > ACCEPTED:
            limit = f"the worst residual of a root exceeds {ACCEPTED:g}"
            lines.append(f"{limit}; narrow the ranges or the band")
        return tuple(lines)

    @property
    def values(self) -> NDArray[np.float64]:
        """Critical frictions, NaN beyond `mu_max`, or growth rates in 1/s (n,), rising."""
        return np.array([sample.value for sample in self.rows])

    @property
    def propensity(self) -> float | None:
        """The squeal propensity index; None of thresholds.

        It is the mean over the samples of the sum of ``Re / |lambda|``, the negative damping
        ratios, of the modes that grow.
        """
        known = [sample.propensity for sample in self.rows if sample.propensity is not None]
        if not known:
            return None
        return math.fsum(known) / len(known)

    @property
    def quantiles(self) -> tuple[Quantile, ...]:
        """The values below which given shares of the samples lie, with confidence intervals.

        Of n samples the number below the true quantile of level p is binomial (n, p), whatever
        the distribution of the values. The ranks between which that number lies with the
        probability `CONFIDENCE` are therefore the ends of the interval (David and Nagaraja, Order
        Statistics, 3rd ed., 7.1). Of 100 samples 90 to 99 lie below the true quantile of 95 %: its
        interval runs from the 90th value to the 100th. A failed sample may have any value: the
        lower rank counts all of them as smallest, the upper rank as largest.
        """
        from scipy.stats import binom  # slow to load, and no figure of another answer needs it

        computed = len(self.rows)
        count = computed + self.failed
        values = [None if sample.has_no_threshold else sample.value for sample in self.rows]
        quantiles = []
        for level in LEVELS:
            # how many of the computed samples lie below the true quantile: at least so many if all
            # failed samples lie below it as well, at most so many if no failed sample does
            least_below = int(binom.ppf((1 - CONFIDENCE) / 2, count, level)) - self.failed
            most_below = int(binom.ppf((1 + CONFIDENCE) / 2, count, level))
            index = max(math.ceil(level * computed) - 1, 0)  # of the sample that is the quantile
            # beyond the samples the interval is open; only a friction is known to be at least 0
            low = 0.0 if self.of == "threshold" else None
            high = None
            if least_below > 0:
                low = values[least_below - 1]
            if most_below < computed:
                high = values[most_below]
            quantiles.append(Quantile(level, values[index], low, high))
        return tuple(quantiles)

    @property
    def beyond(self) -> int:
        """How many computed samples have no threshold up to `mu_max`; 0 of growth."""
        return sum(sample.has_no_threshold for sample in self.rows)

    def table(self) -> Table:
        """A row for each sample, by rising value, with the share of the samples up to it.

        Examples
        --------
        >>> import squeal
        >>> K = {"a": [[1, 0], [0, 0]], "b": [[0, 0], [0, 1]], "mu": [[0, 1], [-1, 0]]}
        >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"a": 3.0, "b": 2.0})
        >>> len(squeal.scatter(pair, {"a": {"within": 0.1}}, samples=8).table().rows)
        8
        """
        results = ["kind", "frequency_hz"]  # attributes of `Sample`, beside its value
        if self.of == "growth":
            value_name = "growth_rate"
            unit = "1/s"
            results += ["unstable", "propensity", "residual"]
        else:
            if self.basis is not None:
                results.append("residual")
            value_name = parameter_heading(self.name, ["share", *results])
            unit = ""
        others = ["share", *results]
        # a parameter that is called as another column gets the head parameter.NAME
        parameters = [parameter_heading(name, [value_name, *others]) for name in self.spreads]
        heads = [(value_name, unit)]
        heads += [(name, "") for name in others + parameters]
        rows = []
        for rank, sample in enumerate(self.rows, 1):
            row = [sample.value, rank / len(self.rows)]
            row += [getattr(sample, name) for name in results]
            row += [sample.parameters[name] for name in self.spreads]
            rows.append(row)
        return Table(in_order(heads), rows)

    def _table_of_quantiles(self) -> Table:
        """The quantiles for people, with what was computed and how the samples were drawn."""
        # text for None: of growth an open end of an interval; of thresholds a value beyond the
        # range, or an open upper end, which lies beyond all that is known: one text says both
        if self.of == "growth":
            heads = ("share of the samples, %", "growth rate", "from", "to")
            without_value = "-"
            what = "largest growth rate"
            if self.band is not None:
                what += f" from {self.band[0]:g} to {self.band[1]:g} Hz"
            what += ", 1/s"
        else:
            heads = ("share unstable, %", self.name, "from", "to")
            without_value = f"> {self.mu_max:g}"
            what = f"first loss of stability up to {self.name} = {self.mu_max:g}"
        rows = []
        for quantile in self.quantiles:
            values = (quantile.value, quantile.low, quantile.high)
            shown = [without_value if value is None else value for value in values]
            rows.append((100 * quantile.level, *shown))
        drawn = f"{self.samples} samples"
        if self.indices:  # the samples are the points A and B, half of them each
            drawn += f" (2 x {self.samples // 2} for the indices)"
        title = f"{drawn}, {self.design}, seed {self.seed}: {what}; "
        title += f"intervals of {100 * CONFIDENCE:g} % confidence"
        return Table(in_order((head, "") for head in heads), rows, title)

    def _line_of_shares(self) -> str:
        """How many of the computed samples are stable, in a line, and what became of the others."""
        at = ""
        if self.name not in self.spreads:
            # of thresholds: stable up to there are samples whose first threshold lies above it
            words = "at" if self.of == "growth" else "up to"
            at = f" {words} {self.name} = {number(self.mu)}"
        low, high = self.interval
        line = f"stable{at}: {100 * self.stable:.1f} % of the samples "
        line += f"({100 * low:.1f} to {100 * high:.1f} %)"
        if self.of == "growth":
            line += f"; squeal propensity index {number(self.propensity or 0.0, 4)}"
        else:
            line += f"; without a threshold {self.beyond}"
        if self.no_pad:
            line += f"; no possible pad or system: {self.no_pad}"
        if self.failed:
            line += f"; not computed: {self.failed}"
        return line

    def _table_of_indices(self) -> Table:
        rows = []
        for index in self.indices:
            first_low, first_high = index.first_interval
            total_low, total_high = index.total_interval
            first = f"{index.first:.2f} ({first_low:.2f} to {first_high:.2f})"
            total = f"{index.total:.2f} ({total_low:.2f} to {total_high:.2f})"
            rows.append((index.parameter, first, total))
        names = (("parameter", ""), ("first", ""), ("total", ""))
        return Table(in_order(names), rows, "Sobol indices: shares of the variance")

    def parts(self) -> Sequence[str | Table]:
        parts: list[str | Table] = [self._table_of_quantiles(), self._line_of_shares()]
        if self.indices:
            parts.append(self._table_of_indices())
        elif len(self.spreads) > 1:
            parts.append("which parameter decides: `indices: true` in the file of spreads tells")
        if self.basis is not None:
            rows = self.basis["rows"]
            residual = self.basis["residual"]
            where = f"in the equations of all {rows} rows, over all samples: {residual:.2g}"
            size = self.basis["size"]
            parts.append(f"on a basis of {size} vectors; worst residual of a root {where}")
        return parts

    def to_dict(self) -> JsonObject:
        scatter: JsonObject = {"parameter": self.name, "value": self.mu}
        scatter |= copied_attributes(
            self, "of mu mu_max band samples seed design failed no_pad beyond stable"
        )
        scatter["spreads"] = []
        for name, spread in self.spreads.items():
            ((kind, size),) = spread.items()  # the one entry of a spread, as {"within": 0.1}
            scatter["spreads"].append({"name": name, "kind": kind, "size": size})
        value_key = "mu" if self.of == "threshold" else "growth_rate"
        scatter["quantiles"] = []
        for level, value, low, high in self.quantiles:
            entry = {"level": level, value_key: value, "low": low, "high": high}
            scatter["quantiles"].append(entry)
        scatter |= copied_attributes(self, "interval propensity basis")
        scatter["confidence"] = CONFIDENCE
        scatter["indices"] = [index._asdict() for index in self.indices]
        return {"scatter": scatter}
