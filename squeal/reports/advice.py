"""What to change of a brake that squeals: the ways to stop all that grows, and their table."""

import math
import re
from collections.abc import Iterator
from typing import NamedTuple

from squeal.io.scene import Scene
from squeal.io.writing import Column, Table, number
from squeal.linear.shaft import speed_words
from squeal.model.pad import PARAMETERS
from squeal.queries.remedies.changes import Change, Effect
from squeal.queries.remedies.cures import MOST
from squeal.queries.remedies.meetings import Cure
from squeal.queries.remedies.parameters import BETTER, Remedy
from squeal.reports.brake_answers import (
    BrakeAnswers,
    capitalised,
    mode_name,
    others_text,
    pair_name,
    treated_modes,
)
from squeal.results.sources import unit_of

NAMED = 3  # modes in a sentence
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
    """A line of the table: a change, how much of it is advised and just enough, and its effect."""

    name: str
    advised: str
    least: str
    effect: Effect


def ways_out(answers: BrakeAnswers) -> list[str]:
    """Sentences, one for each way to stop all that grows, the best first."""
    ways = [*_changes(answers), *_bound(answers)]
    for cure, effect in answers.cures.treatments.items():
        # of the upper frequency, or of critical damping
        shares = [one.advised[cure] / one.unit(cure) for one in answers.meetings.values()]
        ways.append(_Way(_treatment(answers, cure), effect.grows_below, max(shares)))
    if not ways:
        return ["No way out is known to this page."]
    ways.sort(key=lambda way: (way.grows_below, way.size))
    best, *others = (way.sentence for way in ways)
    return [_with_aim(answers, best), *(f"Or {other[0].lower()}{other[1:]}" for other in others)]


def _changes(answers: BrakeAnswers) -> Iterator[_Way]:
    """The best change of one parameter, and the one after which stability is lost last if that is
    later by more than 2 % (`BETTER`)."""
    best = answers.remedy
    if best is None:
        return
    latest = max(answers.search.remedies, key=lambda remedy: remedy.limit)
    changes = [best]
    if latest.limit > BETTER * best.limit:
        changes.append(latest)
    # small changes stand before separation and damping, large ones behind them; the best one is
    # large only if no small one stops all, so that both are alike
    size = -1.0 if best.is_small else math.inf
    for remedy in changes:
        sentence = remedy.sentence(_meaning(answers, remedy.change.parameter))
        yield _Way(sentence, remedy.grows_below, size)


def _bound(answers: BrakeAnswers) -> Iterator[_Way]:
    """Below which value of the parameter nothing grows, if that is known: the last of the ways."""
    bound = answers.bound
    if bound is None:
        return
    spectrum = answers.eigenvalues
    unit = unit_of(answers.thresholds.source)
    text = f"Keep {spectrum.parameter} below {bound.below}"
    text += speed_words(float(bound.below), unit)
    if bound.reservations:
        text += f" ({', '.join(bound.reservations)})"
    percent_less = number(abs(bound.change.count), 3)
    text += f", {percent_less} % less than {number(spectrum.value, 4)}"
    if spectrum.parameter == "mu":
        percent_more = number(100.0 * (spectrum.value / float(bound.below) - 1.0), 3)
        text += f": as much less friction force, or {percent_more} % more normal force for the same"
    yield _Way(f"{text}.", grows_below=False, size=math.inf)


def _treatment(answers: BrakeAnswers, cure: Cure) -> str:
    """How much further apart, or more damped, the real modes behind each growing one shall be, what
    that does and what it costs."""
    measures: list[str] = []  # of each treated mode, in words
    percents: list[float] = []
    for mode, meeting in treated_modes(answers, cure):
        amount = meeting.advised[cure]
        # of the upper frequency, or of critical damping
        percent = 100.0 * amount / meeting.unit(cure)
        percents.append(percent)
        pair = pair_name(answers, mode)
        if cure is Cure.APART:
            rise = f"{number(amount, 3)} Hz, {number(percent, 2)} % of its frequency"
            measures.append(f"{pair} by raising the upper one by {rise}")
        else:
            if len(meeting.omega) == 2:  # two real modes are behind the growing one
                pair = f"both {pair}"
            measures.append(f"of {pair} by {number(percent, 3)} %")
    unnamed = len(measures) - NAMED
    if unnamed > 0:  # these share one text
        largest = number(max(percents[NAMED:]), 3)
        measures[NAMED:] = [f"those of {others_text(unnamed)} by up to {largest} %"]
    effect = answers.cures.treatments[cure].words()
    if cure is Cure.APART:
        return f"Move further apart {'; '.join(measures)}: {effect}."
    measures[0] += " of critical damping"
    text = f"Raise the damping {', '.join(measures)}: {effect}{_damping_of_one(answers)}."
    spectrum = answers.eigenvalues
    if answers.whirl(spectrum.value, spectrum.unstable[0].root):  # a rotor turns
        text += STATIONARY
    return text


def _damping_of_one(answers: BrakeAnswers) -> str:
    """How much damping one mode of each pair needs alone; empty of modes that grow alone."""
    meetings = answers.meetings.values()
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


def _with_aim(answers: BrakeAnswers, sentence: str) -> str:
    """The sentence of the best way with what it is for: how many modes, and of which band."""
    count = len(answers.eigenvalues.unstable)
    aims = []
    if answers.growth_outside or answers.is_of_band_alone:
        aims.append(f"for {answers.eigenvalues.extent} alone")
    if count > 1:
        aims.append("to stop both" if count == 2 else f"to stop all {count}")
    if answers.growth_outside:
        hertz = number(answers.eigenvalues.details["fastest_outside"]["frequency_hz"], 4)
        sentence += f" It is not meant for {hertz} Hz outside, and may not reach it."
    if not aims:
        return sentence
    return capitalised(f"{', '.join(aims)}: {sentence[0].lower()}{sentence[1:]}")


def _meaning(answers: BrakeAnswers, parameter: str) -> str:
    """What a parameter is, in brackets after a space; empty where that is not known."""
    if isinstance(answers.subject, Scene):
        meaning = PARAMETERS[parameter].meaning.split(" (")[0]
        return f" ({meaning})"
    terms = []
    for row in answers.energy.contributions:
        file, _, factor = row.term.rpartition(", ")
        if re.search(rf"\b{re.escape(parameter)}\b", factor):
            terms.append(f"{file}, {row.role}" if file else row.role)
    return f" (factor of {' and '.join(dict.fromkeys(terms))})" if terms else ""


def failed_attempts(answers: BrakeAnswers) -> list[str]:
    """What was tried and does not help, and how to name other parameters."""
    lines = []
    tried = {Cure.APART: "moving their real modes further apart", Cure.BOTH: "damping them"}
    failed = []
    for cure, measure in tried.items():
        if answers.meetings and cure not in answers.cures.treatments:
            failed.append(measure)
    if failed:
        lines.append(f"Not known to stop all modes, up to {100 * MOST:g} %: {' or '.join(failed)}.")
    if answers.remedy is not None:
        return lines
    without_effect = answers.search.without_effect
    if without_effect:
        lines.append(
            f"Changing {' or '.join(without_effect)} by up to a factor of 4 takes less than a "
            "tenth of the growth."
        )
    partial = [remedy.change.parameter for remedy in answers.search.partial]
    if {*without_effect, *partial} <= OF_CONTACT:  # no parameter of a part was tried
        lines.append(HINT)
    return lines


def remedy_table(answers: BrakeAnswers) -> Table:
    """What to change: how much, what it costs, what it leaves and where stability is lost.

    One row for each change that helps; a `_Row` has the name of the change, the amount that is
    advised, the least one that suffices, and the effect of the advised one.
    """
    spectrum = answers.eigenvalues
    unit = unit_of(answers.thresholds.source)

    def growth_left(row: _Row) -> str:
        # separation, damping and a bound stop all that grows
        if not isinstance(row.effect, Remedy) or not row.effect.computed.unstable:
            return "none"
        fastest = row.effect.computed.unstable[0]
        nearest = abs(spectrum.values - fastest.root).argmin()
        name = mode_name(int(spectrum.modes[nearest]), fastest.frequency_hz)
        return f"{number(fastest.growth_rate, 3)} 1/s of {name}"

    def amount(row: _Row) -> str:
        # brackets say that something grows at a lower value of the brake's parameter
        return f"({row.advised})" if row.effect.grows_below else row.advised

    def next_loss(row: _Row) -> str:
        loss = row.effect.loss
        if loss is None:
            return "-"
        if loss.value is None:
            return f"none up to {number(loss.high, 4)}"
        # from "up to mu = 0.5, then flutter at 2000 Hz" to "mu = 0.5: flutter at 2000 Hz"
        words = loss.words(spectrum.parameter, unit)
        return words.removeprefix("up to ").replace(", then", ":")

    rows = list(_rows(answers))
    at_value = f"at {spectrum.parameter} = {number(spectrum.value, 4)}"
    columns = [
        Column("change", shown=lambda row: row.name),
        Column("amount", shown=amount),
        Column("least", words=f"just stops {at_value}"),
    ]
    if answers.search.partial:  # else nothing that grows is left
        columns.append(Column("growth_left", shown=growth_left, words="growth left"))
    columns += [
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
    title = "what to change, of parameters the best first; degrees count as %"
    if spectrum.depends:
        title += f"; amounts leave 10 % of {spectrum.parameter} in hand where they can"
    extents = [row.effect.loss.extent for row in rows if row.effect.loss is not None]
    if any(extents):
        title += f"; in hand and next loss: of {next(filter(None, extents))} alone"
    if any(row.effect.grows_below for row in rows):
        title += f"; in brackets: something grows at a lower {spectrum.parameter}"
    return Table(columns, rows, title)


def _rows(answers: BrakeAnswers) -> Iterator[_Row]:
    """The changes of one parameter, then separation and damping, and the free parameter."""
    search = answers.search
    for remedy in search.remedies or search.partial:
        name = f"{remedy.change.parameter}{_meaning(answers, remedy.change.parameter)}"
        # no change of a partial remedy is enough
        least = remedy.change.size if search.remedies else "-"
        yield _Row(name, _change_text(remedy.advised), least, remedy)
    for cure, effect in answers.cures.treatments.items():
        pairs = []
        enough = []
        advised = []
        for mode, meeting in treated_modes(answers, cure):
            pairs.append(pair_name(answers, mode))
            enough.append(_amount(cure, meeting.cures[cure]))
            advised.append(_amount(cure, meeting.advised[cure]))
        cure_name = "separation" if cure is Cure.APART else "damping"
        name = f"{cure_name} of {'; '.join(pairs)}"
        yield _Row(name, "; ".join(advised), "; ".join(enough), effect)
    bound = answers.bound
    if bound is not None:
        advised_text = _change_text(bound.with_margin)
        yield _Row(bound.change.parameter, advised_text, bound.change.size, bound)


def _amount(cure: Cure, amount: float) -> str:
    """An amount of a cure in a cell."""
    if cure is Cure.APART:
        return f"{number(amount, 3)} Hz"
    return f"{number(100.0 * amount, 3)} %"


def _change_text(change: Change) -> str:
    """A change of a parameter in a cell."""
    return f"{change.verb} by {change.size}, {change.values}"


def _cell(value: float) -> str:
    """A number in a cell, a dash for NaN."""
    return "-" if math.isnan(value) else number(value, 3)
