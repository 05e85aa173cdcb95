"""Parameters varied and everything recomputed: what moves the critical friction (advise), and what
tolerances make of it (scatter).

Variations of a pad are followed together as a stack over values of friction, not by the
certified search of a query: a window of growth narrower than a step may be missed. One that a stack
cannot decide is a query of its own, which decides it or says why it cannot.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from statistics import NormalDist
from typing import Any

import numpy as np

from squeal.analysis.answers import Thresholds
from squeal.analysis.eigenvalues import analyse
from squeal.analysis.maps import MU_MAX
from squeal.analysis.stack import PadStack, parameters
from squeal.analysis.thresholds import critical_friction, critical_parameter
from squeal.equilibrium import sliding_equilibrium
from squeal.errors import ComputationError, InputError
from squeal.io.answer import Answer, Column, Table, columns, number, unit_word
from squeal.io.document import read_document
from squeal.io.processes import mapped
from squeal.io.scene import Scene
from squeal.linear import GROWING, Spectrum, complex_eigenvalues
from squeal.linear.system import TermSystem
from squeal.model.pad import PARAMETERS
from squeal.schema.keys import Group, Key
from squeal.schema.place import Place
from squeal.schema.values import FILE, Kind, Number, Whole, takes

LARGEST = 100  # degrees of freedom of a system whose critical friction is computed again and again
ROUNDING = 1e-11  # relative: what a query and a stack may differ by
AT_ONCE = 1e-9  # friction: what grows from here on grows from the start
STEP = 0.02  # of a parameter, in rad of an angle
QUANTILES = (0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99)
CONFIDENCE = 0.95
CHUNK = 64  # samples that are followed together

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Outcome:
    """What becomes of a pad with a parameter changed to `value`.

    critical: the friction up to which it slides steadily and stably, None if no threshold lies in
    the range; kind, frequency_hz: of what happens there; gap: the least relative distance of two
    frequencies, where that was looked at. reason: why nothing is known; no_pad: because there is no
    such pad, or it rests nowhere without friction.
    """

    value: float | None = None
    critical: float | None = None
    kind: str | None = None
    frequency_hz: float | None = None
    gap: float | None = None
    reason: str | None = None
    no_pad: bool = False


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
    def of(given: object, asked: str, high: float) -> Varied:
        """Raises InputError naming `asked`."""
        subject: Any = getattr(given, "system", given)  # of a system file
        if isinstance(subject, Scene):
            MU_MAX.read(high, Place(asked, "mu_max"))
            names = [name for name in parameters(subject.pad_model) if name != "mu"]
            values = {name: getattr(subject.pad, name) for name in names}
            angles = frozenset(name for name in names if PARAMETERS[name].angle)
            return Varied(subject, "mu", subject.pad.mu, values, angles)
        if not isinstance(subject, TermSystem):
            kind = type(subject).__name__
            words = "it must be a Scene or a system with named parameters"
            raise InputError(f"{asked}: {kind} is not allowed; {words}")
        if subject.n > LARGEST:
            raise InputError(
                f"{asked}: {subject.n} degrees of freedom are not allowed; at most {LARGEST} are, "
                "so reduce the system first"
            )
        values, free = dict(subject.parameters), subject.parameter
        at = float(values.pop(free))
        if not values:
            raise InputError(
                f"{asked}: {subject.name or 'the system'} has no named parameter but {free}; it "
                "must have one under its key parameters"
            )
        Number(low=0.0).read(high, Place(asked, "mu_max"))
        return Varied(subject, free, at, values)

    def check(self, name: str, asked: str, share: bool) -> None:
        """Refuse what is no parameter, and a share of an angle or of zero. Raises InputError."""
        at = Place(f"{asked}")
        if name not in self.values:
            allowed = ", ".join(self.values)
            raise at.refuse(f"{name} is no parameter here; allowed are {allowed}")
        if share and name in self.angles:
            raise at.refuse(f"{name} is an angle and has no share; it must be given in rad")
        if share and not self.values[name]:
            raise at.refuse(f"{name} is 0 and has no share; it must be given in its unit")

    def unit(self, name: str) -> str:
        """The unit of a parameter, empty where it is not known or has none."""
        return unit_word(PARAMETERS[name].unit) if isinstance(self.subject, Scene) else ""

    def together(self, names: list[str]) -> list[list[str]]:
        """The names in lists that may be given at once: an inertia that follows stands alone."""
        alone = ["I"] if isinstance(self.subject, Scene) and self.subject.pad.uniform else []
        rest = [name for name in names if name not in alone]
        return [part for part in (rest, [n for n in alone if n in names]) if part]

    def changed(self, values: dict[str, float]) -> Scene | TermSystem:
        """The subject with other values of some parameters. Raises InputError."""
        subject = self.subject
        return subject.replace(**values) if isinstance(subject, Scene) else subject.replace(values)

    def spectrum(self, values: dict[str, float]) -> Spectrum:
        """The eigenvalues at the subject's own friction with some parameters changed."""
        changed = self.changed(values)
        if isinstance(changed, Scene):
            return analyse(changed).spectrum
        return complex_eigenvalues(*changed.arrays({}))

    def outcome(self, values: dict[str, float], high: float) -> Outcome:
        """What a query says of the critical friction up to `high`. Raises what it raises."""
        found = _thresholds(self.changed(values), high)
        mu, first = found.stable_to(high), found.first
        if mu is None:
            return Outcome()
        if mu <= AT_ONCE:
            grows = first is None or found.verdict in GROWING
            return Outcome(critical=0.0, kind=found.verdict if grows else first.kind)  # type: ignore[union-attr]
        if first is not None and first.mu == mu:
            return Outcome(None, mu, first.kind, first.frequency_hz)
        return Outcome(critical=mu, kind="end of the branch")

    def outcomes(self, names: Sequence[str], values: np.ndarray, high: float) -> list[Outcome]:
        """The outcome of each variation, values (len(names), n)."""
        every = [dict(zip(names, row, strict=True)) for row in values.T.tolist()]
        found: list[Outcome | None] = [None] * len(every)
        for i, one in enumerate(every):
            try:
                self.changed(one)
            except InputError as error:
                found[i] = Outcome(reason=str(error), no_pad=True)
        rest = [i for i, known in enumerate(found) if known is None]
        if isinstance(self.subject, Scene) and rest:
            together = _together(self.subject, names, values[:, rest], high)
            for i, known in zip(rest, together, strict=True):
                found[i] = known
        return [known or self._alone(one, high) for known, one in zip(found, every, strict=True)]

    def _alone(self, values: dict[str, float], high: float) -> Outcome:
        try:
            return self.outcome(values, high)
        except (InputError, ComputationError) as error:
            changed, rests = self.changed(values), True
            if isinstance(changed, Scene) and not changed.pad_model.linear:
                rests = sliding_equilibrium(changed.pad_model.replace(mu=0.0))[0] is not None
            return Outcome(reason=str(error), no_pad=not rests)


def _thresholds(subject: Scene | TermSystem, high: float) -> Thresholds:
    if isinstance(subject, Scene):
        return critical_friction(subject, high)
    return critical_parameter(subject.plain, high, subject.parameter)


def _together(
    scene: Scene, names: Sequence[str], values: np.ndarray, high: float
) -> list[Outcome | None]:
    """Outcomes of pads that are followed together, None of one that needs a query of its own."""
    try:
        stack = PadStack.of(scene, tuple(names), values)
        found = stack.first_losses(high)
        doubtful = found.unknown | found.nowhere | stack.stiff
    except ComputationError:  # for one of them; each says why
        return [None] * values.shape[1]
    made: list[Outcome | None] = []
    each = found.mu.tolist(), found.kinds, found.hertz.tolist(), doubtful
    for mu, kind, hertz, unsure in zip(*each, strict=True):
        if unsure:
            made.append(None)
        elif math.isnan(mu):
            made.append(Outcome())
        elif mu <= AT_ONCE:
            made.append(Outcome(critical=0.0, kind=kind))
        else:
            made.append(Outcome(None, mu, kind, None if math.isnan(hertz) else hertz))
    return made


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
    """A parameter lowered and raised by `step` (its unit), and what the pad gives then.

    changes: how far the critical friction moves when it is lowered and raised, at least so far
    where it leaves the range; gap_changes: the same of the distance of the closest frequencies.
    """

    parameter: str
    unit: str
    value: float
    tolerance: Tolerance
    step: float
    lowered: Outcome
    raised: Outcome
    changes: tuple[float | None, float | None]
    gap_changes: tuple[float | None, float | None]

    @property
    def size(self) -> list[float]:
        """By what levers are ranked: the larger change, then that of the gap."""
        pairs = self.changes, self.gap_changes
        return [max((abs(x) for x in pair if x is not None), default=0.0) for pair in pairs]

    def to_dict(self) -> dict[str, Any]:
        """The lever as a JSON row."""
        row: dict[str, Any] = {name: getattr(self, name) for name in LEVER}
        for k, side in enumerate(SIDES):
            outcome = asdict(getattr(self, side))
            outcome["frequency_gap"] = outcome.pop("gap")
            del outcome["no_pad"]
            changes = {"change": self.changes[k], "frequency_gap_change": self.gap_changes[k]}
            row[side] = outcome | changes
        return row


LEVER, SIDES = ("parameter", "unit", "value", "step"), ("lowered", "raised")


@dataclass(frozen=True, eq=False, repr=False)
class Advice(Answer):
    """Levers by effect, the strongest first, on the critical friction in 0 to mu_max.

    name: of the free parameter; nominal: the pad as it is. Where that has no threshold in the
    range, the frequency gaps are known, and rank the levers that bring none into it.
    """

    name: str
    mu: float
    mu_max: float
    nominal: Outcome
    levers: tuple[Lever, ...]
    warnings: tuple[str, ...] = ()

    @property
    def best(self) -> tuple[Lever, str, float] | None:
        """The change that helps most: lever, lowering or raising, by how much.

        It raises the critical friction most, or parts the closest frequencies most.
        """
        found = self._changes("changes" if self.nominal.critical is not None else "gap_changes")
        best = max(found, key=lambda entry: entry[2], default=None)
        return best if best is not None and best[2] > 0.0 else None

    @property
    def worst(self) -> tuple[Lever, str, float] | None:
        """The change that lowers the critical friction most, None if none does."""
        worst = min(self._changes("changes"), key=lambda entry: entry[2], default=None)
        return worst if worst is not None and worst[2] < 0.0 else None

    def _changes(self, of: str) -> list[tuple[Lever, str, float]]:
        return [
            (lever, word, change)
            for lever in self.levers
            for word, change in zip(("lowering", "raising"), getattr(lever, of), strict=True)
            if change is not None
        ]

    def table(self) -> Table:
        """A row for each parameter: its step, and both critical values and their changes."""

        def critical(side: str) -> Column:
            def shown(lever: Lever) -> str:
                outcome = getattr(lever, side)
                if outcome.reason is not None:
                    return "no such pad"
                beyond = outcome.critical is None
                return f"> {self.mu_max:g}" if beyond else number(outcome.critical)

            words = f"{self.name} if {side}"
            value = lambda lever: getattr(lever, side).critical  # noqa: E731
            return Column(f"critical_{side}", "", value, shown, words=words)

        def moved(k: int, of: str, name: str, hidden: bool = False) -> Column:
            value = lambda lever: getattr(lever, of)[k]  # noqa: E731
            return Column(f"{name}_{SIDES[k]}", "", value, hidden=hidden)

        told = [*columns(" ".join(LEVER)), *map(critical, SIDES)]
        told += [moved(k, "changes", "change") for k in range(2)]
        told += [moved(k, "gap_changes", "gap_change", self.nominal.gap is None) for k in range(2)]
        return Table(told, self.levers)

    def line(self) -> str:
        """Where stability is lost, and the change that moves this most, in a line."""
        nominal, told = self.nominal, f"no threshold up to {self.name} = {self.mu_max:.3g}"
        if nominal.critical is not None:
            at = f"{self.name} = {nominal.critical:.3g} (own {self.mu:.3g})"
            told = f"{nominal.kind} from {at}"
        if self.best is not None:
            lever, word, change = self.best
            what = "frequency gap" if nominal.critical is None else self.name
            told += f"; best: {word} {lever.parameter} ({what} {change:+.2g})"
        if self.worst is not None:
            lever, word, change = self.worst
            told += f"; worst: {word} {lever.parameter} ({self.name} {change:+.2g})"
        return told

    def parts(self) -> Sequence[str | Table]:
        """The table of levers and the line."""
        title = "one parameter at a time, strongest first"
        return [replace(self.table(), title=title), self.line()]

    def to_dict(self) -> dict[str, Any]:
        """The JSON object of `squeal advise`."""
        found = {"parameter": self.name, "value": self.mu, "mu": self.mu, "mu_max": self.mu_max}
        found |= {"critical": self.nominal.critical, "kind": self.nominal.kind}
        found |= {"frequency_hz": self.nominal.frequency_hz, "frequency_gap": self.nominal.gap}
        levers = [lever.to_dict() for lever in self.levers]
        return found | {"levers": levers, "advice": self.line()}


def advise(
    subject: object,
    tolerances: Mapping[str, Tolerance] | None = None,
    mu_max: float = 2.0,
    progress: Progress | None = None,
) -> Advice:
    """Lower and raise each parameter by its tolerance, and compute the critical friction anew.

    Parameters
    ----------
    subject : Scene or TermSystem
        A scene, or a system with named parameters of at most 100 rows.
    tolerances : mapping of str to Tolerance, optional
        Left out, a parameter changes by 2 per cent, an angle by 0.02 rad, and what is 0 stays.
    mu_max : float
        Upper end of the range in which the critical friction is sought.
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
    """
    varied, named = Varied.of(subject, "advise", mu_max), dict(tolerances or {})
    for name, tolerance in named.items():
        varied.check(name, "tolerance", tolerance.relative)
    values = {name: v for name, v in varied.values.items() if v or name in named}
    nominal = varied.outcome({}, mu_max)
    by_gap = nominal.critical is None
    if by_gap:
        nominal = replace(nominal, gap=_gap(varied.spectrum({})))
    chosen = {name: named.get(name, Tolerance(STEP, name not in varied.angles)) for name in values}
    steps = {name: chosen[name].step(value) for name, value in values.items()}
    levers = []
    for names in varied.together(list(values)):
        own = np.array([values[name] for name in names])
        change = np.diag([steps[name] for name in names])
        ends = own[:, None] + np.concatenate([-change, change], axis=1)
        found = varied.outcomes(names, ends, mu_max)
        for k, name in enumerate(names):
            pair = (found[k], found[k + len(names)])
            sides = [
                _parted(varied, name, replace(one, value=values[name] + sign * steps[name]), by_gap)
                for sign, one in zip((-1, 1), pair, strict=True)
            ]
            moved = [_moved(one, nominal, mu_max) for one in sides]
            parted = [_widened(one, nominal) for one in sides]
            about = (name, varied.unit(name), values[name], chosen[name], steps[name])
            pairs = (moved[0], moved[1]), (parted[0], parted[1])
            levers.append(Lever(*about, sides[0], sides[1], *pairs))
        if progress is not None:
            progress(len(levers), len(values))
    levers.sort(key=lambda lever: list(values).index(lever.parameter))
    ranked = tuple(sorted(levers, key=lambda lever: lever.size, reverse=True))
    scene, warned = varied.subject, tuple[str, ...]()
    if isinstance(scene, Scene) and not scene.pad_model.linear:
        at = sliding_equilibrium(scene.pad_model)[0]
        warned = () if at is None else at.warnings
    return Advice(varied.free, varied.at, mu_max, nominal, ranked, warned)


def _moved(outcome: Outcome, nominal: Outcome, mu_max: float) -> float | None:
    if outcome.reason is not None:
        return None
    before, after = (mu_max if one.critical is None else one.critical for one in (nominal, outcome))
    return 0.0 if abs(after - before) <= ROUNDING * before else after - before


def _widened(outcome: Outcome, nominal: Outcome) -> float | None:
    if outcome.gap is None or nominal.gap is None:
        return None
    return outcome.gap - nominal.gap


def _parted(varied: Varied, name: str, outcome: Outcome, by_gap: bool) -> Outcome:
    if not by_gap or outcome.reason is not None or outcome.value is None:
        return outcome
    try:
        return replace(outcome, gap=_gap(varied.spectrum({name: outcome.value})))
    except (InputError, ComputationError) as error:
        return Outcome(outcome.value, reason=str(error))


def _gap(spectrum: Spectrum) -> float | None:
    """The least relative distance of two frequencies, None where one is alone."""
    found = sorted(e.frequency_hz for e in spectrum.eigenvalues[::2])
    return min(((b - a) / b if b else 1.0 for a, b in itertools.pairwise(found)), default=None)


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
        named = [spread.name for spread in self.spreads]
        at = Place("spreads")
        if not named:
            raise at.refuse("missing; how at least one parameter scatters is required")
        for spread in self.spreads:
            varied.check(spread.name, "spreads", spread.kind == "relative")
            if named.count(spread.name) > 1:
                raise at.refuse(f"{spread.name} is named twice; once is allowed")
        random = np.random.default_rng(self.seed)
        own = varied.values
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
        told = f"{self.failed} of {self.drawn.samples} samples could not be computed"
        return (f"{told}; the quantiles are those of the others",) if self.failed else ()

    @property
    def quantiles(self) -> tuple[Quantile, ...]:
        """Quantiles with order-statistics intervals free of any distribution."""
        from scipy.stats import binom

        n, every = len(self.critical), len(self.critical) + self.failed

        def at(rank: int) -> float | None:
            value = float(self.critical[rank])
            return None if math.isnan(value) else value

        found = []
        for level in QUANTILES:
            rank = max(math.ceil(level * n) - 1, 0)
            low = int(binom.ppf((1 - CONFIDENCE) / 2, every, level)) - 1 - self.failed
            high = int(binom.ppf((1 + CONFIDENCE) / 2, every, level))
            # beyond the samples the interval is open: 0 below, nothing known above
            bounds = 0.0 if low < 0 else at(low), None if high >= n else at(high)
            found.append(Quantile(level, at(rank), *bounds))
        return tuple(found)

    @property
    def beyond(self) -> int:
        """How many have no threshold up to `mu_max`."""
        return int(np.isnan(self.critical).sum())

    def table(self) -> Table:
        """A row for each sample: its critical friction, and the share of samples up to it."""
        n = len(self.critical)
        pairs = [(mu, (i + 1) / n) for i, mu in enumerate(self.critical.tolist())]
        mu = Column(self.name, value=lambda pair: pair[0])
        return Table((mu, Column("share", value=lambda pair: pair[1])), pairs)

    def parts(self) -> Sequence[str | Table]:
        """The quantiles, and the share that is stable."""

        def bound(name: str, words: str) -> Column:
            def shown(q: Quantile) -> str:
                mu = getattr(q, name)
                return f"> {self.mu_max:g}" if mu is None else number(mu)

            return Column(name, shown=shown, words=words)

        told = [Column("share unstable, %", value=lambda q: 100 * q.level)]
        told += [bound("mu", self.name), bound("low", "from"), bound("high", "to")]
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
    varied = Varied.of(subject, "scatter", mu_max)
    asked = spreads if isinstance(spreads, Spreads) else Spreads(tuple(spreads))
    values, names = asked.drawn(varied), [spread.name for spread in asked.spreads]
    starts = range(0, asked.samples, CHUNK)
    tasks = [(varied, names, values[:, i : i + CHUNK], mu_max) for i in starts]
    found: list[Outcome] = []
    for part in mapped(_work, tasks, workers):
        found.extend(part)
        if progress is not None:
            progress(len(found), asked.samples)
    known = [math.nan if o.critical is None else o.critical for o in found if o.reason is None]
    if not known:
        raise ComputationError("no sample has an equilibrium in contact without friction")
    no_pad = sum(outcome.no_pad for outcome in found)
    made, failed = len(known), len(found) - len(known) - no_pad
    critical = np.sort(known)  # NaN comes last
    above = int(np.sum(~(critical <= varied.at)))
    low = wilson(above, made + failed, CONFIDENCE)[0]
    high = wilson(above + failed, made + failed, CONFIDENCE)[1]
    counts = (no_pad, failed, above / made, (low, high), asked)
    return Scatter(varied.free, varied.at, mu_max, critical, *counts)


def wilson(count: int, total: int, confidence: float = 0.95) -> tuple[float, float]:
    """Wilson's interval for a share of which `count` of `total` were seen.

    By hand, since loading scipy.stats takes longer than what asks for it.
    """
    z = NormalDist().inv_cdf((1.0 + confidence) / 2.0)
    middle, whole = count + z * z / 2.0, total + z * z
    half = z * math.sqrt(count * (total - count) / total + z * z / 4.0)
    low = (middle - half) / whole if count > 0 else 0.0
    high = (middle + half) / whole if count < total else 1.0
    return low, high
