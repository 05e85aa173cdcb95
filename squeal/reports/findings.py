"""What a report found of a brake, in sentences: what to change, what grows, and why."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
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
from squeal.queries.remedies import (
    BETTER,
    Change,
    Remedy,
    RemedySearch,
    partner_of,
    rounded,
)
from squeal.queries.systems.all_roots import is_small
from squeal.queries.whirl import BACKWARD, FORWARD
from squeal.results.eigenvalues import Eigenvalues
from squeal.results.sensitivity import Sensitivity
from squeal.results.sources import unit_of
from squeal.results.thresholds import Thresholds

NAMED = 3  # modes or parameters in a sentence
MOST_SPEEDS = 6  # critical speeds in a sentence
CAUSES = 6  # growing modes whose cause is told
TIMES = 3.0  # from which on a value is so many times another one, not so many % above it
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
    subject: the scene or system; critical: critical speeds where the parameter is that of a shaft.
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
    subject: Any = field(repr=False)
    critical: CriticalSpeeds | None = None

    @property
    def warnings(self) -> tuple[str, ...]:  # type: ignore[override]
        """What each answer warns of, once."""
        return tuple(dict.fromkeys((*self.eigenvalues.warnings, *self.thresholds.warnings)))

    @property
    def verdict(self) -> str:
        """The verdict in a line."""
        return "; ".join(filter(None, [self.eigenvalues.conclusion, self._growth_outside]))

    @property
    def _growth_outside(self) -> str:
        """What grows outside of the band, in words; empty if nothing is known to."""
        fastest = self.eigenvalues.details.get("fastest_outside")
        if not fastest:
            return ""
        hertz = number(fastest["frequency_hz"], 4)
        rate = number(fastest["growth_rate"], 4)
        if self._is_of_band_alone():  # what a search met on its way; others may grow faster
            return f"outside of it, not searched, {hertz} Hz was seen to grow by {rate} 1/s"
        return f"outside of it {hertz} Hz grows by {rate} 1/s"

    @property
    def remedy(self) -> Remedy | None:
        """The best change of one parameter with which nothing grows, None if none is known."""
        return next(iter(self.search.remedies), None)

    @property
    def advice(self) -> str:
        """What to change, each way alone enough; or how far a stable brake is from its loss."""
        return " ".join(self.ways)

    @property
    def ways(self) -> list[str]:
        """The sentences of `advice`, one for each way to stop all that grows."""
        spectrum = self.eigenvalues
        if not spectrum.unstable:
            return [self._without_growth()]
        measures = [words for _, words in sorted([self._separation(), self._more_damping()])]
        if self.remedy is not None:
            sentence = self.remedy.sentence(self._meaning(self.remedy.change.parameter))
            sentence += self._latest_loss(self.remedy)
            measures.insert(0 if self.remedy.is_small else len(measures), sentence)
        measures.append(self._bound())
        measures = list(filter(None, measures))
        if not measures:
            return ["No way out is known to this page."]
        aim = ""
        count = len(spectrum.unstable)
        if count > 1:
            aim = "to stop both" if count == 2 else f"to stop all {count}"
        if self._growth_outside or self._is_of_band_alone():
            aim = f"for {spectrum.extent} alone, {aim}".rstrip(", ")
            if self._growth_outside:
                aim += f" ({self._growth_outside})"
        first = measures[0]
        if aim:
            first = f"{aim[0].upper()}{aim[1:]}: {first[0].lower()}{first[1:]}"
        ways = [first]
        for measure in measures[1:]:
            ways.append(f"Or {measure[0].lower()}{measure[1:]}")
        return ways

    def _latest_loss(self, first: Remedy) -> str:
        """The remedy with which stability is lost latest, as a sentence; empty if that is hardly
        later than with the first one."""
        latest = max(self.search.remedies, key=lambda remedy: remedy.limit)
        if latest.loss is None or latest.limit <= BETTER * first.limit:
            return ""
        change = latest.advised
        text = (
            f" Stability is lost latest if you {change.verb} {change.parameter} by {change.size}, "
        )
        words = latest.loss.words(self.eigenvalues.parameter)
        text += f"{change.values}: nothing grows {words}."
        return f"{text} With less than {latest.change.size} of it something grows."

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
        words += self._distance_to_loss()
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

    def _distance_to_loss(self) -> str:
        """The end of a sentence on a brake of which nothing grows: where stability is lost."""
        first = self.thresholds.first
        value = self.eigenvalues.value
        if self.thresholds.verdict in GROWING:
            return f"; unstable at {self._at(self.thresholds.low)}."
        if first is None:
            return f"; no loss of stability up to {self._at(self.thresholds.high)}."
        hertz = f", {number(first.frequency_hz, 4)} Hz" if first.frequency_hz else ""
        loss = f"({number(first.mu, 4)}{hertz})"
        if value >= first.mu:
            return f", beyond a range without stability that begins at {loss[1:-1]}."
        if value <= 0.0:
            hertz = f" at {number(first.frequency_hz, 4)} Hz" if first.frequency_hz else ""
            return f"; unstable above {self._at(first.mu)}: {self._lost(first)}{hertz}."
        percent = number(100.0 * (1.0 - value / first.mu), 3)
        return f", {percent} % below the first loss {loss}."

    def _separation(self) -> tuple[float, str]:
        """How much further apart the two modes behind each growing one must be, as the largest
        share of a frequency and in words; empty words where that does not stop all."""
        words: list[str] = []
        shares = [0.0]
        for mode in self.eigenvalues.unstable:
            meeting = self.meetings.get(self.eigenvalues.mode_of(mode) or 0)
            if meeting is None or Cure.APART not in meeting.cures:
                return 0.0, ""
            lower, upper = meeting.hertz
            apart = meeting.cures[Cure.APART]
            shares.append(apart / upper)
            by = f"{number(apart, 2)} Hz ({number(upper - lower, 3)} Hz as real modes)"
            words.append(f"{self._pair(mode)} by {by}")
        return max(shares), f"Move further apart {', '.join(words[:NAMED])}{self._more_modes()}."

    def _more_damping(self) -> tuple[float, str]:
        """The damping that stops all modes that grow, as the largest share of critical damping and
        in words; empty words if one of them does not oscillate."""
        spectrum = self.eigenvalues
        if not all(mode.frequency_hz for mode in spectrum.unstable):
            return 0.0, ""
        words = []
        shares = []
        alone_needs_more = bool(self.meetings)
        for mode in spectrum.unstable:
            share = float(rounded(-100.0 * mode.damping_ratio, 2, math.ceil)) / 100.0
            name = self._name(mode)
            meeting = self.meetings.get(self.eigenvalues.mode_of(mode) or 0)
            if meeting is not None:
                if Cure.BOTH not in meeting.cures:
                    return 0.0, ""
                share = meeting.cures[Cure.BOTH]
                name = f"both {self._pair(mode)}"
                alone_needs_more &= meeting.needs(meeting.alone) > share
            shares.append(share)
            words.append(f"{name} at least {number(100.0 * share, 2)} %")
        words[0] += " of critical damping more"
        text = f"Give {', '.join(words[:NAMED])}{self._more_modes()}"
        if alone_needs_more:
            text += "; as much on one mode of a pair alone is not enough"
        return max(shares), f"{text}."

    def _more_modes(self) -> str:
        """The end of a list of `NAMED` growing modes."""
        more = len(self.eigenvalues.unstable) - NAMED
        return f", and {more} more modes what the table lists" if more > 0 else ""

    def _bound(self) -> str:
        """Which values of the parameter nothing grows at, of all that was looked at; empty if
        stability is lost later."""
        spectrum = self.eigenvalues
        first = self.thresholds.first
        if first is None or first.mu >= spectrum.value or self.thresholds.verdict in GROWING:
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
        reservation = f" ({', '.join(scope)})" if scope else ""
        return f"Keep {bound}; it is {number(spectrum.value, 4)}{reservation}."

    def _pair(self, mode: UnstableMode) -> str:
        """The two modes behind a growing one by their numbers, else by their frequencies."""
        partner = self._partner(mode)
        if partner is not None:
            numbers = sorted([partner, self.eigenvalues.mode_of(mode) or 0])
            return f"modes {numbers[0]} and {numbers[1]} ({number(mode.frequency_hz, 4)} Hz)"
        frequencies = self.meetings[self.eigenvalues.mode_of(mode) or 0].hertz
        hertz = dict.fromkeys(number(frequency, 4) for frequency in frequencies)
        return f"real modes at {' and '.join(hertz)} Hz"

    def _name(self, mode: UnstableMode) -> str:
        """A mode by its number and frequency."""
        hertz = f"{number(mode.frequency_hz, 4)} Hz"
        number_of_mode = self.eigenvalues.mode_of(mode)
        if number_of_mode is None:
            return f"the mode at {hertz}"
        return f"mode {number_of_mode} ({hertz})"

    def _partner(self, mode: UnstableMode) -> int | None:
        """The mode with which a growing one has met; None of a whirl beside one that turns against
        it, which may have one frequency without feeding each other."""
        spectrum = self.eigenvalues
        partner = partner_of(spectrum, mode)
        for other, root in spectrum.of_modes:
            if other == partner:
                whirls = {self._whirl(spectrum.value, one) for one in (mode.root, root.value)}
                if whirls == {FORWARD, BACKWARD}:
                    return None
        return partner

    def _cause(self, mode: UnstableMode) -> str:
        """Why a mode grows: which modes couple, from where on, and which terms feed it."""
        number_of_mode = self.eigenvalues.mode_of(mode)
        head, _, balance = self.energy.sentence(number_of_mode or 0).partition(": ")
        words = []
        meeting = self.meetings.get(self.eigenvalues.mode_of(mode) or 0)
        if meeting is not None and self._partner(mode) is not None:
            lower, upper = meeting.hertz
            pair = self._pair(mode).partition(" (")[0]
            text = f"{pair} ({number(lower, 4)} and {number(upper, 4)} Hz without friction) come "
            text += "together and feed each other"
            if mode.onset is not None:
                text += f" from {self._at(mode.onset)} on"
            words.append(text)
        elif whirl := self._whirl(self.eigenvalues.value, mode.root):
            words.append(f"{whirl} whirl, which no other mode meets")
        words.append(balance)
        text = f"{head}: {'; '.join(words)}."
        place = self.energy.place(number_of_mode or 0)
        if place:
            text += f" Where its energy is: {place}."
        return text[0].upper() + text[1:]

    @property
    def reasons(self) -> list[str]:
        """What feeds each mode that grows, a line each, and which parameters do not help."""
        unstable = self.eigenvalues.unstable
        if not unstable:
            return []
        lines = []
        for mode in unstable[:CAUSES]:
            if self.eigenvalues.mode_of(mode) in self.energy.modes:
                lines.append(self._cause(mode))
        if len(unstable) > CAUSES:
            lines.append(f"{len(unstable) - CAUSES} more modes grow.")
        if self.remedy is None:
            idle = self.search.without_effect
            if idle:
                words = f"Changing {' or '.join(idle)} by up to {self.search.limit}"
                lines.append(f"{words} does not help.")
            named = {*idle, *(part.change.parameter for part in self.search.partial)}
            if named <= OF_CONTACT:
                lines.append(HINT)
        return lines

    @property
    def remedies(self) -> Table:
        """Changes of one parameter, the best first: what they leave and where stability is lost."""
        parameter = self.eigenvalues.parameter

        def growth_left(remedy: Remedy) -> str:
            modes = remedy.computed.unstable
            if not modes:
                return "none"
            return f"{number(modes[0].growth_rate, 3)} 1/s at {number(modes[0].frequency_hz, 4)} Hz"

        def next_loss(remedy: Remedy) -> str:
            if remedy.loss is None:
                return "-"
            if remedy.loss.value is None:
                return f"none up to {number(remedy.loss.high, 4)}"
            return remedy.loss.words(parameter).removeprefix("up to ").replace(", then", ":")

        def damping_left(remedy: Remedy) -> str:
            ratios = [root.damping_ratio for _, root in remedy.computed.of_modes if root.value.imag]
            return number(100.0 * min(ratios), 2) if ratios else "-"

        def size(change: Change) -> str:
            return f"{change.verb} by {change.size}"

        def least(remedy: Remedy) -> str:
            return "-" if remedy.computed.unstable else remedy.change.size

        def name(remedy: Remedy) -> str:
            return f"{remedy.change.parameter}{self._meaning(remedy.change.parameter)}"

        table = (
            Column("parameter", shown=name),
            Column("change", shown=lambda row: size(row.advised)),
            Column("value", shown=lambda row: row.advised.values),
            Column("least", shown=least, words="just stops"),
            Column("growth_left", shown=growth_left, words="growth left"),
            Column("damping_left", shown=damping_left, words="least damping, %"),
            Column("next_loss", shown=next_loss, words="next loss"),
        )
        title = "changes of one parameter, the best first; degrees count as %"
        return Table(table, [*self.search.remedies, *self.search.partial], title)

    @property
    def growing(self) -> Table:
        """The modes that grow, with the least separation or damping that stops each."""
        table = self.eigenvalues.growing
        if not self.meetings:
            return table

        def meeting_of(mode: UnstableMode) -> Meeting | None:
            return self.meetings.get(self.eigenvalues.mode_of(mode) or 0)

        def amount(mode: UnstableMode, cure: Cure) -> str:
            meeting = meeting_of(mode)
            if meeting is None or cure not in meeting.cures:
                return "-"
            unit = 1.0 if cure is Cure.APART else 100.0
            return number(unit * meeting.cures[cure], 2)

        def alone(mode: UnstableMode) -> str:
            meeting = meeting_of(mode)
            if meeting is None or meeting.alone not in meeting.cures:
                return "-"
            hertz = meeting.hertz[meeting.alone is Cure.UPPER]
            return f"{amount(mode, meeting.alone)} at {number(hertz, 4)}"

        columns = [column for column in table.columns if column.name != "kind"]
        columns += [
            Column("apart", shown=lambda mode: amount(mode, Cure.APART), words="apart, Hz"),
            Column("both", shown=lambda mode: amount(mode, Cure.BOTH), words="both, %"),
            Column("alone", shown=alone, words="one, %"),
        ]
        title = "unstable modes, and what stops each: Hz further apart, or % of critical "
        title += "damping more on both modes or on one"
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
    def critical_line(self) -> str:
        """The lowest critical speeds of a rotor in a sentence; empty if the subject is no rotor."""
        if self.critical is None:
            return ""
        speeds = []
        for one in self.critical.critical[:MOST_SPEEDS]:
            words = f"{number(one.speed, 4)}{speed_words(one.speed, 'rad/s')}"
            speeds.append(f"{words} {one.direction or ''}".rstrip())
        more = len(self.critical.critical) - MOST_SPEEDS
        if more > 0:
            speeds.append(f"{more} more")
        end = self._at(self.critical.high)
        return f"Critical speeds up to {end}: {', '.join(speeds) or 'none'}."

    @property
    def loss(self) -> str:
        """The first loss of stability in a line."""
        first = self.thresholds.first
        where = " within the band" if self.eigenvalues.extent else ""
        if self.thresholds.verdict in GROWING:
            return f"Unstable from {self._at(self.thresholds.low)} on"
        if first is None:
            return f"No loss of stability{where} up to {self._at(self.thresholds.high)}"
        line = f"Stability is first lost{where} at {self._at(first.mu)}: {self._lost(first)}"
        if first.frequency_hz:
            line += f" at {number(first.frequency_hz, 4)} Hz"
        return line

    @property
    def margin(self) -> str:
        """How far the brake is from its first loss, in words; empty where none is known."""
        first = self.thresholds.first
        value = self.eigenvalues.value
        if first is None or first.mu <= 0.0 or value == 0.0:
            return ""
        own_value = self._at(value)
        if value >= TIMES * first.mu:
            return f"{own_value} is {number(value / first.mu, 2)} times that."
        percent = 100.0 * (value / first.mu - 1.0)
        above_or_below = "above" if percent > 0.0 else "below"
        return f"{own_value} lies {number(abs(percent), 3)} % {above_or_below} that."

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
        lines = [self.verdict, self.loss, self.margin, self.critical_line]
        advice = "\n".join([self.advice, *self.reasons, *self.thresholds.seat])
        parts: list[str | Table] = [self.name, "\n".join(filter(None, lines)), self.growing, advice]
        if self.remedies.rows:
            parts.append(self.remedies)
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
            "verdict_line": self.verdict,
            "loss_line": self.loss,
            "margin_line": self.margin,
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


def _remedy_entry(remedy: Remedy) -> dict[str, Any]:
    """A remedy as JSON holds it."""
    entry: dict[str, Any] = picked(remedy.change, "parameter before after")
    entry["with_margin"] = remedy.take and remedy.take.after
    entry["verdict_line"] = remedy.computed.conclusion
    entry["first_loss"] = remedy.loss and remedy.loss._asdict()
    return entry
