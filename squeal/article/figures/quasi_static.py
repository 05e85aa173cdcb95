"""Fig. 13: where the conditions (23a, b) for quasi-static sliding hold, and what slides there."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from squeal.article.cases import CASES
from squeal.article.outline import Outline, angle_axes_of_pi, draw_areas
from squeal.article.studies.angles import PARTIAL, Angles
from squeal.article.studies.quasi_static import QuasiStatic, quasi_static
from squeal.model.pad import Pad
from squeal.plots.style import DOUBLE, Drawing, origin, style

RED = "#C8380E"
BLACK = ("white", "black")  # colours of the two codes of a map
GREY = ("white", "0.8")
MapPanel = tuple[str, Outline, tuple[str, str]]
"""Title, areas, and the colours of their codes."""
Marks = Mapping[str, tuple[float, float]]
"""Letters of cases with their (alpha1, alpha2) in rad."""


OFFSETS = {"a": (0.0, 10.0), "b": (-11.0, 0.0), "c": (-5.0, 14.0), "d": (8.0, 9.0)}
"""From a case's dot to its letter, in points, so that neither covers what is drawn there."""


def _mark_cases(axes: Axes, marks: Marks) -> None:
    """Draw a dot at the angles of each case, and its letter, if it has one, on a short line.

    A pad that is no case stands under the letter "", and gets the dot alone.
    """
    for name, (alpha1, alpha2) in marks.items():
        at = (alpha1 / np.pi, alpha2 / np.pi)
        dot: Any = {"marker": "o", "ms": 3.5, "mfc": "white", "mec": RED, "mew": 0.9}
        axes.plot(*at, **dot, clip_on=False, zorder=6)
        if not name:
            continue
        box = {"boxstyle": "circle,pad=0.1", "fc": "white", "ec": RED, "lw": 0.9}
        line = {"arrowstyle": "-", "color": RED, "lw": 0.9, "shrinkA": 0.0, "shrinkB": 0.0}
        look: Any = {"ha": "center", "va": "center", "fontsize": 8, "zorder": 5}
        offset = OFFSETS.get(name, (8.0, 8.0))
        axes.annotate(
            name, at, offset, textcoords="offset points", bbox=box, arrowprops=line, **look
        )


def quasi_static_figure(record: QuasiStatic, angles: Angles) -> Figure:
    """Fig. 13 as printed, the complete conditions, their state, and equilibria of B2.

    The regions are black as in the article, within their traced boundaries.
    """
    no_growth = np.arange(4) >= PARTIAL  # of each code of the map of B2
    equilibria = angles.b2.regrouped(no_growth.astype(int))
    of_b2 = (f"(d) B2, no growth: {100 * angles.share.quiet:.1f} %", equilibria, BLACK)
    return _drawn((*_panels_of_conditions(record), of_b2), record, CASES)


def _panels_of_conditions(record: QuasiStatic) -> tuple[MapPanel, MapPanel, MapPanel]:
    """The panels (a) to (c), which need no case."""
    share = record.share
    return (
        (f"(a) as printed: {100 * share.as_printed:.1f} %", record.as_printed, BLACK),
        (f"(b) complete conditions: {100 * share.complete:.1f} %", record.complete, BLACK),
        ("(c) the state itself: a curve", record.complete, GREY),
    )


def _drawn(panels: Sequence[MapPanel], record: QuasiStatic, marks: Marks) -> Figure:
    """Panels side by side with marks of pads.

    The third one, (c), also has the curves `record.state`, pairs (alpha1, alpha2) in rad.
    """
    with style():
        figure = Figure(figsize=(DOUBLE * len(panels) / 4, 2.3))
        grid = figure.subplots(1, len(panels), sharey=True)
        for axes, (title, outline, colours) in zip(grid, panels, strict=True):
            draw_areas(axes, outline, colours)
            _mark_cases(axes, marks)
            axes.set_title(title, fontsize=8, pad=16.0)
            angle_axes_of_pi(axes)
        for curve in record.state:
            alpha1, alpha2 = np.array(curve).T / np.pi
            grid[2].plot(alpha1, alpha2, color="black", lw=1.6, zorder=3)
        for axes in grid[1:]:
            axes.set_ylabel("")
    return figure


def alternative_text(record: QuasiStatic, angles: Angles) -> str:
    """The maps in words."""

    def percent(share: float) -> str:
        return f"{100 * share:.1f} % of the map"

    return (
        "Four maps over the spring angles alpha1 and alpha2 from 0 to pi at the friction "
        f"coefficient {record.mu:g}. Black: (a) where the conditions (23a) and (23b) hold as "
        f"printed, {percent(record.share.as_printed)}; (b) where the complete necessary conditions "
        f"hold, {percent(record.share.complete)}; (c) "
        "the curve on which the sliding state of these conditions exists, within the area of (b) "
        "in grey; (d) where model B2 has a sliding equilibrium about which no mode grows, "
        f"{percent(angles.share.quiet)}. Letters mark the cases."
    )


def draw_conditions(pad: Pad) -> Drawing:
    """Fig. 13 of any pad, whose place is a dot; the first three maps, which need no equilibria."""
    record = quasi_static(pad)
    share = record.share
    alternative = (
        "Three maps over the spring angles alpha1 and alpha2 from 0 to pi at the friction "
        f"coefficient {record.mu:g}. Black: (a) where the conditions (23a) and (23b) hold as "
        f"printed, {100 * share.as_printed:.1f} % of the map; (b) where the complete necessary "
        f"conditions hold, {100 * share.complete:.1f} %; (c) the curve on which their state exists."
    )
    figure = _drawn(_panels_of_conditions(record), record, {"": (pad.alpha1, pad.alpha2)})
    return Drawing(figure, alternative, "Map of quasi-static sliding", origin(__name__))


def draw(record: QuasiStatic, angles: Angles) -> Drawing:
    """The figure, ready to be saved."""
    title = "Map of the quasi-static sliding motion"
    made = origin(__name__, record.provenance, angles.provenance)
    figure = quasi_static_figure(record, angles)
    return Drawing(figure, alternative_text(record, angles), title, made)


CAPTIONS = {
    "fig13": r"""Quasi-static sliding at $\mu = {}$\val{quasi_static.mu} with the reference set
(black). (a)~\aeqs{23a}{23b} hold as printed, as in the article. (b)~The complete necessary
conditions of the same state hold: $\mu K_{21} < K_{11}$, $K_{31} > 0$ and
$\mu h K_{21} < K_{31}$. (c)~The state itself exists: $K_{31} = h K_{11}$ and
$\mu K_{21} < K_{11}$, a curve within the region of (b) (grey). (d)~Model B2 has a sliding
equilibrium about which no mode grows. Dots mark the four cases."""
}
