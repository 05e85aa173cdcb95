"""One page about a brake: what to change, what grows and since when, what feeds it, how sure it is.

The page is one HTML file that needs no other, for a screen or for two sheets of paper. It is made
from the template `squeal/templates/report.html`, which escapes every text.
"""

from __future__ import annotations

import math
from base64 import b64encode
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np

from squeal import __version__
from squeal.errors import ComputationError
from squeal.io.provenance import provenance
from squeal.io.scene import Scene
from squeal.io.system import SystemFile
from squeal.io.writing import Answer, Column, Panel, Table, number, picked, write_text
from squeal.linear import UnstableMode
from squeal.queries.check import Check, check
from squeal.queries.eigenvalues import eigenvalues
from squeal.queries.energy import Energy, energy
from squeal.queries.options import Subject
from squeal.queries.sensitivity import sensitivity
from squeal.queries.sweep import eigenvalue_paths
from squeal.queries.thresholds import thresholds
from squeal.results.columns import basis_text
from squeal.results.eigenvalues import Eigenvalues
from squeal.results.sensitivity import Sensitivity
from squeal.results.sources import PadSource, SystemSource
from squeal.results.sweep import Sweep
from squeal.results.thresholds import Thresholds
from squeal.schema import Positive, public

MOST_STEPS = 25  # of 1 % or a degree: derivatives say nothing of a larger change
MARGIN = 1.1  # the advised change over that which stops the growth by the derivatives
COLUMNS = 3  # modes in the table of terms
CHART = 1.5  # the chart's range over the parameter's own value
VISIBLE = 1e-12  # of a mode's angular frequency: smaller growth rates of terms are rounding
CONFIDENCE = {
    "proved": "No mode is missing from the list: a second program, which shares nothing with the "
    "first, has proved it.",
    "counted": "No mode is missing from the list: their number was counted in a second way.",
    "open": "A mode may be missing from the list: nothing has counted them.",
}


@dataclass(frozen=True, eq=False)
class Remedy:
    """A change of one parameter that stops the fastest mode to first order.

    words: its size; computed: the eigenvalues with the change; harmed: the modes that grow with it
    and did not before; helps: whether the largest growth rate falls, which another mode may
    prevent.
    """

    parameter: str
    before: float
    after: float
    words: str
    computed: Eigenvalues
    harmed: tuple[UnstableMode, ...]
    helps: bool

    @property
    def sentence(self) -> str:
        """What to change, by how much, and what that does."""
        verb = "Raise" if self.after > self.before else "Lower"
        values = f"from {number(self.before, 4)} to {number(self.after, 4)}"
        change = f"{verb} {self.parameter} by {self.words}, {values}"
        sentence = f"{change}. With it: {self.computed.conclusion}."
        if self.harmed:
            hertz = ", ".join(number(mode.frequency_hz, 4) for mode in self.harmed)
            sentence += f" New among what grows: {hertz} Hz."
        elif self.computed.unstable:
            sentence += " No other mode begins to grow."
        return sentence


@dataclass(frozen=True, eq=False, repr=False)
class Report(Answer):
    """What one page says of a brake; `save` writes the page.

    eigenvalues: at the brake's own parameter; thresholds: up to `thresholds.high`; sensitivity: of
    the eigenvalues; onset: sensitivity of the first loss of stability, None where several modes are
    lost at once; check: what the matrices are, None of a scene; energy: what feeds each mode;
    remedy: what to change, None where nothing grows, or no parameter but the swept one is named;
    subject: the scene or system.

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
    remedy: Remedy | None
    subject: Any = field(repr=False)

    @property
    def warnings(self) -> tuple[str, ...]:  # type: ignore[override]
        """What each answer warns of, once."""
        return tuple(dict.fromkeys((*self.eigenvalues.warnings, *self.thresholds.warnings)))

    @property
    def verdict(self) -> str:
        """The verdict in a line."""
        return self.eigenvalues.conclusion

    @property
    def advice(self) -> str:
        """What to change, in a sentence or two."""
        spectrum = self.eigenvalues
        if not spectrum.unstable:
            is_sure = spectrum.certified and spectrum.verdict is not None
            return "Nothing has to change." if is_sure else "Nothing that grows was found."
        sentences = []
        if self.remedy is not None and self.remedy.helps:
            sentences.append(self.remedy.sentence)
        fastest = spectrum.unstable[0]
        if fastest.frequency_hz:
            percent = _rounded(-100.0 * fastest.damping_ratio, 2, math.ceil)
            hertz = number(fastest.frequency_hz, 4)
            sentences.append(f"Give each mode at {hertz} Hz at least {percent} % more damping.")
        first_loss = self.thresholds.first
        if first_loss is not None and first_loss.mu < spectrum.value:
            limit = f"{spectrum.parameter} below {_rounded(first_loss.mu, 4, math.floor)}"
            bound = f"{limit}; it is {number(spectrum.value, 4)}."
            if spectrum.beside:
                sentences.append(f"For modes of {spectrum.extent} alone, keep {bound}")
            else:
                sentences.append(f"Keep {bound}")
        if not sentences:
            return "No way out is known to this page."
        advice = sentences[0]
        for sentence in sentences[1:]:
            advice += f" Or {sentence[0].lower()}{sentence[1:]}"
        return advice

    @property
    def reasons(self) -> list[str]:
        """What feeds the mode that grows fastest, and which parameters do not help."""
        spectrum = self.eigenvalues
        if not spectrum.unstable:
            return []
        lines = []
        mode = spectrum.mode_of(spectrum.unstable[0])
        if mode in self.energy.modes:
            lines.append(f"Why: {self.energy.sentence(mode)}.")
            if self.energy.part_shares:
                lines.append(f"Where its energy is: {self.energy.place(mode)}.")
        if self.remedy is None:
            others = sorted(self.sensitivity.values.keys() - {spectrum.parameter})
            if others:
                names = " or ".join(others)
                lines.append(f"Changing {names} by up to {MOST_STEPS} % does not stop it.")
            else:
                lines.append("No other parameter is named whose change could stop it.")
        elif not self.remedy.helps:
            lines.append(f"What stops it drives another mode. {self.remedy.sentence}")
        if spectrum.beside:
            lines.append(f"This is of {spectrum.extent} alone, and growth outside of it was seen.")
        return lines

    @property
    def loss(self) -> str:
        """The first loss of stability in a line."""
        first = self.thresholds.first
        parameter = self.thresholds.parameter
        where = " within the band" if self.eigenvalues.extent else ""
        if self.thresholds.verdict in ("flutter", "divergence"):
            return f"Unstable from {parameter} = {number(self.thresholds.low, 4)} on"
        if first is None:
            high = number(self.thresholds.high, 4)
            return f"No loss of stability{where} up to {parameter} = {high}"
        line = f"Stability is first lost{where} at {parameter} = {number(first.mu, 4)}: "
        line += first.kind
        if first.frequency_hz:
            line += f" at {number(first.frequency_hz, 4)} Hz"
        return line

    @property
    def margin(self) -> str:
        """How far the brake is from its first loss, in words; empty where none is known."""
        first = self.thresholds.first
        if first is None or first.mu <= 0.0:
            return ""
        value = self.eigenvalues.value
        percent = 100.0 * (value / first.mu - 1.0)
        above_or_below = "above" if percent > 0.0 else "below"
        own_value = f"{self.eigenvalues.parameter} = {number(value, 4)}"
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
        lines = [self.verdict, self.eigenvalues.beside, self.loss, self.margin]
        advice = "\n".join([self.advice, *self.reasons, *self.thresholds.seat])
        return [self.name, "\n".join(filter(None, lines)), self.table(), advice]

    def to_dict(self) -> dict[str, Any]:
        remedy = None
        if self.remedy is not None:
            remedy = picked(self.remedy, "parameter before after helps")
            remedy["verdict_line"] = self.remedy.computed.conclusion
        return {
            "name": self.name,
            "verdict_line": self.verdict,
            "loss_line": self.loss,
            "margin_line": self.margin,
            "advice": self.advice,
            "remedy": remedy,
            **self.energy.to_dict(),
            "eigenvalues": self.eigenvalues.to_dict(),
            "thresholds": self.thresholds.to_dict(),
            **self.sensitivity.to_dict(),
            "onset_sensitivity": self.onset and self.onset.to_dict()["sensitivity"],
            "check": self.check and self.check.to_dict(),
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
    losses = thresholds(subject, high, **options)  # first: it refuses some that the others take
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
        remedy=_remedy(spectrum, of_modes, lambda changed: eigenvalues(changed, **options)),
        subject=subject,
    )


def _remedy(
    spectrum: Eigenvalues,
    derivatives: Sensitivity,
    solve: Callable[[Scene | SystemFile], Eigenvalues],
) -> Remedy | None:
    """The change of one parameter that stops the fastest mode in the fewest steps.

    A step is 1 % of the parameter, or a degree. How many stop the mode follows from the derivatives
    of its eigenvalue, and is taken with the `MARGIN`; the effect is then computed anew.

    Parameters
    ----------
    spectrum : Eigenvalues
        Of the brake as it is.
    derivatives : Sensitivity
        Of these eigenvalues. The parameter that is swept is left out.
    solve : callable
        Gives the eigenvalues of the changed brake.

    Returns
    -------
    Remedy or None
        None where nothing grows, and where no parameter stops the mode within `MOST_STEPS`.
    """
    if not spectrum.unstable:
        return None
    fastest = spectrum.unstable[0]
    index = int(abs(spectrum.values - fastest.root).argmin())
    steps_needed: dict[str, float] = {}  # signed, by parameter
    for name, slopes in derivatives.slopes.items():
        step, _ = derivatives.step(name)
        effect = step * slopes[index].real  # of a step on the growth rate
        if name != spectrum.parameter and math.isfinite(effect) and effect != 0.0:
            steps_needed[name] = -fastest.growth_rate / effect
    if not steps_needed:
        return None
    best = min(steps_needed, key=lambda name: abs(steps_needed[name]))
    count = math.ceil(MARGIN * abs(steps_needed[best]))
    if count > MOST_STEPS:
        return None
    step, words = derivatives.step(best)
    after = derivatives.values[best] + math.copysign(count, steps_needed[best]) * step
    unit = words.removeprefix("1 ")
    if unit == "degree" and count > 1:
        unit = "degrees"
    computed = solve(_replaced(spectrum.source, best, after))
    return Remedy(
        parameter=best,
        before=derivatives.values[best],
        after=after,
        words=f"{count} {unit}",
        computed=computed,
        harmed=tuple(_harmed(spectrum, computed)),
        helps=computed.values.real.max(initial=0.0) < fastest.growth_rate,
    )


def _harmed(before: Eigenvalues, changed: Eigenvalues) -> Iterator[UnstableMode]:
    """The growing modes of a changed brake that did not grow before.

    Each is taken for the mode whose eigenvalue before was the nearest one.
    """
    grew = [before.mode_of(mode) for mode in before.unstable]
    for mode in changed.unstable:
        nearest = np.abs(before.values - mode.root).argmin()
        if before.modes[nearest] not in grew:
            yield mode


def _rounded(value: float, digits: int, towards: Callable[[float], int]) -> str:
    """A positive limit in so many digits, rounded by `towards` (math.floor or math.ceil)."""
    unit = 10.0 ** (math.floor(math.log10(value)) + 1 - digits)
    return number(towards(value / unit) * unit, digits)


def _replaced(
    source: PadSource | SystemSource | None, parameter: str, value: float
) -> Scene | SystemFile:
    """The scene, or the file of a system, with another value of a parameter."""
    if isinstance(source, PadSource):
        return source.scene.replace(**{parameter: value})
    assert source is not None
    return source.file.replaced({parameter: value})


def page(report: Report, inputs: Sequence[Any] = ()) -> str:
    """The page as HTML text; `inputs` are the files behind it."""
    from jinja2 import Environment, PackageLoader, StrictUndefined  # a page alone needs it

    spectrum = report.eigenvalues
    state = "open"  # the CSS class of the headline, which colours it
    if spectrum.unstable:
        state = "grows"
    elif spectrum.certified:
        state = "stable"
    loader = PackageLoader("squeal")
    template = Environment(loader=loader, autoescape=True, undefined=StrictUndefined)
    text = template.get_template("report.html").render(
        report=report,
        state=state,
        numbering=_numbering(spectrum),
        chart=_figure(_chart(report), report.name, damping=True),
        feeds=_feeds(report),
        moves=_effects_on_growing(report),
        onset=None if report.onset is None else number(report.onset.at or math.nan, 4),
        shapes=list(_shapes(report)),
        confidence=list(_confidence(report)),
        open=list(_not_answered(report)),
        read=list(_what_was_read(report)),
        sure=list(_evidence(report)),
        footer=_footer(inputs),
    )
    # a name may hold control characters, which HTML does not allow
    return "".join(c for c in text if c.isprintable() or c == "\n") + "\n"


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
    if high <= searched.low:
        high = searched.high
    return eigenvalue_paths(searched, searched.low, high)


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
            rows.setdefault(term, {})[mode] = contribution.growth
    columns = [Column("term", value=itemgetter(0))]
    for mode in modes:
        head = f"mode {mode}, {number(hertz[mode], 4)} Hz"
        columns.append(Column(head, words=head, shown=_growth_of(mode)))
    return Table(columns, list(rows.items()))


def _growth_of(mode: int) -> Callable[[Any], str]:
    """The cell of a mode in a row of `_feeds`: a growth rate with its sign, "" where there is
    none."""
    return lambda row: f"{row[1][mode]:+.4g}" if mode in row[1] else ""


def _effects_on_growing(report: Report) -> Table:
    """What a small change of each parameter does to the modes that grow."""
    table = report.sensitivity.table()
    modes = _growing(report)
    return replace(table, rows=[row for row in table.rows if row.mode in modes])


def _confidence(report: Report) -> Iterator[str]:
    """How sure the page is, in sentences that need no mathematics."""
    spectrum = report.eigenvalues
    status = "counted" if spectrum.certified else "open"
    if spectrum.proof:
        status = spectrum.proof.get("status") or status
    yield CONFIDENCE[status]
    proof_of_thresholds = report.thresholds.proof or {}
    if report.thresholds.certified or proof_of_thresholds.get("status") == "proved":
        yield "No onset is missing from the list, as far as the count goes."
    else:
        yield "Another onset than the listed ones may exist."
    if report.remedy is not None:
        yield "The change above was computed anew, not extrapolated."
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
    yield from (head, files, f"{lines}\n{modes}\n{hints}")


def _shapes(report: Report) -> Iterator[_Figure]:
    """One figure: all shapes of a pad, or that of a system's fastest mode; none without nodes."""
    spectrum = report.eigenvalues
    if isinstance(report.subject, Scene):
        yield _figure(spectrum, report.name)
    elif getattr(report.subject, "coordinates", None) is not None:
        for mode in _growing(report)[:1]:
            yield _figure(spectrum, report.name, shape=mode)


def _evidence(report: Report) -> Iterator[str]:
    """Sentences on what proves the answers."""
    spectrum = report.eigenvalues
    where = f" on {spectrum.extent}" if spectrum.extent else ""
    if spectrum.details.get("basis"):
        yield f"{basis_text(spectrum.details['basis'], errors=True)}."
    yield f"{len(spectrum.eigenvalues)} roots{where}: {spectrum.completeness}."
    if spectrum.open:
        yield f"The {spectrum.open}."
    worst = max((root.residual for root in spectrum.eigenvalues), default=math.nan)
    if math.isfinite(worst):
        yield f"The largest backward error of a listed root is {worst:.2g}."
    notes_of_thresholds = report.thresholds.parts()[-1]
    yield from str(notes_of_thresholds).splitlines()


def _not_answered(report: Report) -> Iterator[str]:
    """Sentences on what the answers do not speak of."""
    spectrum = report.eigenvalues
    if spectrum.extent:
        exception = ", but for the growth that was seen there" if spectrum.beside else ""
        yield f"Roots outside of {spectrum.extent}{exception}."
    limit = spectrum.details.get("growth_limit")
    if limit is not None:
        yield f"Roots that grow by more than {number(limit, 4)} 1/s."
    yield from spectrum.notes[1:]
    if report.sensitivity.note:
        yield f"{report.sensitivity.note}."
    low = number(report.thresholds.low)
    high = number(report.thresholds.high)
    yield f"Values of {report.thresholds.parameter} outside of {low} to {high}."
    yield "Other values of the other parameters: `squeal scatter` draws them from ranges."
    yield (
        "Motion of finite size: this is linear stability of steady sliding. Lost contact, limit "
        "cycles and loudness need a simulation."
    )
