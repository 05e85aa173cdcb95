"""Parameters varied and everything recomputed: what moves the critical friction (advise), and what
tolerances make of it (scatter).

Variations of a pad are followed together as a stack over values of friction, not by the
certified search of a query: a window of growth narrower than a step may be missed. One that a stack
cannot decide is a query of its own, which decides it or says why it cannot.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np

from squeal.analysis.pads import MU_MAX, critical_friction, critical_parameter
from squeal.analysis.stack import PadStack, parameters
from squeal.equilibrium import sliding_equilibrium
from squeal.errors import ComputationError, InputError
from squeal.io.processes import mapped
from squeal.io.scene import Scene
from squeal.io.writing import Answer, Column, Table, columns, number, unit_word
from squeal.linear import GROWING
from squeal.linear.system import TermSystem
from squeal.model.pad import PARAMETERS
from squeal.schema.keys import Group, Key, read_document
from squeal.schema.values import FILE, Kind, Number, Place, Whole, takes

LARGEST = 100  # degrees of freedom of a system whose critical friction is computed again and again
ROUNDING = 1e-11  # relative: what a query and a stack may differ by
AT_ONCE = 1e-9  # friction: what grows from here on grows from the start
STEP = 0.02  # of a parameter, in rad of an angle
QUANTILES = (0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99)
CONFIDENCE = 0.95
CHUNK = 64  # samples that are followed together
LEVER, SIDES = ("parameter", "unit", "value", "step"), ("lowered", "raised")

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Outcome:
    """What becomes of a pad with a parameter changed to `value`.

    critical: the friction up to which it slides steadily and stably, None if no threshold lies in
    the range; kind, frequency_hz: of what happens there; change: of the critical friction, at least
    so much where it leaves the range. reason: why nothing is known; no_pad: because there is no
    such pad, or it rests nowhere without friction.
    """

    value: float | None = None
    critical: float | None = None
    kind: str | None = None
    frequency_hz: float | None = None
    reason: str | None = None
    change: float | None = None
    no_pad: bool = False

    @staticmethod
    def at(mu: float, kind: str, hertz: float | None) -> Outcome:
        """Stability that is lost at mu; what grows from the start has no frequency of its own."""
        if mu <= AT_ONCE:
            return Outcome(critical=0.0, kind=kind)
        return Outcome(None, mu, kind, None if hertz is None or math.isnan(hertz) else hertz)


@dataclass(frozen=True, eq=False)
class Varied:
    """A scene or system with the parameters that its critical friction depends on, in SI units.

    free, at: name and own value of the friction or free parameter, which is none of them.
    """

    subject: Scene | TermSystem
    free: str
    at: float
    values: dict[str, float]
    angles: frozenset[str] = frozenset()

    @staticmethod
    def of(argument: object, verb: str, high: float) -> Varied:
        """What may be varied. Raises InputError naming the verb."""
        subject: Any = getattr(argument, "system", argument)  # of a system file
        if isinstance(subject, Scene):
            MU_MAX.read(high, Place(verb, "mu_max"))
            names = [name for name in parameters(subject.pad_model) if name != "mu"]
            values = {name: getattr(subject.pad, name) for name in names}
            angles = frozenset(name for name in names if PARAMETERS[name].angle)
            return Varied(subject, "mu", subject.pad.mu, values, angles)
        if not isinstance(subject, TermSystem):
            allowed = "it must be a Scene or a system with named parameters"
            raise InputError(f"{verb}: {type(subject).__name__} is not allowed; {allowed}")
        if subject.n > LARGEST:
            raise InputError(
                f"{verb}: {subject.n} degrees of freedom are not allowed; at most {LARGEST} are, "
                "so reduce the system first"
            )
        values, free = dict(subject.parameters), subject.parameter
        at = float(values.pop(free))
        if not values:
            raise InputError(
                f"{verb}: {subject.name or 'the system'} has no named parameter but {free}; it "
                "must have one under its key parameters"
            )
        Number(low=0.0).read(high, Place(verb, "mu_max"))
        return Varied(subject, free, at, values)

    def check(self, name: str, owner: str, share: bool) -> None:
        """Refuse what is no parameter, and a share of an angle or of zero. Raises InputError."""
        at = Place(owner)
        if name not in self.values:
            allowed = ", ".join(self.values)
            raise at.refuse(f"{name} is no parameter here; allowed are {allowed}")
        if share and name in self.angles:
            raise at.refuse(f"{name} is an angle and has no share; it must be given in rad")
        if share and not self.values[name]:
            raise at.refuse(f"{name} is 0 and has no share; it must be given in its unit")

    def changed(self, values: dict[str, float]) -> Scene | TermSystem:
        """The subject with other values of some parameters. Raises InputError."""
        subject = self.subject
        return subject.replace(**values) if isinstance(subject, Scene) else subject.replace(values)

    def outcome(self, values: dict[str, float], high: float) -> Outcome:
        """What a query says of the critical friction up to `high`. Raises what it raises."""
        changed = self.changed(values)
        if isinstance(changed, Scene):
            answer = critical_friction(changed, high)
        else:
            answer = critical_parameter(changed.plain, high, changed.parameter)
        mu, first = answer.stable_to(high), answer.first
        if mu is None:
            return Outcome()
        if answer.verdict in GROWING:
            return Outcome(critical=0.0, kind=answer.verdict)
        if first is None:
            return Outcome(critical=mu, kind="end of the branch")
        return Outcome.at(mu, first.kind, first.frequency_hz)

    def outcomes(self, names: Sequence[str], values: np.ndarray, high: float) -> list[Outcome]:
        """The outcome of each variation, values (len(names), n)."""
        every = [dict(zip(names, row, strict=True)) for row in values.T.tolist()]
        known: dict[int, Outcome] = {}
        for i, one in enumerate(every):
            try:
                self.changed(one)
            except InputError as error:
                known[i] = Outcome(reason=str(error), no_pad=True)
        rest = [i for i in range(len(every)) if i not in known]
        if isinstance(self.subject, Scene) and rest:
            together = _together(self.subject, names, values[:, rest], high)
            known |= {rest[k]: outcome for k, outcome in together.items()}
        return [known[i] if i in known else self._alone(one, high) for i, one in enumerate(every)]

    def _alone(self, values: dict[str, float], high: float) -> Outcome:
        try:
            return self.outcome(values, high)
        except (InputError, ComputationError) as error:
            changed, rests = self.changed(values), True
            if isinstance(changed, Scene) and not changed.pad_model.linear:
                rests = sliding_equilibrium(changed.pad_model.replace(mu=0.0))[0] is not None
            return Outcome(reason=str(error), no_pad=not rests)


def _together(
    scene: Scene, names: Sequence[str], values: np.ndarray, high: float
) -> dict[int, Outcome]:
    """Outcomes of pads that are followed together, but of those that need a query of their own."""
    try:
        stack = PadStack.of(scene, tuple(names), values)
        losses = stack.first_losses(high)
        decided = ~(losses.unknown | losses.nowhere | stack.stiff)
    except ComputationError:  # for one of them; each says why
        return {}
    outcomes = {}
    for k in np.flatnonzero(decided).tolist():
        mu, hertz = float(losses.mu[k]), float(losses.hertz[k])
        outcomes[k] = Outcome() if math.isnan(mu) else Outcome.at(mu, losses.kinds[k], hertz)
    return outcomes


@dataclass(frozen=True)
class Tolerance:
    """How far a parameter may be off: a share of its value if `relative`, else in its unit.

    Raises InputError unless it is a finite number above 0.
    """

    size: float
    relative: bool = True

    def __post_init__(self) -> None:
        if not (math.isfinite(self.size) and self.size > 0.0):
            raise InputError(
                f"tolerance: {self.size:g} is not allowed; it must be a finite number above 0"
            )

    def step(self, value: float) -> float:
        """The change of a parameter of that value."""
        return self.size * abs(value) if self.relative else self.size


@dataclass(frozen=True)
class Lever:
    """A parameter lowered and raised by `step` (its unit), and what the pad gives then."""

    parameter: str
    unit: str
    value: float
    step: float
    lowered: Outcome
    raised: Outcome

    @property
    def changes(self) -> tuple[float | None, float | None]:
        """How far the critical friction moves when the parameter is lowered, and raised."""
        return self.lowered.change, self.raised.change

    @property
    def size(self) -> float:
        """By what levers are ranked: the larger change."""
        return max((abs(change) for change in self.changes if change is not None), default=0.0)

    def to_dict(self) -> dict[str, Any]:
        """The lever as a JSON row."""
        row = asdict(self)
        for side in SIDES:
            del row[side]["no_pad"]
        return row


@dataclass(frozen=True, eq=False, repr=False)
class Advice(Answer):
    """Levers by effect, the strongest first, on the critical friction in 0 to mu_max.

    name: of the free parameter; nominal: the pad as it is. Where that has no threshold in the
    range, levers that bring one into it come first.
    """

    name: str
    mu: float
    mu_max: float
    nominal: Outcome
    levers: tuple[Lever, ...]
    warnings: tuple[str, ...] = ()

    @property
    def best(self) -> tuple[Lever, str, float] | None:
        """The change that raises the critical friction most: lever, lowering or raising, by how
        much."""
        best = max(self._changes(), key=lambda entry: entry[2], default=None)
        return best if best is not None and best[2] > 0.0 else None

    @property
    def worst(self) -> tuple[Lever, str, float] | None:
        """The change that lowers the critical friction most, None if none does."""
        worst = min(self._changes(), key=lambda entry: entry[2], default=None)
        return worst if worst is not None and worst[2] < 0.0 else None

    def _changes(self) -> list[tuple[Lever, str, float]]:
        return [
            (lever, word, change)
            for lever in self.levers
            for word, change in zip(("lowering", "raising"), lever.changes, strict=True)
            if change is not None
        ]

    def table(self) -> Table:
        def shown(lever: Lever, side: str) -> str:
            outcome = getattr(lever, side)
            if outcome.reason is not None:
                return "no such pad"
            return f"> {self.mu_max:g}" if outcome.critical is None else number(outcome.critical)

        table = list(columns(" ".join(LEVER)))
        for side in SIDES:
            critical: Any = attrgetter(f"{side}.critical")
            cell, words = partial(shown, side=side), f"{self.name} if {side}"
            table.append(Column(f"critical_{side}", "", critical, cell, words=words))
        for side in SIDES:
            change: Any = attrgetter(f"{side}.change")
            table.append(Column(f"change_{side}", "", change))
        return Table(table, self.levers)

    def line(self) -> str:
        """Where stability is lost, and the change that moves this most, in a line."""
        nominal, text = self.nominal, f"no threshold up to {self.name} = {self.mu_max:.3g}"
        if nominal.critical is not None:
            at = f"{self.name} = {nominal.critical:.3g} (own {self.mu:.3g})"
            text = f"{nominal.kind} from {at}"
        if self.best is not None:
            lever, word, change = self.best
            text += f"; best: {word} {lever.parameter} ({self.name} {change:+.2g})"
        if self.worst is not None:
            lever, word, change = self.worst
            text += f"; worst: {word} {lever.parameter} ({self.name} {change:+.2g})"
        return text

    def parts(self) -> Sequence[str | Table]:
        title = "one parameter at a time, strongest first"
        return [replace(self.table(), title=title), self.line()]

    def to_dict(self) -> dict[str, Any]:
        head = {"parameter": self.name, "value": self.mu, "mu": self.mu, "mu_max": self.mu_max}
        names = ("critical", "kind", "frequency_hz")
        head |= {name: getattr(self.nominal, name) for name in names}
        levers = [lever.to_dict() for lever in self.levers]
        return head | {"levers": levers, "advice": self.line()}


def advise(
    subject: object,
    tolerances: Mapping[str, Tolerance] | None = None,
    mu_max: float = 2.0,
    progress: Progress | None = None,
) -> Advice:
    """Lower and raise each parameter by its tolerance, and compute the critical friction again.

    Parameters
    ----------
    subject : Scene or TermSystem
        A scene, or a system with named parameters of at most 100 rows.
    tolerances : mapping of str to Tolerance, optional
        Left out, a parameter changes by 2 per cent, an angle by 0.02 rad, and what is 0 stays.
    mu_max : float
        Upper end of the range that is searched for the critical friction.
    progress : callable, optional
        Called with (done, count) after some of the parameters.

    Returns
    -------
    Advice
        The parameters with what became of the pad, the strongest first.

    Raises
    ------
    InputError
        For a name that is no parameter.
    ComputationError
        If the pad as it is has no equilibrium without friction.

    Examples
    --------
    >>> import squeal
    >>> K = {"a": [[1, 0], [0, 0]], "b": [[0, 0], [0, 1]], "mu": [[0, 1], [-1, 0]]}
    >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"a": 3.0, "b": 2.0})
    >>> advice = squeal.advise(pair)  # flutter from (a - b) / 2 on
    >>> lever, word, change = advice.best
    >>> lever.parameter, word, round(change, 9)
    ('a', 'raising', 0.03)
    """
    varied, named = Varied.of(subject, "advise", mu_max), dict(tolerances or {})
    for name, tolerance in named.items():
        varied.check(name, "tolerance", tolerance.relative)
    values = {name: v for name, v in varied.values.items() if v or name in named}
    nominal, scene = varied.outcome({}, mu_max), varied.subject
    chosen = {name: named.get(name, Tolerance(STEP, name not in varied.angles)) for name in values}
    steps = {name: chosen[name].step(value) for name, value in values.items()}
    levers: dict[str, list[Outcome]] = {}
    # an inertia that follows m, w and h stands alone
    alone = {"I"} if isinstance(scene, Scene) and scene.pad.uniform else set[str]()
    for names in ([n for n in values if n not in alone], [n for n in values if n in alone]):
        own = np.array([values[name] for name in names])[:, None]
        change = np.diag([steps[name] for name in names])
        outcomes = varied.outcomes(names, np.hstack([own - change, own + change]), mu_max)
        for k, name in enumerate(names):
            ends = zip(outcomes[k :: len(names)], (-1, 1), strict=True)
            sides = (replace(o, value=values[name] + way * steps[name]) for o, way in ends)
            levers[name] = [_compared(one, nominal, mu_max) for one in sides]
        if progress is not None and names:
            progress(len(levers), len(values))
    units = {name: unit_word(PARAMETERS[name].unit) for name in values if isinstance(scene, Scene)}
    every = (
        Lever(name, units.get(name, ""), value, steps[name], *levers[name])
        for name, value in values.items()
    )
    ranked = sorted(every, key=lambda lever: lever.size, reverse=True)
    equilibrium = None
    if isinstance(scene, Scene) and not scene.pad_model.linear:
        equilibrium = sliding_equilibrium(scene.pad_model)[0]
    warnings = () if equilibrium is None else equilibrium.warnings
    return Advice(varied.free, varied.at, mu_max, nominal, tuple(ranked), warnings)


def _compared(outcome: Outcome, nominal: Outcome, mu_max: float) -> Outcome:
    """The outcome with the change from the pad as it is."""
    if outcome.reason is not None:
        return outcome
    before, after = (mu_max if one.critical is None else one.critical for one in (nominal, outcome))
    change = 0.0 if abs(after - before) <= ROUNDING * before else after - before
    return replace(outcome, change=change)


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
        if self.kind not in SPREAD.keys:
            raise at.must_be(self.kind, f"one of {', '.join(SPREAD.keys)}")
        if not (math.isfinite(self.size) and self.size > 0.0):
            raise at.must_be(self.size, "a finite number above 0")

    def values(self, nominal: float, random: np.random.Generator, count: int) -> np.ndarray:
        """Values (count,) of the parameter."""
        if self.kind == "within":
            return nominal + self.size * random.uniform(-1.0, 1.0, count)
        deviation = self.size * (abs(nominal) if self.kind == "relative" else 1.0)
        return nominal + deviation * random.standard_normal(count)


@dataclass(frozen=True)
class _Spreads(Kind):
    """A mapping of parameters to how each scatters."""

    def allowed(self) -> str:
        return "a mapping of parameters to spreads such as {relative: 0.05}"

    def read(self, value: Any, at: Place, model: str = "") -> tuple[Spread, ...]:
        if not isinstance(value, dict) or not value:
            raise at.must_be(value, self.allowed())
        pairs = ((name, *SPREAD.read(one, at / name).items()) for name, one in value.items())
        return tuple(Spread(str(name), kind, size) for name, (kind, size) in pairs)


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
    """What a file of spreads asks for.

    ```yaml
    samples: 400              # optional: how many pads are drawn
    seed: 1                   # optional: the same seed draws the same pads
    spreads:                  # each parameter scatters on its own
      k1: {relative: 0.05}    # normal, standard deviation over the value
      alpha1: {absolute: 0.01} # normal, standard deviation in the parameter's unit
      h: {within: 1.0e-4}     # even, between the value minus and plus this
    ```
    """

    spreads: tuple[Spread, ...]
    samples: int = 400
    seed: int = 1

    def drawn(self, varied: Varied) -> np.ndarray:
        """Values (spreads, samples) of each sample. Raises InputError for what does not fit."""
        names = [spread.name for spread in self.spreads]
        at = Place("spreads")
        if not names:
            raise at.refuse("missing; how at least one parameter scatters is required")
        for spread in self.spreads:
            varied.check(spread.name, "spreads", spread.kind == "relative")
            if names.count(spread.name) > 1:
                raise at.refuse(f"{spread.name} is named twice; once is allowed")
        random, own = np.random.default_rng(self.seed), varied.values
        return np.array([s.values(own[s.name], random, self.samples) for s in self.spreads])


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
        count = f"{self.failed} of {self.drawn.samples} samples could not be computed"
        return (f"{count}; the quantiles are those of the others",) if self.failed else ()

    @property
    def quantiles(self) -> tuple[Quantile, ...]:
        """Quantiles with order-statistics intervals free of any distribution."""
        from scipy.stats import binom  # slow to load, and no figure of another answer needs it

        n, every = len(self.critical), len(self.critical) + self.failed

        def at(rank: int) -> float | None:
            value = float(self.critical[rank])
            return None if math.isnan(value) else value

        quantiles = []
        for level in QUANTILES:
            rank = max(math.ceil(level * n) - 1, 0)
            low = int(binom.ppf((1 - CONFIDENCE) / 2, every, level)) - 1 - self.failed
            high = int(binom.ppf((1 + CONFIDENCE) / 2, every, level))
            # beyond the samples the interval is open: 0 below, nothing known above
            bounds = 0.0 if low < 0 else at(low), None if high >= n else at(high)
            quantiles.append(Quantile(level, at(rank), *bounds))
        return tuple(quantiles)

    @property
    def beyond(self) -> int:
        """How many have no threshold up to `mu_max`."""
        return int(np.isnan(self.critical).sum())

    def table(self) -> Table:
        pairs = [(mu, (i + 1) / len(self.critical)) for i, mu in enumerate(self.critical.tolist())]
        mu = Column(self.name, value=lambda pair: pair[0])
        return Table((mu, Column("share", value=lambda pair: pair[1])), pairs)

    def parts(self) -> Sequence[str | Table]:
        def bound(name: str, words: str) -> Column:
            def shown(q: Quantile) -> str:
                mu = getattr(q, name)
                return f"> {self.mu_max:g}" if mu is None else number(mu)

            return Column(name, shown=shown, words=words)

        table = [Column("share unstable, %", value=lambda q: 100 * q.level)]
        table += [bound("mu", self.name), bound("low", "from"), bound("high", "to")]
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
        return [Table(table, self.quantiles, title), line]

    def to_dict(self) -> dict[str, Any]:
        scatter: dict[str, Any] = {"parameter": self.name, "value": self.mu, "mu": self.mu}
        scatter |= {"mu_max": self.mu_max} | asdict(self.drawn)
        names = ("failed", "no_pad", "beyond", "stable")
        scatter |= {name: getattr(self, name) for name in names}
        scatter |= {"interval": list(self.interval), "confidence": CONFIDENCE}
        return {"scatter": scatter | {"quantiles": [asdict(q) for q in self.quantiles]}}


def _work(task: tuple[Varied, list[str], np.ndarray, float]) -> list[Outcome]:
    varied, names, values, mu_max = task
    return varied.outcomes(names, values, mu_max)


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
        Upper end of the range that is searched for the critical friction.
    workers : int
        Processes, which start by import: a script must guard its main part.
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

    Examples
    --------
    >>> import squeal
    >>> K = {"a": [[1, 0], [0, 0]], "b": [[0, 0], [0, 1]], "mu": [[0, 1], [-1, 0]]}
    >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"a": 3.0, "b": 2.0})
    >>> spread = squeal.Spread("a", "within", 0.1)
    >>> [0.45 <= q.mu <= 0.55 for q in squeal.scatter(pair, [spread]).quantiles if q.level == 0.5]
    [True]
    """
    varied = Varied.of(subject, "scatter", mu_max)
    drawn = spreads if isinstance(spreads, Spreads) else Spreads(tuple(spreads))
    values, names = drawn.drawn(varied), [spread.name for spread in drawn.spreads]
    starts = range(0, drawn.samples, CHUNK)
    tasks = [(varied, names, values[:, i : i + CHUNK], mu_max) for i in starts]
    outcomes: list[Outcome] = []
    for part in mapped(_work, tasks, workers):
        outcomes.extend(part)
        if progress is not None:
            progress(len(outcomes), drawn.samples)
    computed = [o for o in outcomes if o.reason is None]
    if not computed:
        raise ComputationError("no sample has an equilibrium in contact without friction")
    no_pad = sum(outcome.no_pad for outcome in outcomes)
    made, failed = len(computed), len(outcomes) - len(computed) - no_pad
    critical = np.sort([math.nan if o.critical is None else o.critical for o in computed])
    above = int(np.sum(~(critical <= varied.at)))  # NaN comes last, and lies above
    interval = _share(above, made + failed)[0], _share(above + failed, made + failed)[1]
    counts = (no_pad, failed, above / made, interval, drawn)
    return Scatter(varied.free, varied.at, mu_max, critical, *counts)


def _share(count: int, total: int) -> tuple[float, float]:
    """Wilson's interval for a share."""
    from scipy.stats import binomtest

    interval = binomtest(count, total).proportion_ci(CONFIDENCE, "wilson")
    return float(interval.low), float(interval.high)
