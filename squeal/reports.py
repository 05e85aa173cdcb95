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
    """A change of one parameter that stops the fastest mode to first order; `computed` are the
    eigenvalues with it, `harmed` the modes that grow with it alone; `helps`: the largest growth
    rate falls, which another mode may prevent."""

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
        way = "Raise" if self.after > self.before else "Lower"
        values = f"from {number(self.before, 4)} to {number(self.after, 4)}"
        change = f"{way} {self.parameter} by {self.words}, {values}"
        sentence = f"{change}. With it: {self.computed.conclusion}."
        if self.harmed:
            hertz = ", ".join(number(mode.frequency_hz, 4) for mode in self.harmed)
            sentence += f" New among what grows: {hertz} Hz."
        elif self.computed.unstable:
            sentence += " No other mode begins to grow."
        return sentence


@dataclass(frozen=True, eq=False, repr=False)
class Report(Answer):
    """Eigenvalues at the brake's own parameter, thresholds up to `thresholds.high`, and what moves
    both, `onset` the first loss (None where several modes are lost at once); `check` says what
    matrices are, `energy` what feeds each mode, `remedy` what to change (None where nothing grows,
    or no parameter but the swept one is named). `save` writes the page.

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
        found = self.eigenvalues
        if not found.unstable:
            is_sure = found.certified and found.verdict is not None
            return "Nothing has to change." if is_sure else "Nothing that grows was found."
        ways = []
        if self.remedy is not None and self.remedy.helps:
            ways.append(self.remedy.sentence)
        fastest = found.unstable[0]
        if fastest.frequency_hz:
            percent = _rounded(-100.0 * fastest.damping_ratio, 2, math.ceil)
            hertz = number(fastest.frequency_hz, 4)
            ways.append(f"Give each mode at {hertz} Hz at least {percent} % more damping.")
        first_loss = self.thresholds.first
        if first_loss is not None and first_loss.mu < found.value:
            limit = f"{found.parameter} below {_rounded(first_loss.mu, 4, math.floor)}"
            keep = f"Keep {limit}; it is {number(found.value, 4)}."
            if found.beside:
                keep = f"For modes of {found.extent} alone, k{keep[1:]}"
            ways.append(keep)
        if not ways:
            return "No way out is known to this page."
        advice = ways[0]
        for way in ways[1:]:
            advice += f" Or {way[0].lower()}{way[1:]}"
        return advice

    @property
    def reasons(self) -> list[str]:
        """What feeds the mode that grows fastest, and which parameters do not help."""
        found = self.eigenvalues
        if not found.unstable:
            return []
        lines = []
        mode = found.mode_of(found.unstable[0])
        if mode in self.energy.modes:
            lines.append(f"Why: {self.energy.sentence(mode)}.")
            if self.energy.part_shares:
                lines.append(f"Where its energy is: {self.energy.place(mode)}.")
        if self.remedy is None:
            others = sorted(self.sensitivity.values.keys() - {found.parameter})
            if others:
                names = " or ".join(others)
                lines.append(f"Changing {names} by up to {MOST_STEPS} % does not stop it.")
            else:
                lines.append("No other parameter is named whose change could stop it.")
        elif not self.remedy.helps:
            lines.append(f"What stops it drives another mode. {self.remedy.sentence}")
        if found.beside:
            lines.append(f"This is of {found.extent} alone, and growth outside of it was seen.")
        return lines

    @property
    def loss(self) -> str:
        """The first loss of stability in a line."""
        found = self.thresholds
        first = found.first
        parameter = found.parameter
        where = " within the band" if self.eigenvalues.extent else ""
        if found.verdict in ("flutter", "divergence"):
            return f"Unstable from {parameter} = {number(found.low, 4)} on"
        if first is None:
            return f"No loss of stability{where} up to {parameter} = {number(found.high, 4)}"
        line = f"Stability is first lost{where} at {parameter} = {number(first.mu, 4)}: "
        line += first.kind
        if first.frequency_hz:
            line += f" at {number(first.frequency_hz, 4)} Hz"
        return line

    @property
    def margin(self) -> str:
        """How far the brake is from its first loss, in words; empty where none is known."""
        first = self.thresholds.first
        found = self.eigenvalues
        if first is None or first.mu <= 0.0:
            return ""
        percent = 100.0 * (found.value / first.mu - 1.0)
        side = "above" if percent > 0.0 else "below"
        here = f"{found.parameter} = {number(found.value, 4)}"
        return f"{here} lies {number(abs(percent), 3)} % {side} that."

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
    """Ask a brake all that one page shows.

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
    crossed = thresholds(subject, high, **options)  # it refuses what the others take
    found = eigenvalues(subject, **options)
    of_modes = sensitivity(subject, known=found)
    of_onset = None
    with suppress(ComputationError):  # several modes are lost at once
        of_onset = sensitivity(subject, of="threshold", known=crossed)
    return Report(
        name=found.name,
        eigenvalues=found.with_onsets(crossed),
        thresholds=crossed,
        sensitivity=of_modes,
        onset=of_onset,
        check=None if isinstance(subject, Scene) else check(subject),
        energy=energy(found, parts),
        remedy=_remedy(found, of_modes, lambda changed: eigenvalues(changed, **options)),
        subject=subject,
    )


def _remedy(
    found: Eigenvalues,
    moved: Sensitivity,
    solve: Callable[[Scene | SystemFile], Eigenvalues],
) -> Remedy | None:
    """The change of one parameter that stops the fastest mode in the fewest steps of 1 % or a
    degree, by the derivatives of its eigenvalue; `solve` gives the eigenvalues with it.

    The swept parameter is left out. None where nothing grows, and where none stops it within
    `MOST_STEPS`.
    """
    if not found.unstable:
        return None
    fastest = found.unstable[0]
    index = int(abs(found.values - fastest.root).argmin())
    steps: dict[str, float] = {}  # of each parameter, which stop the mode
    for name, slopes in moved.slopes.items():
        step, _ = moved.step(name)
        effect = step * slopes[index].real  # of a step on the growth rate
        if name != found.parameter and math.isfinite(effect) and effect != 0.0:
            steps[name] = -fastest.growth_rate / effect
    if not steps:
        return None
    best = min(steps, key=lambda name: abs(steps[name]))
    fewest = steps[best]
    count = math.ceil(MARGIN * abs(fewest))
    if count > MOST_STEPS:
        return None
    step, words = moved.step(best)
    after = moved.values[best] + math.copysign(count, fewest) * step
    unit = words.removeprefix("1 ")
    if unit == "degree" and count > 1:
        unit = "degrees"
    computed = solve(_replaced(found.source, best, after))
    return Remedy(
        parameter=best,
        before=moved.values[best],
        after=after,
        words=f"{count} {unit}",
        computed=computed,
        harmed=tuple(_harmed(found, computed)),
        helps=computed.values.real.max(initial=0.0) < fastest.growth_rate,
    )


def _harmed(found: Eigenvalues, changed: Eigenvalues) -> Iterator[UnstableMode]:
    """The growing modes of a changed brake of which the nearest one did not grow before."""
    grew = [found.mode_of(mode) for mode in found.unstable]
    for mode in changed.unstable:
        if found.modes[np.abs(found.values - mode.root).argmin()] not in grew:
            yield mode


def _rounded(value: float, digits: int, towards: Callable[[float], int]) -> str:
    """A positive limit in so many digits, rounded to the side where it still holds."""
    unit = 10.0 ** (math.floor(math.log10(value)) + 1 - digits)
    return number(towards(value / unit) * unit, digits)


def _replaced(
    source: PadSource | SystemSource | None, parameter: str, value: float
) -> Scene | SystemFile:
    """The scene or the file of a system with another value of a parameter."""
    if isinstance(source, PadSource):
        return source.scene.replace(**{parameter: value})
    assert source is not None
    return source.file.replaced({parameter: value})


def page(report: Report, inputs: Sequence[Any] = ()) -> str:
    """The page as text; `inputs` are the files behind it."""
    from jinja2 import Environment, PackageLoader, StrictUndefined  # a page alone needs it

    found = report.eigenvalues
    state = "open"  # the class of the headline, which has its colour
    if found.unstable:
        state = "grows"
    elif found.certified:
        state = "stable"
    loader = PackageLoader("squeal")
    template = Environment(loader=loader, autoescape=True, undefined=StrictUndefined)
    text = template.get_template("report.html").render(
        report=report,
        state=state,
        numbering=_numbering(found),
        chart=_figure(_chart(report), report.name, damping=True),
        feeds=_feeds(report),
        moves=_moved(report),
        onset=None if report.onset is None else number(report.onset.at or math.nan, 4),
        shapes=list(_shapes(report)),
        confidence=list(_confidence(report)),
        open=list(_open(report)),
        read=list(_read(report)),
        sure=list(_sure(report)),
        footer=_footer(inputs),
    )
    # a name may hold anything
    return "".join(c for c in text if c.isprintable() or c == "\n") + "\n"


def _numbering(found: Eigenvalues) -> str:
    """What the number of a mode counts."""
    if found.extent:
        return f"Modes are numbered by rising frequency within {found.extent}."
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
    """A picture as the page holds it, and its alternative text."""

    code: str
    alternative: str


def _figure(answer: Answer, name: str, **more: Any) -> _Figure:
    from squeal.plots.answers import drawing  # here, since a report without a page draws nothing
    from squeal.plots.style import rendered

    made = drawing(answer, name, **more)
    return _Figure(b64encode(rendered(made, "png", 150)).decode(), made.alternative)


def _chart(report: Report) -> Sweep:
    """The eigenvalue paths up to a little more than the parameter's own value."""
    crossed = report.thresholds
    high = min(CHART * report.eigenvalues.value, crossed.high)
    if high <= crossed.low:
        high = crossed.high
    return eigenvalue_paths(crossed, crossed.low, high)


def _growing(report: Report) -> list[int]:
    """Numbers of the modes that grow, the fastest first, as many as the tables show."""
    found = report.eigenvalues
    numbers = [found.mode_of(mode) for mode in found.unstable]
    return [mode for mode in numbers if mode is not None][:COLUMNS]


def _feeds(report: Report) -> Table:
    """A row for each term, a column for each mode that grows, and their sums."""
    modes = _growing(report)
    hertz: dict[int, float] = {}
    rows: dict[str, dict[int, float]] = {}  # a term that feeds none of these modes has none
    for one in report.energy.contributions:
        if one.mode not in modes:
            continue
        hertz[one.mode] = one.frequency_hz
        rounding = VISIBLE * math.tau * one.frequency_hz
        if one.growth is not None and abs(one.growth) > rounding:
            term = one.term if one.term == one.role else f"{one.term} ({one.role})"
            rows.setdefault(term, {})[one.mode] = one.growth
    columns = [Column("term", value=itemgetter(0))]
    for mode in modes:
        head = f"mode {mode}, {number(hertz[mode], 4)} Hz"
        columns.append(Column(head, words=head, shown=_growth_of(mode)))
    return Table(columns, list(rows.items()))


def _growth_of(mode: int) -> Callable[[Any], str]:
    """The cell of a mode in a row of `_feeds`: a growth rate with its sign, "" where there is
    none."""
    return lambda row: f"{row[1][mode]:+.4g}" if mode in row[1] else ""


def _moved(report: Report) -> Table:
    """What a small change of each parameter does to the modes that grow."""
    table = report.sensitivity.table()
    modes = _growing(report)
    return replace(table, rows=[row for row in table.rows if row[0] in modes])


def _confidence(report: Report) -> Iterator[str]:
    """How sure the page is, in words that need no mathematics."""
    found = report.eigenvalues
    crossed = report.thresholds
    status = "counted" if found.certified else "open"
    if found.proof:
        status = found.proof.get("status") or status
    yield CONFIDENCE[status]
    if crossed.certified or (crossed.proof or {}).get("status") == "proved":
        yield "No onset is missing from the list, as far as the count goes."
    else:
        yield "Another onset than the listed ones may exist."
    if report.remedy is not None:
        yield "The change above was computed anew, not extrapolated."
    if found.open:
        yield f"The {found.open}."


def _read(report: Report) -> Iterator[str | Table]:
    """What matrices or a scene are."""
    if report.check is None:
        yield from report.eigenvalues.notes[:1]
        return
    head, files, lines, _, hints = report.check.parts()
    hertz = ", ".join(number(f) for f in report.check.frequencies_hz)
    modes = f"lowest real modes, without friction and damping: {hertz} Hz"
    yield from (head, files, f"{lines}\n{modes}\n{hints}")


def _shapes(report: Report) -> Iterator[_Figure]:
    """The shape of the mode that grows fastest, where the places of the rows are known; a pad's
    are all in one figure."""
    found = report.eigenvalues
    if isinstance(report.subject, Scene):
        yield _figure(found, report.name)
    elif getattr(report.subject, "coordinates", None) is not None:
        for mode in _growing(report)[:1]:
            yield _figure(found, report.name, shape=mode)


def _sure(report: Report) -> Iterator[str]:
    """What proves the answers."""
    found = report.eigenvalues
    where = f" on {found.extent}" if found.extent else ""
    if found.details.get("basis"):
        yield f"{basis_text(found.details['basis'], True)}."
    yield f"{len(found.eigenvalues)} roots{where}: {found.completeness}."
    if found.open:
        yield f"The {found.open}."
    worst = max((root.residual for root in found.eigenvalues), default=math.nan)
    if math.isfinite(worst):
        yield f"The largest backward error of a listed root is {worst:.2g}."
    yield from str(report.thresholds.parts()[-1]).splitlines()


def _open(report: Report) -> Iterator[str]:
    """What the answers do not speak of."""
    found = report.eigenvalues
    crossed = report.thresholds
    if found.extent:
        seen = ", but for the growth that was seen there" if found.beside else ""
        yield f"Roots outside of {found.extent}{seen}."
    limit = found.details.get("growth_limit")
    if limit is not None:
        yield f"Roots that grow by more than {number(limit, 4)} 1/s."
    yield from found.notes[1:]
    if report.sensitivity.note:
        yield f"{report.sensitivity.note}."
    searched = f"{number(crossed.low)} to {number(crossed.high)}"
    yield f"Values of {crossed.parameter} outside of {searched}."
    yield "Other values of the other parameters: `squeal scatter` draws them from ranges."
    yield (
        "Motion of finite size: this is linear stability of steady sliding. Lost contact, limit "
        "cycles and loudness need a simulation."
    )
