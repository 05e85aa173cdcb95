"""Many parameters at once: what tolerances or ranges make of the critical friction, or of
the growth rates in a band, which of them matter, and how likely squeal is.

Samples are drawn at random, as a Latin hypercube or as a Sobol sequence. Of a large system a
reduced one is judged, whose residual in the full problem is computed for each sample.
"""

from __future__ import annotations

import json
import math
from collections import namedtuple
from collections.abc import Callable, Mapping, Sequence
from dataclasses import astuple, dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from squeal.errors import ComputationError, InputError
from squeal.io.matrices import fingerprint
from squeal.io.processes import mapped
from squeal.io.scene import Scene
from squeal.io.writing import Answer, Mark, Panel, Table, in_order, number, picked, write_text
from squeal.linear.eigen import decide
from squeal.linear.system import TermSystem
from squeal.queries.advise import NO_PAD, NO_REST, ROUNDING, Outcome, ParameterSpace, first_loss
from squeal.queries.options import RandomNumbers, seed_of
from squeal.queries.pads.equilibrium import analyse
from squeal.queries.systems.all_roots import NO_BAND, is_small, roots_of_all
from squeal.queries.systems.reduced import basis_of, reduced_for
from squeal.queries.systems.thresholds import system_thresholds
from squeal.queries.systems.verdicts import rounding_of
from squeal.results.columns import parameter_heading
from squeal.results.sources import EigenvalueSelection
from squeal.schema import (
    FLAG,
    Group,
    Key,
    Named,
    Number,
    Place,
    Positive,
    Whole,
    Word,
    public,
    read_content,
    read_document,
    row,
)
from squeal.sparse.first_look import FirstLook
from squeal.sparse.reduction import Reduction

QUANTILES = (0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99)
CONFIDENCE = 0.95
CHUNK = 64  # pads that are computed together
SERVED = 24  # samples for which a reduced system is made
RESAMPLED = 400  # times, for the intervals of indices
DESIGNS = ("random", "latin", "sobol")

_ABOVE = Number(low=0.0)
_SPREAD = Group(
    {
        "relative": Key("normal, standard deviation over the value", _ABOVE),
        "absolute": Key("normal, standard deviation in the parameter's unit", _ABOVE),
        "within": Key("even, between the value minus and plus this", _ABOVE),
        "between": Key("even, between two numbers", row(2)),
    },
    only_one=True,
)
_SPREADS = Named(_SPREAD, "a mapping of parameters to spreads such as {relative: 0.05}")


SPREADS = Group(
    {
        "samples": Key("how many are drawn", Whole(8, 1_000_000), default="400"),
        "seed": Key("of the random numbers", Whole(0, 2**32 - 1), default="1"),
        "design": Key("random, latin (hypercube) or sobol", Word(DESIGNS), default="random"),
        "indices": Key("Sobol indices of each parameter", FLAG, default="false"),
        "spreads": Key("how each parameter scatters", _SPREADS, required=True),
    },
    owner="a file of spreads",
)


def read_spreads(path: Path | str) -> dict[str, Any]:
    """Read a file of spreads: arguments of `scatter`, but for the parameters unchecked there.

    Raises InputError with one sentence that names the file, the key and what is allowed.

    Examples
    --------
    >>> import squeal
    >>> from pathlib import Path
    >>> _ = Path("spreads.yaml").write_text("spreads: {k1: {relative: 0.05}}")
    >>> squeal.read_spreads("spreads.yaml")
    {'spreads': {'k1': {'relative': 0.05}}}
    """
    options = SPREADS.read(*read_document(path))
    if "seed" in options:
        options["rng"] = options.pop("seed")
    return options


@dataclass(frozen=True)
class Sample:
    """One sample: its parameters and what becomes of it.

    value: critical friction (NaN if none lies in the range) or largest real part of the roots in
    the band (1/s), with kind and frequency of what happens there; unstable, propensity: how many
    modes of the band grow, and the sum of their negative damping ratios; residual: the largest
    backward error of a root in the full problem; reason: why nothing is known.
    """

    parameters: Mapping[str, float]
    value: float = math.nan
    kind: str | None = None
    frequency_hz: float | None = None
    unstable: int | None = None
    propensity: float | None = None
    residual: float | None = None
    reason: str | None = None


Index = namedtuple("Index", "parameter first first_interval total total_interval")
"""Sobol indices of a parameter: its share of the variance alone, and with all interactions."""
Quantile = namedtuple("Quantile", "level value low high")


@dataclass(frozen=True, eq=False, repr=False)
class Scatter(Answer):
    """What becomes of many samples whose parameters scatter.

    of: threshold, the first loss of stability up to `mu_max`, or growth, the largest growth rate of
    the roots in `band`; spreads, design, seed: how they were drawn; rows: those that were computed,
    by rising value, NaN last. no_pad: samples that cannot be pads or rest nowhere without friction,
    left out; failed: samples that could not be computed, which widen all intervals, since nothing
    is known of them. stable, interval: share of the samples that are stable at their own friction.
    indices: of the parameters, those of most effect first; basis: the reduced system that served.

    Examples
    --------
    >>> import squeal
    >>> K = {"a": [[1, 0], [0, 0]], "b": [[0, 0], [0, 1]], "mu": [[0, 1], [-1, 0]]}
    >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"a": 3.0, "b": 2.0})
    >>> found = squeal.scatter(pair, {"a": {"within": 0.1}}, samples=16)  # mu = (a - b) / 2
    >>> bool(0.45 <= found.values.min() <= found.values.max() <= 0.55)
    True
    """

    panel = Panel(0, "share", Mark.STEPS)

    name: str
    of: str
    mu: float
    mu_max: float
    band: tuple[float, float] | None
    spreads: Mapping[str, Mapping[str, Any]]
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
        """How many samples could not be computed."""
        count = f"{self.failed} of {self.samples} samples could not be computed"
        return (f"{count}; the quantiles are those of the others",) if self.failed else ()

    @property
    def values(self) -> NDArray[np.float64]:
        """Critical frictions, NaN beyond `mu_max`, or growth rates (n,), sorted."""
        return np.array([one.value for one in self.rows])

    @property
    def propensity(self) -> float | None:
        """The squeal propensity index, the mean over the samples of the sum of the negative damping
        ratios `-Re/|lambda|` of the modes that grow; None of thresholds."""
        each = [one.propensity for one in self.rows if one.propensity is not None]
        return math.fsum(each) / len(each) if each else None

    @property
    def quantiles(self) -> tuple[Quantile, ...]:
        """Quantiles with intervals low to high that hold them with `CONFIDENCE`, by order
        statistics free of any distribution; None lies above `mu_max`, or is unknown."""
        from scipy.stats import binom  # slow to load, and no figure of another answer needs it

        known = len(self.rows)
        count = known + self.failed
        values = [None if math.isnan(value) else value for value in self.values.tolist()]
        quantiles = []
        for level in QUANTILES:
            first = int(binom.ppf((1 - CONFIDENCE) / 2, count, level)) - 1 - self.failed
            last = int(binom.ppf((1 + CONFIDENCE) / 2, count, level))
            value = values[max(math.ceil(level * known) - 1, 0)]
            # beyond the samples the interval is open: no friction is below 0, the rest is unknown
            low = 0.0 if self.of == "threshold" else None
            high = None
            if first >= 0:
                low = values[first]
            if last < known:
                high = values[last]
            quantiles.append(Quantile(level, value, low, high))
        return tuple(quantiles)

    @property
    def beyond(self) -> int:
        """How many have no threshold up to `mu_max`."""
        return int(np.isnan(self.values).sum())

    def table(self) -> Table:
        """A row for each sample, by rising value, with the share up to it.

        Examples
        --------
        >>> import squeal
        >>> K = {"a": [[1, 0], [0, 0]], "b": [[0, 0], [0, 1]], "mu": [[0, 1], [-1, 0]]}
        >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"a": 3.0, "b": 2.0})
        >>> len(squeal.scatter(pair, {"a": {"within": 0.1}}, samples=16).table().rows)
        16
        """
        known = ["kind", "frequency_hz"]
        if self.of == "growth":
            value = ("growth_rate", "1/s")
            known += ["unstable", "propensity", "residual"]
        else:
            value = (self.name, "")
            if self.basis is not None:
                known.append("residual")
        heads = [value, ("share", ""), *((name, "") for name in known)]
        heads += [(parameter_heading(name, [self.name]), "") for name in self.spreads]
        rows = []
        for k, sample in enumerate(self.rows, 1):
            parameters = [sample.parameters[name] for name in self.spreads]
            outcome = [getattr(sample, name) for name in known]
            rows.append((sample.value, k / len(self.rows), *outcome, *parameters))
        return Table(in_order(heads), rows)

    def _table_of_quantiles(self) -> Table:
        if self.of == "growth":
            names = ("share of the samples, %", "growth rate", "from", "to")
            beyond = "-"
            what = "largest growth rate"
            if self.band is not None:
                what += f" from {self.band[0]:g} to {self.band[1]:g} Hz"
            what += ", 1/s"
        else:
            names = ("share unstable, %", self.name, "from", "to")
            beyond = f"> {self.mu_max:g}"
            what = f"first loss of stability up to {self.name} = {self.mu_max:g}"
        rows = []
        for quantile in self.quantiles:
            values = (quantile.value, quantile.low, quantile.high)
            shown = [beyond if value is None else value for value in values]
            rows.append((100 * quantile.level, *shown))
        drawn = f"{self.samples} samples"
        if self.indices:
            drawn += f" (2 x {self.samples // 2} for the indices)"
        title = f"{drawn}, {self.design}, seed {self.seed}: {what}; "
        title += f"intervals of {100 * CONFIDENCE:g} % confidence"
        return Table(in_order((name, "") for name in names), rows, title)

    def _shares(self) -> str:
        """How many samples are stable, in a line, and what became of the others."""
        at = "" if self.name in self.spreads else f" at {self.name} = {number(self.mu)}"
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
        parts: list[str | Table] = [self._table_of_quantiles(), self._shares()]
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

    def to_dict(self) -> dict[str, Any]:
        scatter: dict[str, Any] = {"parameter": self.name, "value": self.mu}
        scatter |= picked(self, "of mu mu_max band samples seed design failed no_pad beyond stable")
        scatter["spreads"] = [
            {"name": name, "kind": kind, "size": size}
            for name, spread in self.spreads.items()
            for kind, size in spread.items()
        ]
        value = "mu" if self.of == "threshold" else "growth_rate"
        scatter["quantiles"] = [
            {"level": one.level, value: one.value, "low": one.low, "high": one.high}
            for one in self.quantiles
        ]
        scatter |= picked(self, "interval propensity basis") | {"confidence": CONFIDENCE}
        scatter["indices"] = [index._asdict() for index in self.indices]
        return {"scatter": scatter}


class _Judge(NamedTuple):
    """What samples are changes of, which roots are selected, and up to where their first loss of
    stability is; None where their growth is judged."""

    subject: Scene | TermSystem | Reduction | ParameterSpace
    selection: EigenvalueSelection
    high: float | None


def _samples(judge: _Judge, changes: Sequence[dict[str, float]]) -> list[Sample]:
    """What becomes of each change of some parameters."""
    subject, selection, high = judge
    if isinstance(subject, ParameterSpace):
        assert high is not None
        outcomes = subject.outcomes(changes, high, selection.band)
        return [_at_loss(values, found) for values, found in zip(changes, outcomes, strict=True)]
    if high is None:
        return [_growth(subject, selection, values) for values in changes]
    assert isinstance(subject, Reduction)
    return [_loss_of_reduced(subject, selection, high, values) for values in changes]


def _at_loss(values: dict[str, float], found: Outcome, residual: float | None = None) -> Sample:
    return Sample(
        parameters=values,
        value=math.nan if found.critical is None else found.critical,
        kind=found.kind,
        frequency_hz=found.frequency_hz,
        residual=residual,
        reason=found.reason,
    )


def _loss_of_reduced(
    served: Reduction, selection: EigenvalueSelection, high: float, values: dict[str, float]
) -> Sample:
    """A sample judged by its first loss of stability, located on the full system."""
    try:
        one = served.replaced(values)
        answer = system_thresholds(one.scaled.system, high, wanted=selection, served=one)
    except (InputError, ComputationError) as error:
        kind = NO_PAD if isinstance(error, InputError) else None
        return Sample(values, kind=kind, reason=str(error))
    found = first_loss(answer, high)
    at = {answer.parameter: high if found.critical is None else found.critical}
    return _at_loss(values, found, float(np.max(one.modes(at)[1], initial=0.0)))


def _growth(
    subject: Scene | TermSystem | Reduction,
    selection: EigenvalueSelection,
    values: dict[str, float],
) -> Sample:
    """A sample judged by the selected roots of a scene, a small system or a reduced one."""
    residuals = None
    try:
        if isinstance(subject, Scene):
            spectrum = analyse(subject.replace(**values)).spectrum
            roots = spectrum.values
            rounding = spectrum.rounding
        elif isinstance(subject, TermSystem):
            roots = roots_of_all(subject, selection, values)
            rounding = rounding_of(subject, roots)
        elif isinstance(subject, FirstLook):
            found = subject.estimate(values)
            roots = found.values
            residuals = found.residuals
            rounding = np.maximum(found.errors, rounding_of(subject.scaled.system, roots))
        else:
            modes, residuals, _ = subject.modes(values)
            roots = modes.values
            rounding = rounding_of(subject.system, roots)
        if not len(roots):
            raise ComputationError("no root lies in the band")
    except InputError as error:
        return Sample(values, kind=NO_PAD, reason=str(error))
    except ComputationError as error:
        return Sample(values, reason=str(error))
    unstable = roots[(roots.real > rounding) & (roots.imag >= 0.0)]
    fastest = roots[np.argmax(roots.real)]
    return Sample(
        parameters=values,
        value=float(fastest.real),
        kind=decide(roots, rounding).verdict,
        frequency_hz=abs(float(fastest.imag)) / math.tau,
        unstable=len(unstable),
        propensity=math.fsum(unstable.real / np.abs(unstable)),
        residual=None if residuals is None else float(np.max(residuals, initial=0.0)),
    )


def _journal(path: Path, question: str) -> dict[int, list[Sample]]:
    """Chunks of samples that a file keeps, begun if it is new: an interrupted run goes on where it
    ended.

    Raises InputError for a file that holds those of another question.
    """
    content = read_content(path, Place(str(path))) if path.exists() else b""
    known = {}
    try:
        head, *lines = (content.decode() or f"{question}\n").split("\n")
        if head != question:
            raise ValueError
        sound = lines[:-1]  # what follows the last line end was cut off
        if sound and sound[-1] != _signed(sound[-1].partition(" ")[2]):
            sound.pop()  # as of a write that was killed
            words = "its last line is broken; the samples of this line are computed again"
            Place(str(path)).warn(words)
        for line in sound:
            record = line.partition(" ")[2]
            if line != _signed(record):
                raise ValueError
            chunk, samples = json.loads(record)
            known[chunk] = [Sample(*one) for one in samples]
    except (ValueError, TypeError):
        words = "holds no samples of this question; the name of another file is allowed"
        raise Place(str(path)).refuse(words) from None
    write_text(path, "\n".join([head, *sound, ""]))
    return known


def _signed(record: str) -> str:
    """A record of a journal behind its digest, which tells that it was changed."""
    return f"{sha256(record.encode()).hexdigest()[:16]} {record}"


def _question(subject: Scene | TermSystem, *more: object) -> str:
    """What tells one question from another."""
    from scipy.sparse import csc_array

    own: object = subject
    if isinstance(subject, TermSystem):
        terms = [
            [(t.factor.text, fingerprint(csc_array(t.matrix))) for t in X] for X in subject.parts
        ]
        own = subject.parameter, dict(subject.parameters), terms
    return sha256(repr((own, *more)).encode()).hexdigest()


def _drawn(design: str, samples: int, columns: int, seed: int) -> NDArray[np.float64]:
    """Points (samples, columns) of the unit cube. Raises InputError."""
    from scipy.stats import qmc

    if design == "random":
        return np.random.default_rng(seed).random((samples, columns))
    if design == "latin":
        return np.asarray(qmc.LatinHypercube(columns, rng=seed).random(samples))
    if samples & (samples - 1):
        near = 2 ** round(math.log2(samples))
        words = f"it must be a power of 2 for the design sobol, such as {near}"
        raise Place("samples").refuse(f"{samples} is not allowed; {words}")
    # no sample at the end of a normal distribution
    return np.clip(qmc.Sobol(columns, rng=seed).random(samples), 1e-9, 1 - 1e-9)


def _placed(
    varied: ParameterSpace, spreads: Mapping[str, Any], unit: NDArray
) -> list[dict[str, float]]:
    """Parameters at points of the unit cube. Raises InputError."""
    from scipy.special import ndtri

    drawn = {}
    for (name, spread), u in zip(spreads.items(), unit.T, strict=True):
        ((kind, size),) = spread.items()
        between = kind == "between"
        step = varied.step(name, 1.0 if between else size, kind == "relative", Place("spreads"))
        if between:
            low, high = size
            if not low < high:
                wrong = Place("scatter", "spreads", name, kind)
                raise wrong.must_be(list(size), "two numbers, the lower one first")
            values = low + (high - low) * u
        else:
            values = varied.values[name] + step * (2 * u - 1 if kind == "within" else ndtri(u))
        drawn[name] = values.tolist()
    return [dict(zip(drawn, values, strict=True)) for values in zip(*drawn.values(), strict=True)]


def _shares(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """First-order and total Sobol indices (2, d) from values (d + 2, n): of A, of B, and of A with
    each column of B. What sampling leaves below 0 or above 1, where no share can be, is cut."""
    A = values[0]
    moved = values[2:] - A
    B = values[1] - values[:2].mean()
    first_order = moved @ B / len(B)
    total = (moved**2).sum(axis=1) / 2 / len(B)
    variance = np.var(values[:2]) or np.nan
    return np.clip(np.array([first_order, total]) / variance, 0.0, 1.0)


def _indices(names: Sequence[str], values: NDArray, seed: int) -> tuple[Index, ...]:
    """Sobol indices from such values with bootstrapped intervals; none where they do not vary."""
    kept = values[:, np.all(np.isfinite(values), axis=0)]
    n = kept.shape[1]
    if n < 8 or np.ptp(kept[:2]) <= ROUNDING * np.abs(kept[:2]).max():
        words = "no Sobol indices: fewer than 8 samples are known, or all are one to rounding"
        Place("indices").warn(words)
        return ()
    random = np.random.default_rng([seed, RESAMPLED])
    resampled = [_shares(kept[:, random.integers(n, size=n)]) for _ in range(RESAMPLED)]
    low, high = np.nanquantile(
        resampled, [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2], axis=0
    ).tolist()
    first, total = _shares(kept).tolist()
    indices = [
        Index(
            parameter=name,
            first=first[k],
            first_interval=(low[0][k], high[0][k]),
            total=total[k],
            total_interval=(low[1][k], high[1][k]),
        )
        for k, name in enumerate(names)
    ]
    return tuple(sorted(indices, key=lambda index: -index.total))


@public
def scatter(
    subject: object,
    spreads: Mapping[str, Mapping[str, Any]],
    samples: int = 400,
    rng: RandomNumbers = 1,
    mu_max: Positive = 2.0,
    of: Literal["threshold", "growth"] = "threshold",
    band: tuple[float, float] | None = None,
    design: str = "random",
    indices: bool = False,
    workers: int = 1,
    journal: Path | str | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Scatter:
    """Draw samples whose parameters scatter, and compute the stability of each.

    Parameters
    ----------
    subject : Scene, SystemFile or TermSystem
        What scatters. A system of more than 400 rows needs a band.
    spreads : mapping of str to mapping
        How each parameter scatters on its own: normally with the standard deviation ``relative``
        to its value or ``absolute`` in its unit, evenly ``within`` its value plus and minus so
        much, or evenly ``between`` two values, such as ``{"k1": {"relative": 0.05}}``.
    samples : int
        How many are drawn.
    rng : int or numpy.random.Generator
        Of the random numbers: the same seed draws the same samples. A generator draws the seed,
        which the answer names.
    mu_max : float
        Upper end of the range that is searched for the critical friction.
    of : {"threshold", "growth"}
        The first loss of stability, or the largest growth rate and the squeal propensity index at
        the sample's own parameters. The free parameter may scatter for growth.
    band : (float, float), optional
        Frequencies in Hz whose roots are judged, of systems.
    design : {"random", "latin", "sobol"}
        Independent samples, a Latin hypercube, or a Sobol sequence.
    indices : bool
        Whether Sobol indices are computed, by the estimators of Saltelli et al., Computer Physics
        Communications 181 (2010) 259-270, which draws twice as many samples, and ``samples`` times
        the number of parameters more. A threshold that lies beyond ``mu_max`` counts as ``mu_max``.
    workers : int
        Processes, which start by import: a script must guard its main part.
    journal : path, optional
        A file that keeps what is computed, so that an interrupted run goes on.
    progress : callable, optional
        Called with (done, count) now and then.

    Returns
    -------
    Scatter
        The samples by rising value, quantiles, shares and indices.

    Raises
    ------
    InputError
        For a spread that does not fit the scene or system.
    ComputationError
        If no sample can be computed.

    Examples
    --------
    >>> import squeal
    >>> K = {"a": [[1, 0], [0, 0]], "b": [[0, 0], [0, 1]], "mu": [[0, 1], [-1, 0]]}
    >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"a": 3.0, "b": 2.0})
    >>> answer = squeal.scatter(pair, {"a": {"within": 0.1}}, samples=64)

    Flutter begins at (a - b) / 2:

    >>> [0.45 <= q.value <= 0.55 for q in answer.quantiles if q.level == 0.5]
    [True]
    """
    options = SPREADS.read(
        {
            "spreads": spreads,
            "samples": samples,
            "seed": seed_of(rng, "scatter"),
            "design": design,
            "indices": indices,
        },
        Place("scatter"),
    )
    spreads = options["spreads"]
    samples = options["samples"]
    seed = options["seed"]
    if not spreads:
        raise Place("spreads").must_be(spreads, _SPREADS.named)
    varied = ParameterSpace.of(subject, "scatter", mu_max, of)
    count = len(spreads)
    blocks = 2 if indices else 1
    unit = _drawn(options["design"], samples, blocks * count, seed)
    A = unit[:, :count]
    points = [A]
    if indices:
        B = unit[:, count:]
        points.append(B)
        points += [np.where(np.arange(count) == i, B, A) for i in range(count)]
    changes = _placed(varied, spreads, np.concatenate(points))
    question = (of, mu_max, band, spreads, options["design"], seed, options["indices"], samples)
    judge, basis = _judge(varied, of, mu_max, EigenvalueSelection(band, None, None), changes)
    rows = _computed(varied.subject, changes, judge, workers, journal, question, progress)
    shares: tuple[Index, ...] = ()
    if indices:
        values = np.array([row.value if row.reason is None else np.inf for row in rows])
        values = np.where(np.isnan(values), mu_max, values).reshape(count + 2, samples)
        shares = _indices(list(spreads), values, seed)
        rows = rows[: 2 * samples]  # A and B are the samples, the others repeat their columns
    made = [row for row in rows if row.reason is None]
    if not made:
        reasons = [row.reason for row in rows if row.kind != NO_PAD]
        reason = (reasons[0] if reasons else None) or NO_REST
        raise ComputationError(f"no sample can be computed: {reason}")
    made.sort(key=lambda row: (math.isnan(row.value), row.value))
    no_pad = sum(row.kind == NO_PAD for row in rows)
    failed = len(rows) - len(made) - no_pad
    if of == "threshold":
        stable = sum(not row.value <= varied.at for row in made)
    else:
        stable = sum(not row.unstable for row in made)
    if basis is not None:
        basis |= {"residual": max(row.residual or 0.0 for row in made)}
    return Scatter(
        name=varied.free,
        of=of,
        mu=varied.at,
        mu_max=mu_max,
        band=band,
        spreads=spreads,
        design=options["design"],
        seed=seed,
        samples=len(rows),
        rows=tuple(made),
        no_pad=no_pad,
        failed=failed,
        stable=stable / len(made),
        interval=_interval(stable, failed, len(made) + failed),
        indices=shares,
        basis=basis,
    )


def _interval(stable: int, unknown: int, count: int) -> tuple[float, float]:
    """Ends of Wilson's interval for the share of stable samples, whatever the unknown ones are."""
    from scipy.stats import binomtest

    low = binomtest(stable, count).proportion_ci(CONFIDENCE, "wilson").low
    high = binomtest(stable + unknown, count).proportion_ci(CONFIDENCE, "wilson").high
    return float(low), float(high)


def _computed(
    subject: Scene | TermSystem,
    changes: Sequence[dict[str, float]],
    judge: _Judge,
    workers: int,
    journal: Path | str | None,
    question: tuple[object, ...],
    progress: Callable[[int, int], None] | None,
) -> list[Sample]:
    """Samples of a subject with each change of its parameters, chunk by chunk; those that a
    journal of the same question holds are not computed again."""
    size = CHUNK if isinstance(subject, Scene) else 1
    chunks = [changes[i : i + size] for i in range(0, len(changes), size)]
    samples: dict[int, list[Sample]] = {}
    if journal is not None:
        samples = _journal(Path(journal), _question(subject, *question))
    missing = [k for k in range(len(chunks)) if k not in samples]
    done = sum(len(chunk) for chunk in samples.values())
    computed = mapped(_samples, [chunks[k] for k in missing], workers, judge)
    for k, chunk in zip(missing, computed, strict=True):
        samples[k] = chunk
        done += len(chunk)
        if journal is not None:
            record = json.dumps([k, [astuple(sample) for sample in chunk]])
            with Path(journal).open("a", encoding="utf-8") as stream:
                stream.write(f"{_signed(record)}\n")
        if progress is not None:
            progress(done, len(changes))
    return [sample for k in range(len(chunks)) for sample in samples[k]]


def _judge(
    varied: ParameterSpace,
    of: str,
    high: float,
    selection: EigenvalueSelection,
    changes: Sequence[dict[str, float]],
) -> tuple[_Judge, dict[str, Any] | None]:
    """What judges samples, and the reduced system that it has. Raises InputError."""
    subject = varied.subject
    losses = of == "threshold"
    if isinstance(subject, Scene) and selection.band is not None:
        raise Place("band").refuse("is not allowed with a scene; a system takes it")
    if isinstance(subject, Scene) or is_small(subject):
        if losses:
            return _Judge(varied, selection, high), None
        return _Judge(subject, selection, None), None
    if selection.band is None:
        raise InputError(NO_BAND)
    served = [{}, *changes[:: max(1, len(changes) // SERVED)]]
    if not losses:
        reduction = reduced_for(subject, selection, served, "modal")
        return _Judge(reduction, selection, None), basis_of(reduction, selection)
    shares = np.linspace(0.0, high, len(served) + 1)[1:].tolist()
    # each at another value of the range
    served = [{**one, varied.free: mu} for one, mu in zip(served, shares, strict=True)]
    reduction = reduced_for(subject, selection, served, "reduced")
    return _Judge(reduction, selection, high), basis_of(reduction, selection)
