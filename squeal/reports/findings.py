"""What a report found of a brake, in sentences: what grows, why, and where stability is lost."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

from squeal.io.writing import Column, JsonObject, Panel, Table, copied_attributes, number
from squeal.linear import GROWING, UnstableMode
from squeal.queries.ranges import DISAGREES
from squeal.queries.remedies.meetings import Cure
from squeal.queries.remedies.parameters import Remedy
from squeal.reports.advice import failed_attempts, remedy_table, ways_out
from squeal.reports.brake_answers import (
    BrakeAnswers,
    capitalised,
    group_name,
    mode_name,
    others_text,
    real_modes_name,
    unstable_name,
)

ROUNDED = {"frequency_hz", "growth_rate", "damping_ratio"}  # columns of the page in four digits
GROWS = 1e-3  # of its frequency: growth of a mode that is looked for at a crossing
NAMED = 3  # modes in a sentence
TIMES = 3.0  # from which on a value is so many times another one, not so many % above it


@dataclass(frozen=True, eq=False, repr=False)
class Findings(BrakeAnswers):
    """The answers that one page is made of, and its sentences."""

    panel = Panel("frequency_hz", "growth_rate")

    @property
    def opening(self) -> dict[str, str]:
        """The first sentences by their labels: fault, cause and remedy, or a verdict."""
        if not self.eigenvalues.unstable:
            return {"Verdict": self._without_growth()}
        lines = {"Fault": self.fault}
        fastest = self.eigenvalues.unstable[0]
        number_of_mode = self.eigenvalues.mode_of(fastest)
        if number_of_mode in self.energy.modes:
            lines["Cause"] = capitalised(self._cause(fastest, number_of_mode))
        return lines | {"Remedy": self.ways[0]}

    @property
    def fault(self) -> str:
        """Which mode grows fastest, at what value, how fast and from where on; what else grows."""
        spectrum = self.eigenvalues
        fastest, *others = spectrum.unstable
        text = f"{unstable_name(self, fastest)} grows by {number(fastest.growth_rate, 4)} 1/s"
        if fastest.frequency_hz:
            text += f", damping {number(100.0 * fastest.damping_ratio, 3)} %"
        if spectrum.depends:
            text += f", at {self.at(spectrum.value)}"
        if fastest.onset is not None:
            text += f"; it grows from {self.at(fastest.onset)} on"
        sentences = [text]
        if others:
            names = []
            for mode in others[: NAMED - 1]:
                names.append(f"{unstable_name(self, mode)} by {number(mode.growth_rate, 3)} 1/s")
            unnamed = len(others) - len(names)
            if unnamed:
                names.append(others_text(unnamed))
            grows = "mode grows" if len(others) == 1 else "modes grow"
            sentences.append(f"{len(others)} more {grows}: {', '.join(names)}")
        outside = self.growth_outside
        if outside:
            rate_outside = spectrum.details["fastest_outside"]["growth_rate"]
            if rate_outside > fastest.growth_rate:
                outside += ", faster than all inside"
            sentences.append(outside)
        return f"{'. '.join(map(capitalised, sentences))}."

    def _cause(self, mode: UnstableMode, number_of_mode: int) -> str:
        """Which modes meet and where, or that none does, and which terms feed a mode.

        Such as "modes 1 and 2 (900 and 950 Hz at mu = 0) meet near mu = 0.4 and feed each other:
        ...", where "..." is what feeds and damps the mode.
        """
        # the sentence reads "mode 2, 1000 Hz: what feeds and damps the mode; in all 5 1/s"
        _, _, balance = self.energy.sentence(number_of_mode).partition(": ")
        balance, _, _ = balance.partition("; in all")
        balance = balance.replace("circulatory", "cross-coupled (skew-symmetric) stiffness")
        # a mode alone, or with the one that it meets; empty where the chart does not have the mode
        group = self.paths.group_of(number_of_mode)
        text = ""
        if len(group) == 2:
            # the least value of the parameter at which the paths of both modes exist
            start = max(self.paths.at[member][0] for member in group)
            hertz = []
            for member in sorted(group):  # as `group_name` names them
                root = self.paths.root_at(member, start) or 0j  # never None at `start`
                hertz.append(number(root.imag / math.tau, 4))
            text = f"{group_name(group)} ({' and '.join(hertz)} Hz at {self.at(start)}) "
            meeting = self.paths.meeting(group)
            text += "come together" if meeting is None else f"meet near {self.at(meeting)}"
            text += " and feed each other: "
        elif group:
            whirl = self.whirl(self.eigenvalues.value, mode.root)
            if whirl:
                text = f"{whirl} whirl, "
            text += "no other mode meets it: "
        text += f"{balance}."
        real = real_modes_name(self, mode)
        # cures act on the real modes, which are named if they differ from those of the chart
        if len(group) == 2 and real and self.cures.treatments:
            text += f" Separation and damping refer to {real}, without friction and damping."
        place = self.energy.place(number_of_mode)
        if place:
            text += f" Where its energy is: {place}."
        return text

    @property
    def ways(self) -> list[str]:
        """The sentences of `advice`, one for each way to stop all that grows, the best first."""
        if not self.eigenvalues.unstable:
            return [self._without_growth()]
        return ways_out(self)

    @property
    def advice(self) -> str:
        """What to change, each way alone enough; or how far a stable brake is from its loss."""
        return " ".join(self.ways)

    @property
    def hints(self) -> list[str]:
        """What was tried and does not help, and how to name other parameters."""
        return failed_attempts(self) if self.eigenvalues.unstable else []

    @property
    def remedies(self) -> Table:
        """What to change: how much, what it costs, what it leaves and where stability is lost."""
        return remedy_table(self)

    def _without_growth(self) -> str:
        """Where nothing grows, how sure that is, and where stability is lost."""
        spectrum = self.eigenvalues
        # of the roots of a band only growth is a verdict
        has_verdict = spectrum.verdict is not None or bool(spectrum.extent)
        kinds = [root.kind for root in spectrum.eigenvalues]
        is_marginal = "marginal" in (spectrum.verdict, *kinds)  # not all decay
        text = "Nothing that grows was found"
        if spectrum.certified and has_verdict:
            text = "Nothing grows" if is_marginal else "Stable"
            if spectrum.limit_hz is not None:
                text = "On the limit of flutter"
        if spectrum.extent:
            text += f" from {spectrum.extent}"
        if spectrum.depends:
            text += f" at {self.at(spectrum.value)}"
        text += f". {self.loss}"
        vibrating = {root: mode for mode, root in spectrum.of_modes if root.value.imag > 0.0}
        if vibrating and not is_marginal:
            root = min(vibrating, key=lambda root: root.damping_ratio)
            ratio = number(100.0 * root.damping_ratio, 3)
            text += f" Damped least is {mode_name(vibrating[root], root.frequency_hz)}: {ratio} %."
        if self.growth_outside:
            text += f" But {self.growth_outside}."
        elif self.is_of_band_alone:
            text += " Nothing outside of the band was looked at."
        return text

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

    @property
    def loss(self) -> str:
        """The first loss of stability, and how far the parameter's present value is from it."""
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
        what = first.kind
        whirl = self.whirl(first.mu, 1j * math.tau * (first.frequency_hz or 0.0))
        if whirl:  # forward, backward ..., of a rotor; empty of what does not turn
            what = f"{whirl} whirl begins to grow"
        line = f"Stability is first lost{where} at {self.at(first.mu)}: {what}"
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

    def to_dict(self) -> JsonObject:
        remedies = [_remedy_entry(remedy) for remedy in self.search.remedies]
        meetings = []
        # the kinds of cure that stop growth at the present value alone, not at all lower ones
        at_value_alone = [cure.name.lower() for cure in self.cures.growing_below]
        for mode, meeting in self.meetings.items():
            entry: JsonObject = {"mode": mode, "frequencies_hz": list(meeting.hertz)}
            entry["at_value_alone"] = at_value_alone
            entry["just_enough"] = {}
            for cure in Cure:
                key = cure.name.lower()
                entry[key] = meeting.advised.get(cure)
                entry["just_enough"][key] = meeting.cures.get(cure)
            meetings.append(entry)
        thresholds = self.thresholds.to_dict()
        critical = self.critical and self.critical.table().records()
        # a row has the number of its mode at its own value; that in the chart is added
        for row in thresholds["crossings"]:
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
            "thresholds": thresholds,
            **self.sensitivity.to_dict(),
            "onset_sensitivity": self.onset and self.onset.to_dict()["sensitivity"],
            "check": self.check and self.check.to_dict(),
            "critical_speeds": critical,
        }


def _in_four(column: Column, row: object) -> str:
    """A cell of a column of numbers in four digits."""
    value = column.of(row)
    return "-" if value is None else number(100.0 * value if column.percent else value, 4)


def _remedy_entry(remedy: Remedy) -> JsonObject:
    """A remedy as JSON holds it."""
    entry: JsonObject = copied_attributes(remedy.change, "parameter before after")
    entry["with_margin"] = remedy.with_margin and remedy.with_margin.after
    entry["at_value_alone"] = remedy.grows_below
    entry["verdict_line"] = remedy.computed.conclusion
    entry["first_loss"] = remedy.loss and remedy.loss._asdict()
    return entry
