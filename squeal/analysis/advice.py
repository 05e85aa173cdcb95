"""What would move the critical friction: each parameter changed both ways, everything recomputed.

Where no threshold lies in the range the distance between the closest two frequencies is looked at
instead, which flutter needs to close.
"""

import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from squeal.analysis import subject as subjects
from squeal.analysis.eigenvalues import analyse
from squeal.errors import ComputationError, InputError
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

    def to_record(self) -> dict[str, Any]:
        """A row of a table."""
        same = {name: getattr(self, name) for name in ("parameter", "unit", "value", "step")}
        sides = ("lowered", "raised")
        critical = {f"critical_{side}": getattr(self, side).critical for side in sides}
        changes = (f"{name}_{side}" for name in ("change", "gap_change") for side in sides)
        return same | critical | dict(zip(changes, self.changes + self.gap_changes, strict=True))

    @property
    def size(self) -> tuple[float, float]:
        """By what levers are ranked: the larger change, then that of the gap."""
        return _largest(self.changes), _largest(self.gap_changes)


def _largest(changes: tuple[float | None, float | None]) -> float:
    return max((abs(one) for one in changes if one is not None), default=0.0)


@dataclass(frozen=True)
class Advice:
    """Levers by effect, the strongest first, on the critical friction in 0 to mu_max.

    name: of the free parameter; nominal: the pad as it is. Where that has no threshold in the
    range, the frequency gaps are known, and rank the levers that bring none into it.
    """

    name: str
    mu: float
    mu_max: float
    nominal: Outcome
    levers: tuple[Lever, ...]

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


def advise(
    subject: subjects.Subject,
    tolerances: Mapping[str, Tolerance] | None = None,
    mu_max: float = 2.0,
    progress: Progress | None = None,
) -> Advice:
    """Each parameter lowered and raised by its tolerance, the critical friction computed anew.

    Without a tolerance of its own a parameter changes by 2 per cent, an angle by 0.02 rad; what
    is zero stays as it is unless its tolerance is named. `progress(done, count)` is called after
    each parameter. Raises InputError, and ComputationError if the pad as it is has no equilibrium
    without friction.
    """
    subjects.check_subject(subject, "advise", mu_max)
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
    return Advice(subjects.free_name(subject), subjects.own_value(subject), mu_max, nominal, ranked)


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
