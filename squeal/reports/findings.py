"""What a report found of a brake, in sentences: what grows, why, and what to change."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

from squeal.io.scene import Scene
from squeal.io.writing import Answer, Column, Panel, Table, number, picked
from squeal.linear import GROWING, CriticalPoint, UnstableMode
from squeal.linear.shaft import speed_words
from squeal.model.pad import PARAMETERS
from squeal.queries.check import Check
from squeal.queries.critical_speeds import CriticalSpeeds
from squeal.queries.energy import Energy
from squeal.queries.meetings import Cure, Meeting
from squeal.queries.mode_paths import Paths, is_growing
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
        words = ""
        if len(group) == 2:
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
        measures = [words for _, words in sorted(map(self._measure, (Cure.APART, Cure.BOTH)))]
        if self.remedy is not None:
            latest = max(self.search.remedies, key=lambda remedy: remedy.limit)
            changes = [self.remedy]
            if latest.limit > BETTER * self.remedy.limit:
                changes.append(latest)
            place = 0 if self.remedy.is_small else len(measures)
            for remedy in reversed(changes):
                meaning = self._meaning(remedy.change.parameter)
                measures.insert(place, remedy.sentence(meaning, spectrum))
        measures = list(filter(None, [*measures, self._bound()]))
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

    def _measure(self, cure: Cure) -> tuple[float, str]:
        """How much further apart, or more damped, the two modes behind each growing one must be, as
        the largest share and in words; empty words where that does not stop all."""
        words: list[str] = []
        shares = []
        alone_needs_more = cure is Cure.BOTH and bool(self.meetings)
        for mode in self.eigenvalues.unstable:
            meeting = self._meeting(mode)
            pair = self._pair(mode)
            if meeting is None:
                if cure is Cure.APART or not mode.frequency_hz:
                    return 0.0, ""
                share = float(rounded(100.0 * self._deepest(mode), 2, math.ceil)) / 100.0
                words.append(f"of {pair} by at least {number(100.0 * share, 3)} %")
            elif cure not in meeting.cures:
                return 0.0, ""
            elif cure is Cure.BOTH:
                share = meeting.cures[cure]
                alone_needs_more &= meeting.needs(meeting.alone) > share
                words.append(f"of both {pair} by at least {number(100.0 * share, 3)} %")
            else:
                share = meeting.cures[cure] / meeting.hertz[1]
                text = f"{pair} by {number(meeting.cures[cure], 3)} Hz, "
                words.append(f"{text}{number(100.0 * share, 2)} % of the upper frequency")
            shares.append(share)
        largest = max(shares)
        more = len(words) - NAMED
        if more > 0:
            words[NAMED:] = [f"those of {_others(more)} by up to {number(100.0 * largest, 3)} %"]
        if cure is Cure.APART:
            return largest, f"Move further apart {'; '.join(words)}, {self._reach}."
        words[0] += " of critical damping"
        text = f"Raise the damping {', '.join(words)}, {self._reach}"
        whirl = self._whirl(self.eigenvalues.value, self.eigenvalues.unstable[0].root)
        if alone_needs_more:
            groups = [self.paths.group_of(mode) for mode in self.meetings]
            one = "one of both"
            if all(len(group) == 2 for group in groups):
                one = "one mode of a pair"
            elif whirl and not any(len(group) == 2 for group in groups):
                one = "one plane"
            text += f"; as much on {one} alone is not enough"
            needed = [meeting.needs(meeting.alone) for meeting in self.meetings.values()]
            if len(needed) == 1 and needed[0] < math.inf:
                text += f", which takes {number(100.0 * needed[0], 3)} %"
        return largest, f"{text}.{STATIONARY * bool(whirl)}"

    def _deepest(self, mode: UnstableMode) -> float:
        """The largest growth over |lambda| of a mode on its path up to the present value."""
        ratios = [-mode.damping_ratio]
        path = self.eigenvalues.mode_of(mode)
        if path in self.paths.at:
            roots = self.paths.roots[path][self.paths.at[path] <= self.eigenvalues.value]
            ratios += (roots.real / abs(roots)).tolist()
        return max(ratios)

    @property
    def _reach(self) -> str:
        """At which values separation and damping are enough: up to the present one, if no mode
        grows below that does not grow there."""
        spectrum = self.eigenvalues
        known: set[int] = set()
        is_known = self.paths.own_value == spectrum.value
        for mode in spectrum.unstable:
            group = self.paths.group_of(spectrum.mode_of(mode))
            is_known &= bool(group)
            known.update(group)
        for number_of_mode in self.paths.growing:
            roots = self.paths.roots[number_of_mode]
            below = self.paths.at[number_of_mode] < spectrum.value
            is_known &= number_of_mode in known or not is_growing(roots[below]).any()
        value = f"{spectrum.parameter} = {number(spectrum.value, 4)}"
        if not spectrum.depends:
            return "just enough"
        return f"just enough up to {value}" if is_known else f"just enough at {value} alone"

    def _bound(self) -> str:
        """Which values of the parameter nothing grows at, of all that was looked at; empty if
        stability is lost later."""
        spectrum = self.eigenvalues
        first = self.thresholds.first
        if (
            first is None
            or not 0.0 < first.mu < spectrum.value
            or self.thresholds.verdict in GROWING
        ):
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

    def _pair(self, mode: UnstableMode) -> str:
        """The two modes behind a growing one by their numbers, else by the frequencies of its real
        modes; of one that grows alone its name."""
        group = self.paths.group_of(self.eigenvalues.mode_of(mode))
        if len(group) == 2:
            return f"{_numbers(group)} ({number(mode.frequency_hz, 4)} Hz)"
        meeting = self._meeting(mode)
        if meeting is None:
            return self._name(mode)
        hertz = dict.fromkeys(number(frequency, 4) for frequency in meeting.hertz)
        return f"real modes at {' and '.join(hertz)} Hz"

    def _name(self, mode: UnstableMode) -> str:
        """A mode by its number and frequency."""
        hertz = f"{number(mode.frequency_hz, 4)} Hz"
        number_of_mode = self.eigenvalues.mode_of(mode)
        if number_of_mode is None:
            return f"the mode at {hertz}"
        return f"mode {number_of_mode} ({hertz})"

    @property
    def hints(self) -> list[str]:
        """Which parameters do not help where none does, and how to name others."""
        if not self.eigenvalues.unstable or self.remedy is not None:
            return []
        lines = []
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
            table.append(Column("least", shown=lambda row: row.change.size, words="just stops"))
            table += [*costs, Column("next_loss", shown=next_loss, words="next loss")]
        else:
            table += [Column("growth_left", shown=growth_left, words="growth left"), *costs]
        title = "changes of one parameter, the smallest with 10 % in hand first; degrees count as %"
        return Table(table, self.search.remedies or self._partial, title)

    @property
    def growing(self) -> Table:
        """The modes that grow, with the least separation or damping that stops each."""
        table = self.eigenvalues.growing
        if not self.meetings:
            return table

        def amount(mode: UnstableMode, cure: Cure) -> str:
            meeting = self._meeting(mode)
            if meeting is None or cure not in meeting.cures:
                return "-"
            unit = 1.0 if cure is Cure.APART else 100.0
            return number(unit * meeting.cures[cure], 3)

        def alone(mode: UnstableMode) -> str:
            meeting = self._meeting(mode)
            if meeting is None or meeting.alone not in meeting.cures:
                return "-"
            hertz = meeting.hertz[meeting.alone is Cure.UPPER]
            return f"{amount(mode, meeting.alone)} at {number(hertz, 4)}"

        def partner(mode: UnstableMode) -> str:
            group = self.paths.group_of(self.eigenvalues.mode_of(mode))
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
        title = "unstable modes, and what stops each: Hz further apart, or % of critical "
        title += "damping more on both modes or on one; - where up to 25 % do not"
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
            for cure in Cure:
                entry[cure.name.lower()] = meeting.cures.get(cure)
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
