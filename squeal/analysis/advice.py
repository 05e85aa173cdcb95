"""What would move the critical friction: each parameter changed both ways, everything recomputed.

Where no threshold lies in the range the distance between the closest two frequencies is looked at
instead, which flutter needs to close.
"""

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from squeal.analysis import subject as subjects
from squeal.analysis.eigenvalues import analyse
from squeal.equilibrium import sliding_equilibrium
from squeal.errors import ComputationError, InputError
from squeal.io.answer import Answer, Column, Table, columns, number
from squeal.io.scene import Scene
from squeal.linear import GROWING, Spectrum, complex_eigenvalues

Progress = Callable[[int, int], None]
ROUNDING = 1e-12  # relative: a smaller change is none
AT_ONCE = 1e-9  # friction: what grows from here on grows from the start
STEP = 0.02  # of a parameter, in rad of an angle


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
class Outcome:
    """What becomes of a pad with one parameter changed to `value`.

    critical: the friction up to which it slides steadily and stably, None if no threshold lies in
    the range; kind, frequency_hz: of what happens there; gap: the least relative distance of two
    frequencies, where that was looked at. `reason` says why nothing is known.
    """

    value: float | None
    critical: float | None = None
    kind: str | None = None
    frequency_hz: float | None = None
    gap: float | None = None
    reason: str | None = None


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
    def size(self) -> tuple[float, float]:
        """By what levers are ranked: the larger change, then that of the gap."""
        return _largest(self.changes), _largest(self.gap_changes)

    def to_dict(self) -> dict[str, Any]:
        """The lever as a JSON row."""
        sides = {}
        for k, name in enumerate(("lowered", "raised")):
            outcome = asdict(getattr(self, name))
            outcome["frequency_gap"] = outcome.pop("gap")
            changes = {"change": self.changes[k], "frequency_gap_change": self.gap_changes[k]}
            sides[name] = outcome | changes
        own = {name: getattr(self, name) for name in ("parameter", "unit", "value", "step")}
        return own | sides


def _largest(changes: tuple[float | None, float | None]) -> float:
    return max((abs(one) for one in changes if one is not None), default=0.0)


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
        found = self._changes(by_gap=self.nominal.critical is None)
        best = max(found, key=lambda entry: entry[2], default=None)
        return best if best is not None and best[2] > 0.0 else None

    @property
    def worst(self) -> tuple[Lever, str, float] | None:
        """The change that lowers the critical friction most, None if none does."""
        worst = min(self._changes(by_gap=False), key=lambda entry: entry[2], default=None)
        return worst if worst is not None and worst[2] < 0.0 else None

    def _changes(self, by_gap: bool) -> list[tuple[Lever, str, float]]:
        return [
            (lever, word, change)
            for lever in self.levers
            for word, change in zip(
                ("lowering", "raising"), lever.gap_changes if by_gap else lever.changes, strict=True
            )
            if change is not None
        ]

    def table(self) -> Table:
        """A row for each parameter: its step, and both critical values and their changes."""
        sides = [(k, side) for side in ("lowered", "raised") for k in [int(side == "raised")]]

        def at(side: str) -> Column:
            def shown(lever: Lever) -> str:
                outcome = getattr(lever, side)
                if outcome.reason is not None:
                    return "no such pad"
                beyond = outcome.critical is None
                return f"> {self.mu_max:g}" if beyond else number(outcome.critical)

            return Column(
                f"critical_{side}", "", lambda lever: getattr(lever, side).critical, shown,
                words=f"{self.name} if {side}",
            )  # fmt: skip

        def moved(k: int, side: str, gap: bool) -> Column:
            def value(lever: Lever) -> float | None:
                return (lever.gap_changes if gap else lever.changes)[k]

            name, hidden = ("gap_change", self.nominal.gap is None) if gap else ("change", False)
            return Column(f"{name}_{side}", "", value, hidden=hidden)

        return Table(
            (
                *columns("parameter unit value step"),
                *(at(side) for _, side in sides),
                *(moved(k, side, gap) for gap in (False, True) for k, side in sides),
            ),
            self.levers,
        )

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
        return [
            replace(self.table(), title="one parameter at a time, strongest first"),
            self.line(),
        ]

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
        Called with (done, count) after each parameter.

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
    subject = subjects.varied_subject(subject, "advise", mu_max)
    named = dict(tolerances or {})
    for name, tolerance in named.items():
        subjects.check_name(subject, name, "tolerance", tolerance.relative)
    values = {name: v for name, v in subjects.named_values(subject).items() if v or name in named}
    chosen = {
        name: Tolerance(STEP, not subjects.is_angle(subject, name)) for name in values
    } | named
    nominal = _outcome(subject, None, {}, mu_max)
    if nominal.critical is None:
        nominal = _with_gap(subject, nominal, {})
    levers = []
    for done, (name, value) in enumerate(values.items(), 1):
        step = chosen[name].step(value)
        lowered, raised = (
            _changed(subject, name, changed, nominal, mu_max)
            for changed in (value - step, value + step)
        )
        moved = (_moved(lowered, nominal, mu_max), _moved(raised, nominal, mu_max))
        parted = (_parted(lowered, nominal), _parted(raised, nominal))
        about = (name, subjects.unit_of(subject, name), value, chosen[name], step)
        levers.append(Lever(*about, lowered, raised, moved, parted))
        if progress is not None:
            progress(done, len(values))
    ranked = tuple(sorted(levers, key=lambda lever: lever.size, reverse=True))
    warned: tuple[str, ...] = ()
    if isinstance(subject, Scene) and not subject.pad_model.linear:
        own = sliding_equilibrium(subject.pad_model)[0]
        warned = () if own is None else own.warnings
    free, at = subjects.free_name(subject), subjects.own_value(subject)
    return Advice(free, at, mu_max, nominal, ranked, warned)


def _changed(
    subject: subjects.Subject, name: str, value: float, nominal: Outcome, mu_max: float
) -> Outcome:
    try:
        outcome = _outcome(subject, value, {name: value}, mu_max)
        return outcome if nominal.gap is None else _with_gap(subject, outcome, {name: value})
    except (InputError, ComputationError) as error:
        return Outcome(value, reason=str(error))


def _moved(outcome: Outcome, nominal: Outcome, mu_max: float) -> float | None:
    if outcome.reason is not None:
        return None
    before, after = (mu_max if one.critical is None else one.critical for one in (nominal, outcome))
    return 0.0 if abs(after - before) <= ROUNDING * before else after - before


def _parted(outcome: Outcome, nominal: Outcome) -> float | None:
    known = outcome.gap is not None and nominal.gap is not None
    return outcome.gap - nominal.gap if known else None  # type: ignore[operator]


def _outcome(
    subject: subjects.Subject, value: float | None, changes: dict[str, float], mu_max: float
) -> Outcome:
    found = subjects.critical_of(subjects.varied(subject, changes), mu_max)
    mu, first = found.stable_to(mu_max), found.first
    if mu is None:
        return Outcome(value)
    if mu <= AT_ONCE:
        return Outcome(
            value, 0.0, found.at_zero if first is None or found.at_zero in GROWING else first.kind
        )
    if first is not None and first.mu == mu:
        return Outcome(value, mu, first.kind, first.frequency_hz)
    return Outcome(value, mu, "end of the branch")


def _with_gap(subject: subjects.Subject, outcome: Outcome, changes: dict[str, float]) -> Outcome:
    """The outcome with the least relative distance of two frequencies; None where one is alone."""
    found = sorted(
        e.frequency_hz for e in _spectrum(subjects.varied(subject, changes)).eigenvalues[::2]
    )
    gaps = ((b - a) / b if b else 1.0 for a, b in itertools.pairwise(found))
    return replace(outcome, gap=min(gaps, default=None))


def _spectrum(subject: subjects.Subject) -> Spectrum:
    if isinstance(subject, Scene):
        return analyse(subject).spectrum
    return complex_eigenvalues(*subjects.dense(subject)(subjects.own_value(subject)))
