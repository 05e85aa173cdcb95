"""Tolerances: what the scatter of parameters makes of the critical friction.

Each parameter named scatters on its own, normally with a standard deviation or evenly within
limits; every sample is a pad of its own whose branch is followed from mu = 0. A file names them:

```yaml
samples: 400              # optional: how many pads are drawn
seed: 1                   # optional: the same seed draws the same pads
spreads:                  # each parameter scatters on its own
  k1: {relative: 0.05}    # normal, standard deviation over the value
  alpha1: {absolute: 0.01} # normal, standard deviation in the parameter's unit
  h: {within: 1.0e-4}     # even, between the value minus and plus this
```
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from squeal.analysis import subject as subjects
from squeal.equilibrium import sliding_equilibrium
from squeal.errors import ComputationError, InputError
from squeal.io.answer import Answer, Column, Table, number
from squeal.io.document import read_document
from squeal.io.processes import mapped
from squeal.io.scene import Scene
from squeal.numerics.shares import wilson
from squeal.schema.arguments import FILE, takes
from squeal.schema.keys import Group, Key
from squeal.schema.place import Place
from squeal.schema.values import Kind, Number, Whole

LEVELS = (0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99)
CONFIDENCE = 0.95
CHUNK = 16  # samples that a process works on at a time
KINDS = ("relative", "absolute", "within")

Progress = Callable[[int, int], None]
Outcome = float | Literal["no pad", "failed"]


@dataclass(frozen=True)
class Spread:
    """How one parameter scatters.

    kind "relative": normally, `size` is the standard deviation over the nominal value;
    "absolute": normally, with the standard deviation `size` in the parameter's unit; "within":
    evenly between the nominal value minus and plus `size`. Raises InputError.
    """

    name: str
    kind: str
    size: float

    def __post_init__(self) -> None:
        at = Place(f"spread {self.name}")
        if self.kind not in KINDS:
            raise at.must_be(self.kind, f"one of {', '.join(KINDS)}")
        if not (math.isfinite(self.size) and self.size > 0.0):
            raise at.must_be(self.size, "a finite number above 0")

    def values(self, nominal: float, random: np.random.Generator, count: int) -> np.ndarray:
        """Values (count,) of the parameter."""
        if self.kind == "within":
            return nominal + self.size * random.uniform(-1.0, 1.0, count)
        deviation = self.size * (abs(nominal) if self.kind == "relative" else 1.0)
        return nominal + deviation * random.standard_normal(count)


_ABOVE = Number(low=0.0)
SPREAD = Group(
    {
        "relative": Key("normal, standard deviation over the value", _ABOVE),
        "absolute": Key("normal, standard deviation in the parameter's unit", _ABOVE),
        "within": Key("even, between the value minus and plus this", _ABOVE),
    },
    only_one=True,
)


@dataclass(frozen=True)
class _Spreads(Kind):
    """A mapping of parameters to how each scatters."""

    def allowed(self) -> str:
        return "a mapping of parameters to spreads such as {relative: 0.05}"

    def read(self, value: Any, at: Place, model: str = "") -> tuple[Spread, ...]:
        """The spreads. Raises InputError."""
        if not isinstance(value, dict) or not value:
            raise at.must_be(value, self.allowed())
        pairs = ((name, *SPREAD.read(one, at / name).items()) for name, one in value.items())
        return tuple(Spread(str(name), kind, size) for name, (kind, size) in pairs)

    def schema(self) -> dict[str, Any]:
        return {"type": "object", "minProperties": 1, "additionalProperties": SPREAD.schema()}


SPREADS = Group(
    {
        "samples": Key("how many are drawn", Whole(10, 1_000_000), default="400"),
        "seed": Key("of the random numbers", Whole(0, 2**32 - 1), default="1"),
        "spreads": Key("how each parameter scatters", _Spreads(), required=True),
    },
    owner="a file of spreads",
)


@dataclass(frozen=True)
class Spreads:
    """What a file of spreads asks for."""

    spreads: tuple[Spread, ...]
    samples: int = 400
    seed: int = 1


@takes(path=FILE)
def read_spreads(path: Path | str) -> Spreads:
    """Read a file of spreads, checked but for its parameters, which a scene or system has to have.

    Raises InputError with one sentence that names the file, the key and what is allowed.
    """
    return Spreads(**SPREADS.read(read_document(Path(path)), Place(str(path))))


@dataclass(frozen=True)
class Quantile:
    """A quantile of the critical friction and the interval that holds it with `CONFIDENCE`.

    A bound, or the quantile itself, is None where it lies above `mu_max` of the scatter.
    """

    level: float
    mu: float | None
    low: float | None
    high: float | None


@dataclass(frozen=True, eq=False, repr=False)
class Scatter(Answer):
    """Critical friction of many pads whose parameters scatter.

    critical (n,): the first loss of stability of each, sorted; NaN where none lies below `mu_max`.
    no_pad: samples that cannot be pads or rest nowhere without friction, left out; failed: samples
    that could not be computed, which widen all intervals, since nothing is known of them. stable,
    interval: share of the pads whose first loss lies above the subject's own mu.
    """

    name: str
    mu: float
    mu_max: float
    critical: np.ndarray = field(repr=False)
    no_pad: int
    failed: int
    stable: float
    interval: tuple[float, float]
    drawn: Spreads

    @property
    def warnings(self) -> tuple[str, ...]:  # type: ignore[override]
        """How many samples could not be computed."""
        told = f"{self.failed} of {self.drawn.samples} samples could not be computed"
        return (f"{told}; the quantiles are those of the others",) if self.failed else ()

    @property
    def quantiles(self) -> tuple[Quantile, ...]:
        """Quantiles at `LEVELS`, with order-statistics intervals free of any distribution."""
        from scipy.stats import binom

        n, every = len(self.critical), len(self.critical) + self.failed
        found = []
        for level in LEVELS:
            rank = max(math.ceil(level * n) - 1, 0)
            low = int(binom.ppf((1 - CONFIDENCE) / 2, every, level)) - 1 - self.failed
            high = int(binom.ppf((1 + CONFIDENCE) / 2, every, level))
            # beyond the samples the interval is open: 0 below, nothing known above
            bounds = 0.0 if low < 0 else self._at(low), None if high >= n else self._at(high)
            found.append(Quantile(level, self._at(rank), *bounds))
        return tuple(found)

    @property
    def beyond(self) -> int:
        """How many have no threshold up to `mu_max`."""
        return int(np.isnan(self.critical).sum())

    def _at(self, rank: int) -> float | None:
        value = float(self.critical[rank])
        return None if math.isnan(value) else value

    def table(self) -> Table:
        """A row for each sample: its critical friction, and the share of samples up to it."""
        n = len(self.critical)
        pairs = [(mu, (i + 1) / n) for i, mu in enumerate(self.critical.tolist())]
        mu = Column(self.name, value=lambda pair: pair[0])
        return Table((mu, Column("share", value=lambda pair: pair[1])), pairs)

    def parts(self) -> Sequence[str | Table]:
        """The quantiles, and the share that is stable."""

        def cell(name: str) -> Callable[[Quantile], str]:
            def shown(q: Quantile) -> str:
                mu = getattr(q, name)
                return f"> {self.mu_max:g}" if mu is None else number(mu)

            return shown

        heads = {"mu": self.name, "low": "from", "high": "to"}
        told = [Column("share unstable, %", value=lambda q: 100 * q.level)]
        told += [Column(name, shown=cell(name), words=words) for name, words in heads.items()]
        title = (
            f"{self.drawn.samples} samples, seed {self.drawn.seed}: first loss of stability up to "
            f"{self.name} = {self.mu_max:g}, intervals of {100 * CONFIDENCE:g} % confidence"
        )
        low, high = (100 * end for end in self.interval)
        line = (
            f"stable at {self.name} = {number(self.mu)}: {100 * self.stable:.1f} % of the samples "
            f"({low:.1f} to {high:.1f} %); without a threshold {self.beyond}, no pads "
            f"{self.no_pad}, not computed {self.failed}"
        )
        return [Table(told, self.quantiles, title), line]

    def to_dict(self) -> dict[str, Any]:
        """The JSON object of `squeal critical-friction --scatter`."""
        found: dict[str, Any] = {"parameter": self.name, "value": self.mu, "mu": self.mu}
        found |= {"mu_max": self.mu_max} | asdict(self.drawn)
        names = ("failed", "no_pad", "beyond", "stable")
        found |= {name: getattr(self, name) for name in names}
        found |= {"interval": list(self.interval), "confidence": CONFIDENCE}
        return {"scatter": found | {"quantiles": [asdict(q) for q in self.quantiles]}}


def _draws(subject: subjects.Subject, asked: Spreads) -> list[dict[str, float]]:
    """The scattered values of each sample. Raises InputError for what the subject does not hold."""
    named = [spread.name for spread in asked.spreads]
    if not named:
        raise InputError("spreads: missing; how at least one parameter scatters is required")
    for spread in asked.spreads:
        subjects.check_name(subject, spread.name, "spreads", spread.kind == "relative")
        if named.count(spread.name) > 1:
            raise InputError(f"spreads: {spread.name} is named twice; once is allowed")
    random, values = np.random.default_rng(asked.seed), subjects.named_values(subject)
    columns = [s.values(values[s.name], random, asked.samples) for s in asked.spreads]
    return [dict(zip(named, row, strict=True)) for row in np.array(columns).T.tolist()]


def _first_loss(subject: subjects.Subject, values: dict[str, float], mu_max: float) -> Outcome:
    """The least mu without stable sliding, NaN above mu_max."""
    try:
        changed = subjects.varied(subject, values)
    except InputError:
        return "no pad"
    try:
        loss = subjects.critical_of(changed, mu_max).stable_to(mu_max)
    except (InputError, ComputationError):
        if isinstance(changed, Scene) and not changed.pad_model.linear:
            rests = sliding_equilibrium(changed.pad_model.replace(mu=0.0))[0]
            return "no pad" if rests is None else "failed"
        return "failed"
    return math.nan if loss is None else loss


def _work(task: tuple[subjects.Subject, list[dict[str, float]], float]) -> list[Outcome]:
    subject, draws, mu_max = task
    return [_first_loss(subject, values, mu_max) for values in draws]


def scatter(
    subject: object,
    spreads: Spreads | Sequence[Spread],
    mu_max: float = 2.0,
    workers: int = 1,
    progress: Progress | None = None,
) -> Scatter:
    """Draw pads whose parameters scatter, and compute the critical friction of each.

    Parameters
    ----------
    subject : Scene or TermSystem
        A scene, or a system with named parameters of at most 100 rows.
    spreads : Spreads or sequence of Spread
        How the parameters scatter; `Spreads` says also how many samples, from which seed.
    mu_max : float
        Upper end of the range in which the critical friction is sought.
    workers : int
        Processes, which start anew by import: a script must guard its main part.
    progress : callable, optional
        Called with (done, count) now and then.

    Returns
    -------
    Scatter
        Sorted critical frictions and their quantiles; the same for the same seed.

    Raises
    ------
    InputError
        For a spread that does not fit the scene or system.
    ComputationError
        If no sample has an equilibrium without friction.
    """
    subject = subjects.varied_subject(subject, "scatter", mu_max)
    asked = spreads if isinstance(spreads, Spreads) else Spreads(tuple(spreads))
    mu, draws = subjects.own_value(subject), _draws(subject, asked)
    tasks = [(subject, draws[i : i + CHUNK], mu_max) for i in range(0, len(draws), CHUNK)]
    found: list[Outcome] = []
    for part in mapped(_work, tasks, workers):
        found.extend(part)
        if progress is not None:
            progress(len(found), len(draws))
    critical = np.sort([mu for mu in found if isinstance(mu, float)])  # NaN comes last
    if not len(critical):
        raise ComputationError("no sample has an equilibrium in contact without friction")
    above, made, failed = int(np.sum(~(critical <= mu))), len(critical), found.count("failed")
    low = wilson(above, made + failed, CONFIDENCE)[0]
    high = wilson(above + failed, made + failed, CONFIDENCE)[1]
    lost = found.count("no pad")
    name = subjects.free_name(subject)
    return Scatter(name, mu, mu_max, critical, lost, failed, above / made, (low, high), asked)
