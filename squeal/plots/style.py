"""One style for all figures: sizes, fonts, colours of the contact states, and saving."""

import textwrap
from contextlib import AbstractContextManager
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.backends.backend_pdf import FigureCanvasPdf
from matplotlib.figure import Figure

from squeal.files.provenance import Provenance
from squeal.files.sources import digest
from squeal.files.writing import write_text, write_whole

SINGLE, DOUBLE = 3.35, 6.9
"""Widths in inches of a figure over one column and over two."""

# fmt: off
RC: Any = {
    "font.family": "STIXGeneral", "mathtext.fontset": "stix", "font.size": 8.0,
    "axes.titlesize": 8.0, "axes.labelsize": 8.0, "xtick.labelsize": 8.0, "ytick.labelsize": 8.0,
    "legend.fontsize": 8.0, "axes.linewidth": 0.6, "xtick.major.width": 0.6,
    "ytick.major.width": 0.6, "xtick.direction": "in", "ytick.direction": "in", "xtick.top": True,
    "ytick.right": True, "lines.linewidth": 0.9, "lines.solid_capstyle": "butt",
    "lines.solid_joinstyle": "round", "legend.frameon": False, "legend.handlelength": 1.8,
    "legend.borderaxespad": 0.0, "hatch.linewidth": 0.5, "pdf.fonttype": 42,
    "figure.constrained_layout.use": True,
}
# fmt: on


def style() -> AbstractContextManager[None]:
    """Context in which figures are made and saved."""
    return matplotlib.rc_context(RC)


@dataclass(frozen=True)
class Drawing:
    """A figure, its alternative text, and what it was made from (for the PDF's metadata)."""

    figure: Figure
    alternative: str
    title: str
    origin: str


def origin(module: str, *results: Provenance | None) -> str:
    """One line that names the files and sources behind each result and the figure's own sources.

    A result that was not read from a file has no provenance.
    """
    parts = []
    for made in results:
        if made is None:
            continue
        inputs = ", ".join(f"{file.name} ({file.sha256[:16]})" for file in made.inputs)
        versions = ", ".join(f"{k} {v}" for k, v in made.versions.items())
        parts.append(
            f"computed from {inputs or 'no file'} by {made.module} "
            f"(sources {made.source_sha256}, {versions})"
        )
    parts.append(
        f"drawn by {module} (sources {digest(module)}, matplotlib {matplotlib.__version__})"
    )
    return "; ".join(parts)


def blank(title: str, why: str, module: str, *results: Provenance | None) -> Drawing:
    """A figure that says why there is none."""
    with style():
        figure = Figure(figsize=(DOUBLE, 0.8))
        figure.text(0.5, 0.5, "\n".join(textwrap.wrap(why, 90)), ha="center", va="center")
    return Drawing(figure, why, title, origin(module, *results))


def _metadata(drawing: Drawing, kind: str) -> dict[str, Any]:
    """Title, alternative text and origin as the format holds them; no dates."""
    title, text, made = drawing.title, drawing.alternative, drawing.origin
    if kind == "pdf":
        more = {"Creator": "squeal", "Producer": None, "CreationDate": None}
        return {"Title": title, "Subject": text, "Keywords": made, **more}
    own = {"Date": None} if kind == "svg" else {"Software": "squeal"}
    return {"Title": title, "Description": text, "Source": made, **own}


def _lay_out(figure: Figure) -> None:
    """Lay a figure out for a PDF, for which `savefig` alone would draw it twice."""
    figure.set_dpi(72)  # as a PDF has it
    FigureCanvasPdf(figure)
    layout = figure.get_layout_engine()
    if layout is not None:
        layout.execute(figure)
    with matplotlib.rc_context({"figure.constrained_layout.use": False}):
        figure.set_layout_engine(None)


def save(drawing: Drawing, path: Path, text: bool = True) -> None:
    """Write a PDF, SVG or PNG by the end of the name, equal bytes for equal input.

    The alternative text is in the file's metadata and, with `text`, in a file .txt beside it.
    """
    kind = path.suffix[1:]
    metadata = _metadata(drawing, kind)
    with style(), matplotlib.rc_context({"svg.hashsalt": "squeal"}):
        if kind == "pdf":
            _lay_out(drawing.figure)
        made = BytesIO()  # a disc that fills up leaves Matplotlib in the middle of a file
        drawing.figure.savefig(made, format=kind, dpi=200, metadata=metadata)
    write_whole(path, lambda stream: stream.write(made.getbuffer()), binary=True)
    if text:
        write_text(path.with_suffix(".txt"), drawing.alternative + "\n")
