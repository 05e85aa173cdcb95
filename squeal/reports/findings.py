"""What a report found of a brake, in sentences: what grows, why, and what to change."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from operator import itemgetter
from typing import Any

import numpy as np

from squeal.io.scene import Scene
from squeal.io.writing import Answer, Column, Panel, Table, number, picked
from squeal.linear import GROWING, CriticalPoint, UnstableMode
from squeal.linear.shaft import speed_words
from squeal.model.pad import PARAMETERS
from squeal.queries.check import Check
from squeal.queries.critical_speeds import CriticalSpeeds
from squeal.queries.energy import Energy
from squeal.queries.meetings import MOST, Cure, Meeting
from squeal.queries.mode_paths import Paths
from squeal.queries.remedies import BETTER, Remedy, RemedySearch, rounded
from squeal.queries.systems.all_roots import is_small
from squeal.results.eigenvalues import Eigenvalues
from squeal.results.sensitivity import Sensitivity
from squeal.results.sources import unit_of
from squeal.results.sweep import Sweep
from squeal.results.thresholds import Thresholds

ROUNDED = {"frequency_hz", "growth_rate", "damping_ratio"}  # columns of the page in four digits
NAMED = 3  # modes or parameters in a sentence
WORTH = 0.9  # of the fastest growth: a change that leaves more is no choice
NO_WAY = 90.0  # %: nobody takes the parameter back by more
SAME_START = 1e-3  # of the frequency: so near is a mode of the chart to its real mode
TIMES = 3.0  # from which on a value is so many times another one, not so many % above it
STATIONARY = (
    " This damping must be stationary, as that of bearings: of the turning shaft it feeds forward "
    "whirl above its critical speed."
)
OF_CONTACT = {"contact", "tangential"}  # parameters of an exported or joined brake
HINT = (
    "To see what a part can do, name its stiffness or a shim as a parameter in the system file: "
    "docs/page.md shows how."
)


@dataclass(frozen=True, eq=False, repr=False)
class Findings(Answer):
    """The answers that one page is made of, and its sentences.

    eigenvalues: at the brake's own parameter; thresholds: up to `thresholds.high`; sensitivity: of
    the eigenvalues; onset: sensitivity of the first loss of stability, None where several modes are
    lost at once; check: what the matrices are, None of a scene; energy: what feeds each mode;
    search: the changes that stop all modes that grow; meetings: the two real modes behind each of
    these, by its number; outside: thresholds of what grows outside of a band, where that is known;
    chart: the eigenvalue paths, by whose start modes are numbered in all of these; subject: the
    scene or system; critical: critical speeds where the parameter is that of a shaft.
    """

    panel = Panel("frequency_hz", "growth_rate")

    name: str
    eigenvalues: Eigenvalues
    thresholds: Thresholds
    sensitivity: Sensitivity
    onset: Sensitivity | None
    check: Check | None
    energy: Energy
    search: RemedySearch
    meetings: Mapping[int, Meeting]
    outside: Thresholds | None
    chart: Sweep
    subject: Any = field(repr=False)
    critical: CriticalSpeeds | None = None

    @property
    def warnings(self) -> tuple[str, ...]:  # type: ignore[override]
        """What each answer warns of, once."""
        return tuple(dict.fromkeys((*self.eigenvalues.warnings, *self.thresholds.warnings)))

    @cached_property
    def paths(self) -> Paths:
        """The modes of the chart, and which of them meet."""
        return Paths(self.chart)

    @property
    def _growth_outside(self) -> str:
        """What grows outside of the band, in words; empty if nothing is known to."""
        fastest = self.eigenvalues.details.get("fastest_outside")
        if not fastest:
            return ""
        grows = "grows"
        searched = ""
        if self._is_of_band_alone():  # what a search met on its way; others may grow faster
            searched = ", not searched"
            grows = "was seen to grow"
        hertz = number(fastest["frequency_hz"], 4)
        rate = number(fastest["growth_rate"], 4)
        return f"outside of {self.eigenvalues.extent}{searched}, {hertz} Hz {grows} by {rate} 1/s"

    @property
    def remedy(self) -> Remedy | None:
        """The best change of one parameter with which nothing grows, None if none is known."""
        return next(iter(self.search.remedies), None)

    @property
    def opening(self) -> dict[str, str]:
        """The first sentences by their labels: fault, cause and remedy, or a verdict."""
        if not self.eigenvalues.unstable:
            return {"Verdict": self._without_growth()}
        lines = {"Fault": self.fault}
        for cause in self.causes[:1]:
            lines["Cause"] = cause
        return lines | {"Remedy": self.ways[0]}

    @property
    def fault(self) -> str:
        """Which mode grows fastest, at what value, how fast and from where on; what else grows."""
        spectrum = self.eigenvalues
        lead, *others = spectrum.unstable
        text = f"{self._name(lead)} grows by {number(lead.growth_rate, 4)} 1/s"
        if lead.frequency_hz:
            text += f", damping {number(100.0 * lead.damping_ratio, 3)} %"
        if spectrum.depends:
            text += f", at {self._at(spectrum.value)}"
        if lead.onset is not None:
            text += f"; it grows from {self._at(lead.onset)} on"
        sentences = [text]
        if others:
            names = []
            for mode in others[: NAMED - 1]:
                names.append(f"{self._name(mode)} by {number(mode.growth_rate, 3)} 1/s")
            unnamed = len(others) - len(names)
            more = f", {_others(unnamed)}" * bool(unnamed)
            grows = "mode grows" if len(others) == 1 else "modes grow"
            sentences.append(f"{len(others)} more {grows}: {', '.join(names)}{more}")
        outside = self._growth_outside
        fastest = spectrum.details.get("fastest_outside") or {}
        if fastest.get("growth_rate", 0.0) > lead.growth_rate:
            sentences.insert(0, f"{outside}, faster than all inside")
        else:
            sentences.append(outside)
        return f"{'. '.join(map(_capitalised, filter(None, sentences)))}."

    @property
    def causes(self) -> list[str]:
        """Why the fastest `NAMED` modes grow, a line each: which modes meet, what feeds them."""
        lines: list[str] = []
        for mode in self.eigenvalues.unstable[:NAMED]:
            number_of_mode = self.eigenvalues.mode_of(mode)
            if number_of_mode in self.energy.modes:
                head = f"{self._name(mode)}: " * bool(lines)
                lines.append(_capitalised(head + self._cause(mode, number_of_mode)))
        return lines

    def _cause(self, mode: UnstableMode, number_of_mode: int) -> str:
        """Which modes meet and where, or that none does, and which terms feed a mode."""
        _, _, balance = self.energy.sentence(number_of_mode).partition(": ")
        balance = balance.partition("; in all")[0]
        balance = balance.replace("circulatory", "cross-coupled (skew-symmetric) stiffness")
        group = self.paths.group_of(number_of_mode)
        real = self._real_modes(mode)
        words = ""
        if len(group) == 2 and real:
            words = f"it is made of {real} without friction and damping: "
        elif len(group) == 2:
            start = max(self.paths.at[one][0] for one in group)
            hertz = []
            for one in group:
                root = self.paths.root_at(one, start) or 0j
                hertz.append(number(root.imag / math.tau, 4))
            words = f"{_numbers(group)} ({' and '.join(hertz)} Hz at {self._at(start)}) "
            meeting = self.paths.meeting(group)
            words += "come together" if meeting is None else f"meet near {self._at(meeting)}"
            words += " and feed each other: "
        elif group:
            whirl = self._whirl(self.eigenvalues.value, mode.root)
            words = f"{whirl} whirl, " * bool(whirl) + "no other mode meets it: "
        text = f"{words}{balance}."
        place = self.energy.place(number_of_mode)
        if place:
            text += f" Where its energy is: {place}."
        return text

    @property
    def advice(self) -> str:
        """What to change, each way alone enough; or how far a stable brake is from its loss."""
        return " ".join(self.ways)

    @property
    def ways(self) -> list[str]:
        """The sentences of `advice`, one for each way to stop all that grows."""
        spectrum = self.eigenvalues
        count = len(spectrum.unstable)
        if not count:
            return [self._without_growth()]
        # what leaves growth at lower values comes last, then what changes most
        ranked: list[tuple[bool, float, str]] = []
        for cure in (Cure.APART, Cure.BOTH):
            words = self._measure(cure)
            if words:
                ranked.append((self._is_at_value_alone(cure), self._share(cure), words))
        if self.remedy is not None:
            latest = max(self.search.remedies, key=lambda remedy: remedy.limit)
            changes = [self.remedy]
            if latest.limit > BETTER * self.remedy.limit:
                changes.append(latest)
            # a small change stands before separation and damping, a large one behind them
            place = -1.0 if self.remedy.is_small else MOST
            for remedy in changes:
                sentence = remedy.sentence(self._meaning(remedy.change.parameter), spectrum)
                ranked.append((remedy.leaves_window, place, sentence))
        bound = self._bound()
        if bound:
            ranked.append((False, math.inf, bound))
        ranked.sort(key=itemgetter(0, 1))
        measures = list(map(itemgetter(2), ranked))
        if not measures:
            return ["No way out is known to this page."]
        aim = ""
        if count > 1:
            aim = "to stop both" if count == 2 else f"to stop all {count}"
        if self._growth_outside or self._is_of_band_alone():
            aim = f"for {spectrum.extent} alone, {aim}".rstrip(", ")
        if self._growth_outside:
            hertz = number(spectrum.details["fastest_outside"]["frequency_hz"], 4)
            measures[0] += f" It is not meant for {hertz} Hz outside, and may not reach it."
        if aim:
            measures[0] = _capitalised(f"{aim}: {measures[0][0].lower()}{measures[0][1:]}")
        return [measures[0], *(f"Or {way[0].lower()}{way[1:]}" for way in measures[1:])]

    def _meaning(self, parameter: str) -> str:
        """What a parameter is, in brackets; empty where that is not known."""
        if isinstance(self.subject, Scene):
            words = PARAMETERS[parameter].meaning.split(" (")[0]
            return f" ({words})"
        terms = []
        for row in self.energy.contributions:
            file, _, factor = row.term.rpartition(", ")
            if re.search(rf"\b{re.escape(parameter)}\b", factor):
                terms.append(f"{file}, {row.role}" if file else row.role)
        return f" (factor of {' and '.join(dict.fromkeys(terms))})" if terms else ""

    def _without_growth(self) -> str:
        """Where nothing grows, how sure that is, and where stability is lost."""
        spectrum = self.eigenvalues
        is_sure = spectrum.certified and (spectrum.verdict is not None or bool(spectrum.extent))
        words = "Nothing that grows was found"
        if is_sure:
            words = "Nothing grows" if spectrum.verdict == "marginal" else "Stable"
        if spectrum.extent:
            words += f" from {spectrum.extent}"
        if spectrum.depends:
            words += f" at {self._at(spectrum.value)}"
        words = f"{words}. {self.loss}"
        if self._growth_outside:
            words += f" But {self._growth_outside}."
        elif self._is_of_band_alone():
            words += " Nothing outside of the band was looked at."
        return words

    def _is_of_band_alone(self) -> bool:
        """Whether nothing was looked at outside of a band; of small systems all roots are known."""
        if not self.eigenvalues.extent:
            return False
        return not is_small(getattr(self.subject, "system", self.subject))

    def _is_at_value_alone(self, cure: Cure) -> bool:
        """Whether something grows at lower values of the parameter with a cure."""
        return any(cure in meeting.at_value_alone for meeting in self.meetings.values())

    def _share(self, cure: Cure) -> float:
        """The largest share of the upper frequency, or of critical damping, of a cure."""
        return max(meeting.cures[cure] / meeting.unit(cure) for meeting in self.meetings.values())

    def _measure(self, cure: Cure) -> str:
        """How much further apart, or more damped, the real modes behind each growing one must be;
        empty where that is not known to stop all."""
        words: list[str] = []
        for mode in self.eigenvalues.unstable:
            meeting = self._meeting(mode)
            if meeting is None or cure not in meeting.cures:
                return ""
            amount = meeting.cures[cure]
            if not amount:  # the cures of other modes stop this one too
                continue
            pair = self._pair(mode)
            percent = 100.0 * amount / meeting.unit(cure)
            if cure is Cure.APART:
                text = f"{pair} by raising the upper one by {number(amount, 3)} Hz, "
                words.append(f"{text}{number(percent, 2)} % of its frequency")
            else:
                both = "both " * (len(meeting.omega) == 2)
                words.append(f"of {both}{pair} by at least {number(percent, 3)} %")
        more = len(words) - NAMED
        if more > 0:  # the others are summed up
            largest = number(100.0 * self._share(cure), 3)
            words[NAMED:] = [f"those of {_others(more)} by up to {largest} %"]
        if cure is Cure.APART:
            return f"Move further apart {'; '.join(words)}, {self._reach(cure)}."
        words[0] += " of critical damping"
        text = f"Raise the damping {', '.join(words)}, {self._reach(cure)}"
        whirl = self._whirl(self.eigenvalues.value, self.eigenvalues.unstable[0].root)
        text += self._one_is_not_enough(whirl)
        return f"{text}.{STATIONARY * bool(whirl)}"

    def _one_is_not_enough(self, whirl: str) -> str:
        """That as much damping on one mode of each pair is not enough, and how much on one of a
        single pair would be; empty where it may be. whirl: of the fastest mode, or empty."""
        if not all(meeting.needs_both for meeting in self.meetings.values()):
            return ""
        # which modes of the chart meet
        are_pairs = [len(self.paths.group_of(mode)) == 2 for mode in self.meetings]
        one = "one of both"
        if all(are_pairs):
            one = "one mode of a pair"
        elif whirl and not any(are_pairs):
            one = "one plane"
        text = f"; as much on {one} alone is not enough"
        if len(self.meetings) == 1:
            (meeting,) = self.meetings.values()
            side = meeting.alone
            reaches_as_far = self._is_at_value_alone(side) == self._is_at_value_alone(Cure.BOTH)
            if side in meeting.cures and reaches_as_far:
                text += f", which takes {number(100.0 * meeting.cures[side], 3)} %"
        return text

    def _reach(self, cure: Cure) -> str:
        """At which values of the parameter a cure is enough."""
        spectrum = self.eigenvalues
        value = f"{spectrum.parameter} = {number(spectrum.value, 4)}"
        if not spectrum.depends:
            return "just enough"
        if self._is_at_value_alone(cure):
            return f"just enough at {value} alone"
        return f"just enough up to {value}"

    def _bound(self) -> str:
        """Which values of the parameter nothing grows at, of all that was looked at; empty if
        stability is lost later."""
        spectrum = self.eigenvalues
        first = self.thresholds.first
        if self.thresholds.verdict in GROWING or first is None:
            return ""
        if not 0.0 < first.mu < spectrum.value:
            return ""
        limit = first.mu
        scope = []
        if self.outside is not None:
            other = self.outside.first
            of_band = f"{number(first.mu, 4)} for {spectrum.extent}"
            if self.outside.verdict in GROWING:
                scope.append(f"for {spectrum.extent} alone: something outside grows at any")
            elif other is not None and self._is_of_band_alone():
                limit = min(limit, other.mu)
                hertz = number(other.frequency_hz or 0.0, 4)
                scope.append(f"{of_band}, {number(other.mu, 4)} for {hertz} Hz, seen outside")
            elif other is not None and other.mu < first.mu:
                limit = other.mu
                scope.append(f"{of_band} alone")
        if self._is_of_band_alone():
            scope.append(f"nothing else than {spectrum.extent} was searched")
        below = rounded(limit, 4, math.floor)
        words = speed_words(float(below), unit_of(spectrum.source))
        bound = f"{spectrum.parameter} below {below}{words}"
        less = 100.0 * (1.0 - float(below) / spectrum.value)
        if less > NO_WAY:
            return ""
        cost = f"{number(less, 3)} % less than {number(spectrum.value, 4)}"
        if spectrum.parameter == "mu":
            more = 100.0 * (spectrum.value / float(below) - 1.0)
            cost += ": as much less friction force, or "
            cost += f"{number(more, 3)} % more normal force for the same"
        reservation = f" ({', '.join(scope)})" if scope else ""
        return f"Keep {bound}{reservation}, {cost}."

    def _meeting(self, mode: UnstableMode) -> Meeting | None:
        """The two real modes behind a growing one."""
        return self.meetings.get(self.eigenvalues.mode_of(mode) or 0)

    def _real_modes(self, mode: UnstableMode) -> str:
        """The real modes behind a growing one by their frequencies; empty where the chart's modes
        that it meets are these, or where none is known."""
        meeting = self._meeting(mode)
        group = self.paths.group_of(self.eigenvalues.mode_of(mode))
        if meeting is None:
            return ""
        starts = sorted(abs(self.paths.roots[one][0]) for one in group)
        if len(starts) == len(meeting.omega) and np.allclose(starts, meeting.omega, SAME_START):
            return ""
        hertz = dict.fromkeys(number(frequency, 4) for frequency in meeting.hertz)
        modes = "the real mode" if len(meeting.omega) == 1 else "real modes"
        return f"{modes} at {' and '.join(hertz)} Hz"

    def _pair(self, mode: UnstableMode) -> str:
        """The modes behind a growing one by the frequencies of real modes, by their numbers where
        these are modes of the chart; of one that grows alone its name."""
        group = self.paths.group_of(self.eigenvalues.mode_of(mode))
        real = self._real_modes(mode)
        if real:
            return real
        if len(group) == 2:
            return f"{_numbers(group)} ({number(mode.frequency_hz, 4)} Hz)"
        return self._name(mode)

    def _name(self, mode: UnstableMode) -> str:
        """A mode by its number and frequency."""
        hertz = f"{number(mode.frequency_hz, 4)} Hz"
        number_of_mode = self.eigenvalues.mode_of(mode)
        if number_of_mode is None:
            return f"the mode at {hertz}"
        return f"mode {number_of_mode} ({hertz})"

    @property
    def hints(self) -> list[str]:
        """What was tried and does not help, and how to name other parameters."""
        if not self.eigenvalues.unstable:
            return []
        lines = []
        tried = {Cure.APART: "moving their real modes further apart", Cure.BOTH: "damping them"}
        failed = []
        for cure, words in tried.items():
            if self.meetings and not self._measure(cure):
                failed.append(words)
        if failed:
            lines.append(
                f"Not known to stop all modes, up to {100 * MOST:g} %: {' or '.join(failed)}."
            )
        if self.remedy is not None:
            return lines
        idle = [*self.search.without_effect]
        idle += [one.change.parameter for one in self.search.partial if one not in self._partial]
        if idle:
            words = "by up to a factor of 4 takes less than a tenth of the growth"
            lines.append(f"Changing {' or '.join(idle)} {words}.")
        if {*idle, *(one.change.parameter for one in self._partial)} <= OF_CONTACT:
            lines.append(HINT)
        return lines

    @property
    def _partial(self) -> list[Remedy]:
        """Changes of one parameter that stop not all that grows but a good part of it."""
        partial = []
        for remedy in self.search.partial:
            growth = max(mode.growth_rate for mode in remedy.computed.unstable)
            if growth <= WORTH * self.eigenvalues.unstable[0].growth_rate:
                partial.append(remedy)
        return partial

    @property
    def remedies(self) -> Table:
        """Changes of one parameter, the best first: what they cost, what they leave and where
        stability is lost."""
        parameter = self.eigenvalues.parameter

        def growth_left(remedy: Remedy) -> str:
            modes = remedy.computed.unstable
            return f"{number(modes[0].growth_rate, 3)} 1/s at {number(modes[0].frequency_hz, 4)} Hz"

        def next_loss(remedy: Remedy) -> str:
            if remedy.loss is None or remedy.loss.value is None:
                return f"none up to {number(self.thresholds.high, 4)}"
            words = remedy.loss.words(parameter, unit_of(self.thresholds.source))
            return words.removeprefix("up to ").replace(", then", ":")

        def shift(remedy: Remedy) -> str:
            return _cell(remedy.shift_hz(self.eigenvalues))

        def name(remedy: Remedy) -> str:
            return f"{remedy.change.parameter}{self._meaning(remedy.change.parameter)}"

        table = [
            Column("parameter", shown=name),
            Column("change", shown=lambda row: f"{row.advised.verb} by {row.advised.size}"),
            Column("value", shown=lambda row: row.advised.values),
        ]
        damping = Column("damping_left", shown=lambda row: _cell(100.0 * row.damping_left))
        costs = [replace(damping, words="least damping, %")]
        costs.append(Column("shift", shown=shift, words="frequencies move by, Hz"))
        if self.search.remedies:
            just = f"just stops at {parameter} = {number(self.eigenvalues.value, 4)}"
            table.append(Column("least", shown=lambda row: row.change.size, words=just))
            table += [*costs, Column("next_loss", shown=next_loss, words="next loss")]
        else:
            table += [Column("growth_left", shown=growth_left, words="growth left"), *costs]
        title = "changes of one parameter, the best first; degrees count as %"
        return Table(table, self.search.remedies or self._partial, title)

    @property
    def growing(self) -> Table:
        """The modes that grow, with the least separation or damping that stops all."""
        table = self.eigenvalues.growing
        if not self.meetings:
            return table

        def amount(mode: UnstableMode, cure: Cure) -> str:
            meeting = self._meeting(mode)
            if meeting is None or cure not in meeting.cures:
                return "-"
            unit = 1.0 if cure is Cure.APART else 100.0
            text = number(unit * meeting.cures[cure], 3)
            if cure in meeting.at_value_alone:
                return f"({text})"
            return text

        def alone(mode: UnstableMode) -> str:
            meeting = self._meeting(mode)
            if meeting is None or meeting.alone not in meeting.cures:
                return "-"
            hertz = meeting.hertz[meeting.alone is Cure.UPPER]
            return f"{amount(mode, meeting.alone)} at {number(hertz, 4)}"

        def partner(mode: UnstableMode) -> str:
            group = self.paths.group_of(self.eigenvalues.mode_of(mode))
            if len(group) == 2 and self._real_modes(mode):
                return self._real_modes(mode)
            others = [str(one) for one in group if one != self.eigenvalues.mode_of(mode)]
            meeting = self.paths.meeting(group)
            return " near ".join([*others, number(meeting, 3)] if meeting else others) or "-"

        columns = []
        for column in table.columns:
            if column.name == "onset":
                columns.append(Column("meets", shown=partner, words="meets"))
            if column.name in ROUNDED:
                columns.append(replace(column, shown=partial(_in_four, column)))
            elif column.name != "kind":
                columns.append(column)
        columns += [
            Column("apart", shown=lambda mode: amount(mode, Cure.APART), words="apart, Hz"),
            Column("both", shown=lambda mode: amount(mode, Cure.BOTH), words="both, %"),
            Column("alone", shown=alone, words="one, %"),
        ]
        title = "unstable modes, and what stops all: Hz further apart, or % of critical damping "
        title += f"more on both modes or on one; - where up to {100 * MOST:g} % are not known to"
        if any(meeting.at_value_alone for meeting in self.meetings.values()):
            value = f"{self.eigenvalues.parameter} = {number(self.eigenvalues.value, 4)}"
            title += f"; in brackets: at {value} alone"
        return replace(table, columns=columns, title=title)

    def _at(self, value: float) -> str:
        """A value of the parameter, with the unit where it is a speed."""
        end = speed_words(value, unit_of(self.thresholds.source))
        return f"{self.thresholds.parameter} = {number(value, 4)}{end}"

    def _whirl(self, speed: float, root: complex) -> str:
        """The direction of a mode of a rotor at a speed, such as forward; empty where unknown."""
        if self.critical is None:
            return ""
        return self.critical.diagram.direction(speed, root) or ""

    def _lost(self, first: CriticalPoint) -> str:
        """What happens at the first loss: of a rotor the whirl that begins to grow."""
        whirl = self._whirl(first.mu, complex(0.0, math.tau * (first.frequency_hz or 0.0)))
        return f"{whirl} whirl begins to grow" if whirl else first.kind

    @property
    def loss(self) -> str:
        """The first loss of stability, and how far the present value is from it."""
        first = self.thresholds.first
        value = self.eigenvalues.value
        where = " within the band" if self.eigenvalues.extent else ""
        if self.thresholds.verdict in GROWING:  # at the lower end
            return f"Unstable from {self._at(self.thresholds.low)} on."
        if first is None:
            return f"No loss of stability{where} up to {self._at(self.thresholds.high)}."
        line = f"Stability is first lost{where} at {self._at(first.mu)}: {self._lost(first)}"
        if first.frequency_hz:
            line += f" at {number(first.frequency_hz, 4)} Hz"
        if first.mu <= 0.0 or value <= 0.0:  # shares of these say nothing
            return f"{line}."
        if math.isclose(value, first.mu, rel_tol=1e-9):
            return f"{line}, which is the present value."
        if value >= TIMES * first.mu:
            return f"{line}; {self._at(value)} is {number(value / first.mu, 2)} times that."
        percent = 100.0 * (value / first.mu - 1.0)
        above_or_below = "above" if percent > 0.0 else "below"
        return f"{line}; {self._at(value)} lies {number(abs(percent), 3)} % {above_or_below} that."

    def table(self) -> Table:
        """The modes that grow.

        Examples
        --------
        >>> import squeal
        >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}  # flutter from mu = 3/4 on
        >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"mu": 1.0}, name="pair")
        >>> [row["kind"] for row in squeal.report(pair).table().records()]
        ['flutter']
        """
        return self.eigenvalues.growing

    def parts(self) -> Sequence[str | Table]:
        opening = [f"{label}: {text}" for label, text in self.opening.items()]
        seats = self.thresholds.seat
        lines = [*opening, *self.ways[1:], *self.hints, *seats]
        parts: list[str | Table] = [self.name, "\n".join(lines), self.growing]
        if self.remedies.rows:
            parts.append(self.remedies)
        if self.critical is not None:
            parts.append(self.critical.table())
        return parts

    def to_dict(self) -> dict[str, Any]:
        remedies = [_remedy_entry(remedy) for remedy in self.search.remedies]
        meetings = []
        for mode, meeting in self.meetings.items():
            entry: dict[str, Any] = {"mode": mode, "frequencies_hz": list(meeting.hertz)}
            entry["at_value_alone"] = []
            for cure in Cure:
                entry[cure.name.lower()] = meeting.cures.get(cure)
                if cure in meeting.at_value_alone:
                    entry["at_value_alone"].append(cure.name.lower())
            meetings.append(entry)
        return {
            "name": self.name,
            "verdict_line": self.eigenvalues.conclusion,
            "loss_line": self.loss,
            "advice": self.advice,
            "remedy": next(iter(remedies), None),
            "remedies": remedies,
            "meetings": meetings,
            **self.energy.to_dict(),
            "eigenvalues": self.eigenvalues.to_dict(),
            "thresholds": self.thresholds.to_dict(),
            **self.sensitivity.to_dict(),
            "onset_sensitivity": self.onset and self.onset.to_dict()["sensitivity"],
            "check": self.check and self.check.to_dict(),
            "critical_speeds": self.critical and self.critical.table().records(),
        }


def _in_four(column: Column, row: object) -> str:
    """A cell of a column of numbers in four digits."""
    value = column.of(row)
    return "-" if value is None else number(100.0 * value if column.percent else value, 4)


def _others(count: int) -> str:
    """So many others, in words."""
    return "1 other" if count == 1 else f"{count} others"


def _capitalised(text: str) -> str:
    """A text that begins with a capital."""
    return text[:1].upper() + text[1:]


def _numbers(group: Sequence[int]) -> str:
    """Two modes by their numbers."""
    lower, upper = sorted(group)
    return f"modes {lower} and {upper}"


def _cell(value: float) -> str:
    """A number in a cell, a dash for NaN."""
    return "-" if math.isnan(value) else number(value, 3)


def _remedy_entry(remedy: Remedy) -> dict[str, Any]:
    """A remedy as JSON holds it."""
    entry: dict[str, Any] = picked(remedy.change, "parameter before after")
    entry["with_margin"] = remedy.take and remedy.take.after
    entry["verdict_line"] = remedy.computed.conclusion
    entry["first_loss"] = remedy.loss and remedy.loss._asdict()
    return entry
