"""The page of a report: one HTML file that needs no other, for a screen or for two sheets of paper.

It is made from the template `squeal/templates/report.html`, which escapes every text.
"""

import math
from base64 import b64encode
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from squeal import __version__
from squeal.io.provenance import provenance
from squeal.io.scene import Scene
from squeal.io.writing import Answer, Column, Table, number
from squeal.linear import UnstableMode
from squeal.linear.shaft import name_of_kind
from squeal.reports.findings import Findings
from squeal.results.columns import with_unit
from squeal.results.eigenvalues import Eigenvalues
from squeal.results.sensitivity import Sensitivity
from squeal.results.sources import unit_of
from squeal.results.sweep import Sweep

COLUMNS = 3  # modes in the table of terms
NOISE = 1e-3  # of the strongest effect: weaker ones are noise to a reader, and left out
DRAWN_NODES = 10  # fewer make no picture of a shape
VISIBLE = 1e-12  # of a mode's angular frequency: smaller growth rates of terms are rounding
CONFIDENCE = {
    "proved": "Proved by a second program, which shares no code with the first: no mode is missing "
    "from the list",
    "counted": "Counted a second time (certified, not proved): no mode is missing from the list",
    "uncertified": "Counted a second time (neither certified nor proved): no mode is missing from "
    "the list",
    "open": "A mode may be missing from the list: no count or proof confirms it",
}


def page(report: Findings, inputs: Sequence[Any] = ()) -> str:
    """The page as HTML text; `inputs` are the files behind it."""
    from jinja2 import Environment, PackageLoader, StrictUndefined  # a page alone needs these

    from squeal.plots.damping import colours_of

    spectrum = report.eigenvalues
    state = "open"  # the CSS class of the headline, which colours it
    if spectrum.unstable:
        state = "grows"
    elif spectrum.certified and not spectrum.extent:  # a brake may squeal outside of a band
        state = "stable"
    paths = _chart(report)
    templates = Environment(
        loader=PackageLoader("squeal"), autoescape=True, undefined=StrictUndefined
    )
    text = templates.get_template("report.html").render(
        report=report,
        colours=colours_of(report.paths),
        state=state,
        numbering=_numbering(report),
        chart=_figure(paths, report.name, damping=True, thresholds=report.thresholds),
        campbell=report.critical and _figure(report.critical, report.name, paths=paths),
        feeds=_feeds(report),
        shares=_shares(report),
        moves=_moves(report),
        abaqus=_abaqus_ratio(spectrum),
        shapes=list(_shapes(report)),
        confidence=list(_confidence(report)),
        open=list(_not_answered(report)),
        read=list(_what_was_read(report)),
        footer=_footer(inputs),
    )
    # a name may hold control characters, which HTML does not allow
    return "".join(c for c in text if c.isprintable() or c == "\n") + "\n"


def _abaqus_ratio(spectrum: Eigenvalues) -> str:
    """The damping ratio of the fastest mode as Abaqus prints it, with the mode; empty if it does
    not oscillate."""
    if not spectrum.unstable or not spectrum.unstable[0].frequency_hz:
        return ""
    fastest = spectrum.unstable[0]
    ratio = -2.0 * fastest.growth_rate / abs(fastest.root.imag)
    return f"{number(ratio, 3)} for mode {spectrum.mode_of(fastest)}"


def _numbering(report: Findings) -> str:
    """What the number of a mode counts."""
    text = "Modes are numbered by rising frequency"
    if report.chart.reference is not None:
        text += f" at {report.at(report.chart.reference.value)}"
    extent = report.eigenvalues.extent
    return f"{text} within {extent}." if extent else f"{text}."


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


def _chart(report: Findings) -> Sweep:
    """The eigenvalue paths with names of the modes that grow at the own value."""
    spectrum = report.eigenvalues
    names: dict[int, str] = {}
    for mode in spectrum.unstable:
        number_of_mode = spectrum.mode_of(mode)
        if number_of_mode is not None:
            hertz = number(mode.frequency_hz, 4)
            whirl = report.whirl(spectrum.value, mode.root)
            parts = [f"mode {number_of_mode}", f"{hertz} Hz", whirl]
            names[number_of_mode] = ", ".join(filter(None, parts))
    return report.chart.named(names)


def _growing(report: Findings) -> dict[int, UnstableMode]:
    """The modes that grow by their numbers, the fastest first, as many as the tables show.

    A mode that does not oscillate may have two growing roots: the faster one is taken.
    """
    fastest: dict[int, UnstableMode] = {}
    for mode in report.eigenvalues.unstable:
        number_of_mode = report.eigenvalues.mode_of(mode)
        if number_of_mode is not None and len(fastest) < COLUMNS:
            fastest.setdefault(number_of_mode, mode)
    return fastest


def _feeds(report: Findings) -> Table:
    """What each term adds to the growth rate of growing modes: a row a term, a column a mode.

    A term that adds no more than rounding to all of these modes has no row. Rows are named by the
    term and its role, such as "mu (friction)".
    """
    modes = _growing(report)
    hertz: dict[int, float] = {}  # by mode
    rates: dict[int, dict[str, float]] = {mode: {} for mode in modes}  # by mode and term, 1/s
    for contribution in report.energy.contributions:
        mode = contribution.mode
        if mode not in modes:
            continue
        hertz[mode] = contribution.frequency_hz
        rounding = VISIBLE * math.tau * contribution.frequency_hz
        if contribution.growth is not None and abs(contribution.growth) > rounding:
            role = f" ({contribution.role})"
            term = contribution.term.removesuffix(role)  # some terms are named by their role too
            if term != contribution.role:
                term += role
            # terms of one name are added, as those of two contacts
            rates[mode][term] = rates[mode].get(term, 0.0) + contribution.growth
    columns = [Column("term", value=str)]
    terms: list[str] = []
    for mode, rate_of_term in rates.items():
        head = f"mode {mode}, {number(hertz[mode], 4)} Hz"
        columns.append(Column(head, words=head, shown=_signed(rate_of_term)))
        terms.extend(rate_of_term)  # its keys
    return Table(columns, list(dict.fromkeys(terms)))


def _shares(report: Findings) -> Table:
    """The shares of parts in the modes that the table of terms has."""
    table = report.energy.parts_table()
    modes = _growing(report)
    return replace(table, rows=[row for row in table.rows if row.mode in modes])


def _moves(report: Findings) -> Table:
    """What a small change of each parameter does to the modes that grow and to the first loss: a
    row a parameter, the strongest on the fastest mode first."""
    spectrum = report.eigenvalues
    onset = report.onset
    effects: dict[str, dict[str, float]] = {}  # by the head of a column, then by parameter
    for number_of_mode, mode in _growing(report).items():
        # the derivatives of the sensitivity are in the order of the eigenvalues
        index = int(abs(spectrum.values - mode.root).argmin())
        effects[f"mode {number_of_mode}, 1/s"] = _effects(report.sensitivity, index)
    if onset is not None and onset.slopes:
        unit = unit_of(report.thresholds.source)
        kind = name_of_kind(onset.kind, unit)
        where = f"{kind} at {onset.parameter} = {number(onset.at, 4)}"
        effects[with_unit(f"first loss ({where})", unit)] = _effects(onset, 0)
    strengths: dict[str, list[float]] = {}  # of each parameter, in each column
    for name in report.sensitivity.slopes:
        sizes = [abs(changes.get(name, 0.0)) for changes in effects.values()]
        # NaN has no order: an effect that is NaN follows all others
        strengths[name] = [-1.0 if math.isnan(size) else size for size in sizes]
    names = [name for name in strengths if any(strengths[name])]
    names.sort(key=strengths.__getitem__, reverse=True)
    columns = [Column("parameter", value=str)]
    # the second result of `step` is the step in words
    columns.append(Column("change", value=lambda name: report.sensitivity.step(name)[1]))
    for head, changes in effects.items():
        columns.append(Column(head, words=head, value=changes.get, shown=_signed(changes)))
    title = "what a small change of a parameter adds to growth rates, and to the first loss"
    # of a long table the first rows are shown
    return Table(columns, names, title, rank=lambda name: -names.index(name))


def _effects(derivatives: Sensitivity, index: int) -> dict[str, float]:
    """What a small step of each parameter adds to a growth rate, or to a threshold.

    Left out are parameters without a step, since they are zero and have a unit, and effects that
    are noise beside the largest one.

    index: of the growth rate the number of its root among the derivatives, of which the real part
    is taken; of a threshold 0, since its derivatives hold one number each.
    """
    effects = {}
    for name, slopes in derivatives.slopes.items():
        step, _ = derivatives.step(name)
        if step:
            effects[name] = step * float(slopes[index].real)
    largest = max(filter(math.isfinite, map(abs, effects.values())), default=0.0)
    # `not <=` instead of `>`, so that effects that are NaN stay
    return {name: x for name, x in effects.items() if not abs(x) <= NOISE * largest}


def _signed(values: Mapping[str, float]) -> Callable[[str], str]:
    """A function that makes the cells of a column: a number with its sign by the key of a row,
    empty where that has no finite number."""

    def cell(key: str) -> str:
        value = values.get(key, math.nan)
        return f"{value:+.4g}" if math.isfinite(value) else ""

    return cell


def _confidence(report: Findings) -> Iterator[str]:
    """How sure the page is, in sentences that need no mathematics."""
    spectrum = report.eigenvalues
    status = "counted" if spectrum.certified else "open"
    if spectrum.proof:
        status = spectrum.proof["status"]
    if status == "counted" and not spectrum.certified:
        status = "uncertified"
    limit = f" among {spectrum.extent}" if spectrum.extent else ""
    yield f"{CONFIDENCE[status]}{limit}."
    searched = report.thresholds
    low = searched.low
    high = searched.high
    proof = searched.proof if searched.is_proved else None
    if proof:
        # a proof may end between the first loss of stability and the end of the range
        low, high = proof["extent"]
    where = f"{searched.parameter} = {number(low, 4)} to {number(high, 4)}"
    if proof:
        rate = proof["growth_below"]
        growth = f" of growth by more than {number(rate, 2)} 1/s" if rate else ""
        yield f"Proved too: no onset{growth} from {where} is missing{limit}."
    elif searched.certified:
        yield (
            f"Counted too (certified, not proved): no onset from {where} is missing{limit}, "
            "but for narrow ranges."
        )
    else:
        yield "Another onset than the listed ones may exist."
    if report.remedy is not None:
        yield "The changes above were computed anew, not extrapolated."
    if report.meetings and all(map(report.meeting_of, spectrum.unstable)):
        yield "Separation and damping were tried on the full model, for all growing modes at once."
    if spectrum.open:
        yield f"The {spectrum.open}."


def _what_was_read(report: Findings) -> Iterator[str | Table]:
    """Paragraphs and a table on the matrices that were read, or a line on the scene."""
    if report.check is None:
        yield from report.eigenvalues.notes[:1]
        return
    head, files, lines, _, hints = report.check.parts()
    yield head
    yield files
    hertz = ", ".join(number(frequency) for frequency in report.check.frequencies_hz)
    modes = f"lowest real modes, without friction and damping: {hertz} Hz"
    yield "; ".join([*str(lines).splitlines(), modes, str(hints)]).rstrip("; ")


def _shapes(report: Findings) -> Iterator[_Figure]:
    """The shape of the fastest mode; none of few nodes, as of a shaft, which make no picture."""
    coordinates = getattr(report.subject, "coordinates", None)
    is_pad = isinstance(report.subject, Scene)
    if is_pad or (coordinates is not None and len(coordinates.places) >= DRAWN_NODES):
        for number_of_mode in list(_growing(report))[:1]:  # the fastest, if any grows
            yield _figure(report.eigenvalues, report.name, shape=number_of_mode)


def _not_answered(report: Findings) -> Iterator[str]:
    """Sentences on what the answers do not speak of."""
    spectrum = report.eigenvalues
    if spectrum.extent:  # the band or region whose roots were computed, such as "500 to 5000 Hz"
        exception = ", but for the growth that was seen there" if report.growth_outside else ""
        yield f"Roots outside of {spectrum.extent}{exception}."
    limit = spectrum.details.get("growth_limit")
    if limit is not None:
        yield f"Roots that grow by more than {number(limit, 4)} 1/s."
    yield from spectrum.notes[1:]  # the first one is among what was read
    if report.sensitivity.note:
        yield f"{report.sensitivity.note}."
    if not report.energy.part_shares and not isinstance(report.subject, Scene):
        yield ("Where a mode's energy is: joined components tell, or --parts (`parts` in Python).")
    low = number(report.thresholds.low)
    high = number(report.thresholds.high)
    unit = unit_of(report.thresholds.source)
    outside = f"outside of {low} to {high} {unit}".rstrip()
    yield f"Values of {report.thresholds.parameter} {outside}."
    yield "Other values of the other parameters: `squeal scatter` draws them from ranges."
    yield from report.hints
    if report.thresholds.parameter != "mu":
        yield "Motion of finite size, and the response to forces such as those of an unbalance."
        return
    yield (
        "Motion of finite size: this is linear stability of steady sliding. Lost contact, limit "
        "cycles and loudness need a simulation."
    )
