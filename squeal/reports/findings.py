"""What a report found of a brake, in sentences: what grows, why, and what to change."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any, NamedTuple

from squeal.io.scene import Scene
from squeal.io.writing import Answer, Column, Panel, Table, number, picked
from squeal.linear import GROWING, CriticalPoint, UnstableMode
from squeal.linear.shaft import speed_words
from squeal.model.pad import PARAMETERS
from squeal.queries.check import Check
from squeal.queries.critical_speeds import CriticalSpeeds
from squeal.queries.energy import Energy
from squeal.queries.mode_paths import Paths
from squeal.queries.ranges import DISAGREES
from squeal.queries.remedies.changes import Change, Effect
from squeal.queries.remedies.cures import MOST, MeetingSearch
from squeal.queries.remedies.meetings import Cure, Meeting
from squeal.queries.remedies.parameters import BETTER, Bound, Remedy, RemedySearch
from squeal.queries.systems.all_roots import is_small
from squeal.results.eigenvalues import Eigenvalues
from squeal.results.sensitivity import Sensitivity
from squeal.results.sources import unit_of
from squeal.results.sweep import Sweep
from squeal.results.thresholds import Thresholds

ROUNDED = {"frequency_hz", "growth_rate", "damping_ratio"}  # columns of the page in four digits
GROWS = 1e-3  # of its frequency: growth of a mode that is looked for at a crossing
NAMED = 3  # modes or parameters in a sentence
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


class _Way(NamedTuple):
    """A way to stop all that grows.

    grows_below: whether something grows with it at lower values of the parameter, which ranks it
    last; size: by which the others are ranked, as a share of a frequency or of critical damping.
    """

    sentence: str
    grows_below: bool
    size: float


class _Row(NamedTuple):
    """A change and its effect: how much is advised, and how much is just enough, in words."""

    name: str
    advised: str
    least: str
    effect: Effect


@dataclass(frozen=True, eq=False, repr=False)
class Findings(Answer):
    """The answers that one page is made of, and its sentences.

    eigenvalues: at the brake's own parameter; thresholds: up to `thresholds.high`; sensitivity: of
    the eigenvalues; onset: sensitivity of the first loss of stability, None where several modes are
    lost at once; check: what the matrices are, None of a scene; energy: what feeds each mode;
    search: the changes of a parameter that stop all modes that grow; cures: the real modes behind
    these, and what separation and damping do; bound: the value below which nothing grows; chart:
    the eigenvalue paths, by whose start modes are numbered in all of these; subject: the scene or
    system; critical: critical speeds where the parameter is that of a shaft.
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
    def growth_outside(self) -> str:
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
        lead = self.eigenvalues.unstable[0]
        number_of_mode = self.eigenvalues.mode_of(lead)
        if number_of_mode in self.energy.modes:
            lines["Cause"] = _capitalised(self._cause(lead, number_of_mode))
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
            text += f", at {self.at(spectrum.value)}"
        if lead.onset is not None:
            text += f"; it grows from {self.at(lead.onset)} on"
        sentences = [text]
        if others:
            names = []
            for mode in others[: NAMED - 1]:
                names.append(f"{self._name(mode)} by {number(mode.growth_rate, 3)} 1/s")
            unnamed = len(others) - len(names)
            more = f", {_others(unnamed)}" * bool(unnamed)
            grows = "mode grows" if len(others) == 1 else "modes grow"
            sentences.append(f"{len(others)} more {grows}: {', '.join(names)}{more}")
        outside = self.growth_outside
        fastest = spectrum.details.get("fastest_outside") or {}
        if fastest.get("growth_rate", 0.0) > lead.growth_rate:
            outside += ", faster than all inside"
        sentences.append(outside)
        return f"{'. '.join(map(_capitalised, filter(None, sentences)))}."

    def _cause(self, mode: UnstableMode, number_of_mode: int) -> str:
        """Which modes meet and where, or that none does, and which terms feed a mode."""
        _, _, balance = self.energy.sentence(number_of_mode).partition(": ")
        balance = balance.partition("; in all")[0]
        balance = balance.replace("circulatory", "cross-coupled (skew-symmetric) stiffness")
        # a mode alone, or with the one that it meets; empty where the chart does not have the mode
        group = self.paths.group_of(number_of_mode)
        words = ""
        if len(group) == 2:
            start = max(self.paths.at[one][0] for one in group)
            hertz = []
            for one in group:
                root = self.paths.root_at(one, start) or 0j
                hertz.append(number(root.imag / math.tau, 4))
            words = f"{_numbers(group)} ({' and '.join(hertz)} Hz at {self.at(start)}) "
            meeting = self.paths.meeting(group)
            words += "come together" if meeting is None else f"meet near {self.at(meeting)}"
            words += " and feed each other: "
        elif group:
            whirl = self.whirl(self.eigenvalues.value, mode.root)
            words = f"{whirl} whirl, " * bool(whirl) + "no other mode meets it: "
        text = f"{words}{balance}."
        real = self._real_modes(mode)
        if len(group) == 2 and real and self.cures.treatments:
            text += f" Separation and damping refer to {real}, without friction and damping."
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
        """The sentences of `advice`, one for each way to stop all that grows, the best first."""
        if not self.eigenvalues.unstable:
            return [self._without_growth()]
        ways = [*self._changes_in_words(), *self._bound()]
        for cure, effect in self.cures.treatments.items():
            ways.append(_Way(self._measure(cure), effect.leaves_window, self._share(cure)))
        if not ways:
            return ["No way out is known to this page."]
        ways.sort(key=lambda way: (way.grows_below, way.size))
        best, *others = (way.sentence for way in ways)
        return [self._with_aim(best), *(f"Or {way[0].lower()}{way[1:]}" for way in others)]

    def _changes_in_words(self) -> Iterator[_Way]:
        """The best change of one parameter, and the one after which stability is lost last if that
        is much later."""
        best = self.remedy
        if best is None:
            return
        latest = max(self.search.remedies, key=lambda remedy: remedy.limit)
        changes = [best]
        if latest.limit > BETTER * best.limit:
            changes.append(latest)
        # small changes stand before separation and damping, large ones behind them; the best one is
        # large only if no small one stops all, so that both are alike
        size = -1.0 if best.is_small else MOST
        for remedy in changes:
            sentence = remedy.sentence(self._meaning(remedy.change.parameter))
            yield _Way(sentence, remedy.leaves_window, size)

    def _with_aim(self, sentence: str) -> str:
        """The sentence of the best way with what it is for: how many modes, and of which band."""
        count = len(self.eigenvalues.unstable)
        aims = []
        if self.growth_outside or self._is_of_band_alone():
            aims.append(f"for {self.eigenvalues.extent} alone")
        if count > 1:
            aims.append("to stop both" if count == 2 else f"to stop all {count}")
        if self.growth_outside:
            hertz = number(self.eigenvalues.details["fastest_outside"]["frequency_hz"], 4)
            sentence += f" It is not meant for {hertz} Hz outside, and may not reach it."
        if not aims:
            return sentence
        return _capitalised(f"{', '.join(aims)}: {sentence[0].lower()}{sentence[1:]}")

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
            if spectrum.limit_hz is not None:
                words = "On the limit of flutter"
        if spectrum.extent:
            words += f" from {spectrum.extent}"
        if spectrum.depends:
            words += f" at {self.at(spectrum.value)}"
        words = f"{words}. {self.loss}"
        vibrating = [pair for pair in spectrum.of_modes if pair[1].value.imag > 0.0]
        if vibrating and spectrum.verdict != "marginal":
            mode, root = min(vibrating, key=lambda pair: pair[1].damping_ratio)
            ratio = number(100.0 * root.damping_ratio, 3)
            words += f" Damped least is {_name(mode, root.frequency_hz)}: {ratio} %."
        if self.growth_outside:
            words += f" But {self.growth_outside}."
        elif self._is_of_band_alone():
            words += " Nothing outside of the band was looked at."
        return words

    def _is_of_band_alone(self) -> bool:
        """Whether nothing was looked at outside of a band; of small systems all roots are known."""
        if not self.eigenvalues.extent:
            return False
        return not is_small(getattr(self.subject, "system", self.subject))

    def _share(self, cure: Cure) -> float:
        """The largest share of the upper frequency, or of critical damping, of a cure."""
        return max(meeting.advised[cure] / meeting.unit(cure) for meeting in self.meetings.values())

    def _measure(self, cure: Cure) -> str:
        """How much further apart, or more damped, the real modes behind each growing one shall be,
        what that does and what it costs."""
        words: list[str] = []
        percents: list[float] = []
        for mode, meeting in self._treated(cure):
            amount = meeting.advised[cure]
            percent = 100.0 * amount / meeting.unit(cure)
            percents.append(percent)
            if cure is Cure.APART:
                text = f"{self._pair(mode)} by raising the upper one by {number(amount, 3)} Hz, "
                words.append(f"{text}{number(percent, 2)} % of its frequency")
            else:
                both = "both " * (len(meeting.omega) == 2)
                words.append(f"of {both}{self._pair(mode)} by {number(percent, 3)} %")
        more = len(words) - NAMED
        if more > 0:  # words for all but the first `NAMED` modes together
            largest = number(max(percents[NAMED:]), 3)
            words[NAMED:] = [f"those of {_others(more)} by up to {largest} %"]
        effect = self.cures.treatments[cure].words()
        if cure is Cure.APART:
            return f"Move further apart {'; '.join(words)}: {effect}."
        words[0] += " of critical damping"
        whirl = self.whirl(self.eigenvalues.value, self.eigenvalues.unstable[0].root)
        text = f"Raise the damping {', '.join(words)}: {effect}{self._of_one_alone()}."
        return f"{text}{STATIONARY * bool(whirl)}"

    def _treated(self, cure: Cure) -> Iterator[tuple[UnstableMode, Meeting]]:
        """The growing modes that a cure is of; those of other modes stop the rest too."""
        for mode in self.eigenvalues.unstable:
            meeting = self.meeting_of(mode)
            if meeting is not None and meeting.advised[cure]:
                yield mode, meeting

    def _of_one_alone(self) -> str:
        """How much damping one mode of each pair needs alone; empty of modes that grow alone."""
        meetings = self.meetings.values()
        if not all(meeting.is_pair for meeting in meetings):
            return ""
        sides = set()
        needed = 0.0
        for meeting in meetings:
            side = meeting.alone
            if side is None:
                return "; of one of both alone no amount is known to be enough"
            sides.add(side)
            needed = max(needed, meeting.advised[side])
        which = "one of both"
        if len(sides) == 1:
            which = "the upper one" if Cure.UPPER in sides else "the lower one"
        return f"; of {which} alone it takes up to {number(100.0 * needed, 3)} %"

    def _bound(self) -> Iterator[_Way]:
        """Below which value of the parameter nothing grows, if that is known."""
        bound = self.bound
        if bound is None:
            return
        spectrum = self.eigenvalues
        unit = unit_of(self.thresholds.source)
        text = f"Keep {spectrum.parameter} below {bound.below}"
        text += speed_words(float(bound.below), unit)
        if bound.reservations:
            text += f" ({', '.join(bound.reservations)})"
        less = number(abs(bound.change.count), 3)
        text += f", {less} % less than {number(spectrum.value, 4)}"
        if spectrum.parameter == "mu":
            more = number(100.0 * (spectrum.value / float(bound.below) - 1.0), 3)
            text += f": as much less friction force, or {more} % more normal force for the same"
        yield _Way(f"{text}.", False, math.inf)

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

    def _real_modes(self, mode: UnstableMode) -> str:
        """The real modes behind a growing one by their frequencies; empty where these are the modes
        of the chart that meet, or where none is known."""
        meeting = self.meeting_of(mode)
        are_several_of_one_frequency = meeting is not None and len(meeting.omega) > 2
        if meeting is None or (meeting.is_of_chart and not are_several_of_one_frequency):
            return ""
        hertz = dict.fromkeys(number(frequency, 4) for frequency in meeting.hertz)
        modes = "the real mode" if len(meeting.omega) == 1 else "real modes"
        if are_several_of_one_frequency:
            modes = "all real modes"
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
        """A mode that grows by its number and frequency."""
        return _name(self.eigenvalues.mode_of(mode), mode.frequency_hz)

    @property
    def hints(self) -> list[str]:
        """What was tried and does not help, and how to name other parameters."""
        if not self.eigenvalues.unstable:
            return []
        lines = []
        tried = {Cure.APART: "moving their real modes further apart", Cure.BOTH: "damping them"}
        failed = []
        for cure, words in tried.items():
            if self.meetings and cure not in self.cures.treatments:
                failed.append(words)
        if failed:
            lines.append(
                f"Not known to stop all modes, up to {100 * MOST:g} %: {' or '.join(failed)}."
            )
        if self.remedy is not None:
            return lines
        idle = self.search.without_effect
        if idle:
            words = "by up to a factor of 4 takes less than a tenth of the growth"
            lines.append(f"Changing {' or '.join(idle)} {words}.")
        if {*idle, *(one.change.parameter for one in self.search.partial)} <= OF_CONTACT:
            lines.append(HINT)
        return lines

    @property
    def remedies(self) -> Table:
        """What to change: how much, what it costs, what it leaves and where stability is lost."""
        spectrum = self.eigenvalues
        unit = unit_of(self.thresholds.source)

        def growth_left(row: _Row) -> str:
            if not isinstance(row.effect, Remedy):
                return "none"
            for mode in row.effect.computed.unstable[:1]:
                nearest = abs(spectrum.values - mode.root).argmin()
                name = _name(int(spectrum.modes[nearest]), mode.frequency_hz)
                return f"{number(mode.growth_rate, 3)} 1/s of {name}"
            return "none"

        def amount(row: _Row) -> str:
            return f"({row.advised})" if row.effect.leaves_window else row.advised

        def next_loss(row: _Row) -> str:
            loss = row.effect.loss
            if loss is None:
                return "-"
            if loss.value is None:
                return f"none up to {number(loss.high, 4)}"
            words = loss.words(spectrum.parameter, unit)
            return words.removeprefix("up to ").replace(", then", ":")

        rows = list(self._rows())
        at_value = f"at {spectrum.parameter} = {number(spectrum.value, 4)}"
        columns = [
            Column("change", shown=lambda row: row.name),
            Column("amount", shown=amount),
            Column("least", shown=lambda row: row.least, words=f"just stops {at_value}"),
            Column("growth_left", shown=growth_left, words="growth left"),
            Column(
                "in_hand",
                shown=lambda row: row.effect.in_hand,
                words=f"{spectrum.parameter} in hand, %",
            ),
            Column(
                "damping_left",
                shown=lambda row: _cell(100.0 * row.effect.damping_left),
                words="least damping, %",
            ),
            Column(
                "shift",
                shown=lambda row: _cell(row.effect.shift_hz),
                words="frequencies move by, Hz",
            ),
            Column("next_loss", shown=next_loss, words="next loss"),
        ]
        if not self.search.partial:
            del columns[3]  # growth_left, since nothing that grows is left
        title = "what to change, of parameters the best first; degrees count as %"
        if spectrum.depends:
            title += f"; amounts leave 10 % of {spectrum.parameter} in hand where they can"
        extents = [row.effect.loss.extent for row in rows if row.effect.loss is not None]
        if any(extents):
            title += f"; in hand and next loss: of {next(filter(None, extents))} alone"
        if any(row.effect.leaves_window for row in rows):
            title += f"; in brackets: something grows at a lower {spectrum.parameter}"
        return Table(columns, rows, title)

    def _rows(self) -> Iterator[_Row]:
        """The changes of one parameter, then separation and damping, and the free parameter."""
        for remedy in self.search.remedies or self.search.partial:
            name = f"{remedy.change.parameter}{self._meaning(remedy.change.parameter)}"
            # a partial one just stops nothing
            least = remedy.change.size if self.search.remedies else "-"
            yield _Row(name, _in_words(remedy.advised), least, remedy)
        for cure, effect in self.cures.treatments.items():
            pairs = []
            enough = []
            advised = []
            for mode, meeting in self._treated(cure):
                pairs.append(self._pair(mode))
                enough.append(_amount(cure, meeting.cures[cure]))
                advised.append(_amount(cure, meeting.advised[cure]))
            cure_name = "separation" if cure is Cure.APART else "damping"
            name = f"{cure_name} of {'; '.join(pairs)}"
            yield _Row(name, "; ".join(advised), "; ".join(enough), effect)
        bound = self.bound
        if bound is not None:
            parameter = bound.change.parameter
            yield _Row(parameter, _in_words(bound.take), bound.change.size, bound)

    @property
    def growing(self) -> Table:
        """The modes that grow, with the mode of the chart that each of them meets, and at which
        value of the parameter; their kinds stand in the text."""
        table = self.eigenvalues.growing

        def partner(mode: UnstableMode) -> str:
            number_of_mode = self.eigenvalues.mode_of(mode)
            group = self.paths.group_of(number_of_mode)
            # a group has one or two modes
            partners = [str(member) for member in group if member != number_of_mode]
            if not partners:
                return "-"
            value = self.paths.meeting(group)
            return partners[0] if value is None else f"{partners[0]} near {number(value, 3)}"

        columns = []
        for column in table.columns:
            if column.name == "onset":
                columns.append(Column("meets", shown=partner, words="meets"))
            if column.name in ROUNDED:
                columns.append(replace(column, shown=partial(_in_four, column)))
            elif column.name != "kind":
                columns.append(column)
        return replace(table, columns=columns)

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

    def _lost(self, first: CriticalPoint) -> str:
        """What happens at the first loss: of a rotor the whirl that begins to grow."""
        whirl = self.whirl(first.mu, complex(0.0, math.tau * (first.frequency_hz or 0.0)))
        return f"{whirl} whirl begins to grow" if whirl else first.kind

    @property
    def loss(self) -> str:
        """The first loss of stability, and how far the present value is from it."""
        first = self.thresholds.first
        value = self.eigenvalues.value
        where = " within the band" if self.eigenvalues.extent else ""
        if self.thresholds.verdict in GROWING:  # at the lower end
            return f"Unstable at {self.at(self.thresholds.low)}, where the range begins."
        proof = self.thresholds.proof
        if proof is not None and (proof["reason"] or "").startswith(DISAGREES):
            return "Where stability is first lost is not known: a count found other growing modes."
        if first is None:
            if self.thresholds.low:
                where += f" from {self.at(self.thresholds.low)}"
            return f"No loss of stability{where} up to {self.at(self.thresholds.high)}."
        line = f"Stability is first lost{where} at {self.at(first.mu)}: {self._lost(first)}"
        if first.frequency_hz:
            line += f" at {number(first.frequency_hz, 4)} Hz"
        if first.mu <= 0.0 or value <= 0.0:  # shares of these say nothing
            return f"{line}."
        if math.isclose(value, first.mu, rel_tol=1e-9):
            return f"{line}, which is the present value."
        if value >= TIMES * first.mu:
            return f"{line}; {self.at(value)} is {number(value / first.mu, 2)} times that."
        percent = 100.0 * (value / first.mu - 1.0)
        above_or_below = "above" if percent > 0.0 else "below"
        return f"{line}; {self.at(value)} lies {number(abs(percent), 3)} % {above_or_below} that."

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
        alone = [cure.name.lower() for cure in self.cures.with_window]
        for mode, meeting in self.meetings.items():
            entry: dict[str, Any] = {"mode": mode, "frequencies_hz": list(meeting.hertz)}
            entry["at_value_alone"] = alone
            entry["just_enough"] = {}
            for cure in Cure:
                entry[cure.name.lower()] = meeting.advised.get(cure)
                entry["just_enough"][cure.name.lower()] = meeting.cures.get(cure)
            meetings.append(entry)
        of_thresholds = self.thresholds.to_dict()
        critical = self.critical and self.critical.table().records()
        # each row has a `mode`, counted at its own value; the number in the chart is added
        for row in of_thresholds["crossings"]:
            # i omega with a little growth: of two modes that have just met, that which grows is the
            # nearer one
            root = complex(GROWS, 1.0) * math.tau * (row["frequency_hz"] or 0.0)
            row["number_in_chart"] = self.paths.mode_at(row["mu"], root)
        for row in critical or []:
            root = complex(row["growth_rate"], math.tau * row["frequency_hz"])
            row["number_in_chart"] = self.paths.mode_at(row["speed"], root)
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
            "thresholds": of_thresholds,
            **self.sensitivity.to_dict(),
            "onset_sensitivity": self.onset and self.onset.to_dict()["sensitivity"],
            "check": self.check and self.check.to_dict(),
            "critical_speeds": critical,
        }


def _amount(cure: Cure, amount: float) -> str:
    """An amount of a cure in a cell."""
    if cure is Cure.APART:
        return f"{number(amount, 3)} Hz"
    return f"{number(100.0 * amount, 3)} %"


def _in_words(change: Change) -> str:
    """A change of a parameter in a cell."""
    return f"{change.verb} by {change.size}, {change.values}"


def _name(number_of_mode: int | None, frequency_hz: float) -> str:
    """A mode by its number, None where it has none, and its frequency."""
    hertz = f"{number(frequency_hz, 4)} Hz"
    if number_of_mode is None:
        return f"the mode at {hertz}"
    return f"mode {number_of_mode} ({hertz})"


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
    entry["at_value_alone"] = remedy.leaves_window
    entry["verdict_line"] = remedy.computed.conclusion
    entry["first_loss"] = remedy.loss and remedy.loss._asdict()
    return entry
