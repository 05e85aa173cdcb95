"""One page about a brake: what to change, what grows and since when, what feeds it, how sure it is.

The page is one HTML file that needs no other, for a screen or for two sheets of paper. It is made
from the template `squeal/templates/report.html`, which escapes every text.
"""

from __future__ import annotations

import math
import re
from base64 import b64encode
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from operator import itemgetter
from pathlib import Path
from typing import Any

from squeal import __version__
from squeal.errors import ComputationError, InputError
from squeal.io.provenance import provenance
from squeal.io.scene import Scene
from squeal.io.writing import Answer, Column, Panel, Table, number, picked, write_text
from squeal.linear import GROWING, CriticalPoint, UnstableMode
from squeal.linear.shaft import speed_words
from squeal.model.pad import PARAMETERS
from squeal.queries.check import Check, check
from squeal.queries.critical_speeds import CriticalSpeeds, critical_speeds
from squeal.queries.eigenvalues import eigenvalues
from squeal.queries.energy import Energy, energy
from squeal.queries.meetings import Cure, Meeting, find_meetings
from squeal.queries.options import Subject, upper_end
from squeal.queries.remedies import (
    BETTER,
    Change,
    Remedy,
    RemedySearch,
    find_remedies,
    partner_of,
    rounded,
)
from squeal.queries.sensitivity import sensitivity
from squeal.queries.sweep import eigenvalue_paths
from squeal.queries.systems.all_roots import is_small
from squeal.queries.thresholds import thresholds
from squeal.queries.whirl import BACKWARD, FORWARD
from squeal.results.columns import basis_text
from squeal.results.eigenvalues import Eigenvalues
from squeal.results.sensitivity import Sensitivity
from squeal.results.sources import SystemSource, unit_of
from squeal.results.sweep import Sweep
from squeal.results.thresholds import Thresholds
from squeal.schema import Positive, public

COLUMNS = 3  # modes in the table of terms
NAMED = 3  # modes or parameters in a sentence
MOST_SPEEDS = 6  # critical speeds in a sentence
CAUSES = 6  # growing modes whose cause is told
BESIDE = 0.03  # of its frequency: how far a mode outside of a band is followed to its onset
TIMES = 3.0  # from which on a value is so many times another one, not so many % above it
NOISE = 1e-3  # of the strongest effect: weaker ones are noise to a reader, and left out
OF_CONTACT = {"contact", "tangential"}  # parameters of an exported or joined brake
HINT = (
    "To see what a part can do, name its stiffness or a shim as a parameter in the system file: "
    "docs/page.md shows how."
)
CHART = 1.5  # the chart's range over the parameter's own value
DRAWN_NODES = 10  # fewer make no picture of a shape
VISIBLE = 1e-12  # of a mode's angular frequency: smaller growth rates of terms are rounding
CONFIDENCE = {
    "proved": "Proved by a second program, which shares no code with the first: no mode is missing "
    "from the list",
    "counted": "Counted in a second way, not proved: no mode is missing from the list",
    "open": "A mode may be missing from the list: nothing has counted them",
}


@dataclass(frozen=True, eq=False, repr=False)
class Report(Answer):
    """What one page says of a brake; `save` writes the page.

    eigenvalues: at the brake's own parameter; thresholds: up to `thresholds.high`; sensitivity: of
    the eigenvalues; onset: sensitivity of the first loss of stability, None where several modes are
    lost at once; check: what the matrices are, None of a scene; energy: what feeds each mode;
    search: the changes that stop all modes that grow; meetings: the two real modes behind each of
    these, by its number; outside: thresholds of what grows outside of a band, where that is known;
    subject: the scene or system; critical: critical speeds where the parameter is that of a shaft.

    Examples
    --------
    >>> import squeal
    >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}  # flutter from mu = 3/4 on
    >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"mu": 1.0}, name="pair")
    >>> report = squeal.report(pair)
    >>> round(report.thresholds.first.mu, 9)
    0.75
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
                share = meeting.cures.get(Cure.BOTH, share)
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
        if self.energy.part_shares:
            text += f" Where its energy is: {self.energy.place(number_of_mode or 0)}."
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
        """The critical speeds of a rotor in a sentence; empty of what is none."""
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

    def save(self, path: Path | str, inputs: Sequence[Any] = (), **drawn: Any) -> None:
        """Write the page as one HTML file (.html) without references to others; `inputs` are the
        files behind it. With another name the modes that grow, as other answers do. Raises
        InputError.

        Examples
        --------
        >>> import squeal
        >>> from pathlib import Path
        >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}  # flutter from mu = 3/4 on
        >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"mu": 1.0}, name="pair")
        >>> squeal.report(pair).save("pair.html")
        >>> Path("pair.html").read_text()[:15]
        '<!doctype html>'
        """
        path = Path(path)
        if path.suffix == ".html":
            write_text(path, page(self, inputs))
        else:
            super().save(path, **drawn)


@public
def report(
    subject: Subject,
    high: float | None = None,
    band: tuple[float, float] | None = None,
    memory: Positive | None = None,
    progress: Callable[[str], None] | None = None,
    parts: Mapping[str, Sequence[int]] | None = None,
) -> Report:
    """Compute all that one page shows of a brake.

    Parameters
    ----------
    subject : Scene, SystemFile or TermSystem
        A system of more than 400 rows needs a band.
    high : float, optional
        Upper end of the range of the friction or of the free parameter, as `thresholds` takes it.
    band : (float, float), optional
        Lowest and highest frequency in Hz, of systems.
    memory, progress
        As `eigenvalues` takes them.
    parts
        As `energy` takes them.

    Returns
    -------
    Report
        Verdict, thresholds and sensitivities; ``save("brake.html")`` writes the page.

    Raises
    ------
    InputError
        For what does not fit the subject.
    ComputationError
        If no steady sliding exists, or the system does not fit into the memory.

    Examples
    --------
    >>> import squeal
    >>> K = {"1": [[2, -1], [-1, 2]], "mu": [[0, 4 / 3], [0, 0]]}
    >>> pair = squeal.System([[1, 0], [0, 1]], K=K, parameters={"mu": 1.0})
    >>> squeal.report(pair).loss
    'Stability is first lost at mu = 0.75: flutter at 0.2251 Hz'
    """
    options: Any = {"band": band, "memory": memory, "progress": progress}
    end = upper_end(subject, high)
    losses = thresholds(subject, end, **options)  # first: it refuses some that the others take
    spectrum = eigenvalues(subject, **options)
    of_modes = sensitivity(subject, known=spectrum)
    of_onset = None
    with suppress(ComputationError):  # several modes are lost at once
        of_onset = sensitivity(subject, of="threshold", known=losses)
    return Report(
        name=spectrum.name,
        eigenvalues=spectrum.with_onsets(losses),
        thresholds=losses,
        sensitivity=of_modes,
        onset=of_onset,
        check=None if isinstance(subject, Scene) else check(subject),
        energy=energy(spectrum, parts),
        search=find_remedies(spectrum, of_modes, end, options),
        meetings=find_meetings(spectrum, options),
        outside=_thresholds_outside(subject, spectrum, end, options),
        subject=subject,
        critical=_critical_speeds(subject, losses, band, memory),
    )


def _critical_speeds(
    subject: Subject, losses: Thresholds, band: tuple[float, float] | None, memory: Positive | None
) -> CriticalSpeeds | None:
    """The critical speeds in the range of the thresholds; None where the parameter is no speed of a
    shaft, and of complex matrices."""
    if unit_of(losses.source):
        with suppress(InputError):
            return critical_speeds(subject, losses.high, losses.low, band=band, memory=memory)
    return None


def _thresholds_outside(
    subject: Subject, spectrum: Eigenvalues, high: float, options: Mapping[str, Any]
) -> Thresholds | None:
    """Thresholds without a band where all roots are computed, else of the fastest mode that was
    seen outside of the band; None without a band, or where nothing was seen."""
    source = spectrum.source
    if not isinstance(source, SystemSource) or not spectrum.extent or not spectrum.unstable:
        return None
    if is_small(source.file.system):
        return thresholds(subject, high, prove=False)
    fastest = spectrum.details.get("fastest_outside")
    if not fastest:
        return None
    hertz = fastest["frequency_hz"]
    beside = {"band": ((1.0 - BESIDE) * hertz, (1.0 + BESIDE) * hertz)}
    return thresholds(subject, high, prove=False, **{**options, **beside})


def _remedy_entry(remedy: Remedy) -> dict[str, Any]:
    """A remedy as JSON holds it."""
    entry: dict[str, Any] = picked(remedy.change, "parameter before after")
    entry["with_margin"] = remedy.take and remedy.take.after
    entry["verdict_line"] = remedy.computed.conclusion
    entry["first_loss"] = remedy.loss and remedy.loss._asdict()
    return entry


def page(report: Report, inputs: Sequence[Any] = ()) -> str:
    """The page as HTML text; `inputs` are the files behind it."""
    from jinja2 import Environment, PackageLoader, StrictUndefined  # a page alone needs these

    from squeal.plots.damping import Paths

    spectrum = report.eigenvalues
    state = "open"  # the CSS class of the headline, which colours it
    if spectrum.unstable:
        state = "grows"
    elif spectrum.certified and not spectrum.extent:  # a brake may squeal outside of a band
        state = "stable"
    paths = _chart(report)
    loader = PackageLoader("squeal")
    template = Environment(loader=loader, autoescape=True, undefined=StrictUndefined)
    modes = Paths(paths)
    text = template.get_template("report.html").render(
        report=report,
        modes=modes,
        grows_alone=len(modes.pair) == 1 and modes.pair[0] in _growing(report),
        state=state,
        numbering=_numbering(spectrum),
        chart=_figure(paths, report.name, damping=True, thresholds=report.thresholds),
        campbell=report.critical and _figure(report.critical, report.name, paths=paths),
        feeds=_feeds(report),
        moves=_moves(report),
        abaqus=_abaqus_ratio(spectrum),
        shapes=list(_shapes(report)),
        confidence=list(_confidence(report)),
        open=list(_not_answered(report)),
        read=list(_what_was_read(report)),
        sure="; ".join(line.removesuffix(".") for line in _evidence(report)),
        footer=_footer(inputs),
    )
    # a name may hold control characters, which HTML does not allow
    return "".join(c for c in text if c.isprintable() or c == "\n") + "\n"


def _abaqus_ratio(spectrum: Eigenvalues) -> str:
    """The damping ratio of the fastest mode as Abaqus prints it, with the mode; empty if it does
    not oscillate."""
    for mode in spectrum.unstable[:1]:
        if mode.frequency_hz:
            ratio = -2.0 * mode.growth_rate / abs(mode.root.imag)
            return f"{number(ratio, 3)} for mode {spectrum.mode_of(mode)}"
    return ""


def _numbering(spectrum: Eigenvalues) -> str:
    """What the number of a mode counts."""
    if spectrum.extent:
        return f"Modes are numbered by rising frequency within {spectrum.extent}."
    return "Modes are numbered by rising frequency."


def _footer(inputs: Sequence[Any]) -> str:
    """The files and the versions that made the page, in a line."""
    made = provenance(inputs, __name__)
    files = ", ".join(f"{file.name} (SHA-256 {file.sha256[:16]})" for file in made.inputs)
    used = []
    for name, version in made.versions.items():
        if name == "python" or name in made.loaded:
            used.append(f"{name} {version}")
    return f"squeal {__version__}; {files or 'no file'}; {', '.join(used)}"


@dataclass(frozen=True)
class _Figure:
    """A picture as the page holds it, a PNG in base64, and its alternative text."""

    code: str
    alternative: str


def _figure(answer: Answer, name: str, **more: Any) -> _Figure:
    from squeal.plots.answers import drawing  # here, since a report without a page draws nothing
    from squeal.plots.style import rendered

    made = drawing(answer, name, **more)
    return _Figure(b64encode(rendered(made, "png", 150)).decode(), made.alternative)


def _chart(report: Report) -> Sweep:
    """The eigenvalue paths up to a little more than the parameter's own value."""
    searched = report.thresholds
    high = min(CHART * report.eigenvalues.value, searched.high)
    if high <= searched.low or report.critical is not None:  # a rotor runs up through its speeds
        high = searched.high
    spectrum = report.eigenvalues
    names: dict[int, str] = {}  # at the own value, as the text has them
    for mode in spectrum.unstable:
        number_of_mode = spectrum.mode_of(mode)
        if number_of_mode is not None:
            hertz = number(mode.frequency_hz, 4)
            whirl = report._whirl(spectrum.value, mode.root)
            parts = [f"mode {number_of_mode}", f"{hertz} Hz", whirl]
            names[number_of_mode] = ", ".join(filter(None, parts))
    return eigenvalue_paths(searched, searched.low, high).named(names)


def _growing(report: Report) -> list[int]:
    """Numbers of the modes that grow, the fastest first, as many as the tables show."""
    spectrum = report.eigenvalues
    numbers = [spectrum.mode_of(mode) for mode in spectrum.unstable]
    return [mode for mode in numbers if mode is not None][:COLUMNS]


def _feeds(report: Report) -> Table:
    """What each term adds to the growth rate of growing modes: a row a term, a column a mode.

    A term that adds no more than rounding to all of these modes has no row.
    """
    modes = _growing(report)
    hertz: dict[int, float] = {}  # by mode
    rows: dict[str, dict[int, float]] = {}  # by term, then by mode: growth rates, 1/s
    for contribution in report.energy.contributions:
        mode = contribution.mode
        if mode not in modes:
            continue
        hertz[mode] = contribution.frequency_hz
        rounding = VISIBLE * math.tau * contribution.frequency_hz
        if contribution.growth is not None and abs(contribution.growth) > rounding:
            term = contribution.term
            if term != contribution.role:
                term = f"{term} ({contribution.role})"
            growths = rows.setdefault(term, {})
            # terms of one name are added, as those of two contacts
            growths[mode] = growths.get(mode, 0.0) + contribution.growth
    columns = [Column("term", value=itemgetter(0))]
    for mode in modes:
        head = f"mode {mode}, {number(hertz[mode], 4)} Hz"
        columns.append(Column(head, words=head, shown=_growth_of(mode)))
    return Table(columns, list(rows.items()))


def _growth_of(mode: int) -> Callable[[Any], str]:
    """The cell of a mode in a row of `_feeds`: a growth rate with its sign, "" where there is
    none."""
    return lambda row: f"{row[1][mode]:+.4g}" if mode in row[1] else ""


def _moves(report: Report) -> Table:
    """What a small change of each parameter does to the modes that grow and to the first loss: a
    row a parameter, the strongest on the fastest mode first, without noise."""
    modes = _growing(report)
    onset = report.onset
    steps: dict[str, str] = {}  # by parameter, in words
    effects: dict[int, dict[str, float]] = {mode: {} for mode in modes}  # by mode; 0: the loss
    heads = {mode: f"mode {mode}, 1/s" for mode in modes}
    for row in report.sensitivity.table().rows:
        if row.mode in modes:
            steps[row.parameter] = row.change
            effects[row.mode][row.parameter] = row.growth_change
    if onset is not None and onset.slopes:
        hertz = f"{onset.kind} at {onset.parameter} = {number(onset.at, 4)}"
        heads[0] = f"first loss ({hertz})"
        effects[0] = {}
        for name, slopes in onset.slopes.items():
            step, words = onset.step(name)
            if step:
                steps.setdefault(name, words)
                effects[0][name] = float(slopes[0]) * step
    strengths: dict[str, list[float]] = {name: [] for name in steps}
    for changes in effects.values():
        largest = max(filter(math.isfinite, map(abs, changes.values())), default=0.0)
        for name in steps:
            change = changes.get(name, 0.0)
            if abs(change) <= NOISE * largest:  # false of NaN
                changes.pop(name, None)
            strengths[name].append(abs(changes.get(name, 0.0)))

    columns = [Column("parameter", value=str), Column("change", value=steps.get)]
    for kind, head in heads.items():
        columns.append(Column(head, words=head, value=effects[kind].get))
    names = [name for name in steps if any(strengths[name])]
    names.sort(key=lambda name: strengths[name], reverse=True)
    positions = {name: -k for k, name in enumerate(names)}
    title = "what a small change of a parameter adds to growth rates, and to the first loss"
    return Table(columns, names, title, rank=positions.__getitem__)


def _confidence(report: Report) -> Iterator[str]:
    """How sure the page is, in sentences that need no mathematics."""
    spectrum = report.eigenvalues
    status = "counted" if spectrum.certified else "open"
    if spectrum.proof:
        status = spectrum.proof.get("status") or status
    limit = f" among {spectrum.extent}" if spectrum.extent else ""
    yield f"{CONFIDENCE[status]}{limit}."
    searched = report.thresholds
    status_of_onsets = (searched.proof or {}).get("status")
    where = f"{searched.parameter} = {number(searched.low, 4)} to {number(searched.high, 4)}"
    if status_of_onsets == "proved":
        rate = number((searched.proof or {})["growth_below"] or 0.0, 2)
        onset = f"no onset of growth by more than {rate} 1/s from {where} is missing"
        yield f"Proved too: {onset}{limit}."
    elif searched.certified:
        yield (
            f"Counted, not proved: no onset from {where} is missing{limit}, but for narrow ranges."
        )
    else:
        yield "Another onset than the listed ones may exist."
    if report.remedy is not None:
        yield "The changes above were computed anew, not extrapolated."
    if report.meetings:
        yield "Separation and damping were tried on the full model, for all growing modes at once."
    if spectrum.open:
        yield f"The {spectrum.open}."


def _what_was_read(report: Report) -> Iterator[str | Table]:
    """Paragraphs and a table on the matrices that were read, or a line on the scene."""
    if report.check is None:
        yield from report.eigenvalues.notes[:1]
        return
    head, files, lines, _, hints = report.check.parts()
    hertz = ", ".join(number(f) for f in report.check.frequencies_hz)
    modes = f"lowest real modes, without friction and damping: {hertz} Hz"
    yield from (head, files, "; ".join([*str(lines).splitlines(), modes, str(hints)]).rstrip("; "))


def _shapes(report: Report) -> Iterator[_Figure]:
    """One figure: all shapes of a pad, or that of a system's fastest mode; none of few nodes, as of
    a shaft, which make no picture."""
    spectrum = report.eigenvalues
    if isinstance(report.subject, Scene):
        yield _figure(spectrum, report.name)
        return
    coordinates = getattr(report.subject, "coordinates", None)
    if coordinates is not None and len(coordinates.places) >= DRAWN_NODES:
        for mode in _growing(report)[:1]:
            yield _figure(spectrum, report.name, shape=mode)


def _evidence(report: Report) -> Iterator[str]:
    """Sentences on what proves the answers."""
    spectrum = report.eigenvalues
    where = f" on {spectrum.extent}" if spectrum.extent else ""
    if spectrum.details.get("basis"):
        yield f"{basis_text(spectrum.details['basis'], errors=True)}."
    yield f"{len(spectrum.eigenvalues)} roots{where}: {spectrum.completeness}."
    worst = max((root.residual for root in spectrum.eigenvalues), default=math.nan)
    if math.isfinite(worst):
        yield f"The largest backward error of a listed root is {worst:.2g}."
    notes_of_thresholds = report.thresholds.parts()[-1]
    yield from str(notes_of_thresholds).splitlines()


def _not_answered(report: Report) -> Iterator[str]:
    """Sentences on what the answers do not speak of."""
    spectrum = report.eigenvalues
    if spectrum.extent:
        exception = ", but for the growth that was seen there" if report._growth_outside else ""
        yield f"Roots outside of {spectrum.extent}{exception}."
    limit = spectrum.details.get("growth_limit")
    if limit is not None:
        yield f"Roots that grow by more than {number(limit, 4)} 1/s."
    yield from spectrum.notes[1:]
    if report.sensitivity.note:
        yield f"{report.sensitivity.note}."
    if not report.energy.part_shares and not isinstance(report.subject, Scene):
        yield (
            "Where a mode's energy is: joined components tell, or `parts={name: rows}` in Python."
        )
    low = number(report.thresholds.low)
    high = number(report.thresholds.high)
    unit = unit_of(report.thresholds.source)
    outside = f"outside of {low} to {high} {unit}".rstrip()
    yield f"Values of {report.thresholds.parameter} {outside}."
    yield "Other values of the other parameters: `squeal scatter` draws them from ranges."
    if report.thresholds.parameter != "mu":
        yield "Motion of finite size, and the response to forces such as those of an unbalance."
        return
    yield (
        "Motion of finite size: this is linear stability of steady sliding. Lost contact, limit "
        "cycles and loudness need a simulation."
    )
