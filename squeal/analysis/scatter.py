"""Tolerances: what the scatter of a pad's parameters makes of its critical friction.

Each parameter named scatters on its own, normally with a standard deviation or evenly within
limits; every sample is a pad of its own whose branch is followed from mu = 0.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from squeal.analysis import subject as subjects
from squeal.errors import ComputationError, InputError
from squeal.io.processes import mapped
from squeal.numerics.shares import wilson

LEVELS = (0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99)
CONFIDENCE = 0.95
CHUNK = 16  # samples that a process works on at a time

Kind = Literal["relative", "absolute", "within"]
Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Spread:
    """How one parameter scatters.

    kind "relative": normally, `size` is the standard deviation over the nominal value;
    "absolute": normally, with the standard deviation `size` in the parameter's unit; "within":
    evenly between the nominal value minus and plus `size`. Raises InputError.
    """

    name: str
    kind: Kind
    size: float

    def __post_init__(self) -> None:
        if self.kind not in ("relative", "absolute", "within"):
            raise InputError(
                f"spread {self.name}: {self.kind} is not allowed; it must be one of relative, "
                "absolute, within"
            )
        if not (math.isfinite(self.size) and self.size > 0.0):
            raise InputError(
                f"spread {self.name}: {self.size:g} is not allowed; it must be a finite number "
                "above 0"
            )

    def values(self, nominal: float, random: np.random.Generator, count: int) -> np.ndarray:
        """Values (count,) of the parameter."""
        if self.kind == "within":
            return nominal + self.size * random.uniform(-1.0, 1.0, count)
        deviation = self.size * (abs(nominal) if self.kind == "relative" else 1.0)
        return nominal + deviation * random.standard_normal(count)


@dataclass(frozen=True)
class Quantile:
    """A quantile of the critical friction and the interval that holds it with `CONFIDENCE`.

    A bound, or the quantile itself, is None where it lies above `mu_max` of the scatter.
    """

    level: float
    mu: float | None
    low: float | None
    high: float | None


@dataclass(frozen=True, eq=False)
class Scatter:
    """Critical friction of many pads whose parameters scatter about a scene's.

    critical (n,): the first loss of stability of each, sorted; NaN where none lies below `mu_max`.
    failed: samples left out, since they cannot be pads or rest nowhere without friction.
    stable, interval: share of the pads whose first loss lies above the subject's own mu.
    """

    mu: float
    mu_max: float
    critical: np.ndarray = field(repr=False)
    failed: int
    stable: float
    interval: tuple[float, float]

    @property
    def quantiles(self) -> tuple[Quantile, ...]:
        """Quantiles at `LEVELS`, with order-statistics intervals free of any distribution."""
        from scipy.stats import binom

        n = len(self.critical)
        found = []
        for level in LEVELS if n else ():
            rank = max(math.ceil(level * n) - 1, 0)
            low = int(binom.ppf((1 - CONFIDENCE) / 2, n, level)) - 1
            high = int(binom.ppf((1 + CONFIDENCE) / 2, n, level))
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


def _draws(
    subject: subjects.Subject, spreads: tuple[Spread, ...], count: int, seed: int
) -> list[dict[str, float]]:
    """The scattered values of each sample. Raises InputError for what the subject does not hold."""
    named = [spread.name for spread in spreads]
    for spread in spreads:
        subjects.check_name(subject, spread.name, "spread", spread.kind == "relative")
        if named.count(spread.name) > 1:
            raise InputError(f"spread: {spread.name} is named twice; once is allowed")
    random, values = np.random.default_rng(seed), subjects.named_values(subject)
    columns = [s.values(values[s.name], random, count) for s in spreads]
    return [dict(zip(named, row, strict=True)) for row in np.array(columns).T.tolist()]


def _first_loss(subject: subjects.Subject, values: dict[str, float], mu_max: float) -> float | None:
    """The least mu without stable sliding, NaN above mu_max; None if there is no such pad."""
    try:
        found = subjects.critical_of(subjects.varied(subject, values), mu_max)
    except (InputError, ComputationError):
        return None
    loss = found.stable_to(mu_max)
    return math.nan if loss is None else loss


def _work(task: tuple[subjects.Subject, list[dict[str, float]], float]) -> list[float | None]:
    subject, draws, mu_max = task
    return [_first_loss(subject, values, mu_max) for values in draws]


def scatter(
    subject: subjects.Subject,
    spreads: tuple[Spread, ...],
    count: int,
    seed: int = 1,
    mu_max: float = 2.0,
    workers: int = 1,
    progress: Progress | None = None,
) -> Scatter:
    """Distribution of the first loss of stability over `count` samples; repeatable from the seed.

    The subject is a scene, or a system with named parameters.

    `progress(done, count)` is called now and then. With `workers` above 1 the samples go to that
    many processes, which start anew by import: a script must guard its main part by
    `if __name__ == "__main__"`. Raises InputError for a spread that does not fit the scene or
    system, ComputationError if no sample has an equilibrium without friction.
    """
    subjects.check_subject(subject, "scatter", mu_max)
    mu = subjects.own_value(subject)
    draws = _draws(subject, spreads, count, seed)
    tasks = [(subject, draws[i : i + CHUNK], mu_max) for i in range(0, count, CHUNK)]
    mus: list[float | None] = []
    for part in mapped(_work, tasks, workers):
        mus.extend(part)
        if progress is not None:
            progress(len(mus), count)
    critical = np.sort([mu for mu in mus if mu is not None])  # NaN, above mu_max, comes last
    if not len(critical):
        raise ComputationError("no sample has an equilibrium in contact without friction")
    above, made = int(np.sum(~(critical <= mu))), len(critical)
    interval = wilson(above, made, CONFIDENCE)
    return Scatter(mu, mu_max, critical, count - made, above / made, interval)
