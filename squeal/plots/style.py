"""One style for all figures: sizes, fonts, colours, units of axes, and saving."""

import itertools
import math
import textwrap
from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.path import Path as Curve
from matplotlib.text import Annotation
from matplotlib.transforms import Bbox

from squeal.io.provenance import Provenance, digest
from squeal.io.writing import write_text, write_whole
from squeal.model.contact import STATES, contact_law
from squeal.model.pad import Model
from squeal.schema import Place, Word

SINGLE = 3.35  # inches: width of a figure over one column
DOUBLE = 6.9  # ... and over two
MOST_STEPS = 12  # half heights by which a label is moved up or down at most
MARGIN = 1.5  # points around a label that are free

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


def literal(text: str) -> str:
    """A user's text as a figure shows it: no dollar begins a formula, what no font has is a mark.

    Examples
    --------
    >>> literal("load $F_n$")
    'load \\\\$F_n\\\\$'
    """
    shown = "".join(c if c.isprintable() else "\ufffd" for c in text)
    return shown.replace("$", r"\$")


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
    for result in results:
        if result is None:
            continue
        inputs = ", ".join(f"{file.name} ({file.sha256[:16]})" for file in result.inputs)
        versions = ", ".join(f"{name} {version}" for name, version in result.versions.items())
        parts.append(
            f"computed from {inputs or 'no file'} by {result.module} "
            f"(sources {result.source_sha256}, {versions})"
        )
    drawn = f"drawn by {module} (sources {digest(module)}, matplotlib {matplotlib.__version__})"
    return "; ".join([*parts, drawn])


def blank(title: str, why: str, module: str, *results: Provenance | None) -> Drawing:
    """A figure that says why there is none."""
    with style():
        figure = Figure(figsize=(DOUBLE, 0.8))
        figure.set_layout_engine("none")
        figure.add_subplot().set_axis_off()
        figure.text(0.5, 0.5, "\n".join(textwrap.wrap(why, 90)), ha="center", va="center")
    return Drawing(figure, why, title, origin(module, *results))


def _metadata(drawing: Drawing, kind: str) -> dict[str, Any]:
    """Title, alternative text and origin under the keys of the format: pdf, svg or png.

    None keeps Matplotlib from writing its version and the date, so that equal figures are equal
    files.
    """
    title = _encodable(drawing.title)
    text = _encodable(drawing.alternative)
    made = _encodable(drawing.origin)
    if kind == "pdf":
        return {
            "Title": title,
            "Subject": text,
            "Keywords": made,
            "Creator": "squeal",
            "Producer": None,
            "CreationDate": None,
        }
    metadata = {"Title": title, "Description": text, "Source": made}
    if kind == "svg":
        return {**metadata, "Date": None}
    return {**metadata, "Software": "squeal"}


def _encodable(text: str) -> str:
    """A text in which a mark stands for what UTF-8 does not hold."""
    return text.encode("utf-8", "replace").decode()


def rendered(drawing: Drawing, kind: str, dpi: int = 200) -> bytes:
    """A drawing as pdf, svg or png."""
    with style(), matplotlib.rc_context({"svg.hashsalt": "squeal"}):
        buffer = BytesIO()
        drawing.figure.savefig(buffer, format=kind, dpi=dpi, metadata=_metadata(drawing, kind))
    return buffer.getvalue()


def save(drawing: Drawing, path: Path, text: bool = True) -> None:
    """Write a PDF, SVG or PNG by the end of the name, equal bytes for equal input.

    The alternative text is in the file's metadata and, with `text`, in a file .txt beside it.
    """
    kind = Word(("pdf", "svg", "png")).read(path.suffix[1:].lower(), Place(str(path)))
    content = rendered(drawing, kind)  # before the file is opened
    write_whole(path, lambda stream: stream.write(content))
    if text:
        write_text(path.with_suffix(".txt"), drawing.alternative + "\n")


STATE_COLOURS = dict(zip(STATES, ("#3498DB", "#000000", "#6A1B7B", "#C8380E"), strict=True))
"""Colours of the states 1 to 4, told apart in normal and in colour-deficient vision."""


def colours(model: Model) -> dict[str, str]:
    """Colour of each state name of a model; B2's partial contact takes that of state 3."""
    name = contact_law(model).state_name
    return {name(state): STATE_COLOURS[state] for state in STATES[::-1]}


def state_label(state: str) -> str:
    """The name of a contact state, with a word before a mere number."""
    return f"state {state}" if state.isdigit() else state


def frequency_limits(values: np.ndarray) -> tuple[float, float]:
    """Limits of an axis of frequency (Hz): from zero on, but for a band of high ones."""
    frequencies = np.abs(values.imag) / math.tau
    low = float(frequencies.min(initial=np.inf))
    high = float(frequencies.max(initial=0.0))
    if 0.5 * high < low < high:
        margin = 0.1 * (high - low)
        return low - margin, high + margin
    return 0.0, 1.1 * high or 1.0


def write_beside(
    axes: Axes, text: str, point: tuple[float, float], offset: tuple[float, float], **look: Any
) -> None:
    """Write a text beside a point, on the side to which the offset (right, up) in points leads."""
    right, up = offset
    vertical = "center"
    if up:
        vertical = "bottom" if up > 0 else "top"
    axes.annotate(
        text,
        point,
        offset,
        textcoords="offset points",
        ha="left" if right > 0 else "right",
        va=vertical,
        **look,
    )


def move_apart(figure: Figure) -> None:
    """Move labels of a figure that `write_beside` wrote off each other, and off lines."""
    figure.draw_without_rendering()  # which decides the sizes of the axes
    for axes in figure.axes:
        obstacles = [line.get_path().transformed(line.get_transform()) for line in axes.lines]
        for label in axes.texts:
            if isinstance(label, Annotation):
                box = _move(label, axes, obstacles)
                obstacles.append(Curve(box.corners()[[0, 1, 3, 2, 0]]))  # its outline


def _move(label: Annotation, axes: Axes, obstacles: Sequence[Curve]) -> Bbox:
    """Move a label to a free position near its point, and return its box with a margin.

    It may stay where it is, stand at the other side of the point, and be moved from both up or down
    by half heights. The nearest position is taken at which it lies in the axes and crosses no
    obstacle; if there is none, that with the fewest crossings and corners outside.

    obstacles: lines, and outlines of earlier labels; these and the box in pixels.
    """
    right, up = label.xyann  # points
    pixels = axes.figure.dpi / 72.0  # of a point
    half_height = label.get_window_extent().height / pixels / 2.0

    def move_to(position: tuple[int, float]) -> Bbox:
        steps, offset = position  # half heights upwards, and points to the right
        label.xyann = (offset, up + steps * half_height)
        label.set_horizontalalignment("left" if offset > 0 else "right")
        return label.get_window_extent().padded(MARGIN * pixels)

    def faults(position: tuple[int, float]) -> int:
        box = move_to(position)
        crossings = sum(curve.intersects_bbox(box, filled=False) for curve in obstacles)
        # crossings plus corners outside, less 4, which changes no order
        return crossings - axes.bbox.count_contains(box.corners())

    steps_upwards = sorted(range(-MOST_STEPS, MOST_STEPS + 1), key=abs)  # the nearest first
    # of positions with equally few faults `min` takes the first one
    return move_to(min(itertools.product(steps_upwards, (right, -right)), key=faults))


def write_upright(axes: Axes, value: float, text: str) -> None:
    """Write a text upwards from near the bottom, right of a value on the horizontal axis."""
    axes.annotate(
        text,
        (value, 0.08),
        (3, 0),
        ("data", "axes fraction"),
        "offset points",
        rotation=90,
        va="bottom",
        ha="left",
        fontsize=7,
    )


def engineering(value: float) -> str:
    """A number in four digits, where it is long with a power of ten that is a multiple of three.

    Examples
    --------
    >>> [engineering(value) for value in (0.35, -4500.0, 1.8e7, 2.5e-4, 0.0)]
    ['0.35', '-4500', '18e6', '250e-6', '0']
    """
    power = 0
    if value and not 1e-3 <= abs(value) < 1e5:
        power = 3 * math.floor(math.log10(abs(value)) / 3)
    return f"{value / 10.0**power + 0.0:.4g}" + (f"e{power}" if power else "")


def hertz(omega: float) -> str:
    """The frequency of an angular one (rad/s) in four digits."""
    return f"{omega / math.tau:.4g} Hz"
