"""Parameters varied and everything computed again: what moves the critical friction (advise), and
what tolerances make of it (scatter).

Variations of a pad are followed together as a stack over values of friction, not by the
certified search of a query: a window of growth narrower than a step may be missed. One that a stack
cannot decide is a query of its own, which decides it or says why it cannot.
"""

from __future__ import annotations

import math
from collections import namedtuple
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from operator import attrgetter, itemgetter
from pathlib import Path
from typing import Any

import numpy as np

from squeal.analysis.pads import MU_MAX
from squeal.analysis.stack import PadStack, parameters
from squeal.analysis.verbs import thresholds
from squeal.equilibrium import sliding_equilibrium
from squeal.errors import ComputationError, InputError
from squeal.io.processes import mapped
from squeal.io.scene import Scene
from squeal.io.writing import Answer, Column, Table, columns, number, picked, unit_word
from squeal.linear import GROWING
from squeal.linear.system import TermSystem
from squeal.model.pad import PARAMETERS
from squeal.schema import Group, Key, Named, Number, Place, Whole, read_document

LARGEST = 100  # degrees of freedom of a system whose critical friction is computed again and again
ROUNDING = 1e-11  # relative: what a query and a stack may differ by
AT_ONCE = 1e-9  # friction: what grows from here on grows from the start
STEP = 0.02  # of a parameter, in rad of an angle
QUANTILES = (0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99)
CONFIDENCE = 0.95
CHUNK = 64  # samples that are followed together
SIDES = {"lowered": "lowering", "raised": "raising"}
NO_PAD, NO_REST = "no pad", "there is no equilibrium in contact without friction"


@dataclass(frozen=True)
class Outcome:
    """What becomes of a pad with a parameter changed to `value`.

    critical: the friction up to which it slides steadily and stably, None if no threshold lies in
    the range; kind, frequency_hz: of what happens there; change: of the critical friction, at least
    so much where it leaves the range. reason: why nothing is known; kind is then `NO_PAD` where
    there is no such pad, or it rests nowhere without friction.
    """

    value: float | None = None
    critical: float | None = None
    kind: str | None = None
    frequency_hz: float | None = None
    reason: str | None = None
    change: float | None = None


def _shown(mu: float | None, high: float) -> str:
    """A critical friction for people, None if it lies above the range."""
    return f"> {high:g}" if mu is None else number(mu)


def _lost(mu: float, kind: str, hertz: float = math.nan) -> Outcome:
    """Stability that is lost at mu, NaN if nowhere; at once it has no frequency of its own."""
    if math.isnan(mu):
        return Outcome()
    if mu <= AT_ONCE:
        return Outcome(critical=0.0, kind=kind)
    return Outcome(None, float(mu), kind, None if math.isnan(hertz) else float(hertz))


def critical(subject: Scene | TermSystem, high: float) -> Outcome:
    """What a query says of the critical friction up to `high`. Raises what it raises."""
    answer = thresholds(subject, high)
    if answer.verdict in GROWING:
        return _lost(0.0, answer.verdict)
    if answer.first is not None:
        return _lost(answer.first.mu, answer.first.kind, answer.first.frequency_hz)
    return _lost(answer.high if answer.high < high else math.nan, "end of the branch")


@dataclass(frozen=True, eq=False)
class Varied:
    """A scene or system with the parameters that its critical friction depends on, in SI units.

    free, at: name and own value of the friction or free parameter, which is none of them.
    """

    subject: Scene | TermSystem
    free: str
    at: float
    values: dict[str, float]
    units: dict[str, str]

    @staticmethod
    def of(argument: object, verb: str, high: float) -> Varied:
        """What may be varied. Raises InputError naming the verb."""
        subject: Any = getattr(argument, "system", argument)  # of a system file
        at = Place(verb)
        if isinstance(subject, Scene):
            MU_MAX.read(high, at / "mu_max")
            values = picked(subject.pad, " ".join(parameters(subject.pad_model)))
            units = {name: unit_word(PARAMETERS[name].unit) for name in values}
            values.pop("mu", None)
            return Varied(subject, "mu", subject.pad.mu, values, units)
        if not isinstance(subject, TermSystem):
            allowed = "it must be a Scene or a system with named parameters"
            raise at.refuse(f"{type(subject).__name__} is not allowed; {allowed}")
        if subject.n > LARGEST:
            words = f"at most {LARGEST} are, so reduce the system first"
            raise at.refuse(f"{subject.n} degrees of freedom are not allowed; {words}")
        Number(low=0.0).read(high, at / "mu_max")
        values = dict(subject.parameters)
        own = float(values.pop(subject.parameter))
        if not values:
            words = "it must have one under its key parameters"
            raise at.refuse(
                f"{subject.name} has no named parameter but {subject.parameter}; {words}"
            )
        return Varied(subject, subject.parameter, own, values, dict.fromkeys(values, ""))

    def step(self, name: str, size: float, share: bool, at: Place) -> float:
        """A share of a parameter's value, or a number in its unit, as a change in its unit.

        Raises InputError for what is no parameter, and for a share of an angle or of zero.
        """
        if name not in self.values:
            raise at.refuse(f"{name} is no parameter here; allowed are {', '.join(self.values)}")
        if share and self.units[name] == "rad":
            raise at.refuse(f"{name} is an angle and has no share; it must be given in rad")
        if share and not self.values[name]:
            raise at.refuse(f"{name} is 0 and has no share; it must be given in its unit")
        return size * abs(self.values[name]) if share else size

    def outcomes(self, changes: Sequence[dict[str, float]], high: float) -> list[Outcome]:
        """What becomes of the subject with each change of some parameters."""
        subject: Any = self.subject
        outcomes, changed = dict[int, Outcome](), dict[int, Any]()
        for i, values in enumerate(changes):
            try:
                scene = isinstance(subject, Scene)
                changed[i] = subject.replace(**values) if scene else subject.replace(values)
            except InputError as error:
                outcomes[i] = Outcome(kind=NO_PAD, reason=str(error))
        if isinstance(subject, Scene) and changed:
            names = tuple(self.values)  # all of them: some may follow others
            rows = [[getattr(one.pad, name) for one in changed.values()] for name in names]
            try:
                losses = PadStack.of(subject, names, np.array(rows)).first_losses(high)
                for i, *loss, unknown, nowhere in zip(changed, *losses, strict=True):
                    if not unknown:
                        nothing = Outcome(kind=NO_PAD, reason=NO_REST)
                        outcomes[i] = nothing if nowhere else _lost(*loss)
            except ComputationError:  # for one of them; each says why
                pass
        for i in changed.keys() - outcomes:
            try:
                outcomes[i] = critical(changed[i], high)
            except (InputError, ComputationError) as error:
                outcomes[i] = Outcome(reason=str(error))
        return [outcomes[i] for i in range(len(changes))]


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
    def changes(self) -> list[tuple[float, Lever, str]]:
        """How each change moves the critical friction, by its effect: the most helpful last."""
        changes = (
            (change, lever, word)
            for lever in self.levers
            for word, change in zip(SIDES.values(), lever.changes, strict=True)
            if change
        )
        return sorted(changes, key=itemgetter(0))

    def table(self) -> Table:
        head, cells = columns("parameter unit value step"), []
        for side in SIDES:

            def shown(lever: Lever, side: str = side) -> str:
                outcome: Outcome = getattr(lever, side)
                return "no such pad" if outcome.reason else _shown(outcome.critical, self.mu_max)

            value: Any = attrgetter(f"{side}.critical")
            cells.append(
                Column(f"critical_{side}", "", value, shown, words=f"{self.name} if {side}")
            )
        changes = (Column(f"change_{k}", value=attrgetter(f"{k}.change")) for k in SIDES)
        title = "one parameter at a time, strongest first"
        return Table((*head, *cells, *changes), self.levers, title)

    def line(self) -> str:
        """Where stability is lost, and the change that moves this most, in a line."""
        nominal, text = self.nominal, f"no threshold up to {self.name} = {self.mu_max:.3g}"
        if nominal.critical is not None:
            at = f"{self.name} = {nominal.critical:.3g} (own {self.mu:.3g})"
            text = f"{nominal.kind} from {at}"
        best = [("best", one) for one in self.changes[-1:] if one[0] > 0.0]
        worst = [("worst", one) for one in self.changes[:1] if one[0] < 0.0]
        for what, (change, lever, word) in best + worst:
            text += f"; {what}: {word} {lever.parameter} ({self.name} {change:+.2g})"
        return text

    def parts(self) -> Sequence[str | Table]:
        return [self.table(), self.line()]

    def to_dict(self) -> dict[str, Any]:
        head = {"parameter": self.name, "value": self.mu, "mu": self.mu, "mu_max": self.mu_max}
        head |= picked(self.nominal, "critical kind frequency_hz")
        return head | {"levers": [asdict(one) for one in self.levers], "advice": self.line()}


def advise(
    subject: object, tolerances: Mapping[str, float | str] | None = None, mu_max: float = 2.0
) -> Advice:
    """Lower and raise each parameter by its tolerance, and compute the critical friction again.

    Parameters
    ----------
    subject : Scene or TermSystem
        A scene, or a system with named parameters of at most 100 rows.
    tolerances : mapping of str to float or str, optional
        In the parameter's unit, or a share of its value such as "5%". Left out, a parameter
        changes by 2 per cent, an angle by 0.02 rad, and what is 0 stays.
    mu_max : float
        Upper end of the range that is searched for the critical friction.

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
    >>> change, lever, word = squeal.advise(pair).changes[-1]  # flutter from (a - b) / 2 on
    >>> lever.parameter, word, round(change, 9)
    ('a', 'raising', 0.03)
    """
    varied = Varied.of(subject, "advise", mu_max)
    usual = {n: STEP if varied.units[n] == "rad" else f"{100 * STEP}%" for n in varied.values}
    sizes = {n: size for n, size in usual.items() if varied.values[n]} | dict(tolerances or {})
    steps = {name: _tolerance(varied, name, size) for name, size in sizes.items()}
    nominal, scene = critical(varied.subject, mu_max), varied.subject
    changes = [{n: varied.values[n] + way * steps[n]} for n in steps for way in (-1.0, 1.0)]
    sides = [
        replace(side, value=value, change=_change(nominal, side, mu_max))
        for side, own in zip(varied.outcomes(changes, mu_max), changes, strict=True)
        for value in own.values()
    ]
    levers = [
        Lever(name, varied.units[name], varied.values[name], step, lowered, raised)
        for (name, step), lowered, raised in zip(
            steps.items(), sides[::2], sides[1::2], strict=True
        )
    ]
    levers.sort(key=lambda one: -max(abs(change or 0.0) for change in one.changes))
    warnings: tuple[str, ...] = ()
    if isinstance(scene, Scene) and not scene.pad_model.linear:
        equilibrium = sliding_equilibrium(scene.pad_model)[0]
        warnings = () if equilibrium is None else equilibrium.warnings
    return Advice(varied.free, varied.at, mu_max, nominal, tuple(levers), warnings)


def _tolerance(varied: Varied, name: str, size: float | str) -> float:
    """A tolerance in the parameter's unit. Raises InputError."""
    at, text = Place(f"tolerance {name}={size}"), str(size)
    try:
        value = float(text.removesuffix("%"))
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        allowed = "a finite number above 0, in the parameter's unit or as a share such as 5%"
        raise at.refuse(f"it must be {allowed}")
    share = text.endswith("%")
    return varied.step(name, value / 100 if share else value, share, at)


def _change(nominal: Outcome, outcome: Outcome, mu_max: float) -> float | None:
    """How far the critical friction moved from that of the pad as it is."""
    if outcome.reason is not None:
        return None
    before, after = (mu_max if one.critical is None else one.critical for one in (nominal, outcome))
    return 0.0 if abs(after - before) <= ROUNDING * before else after - before


_ABOVE = Number(low=0.0)
_SPREAD = Group(
    {
        "relative": Key("normal, standard deviation over the value", _ABOVE),
        "absolute": Key("normal, standard deviation in the parameter's unit", _ABOVE),
        "within": Key("even, between the value minus and plus this", _ABOVE),
    },
    only_one=True,
)
_SPREADS = Named(_SPREAD, "a mapping of parameters to spreads such as {relative: 0.05}")


SPREADS = Group(
    {
        "samples": Key("how many are drawn", Whole(10, 1_000_000), default="400"),
        "seed": Key("of the random numbers", Whole(0, 2**32 - 1), default="1"),
        "spreads": Key("how each parameter scatters", _SPREADS, required=True),
    },
    owner="a file of spreads",
)


def read_spreads(path: Path | str) -> dict[str, Any]:
    """Read a file of spreads: arguments of `scatter`, but for the parameters unchecked there.

    Raises InputError with one sentence that names the file, the key and what is allowed.
    """
    return SPREADS.read(*read_document(path))


Quantile = namedtuple("Quantile", "level mu low high")


@dataclass(frozen=True, eq=False, repr=False)
class Scatter(Answer):
    """Critical friction of many pads whose parameters scatter.

    spreads: how each parameter does; critical (n,): the first loss of stability of each pad,
    sorted, NaN where none lies below `mu_max`. no_pad: samples that cannot be pads or rest nowhere
    without friction, left out; failed: samples that could not be computed, which widen all
    intervals, since nothing is known of them. stable, interval: share of the pads whose first loss
    lies above the subject's own mu.
    """

    name: str
    mu: float
    mu_max: float
    spreads: Mapping[str, Mapping[str, float]]
    samples: int
    seed: int
    critical: np.ndarray = field(repr=False)
    no_pad: int
    failed: int
    stable: float
    interval: tuple[float, float]

    @property
    def warnings(self) -> tuple[str, ...]:  # type: ignore[override]
        """How many samples could not be computed."""
        count = f"{self.failed} of {self.samples} samples could not be computed"
        return (f"{count}; the quantiles are those of the others",) if self.failed else ()

    @property
    def quantiles(self) -> tuple[Quantile, ...]:
        """Quantiles mu with intervals low to high that hold them with `CONFIDENCE`, by order
        statistics free of any distribution; None lies above `mu_max`."""
        from scipy.stats import binom  # slow to load, and no figure of another answer needs it

        n, count = len(self.critical), len(self.critical) + self.failed
        critical = [None if math.isnan(mu) else mu for mu in self.critical.tolist()]
        quantiles = []
        for level in QUANTILES:
            low = int(binom.ppf((1 - CONFIDENCE) / 2, count, level)) - 1 - self.failed
            high = int(binom.ppf((1 + CONFIDENCE) / 2, count, level))
            # beyond the samples the interval is open: 0 below, nothing known above
            bounds = 0.0 if low < 0 else critical[low], None if high >= n else critical[high]
            quantiles.append(Quantile(level, critical[max(math.ceil(level * n) - 1, 0)], *bounds))
        return tuple(quantiles)

    @property
    def beyond(self) -> int:
        """How many have no threshold up to `mu_max`."""
        return int(np.isnan(self.critical).sum())

    def table(self) -> Table:
        pairs = [(mu, (i + 1) / len(self.critical)) for i, mu in enumerate(self.critical.tolist())]
        mu, share = Column(self.name, value=itemgetter(0)), Column("share", value=itemgetter(1))
        return Table((mu, share), pairs)

    def parts(self) -> Sequence[str | Table]:
        table = [Column("share unstable, %", value=lambda q: 100 * q.level)]
        for name, words in (("mu", self.name), ("low", "from"), ("high", "to")):
            value: Any = attrgetter(name)
            shown = lambda q, of=value: _shown(of(q), self.mu_max)  # noqa: E731
            table.append(Column(name, "", value, shown, words=words))
        title = (
            f"{self.samples} samples, seed {self.seed}: first loss of stability up to "
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
        scatter: dict[str, Any] = {"parameter": self.name, "value": self.mu}
        scatter |= picked(self, "mu mu_max samples seed failed no_pad beyond stable interval")
        pairs = [(name, *pair) for name, one in self.spreads.items() for pair in one.items()]
        scatter["spreads"] = [
            dict(zip(("name", "kind", "size"), one, strict=True)) for one in pairs
        ]
        scatter["quantiles"] = [q._asdict() for q in self.quantiles]
        return {"scatter": scatter | {"confidence": CONFIDENCE}}


def _work(task: tuple[Varied, list[dict[str, float]], float]) -> list[Outcome]:
    return task[0].outcomes(*task[1:])


def scatter(
    subject: object,
    spreads: Mapping[str, Mapping[str, float]],
    samples: int = 400,
    seed: int = 1,
    mu_max: float = 2.0,
    workers: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> Scatter:
    """Draw pads whose parameters scatter, and compute the critical friction of each.

    Parameters
    ----------
    subject : Scene or TermSystem
        A scene, or a system with named parameters of at most 100 rows.
    spreads : mapping of str to mapping
        How each parameter scatters on its own: normally with the standard deviation ``relative``
        to its value or ``absolute`` in its unit, or evenly ``within`` its value plus and minus so
        much, such as ``{"k1": {"relative": 0.05}}``.
    samples, seed : int
        How many are drawn, and of the random numbers: the same seed draws the same pads.
    mu_max : float
        Upper end of the range that is searched for the critical friction.
    workers : int
        Processes, which start by import: a script must guard its main part.
    progress : callable, optional
        Called with (done, count) now and then.

    Returns
    -------
    Scatter
        Sorted critical frictions and their quantiles.

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
    >>> answer = squeal.scatter(pair, {"a": {"within": 0.1}})
    >>> [0.45 <= q.mu <= 0.55 for q in answer.quantiles if q.level == 0.5]
    [True]
    """
    from scipy.stats import binomtest

    drawn = {"spreads": spreads, "samples": samples, "seed": seed}
    samples, seed, spreads = SPREADS.read(drawn, Place("scatter")).values()
    if not spreads:
        raise Place("spreads").must_be(spreads, _SPREADS.named)
    varied, random = Varied.of(subject, "scatter", mu_max), np.random.default_rng(seed)
    drawn, outcomes = dict[str, Any](), list[Outcome]()
    for name, ((kind, size),) in ((name, one.items()) for name, one in spreads.items()):
        step, even = varied.step(name, size, kind == "relative", Place("spreads")), kind == "within"
        unit = random.uniform(-1.0, 1.0, samples) if even else random.standard_normal(samples)
        drawn[name] = (varied.values[name] + step * unit).tolist()
    pads = [dict(zip(drawn, values, strict=True)) for values in zip(*drawn.values(), strict=True)]
    tasks = [(varied, pads[i : i + CHUNK], mu_max) for i in range(0, samples, CHUNK)]
    for part in mapped(_work, tasks, workers):
        outcomes.extend(part)
        if progress is not None:
            progress(len(outcomes), samples)
    computed = [o for o in outcomes if o.reason is None]
    if not computed:
        raise ComputationError(f"no sample can be computed: {NO_REST}")
    no_pad = sum(outcome.kind == NO_PAD for outcome in outcomes)
    made, failed = len(computed), len(outcomes) - len(computed) - no_pad
    first = np.sort([math.nan if o.critical is None else o.critical for o in computed])
    above = int(np.sum(~(first <= varied.at)))  # NaN comes last, and lies above
    least, most = (
        binomtest(count, made + failed).proportion_ci(CONFIDENCE, "wilson")
        for count in (above, above + failed)
    )
    head = varied.free, varied.at, mu_max, spreads, samples, seed
    interval = float(least.low), float(most.high)
    return Scatter(*head, first, no_pad, failed, above / made, interval)
