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

from squeal import __version__
from squeal.errors import ComputationError, InputError
from squeal.io.provenance import provenance
from squeal.io.scene import Scene
from squeal.io.writing import Answer, Column, Panel, Table, number, picked, write_text
from squeal.linear import GROWING, CriticalPoint, UnstableMode
from squeal.linear.shaft import speed_words
from squeal.queries.check import Check, check
from squeal.queries.critical_speeds import CriticalSpeeds, critical_speeds
from squeal.queries.eigenvalues import eigenvalues
from squeal.queries.energy import Energy, energy
from squeal.queries.options import Subject, upper_end
from squeal.queries.remedies import Remedy, RemedySearch, find_remedy, partner_of, rounded
from squeal.queries.sensitivity import sensitivity
from squeal.queries.sweep import eigenvalue_paths
from squeal.queries.systems.all_roots import is_small
from squeal.queries.thresholds import thresholds
from squeal.queries.whirl import BACKWARD, FORWARD
from squeal.results.columns import basis_text
from squeal.results.eigenvalues import Eigenvalues
from squeal.results.sensitivity import Sensitivity
from squeal.results.sources import unit_of
from squeal.results.sweep import Sweep
from squeal.results.thresholds import Thresholds
from squeal.schema import Positive, public

COLUMNS = 3  # modes in the table of terms
NAMED = 3  # modes or parameters in a sentence
MOST_SPEEDS = 6  # critical speeds in a sentence
TIMES = 3.0  # from which on a value is so many times another one, not so many % above it
NOISE = 1e-3  # of the strongest effect: weaker ones are noise to a reader, and left out
OF_CONTACT = {"contact", "tangential"}  # parameters of an exported or joined brake
HINT = (
    "To see what a part can do, name its stiffness or a shim as a parameter in the system file: "
    "docs/page.md shows how."
)
CHART = 1.5  # the chart's range over the parameter's own value
VISIBLE = 1e-12  # of a mode's angular frequency: smaller growth rates of terms are rounding
CONFIDENCE = {
    "proved": "No mode is missing from the list: a second program, which shares nothing with the "
    "first, has proved it.",
    "counted": "No mode is missing from the list: their number was counted in a second way.",
    "open": "A mode may be missing from the list: nothing has counted them.",
}


@dataclass(frozen=True, eq=False, repr=False)
class Report(Answer):
    """What one page says of a brake; `save` writes the page.

    eigenvalues: at the brake's own parameter; thresholds: up to `thresholds.high`; sensitivity: of
    the eigenvalues; onset: sensitivity of the first loss of stability, None where several modes are
    lost at once; check: what the matrices are, None of a scene; energy: what feeds each mode;
    search: the change that stops all modes that grow, and what other parameters do to these;
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
    subject: Any = field(repr=False)
    critical: CriticalSpeeds | None = None

    @property
    def warnings(self) -> tuple[str, ...]:  # type: ignore[override]
        """What each answer warns of, once."""
        return tuple(dict.fromkeys((*self.eigenvalues.warnings, *self.thresholds.warnings)))

    @property
    def verdict(self) -> str:
        """The verdict in a line."""
        return self.eigenvalues.conclusion

    @property
    def remedy(self) -> Remedy | None:
        """The least change of one parameter with which nothing grows, None if none is known."""
        return self.search.remedy

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
        measures = []
        if self.remedy is not None:
            measures.append(self.remedy.sentence)
        measures.append(self._more_damping())
        measures.append(self._bound())
        measures = list(filter(None, measures))
        if not measures:
            return ["No way out is known to this page."]
        aim = ""
        count = len(spectrum.unstable)
        if count > 1:
            aim = "to stop both" if count == 2 else f"to stop all {count}"
        if spectrum.beside or self._is_of_band_alone():
            aim = f"for {spectrum.extent} alone, {aim}".rstrip(", ")
        first = measures[0]
        if aim:
            first = f"{aim[0].upper()}{aim[1:]}: {first[0].lower()}{first[1:]}"
        ways = [first]
        for measure in measures[1:]:
            ways.append(f"Or {measure[0].lower()}{measure[1:]}")
        return ways

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
        if self._is_of_band_alone() and not spectrum.beside:
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

    def _more_damping(self) -> str:
        """The damping that stops all modes that grow; empty if one of them does not oscillate."""
        spectrum = self.eigenvalues
        if not all(mode.frequency_hz for mode in spectrum.unstable):
            return ""
        shares = []
        of_pairs = False
        for mode in spectrum.unstable[:NAMED]:
            percent = rounded(-100.0 * mode.damping_ratio, 2, math.ceil)
            partner = self._partner(mode)
            name = self._name(mode)
            if partner is not None:
                of_pairs = True
                pair = sorted([partner, spectrum.mode_of(mode) or 0])
                hertz = number(mode.frequency_hz, 4)
                name = f"both modes {pair[0]} and {pair[1]} ({hertz} Hz)"
            shares.append(f"{name} at least {percent} %")
        shares[0] += " of critical damping more"
        text = "Give " + ", ".join(shares)
        more = len(spectrum.unstable) - NAMED
        if more > 0:
            text += f", and {more} more modes what the table lists"
        if of_pairs:
            text += "; as much on one mode of a pair alone is not enough"
        return f"{text}."

    def _bound(self) -> str:
        """Which values of the parameter nothing grows at; empty if stability is lost later."""
        spectrum = self.eigenvalues
        first = self.thresholds.first
        if first is None or first.mu >= spectrum.value or self.thresholds.verdict in GROWING:
            return ""
        limit = rounded(first.mu, 4, math.floor)
        words = speed_words(float(limit), unit_of(spectrum.source))
        bound = f"{spectrum.parameter} below {limit}{words}"
        return f"Keep {bound}; it is {number(spectrum.value, 4)}."

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

    def _meeting(self, mode: UnstableMode) -> str:
        """The mode with which a growing one couples, and from where on; empty if there is none."""
        partner = self._partner(mode)
        if partner is None:
            return ""
        lower, upper = sorted([partner, self.eigenvalues.mode_of(mode) or 0])
        words = f"modes {lower} and {upper} come together and feed each other"
        if mode.onset is not None:
            words += f" from {self._at(mode.onset)} on"
        return f"{words}; "

    @property
    def reasons(self) -> list[str]:
        """What feeds the mode that grows fastest, and which parameters do not help."""
        spectrum = self.eigenvalues
        if not spectrum.unstable:
            return []
        lines = []
        fastest = spectrum.unstable[0]
        mode = spectrum.mode_of(fastest)
        if mode in self.energy.modes:
            lines.append(f"Why: {self._meeting(fastest)}{self.energy.sentence(mode)}.")
            if self.energy.part_shares:
                lines.append(f"Where its energy is: {self.energy.place(mode)}.")
        if self.remedy is None:
            lines += self._effects()
            named = {effect.parameter for effect in self.search.effects}
            if named <= OF_CONTACT:
                lines.append(HINT)
        return lines

    def _effects(self) -> Iterator[str]:
        """What the parameters do that cannot stop all that grows, a sentence each."""
        modes = self.eigenvalues.unstable
        without_effect: dict[str, list[str]] = {}  # parameters, by how far they were changed
        for effect in self.search.effects:
            stopped = []
            for mode, change in zip(modes[1:], effect.stops[1:], strict=True):
                if change is not None:
                    words = f"{change.doing} it by about {change.about}"
                    stopped.append(f"{words} stops {self._name(mode)}")
            first = effect.stops[0]
            if first is not None:
                text = f"{first.doing.capitalize()} {effect.parameter} by about {first.about}"
                text += f" stops {self._name(modes[0])}"
                hertz = ", ".join(number(frequency, 4) for frequency in effect.left[:NAMED])
                yield f"{text}, but not what grows at {hertz} Hz." if hertz else f"{text} alone."
            elif stopped:
                text = f"Changing {effect.parameter} by up to {effect.limit} does not stop "
                yield f"{text}{self._name(modes[0])}; {', '.join(stopped[:NAMED])}."
            else:
                without_effect.setdefault(effect.limit, []).append(effect.parameter)
        for limit, names in without_effect.items():
            text = f"Changing {' or '.join(sorted(names))} by up to {limit}"
            if len(modes) == 1:
                yield f"{text} does not stop {self._name(modes[0])}."
            else:
                yield f"{text} stops none of these modes."

    @property
    def conflicts(self) -> str:
        """Which parameters help the fastest mode and harm the first loss, or the other way round;
        empty if none does."""
        spectrum = self.eigenvalues
        if self.onset is None or not spectrum.unstable:
            return ""
        fastest = spectrum.unstable[0]
        index = int(abs(spectrum.values - fastest.root).argmin())
        sentences = []
        strongest = _strongest_of(self.onset)
        for name, slopes in self.onset.slopes.items():
            of_loss = float(slopes[0]) * self.onset.step(name)[0]
            of_growth = 0.0
            if name in self.sensitivity.slopes:
                of_growth = float(self.sensitivity.slopes[name][index].real)
            of_growth *= self.sensitivity.step(name)[0] if of_growth else 1.0
            is_noise = abs(of_loss) <= NOISE * strongest
            if name == spectrum.parameter or is_noise or not of_loss * of_growth > 0.0:
                continue
            mode = f"mode {spectrum.mode_of(fastest)}"
            if of_loss > 0.0:
                sentences.append(f"Raising {name} moves the onset up, but drives {mode}.")
            else:
                sentences.append(f"Raising {name} slows {mode}, but moves the onset down.")
        return " ".join(sentences[:NAMED])

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
        lines = [self.verdict, self.eigenvalues.beside, self.loss, self.margin, self.critical_line]
        advice = "\n".join([self.advice, *self.reasons, *self.thresholds.seat])
        return [self.name, "\n".join(filter(None, lines)), self.table(), advice]

    def to_dict(self) -> dict[str, Any]:
        remedy = None
        if self.remedy is not None:
            change = self.remedy.change
            remedy = picked(change, "parameter before after")
            remedy["verdict_line"] = self.remedy.computed.conclusion
            remedy["first_loss"] = self.remedy.loss._asdict()
            remedy["best"] = None
            if self.remedy.best is not None and self.remedy.best_loss is not None:
                best_loss = self.remedy.best_loss._asdict()
                remedy["best"] = {"after": self.remedy.best.after, "first_loss": best_loss}
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
        search=find_remedy(spectrum, of_modes, end, options),
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
        moves=_effects_on_growing(report),
        moves_onset=_effects_on_onset(report),
        abaqus=_abaqus_ratio(spectrum),
        shapes=list(_shapes(report)),
        confidence=list(_confidence(report)),
        open=list(_not_answered(report)),
        read=list(_what_was_read(report)),
        sure=list(_evidence(report)),
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


def _strongest_of(moved: Sensitivity) -> float:
    """The largest change of the first loss by a step of a parameter."""
    changes = [abs(slopes[0] * moved.step(name)[0]) for name, slopes in moved.slopes.items()]
    return float(max(filter(math.isfinite, changes), default=0.0))


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


def _effects_on_growing(report: Report) -> Table:
    """What a small change of each parameter does to the modes that grow, without noise."""
    table = report.sensitivity.table()
    modes = _growing(report)
    strongest: dict[int, float] = {}
    for row in table.rows:
        strongest[row.mode] = max(strongest.get(row.mode, 0.0), abs(row.growth_change))
    rows = []
    for row in table.rows:
        is_noise = abs(row.growth_change) <= NOISE * strongest[row.mode]  # false of NaN
        if row.mode in modes and not is_noise:
            rows.append(row)
    return replace(table, rows=rows)


def _effects_on_onset(report: Report) -> Table | None:
    """What a small change of each parameter does to the first loss, the strongest first, without
    noise; None where that is not known."""
    onset = report.onset
    if onset is None or not onset.slopes:
        return None
    table = onset.table()
    strongest = _strongest_of(onset)
    rows = [row for row in table.rows if not abs(row[2]) <= NOISE * strongest]
    positions = {id(row): -k for k, row in enumerate(rows)}
    return replace(table, rows=rows, rank=lambda row: positions[id(row)])


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
