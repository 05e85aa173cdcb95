"""Maps over two parameters: verdicts as cells, and contours."""

import math
import re
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from squeal.plots.style import SINGLE, Drawing, literal, origin, style
from squeal.queries.pads.maps import NAMES, QUANTITIES
from squeal.results.map import Map

VERDICT_COLOURS = ("#FFFFFF", "#CFE6F5", "#C8380E", "#6A1B7B", "#8C8C8C", "#E0B040")
"""Colours of `NAMES`: stable, marginal, flutter, divergence, beyond a fold, unknown."""
COLOUR_OF = dict(zip(NAMES, VERDICT_COLOURS, strict=True))
QUARTERS = ([0.0, 0.25, 0.5, 0.75, 1.0], ["$0$", r"$\pi/4$", r"$\pi/2$", r"$3\pi/4$", r"$\pi$"])
THRESHOLD, OWN_LEVEL = "#E69F00", "#C8380E"  # curves: continued, and where the level is the scene's
GREEK = {"alpha": r"\alpha", "theta": r"\theta", "mu": r"\mu"}

Own = tuple[float, float] | None


def symbol(name: str) -> str:
    """A parameter's symbol in mathtext: alpha1 becomes \\alpha_1."""
    letters, index = re.fullmatch(r"([A-Za-z]+?)_?(\d|[a-z])?", name).groups()  # type: ignore[union-attr]
    if name in GREEK:
        letters, index = name, None
    letters = GREEK.get(letters, letters)
    return f"${letters}_{index}$" if index else f"${letters}$"


def symbol_of(parameter: str) -> str:
    """The free parameter of a pad or system as it stands on an axis."""
    return symbol(parameter) if parameter == "mu" else literal(parameter)


def _finish_axes(axes: Axes, answer: Map, own: Own) -> list[Line2D]:
    """Limits, ticks and labels of both axes; the pad marked if it lies in the ranges.

    Also draws curves on which stability is lost. Returns what stands for them in a legend.
    """
    curves = answer.details.get("threshold_curve", ())
    for curve in curves:
        axes.plot(
            *np.transpose(curve["points"]),
            gid="threshold",
            zorder=4,
            color=THRESHOLD,
            linewidth=1.8,
        )
    is_angle = [(axis.low, axis.high) == (0.0, math.pi) for axis in answer.axes]
    for k, axis in enumerate(answer.axes):
        which = "xy"[k]
        unit = answer.units[k]
        name = literal(axis.name) if own is None else symbol(axis.name)
        label = f"{name} [{unit}]" if unit.removeprefix("1") else name
        axes.set(**{f"{which}lim": (axis.low, axis.high), f"{which}label": label})
        if axis.log:
            axes.set(**{f"{which}scale": "log"})
        elif is_angle[k] and unit == "rad":
            ticks = np.multiply(QUARTERS[0], math.pi)
            axes.set(**{f"{which}ticks": ticks, f"{which}ticklabels": QUARTERS[1]})
    if all(is_angle):
        axes.set_aspect("equal")
    if own and all(a.low <= at <= a.high for a, at in zip(answer.axes, own, strict=True)):
        axes.plot(
            *own,
            "o",
            clip_on=False,
            gid="own pad",
            mfc="white",
            mec="black",
            ms=5.0,
            mew=1.0,
            zorder=6,
        )
    if not curves:
        return []
    return [Line2D([], [], label="threshold, continued", color=THRESHOLD, linewidth=1.8)]


def map_drawing(name: str, answer: Map, own: Own = None, level: float | None = None) -> Drawing:
    """Verdicts over two parameters, a cell for each point, or contours of the map's quantity.

    own: the numbers of a pad, which is marked; level: a value of the quantity whose curve
    is drawn thick.
    """
    contours = own is not None and answer.quantity is not None
    with style():
        figure = Figure(figsize=(SINGLE, 3.2 if contours else 3.6))
        axes = figure.add_subplot(facecolor="0.85")
        if contours:
            handles, what, text = _contours(axes, answer, level)
        else:
            handles, what, text = _cells(axes, answer)
        handles += _finish_axes(axes, answer, own)
        if handles:
            figure.legend(handles=handles, loc="outside upper center", ncols=2)
    title = f"{what} of {name} over {answer.axes[0].name} and {answer.axes[1].name}"
    return Drawing(figure, f"{title}: {text}.", title, origin(__name__))


Drawn = tuple[list[Any], str, str]
"""What stands in the legend, the name of what is drawn, and its extent in words."""


def _cells(axes: Axes, answer: Map) -> Drawn:
    """Verdicts, hatched where no equilibrium is admissible."""
    x = answer.axes[0].values
    y = answer.axes[1].values
    colours = [COLOUR_OF.get(verdict, VERDICT_COLOURS[4]) for verdict in answer.verdicts]
    axes.pcolormesh(
        x,
        y,
        answer.codes.T,
        shading="nearest",
        rasterized=True,
        cmap=ListedColormap(colours),
        vmin=-0.5,
        vmax=len(colours) - 0.5,
    )
    handles = []
    sentences = []
    for colour, (verdict, share) in zip(colours, answer.share.items(), strict=True):
        if share:
            percent = f"{100 * share:.1f} %"
            handles.append(Patch(fc=colour, ec="k", lw=0.5, label=f"{verdict} ({percent})"))
            sentences.append(f"{verdict} {percent}")
    if answer.admissible is not None:
        far = ~answer.admissible & (answer.codes != NAMES.index("beyond a fold"))
        if far.any():
            axes.contourf(
                x, y, far.T.astype(float), [0.5, 1.5], hatches=["////"], colors="none", zorder=1.5
            )
            handles.append(Patch(fc="none", ec="k", hatch="////", lw=0.5, label="not admissible"))
    return handles, "Verdict", ", ".join(sentences)


def _contours(axes: Axes, answer: Map, level: float | None) -> Drawn:
    """Labelled contours of the quantity over filled ones; grey where there is no value."""
    assert answer.quantity is not None
    x = answer.axes[0].values
    y = answer.axes[1].values
    quantity, unit, numbers = answer.quantity
    words = QUANTITIES[quantity][0]
    values = np.ma.masked_invalid(numbers.T)
    known = values.compressed()
    if known.size and np.ptp(known) > 0.0:
        filled = axes.contourf(x, y, values, 9, cmap="viridis", alpha=0.85)
        edges = axes.contour(x, y, values, filled.levels, colors="k", linewidths=0.5)
        axes.clabel(edges, fontsize=7, fmt="%g")
        axes.figure.colorbar(filled, ax=axes, label=f"{words} [{unit}]" if unit else words)
        if level is not None and known.min() < level < known.max():
            axes.contour(x, y, values, [level], colors=OWN_LEVEL, linewidths=1.6)
    span = "no value"
    if known.size:
        span = f"{known.min():.4g} to {known.max():.4g} {unit}"
    extent = f"{span}, on {100 * known.size / values.size:.1f} % of the area"
    return [], words.capitalize(), extent
