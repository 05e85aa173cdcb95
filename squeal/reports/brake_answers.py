"""The answers that a report is made of, and how its sentences name modes and values."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from squeal.io.writing import Answer, number
from squeal.linear import UnstableMode
from squeal.linear.shaft import speed_words
from squeal.queries.check import Check
from squeal.queries.critical_speeds import CriticalSpeeds
from squeal.queries.energy import Energy
from squeal.queries.mode_paths import Paths
from squeal.queries.remedies.cures import MeetingSearch
from squeal.queries.remedies.meetings import Cure, Meeting
from squeal.queries.remedies.parameters import Bound, Remedy, RemedySearch
from squeal.queries.systems.all_roots import is_small
from squeal.results.eigenvalues import Eigenvalues
from squeal.results.sensitivity import Sensitivity
from squeal.results.sources import unit_of
from squeal.results.sweep import Sweep
from squeal.results.thresholds import Thresholds


@dataclass(frozen=True, eq=False, repr=False)
class BrakeAnswers(Answer):
    """The answers that one page is made of.

    eigenvalues: at the brake's own parameter; thresholds: up to `thresholds.high`; sensitivity: of
    the eigenvalues; onset: sensitivity of the first loss of stability, None where several modes are
    lost at once; check: what the matrices are, None of a scene; energy: what feeds each mode;
    search: the changes of a parameter that stop all modes that grow; cures: the real modes behind
    these, and what separation and damping do; bound: the value below which nothing grows; chart:
    the eigenvalue paths, by whose start modes are numbered in all of these; subject: the scene or
    system; critical: critical speeds where the parameter is that of a shaft.
    """

    name: str
    eigenvalues: Eigenvalues
    thresholds: Thresholds
    sensitivity: Sensitivity
    onset: Sensitivity | None
    check: Check | None
    energy: Energy
    search: RemedySearch
    cures: MeetingSearch
    bound: Bound | None
    chart: Sweep
    subject: Any = field(repr=False)
    critical: CriticalSpeeds | None = None

    @property
    def meetings(self) -> Mapping[int, Meeting]:
        """The real modes behind each mode that grows, by its number."""
        return self.cures.meetings

    @property
    def warnings(self) -> tuple[str, ...]:  # type: ignore[override]
        """What each answer warns of, once."""
        return tuple(dict.fromkeys((*self.eigenvalues.warnings, *self.thresholds.warnings)))

    @cached_property
    def paths(self) -> Paths:
        """The modes of the chart, and which of them meet."""
        return Paths(self.chart)

    @property
    def remedy(self) -> Remedy | None:
        """The best change of one parameter with which nothing grows, None if none is known."""
        return next(iter(self.search.remedies), None)

    @property
    def is_of_band_alone(self) -> bool:
        """Whether nothing was looked at outside of a band; of small systems all roots are known."""
        system = getattr(self.subject, "system", self.subject)
        return bool(self.eigenvalues.extent) and not is_small(system)

    @property
    def growth_outside(self) -> str:
        """What grows outside of the band, in words; empty if nothing is known to."""
        fastest = self.eigenvalues.details.get("fastest_outside")
        if not fastest:
            return ""
        grows = "grows"
        searched = ""
        if self.is_of_band_alone:  # what a search met on its way; others may grow faster
            searched = ", not searched"
            grows = "was seen to grow"
        hertz = number(fastest["frequency_hz"], 4)
        rate = number(fastest["growth_rate"], 4)
        return f"outside of {self.eigenvalues.extent}{searched}, {hertz} Hz {grows} by {rate} 1/s"

    def meeting_of(self, mode: UnstableMode) -> Meeting | None:
        """The two real modes behind a growing one, None where they are not known.

        Examples
        --------
        >>> import squeal
        >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}  # flutter from mu = 3/4 on
        >>> report = squeal.report(squeal.System([[1, 0], [0, 1]], K=K, parameters={"mu": 1.0}))
        >>> [round(hertz, 3) for hertz in report.meeting_of(report.eigenvalues.unstable[0]).hertz]
        [0.159, 0.276]
        """
        return self.meetings.get(self.eigenvalues.mode_of(mode) or 0)

    def at(self, value: float) -> str:
        """A value of the parameter, with the unit where it is a speed.

        Examples
        --------
        >>> import squeal
        >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}
        >>> squeal.report(squeal.System([[1, 0], [0, 1]], K=K)).at(0.5)
        'mu = 0.5'
        """
        end = speed_words(value, unit_of(self.thresholds.source))
        return f"{self.thresholds.parameter} = {number(value, 4)}{end}"

    def whirl(self, speed: float, root: complex) -> str:
        """The direction of a mode of a rotor at a speed, such as forward; empty where unknown.

        Examples
        --------
        >>> import squeal
        >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}
        >>> squeal.report(squeal.System([[1, 0], [0, 1]], K=K)).whirl(0.5, 1j)  # of no rotor
        ''
        """
        if self.critical is None:
            return ""
        return self.critical.diagram.direction(speed, root) or ""


def treated_modes(answers: BrakeAnswers, cure: Cure) -> Iterator[tuple[UnstableMode, Meeting]]:
    """The growing modes that a cure treats, with their real modes; the cure of these stops all."""
    for mode in answers.eigenvalues.unstable:
        meeting = answers.meeting_of(mode)
        if meeting is not None and meeting.advised[cure]:
            yield mode, meeting


def mode_name(number_of_mode: int | None, frequency_hz: float) -> str:
    """A mode by its number, None where it has none, and its frequency."""
    hertz = f"{number(frequency_hz, 4)} Hz"
    if number_of_mode is None:
        return f"the mode at {hertz}"
    return f"mode {number_of_mode} ({hertz})"


def unstable_name(answers: BrakeAnswers, mode: UnstableMode) -> str:
    """A mode that grows by its number and frequency."""
    return mode_name(answers.eigenvalues.mode_of(mode), mode.frequency_hz)


def group_name(group: Sequence[int]) -> str:
    """Two modes by their numbers."""
    lower, upper = sorted(group)
    return f"modes {lower} and {upper}"


def real_modes_name(answers: BrakeAnswers, mode: UnstableMode) -> str:
    """The real modes behind a growing one by their frequencies; empty where these are the modes of
    the chart that meet, or where none is known."""
    meeting = answers.meeting_of(mode)
    if meeting is None:
        return ""
    frequencies = dict.fromkeys(number(hertz, 4) for hertz in meeting.hertz)  # each once
    hertz = f"{' and '.join(frequencies)} Hz"
    if len(meeting.omega) > 2:  # several of one frequency
        return f"all real modes at {hertz}"
    if meeting.is_of_chart:
        return ""
    modes = "the real mode" if len(meeting.omega) == 1 else "real modes"
    return f"{modes} at {hertz}"


def pair_name(answers: BrakeAnswers, mode: UnstableMode) -> str:
    """The modes behind a growing one by the frequencies of real modes, by their numbers where these
    are modes of the chart; of one that grows alone its name."""
    real_modes = real_modes_name(answers, mode)
    if real_modes:
        return real_modes
    group = answers.paths.group_of(answers.eigenvalues.mode_of(mode))
    if len(group) == 2:
        return f"{group_name(group)} ({number(mode.frequency_hz, 4)} Hz)"
    return unstable_name(answers, mode)


def others_text(count: int) -> str:
    """So many others, in words."""
    return "1 other" if count == 1 else f"{count} others"


def capitalised(text: str) -> str:
    """A text that begins with a capital."""
    return text[:1].upper() + text[1:]
