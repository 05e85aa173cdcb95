"""One page about a brake: what was read, what grows, since when, moved by what, and how sure.

The page is one HTML file that needs no other, for a screen or a printer.
"""

from __future__ import annotations

import math
from base64 import b64encode
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from html import escape
from pathlib import Path
from typing import Any

from squeal import __version__
from squeal.errors import ComputationError
from squeal.io.provenance import provenance
from squeal.io.scene import Scene
from squeal.io.writing import Answer, Panel, Table, number, write_text
from squeal.queries.check import Check, check
from squeal.queries.eigenvalues import eigenvalues
from squeal.queries.options import Subject
from squeal.queries.sensitivity import sensitivity
from squeal.queries.thresholds import thresholds
from squeal.results.columns import basis_text
from squeal.results.eigenvalues import Eigenvalues
from squeal.results.sensitivity import Sensitivity
from squeal.results.thresholds import Thresholds
from squeal.schema import Positive, public

SHAPES = 3  # modes whose shapes are drawn
OPPOSED = (
    "This table, as `squeal advise`, says where instability begins; that of growth rates says how "
    "fast it grows at the brake's own value. A change may help the one and harm the other."
)

STYLE = """
:root { color-scheme: light dark; --ink: #1b1b1b; --paper: #fff; --rule: #ccc; --soft: #f3f3f3; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e6e6e6; --paper: #161616; --rule: #444; --soft: #222; }
  figure { background: #fff; color: #000; padding: .5em; }
}
body { font: 15px/1.45 system-ui, sans-serif; color: var(--ink); background: var(--paper);
  max-width: 60em; margin: 1.5em auto; padding: 0 1em; }
h1 { font-size: 1.5em; margin-bottom: .3em; }
h2 { font-size: 1.15em; margin-top: 1.8em; border-bottom: 1px solid var(--rule); }
.verdict { font-size: 1.15em; font-weight: 600; padding: .6em .8em; border-left: .5em solid #777;
  background: var(--soft); margin: .5em 0; }
.grows { border-color: #c8380e; }
.stable { border-color: #2a7a3b; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; margin: .6em 0; }
th, td { padding: .2em .7em; border-bottom: 1px solid var(--rule); text-align: right; }
th:first-child, td:first-child { text-align: left; }
figure { margin: 1em 0; }
figure img { max-width: 100%; height: auto; }
footer { font-size: .85em; overflow-wrap: anywhere; }
pre { white-space: pre-wrap; font-size: .85em; }
@media print { body { max-width: none; margin: 0; } h2 { break-after: avoid; }
  figure, table { break-inside: avoid; } }
"""


@dataclass(frozen=True, eq=False, repr=False)
class Report(Answer):
    """Eigenvalues at the brake's own parameter, thresholds up to `thresholds.high`, and what moves
    both, `onset` the first loss (None where several modes are lost at once); `check` says what
    matrices are. `save` writes the page."""

    panel = Panel("frequency_hz", "growth_rate")

    name: str
    eigenvalues: Eigenvalues
    thresholds: Thresholds
    sensitivity: Sensitivity
    onset: Sensitivity | None
    check: Check | None
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
    def loss(self) -> str:
        """The first loss of stability in a line."""
        found, where = self.thresholds, " within the band" * bool(self.eigenvalues.extent)
        own, first = found.parameter, found.first
        if found.verdict in ("flutter", "divergence"):
            return f"Unstable from {own} = {number(found.low, 4)} on"
        if first is None:
            return f"No loss of stability{where} up to {own} = {number(found.high, 4)}"
        at = f" at {number(first.frequency_hz, 4)} Hz" if first.frequency_hz else ""
        return f"Stability is first lost{where} at {own} = {number(first.mu, 4)}: {first.kind}{at}"

    def table(self) -> Table:
        """The modes that grow."""
        return self.eigenvalues.growing

    def parts(self) -> Sequence[str | Table]:
        lines = self.verdict, self.eigenvalues.beside, self.loss
        return [self.name, "\n".join(filter(None, lines)), self.table()]

    def to_dict(self) -> dict[str, Any]:
        head = {"name": self.name, "verdict_line": self.verdict, "loss_line": self.loss}
        return head | {
            "eigenvalues": self.eigenvalues.to_dict(),
            "thresholds": self.thresholds.to_dict(),
            **self.sensitivity.to_dict(),
            "onset_sensitivity": self.onset and self.onset.to_dict()["sensitivity"],
            "check": self.check and self.check.to_dict(),
        }

    def save(self, path: Path | str, inputs: Sequence[Any] = (), **drawn: Any) -> None:
        """Write the page as one HTML file (.html) without references to others; `inputs` are the
        files behind it. With another name the modes that grow, as other answers do. Raises
        InputError."""
        path = Path(path)
        if path.suffix == ".html":
            write_text(path, page(self, inputs))
        else:
            super().save(path, **drawn)


@public
def report(
    subject: Subject,
    high: float = 2.0,
    band: tuple[float, float] | None = None,
    memory: Positive | None = None,
    progress: Callable[[str], None] | None = None,
) -> Report:
    """Ask a brake all that one page shows.

    Parameters
    ----------
    subject : Scene, SystemFile or TermSystem
        A system of more than 400 rows needs a band.
    high : float
        Upper end of the range of the friction or of the free parameter.
    band : (float, float), optional
        Lowest and highest frequency in Hz, of systems.
    memory, progress
        As `eigenvalues` takes them.

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
    asked: Any = {"band": band, "memory": memory, "progress": progress}
    crossed = thresholds(subject, high, **asked)  # it refuses what the others take
    found = eigenvalues(subject, **asked)
    moved, onset = sensitivity(subject, known=found), None
    with suppress(ComputationError):  # several modes are lost at once
        onset = sensitivity(subject, of="threshold", known=crossed)
    read = None if isinstance(subject, Scene) else check(subject)
    return Report(found.name, found.with_onsets(crossed), crossed, moved, onset, read, subject)


def page(report: Report, inputs: Sequence[Any] = ()) -> str:
    """The page as text; `inputs` are the files behind it."""
    found, crossed = report.eigenvalues, report.thresholds
    ends = {"high": crossed.high} if isinstance(report.subject, Scene) else {}
    grows = "grows" if found.unstable else "stable" if found.certified else "open"
    parts = [
        f"<h1>{escape(report.name)}</h1>",
        f'<p class="verdict {grows}">{escape(report.verdict)}</p>',
        f"<p>{escape(found.beside)}</p>" * bool(found.beside),
        f"<p>{escape(report.loss)}</p>",
        _table(found.growing),
        f"<h2>Frequencies and growth rates over {escape(crossed.parameter)}</h2>",
        _figure(crossed, report.name, **ends),
        _table(crossed.table()),
    ]
    if shapes := list(_shapes(report)):
        parts += ["<h2>Mode shapes</h2>", *shapes]
    if found.unstable:
        parts += ["<h2>What moves the growth rates</h2>", _table(_moved(report))]
    if report.onset is not None and report.onset.slopes:
        parts += ["<h2>What moves the onset</h2>", _table(report.onset.table())]
        parts.append(f"<p>{escape(OPPOSED)}</p>")
    parts += ["<h2>What was read</h2>", *map(_part, _read(report))]
    parts += ["<h2>How sure this is</h2>", _list(_sure(report))]
    parts += ["<h2>What was not looked at</h2>", _list(_open(report))]
    if report.warnings:
        parts += ["<h2>Warnings</h2>", _list(report.warnings)]
    made = provenance(inputs, __name__)
    files = ", ".join(f"{file.name} (SHA-256 {file.sha256[:16]})" for file in made.inputs)
    used = ("python", *made.loaded)
    versions = ", ".join(
        f"{name} {number}" for name, number in made.versions.items() if name in used
    )
    footer = escape(f"squeal {__version__}; {files or 'no file'}; {versions}")
    parts.append(f"<footer><p>{footer}</p></footer>")
    head = '<meta charset="utf-8"><meta name="viewport" content="width=device-width">'
    head += f"<title>Stability</title><style>{STYLE}</style>"
    # a name may hold anything
    body = "".join(c for c in "\n".join(parts) if c.isprintable() or c == "\n")
    return f'<!doctype html>\n<html lang="en"><head>{head}</head>\n<body>\n{body}\n</body></html>\n'


def _table(table: Table) -> str:
    return f'<div class="scroll">{table.html(len(table.rows) or 1)}</div>'


def _part(part: str | Table) -> str:
    return _table(part) if isinstance(part, Table) else f"<pre>{escape(part)}</pre>"


def _list(lines: Iterable[str]) -> str:
    return "<ul>" + "".join(f"<li>{escape(line)}</li>" for line in lines) + "</ul>"


def _figure(answer: Answer, name: str, **more: Any) -> str:
    from squeal.plots.answers import drawing  # here, since a report without a page draws nothing
    from squeal.plots.style import rendered

    made = drawing(answer, name, **more)
    code = b64encode(rendered(made, "png", 150)).decode()
    image = f'<img alt="{escape(made.alternative)}" src="data:image/png;base64,{code}">'
    return f"<figure>{image}</figure>"


def _moved(report: Report) -> Table:
    """What a small change of each parameter does to the modes that grow."""
    found, table = report.eigenvalues, report.sensitivity.table()
    grow = {found.mode_of(mode) for mode in found.unstable}
    return replace(table, rows=[row for row in table.rows if row[0] in grow])


def _read(report: Report) -> Iterator[str | Table]:
    """What matrices or a scene are."""
    if report.check is None:
        yield from report.eigenvalues.notes[:1]
        return
    head, files, lines, _, hints = report.check.parts()
    hertz = ", ".join(number(f) for f in report.check.frequencies_hz)
    modes = f"lowest real modes, without friction and damping: {hertz} Hz"
    yield from (head, files, f"{lines}\n{modes}\n{hints}")


def _shapes(report: Report) -> Iterator[str]:
    """Shapes of the modes that grow, where the places of the rows are known."""
    found = report.eigenvalues
    if isinstance(report.subject, Scene):
        yield _figure(found, report.name)
        return
    if getattr(report.subject, "coordinates", None) is None:
        return
    for mode in found.unstable[:SHAPES]:
        yield _figure(found, report.name, shape=found.mode_of(mode))


def _sure(report: Report) -> Iterator[str]:
    """What proves the answers."""
    found, crossed = report.eigenvalues, report.thresholds
    where = f" on {found.extent}" if found.extent else ""
    if found.details.get("basis"):
        yield f"{basis_text(found.details['basis'], True)}."
    yield f"{len(found.eigenvalues)} roots{where}: {found.completeness}."
    if found.open:
        yield f"The {found.open}."
    worst = max((root.residual for root in found.eigenvalues), default=math.nan)
    if math.isfinite(worst):
        yield f"The largest backward error of a listed root is {worst:.2g}."
    yield from str(crossed.parts()[-1]).splitlines()


def _open(report: Report) -> Iterator[str]:
    """What the answers do not speak of."""
    found, crossed = report.eigenvalues, report.thresholds
    if found.extent:
        yield f"Roots outside of {found.extent}."
    if (limit := found.details.get("growth_limit")) is not None:
        yield f"Roots that grow by more than {number(limit, 4)} 1/s."
    yield from found.notes[1:]
    ends = number(crossed.low), number(crossed.high)
    yield f"Values of {crossed.parameter} outside of {' to '.join(ends)}."
    yield "Other values of the other parameters: `squeal scatter` draws them from ranges."
    yield (
        "Motion of finite size: this is linear stability of steady sliding. Lost contact, limit "
        "cycles and loudness need a simulation."
    )
